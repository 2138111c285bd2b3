"""Arguments of the calls that all ranks make, as texts by which ranks compare them."""

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
        digest.update(_content(value))
    shown = ", ".join(f"{key}={_shown(value)}" for key, value in given.items())
    return f"{name}\n{shown}\n{digest.hexdigest()}"


def _content(value):
    """Bytes that differ where values do."""
    if isinstance(value, dict):
        return b"|".join(_content(part) for pair in sorted(value.items()) for part in pair)
    if isinstance(value, (list, tuple)) and not _is_numbers(value):
        return b"|".join(_content(part) for part in value)
    if hasattr(value, "to_dict"):
        return type(value).__name__.encode() + _content(value.to_dict())
    if callable(value):
        return b"function"
    if isinstance(value, (np.ndarray, np.generic, float, int)) or _is_numbers(value):
        array = np.ascontiguousarray(value)
        return f"{array.shape}".encode() + np.asarray(array, float if array.dtype.kind in "iu" else array.dtype).tobytes()
    return repr(value).encode()


def _is_numbers(value):
    return isinstance(value, (list, tuple)) and all(isinstance(part, (int, float, np.number)) for part in value)


def _shown(value):
    """A value in a message, on one line: large arrays by their shape and digest."""
    if callable(value) and not hasattr(value, "to_dict"):
        return "a function"
    mark = hashlib.blake2b(_content(value), digest_size=3).hexdigest()
    if isinstance(value, np.ndarray) and value.size > 4:
        return f"{' x '.join(map(str, value.shape))} numbers ({mark})"
    text = " ".join(repr(value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value).split())
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}... ({mark})"
