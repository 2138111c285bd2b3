"""First steps of newcomers, as they would type them: a student's first pile, an engineer's blocks from CAD. A Fortran user's
program is tests/consumers/fortran/heap.f90."""

import os
import re
import subprocess
import sys
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from optional import reader_of_step

ROOT = Path(__file__).resolve().parents[3]


def cairn(folder, *words):
    """The command in a folder; its output."""
    call = [sys.executable, "-m", "cairn", *words]
    ended = subprocess.run(call, cwd=folder, env={**os.environ, "MPLBACKEND": "Agg"}, capture_output=True, text=True, timeout=200)
    assert ended.returncode == 0, (words, ended.stdout, ended.stderr)
    return ended.stdout


def test_a_student_runs_looks_and_converts(tmp_path):
    """The scene of the first page, in a script, by Python and then by the commands that stand beside it, as they stand there."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (tmp_path / "pile.py").write_text(re.search(r"^```python\n(.*?)^```", text, re.M | re.S)[1])
    subprocess.run([sys.executable, "pile.py"], cwd=tmp_path, check=True, capture_output=True, timeout=200)
    cairn(tmp_path, *re.search(r"^cairn (run pile\.py[^#\n]*)", text, re.M)[1].split())
    assert "converged" in cairn(tmp_path, "info", "pile.vtkhdf")
    cairn(tmp_path, "plot", "pile.vtkhdf", "-o", "pile.png")
    cairn(tmp_path, "plot", "pile.vtkhdf", "--what", "forces", "-o", "forces.pdf")
    cairn(tmp_path, "convert", "pile.vtkhdf", "pile.csv")
    assert (tmp_path / "pile.png").stat().st_size > 5000 and (tmp_path / "forces.pdf").stat().st_size > 2000
    rows = (tmp_path / "pile.csv").read_text().splitlines()
    assert len(rows) == 1 + 11 * 51
    pytest.importorskip("trame_vtk")
    pytest.importorskip("pyvista")
    cairn(tmp_path, "view", "pile.vtkhdf", "--html", "pile.html")
    assert (tmp_path / "pile.html").stat().st_size > 100_000


def test_an_engineer_brings_a_gate_from_cad(tmp_path):
    """Two posts and a lintel drawn in millimetres as a STEP file: imported, held, run at rest, drawn, pushed until they fall."""
    gmsh = reader_of_step()
    gmsh.initialize([], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    for x, z, dx, dz in ((0, 0, 3000, 300), (200, 300, 600, 1800), (2200, 300, 600, 1800), (0, 2100, 3000, 500)):
        gmsh.model.occ.addBox(x, 0, z, dx, 800, dz)
    gmsh.model.occ.synchronize()
    gmsh.write(str(tmp_path / "gate.step"))
    gmsh.finalize()
    told = cairn(tmp_path, "import", "gate.step", "--hold", "lowest", "-o", "gate.scene.h5", "--density", "2400", "--mu", "0.6")
    assert "4 blocks, 4 closed as they came" in told and "4 joints" in told and "0 overlaps" in told and "held: 1 blocks" in told
    cairn(tmp_path, "run", "gate.scene.h5", "--dt", "1e-3", "--steps", "100", "--output", "gate.vtkhdf", "-q")
    with cn.load(tmp_path / "gate.vtkhdf") as run:
        assert np.abs(run[-1].bodies.position - run[0].bodies.position).max() < 1e-4
        weight = 2400 * 9.81 * (2 * 0.6 * 0.8 * 1.8 + 3.0 * 0.8 * 0.5)
        lowest = run[-1].contacts
        on_base = np.abs(lowest.point[:, 2] - 0.3) < 1e-3
        carried = np.abs(lowest.impulse[on_base, 2].sum()) / run.scene["dt"]
        assert carried == pytest.approx(weight, rel=1e-3)
    cairn(tmp_path, "plot", "gate.vtkhdf", "-o", "gate.png")
    from cairn.post.collapse import collapse_multiplier
    from cairn.pre import importing

    blocks, _ = importing.read(tmp_path / "gate.step")
    blocks.part[int(np.argmin([v[:, 2].max() for v in blocks.vertices]))] = "support"
    found = collapse_multiplier(blocks, mu=0.6, load="push", progress=False)
    assert 0.1 < found.multiplier < 0.6 and found.multiplier == pytest.approx(found.limit, rel=0.05)
