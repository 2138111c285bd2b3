"""Materials of solids by themselves: tangents against differences, closed forms, frame indifference, energy along closed ways."""

import cairn as cn
import numpy as np
import pytest
from bulk_points import ROWS, found, params, ways
from cairn import _core

PAIRS = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)]


@pytest.mark.parametrize("name", list(ROWS))
def test_tangents_are_the_differences_of_the_stress(name):
    at = ways(name)
    if name in ("drucker_prager", "isotropic_damage", "j2_plasticity"):
        at = np.concatenate([at, 0.1 * at, 0.01 * at])
    first = found(name, at)
    begin = first["state"]  # from states that have a history
    at = at * 1.3
    here = found(name, at, begin)
    assert not here["status"].any()
    width = here["stress"].shape[1]
    tangent = here["tangent"].reshape(len(at), width, width)  # [point, by, stress]: columns of the kernel
    step = 1e-6
    for k in range(width):
        change = np.zeros((len(at), width))
        change[:, k] = step
        change = change if width == 6 else np.swapaxes(change.reshape(-1, 3, 3), 1, 2)
        one, other = found(name, at + change, begin)["stress"], found(name, at - change, begin)["stress"]
        by_difference = (one - other) / (2 * step)
        scale = np.abs(tangent).max()
        assert np.abs(by_difference - tangent[:, k]).max() < 1e-6 * scale, (name, k)
    if ROWS[name]["symmetric"]:
        assert np.abs(tangent - np.swapaxes(tangent, 1, 2)).max() < 1e-12 * np.abs(tangent).max()


@pytest.mark.parametrize("measure", [1, 2, 3])
@pytest.mark.parametrize("name", ["isotropic_elastic", "orthotropic_elastic", "j2_plasticity"])
def test_measures_of_large_strain(measure, name):
    """The tangent of the first Piola-Kirchhoff stress, for equal and different stretches; the same strain by numpy; rotations
    turn the stress and change nothing else."""
    rng = np.random.default_rng(measure)
    gradient = 0.5 * (rng.random((10, 3, 3)) - 0.5)
    gradient[0] = np.diag([0.3, 0.3, 0.3])
    gradient[1] = np.diag([0.3, 0.3 + 1e-5, -0.1])
    gradient[2] = 1e-3 * gradient[3]
    begin = np.zeros((10, len(ROWS[name]["state"])))

    def piola(h):
        p, a, energy, strain = _core.bulk_on_measure(
            measure, np.ascontiguousarray(np.swapaxes(h, 1, 2).reshape(-1, 9)), name, params(name), begin
        )
        return np.swapaxes(p.reshape(-1, 3, 3), 1, 2), a.reshape(-1, 3, 3, 3, 3), energy, strain

    p, a, energy, strain = piola(gradient)
    for i in range(3):
        for j in range(3):
            change = np.zeros((10, 3, 3))
            change[:, i, j] = 1e-6
            by_difference = (piola(gradient + change)[0] - piola(gradient - change)[0]) / 2e-6
            by = np.swapaxes(a[:, j, i], 1, 2)  # columns: [by j, by i, stress column, stress row]
            assert np.abs(by_difference - by).max() < 1e-6 * np.abs(a).max(), (measure, i, j)
    f = gradient + np.eye(3)
    value, q = np.linalg.eigh(np.swapaxes(f, 1, 2) @ f)
    law = {1: np.sqrt(value) - 1, 2: (value - 1) / 2, 3: np.log(value) / 2}[measure]
    exact = np.einsum("nij,nj,nkj->nik", q, law, q)
    voigt = np.stack([exact[:, i, j] * (1 if i == j else 2) for i, j in PAIRS], 1)
    assert np.abs(strain - voigt).max() < 1e-15 * 10
    turn = np.linalg.qr(rng.random((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    p2, _, energy2, _ = piola(turn @ f - np.eye(3))
    assert np.abs(p2 - turn @ p).max() < 1e-13 * np.abs(p).max()
    assert np.abs(energy2 - energy).max() < 1e-13 * np.abs(energy).max()


@pytest.mark.parametrize("name", [n for n, d in ROWS.items() if d["takes_gradient"]])
def test_rotations_turn_the_stress_alone(name):
    rng = np.random.default_rng(0)
    f = np.eye(3) + 0.4 * (rng.random((8, 3, 3)) - 0.5)
    turn = np.linalg.qr(rng.random((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    one, other = found(name, f - np.eye(3)), found(name, turn @ f - np.eye(3))
    p, p2 = (np.swapaxes(r["stress"].reshape(-1, 3, 3), 1, 2) for r in (one, other))
    assert np.abs(p2 - turn @ p).max() < 2e-13 * np.abs(p).max()
    assert np.abs(one["energy"] - other["energy"]).max() < 1e-13 * np.abs(one["energy"]).max()
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert np.abs(found(name, quarter @ f - np.eye(3))["energy"] - one["energy"]).max() < 1e-14
    still = found(name, turn[None] - np.eye(3))
    assert np.abs(still["stress"]).max() < 1e-14


@pytest.mark.parametrize("name", list(ROWS))
def test_energy_is_the_integral_of_the_stress_power(name):
    """Along a way of many steps stored energy and dissipation add up to the work, whose error falls with the step."""
    end = ways(name)[3:6]
    errors = []
    for steps in (1000, 4000):
        state = np.zeros((len(end), len(ROWS[name]["state"])))
        work, dissipated, stress = 0.0, 0.0, None
        for k in range(1, steps + 1):
            at = end * k / steps
            r = found(name, at, state, h=1.0 / steps, theta=1.0)
            state, dissipated = r["state"], dissipated + r["dissipated"]
            rows = r["stress"]
            change = end.reshape(len(end), -1) / steps
            if ROWS[name]["takes_gradient"]:
                change = np.swapaxes(end, 1, 2).reshape(len(end), 9) / steps
            work = work + np.sum((rows if stress is None else 0.5 * (rows + stress)) * change, axis=1)
            stress = rows
            assert (r["dissipated"] >= -1e-18).all()
        errors.append(np.abs(work - r["energy"] - dissipated).max() / np.abs(work).max())
    # of first order where yield or damage begins within a step
    assert errors[1] < 1.5e-3 and errors[1] < 0.4 * errors[0] + 1e-12, (name, errors)


def test_neo_hookean_table():
    """Uniaxial stress, E = 1, nu = 0.3: stretches across, stresses and volumes of the closed form's root."""
    table = [
        (0.5, 1.210767, -0.935352, -0.638048, 0.732979),
        (0.8, 1.067338, -0.240005, -0.210677, 0.911369),
        (1.5, 0.880175, 0.378280, 0.488288, 1.162061),
        (2.0, 0.798078, 0.646745, 1.015413, 1.273856),
    ]
    for along, across, stress, true, volume in table:
        x = across
        for _ in range(20):  # of the stress across
            r = found("neo_hookean", [np.diag([along, x, x]) - np.eye(3)], values=[1.0, 0.3])
            both = r["tangent"].reshape(9, 9)
            x -= r["stress"][0, 4] / (both[4, 4] + both[4, 8])
        p = r["stress"][0, 0]
        assert x == pytest.approx(across, abs=6e-7)
        assert p == pytest.approx(stress, abs=6e-7)
        assert p / x**2 == pytest.approx(true, abs=6e-7)
        assert along * x**2 == pytest.approx(volume, abs=6e-7)
    mu, lame = 1 / 2.6, 0.3 / (1.3 * 0.4)
    confined = found("neo_hookean", [np.diag([s - 1, 0, 0]) for s in (0.5, 1.5)], values=[1.0, 0.3])["stress"][:, 0]
    assert confined == pytest.approx([-1.376708, 0.476461], abs=6e-7)
    assert confined == pytest.approx([mu * (s - 1 / s) + lame * np.log(s) / s for s in (0.5, 1.5)], rel=1e-14)
    shear = np.zeros((1, 3, 3))
    shear[0, 0, 1] = 0.7
    p = found("neo_hookean", shear, values=[1.0, 0.3])["stress"].reshape(3, 3).T
    true = p @ (np.eye(3) + shear[0]).T
    assert true[0, 1] == pytest.approx(0.7 * mu, rel=1e-14)
    assert true[0, 0] - true[1, 1] == pytest.approx(mu * 0.49, rel=1e-13)
    assert abs(true[1, 1]) < 1e-15


def test_mooney_and_rivlin_are_a_case_of_ogden():
    """P = 2 F dW/dC with W = C10 (I1 J^-2/3 - 3) + C01 (I2 J^-4/3 - 3) + K/2 (J - 1)^2, by numpy."""
    c10, c01, bulk = 0.3, 0.2, 5.0
    f = np.eye(3) + 0.5 * (np.random.default_rng(2).random((6, 3, 3)) - 0.5)
    got = found("ogden", f - np.eye(3), values=[bulk, 2 * c10, 2.0, -2 * c01, -2.0, 0.0, 2.0])
    c = np.swapaxes(f, 1, 2) @ f
    j = np.linalg.det(f)[:, None, None]
    i1 = np.trace(c, axis1=1, axis2=2)[:, None, None]
    i2 = (i1**2 - np.trace(c @ c, axis1=1, axis2=2)[:, None, None]) / 2
    back = np.linalg.inv(c)
    s = 2 * c10 * j ** (-2 / 3) * (np.eye(3) - i1 / 3 * back)
    s = s + 2 * c01 * j ** (-4 / 3) * (i1 * np.eye(3) - c - 2 / 3 * i2 * back) + bulk * (j - 1) * j * back
    w = c10 * (i1 * j ** (-2 / 3) - 3) + c01 * (i2 * j ** (-4 / 3) - 3) + bulk / 2 * (j - 1) ** 2
    assert np.allclose(np.swapaxes(got["stress"].reshape(-1, 3, 3), 1, 2), f @ s, rtol=1e-12, atol=1e-14)
    assert np.allclose(got["energy"], w.ravel(), rtol=1e-12)


def uniaxial(name, values, strains, state=None):
    """Stress along the first axis for strains along it, none across."""
    state = np.zeros((1, len(ROWS[name]["state"]))) if state is None else state
    out, across = [], 0.0
    for e in strains:
        for _ in range(60):
            r = found(name, [[e, across, across, 0, 0, 0]], state, values=values)
            t = r["tangent"].reshape(6, 6)
            if abs(r["stress"][0, 1]) < 1e-9 * values[2]:
                break
            across -= r["stress"][0, 1] / (t[1, 1] + t[2, 1])
        state = r["state"]
        out.append(r["stress"][0, 0])
    return np.array(out), r


def test_mises_closed_forms():
    """E 200e9, yield 250e6, H 10e9 to 1 %, then back to none: isotropic and kinematic hardening."""
    young, yields, hard = 200e9, 250e6, 10e9
    for isotropic in (True, False):
        values = [young, 0.3, yields, hard if isotropic else 0.0, 0.0 if isotropic else hard, 1.0, 0.0]
        stress, r = uniaxial("j2_plasticity", values, [0.005, 0.01])
        assert stress[1] == pytest.approx(333.333333e6, rel=1e-6)
        assert r["state"][0, 0] == pytest.approx(0.00833333333, rel=1e-6)
        heat = yields * r["state"][0, 12]
        assert heat == pytest.approx(2.083333e6, rel=1e-6)
        elastic = stress[1] ** 2 / (2 * young)
        assert r["energy"][0] - elastic == pytest.approx(0.347222e6, rel=1e-5)
        assert np.diff(uniaxial("j2_plasticity", values, [0.008, 0.01])[0])[0] / 0.002 == pytest.approx(9.523810e9, rel=1e-6)
        back, _ = uniaxial("j2_plasticity", values, [0.01, 0.005, 0.0])
        assert back[-1] == pytest.approx(-396.825397e6 if isotropic else -238.095238e6, rel=1e-6)
        turn = 0.00666666667 if isotropic else 0.0075
        edge, r = uniaxial("j2_plasticity", values, [0.01, turn * (1 + 1e-9)])
        assert edge[-1] == pytest.approx(-333.333333e6 if isotropic else -166.666667e6, abs=5e3)
    shear = found("j2_plasticity", [[0, 0, 0, 0.01, 0, 0]], values=[young, 0.3, yields, 0, 0, 1.0, 0.0])
    assert shear["stress"][0, 3] == pytest.approx(144.337567e6, rel=1e-6)
    swift, r = uniaxial("j2_plasticity", [young, 0.3, yields, 0.0, 0.0, 0.01, 0.3], [0.03])
    assert swift[0] == pytest.approx(yields * (1 + r["state"][0, 12] / 0.01) ** 0.3, rel=1e-9)


def test_finite_plasticity_agrees_with_the_logarithmic_strain_where_axes_stay():
    """Without rotation of the axes the product and the sum of elastic and plastic strain are the same."""
    p = dict(young=3.0, poisson=0.3, yield_stress=0.05, isotropic=0.1, swift_strain=0.1, swift_power=0.4)
    state, other = np.zeros((1, 7)), np.zeros((1, 13))
    for k in range(1, 6):
        h = np.diag([0.1 * k, -0.04 * k, -0.03 * k])
        one = found("finite_j2", [h], state, values=params("finite_j2", **p))
        state = one["state"]
        e = np.log(1 + np.diag(h))
        two = found("j2_plasticity", [[*e, 0, 0, 0]], other, values=params("j2_plasticity", **p, kinematic=0.0))
        other = two["state"]
        tau = np.diag(one["stress"].reshape(3, 3)) * (1 + np.diag(h))
        assert tau == pytest.approx(two["stress"][0, :3], rel=1e-12)
        assert one["energy"] == pytest.approx(two["energy"], rel=1e-11)
        assert state[0, 6] == pytest.approx(other[0, 12], rel=1e-12)


def test_drucker_prager_lies_on_its_cone_and_tip():
    angle, cohesion = 0.5, 0.02
    values = params("drucker_prager", hardening=0.0)
    eta, xi = (6 * f(angle) / (np.sqrt(3) * (3 - np.sin(angle))) for f in (np.sin, np.cos))
    r = found("drucker_prager", [[0.01, -0.01, -0.01, 0.05, 0, 0], [0.05, 0.05, 0.05, 0.001, 0, 0]], values=values)
    s = r["stress"]
    p = s[:, :3].mean(axis=1)
    d = s - np.array([1, 1, 1, 0, 0, 0]) * p[:, None]
    root = np.sqrt(0.5 * np.sum(d[:, :3] ** 2, 1) + np.sum(d[:, 3:] ** 2, 1))
    assert root + eta * p == pytest.approx(xi * cohesion, rel=1e-12)
    assert root[1] < 1e-15 and p[1] == pytest.approx(xi / eta * cohesion, rel=1e-12)
    # uniaxial compression: the strength of Mohr and Coulomb
    strength = 2 * cohesion * np.cos(angle) / (1 - np.sin(angle))
    assert uniaxial("drucker_prager", values, [-0.02, -0.1])[0][-1] == pytest.approx(-strength, rel=1e-6)


def test_damage_takes_the_fracture_energy_whatever_the_cell():
    energy = 0.005
    for length in (0.5, 1.0, 2.0):
        state, work, before, last = np.zeros((1, 2)), 0.0, 0.0, 0.0
        values = params("isotropic_damage", poisson=0.0)
        for e in np.linspace(0, 8.0, 40001)[1:]:
            r = found("isotropic_damage", [[e, 0, 0, 0, 0, 0]], state, values=values, length=length)
            state = r["state"]
            work += 0.5 * (r["stress"][0, 0] + before) * (e - last)
            before, last = r["stress"][0, 0], e
        assert work * length == pytest.approx(energy, rel=2e-3)
    assert found("isotropic_damage", [[0.1, 0, 0, 0, 0, 0]], values=values, length=1e3)["status"][0] == 3


def test_a_value_at_the_end_of_what_is_allowed_is_told_with_that_end():
    with pytest.raises(ValueError, match=r"poisson of NeoHookean is 0\.5: give a value from -0\.999999 to 0\.4999"):
        cn.NeoHookean(young=1.0, poisson=0.5)


def test_help_names_the_limits_that_are_refused():
    """Poisson's ratio 1/2 is beyond the limits; help said `from -0.999999 to 0.5`."""
    assert "poisson : float, default 0\n    From -0.999999 to 0.499999999." in cn.NeoHookean.__doc__
    with pytest.raises(ValueError, match="give a value from -0.999999 to 0.499999999"):
        cn.NeoHookean(young=1.0, poisson=0.5)
