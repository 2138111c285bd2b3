"""Gaps under a spacing of the fluid between bodies that it wets: no particle fits there, and none presses."""

from __future__ import annotations

import warnings

import numpy as np

from ..base.geometry import turn


class FluidWarning(UserWarning):
    """The spacing of a liquid does not resolve the scene."""


THIN = 3.0  # spacings: free edges of plates of 1 and 2 stir the liquid twenty times as much as those of 4
THIN_IMPLICIT = 2.0  # the same, of the incompressible form
NEAR = 2.0  # distance of particles from a gap that they wet, over the spacing


def warn_of_gaps(bodies, slips, position, spacing, held, above):
    """Warns of bodies nearer to others than a spacing where the liquid wets them at the start.

    Parameters
    ----------
    bodies, slips, position, spacing, held
        As in `gaps`.
    above : int
        Frames above the caller to which the warning points.

    Returns
    -------
    bool
        True if there are some.
    """
    text = gaps(bodies, slips, position, spacing, held)
    if text:
        warnings.warn(text, FluidWarning, stacklevel=above + 1)
    return bool(text)


def gaps(bodies, slips, position, spacing, held=()):
    """Finds bodies nearer to others than a spacing where the liquid wets them.

    Parameters
    ----------
    bodies : list
        Contactors, as `Running` has them: ids, position, rotation, points in the axes of the body, plane.
    slips : list of int
        How the liquid meets each contactor; 0: not at all.
    position : ndarray (n, dim)
        Places of the particles [m].
    spacing : float
        Distance of the particles [m].
    held : set of int, optional
        Ids of bodies that do not move freely at all: a gap between two of them changes no motion.

    Returns
    -------
    str
        Text of a warning, empty if there are none.
    """
    from scipy.spatial import cKDTree

    met = [b for b, slip in zip(bodies, slips) if slip]
    surfaces = [(b, *_surface(b, spacing)) for b in met if not b.plane and len(b.points)]
    planes = [(b, *_surface(b, spacing)) for b in met if b.plane]
    if not surfaces or not len(position):
        return ""
    place = np.concatenate([p for _, p, _ in surfaces])
    owner = np.concatenate([np.full(len(p), int(b.ids[0])) for b, p, _ in surfaces])
    wet = cKDTree(position).query(place)[0] < NEAR * spacing
    place, owner = place[wet], owner[wet]
    found = {}
    for body, at, normal in planes:
        low = np.flatnonzero((place - at[0]) @ normal[0] < spacing)
        for k in np.unique(owner[low]):
            if int(k) in held and int(body.ids[0]) in held:
                continue
            found.setdefault((int(k), int(body.ids[0])), place[low[owner[low] == k][0]])
    if len(place):
        pairs = cKDTree(place).query_pairs(spacing, output_type="ndarray")
        fixed = np.isin(owner, list(held))
        pairs = pairs[~(fixed[pairs[:, 0]] & fixed[pairs[:, 1]])]
        for a, b in pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]:
            found.setdefault((int(min(owner[a], owner[b])), int(max(owner[a], owner[b]))), place[a])
    if not found:
        return ""
    (a, b), at = next(iter(found.items()))
    return (
        f"{len(found)} pairs of bodies in the liquid leave gaps under its spacing of {spacing:g} m, the first are bodies {a} and "
        f"{b} at {tuple(round(float(x), 6) for x in at)}: no particle fits between, so that nothing presses there, and a body "
        "on the bed has no buoyancy; give gaps of a spacing or more, or a smaller spacing"
    )


def _surface(body, spacing):
    """Places (n, dim) of the points of a contactor on its surface and the normals out of it, in space."""
    points = body.points if body.plane else body.points.where(body.points.depth < spacing)
    place, normal = points.place + points.normal * points.depth[:, None], points.normal
    if body.rotation is not None and len(place):
        dim = place.shape[1]
        all_of = np.broadcast_to(body.rotation, (len(place), *np.shape(body.rotation)))
        place, normal = turn(all_of, place, dim), turn(all_of, normal, dim)
    return place + body.position, normal


DENSE, WIDE = 0.4, 2.0  # share of space that grains take, and length of the kernel over the spacing from which it is enough


def warn_of_thin(name, thickness, spacing, incompressible, above):
    """Warns of a deformable body so thin that points below its free edges stir a liquid at rest.

    Parameters
    ----------
    name : str
        Name of the body.
    thickness : float
        Its least thickness [m].
    spacing : float
        Distance of the particles [m].
    incompressible : bool
        True for the incompressible form, which bears thinner bodies.
    above : int
        Frames above the caller to which the warning points.
    """
    least = THIN_IMPLICIT if incompressible else THIN
    if thickness < least * spacing:
        damped = "" if incompressible else ", or artificial=0.1, with a tenth less pressure"
        warnings.warn(
            f"deformable body {name!r} is {thickness:g} m thick, under {least:g} spacings of the liquid: an edge of it that ends "
            f"in the liquid stirs it from rest; give spacing={thickness / (least + 1):.2g}{damped}",
            FluidWarning,
            stacklevel=above + 1,
        )


def warn_of_beds(bodies, sizes, spacing, smoothing, above):
    """Warns of dense beds of grains in a liquid whose kernel is short for them.

    Parameters
    ----------
    bodies : list
        Grains, as `Running` has them: position.
    sizes : list of float
        Volume of each, in 2D area [m3 or m2].
    spacing : float
        Distance of the particles [m].
    smoothing : float
        Length of the kernel over it.
    above : int
        Frames above the caller to which the warning points.
    """
    if not bodies or smoothing >= WIDE:
        return
    share = _shares(bodies, sizes, spacing)
    if np.max(share) > DENSE:
        warnings.warn(
            f"grains take {np.max(share):.0%} of the space in places, and particles that flow into such beds lie farther apart "
            f"than smoothing={smoothing:g} resolves: pressure drops may be wrong by a quarter; give cn.fluid(smoothing=2)",
            FluidWarning,
            stacklevel=above + 1,
        )


def _shares(bodies, sizes, spacing):
    """Share of space (n,) that grains take about each of them: volumes are shared out linearly to the corners of cells of two
    spacings, as counts of centres in cells jump."""
    place = np.array([b.position for b in bodies]) / (2 * spacing)
    low, dim = np.floor(place).astype(np.int64), place.shape[1]
    corners = np.stack([a.ravel() for a in np.meshgrid(*[[0, 1]] * dim, indexing="ij")], axis=1)
    weight = np.prod(np.where(corners[None] == 1, (place - low)[:, None], 1 - (place - low)[:, None]), axis=2)
    cells, which = np.unique((low[:, None] + corners[None]).reshape(-1, dim), axis=0, return_inverse=True)
    which = which.reshape(len(place), -1)
    share = np.bincount(which.ravel(), (weight * np.asarray(sizes)[:, None]).ravel(), len(cells)) / (2 * spacing) ** dim
    return np.sum(weight * share[which], axis=1)


CALM = 0.1  # viscosity over the root of density, tension and spacing, above which drops of 20 spacings stay whole


def warn_of_tension(settings, above):
    """Warns of surface tension beside so little viscosity that a drop falls apart in some oscillations.

    Parameters
    ----------
    settings : dict
        Those of the liquid.
    above : int
        Frames above the caller to which the warning points.
    """
    if not settings["surface_tension"] > 0:
        return
    density, spacing = settings["density"], settings["spacing"]
    of_sound = density * settings["artificial"] * settings["sound_speed"] * settings["smoothing"] * spacing / 8
    due = CALM * np.sqrt(density * settings["surface_tension"] * spacing)
    if settings["viscosity"] + of_sound < due:
        artificial = settings["artificial"] * (due - settings["viscosity"]) / of_sound if of_sound > 0 else 0.1
        warnings.warn(
            f"surface_tension of the fluid beside a viscosity of {settings['viscosity']:g} Pa s: pressures below 0 within drops "
            f"tear them apart after some oscillations at this spacing; give viscosity={due:.2g}, or artificial="
            f"{max(0.1, artificial):.2g}",
            FluidWarning,
            stacklevel=above + 1,
        )


LIGHT = 0.25  # weight of a bed in the liquid over the pressure of that, below which flow lifts it too early


def warn_of_light_beds(bodies, sizes, densities, gravity, position, spacing, density, above):
    """Warns of beds of free grains so light beside the pressure of the liquid that a flow lifts them too early.

    Parameters
    ----------
    bodies : list
        Free grains, as `Running` has them: position.
    sizes : list of float
        Volume of each, in 2D area [m3 or m2].
    densities : list of float
        Density of each [kg/m3].
    gravity : ndarray (dim,)
        Gravity [m/s2].
    position : ndarray (n, dim)
        Places of the particles of the liquid [m].
    spacing : float
        Distance of the particles [m].
    density : float
        Density of the liquid [kg/m3].
    above : int
        Frames above the caller to which the warning points.
    """
    weight = _weight_of_bed(bodies, sizes, densities, gravity, position, spacing, density)
    if 0 < weight < LIGHT:
        warnings.warn(
            f"a bed of free grains weighs {weight:.0%} of the pressure of the liquid at its foot, and a pressure drop as small "
            "as that is found up to twice too large where a flow enters: the velocity at which the bed begins to lift may come "
            "out at 0.4 of that by Ergun's law; take that velocity from the law, or give a shallower liquid or a higher bed",
            FluidWarning,
            stacklevel=above + 1,
        )


def _weight_of_bed(bodies, sizes, densities, gravity, position, spacing, density):
    """Weight of a dense bed in the liquid over the pressure of that at its foot; 0 without such a bed. As above."""
    pull = float(np.linalg.norm(gravity))
    if not bodies or not pull > 0:
        return 0.0
    share, along = _shares(bodies, sizes, spacing), np.array([b.position for b in bodies]) @ (gravity / pull)
    bed = share > DENSE
    if not np.any(bed):
        return 0.0
    down = position @ (gravity / pull)
    high, deep = float(np.ptp(along[bed])) + spacing, float(along[bed].max() - down.min()) + 0.5 * spacing
    return float(np.mean((share * (np.array(densities) / density - 1))[bed])) * high / deep
