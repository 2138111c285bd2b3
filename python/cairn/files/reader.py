"""Reader of run files: outputs as numpy arrays, history and description of the scene."""

import json
import os

import numpy as np

from ..base import checks
from ..base.errors import FileError, told_as_damage
from ..names import listed, teach
from .hdf5 import File, Group
from .writer import FORMAT_NAME, FORMAT_VERSION

STEPS = ("time", "time_detection", "step", "first_body", "bodies", "first_contact", "contacts")
NODE_STEPS = ("first_node", "nodes")  # of runs with meshes
_VECTORS = ("position", "point", "normal", "impulse", "displacement")  # stored with z = 0 in 2D, given back with two components


class History(dict):
    """Columns of the history by their names; one that is not there is told by those that are."""

    def __missing__(self, name):
        raise KeyError(f"the history has no column {name!r}; it has {listed(self, name)}")


def open_run(path):
    """Opens the file of a run and checks that it is one.

    Parameters
    ----------
    path : path-like
        Name of the file.

    Returns
    -------
    File
        The open file.

    Raises
    ------
    FileError
        If there is no such file, or it is no run.
    """
    try:
        file = File(path)
    except FileError as error:
        if error.remedy == "give a file that Cairn wrote":
            raise FileError(path, error.problem, "give a .vtkhdf file that a Cairn simulation wrote") from error
        raise
    try:
        with told_as_damage(path):
            check_format(path, file, "cairn", FORMAT_NAME, FORMAT_VERSION)
    except FileError:
        file.close()
        raise
    return file


def check_format(path, file, group, name, version):
    """Checks that a group of an HDF5 file bears a format in a version that this program can read.

    Parameters
    ----------
    path : path-like
        Name of the file.
    file : File
        The open file.
    group : str
        Name of the group.
    name : str
        Name of the format.
    version : tuple
        Version that is read: its first number must not be lower than that of the file.

    Raises
    ------
    FileError
        If it bears another format, or a later version.
    """
    attrs = file[group].attrs if group in file else {}
    if attrs.get("format") != name:
        if name == FORMAT_NAME and file.attrs.get("format") == "cairn-checkpoint":
            remedy = "cairn.Scene.load and Simulation.restore read them; give a .vtkhdf file"
            raise FileError(path, "this file holds a scene or a checkpoint, and no run", remedy)
        raise FileError(path, f"this HDF5 file is not a {name} file", "give a file that Cairn wrote for this purpose")
    theirs = tuple(int(n) for n in attrs["version"])
    if theirs[0] > version[0]:
        raise FileError(
            path, f"the file has format version {theirs[0]}.{theirs[1]}, this Cairn reads up to {version[0]}", "use a newer Cairn"
        )


def read_tree(group, within=()):
    """Reads a group that `writer.write_tree` stored.

    Parameters
    ----------
    group : Group
        The group.
    within : tuple
        Addresses of the groups that it stands in.

    Returns
    -------
    dict
        Members by name; groups are dicts.

    Raises
    ------
    ValueError
        If the group stands within itself.
    """
    if group._core.address in within:
        raise ValueError(f"{group.name} contains itself: the file is damaged, write it anew")
    within = (*within, group._core.address)
    return {name: read_tree(member, within) if isinstance(member, Group) else _value(member) for name, member in group.items()}


def _value(array):
    value = array[()]
    if array.dtype.kind == "S":
        value = np.char.decode(value, "utf-8")
        value = value.item() if value.ndim == 0 else value
    elif value.ndim == 0:
        value = value.item()
    return json.loads(value) if "encoding" in array.attrs else value


class MissingField(KeyError):
    """A field that an output does not hold."""


class Fields:
    """Arrays over the bodies or the contacts of one output, read when asked for: `fields.gap` or `fields["gap"]`.

    Parameters
    ----------
    path : str
        Name of the file.
    block : Group or None
        Group of the fields; None without any.
    points_name : str
        Name of the places, "position" or "point".
    step : int
        Number of the output.
    first : int
        First row.
    count : int
        Number of rows.
    dim : int
        2 or 3.
    turning : bool, default True
        True if velocities have spins beside them.
    """

    def __init__(self, path, block, points_name, step, first, count, dim, turning=True):
        self._path, self._block, self._points_name, self._step, self._dim = path, block, points_name, step, dim
        self._first, self._count, self._cache, self._turning = first, count, {}, turning

    def __len__(self):
        return self._count

    @property
    def names(self):
        """Names of the fields there are."""
        with told_as_damage(self._path):
            stored = [name for name in (self._block["PointData"] if self._block is not None else ()) if name != "spin"]
        return [self._points_name, *stored]

    def __contains__(self, name):
        return name in self.names

    def __iter__(self):
        return iter(self.names)

    def __getitem__(self, name):
        if name not in self._cache:
            if name not in self.names and name != "spin":
                raise MissingField(f"there is no field '{name}'; there are {listed(self.names, name)}")
            with told_as_damage(self._path):
                self._cache[name] = self._checked(name, self._read(name))
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

    def _checked(self, name, value):
        if len(value) != self._count or value.dtype.kind not in "biuf":
            raise ValueError(f"{name} holds {len(value)} rows of {value.dtype}: {self._count} of numbers are due")
        return value

    def _read(self, name):
        if name == self._points_name:
            if self._block is None:  # nodes of a run that has no meshes
                return np.zeros((0, self._dim))
            return self._block["Points"][self._first : self._first + self._count, : self._dim]
        first = int(self._block["Steps/PointDataOffsets"][name][self._step])
        value = self._block["PointData"][name][first : first + self._count]
        if name in _VECTORS or (name == "velocity" and not self._turning):
            return value[:, : self._dim]
        if name == "velocity":
            spin = self["spin"]
            return np.concatenate([value[:, : self._dim], spin[:, None] if spin.ndim == 1 else spin], axis=1)
        return value


class Drawn:
    """Bodies of one output followed by the nodes of meshes, the rows to which ids of contacts and pictures refer.

    A field that bodies or nodes lack is zero there; nodes have no rotation.

    Parameters
    ----------
    bodies : Fields
        Those of the bodies.
    nodes : Fields
        Those of the nodes.
    dim : int
        2 or 3.
    """

    def __init__(self, bodies, nodes, dim):
        self._parts, self._dim = (bodies, nodes), dim

    def __len__(self):
        return sum(map(len, self._parts))

    @property
    def names(self):
        """Names of the fields that one of them has."""
        return list(dict.fromkeys(name for part in self._parts for name in part.names))

    def __contains__(self, name):
        return name in self.names

    def __iter__(self):
        return iter(self.names)

    def __getitem__(self, name):
        if name not in self:
            return self._parts[0][name]
        found = [np.asarray(part[name]) if name in part.names else None for part in self._parts]
        like = max((values for values in found if values is not None), key=lambda values: values.shape[1:])
        out = np.zeros((len(self), *like.shape[1:]), like.dtype)
        first = 0
        for part, values in zip(self._parts, found):
            if values is not None and values.ndim == 2:
                out[first : first + len(part), : values.shape[1]] = values
            elif values is not None:
                out[first : first + len(part)] = values
            elif name == "rotation" and like.ndim == 2:
                out[first : first + len(part), 0] = 1.0
            first += len(part)
        return out


class Step:
    """One output: `time`, `time_detection` [s], `step`, `bodies`, `nodes` of meshes, `contacts` and `fluid`.

    `step` is the number of the time step. Runs of before format 1.2 have nodes of meshes among their bodies, and no `nodes`;
    `drawn` has both, in old runs and new ones. Bodies belong to `time`, contacts to `time_detection`. Units as in the simulation;
    `bodies.velocity` is (n, 3) or (n, 6), `contacts.impulse` (m, dim) [N s] on A in the axes of space.

    Parameters
    ----------
    run : StoredRun
        The run.
    index : int
        Number of the output.
    """

    def __init__(self, run, index):
        steps = {name: values[index] for name, values in run._steps.items()}
        self.dim, self.index, self.run = run.dim, index, run
        self.time, self.time_detection, self.step = steps["time"], steps["time_detection"], int(steps["step"])
        with told_as_damage(run.path):
            self.bodies, self.contacts = (
                Fields(run.path, run._file[f"cairn/{what}"], point, index, int(steps[first]), int(steps[what]), run.dim)
                for what, point, first in (("bodies", "position", "first_body"), ("contacts", "point", "first_contact"))
            )
            there = "nodes" in run._steps and len(run._steps["nodes"]) > 0
            block = run._file["VTKHDF/nodes"] if there else None
            first, many = (int(steps["first_node"]), int(steps["nodes"])) if there else (0, 0)
            self.nodes = Fields(run.path, block, "position", index, first, many, run.dim, turning=False)
        self.drawn = Drawn(self.bodies, self.nodes, self.dim) if many else self.bodies

    @property
    def fluid(self):
        """Fields of the particles of a liquid: position, velocity, pressure, density; without rows where a run has none."""
        with told_as_damage(self.run.path):
            there = "VTKHDF/fluid" in self.run._file
            block, first, many = None, 0, 0
            if there:
                block = self.run._file["VTKHDF/fluid"]
                first = int(block["Steps/PointOffsets"][self.index])
                many = int(block["NumberOfPoints"][int(block["Steps/PartOffsets"][self.index])])
        return Fields(self.run.path, block, "position", self.index, first, many, self.dim, turning=False)

    @property
    def cells(self):
        """Fields of the cells of deformable bodies, {name: (m, ...)}.

        They come mesh by mesh in order of their addition: mesh (its number), stress, strain and others; {} where a file holds
        none.
        """
        with told_as_damage(self.run.path):
            if "cairn/meshes" not in self.run._file:
                return {}
            block = self.run._file["cairn/meshes"]
            count = int(block["NumberOfCells"][int(block["Steps/PartOffsets"][self.index])])
            out = {}
            for name in block["CellData"]:
                first = int(block["Steps/CellDataOffsets"][name][self.index])
                out[name] = block["CellData"][name][first : first + count]
            return out

    def corners_of_cells(self):
        """Gives the connectivity of these cells.

        Returns
        -------
        types : ndarray (m,)
            VTK cell types.
        begin : ndarray (m + 1,)
            Offsets into the corners.
        found : ndarray
            Corners as node numbers, meshes in the same order.
        """
        with told_as_damage(self.run.path):
            block = self.run._file["cairn/meshes"]
            part = int(block["Steps/PartOffsets"][self.index])
            first, corner = (int(block[f"Steps/{name}"][self.index, 0]) for name in ("CellOffsets", "ConnectivityIdOffsets"))
            count, corners = (int(block[name][part]) for name in ("NumberOfCells", "NumberOfConnectivityIds"))
            types, begin = block["Types"][first : first + count], block["Offsets"][first + part : first + part + count + 1]
            found = block["Connectivity"][corner : corner + corners]
            if len(types) != count or len(begin) != count + 1 or len(found) != corners:
                raise ValueError(f"corners of {count} cells of output {self.index} are not all there")
            return types, begin, found

    def rows_of(self, ids):
        """Gives the rows of bodies, or of nodes of meshes, in the arrays of `drawn`.

        Parameters
        ----------
        ids : array_like of int
            Their ids.

        Returns
        -------
        ndarray
            Their rows.

        Raises
        ------
        FileError
            If the output lacks one of them.
        """
        try:
            ids = np.asarray(ids, np.int64)
        except OverflowError:
            ids = checks.body_ids(ids)  # which names the one that no body can have
        own = self.drawn["id"] if "id" in self.drawn else np.arange(len(self.drawn))
        order = np.argsort(own, kind="stable")
        place = np.minimum(np.searchsorted(own, ids, sorter=order), max(len(own) - 1, 0))
        if ids.size and (len(own) == 0 or np.any(own[order[place]] != ids)):
            lacks = f"the file is damaged: output {self.index} lacks bodies that it names"
            raise FileError(self.run.path, lacks, "use a copy of it")
        return order[place]

    def __repr__(self):
        nodes = f"{len(self.nodes)} nodes, " if len(self.nodes) else ""
        return f"<step {self.step}, t = {self.time:g} s, {len(self.bodies)} bodies, {nodes}{len(self.contacts)} contacts>"


class StoredRun:
    """Outputs, history and scene of a run file, as arrays; cairn.post.Run adds measures and pictures.

    Parameters
    ----------
    path : path-like
        Name of the .vtkhdf file.

    Raises
    ------
    FileError
        If there is no such file, it is truncated, not a run of Cairn or of a later format.
    """

    def __init__(self, path):
        self.path, self._file = os.fspath(path), None
        self.refresh()

    def refresh(self):
        """Reads the file anew.

        Returns
        -------
        StoredRun
            This run.
        """
        self.close()
        self._file = open_run(self.path)
        try:
            with told_as_damage(self.path):
                self._read_steps(self._file["cairn"])
        except FileError:
            self.close()
            raise
        self._scene = self._provenance = None
        return self

    def _read_steps(self, own):
        self.dim = own.attrs["dim"]
        if self.dim not in (2, 3):
            raise ValueError(f"dim is {self.dim}: 2 and 3 are known")
        names = (*STEPS, *(name for name in NODE_STEPS if name in own["steps"]))
        self._steps = {name: own["steps"][name][()] for name in names}
        shapes = {values.shape for values in self._steps.values()}
        if len(shapes) > 1 or len(*shapes) != 1:
            raise ValueError("the columns of the group steps have several lengths: the file is damaged, go on from a checkpoint")
        for name, values in self._steps.items():
            due = "f" if name.startswith("time") else "i"
            if values.dtype.kind != due:
                raise ValueError(f"steps/{name} holds {values.dtype}, not {'float' if due == 'f' else 'int'}: it is damaged")
            if due == "i" and values.size and values.min() < 0 or due == "f" and not np.all(np.isfinite(values)):
                wanted = "finite" if due == "f" else "a count"
                raise ValueError(f"steps/{name} holds a value that is not {wanted}: the file is damaged")

    def close(self):
        """Lets go of the file."""
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
        if isinstance(index, str) or not hasattr(index, "__index__"):
            raise TypeError(f"output {index!r} was asked for: give its number, 0 to {len(self) - 1}, or run.at(time)")
        n, wanted = len(self), int(index)
        if not -n <= wanted < n:
            raise IndexError(f"output {wanted} was asked for; {self.path} holds {n} (0 to {n - 1})")
        return Step(self, wanted % n)

    def __iter__(self):
        return (self[i] for i in range(len(self)))

    def at(self, time):
        """Gives the output nearest to a time.

        Parameters
        ----------
        time : float
            Time [s].

        Returns
        -------
        Step
            The output.

        Raises
        ------
        IndexError
            If there is no output yet.
        """
        if len(self) == 0:
            raise IndexError(f"{self.path} holds no output yet")
        return self[int(np.argmin(np.abs(self.times - checks.number("time", time))))]

    @property
    def times(self):
        """Times of the outputs [s], shape (len(run),)."""
        return self._steps["time"]

    @property
    def scene(self):
        """Description of the simulated scene: nested dict."""
        if self._scene is None:
            self._scene = self._tree("scene")
        return self._scene

    @property
    def provenance(self):
        """Version, compiler, flags, script, seed, date ...: nested dict."""
        if self._provenance is None:
            self._provenance = self._tree("provenance")
        return self._provenance

    @property
    def periodic(self):
        """The periodic cell: nested dict, or None."""
        return self._tree("periodic") if "cairn/periodic" in self._file else None

    def _tree(self, name):
        with told_as_damage(self.path):
            return read_tree(self._file["cairn"][name])

    @property
    def history(self):
        """Numbers of every step taken: dict of arrays with one row per step; words as text."""
        with told_as_damage(self.path):
            group = self._file["cairn/history"]
            result, attrs = History({name: group[name][()] for name in group}), group.attrs
            for name in result:
                if f"{name}_words" in attrs:
                    table = np.array([*map(str, json.loads(attrs[f"{name}_words"])), ""])
                    result[name] = table[result[name]]
            if len({column.shape for column in result.values()}) > 1:
                raise ValueError("the columns of the history have several lengths: the file is damaged")
        return result

    def __repr__(self):
        times = f", t = {self.times[0]:g} to {self.times[-1]:g} s" if len(self) else ""
        return f"<run {self.path}: {self.dim}D, {len(self)} outputs{times}>"


teach(globals())
