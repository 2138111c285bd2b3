"""Meshed bodies of DATBOX folders whose models name neoh_, J2iso, kvisc, or elas_ at large strains: read, run, refused."""

import cairn as cn
import numpy as np
import pytest
from cairn import legacy
from small_datbox import BAR, BULK, LAW, SEE, body, held, write
from test_verify_meshes import block

ELASTIC = ("elas: standard", "ani_: isotropic", "EYng= 1.0000000e+05  EPss= 3.0000000e-01")
VISCOUS = (*ELASTIC, "visc: KelvinVoigt", "ani_: isotropic", "EYng= 2.0000000e+02  EPss= 2.5000000e-01")
PLASTIC = (*ELASTIC, "crit: Von-Mises", "isoh: linear", "SIG0= 2.0000000e+03  K___= 5.0000000e+03", "cinh: none", "visc: none")
ALL = [
    ("small", "elas_", "ELAS", ELASTIC, None, (1e5, 0.3)),
    ("large", "elas_", "ELAS", ELASTIC, "SaintVenantKirchhoff", (1e5, 0.3)),
    ("large", "neoh_", "ELAS", ELASTIC, "NeoHookean", (1e5, 0.3)),
    ("small", "kvisc", "VISCO_ELAS", VISCOUS, "KelvinVoigt", (1e5, 0.3, 2e2, 0.25)),
    ("small", "J2iso", "ELAS_PLAS", PLASTIC, "J2Plasticity", (1e5, 0.3, 2e3, 5e3)),
    ("large", "J2iso", "ELAS_PLAS", PLASTIC, "FiniteJ2", (1e5, 0.3, 2e3, 5e3)),
]


def folder_of(folder, kinematics, law, name, rows):
    """A block of one cell that falls on a held bar."""
    gummy = f"$behav  lawty\n GUMMY  {name:30s}  Umas= 0.1000000D+04\n" + "".join(" " * 40 + row + "\n" for row in rows)
    bodies = body("RBDY2", BAR, at=(0.5, -0.05, 0), number=1) + block(1, [0, 0.05])
    see = SEE.format("RBDY2", "xxxxx", "JONCx", "DOWNx").replace(" RBDY2  xxxxx  BLEUx", " MAILx  CLxxx  BLUEx")
    write(folder / "DATBOX", bodies, see, LAW.replace("IQS_CLB    ", "GAP_SGR_CLB"), held("RBDY2", 1), bulk=BULK + gummy)
    model = f"$model  mdlty  finel  eleop  value\n M2D_L\n        MECAx  Q4xxx  kine_  {kinematics}\n"
    model += "".join(f"                      {o}\n" for o in (f"mater  {law}", "mstrg  lump_"))
    (folder / "DATBOX" / "MODELS.DAT").write_text(model)
    return folder


@pytest.mark.parametrize("kinematics, law, name, rows, kind, values", ALL, ids=[f"{k}-{m}" for k, m, *_ in ALL])
def test_a_folder_of_each_material_is_read_and_run(kinematics, law, name, rows, kind, values, tmp_path):
    scene = legacy.read_datbox(folder_of(tmp_path, kinematics, law, name, rows))
    assert not scene.legacy.unmapped
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=0.5, margin=scene.legacy.alert, solver=cn.NLGS(tol=1e-10)), overlap="ignore")
    made = sim.meshes[0].body
    if kind is None:
        assert type(made) is cn.ElasticBody
    else:
        assert made.materials["quad"] == getattr(cn, kind)(**dict(zip(made.materials["quad"].parameter_names, values)))
        assert made.materials["quad"].values[: len(values)] == values
    struck = 0.0
    for _ in range(160):
        assert sim.step()["status"] == "converged"
        struck = max(struck, abs(sim.contacts.impulse).max(initial=0.0))
    terms = sim.info["energy"]
    assert struck > 0 and np.abs(sim.meshes[0].displacement).max() > 1e-3
    assert abs(terms["closure"]) < 1e-7 * terms["in_play"]
    assert (terms["dissipated_material"] > 1e-3) == (law in ("kvisc", "J2iso"))


@pytest.mark.parametrize("kinematics, law, name, rows, told", [
    ("small", "neoh_", "ELAS", ELASTIC, r"MAILx 1: model M2D_L \(small, neoh_, iso__\) of material GUMMY \(ELAS\)"),
    ("small", "J2mix", "ELAS_PLAS", PLASTIC, r"MAILx 1: model M2D_L \(small, J2mix, iso__\)"),
    ("small", "J2iso", "ELAS", ELASTIC, r"model M2D_L \(small, J2iso, iso__\) of material GUMMY \(ELAS\)"),
    ("small", "J2iso", "ELAS_PLAS", PLASTIC[:3] + ("crit: Hill",) + PLASTIC[4:], "material GUMMY has crit: Hill, not Von-Mises"),
    ("small", "J2iso", "ELAS_PLAS", PLASTIC[:4] + ("isoh: Swift",) + PLASTIC[5:], "hardens by isoh: Swift, not linear"),
    ("small", "kvisc", "VISCO_ELAS", VISCOUS[:5], "material GUMMY lacks its EYng="),
])  # fmt: skip
def test_what_does_not_map_is_told(kinematics, law, name, rows, told, tmp_path):
    with pytest.raises(legacy.LegacyError, match=told):
        legacy.read_datbox(folder_of(tmp_path, kinematics, law, name, rows))
