"""Tools on runs with a liquid: verify, info, convert, plot, series and probes read it, or tell why they do not."""

import csv

import cairn as cn
import numpy as np
import pytest
from cairn.cli import main
from cairn.post.fluid_plots import plot_fluid
from cairn.post.verify import verify

ROCK = cn.Material("rock", density=2600.0)


def box_of_liquid(depth=0.4, width=0.5):
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    for point, normal in (((0, 0), (0, 1)), ((0, 0), (1, 0)), ((1, 0), (-1, 0))):
        scene.add(cn.wall(point, normal, ROCK))
    if depth:
        scene.add(cn.fluid([(0, 0), (width, depth)], 0.1, 1000.0))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    return cn.Simulation(scene, dt=4e-3)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("liquids")
    made = {"a": {}, "again": {}, "shallow": {"depth": 0.2}, "tall": {"depth": 0.5, "width": 0.4}, "dry": {"depth": 0}}
    for name, options in made.items():
        box_of_liquid(**options).run(8, output=folder / f"{name}.vtkhdf", every=4, progress=False)
    return folder


@pytest.mark.parametrize(
    "other, words",
    [
        ("shallow", "the liquid has 20 particles in A and 10 in B at t = 0 s"),
        ("dry", "at t = 0 s a liquid is in A only"),
    ],
)
def test_verify_tells_liquids_of_other_sizes(runs, other, words):
    given = {} if other == "shallow" else {"size": 1.0}
    found = verify(runs / "a.vtkhdf", runs / f"{other}.vtkhdf", {"position": 1e-9}, **given)
    assert not found.agrees and words in found.table()
    assert main(["verify", str(runs / "a.vtkhdf"), str(runs / f"{other}.vtkhdf"), "--size", "1"]) == 3


def test_verify_compares_particles_by_the_tolerances_of_bodies(runs):
    a = runs / "a.vtkhdf"
    same = verify(a, runs / "again.vtkhdf", {"position": 0.0, "velocity": 0.0})
    assert same.agrees and same.tolerances["fluid_velocity"] == 0.0 and same.rows[-1]["fluid_position"] == 0.0
    assert "holds: fluid_position 0, tolerance 0" in same.table()
    x, y = (np.array(cn.load(runs / f"{name}.vtkhdf")[-1].fluid["position"]) for name in ("a", "tall"))
    other = verify(a, runs / "tall.vtkhdf", {"position": 1e-12, "fluid_velocity": np.inf})
    away = np.max(np.linalg.norm(x - y, axis=1)) / 0.1
    assert other.rows[-1]["fluid_position"] == pytest.approx(away, rel=1e-12) and away > 0
    assert [f.partition(" is ")[0] for f in other.failures] == ["fluid_position"]


def test_runs_without_a_liquid_have_no_norm_of_it(runs):
    dry = runs / "dry.vtkhdf"
    found = verify(dry, dry, {"position": 0.0}, size=1.0)
    assert found.agrees and "fluid" not in found.table()
    asked = verify(dry, dry, {"fluid_position": 1.0}, size=1.0)
    assert asked.failures == ["fluid_position is not known at any instant: the runs hold no common liquid"]


def test_info_tells_the_liquid(runs, capsys):
    assert main(["info", str(runs / "a.vtkhdf")]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "particles of the liquid 20" in told and "fields of the liquid position" in told and "spacing 0.1" in told
    main(["info", str(runs / "dry.vtkhdf")])
    assert "of the liquid" not in capsys.readouterr().out


def test_info_tells_the_liquid_of_a_checkpoint(tmp_path, capsys):
    for depth, words in ((0.4, ("particles", "20", "weakly compressible")), (0, ())):
        sim = box_of_liquid(depth)
        sim.run(3, progress=False)
        sim.checkpoint(tmp_path / "a.ckpt")
        assert main(["info", str(tmp_path / "a.ckpt")]) == 0
        text = capsys.readouterr().out
        assert "0.012 s" in text and "steps" in text
        assert all(word in text for word in words) and ("\nliquid\n" in text) == bool(depth)


def test_convert_writes_the_liquid_or_tells_that_it_does_not(runs, tmp_path, capsys):
    run, last = str(runs / "a.vtkhdf"), cn.load(runs / "a.vtkhdf")[-1].fluid
    assert main(["convert", run, str(tmp_path / "b.csv")]) == 0
    assert "--what fluid" in capsys.readouterr().err
    for what in ("fluid", "history"):  # the one is the liquid, the other no table of things in space
        assert main(["convert", run, str(tmp_path / f"{what[0]}.csv"), "--what", what]) == 0
        assert not capsys.readouterr().err
    with open(tmp_path / "f.csv") as file:
        rows = list(csv.DictReader(file))[-20:]
    for name, values in (("pressure", last["pressure"]), ("vx", last["velocity"][:, 0]), ("vy", last["velocity"][:, 1])):
        assert [float(row[name]) for row in rows] == values.tolist()
    assert main(["convert", str(runs / "dry.vtkhdf"), str(tmp_path / "d.csv")]) == 0 and not capsys.readouterr().err
    assert main(["convert", run, str(tmp_path / "a.npz")]) == 0
    with np.load(tmp_path / "a.npz") as found:
        assert np.array_equal(found["00002/fluid/velocity"], last["velocity"])


def test_vtp_and_series_have_the_liquid(runs, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    run, last = str(runs / "a.vtkhdf"), cn.load(runs / "a.vtkhdf")[-1].fluid
    assert main(["convert", run, str(tmp_path / "a.vtp")]) == 0
    for found in (pyvista.read(tmp_path / "a_fluid_0002.vtp"), cn.open_series(run)[2]["fluid"]):
        assert np.array_equal(found.point_data["pressure"], last["pressure"])
        assert np.array_equal(found.points[:, :2], last["position"].astype(found.points.dtype))
    assert "fluid" not in cn.open_series(runs / "dry.vtkhdf")[0].keys()


def test_pictures_of_the_liquid(runs, tmp_path, capsys):
    assert main(["plot", str(runs / "a.vtkhdf"), "--what", "pressure", "-o", str(tmp_path / "a.png")]) == 0
    assert (tmp_path / "a.png").stat().st_size > 1000
    assert main(["plot", str(runs / "a.vtkhdf"), "--what", "pressure", "-o", str(tmp_path / "a.gif")]) == 1
    assert "a film shows no liquid, whose pressure this is: give -o a .png" in capsys.readouterr().err
    run = cn.load(runs / "a.vtkhdf")
    with pytest.raises(ValueError, match="pressure is a field of the liquid.*plot_fluid"):
        run.plot(-1, "pressure")
    for what, words in ((None, "what"), ("presure", "did you mean 'pressure'"), ([1.0], r"what has shape \(1,\).*\(20,\)")):
        with pytest.raises(ValueError, match=words):
            plot_fluid(run[-1], what)
    assert plot_fluid(run[-1], np.arange(20.0)) is not None


def test_a_probe_reads_the_volume_of_the_liquid(tmp_path):
    sim = box_of_liquid()
    seen = []
    probes = {"volume": cn.Probe("report.fluid_volume"), "own": lambda s: seen.append(s.fluid.info["volume"]) or 0.0}
    sim.run(4, output=tmp_path / "a.vtkhdf", progress=False, probes=probes)
    assert cn.load(tmp_path / "a.vtkhdf").history["volume"].tolist() == seen and seen[-1] > 0.5
    with pytest.raises(ValueError, match="no fluid: give cn.fluid"):
        dry = box_of_liquid(depth=0)
        dry.run(1, output=tmp_path / "dry.vtkhdf", progress=False, probes={"volume": cn.Probe("report.fluid_volume")})


def test_plot_draws_the_liquid_or_says_that_it_does_not(runs, tmp_path, capsys):
    run = str(runs / "a.vtkhdf")
    assert main(["plot", run, "-o", str(tmp_path / "a.png")]) == 0
    assert "warning" not in capsys.readouterr().err
    assert main(["plot", run, "--what", "velocity", "-o", str(tmp_path / "b.png")]) == 0
    assert "the liquid is not drawn: --what pressure or density" in capsys.readouterr().err
    assert (tmp_path / "a.png").read_bytes() != (tmp_path / "b.png").read_bytes()


def test_check_says_that_a_file_of_results_is_no_scene(runs, capsys):
    assert main(["check", str(runs / "a.vtkhdf")]) != 0
    told = capsys.readouterr().err
    assert "file of results (HDF5)" in told and "codec" not in told
