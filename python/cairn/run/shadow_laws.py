"""Shadows of contact laws with a local solution of their own: impulses and states of the same contacts by a second law."""

from __future__ import annotations

import math

import numpy as np

from .. import _core
from ..model.laws import Law
from .views import core_of

STAGES = {"contact_laws": "impulses and states of laws with a solution of their own"}


def checked(simulation, kernel, of):
    """Law to be shadowed: a Law for the contacts with its parameters, or a class for all contacts of that law. Raises ValueError
    if it is ambiguous or the kernel does not fit it."""
    known = _asked(simulation)
    if of is None and isinstance(kernel, Law) and any(type(kernel) is type(law) for law in known):
        of = type(kernel)
    if of is None:
        if len({type(law) for law in known}) != 1:
            said = ", ".join(sorted({type(law).__name__ for law in known})) or "none"
            raise ValueError(f"of is None, and of laws with a solution of their own the scene has {said}: give of=cairn.MAC, or "
                             "the law of a rule with its parameters")  # fmt: skip
        of = type(known[0])
    chosen = of if isinstance(of, type) else type(of)
    if not (issubclass(chosen, Law) and any(isinstance(law, chosen) for law in known)):
        raise ValueError(f"of is {of!r}: give a law of the scene that has a solution of its own, or its class")
    if isinstance(kernel, Law):
        mine, own = _listed()[chosen.row], _listed()[kernel.row]
        if not own["solves"] or own["components"] != mine["components"]:
            said = "has no solution of its own" if not own["solves"] else f"has other components than {chosen.__name__}"
            raise ValueError(f"kernel is {kernel!r}, which {said}: give a law of the kind of {chosen.__name__}, or a function")
        if kernel.of_temperature:
            raise ValueError(f"kernel is {kernel!r}: give a law whose parameters do not depend on temperature")
        missing = [name for name in own["state"] if name not in mine["state"]]
        if missing:
            raise ValueError(f"kernel is {kernel!r}, whose state {missing[0].rstrip('*')!r} {chosen.__name__} has not: "
                             "give a law whose states are those of the law beside it, or a function")  # fmt: skip
    return of


def _asked(simulation):
    """Laws in the rules of a simulation with a local solution of their own."""
    listed = _listed()
    return [law for _, _, law in simulation._rules if law is not None and law.name != "joint" and listed[law.row]["solves"]]


def _listed():
    return _core.laws()  # includes plugged laws


def columns_of(law, dim):
    """{name of a state variable: slice of its columns} for a law or its class."""
    out, at = {}, 0
    for name in _listed()[law.row]["state"]:
        width = dim - 1 if name.endswith("*") else 1
        out[name.rstrip("*")] = slice(at, at + width)
        at += width
    return out


def given_of(simulation, of):
    """Input of a kernel on contacts before they are committed: gap (n,), impulse, velocity, velocity_free, bias (n, c), delassus
    (n, c, c), parameters and state {name: (n,) or (n, dim - 1)}, area, radius, mass (n,), h, theta, dim, law; candidate (n,):
    rows in simulation.contacts."""
    rows, dim = core_of(simulation).law_rows(of.row), simulation.scene.dim
    n, c = len(rows.candidate), rows.components
    names = _listed()[of.row]["parameters"]
    given = {"law": of.name, "dim": dim, "h": rows.h, "theta": rows.theta, "candidate": rows.candidate}
    given["gap"] = rows.gap.reshape(n)
    given |= {name: getattr(rows, name).reshape(c, n).T for name in ("impulse", "velocity", "velocity_free", "bias")}
    given["delassus"] = rows.delassus.reshape(c, c, n).transpose(2, 1, 0)
    given |= dict(zip(("area", "radius", "mass"), rows.geometry.reshape(-1, n), strict=False))
    given["parameters"] = {row[0]: rows.params.reshape(len(names), n)[k] for k, row in enumerate(names)}
    given["state"] = _named(rows.state, columns_of(of, dim), n)
    given["chosen"] = np.ones(n, bool)
    if isinstance(of, Law):
        largest = np.finfo(float).max  # laws get the largest number for an infinite parameter
        for name, value in zip(of.parameter_names, of.values):
            given["chosen"] &= given["parameters"][name] == min(value, largest)
    given["rows"] = rows
    return given


def _named(state, columns, n):
    state = state.reshape(-1, n)
    return {name: state[at].T if at.stop - at.start > 1 else state[at.start].copy() for name, at in columns.items()}


def asked(kernel, of):
    """Kernel (a function of the input) that evaluates a law alone; kernel "reference": the law `of` the contacts itself."""
    law = of if kernel == "reference" else kernel

    def answer(given):
        rows, dim, n = given["rows"], given["dim"], len(given["gap"])
        own = given["parameters"].values() if kernel == "reference" else [np.full(n, value) for value in law.values]
        values = np.array(list(own)).reshape(-1, n)
        columns = columns_of(law, dim)
        state = np.array([row for name in columns for row in np.atleast_2d(given["state"][name].T)]).reshape(-1, n)
        largest = np.finfo(float).max
        impulse, after = rows.answer(law.row, dim, np.ascontiguousarray(np.minimum(values, largest)), np.ascontiguousarray(state))
        return {"impulse": impulse.reshape(-1, n).T, **_named(after, columns, n)}

    return answer


def _scale(shadow, given, mine, name):
    """Scale of the differences of a quantity: its largest value in this step. For impulses and moments the largest of all steps
    so far, at least a millionth of the impulse that would stop a contact, since smaller impulses (of bonds in free flight) are
    rounding."""
    if name not in ("impulse", "moment"):
        return max(np.abs(mine).max(initial=0.0), np.abs(given["state"][name]).max(initial=0.0))
    part = slice(None, given["dim"]) if name == "impulse" else slice(given["dim"], None)
    stop = np.abs(given["velocity_free"]) / np.einsum("nkk->nk", given["delassus"])
    shadow.scales[name] = max(np.abs(mine).max(initial=0.0), shadow.scales.get(name, 0.0))
    return max(shadow.scales[name], 1e-6 * stop[:, part].max(initial=0.0))


def difference(simulation, shadow, given):
    """(largest difference / scale, id of the first body of that contact, result of the kernel); updates shadow.columns, the
    largest difference of each quantity."""
    other, dim = shadow.kernel(given), given["dim"]
    after = given_of(simulation, shadow.of)["state"]
    mine = {"impulse": given["impulse"], **after}
    if not isinstance(other, dict) or not other or not set(other) <= set(mine):
        said = sorted(other) if isinstance(other, dict) else type(other).__name__
        raise ValueError(f"the shadow of contact_laws gave {said}: give a dict of some of {', '.join(mine)}")
    worst, at = 0.0, -1
    for name, two in other.items():
        two = np.asarray(two, float)
        if two.shape != mine[name].shape:
            raise ValueError(f"the shadow of contact_laws gave {name} of shape {two.shape}: {mine[name].shape} was expected")
        parts = [(name, mine[name], two)]
        if name == "impulse" and two.shape[1] > dim:
            parts = [("impulse", mine[name][:, :dim], two[:, :dim]), ("moment", mine[name][:, dim:], two[:, dim:])]
        for column, one, beside in parts:
            apart = np.abs(one - beside).reshape(len(one), -1).max(axis=1, initial=0.0)
            apart = np.where(np.isfinite(beside).reshape(len(one), -1).all(axis=1), apart, np.inf)
            apart = np.where(given["chosen"], apart, 0.0)
            largest, scale = apart.max(initial=0.0), _scale(shadow, given, one, column)
            found = 0.0 if not largest > 0 else float(largest / scale) if scale > 0 else math.inf
            shadow.columns[column] = max(shadow.columns.get(column, 0.0), found)
            if found > worst:
                worst, at = found, int(simulation.contacts.bodies[given["candidate"][int(np.argmax(apart))], 0])
    return worst, at, other
