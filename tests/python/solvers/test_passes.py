"""Passes of the contact solver over batches, each against the contact problem in matrices: W = H'A^-1 H, made in Python."""

import cairn as cn
import numpy as np
import pytest
from cairn.run.contact_problem import problem_of, stacked

ROCK = cn.Material("rock", density=1000.0)


def heap(dim, solver, steps=1):
    """Bodies on a lattice that overlap a little, in a box, with velocities; radii differ so that batches are of several sizes."""
    rng = np.random.default_rng(dim)
    cells = (7, 5) if dim == 2 else (4, 3, 3)
    at = np.stack(np.meshgrid(*map(range, cells), indexing="ij"), -1).reshape(-1, dim)
    scene = cn.Scene(dim, gravity=(0, -10.0, 0)[:dim])
    make = cn.disks if dim == 2 else cn.spheres
    speed = np.hstack([rng.normal(size=at.shape), rng.normal(size=(len(at), 2 * dim - 3))])
    scene.add(make(0.99 * at + 0.5, rng.uniform(0.48, 0.52, len(at)), ROCK, velocity=speed))
    scene.add(*cn.box((0,) * dim, (cells[0], 9, cells[-1])[:dim], ROCK, lid=False))
    return moved(scene, solver, steps)


def moved(scene, solver, steps):
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.4))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=solver), overlap="ignore")
    for _ in range(steps):
        sim.step()
    return sim


def velocities(sim, name):
    """Velocities of rigid bodies and, behind them, of the nodes of meshes, in the order of the matrices."""
    return stacked(sim, name).ravel()


def small_meshes(dim, solver, steps=1):
    """Squares of two triangles each, of their own mesh, beside and on each other; in space one tetrahedron on the next."""
    sets, scene = [], cn.Scene(dim, gravity=(0.0, -10.0, 0.0)[:dim])
    if dim == 2:
        edges = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
        points = (np.array([[0, 1], [1, 2], [2, 3], [3, 0]]), np.full((4, 2), 0.5))
        for k in range(6):
            square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) + [k % 2, k // 2]
            cells = {"triangle": np.array([[0, 1, 2], [0, 2, 3]])}
            how = {"points": points} if (k + k // 2) % 2 else {"edges": edges, "contact": np.arange(4)}
            body = cn.ElasticBody(square, cells, young=1e6, poisson=0.2, density=1000.0)
            sets.append(cn.deformable(body, ROCK, name=f"square {k}", velocity=(0.3 * (-1) ** k, -0.1 * k), **how))
        scene.add(*sets, cn.wall((0, 0), (0, 1), ROCK))
    else:
        corner = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0.3, 1, 0.3]])
        body = cn.ElasticBody(corner, {"tetra": np.array([[0, 2, 1, 3]])}, young=1e6, poisson=0.2, density=1000.0)
        scene.add(*cn.deformable(body, ROCK, contact=np.arange(4), faces=body.boundary_faces(), velocity=(1.0, -0.1, 0.2)))
        scene.add(cn.spheres([[0.3, 1.3, 0.3]], 0.3, ROCK, velocity=(0, -1.0, 0, 0, 0, 0)), cn.wall((0, 0, 0), (0, 1, 0), ROCK))
    return moved(scene, solver, steps)


def in_matrices(sim):
    """mu, W_NN, impulses, velocities with their bias and those without impulses, by the matrices; and the problem behind them."""
    made = problem_of(sim)
    problem, rows, chosen = made["problem"], made["rows"], made["chosen"]
    dim, w = problem.dim, problem.W.toarray()
    r = np.einsum("nij,nj->ni", rows.axes[chosen], sim.contacts.impulse[chosen])
    u = (w @ r.ravel()).reshape(-1, dim) + problem.q
    return made, problem.mu, np.diag(w)[::dim], r, u, problem.q


def natural_map(mu, w, r, u):
    """r less the nearest impulse in the cone to r - (u + mu |u_T| n)/W_NN, for each contact."""
    z = r - (u + np.outer(mu * np.linalg.norm(u[:, 1:], axis=1), np.eye(r.shape[1])[0])) / w[:, None]
    normal, along = z[:, 0], np.linalg.norm(z[:, 1:], axis=1)
    size = np.where(mu * along <= -normal, 0, (normal + mu * along) / (1 + mu * mu))
    cone = np.concatenate([size[:, None], (mu * size / np.maximum(along, 1e-300))[:, None] * z[:, 1:]], axis=1)
    return r - np.where((along <= mu * normal)[:, None], z, cone)


SCENES = [(heap, 2), (heap, 3), (small_meshes, 2), (small_meshes, 3)]
IDS = ["disks", "spheres", "squares", "tetrahedron"]


@pytest.mark.parametrize("make, dim", SCENES, ids=IDS)
@pytest.mark.parametrize("sweeps", [1, 4])
def test_the_error_is_that_of_the_matrices(make, dim, sweeps):
    """Error in the energy norm, over the impulses or those of single contacts for velocities without impulses."""
    sim = make(dim, cn.NLGS(tol=1e-12, min_iter=sweeps, max_iter=sweeps, acceleration="none"))
    _, mu, w, r, u, free = in_matrices(sim)
    f, none = natural_map(mu, w, r, u), natural_map(mu, w, 0 * r, free)
    square, size, least = (np.sum(w[:, None] * x**2) for x in (f, r, none))
    assert square > 0 and sim.info["error"] == pytest.approx(np.sqrt(square / max(size, least)), rel=1e-9)


@pytest.mark.parametrize("make, dim", SCENES, ids=IDS)
def test_impulses_move_bodies_as_the_matrices_do(make, dim):
    """Velocities at the end are those without contacts and A^-1 H r, those of contacts H'v."""
    sim = make(dim, cn.NLGS(tol=1e-12, min_iter=3, max_iter=3, acceleration="none"))
    made, _, _, r, u, _ = in_matrices(sim)
    free = velocities(sim, "velocity_free")
    end = free + made["inverse"] @ (made["operator"].T @ r.ravel())
    np.testing.assert_allclose(velocities(sim, "velocity"), end, rtol=0, atol=1e-12 * np.abs(end).max())
    bare = u - made["rows"].bias[made["chosen"]]
    told = sim.contacts.relative_velocity[made["chosen"]]
    np.testing.assert_allclose(told, bare, rtol=0, atol=1e-12 * np.abs(bare).max())


@pytest.mark.parametrize("make, dim", SCENES, ids=IDS)
def test_extrapolated_sweeps_end_where_newtons_method_does(make, dim):
    """Velocities of contacts are one and the same, whichever impulses there are."""
    ends = []
    for solver in (cn.NLGS(tol=1e-13, max_iter=10**5), cn.PPANewton(tol=1e-13)):
        sim = make(dim, solver)
        assert sim.info["status"] == "converged"
        ends.append(velocities(sim, "velocity"))
    np.testing.assert_allclose(*ends, rtol=0, atol=1e-9 * np.abs(ends[0]).max())
