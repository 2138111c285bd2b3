"""Pairs of round shapes and boxes in numbers: random and with answers known from how they were built, their contacts, and bounds
of the gap: from below the separation along a direction, from above the distance of a point of each."""

import cairn as cn
import numpy as np
from shape_pairs import ROCK, STEPS, random_polyhedron

OTHER = cn.Material("other", density=1000.0)
ROUND = ("capsule", "cylinder", "superquadric")
KINDS = (*ROUND, "sphere", "box", "polyhedron")
PAIRS = [(a, b) for i, a in enumerate(ROUND) for b in (*ROUND[i:], "sphere", "box", "polyhedron")]
POOL = [random_polyhedron(np.random.default_rng(k)) for k in range(200)]


def quaternions(turn):
    """(w, x, y, z) of rotation matrices (n, 3, 3)."""
    from scipy.spatial.transform import Rotation

    return np.roll(Rotation.from_matrix(turn).as_quat(), 1, axis=1)


def random_turns(rng, count):
    q, r = np.linalg.qr(rng.normal(size=(count, 3, 3)))
    q *= np.sign(np.einsum("nii->ni", r))[:, None, :]
    q[np.linalg.det(q) < 0] *= -1
    return q


def bodies(kind, sizes, place, turn, material):
    """sizes (n, 5): radius, length; half axes and exponents; edges of a box; the number of a polyhedron of the pool."""
    where = {"rotation": quaternions(turn)}
    if kind == "sphere":
        return cn.spheres(place, sizes[:, 0], material)
    if kind == "capsule":
        return cn.capsules(place, sizes[:, 0], sizes[:, 1], material, **where)
    if kind == "cylinder":
        return cn.cylinders(place, sizes[:, 0], sizes[:, 1], material, **where)
    if kind == "superquadric":
        return cn.superquadrics(place, sizes[:, :3], sizes[:, 3:], material, **where)
    if kind == "box":
        return cn.boxes(place, sizes[:, :3], material, **where)
    meshes = [POOL[int(k)] for k in sizes[:, 0]]
    return cn.polyhedra([(v @ r.T + x, f) for (v, f), r, x in zip(meshes, turn, place)], material)


def random_sizes(rng, kind, count, general=False):
    sizes = rng.uniform(0.2, 0.7, (count, 5))
    if kind in ("capsule", "cylinder"):
        sizes[:, 1] = rng.uniform(0.05, 1.5, count)
    if kind == "superquadric":
        sizes[:, 3:] = rng.uniform(0.1, 1.9, (count, 2)) if general else 1
    if kind == "box":
        sizes[:, :3] = rng.uniform(0.3, 1.4, (count, 3))
    if kind == "polyhedron":
        sizes[:, 0] = rng.integers(len(POOL), size=count)
    return sizes


def columns(a):
    return [a[:, k] for k in range(a.shape[1])]


def reach(kind, sizes, turn, d):
    """How far bodies reach along unit vectors d (n, 3), from their centres, in extended precision."""
    s = columns(np.asarray(sizes, np.longdouble))
    x, y, z = columns(np.abs(np.einsum("nji,nj->ni", np.asarray(turn, np.longdouble), np.asarray(d, np.longdouble))))
    if kind == "sphere":
        return s[0]
    if kind == "capsule":
        return s[0] + s[1] / 2 * z
    if kind == "cylinder":
        return s[0] * np.hypot(x, y) + s[1] / 2 * z
    if kind == "box":
        return (s[0] * x + s[1] * y + s[2] * z) / 2
    if kind == "superquadric":  # the dual of a norm of exponents 2/e: exponents p' with 1/p' + e/2 = 1
        p, q = 1 / (1 - s[3] / 2), 1 / (1 - s[4] / 2)
        section = ((s[0] * x) ** q + (s[1] * y) ** q) ** (1 / q)
        return (section**p + (s[2] * z) ** p) ** (1 / p)
    vertices = np.einsum("nij,nkj->nki", turn, np.array([POOL[int(k)][0] for k in sizes[:, 0]]))
    return np.einsum("nki,ni->nk", np.asarray(vertices, np.longdouble), d).max(axis=1)


def outside(kind, sizes, turn, x):
    """How far points x (n, 3), from the centres, are outside at most; a proof that they are inside where it is not positive."""
    s = columns(np.asarray(sizes, np.longdouble))
    local = np.einsum("nji,nj->ni", np.asarray(turn, np.longdouble), np.asarray(x, np.longdouble))
    x, y, z = columns(np.abs(local))
    if kind == "sphere":
        return np.sqrt(x * x + y * y + z * z) - s[0]
    if kind == "capsule":
        return np.sqrt(x * x + y * y + np.maximum(z - s[1] / 2, 0) ** 2) - s[0]
    if kind == "cylinder":
        return np.maximum(np.hypot(x, y) - s[0], z - s[1] / 2)
    if kind == "box":
        return np.max([x - s[0] / 2, y - s[1] / 2, z - s[2] / 2], axis=0)
    if kind == "superquadric":
        norm = (((x / s[0]) ** (2 / s[4]) + (y / s[1]) ** (2 / s[4])) ** (s[4] / s[3]) + (z / s[2]) ** (2 / s[3])) ** (s[3] / 2)
        return (1 - 1 / norm) * np.sqrt(x * x + y * y + z * z)
    high = []
    for k, point in zip(sizes[:, 0], local):
        v, f = POOL[int(k)]
        n = np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])
        high.append((np.einsum("fi,fi->f", n, point - v[f[:, 0]]) / np.sqrt(np.sum(n * n, axis=1))).max())
    return np.array(high, np.longdouble)


class Pairs:
    """Pairs whose first body is at `place` from the second, with the gap and the normal to the first where known."""

    def __init__(self, kinds, sizes, turns, place, gap=None, normal=None):
        self.kinds, self.sizes, self.turns, self.place, self.gap, self.normal = kinds, sizes, turns, place, gap, normal

    def __len__(self):
        return len(self.place)

    def part(self, k):
        known = [None if x is None else x[k] for x in (self.gap, self.normal)]
        return Pairs(self.kinds, [s[k] for s in self.sizes], [t[k] for t in self.turns], self.place[k], *known)

    def size(self):
        """Size of the larger body."""
        axes = np.eye(3)
        return np.max([[reach(k, s, t, np.broadcast_to(e, (len(self), 3))) for e in axes]
                       for k, s, t in zip(self.kinds, self.sizes, self.turns)], axis=(0, 1)).astype(float)  # fmt: skip

    def separation(self, normal):
        """How far the bodies are apart along unit normals from the second to the first."""
        n = np.asarray(normal, np.longdouble)
        n = n / np.sqrt(np.sum(n * n, axis=1, keepdims=True))
        (a, b), (s, t), (p, q) = self.kinds, self.sizes, self.turns
        return np.sum(n * self.place, axis=1) - reach(a, s, p, -n) - reach(b, t, q, n)

    def meet(self, margin, spacing=None):
        """Least gap (inf: no contact), normal and point, from the centre of the second body, of each pair."""
        scene = cn.Scene(3)
        spacing = spacing or 8 * self.size().max()
        side = int(np.ceil(len(self) ** (1 / 3)))
        k = np.arange(len(self))
        where = spacing * np.stack([k % side, k // side % side, k // side**2], axis=1)
        scene.add(bodies(self.kinds[0], self.sizes[0], where + self.place, self.turns[0], ROCK))
        scene.add(bodies(self.kinds[1], self.sizes[1], where, self.turns[1], OTHER))
        scene.interact(ROCK, OTHER, cn.Coulomb(mu=0.0))
        scene.interact(ROCK, ROCK, None)
        scene.interact(OTHER, OTHER, None)
        sim = cn.Simulation(scene, dt=1e-12, strategy=cn.NSCD(margin=margin), overlap="ignore")
        sim.step()
        c = sim.contacts
        pair = np.min(c.bodies, axis=1)
        assert np.all(np.max(c.bodies, axis=1) - pair == len(self))
        order = np.lexsort((c.gap, pair))
        first = order[np.unique(pair[order], return_index=True)[1]]
        gap, normal, point = np.full(len(self), np.inf), np.full((len(self), 3), np.nan), np.full((len(self), 3), np.nan)
        gap[pair[first]] = c.gap[first]
        normal[pair[first]] = np.where(c.bodies[first, :1] < len(self), 1.0, -1.0) * c.normal[first]
        point[pair[first]] = c.point[first] - where[pair[first]]
        return gap, normal, point

    def bounds(self, gap, normal, point):
        """The distance is no less than the first, the separation along the normal, and no more than the second: the points half
        the gap from the point of contact along the normal, moved as far as they are outside."""
        half = np.asarray(normal, np.longdouble) * np.asarray(gap, np.longdouble)[:, None] / 2
        (a, b), (s, t), (p, q) = self.kinds, self.sizes, self.turns
        out = np.maximum(outside(a, s, p, point + half - self.place), 0) + np.maximum(outside(b, t, q, point - half), 0)
        return self.separation(normal).astype(float), (gap + out).astype(float)


def random_pairs(rng, kinds, count, near=(-0.15, 0.4), general=False):
    """Pairs separated along a random direction by a uniform deviate within `near`, negative for overlap; the gap may be more."""
    sizes = [random_sizes(rng, k, count, general) for k in kinds]
    turns = [random_turns(rng, count) for _ in kinds]
    way = rng.normal(size=(count, 3))
    way /= np.sqrt(np.sum(way**2, axis=1, keepdims=True))
    pairs = Pairs(kinds, sizes, turns, np.zeros((count, 3)))
    pairs.place = way * (rng.uniform(*near, count) - pairs.separation(way).astype(float))[:, None]
    return pairs


def coal_shape(kind, sizes):
    import coal

    if kind == "polyhedron":
        points, corners = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
        for x in POOL[int(sizes[0])][0]:
            points.append(x)
        for t in POOL[int(sizes[0])][1]:
            corners.append(coal.Triangle(*map(int, t)))
        return coal.Convex(points, corners)
    if kind == "superquadric":
        return coal.Ellipsoid(*map(float, sizes[:3]))
    count = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3}[kind]
    return getattr(coal, kind.capitalize())(*map(float, sizes[:count]))


def coal_gaps(pairs, tolerance=1e-9):
    """Signed distances by Coal, and normals to the first body."""
    import coal

    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_tolerance = request.epa_tolerance = tolerance
    request.gjk_max_iterations = request.epa_max_iterations = 1000
    gap, normal = np.empty(len(pairs)), np.empty((len(pairs), 3))
    still = np.zeros(3)
    for k in range(len(pairs)):
        shapes = [coal_shape(kind, s[k]) for kind, s in zip(pairs.kinds, pairs.sizes)]
        frames = [coal.Transform3s(t[k], x) for t, x in zip(pairs.turns, (pairs.place[k], still))]
        result.clear()
        gap[k] = coal.distance(shapes[0], frames[0], shapes[1], frames[1], request, result)
        normal[k] = -result.normal
    return gap, normal


def about(axis, angle):
    """Rotations (n, 3, 3) about a coordinate axis."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.zeros((len(angle), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn[:, axis, axis] = 1
    turn[:, i, i] = turn[:, j, j] = c
    turn[:, i, j], turn[:, j, i] = -s, s
    return turn


UPRIGHT = np.eye(3)
ALONG_X = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])  # the third axis along x
FAMILIES = ("ends", "coaxial", "side_by_side", "sides_cross", "end_on_face", "side_on_face", "rim_on_face", "tips")
FAMILIES += ("tiny_on_huge",)


def height(kind, sizes):
    """Half of it, along the third axis."""
    return {"sphere": sizes[:, 0], "capsule": sizes[:, 0] + sizes[:, 1] / 2, "cylinder": sizes[:, 1] / 2,
            "superquadric": sizes[:, 2], "box": sizes[:, 2] / 2}[kind]  # fmt: skip


def known_family(name, count, rng):
    """Pairs whose first body stands on the second along z with a known gap; then all turned at random but for every fifth.
    Gaps are STEPS times the scale of the family; every tenth is out of reach of the margin, a hundredth of that scale."""
    sizes = [rng.uniform(0.3, 0.8, (count, 5)) for _ in range(2)]
    (s, t), k = sizes, np.arange(count)
    unit = 1.0
    frames = [np.broadcast_to(UPRIGHT, (count, 3, 3)) for _ in range(2)]
    aside = np.zeros((count, 3))
    pick = np.random.default_rng(rng.integers(2**32))
    half = [None, None]
    if name in ("ends", "coaxial"):
        kinds = ("cylinder", "cylinder") if name == "ends" else ("capsule", "cylinder")
        if name == "ends":
            t[::3, 0] = s[::3, 0]  # as wide
            aside[:, :2] = rng.uniform(-0.15, 0.15, (count, 2))
            aside[::2] = 0
            half = [s[:, 1] / 2, t[:, 1] / 2]
        else:
            half = [s[:, 0] + s[:, 1] / 2, t[:, 1] / 2]
    elif name in ("side_by_side", "sides_cross"):
        kinds = [("cylinder", "cylinder"), ("capsule", "cylinder"), ("capsule", "capsule")][pick.integers(3)]
        angle = rng.uniform(0.05, np.pi - 0.05, count) if name == "sides_cross" else np.zeros(count)
        frames = [about(2, angle) @ ALONG_X, np.broadcast_to(ALONG_X, (count, 3, 3))]
        aside[:, 0] = rng.uniform(-0.1, 0.1, count) * (k % 2)
        half = [s[:, 0], t[:, 0]]
    elif name in ("end_on_face", "side_on_face", "rim_on_face"):
        kinds = ("cylinder" if name != "side_on_face" or pick.integers(2) else "capsule", "box")
        t[:, :2] = rng.uniform(1.5, 2.5, (count, 2))
        aside[:, :2] = rng.uniform(-0.2, 0.2, (count, 2))
        half = [s[:, 1] / 2, t[:, 2] / 2]
        if name == "side_on_face":
            frames[0] = about(2, rng.uniform(0, 7, count)) @ ALONG_X
            half[0] = s[:, 0]
        if name == "rim_on_face":
            lean = rng.uniform(0.02, 1.5, count)
            frames[0] = about(2, rng.uniform(0, 7, count)) @ about(0, lean)
            half[0] = s[:, 1] / 2 * np.cos(lean) + s[:, 0] * np.sin(lean)
            t[:, :2] += 1.5
    elif name == "tips":
        kinds = ("superquadric", ("box", "cylinder", "superquadric", "sphere")[pick.integers(4)])
        for x in (s, t):
            x[:, 3:] = rng.uniform(0.4, 1.0, (count, 2))  # round: of sharp tips that overlap there is a shorter way aslant
        if kinds[1] in ("box", "cylinder"):
            s[:, 3:] = rng.uniform(0.1, 1.9, (count, 2))
            t[:, :2] *= 2.0
        frames = [about(2, rng.uniform(0, 7, count)), frames[1]]
        half = [height(k, x) for k, x in zip(kinds, sizes)]
    else:
        tiny = 10.0 ** -pick.integers(2, 7)
        kinds = (ROUND[pick.integers(3)], (*ROUND, "box")[pick.integers(4)])
        unit = tiny
        s *= tiny
        s[:, 3:] = rng.uniform(0.3, 1.0, (count, 2))
        t[:, 3:] = rng.uniform(0.7, 1.0, (count, 2))
        half = [height(k, x) for k, x in zip(kinds, sizes)]
    gap = unit * np.where(k % 7 > 0, STEPS[k // 10 % 10], STEPS[k % 10])
    place = aside + np.stack([0 * gap, 0 * gap, half[0] + half[1] + gap], axis=1)
    whole = random_turns(rng, count)
    whole[::5] = UPRIGHT
    turns = [whole @ f for f in frames]
    return Pairs(tuple(kinds), sizes, turns, np.einsum("nij,nj->ni", whole, place), gap, whole[:, :, 2]), 0.01 * unit


def judge(pairs, starts, rounds=150, rng=None):
    """The largest separation found in extended precision by steps in random directions from `starts` (m, n, 3) and, for those
    that overlap, from the best of 400 directions all around: the gap, wherever only one top is to be found."""
    rng = np.random.default_rng(5) if rng is None else rng
    starts = [np.array(x, np.longdouble) for x in starts]
    around = rng.normal(size=(400, 3))
    around /= np.sqrt(np.sum(around**2, axis=1, keepdims=True))
    coarse = np.array([pairs.separation(np.broadcast_to(d, (len(pairs), 3))).astype(float) for d in around])
    for k in np.argsort(-coarse, axis=0)[:6]:
        starts.append(around[k].astype(np.longdouble))
    best = np.full(len(pairs), -np.inf, np.longdouble)
    for n in starts:
        high, step = pairs.separation(n), np.full(len(pairs), 0.1, np.longdouble)
        for _ in range(rounds):
            way = rng.normal(size=(len(pairs), 3)).astype(np.longdouble)
            way *= (step / np.sqrt(np.sum(way**2, axis=1)))[:, None]
            better = np.zeros(len(pairs), bool)
            for sign in (1, -1):
                m = n + sign * way
                m /= np.sqrt(np.sum(m**2, axis=1, keepdims=True))
                s = pairs.separation(m)
                up = s > high
                n, high = np.where(up[:, None], m, n), np.where(up, s, high)
                better |= up
            step *= np.where(better, 1.6, 0.8)
        best = np.maximum(best, high)
    return best.astype(float)
