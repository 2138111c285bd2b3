"""The loop of Simulation.run: outputs, checkpoints, progress, a clean end at a signal."""

from __future__ import annotations

import datetime
import sys
from pathlib import Path

import numpy as np

from . import _core


def scene_info(simulation):
    """What a reader of the file needs to draw the scene."""
    core = simulation._core.scene
    internal = core.raw_body("id")
    names = np.array(_core.shapes())
    contactors = {
        "shape": list(names[core.contactor("shape")]) if core.contactor_count < 100_000 else "",
        "shape_number": core.contactor("shape"),
        "body": internal[core.contactor("body")],
        "radius": core.contactor("radius"),
    }
    for name in ("offset", "direction"):
        values = core.contactor(name)
        if len(values):
            contactors[name] = values
    hull = core.contactor("hull")
    if len(hull):
        shown = ("first_vertex", "first_face", "first_corner", "corner_vertex", "vertex", "offset")
        contactors |= {"hull": hull, "hulls": {name: core.hulls[name] for name in shown}}
    species = [f"{m} ({g})" if g else m for m, g in simulation._species]
    return {
        "materials": species,
        "contactors": contactors,
        "shapes": list(names),
        "gravity": _plain(simulation.scene.gravity),
        "dt": simulation.dt,
        "strategy": repr(simulation.strategy),
        "rules": [repr(r) for r in simulation._rules],
    }


def _cell(scene):
    """The periodic cell at the start, as the scene states it; None without one."""
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
    core = simulation._core.scene
    out = {
        "position": bodies.position,
        "velocity": bodies.velocity,
        "radius": simulation.radii(),
        "id": bodies.id,
        "mass": bodies.mass,
        "material": _material(simulation),
    }
    if len(core.body("rotation")):
        out["rotation"] = core.body("rotation")
    if any(hasattr(mesh.body, "nodal_stress") for mesh in simulation.meshes):
        out["stress"] = _stress(simulation)
    pairs = contacts.bodies
    return out, {
        "point": contacts.point,
        "normal": contacts.normal,
        "gap": contacts.gap,
        "impulse": contacts.impulse,
        "status": contacts.status,
        "body_a": pairs[:, 0],
        "body_b": pairs[:, 1],
    }


def _stress(simulation):
    """Stress at the nodes of deformable bodies, zero for others, (n, 3 | 6) in the order xx yy [zz] xy [yz zx] [Pa]."""
    ids = simulation.bodies.id
    out = np.zeros((len(ids), 3 * simulation.scene.dim - 3))
    for mesh in simulation.meshes:
        if hasattr(mesh.body, "nodal_stress"):
            out[np.searchsorted(ids, mesh.ids)] = mesh.body.nodal_stress(mesh.displacement)
    return out


def _material(simulation):
    """Number of the material of each body's first contactor, (n,)."""
    core = simulation._core.scene
    ids, owners = core.body("id"), core.raw_body("id")[core.contactor("body")]
    rows = np.searchsorted(ids, owners)
    out = np.full(len(ids), -1, np.int32)
    out[rows[::-1]] = core.contactor("material")[::-1]
    return out


class _Recorder:
    """The output file and the checkpoints of a run; does nothing without a path."""

    def __init__(self, simulation, output, every, checkpoint_every, overwrite):
        self.simulation, self.every, self.checkpoint_every, self.writer = simulation, every, checkpoint_every, None
        self.checkpoint_path = None
        if output is not None:
            from .post.writer import RunWriter

            output = Path(output)
            self.checkpoint_path = output.with_suffix(".checkpoint.h5")
            scene = simulation.scene
            self.writer = RunWriter(
                output, scene_info(simulation), provenance(), dim=scene.dim, periodic=_cell(scene), overwrite=overwrite
            )
            self.write()

    def write(self):
        sim = self.simulation
        bodies, contacts = snapshot(sim)
        info = sim._info
        self.writer.write_step(sim.time, info.get("time_detection", sim.time), sim.steps, bodies, contacts)
        self.writer.flush()

    def record(self, probes):
        sim = self.simulation
        if self.writer is not None:
            row = {k: v for k, v in sim._info.items() if k not in ("step", "time", "hint")}
            row["energy"] = sim.energy
            row.update({name: float(probe(sim)) for name, probe in (probes or {}).items()})
            self.writer.write_history(sim.time, sim.steps, row)
            if sim.steps % self.every == 0:
                self.write()
        if self.checkpoint_every and self.checkpoint_path and sim.steps % self.checkpoint_every == 0:
            sim.checkpoint(self.checkpoint_path)

    def close(self):
        if self.writer is None:
            return
        if self.simulation.steps % self.every:
            self.write()
        self.writer.close()


def run(simulation, *, steps, until, while_, output, every, callback, checkpoint_every, probes, progress, overwrite):
    """See Simulation.run."""
    from .pre import checks
    from .progress import Progress, StopAtSignal

    if steps is None and until is None and while_ is None:
        raise ValueError("run needs an end: give steps=, until= or while_=")
    if steps is not None:
        checks.count("steps", steps)
    checks.count("every", every, 1)
    if until is not None:
        checks.number("until", until)
    if checkpoint_every is not None:
        checks.count("checkpoint_every", checkpoint_every, 1)
        if output is None:
            raise ValueError("checkpoint_every needs output=: checkpoints stand beside the output file")
    last = None if steps is None else simulation.steps + steps
    first = simulation.steps
    recorder = _Recorder(simulation, output, every, checkpoint_every, overwrite)
    total = steps
    if total is None and until is not None:
        total = max(0, int(np.ceil((until - simulation.time) / simulation.dt)))
    try:
        with StopAtSignal() as stop, Progress(total, enabled=progress) as bar:
            while not stop and (last is None or simulation.steps < last):
                # half a step of room: time is a sum of steps, each rounded
                if until is not None and simulation.time + simulation.dt / 2 > until:
                    break
                if while_ is not None and not while_(simulation):
                    break
                info = simulation.step()
                recorder.record(probes)
                bar.update(contacts=info["contacts"], iterations=info["iterations"], residual=info["error"])
                if callback is not None and callback(simulation) is False:
                    break
    finally:
        recorder.close()
    return simulation.steps - first
