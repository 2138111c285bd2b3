"""Looks at a liquid before its first step: depths of bodies, pressures of the start, sub-steps of a step."""

from __future__ import annotations

import math
import warnings

import numpy as np

from ..model.fluid_skins import flat_pieces
from ..model.mesh_parts import group_nodes
from .fluid_gaps import FluidWarning

MANY = 2000  # sub-steps of a step from which they are told: such a step takes as long as a usual run
USUAL = 100  # sub-steps of a step that the remedy names
DAMPING_THETA = 0.6  # theta from which vibrations that a step does not resolve die out beside the liquid
# Density of a deformable body over that of the liquid, below which they grow at theta = 1/2: weakly compressible, incompressible.
LIGHT = 1.0, 0.002
SQUEEZED = 0.5  # change of density at the start from which the core refuses the flow


def warn_of_depth(sets, held, depth, above):
    """Warns of moving bodies in 2D whose masses are those of another depth than the one over which the liquid presses.

    Parameters
    ----------
    sets : list of BodySet
        Sets of bodies that the liquid meets, with ids.
    held : set of int
        Ids of bodies that do not move freely at all.
    depth : float
        That of the scene [m].
    above : int
        Frames above the caller to which the warning points.
    """
    for s in sets:
        if s.mesh is not None or s.depth is None or abs(s.depth - depth) <= 1e-9 * depth:
            continue
        free = [int(k) for k in s.own_ids if int(k) not in held]
        if free:
            warnings.warn(
                f"depth of body {free[0]} is {s.depth:g} m, from which its mass comes, and that of the scene, over which the "
                f"liquid presses, {depth:g} m: it floats as if {s.depth / depth:.3g} times as dense; give both the same, "
                f"cn.Scene(depth={s.depth:g}) or depth={depth:g} of the body",
                FluidWarning,
                stacklevel=above + 1,
            )
            return


LIST = 0.5  # distance beyond their reach over which particles are listed, over the spacing: `skin` of the core


def refuse_narrow_cell(lengths, spacing, smoothing):
    """Refuses a periodic cell in which a particle would meet others and their images.

    Parameters
    ----------
    lengths : ndarray (dim,)
        Length of the cell along each axis, inf along those that are not periodic [m].
    spacing : float
        Distance of the particles [m].
    smoothing : float
        Length of the kernel over it.

    Raises
    ------
    ValueError
        If the cell is shorter than three times the distance over which particles are listed.
    """
    least = 3 * (2 * smoothing + LIST)
    for axis in np.flatnonzero(lengths < least * spacing):
        raise ValueError(
            f"the periodic cell is {lengths[axis]:g} m long along axis {axis}, and a liquid needs {least:g} spacings, "
            f"{least * spacing:g} m (three times the {2 * smoothing + LIST:g} over which its particles are listed): give a "
            f"longer cell, or cn.fluid(spacing={lengths[axis] / math.ceil(least):.6g})"
        )


def warn_of_uneven_cell(lengths, position, spacing, above):
    """Warns of a liquid that goes round a periodic cell which is no whole number of spacings long.

    Parameters
    ----------
    lengths : ndarray (dim,)
        As of `refuse_narrow_cell`.
    position : ndarray (n, dim)
        Places of the particles, those in bodies too [m].
    spacing : float
        Distance of the particles [m].
    above : int
        Frames above the caller to which the warning points.
    """
    gap = lengths - (np.ptp(position, axis=0) + spacing)
    for axis in np.flatnonzero((np.abs(gap) < spacing) & (np.abs(gap) > 1e-3 * spacing)):
        rows = max(1, round(lengths[axis] / spacing))
        warnings.warn(
            f"the periodic cell is {lengths[axis]:g} m long along axis {axis}, and the rows of the liquid "
            f"{'leave a gap of' if gap[axis] > 0 else 'overlap by'} {abs(gap[axis]) / spacing:.2g} spacings where they meet "
            f"their images, which sets still liquid in motion: give cn.fluid(spacing={lengths[axis] / rows:.6g}), or a cell of "
            f"{rows * spacing:g} m",
            FluidWarning,
            stacklevel=above + 1,
        )


def refuse_squeezed(pressures, settings):
    """Refuses given pressures of the start by which a weakly compressible liquid would change its volume by half.

    Parameters
    ----------
    pressures : list of ndarray (n,)
        Pressures of each region for which they are given [Pa]; of others the speed of sound is to blame.
    settings : dict
        Those of the liquid.

    Raises
    ------
    ValueError
        If there is such a pressure.
    """
    if not pressures:
        return
    pressure, density, sound = np.concatenate(pressures), settings["density"], settings["sound_speed"]
    most, wrong = SQUEEZED * density * sound**2, int(np.argmax(np.abs(pressure)))
    if abs(pressure[wrong]) >= most and not settings["incompressible"]:
        enough = 10 * math.sqrt(abs(pressure[wrong]) / density)
        raise ValueError(
            f"pressure of the fluid is {pressure[wrong]:g} Pa at the start, and with its sound speed of {sound:g} m/s {most:.3g} "
            f"Pa change its volume by half: give a smaller pressure, or cn.fluid(sound_speed={enough:.3g})"
        )


def warn_of_sub_steps(settings, stable_step, h, above):
    """Warns of a step that takes very many sub-steps of the weakly compressible liquid.

    Parameters
    ----------
    settings : dict
        Those of the liquid.
    stable_step : float
        Longest sub-step [s].
    h : float
        Length of the step [s].
    above : int
        Frames above the caller to which the warning points.

    Returns
    -------
    bool
        True if it does.
    """
    many = h / stable_step
    if many < MANY:
        return False
    length, slower = settings["smoothing"] * settings["spacing"], ""
    if settings["viscosity"] * stable_step >= 0.124 * settings["density"] * length**2:
        slower = f"a viscosity below {settings['viscosity']:g} Pa s, "
    elif settings["sound_speed"] * stable_step >= 0.1 * length:
        slower = f"a sound_speed below {settings['sound_speed']:g} m/s, "
    warnings.warn(
        f"a step of {h:g} s takes {math.ceil(many)} sub-steps of the liquid, and the time of as many: give a smaller dt, {slower}"
        f"or a larger spacing than {settings['spacing']:g} m; dt={h * USUAL / many:.1g} takes some {USUAL}",
        FluidWarning,
        stacklevel=above + 1,
    )
    return True


def _least_density(body):
    """Least density of a deformable body as given, of parts joined by ties that of each, otherwise mass over volume [kg/m3]."""
    if hasattr(body, "parts"):
        return min(_least_density(part) for part in body.parts.values())
    given = getattr(body, "given", {}).get("density")
    if given is not None:
        return min(float(np.min(one)) for one in (given.values() if isinstance(given, dict) else [given]))
    corner = (body.points - body.points.mean(axis=0))[flat_pieces(body)]
    volume = float(np.sum(np.linalg.det(corner))) / math.factorial(body.dim)
    if body.dim == 2:
        volume *= getattr(body, "thickness", 1.0)
    return float(np.sum(body.nodal_mass())) / volume


def _moves_freely(d):
    """True if a node of a deformable body is neither held along all axes nor of a rigid part."""
    held = np.zeros(np.shape(d.body.points), bool)
    for group, axes in d.fixed.items():
        for axis in axes:
            held[group_nodes(d.body, group), "xyz".index(axis)] = True
    for group in d.rigid:
        held[group_nodes(d.body, group)] = True
    return not held.all()


def warn_of_light_mesh(d, settings, theta, above):
    """Warns of a deformable body lighter than the liquid whose vibrations nothing damps: those that a step does not resolve grow.

    Parameters
    ----------
    d : Deformable
        The body.
    settings : Fluid
        A region of the liquid, with its density and form.
    theta : float
        That of the step.
    above : int
        Frames above the caller to which the warning points.
    """
    if theta >= DAMPING_THETA or d.modal_damping is not None or np.any(d.body.lower[4]) or not _moves_freely(d):
        return
    density = _least_density(d.body)
    if density >= LIGHT[settings.incompressible] * settings.density:
        return
    other = "" if settings.incompressible else ", or the liquid incompressible=True"
    warnings.warn(
        f"deformable body {d.name!r} has {density:g} kg/m3 in a liquid of {settings.density:g}, no damping, and theta={theta:g}: "
        f"vibrations that a step does not resolve grow; give NSCD(theta={DAMPING_THETA:g}), the body rayleigh=(a, b){other}",
        FluidWarning,
        stacklevel=above + 1,
    )
