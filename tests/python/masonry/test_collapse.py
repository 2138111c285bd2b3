"""The multiplier at which structures fall in simulations, against the textbook and limit analysis."""

import numpy as np
import pytest
from cairn.post.collapse import collapse_multiplier
from cairn.pre import masonry

pytest.importorskip("scipy")
STACK = masonry.panel(1, 8, brick=(2.0, 1.0), bond="stack")


@pytest.mark.parametrize("mu, load, exact", [(0.6, "tilt", 2 / 8), (0.15, "tilt", 0.15), (0.6, "push", 2 / 8)])
def test_stack(mu, load, exact, capsys):
    """The stack overturns at its width over its height, or slides at mu."""
    found = collapse_multiplier(STACK, mu, load)
    assert found.multiplier == pytest.approx(exact, rel=0.005) and found.limit == pytest.approx(exact, rel=1e-6)
    assert found.stands < found.multiplier < found.falls and found.angle == pytest.approx(np.arctan(found.multiplier))
    assert all(status == "converged" for *_, status in found.trials)
    said = capsys.readouterr().err
    assert said.count("\n") == len(found.trials) and "stands" in said and "moves at" in said


def test_forces_out_of_plane_and_arches():
    wall = masonry.wall(0.22, 3, bond="stack")
    height, wide = 3 * 0.055, 0.11
    found = collapse_multiplier(wall, 0.9, towards=(0, 1, 0), progress=False)
    assert found.multiplier == pytest.approx(wide / height, rel=0.006)
    top = np.zeros((len(STACK), 2))
    top[7, 0] = 1000.0  # at half a metre below the top: moment 7.5 m x 1 kN x multiplier = weight x 1 m
    weight = 16 * 2400 * 9.81
    for mu, exact in ((2.0, weight / 7500), (0.9, 0.9 * weight / 8000)):  # all overturn, or the top one slides
        assert collapse_multiplier(STACK, mu, top, progress=False).multiplier == pytest.approx(exact, rel=0.005)
    arch = masonry.arch(span=4.0, thickness=0.6, voussoirs=15)
    found = collapse_multiplier(arch, 0.7, progress=False)
    assert found.multiplier == pytest.approx(found.limit, rel=0.01)


def test_refusals():
    for options, words in [
        ({"low": 0.3, "high": 0.4}, "moves under low = 0.3"),
        ({"high": 0.1}, "stands under high = 0.1"),
        ({"low": 0.9}, "low is 0.9 and high"),
        ({"load": "shake"}, "load is 'shake'"),
        ({"load": np.zeros((3, 2))}, r"load has shape \(3, 2\)"),
        ({"towards": (0, 1)}, "give a horizontal vector"),
    ]:
        with pytest.raises(ValueError, match=words):
            collapse_multiplier(STACK, 0.6, progress=False, **options)
