"""Frictional contact problems on their own: build, solve, measure, read and write.

from cairn import problems

p = problems.read("box.hdf5")
result = p.solve(tol=1e-8)
print(result.status, result.error, result.solver)
"""

from .problem import Problem, Result, solvers

__all__ = ["Problem", "Result", "solvers"]
