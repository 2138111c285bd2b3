"""Bodies at large strain against tables: Cook's membrane, the elastica, plastic tubes and spheres, Hertz's contacts."""

import sys
from pathlib import Path

import numpy as np
import pytest
from cairn import ElasticBody, J2Plasticity, NeoHookean, SolidBody
from cairn.build.bulk import BULK_MATERIALS
from report import judge

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python"))
from second_order import box  # noqa: E402

HOOKE = BULK_MATERIALS["IsotropicElastic"]


def cook(kind, n):
    """Points, cells and groups of the membrane (48; 44 to 60 mm)."""

    def place(x):
        left, right = 44 * x[:, 1], 44 + 16 * x[:, 1]
        return np.stack([48 * x[:, 0], left + (right - left) * x[:, 0]], 1)

    points, cells = box(kind, (n, n), (1.0, 1.0), place)
    edge = np.flatnonzero(points[:, 0] > 48 - 1e-9)
    edge = edge[np.argsort(points[edge, 1])]
    return points, cells, np.flatnonzero(points[:, 0] < 1e-9), edge


def along_edge(points, edge, total, order):
    """Nodal forces of a uniform shear along an edge of straight cells."""
    force = np.zeros((len(points), 2))
    size = np.diff(points[edge[::order], 1])
    share = np.array([1, 1]) / 2 if order == 1 else np.array([1, 4, 1]) / 6
    for k, length in enumerate(size):
        force[edge[order * k : order * k + order + 1], 1] += share * length / 16 * total
    return force.ravel()


def test_cook_linear():
    """Plane stress, E = 1, nu = 1/3, force 1: middle of the edge at 23.965."""
    table = (("quad", 1, 16, 23.430), ("quad", 1, 32, 23.818), ("quad9", 2, 8, 23.925), ("quad9", 2, 16, 23.949))
    for kind, order, n, expected in table:
        points, cells, held, edge = cook(kind, n)
        body = ElasticBody(points, cells, young=1.0, poisson=1 / 3, plane="stress", groups={"held": held})
        u = body.solve({"held": "xy"}, along_edge(points, edge, 1.0, order))
        middle = edge[np.argmin(np.abs(points[edge, 1] - 52))]
        judge(f"{kind} {n}", u[middle, 1], expected, 5e-5)
    judge("quad9 16, limit", u[middle, 1], 23.965, 1e-3)
    points, cells, held, edge = cook("quad9", 16)
    solid = SolidBody(points, cells, HOOKE(young=1.0, poisson=1 / 3), plane="stress", groups={"held": held})
    again = solid.solve({"held": "xy"}, along_edge(points, edge, 1.0, 2))
    judge("the same by the batch", again, u, 1e-9)


def test_cook_at_large_strain():
    """Plane strain, neo-Hookean, E = 240.565, force 100: middle and top of the edge."""
    for kind, order, n, poisson, mean, expected in (
        ("quad9", 2, 8, 0.3, False, (7.8726, 7.7407)),
        ("quad", 1, 32, 0.3, False, (7.8436, 7.7178)),
        ("quad9", 2, 4, 0.4999, False, (5.971, None)),
        ("quad9", 2, 8, 0.4999, False, (6.599, None)),
    ):
        points, cells, held, edge = cook(kind, n)
        rubber = NeoHookean(young=240.565, poisson=poisson)
        body = SolidBody(points, cells, rubber, groups={"held": held}, mean_dilatation=mean)
        u = body.solve({"held": "xy"}, along_edge(points, edge, 100.0, order), increments=6)
        middle = edge[np.argmin(np.abs(points[edge, 1] - 52))]
        judge(f"{kind} {n} nu {poisson} middle", u[middle, 1], expected[0], 1e-4)
        if expected[1]:
            judge(f"{kind} {n} nu {poisson} top", u[edge[-1], 1], expected[1], 1e-4)
    found = []
    for n in (8, 16, 32):
        points, cells, held, edge = cook("quad", n)
        rubber = NeoHookean(young=240.565, poisson=0.4999)
        body = SolidBody(points, cells, rubber, groups={"held": held}, mean_dilatation=True)
        u = body.solve({"held": "xy"}, along_edge(points, edge, 100.0, 1), increments=6)
        found.append(u[edge[np.argmin(np.abs(points[edge, 1] - 52))], 1])
    print("mean dilatation, nu .4999:", found)
    judge("does not lock", found[-1], 6.9, 0.01)
    # limit of three kinds of second order, which come to 6.9575, 6.969 and 6.962 with 32 cells, the second from above
    for kind, n, gate in (("quad9", 4, 5e-3), ("quad9", 8, 3e-3), ("quad8", 16, 5e-3), ("triangle6", 8, 3e-3)):
        points, cells, held, edge = cook(kind, n)
        body = SolidBody(points, cells, rubber, groups={"held": held}, mean_dilatation=True)
        u = body.solve({"held": "xy"}, along_edge(points, edge, 100.0, 2), increments=6)
        of_kind = u[edge[np.argmin(np.abs(points[edge, 1] - 52))], 1]
        print("mean dilatation, nu .4999:", kind, n, of_kind)
        judge(f"{kind} {n} does not lock", of_kind, 6.96, gate)
    assert found[2] - found[1] < 0.4 * (found[1] - found[0])


def test_a_load_that_finds_no_rest_at_once_is_halved():
    """Four iterations do not take the whole load, but each of its halves; one takes none of it."""
    points, cells, held, edge = cook("quad", 4)
    body = SolidBody(points, cells, NeoHookean(young=240.565, poisson=0.3), groups={"held": held})
    load = along_edge(points, edge, 100.0, 1)
    whole = body.solve({"held": "xy"}, load)
    np.testing.assert_allclose(body.solve({"held": "xy"}, load, most=4), whole, rtol=0, atol=1e-9 * np.abs(whole).max())
    with pytest.raises(RuntimeError, match="no rest after 1 iterations"):
        body.solve({"held": "xy"}, load, most=1)


@pytest.mark.parametrize("kinematics", ["corotational", "total_lagrangian"])
def test_elastica(kinematics):
    """A clamped beam of slenderness 100 under a dead load across its end (Bisshopp & Drucker 1945)."""
    table = {0.5: (0.015919, 0.162144), 1.0: (0.056433, 0.301721), 3.0: (0.254420, 0.603253), 10.0: (0.554996, 0.810609)}
    length, young, cells = 1.0, 1e6, 40
    thick = length / 100
    points, kinds = box("quad8", (cells, 1), (length, thick))
    groups = {"held": np.flatnonzero(points[:, 0] < 1e-9), "end": np.flatnonzero(points[:, 0] > length - 1e-9)}
    body = SolidBody(points, kinds, HOOKE(young=young, poisson=0.0), plane="stress", kinematics=kinematics, groups=groups)
    end = groups["end"]
    middle = end[np.argmin(np.abs(points[end, 1] - thick / 2))]
    u = np.zeros_like(points)
    for load, (shortening, way) in table.items():
        force = np.zeros_like(points)
        force[end, 1] = np.where(end == middle, 4, 1) / 6 * load * young * thick**3 / 12 / length**2
        u = body.solve({"held": "xy"}, force.ravel(), start=u, increments=1, most=200)
        judge(f"load {load} shortening", -u[middle, 0] / length, shortening, 5e-3)
        judge(f"load {load} way", u[middle, 1] / length, way, 5e-3)


def test_plastic_tube_and_sphere():
    """Pressure on a thick shell of perfect plasticity, by axisymmetric cells: the plastic radius is 1.5 at 1.1963 sy."""
    n, young = 24, 1000.0

    def shell(x):  # a sector of 20 degrees beside the equator
        r, t = 1 + x[:, 0], (x[:, 1] - 0.5) * np.deg2rad(10)
        return np.stack([r * np.cos(t), r * np.sin(t)], 1)

    points, cells = box("quad9", (n, 1), (1.0, 1.0), shell)
    angle, radius = np.arctan2(points[:, 1], points[:, 0]), np.hypot(*points.T)
    # the displacement of the closed form is given everywhere, and the pressure that it needs is compared
    steel = J2Plasticity(young=young, poisson=0.3, yield_stress=1.0)
    body = SolidBody(points, cells, steel, plane="axisymmetric", groups={"all": np.arange(len(points))})
    plastic = 1.5
    shear, bulk = young / 2.6, young / (3 * 0.4)
    b = 2.0
    # Hill (1950): elastic outside the plastic radius; inside the change of volume stays elastic
    k = 2 / 3 * plastic**3 / b**3

    def stress_r(r):
        inside = -2 * np.log(plastic / r) - 2 / 3 * (1 - plastic**3 / b**3)
        outside = -k * (b**3 / r**3 - 1)
        return np.where(r < plastic, inside, outside)

    def way(r):
        """u = A r + B / r^2 in the elastic part, and div u = tr(sigma) / 3K inside."""
        a_, b_ = k / (3 * bulk), k * b**3 / (4 * shear)
        outside = a_ * r + b_ / r**2
        at_c = a_ * plastic + b_ / plastic**2
        # trace of the stress inside: 3 s_r + 2
        grid = np.linspace(1.0, plastic, 4001)
        trace = (3 * stress_r(grid) + 2) / (3 * bulk) * grid**2
        area = np.concatenate([[0], np.cumsum((trace[1:] + trace[:-1]) / 2 * np.diff(grid))])
        inside = (at_c * plastic**2 - np.interp(plastic, grid, area) + np.interp(r, grid, area)) / r**2
        return np.where(r < plastic, inside, outside)

    u = way(radius)[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
    model = body.model()
    for share in np.linspace(0.1, 1.0, 30):
        force = body.tangent(share * u, model)[0].reshape(-1, 2)
        model.commit()
    inner = np.isclose(radius, 1.0)
    # of the pressure on a spherical belt the part along the radius of the equator
    pressure = (force[inner] * points[inner]).sum() / (2 * np.pi * 2 * np.sin(np.deg2rad(5)))
    judge("inner pressure", pressure, 1.196347, 1e-2)


def test_plastic_cylinder():
    """A long thick tube that keeps its volume, a = 1, b = 2, k = sy / sqrt 3: pressure at first yield, and where the plastic part
    reaches 1.5 and 2 (Hill 1950)."""
    n, young, height = 24, 1000.0, 0.1
    points, cells = box("quad", (n, 1), (1.0, height), lambda x: x + [1.0, 0.0])
    steel = J2Plasticity(young=young, poisson=0.4999, yield_stress=1.0)
    inner = np.flatnonzero(points[:, 0] < 1 + 1e-9)
    body = SolidBody(
        points, cells, steel, plane="axisymmetric", mean_dilatation=True, groups={"all": np.arange(len(points)), "inner": inner}
    )
    k, shear = 1 / np.sqrt(3), young / (2 * 1.4999)
    model, u = body.model(), np.zeros_like(points)
    for radius in (1.0, 1.5, 2.0):
        wanted = np.zeros_like(points)
        wanted[inner, 0] = k * radius**2 / (2 * shear)  # of the wall, since all keeps its volume
        u = body.solve({"all": "y", "inner": "x"}, displacement=wanted, start=u, model=model, increments=8)
        force = body.tangent(u, model)[0].reshape(-1, 2)[inner, 0].sum()
        pressure = 2 * k * np.log(radius) + k * (1 - radius**2 / 4)
        judge(f"pressure, plastic to {radius}", force / (2 * np.pi * height), pressure, 1e-2)
