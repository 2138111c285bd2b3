"""Moving loads, settlement, push and earthquake against closed forms and limit analysis."""

import cairn as cn
import matplotlib
import numpy as np
import pytest
from cairn.post import assessment
from cairn.pre import loads, masonry
from cairn.pre.blocks import Blocks

matplotlib.use("Agg")
pytest.importorskip("scipy")
ARCH = masonry.arch(radius=5.0, thickness=0.9, voussoirs=9)


def boxes(*given):
    blocks = Blocks(2)
    for low, high, part in given:
        blocks.add_box(low, high, part)
    return blocks


def test_two_blocks_between_supports_that_part_fall_through_when_their_hinges_lie_on_a_line():
    """Hinges at the lower corners of the supports and at the top of the middle: the way is 2 (sqrt(l^2 + h^2) - l)."""
    long, high = 2.0, 0.4
    flat = boxes(((-long, 0), (0, high), "block"), ((0, 0), (long, high), "block"),
                 ((-long - 1, -0.5), (-long, high + 0.5), "support"),
                 ((long, -0.5), (long + 1, high + 0.5), "support"))  # fmt: skip
    path = assessment.settlement(flat, (-0.1, 0.0), 1.5)
    assert path.collapse == pytest.approx(2 * (np.hypot(long, high) - long), rel=0.01)
    # thrust: the weight of a block times the arm of its centre about the support's hinge, over the rise of the middle one
    rows = path.displacement < 0.8 * path.collapse
    wide = long + path.displacement[rows] / 2
    rise = np.sqrt(long**2 + high**2 - wide**2)
    turned = np.arctan2(rise, wide) - np.arctan2(high, long)
    arm = np.cos(turned) * long / 2 - np.sin(turned) * high / 2
    assert np.allclose(-path.force[rows, 0] / path.weight, 0.5 * arm / rise, rtol=0.01)
    assert np.allclose(-path.force[rows, 1] / path.weight, 0.5, rtol=0.01)
    assert "collapse at" in path.plot().get_legend().get_texts()[-1].get_text()


def test_a_block_that_is_pushed_over_bears_what_its_weight_holds():
    """Led by its centre, F / W = tan(alpha - theta) with the centre at R (sin alpha - sin(alpha - theta))."""
    block = boxes(((0, 0), (0.4, 2.0), "block"), ((-1, -0.5), (1.5, 0), "support"))
    path = assessment.pushover(block, (0.3, 0.0), 1.5, speed=0.05)
    half = np.hypot(0.2, 1.0)
    left = np.arcsin(np.clip((0.2 - path.displacement) / half, -1, 1))
    assert np.abs(path.push / path.weight - np.tan(left))[3:].max() < 0.02 * 0.2
    assert path.collapse == pytest.approx(0.2, rel=0.01)
    top, at = path.peak
    assert top / path.weight == pytest.approx(0.2, rel=0.02) and at < 0.02
    assert path.plot().get_ylabel().startswith("push")


def test_least_load_of_a_passage_is_that_of_limit_analysis():
    light = assessment.moving_load(ARCH, 2e4, 0.7, positions=7, dt=4e-3)
    least, at = light.least
    assert light.fell is None and np.all(np.isfinite(light.deflection)) and abs(at) < 3
    for factor, falls in ((0.9, False), (1.2, True)):
        passage = assessment.moving_load(ARCH, factor * least * 2e4, 0.7, positions=7, limit=False, dt=4e-3)
        assert (passage.fell is not None) == falls
        with pytest.raises(ValueError, match="limit=True"):
            print(passage.least)
    assert "least" in light.plot()[0].get_legend().get_texts()[0].get_text()


def test_axles_act_on_the_highest_faces_with_their_whole_weight_and_moment():
    for blocks in (ARCH, masonry.arch(radius=5.0, thickness=0.9, voussoirs=9, depth=2.0)):
        road, dim = assessment._Road(blocks, 0.5, None), blocks.dim
        center = blocks.properties().center
        found = road.resultants(1.0, 3e4)
        assert found[:, dim - 1].sum() == pytest.approx(-3e4)
        if dim == 2:
            moment = (center[:, 0] * found[:, 1] + found[:, 2]).sum()  # about the origin
        else:
            moment = (center[:, 0] * found[:, 2] - found[:, 4]).sum()
        assert moment == pytest.approx(-3e4 * 1.0, rel=1e-9)
        assert not np.any(road.resultants(100.0, 1.0))


def test_a_block_slides_on_shaken_ground_as_newmarks_does():
    times = np.arange(0, 0.5001, 0.01)
    record = loads.Accelerogram(times, np.where(times < 0.25, 4.0, -4.0))
    mu, dt, v, slid = 0.2, 1e-5, 0.0, 0.0
    ground = np.interp(np.arange(0, 1.0, dt), times, record.velocity(), right=0.0)
    for u in ground:
        v = u if abs(u - v) <= mu * 9.81 * dt else v + np.sign(u - v) * mu * 9.81 * dt
        slid += (v - u) * dt
    block = boxes(((0, 0), (1.0, 0.3), "block"), ((-3, -0.5), (4, 0), "support"))
    shaken = assessment.quake(block, record, mu, rest=0.5, dt=5e-4)
    assert shaken.permanent[0, 0] == pytest.approx(slid, rel=0.02) and shaken.fell is None
    assert np.allclose(shaken.permanent[1], 0) and shaken.largest[0] > abs(slid)
    assert len(shaken.plot()) == 2
    tall = boxes(((0, 0), (0.1, 1.0), "block"), ((-3, -0.5), (4, 0), "support"))
    assert assessment.quake(tall, record.scaled(2.0), 0.9).fell is not None


def test_mistakes_are_told():
    bare = boxes(((0, 0), (1, 1), "block"))
    for call, words in [
        (lambda: assessment.moving_load(bare, 1e3), 'no part "support"'),
        (lambda: assessment.moving_load(ARCH, -1e3), "above 0"),
        (lambda: assessment.moving_load(ARCH, 1e3, start=50.0, end=60.0), "below an axle"),
        (lambda: assessment.moving_load(ARCH, 1e3, cn.MAL(normal_stiffness=1e9, tangential_stiffness=1e9, normal_strength=1e5,
                                                           tangential_strength=1e5, normal_work=10.0, tangential_work=10.0,
                                                           mu=0.5)), "limit=False"),
        (lambda: assessment.settlement(ARCH, (0.0, 0.0)), "non-zero length"),
        (lambda: assessment.settlement(ARCH, (0.1, 0.0), supports=[0]), 'part "support", which are'),
        (lambda: assessment.settlement(ARCH, (0.1, 0.0), 0.05), "falls under its own weight"),
        (lambda: assessment.pushover(ARCH, (0.0, -0.1)), "horizontal"),
        (lambda: assessment.pushover(ARCH, (0.1, 0.0), at="keystone"), "the parts are"),
        (lambda: assessment.pushover(ARCH, (0.1, 0.0), at=[99]), "there are blocks 0 to 10"),
        (lambda: assessment.quake(ARCH, np.zeros(5)), "Accelerogram"),
    ]:  # fmt: skip
        with pytest.raises(ValueError, match=words):
            call()
