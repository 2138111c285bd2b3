"""Materials of meshed bodies (MAILx): conversion of a model of MODELS.DAT and a material of BULK_BEHAV.DAT."""

from __future__ import annotations

from .networks import values_of
from .remedies import MODELS, after
from .text import LegacyError

# {(kine_ and mater of the model, law of the material): class of Cairn, None for ElasticBody}. LMGC90's elas_ with large
# kinematics is Hooke's law on Green's strain; for ELAS_PLAS it uses the elastic constants alone.
KINDS = {
    ("small", "elas_", "ELAS"): None,
    ("small", "elas_", "ELAS_PLAS"): None,
    ("large", "elas_", "ELAS"): "SaintVenantKirchhoff",
    ("large", "elas_", "ELAS_PLAS"): "SaintVenantKirchhoff",
    ("large", "neoh_", "ELAS"): "NeoHookean",
    ("small", "kvisc", "VISCO_ELAS"): "KelvinVoigt",
    ("small", "J2iso", "ELAS_PLAS"): "J2Plasticity",
    ("small", "J2mix", "ELAS_PLAS"): "J2Plasticity",
    ("large", "J2iso", "ELAS_PLAS"): "FiniteJ2",
    **{("small", model, law): None for model in ("elas_", "elasd") for law in ("ELAS_DILA", "THERMO_ELAS")},
}


def asked(options, material):
    """Key of KINDS: (kine_, mater, law). Without a library of materials (isext no___) LMGC90 uses plasticity for ELAS_PLAS at
    large strains, and ignores mater."""
    kinematics, law = options.get("kine_", "small"), "ELAS" if material.law == "PORO_ELAS" else material.law
    if kinematics == "large" and options.get("isext") == "no___" and law == "ELAS_PLAS":
        return kinematics, "J2iso", law
    return kinematics, options.get("mater", "elas_"), law


def why_not(model, options, material):
    """Text on a material that Cairn cannot map; empty if it can."""
    words = *asked(options, material)[:2], options.get("aniso", "iso__")
    if asked(options, material) in KINDS and words[2] == "iso__":
        return ""
    text = f"model {model} ({', '.join(words)}) of material {material.name} ({material.law})"
    return after(text, (MODELS, material.law), (MODELS, words[2]), (MODELS, words[1]))


def swelling_note(options, material):
    """Text on a material that swells with a temperature, which a script gives and no DATBOX holds; empty for others."""
    if options.get("mater") != "elasd":
        return ""
    found = {label.lower(): value for label, value in values_of(material).items()}
    share, reference = found.get("dila"), next((found[k] for k in ("tref", "trefm") if k in found), None)
    at = "" if reference is None else f" of {reference:g}"
    return (
        (
            f"material {material.name} (elasd) is elastic at its reference temperature{at}: temperatures come from a script; "
            f"for others give its cn.Material expansion={share:g} and the scene a thermal network"
        )
        if share is not None
        else (f"material {material.name} (elasd) is elastic at its reference temperature{at}: its Dila= is a field of a script")
    )


def solid_material(box, options, material):
    """Material of solids; None for a linear elastic body, whose constants `elastic` returns."""
    if material.name in box.replaced:
        return box.replaced[material.name]
    kind = KINDS[asked(options, material)]
    if kind is None:
        return None
    from ..model import bulk

    path = box.folder / "BULK_BEHAV.DAT"
    young, poisson = elastic(box, material)
    values = {"young": young, "poisson": poisson}
    if kind == "KelvinVoigt":
        first = _section(material, "visc")
        _word(path, material, "visc", "KelvinVoigt")
        found = _values(material, first)
        values |= {"viscous_young": _one(path, material, found, "EYng"), "viscous_poisson": _one(path, material, found, "EPss")}
    if kind in ("J2Plasticity", "FiniteJ2"):
        _word(path, material, "crit", "Von-Mises")
        _word(path, material, "visc", "none")
        values |= _hardening(path, material)
        if asked(options, material)[1] == "J2mix" and _of_word(material, "cinh") == "linear":
            values["kinematic"] = _back_stress(path, material)
        else:
            _word(path, material, "cinh", "none")
    try:
        return bulk.BULK_MATERIALS[kind](**values)
    except ValueError as error:
        raise LegacyError(f"{path}, line {material.line}: material {material.name}: {error}") from error


def _hardening(path, material):
    """Parameters of isotropic hardening: linear, or by Swift's law, sigma_y = C0 (EPS0 + p)^n."""
    found = _values(material, _section(material, "crit"), _section(material, "cinh"))
    word = _of_word(material, "isoh")
    if word == "Swift":
        size, strain, power = (_one(path, material, found, label) for label in ("C0__", "EPS0", "n___"))
        if not strain > 0:
            what = f"material {material.name} has EPS0={strain:g}: it would yield under no stress"
            raise LegacyError(f"{path}, line {material.line}: {what}; give a strain above 0")
        return {"yield_stress": size * strain**power, "swift_strain": strain, "swift_power": power}
    if word not in ("none", "linear"):
        what = f"material {material.name} hardens by isoh: {word}, not linear or Swift"
        raise LegacyError(f"{path}, line {material.line}: {what}")
    isotropic = _one(path, material, found, "K___") if word == "linear" else 0.0
    return {"yield_stress": _one(path, material, found, "SIG0"), "isotropic": isotropic}


def _back_stress(path, material):
    """Kinematic modulus K [Pa] of J2mix by Prager's law: back stress 2/3 K times plastic strain (J2PlasticityMixed of MatLib)."""
    modulus = _one(path, material, _values(material, _section(material, "cinh"), _section(material, "visc")), "K___")
    if modulus < 0:
        what = f"material {material.name} has K___={modulus:g} behind cinh: give 0 or more"
        raise LegacyError(f"{path}, line {material.line}: {what}")
    return modulus


def elastic(box, material):
    """(Young's modulus [Pa], Poisson's ratio). Raises LegacyError for an elastic part that is not standard and isotropic."""
    path = box.folder / "BULK_BEHAV.DAT"
    rows = [text[40:59].split() for _, text in material.parts[:2]] + [[], []]
    if (rows[0], rows[1]) != (["elas:", "standard"], ["ani_:", "isotropic"]):
        raise LegacyError(f"{path}, line {material.line}: material {material.name} is not elastic, standard and isotropic")
    found = _values(material, 2, 3)
    if material.density is None or len(found) < 2:
        raise LegacyError(f"{path}, line {material.line}: material {material.name} lacks its EYng=, Epss= or Umas=")
    return tuple(found.values())[:2]


def _values(material, first, last=None):
    """{label in small letters: number} of the lines first to last of a material."""
    part = type(material)(material.name, material.law, material.line, material.density, material.parts[first:last])
    return {label.lower(): value for label, value in values_of(part).items()}


def _section(material, word):
    """Index of the line of a material that begins with a word; the number of lines without such a line."""
    rows = (k for k, (_, text) in enumerate(material.parts) if text[40:].split(":")[0].strip() == word)
    return next(rows, len(material.parts))


def _of_word(material, word):
    """Text behind a word in a material: "linear" for "isoh: linear"; empty without."""
    k = _section(material, word)
    return material.parts[k][1][40:].partition(":")[2].strip() if k < len(material.parts) else ""


def _word(path, material, word, wanted):
    found = _of_word(material, word)
    if found != wanted:
        has = f"material {material.name} has {word}: {found or 'nothing'}"
        raise LegacyError(f"{path}, line {material.line}: {has}, not {wanted}")


def _one(path, material, found, label):
    if label.lower() not in found:
        raise LegacyError(f"{path}, line {material.line}: material {material.name} lacks its {label}=")
    return found[label.lower()]
