"""Motions of supports end where they should; records read as they were written; loads have their resultants."""

import cairn as cn
import numpy as np
import pytest
from cairn.post.masonry import Structure
from cairn.pre import loads, masonry


def integral(table, n=20001):
    t = np.unique(np.concatenate([table.times, np.linspace(table.times[0], table.times[-1], n)]))
    v = np.array([table(x) for x in t])
    return np.sum(np.diff(t)[:, None] * (v[1:] + v[:-1]) / 2, axis=0)


@pytest.mark.parametrize("ramp", [0.1, 0.25, 0.5])
def test_displaced(ramp):
    table = loads.displaced((0.3, -0.2), 4.0, start=1.0, ramp=ramp)
    np.testing.assert_allclose(integral(table), (0.3, -0.2), rtol=1e-12)
    assert not np.any(table(0.5)) and not np.any(table(5.1))


def test_tilted_ends_at_the_angle():
    angle, pivot, center = 0.2, np.array([1.0, 0.0]), np.array([3.0, 0.5])
    table = loads.tilted(center, pivot, angle, 2.0)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = integral(table)
    np.testing.assert_allclose(center + moved[:2], pivot + turn @ (center - pivot), atol=1e-5)
    assert moved[2] == pytest.approx(angle)
    deep = loads.tilted((3.0, 7.0, 0.5), (1.0, 0.0, 0.0), angle, 2.0, axis=(0, -2.0, 0))
    moved3 = integral(deep)
    np.testing.assert_allclose(moved3, [moved[0], 0, moved[1], 0, -angle, 0], atol=1e-12)


def record(n=400, step=0.01):
    t = np.arange(n) * step
    return t, np.sin(7 * t) * np.exp(-t)


def test_at2(tmp_path):
    t, a = record()
    path = tmp_path / "quake.AT2"
    rows = "\n".join("".join(f"{x:15.7E}" for x in a[k : k + 5]) for k in range(0, len(a), 5))
    title = "PEER NGA STRONG MOTION DATABASE RECORD\nSOMEWHERE, 1/1/1980\nACCELERATION TIME SERIES IN UNITS OF G\n"
    path.write_text(f"{title}NPTS=  {len(a)}, DT=   .0100 SEC,\n{rows}\n")
    read = loads.read_accelerogram(path)
    np.testing.assert_allclose(read.acceleration, 9.80665 * a, atol=1e-6)
    np.testing.assert_allclose(read.times, t, atol=1e-12)
    path.write_text(f"{title}{len(a)}   0.0100  NPTS, DT\n{rows}\n")
    np.testing.assert_allclose(loads.read_accelerogram(path).times, t, atol=1e-12)
    path.write_text(f"{title}NPTS=  {len(a) + 3}, DT=   .0100 SEC\n{rows}\n")
    with pytest.raises(ValueError, match="says NPTS = 403 and holds 400"):
        loads.read_accelerogram(path)
    path.write_text("nothing\n")
    with pytest.raises(ValueError, match="no PEER record"):
        loads.read_accelerogram(path)


@pytest.mark.parametrize(
    "title, step, unit",
    [
        ("ACCELERATION TIME SERIES IN UNITS OF G", "DT=   .0100 SEC", 9.80665),
        ("ACCELERATION TIME SERIES IN UNITS OF G", "DT=   1.000E-02 SEC", 9.80665),
        ("ACCELERATION TIME SERIES IN UNITS OF CM/S**2", "DT= .01", 0.01),
        ("ACCELERATION TIME SERIES IN UNITS OF CM/SEC/SEC", "DT= 1E-2", 0.01),
        ("ACCELERATION TIME SERIES IN UNITS OF M/S2", "DT= .1D-01", 1.0),
        ("ACCELERATION TIME SERIES IN UNITS OF GAL", "DT= .01", 0.01),
    ],
)
def test_units_and_steps_of_at2(tmp_path, title, step, unit):
    """A step of 1.0E-02 s was read as one of 1 s, centimetres as g."""
    path = tmp_path / "quake.at2"
    path.write_text(f"PEER\nSOMEWHERE\n{title}\nNPTS=  3, {step}\n 1.0 -.2E+01 3\n")
    read = loads.read_accelerogram(path)
    np.testing.assert_allclose(read.times, [0, 0.01, 0.02], rtol=1e-15)
    np.testing.assert_allclose(read.acceleration, unit * np.array([1.0, -2.0, 3.0]), rtol=1e-15)


def test_records_of_something_else(tmp_path):
    path = tmp_path / "quake.at2"
    text = "PEER\nSOMEWHERE\nVELOCITY TIME SERIES IN UNITS OF CM/S\nNPTS=  3, DT= .01\n 1 2 3\n"
    path.write_text(text)
    with pytest.raises(ValueError, match="quake.at2 holds a velocity"):
        loads.read_accelerogram(path)
    path.write_text(text.replace("VELOCITY", "ACCELERATION").replace("CM/S", "FURLONGS"))
    with pytest.raises(ValueError, match="units of FURLONGS.*give unit="):
        loads.read_accelerogram(path)
    assert loads.read_accelerogram(path, unit=201.168).peak == pytest.approx(3 * 201.168)
    path.write_text(text.replace("DT= .01", "DT= 0.0").replace("VELOCITY", "ACCELERATION"))
    with pytest.raises(ValueError, match="line 4.*gives no step of time"):
        loads.read_accelerogram(path)
    with pytest.raises(ValueError, match="give one of non-zero length"):
        loads.Accelerogram(np.arange(3.0), np.ones(3)).drive((0, 0, 0))


def test_csv_of_spreadsheets(tmp_path):
    path = tmp_path / "quake.csv"
    path.write_text("Zeit;a [g]\n0,00;0,0\n0,01;-0,5\n")
    read = loads.read_accelerogram(path)
    np.testing.assert_allclose(read.times, [0, 0.01])
    np.testing.assert_allclose(read.acceleration, [0, -0.5 * 9.80665])
    path.write_text("0,0\n1,nan\n2,0\n")
    with pytest.raises(ValueError, match="quake.csv: .*nan"):
        loads.read_accelerogram(path)
    path.write_text("")
    with pytest.raises(ValueError, match="quake.csv has no row of numbers"):
        loads.read_accelerogram(path)


def test_questions_before_the_first_step_and_without_gravity():
    b = masonry.arch(span=4, thickness=0.5, voussoirs=7)
    scene = cn.Scene(2)
    ids = b.add_to(scene, cn.Material("stone", density=2000.0))
    scene.interact("*", "*", cn.Coulomb(mu=0.6))
    s = Structure(b, cn.Simulation(scene, dt=1e-3), ids)
    for _ in range(2):
        assert len(s.resultants().hinges()) == 0 and np.isnan(s.thrust_line([7, 0, 1])).all()
        found = s.balance()
        assert found["reaction_error"] == found["unbalanced"] == 0.0
        s.simulation.step()
    with pytest.raises(ValueError, match=r"ids\[0\] is 100: the simulation has no such body"):
        Structure(b, s.simulation, ids + 100)


def test_balance_counts_what_is_applied():
    b = masonry.panel(1, 3, bond="stack")
    sets, rows = b.sets(cn.Material("stone", density=2400.0))
    force = np.zeros((3, 3))
    force[2] = loads.point_load((2e3, -1e4), (0.5, 3.0), sets[0].position[2])
    for given in (force, lambda t: force):
        scene = cn.Scene(2, gravity=(0, -9.81))
        ids = scene.add(sets[0].with_(force=given), *sets[1:])[rows]
        scene.interact("*", "*", cn.Coulomb(mu=0.5))
        s = Structure(b, cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-10))), ids)
        for _ in range(3):
            s.simulation.step()
        found = s.balance()
        np.testing.assert_allclose(found["applied"], [2e3, -1e4])
        assert found["reaction_error"] < 1e-8 and found["unbalanced"] < 1e-8


def test_csv(tmp_path):
    t, a = record()
    path = tmp_path / "quake.csv"
    path.write_text("time,acceleration\n" + "".join(f"{x!r},{y!r}\n" for x, y in zip(t.tolist(), a.tolist())))
    read = loads.read_accelerogram(path, unit=9.81)
    assert np.array_equal(read.times, t) and np.array_equal(read.acceleration, a * 9.81)
    path.write_text("".join(f"{y!r}\n" for y in a.tolist()))
    assert np.array_equal(loads.read_accelerogram(path, step=0.01).acceleration, a)
    with pytest.raises(ValueError, match="rows of 1 numbers"):
        loads.read_accelerogram(path)
    path.write_text("0, 1\n1, nought\n")
    with pytest.raises(ValueError, match="quake.csv, line 2"):
        loads.read_accelerogram(path)


def test_velocity_of_a_record():
    t = np.linspace(0, 2 * np.pi, 2001)
    quake = loads.Accelerogram(t, np.cos(t))
    np.testing.assert_allclose(quake.velocity(corrected=False), np.sin(t), atol=1e-6)
    drifting = loads.Accelerogram(t, np.cos(t) + 0.1)
    np.testing.assert_allclose(drifting.velocity(), np.sin(t), atol=1e-6)
    assert quake.scaled(peak=3.0).peak == pytest.approx(3)
    drive = quake.drive((0.0, 2.0, 0.0))
    np.testing.assert_allclose(drive(np.pi / 2), [0, 2, 0, 0, 0, 0], atol=1e-5)


def test_loads():
    np.testing.assert_allclose(loads.point_load((0, -2), (3, 1), (1, 1)), [0, -2, -4])
    np.testing.assert_allclose(loads.point_load((0, 0, -2), (3, 1, 0), (1, 1, 0)), [0, 0, -2, 0, 4, 0])
    wall = masonry.wall(2.2, 3, (0.22, 0.11, 0.055))
    top = loads.distributed_load(wall, (0, 0, -1000.0), (0, 0, 1))
    free = ~wall.mask("support")
    assert top[free, 2].sum() == pytest.approx(-1000 * 2.2 * 0.11)
    upper = np.array([v[:, 2].max() > 0.16 for v in wall.vertices])
    np.testing.assert_allclose(top[free & ~upper], 0, atol=1e-9)
    flat = loads.distributed_load(masonry.panel(4, 3), (0, -5.0), (0, 1), depth=2.0)
    assert flat[:-1, 1].sum() == pytest.approx(-5 * 4 * 2)
    for name, call in (("ramp", lambda: loads.displaced((1,), 1, ramp=0.7)), ("axis", lambda: loads.tilted(
            (0, 0, 1), (0, 0, 0), 0.1, 1))):
        with pytest.raises(ValueError, match=name):
            call()


def test_loads_on_faces_that_a_file_rounded():
    """Faces turned by 1e-5, as an import leaves them, carry the whole load where `flush` says so; and none is told."""
    b = masonry.wall(0.44, 3, bond="stack")
    whole = loads.distributed_load(b, (0, 0, -1e3), (0, 0, 1))
    turn = np.array([[1, 0, 1e-5], [0, 1, 0], [-1e-5, 0, 1]])
    leaning = b.moved(rotation=turn)
    with pytest.raises(ValueError, match="no face looks along facing.*1e-05 rad"):
        loads.distributed_load(leaning, (0, 0, -1e3), (0, 0, 1))
    leaning.flush = 1e-5
    np.testing.assert_allclose(loads.distributed_load(leaning, (0, 0, -1e3), (0, 0, 1))[:, 2], whole[:, 2], rtol=1e-4, atol=1e-9)
    with pytest.raises(ValueError, match="facing is .* non-zero length"):
        loads.distributed_load(b, (0, 0, -1e3), (0, 0, 0))
