"""Checkpoints of a simulation and states in memory, and their restoration."""

from __future__ import annotations

import contextlib
import hashlib

import numpy as np

from ..model.rules import rules_to_dict
from . import cracks, driven_cell, restored
from .compared import file_told, state_told
from .sets import ids_of, later_to_dict


class Restarts:
    """Methods of Simulation for checkpoints and states."""

    def checkpoint(self, path):
        """Writes the full state to a file, which is replaced atomically; `restore` continues from it with the same bits.

        Parameters
        ----------
        path : path-like
            Name of the file.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        from ..files.checkpoint import save

        self.between_steps("checkpoint")
        state = self.get_state()
        opened = {"cracks": state.pop("cracks")} if "cracks" in state else {}
        with self._failing_alike(path):
            if self._ranks is not None and not self._ranks.first:
                return  # all ranks gave their part of the state
            save(path, self._checkpointed(state, opened))

    def _checkpointed(self, state, opened):
        """Content of a checkpoint. opened: entries of cracks, {} without."""
        return {
            **(opened | restored.solver_to_dict(self) | driven_cell.to_dict(self._core, self.scene, self._cell)),
            "kind": "checkpoint",
            "dim": self.scene.dim,
            "dt": self._dt,
            "state": state,
            "species": {f"{k:06d}": {"material": m, "group": g} for (m, g), k in self._species.items()},
            "rules": rules_to_dict(self._rules),
            "scene": self._fingerprint(),
            "core_scene": self._core_scene,  # fingerprint of the scene for programs in C and Fortran
            "materials": len(self._species),
            "later": {f"{k:06d}": later_to_dict(s, self._sets) for k, s in enumerate(self._sets[self._sets_seen :])},
        }

    def _failing_alike(self, path):
        return contextlib.nullcontext() if self._ranks is None else self._ranks.failing_alike(path)

    def get_state(self):
        """Gives the full state besides laws and functions of time: a checkpoint in memory.

        Returns
        -------
        dict
            Nested dicts of arrays, for `set_state`.
        """
        self.between_steps("get_state")
        return cracks.in_state(self._sets, self._core.get_state())

    def set_state(self, state):
        """Restores a state of get_state, to the same bits.

        Parameters
        ----------
        state : dict
            As get_state gave it.

        Raises
        ------
        ValueError
            If it is none, or bodies were added or removed since.
        """
        self.between_steps("set_state", **({} if self._ranks is None else state_told(state)))
        if not (isinstance(state, dict) and "bodies" in state.get("scene", ())):
            raise ValueError(f"state is {type(state).__name__}, and none that get_state gave: give that, or restore a checkpoint")
        if not np.array_equal(ids_of(state["scene"]), self._present()):
            raise ValueError("the state is of other bodies than those that there are now: see checkpoint and restore")
        opened = cracks.of_state(self._sets, state)
        self._core.set_state(state)
        if opened is not None:
            self._sets = opened
            self._start_meshes(state, anew=True)
        self._values.forces_are_due = True  # a state from before the first step has no forces
        self._came("state")

    def _fingerprint(self):
        """Hash of the initial bodies and contactors, by which checkpoints recognise their scene."""
        digest = hashlib.blake2b(digest_size=16)
        for s in self._sets[: self._sets_seen]:
            for array in (s.position, s.mass, s.inertia, *(a for c in s.contactors for a in (c.body, c.radius))):
                digest.update(np.ascontiguousarray(array).data)
        for fluid in self.scene.fluids:
            digest.update(np.ascontiguousarray(fluid.position).data)
            tension = (fluid.surface_tension,) if fluid.surface_tension else ()
            digest.update(repr((float(fluid.density), fluid.incompressible, *tension)).encode())
        for end in self.scene.fluid_ends:
            digest.update(np.ascontiguousarray(end.region).data)
            digest.update(repr(end.told()).encode())
        return digest.hexdigest()

    def restore(self, path):
        """Restores a checkpoint of the same scene, to the same bits.

        Bodies added since the start are read from the file, with their drives and forces; if these are Python functions, add the
        same sets first. What `drive_cell` gave the periodic cell is read from it, too.

        Parameters
        ----------
        path : path-like
            Name of the file.

        Raises
        ------
        FileError
            If the file is no checkpoint of this scene.
        """
        self.between_steps("restore", **({} if self._ranks is None else file_told(path)))
        restored.restore(self, path)
        self._came("checkpoint")

    def _came(self, how):
        """Records that the current state comes from `how` instead of steps, and forgets where earlier run files ended."""
        self._came_by, self._last_outputs = how, {}

    def _take(self, state, species, rules, sets, dt, info, strategy, cell=None):
        if strategy != self._strategy:
            self._core.set_strategy(strategy.settings())
            self._strategy = strategy
        if self._fluid:
            self._fluid.follow(sets)
        # present meshes may differ from those of the state, whose own data are restored below, when they exist
        if cell is not None:
            driven_cell.change(self._core, self.scene, cell[0])
        self._core.set_state({name: of for name, of in state.items() if name != "meshes"})
        if cell is not None:
            self._cell, self._core.kept_volume = cell
        self._use_laws(species, rules, sets[self._sets_seen :])
        self._sets, self._dt, self._radii, self._info, self._added = sets, dt, None, info, []
        self._start_functions()
        self._start_meshes(state, anew=True)
