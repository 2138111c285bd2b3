"""Growth over many ranks without a cluster: counts of packings that are cut and coloured as in a run, and predicted times of a
step for two networks.

    python benchmarks/ranks_growth.py [--bodies 1e5 1e6 1e7] [--ranks 10 100 1000] [--every 100] [--again] [--plot]

A packing is a cube of jittered spheres on a lattice of 12 neighbours (fcc), of which those that are near touch, with about 3
contacts a body. Each is cut over numbers of ranks, and the largest of bodies, contacts, ghosts, neighbours, messages and bytes of
a sweep of a rank are counted, where that has 1,000 to 250,000 bodies. Rates of sweeps and of the rest of a step are measured here
first, in CPU seconds. A sweep then takes contacts / rate + colours x latency + messages x overhead + bytes / bandwidth;
extrapolated sweeps make a sum over all ranks each, 2 log2(ranks) latencies; every so many steps (--every) each rank receives the
state of all bodies, which a run leaves with its ranks else. Efficiency: the time of a rank alone with as many bodies, over that.
--again predicts from the counts of the file, and cuts nothing.
Writes benchmarks/results/ranks_growth.csv and docs/images/ranks_growth.png.
"""

import argparse
import csv
import math
import time
from pathlib import Path

import cairn as cn
import numpy as np
from cairn import _core
from scipy.spatial import cKDTree

HERE = Path(__file__).resolve().parent
# latency [s], overhead of a message [s], bandwidth [bytes/s]
NETWORKS = {"InfiniBand HDR": (2e-6, 0.5e-6, 10e9), "Ethernet 25G": (20e-6, 3e-6, 2.5e9)}
SWEEPS, CHECKS = 100, 20  # of a step
SUM_BYTES = 2 * 69 * 8  # of the two exact sums of a sweep
STATE_BYTES = 76  # of a sphere, which every rank receives where the state is read
RATES = (12.5e-9, 1.8e-6)  # of the page: seconds of a contact and sweep, of a body and step besides


def packing(n, seed=1):
    """Places (n, 3), radii (n,) and pairs that touch (2, m) of a cube of spheres."""
    rng, side = np.random.default_rng(seed), math.ceil((n / 4) ** (1 / 3))
    corner = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 1, 3)
    cell = np.array([(0, 0, 0), (0.5, 0.5, 0), (0.5, 0, 0.5), (0, 0.5, 0.5)])
    x = (corner + cell).reshape(-1, 3) * math.sqrt(2.0)
    x = x[:n] + rng.uniform(-0.05, 0.05, (n, 3))
    pairs = cKDTree(x).query_pairs(1.0, output_type="ndarray")
    return x, np.full(n, 0.5), np.ascontiguousarray(pairs, np.int64)


def rates(n=4000):
    """(seconds of a contact and sweep, seconds of a body and step besides), in CPU time over one rank."""
    x, radius, _ = packing(n)
    rock = cn.Material("rock", density=2600.0)
    scene = cn.Scene(dim=3, gravity=(0, 0, -9.81))
    scene.interact(rock, rock, cn.Coulomb(mu=0.5))
    scene.add(cn.spheres(x * 0.97, radius, rock), cn.wall((0, 0, -0.5), (0, 0, 1), rock))
    found = []
    for sweeps in (20, 220):
        solver = cn.NLGS(tol=1e-12, min_iter=sweeps, max_iter=sweeps)
        sim = cn.Simulation(scene, dt=1e-4, strategy=cn.NSCD(solver=solver, threads=1), overlap="ignore", ranks=1)
        sim.step()
        start = time.process_time()
        for _ in range(3):
            sim.step()
        found.append(((time.process_time() - start) / 3, sim.info["contacts"]))
    a_sweep = (found[1][0] - found[0][0]) / 200
    return a_sweep / found[0][1], max(found[0][0] - 20 * a_sweep, 0.0) / n


def predicted(row, network, a_contact, a_body, every):
    """Seconds of a step of the slowest rank; every: steps between two readings of the state of all bodies."""
    latency, overhead, bandwidth = NETWORKS[network]
    tree = 2 * math.ceil(math.log2(max(row["ranks"], 1)))
    sweep = row["contacts"] * a_contact
    if row["ranks"] > 1:
        sweep += row["colours"] * latency + row["messages"] * overhead + row["bytes"] / bandwidth
        sweep += tree * (latency + SUM_BYTES / bandwidth)
    rest = (row["bodies"] + row["ghosts"]) * a_body + CHECKS * tree * latency + row["ghost_bytes"] / bandwidth
    if row["ranks"] > 1:
        rest += STATE_BYTES * row["bodies_in_all"] / bandwidth / every
    return SWEEPS * sweep + rest


def counts(n, ranks, x, radius, pairs):
    """The largest counts of a rank."""
    start = time.process_time()
    found = _core.counts_over_ranks(x, radius, pairs, 0.15, ranks)
    cost = 3 * found["bodies"] + 2 * found["contacts"]
    row = {"bodies_in_all": n, "ranks": ranks, "colours": found["colours"]}
    row |= {name: int(found[name].max()) for name in ("bodies", "contacts", "ghosts", "neighbours", "messages", "bytes")}
    row["ghost_bytes"] = int(found["ghost_bytes"].max())
    row["imbalance"] = round(float(cost.max() / cost.mean()), 4)
    row["seconds_to_cut"] = round(time.process_time() - start, 2)
    return row


def plot(rows, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for n in sorted({r["bodies_in_all"] for r in rows}):
        some = [r for r in rows if r["bodies_in_all"] == n]
        for network, style in zip(NETWORKS, ("o-", "s--"), strict=True):
            left.loglog([r["ranks"] for r in some], [r[network] for r in some], style, label=f"{n:.0e} bodies, {network}")
            right.semilogx([r["bodies"] for r in some], [100 * r[f"efficiency {network}"] for r in some], style)
    left.set(xlabel="ranks", ylabel="predicted time of a step [s]")
    right.set(xlabel="bodies of a rank", ylabel="efficiency [%]", ylim=(0, 105))
    right.axvline(2e4, color="0.7")
    left.legend(fontsize=7)
    figure.savefig(path, dpi=130)


def told(rows, a_contact, a_body, every):
    """Predicts times and efficiencies of rows of counts, and writes them."""
    for row in rows:
        n, ranks, whole = row["bodies_in_all"], row["ranks"], row["contacts_in_all"]
        for network in NETWORKS:
            alone = {**row, "ranks": 1, "ghosts": 0, "ghost_bytes": 0, "bodies": n / ranks, "contacts": whole / ranks}
            row[network] = float(f"{predicted(row, network, a_contact, a_body, every):.4g}")
            row[f"efficiency {network}"] = round(predicted(alone, network, a_contact, a_body, every) / row[network], 3)
        print(row, flush=True)
    with (HERE / "results" / "ranks_growth.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


def weak(rows, every, share=2e4, ranks=1000):
    """Predicted efficiency of many ranks of `share` bodies each, by network, from the cut whose ranks have nearly as many."""
    row = min((r for r in rows if r["ranks"] > 10), key=lambda r: abs(r["bodies"] - share))
    mean = {"bodies": row["bodies_in_all"] / row["ranks"], "contacts": row["contacts_in_all"] / row["ranks"]}
    row = {**row, "ranks": ranks, "bodies_in_all": mean["bodies"] * ranks}
    found = {}
    for network in NETWORKS:
        alone = {**row, **mean, "ranks": 1, "ghosts": 0, "ghost_bytes": 0}
        found[network] = predicted(alone, network, *RATES, every) / predicted(row, network, *RATES, every)
    return found


def cut(options):
    """Rows of counts and predicted times of all packings over all numbers of ranks."""
    a_contact, a_body = rates()
    print(f"a contact and sweep {1e9 * a_contact:.1f} ns, a body and step besides {1e6 * a_body:.2f} us of CPU time")
    rows = []
    for n in map(int, options.bodies):
        x, radius, pairs = packing(n)
        print(f"{n} bodies, {len(pairs)} contacts")
        for ranks in (r for r in options.ranks if 1000 <= n / r <= 250_000):
            rows.append(counts(n, ranks, x, radius, pairs))
            rows[-1]["contacts_in_all"] = len(pairs)
        told(rows, a_contact, a_body, options.every)
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bodies", nargs="+", type=float, default=[1e5, 1e6, 1e7])
    parser.add_argument("--ranks", nargs="+", type=int, default=[5, 10, 50, 100, 500, 1000])
    parser.add_argument("--every", type=float, default=math.inf, help="steps between two readings of all bodies; none by default")
    parser.add_argument("--again", action="store_true", help="predict from the counts of the file")
    parser.add_argument("--plot", action="store_true", help="draw docs/images/ranks_growth.png")
    options = parser.parse_args()
    if options.again:
        with (HERE / "results" / "ranks_growth.csv").open(newline="") as file:
            rows = [{k: float(v) if "." in v or "e" in v else int(v) for k, v in row.items()} for row in csv.DictReader(file)]
        told(rows, *RATES, options.every)
    else:
        rows = cut(options)
    for every in (1, 10, 100, math.inf):
        of = ", ".join(f"{network} {share:.0%}" for network, share in weak(rows, every).items())
        print(f"1,000 ranks of 20,000 bodies, state read every {every} steps: {of}")
    if options.plot:
        plot(rows, HERE.parent / "docs" / "images" / "ranks_growth.png")


if __name__ == "__main__":
    main()
