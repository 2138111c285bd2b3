"""Kernels of seams beside plain numpy: motion of runs of contacts, and verdicts over the seam of two flush blocks."""

import ctypes

import numpy as np
import pytest
from kernels import kernel

SLOW, BY_FORCES, BY_SPEED = -1, 1, 2
STAYS, NONE, TURNED = 0, 1, 2
FLUSH, REST, STILL, ALONG = 1e-4, 1e-2, 1e-6, 1e-2
HULL = 1
SCENE = ("shape seen centre radius direction vectors", "a b image gap normal point run body position velocity free")
HULLS = "hull first_vertex first_face first_edge first_corner corner_vertex corner_edge edge offset inner place turned recalled"
TYPES = {"shape": np.int16, "run": np.int64, "place": np.int64} | dict.fromkeys(
    ["seen", "a", "b", "image", "body", *HULLS.split()[:8]], np.int32
)


def given(dim, periodic=False, step=1e-3, **arrays):
    """The struct cairn_seams as bytes, and the arrays that it points to."""
    kept = {name: np.ascontiguousarray(value, TYPES.get(name, float)) for name, value in arrays.items()}

    def pointers(names):
        return [kept[name].ctypes.data if name in kept else 0 for name in names.split()]

    words = [np.array([dim, periodic], np.int32).view(np.int64)[0], *pointers(SCENE[0])]
    words += [
        *np.array([dim, 4, 0, 0], np.int32).view(np.int64),
        *pointers(HULLS),
        *pointers(SCENE[1]),
        np.float64(step).view(np.int64),
    ]
    return np.array(words, np.int64), kept


def velocity_at(v, x):
    """Velocity of a point x from the centre of a body with velocity v, (3,) or (6,) [m/s]."""
    return v[:2] + v[2] * np.array([-x[1], x[0]]) if len(v) == 3 else v[:3] + np.cross(v[3:], x)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("periodic", [False, True])
def test_motion_of_runs(dim, periodic):
    rng = np.random.default_rng(dim + 2 * periodic)
    bodies, runs, dofs = 12, 400, 3 * dim - 3
    long = rng.integers(1, 3 if dim == 2 else 5, runs)
    run = np.concatenate([[0], np.cumsum(long)])
    owner = np.repeat(np.arange(runs), long)
    a = rng.integers(0, bodies - 1, runs)[owner]
    b = (a + rng.integers(1, bodies, runs)[owner]) % bodies
    count = run[-1]
    normal = rng.normal(size=(runs, dim))
    normal = (normal / np.linalg.norm(normal, axis=1)[:, None])[owner]
    point = rng.normal(size=(runs, dim))[owner] + 10.0 ** rng.uniform(-6, 0, (runs, 1))[owner] * rng.normal(size=(count, dim))
    gap = rng.choice([1e-5, -1e-5, 1e-3, 0.02, -0.02], count)
    x, radius = rng.normal(size=(bodies, dim)), rng.uniform(0.5, 2, bodies)
    centre = x + rng.normal(size=(bodies, dim))  # contactors that stand beside their bodies
    velocity, free = rng.normal(size=(2, bodies, dofs))
    velocity *= 10.0 ** rng.uniform(-8, 0, (bodies, 1))
    free[::2] = velocity[::2] * rng.choice([1, 2, 300], (6, 1))
    body = np.where(np.arange(bodies) == 3, -1, np.arange(bodies))  # of a mesh
    alike = np.isin(np.arange(bodies), [1, 2, 5]).astype(np.int8)
    velocity[[1, 2, 5]], free[[1, 2, 5]] = np.eye(dofs)[0], np.eye(dofs)[1]
    scene, kept = given(dim, periodic, shape=np.zeros(bodies), seen=[HULL], centre=centre, radius=radius, vectors=np.eye(3),
                        a=a, b=b, image=np.zeros(count), gap=gap, normal=normal, point=point, run=run, body=body, position=x,
                        velocity=velocity, free=free)  # fmt: skip
    closing, speed = np.full(runs, 9, np.int8), np.full(runs, np.nan)
    kernel("cairn_seam_closing")(scene, 0, runs, closing, speed)
    for r in range(runs):
        i, j = a[run[r]], b[run[r]]
        change = max(np.abs(free[k, :dim] - velocity[k, :dim]).max() if body[k] >= 0 else 0 for k in (i, j))
        now, later = [], []
        for k in range(run[r], run[r + 1]):
            arm = centre[j] - x[j] if periodic else point[k] - x[j]
            for v, speeds in ((velocity, now), (free, later)):
                nears = normal[k] @ velocity_at(v[j], arm) if body[j] >= 0 else 0
                nears -= normal[k] @ velocity_at(v[i], point[k] - x[i]) if body[i] >= 0 else 0
                speeds.append(0 if alike[i] and alike[j] else nears)
        if max(now) > REST * change and not (alike[i] and alike[j]):
            expected = BY_SPEED
        elif max(later) > REST * change and not (alike[i] and alike[j]):
            expected = BY_FORCES
        else:
            expected = SLOW * (max(now) > STILL * change)
        assert closing[r] == expected, r
        np.testing.assert_allclose(speed[r], np.abs(now).max(), rtol=1e-9, atol=1e-15)
    assert set(closing) == {0, SLOW, BY_FORCES, BY_SPEED}


def block(x, y, z):
    """Corners (8, 3), normals (6, 3) and offsets (6) of a block; z: heights of the bottom, of the top at x[0] and at x[1]."""
    v = np.array([[x[i], y[j], z[0] if k == 0 else z[1 + i]] for k in (0, 1) for j in (0, 1) for i in (0, 1)], float)
    at, v = v.mean(0), v - v.mean(0)
    slope = (z[2] - z[1]) / (x[1] - x[0])
    n = np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], np.array([-slope, 0, 1]) / np.hypot(1, slope)])
    return at, v, n, (v @ n.T).max(0)


def rotation(rng):
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.diag(r)) * np.sign(np.linalg.det(q) * np.prod(np.sign(np.diag(r))))


@pytest.mark.parametrize("seed", range(8))
def test_verdicts_over_a_seam(seed):
    """X lies on Z, left of x = 0, and meets Y, right of it. All of Y is below the common plane: the contact is dropped. Where Y
    rises as a ramp it takes the normal of the ramp. It stays where it does not lean over the rim of Y, is off the plane, does not
    close, or closes so slowly that it may be an error, and where Y parts from Z."""
    rng = np.random.default_rng(seed)
    met = {NONE: 0, TURNED: 0, STAYS: 0}
    for _ in range(500):
        turn, away = rotation(rng), rng.normal(size=3)
        small = FLUSH * 0.5  # a tolerance at most: the smallest radius is above half a metre
        rise = rng.choice([0, 0, 0.4, -0.4, 30, -30]) * small
        ramp = rng.choice([0, 0, 0.3])
        dips = rng.choice([0, 0, 0, 50]) * small
        y = block([0, 2], [-1, 1], [-1, rise, rise + 2 * ramp])
        hulls = [block([-0.5, 0.1], [-0.4, 0.4], [-dips, 1, 1]), block([-2, 0], [-1, 1], [-1, 0, 0]), y,
                 block([-2, -0.5], [-1, 1], [0.1, 1, 1])]  # fmt: skip
        angle = rng.choice([np.pi / 2, 1.0, 0.3, 0, 1e-5, -1.0])  # of the normal to the vertical, towards Z
        n_y = np.array([-np.sin(angle), 0, np.cos(angle)])
        inside = rng.random() < 0.2
        q_y = np.array([[0.05 * inside, w, rise + 0.05 * inside * ramp] for w in rng.uniform(-0.3, 0.3, rng.integers(1, 3))])
        presses, closes = rng.random() < 0.5, rng.choice([0, SLOW, BY_FORCES, BY_SPEED])
        across = rng.choice([0.5, 2.0]) * ALONG  # speed across the plane, of that on Y
        parts = rng.choice([0, 0, 0.5, 2.0, -2.0])  # speed of Y along the plane's normal, of the largest at which it stays flush
        points = [np.array([[-0.4, -0.3, 0], [-0.4, 0.3, 0], [0, 0.3, 0]]), q_y, np.array([[-0.5, 0, 0.5]])]
        normals, others = [np.array([0, 0, 1.0]), n_y, np.array([1.0, 0, 0])], [1, 2, 3]
        gap = rng.uniform(-0.1, 0.1) * small
        radius = np.array([np.linalg.norm(v, axis=1).max() for _, v, _, _ in hulls])
        tolerance = FLUSH * radius[:3].min()
        # height of the second point above the tolerance, in overlaps: one is covered
        lift = rng.choice([0, 0, 0.5, 3]) * (len(q_y) - 1) * (gap < 0 and not ramp and not dips)
        if lift:
            q_y[1, 2] = tolerance + lift * abs(gap)
        as_b = bool(rng.integers(2))  # the sliding body is the second of each pair
        a, b, normal, point, run = [], [], [], [], [0]
        for q, n, other in zip(points, normals, others):
            for one in q:
                a.append(other if as_b else 0)
                b.append(0 if as_b else other)
                normal.append(turn @ n * (-1 if as_b else 1))
                point.append(turn @ (one + gap / 2 * n) + away)
            run.append(len(a))
        n = len(hulls)
        places = np.cumsum([0] + [3 * 14] * (n - 1))
        turned = np.concatenate([np.concatenate([(v @ turn.T).T.ravel(), (m @ turn.T).T.ravel()]) for _, v, m, _ in hulls])
        velocity = np.zeros((n, 6))
        velocity[2, :3] = turn[:, 2] * parts * tolerance / (10 * 1e-3)
        scene, kept = given(
            3, shape=np.zeros(n), seen=[HULL], centre=[turn @ at + away for at, *_ in hulls], radius=radius, vectors=np.eye(3),
            hull=range(n), first_vertex=8 * np.arange(n + 1), first_face=6 * np.arange(n + 1), first_edge=np.zeros(n + 1),
            first_corner=np.zeros(6 * n + 1), corner_vertex=[0], corner_edge=[0], edge=np.zeros((1, 4)),
            offset=np.concatenate([d for *_, d in hulls]), inner=np.full(n, 0.1), place=places, turned=turned, a=a, b=b,
            image=np.zeros(len(a)), gap=np.full(len(a), gap), normal=normal, point=point, run=run, body=range(n),
            position=np.zeros((n, 3)), velocity=velocity, free=np.zeros((n, 6)))  # fmt: skip
        closing, speed = np.array([0, closes, BY_SPEED if presses else 0], np.int8), np.array([across, 1.0, 0.0])
        start, entry = np.array([0, 3, 3, 3, 3], np.int32), np.array([0, 2, 4], np.int32) + np.int32(as_b)
        verdict, found = np.zeros(3, np.int8), np.zeros((3, 3))
        kernel("cairn_seam_contacts")(scene, 0, n, start, entry, closing, speed, verdict, found)
        y_high = y[1][:, 2].max() + y[0][2]
        asked = closes != 0 or (presses and n_y[0] < -1e-4)
        held = closes == SLOW and across > ALONG
        expected = STAYS
        if asked and not held and angle > 1e-3 and not inside and abs(rise) < 10 * small and abs(parts) < 1 and lift < 1:
            if abs(y_high) <= tolerance:
                expected = NONE
            elif n_y @ y[2][5] < 1 - 1e-6:
                expected = TURNED
        assert list(verdict) == [STAYS, expected, STAYS]
        if expected == TURNED:
            np.testing.assert_allclose(found[1], turn @ y[2][5], atol=1e-12)
        met[expected] += 1
    assert min(met.values()) > 3


def test_the_struct_is_as_long_as_the_header_says():
    words, _ = given(3)
    assert len(words) == 1 + 6 + 2 + 13 + 11 + 1 and ctypes.sizeof(ctypes.c_void_p) == 8
