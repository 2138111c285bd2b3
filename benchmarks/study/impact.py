"""A bar that strikes a wall along its axis: cost and accuracy by mesh, step, integrator and tolerance, for `cairn sweep` against
a closed form, and for `cairn study --meshes` against a finer mesh.

Its free end goes on at the speed v until the wave from the wall comes, at L/c, then goes back as fast (Saint-Venant): the error
is the root mean square of the way of that end from this, over 3 L/c, over v L/c.
"""

import cairn as cn
import numpy as np

LENGTH, WAVE, SPEED = 1.0, 10.0, 0.1
DT, DURATION = 2e-3, 0.45  # [s] of a study: the bar leaves the wall after 0.2, figures are means over the second half
INTEGRATORS = {
    "theta 1/2": cn.Theta(theta=0.5), "theta 1": cn.Theta(theta=1.0), "HHT -0.1": cn.HHT(alpha=-0.1),
    "generalised alpha 0.8": cn.GeneralisedAlpha(spectral_radius=0.8), "central differences": cn.CentralDifference(),
}  # fmt: skip


def build(mesh=25):
    """The bar of so many cells above the wall."""
    n = int(mesh)
    y, x = np.meshgrid(np.linspace(0, LENGTH, n + 1), [0.0, LENGTH / n], indexing="ij")
    number = np.arange(2 * n + 2).reshape(n + 1, 2)
    quads = np.stack([number[:-1, 0], number[:-1, 1], number[1:, 1], number[1:, 0]], axis=1)
    body = cn.ElasticBody(np.c_[x.ravel(), y.ravel()], {"quad": quads}, young=WAVE**2, poisson=0.0, density=1.0, lumped=True)
    metal = cn.Material("metal", density=1.0)
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, metal, contact=number[0], velocity=(0.0, -SPEED)))
    scene.add(cn.wall((0, 0), (0, 1), metal))
    scene.interact(metal, metal, cn.Coulomb(mu=0.0))
    return scene


def figure_rebound(sim):
    """Mean velocity of the bar over that with which it came: 1 in theory."""
    mesh = sim.meshes[0]
    mass = mesh.body.nodal_mass()
    return float(mass @ mesh.velocity[:, 1] / mass.sum() / SPEED)


def run(parameters):
    """cells along the bar, courant: step over that of a wave through a cell, integrator, tol of the contact solver."""
    h = parameters["courant"] * LENGTH / parameters["cells"] / WAVE
    scene = build(parameters["cells"])
    strategy = cn.NSCD(integrator=INTEGRATORS[parameters["integrator"]], solver=cn.NLGS(tol=parameters["tol"]))
    sim = cn.Simulation(scene, dt=h, strategy=strategy)
    wrong, turn = [], LENGTH / WAVE
    while sim.time < 3 * turn:
        sim.step()
        exact = -SPEED * (turn - abs(sim.time - turn))
        wrong.append(sim.meshes[0].displacement[-2, 1] - exact)
    return {"error": float(np.sqrt(np.mean(np.square(wrong))) / (SPEED * turn)), "steps": sim.steps}
