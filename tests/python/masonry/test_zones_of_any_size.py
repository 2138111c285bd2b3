"""Meshes on cohesive zones at sizes from 1e-9 to 1e6 m: interior points and multipliers have no scale of their own."""

import cairn as cn
import numpy as np
import pytest

SIZES = {"1e-9 m": 2.0**-30, "1e6 m": 2.0**20}


def cells(dim, counts):
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, n + 1) for n in counts], indexing="ij"), -1).reshape(-1, dim)
    k = np.arange(len(grid)).reshape([n + 1 for n in counts])
    around = [k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]]
    if dim == 2:
        return grid, {"quad": np.stack(around, -1).reshape(-1, 4)}
    return grid, {"hexahedron": np.stack([n[..., :-1] for n in around] + [n[..., 1:] for n in around], -1).reshape(-1, 8)}


def sheared(dim, size):
    """Displacements and velocities over the size of a block of 1 x .5 `size` that slides off its zones; statuses of steps."""
    stress = 2e5 * size**2  # [Pa]; grows with size^2 at the same density and time
    zone = {"normal_stiffness": 1e11 * size, "tangential_stiffness": 5e10 * size, "mu": 0.6}
    works = {"normal_work": 20.0 * size**3, "tangential_work": 40.0 * size**3}
    law = cn.EXPO(**zone, normal_strength=stress, tangential_strength=stress, **works)
    grid, mesh = cells(dim, [3] * (dim - 1) + [2])
    points = size * grid * ([1.0] * (dim - 1) + [0.5])
    stone = cn.Material("stone", density=2000.0)
    push = np.zeros(dim)
    push[: dim - 1] = size * np.array([0.04, 0.015])[: dim - 1]
    groups = {"foot": np.flatnonzero(grid[:, -1] == 0)}
    body = cn.ElasticBody(points, mesh, young=1e10 * size**2, poisson=0.2, density=2000.0, groups=groups)
    scene = cn.Scene(dim, gravity=(0.0,) * (dim - 1) + (-9.81 * size,))
    low, high = np.r_[[-1.0] * (dim - 1), -0.5] * size, np.r_[[2.0] * (dim - 1), 0.0] * size
    if dim == 2:
        base = cn.polygons([np.array([low, [high[0], low[1]], high, [low[0], high[1]]])], stone, fixed=True)
    else:
        base = cn.boxes([(low + high) / 2], [high - low], stone, fixed=True)
    scene.add(base, cn.deformable(body, stone, contact="foot", velocity=push, **{"edges" if dim == 2 else "faces": "foot"}))
    scene.interact("*", "*", law)
    sim = cn.Simulation(scene, 2.0**-10)
    ends = [sim.step()["status"] for _ in range(8)]
    return (sim.nodes.position - points) / size, sim.nodes.velocity / size, ends


@pytest.mark.parametrize("dim", [2, 3])
def test_zones_of_meshes_at_any_size(dim):
    moved, speed, ends = sheared(dim, 1.0)
    assert ends.count("converged") >= 7 and np.isfinite(moved).all() and np.abs(moved).max() > 1e-5
    for size in SIZES.values():
        again, now, those = sheared(dim, size)
        assert np.array_equal(again, moved) and np.array_equal(now, speed)
        assert those == ends
