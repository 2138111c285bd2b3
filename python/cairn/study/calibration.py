"""Calibration by GrainLearning 2: a callback that runs a script for every sample of the parameters.

The script is that of a sweep: it defines run(parameters) -> {name: number, or numbers over the control data}. The callback
rests on attributes of GrainLearning's objects alone; GrainLearning itself is not imported.
"""

from __future__ import annotations

import os
import runpy
import warnings
from concurrent.futures import BrokenExecutor
from pathlib import Path

import numpy as np

from ..base.errors import FileError
from ..names import listed
from .pool import cores
from .scripts import see_beside
from .sweep import _workers

FAR = 1e6  # of the observations: how far from them the results of a failed run are said to be, which gives it no weight


class CalibrationError(ValueError):
    """Samples of which all failed, or a system without names of parameters or observations."""


class GrainLearning:
    """Callback of grainlearning.BayesianCalibration that runs a script for every sample, in other processes.

    A run that fails is a status, and the calibration goes on: its sample gets results so far from the observations that it has
    no weight. A warning tells how many failed, and `failed` why.

    Parameters
    ----------
    script : path-like
        A .py file that defines run(parameters), which returns {name of an observation: number, or one for each step}.
    processes : int, optional
        Runs side by side, one thread each; as many as cores when not given.
    dask : str, optional
        Address of a Dask scheduler whose workers do the work instead.

    Raises
    ------
    FileError
        If there is no such script.
    """

    def __init__(self, script, processes=None, dask=None):
        self.script = Path(script).absolute()
        if not self.script.is_file():
            raise FileError(self.script, "no such script", "give a .py file that defines run(parameters)")
        self.processes, self.dask = processes, dask
        self.failed = []  # a dict for each iteration: {number of the failed sample: reason}

    def __call__(self, calibration):
        """Runs the samples of an iteration and hands their results over.

        Parameters
        ----------
        calibration : grainlearning.BayesianCalibration
            The calibration.

        Raises
        ------
        CalibrationError
            If the system has no names, or all samples fail.
        """
        system = calibration.system
        if not system.param_names or not system.obs_names:
            raise CalibrationError("the system has no param_names or no obs_names: the script takes and returns values by name")
        points = [dict(zip(system.param_names, map(float, row))) for row in system.param_data]
        shape = (len(system.obs_names), system.num_steps)
        done = self._run(points, list(system.obs_names), shape)
        self.failed.append({k: why for k, (_, why) in enumerate(done) if why})
        bad = self.failed[-1]
        if bad:
            first = next(iter(bad))
            told = f"{len(bad)} of {len(points)} samples failed, sample {first} with {points[first]}: {bad[first]}"
            if len(bad) == len(points):
                raise CalibrationError(told)
            warnings.warn(f"{told}; they have no weight", stacklevel=2)
        observed = np.asarray(system.obs_data, float)
        size = np.max(np.abs(observed), axis=1, keepdims=True)
        away = observed + FAR * np.where(size > 0, size, 1.0)
        system.set_sim_data([away if k in bad else values for k, (values, _) in enumerate(done)])

    def _run(self, points, names, shape):
        """(results, reason of a failure or '') of each point."""
        out = [None] * len(points)

        def gather(numbers, count):
            with _workers(self.dask, count) as pool:
                waiting = [(k, pool.submit(_observed, str(self.script), points[k], names, shape)) for k in numbers]
                for k, future in waiting:
                    if not isinstance(future.exception(), BrokenExecutor):
                        out[k] = future.result()
            return [k for k in numbers if out[k] is None]

        for k in gather(range(len(points)), min(self.processes or cores(), len(points))):
            if gather([k], 1):  # alone, so that it is known which sample ends its process
                out[k] = None, "the process ended: the script, or a library that it uses, stopped it"
        return out


def _observed(script, point, names, shape):
    """Results of one sample, (observations, steps), and why it failed or ''."""
    os.environ.setdefault("MPLBACKEND", "Agg")
    try:
        see_beside(script)
        run = runpy.run_path(script, run_name="__sweep__").get("run")
        if not callable(run):
            raise CalibrationError("the script defines no function run(parameters)")
        results = run(dict(point))
        missing = [name for name in names if not isinstance(results, dict) or name not in results]
        if missing:
            there = listed(list(results), missing[0]) if isinstance(results, dict) else type(results).__name__
            raise CalibrationError(f"run returned no {missing[0]!r}: there is {there}")
        values = np.empty(shape)
        for row, name in zip(values, names):
            given = np.asarray(results[name], float)
            if given.shape not in ((), row.shape):
                raise CalibrationError(f"{name!r} has shape {given.shape}: give a number, or {row.shape} of all steps")
            row[:] = given
        if not np.all(np.isfinite(values)):
            raise CalibrationError(f"{names[int(np.argmin(np.isfinite(values).all(axis=1)))]!r} is not finite")
        return values, ""
    except Exception as error:
        return None, " ".join(f"{type(error).__name__}: {error}".split())
