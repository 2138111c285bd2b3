"""Mistakes in what drives a scene: servo walls, periodic cells, bodies that are added, and their answers."""

import warnings

import cairn as cn
import numpy as np
import pytest
from cairn.run.first_overlaps import TAKEN_BACK

ROCK = cn.Material("rock", density=2600.0)
PLACES = (np.indices((3, 3)).reshape(2, -1).T + 0.5) * 0.02


def pressed(stress, law, normal=(0, -1)):
    scene = cn.Scene(2)
    scene.add(cn.disks([[0, 0.5]], [0.5], ROCK), cn.wall((0, 0), (0, 1), ROCK))
    scene.add(cn.wall((0, 1), (0, -1), ROCK, mass=1.0, free="vy", force=cn.Servo(stress, normal, area=1.0)))
    scene.interact(ROCK, ROCK, law)
    return cn.Simulation(scene, 1e-3)


def cell(law, **drive):
    scene = cn.Scene(2, periodic=cn.Periodic((0.06, 0.06), **drive))
    scene.add(cn.disks(PLACES, 0.009, ROCK))
    scene.interact(ROCK, ROCK, law)
    return cn.Simulation(scene, 1e-4)


def told(call, of=cn.SceneWarning):
    """Texts of the warnings of a kind that a call gives."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    return [str(w.message) for w in caught if issubclass(w.category, of)]


def test_a_servo_that_opposes_its_wall_is_refused():
    words = r"normal of the Servo is \[0.0, 1.0\], against that of the wall, \[0.0, -1.0\].*give Servo"
    with pytest.raises(ValueError, match=words):
        pressed(1e3, cn.Coulomb(mu=0.3), normal=(0, 1))
    assert not told(lambda: pressed(1e3, cn.Coulomb(mu=0.3)))


def test_a_normal_of_another_dimension_is_refused():
    words = r"Servo with a normal of 3 components, and the bodies are in 2D: give its normal \(2,\)"
    with pytest.raises(ValueError, match=words):
        pressed(1e3, cn.Coulomb(mu=0.3), normal=(0, 0, -1))


def test_a_servo_that_pulls_is_told_where_nothing_holds():
    texts = told(lambda: pressed(-1e3, cn.Coulomb(mu=0.3)))
    assert len(texts) == 1 and "stress of the Servo of body 2 is -1000 Pa" in texts[0] and "give 1000" in texts[0]
    assert not told(lambda: pressed(-1e3, cn.MohrCoulomb(tension=1e5, cohesion=1e5, friction=0.5)))


@pytest.mark.parametrize("stress", [-1e3, {"xx": 1e3, "yy": -1e3}])
def test_a_cell_under_tension_is_told_where_nothing_holds(stress):
    texts = told(lambda: cell(cn.Coulomb(mu=0.3), stress=stress))
    assert len(texts) == 1 and "compression is positive, give 1000" in texts[0]
    assert not told(lambda: cell(cn.MohrCoulomb(tension=1e5, cohesion=1e5, friction=0.5), stress=stress))
    assert not told(lambda: cell(cn.Coulomb(mu=0.3), stress={"xx": 1e3, "xy": -1e3}))  # shear has no sign that fails
    sim = cell(cn.Coulomb(mu=0.3), stress=1e3)
    assert len(told(lambda: sim.drive_cell(stress=stress))) == 1


def added(place, **options):
    """Texts of the OverlapWarnings of five steps after a disk was added to one on a floor."""
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(cn.disks([[0, 0.5]], [0.5], ROCK), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3, **options)
    sim.run(3, progress=False)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        sim.add(cn.disks([place], [0.4], ROCK))
        sim.run(5, progress=False)
    return [str(w.message) for w in caught if issubclass(w.category, cn.OverlapWarning)]


def test_a_body_added_into_another_is_told_with_both_ids():
    texts = added((0, 0.6))
    assert len(texts) == 1 and "added before step 4" in texts[0] and "bodies 0 and 2 by 2 of a radius" in texts[0]
    assert len(added((0, -0.1))) == 1  # into the floor
    assert len(added((0, 1.38))) == 1 and not added((0, 1.399)) and not added((0, 1.38), overlap_share=0.06)
    assert not [text for text in added((0, 1.38), overlap="ignore") if "added" in text]
    over = added((0, 0.6), ranks=2)
    assert len(over) == 1 and over[0] == texts[0].replace(TAKEN_BACK[None], TAKEN_BACK["colour"])


def test_a_body_that_was_added_before_a_restored_step_is_told_once(tmp_path):
    """It stands in the state that is restored, so that nothing was added since."""
    def simulation():
        scene = cn.Scene(2)
        scene.add(cn.disks([[0.0, 0.5]], [0.4], ROCK), cn.wall((0, 0), (0, 1), ROCK))
        scene.interact("*", "*", cn.Coulomb(mu=0.3))
        sim = cn.Simulation(scene, 1e-3)
        sim.add(cn.disks([(0.0, 0.6)], [0.4], ROCK))
        return sim

    first = simulation()
    assert len(told(first.step, cn.OverlapWarning)) == 1
    first.checkpoint(tmp_path / "a.checkpoint.h5")
    again = simulation()
    again.restore(tmp_path / "a.checkpoint.h5")
    assert not [text for text in told(again.step, cn.OverlapWarning) if "added before" in text]


def test_parallel_bonds_between_faces_are_told():
    bond = cn.ParallelBond(normal_stiffness=1e10, tangential_stiffness=1e10, tension=2e5)

    def simulation(other, law, among=None):
        scene = cn.Scene(3)
        scene.add(cn.boxes([[0, 0, 0.05]], (0.2, 0.2, 0.1), ROCK, fixed=True), other)
        scene.interact("*", "*", law)
        if among is not None:
            scene.interact("rock", "rock", among)
        return cn.Simulation(scene, 1e-4)

    box = cn.boxes([[0, 0, 0.15]], (0.2, 0.2, 0.1), ROCK)
    ball = cn.spheres([[0, 0, 0.15]], 0.05, cn.Material("ball", density=1e3))
    texts = told(lambda: simulation(box, bond))
    assert len(texts) == 1 and "circumscribed balls" in texts[0] and "cn.MohrCoulomb" in texts[0]
    assert not told(lambda: simulation(box, bond, among=cn.Coulomb(mu=0.5)))  # bonds of others alone
    assert not told(lambda: simulation(ball, bond, among=cn.Coulomb(mu=0.5)))
    assert not told(lambda: simulation(box, cn.MohrCoulomb(tension=1e5, cohesion=1e5, friction=0.5)))


def test_advice_over_ranks_can_be_followed_there():
    """Ranks refuse other solvers, accuracy= and project_positions, which warnings so name for runs without ranks alone."""
    texts = {}
    for ranks in (None, 2):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            scene = cn.Scene(2, gravity=(0.0, -9.81))
            scene.add(cn.disks([[0, 0.5], [0, 1.4]], 0.5, ROCK), cn.disks([[0, 2.4]], 0.5, ROCK, density=1e6))
            scene.add(cn.wall((0, 0), (0, 1), ROCK))
            scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
            sim = cn.Simulation(scene, 1e-3, ranks=ranks)
            info = {**sim.step(), "status": "converged", "energy_created": 0.3}
            sim._warnings.look(sim, info, 1e-3)
        texts[ranks] = [str(w.message) for w in caught if w.category in (cn.OverlapWarning, cn.EnergyCreatedWarning)]
    overlap, created = texts[2]
    assert "project_positions" in texts[None][0] and "project_positions" not in overlap
    assert "give solver=cn.Auto(), a smaller tol or accuracy=1e-3 of NSCD" in texts[None][1]
    assert "give a smaller tol or accuracy=1e-3 of NSCD" in created
    assert created.count("a smaller") == 1
