"""Files whose seal is right and whose numbers no simulation can have: refused by name, and nothing has changed. Each kind
runs in a process of its own, so that a crash is a failed test."""

import os
import random
import subprocess
import sys

import cairn as cn
import numpy as np
import pytest
from cairn import _core, problems
from cairn.files import checkpoint
from cairn.post import FileError
from damaged import damaged
from small_scenes import heap

MANY = 20000 if os.environ.get("CAIRN_FULL") else 40


FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def blocks_in_space():
    rock = cn.Material("rock", density=2700.0)
    scene = cn.Scene(dim=3, gravity=(0, 0, -9.81))
    corners = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)])
    scene.add(cn.polyhedra([(corners + [0, 0, 0.1], FACES), (corners + [0, 0.05, 0.3], FACES)], rock))
    scene.add(cn.spheres([[0.6, 0, 0.1], [0.6, 0, 0.3]], 0.1, rock), cn.wall((0, 0, 0), (0, 0, 1), rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.4))
    return scene


def simulation(kind):
    scene = blocks_in_space() if kind == "blocks" else heap(int(kind[0]))
    return cn.Simulation(scene, 2e-3, cn.NSCD(solver=cn.NLGS(tol=1e-6)), overlap="ignore")


def restores(kind, folder, many):
    """Restores damaged checkpoints; ends with a word on what came of them."""
    path, chance = os.path.join(folder, "a.checkpoint.h5"), random.Random(13)
    sim = simulation(kind)
    for _ in range(3):
        sim.step()
    sim.checkpoint(path)
    content = checkpoint.load(path)
    sim.step()
    refused = 0
    for _ in range(many):
        what, wrong = damaged(content, chance)
        checkpoint.save(path, wrong)
        before = sim._core.get_state()
        print(what, file=sys.stderr, flush=True)
        try:
            sim.restore(path)
        except FileError as error:
            assert str(path) in str(error) and error.remedy, what
            refused += 1
            after = sim._core.get_state()
            assert same(before, after), what
            continue
        try:
            info = sim.step()
        except cn.Error:  # told by the step, which leaves all as it was
            info = None
        position = sim.bodies.position
        assert info is None or info["status"] != "converged" or np.all(np.isfinite(position)), what
        checkpoint.save(path, content)
        sim.restore(path)
    print("refused", refused)


def same(a, b):
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    return np.asarray(a).tobytes() == np.asarray(b).tobytes()


def loads(kind, folder, many):
    """Reads damaged scenes."""
    path, chance = os.path.join(folder, "a.scene.h5"), random.Random(17)
    (blocks_in_space() if kind == "blocks" else heap(int(kind[0]))).save(path)
    content = checkpoint.load(path, "a scene")
    refused = 0
    for _ in range(many):
        what, wrong = damaged(content, chance)
        checkpoint.save(path, wrong, "a scene")
        print(what, file=sys.stderr, flush=True)
        try:
            scene = cn.Scene.load(path)
        except FileError as error:
            assert str(path) in str(error) and error.remedy, what
            refused += 1
            continue
        try:
            cn.Simulation(scene, 2e-3, overlap="ignore").step()
        except ValueError:  # as it is told of a scene that a script has built
            pass
    print("refused", refused)


def reads_problems(kind, folder, many):
    """Reads damaged problems: matrices with other starts, rows, columns and sizes."""
    import h5py

    chance = random.Random(19)
    path = os.path.join(folder, "a.hdf5")
    n = 6
    W = np.eye(2 * n) + 0.1 * np.eye(2 * n, k=1) + 0.1 * np.eye(2 * n, k=-1)
    problems.fclib.write(path, problems.Problem(2, W, np.tile([-1.0, 0.1], n), np.full(n, 0.3)), like=kind)
    with open(path, "rb") as file:
        whole = file.read()
    refused = 0
    for _ in range(many):
        with open(path, "wb") as file:
            file.write(whole)
        with h5py.File(path, "r+") as file:
            group = chance.choice(["fclib_local/W", "fclib_local/W", "fclib_local/vectors", "fclib_local"])
            name = chance.choice([k for k in file[group] if isinstance(file[f"{group}/{k}"], h5py.Dataset)])
            old = file[f"{group}/{name}"][()]
            what, new = damaged({name: old}, chance)
            print(group, what, file=sys.stderr, flush=True)
            del file[f"{group}/{name}"]
            if name in new and new[name] is not None and not isinstance(new[name], (dict, list)):
                file[f"{group}/{name}"] = new[name]
        try:
            p = problems.read(path)
        except problems.ProblemFileError as error:
            assert str(path) in str(error)
            refused += 1
            continue
        assert np.all(np.isfinite(p.solve(tol=1e-6, max_iter=50).r))
    print("refused", refused)


@pytest.mark.parametrize("what, kind", [
    ("restores", "2"), ("restores", "3"), ("restores", "blocks"), ("loads", "2"), ("loads", "blocks"),
    ("reads_problems", "rows"), ("reads_problems", "columns"), ("reads_problems", "triplets"),
])  # fmt: skip
def test_numbers_that_no_file_can_hold_are_refused(tmp_path, what, kind):
    command = f"import sys; sys.path[:] = {sys.path!r}; import test_damaged as t; "
    command += f"t.{what}({kind!r}, {os.fspath(tmp_path)!r}, {MANY})"
    run = subprocess.run([sys.executable, "-W", "ignore", "-c", command], capture_output=True, text=True, timeout=540)
    assert run.returncode == 0, f"ended with {run.returncode}: {run.stderr[-3000:]}"
    assert int(run.stdout.split()[-1]) > MANY // 4


def test_a_face_that_names_a_vertex_there_is_not_is_refused():
    corners = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    for place in range(4):  # the second corner was looked up before it was checked
        faces = [list(face) for face in FACES]
        faces[2][place] = 10**15
        cuts = np.cumsum([0, *map(len, faces)])
        with pytest.raises(cn.Error, match="names vertex 1000000000000000 of 8"):
            _core.Scene(3).add_hulls(corners.ravel(), [0, 8], [0, 6], cuts, np.concatenate(faces))
