"""Limit analysis against the textbook: arches, overturning, sliding, tilting; each figure printed beside its reference."""

import numpy as np
import pytest
from cairn.post import limit_analysis
from cairn.pre import blocks, masonry
from report import judge

pytest.importorskip("scipy")


def assembly(thickness, voussoirs, mu=2.0, curved=True, **options):
    b = masonry.arch(radius=1.0, thickness=thickness, voussoirs=voussoirs, **options)
    if not curved:
        return limit_analysis.Assembly(b, mu)
    area, center = limit_analysis.arch_sectors(1.0, thickness, voussoirs)
    p = b.properties()
    measure, centers = p.measure.copy(), p.center.copy()
    measure[:voussoirs], centers[:voussoirs] = area, center
    return limit_analysis.Assembly(b, mu, measure=measure, center=centers)


@pytest.mark.parametrize("voussoirs,reference", [(7, 0.0962), (11, 0.1049), (27, 0.1068), (101, 0.1075)])
def test_least_thickness_of_the_semicircular_arch(voussoirs, reference):
    """Makris & Alexakis 2013; Cocchetti & Rizzi 2020."""
    least = limit_analysis.bisect(lambda t: assembly(t, voussoirs).stands().status == "optimal", 0.05, 0.2, 1e-4)
    judge(f"least t/R of {voussoirs} voussoirs", least, reference, 1e-3)


@pytest.mark.parametrize("thickness,low,high", [(0.12, 0.1908, 0.2070), (0.15, 0.1758, 0.2270), (0.2, 0.1540, 0.2546)])
def test_bounds_of_the_thrust(thickness, low, high):
    """Ochsendorf 2006."""
    a = assembly(thickness, 101)
    weight = a.mass[:101].sum() * 9.81
    greatest, least = (-x.multiplier / weight for x in a.force_bounds(101, (1.0, 0.0)))
    judge(f"least thrust over weight, t/R {thickness}", least, low, 5e-4)
    judge(f"greatest thrust over weight, t/R {thickness}", greatest, high, 5e-4)


def block(breadth, height, depth=None):
    b = blocks.Blocks(2 if depth is None else 3)
    sides = [breadth] + ([] if depth is None else [depth])
    b.add_box([0.0] * b.dim, [*sides, height])
    b.add_box([-height] * (b.dim - 1) + [-1.0], [height + breadth] * (b.dim - 1) + [0.0], "support")
    return b


@pytest.mark.parametrize("depth", [None, 3.0])
@pytest.mark.parametrize("mu", [0.2, 0.8])
def test_block_pushed_at_its_centre_overturns_or_slides(depth, mu):
    a = limit_analysis.Assembly(block(1.0, 2.0, depth), mu, density=2000.0, facets=16)
    live = np.zeros((2, a.dim))
    live[0, 0] = a.mass[0] * 9.81
    found = a.collapse(live)
    # a friction pyramid may hide up to 1 - cos(pi / facets) of mu
    judge(f"multiplier, mu {mu}", found.multiplier, min(mu, 0.5), 1e-9 if depth is None or mu > 0.5 else 0.0193)
    assert found.status == "optimal"
    power = np.sum(a.loads(live) * found.mechanism)
    assert power == pytest.approx(1, rel=1e-9) and found.mechanism[0, 0] > 0
    if mu > 0.5:  # it turns about the far lower edge: that edge's velocity is zero
        v, w = found.mechanism[0, : a.dim], found.mechanism[0, a.dim :]
        arm = np.array([1.0, 0.0] if depth is None else [1.0, 1.5, 0.0]) - a.center[0]
        spin = w[0] * np.array([-arm[1], arm[0]]) if depth is None else np.cross(w, arm)
        np.testing.assert_allclose(v + spin, 0, atol=1e-9 * np.abs(v).max())


def test_tilting_a_wall_panel():
    """A stack tilts as one block; a panel in running bond falls at the wedge its joints allow, below that of one block."""
    def tilt(b):
        a = limit_analysis.Assembly(b, 0.7)
        live = np.column_stack((a.mass * 9.81, np.zeros(len(a.mass))))
        return a.collapse(live).multiplier

    stack = masonry.panel(1, 8, brick=(2.0, 1.0), bond="stack")
    judge("stack of 8 bricks 2 by 1", tilt(stack), 2 / 8, 1e-9)
    panel = tilt(masonry.panel(4, 8, brick=(2.0, 1.0)))
    whole = limit_analysis.Assembly(block(8.0, 8.0), 0.7)
    assert 0.25 < panel < 0.7
    assert panel < whole.collapse(np.array([[whole.mass[0] * 9.81, 0.0], [0, 0]])).multiplier + 1e-12


def test_forces_balance_and_stay_in_their_cones():
    b = masonry.arch(radius=1.0, thickness=0.2, voussoirs=11, depth=0.7)
    a = limit_analysis.Assembly(b, 0.6, density=2500.0)
    found = a.stands()
    assert found.status == "optimal"
    n = a.joints.normal[found.joint]
    pressure = np.einsum("ij,ij->i", found.forces, n)
    sliding = np.linalg.norm(found.forces - pressure[:, None] * n, axis=1)
    assert np.all(pressure >= -1e-9 * a.weight) and np.all(sliding <= 0.6 * pressure + 1e-9 * a.weight)
    for k in range(11):
        force, turn = a.load[k, :3].copy(), np.zeros(3)
        for side, sign in ((0, 1), (1, -1)):
            on = a.joints.blocks[found.joint, side] == k
            force += sign * found.forces[on].sum(axis=0)
            turn += sign * np.cross(found.points[on] - a.center[k], found.forces[on]).sum(axis=0)
        assert np.abs(force).max() < 1e-8 * a.weight and np.abs(turn).max() < 1e-8 * a.weight
    flat = limit_analysis.Assembly(masonry.arch(radius=1.0, thickness=0.2, voussoirs=11), 0.6)
    bounds = [x.force_bounds(11, d)[0].multiplier / x.mass[:11].sum() for x, d in ((a, (1, 0, 0)), (flat, (1, 0)))]
    assert bounds[0] == pytest.approx(bounds[1], rel=1e-6)


def test_what_cannot_stand_and_what_never_falls():
    thin = assembly(0.05, 27)
    assert thin.stands().status == "infeasible"
    live = np.zeros((29, 2))
    live[13, 0] = 1.0
    assert thin.collapse(live).status == "infeasible" and np.isnan(thin.collapse(live).multiplier)
    down = np.zeros((2, 2))
    down[0, 1] = -1.0
    never = limit_analysis.Assembly(block(1.0, 2.0), 0.5).collapse(down)
    assert never.status == "unbounded" and never.multiplier == np.inf


def test_units_do_not_matter():
    def multiplier(scale):
        b = masonry.arch(radius=scale, thickness=0.15 * scale, voussoirs=15)
        a = limit_analysis.Assembly(b, 0.7, density=scale)
        live = np.zeros((17, 2))
        live[10, 1] = -a.mass[:15].sum() * 9.81
        return a.collapse(live).multiplier

    assert multiplier(2.0**20) == pytest.approx(multiplier(1.0), rel=1e-9)


def test_bisection():
    assert limit_analysis.bisect(lambda x: x < 0.3, 0.0, 1.0, 1e-9) == pytest.approx(0.3, abs=1e-9)
    with pytest.raises(ValueError, match="stands both at"):
        limit_analysis.bisect(lambda x: True, 0.0, 1.0)
