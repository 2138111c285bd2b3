"""Meshes whose displacements count as small tell when they turn; largest kinetic energies are those of whole mass matrices."""

import warnings

import cairn as cn
import numpy as np
import pytest

SOFT = cn.Material("soft", density=2000.0)
ELASTIC = {"young": 1e9, "poisson": 0.3}
SPIN = 10.0


def block(dim, scale=1.0):
    grid = np.meshgrid(*[np.linspace(-1, 1, 3) * scale] * dim, indexing="ij")
    number = np.arange(3**dim).reshape((3,) * dim)
    if dim == 2:
        cells = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], -1).reshape(-1, 4)
    else:
        low = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
        cells = np.stack([each[..., k] for k in (slice(-1), slice(1, None)) for each in low], -1).reshape(-1, 8)
    points = np.stack([axis.ravel() for axis in grid], axis=1)
    return points, {"quad" if dim == 2 else "hexahedron": cells}


def spinning(points):
    """Velocities of SPIN about the middle, in space about the diagonal."""
    if points.shape[1] == 2:
        return SPIN * np.stack([-points[:, 1], points[:, 0]], axis=1)
    return np.cross(np.ones(3) / np.sqrt(3) * SPIN, points)


def turned(body, points, dt, steps):
    scene = cn.Scene(points.shape[1])
    scene.add(cn.deformable(body, SOFT, velocity=spinning(points - points.mean(axis=0)), name="wheel"))
    with warnings.catch_warnings(record=True) as kept:
        warnings.simplefilter("always")
        sim = cn.Simulation(scene, dt, cn.NSCD(0.5))
        infos = [sim.step() for _ in range(steps)]
    return infos, sim.energy, [str(each.message) for each in kept if each.category is cn.TurnedWarning]


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e5])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_linear_mesh_tells_once_that_it_has_turned(dim, scale):
    points, cells = block(dim, scale)
    infos, _, texts = turned(cn.ElasticBody(points, cells, density=2000.0, **ELASTIC), points, 1.1e-3, 20)
    assert not any("mesh_turned" in info for info in infos[:9])  # 0.011 rad a step
    assert all("mesh_turned" in info for info in infos[9:])
    (text,) = texts
    assert "'wheel' has turned by 0.1" in text and "SolidBody" in text and "0.6 %" in text


def test_bodies_that_may_turn_say_nothing_and_solids_of_small_displacements_do():
    points, cells = block(2)
    for kinematics, tells in (("total_lagrangian", False), ("small", True)):
        material = cn.IsotropicElastic(**ELASTIC) if tells else cn.SaintVenantKirchhoff(**ELASTIC)
        body = cn.SolidBody(points, cells, material, density=2000.0, kinematics=kinematics)
        infos, _, texts = turned(body, points, 5e-3, 6)
        assert bool(texts) == tells and ("mesh_turned" in infos[-1]) == tells


def test_the_largest_kinetic_energy_counts_the_whole_mass_matrix():
    points, cells = block(3)
    _, energy, _ = turned(cn.ElasticBody(points, cells, density=2000.0, **ELASTIC), points, 1e-4, 1)
    exact = 0.5 * 2000.0 * 8 * SPIN**2 * 8 / 12  # a cube of 2 m, m a^2 / 6 about any axis
    assert energy["kinetic"] == pytest.approx(exact, rel=1e-6)
    assert energy["largest_kinetic"] == pytest.approx(exact, rel=1e-6)
