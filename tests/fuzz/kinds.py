"""Kinds of files that Cairn reads: makers of valid files, mutators, and uses of files that were read.

A Kind has `make(folder)`, which returns the path to damage (a file, or a folder of files); `damage(path, chance)`, which
returns (name of the damage, new bytes) for one file; `use(path)`, which reads the file and uses its content. A reader reports
faults by cairn.FileError; a ValueError of a step, which undamaged scenes may raise as well, is accepted.
"""

import random
import sys
import warnings
from dataclasses import dataclass
from pathlib import Path

import cairn as cn
import numpy as np
from cairn import legacy, problems
from cairn.files import checkpoint

from . import mutators

sys.path.insert(0, str(Path(__file__).parent.parent / "helpers"))
import small_datbox  # noqa: E402
from damaged import damaged  # noqa: E402
from made_up import write  # noqa: E402
from small_scenes import heap  # noqa: E402

ROCK = cn.Material("rock", density=2700.0)
FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
CORNERS = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)])


class NoNumber(Exception):
    """A damaged file was read without an error, and a result computed from it is not finite."""


@dataclass
class Kind:
    """One kind of file. share: of the inputs that are asked for, how many are worth their time."""

    name: str
    make: object
    damage: object
    use: object
    share: float = 1.0


def finite(what, *arrays):
    for array in arrays:
        if array is not None and not np.all(np.isfinite(np.asarray(array, float))):
            raise NoNumber(what)


def _blocks():
    scene = cn.Scene(dim=3, gravity=(0, 0, -9.81))
    scene.add(cn.polyhedra([(CORNERS + [0, 0, 0.1], FACES), (CORNERS + [0, 0.05, 0.3], FACES)], ROCK))
    scene.add(cn.spheres([[0.6, 0, 0.1], [0.6, 0, 0.3]], 0.1, ROCK), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.4))
    return scene


def _simulation(scene):
    return cn.Simulation(scene, 2e-3, cn.NSCD(solver=cn.NLGS(tol=1e-6, max_iter=200)), overlap="ignore")


def _step(sim):
    """Steps a simulation that was read: the step may be refused, and a converged one has finite results."""
    if sim is None:
        return
    try:
        info = sim.step()
    except ValueError:
        return
    if info["status"] == "converged":
        finite("bodies", sim.bodies.position, sim.bodies.velocity)
        finite("nodes", sim.nodes.position, sim.nodes.velocity)


# ---------------------------------------------------------------------- HDF5 of Cairn


def _seal(what):
    """Contents changed and sealed again, or bytes, headers or trees of the file."""

    def damage(path, chance):
        how = chance.choice(["contents", "contents", "bytes", "headers", "trees"])
        if how == "contents":
            told, content = damaged(checkpoint.load(path, what), chance)
            other = path.with_name("sealed.h5")
            checkpoint.save(other, content, what)
            return told, other.read_bytes()
        return _by(how)(path, chance)

    return damage


def _by(how):
    change = getattr(mutators, how + "_of")
    return lambda path, chance: change(path.read_bytes(), chance)


def _scene_file(scene):
    def make(folder):
        path = folder / "a.scene.h5"
        scene().save(path)
        return path

    return make


def _use_scene(path):
    _step(_simulation_of(cn.Scene.load(path)))


def _simulation_of(scene):
    try:
        return _simulation(scene)
    except ValueError:  # as it is told of a scene that a script has built
        return None


def _checkpoint(folder):
    sim = _simulation(_blocks())
    for _ in range(3):
        sim.step()
    path = folder / "a.checkpoint.h5"
    sim.checkpoint(path)
    _checkpoint.simulation = sim
    return path


def _use_checkpoint(path):
    sim = _checkpoint.simulation
    try:
        sim.restore(path)
    except cn.FileError:
        _step(sim)
        raise
    try:
        _step(sim)
    finally:
        _checkpoint.simulation = _simulation(_blocks())


def _run(folder):
    path = folder / "a.vtkhdf"
    write(path, 5).close()
    return path


def _use_run(path):
    with cn.load(path) as run:
        for step in run:
            for fields in (step.bodies, step.contacts):
                for name in fields:
                    fields[name]
        run.history, run.scene, run.provenance, run.periodic  # noqa: B018
        if len(run):
            run.contact_network()
            run.measure()


def _append(path):
    from cairn.post import RunWriter

    writer = RunWriter.go_on(path, 2)
    writer.close()
    _use_run(path)


# ---------------------------------------------------------------------- problems


def _problem(n=6):
    W = np.eye(2 * n) + 0.1 * np.eye(2 * n, k=1) + 0.1 * np.eye(2 * n, k=-1)
    return problems.Problem(2, W, np.tile([-1.0, 0.1], n), np.full(n, 0.3))


def _problem_file(name):
    def make(folder):
        path = folder / name
        problem = _problem()
        problems.write(path, problem, *([problem.solve(tol=1e-6)] if name.endswith("hdf5") else []))
        return path

    return make


def _compressed(folder):
    """Written again by h5py, each array compressed: it is read by a process of its own."""
    import h5py

    path = folder / "a.hdf5"
    sound = _problem_file("sound.hdf5")(folder)
    with h5py.File(sound, "r") as file, h5py.File(path, "w", libver="latest") as packed:

        def pack(name, member):
            if isinstance(member, h5py.Dataset):
                packed.create_dataset(name, data=member[()], compression="gzip" if member.size > 1 else None)

        file.visititems(pack)
    sound.unlink()
    return path


def _damage_fclib(path, chance):
    how = chance.choice(["contents", "contents", "bytes", "trees"])
    if how != "contents":
        return _by(how)(path, chance)
    import h5py

    other = path.with_name("other.hdf5")
    other.write_bytes(path.read_bytes())
    with h5py.File(other, "r+") as file:
        group = chance.choice(["fclib_local/W", "fclib_local/W", "fclib_local/vectors", "fclib_local", "solution"])
        name = chance.choice([k for k in file[group] if isinstance(file[f"{group}/{k}"], h5py.Dataset)])
        told, new = damaged({name: file[f"{group}/{name}"][()]}, chance)
        del file[f"{group}/{name}"]
        if new.get(name) is not None and not isinstance(new[name], (dict, list)):
            file[f"{group}/{name}"] = new[name]
    return f"{group}/{told}", other.read_bytes()


def _use_problem(path):
    problem = problems.read(path)
    if str(path).endswith("hdf5"):
        problems.read_solution(path)
    if len(problem.mu) < 1000:
        finite("impulses", problem.solve(tol=1e-6, max_iter=20).r)


# ---------------------------------------------------------------------- meshes, legacy


def _text(damage_bytes=1, damage_words=3):
    def damage(path, chance):
        how = chance.choice(["bytes"] * damage_bytes + ["words"] * damage_words)
        return _by(how)(path, chance)

    return damage


def _cube(name):
    def make(folder):
        import meshio
        import trimesh

        path = folder / name
        if name.endswith((".msh", ".vtu", ".vtk")):
            points = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
            cells = [("hexahedron", np.array([[0, 1, 3, 2, 4, 5, 7, 6]]))]
            more = {"file_format": "gmsh22", "binary": False} if name.endswith("msh") else {"binary": False}
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                meshio.write(path, meshio.Mesh(points, cells), **more)
        else:
            cube = trimesh.creation.box((1, 1, 1))
            cube.export(path, **({"file_type": "stl_ascii"} if name == "text.stl" else {}))
        return path

    return make


def _use_blocks(path):
    from cairn.pre import importing

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        blocks = importing.read(path)
    finite("corners", *(vertices for vertices in getattr(blocks, "vertices", ())))


def _use_elastic(path):
    body = cn.ElasticBody.read(path, young=1e7, poisson=0.3, density=2000.0)
    finite("matrices", body.K.data, body.M.data)


def _datbox(folder):
    disks = [
        small_datbox.body("RBDY2", small_datbox.DISK, at=(0.19 * k, 0.1, 0), number=k + 1, avrd=0.1, gyrd=0.07) for k in range(3)
    ]
    bar = small_datbox.body("RBDY2", small_datbox.BAR, number=4, avrd=1.0, gyrd=1.0)
    see = small_datbox.SEE.format("RBDY2", "DISKx", "DISKx", "BLEUx")
    return small_datbox.write(folder / "DATBOX", "".join(disks) + bar, see, drives=small_datbox.held("RBDY2", 4))


def _use_datbox(path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scene = legacy.read_datbox(path, unmapped="skip")
        _step(_simulation_of(scene))


KINDS = [
    Kind("scene of grains", _scene_file(heap), _seal("a scene"), _use_scene),
    Kind("scene of blocks", _scene_file(_blocks), _seal("a scene"), _use_scene),
    Kind("checkpoint", _checkpoint, _seal("a checkpoint"), _use_checkpoint),
    Kind("run", _run, lambda p, c: _by(c.choice(["bytes", "headers", "headers", "trees"]))(p, c), _use_run),
    Kind("run that goes on", _run, lambda p, c: _by(c.choice(["bytes", "headers", "headers", "trees"]))(p, c), _append),
    Kind("FCLIB problem", _problem_file("a.hdf5"), _damage_fclib, _use_problem),
    Kind("FCLIB problem, compressed", _compressed, _by("bytes"), _use_problem, share=0.1),
    Kind("Siconos text", _problem_file("a.dat"), _text(), _use_problem),
    Kind("DATBOX", _datbox, _text(), _use_datbox),
    Kind("gmsh of an elastic body", _cube("a.msh"), _text(), _use_elastic),
    Kind("gmsh of blocks", _cube("a.msh"), _text(), _use_blocks),
    Kind("VTU", _cube("a.vtu"), _text(), _use_blocks),
    Kind("STL, binary", _cube("a.stl"), _text(3, 0), _use_blocks),
    Kind("STL, text", _cube("text.stl"), _text(), _use_blocks),
    Kind("OBJ", _cube("a.obj"), _text(), _use_blocks),
    Kind("PLY", _cube("a.ply"), _text(2, 1), _use_blocks),
]


def tried(kind, folder, seeds, after=None):
    """Damages the file once for each seed and uses it: yields (seed, name of the damage, outcome, detail).

    outcome: "refused" (cairn.FileError), "read", "raw error", "no number". after(seed, what): called before each.
    """
    folder = Path(folder)
    sound = kind.make(folder)
    files = sorted(sound.iterdir()) if sound.is_dir() else [sound]
    whole = {path: path.read_bytes() for path in files}
    assert _outcome(kind, sound)[0] == "read", (kind.name, _outcome(kind, sound))
    for seed in seeds:
        chance = random.Random(f"{kind.name} {seed}")
        path = chance.choice(files)
        for each, data in whole.items():
            each.write_bytes(data)
        what, data = kind.damage(path, chance)
        path.write_bytes(data)
        if after:
            after(seed, what)
        yield seed, f"{path.name}: {what}", *_outcome(kind, sound)


def _outcome(kind, path):
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            kind.use(path)
    except cn.FileError as error:
        return ("refused", "") if error.remedy and str(error.path) else ("raw error", f"FileError without a remedy: {error}")
    except NoNumber as error:
        return "no number", str(error)
    except (Exception, SystemExit) as error:
        return "raw error", f"{type(error).__name__}: {error}"
    return "read", ""


__all__ = ["KINDS", "Kind", "tried"]
