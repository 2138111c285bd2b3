"""Sets of bodies of a scene: as plain data, checked, and given to the core."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..base import checks, time_functions
from ..base.materials import Material
from . import bodies, shapes
from .extents import refuse_narrow_cell


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
    probe.leave_numbers(periodic is None)  # they are checked, and not kept
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
        return s.velocity  # that of driven dofs as well, see BodySet.imposed
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


def _same(known, array):
    """The array that is known, if the other one is equal: one of them takes memory."""
    return known if np.array_equal(known, array) else array


def in_core(scene, species, workspace=True):
    """Makes a core scene of a scene.

    Parameters
    ----------
    scene : Scene
        The scene.
    species : dict
        {(material, group): number}; missing entries are added.
    workspace : bool, default True
        Bodies have the arrays that steps of the whole work with; False: ranks have them, for their own bodies.

    Returns
    -------
    tuple
        The scene of the core, and the sets with the ids of their bodies.
    """
    core, numbers = _core.Scene(scene.dim), {}
    core.origin = [*scene.origin, 0.0][:3]
    core.reserve(
        sum(len(s) for s in scene.sets if s.mesh is None), sum(len(c.body) for s in scene.sets for c in s.contactors)
    )
    if not workspace:
        _core.release_workspace(core)
    if scene.periodic is not None:
        core.set_cell(*scene.periodic.arrays(scene.dim))
    sets = [s.with_(ids=_same(s.ids, insert(core, s, species, meshes=numbers))) for s in scene.sets]
    if not workspace:
        _core.release_workspace(core)  # of needs that came with the bodies
        _core.return_freed_memory()
    return core, sets
