"""Driven dofs of LMGC90's files, and their functions of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base import time_functions
from .text import REAL, LegacyError, fortran


@dataclass
class Drive:
    """A driven dof: kind vlocy or force, component from 1; numbers CT AMP OMEGA PHI RAMPI RAMP, or a table; line of the file."""

    kind: str
    component: int
    line: int = 0
    numbers: tuple = ()
    file: str = ""
    table: np.ndarray | None = None


def read_drive(box, reader, line):
    """Drive of a driven dof, from its line."""
    drive = Drive(line[1:6].strip(), reader.whole(line, 7, 13), reader.number_of_line)
    if line[14:23] == "evolution":
        drive.file = line[24:64].strip()
        if not (box.folder / drive.file).is_file():
            reader.fail(f"the evolution {drive.file!r} is no file of {box.folder}")
        drive.table = read_evolution(box.folder / drive.file, box.notes)
    else:
        drive.numbers = tuple(reader.number(line, c, c + 13) for c in (15, 30, 45, 60, 75, 90))
    return drive


def read_evolution(path, notes=None):
    """Rising times and values (n, 2) of a file in free format: the first two numbers of each line, after blanks or commas.

    If the last row goes back in time, LMGC90 extrapolates beyond the previous row on the line through both. That row is therefore
    mirrored to the other side of the previous row, and a text is appended to notes, a list.
    """
    rows, last, back = [], -np.inf, 0
    for number, text in enumerate(path.read_text(encoding="latin-1").split("\n"), 1):
        words = text.replace(",", " ").split()
        if not words:
            continue
        found = [REAL.fullmatch(w) for w in words[:2]]
        if len(words) < 2 or None in found:
            raise LegacyError(f"{path}, line {number}: {text.strip()!r} is no pair of numbers; time and value were expected")
        row = [fortran(m) for m in found]
        if not np.all(np.isfinite(row)) or row[0] == last or back:
            told = back or number
            raise LegacyError(f"{path}, line {told}: time {row[0]:g} does not come after {last:g}; give rising times")
        back = number if row[0] < last else 0
        rows.append(row)
        last = row[0] if not back else last
    if back and len(rows) > 2:
        (t, v), (early, other) = rows[-2:]
        rows[-1] = [2 * t - early, 2 * v - other]
        if notes is not None:
            told = f"time {early:g} goes back, beyond {t:g} values lie on the line through both, as there"
            notes.append(f"{path.name}, line {back}: {told}")
    elif back:
        raise LegacyError(f"{path}, line {back}: time {rows[-1][0]:g} does not come after {last:g}; give rising times")
    if len(rows) < 2:
        raise LegacyError(f"{path}: holds {len(rows)} instants; give two or more lines of time and value")
    return np.array(rows)


def function_of(d):
    """Value or function of time of a Drive."""
    if d.table is not None:
        return time_functions.Table(*_going_on(d.table).T)
    constant, amplitude, omega, phase, begin, slope = d.numbers
    value = constant
    if amplitude != 0:
        value = time_functions.Harmonic(amplitude, omega / (2 * np.pi), constant, phase)
    if slope != 0:
        return time_functions.Ramp(value, begin, slope)
    share = float(np.clip(begin, -1, 1))
    return value if share == 1 else time_functions.Ramp(value, begin, 0.0) if callable(value) else share * value


def _going_on(table):
    """Table (n, 2) with its first and last pieces extended if they are not level, since LMGC90 extrapolates along them: back to
    t = 0, and forward by a thousand times the last interval."""
    t, v = table.T
    rows = list(table)
    if t[0] > 0 and v[1] != v[0]:
        rows.insert(0, (0.0, v[0] - t[0] * (v[1] - v[0]) / (t[1] - t[0])))
    if v[-1] != v[-2]:
        rows.append((t[-1] + 1000 * (t[-1] - t[-2]), v[-1] + 1000 * (v[-1] - v[-2])))
    return np.array(rows)
