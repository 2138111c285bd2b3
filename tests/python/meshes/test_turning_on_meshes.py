"""Moments between rigid bodies and the edges and faces of meshes: friction against rolling and twisting, bonds; sides that cannot
bear a moment are refused by name."""

import cairn as cn
import numpy as np
import pytest

STONE, BASE = cn.Material("stone", density=1000.0), cn.Material("base", density=2000.0)
R, G = 0.1, 9.81
CELLS = {2: ["triangle", "quad"], 3: ["tetra", "hexahedron"]}
KINDS = [(dim, kind) for dim in CELLS for kind in CELLS[dim]]
SOLVERS = (cn.NLGS(tol=1e-10, max_iter=20000), cn.Auto(tol=1e-10))


def block(dim, kind, cells=None, low=None, high=None, young=1e9, lumped=True, warp=0.0):
    """A box of cells; groups top and bottom. warp: of a sine by which nodes are moved, on the top along it."""
    cells = cells or (4,) * (dim - 1) + (2,)
    low = [-0.8] * (dim - 1) + [-0.4] if low is None else low
    high = [0.8] * (dim - 1) + [0.0] if high is None else high
    axes = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, cells)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, dim)
    of = np.arange(len(points)).reshape(*(n + 1 for n in cells))
    corner = [of[tuple(slice(b, b + n) for b, n in zip(bits, cells))].ravel() for bits in np.ndindex(*(2,) * dim)]
    if dim == 2:
        quads = np.stack([corner[k] for k in (0, 2, 3, 1)], -1)
        given = {"quad": quads, "triangle": np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])}
    else:
        hexa = np.stack([corner[k] for k in (0, 4, 6, 2, 1, 5, 7, 3)], -1)
        six = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
        given = {"hexahedron": hexa, "tetra": np.concatenate([hexa[:, list(t)] for t in six])}
    groups = {"top": of[..., -1].ravel(), "bottom": of[..., 0].ravel()}
    points[:, :-1] += warp * np.sin(7 * points[:, 1:] + np.arange(dim - 1))
    return cn.ElasticBody(points, {kind: given[kind]}, young=young, poisson=0.2, density=2000.0, groups=groups, lumped=lumped)


def sides_of(dim):
    return {"edges" if dim == 2 else "faces": "top"}


def ball(dim, place, velocity=(), **more):
    make = cn.disks if dim == 2 else cn.spheres
    return make([place], R, STONE, velocity=[[*velocity, *[0.0] * (3 * dim - 3 - len(velocity))]], **more)


def on_incline(dim, kind, law, tangent, solver, steps=40, h=1e-3, off=0.06):
    """Velocity of a ball that lies on a block that is held below, under gravity that leans."""
    lean = np.arctan(tangent)
    gravity = np.zeros(dim)
    gravity[0], gravity[-1] = G * np.sin(lean), -G * np.cos(lean)
    scene = cn.Scene(dim, gravity=tuple(gravity))
    scene.add(cn.deformable(block(dim, kind), BASE, fixed={"bottom": "xyz"[:dim]}, **sides_of(dim)))
    scene.add(ball(dim, [off] * (dim - 1) + [R]))
    scene.interact(STONE, BASE, law)
    sim = cn.Simulation(scene, h, cn.NSCD(theta=1.0, solver=solver), overlap="ignore")
    for _ in range(steps):
        assert sim.step()["status"] == "converged"
    return sim.bodies.velocity[-1], sim.time, lean


@pytest.mark.parametrize("solver", SOLVERS, ids=["nlgs", "auto"])
@pytest.mark.parametrize("dim, kind", KINDS)
def test_a_ball_rolls_down_a_block_beyond_the_slope_of_its_moment(dim, kind, solver):
    """tan a = rolling, of a moment m g sin a R against rolling R m g cos a; u' = g (sin a - rolling cos a)/(1 + I/(m R2))."""
    rolling = 0.08
    law = cn.Rolling(mu=0.7, rolling=rolling, twisting=rolling)
    stays, time, lean = on_incline(dim, kind, law, 0.97 * rolling, solver)
    assert np.abs(stays[[0, *range(dim, 3 * dim - 3)]]).max() < 1e-3 * G * np.sin(lean) * time
    rolls, time, lean = on_incline(dim, kind, law, 2 * rolling, solver)
    inertia = 0.5 if dim == 2 else 0.4
    speed = G * (np.sin(lean) - rolling * np.cos(lean)) / (1 + inertia) * time
    assert rolls[0] == pytest.approx(speed, rel=5e-3)
    assert abs(rolls[2 if dim == 2 else 4]) * R == pytest.approx(speed, rel=5e-3)


@pytest.mark.parametrize("kind", CELLS[3])
def test_a_sphere_that_spins_on_a_block_stops_as_on_a_wall(kind):
    """Moment `twisting` R m g against angular momentum 2/5 m R^2 w: t = 2 R w/(5 twisting g)."""
    twisting, spin, h = 0.1, 5.0, 1e-3
    stops = {}
    for floor in ("wall", "block"):
        scene = cn.Scene(3, gravity=(0.0, 0.0, -G))
        scene.add(
            cn.wall((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), BASE)
            if floor == "wall"
            else cn.deformable(block(3, kind), BASE, fixed={"bottom": "xyz"}, faces="top")
        )
        scene.add(ball(3, [0.05, 0.07, R], (0.0, 0.0, 0.0, 0.0, 0.0, spin)))
        scene.interact(STONE, BASE, cn.Rolling(mu=0.3, rolling=0.05, twisting=twisting))
        sim = cn.Simulation(scene, h, cn.NSCD(theta=1.0, solver=SOLVERS[0]), overlap="ignore")
        while abs(sim.bodies.velocity[-1, 5]) > 1e-6 * spin and sim.time < 1.0:
            assert sim.step()["status"] == "converged"
        stops[floor] = sim.time
        assert abs(sim.bodies.position[-1, 2] - R) < 1e-3 * R
    assert stops["wall"] == pytest.approx(2 * R * spin / (5 * twisting * G), abs=1.5 * h)
    assert stops["block"] == pytest.approx(stops["wall"], abs=2.5 * h)


def momenta(sim, body, place):
    """Linear and angular momentum of the nodes at their reference and of a ball at a place."""
    dim, v, m = body.dim, sim.nodes.velocity, sim.nodes.mass[:, None]
    ball = sim.bodies.mass[0] * sim.bodies.velocity[0, :dim]
    x, p = np.vstack([body.points, place]), np.vstack([m * v, ball])
    turning = np.cross(x, p).sum(axis=0) if dim == 3 else [np.sum(x[:, 0] * p[:, 1] - x[:, 1] * p[:, 0])]
    return p.sum(axis=0), turning + np.atleast_1d(sim.bodies.inertia[0]) * sim.bodies.velocity[0, dim:]


STIFF = dict(normal_stiffness=1e9, tangential_stiffness=1e9)


LAWS = [cn.Rolling(mu=0.5, rolling=0.3, twisting=0.2), cn.ParallelBond(**STIFF, mu=0.5)]


@pytest.mark.parametrize("law", LAWS, ids=["rolling", "parallel"])
@pytest.mark.parametrize("solver", SOLVERS, ids=["nlgs", "auto"])
@pytest.mark.parametrize("cells", [1, 3])
@pytest.mark.parametrize("dim, kind", KINDS)
def test_a_moment_on_a_face_is_balanced_by_a_couple(dim, kind, cells, solver, law):
    """A spinning ball lands on a free block: momentum and angular momentum are kept, and both turn."""
    body = block(dim, kind, (cells,) * dim, warp=0.02)
    scene, place = cn.Scene(dim), np.array([0.11, 0.05][: dim - 1] + [R])
    scene.add(cn.deformable(body, BASE, **sides_of(dim)))
    scene.add(ball(dim, place, [-0.2] * (dim - 1) + [-1.0] + ([30.0] if dim == 2 else [20.0, -10.0, 15.0])))
    scene.interact(STONE, BASE, law)
    sim = cn.Simulation(scene, 1e-4, cn.NSCD(theta=1.0, solver=solver), overlap="ignore")
    p, turning = momenta(sim, body, place)
    spin = sim.bodies.velocity[0, dim:].copy()
    assert sim.step()["status"] == "converged"
    after, turning_after = momenta(sim, body, place)
    assert np.abs(after - p).max() < 1e-12 * np.abs(p).max()
    assert np.abs(turning_after - turning).max() < 1e-12 * np.abs(turning).max()
    assert np.all(np.abs(sim.bodies.velocity[0, dim:] - spin) > 1e-3 * np.abs(spin))
    assert np.abs(sim.contacts.moment).max() > 0


@pytest.mark.parametrize("solver", SOLVERS, ids=["nlgs", "auto"])
@pytest.mark.parametrize("dim, kind", KINDS)
def test_a_parallel_bond_on_a_face_bends(dim, kind, solver):
    """A moment M on a ball turns it by M/(k_n I), I of the strip or disk of the bond; about the normal by M/(k_t J)."""
    k, moment, h, steps = 1e7, 0.5, 2e-3, 400
    bending = 2 * R**3 / 3 if dim == 2 else np.pi * R**4 / 4
    for axis, stiffness in [(0, k * bending)] if dim == 2 else [(1, k * bending), (2, k * 2 * bending)]:
        scene = cn.Scene(dim)
        scene.add(cn.deformable(block(dim, kind, young=1e11), BASE, fixed={"bottom": "xyz"[:dim]}, **sides_of(dim)))
        force = np.zeros(3 * dim - 3)
        force[dim + axis] = moment
        scene.add(ball(dim, [0.06] * (dim - 1) + [R], force=tuple(force)))
        scene.interact(STONE, BASE, cn.ParallelBond(normal_stiffness=k, tangential_stiffness=k, radius=0.5))
        sim = cn.Simulation(scene, h, cn.NSCD(theta=1.0, solver=solver), overlap="ignore")
        turned = 0.0
        for _ in range(steps):
            assert sim.step()["status"] == "converged"
            turned += h * sim.bodies.velocity[-1, dim + axis]
        assert np.abs(sim.contacts.moment).max() / h == pytest.approx(moment, rel=1e-3)
        assert turned == pytest.approx(moment / stiffness, rel=2e-3)


@pytest.mark.parametrize("dim, kind", KINDS)
def test_a_point_that_is_held_fast_on_a_face_takes_no_moment(dim, kind):
    """The ball turns about it: by M/(I + m R2) along the face, freely about the normal."""
    moment, h, steps = 0.5, 1e-4, 50
    for axis in (0,) if dim == 2 else (1, 2):
        scene, force = cn.Scene(dim), np.zeros(3 * dim - 3)
        scene.add(cn.deformable(block(dim, kind, young=1e11), BASE, fixed={"bottom": "xyz"[:dim]}, **sides_of(dim)))
        force[dim + axis] = moment
        scene.add(ball(dim, [0.06] * (dim - 1) + [R], force=tuple(force)))
        scene.interact(STONE, BASE, cn.Bonded(mu=0.5))
        sim = cn.Simulation(scene, h, cn.NSCD(theta=1.0, solver=SOLVERS[0]), overlap="ignore")
        for _ in range(steps):
            assert sim.step()["status"] == "converged"
        assert np.all(sim.contacts.moment == 0)
        about = np.atleast_1d(sim.bodies.inertia[-1])[axis] + (0 if axis == 2 else sim.bodies.mass[-1] * R**2)
        assert sim.bodies.velocity[-1, dim + axis] == pytest.approx(moment / about * sim.time, rel=1e-2)


def two_meshes(dim, law):
    low, high = [-0.3] * (dim - 1) + [0.0], [0.3] * (dim - 1) + [0.5]
    scene = cn.Scene(dim, gravity=(*[0.0] * (dim - 1), -G))
    scene.add(cn.deformable(block(dim, CELLS[dim][1]), BASE, fixed={"bottom": "xyz"[:dim]}, name="under", **sides_of(dim)))
    scene.add(cn.deformable(block(dim, CELLS[dim][1], (2,) * dim, low, high), STONE, contact="bottom", name="over"))
    scene.interact("*", "*", law)
    return cn.Simulation(scene, 1e-3, cn.NSCD(theta=1.0), overlap="ignore")


def node_on_wall(dim, law):
    scene = cn.Scene(dim, gravity=(*[0.0] * (dim - 1), -G))
    scene.add(cn.wall(np.zeros(dim), np.eye(dim)[-1], STONE))
    low, high = [-0.3] * (dim - 1) + [0.0], [0.3] * (dim - 1) + [0.5]
    scene.add(cn.deformable(block(dim, CELLS[dim][1], (2,) * dim, low, high), BASE, contact="bottom", name="stands"))
    scene.interact("*", "*", law)
    return cn.Simulation(scene, 1e-3, cn.NSCD(theta=1.0), overlap="ignore")


@pytest.mark.parametrize("dim", [2, 3])
def test_what_bears_no_moment_is_refused_by_name(dim):
    law = cn.Rolling(mu=0.3, rolling=0.1)
    between = "law Rolling acts by a moment, and between .*the mesh '(under|over)' and the mesh '(under|over)' none can be borne"
    with pytest.raises(ValueError, match=between + ".*give materials '.*' and '.*' another law, such as Coulomb"):
        two_meshes(dim, law).step()
    with pytest.raises(ValueError, match="law Rolling acts by a moment, .*a node of the mesh 'stands'.*body [0-9]+.*round body|"
                       "law Rolling acts by a moment, .*body [0-9]+ and a node of the mesh 'stands'.*round body"):  # fmt: skip
        node_on_wall(dim, law).step()
    for make in (two_meshes, node_on_wall):  # nothing acts against turning
        for other in (cn.Rolling(mu=0.3), cn.Coulomb(mu=0.3)):
            assert make(dim, other).step()["status"] == "converged"


@pytest.mark.parametrize("blocked", ["wx wy wz", "wx wy", "wx"])
def test_rolling_friction_of_a_sphere_that_may_not_turn(blocked):
    """Where nothing turns, no moment acts: it slides as under Coulomb's law, and lies on the floor."""
    found = []
    for law in (cn.Rolling(mu=0.2, rolling=0.1, twisting=0.1), cn.Coulomb(mu=0.2)):
        scene = cn.Scene(3, gravity=(0.0, 0.0, -G))
        scene.add(cn.wall((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), BASE))
        scene.add(cn.spheres([[0.0, 0.0, R]], R, STONE, velocity=[[0.0, 1.0, 0.0, 0.0, 0.0, 0.0]], driven=tuple(blocked.split())))
        scene.interact(STONE, BASE, law)
        sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=1.0, solver=SOLVERS[0]))
        for _ in range(50):
            assert sim.step()["status"] == "converged"
        found.append(sim.bodies.velocity[-1].copy())
        assert abs(sim.bodies.position[-1, 2] - R) < 1e-9 * R
    assert np.allclose(found[0], found[1], rtol=0, atol=1e-9)
