"""Mortar contact of meshes in the plane: uniform pressure through any cells, friction, sliding, restart and refusals."""

import cairn as cn
import numpy as np
import pytest
from cell_blocks import block

ROCK = cn.Material("rock", density=1000.0)


def patch(above, below, mortar=True, h=0.1, steps=60, turn=0.0, law=None, shear=0.0, share=None):
    """A block on another under a uniform pressure of 1 kPa, brought to rest by long implicit steps; and the stresses. share: part
    of the load of each node instead of a uniform one. The upper block is held by contacts alone: in each step it falls freely by
    h^2 p/m before they restore it, and its strain is rounded accordingly; with steps of 1 s this was the largest error of the
    stresses, 8e-12."""
    over, under = block((above, 2), (0.0, 0.5), turn=turn), block((below, 2), (0.0, 0.0), turn=turn)
    frame = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    scene = cn.Scene(dim=2)
    nodes = over.groups["top"]
    if share is None:
        share = np.ones(len(nodes)) / (len(nodes) - 1)
        share[[0, -1]] /= 2
    over.groups |= {f"load {k}": [n] for k, n in enumerate(nodes)}
    force = {f"load {k}": tuple(np.array([shear, -1e3]) * s @ frame) for k, s in enumerate(share)}
    own = {"edges": "bottom", "mortar": True} if mortar else {}
    over.groups["corner"] = over.groups["left"][-1:] if not shear else []
    fixed = {"fixed": {"corner": "x"}} if not (shear or turn) else {}
    under.groups["corner"] = under.groups["left"][:1]
    held = {"bottom": "y", "corner": "xy"} if not (turn or shear) else {"bottom": "xy"}
    scene.add(cn.deformable(over, ROCK, contact="bottom", force=force, name="over", **own, **fixed))
    scene.add(cn.deformable(under, ROCK, edges="top", fixed=held, name="under"))
    scene.interact(ROCK, ROCK, law or cn.GapCoulomb(mu=0.0))
    sim = cn.Simulation(scene, h, cn.NSCD(1.0, cn.Default(tol=1e-14)), overlap="ignore")
    for _ in range(steps):
        report = sim.step()
    assert report["contacts"] == above + 1 or not mortar
    stress = np.concatenate([m.stress["quad"] for m in sim.meshes])
    return sim, stress


@pytest.mark.parametrize("cells", [(2, 3), (3, 3), (5, 3), (7, 4), (9, 9)])
def test_a_uniform_pressure_goes_through_exactly(cells):
    """The contact patch test: of 2 cells on 3 forces are 1/6 1/3 1/3 1/6 on the nodes below."""
    sim, stress = patch(*cells)
    assert np.abs(stress - [0.0, -1e3, 0.0]).max() < 1e-12 * 1e3
    force = -sim.meshes[1].contact_force[sim.meshes[1].body.groups["top"], 1] / 1e3
    n = cells[1]
    assert np.abs(force - np.concatenate([[0.5], np.ones(n - 1), [0.5]]) / n).max() < 1e-13


@pytest.mark.parametrize("cells", [(2, 3), (5, 3), (7, 4), (2, 9)])
def test_each_row_gives_what_it_takes(cells):
    """Sums of D and M over a row are the same: loads that differ press the rows by independent impulses, and of each the forces
    on both meshes have no sum, to 1e-14."""
    rows, pressed = cells[0] + 1, []
    for k in range(rows):
        share = np.full(rows, 0.5 / rows)
        share[k] += 0.5
        sim, _ = patch(*cells, share=share, steps=1)
        own, other = (mesh.contact_force for mesh in sim.meshes)
        assert np.abs(own.sum(axis=0) + other.sum(axis=0)).max() < 1e-14 * np.abs(own).sum()
        pressed.append(own[sim.meshes[0].body.groups["bottom"], 1] / 1e3)
    assert np.linalg.cond(pressed) < 1e3


def test_nodes_on_edges_do_not_pass_it():
    """Counterexample without mortar: node-to-segment contact of the same 2 cells on 3 gives nearly 1/4 to each node below."""
    sim, stress = patch(2, 3, mortar=False)
    force = -sim.meshes[1].contact_force[sim.meshes[1].body.groups["top"], 1] / 1e3
    assert np.abs(force - 0.25).max() < 0.05 and np.abs(stress - [0.0, -1e3, 0.0]).max() > 100


def test_a_turned_patch_sticks_by_friction():
    """The whole turned by 30 degrees, sheared by half of the limit of friction: the sum over the side below is the load."""
    sim, _ = patch(5, 3, turn=0.5, law=cn.GapCoulomb(mu=0.5), shear=250.0, h=5.0, steps=60)
    along = np.array([np.cos(0.5), np.sin(0.5)])
    total = sim.meshes[1].contact_force.sum(axis=0)
    assert np.abs(total @ along - 250.0) < 1e-6 and np.all(sim.contacts.status != 2)
    assert np.abs(total @ [-along[1], along[0]] + 1e3) < 1e-6


def sliding(mu, push, steps=200, h=2e-3):
    """The simulation, and the impulse of its contacts on the block above."""
    over, under = (
        block((6, 2), (1.0, 0.5), rayleigh=(0.0, 2e-3)),
        block((9, 2), (0.0, 0.0), size=(3.0, 0.5), rayleigh=(0.0, 2e-3)),
    )
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    scene.add(cn.deformable(over, ROCK, contact="bottom", edges="bottom", mortar=True, force={"top": (push, 0.0)}, name="over"))
    scene.add(cn.deformable(under, ROCK, edges="top", fixed={"bottom": "xy"}, name="under"))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, h, cn.NSCD(0.5, cn.Default(tol=1e-12)))
    total = np.zeros(2)
    for _ in range(steps):
        sim.step()
        total += sim.meshes[0].contact_force.sum(axis=0) * h
        assert np.abs(sim.meshes[0].contact_force.sum(axis=0) + sim.meshes[1].contact_force.sum(axis=0)).max() < 1e-9
    return sim, total


def test_a_block_slides_over_sides_by_coulombs_law():
    """Over other cells than its own: friction is mu times the normal impulse, momentum passes whole, energy closes."""
    sim, total = sliding(0.3, 2500.0)
    over = sim.meshes[0]
    p = (over.body.M @ over.velocity.ravel()).reshape(-1, 2).sum(axis=0)
    assert np.abs(p - total - [2500.0 * sim.time, -5000.0 * sim.time]).max() < 1e-9 * 1000
    assert -total[0] == pytest.approx(0.3 * total[1], rel=0.06) and total[1] == pytest.approx(5000.0 * sim.time, rel=0.02)
    energy = sim.info["energy"]
    assert abs(energy["closure"]) < 1e-11 * energy["in_play"] and energy["dissipated_friction"] > 0
    held, _ = sliding(1.5, 2500.0)
    bottom = held.meshes[0].displacement[held.meshes[0].body.groups["bottom"], 0]
    assert np.abs(bottom).max() < 0.1 * np.abs(over.displacement[over.body.groups["bottom"], 0]).min()


def graded(half, fine, n):
    """From 0 to half, n equal steps up to fine and growing ones behind."""
    x = list(np.linspace(0.0, fine, n + 1))
    while x[-1] < half:
        x.append(x[-1] + 1.35 * (x[-1] - x[-2]))
    x = np.array(x)
    x[x > fine] = fine + (x[x > fine] - fine) * (half - fine) / (x[-1] - fine)
    return x


def half_disk(n, b, radius, turned):
    """A block of 25 b, with sides of b / 10 or so near the middle of its face, which is round unless it is turned."""
    half = 25 * b
    x, y = graded(half, 1.5 * b, n), graded(half, b, n * 7 // 10)
    points = np.stack(np.meshgrid(np.concatenate([-x[:0:-1], x]), y, indexing="ij"), -1)
    k = np.arange(points[..., 0].size).reshape(points.shape[:2])
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)
    points = points.reshape(-1, 2)
    if turned:
        points, quads = points * (1, -1), quads[:, ::-1]
    else:
        points[:, 1] += points[:, 0] ** 2 / (2 * radius) * (1 - points[:, 1] / half)
    groups = {"face": k[:, 0], "base": k[:, -1], "middle": k[len(x) - 1]}
    return cn.ElasticBody(points, {"quad": quads}, young=1e9, poisson=0.3, density=1000.0, groups=groups)


def shares(x):
    """Tributary length of each node on a line."""
    return np.convolve(np.diff(x), [0.5, 0.5])


def test_hertz_on_a_line_between_cells_of_other_sizes():
    """A round face on a flat one of the same material: pressure p0 sqrt(1 - (x / b)^2), p0 = 2 P / (pi b), within 2 %."""
    b, radius, stiffness = 0.01, 1.0, 1e9 / (2 * (1 - 0.3**2))
    load = b * b * np.pi * stiffness / (4 * radius)
    over, under = half_disk(16, b, radius, False), half_disk(11, b, radius, True)
    base = over.groups["base"]
    share = shares(over.points[base, 0])
    over.groups |= {f"load {k}": [node] for k, node in enumerate(base)}
    force = {f"load {k}": (0.0, -load * s) for k, s in enumerate(share / share.sum())}
    scene = cn.Scene(dim=2)
    scene.add(
        cn.deformable(over, ROCK, contact="face", edges="face", mortar=True, fixed={"middle": "x"}, force=force, name="over")
    )
    scene.add(cn.deformable(under, ROCK, edges="face", fixed={"base": "xy"}, name="under"))
    scene.interact(ROCK, ROCK, cn.GapCoulomb(mu=0.0))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(1.0, cn.Default(tol=1e-8)), overlap="ignore")
    for _ in range(60):
        sim.step()
    x = over.points[over.groups["face"], 0]
    found = sim.meshes[0].contact_force[over.groups["face"], 1] / shares(x)
    p0, inside = 2 * load / (np.pi * b), np.abs(x) < 0.8 * b
    exact = p0 * np.sqrt(np.maximum(0.0, 1 - (x / b) ** 2))
    assert np.abs(found - exact)[inside].max() < 0.02 * p0 and found.max() == pytest.approx(p0, rel=0.01)


def test_a_coarse_side_may_be_the_one_that_asks():
    """Its nodes face more than four nodes of the other: what a contact rests on is their mean."""
    sim, stress = patch(2, 9)
    assert np.abs(stress - [0.0, -1e3, 0.0]).max() < 1e-12 * 1e3
    with pytest.raises(ValueError, match="the edges between them: give contact and edges of that side"):
        cn.deformable(block((2, 2), (0.0, 0.0)), ROCK, contact="bottom", mortar=True)


def test_the_normal_of_a_corner_is_the_mean_of_its_sides():
    """Sides of 0.4 and, at a slope of 0.2, 0.6 across: weighted by the overlap of each with the other mesh."""
    x, y = np.array([0.0, 0.4, 1.0]), np.array([0.52, 0.52, 0.64])
    points = np.concatenate([np.stack([x, y], 1), np.stack([x, y + 0.5], 1)])
    given = {"young": 1e6, "poisson": 0.3, "density": 1000.0, "plane": "stress"}
    over = cn.ElasticBody(points, {"quad": np.array([[0, 1, 4, 3], [1, 2, 5, 4]])}, groups={"bottom": [0, 1, 2]}, **given)
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(over, ROCK, contact="bottom", edges="bottom", mortar=True, name="over"))
    scene.add(cn.deformable(block((3, 2), (-0.5, 0.0), (2.0, 0.5)), ROCK, edges="top", fixed={"bottom": "xy"}, name="under"))
    scene.interact(ROCK, ROCK, cn.GapCoulomb(mu=0.0))
    sim = cn.Simulation(scene, 1e-9, cn.NSCD(1.0, margin=0.3), overlap="ignore")
    sim.step()
    long = 0.6 * np.hypot(1.0, 0.2)
    mean = 0.4 * np.array([0.0, 1.0]) + long * np.array([-0.2, 1.0]) / np.hypot(1.0, 0.2)
    assert len(sim.contacts.gap) == 3
    assert np.abs(sim.contacts.normal[1] - mean / np.linalg.norm(mean)).max() < 1e-12


@pytest.mark.parametrize("cells", [(2, 2), (3, 3), (4, 4), (4, 2), (2, 4)])
def test_a_joint_spends_its_work_where_nodes_face_nodes(cells):
    """Drawn apart: which edge is nearest to a node changes from step to step, its bond stays the one it was; 10 J/m2."""
    size, stiff = (0.1, 0.05), dict(young=1e13, poisson=0.0, lumped=True)
    over, under = block((cells[0], 1), (0.0, 0.05), size, **stiff), block((cells[1], 1), (0.0, 0.0), size, **stiff)
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(over, ROCK, contact="bottom", edges="bottom", mortar=True, drive={"top": {"y": 0.02}},
                            velocity=(0.0, 0.02), name="over"))  # fmt: skip
    scene.add(cn.deformable(under, ROCK, edges="top", fixed={"bottom": "xy"}, name="under"))
    scene.interact(ROCK, ROCK, cn.MP3(normal_stiffness=1e12, tangential_stiffness=1e12, strength=2e6, work=10.0))
    sim = cn.Simulation(scene, 4e-6, cn.NSCD(solver=cn.NLGS(tol=1e-8, max_iter=5000), theta=1.0), overlap="ignore")
    before = np.ones(cells[0] + 1)
    for _ in range(150):
        assert sim.step()["status"] == "converged"
        beta = sim.contacts.beta
        assert beta.max() == 0 or np.all(beta <= before)
        before = beta if len(beta) == cells[0] + 1 else np.zeros(cells[0] + 1)
    assert sim.info["energy"]["released"] == pytest.approx(10.0 * 0.1, rel=1e-6)
