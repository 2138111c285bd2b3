"""Deformable bodies and networks in scene files, stored by the arguments from which they are built again."""

from __future__ import annotations

import dataclasses
import importlib

import numpy as np

from ..base import time_functions
from ..base.materials import Material
from ..networks.conductances import CONDUCTANCES, Conductance
from . import bulk, fracture
from .elastic import ElasticBody
from .joint_ends import end_on_node
from .meshes import LinearBody, deformable
from .moving_frames import FrameBody
from .opening_faces import OpeningFaces
from .section_forces import LinearFrame
from .solid import SolidBody
from .ties import TiedBody

# {module: its name in files, which is that of the first version that wrote it}
IN_FILES = {"cairn.base.materials": "cairn.model.materials"}
BODIES = {cls.__name__: cls for cls in (ElasticBody, FrameBody, LinearBody, LinearFrame, SolidBody, TiedBody)}


def encoded(given):
    """Content of a scene file for arguments {name: value}. Raises ValueError for a value that no file can hold."""
    return {name: _encoded(name, value) for name, value in given.items()}


def decoded(content):
    """The inverse of encoded."""
    return {name: _decoded(value) for name, value in content.items()}


def to_dict(d):
    """Content of a scene file for a Deformable. Raises ValueError for a part that no file can hold, such as a user's solver."""
    d = d.whole or d
    kind = type(d.body).__name__
    if BODIES.get(kind) is not type(d.body):
        raise ValueError(f"the body of {d.name!r} is a {kind}: a scene file holds {' and '.join(BODIES)}")
    of_body = {name: _encoded(f"{name} of {d.name!r}", value) for name, value in d.body.given.items()}
    out = {"class": kind, "body": of_body, "given": {name: _encoded(name, value) for name, value in d.given.items()}}
    if d.opening:
        out["opening"] = {"strength": np.array(d.opening.strength), "threshold": float(d.opening.threshold)}
    if d.joints:
        out["joints"] = {f"{k:06d}": {"name": name, "node": int(node)} for k, (name, node) in enumerate(d.joints)}
    return out


def from_dict(content):
    """Sets of bodies of a Deformable, as `deformable` returns them, from the content of a file."""
    body = BODIES[content["class"]](**{name: _decoded(value) for name, value in content["body"].items()})
    made = deformable(body, **{name: _decoded(value) for name, value in content["given"].items()})
    if "opening" in content:
        fracture.attach(made[0], OpeningFaces(body, tuple(content["opening"]["strength"]), content["opening"]["threshold"]))
        made.append(fracture.sides_of(made[0]))
    for _, joint in sorted(content.get("joints", {}).items()):
        d, node = made[0].mesh, int(joint["node"])
        d.joints.append((joint["name"], node))
        d.contact_nodes = np.union1d(d.contact_nodes, [node])
        made[0].contactors.append(end_on_node(d.body.dim, Material(joint["name"]), node))
    return made


def _encoded(name, value):
    if value is None or isinstance(value, (str, bool, int, float, np.generic, np.ndarray)):
        return value
    if isinstance(value, dict):
        rows = {f"{k:06d}": {"key": _encoded(name, a), "value": _encoded(name, b)} for k, (a, b) in enumerate(value.items())}
        return {"kind": "dict", **rows}
    if isinstance(value, bulk.BulkMaterial):
        if type(value).__name__ not in bulk.BULK_MATERIALS:
            raise ValueError(f"{name} is {value!r}, a routine of a library, which no file can hold: give a material of the list")
        values = dict(zip(value.parameter_names, value.values))
        return {"kind": "bulk", "class": type(value).__name__, "values": {key: float(x) for key, x in values.items()}}
    if dataclasses.is_dataclass(value) and not callable(value):
        module = type(value).__module__
        fields = {f.name: _encoded(f"{name}.{f.name}", getattr(value, f.name)) for f in dataclasses.fields(value) if f.init}
        return {"kind": "record", "module": IN_FILES.get(module, module), "class": type(value).__name__, "fields": fields}
    if BODIES.get(type(value).__name__) is type(value):
        given = {part: _encoded(f"{part} of {name}", of) for part, of in value.given.items()}
        return {"kind": "body", "class": type(value).__name__, "given": given}
    if callable(value):
        return {"kind": "function", "of": time_functions.to_dict(name, value)}
    if isinstance(value, (list, tuple)):
        if len(value) and _of_numbers(value):  # an empty list of materials stays a list
            return np.asarray(value)
        return {"kind": "list", **{f"{k:06d}": _encoded(name, part) for k, part in enumerate(value)}}
    if hasattr(value, "tocsc"):
        a = value.tocsc()
        return {"kind": "sparse", "shape": np.array(a.shape), "data": a.data, "indices": a.indices, "indptr": a.indptr}
    if isinstance(value, Conductance):
        if value.row is None:
            raise ValueError(f"{name} is a plugged conductance, which a file cannot hold: add the network to the loaded scene")
        return {"kind": "conductance", "class": type(value).__name__, "values": np.array(value.values, float)}
    raise ValueError(f"{name} is a {type(value).__name__}, which a file cannot hold: give numbers, arrays or matrices")


def _of_numbers(value):
    if isinstance(value, (list, tuple)):
        return all(_of_numbers(part) for part in value)
    return isinstance(value, (bool, int, float, np.generic))


def _decoded(value):
    if not isinstance(value, dict):
        return value
    rows = [value[k] for k in sorted(value) if k.isdecimal()]
    if value["kind"] == "dict":
        return {_decoded(row["key"]): _decoded(row["value"]) for row in rows}
    if value["kind"] == "list":
        return [_decoded(row) for row in rows]
    if value["kind"] == "function":
        return time_functions.from_dict(value["of"])
    if value["kind"] == "bulk" and value["class"] in bulk.BULK_MATERIALS:
        return bulk.BULK_MATERIALS[value["class"]](**{name: float(x) for name, x in value["values"].items()})
    if value["kind"] == "body" and value["class"] in BODIES:
        return BODIES[value["class"]](**{name: _decoded(part) for name, part in value["given"].items()})
    if value["kind"] == "sparse":
        from scipy import sparse

        return sparse.csc_array((value["data"], value["indices"], value["indptr"]), shape=tuple(value["shape"]))
    if value["kind"] == "conductance":
        return CONDUCTANCES[value["class"]].from_values(value["values"])
    if value["kind"] == "record" and value["module"].startswith(("cairn.model.", "cairn.build.", "cairn.networks.")):
        module = value["module"].replace("cairn.build.", "cairn.model.")  # its name before version 0.2
        module = next((here for here, there in IN_FILES.items() if there == module), module)
        found = getattr(importlib.import_module(module), value["class"])
        if dataclasses.is_dataclass(found):
            return found(**{name: _decoded(part) for name, part in value["fields"].items()})
    raise ValueError(f"kind is {value['kind']!r}: dict, list, function, sparse, bulk and records of scenes are known")
