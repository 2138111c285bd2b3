"""Driven bodies whose velocity is given without drive: they go on at it, as walls do."""

import cairn as cn
import numpy as np
import pytest

rock = cn.Material("rock", density=2600.0)
SQUARE = np.array([(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)])
PLANE, SPACE = ("vx", "vy", "w"), ("vx", "vy", "vz", "wx", "wy", "wz")
SHAPES = {
    "disks": (2, lambda **k: cn.disks([[0, 0]], 0.25, rock, **k)),
    "polygons": (2, lambda **k: cn.polygons([SQUARE], rock, **k)),
    "spheres": (3, lambda **k: cn.spheres([[0, 0, 0]], 0.25, rock, **k)),
    "boxes": (3, lambda **k: cn.boxes([[0, 0, 0]], (1, 1, 1), rock, **k)),
    "capsules": (3, lambda **k: cn.capsules([[0, 0, 0]], 0.1, 0.5, rock, **k)),
    "cylinders": (3, lambda **k: cn.cylinders([[0, 0, 0]], 0.1, 0.5, rock, **k)),
    "superquadrics": (3, lambda **k: cn.superquadrics([[0, 0, 0]], [(0.1, 0.2, 0.3)], [(0.5, 0.5)], rock, **k)),
}


def moved(sets, dim, steps=100, **options):
    scene = cn.Scene(dim=dim, gravity=(0.0,) * (dim - 1) + (-9.81,))
    body = scene.add(sets)[0]
    scene.interact("*", "*", None)
    sim = cn.Simulation(scene, dt=1e-2, **options)
    begin = np.array(sim.bodies.position[body])
    sim.run(steps=steps, progress=False)
    return sim.bodies.position[body] - begin, sim.bodies.velocity[body]


@pytest.mark.parametrize("shape", SHAPES)
def test_a_driven_body_keeps_the_velocity_that_is_given_alone(shape):
    dim, make = SHAPES[shape]
    dofs = PLANE if dim == 2 else SPACE
    given = (1.0, *[0.0] * (len(dofs) - 1))
    way, velocity = moved(make(driven=dofs, velocity=given), dim)
    assert np.array_equal(velocity, given) and way == pytest.approx([1.0, *[0.0] * (dim - 1)], abs=1e-12)
    same, _ = moved(make(driven=dofs, velocity=given, drive=given), dim)
    assert np.array_equal(way, same)


@pytest.mark.parametrize("strategy", [cn.NSCD(), cn.SmoothDEM()])
def test_only_driven_dofs_keep_it(strategy):
    way, velocity = moved(cn.disks([[0, 0]], 0.25, rock, driven="vx", velocity=(1.0, 0.5, 2.0)), 2, strategy=strategy)
    assert velocity[0] == 1.0 and way[0] == pytest.approx(1.0)
    assert velocity[1:] == pytest.approx([0.5 - 9.81, 2.0])


def test_drive_precedes_velocity():
    """A drive of 0 stops a body as before; without both a driven body stands."""
    way, velocity = moved(cn.disks([[0, 0]], 0.25, rock, driven=PLANE, velocity=(1.0, 0, 0), drive=(0, 0, 0)), 2)
    assert not np.any(velocity) and not np.any(way)
    assert not np.any(moved(cn.disks([[0, 0]], 0.25, rock, driven=PLANE), 2)[0])


def test_bodies_added_in_a_run_keep_it_over_a_restart(tmp_path):
    def start():
        scene = cn.Scene(dim=2)
        scene.add(cn.disks([[5, 0]], 0.25, rock))
        scene.interact("*", "*", None)
        return cn.Simulation(scene, dt=1e-2)

    sim = start()
    sim.add(cn.disks([[0, 0]], 0.25, rock, driven=PLANE, velocity=(1.0, 0, 0)))
    sim.run(steps=5, progress=False)
    sim.checkpoint(tmp_path / "a.ckpt")
    again = start()
    again.restore(tmp_path / "a.ckpt")
    for one in (sim, again):
        one.add(cn.disks([[-5, 0]], 0.25, rock))  # whereupon all drives are gathered anew
        one.run(steps=5, progress=False)
    assert sim.bodies.position[1, 0] == pytest.approx(0.1) and np.array_equal(sim.bodies.position, again.bodies.position)


def test_fixed_bodies_take_no_velocity():
    with pytest.raises(ValueError, match="velocity is given to bodies that are fixed: give driven="):
        cn.polygons([SQUARE], rock, fixed=True, velocity=(1.0, 0.0, 0.0))
    cn.polygons([SQUARE], rock, fixed=True, velocity=(0.0, 0.0, 0.0))
