"""Conductances of contacts by their formulas, with numbers and loops, and by their kernels, for random contacts."""

import math

import numpy as np
from kernels import kernel, rows

RNG = np.random.default_rng(23)
N = 9
COLUMNS = ["gap", "force", "radius", "modulus", "conductivity_a", "conductivity_b", "hardness", "area", "intact", "depth"]


def contacts():
    """Random ones; the first does not push, the second has a conductivity of nought, the third one without end."""
    c = {name: RNG.uniform(0.5, 2.0, N) for name in COLUMNS}
    c["intact"] = RNG.uniform(0, 1, N)
    c["gap"] = RNG.uniform(-0.1, 0.4, N)
    c["force"][0] = -1.0
    c["conductivity_a"][1] = 0.0
    c["conductivity_b"][2] = math.inf
    return c


def spot(c):
    """Hertz: a^3 = 3 F R / (4 E*)."""
    return math.cbrt(3 * max(c["force"], 0.0) * c["radius"] / (4 * c["modulus"]))


def mean(c):
    """Conductivity of two halves in series: of their resistances."""
    one, other = c["conductivity_a"], c["conductivity_b"]
    return 0.0 if one == 0 or other == 0 else 2 / (1 / one + 1 / other)


def share(c, given):
    return given if given > 0 else c["area"]


def wexler(c, length):
    """Sharvin's resistance, and Holm's by the rational factor of Nikolic and Allen (1999)."""
    if spot(c) == 0 or mean(c) == 0:
        return 0.0
    knudsen = length / spot(c)
    factor = (1 + 9 * math.pi**2 / 128 * (4 / 3) * knudsen) / (1 + (4 / 3) * knudsen)
    return 1 / (4 * length / (3 * math.pi * mean(c) * spot(c) ** 2) + factor / (2 * mean(c) * spot(c)))


def strip(c):
    """Two cylinders: half width b of Hertz's contact of lines, from each side ln(4 R / b) / (pi k L)."""
    if c["force"] <= 0:
        return 0.0
    b = math.sqrt(4 * c["force"] / c["depth"] * c["radius"] / (math.pi * c["modulus"]))
    return math.pi * c["depth"] * mean(c) / (2 * math.log(4 * c["radius"] / b))


def rough(c, slope, roughness, hardness, area):
    if c["force"] <= 0:
        return 0.0
    a = share(c, area)
    return 1.25 * mean(c) * slope / roughness * (c["force"] / a / (hardness or c["hardness"])) ** 0.95 * a


def plastic(c, hardness):
    return 2 * mean(c) * math.sqrt(max(c["force"], 0) / (math.pi * (hardness or c["hardness"])))


FORMULAS = {
    "constant_conductance": ([3.0], lambda c, g: g if c["force"] > 0 else 0.0),
    "holm": ([], lambda c: 2 * mean(c) * spot(c)),
    "plastic_spot": ([0.0], plastic),
    "sharvin": ([0.2], lambda c, length: 3 * math.pi * mean(c) * spot(c) ** 2 / (4 * length)),
    "wexler": ([0.3], wexler),
    "hertz_strip": ([], strip),
    "yovanovich": ([0.2, 1e-2, 0.0, 0.0], rough),
    "gas_gap": ([0.7, 0.05, 0.0], lambda c, k, jump, area: k * share(c, area) / (max(c["gap"], 0) + jump)),
    "damage_bond": (
        [2.0, 0.5, 1.5],
        lambda c, whole, broken, area: area * (c["intact"] * whole + (1 - c["intact"]) * (broken if c["force"] > 0 else 0)),
    ),
    "legacy_allno": ([], lambda c: mean(c) if c["force"] > 0 else 0.0),
    "legacy_hertz": ([], lambda c: math.cbrt(max(c["force"], 0))),
    "legacy_holm_h": ([], lambda c: 2 * mean(c) * spot(c)),
    "legacy_holm_p": ([], lambda c: 2 * mean(c) * math.sqrt(max(c["force"], 0) / (math.pi * c["modulus"]))),
    "legacy_tkaya": ([], lambda c: 3 * math.pi / 4 * mean(c) * spot(c) ** 4 / c["radius"] ** 3),
    "legacy_discrete": ([], lambda c: 2 * mean(c) * spot(c)),
}


ROWS = [row[0] for row in rows("networks/networks.def", "CAIRN_CONDUCTANCE")]


def found(name, c, params):
    out = np.empty(N)
    given = np.array([*params, 0.0])
    table = np.ascontiguousarray([c[column] for column in COLUMNS])
    kernel(f"cairn_conductance_{name}", "cairn_conductance")(N, table, len(params), given, out)
    return out
