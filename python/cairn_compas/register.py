"""Registration with compas_dem, whose Problem.solve knows its solvers by a list of names."""

from __future__ import annotations

import functools

try:
    from compas_dem.problem import Problem, Solver
except ImportError as error:  # told here, where the extra that brings it is known
    raise ImportError("compas_dem is needed for cairn_compas: pip install compas_dem") from error

from .scene import told_joint
from .solve import checked_options, solve

NAME = "Cairn"


def _solver(cls, **options):
    """Configures the solver Cairn.

    Parameters
    ----------
    **options : optional
        Options of `cairn_compas.solve`: two of duration, n_steps and dt, theta, urf_threshold, deformable, joint and others.

    Returns
    -------
    compas_dem.problem.Solver
        The solver; it is plain data, and is saved and loaded with its problem.

    Raises
    ------
    ValueError
        If there is no such option.
    """
    checked_options(options)
    made = cls()
    made.name = NAME
    made.parameters = {**options, **({"joint": told_joint(options["joint"])} if options.get("joint") is not None else {})}
    return made


def register():
    """Adds `Solver.Cairn`, and has `Problem.solve` find it; all other names go where they went before. It acts once."""
    if hasattr(Solver, NAME):
        return
    others = Problem.solve

    @functools.wraps(others)
    def found(self, **runtime_options):
        chosen = self._solver
        if chosen is None or chosen.name != NAME:
            return others(self, **runtime_options)
        return solve(self, **{k: v for k, v in chosen.parameters.items() if v is not None} | runtime_options)

    Problem.solve = found
    setattr(Solver, NAME, classmethod(_solver))
