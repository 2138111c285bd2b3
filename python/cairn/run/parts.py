"""Parts of a step that is made in parts: loads of their own time, and what functions of the simulation see meanwhile."""

from __future__ import annotations

import weakref

from .views import core_of


def ask_for_parts(simulation):
    """From now on the core asks the simulation before each part for its loads, gravity and driven velocities."""
    own = weakref.ref(simulation)  # the core holds what it calls
    core_of(simulation).before_parts(lambda h: _ready(own(), h))


def _ready(simulation, h):
    """The part before is to them what the last step is to a whole one: forces are its impulses over its own length."""
    place = simulation._stage
    if place.begin is not None and simulation.time > place.begin:
        simulation._info = {**simulation._info, "dt": core_of(simulation).report()["dt"]}
    place.asks = True
    try:
        simulation.ready(h)
    finally:
        place.asks = False
