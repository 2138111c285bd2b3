"""Checkpoints: a nested dict of arrays, numbers and text in an HDF5 file, replaced as a whole or not at all.

Bits come back as they were: NaN with their payload, -0.0, subnormal numbers. A checksum over names, types, shapes and
bytes is stored and checked, so that a damaged checkpoint is refused instead of restarted from.
"""

import hashlib
import json
import os

import h5py
import numpy as np

from .errors import FileError, as_file_error, named
from .exclusive import create_beside, remove_stale

FORMAT_NAME = "cairn-checkpoint"
FORMAT_VERSION = (1, 0)


def checkpoint_path(run_path):
    """Where the checkpoint of a run stands: beside it, <run>.checkpoint.h5 (run without its .vtkhdf)."""
    stem, extension = os.path.splitext(os.fspath(run_path))
    return (stem if extension == ".vtkhdf" else os.fspath(run_path)) + ".checkpoint.h5"


def save(path, state, what="a checkpoint"):
    """Write `state`, a nested dict of arrays, numbers, text, None and lists of these, to `path`.

    The file is written under another name, brought to the disk, then renamed: at every instant `path` is the old
    checkpoint or the new one. Raises FileError (full disk, no permission ...), TypeError for what cannot be stored.
    """
    path = named(path, what, ".h5")
    folder, name = os.path.split(path)
    made = descriptor = None
    try:
        remove_stale(folder or ".", f".{name}.")
        descriptor, made = create_beside(folder or ".", name)
        # built in memory: HDF5 does not survive a disk that fills up under it
        with h5py.File(name, "w", driver="core", backing_store=False, libver=("earliest", "v110")) as file:
            digest = hashlib.blake2b(digest_size=32)
            group = file.create_group("state")
            _store(group, state, digest, "")
            file.attrs["format"], file.attrs["version"] = FORMAT_NAME, FORMAT_VERSION
            file.attrs["checksum"] = digest.hexdigest()
            file.flush()
            image = file.id.get_file_image()
        with open(descriptor, "wb", closefd=False) as out:
            out.write(image)
            out.flush()
            os.fsync(out.fileno())
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(made, 0o666 & ~umask)
        os.replace(made, path)
        made = None
        _sync_folder(folder or ".")
    except OSError as error:
        raise as_file_error(path, error) from error
    finally:
        if descriptor is not None:
            os.close(descriptor)
        if made is not None and os.path.lexists(made):
            os.unlink(made)


def load(path, what="a checkpoint", given=".checkpoint.h5"):
    """The state that `save` wrote, bit for bit.

    Raises FileError if there is no such file, it is truncated, damaged, something else or of a later format.
    """
    path = os.fspath(path)
    try:
        with open(path, "rb") as file:
            start = file.read(8)
    except OSError as error:
        raise as_file_error(path, error) from error
    remedy = "restart from an earlier checkpoint" if what == "a checkpoint" else "write it again"
    if start != b"\x89HDF\r\n\x1a\n":
        raise FileError(path, f"this is not {what}", f"give a {given} file that Cairn wrote")
    try:
        with h5py.File(path, "r") as file:
            _check_format(path, file, what, given)
            digest = hashlib.blake2b(digest_size=32)
            state = _read(file["state"], digest, "")
            if digest.hexdigest() != file.attrs["checksum"]:
                raise FileError(path, f"{what.replace('a ', 'the ', 1)} is damaged: its checksum does not match", remedy)
            return state
    except FileError:
        raise
    except (OSError, KeyError, RuntimeError, ValueError, TypeError) as error:
        raise FileError(path, f"{what.replace('a ', 'the ', 1)} is truncated or damaged ({error})", remedy) from error


def _check_format(path, file, what, given):
    if file.attrs.get("format") != FORMAT_NAME:
        raise FileError(path, f"this HDF5 file is not {what}", f"give a {given} file that Cairn wrote")
    version = tuple(int(n) for n in file.attrs["version"])
    if version[0] > FORMAT_VERSION[0]:
        raise FileError(
            path,
            f"the checkpoint has format version {version[0]}.{version[1]}, this Cairn reads up to {FORMAT_VERSION[0]}",
            "use a newer Cairn",
        )


def _sync_folder(folder):
    """Bring the new name itself to the disk."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _take_in(digest, place, kind, value):
    array = np.ascontiguousarray(value)
    digest.update(f"{place}|{kind}|{array.dtype.str}|{array.shape}|".encode())
    digest.update(array.tobytes())


def _store(group, state, digest, place):
    for name in sorted(state):
        if not isinstance(name, str) or not name or "/" in name:
            raise TypeError(f"checkpoint: '{place}/{name}' cannot be a name; use text without '/'")
        value, here = state[name], f"{place}/{name}"
        if isinstance(value, dict):
            digest.update(f"{here}|dict|".encode())
            _store(group.create_group(name), value, digest, here)
            continue
        kind, array = _encode(here, value)
        dataset = group.create_dataset(name, data=array)
        dataset.attrs["kind"] = kind
        _take_in(digest, here, kind, array)


def _encode(here, value):
    """(kind, array): arrays and numpy numbers as they are, all else as JSON or text."""
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        return "array", value
    if isinstance(value, np.generic) and value.dtype.kind in "biuf":
        return "number", np.asarray(value)
    if isinstance(value, np.ndarray) and value.dtype.kind == "U":
        return "texts", np.frombuffer(json.dumps(value.tolist()).encode(), np.uint8)
    if isinstance(value, float):
        return "float", np.float64(value)  # JSON has no NaN
    if isinstance(value, bytes):
        return "bytes", np.frombuffer(value, np.uint8)
    try:
        return "json", np.frombuffer(json.dumps(value, allow_nan=False).encode(), np.uint8)
    except (TypeError, ValueError) as error:
        raise TypeError(
            f"checkpoint: {here} is a {type(value).__name__} that cannot be stored ({error}); "
            "use arrays, numbers, text, lists or dicts"
        ) from None


def _read(group, digest, place):
    state = {}
    for name in sorted(group):
        member, here = group[name], f"{place}/{name}"
        if isinstance(member, h5py.Group):
            digest.update(f"{here}|dict|".encode())
            state[name] = _read(member, digest, here)
            continue
        array, kind = np.asarray(member[()]), member.attrs["kind"]
        _take_in(digest, here, kind, array)
        state[name] = _decode(kind, array)
    return state


def _decode(kind, array):
    if kind == "array":
        return array
    if kind == "number":
        return array[()]
    if kind == "float":
        return float(array)
    if kind == "bytes":
        return array.tobytes()
    value = json.loads(array.tobytes().decode())
    return np.array(value) if kind == "texts" else value
