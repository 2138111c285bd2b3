"""Pairs of convex bodies, one scene for many pairs, and what an independent library says of them."""

import cairn as cn
import numpy as np

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
