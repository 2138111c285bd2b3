"""A double cantilever of beams on a cohesive zone, opened past its peak: errors by time step, tolerance and stiffness of the
zone.

    cairn study cantilever.py:stiffness=1e12 cantilever.py cantilever.py:stiffness=1.6e13 --figure force --figure released \\
        --solvers NLGS --tolerances 1e-2 1e-4 1e-6 --dt-factors 0.5 1 2 --warm-start on --max-iter 2000 --no-one-step

Its symmetric half, a wall, stands for the other arm; strength and work of the zone are the same at every stiffness.
"""

import cairn as cn
import numpy as np

YOUNG, THICK, WIDE, CRACK, LENGTH, WORK, STRENGTH = 70e9, 3e-3, 0.01, 0.03, 0.1, 250.0, 10e6
SPEED = 0.2  # of the opening [m/s]
DT = 5e-6
PREPARE, DURATION = 1.1e-3 / SPEED, 0.3e-3 / SPEED  # from the peak on


def build(stiffness=4e12, cells=100):
    """Beams of so many cells along the arm."""
    n = int(cells)
    x = np.linspace(0, LENGTH, n + 1)
    glued = np.flatnonzero(x > CRACK - 1e-9)
    body = cn.beams(np.column_stack([x, np.zeros(n + 1)]), np.column_stack([np.arange(n), np.arange(1, n + 1)]), young=YOUNG,
                    area=THICK, inertia=THICK**3 / 12, density=2700.0,
                    groups={"end": [0]})  # fmt: skip
    arm, line = cn.Material("arm", density=2700.0), cn.Material("line", density=2700.0)
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, arm, contact=glued, edges=np.column_stack([glued[:-1], glued[1:]]), fixed={"end": "x"},
                            drive={"end": {"y": SPEED / 2}}))  # fmt: skip
    scene.add(cn.wall((0.0, 0.0), (0.0, 1.0), line))
    scene.interact(arm, line, cn.MAL(normal_stiffness=2 * stiffness, tangential_stiffness=2 * stiffness, mu=0.0,
                                     normal_strength=STRENGTH, tangential_strength=STRENGTH, normal_work=WORK / 2,
                                     tangential_work=WORK / 2))  # fmt: skip
    return cn.Simulation(scene, DT, cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-6, max_iter=5000)))


def figure_force(sim):
    """Force that opens the arms [N]."""
    return float(WIDE * sim.meshes[0].reaction("end")[1])


def figure_released(sim):
    """Energy released by the zones of both halves since the start, for a plate a metre wide [J]."""
    return float(2 * sim.info["energy"]["released"])
