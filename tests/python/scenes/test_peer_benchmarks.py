"""Smallest forms of the benchmarks beside other programs: they run, leave out missing programs, and compare equal states."""

import importlib.util
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).resolve().parents[3] / "benchmarks"
pytestmark = pytest.mark.skipif(not BENCHMARKS.exists(), reason="benchmarks are not there")


@pytest.fixture(scope="module")
def load():
    sys.path.insert(0, str(BENCHMARKS))

    def module(name):
        spec = importlib.util.spec_from_file_location(name, BENCHMARKS / f"{name}.py")
        made = importlib.util.module_from_spec(spec)
        sys.modules[name] = made  # dataclasses look their module up
        spec.loader.exec_module(made)
        return made

    yield module
    sys.path.remove(str(BENCHMARKS))


@pytest.mark.filterwarnings("ignore::cairn.OverlapWarning")
@pytest.mark.parametrize("name", ["silo", "penetration", "drum"])
def test_each_case_of_the_community_by_both_strategies(load, name):
    """Both begin with the same packing, and every step of NSCD converges."""
    (springs, first), (rigid, second) = load("community").compare(name, "tiny")
    assert springs[0] == pytest.approx(rigid[0], rel=1e-12)
    assert float(second["converged"]) == 1.0 and first["grains"] == second["grains"] > 40
    assert np.all(np.isfinite(springs)) and np.all(np.isfinite(rigid))
    if name == "silo":  # what runs out in a tenth of a second
        assert springs[-1][1] < 0.95 and rigid[-1][1] == pytest.approx(springs[-1][1], abs=0.15)
    if name == "penetration":  # the ball is slowed down, and goes no faster than it came
        assert all(-5.05 < row[2] for row in springs + rigid) and rigid[-1][1] > 0


def test_smooth_dem_beside_what_is_there(load, monkeypatch, capsys, tmp_path):
    """Without peers only Cairn's rows are written, with a word; a grain's contacts and overlap are those of its packing."""
    monkeypatch.setattr(shutil, "which", lambda name: None)
    module = load("smooth_dem")
    rows = list(module.run_case("10k settled", 1, 5, 40))
    assert [row[1] for row in rows] == ["cairn", "cairn granular, tsuji"]
    assert "lmp is not on the path: left out" in capsys.readouterr().out
    assert float(rows[0][8]) == pytest.approx(float(rows[1][8]), rel=0.1) and 1 < float(rows[0][8]) < 6
    assert 0 < float(rows[0][10]) < 0.02


def test_clumps_from_the_places_of_their_spheres(load):
    """Rotations that poses() finds put the spheres of a clump where they were."""
    import cairn as cn

    module = load("smooth_dem")
    rng = np.random.default_rng(3)
    q = rng.normal(size=(50, 4))
    q[0] = 0, 1, 0, 0  # half a turn
    q /= np.linalg.norm(q, axis=1)[:, None]

    def turned(q, x):
        twice = 2 * np.cross(q[:, None, 1:], x)
        return x + q[:, :1, None] * twice + np.cross(q[:, None, 1:], twice)

    own = cn.pre.clump(module.OFFSETS, np.full(3, module.DIAMETER / 2), module.DENSITY).offsets
    spheres = turned(q, np.broadcast_to(own, (50, 3, 3)))
    places, turns = module.poses(spheres)
    again = turned(turns, np.broadcast_to(own, (50, 3, 3))) + places[:, None]
    assert again == pytest.approx(spheres, abs=1e-9 * module.DIAMETER)


def test_a_panel_of_two_courses_beside_what_is_there(load, monkeypatch, capsys):
    """Before it cracks, its force at an equal way does not depend on the step; without LMGC90 it says so."""
    monkeypatch.delenv("CAIRN_LMGC90_PYTHON", raising=False)
    load("peers")
    table = load("masonry_peers").main(["--courses=2", "--columns=1", "--way=1e-4"])
    force = {row[0]: float(row[6]) for row in table}
    assert force["cairn"] == pytest.approx(force["cairn, fine"], rel=0.05) and force["cairn"] > 0.1
    assert ("lmgc90" in force) != ("LMGC90 is left out" in capsys.readouterr().out)


@pytest.mark.filterwarnings("ignore::cairn.OverlapWarning")
@pytest.mark.parametrize("name", ["triaxial", "drum"])
def test_grains_beside_what_is_there(load, monkeypatch, capsys, name):
    """Without peers only Cairn's rows are written, with a word; springs and rigid grains begin alike and stay near each other."""
    monkeypatch.setattr(shutil, "which", lambda program: None)
    load("peers")
    count, share = {"triaxial": (40, 0.03), "drum": (25, 0.05)}[name]
    module = load("grains_peers")
    rows, curves = module.compare(name, count, share, [400])
    assert {row["code"] for row in rows} == {*module.RIGID, "Cairn smooth DEM"}
    assert "liggghts is not on the path: left out" in capsys.readouterr().out
    ends = [curve[-1] for curve in curves.values()]
    assert np.ptp([end[0] for end in ends]) <= 0.3 * ends[0][0]  # strains or times, by whole steps
    if name == "triaxial":  # a stress that rises under the loaded walls
        assert all(end[1] > 20 for end in ends)
    else:  # degrees
        assert all(curve[-1, 1] > curve[0, 1] + 2 for curve in curves.values())
