"""Routines from users' shared libraries, written in Fortran, C or whatever makes a library with C names."""

from __future__ import annotations

import os

from .. import _core
from ..model import laws
from ..names import listed
from ..pre import checks


class Routine:
    """A body force or a free velocity from a library, for Simulation.plug. params: {name: value}."""

    def __init__(self, kind, name, core, params):
        self.kind, self.name, self.params, self._core = kind, name, params, core

    def __repr__(self):
        return f"<{self.kind} {self.name} {self.params}>"


class Pair:
    """The contact of a pair of shapes from a library, in the place of the built-in one until `remove`."""

    def __init__(self, name, of):
        self.name, self.of = name, of

    def remove(self):
        """The built-in routine again."""
        _core.unplug_pair(self.of)


KINDS = {"solver": 2, "pair": 3, "velocity": 4, "force": 5, "body": 6}


def plug(library, *, law=None, solver=None, pair=None, velocity=None, force=None, material=None, body=None, of=None, params=None,
         replace=False, thread_safe=True, state=0, routine="umat", plane=None, isolate=False, time_limit=None):  # fmt: skip
    """A routine from a shared library, which describes it by `cairn_describe_NAME` (cairn/plug.h, module cairn_plug).

    library: path of the library. One of the others is the NAME, and says what the routine is and what comes back:

    law: a contact law, ready for Scene.interact; without params its class, `Mine = plug("libmine.so", law="mine")`,
    `Mine(mu=0.4)`. replace: take the place of the law of that name, a built-in one too, in all simulations from now on.
    thread_safe=False: the law is never called by two threads at once, whatever its descriptor says.
    solver: a contact solver: its class, `NSCD(solver=Mine(tol=1e-6))`; cairn.problems knows its name too.
    pair: the contact of a pair of shapes; of: which built-in one it replaces in NSCD from now on, "disk_disk", ...; a Pair.
    velocity, force: the free velocity of bodies, a force on them: a Routine for Simulation.plug.
    material: a name of your choice for a routine of Abaqus's interface UMAT in the library, whose symbol is `routine` (an
    underscore may follow), with `state` numbers STATEV at each point: a function of its PROPS that gives a material of
    SolidBody, `Mine = plug("libumat.so", material="mine", state=7)`, `SolidBody(points, cells, Mine(2e11, 0.3))`. It is
    called as Abaqus/Standard calls it, at large strains as with NLGEOM: Cauchy's stress in axes of the scene, see
    docs/solids.md. It needs no descriptor. plane="stress": the routine is written for elements of plane stress (NDI = 2,
    NTENS = 3) and finds the strain across for itself; it is for bodies of plane="stress" alone. isolate=True: it runs in a
    process of its own, so that its STOP, a fault of its memory, or a call (of the points of 16 cells) that takes longer than
    time_limit (60 s) is an error that names the cell. Laws have the same by `cairn wrap-law`.
    body: forces of a deformable body and their tangent, for CallbackBody; without params a function of these,
    `Rubber = plug("librubber.so", body="rubber")`, `CallbackBody(points, mass, Rubber(mu=1e5), pattern=pattern)`.
    params: values in the order of the descriptor, or a dict.

    Raises ValueError when the library or its descriptor is missing or does not fit this Cairn, naming what and the remedy.
    """
    given = dict(law=law, solver=solver, pair=pair, velocity=velocity, force=force, material=material, body=body)
    asked = {kind: name for kind, name in given.items() if name is not None}
    if len(asked) != 1:
        raise ValueError(f"give one of {', '.join(f'{k}=' for k in given)}; there are {', '.join(asked) or 'none'}")
    [(kind, name)] = asked.items()
    if not isinstance(name, str) or not name:
        raise ValueError(f"{kind} is {name!r}: give the name that the library describes")
    path = os.fspath(library)
    if os.path.exists(path):
        path = os.path.abspath(path)
    elif os.sep in path:
        raise ValueError(f"{path}: there is no such file; build the library first")
    if plane is not None and (kind != "material" or plane != "stress"):
        raise ValueError(f"plane is {plane!r}: give 'stress' with material= for a UMAT of plane stress, NDI = 2, or leave it out")
    if isolate and kind != "material":
        raise ValueError(f"isolate is for material=, not for {kind}=: of a law, wrap its routine by cairn wrap-law, with isolate")
    if time_limit is not None and not isolate:
        raise ValueError(f"time_limit is {time_limit!r}, of a routine in a process of its own: give isolate=True, too")
    if kind == "material":
        from ..model.bulk import plugged_material

        states = checks.count("state", state, 0, checks.INT32)
        limit = checks.positive("time_limit", 60.0 if time_limit is None else time_limit) if isolate else 0.0
        return plugged_material(path, routine, name, states, plane == "stress", limit)
    if kind == "law":
        return _law(path, name, params, replace, thread_safe)
    routine = _core.PluggedRoutine(path, name, KINDS[kind])
    if kind == "pair":
        routine.plug_pair(str(of))
        return Pair(name, of)
    if kind == "body":
        from ..model.callbacks import CalledRoutine

        parameters = routine.described()["parameters"]
        if params is None:
            return lambda **given: CalledRoutine(name, routine, _values(name, parameters, given))
        return CalledRoutine(name, routine, _values(name, parameters, params))
    values = _values(name, routine.described()["parameters"], params)
    if kind == "solver":
        from ..run import strategies

        routine.plug_solver(list(values.values()))
        return strategies.solver_class(name, name, f"a contact solver from {path}")
    return Routine(kind, name, routine, values)


def _values(name, parameters, params):
    """{parameter: value} of what was given, refused when out of range."""
    names = [p[0] for p in parameters]
    if params is not None and not isinstance(params, dict):
        params = list(params)
        if len(params) != len(names):
            raise ValueError(f"params has {len(params)} values and {name} takes {len(names)}: {', '.join(names) or 'none'}")
        params = dict(zip(names, params))
    params = params or {}
    for word in params:
        if word not in names:
            raise ValueError(f"{name} has no parameter {word!r}; it has {listed(names, word)}")
    values = {}
    for word, standard, smallest, largest in parameters:
        value = params.get(word, standard)
        if value is None:
            raise ValueError(f"parameter {word} of {name} is missing: it has no default")
        values[word] = checks.number(word, value)
        if not smallest <= values[word] <= largest:
            raise ValueError(f"{word} is {value}: {name} takes {smallest:g} to {largest:g}")
    return values


def _law(path, law, params, replace, thread_safe):
    found = laws.plugged_class(*_core.plug_law(path, law, bool(replace), not thread_safe))
    if params is None:
        return found
    if isinstance(params, dict):
        return found(**params)
    params = list(params)
    names = found.parameter_names
    if len(params) != len(names):
        raise ValueError(
            f"params has {len(params)} values and {law} takes {len(names)}: {', '.join(names) or 'none'}; give them in this order"
        )
    return found(**dict(zip(names, params)))
