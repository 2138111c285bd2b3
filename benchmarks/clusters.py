"""Clusters of grains against the stalls of piles that move: domain decomposition, and clusters that move as rigid bodies.

    python benchmarks/clusters.py [--moments 75 100 130] [--size 250] [--rounds 8]

At each moment of disks2d_5000 at 1e-4 one step is swept 4,000 times, and its contact problem taken further. Domains: clusters of
--size contacts, with one or three layers of those around, are solved in sequence by mixed sweeps to 1e-9 with all other impulses
held (alternating Schwarz method), alone or with 200 extrapolated sweeps over all contacts between the rounds. Rigid clusters (two
levels): the grains of each square of the pile form a rigid body, the contacts between squares are solved for these bodies, and
400 extrapolated sweeps over all contacts follow. Sweeps: as many extrapolated ones alone. Errors are those of Coulomb's problem,
the least of the rounds. Writes benchmarks/results/clusters.csv.
"""

import argparse
import csv
import time
from pathlib import Path

import numpy as np
from cairn.problems import Problem
from cairn.run.contact_problem import problem_of
from scipy import sparse
from stalls import Step, moving_piles

HERE = Path(__file__).resolve().parent
SWEPT_BETWEEN, SWEPT_AFTER = 200, 400


class Pile:
    """The problem of the last step, which contacts are beside each other, and where the grains of each are."""

    def __init__(self, sim):
        self.step = Step(sim)
        self.problem, self.mu = self.step.problem, self.step.mu
        self.w = self.problem.W.tocsr()
        count = len(self.mu)
        beside = (np.ones(len(self.w.indices)), self.w.indices // 2, self.w.indptr)
        self.beside = sparse.csr_array(beside, shape=(2 * count, count))[::2].tocsr()
        told = problem_of(sim)
        self.bodies = told["rows"].bodies[told["chosen"]]
        points = np.array(sim.contacts.point)[told["chosen"]]
        self.place = np.zeros((self.bodies.max() + 1, 2))  # of each grain the mean of its contacts
        contacts = np.zeros(len(self.place))
        for side in self.bodies.T:
            np.add.at(self.place, side[side >= 0], points[side >= 0])
            np.add.at(contacts, side[side >= 0], 1)
        self.place /= np.maximum(contacts, 1)[:, None]
        inverse, columns = told["inverse"].diagonal(), np.diff(told["operator"].tocsc().indptr)
        self.dofs = np.flatnonzero((inverse > 0) & (columns > 0))

    def part(self, chosen):
        """W of these contacts, as blocks, and the columns of W that their impulses go through."""
        rows = (2 * chosen[:, None] + np.arange(2)).ravel()
        return self.w[rows][:, rows].tobsr(blocksize=(2, 2)), self.w[:, rows].tocsr()

    def domains(self, size, layers):
        """Clusters of at most `size` contacts that are beside each other, and of each these layers around it."""
        label = np.full(len(self.mu), -1)
        for start in range(len(label)):
            order = [start] if label[start] < 0 else []
            for c in order:
                label[c] = start
                near = self.beside.indices[self.beside.indptr[c] : self.beside.indptr[c + 1]]
                for other in near[label[near] < 0][: max(0, size - len(order))]:
                    label[other] = start
                    order.append(other)
        for start in np.unique(label):
            own = np.flatnonzero(label == start)
            for _ in range(layers):
                own = np.unique(self.beside[own].indices)
            yield own, *self.part(own)

    def solve_domains(self, r, domains):
        """A round over all clusters, each with the latest impulses of the others (multiplicative Schwarz)."""
        u = self.problem.velocity(r).copy()
        for own, w, columns in domains:
            free = u[own] - (w @ r[own].ravel()).reshape(-1, 2)
            new = Problem(2, w, free, self.mu[own]).solve("nlgs_anderson", 1e-9, max_iter=3000, start=r[own]).r
            u += (columns @ (new - r[own]).ravel()).reshape(-1, 2)
            r[own] = new

    def rigid_squares(self, across):
        """Contacts between square clusters of grains, and their Delassus matrix W with each cluster as one rigid body."""
        square = np.floor((self.place - self.place.min(0)) / np.ptp(self.place, axis=0).max() * across * (1 - 1e-9))
        square = np.unique(square @ [across + 1, 1], return_inverse=True)[1]
        grain, component = self.dofs // 3, self.dofs % 3
        middle = np.array([self.place[square == k].mean(0) for k in range(square.max() + 1)])
        lever = self.place[grain] - middle[square[grain]]
        turned = np.select([component == 0, component == 1], [-lever[:, 1], lever[:, 0]], 1.0)
        row = np.arange(len(grain))
        along = component < 2
        values = np.concatenate([turned, np.ones(along.sum())])
        columns = np.concatenate([3 * square[grain] + 2, (3 * square[grain] + component)[along]])
        moves = sparse.csr_array((values, (np.concatenate([row, row[along]]), columns)))
        one, two = self.bodies.T
        between = np.flatnonzero((one < 0) | (two < 0) | (square[np.maximum(one, 0)] != square[np.maximum(two, 0)]))
        rows = (2 * between[:, None] + np.arange(2)).ravel()
        h = (self.step.operator[rows] @ moves).toarray()
        mass = (moves.T @ sparse.diags_array(1 / self.step.inverse) @ moves).toarray()
        return between, sparse.csr_array(h @ np.linalg.solve(mass, h.T)).tobsr(blocksize=(2, 2))

    def sweep(self, r, sweeps):
        return np.array(self.problem.solve("nlgs_nesterov", 1e-9, max_iter=sweeps, start=r).r)


def rows_of(sim, size, rounds):
    """(method, clusters, contacts solved of these, the least error in so many rounds)."""
    pile = Pile(sim)
    error, begin = pile.problem.error, pile.step.r
    yield "begin", 0, len(pile.mu), error(begin)
    yield "sweeps", 0, len(pile.mu), error(pile.sweep(begin, rounds * SWEPT_AFTER))
    for layers in (1, 3):
        domains = list(pile.domains(size, layers))
        for sweeps in (0, SWEPT_BETWEEN):
            r, errors = begin.copy(), []
            for _ in range(rounds):
                pile.solve_domains(r, domains)
                r = pile.sweep(r, sweeps) if sweeps else r
                errors.append(error(r))
            name = f"domains, {layers} around" + (f", {sweeps} sweeps between" if sweeps else "")
            yield name, len(domains), sum(len(own) for own, *_ in domains), min(errors)
    for across in (6, 12):
        between, w = pile.rigid_squares(across)
        r, errors = begin.copy(), []
        for _ in range(rounds):
            free = pile.problem.velocity(r)[between] - (w @ r[between].ravel()).reshape(-1, 2)
            coarse = Problem(2, w, free, pile.mu[between])
            r[between] = coarse.solve("nlgs_anderson", 1e-8, max_iter=2000, max_seconds=20, start=r[between]).r
            r = pile.sweep(r, SWEPT_AFTER)
            errors.append(error(r))
        yield f"rigid squares, {SWEPT_AFTER} sweeps after", across**2, len(between), min(errors)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--moments", type=int, nargs="+", default=[75, 100, 130], help="steps at 1e-4 before")
    parser.add_argument("--size", type=int, default=250, help="contacts of a cluster")
    parser.add_argument("--rounds", type=int, default=8)
    options = parser.parse_args()
    with open(HERE / "results" / "clusters.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["steps_before", "method", "clusters", "contacts", "rounds", "error", "cpu_seconds"])
        for moment, sim in moving_piles(options.moments, 4000):
            sim.step()
            before = time.process_time()
            for method, clusters, contacts, error in rows_of(sim, options.size, options.rounds):
                row = [moment, method, clusters, contacts, options.rounds, f"{error:.3g}", f"{time.process_time() - before:.3g}"]
                writer.writerow(row)
                file.flush()
                print(*row, flush=True)
                before = time.process_time()


if __name__ == "__main__":
    main()
