"""Studies of a bar that strikes a wall: meshes and integrators as axes of the sweep."""

import cairn as cn
import pytest
from cairn import study
from cairn.study.settings import scene_settings

BAR = """
import cairn as cn
import numpy as np

DT, DURATION = 4e-3, 0.2


def build(cells=10):
    y, x = np.meshgrid(np.linspace(0, 1, cells + 1), [0.0, 1.0 / cells], indexing="ij")
    k = np.arange(2 * cells + 2).reshape(cells + 1, 2)
    quads = np.stack([k[:-1, 0], k[:-1, 1], k[1:, 1], k[1:, 0]], axis=1)
    body = cn.ElasticBody(np.c_[x.ravel(), y.ravel()], {"quad": quads}, young=100.0, poisson=0.0, density=1.0, lumped=True)
    metal = cn.Material("metal", density=1.0)
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, metal, contact=k[0], velocity=(0.0, -0.1)), cn.wall((0, 0), (0, 1), metal))
    scene.interact(metal, metal, cn.Coulomb(mu=0.0))
    return scene


def figure_way(sim):
    return -sim.meshes[0].displacement[-1, 1]
"""


def test_a_study_of_a_mesh_sweeps_integrators(tmp_path):
    """A bar that strikes a wall, by two meshes: what dissipates errs more, each mesh is a target of its own, and the line to type
    names the integrator."""
    path = tmp_path / "bar.py"
    path.write_text(BAR)
    sweep = {
        "solvers": ["NLGS"], "tolerances": (1e-2,), "warm_start": (True,),
        "integrators": ("Theta(theta=0.5)", "Theta(theta=1)", "HHT(alpha=-0.1)"),
    }  # fmt: skip
    found = study.run([(str(path), {"cells": n}) for n in (8, 16)], tmp_path / "bar.study", figures=["way"], sweep=sweep,
                      one_step=False, workers=1, progress=False)  # fmt: skip
    rows = [row for row in found.table if row["figure"] == "way"]
    assert len({row["target"] for row in rows}) == 2 and len(rows) == 2 * 3

    def worst(integrator):
        return max(row["error"] for row in rows if row["integrator"] == integrator)

    assert worst("Theta(theta=1)") > 1.5 * worst("HHT(alpha=-0.1)") > 0
    best = found.recommend(0.3, of="way")
    assert best and "integrator=cn." in best.line
    found.plot("way", tmp_path / "way.png")
    again = study.run([(str(path), {"cells": n}) for n in (8, 16)], tmp_path / "bar.study", figures=["way"], sweep=sweep,
                      one_step=False, workers=1, progress=False)  # fmt: skip
    assert len(again.table) == len(found.table)


def test_what_is_guided_is_free(tmp_path):
    """A bar whose nodes are all held across and free along it is studied as one that moves; nodes held wholly are not free."""
    path = tmp_path / "guided.py"
    guided = 'scene.add(cn.deformable(body, metal, contact=k[0], fixed={"all": "x"},'
    text = BAR.replace("lumped=True)", 'lumped=True,\n        groups={"all": np.arange(2 * cells + 2)})')
    path.write_text(text.replace("scene.add(cn.deformable(body, metal, contact=k[0],", guided))
    from cairn.study.figures import boundary_parts

    scope = {}
    exec(path.read_text(), scope)
    sim = cn.Simulation(scope["build"](4), 4e-3)
    parts, free = boundary_parts(sim)
    assert free.sum() == 10 and len(parts) == 1
    sweep = {"solvers": ["NLGS"], "tolerances": (1e-2,), "warm_start": (True,)}
    found = study.run(str(path), tmp_path / "guided.study", figures=["way"], sweep=sweep, workers=1, progress=False)
    assert any(row["figure"] == "way" for row in found.table)
    path.write_text(path.read_text().replace('{"all": "x"}', '{"all": "xy"}').replace("velocity=(0.0, -0.1)", "velocity=0.0"))
    scope = {}
    exec(path.read_text(), scope)
    assert not boundary_parts(cn.Simulation(scope["build"](4), 4e-3))[1].any()


def test_a_study_sweeps_meshes(tmp_path):
    """The bar on two meshes, compared with a finer mesh: coarser meshes err more, each mesh is a curve, and the recommended
    command names the mesh."""
    path = tmp_path / "bar.py"
    path.write_text(BAR.replace("def build(cells=10):", "def build(mesh=10):\n    cells = mesh"))
    sweep = {
        "solvers": ["NLGS"], "tolerances": (1e-8,), "warm_start": (True,), "meshes": (4, 8), "dt_factors": (0.5,),
        "integrators": ("Theta(theta=0.5)", "HHT(alpha=-0.1)"),
    }  # fmt: skip
    asked = dict(figures=["way"], sweep=sweep, reference_mesh=32, runs=8, workers=1, progress=False)
    found = study.run(str(path), tmp_path / "bar.study", **asked)
    rows = found.table
    assert len(rows) == 2 * 2 and {row["target"] for row in rows} == {"bar.py"}
    error = {(row["integrator"], row["mesh"]): row["error"] for row in rows}
    for integrator in sweep["integrators"]:
        assert error[integrator, 4] > 1.2 * error[integrator, 8] > 0
    best = found.recommend(1.2 * min(error.values()), of="way", here=True)
    assert best and best.setting.mesh == 8 and "build(mesh=8)" in best.words
    found.plot("way", tmp_path / "way.png")
    said = []
    again = study.run(str(path), tmp_path / "bar.study", **asked, say=said.append)
    assert "nothing is computed" in said[0] and len(again.table) == len(rows)


def test_meshes_that_no_build_takes_are_told(tmp_path):
    path = tmp_path / "bar.py"
    path.write_text(BAR)
    sweep = {"solvers": ["NLGS"], "tolerances": (1e-2,), "meshes": (4,)}
    with pytest.raises(ValueError, match="build\\(\\) does not take the options {'mesh': 4}"):
        study.run(str(path), tmp_path / "bar.study", figures=["way"], sweep=sweep, progress=False)
    with pytest.raises(ValueError, match="meshes: -1 is no mesh"):
        scene_settings(["NLGS"], meshes=(-1,))
    assert "mesh" not in next(iter(scene_settings(["NLGS"], (1e-2,), warm_start=(True,)).values())).as_row()


def test_integrators_that_are_none_are_told():
    for text, told in (
        ("Rungekutta()", "give one as it is called"),
        ("Theta(0.5)", "give options by name"),
        ("Theta(theta=7)", "theta is 7"),
    ):
        with pytest.raises(ValueError, match=told):
            scene_settings(["NLGS"], integrators=(text,))
    plain = scene_settings(["NLGS"], (1e-2,), warm_start=(True,))
    assert "integrator" not in next(iter(plain.values())).as_row()


@pytest.mark.parametrize(
    ("meshes", "reference", "told"),
    [
        ((4, 8), -3, "reference_mesh: -3 is no mesh: give finite numbers above 0"),
        ((4, 8), float("nan"), "reference_mesh: nan is no mesh"),
        ((4, 8), float("inf"), "reference_mesh: inf is no mesh"),
        ((4, 8), "a", "reference_mesh: 'a' is no mesh"),
        ((4, 8), 6, "reference_mesh is 6, coarser than the finest of meshes, 8: give at least that"),
        ((0, 8), None, "meshes: 0 is no mesh"),
        ((4, "a"), None, "meshes: 'a' is no mesh"),
        ((4, float("nan")), None, "meshes: nan is no mesh"),
    ],
)
def test_what_is_no_mesh_is_refused(tmp_path, meshes, reference, told):
    path = tmp_path / "bar.py"
    path.write_text(BAR.replace("def build(cells=10):", "def build(mesh=10):\n    cells = mesh"))
    sweep = {"solvers": ["NLGS"], "tolerances": (1e-2,), "warm_start": (True,), "meshes": meshes}
    with pytest.raises(ValueError, match=told):
        study.run(str(path), tmp_path / "bar.study", figures=["way"], sweep=sweep, reference_mesh=reference, runs=8, workers=1,
                  progress=False)  # fmt: skip
