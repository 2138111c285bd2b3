"""Run as a program: the groups and arrays of an HDF5 file, written again without compression and in the oldest layout.

    python plain_hdf5.py FROM TO SECONDS

It runs in a process of its own: the HDF5 library may loop without end or stop its process on a damaged file. It ends after
SECONDS, whoever waits for it, and with 1 and a line on the standard error where h5py refuses the file.
"""

import os
import signal
import sys

import h5py

# deflate makes at most about a thousand bytes of one
MOST_BYTES_OF_ONE = 4096


def copy(source, target, most, within=()):
    """Copies groups, arrays of numbers and texts of source; raises ValueError for a dataset larger than the file can hold."""
    for name in source:
        member = source[name]
        if isinstance(member, h5py.Group):
            if member.id in within:
                raise ValueError(f"{member.name} contains itself")
            copy(member, target.create_group(name), most, (*within, member.id))
        elif isinstance(member, h5py.Dataset):
            if member.nbytes > most:
                raise ValueError(f"{member.name} is larger than the file can hold")
            target.create_dataset(name, data=member[()], dtype=member.dtype)


def main():
    """The program."""
    path, target, seconds = sys.argv[1:]
    signal.setitimer(signal.ITIMER_REAL, float(seconds))
    try:
        with h5py.File(path, "r") as file, h5py.File(target, "w", libver="earliest") as plain:
            copy(file, plain, MOST_BYTES_OF_ONE * os.path.getsize(path))
    except Exception as error:  # any exception of h5py on a damaged file
        sys.exit(f"{type(error).__name__}: {error}")


if __name__ == "__main__":
    main()
