"""Mortars of sides of second order of a Fortran program, which calls the C API, against the same scenes made in Python."""

import cairn as cn
import numpy as np
import pytest
from programs import near, told_by
from test_mortar_faces import ROCK, block, flat, spread

CASES = {
    "q8": ((2, 1), (3, 1)), "q9": ((3, 1), (2, 1)), "t6": ((2, 1), (3, 1)),
    "hex20": ((2, 1, 1), (3, 2, 1)), "hex27": ((1, 2, 1), (2, 3, 1)), "tet10": ((2, 2, 1), (3, 2, 1)),
}  # fmt: skip
KINDS = {"q8": "quad8", "q9": "quad9", "hex20": "hexahedron20", "hex27": "hexahedron27", "tet10": "tetra10"}


def triangles(cells, corner):
    """The quadrilaterals of nine nodes cut along a diagonal, with their nodes."""
    body = flat("quad9", cells, corner)
    halves = [body.cells["quad9"][:, part] for part in ([0, 1, 2, 4, 5, 8], [0, 2, 3, 8, 6, 7])]
    cells = {"triangle6": np.stack(halves, 1).reshape(-1, 6)}
    return cn.ElasticBody(
        body.points, cells, young=1e6, poisson=0.3, density=1000.0, groups=dict(body.groups), plane="stress"
    )


def made(element, cells, height):
    if element == "t6":
        return triangles(cells, (0.0, height))
    if len(cells) == 2:
        return flat(KINDS[element], cells, (0.0, height))
    return block(KINDS[element], cells, (0.0, 0.0, height))


def pressed(element, tilted):
    """A block on another under a pressure, brought to rest by long implicit steps."""
    over, under = (made(element, cells, height) for cells, height in zip(CASES[element], (0.5, 0.0)))
    dim = over.dim
    scene, sides = cn.Scene(dim=dim), "edges" if dim == 2 else "faces"
    hold = {"left": "x"} if dim == 2 else {"left": "x", "front": "y"}
    force = spread(over, 1e4)
    if tilted:
        force = {name: np.array(f) * (1 + over.points[over.groups[name][0], 0] / 2) for name, f in force.items()}
    scene.add(cn.deformable(over, ROCK, contact="bottom", mortar=True, force=force, fixed=hold, name="over", **{sides: "bottom"}))
    scene.add(cn.deformable(under, ROCK, fixed=hold | {"bottom": "xyz"[dim - 1]}, name="under", **{sides: "top"}))
    scene.interact(ROCK, ROCK, cn.GapCoulomb(mu=0.0))
    sim = cn.Simulation(scene, 0.1, cn.NSCD(1.0, cn.NLGS(tol=1e-14, max_iter=50000)), overlap="ignore")
    for _ in range(60):
        sim.step()
    return sim


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    return told_by("parabolic", tmp_path_factory.mktemp("parabolic"))


@pytest.mark.parametrize("element", CASES)
def test_a_mortar_of_sides_of_second_order_is_that_of_python(told, element):
    """tests/consumers/fortran/parabolic.f90: a uniform pressure, and one that grows by a half along x."""
    near(told[f"{element}_uniform"], pressed(element, False).meshes[0].displacement, 1e-12)
    sim = pressed(element, True)
    near(told[f"{element}_over"], sim.meshes[0].displacement, 1e-12)
    near(told[f"{element}_under"], sim.meshes[1].displacement, 1e-12)


def test_sides_as_wholes_have_the_nodes_of_their_pieces():
    """For each element, corners, each followed by the middle of its edge, are those of its pieces, which cover all nodes."""
    from cairn.model.elastic import ELEMENTS

    counts = {"triangle": 2, "triangle6": 3, "quad": 2, "quad8": 3, "quad9": 3}
    counts |= {"tetra": 3, "tetra10": 6, "hexahedron": 4, "hexahedron20": 8, "hexahedron27": 9}
    for cell, row in ELEMENTS.items():
        pieces = [piece for _, parts in row["whole_sides"] for piece in parts]
        assert pieces == [list(side) for side in row["sides"]]
        for whole, parts in row["whole_sides"]:
            assert len(whole) == counts[cell]
            assert set(whole) == {node for piece in parts for node in piece if node >= 0}
