"""Settings without effect are refused by name: late cells, servos and forces on held bodies, runs without bodies."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2000.0)


def scene_of(dim=2, **options):
    scene = cn.Scene(dim, gravity=-9.81 * np.eye(dim)[-1], **options)
    scene.add((cn.disks if dim == 2 else cn.spheres)([np.full(dim, 0.5)], 0.1, ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    return scene


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", ["periodic", "origin"])
@pytest.mark.parametrize("staged", [False, True])
def test_a_cell_or_an_origin_is_not_set_after_the_first_step(dim, name, staged):
    value = {"periodic": cn.Periodic((1.0,) * dim), "origin": np.ones(dim)}[name]
    scene = scene_of(dim)
    setattr(scene, name, value)  # before: counts for the simulations to come
    sim = cn.Simulation(scene, 1e-3)
    if staged:
        sim.stages.begin_step()
        sim.stages.undo_step()
    sim.step()
    before = sim.bodies.position.copy()
    for given in (value, None if name == "periodic" else np.zeros(dim)):
        with pytest.raises(ValueError, match=f"{name} is set to .* after a simulation of the scene made its first step"):
            setattr(scene, name, given)
    assert np.array_equal(sim.bodies.position, before)
    sim.step()
    late = scene_of(dim)
    sim = cn.Simulation(late, 1e-3)
    setattr(late, name, value)
    with pytest.raises(ValueError, match=f"{name} of the scene was set after the simulation was made of it"):
        sim.step()
    cn.Simulation(late, 1e-3).step()


def test_a_cell_that_is_narrower_than_a_body_is_refused_when_it_is_set():
    scene = scene_of()
    with pytest.raises(ValueError, match=r"lengths\[0\] of the periodic cell is 0.1 m and body 0 is 0.2 m wide"):
        scene.periodic = cn.Periodic((0.1, 1.0))
    assert scene.periodic is None


MAKERS = {
    "wall": (2, lambda **o: cn.wall((0, 1), (0, -1), ROCK, **o)),
    "plane": (3, lambda **o: cn.wall((0, 0, 1), (0, 0, -1), ROCK, **o)),
    "segment": (2, lambda **o: cn.segment((0, 1), (1, 1), ROCK, **o)),
    "ring": (2, lambda **o: cn.ring((0, 1), 1.0, ROCK, **o)),
    "tube": (3, lambda **o: cn.tube((0, 0, 1), (1, 0, 0), 1.0, ROCK, **o)),
    "surface": (3, lambda **o: cn.surface(np.eye(3), [[0, 1, 2]], ROCK, **o)),
}


@pytest.mark.parametrize("name", MAKERS)
def test_a_servo_on_what_is_held_is_refused(name):
    dim, made = MAKERS[name]
    along, across = ("vy", "vx") if dim == 2 else ("vz", "vx")
    servo = cn.Servo(1e4, -np.eye(dim)[-1], area=1.0)
    with pytest.raises(ValueError, match=f"force is a Servo along {along}, and the body is held: give mass= and free='{along}'"):
        made(force=servo)
    with pytest.raises(ValueError, match="the body is held"):
        made(force=servo, mass=3.0)
    with pytest.raises(ValueError, match="the body is held"):
        made(force=servo, velocity=np.zeros(dim))
    with pytest.raises(ValueError, match=f"force is a Servo along {along}, and free are {across} alone"):
        made(force=servo, mass=3.0, free=across)
    with pytest.raises(ValueError, match="force is given to a body that is held: give mass= and free="):
        made(force=np.eye(dim)[0])
    assert made(force=servo, mass=3.0, free=along).force is servo
    with pytest.raises(ValueError, match="the body is held"):
        made(force=servo, mass=3.0, free=along).with_(driven=tuple(cn.model.bodies.DOFS[dim]))


def test_a_servo_on_a_body_that_is_held_is_refused():
    servo = cn.Servo(1e4, (0, 0, -1))
    with pytest.raises(ValueError, match="force is a Servo along vz, and the body is held"):
        cn.boxes([[0, 0, 0]], (1, 1, 1), ROCK, fixed=True, force=servo)
    assert cn.boxes([[0, 0, 0]], (1, 1, 1), ROCK, force=servo).force is servo


def test_a_run_of_no_bodies_is_refused():
    scene = cn.Scene(2)
    sim = cn.Simulation(scene, 1e-3)
    with pytest.raises(ValueError, match="the scene has no bodies: give it some"):
        sim.run(steps=3, progress=False)
    sim.add(cn.disks([[0, 0]], 0.1, ROCK))
    assert sim.run(steps=3, progress=False) == 3
    filled = cn.Simulation(cn.Scene(2), 1e-3)  # the callback adds the first body
    filled.run(
        steps=2, progress=False, callback=lambda s: None if len(s.bodies) else s.add(cn.disks([[0, 0]], 0.1, ROCK)) is None
    )
