"""Stresses and tangents of solids a second on one core: calls of SolidBody.tangent alone, without solver and contacts.

    script/bench tangents [--nodes 10000] [--calls 9]

A line a case: cells of a block, the least and the median CPU seconds of the calls, and cells a second by the least. The nodes are
moved by a stretch with a shear of a few percent, so that plastic cells yield.
"""

import argparse
import csv
import os
import sys
import time

os.environ["OMP_NUM_THREADS"] = "1"

import cairn as cn
import numpy as np
from meshes import grid
from newton_passes import LAWS

COLUMNS = ("kind", "law", "nodes", "cells", "calls", "least_s", "median_s", "million_cells_a_second")
MOVED = np.array([[0.03, 0.01, 0.0], [0.0, -0.01, 0.02], [0.01, 0.0, -0.01]])  # gradient of the displacement


def measure(kind, law, nodes, calls):
    """A row of COLUMNS."""
    n = int(round(nodes ** (1 / 3))) - 1
    points, cells = grid(kind, [n] * 3, [1.0] * 3, (0.0, 0.0, 0.0))
    material, options = LAWS[law]
    body = cn.SolidBody(points, cells, material, density=2000.0, **options)
    model, moved, spent = body.model(), points @ MOVED.T, []
    for _ in range(calls):
        begin = time.process_time()
        body.tangent(moved, model)
        spent.append(time.process_time() - begin)
    count = sum(map(len, cells.values()))
    return {
        "kind": kind, "law": law, "nodes": len(points), "cells": count, "calls": calls, "least_s": f"{min(spent):.3g}",
        "median_s": f"{np.median(spent):.3g}", "million_cells_a_second": f"{count / min(spent) / 1e6:.2g}",
    }  # fmt: skip


def main():
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nodes", type=int, default=10_000, help="of the block, about")
    parser.add_argument("--calls", type=int, default=9)
    options = parser.parse_args()
    writer = csv.DictWriter(sys.stdout, COLUMNS)
    writer.writeheader()
    for kind in ("HEX8", "TET4"):
        for law in LAWS:
            writer.writerow(measure(kind, law, options.nodes, options.calls))


if __name__ == "__main__":
    main()
