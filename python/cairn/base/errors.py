"""Errors of files, each with a remedy that a user can act on."""

import contextlib
import os

# exceptions raised where damaged contents of a file are put to use
DAMAGE = (ValueError, KeyError, TypeError, IndexError, AttributeError, OverflowError, MemoryError, RuntimeError, UnicodeError)


class FileError(OSError):
    """A file cannot be read or written.

    The message names the path, the problem and the remedy; `path`, `problem` and `remedy` hold them separately.
    """

    def __init__(self, path, problem, remedy=""):
        self.path, self.problem, self.remedy = str(path), problem, remedy
        super().__init__(f"{self.path}: {problem}" + (f"; {remedy}" if remedy else ""))


class ContentError(FileError, ValueError):
    """The contents of a file are unusable; made from one text, `path[, line n]: problem[; remedy]`."""

    def __init__(self, text, remedy="write it again, or mend it by hand"):
        place, _, rest = str(text).partition(": ")
        problem, _, told = rest.rpartition("; ") if "; " in rest else (rest, "", "")
        super().__init__(place.partition(", line ")[0], problem, told or remedy)
        self.args = (str(text),)

    def __str__(self):
        return self.args[0]


class MissingFile(FileError, FileNotFoundError):
    """There is no file at a path."""

    def __init__(self, path):
        super().__init__(path, "does not exist", "check the path")
        self.args = (f"{path} does not exist; check the path",)

    def __str__(self):
        return self.args[0]


class UnknownStructure(FileError):
    """A structure that the HDF5 format allows and Cairn's reader does not support; the file need not be damaged."""


@contextlib.contextmanager
def told_as_damage(path, remedy="copy it again from where it was made"):
    """Turns exceptions of DAMAGE, raised within the context by the contents of a file, into FileError."""
    try:
        yield
    except DAMAGE as error:
        missing = isinstance(error, KeyError) and error.args
        told = str(error.args[0] if missing else error) or type(error).__name__
        raise FileError(path, f"the file is damaged: {told}", remedy) from error


# endings of names by which other programs know other formats than HDF5
FOREIGN = frozenset(
    ".vtk .vtp .vtu .pvd .csv .txt .dat .json .npz .npy .stl .obj .ply .msh .png .pdf .svg .jpg .gif .mp4 .py .xml .zip".split()
)


def named(path, what, right, also=""):
    """The path as text; raises FileError if its ending belongs to another format than HDF5. right: ending to give."""
    if not isinstance(path, (str, bytes, os.PathLike)):
        raise ValueError(f"path of {what} is {path!r}: give the name of a file that ends in {right}")
    path = os.fspath(path)
    ending = os.path.splitext(path)[1].lower()
    if ending in FOREIGN:
        remedy = f"give a name that ends in {right}{also}"
        raise FileError(path, f"{what} is an HDF5 file, and this name ends in {ending}", remedy)
    return path


def why(error):
    """Meaning of an OSError in words, with its remedy: (problem, remedy)."""
    import errno

    known = {
        errno.ENOSPC: ("the disk is full", "free some space, or write to another disk"),
        errno.EDQUOT: ("the disk quota is used up", "free some space, or write to another disk"),
        errno.EFBIG: ("the file may not grow any further", "raise the limit on file sizes (ulimit -f)"),
        errno.EACCES: ("permission denied", "choose a folder you may write to, or change its permissions"),
        errno.EPERM: ("permission denied", "choose a folder you may write to, or change its permissions"),
        errno.EROFS: ("the file system is read-only", "choose another folder"),
        errno.ENOENT: ("no such file or folder", "check the path, or make the folder first"),
        errno.ENOTDIR: ("a part of the path is not a folder", "check the path"),
        errno.EISDIR: ("this is a folder", "give the name of a file"),
    }
    return known.get(error.errno, (error.strerror or str(error), "look at the disk and the path, or write to another disk"))


def as_file_error(path, error, writing=False):
    """The FileError for `error`, an OSError at `path`. writing: true if the file was to be created."""
    if isinstance(error, FileError):
        return error
    problem, remedy = why(error)
    folder = os.path.dirname(os.fspath(path)) or "."
    if writing and isinstance(error, FileNotFoundError) and os.path.isdir(folder):  # e.g. /proc, which accepts no files
        problem, remedy = f"cannot be written: the folder {folder} takes no files", "choose another folder"
    result = FileError(path, problem, remedy)
    result.errno = error.errno
    return result
