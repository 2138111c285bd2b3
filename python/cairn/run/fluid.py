"""The liquid of a simulation: it is given to the core once, with the surfaces of bodies, and read as arrays."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..base import checks
from ..model.bodies import DOFS
from ..model.fluid_points import LAYERED, PLANES, Points, depth_in, points_of
from ..model.fluid_skins import Surface, flat_pieces, skin_of
from ..model.fluids import FreeSlip, grain_size, slip_between, sound_speed_of
from .fluid_gaps import warn_of_beds, warn_of_gaps, warn_of_light_beds, warn_of_tension, warn_of_thin
from .fluid_room import (
    crowd,
    depth_in_bodies,
    outside,
    refuse_crowded,
    refuse_liquid_aside,
    refuse_liquid_behind,
    refuse_wrong_way_out,
)
from .fluid_start import refuse_narrow_cell, refuse_squeezed, warn_of_depth, warn_of_light_mesh, warn_of_uneven_cell
from .fluid_watch import FluidWatch


class Running:
    """The liquid of a simulation, as its scene has it."""

    def __init__(self, simulation, core):
        self._simulation, self._core = simulation, core
        scene = simulation.scene
        self.fluids = list(scene.fluids)
        self._refuse(scene)
        first, gravity = self.fluids[0], self._gravity()
        periodic, lengths = _cell_of(scene)
        refuse_narrow_cell(lengths, first.spacing, first.smoothing)
        across = np.where(periodic, 0.0, gravity)
        bodies = _bodies_of(scene, simulation._sets, first.spacing)
        self.sets_seen = len(simulation._sets)
        self._meshes_seen = set()  # ids of the first nodes of those whose warnings were given
        kept = [outside(f, [*bodies, *self._solids()], scene.dim) for f in self.fluids]
        position = np.concatenate([place for place, _ in kept])
        velocity = np.concatenate([f.velocity[k] for f, (_, k) in zip(self.fluids, kept)])
        if not len(position):
            raise ValueError("no particle of the fluid lies outside bodies and walls: give cn.fluid a region that is open")
        refuse_crowded(position, first.spacing)
        warn_of_uneven_cell(lengths, np.concatenate([f.position for f in self.fluids]), first.spacing, above=5)
        ends = self._ends(scene, position, bodies, periodic)
        speed = first.sound_speed or 0.0
        if not (speed or first.incompressible):
            speed = sound_speed_of(self.fluids, across, periodic, ends["velocity"] if ends else ())
        pressure = np.concatenate([_pressure(f, across)[k] for f, (_, k) in zip(self.fluids, kept)])
        self.sound_speed = speed
        settings = {"spacing": first.spacing, "density": first.density, "viscosity": first.viscosity, "sound_speed": speed}
        settings |= {"smoothing": first.smoothing, "artificial": first.artificial, "depth": float(scene.depth)}
        settings["surface_tension"] = first.surface_tension
        settings["incompressible"] = first.incompressible
        settings["threads"] = int(getattr(simulation.strategy, "threads", None) or 0)
        self.settings = settings
        if ends:
            position, velocity = (np.concatenate([a, ends[k]]) for a, k in ((position, "position"), (velocity, "velocity")))
            pressure = np.concatenate([pressure, np.zeros(len(ends["position"]))])
            refuse_crowded(position, first.spacing)
        # by which ranks compare it; number of threads aside, which each may have of its own
        alike = {name: value for name, value in settings.items() if name != "threads"}
        self.told = {"particles": len(position), **alike, "position": position, "velocity": velocity, "pressure": pressure}
        self.told["rules"] = list(scene.fluid_rules)
        _core.set_fluid(core, settings, _three(position - scene.origin), _three(velocity), pressure)
        if ends:
            _core.set_fluid_ends(core, ends)
        self._give_surfaces(bodies, simulation._sets, above=5)
        refuse_squeezed([f.pressure for f in self.fluids if f.pressure is not None], settings)
        self.watch = FluidWatch(self)
        if self._warn_at_start(bodies, position, gravity, above=6):
            self.watch.knows("gaps")

    def _warn_at_start(self, bodies, position, gravity, above):
        """Warns of what the liquid does not resolve at the start; True if of gaps."""
        scene, first = self._simulation.scene, self.fluids[0]
        held, slips = self.held(), [slip_between(scene, b.material, b.group) for b in bodies]
        warn_of_tension(self.settings, above)
        self._warn_of_depth(self._simulation._sets, above)
        small = [b for b, slip in zip(bodies, slips) if slip > FreeSlip.number]
        sizes = [self._grain(b)[0] for b in small]
        warn_of_beds(small, sizes, first.spacing, first.smoothing, above)
        free = [k for k, b in enumerate(small) if int(b.ids[0]) not in held]
        density = [scene._materials[small[k].material].density for k in free]
        warn_of_light_beds([small[k] for k in free], [sizes[k] for k in free], density, gravity, position, first.spacing,
                           first.density, above)  # fmt: skip
        return warn_of_gaps(bodies, slips, position, first.spacing, held, above)

    def _warn_of_depth(self, sets, above):
        """Warns of moving bodies of sets in 2D whose depth is not that of the liquid."""
        scene = self._simulation.scene
        met = [s for s in sets if any(slip_between(scene, c.material.name, s.group) for c in s.contactors if not c.joint)]
        warn_of_depth(met, _held(met, scene.dim), float(scene.depth), above + 1)

    def _ends(self, scene, position, bodies, periodic):
        """Arrays of the core for inflows and outflows, with "position" and "velocity" of the particles in inflows; None: none."""
        if not scene.fluid_ends:
            return None
        first, origin = self.fluids[0], np.asarray(scene.origin, float)[: scene.dim]
        if first.incompressible:
            raise ValueError("cn.Inflow and cn.Outflow are those of the weakly compressible fluid: leave out incompressible")
        if any(slip_between(scene, b.material, b.group) > FreeSlip.number for b in bodies):
            raise ValueError("grains smaller than a particle do not meet open ends: leave out GrainDrag, or Inflow and Outflow")
        reach, inflows = 2 * first.smoothing * first.spacing, [e for e in scene.fluid_ends if hasattr(e, "velocity")]
        tables = [e.lanes(first.spacing, reach) for e in inflows]
        for t in tables:
            refuse_liquid_behind(t, position, first.spacing, reach)
            refuse_liquid_aside(t, position, first.spacing, reach)
        ways_out = [e for e in scene.fluid_ends if not hasattr(e, "velocity")]
        outflows = [e.row(0.5 * (position.min(axis=0) + position.max(axis=0)), reach, origin) for e in ways_out]
        for e, row in zip(ways_out, outflows):
            refuse_wrong_way_out(e.region, int(row[6]), float(row[7]), position, first.spacing)
        for axis in [int(t["axis"][0]) for t in tables] + [int(row[6]) for row in outflows]:
            if periodic[axis]:
                raise ValueError(f"axis {axis} is periodic, and an inflow or outflow leads along it: leave out one of both")
        out = {"outflow": np.concatenate([np.zeros(0), *outflows]), "lane": [np.full(len(position), -1)]}
        names = ("position", "velocity", "axis", "sign", "face", "length", "speed")
        columns, many = {name: [np.zeros((0, scene.dim)) if name in names[:2] else np.zeros(0)] for name in names}, 0
        for t in tables:
            t["face"] = t["face"] - t["sign"] * origin[t["axis"]]
            free = self._free_rows(t, bodies)
            for name in names:
                columns[name].append(t[name][free] if name in names[:2] else t[name])
            out["lane"].append(t["lane"][free] + many)
            many += len(t["axis"])
        out |= {name: np.concatenate(c) for name, c in columns.items()}
        out["axis"], out["lane"] = out["axis"].astype(np.int32), np.concatenate(out["lane"]).astype(np.int32)
        return out

    def _free_rows(self, table, bodies):
        """Rows (n,) of the particles of an inflow that lie outside bodies. Raises ValueError if a body stands in a part of a row,
        which would come in with gaps."""
        deep, where = depth_in_bodies(table["position"], bodies, self._simulation.scene.dim)
        free, lane = deep <= 0, table["lane"]
        part = np.bincount(lane[free], minlength=lane.max() + 1) % np.bincount(lane) > 0
        inside = np.flatnonzero(~free & part[lane])
        if len(inside):
            at = tuple(float(v) for v in table["position"][inside[0]])
            raise ValueError(
                f"body {where[inside[0]]} stands in a part of cn.Inflow, at {at}, and rows of the liquid would come in with "
                "gaps: give a region that ends before the body, or lies beside it"
            )
        return free

    def _refuse(self, scene):
        liquids = {f.liquid() for f in self.fluids}
        if len(liquids) > 1:
            raise ValueError(
                f"fluids {', '.join(sorted(f.name for f in self.fluids))} differ in spacing, density, viscosity, sound_speed, "
                "smoothing, artificial, incompressible or surface_tension: two liquids do not mix here, give both the same values"
            )
        strategy = type(self._simulation.strategy).__name__
        if self.fluids[0].incompressible and strategy != "NSCD":
            raise ValueError(
                f"the incompressible fluid is solved with the contacts of NSCD, and {strategy} moves this scene: give "
                "strategy=cn.NSCD(), or leave out incompressible"
            )
        if self.fluids[0].incompressible and self._simulation.strategy.integrator is not None:
            raise ValueError(
                "the incompressible fluid moves by the theta-method of NSCD: leave out integrator, or incompressible"
            )
        if self.fluids[0].incompressible and self._simulation.strategy.cut_back > 0:
            raise ValueError("the incompressible fluid makes no step in parts: leave out cut_back, or incompressible")
        self._refuse_meshes()
        self.refuse_integrator(self._simulation.strategy)

    def refuse_integrator(self, strategy, sets=None):
        """Raises ValueError where an integrator other than the theta-method moves rigid bodies that the liquid meets: they would
        ring from step to step."""
        if type(strategy).__name__ != "NSCD" or strategy.integrator is None:
            return
        scene = self._simulation.scene
        for s in self._simulation._sets if sets is None else sets:
            held = set(DOFS[scene.dim]) <= set(s.driven or ())
            if s.mesh is None and s.mass is not None and np.isfinite(s.mass).any() and not held:
                if any(slip_between(scene, c.material.name, s.group) for c in s.contactors):
                    raise ValueError(
                        "rigid bodies move in the fluid by the theta-method of NSCD, and "
                        f"{type(strategy.integrator).__name__} moves this scene: leave out integrator"
                    )

    def _met_meshes(self, sets=None):
        """[(deformable body, id of its first node, how the liquid meets it)] of those of sets that it meets."""
        sets = self._simulation._sets if sets is None else sets
        bodies = {id(s.mesh): (s.mesh, s) for s in reversed(sets) if s.mesh is not None}
        found = [(d, s, slip_between(self._simulation.scene, d.material.name, d.name)) for d, s in bodies.values()]
        return [(d, None if s.ids is None else int(s.ids[0]), slip) for d, s, slip in reversed(found) if slip]

    def _refuse_meshes(self, sets=None):
        """Raises ValueError for deformable bodies that the liquid cannot meet."""
        strategy, depth = self._simulation.strategy, float(self._simulation.scene.depth)
        moved_by = strategy if type(strategy).__name__ != "NSCD" else strategy.integrator
        for d, _, slip in self._met_meshes(sets):
            name, remedy = d.name, f"; or Scene.interact(fluid, {d.name!r}, None), and it flows through"
            if moved_by is not None:
                raise ValueError(
                    f"{name!r} moves beside the fluid by the theta-method of NSCD, and {type(moved_by).__name__} moves this "
                    "scene: give strategy=cn.NSCD(theta=...)" + remedy
                )
            if slip > FreeSlip.number:
                raise ValueError(
                    f"{name!r} is deformable, and drag by porosity is that of rigid grains: give Scene.interact(fluid, {name!r}, "
                    "cn.NoSlip())" + remedy
                )
            if d.opening is not None:
                raise ValueError(f"{name!r} may crack, and the fluid enters no cracks: leave out its fracture" + remedy)
            if getattr(d.body, "plane", "") == "axisymmetric":
                raise ValueError(f"{name!r} is axisymmetric, and the fluid of a plane scene is not: give plane strain" + remedy)
            thick = float(getattr(d.body, "thickness", 1.0))
            if d.body.dim == 2 and not abs(thick - depth) <= 1e-9 * depth:
                raise ValueError(
                    f"{name!r} is {thick:g} m thick across the plane, and the scene, over whose depth the fluid presses, "
                    f"{depth:g} m: give both the same" + remedy
                )

    def _solids(self):
        """Deformable bodies that the liquid meets where they stand, as `depth_in_bodies` takes them."""
        scene, core, out = self._simulation.scene, self._core.scene, []
        for d, first, _ in self._met_meshes():
            row = core.node_row(first)
            x = core.raw_node("position")[row : row + len(d.body.points)] + np.asarray(scene.origin, float)[: scene.dim]
            out.append(_Solid(first, _surface_of(d, x), self.fluids[0].spacing))
        return out

    def _skins(self, sets, above):
        """Arrays of the core for points below the sides of deformable bodies; warns of thin ones."""
        first, tables, met = self.fluids[0], [], self._met_meshes(sets)
        for d, first_node, _ in met:
            table = skin_of(d.body, d.name, first.spacing, 2 * first.smoothing * first.spacing)
            if first_node not in self._meshes_seen and not first.artificial:
                warn_of_thin(d.name, table["thickness"], first.spacing, first.incompressible, above + 1)
            if first_node not in self._meshes_seen:
                warn_of_light_mesh(d, first, self._simulation.strategy.theta, above + 1)
            self._meshes_seen.add(first_node)
            tables.append(table | {"mesh": np.full(len(table["depth"]), len(tables))})
        most = max((t["node"].shape[1] for t in tables), default=1)
        kinds = {"mesh": np.int32, "node": np.int32, "weight": float, "along": float, "across": float}
        kinds |= dict.fromkeys(("depth", "volume", "behind", "size"), float)
        out = {"most": most, "slip": np.array([slip for *_, slip in met], np.int8)}
        out["first_node"] = np.array([first_node for _, first_node, _ in met], np.int64)
        for name, kind in kinds.items():
            columns = [np.pad(t[name], ((0, 0), (0, most - t[name].shape[1]))) if t[name].ndim > 1 else t[name] for t in tables]
            out[name] = np.concatenate([np.zeros(0), *(c.ravel() for c in columns)]).astype(kind)
        return out

    def _gravity(self):
        scene = self._simulation.scene
        if not callable(scene.gravity):
            return scene.gravity
        return checks.real_array("gravity", scene.gravity(self._simulation.time), (scene.dim,))

    def _give_surfaces(self, bodies, sets, above):
        tables, scene = {"points": [], "planes": []}, self._simulation.scene
        grains = {"body": [], "diameter": [], "volume": [], "law": []}
        for body in bodies:
            slip = slip_between(scene, body.material, body.group)
            if slip > FreeSlip.number:
                volume, diameter = self._grain(body)
                for name, value in zip(grains, (body.ids, diameter, volume, slip)):
                    grains[name].append(np.broadcast_to(value, len(body.ids)))
                continue
            table = tables["planes" if body.plane else "points"]
            for k in body.ids:
                table.append((k, body.points, slip))
        kinds = {"body": np.int64, "diameter": float, "volume": float, "law": np.int8}
        grains = {name: np.concatenate([np.zeros(0), *grains[name]]).astype(kind) for name, kind in kinds.items()}
        self.grains = grains["body"]
        points, planes = _table(tables["points"]), _table(tables["planes"])
        _core.set_fluid_surfaces(self._core, points, planes, grains, self._skins(sets, above + 1))

    def _grain(self, body):
        """Volume and diameter of a grain. Raises ValueError for a body that is none."""
        size, spacing = grain_size(body.shape, self._simulation.scene.dim, body.form), self.fluids[0].spacing
        remedy = "give Scene.interact(fluid, material, cn.NoSlip()), with which the fluid flows round it, or None"
        if self.fluids[0].surface_tension > 0:
            raise ValueError("grains smaller than a particle feel no surface tension: leave out surface_tension, or GrainDrag")
        if self.fluids[0].incompressible:
            raise ValueError("drag of grains is that of the weakly compressible fluid: leave out incompressible, or GrainDrag")
        if size is None or body.parts > 1:
            what = f"a body of {body.parts} parts" if size else f"a {body.shape}"
            raise ValueError(f"body {int(body.ids[0])} is {what}, and drag by porosity is that of convex grains: {remedy}")
        if size[1] > spacing * (1 + 1e-9):
            raise ValueError(
                f"body {int(body.ids[0])} is a grain of diameter {size[1]:g} m, more than the spacing of the fluid, {spacing:g} "
                f"m, and drag by porosity is that of smaller ones: {remedy}; or a larger spacing"
            )
        return size

    def prepare(self, h):
        """Prepares a step of h [s]: takes bodies that came since, and warns of many sub-steps."""
        self.follow()
        self.watch.before(h, lambda: _core.fluid_report(self._core)["stable_step"])

    def follow(self, sets=None):
        """Gives surfaces of bodies that came since to the core. sets: those of a state that is being restored."""
        sets = self._simulation._sets if sets is None else sets
        if len(sets) == self.sets_seen:
            return
        self._warn_of_depth(sets[self.sets_seen :], above=7)
        self.sets_seen = len(sets)
        self._give_surfaces(_bodies_of(self._simulation.scene, sets, self.fluids[0].spacing), sets, above=7)

    def met_surfaces(self, position=None, rotation=None):
        """Contactors where they stand now, or would stand, and how the liquid meets each.

        Parameters
        ----------
        position : ndarray (n, dim), optional
            Places of all bodies relative to the origin of the scene [m]; those of now when not given.
        rotation : ndarray, optional
            Rotations of all; those of now when not given.

        Returns
        -------
        tuple of list
            Contactors, and numbers of rules.
        """
        simulation, scene = self._simulation, self._simulation.scene
        now = simulation.bodies
        place = np.asarray(now.position) if position is None else position + scene.origin
        turned = rotation if rotation is not None else now.rotation if "rotation" in now.names else None
        rows = {int(k): row for row, k in enumerate(now.id)}
        bodies = [b for b in _bodies_of(scene, simulation._sets, self.fluids[0].spacing) if int(b.ids[0]) in rows]
        for b in bodies:
            row = rows[int(b.ids[0])]
            b.position, b.rotation = place[row], b.rotation if turned is None else np.asarray(turned)[row]
        return bodies, [slip_between(scene, b.material, b.group) for b in bodies]

    def refuse_moved(self, position, rotation):
        """Raises ValueError if bodies that are put elsewhere stand where the liquid is.

        Parameters
        ----------
        position, rotation : ndarray or None
            As in `met_surfaces`; None: as they are.
        """
        scene, spacing = self._simulation.scene, self.fluids[0].spacing
        x = np.asarray(self._simulation.fluid.position)
        was, slips = self.met_surfaces()
        moved = [
            (a, b, slip)
            for a, b, slip in zip(was, self.met_surfaces(position, rotation)[0], slips)
            if slip and not (np.array_equal(a.position, b.position) and np.array_equal(a.rotation, b.rotation))
        ]
        grains = [b for a, b, slip in moved if slip > FreeSlip.number and np.linalg.norm(a.position - b.position) > spacing]
        self._refuse_grains_inside(grains, x)
        for a, b, slip in moved:
            if slip > FreeSlip.number:
                continue
            before, after = (depth_in_bodies(x, [c], scene.dim)[0] for c in (a, b))
            came = np.where(before < 0.5 * spacing, after, -np.inf)
            inside = np.flatnonzero(came > 0.5 * spacing)
            if not len(inside):
                inside = crowd(np.where(before < 0, after, -np.inf), b, scene.dim, spacing)
            if len(inside):
                at = tuple(float(v) for v in x[inside[np.argmax(after[inside])]])
                raise ValueError(
                    f"{len(inside)} particles of the liquid lie in body {int(b.ids[0])} where it is put, one at {at}: put it "
                    "outside the liquid, or move it there by driven= in steps, before which the liquid gives way"
                )

    def held(self):
        """Ids of bodies that do not move freely at all."""
        return _held(self._simulation._sets, self._simulation.scene.dim)

    def look(self, report):
        """Adds the volume of the liquid to the report of a step, and warns; see FluidWatch."""
        info = _core.fluid_report(self._core)
        report["fluid_volume"] = info["volume"]
        self.watch.look(self._simulation, info)

    def refuse_inside(self, sets):
        """Raises ValueError if particles of the liquid lie in bodies that are to come in."""
        scene = self._simulation.scene
        numbered = [s.with_(ids=np.arange(len(s.position))) for s in sets if s.mesh is None]
        x = np.array(self._simulation.fluid.position)
        bodies = _bodies_of(scene, numbered, self.fluids[0].spacing)
        self._refuse_grains_inside(bodies, x)
        self._refuse_meshes(sets)
        self.refuse_integrator(self._simulation.strategy, sets)
        bodies += [_Solid(-1, _surface_of(d, d.body.points), self.fluids[0].spacing) for d, _, _ in self._met_meshes(sets)]
        spacing = self.fluids[0].spacing
        depth, _ = depth_in_bodies(x, bodies, scene.dim)
        inside = np.flatnonzero(depth > 0.5 * spacing)
        for b in bodies if not len(inside) else ():
            inside = np.union1d(inside, crowd(depth_in_bodies(x, [b], scene.dim)[0], b, scene.dim, spacing)).astype(int)
        if len(inside):
            at = tuple(float(v) for v in x[inside[np.argmax(depth[inside])]])
            raise ValueError(
                f"{len(inside)} particles of the liquid lie in the bodies that are added, one at {at}: add them outside the "
                "liquid, or to the scene before the start, where the liquid makes room"
            )

    def _refuse_grains_inside(self, bodies, x):
        """Raises ValueError for grains that come in where the liquid, at x, fills space, which they would compress at once."""
        scene = self._simulation.scene
        grains = [b for b in bodies if slip_between(scene, b.material, b.group) > FreeSlip.number]
        if not grains:
            return
        from scipy.spatial import cKDTree

        place = np.array([b.position for b in grains])
        inside = np.flatnonzero(cKDTree(x).query(place)[0] < self.fluids[0].spacing)
        if len(inside):
            at = tuple(float(v) for v in place[inside[0]])
            raise ValueError(
                f"{len(inside)} grains are added within the liquid, one at {at}, and would compress it: add them above it, or to "
                "the scene before the start, where the liquid makes room"
            )


def _cell_of(scene):
    """Which axes (dim,) are periodic, and the length of the cell along each, inf along others [m]."""
    if scene.periodic is None:
        return np.zeros(scene.dim, bool), np.full(scene.dim, np.inf)
    periodic, vectors = scene.periodic.arrays(scene.dim)[:2]
    periodic = np.asarray(periodic, bool)[: scene.dim]
    return periodic, np.where(periodic, np.diag(np.asarray(vectors).reshape(3, 3))[: scene.dim], np.inf)


def _held(sets, dim):
    """Ids of bodies that do not move freely at all."""
    held = set()
    for s in sets:
        if s.mesh is None and (set(DOFS[dim]) <= set(s.driven or ()) or s.mass is not None and not np.isfinite(s.mass).any()):
            held |= {int(k) for k in s.ids}
    return held


def _surface_of(d, x):
    """The boundary of a deformable body whose nodes are at x (n, dim) [m]."""
    try:
        return Surface(flat_pieces(d.body), x)
    except (AttributeError, ValueError) as wrong:
        raise ValueError(
            f"the fluid meets the sides of {d.name!r}, which are not known ({wrong}): give edges or faces to its body; or "
            f"Scene.interact(fluid, {d.name!r}, None), and it flows through"
        ) from None


class _Solid:
    """A deformable body as it stands, which begins with a node."""

    plane, points, rotation, shape, form = True, None, None, "mesh", None

    def __init__(self, node, surface, spacing):
        self.ids, self.position, self.surface, self.within = [node], 0.0, surface, 2 * spacing


class _Body:
    """Contactors of one form, on bodies of a set: ids (n,), where they stand, and their points in the axes of the body."""

    def __init__(self, ids, position, rotation, material, group, shape, form):
        self.ids, self.position, self.rotation = ids, position, rotation
        self.material, self.group, self.shape, self.form = material, group, shape, form
        self.plane, self.points, self.parts = shape in PLANES, None, 1


def _bodies_of(scene, sets, spacing):
    dim, out = scene.dim, []
    reach = 2 * scene.fluids[0].smoothing * spacing
    for s in sets:
        if s.mesh is not None:  # its sides meet the liquid, not the contactors on them
            continue
        parts = {}
        for c in s.contactors:
            if c.joint:
                continue
            for row in range(len(c.body)):
                parts.setdefault(int(c.body[row]), []).append((c, row))
        made = {}
        for row, contactors in parts.items():
            key = tuple((id(c), _key(c, k)) for c, k in contactors)
            if key not in made:
                made[key] = [_form(c, k, dim) for c, k in contactors]
                _sampled(made[key], dim, spacing, reach, slip_between(scene, contactors[0][0].material.name, s.group), s.ids[row])
            for (c, _), (shape, form, points) in zip(contactors, made[key]):
                body = _Body(s.ids[[row]], s.position[row], None if s.rotation is None else s.rotation[row], c.material.name,
                             s.group, shape, form)  # fmt: skip
                body.points, body.parts = points, len(contactors)
                out.append(body)
    return out


def _key(c, row):
    """Numbers that tell the form of a contactor."""
    hull = None if c.hull is None else int(c.hull[row])
    return (float(c.radius[row]), hull, *(None if a is None else tuple(a[row]) for a in (c.offset, c.direction)))


def _form(c, row, dim):
    """[name of the shape, its form, None] of a contactor."""
    form = {"offset": np.zeros(dim) if c.offset is None else np.asarray(c.offset[row], float), "radius": float(c.radius[row])}
    if c.direction is not None:
        way = np.asarray(c.direction[row], float)
        form |= {"direction": way[:dim] / np.linalg.norm(way[:dim]), "half": float(way[dim])}
    if c.hulls is not None:
        h, k = c.hulls, int(c.hull[row])
        form["vertex"] = np.asarray(h.vertex[h.first_vertex[k] : h.first_vertex[k + 1]], float)
        if c.shape == "polyhedron":
            faces = range(int(h.first_face[k]), int(h.first_face[k + 1]))
            form["faces"] = [np.asarray(h.corner[h.first_corner[f] : h.first_corner[f + 1]], int) for f in faces]
        if c.shape in ("capsule", "cylinder"):
            half = float(np.linalg.norm(form["vertex"][1]))
            form |= {"half": half, "direction": np.asarray(h.plane[k, :3], float), "radius": float(h.plane[k, 3])}
    return [c.shape, form, None]


def _sampled(contactors, dim, spacing, reach, slip, body):
    """Fills in the points of the contactors of a body: those of later ones stand outside the former ones."""
    for k, (shape, form, _) in enumerate(contactors):
        if shape in PLANES:
            place = form["offset"][None]
            contactors[k][2] = Points(place, form["direction"][None], np.zeros(1), np.zeros(1))
            continue
        if slip == 0 or slip > FreeSlip.number:
            contactors[k][2] = Points(np.zeros((0, dim)), np.zeros((0, dim)), np.zeros(0), np.zeros(0))
            continue
        if shape not in LAYERED:
            raise ValueError(
                f"body {body} has a {shape}, which the fluid does not meet: it meets {', '.join((*LAYERED, *PLANES))}; give "
                "Scene.interact(fluid, material, None), and it flows through"
            )
        if "vertex" not in form and form["radius"] < spacing:
            raise ValueError(
                f"body {body} is a {shape} of radius {form['radius']:g} m, less than the spacing of the fluid, {spacing:g} m: "
                "give a smaller spacing, larger bodies, or Scene.interact(fluid, material, None), and it flows through"
            )
        points = points_of(shape, dim, form, spacing, reach)
        for other, of, _ in contactors[:k]:
            if other not in PLANES:
                points = points.where(depth_in(other, dim, of, points.place) <= 0)
        contactors[k][2] = points


def _table(rows):
    """Arrays of the core for points of bodies, in space."""
    none = (np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0))
    wide = [none]
    for k, p, slip in rows:
        slips = np.full(len(p), slip)
        wide.append((np.full(len(p), k), _three(p.place), _three(p.normal), p.depth, p.volume, slips, p.centre))
    columns = [np.concatenate(c) for c in zip(*wide)]
    kinds = ("body", np.int64), ("offset", float), ("normal", float), ("depth", float), ("volume", float), ("slip", np.int8)
    kinds = (*kinds, ("centre", float))
    return {name: np.ascontiguousarray(c, kind) for (name, kind), c in zip(kinds, columns)}


def _three(x):
    return np.ascontiguousarray(np.pad(x, ((0, 0), (0, 3 - x.shape[1]))))


def _pressure(fluid, gravity):
    """Pressure of each particle at the start [Pa]."""
    if fluid.pressure is not None:
        return fluid.pressure
    pull = np.linalg.norm(gravity)
    if not pull > 0:
        return np.zeros(len(fluid))
    along = fluid.position @ (gravity / pull)
    return fluid.density * pull * (along - along.min() + 0.5 * fluid.spacing)
