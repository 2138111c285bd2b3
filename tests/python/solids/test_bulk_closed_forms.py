"""A closed form of each material of solids at a point: none comes into the list without one."""

import numpy as np
import pytest
from cairn import _core
from scipy.optimize import brentq

ROWS = {d["name"]: d for d in _core.bulk_materials() if not d["umat"]}
YOUNG, POISSON = 3.0, 0.3
SHEAR, LAME = YOUNG / (2 * (1 + POISSON)), YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
ELASTIC = {"young": YOUNG, "poisson": POISSON}


def found(name, law, measure, state=None, h=1.0, theta=1.0, length=1.0):
    """Response to strains 11 22 33 12 23 13 with twice the shear (6), or to gradients F (3, 3), whose stress (3, 3) is P."""
    values = [law.get(p[0], p[1]) for p in ROWS[name]["parameters"]]
    measure = np.asarray(measure, float)
    rows = (measure - np.eye(3)).T.reshape(1, 9) if measure.ndim == 2 else measure.reshape(1, 6)
    begin = np.zeros((1, len(ROWS[name]["state"]))) if state is None else state
    r = _core.bulk_points(name, values, np.ascontiguousarray(rows), begin, h, theta, length)
    assert not r["status"].any()
    r["stress"] = r["stress"].reshape(3, 3).T if measure.ndim == 2 else r["stress"][0]
    r["energy"], r["dissipated"] = r["energy"][0], r["dissipated"][0]
    return r


def same(one, other, tolerance=1e-13):
    assert np.allclose(one, other, rtol=0, atol=tolerance * np.abs(other).max()), (one, other)


def sheared(g):
    f = np.eye(3)
    f[0, 1] = g
    return f


def isotropic_elastic():
    """A bar, a fluid pressure and a shear."""
    e = 0.02
    same(found("isotropic_elastic", ELASTIC, [e, -POISSON * e, -POISSON * e, 0, 0, 0])["stress"], [YOUNG * e, 0, 0, 0, 0, 0])
    pressed = found("isotropic_elastic", ELASTIC, [e, e, e, 0, 0, 0])
    same(pressed["stress"][:3], [YOUNG * e / (1 - 2 * POISSON)] * 3)
    assert pressed["energy"] == pytest.approx(1.5 * YOUNG * e**2 / (1 - 2 * POISSON), rel=1e-14)
    same(found("isotropic_elastic", ELASTIC, [0, 0, 0, e, 0, 0])["stress"], [0, 0, 0, SHEAR * e, 0, 0])


def orthotropic_elastic():
    """A bar that is cut askew, and sheared across (Lekhnitskii 1963)."""
    e1, e2, e3, v12, v13, v23, g12, g23, g13 = 3.0, 2.0, 1.0, 0.3, 0.2, 0.25, 0.8, 0.5, 0.7
    law = dict(young1=e1, young2=e2, young3=e3, poisson12=v12, poisson13=v13, poisson23=v23)
    law |= dict(shear12=g12, shear23=g23, shear13=g13)
    for angle in (0.0, 0.4, 1.1, -0.7, np.pi / 2):
        c, s = np.cos(angle), np.sin(angle)
        along = c**4 / e1 + (1 / g12 - 2 * v12 / e1) * (s * c) ** 2 + s**4 / e2
        across = -v12 / e1 * (s**4 + c**4) + (1 / e1 + 1 / e2 - 1 / g12) * (s * c) ** 2
        askew = (2 / e1 + 2 * v12 / e1 - 1 / g12) * s * c**3 - (2 / e2 + 2 * v12 / e1 - 1 / g12) * s**3 * c
        up = -(v13 / e1 * c**2 + v23 / e2 * s**2)
        own = {**law, "angle": angle}
        same(found("orthotropic_elastic", own, [along, across, up, askew, 0, 0])["stress"], [1, 0, 0, 0, 0, 0])
        bent = [0, 0, 0, 0, s * c * (1 / g13 - 1 / g23), c**2 / g13 + s**2 / g23]
        same(found("orthotropic_elastic", own, bent)["stress"], [0, 0, 0, 0, 0, 1])


def kelvin_voigt():
    """Strained at a rate; creep of a bar, of the first order in the step: (sigma/E) (1 - exp(-t E/eta)), which dissipates
    sigma^2/(2E) (1 - exp(-2 t E/eta))."""
    law = {**ELASTIC, "viscous_young": 0.6, "viscous_poisson": POISSON}
    bar = np.array([1, -POISSON, -POISSON, 0, 0, 0])
    r = found("kelvin_voigt", law, 0.02 * bar, h=0.05)
    same(r["stress"], [YOUNG * 0.02 + 0.6 * 0.02 / 0.05, 0, 0, 0, 0, 0])
    assert r["dissipated"] == pytest.approx(0.05 * 0.6 * (0.02 / 0.05) ** 2, rel=1e-13)
    stress, end, left = 0.07, 0.3, []
    for steps in (100, 200):
        state, spent, h = np.zeros((1, 12)), 0.0, end / steps
        for _ in range(steps):
            last = state[0, 0]
            strain = (stress * h + 0.6 * last) / (YOUNG * h + 0.6)  # of the bar that bears it
            r = found("kelvin_voigt", law, strain * bar, state, h=h)
            same(r["stress"], [stress, 0, 0, 0, 0, 0])
            state, spent = r["state"], spent + r["dissipated"]
        gone = np.exp(-end * YOUNG / 0.6)
        left.append([strain / (stress / YOUNG * (1 - gone)) - 1, spent / (stress**2 / (2 * YOUNG) * (1 - gone**2)) - 1])
    assert np.abs(left[1]).max() < 5e-3 and np.allclose(np.array(left[0]) / left[1], 2.0, rtol=0.02)


def saint_venant_kirchhoff():
    """A bar, a bar in a tube, and simple shear."""
    for stretch in (0.7, 1.4):
        strain = (stretch**2 - 1) / 2
        across = np.sqrt(1 - 2 * POISSON * strain)
        bar = found("saint_venant_kirchhoff", ELASTIC, np.diag([stretch, across, across]))
        same(bar["stress"], np.diag([YOUNG * strain * stretch, 0, 0]))
        assert bar["energy"] == pytest.approx(YOUNG / 2 * strain**2, rel=1e-13)
        held = found("saint_venant_kirchhoff", ELASTIC, np.diag([stretch, 1, 1]))["stress"]
        same(np.diag(held), np.array([stretch * (LAME + 2 * SHEAR), LAME, LAME]) * strain)
    g = 0.7
    p = found("saint_venant_kirchhoff", ELASTIC, sheared(g))["stress"]
    second = np.array([LAME * g**2 / 2, LAME * g**2 / 2 + SHEAR * g**2, LAME * g**2 / 2, SHEAR * g])
    same(p[:2, :2], [[second[0] + g * second[3], second[3] + g * second[1]], [second[3], second[1]]])


def neo_hookean():
    """A bar in a tube, simple shear, and a bar whose width is the root of its equation."""
    for stretch in (0.6, 1.7):
        p = found("neo_hookean", ELASTIC, np.diag([stretch, 1, 1]))["stress"]
        log = np.log(stretch)
        same(np.diag(p), [SHEAR * (stretch - 1 / stretch) + LAME * log / stretch, LAME * log, LAME * log])
        w = brentq(lambda w, log=log: SHEAR * (w**2 - 1) + LAME * (log + 2 * np.log(w)), 0.2, 3, xtol=1e-15, rtol=1e-15)
        p = found("neo_hookean", ELASTIC, np.diag([stretch, w, w]))["stress"]
        same(p, np.diag([SHEAR * (stretch - w**2 / stretch), 0, 0]), 1e-12)
    g = 0.7
    p = found("neo_hookean", ELASTIC, sheared(g))["stress"]
    same((p @ sheared(g).T)[:2, :2], [[SHEAR * g**2, SHEAR * g], [SHEAR * g, 0]])


def ogden():
    """Three terms, a stretch that keeps the volume: sigma1 - sigma2 = sum mu (a^n - a^(-n/2)); then a pressure K (J - 1)."""
    law = {"bulk": 4.0, "shear1": 1.2, "power1": 1.7, "shear2": -0.4, "power2": -2.0, "shear3": 0.1, "power3": 4.0}
    terms = [(law[f"shear{k}"], law[f"power{k}"]) for k in (1, 2, 3)]
    for a in (0.6, 1.9):
        apart = sum(mu * (a**n - a ** (-n / 2)) for mu, n in terms)
        f = np.diag([a, a**-0.5, a**-0.5])
        same(np.diag(found("ogden", law, f)["stress"] @ f), np.array([2, -1, -1]) / 3 * apart)
        stored = sum(mu / n * (a**n + 2 * a ** (-n / 2) - 3) for mu, n in terms)
        assert found("ogden", law, f)["energy"] == pytest.approx(stored, rel=1e-13)
    f = 1.1 * np.eye(3)
    same(found("ogden", law, f)["stress"] @ f.T / 1.1**3, 4.0 * (1.1**3 - 1) * np.eye(3))


def plastic(hard):
    """Strain of a flow that keeps the volume, by a strain e along an axis: 3 G (e - p) = sigma_y + H p."""
    e, yields = 0.2, 0.05
    p = (3 * SHEAR * e - yields) / (3 * SHEAR + hard)
    return e, yields, p, yields + hard * p


def j2_plasticity():
    """Isotropic and kinematic hardening together, in uniaxial stress and in shear."""
    law = {**ELASTIC, "yield_stress": 0.05, "isotropic": 0.1, "kinematic": 0.2}
    e, yields, p, stress = plastic(0.3)
    r = found("j2_plasticity", law, [e, -e / 2, -e / 2, 0, 0, 0])
    same(r["stress"], np.array([2, -1, -1, 0, 0, 0]) / 3 * stress)
    assert r["state"][0, 12] == pytest.approx(p, rel=1e-13) and r["dissipated"] == pytest.approx(yields * p, rel=1e-13)
    assert r["energy"] == pytest.approx(stress**2 / (6 * SHEAR) + 0.3 / 2 * p**2, rel=1e-13)
    r = found("j2_plasticity", law, [0, 0, 0, np.sqrt(3) * e, 0, 0])
    same(r["stress"], [0, 0, 0, stress / np.sqrt(3), 0, 0])


def finite_j2():
    """The same of Kirchhoff's stress and logarithms."""
    for hard in (0.0, 0.2):
        law = {**ELASTIC, "yield_stress": 0.05, "isotropic": 0.1, "kinematic": hard}
        e, yields, p, stress = plastic(0.1 + hard)
        f = np.diag(np.exp([e, -e / 2, -e / 2]))
        r = found("finite_j2", law, f)
        same(r["stress"] @ f, np.diag([2, -1, -1]) / 3 * stress, 1e-12)
        assert r["state"][0, 6] == pytest.approx(p, rel=1e-12) and r["dissipated"] == pytest.approx(yields * p, rel=1e-12)
        assert r["energy"] == pytest.approx(stress**2 / (6 * SHEAR) + (0.1 + hard) / 2 * p**2, rel=1e-12)


def drucker_prager():
    """Shear without and under pressure, tau = xi c + eta p: the cone through the outer edges of Mohr and Coulomb's."""
    angle, cohesion, bulk = 0.5, 0.02, YOUNG / (3 * (1 - 2 * POISSON))
    law = {**ELASTIC, "cohesion": cohesion, "friction_angle": angle}
    eta, xi = (6 * f(angle) / (np.sqrt(3) * (3 - np.sin(angle))) for f in (np.sin, np.cos))
    for pressure in (0.0, 0.1):
        e = -pressure / (3 * bulk)
        r = found("drucker_prager", law, [e, e, e, 0.3, 0, 0])
        same(r["stress"], [-pressure, -pressure, -pressure, xi * cohesion + eta * pressure, 0, 0], 1e-12)


def isotropic_damage():
    """A bar beyond its strength: f exp(-(e - e0)/d), d = G/(l f) - e0/2, and back along the secant."""
    law = {"young": YOUNG, "poisson": 0.0, "strength": 0.03, "fracture_energy": 0.005}
    first = 0.03 / YOUNG
    for length in (0.5, 2.0):
        decay = 0.005 / (length * 0.03) - first / 2
        state = None
        for e in (0.5 * first, first, 2 * first, 0.1, 0.4):
            r = found("isotropic_damage", law, [e, 0, 0, 0, 0, 0], state, length=length)
            stress = min(YOUNG * e, 0.03 * np.exp(-(e - first) / decay))
            same(r["stress"], [stress, 0, 0, 0, 0, 0], 1e-11)  # the remaining stiffness is 1 less the damage
            state = r["state"]
        back = found("isotropic_damage", law, [0.1, 0, 0, 0, 0, 0], state, length=length)
        same(back["stress"], [stress * 0.1 / 0.4, 0, 0, 0, 0, 0], 1e-11)


FORMS = [isotropic_elastic, orthotropic_elastic, kelvin_voigt, saint_venant_kirchhoff, neo_hookean, ogden, j2_plasticity,
         finite_j2, drucker_prager, isotropic_damage]  # fmt: skip


@pytest.mark.parametrize("form", FORMS, ids=lambda f: f.__name__)
def test_a_material_has_the_stress_of_its_closed_form(form):
    form()


def test_every_material_has_a_closed_form():
    assert sorted(f.__name__ for f in FORMS) == sorted(ROWS)
