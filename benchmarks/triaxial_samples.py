"""How the place of the peak of a triaxial test spreads among runs that differ by rounding, by pack, step and tolerance.

python benchmarks/triaxial_samples.py [--spheres 2000] [--strain 0.08] [--only TEXT]: the test of triaxial.py, its centres moved
at random by 1e-9 of a radius for each sample. Writes benchmarks/results/triaxial_samples.csv, a row for each run: setting, pack
and sample; the peak and the strain where it is; the strains between which the stress is within 3 % of the peak (first, last);
the mean stress between strains of .015 and .05, which chance moves less than a maximum; gain of volume at the end; cost.
"""

import argparse
import csv
from pathlib import Path

import cairn as cn
import numpy as np
from triaxial import DENSITY, DIAMETER, DT, INERTIAL, PRESSURE, packed, smoothed, tested

HERE = Path(__file__).resolve().parent
NEAR, FROM, TO = 0.97, 0.015, 0.05  # share of the peak; strains of the mean


def settings():
    """(name, strategy, share of the step, samples of the first pack, packs)."""
    yield "default", None, 1, 10, 4
    yield "default, half step", None, 2, 3, 1
    yield "default, quarter step", None, 4, 2, 1
    yield "default, theta 1", cn.NSCD(theta=1.0), 1, 3, 1
    yield "0.001 after 200 sweeps", cn.NSCD(solver=cn.NLGS(enough=1e-3, patience=200), overlap=5e-3), 1, 2, 1


def moved(pack, sample):
    """The pack with its centres moved by 1e-9 of a radius; sample 0: as it is."""
    centers, radii, width, sides = pack
    chance = np.random.default_rng(sample).standard_normal(centers.shape)
    return (centers + 1e-9 * radii[:, None] * chance if sample else centers), radii, width, sides


def run(pack, strategy, share, until):
    """Figures of a test to a strain, with steps of DT / share."""
    rate = INERTIAL / (DIAMETER * np.sqrt(DENSITY / PRESSURE))
    rows, cost, _ = tested(pack, strategy, round(until * share / (rate * DT)), DT / share)
    strain, stress = smoothed(rows, 15 * share - (share + 1) % 2)
    peak = int(np.argmax(stress))
    near = strain[stress > NEAR * stress[peak]]
    return {
        "peak_kPa": f"{stress[peak] / 1e3:.1f}",
        "peak_strain": f"{strain[peak]:.4f}",
        "within_3_percent_from": f"{near[0]:.4f}",
        "within_3_percent_to": f"{near[-1]:.4f}",
        "mean_kPa": f"{stress[(strain > FROM) & (strain < TO)].mean() / 1e3:.1f}",
        "volume": f"{rows[-1, 1]:+.4f}",
        "strain": f"{rows[-1, 0]:.3f}",
        **cost,
    }


def main():
    """Writes the table, row by row."""
    given = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    given.add_argument("--spheres", type=int, default=2000)
    given.add_argument("--strain", type=float, default=0.08)
    given.add_argument("--only", default="", help="settings whose name has this text")
    given.add_argument("--output", type=Path, default=HERE / "results" / "triaxial_samples.csv")
    given = given.parse_args()
    packs, writer = {}, None
    with given.output.open("w", newline="") as file:
        for name, strategy, share, samples, of in settings():
            if given.only not in name:
                continue
            for seed in range(1, of + 1):
                packs.setdefault(seed, None)
                packs[seed] = packs[seed] or packed(given.spheres, seed)
                for sample in range(samples if seed == 1 else 1):
                    found = run(moved(packs[seed], sample), strategy, share, given.strain)
                    row = {"setting": name, "pack": seed, "sample": sample, **found}
                    if writer is None:
                        writer = csv.DictWriter(file, list(row), lineterminator="\n")
                        writer.writeheader()
                    writer.writerow(row)
                    file.flush()
                    print(*row.values(), flush=True)


if __name__ == "__main__":
    main()
