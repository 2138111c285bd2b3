"""Notebooks run from end to end, and their outputs agree with their text."""

import os
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[3] / "docs/notebooks"


@pytest.mark.parametrize("name", ["first_scene", "arch", "study"])
def test_a_notebook_runs(name, tmp_path):
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    notebook = nbformat.read(FOLDER / f"{name}.ipynb", 4)
    nbformat.validate(notebook)
    assert not any(cell.get("outputs") for cell in notebook.cells)  # kept without them
    where = {"metadata": {"path": str(tmp_path)}}
    client = nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3", resources=where)
    env = {**os.environ, "OMP_NUM_THREADS": "1"}
    env.pop("MPLBACKEND", None)  # a kernel shows pictures by a backend of its own
    client.execute(env=env)
    shown = [output for cell in notebook.cells for output in cell.get("outputs", []) if output.output_type != "stream"]
    assert any("image/png" in output.get("data", {}) for output in shown)
    if name == "first_scene":
        assert sum("text/html" in output.get("data", {}) for output in shown) >= 2  # a scene and a simulation


def test_every_notebook_is_tested():
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == {"first_scene", "arch", "study"}
