"""Text about a simulation for Simulation.explain: stages, stored arrays, chosen settings."""

from __future__ import annotations

import math

import numpy as np

from .. import _core
from ..options.solvers import NLGS, Auto
from ..options.strategies import NSCD, SmoothDEM
from .views import core_of


def explain(simulation):
    """Text on stages, arrays, bytes, settings and scales."""
    strategy, bodies, contactors = simulation.strategy, simulation.bodies, simulation.contactors
    nodes = f"{len(simulation.nodes)} nodes of meshes, " if len(simulation.nodes) else ""
    lines = [f"{len(bodies)} bodies, {nodes}{len(contactors)} contactors, {simulation.scene.dim}D"]
    lines += ["", "Stages of a step: " + ", ".join(simulation.stage_names)]
    lines += next(words for kind, words in WORDS.items() if isinstance(strategy, kind))(simulation)
    of_nodes = [("node", simulation.nodes.fields)] if len(simulation.nodes) else []
    for title, fields in (("body", bodies.fields), *of_nodes, ("contactor", contactors.fields)):
        active = [f for f in fields if f["active"]]
        lines += ["", f"Arrays for each {title} ({sum(f['bytes'] for f in active)} bytes):"]
        lines += [f"  {f['name']:<18}{f['components']} x [{f['unit']}]  {f['meaning']} ({f['stage']})" for f in active]
        absent = [f["name"] for f in fields if not f["active"]]
        if absent:
            lines.append(f"  not stored, since nothing needs them: {', '.join(absent)}")
    held, contacts = simulation.held_bytes, len(simulation.contacts)
    lines += ["", f"In all, with workspace: {held['bodies'] / max(1, len(bodies)):.0f} bytes a body"]
    if contacts:
        lines.append(f"and {held['contacts'] / contacts:.0f} bytes a contact ({contacts} contacts)")
    lines += _belts(bodies)
    lines += _ranks(simulation)
    if simulation._fluid:
        lines += simulation.fluid.lines()
    lines += ["", *_laws(simulation), *_scales(simulation), *_last_step(simulation)]
    return "\n".join(lines)


def explained(simulation):
    """Gives the same as plain data: numbers, words, lists and dicts; infinite numbers become None."""
    bodies, nodes, strategy = simulation.bodies, simulation.nodes, simulation.strategy
    held, contacts, mass, radius = simulation.held_bytes, len(simulation.contacts), bodies.mass, simulation.radii()
    rules = []
    for a, b, law in simulation._rules:
        if law is not None and law.name != "joint":
            given = dict(zip(law.parameter_names, law.values))
            angles = {n: np.degrees(np.arctan(given[n])) for n in COEFFICIENTS if given.get(n) is not None}
            rules.append({"a": a, "b": b, "law": type(law).__name__, "parameters": given, "degrees": angles})
    arrays = {}
    for title, fields in (("bodies", bodies.fields), ("nodes", nodes.fields), ("contactors", simulation.contactors.fields)):
        kept = ("name", "components", "unit", "meaning", "stage", "bytes")
        arrays[title] = [{k: f[k] for k in kept} for f in fields if f["active"]]
    ends = {name: [x.min(), x.max()] for name, x in (("mass", mass[np.isfinite(mass)]), ("radius", radius[radius > 0])) if x.size}
    stable = getattr(simulation, "stable_step", None)
    return plain({
        "dim": simulation.scene.dim, "bodies": len(bodies), "nodes": len(nodes), "contactors": len(simulation.contactors),
        "contacts": contacts, "dt": simulation.dt, "stable_step": stable, "time": simulation.time, "steps": simulation.steps,
        "stages": list(simulation.stage_names), "strategy": type(strategy).__name__, "settings": strategy.settings(),
        "arrays": arrays, "bytes_per_body": held["bodies"] / max(1, len(bodies)),
        "bytes_per_contact": held["contacts"] / contacts if contacts else None, "laws": rules, "scales": ends,
        "last_step": {k: v for k, v in simulation.info.items() if k != "energy"} if simulation.report else None,
    })  # fmt: skip


def plain(value):
    """Makes plain data of arrays, tuples and numbers of numpy; None of numbers that are not finite, the repr of other objects."""
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple, set, np.ndarray)):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, (bool, int, str)) else repr(value)


MOST_LAWS = 12  # laws listed individually
COEFFICIENTS = ("mu", "friction", "kinetic")  # parameters that are tangents of a friction angle


def _belts(bodies):
    """A line on surfaces that move along their bodies."""
    if "surface_velocity" not in bodies.names:
        return []
    speed, dim = np.abs(bodies.surface_velocity), bodies.position.shape[1]
    moving, most = int(np.count_nonzero(speed.any(axis=1))), (speed[:, :dim].max(initial=0.0), speed[:, dim:].max(initial=0.0))
    told = f"Surfaces that move along their bodies: {moving}, by up to {most[0]:g} m/s"
    return ["", f"{told} and {most[1]:g} rad/s about the centre"]


def _ranks(simulation):
    """Lines on the ranks that share the scene."""
    ranks = simulation.ranks
    if ranks is None:
        return []
    where = {"mpi": "one a process of MPI", "virtual": "in turns in this process", "serial": "in this process"}[ranks.kind]
    how = {
        "colour": "sweeps go colour by colour, with the same bits for every number of ranks",
        "sweep": "velocities go between ranks once a sweep, which is faster; bits depend on the number of ranks",
    }
    lines = ["", f"Ranks: {ranks.count}, {where}; {how[ranks.exchange]}"]
    if simulation.steps:
        f = ranks.figures()
        lines.append(f"  last step: {f['colours']} colours, {f['ghosts']} ghosts here, {f['messages']} messages with "
                     f"{f['message_bytes']} bytes sent from here, imbalance {f['imbalance']:.3g}, partitions so far "
                     f"{f['partitions']}")  # fmt: skip
        if f.get("gathered_solves"):
            lines.append(f"  contacts of all ranks were gathered on one rank, {f['gathered_solves']} times so far, where "
                         f"sweeps would have taken long; the last time they were {f['gathered_bytes']} bytes")  # fmt: skip
        if "liquid_imbalance" in f:
            lines.append(f"  sums over the particles of the liquid are shared, imbalance {f['liquid_imbalance']:.3g}")
    return lines


def _laws(simulation):
    """Lines on the laws, with friction as an angle, so that an angle given as a coefficient is noticed."""
    rules = [(a, b, law) for a, b, law in simulation._rules if law is not None and law.name != "joint"]
    lines = []
    for a, b, law in rules[:MOST_LAWS]:
        given = dict(zip(law.parameter_names, law.values))
        told = [f"{name} {given[name]:g}: {np.degrees(np.arctan(given[name])):.0f} degrees" for name in COEFFICIENTS
                if name in given and (name == "mu" or 0 < given[name] < np.inf)]  # fmt: skip
        lines.append(f"Law of {a}, {b}: {type(law).__name__}" + (f", {', '.join(told)}" if told else ""))
    return lines + ([f"and {len(rules) - MOST_LAWS} more laws"] if len(rules) > MOST_LAWS else [])


def _nscd(simulation):
    strategy = simulation.strategy
    lines = []
    margin = "h x speed + 0.05 radius, for each body" if strategy.margin is None else f"{strategy.margin:g} m for a pair"
    solver = strategy.solver
    if strategy.pose != "moreau":
        lines.append(f"Strategy {type(strategy).__name__}: contact condition {strategy.pose}")
    for mesh in simulation.meshes:
        size, points = mesh.body.points.size, len(mesh.contact_nodes)
        lines.append(f"Deformable {mesh.name!r}: {size} dofs, {len(mesh.held)} held, {points} nodes that touch")
    moved_by = strategy.moved_by()
    integrator = f"Theta {moved_by.values['theta']:g}" if moved_by.row == "theta" else f"Integrator {moved_by!r}"
    lines += [
        f"{integrator}; step {simulation.dt:g} s; margin of detection: {margin}",
        f"Solver {type(solver).__name__}: true error at most {solver.tol:g}, {solver.min_iter} to {solver.max_iter} iterations, "
        f"{'warm' if strategy.warm_start else 'cold'} start",
        *_accuracy(strategy),
        *_sweeps(simulation, solver),
        *_enough(strategy),
        "Statically indeterminate contacts (a face on many points, a wedged pile): the impulse of a single contact depends on "
        "the start of the solver; resultants on each body, and the motion, do not. cn.PPANewton distributes impulses smoothly",
    ]
    return lines


def _accuracy(strategy):
    if strategy.accuracy is None:
        return ["Accuracy of velocities is not asked for (NSCD(accuracy=...)): the tolerance of impulses ends a step"]
    return [
        f"Accuracy {strategy.accuracy:g} of velocities: a step ends once their estimated error is at most that, see "
        'info["velocity_error"]'
    ]


def _enough(strategy):
    solver, lines = strategy.solver, []
    if getattr(solver, "enough", None) is not None:
        early = f"A step of a dense pack ends at a true error of {solver.enough:g} after {solver.patience} iterations"
        lines.append(f"{early}; walls and arches, which bear on faces, are no pack")
    if strategy.overlap is not None and math.isfinite(strategy.overlap):
        lines.append(f"Displacements take back overlap beyond {strategy.overlap:g} of the smaller body's size after the step")
    return lines


MOST_APART = 2**20  # ratio of masses up to which sweeps are extrapolated, see cxx/solvers/sweeps/extrapolation.cpp


def _sweeps(simulation, solver):
    if not isinstance(solver, (NLGS, Auto)):
        return []
    lines, plain = [], getattr(solver, "acceleration", "nesterov") == "none"
    found = core_of(simulation).figures()
    if plain:
        lines.append("Sweeps are plain, over-relaxed from the tenth on")
    elif simulation.ranks is not None:
        lines.append(
            f"Sweeps are extrapolated from the tenth on where masses of moving bodies differ by at most {MOST_APART:,} and at "
            "most half of the contacts are between faces; in others they are plain and over-relaxed"
        )
    elif not found:
        lines.append(
            "Sweeps are extrapolated from the tenth on, and repeated over slow parts of a pile, in steps where masses of moving "
            f"bodies differ by at most {MOST_APART:,} and at most half of the contacts are between faces or of meshes swept in "
            "turn; in others they are plain and over-relaxed. No contacts are known yet"
        )
    elif found["extrapolates"]:
        lines.append(
            "Sweeps are extrapolated from the tenth on, and repeated over slow parts of a pile: in the last step masses differ "
            f"by {found['mass_ratio']:.3g}, {found['faced_share']:.0%} of contacts are between faces or of meshes swept in turn"
        )
    else:
        why = f"masses differ by {found['mass_ratio']:.3g}, beyond {MOST_APART:,} light bodies feel what is rounded"
        if found["mass_ratio"] <= MOST_APART:
            why = (f"{found['faced_share']:.0%} of the contacts are between faces or of meshes swept in turn, where a step may "
                   "have several answers and plain sweeps stay with the near one")  # fmt: skip
        lines.append(f"Sweeps are plain, over-relaxed from the tenth on: in the last step {why}")
    if isinstance(solver, Auto):
        lines.append(
            "Newton's method takes over where it is expected to cost less than further sweeps, if its factors fit into "
            f"{solver.memory:.3g} bytes; small problems are finished by their active set"
        )
        return lines
    if solver.associated_start and found.get("extrapolates", True):
        lines.append("Sweeps of a pile at rest that start without impulses begin with associated friction")
    if solver.softening_relaxation < 1:
        lines.append(f"Bonds that soften take {solver.softening_relaxation:g} of their change in a sweep (under-relaxation)")
    return lines


def _smooth(simulation):
    strategy, dt, limit = simulation.strategy, simulation.dt, simulation.stable_step
    lines = [f"Velocity Verlet; step {dt:g} s; pairs listed up to {simulation.skin:.3g} m beyond the reach of their law"]
    if np.isfinite(limit):
        lines.append(
            f"Stable step {limit:.3g} s, by masses and the stiffness at an overlap of at least {strategy.overlap:g} of the "
            f"effective radius; this step is {dt / limit:.3g} of it (a tenth is accurate)"
        )
    else:
        lines.append("No stable step is known yet: no contact law acts on a body that can move")
    lines.append("The energy balance is " + ("computed" if strategy.energy else "not computed (energy=False)"))
    return lines


def _listed(simulation):
    row = simulation.strategy.row
    known, options = {r[0]: r for r in _core.strategies()}, _core.strategy_options(row)
    settings = simulation.strategy.settings()
    return [
        f"Strategy {row}: {known[row][2]}; step {simulation.dt:g} s",
        *(f"  {o['name']} {settings.get(o['name'], o['default'])!r}: {o['meaning']}" for o in options),
    ]


# function that describes each class of strategies
WORDS = {NSCD: _nscd, SmoothDEM: _smooth, object: _listed}


def _last_step(simulation):
    """Line on the last step: status, error and deepest overlap."""
    info = simulation.info
    if not simulation.report:
        return []
    return [
        f"Step {simulation.steps}: {info['status']}, error {info['error']:.2g}; deepest overlap {info['penetration']:.2g} of the "
        f"smaller body's size (radius, or half of the least width), {info['largest_penetration']:.2g} in the steps so far"
    ]


def _scales(simulation):
    mass = simulation.bodies.mass
    finite = np.isfinite(mass)
    radius = simulation.radii()
    out = []
    if np.any(radius > 0):
        r = radius[radius > 0]
        out.append(f"Scales: radius {r.min():g} to {r.max():g} m (ratio {r.max() / r.min():.3g})")
    if np.any(finite):
        m = mass[finite]
        out.append(f"mass {m.min():g} to {m.max():g} kg (ratio {m.max() / m.min():.3g})")
        out += _extremes(simulation, mass, finite)
    gravity = simulation.scene.gravity
    if not callable(gravity) and np.any(gravity) and np.any(radius > 0):
        g = np.linalg.norm(gravity)
        fall = np.sqrt(2 * np.median(r) / g)
        out.append(f"time to fall one radius {fall:.3g} s = {fall / simulation.dt:.3g} steps")
    return out


def _extremes(simulation, mass, finite):
    """Lines on the largest and the smallest body with their masses, and on the densities of materials."""
    bodies, contactors = simulation.bodies, simulation.contactors
    size, joints = np.zeros(len(bodies)), _of_joints(simulation)
    rows = np.searchsorted(bodies.id, contactors.body)
    own = (rows < len(bodies)) & ~np.isin(contactors.body, joints)
    own[own] = bodies.id[rows[own]] == contactors.body[own]
    np.maximum.at(size, rows[own], contactors.radius[own])
    known = np.flatnonzero(finite & (size > 0))
    if not len(known):
        return []
    ends = (("largest", known[np.argmax(size[known])]), ("smallest", known[np.argmin(size[known])]))
    words = [f"the {name} body, {bodies.id[k]} ({size[k]:g} m in radius), weighs {mass[k]:g} kg" for name, k in ends]
    materials = {c.material.name: c.material for s in simulation._sets for c in s.contactors if not c.joint}
    given = [f"{name} {materials[name].density:g}" for name in sorted(materials) if materials[name].density is not None]
    return ["; ".join(words), *([f"densities: {', '.join(given[:8])} kg/m3"] if given else [])]


def _of_joints(simulation):
    """Ids of the contactors of joints fixed in the world."""
    ends = [s.ids for s in simulation._sets if s.contactors and all(c.joint for c in s.contactors)]
    return np.concatenate(ends) if ends else np.zeros(0, np.int64)
