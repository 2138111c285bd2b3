"""Measures of granular physics: coordination, solid fraction, fabric, stress, distribution of forces.

Functions of arrays; `measure` applies them to an output of a run. Stress is positive in tension; forces are impulses over
the step h; contact quantities act on the first body (A), the normal points from B to A.
"""

import numpy as np

from .. import _core
from ..base import checks
from ..base.errors import FileError
from ..base.geometry import cell_of, contactors_of, images_about, lever_arms
from .overlap import box_vertices, disk_polygon_area, sphere_box_volume


def contact_counts(n, body_a, body_b):
    """Contacts of each of n bodies, shape (n,); body_a, body_b (m,) rows of the bodies of each contact."""
    return np.bincount(body_a, minlength=n) + np.bincount(body_b, minlength=n)


def rattlers(n, body_a, body_b, least=2, counted=None):
    """Bodies that carry nothing: with fewer than `least` contacts once the other rattlers are taken away; (n,) of bool.

    counted : (n,) of bool, bodies that may be rattlers (walls may not); all if None.
    """
    counted = np.ones(n, bool) if counted is None else np.asarray(counted, bool)
    loose = np.zeros(n, bool)
    body_a, body_b = np.asarray(body_a), np.asarray(body_b)
    while True:
        kept = ~(loose[body_a] | loose[body_b])
        now = counted & (contact_counts(n, body_a[kept], body_b[kept]) < least)
        if np.array_equal(now | loose, loose):
            return loose
        loose |= now


def coordination_number(n, body_a, body_b, without_rattlers=False, least=2, counted=None):
    """Mean number of contacts of a body: 2 Nc / N, a contact with a wall counted once. NaN if no body counts.

    body_a, body_b : (m,) rows of the bodies of each contact that counts (the loaded ones, say).
    counted : (n,) of bool, bodies over which the mean is taken (not walls); all if None.
    without_rattlers : leave out bodies with fewer than `least` contacts, again until none is left.
    """
    counted = np.ones(n, bool) if counted is None else np.asarray(counted, bool)
    body_a, body_b = np.asarray(body_a, dtype=np.int64), np.asarray(body_b, dtype=np.int64)
    if without_rattlers:
        loose = rattlers(n, body_a, body_b, least, counted)
        kept = ~(loose[body_a] | loose[body_b])
        body_a, body_b, counted = body_a[kept], body_b[kept], counted & ~loose
    if not counted.any():
        return float("nan")
    return float(contact_counts(n, body_a, body_b)[counted].mean())


def solid_fraction(centers, radii, low=None, high=None, polygon=None):
    """Share of a region that disks (2D) or spheres (3D) fill, those cut by its border in part.

    centers (n, dim), radii (n,) [m]; the region is the box from low to high (dim,) [m], or in 2D a polygon (k, 2) [m].
    Where bodies overlap each other, the overlap counts twice.
    """
    centers, radii = np.asarray(centers, dtype=float), np.asarray(radii, dtype=float)
    if polygon is not None:
        return float(disk_polygon_area(centers, radii, polygon).sum() / _area(polygon))
    if low is None or high is None:
        raise ValueError("a region is needed: give low and high, or in 2D a polygon")
    size = np.asarray(high, dtype=float) - np.asarray(low, dtype=float)
    if size.shape != (centers.shape[1],) or not np.all(size > 0):
        dim = centers.shape[1]
        raise ValueError(f"the box from low = {low} to high = {high} is empty or not of {dim} dimensions: give two corners")
    if centers.shape[1] == 2:
        return float(disk_polygon_area(centers, radii, box_vertices(low, high)).sum() / np.prod(size))
    return float(sphere_box_volume(centers, radii, low, high).sum() / np.prod(size))


def fabric_tensor(normals, weights=None):
    """Fabric tensor <n n>, shape (dim, dim), of trace 1 (Satake 1982). normals (m, dim); weights (m,) or None."""
    normals = checks.real_array("normals", normals, (None, None))
    if len(normals) == 0:
        return np.full((normals.shape[1],) * 2, np.nan)
    weights = np.ones(len(normals)) if weights is None else np.asarray(weights, dtype=float)
    return np.einsum("k,ki,kj->ij", weights, normals, normals) / weights.sum()


def body_moments(n, body_a, body_b, forces, arm_a, arm_b):
    """Internal moment of each body, sum over its contacts of force x arm [N m], shape (n, dim, dim) (Moreau 1997).

    forces (m, dim) [N] on A; arm_a, arm_b (m, dim) [m] from the centres to the contact point.
    """
    dim = forces.shape[1]
    result = np.zeros((n, dim, dim))
    for i in range(dim):
        for j in range(dim):
            result[:, i, j] = np.bincount(body_a, forces[:, i] * arm_a[:, j], n) - np.bincount(
                body_b, forces[:, i] * arm_b[:, j], n
            )
    return result


def stress_tensor(forces, branches, volume):
    """Mean stress -1/V sum f l of a packing, tension positive [Pa], shape (dim, dim) (Love 1927, Weber 1966).

    forces (m, dim) [N] on A; branches (m, dim) [m] from the centre of B to that of A, or for a contact with a wall from the
    contact point to the centre of A; volume [m3], in 2D area times depth.
    """
    return -np.einsum("ki,kj->ij", np.asarray(forces, dtype=float), np.asarray(branches, dtype=float)) / volume


def pressure_and_deviator(stress):
    """Mean pressure p (positive in compression) and deviator q: in 2D half the difference of the principal stresses, in 3D
    von Mises' sqrt(3/2 s:s) [Pa]."""
    stress = 0.5 * (stress + np.swapaxes(stress, -1, -2))
    dim = stress.shape[-1]
    p = -np.trace(stress, axis1=-2, axis2=-1) / dim
    s = stress + p[..., None, None] * np.eye(dim)
    return p, np.sqrt((0.5 if dim == 2 else 1.5) * np.sum(s * s, axis=(-2, -1)))


def force_distribution(forces, bins=50, largest=6.0):
    """Probability density of forces over their mean, loaded contacts only (Radjai et al. 1996).

    forces (m,) [N], normal forces say. Returns (centres of the bins, density), each (bins,); forces beyond `largest` times
    the mean count for the norm and are not shown.
    """
    forces = np.asarray(forces, dtype=float)
    forces = forces[forces > 0]
    edges = np.linspace(0.0, largest, bins + 1)
    if len(forces) == 0:
        return 0.5 * (edges[1:] + edges[:-1]), np.zeros(bins)
    counts, _ = np.histogram(forces / forces.mean(), edges)
    return 0.5 * (edges[1:] + edges[:-1]), counts / (len(forces) * np.diff(edges))


def measure(step, low=None, high=None, polygon=None, dt=None, depth=1.0, bodies=None):
    """All measures of one output: a dict.

    Region: a box from low to high, a polygon in 2D, or if neither is given the box around all disks and spheres that count and
    the centres of the others; along axes that repeat, all of the periodic cell. There a region is no longer than the cell, and
    bodies count by their images. dt : step [s] that turns impulses into forces, the run's own if None. depth : of a 2D scene
    [m].

    bodies : ids of those that count, (k,); None: disks and spheres, and all bodies of other shapes that have a mass, such as
    polygons, polyhedra, capsules, cylinders, superquadrics. Walls do not count, nor deformable bodies, whose nodes have no size.
    A body that is held and has a mass does: give `bodies` without it.

    Of those that count and have their centre in the region: coordination, coordination_without_rattlers, rattlers (their share),
    stress (dim, dim) [Pa], pressure, deviator [Pa], and of their loaded contacts: contacts (how many), fabric (dim, dim).
    solid_fraction of the region by all disks and spheres that count; NaN, not known, where bodies of other shapes do.
    """
    from .drawing import step_size

    for name, corner in (("low", low), ("high", high)):
        if corner is not None:
            checks.real_array(name, corner, (step.dim,))
    dim, n = step.dim, len(step.drawn)
    balls, others = _grains(step)
    if bodies is not None:
        chosen = np.zeros(n, bool)
        chosen[step.rows_of(bodies)] = True
        balls, others = balls.where(chosen[balls.body]), others & chosen
    counted = others.copy()
    counted[balls.body] = True
    loaded = np.any(step.contacts["impulse"] != 0, axis=1)
    row_a, row_b, arm_a, arm_b = (x[loaded] for x in lever_arms(step))
    forces = step.contacts["impulse"][loaded] / (step_size(step) if dt is None else dt)
    cell = cell_of(step)
    whole = cell is not None and polygon is None and low is None  # of the cell
    if polygon is None and low is None:
        low, high = _around(step, balls, others, cell)
    elif cell is not None:
        _within(cell, low, high, polygon)
    volume = depth * _area(polygon) if polygon is not None else np.prod(np.subtract(high, low)) * (depth if dim == 2 else 1.0)
    inside = counted.copy() if whole else counted & _inside(step.drawn["position"], low, high, polygon, cell)
    moments = body_moments(n, row_a, row_b, forces, arm_a, arm_b)
    stress = moments[inside].sum(0) / volume if np.any(inside) and volume > 0 else np.full((dim, dim), np.nan)
    pressure, deviator = pressure_and_deviator(stress)
    # a rattler leans on bodies beyond the border, too: who is one is asked of all that count
    loose = rattlers(n, row_a, row_b, 2, counted)
    bears = ~(loose[row_a] | loose[row_b])
    known = len(balls) > 0 and not np.any(others)
    own = inside[row_a] | inside[row_b]
    return {
        "contacts": int(own.sum()),
        "coordination": coordination_number(n, row_a, row_b, counted=inside),
        "coordination_without_rattlers": coordination_number(n, row_a[bears], row_b[bears], counted=inside & ~loose),
        "rattlers": float(loose[inside].mean()) if inside.any() else float("nan"),
        "solid_fraction": _filled(balls, low, high, polygon, cell, whole) if known else np.nan,
        "fabric": fabric_tensor(step.contacts["normal"][loaded][own]),
        "stress": stress,
        "pressure": float(pressure),
        "deviator": float(deviator),
    }


def _grains(step):
    """Balls of finite radius of a step, and a mask (n,) of the massive bodies that have another shape. Bodies whose shape the
    file does not record, as those added later, are in the mask."""
    n = len(step.drawn)
    massive = np.isfinite(step.drawn["mass"]) if "mass" in step.drawn else np.ones(n, bool)
    contactors = contactors_of(step)
    balls = contactors.select(*_core.shapes("ball"))
    balls = balls.where(balls.radius > 0)
    movers = np.setdiff1d(_core.shapes("mover"), _core.shapes("ball"))
    others = np.zeros(n, bool)
    others[contactors.select(*movers).body] = True
    old = "meshes" in step.run.scene and not len(step.nodes)  # its nodes are among the bodies, and touch nothing, some of them
    untold = np.setdiff1d(np.arange(0 if old else len(step.bodies)), contactors.body)
    others[untold] = True
    return balls, others & massive


def _area(polygon):
    polygon = np.asarray(polygon, dtype=float)
    x, y = (polygon - polygon.mean(0)).T  # far from zero, too
    return 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def _around(step, balls, others, cell):
    """The box round all balls and the centres of the others, and along axes that repeat the cell."""
    center = np.concatenate([balls.center, step.drawn["position"][others]])
    radius = np.concatenate([balls.radius, np.zeros(int(others.sum()))])
    if not np.all(np.isfinite(center)):
        what = f"output {step.index} holds positions that are no numbers"
        raise FileError(step.run.path, what, "give the region that is measured, or use a copy of it")
    low = (center - radius[:, None]).min(0, initial=np.inf)
    high = (center + radius[:, None]).max(0, initial=-np.inf)
    if cell is None:
        return low, high
    end = cell.corner + np.diagonal(cell.vectors)
    return np.where(cell.periodic, cell.corner, low), np.where(cell.periodic, end, high)


def _corners(low, high, polygon):
    """Lowest and highest corner of the box round a region."""
    return (np.min(polygon, axis=0), np.max(polygon, axis=0)) if polygon is not None else (np.asarray(low), np.asarray(high))


def _within(cell, low, high, polygon):
    """A region that is longer than the cell would hold bodies more than once."""
    low, high = _corners(low, high, polygon)
    over = np.flatnonzero(high - low > cell.lengths * (1 + 1e-6))
    if len(over):
        k = over[0]
        raise ValueError(
            f"the region is {high[k] - low[k]:g} m long along {'xyz'[k]}, and the periodic cell {cell.lengths[k]:g} m: give one "
            "that is no longer, or none for all of the cell"
        )


def _filled(balls, low, high, polygon, cell, whole):
    """Solid fraction of the region by balls, and by their images in a cell."""
    if cell is None:
        return solid_fraction(balls.center, balls.radius, low, high, polygon)
    if whole:  # none is cut
        dim = balls.center.shape[1]
        return float(np.sum((np.pi if dim == 2 else 4 / 3 * np.pi) * balls.radius**dim) / np.prod(np.subtract(high, low)))
    middle = np.mean(_corners(low, high, polygon), axis=0)
    return sum(solid_fraction(x, balls.radius, low, high, polygon) for x in images_about(balls.center, middle, cell))


def _inside(points, low, high, polygon, cell):
    """Which points have an image in the region, (n,) of bool."""
    if cell is None:
        return _holds(points, low, high, polygon)
    middle = np.mean(_corners(low, high, polygon), axis=0)
    return np.any([_holds(x, low, high, polygon) for x in images_about(points, middle, cell)], axis=0)


def _holds(points, low, high, polygon):
    """Points in the region, (n,) of bool; in a polygon by the number of edges that a ray crosses."""
    if polygon is None:
        return np.all((points >= low) & (points <= high), axis=1)
    polygon, result = np.asarray(polygon, dtype=float), np.zeros(len(points), bool)
    for (x0, y0), (x1, y1) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        between = (y0 > points[:, 1]) != (y1 > points[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = x0 + (points[:, 1] - y0) * (x1 - x0) / (y1 - y0)
        result ^= between & (points[:, 0] < crossing)
    return result
