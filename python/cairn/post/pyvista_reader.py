"""Reader of VTKHDF files for PyVista that steps through their times, which PyVista's own does not.

An installed Cairn gives it to PyVista (0.49 and later) by the entry point `pyvista.readers.override`; `register()` does the
same for a program.
"""

import warnings

from pyvista.core.utilities.reader import HDFReader, TimeReader


class TimedHDFReader(HDFReader, TimeReader):
    """PyVista's HDFReader with the times of the file."""

    _chosen = False

    @property
    def time_values(self):
        """Times of the file [s]."""
        from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

        self.reader.UpdateInformation()
        return [float(t) for t in self.reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS()) or ()]

    @property
    def number_time_points(self):
        """Number of times."""
        return len(self.time_values)

    def time_point_value(self, time_point):
        """Time of an output [s]."""
        return self.time_values[time_point]

    @property
    def active_time_value(self):
        """Time of the output that `read` gives [s]."""
        return self.time_values[self.reader.GetStep()]

    def set_active_time_point(self, time_point):
        """Chooses an output by its number."""
        n = self.number_time_points
        if not -n <= time_point < n:
            raise ValueError(f"time_point is {time_point}: the file has {n} times, 0 to {n - 1}")
        self._chosen = True
        self.reader.SetStep(int(time_point) % n)
        self.reader.Modified()

    def set_active_time_value(self, time_value):
        """Chooses an output by its time."""
        times = self.time_values
        k = min(range(len(times)), key=lambda i: abs(times[i] - time_value), default=0)
        if not times or abs(times[k] - time_value) > 1e-6 * max(times[-1] - times[0], abs(times[k])):
            near = f", the nearest is {times[k]}" if times else ""
            raise ValueError(f"time_value is {time_value}: the file has no such time{near}")
        self.set_active_time_point(k)

    def read(self):
        """The dataset of the chosen time; of the first, with a warning, if none was chosen of several."""
        if not self._chosen and self.number_time_points > 1:
            told = f"{self.path} holds {self.number_time_points} outputs, and this is the first"
            warnings.warn(f"{told}: reader.set_active_time_point(k) chooses another, cairn.open_series(path) gives all",
                          UserWarning, stacklevel=2)  # fmt: skip
        return super().read()


def register():
    """Gives this reader to PyVista for files .vtkhdf; raises ImportError with a PyVista before 0.49."""
    import pyvista

    if not hasattr(pyvista, "register_reader"):
        raise ImportError(f"PyVista {pyvista.__version__} takes no readers of others: pip install 'pyvista>=0.49'")
    pyvista.register_reader(".vtkhdf", TimedHDFReader, override=True)
