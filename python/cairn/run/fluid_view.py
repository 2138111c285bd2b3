"""The particles of the liquid of a simulation, read as arrays."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..base import checks
from ..names import listed
from .shown import shown

MOVED = "particles move by the flow alone; cn.fluid(places, velocity=, pressure=) gives them at the start"
FIELDS = ("position", "velocity", "pressure", "density", "open", "mass", "porosity", "end")


class FluidView:
    """Particles of the liquid of a simulation, in the order in which they were given: position (n, dim) [m], velocity (n, dim)
    [m/s], pressure (n,) [Pa], density (n,) [kg/m3], open (n,): 2 at a free surface, 1 beside one, 0 within, mass (n,) [kg],
    porosity (n,): the share of space that grains leave it, end (n,): 1 and more in a row of an inflow, -1 and less in an outflow,
    0 elsewhere."""

    def __init__(self, simulation, core, running):
        self._simulation, self._core, self._running = simulation, core, running

    def __len__(self):
        return _core.fluid_count(self._core)

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        if name not in FIELDS:
            raise AttributeError(f"a fluid has no array {name!r}; it has {listed(FIELDS, name)}")
        values = _core.fluid_field(self._core, name)
        if name == "mass" and self._simulation.scene.dim == 2:
            values *= self._running.settings["depth"]
        if name == "position" and np.any(self._simulation.scene.origin):
            values += self._simulation.scene.origin
        return shown(values, MOVED)

    def __setattr__(self, name, value):
        if not name.startswith("_"):
            what = f"{name} of the fluid cannot be assigned" if name in FIELDS else f"a fluid has no {name!r} to be assigned"
            raise AttributeError(f"{what}: {MOVED}")
        object.__setattr__(self, name, value)

    @property
    def settings(self):
        """Spacing, density, viscosity, sound_speed and others, a dict."""
        return dict(self._running.settings)

    @property
    def info(self):
        """Numbers of the last step: sub_steps, lists, speed [m/s], compression, volume over that of the mass at rest, neighbours,
        volume_begin: volume after the first step, stable_step [s], drag_loss: energy that drag of grains took [J], came_in and
        left: mass by open ends since the start [kg], back_flow: particles of the liquid that stand in an inflow,
        surface_energy [J], bytes, light_factor: by how much the lightest body beside the liquid shortened sub-steps, light_body:
        its id (-1: none)."""
        return _core.fluid_report(self._core)

    def force_on(self, body):
        """Gives the mean force of the liquid on a body, or on several, in the last step.

        Parameters
        ----------
        body : int or array_like (n,)
            Id of a body, or ids, as `Scene.add` returns them.

        Returns
        -------
        ndarray (3,) or (6,); of ids (n, 3) or (n, 6)
            Force [N], and torque about its centre of mass [N m]: 0 for one that the liquid flows through.

        Raises
        ------
        ValueError
            If there is no such body.
        """
        ids = checks.body_ids(body)
        unknown = ids[~np.isin(ids, self._simulation.bodies.id)]
        if len(unknown):
            raise ValueError(
                f"there is no body {unknown[0]}; it was never added, or was removed: give an id that Scene.add returned"
            )
        found = np.array([_core.fluid_force(self._core, int(k)) for k in ids]).reshape(len(ids), 6)
        found = found if self._simulation.scene.dim == 3 else found[:, [0, 1, 5]]
        return found if np.ndim(body) else found[0]

    def forces_on_mesh(self, mesh):
        """Gives the mean forces of the liquid on the nodes of a deformable body in the last step.

        Parameters
        ----------
        mesh : int, MeshView or str
            Number of the body in `Simulation.meshes`, one of these, or its name, if no other has it.

        Returns
        -------
        ndarray (n, dim)
            Forces [N], 0 of one that the liquid flows through.

        Raises
        ------
        ValueError
            If there is no such body, or several have this name.
        """
        one = self._mesh(mesh)
        out = np.zeros(one.body.points.size)
        found = _core.fluid_mesh_forces(self._core, int(one.ids[0]))
        out[: len(found)] = found
        return out.reshape(one.body.points.shape)

    def _mesh(self, asked):
        """The deformable body that a number, a view or a name tells."""
        meshes = self._simulation.meshes
        if isinstance(asked, (int, np.integer)) and not isinstance(asked, bool):
            found = meshes[asked : asked + 1] if asked >= 0 else []
        elif isinstance(asked, str):
            found = [mesh for mesh in meshes if mesh.name == asked]
        else:
            first = getattr(asked, "ids", [-1])[0]
            found = [mesh for mesh in meshes if mesh.ids[0] == first]
        if len(found) > 1:
            numbers = [k for k, mesh in enumerate(meshes) if mesh.name == asked]
            raise ValueError(
                f"{len(found)} deformable bodies have the name {asked!r}, numbers {numbers[0]}, {numbers[1]}"
                f"{', ...' if len(numbers) > 2 else ''} of sim.meshes: give the number, or sim.meshes[{numbers[0]}]"
            )
        if not found:
            known = ", ".join(repr(name) for name in dict.fromkeys(mesh.name for mesh in meshes))
            due = f"there is {known}: give the name of one" if known else "the scene has none: ask force_on for a rigid body"
            raise ValueError(f"there is no deformable body {asked!r}; {due}")
        return found[0]

    def pressure_at(self, places):
        """Gives the mean pressure of the liquid about places, with what gravity adds from particles to the place.

        Parameters
        ----------
        places : array_like (n, dim)
            Places of gauges [m].

        Returns
        -------
        ndarray (n,)
            Pressures [Pa]; 0, that of air, where no particle is within reach, so that records of gauges go on; `level_at` is NaN
            there.

        Raises
        ------
        ValueError
            If places are not finite, or not of this dimension.
        """
        return _core.fluid_pressure_at(self._core, self._places(places))

    def level_at(self, places):
        """Gives the height of the free surface above or below places: the highest one to which half of space is filled, by
        the sum of the kernel.

        Parameters
        ----------
        places : array_like (n, dim)
            Places of gauges [m].

        Returns
        -------
        ndarray (n,)
            Heights against gravity, along the last axis without gravity [m]; NaN where no particle is within reach of the line
            above and below the place, while `pressure_at` is 0.

        Raises
        ------
        ValueError
            If places are not finite, or not of this dimension.
        """
        gravity, origin = self._running._gravity(), self._simulation.scene.origin
        size = np.linalg.norm(gravity)
        up = -gravity / size if size > 0 else np.eye(len(gravity))[-1]
        return _core.fluid_level_at(self._core, self._places(places)) + float(up @ origin)

    def _places(self, places):
        """Places of gauges as the core takes them."""
        scene = self._simulation.scene
        places = checks.reals("places", places)
        if places.ndim != 2 or places.shape[1] != scene.dim or not np.all(np.isfinite(places)):
            raise ValueError(f"places have shape {places.shape}: give finite ones, (n, {scene.dim}) [m]")
        return np.ascontiguousarray(np.pad(places - scene.origin, ((0, 0), (0, 3 - scene.dim))))

    def energy(self):
        """Gives the energy of the liquid.

        Returns
        -------
        dict
            "kinetic", "potential" by the gravity of now, "elastic" of its compression, and "surface" of its tension, if any [J].
        """
        s = self._running.settings
        mass = np.asarray(self.mass)
        velocity, excess = np.asarray(self.velocity), np.asarray(self.density) / s["density"] - 1
        gravity = self._running._gravity()
        surface = {"surface": self.info["surface_energy"]} if s["surface_tension"] > 0 else {}
        return {
            "kinetic": 0.5 * float(np.sum(mass * np.sum(velocity**2, axis=1))),
            "potential": -float(np.sum(mass * (np.asarray(self.position) @ gravity))),
            "elastic": 0.5 * s["sound_speed"] ** 2 * float(np.sum(mass * excess**2)),
            **surface,
        }

    def _fields_of_scene(self):
        """Fields that only scenes with grains or open ends have."""
        ends = ("end",) if self._simulation.scene.fluid_ends else ()
        return (*(("porosity",) if len(self._running.grains) else ()), *ends)

    def snapshot(self):
        """Fields of an output, by name."""
        names = ("position", "velocity", "pressure", "density", *self._fields_of_scene())
        return {name: np.array(getattr(self, name)) for name in names}

    def lines(self):
        """Lines for Simulation.explain."""
        s, info = self._running.settings, self.info
        nu = s["viscosity"] / s["density"]
        return [
            "",
            f"Fluid: {len(self)} particles, spacing {s['spacing']:g} m, density {s['density']:g} kg/m3, "
            f"viscosity {s['viscosity']:g} Pa s ({nu:.3g} m2/s), sound speed {s['sound_speed']:g} m/s",
            f"  Wendland C2, h = {s['smoothing']:g} spacings, {info['neighbours']:.0f} neighbours listed, {info['bytes']} bytes",
            f"  incompressible, in the contacts' step, at most {info['stable_step']:.3g} s; last step: {info['passes']} passes, "
            f"{info['products']} products, speed {info['speed']:.3g} m/s, density off by {info['compression']:.2%}"
            if s["incompressible"]
            else f"  delta-SPH, sub-step at most {info['stable_step']:.3g} s; last step: {info['sub_steps']} sub-steps, "
            f"speed {info['speed']:.3g} m/s, compression {info['compression']:.2%}, {info['lists']} lists so far",
        ]
