"""A headless Chromium for the tests of pages; they skip where there is none."""

import contextlib
import shutil
import time

import pytest


@contextlib.contextmanager
def browser(width=1200, height=800):
    """A driver of Chromium without a window, drawing by software."""
    webdriver = pytest.importorskip("selenium.webdriver")
    if not (shutil.which("chromium") and shutil.which("chromedriver")):
        pytest.skip("no chromium with its driver here: apt-get install chromium chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for word in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-gl=angle", "--use-angle=swiftshader",
                 "--enable-unsafe-swiftshader", f"--window-size={width},{height}"):
        options.add_argument(word)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
    try:
        yield driver
    finally:
        driver.quit()


def wait_for(driver, script, seconds=60):
    """Waits until a script returns something that is true, and returns it."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        found = driver.execute_script(script)
        if found:
            return found
        time.sleep(0.1)
    raise AssertionError(f"the page did not come to {script!r} in {seconds} s")


def colours_of(driver, size=64):
    """How many colours a screenshot has, in `size` steps of brightness: an empty picture has few."""
    import io

    import numpy as np
    from PIL import Image

    image = np.asarray(Image.open(io.BytesIO(driver.get_screenshot_as_png())).convert("RGB"), int)
    return len(np.unique((image // (256 // size)).reshape(-1, 3), axis=0))
