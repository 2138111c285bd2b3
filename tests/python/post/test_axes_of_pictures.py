"""Axes of pictures have units, numbers that do not lie on one another, and marks that are explained."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from cairn.study import plots

ROOT = Path(__file__).resolve().parents[3]


def rows(seconds, errors):
    """A table as a study has it: warm and cold starts of one solver."""
    shared = {"figure": "top", "target": "pile.py", "solver": "NLGS", "dt_factor": 1.0, "floor": 1e-9, "kind": "step"}
    pairs = enumerate(zip(seconds, errors, strict=True))
    return [
        shared | {"cpu_seconds": s, "error": e, "upper": e, "warm_start": k % 2 == 0, "acceleration": None} for k, (s, e) in pairs
    ]


@pytest.mark.parametrize("span", [1.3, 4.0, 30.0, 1e6])
def test_numbers_along_the_axes_of_a_study_stand_apart(span):
    figure = plots.work_precision(rows(1.7e-3 * np.geomspace(1, span, 4), 1e-5 * np.geomspace(span, 1, 4)), "top")
    figure.canvas.draw()
    ax = figure.axes[0]
    assert ax.get_ylabel() == "error of top [-]"
    assert "hollow: cold start" in [text.get_text() for text in figure.legends[0].get_texts()]
    for axis, side in ((ax.xaxis, 0), (ax.yaxis, 1)):
        shown = [t for t in axis.get_ticklabels(which="both") if t.get_text()]
        low, high = axis.get_view_interval()
        boxes = [t.get_window_extent() for t in shown if low <= t.get_position()[side] <= high]
        spans = sorted((box.intervalx if side == 0 else box.intervaly).tolist() for box in boxes)
        assert 2 <= len(spans) <= 9
        assert all(first[1] < second[0] for first, second in zip(spans, spans[1:]))


def test_numbers_of_the_page_have_exponents_where_they_are_small():
    node = shutil.which("node")
    if node is None:
        pytest.skip("no node here to run what the page runs")
    page = (ROOT / "python/cairn/post/view/page.html").read_text(encoding="utf-8")
    body = re.search(r"^ {4}(short\(x\) \{.*?\n? *\}),\n", page, re.M | re.S)[1]
    program = f"const o = {{{body}}}; console.log([0, 2.863e-6, -0.0004, 0.25, 12345.678, 3e7, Infinity].map(o.short).join(' '))"
    told = subprocess.run([node, "-e", program], capture_output=True, text=True, check=True).stdout.split()
    assert told == ["0", "2.863e-6", "-4e-4", "0.25", "12350", "3e+7", "Infinity"]


def test_pictures_of_new_laws_have_units():
    text = (ROOT / "python/cairn/plugs/run.py").read_text(encoding="utf-8")
    for label in re.findall(r"\w\.set\(.*", text):
        assert re.search(r'xlabel="[^"]+ \[[^"]+\]"', label) and re.search(r'ylabel="[^"]+ \[[^"]+\]"', label)
