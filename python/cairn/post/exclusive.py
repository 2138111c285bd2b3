"""Files that one writer alone has: made under another name, locked for as long as they are written.

A file grows, or is built, as `<name>.part` and is then renamed. Its writer holds a lock on it that the system lets go of when the
process ends, however it ends: a `.part` that is locked belongs to a run that lives, one that is not was left by a run that was
killed, and is cleaned. The lock is one of open files, on a byte that no file reaches: it hinders nobody who reads, HDF5 included.
"""

import errno
import fcntl
import os
import stat
import struct
import tempfile

from .errors import FileError, as_file_error

_BEYOND = 1 << 62  # no file is that long
_HELD = (errno.EAGAIN, errno.EACCES)


def lock(descriptor):
    """True if the open file is locked for this writer now, False if another has it, None where the system knows no such locks."""
    command = getattr(fcntl, "F_OFD_SETLK", None)
    if command is None:
        return None
    try:
        fcntl.fcntl(descriptor, command, struct.pack("hhqqi4x", fcntl.F_WRLCK, os.SEEK_SET, _BEYOND, 1, 0))
    except OSError as error:
        return False if error.errno in _HELD else None
    return True


def stands(descriptor, path):
    """Whether the file that is open is the one that stands at the path."""
    try:
        there = os.stat(path, follow_symlinks=False)
    except OSError:
        return False
    here = os.fstat(descriptor)
    return (here.st_dev, here.st_ino) == (there.st_dev, there.st_ino)


def refuse_if_written(path):
    """Raises FileError if a writer that lives has the file at the path."""
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC | os.O_NONBLOCK)
    except OSError:
        return  # none there, or none that this process could write to
    try:
        if lock(descriptor) is False:
            raise _busy(path)
    finally:
        os.close(descriptor)


def create(part, path):
    """Descriptor of a new file at `part`, which is to become `path`, locked for this writer.

    What a killed run left there is cleaned. Raises FileError if another run writes it, if it is a link (it is never followed), or
    if it cannot be made.
    """
    try:
        while True:
            try:
                made = os.open(part, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
            except FileExistsError:
                _clean(part, path)
                continue
            if lock(made) is not False and stands(made, part):
                return made
            os.close(made)  # another has taken it for a stale one before it was locked
            raise _busy(path)
    except OSError as error:
        raise as_file_error(path, error) from error


def create_beside(folder, name):
    """(descriptor, path) of a new file `.<name>.*.part` in a folder, locked, readable by this user alone."""
    while True:
        descriptor, path = tempfile.mkstemp(prefix=f".{name}.", suffix=".part", dir=folder)
        if lock(descriptor) is not False and stands(descriptor, path):
            return descriptor, path
        os.close(descriptor)  # another has cleaned it before it was locked


def replace_whole(path, data):
    """Writes bytes to a path, which is the old file or the new one at every instant. What stands in the way under another name,
    a link say, is never written to. Raises FileError."""
    path = os.fspath(path)
    folder, name = os.path.split(path)
    made = descriptor = None
    try:
        remove_stale(folder or ".", f".{name}.")
        descriptor, made = create_beside(folder or ".", name)
        with open(descriptor, "wb", closefd=False) as out:
            out.write(data)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(made, 0o666 & ~umask)
        os.replace(made, path)
        made = None
    except OSError as error:
        raise as_file_error(path, error) from error
    finally:
        if made is not None and stands(descriptor, made):
            os.unlink(made)
        if descriptor is not None:
            os.close(descriptor)


def _clean(part, path):
    """Removes a file that no run writes any more."""
    try:
        kind = os.lstat(part).st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISREG(kind):
        what = "a link" if stat.S_ISLNK(kind) else "no plain file"
        raise FileError(path, f"{part}, in its way, is {what}, and is not followed", f"remove {part}, or choose another name")
    try:
        left = os.open(part, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK)
    except FileNotFoundError:
        return
    try:
        held = lock(left)
        if held is False:
            raise _busy(path)
        if held is None:
            raise FileError(path, f"{part} is there, and whether a run writes it cannot be told", f"if none does, remove {part}")
        if stands(left, part):
            os.unlink(part)
    finally:
        os.close(left)


def remove_stale(folder, prefix):
    """Removes the files `<prefix>*.part` of a folder that no writer has any more."""
    with os.scandir(folder) as entries:
        left = [e.path for e in entries if e.name.startswith(prefix) and e.name.endswith(".part")]
    for path in left:
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK)
        except OSError:
            continue
        try:
            if lock(descriptor) and stands(descriptor, path):
                os.unlink(path)
        finally:
            os.close(descriptor)


def _busy(path):
    return FileError(path, "another run is writing this file", "let it end, or choose another name")
