"""Collapse load of a structure by simulation: bisection on the tilt or the load between stable and collapsing, beside the bound
of limit analysis."""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from ..base import checks
from ..names import teach
from ..pre.blocks import Blocks
from .limit_analysis import Assembly
from .masonry import Structure

G = 9.81


@dataclass(frozen=True)
class Collapse:
    """multiplier: of the load at the fall, between `stands` and `falls`; limit: that of limit analysis, with joints that dilate
    as they slide; trials: of each (multiplier, stands, acceleration over gravity, status of the solver)."""

    multiplier: float
    stands: float
    falls: float
    limit: float
    trials: list

    @property
    def angle(self):
        """Tilt of a table whose slope is the multiplier [rad]."""
        return float(np.arctan(self.multiplier))


def collapse_multiplier(
    blocks: Blocks,
    mu,
    load="tilt",
    *,
    towards=None,
    density=2400.0,
    low=0.0,
    high=None,
    tol=0.005,
    dt=2e-3,
    steps=5,
    creep=1e-4,
    strategy=None,
    progress=True,
) -> Collapse:
    """Largest multiplier of a load under which blocks stay at rest, by bisection of simulations that begin at rest.

    load: "tilt", a table whose slope is the multiplier, so that things slide along `towards` (dim,), +x unless told; "push", that
    share of each block's weight along `towards`, gravity as it is; or forces (n, dim) [N], or (n, 3 | 6) with moments about the
    centres, that are multiplied. low, high: where to look, from 0 to 1.05 of the limit unless told; tol: width at the end over
    high; a structure moves when after `steps` steps of dt [s] a block's mean acceleration is above `creep` of gravity.
    strategy: of the simulations. progress: a line on each trial to the standard error.

    Coulomb's law may have a state of rest that a simulation which begins without impulses does not take (see the documentation on
    limit analysis): the multiplier is that of structures that are loaded at once.
    """
    creep, tol, high_given = checks.positive("creep", creep), checks.positive("tol", tol), high is not None
    assembly = Assembly(blocks, mu, density=density)
    live, way = live_load(blocks, assembly, load, towards)
    found = assembly.collapse(live)
    limit = found.multiplier
    nowhere = found.status == "infeasible"
    if not high_given:
        if found.status != "optimal" and not nowhere:
            told = ", no load makes it fall" * (found.status == "unbounded")
            raise ValueError(f"limit analysis ends as {found.status!r}{told}: give high, the largest multiplier to try")
        high = checks.number("low", low) + 1.0 if nowhere else 1.05 * limit  # nowhere: given below, or an error
    low, high = checks.number("low", low), checks.number("high", high)
    if not low < high:
        raise ValueError(f"low is {low} and high {high}: give low below high")
    trials, width = [], tol * high

    def upright(multiplier):
        s = loaded(blocks, mu, density, load, way, live, multiplier, dt, strategy)
        for _ in range(checks.count("steps", steps, 1)):
            s.simulation.step()
        share = s.balance()["speed"] / (G * s.simulation.time)
        status = s.simulation.info["status"]
        trials.append((multiplier, share <= creep, share, status))
        if progress:
            word = "stands" if share <= creep else f"moves at {share:.2g} g"
            odd = "" if status == "converged" else f" ({status}: error {s.simulation.info['error']:.1g})"
            print(f"multiplier {multiplier:.5g}: {word}{odd}", file=sys.stderr, flush=True)
        return share <= creep

    if not upright(low):
        if nowhere:
            told = "limit analysis finds no joint forces that balance it under any load of this kind"
            raise ValueError(f"the structure falls under its own weight, {told}: it needs supports, thickness or friction")
        raise ValueError(f"it moves under low = {low:g} of the load already (limit analysis: {limit:g}): give a lower one")
    if nowhere and not high_given:
        told = "limit analysis finds no state of rest" + ", since its friction in 3D is below Coulomb's" * (blocks.dim == 3)
        raise ValueError(f"it stands under low = {low:g} of the load, and {told}: give high, the largest multiplier to try")
    if upright(high):
        raise ValueError(f"it stands under high = {high:g} of the load (limit analysis: {limit:g}): give a higher one")
    while high - low > width:
        middle = (low + high) / 2
        low, high = (middle, high) if upright(middle) else (low, middle)
    return Collapse((low + high) / 2, low, high, float(limit), trials)


def live_load(blocks, assembly, load, towards):
    """Resultants (n, 3 | 6) of the load of multiplier 1, and the unit vector along which it pushes."""
    dim = blocks.dim
    way = np.eye(dim)[0] if towards is None else checks.real_array("towards", towards, (dim,))
    if not np.linalg.norm(way) > 0 or way[-1] != 0:
        raise ValueError(f"towards is {way}: give a horizontal vector (dim,) of non-zero length")
    way = way / np.linalg.norm(way)
    if isinstance(load, str):
        if load not in ("tilt", "push"):
            raise ValueError(f'load is {load!r}: give "tilt", "push" or forces (n, dim) [N]')
        return assembly.loads(assembly.mass[:, None] * G * way), way
    load = np.asarray(load, float)
    if load.shape == (len(blocks), dim):
        load = assembly.loads(load)
    return checks.real_array("load", load, (len(blocks), dim + assembly.rotations)), way


def loaded(blocks, mu, density, load, way, live, multiplier, dt, strategy):
    """A Structure at rest under its weight and a multiple of the load."""
    from .. import NLGS, NSCD, Coulomb, Material, Scene, Simulation

    dim = blocks.dim
    down = -G * np.eye(dim)[-1]
    tilt = isinstance(load, str) and load == "tilt"
    gravity = (down + multiplier * G * way) / np.hypot(1.0, multiplier) if tilt else down
    scene = Scene(dim, gravity=gravity)
    sets, rows = blocks.sets(Material("stone", density=density))
    if not tilt:
        order = np.argsort(rows)
        first = np.cumsum([0] + [len(s) for s in sets])
        sets = [s.with_(force=multiplier * live[order[a:b]]) for s, a, b in zip(sets, first[:-1], first[1:])]
    ids = scene.add(*sets)[rows]
    scene.interact("*", "*", Coulomb(mu=mu))
    strategy = NSCD(theta=1.0, solver=NLGS(tol=1e-8, max_iter=50_000)) if strategy is None else strategy
    return Structure(blocks, Simulation(scene, dt=dt, strategy=strategy), ids)


teach(globals())
