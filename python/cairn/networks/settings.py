"""Settings of the networks of a scene."""

from __future__ import annotations

import warnings

import numpy as np

from ..base import checks
from ..names import one_of
from .conductances import CONDUCTANCES, Conductance, OxideFilm
from .graphs import METHODS


class NetworkWarning(UserWarning):
    """A network was not solved, or has sources without a path for their flow."""


def _kernels(conductance):
    kernels = list(conductance) if isinstance(conductance, (list, tuple)) else [conductance]
    for kernel in kernels:
        if not isinstance(kernel, Conductance):
            raise ValueError(f"conductance is {kernel!r}: give cairn.networks.Holm() and the like, or a list of them")
    return kernels


def _pairs(name, given):
    """[(bodies, value)] from {group or material: value}, or from pairs of a word or ids (n,) and a value."""
    if given is None:
        return []
    if not isinstance(given, (dict, list, tuple)):
        raise ValueError(f"{name} is {given!r}: give {{group: value}}, such as {{'*': {given!r}}} for all bodies")
    items = list(given.items()) if isinstance(given, dict) else [tuple(item) for item in given]
    for item in items:
        if len(item) < 2 or not (isinstance(item[0], str) or np.ndim(item[0]) == 1):
            raise ValueError(f"{name} holds {item!r}: give {{group: value}}, or pairs of a group or ids (n,) and a value")
    return items


def _outside(name, given):
    items = _pairs(name, [] if given is None else given)
    for item in items:
        if len(item) != 4:
            raise ValueError(f"{name} holds {item!r}: give (bodies, coefficient, area, temperature outside)")
    return items


def _wires(wires):
    rows = [] if wires is None else [tuple(w) for w in wires]
    for row in rows:
        if len(row) != 3:
            raise ValueError(f"wires holds {row!r}: give (body, body, conductance)")
        if any(not isinstance(end, (int, float, np.number)) or end != np.floor(end) for end in row[:2]):  # a file has floats
            raise ValueError(f"wires holds {row!r}: give the numbers of two bodies, as Scene.add returned, and a conductance")
        if not checks.number("conductance of a wire", row[2], finite=False) >= 0:
            raise ValueError(f"conductance of a wire is {row[2]}: give a value >= 0")
    return rows


# temperatures below which degrees Celsius are probably meant, and above which kelvins are [K]
COLD, WARM = 100.0, 250.0


def _warn_of_celsius(given, radiates):
    """Warns of temperatures that are probably in degrees Celsius: of bodies that radiate, or beside others in kelvins."""
    values = [float(value) for value in given if isinstance(value, (int, float, np.number)) and value > 0]
    cold = [value for value in values if value < COLD]
    if cold and (radiates or max(values) > WARM):
        text = f"a temperature is {cold[0]:g} K" + ("" if radiates else f", and another {max(values):g} K")
        warnings.warn(f"{text}: give kelvins, {cold[0] + 273.15:g} for {cold[0]:g} degrees Celsius", NetworkWarning, stacklevel=6)


class Electrical:
    """Settings of an electrical network, the arguments of Scene.electrical.

    conductance: of contacts, a kernel or a list of kernels in parallel. film: an OxideFilm, or None. current: {group: value [A]},
    inflow, a number or a function of time; the bodies of a group form an electrode. potential: {group: value [V]}, held. wires:
    (body, body, conductance [S]). A group may be a material, "*" or, in a list of pairs, ids (n,). method, tol: as in
    cairn.networks.solve. switched: share of the contacts whose film may still be due to break down when the iterations of a step
    end.
    """

    def __init__(self, *, conductance=None, film=None, current=None, potential=None, wires=None, method="auto", tol=1e-12,
                 switched=0.0):  # fmt: skip
        self.given = {name: value for name, value in locals().items() if name != "self"}  # for files
        self.kernels = _kernels(CONDUCTANCES["Holm"]() if conductance is None else conductance)
        if film is not None and not isinstance(film, OxideFilm):
            raise ValueError(f"film is {film!r}: give cairn.networks.OxideFilm(...)")
        self.film, self.wires = film, _wires(wires)
        self.flow, self.held = _pairs("current", current), _pairs("potential", potential)
        self.method, self.tol = one_of("method", method, METHODS), checks.positive("tol", tol)
        self.switched = checks.number("switched", switched)
        self.theta, self.steady, self.friction, self.joule = 1.0, True, "none", "none"
        self.convection, self.radiation, self.reference = [], [], 0.0
        self.gradient, self.coupling = [], np.inf


class Thermal:
    """Settings of a thermal network, the arguments of Scene.thermal.

    conductance: of contacts, a kernel or a list of kernels in parallel. initial: temperature [K], or {group: temperature}.
    temperature: {group: value [K]}, held, a number or a function of time. power: {group: value [W]}, into each body. convection:
    (group, h [W/(m2 K)], area [m2] or None for the surface of a ball, ambient temperature [K]). radiation: (group, emissivity,
    area, ambient temperature). A group may be a material, "*" or, in a list of pairs, ids (n,). friction, joule: how the heat of
    sliding and of currents is divided between the sides of a contact, "halves", "effusivity" or "none". wires: (body, body,
    conductance [W/K]).
    steady: True: no heat is stored. theta: of the step, from 1/2 (second order) to 1. Bodies with infinite mass, such as walls,
    keep their temperature unless `steady`.
    lumped: True: lumped capacity of deformable bodies, which avoids temperature oscillations; False: consistent capacity;
    "one point": for triangles, integrated in their middle, as in LMGC90.
    reference: temperature without thermal stress [K], for materials with an expansion. Rigid bodies have their given size when
    they are added, and scale by 1 + expansion (T - reference).
    gradient: {group: (dim,) [K/m]}, temperature gradient within rigid polygons or polyhedra in the axes of the body, values or a
    function of time: they bend as free bodies, by the displacement a ((T - T0) x + (g.x) x - g x.x/2) about their centre of mass.
    coupling: "staggered": mechanics uses the temperatures at the beginning of a step; or a number: share of the thermal load that
    mechanics may miss in this way, above which the step is iterated with the temperatures at its end.
    """

    def __init__(self, *, conductance=None, initial=293.15, temperature=None, power=None, convection=None, radiation=None,
                 friction="halves", joule="halves", wires=None, steady=False, theta=1.0, lumped=True, reference=293.15,
                 gradient=None, coupling="staggered", method="auto", tol=1e-12):  # fmt: skip
        self.given = {name: value for name, value in locals().items() if name != "self"}  # for files
        self.kernels = _kernels(CONDUCTANCES["Holm"]() if conductance is None else conductance)
        self.gradient = _pairs("gradient", gradient)
        self.coupling = np.inf if isinstance(coupling, str) else checks.positive("coupling", coupling)
        if isinstance(coupling, str):
            one_of("coupling", coupling, ("staggered",))
        self.initial = initial if isinstance(initial, (dict, list, tuple)) else {"*": checks.number("initial", initial)}
        self.initial = _pairs("initial", self.initial)
        self.held, self.flow = _pairs("temperature", temperature), _pairs("power", power)
        self.convection, self.radiation = _outside("convection", convection), _outside("radiation", radiation)
        outside = [of[3] for of in self.convection + self.radiation]
        _warn_of_celsius([of[1] for of in self.initial + self.held] + outside, bool(self.radiation))
        shares = ("none", "halves", "effusivity")
        self.friction, self.joule = one_of("friction", friction, shares), one_of("joule", joule, shares)
        self.wires, self.steady = _wires(wires), checks.flag("steady", steady)
        self.theta = checks.number("theta", theta)
        if not 0.5 <= self.theta <= 1:
            raise ValueError(f"theta is {theta}: give a value from 1/2 to 1")
        self.method, self.tol = one_of("method", method, METHODS), checks.positive("tol", tol)
        self.film, self.switched = None, 0.0
        self.lumped = lumped if isinstance(lumped, str) else checks.flag("lumped", lumped)
        if isinstance(lumped, str):
            one_of("lumped", lumped, ("one point",))
        self.reference = checks.number("reference", reference)
