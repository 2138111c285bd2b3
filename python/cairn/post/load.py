"""Reads a run: `cairn.load(path)` gives its steps as numpy arrays."""

import io
import json
import os

import h5py
import numpy as np

from ..names import listed, teach
from .errors import FileError, as_file_error
from .writer import FORMAT_NAME, FORMAT_VERSION

_VECTORS = ("position", "point", "normal", "impulse")  # stored with z = 0 in 2D, given back with two components


def load(path):
    """Open a run that a simulation wrote, also while it is being written. Returns a `Run`.

    path : of a .vtkhdf file, or a list of such: one run that went on in several files, in their order; from the first output of a
        file on, this file counts and not those before it.

    Raises FileError if there is no such file, it is truncated, not a run of Cairn or of a later format.
    """
    if isinstance(path, (list, tuple)):
        from .joined import JoinedRun

        return JoinedRun(path)
    return Run(path)


class _Stream(io.FileIO):
    """A file that is closed when HDF5 lets go of it."""

    def __del__(self):
        self.close()


def open_run(path):
    """The h5py file of a run, checked to be one."""
    path = os.fspath(path)
    try:
        with open(path, "rb") as file:
            start = file.read(8)
            size = file.seek(0, os.SEEK_END)
    except OSError as error:
        raise as_file_error(path, error) from error
    if start != b"\x89HDF\r\n\x1a\n":
        what = "the file is empty" if size == 0 else "this is not an HDF5 file"
        raise FileError(path, what, "give a .vtkhdf file that a Cairn simulation wrote")
    # By its path HDF5 would hand out what is open already, as it stood when it was opened: too few outputs of a run
    # that goes on.
    try:
        file = h5py.File(_Stream(path), "r")
    except OSError as error:
        what = "the file is truncated" if "truncated" in str(error) else f"HDF5 cannot open the file ({error})"
        raise FileError(path, what, "copy it again from where it was made, or try 'cairn info --repair'") from error
    try:
        check_format(path, file, "cairn", FORMAT_NAME, FORMAT_VERSION)
    except FileError:
        file.close()
        raise
    return file


def check_format(path, file, group, name, version):
    """Raise FileError unless `group` of an HDF5 file bears the format `name`, in a version this program can read."""
    attrs = file[group].attrs if group in file else {}
    found = attrs.get("format", b"")
    if (found.decode() if isinstance(found, bytes) else found) != name:
        raise FileError(path, f"this HDF5 file is not a {name} file", "give a file that Cairn wrote for this purpose")
    theirs = tuple(int(n) for n in attrs["version"])
    if theirs[0] > version[0]:
        raise FileError(
            path, f"the file has format version {theirs[0]}.{theirs[1]}, this Cairn reads up to {version[0]}", "use a newer Cairn"
        )


def read_tree(group):
    """A group as a nested dict: what `writer.write_tree` stored."""
    return {name: read_tree(member) if isinstance(member, h5py.Group) else _value(member) for name, member in group.items()}


def _value(dataset):
    value = dataset[()]
    if dataset.dtype.kind == "S":
        value = np.char.decode(value, "utf-8")
        value = value.item() if value.ndim == 0 else value
    elif value.ndim == 0:
        value = value.item()
    return json.loads(value) if "encoding" in dataset.attrs else value


class Fields:
    """Arrays over the bodies or the contacts of one step, read when asked for: `fields.gap` or `fields["gap"]`."""

    def __init__(self, block, points_name, step, first, count, dim):
        self._block, self._points_name, self._step, self._dim = block, points_name, step, dim
        self._first, self._count, self._cache = first, count, {}

    def __len__(self):
        return self._count

    @property
    def names(self):
        """Names of the fields there are."""
        stored = [name for name in (self._block["PointData"] if self._block is not None else ()) if name != "spin"]
        return [self._points_name, *stored]

    def __contains__(self, name):
        return name in self.names

    def __iter__(self):
        return iter(self.names)

    def __getitem__(self, name):
        if name not in self._cache:
            if name not in self.names and name != "spin":
                raise KeyError(f"there is no field '{name}'; there are {listed(self.names, name)}")
            self._cache[name] = self._read(name)
        return self._cache[name]

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self[name]
        except KeyError as error:
            raise AttributeError(error.args[0]) from None

    def __repr__(self):
        return f"<{self._count} x {', '.join(self.names)}>"

    def _read(self, name):
        if name == self._points_name:
            return self._block["Points"][self._first : self._first + self._count, : self._dim]
        first = int(self._block["Steps/PointDataOffsets"][name][self._step])
        value = self._block["PointData"][name][first : first + self._count]
        if name in _VECTORS:
            return value[:, : self._dim]
        if name == "velocity":
            spin = self["spin"]
            return np.concatenate([value[:, : self._dim], spin[:, None] if spin.ndim == 1 else spin], axis=1)
        return value


class Step:
    """One output: `time`, `time_detection` [s], `step` (number of the time step), `bodies` and `contacts`.

    Bodies belong to `time`, contacts to `time_detection`. Units as in the simulation; `bodies.velocity` is (n, 3) or
    (n, 6), `contacts.impulse` (m, dim) [N s] on A in the axes of space.
    """

    def __init__(self, run, index):
        steps = {name: run._steps[name][index] for name in run._steps}
        self.dim, self.index, self.run = run.dim, index, run
        self.time, self.time_detection, self.step = steps["time"], steps["time_detection"], int(steps["step"])
        self.bodies = Fields(
            run._file["cairn/bodies"], "position", index, int(steps["first_body"]), int(steps["bodies"]), run.dim
        )
        self.contacts = Fields(
            run._file["cairn/contacts"], "point", index, int(steps["first_contact"]), int(steps["contacts"]), run.dim
        )

    def rows_of(self, ids):
        """Rows of the bodies with these ids in the arrays of this step."""
        if "id" not in self.bodies:
            return np.asarray(ids, dtype=np.int64)
        own = self.bodies["id"]
        order = np.argsort(own, kind="stable")
        return order[np.searchsorted(own, ids, sorter=order)]

    def __repr__(self):
        return f"<step {self.step}, t = {self.time:g} s, {len(self.bodies)} bodies, {len(self.contacts)} contacts>"


class Run:
    """A run on disk: `len(run)` outputs, `run[i]`, `run.at(time)`, `run.times`, `run.history`, pictures.

    Arrays are read when they are asked for. `run.refresh()` shows what a simulation still running has added.
    """

    def __init__(self, path):
        self.path, self._file = os.fspath(path), None
        self.refresh()

    def refresh(self):
        """Read the file anew."""
        self.close()
        self._file = open_run(self.path)
        own = self._file["cairn"]
        self.dim = int(own.attrs["dim"])
        self._steps = {name: data[()] for name, data in own["steps"].items()}
        self._scene = self._provenance = None
        return self

    def close(self):
        """Let go of the file."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def __enter__(self):
        return self

    def __exit__(self, *exc):
        self.close()

    def __len__(self):
        return len(self._steps["time"])

    def __getitem__(self, index):
        if isinstance(index, slice):
            return [Step(self, i) for i in range(*index.indices(len(self)))]
        n, wanted = len(self), int(index)
        if not -n <= wanted < n:
            raise IndexError(f"output {wanted} was asked for; {self.path} holds {n} (0 to {n - 1})")
        return Step(self, wanted % n)

    def __iter__(self):
        return (self[i] for i in range(len(self)))

    def at(self, time):
        """The output nearest to `time` [s]."""
        if len(self) == 0:
            raise IndexError(f"{self.path} holds no output yet")
        return self[int(np.argmin(np.abs(self.times - time)))]

    @property
    def times(self):
        """Times of the outputs [s], shape (len(run),)."""
        return self._steps["time"]

    @property
    def scene(self):
        """What was simulated: nested dict."""
        if self._scene is None:
            self._scene = read_tree(self._file["cairn/scene"])
        return self._scene

    @property
    def provenance(self):
        """Version, compiler, flags, script, seed, date ...: nested dict."""
        if self._provenance is None:
            self._provenance = read_tree(self._file["cairn/provenance"])
        return self._provenance

    @property
    def periodic(self):
        """The periodic cell: nested dict, or None."""
        return read_tree(self._file["cairn/periodic"]) if "cairn/periodic" in self._file else None

    @property
    def history(self):
        """Numbers of every step taken: dict of arrays with one row per step; words as text."""
        group = self._file["cairn/history"]
        result = {name: data[()] for name, data in group.items()}
        for name in result:
            if f"{name}_words" in group.attrs:
                words = group.attrs[f"{name}_words"]
                table = np.array([*json.loads(words.decode() if isinstance(words, bytes) else words), ""])
                result[name] = table[result[name]]
        return result

    def contact_network(self, i=-1, loaded=True):
        """Edges of the contact network of output i: ids of both bodies, shape (m, 2).

        loaded : only contacts that carry an impulse.
        """
        contacts = self[i].contacts
        edges = np.stack([contacts["body_a"], contacts["body_b"]], axis=1)
        return edges[np.any(contacts["impulse"] != 0, axis=1)] if loaded else edges

    def measure(self, i=-1, **options):
        """Coordination, solid fraction, fabric, stress ... of output i: a dict. See `measures.measure`."""
        from .measures import measure

        return measure(self[i], **options)

    def plot(self, i=-1, what="velocity", **options):
        """Draw output i coloured by a field of the bodies; returns a matplotlib Axes. See `plots.plot_step`."""
        from .plots import plot_step

        return plot_step(self[i], what, **options)

    def plot_force_chains(self, i=-1, **options):
        """Draw the normal impulses of output i as lines. See `plots.plot_force_chains`."""
        from .plots import plot_force_chains

        return plot_force_chains(self[i], **options)

    def plot_energy(self, **options):
        """Draw the energy terms over time. See `plots.plot_energy`."""
        from .plots import plot_energy

        return plot_energy(self.history, **options)

    def plot_residual(self, **options):
        """Draw error and iterations of the solver over time. See `plots.plot_residual`."""
        from .plots import plot_residual

        return plot_residual(self.history, **options)

    def animate(self, path, what="velocity", **options):
        """Write a .gif or .mp4 of all outputs. See `plots.animate`."""
        from .plots import animate

        return animate(self, path, what, **options)

    def __repr__(self):
        times = f", t = {self.times[0]:g} to {self.times[-1]:g} s" if len(self) else ""
        return f"<run {self.path}: {self.dim}D, {len(self)} outputs{times}>"

    def _repr_html_(self):
        from .notebook import of_run

        return of_run(self)


teach(globals())
