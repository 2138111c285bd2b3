"""Pictures show tensile forces across cracks, joints as joints, and correct numbers of bodies and broken bonds."""

import cairn as cn
import matplotlib
import numpy as np
import pytest
from cairn.post import drawing, histories
from matplotlib.collections import LineCollection

matplotlib.use("Agg")
STEEL = cn.Material("steel", density=7800.0)


@pytest.fixture(autouse=True)
def closed():
    yield
    matplotlib.pyplot.close("all")


def title(ax):
    return ax.get_title(loc="left").replace("\n", "   ")


def lines_of(ax):
    return np.concatenate([c.get_segments() for c in ax.collections if isinstance(c, LineCollection) and len(c.get_segments())])


def test_forces_across_a_crack_are_lines_of_the_length_of_a_cell(tmp_path):
    """Two cells that a zone joins, pulled apart: all contacts pull along x, and bodies there are none."""
    x, y = np.meshgrid([0.0, 0.1, 0.2], [0.0, 0.1], indexing="ij")
    points = {"left": [0, 1], "right": [4, 5]}
    plate = cn.ElasticBody(
        np.c_[x.ravel(), y.ravel()], {"quad": [[0, 2, 3, 1], [2, 4, 5, 3]]}, young=1e9, poisson=0.0, density=1000.0, groups=points
    )
    law = cn.MP3(normal_stiffness=1e12, tangential_stiffness=1e12, strength=1e5, work=2.0)
    scene = cn.Scene(2)
    cn.fracture.split(plate, law, STEEL, fixed={"left": "xy"}, drive={"right": {"x": 0.02, "y": 0.0}}).add_to(scene)
    sim = cn.Simulation(scene, 2e-6)
    sim.run(steps=20, output=tmp_path / "a.vtkhdf", every=20, progress=False)
    run = cn.load(tmp_path / "a.vtkhdf")
    ax = run.plot_force_chains()
    across = [line for line in lines_of(ax) if np.ptp(line[:, 1]) < 1e-6 and np.allclose(line.mean(axis=0)[0], 0.1, atol=1e-5)]
    assert len(across) == len(run[-1].contacts) == 2
    assert np.allclose([np.ptp(line[:, 0]) for line in across], 0.1, rtol=1e-3)
    assert "2 meshes of 8 nodes" in title(ax) and "bod" not in title(ax) and title(run.plot()) in title(ax)
    told = [text.get_text() for text in ax.get_legend().get_texts()]
    assert told[0] == "pulls" and told[1].endswith(" N") and told[2].endswith(" N or more")


def hanging(dim):
    """A disk on a pivot, another on a rope over a pulley of the world, a third on a rod; four bodies with the beam."""
    scene = cn.Scene(dim=dim, gravity=(0, -9.81, 0)[:dim])
    make = cn.disks if dim == 2 else cn.spheres
    a = scene.add(make([(0, 0, 0)[:dim], (1, 0, 0)[:dim], (2, 0, 0)[:dim]], 0.2, STEEL))
    scene.interact("*", "*", None)
    point = (cn.Pivot if dim == 2 else cn.Ball)(point=(0.0, 0.3, 0.0)[:dim])
    scene.join(a[0], None, point)
    scene.join(a[0], a[1], cn.Cable(points=[(0, 0, 0)[:dim], (0.5, 1, 0)[:dim], (1, 0, 0)[:dim]]))
    scene.join(a[1], a[2], cn.Distance(points=[(1, 0, 0)[:dim], (2, 0, 0)[:dim]]))
    return cn.Simulation(scene, 1e-4)


def test_joints_are_rings_and_lines_and_no_bodies(tmp_path):
    hanging(2).run(steps=2, output=tmp_path / "a.vtkhdf", every=2, progress=False)
    run = cn.load(tmp_path / "a.vtkhdf")
    ax = run.plot()
    assert "3 bodies" in title(ax) and "3 bodies" in title(run.plot_force_chains())
    disks = ax.collections[0]
    assert len(disks.get_offsets()) == 3
    lines = np.sort(np.linalg.norm(np.diff(lines_of(ax), axis=1)[:, 0], axis=1))
    assert np.allclose(lines, [1.0, np.hypot(0.5, 1), np.hypot(0.5, 1)], rtol=1e-5)
    rings = ax.collections[-1].get_offsets()
    assert np.allclose(rings, [[0, 0.3]], atol=1e-5)
    pytest.importorskip("pyvista")
    hanging(3).run(steps=2, output=tmp_path / "b.vtkhdf", every=2, progress=False)
    ax = cn.load(tmp_path / "b.vtkhdf").plot(camera=(0, 0, 1))
    image = np.asarray(ax.images[0].get_array(), int)
    assert "3 bodies" in title(ax)
    middle = image[:, int(0.42 * image.shape[1]) : int(0.58 * image.shape[1])]
    assert (middle.max(axis=2) < 100).sum() > 50  # dark lines between spheres


def test_all_that_broke_is_counted(tmp_path):
    """A row torn into pieces that fly apart: none of the broken pairs is near at the end."""
    scene = cn.Scene(2)
    x = np.column_stack([0.1 * np.arange(4), np.zeros(4)])
    velocity = np.zeros((4, 3))
    velocity[:, 0] = [0, 5, 10, 10]
    scene.add(cn.disks(x, 0.05, STEEL, velocity=velocity))
    scene.interact(STEEL, STEEL, cn.MP3(normal_stiffness=1e11, tangential_stiffness=1e11, strength=1e6, work=100.0, within=1e-4))
    sim = cn.Simulation(scene, 1e-5)
    sim.run(steps=1, output=tmp_path / "a.vtkhdf", every=1, progress=False)
    sim.run(steps=2000, output=tmp_path / "a.vtkhdf", every=1000, progress=False, append=True)
    run = cn.load(tmp_path / "a.vtkhdf")
    assert "3 hold, 0 broken" in title(run.plot_bonds(1))
    ax = run.plot_bonds()
    assert "1 hold, 2 broken (0 still near)" in title(ax)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["whole (beta 1)", "beta 0.5", "broken, near"]


def test_steps_above_the_tolerance_hide_no_error():
    time = np.arange(100.0)
    status = np.where(time < 90, "iteration_limit", "converged")
    ax = histories.plot_residual({"time": time, "error": 1e-4 + 0 * time, "iterations": 100 + 0 * time, "status": status})
    marks = [line for line in ax.lines if line.get_linestyle() == "None"]
    assert len(marks) == 1 and np.all(np.asarray(marks[0].get_ydata()) < 0.05)  # along the edge, in shares of the height
    assert marks[0].get_transform() == ax.get_xaxis_transform() and "90 of 100 steps not converged" in title(ax)
    assert ax.get_legend() is None


def test_widths_of_forces_are_told_in_figures():
    told = [drawing._figures(x) for x in (0.001234, 621.4, 2953.0, 123456.0, 3.2e7)]
    assert told == ["0.00123", "621", "2,950", "123,000", "3.2e+07"]
