"""Scene of a simulation: bodies, gravity, contact laws by pairs of materials, a periodic cell. Plain data."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..base import checks, time_functions
from ..base.materials import Material
from ..names import Spelt, listed
from . import bodies
from .laws import Law
from .periodic import Periodic
from .rules import chosen_rule, in_order, mesh_groups, rule, rules_from_dict, rules_to_dict
from .scene_sets import checked_sets, set_from_dict, set_to_dict


class Scene(Spelt):
    """Bodies and the laws between them.

    Parameters
    ----------
    dim : int
        2 or 3.
    gravity : array_like (dim,) or callable, optional
        Acceleration [m/s2], or a function of time that gives it; zero when not given.
    origin : array_like (dim,), optional
        Positions are stored relative to it [m], so that a scene far from zero does not lose digits.
    depth : float, default 1
        Thickness of a 2D scene in networks, servo-controlled walls and masonry [m]; it does not change masses: give disks and
        polygons the same depth.
    periodic : Periodic, optional
        A periodic cell.

    Raises
    ------
    ValueError
        If a value is wrong; the message names field, value and remedy.

    Examples
    --------
    >>> scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    >>> rock = cn.Material("rock", density=2800.0)
    >>> scene.add(cn.disks([[0.0, 0.5]], 0.5, rock), cn.wall((0.0, 0.0), (0.0, 1.0), rock))
    array([0, 1])
    """

    def __init__(self, dim, gravity=None, *, origin=None, depth=1.0, periodic=None):
        self._dim, self._stepped = checks.dimension(dim), False  # True after a step of a simulation
        self.sets: list[bodies.BodySet] = []
        self.gravity = np.zeros(dim) if gravity is None else gravity
        self.origin = np.zeros(dim) if origin is None else origin
        self.depth = checks.positive("depth", depth)
        self.periodic = periodic
        self._materials: dict[str, Material] = {}
        self.rules: list[tuple[str, str, Law | None]] = []
        self.networks: dict[str, object] = {}  # electrical, thermal
        self.fluids: list = []  # of cn.fluid
        self.fluid_rules: list[tuple[str, int]] = []
        self.fluid_ends: list = []  # of cn.Inflow and cn.Outflow
        self.count = 0
        self.legacy = None  # origin of a scene made by cairn.legacy
        self.ranks = None  # of Scene.load
        self._made = True

    @property
    def dim(self):
        """Number of dimensions, 2 or 3."""
        return self._dim

    @property
    def gravity(self):
        """Gravity (dim,) [m/s2], or the function of time that gives it."""
        return self._gravity

    @gravity.setter
    def gravity(self, value):
        if callable(value):
            checks.function_of_time("gravity", value)
        self._gravity = value if callable(value) else checks.real_array("gravity", value, (self._dim,))

    @property
    def origin(self):
        """Point (dim,) [m] that positions are stored relative to; set before the first step."""
        return self._origin

    @origin.setter
    def origin(self, value):
        self._refuse_stepped("origin", value)
        self._origin = checks.real_array("origin", value, (self._dim,))

    @property
    def periodic(self):
        """The periodic cell, None without one; set before the first step."""
        return self._periodic

    @periodic.setter
    def periodic(self, value):
        self._refuse_stepped("periodic", value)
        if value is not None:
            if not isinstance(value, Periodic):
                raise ValueError(f"periodic is {value!r}: give cairn.Periodic(lengths=...), with a length for each axis")
            value.arrays(self.dim)
            value.components(self.dim)
            if self.sets:
                checked_sets(self.dim, self.sets, periodic=value)
        self._periodic = value

    def _refuse_stepped(self, name, value):
        if self._stepped:
            raise ValueError(
                f"{name} is set to {value!r} after a simulation of the scene made its first step: bodies and images stand by the "
                f"one that it was made with; give {name}= to another Scene, and make a Simulation of that"
            )

    def _elsewhere(self, name):
        return "; make another scene" if name == "dim" else ""

    # ------------------------------------------------------------------ building

    def add(self, *sets):
        """Adds sets of bodies.

        Parameters
        ----------
        *sets : BodySet or list of BodySet
            Sets, as disks(...), wall(...), deformable(...) and others make them, and liquids of cn.fluid(...), cn.Inflow(...) and
            cn.Outflow(...), which have no ids.

        Returns
        -------
        ndarray (n,)
            Ids, int64: numbers in the order of insertion, never used twice. Points, edges and faces of deformable bodies have
            numbers too.

        Raises
        ------
        ValueError
            If a set is wrong, or two materials of the same name differ; the scene is then as it was.
        """
        liquids, ends = ([s for s in sets if getattr(s, kind, False)] for kind in ("is_fluid", "is_fluid_end"))
        for liquid in (*liquids, *ends):
            if liquid.dim != self.dim:
                raise ValueError(f"a fluid has {liquid.dim} dimensions and the scene {self.dim}: give Scene({liquid.dim})")
        sets = [s for s in sets if not (getattr(s, "is_fluid", False) or getattr(s, "is_fluid_end", False))]
        flat, self._materials = checked_sets(self.dim, sets, self._materials, self.periodic)
        self.fluids += liquids
        self.fluid_ends += ends
        first = self.count
        for s in flat:
            s = bodies.replace(s, ids=np.arange(self.count, self.count + len(s) + s.parts))
            self.count += len(s.ids)
            self.sets.append(s)
        return np.arange(first, self.count)

    def interact(self, a, b, law):
        """Sets the law between two materials or groups.

        Rules that name groups precede rules that name materials, and these precede "*"; among equal rules the last counts.

        Parameters
        ----------
        a : Material or str
            A material, its name, the name of a group, or "*" for all.
        b : Material or str
            The other side, likewise.
        law : Law, NoSlip, FreeSlip, GrainDrag or None
            The law; None: no contact, bodies pass through each other. Between a fluid and bodies NoSlip(), which is the default,
            FreeSlip(), GrainDrag() for grains smaller than its particles, or None: it flows through them.

        Raises
        ------
        ValueError
            If a side is no name or the law is none.
        """
        if type(law).__name__ in ("NoSlip", "FreeSlip", "GrainDrag") or self._is_fluid(a) or self._is_fluid(b):
            from .fluids import slip_rule

            self.fluid_rules.append(slip_rule(self, a, b, law))
            return
        self.rules.append(rule(a, b, law))

    def _is_fluid(self, side):
        return any(side is f or side == f.name for f in self.fluids)

    def join(self, a, b, joint):
        """Joins two bodies or nodes of meshes in their current positions, or a body and the world.

        Contact between the bodies stays active unless `interact` excludes it.

        Parameters
        ----------
        a : int
            Id of a body or node.
        b : int or None
            Id of the other one; None: the world.
        joint : JointKind
            One of cairn.Ball, Hinge, Pivot, Fixed, Slider, Distance or Cable.

        Returns
        -------
        str
            Name of the joint, for rules and pictures.

        Raises
        ------
        ValueError
            If there is no such body or the joint is none.
        """
        from .joints import joined

        return joined(self, a, b, joint)

    def electrical(self, **settings):
        """Adds an electrical network over the contacts, from the next Simulation on.

        Parameters
        ----------
        **settings : optional
            Settings of cairn.networks.Electrical.
        """
        from ..networks import Electrical

        self.networks["electrical"] = Electrical(**settings)

    def thermal(self, **settings):
        """Adds a network of heat over the contacts, from the next Simulation on.

        Parameters
        ----------
        **settings : optional
            Settings of cairn.networks.Thermal.
        """
        from ..networks import Thermal

        self.networks["thermal"] = Thermal(**settings)

    def running_networks(self, simulation, core):
        """Makes the state of the networks of a simulation.

        Parameters
        ----------
        simulation : Simulation
            The simulation.
        core : _core.Simulation
            That of the core.

        Returns
        -------
        Running or None
            The state; None without networks.
        """
        if not self.networks:
            return None
        from ..networks.run import Running

        return Running(simulation, core)

    # ------------------------------------------------------------------ tables for the core

    def species(self):
        """Gives the pairs of names by which rules know contactors.

        Returns
        -------
        dict
            {(material, group): number} in order of appearance; the numbers are the core's materials.
        """
        found = {}
        for s in self.sets:
            for c in s.contactors:
                found.setdefault(c.species(s.group), len(found))
        return found

    def check_names(self, species=None, rules=None):
        """Refuses rules that name no material and no group of the scene.

        Parameters
        ----------
        species : iterable, optional
            (material, group) of all contactors; those of the scene when not given.
        rules : sequence, optional
            (a, b, law) of each rule; those of the scene when not given.

        Raises
        ------
        ValueError
            If a rule names neither, or a fluid has the name of one.
        """
        names = {"*"} | {n for pair in (self.species() if species is None else species) for n in pair if n}
        for liquid in self.fluids:
            if liquid.name in names:
                raise ValueError(
                    f"name of a fluid is {liquid.name!r}, and a material or group of the scene has it too, so that rules cannot "
                    "tell both: give cn.fluid(name=...) another one"
                )
        for a, b, _ in self.rules if rules is None else rules:
            for word in (a, b):
                if word not in names:
                    raise ValueError(
                        f"an interaction names {word!r}, which is no material and no group of the scene; "
                        f"there are {listed(sorted(names - {'*'}), word)}{self._untouched(word)}"
                    )

    def _untouched(self, word):
        """Hint for an error message if this material or group is that of a mesh without contactors; else empty."""
        for s in self.sets:
            if s.mesh is not None and word in (s.group, getattr(s.mesh.material, "name", s.mesh.material)):
                return f"; nothing of the mesh {s.mesh.name!r} touches: give deformable(contact=...), edges or faces"
        return ""

    def law_table(self, species, rules=None, sets=None):
        """Makes the core's table of laws.

        Parameters
        ----------
        species : dict
            {(material, group): number}, as `species` gives it.
        rules : sequence, optional
            (a, b, law) of each rule; those of the scene when not given.
        sets : sequence of BodySet, optional
            Sets whose meshes keep apart; those of the scene when not given.

        Returns
        -------
        _core.LawTable
            The table.
        """
        table = _core.LawTable([material for material, _ in species], [group for _, group in species])
        nodes = mesh_groups(self.sets if sets is None else sets)
        table.keep_apart([k for k, (_, group) in enumerate(species) if group in nodes])
        for a, b, law in in_order(self.rules if rules is None else rules):
            if law is None:
                table.pass_through(a, b)
            else:
                curves = [(k, list(of.temperatures), list(of.values)) for k, of in law.of_temperature]
                table.rule(a, b, law.row, list(law.values), curves)
        table.settle()
        return table

    def law_between(self, a, b):
        """Gives the law between two species.

        Parameters
        ----------
        a : tuple
            Material and group, as in `species`.
        b : tuple
            Material and group of the other side.

        Returns
        -------
        Law or None
            The law; None if they have none.
        """
        apart = [(a[1], b[1], None)] if {a[1], b[1]} <= mesh_groups(self.sets) else []
        return chosen_rule(a, b, [*apart, *in_order(self.rules)])[1]

    # ------------------------------------------------------------------ files

    def __repr__(self):
        return f"<scene, {self.dim}D: {self.count:,} bodies and parts of meshes, {len(self.rules):,} rules>"

    def __str__(self):
        from ..base.notebook import lines_of_scene

        return lines_of_scene(self)

    def _repr_html_(self):
        from ..base.notebook import of_scene

        return of_scene(self)

    def save(self, path):
        """Writes the scene, without any Python code, to an HDF5 file.

        Parameters
        ----------
        path : path-like
            Name of the file, which ends in .scene.h5 by custom.

        Raises
        ------
        ValueError
            If a function of time is neither Table nor Harmonic, or another part cannot be held by a file.
        FileError
            If the file cannot be written.
        """
        from ..files.checkpoint import save

        if self.fluids:
            raise ValueError("a scene file holds no fluid: keep the script that makes the scene; checkpoints hold the particles")
        sets, meshes = {}, set()
        for k, s in enumerate(self.sets):
            if s.mesh is not None:
                if id(s.mesh) not in meshes:  # written once, with all of its sets
                    from .mesh_files import to_dict

                    meshes.add(id(s.mesh))
                    sets[f"{k:06d}"] = {"deformable": to_dict(s.mesh)}
                continue
            sets[f"{k:06d}"] = set_to_dict(s)
        content = {
            "kind": "scene",
            "dim": self.dim,
            "origin": self.origin,
            "depth": self.depth,
            "sets": sets,
            "rules": rules_to_dict(self.rules),
            "gravity": time_functions.to_dict("gravity", self.gravity),
        }
        if self.periodic is not None:
            p = self.periodic
            content["periodic"] = {
                "lengths": np.asarray(p.lengths, float),
                "lean": p.lean,
                "shear_rate": p.shear_rate,
                "corner": np.asarray(p.corner if p.corner is not None else np.zeros(self.dim), float),
                "constant_volume": p.constant_volume,
                "inertia": p.inertia,
            } | dict(zip(("rate", "stress"), p.components(self.dim), strict=True))
        if self.networks:
            from .mesh_files import encoded

            content["networks"] = {kind: encoded(settings.given) for kind, settings in self.networks.items()}
        save(path, content, "a scene")

    @classmethod
    def load(cls, path, *, ranks=None):
        """Reads a scene written by save().

        Parameters
        ----------
        path : path-like
            Name of the file.
        ranks : int, "mpi" or communicator of mpi4py, optional
            Ranks that share the scene, which simulations of it run over. Large arrays then stay in the file: processes look at
            them there, and none has them in memory of its own. They cannot be written.

        Returns
        -------
        Scene
            The scene.

        Raises
        ------
        FileError
            If there is no such file, or it holds no scene.
        ValueError
            If ranks is no number of ranks, "mpi" or communicator.
        """
        from ..base.given_ranks import asked
        from ..base.open_ranks import failing_alike, opened
        from ..files.checkpoint import STAYS_IN_FILE

        if ranks is None:
            return cls._read(path)
        ranks = asked(ranks)
        with failing_alike(opened(ranks), path):
            scene = cls._read(path, STAYS_IN_FILE)
        scene.ranks = ranks
        return scene

    @classmethod
    def _read(cls, path, stays_from=None):
        from ..base.errors import FileError
        from ..files.checkpoint import load

        content = load(path, "a scene", ".scene.h5", stays_from)
        if not isinstance(content.get("kind"), str) or content["kind"] != "scene":
            raise FileError(path, "this file holds no scene", "give a file written by Scene.save")
        try:
            return cls._made_of(content)
        except FileError:
            raise
        except (ValueError, KeyError, TypeError, IndexError, AttributeError, OverflowError, MemoryError, RuntimeError) as error:
            told = error if isinstance(error, ValueError) else repr(error)
            raise FileError(path, f"the scene is damaged: {told}", "write it again") from error

    @classmethod
    def _made_of(cls, content):
        periodic = content.get("periodic")
        if periodic is not None:
            periodic = Periodic(
                tuple(periodic["lengths"]),
                tuple(periodic["corner"]),
                float(periodic["lean"]),
                float(periodic["shear_rate"]),
                *(_functions_of(periodic.get(kind, {})) for kind in ("rate", "stress")),
                bool(periodic.get("constant_volume", False)),
                float(periodic.get("inertia", 1.0)),
            )
        scene = cls(
            int(content["dim"]),
            time_functions.from_dict(content["gravity"]),
            origin=content["origin"],
            depth=float(content["depth"]),
            periodic=periodic,
        )
        for _, d in sorted(content["sets"].items()):
            if "deformable" in d:
                from .mesh_files import from_dict

                scene.add(from_dict(d["deformable"]))
            else:
                scene.add(set_from_dict(scene.dim, d))
        scene.rules = rules_from_dict(content["rules"])
        for kind, given in content.get("networks", {}).items():
            from .mesh_files import decoded

            {"electrical": scene.electrical, "thermal": scene.thermal}[kind](**decoded(given))
        return scene


def _functions_of(texts):
    """{component: Expression} of the texts in a file, None without."""
    return {name: time_functions.Expression(str(text)) for name, text in texts.items()} or None
