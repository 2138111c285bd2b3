"""Gaps of convex polyhedra against Coal, against answers known from how a pair was built, and against all pairs of features
in extended precision.

    python benchmarks/polyhedra_gaps.py [--random 100000] [--known 10000]

Writes benchmarks/results/polyhedra_gaps.csv, a row for each family of pairs: how many; missed (no contact, but the gap is within
the margin) and false (a contact, but it is not); the largest error of the gap over the size of the larger body, of Cairn and of
Coal; how many of Coal's are off by more than 1e-12 or no number; normals off by more than 1e-9 where the normal is known.
The random pairs are judged by Coal, those on which the two differ by more than 1e-13 and every 200th by the features.
"""

import argparse
import csv
import sys
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / "tests" / "python")]
from shape_pairs import (  # noqa: E402
    FAMILIES,
    coal_gap,
    detect,
    feature_gap,
    known_pairs,
    random_polyhedron,
    random_rotation,
)

BATCH = 1000


def size(pair):
    return max(np.ptp(v, axis=0).max() for v, _ in pair)


def batches(pairs, margin, spacing):
    """Least gap and its normal of each pair, None without a contact."""
    found = []
    for k in range(0, len(pairs), BATCH):
        for gap, normal, _ in detect(pairs[k : k + BATCH], margin, spacing):
            found.append((gap.min(), normal[np.argmin(gap)]) if len(gap) else None)
    return found


def random_family(count, rng):
    pool = [random_polyhedron(rng, corners) for corners in (4, 8, 20) for _ in range(300)]
    pairs, expected = [], []
    while len(pairs) < count:
        (v, f), (w, g) = (pool[k] for k in rng.integers(len(pool), size=2))
        way = rng.normal(size=3)
        w = w @ random_rotation(rng).T + way / np.linalg.norm(way) * rng.uniform(0.5, 2.0)
        pair = ((v @ random_rotation(rng).T, f), (w, g))
        gap = coal_gap(*pair)
        if gap < 0.9:  # else too far, or no answer
            pairs.append(pair)
            expected.append(gap)
    found = batches(pairs, 1.0, 8.0)
    row = {"family": "random", "pairs": count, "missed": sum(x is None for x in found), "false": 0, "wrong_normals": ""}
    ours, coals, judged = [], [], 0
    for k, (x, gap, pair) in enumerate(zip(found, expected, pairs)):
        if x is None:
            continue
        exact = gap
        if abs(x[0] - gap) > 1e-13 or k % 200 == 0:
            exact = feature_gap(*pair)
            judged += 1
        ours.append(abs(x[0] - exact) / size(pair))
        coals.append(abs(gap - exact) / size(pair))
    return row | compared(ours, coals) | {"by_features": judged}


def compared(ours, coals):
    coals = np.array(coals)
    known = coals[np.isfinite(coals)]
    return {"largest_error": max(ours), "largest_error_of_coal": known.max(), "coal_off": int(np.sum(known > 1e-12)),
            "coal_without_answer": len(coals) - len(known)}


def known_family(name, count, rng):
    pairs, gaps, normals, margin, spacing = known_pairs(name, count, rng)
    found = batches(pairs, margin, spacing)
    within = np.array(gaps) <= margin
    row = {"family": name, "pairs": count, "by_features": 0}
    row["missed"] = sum(x is None for x, near in zip(found, within) if near)
    row["false"] = sum(x is not None for x, near in zip(found, within) if not near)
    ours, coals, turned = [], [], 0
    for x, gap, normal, pair in zip(found, gaps, normals, pairs):
        coal = coal_gap(*pair)
        coals.append(abs(coal - gap) / size(pair) if abs(coal) < 1e300 else np.inf)
        if x is not None:
            ours.append(abs(x[0] - gap) / size(pair))
            turned += normal is not None and np.abs(x[1] - normal).max() > 1e-9
    return row | compared(ours, coals) | {"wrong_normals": turned}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--random", type=int, default=100_000)
    parser.add_argument("--known", type=int, default=10_000)
    parser.add_argument("--output", type=Path, default=HERE / "results" / "polyhedra_gaps.csv")
    options = parser.parse_args()
    rng = np.random.default_rng(1)
    rows = []
    start = time.process_time()
    share = -(-options.known // len(FAMILIES))
    for name in ("random", *FAMILIES):
        rows.append(random_family(options.random, rng) if name == "random" else known_family(name, share, rng))
        for key in ("largest_error", "largest_error_of_coal"):
            rows[-1][key] = f"{rows[-1][key]:.2g}"
        print(f"{time.process_time() - start:6.1f} s", rows[-1], flush=True)
    with open(options.output, "w", newline="") as file:
        fields = ["family", "pairs", "missed", "false", "wrong_normals", "largest_error"]
        fields += ["largest_error_of_coal", "coal_off", "coal_without_answer", "by_features"]
        writer = csv.DictWriter(file, fields)
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
