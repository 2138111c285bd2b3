"""Strategies of time stepping; Simulation.explain tells the defaults chosen for a scene."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from .. import _core
from ..base import checks
from ..names import by_name, one_of, parameters_section
from .integrators import INTEGRATORS, Integrator
from .solvers import MOST_THREADS, OVERLAP, SOLVERS, Auto, ContactSolver, Default, ProblemSolver
from .strategy_base import Listed, Strategy


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
