"""Strategies of time stepping and their contact solvers; Simulation.explain tells the defaults chosen for a scene."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from .. import _core
from ..base import checks
from ..names import by_name, one_of, parameters_section
from .integrators import INTEGRATORS, Integrator

MOST_THREADS = 1024  # a request for more threads than the operating system gives would end the program


@dataclass(frozen=True)
class ContactSolver:
    """Base of the contact solvers of a step.

    Parameters
    ----------
    tol : float, default 1e-4
        Largest true error, the natural map in an energy norm [-].
    min_iter : int, default 1
        Fewest iterations of a step.
    max_iter : int, default 1000
        Most iterations of a step.

    Raises
    ------
    ValueError
        If tol is not between 0 and 1 or min_iter is above max_iter.
    """

    tol: float | None = 1e-4
    min_iter: int = 1
    max_iter: int = 1000

    name = ""  # in the core

    def __post_init__(self):
        if not 0 < checks.number("tol", self.tol) < 1:
            raise ValueError(f"tol is {self.tol}: give a number between 0 and 1; 1e-4 is usual, 1e-8 is exact")
        checks.count("min_iter", self.min_iter, 0, checks.INT32)
        checks.count("max_iter", self.max_iter, 1, checks.INT32)
        if self.min_iter > self.max_iter:
            raise ValueError(f"min_iter is {self.min_iter}, above max_iter = {self.max_iter}: exchange them")

    def for_scene(self, core, rules=(), meshes=()):
        """Gives the solver that a simulation of a core scene uses.

        Parameters
        ----------
        core : _core.Scene
            The scene of the core.
        rules : sequence, optional
            (a, b, law) of each rule.
        meshes : sequence, optional
            (mass, mass of a contact) [kg] of each free deformable body.

        Returns
        -------
        ContactSolver
            This solver, or the one that it stands for.
        """
        return self

    def settings(self):
        """Gives the settings for the core.

        Returns
        -------
        dict
            Settings by name, and the solver.
        """
        tol = checks.number("tol", self.tol)
        return {"solver": self.name, "tol": tol, "min_iter": int(self.min_iter), "max_iter": int(self.max_iter)}


def _check_early_end(solver):
    """Raises ValueError if `enough` or `patience` of a solver is out of range."""
    if solver.enough is not None and not solver.tol <= checks.number("enough", solver.enough) < 1:
        raise ValueError(f"enough is {solver.enough}: give a true error between tol = {solver.tol:g} and 1, or None")
    checks.count("patience", solver.patience, 0, checks.INT32)


@dataclass(frozen=True)
class NLGS(ContactSolver):
    """Block nonlinear Gauss-Seidel over colours, on the velocities of bodies: W is never formed.

    Sources are Moreau (1988) and Jean (1999). With acceleration sweeps stay plain if masses of free bodies differ by more than a
    factor of a million, or if most contacts are those of polygons, polyhedra or clumps: a step then has several solutions, and
    plain sweeps stay near the initial one.

    Parameters
    ----------
    tol : float, default 1e-4
        Largest true error, the natural map in an energy norm [-].
    min_iter : int, default 1
        Fewest iterations of a step, counted in sweeps over all contacts or the equivalent work.
    max_iter : int, default 1000
        Most iterations of a step, counted likewise.
    acceleration : {"nesterov", "none"}
        "nesterov": from the tenth sweep on, sweeps are extrapolated (Nesterov 1983) with restarts (O'Donoghue & Candes 2015), and
        tiles of the pile that change most are swept more often; "none": plain sweeps, over-relaxed.
    associated_start : bool, default False
        Without initial impulses, extrapolated sweeps of a pile at rest begin with associated friction, a convex problem (Anitescu
        2006). This reaches 1e-6 in fewer sweeps, but another of several solutions, with more contacts at the limit of sliding:
        use it for a single state with unknown impulses, not for a run.
    softening_relaxation : float, default 1
        Share, in (0, 1], of its change of impulse that a softening bond of a cohesive zone takes in a sweep. The limit of the
        sweeps does not depend on it; 0.5 cures sweeps that cycle as softening bonds open and close in turn (docs/cohesion.md).
    enough : float, optional
        True error, above tol, at which a step of a dense pack ends that has taken `patience` iterations; None: tol alone. A pack
        is dense if at least 100 contacts press, most of which pressed in the last step, and, where NSCD limits overlap, if at
        most 0.6 of the pairs that pressed bear on faces: walls and arches do.
    patience : int, default 0
        Iterations from which on `enough` counts.

    Raises
    ------
    ValueError
        If a setting is out of range, or associated_start is asked for without acceleration.
    """

    acceleration: str = "nesterov"
    associated_start: bool = False
    softening_relaxation: float = 1.0
    enough: float | None = None
    patience: int = 0

    name = "nlgs"

    def __post_init__(self):
        super().__post_init__()
        _check_early_end(self)
        one_of("acceleration", self.acceleration, ("nesterov", "none"))
        if self.associated_start and self.acceleration == "none":
            raise ValueError("associated_start needs extrapolated sweeps: give acceleration='nesterov' as well")
        if not 0 < checks.number("softening_relaxation", self.softening_relaxation) <= 1:
            raise ValueError(f"softening_relaxation is {self.softening_relaxation}: give a number above 0 and up to 1; 1 is none")

    def settings(self):
        """Gives the settings for the core.

        Returns
        -------
        dict
            Settings by name, and the solver.
        """
        return {
            **super().settings(),
            "extrapolates": self.acceleration == "nesterov",
            "associated_start": bool(self.associated_start),
            "softening_relaxation": float(self.softening_relaxation),
            "enough": float(self.enough or 0.0),
            "patience": int(self.patience),
        }


@dataclass(frozen=True)
class ProblemSolver(ContactSolver):
    """Base of solvers that form W.

    Parameters
    ----------
    tol : float, default 1e-4
        Largest true error, the natural map in an energy norm [-].
    min_iter : int, default 1
        Fewest iterations of a step.
    max_iter : int, default 1000
        Most iterations of a step.
    memory : float, default 4e9
        Most bytes for W in blocks and its factors.

    Raises
    ------
    ValueError
        If a setting is out of range.
    """

    memory: float = 4e9

    def __post_init__(self):
        super().__post_init__()
        checks.positive("memory", self.memory)

    def settings(self):
        """Gives the settings for the core.

        Returns
        -------
        dict
            Settings by name, and the solver.
        """
        return {**super().settings(), "memory": float(self.memory)}


@dataclass(frozen=True)
class Auto(ProblemSolver):
    """NLGS, then proximal point around Newton's method once the predicted remaining sweeps cost more.

    Newton steps that do not reduce the error are rejected, and sweeps go on.

    Parameters
    ----------
    tol : float, default 1e-4
        Largest true error, the natural map in an energy norm [-].
    min_iter : int, default 1
        Fewest iterations of a step.
    max_iter : int, default 1000
        Most sweeps of a step.
    memory : float, default 1e9
        Most bytes for factors and the compliance of a mesh; beyond it sweeps alone are used.
    enough : float, optional
        As in NLGS. Newton's method is not asked before `patience` iterations of a dense pack.
    patience : int, default 0
        Iterations from which on `enough` counts.

    Raises
    ------
    ValueError
        If a setting is out of range.
    """

    memory: float = 1e9
    enough: float | None = None
    patience: int = 0

    name = "auto"

    def __post_init__(self):
        super().__post_init__()
        _check_early_end(self)

    def settings(self):
        """Gives the settings for the core.

        Returns
        -------
        dict
            Settings by name, and the solver.
        """
        return {**super().settings(), "enough": float(self.enough or 0.0), "patience": int(self.patience)}


@dataclass(frozen=True)
class Default(ContactSolver):
    """NLGS, or Auto where sweeps alone converge too slowly.

    Auto is taken if a free body, rigid or deformable, is over 1000 times as heavy as another, if bodies have faces, or if bonds
    or joints may connect many bodies to a solid: by sweeps alone a heavy box sinks into light ones, and a wall or a chain takes
    thousands of sweeps. Simulation chooses when it is made and when bodies are added; Simulation.explain() tells the choice.

    Parameters
    ----------
    tol : float, optional
        Largest true error, the natural map in an energy norm [-]. None: 1e-4; in dense packs of balls, clumps, polygons and
        polyhedra, 1e-3 once a step has taken 50 iterations, and NSCD takes back overlap beyond 0.005 of a radius after such
        steps. Blocks that bear on each other's faces, as in walls and arches, are no pack. Stress and
        volume of a pack are then right within a few percent, at a tenth of the cost (docs/study.md).
    min_iter : int, default 1
        Fewest iterations of a step.
    max_iter : int, default 1000
        Most sweeps of a step.

    Raises
    ------
    ValueError
        If a setting is out of range.
    """

    tol: float | None = None

    name = "default"

    def __post_init__(self):
        self.chosen("NLGS")

    def settings(self):
        """Gives the settings for the core.

        Returns
        -------
        dict
            Settings by name, and the solver.
        """
        return replace(self, tol=TOL).settings() if self.tol is None else super().settings()

    def chosen(self, name, packs=False):
        """Gives NLGS or Auto with the settings of this solver.

        Parameters
        ----------
        name : {"NLGS", "Auto"}
            Class of the solver.
        packs : bool, default False
            Whether bodies of the scene may be a dense pack, see may_be_pack, of masses within a factor of 1000.

        Returns
        -------
        NLGS or Auto
            The solver.
        """
        solver = SOLVERS[name](tol=TOL if self.tol is None else self.tol, min_iter=self.min_iter, max_iter=self.max_iter)
        early = packs and self.tol is None
        return replace(solver, enough=ENOUGH, patience=PATIENCE) if early else solver

    def for_scene(self, core, rules=(), meshes=()):
        """Gives NLGS or Auto, with the settings of this solver.

        Parameters
        ----------
        core : _core.Scene
            The scene of the core.
        rules : sequence, optional
            (a, b, law) of each rule.
        meshes : sequence, optional
            (mass, mass of a contact) [kg] of each free deformable body.

        Returns
        -------
        NLGS or Auto
            The solver.
        """
        shapes = np.array(_core.shapes())[core.contactor("shape")]
        mass = core.raw_body("mass").ravel()
        held = 2 ** (3 * core.dim - 3) - 1  # bits of a body with all dofs driven
        free = np.isfinite(mass) & (mass > 0)
        if len(driven := core.raw_body("driven").ravel()):
            free &= driven != held
        whole, each = np.reshape(meshes, (-1, 2)).T  # a contact of a mesh carries a share of its mass
        light, heavy = np.concatenate([mass[free], whole]), np.concatenate([mass[free], each])
        uneven = len(light) and heavy.max() > HEAVY * light.min()
        body = core.contactor("body")
        carried = body >= 0  # the others are on meshes
        faces = np.isin(shapes[carried][free[body[carried]]], _core.shapes("faced")).any()
        solid = any(law is not None and law.bonds for _, _, law in rules)
        return self.chosen("Auto" if faces or solid or uneven else "NLGS", not uneven and may_be_pack(core, rules, meshes))


def may_be_pack(core, rules, meshes):
    """Tells if all that moves is balls, clumps, polygons, polyhedra and walls, under laws that ask for no overlap or gap.

    Bodies with faces are 20 at least. Contacts on faces, as in masonry, are looked for in each step (contacts/overlap_limit.cpp).

    Parameters
    ----------
    core : _core.Scene
        The scene of the core.
    rules : sequence
        (a, b, law) of each rule.
    meshes : sequence
        (mass, mass of a contact) [kg] of each free deformable body.

    Returns
    -------
    bool
        True if bodies may form a dense pack, whose steps end early.
    """
    if len(meshes) or any(law is not None and type(law).__name__ not in LAWS_OF_PACKS for _, _, law in rules):
        return False
    shapes, body, mass = np.array(_core.shapes())[core.contactor("shape")], core.contactor("body"), core.raw_body("mass").ravel()
    if (body < 0).any():
        return False  # nodes of meshes that are driven
    moves = np.isfinite(mass[body]) & (mass[body] > 0)
    if np.isin(shapes[moves], FACES_OF_PACKS).any() and len(np.unique(body[moves])) < LEAST_OF_PACKS:
        return False
    return bool(np.isin(shapes[moves], SHAPES_OF_PACKS + FACES_OF_PACKS).all())


# mass ratio above which bodies sink if sweeps alone are used (docs/problems.md)
HEAVY = 1000
# true errors of a step where none is named, and the iterations after which the second counts in a dense pack; overlap that stays
# then, over the size of the smaller body (docs/study.md)
TOL, ENOUGH, PATIENCE, OVERLAP = 1e-4, 1e-3, 50, 5e-3
SHAPES_OF_PACKS = ("disk", "sphere", "half_plane", "plane", "tube", "ring")
FACES_OF_PACKS, LEAST_OF_PACKS = ("polygon", "polyhedron"), 20  # fewer bodies have no hundred contacts as grains
LAWS_OF_PACKS = (
    "Coulomb", "Frictionless", "Restitution", "Rolling", "LimitedSlip", "Wet", "Capillary", "RollingWet", "RollingCapillary",
)  # fmt: skip


def solver_class(name, python_name, summary):
    """Makes the class of a contact solver from a row of the list of problem solvers.

    Parameters
    ----------
    name : str
        Name in the core.
    python_name : str
        Name of the class.
    summary : str
        Its meaning, the first line of its docstring.

    Returns
    -------
    type
        The class, a ProblemSolver.
    """
    told = "The step is a problem of its own, from the impulses of the last step: Coulomb's cones, joints eliminated from W."
    rows = [("tol", "float, default 1e-4", "largest true error, the natural map in an energy norm [-]"),
            ("min_iter", "int, default 1", "fewest iterations of a step"),
            ("max_iter", "int, default 1000", "most iterations of a step"),
            ("memory", "float, default 4e9", "most bytes for W and its factors; a step that needs more ends with the impulses it "
             "began with, and says so")]  # fmt: skip
    text = "\n".join([f"{summary[0].upper()}{summary[1:]}.", "", told, *parameters_section(rows)])
    body = {"__doc__": text, "__module__": __name__, "name": name, "__qualname__": python_name}
    return type(python_name, (ProblemSolver,), body)  # a dataclass by its base, without further fields


# {name: class} of contact solvers: Default, NLGS, Auto, and a class for each row of the list of problem solvers
SOLVERS = {"Default": Default, "NLGS": NLGS, "Auto": Auto}
for _row in _core.problem_solvers():
    SOLVERS.setdefault(_row[1], solver_class(*_row))


class Strategy:
    """Base of strategies of time stepping: a row of the core's list of strategies and its settings."""

    row = ""  # its name in the core
    stages = False  # True if it has the stages of NSCD, see run/stages.py
    pose = "moreau"  # the condition at contacts
    end_share = 0.5  # weight of the end of the step in gravity and forces that change with time; the rest is its start

    def for_scene(self, core, rules=(), meshes=()):
        """Gives this strategy with the solver chosen for a core scene.

        Parameters
        ----------
        core : _core.Scene
            The scene of the core.
        rules : sequence, optional
            (a, b, law) of each rule.
        meshes : sequence, optional
            (mass, mass of a contact) [kg] of each free deformable body.

        Returns
        -------
        Strategy
            This strategy, or a copy with the solver.
        """
        return self

    def settings(self):
        """Gives the settings for the core.

        Returns
        -------
        dict
            Options by name, and the row under `strategy`.
        """
        return {"strategy": self.row}


@dataclass(frozen=True)
class NSCD(Strategy):
    """Non-Smooth Contact Dynamics by the theta-method: implicit, constrained, nonsmooth.

    Sources are Moreau (1988) and Jean (1999). Rigid bodies and meshes move by the integrator, contacts by the solver.

    Parameters
    ----------
    theta : float, default 0.5
        Parameter of the theta-method in [1/2, 1]; 1/2 conserves energy, 1 damps most.
    solver : ContactSolver, default Default()
        Contact solver: Default(...), NLGS(...), Auto(...) and others.
    margin : float, optional
        Gap below which a pair is a candidate [m]; None: from sizes and speeds.
    project_positions : bool, default False
        Removes overlap after each step without changing velocities (Acary 2013); laws whose overlap is that of a spring are
        refused.
    overlap : float, optional
        Limit of the overlap of rigid bodies over the size of the smaller one [-]: displacements take back the rest after the
        step, by at most the limit, and change no velocity; info["drift"] tells the deepest rest before the step. Where the
        solver has an `enough`, only in packs, after steps that it ended, and at contacts that press in that step and the last;
        no step is ended so as long as the drift is more than 4 times the limit, but overlap is taken back. inf: overlap stays.
        None: 0.005 where Default ends steps of dense packs early, else inf; with a limit that is given it does not. It holds
        under Coulomb, Frictionless, Restitution, Rolling, LimitedSlip, Wet, Capillary, RollingWet and RollingCapillary.
    warm_start : bool, default True
        Begins from the impulses of the last step.
    threads : int, default 0
        Number of threads; 0: as OpenMP decides. Results do not depend on it.
    renumber_every : int, default 200
        Steps between renumberings of the bodies along a space-filling curve.
    contact_point : {"middle", "surface"}
        Where impulses act: in the "middle" of the gap, which conserves the angular momentum of the pair, or on the "surface" of
        each body, as in LMGC90. With "surface" the middle is still used between two polygons, and the point of the mesh for both
        bodies on meshes; velocities are constrained at the detected points, which loses distance and speed on curved surfaces in
        proportion to the step.
    accuracy : float, optional
        Largest error of the velocities after the contact solution, |v - v*|_M / max(|v*|_M, |h g|_M) [-], of the exact solution
        v* of the step, the masses M and the change of velocity h g by loads alone. The solver goes on until its estimate holds:
        from the change of velocities while the error of impulses fell, confirmed by a Newton correction or a far smaller error;
        info["velocity_error"] tells it. None: tol alone counts.
    newton_tol : float, default 1e-8
        Largest residual of nonlinear deformable bodies, in an energy norm [-].
    newton_passes : int, default 30
        Most iterations of Newton's method around the contact solver.
    integrator : Integrator, optional
        Replaces the theta-method: Newmark(beta=, gamma=), HHT(alpha=), GeneralisedAlpha(spectral_radius=), CentralDifference(),
        VelocityVerlet(), Gear(values=) and others.
    cut_back : int, default 0
        How often a step may be halved if Newton's method fails (a cell inside out, no stress of a material, no convergence);
        info["sub_steps"] is the number of parts made. If parts of dt / 2**cut_back fail the state before the step is restored.

    Raises
    ------
    ValueError
        If a setting is out of range, theta is given beside an integrator, or accuracy is asked for of a solver that estimates
        none.

    Examples
    --------
    >>> cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-6)).explicit
    False
    """

    theta: float = 0.5
    solver: ContactSolver = field(default_factory=Default)
    margin: float | None = None
    project_positions: bool = False
    overlap: float | None = None
    warm_start: bool = True
    threads: int = 0
    renumber_every: int = 200
    contact_point: str = "middle"
    accuracy: float | None = None
    newton_tol: float = 1e-8
    newton_passes: int = 30
    integrator: Integrator | None = None
    cut_back: int = 0

    def __post_init__(self):
        if self.integrator is not None:
            if not isinstance(self.integrator, Integrator):
                raise ValueError(f"integrator is {self.integrator!r}: give one of {', '.join(INTEGRATORS)}, as cairn.Newmark()")
            if self.theta != type(self).theta:
                raise ValueError(f"theta is {self.theta}, of the theta-method: leave it out beside {self.integrator!r}")
        if not 0.5 <= checks.number("theta", self.theta) <= 1:
            raise ValueError(f"theta is {self.theta}: give a value in [1/2, 1]; below 1/2 the method is unstable")
        if self.margin is not None and checks.number("margin", self.margin) < 0:
            raise ValueError(f"margin is {self.margin}: give a length >= 0 [m], or None")
        checks.count("threads", self.threads, 0, MOST_THREADS)
        checks.count("renumber_every", self.renumber_every, 1, checks.INT32)
        checks.flag("project_positions", self.project_positions)
        if self.overlap is not None and not checks.number("overlap", self.overlap, finite=False) > 0:
            raise ValueError(f"overlap is {self.overlap}: give a share of the smaller body's size above 0, inf, or None")
        checks.flag("warm_start", self.warm_start)
        if not 0 < checks.number("newton_tol", self.newton_tol) < 1:
            raise ValueError(f"newton_tol is {self.newton_tol}: give a number between 0 and 1")
        checks.count("newton_passes", self.newton_passes, 1, checks.INT32)
        checks.count("cut_back", self.cut_back, 0, 30)
        one_of("contact_point", self.contact_point, ("middle", "surface"))
        if self.accuracy is not None and not 0 < checks.number("accuracy", self.accuracy) < 1:
            raise ValueError(f"accuracy is {self.accuracy}: give a number between 0 and 1, such as 1e-3, or None")
        if self.accuracy is not None and isinstance(self.solver, ProblemSolver) and not isinstance(self.solver, Auto):
            raise ValueError(f"accuracy is estimated between sweeps: {type(self.solver).__name__} has none, take NLGS or Auto")
        if not isinstance(self.solver, ContactSolver) or not self.solver.name:
            raise ValueError(f"solver is {self.solver!r}: give cairn.NLGS(...), cairn.Auto(...) or one of {', '.join(SOLVERS)}")

    row = "nscd"
    stages = True
    unstable = "error"  # reaction to a step beyond the stable step of an explicit integrator

    def moved_by(self):
        """Gives the integrator: the one that was given, or the theta-method.

        Returns
        -------
        Integrator
            The integrator.
        """
        return INTEGRATORS["Theta"](theta=self.theta) if self.integrator is None else self.integrator

    @property
    def explicit(self):
        """True if the step matrix of deformable bodies is their mass alone, A = M."""
        step = self.moved_by().scheme(1.0)
        return not (step["damping"] > 0 or step["stiffness"] > 0)

    @property
    def end_share(self):
        """Weight of the end of the step in gravity and forces that change with time."""
        return self.theta if self.integrator is None else self.integrator.end_share

    def for_scene(self, core, rules=(), meshes=()):
        """Gives this strategy with the solver chosen for a core scene; see ContactSolver.for_scene.

        Parameters
        ----------
        core : _core.Scene
            The scene of the core.
        rules : sequence, optional
            (a, b, law) of each rule.
        meshes : sequence, optional
            (mass, mass of a contact) [kg] of each free deformable body.

        Returns
        -------
        NSCD
            A copy with the solver.
        """
        return self.with_solver(self.solver.for_scene(core, rules, meshes))

    def with_solver(self, solver):
        """Gives this strategy with a solver that was chosen for a scene, and the limit of overlap that goes with it.

        Parameters
        ----------
        solver : ContactSolver
            The solver.

        Returns
        -------
        NSCD
            The strategy.
        """
        early = isinstance(self.solver, Default) and getattr(solver, "enough", None) is not None
        own = self.project_positions or self.contact_point == "surface" or self.pose != "moreau" or self.accuracy is not None
        if early and (own or self.overlap is not None or self.integrator is not None or self.cut_back > 0):
            early, solver = False, replace(solver, enough=None, patience=0)
        default = OVERLAP if early else math.inf
        return replace(self, solver=solver, overlap=default if self.overlap is None else self.overlap)

    def settings(self):
        """Gives the settings for the core.

        Returns
        -------
        dict
            Options of strategy, integrator and solver by name.
        """
        return {
            "strategy": self.row,
            "margin": math.nan if self.margin is None else float(self.margin),
            "project_positions": bool(self.project_positions),
            "overlap": math.inf if self.overlap is None else float(self.overlap),
            "warm_start": bool(self.warm_start),
            "act_on_surfaces": self.contact_point == "surface",
            "renumber_every": int(self.renumber_every),
            "threads": int(self.threads),
            "accuracy": math.inf if self.accuracy is None else float(self.accuracy),
            "refuse_unstable": self.unstable == "error",
            "newton_tol": float(self.newton_tol),
            "newton_passes": int(self.newton_passes),
            "cut_back": int(self.cut_back),
            **self.moved_by().settings(),
            **self.solver.settings(),
        }


@dataclass(frozen=True)
class Carpenter(NSCD):
    """Forward increments with Lagrange multipliers: explicit in the bulk, contact imposed on the gap at the end of the step.

    q(t+) = q + h v, v(t + h/2) = v(t - h/2) + h M^-1 (f(q) + H r / h) with gap + h H'v >= 0, r >= 0: a problem with
    h^2 H' M^-1 H on displacements, for the same solvers. Velocities are those in the middle of steps, with CentralDifference(),
    the default integrator, or BetaScheme(beta=), which damps. Overlap is pushed out in a single step.

    Parameters
    ----------
    theta : float, default 1
        Fixed at 1: leave it out.
    solver, margin, project_positions, overlap, warm_start, threads, renumber_every, contact_point, accuracy : optional
        Those of NSCD.
    newton_tol, newton_passes, integrator, cut_back : optional
        Those of NSCD.
    penalty : float, optional
        Stiffness [N/m] for penalty contact, by the overlap at the end of the step; None: multipliers.
    unstable : {"error", "ignore"}
        Reaction to a step beyond 2/omega of a deformable body.

    Raises
    ------
    ValueError
        If a setting is out of range.

    Notes
    -----
    Source: Carpenter, Taylor & Katona (1991).
    """

    theta: float = 1.0
    penalty: float | None = None
    unstable: str = "error"

    row = pose = "carpenter"

    def moved_by(self):
        """Gives the integrator, CentralDifference by default.

        Returns
        -------
        Integrator
            The integrator.
        """
        return INTEGRATORS["CentralDifference"]() if self.integrator is None else self.integrator

    @property
    def end_share(self):
        """Weight of the end of the step in forces that change with time, by the integrator."""
        return self.moved_by().end_share

    def __post_init__(self):
        super().__post_init__()
        if self.theta != 1:
            raise ValueError(f"theta is {self.theta}: Carpenter's scheme is explicit, leave it out")
        if self.penalty is not None:
            checks.positive("penalty", self.penalty)
        one_of("unstable", self.unstable, ("error", "ignore"))

    def settings(self):
        """Gives the settings for the core.

        Returns
        -------
        dict
            Those of NSCD and the stiffness [N/m], inf for multipliers.
        """
        return {**super().settings(), "stiffness": math.inf if self.penalty is None else float(self.penalty)}


@dataclass(frozen=True)
class GranularElement(NSCD):
    """The granular element method under the theta-method: springs at the contacts, treated implicitly.

    The force over a step is theta f(t+) + (1 - theta) f(t), f(t+) from the gap at t+, without the stability limit of explicit
    springs. Laws give the friction: Coulomb, Frictionless. A theta of 1/2 conserves the energy of springs, 1 damps most.

    Parameters
    ----------
    theta : float, default 1
        Parameter of the theta-method in [1/2, 1].
    solver, margin, project_positions, overlap, warm_start, threads, renumber_every, contact_point, accuracy : optional
        Those of NSCD.
    newton_tol, newton_passes, integrator, cut_back : optional
        Those of NSCD.
    stiffness : float
        Normal contact force over overlap [N/m]; it must be given.
    ratio : float, default 2/7
        Tangential over normal stiffness [-]; the tangential force is stiffness times slip, up to Coulomb's limit.

    Raises
    ------
    ValueError
        If the stiffness is missing or a setting is out of range.

    Notes
    -----
    Source: Kishino (1988).
    """

    theta: float = 1.0
    stiffness: float = math.nan
    ratio: float = 2 / 7

    def __post_init__(self):
        super().__post_init__()
        if isinstance(self.stiffness, float) and math.isnan(self.stiffness):
            raise ValueError("stiffness is missing: give GranularElement(stiffness=...) [N/m]")
        checks.positive("stiffness", self.stiffness)
        checks.positive("ratio", self.ratio)

    row = pose = "granular_element"

    def settings(self):
        """Gives the settings for the core.

        Returns
        -------
        dict
            Those of NSCD, the stiffness [N/m] and the ratio.
        """
        return {**super().settings(), "stiffness": float(self.stiffness), "ratio": float(self.ratio)}


@dataclass(frozen=True)
class SmoothDEM(Strategy):
    """Explicit dynamics with smooth contacts, unconstrained: the discrete element method of Cundall & Strack (1979).

    Laws: LinearSpring, HertzMindlin, JKR, AdhesiveSpring, GranularContact (see cairn.granular), LiquidBridge, PlasticContact,
    YieldContact, SmoothBond.

    Parameters
    ----------
    skin : float, optional
        Gap beyond the reach of a law up to which pairs are listed [m]; None: a tenth of the largest radius. Results do not depend
        on it.
    overlap : float, default 0.01
        Share of the effective radius at which the stiffness for the stable step is evaluated [-].
    unstable : {"error", "warn", "ignore"}
        Reaction to a dt beyond the stable step of two equal bodies; a dt beyond the bound for the current contacts gives a
        warning.
    local_damping : float, default 0.0
        Share of the force on each body, along each axis, that is set against its motion (Cundall 1987), in [0, 1): brings bodies
        to rest; flows and impacts are wrong under it. It is part of `bodies.contact_force`, and `dissipated_bulk` of the energy.
    cell_damping : float, default 0.25
        Share of the force on each rate of a periodic cell that follows a stress which is set against that rate, below 1.
    mass_scale : float, default 1.0
        Inertia of bodies over that of their mass, at least 1, at the same weight (mass scaling): the stable step is longer by its
        root. For slow loading alone: impacts, waves and flows are slower by the same root, which gives a warning.
    energy : bool, default True
        Computes the energy balance.
    threads : int, default 0
        Number of threads; 0: as OpenMP decides. Results do not depend on it.
    renumber_every : int, default 1000
        Steps between renumberings along a space-filling curve.
    integrator : Integrator, optional
        None or VelocityVerlet(), time-centred; Gear(values=5), predictor-corrector.

    Raises
    ------
    ValueError
        If a setting is out of range or the integrator is another.

    Examples
    --------
    >>> cn.SmoothDEM(unstable="warn").renumber_every
    1000
    """

    skin: float | None = None
    overlap: float = 0.01
    unstable: str = "error"
    local_damping: float = 0.0
    cell_damping: float = 0.25
    mass_scale: float = 1.0
    energy: bool = True
    threads: int = 0
    renumber_every: int = 1000
    integrator: Integrator | None = None

    row = "smooth_dem"

    def __post_init__(self):
        if self.skin is not None and checks.number("skin", self.skin) <= 0:
            raise ValueError(f"skin is {self.skin}: give a length > 0 [m], or None")
        if not 0 < checks.number("overlap", self.overlap) < 1:
            raise ValueError(f"overlap is {self.overlap}: give a share of the effective radius between 0 and 1; 0.01 is usual")
        one_of("unstable", self.unstable, ("error", "warn", "ignore"))
        if not 0 <= checks.number("local_damping", self.local_damping) < 1:
            raise ValueError(f"local_damping is {self.local_damping}: give a share of the force in [0, 1); 0.7 is usual for rest")
        if not 0 <= checks.number("cell_damping", self.cell_damping) < 1:
            raise ValueError(f"cell_damping is {self.cell_damping}: give a share of the force in [0, 1)")
        if not 1 <= checks.number("mass_scale", self.mass_scale) < math.inf:
            raise ValueError(f"mass_scale is {self.mass_scale}: give a finite number of at least 1, inertia over mass")
        if self.mass_scale > 1 and getattr(self.integrator, "row", "velocity_verlet") != "velocity_verlet":
            raise ValueError("mass_scale is for VelocityVerlet(): leave the integrator out")
        checks.flag("energy", self.energy)
        checks.count("threads", self.threads, 0, MOST_THREADS)
        checks.count("renumber_every", self.renumber_every, 1, checks.INT32)
        if self.integrator is not None and getattr(self.integrator, "row", None) not in ("velocity_verlet", "gear"):
            raise ValueError(f"integrator is {self.integrator!r}: give cairn.VelocityVerlet() or cairn.Gear()")

    @property
    def end_share(self):
        """Weight of the end of the step in forces that change with time; the rest is that of its start."""
        return 0.5 if self.integrator is None or self.integrator.row == "velocity_verlet" else self.integrator.end_share

    def settings(self):
        """Gives the settings for the core.

        Returns
        -------
        dict
            Options of strategy and integrator by name.
        """
        return {
            **({"integrator": "velocity_verlet"} if self.integrator is None else self.integrator.settings()),
            "strategy": self.row,
            "skin": math.nan if self.skin is None else float(self.skin),
            "overlap": float(self.overlap),
            "local_damping": float(self.local_damping),
            "cell_damping": float(self.cell_damping),
            "mass_scale": float(self.mass_scale),
            "refuse_unstable": self.unstable == "error",
            "energy": bool(self.energy),
            "threads": int(self.threads),
            "renumber_every": int(self.renumber_every),
        }


class Listed(Strategy):
    """Base of strategies defined by the core's list alone, with the options listed there.

    Parameters
    ----------
    **options : float, int, bool or str
        Options by name; those that are not given have the default of the list.

    Raises
    ------
    ValueError
        If an option is unknown or out of its range.
    """

    def __init__(self, **options):
        rows = {row["name"]: row for row in _core.strategy_options(self.row)}
        self._options = {}
        for name, value in options.items():
            row = rows[one_of("option of " + self.row, name, tuple(rows))]
            self._options[name] = _checked_option(row, value)
        for name in rows:
            setattr(self, name, self._options.get(name, rows[name]["default"]))

    def __eq__(self, other):
        return isinstance(other, Listed) and self.settings() == other.settings()

    def __hash__(self):
        return hash(tuple(sorted(self.settings().items())))

    def __repr__(self):
        return f"{type(self).__name__}({', '.join(f'{name}={value!r}' for name, value in self._options.items())})"

    def settings(self):
        """Gives the settings for the core.

        Returns
        -------
        dict
            Options by name, and the row under `strategy`.
        """
        return {"strategy": self.row, **self._options}


def _checked_option(row, value):
    """Value checked against kind and range of a row of the core's options."""
    name = row["name"]
    if row["kind"] == "text":
        return one_of(name, value, tuple(row["texts"]))
    if row["kind"] == "flag":
        return bool(checks.flag(name, value))
    value = int(checks.count(name, value, -checks.INT32, checks.INT32)) if row["kind"] == "whole" else checks.number(name, value)
    low = value >= row["smallest"] if row["ends"][0] == "[" else value > row["smallest"]
    high = value <= row["largest"] if row["ends"][1] == "]" else value < row["largest"]
    if not (low and high):
        ends = f"{row['ends'][0]}{row['smallest']:g}, {row['largest']:g}{row['ends'][1]}"
        raise ValueError(f"{name} is {value}: give a value in {ends}, {row['meaning']}")
    return value


class ListedStages(Listed):
    """A listed strategy with the stages of NSCD, see run/stages.py.

    Parameters
    ----------
    **options : float, int, bool or str
        Options by name; those that are not given have the default of the list.
    """

    stages = True

    def moved_by(self):
        """Gives the integrator named by its options.

        Returns
        -------
        Integrator
            The integrator.
        """
        kind = next(kind for kind in INTEGRATORS.values() if kind.row == self.integrator)
        return kind(**{name: getattr(self, name) for name, *_ in kind.parameters if hasattr(self, name)})

    explicit = NSCD.explicit

    @property
    def end_share(self):
        """Weight of the end of the step in gravity and forces that change with time."""
        return self.moved_by().end_share


def _listed_class(row, python_name, summary, laws, stages):
    """Makes the class of a strategy from its row of the core's list."""
    lines = [f"{summary[0].upper()}{summary[1:]}.", "", f"Laws: {', '.join(laws)}."]
    kinds = {"text": "str", "flag": "bool", "whole": "int"}
    options = _core.strategy_options(row)
    told = ((o["name"], f"{kinds.get(o['kind'], 'float')}, default {o['default']!r}", o["meaning"]) for o in options)
    lines += parameters_section(list(told))
    body = {"__doc__": "\n".join(lines), "__module__": __name__, "row": row, "__qualname__": python_name}
    body["__signature__"] = by_name([(o["name"], o["default"]) for o in _core.strategy_options(row)])
    return type(python_name, (ListedStages if stages else Listed,), body)


# {name in Python: class} for each row of the core's list of strategies
STRATEGIES = {"NSCD": NSCD, "Carpenter": Carpenter, "GranularElement": GranularElement, "SmoothDEM": SmoothDEM}
for _row in _core.strategies():
    STRATEGIES.setdefault(_row[1], _listed_class(*_row))


def strategy(name, **options):
    """Makes a strategy by its name.

    Parameters
    ----------
    name : str
        Name in the core's list ("nscd", "smooth_dem", ...) or in Python ("NSCD").
    **options : float, int, bool, str, ContactSolver or Integrator
        Options of its class.

    Returns
    -------
    Strategy
        The strategy.

    Raises
    ------
    ValueError
        If there is no strategy of this name, or an option is wrong.

    Examples
    --------
    >>> cn.strategy("smooth_dem", threads=2).threads
    2
    """
    known = {**{row[0]: STRATEGIES[row[1]] for row in _core.strategies()}, **STRATEGIES}
    return known[one_of("strategy", name, tuple(known))](**options)


def checked_strategy(strategy):
    """Checks that something is a strategy.

    Parameters
    ----------
    strategy : Strategy
        The object to be checked.

    Returns
    -------
    Strategy
        The strategy, unchanged.

    Raises
    ------
    ValueError
        If it is no strategy.
    """
    if not isinstance(strategy, Strategy):
        raise ValueError(f"strategy is {strategy!r}: give cairn.NSCD(...) or one of {', '.join(STRATEGIES)}")
    return strategy
