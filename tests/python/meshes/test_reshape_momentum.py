"""Momentum is kept to rounding as a criterion makes a rigid body deformable, and as a call does so in space."""

import cairn as cn
import numpy as np
import pytest
from second_order import box

ROCK = cn.Material("rock", density=1000.0)
SQUARE = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])


def momentum(sim, dim):
    """Momentum of rigid bodies and meshes, along the axes and about the origin (dim + 3,)."""
    out = np.zeros(dim + 3)

    def add(places, momenta):
        x, p = np.zeros((len(places), 3)), np.zeros((len(places), 3))
        x[:, :dim], p[:, :dim] = places, momenta
        out[:dim] += p.sum(axis=0)[:dim]
        out[dim:] += np.cross(x, p).sum(axis=0)

    for mesh in sim.meshes:
        add(mesh.displacement + mesh.body.points, (mesh.body.M @ mesh.velocity.ravel()).reshape(-1, dim))
    b = sim.bodies
    for k in np.flatnonzero(np.isfinite(b.mass)):
        add(b.position[k : k + 1, :dim], b.mass[k] * b.velocity[k : k + 1, :dim])
        if dim == 2:
            out[4] += np.ravel(b.inertia)[k] * b.velocity[k, 2]
        else:  # of cubes: as about any axis
            out[dim:] += np.ravel(b.inertia[k])[0] * b.velocity[k, 3:]
    return out


def collision(dim):
    """Two bodies that strike each other obliquely, far from all else, and the mesh of the first."""
    scene = cn.Scene(dim=dim)
    rubber = cn.NeoHookean(young=1e7, poisson=0.3)
    if dim == 2:
        turn, (points, cells) = 0.2, box("quad", (4, 4), (1, 1), lambda x: x - 0.5)
        scene.add(cn.polygons([SQUARE, SQUARE], ROCK, position=[[0, 0], [1.2, 0.3]], rotation=[turn, 0.5],
                              velocity=[[2.0, 0, 1.0], [-1.0, 0.5, 0.0]]))  # fmt: skip
        points = points @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    else:
        points, cells = box("hexahedron", (2, 2, 2), (1, 1, 1), lambda x: x - 0.5)
        scene.add(cn.boxes([[0, 0, 0], [1.15, 0.3, 0.2]], (1.0, 1.0, 1.0), ROCK,
                           velocity=[[2.0, 0, 0, 0.5, 0, 0.3], [-1.0, 0.5, 0, 0, 0.2, 0]]))  # fmt: skip
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    body = cn.SolidBody(points, cells, rubber, density=1000.0)
    return cn.Simulation(scene, 5e-4, cn.NSCD(0.5, cn.Default(tol=1e-12, max_iter=20000))), body


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("threshold", [{"force": 1e3}, {"stress": 1e3}])
def test_a_criterion_keeps_momentum(dim, threshold):
    """Nothing acts from outside: momentum stays to rounding in all steps, those in which the body changes too."""
    sim, body = collision(dim)
    sim.reshape_when([0], {0: body}, back=1e1, **threshold)
    begin = momentum(sim, dim)
    size, kinds, worst = np.abs(begin).max(), [0], 0.0
    for _ in range(300):
        sim.step()
        worst = max(worst, np.abs(momentum(sim, dim)[:dim] - begin[:dim]).max() / size)
        kinds.append(len(sim.meshes))
    assert max(kinds) == 1 and kinds[-1] == 0 and worst < 1e-12
    assert sim.info["energy"]["dissipated_reshaping"] > 0


@pytest.mark.parametrize("kind", ["hexahedron", "tetra10"])
def test_impulses_in_space_pass_over_by_hand(kind):
    """A box between the ground and a box on it, that slides: momentum, and the sums of what contacts remember, there and back."""
    scene = cn.Scene(dim=3, gravity=(0, 0, -9.81))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    scene.add(cn.boxes([[0, 0, 0.5]], (1.0, 1.0, 1.0), ROCK, velocity=(0.5, 0.2, 0, 0, 0, 0)))
    scene.add(cn.boxes([[0.1, 0.05, 1.25]], (0.5, 0.5, 0.5), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(0.5, cn.Default(tol=1e-11, max_iter=20000)))
    for _ in range(30):
        assert sim.step()["status"] == "converged"

    def all_of():
        """Momenta, and the impulses of the ground (contactor 0) and the box above (2) on the bodies between them."""
        memory = sim.get_state()["memory"]
        keys, impulses = np.asarray(memory["keys"]), memory["impulses"].reshape(len(memory["keys"]), -1)
        others = [(np.isin(keys[:, 1], k) * 1.0 - np.isin(keys[:, 0], k)) @ impulses for k in (0, 2)]
        return np.concatenate([momentum(sim, 3), *others])

    def alike(one, two):
        return np.abs(one - two).max() < 1e-12 * np.abs(one).max()

    points, cells = box(kind, (2, 2, 2), (1, 1, 1), lambda x: x - 0.5 + [0, 0, 0.5])
    before = all_of()
    mesh = sim.deform(1, cn.SolidBody(points, cells, cn.NeoHookean(young=1e7, poisson=0.3), density=900.0))
    assert alike(before, all_of()) and np.abs(before[6:]).max() > 0
    for _ in range(15):
        assert sim.step()["status"] == "converged"
    before = all_of()
    assert sim.rigidify(mesh) == 1 and alike(before, all_of())
    for _ in range(10):
        assert sim.step()["status"] == "converged"
    terms = sim.info["energy"]
    assert abs(terms["closure"]) < 1e-9 * terms["in_play"]
