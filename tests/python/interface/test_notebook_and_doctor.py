"""Displays in notebooks, and findings of `cairn doctor`."""

import base64
import json
import re

import cairn as cn
from cairn import cli
from cairn.cli import doctor
from small_scenes import heap


def test_a_notebook_shows_scene_simulation_and_run(tmp_path):
    scene = heap()
    simulation = cn.Simulation(scene, dt=1e-3)
    assert "<table>" in scene._repr_html_() and f"{scene.count:,}" in scene._repr_html_()
    assert "time [s]" in simulation._repr_html_()
    simulation.run(steps=4, output=tmp_path / "a<b>.vtkhdf", every=2, progress=False)
    assert "converged" in simulation._repr_html_()
    with cn.load(tmp_path / "a<b>.vtkhdf") as run:
        text = run._repr_html_()
    assert "a&lt;b&gt;" in text and "a<b>" not in text
    assert base64.b64decode(re.search(r'base64,([^"]+)"', text)[1]).startswith(b"\x89PNG")


def test_doctor_finds_what_is_there(capsys):
    assert cli.main(["doctor", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["self-test"]["verdict"] == "right" and facts["packages"]["numpy"][0].isdigit()
    assert facts["cairn"]["version"] == cn.__version__
    assert cli.main(["doctor"]) == 0 and "self-test" in capsys.readouterr().out


def test_doctor_says_what_is_wrong(monkeypatch, capsys):
    """A core whose steps do not converge, or carry another weight, is told apart."""
    monkeypatch.setattr(cn.Simulation, "run", lambda self, **_: None)
    monkeypatch.setattr(cn.Simulation, "info", property(lambda self: {"status": "max_iterations"}))
    monkeypatch.setattr(doctor, "examine", lambda: {"self-test": {"verdict": "wrong: the step ended max_iterations"}})
    assert cli.main(["doctor"]) == 1 and "wrong" in capsys.readouterr().out


def test_missing_packages_come_with_a_remedy(monkeypatch):
    def missing(name):
        raise doctor.importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(doctor.importlib.metadata, "version", missing)
    monkeypatch.setattr(doctor, "self_test", dict)
    assert doctor.examine()["packages"]["pyvista"] == "missing: for pictures in space; pip install pyvista"


def test_doctor_tells_which_blas_is_in_use(tmp_path):
    """Detection by the libraries loaded in the process: the reference library of Debian, OpenBLAS under its own name and in its
    place."""
    assert doctor.blas(tmp_path / "none").startswith("unknown")
    line, maps = "7f00-7f01 r-xp 00000000 fe:00 {}                    {}\n", tmp_path / "maps"
    for path, name in (
        ("/usr/lib/x86_64-linux-gnu/blas/libblas.so.3.11.0", "reference"),
        ("/usr/lib/x86_64-linux-gnu/openblas-serial/libblas.so.3", "OpenBLAS"),
        ("/opt/conda/lib/libopenblasp-r0.3.21.so", "OpenBLAS"),
        ("/opt/intel/libmkl_core.so.2", "MKL"),
    ):
        maps.write_text(line.format(1, "/usr/lib/libc.so.6") + "7f02-7f03 rw-p 00000000 00:00 0\n" + line.format(2, path))
        assert doctor.blas(maps) == f"{name} at {path}"
    maps.write_text(line.format(1, "/venv/site-packages/numpy.libs/libscipy_openblas64_-32a4b2a6.so"))  # numpy's own
    assert doctor.blas(maps).startswith("none")
