"""Values of bodies as arrays: a number, a row or rows for each body, spread over all bodies of a set."""

from __future__ import annotations

import numpy as np

from ..base import checks
from ..base.materials import Material
from ..pre import mass_properties

SYMMETRIC = 1e-9  # of the largest entry: by how much a tensor of inertia may differ from its transpose, as rounded digits do


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


def principal_frames(name, tensors, n):
    """Principal moments (n, 3) and axes (n, 3, 3), columns, of one or n tensors of inertia [kg m2]. Raises ValueError for one
    that is not symmetric and positive definite."""
    tensors = checks.real_array(name, np.broadcast_to(checks.reals(name, tensors), (n, 3, 3)), (n, 3, 3))
    turned = np.swapaxes(tensors, 1, 2)
    off = np.abs(tensors - turned).max(axis=(1, 2)) > SYMMETRIC * np.abs(tensors).max(axis=(1, 2))
    if np.any(off):
        at = int(np.argmax(off))
        raise ValueError(f"{name}[{at}] is {tensors[at].tolist()}: give a tensor that is symmetric, Iij = Iji")
    moments, axes = mass_properties.principal((tensors + turned) / 2)
    if not np.all(moments > 0):
        at = int(np.argmin(moments.min(axis=1)))
        raise ValueError(f"{name}[{at}] has principal moments {moments[at].tolist()}: give a tensor whose moments are > 0")
    return moments, axes


def unit_quaternions(name, value, n):
    """Unit quaternions (n, 4), (w, x, y, z), from one or n of any length. Raises ValueError for one that is zero."""
    q = checks.spread(name, value, (n, 4), ", quaternions (w, x, y, z)")
    length = np.linalg.norm(q, axis=1, keepdims=True)
    if not np.all(length > 0):
        raise ValueError(f"{name}[{int(np.argmin(length))}] is zero: give a quaternion (w, x, y, z) of unit length")
    return q / length


def quaternion_product(p, q):
    """Quaternions (n, 4) of the rotations q followed by p."""
    w = p[:, :1] * q[:, :1] - np.sum(p[:, 1:] * q[:, 1:], axis=1, keepdims=True)
    return np.concatenate([w, p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])], axis=1)


def turned_by(q, x):
    """Vectors (n, 3) turned by unit quaternions (n, 4)."""
    t = 2 * np.cross(q[:, 1:], x)
    return x + q[:, :1] * t + np.cross(q[:, 1:], t)
