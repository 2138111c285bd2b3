"""Nodes of meshes that slide past the rims of flat sides: held as far as a quarter of a cell; what falls beside falls."""

import cairn as cn
import numpy as np
import pytest
from second_order import box

SKIN = cn.Material("skin", density=1.0)
YOUNG, PRESSURE = 0.2, 0.02
KINDS = [("quad", 2), ("hexahedron", 3), ("tetra", 3)]


def soft_block(kind, dim, level, n=3, size=1.0):
    """Points and cells of a block above `level`, and its groups."""
    points, cells = box(kind, (n,) * dim, (size,) * dim)
    points[:, -1] += level
    low, high = np.isclose(points, points.min(axis=0)), np.isclose(points, points.max(axis=0))
    groups = {"bot": np.flatnonzero(low[:, -1]), "top": np.flatnonzero(high[:, -1])}
    return points, cells, groups | {"outside": np.flatnonzero((low | high).any(axis=1))}


def stiff_below(under, kind, dim):
    """A block of the same outline below 0: a mesh, a rigid body or a surface."""
    if under == "mesh":
        points, cells, groups = soft_block(kind, dim, -1.0)
        body = cn.SolidBody(points, cells, cn.NeoHookean(young=1.0, poisson=0.45), density=1e-3, groups=groups, rayleigh=(0.5, 0))
        return cn.deformable(body, SKIN, fixed={"bot": "xyz"[:dim]}, **{"edges" if dim == 2 else "faces": "top"})
    if under == "surface":
        corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
        return cn.surface(corners, [[0, 1, 2], [0, 2, 3]], SKIN)
    if dim == 2:
        return cn.polygons([[[0, -1], [1, -1], [1, 0], [0, 0]]], SKIN, fixed=True)
    return cn.boxes([[0.5, 0.5, -0.5]], (1, 1, 1), SKIN, fixed=True)


def pressed(under, kind, dim, mu=0.0, mortar=False):
    """A soft block on a stiff one of the same outline, pressed; (status, share of its nodes that press, sink, force)."""
    points, cells, groups = soft_block(kind, dim, 0.0)
    body = cn.SolidBody(points, cells, cn.NeoHookean(young=YOUNG, poisson=0.45), density=1e-3, groups=groups, rayleigh=(0.5, 0))
    scene = cn.Scene(dim=dim)
    scene.add(stiff_below(under, kind, dim))
    sides = {"edges" if dim == 2 else "faces": "bot"} if mortar else {}
    scene.add(cn.deformable(body, SKIN, contact="bot", pressure={"top": PRESSURE}, fixed={"top": "xyz"[: dim - 1]}, mortar=mortar,
                            **sides))  # fmt: skip
    scene.interact(SKIN, SKIN, cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, 0.02, cn.NSCD(theta=1.0, solver=cn.PPANewton(tol=1e-9)))
    for _ in range(200):
        report = sim.step()
    mesh = sim.meshes[-1]
    force = np.abs(sim.contacts.impulse[:, -1]) / sim.dt
    at = groups["bot"]
    bearing = {int(i) for pair in sim.contacts.bodies[force > 1e-9] for i in pair}
    share = np.mean([int(mesh.ids[k]) in bearing for k in at])
    beyond = np.abs(points[at, :-1] + mesh.displacement[at, :-1] - 0.5).max() - 0.5
    return report["status"], share, -mesh.displacement[groups["top"], -1].mean(), force.sum(), beyond


@pytest.mark.parametrize("kind, dim", KINDS)
@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_flush_blocks_bear_at_their_rims(kind, dim, mu):
    status, share, sink, force, beyond = pressed("mesh", kind, dim, mu)
    assert status == "converged" and share == 1.0
    assert force == pytest.approx(PRESSURE, rel=1e-3)
    assert 0.0 < beyond < 0.1
    assert sink == pytest.approx(pressed("mesh", kind, dim, mu, mortar=True)[2], rel=0.02)


@pytest.mark.parametrize("under, kind, dim", [("rigid", "quad", 2), ("rigid", "hexahedron", 3), ("surface", "tetra", 3)])
def test_they_do_so_on_rigid_bodies(under, kind, dim):
    """Without friction the block is a column under its pressure, whose sink Hooke's law tells at small strains (plane strain)."""
    status, share, sink, force, beyond = pressed(under, kind, dim)
    assert status == "converged" and share == 1.0 and 0.0 < beyond < 0.1
    assert force == pytest.approx(PRESSURE, rel=1e-3)
    assert 0.03 < sink < PRESSURE / YOUNG * 1.1


def dropped(dim, past, wall, own_sides):
    """A block of one cell that falls beside the rim of a mesh, its nodes `past` of a cell beyond it: the way it fell."""
    kind, side = ("quad", "edges") if dim == 2 else ("hexahedron", "faces")
    points, cells, groups = soft_block(kind, dim, 0.05, n=1, size=0.5)
    points[:, 0] += 1.0 + past * 0.5
    body = cn.ElasticBody(points, cells, young=1e4, poisson=0.3, density=1.0, groups=groups)
    scene = cn.Scene(dim=dim, gravity=(0.0,) * (dim - 1) + (-1.0,))
    sides = "top" if wall == "step" else "outside"
    low_points, low_cells, low_groups = soft_block(kind, dim, -1.0)
    low = cn.ElasticBody(low_points, low_cells, young=1e6, poisson=0.3, density=1.0, groups=low_groups)
    low_sides = {side: sides, "contact": sides}
    scene.add(cn.deformable(low, SKIN, fixed={"bot": "xyz"[:dim], "top": "xyz"[:dim]}, **low_sides))
    own = {side: "outside"} if own_sides else {}
    scene.add(cn.deformable(body, SKIN, contact="outside", velocity=(0.0,) * (dim - 1) + (-1.0,), **own))
    scene.interact(SKIN, SKIN, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 5e-3, cn.NSCD(theta=0.5))
    for _ in range(60):
        sim.step()
    return sim.meshes[-1].displacement, sim.time


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("wall", ["step", "whole"])
@pytest.mark.parametrize("own_sides", [False, True])
def test_what_falls_beside_a_rim_falls(dim, wall, own_sides):
    """Faces of the table alone, or its whole outside, with or without sides of the block: nothing is under its nodes."""
    way, time = dropped(dim, 0.15, wall, own_sides)
    assert way[:, -1] == pytest.approx(-time - 0.5 * time**2, rel=1e-9)
    assert np.abs(way[:, :-1]).max() < 1e-9


@pytest.mark.parametrize("dim", [2, 3])
def test_what_slides_off_a_table_falls(dim):
    kind, side = ("quad", "edges") if dim == 2 else ("hexahedron", "faces")
    points, cells, groups = soft_block(kind, dim, 0.0, n=2, size=0.5)
    points[:, 0] += 0.45
    body = cn.SolidBody(points, cells, cn.NeoHookean(young=1e3, poisson=0.3), density=1.0, groups=groups, rayleigh=(1.0, 0))
    low_points, low_cells, low_groups = soft_block(kind, dim, -1.0)
    low = cn.ElasticBody(low_points, low_cells, young=1e5, poisson=0.3, density=1.0, groups=low_groups)
    scene = cn.Scene(dim=dim, gravity=(0.0,) * (dim - 1) + (-1.0,))
    scene.add(cn.deformable(low, SKIN, fixed={"bot": "xyz"[:dim]}, **{side: "top"}))
    scene.add(cn.deformable(body, SKIN, contact="bot", velocity=(1.0,) + (0.0,) * (dim - 1)))
    scene.interact(SKIN, SKIN, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, 5e-3, cn.NSCD(theta=1.0))
    lead, farthest = np.argmax(points[:, 0] - points[:, -1]), 0.0
    for _ in range(400):
        sim.step()
        at = points[lead] + sim.meshes[1].displacement[lead]
        if np.any(sim.contacts.bodies == sim.meshes[1].ids[lead]):
            farthest = max(farthest, at[0] - 1.0)
    assert 0.0 < farthest < 0.25 * 0.25 + 0.01
    assert (points + sim.meshes[1].displacement)[:, -1].max() < 0.0


@pytest.mark.parametrize("dim", [2, 3])
def test_momentum_is_kept_at_rims_and_runs_go_on_to_the_bit(dim, tmp_path):
    """Soft block that moves onto a stiff block of equal outline, both free, with a little shear."""
    kind, side = ("quad", "edges") if dim == 2 else ("hexahedron", "faces")
    scene = cn.Scene(dim=dim)
    given = {}
    for name, level, young, speed in (("low", -1.0, 5.0, 0.1), ("up", 0.0, 0.2, -0.1)):
        points, cells, groups = soft_block(kind, dim, level, n=2)
        body = cn.SolidBody(points, cells, cn.NeoHookean(young=young, poisson=0.45), density=1.0, groups=groups)
        given[name] = points
        touch = {side: "top"} if name == "low" else {"contact": "bot"}
        scene.add(cn.deformable(body, SKIN, name=name, velocity=(-0.2 * speed,) + (0.0,) * (dim - 2) + (speed,), **touch))
    scene.interact(SKIN, SKIN, cn.Coulomb(mu=0.0))

    def simulation():
        return cn.Simulation(scene, 0.02, cn.NSCD(theta=1.0, newton_tol=1e-12, solver=cn.PPANewton(tol=1e-12)))

    def places(sim):
        return [given[mesh.name] + mesh.displacement for mesh in sim.meshes]

    sim, past, worst = simulation(), 0.0, 0.0
    for k in range(60):
        before = places(sim)
        sim.step()
        if k == 20:
            sim.checkpoint(tmp_path / "at_rims")
        forces = [mesh.contact_force for mesh in sim.meshes]
        size = max(np.abs(f).max() for f in forces)
        moment = sum((x[:, 0] * f[:, -1] - x[:, -1] * f[:, 0]).sum() for x, f in zip(before, forces))
        left = max(np.abs(sum(f.sum(axis=0) for f in forces)).max(), abs(moment))
        worst = max(worst, left / size if size > 0 else 0.0)
        low, up = places(sim)
        groups = [mesh.body.groups for mesh in sim.meshes]
        past = max(past, up[groups[1]["bot"], 0].max() - low[groups[0]["top"], 0].max())
    assert past > 0.01 and worst < 1e-11
    again = simulation()
    again.restore(tmp_path / "at_rims")
    for _ in range(39):
        again.step()
    assert all(np.array_equal(a.displacement, b.displacement) for a, b in zip(sim.meshes, again.meshes))


def test_a_fold_of_hexahedra_keeps_apart_at_its_rims():
    """A block with a slot, pressed shut: nodes of the upper rim bulge past the lower one before they meet."""
    points, cells = box("hexahedron", (8, 5, 2), (8.0, 5.0, 2.0))
    middle = points[cells["hexahedron"]].mean(axis=1)
    kept = cells["hexahedron"][~((middle[:, 0] > 2) & (middle[:, 1] > 2) & (middle[:, 1] < 3))]
    used, kept = np.unique(kept, return_inverse=True)
    points, kept = points[used], kept.reshape(-1, 8)
    in_slot = (points[:, 0] >= 2) & (np.isclose(points[:, 1], 2) | np.isclose(points[:, 1], 3))
    groups = {"in": np.flatnonzero(in_slot), "foot": np.flatnonzero(points[:, 1] == 0)}
    groups["tip"] = np.flatnonzero((points[:, 1] == 5) & (points[:, 0] >= 6))
    law = cn.NeoHookean(young=1e5, poisson=0.3)
    body = cn.SolidBody(points, {"hexahedron": kept}, law, density=1000.0, groups=groups, rayleigh=(5.0, 0.0))
    scene = cn.Scene(dim=3)
    scene.add(cn.deformable(body, SKIN, contact="in", faces="in", fixed={"foot": "xyz"}, force={"tip": (0, -1.2e5, 0)},
                            self_contact=True))  # fmt: skip
    scene.interact(SKIN, SKIN, cn.GapCoulomb(mu=0.2))
    sim = cn.Simulation(scene, 1e-2, cn.NSCD(theta=1.0))
    upper = [np.flatnonzero(np.isclose(points, (x, 3.0, z)).all(axis=1))[0] for x in (7, 8) for z in (0, 1, 2)]
    lower = groups["in"][np.isclose(points[groups["in"], 1], 2)]
    deepest = 0.0
    for _ in range(100):
        sim.step()
        x = points + sim.meshes[0].displacement
        for k in upper:  # the height of the lower side there, by its row of nodes across the slot from it
            row = lower[np.isclose(points[lower, 2], points[k, 2])]
            deepest = max(deepest, np.interp(x[k, 0], x[row, 0], x[row, 1]) - x[k, 1])
    assert deepest < 0.4 and len(sim.contacts) > 5  # of a cell: planes of faces that twist go on past their rim; it was 1.27
