"""Cost of a network: conduction through random cubic packings of three sizes up to a million branches, by multigrid, and by
factors where these fit. CSV on standard output."""

import sys
import time

import cairn as cn
import numpy as np


def packing(n, decades, seed=1):
    """Branches (m, 2) of an n^3 lattice and conductances that differ by so many decades."""
    i = np.arange(n**3).reshape(n, n, n)
    pairs = np.concatenate([
        np.stack([np.take(i, range(n - 1), axis).ravel(), np.take(i, range(1, n), axis).ravel()], axis=1) for axis in range(3)
    ])  # fmt: skip
    rng = np.random.default_rng(seed)
    return pairs, 10.0 ** rng.uniform(0, decades, len(pairs)), i


def main(sizes=(20, 38, 70)):
    print("branches,unknowns,decades,method,seconds,microseconds_a_branch,iterations,residual,status")
    for n in sizes:
        for decades in (0, 2):
            pairs, c, i = packing(n, decades)
            held = {int(k): 1.0 for k in i[0].ravel()} | {int(k): 0.0 for k in i[-1].ravel()}
            for method in ("multigrid", "direct"):
                if method == "direct" and n > 40:
                    continue
                start = time.perf_counter()
                report = cn.networks.solve(pairs, c, potential=held, method=method).report
                spent = time.perf_counter() - start
                print(f"{len(pairs)},{n**3},{decades},{method},{spent:.3f},{1e6 * spent / len(pairs):.3f},"
                      f"{report['iterations']},{report['residual']:.1e},{report['status']}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main(tuple(map(int, sys.argv[1:])) or (20, 38, 70))
