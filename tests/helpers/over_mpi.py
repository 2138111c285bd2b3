"""Scripts that tests run over processes of MPI."""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from cairn.base.open_ranks import library

STARTER = shutil.which("mpirun")
needs_mpi = pytest.mark.skipif(
    not (STARTER and Path(library()).exists()), reason="no mpirun, or Cairn was built without MPI: ranks of MPI are not tested"
)
PILE = """
import sys
import cairn as cn, numpy as np
rock = cn.Material("rock", density=2600.0)
scene = cn.Scene(dim=2, gravity=(-6.0, -9.81))
scene.interact(rock, rock, cn.Coulomb(mu=0.4))
rng = np.random.default_rng(3)
x = np.stack(np.meshgrid(np.arange(8), np.arange(8)), -1).reshape(-1, 2) * 0.97 + 0.6 + rng.uniform(-0.02, 0.02, (64, 2))
scene.add(cn.disks(x, rng.uniform(0.42, 0.48, 64), rock), cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0), (1, 0), rock))
sim = cn.Simulation(scene, dt=4e-3, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-6)), overlap="ignore", ranks=RANKS)
"""


def text(ranks, more):
    """The script of a pile of disks over ranks, with further lines."""
    return PILE.replace("RANKS", repr(ranks)) + more


def started(folder, script, processes=2, *, words=None, expect=0):
    """Runs a script over processes, for a minute at most; returns its output and errors."""
    path = folder / "pile.py"
    path.write_text(script)
    command = words or [STARTER, "--oversubscribe", "-n", str(processes), sys.executable, str(path)]
    allowed = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        command, cwd=folder, env={**os.environ, **allowed}, capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode == 0) == (expect == 0), done.stderr
    return done.stdout, done.stderr


DIGESTS = """
import json, sys
sys.path[:0] = FOLDERS
import MODULE as of
found = {}
for name in NAMES:
    sim = MADE
    found[name] = of.digest(sim)
with open(f"{sim.ranks.rank}.json", "w") as file:
    json.dump(found, file)
"""


def digest_of(arrays):
    """Digest of the bits of arrays."""
    return hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in arrays)).hexdigest()


def digests(folder, module, names, made, processes=2):
    """[{name: digest}] of each process. made: text that makes a simulation over "mpi" of `name` with `of`, a module of tests."""
    folders = [str(Path(of).parent) for of in (sys.modules[module].__file__, __file__)]
    script = DIGESTS.replace("FOLDERS", repr(folders)).replace("MODULE", module).replace("NAMES", repr(list(names)))
    started(folder, script.replace("MADE", made), processes)
    return [json.loads((folder / f"{rank}.json").read_text()) for rank in range(processes)]


def here(steps):
    """The simulation of the same script over three ranks of this process, after some steps."""
    names = {}
    exec(text(3, f"sim.run({steps}, progress=False)"), names)  # the same script
    return names["sim"]


def waited(for_what, seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if for_what():
            return True
        time.sleep(0.02)
    return False


def alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().split(") ")[-1][0] != "Z"
    except OSError:
        return False
