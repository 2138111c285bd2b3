"""Gaps of capsules, cylinders and superquadrics with each other, with spheres, boxes and polyhedra: random pairs against Coal and
against bounds proved in extended precision, superquadrics of any exponents, and pairs built with known answers.

    python benchmarks/round_gaps.py [--random 100000] [--known 10000] [--general 2500]

Writes benchmarks/results/round_gaps.csv, a row for each kind of pair and family: how many; missed (no contact, but the gap is
within the margin) and false (a contact, but it is not); over the size of the larger body: the largest error of the gap where it
is known, else its distance from the bounds, separation along the normal and distance of the points. Judged by a search for the
largest separation instead are pairs whose points tell less than 1e-12, those on which Coal differs, every 50th, and all of
superquadrics of any exponents. Then the largest error of Coal, asked for 1e-9, and how many of its gaps are off by more than 1e-8
or no number; normals off by more than 1e-9 where they are known; of pairs that overlap, how many might be parted by a move
shorter by more than 1e-7, and by how much, by Coal and the search.
"""

import argparse
import csv
import sys
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / "tests" / "python")]
from round_pairs import FAMILIES, PAIRS, coal_gaps, judge, known_family, random_pairs  # noqa: E402

BATCH, MARGIN = 1000, 0.3
FIELDS = ["family", "pairs", "overlapping", "missed", "false", "wrong_normals", "largest_error", "shorter_way", "largest_excess",
          "largest_error_of_coal", "coal_off", "coal_without_answer", "judged"]  # fmt: skip


def merged(rows):
    """Merges batches: sums of counts, maxima of errors."""
    total = dict(rows[0])
    for row in rows[1:]:
        for key, value in row.items():
            if key != "family" and value != "":
                before = total.get(key, 0)
                total[key] = max(before, value) if key.startswith("largest") else before + value
    return total


def random_batch(name, pairs, by_coal):
    gap, normal, point = pairs.meet(MARGIN)
    found, size, count = np.isfinite(gap), pairs.size(), len(pairs)
    row = {"family": name, "pairs": count, "wrong_normals": "", "overlapping": int(np.sum(gap < 0))}
    coal, way = coal_gaps(pairs) if by_coal else (np.full(count, np.nan), np.zeros((count, 3)))
    known = np.abs(coal) < 1e300
    start = np.where(found[:, None], normal, np.where(known[:, None], way, [0, 0, 1]))
    # where the two differ, or Coal has no answer, a search of its own decides
    doubtful = ~known | ~(np.abs(np.where(found, gap, coal) - coal) < 1e-8) | (np.arange(count) % 50 == 0)
    truth = np.where(known, coal, -np.inf)
    apart, under = found & (gap > 0), found & (gap <= 0)
    low, high = (np.zeros(count) for _ in range(2))
    low[found], high[found] = pairs.part(found).bounds(gap[found], normal[found], point[found])
    doubtful |= apart & (high - gap > 1e-12)  # of sharp shapes, and near the rims of ends, the points are known less well
    truth[doubtful] = judge(pairs.part(doubtful), [x[doubtful] for x in ((start, way) if by_coal else (start,))])
    row["judged"] = int(doubtful.sum())
    row["missed"] = int(np.sum(~found & (truth < MARGIN - 1e-8)))
    row["false"] = int(np.sum(found & (truth > MARGIN + 1e-8)))
    bound = np.where(apart, np.where(doubtful, np.maximum(truth - gap, 0), high - gap), 0)
    row["largest_error"] = ((np.abs(low - gap) + bound) / size)[found].max()
    excess = (truth - gap)[under]
    row["shorter_way"] = int(np.sum(excess > 1e-7))
    row["largest_excess"] = np.max(np.maximum(excess, 0) / size[under], initial=0)
    if by_coal:
        off = np.abs(coal - np.where(apart, gap, truth))[known & found] / size[known & found]
        row["largest_error_of_coal"], row["coal_off"] = off.max(), int(np.sum(off > 1e-8))
        row["coal_without_answer"] = int(np.sum(~known))
    return row


def known_batch(name, count, rng):
    pairs, margin = known_family(name, count, rng)
    gap, normal, _ = pairs.meet(margin)
    found, within, size = np.isfinite(gap), pairs.gap <= margin, pairs.size()
    row = {"family": name, "pairs": count, "overlapping": int(np.sum(pairs.gap < 0)), "judged": 0}
    row |= {"missed": int(np.sum(within & ~found)), "false": int(np.sum(found & ~within))}
    row["wrong_normals"] = int(np.sum(np.abs(normal - pairs.normal)[found].max(axis=1) > 1e-9))
    row["largest_error"] = (np.abs(gap - pairs.gap) / size)[found].max()
    if all(np.all(s[:, 3:] == 1) for k, s in zip(pairs.kinds, pairs.sizes) if k == "superquadric"):
        coal, _ = coal_gaps(pairs)
        known = np.abs(coal) < 1e300
        off = (np.abs(coal - pairs.gap) / size)[known]
        row["largest_error_of_coal"], row["coal_off"] = off.max(), int(np.sum(off > 1e-8))
        row["coal_without_answer"] = int(np.sum(~known))
    return row


def random_family(name, rng, kinds, count, general=False):
    sizes = [min(BATCH, count - k) for k in range(0, count, BATCH)]
    return merged([random_batch(name, random_pairs(rng, kinds, n, general=general), not general) for n in sizes])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--random", type=int, default=100_000)
    parser.add_argument("--known", type=int, default=10_000)
    parser.add_argument("--general", type=int, default=2500)
    parser.add_argument("--output", type=Path, default=HERE / "results" / "round_gaps.csv")
    options = parser.parse_args()
    rng = np.random.default_rng(1)
    start = time.process_time()
    rows = []

    def add(row):
        rows.append({k: f"{v:.2g}" if k.startswith("largest") and v != "" else v for k, v in row.items()})
        print(f"{time.process_time() - start:6.1f} s", rows[-1], flush=True)

    for kinds in PAIRS:
        name = " and ".join(kinds)
        share = -(-options.random // len(PAIRS))
        add(random_family(name, rng, kinds, share))
    general = [kinds for kinds in PAIRS if "superquadric" in kinds]
    for kinds in general:
        name = " and ".join(kinds) + ", any exponents"
        share = -(-options.general // len(general))
        add(random_family(name, rng, kinds, share, general=True))
    for name in FAMILIES:
        share = -(-options.known // (12 * len(FAMILIES)))
        add(merged([known_batch(name, share, rng) for _ in range(12)]))
    with open(options.output, "w", newline="") as file:
        writer = csv.DictWriter(file, FIELDS)
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
