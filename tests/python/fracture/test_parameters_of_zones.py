"""Parameters of cohesive zones and bonds that no curve has are refused by name, with the value that would do; a curve that ends
with a step, an attraction without end, tell their energy."""

import cairn as cn
import numpy as np
import pytest

SPRINGS = dict(normal_stiffness=1e12, tangential_stiffness=1e12)
MODES = dict(normal_strength=2e6, tangential_strength=3e6, normal_work=10.0, tangential_work=30.0)
ABP = dict(normal_end=4e-5, tangential_end=8e-5, first_share=0.3)
STONE = cn.Material("stone", density=2500.0)
RADIUS = 0.05


@pytest.mark.parametrize("law, given, name", [
    (cn.MAL, SPRINGS | MODES | {"normal_stiffness": np.inf}, "normal_stiffness"),
    (cn.MAC, SPRINGS | {"work": 10.0, "tangential_stiffness": np.inf}, "tangential_stiffness"),
    (cn.MAC, SPRINGS | {"work": 10.0, "pressure": np.inf}, "pressure"),
    (cn.MACContact, SPRINGS | {"work": 10.0, "loss": np.inf}, "loss"),
    (cn.ParallelBond, SPRINGS | {"radius": np.inf}, "radius"),
    (cn.ParallelBond, SPRINGS | {"normal_stiffness": np.inf}, "normal_stiffness"),
    (cn.Wet, {"force": np.inf, "reach": 1e-3}, "force"),
    (cn.TH, SPRINGS | MODES | {"normal_plateau": 6.1e-6}, "normal_plateau.*6e-06 m"),
    (cn.ABP, SPRINGS | MODES | ABP | {"normal_end": 1e-9}, "normal_end.*normal_strength"),
    (cn.ABP, SPRINGS | MODES | ABP | {"tangential_end": 1e-6}, "tangential_end.*tangential_strength"),
    (cn.ABP, SPRINGS | MODES | ABP | {"first_share": 0.0}, "first_share"),
    (cn.TH, SPRINGS | MODES | {"normal_work": np.inf}, "normal_work.*1e.30"),
    (cn.TH, SPRINGS | MODES | {"tangential_work": np.inf}, "tangential_work.*1e.30"),
    (cn.ABP, SPRINGS | MODES | ABP | {"normal_work": np.inf}, "normal_work.*1e.30"),
    (cn.PlasticEXPO, SPRINGS | MODES | {"normal_work": np.inf}, "normal_work.*1e.30"),
    (cn.PlasticEXPO, SPRINGS | MODES | {"normal_strength": 1e-300}, "normal_strength.*give 0"),
    (cn.MAL, SPRINGS | MODES | {"tangential_strength": 1e-200}, "tangential_strength.*give 0"),
])  # fmt: skip
def test_what_is_no_curve_is_refused_by_name(law, given, name):
    with pytest.raises(ValueError, match=name):
        law(**given)
    if law is cn.TH and "normal_plateau" in given:
        law(**given | {"normal_plateau": 6e-6})
    if law is cn.ABP:
        law(**SPRINGS, **MODES, **ABP)


def drawn_open(law, steps, speed=1e-3, dt=1e-4):
    """A disk that is driven away from one that is held: the energies, and the area of the contact."""
    scene = cn.Scene(2)
    scene.add(cn.disks([(0.0, 0.0)], RADIUS, STONE, driven=("vx", "vy", "w")))
    scene.add(cn.disks([(0.0, 2 * RADIUS)], RADIUS, STONE, driven=("vy", "w"), drive=(0.0, speed, 0.0)))
    scene.interact(STONE, STONE, law)
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=cn.NLGS(tol=1e-10)))
    for _ in range(steps):
        assert sim.step()["status"] == "converged"
    return sim.info["energy"], RADIUS / 2


@pytest.mark.parametrize("rest", [1.0, 0.5, 0.1])
def test_curve_that_ends_with_a_step_releases_what_was_stored(rest):
    """The exponential spends G less its tail, rest of the softening part, and at the end the energy of the spring: k d^2/2."""
    stored, work = 2.0, 10.0
    rate = 2e6 / (work - stored)
    last = 2e-6 - np.log(rest) / rate
    energy, area = drawn_open(cn.EXPO(**SPRINGS, **MODES, rest=rest), int(1.1 * last / 1e-7) + 4)
    assert energy["stored"] == 0
    assert np.isclose(energy["released"] / area, stored + (work - stored) * (1 - rest), rtol=0.01)
    assert abs(energy["dissipated_normal"]) < 0.02 * energy["released"]


def test_attraction_without_end_counts_from_the_touch():
    energy, _ = drawn_open(cn.Wet(force=3.0, reach=np.inf), 50)
    assert np.isclose(energy["stored"], 3.0 * 50.5 * 1e-7, rtol=1e-6)
    assert np.isclose(energy["work_driven"], 3.0 * 50 * 1e-7, rtol=0.02)


@pytest.mark.parametrize("kind, work", [(cn.MAL, 1e30), (cn.MAL, np.inf), (cn.EXPO, 1e18), (cn.EXPO, 1e30), (cn.EXPO, np.inf),
                                        (cn.PlasticEXPO, 1e18), (cn.PlasticEXPO, 1e30)])  # fmt: skip
def test_energy_of_a_stress_that_hardly_falls_has_its_digits(kind, work):
    """Dissipation is not computed as a difference of two works. Regression: it came out as zero or negative."""
    law = kind(**SPRINGS, **MODES | dict(normal_work=work, tangential_work=work))
    energy, area = drawn_open(law, 100)
    strength, first = 2e6, 2e-6
    opening = 2 * energy["stored"] / (strength * area)
    assert 100e-7 < opening < 101e-7
    assert np.isclose(energy["released"] / area, strength * (opening - first) / 2, rtol=1e-6)
