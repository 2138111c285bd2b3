"""Scenes of two features far from each other: each moves as it does alone, and goes on from a checkpoint to the same bits."""

import itertools

import cairn as cn
import numpy as np
import pytest

G, H, STEPS = 9.81, 1e-3, 3
SHARP = cn.NSCD(solver=cn.Auto(tol=1e-9, max_iter=5000))


def stone(name):
    return cn.Material(name, density=2600.0, young=7e10, poisson=0.2, conductivity=2.0, capacity=800.0, resistivity=1e-3)


def ball(dim, places, name, **more):
    return (cn.disks if dim == 2 else cn.spheres)(places, 0.1, stone(name), **more)


def floor(dim, name):
    return cn.wall(np.zeros(dim), np.eye(dim)[-1], stone(name))


def places(dim, at, *rows):
    """Points (x, height), shifted by `at` along x."""
    return np.array([(at + x, *[0.0] * (dim - 2), z) for x, z in rows])


def pile(scene, at, f, **more):
    """A ball on another on a floor: no redundant contact, so that Coulomb's law has a single solution."""
    x = places(scene.dim, at, (0.0, 0.1), (0.0, 0.3))
    scene.add(ball(scene.dim, x, f.name, **more), floor(scene.dim, f.name))
    scene.interact(f.name, f.name, f.law)


class Feature:
    """A part of a scene under one material, named as the feature is."""

    def __init__(self, name, law=None, build=pile, late=None):
        self.name, self.law, self.build, self.late = name, law or cn.Coulomb(mu=0.1), build, late


def mesh(scene, at, f):
    """An elastic block that stands on the floor."""
    dim = scene.dim
    counts = [2] * dim
    grid = np.stack(np.meshgrid(*[np.linspace(0, 0.2, n + 1) for n in counts], indexing="ij"), -1).reshape(-1, dim)
    number = np.arange(len(grid)).reshape([n + 1 for n in counts])
    if dim == 2:
        cells = {"quad": np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], -1).reshape(-1, 4)}
    else:
        low = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
        cells = {"hexahedron": np.stack([n[:, :, :-1] for n in low] + [n[:, :, 1:] for n in low], -1).reshape(-1, 8)}
    body = cn.ElasticBody(grid + places(dim, at, (0.0, 0.0)), cells, young=1e9, poisson=0.2, density=2000.0,
                          groups={"foot": np.flatnonzero(grid[:, -1] == 0)})  # fmt: skip
    scene.add(cn.deformable(body, stone(f.name), contact="foot"), floor(dim, f.name))
    scene.interact(f.name, f.name, f.law)


def pendulum(scene, at, f):
    """A ball that hangs on the world."""
    (bob,) = scene.add(ball(scene.dim, places(scene.dim, at, (0.3, 1.0)), f.name))
    kind = cn.Pivot if scene.dim == 2 else cn.Ball
    scene.join(bob, None, kind(point=places(scene.dim, at, (0.0, 1.0))[0]))
    scene.interact(f.name, f.name, f.law)


def warm(scene, at, f):
    pile(scene, at, f)
    scene.thermal(initial=300.0, power={f.name: 5.0})


def live(scene, at, f):
    pile(scene, at, f)
    scene.electrical(potential={f.name: 2.0})


def pushed(scene, at, f):
    pile(scene, at, f, velocity=[(0.5,) + (0.0,) * (scene.dim - 1)] * 2)


def come_later(sim, at, f):
    sim.add(ball(sim.scene.dim, places(sim.scene.dim, at, (0.4, 0.1)), f.name))


def go_away(sim, at, f):
    sim.remove([one_at(sim, at, 0.3)])


def driven(sim, at, f):
    sim.drive([one_at(sim, at, 0.1)], "vx", 0.1)


def one_at(sim, x, height):
    place = sim.bodies.position
    return sim.bodies.id[np.argmin(np.hypot(place[:, 0] - x, place[:, -1] - height))]


BOND = dict(normal_stiffness=1e8, tangential_stiffness=1e8)
FEATURES = [
    Feature("friction"),
    Feature("rebound", cn.Restitution(normal=0.5, mu=0.2), pushed),
    Feature("bonds", cn.Bonded(mu=0.3), pushed),
    Feature("beams", cn.ParallelBond(tension=1e6, shear=1e6, mu=0.3, **BOND), pushed),
    Feature("zones", cn.MAC(work=10.0, mu=0.3, **BOND), pushed),
    Feature("rolling", cn.Rolling(mu=0.5, rolling=0.05), pushed),
    Feature("wet", cn.Wet(force=20.0, reach=0.01, mu=0.3)),
    Feature("mesh", build=mesh),
    Feature("joint", build=pendulum),
    Feature("heat", build=warm),
    Feature("current", build=live),
    Feature("insertion", late=come_later),
    Feature("removal", late=go_away),
    Feature("drive", late=driven),
]


def start(dim, features, far, **options):
    scene = cn.Scene(dim, gravity=(0.0,) * (dim - 1) + (-G,), **options)
    for f in features:
        f.build(scene, far[f.name], f)
    for a, b in itertools.combinations([f.name for f in features], 2):
        scene.interact(a, b, None)
    return cn.Simulation(scene, H, SHARP, overlap="ignore")


def advance(sim, features, far, first=0, last=STEPS):
    for step in range(first, last):
        for f in features if step == 1 else ():
            if f.late:
                f.late(sim, far[f.name], f)
        info = sim.step()
        assert info["status"] == "converged", info
    return sim


def motion(sim, at):
    """Places and velocities of bodies and nodes near `at`, in the order of insertion."""
    b, n = sim.bodies, sim.nodes
    near = np.isfinite(b.mass) & (np.abs(b.position[:, 0] - at) < 1.5)
    out = [b.position[near], b.velocity[near]]
    if len(n):
        near = np.abs(n.position[:, 0] - at) < 1.5
        out += [n.position[near], n.velocity[near]]
    return [a - (at if k % 2 == 0 else 0) * np.eye(a.shape[1])[0] for k, a in enumerate(out)]


ALONE = {}


def alone(dim, f):
    if (dim, f.name) not in ALONE:
        ALONE[dim, f.name] = motion(advance(start(dim, [f], {f.name: 0.0}), [f], {f.name: 0.0}), 0.0)
    return ALONE[dim, f.name]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("pair", list(itertools.combinations(FEATURES, 2)), ids=lambda pair: "-".join(f.name for f in pair))
def test_features_far_apart_move_as_alone(pair, dim, tmp_path):
    far = {f.name: 4.0 * k for k, f in enumerate(pair)}
    sim = advance(start(dim, pair, far), pair, far, last=2)
    sim.checkpoint(tmp_path / "middle.h5")
    advance(sim, pair, far, 2)
    for f in pair:
        for ours, own in zip(motion(sim, far[f.name]), alone(dim, f), strict=False):
            assert np.isfinite(ours).all()
            assert np.abs(ours - own).max(initial=0) <= 1e-6 * max(G * H, np.abs(own).max(initial=0))
    again = start(dim, pair, far)
    again.restore(tmp_path / "middle.h5")
    advance(again, pair, far, 2)
    for ours, first in zip(motion(again, 0.0) + motion(again, 4.0), motion(sim, 0.0) + motion(sim, 4.0), strict=True):
        assert np.array_equal(ours, first)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("feature", [f for f in FEATURES if f.build is not pendulum], ids=lambda f: f.name)
def test_features_move_in_a_periodic_cell_as_alone(feature, dim, tmp_path):
    """The border of the cell goes through the bodies."""
    cell = cn.Periodic((4.0,) + (0.0,) * (dim - 1))
    sim = advance(start(dim, [feature], {feature.name: 0.0}, periodic=cell), [feature], {feature.name: 0.0}, last=2)
    sim.checkpoint(tmp_path / "middle.h5")
    again = start(dim, [feature], {feature.name: 0.0}, periodic=cell)
    again.restore(tmp_path / "middle.h5")
    for one in (sim, again):
        advance(one, [feature], {feature.name: 0.0}, 2)
    velocity = np.concatenate([v.ravel() for v in speeds(sim)])
    own = np.concatenate([v.ravel() for v in alone(dim, feature)[1::2]])
    assert np.abs(velocity - own).max() <= 1e-6 * max(G * H, np.abs(own).max())
    assert all(np.array_equal(a, b) for a, b in zip(speeds(sim), speeds(again), strict=True))


def speeds(sim):
    free = np.isfinite(sim.bodies.mass)
    return [sim.bodies.velocity[free], sim.nodes.velocity] if len(sim.nodes) else [sim.bodies.velocity[free]]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", ["bonds", "beams", "zones", "wet", "rolling"])
def test_bodies_come_in_and_go_over_ranks(name, dim):
    """The same bits over 1 and 3 ranks, with bodies that are inserted beside others, driven and removed."""
    feature = next(f for f in FEATURES if f.name == name)
    found = []
    for ranks in (1, 3):
        scene = cn.Scene(dim, gravity=(0.0,) * (dim - 1) + (-G,))
        feature.build(scene, 0.0, feature)
        strategy = cn.NSCD(solver=cn.NLGS(tol=1e-8, max_iter=2000))
        sim = cn.Simulation(scene, H, strategy, overlap="ignore", ranks=ranks)
        for step in range(4):
            if step == 1:
                come_later(sim, 0.0, feature)
            if step == 2:
                go_away(sim, 0.0, feature)
            assert sim.step()["status"] == "converged"
        found.append((sim.bodies.position.copy(), sim.bodies.velocity.copy(), sim.contacts.impulse.copy()))
    for one, other in zip(*found, strict=True):
        assert np.isfinite(one).all() and np.array_equal(one, other)
