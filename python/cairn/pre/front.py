"""The free surface of a growing 2D deposit, and where the next disk comes to rest on it.

The surface is a chain of disks from the left wall to the right one, each touching the next, x growing along it. A disk rests in a
pit between two members of the chain; members between them are then buried. The pits stand in a heap by the height at which a disk
of mean radius would rest, so that the next disk goes to the lowest place of the surface.
"""

from __future__ import annotations

import heapq
from math import sqrt

ROLLS = 64  # changes of support before the whole neighbourhood is searched
TRIED = 8  # pits looked at for a disk: they stand in order for the mean radius, not for its own


class Front:
    """Chain of surface disks over a floor y = 0 between walls x = 0 and x = width; numbers n.. are walls and floor."""

    def __init__(self, radii: list[float], width: float, mean: float):
        n = len(radii)
        self.radii, self.width, self.mean, self.largest = radii, width, mean, max(radii)
        # share of a squared distance below which two disks overlap: the rounding of a coordinate is no overlap
        self.touch = 1.0 - max(1.0e-12, 2.0**-46 * width / min(radii))
        self.x, self.y = [0.0] * n, [0.0] * n
        self.left, self.floor, self.right = n, n + 1, n + 2
        self.following, self.previous = [-1] * (n + 3), [-1] * (n + 3)
        self.pits: list[tuple[float, int, int]] = []
        self.join(self.left, self.floor)
        self.join(self.floor, self.right)
        self.open_pit(self.left, self.floor)

    def join(self, i: int, j: int) -> None:
        self.following[i], self.previous[j] = j, i

    def open_pit(self, i: int, j: int) -> None:
        """Enter the pit between neighbours i, j; that between the floor and the right wall is filled from the left."""
        if i == self.floor:
            return
        place = self.rest(i, j, self.mean)
        if place is None:  # too wide for a mean disk, or between both walls: as low as its higher side
            height = max(self.y[k] for k in (i, j) if k < self.left)
        else:
            height = place[1]
        heapq.heappush(self.pits, (height, i, j))

    def rest(self, i: int, j: int, r: float) -> tuple[float, float] | None:
        """Centre of a disk of radius r that touches i, on its left, and j, on its right, from above; None if none does."""
        if i < self.left and j < self.left:
            xi, yi = self.x[i], self.y[i]
            dx, dy = self.x[j] - xi, self.y[j] - yi
            a, b = self.radii[i] + r, self.radii[j] + r
            square = dx * dx + dy * dy
            along = 0.5 * (1.0 + (a - b) * (a + b) / square)
            across = a * a / square - along * along
            if across < 0.0:
                return None
            across = sqrt(across)
            return xi + along * dx - across * dy, yi + along * dy + across * dx
        if j == self.floor:
            if i == self.left:
                return r, r
            a, rise = self.radii[i] + r, self.y[i] - r
            return (self.x[i] + sqrt((a - rise) * (a + rise)), r) if a > abs(rise) else None
        if i == self.left and j < self.left:
            k, x = j, r
        elif j == self.right and i < self.left:
            k, x = i, self.width - r
        else:
            return None
        a, run = self.radii[k] + r, x - self.x[k]
        return (x, self.y[k] + sqrt((a - run) * (a + run))) if a >= abs(run) else None

    def blocker(self, i: int, j: int, x: float, y: float, r: float) -> tuple[int, int]:
        """Obstacle that a disk at (x, y) resting on i and j overlaps: member of the chain, wall or floor, with its side on the
        chain (-1 left of i, 0 between, 1 right of j). Returns (-1, 0) if there is none."""
        reach = r + self.largest
        for link, start, side in ((self.previous, i, -1), (self.following, j, 1)):
            k = link[start]
            while 0 <= k < self.left and abs(self.x[k] - x) < reach:
                if self.overlaps(k, x, y, r):
                    return k, side
                k = link[k]
        k = self.following[i]
        while k != j:
            if k < self.left and (self.overlaps(k, x, y, r) or self.covers(k, i, j, x, y)):
                return k, 0
            k = self.following[k]
        if x < r * self.touch and i != self.left:
            return self.left, -1
        if x + r > self.width + r * (1.0 - self.touch) and j != self.right:
            return self.right, 1
        if y < r * self.touch and j != self.floor and self.previous[self.right] == self.floor:
            return self.floor, 1
        return -1, 0

    def overlaps(self, k: int, x: float, y: float, r: float) -> bool:
        """True if a disk at (x, y) overlaps member k beyond rounding."""
        dx, dy, a = self.x[k] - x, self.y[k] - y, self.radii[k] + r
        return dx * dx + dy * dy < a * a * self.touch

    def covers(self, k: int, i: int, j: int, x: float, y: float) -> bool:
        """True if member k lies above the line i - (x, y) - j: the place is then in a hole under the surface."""
        s = i if self.x[k] < x else j
        if s >= self.left:
            return self.y[k] > y
        turn = (self.x[s] - x) * (self.y[k] - y) - (self.y[s] - y) * (self.x[k] - x)
        return turn < 0.0 if s == i else turn > 0.0

    def settle(self, i: int, j: int, r: float) -> tuple[int, int, float, float]:
        """Resting place of a disk of radius r dropped into the pit (i, j): the two supports and the centre."""
        n, pit, from_left = self.left, (i, j), False
        for _ in range(ROLLS):
            place = self.rest(i, j, r)
            if place is None:
                break
            x, y = place
            k, side = self.blocker(i, j, x, y, r)
            if k >= 0:
                if k == self.floor:  # the floor lies open to the right of the last disk
                    j = k
                elif side == 0:  # k stands up between the supports: it carries the disk with the one that came last
                    i, j = (i, k) if from_left else (k, j)
                else:
                    from_left = side < 0
                    i, j = (k, j) if from_left else (i, k)
            elif i < n and x < self.x[i]:
                i, j = self.previous[i], i
            elif j < n and x > self.x[j]:
                i, j = j, self.following[j]
            else:
                return i, j, x, y
        return self.search(*pit, r)

    def search(self, i: int, j: int, r: float) -> tuple[int, int, float, float]:
        """Finds the resting place like `settle`, but by trying all pairs of the chain around the pit; for the rare disk for which
        rolling fails."""
        reach = 1
        while True:
            members = self.around(i, j, reach)
            best = None
            for a, first in enumerate(members):
                for second in members[a + 1 :]:
                    place = self.rest(first, second, r)
                    if place is None or (best is not None and place[1] >= best[3]):
                        continue
                    x, y = place
                    stable = not (first < self.left and x < self.x[first]) and not (second < self.left and x > self.x[second])
                    if stable and self.blocker(first, second, x, y, r)[0] < 0:
                        best = first, second, x, y
            if best is not None:
                return best
            if members[0] == self.left and members[-1] == self.right:
                raise RuntimeError("no disk could come to rest on the surface: this is a fault of the packing")
            reach *= 2

    def around(self, i: int, j: int, reach: int) -> list[int]:
        """The chain from i to j and on both sides of them to 4 `reach` largest radii."""
        start = end = i if i < self.left else j
        middle, far = self.x[start] if start < self.left else 0.0, 4 * reach * self.largest
        while start != self.left and (start >= self.left or self.x[start] > middle - far):
            start = self.previous[start]
        while end != self.right and (end >= self.left or self.x[end] < middle + far):
            end = self.following[end]
        members = [start]
        while members[-1] != end:
            members.append(self.following[members[-1]])
        return members

    def place(self, k: int) -> None:
        """Puts disk k in the lowest pit and removes the buried members from the chain."""
        r, tried, best = self.radii[k], [], None
        while self.pits and len(tried) < TRIED and (best is None or self.pits[0][0] < best[3]):
            _, i, j = heapq.heappop(self.pits)
            if self.following[i] == j:
                place = self.settle(i, j, r)
                tried.append((place[3], i, j))
                if best is None or place[3] < best[3]:
                    best = place
        for pit in tried:  # with the height that a disk really found there
            heapq.heappush(self.pits, pit)
        assert best is not None  # a chain that spans the box has a pit
        i, j, x, y = best
        self.x[k], self.y[k] = x, y
        member = self.following[i]
        while member != j:
            self.following[member], member = -1, self.following[member]
        self.join(i, k)
        self.join(k, j)
        self.open_pit(i, k)
        self.open_pit(k, j)
