"""Two runs side by side: `cairn verify A B`, body by body and contact by contact.

Each side is a run of Cairn (.vtkhdf), or what LMGC90 stored (an lmgc90.h5, a case folder with DATBOX and OUTBOX).
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..names import listed
from .errors import FileError


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


@dataclass
class Side:
    """All instants of a run, and the size of its bodies [m]."""

    name: str
    frames: list
    size: float


# What is compared, in the order of the table: name, meaning.
COLUMNS = {
    "position": "largest distance of a body from its twin / body size",
    "position_rms": "the same, root of the mean square",
    "velocity": "largest difference of velocity / largest speed so far",
    "contacts": "contacts that carry a force in one run alone / in either",
    "gap": "largest difference of the gap of a contact that both have / body size",
    "force": "sum of the differences of contact forces / sum of the forces",
    "total_force": "difference of the sums of normal forces / sum",
}


@dataclass
class Comparison:
    """What `verify` found: rows, one a common instant, of `time` and COLUMNS; tolerances; which of them were passed."""

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
        names = list(COLUMNS)
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
    later instants [s]. size: of a body [m], the median radius of A when not given. Returns a Comparison.

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
    size = one.size if size is None else size
    if not size > 0:
        raise ValueError(f"{one.name} tells no radius of a body: give size [m]")
    rows, speed, lone = [], 0.0, 0
    for fa, fb in pairs:
        speed = max(speed, float(np.max(np.abs(fa.velocity[:, : fa.position.shape[1]]), initial=0.0)))
        row, missing = _compare(fa, fb, size, speed)
        rows.append(row)
        lone = max(lone, missing)
    result = Comparison(one.name, two.name, rows, tolerances, _alone(one, two, pairs, until), lone)
    for name, gate in tolerances.items():
        beyond = [r for r in rows if r[name] is not None and not r[name] <= gate]
        if beyond:
            result.failures.append(f"{name} is {beyond[0][name]:.3g} at t = {beyond[0]['time']:g} s, first beyond {gate:g}")
        elif all(r[name] is None for r in rows):
            result.failures.append(f"{name} is not known at any instant: the runs hold no common contacts")
    if lone:
        result.failures.append(f"{lone} bodies are in one of the runs only")
    return result


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
        raise ValueError(f"at t = {fa.time:g} s the runs have no body in common")
    if fa.position.shape[1] != fb.position.shape[1]:
        raise ValueError("one run is in 2D, the other in 3D")
    dim = fa.position.shape[1]
    apart = np.linalg.norm(fa.position[ia] - fb.position[ib], axis=1) / size
    faster = np.linalg.norm((fa.velocity[ia] - fb.velocity[ib])[:, :dim], axis=1)
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
    """Contacts of a pair of bodies that meet in several places are taken by rising gap."""
    a, b = _keyed(fa), _keyed(fb)
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
        "force": difference / total if total > 0 else 0.0,
        "total_force": abs(normal[0] - normal[1]) / max(*normal, 1e-300),
    }


def _keyed(f):
    order = np.lexsort((f.gap, f.pairs[:, 1], f.pairs[:, 0]))
    keys, last, count = {}, None, 0
    for i in order:
        pair = (int(f.pairs[i, 0]), int(f.pairs[i, 1]))
        count = count + 1 if pair == last else 0
        last = pair
        keys[(*pair, count)] = int(i)
    return keys


# ---------------------------------------------------------------------- sides


def side(path):
    """A run of either program as a Side. Raises FileError or ValueError for what is neither."""
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
        dt = float(run.scene["dt"])
        for step in run:
            c = step.contacts
            pairs = np.sort(np.column_stack([c["body_a"], c["body_b"]]), axis=1) if len(c) else np.zeros((0, 2), int)
            force = _split(c["normal"], c["impulse"]) / dt if len(c) else np.zeros((0, 2))
            gap = np.array(c["gap"]) if len(c) else np.zeros(0)
            b = step.bodies
            frames.append(Frame(float(step.time), np.array(b["id"]), b["position"], b["velocity"], pairs, gap, force))
        radius = np.array(run[0].bodies["radius"]) if len(run) else np.zeros(0)
    radius = radius[radius > 0]
    return Side(str(path), frames, float(np.median(radius)) if len(radius) else 0.0)


def _legacy_side(path):
    from ..legacy import datbox, read_results

    folder = path if path.is_dir() else path.parent
    found = next((f for f in (folder, folder / "DATBOX", folder.parent / "DATBOX") if (f / "BODIES.DAT").is_file()), None)
    if found is None:
        raise FileError(path, "there is no BODIES.DAT beside these results", "keep DATBOX and OUTBOX in one folder")
    box = datbox.parse(found)
    dim = box.dim
    start = np.array([b.position[:dim] for b in box.bodies])
    frames = []
    for i in read_results(path):
        if len(i.displacement) != len(start):
            raise FileError(path, f"holds {len(i.displacement)} rigid bodies, BODIES.DAT {len(start)}", "give one case")
        frame = Frame(i.time, np.arange(len(start)), start + i.displacement, i.velocity)
        if i.contacts is not None:
            frame.pairs = np.sort(i.contacts["bodies"], axis=1)
            frame.gap = i.contacts["gap"]
            f = i.contacts["force"]
            frame.force = np.column_stack([np.abs(f[:, 0]), np.linalg.norm(f[:, 1:], axis=1)])
        frames.append(frame)
    radius = np.array([b.radius for b in box.bodies if b.radius > 0])
    return Side(str(path), frames, float(np.median(radius)) if len(radius) else 0.0)
