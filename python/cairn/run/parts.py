"""Steps made in parts (sub-steps): loads at the time of each part, and the state that users' functions see in between."""

from __future__ import annotations

import weakref

from .views import core_of


def ask_for_parts(simulation):
    """Lets the core ask the simulation for loads, gravity and driven velocities before each part of a step."""
    own = weakref.ref(simulation)  # weak, since the core keeps the function and would keep the simulation
    core_of(simulation).before_parts(lambda h: _ready(own(), h))


def _ready(simulation, h):
    """Prepares the loads of a part of h [s]. For users' functions the previous part is the last step: forces are its impulses
    over its own length."""
    place = simulation._stage
    if place.begin is not None and simulation.time > place.begin:
        simulation._info = {**simulation._info, "dt": core_of(simulation).report()["dt"]}
    place.asks = True
    try:
        simulation.ready(h)
    finally:
        place.asks = False
