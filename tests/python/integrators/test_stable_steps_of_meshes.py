"""Steps of explicit integrators on meshes: certain to be stable by the frequencies of elements, never longer than what dense
eigenvalues allow, and not much shorter."""

import cairn as cn
import numpy as np
import pytest
from scipy import linalg

ROCK = cn.Material("rock", density=2000.0)
CELLS = {
    2: ["triangle", "quad", "triangle6", "quad8", "quad9"],
    3: ["tetra", "hexahedron", "tetra10", "hexahedron20", "hexahedron27"],
}
KINDS = [(dim, kind) for dim in CELLS for kind in CELLS[dim]]
SHORT = 1.15  # of the true limit over the step, at most


def nodes_of(kind):
    """Places of the nodes of cells in a unit square or cube: corners of the cells that it is cut into, and middles."""
    square = [[0, 0], [1, 0], [1, 1], [0, 1]]
    cube = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
    six = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
    edges = {
        "triangle6": [(0, 1), (1, 2), (2, 0)],
        "quad8": [(0, 1), (1, 2), (2, 3), (3, 0)],
        "tetra10": [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)],
        "hexahedron20": [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)],
    }
    whole = {"quad9": [(0, 1, 2, 3)], "hexahedron27": [(0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3),
                                                        (4, 5, 6, 7), tuple(range(8))]}  # fmt: skip
    edges["quad9"], edges["hexahedron27"] = edges["quad8"], edges["hexahedron20"]
    base = np.array(square if kind.startswith(("tri", "quad")) else cube, float)
    cells = [(0, 1, 2), (0, 2, 3)] if kind.startswith("tri") else six if kind.startswith("tetra") else [tuple(range(len(base)))]
    out = []
    for cell in cells:
        corner = base[list(cell)]
        more = [corner[list(e)].mean(axis=0) for e in [*edges.get(kind, []), *whole.get(kind, [])]]
        out.append(np.concatenate([corner, np.array(more).reshape(-1, base.shape[1])]))
    return np.array(out)


def mesh(dim, kind, cells, seed, distort=0.2, stretch=4.0):
    """Points and cells of a box whose cells differ in size by `stretch` along x, nodes moved by a share of a cell."""
    each = nodes_of(kind)
    all_nodes = np.concatenate([each + np.array(at) for at in np.ndindex(*cells)])
    points, number = np.unique(np.round(all_nodes.reshape(-1, dim), 9), axis=0, return_inverse=True)
    random = np.random.default_rng(seed)
    corner = np.all(points == np.round(points), axis=1)
    moved = np.where(corner[:, None], random.uniform(-distort, distort, points.shape), 0.0)
    lattice = {tuple(p): m for p, m in zip(points[corner], moved[corner])}
    for i in np.flatnonzero(~corner):  # middles stay between their corners
        around = [m for p, m in lattice.items() if np.all(np.abs(points[i] - p) <= 0.5 + 1e-9)]
        moved[i] = np.mean(around, axis=0)
    points = points + moved
    points[:, 0] += (stretch - 1) / (2 * cells[0]) * points[:, 0] ** 2
    return 0.1 * points, {kind: number.reshape(-1, each.shape[1])}


def body_of(dim, kind, seed, lumped=True, cells=None, **more):
    cells = cells or ((3, 2) if dim == 2 else (2, 2, 1) if "0" in kind or "7" in kind else (3, 2, 2))
    points, given = mesh(dim, kind, cells, seed)
    left = np.flatnonzero(points[:, 0] < points[:, 0].min() + 0.03)
    groups = {"left": left, "all": np.arange(len(points))}
    return cn.ElasticBody(points, given, young=1e7, poisson=0.3, density=2000.0, groups=groups, lumped=lumped, **more)


def simulation(body, dt, integrator=None, fixed=None, velocity=None, **more):
    scene = cn.Scene(body.dim)
    scene.add(cn.deformable(body, ROCK, fixed=fixed, velocity=velocity, **more))
    return cn.Simulation(scene, dt, cn.NSCD(integrator=integrator or cn.CentralDifference()))


def true_limit(body, free, damping=None):
    """Stable step over all modes, by dense eigenvalues."""
    k, m = body.K.toarray()[np.ix_(free, free)], body.M.toarray()[np.ix_(free, free)]
    square, shape = linalg.eigh(k, m)
    omega = np.sqrt(square[-1])
    xi = 0.0 if damping is None else damping(omega)
    return 2 / omega * (np.sqrt(1 + xi**2) - xi)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("dim, kind", KINDS)
def test_a_step_by_elements_is_below_the_limit_and_near_it(dim, kind, held, seed):
    body = body_of(dim, kind, seed)
    fixed = {"left": "xyz"[:dim]} if held else {}
    free = np.setdiff1d(np.arange(body.points.size), body.dofs(fixed))
    limit, step = true_limit(body, free), simulation(body, 1e-12, fixed=fixed).stable_step
    assert step <= limit
    assert limit <= SHORT * step


@pytest.mark.parametrize("dim, kind", KINDS)
def test_it_is_stable_at_its_step_and_refused_beyond_the_limit(dim, kind):
    body = body_of(dim, kind, 7)
    free = np.arange(body.points.size)
    limit, step = true_limit(body, free), simulation(body, 1e-12).stable_step
    speed = np.random.default_rng(1).normal(size=body.points.shape)
    sim = simulation(body, 0.99 * step, velocity=speed)
    first = np.sum(sim.nodes.mass[:, None] * sim.nodes.velocity**2) / 2
    for _ in range(400):
        sim.step()
    assert np.sum(sim.nodes.mass[:, None] * sim.nodes.velocity**2) / 2 < 10 * first
    # where bounds of elements are inconclusive, a factorisation decides
    sim = simulation(body, 0.999 * limit, velocity=speed)
    sim.step()
    for beyond in (1.002, 2.0):
        with pytest.raises(ValueError, match="beyond the stable step .* of the mesh 'mesh'"):
            simulation(body, beyond * limit).step()


@pytest.mark.parametrize("dim, kind", [(2, "quad"), (3, "tetra"), (2, "quad8")])
def test_of_consistent_masses(dim, kind):
    body = body_of(dim, kind, 3, lumped=False)
    limit, step = true_limit(body, np.arange(body.points.size)), simulation(body, 1e-12).stable_step
    assert 0.99 * limit < step <= limit
    with pytest.raises(ValueError, match="beyond the stable step"):
        simulation(body, 1.002 * limit).step()


@pytest.mark.parametrize("rayleigh", [(0.0, 3e-4), (400.0, 0.0), (400.0, 3e-4)])
def test_of_damped_ones(rayleigh):
    body = body_of(2, "quad", 5, rayleigh=rayleigh)
    free = np.arange(body.points.size)
    limit = true_limit(body, free, lambda omega: rayleigh[0] / (2 * omega) + rayleigh[1] * omega / 2)
    step = simulation(body, 1e-12).stable_step
    assert limit / 2 < step <= limit
    simulation(body, 0.999 * limit).step()
    with pytest.raises(ValueError, match="beyond the stable step"):
        simulation(body, 1.002 * limit).step()


@pytest.mark.parametrize("integrator", [cn.BetaScheme(beta=0.6), cn.VelocityVerlet(), cn.Newmark(beta=0.1, gamma=0.5)], ids=repr)
def test_of_other_integrators(integrator):
    body = body_of(2, "triangle", 2)
    by = integrator.scheme(1.0)["largest"] / 2
    limit = by * true_limit(body, np.arange(body.points.size))
    step = simulation(body, 1e-12, integrator).stable_step
    assert limit / SHORT < step <= limit


def made_of(law, b=0.0):
    """A block of a law of solids, lumped, with damping by b times its stiffness; of none: a linear one."""
    points, cells = mesh(2, "quad", (3, 2), 8)
    if law is None:
        return cn.ElasticBody(points, cells, young=1e7, poisson=0.3, density=2000.0, lumped=True, rayleigh=(0.0, b))
    return cn.SolidBody(points, cells, law, density=2000.0, lumped=True, rayleigh=(0.0, b), kinematics="small")


EXPLICIT = [cn.CentralDifference(), cn.VelocityVerlet(), *(cn.BetaScheme(beta=b) for b in (0.6, 1.0)),
            *(cn.Gear(values=k) for k in (4, 5, 6))]  # fmt: skip


@pytest.mark.parametrize("ratio", [3e-5, 3e-4, 3e-3])
@pytest.mark.parametrize("law", ["linear", "solid", "dashpot"])
@pytest.mark.parametrize("integrator", EXPLICIT, ids=repr)
def test_what_is_damped_is_stable_at_its_step(integrator, law, ratio):
    """Drag shortens the step of each method by as much as that method bears, that of a material as that of a matrix."""
    hooke, dashpot = {"young": 1e7, "poisson": 0.3}, {"viscous_young": ratio * 1e7, "viscous_poisson": 0.3}
    laws = {"linear": None, "solid": cn.IsotropicElastic(**hooke), "dashpot": cn.KelvinVoigt(**hooke, **dashpot)}
    body = made_of(laws[law], 0.0 if law == "dashpot" else ratio)
    assert simulation(body, 1e-12, integrator).stable_step == pytest.approx(
        simulation(made_of(None, ratio), 1e-12, integrator).stable_step, rel=0.2
    )
    step = simulation(body, 1e-12, integrator).stable_step
    sim = simulation(body, 0.99 * step, integrator, velocity=1e-3 * np.random.default_rng(1).normal(size=body.points.shape))
    first = np.sum(sim.nodes.mass[:, None] * sim.nodes.velocity**2) / 2
    for _ in range(400):
        sim.step()
    assert np.sum(sim.nodes.mass[:, None] * sim.nodes.velocity**2) / 2 < 10 * first
    with pytest.raises(ValueError, match="beyond the stable step .* of the mesh 'mesh'"):
        simulation(body, 1.5 * step, integrator).step()


def test_implicit_integrators_have_none():
    assert simulation(body_of(2, "quad", 0), 1e-3, cn.Theta()).stable_step == np.inf


@pytest.mark.parametrize("dim, kind", [(2, "quad"), (2, "triangle6"), (3, "hexahedron"), (3, "tetra")])
def test_of_materials_by_their_tangent_at_the_start(dim, kind):
    points, cells = mesh(dim, kind, (3, 2, 2)[:dim], 4)
    rubber = cn.SolidBody(points, cells, cn.NeoHookean(young=1e7, poisson=0.3), density=2000.0, lumped=True)
    plain = cn.ElasticBody(points, cells, young=1e7, poisson=0.3, density=2000.0, lumped=True)
    limit, step = true_limit(plain, np.arange(points.size)), simulation(rubber, 1e-12).stable_step
    assert limit / SHORT < step <= limit


def test_of_stiff_cells_beside_soft_ones_and_of_given_matrices():
    """A mass that is shared as elements hold a node; of matrices alone the step is by factors."""
    body = body_of(2, "quad", 6)
    given = cn.LinearBody(body.points, body.M, body.K)
    limit = true_limit(body, np.arange(body.points.size))
    step = simulation(given, 1e-12).stable_step
    assert 0.99 * limit < step <= limit
