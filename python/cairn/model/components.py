"""Connected components of a graph."""

import numpy as np


def parts_of(pairs, n):
    """Connected component of each of n corners in the graph of the pairs (m, 2)."""
    from scipy import sparse
    from scipy.sparse.csgraph import connected_components

    graph = sparse.coo_array((np.ones(len(pairs), np.int8), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    return connected_components(graph, directed=False)[1]
