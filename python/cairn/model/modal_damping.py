"""Modal damping of a linear mesh, by a ratio zeta for each mode: C = M Phi diag(2 zeta omega) Phi' M (Wilson & Penzien 1972).
Modes are those of the free dofs, K phi = omega^2 M phi, scaled to phi' M phi = 1."""

from __future__ import annotations

import numpy as np

from ..base import checks

#: most free dofs for damping of all modes, or for their solution by full matrices
MOST_DOFS = 3000
#: omega^2 over the largest K_ii/M_ii below which a mode is a rigid motion, which is not damped
RIGID = 1e-11


def checked(ratios, body, name="modal_damping"):
    """Checked ratios: None, a number for all modes, or (n,) for the first n. Raises ValueError if the body is not linear or
    has a solver instead of matrices."""
    if ratios is None:
        return None
    if hasattr(body, "blocks") or hasattr(body, "model_of"):
        made = type(body).__name__
        raise ValueError(f"{name} is of the modes of a linear body, and this one is a {made}: give rayleigh, or an ElasticBody")
    if getattr(body, "solver", None) is not None:
        raise ValueError(f"{name} needs matrices, and this body has a solver of its own: let its damping hold the modes")
    values = checks.reals(name, ratios, "give a damping ratio >= 0 of all modes [-], or a list of those of the first")
    if values.ndim > 1 or not values.size or not np.all(np.isfinite(values)) or np.any(values < 0):
        raise ValueError(f"{name} is {ratios!r}: give a damping ratio >= 0 of all modes [-], or a list of those of the first")
    if values.ndim == 0:
        return checks.number(name, float(values))
    return values


def modes(body, free, ratios, name="mesh"):
    """Vibration modes (dofs, n) of unit modal mass, zero on held dofs, and their frequencies omega (n,) [rad/s], rising.

    All modes for a single ratio, else as many as there are ratios. Raises ValueError if all modes are wanted of a body with more
    than MOST_DOFS free dofs, and if there are fewer modes than ratios."""
    from scipy import linalg
    from scipy.sparse.linalg import eigsh

    free = np.asarray(free)
    m, k = (a[free][:, free] for a in (body.M, body.K))
    every, n = np.ndim(ratios) == 0, len(free)
    wanted = n if every else len(ratios)
    if every and n > MOST_DOFS:
        raise ValueError(
            f"modal_damping of {name!r} is of all modes of {n} dofs: give a list of ratios of the first modes, or a body of at "
            f"most {MOST_DOFS} dofs that are free"
        )
    scale = np.max(k.diagonal() / m.diagonal())
    dim = body.dim
    more = wanted + 3 * dim - 3  # rigid motions come first
    if n <= MOST_DOFS and (every or n <= 600 or more > n // 4):
        square, shape = linalg.eigh(k.toarray(), m.toarray())
    elif more >= n:
        raise ValueError(f"modal_damping of {name!r} is of {wanted} modes: it has fewer; give fewer ratios")
    else:
        start = np.cos(np.arange(n, dtype=float))  # a fixed start vector makes results reproducible
        square, shape = eigsh(k.tocsc(), more, m.tocsc(), sigma=-1e-6 * scale, v0=start)
        order = np.argsort(square)
        square, shape = square[order], shape[:, order]
    vibrates = square > RIGID * scale
    square, shape = square[vibrates], shape[:, vibrates]
    if not every:
        if len(square) < wanted:
            raise ValueError(f"modal_damping of {name!r} is of {wanted} modes, and {len(square)} vibrate: give fewer ratios")
        square, shape = square[:wanted], shape[:, :wanted]
    out = np.zeros((body.points.size, len(square)))
    out[free] = shape / np.sqrt(np.einsum("ij,ij->j", shape, m @ shape))
    return out, np.sqrt(square)


def damped_modes(body, free, ratios, name="mesh"):
    """Damped modes (dofs, n) and their rates 2 zeta omega (n,) [1/s]."""
    shape, omega = modes(body, free, ratios, name)
    rate = 2 * np.broadcast_to(ratios, omega.shape) * omega
    return shape[:, rate > 0], rate[rate > 0]
