"""Contact solvers of a step: sweeps, solvers of the whole contact problem, and the default, which the scene chooses."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .. import _core
from ..base import checks
from ..names import one_of, parameters_section

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
    thousands of sweeps. Over ranks it is always taken. Simulation chooses when it is made and when bodies are added;
    Simulation.explain() tells the choice.

    Parameters
    ----------
    tol : float, optional
        Largest true error, the natural map in an energy norm [-]. None: 1e-4; in dense packs of balls, clumps, polygons,
        polyhedra, capsules, cylinders and superquadrics, 1e-3 once a step has taken 50 iterations, and NSCD takes back overlap
        beyond 0.005 of a radius after such steps. Blocks that bear on each other's faces, as in walls and arches, are no pack.
        Stress and volume of a pack are then right within a few percent, at a tenth of the cost (docs/study.md).
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
    """Tells if all that moves is balls, round and faced bodies and walls, under laws that ask for no overlap or gap.

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
SHAPES_OF_PACKS = ("disk", "sphere", "capsule", "superquadric", "half_plane", "plane", "tube", "ring")
FACES_OF_PACKS, LEAST_OF_PACKS = ("polygon", "polyhedron", "cylinder"), 20  # fewer bodies have no hundred contacts as grains
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
