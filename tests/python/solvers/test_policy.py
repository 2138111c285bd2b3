"""Numbers that steer solvers: one list, one page, and a variable of the environment that changes them for a study."""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
ROW = re.compile(r'^CAIRN_POLICY\((.*?), (\w+), (.*?), "(.*?)", "(.*?)", "(.*?)"\)', re.M)
STEP = """
import cairn as cn

rock = cn.Material("rock", density=1000.0)
scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
scene.add(cn.disks([[0, 0.1 + 0.2 * k] for k in range(30)], 0.1, rock), cn.wall((0, 0), (0, 1), rock))
scene.interact(rock, rock, cn.Coulomb(mu=0.3))
solver = cn.NLGS(tol=1e-6, max_iter=1000, acceleration="none")
print(cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(solver=solver)).step()["iterations"])
"""

PACK = """
import cairn as cn
import numpy as np

rock = cn.Material("rock", density=2500.0)
radii = np.random.default_rng(1).uniform(0.004, 0.006, 200)
scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -9.81))
scene.add(cn.spheres(cn.pre.deposit_spheres(radii, (0.05, 0.05)), radii, rock))
scene.add(cn.box(np.zeros(3), (0.05, 0.05, 0.2), rock, lid=False))
scene.interact("*", "*", cn.Coulomb(mu=0.5))
sim = cn.Simulation(scene, dt=1e-3, overlap="ignore")
sim.run(steps=40, progress=False)
sim.strategy = cn.NSCD(solver=cn.NLGS(tol=1e-12, enough=2e-12, patience=1, max_iter=200))
print(sim.step()["error"].hex())
"""


def listed():
    return ROW.findall((ROOT / "cxx/solvers/policy.def").read_text(encoding="utf-8"))


def ran(change, script=STEP):
    environment = {**os.environ, "CAIRN_POLICY": change, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, timeout=60)


def test_the_page_has_every_number_of_the_list():
    page = (ROOT / "docs/policy.md").read_text(encoding="utf-8")
    table = re.findall(r"^\| `(\w+)` \| (.*?) \| (.*?) \| (.*?) \| (.*?) \|", page, re.M)
    assert table == [row[1:] for row in listed()] and len(table) > 90


def test_every_number_is_read_by_a_solver():
    sources = [path for of in ("solvers", "ranks") for path in (ROOT / "cxx" / of).rglob("*.?pp") if path.stem != "policy"]
    text = "".join(path.read_text(encoding="utf-8") for path in sources)
    assert not [name for _, name, *_ in listed() if f"policy().{name}" not in text]


def test_a_study_changes_a_number_and_is_told():
    own, sooner, wrong = ran(""), ran("active_set_first=16"), ran("active_set_last=1")
    assert own.returncode == sooner.returncode == 0, own.stderr + sooner.stderr
    assert "CAIRN_POLICY" not in own.stderr and "CAIRN_POLICY changes active_set_first=16" in sooner.stderr
    assert int(sooner.stdout) < int(own.stdout)
    assert wrong.returncode != 0 and "CAIRN_POLICY has 'active_set_last=1': give name=number" in wrong.stderr


def test_extrapolated_sweeps_of_packs_end_in_damped_ones():
    """From the number clump_sweeps on, with the factor relaxation_damped, which means nothing before."""
    results = [ran(change, PACK) for change in ("", "relaxation_damped=0.75", "relaxation_damped=1", "clump_sweeps=1000",
                                                "clump_sweeps=1000 relaxation_damped=1")]  # fmt: skip
    assert not any(r.returncode for r in results), results[0].stderr
    own, same, other, extrapolated, unaffected = (float.fromhex(r.stdout) for r in results)
    assert own == same and own != other and own != extrapolated == unaffected
