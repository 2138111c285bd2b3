"""Every element: patch test, rigid motions, mass, boundary, order of convergence, against plain numpy."""

import cairn as cn
import numpy as np
import pytest
from cairn import ElasticBody, _core
from second_order import CELLS, box

ALL = [(dim, kind) for dim, kinds in CELLS.items() for kind in kinds]
ORDER = {e["cell"]: e["order"] for e in _core.elements()}


def distorted(dim, kind, counts=None, shift=0.06):
    """A box whose cells have straight sides and no right angles."""
    rng = np.random.default_rng(3)
    skew = np.eye(dim) + 0.2 * (rng.random((dim, dim)) - 0.5)
    points, cells = box(kind, counts or (2,) * dim, (1.0,) * dim)
    inside = np.all((points > 1e-9) & (points < 1 - 1e-9), 1)
    if ORDER[kind] == 1:
        points[inside] += shift * (rng.random((inside.sum(), dim)) - 0.5)
    return points @ skew.T, cells, np.flatnonzero(~inside)


@pytest.mark.parametrize("dim, kind", ALL)
def test_a_linear_displacement_is_met_exactly(dim, kind):
    points, cells, boundary = distorted(dim, kind)
    body = ElasticBody(points, cells, young=3e9, poisson=0.3, groups={"boundary": boundary})
    gradient = 1e-3 * (np.random.default_rng(1).random((dim, dim)) - 0.5)
    exact = points @ gradient.T + 2e-4
    u = body.solve({"boundary": "xyz"[:dim]}, displacement=exact)
    assert np.abs(u - exact).max() < 1e-14
    stress = body.stress(u)[kind]
    strain = np.array([gradient[0, 0], gradient[1, 1], *([gradient[2, 2]] if dim == 3 else []), gradient[0, 1] + gradient[1, 0]])
    assert np.allclose(stress[:, : dim + 1], (body.elasticity[: dim + 1, : dim + 1] @ strain), rtol=1e-9)


@pytest.mark.parametrize("dim, kind", ALL)
def test_rigid_motions_alone_have_no_energy(dim, kind):
    points, cells, _ = distorted(dim, kind, (1,) * dim)
    body = ElasticBody(points, cells, young=1.0, poisson=0.25)
    frequency = np.linalg.eigvalsh(body.K.toarray())
    none = np.sum(np.abs(frequency) < 1e-12 * frequency[-1])
    assert none == (3 if dim == 2 else 6)


@pytest.mark.parametrize("dim, kind", ALL)
def test_mass(dim, kind):
    points, cells, _ = distorted(dim, kind)
    body = ElasticBody(points, cells, young=1.0, poisson=0.25, density=3.0)
    lumped = ElasticBody(points, cells, young=1.0, poisson=0.25, density=3.0, lumped=True)
    corners = points[np.unique(cells[kind][:, : 2**dim if "quad" in kind or "hexa" in kind else dim + 1])]
    volume = 3.0 * np.abs(np.linalg.det(edges_of_box(corners, dim)))
    assert body.M.sum() / dim == pytest.approx(volume, rel=1e-12)
    assert body.nodal_mass().min() > 0
    assert body.nodal_mass().sum() == pytest.approx(volume, rel=1e-12)
    assert lumped.M.diagonal().reshape(-1, dim)[:, 0] == pytest.approx(body.nodal_mass(), rel=1e-12)
    if ORDER[kind] == 2:  # and its second moment, by the consistent mass
        x = points[:, 0]
        fine = points_of_rule(points, cells[kind], dim, kind)
        assert x @ body.M[::dim, ::dim] @ x == pytest.approx(3.0 * np.sum(fine[1] * fine[0][:, 0] ** 2), rel=1e-12)


def edges_of_box(corners, dim):
    """Edges from the first corner of a skew box, whose corners are its extreme points along them."""
    low = corners[np.argmin(corners.sum(axis=1))]
    high = corners[np.argmax(corners.sum(axis=1))]
    rng = np.random.default_rng(3)
    skew = np.eye(dim) + 0.2 * (rng.random((dim, dim)) - 0.5)
    assert np.allclose(high - low, skew.sum(axis=1))
    return skew


def points_of_rule(points, cells, dim, kind):
    """Gauss's points of a fine rule on the corners of the cells and their weights, by numpy alone."""
    x, w = np.polynomial.legendre.leggauss(4)
    if "quad" in kind or "hexa" in kind:
        grid = np.stack(np.meshgrid(*[x] * dim, indexing="ij"), -1).reshape(-1, dim)
        weight = np.prod(np.stack(np.meshgrid(*[w] * dim, indexing="ij"), -1).reshape(-1, dim), axis=1)
        corner = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
        if dim == 3:
            corner = np.array([(*c, z) for z in (-1, 1) for c in corner])
        value = np.prod((1 + grid[:, None] * corner) / 2, axis=2)
    else:  # Duffy's transformation of the square or cube on the simplex
        s, ws = (x + 1) / 2, w / 2
        grid = np.stack(np.meshgrid(*[s] * dim, indexing="ij"), -1).reshape(-1, dim)
        weight = np.prod(np.stack(np.meshgrid(*[ws] * dim, indexing="ij"), -1).reshape(-1, dim), axis=1)
        place, left = np.zeros_like(grid), np.ones(len(grid))
        for k in range(dim):
            place[:, k] = grid[:, k] * left
            weight = weight * left
            left = left * (1 - grid[:, k])
        value = np.c_[1 - place.sum(axis=1), place]
    nodes = points[cells[:, : value.shape[1]]]
    at = np.einsum("pa,cak->cpk", value, nodes)
    if "quad" in kind or "hexa" in kind:
        size = np.abs(np.linalg.det(nodes[:, [1, 3] + ([4] if dim == 3 else [])] - nodes[:, :1])) / 2**dim
    else:
        size = np.abs(np.linalg.det(nodes[:, 1:] - nodes[:, :1]))
    return at.reshape(-1, dim), (size[:, None] * weight).ravel()


@pytest.mark.parametrize("dim, kind", ALL)
def test_the_boundary_is_closed(dim, kind):
    points, cells, _ = distorted(dim, kind)
    body = ElasticBody(points, cells, young=1.0, poisson=0.25)
    skew = edges_of_box(points[np.unique(cells[kind])], dim)
    if dim == 2:
        a, b = np.moveaxis(points[body.boundary_edges()], 1, 0)
        assert np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2 == pytest.approx(np.linalg.det(skew), rel=1e-12)
        return
    volume = 0.0
    for face in body.boundary_faces():
        corner = points[face[face >= 0]]
        for k in range(1, len(corner) - 1):
            volume += np.linalg.det(corner[[0, k, k + 1]]) / 6
    assert volume == pytest.approx(np.linalg.det(skew), rel=1e-12)


@pytest.mark.parametrize("dim, kind", [(2, k) for k in CELLS[2]] + [(3, k) for k in ("hexahedron", "tetra10", "hexahedron20")])
def test_order_of_convergence(dim, kind):
    """A displacement sin x cosh y, harmonic and without divergence, held on the boundary: its energy converges as h^(2 order)."""

    def exact(x):
        u = np.zeros_like(x)
        u[:, 0] = np.sin(x[:, 0]) * np.cosh(x[:, 1])  # the gradient of a harmonic function
        u[:, 1] = -np.cos(x[:, 0]) * np.sinh(x[:, 1])
        return u

    lame = shear = 1.0 / 2.5
    grid, weight = np.polynomial.legendre.leggauss(20)
    grid, weight = 0.5 * (grid + 1), 0.5 * weight
    x, y = np.meshgrid(grid, grid, indexing="ij")
    xx, xy = np.cos(x) * np.cosh(y), np.sin(x) * np.sinh(y)
    energy = np.sum(np.outer(weight, weight) * shear * 2 * (xx**2 + xy**2))  # without divergence: mu e:e
    assert lame == shear
    errors = []
    for n in ((3, 6) if kind == "hexahedron20" else (2, 4)) if dim == 3 else (4, 8):
        points, cells = box(kind, (n,) * dim, (1.0,) * dim)
        boundary = np.flatnonzero(np.any((points < 1e-9) | (points > 1 - 1e-9), axis=1))
        body = ElasticBody(points, cells, young=1.0, poisson=0.25, groups={"boundary": boundary})
        u = body.solve({"boundary": "xyz"[:dim]}, displacement=exact(points)).ravel()
        errors.append(abs(0.5 * u @ body.K @ u - energy) / energy)
    rate = np.log2(errors[0] / errors[1])
    assert rate > 2 * ORDER[kind] - 0.35, (kind, errors)


@pytest.mark.parametrize("dim, kind", [(d, k) for d, k in ALL if ORDER[k] == 2])
def test_a_cell_of_second_order_rests_on_a_plane(dim, kind):
    """Candidate nodes, midside ones too, carry the weight; and a ball rests on the sides, cut along their middles."""
    points, cells = box(kind, (2,) * dim, (1.0,) * dim)
    body = ElasticBody(
        points, cells, young=1e6, poisson=0.2, density=1000.0, rayleigh=(50.0, 1e-3),
        groups={"bottom": np.flatnonzero(points[:, -1] < 1e-9), "top": np.flatnonzero(points[:, -1] > 1 - 1e-9)},
    )  # fmt: skip
    rock = cn.Material("rock", density=2000.0)
    down = np.zeros(dim)
    down[-1] = -10.0
    scene = cn.Scene(dim=dim, gravity=down)
    sides = {"edges": "top"} if dim == 2 else {"faces": "top"}
    scene.add(cn.deformable(body, rock, contact="bottom", **sides))
    ball = cn.disks if dim == 2 else cn.spheres
    scene.add(ball([[0.4, *[0.45] * (dim - 2), 1.05]], 0.05, rock))
    scene.add(cn.wall((0.0,) * dim, tuple(-down / 10.0), rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=2e-3, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-8)))
    sim.run(steps=200, progress=False)
    weight = 10.0 * (body.nodal_mass().sum() + 2000.0 * (np.pi * 0.05**2 if dim == 2 else 4 / 3 * np.pi * 0.05**3))
    low = sim.contacts.point[:, -1] < 0.5
    assert np.abs(sim.contacts.force[low, -1].sum()) == pytest.approx(weight, rel=2e-3)
    share = np.abs(sim.contacts.force[~low, -1].sum())
    assert share == pytest.approx(weight - 10.0 * body.nodal_mass().sum(), rel=2e-3)
