"""Rules of a scene: which law acts between two materials, bodies or groups, and which of several rules counts."""

from __future__ import annotations

import numpy as np

from ..base import time_functions
from ..base.materials import Material
from .laws import Law, law_from


def in_order(rules):
    """Orders rules so that those of joints come last and take precedence.

    Parameters
    ----------
    rules : sequence
        (a, b, law) of each rule.

    Returns
    -------
    list
        The rules in this order.
    """
    joints = {a for a, _, law in rules if law is not None and law.name == "joint"}
    return [*(r for r in rules if r[0] not in joints), *(r for r in rules if r[0] in joints)]


def rules_to_dict(rules):
    """Gives rules as a file holds them.

    Parameters
    ----------
    rules : sequence
        (a, b, law) of each rule.

    Returns
    -------
    dict
        Content by the number of the rule.
    """
    out = {
        f"{k:06d}": {"a": a, "b": b, "law": law.name if law else "", "values": np.array(law.values if law else (), float)}
        for k, (a, b, law) in enumerate(rules)
    }
    for k, (_, _, law) in enumerate(rules):
        if law and law.of_temperature:
            out[f"{k:06d}"]["of_temperature"] = {f"{place:02d}": curve.to_dict() for place, curve in law.of_temperature}
    return out


def rules_from_dict(d):
    """Reads rules from a file: the inverse of rules_to_dict.

    Parameters
    ----------
    d : dict
        Content by the number of the rule.

    Returns
    -------
    list
        (a, b, law) of each rule.

    Raises
    ------
    ValueError
        If a name is none or a law is unknown.
    """
    for number, r in d.items():
        wrong = next((name for name in ("a", "b", "law") if not isinstance(r[name], str)), None)
        if wrong is not None:
            raise ValueError(f"{wrong} of rule {number} is {r[wrong]!r}: a name is due")
    rules = []
    for _, r in sorted(d.items()):
        curves = {int(place): time_functions.from_dict(c) for place, c in r.get("of_temperature", {}).items()}
        rules.append((r["a"], r["b"], law_from(r["law"], r["values"], curves) if r["law"] else None))
    return rules


def rule(a, b, law):
    """Checks a law between two sides; see Scene.interact.

    Parameters
    ----------
    a : Material or str
        One side.
    b : Material or str
        The other side.
    law : Law or None
        The law.

    Returns
    -------
    tuple
        Names of both sides and the law.

    Raises
    ------
    ValueError
        If a side is no name or the law is none.
    """
    if law is not None and not isinstance(law, Law):
        if isinstance(law, type) and hasattr(law, "parameter_names"):
            names = law.parameter_names
            given = ", ".join(f"{name}=..." for name in names[:3]) + (", ..." if len(names) > 3 else "")
            raise ValueError(f"law is the class {law.__name__}: give a law such as cairn.{law.__name__}({given})")
        raise ValueError(f"law is {law!r}: give a law such as cairn.Coulomb(mu=0.4), or None for no contact")
    return _word("first side", a), _word("second side", b), law


def _word(what, given):
    word = given.name if isinstance(given, Material) else given
    if not isinstance(word, str) or not word:
        raise ValueError(f"{what} of an interaction is {given!r}: give a Material, the name of one or of a group, or '*'")
    return word


def chosen_rule(first, second, rules):
    """Chooses the rule that takes precedence for two species.

    Parameters
    ----------
    first : tuple
        Material and group of one side.
    second : tuple
        Material and group of the other side.
    rules : sequence
        (a, b, law) of each rule, in order.

    Returns
    -------
    tuple
        True if a rule names both sides, and its law or None.
    """
    best, chosen, ruled = -1, None, False
    for a, b, law in rules:
        weight = max(_weight(a, first, b, second), _weight(b, first, a, second))
        if weight >= best and weight >= 0:
            best, chosen, ruled = weight, law, True
    return ruled, chosen


def _weight(a, first, b, second):
    """Precedence of a rule (a, b) for the species (first, second): higher for groups than for materials, -1 for other names."""
    total = 0
    for word, (material, group) in ((a, first), (b, second)):
        if word == "*":
            continue
        if group and word == group:
            total += 3
        elif word == material:
            total += 1
        else:
            return -1
    return total


def mesh_groups(sets):
    """Gives the groups of the nodes of meshes, which do not touch each other unless a rule of the scene names both.

    Parameters
    ----------
    sets : sequence of BodySet
        Sets, of which those of meshes count.

    Returns
    -------
    set of str
        Names of the meshes.
    """
    return {s.mesh.name for s in sets if s.mesh is not None}
