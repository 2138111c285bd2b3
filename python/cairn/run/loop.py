"""The loop of Simulation.run: outputs, checkpoints, progress, a clean end at a signal."""

from __future__ import annotations

import contextlib
import datetime
import inspect
import logging
import os
import signal
import sys
import warnings
from functools import partial
from pathlib import Path

import numpy as np

from .. import _core
from ..base import checks
from . import scene_warnings
from .probes import Probe, Recorded
from .views import core_of

log = logging.getLogger("cairn.run")
logging.getLogger("cairn").addHandler(logging.NullHandler())  # silent unless the application configures logging
TAKEN = "probe {!r} bears the name of a column that every history has: give it another"
ROUNDING = 1e-3  # of a step: what a sum of many steps may miss of the time that it is to be
SOLVED = ("converged", "no_contacts", "explicit")  # explicit schemes have nothing to solve
ENDINGS = (".vtkhdf", ".h5", ".hdf5", ".hdf")  # suffixes of run files, which are HDF5


class Stopped(KeyboardInterrupt):
    """Raised when a run begins in a program whose previous run was stopped by a signal. status: exit status of the program."""

    def __init__(self, status):
        super().__init__("stopped by a signal")
        self.status = status


class Command:
    """Settings of `cairn run` for the runs of its script: replace files from before the script; no run after a signal.

    stopped: number of the signal that ended a run.
    """

    def __init__(self, overwrite=False):
        self.overwrite, self.stopped, self._written = overwrite, None, set()

    def replaces(self, path):
        """True if a file may be replaced: with overwrite, and unless this script wrote it itself."""
        own = path.resolve()
        new = own not in self._written
        self._written.add(own)
        return self.overwrite and new

    @property
    def status(self):
        """Exit status of the program."""
        return 0 if self.stopped is None else 128 + self.stopped


command = None  # the current Command, if `cairn run` runs this program


@contextlib.contextmanager
def commanded(overwrite=False):
    """Makes a Command the current one inside the `with` block, and yields it."""
    global command
    before, command = command, Command(overwrite)
    try:
        yield command
    finally:
        command = before


def scene_info(simulation):
    """Description of the scene in a run file, from which a reader can draw it."""
    known = simulation.contactors
    contactors = {
        "shape": list(known.shape) if len(known) < 100_000 else "",
        "shape_number": known.shape_number.copy(),
        "body": known.body.copy(),
        "radius": known.radius.copy(),
    }
    if simulation.meshes:
        contactors["nodes"] = simulation.contactors.nodes()
    for name in ("offset", "direction"):
        values = getattr(known, name).copy()
        if len(values):
            contactors[name] = values
    hull = known.hull.copy()
    if len(hull):
        hulls = known.hulls
        shown = ("first_vertex", "first_face", "first_corner", "corner_vertex", "vertex", "offset")
        contactors |= {"hull": hull, "hulls": {name: hulls[name] for name in shown}}
    species = [f"{m} ({g})" if g else m for m, g in simulation._species]
    joints = _joints(simulation)
    if joints:
        ends = np.isin(known.material, joints["material"])
        contactors["joint"] = np.where(ends, known.material, -1).astype(np.int32)
    return {
        "materials": species,
        "mark": simulation._fingerprint(),
        "core_mark": simulation._core_scene,
        "contactors": contactors,
        "shapes": _core.shapes(),
        "gravity": _plain(simulation.scene.gravity),
        "dt": simulation.dt,
        "strategy": repr(simulation.strategy),
        "rules": [repr(r) for r in simulation._rules],
        **({"meshes": _meshes(simulation)} if simulation.meshes else {}),
        **({"fluid": simulation.fluid.settings} if simulation._fluid else {}),
        **({"joints": joints} if joints else {}),
    }


def _joints(simulation):
    """Arrays over the joints: species of their ends, 1 if the ends are apart, number from 1 of the end that is a pulley."""
    found = {rule[0]: rule[2] for rule in simulation._rules if rule[2] is not None and rule[2].name == "joint"}
    made = [(number, found[name]) for (name, _), number in simulation._species.items() if name in found]
    if not made:
        return {}
    told = {of: np.array([getattr(law, of) for _, law in made], np.int32) for of in ("spans", "pulley")}
    return {"material": np.array([number for number, _ in made], np.int32), **told}


def _cell(scene):
    """Initial periodic cell of the scene; None without one."""
    if scene.periodic is None:
        return None
    names = ("periodic", "vectors", "corner", "velocity_gradient")
    return dict(zip(names, scene.periodic.arrays(scene.dim), strict=True))


def _plain(value):
    return "function of time" if callable(value) else np.asarray(value, float)


def provenance():
    """Version, compiler, flags, script and date of a run."""
    script = Path(sys.argv[0]) if sys.argv and sys.argv[0] else None
    text = ""
    with contextlib.suppress(OSError):  # the script may be unreadable for this user
        if script is not None and script.suffix == ".py" and script.is_file():
            text = script.read_text(errors="replace")
    return {
        **_core.build_info(),
        "python": sys.version.split()[0],
        "numpy": np.__version__,
        "script": script.name if script else "",
        "script_text": text,
        "arguments": " ".join(sys.argv[1:]),
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
    }


def snapshot(simulation):
    """Arrays of bodies and of contacts for one output."""
    bodies, contacts = simulation.bodies, simulation.contacts
    out = {
        "position": bodies.position,
        "velocity": bodies.velocity,
        "radius": simulation.radii(),
        "id": bodies.id,
        "mass": bodies.mass,
        "material": _material(simulation, bodies.id),
    }
    if "rotation" in bodies.names:
        out["rotation"] = bodies.rotation
    out |= {name: getattr(bodies, name) for name in ("temperature", "potential") if name in bodies.names}
    pairs = contacts.bodies
    return out, {
        "point": contacts.point,
        "normal": contacts.normal,
        "gap": contacts.gap,
        "impulse": contacts.impulse,
        "status": contacts.status,
        "body_a": pairs[:, 0],
        "body_b": pairs[:, 1],
        **contacts.of_laws(),
        **contacts.of_networks(),
    }


def snapshot_of_nodes(simulation, fields):
    """Arrays of the nodes of meshes for one output, with the MeshFields; {} without nodes."""
    nodes = simulation.nodes
    if not len(nodes):
        return {}
    out = {name: getattr(nodes, name) for name in ("position", "velocity", "id", "mass")}
    out["material"] = _material(simulation, nodes.id)
    out |= {name: getattr(nodes, name) for name in ("temperature", "potential") if name in nodes.names}
    return out | fields.nodes()


def _meshes(simulation):
    """Nodes (ids), cells, sides and groups of each deformable body with cells."""
    from ..files.mesh_cells import cells_of

    out = {}
    for k, mesh in enumerate(simulation.meshes):
        cells = cells_of(mesh.body)
        if cells:
            sides = np.zeros((0, mesh.body.dim), int)  # bars and beams have none
            if "line" not in cells:
                sides = mesh.body.boundary_edges() if mesh.body.dim == 2 else mesh.body.boundary_faces()
            groups = {name: nodes for name, nodes in mesh.body.groups.items() if len(nodes)}
            of = {"name": mesh.name, "nodes": mesh.ids, "cells": dict(cells), "sides": sides, "groups": groups}
            out[f"{k:06d}"] = of
    return out


def _material(simulation, ids):
    """Number of the material of the first contactor of each of the bodies or nodes, (n,)."""
    contactors = simulation.contactors
    own, material = contactors.body[::-1], contactors.material[::-1]
    carried = np.isin(own, ids)  # the other contactors are on points, edges and faces of meshes
    out = np.full(len(ids), -1, np.int32)
    out[np.searchsorted(ids, own[carried])] = material[carried]
    return out


class _Recorder:
    """The output file and the checkpoints of a run; does nothing without a path."""

    def __init__(self, simulation, output, every, checkpoint_every, overwrite, append, probes):
        self.simulation, self.every, self.checkpoint_every, self.writer = simulation, every, checkpoint_every, None
        self.checkpoint_path, self.fields = None, {}
        self.ranks = simulation.ranks  # the first of them writes
        if output is not None and self.ranks is not None:
            simulation.gather()
            simulation.follow_rotations()
            if not self.ranks.first:
                self.checkpoint_path = Path(output).with_suffix(".checkpoint.h5")
                output = None
        self.probes = Recorded(simulation, probes)
        if output is not None:
            from ..files.writer import RunWriter
            from .mesh_fields import MeshFields

            self.mesh_fields = MeshFields(simulation)
            output = checked_output(output)
            if not append:
                overwrite = overwrite or (command is not None and command.replaces(output))
            self.checkpoint_path = output.with_suffix(".checkpoint.h5")
            scene = simulation.scene
            if self.ranks is None:
                simulation.follow_rotations()
            self.written = None
            kept, info, self.tells_meshes = 0, scene_info(simulation), None
            if probes:
                info["probes"] = list(probes)
            if append and output.exists():
                self.writer, kept, self.tells_meshes = continued(output, simulation, info)
            else:
                cell = _cell(scene)
                self.writer = RunWriter(output, info, provenance(), dim=scene.dim, periodic=cell, overwrite=overwrite)
            if not kept:
                self.write()

    def write(self):
        sim = self.simulation
        self.written = sim.steps
        bodies, contacts = snapshot(sim)
        info = sim.report
        cells, nodes = self.mesh_fields.cells(), snapshot_of_nodes(sim, self.mesh_fields)
        self._keep_fields("bodies", bodies, len(sim.bodies))
        if cells is not None:
            self._keep_fields("cells", cells["fields"], len(cells["types"]))
        if nodes:
            if self.tells_meshes is False:
                nodes.pop("mesh", None)
            elif self.tells_meshes:
                nodes.setdefault("mesh", np.full(len(sim.nodes), -1))
            self._keep_fields("nodes", nodes, len(sim.nodes))
        at = info.get("time_detection", sim.time)
        fluid = sim.fluid.snapshot() if sim._fluid else None
        self.writer.write_step(sim.time, at, sim.steps, bodies, contacts, cells=cells, nodes=nodes, fluid=fluid)
        self.writer.flush()
        sim._last_outputs[_place(self.writer.path)] = sim.steps
        log.debug("output at step %d, t = %g s: %d bodies, %d contacts", sim.steps, sim.time, len(sim.bodies), len(sim.contacts))

    def _keep_fields(self, what, fields, n):
        """Restricts fields to those of the first output: additional fields are left out, missing fields are zero."""
        first = self.fields.setdefault(what, {name: (values.dtype, values.shape[1:]) for name, values in fields.items()})
        for name in set(fields) - set(first):
            del fields[name]
        for name in set(first) - set(fields):
            dtype, shape = first[name]
            fields[name] = np.zeros((n, *shape), dtype)

    def record(self):
        sim = self.simulation
        if self.ranks is not None and self.checkpoint_path and sim.steps % self.every == 0:
            sim.gather()
        if self.writer is not None:
            told = ("step", "time", "hint", "joint_hint", "mesh_hint", "mesh_within", "mesh_turned", "unjoined")
            row = {k: v for k, v in sim.report.items() if k not in told}
            row["energy"] = sim.energy
            for name, value in self.probes.values().items():
                if name in row:
                    raise ValueError(TAKEN.format(name))
                row[name] = value
            self.writer.write_history(sim.time, sim.steps, row)
            if sim.steps % self.every == 0:
                self.write()
        if self.checkpoint_every and self.checkpoint_path and sim.steps % self.checkpoint_every == 0:
            sim.checkpoint(self.checkpoint_path)
            log.info("checkpoint at step %d, t = %g s: %s", sim.steps, sim.time, self.checkpoint_path)

    def close(self, failed=False):
        self.probes.close()
        if self.ranks is not None and self.checkpoint_path:
            if failed and self.ranks.count > 1:
                self.written = self.simulation.steps  # others do not give their part
            else:
                self.simulation.gather()
        if self.writer is None:
            return
        if self.simulation.steps % self.every and self.simulation.steps != self.written:
            self.write()
        self.writer.close()


def _place(path):
    """Absolute path, the key under which a simulation keeps the runs that it wrote."""
    return str(Path(path).resolve())


def checked_output(output):
    """Checked path of a run file. Raises FileError for a suffix that is not that of HDF5."""
    from ..base.errors import FileError, named

    path = Path(named(output, "a run", ".vtkhdf", "; 'cairn convert' makes .vtp, .vtu, .csv or .npz of it"))
    if os.path.isdir(path):
        raise FileError(path, "this is a folder", "give the name of a file in it, such as run.vtkhdf")
    if path.suffix.lower() not in ENDINGS:
        ending = f"ends in {path.suffix}" if path.suffix else "has no ending"
        raise FileError(path, f"a run is an HDF5 file, and this name {ending}", "give a name that ends in .vtkhdf")
    return path


def _mesh_names(info):
    """[(name, id of the first node)] of the meshes in the description of a run file."""
    return [(str(mesh["name"]), int(mesh["nodes"][0])) for _, mesh in sorted((info.get("meshes") or {}).items())]


def continued(output, simulation, info):
    """(writer that appends to the run file at a path, number of outputs kept, True if outputs hold the mesh of each node or None
    without outputs). Outputs beyond the step of the simulation are dropped, so that steps made again after a restart replace
    them. Raises FileError if the run is of another scene, or has later steps and no checkpoint was restored."""
    from ..base.errors import FileError
    from ..files.reader import StoredRun
    from ..files.writer import RunWriter

    with StoredRun(output) as run:
        theirs, own = run.scene.get("contactors") or {}, info["contactors"]
        same = run.dim == simulation.scene.dim and (run.periodic is None) == (simulation.scene.periodic is None)
        if same and len(run):
            names = ("body", "shape_number", "radius")
            old, new = ([np.asarray(table.get(name, ())) for name in names] for table in (theirs, own))
            # compares only bodies in both: others were added or removed since
            old, new = ([a[np.isin(t[0], u[0])] for a in t] for t, u in ((old, new), (new, old)))
            known = len(old[0]) > 0 or (not len(theirs.get("body", ())) and _mesh_names(run.scene) == _mesh_names(info))
            same = known and all(map(np.array_equal, old, new))
        if not same:
            remedy = "give another name, or restore a checkpoint of the simulation that wrote it"
            raise FileError(output, "this run is of another scene, and cannot be gone on with", remedy)
        tells_meshes = "mesh" in run[-1].nodes.names if len(run) else None
    marks = [(name, info[name]) for name in ("mark", "core_mark")]
    last = simulation._last_outputs.get(_place(output), -1)
    core_of(simulation).refuse_other_run(str(output), simulation._came_by, last, marks)
    writer = RunWriter.go_on(output, simulation.steps)
    return writer, writer.outputs, tells_meshes if writer.outputs else None


def _takes_a_simulation(name, function, why):
    if function is None:
        return
    if not callable(function):
        raise ValueError(f"{name} is {function!r}: give a function of the simulation, {why}")
    try:
        signature = inspect.signature(function)
    except (ValueError, TypeError):  # some functions of C have none
        return
    try:
        signature.bind(None)
    except TypeError:
        raise ValueError(f"{name} takes {signature}: give a function of one argument, the simulation") from None


def _called_by(probe):
    """Function of a probe; None where the core reads it."""
    if isinstance(probe, Probe):
        return probe.quantity if callable(probe.quantity) else None
    return probe


def _check_probes(simulation, probes):
    """Raises ValueError unless probes are functions of the simulation, under names that are no column of the history."""
    if not (isinstance(probes, dict) and all(callable(probe) or isinstance(probe, Probe) for probe in probes.values())):
        text = "give {name: function}, of functions of the simulation that give a number, or {name: cairn.Probe(...)}"
        raise ValueError(f"probes is {probes!r}: {text}")
    taken = {"time", "step", *simulation.report, *(f"energy_{term}" for term in simulation.energy)}
    for name, probe in probes.items():
        if not isinstance(name, str) or not name or "/" in name:
            raise ValueError(f"the name of a probe is {name!r}: give a word, which names its column of the history")
        if name in taken:
            raise ValueError(TAKEN.format(name))
        _takes_a_simulation(f"probe {name!r}", _called_by(probe), "which gives a number")


def _check(simulation, steps, until, while_, every, callback, checkpoint_every, probes, output, time_error_every):
    if until is not None and checks.number("until", until) < simulation.time - simulation.dt / 2:
        raise ValueError(f"until is {until!r}: the simulation is at {simulation.time:g} s already; give a later time, or steps=")
    if steps is not None:
        checks.count("steps", steps)
    checks.count("every", every, 1)
    if time_error_every is not None:
        checks.count("time_error_every", time_error_every, 1)
    if checkpoint_every is not None:
        checks.count("checkpoint_every", checkpoint_every, 1)
        if output is None:
            raise ValueError("checkpoint_every needs output=: checkpoints stand beside the output file")
    check_calls(simulation, callback, probes, output)
    _takes_a_simulation("while_", while_, "which is true as long as the run goes on")


def check_calls(simulation, callback, probes, output):
    """Raises ValueError unless callback and probes are functions of the simulation, or None, and probes have a file."""
    _takes_a_simulation("callback", callback, "which runs after each step")
    if probes is not None:
        _check_probes(simulation, probes)
    if probes and output is None:
        raise ValueError("probes needs output=: their numbers stand in the history of the run file, cn.load(output).history; "
                         "give output=, or collect them in callback=")  # fmt: skip


def _warn_of_no_step(simulation, steps, until):
    """Warns if `until` is later than now and less than half a step away, so that a run makes no step."""
    left = None if until is None else until - simulation.time
    if left is not None and steps != 0 and ROUNDING * simulation.dt < left < simulation.dt / 2:
        warnings.warn(
            f"until is {until!r}, {left:.3g} s from now, less than half a step (dt = {simulation.dt:g} s): it makes no step; "
            "give a later time, a smaller dt, or steps=1",
            stacklevel=5,
        )


def _tell(simulation, number, output):
    """Prints that a signal ended the run, since closing files may take long."""
    name = "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name
    where = "" if output is None else f"; {output} holds what was done"
    told = f"cairn: stopped by {name} at step {simulation.steps}, t = {simulation.time:g} s{where}"
    with contextlib.suppress(OSError):  # after SIGHUP the terminal is gone
        print(told, file=sys.stderr, flush=True)


def _stepped(simulation, first, time_error_every):
    """Makes a step and returns its report, with the estimate of its time error if it is due."""
    if time_error_every is None:
        return simulation.step()
    from . import time_error

    due = (simulation.steps - first) % time_error_every == 0
    doubling = time_error.halved(simulation) if due else None
    report = simulation.step()
    found = time_error.of_step(simulation, doubling)
    return report if found is None else simulation.add_to_report(time_error=found)


def _of_any(ranks, number):
    """Number of the signal that came to any rank; None without one. All ranks call it."""
    from .progress import STOPPING

    return next((k for k in STOPPING if ranks.any(k == number, "run")), None)


@contextlib.contextmanager
def _closing(recorder, alike):
    """Closes a recorder at the end of the `with` block; without an error, within `alike`, a block of all ranks."""
    failed = True
    try:
        yield
        failed = False
    finally:
        with contextlib.nullcontext() if failed else alike():
            recorder.close(failed)


def _check_same(ranks, given, functions, probes):
    """Compares what ranks gave to a run; of functions, whether there is one."""
    output = given["output"]
    given = given | {"output": None if output is None else str(output)}
    ranks.check_same("run", given | {name: of is None for name, of in functions.items()} | {"probes": sorted(probes or {})})


def _end_by(simulation, number, output):
    """Tells of the signal that ended a run, to `cairn run` too; None: it came to its end."""
    if number is None:
        return
    if simulation.ranks is None or simulation.ranks.first:
        _tell(simulation, number, output)
    if command is not None:
        command.stopped = number


def run(simulation, *, steps, until, while_, output, every, callback, checkpoint_every, probes, progress, overwrite, append,
        time_error_every=None):  # fmt: skip
    """See Simulation.run."""
    from .progress import Progress, StopAtSignal

    if steps is None and until is None and while_ is None:
        raise ValueError("run needs an end: give steps=, until= or while_=")
    if not len(simulation.bodies) + len(simulation.nodes) and callback is None and not simulation._fluid:
        raise ValueError("the scene has no bodies: give it some, Scene.add or Simulation.add, before a run")
    _check(simulation, steps, until, while_, every, callback, checkpoint_every, probes, output, time_error_every)
    if progress != "always":
        checks.flag("progress", progress)
    if checks.flag("append", append) & checks.flag("overwrite", overwrite):
        raise ValueError("append and overwrite are both True: give one of them, to go on in a file or to replace it")
    if command is not None and command.stopped is not None:
        raise Stopped(command.status)  # a script of many runs ends with the run that was stopped
    ranks = simulation.ranks
    if ranks is not None:
        given = {"steps": steps, "until": until, "every": every, "checkpoint_every": checkpoint_every, "output": output}
        _check_same(ranks, given, {"while_": while_, "callback": callback}, probes)
    last = None if steps is None else simulation.steps + steps
    first = simulation.steps
    alike = contextlib.nullcontext if ranks is None or output is None else partial(ranks.failing_alike, output)
    together = contextlib.nullcontext if ranks is None else ranks.failing_together
    with alike():
        recorder = _Recorder(simulation, output, every, checkpoint_every, overwrite, append, probes)
    total = steps
    if total is None and until is not None:
        total = max(0, int(np.ceil((until - simulation.time) / simulation.dt)))
    _warn_of_no_step(simulation, steps, until)
    log.info("run from step %d, t = %g s, dt = %g s, %d bodies%s", first, simulation.time, simulation.dt, len(simulation.bodies),
             "" if output is None else f", to {output}")  # fmt: skip
    if ranks is not None and not ranks.first:
        progress = False
    left = contextlib.nullcontext() if ranks is None else ranks.leaving_state()
    # signals wait for the files too
    with StopAtSignal() as stop, _closing(recorder, alike), Progress(total, enabled=progress) as bar, left:
        ended = False
        while last is None or simulation.steps < last:
            # half a step of tolerance, since time is a rounded sum of steps
            ended = ended or bool(stop) or (until is not None and simulation.time + simulation.dt / 2 > until)
            with together():
                ended = ended or (while_ is not None and not while_(simulation))
            if ended if ranks is None else ranks.any(ended, "run"):  # one rank ends the run of all
                break
            info = _stepped(simulation, first, time_error_every)
            with together():
                recorder.record()
            if info["status"] not in SOLVED and log.isEnabledFor(logging.WARNING):
                log.warning("step %d: %s, error %.2e after %d iterations", simulation.steps, info["status"], info["error"],
                            info["iterations"])  # fmt: skip
            bar.update(contacts=info["contacts"], iterations=info["iterations"], residual=info["error"],
                       overlap=simulation._deepest)  # fmt: skip
            with together():
                ended = callback is not None and callback(simulation) is False
    log.info("run to step %d, t = %g s", simulation.steps, simulation.time)
    _end_by(simulation, stop.signal if ranks is None else _of_any(ranks, stop.signal), output)
    scene_warnings.warn_of_rest(simulation, simulation.steps - first, 4)
    return simulation.steps - first
