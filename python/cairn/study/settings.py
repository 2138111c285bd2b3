"""Settings swept by a study. A setting is a solver with its tolerance, time step, warm start, minimum of iterations, integrator,
mesh, requested accuracy of velocities and acceleration of sweeps. Scenes with heat or current add the tolerance of networks and
the coupling of heat and mechanics."""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
import json

from ..names import listed, one_of

TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4)
ACCELERATIONS = ("", "nesterov", "none")


@dataclasses.dataclass(frozen=True)
class Setting:
    """One point of the sweep. solver: name in Python of a solver of simulations, or in small letters one of problems.

    tol: on the true error. dt_factor: time step over the scene's own. max_iter: iterations of a step at most. min_iter is 0 for
    solvers without such a minimum; problems use solver and tol alone. integrator: its call, "HHT(alpha=-0.1)"; "": that of the
    scene. network_tol: of networks of heat and current, 0: those of the scene. coupling: of Scene.thermal, "staggered" or a
    number in words; "": that of the scene. mesh: argument of build(mesh=...) in the scene's file, larger for finer meshes; 0: its
    default. accuracy: of NSCD, requested error of velocities to which the solver iterates; 0: none. acceleration: of NLGS,
    "nesterov" or "none"; "": its default.
    """

    solver: str
    tol: float
    dt_factor: float = 1.0
    warm_start: bool = True
    min_iter: int = 1
    max_iter: int = 10_000
    integrator: str = ""
    network_tol: float = 0.0
    coupling: str = ""
    mesh: float = 0.0
    accuracy: float = 0.0
    acceleration: str = ""

    def as_row(self):
        """Values by name. Later additions are left out at their default, so that rows of earlier studies stay valid."""
        later = ("integrator", "network_tol", "coupling", "mesh", "accuracy", "acceleration")
        return {name: value for name, value in dataclasses.asdict(self).items() if name not in later or value}

    def key(self):
        """Hash of the setting, the same in every run."""
        return digest(self.as_row())

    @property
    def family(self):
        """All values but the tolerance: settings of a family form a curve of error against cost."""
        return (self.solver, self.dt_factor, self.warm_start, self.min_iter, self.max_iter, self.integrator, self.network_tol,
                self.coupling, self.mesh, self.accuracy, self.acceleration)  # fmt: skip

    def strategy(self, base=None):
        """The cairn.NSCD of this setting, on one thread; further options come from base."""
        from ..options.strategies import NSCD

        if base is not None and not isinstance(base, NSCD):
            raise ValueError(f"strategy of the scene is {base!r}: a study sweeps the settings of cairn.NSCD")
        wanted = {"acceleration": self.acceleration} if self.acceleration else {}
        solver = make_solver(self.solver, tol=self.tol, min_iter=self.min_iter, max_iter=self.max_iter, **wanted)
        more = {"integrator": make_integrator(self.integrator)} if self.integrator else {}
        more |= {"accuracy": self.accuracy} if self.accuracy else {}
        return dataclasses.replace(base or NSCD(), solver=solver, warm_start=self.warm_start, threads=1, **more)

    @property
    def of_networks(self):
        """Settings of networks; each distinct combination needs a scene of its own."""
        return tuple(value for value in (self.network_tol, self.coupling) if value)

    def set_networks(self, scene):
        """Sets tolerance and coupling of networks in a scene before its simulation."""
        if self.of_networks and not scene.networks:
            raise ValueError("a network tolerance or a coupling is swept, and the scene has no network: call scene.thermal(...)")
        for network in scene.networks.values():
            network.tol = self.network_tol or network.tol
        if self.coupling:
            if "thermal" not in scene.networks:
                raise ValueError(f"coupling {self.coupling} is swept, and the scene has no heat: call scene.thermal(...)")
            scene.networks["thermal"].coupling = float("inf") if self.coupling == "staggered" else float(self.coupling)

    def line(self):
        """Line of a script that creates the setting."""
        given = {"tol": f"{self.tol:g}", "min_iter": self.min_iter, "max_iter": self.max_iter}
        given |= {"acceleration": repr(self.acceleration)} if self.acceleration else {}
        known = solver_options(self.solver) if self.solver in scene_solvers() else given
        words = ", ".join(f"{name}={value}" for name, value in given.items() if name in known)
        more = f", integrator=cn.{self.integrator}" if self.integrator else ""
        more += f", accuracy={self.accuracy:g}" if self.accuracy else ""
        return f"cn.NSCD(solver=cn.{self.solver}({words}), warm_start={self.warm_start}{more})"


def digest(content):
    """Short hash of plain data."""
    text = json.dumps(content, sort_keys=True, default=repr)
    return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()


def scene_solvers():
    """Solvers that a simulation takes, {name in Python: one line on it}: those of the registry that have a class."""
    import cairn

    from .. import _core

    rows = {python_name: summary for _, python_name, summary in _core.problem_solvers()}
    return {name: summary for name, summary in rows.items() if dataclasses.is_dataclass(getattr(cairn, name, None))}


def solver_options(name):
    """Names of the options of a solver of simulations."""
    import cairn

    if name not in scene_solvers():
        raise ValueError(f"there is no solver {name!r} of simulations: give one of {listed(scene_solvers(), name)}")
    return {field.name for field in dataclasses.fields(getattr(cairn, name))}


def make_solver(name, **wanted):
    """The solver of a simulation with those of the wanted options that it has."""
    import cairn

    known = solver_options(name)
    return getattr(cairn, name)(**{option: value for option, value in wanted.items() if option in known})


def make_integrator(text):
    """The integrator that is called so: "Theta(theta=0.5)", "CentralDifference()"."""
    import ast

    from ..options.integrators import INTEGRATORS

    name, _, options = str(text).strip().partition("(")
    if name not in INTEGRATORS:
        raise ValueError(f"integrator {text!r} is none: give one as it is called, of {listed(INTEGRATORS, name)}")
    try:
        call = ast.parse(f"f({options.rstrip().removesuffix(')')})", mode="eval").body
        given = {word.arg: ast.literal_eval(word.value) for word in call.keywords}
        if call.args:
            raise ValueError("give options by name, as Newmark(beta=0.25)")
    except (SyntaxError, ValueError) as error:
        raise ValueError(f"integrator {text!r} cannot be read ({error}): give {name}(NAME=VALUE, ...)") from error
    return INTEGRATORS[name](**given)


def scene_settings(
    solvers=None, tolerances=TOLERANCES, dt_factors=(1.0,), warm_start=(True, False), min_iter=(1,), max_iter=10_000,
    integrators=("",), network_tolerances=(0.0,), couplings=("",), meshes=(0.0,), accuracies=(0.0,), accelerations=("",),
):  # fmt: skip
    """All settings of the sweep, each once: {key: Setting} in the order of the sweep. solvers None: all of the registry."""
    names = list(scene_solvers()) if solvers is None else [_python_name(name) for name in solvers]
    out = {}
    if tuple(meshes or (0.0,)) != (0.0,):  # the default mesh of build()
        for mesh in meshes:
            check_mesh("meshes", mesh)
    every = itertools.product(
        names, tolerances, dt_factors, warm_start, min_iter, integrators or ("",), network_tolerances or (0.0,),
        couplings or ("",), meshes or (0.0,), accuracies or (0.0,), accelerations or ("",),
    )
    for name, tol, factor, warm, least, integrator, network_tol, coupling, mesh, accuracy, acceleration in every:
        _check(tol, factor)
        _check_networks(network_tol, coupling)
        if integrator:
            make_integrator(integrator)
        least = int(least) if "min_iter" in solver_options(name) else 0
        if not 0 <= accuracy < 1:
            raise ValueError(f"an accuracy is {accuracy}: give numbers between 0 and 1, 0: none")
        accuracy = float(accuracy) if _estimates(name) else 0.0
        acceleration = one_of("acceleration", acceleration, ACCELERATIONS) if "acceleration" in solver_options(name) else ""
        setting = Setting(name, float(tol), float(factor), bool(warm), least, int(max_iter), integrator, float(network_tol),
                          str(coupling), float(mesh), accuracy, acceleration)  # fmt: skip
        out.setdefault(setting.key(), setting)
    return out


def _estimates(name):
    """True if the solver estimates the error of velocities, as NSCD(accuracy=...) requires."""
    from ..options.solvers import SOLVERS, Auto, ProblemSolver

    return issubclass(SOLVERS[name], Auto) or not issubclass(SOLVERS[name], ProblemSolver)


def check_mesh(name, mesh):
    """Raises ValueError unless mesh is a finite number above 0."""
    try:
        right = not isinstance(mesh, (str, bool)) and 0 < float(mesh) < float("inf")
    except (TypeError, ValueError):
        right = False
    if not right:
        remedy = "give finite numbers above 0 that build(mesh=...) takes, the finer the larger"
        raise ValueError(f"{name}: {mesh!r} is no mesh: {remedy}")


def problem_settings(solvers=None, tolerances=TOLERANCES, max_iter=10_000_000):
    """All settings of a sweep over problems, {key: Setting}."""
    from ..problems import solvers as known

    by_python_name = _problem_names()
    names = list(known()) if solvers is None else [by_python_name.get(name, name) for name in solvers]
    for name in names:
        if name not in known():
            raise ValueError(f"there is no solver {name!r} of problems: give one of {listed(known(), name)}")
    settings = []
    for name, tol in itertools.product(names, tolerances):
        _check(tol, 1.0)
        settings.append(Setting(name, float(tol), 1.0, False, 0, int(max_iter)))
    return {setting.key(): setting for setting in settings}


def _problem_names():
    from .. import _core

    return {python_name: name for name, python_name, _ in _core.problem_solvers()}


def _python_name(name):
    """Name in Python of a solver that may be given in small letters."""
    return {small: python_name for python_name, small in _problem_names().items()}.get(name, name)


def _check_networks(tol, coupling):
    if not 0 <= tol < 1:
        raise ValueError(f"a network tolerance is {tol}: give numbers between 0 and 1, 0: the scene's own")
    try:
        right = coupling in ("", "staggered") or float(coupling) > 0
    except ValueError:
        right = False
    if not right:
        raise ValueError(f"a coupling is {coupling!r}: give 'staggered' or a number above 0")


def _check(tol, factor):
    if not 0 < tol < 1:
        raise ValueError(f"a tolerance is {tol}: give numbers between 0 and 1")
    if not 0 < factor < float("inf"):
        raise ValueError(f"a factor of the time step is {factor}: give positive numbers")
