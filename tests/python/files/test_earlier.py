"""Files that earlier versions wrote are read, and go on to the same numbers; names of the interface do not vanish."""

import inspect
import json
import tarfile
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn.files import checkpoint
from cairn.post.measures import measure

EARLIER = Path(__file__).with_name("earlier")


@pytest.fixture(scope="module", params=["files_1_0", "files_1_1"])
def folder(request, tmp_path_factory):
    """Scenes, runs and checkpoints of a version, unpacked."""
    path = tmp_path_factory.mktemp(request.param)
    with tarfile.open(EARLIER / f"{request.param}.tar.xz") as archive:
        archive.extractall(path, filter="data")
    return path


@pytest.mark.parametrize("name, dim", [("grains", 2), ("blocks", 3)])
def test_a_scene_and_a_checkpoint_go_on(folder, name, dim):
    scene = cn.Scene.load(folder / f"{name}.scene.h5")
    assert scene.dim == dim and scene.gravity[-1] == -9.81
    sim = cn.Simulation(scene, 5e-3, cn.NSCD(solver=cn.NLGS(tol=1e-12, max_iter=20000)), overlap="ignore")
    sim.restore(folder / f"{name}.checkpoint.h5")
    assert sim.steps == 60 and sim.time == pytest.approx(0.3)
    with cn.load(folder / f"{name}.vtkhdf") as run:
        for field in ("position", "velocity"):
            assert np.array_equal(getattr(sim.bodies, field), run[-1].bodies[field])  # to the bit
    sim.run(steps=20, progress=False)
    # results of the version that wrote them, by other sweeps: impulses of a pile are not unique
    with np.load(folder / f"{name}.npz") as then:
        assert sim.bodies.position == pytest.approx(then["position"], abs=1e-4)


@pytest.mark.parametrize("name, dim, bodies", [("grains", 2, 16), ("blocks", 3, 4)])
def test_a_run_is_read(folder, name, dim, bodies):
    with cn.load(folder / f"{name}.vtkhdf") as run:
        assert run.dim == dim and list(run.times) == pytest.approx([0.0, 0.15, 0.3])
        assert len(run[-1].bodies) == bodies and np.all(np.isfinite(run[-1].bodies.position))
        assert len(run[-1].contacts) and set(run.history["status"]) <= {"converged", "no_contacts", "iteration_limit"}
        assert len(run.history["time"]) == 60
        run.plot(-1)
        assert measure(run[-1])["contacts"] > 0


def test_nodes_of_meshes_that_were_bodies_are_read_and_go_on(tmp_path):
    """A disk between two meshes: their nodes stood among the bodies of scene, checkpoint and run."""
    with tarfile.open(EARLIER / "meshes_1_1.tar.xz") as archive:
        archive.extractall(tmp_path, filter="data")
    solver = cn.NLGS(tol=1e-12, max_iter=20000)
    sim = cn.Simulation(cn.Scene.load(tmp_path / "meshes.scene.h5"), 1e-3, cn.NSCD(solver=solver), overlap="ignore")
    sim.restore(tmp_path / "meshes.checkpoint.h5")
    assert sim.steps == 60 and len(sim.bodies) == 2 and len(sim.nodes) == sum(len(mesh.ids) for mesh in sim.meshes)
    with cn.load(tmp_path / "meshes.vtkhdf") as run:
        end = run[-1]
        assert len(end.bodies) == 2 + len(sim.nodes) and len(end.nodes) == 0 and end.drawn is end.bodies
        for of in (sim.bodies, sim.nodes):  # to the bit
            rows = end.rows_of(of.id)
            assert np.array_equal(of.position, end.bodies["position"][rows])
            assert np.array_equal(of.velocity, end.bodies["velocity"][rows][:, : of.velocity.shape[1]])
        run.plot(-1)
        run.plot(-1, "von_mises")
        assert measure(end)["contacts"] > 0
    sim.run(steps=20, progress=False)
    with np.load(tmp_path / "meshes.npz") as then:
        for k, mesh in enumerate(sim.meshes):
            assert mesh.displacement == pytest.approx(then[f"displacement_{k}"], rel=1e-9, abs=1e-12)


def test_a_file_that_was_damaged_is_refused(folder):
    path = folder / "damaged.checkpoint.h5"
    place = checkpoint.load(folder / "grains.checkpoint.h5")["state"]["scene"]["bodies"]["position"]
    whole = bytearray((folder / "grains.checkpoint.h5").read_bytes())
    whole[whole.index(np.ascontiguousarray(place).tobytes())] ^= 1
    path.write_bytes(whole)
    sim = cn.Simulation(cn.Scene.load(folder / "grains.scene.h5"), 1e-3, overlap="ignore")
    with pytest.raises(cn.FileError, match="damaged"):
        sim.restore(path)


def test_names_do_not_vanish():
    """names.json lists the names that users may have written: it grows, and a name is removed only after a version of
    warnings."""
    known = json.loads((EARLIER / "names.json").read_text(encoding="utf-8"))
    for name, parameters in known.items():
        thing = getattr(cn, name)
        if parameters is not None:
            now = inspect.signature(thing).parameters
            open_ended = any(p.kind == p.VAR_KEYWORD for p in now.values())
            assert set(parameters) <= set(now) or open_ended, (name, set(parameters) - set(now))
