"""What a bar that is torn apart spends, over the fracture energy of its section: one row of cells softens, of any first order."""

import cairn as cn
import numpy as np
import pytest
from second_order import box

YOUNG, STRENGTH, CELLS, SIDE, TOUGH = 1e9, 1e6, 5, 0.2, 20
SPLIT = {
    "triangle": [(0, 1, 2), (0, 2, 3)],
    "tetra": [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)],
}


def torn(kind, across=2):
    """Dissipated over the fracture energy of the section, of square cells or of what they are cut into."""
    dim = 3 if kind in ("hexahedron", "tetra") else 2
    whole = {2: "quad", 3: "hexahedron"}[dim]
    points, cells = box(whole, (CELLS,) + (across,) * (dim - 1), (CELLS * SIDE,) + (across * SIDE,) * (dim - 1))
    cells = cells[whole] if isinstance(cells, dict) else cells
    middle = np.abs(points[cells].mean(axis=1)[:, 0] - CELLS * SIDE / 2) < SIDE / 2
    parts = SPLIT.get(kind, [tuple(range(cells.shape[1]))])
    cells = np.concatenate([cells[:, list(part)] for part in parts])
    fracture = 0.5 * STRENGTH**2 / YOUNG * SIDE * TOUGH
    damages = cn.IsotropicDamage(young=YOUNG, poisson=0.0, strength=STRENGTH, fracture_energy=fracture)
    materials = [cn.IsotropicElastic(young=YOUNG), damages], np.tile(middle, len(parts)).astype(int)
    ends = {"left": np.flatnonzero(points[:, 0] < 1e-9), "right": np.flatnonzero(points[:, 0] > CELLS * SIDE - 1e-9)}
    plane = {"plane": "stress"} if dim == 2 else {}
    body = cn.SolidBody(points, {kind: cells}, {kind: materials}, density=1e3, groups=ends, kinematics="small", **plane)
    opening, duration, steps = 9 * fracture / STRENGTH + STRENGTH / YOUNG * CELLS * SIDE, 12.0, 300
    scene = cn.Scene(dim=dim)
    pull = {"right": {"x": lambda t: opening * t / duration}}
    scene.add(cn.deformable(body, cn.Material("rock", density=1e3), fixed={"left": "xyz"[:dim]}, displace=pull))
    sim = cn.Simulation(scene, duration / steps, strategy=cn.NSCD(theta=1.0, cut_back=6))
    for _ in range(steps):
        assert sim.step()["status"] == "converged"
    return sim.energy["dissipated_material"] / (fracture * (across * SIDE) ** (dim - 1))


@pytest.mark.parametrize("kind, whole", [("triangle", "quad"), ("tetra", "hexahedron")])
def test_cells_that_fill_a_square_or_cube_spend_what_it_does(kind, whole):
    """What is above 1 is of the length of the steps: 1.008 by eight times as many."""
    parts, one = torn(kind), torn(whole)
    print(kind, parts, whole, one)
    assert parts == pytest.approx(one, rel=1e-6)
    assert one == pytest.approx(1.0, abs=0.08)
