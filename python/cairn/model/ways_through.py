"""How thick a body in the plane is behind its edges."""

from __future__ import annotations

import numpy as np


def ways_through(places, pairs, most):
    """(m,) [m] from the middle of each edge (m, 2), the body on its left, across the body to the next of these edges; infinite
    where that is farther than `most` [m]. places (n, 2) of the nodes [m]."""
    from scipy.spatial import cKDTree

    first, along = places[pairs[:, 0]], places[pairs[:, 1]] - places[pairs[:, 0]]
    middle = first + along / 2
    inward = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
    longest = np.linalg.norm(along, axis=1).max()
    near = cKDTree(middle).query_ball_point(middle, most + longest / 2)
    counts = [len(of) for of in near]
    edge = np.repeat(np.arange(len(pairs)), counts)
    other = np.concatenate([np.zeros(0, int), *(np.asarray(of, int) for of in near)])
    opposite = np.sum(inward[edge] * np.stack([along[other, 1], -along[other, 0]], axis=1), axis=1)
    edge, other, opposite = edge[opposite > 0], other[opposite > 0], opposite[opposite > 0]  # edges that look away from it
    apart = first[other] - middle[edge]
    far = (apart[:, 0] * along[other, 1] - apart[:, 1] * along[other, 0]) / opposite
    at = (apart[:, 0] * inward[edge, 1] - apart[:, 1] * inward[edge, 0]) / opposite
    met = (far > 0) & (far <= most) & (at >= 0) & (at <= 1)
    through = np.full(len(pairs), np.inf)
    np.minimum.at(through, edge[met], far[met])
    return through
