"""How DATBOX files are read: by columns, as LMGC90 does, with the properties it takes from contactors; never in part."""

import warnings

import cairn as cn
import numpy as np
import pytest
from cairn import legacy
from small_datbox import BAR, BOX, BULK, DISK, HELD, LAW, SEE, SIDES, body, contactor, held, polyhedron, row, write


def test_comments_in_column_1_are_passed_over_in_every_file(tmp_path):
    held_x = held("RBDY2", 1, (1,)).replace(" vlocy      1", "# vlocy      2  0.1000000D+01\n! vlocy      3\n vlocy      1")
    laws = "$behav  lawty\n# iqsc0  IQS_CLB                         fric= 0.9000000D+00\n" + LAW.split("\n", 1)[1]
    bodies = "#$bdyty\n! RBDY2\n" + body("RBDY2", "#" + DISK + DISK)
    scene = legacy.read_datbox(write(tmp_path, bodies, SEE.format("RBDY2", "DISKx", "DISKx", "BLEUx"), laws, held_x))
    assert scene.count == 1 and scene.sets[0].driven == ("vx",) and len(scene.sets[0].contactors[0].body) == 1
    assert [law.values for _, _, law in scene.rules if law is not None] == [(0.3,)]


def test_masses_left_open_are_those_of_the_contactors(tmp_path):
    """avrd or gyrd 0 in 2D, avrd 0 in 3D; formulas of each shape by hand. A bar with a driven dof does not hang in the air."""
    square = " POLYG      1  color  BLEUx  nb_vertex=      4    byrd= 0.0000000D+00\n"
    square += "".join(row(*v) for v in ((0, 0), (2, 0), (2, 1), (0, 1)))
    two = contactor("DISKb", 0.1, label="byr") + row(0.2, 0.0) + contactor("DISKb", 0.1, label="byr") + row(-0.2, 0.0)
    far = (0.0, 5.0, 0.0)
    bodies = [
        body("RBDY2", DISK, at=far),
        body("RBDY2", BAR, at=far, avrd=3.0),
        body("RBDY2", square),
        body("RBDY2", two, at=far),
        body("RBDY2", DISK, at=far, avrd=0.2, gyrd=0.3),
    ]
    drives = held("RBDY2", 2, (1,))
    scene = legacy.read_datbox(write(tmp_path, "".join(bodies), drives=drives))
    mass, inertia = (np.concatenate([np.ravel(getattr(s, name)) for s in scene.sets]) for name in ("mass", "inertia"))
    disk, bar = np.pi * 0.01, 4 * 2 * 0.05 + np.pi * 0.05**2
    assert mass == pytest.approx(1e3 * np.array([disk, bar, 2.0, 2 * disk, np.pi * 0.04]), rel=1e-12)
    turning = np.pi * 0.05**2 * (4 + 0.05**2 / 2) + 2 * 2 * 0.05 * (4 + 0.05**2)
    expected = [disk * 0.005, turning, 2 * 5 / 12, 2 * disk * (0.005 + 0.04), np.pi * 0.04 * 0.09]
    assert inertia == pytest.approx(1e3 * np.array(expected), rel=1e-12)
    assert scene.sets[2].position[0] == pytest.approx([1.0, 0.5])  # a node at 0 0: corners stand where they are
    sim = cn.Simulation(scene, 1e-2)
    sim.step()
    assert sim.bodies.velocity[1] == pytest.approx([0.0, -0.0981, 0.0])


def test_polygons_stand_on_their_node_by_their_centroid(tmp_path):
    """Corners off the node by less than a millimetre are rounding; further off, the node moves. coo3 is an angle."""
    square = " POLYG      1  color  BLEUx  nb_vertex=      4\n"
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)
    near, far = (square + "".join(row(*v) for v in corners + d) for d in ([5e-4, 0], [0.25, 0]))
    bodies = body("RBDY2", near, at=(10, 0, 0)) + body("RBDY2", far, at=(10, 5, 0.5))
    states = "$bdyty\n RBDY2        2\n$nodty\n NO3xx      1" + " " * 16 + row(0, 1, 0.25).lstrip() + row(0, 0, 0) + "$$$$$$\n"
    s = legacy.read_datbox(write(tmp_path, bodies, states=states)).sets[0]
    assert s.position == pytest.approx(np.array([[10, 0], [10.25, 6]])) and s.rotation == pytest.approx([0, 0.75])
    assert s.contactors[0].hulls.vertex.reshape(2, 4, 2)[0] == pytest.approx(corners)


def test_spheres_and_planes_in_3d(tmp_path):
    """Columns, not labels; the line I1 is optional; clumps have the mass of their parts, whatever avrd; localframe turns."""
    plane = contactor("PLANx", 2.0, 1.0, 0.1, label="coo", color="VERTx")
    turned = plane + " " * 29 + "localframe\n" + row(0, 0, -1) + row(0, 1, 0) + row(1, 0, 0) + row(0.5, 0, 0)
    ball = contactor("SPHER", 0.1, label="xyz")
    clump = "".join(contactor("SPHEb", 0.1, label="byr") + row(x, 0, 0) for x in (0.5, 0.7))
    bodies = [
        body("RBDY3", plane, at=(0, 0, -0.1), number=9),
        body("RBDY3", turned, at=(0, 0, 3), number=9),
        body("RBDY3", ball, at=(0, 0, 0.1)),
        body("RBDY3", ball, at=(0, 0, 0.4), avrd=0.2, moments=(9, 9, 9)),
        body("RBDY3", clump, at=(0, 0, 1), avrd=7.0),
    ]
    drives = held("RBDY3", 1, range(1, 7)) + held("RBDY3", 2, range(1, 7))
    scene = legacy.read_datbox(write(tmp_path, "".join(bodies), drives=drives))
    volume = 4 / 3 * np.pi * 1e-3
    free = scene.sets[2]
    assert free.mass == pytest.approx(1e3 * volume * np.array([1, 8, 2]), rel=1e-12)
    round_ = 0.4 * 0.01 * volume
    assert free.inertia[:2] == pytest.approx(np.full((2, 3), 1e3 * round_), rel=1e-12)
    assert sorted(free.inertia[2]) == pytest.approx(1e3 * np.sort([2 * round_] + 2 * [2 * round_ + 2 * volume * 0.01]), rel=1e-9)
    assert free.position[2] == pytest.approx([0.6, 0, 1]) and scene.sets[1].position[0] == pytest.approx([0.5, 0, 3])
    core = cn.Simulation(scene, 1e-3)
    q = core.bodies.rotation[1]
    assert np.abs(q) == pytest.approx([2**-0.5, 0, 2**-0.5, 0], abs=1e-9)


def test_slabs_are_planes_on_the_side_where_all_is_that_they_see(tmp_path):
    slab = body("RBDY3", contactor("PLANx", 2.0, 1.0, 0.1, color="VERTx"), at=(0, 0, 1))
    ball = contactor("SPHER", 0.1, label="byr")
    below, above = body("RBDY3", ball, at=(0, 0, 0.75)), body("RBDY3", ball, at=(1, 0, 1.25))
    see, drives = SEE.format("RBDY3", "SPHER", "PLANx", "VERTx"), held("RBDY3", 1, range(1, 7))
    bulk = BULK.replace("grv2=-0.9810000D+01  grv3= 0.0000000D+00", "grv2= 0.0000000D+00  grv3= 0.9810000D+01")
    sim = cn.Simulation(legacy.read_datbox(write(tmp_path, slab + below, see, drives=drives, bulk=bulk)), 1e-3)
    for _ in range(300):
        sim.step()
    assert sim.bodies.position[1, 2] == pytest.approx(0.8, abs=1e-3)  # it fell upward against the lower face
    due = r"PLANx of RBDY3 1, which has bodies .* both of its sides: give a POLYR .* \(BODIES.DAT, line 9\)"
    with pytest.raises(legacy.LegacyError, match=due):
        legacy.read_datbox(write(tmp_path, slab + below + above, see, drives=drives))


@pytest.mark.parametrize("seed", range(3))
def test_polyhedra_of_any_winding_are_turned(tmp_path, seed):
    random = np.random.default_rng(seed)
    faces = [list(random.permutation(f)) for f in SIDES]
    s = legacy.read_datbox(write(tmp_path, body("RBDY3", polyhedron(BOX, faces), at=(5, 0, 0)))).sets[0]
    assert s.mass[0] == pytest.approx(1e3) and s.position[0] == pytest.approx([5.5, 0.5, 0.5])
    assert s.inertia[0] == pytest.approx(np.full(3, 1e3 / 6))


def test_polyhedra_that_are_not_convex_come_in_convex_parts(tmp_path):
    ring = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], float)
    vertices = [[x, y, z] for z in (0, 1) for x, y in ring]
    caps = [(0, 1, 2), (0, 2, 3), (0, 3, 5), (3, 4, 5)]
    faces = [f[::-1] for f in caps] + [tuple(k + 6 for k in f) for f in caps]
    for k in range(6):
        j = (k + 1) % 6
        faces += [(k, j, j + 6), (k, j + 6, k + 6)]
    s = legacy.read_datbox(write(tmp_path, body("RBDY3", polyhedron(vertices, faces)))).sets[0]
    assert len(s.contactors[0].body) == 2 and s.mass[0] == pytest.approx(3e3)
    hole = polyhedron(BOX, SIDES[1:])
    with pytest.raises(
        legacy.LegacyError, match=r"BODIES.DAT, line 9: contactor POLYR of RBDY3 1 is no polyhedron: .* not closed"
    ):
        legacy.read_datbox(write(tmp_path, body("RBDY3", hole)))


@pytest.mark.parametrize("dent, parts", [(2e-6, 1), (0.2, 4)])
def test_what_the_digits_of_the_file_dent_is_convex(tmp_path, dent, parts):
    vertices = [*(np.array(BOX) + 10.0), [10.5, 10.5, 11.0 - dent]]
    faces = [f for f in SIDES if f not in ([4, 5, 7], [4, 7, 6])] + [[4, 5, 8], [5, 7, 8], [7, 6, 8], [6, 4, 8]]
    s = legacy.read_datbox(write(tmp_path, body("RBDY3", polyhedron(vertices, faces)))).sets[0]
    assert s.mass[0] == pytest.approx(1e3 * (1 - dent / 3), rel=1e-6)
    assert len(s.contactors[0].body) == parts


def test_axes_that_nobody_tells_are_refused(tmp_path):
    tilted = np.array(BOX) @ np.array([[1, 0.3, 0], [0, 1, 0.2], [0, 0, 2]])
    text = body("RBDY3", polyhedron(tilted, SIDES))
    axes = "$bdyty\n RBDY3        1\n$nodty\n NO6xx      1" + " " * 16 + row(0, 0, 0).lstrip() + 3 * row(0, 0, 0)
    axes += row(1, 0, 0) + row(0, 1, 0) + row(0, 0, 1) + "$$$$$$\n"
    assert legacy.read_datbox(write(tmp_path, text)).count == 1
    with pytest.raises(legacy.LegacyError, match=r"line 2: RBDY3 1 has no moments I1, I2, I3, and DOF.INI its axes"):
        legacy.read_datbox(write(tmp_path, text, states=axes))
    given = body("RBDY3", polyhedron(tilted, SIDES), moments=(1, 2, 3))
    assert legacy.read_datbox(write(tmp_path, given, states=axes)).sets[0].inertia[0] == pytest.approx([1e3, 2e3, 3e3])


def test_evolutions_are_in_free_format_and_go_on_along_their_last_piece(tmp_path):
    drives = HELD.format("RBDY2", 1, "NO3xx") + " vlocy      1 evolution push.txt\n$$$$$$\n"
    folder = write(tmp_path, body("RBDY2", DISK, at=(0, 1, 0)), drives=drives)
    (folder / "push.txt").write_text("1 , 2.0 ignored\n\n  2.5d0\t5\n 3., .60E+01\n")
    drive = legacy.read_datbox(folder).sets[0].drive
    for t, value in ((0.0, 0.0), (1.0, 2.0), (2.0, 4.0), (3.0, 6.0), (5.0, 10.0)):
        assert drive(t)[0] == pytest.approx(value)
    for text, why in (
        ("1 2\n", "holds 1 instants"),
        ("1 2\n1 3\n", "line 2: time 1 does not come after 1"),
        ("1\n2\n", "line 1: '1'"),
    ):
        (folder / "push.txt").write_text(text)
        with pytest.raises(legacy.LegacyError, match=f"push.txt.*{why}"):
            legacy.read_datbox(folder)


def test_the_first_see_table_of_a_pair_counts_and_laws_that_nobody_sees_are_no_matter(tmp_path):
    laws = LAW + LAW.replace("iqsc0", "iqsc1").replace("3000000", "6000000")
    laws += "$behav  lawty\n czm00  IQS_UNHEARD_OF                   dyfr= what\n"
    see = (
        SEE.format("RBDY2", "JONCx", "DISKx", "DOWNx")
        .replace("BLEUx", "swap_")
        .replace("DOWNx", "BLEUx")
        .replace("swap_", "DOWNx")
    )
    see += SEE.format("RBDY2", "DISKx", "JONCx", "DOWNx").replace("iqsc0", "iqsc1")
    see += SEE.format("RBDY2", "DISKx", "POLYG", "DOWNx").replace("iqsc0", "czm00")
    bodies = body("RBDY2", DISK, at=(0, 1, 0)) + body("RBDY2", BAR, at=(0, -1, 0)) + "words of another program\n"
    scene = legacy.read_datbox(write(tmp_path, bodies, see, laws, held("RBDY2", 2)))
    assert [law.values for _, _, law in scene.rules if law is not None] == [(0.3,)]
    assert any("BODIES.DAT, line 19: 1 lines outside of all bodies" in note for note in scene.legacy.notes)


def test_whatever_stands_in_a_file_it_is_read_or_refused(tmp_path):
    """Lines lost, doubled, cut and with other characters: a LegacyError that names a file, or a scene."""
    ball, plane = contactor("SPHER", 0.1, label="byr"), contactor("PLANx", 2.0, 1.0, 0.1, color="VERTx")
    bodies = body("RBDY3", plane) + body("RBDY3", ball, at=(0, 0, 1)) + body("RBDY3", polyhedron(BOX, SIDES), at=(0, 0, 3))
    see = SEE.format("RBDY3", "SPHER", "PLANx", "VERTx")
    write(tmp_path, bodies, see, drives=held("RBDY3", 1, range(1, 7)))
    files = {p.name: p.read_text().split("\n") for p in tmp_path.iterdir()}
    random = np.random.default_rng(5)
    refused = 0
    for _ in range(300):
        name = random.choice(["BODIES.DAT", "BULK_BEHAV.DAT", "TACT_BEHAV.DAT", "DRV_DOF.DAT"])
        lines = list(files[name])
        k = int(random.integers(len(lines)))
        what = random.integers(4)
        if what == 0:
            lines.pop(k)
        elif what == 1:
            lines.insert(k, lines[k])
        elif what == 2:
            lines[k] = lines[k][: int(random.integers(len(lines[k]) + 1))]
        elif lines[k]:
            at = int(random.integers(len(lines[k])))
            lines[k] = lines[k][:at] + random.choice(list("-9D$ x.#")) + lines[k][at + 1 :]
        (tmp_path / name).write_text("\n".join(lines))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                legacy.read_datbox(tmp_path)
            except legacy.LegacyError as error:
                assert str(tmp_path) in str(error) and "cannot be made a scene" not in str(error), (name, lines[k])
                refused += 1
        (tmp_path / name).write_text("\n".join(files[name]))
    assert refused > 100
