"""Laws in the plane and in space, between grains, a grain and a wall, a mesh and a wall: bonds break at their strength, wear
follows Archard, rolling is resisted by its moment."""

import cairn as cn
import numpy as np
import pytest

STONE, BASE = cn.Material("stone", density=1000.0), cn.Material("base", density=1000.0)
R, SIDE = 0.1, 0.2
SOLVERS = (cn.NLGS(tol=1e-10, max_iter=5000), cn.Auto(tol=1e-10))


def size_of(dim, pair):
    """Effective radius [m], area [m2] of the contact."""
    if pair == "mesh":
        return None, SIDE ** (dim - 1)
    r = R / 2 if pair == "grains" else R
    return r, r if dim == 2 else np.pi * r**2


def cell(dim):
    """A block of a single cell on 0, that rests on a point in the middle of its lower side."""
    axes = [np.array([-SIDE / 2, SIDE / 2])] * (dim - 1) + [np.array([0.0, SIDE])]
    points = np.array(np.meshgrid(*axes, indexing="ij")).reshape(dim, -1).T
    of = np.arange(2**dim).reshape((2,) * dim)
    if dim == 2:
        cells = {"quad": np.array([[0, 2, 3, 1]])}
    else:
        cells = {"hexahedron": np.array([[of[i, j, k] for k in (0, 1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]])}
    groups = {"all": np.arange(2**dim), "bottom": of[..., 0].ravel()}
    return cn.ElasticBody(points, cells, young=1e9, poisson=0.0, density=1000.0, groups=groups)


def sides(dim):
    """The wall as something that has sides, of sizes that are no matter."""
    if dim == 2:
        return cn.polygons([[[-0.4, -0.1], [0.3, -0.1], [0.3, 0.0], [-0.4, 0.0]]], BASE, driven=("vx", "vy", "w"))
    return cn.surface([[-0.4, -0.3, 0.0], [0.5, -0.3, 0.0], [0.0, 0.6, 0.0]], [[0, 1, 2]], BASE)


def pulled(dim, pair, law, force, gap=0.0, solver=SOLVERS[0], steps=200, dt=1e-4):
    """True if a body pulled up by a force [N] that grows slowly and then stays does not move."""

    def drawn(t):
        return min(1.0, 2 * t / (steps * dt)) * force * up

    up = np.eye(dim)[-1]
    scene = cn.Scene(dim)
    scene.add(sides(dim) if pair == "sides" else cn.wall(np.zeros(dim), up, BASE))
    held = "vx vy w" if dim == 2 else "vx vy vz wx wy wz"
    make = cn.disks if dim == 2 else cn.spheres
    turns = 1 if dim == 2 else 3
    if pair == "mesh":
        body = cell(dim)
        below = body.groups["bottom"]
        points = (below[None], np.full((1, len(below)), 1 / len(below)))
        scene.add(cn.deformable(body, STONE, name="block", points=points, fixed={"all": "xy"[: dim - 1]},
                                **{"edges" if dim == 2 else "faces": "bottom"}, force=lambda t: {"all": drawn(t)}))  # fmt: skip
    else:
        place = (R + gap) * up
        if pair == "grains":
            scene.add(make([R * up], R, BASE, driven=tuple(held.split())))
            place = place + 2 * R * up
        scene.add(make([place], R, STONE, force=lambda t: (*drawn(t), *np.zeros(turns))))
    scene.interact(STONE, BASE, law)
    scene.interact(BASE, BASE, None)
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=solver), overlap="ignore")
    for _ in range(steps):
        assert sim.step()["status"] == "converged"
        energy = sim.info["energy"]
        assert abs(energy["closure"]) <= 1e-10 * energy["in_play"]  # both are 0 where all has stayed at rest
    z = sim.meshes[0].displacement[below, -1].mean() if pair == "mesh" else sim.bodies.position[-1, -1] - place[-1]
    free = 0.5 * force / (sim.bodies.mass[-1] if pair != "mesh" else 1000.0 * SIDE**dim) * sim.time**2
    return z < 0.002 * free


TENSION = 1e4  # [Pa]
WATER = dict(tension=0.072, volume=1e-9, angle=0.3)
HELD = {  # law and its strength [N] of a radius and an area
    "Wet": (cn.Wet(force=30.0, reach=1e-3, mu=0.3), lambda r, a: 30.0),
    "MohrCoulomb": (cn.MohrCoulomb(tension=TENSION, cohesion=TENSION, mu=0.3), lambda r, a: TENSION * a),
    "MAL": (cn.MAL(normal_stiffness=1e10, tangential_stiffness=1e10, mu=0.3, normal_strength=TENSION, tangential_strength=TENSION,
                   normal_work=0.1, tangential_work=0.1), lambda r, a: TENSION * a),
    "PlasticEXPO": (cn.PlasticEXPO(normal_stiffness=1e10, tangential_stiffness=1e10, mu=0.3, normal_strength=TENSION,
                                   tangential_strength=TENSION, normal_work=0.1, tangential_work=0.1, damage_share=0.5,
                                   normal_spring=2e10, tangential_spring=1e10), lambda r, a: TENSION * a),
    "MACContact": (cn.MACContact(normal_stiffness=1e10, tangential_stiffness=1e10, mu=0.3, work=TENSION**2 / 1e10, stiffness=1e7,
                                 force=1.0, reach=1e-6), lambda r, a: TENSION * a),
    "ParallelBond": (cn.ParallelBond(normal_stiffness=1e10, tangential_stiffness=1e10, tension=TENSION, shear=TENSION, mu=0.3),
                     lambda r, a: TENSION * a * (2 if a == r else 1)),  # a strip of twice the radius, a disk of it
    "Capillary": (cn.Capillary(**WATER, mu=0.3), lambda r, a: 4 * np.pi * r * 0.072 * np.cos(0.3)),
}  # fmt: skip


@pytest.mark.parametrize("pair", ["wall", "sides", "grains", "mesh"])
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", HELD)
def test_what_holds_lets_go_at_its_strength(name, dim, pair):
    law, strength = HELD[name]
    if (name == "Capillary" and (dim == 2 or pair == "mesh")) or (name == "ParallelBond" and pair == "mesh"):
        pytest.skip("of grains" if dim == 3 else "of grains in space")
    most = strength(*size_of(dim, pair))
    for solver in SOLVERS:
        assert pulled(dim, pair, law, 0.97 * most, solver=solver), "gone before its strength"
        assert not pulled(dim, pair, law, 1.03 * most, solver=solver), "held beyond its strength"


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("pair", ["wall", "grains"])
@pytest.mark.parametrize("kind", [cn.Rod, cn.Wire])
def test_rigid_rods_and_wires_break_at_their_strength(kind, pair, dim):
    for factor, holds in ((0.99, True), (1.01, False)):
        assert pulled(dim, pair, kind(strength=50.0, within=0.1), factor * 50.0, gap=0.05) == holds


@pytest.mark.parametrize("dim", [2, 3])
def test_an_elastic_wire_is_drawn_by_its_stiffness(dim):
    """F L/(E A) at rest, L the gap at which it was made; pushed it gives way at once."""
    scene, up = cn.Scene(dim), np.eye(dim)[-1]
    scene.add(cn.wall(np.zeros(dim), up, BASE))
    scene.add((cn.disks if dim == 2 else cn.spheres)([(R + 0.05) * up], R, STONE, force=(*(20.0 * up), *[0.0] * (2 * dim - 3))))
    scene.interact(STONE, BASE, cn.Wire(stiffness=1e4, viscosity=200.0, within=0.1))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=1.0, solver=SOLVERS[0]))
    sim.run(steps=2000, progress=False)
    assert sim.bodies.position[-1, -1] - R - 0.05 == pytest.approx(20.0 * 0.05 / 1e4, rel=1e-6)
    assert np.linalg.norm(sim.bodies.velocity[-1]) < 1e-9 * 20.0 * sim.time / sim.bodies.mass[-1]


@pytest.mark.parametrize("pair", ["wall", "mesh"])
@pytest.mark.parametrize("dim", [2, 3])
def test_what_wears_sinks_as_archard_has_it(dim, pair):
    """A grain drawn along a wall or the side of a mesh sinks by k F s/A. Each impulse wears a gap that the grain falls through
    before the next one, in a rhythm that rounding sets: the rate is taken between means over a hundred steps. The depth at one
    moment lags by the momentum of the grain and by the gap that the last impulse wore."""
    scene, up, wear, force, speed = cn.Scene(dim), np.eye(dim)[-1], 1e-9, 200.0, 0.5
    if pair == "wall":
        scene.add(cn.wall(np.zeros(dim), up, BASE))
    else:
        body = cell(dim)
        places = body.points * ([5.0] * (dim - 1) + [1.0]) - SIDE * up
        groups = {"all": np.arange(2**dim), "top": np.flatnonzero(body.points[:, -1] > 0)}
        body = cn.ElasticBody(places, body.cells, young=1e11, poisson=0.0, density=1000.0, groups=groups)
        scene.add(cn.deformable(body, BASE, fixed={"all": "xyz"[:dim]}, **{"edges" if dim == 2 else "faces": "top"}))
    area = R if dim == 2 else np.pi * R**2
    velocity = [speed] + [0.0] * (2 if dim == 2 else 5)
    dense = cn.Material("dense", density=1e7)
    scene.add((cn.disks if dim == 2 else cn.spheres)([R * up - 0.2 * np.eye(dim)[0]], R, dense, velocity=[velocity],
              driven=("w",) if dim == 2 else ("wx", "wy", "wz"), force=(*(-force * up), *[0.0] * (2 * dim - 3))))  # fmt: skip
    scene.interact(dense, BASE, cn.Wear(mu=0.0, wear=wear))
    sim, sunk, largest, fastest = cn.Simulation(scene, 1e-3, cn.NSCD(solver=SOLVERS[0])), [], 0.0, 0.0
    for _ in range(400):
        assert sim.step()["status"] == "converged"
        sunk.append(R - sim.bodies.position[-1, -1])
        largest = max(largest, np.abs(sim.contacts.impulse).sum())
        fastest = max(fastest, abs(sim.bodies.velocity[-1, dim - 1]))
    assert sim.bodies.velocity[-1, 0] == pytest.approx(speed, rel=1e-9)
    worn = wear * speed / area  # by an impulse of 1 N s
    assert np.mean(sunk[300:]) - np.mean(sunk[:100]) == pytest.approx(worn * force * 300e-3, rel=0.01)
    late = worn * (sim.bodies.mass[-1] * fastest + largest) + 1e-3 * fastest
    assert sunk[-1] == pytest.approx(worn * force * sim.time, abs=late) and late < 0.05 * sunk[-1]


@pytest.mark.parametrize("pair", ["wall", "sides", "grains", "hollow"])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_moment_beyond_that_of_rolling_turns(dim, pair):
    """Limits of moments: `rolling` R N, R the rolling radius and N the normal force; about the normal `twisting` R N. In a tube
    R is that of the ball along it and larger around it, of twisting their geometric mean."""
    press, up, hollow = 100.0, np.eye(dim)[-1], 4 * R
    even, around = {"grains": R / 2}.get(pair, R), R * hollow / (hollow - R)
    radii = [around if dim == 2 else R, around, np.sqrt(R * around)] if pair == "hollow" else [even] * 3
    law = cn.Rolling(mu=0.5, rolling=0.05) if dim == 2 else cn.Rolling(mu=0.5, rolling=0.05, twisting=0.02)
    for axis, most in ((0, 0.05),) if dim == 2 else ((0, 0.05), (1, 0.05), (2, 0.02)):
        for factor, turns in ((0.98, False), (1.02, True)):
            scene = cn.Scene(dim)
            if pair == "hollow":
                wall = (
                    cn.ring((0.0, hollow), hollow, BASE) if dim == 2 else cn.tube((0.0, 0.0, hollow), (0, 1, 0), hollow, BASE)
                )
            scene.add(wall if pair == "hollow" else sides(dim) if pair == "sides" else cn.wall(np.zeros(dim), up, BASE))
            make, held = (cn.disks, ("vx", "vy", "w")) if dim == 2 else (cn.spheres, ("vx", "vy", "vz", "wx", "wy", "wz"))
            place = R * up
            if pair == "grains":
                scene.add(make([place], R, BASE, driven=held))
                place = 3 * place
            moment = np.zeros(2 * dim - 3)
            moment[axis] = factor * most * radii[axis] * press
            scene.add(make([place], R, STONE, force=(*(-press * up), *moment)))
            scene.interact(STONE, BASE, law)
            scene.interact(BASE, BASE, None)
            sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=SOLVERS[0]), overlap="ignore")
            for _ in range(20):
                assert sim.step()["status"] == "converged"
            assert (np.abs(sim.bodies.velocity[-1, dim:]).max() > 1e-9) == turns, (axis, factor)
