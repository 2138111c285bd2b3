"""What can go wrong with a file, said so that a user can act on it."""


class FileError(OSError):
    """A file cannot be read or written.

    The message names the path, what was wrong and what to do; `path`, `problem` and `remedy` hold the same apart.
    """

    def __init__(self, path, problem, remedy=""):
        self.path, self.problem, self.remedy = str(path), problem, remedy
        super().__init__(f"{self.path}: {problem}" + (f"; {remedy}" if remedy else ""))


def why(error):
    """What an OSError means, in words, with its remedy: (problem, remedy)."""
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
    return known.get(error.errno, (error.strerror or str(error), ""))


def as_file_error(path, error):
    """The FileError that tells of `error`, an OSError met at `path`."""
    if isinstance(error, FileError):
        return error
    problem, remedy = why(error)
    result = FileError(path, problem, remedy)
    result.errno = error.errno
    return result
