"""Plots of recorded histories; logs of runs."""

import logging
import shutil

import cairn as cn
import matplotlib.pyplot as plt
import numpy as np
import pytest
from cairn import cli
from cairn.post import films, plots
from small_scenes import heap


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("histories") / "run.vtkhdf"
    sim = cn.Simulation(heap(), 1e-3, overlap="ignore")
    probes = {"height": lambda s: s.bodies.position[:48, 1].mean(), "half": lambda s: 0.5}
    sim.run(steps=30, output=path, every=10, probes=probes, progress=False)
    return cn.load(path)


def test_probes_energy_and_error_are_drawn(run):
    axes = run.plot_history()
    assert [ax.get_ylabel() for ax in axes] == ["height", "half", "energy [J]", "error [-]"]
    assert np.array_equal(axes[0].lines[0].get_xydata(), np.c_[run.history["time"], run.history["height"]])
    assert [ax.get_xlabel() for ax in axes] == ["", "", "", "time [s]"]
    axes = run.plot_history(("height", "half"), "contacts")
    assert [text.get_text() for text in axes[0].get_legend().get_texts()] == ["height", "half"] and len(axes) == 2
    with pytest.raises(KeyError, match="no column 'hieght'; it has energy, time, .*; did you mean 'height'"):
        run.plot_history("hieght")
    with pytest.raises(ValueError, match="column 'status' of the history holds words"):
        run.plot_history("status")
    plt.close("all")


def test_the_command_draws_them(run, tmp_path, capsys):
    assert cli.main(["plot", str(run.path), "--what", "history", "-o", str(tmp_path / "h.png"), "--dpi", "40"]) == 0
    assert (tmp_path / "h.png").stat().st_size > 1000


def test_forces_before_any_contact_are_none(run):
    assert not len(run[0].contacts) and "force" not in run.plot_force_chains(0).get_title(loc="left")
    plt.close("all")


def test_titles_take_lines_where_axes_are_narrow(run):
    figure, axes = plt.subplots(1, 3, figsize=(9, 3))
    run.plot(-1, ax=axes[0])
    assert axes[0].get_title(loc="left").count("\n") >= 1
    single = run.plot(-1)
    assert "\n" not in single.get_title(loc="left")
    plt.close("all")


def test_what_differs_by_rounding_has_one_colour():
    low, high = plots.value_limits(np.array([3.0, 3.0 + 1e-15, 3.0 - 1e-15]))
    assert high - low > 1.0
    assert plots.value_limits(np.array([0.0, 1e-9])) == (0.0, pytest.approx(1e-9, rel=0.01))


def test_a_periodic_cell_is_drawn(tmp_path):
    rock = cn.Material("rock", density=2000.0)
    scene = cn.Scene(2, periodic=cn.Periodic((2.0, 1.0), shear_rate=10.0))
    scene.add(cn.disks([[0.5, 0.5]], 0.2, rock))
    scene.interact("*", "*", cn.Coulomb(mu=0.2))
    sim = cn.Simulation(scene, 1e-2)
    sim.run(steps=10, output=tmp_path / "a.vtkhdf", every=5, progress=False)
    run = cn.load(tmp_path / "a.vtkhdf")
    for k, lean in ((0, 0.0), (1, 0.5), (2, -1.0)):  # 1 is as far as -1 in a cell of length 2
        cell = run.plot(k).patches[-1].get_xy()
        assert cell[:4] == pytest.approx(np.array([[0, 0], [2, 0], [2 + lean, 1], [lean, 1]]))
    plt.close("all")


def test_a_film_by_the_ffmpeg_of_a_package(run, tmp_path, monkeypatch):
    pytest.importorskip("imageio_ffmpeg")
    monkeypatch.setattr(shutil, "which", lambda *_, **__: None)
    run.animate(tmp_path / "a.mp4", dpi=40, every=2)
    assert (tmp_path / "a.mp4").read_bytes()[4:8] == b"ftyp"


def test_a_camera_moves_along_its_path():
    path = [((0, -4, 1), (0, 0, 0)), ((4, 0, 1), (0, 0, 0)), ((4, 0, 3), (0, 0, 2))]
    assert np.allclose(films.camera_at(path, 0.25), ((2, -2, 1), (0, 0, 0)))
    assert np.allclose(films.camera_at(path, 1.0), path[-1])
    assert films.camera_at(lambda share: (share, 0, 1), 0.5) == (0.5, 0, 1)
    assert films.camera_at((1, 2, 3), 0.5) == (1, 2, 3) and films.camera_at(None, 0.5) is None
    with pytest.raises(ValueError, match=r"camera has shape \(1, 1, 3\): give a list of"):
        films.camera_at([[(1, 2, 3)]], 0.5)


def test_forces_in_space_are_drawn(tmp_path):
    pytest.importorskip("pyvista")
    sim = cn.Simulation(heap(3), 1e-3, overlap="ignore")
    sim.run(steps=60, output=tmp_path / "a.vtkhdf", every=60, progress=False)
    run = cn.load(tmp_path / "a.vtkhdf")
    assert np.any(run[-1].contacts["impulse"])
    ax = run.plot_force_chains(-1)
    image = np.asarray(ax.images[0].get_array(), int)
    red = (image[..., 0] > image[..., 1] + 40) & (image[..., 0] > image[..., 2] + 40)
    assert red.sum() > 200  # rods that push
    seen = np.asarray(run.plot_force_chains(-1, camera=(0, 0, 1)).images[0].get_array(), int)
    assert seen.shape != image.shape  # another side of the box
    with pytest.raises(ValueError, match=r"camera has shape \(2,\): give \(place, point looked at\)"):
        run.plot(-1, camera=(1, 2))
    plt.close("all")


def test_pictures_in_space_have_walls_axes_and_no_empty_paper(tmp_path):
    pytest.importorskip("pyvista")
    sim = cn.Simulation(heap(3), 1e-3, overlap="ignore")
    sim.run(steps=1, output=tmp_path / "a.vtkhdf", progress=False)
    run = cn.load(tmp_path / "a.vtkhdf")
    image, bare = (np.asarray(run.plot(-1, walls=walls).images[0].get_array(), int) for walls in (True, False))
    drawn = image.min(axis=2) < 250
    assert drawn[: len(image) // 20].any() and drawn[-(len(image) // 20) :].any() and drawn.mean() > 0.5
    grey = (np.ptp(image, axis=2) < 6) & (image.min(axis=2) > 150) & drawn
    assert grey.mean() > 0.02 + ((np.ptp(bare, axis=2) < 6) & (bare.min(axis=2) > 150) & (bare.min(axis=2) < 250)).mean()
    assert {text.get_text() for text in run.plot(-1).texts} == {"x", "y", "z"}
    assert {text.get_text() for text in run.plot(-1, camera=(0, 0, 1)).texts} == {"x", "y"}  # seen from above
    plt.close("all")


def test_a_run_is_logged(tmp_path, caplog, capsys):
    with caplog.at_level(logging.INFO, logger="cairn"):
        sim = cn.Simulation(heap(), 1e-3, cn.NSCD(solver=cn.NLGS(tol=1e-12, max_iter=1)), overlap="ignore")
        sim.run(steps=60, output=tmp_path / "a.vtkhdf", every=20, checkpoint_every=60, progress=False)
    lines = [record.getMessage() for record in caplog.records]
    assert lines[0].startswith("run from step 0, t = 0 s, dt = 0.001 s, 51 bodies, to ")
    assert any("iteration_limit, error" in line for line in lines)
    assert any(line.startswith("checkpoint at step 60") for line in lines) and lines[-1].startswith("run to step 60")
    assert not any("output at" in line for line in lines)  # those are for debugging
    assert capsys.readouterr().err == ""


def test_the_command_logs_when_asked(tmp_path):
    import subprocess
    import sys

    heap().save(tmp_path / "s.scene.h5")
    call = [sys.executable, "-m", "cairn", "--log", "debug", "run", "s.scene.h5", "--dt", "1e-3", "--steps", "2", "-q"]
    ended = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True)
    assert ended.returncode == 0 and "cairn.run INFO: run from step 0" in ended.stderr
    assert "cairn.run DEBUG: output at step 2" in ended.stderr
    (tmp_path / "a.py").write_text("import sys\nprint(sys.argv[1:])\n")
    ended = subprocess.run([sys.executable, "-m", "cairn", "--log=info", "run", "a.py", "--steps", "3"], cwd=tmp_path,
                           capture_output=True, text=True)  # fmt: skip
    assert ended.stdout == "['--steps', '3']\n", ended.stderr
