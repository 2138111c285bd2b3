"""Flow through a graph of conductances, without a scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _core
from ..base import checks
from ..names import one_of

METHODS = ("auto", "direct", "multigrid")


@dataclass(frozen=True, eq=False)
class Flow:
    """Solution on a graph. potential (n,) [V | K], nan if undetermined; current (m,) of each branch from its first end [A | W];
    report, a dict: status, method, components, floating, open (number of unknowns in components without a reference whose sources
    do not balance), iterations, residual."""

    potential: np.ndarray
    current: np.ndarray
    report: dict


def _branches(branches, conductance, n):
    pairs = np.asarray(branches)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or (pairs.size and pairs.dtype.kind not in "iu"):
        raise ValueError(f"branches has shape {pairs.shape}: give whole numbers (m, 2), the unknowns that each joins")
    c = np.asarray(conductance, float)
    if c.shape not in ((), (len(pairs),)):
        raise ValueError(f"conductance has shape {c.shape}: give a number, or one for each of the {len(pairs)} branches")
    c = np.broadcast_to(c, (len(pairs),))
    if np.any(np.isnan(c)) or np.any(c < 0):
        raise ValueError(f"conductance[{int(np.argmax(~(c >= 0)))}] is {c[np.argmax(~(c >= 0))]}: give values from 0 to inf")
    return pairs.astype(np.int32), np.ascontiguousarray(c), int(pairs.max(initial=-1)) + 1 if n is None else checks.count("n", n)


def solve(branches, conductance, *, source=None, potential=None, leak=None, n=None, method="auto", tol=1e-12, max_iter=1000):
    """Solves Kirchhoff's laws on a graph: sum of conductance times differences = source, at each of n unknowns. Returns a Flow.

    branches: (m, 2) unknowns. conductance: (m,) or a number, from 0 to inf [S | W/K]. source: (n,), or {unknown: value}, inflow
    [A | W]. potential: {unknown: value}, held [V | K]. leak: (n,) conductance to a ground at 0. n: number of unknowns, by default
    as many as branches name. method: "direct", "multigrid" (preconditioned conjugate gradients, of linear cost) or "auto". tol:
    on the largest residual of an unknown over the largest flow through an unknown. The potential of a component without a held
    value or leak is 0 at its first unknown.
    """
    pairs, c, n = _branches(branches, conductance, n)
    one_of("method", method, METHODS)
    given = np.zeros(n)
    if isinstance(source, dict):
        for unknown, value in source.items():
            given[checks.count("unknown of source", unknown, 0, n - 1)] += checks.number("source", value)
    elif source is not None:
        given = checks.real_array("source", source, (n,))
    held, x = np.zeros(n, bool), np.zeros(n)
    for unknown, value in (potential or {}).items():
        held[checks.count("unknown of potential", unknown, 0, n - 1)] = True
        x[unknown] = checks.number("potential", value)
    leak = np.zeros(n) if leak is None else checks.real_array("leak", leak, (n,))
    most = checks.count("max_iter", max_iter, 1)
    return Flow(*_core.Conduction().solve(pairs[:, 0], pairs[:, 1], c, leak, held, given, x, method, tol, most))


def resistance(branches, conductance, pairs, **options):
    """Resistance between pairs (k, 2) of unknowns of a graph, (k,) [ohm | K/W]; inf without a path. options: as of `solve`."""
    pairs = np.atleast_2d(np.asarray(pairs))
    out = np.zeros(len(pairs))
    for k, (i, j) in enumerate(pairs.tolist()):
        if i == j:
            continue
        flow = solve(branches, conductance, source={i: 1.0, j: -1.0}, **options)
        out[k] = np.inf if np.isnan(flow.potential[i]) else flow.potential[i] - flow.potential[j]
    return out
