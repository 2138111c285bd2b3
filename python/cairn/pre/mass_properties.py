"""Area, volume, centre and inertia of polygons and polyhedra, exact to rounding, for many bodies at once.

A body is the signed sum of the simplices that its edges or faces make with a point near its middle (Mirtich 1996, Eberly
2002). Sums are taken about the body's middle in units of its size: distant, tiny or huge bodies keep their digits, and rescaling
the unit of length by a power of two changes the exponent alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..base import checks

# off-diagonal inertia below this share of the trace is rounding of the sums: such a body keeps the axes it was given in
ROUNDING = 256 * np.finfo(float).eps


class Properties(NamedTuple):
    """Mass properties of n bodies of density 1: measure (n,) area [m2] or volume [m3]; center (n, dim) [m]; moments (n, 1 | 3),
    polar (2D) or principal (3D), of the geometry about its centre [m4 | m5]; axes (n, dim, dim), principal axes as columns,
    right-handed; identity in 2D and where the given axes are principal already."""

    measure: np.ndarray
    center: np.ndarray
    moments: np.ndarray
    axes: np.ndarray


def polygons(vertices) -> Properties:
    """Properties of polygons, each (m, 2) [m], anticlockwise, of any number of vertices, convex or not.

    vertices: a list of n arrays, or one array (n, m, 2). Raises ValueError for clockwise or empty ones.
    """
    points, starts = stacked("vertices", vertices, 2)
    follower = np.arange(1, len(points) + 1)
    follower[np.append(starts[1:], len(points)) - 1] = starts
    owner = owners(starts, len(points))
    local, middle, size = normalised(points, starts, owner)
    a, b = local, local[follower]
    weight = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    area, first, second = moments_of((a, b), weight, starts)
    refuse_not_positive("vertices", "area", "list the corners anticlockwise", area / 2)
    center, second = about_center(area / 2, first / 6, second / 24)
    polar = np.trace(second, axis1=1, axis2=2)[:, None]
    square = size * size
    axes = np.broadcast_to(np.eye(2), (len(area), 2, 2)).copy()
    return Properties(area / 2 * square, middle + center * size[:, None], polar * (square * square)[:, None], axes)


def polyhedra(vertices, faces) -> Properties:
    """Properties of closed polyhedra whose faces, seen from outside, run anticlockwise.

    vertices: a list of n arrays (m, 3) [m]; faces: a list of n, each (k, 3) whole numbers or a list of polygons.
    A face that is not plane counts as the fan of triangles from its first corner. Whether the surface is closed is
    cairn.pre.mesh.check's to say. Raises ValueError where the volume is not positive.
    """
    points, starts = stacked("vertices", vertices, 3)
    if len(faces) != len(starts):
        raise ValueError(f"faces has {len(faces)} items and vertices {len(starts)}: give one list of faces for each body")
    sizes = np.diff(np.append(starts, len(points)))
    fans = [triangles(f, m, k) for k, (f, m) in enumerate(zip(faces, sizes))]
    first_fan = np.concatenate([[0], np.cumsum([len(f) for f in fans])[:-1]]).astype(np.int64)
    corners = np.concatenate([f + s for f, s in zip(fans, starts)])
    return polyhedra_of_arrays(points, starts, corners, first_fan)


def polyhedra_of_arrays(points, starts, corners, first_corner) -> Properties:
    """Mass properties from flat arrays: points (p, 3), starts (n,) first point of each body; corners (t, 3) triangles by number
    of point, first_corner (n,) first triangle of each body."""
    owner = owners(starts, len(points))
    local, middle, size = normalised(points, starts, owner)
    a, b, c = (local[corners[:, k]] for k in range(3))
    weight = np.einsum("ij,ij->i", a, np.cross(b, c))
    volume, first, second = moments_of((a, b, c), weight, first_corner)
    refuse_not_positive("faces", "volume", "turn the faces round, or close the surface (see cairn.pre.mesh)", volume / 6)
    center, second = about_center(volume / 6, first / 24, second / 120)
    moments, axes = principal(inertia_of(second))
    cube = size * size * size
    return Properties(
        volume / 6 * cube, middle + center * size[:, None], moments * (cube * size * size)[:, None], axes
    )


def inertia_of(second) -> np.ndarray:
    """Inertia tensors (n, 3, 3) from second moments (n, 3, 3), without the difference of large numbers a needle suffers."""
    tensor = -second
    for k in range(3):
        tensor[:, k, k] = second[:, k - 1, k - 1] + second[:, k - 2, k - 2]
    return tensor


def principal(tensor) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments (n, 3) and axes (n, 3, 3), columns, right-handed, of symmetric tensors (n, 3, 3)."""
    diagonal = np.einsum("nii->ni", tensor)
    off = np.abs(tensor - diagonal[:, :, None] * np.eye(3)).max(axis=(1, 2))
    moments = diagonal.copy()
    axes = np.broadcast_to(np.eye(3), tensor.shape).copy()
    turned = off > ROUNDING * diagonal.sum(axis=1)
    if np.any(turned):
        moments[turned], found = np.linalg.eigh(tensor[turned])
        found[:, :, 2] = np.cross(found[:, :, 0], found[:, :, 1])
        axes[turned] = found
    return moments, axes


def quaternions(axes) -> np.ndarray:
    """Unit quaternions (n, 4), (w, x, y, z) with w >= 0, of the rotations (n, 3, 3) from principal axes to space."""
    m = np.asarray(axes, float)
    # the largest of the four sums is at least 1: no small number is divided by (Shepperd 1978)
    t = np.stack([m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2], m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]], axis=1)
    best = np.argmax(t, axis=1)
    square = 1.0 + np.where(best == 0, t[:, 0], 2.0 * np.take_along_axis(t, best[:, None], 1)[:, 0] - t[:, 0])
    q = np.empty((len(m), 4))
    vector = np.stack([m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]], axis=1)
    symmetric = m + np.swapaxes(m, 1, 2)
    for k in range(4):
        at = best == k
        if k == 0:
            q[at, 0], q[at, 1:] = square[at], vector[at]
        else:
            q[at, 0], q[at, 1:] = vector[at, k - 1], symmetric[at, k - 1]
            q[at, k] = square[at]
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    return np.where(q[:, :1] < 0, -q, q)


def triangles(faces, vertices: int, body: int = 0) -> np.ndarray:
    """Faces as triangles (t, 3): polygons become fans from their first corner. Refuses corners that no vertex has."""
    if isinstance(faces, np.ndarray) and faces.ndim == 2 and faces.shape[1] == 3:
        fan = np.asarray(faces)
    else:
        fan = np.asarray([(f[0], f[k], f[k + 1]) for f in faces for k in range(1, len(f) - 1)])
        short = [k for k, f in enumerate(faces) if len(f) < 3]
        if short:
            raise ValueError(f"faces[{body}][{short[0]}] is {list(faces[short[0]])}: a face has at least three corners")
    if fan.size == 0 or fan.dtype.kind not in "iu":
        raise ValueError(f"faces[{body}] holds no whole numbers: give lists of numbers of vertices")
    wrong = np.argwhere((fan < 0) | (fan >= vertices))
    if len(wrong):
        value = fan[tuple(wrong[0])]
        raise ValueError(f"faces[{body}] names vertex {value}: the body has vertices 0 to {vertices - 1}")
    return fan.astype(np.int64)


def stacked(name: str, vertices, dim: int) -> tuple[np.ndarray, np.ndarray]:
    """All points as one array, and the number of the first point of each body."""
    parts = [checks.real_array(f"{name}[{k}]", np.asarray(v), (None, dim)) for k, v in enumerate(vertices)]
    if not parts:
        raise ValueError(f"{name} is empty: give at least one body")
    sizes = np.array([len(p) for p in parts])
    if np.any(sizes <= dim):
        at = int(np.argmax(sizes <= dim))
        raise ValueError(f"{name}[{at}] has {sizes[at]} corners: a body in {dim}D has at least {dim + 1}")
    return np.concatenate(parts), np.concatenate([[0], np.cumsum(sizes)[:-1]])


def owners(starts, count: int) -> np.ndarray:
    """Body of each of `count` items, from the first item of each body."""
    return np.repeat(np.arange(len(starts)), np.diff(np.append(starts, count)))


def normalised(points, starts, owner):
    """Points about the middle of their body's box in units of its size; middle (n, dim); size (n,)."""
    low, high = np.minimum.reduceat(points, starts), np.maximum.reduceat(points, starts)
    middle = low + (high - low) / 2
    size = np.max(high - low, axis=1) / 2
    if not np.all(size > 0):
        at = int(np.argmin(size))
        raise ValueError(f"vertices[{at}] are all the same point {points[starts[at]]}: give a body of some size")
    return (points - middle[owner]) / size[owner, None], middle, size


def moments_of(corners, weight, starts):
    """Weighted sums over simplices from the origin: of 1, of the sum s of the corners, of s s' + sum of corner corner'."""
    total = sum(corners)
    first = weight[:, None] * total
    second = sum(np.einsum("ni,nj->nij", x, x) for x in (*corners, total)) * weight[:, None, None]
    return tuple(np.add.reduceat(x, starts, axis=0) for x in (weight, first, second))


def about_center(measure, first, second):
    """Centre, and second moments moved to it."""
    center = first / measure[:, None]
    return center, second - measure[:, None, None] * np.einsum("ni,nj->nij", center, center)


def refuse_not_positive(field, what, remedy, values):
    # a body of volume below the rounding of its own sums has none
    bad = ~(values > 64 * np.finfo(float).eps)
    if np.any(bad):
        at = int(np.argmax(bad))
        state = "is inside out" if values[at] < 0 else "is flat"
        raise ValueError(f"{field}[{at}] {state}: its {what} is {values[at]:.3g} of its size; {remedy}")
