"""Why sweeps of a pile that moves stand still above 1e-6: steps of disks2d_5000 taken apart.

    python benchmarks/stalls.py [--moments 60 75 90 100 115 130] [--rounds 5]

At each moment of a run at 1e-4 one step is swept as far as 20,000 sweeps bring it, and its contact problem asked three things.
Slip held: with the term mu |u_T| of De Saxce fixed at that of the impulses at hand, Coulomb's law is a convex problem, which
interior points solve. Slip followed: that term is put to what the last such solution slips by, in whole, by 0.3, or by
Anderson's mixing, and the convex problem solved again, --rounds times; the error is the least of Coulomb's problem. A part: the
contacts nearest to the worst one, impulses of all others held, by plain, extrapolated and mixed sweeps, 20,000 at most. Writes
benchmarks/results/stalls.csv; the scene is read from the folder named by CAIRN_REFERENCE_DATA.
"""

import argparse
import csv
import time
from pathlib import Path

import cairn as cn
import numpy as np
import reference_scenes
from cairn.problems import Problem
from cairn.run.contact_problem import problem_of
from scipy import sparse
from scipy.sparse.linalg import splu

HERE = Path(__file__).resolve().parent
SWEEPS = {"plain": "nlgs", "extrapolated": "nlgs_nesterov", "mixed": "nlgs_anderson"}


class Step:
    """The contact problem of the step that a simulation made last, its impulses and the bodies they move."""

    def __init__(self, sim):
        told = problem_of(sim)
        rows, chosen = told["rows"], told["chosen"]
        self.problem = told["problem"]
        self.mu = self.problem.mu
        self.r = np.einsum("mij,mj->mi", rows.axes[chosen], np.array(sim.contacts.impulse)[chosen])
        inverse, operator = told["inverse"].diagonal(), told["operator"].tocsc()
        moved = np.flatnonzero((inverse > 0) & (np.diff(operator.indptr) > 0))
        self.inverse, self.operator = inverse[moved], operator[:, moved].tocsr()
        self.diagonal = self.problem.W.diagonal().reshape(-1, 2)

    def slip(self, r):
        """mu |u_T| of each contact [m/s]."""
        return self.mu * np.abs(self.problem.velocity(r)[:, 1])

    def error_of_held(self, r, slip):
        """The error of impulses as Problem.error measures it, of the convex problem with that slip."""
        w = self.diagonal[:, 0]
        z = r - (self.problem.velocity(r) + np.column_stack([slip, 0 * slip])) / w[:, None]
        normal = np.maximum(0, (z[:, 0] + self.mu * np.abs(z[:, 1])) / (1 + self.mu**2))
        outside = (np.abs(z[:, 1]) > self.mu * z[:, 0])[:, None]
        nearest = np.where(outside, np.column_stack([normal, np.sign(z[:, 1]) * self.mu * normal]), z)
        return float(np.sqrt(np.sum(w[:, None] * (r - nearest) ** 2) / np.sum(w[:, None] * r**2)))

    def solve_held(self, slip, tol=1e-10, most=60):
        """Impulses of the convex problem, and iterations: primal-dual interior points (Mehrotra 1992) over velocities of bodies;
        the two edges of each cone are its inequalities."""
        n = len(self.mu)
        i = np.arange(n)
        place = (np.concatenate([i, i, n + i, n + i]), np.concatenate([2 * i, 2 * i + 1, 2 * i, 2 * i + 1]))
        ones = np.ones(n)
        edges = sparse.csr_array((np.concatenate([ones, self.mu, ones, -self.mu]), place), shape=(2 * n, 2 * n))
        g = (edges @ self.operator).tocsr()
        across, mass = g.T.tocsr(), sparse.diags_array(1 / self.inverse)
        bias = edges @ self.problem.q.ravel() + np.tile(slip, 2)
        speed = np.abs(self.problem.q).max()
        impulse = speed / np.median(self.diagonal[:, 0])
        v, z = np.zeros(len(self.inverse)), np.full(2 * n, 0.1 * impulse)
        y = np.maximum(bias, 0.1 * speed)
        for iterations in range(most + 1):
            dual, primal = v / self.inverse - across @ z, y - (g @ v + bias)
            gap = y @ z / (2 * n)
            if iterations == most or (gap < tol * speed * impulse and np.abs(primal).max() < 1e-12 * speed):
                break
            d = z / y
            matrix = (mass + across @ sparse.diags_array(d) @ g).tocsc()
            factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
            to = (factors, g, across, d, y, z, primal, dual)
            dv, dy, dz = direction(*to, 0.0, 0.0)
            a = min(length(y, dy), length(z, dz))
            target = gap * ((y + a * dy) @ (z + a * dz) / (2 * n) / gap) ** 3
            dv, dy, dz = direction(*to, target, dy * dz)
            a = 0.995 * min(length(y, dy), length(z, dz))
            v, y, z = v + a * dv, y + a * dy, z + a * dz
        return np.column_stack([z[:n] + z[n:], self.mu * (z[:n] - z[n:])]), iterations

    def part(self, size):
        """The contacts nearest to the worst one by steps from body to body, and their problem with all other impulses held."""
        worst = self.problem.figures(self.r)["worst_contact"]
        w = self.problem.W.tocsr()  # contacts that share a body that moves are beside each other in a row
        order, seen = [worst], {worst}
        for c in order:
            for other in np.unique(w.indices[w.indptr[2 * c] : w.indptr[2 * c + 1]] // 2):
                if other not in seen and len(order) < size:
                    seen.add(other)
                    order.append(other)
        chosen = np.sort(order)
        outside = self.r.copy()
        outside[chosen] = 0
        rows = (2 * chosen[:, None] + np.arange(2)).ravel()
        w = w[rows][:, rows].tobsr(blocksize=(2, 2))
        return Problem(2, w, self.problem.velocity(outside)[chosen], self.mu[chosen]), self.r[chosen]


def direction(factors, g, across, d, y, z, primal, dual, target, correction):
    """Changes of velocities, of what the inequalities leave and of their multipliers towards y z = target."""
    t = (target - correction) / y - z
    dv = factors.solve(across @ (t + d * primal) - dual)
    dy = g @ dv - primal
    return dv, dy, t - d * dy


def length(x, dx):
    """The longest step, at most 1, that leaves x positive."""
    falls = dx < 0
    return min(1.0, float((-x[falls] / dx[falls]).min())) if falls.any() else 1.0


def follow(step, share, window, rounds):
    """The least error of Coulomb's problem in so many rounds, and of the slip the change of the first and of the last round."""
    slip, errors, changes, tried, moved = step.slip(step.r), [], [], [], []
    for _ in range(rounds):
        r, _ = step.solve_held(slip)
        change = step.slip(r) - slip
        errors.append(step.problem.error(r))
        changes.append(np.linalg.norm(change) / np.linalg.norm(slip))
        tried.append(slip)
        moved.append(change)
        slip = slip + share * change
        if window and len(tried) > 1:
            dx, df = np.diff(tried[-window:], axis=0), np.diff(moved[-window:], axis=0)
            mix = np.linalg.lstsq(df.T, change, rcond=1e-10)[0]
            slip = np.maximum(slip - (dx + share * df).T @ mix, 0)
    return min(errors), changes


def rows_of(sim, rounds):
    """Results of a step, a dict for each question and method."""
    info = sim.step()
    step = Step(sim)
    start = step.problem.error(step.r)
    yield {"question": "sweeps", "method": "extrapolated", "contacts": info["contacts"], "iterations": info["iterations"],
           "error": info["error"]}  # fmt: skip
    slip = step.slip(step.r)
    r, iterations = step.solve_held(slip, 1e-14)
    yield {"question": "slip held", "method": "interior points", "contacts": info["contacts"], "iterations": iterations,
           "error_before": step.error_of_held(step.r, slip), "error": step.error_of_held(r, slip)}  # fmt: skip
    for method, share, window in (("whole", 1.0, 0), ("0.3 of it", 0.3, 0), ("Anderson's mixing", 0.5, 10)):
        least, changes = follow(step, share, window, rounds)
        yield {"question": "slip followed", "method": method, "contacts": info["contacts"], "iterations": rounds,
               "error_before": start, "error": least, "first_change": changes[0], "last_change": changes[-1]}  # fmt: skip
    for size in (125, 250, 500, 1000):
        problem, r = step.part(size)
        for method, solver in SWEEPS.items():
            end = problem.solve(solver, 1e-10, max_iter=20000, max_seconds=20, start=r)
            yield {"question": "a part", "method": method, "contacts": size, "iterations": end.iterations,
                   "error_before": problem.error(r), "error": end.error}  # fmt: skip


def moving_piles(moments, sweeps):
    """(steps before, disks2d_5000 that made them at 1e-4) at each of these numbers of steps, ascending; further steps are swept
    at most `sweeps` times, to 1e-6, and then undone."""
    sim, _, _ = reference_scenes.build("disks2d_5000", 1e-4)
    coarse, done = sim.strategy, 0
    fine = cn.NSCD(theta=coarse.theta, solver=cn.NLGS(tol=1e-6, max_iter=sweeps), margin=coarse.margin, threads=1)
    for moment in moments:
        while done < moment:
            sim.step()
            done += 1
        state, sim.strategy = sim.get_state(), fine
        yield moment, sim
        sim.strategy = coarse
        sim.set_state(state)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--moments", type=int, nargs="+", default=[60, 75, 90, 100, 115, 130], help="steps at 1e-4 before")
    parser.add_argument("--rounds", type=int, default=5, help="of the slip that is followed")
    options = parser.parse_args()
    names = ["steps_before", "question", "method", "contacts", "iterations", "error_before", "error"]
    names += ["first_change", "last_change", "cpu_seconds"]
    with open(HERE / "results" / "stalls.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        for moment, sim in moving_piles(options.moments, 20000):
            before = time.process_time()
            for row in rows_of(sim, options.rounds):
                told = {k: f"{x:.3g}" if isinstance(x, float) else x for k, x in row.items()}
                row = {"steps_before": moment, **told, "cpu_seconds": f"{time.process_time() - before:.3g}"}
                writer.writerow(row)
                file.flush()
                print(*row.values(), flush=True)
                before = time.process_time()


if __name__ == "__main__":
    main()
