"""Problems of compas_dem solved by Cairn: `import cairn_compas` gives compas_dem a `Solver.Cairn`, which `Problem.solve` finds.

    problem.set_solver(Solver.Cairn(duration=0.5, n_steps=250))
    results = problem.solve()

`cairn_compas.solve(problem, ...)` is the same without a solver, `cairn_compas.build(problem, ...)` the simulation before its
first step. Lengths, masses and forces are SI, strengths and stiffnesses of materials MPa, as compas_dem has them.
"""

from .register import Solver, register
from .scene import Built, build
from .solve import solve

__all__ = ["Built", "Solver", "build", "register", "solve"]

register()
