"""Regular arrangements: nearest neighbours stand at `spacing`, so that grains of radius spacing / 2 touch.

Grains of that radius at the lowest places touch the planes x = 0, y = 0 (and z = 0). `jitter` moves every coordinate at
random by at most that share of the spacing; grains stay apart if radius <= spacing (1/2 - jitter sqrt(dim)).
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..base import checks
from ..names import listed

# positions of the sites of a cell in cell lengths, and the cell lengths in spacings
CELLS = {
    "square": ([(0, 0)], (1, 1)),
    "triangular": ([(0, 0), (0.5, 0.5)], (1, sqrt(3))),
    "sc": ([(0, 0, 0)], (1, 1, 1)),
    "bcc": ([(0, 0, 0), (0.5, 0.5, 0.5)], (2 / sqrt(3),) * 3),
    "fcc": ([(0, 0, 0), (0.5, 0.5, 0), (0.5, 0, 0.5), (0, 0.5, 0.5)], (sqrt(2),) * 3),
    "hcp": (
        [(0, 0, 0), (0.5, 0.5, 0), (0, 1 / 3, 0.5), (0.5, 5 / 6, 0.5)],
        (1, sqrt(3), 2 * sqrt(2 / 3)),
    ),
}


def lattice(name, cells, spacing, *, jitter=0.0, rng=None) -> np.ndarray:
    """Centres of a lattice.

    name: "square" or "triangular" (2D); "sc", "bcc", "fcc" or "hcp" (3D). cells: number of cells along each axis (dim,);
    a cell holds 1 centre (square, sc), 2 (triangular: 1 by sqrt 3; bcc) or 4 (fcc; hcp: 1 by sqrt 3 by sqrt(8/3)).
    spacing: distance of nearest neighbours [m]. jitter [-] in [0, 1/2]; it needs rng.
    Returns (n, dim) [m]. Raises ValueError for an unknown name, bad counts or sizes.
    """
    if name not in CELLS:
        raise ValueError(f"name is {name!r}: give one of {listed(CELLS, name)}")
    basis, lengths = (np.array(part, dtype=np.float64) for part in CELLS[name])
    dim = len(lengths)
    if np.ndim(cells) != 1 or len(cells) != dim:
        raise ValueError(f"cells is {cells!r}: give {dim} whole numbers for {name!r}")
    cells = [checks.count(f"cells[{axis}]", n) for axis, n in enumerate(cells)]
    spacing, jitter = checks.positive("spacing", spacing), checks.number("jitter", jitter)
    if not 0.0 <= jitter <= 0.5:
        raise ValueError(f"jitter is {jitter}: give a share of the spacing in [0, 0.5]")
    corners = np.stack(np.meshgrid(*(np.arange(n) for n in cells), indexing="ij"), axis=-1).reshape(-1, 1, dim)
    points = ((corners + basis) * lengths).reshape(-1, dim) + 0.5
    if jitter > 0.0:
        points += checks.generator(rng).uniform(-jitter, jitter, points.shape)
    return points * spacing


def box_walls(low, high, *, lid=False) -> tuple[np.ndarray, np.ndarray]:
    """Planes round the inside of a box: points (m, dim) [m] and normals (m, dim) that point inwards, out of the solid.

    low, high: opposite corners (dim,) [m]. For each axis the wall at its low, then at its high end; the highest wall (top of
    the last axis) only with lid=True.
    """
    low = checks.real_array("low", low, (None,))
    dim = checks.dimension(len(low))
    high = checks.real_array("high", high, (dim,))
    if np.any(high <= low):
        axis = int(np.argmax(high <= low))
        raise ValueError(f"high[{axis}] is {high[axis]}, not above low[{axis}] = {low[axis]}: give two opposite corners")
    points = np.array([corner for _ in range(dim) for corner in (low, high)])
    normals = np.array([sign * axis for axis in np.eye(dim) for sign in (1.0, -1.0)]) + 0.0
    return (points, normals) if lid else (points[:-1], normals[:-1])
