"""A run as one self-contained page: opened from the disk, it needs no server and no network."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import os
import zlib
from pathlib import Path

import numpy as np

from ...base.errors import FileError, as_file_error
from ...names import listed
from ..drawing import CLASSES, field_values, title_of
from .frames import fields_of, frame_of, is_category, limits_of

MOST_MEGABYTES = 200


def write_page(run, path, what="velocity", every=1, fields=None, overwrite=False):
    """Write a run as a self-contained .html page that shows its bodies in 3D: play, colours by field, forces, cuts, numbers of a
    body that is clicked.

    run : of `cairn.load`. what : the field that colours the bodies at first. every : take each so many outputs, and the last.
    fields : names of the fields to carry along (default: all).

    The drawing is done by vtk.js, as the packages trame-vtk and trame-client carry it. Raises ImportError without them,
    ValueError for a field that is not there or a run without outputs, FileError if the file is there or would be larger than
    200 MB. Returns the path.
    """
    path = os.fspath(path)
    if len(run) == 0:
        raise ValueError(f"{run.path} holds no output yet")
    known = fields_of(run)
    chosen = known if fields is None else list(fields)
    for name in (*chosen, what):
        if name not in known:
            raise ValueError(f"there is no field {name!r}; there are {listed(known, name)}")
    if what not in chosen:
        chosen.insert(0, what)
    if os.path.exists(path) and not overwrite:
        raise FileError(path, "the file exists already", "choose another name, or give overwrite=True (--overwrite)")
    vue, vtk = _scripts()
    data = json.dumps(_data(run, what, every, chosen, path), allow_nan=False)
    words = {
        "TITLE": html.escape(Path(run.path if isinstance(run.path, str) else path).name),
        "VUE": _inline(vue),
        "VTK": _inline(vtk),
        "DATA": data.replace("</", "<\\/"),
    }
    text = Path(__file__).with_name("page.html").read_text(encoding="utf-8")
    for name, value in words.items():
        text = text.replace("{{" + name + "}}", value)
    try:
        Path(path).write_text(text, encoding="utf-8")
    except OSError as error:
        raise as_file_error(path, error, writing=True) from error
    return path


def _scripts():
    try:
        import trame_client
        import trame_vtk
    except ImportError as error:
        raise ImportError("a page needs vtk.js, which trame carries: pip install trame-vtk trame-client") from error
    vue = Path(trame_client.__file__).parent / "module/vue3-www/vue.global.js"
    vtk = Path(trame_vtk.__file__).parent / "modules/common/serve/trame-vtk.js"
    for script in (vue, vtk):
        if not script.exists():
            raise ImportError(f"{script} is not there: install trame-vtk 2.11 and trame-client 4.1, which have it")
    return vue.read_text(encoding="utf-8"), vtk.read_text(encoding="utf-8")


def _inline(script):
    """A script as it may stand inside a page."""
    return script.replace("</script", "<\\/script").replace("<!--", "<\\!--")


class _Store:
    """Arrays as compressed text, each once: most of a run stays the same from output to output."""

    def __init__(self, path):
        self.texts, self._seen, self._size, self._path = [], {}, 0, path

    def add(self, values, kind):
        """The number of an array; kind: float32, uint32 or uint8."""
        raw = np.ascontiguousarray(values, dtype=kind).tobytes()
        key = hashlib.sha256(raw).digest()
        if key not in self._seen:
            self._seen[key] = len(self.texts)
            self.texts.append(base64.b64encode(zlib.compress(raw, 6)).decode())
            self._size += len(self.texts[-1])
            if self._size > MOST_MEGABYTES * 1_000_000:
                raise FileError(
                    self._path, f"the page would be larger than {MOST_MEGABYTES} MB", "take fewer outputs (every=), fewer fields"
                )
        return self._seen[key]


def _data(run, what, every, fields, path):
    store = _Store(path)
    chosen = sorted({*range(0, len(run), every), len(run) - 1})
    origin, size = _extent(frame_of(run[chosen[0]]), frame_of(run[chosen[-1]]))
    frames = [_frame(run[k], store, fields, origin, size) for k in chosen]
    labels = {name: field_values(run[chosen[-1]], name)[1] for name in fields}
    return {
        "dim": run.dim,
        "origin": [float(x) for x in origin],
        "size": float(size),
        "first": what,
        "fields": {
            name: {"label": labels[name], "limits": [float(v) for v in limits_of(run, name)], "classes": is_category(name)}
            for name in fields
        },
        "classes": list(CLASSES),
        "colours": [f"#{r:02x}{g:02x}{b:02x}" for r, g, b in _viridis()],
        "materials": [str(name) for name in run.scene.get("materials", [])],
        "frames": frames,
        "arrays": store.texts,
    }


def _extent(*frames):
    """Middle (3,) and size [m] of all that some frames show. Pages hold lengths from there and in this unit, since graphics
    cards count in single precision."""
    points = np.concatenate([p.reshape(-1, 3) for f in frames for p in (f.center, f.points, f.walls)])
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return np.zeros(3), 1.0
    low, high = points.min(axis=0), points.max(axis=0)
    radius = max((float(f.radius.max()) for f in frames if len(f.radius)), default=0.0)
    return (low + high) / 2, float((high - low).max()) + 2 * radius or 1.0


def _frame(step, store, fields, origin, size):
    frame = frame_of(step)

    def place(points):
        return store.add((points - origin) / size, np.float32)

    bodies = step.drawn
    ids = bodies["id"] if "id" in bodies else np.arange(len(bodies))
    return {
        "title": title_of(step),
        "time": float(step.time),
        "center": place(frame.center),
        "radius": store.add(frame.radius / size, np.float32),
        "row": store.add(frame.row, np.uint32),
        "points": place(frame.points),
        "triangles": store.add(frame.triangles, np.uint32),
        "rows": store.add(frame.rows, np.uint32),
        "walls": place(frame.walls),
        "forces": place(frame.forces),
        "force": store.add(frame.force, np.float32),
        "ids": store.add(ids, np.uint32),
        "position": place(_space(bodies["position"])),
        "values": {name: store.add(field_values(step, name)[0], np.float32) for name in fields},
    }


def _space(points):
    return np.column_stack((points, np.zeros(len(points)))) if points.shape[1] == 2 else points


def _viridis():
    """64 colours of the map viridis, from the few that fix it."""
    knots = np.array(
        [(68, 1, 84), (71, 45, 123), (59, 82, 139), (44, 114, 142), (33, 145, 140), (40, 174, 128), (94, 201, 98), (173, 220, 48),
         (253, 231, 37)], float,
    )
    at = np.linspace(0, len(knots) - 1, 64)
    return np.stack([np.interp(at, np.arange(len(knots)), knots[:, c]) for c in range(3)], axis=1).round().astype(int)
