"""Work of growing bodies: a term of the balance, not created by contacts; shrinking bodies stay on their supports."""

import warnings

import cairn as cn
import numpy as np
import pytest

STIFF = 1e6  # of the head's spring [N/m]
HELD = dict(normal_stiffness=2e9, tangential_stiffness=2e9, normal_strength=3e8, tangential_strength=3e8, normal_work=1e8,
            tangential_work=1e8)  # fmt: skip
# energy that joints take whose bricks grow along them, between a floor and a head that do not: four corners slip by 1 mm
LAWS = {"Coulomb": (cn.Coulomb(mu=0.5), 0.0), "GapCoulomb": (cn.GapCoulomb(mu=0.5), 0.0),
        "MAL": (cn.MAL(mu=0.5, **HELD), 4 * 0.5 * 2e9 * 0.1 * 1e-6)}  # fmt: skip


def box(x, y):
    return np.array([[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]])


def column(law, steps, period=0.4):
    """Two bricks of half a metre between a floor and a head on a spring, 1000 K up and down again."""
    clay = cn.Material("clay", density=2000.0, expansion=1e-5, conductivity=1.0, capacity=1000.0)
    iron = cn.Material("iron", density=2000.0, conductivity=1.0, capacity=1000.0)
    scene = cn.Scene(2, gravity=(0.0, 0.0))
    bricks = scene.add(cn.polygons([box((-0.1, 0.1), (0.5 * k, 0.5 * k + 0.5)) for k in (0, 1)], clay, group="bricks"))
    scene.add(cn.polygons([box((-0.2, 0.2), (-0.1, 0.0))], iron, group="floor", fixed=True))
    scene.add(cn.polygons([box((-0.2, 0.2), (1.0, 1.1))], iron, group="head").with_(driven=("vx", "w")))
    scene.add(cn.polygons([box((-0.2, 0.2), (1.6, 1.7))], iron, group="abutment", fixed=True))
    scene.interact("*", "*", law)
    scene.interact("head", "abutment", cn.Rod(stiffness=STIFF * 0.5 / 2, within=0.51))
    warm = [(bricks, lambda t: 300.0 + 500.0 * (1 - np.cos(2 * np.pi * min(t, period) / period)))]
    scene.thermal(conductance=cn.networks.Constant(conductance=0.0), initial=300.0, reference=300.0, temperature=warm,
                  friction="none")  # fmt: skip
    strategy = cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-9, max_iter=20000))
    return cn.Simulation(scene, period / steps, strategy, overlap="ignore")


@pytest.mark.parametrize("name", LAWS)
def test_growth_gives_what_it_stores_and_takes_it_back(name):
    """Half of k x^2 in the spring, beside what joints store; the cycle costs what a step of Euler's does, of first order."""
    law, in_joints = LAWS[name]
    taken = []
    for steps in (40, 80):
        sim = column(law, steps)
        start = sim.info["energy"]
        with warnings.catch_warnings():
            warnings.simplefilter("error", cn.EnergyCreatedWarning)
            for k in range(steps + 2):
                sim.step()
                energy = sim.info["energy"]
                spent = sum(energy[term] for term in energy if term.startswith(("dissipated", "released")))
                left = sum(energy[term] - start[term] for term in ("kinetic", "potential", "stored")) + spent
                left -= energy["work_growth"] + energy["work_driven"] + energy["work_external"]
                assert abs(left) <= 1e-12 * energy["in_play"]
                if k == steps // 2:
                    hot = energy["work_growth"]
        assert hot == pytest.approx(0.5 * STIFF * 1e-2**2 + in_joints, rel=6 / steps)
        taken.append(energy["work_growth"])
        assert np.abs(sim.contacts.gap[np.abs(sim.contacts.gap) < 0.1]).max() <= 1e-7  # nothing sank where it shrank
    assert taken[1] == pytest.approx(taken[0] / 2, rel=0.1) and taken[0] <= 0.13 * 100.0


def test_growth_makes_no_heat_of_friction():
    """Work of growing bodies on others is not subtracted from their heat as negative friction."""
    sim = column(cn.Coulomb(mu=0.5), 40)
    for _ in range(20):
        sim.step()
        assert sim.contacts.dissipated.min(initial=0.0) >= -1e-6 * sim.info["energy"]["in_play"]
    assert sim.info["energy"]["work_growth"] > 50


def test_a_liquid_presses_the_spot_that_it_draws_together():
    """Conductance by the force of the spot: what presses from outside, and the attraction; none where spheres are apart."""
    steel = cn.Material("steel", density=7800.0, young=210e9, poisson=0.3, resistivity=1 / 5.9e6)

    def conductance(pressed, drawn, gap=0.0):
        scene = cn.Scene(3)
        scene.add(cn.spheres([[0.0, 0.0, 0.0]], 1e-3, steel, group="low", driven=("vx", "vy", "vz", "wx", "wy", "wz")))
        scene.add(cn.spheres([[0.0, 0.0, 2e-3 + gap]], 1e-3, steel, group="high", force=(0.0, 0.0, -pressed)))
        scene.interact("*", "*", cn.Wet(force=drawn, reach=1e-4, mu=0.3))
        scene.electrical(conductance=cn.networks.Holm(), current={"low": 1.0, "high": -1.0})
        sim = cn.Simulation(scene, 1e-6, cn.NSCD(solver=cn.NLGS(tol=1e-12)))
        sim.step()
        return sim.contacts.electrical_conductance.max(initial=0.0)

    assert conductance(1.0, 0.0) == pytest.approx(174.787, rel=1e-5)
    for pressed, drawn in ((0.3, 0.7), (0.0, 1.0), (-0.5, 1.5)):
        assert conductance(pressed, drawn) == pytest.approx(174.787, rel=1e-5)
    assert conductance(-2.0, 1.0) == 0 and conductance(0.0, 1.0, gap=5e-5) == 0
