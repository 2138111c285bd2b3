"""Sets of bodies of a simulation: search for their present bodies, and entries of checkpoints for sets added later."""

import numpy as np

from ..base import checks, time_functions
from ..model.bodies import BodySet, replace

FUNCTIONS = ("drive", "force", "damping", "surface_velocity")  # of time, or constant


def later_to_dict(s, sets):
    """Entry of a checkpoint for a set added, or a drive imposed, after the start. sets: all sets of the simulation, in order."""
    out = {"ids": s.ids, "driven": ",".join(s.driven), "carrier": s.mass is None}
    if s.mesh is not None:
        out["mesh"] = s.mesh.name
        if next(other for other in sets if other.mesh is s.mesh) is s:  # written once, with its sides
            out |= _mesh_to_dict(s.mesh, sets)
    elif s.mass is not None:
        from ..model.scene_sets import set_to_dict

        bare = dict.fromkeys((*FUNCTIONS, "velocity", "surface_origin"))
        out["body"] = set_to_dict(replace(s, **bare))
        if s.surface_origin is not None:
            out["surface_origin"] = s.surface_origin
    for name in FUNCTIONS:
        value = getattr(s, name)
        if value is not None:
            function = callable(value) and not hasattr(value, "to_dict")
            out[name] = {"kind": "python"} if function else time_functions.to_dict(name, value)
    return out


def place_of(s, sets):
    """Index in `sets` of a set of rigid bodies, or of its copy from a checkpoint; None if it was removed with its bodies."""
    found = (k for k, of in enumerate(sets) if of.mesh is None and of.mass is not None and np.array_equal(of.ids, s.ids))
    return next(found, None)


def _mesh_to_dict(d, sets):
    """Entries for a Deformable: its arguments, and the rigid body it replaced; {} if no file can hold them."""
    from ..model.mesh_files import to_dict

    try:
        out = {"made": to_dict(d)}
    except ValueError:  # Python functions or a user's solver: the user adds this mesh again before restore
        return {}
    former = getattr(d, "former", None)
    if former is not None:
        out["former"] = {name: former[name] for name in ("id", "row", "base", "own")}
        place = place_of(former["set"], sets)
        if place is not None:
            out["former"]["set"] = place
        else:  # its set was added later and removed with its last body
            out["former"]["body"] = of = later_to_dict(former["set"], sets)
            if any(of.get(name, {}).get("kind") == "python" for name in FUNCTIONS):
                return {}
    return out


def mesh_from_dict(content, ids, sets):
    """Sets of a mesh added later, from its entry. ids: of each set; sets: all sets before it."""
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
    """Set of rigid bodies, or of imposed velocities, from its entry. functions: Python functions, which no file holds."""
    from ..model.scene_sets import set_from_dict

    ids = np.asarray(d["ids"], np.int64)
    n, values = len(ids), {name: time_functions.from_dict(d[name]) for name in FUNCTIONS if name in d and name not in functions}
    values |= {"driven": tuple(name for name in d["driven"].split(",") if name), "ids": ids, **functions}
    if "surface_origin" in d:
        values["surface_origin"] = np.asarray(d["surface_origin"])
    if "body" not in d:  # a drive, or a file of an older version without shapes
        return BodySet(dim, np.zeros((n, dim)), None if d["carrier"] else np.ones(n), None, [], **values)
    made = set_from_dict(dim, d["body"])
    if len(made) != n:
        raise ValueError(f"{n} ids of {len(made)} bodies")
    return replace(made, **values)


def ids_of(scene):
    """Rising ids (n,) of the bodies and nodes in the state of a scene."""
    return np.sort(np.concatenate([scene[of]["id"].ravel() for of in ("bodies", "nodes") if of in scene]))


def found(ids, present):
    """(mask of the ids in the rising array `present`, their indices there, 0 for the others)."""
    rows = np.minimum(np.searchsorted(present, ids), max(len(present) - 1, 0))
    alive = present[rows] == ids if len(present) else np.zeros(np.shape(ids), bool)
    return alive, np.where(alive, rows, 0)


def numbers_of_meshes(scene, sets):
    """{id() of the Deformable: number in the core} of the present meshes of sets, see insert."""
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
    """Bits of the dofs that a set determines: those that it drives; all of them if it sets its bodies free."""
    return s.mask if s.mask or s.mass is not None else 2 ** (3 * s.dim - 3) - 1


def living(sets, seen, present):
    """Sets without those after the first `seen` that have no body left in the rising array `present`, and without drives that
    later drives replace in every dof of every body."""
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
    """[(mass, mass over number of contact nodes)] [kg] of the deformable bodies of sets with a free axis."""
    meshes = {id(s.mesh): s.mesh for s in sets if s.mesh is not None}.values()

    def free(d):
        axes = [axis for group, given in d.fixed.items() for axis in checks.fixed_axes(group, given, d.body.dim)]
        return len(set(axes)) < d.body.dim

    masses = [(float(np.sum(d.body.nodal_mass())), max(1, len(d.contact_nodes))) for d in meshes if free(d)]
    return [(mass, mass / touching) for mass, touching in masses]
