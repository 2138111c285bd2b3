"""Scenes of blocks with flat faces: needles and plates, sizes that mix, many sides, many blocks that share one vertex."""

from __future__ import annotations

import cairn as cn
import numpy as np
from scenes import EPSILON, GRAVITY, Watched, force_along, frame, near, ulps

ROCK = cn.Material("rock", density=1000.0)


def box(dim, centre, sizes, **options):
    """A box (dim, n) by its sizes; in 2D a polygon of four sides."""
    if dim == 3:
        return cn.boxes([centre], sizes, ROCK, **options)
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2 * sizes
    return cn.polygons([corners + centre], ROCK, **options)


def block_on_blocks(dim, x, sizes):
    """Two equal blocks on each other and on a floor, `sizes` in units of x.size: reaction = weight, nothing moves."""
    scene, up, place = frame(dim, x)
    sizes = x.size * np.asarray(sizes, float)[-dim:]
    scene.add(box(dim, place + sizes[-1] / 2 * up, sizes), box(dim, place + 1.5 * sizes[-1] * up, sizes))
    scene.add(cn.wall(place, up, ROCK))
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu))
    start = watched.sim.bodies.position[:2]
    sim = watched.run(x.steps)
    weight = sim.bodies.mass[0] * GRAVITY
    on_floor = np.any(sim.contacts.bodies == 2, axis=1)
    force = force_along(sim, up)
    fall = GRAVITY * x.dt * sim.time / sizes.min()
    spread = ulps(x) * x.size / sizes.min()
    return watched.usual() + [
        near("on the floor", force[on_floor].sum() / weight, 2.0, 1e-9),
        near("between", np.abs(force[~on_floor].sum()) / weight, 1.0, 1e-9),
        near("points of contact", np.sum(sim.contacts.gap < 0.5 * sizes[-1]), 4 * (dim - 1), 0.0, scale=1.0),
        near("moved", (sim.bodies.position[:2] - start) / sizes.min(), 0.0, 1e-9 * max(1.0, fall) + spread, scale=1.0),
    ]


def mixed_blocks(dim, x):
    """Blocks of 1e-6 to 1e4 m side by side on a floor: each carried by its own reaction."""
    scene, up, place = frame(dim, x)
    sizes = 10.0 ** np.arange(-6, 5)
    edge = np.cumsum(1.5 * sizes)
    for size, at in zip(sizes, edge):
        centre = place + size / 2 * up
        centre[0] += at
        scene.add(box(dim, centre, np.full(dim, size)))
    scene.add(cn.wall(place, up, ROCK))
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu))
    start = watched.sim.bodies.position[:11]
    sim = watched.run(x.steps)
    pairs = sim.contacts.bodies
    share = np.bincount(np.where(pairs[:, 0] < 11, pairs[:, 0], pairs[:, 1]), np.abs(force_along(sim, up)), 12)[:11]
    moved = (sim.bodies.position[:11] - start) / sizes[:, None]
    return watched.usual() + [
        near("reactions", share / (sim.bodies.mass[:11] * GRAVITY), 1.0, 1e-9),
        near("points of contact", len(pairs), 22 * (dim - 1), 0.0, scale=1.0),
        near("moved", moved, 0.0, 1e-9 + 1e-6 * x.dt * GRAVITY * sim.time / sizes[0], scale=1.0),
    ]


def regular(sides, size):
    """A regular polygon that lies on a side: corners (sides, 2) from its centre."""
    angle = 2 * np.pi * (np.arange(sides) + 0.5) / sides - np.pi / 2
    return size * np.column_stack((np.cos(angle), np.sin(angle)))


def many_sides(dim, x):
    """A polygon, or a prism on it, on its side, and one upside down on top of it: reaction = weight of both."""
    scene, up, place = frame(dim, x)
    corners = regular(x.count, x.size)
    low, high = corners[:, 1].min(), corners[:, 1].max()
    upper = -corners
    centres = [place - low * up, place + (high - 2 * low) * up]
    if x.count % 2 == 0:  # both lie on sides; of an odd number, vertex on vertex would fall
        centres[1] = place - 3 * low * up
    for shape, centre in zip((corners, upper), centres if x.count % 2 == 0 else centres[:1]):
        if dim == 2:
            scene.add(cn.polygons([shape + centre], ROCK))
        else:
            scene.add(cn.polyhedra([prism(shape, x.size, centre)], ROCK))
    n = 2 - x.count % 2
    scene.add(cn.wall(place, up, ROCK))
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu))
    start = watched.sim.bodies.position[:n]
    sim = watched.run(x.steps)
    force = force_along(sim, up)[np.any(sim.contacts.bodies == n, axis=1)]
    return watched.usual() + [
        near("reaction", force.sum() / (sim.bodies.mass[:n].sum() * GRAVITY), 1.0, 1e-9),
        near("moved", (sim.bodies.position[:n] - start) / x.size, 0.0, 1e-9, scale=1.0),
    ]


def prism(corners, depth, centre):
    """A polygon in the plane of x and z, drawn out along y."""
    m = len(corners)
    y = np.repeat([-depth / 2, depth / 2], m)
    vertices = np.column_stack((np.tile(corners[:, 0], 2), y, np.tile(corners[:, 1], 2))) + centre
    k = np.arange(m)
    sides = np.column_stack(((k + 1) % m, k, k + m, (k + 1) % m + m))
    return vertices, [k, k[::-1] + m, *sides]


def shared_vertex(dim, x):
    """All blocks meet in one vertex, slices of a disk or of a ring about an axis, or pyramids: they fall as one, unharmed."""
    scene, up, place = frame(dim, x)
    angle = 2 * np.pi * np.arange(x.count + 1) / x.count
    rim = x.size * np.column_stack((np.cos(angle), np.sin(angle)))
    if dim == 2:
        scene.add(cn.polygons([np.array([[0, 0], rim[k], rim[k + 1]]) + place for k in range(x.count)], ROCK))
    else:
        meshes = [(cone(rim[k], rim[k + 1], x.size) + place, PYRAMID) for k in range(x.count)]
        scene.add(cn.polyhedra(meshes, ROCK))
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu))
    sim = watched.run(x.steps)
    speed = GRAVITY * sim.time
    impulse = np.abs(sim.contacts.impulse).max() if len(sim.contacts.gap) else 0.0
    return watched.usual() + [
        near("speed", sim.bodies.velocity[:, :dim] / speed, -up, 1e-9, scale=1.0),
        near("impulse over weight", impulse / (sim.bodies.mass[0] * speed), 0.0, 1e-9, scale=1.0),
        near("overlap", min(0.0, sim.contacts.gap.min()) / x.size, 0.0, 64 * EPSILON, scale=1.0),
        near("touch", np.sum(sim.contacts.gap < 1e-12 * x.size) >= x.count * (x.count - 1) / 2, 1.0, 0.0, scale=1.0),
    ]


PYRAMID = [[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]]


def cone(p, q, height):
    """A tetrahedron on the slice from 0 to p and q."""
    return np.array([[0, 0, 0], [*p, 0], [*q, 0], [*(p + q) / 2, height]])


BOARD = [
    (
        block_on_blocks,
        (2, 3),
        "stand",
        "reactions = weight above within 10 tol, all points of both faces, moved by no more than 10 tol of a free fall",
        {
            "none": dict(sizes=(1, 1, 1)),
            "aspect 1e4, lying": dict(sizes=(1e4, 1e4, 1)),
            "aspect 1e4, standing": dict(sizes=(1, 1, 1e4)),
            "size 1e-6 m": dict(sizes=(1, 1, 1), size=1e-6),
            "size 1e4 m": dict(sizes=(1, 1, 1), size=1e4),
            "1e8 m off, scene.origin there": dict(sizes=(1, 1, 1), shift=1e8, origin=True),
            "1e8 m off, no origin": dict(sizes=(1, 1, 1), shift=1e8, size=0.5),
            "mu 0": dict(sizes=(1, 1, 1), mu=0.0),
            "step x 1e3": dict(sizes=(1, 1, 1), step=1e3),
            "step x 1e-3": dict(sizes=(1, 1, 1), step=1e-3),
        },
    ),
    (
        mixed_blocks,
        (2, 3),
        "rest",
        "each reaction = its weight within 10 tol",
        {"sizes 1e-6 to 1e4 m": dict(size=1e-6, steps=5, tol=1e-14)},
    ),
    (
        many_sides,
        (2, 3),
        "rest",
        "reaction = weight within 10 tol",
        {f"{n} sides": dict(count=n) for n in (3, 4, 100, 501)} | {"1000 sides": dict(count=1000)},
    ),
    (
        shared_vertex,
        (2, 3),
        "fall as one",
        "v = g t, no impulse, every pair touches, within 10 tol",
        {"60 blocks in one vertex": dict(count=60, steps=2)},
    ),
]
LARGE = [(shared_vertex, dim, "1000 blocks in one vertex", dict(count=1000, steps=2)) for dim in (2, 3)]
