"""Checksums of files: what `cairn info --check` does.

Headers carry the checksum of HDF5, which every reader looks at; arrays the attribute crc32 over their rows, in the order of the
rows, which is looked at here alone: it takes as long as reading the file.
"""

from ..base.errors import FileError, told_as_damage
from . import checkpoint
from .hdf5 import File, Group


def check(path):
    """Checks the checksum of each array: numbers of right and of unchecked ones. Raises FileError for the first damaged."""
    with File(path) as file, told_as_damage(path):
        if file.attrs.get("format") == checkpoint.FORMAT_NAME:
            checkpoint.load(path, "the file")
            return {"of all": "right"}
        right, without = 0, 0
        for array in _arrays(file, ()):
            if "crc32" not in array.attrs:
                without += 1
            elif array._core.data_checksum() != array.attrs["crc32"]:
                raise FileError(path, f"{array.name} is damaged: its checksum does not match", "use a copy of it")
            else:
                right += 1
    return {"right": f"{right} arrays"} | ({"unknown": f"{without} arrays, of a file that has none"} if without else {})


def _arrays(group, within):
    """Every array below a group; links to places elsewhere are left out."""
    if group._core.address in within:
        raise ValueError(f"{group.name} contains itself: the file is damaged")
    for name, member in group.items():
        if group._core.soft_link(name) is not None:
            continue
        if isinstance(member, Group):
            yield from _arrays(member, (*within, group._core.address))
        else:
            yield member
