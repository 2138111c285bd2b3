"""Dense packs of polygons and polyhedra end their steps early; blocks that bear on faces do not, and keep their bits."""

import cairn as cn
import numpy as np
import pytest
from cairn.pre import masonry, stones

ROCK = cn.Material("rock", density=2000.0)


def pressed(dim):
    """Rocks of about a metre between walls, pressed by a lid of a tenth of their mass with 20 times their weight."""
    count = 100 if dim == 2 else 60
    rng = np.random.default_rng(7)
    sizes = rng.uniform(0.8, 1.2, count)
    make = stones.random_polygons if dim == 2 else stones.random_polyhedra
    rocks = make(count, sizes, angularity=0.8, rng=rng)
    width = 9.0 if dim == 2 else 3.6
    places, turns = stones.loose(rocks, (0,) * dim, (width,) * (dim - 1) + (99.0,), rng)
    up = np.eye(dim)[-1]
    scene = cn.Scene(dim, gravity=(0,) * dim)
    scene.add((cn.polygons if dim == 2 else cn.polyhedra)(rocks, ROCK, position=places, rotation=turns))
    scene.add(cn.wall((0,) * dim, up, ROCK))
    for axis in np.eye(dim)[:-1]:
        scene.add(cn.wall((0,) * dim, axis, ROCK), cn.wall(width * axis, -axis, ROCK))
    mass = 2000.0 * count * 0.5
    lid = dict(mass=0.1 * mass, free="vy" if dim == 2 else "vz", force=-200.0 * mass * up)
    scene.add(cn.wall((places[:, -1].max() + 0.7) * up, -up, ROCK, **lid))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 1e-3, overlap="ignore")


@pytest.mark.parametrize("dim", [2, 3])
def test_packs_of_faces_end_their_steps_early(dim):
    """Steps end at 1e-3 after 50 sweeps, all converge, overlap stays small, and the balance of energy closes."""
    sim = pressed(dim)
    told = [dict(sim.step()) for _ in range(500)]
    early = [info for info in told if info["error"] > 1e-4]
    assert all(info["status"] == "converged" for info in told)
    assert len(early) > 20 and max(info["error"] for info in early) <= 1e-3
    assert all(info["iterations"] >= 50 for info in early)
    assert max(info["penetration"] for info in told[-100:]) < 0.02
    assert abs(sim.energy["closure"]) < 1e-11 * sim.energy["in_play"]


def standing(kind):
    """A wall on which a block is pulled along, or a vault whose supports move apart: more than 100 contacts."""
    stone = cn.Material("stone", density=2200.0)
    vault = kind == "vault"
    blocks = masonry.barrel_vault(2.0, 4, radius=3.0, thickness=0.45, voussoirs=11) if vault else masonry.panel(8, 6)
    scene = cn.Scene(blocks.dim, gravity=(0,) * (blocks.dim - 1) + (-9.81,))
    sets, _ = blocks.sets(stone)
    if vault:
        sides = np.sign(sets[1].position[:, :1])
        sets[1] = sets[1].with_(drive=lambda t: sides * np.array([0.02, 0, 0, 0, 0, 0]))
    scene.add(*sets)
    if not vault:
        load = scene.add(cn.polygons([[[2, 6], [3, 6], [3, 7], [2, 7]]], stone, density=1e4))
    scene.interact("*", "*", cn.Coulomb(mu=0.6))
    return (scene, None if vault else load)


@pytest.mark.parametrize("kind", ["wall", "vault"])
def test_masonry_keeps_its_tolerance_and_its_bits(kind):
    """Blocks that bear on faces are no pack: a step is one of a solver whose tolerance was named."""
    ends = []
    for solver in (cn.Default(), cn.Default(tol=1e-4)):
        scene, load = standing(kind)
        sim = cn.Simulation(scene, 2e-3, cn.NSCD(solver=solver))
        if load is not None:
            sim.drive(load, "vx", 0.3)
        errors = [sim.step()["error"] for _ in range(60)]
        assert max(errors) <= 1e-4 and len(sim.contacts.gap) > 100
        ends.append(sim.bodies.position.copy())
    assert np.array_equal(*ends)
