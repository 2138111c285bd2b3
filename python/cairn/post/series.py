"""Runs as PyVista datasets at all times, `cairn.open_series`: surfaces of bodies, clumps as their spheres, points, contacts."""

from __future__ import annotations

import numpy as np

from ..base import checks
from ..base.errors import FileError
from ..names import teach
from .load import load
from .runs import Run
from .shape_meshes import surfaces_of

BLOCKS = ("surfaces", "bodies", "contacts", "nodes", "fluid")


class Series:
    """A run as PyVista datasets over time, with the methods of PyVista's readers of series.

    `series[k]` is output k: a pyvista.MultiBlock of "surfaces" (all bodies as they are drawn, each part of a clump a sphere),
    "bodies", "contacts", with meshes "nodes" and with a liquid "fluid" (a point each), all with the fields of the run.

    Parameters
    ----------
    path : path-like, list or Run
        Name of a .vtkhdf file, a list of such, or an open run.
    around : int, default 24
        Faces round a sphere or a disk.

    Raises
    ------
    ImportError
        If PyVista is not installed.
    FileError
        If there is no such file, or it is no run.
    """

    def __init__(self, path, around=24):
        try:
            import pyvista  # noqa: F401
        except ImportError as error:
            raise ImportError("a series needs PyVista: pip install 'cairn[view]'") from error
        self.around = checks.count("around", around, 4)
        self.run = path if isinstance(path, Run) else load(path)
        if not len(self.run):
            raise FileError(self.run.path, "the run holds no output", "make more steps than `every`, or a smaller `every`")
        self._active = 0

    def __len__(self):
        return len(self.run)

    def __repr__(self):
        t = self.time_values
        return f"<series of {len(self)} outputs from {t[0]:g} to {t[-1]:g} s: {self.run.path}>"

    @property
    def number_time_points(self):
        """Number of outputs."""
        return len(self.run)

    @property
    def time_values(self):
        """Times of the outputs [s]."""
        return [float(t) for t in self.run.times]

    @property
    def active_time_value(self):
        """Time of the output that `read` gives [s]."""
        return self.time_values[self._active]

    def time_point_value(self, time_point):
        """Gives the time of an output.

        Parameters
        ----------
        time_point : int
            Number of the output.

        Returns
        -------
        float
            Its time [s].
        """
        return self.time_values[time_point]

    def set_active_time_point(self, time_point):
        """Chooses the output that `read` gives.

        Parameters
        ----------
        time_point : int
            Number of the output.

        Raises
        ------
        ValueError
            If there is no such output.
        """
        n = len(self)
        if not isinstance(time_point, (int, np.integer)) or not -n <= time_point < n:
            raise ValueError(f"time_point is {time_point!r}: the run has outputs 0 to {n - 1}")
        self._active = int(time_point) % n

    def set_active_time_value(self, time_value):
        """Chooses the output that `read` gives, by its time.

        Parameters
        ----------
        time_value : float
            Time [s].

        Raises
        ------
        ValueError
            If no output has that time.
        """
        times, value = np.array(self.time_values), checks.number("time_value", time_value)
        k = int(np.argmin(np.abs(times - value)))
        if abs(times[k] - value) > 1e-6 * max(np.ptp(times), abs(times[k])):
            raise ValueError(f"time_value is {value}: no output has it, the nearest is at {times[k]} s (time_values has all)")
        self._active = k

    def read(self):
        """Gives the active output, the first unless one was chosen.

        Returns
        -------
        pyvista.MultiBlock
            The output.
        """
        return self[self._active]

    def __getitem__(self, k):
        if isinstance(k, slice):
            return [self[i] for i in range(*k.indices(len(self)))]
        import pyvista

        step = self.run[k]
        out = pyvista.MultiBlock()
        found = surfaces_of(step, self.around)
        if found is not None:
            points, triangles, rows = found
            surface = pyvista.PolyData.from_regular_faces(points, triangles)
            for name in _shown(step.drawn):
                surface.cell_data[name] = np.asarray(step.drawn[name])[rows]
            out["surfaces"] = surface
        for name in BLOCKS[1:]:
            fields = getattr(step, name)
            place = "point" if name == "contacts" else "position"
            if name != "bodies" and not len(fields):
                continue
            cloud = pyvista.PolyData(_three(np.asarray(fields[place])))
            for field in _shown(fields, place):
                value = np.asarray(fields[field])
                vector = value.ndim == 2 and value.shape[1] == step.dim
                cloud.point_data[field] = _three(value) if vector else value
            out[name] = cloud
        return out

    def __iter__(self):
        return (self[k] for k in range(len(self)))


def _shown(fields, place="position"):
    """Names of the fields that are numbers."""
    return [n for n in fields.names if n not in (place, "rotation") and np.asarray(fields[n]).dtype.kind in "fiu"]


def _three(vectors):
    result = np.zeros((len(vectors), 3))
    result[:, : vectors.shape[1]] = vectors
    return result


def open_series(path, around=24) -> Series:
    """Opens a run as PyVista datasets at all times.

    Parameters
    ----------
    path : path-like, list or Run
        Name of a .vtkhdf file, a list of such, or an open run.
    around : int, default 24
        Faces round a sphere or a disk.

    Returns
    -------
    Series
        `series[k]` is output k, `for blocks in series` goes through all; also a reader with `time_values`,
        `set_active_time_value` and `read`, as pyvista.get_reader gives one.

    Raises
    ------
    ImportError
        If PyVista is not installed.
    FileError
        If there is no such file, or it is no run.
    """
    return Series(path, around)


teach(globals())
