"""Frictional contact problems on their own: build, solve, measure, read and write.

from cairn import problems

p = problems.read("box.hdf5")
result = p.solve(tol=1e-8)
print(result.status, result.error, result.solver)
problems.write("solved.hdf5", p, result)
"""

from ..names import teach
from . import fclib, text
from .fclib import ProblemFileError, read_solution, reduce_global
from .problem import Problem, Result, solvers

__all__ = ["Problem", "ProblemFileError", "Result", "read", "read_solution", "reduce_global", "solvers", "write"]


def read(path):
    """The Problem of a file: FCLIB's layout in HDF5 (local or global), or Siconos's in text (.dat, .txt)."""
    return text.read(path) if _is_text(path) else fclib.read(path)


def write(path, problem, result=None):
    """Writes a problem: text if the name ends in .dat or .txt, else FCLIB's HDF5, with the (r, u) of a Result if given."""
    if not _is_text(path):
        fclib.write(path, problem, result)
    elif result is not None:
        raise ValueError(f"{path}: the text layout holds no solution; give a name that ends in .hdf5")
    else:
        text.write(path, problem)


def _is_text(path):
    return str(path).endswith((".dat", ".txt"))

teach(globals(), __all__)
