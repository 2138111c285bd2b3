"""Folders of LMGC90 with oddities that do no harm are read; others are refused for the right reason."""

import cairn as cn
import numpy as np
import pytest
from cairn import legacy
from small_datbox import BAR, BULK, CONSTANT, DISK, HELD, LAW, SEE, body, contactor, held, polyhedron, row, write
from test_legacy_contactors import GUMMY, ONCE, model, tetrahedron
from test_legacy_reading import BOX, SIDES
from test_verify_meshes import CORNERS, MODEL, RUBBER, block

HOT = "$behav  lawty\n HOT__  THERMO_ELAS                     Umas= 0.1000000D+04\n" + "".join(
    " " * 40 + rest + "\n"
    for rest in ("elas: standard", "ani_: isotropic", "EYng= 0.1000000D+06  Epss= 0.3000000D+00", "ther:", "SPHV= 5.0E+02",
                 "COCO= 5.0E+01")
)  # fmt: skip
HEAT = " THERe\n        THERM  Q4xxx  cstrg  lump_\n"


def turned_off(dofs):
    return HELD.format("RBDY3", 1, "NO6xx") + "".join(map(CONSTANT.format, dofs)) + "$$$$$$\n"


@pytest.mark.parametrize("law, recovers", [("GAP_SGR_CLB_g0", True), ("IQS_CLB_g0", False)])
@pytest.mark.parametrize("points", [
    f" CSpxx      1  color  BLUEx  {ONCE}\n", f" CSpx0      1  color  BLUEx  {ONCE}\n", f" CSpx1      1  color  BLUEx  {ONCE}\n",
])  # fmt: skip
def test_laws_of_gaps_from_the_start_on_points_of_meshes(points, law, recovers, tmp_path):
    """One tetrahedron rests on another that is held, .2 mm within it at the start, which the law takes for touching."""
    still = "".join(map(CONSTANT.format, (1, 2, 3)))
    drives = "".join(f"$bdyty\n MAILx        2\n$model\n MECAx\n$nodty\n NO3xx{k:7d}\n$dofty\n{still}" for k in (1, 2, 3, 4))
    upper = tetrahedron(1, 1.0, points).replace("coo3= 0.0000000E+00", "coo3=-2.0000000E-04")
    lower = tetrahedron(2, -1.0, f" ASpxx      1  color  REDxx  {ONCE}\n")
    see = SEE.format("MAILx", "CSxxx", "ASpxx", "REDxx").replace("BLEUx", "BLUEx")
    gravity = BULK.replace("grv2=-0.9810000D+01  grv3= 0.0000000D+00", "grv2= 0.0000000D+00  grv3=-0.9810000D+01")
    write(tmp_path / "DATBOX", upper + lower, see, LAW.replace("IQS_CLB".ljust(32), law.ljust(32)), drives, bulk=gravity + GUMMY)
    (tmp_path / "DATBOX" / "MODELS.DAT").write_text("$model\n" + model("M3D_L", "TE4xx"))
    scene = legacy.read_datbox(tmp_path)
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(1.0, cn.NLGS(tol=1e-12), scene.legacy.alert), overlap="ignore")
    for _ in range(30):
        assert sim.step()["status"] == "converged"
    carried = sim.contacts.impulse[:, 2].sum() / 1e-3
    assert abs(carried) == pytest.approx(1000 / 6 * 9.81, rel=0.3) and np.abs(sim.meshes[0].displacement).max() < 1e-2


def test_hulls_that_nearly_fit_are_taken_where_the_error_advises_them(tmp_path):
    """A ball with dents, which no exact cut follows: refused with the option that reads it."""
    pytest.importorskip("coacd")
    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(subdivisions=3, radius=1.0)
    points = np.array(ball.vertices)
    points *= (1 - 0.15 * (np.arange(len(points)) % 3 == 0))[:, None]
    text = body("RBDY3", polyhedron(points, np.array(ball.faces)))
    with pytest.raises(legacy.LegacyError, match=r"BODIES.DAT, line \d+: contactor POLYR of RBDY3 1 is not convex.*near=0.05"):
        legacy.read_datbox(write(tmp_path, text))
    s = legacy.read_datbox(tmp_path, near=0.3).sets[0]
    assert len(s) == 1 and len(s.contactors[0].body) >= 1
    volume = trimesh.Trimesh(points, ball.faces, process=False).volume
    assert s.mass[0] == pytest.approx(1e3 * volume, rel=1e-5)


@pytest.mark.parametrize("axis", [-9e-15, 0.0])
def test_nodes_on_the_axis_by_rounding(tmp_path, axis):
    """The side of a ring at x = -9e-15 is on the axis; one that is beyond it is refused."""
    text = block(1, [0, 0.0]).replace("coo1= 0.0000000E+00", f"coo1={axis:14.7E}")
    bar = body("RBDY2", BAR, at=(0.5, -0.5, 0), number=1)
    write(tmp_path / "DATBOX", bar + text, "", drives=held("RBDY2", 1), bulk=BULK + RUBBER)
    (tmp_path / "DATBOX" / "MODELS.DAT").write_text(MODEL)
    scene = legacy.read_datbox(tmp_path, plane="axisymmetric")
    assert scene.sets[1].mass.sum() == pytest.approx(1000 * np.pi, rel=1e-12)
    material = cn.IsotropicElastic(young=1e5, poisson=0.3)
    points, cells = np.array(CORNERS), {"quad": [[0, 1, 2, 3]]}
    points[0, 0] = axis
    ring = cn.SolidBody(points, cells, material, density=1e3, plane="axisymmetric")
    assert ring.points[0, 0] == 0.0
    points[0, 0] = -1e-6
    with pytest.raises(ValueError, match="node 0 has the radius -1e-06 m: give x >= 0"):
        cn.SolidBody(points, cells, material, density=1e3, plane="axisymmetric")


def test_a_body_that_cannot_turn_needs_no_moments(tmp_path):
    """A point without moments falls with all its turns held; another is refused. Axes of a body without moments do not matter."""
    point = contactor("PT3Dx", 0, 0, 0, label="coo")
    text = body("RBDY3", point, avrd=0.1, at=(0, 0, 1))
    with pytest.raises(legacy.LegacyError, match="RBDY3 1 has a mass and no moment of inertia"):
        legacy.read_datbox(write(tmp_path, text), unmapped="skip")
    s = legacy.read_datbox(write(tmp_path, text, drives=turned_off((4, 5, 6)))).sets[0]
    assert s.mass[0] == pytest.approx(1e3 * 4 / 3 * np.pi * 1e-3, rel=1e-6) and np.all(np.isinf(s.inertia))
    tilted = np.array(BOX) @ np.array([[1, 0.3, 0], [0, 1, 0.2], [0, 0, 2]])
    axes = "$bdyty\n RBDY3        1\n$nodty\n NO6xx      1" + " " * 16 + row(0, 0, 0).lstrip() + 3 * row(0, 0, 0)
    axes += row(1, 0, 0) + row(0, 1, 0) + row(0, 0, 1) + "$$$$$$\n"
    text = body("RBDY3", polyhedron(tilted, SIDES))
    folder = write(tmp_path, text, drives=turned_off((1, 2, 3, 4, 5, 6)), states=axes)
    scene = legacy.read_datbox(folder)
    sim = cn.Simulation(scene, 1e-2)
    sim.step()
    hull = scene.sets[0].contactors[0].hulls.vertex.reshape(-1, 3)
    w, x, y, z = scene.sets[0].rotation[0]
    turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])  # fmt: skip
    placed = hull @ turn.T + scene.sets[0].position[0]
    assert np.allclose(np.sort(placed, axis=0), np.sort(tilted, axis=0), atol=1e-6)


def plate(rank, at):
    """A square of one element of heat."""
    text = f"$bdyty\n MAILx{rank:7d}\n$blmty\n Q4xxx      1  nodes      1      2      3      4\n"
    text += "               model  THERe  behav  HOT__\n$nodty\n"
    for k, x in enumerate(CORNERS + at, 1):
        text += f" NO2xx{k:7d}" + " " * 16 + row(*x).lstrip()
    return text + "$tacty\n$$$$$$\n"


def temperatures(number, value):
    rows = "".join(f" NO1xx{k:7d}".ljust(29) + f"T(1)={value + k:14.7E}\n" for k in (1, 2, 3, 4))
    return f"$bdyty\n MAILx{number:7d}\n$model\n THERM\n$nodty\n{rows}$$$$$$\n"


def displacements(number, x):
    rows = "".join(
        f" NO2xx{k:7d}".ljust(29) + f"X(1)={x:14.7E}  X(2)={0:14.7E}\n" + " " * 29 + f"V(1)={0:14.7E}  V(2)={0:14.7E}\n"
        for k in (1, 2, 3, 4)
    )
    return f"$bdyty\n MAILx{number:7d}\n$model\n MECAx\n$nodty\n{rows}$$$$$$\n"


@pytest.mark.parametrize("numbers, moved", [((1, 2), 1), ((2, 3), 1), ((1, 2), 4)])
def test_bodies_of_one_physics_are_numbered_from_1(tmp_path, numbers, moved):
    """A body that deforms, two of heat, and one more: in DOF.INI those of heat are 1 and 2, as LMGC90 has them, or 2 and 3."""
    bodies = block(1, [0, 0]) + plate(2, [3, 0]) + plate(3, [6, 0]) + block(4, [9, 0])
    states = displacements({1: 1, 4: 2}[moved], 1e-3) + temperatures(numbers[0], 300) + temperatures(numbers[1], 400)
    write(tmp_path / "DATBOX", bodies, states=states, bulk=BULK + RUBBER + HOT)
    (tmp_path / "DATBOX" / "MODELS.DAT").write_text(MODEL + HEAT)
    scene = legacy.read_datbox(tmp_path)
    initial = dict(scene.networks["thermal"].initial)
    found = [initial[f"MAILx {k}.node {n}"] for k in (2, 3) for n in (0, 3)]
    assert found == pytest.approx([301, 304, 401, 404]) and len(initial) == 8
    meshes = [s for s in scene.sets if s.mesh is not None]
    shift = {s.mesh.name: float(s.position[0, 0]) for s in meshes}
    assert list(shift.values()) == pytest.approx([1e-3 * (moved == 1), 3, 6, 9 + 1e-3 * (moved == 4)]) and len(shift) == 4


def test_an_evolution_whose_last_row_goes_back_in_time(tmp_path):
    """LMGC90 goes on beyond the row before along the line through both, whatever their order."""
    drives = HELD.format("RBDY2", 1, "NO3xx") + " vlocy      1 evolution push.txt\n$$$$$$\n"
    folder = write(tmp_path, body("RBDY2", DISK, at=(0, 1, 0)), drives=drives)
    (folder / "push.txt").write_text("0 0\n1 2\n2 5\n1.5 6\n")
    scene = legacy.read_datbox(folder)
    drive = scene.sets[0].drive
    for t, value in ((0.5, 1.0), (1.5, 3.5), (2.0, 5.0), (2.5, 4.0), (4.0, 1.0)):
        assert drive(t)[0] == pytest.approx(value)
    assert any("push.txt, line 4: time 1.5 goes back" in note for note in scene.legacy.notes)
    assert len(str(scene.legacy).splitlines()) <= 10 and "told otherwise: push.txt, line 4" in str(scene.legacy)
    for text, line in (("0 0\n1 2\n0.5 3\n2 4\n", 3), ("0 0\n1 2\n1 3\n", 3), ("1 0\n0 2\n", 2)):
        (folder / "push.txt").write_text(text)
        with pytest.raises(legacy.LegacyError, match=f"push.txt, line {line}: .*give rising times"):
            legacy.read_datbox(folder)


def test_shapes_that_are_not_read_are_refused_for_what_they_are(tmp_path):
    patch = polyhedron(BOX, SIDES[:-2]).replace(" POLYR      1  color  BLEUx  ", " " * 29, 1)
    patches = " POLYF      1  color  BLEUx  nb_patch=       1\n" + patch
    with pytest.raises(legacy.LegacyError, match="contactor POLYR of RBDY3 1 is no polyhedron"):  # a side is missing
        legacy.read_datbox(write(tmp_path, body("RBDY3", patches)))


def lying(*axes, at=(0.0, 0.0, 0.0), half=0.5, radius=0.1):
    """A CYLND whose localframe has these axes."""
    text = " CYLND      1  color  BLEUx  " + row(half, radius, label="Hig").lstrip() + " " * 29 + "localframe\n"
    return text + "".join(row(*a) for a in axes) + row(*at)


def test_cylinders_along_their_own_axes_in_a_body_of_several(tmp_path):
    """A cross of two capsules, along x and along y, falls on a plane: its arm of 0.1 m radius comes to rest on it."""
    cross = lying((0, 1, 0), (0, 0, 1), (1, 0, 0)) + lying((0, 0, 1), (1, 0, 0), (0, 1, 0), half=0.3)
    floor = body("RBDY3", contactor("PLANx", 3.0, 3.0, 0.1), at=(0, 0, -0.1), number=2)
    texts = body("RBDY3", cross, at=(0, 0, 0.15), moments=(1.0, 2.0, 3.0), avrd=0.2) + floor
    see = SEE.format("RBDY3", "CYLND", "PLANx", "BLEUx")
    down = BULK.replace("grv2=-0.9810000D+01  grv3= 0.0000000D+00", "grv2= 0.0000000D+00  grv3=-0.9810000D+01")
    scene = legacy.read_datbox(write(tmp_path / "DATBOX", texts, see, drives=held("RBDY3", 2, range(1, 7)), bulk=down))
    assert any("CYLND with localframe" in note for note in scene.legacy.notes) and not scene.legacy.unmapped
    hulls = scene.sets[0].contactors[0].hulls
    assert np.allclose(sorted(map(tuple, hulls.plane[:, :3])), [(0, 1, 0), (1, 0, 0)])
    sim = cn.Simulation(scene, 2e-3, cn.NSCD(margin=scene.legacy.alert))
    sim.run(steps=200, progress=False)
    assert abs(sim.bodies.position[0, 2] - 0.1) < 1e-3
    points = sim.contacts.point
    far = np.abs(points[:, :2]).max(axis=0)
    assert np.allclose(far, (0.5, 0.3), atol=2e-3)  # the ends of both arms bear


def test_problems_of_rolling_friction_are_told_as_such(tmp_path):
    h5py = pytest.importorskip("h5py")
    from cairn import problems

    with h5py.File(tmp_path / "rolling.hdf5", "w") as file:
        file.create_group("fclib_global_rolling")["spacedim"] = [5]
    with pytest.raises(problems.ProblemFileError, match="holds fclib_global_rolling, with rolling friction"):
        problems.read(tmp_path / "rolling.hdf5")
    with h5py.File(tmp_path / "other.hdf5", "w") as file:
        file.create_group("something")
    with pytest.raises(problems.ProblemFileError, match="neither fclib_local nor fclib_global"):
        problems.read(tmp_path / "other.hdf5")
