"""Compares the law @NAME@ with built-in laws: without recovery of overlap it is Coulomb, with full recovery GapCoulomb."""

from pathlib import Path

import numpy as np
import pytest

import cairn as cn

LIBRARY = Path(__file__).resolve().parent / "lib@NAME@.so"


def positions(law):
    rock = cn.Material("rock", density=2700.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks([[0.0, 0.099], [0.06, 0.26], [-0.07, 0.27]], 0.1, rock), cn.wall((0, 0), (0, 1), rock))
    scene.interact(rock, rock, law)
    sim = cn.Simulation(scene, dt=1e-3, overlap="ignore")
    sim.run(steps=50, progress=False)
    return np.array(sim.bodies.position)


@pytest.mark.parametrize("share, twin", [(0.0, cn.Coulomb(mu=0.3)), (1.0, cn.GapCoulomb(mu=0.3))])
def test_limits(share, twin):
    mine = cn.plug(LIBRARY, law="@NAME@", params=[0.3, share])
    assert np.array_equal(positions(mine), positions(twin))
    assert not np.array_equal(positions(mine), positions(cn.plug(LIBRARY, law="@NAME@", params=[0.3, 0.5])))
