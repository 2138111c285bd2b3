"""Test of a wheel installed by itself: import quickly, run the first scene and an arch, pass `cairn doctor`."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

MEASURE = """
import resource, time
import numpy
kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
begin = time.process_time()
import cairn
print(time.process_time() - begin, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - kilobytes) / 1024)
"""

SCENE = """
import cairn as cn
import numpy as np

rock = cn.Material("rock", density=2800.0)
scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
centers = np.array([(x, 0.5 + y) for y in range(5) for x in range(10)], dtype=float)
scene.add(cn.disks(centers, np.full(50, 0.5), rock))
scene.add(cn.wall(point=(0, 0), normal=(0, 1), material=rock))
scene.interact(rock, rock, cn.Coulomb(mu=0.4))
sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD())
sim.run(steps=200, output="pile.vtkhdf", every=20, progress=False)
assert sim.info["status"] == "converged", sim.info
assert len(cn.load("pile.vtkhdf")) == 11
"""

ARCH = """
import cairn as cn
from cairn.pre import masonry

blocks = masonry.arch(radius=5.0, thickness=0.8, voussoirs=21, depth=2.0)
scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -9.81))
blocks.add_to(scene, cn.Material("stone", density=2400.0))
scene.interact("*", "*", cn.Coulomb(mu=0.6))
sim = cn.Simulation(scene, dt=2e-3)
begin = sim.bodies.position.copy()
sim.run(steps=50, progress=False)
assert sim.info["status"] == "converged", sim.info
assert abs(sim.bodies.position - begin).max() < 1e-4, "the arch moves"
"""


def python(*arguments):
    ended = subprocess.run([sys.executable, *arguments], capture_output=True, text=True)
    if ended.returncode:
        sys.exit(f"{' '.join(arguments)[:80]} ended with {ended.returncode}:\n{ended.stdout}{ended.stderr}")
    return ended.stdout


for compiler in ("gcc", "gfortran", "cc", "c++"):
    assert not shutil.which(compiler), f"{compiler} is in reach: this is no bare environment"
place = Path(python("-c", "import cairn; print(cairn.__file__)").strip())
assert Path(sys.prefix) in place.parents, f"cairn was found at {place}"
seconds, megabytes = zip(*(map(float, python("-c", MEASURE).split()) for _ in range(5)))
print(f"import cairn: {min(seconds):.3f} s of CPU time and {min(megabytes):.0f} MB beyond numpy")
assert min(seconds) < 0.3 and min(megabytes) < 60
python("-c", SCENE)
print("first scene: runs, and its file is read")
python("-c", ARCH)
print("arch: stands")
found = json.loads(python("-m", "cairn", "doctor", "--json"))
assert found["self-test"]["verdict"].startswith("right"), found["self-test"]
print(f"cairn doctor: {found['self-test']['verdict']}; factors: {found['cairn']['factors']}")
