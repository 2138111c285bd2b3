"""The joints that a simulation has, and their contacts."""

from __future__ import annotations

import numpy as np


def joints_present(simulation):
    """Names of the present joints, in the order in which they were joined."""
    gone = {a for a, b, law in simulation._rules if law is None and a == b}
    return [a for a, b, law in simulation._rules if law is not None and law.name == "joint" and a not in gone]


def rows_of_joints(simulation, scene, key):
    """Finds the contacts of joints.

    Parameters
    ----------
    simulation : Simulation
        The simulation.
    scene : _core.Scene
        Its scene of the core.
    key : ndarray (n, 4)
        Keys of the contacts, whose first number is the id of a contactor.

    Returns
    -------
    dict
        {name of a joint: row}, in the order in which they were joined.
    """
    material = np.ravel(scene.contactor("material"))[np.searchsorted(scene.contactor("id"), key[:, 0])]
    row = {int(number): at for at, number in enumerate(material)}
    numbers = {name: simulation._species[name, name] for name in joints_present(simulation)}
    return {name: row[number] for name, number in numbers.items() if number in row}
