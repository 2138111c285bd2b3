"""Elastic bodies by finite elements: patch test, mass, cantilever, a mesh of gmsh."""

import numpy as np
import pytest
from cairn.model.elastic import ElasticBody
from report import judge


def grid(dim, counts, sizes, simplices=False):
    """Nodes and cells of a box; simplices cut each square in 2, each cube in 6."""
    axes = [np.linspace(0, s, c + 1) for c, s in zip(counts, sizes)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, dim)
    number = np.arange(len(points)).reshape([c + 1 for c in counts])
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    if dim == 3:
        corners = [(*c, 0) for c in corners] + [(*c, 1) for c in corners]
    at = [number[tuple(slice(o, o + n) for o, n in zip(corner, counts))].ravel() for corner in corners]
    cells = np.stack(at, 1)
    if not simplices:
        return points, {"quad" if dim == 2 else "hexahedron": cells}
    if dim == 2:
        return points, {"triangle": np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])}
    ways = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
    return points, {"tetra": np.concatenate([cells[:, way] for way in ways])}


@pytest.mark.parametrize("simplices", [False, True])
@pytest.mark.parametrize("dim, plane", [(2, "strain"), (2, "stress"), (3, "strain")])
def test_patch(dim, plane, simplices):
    """On a distorted mesh whose boundary moves linearly the inside does too, and the stress is that of the strain everywhere."""
    rng = np.random.default_rng(1)
    points, cells = grid(dim, (3,) * dim, (1.0,) * dim, simplices)
    inside = np.all((points > 1e-9) & (points < 1 - 1e-9), 1)
    points[inside] += 0.06 * (rng.random((inside.sum(), dim)) - 0.5)
    young, poisson = 3.0e9, 0.3
    body = ElasticBody(points, cells, young=young, poisson=poisson, plane=plane)
    gradient = 1e-3 * (rng.random((dim, dim)) - 0.5)
    exact = points @ gradient.T + 2e-4
    body.groups["boundary"] = np.flatnonzero(~inside)
    u = body.solve({"boundary": "xyz"[:dim]}, displacement=exact)
    judge("displacement", u, exact, 1e-12)
    strain = (gradient + gradient.T) / 2
    shear = young / (2 * (1 + poisson))
    lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    if plane == "stress":
        lame = 2 * lame * shear / (lame + 2 * shear)
    full = lame * np.trace(strain) * np.eye(dim) + 2 * shear * strain
    pairs = [(0, 0), (1, 1), (0, 1)] if dim == 2 else [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)]
    expected = [full[p] for p in pairs]
    for stress in body.stress(u).values():
        judge("stress", stress, np.broadcast_to(expected, stress.shape), 1e-12)


def test_mass_is_that_of_the_volume():
    for dim, simplices in ((2, False), (2, True), (3, False), (3, True)):
        points, cells = grid(dim, (2,) * dim, (0.5, 0.7, 1.1)[:dim], simplices)
        body = ElasticBody(points, cells, young=1.0, poisson=0.2, density=3.0, thickness=2.0)
        expected = 3.0 * 0.5 * 0.7 * (2.0 if dim == 2 else 1.1)
        judge("mass", body.M.sum() / dim, expected, 1e-13)
        x = points[:, 0]
        inertia = sum(x[i] * x[j] * m for i, j, m in triples(body, dim))
        judge("second moment", inertia, expected * 0.25 / 3, 1e-13)


def triples(body, dim):
    """Entries of the consistent mass along x."""
    m = body.M[::dim, ::dim].tocoo()
    return zip(m.row, m.col, m.data)


@pytest.mark.parametrize("slenderness", [5, 20])
def test_cantilever(slenderness):
    """PL^3/3EI + 1.2 PL/GA (Timoshenko) under a load at its end."""
    young, poisson, load, across = 2e11, 0.3, -1e3, 16
    points, cells = grid(2, (across * slenderness // 2, across), (float(slenderness), 1.0))
    clamped = np.flatnonzero(points[:, 0] == 0)
    middle = clamped[np.isclose(points[clamped, 1], 0.5)]  # the section may swell, as beam theory has it
    groups = {"clamped": clamped, "middle": middle, "end": np.flatnonzero(points[:, 0] == slenderness)}
    body = ElasticBody(points, cells, young=young, poisson=poisson, plane="stress", groups=groups)
    u = body.solve({"clamped": "x", "middle": "y"}, {"end": (0.0, load)})
    shear = young / (2 * (1 + poisson))
    expected = load * slenderness**3 / (3 * young / 12) + 1.2 * load * slenderness / shear
    judge("deflection", u[groups["end"], 1].mean(), expected, 1e-2)


SQUARE = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
1 7 "foot"
2 9 "stone"
$EndPhysicalNames
$Nodes
5
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
5 0.5 0.5 0
$EndNodes
$Elements
5
1 1 2 7 1 1 2
2 2 2 9 1 1 2 5
3 2 2 9 1 2 3 5
4 2 2 9 1 3 4 5
5 2 2 9 1 4 1 5
$EndElements
"""


def test_named_groups_of_a_gmsh_mesh(tmp_path):
    pytest.importorskip("meshio")
    path = tmp_path / "square.msh"
    path.write_text(SQUARE)
    body = ElasticBody.read(path, young=1e9, poisson=0.3, density=2.0)
    assert sorted(body.groups) == ["foot", "stone"] and body.groups["foot"].tolist() == [0, 1]
    judge("mass", body.M.sum() / 2, 2.0, 1e-13)
    assert body.boundary_edges().tolist() == [[0, 1], [1, 2], [2, 3], [3, 0]]


def test_what_is_wrong_is_named():
    points, cells = grid(2, (1, 1), (1.0, 1.0))
    with pytest.raises(ValueError, match="quad 0 .* is flat or inside out"):
        ElasticBody(points, {"quad": cells["quad"][:, ::-1]}, young=1.0, poisson=0.3)
    with pytest.raises(ValueError, match="do not fit 2 dimensions: give triangle or quad"):
        ElasticBody(points, {"tetra": [[0, 1, 2, 3]]}, young=1.0, poisson=0.3)
    with pytest.raises(ValueError, match="poisson is 0.5"):
        ElasticBody(points, cells, young=1.0, poisson=0.5)
    body = ElasticBody(points, cells, young=1.0, poisson=0.3)
    with pytest.raises(ValueError, match="there is no group 'left'"):
        body.solve({"left": "x"})
