"""Sides of LMGC90's meshes that go round a corner, beside polygons below it: contacts below alone."""

import os
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn import legacy
from small_datbox import BULK, LAW, SEE, body, held, row, write
from test_legacy_solids import gummy, mesh_text, model

CASES = Path(os.environ.get("CAIRN_REFERENCE_DATA", Path(__file__).resolve().parents[4] / "shared")) / "cases" / "legacy"
samples = pytest.mark.skipif(
    not (CASES / "side").is_dir(), reason="the sample data of LMGC90 are not here (CAIRN_REFERENCE_DATA)"
)

STIFF = ("elas: standard", "ani_: isotropic", "EYng= 1.0000000e+09  Epss= 2.0000000e-01")


def side(number, color, nodes):
    return "".join(f"{'+ '[k == 0]}ALpxx{number:7d}  color  {color}  noda={a + 1:5d}  nodb={b + 1:5d}\n"
                   for k, (a, b) in enumerate(zip(nodes[:-1], nodes[1:])))  # fmt: skip


def block_on_a_square(folder, color):
    """A block of 2 x 2 cells on a held square of its width: ALpxx below it, and of a color beside it."""
    corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
    square = " POLYG      1  color  BLEUx  nb_vertex=      4\n" + "".join(row(*x) for x in corners)
    points = [(x, y) for x in (-0.5, 0.0, 0.5) for y in (0.5, 1.0, 1.5)]
    cells = [("Q4xxx", [k, k + 3, k + 4, k + 1], "M2D_L", "GUMMY") for k in (0, 1, 3, 4)]
    mesh = mesh_text(cells, points) + "$tacty\n" + side(1, "REDxx", [0, 3, 6]) + side(2, color, [6, 7, 8]) + "$$$$$$\n"
    bodies = body("RBDY2", square, avrd=0.5641896, gyrd=0.4082483) + mesh
    see = "".join(SEE.format("RBDY2", "POLYG", "ALpxx", c).replace("iqsc0  RBDY2", "iqsc0  MAILx") for c in ("REDxx", "GREEN"))
    write(folder / "DATBOX", bodies, see, LAW.replace("IQS_CLB    ", "GAP_SGR_CLB"), held("RBDY2", 1),
          bulk=BULK + gummy("GUMMY", 2000.0, STIFF))  # fmt: skip
    (folder / "DATBOX" / "MODELS.DAT").write_text("$model  mdlty  finel  eleop  value\n" + model("M2D_L", "Q4xxx"))
    return folder


def run(folder):
    scene = legacy.read_datbox(folder)
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(0.505, margin=scene.legacy.alert, contact_point="surface"), overlap="ignore")
    for _ in range(20):
        assert sim.step()["status"] == "converged"
        below = np.abs(np.abs(sim.contacts.normal) - (0.0, 1.0)).max(axis=1) < 1e-3
        assert len(sim.contacts) == 4 and np.all(below) and np.abs(sim.contacts.gap).max() < 1e-4
        assert np.abs(sim.nodes.velocity).max() < 0.03
    return np.array(sim.nodes.velocity)


@pytest.mark.parametrize("color", ["REDxx", "GREEN"])
def test_a_side_round_a_corner_meets_no_square_below(color, tmp_path):
    """Its edges have the color of those below, or another; they threw it up at 25 m/s in the first step."""
    run(block_on_a_square(tmp_path, color))


@samples
def test_so_does_a_folder_of_the_pre_processor():
    run(CASES / "side")
