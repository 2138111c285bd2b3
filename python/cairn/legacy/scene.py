"""Conversion of a DATBOX folder to a scene."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass, field

import numpy as np

from .. import _core
from ..base import checks, time_functions
from ..base.materials import Material
from ..model import bodies, round_shapes, shapes
from ..model.scene import Scene
from ..model.shapes import Hulls
from . import datbox, mesh, networks
from .contact_laws import law_of
from .drives import function_of
from .rigid import SHORT
from .text import LegacyError


class UnmappedWarning(UserWarning):
    """A part of a file or scene has no counterpart in the other: it was left out, as requested, or replaced by the nearest."""


@dataclass
class Origin:
    """Origin of a scene. unmapped: texts on parts that were left out; notes: texts on differences from the files; alert: largest
    alert distance [m]; datbox: content of the files."""

    datbox: datbox.Datbox
    unmapped: list = field(default_factory=list)
    notes: list = field(default_factory=list)
    heated: list = field(default_factory=list)  # meshes of heat, see cairn.legacy.networks
    alert: float = 0.0

    def __repr__(self):
        return f"<from {self.datbox.folder}: {len(self.unmapped)} left out, {len(self.notes)} notes>"

    def __str__(self):
        box = self.datbox
        counted = f"{len(box.bodies)} rigid bodies, {len(box.meshes)} meshes, {len(box.see)} see tables"
        lines = [f"from {box.folder}: {box.dim}D, {counted}", f"largest alert distance {self.alert:g} m"]
        for what, found in (("left out", self.unmapped), ("told otherwise", self.notes)):
            lines += [f"{what}: {' '.join(line.split())[:140]}" for line in found[:3]]
            lines += [f"and {len(found) - 3} more {what}"] if len(found) > 3 else []
        return "\n".join(lines)


def read_datbox(folder, unmapped="error", *, state=None, step=None, plane="strain", light=None, near=None,
                materials=None, drained=False):  # fmt: skip
    """Reads an LMGC90 DATBOX folder as a scene. Bodies keep their order: body k of the file has the id k - 1.

    unmapped: for parts that Cairn cannot map: "error": raise LegacyError naming all of them, or "skip": leave them out with a
    warning that names all of them. state: a DOF.OUT file or an lmgc90.h5 with positions and velocities, instead of DOF.INI; step:
    number of the step in the .h5, None: the last. plane: kind of meshes in 2D, which is not in the files: "strain", "stress" or
    "axisymmetric" (about y, x the radius). light: density [kg/m3] of meshed bodies whose material has zero density: LMGC90 solves
    such a body in static equilibrium in each step, which a light body approaches with theta=1 and dt long against its periods.
    near: tolerance of the hulls of polyhedra that cannot be cut exactly into convex parts, over their size, 0.01 to 1, as for
    cairn.pre.convex_parts. materials: {name: material of solids} that meshed bodies have instead of those of the folder, for
    `USER_MAT`, `hyper`, `orth_` and others of a library that is not in the files; densities stay. drained: reads porous bodies
    (POROx) as their solid, without pressure in the pores. Scene.legacy holds texts on parts that were left out (`unmapped`) and
    on differences (`notes`), and the alert distance; a DATBOX holds no time step and no theta.

    Raises LegacyError (a ValueError) for files that are missing, cut short or not understood, with file, line and column.
    """
    if unmapped not in ("error", "skip"):
        raise ValueError(f"unmapped is {unmapped!r}: give 'error' or 'skip'")
    if plane not in ("strain", "stress", "axisymmetric"):
        raise ValueError(f"plane is {plane!r}: give 'strain', 'stress' or 'axisymmetric'")
    if light is not None:
        checks.positive("light", light)
    checks.flag("drained", drained)
    solid_options = {"plane": plane, "light": light, "replaced": mesh.replacements(materials), "drained": drained}
    try:
        return _read(folder, unmapped, state, step, near, solid_options)
    except LegacyError:
        raise
    except (ValueError, ArithmeticError, LookupError) as error:
        raise LegacyError(f"{folder}: cannot be made a scene: {error}") from error


def _read(folder, unmapped, state, step, near, solid_options):
    box = datbox.parse(folder, near)
    for name, value in solid_options.items():
        setattr(box, name, value)
    mesh.check_replacements(box)
    if state is not None:
        from .results import states_of

        box.states, box.state_file = states_of(state, step), str(state)
    origin = Origin(box, notes=list(box.notes))
    scene = Scene(dim=box.dim, gravity=box.gravity[: box.dim])
    _check_extras(origin)
    _choose_sides(box, origin)
    materials = {}
    for group in _groups(box, origin):
        scene.add(_set_of(box, group, materials, origin))
    if box.meshes:
        scene.add(mesh.deformables(box, materials, origin))
    _add_laws(scene, box, materials, origin)
    networks.add(scene, box, origin)
    if origin.unmapped:
        text = f"{box.folder}: Cairn has nothing to map this to: " + "; ".join(origin.unmapped)
        if unmapped == "error":
            raise LegacyError(text + ". Say unmapped='skip' to read the rest")
        warnings.warn(text, UnmappedWarning, stacklevel=3)
    scene.legacy = origin
    return scene


def _check_extras(origin):
    box = origin.datbox
    if box.initial_contacts:
        origin.notes.append(
            f"Vloc_Rloc.INI: {box.initial_contacts} contacts, whose forces are only the first guess of the solver"
        )
    for b in box.bodies:
        origin.notes += [f"BODIES.DAT, line {c.line}: {c.type} of {b.type} {b.number}: {c.note}" for c in b.contactors if c.note]
    for m in box.materials.values():
        if m.law != "RIGID" and not networks.properties(m) and any(b.material == m.name for b in box.bodies):
            origin.notes.append(f"material {m.name} ({m.law}): its density alone counts for rigid bodies")


def _choose_sides(box, origin):
    """Chooses the face of each PLANx that becomes an unbounded plane: the side of all bodies that it sees. A PLANx with bodies on
    both sides goes to origin.unmapped."""
    planes = [(b, c) for b in box.bodies for c in b.contactors if c.type == "PLANx"]
    centers = {}
    for body in box.bodies if planes else ():
        place, turn = _pose(box, body)
        for c in body.contactors:
            centers.setdefault((body.type, c.type, c.color), []).append((body.number, place + turn @ c.offset))
    for body, c in planes:
        place, turn = _pose(box, body)
        own = (body.type, c.type, c.color)
        seen = [x for key, found in centers.items() if any(_fits(see, own, key) for see in box.see)
                for number, x in found if number != body.number]  # fmt: skip
        if not seen:
            continue
        axis = turn[:, 2] if c.frame is None else turn @ c.frame[:, 2]
        height = (np.array(seen) - (place + turn @ c.offset)) @ axis
        if np.max(height) <= 0:
            c.side = -1.0
        elif np.min(height) < 0:
            origin.unmapped.append(
                f"PLANx of {body.type} {body.number}, which has bodies that it sees on both of its sides: give a POLYR "
                f"of its sizes (BODIES.DAT, line {c.line})"
            )


def _pose(box, body):
    state = box.states.get((body.type, body.number))
    if state is None:
        return body.position, body.frame
    return body.position + state.displacement[:3], state.frame


# ------------------------------------------------------------------ bodies


def _groups(box, origin):
    """[(bodies, drives)], each for a set: consecutive bodies without drives, or a single driven body."""
    groups = []
    for body in box.bodies:
        drives = box.drives.get((body.type, body.number), [])
        if groups and not drives and not groups[-1][1]:
            groups[-1][0].append(body)
        else:
            groups.append(([body], drives))
    known = {(b.type, b.number) for b in box.bodies}
    for (kind, number), state in box.states.items():
        if (kind, number) not in known:
            place = f"{box.state_file}, line {state.line}" if state.line else box.state_file
            raise LegacyError(f"{box.folder}: {place}: {kind} {number} is not in BODIES.DAT: give files of one run")
    return groups


def _set_of(box, group, materials, origin):
    members, drives = group
    dim, n = box.dim, len(members)
    dofs = 3 * dim - 3
    position, velocity = np.zeros((n, dim)), np.zeros((n, dofs))
    mass, inertia = np.zeros(n), np.zeros((n, 1 if dim == 2 else 3))
    rotation = np.zeros(n) if dim == 2 else np.tile([1.0, 0, 0, 0], (n, 1))
    for k, body in enumerate(members):
        still = _cannot_turn(drives, dim)
        mass[k], inertia[k] = _mass(box, body, still)
        position[k] = body.position[:dim]
        state = box.states.get((body.type, body.number))
        if dim == 2:
            rotation[k] = body.angle
        elif state is None:
            rotation[k] = quaternion_of(body.frame)
        if state is None:
            continue
        position[k] += state.displacement[:dim]
        velocity[k] = state.velocity
        if dim == 2:
            rotation[k] += state.displacement[2]
        elif body.own_axes and still:  # it cannot rotate: keeps the axes of its contactors
            rotation[k] = quaternion_of(body.frame)
        elif body.own_axes:
            raise LegacyError(
                f"{_place(box, body)}: {body.type} {body.number} has no moments I1, I2, I3, and {box.state_file} its axes: which "
                "of its principal axes these are is not told; give the moments, with vertices in these axes"
            )
        else:
            velocity[k, 3:] = state.frame @ state.velocity[3:]
            rotation[k] = quaternion_of(state.frame)
    options = _driven(box, members, drives, dofs) if drives else {}
    turned = np.any(rotation) if dim == 2 else np.any(rotation != [1.0, 0, 0, 0])
    bounded = all(c.type in ("DISKx", "SPHER") for b in members for c in b.contactors)
    if turned or not bounded:
        options["rotation"] = rotation
    contactors = _contactors(box, members, materials, origin)
    if np.any(~np.isfinite(mass)) and not drives:
        k = int(np.argmax(~np.isfinite(mass)))
        raise LegacyError(
            f"{_place(box, members[k])}: {members[k].type} {members[k].number} has no mass, neither its own avrd nor its "
            "contactors', and none of its dofs is driven: give avrd, or drive its dofs in DRV_DOF.DAT"
        )
    return bodies.checked(
        bodies.BodySet(dim, position, mass, inertia, contactors, velocity=velocity if np.any(velocity) else None, **options)
    )


def _place(box, body):
    return f"{box.folder / 'BODIES.DAT'}, line {body.line}"


def _cannot_turn(drives, dim):
    """True if all rotations are held at zero."""
    held = {d.component for d in drives if d.kind == "vlocy" and d.table is None and d.numbers[0] == 0 and d.numbers[1] == 0}
    return held >= ({3} if dim == 2 else {4, 5, 6})


def _mass(box, body, still):
    """(mass [kg], moments [kg m2]) of a body. still: it cannot rotate, so that moments may be missing."""
    if body.material not in box.materials:
        raise LegacyError(
            f"{_place(box, body)}: {body.type} {body.number} is of {body.material!r}, which BULK_BEHAV.DAT does not have; "
            f"it has {', '.join(box.materials)}"
        )
    material = box.materials[body.material]
    if material.density is None or not material.density > 0:
        raise LegacyError(
            f"{box.folder / 'BULK_BEHAV.DAT'}, line {material.line}: material {body.material} of {body.type} {body.number} has "
            "no density Umas= above 0"
        )
    mass, moments = material.density * body.measure, [material.density * m for m in body.moments]
    if not mass > 0:
        return np.inf, [np.inf] * len(moments)
    if not min(moments) > 0 and still:
        return mass, [np.inf] * len(moments)
    if not min(moments) > 0:
        raise LegacyError(f"{_place(box, body)}: {body.type} {body.number} has a mass and no moment of inertia: give its gyrd")
    return mass, moments


def quaternion_of(frame):
    """(w, x, y, z) of a rotation matrix (3, 3), body to space, from its largest component (Shepperd 1978)."""
    m = np.asarray(frame, float)
    diagonal = np.diag(m)
    k = int(np.argmax(diagonal))
    if np.trace(m) > diagonal[k]:
        q = np.array([1 + np.trace(m), m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    else:
        i, j = (k + 1) % 3, (k + 2) % 3
        q = np.zeros(4)
        q[0] = m[j, i] - m[i, j]
        q[1 + k] = 1 + m[k, k] - m[i, i] - m[j, j]
        q[1 + i] = m[i, k] + m[k, i]
        q[1 + j] = m[j, k] + m[k, j]
    return q / np.linalg.norm(q)


# ------------------------------------------------------------------ driven dofs


def _driven(box, members, drives, dofs):
    names = bodies.DOFS[box.dim]
    velocity, force = [0.0] * dofs, [0.0] * dofs
    driven = []
    for d in drives:
        where = f"{box.folder / 'DRV_DOF.DAT'}, line {d.line}: body {members[0].number}"
        if not 1 <= d.component <= dofs:
            raise LegacyError(f"{where} drives dof {d.component}; a body of {box.dim}D has {dofs}")
        if d.kind not in ("vlocy", "force"):
            raise LegacyError(f"{where} drives by {d.kind!r}; vlocy or force was expected")
        if any(x.component == d.component and x.kind == d.kind for x in drives if x.line < d.line):
            raise LegacyError(f"{where} drives dof {d.component} twice by {d.kind}; give it once")
        value = function_of(d)
        if d.kind == "vlocy":
            velocity[d.component - 1] = value
            driven.append(names[d.component - 1])
        else:
            force[d.component - 1] = value
        turning = box.dim == 3 and d.component > 3 and (callable(value) or value != 0)
        if turning and len([x for x in drives if x.component > 3]) < 3:
            raise LegacyError(f"{where} turns about an axis of its own while others are free: that is not mapped")
    options = {"driven": tuple(driven)} if driven else {}
    if driven:
        options["drive"] = _together(velocity)
    if any(callable(f) or f != 0 for f in force):
        options["force"] = _together(force)
    return options


def _together(parts):
    return time_functions.Components(parts) if any(callable(p) for p in parts) else np.array(parts, float)


# ------------------------------------------------------------------ contactors and laws


def _contactors(box, members, materials, origin):
    """Contactor sets of the members, for each shape, material and colour."""
    found = {}
    for k, body in enumerate(members):
        for c in body.contactors:
            shape = _shape(c)
            if shape is None:
                what = f"contactor {c.type} of {body.type} {body.number} (BODIES.DAT, line {c.line})"
                same = next((i for i, t in enumerate(origin.unmapped) if t.startswith(f"contactor {c.type} of")), None)
                if same is None:
                    origin.unmapped.append(what)
                elif not origin.unmapped[same].endswith("others"):
                    origin.unmapped[same] += " and others"
                continue
            if c.type == "CYLND" and c.frame is not None and not any("CYLND" in note for note in origin.notes):
                origin.notes.append("CYLND with localframe: along its own axis, also where it meets spheres, for which LMGC90 "
                                    "takes the third axis of the body")  # fmt: skip
            if c.type == "PLANx" and not any("PLANx" in note for note in origin.notes):
                origin.notes.append(
                    "PLANx: a plane without end through the face towards what it meets, its other sides are left out"
                )
            name = f"{body.material} {c.color} {c.type}"
            if name not in materials:
                materials[name] = (body.type, c.type, c.color)
            for vertices, faces in c.parts or [(c.vertices, c.faces)]:
                part = (vertices, faces, body, c)
                found.setdefault((name, body.material, shape[0]), []).append((k, *shape[1:], part))
    sets = []
    for (name, material, shape), rows in found.items():
        owner, radius, offset, direction, given = zip(*rows)
        hulls = which = None
        if shape in ("polygon", "polyhedron"):
            hulls, which = _hulls(box, given), np.arange(len(rows))
        elif shape == "capsule":
            size, half = (np.array([part[-1].sizes[label] for part in given]) for label in ("byrd", "High"))
            axis = [np.eye(3)[2] if part[-1].frame is None else part[-1].frame[:, 2] for part in given]
            hulls, which = round_shapes._axial(size, 2 * half, half + size, _unit(axis))
        sets.append(
            bodies.ContactorSet(
                shape,
                Material(name, density=box.materials[material].density, **networks.properties(box.materials[material])),
                np.array(owner),
                np.array(radius, float),
                np.array(offset, float) if np.any(offset) else None,
                None if direction[0] is None else np.array(direction, float),
                which,
                hulls,
            )
        )
    return sets


def _hulls(box, parts):
    """Hulls of POLYG and POLYR, in the axes of their bodies. Raises LegacyError naming a shape that the core refuses."""
    corners = [vertices for vertices, *_ in parts]
    faces = [[] if faces is None else [np.asarray(f, np.int64) for f in faces] for _, faces, *_ in parts]
    flat = [f for each in faces for f in each]
    sizes = [len(f) for f in flat]
    count = len(flat)
    hulls = Hulls(
        np.concatenate(corners),
        shapes._starts(corners),
        shapes._starts(faces) if count else np.zeros(0, np.int64),
        np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64) if count else np.zeros(0, np.int64),
        np.concatenate(flat) if count else np.zeros(0, np.int64),
    )
    try:
        _core.Scene(box.dim).add_hulls(*hulls[:5], False, hulls.plane.reshape(-1), hulls.ball)
    except ValueError as error:
        found = re.match(r"hull (\d+): (.*)", str(error), re.S)
        if found is None:
            raise
        _, _, body, c = parts[int(found[1])]
        raise LegacyError(
            f"{box.folder / 'BODIES.DAT'}, line {c.line}: contactor {c.type} of {body.type} {body.number}: {found[2]}"
        ) from error
    return hulls


def _unit(vectors):
    """Vectors (n, 3) of length 1, which the digits of a file keep to 1e-7."""
    x = np.array(vectors, float)
    return x / np.linalg.norm(x, axis=1)[:, None]


def _shape(c):
    """(shape, radius [m], offset [m], direction) of a contactor, or None without a counterpart."""
    offset, axis = c.offset, np.array([0.0, 0.0, 1.0]) if c.frame is None else c.frame[:, 2]
    if c.type in ("DISKx", "SPHER"):
        return "disk" if c.type == "DISKx" else "sphere", c.sizes["byrd"], offset, None
    if c.type in ("PT2Dx", "PT3Dx"):
        return "disk" if c.type == "PT2Dx" else "sphere", 0.0, offset, None
    if c.type == "xKSID":
        return "ring", c.sizes["byrd"], offset, None
    if c.type == "JONCx":
        return "segment", c.sizes["axe2"], offset, (1.0, 0.0, c.sizes["axe1"])
    if c.type == "PLANx":
        axis = axis * c.side
        return "plane", 0.0, offset + c.sizes["axe3"] * axis, (*axis, 0.0)
    if c.type in ("POLYG", "POLYR"):
        return "polygon" if c.type == "POLYG" else "polyhedron", 0.0, offset, None
    if c.type == "CYLND":
        return "capsule", 0.0, offset, None
    if c.type == "DNLYC":
        return "tube", c.sizes["byrd"], offset, (0.0, 0.0, 1.0, c.sizes["High"])
    return None


def _add_laws(scene, box, materials, origin):
    scene.interact("*", "*", None)
    mapped = {}
    for name, law in box.laws.items():
        if not any(s.law == name and _sides(s, materials) for s in box.see):
            continue
        try:
            made, refused, notes = law_of(law, max((see.alert for see in box.see if see.law == name), default=0.0), scene.dim)
        except ValueError as error:
            raise LegacyError(f"{box.folder / 'TACT_BEHAV.DAT'}, line {law.line}: law {name} ({law.law}): {error}") from error
        origin.unmapped += [f"{text} (TACT_BEHAV.DAT, line {law.line})" for text in refused]
        origin.notes += notes
        if made is not None:
            mapped[name] = made
    known = set()
    for see in box.see:  # the first see table for a pair of contactors counts
        pairs = _sides(see, materials)
        if see.law in mapped and pairs:
            origin.alert = max(origin.alert, see.alert)
        for a, b in pairs:
            _check_meets(origin, see, materials[a], materials[b])
            if frozenset((a, b)) not in known and see.law in mapped:
                scene.interact(a, b, mapped[see.law])
            known.add(frozenset((a, b)))


def _check_meets(origin, see, one, other):
    """Adds contacts of sides of meshes with other shapes than round bodies, polygons, polyhedra and points of meshes to
    origin.unmapped."""
    for side, (_, kind, _) in ((one, other), (other, one)):
        if side[1] in ("ALpxx", "ASpxx") and kind not in ("DISKx", "SPHER", "POLYG", "POLYR", "CLxxx", "CSxxx"):
            text = f"contacts of {kind} with {side[1]} of a mesh (TACT_BEHAV.DAT, line {see.line})"
            if text not in origin.unmapped:
                origin.unmapped.append(text)


def _sides(see, materials):
    """Pairs of materials to which a see table applies, by bodies, contactors and colours, in either order."""
    wanted = [{one, other} for one, other in zip(_plain(see.candidate), _plain(see.antagonist))]
    fit = [n for n, key in materials.items() if all(word in w for word, w in zip(key, wanted))]
    pairs = [(a, b) for k, a in enumerate(fit) for b in fit[k:]]
    return [(a, b) for a, b in pairs if _fits(see, materials[a], materials[b])]


def _fits(see, one, other):
    sides = zip(one, other, _plain(see.candidate), _plain(see.antagonist))
    return all({x, y} == {p, q} for x, y, p, q in sides)


def _plain(side):
    body, contactor, color = side
    return body, SHORT.get(contactor, contactor), color
