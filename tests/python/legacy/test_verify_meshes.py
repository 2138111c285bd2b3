"""Meshes compared: nodes, by what LMGC90 stores of them, with those of a run; contacts by their mesh and their place."""

import json
import os
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn import legacy
from cairn.post.verify import verify
from small_datbox import BAR, BULK, LAW, SEE, body, held, row, write

DATA = Path(os.environ.get("CAIRN_REFERENCE_DATA", Path(__file__).resolve().parents[4] / "shared")) / "legacy"

MODEL = "$model  mdlty  finel  eleop  value\n M2D_L\n"
MODEL += "        MECAx  Q4xxx  kine_  small\n" + "".join(
    f"                      {o}\n" for o in ("mater  elas_", "mstrg  lump_")
)
RUBBER = "$behav  lawty\n GUMMY  ELAS                            Umas= 0.1000000D+04\n"
for rest in ("elas: standard", "ani_: isotropic", "EYng= 0.1000000D+06  EPss= 0.3000000D+00"):
    RUBBER += " " * 40 + rest + "\n"
CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def block(rank, shift):
    """A square of one element with two candidate points below."""
    text = f"$bdyty\n MAILx{rank:7d}\n$blmty\n Q4xxx      1  nodes      1      2      3      4\n"
    text += "               model  M2D_L  behav  GUMMY\n$nodty\n"
    for k, x in enumerate(CORNERS + shift, 1):
        text += f" NO2xx{k:7d}" + " " * 16 + row(*x).lstrip()
    text += "$tacty\n"
    for k, share in enumerate((0.25, 0.75)):
        text += f"{' +'[k]}CLxxx      1  color  BLUEx  noda=    1  nodb=    2  apab={share:14.7E}\n"
    return text + "$$$$$$\n"


def case(folder):
    """Two blocks above a held bar, and the run of 40 steps in which they land."""
    bodies = body("RBDY2", BAR, at=(0.5, -0.05, 0), number=1) + block(1, [0, 0.0005]) + block(2, [1.1, 0.001])
    see = SEE.format("RBDY2", "xxxxx", "JONCx", "DOWNx").replace(" RBDY2  xxxxx  BLEUx", " MAILx  CLxxx  BLUEx")
    write(folder / "DATBOX", bodies, see, LAW.replace("IQS_CLB    ", "GAP_SGR_CLB"), held("RBDY2", 1), bulk=BULK + RUBBER)
    (folder / "DATBOX" / "MODELS.DAT").write_text(MODEL)
    scene = legacy.read_datbox(folder)
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(margin=scene.legacy.alert), overlap="ignore")
    sim.run(steps=40, output=folder / "run.vtkhdf", every=40, progress=False)
    return sim


def store(folder, sim, wrong=0.0):
    """Files in LMGC90's format of the final state, with a node of the second mesh displaced."""
    (folder / "OUTBOX").mkdir(exist_ok=True)
    text = "$steps       40                time= 0.4000000D-01\n"
    for m, view in enumerate(sim.meshes, 1):
        text += f"$bdyty\n MAILx{m:9d}\n$model\n MECAx\n$nodty\n"
        moved = view.displacement + (wrong * np.eye(4, 2) * [1, 0] if m == 2 else 0.0)
        assert view.ids[0] == {1: 1, 2: 7}[m]
        for k, (x, v) in enumerate(zip(moved, view.velocity), 1):
            numbers = [f"{name}({a + 1})={value:14.7E}" for name, of in (("X", x), ("V", v)) for a, value in enumerate(of[:2])]
            text += f" NO2xx{k:7d}".ljust(29) + "  ".join(numbers[:2]) + "\n" + " " * 29 + "  ".join(numbers[2:]) + "\n"
        text += "$$$$$$\n"
    (folder / "OUTBOX" / "DOF.OUT.1").write_text(text)


def test_nodes_are_compared_and_one_that_is_elsewhere_is_found(tmp_path):
    sim = case(tmp_path)
    assert np.any(sim.contacts.impulse)
    store(tmp_path, sim)
    for one, two in ((tmp_path, tmp_path / "run.vtkhdf"), (tmp_path / "run.vtkhdf", tmp_path)):
        alike = verify(one, two)
        assert alike.agrees and alike.lone_bodies == 0 and len(alike.rows) == 1, alike.table()
        assert alike.rows[0]["position"] < 1e-7 and alike.rows[0]["velocity"] < 1e-6
    store(tmp_path, sim, wrong=1e-3)
    differs = verify(tmp_path, tmp_path / "run.vtkhdf", size=1.0)
    assert not differs.agrees and differs.rows[0]["position"] == pytest.approx(1e-3, rel=1e-4)
    assert differs.rows[0]["worst_body"] == 7  # the bar, four nodes and two points come before


@pytest.mark.skipif(not DATA.is_dir(), reason="the sample data of LMGC90 are not here (CAIRN_REFERENCE_DATA)")
def test_a_block_on_a_bar_meets_what_lmgc90_stored_contacts_too(tmp_path):
    folder = DATA / "mesh2d_block"
    settings = json.loads((folder / "case.json").read_text())
    scene = legacy.read_datbox(folder)
    strategy = cn.NSCD(settings["theta"], cn.NLGS(tol=1e-10, max_iter=100000), scene.legacy.alert, contact_point="surface")
    sim = cn.Simulation(scene, settings["dt"], strategy, overlap="ignore")
    sim.run(steps=133, output=tmp_path / "run.vtkhdf", every=133, progress=False)
    result = verify(folder, tmp_path / "run.vtkhdf", {"position": 1e-6, "force": 0.01, "total_force": 1e-5}, until=0.0134)
    assert result.agrees and result.rows[0]["contacts"] == 0.0, result.table()
    stored = verify(folder, folder / "OUTBOX")  # the same instant from both formats
    assert stored.agrees and stored.rows[0]["position"] < 1e-7


def test_a_mesh_that_no_body_has_is_refused_with_its_line(tmp_path):
    mesh = block(1, [0, 3.0]).replace("      1      2      3      4\n", "      1      4      3      2\n")
    folder = write(tmp_path, mesh, bulk=BULK + RUBBER)
    (folder / "MODELS.DAT").write_text(MODEL)
    with pytest.raises(legacy.LegacyError, match=r"BODIES.DAT, line 2: MAILx 1: quad 0 .* inside out"):
        legacy.read_datbox(folder)


def beside(folder, kind, shape):
    """A block whose lower edge meets a held body below it."""
    side = " ALpxx      1  color  SIDEx  noda=    2  nodb=    1\n"
    mesh = block(1, [0, 0.0005])
    mesh = mesh[: mesh.index(" CLxxx")] + side + "$$$$$$\n"
    see = SEE.format("RBDY2", kind, "ALpxx", "SIDEx").replace("  RBDY2  ALpxx", "  MAILx  ALpxx")
    held_body = body("RBDY2", shape, at=(0.5, -0.5, 0))
    write(folder, held_body + mesh, see, LAW.replace("IQS_CLB    ", "GAP_SGR_CLB"), held("RBDY2", 1), bulk=BULK + RUBBER)
    (folder / "MODELS.DAT").write_text(MODEL)
    return folder


def test_bars_do_not_meet_sides_of_meshes_and_that_is_said(tmp_path):
    with pytest.raises(legacy.LegacyError, match=r"contacts of JONCx with ALpxx of a mesh \(TACT_BEHAV.DAT, line 5\)"):
        legacy.read_datbox(beside(tmp_path, "JONCx", BAR.replace("DOWNx", "BLEUx")))


def test_a_polygon_bears_the_side_of_a_mesh(tmp_path):
    square = " POLYG      1  color  BLEUx  nb_vertex=      4\n" + "".join(row(*v) for v in CORNERS - 0.5)
    scene = legacy.read_datbox(beside(tmp_path, "POLYG", square))
    assert not scene.legacy.unmapped
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=1.0, margin=scene.legacy.alert), overlap="ignore")
    borne, deepest = 0.0, 0.0
    for _ in range(200):
        assert sim.step()["status"] == "converged"
        borne += abs(sim.contacts.impulse[:, 1].sum())
        deepest = min(deepest, sim.contacts.gap.min(initial=0.0))
    left = 1e3 * (9.81 * 0.2 + sim.nodes.velocity[:, 1].mean())  # its nodes have equal masses
    assert borne > 1e3 and borne == pytest.approx(left, rel=1e-9) and deepest > -1e-6
