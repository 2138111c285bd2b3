"""Warnings of a liquid after steps, once in a run each."""

from __future__ import annotations

import warnings

import numpy as np

from .fluid_gaps import FluidWarning, gaps
from .fluid_start import warn_of_sub_steps

AT_START = 0.1  # difference of volumes that is told after the first step; edges of small blocks seem some percent larger
SWELLS, SHRINKS = 0.05, 0.1  # change of volume since then; surfaces that are not flat seem to lose some
LIGHT = 10.0  # factor by which a light body shortens sub-steps, above which it is told
EVERY = 16  # steps between looks at gaps, which take as long as a step of few particles


class FluidWatch:
    """Looks at the liquid of a simulation after steps."""

    def __init__(self, running):
        self._running, self._told, self._steps = running, set(), 0
        self._longest = 0.0  # step for which sub-steps were counted [s]

    def knows(self, name):
        """Leaves out a warning that was given at the start.

        Parameters
        ----------
        name : str
            "gaps".
        """
        self._told.add(name)

    def before(self, h, stable_step):
        """Warns once of a step that takes very many sub-steps, before it is made.

        Parameters
        ----------
        h : float
            Length of the step [s].
        stable_step : callable
            Gives the longest sub-step [s]; it is asked for steps longer than those before.
        """
        if h <= self._longest or "sub-steps" in self._told or self._running.settings["incompressible"]:
            return
        self._longest = h
        if warn_of_sub_steps(self._running.settings, stable_step(), h, above=7):
            self._told.add("sub-steps")

    def look(self, simulation, info):
        """Warns once of a liquid that swells or shrinks or flows back into an inflow, of light bodies, and of gaps that closed.

        Parameters
        ----------
        simulation : Simulation
            The simulation, after a step.
        info : dict
            What the core says of the liquid.
        """
        self._steps += 1
        wrong = {"volume": self._volume(simulation, info), "back flow": _back_flow(simulation, info), "light": _light(info)}
        for what, text in wrong.items():
            if text and what not in self._told:
                self._told.add(what)
                warnings.warn(text, FluidWarning, stacklevel=7)
        if "gaps" not in self._told and self._steps % EVERY == 0 and len(simulation.contacts):
            bodies, slips = self._running.met_surfaces()
            position, spacing = np.asarray(simulation.fluid.position), self._running.settings["spacing"]
            text = gaps(bodies, slips, position, spacing, self._running.held())
            if text:
                self._told.add("gaps")
                warnings.warn(f"step {simulation.steps}: {text}", FluidWarning, stacklevel=7)

    def _volume(self, simulation, info):
        """Text of a warning about the volume of the liquid, or None. Later volumes are compared with that after the first step,
        also of a run before a restart."""
        volume, begin = info["volume"], info["volume_begin"]
        if 1 - SHRINKS < volume < (1 + AT_START if volume == begin else max(1.0, begin) + SWELLS):
            return None
        slower = "a smaller dt, or leave out incompressible"
        remedy = slower if self._running.settings["incompressible"] else "a greater sound_speed or a smaller spacing"
        if len(simulation.scene.fluid_ends):
            remedy += ", and between walls that hold the liquid cn.Inflow a parabola, or cn.FreeSlip() to the walls"
        return (
            f"the liquid takes {volume:.1%} of the volume of its mass after step {simulation.steps}: particles that flew "
            f"apart have not come together again, or lay closer than the spacing; levels and pressures are wrong by that; "
            f"give {remedy}; see sim.fluid.info['volume']"
        )


def _back_flow(simulation, info):
    """Text of a warning about inflows, or None."""
    if not info["back_flow"]:
        return None
    return (
        f"{info['back_flow']} particles of the liquid stand in an inflow after step {simulation.steps}, more than a spacing "
        "behind its end: the liquid is pressed back, and the inflow pushes in more than there is room for; give a smaller "
        "velocity of cn.Inflow, a lower pressure at cn.Outflow, or a longer way before the obstacle"
    )


def _light(info):
    """Text of a warning about a body much lighter than the liquid, or None."""
    if not info["light_factor"] > LIGHT:
        return None
    return (
        f"body {info['light_body']} is so much lighter than the liquid about it that a step takes {info['sub_steps']} "
        f"sub-steps, {info['light_factor']:.3g} times as many as without it: give cn.fluid(incompressible=True), whose "
        "steps no light body shortens"
    )
