"""Scenes as JSON documents: a schema from the signatures of the package, and checks that answer as its errors do.

A document is an object with dim, gravity, materials, bodies, laws, and what a run needs:

{"format": "cairn-scene", "version": 1, "dim": 2, "gravity": [0, -9.81],
 "materials": {"rock": {"density": 2600}},
 "bodies": [{"shape": "disks", "centers": [[0, 0.6]], "radii": 0.5, "material": "rock"},
            {"shape": "wall", "point": [0, 0], "normal": [0, 1], "material": "rock"}],
 "laws": [{"a": "rock", "b": "rock", "law": "Coulomb", "mu": 0.4}],
 "simulation": {"dt": 1e-3, "strategy": {"name": "NSCD", "theta": 1.0, "solver": {"name": "NLGS", "tol": 1e-6}}},
 "run": {"steps": 200, "output": "drop.vtkhdf", "every": 20}}
"""

from __future__ import annotations

import importlib
import inspect
import json
import os
import re
import warnings
from collections import Counter
from dataclasses import dataclass

from .. import _core
from ..base import checks
from ..base.errors import FileError
from ..names import listed, teach
from ..options.integrators import INTEGRATORS
from ..options.solvers import SOLVERS
from ..options.strategies import STRATEGIES

VERSION = 1
DIGITS = 20  # of a whole number, as those of 64 bits have
SHAPES = ("disks", "spheres", "boxes", "polygons", "polyhedra", "wall", "ring", "segment", "tube", "capsules", "cylinders",
          "superquadrics", "clumps", "surface")  # fmt: skip
TOP = ("format", "version", "dim", "gravity", "origin", "depth", "periodic", "materials", "bodies", "laws", "simulation", "run")
RUN = ("steps", "until", "output", "every", "checkpoint_every", "overwrite", "append")


@dataclass(frozen=True)
class Problem:
    """A fault of a document.

    Parameters
    ----------
    path : str
        Its place as a JSON pointer, /bodies/0/radii.
    message : str
        What is wrong and what to give.
    """

    path: str
    message: str

    def __str__(self):
        return f"{self.path or '/'}: {self.message}"


class DocumentError(ValueError):
    """A document with faults; `problems` lists all."""

    def __init__(self, problems):
        self.problems = list(problems)
        super().__init__("; ".join(map(str, self.problems)))


def read(path) -> dict:
    """Reads a document.

    Parameters
    ----------
    path : path-like
        Name of a .json file.

    Returns
    -------
    dict
        Its contents.

    Raises
    ------
    FileError
        If there is no such file, or it is no JSON.
    """
    path = os.fspath(path)

    def no_number(word):
        raise ValueError(f"{word} is no number of JSON")

    def whole(word):
        if len(word) > DIGITS:
            raise ValueError(f"{word[:12]}... is a whole number of {len(word.lstrip('-'))} digits")
        return int(word)

    def object_of(pairs):
        twice = [name for name, times in Counter(name for name, _ in pairs).items() if times > 1]
        if twice:
            raise ValueError(f"an object has the field {twice[0]!r} twice")
        return dict(pairs)

    try:
        with open(path, encoding="utf-8-sig") as file:
            return json.load(file, parse_constant=no_number, parse_int=whole, object_pairs_hook=object_of)
    except RecursionError:
        raise FileError(path, "lists or objects are nested too deep", "give a document as `cairn check --schema` tells") from None
    except OSError as error:
        raise FileError(path, f"it cannot be read ({error.strerror})", "check the name and the folder") from None
    except json.JSONDecodeError as error:
        told = f"line {error.lineno}, column {error.colno}: {error.msg}"
        raise FileError(path, f"it is no JSON, {told}", "mind commas, quotes and brackets") from None
    except UnicodeDecodeError:
        with open(path, "rb") as binary:
            of_hdf5 = binary.read(8) == b"\x89HDF\r\n\x1a\n"
        is_what = "it is a file of results (HDF5), and no scene" if of_hdf5 else "it is no text, and no JSON"
        remedy = "give a .json document; `cairn info` and `cairn verify` read results" if of_hdf5 else "write JSON in UTF-8"
        raise FileError(path, is_what, remedy) from None
    except ValueError as error:
        raise FileError(path, f"it is no JSON: {error}", "write finite numbers, each field once, in UTF-8") from None


class _Builder:
    """Makes the objects of a document, and lists what cannot be made; `warned` are the warnings of making them."""

    def __init__(self, document):
        self.document, self.problems, self.warned = document, [], []
        self.root = importlib.import_module("cairn")
        self.scene = self.simulation = None

    def tell(self, path, error):
        message = error.args[0] if isinstance(error, KeyError) and error.args else error
        self.problems.append(Problem(path, " ".join(str(message).split())))

    def made(self, path, function, *given, **named):
        """The result of a call, or None and a problem, at the field that the message begins with."""
        try:
            with warnings.catch_warnings(record=True) as warned:
                warnings.simplefilter("always")
                made = function(*given, **named)
            self.warned += [(path, w) for w in warned]
            return made
        except (ValueError, TypeError, ImportError, AttributeError, IndexError, FileError) as error:
            word = re.match(r"([A-Za-z_]+)", str(error))
            place = f"{path}/{word.group(1)}" if word and word.group(1) in (*named, *RUN) else path
            self.tell(place, error)
            return None

    def object(self, path, value, keys=None, needed=()):
        """A copy of an object whose keys are known; None and problems if it is none."""
        if not isinstance(value, dict):
            self.tell(path, f"{_shown(value)} is no object: give {{...}}")
            return None
        for key in value:
            if keys is not None and key not in keys:
                self.tell(f"{path}/{key}", f"there is no field {key!r}; there are {listed(keys, key)}")
        missing = [key for key in needed if key not in value]
        for key in missing:
            self.tell(path, f"{key!r} is missing: give it")
        known = {k: v for k, v in value.items() if keys is None or k in keys}
        return None if missing else known

    def build(self):
        document = self.object("", self.document, TOP, ("dim", "materials", "bodies"))
        if document is None:
            return self
        for key, due in (("format", "cairn-scene"), ("version", VERSION)):
            if document.get(key, due) != due:
                self.tell(f"/{key}", f"it is {_shown(document[key])}: this program reads {due!r}")
        options = {k: document[k] for k in ("gravity", "origin", "depth") if k in document}
        if "periodic" in document:
            cell = self.object("/periodic", document["periodic"], _names(self.root.Periodic), ("lengths",))
            options["periodic"] = None if cell is None else self.made("/periodic", self.root.Periodic, **cell)
        self.scene = self.made("", self.root.Scene, dim=document["dim"], **options)
        materials = self._materials(document["materials"])
        self._bodies(document["bodies"], materials)
        self._laws(document.get("laws", []), materials)
        self._simulation(document.get("simulation"))
        if "run" in document:
            self._run(document["run"])
        return self

    def _run(self, given):
        run = self.object("/run", given, RUN)
        if run is None:
            return
        ends = [name for name in ("steps", "until") if run.get(name) is not None]
        if not ends:
            self.tell("/run", "say how long to run: give steps, or until [s]")
        elif len(ends) == 2:
            self.tell("/run", f"steps is {run['steps']!r} and until {run['until']!r}: a document has one end, give one of them")
        for name, least in (("steps", 0), ("every", 1), ("checkpoint_every", 1)):
            if run.get(name) is not None:
                self.made("/run", checks.count, name, run[name], least)
        if run.get("until") is not None:
            until = self.made("/run", checks.number, "until", run["until"])
            if until is not None and self.simulation is not None and until < self.simulation.dt / 2:
                told = f"until is {until!r}, less than half a step (dt = {self.simulation.dt!r} s): the run would make no step"
                self.tell("/run/until", f"{told}; give a later time, or a smaller dt")
        for name in ("overwrite", "append"):
            if name in run:
                self.made("/run", checks.flag, name, run[name])
        if run.get("overwrite") is True and run.get("append") is True:
            self.tell("/run", "append and overwrite are both true: give one of them, to go on in a file or to replace it")
        output = run.get("output", "run.vtkhdf")
        if not isinstance(output, str) or not output.lower().endswith(".vtkhdf"):
            self.tell("/run/output", f"{_shown(output)} is no name of a file: give a text that ends in .vtkhdf")

    def _materials(self, given):
        out, given = {}, self.object("/materials", given)
        keys = [n for n in _names(self.root.Material) if n != "name"]
        for name, values in (given or {}).items():
            values = self.object(f"/materials/{name}", values, keys)
            made = None if values is None else self.made(f"/materials/{name}", self.root.Material, name, **values)
            out[name] = made
        return out

    def _bodies(self, given, materials):
        if not isinstance(given, list):
            self.tell("/bodies", f"{_shown(given)} is no list: give [{{...}}, ...]")
            return
        if not given:
            self.tell("/bodies", "the scene has no bodies: give at least one")
        for k, body in enumerate(given):
            path = f"/bodies/{k}"
            if self.object(path, body) is None:
                continue
            shape = body.get("shape")
            if shape not in SHAPES:
                word = "'shape' is missing" if shape is None else f"there is no shape {_shown(shape)}"
                self.tell(f"{path}/shape", f"{word}: give one of {listed(SHAPES, str(shape))}")
                continue
            maker = getattr(self.root, shape)
            values = self.object(path, body, ["shape", *_names(maker)], _needed(maker))
            if values is None or not self._known(f"{path}/material", values["material"], materials):
                continue
            values["material"] = materials[values["material"]]
            del values["shape"]
            unknown = [k for k in values if k not in _names(maker)]
            made = None if values["material"] is None or unknown else self.made(path, maker, **values)
            if made is not None and self.scene is not None:
                self.made(path, self.scene.add, made)

    def _known(self, path, name, materials):
        if isinstance(name, str) and name in materials:
            return True
        self.tell(path, f"there is no material {_shown(name)}; there are {listed(materials, str(name))}")
        return False

    def _laws(self, given, materials):
        if not isinstance(given, list):
            self.tell("/laws", f"{_shown(given)} is no list: give [{{...}}, ...]")
            return
        laws = {row["python_name"]: [p[0] for p in row["parameters"]] for row in _core.laws() if row.get("python_name")}
        for k, rule in enumerate(given):
            path = f"/laws/{k}"
            if self.object(path, rule) is None:
                continue
            name = rule.get("law")
            if name not in laws:
                word = "'law' is missing" if name is None else f"there is no law {_shown(name)}"
                self.tell(f"{path}/law", f"{word}: give one of {listed(laws, str(name))}")
                continue
            values = self.object(path, rule, ["a", "b", "law", *laws[name]], ("a", "b"))
            if values is None or any(key not in ("a", "b", "law", *laws[name]) for key in rule):
                continue
            sides = {side: values.pop(side) for side in "ab"}
            values.pop("law")
            wrong = [not self._side(f"{path}/{side}", given, materials) for side, given in sides.items()]
            law = None if any(wrong) else self.made(path, getattr(self.root, name), **values)
            if law is not None and self.scene is not None:
                self.made(path, self.scene.interact, *(materials.get(s, s) or s for s in sides.values()), law)

    def _side(self, path, name, materials):
        """True if a name is that of a material or a group, or "*"."""
        if not isinstance(name, str):
            self.tell(path, f'{_shown(name)} is no name: give that of a material, of a group of bodies, or "*"')
            return False
        bodies = self.document["bodies"] if isinstance(self.document["bodies"], list) else []
        groups = [body["group"] for body in bodies if isinstance(body, dict) and isinstance(body.get("group"), str)]
        known = [*materials, *dict.fromkeys(groups), "*"]
        if name not in known:
            self.tell(path, f"there is no material and no group {name!r}; there are {listed(known, name)}")
        return name in known

    def _named(self, path, given, classes, what):
        """An object of one of the classes, from its name and settings."""
        given = {"name": given} if isinstance(given, str) else given
        if self.object(path, given) is None:
            return None
        name = given.get("name")
        if name not in classes:
            word = "'name' is missing" if name is None else f"there is no {what} {_shown(name)}"
            self.tell(f"{path}/name", f"{word}: give one of {listed(classes, str(name))}")
            return None
        before = len(self.problems)
        values = self.object(path, given, ["name", *_names(classes[name])])
        values.pop("name")
        for key, options in (("solver", SOLVERS), ("integrator", INTEGRATORS)):
            if isinstance(values.get(key), (str, dict)) and key in _names(classes[name]):
                values[key] = self._named(f"{path}/{key}", values[key], options, key)
        return None if len(self.problems) > before else self.made(path, classes[name], **values)

    def _simulation(self, given):
        if given is None:
            return
        keys = ("dt", "strategy", "overlap", "overlap_share")
        values = self.object("/simulation", given, keys, ("dt",))
        if values is None:
            return
        strategy = None
        if "strategy" in values:
            strategy = self._named("/simulation/strategy", values.pop("strategy"), STRATEGIES, "strategy")
        if not self.problems:
            self.simulation = self.made("/simulation", self.root.Simulation, self.scene, strategy=strategy, **values)


def _shown(value):
    text = json.dumps(value, default=repr)
    return text if len(text) <= 40 else text[:37] + "..."


def _names(function):
    """Names of the arguments of a function or class, with those of its options."""
    parameters = inspect.signature(function).parameters.values()
    plain = [p.name for p in parameters if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY) and p.name != "self"]
    return [*plain, *(n for n in getattr(function, "known_options", ()) if n not in plain)]


def _needed(function):
    parameters = inspect.signature(function).parameters.values()
    kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    return [p.name for p in parameters if p.default is p.empty and p.kind in kinds and p.name != "self"]


def _place_of(path, warned):
    """Field that a warning is about: missing laws belong to the laws, overlaps and walls to the bodies."""
    if path != "/simulation":
        return path
    kinds = (("MissingLawWarning", "/laws"), ("OverlapWarning", "/bodies"), ("ShapesWarning", "/bodies"))
    return dict(kinds).get(warned.category.__name__, path)


def warnings_of(built) -> list:
    """Lists what a document would warn of before its first step.

    Parameters
    ----------
    built : _Builder
        The document, built.

    Returns
    -------
    list of Problem
        Overlaps, missing laws, walls that look away, with their places.
    """
    return [Problem(_place_of(path, w), " ".join(str(w.message).split())) for path, w in built.warned]


def problems(document) -> list:
    """Lists all faults of a document.

    Parameters
    ----------
    document : dict
        The document.

    Returns
    -------
    list of Problem
        Faults with their places, [] if a scene, and a simulation if it tells one, can be made of it.
    """
    return _Builder(document).build().problems


def scene_of(document):
    """Makes the scene of a document.

    Parameters
    ----------
    document : dict
        The document.

    Returns
    -------
    Scene
        The scene.

    Raises
    ------
    DocumentError
        If the document has faults: a ValueError that lists all.
    """
    made = _Builder(document).build()
    if made.problems:
        raise DocumentError(made.problems)
    for _, warned in made.warned:
        warnings.warn(warned.message, warned.category, stacklevel=3)
    return made.scene


def simulation_of(document):
    """Makes the simulation of a document.

    Parameters
    ----------
    document : dict
        The document, with "simulation".

    Returns
    -------
    Simulation
        The simulation.

    Raises
    ------
    DocumentError
        If the document has faults, or tells no simulation.
    """
    made = _Builder(document).build()
    if made.problems:
        raise DocumentError(made.problems)
    for _, warned in made.warned:
        warnings.warn(warned.message, warned.category, stacklevel=3)
    if made.simulation is None:
        raise DocumentError([Problem("/simulation", 'it is missing: give {"dt": 1e-3} at least')])
    return made.simulation


# ---------------------------------------------------------------------- schema


def _told(function):
    """{name: (type, text)} from the section Parameters of a docstring."""
    out, name, inside = {}, None, False
    for line in inspect.cleandoc(function.__doc__ or "").splitlines():
        if re.fullmatch(r"\s*-{4,}\s*", line):
            continue
        head = re.match(r"(\w+(?:, \w+)*) : (.*)$", line)
        if line.strip() in ("Parameters", "Returns", "Raises", "Examples", "Notes"):
            inside = line.strip() == "Parameters"
        elif inside and head:
            name = head.group(1).split(", ")
            out |= dict.fromkeys(name, (head.group(2), ""))
        elif inside and name and line.startswith("    "):
            out |= {n: (out[n][0], (out[n][1] + " " + line.strip()).strip()) for n in name}
    return out


NUMBERS = {"anyOf": [{"type": "number"}, {"$ref": "#/$defs/numbers"}]}


def _typed(kind):
    """Schema of a type as a docstring words it; {} where JSON cannot say."""
    choices = re.match(r"\{(.*)\}", kind)
    if choices:
        return {"enum": [json.loads(w.strip().replace("'", '"')) for w in choices.group(1).split(",")]}
    some = []
    if re.search(r"array_like|ndarray|tuple|sequence of float|list of", kind):
        some.append({"$ref": "#/$defs/numbers"})
    if re.search(r"\bfloat\b", kind):
        some.append({"type": "number"})
    if re.search(r"\bint\b", kind):
        some.append({"type": "integer"})
    if re.search(r"\bbool\b", kind):
        some.append({"type": "boolean"})
    if re.search(r"\bstr\b", kind):
        some += [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]
    if re.search(r"\boptional\b|None", kind) and some:
        some.append({"type": "null"})
    return {} if not some else some[0] if len(some) == 1 else {"anyOf": some}


def _object(function, title=None, fixed=(), leave=(), special=()):
    """Schema of an object whose fields are the arguments of a function."""
    told, special = _told(function), dict(special)
    fields = dict(fixed)
    for name in _names(function):
        if name in leave:
            continue
        kind, text = told.get(name, ("", ""))
        fields[name] = special.get(name, _typed(kind)) | ({"description": text} if text else {})
    needed = [*dict(fixed), *(n for n in _needed(function) if n not in leave)]
    out = {"type": "object", "properties": fields, "required": needed, "additionalProperties": False}
    return out | ({"title": title} if title else {})


def schema() -> dict:
    """Makes the JSON schema of documents, from the signatures and docstrings of this version.

    Returns
    -------
    dict
        The schema, draft 2020-12.
    """
    root = importlib.import_module("cairn")
    string, array = {"type": "string"}, {"$ref": "#/$defs/numbers"}
    shapes = [_object(getattr(root, n), n, {"shape": {"const": n}}, (), {"material": string}) for n in SHAPES]
    laws = []
    for row in _core.laws():
        if name := row.get("python_name"):
            parameters = {p[0]: {"type": "number"} for p in row["parameters"]}
            needed = [p[0] for p in row["parameters"] if p[1] is None]
            laws.append({"title": name, "type": "object", "additionalProperties": False, "required": ["a", "b", "law", *needed],
                         "properties": {"a": string, "b": string, "law": {"const": name}, **parameters}})  # fmt: skip

    def one_of(classes, special=()):
        return {
            "anyOf": [{"enum": list(classes)}, *(_object(c, n, {"name": {"const": n}}, (), special) for n, c in classes.items())]
        }

    own = {"solver": {"$ref": "#/$defs/solver"}, "integrator": {"anyOf": [{"$ref": "#/$defs/integrator"}, {"type": "null"}]}}
    fields = {
        "format": {"const": "cairn-scene"},
        "version": {"const": VERSION},
        "dim": {"enum": [2, 3]},
        "gravity": array | {"description": "(dim,) [m/s2]"},
        "origin": array | {"description": "(dim,) [m]"},
        "depth": {"type": "number", "description": "Thickness of a 2D scene [m]."},
        "periodic": _object(root.Periodic),
        "materials": {"type": "object", "additionalProperties": _object(root.Material, leave=("name",))},
        "bodies": {"type": "array", "minItems": 1, "items": {"oneOf": shapes}},
        "laws": {"type": "array", "items": {"oneOf": laws}},
        "simulation": {
            "type": "object", "required": ["dt"], "additionalProperties": False,
            "properties": {"dt": {"anyOf": [{"type": "number", "exclusiveMinimum": 0}, {"const": "stable"}],
                                  "description": "Time step [s], or \"stable\" under SmoothDEM."},
                           "strategy": {"$ref": "#/$defs/strategy"}, "overlap": {"enum": ["warn", "error", "ignore"]},
                           "overlap_share": {"type": "number"}},
        },
        "run": _object(root.Simulation.run, leave=[n for n in _names(root.Simulation.run) if n not in RUN])
        | {"oneOf": [{"required": ["steps"]}, {"required": ["until"]}]},
    }  # fmt: skip
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Scene of Cairn " + root.__version__,
        "type": "object",
        "required": ["dim", "materials", "bodies"],
        "additionalProperties": False,
        "properties": fields,
        "$defs": {
            "numbers": {"type": "array", "items": NUMBERS},
            "strategy": one_of(STRATEGIES, own),
            "solver": one_of(SOLVERS),
            "integrator": one_of(INTEGRATORS),
        },
    }


teach(globals())
