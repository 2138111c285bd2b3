"""Spheres under laws with several state variables: the kernels that know spheres alone against those of all shapes, laws of
different states in one scene, threads."""

import cairn as cn
import numpy as np
import pytest

R = 0.01
LAWS = {
    "hertz": lambda: cn.granular("hertz", young=1e6, restitution=0.5, damping="tsuji", mu=0.5),
    "rescaled": lambda: cn.granular("hertz", young=1e6, restitution=0.5, mu=0.5, tangential="mindlin_rescale"),
    "hooke, rolls": lambda: cn.granular(
        "hooke",
        stiffness=2e3,
        restitution=0.6,
        mu=0.4,
        rolling="spring_dashpot",
        rolling_mu=0.1,
        rolling_damping=0.3,
        twisting="marshall",
    ),  # fmt: skip
    "torque": lambda: cn.granular("dmt", young=1e6, work=0.1, restitution=0.6, mu=0.4, rolling="constant_torque", rolling_mu=0.1),
    "adhesive": lambda: cn.granular(
        "jkr", young=1e6, work=0.1, restitution=0.6, mu=0.4, rolling="spring_dashpot", rolling_mu=0.1
    ),
    "jkr": lambda: cn.JKR(young=1e6, work=0.1, restitution=0.5, mu=0.5),
    "plastic": lambda: cn.PlasticContact(loading=2e3, unloading=4e3, cohesion=2e2, plastic=0.05, mu=0.5),
    "yield": lambda: cn.YieldContact(young=1e6, yield_pressure=2e4, restitution=0.5, mu=0.5),
    "wet": lambda: cn.LiquidBridge(young=1e6, tension=0.07, volume=1e-9, restitution=0.5, mu=0.5),
    "bond": lambda: cn.SmoothBond(
        normal_stiffness=1e8, tangential_stiffness=1e8, radius=1.0, within=1e-3, tension=5e3, shear=5e3, damping=0.1, mu=0.5
    ),
}


def pile(law, general=False, threads=1, steps=150, energy=True):
    """60 spheres that fall on a plane and on one another, spinning. A clump far away keeps all on the general way."""
    rng = np.random.default_rng(5)
    rock = cn.Material("rock", density=2500)
    scene = cn.Scene(3, gravity=(1.0, 0.5, -9.81))
    grid = np.array([(i, j, k) for k in range(4) for j in range(3) for i in range(5)], float)
    centers = (grid * 2.0 + rng.uniform(-0.1, 0.1, grid.shape) + 1.0) * R
    motion = rng.normal(0, 1, (60, 6)) * ([0.3] * 3 + [20.0] * 3)
    spheres = cn.spheres(centers, rng.uniform(0.9, 1.1, 60) * R, rock, velocity=motion)
    scene.add(spheres, cn.wall((0, 0, 0), (0, 0, 1), rock))
    if general:
        clump = cn.pre.clump([[0.5 * R, 0, 0], [-0.5 * R, 0, 0]], [R, R], 2500.0)
        scene.add(cn.clumps([[5.0, 5.0, 5.0]], clump.offsets, clump.radii, clump.mass, clump.inertia, rock))
    scene.interact(rock, rock, law)
    sim = cn.Simulation(scene, 5e-5, cn.SmoothDEM(threads=threads, energy=energy), overlap="ignore")
    for _ in range(steps):
        sim.step()
    assert len(sim.contacts) > 20
    return sim.bodies.position[:60], sim.bodies.velocity[:60]


@pytest.mark.parametrize("law", LAWS)
def test_both_ways_agree(law):
    (x, v), (known_x, known_v) = pile(LAWS[law]()), pile(LAWS[law](), general=True)
    np.testing.assert_allclose(x, known_x, rtol=0, atol=1e-9 * R)
    np.testing.assert_allclose(v, known_v, rtol=0, atol=1e-8 * np.abs(v).max())
    quiet = pile(LAWS[law](), threads=2, energy=False)
    assert np.array_equal(quiet[0], x) and np.array_equal(quiet[1], v)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_law_of_other_pairs_changes_nothing(dim):
    """Rows of states are as long as the longest; springs of each pair stay its own, as contacts end and lists are made anew."""

    def roll(other):
        rng = np.random.default_rng(3)
        rock, floor, tin = (cn.Material(name, density=2500) for name in ("rock", "floor", "tin"))
        scene = cn.Scene(dim, gravity=[2.0, *[0.0] * (dim - 2), -9.81])
        x = np.zeros((24, dim))
        x[:, 0], x[:, -1] = 2.5 * R * np.arange(24), R * (0.99 + rng.uniform(0, 0.2, 24))
        grains = cn.spheres if dim == 3 else cn.disks
        up = [0.0] * (dim - 1) + [1.0]
        scene.add(grains(x, np.full(24, R), rock), cn.wall([0.0] * dim, up, floor))
        law = cn.HertzMindlin(young=1e6, poisson=0.3, restitution=0.5, mu=0.5)
        scene.interact(rock, floor, law)
        scene.interact(rock, rock, law)
        if other:
            scene.add(grains([[0.0] * (dim - 1) + [5.0]], [R], tin))
            scene.interact(rock, tin, cn.granular("hertz", young=1e6, restitution=0.5, mu=0.5))
            scene.interact(floor, tin, law)
        sim = cn.Simulation(scene, 1e-4, cn.SmoothDEM(skin=0.2 * R))
        for _ in range(400):
            sim.step()
        return sim.bodies.position[:24], sim.bodies.velocity[:24]

    for one, two in zip(roll(False), roll(True)):
        assert np.array_equal(one, two)
