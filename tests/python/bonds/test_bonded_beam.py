"""A beam of bonded disks, clamped and loaded at its end: bends as Euler and Bernoulli have it, breaks at its strength."""

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=2500.0)
R, YOUNG, TENSION = 0.01, 1e9, 1e6


def beam(rows, columns, tip, dt=0.05, tension=np.inf):
    """Disks on a square lattice, a little smaller than their places, whose bonds are as wide as these: a full section. The first
    column is held, the last bears a force down [N], a number or a function of time, or forces and torques (rows, 3) by time."""
    x, y = np.meshgrid(2 * R * np.arange(columns), 2 * R * (np.arange(rows) - (rows - 1) / 2), indexing="ij")
    places, scene = np.stack([x, y], -1), cn.Scene(dim=2)
    share = 1 - 1e-3

    def down(t):
        now = np.asarray(tip(t) if callable(tip) else tip)
        return now if now.ndim else (0.0, -now / rows, 0.0)

    scene.add(cn.disks(places[0], share * R, STONE, driven=("vx", "vy", "w")))
    scene.add(cn.disks(places[1:-1].reshape(-1, 2), share * R, STONE))
    scene.add(cn.disks(places[-1], share * R, STONE, force=down))
    scene.interact(STONE, STONE, cn.ParallelBond(normal_stiffness=YOUNG / (2 * R), tangential_stiffness=YOUNG / (2 * R), mu=0.0,
                                                 tension=tension, radius=1 / share, within=3e-3 * R))  # fmt: skip
    sim = cn.Simulation(scene, dt, cn.NSCD(theta=1.0, solver=cn.Auto(tol=1e-10, max_iter=5000)))
    return sim, places


def section(rows):
    """Second moment of a joint's bonds about its neutral axis, and the distance of the farthest fibre from it. Bonds do not
    shorten: of several rows the pressed one is the axis."""
    y = 2 * R * np.arange(rows)
    return np.sum(2 * R * y**2 + (2 * R) ** 3 / 12), y[-1] + R


@pytest.mark.parametrize("rows", [1, 4])
def test_it_bends_as_euler_and_bernoulli_have_it(rows):
    """P L^3/(3 E I) at rest, E = k_n 2 R; each bond is a hinge in the middle of two disks."""
    columns = 25 if rows == 1 else 61
    length = 2 * R * (columns - 1)
    tip = 3 * YOUNG * section(rows)[0] / length**3 * 1e-3 * length  # bends by a thousandth of its length
    sim, places = beam(rows, columns, tip)
    for _ in range(25):
        sim.step()
        assert sim.info["status"] == "converged"
    sag = -sim.bodies.position[-rows:, 1] + places[-1, :, 1]
    assert np.allclose(sag, 1e-3 * length, rtol=0.02)
    assert sim.info["energy"]["stored"] == pytest.approx(0.5 * tip * 1e-3 * length, rel=0.03)
    middle = sim.bodies.position[(columns // 2) * rows, 1] - places[columns // 2, 0, 1]
    half = places[columns // 2, 0, 0] / length
    assert -middle == pytest.approx(1e-3 * length * (1.5 * half**2 - 0.5 * half**3), rel=0.02)


@pytest.mark.parametrize(("rows", "columns"), [(1, 13), (2, 25), (4, 13), (4, 25)])
def test_it_breaks_at_its_strength(rows, columns):
    """At the first joint, where M y/I is largest and, of several rows, the outer one bears more, since the section is held. Near
    the strength the load grows by a thousandth of it in a step of some periods."""
    dt = 0.05 if rows == 1 else 0.01
    moment, far = section(rows)
    load = TENSION * moment / far / (2 * R * (columns - 1) - R)

    def share(t):
        step = t / dt
        return 0.05 * step if step < 17 else 0.85 + 0.001 * (step - 17)

    sim, _ = beam(rows, columns, lambda t: load * share(t), dt, TENSION)
    sim.step()
    held = sim.contacts.beta > 0
    bonds = {tuple(pair) for pair in sim.contacts.bodies[held].tolist()}
    assert len(bonds) == (columns - 1) * rows + (columns - 1) * (rows - 1)
    while share(sim.time) < 1.1:
        assert sim.step()["status"] == "converged"
        left = {tuple(pair) for pair in sim.contacts.bodies[sim.contacts.beta > 0].tolist()}
        if left != bonds:
            break
    assert share(sim.time) == pytest.approx(1 / network(rows, columns).max(), abs=0.0021)
    assert all(a < rows <= b < 2 * rows for a, b in bonds - left)  # between the first two columns


def network(rows, columns):
    """Largest stress of each bond between the first and the second column, over M y/I, (rows,), in the cantilever at rest by
    linear algebra alone. Bonds are springs for (u_n, u_t) and rotation, 1e6 times as stiff in compression."""
    k, bonds = YOUNG / (2 * R), []
    number = np.arange(rows * columns).reshape(columns, rows)
    bonds += [(a, b, (1.0, 0.0)) for a, b in zip(number[:-1].ravel(), number[1:].ravel())]
    bonds += [(a, b, (0.0, 1.0)) for a, b in zip(number[1:, :-1].ravel(), number[1:, 1:].ravel())]
    force = np.zeros((rows * columns, 3))
    force[-rows:, 1] = -1.0 / rows
    rows_of = np.zeros((3, len(bonds), 3 * rows * columns))  # opening, slip and turn of each
    for q, (a, b, (x, y)) in enumerate(bonds):
        dofs = np.concatenate([3 * a + np.arange(3), 3 * b + np.arange(3)])
        rows_of[:, q, dofs] = [[-x, -y, 0, x, y, 0], [y, -x, -R, -y, x, -R], [0, 0, -1, 0, 0, 1]]
    pressed, free = np.zeros(len(bonds), bool), slice(3 * rows, None)
    for _ in range(20):
        one = k * 2 * R * np.ones(len(bonds))
        stiffness = [np.where(pressed, 1e6, 1.0) * one, one, one * R**2 / 3]
        whole = sum(part.T @ (of[:, None] * part) for part, of in zip(rows_of, stiffness))
        u = np.zeros(force.size)
        u[free] = np.linalg.solve(whole[free, free], force.ravel()[free])
        opening, turn = rows_of[0] @ u, rows_of[2] @ u
        if np.array_equal(pressed, opening < 0):
            break
        pressed = opening < 0
    moment, far = section(rows)
    stress = k * (np.maximum(opening, 0) + np.abs(turn) * R)[:rows]
    return stress * moment / far / (2 * R * (columns - 1) - R)


def test_shear_where_a_section_is_held_adds_stress_as_the_height_over_the_length():
    """Nothing in one row, where there is no section to warp; half of it at twice the length."""
    assert network(1, 13) == pytest.approx([1.0], rel=1e-9)
    short, long = network(4, 25).max(), network(4, 49).max()
    assert 1.03 < short < 1.06 and (long - 1) * 48 == pytest.approx((short - 1) * 24, rel=0.05)


@pytest.mark.parametrize(("rows", "dt"), [(1, 2e-2), (2, 1e-3), (4, 1e-3)])
def test_under_a_couple_alone_it_breaks_at_its_strength(rows, dt):
    """Pure bending, whose stress is M y/I at all joints: by forces and torques on the last column as that stress has them. Near
    the strength the load grows by a thousandth of it in a step, which is some periods long: far longer ones are solved less
    well than that, and what pressed bonds then overlap by stays."""
    y, far = 2 * R * np.arange(rows), section(rows)[1]
    forces = np.zeros((rows, 3))
    forces[:, 0] = TENSION * y / far * 2 * R
    forces[0, 0] = -forces[:, 0].sum()
    forces[:, 2] = -TENSION / far * (2 * R) ** 3 / 12

    def share(t):
        step = t / dt
        return 0.05 * step if step < 19 else 0.95 + 0.001 * (step - 19)

    sim, _ = beam(rows, 9, lambda t: forces * share(t), dt, TENSION)
    sim.step()
    bonds = np.count_nonzero(sim.contacts.beta > 0)
    while share(sim.time) < 1.1:
        assert sim.step()["status"] == "converged"
        if np.count_nonzero(sim.contacts.beta > 0) != bonds:
            break
    assert share(sim.time) == pytest.approx(1, abs=0.0011)
