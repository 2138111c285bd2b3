"""Sets of bodies that a simulation keeps: which of their bodies are there, and what a checkpoint says of later ones."""

import numpy as np

from ..pre import checks
from . import time_functions


def later_to_dict(s, sets):
    """What a checkpoint says of bodies that came in, or were driven, after the start; sets: all of the simulation, in order."""
    out = {"ids": s.ids, "driven": ",".join(s.driven), "carrier": s.mass is None}
    if s.mesh is not None:
        out["mesh"] = s.mesh.name
        if next(other for other in sets if other.mesh is s.mesh) is s:  # its sides come with it
            out |= _mesh_to_dict(s.mesh, sets)
    for name in ("drive", "force", "damping"):
        value = getattr(s, name)
        if value is not None:
            function = callable(value) and not hasattr(value, "to_dict")
            out[name] = {"kind": "python"} if function else time_functions.to_dict(name, value)
    return out


def _mesh_to_dict(d, sets):
    """What a Deformable was made of, if a file can hold it, and what rigid body it was."""
    from ..build.mesh_files import to_dict

    try:
        out = {"made": to_dict(d)}
    except ValueError:  # of a function in Python, a solver of another code: it is to be added before restore
        return {}
    former = getattr(d, "former", None)
    if former is not None:
        place = next(k for k, s in enumerate(sets) if s is former["set"])
        out["former"] = {**{name: former[name] for name in ("id", "row", "base", "own")}, "set": place}
    return out


def mesh_from_dict(content, ids, sets):
    """The sets of a mesh that came in later, with the ids of each; sets: those before it."""
    from ..build.mesh_files import from_dict
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
        former["set"] = sets[former["set"]]
        made[0].mesh.former = former
        carry(made[0].mesh, former["set"], former["row"])
    return made


def ids_of(scene):
    """Ids of the bodies and the nodes of a scene, as its state holds them, rising, (n,)."""
    return np.sort(np.concatenate([scene[of]["id"].ravel() for of in ("bodies", "nodes") if of in scene]))


def found(ids, present):
    """Which ids are among the rising `present`, and where: 0 for those that are not."""
    rows = np.minimum(np.searchsorted(present, ids), max(len(present) - 1, 0))
    alive = present[rows] == ids if len(present) else np.zeros(len(ids), bool)
    return alive, np.where(alive, rows, 0)


def dofs_named(s):
    """Bits of the dofs of which a set has the last word: those that it drives; all if it sets its bodies free."""
    return s.mask if s.mask or s.mass is not None else 2 ** (3 * s.dim - 3) - 1


def living(sets, seen, present):
    """The sets without those that came in after the first so many and have no body left among the rising `present`; of drives
    those, too, of which later ones drive every dof of every body."""
    spoken, kept = np.zeros(len(present), np.uint8), []  # dofs that later drives name
    for s in reversed(sets[seen:]):
        alive, rows = found(s.ids, present)
        rows = rows[alive]
        speaks = s.mesh is not None or len(rows) > 0
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
