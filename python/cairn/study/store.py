"""Rows of a study on the disk: a CSV that only grows, so that a study goes on where it was stopped; and tables in HDF5."""

from __future__ import annotations

import contextlib
import csv
import io
import os
from pathlib import Path

from .. import _core
from ..base.errors import FileError

COLUMNS = (
    "key", "target", "fingerprint", "protocol", "kind", "role", "state", "seed", "setting", "solver", "tol", "dt", "dt_factor",
    "warm_start", "min_iter", "max_iter", "cpu_seconds", "steps", "contacts", "iterations", "not_converged", "stopped", "error",
    "version",
)
TEXTS = {
    "key", "target", "fingerprint", "protocol", "kind", "role", "setting", "solver", "integrator", "coupling", "version",
    "acceleration", "figure", "unit", "note",
}  # fmt: skip
NAME = "rows.csv"


class Store:
    """The rows of one folder. rows: {key: row} of all that was done, also in earlier runs."""

    def __init__(self, folder):
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.path = self.folder / NAME
        self._file = open(self.path, "a+b", buffering=0)
        self._lock()
        self.columns, self.rows = list(COLUMNS), {}
        self._read()

    def __enter__(self):
        return self

    def __exit__(self, *exc):
        self._file.close()

    def _lock(self):
        try:
            import fcntl
        except ImportError:  # no such locks there
            return
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._file.close()
            raise FileError(self.path, "another study is writing there", "wait for it, or choose another folder") from None

    def _read(self):
        self._file.seek(0)
        data = self._file.read()
        whole = data[: data.rfind(b"\n") + 1]
        if len(whole) < len(data):  # a row that was cut as it was written
            self._file.truncate(len(whole))
        lines = csv.reader(io.StringIO(whole.decode()))
        self.columns = next(lines, [])
        if not self.columns:
            self.columns = list(COLUMNS)
            self._append(self.columns)
            return
        if not set(COLUMNS) <= set(self.columns):
            missing = ", ".join(sorted(set(COLUMNS) - set(self.columns)))
            raise FileError(self.path, f"is no table of a study: it lacks {missing}", "choose another folder")
        for words in lines:
            if len(words) == len(self.columns):
                row = {name: parse(name, word) for name, word in zip(self.columns, words) if word != ""}
                self.rows[row["key"]] = row

    def _append(self, words):
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerow(words)
        os.write(self._file.fileno(), text.getvalue().encode())

    def add(self, row):
        """One more row, on the disk when this returns."""
        self.declare(row)
        self.rows[row["key"]] = {name: value for name, value in row.items() if value is not None}
        self._append([show(row.get(name)) for name in self.columns])
        os.fsync(self._file.fileno())

    def declare(self, names):
        """Makes room for columns: where earlier runs did not ask for these figures, the file is written anew with them."""
        new = [name for name in names if name not in self.columns]
        if not new:
            return
        self.columns += new
        text = io.StringIO(newline="")
        write_csv(text, self.rows.values(), self.columns)
        _core.write_whole(self.path, text.getvalue().encode(), beside=True)
        self._file.close()
        self._file = open(self.path, "a+b", buffering=0)
        self._lock()


def read_rows(folder):
    """The rows of a folder, {key: row}; none where no study was."""
    if not (Path(folder) / NAME).exists():
        return {}
    with Store(folder) as kept:
        return kept.rows


def parse(name, word):
    """A word of the file converted to text, float or integer."""
    if name in TEXTS:
        return word
    return float(word) if any(c in word for c in ".enai") else int(word)


def show(value):
    """A value as a word of the file, each digit kept."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    return repr(float(value)) if isinstance(value, float) else str(value)


def write_csv(path, rows, columns=None):
    """Rows (dicts) as a CSV. path: of a file, or a text that is open for writing."""
    rows = list(rows)
    columns = list(columns or dict.fromkeys(name for row in rows for name in row))
    with contextlib.nullcontext(path) if hasattr(path, "write") else open(path, "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([show(row.get(name)) for name in columns] for row in rows)


def write_hdf5(path, tables):
    """Tables {name: rows} as groups of columns; replaced as a whole."""
    import h5py
    import numpy as np

    with h5py.File("tables", "w", driver="core", backing_store=False) as file:
        for table, rows in tables.items():
            group, rows = file.create_group(table), list(rows)
            for name in dict.fromkeys(name for row in rows for name in row):
                values = [row.get(name) for row in rows]
                if any(isinstance(value, str) for value in values):
                    group.create_dataset(name, data=["" if v is None else str(v) for v in values], dtype=h5py.string_dtype())
                else:
                    group[name] = np.array([np.nan if v is None else v for v in values], float)
        file.flush()
        _core.write_whole(path, file.id.get_file_image(), beside=True)
