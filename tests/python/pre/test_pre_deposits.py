"""Deposits: no overlap, every grain carried, dense, exact scaling, refusals."""

from itertools import combinations

import numpy as np
import pytest
from cairn import pre
from cairn.pre import grains


def neighbours(centers, radii):
    """Pairs of grains nearer than a tenth of the largest radius, and their gaps over the smaller radius."""
    order = np.argsort(centers[:, -1])
    height, found = centers[order, -1], []
    reach = 2.1 * radii.max()
    stop = np.searchsorted(height, height + reach)
    for a in range(len(order)):
        i, others = order[a], order[a + 1 : stop[a]]
        gap = np.linalg.norm(centers[others] - centers[i], axis=1) - radii[others] - radii[i]
        near = gap < 0.1 * radii.max()
        found += [(i, j, g / min(radii[i], radii[j])) for j, g in zip(others[near], gap[near], strict=True)]
    return np.array(found).reshape(-1, 3)


def walls(lengths):
    """Normals and offsets of the floor and the side walls."""
    dim = len(lengths) + 1
    normals, offsets = [np.eye(dim)[-1]], [0.0]
    for axis, length in enumerate(lengths):
        normals += [np.eye(dim)[axis], -np.eye(dim)[axis]]
        offsets += [0.0, -length]
    return np.array(normals), np.array(offsets)


def carried(pushes):
    """True if non-negative forces along given directions (m, dim) can balance a weight."""
    dim = pushes.shape[1]
    if np.any(pushes[:, -1] > 1 - 1e-12):
        return True
    for chosen in combinations(pushes, dim):
        matrix = np.array(chosen).T
        if abs(np.linalg.det(matrix)) > 1e-12 and np.linalg.solve(matrix, np.eye(dim)[-1]).min() > -1e-6:
            return True
    return False


def check(centers, radii, lengths):
    """No overlap, and every grain is carried by those that were there before it, the floor and the walls."""
    pairs = neighbours(centers, radii)
    normals, offsets = walls(lengths)
    gaps = (centers @ normals.T - offsets - radii[:, None]) / radii[:, None]
    assert np.all(np.isfinite(centers))
    assert pairs[:, 2].min(initial=0.0) > -1e-9 and gaps.min() > -1e-9
    pushes = [[n for n, g in zip(normals, row, strict=True) if g < 1e-9] for row in gaps]
    for i, j in pairs[pairs[:, 2] < 1e-9][:, :2].astype(int):
        later, earlier = max(i, j), min(i, j)
        pushes[later].append((centers[later] - centers[earlier]) / (radii[later] + radii[earlier]))
    assert all(carried(np.array(p).reshape(-1, len(lengths) + 1)) for p in pushes)


DISKS = {
    "narrow": (grains.uniform(3000, 0.42, 0.56, rng=1), 100.0, 0.80),
    "wide": (grains.uniform(3000, 0.05, 1.0, rng=2, by="mass"), 40.0, 0.80),
    "lognormal": (grains.lognormal(2000, 1e-3, 0.4, rng=3), 0.06, 0.80),
    "equal": (np.full(1000, 0.5), 20.3, 0.80),
    "equal that fit the box": (np.full(500, 0.5), 20.0, 0.88),
    "one column": (grains.uniform(200, 0.4, 0.5, rng=4), 1.0, 0.3),
    "two columns": (grains.uniform(200, 0.4, 0.5, rng=4), 1.7, 0.4),
}


@pytest.mark.parametrize("case", DISKS)
def test_disks(case):
    radii, width, solid = DISKS[case]
    centers = pre.deposit_disks(radii, width)
    check(centers, radii, (width,))
    top = np.quantile(centers[:, 1], 0.8)
    assert pre.solid_fraction(centers, radii, (0.0, 2 * radii.max()), (width, top)) > solid


@pytest.mark.parametrize("seed", range(40))
def test_disks_of_any_size_in_any_box(seed):
    rng = np.random.default_rng(seed)
    radii = grains.uniform(rng.integers(1, 150), 10.0 ** -rng.uniform(0.0, 2.5), 1.0, rng=rng, by="mass")
    width = 2.0 * radii.max() * (1.0 + 10.0 ** rng.uniform(-3.0, 1.5))
    check(pre.deposit_disks(radii, width), radii, (width,))


SPHERES = {
    "narrow": (grains.uniform(700, 0.45, 0.55, rng=1), (7.0, 8.0), 0.55),
    "wide": (grains.uniform(200, 0.2, 1.0, rng=2), (6.0, 6.0), 0.5),
    "equal": (np.full(400, 0.5), (6.0, 6.0), 0.54),
    "one column": (grains.uniform(60, 0.4, 0.5, rng=3), (1.0, 1.1), 0.2),
    "slit": (grains.uniform(100, 0.4, 0.5, rng=4), (1.2, 7.0), 0.2),
}


@pytest.mark.parametrize("case", SPHERES)
def test_spheres(case):
    radii, lengths, solid = SPHERES[case]
    centers = pre.deposit_spheres(radii, lengths)
    check(centers, radii, lengths)
    top = np.quantile(centers[:, 2], 0.7)
    assert pre.solid_fraction(centers, radii, (0.0, 0.0, 2 * radii.max()), (*lengths, top)) > solid


@pytest.mark.parametrize("seed", range(12))
def test_spheres_of_any_size_in_any_box(seed):
    rng = np.random.default_rng(seed)
    radii = grains.uniform(rng.integers(1, 40), 10.0 ** -rng.uniform(0.0, 1.0), 1.0, rng=rng)
    lengths = 2.0 * radii.max() * (1.0 + 10.0 ** rng.uniform(-3.0, 0.5, 2))
    check(pre.deposit_spheres(radii, lengths), radii, lengths)


@pytest.mark.parametrize("n", [0, 1, 2, 3])
def test_few(n):
    assert pre.deposit_disks(np.ones(n), 4.0).shape == (n, 2)
    assert pre.deposit_spheres(np.ones(n), (4.0, 4.0)).shape == (n, 3)


@pytest.mark.parametrize("power", [-30, 12])
def test_exact_scaling(power):
    radii = grains.uniform(300, 0.3, 0.6, rng=5)
    scaled = np.ldexp(radii, power)
    assert np.array_equal(np.ldexp(pre.deposit_disks(radii, 10.0), power), pre.deposit_disks(scaled, np.ldexp(10.0, power)))
    spheres = pre.deposit_spheres(radii[:60], (2.0, 3.0))
    assert np.array_equal(np.ldexp(spheres, power), pre.deposit_spheres(scaled[:60], np.ldexp((2.0, 3.0), power)))


def test_solid_fraction_is_exact():
    disk = ([[0.5, 0.5]], [0.5])
    assert pre.solid_fraction(*disk, (0, 0), (1, 1)) == pytest.approx(np.pi / 4, rel=1e-14)
    assert pre.solid_fraction(*disk, (0, 0), (1, 0.5)) == pytest.approx(np.pi / 4, rel=1e-14)
    cap = np.pi * 0.2**2 * (3 * 0.5 - 0.2) / 3
    sphere = ([[0.5, 0.5, 0.5]], [0.5])
    assert pre.solid_fraction(*sphere, (0, 0, 0.8), (1, 1, 2)) == pytest.approx(cap / 1.2, rel=1e-12)


def test_layers():
    centers = np.array([[0.0, 1.0], [5.0, 3.0], [1.0, 2.9], [2.0, 1.9]])
    assert pre.layers(centers, 2).tolist() == [0, 1, 1, 0]
    assert pre.layers(centers, 5, axis=0).tolist() == [0, 4, 1, 2]
    assert pre.layers(np.ones((3, 3)), 4).tolist() == [0, 0, 0]


@pytest.mark.parametrize(
    ("name", "cells", "solid", "neighbours_each"),
    [
        ("square", (7, 8), np.pi / 4, 4),
        ("triangular", (7, 5), np.pi / np.sqrt(12), 6),
        ("sc", (4, 5, 6), np.pi / 6, 6),
        ("bcc", (4, 4, 4), np.pi * np.sqrt(3) / 8, 8),
        ("fcc", (4, 4, 4), np.pi / np.sqrt(18), 12),
        ("hcp", (5, 4, 3), np.pi / np.sqrt(18), 12),
    ],
)
def test_lattices(name, cells, solid, neighbours_each):
    spacing = 0.25
    centers = pre.lattice(name, cells, spacing)
    distance = np.linalg.norm(centers[:, None] - centers, axis=2)
    np.fill_diagonal(distance, np.inf)
    assert distance.min() == pytest.approx(spacing, rel=1e-12)
    assert np.sum(distance < spacing * 1.001, axis=1).max() == neighbours_each
    assert np.allclose(centers.min(axis=0), spacing / 2)
    cell = np.array(pre.lattices.CELLS[name][1]) * spacing
    dim = len(cells)
    grain = (np.pi / 4 if dim == 2 else np.pi / 6) * spacing**dim
    assert len(centers) / np.prod(cells) * grain / np.prod(cell) == pytest.approx(solid, rel=1e-12)


def test_jitter():
    plain, moved = pre.lattice("sc", (3, 3, 3), 2.0), pre.lattice("sc", (3, 3, 3), 2.0, jitter=0.1, rng=1)
    assert 0.1 < np.abs(moved - plain).max() <= 0.2
    assert np.array_equal(moved, pre.lattice("sc", (3, 3, 3), 2.0, jitter=0.1, rng=1))


def test_box_walls_point_inwards():
    points, normals = pre.box_walls((0.0, -1.0, 2.0), (1.0, 1.0, 5.0), lid=True)
    middle = np.array([0.5, 0.0, 3.5])
    assert np.allclose(np.einsum("ij,ij->i", middle - points, normals), [0.5, 0.5, 1.0, 1.0, 1.5, 1.5])
    assert len(pre.box_walls((0.0, 0.0), (1.0, 1.0))[0]) == 3


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: pre.deposit_disks([1.0, -2.0], 9.0), ["radii[1] is -2.0", "> 0"]),
        (lambda: pre.deposit_disks([1.0, np.nan], 9.0), ["radii[1] is nan", "finite"]),
        (lambda: pre.deposit_disks([[1.0]], 9.0), ["radii has shape (1, 1)", "(n,)"]),
        (lambda: pre.deposit_disks(["a"], 9.0), ["radii", "real numbers"]),
        (lambda: pre.deposit_disks([1.0, 3.0], 5.0), ["width is 5.0", "radii[1]", "at least 6.0"]),
        (lambda: pre.deposit_disks([1.0], 0.0), ["width is 0.0", "> 0"]),
        (lambda: pre.deposit_spheres([1.0], 5.0), ["lengths has shape ()", "(2,)"]),
        (lambda: pre.deposit_spheres([1.0], (5.0, 1.0)), ["lengths[1] is 1.0", "at least 2.0"]),
        (lambda: pre.solid_fraction([[0.0, 0.0]], [1.0, 2.0], (0, 0), (1, 1)), ["radii has 2", "centers 1"]),
        (lambda: pre.solid_fraction([[0.0, 0.0]], [1.0], (0, 0), (1, 0)), ["high[1] is 0.0", "opposite"]),
        (lambda: pre.layers([[0.0, 0.0]], 0), ["count is 0", ">= 1"]),
        (lambda: pre.layers([[0.0, 0.0]], 2, axis=2), ["axis is 2", "-1"]),
        (lambda: pre.lattice("diamond", (1, 1), 1.0), ["name is 'diamond'", "fcc"]),
        (lambda: pre.lattice("fcc", (1, 1), 1.0), ["cells is (1, 1)", "3 whole"]),
        (lambda: pre.lattice("square", (1, -1), 1.0), ["cells[1] is -1"]),
        (lambda: pre.lattice("square", (1, 1), 1.0, jitter=0.1), ["rng is None", "seed"]),
        (lambda: pre.lattice("square", (1, 1), 1.0, jitter=0.6, rng=0), ["jitter is 0.6", "0.5"]),
        (lambda: pre.box_walls((0, 0), (1, 0)), ["high[1] is 0.0", "opposite"]),
    ],
)
def test_refusals_name_field_value_and_remedy(call, words):
    with pytest.raises(ValueError) as refusal:
        call()
    for word in words:
        assert word in str(refusal.value)
