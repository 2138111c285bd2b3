"""Messages about missing or refused input: reason and remedy."""

import os
import subprocess
import sys

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2000.0)


def ball(**options):
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks([[0.0, 1.0], [3.0, 1.0]], 0.5, ROCK, **options))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    return scene


def test_info_says_why_it_has_no_such_name():
    scene = ball()
    scene.join(0, None, cn.Cable(points=[(0, 1), (0, 3), (1, 3)]))
    sim = cn.Simulation(scene, dt=1e-3)
    with pytest.raises(KeyError, match="no 'status' before the first step: run one"):
        sim.info["status"]
    assert "energy" in sim.info
    sim.step()
    with pytest.raises(KeyError, match="exists in scenes with joints about which a rigid body turns"):
        sim.info["joint_error"]
    with pytest.raises(KeyError, match=r"no 'statu'.*status"):
        sim.info["statu"]
    assert sim.info["status"] and sim.info.get("joint_error") is None


def test_forces_are_given_to_sets():
    sim = cn.Simulation(ball(), dt=1e-3)
    with pytest.raises(ValueError, match="force of bodies cannot be set.*force= of cn.disks.*: give a function of time"):
        sim.bodies.set(force=np.zeros((2, 3)))


def test_one_dof_is_driven_by_one_number():
    sim = cn.Simulation(ball(), dt=1e-3)
    sim.drive([0], "vx", 0.5)
    sim.step()
    assert sim.bodies.velocity[0, 0] == 0.5 and sim.bodies.velocity[1, 0] == 0.0
    with pytest.raises(ValueError, match=r"^velocity is 1.0: one number is of one dof, and 2 are named; give \(3,\)"):
        sim.drive([0], ("vx", "vy"), 1.0)
    with pytest.raises(ValueError, match=r"^velocity has shape \(4,\)"):
        sim.drive([0], "vx", np.zeros(4))
    with pytest.raises(ValueError, match="velocity is nan"):
        sim.drive([0], "vx", np.nan)
    with pytest.raises(ValueError, match="velocity|driven"):
        sim.drive([0], "vz", 1.0)


def test_fixed_is_true_or_false():
    for given in ("yes", 1, None):
        with pytest.raises(ValueError, match="fixed is .*: give True or False"):
            cn.polygons([[[0, 0], [1, 0], [1, 1]]], ROCK, fixed=given)


@pytest.mark.parametrize("kind", [cn.Hinge, cn.Slider])
def test_an_axis_without_a_direction_is_refused_at_once(kind):
    with pytest.raises(ValueError, match=f"axis of {kind.__name__} is .*: give a direction"):
        kind(point=(0, 0, 0), axis=(0, 0, 0))


def test_walls_without_end_are_segments_in_the_format_of_the_plane(tmp_path):
    scene = ball()
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    with pytest.raises(cn.legacy.LegacyError, match="a wall without end: give cairn.segment"):
        cn.legacy.write_datbox(scene, tmp_path)


def test_pictures_without_a_screen_say_nothing(tmp_path):
    pytest.importorskip("pyvista")
    scene = cn.Scene(dim=3, gravity=(0, 0, -9.81))
    scene.add(cn.spheres([(0, 0, 0.5)], 0.5, ROCK), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    cn.Simulation(scene, dt=1e-3).run(steps=5, output=tmp_path / "a.vtkhdf", every=5, progress=False)
    program = f"import cairn as cn\nrun = cn.load({str(tmp_path / 'a.vtkhdf')!r})\nrun.plot()\nrun.plot_force_chains()\n"
    env = {name: value for name, value in os.environ.items() if name != "DISPLAY"} | {"MPLBACKEND": "Agg"}
    ended = subprocess.run([sys.executable, "-c", program], env=env, capture_output=True, text=True, timeout=100)
    assert ended.returncode == 0 and "WARN" not in ended.stderr and "X server" not in ended.stderr, ended.stderr


def test_every_term_of_the_balance_is_explained(tmp_path):
    from pathlib import Path

    text = (Path(__file__).resolve().parents[3] / "docs/method.md").read_text(encoding="utf-8")
    sim = cn.Simulation(ball(), dt=1e-3)
    sim.step()
    assert not [term for term in sim.energy if f"`{term}`" not in text]
