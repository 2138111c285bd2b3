"""What a checkpoint says of a simulation, looked at before any of it is used: the core takes numbers of bodies, materials and
hulls as they come. A seal tells damage by chance; this tells what no simulation can have written."""

import numpy as np

from .. import _core
from ..build.bodies import BodySet
from ..build.scene import rules_from_dict
from ..post.checkpoint import load
from ..post.errors import FileError
from ..pre import checks
from . import time_functions

# what the contents of a damaged file raise where they are put to use
DAMAGE = (ValueError, KeyError, TypeError, IndexError, AttributeError, OverflowError, MemoryError, RuntimeError)
MEMORY = ("h", "contactors_seen", "impulse_components", "state_components", "keys", "impulses", "states")


def restore(sim, path):
    """Simulation.restore: all that the file holds is looked at first; what is refused later still leaves all as it was."""
    content = load(path)
    if content.get("kind") != "checkpoint":
        raise FileError(path, "this file holds no checkpoint", "give a file written by Simulation.checkpoint")
    if content.get("scene") != sim._fingerprint():
        raise FileError(path, "the checkpoint belongs to another scene", "build the simulation from the same scene")
    before = {"species": sim._species, "rules": sim._rules, "sets": sim._sets, "dt": sim._dt, "info": sim._info}
    before["state"] = sim.get_state()
    try:
        made = _content(sim, path, content, before["state"])
    except FileError:
        raise
    except DAMAGE as error:
        raise _damaged(path, error) from error
    try:
        sim._take(**made)
    except Exception as error:
        sim._take(**before)
        raise _damaged(path, error) from error


def _damaged(path, error):
    told = error if isinstance(error, ValueError) else repr(error)
    return FileError(path, f"the checkpoint is damaged: {told}", "restart from an earlier checkpoint")


def _content(sim, path, content, now):
    """What a checkpoint holds, as Simulation._take takes it."""
    dim = sim.scene.dim
    if content["dim"] != dim:
        raise ValueError(f"dim is {content['dim']!r}: the scene has {dim}")
    names = [(_text(d["material"]), _text(d["group"])) for _, d in sorted(content["species"].items())]
    known, start = sim._sets, sim._sets_seen
    check(dim, content["state"], len(names), now)
    hulls = now["scene"].get("hulls"), content["state"]["scene"].get("hulls")
    if None not in hulls:
        same_hulls(*hulls)
    later = [
        _later_from_dict(path, dim, d, known[start + k] if start + k < len(known) else None)
        for k, (_, d) in enumerate(sorted(content["later"].items()))
    ]
    rules, species = rules_from_dict(content["rules"]), {pair: k for k, pair in enumerate(names)}
    sets = [*known[:start], *later]
    sim.scene.law_table(species, rules, sets)
    dt = checks.positive("dt", float(content["dt"]))
    return {"state": content["state"], "species": species, "rules": rules, "sets": sets, "dt": dt, "info": {}}


def _text(value):
    if not isinstance(value, str):
        raise ValueError(f"{value!r} is no name of a material or group")
    return value


def _later_from_dict(path, dim, d, known):
    """The set again; `known` is the one at the same place in the simulation that reads, for its Python functions."""
    n, values = len(d["ids"]), {}
    for name in ("drive", "force", "damping"):
        if name not in d:
            continue
        if d[name]["kind"] == "python":
            if known is None or not callable(getattr(known, name)) or len(known) != n:
                remedy = "add the same bodies by Simulation.add before restore, or use cairn.Table or cairn.Harmonic"
                raise FileError(path, f"{name} of bodies that came in later is a Python function, which no file holds", remedy)
            values[name] = getattr(known, name)
        else:
            values[name] = time_functions.from_dict(d[name])
    mass = None if d["carrier"] else np.ones(n)
    driven = tuple(name for name in d["driven"].split(",") if name)
    return BodySet(dim, np.zeros((n, dim)), mass, None, [], driven=driven, ids=np.asarray(d["ids"], np.int64), **values)


def check(dim, state, species, like):
    """Raises ValueError that names the field and the value of what is wrong in the state of a core (Simulation.get_state).

    species: how many materials and groups there are. like: the state of the simulation that restores.
    """
    scene = _dict("scene", state)
    empty = _core.Scene(dim)
    bodies = _fields("bodies", scene, empty.body_fields())
    contactors = _fields("contactors", scene, empty.contactor_fields())
    _check_bodies(dim, bodies, _whole("next_body_id", scene), like["scene"]["bodies"])
    hulls = _hulls(dim, scene["hulls"]) if "hulls" in scene else 0
    _check_contactors(contactors, len(bodies["id"]), _whole("next_contactor_id", scene), species, hulls)
    _cell(_dict("cell", scene))
    for name in ("memory", "projection_memory"):
        _memory(name, _dict(name, state))
    energy = _dict("energy", state)
    for name in like["energy"]:
        _finite(f"energy/{name}", np.asarray(energy[name], float))
    _whole("steps", state)
    _finite("time", np.asarray(state["time"], float))


def _dict(name, within):
    if not isinstance(within[name], dict):
        raise ValueError(f"{name} holds no names")
    return within[name]


def _whole(name, within, most=2**62):
    value = within[name]
    if isinstance(value, (bool, str)) or np.ndim(value) or int(value) != value or not 0 <= value < most:
        raise ValueError(f"{name} is {value!r}: a whole number from 0 on is due")
    return int(value)


def _finite(name, values):
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise ValueError(f"{name}[{bad[0]}] is {values.ravel()[bad[0]]}: a finite number is due")


def _within(name, values, low, end, what):
    values = np.ravel(values)
    bad = np.flatnonzero((values < low) | (values >= end))
    if bad.size:
        raise ValueError(f"{name}[{bad[0]}] is {values[bad[0]]}: there are {what} from {low} to {end - 1}")


def _array(name, values, kinds):
    if not isinstance(values, np.ndarray) or values.dtype.kind not in kinds:
        raise ValueError(f"{name} is no array of {'whole ' if 'f' not in kinds else ''}numbers")
    return values


def _fields(name, scene, rows):
    """The fields of bodies or contactors, those that are always there among them, each with all of its components."""
    given, known = _dict(name, scene), {row["name"]: row for row in rows}
    ids = _array(f"{name}/id", given["id"], "iu")
    for field, values in given.items():
        if field not in known:
            raise ValueError(f"{name}/{field} is no field that there is")
        due = len(ids) * known[field]["components"]
        kinds = "iu" if field in ("id", "body", "shape", "material", "hull", "driven") else "biuf"
        if _array(f"{name}/{field}", values, kinds).size != due:
            raise ValueError(f"{name}/{field} holds {values.size} numbers: {len(ids)} items need {due}")
    for field, row in known.items():
        if row["active"] and field not in given:
            raise ValueError(f"{name}/{field} is missing")
    return given


def _ids(name, ids, end):
    _within(name, ids, 0, end, "numbers")
    if len(np.unique(ids)) != len(ids):
        raise ValueError(f"{name} holds a number twice")


def _check_bodies(dim, bodies, end, like):
    _ids("bodies/id", bodies["id"], end)
    for name in ("position", "velocity", "rotation", "force", "driven_velocity", "angular_momentum"):
        if name in bodies:
            _finite(f"bodies/{name}", bodies[name])
    for name in ("mass", "inertia"):
        values = np.ravel(bodies[name])
        bad = np.flatnonzero(~(values > 0) if name == "mass" else ~(values >= 0))
        if bad.size:
            raise ValueError(f"bodies/{name}[{bad[0]}] is {values[bad[0]]}: it is more than 0")
    if "driven" in bodies:
        _within("bodies/driven", bodies["driven"], 0, 1 << (3 * dim - 3), "sets of dofs")
        for name in ("driven_velocity", "reaction"):
            if name not in bodies:
                raise ValueError(f"bodies/{name} is missing")
    for name, others in (("rotation", ("rotation_begin",)), ("angular_momentum", ("inverse_inertia", "momentum_begin"))):
        for other in others if name in bodies else ():
            if other not in bodies:
                raise ValueError(f"bodies/{other} is missing")
    if "angular_momentum" in bodies and "rotation" not in bodies:
        raise ValueError("bodies/rotation is missing")
    if len(like["id"]) and ("rotation" in like) and "rotation" not in bodies and len(bodies["id"]) >= len(like["id"]):
        raise ValueError("bodies/rotation is missing")


def _check_contactors(contactors, bodies, end, species, hulls):
    _ids("contactors/id", contactors["id"], end)
    _within("contactors/body", contactors["body"], 0, bodies, "bodies")
    names = np.array(_core.shapes())
    _within("contactors/shape", contactors["shape"], 0, len(names), "shapes")
    _within("contactors/material", contactors["material"], 0, max(species, 1), "materials and groups")
    radius = np.ravel(contactors["radius"])
    _finite("contactors/radius", radius)
    if np.any(radius < 0):
        raise ValueError(f"contactors/radius[{int(np.argmax(radius < 0))}] is {radius.min()}: a radius is 0 or more")
    for name in ("offset", "direction"):
        if name in contactors:
            _finite(f"contactors/{name}", contactors[name])
    shapes = names[np.ravel(contactors["shape"])]
    if "direction" not in contactors and np.any(np.isin(shapes, _core.shapes("directed"))):
        raise ValueError("contactors/direction is missing")
    is_hull = np.isin(shapes, _core.shapes("hull"))
    if "hull" not in contactors:
        if np.any(is_hull):
            raise ValueError("contactors/hull is missing")
        return
    hull = np.ravel(contactors["hull"])
    _within("contactors/hull", hull[is_hull], 0, hulls, "hulls")
    _within("contactors/hull", hull[~is_hull], -1, 0, "hulls of other shapes")


def _hulls(dim, hulls):
    """How many there are. Their cuts rise, their numbers stay within the hull, their lengths are those that the cuts tell."""
    starts, end = {}, {}
    for name in ("first_vertex", "first_face", "first_edge", "first_corner"):
        first = starts[name] = np.ravel(_array(f"hulls/{name}", hulls[name], "iu")).astype(np.int64)
        if first.size == 0 or first[0] != 0 or np.any(np.diff(first) < 0):
            raise ValueError(f"hulls/{name} does not rise from 0")
        end[name] = int(first[-1])
    count, faces = len(starts["first_vertex"]) - 1, end["first_face"]
    for name, due in (("first_face", count), ("first_edge", count), ("first_corner", faces)):
        if len(starts[name]) != due + 1 and not (name == "first_corner" and len(starts[name]) == 1):
            raise ValueError(f"hulls/{name} holds {len(starts[name])} numbers: {due + 1} are due")
    corners, edges = end["first_corner"], end["first_edge"]
    whole = {"corner_vertex": corners, "corner_edge": corners, "edge": None}
    real = {"vertex": dim * end["first_vertex"], "normal": dim * faces, "offset": faces, "inner": count, "radius": count}
    for name, due in {**whole, **real}.items():
        values = np.ravel(_array(f"hulls/{name}", hulls[name], "iu" if name in whole else "iuf"))
        if due is not None and values.size != due and not (name in whole and values.size == 0):
            raise ValueError(f"hulls/{name} holds {values.size} numbers: {due} are due")
        if name in real:
            _finite(f"hulls/{name}", values)
    if edges and np.ravel(hulls["edge"]).size % edges:
        raise ValueError(f"hulls/edge holds {np.ravel(hulls['edge']).size} numbers, no multiple of {edges} edges")
    return count


def same_hulls(now, given):
    """Raises ValueError where hulls that both have are cut and numbered otherwise: a simulation never changes that."""
    shared = min(len(now["first_vertex"]), len(given["first_vertex"])) - 1
    if shared <= 0:
        return
    faces = int(now["first_face"][shared])
    edges = int(now["first_edge"][shared])
    corners = int(now["first_corner"][faces]) if len(now["first_corner"]) > faces else 0
    each_edge = len(now["edge"]) // max(int(now["first_edge"][-1]), 1)
    for name, size in (
        ("first_vertex", shared + 1), ("first_face", shared + 1), ("first_edge", shared + 1), ("first_corner", faces + 1),
        ("corner_vertex", corners), ("corner_edge", corners), ("edge", edges * each_edge),
    ):  # fmt: skip
        if not np.array_equal(np.ravel(now[name])[:size], np.ravel(given[name])[:size]):
            raise ValueError(f"hulls/{name} is not that of the scene")


def _cell(cell):
    if len(cell["periodic"]) != 3 or not all(isinstance(p, (bool, np.bool_)) for p in cell["periodic"]):
        raise ValueError(f"cell/periodic is {cell['periodic']!r}: three of true and false are due")
    for name, due in (("vectors", 9), ("corner", 3), ("velocity_gradient", 9)):
        if _array(f"cell/{name}", cell[name], "f").size != due:
            raise ValueError(f"cell/{name} holds {cell[name].size} numbers: {due} are due")
        _finite(f"cell/{name}", cell[name])
    along = np.reshape(cell["vectors"], (3, 3))[np.array(cell["periodic"], bool)]
    if np.linalg.matrix_rank(along) < len(along):
        raise ValueError("cell/vectors of periodic directions lie in each other")


def _memory(name, memory):
    for part in MEMORY:
        if part not in memory:
            raise ValueError(f"{name}/{part} is missing")
    _finite(f"{name}/h", np.asarray(memory["h"], float))
    _whole("contactors_seen", memory)
    impulses, states = _whole("impulse_components", memory, 7), _whole("state_components", memory, 4096)
    keys = _array(f"{name}/keys", memory["keys"], "iu")
    contacts = keys.size // 4
    if keys.size % 4:
        raise ValueError(f"{name}/keys holds {keys.size} numbers: 4 for each contact are due")
    for part, components in (("impulses", impulses), ("states", states)):
        if _array(f"{name}/{part}", memory[part], "f").size != contacts * components:
            raise ValueError(f"{name}/{part} holds {memory[part].size} numbers: {contacts} contacts need {contacts * components}")
    _finite(f"{name}/impulses", memory["impulses"])
