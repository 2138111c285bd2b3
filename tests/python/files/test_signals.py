"""A simulation stopped by a signal closes its file; one that is killed leaves every output flushed."""

import os
import signal
import subprocess
import sys

import pytest

cn = pytest.importorskip("cairn")
if not hasattr(cn, "Simulation"):
    pytest.skip("the compiled part is not there", allow_module_level=True)

SCRIPT = """
import sys
import numpy as np
import cairn as cn

rock = cn.Material("rock", density=2800.0)
scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
x, y = np.meshgrid(np.arange(12.0), np.arange(10.0))
scene.add(cn.disks(np.stack([x.ravel() + 0.2 * (y.ravel() % 2), y.ravel() + 0.6], 1), 0.49, rock))
scene.add(cn.wall(point=(0, 0), normal=(0, 1), material=rock))
scene.interact(rock, rock, cn.Coulomb(mu=0.4))
sim = cn.Simulation(scene, dt=1e-3)


def told(sim):
    if sim.steps % 2 == 0:
        print(sim.steps, flush=True)


sim.run(steps=10**9, output=sys.argv[1], every=2, checkpoint_every=5, callback=told)
print("closed", flush=True)
"""


def start(path):
    return subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(path)],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_signal(tmp_path, number):
    path = tmp_path / "run.vtkhdf"
    process = start(path)
    for line in process.stdout:
        if int(line) >= 20:
            break
    process.send_signal(number)
    rest = process.stdout.read().split()
    status = process.wait(timeout=60)
    if number == signal.SIGKILL:
        assert status == -signal.SIGKILL
    else:
        assert status == 0 and rest.pop() == "closed"
    told = max([int(line), *map(int, rest)])
    with cn.load(path) as run:
        assert run[0].step == 0 and run[-1].step >= told
        assert len(run) >= told // 2 + 1
        if number != signal.SIGKILL:
            assert run.history["step"][-1] == run[-1].step  # the last step taken is an output
        assert len(run[-1].bodies) == 121
    from cairn.files.checkpoint import checkpoint_path, load

    assert load(checkpoint_path(path))["kind"] == "checkpoint"
