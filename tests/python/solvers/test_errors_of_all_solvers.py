"""The error in a step's report is the same residual over the same scale for every solver, computed here anew from impulses and
velocities. Three disks that touch have one redundant contact: with much friction Coulomb's law has many solutions, so that
solvers may end in other impulses and velocities, each of which obeys the law."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2600.0)
RADIUS, H, G = 0.1, 1e-3, 9.81
SOLVERS = (
    "NLGS", "Auto", "Extragradient", "ConjugateGradient", "AcceleratedGradient", "PPANewton", "ADMM", "InteriorPoint", "Lemke",
)  # fmt: skip


def three(solver, mu):
    """A step of two disks side by side on a floor and a third on both, pushed to one side."""
    scene = cn.Scene(dim=2, gravity=(1.0, -G))
    places = RADIUS * np.array([[0.0, 1.0], [2.0, 1.0], [1.0, 1.0 + np.sqrt(3)]])
    scene.add(cn.disks(places, RADIUS, ROCK), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, H, cn.NSCD(solver=solver))
    return sim, sim.step()


def law_error(sim, mu):
    """Natural map of Coulomb's cone, |r - P_K(r - rho (u + mu |u_T| n))| over |r|, both in the norm of 1/rho = W_NN."""
    c = sim.contacts
    r, u = np.array(c.impulse_local), np.array(c.relative_velocity)
    inverse = np.where(np.isfinite(sim.bodies.mass), 1 / sim.bodies.mass, 0.0)
    w = inverse[c.bodies].sum(axis=1)
    u[:, 0] += np.maximum(c.gap, 0) / H + mu * np.abs(u[:, 1])
    z = r - u / w[:, None]
    size = np.abs(z[:, 1])
    on_edge = np.maximum(z[:, 0] + mu * size, 0) / (1 + mu**2)
    inside, below = size <= mu * z[:, 0], z[:, 0] + mu * size <= 0
    normal = np.where(inside, z[:, 0], np.where(below, 0.0, on_edge))
    tangent = np.where(inside, z[:, 1], np.sign(z[:, 1]) * mu * normal)
    f = r - np.stack([normal, tangent], 1)
    return np.sqrt((w * (f**2).sum(1)).sum() / (w * (r**2).sum(1)).sum())


@pytest.mark.parametrize("mu", [0.1, 0.4])
@pytest.mark.parametrize("name", SOLVERS)
def test_what_converges_obeys_the_law_to_the_tolerance(name, mu):
    for tol in (1e-4, 1e-8):
        sim, info = three(getattr(cn, name)(tol=tol), mu)
        error = law_error(sim, mu)
        assert abs(error - info["error"]) <= 0.05 * info["error"] + 1e-12
        assert (info["status"] == "converged") == (info["error"] <= tol)


def test_with_one_solution_all_solvers_find_it():
    """At mu = .1, to velocities of the tolerance; at .4 the law leaves a family of solutions, whose members differ by more."""
    exact = three(cn.NLGS(tol=1e-12, max_iter=10000), 0.1)[0].bodies.velocity.copy()
    for name in SOLVERS:
        sim, info = three(getattr(cn, name)(tol=1e-8), 0.1)
        if info["status"] == "converged":
            assert np.abs(sim.bodies.velocity - exact).max() <= 1e-6 * G * H
    apart = [three(getattr(cn, name)(tol=1e-10), 0.4)[0].bodies.velocity.copy() for name in ("NLGS", "InteriorPoint")]
    assert np.abs(apart[0] - apart[1]).max() > 1e-2 * G * H
