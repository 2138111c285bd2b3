"""Pairs of convex bodies, one scene for many pairs, and what an independent library says of them."""

import cairn as cn
import numpy as np
from cairn.pre.decompose import ears

L = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]  # outline of an L-shaped prism
ROCK = cn.Material("rock", density=1000.0)
CUBE = np.array([[x, y, z] for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)])
CUBE_FACES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]


def triangles(faces):
    return np.array([[f[0], f[k], f[k + 1]] for f in faces for k in range(1, len(f) - 1)])


def random_polyhedron(rng, corners=8):
    """Convex hull of points near a sphere of radius 1: vertices (corners, 3), triangles seen from outside."""
    from scipy.spatial import ConvexHull

    while True:
        v = rng.normal(size=(corners, 3))
        v *= rng.uniform(0.6 if corners < 12 else 1, 1, size=(corners, 1)) / np.linalg.norm(v, axis=1, keepdims=True)
        hull = ConvexHull(v)
        if len(hull.vertices) == corners:
            break
    faces = hull.simplices.copy()
    normal = np.cross(v[faces[:, 1]] - v[faces[:, 0]], v[faces[:, 2]] - v[faces[:, 0]])
    inward = np.einsum("ij,ij->i", normal, hull.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    return v, faces


def random_rotation(rng):
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else q[:, ::-1]


def detect(pairs, margin, spacing):
    """Contacts of pairs of meshes (vertices, faces), each pair in a place of its own: a list of arrays of gaps, normals (from
    the second body to the first) and points from the place of the pair."""
    side = int(np.ceil(len(pairs) ** (1 / 3)))
    k = np.arange(len(pairs))
    place = spacing * np.stack([k % side, k // side % side, k // side**2], axis=1)
    meshes = [(v + p, f) for pair, p in zip(pairs, place) for v, f in pair]
    scene = cn.Scene(dim=3)
    scene.add(cn.polyhedra(meshes, ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=1e-12, strategy=cn.NSCD(margin=margin), overlap="ignore")
    sim.step()
    c = sim.contacts
    order = np.argsort(np.minimum(*c.bodies.T) // 2, kind="stable")
    turned = np.where(c.bodies[:, 0] < c.bodies[:, 1], 1.0, -1.0)[order, None]
    first, second = (c.bodies[order, i] // 2 for i in (0, 1))
    assert np.all(first == second), "contacts between pairs: widen the spacing"
    cuts = np.searchsorted(first, np.arange(1, len(pairs)))
    point = c.point[order] - place[first]
    return list(zip(*(np.split(x, cuts) for x in (c.gap[order], turned * c.normal[order], point))))


def coal_gap(a, b):
    """Signed distance of two convex meshes of triangles by Coal, to its last digits."""
    import coal

    def convex(vertices, faces):
        points, corners = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
        for x in vertices:
            points.append(x)
        for t in triangles(faces) if isinstance(faces, list) else faces:
            corners.append(coal.Triangle(*map(int, t)))
        return coal.Convex(points, corners)

    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_tolerance = request.epa_tolerance = 1e-15
    request.gjk_max_iterations = request.epa_max_iterations = 10000
    still = coal.Transform3s()
    return coal.distance(convex(*a), still, convex(*b), still, request, result)


def feature_gap(a, b):
    """Signed distance of two convex meshes from every pair of their features, in extended precision: the largest separation
    along normals of faces and across edges if the bodies overlap, else the least distance of a vertex from a face or of two
    edges."""
    (va, fa), (vb, fb) = a, b
    va, vb = (np.asarray(v, np.longdouble) for v in (va, vb))
    fa, fb = (triangles(f) if isinstance(f, list) else np.asarray(f) for f in (fa, fb))
    sets = []
    for v, f in ((va, fa), (vb, fb)):
        n = np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])
        e = np.unique(np.sort(np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]), axis=1), axis=0)
        sets.append((n / norm(n), v[e[:, 0]], v[e[:, 1]] - v[e[:, 0]]))
    (na, pa, da), (nb, pb, db) = sets
    cross = np.cross(da[:, None], db[None]).reshape(-1, 3)
    length = norm(cross)[:, 0]
    wide = length > 1e-12 * (norm(da) @ norm(db).T).ravel()
    cross = cross[wide] / length[wide, None]
    axes = np.concatenate([-na, nb, cross, -cross])
    best = ((va @ axes.T).min(axis=0) - (vb @ axes.T).max(axis=0)).max()
    if best <= 0:
        return float(best)
    least = np.inf
    for v, f, n, w in ((va, fa, na, vb), (vb, fb, nb, va)):
        height = np.einsum("wfi,fi->wf", w[:, None] - v[f[:, 0]], n)
        inside = height > 0
        for k in range(3):
            side = np.cross(n, v[f[:, (k + 1) % 3]] - v[f[:, k]])
            inside &= np.einsum("wfi,fi->wf", w[:, None] - v[f[:, k]], side) >= 0
        if inside.any():
            least = min(least, height[inside].min())
    return float(min(least, edge_distances(pa, da, pb, db).min()))


def norm(x):
    return np.sqrt(np.sum(x * x, axis=-1, keepdims=True))


def edge_distances(p, d, q, e):
    """Least distances of segments p + s d and q + t e, s and t in 0..1: all pairs (n, m) (Ericson 2005, 5.1.9)."""
    p, d, q, e = p[:, None], d[:, None], q[None], e[None]
    r = p - q
    dd, ee, de, dr, er = (np.sum(x * y, axis=-1) for x, y in ((d, d), (e, e), (d, e), (d, r), (e, r)))
    square = dd * ee - de * de
    s = np.where(square > 0, np.clip((de * er - dr * ee) / np.where(square > 0, square, 1), 0, 1), 0)
    t = np.clip((de * s + er) / ee, 0, 1)
    s = np.clip((de * t - dr) / dd, 0, 1)
    return norm(r + s[..., None] * d - t[..., None] * e)[..., 0]


FAMILIES = ["flush", "edge_on_edge", "vertex_on_face", "coplanar", "sliver", "tiny_on_huge"]
STEPS = np.array([0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-7, -1e-7, 1e-3, -1e-3, 0.1])  # gaps in margins of 0.01 but for the last


def about_z(angle):
    return np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])


def flush(rng, k):
    """Boxes face on face, aligned or turned about the normal."""
    lower, upper = rng.uniform(0.5, 2, (2, 3))
    turn = about_z([0.0, np.pi / 4, rng.uniform(0, 7)][k % 3])
    return CUBE * upper @ turn.T, CUBE * lower, np.append(rng.uniform(-0.2, 0.2, 2) * (k % 2), (lower[2] + upper[2]) / 2), 1


def edge_on_edge(rng, _):
    roof = np.array([[1, 0, 0], [0, np.sqrt(0.5), -np.sqrt(0.5)], [0, np.sqrt(0.5), np.sqrt(0.5)]])
    v = CUBE * [2, 1, 1] @ roof.T
    return v @ about_z(rng.uniform(0.3, np.pi - 0.3)).T, v, [rng.uniform(-0.6, 0.6), 0, np.sqrt(2)], 1


def vertex_on_face(rng, _):
    while True:
        v = CUBE * rng.uniform(0.5, 2, 3) @ random_rotation(rng).T
        height = np.sort(v[:, 2])
        if height[1] - height[0] > 0.05:
            break
    return v, CUBE * [2, 2, 1], np.append(rng.uniform(-0.9, 0.9, 2), 0.5) - v[np.argmin(v[:, 2])], 1


def coplanar(rng, k):
    """Equal boxes side by side: four of their faces lie in common planes, and edges on edges; or one an edge's half as long."""
    sizes = rng.uniform(0.5, 2, 3)
    part = [1.0, 0.5][k % 2]
    return CUBE * sizes * [part, 1, 1], CUBE * sizes, [sizes[0] * (1 - part) / 2, 0, sizes[2]], 1


def sliver(rng, k):
    """Plates and needles 1e-4 thick, on a box and on each other; gaps are of their thickness."""
    thin = 1e-4
    upper = np.array([1, 1, thin]) if k % 2 else np.array([1, thin, thin])
    lower = np.array([1.5, 1.5, thin]) if k % 3 else np.array([1.5, 1.5, 1.0])
    place = [*rng.uniform(-0.2, 0.2, 2), (upper[2] + lower[2]) / 2]
    return CUBE * upper @ about_z(rng.uniform(0, 7)).T, CUBE * lower, place, thin


def tiny_on_huge(rng, k):
    """A cube 1e-2 to 1e-6 the size of the other, on one of its faces; gaps are scaled by the smaller body."""
    tiny = 10.0 ** -rng.integers(2, 7)
    return CUBE * tiny @ about_z(rng.uniform(0, 7)).T, CUBE, [*rng.uniform(-0.4, 0.4, 2), (1 + tiny) / 2], 1e-6


def known_pairs(family, count, rng):
    """Pairs of meshes of a family, built so that the answer is known: the pairs, their gaps, their normals, the margin and the
    spacing for `detect`. Every tenth is apart by ten margins."""
    make = globals()[family]
    pairs, gaps, normals = [], [], []
    for k in range(count):
        upper, lower, place, unit = make(rng, k)
        gap = STEPS[k // 10 % 10 if k % 7 else k % 10] * unit
        turn = np.eye(3) if k % 5 == 0 else random_rotation(rng)
        upper = upper + place + [0, 0, gap]
        pairs.append(((upper @ turn.T, CUBE_FACES), (lower @ turn.T, CUBE_FACES)))
        gaps.append(gap)
        normals.append(turn[:, 2])
    return pairs, gaps, normals, 0.01 * unit, 8.0


def prism(outline, height):
    """Vertices and faces of a prism on a polygon; its lids are cut into triangles."""
    corners = np.array(outline, float)
    m = len(corners)
    vertices = np.concatenate([np.column_stack((corners, np.full(m, z))) for z in (0.0, height)])
    lids = [t for k in ears(corners) for t in (k[::-1], [i + m for i in k])]
    return vertices, [*lids, *([k, (k + 1) % m, m + (k + 1) % m, m + k] for k in range(m))]
