"""Frictional contact problems made from a seed, and what solutions must satisfy, written plainly."""

import numpy as np
from cairn.problems import Problem


def random_problem(dim=3, contacts=6, bodies=None, mu=0.5, seed=0, spread=1.0, unsymmetric=0.0):
    """W = H' M^-1 H of `bodies` of 3 or 6 dofs each (None: full rank); masses spread over the factor `spread`."""
    rng = np.random.default_rng(seed)
    size = dim * contacts
    dofs = 2 * size if bodies is None else (3 if dim == 2 else 6) * bodies
    H = rng.normal(size=(dofs, size))
    mass = spread ** rng.uniform(0, 1, dofs)
    W = H.T @ (H / mass[:, None])
    W += unsymmetric * np.abs(W).max() * rng.uniform(-1, 1, W.shape)
    # q = H v with a velocity for which the cone is open somewhere: a solution exists (Acary & Cadoux 2013)
    v = rng.normal(size=dofs)
    return Problem(dim, W, H.T @ v, mu)


def resting_box(contacts, dim=3, mass=1.0, mu=0.5, tilt=0.2, h=1e-3):
    """A box under gravity on `contacts` coplanar contacts at one face: W has rank 3 or 6 whatever their number."""
    rng = np.random.default_rng(contacts)
    if dim == 2:
        x = np.linspace(-0.5, 0.5, contacts)
        H = np.zeros((3, 2 * contacts))
        for a in range(contacts):
            H[:, 2 * a] = (0, 1, x[a])
            H[:, 2 * a + 1] = (-1, 0, -0.5)
        inverse = np.diag([1 / mass, 1 / mass, 6 / mass])
        q = H.T @ np.array([tilt * 9.81 * h, -9.81 * h, 0.0])
        return Problem(2, H.T @ inverse @ H, q, mu), H
    points = rng.uniform(-0.5, 0.5, (contacts, 2))
    points[:4] = [(-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5)][: min(4, contacts)]
    H = np.zeros((6, 3 * contacts))
    axes = np.array([(0, 0, 1), (1, 0, 0), (0, 1, 0)], dtype=float)
    for a, (x, y) in enumerate(points):
        lever = np.array([x, y, -0.5])
        for k, axis in enumerate(axes):
            H[:3, 3 * a + k] = axis
            H[3:, 3 * a + k] = np.cross(lever, axis)
    inverse = np.diag([1 / mass] * 3 + [6 / mass] * 3)
    q = H.T @ np.array([tilt * 9.81 * h, 0.0, -9.81 * h, 0, 0, 0])
    return Problem(3, H.T @ inverse @ H, q, mu), H


def plain_true_error(p, r):
    """DESIGN's formula, one contact after the other: the reference of the kernel."""
    W, r = p.W.toarray(), np.asarray(r).ravel()
    u = (W @ r + p.q.ravel()).reshape(-1, p.dim)
    r = r.reshape(-1, p.dim)

    def natural_map(a, r_a, u_a):
        rho, mu = 1 / W[p.dim * a, p.dim * a], p.mu[a]
        z = r_a - rho * u_a
        if mu > 1:
            n = max(0.0, z[0])
            t = np.linalg.norm(z[1:])
            return r_a - np.concatenate(([n], z[1:] * min(1.0, mu * n / t if t > 0 else 1.0)))
        z[0] -= rho * mu * np.linalg.norm(u_a[1:])
        t = np.linalg.norm(z[1:])
        if mu * t <= -z[0]:
            return r_a
        if t <= mu * z[0]:
            return r_a - z
        n = (z[0] + mu * t) / (1 + mu**2)
        return r_a - np.concatenate(([n], mu * n * z[1:] / t))

    residual = size = free = 0.0
    for a in range(p.contacts):
        w = W[p.dim * a, p.dim * a]
        residual += w * np.sum(natural_map(a, r[a], u[a]) ** 2)
        size += w * np.sum(r[a] ** 2)
        free += w * np.sum(natural_map(a, np.zeros(p.dim), p.q[a]) ** 2)
    scale = max(size, free)
    return np.sqrt(residual / scale) if scale > 0 else 0.0


def check_laws(p, r, tol):
    """Coulomb and Signorini by their words, relative to the sizes of the problem."""
    u = p.velocity(r)
    force = np.abs(r).max()
    speed = np.abs(p.q).max()
    tangent = np.linalg.norm(r[:, 1:], axis=1)
    slip = np.linalg.norm(u[:, 1:], axis=1)
    assert (r[:, 0] >= -tol * force).all(), "a contact pulls"
    assert (tangent <= p.mu * r[:, 0] + tol * force * np.maximum(p.mu, 1)).all(), "outside the cone"
    assert (u[:, 0] >= -tol * speed).all(), "a contact goes through"
    assert (np.abs(r[:, 0] * u[:, 0]) <= tol * force * speed).all(), "a contact pushes while it parts"
    # slip is against the impulse, and the impulse is then on the cone
    assert (np.abs(tangent * slip + np.sum(r[:, 1:] * u[:, 1:], axis=1)) <= tol * force * speed * np.maximum(p.mu, 1)).all()
    assert ((p.mu * r[:, 0] - tangent) * slip <= tol * force * speed * np.maximum(p.mu, 1)).all()
