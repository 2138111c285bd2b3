"""A liquid among the bodies of a scene: its particles, and how it meets bodies."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .. import _core
from ..base import checks
from ..base.materials import Material
from ..names import meant


@dataclass(frozen=True)
class NoSlip:
    """A liquid that sticks to a body: at its surface it has the velocity of that."""

    number = 1


@dataclass(frozen=True)
class FreeSlip:
    """A liquid that slides along a body without friction."""

    number = 2


DRAGS = {"di_felice": 3, "ergun": 4, "gidaspow": 5}  # numbers as fluid_grains.f90 has them


@dataclass(frozen=True)
class GrainDrag:
    """A liquid that flows about grains smaller than its particles, with drag and buoyancy by porosity.

    Parameters
    ----------
    law : str, default "di_felice"
        "di_felice" (Di Felice 1994): from single grains to beds; "ergun" (Ergun 1952): beds; "gidaspow" (Gidaspow 1994): Ergun's
        below a porosity of 0.8, that of Wen & Yu (1966) above.

    Raises
    ------
    ValueError
        If there is no such law.

    Notes
    -----
    Laws are those of spheres; other bodies have that of their volume. In 2D the porosity of disks becomes that of spheres packed
    alike, 1 - 2 / sqrt(pi sqrt 3) (1 - e)^(3/2) (Hoomans et al. 1996), and drag acts by volume.
    """

    law: str = "di_felice"

    def __post_init__(self):
        if self.law not in DRAGS:
            raise ValueError(f"law of drag is {self.law!r}: give one of {', '.join(DRAGS)}")

    @property
    def number(self):
        """Number of the law in rules of a fluid."""
        return DRAGS[self.law]


def grain_size(shape, dim, form):
    """Finds the size of a grain.

    Parameters
    ----------
    shape : str
        Name of its shape.
    dim : int
        2 or 3.
    form : dict
        "radius", "half", "vertex" (v, dim), as `points_of` has them.

    Returns
    -------
    tuple of float
        Volume, in 2D area [m3 or m2], and diameter of the sphere or disk of that volume [m]; None of a shape that is no grain.
    """
    if shape in ("disk", "sphere"):
        volume = math.pi * form["radius"] ** 2 if dim == 2 else 4 / 3 * math.pi * form["radius"] ** 3
    elif shape in ("polygon", "polyhedron"):
        from scipy.spatial import ConvexHull

        volume = ConvexHull(form["vertex"]).volume
    elif shape in ("capsule", "cylinder") and dim == 3:
        r, half = form["radius"], form["half"]
        volume = 2 * math.pi * r**2 * half + (4 / 3 * math.pi * r**3 if shape == "capsule" else 0.0)
    else:
        return None
    return volume, 2 * math.sqrt(volume / math.pi) if dim == 2 else (6 * volume / math.pi) ** (1 / 3)


@dataclass(frozen=True)
class Fluid:
    """Particles of a liquid, as `fluid` makes them.

    Parameters
    ----------
    name : str
        Name by which rules know it.
    position : ndarray (n, dim)
        Places of the particles [m].
    velocity : ndarray (n, dim)
        Velocities [m/s].
    pressure : ndarray (n,) or None
        Pressures at the start [Pa]; None: that of rest below the highest particle.
    spacing : float
        Distance of the particles [m].
    density : float
        Density at rest [kg/m3].
    viscosity : float
        Dynamic viscosity [Pa s].
    sound_speed : float or None
        Speed of sound [m/s]; None: found from the scene.
    smoothing : float
        Length of the kernel over the spacing [-].
    artificial : float
        Artificial viscosity of Monaghan, where particles approach [-].
    given : bool
        True if each particle was given, so that none is left out.
    incompressible : bool
        True if its pressure is solved for in the step of the bodies.
    surface_tension : float
        Energy of a free surface by area [N/m].
    """

    name: str
    position: np.ndarray
    velocity: np.ndarray
    pressure: np.ndarray | None
    spacing: float
    density: float
    viscosity: float
    sound_speed: float | None
    smoothing: float
    artificial: float
    given: bool
    incompressible: bool = False
    surface_tension: float = 0.0

    is_fluid = True

    def __len__(self):
        return len(self.position)

    def __repr__(self):
        form = "incompressible fluid" if self.incompressible else "fluid"
        return f"<{form} {self.name!r}, {self.dim}D: {len(self)} particles, {self.spacing:g} m apart, {self.density:g} kg/m3>"

    @property
    def dim(self):
        """2 or 3."""
        return self.position.shape[1]

    def liquid(self):
        """Gives the numbers that all particles of a liquid share.

        Returns
        -------
        tuple
            Spacing, density, viscosity, sound speed, smoothing, artificial viscosity, form and surface tension.
        """
        numbers = self.spacing, self.density, self.viscosity, self.sound_speed, self.smoothing, self.artificial
        return (*numbers, self.incompressible, self.surface_tension)


def fluid(
    region,
    spacing,
    density=1000.0,
    viscosity=0.0,
    sound_speed=None,
    *,
    velocity=None,
    pressure=None,
    name="fluid",
    smoothing=1.5,
    artificial=0.0,
    incompressible=False,
    surface_tension=0.0,
):
    """A liquid of particles, which flows among bodies with a free surface.

    Parameters
    ----------
    region : array_like (2, dim) or (n, dim)
        Lowest and highest corner of a box [m], which is filled from its lowest corner on in whole spacings, less what lies in
        bodies and behind walls; or the places of n > 2 particles [m].
    spacing : float
        Distance of the particles [m].
    density : float, default 1000
        Density at rest [kg/m3].
    viscosity : float, default 0
        Dynamic viscosity [Pa s].
    sound_speed : float, optional
        Speed of sound [m/s], ten times the greatest speed of the flow or more: the density then varies by 1 %. When not given,
        ten times sqrt(2 g H + v**2), with the height H of the liquid at the start and its greatest speed v, inflows included;
        with surface tension, 2 sigma / (rho R) is added below the root, R half the least width of the liquid.
    velocity : array_like (dim,) or (n, dim), optional
        Velocity at the start [m/s]; zero when not given.
    pressure : float or array_like (n,), optional
        Pressure at the start [Pa]; that of rest below the highest particle when not given.
    name : str, default "fluid"
        Name by which `Scene.interact` knows it.
    smoothing : float, default 1.5
        Length h of the kernel over the spacing; particles reach over 2 h [-].
    artificial : float, default 0
        Artificial viscosity (Monaghan 1992) where particles approach [-].
    incompressible : bool, default False
        True: density is a unilateral condition, solved in the step of NSCD together with the contacts, with steps of up to
        0.4 spacings over the speed. A sound speed then is that of the liquid itself; without one it does not give way.
        False: weakly compressible, in sub-steps of the bodies' step.
    surface_tension : float, default 0
        Energy of a free surface by area [N/m], in the weakly compressible form. Angles at walls are not set, and bodies feel no
        pull along the line where a surface meets them.

    Returns
    -------
    Fluid
        The liquid, to be added to a scene.

    Raises
    ------
    ValueError
        If a value is wrong; the message names field, value and remedy.

    Notes
    -----
    Delta-SPH (Antuono et al. 2010) with Wendland's C2 kernel, p = c^2 (rho - rho0), Morris' viscosity and walls of points below
    the surfaces of bodies.

    Examples
    --------
    >>> len(cn.fluid([(0.0, 0.0), (1.0, 0.5)], spacing=0.05))
    200
    """
    spacing, density = checks.positive("spacing", spacing), checks.positive("density", density)
    region = checks.reals("region", region)
    if region.ndim != 2 or region.shape[1] not in (2, 3) or len(region) < 2:
        raise ValueError(f"region has shape {region.shape}: give both corners of a box (2, dim), or places (n, dim)")
    if not np.all(np.isfinite(region)):
        raise ValueError("region holds numbers that are not finite: give finite coordinates [m]")
    if not isinstance(name, str) or not name:
        raise ValueError(f"name is {name!r}: give a word, by which Scene.interact knows the fluid")
    given = len(region) > 2
    position = region.copy() if given else _filled(region, spacing)
    n, dim = position.shape
    if given:
        _refuse_coincident(position, spacing)
    speed, pressure = _motion(n, dim, velocity, pressure)
    viscosity = _not_negative("viscosity", viscosity)
    artificial, incompressible, surface_tension, smoothing = _checked_options(
        artificial, incompressible, surface_tension, smoothing
    )
    return Fluid(
        name,
        position,
        speed,
        pressure,
        spacing,
        density,
        viscosity,
        None if sound_speed is None else checks.positive("sound_speed", sound_speed),
        smoothing,
        artificial,
        given,
        incompressible,
        surface_tension,
    )


def _motion(n, dim, velocity, pressure):
    """Velocities (n, dim) [m/s] and pressures (n,) [Pa], or None, at the start."""
    speed = np.zeros((n, dim))
    if velocity is not None:
        velocity = checks.reals("velocity", velocity)
        if velocity.shape not in ((dim,), (n, dim)):
            raise ValueError(f"velocity of the fluid has shape {velocity.shape}: give ({dim},) or ({n}, {dim})")
        speed = np.broadcast_to(velocity, (n, dim)).copy()
    if pressure is not None:
        pressure = checks.reals("pressure", pressure)
        if pressure.shape not in ((), (n,)):
            raise ValueError(f"pressure of the fluid has shape {pressure.shape}: give one number, or ({n},)")
        pressure = np.broadcast_to(pressure, (n,)).copy()
    if not (np.all(np.isfinite(speed)) and (pressure is None or np.all(np.isfinite(pressure)))):
        raise ValueError("velocity or pressure of the fluid holds a number that is not finite: give finite ones")
    return speed, pressure


def _checked_options(artificial, incompressible, surface_tension, smoothing):
    """Artificial viscosity, form, surface tension and smoothing, if they go together."""
    artificial, surface_tension = (
        _not_negative(name, value) for name, value in (("artificial", artificial), ("surface_tension", surface_tension))
    )
    if checks.flag("incompressible", incompressible) and artificial > 0:
        raise ValueError(f"artificial is {artificial:g}, which damps sound, and an incompressible fluid has none: leave it out")
    if incompressible and surface_tension > 0:
        raise ValueError(
            f"surface_tension is {surface_tension:g}, and the incompressible fluid has none: leave out incompressible, or it"
        )
    smoothing = checks.number("smoothing", smoothing)
    if not 1.0 <= smoothing <= 3.0:
        raise ValueError(f"smoothing is {smoothing:g}: give a value in [1, 3]; below, particles have too few neighbours")
    return artificial, bool(incompressible), surface_tension, smoothing


MOST = 5_000_000  # particles of a region


def _filled(corners, spacing):
    low, high = corners
    if not np.all(high > low):
        box = f"the box from {low.tolist()} to {high.tolist()}"
        raise ValueError(f"region is {box}: give its lowest corner, then its highest one")
    many = np.round((high - low) / spacing)
    if not np.all(many >= 1):
        raise ValueError(f"spacing is {spacing:g}, more than a side of the region, {np.min(high - low):g}: give a smaller one")
    if np.prod(many) > MOST:
        raise ValueError(f"spacing is {spacing:g}, and {np.prod(many):.3g} particles fill the region: give a larger one")
    axes = [low[k] + (np.arange(int(many[k])) + 0.5) * spacing for k in range(len(low))]
    return np.stack([x.ravel() for x in np.meshgrid(*axes, indexing="ij")], axis=1)


def _not_negative(name, value):
    value = checks.number(name, value)
    if value < 0:
        raise ValueError(f"{name} is {value:g}: give a value >= 0")
    return value


def _refuse_coincident(position, spacing):
    """Raises ValueError for two particles in one place, whose forces have no direction."""
    cells = np.floor(position / (1e-3 * spacing))
    _, first, count = np.unique(cells, axis=0, return_index=True, return_counts=True)
    if np.any(count > 1):
        at = tuple(float(x) for x in position[first[np.argmax(count)]])
        raise ValueError(f"region holds two particles at {at}: give each its own place, about {spacing:g} m from the others")


def slip_rule(scene, a, b, kind):
    """Checks a rule of a liquid and bodies; see Scene.interact.

    Parameters
    ----------
    scene : Scene
        The scene, whose fluids are known.
    a : Fluid or str
        One side.
    b : Material, str
        The other side.
    kind : NoSlip, FreeSlip, GrainDrag or None
        How they meet; None: the liquid flows through the bodies.

    Returns
    -------
    tuple
        Name of the material or group, and the number of the kind.

    Raises
    ------
    ValueError
        If a side is no name, or no side is the liquid.
    """
    names = {f.name for f in scene.fluids}
    words = [x.name if isinstance(x, (Fluid, Material)) else x for x in (a, b)]
    for which, word in zip(("first", "second"), words):
        if not isinstance(word, str) or not word:
            raise ValueError(f"{which} side of an interaction is {word!r}: give a fluid, a Material, a name or '*'")
    if kind is not None and type(kind).__name__ not in ("NoSlip", "FreeSlip", "GrainDrag"):
        raise ValueError(f"a fluid meets bodies by {kind!r}: give cn.NoSlip(), cn.FreeSlip(), cn.GrainDrag() or None")
    sides = [k for k, given in enumerate((a, b)) if isinstance(given, Fluid) or words[k] in names]
    if len(sides) != 1:
        known = ", ".join(sorted(names)) or "none: add cn.fluid(...) to the scene first"
        like = next(filter(None, (meant(word, names) for word in words)), "") if not sides else ""
        raise ValueError(f"{words[0]!r} and {words[1]!r} meet by {kind!r}, and one side must be a fluid; there is {known}{like}")
    return words[1 - sides[0]], 0 if kind is None else kind.number


def slip_between(scene, material, group):
    """Gives how the liquid meets contactors of a material and a group: rules of groups precede those of materials and "*".

    Parameters
    ----------
    scene : Scene
        The scene.
    material : str
        Name of the material.
    group : str or None
        Name of the group.

    Returns
    -------
    int
        0: not at all, 1: it sticks, 2: it slides, more: a law of drag of grains.
    """
    best, found = -1, NoSlip.number
    for word, number in scene.fluid_rules:
        weight = 3 if group and word == group else 1 if word == material else 0 if word == "*" else -1
        if weight >= 0 and weight >= best:
            best, found = weight, number
    return found


def sound_speed_of(fluids, gravity, periodic, inflow=()):
    """Finds a speed of sound for a liquid that falls over its own height.

    Parameters
    ----------
    fluids : list of Fluid
        The regions of the liquid.
    gravity : ndarray (dim,)
        Gravity along axes that are not periodic [m/s2].
    periodic : ndarray (dim,)
        True along axes that are.
    inflow : array_like (m, dim), optional
        Velocities of particles in inflows [m/s].

    Returns
    -------
    float
        Ten times the greatest speed [m/s].

    Raises
    ------
    ValueError
        If nothing tells a speed.
    """
    position, velocity = (np.concatenate([getattr(f, name) for f in fluids]) for name in ("position", "velocity"))
    velocity = np.concatenate([velocity, np.reshape(inflow, (-1, velocity.shape[1]))])
    first = fluids[0]
    settings = {"spacing": first.spacing, "density": first.density, "surface_tension": first.surface_tension}
    speed = _core.natural_sound_speed(first.dim, settings, position, velocity, np.asarray(gravity, float))
    if not speed > 0:
        raise ValueError(
            "sound_speed of the fluid is not given, and neither gravity across the liquid nor a velocity at t = 0 tells how fast "
            "it will flow: give cn.fluid(sound_speed=...), ten times the greatest speed [m/s]"
        )
    return speed
