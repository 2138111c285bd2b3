"""Clumps: mass, centre and inertia against closed forms, sampling and invariance."""

import cairn as cn
import numpy as np
import pytest
from cairn import pre
from cairn.model.body_values import turned_by
from cairn.pre import clumps
from cairn.pre.mass_properties import quaternions


def sampled(centers, radii, n=400_000):
    """Volume, centre and inertia tensor of a union by regular sampling, good to about 1e-2 over n^(1/dim)."""
    dim = centers.shape[1]
    low, high = (centers - radii[:, None]).min(axis=0), (centers + radii[:, None]).max(axis=0)
    m = int(round(n ** (1 / dim)))
    axes = [np.linspace(a, b, m, endpoint=False) + (b - a) / (2 * m) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, dim)
    inside = np.zeros(len(points), bool)
    for c, r in zip(centers, radii, strict=True):
        inside |= np.sum((points - c) ** 2, axis=1) < r * r
    points = points[inside]
    share = np.prod(high - low) / m**dim
    x = points - points.mean(axis=0)
    second = x.T @ x * share
    return len(points) * share, points.mean(axis=0), np.trace(second) * np.eye(dim) - second


def test_one_disk_and_one_sphere():
    disk = pre.clump([[3.0, -2.0]], [0.5], 2.0, depth=3.0)
    assert disk.mass == pytest.approx(2 * 3 * np.pi / 4, rel=1e-14)
    assert disk.inertia == pytest.approx([disk.mass * 0.125], rel=1e-14)
    sphere = pre.clump([[3.0, -2.0, 1.0]], [0.5], 2.0)
    assert sphere.mass == pytest.approx(2 * np.pi / 6, rel=1e-14)
    assert sphere.moments == pytest.approx([0.4 * 0.25 * sphere.mass] * 3, rel=1e-14)
    assert np.allclose(sphere.center, [3, -2, 1], rtol=1e-15)


@pytest.mark.parametrize("overlap", ["union", "sum"])
def test_parts_apart_add_up(overlap):
    body = pre.clump([[0.0, 0, 0], [3.0, 0, 0]], [1.0, 0.5], 1.0, overlap=overlap)
    m = np.array([4 / 3 * np.pi, np.pi / 6])
    x = np.array([0.0, 3.0]) - m[1] * 3 / m.sum()
    own = 0.4 * m @ np.array([1.0, 0.25])
    assert body.mass == pytest.approx(m.sum(), rel=1e-13)
    assert np.sort(body.moments) == pytest.approx([own, own + m @ x**2, own + m @ x**2], rel=1e-12)


def test_lens_of_two_disks_and_two_spheres():
    r, d = 1.0, 1.2
    centers, radii = clumps.row(2, r, d)
    lens = 2 * r * r * np.arccos(d / 2 / r) - d / 2 * np.sqrt(4 * r * r - d * d)
    assert pre.clump(centers[:, :2], radii, 1.0).mass == pytest.approx(2 * np.pi - lens, rel=1e-13)
    lens = np.pi * (4 * r + d) * (2 * r - d) ** 2 / 12
    assert pre.clump(centers, radii, 1.0).mass == pytest.approx(8 / 3 * np.pi - lens, rel=1e-10)


def test_hidden_and_repeated_parts_do_not_count():
    once = pre.clump([[0.0, 0.0], [1.0, 0.0]], [1.0, 0.7], 1.0)
    more = pre.clump([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.1, 0.2]], [1.0, 0.7, 1.0, 0.3], 1.0)
    assert more.mass == pytest.approx(once.mass, rel=1e-13)
    assert more.inertia == pytest.approx(once.inertia, rel=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_union_against_sampling(dim):
    rng = np.random.default_rng(dim)
    centers, radii = rng.uniform(-1, 1, (6, dim)), rng.uniform(0.5, 1.0, 6)
    volume, center, tensor = sampled(centers, radii)
    body = pre.clump(centers, radii, 1.0)
    assert body.mass == pytest.approx(volume, rel=5e-3)
    assert np.allclose(body.center, center, atol=5e-3)
    expected = tensor[None] if dim == 3 else np.array([np.trace(tensor)])
    np.testing.assert_allclose(body.inertia, expected, rtol=0, atol=1e-2 * np.abs(expected).max())
    assert np.allclose(body.offsets + body.center, centers, rtol=0, atol=1e-14) and np.linalg.det(body.axes) == pytest.approx(1.0)
    if dim == 3:
        assert np.allclose(body.axes * body.moments @ body.axes.T, body.inertia, rtol=0, atol=1e-13 * body.moments.max())


def test_turned_moved_and_scaled():
    centers, radii = clumps.tetrahedron(1.0, 1.5)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    plain, moved = pre.clump(centers, radii, 1.0), pre.clump(1e-6 * (centers @ turn.T + 100.0), 1e-6 * radii, 1e18)
    assert moved.mass == pytest.approx(plain.mass, rel=1e-8)
    scale = 1e-12 * plain.moments.max()
    np.testing.assert_allclose(moved.inertia[0], turn @ (1e-12 * plain.inertia[0]) @ turn.T, rtol=0, atol=1e-8 * scale)
    coarse, fine = (pre.clump(centers, radii, 1.0, points=n).mass for n in (48, 160))
    assert coarse == pytest.approx(fine, rel=1e-8)


def test_templates():
    for centers, radii in (clumps.row(4, 0.5, 0.8), clumps.ring(5, 0.5, 0.8), clumps.tetrahedron(0.5, 0.8)):
        distance = np.linalg.norm(centers[:, None] - centers, axis=2)[np.triu_indices(len(radii), 1)]
        assert distance.min() == pytest.approx(0.8, rel=1e-12)
        assert np.allclose(centers.mean(axis=0), 0.0, atol=1e-15)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: pre.clump(np.zeros((1, 4)), [1.0], 1.0), ["dim is 4"]),
        (lambda: pre.clump(np.zeros((0, 2)), [], 1.0), ["centers is empty"]),
        (lambda: pre.clump([[0.0, 0.0]], [1.0], 0.0), ["density is 0.0", "> 0"]),
        (lambda: pre.clump([[0.0, 0.0]], [1.0], 1.0, overlap="half"), ["overlap is 'half'", "union"]),
        (lambda: clumps.row(0, 1.0, 1.0), ["count is 0"]),
    ],
)
def test_refusals(call, words):
    with pytest.raises(ValueError) as refusal:
        call()
    for word in words:
        assert word in str(refusal.value)


def set_of(clump, places, inertia=None, **options):
    material = cn.Material("rock")
    return cn.clumps(places, clump.offsets, clump.radii, clump.mass, clump.inertia if inertia is None else inertia, material,
                     **options)  # fmt: skip


def parts_in_space(bodies):
    """Centres (n, m, 3) of the parts of a set of clumps."""
    parts = bodies.contactors[0]
    q = np.tile([1.0, 0, 0, 0], (len(bodies), 1)) if bodies.rotation is None else bodies.rotation
    return (bodies.position[parts.body] + turned_by(q[parts.body], parts.offset)).reshape(len(bodies), -1, 3)


SHAPES = {
    "rod along z": [[0, 0, -0.02], [0, 0, 0.02]],
    "cube of eight": [[x, y, z] for x in (-0.02, 0.02) for y in (-0.02, 0.02) for z in (-0.02, 0.02)],
    "corner": [[0, 0, 0], [0, 0, 0.04], [0.04, 0, 0]],
    "oblique rod": [[0, 0, 0], [0.01, 0.02, 0.03]],
}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("scale", [1e-7, 1.0, 1e7])
def test_clumps_stand_as_they_are_given(shape, scale):
    centers = np.array(SHAPES[shape]) * scale
    clump = pre.clump(centers, np.full(len(centers), 0.025 * scale), 2500.0)
    places = scale * np.array([[0.0, 0, 0], [5, 6, 7], [0, 0, 3]])  # three bodies, whose moments (3, 3) are no tensor
    given = centers - clump.center
    np.testing.assert_allclose(parts_in_space(set_of(clump, places)), given + places[:, None], rtol=0, atol=1e-14 * 10 * scale)
    turns = np.random.default_rng(1).normal(size=(3, 4))
    turns /= np.linalg.norm(turns, axis=1)[:, None]
    turned = np.array([turned_by(np.broadcast_to(q, (len(given), 4)), given) for q in turns])
    found = parts_in_space(set_of(clump, places, rotation=turns))
    np.testing.assert_allclose(found, turned + places[:, None], rtol=0, atol=1e-14 * 10 * scale)
    if shape in ("rod along z", "cube of eight"):
        assert set_of(clump, places).rotation is None and np.array_equal(clump.axes, np.eye(3))


def test_a_tensor_moves_a_clump_as_its_principal_moments_do():
    """Free rotation about no principal axis: the same motion from the tensor and from moments, axes and a rotation by hand."""
    clump = pre.clump(SHAPES["corner"], [0.025] * 3, 2500.0)
    spin = [0.0, 0, 0, 3.0, 5.0, -2.0]
    by_hand = cn.clumps([[0.0, 0, 0]], clump.offsets @ clump.axes, clump.radii, clump.mass, clump.moments, cn.Material("rock"),
                        rotation=quaternions(clump.axes[None]), velocity=spin)  # fmt: skip
    found = []
    for bodies in (set_of(clump, [[0.0, 0, 0]], velocity=spin), by_hand):
        scene = cn.Scene(3)
        scene.add(bodies)
        sim = cn.Simulation(scene, 1e-3)
        sim.run(200, progress=False)
        found.append((sim.bodies.velocity[0].copy(), sim.bodies.rotation[0].copy()))
    np.testing.assert_allclose(found[0][0], found[1][0], rtol=0, atol=1e-11 * 5)
    np.testing.assert_allclose(found[0][1], found[1][1], rtol=0, atol=1e-11)
    assert np.abs(found[0][0][3:] - spin[3:]).max() > 0.1  # it precesses


@pytest.mark.parametrize(
    "tensor, words",
    [
        ([[1.0, 0.5, 0], [0, 1, 0], [0, 0, 1]], ["inertia[0]", "symmetric"]),
        ([[1.0, 2, 0], [2, 1, 0], [0, 0, 1]], ["inertia[0]", "moments are > 0"]),
        ([[1.0, np.nan, 0], [np.nan, 1, 0], [0, 0, 1]], ["inertia[0, 0, 1]", "finite"]),
    ],
)
def test_tensors_that_are_none_are_refused(tensor, words):
    with pytest.raises(ValueError) as error:
        cn.clumps([[0.0, 0, 0]], [[0.0, 0, 0]], 1.0, 1.0, [tensor], cn.Material("rock"))
    assert all(word in str(error.value) for word in words)
