"""A periodic cell whose shape is driven, component by component."""

import dataclasses

from ..base.time_functions import Expression


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
