"""An HDF5 file that grows, and is a complete HDF5 file at every instant.

The HDF5 library changes its structures in place, so a program killed while it writes leaves a file that no reader may
open: in its mode for one writer and many readers, too, the flag "open for writing" stays behind, and plain readers
(VTK's among them) refuse the file until a repair. Here nothing that the file on disk refers to is ever changed:

- new rows of data go behind all that is there, or into space of the last chunk that no reader knows of yet;
- `commit` writes new copies of the headers and index nodes that changed behind the data, then replaces the superblock,
  48 bytes in one write, which names the new root. Killed before it, the file is the old one; after it, the new one.

Space of headers that were replaced is used again some commits later, so that a reader which opened the file in between
still finds what it looks for. `commit(sync=True)` also withstands a loss of power, and leaves a second copy of the
superblock, from which `restore_superblock` can go back to that commit.
"""

import os
import time
from collections import deque

import numpy as np

from . import format as h5
from .errors import FileError, as_file_error
from .exclusive import create, refuse_if_written, stands

_DATA_START = 512
_SPARE = 256  # where the last superblock stands that the disk itself is known to hold
_COMMITS_KEPT = 8  # replaced headers stay readable over so many commits
_SYNC_SECONDS, _SYNC_BYTES = 10.0, 1 << 22  # after so much time, or waste, a commit waits for the disk


class Group:
    """Named members, in the order in which they were made, and attributes."""

    def __init__(self, file):
        self._file, self._links, self._attrs = file, {}, {}
        self._address, self._size, self._targets, self._changed = h5.UNDEFINED, 0, {}, True

    def group(self, name):
        """The member group `name`, made if it is not there."""
        if name not in self._links:
            self._add(name, Group(self._file))
        return self._links[name]

    def array(self, name, value, **attrs):
        """Store a whole array, number or text, once and for all."""
        return self._add(name, _Whole(self._file, value, attrs))

    def series(self, name, dtype, row_shape=(), rows_per_chunk=512, **attrs):
        """An array without rows yet, that grows along its first axis."""
        return self._add(name, Series(self._file, dtype, row_shape, rows_per_chunk, attrs))

    def soft_link(self, name, path):
        self._add(name, path)

    def set_attribute(self, name, value):
        self._attrs[name] = h5.storable(value)
        self._changed = True

    def _add(self, name, member):
        if name in self._links:
            raise ValueError(f"'{name}' is in this group already")
        if not name or "/" in name:
            raise ValueError(f"'{name}' cannot name a member of a group")
        self._links[name] = member
        self._changed = True
        return member

    def __contains__(self, name):
        return name in self._links

    def __getitem__(self, name):
        return self._links[name]

    def _place(self):
        targets = {name: m if isinstance(m, str) else m._place() for name, m in self._links.items()}
        if self._changed or targets != self._targets:
            self._targets, self._changed = targets, False
            self._address, self._size = self._file._replace(self._address, self._size, h5.group_header(targets, self._attrs))
        return self._address


class _Whole:
    def __init__(self, file, value, attrs):
        value = h5.storable(value)
        address = h5.UNDEFINED
        if value.nbytes:
            address = file._allocate(value.nbytes)
            file._write(address, value)
        attrs = {name: h5.storable(v) for name, v in attrs.items()}
        header = h5.dataset_header(value.dtype, value.shape, h5.contiguous(address, value.nbytes), attrs)
        self._address, _ = file._replace(h5.UNDEFINED, 0, header)

    def _place(self):
        return self._address


class Series:
    """An array that grows along its first axis. `rows` counts the rows appended so far."""

    def __init__(self, file, dtype, row_shape, rows_per_chunk, attrs):
        self._file, self.dtype, self.row_shape = file, h5.storable(np.empty(0, dtype)).dtype, tuple(row_shape)
        self._row_bytes = self.dtype.itemsize * int(np.prod(self.row_shape, dtype=np.int64))
        if self._row_bytes == 0:
            raise ValueError("a row of a series must hold something")
        self._per_chunk, self.rows = int(rows_per_chunk), 0
        attrs = {name: h5.storable(v) for name, v in attrs.items()}
        self._header = h5.GrowingHeader(self.dtype, self.row_shape, self._per_chunk, attrs)
        self._levels = [[]]  # addresses: of the chunks, of the nodes over them, of the nodes over those ...
        self._indexed = 0  # chunks that the nodes know
        self._address, self._size, self._changed = h5.UNDEFINED, 0, True

    def append(self, values):
        """Append rows, shape (n, *row_shape); returns the number of the first."""
        values = h5.storable(np.asarray(values, dtype=self.dtype))
        if values.shape[1:] != self.row_shape:
            raise ValueError(f"rows of shape {self.row_shape} were expected, not {values.shape[1:]}")
        first, done, n = self.rows, 0, len(values)
        while done < n:
            inside = self.rows % self._per_chunk
            if inside == 0:
                self._levels[0].append(self._file._allocate(self._per_chunk * self._row_bytes))
            take = min(self._per_chunk - inside, n - done)
            self._file._write(self._levels[0][-1] + inside * self._row_bytes, values[done : done + take])
            done, self.rows = done + take, self.rows + take
        self._changed |= n > 0
        return first

    def _place(self):
        if self._changed:
            self._changed = False
            root = self._index()
            header = self._header.bytes(self.rows, root)
            self._address, self._size = self._file._replace(self._address, self._size, header)
        return self._address

    def _index(self):
        """Write the nodes over chunks that came since the last commit; full nodes are written once, for ever."""
        chunks = self._levels[0]
        if not chunks:
            return h5.UNDEFINED
        if self._indexed == len(chunks):
            return self._levels[-1][0]
        rank = 1 + len(self.row_shape)
        first, level, span = self._indexed, 0, self._per_chunk  # first changed child, rows a child spans
        while level == 0 or len(self._levels[level]) > 1:
            children = self._levels[level]
            if len(self._levels) == level + 1:
                self._levels.append([])
            nodes = self._levels[level + 1]
            first_node = first // h5.CHILDREN
            for k in range(first_node, -(-len(children) // h5.CHILDREN)):
                part = children[k * h5.CHILDREN : (k + 1) * h5.CHILDREN]
                node = h5.tree_node(
                    level,
                    part,
                    k * h5.CHILDREN * span,
                    span,
                    len(chunks) * self._per_chunk if (k + 1) * h5.CHILDREN >= len(children) else (k + 1) * h5.CHILDREN * span,
                    rank,
                    self._per_chunk * self._row_bytes,
                )
                old = nodes[k] if k < len(nodes) else h5.UNDEFINED
                address, _ = self._file._replace(old, len(node), node)
                nodes[k : k + 1] = [address]
            first, level, span = first_node, level + 1, span * h5.CHILDREN
        self._indexed = len(chunks)
        return self._levels[level][0]


class GrowingFile:
    """A new HDF5 file at `path`, open for appending. `root` is its root group.

    It appears under its name with the first `commit`. Raises FileError if a file is there (unless `overwrite`), if the
    folder cannot be written to, or later if the disk is full; all that was committed before stays readable.
    """

    def __init__(self, path, overwrite=False):
        self.path = os.fspath(path)
        self._made = self.path + ".part"
        if os.path.lexists(self.path) and not overwrite:
            raise FileError(
                path,
                "this file exists already",
                "choose another name, or ask for it to be overwritten (overwrite=True, --overwrite), or for a run to go on in it "
                "(append=True, --append)",
            )
        if os.path.isdir(self.path):
            raise FileError(path, "this is a folder", "give the name of a file")
        self._fd = create(self._made, self.path)
        try:
            if os.path.lexists(self.path):
                if not overwrite:  # another run was renamed to it meanwhile
                    raise FileError(path, "another run has written this file meanwhile", "choose another name")
                refuse_if_written(self.path)
        except FileError:
            os.unlink(self._made)
            os.close(self._fd)
            raise
        self._end, self._commits, self._durable = _DATA_START, 0, 0
        self._freed, self._wasted, self._failure, self._synced_at = {}, 0, None, time.monotonic()
        self.root = Group(self)

    def commit(self, sync=None):
        """Make all that was written so far part of the file.

        sync : True also waits until it is on the disk itself, False does not, None does so from time to time.
        """
        if sync is None:
            sync = time.monotonic() - self._synced_at > _SYNC_SECONDS or self._wasted > _SYNC_BYTES
        superblock = h5.superblock(self.root._place(), self._end)
        try:
            if not stands(self._fd, self._made or self.path):
                raise FileError(
                    self.path,
                    "the file, or its folder, was removed or replaced while it was written: what was written is lost",
                    "leave the folder alone while a run writes to it",
                )
            if os.fstat(self._fd).st_size < self._end:
                os.ftruncate(self._fd, self._end)
            if sync:
                os.fsync(self._fd)
            self._write(0, superblock)
            if sync:
                os.fsync(self._fd)
                self._write(_SPARE, superblock)
            if self._made:
                os.replace(self._made, self.path)
                self._made = None
        except OSError as error:
            self._fail(error)
        self._commits += 1
        if sync:
            self._durable, self._wasted, self._synced_at = self._commits, 0, time.monotonic()

    def close(self):
        """Commit, unless writing has failed before, and let go of the file."""
        if self._fd is None:
            return
        try:
            if self._failure is None:
                self.commit(sync=True)
        finally:
            fd, self._fd = self._fd, None
            os.close(fd)
            if self._made:
                if os.path.lexists(self._made):
                    os.unlink(self._made)
                self._made = None

    @property
    def size(self):
        """Bytes of the file."""
        return self._end

    def _fail(self, error):
        self._failure = as_file_error(self.path, error)
        raise self._failure from error

    def _write(self, address, data):
        if self._failure is not None:
            raise self._failure
        if self._fd is None:
            raise FileError(self.path, "the file is closed", "open a new one")
        view = memoryview(data).cast("B")
        try:
            while view:
                done = os.pwrite(self._fd, view, address)
                view, address = view[done:], address + done
        except OSError as error:
            self._fail(error)

    def _allocate(self, size):
        address = self._end
        self._end += -(-size // 8) * 8
        return address

    def _replace(self, old, old_size, data):
        """Write a header or node anew, give up its old space; returns its address and size."""
        if old != h5.UNDEFINED:
            self._freed.setdefault(old_size, deque()).append((self._commits, old))
            self._wasted += old_size
        room = self._freed.get(len(data))
        # what the last durable superblock refers to must stay, lest a loss of power brings it back
        if room and room[0][0] < min(self._commits - _COMMITS_KEPT, self._durable):
            address = room.popleft()[1]
        else:
            address = self._allocate(len(data))
        self._write(address, data)
        return address, len(data)


def restore_superblock(path):
    """Go back to the last commit that the disk was known to hold; for a file that lost power while it was written.

    Returns True if that changed the file. Raises FileError if there is nothing to go back to.
    """
    try:
        with open(path, "r+b") as file:
            first = file.read(h5.SUPERBLOCK_SIZE)
            file.seek(_SPARE)
            spare = file.read(h5.SUPERBLOCK_SIZE)
            size = file.seek(0, os.SEEK_END)
            end = int.from_bytes(spare[28:36], "little")
            if (
                len(spare) < h5.SUPERBLOCK_SIZE
                or spare[:8] != first[:8]
                or end > size
                or h5.checksum(spare[:-4]) != int.from_bytes(spare[-4:], "little")
            ):
                raise FileError(path, "there is no earlier state in this file to go back to", "use a copy of it")
            if spare == first:
                return False
            file.seek(0)
            file.write(spare)
            return True
    except OSError as error:
        raise as_file_error(path, error) from error
