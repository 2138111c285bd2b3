"""Modules loaded by `import cairn` and a scene of disks and spheres, and lazy imports."""

import importlib
import subprocess
import sys
from pathlib import Path

import cairn
import pytest

PACKAGE = Path(cairn.__file__).parent
LATER = ["model.meshes", "model.elastic", "model.mesh_faces", "model.surfaces", "run.contact_problem", "run.equilibrium",
         "run.meshes", "run.shadow", "run.soe", "legacy", "problems", "study"]  # fmt: skip

SCRIPT = """
import sys
import cairn as cn
rock = cn.Material("rock", density=2700.0)
scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
scene.add(cn.disks([[0.0, 0.1]], 0.1, rock), cn.wall((0, 0), (0, 1), rock))
scene.interact(rock, rock, cn.Coulomb(mu=0.3))
sim = cn.Simulation(scene, dt=1e-3)
sim.step()
sim.explain()
print(*[m for m in sys.modules if m.startswith(("cairn", "scipy", "matplotlib"))])
print(*[callable(getattr(cn, n)) for n in ("deformable", "LinearBody", "surface", "find_equilibrium")], cn.legacy.__name__)
"""


def test_modules_that_come_later_are_there():
    places = [PACKAGE / name.replace(".", "/") for name in LATER]
    assert all(place.is_dir() or place.with_suffix(".py").is_file() for place in places)


@pytest.mark.parametrize("former, now", [("pre.checks", "base.checks"), ("post.checkpoint", "files.checkpoint")])
def test_modules_that_scripts_import_keep_their_former_name(former, now):
    assert importlib.import_module(f"cairn.{former}") is importlib.import_module(f"cairn.{now}")


def test_scenes_load_what_they_use():
    lines = subprocess.run([sys.executable, "-c", SCRIPT], check=True, capture_output=True, text=True).stdout.splitlines()
    loaded = lines[-2].split()
    assert "cairn.run.simulation" in loaded
    assert not [name for name in loaded if name.removeprefix("cairn.") in LATER or not name.startswith("cairn")]
    assert lines[-1] == "True True True True cairn.legacy"


def test_what_comes_later_is_listed():
    listed = "import cairn as cn; print(set(cn.__all__) <= set(dir(cn)))"
    parts = "print(all(getattr(cn, n) for n in ('legacy', 'problems', 'soe', 'study')))"
    told = f"{listed}; {parts}"
    assert subprocess.run([sys.executable, "-c", told], check=True, capture_output=True, text=True).stdout.split() == ["True"] * 2
