"""Targets of a study: scenes from files, scenes built by a Python file, and frictional contact problems."""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
from pathlib import Path

import numpy as np

from ..files.hdf5 import read_foreign
from .scripts import see_beside
from .settings import digest


class Target:
    """One scene or problem of a study. path: of its file. options, own: arguments of build(**options); own ones name the target.

    kind: "scene" (Scene.save), "script" (a .py that defines build) or "problem". fingerprint: hash that changes with the scene or
    problem.
    dt: the scene's own time step [s] or None.
    """

    def __init__(self, path, options=None, dt=None, own=None):
        self.path, self.options = Path(path), {**(options or {}), **(own or {})}
        if not self.path.is_file():
            raise ValueError(f"{path}: there is no such file; give a scene, a .py that defines build(), or a problem")
        self.name, self._dt = " ".join([self.path.name, *(f"{name}={value}" for name, value in (own or {}).items())]), dt
        self.kind = _kind(self.path)
        self._module = self._built = None
        self._meshes = {}
        if self.kind == "script":
            self._module = _module(self.path)
            self._options_known()
        self.dt = None
        if self.kind != "problem":
            self.dt = self._own_dt()
        self.fingerprint = self._fingerprint()

    def with_mesh(self, mesh):
        """The target as build(mesh=mesh) makes it, known by the same name; itself for 0."""
        if not mesh:
            return self
        if self.kind != "script":
            raise ValueError(f"{self.path}: meshes are swept of .py files whose build() has an option mesh")
        if mesh not in self._meshes:
            number = int(mesh) if float(mesh).is_integer() else mesh
            self._meshes[mesh] = Target(self.path, {**self.options, "mesh": number}, self.dt)
        return self._meshes[mesh]

    def _options_known(self):
        try:
            inspect.signature(self._module.build).bind(**self.options)
        except TypeError as error:
            raise ValueError(f"{self.path}: build() does not take the options {self.options}: {error}") from None

    def _own_dt(self):
        dt = self._dt if self._dt is not None else getattr(self._module, "DT", None)
        if dt is None:
            built = self._scene_or_simulation()
            dt = getattr(built, "dt", None)
        if dt is None:
            raise ValueError(f"{self.path}: a scene has no time step of its own: give one, dt=1e-3 [s] say (--dt 1e-3)")
        return float(dt)

    def default(self, name, otherwise):
        """A number that the .py file sets for studies (PREPARE, DURATION), or otherwise."""
        return getattr(self._module, name, otherwise)

    def _scene_or_simulation(self):
        if self._built is None:
            self._built = _load_scene(self.path) if self.kind == "scene" else self._module.build(**self.options)
        return self._built

    def simulation(self, setting=None):
        """A cairn.Simulation of the scene, from its start, with the networks of the setting."""
        from ..model.scene import Scene
        from ..run.simulation import Simulation

        built, self._built = self._scene_or_simulation(), None
        if isinstance(built, Simulation):
            if setting is not None and setting.of_networks:
                setting.set_networks(built.scene)
                return Simulation(built.scene, self.dt, built.strategy, overlap="ignore")
            built.dt = self.dt
            return built
        if not isinstance(built, Scene):
            raise ValueError(f"{self.path}: build() gave {built!r}: return a cairn.Scene or a cairn.Simulation")
        if setting is not None:
            setting.set_networks(built)
        return Simulation(built, self.dt, overlap="ignore")

    def problem(self):
        """The cairn.problems.Problem of the file."""
        from .. import problems

        return problems.read(self.path)

    def own_figures(self):
        """Functions figure_<name>(sim) of the .py file, {name: function}."""
        prefix = "figure_"
        names = [name for name in vars(self._module or object()) if name.startswith(prefix)] if self._module else []
        return {name[len(prefix) :]: getattr(self._module, name) for name in names}

    def after_step(self):
        """The function after_step(sim) of the .py file that is called after each step, or None."""
        return getattr(self._module, "after_step", None)

    def _fingerprint(self):
        if self.kind == "problem":
            p = self.problem()
            W = p.W
            return _hash(W.indptr, W.indices, W.data, p.q, p.mu)
        if self.kind == "scene":
            from ..files.checkpoint import load

            return _hash(*_leaves(load(self.path)))
        simulation = self.simulation()
        state = simulation.get_state()
        rules = [repr(rule) for rule in simulation._rules]
        return _hash(self.path.read_bytes(), digest(self.options), *rules, *_leaves(state["scene"]))


def _kind(path):
    if path.suffix == ".py":
        return "script"
    if path.suffix in (".dat", ".txt"):
        return "problem"
    try:
        return "problem" if read_foreign(path, lambda f: any(name.startswith("fclib_") for name, _ in f.items())) else "scene"
    except OSError:
        raise ValueError(f"{path}: is no scene of Scene.save, no .py and no problem (FCLIB's HDF5, Siconos's text)") from None


def _module(path):
    see_beside(path)
    spec = importlib.util.spec_from_file_location(f"cairn_study_of_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if not callable(getattr(module, "build", None)):
        raise ValueError(f"{path}: defines no build(): write  def build(**options): ... return scene")
    return module


def _load_scene(path):
    from ..model.scene import Scene

    return Scene.load(path)


def _leaves(value, name=""):
    """Names and values of a nested dict, in the order of the names."""
    if isinstance(value, dict):
        for key in sorted(value):
            yield from _leaves(value[key], f"{name}/{key}")
    else:
        yield name
        yield value


def _hash(*parts):
    out = hashlib.blake2b(digest_size=12)
    for part in parts:
        array = np.asarray(part)
        if array.dtype == object or array.dtype.kind in "US":
            data = repr(part).encode()
        else:
            data = f"{array.dtype.str}{array.shape}".encode() + np.ascontiguousarray(array).tobytes()
        out.update(len(data).to_bytes(8, "little") + data)
    return out.hexdigest()
