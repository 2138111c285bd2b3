"""Kernels of core_f90 called alone, with numpy arrays: their arguments are those that core.h says."""

import atexit
import ctypes
import functools
import os
import re
from pathlib import Path

import numpy as np
import pytest
from cairn import _core

HEADERS = Path(__file__).resolve().parents[2] / "core_f90" / "include" / "cairn"
TYPES = {"int8_t": (ctypes.c_int8, np.int8), "int16_t": (ctypes.c_int16, np.int16), "int32_t": (ctypes.c_int32, np.int32),
         "int64_t": (ctypes.c_int64, np.int64), "double": (ctypes.c_double, np.float64)}  # fmt: skip
CALLED = set()  # names of kernels
if "CAIRN_KERNELS_CALLED" in os.environ:  # test_kernels_all.py counts the kernels that have a twin
    atexit.register(lambda: Path(os.environ["CAIRN_KERNELS_CALLED"]).write_text("\n".join(sorted(CALLED))))
PROTOTYPE = re.compile(r"^(?:typedef )?(void|double|int32_t|int64_t) (cairn_\w+)\(([^;{]*?)\);", re.M | re.S)


@functools.cache
def prototypes():
    """{kernel: (return type, [(type, whether a pointer)])} of the headers."""
    text = "".join(path.read_text(encoding="utf-8") for path in sorted(HEADERS.rglob("*.h")))
    found = {}
    for result, name, arguments in PROTOTYPE.findall(re.sub(r"/\*.*?\*/|\\\n", " ", text, flags=re.S)):
        words = [re.sub(r"\bconst\b", "", a).split() for a in arguments.split(",")]
        found[name] = result, [(w[0].rstrip("*"), "*" in "".join(w)) for w in words]
    return found


def rows(name, macro):
    """Fields of each row of a list of core_f90 (elements/elements.def), as words."""
    text = (HEADERS.parents[1] / name).read_text(encoding="utf-8")
    for row in re.findall(rf"^{macro}\((.*)\)$", text, re.M):
        yield [field.strip().strip('"') for field in re.findall(r'\s*("[^"]*"|[^,"]+)\s*(?:,|$)', row)]


class Context(ctypes.Structure):
    """Context of a law in a step: geometry is (3, n), area, effective radius, effective mass."""

    _fields_ = [("h", ctypes.c_double), ("theta", ctypes.c_double), ("geometry", ctypes.c_void_p), ("fields", ctypes.c_void_p)]


def kernel(name, like=None):
    """A function of numbers, arrays (C order, the last index of the Fortran declaration first; None where one is left out).
    like: the form that the header gives to rows of a list, such as cairn_law_prepare."""
    library = ctypes.CDLL(_core.__file__)
    if not hasattr(library, name):
        pytest.skip(f"this build does not show {name}")
    result, arguments = prototypes()[like or name]
    function = getattr(library, name)
    function.restype = None if result == "void" else TYPES[result][0]
    function.argtypes = [ctypes.c_void_p if pointer else TYPES[kind][0] for kind, pointer in arguments]

    def call(*given):
        CALLED.add(name)
        assert len(given) == len(arguments), f"{name} takes {len(arguments)} arguments"
        ready = []
        for value, (kind, pointer) in zip(given, arguments):
            if isinstance(value, Context):
                value = ctypes.addressof(value)
            elif pointer and value is not None:
                assert isinstance(value, np.ndarray) and value.flags.c_contiguous, (name, kind, value)
                assert kind not in TYPES or value.dtype == TYPES[kind][1], (name, kind, value.dtype)
                value = value.ctypes.data
            ready.append(value)
        return function(*ready)

    return call
