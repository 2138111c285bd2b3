"""Writes a run: one .vtkhdf file that ParaView and PyVista open, with Cairn's own groups beside; see cxx/files/run_writer.hpp."""

import json
import os

import numpy as np

from .. import _core
from ..base.errors import FileError

FORMAT_NAME = "cairn-run"
FORMAT_VERSION = (1, 2)  # the first number changes when older programs can no longer read the file

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
        self._core = _core.RunWriter(os.fspath(path), dim, overwrite)
        own = self._core.own
        write_tree(own.group("scene"), scene_info or {})
        write_tree(own.group("provenance"), provenance or {})
        if periodic is not None:
            write_tree(own.group("periodic"), periodic)
        self._core.begin()

    @classmethod
    def go_on(cls, path, step):
        """The writer that goes on in a run after a step: outputs and rows of the history that are later are dropped."""
        writer = object.__new__(cls)
        writer._core = _core.RunWriter.go_on(os.fspath(path), step)
        return writer

    def write_step(self, time, time_detection, step, bodies, contacts=None, info=None, cells=None, nodes=None,
                   fluid=None):  # fmt: skip
        """Write one output.

        time, time_detection: end of the step, to which the bodies belong, and the time of the detection configuration, to which
        the contacts belong [s].
        bodies: arrays over the bodies; "position" (n, dim) [m] is needed, "velocity" (n, 3 | 6) [m/s, rad/s], "rotation" (n,)
        or (n, 4), "radius" (n,) [m], "material", "id" and any other field are welcome.
        contacts: arrays over the contacts: "point" (m, dim) [m], "normal" (m, dim), "gap" (m,) [m], "impulse" (m, dim) [N s]
        on A in the axes of space, "status" (m,), "body_a", "body_b" (m,) ids; None for none.
        cells: of bodies that deform, as VTK has them: "points" (n, 3) [m], "connectivity", "offsets", "types", and "fields",
        arrays over the cells by name; None for none.
        nodes: arrays over the nodes of meshes, None for none: "position" (k, dim) [m] is needed, "velocity" (k, dim), "id" and
        any other field are welcome. Of a run that has none in its first output they are left out later.
        fluid: arrays over the particles of a liquid, None for none: "position" (l, dim) [m] is needed, "velocity" (l, dim),
        "pressure" (l,) [Pa] and any other field are welcome.
        info: numbers of this step; goes to the history unless `write_history` had it.

        The fields of the first output are the fields of all. Raises ValueError if they differ, FileError.
        """
        if contacts is None:
            contacts = {name: np.empty((0, self._core.dim)) for name in ("point", "normal", "impulse")}
            contacts |= {name: np.empty(0, kind) for name, kind in EMPTY_CONTACTS.items()}
        self._core.write_step(time, time_detection, int(step), bodies, contacts, cells, nodes or {}, fluid or {})
        if info is not None and self._core.last_history != step:
            self.write_history(time, step, info)

    def write_history(self, time, step, info):
        """Remember the numbers of one step taken: a nested dict of numbers and words; cheap, stored at the next flush.

        Nested names are joined by "_": {"energy": {"kinetic": 1.0}} becomes energy_kinetic.
        """
        row = {}
        _flatten(info, "", row)
        self._core.write_history(time, int(step), list(row.items()))

    def flush(self, sync=None, pace=0.0):
        """Make the steps written so far part of the file.

        sync : True also waits until it is on the disk itself, False does not, None does so from time to time.
        pace : do nothing if the last flush is less than so many seconds ago, since a flush costs more than small steps.
        """
        self._core.flush(sync, pace)

    def close(self):
        """Flush and close; calling it again does nothing."""
        self._core.close()

    def __enter__(self):
        return self

    def __exit__(self, *exc):
        self.close()

    @property
    def path(self):
        """Where the run is written."""
        return self._core.path

    @property
    def outputs(self):
        """How many outputs the file has."""
        return self._core.outputs

    @property
    def size(self):
        """Bytes of the file."""
        return self._core.size


def _flatten(info, prefix, row):
    for name, value in info.items():
        if isinstance(value, dict):
            _flatten(value, f"{prefix}{name}_", row)
        elif isinstance(value, (str, bool, int, float, np.number, np.bool_)):
            row.setdefault(f"{prefix}{name}", value if isinstance(value, str) else float(value))


__all__ = ["FORMAT_NAME", "FORMAT_VERSION", "FileError", "RunWriter", "write_tree"]
