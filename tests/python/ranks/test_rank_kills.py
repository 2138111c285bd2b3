"""Processes of ranks that are killed: nothing that was flushed is lost, and none of the others hangs."""

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn.base.open_ranks import library
from over_mpi import alive, waited

STARTER = shutil.which("mpirun")
pytestmark = pytest.mark.skipif(not (STARTER and Path(library()).exists()), reason="no mpirun, or Cairn was built without MPI")
KILLS = int(os.environ.get("CAIRN_KILLS", 200 if os.environ.get("CAIRN_FULL") else 2))
RANKS, PATIENCE = 3, 60.0  # [s]
SCENE = """
import os, sys
import cairn as cn, numpy as np
rock = cn.Material("rock", density=2600.0)
scene = cn.Scene(dim=2, gravity=(-6.0, -9.81))
scene.interact(rock, rock, cn.Bonded(mu=0.4))
x = np.stack(np.meshgrid(np.arange(5), np.arange(5)), -1).reshape(-1, 2) + 0.7
scene.add(cn.disks(x, 0.5, rock), cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0), (1, 0), rock))
sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=50)), overlap="ignore", ranks=RANKS)
"""
SCRIPT = (
    SCENE.replace("RANKS", '"mpi"')
    + """
open(f"pid{sim.ranks.rank}", "w").write(str(os.getpid()))
while True:
    sim.run(2, output="killed.vtkhdf", append=sim.steps > 0, every=2, checkpoint_every=2, progress=False)
    if sim.ranks.first:
        with open("marks", "a") as marks:
            marks.write(f"{sim.steps}\\n")
"""
)


def last_mark(folder):
    path = folder / "marks"
    words = path.read_text().split() if path.exists() else []
    return int(words[-1]) if words else 0


def kill(folder, trial):
    """Runs a scene over processes and kills one of them, or all in odd trials, at an instant that `trial` draws.

    Returns
    -------
    dict
        "killed": number of processes; "flushed": last step whose output was told; "outputs" in the file, finite; "checkpoint":
        its step; "bonds" after a further step over other ranks; "seconds" until all had ended.
    """
    chance = random.Random(trial)
    (folder / "run.py").write_text(SCRIPT)
    allowed = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMP_NUM_THREADS": "1"}
    words = [STARTER, "--oversubscribe", "-n", str(RANKS), sys.executable, "run.py"]
    with open(folder / "told", "w") as told:
        starter = subprocess.Popen(words, cwd=folder, env={**os.environ, **allowed}, stdout=told, stderr=told)
    try:
        assert waited(lambda: last_mark(folder) >= 2, PATIENCE), (folder / "told").read_text()
        pids = [int((folder / f"pid{rank}").read_text()) for rank in range(RANKS)]
        time.sleep(0.5 * chance.random())
        killed = pids if trial % 2 else [pids[chance.randrange(RANKS)]]
        begun = time.monotonic()
        for pid in killed:
            os.kill(pid, signal.SIGKILL)
        assert waited(lambda: starter.poll() is not None, PATIENCE) and starter.returncode != 0
        assert waited(lambda: not any(alive(pid) for pid in pids), PATIENCE)
        seconds = time.monotonic() - begun
    finally:
        starter.kill()
        starter.wait()
    run = cn.load(folder / "killed.vtkhdf")
    finite = sum(bool(np.isfinite(step.bodies.position).all()) for step in run)
    names = {}
    exec(SCENE.replace("RANKS", "4"), names)
    sim = names["sim"]
    sim.restore(folder / "killed.checkpoint.h5")
    saved = sim.steps
    sim.step()
    bonds = int(np.count_nonzero(sim.contacts.beta > 0))
    return {"killed": len(killed), "flushed": last_mark(folder), "outputs": finite, "checkpoint": saved, "bonds": bonds,
            "seconds": seconds}  # fmt: skip


@pytest.mark.parametrize("trial", range(KILLS))
def test_a_kill_loses_nothing_that_was_flushed(tmp_path, trial):
    found = kill(tmp_path, trial)
    assert found["outputs"] >= found["flushed"] // 2 + 1 and found["checkpoint"] >= found["flushed"] - 2
    assert found["bonds"] > 0
