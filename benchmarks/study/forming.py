"""A block of metal upset between a plate and its mirror by a fifth of its height: what mesh, step, integrator and tolerance
cost and give, for `cairn sweep` and `cairn study --meshes`. A quarter of it, finite plastic strains, friction 0.2; figures are
the work of the plate, or the force on it, and how much wider the block is in its middle at the end.
"""

import cairn as cn
import numpy as np

YOUNG, YIELD, HARDENING, DOWN = 1000.0, 2.0, 3.0, 0.2
DT, DURATION = 0.05, 1.0  # [s] of a study


def build(mesh=8):
    """The quarter of so many cells along a side, and the plate on its way."""
    n = int(mesh)
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], -1).reshape(-1, 4)
    metal = cn.FiniteJ2(young=YOUNG, poisson=0.3, yield_stress=YIELD, isotropic=HARDENING)
    groups = {"left": number[0], "middle": number[:, 0], "top": number[:, -1]}
    body = cn.SolidBody(
        np.c_[x.ravel(), y.ravel()], {"quad": quads}, metal, density=1e-3, groups=groups, mean_dilatation=True
    )
    skin, plate = cn.Material("skin", density=1.0), cn.Material("plate", density=1.0)
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, skin, contact="top", fixed={"left": "x", "middle": "y"}))
    scene.add(cn.wall((0, 1), (0, -1), plate, velocity=(0.0, -DOWN, 0.0)))
    scene.interact(skin, plate, cn.Coulomb(mu=0.2))
    return scene


def figure_bulge(sim):
    """How much wider the block is in its middle [m]."""
    mesh = sim.meshes[0]
    return float((mesh.body.points + mesh.displacement)[mesh.body.groups["middle"][-1], 0] - 1)


def figure_force(sim):
    """On the plate [N]."""
    return float(abs(sim.contacts.force[:, 1].sum()))


def run(parameters):
    """cells along a side, steps, theta, tol of the contact solver and a hundredth of it that of Newton's method."""
    steps = int(parameters["steps"])
    scene = build(parameters["cells"])
    strategy = cn.NSCD(theta=parameters["theta"], newton_tol=parameters["tol"] / 100, solver=cn.PPANewton(tol=parameters["tol"]))
    sim = cn.Simulation(scene, dt=1.0 / steps, strategy=strategy)
    passes, work = 0, 0.0
    for _ in range(steps):
        passes += sim.step()["newton_passes"]
        work += figure_force(sim) * DOWN / steps
    return {"work": float(work), "bulge": figure_bulge(sim), "passes": passes}
