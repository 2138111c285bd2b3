"""Runs killed (SIGKILL) at random instants: completeness of their files.

    script/bench kills [--kills 200] [--scenes NAME ...]

A line for each kind of run: kills; outputs flushed before them; files that open; lost outputs (flushed, but missing in the file);
checkpoints that exist, can be read, and continue to the same bits as a run without a kill.
"""

import argparse
import csv
import os
import random
import signal
import sys
import tempfile
import time
import warnings
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"
sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "python"))

import cairn as cn
import numpy as np
from small_scenes import heap

ROCK = cn.Material("rock", density=2000.0)
DT, STEPS = 2e-3, 200


def _polygons():
    scene = cn.Scene(2, gravity=(0, -9.81))
    square = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]
    scene.add(cn.polygons([np.array(square) + [0, 0.5 + 1.01 * k] for k in range(5)], ROCK), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
    return scene


def _capsules():
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    centers = [[0.3 * (k % 3), 0.3 * (k // 3), 0.2 + 0.3 * k] for k in range(9)]
    scene.add(cn.capsules(centers, 0.1, 0.2, ROCK), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    return scene


def _mesh():
    from cairn.model.elastic import ElasticBody

    x, y = np.meshgrid(np.linspace(0, 1, 7), np.linspace(0.02, 0.32, 3))
    a = (np.arange(6) + 7 * np.arange(2)[:, None]).ravel()
    cells = {"quad": np.stack([a, a + 1, a + 8, a + 7], 1)}
    body = ElasticBody(np.stack([x.ravel(), y.ravel()], 1), cells, young=1e7, poisson=0.3, density=1000.0, rayleigh=(0.0, 1e-3))
    scene = cn.Scene(2, gravity=(0, -9.81))
    scene.add(cn.wall((0, 0), (0, 1), ROCK), *cn.deformable(body, ROCK, contact=np.arange(7)))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    return scene


def _periodic():
    scene = cn.Scene(2, gravity=(0, -9.81), periodic=cn.Periodic(lengths=(8.0, 0.0)))
    rng = np.random.default_rng(3)
    places = np.stack(np.meshgrid(np.arange(8), np.arange(4)), -1).reshape(-1, 2) + 0.5 + 0.01 * rng.random((32, 2))
    scene.add(cn.disks(places, 0.45, ROCK), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    return scene


def _sim(scene, strategy=None):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return cn.Simulation(scene, DT, strategy, overlap="ignore")


KINDS = {
    "disks": lambda: _sim(heap(2)),
    "spheres": lambda: _sim(heap(3)),
    "disks, Auto": lambda: _sim(heap(2), cn.NSCD(solver=cn.Auto(tol=1e-8))),
    "polygons": lambda: _sim(_polygons()),
    "capsules": lambda: _sim(_capsules()),
    "restitution": lambda: _sim(heap(2, law=cn.Restitution(mu=0.3, normal=0.5))),
    "bonded": lambda: _sim(heap(2, law=cn.Bonded(mu=0.3))),
    "smooth DEM": lambda: _sim(heap(2, law=cn.LinearSpring(stiffness=1e6, mu=0.3)), cn.SmoothDEM(unstable="ignore")),
    "granular element": lambda: _sim(heap(2), cn.GranularElement(stiffness=1e6)),
    "projection": lambda: _sim(heap(2), cn.NSCD(project_positions=True)),
    "periodic": lambda: _sim(_periodic()),
    "deformable": lambda: _sim(_mesh()),
}


def child(name, path, end):
    """Runs, and tells each output that is flushed."""
    sim = KINDS[name]()

    def tell(s):
        os.write(end, b"%d\n" % s.steps)

    os.write(end, b"begins\n")
    sim.run(STEPS, output=path, every=1, checkpoint_every=5, callback=tell, progress=False)
    os.kill(os.getpid(), signal.SIGSTOP)  # waits for its end


def whole_run(name):
    """Positions and velocities after each step of a run that nobody kills."""
    sim, states = KINDS[name](), [None]
    for _ in range(STEPS):
        sim.step()
        states.append((sim.bodies.position.tobytes(), sim.bodies.velocity.tobytes()))
    return states


def killed(name, folder, chance, states):
    """One run, killed. Returns (outputs flushed, opens, outputs lost, checkpoint there, and right)."""
    path = Path(folder) / "a.vtkhdf"
    for old in Path(folder).iterdir():
        old.unlink()
    read_end, write_end = os.pipe()
    process = os.fork()  # one thread: nothing of OpenMP is copied
    if process == 0:
        try:
            child(name, path, write_end)
        finally:
            os._exit(1)
    os.close(write_end)
    with open(read_end, "rb") as told_by:
        assert told_by.readline() == b"begins\n"
        time.sleep(chance.random() * killed.seconds)
        os.kill(process, signal.SIGKILL)
        told = [int(line) for line in told_by.read().splitlines()]
    os.waitpid(process, 0)
    flushed = told[-1] if told else 0
    opens = lost = there = right = 0
    try:
        if path.exists():
            with cn.load(path) as run:
                steps = [step.step for step in run]
                opens = 1
                lost = sum(k not in steps for k in range(flushed + 1)) if told else 0
        else:
            opens, lost = int(not told), 0
    except cn.FileError as error:
        print(name, error, file=sys.stderr)
    saved = path.with_suffix(".checkpoint.h5")
    if saved.exists():
        there, sim = 1, KINDS[name]()
        sim.restore(saved)
        for _ in range(min(3, STEPS - sim.steps)):
            sim.step()
        right = int((sim.bodies.position.tobytes(), sim.bodies.velocity.tobytes()) == states[sim.steps])
    elif flushed >= 6:
        lost += 1
    return flushed, opens, lost, there, right


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--scenes", nargs="*")
    options = parser.parse_args()
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(["run", "kills", "outputs_flushed", "files_that_open", "outputs_lost", "checkpoints", "restarts_to_the_bit"])
    for name in options.scenes or KINDS:
        chance, states = random.Random(name), whole_run(name)
        begun = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:  # so long it takes: kills are spread over it
            KINDS[name]().run(STEPS, output=Path(folder) / "a.vtkhdf", every=1, checkpoint_every=5, progress=False)
        killed.seconds = min(time.monotonic() - begun, 1.0)
        with tempfile.TemporaryDirectory() as folder:
            rows = np.array([killed(name, folder, chance, states) for _ in range(options.kills)])
        table.writerow([name, options.kills, *rows.sum(axis=0)])
        sys.stdout.flush()


if __name__ == "__main__":
    main()
