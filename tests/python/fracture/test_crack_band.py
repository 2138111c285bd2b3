"""Energy dissipated by a bar that is torn apart, over the fracture energy of its section: a single row of cells softens."""

import cairn as cn
import numpy as np
import pytest
from second_order import box

YOUNG, STRENGTH, CELLS, SIDE, TOUGH = 1e9, 1e6, 5, 0.2, 20
SPLIT = {
    "triangle": [(0, 1, 2), (0, 2, 3)],
    "tetra": [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)],
}


def torn(kind, across=2, steps=300, place=None, cut_back=6):
    """Dissipated energy over the fracture energy of the section, for square cells or cells cut from them; place(points) moves the
    nodes of cells of second order."""
    dim = 3 if kind.startswith(("hexahedron", "tetra")) else 2
    whole = {2: "quad", 3: "hexahedron"}[dim]
    if kind[-1].isdigit():
        whole = kind
    points, cells = box(whole, (CELLS,) + (across,) * (dim - 1), (CELLS * SIDE,) + (across * SIDE,) * (dim - 1))
    cells = cells[whole] if isinstance(cells, dict) else cells
    middle = np.abs(points[cells].mean(axis=1)[:, 0] - CELLS * SIDE / 2) < SIDE / 2
    points = points if place is None else place(points)
    parts = SPLIT.get(kind, [tuple(range(cells.shape[1]))])
    cells = np.concatenate([cells[:, list(part)] for part in parts])
    fracture = 0.5 * STRENGTH**2 / YOUNG * SIDE * TOUGH
    damages = cn.IsotropicDamage(young=YOUNG, poisson=0.0, strength=STRENGTH, fracture_energy=fracture)
    materials = [cn.IsotropicElastic(young=YOUNG), damages], np.tile(middle, len(parts)).astype(int)
    ends = {"left": np.flatnonzero(points[:, 0] < 1e-9), "right": np.flatnonzero(points[:, 0] > CELLS * SIDE - 1e-9)}
    plane = {"plane": "stress"} if dim == 2 else {}
    body = cn.SolidBody(points, {kind: cells}, {kind: materials}, density=1e3, groups=ends, kinematics="small", **plane)
    opening, duration = 9 * fracture / STRENGTH + STRENGTH / YOUNG * CELLS * SIDE, 12.0
    scene = cn.Scene(dim=dim)
    pull = {"right": {"x": lambda t: opening * t / duration}}
    scene.add(cn.deformable(body, cn.Material("rock", density=1e3), fixed={"left": "xyz"[:dim]}, displace=pull))
    sim = cn.Simulation(scene, duration / steps, strategy=cn.NSCD(theta=1.0, cut_back=cut_back))
    for _ in range(steps):
        assert sim.step()["status"] == "converged"
    return sim.energy["dissipated_material"] / (fracture * (across * SIDE) ** (dim - 1))


@pytest.mark.parametrize("kind, whole", [("triangle", "quad"), ("tetra", "hexahedron")])
def test_cells_that_fill_a_square_or_cube_spend_what_it_does(kind, whole):
    parts, one = torn(kind), torn(whole)
    print(kind, parts, whole, one)
    assert parts == pytest.approx(one, rel=1e-6)
    assert one == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("kind", ["quad", "quad8", "quad9", "hexahedron20"])
def test_what_is_spent_is_exact_however_long_the_steps_are(kind):
    """Regression: with damage by the strain at the end of each step it was 3.6 times the work; cells of second order found no
    equilibrium."""
    spent = torn(kind, steps=20)
    print(kind, spent)
    assert spent == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("kind", ["triangle6", "quad8", "quad9", "tetra10", "hexahedron20"])
def test_cells_of_second_order_have_one_damage_each(kind):
    """Regression: integration points softened separately and found no equilibrium in these steps; shorter steps dissipated 0.72
    to 1.2 of it."""
    spent = torn(kind, across=1 if kind in ("tetra10", "hexahedron20") else 2, steps=200)
    print(kind, spent)
    assert spent == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("kind", ["triangle6", "tetra10"])
def test_one_cell_that_snaps_where_several_could_is_borne_by_its_inertia(kind):
    """Steps of which 20 tear the row: no balance at rest is near where one cell of a square or cube softens alone."""
    spent = torn(kind, across=1, steps=20, cut_back=12)
    print(kind, spent)
    assert spent == pytest.approx(1.0, abs=0.05)


def test_cells_that_are_bent_spend_about_as_much():
    """Waves of 0.15 of a cell, which vanish on the outline."""
    length, height = CELLS * SIDE, 2 * SIDE

    def bend(p):
        still = 16 * p[:, 0] * (length - p[:, 0]) * p[:, 1] * (height - p[:, 1]) / (length * height) ** 2
        wave = 0.15 * SIDE * still[:, None] * np.sin(2.1 * p.sum(axis=1)[:, None] / SIDE + (0.0, 1.7))
        return p + wave

    spent = {kind: torn(kind, place=bend) for kind in ("quad", "triangle6", "quad8", "quad9")}
    print(spent)
    assert all(abs(s - 1) < 0.06 for s in spent.values())


def test_the_tangent_of_shared_damage_is_the_symmetric_part_of_the_differences():
    """Tangents of softening cells, for every plane and measure of strain: each node affects the damage of all points."""
    rng = np.random.default_rng(4)
    law = cn.IsotropicDamage(young=1.0, poisson=0.2, strength=0.02, fracture_energy=0.005)
    measures = {"quad8": ("small", "corotational"), "triangle6": ("total_lagrangian",), "tetra10": ("small", "logarithmic")}
    for kind, kinds in measures.items():
        dim = 3 if kind == "tetra10" else 2
        points, cells = box(kind, (1,) * dim, (1.0,) * dim, lambda x: x + 0.5)
        for plane in ("strain", "stress", "axisymmetric") if dim == 2 else (None,):
            for kinematics in kinds:
                body = cn.SolidBody(points, cells, law, kinematics=kinematics, **({"plane": plane} if plane else {}))
                u = (0.06 * points + 0.02 * (rng.random(points.shape) - 0.5)).ravel()
                values = body.tangent(u)[1]
                start, row = body.lower[:2]
                found = np.zeros((u.size, u.size))
                found[row, np.repeat(np.arange(u.size), np.diff(start))] = values
                found += np.tril(found, -1).T
                ways = 1e-6 * np.eye(u.size)
                by = np.array([body.tangent(u + way)[0] - body.tangent(u - way)[0] for way in ways]) / 2e-6
                off = np.abs(0.5 * (by + by.T) - found).max() / np.abs(by).max()
                print(kind, plane, kinematics, off, np.abs(by - by.T).max() / np.abs(by).max())
                assert np.linalg.eigvalsh(found)[0] < 0 and off < 1e-5
