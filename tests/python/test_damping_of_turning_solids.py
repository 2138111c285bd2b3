"""Damping by the stiffness of solids that move far: what turns as a rigid body is not braked, what vibrates is, as ever."""

import cairn as cn
import numpy as np
import pytest
from test_mortar_faces import flat, mesh

ROCK = cn.Material("rock", density=1000.0)
THICK = {"quad8": (0.2, 0.2), "hexahedron": (0.2, 0.2, 0.2), "tetra10": (0.2, 0.2, 0.2)}


def solid(kind, kinematics="total_lagrangian", rayleigh=(0.0, 1e-4), material=None):
    cells = (2, 2) if kind.startswith("quad") else (2, 2, 1)
    if kind.startswith("quad"):
        body = flat(kind, cells, (-0.1, -0.1), THICK[kind])
        points, made = body.points, body.cells
    else:
        points, made, _ = mesh(kind, cells, THICK[kind])
        points = points - 0.1
    material = material or (
        cn.NeoHookean(young=1e6, poisson=0.3)
        if kinematics == "total_lagrangian"
        else cn.IsotropicElastic(young=1e6, poisson=0.3)
    )
    return cn.SolidBody(points, made, material, density=1000.0, kinematics=kinematics, rayleigh=rayleigh)


def spun(body, spin=10.0, h=1e-3, steps=200, stretch=0.0, integrator=None, tol=1e-10):
    """A free simulation of a body that turns about z and stretches along x [1/s]; momenta about z after each step."""
    x = body.points
    velocity = np.zeros_like(x)
    velocity[:, 0], velocity[:, 1] = -spin * x[:, 1] + stretch * x[:, 0], spin * x[:, 0]
    scene = cn.Scene(dim=body.dim)
    scene.add(cn.deformable(body, ROCK, velocity=velocity))
    strategy = cn.NSCD(0.5, newton_tol=tol) if integrator is None else cn.NSCD(integrator=integrator, newton_tol=tol)
    sim = cn.Simulation(scene, h, strategy)
    momenta, energies = [], []
    for _ in range(steps):
        sim.step()
        mesh_of = sim.meshes[0]
        place, p = x + mesh_of.displacement, (body.M @ mesh_of.velocity.ravel()).reshape(x.shape)
        momenta.append(np.sum(place[:, 0] * p[:, 1] - place[:, 1] * p[:, 0]))
        energies.append(sim.info["energy"])
    return sim, np.array(momenta), energies


@pytest.mark.parametrize("kind", ["quad8", "hexahedron", "tetra10"])
@pytest.mark.parametrize("kinematics", ["total_lagrangian", "corotational", "logarithmic"])
def test_what_turns_is_not_braked(kind, kinematics):
    """Of 10 rad/s a radian left 0.29, three 0.0005: the damping matrix of the start never turned."""
    _, momenta, energies = spun(solid(kind, kinematics))
    first = momenta[0]
    assert np.abs(momenta / first - 1).max() < 1e-4
    lost = [e["dissipated_bulk"] for e in energies]
    assert lost[-1] < 2e-3 * energies[0]["kinetic"] and np.diff(lost).min() > -1e-12 * energies[0]["kinetic"]


@pytest.mark.parametrize(("integrator", "h"), [(cn.VelocityVerlet(), 1e-4), (cn.Newmark(), 1e-3), (cn.HHT(), 1e-3),
                                               (cn.DiscreteGradient(), 1e-3)])  # fmt: skip
def test_by_other_integrators(integrator, h):
    _, momenta, _ = spun(solid("quad8"), h=h, steps=round(0.1 / h), integrator=integrator, tol=1e-6)
    assert np.abs(momenta / momenta[0] - 1).max() < 3e-4


def test_what_vibrates_while_it_turns_is_damped_as_without():
    """A square that stretches: what its vibration loses in 20 ms is the same at 3 rad/s as at none to the share of the spin."""
    still = spun(solid("quad8"), 0.0, steps=20, stretch=2.0)[2][-1]["dissipated_bulk"]
    turning = spun(solid("quad8"), 3.0, steps=20, stretch=2.0)[2][-1]["dissipated_bulk"]
    assert turning == pytest.approx(still, rel=0.02) and still > 0.1


def test_small_motion_is_damped_as_by_the_matrix_of_the_start():
    """A small vibration by large kinematics is that of small ones, to its amplitude."""
    law = cn.IsotropicElastic(young=1e6, poisson=0.3)
    found = [
        spun(solid("quad8", kinematics, (2.0, 1e-4), law), 0.0, steps=50, stretch=1e-4)[0].meshes[0].velocity
        for kinematics in ("small", "corotational")
    ]
    assert np.abs(found[1] - found[0]).max() < 1e-5 * np.abs(found[0]).max()


def test_damping_by_mass_brakes_as_it_says():
    """C = a M is against all motion: the spin falls as exp(-a t)."""
    _, momenta, _ = spun(solid("quad8", rayleigh=(5.0, 1e-4)))
    assert momenta[-1] / momenta[0] == pytest.approx(np.exp(-5.0 * 199e-3), rel=1e-3)


def test_parts_that_are_tied_have_their_own():
    one, two = solid("quad8"), solid("quad8", rayleigh=(0.0, 1e-5))
    two = cn.SolidBody(
        two.points + [0.0, 0.2], two.cells, cn.NeoHookean(young=1e6, poisson=0.3), density=1000.0, rayleigh=(0.0, 1e-5)
    )
    for body in (one, two):
        height = body.points[:, 1]
        body.groups["top"] = np.flatnonzero(height > height.max() - 1e-9)
        body.groups["bottom"] = np.flatnonzero(height < height.min() + 1e-9)
    _, momenta, _ = spun(cn.tied({"one": one, "two": two}, [("two.bottom", "one.top")]), steps=150)
    assert np.abs(momenta / momenta[0] - 1).max() < 1e-3
