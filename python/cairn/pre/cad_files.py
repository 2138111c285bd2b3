"""Solids of CAD (STEP, by gmsh) and of building models (IFC, by ifcopenshell), converted from the unit of the file to metres."""

from __future__ import annotations

import re
import signal
import threading

import numpy as np

from . import mesh
from .mesh_repair import turned_outward

NOT_SOLID = ("IfcOpeningElement", "IfcSpace", "IfcSite", "IfcAnnotation", "IfcGrid", "IfcVirtualElement")
AROUND = 24  # facets in a full turn of a curved surface


def read_step(path):
    """Skins of the solids of a STEP file, [(vertices (n, 3) [m], triangles (m, 3), name)]: flat faces by few triangles, curved
    ones by 24 facets around; and the unit that the file tells, "" for none."""
    gmsh = mesh.library("gmsh", "to read STEP files")
    gmsh.initialize([], readConfigFiles=False, interruptible=False)
    # gmsh lets a broken pipe end the program; in Python it is an error like others
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGPIPE, signal.getsignal(signal.SIGPIPE) or signal.SIG_IGN)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        # millimetres are gmsh's own unit: any other would persist and change the files that it writes later
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", AROUND)
        try:
            gmsh.model.occ.importShapes(str(path))
            gmsh.model.occ.synchronize()
            for _, curve in gmsh.model.getEntities(1):
                if gmsh.model.getType(1, curve) == "Line":  # no corners but those of the drawing
                    gmsh.model.mesh.setTransfiniteCurve(curve, 2)
            gmsh.model.mesh.generate(2)
        except Exception as error:  # gmsh raises Exception itself
            raise ValueError(f"{path.name} cannot be read as STEP: {error}") from None
        return [_skin(gmsh, tag) for _, tag in gmsh.model.getEntities(3)], unit_of_step(path.read_text(errors="replace"))
    finally:
        gmsh.finalize()


def unit_of_step(text):
    """The unit of length in the contexts of a STEP file (ISO 10303-41): "millimetre", "inch", ...; "" if they name none."""
    entity = dict(re.findall(r"#(\d+)\s*=\s*(\([^;]*LENGTH_UNIT[^;]*);", text))
    named = []
    for units in re.findall(r"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(([^)]*)\)", text):
        for number in re.findall(r"#(\d+)", units):
            own = entity.get(number, "")
            si = re.search(r"SI_UNIT\s*\(\s*(?:\.(\w+)\.|\$)\s*,\s*\.(\w+)\.", own)
            other = re.search(r"CONVERSION_BASED_UNIT\s*\(\s*'([^']*)'", own)
            if other or si:
                named.append((other[1] if other else (si[1] or "") + si[2]).lower())
    return " and ".join(dict.fromkeys(named))


def _skin(gmsh, volume):
    """Corners, triangles turned outward and name of a solid."""
    tags, places, _ = gmsh.model.mesh.getNodes()
    order, places = np.argsort(tags), 1e-3 * np.asarray(places).reshape(-1, 3)
    triangles = []
    for _, face in gmsh.model.getBoundary([(3, volume)], oriented=False):
        kinds, _, nodes = gmsh.model.mesh.getElements(2, face)
        for kind, of_kind in zip(kinds, nodes):
            if kind == 2:
                found = order[np.searchsorted(tags, np.asarray(of_kind), sorter=order)].reshape(-1, 3)
                triangles.append(_plain(places, found) if gmsh.model.getType(2, face) == "Plane" else found)
    if not triangles:
        return np.zeros((0, 3)), np.zeros((0, 3), np.int64), ""
    used, faces = np.unique(np.concatenate(triangles), return_inverse=True)
    points = places[used]
    return points, turned_outward(points, faces.reshape(-1, 3)), gmsh.model.getEntityName(3, volume).rpartition("/")[2]


def _plain(points, triangles):
    """Triangles of a plane face with the corners of its rim alone, where it is convex; the meshed ones else."""
    edges = {(int(t[i]), int(t[i - 2])) for t in triangles for i in range(3)}
    after = {p: q for p, q in edges if (q, p) not in edges}
    loop = [next(iter(after))]
    while after[loop[-1]] != loop[0] and len(loop) <= len(after):
        loop.append(after[loop[-1]])
    if len(loop) != len(after):
        return triangles  # with a hole in it
    x = points[loop]
    edge = np.roll(x, -1, axis=0) - x
    turns = np.cross(edge, np.roll(edge, -1, axis=0))
    whole = turns.sum(axis=0)
    if np.any(turns @ whole < -1e-12 * (whole @ whole)):
        return triangles
    return np.array([(loop[0], loop[k], loop[k + 1]) for k in range(1, len(loop) - 1)], np.int64)


def read_ifc(path):
    """Surfaces of the elements of an IFC file that are solid, and its unit, as read_step gives them; openings are cut, spaces
    left out."""
    ifcopenshell = mesh.library("ifcopenshell", "to read IFC files")
    geom = mesh.library("ifcopenshell.geom", "to read IFC files")
    try:
        model = ifcopenshell.open(str(path))
        settings = geom.settings()
        settings.set("use-world-coords", True)
        settings.set("weld-vertices", True)
        wanted = [e for e in model.by_type("IfcElement") if e.Representation and not any(e.is_a(kind) for kind in NOT_SOLID)]
        found = []
        iterator = geom.iterator(settings, model, 1, include=wanted) if wanted else None
        more = iterator is not None and iterator.initialize()
        while more:
            shape = iterator.get()
            corners = np.array(shape.geometry.verts, float).reshape(-1, 3)
            found.append((corners, np.array(shape.geometry.faces, np.int64).reshape(-1, 3), shape.name or ""))
            more = iterator.next()
        units = [unit for assigned in model.by_type("IfcUnitAssignment") for unit in assigned.Units]
        lengths = [unit for unit in units if getattr(unit, "UnitType", None) == "LENGTHUNIT"]
        named = [((getattr(unit, "Prefix", None) or "") + unit.Name).lower() for unit in lengths]
    except Exception as error:
        told = f"{type(error).__name__}: {error}"
        raise ValueError(f"{path.name} cannot be read as IFC: {told}; export it anew, or as STL or OBJ") from None
    if not found:
        raise ValueError(f"{path.name} holds no element that is solid: give one with walls, slabs, beams, proxies as bodies")
    return found, " and ".join(dict.fromkeys(named))
