"""Rigid bodies of BODIES.DAT; mass, centre and axes follow from the contactors where the file leaves them open."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..pre import mass_properties, mesh
from ..pre.decompose import convex_parts
from .polyhedra import turned_alike
from .text import LegacyError

DIMENSION = {"RBDY2": 2, "RBDY3": 3}

# Sizes of contactors in their order on the line, in columns 35-48, 56-69, 77-90; labels are ignored.
SIZES = {
    "DISKx": ("byrd",),
    "DISKb": ("byrd",),
    "xKSID": ("byrd",),
    "SPHER": ("byrd",),
    "SPHEb": ("byrd",),
    "JONCx": ("axe1", "axe2"),
    "PLANx": ("axe1", "axe2", "axe3"),
    "CYLND": ("High", "byrd"),
    "DNLYC": ("High", "byrd"),
}
KINDS = {
    "RBDY2": ("DISKx", "xKSID", "JONCx", "POLYG", "PT2Dx", "DISKb"),
    "RBDY3": ("SPHER", "CYLND", "DNLYC", "POLYR", "PLANx", "PT3Dx", "SPHEb", "POLYF"),
}
SHORT = {"DISKb": "DISKx", "SPHEb": "SPHER"}  # names in see tables
DIGITS = 5e-7  # relative rounding of numbers with eight digits, the first of which may be 0
FLAT = 1e-7  # largest bend of a flat face over its size, as in the core
ROUND = 1 - 3 / np.pi  # share of volume that a prism of twelve sides, the coarsest model of a cylinder, lacks


@dataclass
class Contactor:
    """A contactor of a body, in the frame of the body once that is complete; line: where it starts in the file."""

    type: str
    color: str
    sizes: dict = field(default_factory=dict)  # byrd, axe1, ... [m]
    offset: np.ndarray | None = None  # of its centre from that of the body [m]
    frame: np.ndarray | None = None  # (3, 3), its own axes as columns, None if they are those of the body
    vertices: np.ndarray | None = None  # from its centre [m]
    faces: np.ndarray | None = None  # from 0
    parts: list = field(default_factory=list)  # convex (vertices, faces) of a polyhedron that is not convex
    note: str = ""  # text on a difference from the file
    line: int = 0
    side: float = 1.0  # for PLANx: +1 or -1 for the face at +axe3 or -axe3 that has contacts


@dataclass
class RigidBody:
    """A body of type RBDY2 or RBDY3. number: its rank in the file. radius: avrd [m], gyration: gyrd [m], moments: (I1, I2, I3)
    per unit density [m5], from the file or, if it leaves them open, from the contactors; measure: area or volume, mass over
    density."""

    type: str
    number: int
    line: int = 0
    material: str = ""
    radius: float = 0.0
    gyration: float = 0.0
    moments: tuple = ()
    measure: float = 0.0
    position: tuple = ()
    angle: float = 0.0  # in 2D [rad]
    frame: np.ndarray | None = None  # principal axes in 3D as columns, before any motion
    own_axes: bool = False  # True: the axes are not from the file; their order and senses are chosen by this reader
    contactors: list = field(default_factory=list)


def read_body(reader, kind, number, line):
    """Reads a RigidBody, from the line after its header on."""
    body, part = RigidBody(kind, number, line), ""
    while True:
        line = reader.next()
        if line[1:6] == "$$$$$":
            break
        if line[1:6] == "bdyty":
            reader.fail(f"{kind} {number} has no end; the line $$$$$$ was expected")
        if line.startswith("$"):
            part = line[1:6]
        elif part == "blmty":
            _bulk(reader, line, body)
        elif part == "nodty":
            _node(reader, line, body)
        elif part == "tacty":
            body.contactors.append(_contactor(reader, line, body))
        else:
            reader.fail(f"{line.strip()!r} stands in no block of the body")
    for what, missing in (("$blmty", not body.material), ("$nodty", len(body.position) == 0), ("$tacty", not body.contactors)):
        if missing:
            reader.fail(f"{kind} {number} has nothing in its block {what}")
    return body


def _bulk(reader, line, body):
    if body.material or line[1:6] != "PLAIN":
        reader.fail(f"bulk {line[1:6]!r} of {body.type} {body.number}: one line PLAIN was expected")
    body.material = line[22:27].strip()
    if body.type == "RBDY2":
        body.radius, body.gyration = reader.values(line, 2, blank=0.0)
    else:
        body.radius = reader.number(line, 35, 48, blank=0.0)
        # the line of the moments is optional
        body.moments = tuple(reader.values(reader.next(), 3)) if reader.line[29:31] == "I1" else (0.0, 0.0, 0.0)
    if body.radius < 0 or body.gyration < 0 or any(m < 0 for m in body.moments):
        reader.fail(f"{body.type} {body.number} has a radius or a moment below 0")


def _node(reader, line, body):
    expected = "NO3xx" if body.type == "RBDY2" else "NO6xx"
    if len(body.position) or line[1:6] != expected:
        reader.fail(f"node {line[1:6]!r} of {body.type} {body.number}: one {expected} was expected")
    body.position = np.array(reader.values(line, 3))
    if body.type == "RBDY3":
        reader.next()  # angles, not used in 3D


def _contactor(reader, line, body):
    c = Contactor(line[1:6].strip(), line[22:27].strip(), line=reader.number_of_line)
    if c.type not in KINDS[body.type]:
        reader.fail(f"contactor {c.type!r} is none of {body.type}: {', '.join(KINDS[body.type])}")
    c.offset = np.zeros(DIMENSION[body.type])
    if c.type == "POLYG":
        count = reader.whole(line, 40, 46)
        c.vertices = np.array([reader.values(reader.next(), 2) for _ in range(count)])
        _centre_polygon(reader, body, c)
    elif c.type == "POLYR":
        c.vertices, c.faces = _surface(reader, line)
    elif c.type == "POLYF":
        _patches(reader, line, c)
    elif c.type in ("PT2Dx", "PT3Dx"):
        c.offset = np.array(reader.values(line, DIMENSION[body.type]))
    else:
        names = SIZES[c.type]
        c.sizes = dict(zip(names, reader.values(line, len(names))))
        if min(c.sizes.values()) <= 0 and not (c.type == "JONCx" and c.sizes["axe2"] > 0 and c.sizes["axe1"] == 0):
            reader.fail(f"contactor {c.type} of {body.type} {body.number} has a size that is not above 0")
    if c.type in ("DISKb", "SPHEb"):
        c.offset = np.array(reader.values(reader.next(), DIMENSION[body.type]))
        c.type = SHORT[c.type]
    elif c.type in ("PLANx", "CYLND") and reader.line[29:39] == "localframe":
        reader.next()
        c.frame = np.array([reader.values(reader.next(), 3) for _ in range(3)]).T
        if np.max(np.abs(c.frame.T @ c.frame - np.eye(3))) > 1e-4:
            reader.fail("the rows of localframe are no axes of length 1 square to each other")
        c.offset = np.array(reader.values(reader.next(), 3))
    return c


def _patches(reader, line, c):
    """A polyhedron in several patches becomes one: vertices of patches that coincide, to the digits of the file, are one.
    It is a POLYR from then on, as it is in see tables."""
    found = [_surface(reader, reader.next()) for _ in range(reader.whole(line, 40, 47))]
    if not found:
        reader.fail("a POLYF has no patch; one or more were expected")
    first = np.cumsum([0, *(len(v) for v, _ in found[:-1])])
    vertices = np.concatenate([v for v, _ in found])
    faces = np.concatenate([f + start for (_, f), start in zip(found, first)])
    size = np.max(np.ptp(vertices, axis=0), initial=0.0)
    rounding = 2 * DIGITS * np.max(np.abs(vertices), initial=0.0)
    c.vertices, c.faces = mesh.weld(vertices, faces, rounding / size) if size > 0 else (vertices, faces)
    c.type, c.note = "POLYR", f"its {len(found)} patches are one surface, and it is a POLYR"


def _surface(reader, line):
    """Vertices and triangles of a polyhedron."""
    count, triangles = reader.whole(line, 40, 47), reader.whole(line, 60, 67)
    vertices = np.array([reader.values(reader.next(), 3) for _ in range(count)])
    faces = np.zeros((max(triangles, 0), 3), int)
    for k in range(triangles):
        row = reader.next()
        faces[k] = [reader.whole(row, s, s + 12) - 1 for s in (35, 56, 77)]
        if np.min(faces[k]) < 0 or np.max(faces[k]) >= count:
            reader.fail(f"a face has vertices {', '.join(str(f + 1) for f in faces[k])}; there are 1 to {count}")
    return vertices, faces


# ------------------------------------------------------------------ mass properties from contactors


def completed(reader, body, near=None):
    """Completes a body with centre, mass and principal axes as LMGC90 does after reading, and moves its contactors into these
    axes. near: as for cairn.pre.convex_parts."""
    if body.type == "RBDY2":
        _complete_2d(body)
    else:
        for c in body.contactors:
            if c.type == "POLYR":
                _centre_polyhedron(reader, body, c, near)
        if len(body.contactors) == 1:
            _complete_alone(body, body.contactors[0])
        else:
            _complete_several(reader, body)
    return body


def _refuse(reader, body, c, text):
    raise LegacyError(f"{reader.path}, line {c.line}: contactor {c.type} of {body.type} {body.number} {text}")


def _centre_polygon(reader, body, c):
    """Moves the origin of the vertices to their centroid, which becomes the offset. Raises LegacyError for a wrong polygon."""
    if len(c.vertices) < 3:
        _refuse(reader, body, c, f"has {len(c.vertices)} vertices; three or more were expected")
    try:
        found = mass_properties.polygons([c.vertices])
    except ValueError:
        _refuse(reader, body, c, "has no area, or its vertices run clockwise, which LMGC90 refuses: list them anticlockwise")
    edge = np.roll(c.vertices, -1, axis=0) - c.vertices
    corner = edge[:, 0] * np.roll(edge, -1, axis=0)[:, 1] - edge[:, 1] * np.roll(edge, -1, axis=0)[:, 0]
    if np.min(corner) < -FLAT * np.max(np.ptp(c.vertices, axis=0)) ** 2:
        _refuse(reader, body, c, "is not convex; give convex ones, several in one body")
    c.offset = found.center[0]
    c.vertices = c.vertices - c.offset
    c.sizes = {"area": found.measure[0], "polar": found.moments[0, 0]}


def _flat_measures(c):
    """(area [m2], polar moment [m4]) of a contactor in 2D, as in LMGC90."""
    if c.type == "DISKx":
        area = np.pi * c.sizes["byrd"] ** 2
        return area, area * c.sizes["byrd"] ** 2 / 2
    if c.type == "JONCx":
        a, b = c.sizes["axe1"], c.sizes["axe2"]
        return 4 * a * b + np.pi * b * b, np.pi * b * b * (a * a + b * b / 2) + 2 * a * b * (a * a + b * b)
    if c.type == "POLYG":
        return c.sizes["area"], c.sizes["polar"]
    return 0.0, 0.0


def _complete_2d(body):
    unplaced = not np.any(body.position)
    body.angle = 0.0 if unplaced else body.position[2]
    open_mass = body.radius == 0 or body.gyration == 0
    center, parts = body.position[:2], body.contactors
    measures = np.array([_flat_measures(c) for c in parts])
    shifts = np.array([c.offset for c in parts])
    if len(parts) == 1:
        # LMGC90 takes an offset of the centre below a millimetre for rounding
        if unplaced or shifts[0] @ shifts[0] >= 1e-6:
            center = center + shifts[0]
        shifts = np.zeros((1, 2))
    elif unplaced and np.any(measures[:, 0]):
        center = measures[:, 0] @ shifts / np.sum(measures[:, 0])
        shifts = shifts - center
    for c, shift in zip(parts, shifts):
        c.offset = shift
    body.position = np.array([*center, 0.0])
    if open_mass:
        area = np.sum(measures[:, 0])
        polar = np.sum(measures[:, 1] + measures[:, 0] * np.sum(shifts * shifts, axis=1))
        body.radius = float(np.sqrt(area / np.pi))
        body.gyration = float(np.sqrt(polar / area)) if area > 0 else 0.0
    body.measure = np.pi * body.radius**2
    body.moments = (body.measure * body.gyration**2,)


def _centre_polyhedron(reader, body, c, near):
    """Orients faces outward, moves the origin of the vertices to their centre, which becomes the offset, and cuts a polyhedron
    that is not convex into convex parts. Raises LegacyError if that fails."""
    if len(c.vertices) < 4 or len(c.faces) < 4:
        text = f"has {len(c.vertices)} vertices and {len(c.faces)} faces; four or more of each were expected"
        _refuse(reader, body, c, text)
    why = turned_alike(c.vertices, c.faces)
    if why:
        _refuse(reader, body, c, f"is no polyhedron: {why}")
    try:
        found = mass_properties.polyhedra([c.vertices], [c.faces])
    except ValueError:
        _refuse(reader, body, c, "has no volume")
    c.sizes = {"volume": found.measure[0], "moments": found.moments[0], "axes": found.axes[0]}
    c.offset = found.center[0]
    rounding = DIGITS * np.max(np.abs(c.vertices))
    c.vertices = c.vertices - c.offset
    if not mesh.is_convex(c.vertices, c.faces, FLAT) and not _hulled(c, rounding):
        try:
            c.parts = convex_parts(c.vertices, c.faces, **({} if near is None else {"near": near}))
        except ValueError as error:
            if _stretched(c, rounding):
                return
            _refuse(reader, body, c, f"is not convex, and is not cut into convex parts: {error}")


def _hulled(c, rounding):
    """True if a polyhedron is not convex by rounding of the file [m] alone; it is then replaced by its hull."""
    points, faces = mesh.hull(c.vertices)
    a, b, d = (points[faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, d - a), axis=1).sum() / 2
    more = mass_properties.polyhedra([points], [faces]).measure[0] - c.sizes["volume"]
    if more > rounding * area:
        return False
    c.vertices, c.faces = points, faces
    return True


def _stretched(c, rounding):
    """True if all vertices of a polyhedron lie on their hull to rounding [m], and only its faces run inside, as for a cylinder
    with badly chosen triangles. It is then replaced by its hull, with the mass of the faces of the file. To exclude frames, whose
    vertices are on their hull too, the surface must have no hole (Euler characteristic 2), and must not lack more of the hull's
    volume than ROUND."""
    if len(np.unique(c.faces)) - len(c.faces) // 2 != 2:
        return False
    points, faces = mesh.hull(c.vertices)
    if c.sizes["volume"] < (1 - ROUND) * mass_properties.polyhedra([points], [faces]).measure[0]:
        return False
    a, b, d = (points[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, d - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    depth = -np.max(c.vertices @ normal.T - np.sum(normal * a, axis=1), axis=1)
    if np.max(depth) > 4 * rounding:
        return False
    within = -np.max(c.vertices[c.faces].mean(axis=1) @ normal.T - np.sum(normal * a, axis=1), axis=1)
    c.note = f"its faces run up to {np.max(within):.2g} m within the hull of their vertices, which is what touches"
    c.vertices, c.faces = points, faces
    return True


def _solid_measures(c):
    """(volume [m3], moments about its own axes [m5], these axes) of a contactor in 3D, as in LMGC90."""
    axes = np.eye(3) if c.frame is None else c.frame
    if c.type == "POLYR":
        return c.sizes["volume"], c.sizes["moments"], c.sizes["axes"]
    if c.type == "SPHER":
        volume = 4 / 3 * np.pi * c.sizes["byrd"] ** 3
        return volume, np.full(3, 0.4 * c.sizes["byrd"] ** 2 * volume), axes
    if c.type == "PLANx":
        a, b, e = c.sizes["axe1"], c.sizes["axe2"], c.sizes["axe3"]
        return 8 * a * b * e, 8 * a * b * e / 3 * np.array([b * b + e * e, a * a + e * e, a * a + b * b]), axes
    if c.type in ("CYLND", "DNLYC"):
        square, half = c.sizes["byrd"] ** 2, c.sizes["High"]
        volume = 2 * np.pi * square * half
        return volume, volume * np.array([square / 4 + half**2 / 3] * 2 + [square / 2]), axes
    return 0.0, np.zeros(3), axes


def _moved(c, turn, offset):
    """Moves a contactor into axes that are the columns of `turn`, with its centre at an offset in these [m]."""
    c.offset = offset
    if c.vertices is not None:
        c.vertices = c.vertices @ turn
        c.parts = [(v @ turn, f) for v, f in c.parts]
    if c.frame is not None or (c.type == "PLANx" and np.any(turn != np.eye(3))):
        c.frame = turn.T @ (np.eye(3) if c.frame is None else c.frame)


def _complete_alone(body, c):
    volume, moments, axes = _solid_measures(c)
    given = any(body.moments)
    if c.type == "POLYR" and given:
        moments, axes = np.array(body.moments), np.eye(3)
    elif c.type == "PT3Dx":
        moments = np.array(body.moments)
    if body.radius == 0:
        body.radius = float(np.cbrt(0.75 * volume / np.pi))
        body.measure = volume
    else:
        body.measure = 4 / 3 * np.pi * body.radius**3
    body.moments = tuple(moments)
    body.position = body.position + c.offset
    body.frame = axes
    if c.type == "POLYR":
        body.own_axes = bool(np.any(axes != np.eye(3)))
        _moved(c, axes, np.zeros(3))
    c.frame, c.offset = None, np.zeros(3)


def _complete_several(reader, body):
    measures = [_solid_measures(c) for c in body.contactors]
    volumes = np.array([m[0] for m in measures])
    total = np.sum(volumes)
    if not total > 0:
        reader.fail(f"{body.type} {body.number} has contactors without volume only")
    shifts = np.array([c.offset for c in body.contactors])
    center = volumes @ shifts / total
    shifts = shifts - center
    body.measure = total
    if body.radius == 0:
        body.radius = float(np.cbrt(0.75 * total / np.pi))
    body.position = body.position + center
    turn = np.eye(3)
    if not any(body.moments):
        tensor = np.zeros((3, 3))
        for (volume, moments, axes), d in zip(measures, shifts):
            tensor += axes @ np.diag(moments) @ axes.T + volume * (d @ d * np.eye(3) - np.outer(d, d))
        moments, axes = mass_properties.principal(tensor[None])
        body.moments, turn = tuple(moments[0]), axes[0]
    body.frame, body.own_axes = turn, bool(np.any(turn != np.eye(3)))
    for c, shift in zip(body.contactors, shifts):
        if c.type in ("CYLND", "DNLYC") and np.any(turn != np.eye(3)):
            _refuse(reader, body, c, "is not along a principal axis of its body, where LMGC90 turns it: give I1, I2 and I3")
        _moved(c, turn, shift @ turn)
