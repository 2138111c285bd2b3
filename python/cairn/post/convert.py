"""Writes a run in other formats: .csv, .npz, plain .h5, series of .vtp or .vtu."""

import csv
import os
from xml.sax.saxutils import quoteattr

import h5py
import numpy as np

from ..base import checks
from ..base.errors import FileError, as_file_error
from ..names import one_of
from .load import load
from .shape_meshes import surfaces_of

AXES = "xyz"
TABLES = ("bodies", "nodes", "contacts", "fluid", "history")  # of a .csv

SINGLE = 1e-4  # of the smallest extent of a surface: coordinates whose rounding is below that are written in single precision
MANY = 500  # balls: more of them are written with half the faces


def convert(source, target, what="bodies", step=None, overwrite=False, around=None):
    """Write the run `source` to `target`; its extension chooses the format. Returns the paths written.

    what : of a .csv, which holds one table, "bodies", "nodes" (of meshes), "contacts", "fluid" (particles of a liquid) or
        "history"; other formats hold all. step : only this output, all if None. around :
        faces round a sphere or disk in .vtp, 24, or 12 where a run has more than 500 bodies, if None. Raises FileError.
    """
    target, what = os.fspath(target), one_of("what", what, TABLES)
    kind = os.path.splitext(target)[1].lower()
    around = None if around is None else checks.count("around", around, 4)
    writers = {".csv": _csv, ".npz": _npz, ".h5": _hdf5, ".vtp": _vtk, ".vtu": _vtk}
    if kind in (".pvd", ".vtk"):
        told = "give .vtp: the .pvd of all outputs comes with it; ParaView opens the .vtkhdf as it is, too"
        raise FileError(target, f"a run is not written as {kind}", told)
    if kind not in writers:
        raise FileError(target, f"the format {kind or '(none)'} is not known", f"choose one of {', '.join(writers)}")
    if os.path.exists(target) and not overwrite:
        raise FileError(target, "this file exists already", "choose another name, or ask to overwrite it (--overwrite)")
    with load(source) as run:
        steps = [run[step]] if step is not None else list(run)
        if what == "history" and kind != ".csv":
            raise FileError(target, "the history alone is written as .csv", "choose a name that ends in .csv")
        try:
            if kind in (".vtp", ".vtu"):
                return _vtk(run, steps, target, around)
            return writers[kind](run, steps, target, what)
        except OSError as error:
            raise as_file_error(target, error, writing=True) from error


def columns(fields, turning=True):
    """Fields as named columns: vectors as name_x, name_y ..., velocity as vx, vy, w, other rows by number. turning: False for
    nodes of meshes and particles of a liquid, which have no spin."""
    result = {}
    for name in fields.names:
        value = fields[name]
        if value.ndim == 1:
            result[name] = value
            continue
        parts = value.shape[1]
        if name == "position":
            labels = AXES[:parts]
        elif name == "velocity" and not turning:
            labels = [f"v{axis}" for axis in AXES[:parts]]
        elif name == "velocity":
            labels = ("vx", "vy", "w") if parts == 3 else ("vx", "vy", "vz", "wx", "wy", "wz")
        elif name == "rotation":
            labels = [f"rotation_{c}" for c in "wxyz"]
        else:
            labels = [f"{name}_{AXES[k] if parts <= 3 else k}" for k in range(parts)]
        result |= {label: value[:, k] for k, label in enumerate(labels)}
    return result


def _csv(run, steps, target, what):
    with open(target, "w", newline="") as out:
        table = csv.writer(out)
        if what == "history":
            history = run.history
            table.writerow(history)
            table.writerows(zip(*(v.tolist() for v in history.values()), strict=True))
            return [target]
        for i, step in enumerate(steps):
            fields = getattr(step, what)
            named = columns(fields, turning=what == "bodies")
            if i == 0:
                table.writerow(["step", "time", *named])
            time = step.time_detection if what == "contacts" else step.time
            # repr of a float gives back the same bits
            rows = zip(*(v.tolist() for v in named.values()), strict=True)
            table.writerows([step.step, float(time), *row] for row in rows)
    return [target]


def _blocks(steps):
    """Names of the tables of outputs: nodes and fluid where an output has rows of them."""
    return ["bodies", "contacts", *(name for name in ("nodes", "fluid") if any(len(getattr(step, name)) for step in steps))]


def _each(run, steps):
    """(name, array) of all that a run holds."""
    for name in ("time", "time_detection", "step"):
        yield name, np.array([getattr(step, name) for step in steps])
    for name, value in run.history.items():
        yield f"history/{name}", value
    for step in steps:
        for what in _blocks([step]):
            fields = getattr(step, what)
            for name in fields.names:
                yield f"{step.index:05d}/{what}/{name}", fields[name]
    found = surfaces_of(steps[0]) if steps and steps[0].index == 0 else None
    if found is not None:  # of the first output: rigid bodies carry them along
        points, triangles, rows = found
        yield from (("surfaces/points", points), ("surfaces/triangles", triangles), ("surfaces/id", steps[0].drawn["id"][rows]))


def _npz(run, steps, target, what):
    np.savez_compressed(target, **dict(_each(run, steps)))
    return [target]


def _hdf5(run, steps, target, what):
    with h5py.File(target, "w") as out:
        for name, value in _each(run, steps):
            out[name] = np.char.encode(value, "utf-8") if value.dtype.kind == "U" else value
    return [target]


def _vtk(run, steps, target, around):
    """A file per output and block, and a .pvd per block that gives their times."""
    try:
        from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkCommonDataModel import VTK_VERTEX, vtkCellArray, vtkPolyData, vtkUnstructuredGrid
        from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter
    except ImportError as error:
        raise FileError(target, "the package vtk is needed for this format", "pip install vtk") from error
    stem, kind = os.path.splitext(target)
    paths, entries = [], {name: [] for name in _blocks(steps)}
    shapes = []
    for step in steps:
        for name, listed in entries.items():
            fields = getattr(step, name)
            values = {f: fields[f] for f in fields.names}
            place = values.pop("point" if name == "contacts" else "position")
            points, cells = vtkPoints(), vtkCellArray()
            points.SetData(numpy_to_vtk(_three(place), deep=True))
            cells.SetData(1, numpy_to_vtkIdTypeArray(np.arange(len(place), dtype=np.int64), deep=True))
            grid = vtkPolyData() if kind == ".vtp" else vtkUnstructuredGrid()
            grid.SetPoints(points)
            grid.SetVerts(cells) if kind == ".vtp" else grid.SetCells(VTK_VERTEX, cells)
            if "velocity" in values:
                velocity = values.pop("velocity")
                values |= {"velocity": velocity[:, : run.dim]} | ({"spin": velocity[:, run.dim :]} if name == "bodies" else {})
            for f, value in values.items():
                vector = value.ndim == 2 and value.shape[1] == run.dim
                array = numpy_to_vtk(np.ascontiguousarray(_three(value) if vector else value), deep=True)
                array.SetName(f)
                grid.GetPointData().AddArray(array)
            path = f"{stem}_{name}_{step.index:04d}{kind}"
            _write(vtkXMLPolyDataWriter() if kind == ".vtp" else vtkXMLUnstructuredGridWriter(), grid, path)
            listed.append((step.time_detection if name == "contacts" else step.time, path))
            paths.append(path)
        round_faces = around or (24 if len(step.bodies) <= MANY else 12)
        mesh = surfaces_of(step, round_faces) if kind == ".vtp" else None
        if mesh is not None:
            path = f"{stem}_surfaces_{step.index:04d}{kind}"
            _write_shapes(path, step, *mesh)
            shapes.append((step.time, path))
            paths.append(path)
    if shapes:
        entries["surfaces"] = shapes
    return paths + [_pvd(f"{stem}_{name}.pvd", listed) for name, listed in entries.items()]


def _write_shapes(path, step, points, triangles, rows):
    """Surfaces of the bodies, with the fields of their bodies on the triangles."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    at, cells, grid = vtkPoints(), vtkCellArray(), vtkPolyData()
    at.SetData(numpy_to_vtk(np.ascontiguousarray(_short(points, triangles)), deep=True))
    cells.SetData(3, numpy_to_vtkIdTypeArray(np.ascontiguousarray(triangles, np.int64).ravel(), deep=True))
    cells.ConvertTo32BitStorage()
    grid.SetPoints(at)
    grid.SetPolys(cells)
    for name in step.drawn.names:
        value = step.drawn[name]
        if name in ("position", "rotation") or value.dtype.kind not in "fiu":
            continue
        array = numpy_to_vtk(np.ascontiguousarray(value[rows]), deep=True)
        array.SetName(name)
        grid.GetCellData().AddArray(array)
    _write(vtkXMLPolyDataWriter(), grid, path)


def _short(points, triangles):
    """Points in single precision where that is finer than a picture shows."""
    size = np.linalg.norm(points[triangles[:, 1]] - points[triangles[:, 0]], axis=1) if len(triangles) else np.ones(1)
    smallest = np.min(size[size > 0], initial=np.inf)
    fine = np.finfo(np.float32).eps * np.max(np.abs(points), initial=0.0) <= SINGLE * smallest
    return points.astype(np.float32) if fine else points


def _write(writer, grid, path):
    """Writes a dataset, its arrays compressed and in binary behind the header."""
    writer.SetFileName(path)
    writer.SetInputData(grid)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetCompressorTypeToZLib()
    if not writer.Write():
        raise FileError(path, "VTK could not write the file", "look at the space on the disk and the permissions")


def _three(vectors):
    result = np.zeros((len(vectors), 3))
    result[:, : vectors.shape[1]] = vectors
    return result


def _pvd(path, listed):
    with open(path, "w") as out:
        out.write('<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n<Collection>\n')
        for time, file in listed:
            out.write(f'<DataSet timestep="{float(time)!r}" file={quoteattr(os.path.basename(file))}/>\n')
        out.write("</Collection>\n</VTKFile>\n")
    return path
