"""Points as contactors, with rods, wires and couplings; polyhedra in patches; the account of what was read as what."""

import cairn as cn
import numpy as np
import pytest
from cairn import legacy
from cairn.cli import main
from small_datbox import BOX, SIDES, body, contactor, held, polyhedron, row, write

LAW = """$behav  lawty
 rod00  {0:<30}  {1}
"""
SEES = """$seety
 cdbdy  cdtac  cdcol  behav  anbdy  antac  ancol       alert
 {0}  {1}  BLEUx  rod00  {0}  {1}  BLEUx       {2}
"""
STIFF = 1e5


def point(dim, *place):
    return contactor(f"PT{dim}Dx", *place, label="coo")


def hanging(tmp_path, dim, law, values, alert, at, extra=""):
    """A held body with a point at its centre, and one below it or beside it with more contactors."""
    kind = f"RBDY{dim}"
    options = {"avrd": 0.1} | ({"gyrd": 0.05} if dim == 2 else {"moments": (1e-3, 1e-3, 1e-3)})
    middle = point(dim, *[0.0] * dim)
    text = body(kind, middle, number=1, **options) + body(kind, extra or middle, at=at, number=2, **options)
    drives = held(kind, 1, (1, 2, 3) if dim == 2 else (1, 2, 3, 4, 5, 6))
    folder = write(tmp_path / "DATBOX", text, SEES.format(kind, f"PT{dim}Dx", alert), laws=LAW.format(law, values), drives=drives)
    scene = legacy.read_datbox(folder)
    scene.gravity = [0.0] * (dim - 1) + [-9.81]
    return scene, cn.Simulation(scene, 1e-4, cn.NSCD(theta=0.5, margin=scene.legacy.alert))


@pytest.mark.parametrize("dim", [2, 3])
def test_a_body_on_a_rod_between_points_hangs_and_swings_as_on_a_spring(tmp_path, dim):
    at = (0.0, -2.0, 0.0) if dim == 2 else (0.0, 0.0, -2.0)
    scene, sim = hanging(tmp_path, dim, "ELASTIC_ROD", "Fstr= 0.1000000D+06  prst= 0.0000000D+00", "0.5000000D+01", at)
    assert sim.contactors.radius.tolist() == [0, 0] and not scene.legacy.unmapped
    mass = float(sim.bodies.mass[1])
    stiffness = STIFF / 2.0  # Fstr is a force over a strain
    period = 2 * np.pi * np.sqrt(mass / stiffness)
    low = []
    for _ in range(round(period / 1e-4)):
        sim.step()
        low.append(sim.bodies.position[1, dim - 1] + 2.0)
    deepest = -2 * mass * 9.81 / stiffness
    assert min(low) == pytest.approx(deepest, rel=0.05) and abs(low[-1]) < 0.1 * abs(deepest)
    assert np.argmin(low) * 1e-4 == pytest.approx(period / 2, rel=0.02)


def test_a_wire_between_points_is_slack_when_they_are_near(tmp_path):
    scene, sim = hanging(
        tmp_path, 2, "ELASTIC_WIRE", "Fstr= 0.1000000D+06  prst= 0.0000000D+00", "0.5000000D+01", (0.0, 2.0, 0.0)
    )
    sim.run(steps=200, progress=False)
    assert sim.bodies.velocity[1, 1] == pytest.approx(-9.81 * 0.02, rel=1e-6), "it falls towards the other"


def test_coupled_points_are_a_joint(tmp_path):
    extra = contactor("DISKx", 0.1, label="byr") + point(2, -1.0, 0.0)
    scene, sim = hanging(tmp_path, 2, "COUPLED_DOF", "", "0.1000000D-01", (1.0, 0.0, 0.0), extra)
    for _ in range(3000):
        sim.step()
    x, y, turn = *sim.bodies.position[1], float(np.ravel(sim.bodies.rotation[1])[0])
    assert np.hypot(x, y) == pytest.approx(1.0, rel=1e-5) and y < -0.3
    assert np.allclose([np.cos(turn), np.sin(turn)], [x, y], atol=1e-4), "the arm turns with the body"


def test_points_are_written_and_read_again(tmp_path):
    scene, _ = hanging(tmp_path, 2, "ELASTIC_ROD", "Fstr= 0.1000000D+06  prst= 0.0000000D+00", "0.5000000D+01", (0.0, -2.0, 0.0))
    legacy.write_datbox(scene, tmp_path / "again")
    text = next((tmp_path / "again").rglob("BODIES.DAT")).read_text()
    assert text.count("PT2Dx") == 2 and "DISKx" not in text
    again = legacy.read_datbox(tmp_path / "again")
    assert [repr(law) for *_, law in again.rules] == [repr(law) for *_, law in scene.rules]


def patches(vertices, faces, count):
    """A polyhedron in patches with vertices of their own."""
    text = f" POLYF      1  color  BLEUx  nb_patch={count:8d}\n"
    for some in np.array_split(np.arange(len(faces)), count):
        used, renumbered = np.unique(np.array(faces)[some], return_inverse=True)
        own = polyhedron(np.array(vertices)[used].tolist(), renumbered.reshape(-1, 3).tolist())
        text += own.replace(" POLYR      1  color  BLEUx  ", " " * 29, 1)
    return text


def test_a_polyhedron_in_patches_is_that_of_one_surface(tmp_path):
    whole = legacy.read_datbox(write(tmp_path / "a", body("RBDY3", polyhedron(BOX, SIDES))))
    for count in (1, 3, 6):
        cut = legacy.read_datbox(write(tmp_path / f"b{count}", body("RBDY3", patches(BOX, SIDES, count))))
        for name in ("mass", "inertia", "position"):
            assert np.allclose(getattr(cut.sets[0], name), getattr(whole.sets[0], name))
        assert len(cut.sets[0].contactors[0].hulls.vertex.reshape(-1, 3)) == 8
        assert f"its {count} patches are one surface" in " ".join(cut.legacy.notes)


def test_the_account_tells_what_was_read_as_what(tmp_path, capsys):
    ball = contactor("SPHER", 0.2, label="byr")
    turned = " CYLND      1  color  BLEUx  " + row(0.5, 0.1, label="Hig").lstrip() + " " * 29 + "localframe\n"
    turned += row(0, 1, 0) + row(0, 0, 1) + row(1, 0, 0) + row(0, 0, 0)
    text = body("RBDY3", ball) + body("RBDY3", patches(BOX, SIDES, 2), number=2)
    text += body("RBDY3", turned + ball, moments=(1, 1, 1), number=3, at=(9, 9, 9))
    laws = "$behav  lawty\n iqsc0  IQS_CLB                         fric= 0.3000000D+00\n"
    laws += "$behav  lawty\n other  GTN_CZM\n"
    see = SEES.format("RBDY3", "SPHER", "0.1000000D-01").replace("rod00", "iqsc0")
    folder = write(tmp_path / "DATBOX", text, see, laws=laws)
    assert main(["convert", str(folder)]) == 0
    told = capsys.readouterr().out
    for words in ("SPHER       2  sphere", "POLYR       1  polyhedron", "CYLND       1  capsule", "Coulomb(mu=0.3)",
                  "not needed", "left out: nothing", "localframe"):  # fmt: skip
        assert words in told, told
    assert main(["convert", str(folder), str(tmp_path / "case.scene.h5")]) == 0
    assert cn.Scene.load(tmp_path / "case.scene.h5").dim == 3
    for words, said in (([str(folder), "x.csv"], "becomes a scene"), ([str(folder), "--step", "1"], "are for runs"),
                        ([str(tmp_path)], "nope") if False else ([str(tmp_path / "nope")], "missing: out")):  # fmt: skip
        assert main(["convert", *words]) == 1 and said in capsys.readouterr().err
    scene, lines = legacy.account(folder)
    assert "\n".join(lines) in told and len(scene.sets)
