"""Runs in the browser: the page and the server show the data of the run."""

import json
import re
import socket
import subprocess
import sys
import time

import cairn as cn
import numpy as np
import pytest
from browser import browser, colours_of, wait_for
from cairn import cli
from cairn.post.view.frames import fields_of, frame_of, limits_of

pytest.importorskip("trame_vtk", reason="pages need vtk.js: pip install trame-vtk trame-client")


def scene_of(dim, origin=0.0, scale=1.0):
    """Two layers of round bodies and a block on the floor."""
    rock = cn.Material("rock", density=2800.0)
    gravity, up = np.zeros(dim), np.eye(dim)[-1]
    gravity[-1] = -9.81 * scale
    scene = cn.Scene(dim=dim, gravity=gravity)
    axes = [np.arange(4.0)] * (dim - 1) + [0.45 + 0.9 * np.arange(2.0)]
    centers = scale * np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=1) + origin
    scene.add((cn.disks if dim == 2 else cn.spheres)(centers, np.full(len(centers), 0.45 * scale), rock))
    place = [scale * 1.5] * (dim - 1) + [2.8 * scale]
    if dim == 2:
        scene.add(cn.polygons([scale * np.array([[-1, -0.4], [1, -0.4], [0, 0.8]])], rock, position=[np.add(place, origin)]))
    else:
        scene.add(cn.boxes([np.add(place, origin)], [[scale, 0.8 * scale, 0.6 * scale]], rock))
    scene.add(cn.wall(point=origin * np.ones(dim), normal=up, material=rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.4))
    return scene


def run_of(path, dim=3, steps=40, **options):
    cn.Simulation(scene_of(dim, **options), dt=2e-3).run(steps=steps, output=path, every=20, progress=False)
    return path


def data_of(page):
    text = page.read_text()
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)[1])


@pytest.mark.parametrize("dim", (2, 3))
def test_a_frame_holds_all_bodies_once(tmp_path, dim):
    with cn.load(run_of(tmp_path / "a.vtkhdf", dim)) as run:
        frame, step = frame_of(run[-1]), run[-1]
        shown = np.unique(np.concatenate([frame.row, frame.rows]))
        solid = np.flatnonzero(np.isfinite(step.bodies["mass"]) & (step.bodies["mass"] > 0))
        assert set(solid) <= set(shown)
        assert np.allclose(frame.center[:, :dim], step.bodies["position"][frame.row], rtol=1e-15)
        assert len(frame.forces) == len(frame.force) > 0 and np.all(frame.force > 0)
        assert fields_of(run)[0] == "velocity"
        low, high = limits_of(run, "mass")
        assert low < high


def test_noise_is_one_colour(tmp_path):
    """Values that differ by rounding alone are not spread over the colours."""
    with cn.load(run_of(tmp_path / "a.vtkhdf", 2)) as run:
        noisy = 1.0 + 1e-16 * np.arange(5)
        low, high = limits_of(run, "radius")
        assert high - low > 0.1
        import cairn.post.view.frames as frames

        old, frames.field_values = frames.field_values, lambda step, what: (noisy, "")
        try:
            low, high = limits_of(run, "radius")
        finally:
            frames.field_values = old
        assert high - low >= 1.0


@pytest.mark.parametrize("origin, scale", ((0.0, 1.0), (1e9, 1.0), (0.0, 1e-9)))
def test_a_page_shows_the_run(tmp_path, origin, scale):
    """Places come in a unit of the scene and from its middle, so that far and small scenes look like any other."""
    page = tmp_path / "page.html"
    assert cli.main(["view", str(run_of(tmp_path / "a.vtkhdf", 3, origin=origin, scale=scale)), "--html", str(page)]) == 0
    data = data_of(page)
    assert len(data["frames"]) == 3 and set(data["fields"]) >= {"velocity", "radius", "material"}
    with browser() as driver:
        driver.get(page.as_uri())
        wait_for(driver, "return document.body.dataset.ready === 'yes'")
        time.sleep(0.5)
        assert not [line for line in driver.get_log("browser") if line["level"] == "SEVERE"]
        assert colours_of(driver) > 100
        found = wait_for(driver, "window.cairn.pick({clientX: 600, clientY: 380}); return window.cairn.picked")
        place = np.array([float(word) for word in found["position"].split(",")])
        assert np.all(np.abs(place - origin) <= 8 * scale + 1e-3 * abs(origin))
        at = driver.execute_script("return window.cairn.frame.time")
        driver.execute_script("document.getElementById('play').click()")
        wait_for(driver, f"return window.cairn.frame.time !== {at!r}")
        driver.execute_script("window.cairn.axis = 'x'; window.cairn.cut = -0.1")
        wait_for(driver, "return window.cairn.loaded && window.cairn.axis === 'x'")


def test_forces_show_through_bodies_and_are_cut_with_them(tmp_path):
    path, page = run_of(tmp_path / "a.vtkhdf", 3, steps=400), tmp_path / "page.html"
    assert cli.main(["view", str(path), "--html", str(page)]) == 0
    shown = "const at = window.cairn; return [at.bodyProperty.opacity, at.chains.points.length, at.chains.largest]"
    with browser() as driver:
        driver.get(page.as_uri())
        wait_for(driver, "return document.body.dataset.ready === 'yes'")
        assert driver.execute_script(shown)[:2] == [1, 0]
        driver.execute_script("window.cairn.showForces = true")
        wait_for(driver, "return window.cairn.chains.points.length > 0")
        opacity, whole, largest = driver.execute_script(shown)
        driver.execute_script("window.cairn.axis = 'x'; window.cairn.cut = 0")
        wait_for(driver, f"return window.cairn.chains.points.length < {whole}")
        assert opacity < 0.5 and driver.execute_script(shown)[1] > 0
    step = cn.load(path)[-1]
    force = np.abs(np.sum(step.contacts["impulse"] * step.contacts["normal"], axis=1)).max() / 2e-3
    assert abs(largest - force) < 1e-5 * force


def test_the_viewer_cuts_forces_with_bodies(tmp_path):
    pytest.importorskip("trame_pyvista")
    from cairn.post.view.live import Viewer

    viewer = Viewer(run_of(tmp_path / "a.vtkhdf", 3, steps=400))
    viewer.show(len(viewer.run) - 1, forces=True, axis="x", cut=0.5)
    frame = frame_of(viewer.step)
    _, _, lines = viewer._cut(frame, "x", 0.5)
    middle = frame.forces[:, :, 0].mean(axis=1)
    place = viewer.step.drawn["position"][:, 0]
    assert 0 < lines.sum() < len(lines)
    assert np.array_equal(lines, middle <= place.min() + 0.5 * np.ptp(place))
    opacities = {actor.prop.opacity for actor in viewer.plotter.actors.values() if hasattr(actor, "prop")}
    assert any(0.1 < opacity < 0.5 for opacity in opacities)


def test_a_page_that_cannot_be_written_says_why(tmp_path, capsys):
    run, page = run_of(tmp_path / "a.vtkhdf", 2), tmp_path / "page.html"
    for words, told in (
        (("--what", "colour"), "there is no field 'colour'; there are velocity"),
        (("--fields", "radios"), "there is no field 'radios'"),
        (("--every", "0"), "every"),
    ):
        assert cli.main(["view", str(run), "--html", str(page), *words]) == 1
        assert told in capsys.readouterr().err and not page.exists()
    assert cli.main(["view", str(run), "--html", str(page), "--every", "100", "--fields", "radius"]) == 0
    assert len(data_of(page)["frames"]) == 2  # the first and the last
    assert cli.main(["view", str(run), "--html", str(page)]) == 1 and "exists already" in capsys.readouterr().err
    assert cli.main(["view", str(run), "--html", str(tmp_path / "no" / "page.html")]) == 1


def test_the_browser_is_served_while_the_run_goes_on(tmp_path):
    pytest.importorskip("trame_pyvista")
    path = tmp_path / "a.vtkhdf"
    sim = cn.Simulation(scene_of(3), dt=2e-3)
    sim.run(steps=40, output=path, every=20, progress=False)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with browser() as driver:
        command = [sys.executable, "-m", "cairn.cli", "view", str(path), "--port", str(port), "--no-browser"]
        server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        try:
            for line in server.stdout:  # it says where it is when it can be asked
                if f":{port}" in line:
                    break
            driver.get(f"http://127.0.0.1:{port}/")
            wait_for(driver, "return document.querySelector('img[src^=blob], img[src^=data], canvas') !== null")
            wait_for(driver, "return window.trame && window.trame.state.state.last === 2")
            for _ in range(100):
                if colours_of(driver) > 100:
                    break
                time.sleep(0.2)
            assert colours_of(driver) > 100
            sim.run(steps=20, output=path, every=20, append=True, progress=False)
            wait_for(driver, "return window.trame.state.state.last === 3")
        finally:
            server.terminate()
            server.wait(20)
            server.stdout.close()
