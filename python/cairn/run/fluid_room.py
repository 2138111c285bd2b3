"""Room that bodies and inflows leave to the particles of a liquid."""

from __future__ import annotations

import numpy as np


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
