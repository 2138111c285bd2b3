"""Cost and error by tolerance of the network, coupling and step, for the brake and for a small powder under current.

    python benchmarks/network_trade.py [brake | powder]     a row a setting, against the finest one
"""

from __future__ import annotations

import argparse
import csv
import importlib
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

TOP = Path(__file__).resolve().parents[1]
FIELDS = ("scene", "step", "tolerance", "coupling", "figure", "value", "error", "unseen", "passes", "cpu_s")


def example(name):
    sys.path.insert(0, str(TOP / "examples" / name))
    return importlib.import_module(name)


def braked(dt, tol, coupling):
    """Mean temperature of the pad's surface when the disc has half its spin, and how far its back was pushed; [K], [m]."""
    brake = example("disc_brake")
    options = brake.options_from(["--dt", str(dt), "--tol", str(tol), "--seconds", "0.0864"])
    start, passes = time.process_time(), 0
    sim, body = brake.build(options, **({} if coupling is None else {"coupling": coupling}))
    for _ in range(round(options.seconds / dt)):
        passes += sim.step()["thermal"]["passes"]
    spent = time.process_time() - start
    rim = body.groups["rim"]
    back = sim.meshes[0].displacement[body.groups["back"], 1].mean()
    figures = {"surface [K]": sim.nodes.temperature[sim.meshes[0].place][rim].mean() - brake.REFERENCE, "back [m]": back}
    return figures, sim.info["thermal"]["coupling"], passes / sim.steps, spent


def brake_rows():
    base = {"dt": 1.35e-3, "tol": 1e-12, "coupling": None}
    finest = braked(1.35e-3 / 16, 1e-12, 1e-10)
    settings = [base | {"dt": dt} for dt in (5.4e-3, 2.7e-3, 1.35e-3, 6.75e-4, 3.375e-4)]
    settings += [base | {"tol": tol} for tol in (1e-8, 1e-4)]
    settings += [base | {"coupling": c} for c in (1e-2, 1e-4, 1e-8)]
    settings += [base | {"dt": 2.7e-3, "coupling": 1e-8}, base | {"dt": 6.75e-4, "coupling": 1e-8}]
    for s in settings:
        figures, unseen, passes, spent = braked(**s)
        for name, value in figures.items():
            error, coupling = value / finest[0][name] - 1, s["coupling"] or "staggered"
            yield ("brake", s["dt"], s["tol"], coupling, name, value, error, unseen, passes, spent)


def powder_rows():
    powder = example("powder_under_current")
    with tempfile.TemporaryDirectory() as folder:
        checkpoint = Path(folder) / "pressed.h5"
        powder.compact(powder.options_from(["--spheres", "300"]), checkpoint)

        def swept(currents, tol):
            options = powder.options_from(["--spheres", "300", "--currents", str(currents), "--tol", str(tol)])
            start = time.process_time()
            rows, work, _ = powder.cycle(options, checkpoint, True)
            ohm = np.abs(rows[:, 1] / rows[:, 0])
            drop = rows[np.argmax(ohm[1:] < 0.1 * ohm[0]) + 1, 0]  # the current at which paths of clean contacts join the plates
            return {"ohm at the peak": ohm[currents - 1], "current of the drop [A]": drop}, work, time.process_time() - start

        finest, *_ = swept(200, 1e-12)
        for currents, tol in [(c, 1e-12) for c in (12, 25, 50, 100)] + [(50, t) for t in (1e-8, 1e-4, 1e-2)]:
            figures, work, spent = swept(currents, tol)
            for name, value in figures.items():
                yield ("powder", f"1/{currents} of the peak", tol, "none", name, value, value / finest[name] - 1, "",
                       work["rounds"] / (4 * currents - 2), spent)  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("scene", nargs="?", choices=("brake", "powder"))
    parser.add_argument("--output", type=Path, default=TOP / "benchmarks" / "results" / "network_trade.csv")
    options = parser.parse_args()
    made = []
    for name, rows in (("brake", brake_rows), ("powder", powder_rows)):
        if options.scene in (None, name):
            for row in rows():
                made.append([f"{v:.4g}" if isinstance(v, float) else v for v in row])
                print(*made[-1], sep="  ", flush=True)
    with open(options.output, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(FIELDS)
        writer.writerows(made)


if __name__ == "__main__":
    main()
