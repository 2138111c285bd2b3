"""Contact laws of TACT_BEHAV.DAT: their values in the file, the corresponding laws of Cairn, and remedies for the others."""

from __future__ import annotations

import numpy as np

from ..model import laws

# Names of the values of a law, row by row of the file; values are in columns 46-59 and 67-80.
_FRICTION = ("fric",)
_TWO = ("dyfr", "stfr")
_COHESION, _STRAIN, _SPRING = ("cohn", "coht"), ("Fstr", "prst"), ("F/gp",)
LAW_VALUES = {
    "IQS_CLB": (_FRICTION,),
    "GAP_SGR_CLB": (_FRICTION,),
    "VEL_SGR_CLB": (_FRICTION,),
    "preGAP_SGR_CLB": (("pgap", "fric"),),
    "RST_CLB": (("rstn", "rstt"), _FRICTION),
    "RST_DS_CLB": (("rstn", "rstt"), _TWO),
    "IQS_DS_CLB": (_TWO,),
    "GAP_SGR_DS_CLB": (_TWO,),
    "VEL_SGR_DS_CLB": (_TWO,),
    "IQS_STICK": (),
    "GAP_SGR_STICK": (),
    "IQS_MOHR_DS_CLB": (_COHESION, _TWO),
    "GAP_MOHR_DS_CLB": (_COHESION, _TWO),
    "IQS_CAP_MOHR_DS_CLB": (_COHESION, _TWO, ("sten", "scom")),
    "IQS_WET_DS_CLB": (_COHESION, ("Wthk",), _TWO),
    "GAP_WET_DS_CLB": (_COHESION, ("Wthk",), _TWO),
    "IQS_SGR_CLB_WEAR": (("scoh", "dcoh"), ("fric", "Wthk")),
    "ELASTIC_ROD": (_STRAIN,),
    "VOIGT_ROD": (_STRAIN, ("F/sr",)),
    "ELASTIC_WIRE": (_STRAIN,),
    "VOIGT_WIRE": (_STRAIN, ("F/sr",)),
    "BRITTLE_ELASTIC_WIRE": (_STRAIN, ("Fmax",)),
    "RIGID_WIRE": (),
    "GAP_SGR_CLB_WEAR": (("kcdw", "kanw"), _FRICTION),
    "IQS_CLB_g0": (_FRICTION,),
    "GAP_SGR_CLB_g0": (_FRICTION,),
    "IQS_CLB_RGR": (("T/H", "gTot"), _FRICTION),
    "IQS_CLB_nosldt": (("fric", "dt__"),),
    "GAP_SGR_CLB_nosldt": (("fric", "dt__"),),
    "ELASTIC_REPELL_CLB": (_SPRING, _FRICTION),
    "ELASTIC_REPELL_CLB_g0": (_SPRING, _FRICTION),
    "ELASTIC_REPELL_CLB_adapt": (_SPRING, _FRICTION),
    "VISCO_ELASTIC_REPELL_CLB": (("F/gp", "etan"), _FRICTION),
    "ELASTIC_REPELL_WET_CLB": (_SPRING, ("cohn", "Wthk"), _FRICTION),
    "RST_WET_CLB": (_COHESION, ("rstn", "rstt"), ("Wthk",), _TWO),
    "xQS_WET_DS_CLB": (_COHESION, ("Wthk",), _TWO),
    "COUPLED_DOF": (),
    "NORMAL_COUPLED_DOF": (),
    "TANGENTIAL_COUPLED_DOF": (),
    "BRITTLE_COATING_CLB": (_FRICTION, _SPRING, ("snmx",), ("g0",)),
    "CRITICAL_VOIGT_CLB": (("T/H", "v/cv"), _FRICTION),
    "VISCO_ELASTIC_REPELL_WET": (("F/gp", "etan"), ("cohn", "Wthk"), _FRICTION),
    "PLASTIC_COUPLED_DOF": (("thsh",),),
    "BROKEN_DOF": (("thsh",),),
    "MD_JKRs": (("kn", "kt"), ("damp", "gamm"), _FRICTION),
    "IQS_WET_CZM": (("cohn", "Wthk"), ("cn", "ct"), ("b", "w")),
    "ELASTIC_REPELL_MAC_CZM": (("F/gp", "gcmx"), ("cn", "ct"), ("b", "w")),
    "postGAP_IQS_MAC_CZM": (_TWO, ("cn", "ct"), ("b", "w")),
}
_ZONE_ROWS = (_TWO, ("cn", "ct"))
_MODE_ROWS = (("s1", "s2"), ("G1", "G2"))
for _name, _rows in {
    "MAC_CZM": (*_ZONE_ROWS, ("b", "w")),
    "MP_CZM": (*_ZONE_ROWS, ("w",)),
    "MP3_CZM": (*_ZONE_ROWS, ("smax", "w")),
    "MAL_CZM": (*_ZONE_ROWS, *_MODE_ROWS),
    "TH_CZM": (*_ZONE_ROWS, *_MODE_ROWS, ("dp1", "dp2")),
    "ABP_CZM": (*_ZONE_ROWS, *_MODE_ROWS, ("du1", "du2"), ("phi",)),
    "EXPO_CZM": (*_ZONE_ROWS, *_MODE_ROWS, ("eta",)),
    "EXPO_CZM_P": (*_ZONE_ROWS, *_MODE_ROWS, ("mu_g", "eta")),
    "EXPO_CZM_SPRING": (*_ZONE_ROWS, *_MODE_ROWS, ("eta",), ("k1", "k2")),
    "EXPO_CZM_SPRING_P": (*_ZONE_ROWS, *_MODE_ROWS, ("mu_g", "eta"), ("k1", "k2")),
}.items():
    LAW_VALUES |= {_name: _rows, "IQS_" + _name: _rows}
LAW_VALUES["MP3_CZM_THER"] = (*LAW_VALUES["MP3_CZM"], ("lbds", "lbdc"))

# {law of LMGC90: (law of Cairn, {its parameter: value of the file})}.
_MU, _STATIC = {"mu": "fric"}, {"mu": "stfr"}
_RESTITUTION = {"normal": "rstn", "tangential": "rstt"}
_ROD = {"stiffness": "Fstr", "prestrain": "prst"}
_DRY = {"mu": "stfr", "kinetic": "dyfr"}
_ATTRACTION = {"force": "cohn", "reach": "Wthk"}
LAWS = {
    "IQS_CLB": ("Coulomb", _MU),
    "GAP_SGR_CLB": ("GapCoulomb", _MU),
    "RST_CLB": ("Restitution", _MU | _RESTITUTION),
    "VEL_SGR_CLB": ("Restitution", _MU),
    "preGAP_SGR_CLB": ("GapCoulomb", _MU),
    "IQS_DS_CLB": ("Coulomb", _STATIC),
    "GAP_SGR_DS_CLB": ("GapCoulomb", _STATIC),
    "VEL_SGR_DS_CLB": ("Restitution", _STATIC),
    "RST_DS_CLB": ("Restitution", _STATIC | _RESTITUTION),
    "IQS_STICK": ("Coulomb", {}),
    "GAP_SGR_STICK": ("GapCoulomb", {}),
    "IQS_MOHR_DS_CLB": ("MohrCoulomb", _DRY | {"tension": "cohn", "cohesion": "coht"}),
    "GAP_MOHR_DS_CLB": ("MohrCoulomb", _DRY | {"tension": "cohn", "cohesion": "coht"}),
    "IQS_CAP_MOHR_DS_CLB": ("MohrCoulomb", _DRY | {"tension": "sten", "cohesion": "coht", "cap": "scom"}),
    "IQS_WET_DS_CLB": ("Wet", _STATIC | _ATTRACTION),
    "GAP_WET_DS_CLB": ("AdhesiveContact", _DRY | _ATTRACTION),
    "RST_WET_CLB": ("AdhesiveContact", _DRY | _ATTRACTION | _RESTITUTION),
    "xQS_WET_DS_CLB": ("AdhesiveContact", _DRY | _ATTRACTION),
    "ELASTIC_REPELL_WET_CLB": ("AdhesiveContact", _MU | _ATTRACTION | {"stiffness": "F/gp"}),
    "IQS_SGR_CLB_WEAR": ("Wet", _MU | {"force": "scoh", "reach": "Wthk"}),
    "IQS_CLB_g0": ("UnilateralContact", _MU),
    "GAP_SGR_CLB_g0": ("UnilateralContact", _MU),
    "IQS_CLB_RGR": ("GapRescue", _MU | {"period": "T/H", "tolerance": "gTot"}),
    "IQS_CLB_nosldt": ("LimitedSlip", _MU | {"limit": "dt__"}),
    "GAP_SGR_CLB_nosldt": ("LimitedSlip", _MU | {"limit": "dt__"}),
    "ELASTIC_REPELL_CLB": ("ElasticContact", _MU | {"stiffness": "F/gp"}),
    "ELASTIC_REPELL_CLB_g0": ("ElasticContact", _MU | {"stiffness": "F/gp"}),
    "ELASTIC_REPELL_CLB_adapt": ("ElasticContact", _MU | {"stiffness": "F/gp"}),
    "VISCO_ELASTIC_REPELL_CLB": ("ElasticContact", _MU | {"stiffness": "F/gp", "viscosity": "etan"}),
    "COUPLED_DOF": ("CoupledMotion", {}),
    "NORMAL_COUPLED_DOF": ("CoupledMotion", {}),
    "TANGENTIAL_COUPLED_DOF": ("CoupledMotion", {}),
    "BRITTLE_COATING_CLB": ("BrittleCoating", _MU | {"stiffness": "F/gp", "strength": "snmx", "rest": "g0"}),
    "ELASTIC_ROD": ("Rod", _ROD),
    "VOIGT_ROD": ("Rod", _ROD | {"viscosity": "F/sr"}),
    "ELASTIC_WIRE": ("Wire", _ROD),
    "VOIGT_WIRE": ("Wire", _ROD | {"viscosity": "F/sr"}),
    "BRITTLE_ELASTIC_WIRE": ("Wire", _ROD | {"strength": "Fmax"}),
    "RIGID_WIRE": ("Wire", {}),
    "GAP_SGR_CLB_WEAR": ("Wear", _MU),
    "CRITICAL_VOIGT_CLB": ("CriticalVoigt", _MU | {"period": "T/H", "damping": "v/cv"}),
    "VISCO_ELASTIC_REPELL_WET": ("AdhesiveContact", _MU | _ATTRACTION | {"stiffness": "F/gp", "viscosity": "etan"}),
    "PLASTIC_COUPLED_DOF": ("CoupledMotion", {"impulse": "thsh"}),
    "BROKEN_DOF": ("CoupledMotion", {"impulse": "thsh"}),
    "MD_JKRs": ("AdhesiveSpring", _MU | {"stiffness": "kn", "adhesion": "gamm", "viscosity": "kt"}),
}
_SPRINGS = {"normal_stiffness": "cn", "tangential_stiffness": "ct"}
_ZONE = _DRY | _SPRINGS
_MAC = _SPRINGS | {"viscosity": "b", "work": "w"}
LAWS |= {
    "IQS_WET_CZM": ("MACContact", _MAC | _ATTRACTION),
    "ELASTIC_REPELL_MAC_CZM": ("MACContact", _MAC | {"stiffness": "F/gp"}),
    "postGAP_IQS_MAC_CZM": ("MACContact", _MAC | _DRY),
}
_MODES = {"normal_strength": "s1", "tangential_strength": "s2", "normal_work": "G1", "tangential_work": "G2"}
_PLASTIC, _SERIES = {"damage_share": "mu_g"}, {"normal_spring": "k1", "tangential_spring": "k2"}
_ZONES = {
    "MAC_CZM": ("MAC", _ZONE | {"viscosity": "b", "work": "w"}),
    "MP_CZM": ("MP", _ZONE | {"work": "w"}),
    "MP3_CZM": ("MP3", _ZONE | {"strength": "smax", "work": "w"}),
    "MAL_CZM": ("MAL", _ZONE | _MODES),
    "TH_CZM": ("TH", _ZONE | _MODES | {"normal_plateau": "dp1", "tangential_plateau": "dp2"}),
    "ABP_CZM": ("ABP", _ZONE | _MODES | {"normal_end": "du1", "tangential_end": "du2", "first_share": "phi"}),
    "EXPO_CZM": ("EXPO", _ZONE | _MODES | {"rest": "eta"}),
    "EXPO_CZM_P": ("PlasticEXPO", _ZONE | _MODES | {"rest": "eta"} | _PLASTIC),
    "EXPO_CZM_SPRING": ("PlasticEXPO", _ZONE | _MODES | {"rest": "eta"} | _SERIES),
    "EXPO_CZM_SPRING_P": ("PlasticEXPO", _ZONE | _MODES | {"rest": "eta"} | _PLASTIC | _SERIES),
}
_ZONES["MP3_CZM_THER"] = _ZONES["MP3_CZM"]
LAWS |= _ZONES | {"IQS_" + name: law for name, law in _ZONES.items() if name != "MP3_CZM_THER"}
# Other law of Cairn and its parameters, if the file has different static and kinetic friction, a different force after tearing,
# or a shifted gap, which the law above cannot represent.
APART = {
    "IQS_DS_CLB": ("UnilateralContact", _DRY),
    "GAP_SGR_DS_CLB": ("UnilateralContact", _DRY),
    "VEL_SGR_DS_CLB": ("UnilateralContact", _DRY),
    "RST_DS_CLB": ("UnilateralContact", _DRY | _RESTITUTION),
    "preGAP_SGR_CLB": ("UnilateralContact", _MU | {"shift": "pgap"}),
    "IQS_WET_DS_CLB": ("AdhesiveContact", _DRY | _ATTRACTION),
    "IQS_SGR_CLB_WEAR": ("AdhesiveContact", _MU | {"force": "scoh", "torn_force": "dcoh", "reach": "Wthk"}),
}
# Further parameters that make the law of Cairn equivalent to that of LMGC90, where a gap above zero keeps a contact open even
# without restitution, and cohesive zones between deformable bodies recover an overlap within a step.
_OPEN, _BACK, _START = {"closing": 0}, {"recovers": 1}, {"from_start": 1}
AS_THERE: dict[str, dict] = {name: _OPEN for name in ("RST_CLB", "VEL_SGR_CLB", "RST_DS_CLB", "VEL_SGR_DS_CLB", "RST_WET_CLB")}
AS_THERE |= {"IQS_STICK": {"mu": np.inf}, "GAP_SGR_STICK": {"mu": np.inf}, "VISCO_ELASTIC_REPELL_CLB": _OPEN}
AS_THERE |= {name: _BACK for name in ("GAP_SGR_CLB_WEAR", "GAP_WET_DS_CLB", "GAP_SGR_CLB_nosldt")}
AS_THERE |= {"IQS_CLB_g0": _START, "GAP_SGR_CLB_g0": _START | _BACK, "ELASTIC_REPELL_CLB_g0": _START}
AS_THERE |= {"xQS_WET_DS_CLB": {"once": 1}}
AS_THERE |= {"NORMAL_COUPLED_DOF": {"tangential": 0}, "TANGENTIAL_COUPLED_DOF": {"normal": 0}}
AS_THERE |= {name: {"recovery": 1} for name in _ZONES}
AS_THERE |= {"VISCO_ELASTIC_REPELL_WET": _OPEN | {"touching": 0}, "BROKEN_DOF": {"breaks": 1}}
AS_THERE |= {"postGAP_IQS_MAC_CZM": {"loss": 2e-3}}
APART_THERE = {"GAP_SGR_DS_CLB": _BACK, "preGAP_SGR_CLB": _BACK, "VEL_SGR_DS_CLB": _OPEN, "RST_DS_CLB": _OPEN}
# Notes on laws that differ from those of LMGC90.
NOTES = {
    "GAP_MOHR_DS_CLB": "an overlap is not taken back in a step, as it is there",
    "RST_WET_CLB": "within reach of a gap it draws alone; there what it closes to depends on values that are not set",
    "ELASTIC_REPELL_CLB_adapt": "its stiffness stays that of the file, whatever a script does to it",
    "MP3_CZM_THER": "what its faces conduct is a conductance of a network of heat, see scene.thermal",
    "GAP_SGR_CLB_WEAR": "wear of both sides counts in one gap",
    "CRITICAL_VOIGT_CLB": "its tangential spring is that of solid disks or spheres, whatever its bodies are",
    "MD_JKRs": "a law of cairn.SmoothDEM(); mu bounds friction by force and attraction together, there by their difference",
    "PLASTIC_COUPLED_DOF": "its limit is the impulse of a step, another force in another step",
    "BROKEN_DOF": "its limit is the impulse of a step, by which it pushes, as there; it breaks from the step after",
    "postGAP_IQS_MAC_CZM": "its sides lose 2 mm when it breaks, whatever their size, as there",
}
# Remedies for laws without a counterpart in Cairn.
_LIMIT_INSTEAD = "LMGC90 has its name alone; IQS_CLB_nosldt (cairn.LimitedSlip) limits the whole slip"
_CELLS_INSTEAD = "give MAL_CZM with its strength and work, or cells of a material with damage (docs/solids.md)"
REMEDIES = {
    "TOSI_CZM": f"its stress follows from the triaxiality and temperature of the cells beside: {_CELLS_INSTEAD}",
    "TOSI_CZM_INCRE": f"its stress follows from the triaxiality and temperature of the cells beside: {_CELLS_INSTEAD}",
    "GTN_CZM": f"LMGC90 has its name alone; {_CELLS_INSTEAD}",
    "NARD_ROD": "a rod that breaks, of En, nu and two strengths: give cairn.ParallelBond with its stiffnesses and strengths",
    "PERIO_DOF": "give Scene(periodic=cairn.Periodic(...)), and a stress or rate of the cell",
    "IQS_CLB_noslds": _LIMIT_INSTEAD,
    "GAP_SGR_CLB_noslds": _LIMIT_INSTEAD,
    "LJ_POTENTIAL": "LMGC90 has its name alone; IQS_WET_DS_CLB is its form without steepness",
}
HUGE = 1e99  # stands for infinity in the columns of a file


def law_of(law, alert, dim=2):
    """(law of Cairn for a ContactLaw or None, texts on features it cannot represent, notes). alert: distance [m] within which
    bodies are bonded at the first step by laws that join."""
    given, refused = law.parameters, []
    split = _told_apart(given) and law.law in APART
    python, names = APART[law.law] if split else LAWS.get(law.law, (None, None))
    if python is None or python not in laws.LAWS:
        remedy = REMEDIES.get(law.law)
        return None, [f"contact law {law.name} ({law.law})" + (f", instead of which: {remedy}" if remedy else "")], []
    notes = [f"law {law.name} ({law.law}): {NOTES[law.law]}"] if law.law in NOTES else []
    there = APART_THERE if split else AS_THERE
    values = {ours: given[theirs] for ours, theirs in names.items()} | there.get(law.law, {})
    if given.get("dyfr", 0) > given.get("stfr", 0) and "kinetic" in names:
        refused.append(f"friction of law {law.name} that is more where it slides: give dyfr up to stfr")
    if given.get("dcoh", 0) > given.get("scoh", 0):
        refused.append(f"cohesion of law {law.name} that is more after it broke: give dcoh up to scoh")
    if python == "MohrCoulomb":
        if not given["cohn"] > 0:
            refused.append(f"law {law.name} without cohn: give IQS_CLB, or a cohesion along the normal")
        else:
            values["friction"] = given["coht"] / given["cohn"]
        if values.get("cap", 0) >= HUGE:
            values["cap"] = np.inf
    if python == "Wear":
        values["wear"] = given["kcdw"] + given["kanw"]
    if python == "CriticalVoigt":
        values["ratio"] = 1 / 3 if dim == 2 else 2 / 7  # 1/W_TT over 1/W_NN of solid disks, spheres
    if python == "AdhesiveSpring" and given["kn"] > 0:
        values["damping"] = given["damp"] / (2 * np.sqrt(given["kn"]))
    elif python == "AdhesiveSpring":
        refused.append(f"law {law.name} without kn: give a stiffness")
    if "gcmx" in given:
        values["limit"] = np.inf if given["gcmx"] <= -HUGE else max(0.0, -given["gcmx"])
    if python in ("MP", "MP3") and given["cn"] != given["ct"]:
        notes.append(f"law {law.name} ({law.law}): its work is that of every mode, there the mean of two")
    if python in ("CoupledMotion", "BrittleCoating"):
        values["reach"] = alert
    if "within" in laws.LAWS[python].parameter_names and _begins(python, values):
        values["within"] = alert
    if values.get("kinetic") == values.get("mu"):
        values.pop("kinetic", None)
    return laws.LAWS[python](**values), refused, notes


def _told_apart(given):
    pairs = (("dyfr", "stfr"), ("scoh", "dcoh"))
    return given.get("pgap", 0) != 0 or any(given.get(one, 0) != given.get(other, 0) for one, other in pairs)


def _begins(python, values):
    """True for a law that depends on the initial positions of bodies."""
    every = python not in ("UnilateralContact", "ElasticContact", "AdhesiveContact")
    return every or values.get("from_start", 0) == 1 or values.get("once", 0) == 1


def told_by_alert(law):
    """Distance [m] of a law of Cairn that LMGC90 takes from the alert distance of a see table; 0 for other laws."""
    values = dict(zip(law.parameter_names, law.values))
    return values["reach"] if type(law).__name__ in ("CoupledMotion", "BrittleCoating") else values.get("within", 0.0)


def words_of(law):
    """(name of the law in the format, {name of a value: value}) for a law of Cairn, or (None, reason) without counterpart."""
    python, values = type(law).__name__, dict(zip(law.parameter_names, law.values))
    found = _NAMES.get(python)
    if found is None:
        return None, f"law {law!r}"
    name, missed = found(values)
    if missed:
        return None, f"{missed} of law {law!r}"
    names = next(table[name][1] for table in (LAWS, APART) if table.get(name, ("",))[0] == python)
    given = {theirs: values[ours] for ours, theirs in names.items()}
    given |= {"dyfr": min(given["stfr"], values.get("kinetic", np.inf))} if "stfr" in given else {}
    if python == "MohrCoulomb":
        given |= {"cohn": values["cohesion"] / values["friction"]}
        given |= {"scom": min(values["cap"], HUGE)} if "scom" in given else {}
    given |= {"kcdw": values["wear"], "kanw": 0.0} if python == "Wear" else {}
    given |= {"coht": 0.0} if python in ("Wet", "AdhesiveContact") else {}
    given |= {"damp": 2 * values["damping"] * np.sqrt(values["stiffness"])} if python == "AdhesiveSpring" else {}
    given |= {"gcmx": -min(values["limit"], HUGE)} if name == "ELASTIC_REPELL_MAC_CZM" else {}
    ours = {theirs: mine for mine, theirs in names.items()}
    endless = [ours.get(theirs, theirs) for theirs, value in given.items() if not np.isfinite(value)]
    if endless:
        return None, f"{', '.join(endless)} without end of law {law!r}"
    return name, given


def _cone(plain, stick):
    return lambda v: (stick if np.isinf(v["mu"]) else plain, "")


def _zone(name):
    def named(v):
        other = v["recovery"] not in (0, 1) or v["power"] != 1 or v["pressure"] != 0
        return name if v["recovery"] == 1 else "IQS_" + name, "recovery, power and pressure" if other else ""

    return named


def _plastic(v):
    springs = np.isfinite(v["normal_spring"]) or np.isfinite(v["tangential_spring"])
    stays = v["damage_share"] < 1
    return _zone("EXPO_CZM_SPRING_P" if springs and stays else "EXPO_CZM_SPRING" if springs else "EXPO_CZM_P")(v)


def _mac_contact(v):
    sides = (v["force"] > 0, np.isfinite(v["stiffness"]), v["loss"] > 0)
    if sum(sides) != 1:
        return "", "all but one of force, stiffness and loss"
    if v["recovery"] != 0 or v["power"] != 1 or v["pressure"] != 0 or (v["mu"] != 0 and not sides[2]):
        return "", "friction beside force or stiffness, recovery, power and pressure"
    return ("IQS_WET_CZM", "ELASTIC_REPELL_MAC_CZM", "postGAP_IQS_MAC_CZM")[sides.index(True)], ""


def _mohr(v):
    if not v["friction"] > 0:
        return "", "no friction while it is whole"
    if not v["cohesion"] > 0:
        return "", "no cohesion"
    tip = v["cohesion"] / v["friction"]
    whole = np.isinf(v["cap"]) and abs(v["tension"] - tip) <= 1e-7 * tip  # precision of a file
    return "IQS_MOHR_DS_CLB" if whole else "IQS_CAP_MOHR_DS_CLB", ""


def _rod(v):
    if not np.isinf(v["strength"]) or np.isinf(v["stiffness"]) or v["mu"] != 0:
        return "", "strength, infinite stiffness or friction"
    return "VOIGT_ROD" if v["viscosity"] > 0 else "ELASTIC_ROD", ""


def _wire(v):
    rigid, brittle, viscous = np.isinf(v["stiffness"]), np.isfinite(v["strength"]), v["viscosity"] > 0
    if v["mu"] != 0 or (brittle and viscous) or (rigid and (brittle or viscous or v["prestrain"] != 0)):
        return "", "friction, or all of stiffness, viscosity and strength"
    return "RIGID_WIRE" if rigid else "BRITTLE_ELASTIC_WIRE" if brittle else "VOIGT_WIRE" if viscous else "ELASTIC_WIRE", ""


def _unilateral(v):
    rebounds = v["normal"] > 0 or v["tangential"] != 0 or v["closing"] < 1
    dry = v["kinetic"] < v["mu"] or rebounds
    if v["recovers"] not in (0, 1) or v["from_start"] not in (0, 1) or v["closing"] not in (0, 1):
        return "", "shares of recovers, from_start or closing"
    shifted = v["shift"] != 0
    if shifted + v["from_start"] + dry > 1 or (v["recovers"] and rebounds) or (shifted and not v["recovers"]):
        return "", "shift, from_start, restitution and kinetic friction together"
    if rebounds and v["closing"] > 0:
        return "", "closing=1 with a restitution"
    if shifted:
        return "preGAP_SGR_CLB", ""
    if v["from_start"]:
        return "GAP_SGR_CLB_g0" if v["recovers"] else "IQS_CLB_g0", ""
    return "RST_DS_CLB" if rebounds else "GAP_SGR_DS_CLB" if v["recovers"] else "IQS_DS_CLB", ""


def _elastic(v):
    viscous = v["viscosity"] > 0 or v["closing"] < 1
    if v["kinetic"] < v["mu"] or (viscous and (v["from_start"] != 0 or v["closing"] != 0)) or v["from_start"] not in (0, 1):
        return "", "kinetic friction, or viscosity with closing or from_start"
    return "VISCO_ELASTIC_REPELL_CLB" if viscous else "ELASTIC_REPELL_CLB_g0" if v["from_start"] else "ELASTIC_REPELL_CLB", ""


def _adhesive(v):
    dry, torn, elastic = v["kinetic"] < v["mu"], v["torn_force"] < v["force"], np.isfinite(v["stiffness"])
    rebounds = v["normal"] > 0 or v["tangential"] != 0 or v["closing"] < 1
    if v["touching"] == 0 and elastic and v["closing"] == 0:
        more = dry or torn or v["once"] != 0 or v["recovers"] != 0 or v["normal"] != 0 or v["tangential"] != 0
        return ("", "more than a spring and a dashpot") if more else ("VISCO_ELASTIC_REPELL_WET", "")
    if v["touching"] < 1:
        return "", "touching=0 without a stiffness and closing=0"
    sides = (elastic, v["once"] != 0, torn, v["recovers"] != 0, rebounds)
    if sum(sides) > 1 or ((elastic or torn) and dry) or (elastic and v["viscosity"] > 0):
        return "", "stiffness, viscosity, once, torn_force, recovers, restitution and kinetic friction together"
    if rebounds and v["closing"] > 0:
        return "", "closing=1 with a restitution"
    names = ("ELASTIC_REPELL_WET_CLB", "xQS_WET_DS_CLB", "IQS_SGR_CLB_WEAR", "GAP_WET_DS_CLB", "RST_WET_CLB")
    return next((name for name, one in zip(names, sides) if one), "IQS_WET_DS_CLB"), ""


def _coupled(v):
    names = {(1, 1): "COUPLED_DOF", (1, 0): "NORMAL_COUPLED_DOF", (0, 1): "TANGENTIAL_COUPLED_DOF"}
    name = names.get((int(v["normal"] > 0), int(v["tangential"] > 0)), "")
    if name == "COUPLED_DOF" and (np.isfinite(v["impulse"]) or v["breaks"] > 0):
        return "BROKEN_DOF" if v["breaks"] > 0 else "PLASTIC_COUPLED_DOF", ""
    if name and np.isfinite(v["impulse"]):
        return "", "a limit of what is coupled in part"
    return name, "" if name else "nothing that is coupled"


_NAMES = {
    "UnilateralContact": _unilateral,
    "ElasticContact": _elastic,
    "AdhesiveContact": _adhesive,
    "CoupledMotion": _coupled,
    "GapRescue": lambda v: ("IQS_CLB_RGR", ""),
    "LimitedSlip": lambda v: ("GAP_SGR_CLB_nosldt" if v["recovers"] else "IQS_CLB_nosldt", ""),
    "BrittleCoating": lambda v: ("BRITTLE_COATING_CLB", ""),
    "Coulomb": _cone("IQS_CLB", "IQS_STICK"),
    "GapCoulomb": _cone("GAP_SGR_CLB", "GAP_SGR_STICK"),
    "Restitution": lambda v: ("RST_CLB", ""),
    "MohrCoulomb": _mohr,
    "Wet": lambda v: ("IQS_WET_DS_CLB", ""),
    "Rod": _rod,
    "Wire": _wire,
    "Wear": lambda v: ("GAP_SGR_CLB_WEAR", "" if v["recovers"] == 1 else "an overlap that stays"),
    **{law: _zone(name) for name, (law, _) in _ZONES.items() if name != "MP3_CZM_THER"},
    "PlasticEXPO": _plastic,
    "MACContact": _mac_contact,
    "CriticalVoigt": lambda v: ("CRITICAL_VOIGT_CLB", ""),
    "AdhesiveSpring": lambda v: ("MD_JKRs", ""),
}
