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
# densities of solids in g/cm3, from wood to lead, and weights in kN/m3, from brick to granite; as kg/m3 they are those of gases
# and foams
GRAMS = (0.4, 12.0)
KILONEWTONS = (12.0, 30.0)
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
# strain at which solids begin to yield, from annealed lead to rubber; a stress that no solid bears means: never [Pa]
NEVER = 1e12
SMALLEST_YIELD, LARGEST_YIELD = 1e-7, 10.0
# margin of detection over the radius of the largest body
WIDEST = 20.0
# sets of bodies that are looked at: wrong units are in all of them
MOST_SETS = 1000


def reaches(simulation):
    """Farthest points of all rigid bodies from their centres (n,) [m], as simulation.bodies has them; 0 without contactors."""
    contactors, ids = simulation.contactors, np.asarray(simulation.bodies.id)
    owner, reach = np.asarray(contactors.body), np.array(contactors.radius, float)
    if len(contactors.offset):
        reach += np.linalg.norm(contactors.offset, axis=1)
    if len(contactors.direction):
        reach += np.abs(contactors.direction[:, -1])  # half lengths
    own = np.isin(owner, ids) & np.isfinite(reach)
    radius, order = np.zeros(len(ids)), np.argsort(ids)
    np.maximum.at(radius, order[np.searchsorted(ids[order], owner[own])], reach[own])
    return radius


def free_bodies(simulation, radius=None):
    """Masses (n,) [kg] and radii (n,) [m] of rigid bodies that move freely. radius: those of all, if they are known."""
    driven, mass = core_of(simulation).scene.body("driven").ravel(), np.ravel(simulation.bodies.mass)
    radius = reaches(simulation) if radius is None else radius
    free = np.isfinite(mass) & (mass > 0) & (radius > 0)
    if len(driven) == len(free):
        free &= driven == 0
    return mass[free], radius[free]


def materials_of(body):
    """Materials of a body of cells; [None] of one without."""
    given = (getattr(body, "given", None) or {}).get("material")
    found = given.values() if isinstance(given, dict) else [given]
    return [m for of in found for m in (of[0] if isinstance(of, (tuple, list)) else [of])]


def young_of(body):
    """Largest Young's modulus of a body [Pa], or None; True if it bears large displacements."""
    given = getattr(body, "given", None) or {}
    if isinstance(given.get("young"), (int, float, np.number)):
        return float(given["young"]), False
    materials = materials_of(body)
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
    found = [_friction(simulation), _rotations(simulation), _yield(simulation), _damping(simulation)]
    radius = reaches(simulation)
    free = free_bodies(simulation, radius)
    found += [_inertia(simulation, radius), _margin(simulation, free)]
    if EARTH[0] <= pull <= EARTH[1]:
        light = _densities(simulation, radius)
        found += [light] if light else [_sound(simulation)]
    if pull > 0:
        found += [_step(simulation, pull, free), _attraction(simulation, pull, free)]
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


def _inertia(simulation, radius):
    """Text on a moment of inertia that exceeds that of all mass at the rim, as if mass and inertia were swapped."""
    bodies = simulation.bodies
    if not len(bodies):
        return None
    mass, most = np.ravel(bodies.mass), np.asarray(bodies.inertia, float).reshape(len(bodies), -1).max(axis=1, initial=0.0)
    some = np.isfinite(mass) & np.isfinite(most)
    if not np.any(some):
        return None
    rim = np.where(some, mass, 0.0) * radius**2
    above = np.flatnonzero(some & (radius > 0) & (most > rim * (1 + 1e-6)))
    if not len(above):
        return None
    k = above[0]
    return (f"inertia of body {bodies.id[k]} is {most[k]:.4g} kg m2, more than {rim[k]:.4g}, its mass of {mass[k]:.4g} kg at its "
            f"rim, {radius[k]:.4g} m away: are mass and inertia swapped, or in other units?")  # fmt: skip


def _yield(simulation):
    """Text on a material that yields at a strain no solid bears, as if its stress or its modulus were in MPa."""
    for number, view in enumerate(simulation.meshes):
        for material in materials_of(view._mesh.d.body):
            given = dict(zip(getattr(material, "parameter_names", ()), getattr(material, "values", ())))
            young, limit = given.get("young"), given.get("yield_stress", given.get("strength"))
            if young and limit and limit < NEVER and not SMALLEST_YIELD < limit / young < LARGEST_YIELD:
                name, least = "yield_stress" if "yield_stress" in given else "strength", min(limit, young)
                told = f"{name} of mesh {number} is {limit:g} Pa and its young {young:g} Pa"
                remedy = f"give both in pascals, {1e6 * least:g} for {least:g} MPa"
                return f"{told}: it would yield at a strain of {limit / young:.2g}; {remedy}"
    return None


def _damping(simulation):
    """Text on a damping ratio above the critical one, as if in percent."""
    for number, view in enumerate(simulation.meshes):
        ratio = view._mesh.d.modal_damping
        if ratio is not None and np.max(ratio) > 1:
            most = float(np.max(ratio))
            return f"modal_damping of mesh {number} is {most:g}, above the critical 1: give {most / 100:g} for {most:g} %"
    return None


def _margin(simulation, free):
    """Text on a margin of detection far above the size of all bodies."""
    margin, size = getattr(simulation.strategy, "margin", None), free[1].max(initial=0.0)
    if isinstance(margin, (int, float)) and size > 0 and WIDEST * size < margin < np.inf:
        told = f"margin of the strategy is {margin:g} m, {margin / size:.3g} times the radius of the largest body"
        return f"{told}: every body meets all others; give metres, {1e-3 * margin:g} for {margin:g} mm, or leave it out"
    return None


def _densities(simulation, radius):
    """Text on a density in g/cm3."""
    scene = simulation.scene
    for fluid in scene.fluids:
        if fluid.density < LIGHTEST_LIQUID:
            return f"density of {fluid.name!r} is {fluid.density:g} kg/m3, and no liquid is as light: give kg/m3, 1000 for water"
    for number, view in enumerate(simulation.meshes):
        density = (getattr(view._mesh.d.body, "given", None) or {}).get("density")
        if isinstance(density, (int, float, np.number)) and GRAMS[0] <= density <= KILONEWTONS[1]:
            return f"density of mesh {number} is {density:g} kg/m3, {_grams(density)}"
    ids, order = np.asarray(simulation.bodies.id), np.argsort(simulation.bodies.id)
    for s in simulation._sets[:MOST_SETS]:
        if s.mesh is not None or not s.contactors:
            continue
        density = _of_set(s, radius[order[np.searchsorted(ids, s.own_ids, sorter=order)]], scene.dim)
        if GRAMS[0] <= density <= KILONEWTONS[1]:
            return f"density of bodies of {s.contactors[0].material.name!r} is {density:.6g} kg/m3, {_grams(density)}"
    return None


def _of_set(s, radius, dim):
    """Density [kg/m3] of the lightest body of a set: of balls by their mass and volume, of others that of the material if their
    masses suit it; NaN of held bodies. radius: of the bodies [m]."""
    mass = np.ravel(s.mass)
    free = np.flatnonzero(np.isfinite(mass) & (radius > 0))
    if not len(free):
        return np.nan
    of = s.contactors[0]
    bulk = float(np.min(mass[free] / ((2 * radius[free]) ** dim * (s.depth or 1.0))))
    if len(s.contactors) == 1 and of.shape in ("disk", "sphere") and of.offset is None:
        return bulk * (4 / np.pi if dim == 2 else 6 / np.pi)
    known = of.material.density
    return known if known is not None and bulk <= known else np.nan


def _grams(density):
    if density > GRAMS[1]:
        return f"as foams have it: give kg/m3, {density * 1e3 / 9.81:.4g} for a weight of {density:.6g} kN/m3"
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


def _step(simulation, pull, free):
    """Text on a step in which bodies at rest fall by many times their size."""
    strategy = simulation._given.row
    if strategy != "nscd" or any(law.name == "joint" for *_, law in simulation._rules if law):
        return None
    size, h = free[1].max(initial=0.0), simulation.dt
    fall = pull * h * h
    if not size > 0 or not fall > FALL * size:
        return None
    return (f"dt is {h:g} s, and gravity moves bodies at rest by {fall:.3g} m in a step, {fall / size:.3g} times the radius of "
            f"the largest: give seconds, {h * 1e-3:g} for {h:g} ms; they fall by one radius in {np.sqrt(2 * size / pull):.2g} s, "
            f"of which a hundredth is a usual step")  # fmt: skip


def _attraction(simulation, pull, free):
    """Text on an attraction that is far below the weight of the lightest body."""
    asked = [(own, given, ATTRACTIONS[name]) for own, name, given in _laws(simulation) if name in ATTRACTIONS]
    if not asked:
        return None
    mass, radius = free
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
