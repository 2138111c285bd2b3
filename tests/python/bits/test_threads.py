"""One simulation in several threads of Python, and in a child after a fork."""

import os
import signal
import subprocess
import sys
import threading

import cairn as cn
import numpy as np
from small_scenes import heap


def test_threads_that_step_and_read_one_simulation_wait_for_each_other():
    alone = cn.Simulation(heap(2), 4e-3, overlap="ignore")
    for _ in range(60):
        alone.step()
    sim, failed = cn.Simulation(heap(2), 4e-3, overlap="ignore"), []

    def whole(work, times):
        try:
            for _ in range(times):
                work()
        except Exception as error:
            failed.append(error)

    def read():
        assert np.all(np.isfinite(sim.bodies.position)) and len(sim.contacts.gap) >= 0 and sim.energy["kinetic"] >= 0

    work = [(sim.step, 30), (sim.step, 30), (read, 300)]
    threads = [threading.Thread(target=whole, args=each) for each in work]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failed and sim.steps == 60
    assert np.array_equal(sim.bodies.position, alone.bodies.position)


FORK = """
import os, signal, sys
import cairn as cn, numpy as np
rock = cn.Material("rock", density=2700.0)
x, y = np.meshgrid(np.arange(100) * 0.21, np.arange(100) * 0.21 + 0.1)
scene = cn.Scene(dim=2, gravity=(0, -9.81))
scene.add(cn.disks(np.column_stack([x.ravel(), y.ravel()]), 0.1, rock), cn.wall((0, 0), (0, 1), rock))
scene.interact(rock, rock, cn.Coulomb(mu=0.3))
sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.NLGS(tol=1e-4), threads=2), overlap="ignore")
sim.step()
child = os.fork()
if child == 0:
    signal.alarm(60)
    sim.step()
    os._exit(7)
ended = os.waitpid(child, 0)[1]
sim.step()
print(os.waitstatus_to_exitcode(ended), sim.steps)
"""


def test_a_child_of_a_fork_steps_on_two_threads():
    run = subprocess.run([sys.executable, "-W", "ignore", "-c", FORK], capture_output=True, text=True, timeout=120,
                         env={**os.environ, "OMP_NUM_THREADS": "2"})  # fmt: skip
    assert run.stdout.split() == ["7", "2"], f"{run.stdout} {run.stderr} ({-signal.SIGALRM}: it hangs)"
