"""Pairs of materials that can touch and have no law: reported when a simulation is made, not at their first contact."""

from __future__ import annotations

import warnings

import numpy as np

from .. import _core
from .bodies import DOFS
from .rules import mesh_groups

TOLD = 4  # pairs that a warning names


class MissingLawWarning(UserWarning):
    """Bodies of the scene can meet whose materials have no law: their first contact will be an error."""


class _Kind:
    """Summary of the bodies of a material and group: their shapes, if one can move, if there are several."""

    def __init__(self):
        self.shapes, self.moves, self.owner, self.meshes = set(), False, None, set()
        self.several = False

    def add(self, s, number, contactors):
        body = np.asarray(contactors.body)
        if not len(body):
            return
        self.shapes.add(contactors.shape)
        self.several |= self.owner is not None or bool(np.any(body != body[0]))
        self.owner = number
        self.meshes.add(s.mesh and id(s.mesh))
        held = s.mask == 2 ** len(DOFS[s.dim]) - 1
        self.moves |= s.mesh is not None or (not held and bool(np.any(np.isfinite(s.mass))))


def missing_laws(sets, rules, most=TOLD + 1):
    """Pairs of species (material, group) that can touch and that no rule names, at most `most` of them."""
    kinds = {}
    for number, s in enumerate(sets):
        for c in s.contactors:
            kinds.setdefault((c.material.name, s.group or ""), _Kind()).add(s, number, c)
    nodes = mesh_groups(sets)
    partners = {}
    for a, b, _ in rules:
        partners.setdefault(a, set()).add(b)
        partners.setdefault(b, set()).add(a)
    everyone = partners.get("*", set())
    if "*" in everyone:
        return []
    species, known = list(kinds), {frozenset(pair) for pair in _core.pairs()}
    materials = {material for material, _ in species}
    word = {name: k for k, name in enumerate(dict.fromkeys(name for pair in species for name in pair))}
    of_material, of_group = (np.array([word[pair[side]] for pair in species], int) for side in (0, 1))
    moves = np.array([kinds[pair].moves for pair in species], bool)
    node = np.array([group in nodes for _, group in species], bool)
    found = []
    for i, first in enumerate(species):
        ruled = everyone.union(*(partners.get(name, ()) for name in first if name))
        if "*" in ruled or materials <= ruled:
            continue
        named = np.zeros(len(word), bool)
        named[[word[name] for name in ruled if name in word]] = True
        open_ = ~(named[of_material[: i + 1]] | named[of_group[: i + 1]]) & (moves[: i + 1] | moves[i])
        open_ &= ~(node[: i + 1] & node[i])  # nodes of meshes do not touch each other unless a rule names both groups
        for j in np.flatnonzero(open_):
            a, b = kinds[first], kinds[species[j]]
            meet = any(frozenset((x, y)) in known for x in a.shapes for y in b.shapes)
            one = len(a.meshes | b.meshes) == 1 and None not in a.meshes  # a mesh does not touch itself
            if meet and not one and (i != j or a.several):
                found.append((first, species[j]))
                if len(found) == most:
                    return found
    return found


def warn(sets, rules, told, stacklevel):
    """Warns of pairs without a law that are not in `told`, and adds them to it."""
    found = [pair for pair in missing_laws(sets, rules, TOLD + 1 + len(told)) if pair not in told]
    if not found:
        return
    told.update(found)
    names = [" and ".join(repr(f"{m} ({g})" if g else m) for m, g in pair) for pair in found[:TOLD]]
    more = "; and others" if len(found) > TOLD else ""
    a, b = (repr(group or material) for material, group in found[0])
    warnings.warn(
        f"no law is declared between {'; between '.join(names)}{more}: the first contact of such bodies is an error. Give "
        f"scene.interact({a}, {b}, cn.Coulomb(mu=...)), or None for the law where they pass through each other",
        MissingLawWarning,
        stacklevel=stacklevel + 1,
    )
