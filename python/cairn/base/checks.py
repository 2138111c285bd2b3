"""Refusals shared by the generators: each names the field, the index, the value and what would be right."""

from __future__ import annotations

import inspect
import math
import operator

import numpy as np


def generator(rng) -> np.random.Generator:
    """A numpy Generator from itself or from a whole seed; nothing is drawn from a hidden seed."""
    if isinstance(rng, np.random.Generator):
        return rng
    if isinstance(rng, (int, np.integer)) and not isinstance(rng, bool) and rng >= 0:
        return np.random.default_rng(int(rng))
    raise ValueError(f"rng is {rng!r}: give numpy.random.default_rng(seed) or a seed >= 0, so that a scene can be made again")


def count(name: str, value, smallest: int = 0, largest: int = 2**53) -> int:
    """A whole number from `smallest` to `largest`, which is what a double counts exactly unless it is given."""
    try:
        whole = operator.index(value)
    except TypeError:
        whole = None
    if whole is None or isinstance(value, (bool, np.bool_)) or whole < smallest:
        raise ValueError(f"{name} is {value!r}: give a whole number >= {smallest}")
    if whole > largest:
        raise ValueError(f"{name} is {value!r}: give a whole number from {smallest} to {largest}")
    return whole


def axis(name: str, value, dim: int) -> int:
    """Number of an axis of the plane or of space: "x", "y", "z"."""
    known = "xyz"[:dim]
    if not isinstance(value, str) or len(value) != 1 or value not in known:
        raise ValueError(f"{name} is along {value!r}: in {dim}D give {', '.join(known)}")
    return known.index(value)


def fixed_axes(group, axes, dim: int) -> list[int]:
    """Numbers of the axes along which a group is fixed, given as "xy"."""
    if not isinstance(axes, str):
        raise ValueError(f"fixed of {group!r} is {axes!r}: give axes, such as {'xyz'[:dim]!r}")
    return [axis(f"fixed of {group!r}", one, dim) for one in axes]


INT32 = 2**31 - 1  # the largest whole number that an int of the core holds


def flag(name: str, value) -> bool:
    """True or False, and nothing that Python takes for one of them."""
    if not isinstance(value, (bool, np.bool_)):
        raise ValueError(f"{name} is {value!r}: give True or False")
    return bool(value)


def dimension(value) -> int:
    """2 or 3."""
    try:
        return count("dim", value, 2, 3)
    except ValueError:
        raise ValueError(f"dim is {value!r}: give 2 (disks) or 3 (spheres)") from None


def node_numbers(name: str, value, nodes: int) -> np.ndarray:
    """Numbers of nodes, given as these or by a mask of all of them; a negative one or one that the mesh has not is refused."""
    found = np.atleast_1d(np.asarray(value))
    if found.dtype.kind == "b":
        if found.shape != (nodes,):
            told = f"{name} is a mask of shape {found.shape}"
            raise ValueError(f"{told}: give numbers of nodes, or a mask ({nodes},) of all of them")
        return np.flatnonzero(found)
    if found.dtype.kind not in "iu" and found.size:
        with np.errstate(invalid="ignore"):
            if found.dtype.kind != "f" or not np.all(found == np.floor(found)) or not np.all(np.isfinite(found)):
                wrong = found.ravel() if found.dtype.kind != "f" else found[(found != np.floor(found)) | ~np.isfinite(found)]
                raise ValueError(f"{name} has {wrong[0]!r}: give numbers of nodes, from 0")
    beyond = found[(found < 0) | (found >= nodes)]
    if beyond.size:
        raise ValueError(f"{name} names node {beyond[0]:g}: the mesh has {nodes} nodes, from 0")
    return found.astype(int)


def body_ids(ids) -> np.ndarray:
    """Ids (n,) of bodies. Raises ValueError unless they are whole numbers that a body may have."""
    try:  # numpy makes real numbers of whole ones that no int64 and no uint64 holds together
        array = np.atleast_1d(np.asarray(ids, object if isinstance(ids, (list, tuple)) else None))
    except (ValueError, TypeError):
        array = np.array([None])
    flat = array.ravel().tolist() if array.dtype.kind not in "iu" else ()
    whole = all(isinstance(i, (int, np.integer)) and not isinstance(i, bool) for i in flat)
    if array.ndim != 1 or not whole:
        raise ValueError(f"ids is {ids!r}: give whole numbers (n,), as Scene.add and Simulation.add return them")
    beyond = [i for i in array.tolist() if not -(2**63) <= i < 2**63] if array.dtype.kind in "uO" else []
    if beyond:
        raise ValueError(f"there is no body {beyond[0]}; it was never added, or was removed")
    return array.astype(np.int64)


def node_groups(groups, nodes: int) -> dict:
    """Groups of a mesh of so many nodes, {name: numbers}."""
    if groups is not None and not isinstance(groups, dict):
        raise ValueError(f"groups is {groups!r}: give {{name: numbers of nodes}}")
    return {name: node_numbers(f"the group {name!r}", of, nodes) for name, of in (groups or {}).items()}


def number(name: str, value, finite: bool = True) -> float:
    """A real number; no text, no truth value and no complex number, even where Python would make a number of it."""
    wanted = "a finite number" if finite else "a number"
    try:
        if isinstance(value, (str, bytes, bool, np.bool_)) or np.iscomplexobj(value):
            raise TypeError
        real = float(value)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} is {value!r}: give {wanted}") from None
    if not math.isfinite(real) and (finite or math.isnan(real)):
        raise ValueError(f"{name} is {value!r}: give {wanted}")
    return real


def positive(name: str, value) -> float:
    """A finite number above zero."""
    real = number(name, value)
    if real <= 0.0:
        raise ValueError(f"{name} is {value!r}: give a number > 0")
    return real


def interval(low_name: str, low, high_name: str, high) -> tuple[float, float]:
    """Two positive numbers in order; they may be equal."""
    low, high = positive(low_name, low), positive(high_name, high)
    if low > high:
        raise ValueError(f"{low_name} is {low!r}, above {high_name} = {high!r}: exchange them")
    return low, high


def reals(name: str, values, hint: str = "give real numbers") -> np.ndarray:
    """An array of doubles, finite or not, of any shape; whole numbers become doubles, truth values and complex numbers do not."""
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "fiu" and array.size:
            raise TypeError
        return np.asarray(array, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} is not an array of real numbers: {hint}") from None


def real_array(name: str, values, shape: tuple[int | None, ...]) -> np.ndarray:
    """A contiguous array of finite doubles of the given shape; None stands for any length."""
    array = np.asarray(reals(name, values, f"give numbers of shape {shape_text(shape)}"), order="C")
    fits = array.ndim == len(shape) and all(s is None or s == n for s, n in zip(shape, array.shape))
    if not fits:
        raise ValueError(f"{name} has shape {array.shape}: give shape {shape_text(shape)}")
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        index = tuple(int(i) for i in bad[0])
        raise ValueError(
            f"{name}[{', '.join(map(str, index))}] is {array[index]}: give finite numbers ({len(bad)} of {array.size} are not)"
        )
    return array


FASTEST = 2.0**500  # [m/s, rad/s]: energies take the squares of velocities


def speeds(name: str, array) -> np.ndarray:
    """The finite velocities themselves; refuses those whose squares are too large for numbers."""
    bad = np.argwhere(np.abs(array) > FASTEST)
    if len(bad):
        index = tuple(int(i) for i in bad[0])
        told = f"{name}[{', '.join(map(str, index))}] is {array[index]:g}"
        raise ValueError(f"{told}: energies take its square, which is too large for a number; give less than 3e150")
    return array


def rayleigh(values) -> tuple[float, float]:
    """a [1/s] and b [s] of damping a M + b K."""
    a, b = real_array("rayleigh", values, (2,)).tolist()
    if min(a, b) < 0:
        raise ValueError(f"rayleigh is ({a:g}, {b:g}): give a, b >= 0 of C = a M + b K")
    return a, b


def positive_array(name: str, values) -> np.ndarray:
    """A (n,) array of finite doubles above zero."""
    array = real_array(name, values, (None,))
    bad = np.flatnonzero(array <= 0.0)
    if len(bad):
        raise ValueError(f"{name}[{bad[0]}] is {array[bad[0]]}: give numbers > 0 ({len(bad)} of {array.size} are not)")
    return array


def spread(name: str, value, shape: tuple[int, ...], unit: str = "") -> np.ndarray:
    """Finite doubles of the given shape from a number, from one row, or from a whole array."""
    array = reals(name, value, f"give numbers of shape {shape_text(shape)}{unit}")
    if array.shape not in ((), shape[1:], shape):
        one = "a number" if len(shape) == 1 else f"one of shape {shape_text(shape[1:])} for all"
        raise ValueError(f"{name} has shape {array.shape}: give {one}, or {shape_text(shape)}{unit}")
    return real_array(name, np.broadcast_to(array, shape).copy(), shape)


def function_of_time(name: str, function, arguments: str = "the time t [s]") -> None:
    """Refuses functions that cannot be called with one argument, before a step calls them."""
    try:
        parameters = inspect.signature(function)
    except (TypeError, ValueError):  # functions of compiled modules do not tell
        return
    try:
        parameters.bind(0.0)
    except TypeError:
        raise ValueError(f"{name} takes {parameters}: give a function of one argument, {arguments}") from None


def shape_text(shape: tuple[int | None, ...]) -> str:
    """(None, 2) -> "(n, 2)"."""
    names = iter("nmkl")
    words = [next(names) if s is None else str(s) for s in shape]
    return f"({words[0]},)" if len(words) == 1 else f"({', '.join(words)})"
