"""Resting places of spheres on a growing 3D deposit: places that touch three supports which can carry their weight.

A support is a sphere, a vertical wall of the box or its floor. Every new sphere makes new places with the spheres around
it; they stand in a heap by height, so that the next sphere goes to the lowest one that has room for it (the algorithm of
the lowest position, after Visscher & Bolsterli 1972).
"""

from __future__ import annotations

import heapq
from functools import lru_cache

import numpy as np

BATCH = 16  # places of the heap looked at together
PATIENCE = 32  # refusals after which a place that few spheres fit is forgotten
FLOOR = -1
WALLS = (-2, -3, -4, -5)  # x = 0, x = lx, y = 0, y = ly
PLANE_NORMALS = np.array([[0, 0, 1.0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])


@lru_cache(maxsize=256)
def pairs(n: int) -> tuple[np.ndarray, np.ndarray]:
    return np.triu_indices(n, 1)


class Sites:
    """Spheres placed so far in the box (0, lx) x (0, ly) x (0, inf), and the heap of places for the next."""

    def __init__(self, radii: np.ndarray, lx: float, ly: float):
        self.radii, self.count = radii, 0
        self.centers = np.zeros((len(radii), 3))
        self.smallest, self.largest = float(radii.min()), float(radii.max())
        self.offsets = np.array([0.0, 0.0, -lx, 0.0, -ly])  # a plane is normal . x >= offset
        # overlaps below this share of a squared distance are rounding
        self.touch = 1.0 - max(1.0e-12, 2.0**-44 * max(lx, ly) / self.smallest)
        # radii for which places are looked for: one does for nearly equal spheres
        self.trials = np.unique(np.quantile(radii, (0.1, 0.5, 0.9) if self.largest > 1.3 * self.smallest else (0.5,)))
        # height, three supports, trial radius, times refused
        self.heap: list[tuple[float, int, int, int, float, int]] = []
        self.known: set[tuple[int, int, int, float]] = set()
        self.cell = 4.0 * self.largest
        self.columns = (int(lx / self.cell) + 1, int(ly / self.cell) + 1)
        self.cells: dict[tuple[int, int, int], list[int]] = {}

    def cell_of(self, point) -> tuple[int, int, int]:
        return int(point[0] / self.cell), int(point[1] / self.cell), int(point[2] / self.cell)

    def near(self, point) -> np.ndarray:
        """Spheres in the 27 cells around a point: all within 4 largest radii of it."""
        i, j, k = self.cell_of(point)
        found: list[int] = []
        for a in (i - 1, i, i + 1):
            for b in (j - 1, j, j + 1):
                for c in (k - 1, k, k + 1):
                    found += self.cells.get((a, b, c), ())
        return np.array(found, dtype=np.int64)

    def place(self) -> None:
        """Put the next sphere in the lowest place that has room for it."""
        r = float(self.radii[self.count])
        center = self.lowest(r)
        if center is None:
            center = self.corner(r)
        if center is None:  # the heap was made for other radii: look at the whole surface with this one
            self.renew(r)
            center = self.lowest(r)
        if center is None:
            raise RuntimeError("no sphere could come to rest on the deposit: this is a fault of the packing")
        new = self.count
        self.centers[new] = center
        self.cells.setdefault(self.cell_of(center), []).append(new)
        self.count += 1
        for trial in self.trials:
            self.open_sites(new, float(trial))

    def corner(self, r: float):
        """A free corner of the floor, or None: the one kind of place that no sphere supports."""
        for x in (r, -self.offsets[2] - r):
            for y in (r, -self.offsets[4] - r):
                place = np.array([x, y, r])
                if self.free(place[None, :], r, self.near(place))[0]:
                    return place
        return None

    def renew(self, r: float) -> None:
        """Adds resting places of a sphere of radius r [m] on every sphere to the heap, which held those of other radii."""
        for k in range(self.count):
            self.open_sites(k, r)

    def lowest(self, r: float):
        """Centre (3,) [m] of the lowest free resting place for radius r [m], or None; blocked places leave the heap."""
        kept, center = [], None
        while self.heap and center is None:
            batch = [heapq.heappop(self.heap) for _ in range(min(BATCH, len(self.heap)))]
            center, found = self.first_free(batch, np.full(len(batch), r))
            refused = batch[:found]
            kept += batch[found:]
            if refused:  # keep those that still have room for the radius they were made for
                alive = self.alive(refused)
                kept += [(*entry[:5], entry[5] + 1) for entry, yes in zip(refused, alive) if yes and entry[5] < PATIENCE]
                self.known.difference_update(entry[1:5] for entry, yes in zip(refused, alive) if not yes)
        for entry in kept:
            heapq.heappush(self.heap, entry)
        return center

    def first_free(self, entries: list, r: np.ndarray):
        """Centre at the first entry that has room for a sphere of radius r, and its number in the list (or its length)."""
        places, which = self.resting(entries, r)
        for k in np.argsort(which, kind="stable"):
            place, entry = places[k], int(which[k])
            if self.free(places[k : k + 1], r[entry], self.near(place))[0]:
                return place, entry
        return None, len(entries)

    def alive(self, entries: list) -> list[bool]:
        """True for each entry that still has room for its trial radius."""
        r = np.array([entry[4] for entry in entries])
        places, which = self.resting(entries, r)
        alive = [False] * len(entries)
        for place, k in zip(places, which):
            alive[k] = alive[k] or bool(self.free(place[None, :], r[k], self.near(place))[0])
        return alive

    def resting(self, entries: list, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Centres of spheres of radius r (m,) at rest on the supports of m entries, and the entry of each."""
        supports = np.array([entry[1:4] for entry in entries])
        first = supports[:, 0]
        origin, reach = self.centers[first], self.radii[first] + r
        ai, bi = self.equations(origin, reach, supports[:, 1], r)
        aj, bj = self.equations(origin, reach, supports[:, 2], r)
        planes = supports[:, 1:] < 0
        q, which = at_rest(reach, ai, aj, bi, bj, planes[:, 0], planes[:, 1])
        return origin[which] + q, which

    def equations(self, origin, reach, others, r) -> tuple[np.ndarray, np.ndarray]:
        """a, b with a . q = b where a sphere of radius r at origin + q touches each of others, and |q| = reach."""
        plane = others < 0
        index, sphere = np.where(plane, -others - 1, 0), np.where(plane, 0, others)
        a = np.where(plane[:, None], PLANE_NORMALS[index], self.centers[sphere] - origin)
        touching = self.radii[sphere] + r
        to_plane = r + self.offsets[index] - np.einsum("ij,ij->i", a, np.broadcast_to(origin, a.shape))
        return a, np.where(plane, to_plane, 0.5 * ((reach - touching) * (reach + touching) + np.einsum("ij,ij->i", a, a)))

    def free(self, places: np.ndarray, r: float, near: np.ndarray) -> np.ndarray:
        """True for each place where a sphere of radius r overlaps neither the spheres `near` nor the box."""
        gaps = places @ PLANE_NORMALS.T - self.offsets
        clear = np.all(gaps >= r * self.touch, axis=1)
        apart = places[:, None, :] - self.centers[near]
        touching = self.radii[near] + r
        return clear & np.all(np.einsum("ijk,ijk->ij", apart, apart) >= touching * touching * self.touch, axis=1)

    def open_sites(self, new: int, r: float) -> None:
        """Enter the places for radius r that touch sphere `new` and two other supports."""
        center, reach = self.centers[new], float(self.radii[new]) + r
        near = self.near(center)
        near = near[near != new]
        apart = self.centers[near] - center
        near = near[np.einsum("ij,ij->i", apart, apart) < (reach + r + self.radii[near]) ** 2]
        gaps = PLANE_NORMALS @ center - self.offsets
        others = np.concatenate((near, -1 - np.flatnonzero(gaps < reach + r)))
        if len(others) < 2:
            return
        a, b = self.equations(center, reach, others, r)
        i, j = pairs(len(others))
        plane = others < 0
        q, pair = at_rest(reach, a[i], a[j], b[i], b[j], plane[i], plane[j])
        places = center + q
        good = self.free(places, r, near)
        for place, p in zip(places[good], pair[good]):
            # spheres first, since the first support is to be a sphere
            first, second, third = sorted((new, int(others[i[p]]), int(others[j[p]])), reverse=True)
            key = (first, second, third, r)
            if key not in self.known:
                self.known.add(key)
                heapq.heappush(self.heap, (float(place[2]), *key, 0))


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products of rows."""
    ax, ay, az, bx, by, bz = a[:, 0], a[:, 1], a[:, 2], b[:, 0], b[:, 1], b[:, 2]
    return np.stack((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx), axis=1)


def at_rest(reach, ai, aj, bi, bj, plane_i, plane_j) -> tuple[np.ndarray, np.ndarray]:
    """All q with |q| = reach, ai . q = bi, aj . q = bj, where the three supports carry a weight; and the row of each.

    The supports push along q, q - ai (or ai itself, for a plane) and q - aj; they carry a weight if positive forces
    along these balance it.
    """
    m = cross(ai, aj)
    square = np.einsum("ij,ij->i", m, m)
    with np.errstate(divide="ignore", invalid="ignore"):
        q0 = (bi[:, None] * cross(aj, m) + bj[:, None] * cross(m, ai)) / square[:, None]
        t = np.sqrt((reach * reach - np.einsum("ij,ij->i", q0, q0)) / square)
    row = np.flatnonzero(np.isfinite(t))
    step = t[row, None] * m[row]
    q = np.concatenate((q0[row] - step, q0[row] + step))
    row = np.concatenate((row, row))
    ni = np.where(plane_i[row, None], ai[row], q - ai[row])
    nj = np.where(plane_j[row, None], aj[row], q - aj[row])
    normal = cross(ni, nj)
    sign = np.sign(np.einsum("ij,ij->i", q, normal))
    carried = (
        (sign != 0.0)
        & (normal[:, 2] * sign >= 0.0)
        & ((nj[:, 0] * q[:, 1] - nj[:, 1] * q[:, 0]) * sign >= 0.0)
        & ((q[:, 0] * ni[:, 1] - q[:, 1] * ni[:, 0]) * sign >= 0.0)
    )
    return q[carried], row[carried]
