"""Warnings of stiffnesses and strengths far below the weight of bodies, as typed in MPa or GPa, and of gravity that points away
from all walls, when a simulation is made."""

from __future__ import annotations

import warnings

import numpy as np

from ..base import checks
from ..model.extents import Placed
from ..model.law_parameters import told as meaning
from .first_overlaps import Normals
from .typed_units import free_bodies, texts, young_of
from .views import core_of

# shortening of a body under its own weight: of small displacements, of large ones
SHORTENED, SHORTENED_LARGE = 0.5, 2.0
# overlap of a body at rest on a plane under its own weight, over its radius
SUNK = 0.5
# strength over the weight of the lightest body on its section
STRENGTH = 0.01
# change of a size in a step
FASTEST = 0.1


class UnitsWarning(UserWarning):
    """The weight of bodies exceeds by far what their stiffness or strength can bear, as if given in MPa or GPa instead of Pa;
    gravity points away from all walls; bodies or a cell grow by more than a tenth in a step; or densities, angles, steps or
    lengths are probably those of other units than SI."""


def warn(simulation, above):
    """Warns of values that do not suit the weights of a scene. above: stack level of the warning."""
    scene = simulation.scene
    given = scene.gravity(simulation.time) if callable(scene.gravity) else scene.gravity
    gravity = checks.real_array("gravity", given, (scene.dim,))
    pull, found = float(np.linalg.norm(gravity)), texts(simulation, gravity)
    if pull > 0:
        found += [_meshes(simulation, gravity), _laws(simulation, pull), _walls(simulation, gravity)]
    for text in filter(None, found):
        warnings.warn(text, UnitsWarning, stacklevel=above + 1)


def warn_of_rate(what, rate, dt, above):
    """Warns of a constant rate [1/s] of sizes that is large over a step, as if given in percent. what: its name in the text."""
    if isinstance(rate, (int, float, np.number)) and abs(rate) * dt > FASTEST:
        factor = np.exp(min(rate * dt, 700.0))
        text = f"{what} is {rate:g} /s, by which a size changes by a factor of {factor:.3g} in a step of {dt:g} s"
        text += ": give it per second, 0.05 for 5 % a second, or a smaller dt"
        warnings.warn(text, UnitsWarning, stacklevel=above + 1)


def warn_of_cell(cell, dt, above):
    """Warns of constant rates of a periodic cell that are large over a step. cell: Periodic, or None."""
    rates = {} if cell is None else {f"rate[{name!r}]": rate for name, rate in (cell.rate or {}).items()}
    if cell is not None and cell.shear_rate:
        rates["shear_rate"] = cell.shear_rate
    for name, rate in rates.items():
        warn_of_rate(f"{name} of the cell", rate, dt, above + 1)


def _pascals(value):
    """Two readings of a number of pascals that is too small."""
    return f"give pascals, {value * 1e6:g} for {value:g} MPa" + (f", {value * 1e9:g} for {value:g} GPa" if value < 1e3 else "")


def _meshes(simulation, gravity):
    """Text on the mesh that its own weight shortens most."""
    worst = (1.0, None)
    for number, view in enumerate(simulation.meshes):
        body = view._mesh.d.body
        young, large = young_of(body)
        mass = float(np.sum(body.nodal_mass())) if young else 0.0
        carried = getattr(body, "initial_stress", None) is not None or bool(view._mesh.d.loads)
        if not mass > 0 or carried:
            continue
        along = body.points @ gravity
        size = np.ptp(body.points, axis=0)
        # weight on the middle of a box about the body: rho g H / E
        height = np.ptp(along) / np.linalg.norm(gravity)
        section = np.prod(size) / max(height, np.max(size) * 1e-12)
        thickness = body.given.get("thickness", 1.0) if body.dim == 2 else 1.0
        if body.given.get("plane") == "axisymmetric":
            thickness = 2 * np.pi * float(np.mean(body.points[:, 0]))
        strain = mass * np.linalg.norm(gravity) / (section * thickness * young) if section > 0 else 0.0
        share = strain / (SHORTENED_LARGE if large else SHORTENED)
        if share > worst[0]:
            told = f"young of mesh {number} is {young:g} Pa, and its own weight would shorten it by {strain:.3g} of its height"
            remedy = "give pascals, not MPa or GPa, and metres" if large else \
                "give pascals, not MPa or GPa, and metres; a body as soft as that needs large strains, cn.SolidBody"
            worst = (share, f"{told}: {remedy}")
    return worst[1]


def _laws(simulation, pull):
    """Text on a law whose strengths or stiffness the weight of the lightest bodies exceeds."""
    laws = list(dict.fromkeys(law for *_, law in simulation._rules if law is not None))
    asked = [(law, _strengths(law)) for law in laws]
    if not any(strengths or law.name in SMOOTH for law, strengths in asked):
        return None
    mass, radius = free_bodies(simulation)
    if not len(mass):
        return None
    dim, depth = simulation.scene.dim, float(simulation.scene.depth)
    section = (2 * radius) ** (dim - 1) * (depth if dim == 2 else 1.0)
    least = float(np.min(mass * pull / section))
    for law, strengths in asked:
        own = type(law).__name__
        if strengths and max(strengths.values()) < STRENGTH * least:
            name = max(strengths, key=strengths.get)
            return (f"{name} of {own} is {strengths[name]:g} Pa, and each body weighs {least:.3g} Pa or more on its section: "
                    f"such bonds bear nothing; {_pascals(strengths[name])}")  # fmt: skip
        if law.name in SMOOTH:
            name, overlap = SMOOTH[law.name]
            value = dict(zip(law.parameter_names, law.values))
            with np.errstate(divide="ignore", over="ignore"):
                sunk = float(np.min(overlap(value, mass * pull, radius) / radius))
            if sunk > SUNK:
                remedy = _pascals(value[name]) if name == "young" else f"give newtons per metre, {value[name] * 1e6:g} for kN/mm"
                return f"{name} of {own} is {value[name]:g}, and bodies sink by {sunk:.3g} of their radius under their own " \
                       f"weight: {remedy}"  # fmt: skip
    return None


def _strengths(law):
    """{name: value} of the strengths of a law [Pa] that are above 0 and finite; {} of a law without bonds."""
    if not law.bonds:
        return {}
    values = zip(law.parameter_names, law.values)
    stresses = {
        n: v for n, v in values if (meaning(type(law).__name__, n) or ("",))[0] == "Pa" and n not in ("young", "pressure")
    }
    return {name: value for name, value in stresses.items() if 0 < value < np.inf}


def _hertz(value, force, radius):
    """Overlap on a plane of equal material [m], Hertz (1882)."""
    modulus = value["young"] / (2 * (1 - value["poisson"] ** 2))
    return (9 * force**2 / (16 * modulus**2 * radius)) ** (1 / 3)


SMOOTH = {
    "linear_spring": ("stiffness", lambda value, force, radius: force / value["stiffness"]),
    "hertz_mindlin": ("young", _hertz),
    "jkr": ("young", _hertz),
}


# laws that hold no two bodies together
DRY = (
    "signorini_coulomb", "gap_coulomb", "frictionless", "newton_restitution", "rolling_friction", "wear", "unilateral_contact",
    "elastic_contact", "limited_slip", "linear_spring", "hertz_mindlin",
)  # fmt: skip


def holds_together(simulation):
    """True if a law, bond or joint of the scene may hold two bodies together."""
    return any(law.bonds or law.name not in DRY for *_, law in simulation._rules if law is not None)


def _walls(simulation, gravity):
    """Text on gravity that pulls bodies away from every wall, where nothing else holds them."""
    held = simulation.scene.fluids or simulation.meshes or holds_together(simulation)
    moved = any(s.force is not None or callable(s.imposed) or np.any(s.imposed) for s in simulation._sets)
    given = [np.asarray(s.velocity, float) for s in simulation._sets if s.velocity is not None]
    thrown = any(np.any(velocity[..., : len(gravity)] @ gravity < 0) for velocity in given)
    if held or moved or thrown:
        return None
    placed = Placed(core_of(simulation).scene)
    planes = placed.of_kind("half_plane", "plane")
    if not np.any(planes):
        return None
    normals, walls = Normals(placed), np.unique(placed.owner[planes])
    along = [float(normal @ gravity) for wall in walls for normal in normals.of(wall)[0]]
    if min(along) < 0 or max(along) <= 0.5 * np.linalg.norm(gravity):
        return None
    others = np.setdiff1d(placed.owner, walls)
    if not len(others) or not np.all(normals.free[others]):
        return None
    text = ", ".join(f"{g:g}" for g in gravity)
    return f"gravity ({text}) pulls all bodies away from every wall, along its normal: turn its sign, or the normals"
