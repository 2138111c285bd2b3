"""Measures of granular physics: coordination, solid fraction, fabric, stress, distribution of forces.

Functions of arrays; `measure` applies them to an output of a run. Stress is positive in tension; forces are impulses over
the step h; contact quantities act on the first body (A), the normal points from B to A.
"""

import numpy as np

from .. import _core
from ..base import checks
from ..base.errors import FileError
from ..base.geometry import cell_of, contactors_of, images_about, lever_arms
from ..names import teach
from .overlap import box_vertices, disk_polygon_area, sphere_box_volume


def contact_counts(n, body_a, body_b):
    """Counts the contacts of each body.

    Parameters
    ----------
    n : int
        Number of bodies.
    body_a : array_like (m,)
        Row of the first body of each contact.
    body_b : array_like (m,)
        Row of the second body of each contact.

    Returns
    -------
    ndarray (n,)
        Number of contacts of each body.
    """
    return np.bincount(body_a, minlength=n) + np.bincount(body_b, minlength=n)


def rattlers(n, body_a, body_b, least=2, counted=None):
    """Finds the bodies that carry nothing.

    They have fewer than `least` contacts once the other rattlers are taken away.

    Parameters
    ----------
    n : int
        Number of bodies.
    body_a : array_like (m,)
        Row of the first body of each contact.
    body_b : array_like (m,)
        Row of the second body of each contact.
    least : int, default 2
        Contacts that a body needs to carry something.
    counted : array_like (n,) of bool, optional
        Bodies that may be rattlers (walls may not); all if None.

    Returns
    -------
    ndarray (n,) of bool
        True for rattlers.
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
    """Gives the mean number of contacts of a body: 2 Nc / N, a contact with a wall counted once.

    Parameters
    ----------
    n : int
        Number of bodies.
    body_a : array_like (m,)
        Row of the first body of each contact that counts (the loaded ones, say).
    body_b : array_like (m,)
        Row of the second body of each contact that counts.
    without_rattlers : bool, default False
        Leaves out bodies with fewer than `least` contacts, again until none is left.
    least : int, default 2
        Contacts that a body needs to be none of them.
    counted : array_like (n,) of bool, optional
        Bodies over which the mean is taken (not walls); all if None.

    Returns
    -------
    float
        The mean [-]; NaN if no body counts.
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
    """Gives the share of a region that disks (2D) or spheres (3D) fill, those cut by its border in part.

    Where bodies overlap each other, the overlap counts twice.

    Parameters
    ----------
    centers : array_like (n, dim)
        Centres [m].
    radii : array_like (n,)
        Radii [m].
    low : array_like (dim,), optional
        Lowest corner of the box that is the region [m].
    high : array_like (dim,), optional
        Highest corner of the box [m].
    polygon : array_like (k, 2), optional
        Corners of a region in 2D [m], in the place of a box.

    Returns
    -------
    float
        The share [-].

    Raises
    ------
    ValueError
        If there is no region, or the box is empty.

    Examples
    --------
    >>> from cairn.post import measures
    >>> round(measures.solid_fraction([[0.5, 0.5]], [0.5], low=(0, 0), high=(1, 1)), 6)
    0.785398
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
    """Gives the fabric tensor <n n>, of trace 1.

    Parameters
    ----------
    normals : array_like (m, dim)
        Unit normals of contacts.
    weights : array_like (m,), optional
        Weight of each contact; 1 when not given.

    Returns
    -------
    ndarray (dim, dim)
        The tensor [-]; NaN without contacts.

    Notes
    -----
    Source: Satake (1982).
    """
    normals = checks.real_array("normals", normals, (None, None))
    if len(normals) == 0:
        return np.full((normals.shape[1],) * 2, np.nan)
    weights = np.ones(len(normals)) if weights is None else np.asarray(weights, dtype=float)
    return np.einsum("k,ki,kj->ij", weights, normals, normals) / weights.sum()


def body_moments(n, body_a, body_b, forces, arm_a, arm_b):
    """Gives the internal moment of each body, the sum over its contacts of force x arm.

    Parameters
    ----------
    n : int
        Number of bodies.
    body_a : ndarray (m,)
        Row of the first body of each contact.
    body_b : ndarray (m,)
        Row of the second body of each contact.
    forces : ndarray (m, dim)
        Forces on the first body [N].
    arm_a : ndarray (m, dim)
        From the centre of the first body to the contact point [m].
    arm_b : ndarray (m, dim)
        From the centre of the second body to the contact point [m].

    Returns
    -------
    ndarray (n, dim, dim)
        Moments [N m].

    Notes
    -----
    Source: Moreau (1997).
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
    """Gives the mean stress -1/V sum f l of a packing, tension positive.

    Parameters
    ----------
    forces : array_like (m, dim)
        Forces on the first body of each contact [N].
    branches : array_like (m, dim)
        From the centre of the second body to that of the first, or for a contact with a wall from the contact point to the
        centre of the first [m].
    volume : float
        Volume [m3], in 2D area times depth.

    Returns
    -------
    ndarray (dim, dim)
        Stress [Pa].

    Notes
    -----
    Sources: Love (1927), Weber (1966).
    """
    return -np.einsum("ki,kj->ij", np.asarray(forces, dtype=float), np.asarray(branches, dtype=float)) / volume


def pressure_and_deviator(stress):
    """Gives mean pressure and deviator of a stress.

    Parameters
    ----------
    stress : ndarray (..., dim, dim)
        Stress, tension positive [Pa].

    Returns
    -------
    p : float or ndarray (...)
        Mean pressure, positive in compression [Pa].
    q : float or ndarray (...)
        In 2D half the difference of the principal stresses, in 3D von Mises' sqrt(3/2 s:s) [Pa].
    """
    stress = 0.5 * (stress + np.swapaxes(stress, -1, -2))
    dim = stress.shape[-1]
    p = -np.trace(stress, axis1=-2, axis2=-1) / dim
    s = stress + p[..., None, None] * np.eye(dim)
    return p, np.sqrt((0.5 if dim == 2 else 1.5) * np.sum(s * s, axis=(-2, -1)))


def force_distribution(forces, bins=50, largest=6.0):
    """Gives the probability density of forces over their mean, of loaded contacts only.

    Parameters
    ----------
    forces : array_like (m,)
        Forces [N], normal forces say; those that are not positive do not count.
    bins : int, default 50
        Number of bins.
    largest : float, default 6
        End of the last bin, over the mean; forces beyond it count for the norm and are not shown.

    Returns
    -------
    centres : ndarray (bins,)
        Centres of the bins [-].
    density : ndarray (bins,)
        Density in each bin [-].

    Notes
    -----
    Source: Radjai et al. (1996).
    """
    forces = np.asarray(forces, dtype=float)
    forces = forces[forces > 0]
    edges = np.linspace(0.0, largest, bins + 1)
    if len(forces) == 0:
        return 0.5 * (edges[1:] + edges[:-1]), np.zeros(bins)
    counts, _ = np.histogram(forces / forces.mean(), edges)
    return 0.5 * (edges[1:] + edges[:-1]), counts / (len(forces) * np.diff(edges))


def lacey_index(positions, marked, sample, low=None, high=None, weights=None):
    """Gives Lacey's mixing index of two components, from the spread of their shares over equal cells.

    Parameters
    ----------
    positions : array_like (n, dim)
        Centres of the bodies [m].
    marked : array_like (n,) of bool
        Which bodies are of the first component.
    sample : float or array_like (dim,)
        Sides of the cells [m], several bodies wide.
    low, high : array_like (dim,), optional
        Box that is divided into cells [m]; that round all positions when not given.
    weights : array_like (n,), optional
        Weight of each body, as its mass; 1 when not given.

    Returns
    -------
    float
        M = (s0^2 - s^2) / (s0^2 - sr^2), s^2 the variance of the share of the first component over cells, weighted by their
        contents, s0^2 = p (1 - p) of separate components, sr^2 = s0^2 / n of a random mixture with n bodies in a cell: 0
        separate, 1 mixed at random. NaN where there is one component alone, or one body in a cell.

    Raises
    ------
    ValueError
        If shapes do not fit, or the sample is not above 0.

    Notes
    -----
    Source: Lacey (1954). With bodies of different weights n is the number of equal bodies that would have the same spread,
    (sum w)^2 / sum w^2 (Kish 1965).
    """
    positions = checks.real_array("positions", positions, (None, None))
    count, dim = positions.shape
    marked = np.asarray(marked)
    if marked.shape != (count,) or marked.dtype != bool:
        raise ValueError(f"marked has shape {marked.shape} of {marked.dtype}: give ({count},) of bool, material == 1 say")
    weights = np.ones(count) if weights is None else checks.positive_array("weights", weights)
    if weights.shape != (count,):
        raise ValueError(f"weights has shape {weights.shape}: give one for each of the {count} bodies")
    sample = checks.positive_array("sample", checks.spread("sample", sample, (dim,), " [m]"))
    low = positions.min(axis=0) if low is None else checks.real_array("low", low, (dim,))
    high = positions.max(axis=0) if high is None else checks.real_array("high", high, (dim,))
    inside = np.all((positions >= low) & (positions <= high), axis=1)
    cells = np.maximum(np.ceil((high - low) / sample - 1e-9).astype(int), 1)
    at = np.minimum(((positions[inside] - low) / sample).astype(int), cells - 1)
    cell = np.unique(np.ravel_multi_index(at.T, cells), return_inverse=True)[1].ravel()
    w, first = weights[inside], marked[inside]
    if not len(w) or first.all() or not first.any():
        return float("nan")
    total, ours, square = (np.bincount(cell, x) for x in (w, w * first, w * w))
    p = ours.sum() / total.sum()
    spread = np.sum(total * (ours / total - p) ** 2) / total.sum()
    # a random mixture has s0^2 / n_c in a cell of n_c bodies; weighted by contents, the mean over the cells
    share = np.sum(total * square / total**2) / total.sum()
    return float((p * (1 - p) - spread) / (p * (1 - p) * (1 - share))) if share < 1 - 1e-12 else float("nan")


def segregation(heights, marked, weights=None):
    """Gives how far a component has gathered on top of the other, by ranks of height.

    Parameters
    ----------
    heights : array_like (n,)
        Coordinates along the direction in which components may part [m]; distances from an axis for radial segregation.
    marked : array_like (n,) of bool
        Which bodies are of the first component.
    weights : array_like (n,), optional
        Weight of each body, as its volume; 1 when not given.

    Returns
    -------
    float
        1 if all of the first component lies above the other, -1 if below, about 0 if mixed: the probability that a pair of one
        each has the first above, less that it has it below. NaN where there is one component alone.

    Raises
    ------
    ValueError
        If shapes do not fit.

    Notes
    -----
    Source: Somers (1962), for pairs weighted by the product of their weights.
    """
    heights = checks.real_array("heights", heights, (None,))
    marked = np.asarray(marked)
    if marked.shape != heights.shape or marked.dtype != bool:
        raise ValueError(f"marked has shape {marked.shape} of {marked.dtype}: give {heights.shape} of bool, material == 1 say")
    weights = np.ones(len(heights)) if weights is None else checks.positive_array("weights", weights)
    if weights.shape != heights.shape:
        raise ValueError(f"weights has shape {weights.shape}: give one for each of the {len(heights)} bodies")
    if not len(heights) or marked.all() or not marked.any():
        return float("nan")
    level = np.unique(heights, return_inverse=True)[1].ravel()
    ours, theirs = np.bincount(level, weights * marked), np.bincount(level, weights * ~marked)
    below = np.cumsum(theirs) - theirs
    above = theirs.sum() - below - theirs
    return float(np.sum(ours * (below - above)) / (ours.sum() * theirs.sum()))


def measure(step, low=None, high=None, polygon=None, dt=None, depth=1.0, bodies=None):
    """Gives all measures of one output.

    Parameters
    ----------
    step : Step
        The output, run[i].
    low : array_like (dim,), optional
        Lowest corner of a box that is the region [m]. Without box and polygon the region is the box around all disks and spheres
        that count and the centres of the others; along axes that repeat, all of the periodic cell. There a region is no longer
        than the cell, and bodies count by their images.
    high : array_like (dim,), optional
        Highest corner of the box [m].
    polygon : array_like (k, 2), optional
        Corners of a region in 2D [m].
    dt : float, optional
        Step that turns impulses into forces [s]; the run's own if None.
    depth : float, default 1
        Thickness of a 2D scene [m].
    bodies : array_like (k,), optional
        Ids of the bodies that count. None: disks and spheres, and all bodies of other shapes that have a mass, such as polygons,
        polyhedra, capsules, cylinders, superquadrics. Walls do not count, nor deformable bodies, whose nodes have no size. A body
        that is held and has a mass does: give `bodies` without it.

    Returns
    -------
    dict
        Measures of the bodies that count and have their centre in the region: coordination, coordination_without_rattlers,
        rattlers (their share), stress (dim, dim) [Pa], pressure, deviator [Pa]; and of their loaded contacts: contacts (how
        many), fabric (dim, dim). solid_fraction is that of the region by all disks and spheres that count; NaN, not known, where
        bodies of other shapes do.

    Raises
    ------
    ValueError
        If step is no output of a run, a corner is wrong, or the region is longer than the periodic cell.
    FileError
        If positions are no numbers.
    """
    from .drawing import step_size

    if not hasattr(step, "drawn"):
        remedy = "give run[-1] of run = cn.load(output), from sim.run(..., output=output); sim.contacts and sim.bodies have " \
                 "the state of a simulation"  # fmt: skip
        raise ValueError(f"step is a {type(step).__name__}, and measures are those of an output of a run: {remedy}")
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


teach(globals())
