"""Loads of masonry: supports that settle, spread or tilt, earthquakes, point and distributed loads.

Motions are cairn.Table functions of time, made to be the `drive` of a set of held bodies; loads are resultants (dofs,) about
the centre of a body, made to be its `force`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base import checks
from ..base.errors import as_file_error
from ..base.time_functions import Table

STANDARD_GRAVITY = 9.80665  # [m/s2], the unit of PEER's records
LENGTHS = {"M": 1.0, "CM": 0.01, "MM": 0.001}  # [m]


def displaced(displacement, duration, start=0.0, ramp=0.25) -> Table:
    """Velocity of a support that moves by `displacement` (components,) [m or rad] in `duration` [s] from `start` on.

    The speed rises and falls linearly during the given share `ramp` (at most a half) of the duration at each end, so that
    nothing is hit; its integral is the displacement. For settlement (0, -s), spreading (s, 0), turning about the centre.
    """
    total = np.atleast_1d(checks.real_array("displacement", np.atleast_1d(np.asarray(displacement, float)), (None,)))
    duration, start = checks.positive("duration", duration), checks.number("start", start)
    ramp = checks.positive("ramp", ramp)
    if ramp > 0.5:
        raise ValueError(f"ramp is {ramp}: give a share of the duration of at most 0.5")
    peak = total / (duration * (1 - ramp))
    times = [start, start + ramp * duration, start + (1 - ramp) * duration, start + duration]
    values = np.array([0 * peak, peak, peak, 0 * peak])
    if times[1] >= times[2]:
        times, values = [times[0], times[1], times[3]], values[[0, 1, 3]]
    return Table(np.array(times), values)


def tilted(center, pivot, angle, duration, axis=None, start=0.0, samples=200) -> Table:
    """Velocity (3,) or (6,) of a support with its centre at `center` that turns by `angle` [rad] about a line through `pivot`.

    axis: direction of the line in 3D. The table holds `samples` instants; between them it is linear.
    """
    center = checks.real_array("center", center, (None,))
    dim = checks.dimension(len(center))
    pivot = checks.real_array("pivot", pivot, (dim,))
    turn = displaced([checks.number("angle", angle)], duration, start)
    times = np.unique(np.concatenate([turn.times, start + duration * np.arange(samples + 1) / samples]))
    rate = np.interp(times, turn.times, turn.values[:, 0])
    done = np.concatenate([[0.0], np.cumsum(np.diff(times) * (rate[1:] + rate[:-1]) / 2)])
    arm = center - pivot
    if dim == 2:
        x, y = arm
        moved = np.column_stack((np.cos(done) * x - np.sin(done) * y, np.sin(done) * x + np.cos(done) * y))
        values = np.column_stack((-rate * moved[:, 1], rate * moved[:, 0], rate))
        return Table(times, values)
    if axis is None:
        raise ValueError("axis is missing: give the direction (3,) of the line about which the support turns")
    axis = checks.real_array("axis", axis, (3,))
    if not np.any(axis):
        raise ValueError(f"axis is {axis}: give a vector of non-zero length")
    axis = axis / np.linalg.norm(axis)
    along, across = axis * (axis @ arm), np.cross(axis, arm)
    moved = along + np.cos(done)[:, None] * (arm - along) + np.sin(done)[:, None] * across  # Rodrigues 1840
    return Table(times, np.concatenate([rate[:, None] * np.cross(axis, moved), rate[:, None] * axis], axis=1))


@dataclass(frozen=True, eq=False)
class Accelerogram:
    """A record of the ground's acceleration. times (n,) [s], evenly spaced or not; acceleration (n,) [m/s2]; name."""

    times: np.ndarray
    acceleration: np.ndarray
    name: str = ""

    def __post_init__(self):
        Table(self.times, self.acceleration)  # refuses times and values that make no function of time

    def __repr__(self):
        step = np.diff(self.times)
        even = len(step) and np.ptp(step) <= 1e-6 * step.mean()
        told = f", {step.mean():.4g} s apart" if even else ""
        return (f"<accelerogram {self.name!r}: {len(self.times):,} samples from {self.times[0]:g} to {self.times[-1]:g} s{told}, "
                f"peak {self.peak:.4g} m/s2>")  # fmt: skip

    @property
    def peak(self):
        """Largest acceleration [m/s2]."""
        return float(np.max(np.abs(self.acceleration)))

    def scaled(self, factor=None, peak=None):
        """The record times a factor, or with another peak acceleration [m/s2]."""
        factor = checks.positive("peak", peak) / self.peak if factor is None else checks.number("factor", factor)
        return Accelerogram(self.times, self.acceleration * factor, self.name)

    def velocity(self, corrected=True):
        """Velocity (n,) [m/s] of the ground, the exact integral of the acceleration linear between samples.

        corrected: less the straight line that leaves the ground at rest at the end (baseline correction).
        """
        steps = np.diff(self.times)
        v = np.concatenate([[0.0], np.cumsum(steps * (self.acceleration[1:] + self.acceleration[:-1]) / 2)])
        if corrected:
            v = v - v[-1] * (self.times - self.times[0]) / (self.times[-1] - self.times[0])
        return v

    def drive(self, direction, corrected=True) -> Table:
        """Velocity of the base as a Table (n, dim), along a direction (dim,) whose length multiplies the record."""
        direction = checks.real_array("direction", direction, (None,))
        checks.dimension(len(direction))
        if not np.any(direction):
            raise ValueError(f"direction is {direction}: give one of non-zero length, by which the record is multiplied")
        rotations = 1 if len(direction) == 2 else 3
        row = np.concatenate([direction, np.zeros(rotations)])
        return Table(self.times, self.velocity(corrected)[:, None] * row)


def read_accelerogram(path, unit=None, step=None) -> Accelerogram:
    """A record from a file: PEER's .AT2 (accelerations in g), or CSV.

    CSV: columns time [s] and acceleration, or acceleration alone with `step` [s] between samples; separated by comma,
    semicolon, tab or blanks (with semicolons a comma may be the decimal point); lines that begin with no number are titles.
    unit: of the acceleration [m/s2]; unless given that of the file: of .AT2 what its title says, of CSV 9.80665 where a title has
    (g) or [g], else 1. Raises ValueError naming the file and line that make no sense.
    """
    path = Path(path)
    try:
        lines = path.read_text(errors="replace").splitlines()
    except OSError as error:
        raise as_file_error(path, error) from error
    times, values, unit = at2(path, lines, unit) if path.suffix.lower() == ".at2" else columns(path, lines, step, unit)
    try:
        return Accelerogram(times, values * unit, path.stem)
    except ValueError as error:
        raise ValueError(f"{path.name}: {error}") from None


def number(word):
    """A number as Fortran or anyone writes it."""
    return float(word.upper().replace("D", "E"))


def at2(path, lines, unit):
    """Times, values and unit of PEER's format: three lines of title, one with NPTS and DT, then the samples."""
    patterns = r"NPTS\s*=\s*(\d+).*DT\s*=\s*([-+.0-9EeDd]+)", r"^\s*(\d+)\s+([-+.0-9EeDd]+)\s+NPTS,\s*DT"
    titles = [(k, re.search(p, line)) for k, line in enumerate(lines[:10]) for p in patterns]
    titles = [(k, match) for k, match in titles if match]
    if not titles:
        raise ValueError(f"{path.name} has no line 'NPTS= ..., DT= ...' among its first ten: it is no PEER record")
    k, title = titles[0]
    try:
        wanted, step = int(title.group(1)), checks.positive("DT", number(title.group(2)))
    except ValueError:
        raise ValueError(f"{path.name}, line {k + 1}: {lines[k].strip()!r} gives no step of time") from None
    values = []
    for at, line in enumerate(lines[k + 1 :], k + 2):
        try:
            values += [number(word) for word in line.split()]
        except ValueError:
            raise ValueError(f"{path.name}, line {at}: {line.strip()!r} is not a row of numbers") from None
    if len(values) != wanted:
        raise ValueError(f"{path.name} says NPTS = {wanted} and holds {len(values)} samples: it is cut or damaged")
    return np.arange(wanted) * step, np.array(values), at2_unit(path, " ".join(lines[:k]).upper(), unit)


def at2_unit(path, title, given):
    """Unit of acceleration of the file [m/s2], as given or from its title."""
    for other in ("VELOCITY", "DISPLACEMENT"):
        if f"{other} TIME" in title:
            raise ValueError(f"{path.name} holds a {other.lower()}, not an acceleration: take the .AT2 file of the record")
    if given is not None:
        return checks.positive("unit", given)
    unit = re.search(r"UNITS? (?:OF|IN|ARE|:)\s*([A-Z/*0-9^]+)", title)
    if unit is None or unit.group(1) == "G":
        return STANDARD_GRAVITY
    known = {"GAL": 0.01} | {f"{length}/{time}2": size for length, size in LENGTHS.items() for time in ("S", "SEC")}
    name = re.sub(r"/(S|SEC)/\1$", r"/\g<1>2", re.sub(r"[*^]+2$", "2", unit.group(1)))
    if name not in known:
        raise ValueError(f"{path.name} is in units of {unit.group(1)}, which are unknown here: give unit= [m/s2]")
    return known[name]


def columns(path, lines, step, given):
    """Times, values and unit of a CSV file."""
    rows, unit = [], (1.0 if given is None else checks.positive("unit", given))
    for at, line in enumerate(lines, 1):
        text = line.replace(",", ".") if ";" in line else line
        words = [w for w in re.split(r"[,;\s]+", text.strip()) if w]
        try:
            if words and not line.lstrip().startswith("#"):
                rows.append([number(w) for w in words])
                continue
        except ValueError:
            if rows:
                raise ValueError(f"{path.name}, line {at}: {line.strip()!r} is not a row of numbers") from None
        unit = STANDARD_GRAVITY if given is None and re.search(r"[(\[]\s*g\s*[)\]]", line, re.IGNORECASE) else unit
    widths = {len(r) for r in rows}
    wanted = 2 if step is None else 1
    if widths != {wanted}:
        found = f"rows of {' and '.join(map(str, sorted(widths)))} numbers" if rows else "no row of numbers"
        raise ValueError(
            f"{path.name} has {found}: give rows of time and acceleration, or of acceleration alone and step= [s]"
        )
    table = np.array(rows)
    if step is None:
        return table[:, 0], table[:, 1], unit
    return np.arange(len(table)) * checks.positive("step", step), table[:, 0], unit


def point_load(force, point, center) -> np.ndarray:
    """The resultant (3,) or (6,) about a body's centre of a force (dim,) [N] at a point (dim,) [m]."""
    center = checks.real_array("center", center, (None,))
    dim = checks.dimension(len(center))
    force = checks.real_array("force", force, (dim,))
    arm = checks.real_array("point", point, (dim,)) - center
    turn = np.cross(arm, force) if dim == 3 else [arm[0] * force[1] - arm[1] * force[0]]
    return np.concatenate([force, turn])


def distributed_load(blocks, traction, facing, depth=1.0) -> np.ndarray:
    """Resultants (n, 3 | 6) about the blocks' centres of a traction (dim,) [Pa] on their faces that look along `facing`.

    A face is loaded if its normal is within 1e-6 of that direction (or blocks.flush, if larger) and no other block lies on it.
    Joints are thus unloaded, and the top of a wall, or its outer side, is loaded. depth [m] in 2D. Raises ValueError where no
    face looks that way.
    """
    from .blocks import face_table

    dim = blocks.dim
    traction = checks.real_array("traction", traction, (dim,))
    facing = checks.real_array("facing", facing, (dim,))
    if not np.any(facing):
        raise ValueError(f"facing is {facing}: give a vector of non-zero length, (0, 0, 1) for what looks up")
    facing = facing / np.linalg.norm(facing)
    along = 1 - max(1e-12, 8 * blocks.flush**2)
    center = blocks.properties().center
    result = np.zeros((len(blocks), dim + (1 if dim == 2 else 3)))
    _, owner, normal, loops = face_table(blocks)
    if not np.any(normal @ facing > along):
        raise ValueError(f"no face looks along facing = {facing}: the nearest is at {np.arccos(np.max(normal @ facing)):.3g} rad")
    for body, n, loop in zip(owner, normal, loops):
        if n @ facing > along:
            area, middle = face_area(loop, n)
            result[body] += point_load(traction * area * (depth if dim == 2 else 1.0), middle, center[body])
    found = blocks.joints()
    for (a, b), n, polygon in zip(found.blocks, found.normal, found.polygon):
        for body, outward in ((a, -n), (b, n)):
            if outward @ facing > along:
                area, middle = face_area(polygon, outward)
                result[body] -= point_load(traction * area * (depth if dim == 2 else 1.0), middle, center[body])
    return result


def face_area(loop, normal):
    """Area and centroid of a plane polygon in space, or length and middle of an edge."""
    if len(normal) == 2:
        return float(np.linalg.norm(loop[1] - loop[0])), loop.mean(axis=0)
    a, b, c = loop[0], loop[1:-1], loop[2:]
    areas = np.abs(np.cross(b - a, c - a) @ normal) / 2
    return float(areas.sum()), (areas @ (a + b + c) / 3) / areas.sum()
