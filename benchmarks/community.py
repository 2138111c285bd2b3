"""The three cases on which the community compares its DEM codes, by smooth DEM and by NSCD on the same scene.

Silo, penetration and drum of Dosta et al., Comput. Phys. Commun. 296 (2024) 109066. Default: reduced forms, minutes of one core.
Full: the published numbers of bodies and steps, hours to days. Each begins with a packing of its own, made by NSCD.

    python benchmarks/community.py [silo|penetration|drum ...] [--size reduced|full|tiny] [--plot docs/images/community.png]

Writes benchmarks/results/community.csv, a row for each run, and community_curves.csv; of the full form community_full.csv and
community_full_curves.csv. Smooth DEM is Hertz-Mindlin with the restitution of each pair; a reduced form softens all moduli by a
factor, and takes a step longer by its root, as is usual; coarser grains lengthen it in proportion. NSCD has rigid grains,
Newton's restitution and Coulomb's friction at default settings, and a step of 200 to 650 of the published one.
`cpu_s_published`: CPU time of a step times the count of steps of the published length (in proportion longer for coarser grains).
"""

import argparse
import csv
import os
import time
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import cairn as cn  # noqa: E402
import numpy as np  # noqa: E402

RESULTS = Path(__file__).resolve().parent / "results"
GRAVITY = 9.81
M1, M2, STEEL = (cn.Material(*row) for row in (("M1", 2500.0), ("M2", 2000.0), ("steel", 7200.0)))
YOUNG = {M1: 1e9, M2: 0.5e9, STEEL: 210e9}
PAIRS = {(M1, M1): (0.5, 0.3), (M1, M2): (0.45, 0.2), (M1, STEEL): (0.4, 0.2), (M2, M2): (0.4, 0.4),
         (M2, STEEL): (0.4, 0.2), (STEEL, STEEL): (0.4, 0.2)}  # restitution, friction  # fmt: skip
COLUMNS = ("case", "size", "strategy", "grains", "step_s", "of_published", "steps", "converged", "overlap",
           "cpu_s", "ms_a_step", "cpu_s_published", "figure", "value")  # fmt: skip


@dataclass
class Size:
    """`scale`: container over the published one (of the penetration its width: a narrower bed is deeper).

    `coarse`: grains over the published ones; `softer`: divides the moduli of smooth DEM.
    """

    scale: float
    coarse: float
    softer: float
    until: float
    step: float


SIZES = {
    "full": {"silo": Size(1, 1, 1, 5.0, 5e-4), "penetration": Size(1, 1, 1, 0.1, 1e-4), "drum": Size(1, 1, 1, 5.0, 5e-4)},
    "reduced": {
        "silo": Size(0.2, 1, 100, 0.5, 5e-4),
        "penetration": Size(0.7, 3, 10, 0.06, 1e-4),
        "drum": Size(1, 3, 500, 1.2, 5e-4),
    },
    "tiny": {
        "silo": Size(0.12, 1, 1e4, 0.1, 1e-3),
        "penetration": Size(1, 8, 1e3, 0.004, 2e-4),
        "drum": Size(1, 6, 1e4, 0.05, 2e-3),
    },
}
PUBLISHED_STEP = {"silo": 1.5e-6, "penetration": 5e-7, "drum": 8e-7}


def pairs_of(materials):
    return {pair: row for pair, row in PAIRS.items() if set(pair) <= set(materials)}


def laws(scene, materials, smooth, softer=1.0):
    """Hertz-Mindlin or Newton and Coulomb, for all pairs of the materials."""
    there = pairs_of(materials)
    if smooth:
        words = {pair: {"restitution": e, "mu": mu} for pair, (e, mu) in there.items()}
        own = {m: cn.HertzMindlin(young=YOUNG[m] / softer, poisson=0.2, **words[m, m]) for m in materials}
        cn.interact_by_mixing(scene, own, pairs={pair: row for pair, row in words.items() if pair[0] is not pair[1]})
    else:
        for pair, (e, mu) in there.items():
            scene.interact(*pair, cn.Restitution(normal=e, mu=mu))


def lattice(count, pitch, inside, low, reach, rng):
    """Centres (count, 3) of a jittered cubic lattice, layer by layer from the height `low` [m] up, where `inside` says so."""
    half = int(np.ceil(reach / pitch))
    x, y = (a.ravel() + 0.5 for a in np.meshgrid(np.arange(-half, half), np.arange(-half, half), indexing="ij"))
    found, k, most = [], 0, 100 * int(np.ceil((count + 1) ** (1 / 3)))
    while sum(map(len, found)) < count:
        layer = np.c_[x, y, np.full(x.shape, k)] * pitch + (0, 0, low)
        found.append(layer[inside(layer)])
        k += 1
        if k > most:
            raise ValueError(f"{count} grains find no room in the container")
    centers = np.concatenate(found)[:count]
    return centers + rng.uniform(-0.02, 0.02, centers.shape) * pitch


def settled(scene, materials, until, dt=1e-3):
    """Positions after grains have fallen for so long [s], by NSCD."""
    for pair, (_, mu) in pairs_of(materials).items():
        scene.interact(*pair, cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, dt)
    sim.run(until=until, progress=False)
    return sim.bodies.position.copy()


class Silo:
    """Grains in a cylinder flow out of an orifice below a cone of 45 degrees, whose plug is gone at the start."""

    materials = (M1, STEEL)

    def __init__(self, size, rng):
        self.size, self.d = size, 0.004 * size.coarse
        self.radius, self.orifice = 0.1 * size.scale, 0.03 if size.scale == 1 else 0.02 * min(1.0, size.scale / 0.3)
        self.count = round(1e5 * size.scale**3 / size.coarse**3)
        high, edge = self.radius - self.orifice, self.radius - 0.55 * self.d
        inside = lambda x: np.hypot(x[:, 0], x[:, 1]) < edge
        self.start = lattice(self.count, 1.1 * self.d, inside, high + 0.6 * self.d, self.radius, rng)
        scene = self.scene()
        scene.add(cn.wall((0, 0, 0), (0, 0, 1), STEEL))
        fall = np.sqrt(2 * self.start[:, 2].max() / GRAVITY)
        self.start = settled(scene, self.materials, 2 * fall + 0.05)[: self.count]

    def scene(self):
        scene = cn.Scene(3, gravity=(0, 0, -GRAVITY))
        scene.add(cn.spheres(self.start, self.d / 2, M1))
        around = 2 * np.pi * np.arange(48) / 48
        ring = np.c_[np.cos(around), np.sin(around)]
        high, wide = self.radius - self.orifice, 1.02 * self.radius
        points = np.r_[np.c_[self.orifice * ring, np.zeros(48)], np.c_[wide * ring, np.full(48, high + 0.02 * self.radius)]]
        k = np.arange(48)
        faces = np.c_[k, (k + 1) % 48, (k + 1) % 48 + 48, k + 48]
        scene.add(cn.surface(points, faces[:, ::-1] if self.inward(points, faces) < 0 else faces, STEEL))
        top = self.start[:, 2].max() + self.d
        scene.add(cn.tube((0, 0, (high + top) / 2), (0, 0, 1), self.radius, STEEL, half_length=(top - high) / 2))
        return scene

    @staticmethod
    def inward(points, faces):
        """Positive where the first face's normal points to the axis."""
        a, b, c = points[faces[0, :3]]
        return -np.cross(b - a, c - a)[:2] @ a[:2]

    def figures(self, sim):
        """Share that is left in the silo; grains far below are taken out."""
        here = sim.bodies.position[sim.bodies.id < self.count]
        left = np.count_nonzero(here[:, 2] > 0)
        out = sim.bodies.id[(sim.bodies.id < self.count) & (sim.bodies.position[:, 2] < -10 * self.d)]
        if len(out):
            sim.remove(out)
        return left / self.count, 0.0

    def result(self, curve):
        """Discharge between 0.8 and 0.3 of the mass [kg/s]; Beverloo's law gives C rho_b sqrt(g) (D - k d)^2.5."""
        times, left = np.array(curve).T[:2]
        between = (left < 0.8) & (left > 0.3)
        mass = self.count * 2500.0 * np.pi / 6 * self.d**3
        rate = -np.polyfit(times[between], left[between], 1)[0] * mass if np.count_nonzero(between) > 1 else 0.0
        return "discharge [kg/s]", rate


class Penetration:
    """A ball of steel of 20 mm enters a bed of grains in a cylinder at 5 m/s."""

    materials = (M1, STEEL)

    def __init__(self, size, rng):
        self.size, self.d = size, 0.002 * size.coarse
        self.count, self.ball, self.radius = round(25000 / size.coarse**3), 0.01, 0.05 * size.scale
        inside = lambda x: np.hypot(x[:, 0], x[:, 1]) < self.radius - 0.55 * self.d
        self.start = lattice(self.count, 1.1 * self.d, inside, 0.6 * self.d, self.radius, rng)
        self.start = settled(self.scene(), self.materials, 0.25)[: self.count]
        near = np.hypot(self.start[:, 0], self.start[:, 1]) < self.ball + self.d
        self.surface = self.start[near, 2].max() + self.d / 2

    def scene(self, ball=None):
        scene = cn.Scene(3, gravity=(0, 0, -GRAVITY))
        scene.add(cn.spheres(self.start, self.d / 2, M1))
        if ball is not None:
            scene.add(cn.spheres([[0, 0, ball]], self.ball, STEEL, velocity=(0, 0, -5, 0, 0, 0)))
        scene.add(cn.wall((0, 0, 0), (0, 0, 1), STEEL))
        scene.add(cn.tube((0, 0, 0), (0, 0, 1), self.radius, STEEL))
        return scene

    def figures(self, sim):
        """Depth of the ball's lowest point below the surface [mm], and its velocity [m/s]."""
        z, v = sim.bodies.position[self.count, 2], sim.bodies.velocity[self.count, 2]
        return 1e3 * (self.surface - z + self.ball), v

    def result(self, curve):
        return "deepest [mm]", max(row[1] for row in curve)


class Drum:
    """Coarse M2 below and fine M1 above, in a drum that turns at 2 rad/s."""

    materials = (M1, M2, STEEL)

    def __init__(self, size, rng):
        self.size, fine, coarse = size, 0.002 * size.coarse, 0.004 * size.coarse
        self.counts = round(8000 / size.coarse**3), round(30000 / size.coarse**3)
        self.count = sum(self.counts)
        self.radii = np.repeat([coarse / 2, fine / 2], self.counts)
        parts, low = [], -0.1
        for number, d in zip(self.counts, (coarse, fine), strict=True):
            inside = lambda x, d=d: (np.hypot(x[:, 0], x[:, 2]) < 0.1 - 0.6 * d) & (np.abs(x[:, 1]) < 0.03 - 0.53 * d)
            parts.append(lattice(number, 1.1 * d, inside, low, 0.1, rng))
            low = parts[-1][:, 2].max() + 1.2 * d
        self.start = np.concatenate(parts)
        self.start = settled(self.scene(), self.materials, 0.3)[: self.count]

    def scene(self, spin=0.0):
        scene, split = cn.Scene(3, gravity=(0, 0, -GRAVITY)), self.counts[0]
        scene.add(cn.spheres(self.start[:split], self.radii[:split], M2), cn.spheres(self.start[split:], self.radii[split:], M1))
        turn = (0, 0, 0, 0, spin, 0)
        scene.add(cn.tube((0, 0, 0), (0, 1, 0), 0.1, STEEL, velocity=turn))
        for side in (-1, 1):
            scene.add(cn.wall((0, 0.03 * side, 0), (0, -side, 0), STEEL, velocity=turn))
        return scene

    def figures(self, sim):
        """Mixing by the variance of the share of M1 in cells of 20 mm (Lacey): 0 apart; height of the centre of mass [mm]."""
        x = sim.bodies.position[: self.count]
        volume = self.radii**3
        mass = volume * np.repeat([2000.0, 2500.0], self.counts)
        cell = np.unique(np.floor(x[:, [0, 2]] / 0.02).astype(int), axis=0, return_inverse=True)[1].ravel()
        fine = np.arange(len(x)) >= self.counts[0]
        all_of, fine_of = np.bincount(cell, weights=volume), np.bincount(cell, weights=volume * fine)
        share = fine_of.sum() / all_of.sum()
        spread = np.sum(all_of * (fine_of / all_of - share) ** 2) / all_of.sum()
        return 1 - spread / (share * (1 - share)), 1e3 * float(mass @ x[:, 2] / mass.sum())

    def result(self, curve):
        return "mixing at the end", curve[-1][1]


CASES = {"silo": Silo, "penetration": Penetration, "drum": Drum}


def run(case, name, size_name, smooth):
    """Curve (time, figure, figure) and row of a run."""
    size = case.size
    scene = {
        "silo": lambda: case.scene(),
        "penetration": lambda: case.scene(case.surface + case.ball),
        "drum": lambda: case.scene(2.0),
    }[name]()
    laws(scene, case.materials, smooth, size.softer)
    dt = PUBLISHED_STEP[name] * size.coarse * np.sqrt(size.softer) if smooth else size.step
    strategy = cn.SmoothDEM(energy=False, threads=1) if smooth else None
    sim = cn.Simulation(scene, dt, strategy, overlap="ignore")
    points = 60 if size_name != "tiny" else 6
    every = max(1, round(size.until / dt / points))
    curve, cpu, steps, converged, overlap = [(0.0, *case.figures(sim))], 0.0, 0, 0, 0.0
    while steps < round(size.until / dt):
        begin = time.process_time()
        if smooth:
            sim.run(steps=every, progress=False)
        else:
            for _ in range(every):
                info = sim.step()
                converged += info["status"] == "converged"
                overlap = max(overlap, info["penetration"])
        cpu += time.process_time() - begin
        steps += every
        curve.append((sim.time, *case.figures(sim)))
    figure, value = case.result(curve)
    published = size.until / PUBLISHED_STEP[name] / (size.coarse if smooth else 1)
    return curve, {
        "case": name,
        "size": size_name,
        "strategy": "smooth DEM" if smooth else "NSCD",
        "grains": case.count,
        "step_s": f"{dt:.3g}",
        "of_published": f"{dt / PUBLISHED_STEP[name]:.0f}",
        "steps": steps,
        "converged": "" if smooth else f"{converged / steps:.4f}",
        "overlap": "" if smooth else f"{overlap:.4f}",
        "cpu_s": f"{cpu:.2f}",
        "ms_a_step": f"{1e3 * cpu / steps:.3f}",
        "cpu_s_published": f"{cpu / steps * published:.0f}" if smooth else "",
        "figure": figure,
        "value": f"{value:.4g}",
    }


def compare(name, size_name, rng=1):
    """Both strategies from the same packing: two (curve, row)."""
    case = CASES[name](SIZES[size_name][name], np.random.default_rng(rng))
    return [run(case, name, size_name, smooth) for smooth in (True, False)]


def write(path, columns, rows):
    with open(path, "w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, columns, lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def read(path, keep):
    if not path.exists():
        return []
    with open(path, newline="", encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if keep(row)]


AXES = {
    "silo": (("time", "time [s]"), ("first", "share left in the silo [-]")),
    "penetration": (("first", "depth of the ball [mm]"), ("second", "its velocity [m/s]")),
    "drum": (("time", "time [s]"), ("first", "mixing [-]")),
}


def plot(curves, rows, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.rcParams["font.size"] = 11
    figure, axes = plt.subplots(1, 3, figsize=(12, 4.2), layout="constrained")
    for ax, (name, ((x, across), (y, up))) in zip(axes, AXES.items(), strict=True):
        for strategy, style in (("smooth DEM", "C1-"), ("NSCD", "C0--")):
            own = [r for r in curves if r["case"] == name and r["strategy"] == strategy]
            told = [r for r in rows if r["case"] == name and r["strategy"] == strategy]
            if not own:
                continue
            label = f"{strategy}, step {float(told[0]['step_s']):.2g} s: {float(told[0]['cpu_s']):.3g} s of CPU"
            ax.plot([float(r[x]) for r in own], [float(r[y]) for r in own], style, lw=1.8, label=label)
        ax.set(xlabel=across, ylabel=up)
        ax.set_title(f"{name}, {told[0]['grains']} grains" if told else name, fontsize=11)
        ax.legend(fontsize=9, loc="upper center", bbox_to_anchor=(0.5, -0.16), frameon=False)
        ax.grid(alpha=0.3)
    figure.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="CASE", help=", ".join(CASES))
    parser.add_argument("--size", choices=list(SIZES), default="reduced")
    parser.add_argument("--output", type=Path, default=RESULTS)
    parser.add_argument("--plot", type=Path)
    given = parser.parse_args()
    of = "community_full" if given.size == "full" else "community"
    table, lines = given.output / f"{of}.csv", given.output / f"{of}_curves.csv"
    names = ("case", "strategy", "time", "first", "second")
    for name in given.cases or CASES:
        pairs = compare(name, given.size)
        old = lambda row, name=name: row["case"] != name
        rows, curves = read(table, old), read(lines, old)
        for curve, row in pairs:
            print(*row.values(), sep=", ", flush=True)
            rows.append(row)
            for point in curve:
                values = (name, row["strategy"], *(f"{x:.6g}" for x in point))
                curves.append(dict(zip(names, values, strict=True)))
        write(table, COLUMNS, rows)
        write(lines, names, curves)
    if given.plot:
        plot(read(lines, lambda row: True), read(table, lambda row: True), given.plot)


if __name__ == "__main__":
    main()
