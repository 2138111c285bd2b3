"""Makes the pictures of docs/looking.md: the viewer in the browser and a page of its own, of grains at rest under a block.

python script/viewer_pictures.py    # needs chromium, chromedriver, selenium, trame; writes docs/images/viewer_*.png
"""

import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cairn as cn
import numpy as np
from selenium import webdriver

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/python"))
from browser import browser, colours_of, wait_for  # noqa: E402

PICTURES = ROOT / "docs/images"


def grains(path):
    """A run of 80 spheres that settle in a box under a block of steel."""
    rock, steel = cn.Material("rock", density=2600.0), cn.Material("steel", density=7800.0)
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -9.81))
    rng = np.random.default_rng(1)
    axes = [0.15 + 0.24 * np.arange(count) for count in (4, 4, 5)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    scene.add(cn.spheres(places + rng.uniform(-0.005, 0.005, places.shape), rng.uniform(0.08, 0.115, len(places)), rock))
    scene.add(cn.boxes([(0.51, 0.51, 1.4)], [(0.9, 0.9, 0.2)], steel))
    scene.add(*cn.box((0.0, 0.0, 0.0), (1.02, 1.02, 3.0), rock, lid=False))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    sim = cn.Simulation(scene, dt=2e-3, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-3)))
    sim.run(steps=400, output=path, every=40, progress=False)


def page(path, driver):
    """The page of its own: forces between translucent bodies, a cut, a body that was clicked."""
    html = path.with_suffix(".html")
    subprocess.run([sys.executable, "-m", "cairn.cli", "view", str(path), "--html", str(html)], check=True)
    driver.get(html.as_uri())
    wait_for(driver, "return document.body.dataset.ready === 'yes'")
    driver.execute_script("document.getElementById('forces').click()")
    driver.execute_script("window.cairn.what = 'radius'; window.cairn.axis = 'y'; window.cairn.cut = 0.05")
    driver.execute_script("window.cairn.pick({clientX: 600, clientY: 380})")
    time.sleep(3)
    driver.save_screenshot(str(PICTURES / "viewer_page.png"))


def served(path, driver):
    """The viewer of a server, coloured by speed, with forces."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "cairn.cli", "view", str(path), "--port", str(port), "--no-browser"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        for line in server.stdout:
            if f":{port}" in line:
                break
        driver.get(f"http://127.0.0.1:{port}/")
        wait_for(driver, "return window.trame && document.querySelector('img[src^=blob], img[src^=data], canvas') !== null")
        driver.execute_script("window.trame.state.set('what', 'radius'); window.trame.state.set('forces', true)")
        wait_for(driver, "return document.fonts.status === 'loaded'")
        for _ in range(100):
            if colours_of(driver) > 100:
                break
            time.sleep(0.5)
        webdriver.ActionChains(driver).move_by_offset(600, 420).click().perform()  # tells the numbers of a body
        wait_for(driver, "return window.trame.state.state.told.length > 0")
        time.sleep(5)
        driver.save_screenshot(str(PICTURES / "viewer_in_the_browser.png"))
    finally:
        server.terminate()
        server.wait(20)


with tempfile.TemporaryDirectory() as folder:
    run = Path(folder) / "grains.vtkhdf"
    grains(run)
    with browser(1200, 800) as window:
        page(run, window)
        served(run, window)
