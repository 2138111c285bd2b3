"""A periodic cell whose shape is driven, component by component."""


def drive_cell(core, scene):
    """Hands what drives the cell of a scene to the core. Raises ValueError for what does not fit the cell."""
    rates, stresses = scene.periodic.components(scene.dim)
    if not rates and not stresses and not scene.periodic.constant_volume:
        return
    for name, text in rates.items():
        core.drive_cell(name, text)
    for name, text in stresses.items():
        core.press_cell(name, text)
    core.weigh_cell(float(scene.periodic.inertia), float(scene.depth), bool(scene.periodic.constant_volume))
