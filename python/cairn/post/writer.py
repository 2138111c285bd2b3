"""Writes a run: one .vtkhdf file that ParaView and PyVista open, with Cairn's own groups beside.

Layout, version 1.0 (see `FORMAT_VERSION`):

    /VTKHDF                MultiBlockDataSet, with Steps for the times
      bodies, contacts     UnstructuredGrid over time: a vertex per body and per contact, PointData its fields
      Steps                time of each output
      Assembly             soft links to both blocks
    /cairn                 attributes format, version, dim
      scene, provenance    what was simulated, and by what: nested groups, text and arrays
      steps                a row per output: number of the step, both times, first row and number of bodies and contacts
      history              a row per step taken: time, step, contacts, iterations, error, energies ...
      bodies, contacts     soft links into /VTKHDF

A field that did not change since the output before it (radius, material ...) is not written again: its offset is
repeated. In 2D z is 0. VTK 9.4 and later (ParaView 5.13) read
the blocks over time.
"""

import hashlib
import json
import time

import numpy as np

from .container import GrowingFile
from .errors import FileError

FORMAT_NAME = "cairn-run"
FORMAT_VERSION = (1, 0)  # the first number changes when older programs can no longer read the file

UNITS = {
    "position": "m",
    "point": "m",
    "gap": "m",
    "radius": "m",
    "velocity": "m/s",
    "spin": "rad/s",
    "impulse": "N s",
    "couple": "N m s",
    "mass": "kg",
    "time": "s",
    "time_detection": "s",
    "dt": "s",
    "normal": "-",
    "status": "-",
}
STEADY = ("radius", "material", "id", "group", "layer", "mass", "inertia", "shape", "body")  # seldom change
EMPTY_CONTACTS = {"gap": "f8", "status": "i4", "body_a": "i8", "body_b": "i8"}


def write_tree(group, tree):
    """Store a nested dict in a group: dicts as groups, arrays and numbers as they are, all else as text or JSON."""
    for name, value in tree.items():
        name = str(name).replace("/", "_")
        if isinstance(value, dict):
            write_tree(group.group(name), value)
        elif isinstance(value, (str, bytes)):
            group.array(name, value)
        elif value is None or (
            isinstance(value, (list, tuple)) and np.asarray(value, dtype=object).dtype == object and not _numeric(value)
        ):
            group.array(name, json.dumps(value, default=str), encoding="json")
        else:
            array = np.asarray(value)
            if array.dtype.kind in "biufSU":
                group.array(name, array)
            else:
                group.array(name, json.dumps(value, default=str), encoding="json")


def _numeric(value):
    try:
        return np.asarray(value).dtype.kind in "biuf"
    except ValueError:  # rows of unequal length
        return False


class _Block:
    """A block of /VTKHDF: a set of points over time, with one vertex each."""

    def __init__(self, group, points, fields, dim, expected):
        self.group, self.dim, self.points_name, self.names = group, dim, points, tuple(fields)
        # some outputs to a chunk, so that not every flush adds to the index, and not more than some 200 kB
        self.rows = min(1 << max(6, int(4 * expected).bit_length()), 8192)
        group.set_attribute("Version", np.array([2, 1]))
        group.set_attribute("Type", np.bytes_(b"UnstructuredGrid"))
        few = {
            name: group.series(name, "i8", rows_per_chunk=256)
            for name in ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds")
        }
        self.parts = few
        self.points = group.series("Points", "f8", (3,), self.rows, unit="m")
        self.connectivity = group.series("Connectivity", "i8", rows_per_chunk=self.rows)
        self.offsets = group.series("Offsets", "i8", rows_per_chunk=self.rows)
        self.types = group.series("Types", "u1", rows_per_chunk=self.rows)
        data, steps = group.group("PointData"), group.group("Steps")
        self.data = {}
        for name, value in fields.items():
            unit = {"unit": UNITS[name]} if name in UNITS else {}
            self.data[name] = data.series(name, value.dtype, value.shape[1:], self.rows, **unit)
        self.steps = {
            name: steps.series(name, "i8", rows_per_chunk=256) for name in ("PartOffsets", "NumberOfParts", "PointOffsets")
        }
        self.steps.update({name: steps.series(name, "i8", (1,), 256) for name in ("CellOffsets", "ConnectivityIdOffsets")})
        self.values = steps.series("Values", "f8", rows_per_chunk=256, unit="s")
        offsets = steps.group("PointDataOffsets")
        self.data_offsets = {name: offsets.series(name, "i8", rows_per_chunk=256) for name in fields}
        self.steps_group, self.count, self.part, self.cells, self.seen = steps, -1, -1, 0, {}

    def append(self, time, points, fields):
        """Append one output; returns the first row of the points."""
        n = len(points)
        if n != self.count:
            self._new_topology(n)
        first = self.points.append(points)
        self.steps["PartOffsets"].append([self.part])
        self.steps["NumberOfParts"].append([1])
        self.steps["PointOffsets"].append([first])
        self.steps["CellOffsets"].append([[self.cells]])
        self.steps["ConnectivityIdOffsets"].append([[0]])
        self.values.append([time])
        for name, value in fields.items():
            self.data_offsets[name].append([self._append_field(name, value)])
        return first

    def _append_field(self, name, value):
        """First row of a field in this output; steady ones are written only when they changed."""
        if name not in STEADY:
            return self.data[name].append(value)
        digest = hashlib.blake2b(np.ascontiguousarray(value).data, digest_size=16).digest() + bytes(str(value.shape), "ascii")
        if self.seen.get(name, (None,))[0] != digest:
            self.seen[name] = digest, self.data[name].append(value)
        return self.seen[name][1]

    def _new_topology(self, n):
        """A part with n vertices. Every part is 0, 1, 2 ..., so that all share one list of points of cells."""
        if self.connectivity.rows < n:
            self.connectivity.append(np.arange(self.connectivity.rows, n))
        self.cells = self.types.rows
        self.types.append(np.ones(n, np.uint8))  # VTK_VERTEX
        self.offsets.append(np.arange(n + 1))
        for series in self.parts.values():
            series.append([n])
        self.count, self.part = n, self.part + 1


class RunWriter:
    """Writes a run to `path`, one output after the other.

    Parameters
    ----------
    path : where; refused if a file is there, unless `overwrite`.
    scene_info : nested dict of arrays, numbers and text; stored in /cairn/scene. The pictures use, if they are there,
        "materials" (names by number) and "contactors": arrays over the contactors "shape" (names), "body" (ids),
        "radius" [m], "offset" (n, dim) [m], "direction" (n, dim + 1), as in fields.def.
    provenance : nested dict: version, compiler, flags, script, seed, date ...; stored in /cairn/provenance.
    dim : 2 or 3.
    periodic : nested dict about the cell, or None.

    Nothing is promised before `flush`; after it the file holds, whatever happens to the program, every step written.
    """

    def __init__(self, path, scene_info=None, provenance=None, dim=2, periodic=None, overwrite=False):
        if dim not in (2, 3):
            raise ValueError(f"dim is {dim}; it must be 2 or 3")
        self.dim, self._blocks, self._names = dim, None, {}
        self._file = GrowingFile(path, overwrite=overwrite)
        self.path = self._file.path
        own = self._own = self._file.root.group("cairn")
        own.set_attribute("format", FORMAT_NAME)
        own.set_attribute("version", np.array(FORMAT_VERSION))
        own.set_attribute("dim", np.int64(dim))
        write_tree(own.group("scene"), scene_info or {})
        write_tree(own.group("provenance"), provenance or {})
        if periodic is not None:
            write_tree(own.group("periodic"), periodic)
        steps = own.group("steps")
        self._steps = {
            name: steps.series(name, kind, rows_per_chunk=256)
            for name, kind in (
                ("time", "f8"),
                ("time_detection", "f8"),
                ("step", "i8"),
                ("first_body", "i8"),
                ("bodies", "i8"),
                ("first_contact", "i8"),
                ("contacts", "i8"),
            )
        }
        self._history, self._rows, self._pending, self._last_history = own.group("history"), 0, [], None
        self._texts, self._flushed_at = {}, -np.inf
        self._file.commit()

    def write_step(self, time, time_detection, step, bodies, contacts=None, info=None):
        """Write one output.

        time, time_detection: end of the step, to which the bodies belong, and the time of the detection configuration, to which
        the contacts belong [s].
        bodies: arrays over the bodies; "position" (n, dim) [m] is needed, "velocity" (n, 3 | 6) [m/s, rad/s], "rotation" (n,)
        or (n, 4), "radius" (n,) [m], "material", "id" and any other field are welcome.
        contacts: arrays over the contacts: "point" (m, dim) [m], "normal" (m, dim), "gap" (m,) [m], "impulse" (m, dim) [N s]
        on A in the axes of space, "status" (m,), "body_a", "body_b" (m,) ids; None for none.
        info: numbers of this step; goes to the history unless `write_history` had it.

        The fields of the first output are the fields of all. Raises ValueError if they differ, FileError.
        """
        points, fields = self._body_fields(bodies)
        contact_points, contact_fields = self._contact_fields(contacts)
        if self._blocks is None:
            self._make_blocks(fields, contact_fields, len(points))
        self._check(0, "bodies", fields, len(points))
        self._check(1, "contacts", contact_fields, len(contact_points))
        first_body = self._blocks[0].append(time, points, fields)
        first_contact = self._blocks[1].append(time, contact_points, contact_fields)
        self._times.append([time])
        row = (time, time_detection, step, first_body, len(points), first_contact, len(contact_points))
        for series, value in zip(self._steps.values(), row, strict=True):
            series.append([value])
        for group in (self._blocks[0].steps_group, self._blocks[1].steps_group, self._root_steps):
            group.set_attribute("NSteps", np.int64(self._times.rows))
        if info is not None and self._last_history != step:
            self.write_history(time, step, info)

    def write_history(self, time, step, info):
        """Remember the numbers of one step taken: a nested dict of numbers and words; cheap, stored at the next flush.

        Nested names are joined by "_": {"energy": {"kinetic": 1.0}} becomes energy_kinetic.
        """
        row = {"time": float(time), "step": int(step)}
        _flatten(info, "", row)
        self._pending.append(row)
        self._last_history = step

    def flush(self, sync=None, pace=0.0):
        """Make the steps written so far part of the file; `sync` as in GrowingFile.commit.

        pace : do nothing if the last flush is less than so many seconds ago; a flush costs a few milliseconds, which the
            steps of a small scene do not.
        """
        if pace and time.monotonic() - self._flushed_at < pace:
            return
        if self._pending:
            self._store_history()
        self._file.commit(sync=sync)
        self._flushed_at = time.monotonic()

    def close(self):
        """Flush and close; calling it again does nothing."""
        if self._pending and self._file._failure is None:
            self._store_history()
        self._file.close()

    def __enter__(self):
        return self

    def __exit__(self, *exc):
        self.close()

    @property
    def size(self):
        """Bytes of the file."""
        return self._file.size

    def _body_fields(self, bodies):
        points = self._in_space("position", bodies["position"])
        fields = {name: np.asarray(value) for name, value in bodies.items() if name != "position"}
        if "velocity" in fields:
            velocity = fields.pop("velocity")
            if velocity.shape[1:] != (3 * self.dim - 3,):
                raise ValueError(f"bodies velocity has shape {velocity.shape}; it must be (n, {3 * self.dim - 3})")
            fields["velocity"] = self._in_space("velocity", velocity[:, : self.dim])
            fields["spin"] = velocity[:, 2] if self.dim == 2 else velocity[:, 3:]
        return points, fields

    def _contact_fields(self, contacts):
        vectors = ("point", "normal", "impulse")
        if contacts is None:
            contacts = {name: np.empty((0, self.dim)) for name in vectors}
            contacts |= {name: np.empty(0, kind) for name, kind in EMPTY_CONTACTS.items()}
        fields = {name: self._in_space(name, value) if name in vectors else np.asarray(value) for name, value in contacts.items()}
        return fields.pop("point"), fields

    def _in_space(self, name, value):
        """Vectors with three components, as VTK wants them."""
        value = np.asarray(value, dtype=float)
        if value.ndim != 2 or value.shape[1] != self.dim:
            raise ValueError(f"{name} has shape {value.shape}; it must be (n, {self.dim})")
        if self.dim == 3:
            return value
        result = np.zeros((len(value), 3))
        result[:, :2] = value
        return result

    def _make_blocks(self, fields, contact_fields, n):
        root = self._file.root.group("VTKHDF")
        root.set_attribute("Version", np.array([2, 1]))
        root.set_attribute("Type", np.bytes_(b"MultiBlockDataSet"))
        # VTK forgets the steps of the blocks when it is asked twice, unless the root has steps too; 9.4 wants every
        # member of the root to have a type, and looks for the times in the last one, so this is the first
        self._root_steps = root.group("Steps")
        self._root_steps.set_attribute("Version", np.array([2, 1]))
        self._root_steps.set_attribute("Type", np.bytes_(b"ImageData"))
        self._times = self._root_steps.series("Values", "f8", rows_per_chunk=256, unit="s")
        self._blocks = (
            _Block(root.group("bodies"), "position", fields, self.dim, n),
            _Block(root.group("contacts"), "point", contact_fields, self.dim, 2 * n),
        )
        root["bodies"].set_attribute("Index", np.int64(0))
        root["contacts"].set_attribute("Index", np.int64(1))
        assembly = root.group("Assembly")
        for name in ("bodies", "contacts"):
            assembly.soft_link(name, f"/VTKHDF/{name}")
            self._own.soft_link(name, f"/VTKHDF/{name}")

    def _check(self, which, what, fields, n):
        data = self._blocks[which].data
        if set(fields) != set(data):
            raise ValueError(
                f"the {what} have fields {sorted(fields)}, those of the first output {sorted(data)}; "
                "give the same at every output"
            )
        for name, value in fields.items():
            if value.shape != (n, *data[name].row_shape):
                raise ValueError(f"{what} {name} has shape {value.shape}; it must be {(n, *data[name].row_shape)}")

    def _store_history(self):
        names = dict.fromkeys(name for row in self._pending for name in row)
        for name in names:
            column = [row.get(name) for row in self._pending]
            if name not in self._names:
                self._new_column(name, next(value for value in column if value is not None))
            series, missing = self._names[name]
            if name in self._texts:
                column = [self._code(name, value) for value in column]
            series.append([missing if value is None else value for value in column])
        for name, (series, missing) in self._names.items():
            if name not in names:
                series.append([missing] * len(self._pending))
        self._rows += len(self._pending)
        self._pending = []

    def _new_column(self, name, sample):
        """A column of the history; rows before its first value hold what stands for a missing one: NaN or -1."""
        if isinstance(sample, str):
            self._texts[name] = {}
            series, missing = self._history.series(name, "i4"), -1
        elif name == "step":
            series, missing = self._history.series(name, "i8"), -1
        else:
            series, missing = self._history.series(name, "f8", **({"unit": UNITS[name]} if name in UNITS else {})), np.nan
        if self._rows:
            series.append([missing] * self._rows)
        self._names[name] = series, missing

    def _code(self, name, value):
        """Words are stored as numbers; the list of words is an attribute of the history."""
        if value is None:
            return -1
        table = self._texts[name]
        if value not in table:
            table[value] = len(table)
            self._history.set_attribute(f"{name}_words", json.dumps(list(table)))
        return table[value]


def _flatten(info, prefix, row):
    for name, value in info.items():
        if isinstance(value, dict):
            _flatten(value, f"{prefix}{name}_", row)
        elif isinstance(value, (str, bool, int, float, np.number, np.bool_)):
            row.setdefault(f"{prefix}{name}", value if isinstance(value, str) else np.asarray(value).item())


__all__ = ["FORMAT_NAME", "FORMAT_VERSION", "FileError", "RunWriter", "write_tree"]
