"""Folders in the words of older versions of LMGC90, bodies without a density, cylinders whose triangles run within their hull."""

import cairn as cn
import numpy as np
import pytest
from cairn import legacy
from cairn.legacy import rigid
from small_datbox import BAR, BULK, SEE, body, contactor, polyhedron, write
from test_legacy_solids import CORNERS, ELASTIC, gummy, held, meshed, model

MAL = """$behav  lawty
 iqsc0  {0:30s}  dfrc= 0.1000000D+00  sfrc= 0.1000000D+00
                                        cn  = 0.1000000D+13  ct  = 0.1000000D+13
                                        visc= 0.3162270D+06  dupr= 0.1000000D-00

"""
SHORT = """$behav  lawty
 {0}  IQS_WET_DS_CLB                  cohn= 0.5880000D+05  coht= 0.0000000D+00
                                        dyfr= 0.2000000D+00  stfr= 0.2000000D+00
"""


def two_bars(folder, laws):
    bars = "".join(body("RBDY2", BAR, at=(0.0, 0.11 * k, 0), number=k + 1) for k in range(2))
    see = SEE.format("RBDY2", "JONCx", "JONCx", "DOWNx").replace("BLEUx", "DOWNx")
    return write(folder / "DATBOX", bodies=bars, see=see, laws=laws)


@pytest.mark.parametrize("name", ["MAL_CZM", "IQS_MAL_CZM"])
def test_a_zone_of_two_numbers_has_them_for_both_modes(name, tmp_path):
    scene = legacy.read_datbox(two_bars(tmp_path, MAL.format(name)).parent)
    law = next(iter(scene.legacy.datbox.laws.values())).parameters
    assert (law["s1"], law["s2"], law["G1"], law["G2"]) == (316227.0, 316227.0, 0.1, 0.1)
    assert any("iqsc0" in note and "older version" in note and "strength" in note for note in scene.legacy.notes)
    assert law["s1"] == pytest.approx(np.sqrt(law["G1"] * law["cn"]), rel=1e-5)  # as a zone in a straight line has it


def test_a_law_that_ends_early_counts_where_something_touches_by_it(tmp_path):
    plain = "$behav  lawty\n iqsc0  IQS_CLB                         fric= 0.3000000D+00\n"
    scene = legacy.read_datbox(two_bars(tmp_path, SHORT.format("weta1") + plain).parent)
    assert any("law weta1, by which nothing touches, is passed over" in note for note in scene.legacy.notes)
    with pytest.raises(legacy.LegacyError, match=r"law iqsc0 \(IQS_WET_DS_CLB\) ends here: a line of dyfr, stfr was expected"):
        legacy.read_datbox(two_bars(tmp_path, SHORT.format("iqsc0")).parent)


def test_a_body_without_density_is_told_and_read_as_a_light_one(tmp_path):
    """A block on a bar under its own force alone: where it rests does not depend on the density that it is lent."""
    cells = [("Q4xxx", [0, 1, 2, 3], "M2D_L", "GUMMY")]
    folder = meshed(tmp_path, cells, CORNERS, model("M2D_L", "Q4xxx"), gummy("GUMMY", 0.0, ELASTIC), (0, 1))
    drives = (folder / "DATBOX" / "DRV_DOF.DAT").read_text()
    foot = "$bdyty\n MAILx        1\n"
    for node, dof, kind, value in ((1, 1, "vlocy", 0), (1, 2, "vlocy", 0), (2, 2, "vlocy", 0), (3, 2, "force", -1e3)):
        foot += f"$nodty\n NO2xx{node:7d}\n$dofty        [CT......\n"
        foot += f" {kind}{dof:7d} {value:14.7E} {0:14.7E} {0:14.7E} {0:14.7E} {1:14.7E} {0:14.7E}\n"
    (folder / "DATBOX" / "DRV_DOF.DAT").write_text(drives + foot + "$$$$$$\n")
    with pytest.raises(legacy.LegacyError, match=r"material GUMMY of MAILx 1 has the density Umas= 0: .*light="):
        legacy.read_datbox(folder)
    with pytest.raises(ValueError, match="light"):
        legacy.read_datbox(folder, light=0.0)
    found = []
    for light in (1e-6, 1e-4):
        scene = legacy.read_datbox(folder, light=light)
        assert any("has no density, and is read with light" in note for note in scene.legacy.notes)
        sim = cn.Simulation(scene, 1.0, cn.NSCD(theta=1.0), overlap="ignore")
        for _ in range(5):
            sim.step()
        found.append(sim.meshes[0].displacement)
        force = np.zeros((4, 2))
        force[2, 1] = -1e3
        body_ = sim.meshes[0].body
        fixed = {"node 0": "xy", "node 1": "y"}
        assert np.allclose(found[-1], body_.solve(fixed, force=force.ravel()), rtol=0, atol=1e-6 * np.abs(found[-1]).max())
    assert np.allclose(*found, rtol=0, atol=1e-6 * np.abs(found[0]).max())


def not_closed(*given):
    """In place of convex_parts: by rounding, as in files of eight digits."""
    raise ValueError("a cut does not close, by rounding of faces nearly in one plane")


def twisted(n):
    """Vertices and faces of a prism whose lid is turned against its foot by a third of a side, cut along hollow diagonals."""
    angle = 2 * np.pi * np.arange(n) / n
    ring = np.c_[np.cos(angle), np.sin(angle)]
    turn = 2 * np.pi / n / 3  # of the lid, so that its sides are not flat
    lid = np.c_[np.cos(angle + turn), np.sin(angle + turn)]
    vertices = np.r_[np.c_[ring, np.zeros(n)], np.c_[lid, np.ones(n)]]
    faces = []
    for k in range(n):
        a, b, c, d = k, (k + 1) % n, n + (k + 1) % n, n + k
        faces += [[a, b, c], [a, c, d]]  # the other diagonal is the one of the hull
    faces += [[0, k + 1, k] for k in range(1, n - 1)] + [[n, n + k, n + k + 1] for k in range(1, n - 1)]
    return vertices, faces


def frame(hole):
    """A plate 2 m wide and 1 m thick with a square hole through it."""
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    flat = np.r_[square, hole / 2 * square]
    vertices = np.r_[np.c_[flat, np.zeros(8)], np.c_[flat, np.ones(8)]]
    faces = []
    for k, n in ((0, 1), (1, 2), (2, 3), (3, 0)):
        faces += [[k, n, 8 + n], [k, 8 + n, 8 + k], [4 + k, 12 + n, 4 + n], [4 + k, 12 + k, 12 + n]]
        faces += [[k, 4 + n, n], [k, 4 + k, 4 + n], [8 + k, 8 + n, 12 + n], [8 + k, 12 + n, 12 + k]]
    return vertices, faces


def standing(folder, vertices, faces):
    """A folder of a polyhedron on a floor that is held."""
    floor = contactor("PLANx", 2.0, 2.0, 0.1, color="DOWNx")
    bodies = body("RBDY3", polyhedron(vertices, faces), at=(0, 0, 0.2)) + body("RBDY3", floor, at=(0, 0, -0.1), number=2)
    see = SEE.format("RBDY3", "POLYR", "PLANx", "DOWNx")
    bulk = BULK.replace("grv2=-0.9810000D+01  grv3= 0.0000000D+00", "grv2= 0.0000000D+01  grv3=-0.9810000D+01")
    return write(folder, bodies, see, drives=held("RBDY3", 2, (1, 2, 3, 4, 5, 6)), bulk=bulk)


def test_a_cylinder_whose_triangles_run_within_its_hull_is_its_hull(tmp_path, monkeypatch):
    """A side that is twisted a little, cut along its hollow diagonals: the hull touches, the mass is that of the faces."""
    monkeypatch.setattr(rigid, "convex_parts", not_closed)
    vertices, faces = twisted(12)
    folder = standing(tmp_path / "DATBOX", vertices, faces)
    scene = legacy.read_datbox(folder.parent)
    told = [note for note in scene.legacy.notes if "within the hull of their vertices" in note]
    assert len(told) == 1 and "POLYR of RBDY3 1" in told[0]
    sim = cn.Simulation(scene, 2e-3, cn.NSCD(margin=scene.legacy.alert), overlap="ignore")
    corners = vertices[faces]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert sim.bodies.mass[0] == pytest.approx(1000 * volume, rel=1e-6)
    for _ in range(150):
        assert sim.step()["status"] == "converged"
    assert sim.bodies.position[0, 2] == pytest.approx(0.5, abs=2e-3)


@pytest.mark.parametrize("shape", [frame(1.6), frame(0.1), twisted(4)], ids=["frame", "bored plate", "waist"])
def test_what_is_hollow_or_goes_through_is_not_taken_for_its_hull(shape, tmp_path, monkeypatch):
    """All vertices lie on the hull: 64 % of the frame is a hole, one of 0.25 % goes through, a waist takes 30 %."""
    monkeypatch.setattr(rigid, "convex_parts", not_closed)
    with pytest.raises(legacy.LegacyError, match="POLYR of RBDY3 1 is not convex, and is not cut into convex parts"):
        legacy.read_datbox(standing(tmp_path / "DATBOX", *shape).parent)
