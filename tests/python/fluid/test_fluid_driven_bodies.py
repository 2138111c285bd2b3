"""Bodies that a function, a stress or a release moves within a liquid."""

import cairn as cn
import numpy as np
import pytest

STEEL = cn.Material("steel", density=2000.0)


def piston(force, strategy=None):
    """A piston of 200 kg that holds .4 m of water, after steps, and the thrust of the water."""
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.wall((0, 0), (0, 1), STEEL), cn.wall((0, 0), (1, 0), STEEL))
    one = scene.add(cn.wall((1.0, 0), (-1, 0), STEEL, mass=200.0, free="vx", force=force))[0]
    water = cn.fluid([(0, 0), (1, 0.4)], 0.04, 1000.0)
    scene.add(water)
    scene.interact("*", "*", None)
    scene.interact("fluid", "*", cn.FreeSlip())
    sim = cn.Simulation(scene, dt=2e-3, strategy=strategy)
    moved, thrust = [], []
    for _ in range(40):
        sim.step()
        moved.append(float(sim.bodies.velocity[sim.bodies.id == one][0, 0]))
        thrust.append(float(sim.fluid.force_on(one)[0]))
    return np.array(moved), np.array(thrust)


SERVO = {
    "area": lambda: cn.Servo(2000.0, (-1, 0), area=0.4),
    "table": lambda: cn.Servo(cn.Table([0, 1], [2000.0, 2000.0]), (-1, 0), area=0.4),
}


@pytest.mark.parametrize("given", SERVO)
@pytest.mark.parametrize("strategy", [None, "smooth"])
def test_a_wall_under_a_stress_feels_the_liquid(given, strategy):
    chosen = cn.SmoothDEM() if strategy else None
    moved, thrust = piston(SERVO[given](), chosen)
    by_vector, _ = piston((-800.0, 0.0), chosen)
    assert thrust.mean() > 600.0
    # The momentum of the piston is that of both forces, so that a thrust that is reported is also felt.
    assert moved[-1] == pytest.approx(np.sum((thrust - 800.0) * 2e-3) / 200.0, rel=1e-6)
    np.testing.assert_allclose(moved, by_vector, rtol=1e-9, atol=1e-12 * abs(by_vector).max())


def test_a_body_is_let_go_without_dofs_and_none_holds_nothing():
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    one = scene.add(cn.disks([[0.0, 0.0]], 0.1, STEEL, driven=("vx", "vy", "w")))
    sim = cn.Simulation(scene, dt=1e-3)
    with pytest.raises(ValueError, match=r"velocity of vy is None.*drive\(ids, \(\)\)"):
        sim.drive(one, "vy", None)
    sim.step()
    assert sim.bodies.velocity[0, 1] == 0
    sim.drive(one, ())
    sim.step()
    assert sim.bodies.velocity[0, 1] == pytest.approx(-9.81e-3)


def pool(periodic=None, bodies=(), region=((0, 0), (1, 0.4)), spacing=0.05, **rules):
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81), periodic=periodic)
    scene.add(cn.wall((0, 0), (0, 1), STEEL))
    if periodic is None:
        scene.add(cn.wall((0, 0), (1, 0), STEEL), cn.wall((1, 0), (-1, 0), STEEL))
    ids = np.concatenate([scene.add(b) for b in bodies]) if bodies else None
    scene.add(cn.fluid(region, spacing, 1000.0))
    scene.interact("*", "*", None)
    return scene, ids


def test_forces_of_several_bodies_are_asked_at_once():
    scene, ids = pool(bodies=[cn.disks([[0.3, 0.2], [0.7, 0.2]], 0.1, STEEL)])
    sim = cn.Simulation(scene, dt=1e-3)
    sim.step()
    both = sim.fluid.force_on(ids)
    assert both.shape == (2, 3) and np.all(both[:, 1] > 0)
    np.testing.assert_array_equal(both[1], sim.fluid.force_on(int(ids[1])))
    with pytest.raises(ValueError, match="no body 999"):
        sim.fluid.force_on([int(ids[0]), 999])


def block(x):
    points = np.array([(x, 0.1), (x + 0.2, 0.1), (x + 0.2, 0.3), (x, 0.3)])
    body = cn.ElasticBody(points, {"quad": [[0, 1, 2, 3]]}, young=1e7, poisson=0.3, density=900.0)
    return cn.deformable(body, STEEL, name="brick")


def test_meshes_of_one_name_are_asked_by_number_or_view():
    scene, _ = pool(bodies=[block(0.2), block(0.6)])
    sim = cn.Simulation(scene, dt=1e-3)
    sim.step()
    with pytest.raises(ValueError, match="2 deformable bodies have the name 'brick', numbers 0, 1"):
        sim.fluid.forces_on_mesh("brick")
    first, second = (sim.fluid.forces_on_mesh(k) for k in (0, 1))
    np.testing.assert_array_equal(second, sim.fluid.forces_on_mesh(sim.meshes[1]))
    assert first.sum(axis=0)[1] > 0 and second.sum(axis=0)[1] > 0 and not np.array_equal(first, second)
    for wrong in (2, -1, "stone"):
        with pytest.raises(ValueError, match="there is no deformable body"):
            sim.fluid.forces_on_mesh(wrong)


def test_a_rule_of_the_liquid_in_mid_run_is_refused_with_the_remedy():
    scene, _ = pool()
    sim = cn.Simulation(scene, dt=1e-3)
    with pytest.raises(ValueError, match="'fluid' is a liquid.*Scene.interact"):
        sim.interact("fluid", STEEL, cn.FreeSlip())
    sim.interact("*", STEEL, cn.Coulomb(mu=0.1))


def test_a_periodic_cell_shorter_than_lists_is_refused_before_the_first_step():
    scene, _ = pool(cn.Periodic((0.5, np.inf)), region=((0, 0), (0.5, 0.4)))
    with pytest.raises(ValueError, match=r"0\.5 m long along axis 0.*10\.5 spacings, 0\.525 m.*spacing=0\.0454545"):
        cn.Simulation(scene, dt=1e-3)
    scene, _ = pool(cn.Periodic((0.5, np.inf)), region=((0, 0), (0.5, 0.4)), spacing=0.5 / 11)
    cn.Simulation(scene, dt=1e-3).step()


@pytest.mark.parametrize(("length", "told"), [(1.02, "leave a gap of 0.4"), (0.98, "overlap by 0.4"), (1.0, None)])
def test_a_cell_of_no_whole_number_of_spacings_is_told(recwarn, length, told):
    scene, _ = pool(cn.Periodic((length, np.inf)), region=((0, 0), (length, 0.4)))
    cn.Simulation(scene, dt=1e-3)
    found = [str(w.message) for w in recwarn if "spacings where they meet" in str(w.message)]
    assert len(found) == (told is not None)
    assert told is None or told in found[0]


def test_an_inflow_along_the_side_of_the_liquid_is_refused():
    def channel(velocity):
        scene = cn.Scene(dim=2)
        scene.add(cn.wall((0, 0), (0, 1), STEEL), cn.wall((0, 1), (0, -1), STEEL))
        scene.add(cn.fluid([(0, 0), (1, 1)], 0.1, 1.0, viscosity=0.1, velocity=(1.0, 0.0), sound_speed=20.0))
        scene.add(cn.Inflow([(-0.4, 0), (0, 1)], velocity), cn.Outflow([(1, 0), (1.4, 1)], pressure=0.0))
        return cn.Simulation(scene, dt=0.01)

    for velocity in ((0.0, 1.0), (0.0, -1.0)):
        with pytest.raises(ValueError, match="along the side at which the liquid stands"):
            channel(velocity)
    channel((1.0, 0.0)).step()
