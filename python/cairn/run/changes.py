"""The energy balance, and the joints of a body, when bodies and joints change between steps."""

from __future__ import annotations

import numpy as np

from .present_joints import joints_present
from .views import core_of


def account(sim, kinetic, stored):
    """Adds changes of kinetic and stored energy [J] to the balance. Before the first step, where the balance starts, and with a
    strategy without a balance it does nothing."""
    if sim.steps and getattr(sim.strategy, "energy", True):
        core_of(sim).account_for_reshaping(kinetic, stored)


def joint_of(sim, number):
    """Name of a joint with an end on a rigid body, or None."""
    scene = core_of(sim).scene
    species = np.ravel(scene.contactor("material"))[np.ravel(scene.contactor("body")) == number]
    return next((name for name in joints_present(sim) if sim._species[name, name] in species), None)
