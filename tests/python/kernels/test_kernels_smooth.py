"""Kernels of smooth DEM, of cells of solids and of the energy balance of steps, against numpy pair by pair, energies and sums."""

import numpy as np
import pytest
from kernels import kernel
from second_order import box
from test_kernels_solids import ELEMENTS, neo_hookean

RNG = np.random.default_rng(33)
CLOSE = dict(rtol=1e-11, atol=1e-12)


def some(*shape):
    return RNG.standard_normal(shape)


def positive(*shape):
    return RNG.uniform(0.5, 2.0, shape)


def columns(array):
    """(n, c) to (c, n) in memory, as Fortran's (n, c) lies."""
    return np.ascontiguousarray(array.T)


def units(n, dim):
    x = some(n, dim)
    return x / np.linalg.norm(x, axis=1)[:, None]


def cross(a, b):
    """Cross product; of vectors of the plane, its only component."""
    return np.cross(a, b) if a.shape[-1] == 3 else a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


# ---------------------------------------------------------------------- pairs of smooth DEM


def test_lanes_of_those_that_act():
    n, reach, states = 11, 0.02, 2
    gap, status = RNG.uniform(-0.05, 0.05, n), (RNG.random(n) < 0.2).astype(np.int32)
    state, active = some(n, states), RNG.integers(0, 2, n).astype(np.int8)
    lane, count, filled = np.full(n + 8, -1, np.int32), np.empty(1, np.int32), np.empty(1, np.int32)
    acts = (gap < reach) & (status != 1)
    forgets, kept = (active == 1) & ~acts, state.copy()
    kernel("cairn_smooth_admit")(n, gap, status, reach, states, state, active, lane, count, filled)
    expected = np.flatnonzero(acts) + 1
    assert count[0] == len(expected) and filled[0] == -(-len(expected) // 8) * 8
    assert list(lane[: filled[0]]) == [*expected, *[expected[-1]] * (filled[0] - count[0])]
    assert np.array_equal(active, acts) and np.array_equal(state, np.where(forgets[:, None], 0, kept))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("offset", [0, 1])
def test_sides_of_pairs(dim, offset):
    n, contactors, bodies = 6, 5, 4
    a, b = (RNG.integers(0, contactors, n).astype(np.int32) for _ in range(2))
    body = RNG.integers(0, bodies, contactors).astype(np.int32)
    centre, position, grain, point = some(contactors, dim), some(bodies, dim), positive(contactors, 2), some(n, dim)
    between = centre[a] - centre[b]
    if not offset:
        body, position = np.arange(contactors, dtype=np.int32), centre
    out = [np.empty((k, n)) for k in (dim, dim, 2, 2)]
    kernel("cairn_smooth_sides")(
        dim, n, a, b, body[a], body[b], grain, columns(between), columns(point), offset, centre, position, *out
    )
    place = centre[a] + point
    for got, expected in zip(out, (place - position[body[a]], place - position[body[b]], grain[a], grain[b])):
        np.testing.assert_allclose(got.T, expected, **CLOSE)


def frames(normal):
    """Tangents by the formula of Duff et al. (2017): columns n, t, s of each."""
    if normal.shape[1] == 2:
        return np.stack([normal, np.stack([-normal[:, 1], normal[:, 0]], axis=1)], axis=2)
    x, y, z = normal.T
    w = np.where(z >= 0, 1.0, -1.0)
    a = -1 / (w + z)
    t = np.stack([1 + w * x * x * a, w * x * y * a, -w * x], axis=1)
    return np.stack([normal, t, np.cross(normal, t)], axis=2)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("cut", [False, True])
def test_forces_go_out_and_come_back(dim, cut):
    """Velocities along each frame, springs that turn with it; forces onto bodies, so that power is the same on both ways."""
    n, m, bodies, nd, h = 7, 8, 5, 3 * dim - 3, 0.01
    lane = np.array([2, 3, 5, 7, 7, 7, 7, 7], np.int32)
    count, pick = 4, lane - 1
    body_a, body_b = np.array([0, 1, 2, 3, 0, 1, 4], np.int32), np.array([1, 2, 3, 4, 2, 3, 0], np.int32)
    v, normal, levers, jump = some(bodies, nd), units(n, dim), some(2, n, dim), some(n, dim)
    grains, gap, scalars, vectors = positive(2, n, 2), some(n), 1, 2
    wide, flat = (3, 2) if dim == 3 else (1, 1)  # numbers of a vector as it is kept, and in the frame
    stored = some(n, scalars + wide * vectors)
    frame, u, lane_gap = np.empty((6 if dim == 3 else 2, m)), np.empty((dim, m)), np.empty(m)
    geometry, state = np.empty((3, m)), np.empty((scalars + flat * vectors, m))
    sides = [columns(x) for x in levers]
    kernel(f"cairn_smooth_gather{dim}", "cairn_smooth_gather")(
        n, m, lane, body_a, body_b, v, *[columns(g) for g in grains], gap, columns(normal), *sides, h, scalars, vectors, stored,
        frame, u, lane_gap, geometry, state, columns(jump) if cut else None,
    )  # fmt: skip
    known, spin = frames(normal), v[:, dim:]
    np.testing.assert_allclose(frame.T, known[pick].transpose(0, 2, 1).reshape(m, -1)[:, : len(frame)], **CLOSE)

    def at(body, lever):
        turn = np.cross(spin[body], lever) if dim == 3 else spin[body] * np.stack([-lever[:, 1], lever[:, 0]], axis=1)
        return v[body, :dim] + turn

    slip = at(body_a, levers[0]) - at(body_b, levers[1]) - (jump if cut else 0)
    np.testing.assert_allclose(u.T, np.einsum("nij,ni->nj", known, slip)[pick], **CLOSE)
    assert np.array_equal(lane_gap, gap[pick])
    expected = np.stack([np.zeros(n), *(1 / grains.sum(axis=0)).T], axis=1)
    np.testing.assert_allclose(geometry.T, expected[pick], **CLOSE)
    np.testing.assert_allclose(state[:scalars].T, stored[pick, :scalars], **CLOSE)
    springs = stored[pick, scalars:].reshape(m, vectors, wide)
    got = state[scalars:].reshape(vectors, flat, m).transpose(2, 0, 1)
    if dim == 2:
        np.testing.assert_allclose(got, springs, **CLOSE)
    else:
        for i, k in enumerate(pick):
            for x, y in zip(springs[i], got[i]):
                inside = known[k][:, 1:].T @ x
                angle = np.arctan(h / 2 * normal[k] @ (spin[body_a[k]] + spin[body_b[k]]))
                turned = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]] @ inside
                np.testing.assert_allclose(y, turned * np.linalg.norm(x) / np.linalg.norm(inside), **CLOSE)
    f, kept, lane_force, force, other = some(m, dim), stored.copy(), np.zeros((n, dim)), np.zeros((bodies, nd)), np.zeros((n, nd))
    kernel(f"cairn_smooth_scatter{dim}", "cairn_smooth_scatter")(
        n, count, m, lane, body_a, body_b, *sides, frame, columns(f), scalars, vectors, state, stored, lane_force, force,
        other if cut else None,
    )  # fmt: skip
    first = pick[:count]
    space, total = np.einsum("nij,nj->ni", known[first], f[:count]), np.zeros((bodies, nd))
    np.testing.assert_allclose(lane_force[first], space, **CLOSE)
    for side, (body, sign) in enumerate(((body_a, 1), (body_b, -1))):
        torque = cross(levers[side][first], space).reshape(count, -1)
        wrench = sign * np.concatenate([space, torque], axis=1)
        if cut and side == 1:
            np.testing.assert_allclose(other[first], wrench, **CLOSE)
        else:
            np.add.at(total, body[first], wrench)
    np.testing.assert_allclose(force, total, **CLOSE)
    if not cut:
        assert np.sum(force * v) == pytest.approx(np.sum(f[:count] * u.T[:count]), rel=1e-11)
    np.testing.assert_allclose(stored[first, :scalars], kept[first, :scalars], **CLOSE)
    back = stored[first, scalars:].reshape(count, vectors, wide)
    in_space = got[:count] if dim == 2 else np.einsum("nij,nvj->nvi", known[first][:, :, 1:], got[:count])
    np.testing.assert_allclose(back, in_space, **CLOSE)
    rest = np.setdiff1d(np.arange(n), first)
    assert np.array_equal(stored[rest], kept[rest]) and not lane_force[rest].any()


def test_spheres_go_the_general_way_faster():
    """The kernels that know spheres alone, against those of all shapes."""
    bodies, n, h, reach = 9, 10, 0.01, 0.05
    x, v, radius, inverse = some(bodies, 3), some(bodies, 6), positive(bodies), positive(bodies, 6)
    record = np.zeros((bodies, 12))
    kernel("cairn_sphere_records")(0, bodies, x, v, radius, inverse, record)
    body_a, body_b = np.triu_indices(bodies, 1)
    chosen = RNG.permutation(len(body_a))[:n]
    body_a, body_b = body_a[chosen].astype(np.int32), body_b[chosen].astype(np.int32)
    between = x[body_a] - x[body_b]
    far = np.linalg.norm(between, axis=1)
    gap = far - radius[body_a] - radius[body_b]
    normal, stored, active = between / far[:, None], some(n, 3), np.ones(n, np.int8)
    others = stored.copy()
    lane, count, filled = np.zeros(n + 8, np.int32), np.empty(1, np.int32), np.empty(1, np.int32)
    frame, arm = np.zeros((6, 128)), np.zeros((2, 128))
    u, gaps, geometry, state = np.empty(3 * 16), np.empty(16), np.empty(3 * 16), np.empty(2 * 16)
    kernel("cairn_sphere_gather")(
        n, body_a, body_b, record, reach, h, stored, active, lane, count, filled, frame, arm, u, gaps, geometry, state
    )
    acts = gap < reach
    assert 0 < count[0] == acts.sum() < n and np.array_equal(active, acts)
    assert not stored[~acts].any() and np.array_equal(stored[acts], others[acts])
    m, touch = int(filled[0]), (radius[body_a] + gap / 2)[:, None] * normal
    pick = lane[:m] - 1
    assert list(pick[: count[0]]) == list(np.flatnonzero(acts)) and np.all(pick[count[0] :] == pick[count[0] - 1])
    grain = [np.stack([1 / radius[k], inverse[k, 0]], axis=1) for k in (body_a, body_b)]
    sides = [columns(-touch), columns(between - touch)]
    known = np.empty((6, m)), np.empty((3, m)), np.empty(m), np.empty((3, m)), np.empty((2, m))
    kernel("cairn_smooth_gather3", "cairn_smooth_gather")(
        n, m, lane[:m].copy(), body_a, body_b, v, *[columns(g) for g in grain], gap, columns(normal), *sides, h, 0, 1, stored,
        *known, None,
    )  # fmt: skip
    found = frame[:, :m], u[: 3 * m].reshape(3, m), gaps[:m], geometry[: 3 * m].reshape(3, m), state[: 2 * m].reshape(2, m)
    for one, two in zip(found, known):
        np.testing.assert_allclose(one, two, rtol=1e-10, atol=1e-11)
    np.testing.assert_allclose(
        arm[:, :m].T, (np.stack([radius[body_a], radius[body_b]], axis=1) + gap[:, None] / 2)[pick], **CLOSE
    )
    f, tile = some(3, m), np.ascontiguousarray(found[4])
    for cut in (False, True):
        results = []
        for special in (True, False):
            kept, pushed, force, other = stored.copy(), np.zeros((n, 3)), np.zeros((bodies, 6)), np.zeros((n, 6))
            rest = tile, kept, pushed, force, other if cut else None
            if special:
                kernel("cairn_sphere_scatter")(n, count[0], m, lane, body_a, body_b, frame, arm, f, *rest)
            else:
                kernel("cairn_smooth_scatter3", "cairn_smooth_scatter")(
                    n, count[0], m, lane[:m].copy(), body_a, body_b, *sides, known[0], f, 0, 1, *rest
                )
            results.append((kept, pushed, force, other))
        for one, two in zip(*results):
            np.testing.assert_allclose(one, two, rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize("turns", [False, True])
def test_states_of_spheres_go_the_general_way_faster(turns):
    """Scalars, several vectors and moments, in rows longer than the state, against the kernels of all shapes."""
    bodies, n, h, scalars, vectors, states = 9, 10, 0.01, 5, 2, 12
    x, v, radius, inverse = some(bodies, 3), some(bodies, 6), positive(bodies), positive(bodies, 6)
    record = np.zeros((bodies, 12))
    kernel("cairn_sphere_records")(0, bodies, x, v, radius, inverse, record)
    body_a, body_b = np.triu_indices(bodies, 1)
    chosen = RNG.permutation(len(body_a))[:n]
    body_a, body_b = body_a[chosen].astype(np.int32), body_b[chosen].astype(np.int32)
    between = x[body_a] - x[body_b]
    far = np.linalg.norm(between, axis=1)
    gap = far - radius[body_a] - radius[body_b]
    reach = np.sort(gap)[6:8].mean()  # seven act
    stored, active, acts = some(n, states), np.ones(n, np.int8), gap < reach
    before = stored.copy()
    lane, count, filled = np.zeros(n + 8, np.int32), np.empty(1, np.int32), np.empty(1, np.int32)
    frame, arm = np.zeros((6, 128)), np.zeros((2, 128))
    u, gaps, geometry, state = np.empty(6 * 16), np.empty(16), np.empty(3 * 16), np.empty(9 * 16)
    kernel("cairn_sphere_gather_states")(
        n, body_a, body_b, record, reach, h, scalars, vectors, states, stored, active, lane, count, filled, frame, arm, u, gaps,
        geometry, state,
    )  # fmt: skip
    assert count[0] == acts.sum() == 7 and np.array_equal(active, acts) and not stored[~acts].any()
    m, own, normal = int(filled[0]), scalars + 3 * vectors, between / far[:, None]
    touch, lanes = (radius[body_a] + gap / 2)[:, None] * normal, lane[:m].copy()
    grain = [np.stack([1 / radius[k], inverse[k, 0]], axis=1) for k in (body_a, body_b)]
    sides, rows = [columns(-touch), columns(between - touch)], np.ascontiguousarray(before[:, :own])
    known = np.empty((6, m)), np.empty((3, m)), np.empty(m), np.empty((3, m)), np.empty((scalars + 2 * vectors, m))
    kernel("cairn_smooth_gather3", "cairn_smooth_gather")(
        n, m, lanes, body_a, body_b, v, *[columns(g) for g in grain], gap, columns(normal), *sides, h, scalars, vectors, rows,
        *known, None,
    )  # fmt: skip
    spin = np.empty((3, m))
    kernel("cairn_smooth_spins")(3, n, m, lanes, body_a, body_b, v, known[0], spin)
    found = frame[:, :m], u[: 3 * m].reshape(3, m), gaps[:m], geometry[: 3 * m].reshape(3, m), state[: 9 * m].reshape(9, m)
    for one, two in zip((*found, u[3 * m : 6 * m].reshape(3, m)), (*known, spin)):
        np.testing.assert_allclose(one, two, rtol=1e-10, atol=1e-11)
    f, moment, after = some(3, m), some(3, m) if turns else None, np.ascontiguousarray(found[4])
    for cut in (False, True):
        kept, pushed, turned, force, other = before.copy(), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((bodies, 6)), None
        short, pushes, turns_3, forces, others = rows.copy(), pushed.copy(), turned.copy(), force.copy(), None
        if cut:
            other, others = np.zeros((n, 6)), np.zeros((n, 6))
        kernel("cairn_sphere_scatter_states")(
            n, count[0], m, lane, body_a, body_b, frame, arm, f, scalars, vectors, states, after, kept, pushed, force, other,
            moment, turned if turns else None, None, None, None,
        )  # fmt: skip
        kernel("cairn_smooth_scatter3", "cairn_smooth_scatter")(
            n, count[0], m, lanes, body_a, body_b, *sides, known[0], f, scalars, vectors, after, short, pushes, forces, others
        )
        if turns:
            kernel("cairn_smooth_moments")(3, n, count[0], m, lanes, body_a, body_b, known[0], moment, turns_3, forces, others)
        pairs = [(kept[:, :own], short), (pushed, pushes), (turned, turns_3), (force, forces)]
        for one, two in pairs + ([(other, others)] if cut else []):
            np.testing.assert_allclose(one, two, rtol=1e-10, atol=1e-11)
        assert np.array_equal(kept[:, own:], before[:, own:])


@pytest.mark.parametrize("cut", [False, True])
def test_spheres_of_clumps_go_the_general_way_faster(cut):
    """Spheres beside the centres of their bodies, against the kernels of all shapes with the levers of the bodies."""
    bodies, contactors, n, h, states = 4, 10, 11, 0.01, 5
    body, x, v = np.arange(contactors, dtype=np.int32) % bodies, some(bodies, 3), some(bodies, 6)
    centre, radius, grain = x[body] + 0.5 * some(contactors, 3), positive(contactors), positive(contactors, 2)
    grain[:, 0] = 1 / radius
    record, offset = np.full((contactors, 12), np.nan), np.full((contactors, 4), np.nan)
    kernel("cairn_clump_records")(0, contactors, body, centre, radius, grain, x, v, record, offset)
    arm, zero = centre - x[body], np.zeros((contactors, 1))
    np.testing.assert_allclose(offset, np.c_[arm, zero], **CLOSE)
    own = v[body, :3] + np.cross(v[body, 3:], arm)
    np.testing.assert_allclose(record, np.c_[centre, radius, own, zero, v[body, 3:], grain[:, 1]], **CLOSE)
    a, b = np.triu_indices(contactors, 1)
    chosen = RNG.permutation(np.flatnonzero(body[a] != body[b]))[:n]
    a, b = a[chosen].astype(np.int32), b[chosen].astype(np.int32)
    between = centre[a] - centre[b]
    far = np.linalg.norm(between, axis=1)
    gap, normal = far - radius[a] - radius[b], between / far[:, None]
    reach = np.sort(gap)[8:10].mean()  # nine act
    stored, active, touch = some(n, states), np.ones(n, np.int8), (radius[a] + gap / 2)[:, None] * normal
    rows = np.ascontiguousarray(stored[:, :3])
    lane, count, filled = np.zeros(n + 8, np.int32), np.empty(1, np.int32), np.empty(1, np.int32)
    frame, arms = np.zeros((6, 128)), np.zeros((2, 128))
    u, gaps, geometry, state = np.empty(6 * 16), np.empty(16), np.empty(3 * 16), np.empty(2 * 16)
    kernel("cairn_sphere_gather_states")(
        n, a, b, record, reach, h, 0, 1, states, stored, active, lane, count, filled, frame, arms, u, gaps, geometry, state
    )
    m, lanes = int(filled[0]), lane[: filled[0]].copy()
    assert count[0] == 9 and m == 16
    sides = [columns(arm[a] - touch), columns(arm[b] + between - touch)]
    known = np.empty((6, m)), np.empty((3, m)), np.empty(m), np.empty((3, m)), np.empty((2, m))
    kernel("cairn_smooth_gather3", "cairn_smooth_gather")(
        n, m, lanes, body[a], body[b], v, grain[a].T.copy(), grain[b].T.copy(), gap, columns(normal), *sides, h, 0, 1, rows,
        *known, None,
    )  # fmt: skip
    found = frame[:, :m], u[: 3 * m].reshape(3, m), gaps[:m], geometry[: 3 * m].reshape(3, m), state[: 2 * m].reshape(2, m)
    for one, two in zip(found, known):
        np.testing.assert_allclose(one, two, rtol=1e-10, atol=1e-11)
    f, after = some(3, m), np.ascontiguousarray(found[4])
    pushed, force, other = np.zeros((n, 3)), np.zeros((bodies, 6)), np.zeros((n, 6)) if cut else None
    pushes, forces, others = pushed.copy(), force.copy(), np.zeros((n, 6)) if cut else None
    kernel("cairn_sphere_scatter_states")(
        n, count[0], m, lane, body[a], body[b], frame, arms, f, 0, 1, states, after, stored, pushed, force, other, None, None,
        a, b, offset,
    )  # fmt: skip
    kernel("cairn_smooth_scatter3", "cairn_smooth_scatter")(
        n, count[0], m, lanes, body[a], body[b], *sides, known[0], f, 0, 1, after, rows, pushes, forces, others
    )
    acts = np.sort(lanes[: count[0]]) - 1
    pairs = [(stored[acts, :3], rows[acts]), (pushed, pushes), (force, forces)]
    for one, two in pairs + ([(other, others)] if cut else []):
        np.testing.assert_allclose(one, two, rtol=1e-10, atol=1e-11)


def test_sums_of_lanes():
    m, count = 16, 11
    gap, geometry, energy = some(m), positive(3, m), positive(4, m)
    gap[count:], geometry[:, count:] = gap[count - 1], geometry[:, count - 1 : count]
    for given in (energy, None):
        deepest, contacts, energies = np.array([0.1]), np.array([4.0]), np.arange(1.0, 5.0)
        kernel("cairn_smooth_sums")(count, m, gap, geometry, given, deepest, contacts, energies)
        assert deepest[0] == max(0.1, (-gap / geometry[1]).max()) and contacts[0] == 4 + count
        extra = energy[:, :count].sum(axis=1) if given is not None else 0
        np.testing.assert_allclose(energies, np.arange(1, 5) + extra, **CLOSE)


# ---------------------------------------------------------------------- detection


@pytest.mark.parametrize("dim", [2, 3])
def test_boxes_that_meet(dim):
    n, contactors = 200, 30
    a, b = (RNG.integers(0, contactors, n).astype(np.int32) for _ in range(2))
    centre, half = 3 * some(contactors, dim), positive(contactors, dim)
    boxes = np.stack([-half, half * RNG.uniform(0.5, 1, half.shape)], axis=1)
    steps, vectors = RNG.integers(-1, 2, (n, dim)), np.zeros((3, 3))
    vectors[range(dim), range(dim)] = 2.5
    steps = np.pad(steps, ((0, 0), (0, 3 - dim)))
    image = np.sum((steps + 512) << (10 * np.arange(3)), axis=1).astype(np.int32)
    far = centre[a] - centre[b] - 2.5 * steps[:, :dim]
    meets = np.all((far + boxes[a, 0] <= boxes[b, 1]) & (far + boxes[a, 1] >= boxes[b, 0]), axis=1)
    expected, kept = [x[meets] for x in (a, b, image)], np.empty(1, np.int64)
    kernel("cairn_box_search")(dim, n, a, b, image, centre, boxes, vectors, kept)
    assert 0 < kept[0] == meets.sum() < n
    assert all(np.array_equal(x[: kept[0]], y) for x, y in zip((a, b, image), expected))


# ---------------------------------------------------------------------- cells of solids


def shapes(kind):
    """dim, values, gradients and weights of an element at its points."""
    name, _, dim, nodes, _, points, *_ = ELEMENTS[kind]
    dim, nodes, points = int(dim), int(nodes), int(points)
    xi, weight = np.zeros((points, dim)), np.zeros(points)
    kernel(f"cairn_element_{name}_bulk_rule", "cairn_element_rule")(xi, weight)
    value, gradient = np.zeros((points, nodes)), np.zeros((points, nodes, dim))
    for p in range(points):
        kernel(f"cairn_element_{name}_shape", "cairn_element_shape")(xi[p].copy(), value[p], gradient[p])
    return dim, value, gradient, weight


def strained(dim, plane, mean, element, x, u):
    """F - 1 and volumes at the points of a cell, dilatations as mean asks."""
    value, gradient, weight = element
    h, volume = np.zeros((len(value), 3, 3)), np.empty(len(value))
    for p, (n, g, w) in enumerate(zip(value, gradient, weight)):
        jacobian = x.T @ g
        volume[p] = w * np.linalg.det(jacobian)
        h[p, :dim, :dim] = u.T @ g @ np.linalg.inv(jacobian)
        if dim == 2 and plane == 2:
            volume[p] *= 2 * np.pi * (n @ x[:, 0])
            h[p, 2, 2] = n @ u[:, 0] / (n @ x[:, 0])
    small = mean in (1, 3)
    own = np.trace(h, axis1=1, axis2=2) if small else np.linalg.det(np.eye(3) + h)
    if mean in (1, 2):
        wanted = np.full_like(own, volume @ own / volume.sum())
    elif mean in (3, 4):  # least squares, weighted by volumes
        modes = np.concatenate([np.ones((len(own), 1)), value @ x], axis=1)
        root = np.sqrt(volume)[:, None]
        wanted = modes @ np.linalg.lstsq(root * modes, root[:, 0] * own, rcond=None)[0]
    else:
        return h, volume
    if small:
        return h + ((wanted - own) / 3)[:, None, None] * np.eye(3), volume
    return np.cbrt(wanted / own)[:, None, None] * (np.eye(3) + h) - np.eye(3), volume


CELLS = (
    [("quad8", plane, mean) for plane in (0, 2) for mean in range(5)]
    + [("hexahedron", 0, mean) for mean in (0, 1, 2)]
    + [("tetra10", 0, 4)]
)


@pytest.mark.parametrize("kind, plane, mean", CELLS)
def test_cells_of_solids(kind, plane, mean):
    """Gradients by numpy; forces are the derivative of the energy by displacements, the stiffness that of the forces."""
    dim, *element = shapes(kind)
    value, gradient, weight = element
    points, nodes = value.shape
    place, cells = box(kind, (1,) * dim, (1.0,) * dim)
    x = place[cells[kind][0]] * RNG.uniform(0.8, 1.2, dim) + 0.02 * RNG.random((nodes, dim)) + [0.7, *[0] * (dim - 1)]
    u, dofs = 0.05 * some(nodes, dim), dim * nodes
    status = np.zeros(points, np.int32)

    def gradients(u):
        d, hoop, h, h_bar = (np.zeros((points, *s)) for s in ((nodes, dim), (nodes,), (3, 3), (3, 3)))
        volume, share = np.zeros(points), np.zeros((points, points))
        kernel("cairn_solid_gradients")(
            dim, plane, mean, nodes, points, value, gradient, weight, 1.0, 1, x, u, d, hoop, h, h_bar, volume, share, status
        )
        return d, hoop, h, h_bar, volume, share

    def forces(u, want):
        d, hoop, h, h_bar, volume, share = gradients(u)
        law = [neo_hookean(f.T) for f in h_bar]
        piola, tangent = np.array([p.T for _, p, _ in law]), np.array([a.transpose(3, 2, 1, 0) for _, _, a in law])
        force, stiffness = np.zeros(dofs), np.zeros((dofs, dofs))
        kernel("cairn_solid_forces")(
            dim, plane, mean, nodes, points, 1, d, hoop, h, volume, share, piola, tangent, want, force, stiffness
        )
        return force, stiffness

    _, _, h, h_bar, volume, _ = gradients(u)
    known, volumes = strained(dim, plane, 0, element, x, u)
    np.testing.assert_allclose(h.transpose(0, 2, 1), known, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(volume, volumes, rtol=1e-11)
    known, _ = strained(dim, plane, mean, element, x, u)
    np.testing.assert_allclose(h_bar.transpose(0, 2, 1), known, rtol=1e-9, atol=1e-11)
    force, stiffness = forces(u, 1)
    assert not status.any() and np.array_equal(force, forces(u, 0)[0])

    def energy(u):
        h, v = strained(dim, plane, mean, element, x, u)
        return sum(w * neo_hookean(f)[0] for w, f in zip(v, h))

    eps, slope, columns_ = 1e-5, np.empty(dofs), np.empty((dofs, dofs))
    for k in range(dofs):
        moved = np.zeros(dofs)
        moved[k] = eps
        moved = moved.reshape(nodes, dim)
        slope[k] = (energy(u + moved) - energy(u - moved)) / (2 * eps)
        columns_[k] = (forces(u + moved, 0)[0] - forces(u - moved, 0)[0]) / (2 * eps)
    np.testing.assert_allclose(force, slope, rtol=1e-6, atol=1e-7 * np.abs(slope).max())
    np.testing.assert_allclose(stiffness, columns_, rtol=1e-6, atol=1e-7 * np.abs(columns_).max())
    x = x * np.where(np.arange(dim) == 0, -1, 1)  # inside out
    gradients(u)
    assert status.all()


def test_thickness_without_stress():
    """Newton's steps across a plate end where a search for the root does, and the tangent is then the slope in the plane."""
    n = 3
    plane = np.zeros((n, 3, 3))
    plane[:, :2, :2] = 0.2 * some(n, 2, 2)

    def across(f):
        h = f.copy()
        low, high = -0.9, 5.0
        for _ in range(200):
            h[2, 2] = (low + high) / 2
            low, high = (low, h[2, 2]) if neo_hookean(h)[1][2, 2] > 0 else (h[2, 2], high)
        return h

    h, left = np.ascontiguousarray(plane.transpose(0, 2, 1)), np.empty(1, np.int64)
    for _ in range(50):
        law = [neo_hookean(f.T) for f in h]
        piola, tangent = np.array([p.T for _, p, _ in law]), np.array([a.transpose(3, 2, 1, 0) for _, _, a in law])
        kernel("cairn_thickness_strain")(n, piola, tangent, h, left)
        if left[0] == 0:
            break
    assert left[0] == 0
    for k in range(n):
        known = across(plane[k])
        np.testing.assert_allclose(h[k].T, known, rtol=1e-11, atol=1e-12)
        a = tangent[k].transpose(3, 2, 1, 0)
        for i in range(2):
            for j in range(2):
                moved = np.zeros((3, 3))
                moved[i, j] = 1e-5
                slope = (neo_hookean(across(plane[k] + moved))[1] - neo_hookean(across(plane[k] - moved))[1]) / 2e-5
                np.testing.assert_allclose(a[:2, :2, i, j], slope[:2, :2], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("finite", [0, 1])
def test_true_stress(finite):
    """Forces on a face: sigma n da = P N dA, with n da = J F^-T N dA."""
    n = 4
    h, symmetric = 0.2 * some(n, 3, 3), some(n, 3, 3)
    f, symmetric = np.eye(3) + h, symmetric + symmetric.transpose(0, 2, 1)
    cofactor = np.linalg.det(f)[:, None, None] * np.linalg.inv(f).transpose(0, 2, 1)
    piola = symmetric @ cofactor if finite else symmetric
    out = np.empty((n, 6))
    kernel("cairn_true_stress")(finite, n, columns_first(h), columns_first(piola), out)
    for k, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))):
        np.testing.assert_allclose(out[:, k], symmetric[:, i, j], **CLOSE)


def columns_first(matrices):
    return np.ascontiguousarray(matrices.transpose(0, 2, 1))


# ---------------------------------------------------------------------- energy


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("plain", [True, False])
def test_energy_terms(dim, plain):
    """Kinetic energy, its change by the mean velocity, work of weight, forces and drives, and what theta takes away."""
    n, nd, h, theta = 6, 3 * dim - 3, 0.02, 0.6
    g, mass, begin, end = some(dim), positive(n), some(n, nd), some(n, nd)
    inertia = np.repeat(positive(n)[:, None], 2 * dim - 3, 1)
    mass[1] = inertia[1] = np.inf
    driven, reaction = np.zeros(n, np.int8), some(n, nd)
    driven[1], driven[3] = 1, 1 + 2 ** (nd - 1)
    force, damping = some(n, nd), positive(n)
    given, terms = reaction.copy(), np.empty(8)
    kernel("cairn_energy_terms")(
        dim, nd, n, h, theta, g, mass, inertia, begin, end, terms, None if plain else force, None if plain else damping, driven,
        reaction, None, None, None, None, None, None, None, None,
    )  # fmt: skip
    m = np.concatenate([np.repeat(mass[:, None], dim, 1), np.repeat(inertia[:, :1], nd - dim, 1)], axis=1)
    held = (driven[:, None].astype(int) >> np.arange(nd)) & 1 == 1
    free = np.isfinite(m)
    weight = np.where(free, m, 0) * np.concatenate([g, np.zeros(nd - dim)])
    push, drag = (np.zeros((n, nd)), np.zeros((n, 1))) if plain else (force, damping[:, None])
    m, mean, moved = np.where(free, m, 0), (begin + end) / 2, h * (theta * end + (1 - theta) * begin)
    push = np.where(free, push, 0)
    lost = drag * m * moved
    drive = np.where(held, np.where(free, m * (end - begin) - h * (weight + push) + lost - given, -given), 0)
    share = (theta - 0.5) * h * (weight + push) * (end - begin)
    scale = np.sum((h * (weight + push)[free]) ** 2 / m[free]) / 2
    expected = [np.sum(m * end**2) / 2, np.sum(m * (end**2 - begin**2)) / 2, -np.sum(weight * moved), np.sum(push * moved),
                np.sum(drive * mean), np.sum(lost * mean), np.sum(share), scale]  # fmt: skip
    np.testing.assert_allclose(terms, expected, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(reaction, drive, rtol=1e-11, atol=1e-12)
