"""One table, scene x extreme. References come from mechanics, gates from the tolerance of the solver and from rounding; where
rounding sets a gate, the reference says how much.

    python tests/extremes/table.py [--small] [--markdown] [--only WORD]

prints CSV: scene,extreme,expected,figure,reference,error,verdict. The exit status is 1 if any cell failed.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import blocks
import scenes as s
from refusals import REFUSALS, refused
from scenes import Extreme


@dataclass(frozen=True)
class Cell:
    """One row. check() returns Figures; the cell is right when each error is within its gate."""

    scene: str
    extreme: str
    expected: str
    reference: str
    check: Callable
    small: bool = True
    weakness: str = ""  # why the cell is known to fail, if it does

    @property
    def name(self):
        return f"{self.scene}: {self.extreme}"

    def outcome(self):
        """(figure of the worst, its reference, its error, verdict): a raised exception is a verdict too."""
        try:
            figures = self.check()
        except Exception as problem:
            return f"{type(problem).__name__}: {problem}"[:160], "", float("nan"), "FAIL"
        worst = max(
            figures, key=lambda f: f.error / f.gate if f.gate > 0 else (f.error > 0) * 1e300 if f.error == f.error else 1e301
        )
        right = all(f.error <= f.gate for f in figures)
        verdict = "ok" if right else f"FAIL: {self.weakness}" if self.weakness else "FAIL"
        return f"{worst.name} {worst.figure:.9g}", f"{worst.reference:.9g}", worst.error, verdict


INF = float("inf")
CLOSED = "within 10^-12 (a closed form, some 10^3 roundings)"
EXACT = 2.0**30  # m; here a double holds any size that is a power of two down to 2.4e-7 m

USUAL = {
    "none": {},
    "mu 0": dict(mu=0.0),
    "mu 1e3": dict(mu=1e3),
    "mu inf": dict(mu=INF),
    "step x 1e3": dict(step=1e3),
    "step x 1e-3": dict(step=1e-3),
    "size 1e-9 m": dict(size=1e-9),
    "size 1e6 m": dict(size=1e6),
}
PLACES = {
    "1e9 m off, scene.origin there": dict(shift=EXACT, origin=True),
    "1e9 m off, no origin": dict(shift=EXACT),
}
RATIOS = {"mass ratio 1e12": dict(ratio=1e12), "mass ratio 1e-12": dict(ratio=1e-12)}
DEEP = {"overlap of half a radius": dict(overlap=0.5)}

# scene, dimensions, expected, reference, extremes: the same answer is expected whatever the extreme, unless a row below says more
BOARD = [
    (s.ball_on_floor, (2, 3), "rests", "reaction = weight within 10 tol", USUAL | PLACES | DEEP),
    (
        s.block_on_slope,
        (2, 3),
        "slides or sticks",
        "a = g (sin a - mu cos a), at least 0, within 10^-9",
        USUAL | PLACES | DEEP | {"mu = tan a": dict(mu=1.0, tangent=1.0), "slope of 1e6": dict(tangent=1e6, mu=0.5, tol=1e-8)},
    ),
    (
        s.collision,
        (2, 3),
        "parts with half the speed",
        f"V + e (V - v) {CLOSED}",
        USUAL
        | PLACES
        | DEEP
        | RATIOS
        | {
            "sizes 1e-9 and 1e6 m": dict(size=1e6, other=1e-9, overlap=0.5),
            "sizes 1 and 1e-6 m": dict(size=1.0, other=1e-6, overlap=0.5),
        },
    ),
    (
        s.stack,
        (2, 3),
        "stands",
        "reaction = weight above within 10^4 tol (what is left of each of 5 contacts adds up)",
        USUAL
        | PLACES
        | DEEP
        | {"mass ratio 1e6": dict(ratio=1e6), "mass ratio 1e12": dict(ratio=1e12), "mass ratio 1e-12": dict(ratio=1e-12)},
    ),
    (
        s.pile,
        (2, 3),
        "obeys the laws",
        "momentum given by walls and gravity within 10^-11 (a rounding for each of some 10^3 terms), impulses in the cone, "
        "walls hold. At a step x 1e3 every pair is a candidate; there converged is an answer, and so is iteration_limit with a "
        "residual that it tells and that is under 100 tol",
        {
            name: dict(steps=40, tol=1e-6) | values
            for name, values in (
                USUAL
                | PLACES
                | RATIOS
                | {"step x 1e3": dict(step=1e3, steps=10, max_iter=8000, limit_told=True)}  # every pair is a candidate
                | {"sizes 1e-3 and 1 m": dict(size=1.0, other=1e-3), "sizes 1e-6 and 1 m": dict(size=1.0, other=1e-6)}
            ).items()
        },
    ),
    (s.sphere_in_tube, (3,), "rests", "reaction = weight within 10 tol", USUAL | PLACES | DEEP),
    (s.disk_on_segment, (2,), "rests", "reaction = weight within 10 tol", USUAL | PLACES | DEEP),
    (
        s.top,
        (3,),
        "turns freely",
        "angular momentum (10^-14) and the energy that it has at the rotation reached (10^-12) constant. The energy that a step "
        "tells takes the spin from the inverse inertia in space axes, whose entries are as large as 1/least moment: with moments "
        "10^12 apart it is uncertain by 10^12 roundings, 2.2 10^-4, and no more is asked of it",
        {k: v for k, v in (USUAL | PLACES).items() if "mu" not in k}
        | {"inertia ratio 1e-12": dict(ratio=1e-12), "near-equal inertias": dict(ratio=1 + 1e-14)},
    ),
    (
        s.pushing_wall,
        (2, 3),
        "takes the speed of the wall",
        f"impulse = m V {CLOSED}, speed = V within 10^-11 (ten of them)",
        USUAL | PLACES | DEEP,
    ),
    (
        s.drum,
        (3,),
        "carried along, unless mu = 0",
        "slip 0 within 100 tol, reaction = weight within 10 tol",
        {k: v for k, v in (USUAL | PLACES).items()},
    ),
    (
        s.lid,
        (2, 3),
        "carries its load",
        "sum of reactions = load + weight within 10^4 tol (9 contacts that a light or heavy lid couples)",
        USUAL | PLACES | RATIOS,
    ),
    (
        s.periodic_cell,
        (2, 3),
        "parts with half the speed",
        f"V + e (V - v) through the boundary, {CLOSED}",
        USUAL | PLACES | DEEP | RATIOS,
    ),
    (
        s.bonded_pair,
        (2, 3),
        "stays in one piece and turns",
        "spin from the angular momentum; no slip; speed along the bond that takes back what "
        "turning by a chord lengthened it, u = -(d - d0)/h; all within 100 tol; momentum constant within 10^-12. With no origin, "
        "the four roundings of places between two steps, 4.8 10^-7 m, are 100 times as much, in radii, of the speed",
        USUAL | PLACES | DEEP | RATIOS | {"sizes 1e-3 and 1e3 m": dict(size=1e3, other=1e-3, step=1e-3)},
    ),
    (
        s.coincident,
        (2, 3),
        "rest in a heap",
        "sum on the floor = weight of all within 100 tol, normals of length 1 within 4 roundings",
        {"2 duplicates": dict(count=2), "5 duplicates": dict(count=5), "5 duplicates, mu inf": dict(count=5, mu=INF)},
    ),
    (
        s.guided_drag,
        (2, 3),
        "dragged",
        "reaction = weight within 100 tol, friction = mu m g against the drive within 10^3 tol",
        {k: v for k, v in (USUAL | PLACES).items() if k != "mu inf"},
    ),
    (
        s.blocked,
        (2, 3),
        "sinks: no freedom along the normal",
        "no impulse at all",
        {"none": {}, "mu inf": dict(mu=INF), "step x 1e3": dict(step=1e3)},
    ),
    (
        s.crushed,
        (2, 3),
        "status iteration_limit: no motion obeys two walls that close",
        "two opposed driven walls",
        {"none": dict(max_iter=300), "mu inf": dict(mu=INF, max_iter=300), "step x 1e3": dict(step=1e3, max_iter=300)},
    ),
    (
        s.no_contact,
        (2, 3),
        "falls freely",
        f"v = g t {CLOSED}, no contact",
        {
            "0 bodies": dict(count=0),
            "1 body": dict(count=1),
            "2 bodies": dict(count=2),
            "24 bodies, no contact": dict(count=24),
            "1 body of 1e-9 m": dict(count=1, size=1e-9),
            "1 body of 1e6 m": dict(count=1, size=1e6),
            "2 bodies, step x 1e3": dict(count=2, step=1e3),
        },
    ),
]

LARGE = [
    (s.pile, 2, "20,000 bodies", dict(count=20000, steps=20, tol=1e-4)),
    (s.pile, 3, "8,000 bodies", dict(count=8000, steps=20, tol=1e-4)),
    (s.pile, 2, "2,500 bodies, sizes 1e-3 and 1 m", dict(count=2500, steps=40, tol=1e-4, size=1.0, other=1e-3)),
    (s.no_contact, 2, "1,000,000 bodies, no contact", dict(count=1000000, steps=2)),
    (s.no_contact, 3, "300,000 bodies, no contact", dict(count=300000, steps=2)),
    (s.coincident, 2, "100 duplicates", dict(count=100, steps=2)),
]


def at_extreme(scene, dim, values):
    """The call of a scene: values that are no field of Extreme are arguments of the scene."""
    known = {name: value for name, value in values.items() if name in Extreme.__dataclass_fields__}
    return partial(scene, dim, Extreme(**known), **{name: value for name, value in values.items() if name not in known})


def cells():
    """All cells, in the order of the table."""
    rows = []
    for scene, dims, expected, reference, extremes in BOARD + blocks.BOARD:
        title = scene.__name__.replace("_", " ")
        for dim in dims:
            for name, values in extremes.items():
                rows.append(Cell(f"{title} {dim}D", name, expected, reference, at_extreme(scene, dim, values)))
    for name, call, pattern in REFUSALS:
        rows.append(Cell("input", name, "ValueError with field, value and remedy", pattern, partial(refused, call, pattern)))
    for scene, dim, name, values in LARGE + blocks.LARGE:
        _, _, expected, reference, _ = next(row for row in BOARD + blocks.BOARD if row[0] is scene)
        title = f"{scene.__name__.replace('_', ' ')} {dim}D"
        rows.append(Cell(title, name, expected, reference, at_extreme(scene, dim, values), small=False))
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--small", action="store_true", help="without the large cells")
    parser.add_argument("--markdown", action="store_true", help="a page instead of CSV")
    parser.add_argument("--only", default="", help="cells whose name holds this word")
    parser.add_argument("--seconds", action="store_true", help="what each cell cost, on standard error")
    options = parser.parse_args()
    chosen = [c for c in cells() if (c.small or not options.small) and options.only in c.name]
    rows, failed = [], 0
    out = csv.writer(sys.stdout, lineterminator="\n")
    if not options.markdown:
        out.writerow(["scene", "extreme", "expected", "figure", "reference", "error", "verdict"])
    for cell in chosen:
        start = time.perf_counter()
        figure, reference, error, verdict = cell.outcome()
        failed += verdict != "ok"
        rows.append((cell, figure, error, verdict))
        if options.seconds:
            print(f"{time.perf_counter() - start:8.3f} s  {cell.name}", file=sys.stderr)
        if not options.markdown:
            out.writerow([cell.scene, cell.extreme, cell.expected, figure, reference or cell.reference, f"{error:.3g}", verdict])
            sys.stdout.flush()
    if options.markdown:
        from page import page

        print(page(rows))
    print(f"{len(rows) - failed} of {len(rows)} cells right", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
