"""Auto over ranks beside deformable bodies: contacts on them are gathered on the rank that has them, and solved as without ranks."""

import hashlib

import cairn as cn
import numpy as np
import pytest
from cairn.pre import masonry
from cairn.pre.blocks import Blocks
from test_mesh_ranks import ROCK, RUBBER, block, grains, many_nodes, new, walled

AUTO = cn.NSCD(solver=cn.Auto(tol=1e-4))
SWEEPS = cn.NSCD(solver=cn.NLGS(tol=1e-4))
SQUARE = np.array([(-0.5, -0.25), (0.5, -0.25), (0.5, 0.25), (-0.5, 0.25)])


def heavy(ratio=1e4, material=None):
    """Blocks under one of `ratio` times their mass, on a body that deforms."""
    scene = new(2)
    scene.add(block((6, 2), (0.0, 0.0), (3.0, 1.0), material, name="bed", **({} if material else {"fixed": {"base": "xy"}})))
    scene.add(cn.polygons([SQUARE + (1.5, 1.25 + 0.5 * k) for k in range(4)], ROCK))
    scene.add(cn.polygons([SQUARE + (1.5, 3.25)], ROCK, density=2600.0 * ratio))
    return walled(scene, 1)


def bonded():
    """Blocks bonded to each other and to a deformable body whose base is held, which stand out from it."""
    scene = new(2, cn.Bonded(mu=0.5))
    scene.add(block((4, 8), (0.0, 0.0), (1.0, 2.0), fixed={"base": "xy"}, name="pillar"))
    scene.add(cn.polygons([SQUARE + (1.5 + k, 0.25 + 0.5 * row) for row in range(4) for k in range(4)], ROCK))
    return scene


def bricks():
    """A wall of bonded deformable bricks that stands out from its first ones."""
    blocks = Blocks(2)
    for row in range(4):
        for k in range(4):
            blocks.add_box([k + 0.5 * (row % 2), 0.5 * row], [k + 1 + 0.5 * (row % 2), 0.5 * row + 0.5], "brick")
    blocks.add_box([-1.0, -0.5], [0.9, 0.0], "support")
    scene = new(2, cn.Bonded(mu=0.5))
    masonry.mesh(blocks, 0.25, young=1e8).add_to(scene, ROCK)
    return walled(scene, 1)


def lid():
    """Grains between a slab of a million times their mass and a bed of rubber."""
    scene = new(2)
    scene.add(block((8, 2), (0.0, 0.0), (8.0, 1.0), name="bed"))
    grains(scene, (8, 3), (0.55, 1.5))
    scene.add(cn.polygons([np.array([(0.1, 4.3), (7.9, 4.3), (7.9, 4.8), (0.1, 4.8)])], ROCK, density=2600.0 * 1e3))
    scene.add(cn.wall((8.1, 0), (-1, 0), ROCK))
    return walled(scene, 0, 1)


SCENES = {
    "heavy": heavy,
    "heavy on rubber": lambda: heavy(1e2, RUBBER),
    "bonded": bonded,
    "bricks": bricks,
    "lid": lid,
    "heavier": lambda: heavy(1e6),
    "heavy 30": lambda: heavy(30),
    "heavy 300 rubber": lambda: heavy(3e2, RUBBER),

    "many nodes": many_nodes,
}


def run(scene, ranks, steps, strategy=AUTO, dt=1e-3, **options):
    sim = cn.Simulation(scene(), dt, strategy, overlap="ignore", ranks=ranks, **options)
    ends = []
    for _ in range(steps):
        sim.step()
        ends.append(sim.info["status"])
    return sim, ends


def digest(sim):
    state = [sim.bodies.position, sim.bodies.velocity, sim.nodes.position, sim.nodes.velocity]
    state += [sim.contacts.key, sim.contacts.impulse, np.array(list(sim.energy.values()))]
    return hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in state)).hexdigest()
