"""Passes of Newton's method of solids that the tolerance of the contact solver holds up solve contacts tighter."""

import cairn as cn
import numpy as np
import pytest
from second_order import box

ROCK = cn.Material("rock", density=1e3)


def pressed(kind, integrator, solver=None):
    """A block on a smooth wall under a pressure that follows its upper side, whose rim is free, in steps of five waves."""
    points, cells = box(kind, (5, 4), (1.0, 0.7))
    groups = {
        "top": np.flatnonzero(points[:, 1] > 0.7 - 1e-9), "bottom": np.flatnonzero(points[:, 1] < 1e-9),
        "left": np.flatnonzero(points[:, 0] < 1e-9),
    }  # fmt: skip
    body = cn.SolidBody(points, cells, cn.NeoHookean(young=1e6, poisson=0.3), density=1e3, groups=groups)
    scene = cn.Scene(dim=2)
    pressure = {"top": lambda t: 3e4 * min(1.0, t / 3.16)}
    scene.add(cn.deformable(body, ROCK, contact="bottom", fixed={"left": "x"}, pressure=pressure))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Frictionless())
    options = {} if solver is None else {"solver": solver}
    return cn.Simulation(scene, dt=0.158, strategy=cn.NSCD(integrator=integrator, **options))


@pytest.mark.parametrize("kind", ["quad", "quad9"])
@pytest.mark.parametrize("integrator", [cn.Theta(), cn.DiscreteGradient()])
def test_passes_that_contacts_hold_up_solve_them_tighter(kind, integrator):
    sim, exact = pressed(kind, integrator), pressed(kind, integrator, cn.NLGS(tol=1e-13, max_iter=20000))
    for _ in range(25):
        info, told = sim.step(), exact.step()
        assert info["status"] == told["status"] == "converged"
        assert info["newton_error"] <= 1e-8 and info["error"] <= 1e-4
        assert info["newton_passes"] < 22
    assert sim.strategy.solver.tol == 1e-4
    u, there = sim.meshes[0].displacement, exact.meshes[0].displacement
    assert np.abs(u - there).max() < 1e-3 * np.abs(there).max()
