"""Bonds that slide from a side of a body or mesh to the next keep their damage: coplanar sides act like a single side."""

import cairn as cn
import numpy as np
import pytest

STONE, BASE = cn.Material("stone", density=1e8), cn.Material("base", density=1000.0)
ZONE = dict(normal_stiffness=1e9, tangential_stiffness=1e7, mu=0.3, normal_strength=1e7, tangential_strength=2e4, normal_work=1e6,
            tangential_work=60.0)  # fmt: skip
SHARP = cn.NLGS(tol=1e-10, max_iter=5000)
SPEED, BEGIN = 0.05, -1e-3  # the next side begins at 0


def block(dim, cuts):
    """A mesh whose top has its sides between `cuts`."""
    x, side = np.array(cuts), np.array([-0.5, 0.5])[: 2 * (dim - 2)]
    of = np.arange(len(x) * 2 ** (dim - 1)).reshape((len(x),) + (2,) * (dim - 1))
    if dim == 2:
        points = np.array([[a, y] for a in x for y in (-0.1, 0.0)])
        cells = {"quad": np.stack([of[:-1, 0], of[1:, 0], of[1:, 1], of[:-1, 1]], axis=-1)}
    else:
        points = np.array([[a, b, z] for a in x for b in side for z in (-0.1, 0.0)])
        layers = of[..., 0], of[..., 1]
        cells = {"hexahedron": np.stack([q for p in layers for q in (p[:-1, 0], p[1:, 0], p[1:, 1], p[:-1, 1])], axis=-1)}
    groups = {"all": np.arange(len(points)), "top": of[..., 1].ravel()}
    return cn.ElasticBody(points, cells, young=1e11, poisson=0.0, density=1000.0, groups=groups)


def ball(dim, up=0.0):
    """Heavy, so that it goes on as it began."""
    make, z = (cn.disks, [BEGIN, 0.1]) if dim == 2 else (cn.spheres, [BEGIN, 0.013, 0.1])
    free = [SPEED] + [0.0] * (2 if dim == 2 else 5)
    force = [0.0] * len(free)
    force[dim - 1] = up
    return make([z], 0.1, STONE, velocity=[free], force=tuple(force), driven=("w",) if dim == 2 else ("wx", "wy", "wz"))


def plate(dim):
    """A mesh of one cell that is drawn along, bonded at the middle of its lower side."""
    x, middle = np.array([BEGIN - 0.05, BEGIN + 0.05]), 4 if dim == 3 else 2
    of = np.arange(2**dim).reshape((2,) * dim)
    if dim == 2:
        points, cells = np.array([[a, y] for a in x for y in (0.0, 0.1)]), {"quad": [[0, 2, 3, 1]]}
    else:
        points = np.array([[a, y, z] for a in x for y in (-0.05, 0.06) for z in (0.0, 0.1)])
        cells = {"hexahedron": [[of[i, j, k] for k in (0, 1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]]}
    below = of[..., 0].ravel()
    groups = {"all": np.arange(len(points)), "bottom": below}
    body = cn.ElasticBody(points, {k: np.array(v) for k, v in cells.items()}, young=1e11, poisson=0.0, density=1e8, groups=groups)
    drawn = dict(zip("xyz", (SPEED, 0.0, 0.0)[:dim]))
    return cn.deformable(body, STONE, name="upper", points=(below[None], np.full((1, middle), 1 / middle)), drive={"all": drawn},
                         **{"edges" if dim == 2 else "faces": "bottom"})  # fmt: skip


def followed(dim, base, upper, cuts, up=0.0):
    """Adhesion in each step, while it slides by 2 mm beyond the end of the first side; energies at the end."""
    scene = cn.Scene(dim)
    if base == "mesh":
        sides = {"edges" if dim == 2 else "faces": "top"}
        scene.add(cn.deformable(block(dim, cuts), BASE, name="lower", fixed={"all": "xyz"[:dim]}, **sides))
    else:
        n = len(cuts)
        points = np.array([[x, y, 0.0] for x in cuts for y in (-0.5, 0.5)])
        scene.add(cn.surface(points, [f for k in range(0, 2 * n - 2, 2) for f in ([k, k + 2, k + 3], [k, k + 3, k + 1])], BASE))
    scene.add(ball(dim, up) if upper == "ball" else plate(dim))
    if upper == "ball":
        scene.interact(STONE, BASE, cn.MAL(**ZONE))
    else:
        scene.interact("lower edges" if dim == 2 else "lower faces", "upper", cn.MAL(**ZONE))
    sim = cn.Simulation(scene, 2e-4, cn.NSCD(solver=SHARP), overlap="ignore")
    found = []
    for _ in range(300):
        assert sim.step()["status"] == "converged"
        found.append(sim.contacts.beta.max())
        energy = sim.info["energy"]
        assert abs(energy["closure"]) < 1e-10 * energy["in_play"]
    assert np.count_nonzero(sim.contacts.beta) == 1
    return np.array(found), energy["released"], energy["stored"]


@pytest.mark.parametrize(("dim", "base", "upper"), [(2, "mesh", "ball"), (2, "mesh", "point"), (3, "mesh", "ball"),
                                                    (3, "mesh", "point"), (3, "surface", "ball")])  # fmt: skip
def test_a_bond_goes_on_from_one_side_to_the_next(dim, base, upper):
    """Bonds behave as on a single longer side."""
    beta, released, stored = followed(dim, base, upper, [-0.5, 0.5])
    across, spent, held = followed(dim, base, upper, [-0.5, 0.0, 0.5])
    assert beta[-1] < 0.8 and np.all(np.diff(across) <= 0)
    assert np.allclose(across, beta, atol=1e-3)
    assert spent == pytest.approx(released, rel=0.01)
    assert held == pytest.approx(stored, rel=0.01)


def test_a_bond_that_is_drawn_goes_on():
    """In tension by a third of its strength."""
    area = np.pi * 0.1**2
    beta, *_ = followed(3, "surface", "ball", [-0.5, 0.5], up=area * 3e6)
    across, *_ = followed(3, "surface", "ball", [-0.5, 0.0, 0.5], up=area * 3e6)
    assert beta[-1] < 0.9 and np.allclose(across, beta, atol=1e-3)


def test_each_of_two_bonds_goes_on_where_it_looks():
    """A ball moves along a gutter and away from one wall: the bond there opens, the other slides."""
    found = []
    for cuts in ([-0.5, 0.5], [-0.5, 0.0, 0.5]):
        n = len(cuts)
        points = np.array([[x, y, abs(y)] for x in cuts for y in (-1.0, 0.0, 1.0)])
        walls = [(0, 1), (1, 0)]  # the second strip has them in another order
        faces = [f for k in range(n - 1) for w in walls[k] for j in (3 * k + w,) for f in ([j, j + 3, j + 4], [j, j + 4, j + 1])]
        scene = cn.Scene(3)
        scene.add(cn.surface(points, faces, BASE))
        off = 0.02 / np.sqrt(2)
        scene.add(cn.spheres([[BEGIN, 0.0, 0.1 * np.sqrt(2)]], 0.1, STONE, velocity=[[SPEED, off, off, 0, 0, 0]],
                             driven=("wx", "wy", "wz")))  # fmt: skip
        scene.interact(STONE, BASE, cn.MAL(**{**ZONE, "normal_stiffness": 3e7, "normal_strength": 2e4, "normal_work": 60.0}))
        sim = cn.Simulation(scene, 2e-4, cn.NSCD(solver=SHARP), overlap="ignore")
        sim.step()
        assert np.count_nonzero(sim.contacts.beta) == 2
        for _ in range(299):
            assert sim.step()["status"] == "converged"
        beta, wall = sim.contacts.beta, np.sign(sim.contacts.normal[:, 1])
        found.append([beta[wall == side].max() for side in (-1, 1)])
    assert np.allclose(found[1], found[0], atol=2e-3)
    assert min(found[0]) > 0.02 and abs(found[0][0] - found[0][1]) > 0.05


def test_a_side_of_another_law_takes_no_bond_over():
    """The bond is lost there, and the balance counts its energy."""
    other = cn.Material("other", density=1000.0)
    scene = cn.Scene(3)
    scene.add(cn.deformable(block(3, [-0.5, 0.0, 0.5]), BASE, fixed={"all": "xyz"}, faces="top", face_material=[BASE, other]))
    scene.add(ball(3))
    scene.interact(STONE, BASE, cn.MAL(**ZONE))
    scene.interact(STONE, other, cn.MP(normal_stiffness=1e9, tangential_stiffness=1e7, work=60.0))
    sim = cn.Simulation(scene, 2e-4, cn.NSCD(solver=SHARP), overlap="ignore")
    for step in range(150):
        assert sim.step()["status"] == "converged"
        energy = sim.info["energy"]
        assert (sim.contacts.beta.max() > 0) == (step < 100) or abs(step - 100) < 2
        assert abs(energy["closure"]) < 1e-10 * energy["in_play"]
    assert energy["stored"] == 0
