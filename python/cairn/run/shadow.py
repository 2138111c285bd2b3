"""Shadow mode: a second kernel runs beside a stage of the step, on the same input, and the differences are recorded.

The step itself is not changed: a simulation gives the same bits with and without shadows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from weakref import WeakKeyDictionary

import numpy as np

from .. import _core
from ..names import listed
from . import contact_problem, shadow_cells, shadow_laws
from .stages import ORDER

# Results of stages that are compared with a shadow: fields of bodies (n, components) in internal order.
OUTPUTS = {
    "predict_configuration": ("position",),
    "compute_free_velocity": ("velocity_free",),
    "solve_contacts": ("velocity",),
    "update_configuration": ("position",),
}
INPUTS = ("position", "velocity", "mass", "inertia", "inverse_mass", "velocity_free", "force", "driven", "driven_velocity")


@dataclass
class Shadow:
    """Results of a shadow. records: (step, time [s], difference, body) of each step, the difference relative to the largest
    value; beyond: the first record above tol, or None; dump: file with the input of that step. For contact_laws, of: the law;
    columns: largest difference so far of impulse, moment and each state variable."""

    stage: str
    kernel: object
    tol: float
    folder: Path
    name: str
    records: list = field(default_factory=list)
    beyond: tuple | None = None
    dump: Path | None = None
    of: object = None
    columns: dict = field(default_factory=dict)
    scales: dict = field(default_factory=dict, repr=False)

    @property
    def largest(self):
        """The largest difference so far."""
        return max((r[2] for r in self.records), default=0.0)

    def __repr__(self):
        said = "never beyond" if self.beyond is None else f"first beyond at step {self.beyond[0]} ({self.dump})"
        steps = f"{len(self.records)} steps, largest difference {self.largest:.3g}"
        if self.columns:
            steps += f" ({', '.join(f'{name} {found:.3g}' for name, found in self.columns.items())})"
        return f"<shadow of {self.stage}: {steps}, tol {self.tol:g}, {said}>"


def add(simulation, stage, kernel, tol, folder, name, of=None):
    """Makes a checked Shadow; see Simulation.shadow."""
    known = [*OUTPUTS, *shadow_cells.STAGES, *shadow_laws.STAGES]
    if stage not in known:
        raise ValueError(f"stage is {stage!r}: stages that can have a shadow are {listed(known, stage)}")
    if stage in shadow_cells.STAGES and not any(isinstance(getattr(m.body, "cells", None), dict) for m in simulation.meshes):
        raise ValueError(f"stage {stage!r} needs a deformable body of cells, and there is none: give another stage")
    if not simulation.strategy.stages:
        own = type(simulation.strategy).__name__
        raise ValueError(f"shadows need the stages of NSCD, and the strategy is {own}: take cairn.NSCD()")
    if not (isinstance(tol, (int, float)) and tol >= 0 and math.isfinite(tol)):
        raise ValueError(f"tol is {tol!r}: give a number >= 0, relative to the largest value")
    if stage in shadow_laws.STAGES:
        of = shadow_laws.checked(simulation, kernel, of)
    elif of is not None:
        raise ValueError(f"of is {of!r}, and {stage} is of no law: leave it out")
    if stage in shadow_laws.STAGES and (kernel == "reference" or isinstance(kernel, shadow_laws.Law)):
        kernel = shadow_laws.asked(kernel, of)
    elif isinstance(kernel, str):
        kernel = _named(stage, kernel)
    elif not callable(kernel):
        raise ValueError(f"kernel is {kernel!r}: give 'reference', a solver of cairn.problems, a law, or a function")
    return Shadow(stage, kernel, float(tol), Path(folder), name or stage, of=of)


def _named(stage, name):
    if name == "reference":
        return shadow_cells.REFERENCES.get(stage) or {
            "solve_contacts": plain_solution,
            "compute_free_velocity": plain_free_velocity,
            "predict_configuration": lambda s: plain_configuration(s, 1 - s["theta"], "velocity"),
            "update_configuration": lambda s: plain_configuration(s, s["theta"], "velocity"),
        }[stage]
    from ..problems import solvers

    known = list(solvers())
    if stage != "solve_contacts" or name not in known:
        raise ValueError(f"kernel is {name!r}: give 'reference', or for solve_contacts one of {listed(known, name)}")
    return lambda s: s["problem"].solve(name, tol=1e-12).r


def step(simulation, dt, shadows):
    """Makes a step stage by stage, with the shadows beside their stages; returns the report of the step."""
    stages = simulation.stages
    stages.begin_step(dt)
    found, solved = [], []
    try:
        for stage in ORDER:
            mine = [s for s in shadows if s.stage == stage]
            before = [_input(simulation, s, stages.h) for s in mine]
            laws = [s for s in shadows if s.stage in shadow_laws.STAGES and stage == "commit_contacts"]
            asked = [(s, shadow_laws.given_of(simulation, s.of)) for s in laws]
            getattr(stages, stage)()
            done = list(zip(mine, before))
            found += [(s, given, shadow_laws.difference(simulation, s, given)) for s, given in asked]
            if stage == "solve_contacts":  # compared by velocities, since impulses need not be unique
                solved, done = done, []
            for s, given in solved if stage == "update_velocity" else done:
                found.append((s, given, _difference(simulation, s, given)))
    except BaseException:
        if stages.due is not None:
            stages.undo_step()
        raise
    report = stages.end_step()
    for s in (s for s in shadows if s.stage in shadow_cells.STAGES):
        for view in simulation.meshes:
            if isinstance(getattr(view.body, "cells", None), dict):
                given = shadow_cells.given_of(simulation, view, report["dt"])
                found.append((s, given, shadow_cells.difference(simulation, s, view, given)))
    for s, given, (difference, body, other) in found:
        record = (simulation.steps, simulation.time, difference, body)
        s.records.append(record)
        if s.beyond is None and not difference <= s.tol:
            s.beyond = record
            s.dump = _dump(s, given, other, simulation.steps)
    return report


def _input(simulation, shadow, h):
    """Input of a shadow kernel: copies, which it may change."""
    s = {"dim": simulation.scene.dim, "h": h, "theta": simulation.strategy.theta, "gravity": simulation.stages.gravity}
    s |= {name: contact_problem.stacked(simulation, name) for name in INPUTS}
    if simulation.meshes:
        s["meshes"] = [_of_mesh(simulation, mesh, h) for mesh in simulation.meshes]
    if shadow.stage == "solve_contacts":
        s |= contact_problem.problem_of(simulation)
    return s


def _of_mesh(simulation, mesh, h):
    """Input on a deformable body: rows of its nodes, below those of rigid bodies; matrices; loads at both ends of the step; held
    dofs and their velocities; displacement at the beginning of the step; forces of an initial stress, if any."""
    t = simulation.time
    rows = len(simulation.bodies) + mesh.rows
    reference = mesh.body.points - simulation.scene.origin
    known = {"rows": rows, "held": mesh.held, "M": mesh.body.M, "C": mesh.body.C, "K": mesh.body.K}
    known |= {"A": contact_problem.step_matrix(simulation, mesh, h)}
    if (force := _initial_force(mesh.body)) is not None:
        known["initial_force"] = force
    known |= {"load": [mesh.load(t), mesh.load(t + h)], "held_velocity": mesh.held_velocity(t + h)}
    displacement = np.array(simulation.raw.nodes.position_begin)[mesh.rows] - reference
    return known | {"displacement": displacement, "explicit": simulation.strategy.explicit}


_FOUND = WeakKeyDictionary()  # forces of SolidBodies at zero displacement, kept


def _initial_force(body):
    """Nodal forces (n dofs) of the initial stress of a body [N], None without; evaluated by its material for a SolidBody."""
    if getattr(body, "initial_stress", None) is None or not hasattr(body, "blocks"):
        known = getattr(body, "initial_force", None)
        return None if known is None else np.ravel(known)
    if body not in _FOUND:
        _FOUND[body] = np.ravel(body.tangent(np.zeros_like(body.points))[0])
    return _FOUND[body]


def _difference(simulation, shadow, given):
    """(largest difference / largest value, id of the body, result of the kernel)."""
    other = shadow.kernel(given)
    mine = contact_problem.stacked(simulation, OUTPUTS[shadow.stage][0])
    if shadow.stage == "solve_contacts":
        r = np.asarray(other, float)
        want = (given["problem"].contacts, given["dim"])
        if r.shape != want:
            raise ValueError(f"the shadow of solve_contacts gave an array of shape {r.shape}: impulses {want} were expected")
        change = given["inverse"] @ (given["operator"].T @ r.ravel())
        other = given["velocity_free"] + change.reshape(given["velocity_free"].shape)
        scale = np.max(np.abs(given["velocity_free"]), initial=0.0)
    else:
        other = np.asarray(other, float)
        if other.shape != mine.shape:
            raise ValueError(f"the shadow of {shadow.stage} gave an array of shape {other.shape}: {mine.shape} was expected")
        scale = np.max(np.abs(mine), initial=0.0)
    apart = np.max(np.abs(np.asarray(other) - mine), axis=1, initial=0.0)
    if not np.all(np.isfinite(other)):
        apart = np.where(np.all(np.isfinite(other), axis=1), 0.0, np.inf)
    if len(apart) == 0 or not np.max(apart) > 0:
        return 0.0, -1, np.asarray(other)
    worst = int(np.argmax(apart))
    ids = contact_problem.stacked(simulation, "id").ravel()
    return float(apart[worst] / scale) if scale > 0 else math.inf, int(ids[worst]), np.asarray(other)


def _dump(shadow, given, other, steps):
    """Writes the input of the first step beyond the tolerance: a problem file in FCLIB's layout, or arrays for numpy."""
    shadow.folder.mkdir(parents=True, exist_ok=True)
    stem = shadow.folder / f"shadow_{shadow.name}_{steps:06d}"
    if shadow.stage == "solve_contacts":
        from .. import problems

        path = stem.with_suffix(".hdf5")
        path.unlink(missing_ok=True)
        problems.write(path, given["problem"])
        return path
    path = stem.with_suffix(".npz")
    if shadow.stage in shadow_laws.STAGES:
        given = given | {f"parameter_{k}": v for k, v in given["parameters"].items()}
        given |= {f"state_{k}": v for k, v in given["state"].items()}
    if isinstance(other, dict):
        np.savez(path, **{f"given_by_shadow_{k}": v for k, v in other.items()},
                 **{k: v for k, v in given.items() if isinstance(v, (int, float, np.ndarray))})  # fmt: skip
        return path
    np.savez(path, given_by_shadow=other, **{k: v for k, v in given.items() if isinstance(v, (int, float, np.ndarray))})
    return path


# ---------------------------------------------------------------------- plain references


def plain_solution(s):
    """Gauss-Seidel sweeps of core_f90/reference until velocities are constant; for bodies whose levers lie along the normal."""
    if s.get("meshes"):
        raise ValueError("the scene has meshes, whose nodes move together, and the plain reference knows round bodies alone: "
                         "give kernel='nlgs' for an independent solver of the same problem")  # fmt: skip
    rows, chosen, dim = s["rows"], s["chosen"], s["dim"]
    normal, inverse = rows.axes[chosen][:, 0], s["inverse_mass"]
    lever = np.einsum("msk,mk->ms", rows.lever[chosen], normal)
    turns = inverse[rows.bodies[chosen]][:, :, dim:].any(axis=2)
    aside = np.linalg.norm(rows.lever[chosen] - lever[:, :, None] * normal[:, None, :], axis=2) > 1e-9 * np.abs(lever)
    if np.any(turns & aside):
        raise ValueError(
            f"contact {chosen[np.argmax((turns & aside).any(axis=1))]} does not lie on the normal through its bodies' centres: "
            "the plain reference knows round bodies alone; give kernel='nlgs' for an independent solver of the same problem"
        )
    lever = np.where(turns, lever, 0.0)
    frame = normal if dim == 2 else np.concatenate([normal, rows.axes[chosen][:, 1]], axis=1)
    v, r = np.array(s["velocity_free"]), np.zeros((len(chosen), dim))
    body = np.ascontiguousarray(rows.bodies[chosen], np.int32)
    mass, turning = np.ascontiguousarray(inverse[:, 0]), np.ascontiguousarray(inverse[:, dim])
    mu, bias = np.ascontiguousarray(rows.mu[chosen]), np.ascontiguousarray(rows.bias[chosen][:, 0])
    for _ in range(1000):
        before = v.copy()
        _core.plain_sweeps(dim, 20, body, np.ascontiguousarray(frame), np.ascontiguousarray(lever), mu, bias, mass, turning, v, r)
        if np.max(np.abs(v - before), initial=0.0) <= 1e-14 * np.max(np.abs(v), initial=0.0):
            break
    return r


def plain_free_velocity(s):
    """v + h (g + f/m), h f/J for spins, body by body; driven dofs take their velocity. Assumes no damping, isotropic inertia."""
    v, dim = s["velocity"], s["dim"]
    free = np.array(v)
    for i in range(len(v)):
        for k in range(v.shape[1]):
            mass = s["mass"][i] if k < dim else np.ravel(s["inertia"][i])[k - dim if dim == 3 else 0]
            f = s["force"][i, k] if len(s["force"]) else 0.0
            if len(s["driven"]) and int(s["driven"][i]) >> k & 1:
                free[i, k] = s["driven_velocity"][i, k] if len(s["driven_velocity"]) else 0.0
            elif np.isfinite(mass):
                free[i, k] = v[i, k] + s["h"] * ((s["gravity"][k] if k < dim else 0.0) + f / mass)
    for mesh in s.get("meshes", ()):
        free[mesh["rows"], :dim] = plain_free_nodes(s, mesh)
    return free


def plain_free_nodes(s, mesh):
    """Free velocity v + A^-1 h (M g + f - f0 - C v - K (q + h theta v)) of the nodes of a mesh; f0: forces of an initial stress;
    explicit steps use K q. Held dofs take their velocity."""
    dim, h, theta = s["dim"], s["h"], s["theta"]
    v, q = s["velocity"][mesh["rows"], :dim].ravel(), mesh["displacement"].ravel()
    force = mesh["M"] @ np.tile(s["gravity"][:dim], len(v) // dim)
    force += ((1 - theta) * mesh["load"][0] + theta * mesh["load"][1]).ravel()
    force -= mesh["C"] @ v + mesh["K"] @ (q if mesh["explicit"] else q + h * theta * v)
    if "initial_force" in mesh:
        force -= mesh["initial_force"]
    change = np.zeros(len(v))
    change[mesh["held"]] = (mesh["held_velocity"].ravel() - v)[mesh["held"]]
    free = np.setdiff1d(np.arange(len(v)), mesh["held"])
    a = mesh["A"].toarray()
    change[free] = np.linalg.solve(a[np.ix_(free, free)], h * force[free] - a[free] @ change)
    return (v + change).reshape(-1, dim)


def plain_configuration(s, share, name):
    """x + h share v, body by body."""
    x = np.array(s["position"])
    for i in range(len(x)):
        for k in range(s["dim"]):
            x[i, k] += s["h"] * share * s[name][i, k]
    return x
