"""Gaps under a spacing of the fluid between bodies that it wets: no particle fits there, and none presses."""

from __future__ import annotations

import warnings

import numpy as np

from ..base.geometry import turn


class FluidWarning(UserWarning):
    """The spacing of a liquid does not resolve the scene."""


THIN = 3.0  # spacings: free edges of plates of 1 and 2 stir the liquid twenty times as much as those of 4
NEAR = 2.0  # distance of particles from a gap that they wet, over the spacing


def warn_of_gaps(bodies, position, spacing, slips, above):
    """Warns once of bodies nearer to others than a spacing where the liquid wets them at the start.

    Parameters
    ----------
    bodies : list
        Contactors, as `Running` has them: ids, position, rotation, points in the axes of the body, plane.
    position : ndarray (n, dim)
        Places of the particles [m].
    spacing : float
        Distance of the particles [m].
    slips : list of int
        How the liquid meets each contactor; 0: not at all.
    above : int
        Frames above the caller to which the warning points.
    """
    from scipy.spatial import cKDTree

    met = [b for b, slip in zip(bodies, slips) if slip]
    surfaces = [(b, *_surface(b, spacing)) for b in met if not b.plane and len(b.points)]
    planes = [(b, *_surface(b, spacing)) for b in met if b.plane]
    if not surfaces or not len(position):
        return
    place = np.concatenate([p for _, p, _ in surfaces])
    owner = np.concatenate([np.full(len(p), int(b.ids[0])) for b, p, _ in surfaces])
    wet = cKDTree(position).query(place)[0] < NEAR * spacing
    place, owner = place[wet], owner[wet]
    found = {}
    for body, at, normal in planes:
        low = np.flatnonzero((place - at[0]) @ normal[0] < spacing)
        for k in np.unique(owner[low]):
            found.setdefault((int(k), int(body.ids[0])), place[low[owner[low] == k][0]])
    if len(place):
        pairs = cKDTree(place).query_pairs(spacing, output_type="ndarray")
        for a, b in pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]:
            found.setdefault((int(min(owner[a], owner[b])), int(max(owner[a], owner[b]))), place[a])
    if not found:
        return
    (a, b), at = next(iter(found.items()))
    warnings.warn(
        f"{len(found)} pairs of bodies in the liquid leave gaps under its spacing of {spacing:g} m, the first are bodies {a} and "
        f"{b} at {tuple(round(float(x), 6) for x in at)}: no particle fits between, so that nothing presses there, and a body "
        "on the bed has no buoyancy; give gaps of a spacing or more, or a smaller spacing",
        FluidWarning,
        stacklevel=above + 1,
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


def warn_of_thin(name, thickness, spacing, above):
    """Warns of a deformable body so thin that points below its free edges stir a liquid at rest.

    Parameters
    ----------
    name : str
        Name of the body.
    thickness : float
        Its least thickness [m].
    spacing : float
        Distance of the particles [m].
    above : int
        Frames above the caller to which the warning points.
    """
    if thickness < THIN * spacing:
        warnings.warn(
            f"deformable body {name!r} is {thickness:g} m thick, under {THIN:g} spacings of the liquid: an edge of it that ends "
            f"in the liquid stirs it from rest; give spacing={thickness / 4:.2g}, or artificial=0.1, with a tenth less pressure",
            FluidWarning,
            stacklevel=above,
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
    place = np.array([b.position for b in bodies])
    cells, which = np.unique(np.floor(place / (2 * spacing)), axis=0, return_inverse=True)
    share = np.bincount(which.ravel(), sizes) / (2 * spacing) ** cells.shape[1]
    if np.max(share) > DENSE:
        warnings.warn(
            f"grains take {np.max(share):.0%} of the space in places, and particles that flow into such beds lie farther apart "
            f"than smoothing={smoothing:g} resolves: pressure drops may be wrong by a quarter; give cn.fluid(smoothing=2)",
            FluidWarning,
            stacklevel=above + 1,
        )
