"""Two runs side by side: `cairn verify A B`, body by body and contact by contact.

Each side is a run of Cairn (.vtkhdf), or what LMGC90 stored (an lmgc90.h5, a case folder with DATBOX and OUTBOX).
"""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..base.errors import FileError
from ..names import listed


@dataclass
class Frame:
    """One instant of a side: bodies by id, contacts by their two bodies."""

    time: float
    ids: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    pairs: np.ndarray | None = None  # (m, 2) ids of bodies, the smaller first
    gap: np.ndarray | None = None  # (m,) [m]
    force: np.ndarray | None = None  # (m, 2) normal and tangential size [N]
    point: np.ndarray | None = None  # (m, dim) [m]
    particles: np.ndarray | None = None  # (k, dim) positions of a liquid [m]
    flow: np.ndarray | None = None  # (k, dim) its velocities [m/s]
    scaled: bool = True  # False: the file does not tell the step, and `force` holds impulses [N s]


@dataclass
class Side:
    """All instants of a run, the size of its bodies and the spacing of its liquid [m]. carriers: {id: id of the first node of its
    mesh}, of all bodies that nodes, points and sides of meshes are in a run of Cairn; aside: ids of those that are no nodes, not
    stored by LMGC90."""

    name: str
    frames: list
    size: float
    carriers: dict = field(default_factory=dict)
    aside: frozenset = frozenset()
    spacing: float = 0.0


# Compared quantities in the order of the table: name, meaning.
COLUMNS = {
    "position": "largest distance of a body from its twin / body size",
    "position_rms": "the same, root of the mean square",
    "velocity": "largest difference of velocity / largest speed so far",
    "contacts": "contacts that carry a force in one run alone / in either",
    "gap": "largest difference of the gap of a contact that both have / body size",
    "force": "sum of the differences of contact forces / sum of the forces",
    "total_force": "difference of the sums of normal forces / sum",
    "fluid_position": "largest distance of a particle of the liquid from its twin / spacing",
    "fluid_velocity": "largest difference of velocity of the liquid / its largest speed so far",
}
OF_FLUID = {"fluid_position": "position", "fluid_velocity": "velocity"}  # the norm whose tolerance holds unless one is given


@dataclass
class Comparison:
    """Result of `verify`: a row of `time` and COLUMNS for each common instant; tolerances; the tolerances that were exceeded."""

    a: str
    b: str
    rows: list
    tolerances: dict
    lone_instants: tuple  # of A alone, of B alone
    lone_bodies: int
    failures: list = field(default_factory=list)

    @property
    def agrees(self):
        """All tolerances hold."""
        return not self.failures

    def table(self):
        """Text: norms at some instants, and the verdict."""
        names = [n for n in COLUMNS if n not in OF_FLUID or any(row[n] is not None for row in self.rows)]
        lines = [f"A: {self.a}", f"B: {self.b}", "", f"{'time':>12} " + " ".join(f"{n:>12}" for n in names)]
        step = max(1, (len(self.rows) + 11) // 12)
        shown = self.rows[::step] + ([] if (len(self.rows) - 1) % step == 0 else self.rows[-1:])
        for row in shown:
            lines.append(f"{row['time']:12.6g} " + " ".join(f"{_shown(row[n]):>12}" for n in names))
        lines += ["", f"{len(self.rows)} common instants; {self.lone_instants[0]} of A alone, {self.lone_instants[1]} of B alone"]
        if self.lone_bodies:
            lines.append(f"{self.lone_bodies} bodies are in one of the runs only")
        for name, gate in self.tolerances.items():
            worst = max((r[name] for r in self.rows if r[name] is not None), default=None)
            held = not any(f.startswith(f"{name} ") for f in self.failures)
            lines.append(f"{'holds' if held else 'FAILS'}: {name} {_shown(worst)}, tolerance {gate:g}")
        lines += [f"FAILS: {f}" for f in self.failures if f.split(" ")[0] not in self.tolerances]
        return "\n".join([*lines, "the runs agree" if self.agrees else "the runs differ"])

    def plot(self, ax=None):
        """Divergence over time on a logarithmic axis, with the tolerances; returns the Axes."""
        import matplotlib.pyplot as plt

        ax = ax or plt.subplots(figsize=(7, 4.5))[1]
        times = np.array([r["time"] for r in self.rows])
        for k, name in enumerate(("position", "velocity", "contacts", "force")):
            values = np.array([np.nan if r[name] is None else r[name] for r in self.rows], float)
            if np.any(values > 0):
                ax.plot(times, np.where(values > 0, values, np.nan), f"C{k}.-", label=COLUMNS[name].split(" / ")[0])
            if name in self.tolerances and self.tolerances[name] > 0:
                ax.axhline(self.tolerances[name], color=f"C{k}", ls="--", lw=0.8)
        ax.set(yscale="log", xlabel="time [s]", ylabel="difference (share of its scale)")
        if ax.lines:
            ax.legend(fontsize=8)
        return ax


def _shown(value):
    return "-" if value is None else f"{value:.3g}"


def verify(a, b, tolerances=None, *, until=None, size=None):
    """Compares two runs at their common instants.

    a, b: paths. tolerances: {name of COLUMNS: largest value allowed}, {"position": 1e-4} when not given. until: ignore
    later instants [s]. size: of a body [m], when not given the median radius of A or else of B; of meshes, what LMGC90's files
    tell, half the extent counts. Returns a Comparison.

    Raises ValueError or FileError when a side cannot be read or the two share no instant or no body.
    """
    tolerances = {"position": 1e-4} if tolerances is None else dict(tolerances)
    for name, gate in tolerances.items():
        if name not in COLUMNS:
            raise ValueError(f"there is no norm {name!r} to set a tolerance on; there are {listed(COLUMNS, name)}")
        if not gate >= 0:
            raise ValueError(f"the tolerance on {name} is {gate}: give a number >= 0")
    one, two = side(a), side(b)
    pairs = _common(one, two, until)
    _without_what_lmgc90_does_not_store(one, two)
    size = (one.size or two.size or one.spacing or two.spacing) if size is None else size
    if not size > 0:
        raise ValueError(f"{one.name} and {two.name} tell no radius of a body: give size [m]")
    rows, speed, lone, flow, fluid = [], 0.0, 0, 0.0, ""
    for fa, fb in pairs:
        speed = max(speed, float(np.max(np.abs(fa.velocity[:, : fa.position.shape[1]]), initial=0.0)))
        row, missing = _compare(fa, fb, size, speed)
        flow = max(flow, _fastest(fa.flow))
        fluid = fluid or _unlike_fluids(fa, fb)
        rows.append(row | _compare_fluids(fa, fb, one.spacing, flow))
        lone = max(lone, missing)
    result = Comparison(one.name, two.name, rows, tolerances, _alone(one, two, pairs, until), lone)
    if any(row["fluid_position"] is not None for row in rows):
        tolerances |= {name: tolerances[of] for name, of in OF_FLUID.items() if of in tolerances and name not in tolerances}
    for name, gate in tolerances.items():
        beyond = [r for r in rows if r[name] is not None and not r[name] <= gate]
        if beyond:
            result.failures.append(f"{name} is {beyond[0][name]:.3g} at t = {beyond[0]['time']:g} s, first beyond {gate:g}")
        elif all(r[name] is None for r in rows):
            what = "liquid" if name in OF_FLUID else "contacts"
            result.failures.append(f"{name} is not known at any instant: the runs hold no common {what}")
    if lone:
        result.failures.append(f"{lone} bodies are in one of the runs only")
    if fluid:
        result.failures.append(fluid)
    return result


def _fastest(velocity):
    return float(np.max(np.linalg.norm(velocity, axis=1), initial=0.0)) if velocity is not None else 0.0


def _unlike_fluids(fa, fb):
    """Text on liquids that cannot be compared particle by particle; empty if they can."""
    counts = [0 if f.particles is None else len(f.particles) for f in (fa, fb)]
    if counts[0] == counts[1]:
        return ""
    if 0 in counts:
        return f"at t = {fa.time:g} s a liquid is in {'B' if counts[0] == 0 else 'A'} only"
    return f"the liquid has {counts[0]} particles in A and {counts[1]} in B at t = {fa.time:g} s"


def _compare_fluids(fa, fb, spacing, speed):
    """Particles are paired by their order, which is that of the scene."""
    if fa.particles is None or fb.particles is None or fa.particles.shape != fb.particles.shape or not len(fa.particles):
        return dict.fromkeys(OF_FLUID)
    faster = _fastest(fa.flow - fb.flow)
    return {
        "fluid_position": float(np.max(np.linalg.norm(fa.particles - fb.particles, axis=1))) / spacing,
        "fluid_velocity": faster / speed if speed > 0 else float(faster > 0),
    }


def _without_what_lmgc90_does_not_store(one, two):
    """Points and sides of meshes are in runs of Cairn alone, and contacts name them instead of their mesh."""
    if (one.carriers or two.carriers) and not (one.carriers and two.carriers):
        known, run = (one, two) if one.carriers else (two, one)
        for f in run.frames:
            kept = ~np.isin(f.ids, list(known.aside))
            f.ids, f.position, f.velocity = f.ids[kept], f.position[kept], f.velocity[kept]
            if f.pairs is not None:
                named = np.array([[known.carriers.get(int(b), int(b)) for b in pair] for pair in f.pairs], int)
                f.pairs = np.sort(named.reshape(-1, 2), axis=1)


def _common(one, two, until):
    limit = np.inf if until is None else until
    pairs = []
    for fa in one.frames:
        near = min(two.frames, key=lambda f: abs(f.time - fa.time), default=None)
        if near is not None and fa.time <= limit and abs(near.time - fa.time) <= 1e-6 * max(abs(fa.time), abs(near.time)):
            pairs.append((fa, near))
    if not pairs:
        raise ValueError(
            f"the runs have no instant in common: {one.name} has {_times(one)}, {two.name} has {_times(two)}; "
            "write outputs at the same times"
        )
    return pairs


def _alone(one, two, pairs, until):
    limit = np.inf if until is None else until
    return tuple(sum(f.time <= limit for f in s.frames) - len(pairs) for s in (one, two))


def _times(s):
    times = [f.time for f in s.frames]
    return f"{len(times)} from {times[0]:g} to {times[-1]:g} s" if times else "none"


def _compare(fa, fb, size, speed):
    ids, ia, ib = np.intersect1d(fa.ids, fb.ids, return_indices=True)
    if len(ids) == 0:
        raise ValueError(f"at t = {fa.time:g} s the runs have no body in common: give runs of the same scene")
    if fa.position.shape[1] != fb.position.shape[1]:
        raise ValueError("one run is in 2D, the other in 3D: give runs of the same scene")
    dim = fa.position.shape[1]
    apart = np.linalg.norm(fa.position[ia] - fb.position[ib], axis=1) / size
    faster = np.linalg.norm(fa.velocity[ia, :dim] - fb.velocity[ib, :dim], axis=1)
    row = {
        "time": fa.time,
        "position": float(np.max(apart)),
        "position_rms": float(np.sqrt(np.mean(apart**2))),
        "velocity": float(np.max(faster) / speed) if speed > 0 else float(np.max(faster) > 0),
        "worst_body": int(ids[np.argmax(apart)]),
        "contacts": None,
        "gap": None,
        "force": None,
        "total_force": None,
    }
    if fa.pairs is not None and fb.pairs is not None:
        row |= _compare_contacts(fa, fb, size)
    return row, len(fa.ids) + len(fb.ids) - 2 * len(ids)


def _compare_contacts(fa, fb, size):
    """Contacts of a pair of bodies that meet in several places are taken with the nearest of the other run."""
    a, b = _keyed(fa, fb)
    total = sum(float(np.sum(f.force)) for f in (fa, fb)) / 2
    loaded_a = {k for k, i in a.items() if np.any(fa.force[i] > 1e-9 * np.max(fa.force, initial=0.0))}
    loaded_b = {k for k, i in b.items() if np.any(fb.force[i] > 1e-9 * np.max(fb.force, initial=0.0))}
    difference = 0.0
    for key in a.keys() | b.keys():
        x = fa.force[a[key]] if key in a else np.zeros(2)
        y = fb.force[b[key]] if key in b else np.zeros(2)
        difference += float(np.sum(np.abs(x - y)))
    both = a.keys() & b.keys()
    normal = [float(np.sum(f.force[:, 0])) for f in (fa, fb)]
    return {
        "contacts": len(loaded_a ^ loaded_b) / max(1, len(loaded_a | loaded_b)),
        "gap": max((abs(fa.gap[a[k]] - fb.gap[b[k]]) for k in both), default=0.0) / size,
        "force": (difference / total if total > 0 else 0.0) if fa.scaled and fb.scaled else None,
        "total_force": abs(normal[0] - normal[1]) / max(*normal, 1e-300) if fa.scaled and fb.scaled else None,
    }


def _keyed(fa, fb):
    """{(first body, second body, number): row} of both runs: corresponding contacts have the same key."""
    groups = [_by_pair(f) for f in (fa, fb)]
    a, b = {}, {}
    for pair in groups[0].keys() | groups[1].keys():
        rows = [g.get(pair, []) for g in groups]
        twins = [(0, 0)] if len(rows[0]) == len(rows[1]) == 1 else _nearest(fa.point[rows[0]], fb.point[rows[1]])
        order = [[t[side] for t in twins] for side in (0, 1)]
        for found, own, taken, first in zip((a, b), rows, order, (0, len(rows[0]))):
            others = [k for k in range(len(own)) if k not in set(taken)]
            found.update({(*pair, rank): own[k] for rank, k in enumerate(taken)})
            found.update({(*pair, len(twins) + first + rank): own[k] for rank, k in enumerate(others)})
    return a, b


def _by_pair(f):
    found = {}
    for i, pair in enumerate(f.pairs.tolist()):
        found.setdefault(tuple(pair), []).append(i)
    return found


def _nearest(one, other):
    """Pairs of rows of two sets of points, the nearest first, each row once."""
    apart = np.linalg.norm(one[:, None] - other[None], axis=2)
    pairs, left, right = [], set(range(len(one))), set(range(len(other)))
    for flat in np.argsort(apart, axis=None, kind="stable").tolist():
        i, j = divmod(flat, len(other))
        if i in left and j in right:
            pairs.append((i, j))
            left.remove(i)
            right.remove(j)
            if not left or not right:
                break
    return pairs


# ---------------------------------------------------------------------- sides


def side(path):
    """A run of either program as a Side. Raises FileError or ValueError for any other file."""
    path = Path(os.fspath(path))
    if not path.exists():
        raise FileError(path, "there is no such file or folder", "give a .vtkhdf file, an lmgc90.h5 or a legacy case folder")
    if path.is_dir() or path.name == "lmgc90.h5" or path.name.startswith("DOF.OUT"):
        return _legacy_side(path)
    return _run_side(path)


def _split(normal, impulse):
    along = np.einsum("ij,ij->i", normal, impulse)
    return np.column_stack([np.abs(along), np.linalg.norm(impulse - along[:, None] * normal, axis=1)])


def _run_side(path):
    from .load import load

    frames = []
    with load(path) as run:
        length = _lengths(run)
        for step in run:
            dt = length(step.step)
            c = step.contacts
            pairs = np.sort(np.column_stack([c["body_a"], c["body_b"]]), axis=1) if len(c) else np.zeros((0, 2), int)
            force = _split(c["normal"], c["impulse"]) / (dt or 1.0) if len(c) else np.zeros((0, 2))
            gap = np.array(c["gap"]) if len(c) else np.zeros(0)
            b = step.drawn
            point = np.array(c["point"])[:, : run.dim] if len(c) else np.zeros((0, run.dim))
            fluid = (step.fluid["position"], step.fluid["velocity"]) if len(step.fluid) else (None, None)
            told = (pairs, gap, force, point, *fluid, dt is not None)
            frames.append(Frame(float(step.time), np.array(b["id"]), b["position"], b["velocity"], *told))
        spacing = float(run.scene["fluid"]["spacing"]) if "fluid" in run.scene else 0.0
        radius = np.array(run[0].drawn["radius"]) if len(run) else np.zeros(0)
    radius = radius[radius > 0]
    return Side(str(path), frames, float(np.median(radius)) if len(radius) else 0.0, spacing=spacing)


def _lengths(run):
    """The length [s] of a step by its number: from the history, else the initial step of the run; None where neither is recorded,
    as in files of programs that write outputs alone."""
    history, begun = run.history, run.scene.get("dt")
    known = dict(zip(history["step"].tolist(), history["dt"].tolist())) if "dt" in history else {}
    return lambda step: known.get(step, None if begun is None else float(begun))


def _legacy_side(path):
    from ..legacy import datbox, read_results

    folder = path if path.is_dir() else path.parent
    found = next((f for f in (folder, folder / "DATBOX", folder.parent / "DATBOX") if (f / "BODIES.DAT").is_file()), None)
    if found is None:
        raise FileError(path, "there is no BODIES.DAT beside these results", "keep DATBOX and OUTBOX in one folder")
    box = datbox.parse(found)
    dim, rigid = box.dim, len(box.bodies)
    first, carriers, aside = _ids_of_meshes(found, box)
    start = np.array([b.position[:dim] for b in box.bodies]).reshape(-1, dim)
    ids = np.concatenate([np.arange(rigid), *(first[m.number] + np.arange(len(m.points)) for m in box.meshes)])
    frames = []
    for i in read_results(path, box.meshes):
        if len(i.displacement) != rigid and not (rigid == 0 or box.meshes and len(i.displacement) == 0):
            raise FileError(path, f"holds {len(i.displacement)} rigid bodies, BODIES.DAT {rigid}", "give one case")
        if len(i.displacement) != rigid:  # those at rest need not be listed
            i.displacement, i.velocity = np.zeros((rigid, dim)), np.zeros((rigid, 3 * dim - 3))
        if box.meshes and not i.meshes:
            raise FileError(path, "holds no displacements of its meshes", "meshes of heat alone are not compared")
        moved = [i.meshes[m.number] for m in box.meshes]
        position = [start + i.displacement, *(np.array(m.points) + x for m, (x, _) in zip(box.meshes, moved))]
        velocity = [i.velocity[:, :dim], *(v for _, v in moved)]
        frame = Frame(i.time, ids, np.concatenate(position), np.concatenate(velocity))
        if i.contacts is not None:
            _take_contacts(frame, i.contacts, first)
        frames.append(frame)
    radius = [b.radius for b in box.bodies if b.radius > 0]
    radius += [float(np.max(np.ptp(m.points, axis=0))) / 2 for m in box.meshes]
    return Side(str(path), frames, float(np.median(radius)) if len(radius) else 0.0, carriers, aside)


def _take_contacts(frame, contacts, first):
    bodies, meshed = contacts["bodies"].copy(), contacts["meshed"]
    for row, side in np.argwhere(meshed):
        bodies[row, side] = first[int(bodies[row, side]) + 1]
    frame.pairs = np.sort(bodies, axis=1)
    frame.gap, frame.point = contacts["gap"], contacts["point"][:, : frame.position.shape[1]]
    f = contacts["force"]
    frame.force = np.column_stack([np.abs(f[:, 0]), np.linalg.norm(f[:, 1:], axis=1)])


def _ids_of_meshes(folder, box):
    """{mesh: id of its first node in the scene of the folder}, carriers and aside as a Side has them. Meshes that no scene of
    Cairn holds follow after all that it does hold."""
    from ..legacy import LegacyError, UnmappedWarning, read_datbox

    first, carriers, aside, base = {}, {}, set(), 0
    if box.meshes:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UnmappedWarning)
            try:
                sets = read_datbox(folder, unmapped="skip").sets
            except LegacyError:
                sets = []
        names = {f"MAILx {m.number}": m for m in box.meshes}
        for s in sets:
            mesh = names.get(s.mesh.name) if s.mesh is not None else None
            if mesh is not None:
                start = first.setdefault(mesh.number, base)
                carriers |= dict.fromkeys(range(base, base + len(s.ids)), start)
                aside |= set(range(base, base + len(s.ids))) - set(range(start, start + len(mesh.points)))
            base += len(s.ids)
        base = max(base, len(box.bodies))
        for m in box.meshes:
            if m.number not in first:
                first[m.number] = base
                base += len(m.points)
    return first, carriers, frozenset(aside)
