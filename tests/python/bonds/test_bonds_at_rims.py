"""Blocks of equal outline that are glued: nodes on the rim of a face pass a hair beyond it and behind it, and stay bonded."""

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=2500.0)
SIZE, AREA = np.array([0.1, 0.08, 0.05]), 0.008
SHARP = cn.NLGS(tol=1e-8, max_iter=5000)


def brick(corner, cells, young):
    """A block of hexahedra, nodes of its lower and upper face."""
    ticks = [np.linspace(0, s, n + 1) for s, n in zip(SIZE, cells)]
    points = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1) + corner
    of = np.arange(points[..., 0].size).reshape(points.shape[:3])
    ring = [of[i : of.shape[0] - 1 + i, j : of.shape[1] - 1 + j] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
    hexahedra = np.stack([r[..., k : of.shape[2] - 1 + k] for k in (0, 1) for r in ring], axis=-1).reshape(-1, 8)
    groups = {"low": of[..., 0].ravel(), "high": of[..., -1].ravel()}
    cells = {"hexahedron": hexahedra}
    return cn.ElasticBody(points.reshape(-1, 3), cells, young=young, poisson=0.0, density=2500.0, groups=groups, lumped=True)


def glued(law, cells, dt, young=1e13, gravity=(0.0, 0.0, 0.0), velocity=None, up=(0.0, 0.0, 0.0)):
    """The upper one is driven, or falls."""
    scene = cn.Scene(3, gravity=gravity)
    moved = {} if velocity is None else dict(drive={"high": dict(zip("xyz", velocity))}, velocity=velocity)
    scene.add(cn.deformable(brick(np.array(up), (3, 2, 1), young), STONE, contact="low", faces="low", name="up", **moved))
    scene.add(cn.deformable(brick([0, 0, -SIZE[2]], cells, young), STONE, faces="high", fixed={"low": "xyz"}, name="down"))
    scene.interact(STONE, STONE, law)
    return cn.Simulation(scene, dt, cn.NSCD(solver=SHARP, theta=1.0), overlap="ignore")


@pytest.mark.parametrize("cells", [(3, 2, 1), (2, 3, 1)])
@pytest.mark.parametrize("way", [(1.0, 0.0, -1e-4), (-1.0, 0.0, -1e-4), (0.0, 1.0, -1e-4)])
def test_a_joint_that_is_sheared_and_pressed_a_little_spends_its_work(cells, way):
    """10 J/m2 in every mode, whether cells match or not; no bond comes back broken by nothing."""
    zone = cn.MP3(normal_stiffness=1e12, tangential_stiffness=1e12, strength=2e6, work=10.0)
    sim = glued(zone, cells, dt=4e-6, velocity=0.02 * np.array(way))
    before = np.ones(12)
    for _ in range(450):
        assert sim.step()["status"] == "converged"
        beta = np.sort(sim.contacts.beta)
        if beta.max() > 0:
            assert np.all(beta <= before) and len(beta) == 12
            before = beta
    energy = sim.info["energy"]
    assert energy["released"] == pytest.approx(10.0 * AREA, rel=1e-4)
    assert abs(energy["closure"]) < 1e-10 * energy["in_play"]


SPRINGS = dict(normal_stiffness=1e12, tangential_stiffness=1e12)


@pytest.mark.parametrize("law", [
    cn.MAL(**SPRINGS, normal_strength=1e8, tangential_strength=1e8, normal_work=1e6, tangential_work=1e6),
    cn.ParallelBond(**SPRINGS, tension=1e9, shear=1e9, radius=1.0),
])  # fmt: skip
def test_a_joint_far_below_its_strength_stays_whole(law):
    """A soft block that hangs on its joint, pressed and drawn to the side."""
    sim = glued(law, (3, 2, 1), dt=1e-4, young=1e9, gravity=(300.0, 0.0, -100.0))
    for _ in range(100):
        assert sim.step()["status"] == "converged"
        assert np.array_equal(sim.contacts.beta, np.ones(12))
    weight = 2500.0 * np.prod(SIZE) * np.array([300.0, 0.0, -100.0])
    assert np.allclose(sim.contacts.force.sum(axis=0), -weight, rtol=1e-3, atol=1e-3)


def test_what_is_not_bonded_passes_beside_a_rim():
    """A point a hair beyond the rim and behind the face touches nothing."""
    sim = glued(cn.Coulomb(mu=0.3), (3, 2, 1), dt=1e-5, up=(SIZE[0] + 1e-6, 0.0, -1e-6), velocity=(0.0, 0.0, -1e-3))
    for _ in range(5):
        sim.step()
        assert len(sim.contacts.force) == 0


@pytest.mark.parametrize("cells", [(3, 2, 1), (2, 3, 1), (4, 4, 1)])
@pytest.mark.parametrize("way", [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.6, -0.8)])
def test_blocks_sheared_past_each_other_bear_their_strength(cells, way):
    """Nodes that pass the rim shear as on a face that is longer: held as if they opened there they broke early."""
    own = dict(normal_strength=2e6, tangential_strength=3e6, normal_work=30.0, tangential_work=30.0)
    sim = glued(cn.MAL(**SPRINGS, **own), cells, dt=2e-6, young=1e14, velocity=(0.1 * way[0], 0.1 * way[1], 0.0))
    most = 0.0
    for _ in range(40):
        assert sim.step()["status"] == "converged"
        most = max(most, np.linalg.norm(sim.contacts.force.sum(axis=0)[:2]) / AREA)
    assert most == pytest.approx(3e6, rel=2e-3)


def test_a_restored_step_leaves_the_same_state_as_one_that_goes_on():
    """Also which nodes lie over which side of a rigid body, from which the next step knows who slid past a rim."""
    zone = cn.MP3(normal_stiffness=1e12, tangential_stiffness=1e12, strength=2e6, work=10.0)
    velocity = (0.02, 0.0, -2e-6)

    def simulate():
        scene = cn.Scene(3)
        drive = {"high": dict(zip("xyz", velocity))}
        block = brick(np.zeros(3), (3, 2, 1), 1e13)
        scene.add(cn.deformable(block, STONE, contact="low", faces="low", name="up", drive=drive, velocity=velocity))
        scene.add(cn.boxes([SIZE * (0.5, 0.5, -0.5)], [SIZE], STONE, fixed=True))
        scene.interact(STONE, STONE, zone)
        return cn.Simulation(scene, 4e-6, cn.NSCD(solver=SHARP, theta=1.0), overlap="ignore")

    whole, fresh = simulate(), simulate()
    for _ in range(5):
        whole.step()
    fresh.set_state(whole.get_state())
    for sim in (whole, fresh):
        sim.step()
    one, two = (sim.get_state()["memory"] for sim in (whole, fresh))
    assert len(one["seats"]) == 12
    for name, values in one.items():
        assert np.array_equal(values, two[name]), name
