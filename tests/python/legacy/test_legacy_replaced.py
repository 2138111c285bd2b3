"""Materials of DATBOX folders that a library of theirs holds, replaced by name, and porous bodies read as their solid."""

import cairn as cn
import numpy as np
import pytest
from cairn import legacy
from cairn.cli import main
from test_legacy_solids import ELASTIC
from test_legacy_solids import folder_of as written

OUTSIDE = ("elas.mat",)  # a file of MatLib, which no folder holds
POROUS = (*ELASTIC, "ther:", "SPHV= 0.0000000e+00", "COCO= 7.5000000e-03", "cpl_:", "BIOT= 1.0000000e+00")


def folder_of(folder, *given):
    folder.mkdir(exist_ok=True)
    return written(folder, *given)


def fall(scene, steps=120):
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=0.5, margin=scene.legacy.alert, solver=cn.NLGS(tol=1e-10)), overlap="ignore")
    for _ in range(steps):
        assert sim.step()["status"] == "converged"
    return sim


@pytest.mark.parametrize("kinematics, name, rows", [
    ("large", "USER_MAT", OUTSIDE), ("small", "USER_MAT", OUTSIDE), ("large", "ELAS", ELASTIC),
])  # fmt: skip
def test_a_material_of_another_library_is_replaced_by_name(kinematics, name, rows, tmp_path):
    """The run is that of the folder whose model Cairn knows, to the bit."""
    law = "hyper" if name == "ELAS" else ""
    rubber = cn.NeoHookean(young=1e5, poisson=0.3)
    ours = folder_of(tmp_path / "ours", kinematics, law, name, rows)
    with pytest.raises(legacy.LegacyError, match=r"read_datbox\(materials={name: "):
        legacy.read_datbox(ours)
    scene = legacy.read_datbox(ours, materials={"GUMMY": rubber})
    assert any("GUMMY" in note and "NeoHookean(young=100000, poisson=0.3)" in note for note in scene.legacy.notes)
    known = legacy.read_datbox(folder_of(tmp_path / "known", "large", "neoh_", "ELAS", ELASTIC))
    one, other = fall(scene), fall(known)
    assert one.meshes[0].body.materials["quad"] == rubber
    assert np.array_equal(one.nodes.position, other.nodes.position)


def test_mistakes_with_replaced_materials(tmp_path):
    folder = folder_of(tmp_path, "small", "elas_", "ELAS", ELASTIC)
    rubber = cn.NeoHookean(young=1e5, poisson=0.3)
    for given, told in (
        ({"GUMMI": rubber}, "materials names 'GUMMI'; meshed bodies have GUMMY; did you mean 'GUMMY'"),
        ({"STONE": rubber}, "materials names 'STONE'; meshed bodies have GUMMY"),
        ({"GUMMY": cn.Material("rubber", density=1e3)}, r"materials\['GUMMY'\] is Material.*give a material of solids"),
        (rubber, r"give \{name in BULK_BEHAV.DAT: "),
    ):
        with pytest.raises(ValueError, match=told):
            legacy.read_datbox(folder, materials=given)
    with pytest.raises(ValueError, match="drained is 'yes': give True or False"):
        legacy.read_datbox(folder, drained="yes")


def porous(folder, pressed=False):
    """The falling block as a porous one; pressed: with a pressure on a node."""
    box = folder_of(folder, "small", "elas_", "PORO_ELAS", POROUS) / "DATBOX"
    for name in ("BODIES.DAT", "MODELS.DAT"):
        text = (box / name).read_text()
        assert "Q4xxx" in text
        (box / name).write_text(text.replace("Q4xxx", "Q44xx").replace("MECAx", "POROx"))
    if pressed:
        row = " vlocy      3  1.0000000D+00  0.0000000D+00  0.0000000D+00  0.0000000D+00  0.1000000D+01  0.0000000D+00\n"
        drives = (box / "DRV_DOF.DAT").read_text()
        (box / "DRV_DOF.DAT").write_text(drives + f"$bdyty\n MAILx      1\n$nodty\n NO3xx      1\n$dofty\n{row}$$$$$$\n")
    return box


@pytest.mark.parametrize("pressed", [False, True])
def test_a_porous_body_is_read_as_its_solid_where_asked(pressed, tmp_path, capsys):
    box = porous(tmp_path / "porous", pressed)
    with pytest.raises(legacy.LegacyError, match=r"physics POROx of material GUMMY \(PORO_ELAS\): .*read_datbox\(drained=True\)"):
        legacy.read_datbox(box)
    scene = legacy.read_datbox(box, drained=True)
    (note,) = (note for note in scene.legacy.notes if "drained" in note)
    assert ("1 pressures and flows" in note) == pressed
    solid = legacy.read_datbox(folder_of(tmp_path / "solid", "small", "elas_", "ELAS", ELASTIC))
    assert np.array_equal(fall(scene).nodes.position, fall(solid).nodes.position)
    assert main(["convert", str(box)]) in (0, 3) and "drained=True" in capsys.readouterr().out


def test_a_porous_body_of_a_library_takes_both(tmp_path):
    box = porous(tmp_path)
    text = (box / "BULK_BEHAV.DAT").read_text()
    (box / "BULK_BEHAV.DAT").write_text(text.split(" GUMMY")[0] + " GUMMY  USER_MAT                        Umas= 0.0000000D+00\n"
                                        + " " * 40 + "NEOHOOKEAN_EOS.mat\n")  # fmt: skip
    rubber = cn.NeoHookean(young=1e5, poisson=0.3)
    scene = legacy.read_datbox(box, drained=True, materials={"GUMMY": rubber}, light=1e3)
    assert fall(scene, 5).meshes[0].body.materials["quad"] == rubber


def test_an_element_of_a_porous_body_with_nodes_too_few(tmp_path):
    box = porous(tmp_path)
    for name in ("BODIES.DAT", "MODELS.DAT"):
        (box / name).write_text((box / name).read_text().replace("Q44xx", "Q84xx"))
    with pytest.raises(legacy.LegacyError, match="has 4 nodes, not 8"):
        legacy.read_datbox(box, drained=True)
