"""Powder under current of 100 spheres, pressed and then led through by a rising current: what network tolerance and step leave.

    cairn study powder.py --network-tolerances 1e-12 1e-4 1e-2 --dt-factors 1 2 4
"""

import importlib
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "examples" / "powder_under_current"))
powder = importlib.import_module("powder_under_current")

DT, PREPARE, DURATION = 5e-5, 0.02, 2.5e-3
PEAK = 0.2 * 100 / 15000  # [A]


def build(seed=1):
    options = powder.options_from(["--spheres", "100", "--seed", str(seed)])
    return powder.build(options, lambda t: PEAK * float(np.clip((t - PREPARE) / DURATION, 0.0, 1.0)))[0]


def figure_decades(sim):
    """Decades of the bed's resistance."""
    power, current = sim.report["electrical"]["power"], abs(sim.report["electrical"]["current"])
    return float(np.log10(power / current**2)) if current > 0 else 2.0
