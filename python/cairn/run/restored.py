"""Restoration of checkpoints, checked before use: the state of the core by cxx/files/state_check.cpp, the part kept by Python
here."""

import numpy as np

from ..base import checks
from ..base.errors import DAMAGE, FileError
from ..files.checkpoint import STAYS_IN_FILE, load
from ..model.rules import rules_from_dict, rules_to_dict
from ..options.solvers import Default, may_be_pack
from . import cracks, driven_cell
from .sets import FUNCTIONS, free_masses, later_from_dict, mesh_from_dict
from .views import core_of


def restore(sim, path):
    """See Simulation.restore. The content of the file is checked first; after an error the previous state is restored."""
    with sim._failing_alike(path):
        made = _read(sim, path)
    before = {"species": sim._species, "rules": sim._rules, "sets": sim._sets, "dt": sim._dt, "info": sim._info}
    before |= {"state": sim.get_state(), "strategy": sim._strategy}
    if sim._cell is not None:
        before["cell"] = sim._cell, core_of(sim).kept_volume
    try:
        with sim._failing_alike(path):
            try:
                sim._take(**made)
            except Exception as error:
                raise _damaged(path, error) from error
    except FileError:
        sim._take(**before)
        raise


def _read(sim, path):
    """Checked content of the checkpoint at a path, as arguments of Simulation._take."""
    content = load(path, stays_from=None if sim.ranks is None else STAYS_IN_FILE)
    if sim.ranks is not None:  # rank 0 replaces the file by its next checkpoint, and sets of bodies are kept
        content = {name: value if name == "state" else _copied(value) for name, value in content.items()}
    if not isinstance(content.get("kind"), str) or content["kind"] != "checkpoint":
        raise FileError(path, "this file holds no checkpoint", "give a file written by Simulation.checkpoint")
    of_program = "scene" not in content and "core_scene" in content  # written in C or Fortran, without laws and drives
    name, own = ("core_scene", sim._core_scene) if of_program else ("scene", sim._fingerprint())
    if not isinstance(content.get(name), str) or (content[name] != own and not _is_older(sim, content)):
        raise FileError(path, "the checkpoint belongs to another scene", "build the simulation from the same scene")
    try:
        return _content(sim, path, _completed(sim, content) if of_program else content)
    except FileError:
        raise
    except DAMAGE as error:
        raise _damaged(path, error) from error


def _copied(value):
    """A value of a checkpoint with all of its arrays in memory."""
    if isinstance(value, dict):
        return {name: _copied(of) for name, of in value.items()}
    if isinstance(value, list):
        return [_copied(of) for of in value]
    return np.array(value) if isinstance(value, np.ndarray) else value


def _is_older(sim, content):
    """True for a file of this scene by an older version, whose fingerprint counted parts of meshes as bodies."""
    try:
        return sim._is_older_state(content["state"])
    except DAMAGE:
        return False


def _completed(sim, content):
    """Content of a checkpoint from C or Fortran, completed by laws, species and step of the simulation."""
    species = {f"{k:06d}": {"material": m, "group": g} for (m, g), k in sim._species.items()}
    return {"dt": sim._dt, "species": species, "rules": rules_to_dict(sim._rules), "later": {}, **content}


def _damaged(path, error):
    told = error if isinstance(error, ValueError) else repr(error)
    return FileError(path, f"the checkpoint is damaged: {told}", "restart from an earlier checkpoint")


def _content(sim, path, content):
    """Checked content of a checkpoint, as arguments of Simulation._take."""
    dim = sim.scene.dim
    if content["dim"] != dim:
        raise ValueError(f"dim is {content['dim']!r}: the scene has {dim}")
    names = [(_text(d["material"]), _text(d["group"])) for _, d in sorted(content["species"].items())]
    known, start = sim._sets, sim._sets_seen
    sim.check_state(content["state"], len(names))
    of_ids = {s.ids.tobytes(): s for s in known[start:]}
    later = _later(path, dim, [d for _, d in sorted(content["later"].items())], of_ids, known[:start])
    rules, species = rules_from_dict(content["rules"]), {pair: k for k, pair in enumerate(names)}
    sets = cracks.restored([*known[:start], *later], content.get("cracks", {}))
    sim.scene.law_table(species, rules, sets)
    dt = checks.positive("dt", float(content["dt"]))
    made = {"state": content["state"], "species": species, "rules": rules, "sets": sets, "dt": dt, "info": {}}
    if "cell" in content:  # older files hold none
        made["cell"] = driven_cell.from_dict(sim.scene, content["cell"])
    return {**made, "strategy": _strategy(sim, content.get("solver"))}


def solver_to_dict(sim):
    """Entry of a checkpoint for a solver chosen by the simulation: the choice dates from the last added bodies, and might differ
    if it were made again. Empty if the user chose the solver."""
    return {"solver": type(sim.strategy.solver).__name__} if _chooses(sim) else {}


def _chooses(sim):
    return isinstance(getattr(sim._given, "solver", None), Default)


def _strategy(sim, name):
    """Strategy with the solver that the writing simulation had chosen; older files do not name it."""
    if name is None or not _chooses(sim) or name == type(sim.strategy.solver).__name__:
        return sim.strategy
    if name not in ("Auto", "NLGS"):
        raise ValueError(f"solver is {name!r}: Auto or NLGS is chosen")
    packs = may_be_pack(core_of(sim).scene, sim._rules, free_masses(sim._sets))
    return sim._given.with_solver(sim._given.solver.chosen(name, packs))


def _text(value):
    if not isinstance(value, str):
        raise ValueError(f"{value!r} is no name of a material or group")
    return value


def _later(path, dim, content, of_ids, first):
    """Sets added after the start, rebuilt from a checkpoint. of_ids: {ids as bytes: set} of the reading simulation; first: its
    initial sets."""
    out, k = [], 0
    while k < len(content):
        d = content[k]
        known = of_ids.get(np.asarray(d["ids"], np.int64).tobytes())
        if "made" in d and (known is None or known.mesh is None or known.mesh.name != d["mesh"]):
            end = k + 1
            while end < len(content) and content[end].get("mesh") == d["mesh"] and "made" not in content[end]:
                end += 1
            out += mesh_from_dict(d, [part["ids"] for part in content[k:end]], [*first, *out])
            k = end
            continue
        out.append(_later_from_dict(path, dim, d, known))
        k += 1
    return out


def _later_from_dict(path, dim, d, known):
    """A later set rebuilt from a checkpoint. known: the set with the same ids in the reading simulation, which supplies Python
    functions, or None."""
    if "mesh" in d:
        if known is None or known.mesh is None or known.mesh.name != d["mesh"]:
            told = f"the mesh {d['mesh']!r} came in later, with a function in Python or a solver of its own, which no file holds"
            raise FileError(path, told, "add, or deform, the same bodies before restore")
        return known
    functions = {}
    for name in FUNCTIONS:
        if d.get(name, {}).get("kind") == "python":
            if known is None or not callable(getattr(known, name)) or len(known) != len(d["ids"]):
                remedy = "add the same bodies by Simulation.add before restore, or use cairn.Table or cairn.Harmonic"
                raise FileError(path, f"{name} of bodies that came in later is a Python function, which no file holds", remedy)
            functions[name] = getattr(known, name)
    return later_from_dict(dim, d, **functions)
