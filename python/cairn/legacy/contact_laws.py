"""Contact laws of TACT_BEHAV.DAT: what stands in their lines, which law of Cairn each is, what the others ask for instead."""

from __future__ import annotations

import numpy as np

from ..build import laws

# Values of a law, row by row of the file: names of ours for what stands in columns 46-59, 67-80.
_FRICTION = ("fric",)
_TWO = ("dyfr", "stfr")
_COHESION, _STRAIN = ("cohn", "coht"), ("Fstr", "prst")
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
}.items():
    LAW_VALUES |= {_name: _rows, "IQS_" + _name: _rows}
LAW_VALUES["MP3_CZM_THER"] = (*LAW_VALUES["MP3_CZM"], ("lbds", "lbdc"))

# Law of LMGC90: law of Cairn, and its parameters from those of the file.
_MU, _STATIC = {"mu": "fric"}, {"mu": "stfr"}
_RESTITUTION = {"normal": "rstn", "tangential": "rstt"}
_ROD = {"stiffness": "Fstr", "prestrain": "prst"}
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
    "IQS_MOHR_DS_CLB": ("MohrCoulomb", _STATIC | {"tension": "cohn", "cohesion": "coht"}),
    "GAP_MOHR_DS_CLB": ("MohrCoulomb", _STATIC | {"tension": "cohn", "cohesion": "coht"}),
    "IQS_CAP_MOHR_DS_CLB": ("MohrCoulomb", _STATIC | {"tension": "sten", "cohesion": "coht", "cap": "scom"}),
    "IQS_WET_DS_CLB": ("Wet", _STATIC | {"force": "cohn", "reach": "Wthk"}),
    "GAP_WET_DS_CLB": ("Wet", _STATIC | {"force": "cohn", "reach": "Wthk"}),
    "IQS_SGR_CLB_WEAR": ("Wet", _MU | {"force": "scoh", "reach": "Wthk"}),
    "ELASTIC_ROD": ("Rod", _ROD),
    "VOIGT_ROD": ("Rod", _ROD | {"viscosity": "F/sr"}),
    "ELASTIC_WIRE": ("Wire", _ROD),
    "VOIGT_WIRE": ("Wire", _ROD | {"viscosity": "F/sr"}),
    "BRITTLE_ELASTIC_WIRE": ("Wire", _ROD | {"strength": "Fmax"}),
    "RIGID_WIRE": ("Wire", {}),
    "GAP_SGR_CLB_WEAR": ("Wear", _MU),
}
_ZONE = {"mu": "stfr", "normal_stiffness": "cn", "tangential_stiffness": "ct"}
_MODES = {"normal_strength": "s1", "tangential_strength": "s2", "normal_work": "G1", "tangential_work": "G2"}
_ZONES = {
    "MAC_CZM": ("MAC", _ZONE | {"viscosity": "b", "work": "w"}),
    "MP_CZM": ("MP", _ZONE | {"work": "w"}),
    "MP3_CZM": ("MP3", _ZONE | {"strength": "smax", "work": "w"}),
    "MAL_CZM": ("MAL", _ZONE | _MODES),
    "TH_CZM": ("TH", _ZONE | _MODES | {"normal_plateau": "dp1", "tangential_plateau": "dp2"}),
    "ABP_CZM": ("ABP", _ZONE | _MODES | {"normal_end": "du1", "tangential_end": "du2", "first_share": "phi"}),
    "EXPO_CZM": ("EXPO", _ZONE | _MODES | {"rest": "eta"}),
}
_ZONES["MP3_CZM_THER"] = _ZONES["MP3_CZM"]
LAWS |= _ZONES | {"IQS_" + name: law for name, law in _ZONES.items() if name != "MP3_CZM_THER"}
# What else the law of Cairn needs to be that of LMGC90: there a gap above zero keeps a contact open, though nothing rebounds;
# zones between deformable bodies take an overlap back in a step.
AS_THERE = {name: {"closing": 0} for name in ("RST_CLB", "VEL_SGR_CLB", "RST_DS_CLB", "VEL_SGR_DS_CLB")}
AS_THERE |= {"IQS_STICK": {"mu": np.inf}, "GAP_SGR_STICK": {"mu": np.inf}, "GAP_SGR_CLB_WEAR": {"recovers": 1}}
AS_THERE |= {name: {"recovery": 1} for name in _ZONES}
# What is told of a law that is read otherwise than it is there.
NOTES = {
    "GAP_MOHR_DS_CLB": "an overlap is not taken back in a step, as it is there",
    "GAP_WET_DS_CLB": "an overlap is not taken back in a step, as it is there",
    "MP3_CZM_THER": "what its faces conduct is a conductance of a network of heat, see scene.thermal",
    "GAP_SGR_CLB_WEAR": "wear of both sides counts in one gap",
}
# What to say instead of a law that Cairn has no counterpart of.
_ZONE_INSTEAD = "EXPO_CZM has the same curve without it; or give a law of your own (docs/plugins.md)"
_SPRING_INSTEAD = "give cairn.Rod, or a joint with cairn.Spring; springs at contacts are cairn.SmoothDEM's (LinearSpring)"
_LIMIT_INSTEAD = "give IQS_CLB, or a Slider with limits for a way that ends"
_DOF_INSTEAD = "join the bodies by scene.join: Pivot or Ball holds a point, Slider a way along an axis, Fixed all"
REMEDIES = {
    "IQS_CLB_g0": "IQS_CLB counts gaps from where bodies touch: move apart what overlaps at the start",
    "GAP_SGR_CLB_g0": "GAP_SGR_CLB counts gaps from where bodies touch: move apart what overlaps at the start",
    "IQS_CLB_RGR": "GAP_SGR_CLB takes overlaps back in a step, sim.project_positions without making energy",
    "ELASTIC_REPELL_CLB": _SPRING_INSTEAD,
    "ELASTIC_REPELL_CLB_g0": _SPRING_INSTEAD,
    "ELASTIC_REPELL_CLB_adapt": _SPRING_INSTEAD,
    "VISCO_ELASTIC_REPELL_CLB": _SPRING_INSTEAD,
    "CRITICAL_VOIGT_CLB": _SPRING_INSTEAD,
    "ELASTIC_REPELL_WET_CLB": "IQS_WET_DS_CLB has the same attraction on bodies that do not yield",
    "VISCO_ELASTIC_REPELL_WET": "IQS_WET_DS_CLB has the same attraction on bodies that do not yield",
    "RST_WET_CLB": "IQS_WET_DS_CLB has the same attraction without a bounce",
    "xQS_WET_DS_CLB": "IQS_WET_DS_CLB draws again what comes back; cairn.MohrCoulomb joins what touches at the start alone",
    "IQS_WET_CZM": "IQS_MAC_CZM is its zone, IQS_WET_DS_CLB what is left of it",
    "ELASTIC_REPELL_MAC_CZM": "MAC_CZM has the same zone on sides that do not yield",
    "postGAP_IQS_MAC_CZM": "IQS_MAC_CZM is the same zone with the gap of the step's begin",
    "EXPO_CZM_P": _ZONE_INSTEAD,
    "EXPO_CZM_SPRING": _ZONE_INSTEAD,
    "EXPO_CZM_SPRING_P": _ZONE_INSTEAD,
    "TOSI_CZM": "give MAL_CZM with its strength and work, or cells of a material with damage (docs/solids.md)",
    "GTN_CZM": "give MAL_CZM with its strength and work, or cells of a material with damage (docs/solids.md)",
    "COUPLED_DOF": _DOF_INSTEAD,
    "NORMAL_COUPLED_DOF": _DOF_INSTEAD,
    "TANGENTIAL_COUPLED_DOF": _DOF_INSTEAD,
    "PLASTIC_COUPLED_DOF": _DOF_INSTEAD,
    "BROKEN_DOF": "join the bodies by scene.join with strength=",
    "PERIO_DOF": "give Scene(periodic=cairn.Periodic(...)), and a stress or rate of the cell",
    "IQS_CLB_nosldt": _LIMIT_INSTEAD,
    "IQS_CLB_noslds": _LIMIT_INSTEAD,
    "GAP_SGR_CLB_nosldt": _LIMIT_INSTEAD,
    "GAP_SGR_CLB_noslds": _LIMIT_INSTEAD,
    "BRITTLE_COATING_CLB": "IQS_MAC_CZM is a coating that is damaged, IQS_MOHR_DS_CLB one that breaks",
    "MD_JKRs": "give cairn.SmoothDEM() and cairn.JKR(...)",
    "LJ_POTENTIAL": "IQS_WET_DS_CLB is its form without steepness",
}
for _name in ("EXPO_CZM_P", "EXPO_CZM_SPRING", "EXPO_CZM_SPRING_P"):
    REMEDIES["IQS_" + _name] = REMEDIES[_name]
REMEDIES["TOSI_CZM_INCRE"] = REMEDIES["TOSI_CZM"]
HUGE = 1e99  # a value without limit, in columns that hold no more


def law_of(law, alert):
    """The law of Cairn that a ContactLaw is, and what cannot be told by it, in words: (law, refused, notes). Bodies that see each
    other at the first step, within the alert distance [m], are joined."""
    python, names = LAWS.get(law.law, (None, None))
    if python is None or python not in laws.LAWS:
        remedy = REMEDIES.get(law.law)
        return None, [f"contact law {law.name} ({law.law})" + (f", instead of which: {remedy}" if remedy else "")], []
    given, refused = law.parameters, []
    notes = [f"law {law.name} ({law.law}): {NOTES[law.law]}"] if law.law in NOTES else []
    values = {ours: given[theirs] for ours, theirs in names.items()} | AS_THERE.get(law.law, {})
    if given.get("dyfr", 0) != given.get("stfr", 0):
        refused.append(f"friction of law {law.name} that slides and sticks apart")
    if given.get("scoh", 0) != given.get("dcoh", 0):
        refused.append(f"cohesion of law {law.name} that is another after it broke: give both the same, or IQS_WET_DS_CLB")
    if given.get("pgap", 0) != 0:
        refused.append(f"pgap of law {law.name}: give GAP_SGR_CLB, and radii or sides that are larger by half of it")
    if python == "MohrCoulomb":
        if not given["cohn"] > 0:
            refused.append(f"law {law.name} without cohn: give IQS_CLB, or a cohesion along the normal")
        else:
            values["friction"] = given["coht"] / given["cohn"]
        if values.get("cap", 0) >= HUGE:
            values["cap"] = np.inf
    if python == "Wear":
        values["wear"] = given["kcdw"] + given["kanw"]
    if python in ("MP", "MP3") and given["cn"] != given["ct"]:
        notes.append(f"law {law.name} ({law.law}): its work is that of every mode, there the mean of two")
    if "within" in laws.LAWS[python].parameter_names:
        values["within"] = alert
    return laws.LAWS[python](**values), refused, notes


def words_of(law):
    """What the format calls a law of Cairn: (name, {name of a value: value}), or (None, why it has no word for it)."""
    python, values = type(law).__name__, dict(zip(law.parameter_names, law.values))
    found = _NAMES.get(python)
    if found is None:
        return None, f"law {law!r}"
    name, missed = found(values)
    if missed:
        return None, f"{missed} of law {law!r}"
    names = LAWS[name][1]
    given = {theirs: values[ours] for ours, theirs in names.items()}
    given |= {"dyfr": given["stfr"]} if "stfr" in given else {}
    if python == "MohrCoulomb":
        given |= {"cohn": values["cohesion"] / values["friction"]}
        given |= {"scom": min(values["cap"], HUGE)} if "scom" in given else {}
    given |= {"Wear": {"kcdw": values.get("wear"), "kanw": 0.0}, "Wet": {"coht": 0.0}}.get(python, {})
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


def _mohr(v):
    if not v["friction"] > 0:
        return "", "no friction while it is whole"
    if not v["cohesion"] > 0:
        return "", "no cohesion"
    tip = v["cohesion"] / v["friction"]
    whole = np.isinf(v["cap"]) and abs(v["tension"] - tip) <= 1e-7 * tip  # to the digits of a file
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


_NAMES = {
    "Coulomb": _cone("IQS_CLB", "IQS_STICK"),
    "GapCoulomb": _cone("GAP_SGR_CLB", "GAP_SGR_STICK"),
    "Restitution": lambda v: ("RST_CLB", ""),
    "MohrCoulomb": _mohr,
    "Wet": lambda v: ("IQS_WET_DS_CLB", ""),
    "Rod": _rod,
    "Wire": _wire,
    "Wear": lambda v: ("GAP_SGR_CLB_WEAR", "" if v["recovers"] == 1 else "an overlap that stays"),
    **{law: _zone(name) for name, (law, _) in _ZONES.items() if name != "MP3_CZM_THER"},
}
