"""Closed forms of friction and attraction in scenes: a rope over a drum, Janssen's law, capture and escape by an attraction."""

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=1000.0)


@pytest.mark.parametrize(("mu", "turned"), [(0.2, np.pi), (0.5, np.pi / 2)])
def test_a_rope_over_a_drum_holds_by_the_exponential_of_its_friction(mu, turned):
    """A chain of beads on rods over a fixed drum, loaded at one end: the least force at the other that holds is T exp(-mu theta);
    of n beads (1 - mu tan(a/2))^n/(1 + mu tan(a/2))^n, a the angle between two."""
    n, drum, bead = 60, 1.0, 0.01
    angle = turned / n
    reach = drum + bead
    at = np.pi / 2 - turned / 2 + angle * (np.arange(n) + 0.5)
    beads = reach * np.column_stack([np.cos(at), np.sin(at)])
    length = reach * 2 * np.sin(angle / 2)  # of a rod
    ends = []
    for k, side in ((0, 1.0), (n - 1, -1.0)):  # tangents: a bead beyond each end, half an angle on
        tangent = side * np.array([np.sin(at[k] - side * angle / 2), -np.cos(at[k] - side * angle / 2)])
        ends.append(beads[k] + length * tangent)
    exact = ((1 - mu * np.tan(angle / 2)) / (1 + mu * np.tan(angle / 2))) ** n
    assert exact == pytest.approx(np.exp(-mu * turned), rel=1e-3)
    for factor, holds in ((1.001, True), (0.999, False)):
        scene = cn.Scene(dim=2)
        wood, rope = cn.Material("wood", density=1000.0), cn.Material("rope", density=1000.0)
        scene.add(cn.disks([[0.0, 0.0]], drum, wood, driven=("vx", "vy", "w")))
        scene.add(cn.disks(beads, bead, rope, driven=("w",)))
        for end, neighbour, pull in ((ends[0], beads[0], 1.0), (ends[1], beads[-1], exact * factor)):
            along = (end - neighbour) / np.linalg.norm(end - neighbour)
            scene.add(cn.disks([end], bead, rope, driven=("w",), force=(*(100.0 * pull * along), 0.0)))
        scene.interact(wood, rope, cn.Coulomb(mu=mu))
        scene.interact(rope, rope, cn.Rod(within=1.1 * (length - 2 * bead)))
        sim = cn.Simulation(scene, 1e-4, cn.NSCD(theta=1.0, solver=cn.Auto(tol=1e-8, max_iter=100000)))
        for _ in range(3):
            sim.step()
            assert sim.info["status"] == "converged"
        free = 100.0 * 1e-4 * sim.steps * exact * 1e-3 / sim.bodies.mass[1:].sum()  # what the surplus alone would make of it
        assert (abs(sim.bodies.velocity[1:, :2]).max() < 0.1 * free) == holds


def launched(speed, h, steps):
    """A disk of 1 kg that leaves a wall which draws it by 10 N within a millimetre: its speed, (steps,)."""
    radius = np.sqrt(1 / (np.pi * 1000.0))
    scene = cn.Scene(dim=2)
    scene.add(cn.disks([[0.0, radius]], radius, STONE, velocity=[[0.0, speed, 0.0]]), cn.wall((0, 0), (0, 1), STONE))
    scene.interact(STONE, STONE, cn.Wet(force=10.0, reach=1e-3, mu=0.3))
    sim = cn.Simulation(scene, h, cn.NSCD(theta=0.5, solver=cn.NLGS(tol=1e-12)))
    speeds = []
    for _ in range(steps):
        sim.step()
        speeds.append(sim.bodies.velocity[0, 1])
    return np.array(speeds), sim


def test_an_attraction_captures_below_its_escape_speed_and_lets_go_above():
    """sqrt(2 F reach/m) = 0.141421 m/s; a grain leaving at v goes on at sqrt(v^2 - 0.02)."""
    speeds, sim = launched(0.14, 1e-5, 6000)
    assert np.abs(speeds[-100:]).max() < 1e-12 and sim.contacts.gap[0] < 1e-12  # it came back, and stays
    errors = []
    for h in (2e-5, 1e-5):
        found = [launched(speed, h, round(0.02 / h))[0][-1] for speed in (0.2, 0.5)]
        errors.append(np.abs(found - np.sqrt([0.02, 0.23])))
    assert np.all(errors[1] < 2e-3) and np.all(errors[1] < errors[0] + 1e-4)


def test_two_disks_that_draw_each_other_hold_to_that_force():
    for pull, held in ((9.99, True), (10.01, False)):
        scene = cn.Scene(dim=2)
        for x, force in ((0.0, -pull), (0.1, pull)):
            scene.add(cn.disks([[x, 0.0]], 0.05, STONE, force=(force, 0.0, 0.0)))
        scene.interact(STONE, STONE, cn.Wet(force=10.0, reach=1e-3, mu=0.3))
        sim = cn.Simulation(scene, 1e-4, cn.NSCD(solver=cn.NLGS(tol=1e-12)))
        for _ in range(20):
            sim.step()
        apart = sim.bodies.velocity[1, 0] - sim.bodies.velocity[0, 0]
        left = (pull - 10.0) / sim.bodies.mass[0] * 2 * sim.time
        assert apart == pytest.approx(0.0 if held else left, rel=1e-6, abs=1e-9 * abs(left))
        assert (abs(sim.contacts.gap[0]) < 1e-12) == held


def test_janssens_law_in_a_silo_whose_walls_are_drawn_up():
    """Stress on walls and floor of a column six widths high follows s (1 - exp(-z/s)), s = width/(2 mu K), with one K."""
    width, mu, count = 8.0, 0.5, 400
    radii = cn.pre.grains.uniform(count, 0.4, 0.6, rng=3)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks(cn.pre.deposit_disks(radii, width), radii, STONE, driven=("w",)))  # grains that roll would not slip
    rough, floor = cn.Material("rough", density=1000.0), cn.Material("floor", density=1000.0)
    up = {"velocity": (0.0, 0.1)}
    scene.add(cn.wall((0, 0), (0, 1), floor), cn.wall((0, 0), (1, 0), rough, **up), cn.wall((width, 0), (-1, 0), rough, **up))
    scene.interact(STONE, STONE, cn.Coulomb(mu=0.3))
    scene.interact(STONE, floor, cn.Coulomb(mu=0.3))
    scene.interact(STONE, rough, cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, 5e-3, cn.NSCD(theta=0.6, solver=cn.NLGS(tol=1e-4, max_iter=1000)))
    n, begin, end = count, 500, 2500
    bins, found = 6, np.zeros(3)
    push = np.zeros(bins)
    top = sim.bodies.position[:n, 1].max() + 0.5
    for step in range(end):
        sim.step()
        if step >= begin:
            contacts = sim.contacts
            wall, on = contacts.bodies.max(axis=1), contacts.bodies[:, 0] < n
            force = np.where(on, 1.0, -1.0)[:, None] * contacts.force  # on the grain
            side = wall > n
            found += (force[wall == n, 1].sum(), force[side, 1].sum(), np.abs(force[side, 0]).sum())
            depth = np.clip((top - contacts.point[side, 1]) / top * bins, 0, bins - 1).astype(int)
            np.add.at(push, depth, np.abs(force[side, 0]))
    floor_bears, walls_bear, pushed = found / (end - begin)
    push /= (end - begin) * 2 * top / bins  # [Pa] on one wall
    weight = 9.81 * sim.bodies.mass[:n].sum()
    assert floor_bears + walls_bear == pytest.approx(weight, rel=0.01)
    assert walls_bear / pushed == pytest.approx(mu, rel=0.05)  # they slip everywhere
    z, edges = np.linspace(0, top, 601), np.arange(bins + 1) * 600 // bins

    def wall_stress(k):
        s = width / (2 * mu * k)
        of = k * weight / (width * top) * s * (1 - np.exp(-z / s))
        return np.array([of[a:b].mean() for a, b in zip(edges[:-1], edges[1:])])

    tried = np.linspace(0.2, 2.0, 361)
    k = tried[np.argmin([np.sum((wall_stress(k) - push) ** 2) for k in tried])]
    assert np.allclose(push[1:], wall_stress(k)[1:], rtol=0.15)  # the highest sixth ends in a heap
    law = 2 * mu * k * top / width
    assert floor_bears / weight == pytest.approx((1 - np.exp(-law)) / law, rel=0.1)
    assert floor_bears / weight < 0.35  # without friction 1
