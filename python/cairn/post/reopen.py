"""Goes on in a file that `container` wrote: its groups and arrays as they stand, to be appended to.

Headers and nodes are written anew at the first commit; until then the file on the disk is the old one. Rows that are cut off are
no longer referred to after a commit, so that what is written in their place afterwards harms no reader who opens the file then.
"""

import os
import time

import h5py
import numpy as np

from . import format as h5
from .container import Group, GrowingFile, Series
from .errors import FileError, as_file_error
from .exclusive import lock
from .writer import RunWriter, _Block

# Files are read through a stream of their own: by its path HDF5 would hand out what another reader of this program had opened
# before, as it stood then, and the outputs since would be written over.
_BLOCK = (("bodies", "position"), ("contacts", "point"))
_PARTS = ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds")
_STEPS = ("PartOffsets", "NumberOfParts", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets")


class _Kept:
    """An array that stays as it is."""

    def __init__(self, address):
        self._address = address

    def _place(self):
        return self._address


def reopen(path):
    """The GrowingFile at a path. Raises FileError if it is none."""
    file = object.__new__(GrowingFile)
    file.path, file._made, file._fd = os.fspath(path), None, None
    try:
        file._fd = os.open(path, os.O_RDWR | os.O_CLOEXEC)
        if lock(file._fd) is False:
            raise FileError(path, "another run is writing this file", "let it end, or choose another name")
        with open(path, "rb") as old:
            block = old.read(h5.SUPERBLOCK_SIZE)
        if block != h5.superblock(int.from_bytes(block[36:44], "little"), int.from_bytes(block[28:36], "little")):
            raise FileError(path, "this file was not written by a simulation", "give the file of a run, or another name")
        file._end = -(-int.from_bytes(block[28:36], "little") // 8) * 8
        file._commits, file._durable, file._freed, file._wasted = 0, 0, {}, 0
        file._failure, file._synced_at = None, time.monotonic()
        with open(path, "rb") as stream, h5py.File(stream, "r") as old:
            file.root = _group(file, old["/"])
    except BaseException as error:
        if file._fd is not None:
            os.close(file._fd)
        if isinstance(error, OSError):
            raise as_file_error(path, error) from error
        raise
    return file


def _group(file, old):
    """The Group of one that is read, its members in the order in which they were made."""
    group, names = Group(file), []
    old.id.links.iterate(names.append, idx_type=h5py.h5.INDEX_CRT_ORDER)
    for name, value in old.attrs.items():
        group.set_attribute(name, value)
    for name in (text.decode() for text in names):
        link = old.get(name, getlink=True)
        if isinstance(link, h5py.SoftLink):
            group.soft_link(name, link.path)
            continue
        member = old[name]
        if isinstance(member, h5py.Group):
            group._add(name, _group(file, member))
        elif member.chunks is None:
            group._add(name, _Kept(h5py.h5o.get_info(member.id).addr))
        else:
            group._add(name, _series(file, member))
    return group


def _series(file, old):
    """The Series of an array that is read, with the places of its chunks."""
    series = Series(file, old.dtype, old.shape[1:], old.chunks[0], dict(old.attrs))
    places = {}
    if old.shape[0]:
        old.id.chunk_iter(lambda chunk: places.__setitem__(chunk.chunk_offset[0] // old.chunks[0], chunk.byte_offset))
    series._levels = [[places[k] for k in range(-(-old.shape[0] // old.chunks[0]))]]
    series.rows = old.shape[0]
    return series


def cut(series, rows):
    """Forgets the rows after the first so many."""
    series.rows, series._indexed, series._changed = rows, 0, True
    series._levels = [series._levels[0][: -(-rows // series._per_chunk)]]


def _block(group, points, dim):
    """A block of /VTKHDF as the writer has it; its steady fields are written once more, its list of points begins a new part."""
    block = object.__new__(_Block)
    block.group, block.dim, block.points_name = group, dim, points
    block.parts = {name: group[name] for name in _PARTS}
    block.points, block.connectivity, block.offsets, block.types = (
        group[name] for name in ("Points", "Connectivity", "Offsets", "Types")
    )
    block.rows, block.data = block.points._per_chunk, dict(group["PointData"]._links)
    block.names = tuple(block.data)
    steps = block.steps_group = group["Steps"]
    block.steps, block.values = {name: steps[name] for name in _STEPS}, steps["Values"]
    block.data_offsets = {name: steps["PointDataOffsets"][name] for name in block.data}
    block.count, block.part, block.cells, block.seen = -1, block.parts["NumberOfPoints"].rows - 1, 0, {}
    return block


def reopen_run(path, step):
    """The RunWriter that goes on in a run after a step: outputs and rows of the history that are later are dropped.

    Returns it, and how many outputs it keeps.
    """
    with open(path, "rb") as stream, h5py.File(stream, "r") as old:
        own = old["cairn"]
        dim, outputs = int(own.attrs["dim"]), int(np.searchsorted(own["steps/step"][()], step, side="right"))
        history = own["history"]["step"][()] if "step" in own["history"] else np.zeros(0, int)
        kept_rows = int(np.searchsorted(history, step, side="right"))
    writer = object.__new__(RunWriter)
    writer.dim, writer._file = dim, reopen(path)
    writer.path, root = writer._file.path, writer._file.root
    own = writer._own = root["cairn"]
    writer._steps = dict(own["steps"]._links)
    writer._history, writer._rows, writer._pending, writer._last_history = own["history"], kept_rows, [], None
    writer._flushed_at, writer._blocks = -np.inf, None
    _history(writer)
    changed = list(writer._steps.values())
    if "VTKHDF" in root:
        blocks = writer._blocks = tuple(_block(root["VTKHDF"][name], points, dim) for name, points in _BLOCK)
        writer._root_steps = root["VTKHDF"]["Steps"]
        writer._times = writer._root_steps["Values"]
        changed.append(writer._times)
        for block in blocks:
            changed += [*block.steps.values(), block.values, *block.data_offsets.values()]
        for group in (*(block.steps_group for block in blocks), writer._root_steps):
            group.set_attribute("NSteps", np.int64(outputs))
    for series in changed:
        cut(series, outputs)
    for series, _ in writer._names.values():
        cut(series, kept_rows)
    writer._file.commit()
    return writer, outputs


def _history(writer):
    """Columns of the history and what stands for a missing value in them, words by number."""
    import json

    writer._names, writer._texts = {}, {}
    for name, series in writer._history._links.items():
        words = writer._history._attrs.get(f"{name}_words")
        if words is not None:
            writer._texts[name] = {word: k for k, word in enumerate(json.loads(np.asarray(words).item()))}
        writer._names[name] = series, np.nan if series.dtype.kind == "f" else -1


