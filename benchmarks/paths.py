"""Steps of disks2d_5000 in motion, solved by following a path of exact answers instead of by iterations.

    python benchmarks/paths.py [--moments 60 75 90 100 115 130] [--compliance 1e-3 1e-4] [--sweeps 4000] [--seconds 120]

Contacts get a compliance of so many times their own W_NN about the impulses that sweeps ended with. In the plane Coulomb's law
then is a continuous function of velocities, linear in each of four pieces (apart, stuck, slipping either way), and the sweeps'
impulses are the exact answer of a problem whose relative velocities are shifted a little. The shift is removed along a path of
exact answers (Katzenelson 1965; Chien and Kuh 1976 for maps whose pieces differ in orientation): at each pivot a contact changes
its piece, and the path reverses with the sign of the determinant. At its end the impulses answer the compliant problem to
rounding, and Coulomb's to compliance times the change of impulses. Writes benchmarks/results/paths.csv; the scene is read from
the folder named by CAIRN_REFERENCE_DATA.
"""

import argparse
import csv
import time
from pathlib import Path

import cairn as cn
import numpy as np
import reference_scenes
from scipy import sparse
from scipy.sparse.linalg import splu
from stalls import Step

HERE = Path(__file__).resolve().parent
APART, STUCK, FORTH, BACK = range(4)
BLOCK = 24  # pivots between two factorisations


class Compliant:
    """The problem of a step with compliant contacts about impulses c; v are changes of velocities of bodies by impulses."""

    def __init__(self, step, compliance):
        self.problem, self.mu, self.count = step.problem, step.mu, len(step.mu)
        self.operator, self.mass = step.operator.tocsr(), 1 / step.inverse
        self.across = self.operator.T.tocsr()
        self.e = compliance * step.diagonal[:, 0]
        self.offset = step.problem.q.reshape(-1, 2) - self.e[:, None] * step.r
        self.start(step)

    def start(self, step):
        """The pieces of the sweeps' impulses and the shift of relative velocities that makes them exact."""
        r = step.r
        self.v = step.inverse * (self.across @ r.ravel())
        u = step.problem.velocity(r)
        pressed, edge = r[:, 0] > 0, self.mu * r[:, 0] * (1 - 1e-9)
        self.piece = np.where(pressed, STUCK, APART)
        self.piece[pressed & (r[:, 1] <= -edge) & (u[:, 1] > 0)] = FORTH
        self.piece[pressed & (r[:, 1] >= edge) & (u[:, 1] < 0)] = BACK
        stuck = self.piece == STUCK
        self.shift = np.zeros_like(u)
        self.shift[:, 0] = np.where(pressed, -u[:, 0], np.maximum(0, -u[:, 0]))
        self.shift[stuck, 1] = -u[stuck, 1]

    def relative(self, t):
        return self.offset + (self.operator @ self.v).reshape(-1, 2) + t * self.shift

    def impulses(self, u):
        """Impulses of the pieces at hand, (n, 2)."""
        r = np.zeros_like(u)
        slips = (self.piece == FORTH).astype(float) - (self.piece == BACK)
        pressed = self.piece != APART
        r[pressed, 0] = -u[pressed, 0] / self.e[pressed]
        r[:, 1] = np.where(self.piece == STUCK, -u[:, 1] / self.e, -slips * self.mu * r[:, 0])
        return r

    def stiffness(self, contacts=slice(None)):
        """-dr/du of contacts, (n, 2, 2)."""
        piece, e = self.piece[contacts], self.e[contacts]
        d = np.zeros((len(piece), 2, 2))
        d[:, 0, 0] = (piece != APART) / e
        d[:, 1, 1] = (piece == STUCK) / e
        d[:, 1, 0] = ((piece == BACK).astype(float) - (piece == FORTH)) * self.mu[contacts] / e
        return d

    def factors(self):
        rows = np.arange(self.count + 1)
        d = sparse.bsr_array((self.stiffness(), rows[:-1], rows), shape=(2 * self.count,) * 2).tocsr()
        matrix = (sparse.diags_array(self.mass) + self.across @ (d @ self.operator)).tocsc()
        return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=1e-3)

    def load(self):
        return self.across @ np.einsum("nij,nj->ni", self.stiffness(), self.shift).ravel()

    def unbalanced(self, t):
        return self.mass * self.v - self.across @ self.impulses(self.relative(t)).ravel()

    def borders(self, u, du):
        """For both borders of each contact's piece: distance (positive inside), its rate along the path, and the piece beyond."""
        inside, rate = np.full((2, self.count), np.inf), np.zeros((2, self.count))
        beyond = np.zeros((2, self.count), int)
        for piece, borders in {
            APART: [(1, 0, np.where(u[:, 1] > 0, FORTH, BACK))],
            STUCK: [(-self.mu, -1, FORTH), (-self.mu, 1, BACK)],
            FORTH: [(-1, 0, APART), (self.mu, 1, STUCK)],
            BACK: [(-1, 0, APART), (self.mu, -1, STUCK)],
        }.items():
            at = self.piece == piece
            for k, (normal, tangent, to) in enumerate(borders):
                for out, w in ((inside, u), (rate, du)):
                    out[k, at] = (normal * w[:, 0] + tangent * w[:, 1])[at]
                beyond[k, at] = np.broadcast_to(to, self.count)[at]
        return inside, rate, beyond


def sign_of(factors):
    """Sign of the determinant."""
    sign = np.prod(np.sign(factors.U.diagonal()))
    for order in (factors.perm_r, factors.perm_c):
        cycles = sparse.csgraph.connected_components(sparse.coo_array((np.ones(len(order)), (np.arange(len(order)), order))))[0]
        sign *= (-1) ** ((len(order) - cycles) % 2)
    return sign


def follow(at, seconds):
    """Follows the path to its end: pivots, turns, and the remaining share of the shift (0: solved)."""
    t, turns, came, begun = 1.0, 0, None, time.process_time()
    for pivots in range(10**6):
        if pivots % BLOCK == 0:
            factors = at.factors()
            at.v -= factors.solve(at.unbalanced(t))
            first = factors.solve(at.load())
            sides, columns, steps = np.zeros((0, len(at.mass))), np.zeros((0, len(at.mass))), np.zeros(0)
            if pivots == 0:
                sign = sign_of(factors)
        small = np.eye(len(steps)) + sides @ columns.T
        way = sign * (first + columns.T @ np.linalg.solve(small, steps - sides @ first))
        u, du = at.relative(t), (at.operator @ way).reshape(-1, 2) - sign * at.shift
        inside, rate, beyond = at.borders(u, du)
        ahead = np.full(inside.shape, np.inf)
        np.divide(np.maximum(inside, 0), -rate, out=ahead, where=rate < 0)
        if came is not None:
            ahead[came] = np.inf
        border, contact = np.unravel_index(ahead.argmin(), ahead.shape)
        length = ahead[border, contact]
        if sign > 0 and length >= t:
            at.v += t * way
            return pivots, turns, 0.0
        if not np.isfinite(length) or time.process_time() - begun > seconds:
            return pivots, turns, t
        at.v += length * way
        t -= sign * length
        old = at.stiffness([contact])[0]
        before, at.piece[contact] = at.piece[contact], beyond[border, contact]
        change = at.stiffness([contact])[0] - old  # of rank one, since impulses are continuous across a border
        u_side, values, v_side = np.linalg.svd(change)
        rows = at.operator[[2 * contact, 2 * contact + 1]].toarray()
        column = factors.solve(rows.T @ (u_side[:, 0] * values[0]))
        side = v_side[0] @ rows
        full = column - columns.T @ np.linalg.solve(small, sides @ column)
        if 1 + side @ full < 0:
            sign, turns = -sign, turns + 1
        sides, columns = np.vstack([sides, side]), np.vstack([columns, column])
        steps = np.append(steps, v_side[0] @ at.shift[contact])
        came = (came_back(before, at.piece[contact]), contact)
    raise AssertionError("a path ends or takes its time")


def came_back(before, piece):
    """Which border of its new piece a contact stands on."""
    if piece == STUCK:
        return 0 if before == FORTH else 1
    return 1 if before == STUCK else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--moments", type=int, nargs="+", default=[60, 75, 90, 100, 115, 130], help="steps at 1e-4 before")
    parser.add_argument("--compliance", type=float, nargs="+", default=[1e-3, 1e-4], help="over W_NN")
    parser.add_argument("--sweeps", type=int, default=4000, help="before")
    parser.add_argument("--seconds", type=float, default=120.0, help="of CPU time that a path may take")
    options = parser.parse_args()
    names = ["steps_before", "contacts", "sweeps", "error_of_sweeps", "compliance", "solved", "pivots", "turns"]
    names += ["error_of_compliant", "error", "change", "cpu_seconds"]
    sim, _, _ = reference_scenes.build("disks2d_5000", 1e-4)
    coarse = sim.strategy
    fine = cn.NSCD(theta=coarse.theta, solver=cn.NLGS(tol=1e-7, max_iter=options.sweeps), margin=coarse.margin, threads=1)
    with open(HERE / "results" / "paths.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        for moment in options.moments:
            while sim.steps < moment:
                sim.step()
            state = sim.get_state()
            sim.strategy = fine
            info = sim.step()
            step = Step(sim)
            for compliance in options.compliance:
                at, before = Compliant(step, compliance), time.process_time()
                pivots, turns, left = follow(at, options.seconds)
                r = at.impulses(at.relative(left))
                size = np.linalg.norm(at.across @ r.ravel() / np.sqrt(at.mass))
                row = dict(zip(names, (moment, at.count, info["iterations"], info["error"], compliance, left == 0, pivots, turns,
                                       np.linalg.norm(at.unbalanced(left) / np.sqrt(at.mass)) / size, step.problem.error(r),
                                       np.linalg.norm(r - step.r) / np.linalg.norm(step.r),
                                       time.process_time() - before), strict=True))  # fmt: skip
                writer.writerow({k: f"{x:.3g}" if isinstance(x, float) else x for k, x in row.items()})
                file.flush()
                print(*row.values(), flush=True)
            sim.strategy = coarse
            sim.set_state(state)


if __name__ == "__main__":
    main()
