"""Networks of a simulation: passes their settings to the core once, and the values of sources before each step."""

from __future__ import annotations

import warnings

import numpy as np

from ..base import checks, time_functions
from ..base.materials import OfTemperature
from ..options.strategies import SmoothDEM
from . import meshes
from .settings import NetworkWarning

ASKED = {  # {property read by kernels: field of a material}
    "electrical": {"conductivity": "resistivity", "modulus": "young"},
    "thermal": {"conductivity": "conductivity", "modulus": "young"},
}


NUMBERS = ("latent", "melts", "molten", "density", "young", "poisson", "hardness", "expansion")


class Running:
    """The networks of a simulation, as its scene sets them."""

    def __init__(self, simulation, core):
        before = getattr(simulation, "_networks", None)
        self._simulation, self._core = simulation, core
        self._sources, self._told = {}, set()
        self._added = list(before._added) if before else []
        for kind, settings in simulation.scene.networks.items():
            self._start(kind, settings)

    def add(self, what, ids, function):
        """Adds heat sources beside those of the scene.

        Parameters
        ----------
        what : str
            "held": temperatures [K]; "flow": powers [W].
        ids : ndarray (n,) of int
            Bodies or nodes of meshes.
        function : callable
            Function of time that gives the values, (n,).
        """
        self._added.append((what, ids, function))
        self._start("thermal", self._simulation.scene.networks["thermal"])

    # ------------------------------------------------------------------ settings passed to the core once

    def _start(self, kind, settings):
        core, scene = self._core, self._simulation.scene
        self._check_depth(kind, settings)
        first = not self._has_field(kind)
        materials = [self._material(kind, settings, name) for name, _ in self._simulation._species]
        sources, kept = [], []
        added = {what: [of[1:] for of in self._added if kind == "thermal" and of[0] == what] for what in ("held", "flow")}
        for what, items in (("held", settings.held + added["held"]), ("flow", settings.flow + added["flow"])):
            for bodies, value, *_ in items:
                ids = self.bodies(f"{kind} {what}", bodies)
                electrode = kind == "electrical" and what == "flow"
                sources.append(_source(what, ids, np.zeros(0), electrode))
                kept.append((what, value, len(ids)))
        for what, items in (("convection", settings.convection), ("radiation", settings.radiation)):
            for bodies, factor, area, outside in items:
                ids = self.bodies(what, bodies)
                coefficient = checks.number(what, factor) * self._areas(what, ids, area)
                sources.append(_source(what, ids, coefficient, False))
                kept.append(("outside", outside, len(ids)))
        for bodies, value in settings.gradient:
            ids = self.bodies("gradient", bodies)
            self._check_bending(ids)
            for axis in range(scene.dim):
                sources.append({**_source("gradient", ids, np.zeros(0), False), "axis": axis})
            kept.append(("gradient", value, len(ids)))
        self._sources[kind] = kept
        known = [(k.row, list(k.values)) for k in settings.kernels if k.row is not None]
        branches = self._branches(kind, settings)
        stresses = self._stresses() if kind == "thermal" else []
        given = {
            "materials": materials,
            "kernels": known,
            "plugged": [(k.address, list(k.values), " ".join(k.reads)) for k in settings.kernels if k.row is None],
            "sources": sources,
            "method": settings.method,
            "tol": settings.tol,
            "theta": settings.theta,
            "depth": scene.depth,
            "steady": settings.steady,
            "friction": settings.friction,
            "joule": settings.joule,
            "switched_share": settings.switched,
            "reference": settings.reference,
            "coupling": settings.coupling,
            "stresses": stresses,
            "growing": kind == "thermal" and self._grows(),
            **branches,
        }
        if settings.film is not None:
            given["film"] = settings.film.numbers()
        core.set_network(kind, given)
        if kind == "thermal":
            self._warm(settings, first)

    def _check_depth(self, kind, settings):
        """Raises ValueError for bodies whose mass was computed with another depth than that of the scene, since their heat
        capacity and forces would not fit the conductances."""
        scene, what = self._simulation.scene, ", and heat is stored in their mass"
        if not (kind == "thermal" and not settings.steady):
            what = ", and HertzStrip spreads forces along it"
            if not any(type(kernel).__name__ == "HertzStrip" for kernel in settings.kernels):
                return
        for s in self._simulation._sets:
            if s.depth is not None and not np.isclose(s.depth, scene.depth, rtol=1e-12, atol=0):
                raise ValueError(f"the scene is {scene.depth:g} m deep, and body {s.ids[0]} has the mass of {s.depth:g} m{what}: "
                                 f"give disks and polygons depth={scene.depth:g}")  # fmt: skip

    def _has_field(self, kind):
        return ("temperature" if kind == "thermal" else "potential") in self._simulation.bodies.names

    def _warm(self, settings, first):
        """Sets initial temperatures: of all bodies if `first`, else of those without one."""
        scene = self._core.scene
        present = np.concatenate([scene.body("id"), scene.node("id")])
        values = np.concatenate([scene.body("temperature"), scene.node("temperature")])
        order = np.argsort(present)
        new = np.ones(len(present), bool) if first else values <= 0
        start = np.zeros(len(present))
        for bodies, value in settings.initial:
            start[order[np.searchsorted(present, self.bodies("initial", bodies), sorter=order)]] = value
        marks = np.isin(present, self._marks())  # without heat capacity: any positive number will do
        start[marks & ~(start > 0)] = np.max(start, initial=0.0)
        if np.any(new & ~(start > 0)):
            at = int(np.argmax(new & ~(start > 0)))
            raise ValueError(f"initial temperature of body {present[at]} is {start[at]:g} K: give all bodies one above 0")
        values[new] = start[new]
        n = scene.body_count
        self._core.assign_body("temperature", values[:n])
        if len(values) > n:
            self._core.assign_node("temperature", values[n:])

    def _marks(self):
        """Ids of the bodies that only carry ends of joints in the world."""
        ends = [s.ids for s in self._simulation._sets if s.contactors and all(c.joint for c in s.contactors)]
        return np.concatenate(ends) if ends else np.zeros(0, np.int64)

    def _material(self, kind, settings, name):
        joints = {a for a, _, law in self._simulation._rules if law is not None and law.name == "joint"}
        if name in joints:  # ends of joints, present or removed, do not conduct
            return dict.fromkeys(NUMBERS, 0.0) | {"conductivity": _table(None), "capacity": _table(None), "joint": True}
        m = self._simulation._materials[name]
        asked = {word for kernel in settings.kernels for word in kernel.reads}
        for word, field in ASKED[kind].items():
            if word in asked and getattr(m, field) is None:
                names = ", ".join(type(k).__name__ for k in settings.kernels)
                raise ValueError(f"{field} of material {name!r} is not given, and the {kind} network needs it for {names}: "
                                 f"give cairn.Material({name!r}, {field}=...)")  # fmt: skip
        if kind == "thermal" and not settings.steady and m.capacity is None:
            raise ValueError(f"capacity of material {name!r} is not given, and heat is stored: give cairn.Material({name!r}, "
                             "capacity=...), or steady=True")  # fmt: skip
        if "hardness" in asked and m.hardness is None and not all("hardness" in k.parameter_names for k in settings.kernels):
            raise ValueError(f"hardness of material {name!r} is not given: give cairn.Material({name!r}, hardness=...)")
        own = m.conductivity if kind == "thermal" else _inverse(m.resistivity)
        latent = m.latent or (0.0, 0.0, 1.0)
        return {
            "conductivity": _table(own),
            "capacity": _table(m.capacity),
            "latent": latent[0],
            "melts": latent[1],
            "molten": latent[2],
            "density": m.density or 0.0,
            "young": m.young or 0.0,
            "poisson": m.poisson or 0.0,
            "hardness": m.hardness or 0.0,
            "expansion": m.expansion or 0.0,
        }

    def _areas(self, what, ids, area):
        if area is not None:
            return checks.spread("area", area, ids.shape, " [m2]")
        scene, radius = self._simulation.scene, np.zeros(len(ids))
        # initial radii, without thermal expansion, so that a network set up again after a restart has the same areas
        for s in self._simulation._sets:
            for c in s.contactors:
                if c.shape in ("disk", "sphere") and s.mesh is None and not c.joint:
                    size = np.zeros(len(s.ids))
                    size[c.body] = c.radius
                    at = np.searchsorted(s.ids, ids)
                    mine = (at < len(s.ids)) & (s.ids[np.minimum(at, len(s.ids) - 1)] == ids)
                    radius[mine] = size[at[mine]]
        if np.any(radius <= 0):
            raise ValueError(f"area of {what} is not given, and body {ids[np.argmin(radius)]} is no ball: give its area [m2]")
        return 4 * np.pi * radius**2 if scene.dim == 3 else 2 * np.pi * radius * scene.depth

    def _branches(self, kind, settings):
        wires = np.array(settings.wires, float).reshape(-1, 3)
        out = {
            "branch_a": wires[:, 0].astype(np.int64),
            "branch_b": wires[:, 1].astype(np.int64),
            "branch_conductance": wires[:, 2],
            "branch_capacity": np.zeros(len(wires)),
            "node": np.zeros(0, np.int64),
            "node_capacity": np.zeros(0),
        }
        self._add_meshes(kind, settings, out)
        present = self._simulation._present()
        for end in ("branch_a", "branch_b"):
            lost = out[end][~np.isin(out[end], present)]
            if len(lost):
                raise ValueError(f"a wire ends at body {lost[0]}, which is not there: give ids that Scene.add returned")
        return out

    def _moving_meshes(self):
        return self._simulation._meshes.meshes if self._simulation._meshes else []

    def _add_meshes(self, kind, settings, out):
        """Adds conduction and capacities of the elements of deformable bodies to `out`."""
        for mesh in self._moving_meshes():
            material, ids = mesh.d.material, mesh.node_ids
            field = "conductivity" if kind == "thermal" else "resistivity"
            value = meshes._constant(field, material, getattr(material, field))
            pairs, conductance = meshes.branches(mesh, value if kind == "thermal" else _inverse(value))
            parts = [(pairs, conductance, np.zeros(len(pairs)))]
            if kind == "thermal" and not settings.steady:
                capacity = meshes._constant("capacity", material, material.capacity)
                own, pairs, coupled = meshes.capacities(mesh, capacity, settings.lumped)
                out["node"] = np.concatenate([out["node"], ids])
                out["node_capacity"] = np.concatenate([out["node_capacity"], own])
                parts.append((pairs, np.zeros(len(pairs)), coupled))
            for pairs, conductance, coupled in parts:
                out["branch_a"] = np.concatenate([out["branch_a"], ids[pairs[:, 0]]])
                out["branch_b"] = np.concatenate([out["branch_b"], ids[pairs[:, 1]]])
                out["branch_conductance"] = np.concatenate([out["branch_conductance"], conductance])
                out["branch_capacity"] = np.concatenate([out["branch_capacity"], coupled])

    def _stresses(self):
        return [meshes.thermal_stress(mesh, k, mesh.d.material.expansion)
                for k, mesh in enumerate(self._moving_meshes()) if mesh.d.material.expansion]  # fmt: skip

    def _check_bending(self, ids):
        """Raises ValueError for bodies with a gradient that are not polygons or polyhedra, or do not expand."""
        for s in self._simulation._sets:
            for c in s.contactors:
                if c.joint or not np.isin(np.atleast_1d(s.ids[np.unique(c.body)]), ids).any():
                    continue
                if c.shape not in ("polygon", "polyhedron"):
                    raise ValueError(f"gradient names bodies of the shape {c.shape}: give polygons and polyhedra alone")
                if not self._simulation._materials[c.material.name].expansion:
                    raise ValueError(f"gradient names bodies of {c.material.name!r}, which has no expansion: give "
                                     f"cairn.Material({c.material.name!r}, expansion=...)")  # fmt: skip

    def _grows(self):
        """True if a rigid body expands thermally. Raises ValueError with SmoothDEM, whose pair list assumes constant sizes."""
        sets, found = self._simulation._sets, False
        for s in sets:
            own = [] if s.mesh is not None else [c for c in s.contactors if not c.joint]
            found |= any(self._simulation._materials[c.material.name].expansion for c in own)
        if found and isinstance(self._simulation.strategy, SmoothDEM):
            raise ValueError("SmoothDEM lists its pairs for shapes that keep their size: give NSCD where bodies expand")
        return found

    def bodies(self, name, given):
        """Ids (n,) of bodies and nodes. given: ids, a group, a material, "*", or "MESH.GROUP" for nodes of a mesh; name: of the
        argument in messages."""
        present = self._simulation._present()
        if not isinstance(given, str):
            ids = np.asarray(given)
            if ids.dtype.kind not in "iu" or np.any(~np.isin(ids, present)):
                raise ValueError(f"{name}: ids {given!r} are not all of bodies that are there")
            return ids.astype(np.int64)
        if given == "*":
            return present[~np.isin(present, self._marks())]
        sets = self._simulation._sets
        for mesh in self._moving_meshes():
            name, _, group = given.partition(".")
            if name == mesh.d.name and group:
                return mesh.node_ids[mesh.body.nodes(group)]
        groups = [s.ids for s in sets if s.group == given and s.mass is not None]
        if not groups:
            groups = [s.ids[np.unique(c.body)] for s in sets for c in s.contactors if c.material.name == given and not c.joint]
        if not groups:
            materials = {c.material.name for s in sets for c in s.contactors if not c.joint}
            known = sorted({s.group for s in sets if s.group} | materials)
            raise ValueError(f"{name}: there is no group and no material {given!r}; there are {', '.join(known)} and '*'")
        ids = np.unique(np.concatenate(groups))
        return ids[np.isin(ids, present)]

    # ------------------------------------------------------------------ before and after each step

    def load(self, h):
        """Passes the values of sources for a step of h [s] to the core: at its end; flows weighted by theta over the step."""
        t, dim = self._core.time, self._simulation.scene.dim
        for kind, kept in self._sources.items():
            theta, k = self._simulation.scene.networks[kind].theta, 0
            for what, value, n in kept:
                now = time_functions.value_at(value, t + h)
                if what == "gradient":
                    for row in _gradients(now, n, dim).T:
                        self._core.set_source(kind, k, np.ascontiguousarray(row))
                        k += 1
                    continue
                now = _rows(what, now, n)
                if what == "flow" and theta < 1 and callable(value):
                    now = theta * now + (1 - theta) * _rows(what, value(t), n)
                self._core.set_source(kind, k, now)
                k += 1

    def look(self, report):
        """Warns once of each kind of failure in the report of a step."""
        for kind in self._sources:
            told = report.get(kind, {})
            status = told.get("status")
            text = {
                "open": f"the {kind} network has {told.get('open')} bodies whose sources have nowhere to go: nothing flows there",
                "iteration_limit": f"the {kind} network was not solved to its tolerance: {told.get('residual'):.3g} is left over",
                "coupling_limit": f"mechanics and heat did not agree: {told.get('coupling')} of the thermal load came "
                "unseen; give a smaller dt, or a larger coupling",
                "not_finite": f"the {kind} network has conductances or sources that are no finite numbers",
            }.get(status)
            if told.get("unfit"):
                status, text = "unfit", (
                    f"{told['unfit']} contacts have no radius, which the conductance of the {kind} network asks for: they "
                    "conduct nothing; give a conductance by area, such as Yovanovich"
                )
            if text and (kind, status) not in self._told:
                self._told.add((kind, status))
                warnings.warn(text, NetworkWarning, stacklevel=4)


def _source(kind, ids, coefficient, electrode):
    return {"kind": kind, "ids": ids, "coefficient": coefficient, "electrode": electrode, "value": np.zeros(len(ids))}


def _gradients(value, n, dim):
    rows = np.asarray(value, float)
    if rows.shape not in ((dim,), (n, dim)) or not np.all(np.isfinite(rows)):
        raise ValueError(f"gradient is {value} for {n} bodies: give {dim} finite numbers, or as many for each [K/m]")
    return np.broadcast_to(rows, (n, dim))


def _rows(what, value, n):
    rows = np.asarray(value, float)
    if rows.ndim and rows.shape != (n,):
        raise ValueError(f"a source of kind {what} gives {rows.shape} values for {n} bodies: give one number, or one each")
    if not np.all(np.isfinite(rows)):
        raise ValueError(f"a source of kind {what} gives {value}: give finite numbers")
    return np.ascontiguousarray(np.broadcast_to(rows, (n,)))


def _table(value):
    if isinstance(value, OfTemperature):
        return {"temperature": np.array(value.temperatures), "value": np.array(value.values)}
    return {"temperature": np.zeros(0), "value": np.array([0.0 if value is None else value])}


def _inverse(value):
    """Conductivity from a resistivity; if it depends on temperature, tabulated with forty parts in each interval."""
    if value is None:
        return None
    if not isinstance(value, OfTemperature):
        return np.inf if value == 0 else 1 / value
    t = np.array(value.temperatures)
    fine = np.unique(np.concatenate([np.linspace(a, b, 41) for a, b in zip(t, t[1:])]))
    return OfTemperature(tuple(fine), tuple(1 / np.interp(fine, t, value.values)))
