"""A periodic cell whose shape is driven, component by component."""


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
