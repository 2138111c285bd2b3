"""A parameter study of physics: one script, many values of its parameters, all results in one table.

A study is a TOML file:

    script = "heap.py"            # defines run(parameters) -> {name: number}
    samples = 40                  # of a Latin hypercube; without it, all combinations of the lists (a grid)
    seed = 1

    [parameters]
    mu = [0.1, 0.3, 0.5]          # values
    radius = { low = 0.01, high = 0.1, log = true }     # a range: of a Latin hypercube alone

Each point is a call of `run` in another process. Finished points are written to results.csv at once, so that a stopped study
resumes. The message of a point that fails is in the column `failed`; the others go on.
"""

from __future__ import annotations

import csv
import hashlib
import itertools
import json
import math
import os
import runpy
import sys
import time
import tomllib
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, ProcessPoolExecutor, wait
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

from ..base.errors import FileError, as_file_error
from ..names import listed
from .pool import ONE_THREAD, cores
from .scripts import see_beside, words_of

NAME = "results.csv"
KEYS = ("script", "parameters", "samples", "seed")
RANGE = ("low", "high", "log")
OWN = ("point", "cpu_seconds", "failed")  # columns of the table that no result may be called


class SweepError(ValueError):
    """A study file, or the value returned by its script, is invalid."""


@dataclass
class Plan:
    """Contents of a study file. points: a list of {parameter: value}, in the order in which they are run."""

    script: Path
    points: list = field(default_factory=list)

    @property
    def parameters(self):
        """Names of the parameters."""
        return list(self.points[0]) if self.points else []


def read(path):
    """The Plan of a study file. Raises FileError if it cannot be read, SweepError with the entry that is wrong."""
    path = Path(path)
    try:
        with open(path, "rb") as file:
            content = tomllib.load(file)
    except OSError as error:
        raise as_file_error(path, error) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise FileError(path, f"this is no TOML ({error})", "see 'cairn sweep --help' for what a study file looks like") from None
    for name in content:
        if name not in KEYS:
            raise SweepError(f"{path}: there is no entry {name!r}; there are {listed(KEYS, name)}")
    script, parameters = content.get("script"), content.get("parameters")
    if not isinstance(script, str):
        raise SweepError(f"{path}: script is missing: name the .py file that defines run(parameters)")
    if not isinstance(parameters, dict) or not parameters:
        raise SweepError(f"{path}: [parameters] is missing or empty: give each parameter a list of values or a range")
    script = path.parent / script
    if not script.is_file():
        raise FileError(script, "no such script", f"script in {path} is taken from where that file lies")
    samples, seed = content.get("samples"), content.get("seed", 0)
    for name, value, least in (("samples", samples, 1), ("seed", seed, 0)):
        if value is not None and (isinstance(value, bool) or not isinstance(value, int) or value < least):
            raise SweepError(f"{path}: {name} is {value!r}: give a whole number of at least {least}")
    for name, values in parameters.items():
        _check(path, name, values, samples)
    points = _grid(parameters) if samples is None else _hypercube(parameters, samples, seed)
    return Plan(script, points)


def _check(path, name, values, samples):
    where = f"{path}: parameter {name!r}"
    if name in OWN:
        raise SweepError(f"{where} bears the name of a column of the table: choose another")
    if isinstance(values, list):
        if not values or not all(isinstance(v, (int, float, str, bool)) for v in values):
            raise SweepError(f"{where} is {values!r}: give a list of numbers, words or true and false")
        if any(isinstance(v, float) and not math.isfinite(v) for v in values):
            raise SweepError(f"{where} holds a value that is not finite")
        return
    if not isinstance(values, dict):
        raise SweepError(f"{where} is {values!r}: give a list of values, or a range {{ low = ..., high = ... }}")
    for key in values:
        if key not in RANGE:
            raise SweepError(f"{where} has no {key!r}; a range has {listed(RANGE, key)}")
    low, high = values.get("low"), values.get("high")
    for key, value in (("low", low), ("high", high)):
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            raise SweepError(f"{where}: {key} is {value!r}: give a finite number")
    if not low < high:
        raise SweepError(f"{where}: low is {low!r} and high {high!r}: low must be the smaller")
    if values.get("log", False) not in (True, False) or (values.get("log") and low <= 0):
        raise SweepError(f"{where}: a range in logarithms (log = true) needs a low above 0")
    if samples is None:
        raise SweepError(f"{where} is a range: say how many points to draw, samples = 40, or give a list of values")


def _grid(parameters):
    return [dict(zip(parameters, values)) for values in itertools.product(*parameters.values())]


def _hypercube(parameters, samples, seed):
    """Points of a Latin hypercube (McKay, Beckman & Conover 1979), by scipy: each range is cut into as many parts as there are
    points, and each part is met once. Lists are cut likewise."""
    try:
        from scipy.stats import qmc
    except ImportError as error:
        raise ImportError("a Latin hypercube needs scipy: pip install scipy") from error
    drawn = qmc.LatinHypercube(d=len(parameters), seed=seed).random(samples)
    points = []
    for row in drawn:
        point = {}
        for x, (name, values) in zip(row, parameters.items()):
            if isinstance(values, list):
                point[name] = values[min(int(x * len(values)), len(values) - 1)]
            elif values.get("log"):
                point[name] = float(math.exp(math.log(values["low"]) * (1 - x) + math.log(values["high"]) * x))
            else:
                point[name] = float(values["low"] * (1 - x) + values["high"] * x)
        points.append(point)
    return points


def key_of(words, point):
    """Key of a row of the table: hash of the script, of modules beside it, and of the values of the point."""
    return hashlib.sha256(words + json.dumps(point, sort_keys=True).encode()).hexdigest()[:12]


def sweep(path, folder=None, processes=None, dask=None, progress=None):
    """Runs the unfinished points of a study. Returns the path of its table.

    path : of the study file. folder : where results.csv goes (default: beside the study, its name without .toml).
    processes : side by side, one thread each (default: as many as cores). dask : address of a Dask scheduler whose workers do
        the work instead.
    progress : called with (done, all) after each point.

    Raises FileError, SweepError; KeyboardInterrupt leaves a table that is whole, and the next call goes on from there.
    """
    plan = read(path)
    folder = Path(folder) if folder else Path(path).with_suffix("")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise as_file_error(folder, error, writing=True) from error
    table = _Table(folder / NAME, plan)
    words = words_of(plan.script)
    left = [(key, point) for point in plan.points if (key := key_of(words, point)) not in table.done]
    total = len(plan.points)
    if progress:
        progress(total - len(left), total)
    finished = total - len(left)

    def gather(points, count):
        """Runs points side by side; returns those whose process ended before they did, or beside one that did so."""
        nonlocal finished
        broken = []
        with _workers(dask, count) as pool:
            waiting = {pool.submit(_one, str(plan.script.absolute()), point): (key, point) for key, point in points}
            try:
                while waiting:
                    done, _ = wait(waiting, return_when=FIRST_COMPLETED)
                    for future in done:
                        key, point = waiting.pop(future)
                        if isinstance(future.exception(), BrokenExecutor):
                            broken.append((key, point))
                            continue
                        table.add(key, point, *future.result())
                        finished += 1
                        if progress:
                            progress(finished, total)
            except BaseException:
                for future in waiting:
                    future.cancel()
                raise
        return broken

    for key, point in gather(left, min(processes or cores(), len(left) or 1)):
        if gather([(key, point)], 1):  # alone, so that it is known which point ends its process
            table.add(key, point, {}, 0.0, "the process ended: the script, or a library that it uses, stopped it")
            finished += 1
    return table.path


def _workers(dask, processes):
    if dask:
        try:
            from distributed import Client
        except ImportError as error:
            raise ImportError("a cluster needs Dask: pip install distributed") from error
        return Client(dask).get_executor()
    import multiprocessing

    return ProcessPoolExecutor(processes, mp_context=multiprocessing.get_context("spawn"), initializer=_alone)


def _alone():
    """A worker has one thread, and leaves Ctrl-C to the process that gathers."""
    import signal

    os.environ.update(ONE_THREAD)
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _one(script, point):
    """Results of one point, its CPU seconds, and why it failed or ''."""
    before = time.process_time()
    try:
        see_beside(script)
        run = runpy.run_path(script, run_name="__sweep__").get("run")
        if not callable(run):
            raise SweepError("the script defines no function run(parameters)")
        results = run(dict(point))
        if not isinstance(results, dict):
            raise SweepError(f"run returned {type(results).__name__}: return a dict of numbers")
        out = {}
        for name, value in results.items():
            if name in OWN or name in point:
                raise SweepError(f"run returned {name!r}, which is a parameter or a column of the table: call it otherwise")
            out[str(name)] = value if isinstance(value, str) else float(value)
        return out, time.process_time() - before, ""
    except Exception as error:
        return {}, time.process_time() - before, " ".join(f"{type(error).__name__}: {error}".split())


class _Table:
    """results.csv: a row a point. It is written anew through a file beside it, so that it is whole at every instant."""

    def __init__(self, path, plan):
        self.path, self._parameters, self._rows = path, plan.parameters, {}
        if path.exists():
            with open(path, newline="") as file:
                for row in csv.DictReader(file):
                    if row.get("point") and not row.get("failed"):
                        self._rows[row["point"]] = row
        words = words_of(plan.script)
        wanted = {key_of(words, point) for point in plan.points}
        # rows of another script or plan are not of this study
        self._rows = {key: row for key, row in self._rows.items() if key in wanted}

    @property
    def done(self):
        return set(self._rows)

    def add(self, key, point, results, seconds, failed):
        self._rows[key] = {"point": key, **point, **results, "cpu_seconds": f"{seconds:.3g}", "failed": failed}
        named = dict.fromkeys(name for row in self._rows.values() for name in row)
        results = [name for name in named if name not in OWN and name not in self._parameters]
        part = self.path.with_suffix(".part")
        try:
            with open(part, "w", newline="") as file:
                writer = csv.DictWriter(file, ["point", *self._parameters, *results, "cpu_seconds", "failed"], restval="")
                writer.writeheader()
                writer.writerows(self._rows.values())
            os.replace(part, self.path)
        except OSError as error:
            raise as_file_error(self.path, error, writing=True) from error


class _Called(ModuleType):
    """This module, which sweeps when it is called: cairn.study.sweep("study.toml")."""

    def __call__(self, *given, **named):
        return sweep(*given, **named)


sys.modules[__name__].__class__ = _Called
