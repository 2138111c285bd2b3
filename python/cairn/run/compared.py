"""Arguments of the calls that all ranks make, as texts by which ranks compare them."""

import dataclasses
import hashlib

import numpy as np

MOST_SHOWN = 48  # letters of a value in a message


def call_of(name, given):
    """Text of a call: its name, its arguments as messages show them, and their digest, in a line each.

    A function of time that is none of Cairn's has no text: of it, ranks compare that it is one.
    """
    digest = hashlib.blake2b(digest_size=8)
    for key, value in given.items():
        digest.update(f"|{key}|".encode())
        digest.update(content_of(value))
    shown = ", ".join(f"{key}={_shown(value)}" for key, value in given.items())
    return f"{name}\n{shown}\n{digest.hexdigest()}"


def arrays_of(sets):
    """{name: array} of sets of bodies, by which ranks compare them; those of several sets are numbered."""
    names = ("position", "rotation", "mass", "inertia", "velocity")
    found = ((f"{name}[{k}]" if len(sets) > 1 else name, getattr(s, name, None)) for k, s in enumerate(sets) for name in names)
    return {name: array for name, array in found if array is not None}


def state_told(state):
    """{name: value} of a state that get_state gave, by which ranks compare it: its step, its time and a digest."""
    digest = hashlib.blake2b(digest_size=8)
    _add(digest, state)
    shown = {name: state[name] for name in ("steps", "time") if isinstance(state, dict) and name in state}
    return {**shown, "state": digest.hexdigest()}


def file_told(path):
    """{name: value} of a file that each rank reads, which may have another name on each: its size and a digest of its bytes."""
    try:
        with open(path, "rb") as file:
            digest = hashlib.blake2b(digest_size=8)
            while block := file.read(1 << 20):
                digest.update(block)
            return {"bytes": file.tell(), "content": digest.hexdigest()}
    except (OSError, TypeError, ValueError) as error:  # of all ranks alike: told when the file is read
        return {"file": f"cannot be read, {type(error).__name__}"}


def _add(digest, value):
    """Adds nested dicts of arrays to a digest, an array at a time."""
    if isinstance(value, dict):
        for key in sorted(value, key=str):
            digest.update(f"|{key}{{".encode())
            _add(digest, value[key])
        digest.update(b"}")
    elif isinstance(value, np.ndarray) and value.dtype.kind != "O":
        digest.update(f"{value.shape}{value.dtype}".encode())
        digest.update(np.ascontiguousarray(value).data)
    else:
        digest.update(content_of(value))


def content_of(value):
    """Bytes that differ where values do."""
    if isinstance(value, dict):
        pairs = sorted(value.items(), key=lambda pair: str(pair[0]))
        return b"{" + b"|".join(content_of(part) for pair in pairs for part in pair) + b"}"
    if isinstance(value, (list, tuple)) and not _is_numbers(value):
        return b"[" + b"|".join(content_of(part) for part in value) + b"]"
    if hasattr(value, "to_dict"):
        return type(value).__name__.encode() + content_of(value.to_dict())
    if isinstance(getattr(value, "given", None), dict):  # bodies of meshes
        return type(value).__name__.encode() + content_of(value.given)
    if callable(value):
        return b"function"
    if dataclasses.is_dataclass(value):  # joints: arrays in their texts are rounded
        return type(value).__name__.encode() + content_of({f.name: getattr(value, f.name) for f in dataclasses.fields(value)})
    if isinstance(value, np.ndarray) and value.dtype.kind == "O":
        return f"{value.shape}".encode() + content_of(value.tolist())
    if isinstance(value, (np.ndarray, np.generic, float, int)) or _is_numbers(value):
        array = np.ascontiguousarray(value)
        if array.dtype.kind == "O":  # whole numbers of more than 64 bits, of which the array holds addresses
            return repr(value).encode()
        return f"{array.shape}".encode() + np.asarray(array, float if array.dtype.kind in "iu" else array.dtype).tobytes()
    text = repr(value)  # of an object without a text of its own, ranks compare the class
    return (type(value).__name__ if text == object.__repr__(value) else text).encode()


def _is_numbers(value):
    return isinstance(value, (list, tuple)) and all(isinstance(part, (int, float, np.number)) for part in value)


def _shown(value):
    """A value in a message, on one line: large arrays by their shape and digest."""
    if callable(value) and not hasattr(value, "to_dict"):
        return "a function"
    mark = hashlib.blake2b(content_of(value), digest_size=3).hexdigest()
    if isinstance(value, np.ndarray) and value.size > 4:
        return f"{' x '.join(map(str, value.shape))} numbers ({mark})"
    if isinstance(getattr(value, "given", None), dict):
        return f"{type(value).__name__} ({mark})"
    if isinstance(value, dict):
        text = "{" + ", ".join(f"{key!r}: {_shown(part)}" for key, part in value.items()) + "}"
    else:
        text = " ".join(repr(value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value).split())
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}... ({mark})"
