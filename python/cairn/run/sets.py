"""Sets of bodies that a simulation keeps: which of their bodies are there, and what a checkpoint says of later ones."""

import numpy as np

from ..model.bodies import BodySet, replace
from ..pre import checks
from . import time_functions

FUNCTIONS = ("drive", "force", "damping")  # of time, or constant


def later_to_dict(s, sets):
    """What a checkpoint says of bodies that came in, or were driven, after the start; sets: all of the simulation, in order."""
    out = {"ids": s.ids, "driven": ",".join(s.driven), "carrier": s.mass is None}
    if s.mesh is not None:
        out["mesh"] = s.mesh.name
        if next(other for other in sets if other.mesh is s.mesh) is s:  # its sides come with it
            out |= _mesh_to_dict(s.mesh, sets)
    elif s.mass is not None:
        from ..model.scene import set_to_dict

        out["body"] = set_to_dict(replace(s, velocity=None, drive=None, force=None, damping=None))
    for name in FUNCTIONS:
        value = getattr(s, name)
        if value is not None:
            function = callable(value) and not hasattr(value, "to_dict")
            out[name] = {"kind": "python"} if function else time_functions.to_dict(name, value)
    return out


def place_of(s, sets):
    """Where a set of rigid bodies, or the one that a checkpoint made of it, is among sets; None if it went with its bodies."""
    found = (k for k, of in enumerate(sets) if of.mesh is None and of.mass is not None and np.array_equal(of.ids, s.ids))
    return next(found, None)


def _mesh_to_dict(d, sets):
    """What a Deformable was made of, if a file can hold it, and what rigid body it was."""
    from ..model.mesh_files import to_dict

    try:
        out = {"made": to_dict(d)}
    except ValueError:  # of a function in Python, a solver of another code: it is to be added before restore
        return {}
    former = getattr(d, "former", None)
    if former is not None:
        out["former"] = {name: former[name] for name in ("id", "row", "base", "own")}
        place = place_of(former["set"], sets)
        if place is not None:
            out["former"]["set"] = place
        else:  # it came in later, and went with its last body
            out["former"]["body"] = of = later_to_dict(former["set"], sets)
            if any(of.get(name, {}).get("kind") == "python" for name in FUNCTIONS):
                return {}
    return out


def mesh_from_dict(content, ids, sets):
    """The sets of a mesh that came in later, with the ids of each; sets: those before it."""
    from ..model.mesh_files import from_dict
    from .carried_forces import carry

    made = from_dict(content["made"])
    if len(made) != len(ids):
        raise ValueError(f"{len(ids)} sets of a mesh that has {len(made)}")
    for s, of in zip(made, ids):
        if len(of) < len(s):
            raise ValueError(f"{len(of)} ids of {len(s)} nodes")
        s.ids = np.asarray(of, np.int64)
    if "former" in content:
        former = dict(content["former"])
        former["set"] = later_from_dict(made[0].dim, former.pop("body")) if "body" in former else sets[former["set"]]
        made[0].mesh.former = former
        carry(made[0].mesh, former["set"], former["row"])
    return made


def later_from_dict(dim, d, **functions):
    """The set of rigid bodies, or the carrier of what drives them, again; functions: those in Python, which no file holds."""
    from ..model.scene import set_from_dict

    ids = np.asarray(d["ids"], np.int64)
    n, values = len(ids), {name: time_functions.from_dict(d[name]) for name in FUNCTIONS if name in d and name not in functions}
    values |= {"driven": tuple(name for name in d["driven"].split(",") if name), "ids": ids, **functions}
    if "body" not in d:  # files of before they held shapes have none of bodies, too
        return BodySet(dim, np.zeros((n, dim)), None if d["carrier"] else np.ones(n), None, [], **values)
    made = set_from_dict(dim, d["body"])
    if len(made) != n:
        raise ValueError(f"{n} ids of {len(made)} bodies")
    return replace(made, **values)


def ids_of(scene):
    """Ids of the bodies and the nodes of a scene, as its state holds them, rising, (n,)."""
    return np.sort(np.concatenate([scene[of]["id"].ravel() for of in ("bodies", "nodes") if of in scene]))


def found(ids, present):
    """Which ids are among the rising `present`, and where: 0 for those that are not."""
    rows = np.minimum(np.searchsorted(present, ids), max(len(present) - 1, 0))
    alive = present[rows] == ids if len(present) else np.zeros(np.shape(ids), bool)
    return alive, np.where(alive, rows, 0)


def numbers_of_meshes(scene, sets):
    """The core's numbers of the meshes of sets that are there, by the id() of each, see insert."""
    if all(s.mesh is None for s in sets):
        return {}
    order = np.argsort(scene.node("id").ravel())
    present, number, out = scene.node("id").ravel()[order], scene.node("mesh").ravel()[order], {}
    for s in sets:
        if s.mesh is not None and len(s):
            alive, rows = found(s.own_ids, present)
            if alive.all():
                out[id(s.mesh)] = int(number[rows[0]])
    return out


def dofs_named(s):
    """Bits of the dofs of which a set has the last word: those that it drives; all if it sets its bodies free."""
    return s.mask if s.mask or s.mass is not None else 2 ** (3 * s.dim - 3) - 1


def living(sets, seen, present):
    """The sets without those that came in after the first so many and have no body left among the rising `present`; of drives
    those, too, of which later ones drive every dof of every body."""
    spoken, kept = np.zeros(len(present), np.uint8), []  # dofs that later drives name
    meshes = {id(s.mesh) for s in sets[seen:] if s.mesh is not None and np.any(found(s.own_ids, present)[0])}
    for s in reversed(sets[seen:]):
        alive, rows = found(s.ids, present)
        rows = rows[alive]
        speaks = id(s.mesh) in meshes or len(rows) > 0
        if s.mass is None:
            named = np.uint8(dofs_named(s))
            speaks = np.any(named & ~spoken[rows])
            spoken[rows] |= named
        if speaks:
            kept.append(s)
    return [*sets[:seen], *reversed(kept)]


def free_masses(sets):
    """(mass, mass over its nodes that may touch) of each deformable body of sets that is free along some axis [kg]."""
    meshes = {id(s.mesh): s.mesh for s in sets if s.mesh is not None}.values()

    def free(d):
        axes = [axis for group, given in d.fixed.items() for axis in checks.fixed_axes(group, given, d.body.dim)]
        return len(set(axes)) < d.body.dim

    masses = [(float(np.sum(d.body.nodal_mass())), max(1, len(d.contact_nodes))) for d in meshes if free(d)]
    return [(mass, mass / touching) for mass, touching in masses]
