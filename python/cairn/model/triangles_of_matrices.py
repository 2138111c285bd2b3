"""Lower triangles of sparse matrices on a common pattern, as the core takes them."""

import numpy as np


def lower_triangles(matrices, n):
    """Lower triangles of symmetric scipy.sparse matrices on their common pattern, by columns: (start, row, list of values)."""
    parts, places = [a.tocoo() for a in matrices], []
    for a in parts:
        a.sum_duplicates()
        places.append(np.where(a.row >= a.col, a.col.astype(np.int64) * n + a.row, -1))
    known = np.unique(np.concatenate([*places, np.arange(n, dtype=np.int64) * (n + 1)]))
    known = known[known >= 0]
    values = []
    for a, place in zip(parts, places):
        kept = place >= 0
        value = np.zeros(len(known))
        value[np.searchsorted(known, place[kept])] = a.data[kept]
        values.append(value)
    start = np.searchsorted(known, np.arange(n + 1, dtype=np.int64) * n)
    return start, known % n, values
