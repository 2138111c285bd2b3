"""Candidate points and sides of meshed bodies of DATBOX folders: their types, colours and elements."""

import cairn as cn
import numpy as np
import pytest
from cairn import legacy
from cairn.legacy.mesh import face_points
from small_datbox import BULK, CONSTANT, SEE, row, write
from test_legacy_solids import CORNERS, ELASTIC, PLASTIC, gummy, meshed, model

GUMMY = gummy("GUMMY", 1e3, ELASTIC)
ZONE = """$behav  lawty
 zone0  MAC_CZM                         dyfr= 0.0000000D+00  stfr= 0.0000000D+00
                                        cn  = 0.1000000D+10  ct  = 0.1000000D+10
                                        b   = 0.0000000D+00  w   = 0.1000000D+03
"""
ONCE = "noda=    2  nodb=    3  nodc=    4"


def tetrahedron(rank, top, contactors):
    """On the triangle (0, 0), (1, 0), (0, 1) at height 0, whose nodes are 2, 3 and 4."""
    nodes = [(0.2, 0.2, top), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    around = "".join(f"{n:7d}" for n in ((2, 3, 4) if top > 0 else (2, 4, 3)))
    text = f"$bdyty\n MAILx{rank:7d}\n$blmty\n TE4xx      1  nodes{around}      1\n"
    text += "               model  M3D_L  behav  GUMMY\n$nodty\n"
    for k, x in enumerate(nodes, 1):
        text += f" NO3xx{k:7d}" + " " * 16 + row(*x).lstrip()
    return text + "$tacty\n" + contactors + "$$$$$$\n"


def weighted(values):
    """Two lines of weights of a point of four nodes."""
    lines = [values[:3], values[3:]]
    return "".join(
        " " * 29 + "  ".join(f"w{3 * j + k + 1}  ={w:14.7E}" for k, w in enumerate(r)) + "\n" for j, r in enumerate(lines) if r
    )


@pytest.mark.parametrize("contactors, points", [
    (f" CSpx0      1  color  BLUEx  {ONCE}\n", 1),
    (f" CSpx1      1  color  BLUEx  {ONCE}\n", 3),
    (f" CSpx2      1  color  BLUEx  {ONCE}\n", 6),
    (f" CSpxx      1  color  BLUEx  {ONCE}\n", 3),
    ("".join(f" CSpxx{k + 1:7d}  color  BLUEx  {ONCE}\n" + weighted(np.eye(3)[k].tolist()) for k in range(3)), 3),
])  # fmt: skip
def test_points_of_every_type_share_the_surface_of_their_face(contactors, points, tmp_path):
    """A tetrahedron is drawn off a heavy one at 1 mm/s: sound zones of all points hold it by stiffness, opening and area."""
    drives = ""
    for node in (1, 2, 3, 4):
        head = f"$bdyty\n MAILx        1\n$model\n MECAx\n$nodty\n NO3xx{node:7d}\n$dofty\n"
        drawn = CONSTANT.format(3).replace("  0.0000000D+00", "  1.0000000D-03", 1)
        drives += head + CONSTANT.format(1) + CONSTANT.format(2) + drawn
    lower = tetrahedron(2, -1.0, f" ASpxx      1  color  REDxx  {ONCE}\n").replace("GUMMY", "HEAVY")
    bulk = BULK.replace("-0.9810000D+01", " 0.0000000D+00") + GUMMY + gummy("HEAVY", 1e7, ELASTIC)
    see = SEE.format("MAILx", "CSxxx", "ASpxx", "REDxx").replace("iqsc0", "zone0").replace("BLEUx", "BLUEx")
    write(tmp_path / "DATBOX", tetrahedron(1, 1.0, contactors) + lower, see, ZONE, drives, bulk=bulk)
    (tmp_path / "DATBOX" / "MODELS.DAT").write_text("$model\n" + model("M3D_L", "TE4xx"))
    scene = legacy.read_datbox(tmp_path)
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(1.0, cn.NLGS(tol=1e-12), scene.legacy.alert), overlap="ignore")
    for _ in range(5):
        assert sim.step()["status"] == "converged"
    assert len(sim.contacts) == points
    upper, lower = (mesh.displacement[1:, 2].mean() for mesh in sim.meshes)
    assert upper == pytest.approx(5e-6, rel=1e-9) and 0 < lower < 1e-7
    pull = abs(sim.contacts.impulse[:, 2].sum()) / 1e-3
    assert pull == pytest.approx(1e9 * (upper - lower) * 0.5, rel=1e-6)


@pytest.mark.parametrize("count, order, degree", [(3, 0, 1), (3, 1, 2), (3, 2, 4), (4, 0, 1), (4, 1, 3), (4, 2, 5)])
def test_points_of_faces_are_those_of_gauss(count, order, degree):
    """With some weights they integrate every polynomial of their degree; shape functions sum to one."""
    points = np.array(face_points(count, order))
    assert points.shape[0] == {3: (1, 3, 6), 4: (1, 4, 9)}[count][order]
    assert points.sum(axis=1) == pytest.approx(1, rel=1e-14) and np.all(points > 0)
    corners = np.array([[0, 0], [1, 0], [0, 1]]) if count == 3 else np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    x, y = (points @ corners).T
    from math import factorial

    powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    rows = np.array([x**i * y**j for i, j in powers])
    triangle = [factorial(i) * factorial(j) / factorial(i + j + 2) for i, j in powers]
    exact = triangle if count == 3 else [1 / ((i + 1) * (j + 1)) for i, j in powers]
    weights, *_ = np.linalg.lstsq(rows, np.array(exact), rcond=None)
    assert rows @ weights == pytest.approx(np.array(exact), rel=1e-12)


def test_weights_that_do_not_sum_to_one_are_refused(tmp_path):
    wrong = f" CSpxx      1  color  BLUEx  {ONCE}\n" + weighted([0.5, 0.25, 0.0])
    write(tmp_path / "DATBOX", tetrahedron(1, 1.0, wrong), bulk=BULK + GUMMY)
    with pytest.raises(legacy.LegacyError, match=r"BODIES.DAT, line \d+.*sum to 0.75, not 1"):
        legacy.read_datbox(tmp_path)


def test_points_of_several_colours_meet_what_their_colour_sees(tmp_path):
    cells = [("Q4xxx", [0, 1, 2, 3], "M2D_L", "GUMMY")]
    folder = meshed(tmp_path, cells, CORNERS, model("M2D_L", "Q4xxx"), GUMMY, (0, 1))
    path = folder / "DATBOX" / "BODIES.DAT"
    path.write_text(path.read_text().replace("+CLxxx      1  color  BLUEx", "+CLxxx      2  color  REDxx"))
    scene = legacy.read_datbox(folder)
    assert not scene.legacy.unmapped
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=0.5, margin=scene.legacy.alert), overlap="ignore")
    touched = 0
    for _ in range(130):
        sim.step()
        touched = max(touched, len(sim.contacts))
    assert touched == 1
    moved = sim.meshes[0].position
    assert moved[1, 1] < moved[0, 1]  # the right foot, of another colour, goes on


@pytest.mark.parametrize("plane, mass", [("strain", 1e3), ("stress", 1e3), ("axisymmetric", 1e3 * np.pi)])
@pytest.mark.parametrize("element", ["Q4xxx", "Q4P0x"])
@pytest.mark.parametrize("law", ["elas_", "J2iso"])
def test_plane_and_mean_dilatation_are_those_asked_for(plane, mass, element, law, tmp_path):
    rows, name = (ELASTIC, "ELAS") if law == "elas_" else (PLASTIC, "ELAS_PLAS")
    cells = [("Q4xxx", [0, 1, 2, 3], "M2D_L", "GUMMY")]
    folder = meshed(tmp_path, cells, CORNERS, model("M2D_L", element, law), gummy("GUMMY", 1e3, rows, name), (0, 1))
    if plane == "stress" and element == "Q4P0x":
        with pytest.raises(legacy.LegacyError, match="stress"):
            legacy.read_datbox(folder, plane=plane)
        return
    scene = legacy.read_datbox(folder, plane=plane)
    assert [n for n in scene.legacy.notes if f"plane={plane!r}" in n]
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=0.5, margin=scene.legacy.alert), overlap="ignore")
    made = sim.meshes[0].body
    assert made.plane == plane and getattr(made, "mean_dilatation", False) == (element == "Q4P0x")
    assert made.nodal_mass().sum() == pytest.approx(mass, rel=1e-12)
    assert sim.step()["status"] == "converged"


def test_an_unknown_plane_is_refused(tmp_path):
    with pytest.raises(ValueError, match="plane is 'round': give 'strain', 'stress' or 'axisymmetric'"):
        legacy.read_datbox(tmp_path, plane="round")


def falling(dim, **materials):
    """A block that falls on a wall, a grain on the block: speeds at the end; materials: of its points and sides."""
    points = CORNERS if dim == 2 else [[x, y, z] for z in (0.05, 1.05) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    kind = "quad" if dim == 2 else "hexahedron"
    cells = {kind: np.arange(2**dim)[None]}
    made = cn.ElasticBody(np.array(points, float), cells, young=1e5, poisson=0.3, density=1e3, groups={"all": np.arange(2**dim)})
    floor, ball = cn.Material("floor"), cn.Material("ball", density=1e3)
    sides = {"edges": "all"} if dim == 2 else {"faces": "all"}
    up = np.eye(dim)[-1]
    scene = cn.Scene(dim=dim, gravity=-9.81 * up)
    scene.add(cn.deformable(made, cn.Material("rubber", density=1e3), contact="all", **sides, **materials))
    scene.add(cn.wall(0 * up, up, floor))
    grain = cn.disks if dim == 2 else cn.spheres
    scene.add(grain([0.5 * np.ones(dim) + 0.71 * up], [0.1], ball))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 2e-3, cn.NSCD(theta=0.5), overlap="ignore")
    touched = set()
    for _ in range(130):
        sim.step()
        touched |= set(map(tuple, np.array(sim.contacts.bodies).tolist()))
    assert len(touched) > 2  # its feet on the wall, and the grain on its top
    return np.concatenate([sim.nodes.velocity.ravel(), sim.bodies.velocity.ravel()])


@pytest.mark.parametrize("dim", [2, 3])
def test_a_list_of_materials_is_as_one_material(dim):
    rubber = cn.Material("rubber", density=1e3)
    many = {"point_material": [rubber] * 2**dim, ("edge_material" if dim == 2 else "face_material"): [rubber] * (2 * dim)}
    assert np.array_equal(falling(dim), falling(dim, **many))


@pytest.mark.parametrize("field, told", [
    ("point_material", "point_material lists 3 materials: give one for all, or one for each of the 4"),
    ("edge_material", "edge_material lists 3 materials"),
])  # fmt: skip
def test_a_list_of_another_length_is_refused(field, told):
    with pytest.raises(ValueError, match=told):
        falling(2, **{field: [cn.Material("rubber", density=1e3)] * 3})
    with pytest.raises(ValueError, match=f"{field} of 0 is 'rubber': give a cairn.Material"):
        falling(2, **{field: ["rubber"] * 4})
