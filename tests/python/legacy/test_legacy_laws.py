"""Contact laws of LMGC90's files: each name of its tables is read, run and written, or refused with what to give instead."""

import re
import warnings

import cairn as cn
import numpy as np
import pytest
from cairn import legacy
from cairn.legacy.contact_laws import LAW_VALUES, LAWS, REMEDIES, law_of
from cairn.legacy.datbox import ContactLaw

ALERT = 2e-3
VALUES = {
    "fric": 0.3, "dyfr": 0.3, "stfr": 0.3, "rstn": 0.4, "rstt": 0.0, "pgap": 0.0, "cohn": 2e5, "coht": 1e5, "sten": 5e4,
    "scom": 4e6, "Wthk": 1e-3, "scoh": 20.0, "dcoh": 20.0, "Fstr": 1e5, "prst": -0.01, "F/sr": 30.0, "Fmax": 500.0,
    "kcdw": 1e-12, "kanw": 2e-12, "cn": 1e10, "ct": 1e10, "b": 0.02, "w": 10.0, "smax": 2e5, "s1": 2e5, "s2": 3e5, "G1": 10.0,
    "G2": 30.0, "dp1": 3e-5, "dp2": 5e-5, "du1": 4e-4, "du2": 8e-4, "phi": 0.3, "eta": 0.01, "lbds": 1.0, "lbdc": 0.1,
    "F/gp": 1e6, "etan": 50.0, "T/H": 10.0, "gTot": -1e-6, "dt__": 2e-5, "snmx": 150.0, "g0": 1e-4,
    "v/cv": 2.0, "thsh": 0.5, "gcmx": -1e-5, "mu_g": 0.5, "k1": 5e10, "k2": 4e10,
    "kn": 1e6, "kt": 50.0, "damp": 400.0, "gamm": 200.0,
}  # fmt: skip
MOHR = dict(tension=2e5, cohesion=1e5, friction=0.5, mu=0.3, within=ALERT)
SPRINGS = dict(normal_stiffness=1e10, tangential_stiffness=1e10, within=ALERT)
MAC = SPRINGS | dict(work=10.0, viscosity=0.02)
EXPO = SPRINGS | dict(mu=0.3, normal_strength=2e5, tangential_strength=3e5, normal_work=10.0, tangential_work=30.0, rest=0.01)
EXPECTED = {
    "IQS_CLB": cn.Coulomb(mu=0.3),
    "IQS_DS_CLB": cn.Coulomb(mu=0.3),
    "IQS_STICK": cn.Coulomb(mu=np.inf),
    "GAP_SGR_CLB": cn.GapCoulomb(mu=0.3),
    "GAP_SGR_STICK": cn.GapCoulomb(mu=np.inf),
    "VEL_SGR_CLB": cn.Restitution(mu=0.3, closing=0),
    "RST_CLB": cn.Restitution(mu=0.3, normal=0.4, closing=0),
    "IQS_MOHR_DS_CLB": cn.MohrCoulomb(**MOHR),
    "GAP_MOHR_DS_CLB": cn.MohrCoulomb(**MOHR),
    "IQS_CAP_MOHR_DS_CLB": cn.MohrCoulomb(**MOHR | dict(tension=5e4, cap=4e6)),
    "IQS_WET_DS_CLB": cn.Wet(force=2e5, reach=1e-3, mu=0.3),
    "IQS_SGR_CLB_WEAR": cn.Wet(force=20.0, reach=1e-3, mu=0.3),
    "ELASTIC_ROD": cn.Rod(stiffness=1e5, prestrain=-0.01, within=ALERT),
    "VOIGT_ROD": cn.Rod(stiffness=1e5, prestrain=-0.01, viscosity=30.0, within=ALERT),
    "ELASTIC_WIRE": cn.Wire(stiffness=1e5, prestrain=-0.01, within=ALERT),
    "VOIGT_WIRE": cn.Wire(stiffness=1e5, prestrain=-0.01, viscosity=30.0, within=ALERT),
    "BRITTLE_ELASTIC_WIRE": cn.Wire(stiffness=1e5, prestrain=-0.01, strength=500.0, within=ALERT),
    "RIGID_WIRE": cn.Wire(within=ALERT),
    "GAP_SGR_CLB_WEAR": cn.Wear(mu=0.3, wear=3e-12, recovers=1),
    "GAP_WET_DS_CLB": cn.AdhesiveContact(force=2e5, reach=1e-3, mu=0.3, recovers=1),
    "xQS_WET_DS_CLB": cn.AdhesiveContact(force=2e5, reach=1e-3, mu=0.3, once=1, within=ALERT),
    "RST_WET_CLB": cn.AdhesiveContact(force=2e5, reach=1e-3, mu=0.3, normal=0.4, closing=0),
    "ELASTIC_REPELL_WET_CLB": cn.AdhesiveContact(force=2e5, reach=1e-3, mu=0.3, stiffness=1e9),
    "IQS_CLB_g0": cn.UnilateralContact(mu=0.3, from_start=1, within=ALERT),
    "GAP_SGR_CLB_g0": cn.UnilateralContact(mu=0.3, from_start=1, recovers=1, within=ALERT),
    "IQS_CLB_RGR": cn.GapRescue(mu=0.3, period=10.0, tolerance=-1e-6),
    "IQS_CLB_nosldt": cn.LimitedSlip(mu=0.3, limit=2e-5),
    "GAP_SGR_CLB_nosldt": cn.LimitedSlip(mu=0.3, limit=2e-5, recovers=1),
    "ELASTIC_REPELL_CLB": cn.ElasticContact(stiffness=1e6, mu=0.3),
    "ELASTIC_REPELL_CLB_g0": cn.ElasticContact(stiffness=1e6, mu=0.3, from_start=1, within=ALERT),
    "ELASTIC_REPELL_CLB_adapt": cn.ElasticContact(stiffness=1e6, mu=0.3),
    "VISCO_ELASTIC_REPELL_CLB": cn.ElasticContact(stiffness=1e6, viscosity=50.0, mu=0.3, closing=0),
    "COUPLED_DOF": cn.CoupledMotion(reach=ALERT),
    "NORMAL_COUPLED_DOF": cn.CoupledMotion(tangential=0, reach=ALERT),
    "TANGENTIAL_COUPLED_DOF": cn.CoupledMotion(normal=0, reach=ALERT),
    "BRITTLE_COATING_CLB": cn.BrittleCoating(mu=0.3, stiffness=1e6, strength=150.0, rest=1e-4, reach=ALERT),
    "CRITICAL_VOIGT_CLB": cn.CriticalVoigt(mu=0.3, period=10.0, damping=2.0, ratio=1 / 3),
    "VISCO_ELASTIC_REPELL_WET": cn.AdhesiveContact(force=2e5, reach=1e-3, mu=0.3, stiffness=1e6, viscosity=50.0, closing=0,
                                                   touching=0),
    "PLASTIC_COUPLED_DOF": cn.CoupledMotion(reach=ALERT, impulse=0.5),
    "BROKEN_DOF": cn.CoupledMotion(reach=ALERT, impulse=0.5, breaks=1),
    "IQS_WET_CZM": cn.MACContact(**MAC, force=2e5, reach=1e-3),
    "ELASTIC_REPELL_MAC_CZM": cn.MACContact(**MAC, stiffness=1e6, limit=1e-5),
    "postGAP_IQS_MAC_CZM": cn.MACContact(**MAC, mu=0.3, loss=2e-3),
    "EXPO_CZM_P": cn.PlasticEXPO(**EXPO, recovery=1, damage_share=0.5),
    "IQS_EXPO_CZM_SPRING": cn.PlasticEXPO(**EXPO, normal_spring=5e10, tangential_spring=4e10),
    "EXPO_CZM_SPRING_P": cn.PlasticEXPO(**EXPO, recovery=1, damage_share=0.5, normal_spring=5e10, tangential_spring=4e10),
    "MD_JKRs": cn.AdhesiveSpring(stiffness=1e6, adhesion=200.0, damping=0.2, viscosity=50.0, mu=0.3),
    "TH_CZM": cn.TH(normal_stiffness=1e10, tangential_stiffness=1e10, mu=0.3, recovery=1, within=ALERT, normal_strength=2e5,
                    tangential_strength=3e5, normal_work=10.0, tangential_work=30.0, normal_plateau=3e-5,
                    tangential_plateau=5e-5),
}  # fmt: skip


def folder_of(path, name, values=VALUES):
    """Four disks, an eighth of a millimetre apart, under a law of that name; two fly away."""
    scene, rock = cn.Scene(dim=2), cn.Material("rock", density=1000.0)
    x = 0.1 * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]) * 1.00125
    scene.add(cn.disks(x, 0.05, rock, velocity=[[0, 0, 0], [0, 0, 0], [0, 0, 0], [0.6, 0.9, 0]]))
    scene.interact(rock, rock, cn.Coulomb(mu=0.7))
    legacy.write_datbox(scene, path)
    file = path / "TACT_BEHAV.DAT"
    rows = ["  ".join(f"{word:<4}={values[word]:14.7E}" for word in row) for row in LAW_VALUES.get(name, ())] or [""]
    text = ("\n" + " " * 40).join(rows)
    found, changed = re.subn(r" law00  IQS_CLB .*", f" law00  {name:<30}".ljust(40) + text, file.read_text())
    assert changed == 1
    file.write_text(re.sub(r"(law00  RBDY2  DISKx  \S+ +)\S+", rf"\g<1>{ALERT:.7E}", found))
    return path


def only_law(scene):
    one = next(iter(scene.species()))
    return scene.law_between(one, one)


def ends(scene):
    strategy = cn.NSCD(solver=cn.NLGS(tol=1e-10, max_iter=20000), margin=ALERT)
    if type(only_law(scene)) is cn.AdhesiveSpring:
        strategy = cn.SmoothDEM(unstable="ignore")
    sim = cn.Simulation(scene, 2e-5, strategy, overlap="ignore")
    for _ in range(60):
        sim.step()
    return np.concatenate([sim.bodies.position, sim.bodies.velocity[:, :2]], axis=1)


APART = {
    "IQS_DS_CLB": ({"dyfr": 0.2}, cn.UnilateralContact(mu=0.3, kinetic=0.2)),
    "GAP_SGR_DS_CLB": ({"dyfr": 0.2}, cn.UnilateralContact(mu=0.3, kinetic=0.2, recovers=1)),
    "VEL_SGR_DS_CLB": ({"dyfr": 0.2}, cn.UnilateralContact(mu=0.3, kinetic=0.2, closing=0)),
    "RST_DS_CLB": ({"dyfr": 0.2}, cn.UnilateralContact(mu=0.3, kinetic=0.2, normal=0.4, closing=0)),
    "preGAP_SGR_CLB": ({"pgap": -2e-5}, cn.UnilateralContact(mu=0.3, shift=-2e-5, recovers=1)),
    "IQS_WET_DS_CLB": ({"dyfr": 0.2}, cn.AdhesiveContact(force=2e5, reach=1e-3, mu=0.3, kinetic=0.2)),
    "GAP_WET_DS_CLB": ({"dyfr": 0.2}, cn.AdhesiveContact(force=2e5, reach=1e-3, mu=0.3, kinetic=0.2, recovers=1)),
    "xQS_WET_DS_CLB": ({"dyfr": 0.2}, cn.AdhesiveContact(force=2e5, reach=1e-3, mu=0.3, kinetic=0.2, once=1, within=ALERT)),
    "RST_WET_CLB": ({"dyfr": 0.2}, cn.AdhesiveContact(force=2e5, reach=1e-3, mu=0.3, kinetic=0.2, normal=0.4, closing=0)),
    "IQS_MOHR_DS_CLB": ({"dyfr": 0.2}, cn.MohrCoulomb(**MOHR, kinetic=0.2)),
    "IQS_CAP_MOHR_DS_CLB": ({"dyfr": 0.2}, cn.MohrCoulomb(**MOHR | dict(tension=5e4, cap=4e6), kinetic=0.2)),
    "MAC_CZM": ({"dyfr": 0.2}, cn.MAC(**MAC, mu=0.3, kinetic=0.2, recovery=1)),
    "IQS_EXPO_CZM": ({"dyfr": 0.2}, cn.EXPO(**EXPO, kinetic=0.2)),
    "postGAP_IQS_MAC_CZM": ({"dyfr": 0.2}, cn.MACContact(**MAC, mu=0.3, kinetic=0.2, loss=2e-3)),
    "IQS_SGR_CLB_WEAR": ({"dcoh": 5.0}, cn.AdhesiveContact(force=20.0, torn_force=5.0, reach=1e-3, mu=0.3)),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(LAWS))
def test_each_law_is_read_run_and_written(tmp_path, name):
    stiff = {"F/gp": 1e9} if name == "ELASTIC_REPELL_WET_CLB" else {}  # beside its attraction
    read_run_and_written(tmp_path, name, VALUES | stiff, EXPECTED.get(name))


@pytest.mark.parametrize("name", sorted(APART))
def test_laws_with_values_that_differ(tmp_path, name):
    read_run_and_written(tmp_path, name, VALUES | APART[name][0], APART[name][1])


@pytest.mark.parametrize("dim", [2, 3])
def test_the_tangential_spring_of_voigt_contacts_is_as_stiff_as_w_has_it(dim):
    """k_T W_TT = k_N W_NN of round and solid bodies of whatever sizes."""
    scene, rock, along = cn.Scene(dim), cn.Material("rock", density=1000.0), np.eye(dim)[0]
    make, velocity = cn.disks if dim == 2 else cn.spheres, np.zeros((2, 3 * dim - 3))
    velocity[1, 0] = -1.0
    scene.add(make([0 * along, 0.3 * along], [0.1, 0.2], rock, velocity=velocity))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-9, overlap="ignore")  # they hardly overlap
    sim.step()
    w = sim.problem().W
    w = w.toarray() if hasattr(w, "toarray") else np.asarray(w)
    law, _, notes = law_of(ContactLaw("cv", "CRITICAL_VOIGT_CLB", parameters={"T/H": 10.0, "v/cv": 2.0, "fric": 0.3}), ALERT, dim)
    assert law.ratio == pytest.approx(w[0, 0] / w[1, 1], rel=1e-7) and "solid disks or spheres" in notes[0]


def read_run_and_written(tmp_path, name, values, expected):
    scene = legacy.read_datbox(folder_of(tmp_path / "DATBOX", name, values))
    law = only_law(scene)
    if expected is not None:
        assert law == expected
    legacy.write_datbox(scene, tmp_path / "again")
    again = legacy.read_datbox(tmp_path / "again")
    assert type(only_law(again)) is type(law) and np.allclose(only_law(again).values, law.values, rtol=1e-7)
    one, other = ends(scene), ends(again)
    assert np.abs(one - other).max() < 1e-6 * 0.05 and np.abs(one[:, 2:]).max() > 0.1
    legacy.write_datbox(again, tmp_path / "third")
    files = [(tmp_path / place / "TACT_BEHAV.DAT").read_text() for place in ("again", "third")]
    assert files[0] == files[1]


@pytest.mark.parametrize("name", sorted(REMEDIES))
def test_a_law_without_a_counterpart_is_refused_with_what_to_give(tmp_path, name):
    with pytest.raises(legacy.LegacyError, match=rf"contact law law00 \({name}\), instead of which: .*TACT_BEHAV.DAT, line"):
        legacy.read_datbox(folder_of(tmp_path / "DATBOX", name))
    assert name not in LAWS


@pytest.mark.parametrize(
    ("name", "changed", "told"),
    [
        ("IQS_MAC_CZM", {"dyfr": 0.4}, "more where it slides"),
        ("EXPO_CZM_P", {"mu_g": 1.5}, "damage_share"),
        ("IQS_DS_CLB", {"dyfr": 0.4}, "more where it slides: give dyfr up to stfr"),
        ("IQS_WET_DS_CLB", {"dyfr": 0.4}, "more where it slides"),
        ("IQS_SGR_CLB_WEAR", {"dcoh": 25.0}, "more after it broke: give dcoh up to scoh"),
        ("IQS_MOHR_DS_CLB", {"cohn": 0.0}, "without cohn: give IQS_CLB"),
        ("MD_JKRs", {"kn": 0.0}, "without kn: give a stiffness"),
    ],
)
def test_what_a_law_has_no_word_for_is_told(tmp_path, name, changed, told):
    with pytest.raises(legacy.LegacyError, match=told):
        legacy.read_datbox(folder_of(tmp_path / "DATBOX", name, VALUES | changed))


@pytest.mark.parametrize(
    ("law", "told"),
    [
        (cn.Rod(stiffness=1e5, strength=10.0, within=1e-3), "strength"),
        (cn.Wire(stiffness=1e5, viscosity=1.0, strength=10.0, within=1e-3), "stiffness, viscosity and strength"),
        (cn.Wear(mu=0.3, wear=1e-12), "an overlap that stays"),
        (cn.MohrCoulomb(tension=1e5, cohesion=1e5), "no friction while it is whole"),
        (cn.Rolling(mu=0.3, rolling=0.1), "Rolling"),
        (cn.Restitution(normal=0.5, mu=np.inf, closing=0), "mu without end"),
        (cn.MohrCoulomb(**MOHR | dict(mu=np.inf)), "mu, kinetic without end"),
        (cn.MohrCoulomb(tension=1e5, cohesion=0, friction=0.5, within=ALERT), "no cohesion"),
        (cn.Wet(force=1.0, reach=np.inf, mu=0.3), "reach without end"),
        (cn.MAC(normal_stiffness=1e10, tangential_stiffness=1e10, mu=np.inf, work=10.0, within=ALERT), "mu, kinetic without end"),
        (cn.Wear(mu=np.inf, wear=1e-12, recovers=1), "mu without end"),
        (cn.UnilateralContact(mu=0.3, shift=1e-4), "shift, from_start, restitution and kinetic"),
        (cn.UnilateralContact(mu=0.3, normal=0.5), "closing=1 with a restitution"),
        (cn.UnilateralContact(mu=0.3, recovers=0.5), "shares of recovers"),
        (cn.ElasticContact(stiffness=1e6, viscosity=1.0), "viscosity with closing"),
        (cn.ElasticContact(stiffness=np.inf), "stiffness without end"),
        (cn.AdhesiveContact(force=1.0, reach=1e-3, stiffness=1e6, viscosity=1.0), "stiffness, viscosity"),
        (cn.AdhesiveContact(force=1.0, reach=1e-3, normal=0.5), "closing=1 with a restitution"),
        (cn.CoupledMotion(normal=0, tangential=0, reach=1e-3), "nothing that is coupled"),
        (cn.CoupledMotion(tangential=0, reach=1e-3, impulse=1.0), "a limit of what is coupled in part"),
        (cn.CoupledMotion(reach=1e-3, breaks=1), "impulse without end"),
        (cn.AdhesiveContact(force=1.0, reach=1e-3, touching=0), "touching=0 without a stiffness"),
        (cn.MACContact(**MAC), "all but one of force, stiffness and loss"),
        (cn.MACContact(**MAC, force=1.0, reach=1e-3, mu=0.3), "friction beside force or stiffness"),
        (cn.PlasticEXPO(**EXPO, normal_spring=1e10), "tangential_spring without end"),
    ],
)
def test_what_the_format_has_no_word_for_is_named(tmp_path, law, told):
    scene, rock = cn.Scene(dim=2), cn.Material("rock", density=1000.0)
    scene.add(cn.disks([[0.0, 0.0], [0.1002, 0.0]], 0.05, rock))
    scene.interact(rock, rock, law)
    with pytest.raises(legacy.LegacyError, match=told):
        legacy.write_datbox(scene, tmp_path)


@pytest.mark.parametrize(
    ("law", "told"),
    [
        (cn.Restitution(mu=0.3, normal=0.4), "closing=1 of law .*, which RST_CLB is read with as closing=0"),
        (cn.MohrCoulomb(**MOHR | dict(within=0)), "within=0 of law .* is read with as within=0.001"),
        (cn.Rod(stiffness=1e5, within=0), "within=0 of law .* is read with as within=0.001"),
        (cn.UnilateralContact(mu=0.3, from_start=1), "within=0 of law .* is read with as within=0.001"),
        (cn.MACContact(**MAC, loss=1e-3), "loss=0.001 of law .*, which postGAP_IQS_MAC_CZM is read with as loss=0.002"),
        (cn.CriticalVoigt(mu=0.3), "ratio=1 of law .*, which CRITICAL_VOIGT_CLB is read with as ratio=0.333"),
        (cn.MohrCoulomb(**MOHR), None),
        (cn.CoupledMotion(reach=ALERT), None),
        (cn.BrittleCoating(stiffness=1e5, strength=10.0, reach=2e-3), None),
        (cn.Restitution(mu=0.3, normal=0.4, closing=0), None),
    ],
)
def test_a_law_that_is_read_otherwise_is_told(tmp_path, law, told):
    scene, rock = cn.Scene(dim=2), cn.Material("rock", density=1000.0)
    scene.add(cn.disks([[0.0, 0.0], [0.1, 0.0]], 0.05, rock))
    scene.interact(rock, rock, law)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        legacy.write_datbox(scene, tmp_path)
    assert [bool(told and re.search(told, str(one.message))) for one in caught] == [True] * (told is not None)
    again = only_law(legacy.read_datbox(tmp_path))
    assert np.allclose(again.values, law.values, rtol=1e-7, atol=0) == (told is None)


def test_the_page_lists_every_name():
    page = (cn_docs() / "legacy.md").read_text(encoding="utf-8")
    for name in (*LAWS, *REMEDIES):
        short = name.removeprefix("IQS_") if name.endswith(("_CZM", "_CZM_P", "_CZM_SPRING", "_CZM_SPRING_P")) else name
        assert re.search(rf"`(IQS_)?{short}`", page), name


def cn_docs():
    from pathlib import Path

    return Path(__file__).resolve().parents[3] / "docs"
