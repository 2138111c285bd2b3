"""Values of bodies as arrays: a number, a row or rows for each body, spread over all bodies of a set."""

from __future__ import annotations

import numpy as np

from ..base import checks
from ..base.materials import Material


def spread(name, value, n, components, dim):
    """(n, components) from a row or n rows; rows of translations alone are padded with zero rotations."""
    array = checks.reals(name, value, f"give ({components},) or ({n}, {components})")
    if array.shape[-1:] == (dim,) and array.ndim in (1, 2):
        array = np.concatenate([array, np.zeros(array.shape[:-1] + (components - dim,))], axis=-1)
    if array.ndim == 1:
        array = np.broadcast_to(array, (n, components)) if array.shape == (components,) else array
    if array.shape != (n, components):
        raise ValueError(
            f"{name} has shape {np.shape(value)}: give ({components},) or ({n}, {components}), "
            f"or translations only, ({dim},) or ({n}, {dim})"
        )
    # copied, so that a later change of the user's array has no effect
    array = array if _stays_in_file(array) else np.array(array, dtype=array.dtype, order="C")
    return checks.real_array(name, array, (n, components))


def _stays_in_file(array):
    """True for a view of a file that nobody can write, see Scene.load."""
    while isinstance(array, np.ndarray):
        if array.flags.writeable:
            return False
        array = array.base
    return type(array).__name__ == "PyCapsule"


def per_body(name, value, shape):
    """An array of the given shape from a number, a row or a whole array."""
    array = checks.reals(name, value, f"give a number or an array of shape {checks.shape_text(shape)}")
    try:
        if array.shape == shape[:1] and len(shape) == 2 and shape[1] == 1:
            array = array[:, None]
        return np.broadcast_to(array, shape).copy()
    except (TypeError, ValueError):
        raise ValueError(
            f"{name} has shape {np.shape(value)}: give a number or an array of shape {checks.shape_text(shape)}"
        ) from None


def density_of(material, density):
    """The density given, or that of the material [kg/m3]. Raises ValueError where there is none."""
    if not isinstance(material, Material):
        raise ValueError(f"material is {material!r}: give a cairn.Material")
    value = material.density if density is None else checks.positive("density", density)
    if value is None:
        raise ValueError(f"density of material {material.name!r} is missing: Material({material.name!r}, density=...)")
    return value
