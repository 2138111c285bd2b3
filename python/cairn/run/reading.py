"""What Simulation tells of its state: time, reports, energy, views of arrays, words."""

from __future__ import annotations

import numpy as np

from .. import _core
from . import views
from .info import Info, Terms
from .stages import Stages


class Reading:
    """Properties and methods of Simulation that read its state and change nothing."""

    @property
    def time(self):
        """Time reached [s]."""
        return self._core.time

    @property
    def steps(self):
        """Steps taken since the start."""
        return self._core.steps

    @property
    def info(self):
        """Report of the last step.

        It holds status, error, penetration, iterations, contacts, energy; seconds of stages, newton_seconds of Newton's
        iterations and others; and largest_penetration, the deepest overlap so far over the size of the smaller body [-].
        """
        told = {**self._info, "largest_penetration": self._deepest} if self._info else self._info
        return Info({**told, "energy": self.energy, **self._core.seconds()}, self.steps)

    @property
    def report(self):
        """Report of the last step without energy and seconds; {} before the first."""
        return self._info

    def add_to_report(self, **more):
        """Adds entries to the report of the last step.

        Parameters
        ----------
        **more : float, int or str
            Entries by name.

        Returns
        -------
        dict
            The report.
        """
        self._info = {**self._info, **more}
        return self._info

    @property
    def energy(self):
        """Terms of the energy balance since the start [J]; closure is their residual, in_play its scale."""
        found = self._core.energy()
        if self.steps or not self.meshes:
            return Terms(found)
        from .reshape import before_first_step

        return Terms(before_first_step(self, found))

    @property
    def bodies(self):
        """Arrays of the rigid bodies: position, velocity, ...; see BodyView."""
        return views.BodyView(self, self._core)  # not kept, to avoid a reference cycle

    @property
    def fluid(self):
        """Particles of the liquid: position, velocity, pressure, ...; see FluidView."""
        if self._fluid is None:
            raise ValueError("this scene has no fluid: give cn.fluid(...) to Scene.add")
        from .fluid_view import FluidView

        return FluidView(self, self._core, self._fluid)

    @property
    def nodes(self):
        """Arrays of the nodes of deformable bodies: position, velocity, ...; see NodeView."""
        return views.NodeView(self, self._core)

    @property
    def contacts(self):
        """Arrays of the contacts of the last step: gap, impulse, ...; see ContactView."""
        return views.ContactView(self, self._core)

    @property
    def stages(self):
        """The stages of a step, for individual calls; see Stages."""
        return Stages(self, self._core, self._stage)

    @property
    def ranks(self):
        """Ranks that share the scene, see Ranks; None without."""
        return self._ranks

    def gather(self):
        """Makes bodies and contacts of all ranks readable on each, until the next step. All ranks call it.

        Without ranks, or where one process has all of them, nothing has to be done.
        """
        if self._ranks is not None:
            _core.gather_ranks(self._core)

    @property
    def meshes(self):
        """Views of the deformable bodies in the order of insertion: displacement, velocity, stress, ..."""
        return [views.MeshView(self, self._core, mesh) for mesh in (self._meshes.meshes if self._meshes else ())]

    @property
    def raw(self):
        """Live arrays in internal order, until the next renumbering."""
        return views.RawView(self._core)

    @property
    def held_bytes(self):
        """Memory in bytes of "bodies" (with contactors and velocities of the solver) and of "contacts", a dict."""
        return dict(zip(("bodies", "contacts"), self._core.bytes()))

    @property
    def stable_step(self):
        """Stable step [s]: of the current smooth contacts, or of deformable bodies by bounds of their frequencies; else inf."""
        return self._core.stable_step()

    @property
    def skin(self):
        """Gap beyond the reach of their law up to which SmoothDEM lists pairs [m]."""
        figures = self._core.figures()
        if "skin" not in figures:
            raise ValueError(f"{type(self.strategy).__name__} has no skin: SmoothDEM has one")
        return figures["skin"]

    @property
    def stage_names(self):
        """Names of the stages of a step, in their order."""
        return list(self._core.stages())

    def radii(self):
        """Gives the radius of each body about its centre of mass.

        Returns
        -------
        ndarray (n,)
            Radii [m]: 0 for walls.
        """
        if self._radii is None or "stretch" in self.bodies.names:
            ids, contactors = self.bodies.id, self.contactors
            reach, offset = contactors.radius.copy(), contactors.offset
            if len(offset):
                reach = reach + np.linalg.norm(offset, axis=1)
            round_ = np.isin(contactors.shape, _core.shapes("ball")) & np.isin(contactors.body, ids)
            self._radii = np.zeros(len(ids))
            np.maximum.at(self._radii, np.searchsorted(ids, contactors.body[round_]), reach[round_])
        return self._radii.copy()

    def __repr__(self):
        from ..base.notebook import line_of_simulation

        return line_of_simulation(self)

    def _repr_html_(self):
        from ..base.notebook import of_simulation

        return of_simulation(self)

    def explain(self, json=False):
        """Tells stages, arrays, bytes for each body and contact, chosen settings, scales of the scene, and the last step.

        Parameters
        ----------
        json : bool, default False
            Gives plain data in the place of text.

        Returns
        -------
        str or dict
            The text, or the same as numbers, words and lists, which json.dumps takes.
        """
        from .explain import explain, explained

        return explained(self) if json else explain(self)
