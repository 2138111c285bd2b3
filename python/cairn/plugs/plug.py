"""Routines from users' shared libraries, in Fortran, C or another language with C linkage."""

from __future__ import annotations

import os

from .. import _core
from ..base import checks
from ..model import laws
from ..names import listed


class Routine:
    """A body force or a free velocity from a library, for Simulation.plug.

    Parameters
    ----------
    kind : str
        Kind, "force" or "velocity".
    name : str
        Name of the routine in the library.
    core : _core.PluggedRoutine
        The loaded routine.
    params : dict
        Parameters by name.
    """

    def __init__(self, kind, name, core, params):
        self.kind, self.name, self.params, self._core = kind, name, params, core

    def __repr__(self):
        return f"<{self.kind} {self.name} {self.params}>"


class Pair:
    """Contact detection of a pair of shapes from a library, which replaces the built-in routine until `remove`.

    Parameters
    ----------
    name : str
        Name of the routine in the library.
    of : str
        The built-in routine that it replaces.
    """

    def __init__(self, name, of):
        self.name, self.of = name, of

    def remove(self):
        """Restores the built-in routine."""
        _core.unplug_pair(self.of)


SOURCES = (".f", ".for", ".f90", ".f95", ".f03", ".f08", ".c", ".cc", ".cpp", ".cxx")
KINDS = {"solver": 2, "pair": 3, "velocity": 4, "force": 5, "body": 6}


def plug(library, *, law=None, solver=None, pair=None, velocity=None, force=None, material=None, body=None, of=None, params=None,
         replace=False, thread_safe=True, state=0, routine="umat", plane=None, isolate=False, time_limit=None):  # fmt: skip
    """Loads a routine from a shared library, which describes it by `cairn_describe_NAME` (cairn/plug.h, module cairn_plug).

    Exactly one of law, solver, pair, velocity, force, material and body holds the NAME of the routine; it sets its kind and the
    result.

    Parameters
    ----------
    library : path-like
        Path of the library.
    law : str, optional
        A contact law. Without params its class is returned: `Mine = plug("libmine.so", law="mine")`, `Mine(mu=0.4)`.
    solver : str, optional
        A contact solver, whose class is returned: `NSCD(solver=Mine(tol=1e-6))`; cairn.problems knows its name too.
    pair : str, optional
        Contact detection of a pair of shapes, which replaces `of`.
    velocity : str, optional
        The free velocity of bodies, for Simulation.plug.
    force : str, optional
        A force on bodies, for Simulation.plug.
    material : str, optional
        A name of your choice for a UMAT (Abaqus's interface) in the library; it needs no descriptor. `Mine = plug("libumat.so",
        material="mine", state=7)` makes materials of SolidBody of its PROPS: `SolidBody(points, cells, Mine(2e11, 0.3))`. The
        UMAT is called as by Abaqus/Standard, at large strains with NLGEOM: Cauchy stress in axes of the scene, see
        docs/solids.md.
    body : str, optional
        Forces and tangent of a deformable body, for CallbackBody. Without params a function of these is returned:
        `Rubber = plug("librubber.so", body="rubber")`, `CallbackBody(points, mass, Rubber(mu=1e5), pattern=pattern)`.
    of : str, optional
        The built-in routine that a pair replaces in NSCD, "disk_disk" and others.
    params : sequence or dict, optional
        Values in the order of the descriptor, or by name.
    replace : bool, default False
        Replaces the law of that name, even a built-in one, in all simulations from now on.
    thread_safe : bool, default True
        False: never calls the law from two threads at once, whatever its descriptor says.
    state : int, default 0
        Number of STATEV of a UMAT at each point.
    routine : str, default "umat"
        Symbol of a UMAT, with or without an underscore at the end.
    plane : {"stress"}, optional
        For a UMAT written for plane stress (NDI = 2, NTENS = 3), which finds the out-of-plane strain itself; it is for bodies
        with plane="stress" only.
    isolate : bool, default False
        Runs a UMAT in a separate process, so that its STOP, a memory fault, or a call longer than time_limit becomes an error
        that names the cell. For laws `cairn wrap-law` offers the same.
    time_limit : float, optional
        Limit of a call, for the points of 16 cells, of an isolated UMAT [s]; 60 when not given.

    Returns
    -------
    Law, type, Pair, Routine or callable
        Depends on the kind: a law or its class, the class of a solver, a Pair, a Routine, a function that makes materials or
        bodies' routines.

    Raises
    ------
    ValueError
        If the library or its descriptor is missing or does not fit this version; the message names cause and remedy.
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
    if os.path.splitext(path)[1].lower() in SOURCES:
        built = "gfortran" if path.lower().rpartition(".")[2].startswith("f") else "g++" if path.endswith("p") else "gcc"
        raise ValueError(f"{path} is a source file, no library: compile it first, {built} -O2 -shared -fPIC "
                         f"{os.path.basename(path)} -o lib{name}.so, and give that")  # fmt: skip
    checks.flag("isolate", isolate)
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
        from ..options import solvers

        routine.plug_solver(list(values.values()))
        return solvers.solver_class(name, name, f"a contact solver from {path}")
    return Routine(kind, name, routine, values)


def _values(name, parameters, params):
    """{parameter: value} from given values and defaults. Raises ValueError for unknown, missing and out-of-range parameters."""
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
