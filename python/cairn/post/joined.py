"""Several files as one run: `cairn.load([a, b])`."""

import numpy as np

from ..base.errors import FileError
from .runs import Run


class JoinedRun(Run):
    """A run whose outputs stand in several files, one after the other. What a `Run` gives, this gives.

    Each file counts from its first output on, so that steps that were taken again after a restart count as they were taken last.
    The scene, provenance and cell are those of the first file; each output knows the file it is in as `output.run`.
    """

    def __init__(self, paths):
        if not len(paths):
            raise ValueError("path is an empty list: give the files of a run")
        self.runs = []
        try:
            for path in paths:
                self.runs.append(Run(path))
            self._order()
        except Exception:
            self.close()
            raise

    def _order(self):
        dims = [run.dim for run in self.runs]
        if len(set(dims)) > 1:
            other = next(run for run in self.runs if run.dim != dims[0])
            first = self.runs[0].path
            raise FileError(other.path, f"this run is in {other.dim}D, and {first} in {dims[0]}D", "give files of one run")
        self.dim, self.path = dims[0], ", ".join(run.path for run in self.runs)
        self._last = []  # the step from which on a later file counts, of each file
        end = np.iinfo(np.int64).max
        for run in reversed(self.runs):
            self._last.insert(0, end)
            if len(run):
                end = min(end, int(run._steps["step"][0]))
        self._places = [
            (run, k) for run, end in zip(self.runs, self._last) for k, step in enumerate(run._steps["step"]) if step < end
        ]

    def refresh(self):
        """Read the files anew."""
        for run in self.runs:
            run.refresh()
        self._order()
        return self

    def close(self):
        """Let go of the files."""
        for run in self.runs:
            run.close()

    def __len__(self):
        return len(self._places)

    def __getitem__(self, index):
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        n, wanted = len(self), int(index)
        if not -n <= wanted < n:
            raise IndexError(f"output {wanted} was asked for; {self.path} hold {n} (0 to {n - 1})")
        run, k = self._places[wanted]
        return run[k]

    @property
    def times(self):
        """Times of the outputs [s], shape (len(run),)."""
        return np.array([run._steps["time"][k] for run, k in self._places])

    @property
    def scene(self):
        """Description of the simulated scene: nested dict."""
        return self.runs[0].scene

    @property
    def provenance(self):
        """Version, compiler, flags, script, seed, date ... of the first file: nested dict."""
        return self.runs[0].provenance

    @property
    def periodic(self):
        """The periodic cell at the start: nested dict, or None."""
        return self.runs[0].periodic

    @property
    def history(self):
        """Numbers of every step taken: dict of arrays with one row per step; words as text. NaN, or "", where a file has none."""
        parts = []
        for run, end in zip(self.runs, self._last):
            rows = run.history
            if rows:
                # the first output of the file that follows is the state that this step led to
                parts.append({name: column[rows["step"] <= end] for name, column in rows.items()})
        names = dict.fromkeys(name for part in parts for name in part)
        columns = {}
        for name in names:
            kind = next(part[name].dtype for part in parts if name in part)
            missing = "" if kind.kind == "U" else np.nan
            filled = [part[name] if name in part else np.full(len(part["step"]), missing) for part in parts]
            columns[name] = np.concatenate(filled)
        return columns
