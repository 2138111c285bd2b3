"""Two runs compared: what agrees, what differs and where, and what cannot be compared."""

import csv
import os
import subprocess
import sys
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn.post.verify import verify

DATA = Path(os.environ.get("CAIRN_REFERENCE_DATA", Path(__file__).resolve().parents[4] / "shared")) / "legacy"


def heap(path, mu=0.3, shift=0.0, steps=40, dt=1e-3, count=5):
    rock = cn.Material("rock", density=2600.0)
    scene = cn.Scene(dim=2, gravity=(0.5, -9.81))
    centers = np.array([[0.0, 0.1], [0.21, 0.1], [0.1, 0.28], [0.33, 0.29], [0.5, 0.1]])[:count] + [shift, 0.0]
    scene.add(cn.disks(centers, 0.1, rock), cn.wall((0, 0), (0, 1), rock))
    scene.interact(rock, rock, cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=cn.NLGS(tol=1e-10)))
    sim.run(steps=steps, output=path, every=10, progress=False)
    return path


def command(*words):
    return subprocess.run([sys.executable, "-m", "cairn.cli", "verify", *map(str, words)], capture_output=True, text=True)


def test_a_run_agrees_with_itself_and_differs_from_another(tmp_path):
    a, same, other = heap(tmp_path / "a.vtkhdf"), heap(tmp_path / "same.vtkhdf"), heap(tmp_path / "b.vtkhdf", mu=0.05)
    alike = verify(a, same, {name: 0.0 for name in ("position", "velocity", "contacts", "gap", "force", "total_force")})
    assert alike.agrees and len(alike.rows) == 5 and alike.rows[-1]["force"] == 0.0
    different = verify(a, other)
    assert not different.agrees and "position is" in different.failures[0]
    assert different.rows[0]["position"] == 0.0 and different.rows[-1]["position"] > 1e-4
    grows = [r["position_rms"] for r in different.rows]
    assert grows == sorted(grows) and different.rows[-1]["force"] > 0.01


def test_norms_are_what_they_say(tmp_path):
    """All disks but the wall are moved by a hundredth of a radius; the wall is not."""
    a, b = heap(tmp_path / "a.vtkhdf", steps=0), heap(tmp_path / "b.vtkhdf", shift=0.001, steps=0)
    result = verify(a, b)
    assert result.rows[0]["position"] == pytest.approx(0.01, rel=1e-9)
    assert result.rows[0]["position_rms"] == pytest.approx(0.01 * np.sqrt(5 / 6), rel=1e-9)
    assert verify(a, b, size=1.0).rows[0]["position"] == pytest.approx(0.001, rel=1e-9)
    assert verify(a, b, {"position": 0.0101}).agrees and not verify(a, b, {"position": 0.0099}).agrees


def test_the_command_has_a_verdict_a_table_and_a_picture(tmp_path):
    a, other = heap(tmp_path / "a.vtkhdf"), heap(tmp_path / "b.vtkhdf", mu=0.05)
    good = command(a, a)
    assert good.returncode == 0 and "the runs agree" in good.stdout
    bad = command(a, other, "--tol", "position=1e-6", "-o", tmp_path / "d.png", "--csv", tmp_path / "d.csv")
    assert bad.returncode == 3 and "the runs differ" in bad.stdout and "FAILS: position" in bad.stdout
    assert (tmp_path / "d.png").stat().st_size > 5000
    with open(tmp_path / "d.csv") as file:
        assert len(list(csv.DictReader(file))) == 5
    assert command(a, other, "--until", "0").returncode == 0


def test_what_cannot_be_compared_is_refused(tmp_path):
    a = heap(tmp_path / "a.vtkhdf", steps=10)
    fewer = heap(tmp_path / "fewer.vtkhdf", steps=10, count=4)
    assert "bodies are in one of the runs only" in verify(a, fewer, {"position": 10}).failures[0]
    with pytest.raises(ValueError, match="no norm 'positon'"):
        verify(a, a, {"positon": 1})
    with pytest.raises(cn.FileError, match="no such file"):
        verify(a, tmp_path / "none.vtkhdf")
    with pytest.raises(ValueError, match="no instant in common"):
        verify(a, a, until=-1)
    wrong = command(a, a, "--tol", "position")
    assert wrong.returncode == 1 and "NAME=VALUE" in wrong.stderr
    (tmp_path / "empty").mkdir()
    with pytest.raises(cn.FileError, match="no BODIES.DAT"):
        verify(a, tmp_path / "empty")


@pytest.mark.skipif(not DATA.is_dir(), reason="the sample data of LMGC90 are not here (CAIRN_REFERENCE_DATA)")
def test_stored_results_of_lmgc90_against_ours(tmp_path):
    case = DATA / "restitution2d"
    scene = cn.legacy.read_datbox(case)
    sim = cn.Simulation(scene, 5e-4, cn.NSCD(0.5, cn.NLGS(tol=1e-10), 0.01, contact_point="surface"), overlap="ignore")
    sim.run(steps=1600, output=tmp_path / "ours.vtkhdf", every=1600, progress=False)
    result = verify(case, tmp_path / "ours.vtkhdf", {"position": 1e-5, "velocity": 1e-5, "contacts": 0, "total_force": 1e-5})
    assert result.agrees, result.table()
    text, full = DATA / "disks2d_box" / "OUTBOX", DATA / "disks2d_box" / "lmgc90.h5"
    assert verify(text, full, {"position": 1e-5, "force": 1e-6, "gap": 1e-6, "contacts": 0}).agrees


def bare(path, out, history):
    """A run with the outputs of another as programs in C and Fortran write them: no step is told, but for the history."""
    from cairn.files.writer import RunWriter

    with cn.load(path) as run, RunWriter(out, {"shapes": cn._core.shapes()}, dim=run.dim) as writer:
        for step in run:
            of_contacts = {name: np.array(step.contacts[name]) for name in step.contacts.names}
            bodies = {name: np.array(step.bodies[name]) for name in ("position", "velocity", "radius", "id")}
            bodies["velocity"] = np.column_stack([bodies["velocity"][:, : run.dim], np.array(step.bodies["spin"]).reshape(-1, 1)])
            writer.write_step(step.time, step.time_detection, step.step, bodies, of_contacts)
            if history and step.step:
                writer.write_history(step.time, step.step, {"dt": 1e-3})
    return out


@pytest.mark.parametrize("history", [True, False])
def test_runs_whose_scene_tells_no_step_are_compared(tmp_path, history):
    a, other = heap(tmp_path / "a.vtkhdf"), heap(tmp_path / "b.vtkhdf", mu=0.05)
    same = bare(a, tmp_path / "bare.vtkhdf", history)
    result = verify(a, same, {"position": 0.0, "velocity": 0.0, "contacts": 0.0, "gap": 0.0})
    assert result.agrees, result.failures
    assert result.rows[-1]["force"] == (0.0 if history else None)
    assert verify(same, bare(other, tmp_path / "c.vtkhdf", history)).rows[-1]["contacts"] is not None
    assert command(a, same).returncode == 0
    if not history:
        assert "force is not known at any instant" in verify(a, same, {"force": 0.1}).failures[0]
