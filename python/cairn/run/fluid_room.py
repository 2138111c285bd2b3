"""Room that bodies and inflows leave to the particles of a liquid."""

from __future__ import annotations

import numpy as np

from ..base.geometry import turn
from ..model.fluid_points import depth_in

NEAREST = 0.3  # distance of particles of a region from bodies, over the spacing
FINE = 4  # points along each axis by which the share of a cell that bodies take is found


def kept_rows(depth, left_out, same):
    """Finds the particles that stay when the deepest in bodies are left out.

    Of those as deep as the last one every so many are left out: from one end on they would leave the liquid lopsided.

    Parameters
    ----------
    depth : ndarray (n,)
        Depth of each particle in a body, < 0 outside [m].
    left_out : int
        How many are left out.
    same : float
        Difference of depths that counts as none [m].

    Returns
    -------
    ndarray
        Their rows.
    """
    if left_out == 0:
        return np.arange(len(depth))
    last = np.sort(depth)[-left_out]
    out, tied = depth > last + same, np.flatnonzero(np.abs(depth - last) <= same)
    many = left_out - int(out.sum())
    out[tied[((np.arange(many) + 0.5) * len(tied) / many).astype(int)]] = True
    return np.flatnonzero(~out)


def crowd(depth, body, dim, spacing):
    """Finds the particles in a small body that take more than half of its volume, be they deep in it or not.

    Parameters
    ----------
    depth : ndarray (n,)
        Depth of each particle in the body, < 0 outside [m].
    body : object
        Contactor, as `Running` has them: points in the axes of the body, which fill a small one.
    dim : int
        2 or 3.
    spacing : float
        Distance of the particles [m].

    Returns
    -------
    ndarray
        Their rows, none if they take less.
    """
    inside = np.flatnonzero(depth > 0)
    size = 0.0 if body.points is None else float(np.sum(body.points.volume))
    return inside if len(inside) * spacing**dim > 0.5 * size > 0 else inside[:0]


def refuse_liquid_behind(table, position, spacing, reach):
    """Refuses an inflow that leads away from the liquid.

    Parameters
    ----------
    table : dict
        Rows of particles of the inflow, as `Inflow.lanes` gives them.
    position : ndarray (n, dim)
        Places of the particles of the liquid [m].
    spacing : float
        Distance of the particles [m].
    reach : float
        Distance over which particles meet [m].

    Raises
    ------
    ValueError
        If particles of the liquid stand behind the begin of the inflow.
    """
    axis, sign = int(table["axis"][0]), float(table["sign"][0])
    begin = float(np.max(table["face"] - table["length"]))
    along, across = sign * position[:, axis], np.delete(position, axis, axis=1)
    box = np.delete(table["position"], axis, axis=1)
    within = np.all((across > box.min(axis=0) - 0.5 * spacing) & (across < box.max(axis=0) + 0.5 * spacing), axis=1)
    behind = np.flatnonzero(within & (along < begin) & (along > begin - reach))
    if len(behind):
        at = tuple(float(v) for v in position[behind[np.argmax(along[behind])]])
        raise ValueError(
            f"velocity of cn.Inflow leads {'up' if sign > 0 else 'down'} axis {axis}, away from the liquid, which stands behind "
            f"its region, at {at}: give a velocity towards the liquid, a region on its other side, or cn.Outflow, where it leaves"
        )


def refuse_liquid_aside(table, position, spacing, reach):
    """Refuses an inflow that leads along the side at which the liquid stands.

    Parameters
    ----------
    table, position, spacing, reach
        As of `refuse_liquid_behind`.

    Raises
    ------
    ValueError
        If the liquid stands beside the region, and none before its end.
    """
    axis, sign = int(table["axis"][0]), float(table["sign"][0])
    end, length = float(np.max(table["face"])), float(np.max(table["length"]))
    along, across = sign * position[:, axis], np.delete(position, axis, axis=1)
    box = np.delete(table["position"], axis, axis=1)
    low, high = box.min(axis=0) - 0.5 * spacing, box.max(axis=0) + 0.5 * spacing
    aside = np.linalg.norm(np.maximum(0.0, np.maximum(low - across, across - high)), axis=1)
    beside = np.flatnonzero((aside > 0) & (aside < spacing) & (along > end - length) & (along < end))
    if len(beside) and not np.any((aside == 0) & (along >= end) & (along < end + reach)):
        at = tuple(float(v) for v in position[beside[0]])
        raise ValueError(
            f"velocity of cn.Inflow leads {'up' if sign > 0 else 'down'} axis {axis}, along the side at which the liquid stands, "
            f"at {at}: give a velocity towards the liquid, or a region on another side of it"
        )


def refuse_wrong_way_out(region, axis, sign, position, spacing):
    """Refuses an outflow that leads towards the liquid, or that the liquid could enter by its side alone.

    Parameters
    ----------
    region : ndarray (2, dim)
        Lowest and highest corner of the box [m].
    axis : int
        Axis of the way out.
    sign : float
        1: up the axis, -1: down.
    position : ndarray (n, dim)
        Places of the particles of the liquid [m].
    spacing : float
        Distance of the particles [m].

    Raises
    ------
    ValueError
        If the liquid stands before the far end of the box or beside it, and none behind its begin or within it.
    """
    begin, end = np.sort(sign * region[:, axis])
    along, across = sign * position[:, axis], np.delete(position, axis, axis=1)
    low, high = np.delete(region, axis, axis=1)
    aside = np.linalg.norm(np.maximum(0.0, np.maximum(low - across, across - high)), axis=1)
    ahead = (aside == 0) & (along > end)
    beside = (aside > 0) & (aside < spacing) & (along > begin) & (along < end)
    if np.any((aside == 0) & (along <= end)) or not np.any(ahead | beside):
        return
    why = "towards the liquid" if np.any(ahead) else "along the side at which the liquid stands"
    nearest = np.where(ahead, along - end, np.where(beside, aside, np.inf))
    at = tuple(float(v) for v in position[int(np.argmin(nearest))])
    raise ValueError(
        f"cn.Outflow leads {'up' if sign > 0 else 'down'} axis {axis}, {why}, at {at}, so that none of it finds the way out: "
        "give direction away from the liquid, or a region on its other side"
    )


def depth_in_bodies(x, bodies, dim):
    """Depth of places (n, dim) in the body that they are deepest in, < 0 outside, and its id."""
    deepest, where = np.full(len(x), -np.inf), np.full(len(x), -1)
    for body in bodies:
        if not body.plane and not len(body.points):
            continue
        own = x - body.position
        if body.rotation is not None:
            back = body.rotation * ([1, -1, -1, -1] if dim == 3 else -1)
            own = turn(np.broadcast_to(back, (len(x), *np.shape(back))), own, dim)
        solid = getattr(body, "surface", None)
        depth = depth_in(body.shape, dim, body.form, own) if solid is None else solid.depth(x, body.within)
        where = np.where(depth > deepest, body.ids[0], where)
        deepest = np.maximum(deepest, depth)
    return deepest, where


def refuse_crowded(position, spacing):
    """Raises ValueError where particles lie nearly on others, as those of two regions that overlap do."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(position).query_pairs(0.25 * spacing, output_type="ndarray")
    if len(pairs):
        at = tuple(float(v) for v in position[pairs[0, 0]])
        raise ValueError(
            f"{len(pairs)} pairs of particles of the fluid are nearer than a quarter of the spacing, the first at {at}: give "
            "regions that do not overlap"
        )


def outside(fluid, bodies, dim):
    """Places (m, dim) of the particles of a fluid that lie outside all bodies, and their rows. Those of a region take the volume
    that bodies leave. Raises ValueError for given ones that lie in a body."""
    x, dx = fluid.position, fluid.spacing
    deepest, where = depth_in_bodies(x, bodies, dim)
    if fluid.given:
        if np.any(deepest > 0):
            k = int(np.argmax(deepest))
            raise ValueError(
                f"particle {k} of the fluid at {tuple(float(v) for v in x[k])} lies {deepest[k]:g} m deep in body "
                f"{where[k]}: give places outside bodies and walls"
            )
        return x, np.arange(len(x))
    share = np.where(deepest > 0, 1.0, 0.0)
    cut = np.flatnonzero(np.abs(deepest) < dx * np.sqrt(dim))
    if len(cut):
        at = (np.arange(FINE) + 0.5) / FINE - 0.5
        steps = np.stack([a.ravel() for a in np.meshgrid(*[at] * dim, indexing="ij")], axis=1) * dx
        share[cut] = np.mean([depth_in_bodies(x[cut] + step, bodies, dim)[0] > 0 for step in steps], axis=0)
    rows = kept_rows(deepest, int(round(float(share.sum()))), 1e-6 * dx)
    place = x[rows].copy()
    near = np.flatnonzero(deepest[rows] > -NEAREST * dx)
    for _ in range(3 if len(near) else 0):  # edges have two normals
        depth = depth_in_bodies(place[near], bodies, dim)[0]
        beside = [depth_in_bodies(place[near] + 1e-3 * dx * axis, bodies, dim)[0] for axis in np.eye(dim)]
        slope = np.stack(beside, axis=1) - depth[:, None]
        slope /= np.maximum(np.linalg.norm(slope, axis=1), 1e-300)[:, None]
        place[near] -= np.maximum(depth + NEAREST * dx, 0.0)[:, None] * slope
    return place, rows
