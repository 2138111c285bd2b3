"""Mortar contact in steps of more than one pass of Newton's method: contacts that rest on means of many nodes keep them."""

import cairn as cn
import numpy as np
import pytest
from second_order import grid

ROCK = cn.Material("rock", density=1000.0)


def block(dim, cells, corner, material):
    points, made = grid(cells)
    body = cn.SolidBody(
        points * ([1.0] * (dim - 1) + [0.5]) + corner, made, material, density=1000.0,
        kinematics="small" if isinstance(material, cn.IsotropicElastic) else "total_lagrangian",
    )  # fmt: skip
    for name, axis, side in (("left", 0, 0.0), ("front", 1, 0.0), ("bottom", dim - 1, 0.0), ("top", dim - 1, 1.0)):
        body.groups[name] = np.flatnonzero(points[:, axis] == side)
    return body


MATERIALS = [cn.IsotropicElastic(young=1e7, poisson=0.0), cn.NeoHookean(young=1e7, poisson=0.0)]


@pytest.mark.parametrize("material", MATERIALS, ids=["linear", "neo_hookean"])
@pytest.mark.parametrize(("below", "above"), [((6, 2), (4, 2)), ((3, 3, 1), (2, 2, 1)), ((2, 2, 1), (3, 3, 1))])
def test_a_uniform_stress_goes_through(below, above, material):
    """A column of two blocks that is pressed shorter, of no Poisson's ratio: one stress, and no gap, on both sides, though each
    pass prepares the contacts anew."""
    dim = len(below)
    under = block(dim, below, [0.0] * dim, material)
    over = block(dim, above, [0.0] * (dim - 1) + [0.5], material)
    up, sides = "xyz"[dim - 1], "edges" if dim == 2 else "faces"
    hold = {"left": "x"} | ({"front": "y"} if dim == 3 else {})
    scene = cn.Scene(dim)
    down = {"top": {up: lambda t: -1e-2 * min(t / 0.1, 1.0)}}
    scene.add(cn.deformable(under, ROCK, fixed=hold | {"bottom": up}, name="under", **{sides: "top"}))
    own = {"contact": "bottom", sides: "bottom", "mortar": True}
    scene.add(cn.deformable(over, ROCK, fixed=hold, displace=down, name="over", **own))
    scene.interact(ROCK, ROCK, cn.GapCoulomb(mu=0.0))
    sim = cn.Simulation(scene, 1e-2, cn.NSCD(1.0, cn.NLGS(tol=1e-12, max_iter=20000)), overlap="ignore")
    passes = 0
    for _ in range(200):
        assert sim.step()["status"] == "converged"
        passes = max(passes, sim.info["newton_passes"])
    assert passes > 1 or isinstance(material, cn.IsotropicElastic)
    stress = np.concatenate([m.stress[kind][:, dim - 1].ravel() for m in sim.meshes for kind in m.stress])
    assert stress.max() < 0 and np.ptp(stress) < 1e-6 * np.abs(stress).max()
    if isinstance(material, cn.IsotropicElastic):
        assert stress.mean() == pytest.approx(-1e7 * 1e-2, rel=1e-6)
    assert np.abs(sim.contacts.gap).max() < 1e-9
