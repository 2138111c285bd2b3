"""A periodic cell whose shape is driven, component by component."""

from __future__ import annotations

import dataclasses

import numpy as np

from ..base.time_functions import Expression
from . import scene_warnings, unit_warnings
from .given_values import three


class CellDriving:
    """Methods of Simulation for its periodic cell and for the area of walls that press."""

    def loaded_area(self, normal):
        """Gives the area of a wall between those that face each other across its normal, see Servo.

        Parameters
        ----------
        normal : array_like (dim,)
            Its normal, a unit vector.

        Returns
        -------
        float
            Area [m2].

        Raises
        ------
        ValueError
            If no two planes face each other.
        """
        return self._core.loaded_area(three(normal), "walls", self.scene.depth)

    @property
    def cell(self):
        """The periodic cell at the present time, a dict.

        vectors: edges of the cell as rows (dim, dim) [m]; lengths (dim,) [m]; rate: velocity gradient (dim, dim) [1/s];
        stress: mean stress of the contacts in the last step (upper triangle, compression positive) [Pa], zero unless the
        cell is driven by a rate, a stress or a constant volume."""
        found = self._core.driven_cell()
        return {**found, "lengths": np.diag(found["vectors"]).copy()}

    def drive_cell(self, rate=None, stress=None, constant_volume=False):
        """Drives the periodic cell in later steps, as Periodic does, in the place of what drove it; all else stays.

        Parameters
        ----------
        rate : dict, optional
            {component: rate [1/s]}.
        stress : float, callable or dict, optional
            Pressure along all axes or {component: stress} [Pa].
        constant_volume : bool, default False
            Lengths that have neither keep the volume.

        Raises
        ------
        ValueError
            If the scene has no periodic cell, or a component is none or has a value that the core cannot evaluate.
        """
        self.between_steps("drive_cell", rate=rate, stress=stress, constant_volume=constant_volume)
        if self.scene.periodic is None:
            raise ValueError("the scene has no periodic cell: give cairn.Scene(periodic=cairn.Periodic(...))")
        given = {"rate": rate, "stress": stress, "constant_volume": constant_volume, "shear_rate": 0.0}
        cell = dataclasses.replace(self.scene.periodic, **given)
        cell.components(self.scene.dim)
        change(self._core, self.scene, cell)
        unit_warnings.warn_of_cell(cell, self.dt, 3)
        scene_warnings.warn_of_tension(self, cell, 3)
        self._cell = cell


def drive_cell(core, scene, cell):
    """Hands rates and stresses of a cell, a Periodic, to the core. Raises ValueError if they do not fit the cell."""
    rates, stresses = cell.components(scene.dim)
    if not rates and not stresses and not cell.constant_volume:
        return
    for name, text in rates.items():
        core.drive_cell(name, text)
    for name, text in stresses.items():
        core.press_cell(name, text)
    core.weigh_cell(float(cell.inertia), float(scene.depth), bool(cell.constant_volume))


def change(core, scene, cell):
    """Replaces the drive of the periodic cell by that of `cell`, a Periodic."""
    core.release_cell()
    drive_cell(core, scene, cell)


def to_dict(core, scene, cell):
    """Entry of a checkpoint for what drives the cell; {} without a cell. own: as the scene tells, by no later drive_cell."""
    if cell is None:
        return {}
    rates, stresses = cell.components(scene.dim)
    told = {"rate": rates, "stress": stresses, "constant_volume": int(cell.constant_volume), "own": int(cell is scene.periodic)}
    return {"cell": {**told, "kept_volume": float(core.kept_volume)}}


def from_dict(scene, told):
    """The Periodic that an entry of to_dict tells, and the volume that it keeps [m3]. Raises ValueError if it fits no cell of the
    scene."""
    if scene.periodic is None:
        raise ValueError("a periodic cell is driven, and the scene has none")
    volume = float(told["kept_volume"])
    if told["own"]:
        return scene.periodic, volume
    rate, stress = ({name: Expression(text) for name, text in told[key].items()} for key in ("rate", "stress"))
    given = {"rate": rate, "stress": stress, "constant_volume": bool(told["constant_volume"]), "shear_rate": 0.0}
    cell = dataclasses.replace(scene.periodic, **given)
    cell.components(scene.dim)
    return cell, volume
