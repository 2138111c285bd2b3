"""Vaults, domes, cut volumes and stones: convex, flush, of the drawn volume and shape."""

import numpy as np
import pytest
from cairn.post import limit_analysis
from cairn.pre import masonry, mesh, stones
from test_pre_masonry import sound, tied


def test_barrel_vault():
    b = masonry.barrel_vault(4.0, 3, radius=2.0, thickness=0.4, voussoirs=9)
    area = 9 * (2.2**2 - 1.8**2) / 2 * np.sin(np.pi / 9)
    assert sound(b, "barrel") == pytest.approx(4 * area, rel=1e-13) and tied(b)


@pytest.mark.parametrize("courses", [1, 3, 4])
def test_groin_vault(courses):
    b = masonry.groin_vault(courses, radius=2.0, thickness=0.4, voussoirs=8)
    volume = sound(b, "groin")
    # a voussoir at x of the barrel along y is kept from |x| on: sum over the outline's area times (reach - mean |x|)
    inner, outer = masonry_outline(2.0, 0.4, 8)
    exact = 0.0
    for k in range(8):
        outline = np.array([inner[k], inner[k + 1], outer[k + 1], outer[k]])
        x, z = outline.T
        w = x * np.roll(z, -1) - np.roll(x, -1) * z
        area, moment = abs(w.sum()) / 2, abs(np.sum(w * (x + np.roll(x, -1)))) / 6
        exact += 4 * (2.2 * area - moment)
    assert volume == pytest.approx(exact, rel=1e-12) and tied(b)


@pytest.mark.parametrize(
    "vault", [masonry.groin_vault(4, radius=2.0, thickness=0.4, voussoirs=13), masonry.cross_vault(4.0, 3.0, 0.4, 12)]
)
def test_vaults_have_no_splinters_and_stand(vault):
    """Pieces cut off by the diagonals that are too small for blocks are merged with the next; mu 0.6 then carries the vault."""
    measure = vault.properties().measure[vault.mask("web")]
    assert measure.min() > 0.1 * np.median(measure)
    assert limit_analysis.Assembly(vault, 0.6).stands().status == "optimal"


def masonry_outline(radius, thickness, n):
    from cairn.pre import arches

    return arches.ring(radius, thickness, n)


def test_cross_vault():
    b = masonry.cross_vault(4.0, 3.0, 0.3, 8, courses=2)
    assert sound(b, "cross") > 0 and tied(b)


@pytest.mark.parametrize("eye", [0.0, 0.3])
def test_dome(eye):
    b = masonry.dome(3.0, 0.4, 6, 40, eye=eye)
    top = eye if eye else np.pi / 14
    # the keystone is a slice of the shell whose faces are flat, a little less
    exact = 2 * np.pi / 3 * (3.2**3 - 2.8**3) * np.cos(top)
    solid = sound(b.select([p != "keystone" for p in b.part]), "dome")
    assert solid == pytest.approx(exact, rel=0.03) and solid < exact
    assert tied(b) and b.mask("keystone").sum() == (eye == 0)


@pytest.mark.parametrize("dim", [2, 3])
def test_voronoi(dim):
    low, high = np.zeros(dim), np.array([2.0, 1.0, 1.5][:dim])
    b = masonry.voronoi(low, high, 30, rng=7)
    assert len(b) == 30
    assert sound(b, "cells") == pytest.approx(np.prod(high), rel=1e-9)
    j = b.joints()
    assert tied(b) and len(j.area) > 30
    again = masonry.voronoi(low, high, 30, rng=7)
    assert all(np.array_equal(v, w) for v, w in zip(b.vertices, again.vertices))


def test_random_polyhedra():
    rng = np.random.default_rng(3)
    for angularity, fewest in ((1.0, 5), (0.0, 60)):
        for v, f in masonry.random_polyhedra(20, 0.4, elongation=0.7, flatness=0.5, angularity=angularity, rng=rng):
            assert mesh.check(v, f).convex and len(v) >= fewest
            np.testing.assert_allclose(np.ptp(v, axis=0), 0.4 * np.array([1, 0.7, 0.35]), rtol=1e-12)
    for p in masonry.random_polygons(20, [0.4] * 20, elongation=0.6, angularity=0.5, rng=rng):
        mesh.check_polygon(p)
        np.testing.assert_allclose(np.ptp(p, axis=0), [0.4, 0.24], rtol=1e-12)
    with pytest.raises(ValueError, match="angularity"):
        masonry.random_polyhedra(1, 1.0, angularity=2, rng=1)


def test_loose_stones_are_apart():
    made = masonry.random_polyhedra(30, 0.4, rng=1)
    positions, turns = stones.loose(made, (0, 0, 0), (2, 2, 9), rng=2)
    assert positions.shape == (30, 3) and np.allclose(np.linalg.norm(turns, axis=1), 1)
    reach = max(np.linalg.norm(v, axis=1).max() for v, _ in made)
    gap = np.linalg.norm(positions[:, None] - positions[None], axis=2) + 9 * np.eye(30)
    assert gap.min() > 2 * reach and positions.min() >= reach
