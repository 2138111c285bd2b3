"""Scene of a simulation: bodies, gravity, contact laws by pairs of materials, a periodic cell. Plain data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from ..base import checks, time_functions
from ..base.expressions import texts_of
from ..base.materials import Material
from ..names import Spelt, listed
from . import bodies, shapes
from .extents import refuse_narrow_cell
from .laws import Law, law_from


@dataclass(frozen=True)
class Periodic:
    """A periodic cell, which may change its shape.

    Each component ij of its velocity gradient (xx, yy, zz, and xy, xz, yz: the face across j moves along i) may have a rate, or
    follow a stress; the others stay. With a stress the rates of the cell are unknowns of the step, as the velocities of bodies
    are, and the stress is that of the forces f of contacts across the boundary, - sum f_i s_j / V, s: shift of the image,
    which in equilibrium is that of all contacts (Radjai & Voivret 2011). NSCD alone makes such steps, by NLGS or Auto.

    Parameters
    ----------
    lengths : tuple (dim,)
        Length along each axis [m], inf or 0 along an axis that is not periodic.
    corner : tuple (dim,), optional
        Lowest corner [m]; zero when not given.
    lean : float, default 0
        Displacement along x of the cell's upper face [m].
    shear_rate : float, default 0
        Velocity of that face over the length of the cell along y in 2D, z in 3D [1/s].
    rate : dict, optional
        {component: rate [1/s]}, numbers or functions of time (Table, Harmonic, Expression); a length that shrinks has a negative
        rate.
    stress : float, callable or dict, optional
        Pressure along all axes [Pa], or {component: stress}, compression positive; the cell has to be periodic along all axes.
    constant_volume : bool, default False
        Lengths that have neither keep the volume.
    inertia : float, default 1
        Inertia of a cell that follows a stress, over the mass of its bodies [-]. It does not change what is slow.

    Examples
    --------
    >>> isotropic = cn.Periodic((1.0, 1.0, 1.0), stress=1e4)
    >>> triaxial = cn.Periodic((1.0, 1.0, 1.0), rate={"zz": -0.1}, stress={"xx": 1e4, "yy": 1e4})
    >>> sheared = cn.Periodic((1.0, 1.0), rate={"xy": 0.1}, stress={"yy": 1e4})
    >>> undrained = cn.Periodic((1.0, 1.0), rate={"yy": -0.1}, constant_volume=True)
    """

    lengths: tuple
    corner: tuple | None = None
    lean: float = 0.0
    shear_rate: float = 0.0
    rate: dict | None = None
    stress: Any = None
    constant_volume: bool = False
    inertia: float = 1.0

    def components(self, dim):
        """Gives what drives the cell, by component.

        Parameters
        ----------
        dim : int
            2 or 3.

        Returns
        -------
        tuple of dict
            Text of the rate [1/s] and of the stress [Pa] of each component, as the core compiles it.

        Raises
        ------
        ValueError
            If a component is none, is given twice, or has a value that the core cannot evaluate.
        """
        names = ("xx", "yy", "xy") if dim == 2 else ("xx", "yy", "zz", "xy", "xz", "yz")
        stress = self.stress if isinstance(self.stress, dict) or self.stress is None else dict.fromkeys(names[:dim], self.stress)
        given = []
        for what, of in (("rate", self.rate), ("stress", stress)):
            if of is not None and not isinstance(of, dict):
                raise ValueError(f"{what} of the periodic cell is {of!r}: give {{component: value}}, of {', '.join(names)}")
            found = {}
            for name, value in (of or {}).items():
                if name not in names:
                    raise ValueError(f"{what} of the periodic cell names {name!r}: give {listed(names, name)}")
                texts = None if isinstance(value, str) else texts_of(value)
                if texts is None or len(texts) != 1:
                    due = "give a finite number, cairn.Table, Harmonic or Expression"
                    raise ValueError(f"{what}[{name!r}] of the periodic cell is {value!r}: {due}")
                found[name] = texts[0]
            given.append(found)
        twice = sorted(set(given[0]) & set(given[1]))
        if self.shear_rate and names[-1 if dim == 2 else 4] in {*given[0], *given[1]}:
            twice.append(names[-1 if dim == 2 else 4])
        if twice:
            raise ValueError(f"component {twice[0]} of the periodic cell has two of rate, stress and shear_rate: give one")
        return tuple(given)

    def arrays(self, dim):
        """Gives the cell as the core takes it.

        Parameters
        ----------
        dim : int
            2 or 3.

        Returns
        -------
        tuple
            Whether each axis is periodic (3,), vectors (3, 3) by rows [m], corner (3,) [m], velocity gradient (3, 3) [1/s].

        Raises
        ------
        ValueError
            If there is not a length >= 0 for each axis, or a cell shears along an axis that is not periodic.
        """
        if isinstance(self.lengths, (tuple, list)) and None in self.lengths:
            raise ValueError(f"lengths of the periodic cell is {self.lengths}: give inf along axes that are not periodic")
        lengths = checks.reals("lengths of the periodic cell", self.lengths)
        if lengths.shape != (dim,) or np.any(np.isnan(lengths)) or np.any(lengths < 0):
            raise ValueError(f"lengths of the periodic cell is {self.lengths}: give {dim} lengths >= 0, inf where not periodic")
        periodic = np.zeros(3, bool)
        periodic[:dim] = np.isfinite(lengths) & (lengths > 0)
        vectors, corner, gradient = np.zeros((3, 3)), np.zeros(3), np.zeros((3, 3))
        vectors[range(dim), range(dim)] = np.where(periodic[:dim], lengths, 0.0)
        if self.corner is not None:
            corner[:dim] = checks.real_array("corner", self.corner, (dim,))
        if self.shear_rate or self.lean:
            if not (periodic[0] and periodic[dim - 1]):
                raise ValueError("shear_rate and lean need a cell that is periodic along its first and its last axis")
            vectors[dim - 1, 0] = checks.number("lean", self.lean)
            gradient[0, dim - 1] = checks.number("shear_rate", self.shear_rate)
        return periodic, vectors, corner, gradient


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
        self.count = 0
        self.legacy = None  # origin of a scene made by cairn.legacy
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
            Sets, as disks(...), wall(...), deformable(...) and others make them, and liquids of cn.fluid(...), which have no ids.

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
        liquids = [s for s in sets if getattr(s, "is_fluid", False)]
        for liquid in liquids:
            if liquid.dim != self.dim:
                raise ValueError(f"a fluid has {liquid.dim} dimensions and the scene {self.dim}: give Scene({liquid.dim})")
        sets = [s for s in sets if not getattr(s, "is_fluid", False)]
        flat, self._materials = checked_sets(self.dim, sets, self._materials, self.periodic)
        self.fluids += liquids
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
            If a rule names neither.
        """
        names = {"*"} | {n for pair in (self.species() if species is None else species) for n in pair if n}
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
    def load(cls, path):
        """Reads a scene written by save().

        Parameters
        ----------
        path : path-like
            Name of the file.

        Returns
        -------
        Scene
            The scene.

        Raises
        ------
        FileError
            If there is no such file, or it holds no scene.
        """
        from ..base.errors import FileError
        from ..files.checkpoint import load

        content = load(path, "a scene", ".scene.h5")
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


def in_order(rules):
    """Orders rules so that those of joints come last and take precedence.

    Parameters
    ----------
    rules : sequence
        (a, b, law) of each rule.

    Returns
    -------
    list
        The rules in this order.
    """
    joints = {a for a, _, law in rules if law is not None and law.name == "joint"}
    return [*(r for r in rules if r[0] not in joints), *(r for r in rules if r[0] in joints)]


def rules_to_dict(rules):
    """Gives rules as a file holds them.

    Parameters
    ----------
    rules : sequence
        (a, b, law) of each rule.

    Returns
    -------
    dict
        Content by the number of the rule.
    """
    out = {
        f"{k:06d}": {"a": a, "b": b, "law": law.name if law else "", "values": np.array(law.values if law else (), float)}
        for k, (a, b, law) in enumerate(rules)
    }
    for k, (_, _, law) in enumerate(rules):
        if law and law.of_temperature:
            out[f"{k:06d}"]["of_temperature"] = {f"{place:02d}": curve.to_dict() for place, curve in law.of_temperature}
    return out


def rules_from_dict(d):
    """Reads rules from a file: the inverse of rules_to_dict.

    Parameters
    ----------
    d : dict
        Content by the number of the rule.

    Returns
    -------
    list
        (a, b, law) of each rule.

    Raises
    ------
    ValueError
        If a name is none or a law is unknown.
    """
    for number, r in d.items():
        wrong = next((name for name in ("a", "b", "law") if not isinstance(r[name], str)), None)
        if wrong is not None:
            raise ValueError(f"{wrong} of rule {number} is {r[wrong]!r}: a name is due")
    rules = []
    for _, r in sorted(d.items()):
        curves = {int(place): time_functions.from_dict(c) for place, c in r.get("of_temperature", {}).items()}
        rules.append((r["a"], r["b"], law_from(r["law"], r["values"], curves) if r["law"] else None))
    return rules


def set_to_dict(s):
    """Gives the content of a scene file for a set of rigid bodies.

    Parameters
    ----------
    s : BodySet
        The set.

    Returns
    -------
    dict
        The content.

    Raises
    ------
    ValueError
        If it has a Python function, which no file holds.
    """
    d = {
        n: getattr(s, n)
        for n in ("position", "mass", "inertia", "velocity", "rotation", "damping", "depth", "surface_origin")
        if getattr(s, n) is not None
    }
    d |= {"group": s.group or "", "driven": ",".join(s.driven)}
    for name in ("drive", "force", "surface_velocity"):
        if getattr(s, name) is not None:
            d[name] = time_functions.to_dict(name, getattr(s, name))
    d["contactors"] = {}
    for j, c in enumerate(s.contactors):
        entry = {
            n: getattr(c, n)
            for n in ("shape", "body", "radius", "offset", "direction", "hull")
            if getattr(c, n) is not None
        }
        if c.hulls is not None:
            entry["hulls"] = dict(c.hulls._asdict())
        entry |= {"material": c.material.name, "density": c.material.density or np.nan}
        if c.joint:
            entry["joint"] = 1
        if (more := c.material.beside_density()) is not None:
            from .mesh_files import encoded

            entry["properties"] = encoded(more)
        d["contactors"][f"{j:06d}"] = entry
    return d


def set_from_dict(dim, d):
    """Makes a set of rigid bodies from the content of a file: the inverse of set_to_dict.

    Parameters
    ----------
    dim : int
        2 or 3.
    d : dict
        The content.

    Returns
    -------
    BodySet
        The set.
    """
    contactors = []
    for _, c in sorted(d["contactors"].items()):
        density = float(c["density"])
        more = {}
        if "properties" in c:
            from .mesh_files import decoded

            more = decoded(c["properties"])
        material = Material(c["material"], None if np.isnan(density) else density, **more)
        contactors.append(
            bodies.ContactorSet(
                c["shape"],
                material,
                c["body"],
                c["radius"],
                c.get("offset"),
                c.get("direction"),
                c.get("hull"),
                shapes.Hulls(**c["hulls"]) if "hulls" in c else None,
                "joint" in c,
            )
        )
    options = {n: d[n] for n in ("velocity", "rotation", "damping", "surface_origin") if n in d}
    for name in ("drive", "force", "surface_velocity"):
        if name in d:
            options[name] = time_functions.from_dict(d[name])
    if "depth" in d:
        options["depth"] = checks.positive("depth", float(d["depth"]))
    driven = tuple(n for n in d["driven"].split(",") if n)
    return bodies.checked(
        bodies.BodySet(
            dim, d["position"], d["mass"], d["inertia"], contactors, group=d["group"] or None, driven=driven, **options
        )
    )


def rule(a, b, law):
    """Checks a law between two sides; see Scene.interact.

    Parameters
    ----------
    a : Material or str
        One side.
    b : Material or str
        The other side.
    law : Law or None
        The law.

    Returns
    -------
    tuple
        Names of both sides and the law.

    Raises
    ------
    ValueError
        If a side is no name or the law is none.
    """
    if law is not None and not isinstance(law, Law):
        raise ValueError(f"law is {law!r}: give a law such as cairn.Coulomb(mu=0.4), or None for no contact")
    return _word("first side", a), _word("second side", b), law


def _word(what, given):
    word = given.name if isinstance(given, Material) else given
    if not isinstance(word, str) or not word:
        raise ValueError(f"{what} of an interaction is {given!r}: give a Material, the name of one or of a group, or '*'")
    return word


def chosen_rule(first, second, rules):
    """Chooses the rule that takes precedence for two species.

    Parameters
    ----------
    first : tuple
        Material and group of one side.
    second : tuple
        Material and group of the other side.
    rules : sequence
        (a, b, law) of each rule, in order.

    Returns
    -------
    tuple
        True if a rule names both sides, and its law or None.
    """
    best, chosen, ruled = -1, None, False
    for a, b, law in rules:
        weight = max(_weight(a, first, b, second), _weight(b, first, a, second))
        if weight >= best and weight >= 0:
            best, chosen, ruled = weight, law, True
    return ruled, chosen


def _weight(a, first, b, second):
    """Precedence of a rule (a, b) for the species (first, second): higher for groups than for materials, -1 for other names."""
    total = 0
    for word, (material, group) in ((a, first), (b, second)):
        if word == "*":
            continue
        if group and word == group:
            total += 3
        elif word == material:
            total += 1
        else:
            return -1
    return total


def mesh_groups(sets):
    """Gives the groups of the nodes of meshes, which do not touch each other unless a rule of the scene names both.

    Parameters
    ----------
    sets : sequence of BodySet
        Sets, of which those of meshes count.

    Returns
    -------
    set of str
        Names of the meshes.
    """
    return {s.mesh.name for s in sets if s.mesh is not None}


def checked_sets(dim, given, materials=None, periodic=None):
    """Checks sets before anything is changed.

    Parameters
    ----------
    dim : int
        2 or 3.
    given : sequence
        Sets of bodies or lists of them.
    materials : dict, optional
        {name: Material} known so far.
    periodic : Periodic, optional
        The cell, which must be wider than the bodies.

    Returns
    -------
    tuple
        Flat list of the sets, and {name: Material} with theirs.

    Raises
    ------
    ValueError
        If a set is wrong.
    """
    flat = [s for item in given for s in (item if isinstance(item, (list, tuple)) else [item])]
    for s in flat:
        if not isinstance(s, bodies.BodySet):
            if hasattr(s, "add_to"):
                raise ValueError(f"{s!r} is not a set of bodies: call its add_to(scene, material), which adds it")
            raise ValueError(f"{s!r} is not a set of bodies: give cairn.disks(...), cairn.wall(...) and the like")
        if s.dim != dim:
            raise ValueError(f"a set of bodies has {s.dim} dimensions and the scene {dim}: they must agree, give Scene({s.dim})")
    known = one_of_a_name(flat, materials or {})
    probe, meshes = _core.Scene(dim), {}
    if periodic is not None:
        probe.set_cell(*periodic.arrays(dim))
    for s in flat:
        insert(probe, s, {}, meshes=meshes)
    if periodic is not None:
        deformable = [(s.mesh.name, s.position) for s in flat if s.mesh is not None]
        refuse_narrow_cell(probe, *periodic.arrays(dim)[:2], deformable)
    return flat, known


def one_of_a_name(sets, known):
    """Collects the materials of sets by their names.

    Parameters
    ----------
    sets : sequence of BodySet
        The sets.
    known : dict
        {name: Material} known so far.

    Returns
    -------
    dict
        {name: Material} of the known ones and those of the sets.

    Raises
    ------
    ValueError
        If two materials of the same name differ: laws could not tell them apart.
    """
    known = dict(known)
    for s in sets:
        for c in s.contactors:
            first = known.setdefault(c.material.name, c.material)
            if first is c.material:
                continue
            both = first.with_(c.material)
            if both is not None:
                known[first.name] = both
            elif None not in (first.density, c.material.density) and first.density != c.material.density:
                raise ValueError(
                    f"two materials are named {first.name!r}, of densities {first.density:g} and {c.material.density:g}: "
                    "give them different names, by which laws tell them apart (or density=... to the bodies of one material)"
                )
            else:
                raise ValueError(f"two materials are named {first.name!r}, {first} and {c.material}: give them different names")
    return known


def _velocity_at(s, time):
    """Velocities of a set when it is inserted: driven dofs get their imposed velocity, so that the first step is exact."""
    if s.drive is None or not s.mask:
        return s.velocity
    drive = bodies.rows("drive", s.drive(time) if callable(s.drive) else s.drive, len(s), s.dim)
    velocity = np.zeros(drive.shape) if s.velocity is None else s.velocity.copy()
    for k, name in enumerate(bodies.DOFS[s.dim]):
        if name in s.driven:
            velocity[:, k] = drive[:, k]
    return velocity


def _within(name, numbers, end, what):
    """Raises ValueError for indices of contactors out of range; negative ones would count from the end."""
    numbers = np.asarray(numbers)
    wrong = np.flatnonzero((numbers < 0) | (numbers >= end))
    if wrong.size:
        raise ValueError(f"{name}[{wrong[0]}] of contactors is {numbers[wrong[0]]}: there are {end} {what}, from 0")


def insert(core, s, species, time=0.0, meshes=None):
    """Inserts a set into a core scene.

    Parameters
    ----------
    core : _core.Scene
        The scene of the core.
    s : BodySet
        The set.
    species : dict
        {(material, group): number}; missing entries are added.
    time : float, default 0
        Time at which driven dofs get their velocity [s].
    meshes : dict, optional
        {id() of a Deformable: its number in the core}; missing entries are added.

    Returns
    -------
    ndarray
        Ids of its bodies and parts.

    Raises
    ------
    ValueError
        If a contactor is on a body or a hull that is not there.
    """
    if s.mesh is not None:
        known = {} if meshes is None else meshes
        # numbered after the meshes in the core scene, since a simulation restored from a file has no other record
        number = known.get(id(s.mesh)) or 1 + max([int(core.raw_node("mesh").max(initial=0)), *known.values()])
        known[id(s.mesh)] = number
        first = core.add_nodes(number, s.position, None if s.velocity is None else s.velocity[:, : s.dim], s.mass)
        core.add_parts(number, s.parts)
    else:
        first = core.add_bodies(len(s), s.position, s.rotation, _velocity_at(s, time), s.mass, s.inertia)
    ids = np.arange(first, first + len(s) + s.parts)
    for c in s.contactors:
        _within("body", c.body, len(ids), "bodies")
        if c.hulls is not None:
            _within("hull", c.hull, len(c.hulls.first_vertex) - 1, "hulls")
        number = species.setdefault(c.species(s.group), len(species))
        hull = None
        if c.hulls is not None:
            h = c.hulls
            hull = (core.add_hulls(*h[:5], bool(h.facets), h.plane.reshape(-1), h.ball) + c.hull).astype(np.int32)
        core.add_contactors(c.shape, ids[c.body], np.array([number], np.int32), c.radius, c.offset, c.direction, hull)
    if s.mask and s.mesh is None:
        core.drive(ids[: len(s)], s.mask, None)
    return ids
