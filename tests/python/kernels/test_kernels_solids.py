"""Cells of Hooke's law side by side against the matrices of elements; stresses by energy against the energy and plain sums."""

import numpy as np
import pytest
from kernels import kernel, rows
from second_order import box

RNG = np.random.default_rng(14)
ELEMENTS = {row[1]: row for row in rows("elements/elements.def", "CAIRN_ELEMENT")}
LANES = 8


@pytest.mark.parametrize("kind", list(ELEMENTS))
@pytest.mark.parametrize("count", [1, 5, 8])
def test_linear_cells(kind, count):
    """Forces and the half of the stiffness are those of B'DB; the stored energy is half of their work."""
    name, _, dim, nodes, _, points, *_ = ELEMENTS[kind]
    dim, nodes, points = int(dim), int(nodes), int(points)
    xi, weight = np.zeros((points, dim)), np.zeros(points)
    kernel(f"cairn_element_{name}_bulk_rule", "cairn_element_rule")(xi, weight)
    value, gradient = np.zeros((points, nodes)), np.zeros((points, nodes, dim))
    for p in range(points):
        kernel(f"cairn_element_{name}_shape", "cairn_element_shape")(xi[p].copy(), value[p], gradient[p])
    place, cells = box(kind, (1,) * dim, (1.0,) * dim)
    x = np.ascontiguousarray(place[cells[kind][:1]] * RNG.uniform(0.5, 2, (count, 1, 1)))
    x += 0.02 * RNG.random(x.shape)
    u = RNG.standard_normal(x.shape)
    young, poisson, thickness = 3.0, 0.3, 0.7 if dim == 2 else 1.0
    lame, shear = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
    size, dofs = 3 * dim - 3, dim * nodes
    d = np.zeros((size, size))
    d[:dim, :dim] = lame + 2 * shear * np.eye(dim)
    d[range(dim, size), range(dim, size)] = shear
    k, mass, wrong = np.zeros((count, dofs, dofs)), np.zeros((count, dofs, dofs)), np.zeros(count, np.int32)
    kernel("cairn_elastic_matrices")(dim, nodes, points, value, gradient, weight, count, x, 1.0, d * thickness, k, mass, wrong)
    force, half = np.zeros((count, dofs)), np.zeros((dofs * (dofs + 1) // 2, LANES))
    stress, energy, status = np.zeros((count, points, 6)), np.zeros(count), np.zeros(count, np.int32)
    kernel("cairn_linear_cells")(
        dim, nodes, points, gradient, weight, thickness, lame, shear, lame, count, x, u, 1, force, half, stress, energy, status
    )
    assert not wrong.any() and not status.any()
    scale = np.abs(k).max()
    column, row = np.triu_indices(dofs)
    np.testing.assert_allclose(half[:, :count].T, k[:, column, row], rtol=1e-11, atol=1e-12 * scale)
    moved = u.reshape(count, dofs)
    np.testing.assert_allclose(force, np.einsum("nij,nj->ni", k, moved), rtol=1e-10, atol=1e-11 * scale)
    np.testing.assert_allclose(energy, np.einsum("ni,ni->n", force, moved) / 2, rtol=1e-11)
    x[0] = x[0][:, ::-1] if dim == 2 else -x[0]  # inside out
    kernel("cairn_linear_cells")(
        dim, nodes, points, gradient, weight, thickness, lame, shear, lame, count, x, u, 0, force, half, stress, energy, status
    )
    assert status[0] == 1 and not status[1:].any()


def neo_hookean(h):
    """Energy, P and dP/dF at F - 1."""
    f = np.eye(3) + h
    back, j = np.linalg.inv(f), np.log(np.linalg.det(f))
    mu, lame = 2.0, 3.0
    w = mu / 2 * (np.trace(f.T @ f) - 3 - 2 * j) + lame / 2 * j * j
    p = mu * (f - back.T) + lame * j * back.T
    a = mu * np.einsum("ij,KL->iKjL", np.eye(3), np.eye(3))
    a += (mu - lame * j) * np.einsum("Kj,Li->iKjL", back, back) + lame * np.einsum("Ki,Lj->iKjL", back, back)
    return w, p, a


def test_stress_by_energy():
    """Its work is the change of energy; where the step is small it is the stress, and its derivative the law's."""
    for size in (0.3, 1e-3):
        n = 5
        begin = 0.2 * RNG.standard_normal((n, 3, 3))
        end = begin + size * RNG.standard_normal((n, 3, 3)) / 3
        columns = [np.ascontiguousarray(h.transpose(0, 2, 1)) for h in (begin, end)]  # as Fortran has them
        middle = np.zeros((n, 3, 3))
        kernel("cairn_middle_stretch")(n, *columns, middle)
        r = np.eye(3) + middle.transpose(0, 2, 1)
        assert np.abs(np.tril(r, -1)).max() == 0
        c = [np.einsum("nki,nkj->nij", np.eye(3) + h, np.eye(3) + h) for h in (begin, end)]
        np.testing.assert_allclose(np.einsum("nki,nkj->nij", r, r), (c[0] + c[1]) / 2, rtol=1e-13, atol=1e-14)
        w0, w1 = (np.array([neo_hookean(h)[0] for h in hs]) for hs in (begin, end))
        law = [neo_hookean(h) for h in r - np.eye(3)]
        piola = np.array([p.T for _, p, _ in law])
        tangent = np.array([a.transpose(3, 2, 1, 0) for _, _, a in law])
        kernel("cairn_stress_by_energy")(n, *columns, middle, w0, w1, 1, piola, tangent)
        p = piola.transpose(0, 2, 1)
        np.testing.assert_allclose(np.einsum("nij,nij->n", p, end - begin), w1 - w0, rtol=1e-11, atol=1e-15)
        mean = np.eye(3) + (begin + end) / 2
        turned = p @ mean.transpose(0, 2, 1)  # of a stress that gives no moment
        np.testing.assert_allclose(turned, turned.transpose(0, 2, 1), rtol=1e-11, atol=1e-13)
    at = [neo_hookean(h - np.eye(3)) for h in mean]
    np.testing.assert_allclose(p, [q for _, q, _ in at], rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(tangent.transpose(0, 4, 3, 2, 1), [a for _, _, a in at], rtol=1e-2, atol=1e-2)


def test_strains_of_steps():
    """A rotation gives no strain, and itself; a stretch l gives 2 (l - 1)/(l + 1), and no rotation (Hughes & Winget 1980)."""
    n = 6
    begin, end = 0.2 * RNG.standard_normal((2, n, 3, 3))
    q = np.linalg.qr(RNG.standard_normal((3, 3)))[0]
    q *= np.linalg.det(q)
    end[0], end[1], begin[1] = q @ (np.eye(3) + begin[0]) - np.eye(3), np.diag([0.5, -0.2, 0.1]), 0
    end[2] = np.diag([-3.0, 0, 0])  # inside out
    columns = [np.ascontiguousarray(h.transpose(0, 2, 1)) for h in (begin, end)]
    change, rotation, status = np.zeros((n, 6)), np.zeros((n, 3, 3)), np.zeros(n, np.int32)
    kernel("cairn_step_strain")(n, *columns, change, rotation, status)
    rotation = rotation.transpose(0, 2, 1)
    assert status.tolist() == [0, 0, 1, 0, 0, 0] and not change[2].any()
    np.testing.assert_allclose(change[0], 0, atol=1e-12)
    np.testing.assert_allclose(rotation[0], q, atol=1e-12)
    np.testing.assert_allclose(change[1], [2 * 0.5 / 2.5, -2 * 0.2 / 1.8, 2 * 0.1 / 2.1, 0, 0, 0], rtol=1e-13)
    for i in (1, 3, 4, 5):
        rate = 2 * (end[i] - begin[i]) @ np.linalg.inv(2 * np.eye(3) + begin[i] + end[i])
        d, w = (rate + rate.T) / 2, (rate - rate.T) / 2
        np.testing.assert_allclose(change[i], [*np.diag(d), 2 * d[0, 1], 2 * d[1, 2], 2 * d[0, 2]], rtol=1e-12, atol=1e-14)
        turned = np.linalg.solve(np.eye(3) - w / 2, np.eye(3) + w / 2)
        np.testing.assert_allclose(rotation[i], turned, rtol=1e-12, atol=1e-14)


def test_stresses_of_rates():
    """P and dP/dF from Cauchy's stress of a neo-Hookean body and the moduli of Jaumann's rate."""
    n, mu, lame = 5, 2.0, 3.0
    gradients = 0.2 * RNG.standard_normal((n, 3, 3))
    pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)]
    stress, moduli = np.zeros((n, 6)), np.zeros((n, 6, 6))
    for i, h in enumerate(gradients):
        f = np.eye(3) + h
        b, j = f @ f.T, np.linalg.det(f)
        sigma = (mu * (b - np.eye(3)) + lame * np.log(j) * np.eye(3)) / j
        stress[i] = [sigma[p] for p in pairs]
        for k, (a, c) in enumerate(pairs):
            d = np.zeros((3, 3))
            d[a, c] += 0.5
            d[c, a] += 0.5
            rate = (mu * (d @ b + b @ d) + lame * np.trace(d) * np.eye(3)) / j
            moduli[i, k] = [rate[p] for p in pairs]  # a column of Fortran's
    columns = np.ascontiguousarray(gradients.transpose(0, 2, 1))
    piola, tangent = np.zeros((n, 3, 3)), np.zeros((n, 3, 3, 3, 3))
    kernel("cairn_stress_of_rate")(n, columns, stress, moduli, 1, piola, tangent)
    law = [neo_hookean(h) for h in gradients]
    np.testing.assert_allclose(piola.transpose(0, 2, 1), [p for _, p, _ in law], rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(tangent.transpose(0, 4, 3, 2, 1), [a for _, _, a in law], rtol=1e-11, atol=1e-12)
