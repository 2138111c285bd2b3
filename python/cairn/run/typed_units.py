"""Warnings of values that were probably typed in other units than SI, when a simulation is made: densities in g/cm3, angles in
degrees, steps in ms, lengths in mm.

A scene of any units runs; that it is meant in SI is known from a gravity of 9.8 m/s2. Checks that need to know it are silent
otherwise.
"""

from __future__ import annotations

import numpy as np

from ..model.law_parameters import told as meaning
from .views import core_of

# gravity of the Earth, rounded to 10 too [m/s2]: metres and seconds are meant
EARTH = (9.7, 10.05)
# densities of solids in g/cm3, from ice and wood to lead; as kg/m3 they are those of gases and foams
GRAMS = (0.4, 12.0)
# density of the lightest liquid, of hydrogen at 20 K [kg/m3]
LIGHTEST_LIQUID = 71.0
# speed of sound in solids, upper bound (Trachenko, Monserrat, Pickard & Brazhkin 2020, Science Advances 6, eabc8662) [m/s]
FASTEST_SOUND = 36100.0
# coefficients of friction that are angles in degrees; rough surfaces are meant by larger ones
DEGREES = (11.0, 60.0)
# fall from rest in a step over the radius of the largest body
FALL = 10.0
# attraction over the weight of the lightest body: below, it has no effect
ATTRACTION = 1e-5
# sets of bodies that are looked at: wrong units are in all of them
MOST_SETS = 1000


def free_bodies(simulation):
    """Masses (n,) [kg] and radii (n,) [m] of rigid bodies that move freely."""
    driven, contactors = core_of(simulation).scene.body("driven").ravel(), simulation.contactors
    ids, mass = np.asarray(simulation.bodies.id), np.ravel(simulation.bodies.mass)
    owner = np.asarray(contactors.body)
    reach = np.array(contactors.radius, float)
    if len(contactors.offset):
        reach += np.linalg.norm(contactors.offset, axis=1)
    own = np.isin(owner, ids) & np.isfinite(reach)
    radius = np.zeros(len(ids))
    order = np.argsort(ids)
    np.maximum.at(radius, order[np.searchsorted(ids[order], owner[own])], reach[own])
    free = np.isfinite(mass) & (mass > 0) & (radius > 0)
    if len(driven) == len(free):
        free &= driven == 0
    return mass[free], radius[free]


def young_of(body):
    """Largest Young's modulus of a body [Pa], or None; True if it bears large displacements."""
    given = getattr(body, "given", None) or {}
    if isinstance(given.get("young"), (int, float, np.number)):
        return float(given["young"]), False
    given = given.get("material")
    found = given.values() if isinstance(given, dict) else [given]
    materials = [m for of in found for m in (of[0] if isinstance(of, (tuple, list)) else [of])]
    young = [dict(zip(getattr(m, "parameter_names", ()), getattr(m, "values", ()))).get("young") for m in materials]
    return (None if None in young or not young else max(young)), True


def texts(simulation, gravity):
    """Texts on values that suit other units.

    Parameters
    ----------
    simulation : Simulation
        The simulation, before its first step.
    gravity : ndarray (dim,)
        Gravity at its start [m/s2].

    Returns
    -------
    list of str
        A sentence for each, with field, value and remedy.
    """
    pull = float(np.linalg.norm(gravity))
    found = [_friction(simulation), _rotations(simulation)]
    if EARTH[0] <= pull <= EARTH[1]:
        light = _densities(simulation)
        found += [light] if light else [_sound(simulation)]
    if pull > 0:
        found += [_step(simulation, pull), _attraction(simulation, pull)]
    return [text for text in found if text]


def _laws(simulation):
    """{parameter: value} of each law that is no joint, with the name of its class."""
    laws = dict.fromkeys(law for *_, law in simulation._rules if law is not None and law.name != "joint")
    return [(type(law).__name__, law.name, dict(zip(law.parameter_names, law.values))) for law in laws]


def _friction(simulation):
    """Text on a coefficient of friction that is an angle in degrees."""
    for own, _, given in _laws(simulation):
        mu = given.get("mu")
        if mu is not None and DEGREES[0] <= mu <= DEGREES[1]:
            return (f"mu of {own} is {mu:g}, the tangent of a friction angle of {np.degrees(np.arctan(mu)):.1f} degrees: of "
                    f"{mu:g} degrees give {np.tan(np.radians(mu)):.3g}, of bodies that never slide mu=math.inf")  # fmt: skip
    return None


def _rotations(simulation):
    """Text on rotations in degrees: above a turn and all of them whole or half numbers, as accumulated ones are not."""
    for s in simulation._sets[:MOST_SETS]:
        if simulation.scene.dim == 2 and s.rotation is not None and np.all(s.rotation % 0.5 == 0):
            most = float(s.rotation[np.argmax(np.abs(s.rotation))])
            if abs(most) > 2 * np.pi:
                return f"rotation is {most:g}, and angles are in radians: give {np.radians(most):.4g} for {most:g} degrees"
    for *_, law in simulation._rules:
        if law is None or law.name != "joint":
            continue
        given = dict(zip(law.parameter_names, law.values))
        if given["coordinate"] > simulation.scene.dim:  # about an axis
            for name, end in (("lower", given["lowest"]), ("upper", given["highest"])):
                if 2 * np.pi < abs(end) < np.inf and end % 5 == 0:
                    told = f"the {name} limit of a joint is {end:g} rad"
                    return f"{told}: give radians, {np.radians(end):.4g} for {end:g} degrees"
    return None


def _densities(simulation):
    """Text on a density in g/cm3."""
    scene = simulation.scene
    for fluid in scene.fluids:
        if fluid.density < LIGHTEST_LIQUID:
            return f"density of {fluid.name!r} is {fluid.density:g} kg/m3, and no liquid is as light: give kg/m3, 1000 for water"
    for number, view in enumerate(simulation.meshes):
        density = (getattr(view._mesh.d.body, "given", None) or {}).get("density")
        if isinstance(density, (int, float, np.number)) and GRAMS[0] <= density <= GRAMS[1]:
            return f"density of mesh {number} is {density:g} kg/m3, {_grams(density)}"
    for s in simulation._sets[:MOST_SETS]:
        density = _of_set(s, scene.dim) if s.mesh is None else np.nan
        if GRAMS[0] <= density <= GRAMS[1]:
            return f"density of bodies of {s.contactors[0].material.name!r} is {density:.6g} kg/m3, {_grams(density)}"
    return None


def _of_set(s, dim):
    """Density [kg/m3] of the lightest body of a set: of balls by their mass and volume, of others that of the material if their
    masses suit it; NaN of held bodies."""
    mass = np.ravel(s.mass)
    free = np.flatnonzero(np.isfinite(mass))
    if not len(free) or not s.contactors:
        return np.nan
    of, radius, depth = s.contactors[0], np.zeros(len(s)), s.depth or 1.0
    for part in s.contactors:
        reach = part.radius + (0.0 if part.offset is None else np.linalg.norm(part.offset, axis=1))
        own = part.body < len(s)
        np.maximum.at(radius, part.body[own], reach[own])
    free = free[radius[free] > 0]
    if not len(free):
        return np.nan
    bulk = float(np.min(mass[free] / ((2 * radius[free]) ** dim * depth)))
    if len(s.contactors) == 1 and of.shape in ("disk", "sphere") and of.offset is None:
        return bulk * (4 / np.pi if dim == 2 else 6 / np.pi)
    known = of.material.density
    return known if known is not None and bulk <= known else np.nan


def _grams(density):
    return f"as gases and foams have it: give kg/m3, {density * 1000:.6g} for {density:.6g} g/cm3"


def _sound(simulation):
    """Text on a mesh whose waves are faster than those of any solid."""
    for number, view in enumerate(simulation.meshes):
        body = view._mesh.d.body
        young, density = young_of(body)[0], (getattr(body, "given", None) or {}).get("density")
        if young and isinstance(density, (int, float, np.number)) and density > 0:
            speed = float(np.sqrt(young / density))
            if speed > FASTEST_SOUND:
                told = f"young of mesh {number} is {young:g} Pa and its density {density:g} kg/m3"
                return f"{told}: waves of {speed:.3g} m/s, faster than in any solid; give pascals and kg/m3"
    return None


def _step(simulation, pull):
    """Text on a step in which bodies at rest fall by many times their size."""
    strategy = simulation._given.row
    if strategy != "nscd" or any(law.name == "joint" for *_, law in simulation._rules if law):
        return None
    size, h = free_bodies(simulation)[1].max(initial=0.0), simulation.dt
    fall = pull * h * h
    if not size > 0 or not fall > FALL * size:
        return None
    return (f"dt is {h:g} s, and gravity moves bodies at rest by {fall:.3g} m in a step, {fall / size:.3g} times the radius of "
            f"the largest: give seconds, {h * 1e-3:g} for {h:g} ms; they fall by one radius in {np.sqrt(2 * size / pull):.2g} s, "
            f"of which a hundredth is a usual step")  # fmt: skip


def _attraction(simulation, pull):
    """Text on an attraction that is far below the weight of the lightest body."""
    asked = [(own, given, ATTRACTIONS[name]) for own, name, given in _laws(simulation) if name in ATTRACTIONS]
    if not asked:
        return None
    mass, radius = free_bodies(simulation)
    if not len(mass):
        return None
    lightest = int(np.argmin(mass))
    weight, size = mass[lightest] * pull, radius[lightest]
    for own, given, (name, force) in asked:
        share = force(given, size) / weight
        if 0 < share < ATTRACTION:
            return (f"{name} of {own} is {given[name]:g} {meaning(own, name)[0]}, an attraction of {share:.2g} of the weight of "
                    f"the lightest body, {weight:.3g} N of {size:g} m in radius, so that it has no effect: give metres, "
                    f"{size * 1e-3:g} for {size:g} mm")  # fmt: skip
    return None


# parameter and attraction [N] of a ball of radius r on a plane: 4 pi r tension of a bridge of wetting liquid, 3/2 pi r work of
# surfaces that stick (Johnson, Kendall & Roberts 1971)
ATTRACTIONS = {
    "wet": ("force", lambda value, radius: value["force"]),
    "rolling_wet": ("force", lambda value, radius: value["force"]),
    "capillary": ("tension", lambda value, radius: 4 * np.pi * radius * value["tension"]),
    "rolling_capillary": ("tension", lambda value, radius: 4 * np.pi * radius * value["tension"]),
    "liquid_bridge": ("tension", lambda value, radius: 4 * np.pi * radius * value["tension"]),
    "jkr": ("work", lambda value, radius: 1.5 * np.pi * radius * value["work"]),
}
