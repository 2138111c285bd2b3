"""Servo walls, drives and probes that the core evaluates: expressions, tables, the area of a wall, numbers of a run."""

import math
import warnings

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2600.0)


@pytest.mark.parametrize(
    ("text", "t", "value"),
    [
        ("1e4*min(t/0.1, 1)", 0.05, 5e3),
        ("-2^2 + 3**2*t", 2.0, 14.0),
        ("2^-1", 0.0, 0.5),
        ("(1 - 2)*-3 / 4 - 1", 0.0, -0.25),
        ("2 - 3 - 4", 0.0, -5.0),
        ("sin(pi*t) + cos(0) + e", 0.5, 2 + math.e),
        ("where(t - 1, 2, 3)", 1.0, 3.0),
        ("clip(5*t, -1, 1)", 0.1, 0.5),
        ("table(t, 0, 1, 2, -3, 4, 7)", 3.0, 2.0),
        ("table(t, 0, 1, 2, -3)", 9.0, -3.0),
        ("mod(t, 0.3) + floor(-0.5) + sign(-2) + atan2(0, 1)", 0.7, 0.7 - 0.6 - 2),
        (" exp( log ( 2 ) ) ", 0.0, 2.0),
    ],
)
def test_expressions_give_what_they_say(text, t, value):
    assert cn.Expression(text)(t) == pytest.approx(value, rel=1e-14, abs=1e-14)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "its end"),
        ("2*", "its end"),
        ("2*x", "'x' at character 3"),
        ("sin(t", r"where '\)' is due"),
        ("min(t)", "where ',' is due"),
        ("1 + (2", "is due"),
        ("3 4", "an operator or the end"),
        ("table(t)", "a row of the table"),
        ("table(t, 1, 2, 1, 3)", "a table rises"),
        ("1e999", "a number"),
        ("__import__('os')", "at character 1"),
        ("(" * 500 + "1" + ")" * 500, "shorter"),
    ],
)
def test_texts_that_are_no_expression_are_told_with_their_place(text, told):
    with pytest.raises(ValueError, match=told):
        cn.Expression(text)


def pushed(dim, **drive):
    scene = cn.Scene(dim=dim)
    scene.add((cn.disks if dim == 2 else cn.spheres)([[0.0] * dim], 0.1, ROCK, driven=("vx",), **drive))
    return cn.Simulation(scene, dt=1e-2)


@pytest.mark.parametrize("dim", [2, 3])
def test_drives_of_the_core_are_those_of_python(dim):
    zeros = [0.0] * (dim - 1)
    table = cn.Table([0.0, 0.03, 0.2], [[0.0, *zeros], [1.3, *zeros], [-0.4, *zeros]])
    harmonic = cn.Harmonic((0.7, *zeros), 3.0, mean=(0.1, *zeros), phase=0.2)
    for of in (table, harmonic):
        sims = [pushed(dim, drive=of), pushed(dim, drive=lambda t, of=of: of(t))]
        for sim in sims:
            for _ in range(30):
                sim.step()
        close = np.array_equal if of is table else np.allclose
        assert close(sims[0].bodies.position, sims[1].bodies.position) and sims[0].bodies.position[0, 0] != 0
    sim = pushed(dim, drive=cn.Expression("0.5*t"))
    for _ in range(10):
        sim.step()
    assert sim.bodies.velocity[0, 0] == pytest.approx(0.05)
    sim.drive([0], "vx", cn.Table([0.0, 1.0], [2.0, 2.0]))
    sim.step()
    assert sim.bodies.velocity[0, 0] == 2.0
    sim.drive([0], "vx", 3.0)
    sim.step()
    assert sim.bodies.velocity[0, 0] == 3.0
    sim.drive([0], (), None)
    sim.bodies.set(velocity=np.zeros((1, 3 if dim == 2 else 6)))
    sim.step()
    assert sim.bodies.velocity[0, 0] == 0.0


def box(dim, area, stress=1e3):
    """Grains between a floor, side walls and a lid under a stress; ids of the right wall and of the lid."""
    rng = np.random.default_rng(0)
    place = np.stack(np.meshgrid(*[np.arange(3)] * dim, indexing="ij"), -1).reshape(-1, dim)
    scene = cn.Scene(dim=dim, depth=2.0 if dim == 2 else 1.0)
    scene.add((cn.disks if dim == 2 else cn.spheres)((place + 0.5) * 0.02 + rng.uniform(0, 1e-4, place.shape), 0.0095, ROCK))
    axes = np.eye(dim)
    walls = []
    for k in range(dim):
        scene.add(cn.wall(np.zeros(dim), axes[k], ROCK))
        moving = {"velocity": tuple(-0.02 * axes[k])} if k == 0 else {}
        if k == dim - 1:
            servo = cn.Servo(stress, -axes[k], area=area)
            moving = {"mass": 2.0, "free": "vy" if dim == 2 else "vz", "force": servo}
        walls.append(scene.add(cn.wall(0.0602 * axes[k], -axes[k], ROCK, **moving))[0])
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=1e-3, overlap="ignore")
    return sim, walls[0], walls[-1]


@pytest.mark.parametrize("area", [None, 0.01, "walls"])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_servo_of_the_core_is_that_of_python(dim, area):
    stress = cn.Table([0.0, 0.02], [500.0, 1500.0])
    (a, *_), (b, *_) = box(dim, area, stress), box(dim, area, lambda t: stress(t))
    for sim in (a, b):
        for _ in range(40):
            sim.step()
    assert np.array_equal(a.bodies.position, b.bodies.position)
    assert np.array_equal(a.bodies.force, b.bodies.force) and np.abs(a.bodies.force).max() > 0


@pytest.mark.parametrize("dim", [2, 3])
def test_the_area_between_walls_follows_them(dim):
    sim, right, lid = box(dim, "walls")
    for _ in range(50):
        sim.step()
    sim.step()
    begin = sim.bodies.position[right, 0] + 0.02 * sim.dt  # as the step began
    due = 1e3 * begin * (2.0 if dim == 2 else 0.0602)
    assert -sim.bodies.force[lid, dim - 1] == pytest.approx(due, rel=1e-9) and begin < 0.0595


def test_an_area_between_walls_needs_walls():
    scene = cn.Scene(dim=2)
    scene.add(cn.disks([[0.0, 0.1]], 0.1, ROCK), cn.wall((0, 0), (0, 1), ROCK))
    scene.add(cn.wall((0, 0.2), (0, -1), ROCK, mass=1.0, free="vy", force=cn.Servo(1e3, (0, -1), area="walls")))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    with pytest.raises(ValueError, match="no two planes face each other"):
        cn.Simulation(scene, dt=1e-3)
    with pytest.raises(ValueError, match="'walls', a function of the simulation"):
        cn.Servo(1e3, (0, -1), area="floor")


@pytest.mark.parametrize("everybody", [False, True])
@pytest.mark.parametrize("dim", [2, 3])
def test_contact_forces_of_few_bodies_and_of_all(dim, everybody, tmp_path):
    """Forces are added up for the bodies that some probe names, or for all, as soon as one names none."""
    sim, _, lid = box(dim, None, stress=1e5)
    axis = "xyz"[dim - 1]
    probes = {f"of {k}": cn.Probe(f"contact_force.{axis}", of=[k]) for k in (0, lid)}
    probes["both"] = cn.Probe(f"contact_force.{axis}", of=[0, lid], take="sum")
    if everybody:
        probes["least"] = cn.Probe(f"contact_force.{axis}", take="min")
    found = []

    def add_up(s):
        total = np.zeros(len(s.bodies.id))
        for sign, side in ((1, 0), (-1, 1)):
            np.add.at(total, np.searchsorted(s.bodies.id, s.contacts.bodies[:, side]), sign * s.contacts.force[:, dim - 1])
        found.append(total)

    sim.run(steps=20, output=tmp_path / "probes.vtkhdf", every=20, probes=probes, callback=add_up, progress=False)
    history = cn.load(tmp_path / "probes.vtkhdf").history
    found = np.array(found)
    close = {"rtol": 1e-12, "atol": 1e-12 * np.abs(found).max()}
    assert np.abs(found).max() > 0
    np.testing.assert_allclose(history["of 0"], found[:, 0], **close)
    np.testing.assert_allclose(history[f"of {lid}"], found[:, lid], **close)
    np.testing.assert_allclose(history["both"], found[:, 0] + found[:, lid], **close)
    if everybody:
        np.testing.assert_allclose(history["least"], found.min(axis=1), **close)


@pytest.mark.parametrize("dim", [2, 3])
def test_probes_of_the_core_read_what_python_reads(dim, tmp_path):
    sim, _, lid = box(dim, None, stress=1e5)
    axis = "xyz"[dim - 1]
    grains = np.arange(3**dim)
    probes = {
        "height": cn.Probe(f"position.{axis}", of=lid),
        "fastest": cn.Probe("velocity.x", of=grains, take="max", every=3),
        "all": cn.Probe("mass", take="sum", of=grains),
        "load": cn.Probe(f"contact_force.{axis}", of=[lid], every=5),
        "kinetic": cn.Probe("energy.kinetic"),
        "sweeps": cn.Probe("report.iterations"),
        "height_too": lambda s: s.bodies.position[lid, dim - 1],
        "seldom": cn.Probe(lambda s: s.bodies.velocity[grains, 0].max(), every=3),
    }
    loads = []

    def load(s):
        pair, force = s.contacts.bodies, s.contacts.force
        loads.append(np.sum(force[pair[:, 0] == lid], axis=0) - np.sum(force[pair[:, 1] == lid], axis=0))

    sim.run(steps=20, output=tmp_path / "probes.vtkhdf", every=20, probes=probes, callback=load, progress=False)
    history = cn.load(tmp_path / "probes.vtkhdf").history
    assert np.array_equal(history["height"], history["height_too"])
    assert np.array_equal(history["fastest"], history["seldom"], equal_nan=True)
    due = (np.arange(1, 21) % 3) == 0
    assert np.array_equal(np.isfinite(history["fastest"]), due)
    assert np.allclose(history["all"], sim.bodies.mass[grains].sum(), rtol=1e-14)
    assert np.array_equal(history["kinetic"], history["energy_kinetic"])
    assert np.array_equal(history["sweeps"], history["iterations"])
    told = np.array(loads)[4::5, dim - 1]
    assert np.allclose(history["load"][4::5], told, rtol=1e-12) and np.isnan(history["load"][3]) and np.abs(told).max() > 0


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"quantity": "position"}, r"position\.x, \.y or \.w"),
        ({"quantity": "colour.x"}, "a field of bodies: "),
        ({"quantity": "energy.heat"}, "one of kinetic"),
        ({"quantity": "stress.xx"}, "not periodic"),
        ({"quantity": "velocity.x", "take": "middle"}, "mean, sum, min or max"),
        ({"quantity": "velocity.x", "of": [77]}, "77"),
    ],
)
def test_what_no_probe_reads_is_told_as_the_run_begins(given, told, tmp_path):
    sim, *_ = box(2, None)
    with pytest.raises(ValueError, match=told):
        sim.run(steps=1, probes={"x": cn.Probe(**given)}, output=tmp_path / "run.vtkhdf", progress=False)


def test_a_drive_that_drives_nothing_is_told():
    with pytest.warns(UserWarning, match="dofs are all free"):
        cn.disks([[0.0, 0.0]], 0.1, ROCK, drive=(1.0, 0.0, 0.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cn.disks([[0.0, 0.0]], 0.1, ROCK, driven="vx", drive=(1.0, 0.0, 0.0))
        cn.wall((0, 0), (0, 1), ROCK, velocity=(1.0, 0.0, 0.0))


@pytest.mark.parametrize("dim", [2, 3])
def test_overlap_of_a_sliver_is_over_its_reach(dim):
    # the width of a sliver is rounding: an overlap of a thousandth of its length is no 1e13 of its size
    thin = 1e-12 if dim == 2 else 4e-8  # hulls in space have a least thickness
    if dim == 2:
        sliver = cn.polygons([[(-0.1, 0.0), (0.1, 0.0), (0.0, thin)]], ROCK, position=[[0.0, -1e-4]])
    else:
        corners = np.array([(-0.1, -0.1, 0.0), (0.1, -0.1, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, thin)])
        faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
        sliver = cn.polyhedra([(corners, faces)], ROCK, position=[[0.0, 0.0, -1e-4]])
    scene = cn.Scene(dim=dim)
    scene.add(sliver, cn.wall((0.0,) * dim, (0.0,) * (dim - 1) + (1.0,), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        sim = cn.Simulation(scene, dt=1e-4)
        sim.step()
    assert 1e-4 < sim.info["penetration"] < 10
    assert not any("e+" in str(w.message) for w in told)
