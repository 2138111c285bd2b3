"""A brake: a pad presses on a turning disc until it stands; friction heats both, heat conducts, pad and disc expand.

The pad is a deformable body that follows the rim, held by its back along the rim and pressed by forces; the disc is rigid, of
uniform temperature, and expands with it. Frictional work becomes heat, shared between both sides by effusivity. Averaged over the
width of the pad its temperature obeys the equation of heat along the depth alone, for any distribution of pressure along the rim:
while heat has not reached the back, and the disc slows down evenly in a time T, the mean of the surface is that of a half space
under a flux q (1 - t/T), (2 q/k) sqrt(a t/pi) (1 - 2 t/(3 T)) (Carslaw & Jaeger 1959).

Run it:  python disc_brake.py              until the disc stands, in a minute
         python disc_brake.py --full       a mesh of half the size, half the step
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import cairn as cn
import numpy as np

NAME = "disc_brake"
RADIUS, WIDE, HIGH = 0.15, 0.04, 0.01  # of the disc, along the rim and away from it [m]
PRESSURE, SPIN = 1e6, 10.0 / RADIUS  # [Pa], [rad/s]
REFERENCE = 293.15
DENSE = {"pad": 2000.0, "disc": 7850.0}  # [kg/m3]
CONDUCTS = {"pad": 2.0, "disc": 50.0}  # [W/(m K)]
HOLDS = {"pad": 1000.0, "disc": 460.0}  # [J/(kg K)]
PAD = cn.Material(
    "pad", density=DENSE["pad"], conductivity=CONDUCTS["pad"], capacity=HOLDS["pad"], young=1e9, poisson=0.25, expansion=1e-5
)
DISC = cn.Material(
    "disc",
    density=DENSE["disc"],
    conductivity=CONDUCTS["disc"],
    capacity=HOLDS["disc"],
    young=210e9,
    poisson=0.3,
    expansion=1.2e-5,
)
FRICTION = 0.4


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--along", type=int, default=16, help="cells along the rim (16)")
    parser.add_argument("--first", type=float, default=5e-5, help="height of the first layer of cells [m] (5e-5)")
    parser.add_argument("--dt", type=float, default=5e-4, help="[s] (5e-4)")
    parser.add_argument("--tol", type=float, default=1e-12, help="of the network of heat (1e-12)")
    parser.add_argument("--seconds", type=float, default=0.2)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.full:
        options.along, options.first, options.dt = 2 * options.along, options.first / 2, options.dt / 2
    return options


def mesh(options):
    """Points and quads of the pad on the rim, x along it, y away from it; groups of nodes."""
    heights = [0.0]
    layer = options.first
    while heights[-1] < HIGH:
        heights.append(heights[-1] + layer)
        layer *= 1.25
    depths = np.array(heights) * HIGH / heights[-1]
    along = np.linspace(-WIDE / 2, WIDE / 2, options.along + 1)
    x, y = np.meshgrid(along, depths, indexing="ij")
    angle = x / RADIUS  # lengths along the rim are those of the rim
    points = np.stack([(RADIUS + y) * np.sin(angle), (RADIUS + y) * np.cos(angle)], -1).reshape(-1, 2)
    k = np.arange(len(points)).reshape(x.shape)
    cells = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)
    return points, cells, {"rim": k[:, 0], "back": k[:, -1], "all": k.ravel()}


def build(options, **heat):
    """The simulation; heat: further settings of Scene.thermal."""
    points, cells, groups = mesh(options)
    body = cn.ElasticBody(points, {"quad": cells}, young=PAD.young, poisson=PAD.poisson, density=PAD.density, groups=groups,
                          rayleigh=(0.0, 2e-5))  # fmt: skip
    scene = cn.Scene(dim=2)
    press = {"back": (0.0, -PRESSURE * WIDE)}
    scene.add(cn.deformable(body, PAD, contact="rim", fixed={"back": "x"}, force=press, name="pad"))
    disc = cn.disks([[0.0, 0.0]], RADIUS, DISC, group="disc", velocity=(0.0, 0.0, SPIN))
    scene.add(disc.with_(driven=("vx", "vy")))
    scene.interact("*", "*", cn.Coulomb(mu=FRICTION))
    scene.thermal(conductance=cn.networks.Constant(conductance=0.0), initial=REFERENCE, reference=REFERENCE, tol=options.tol,
                  friction="effusivity", **heat)  # fmt: skip
    strategy = cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-8, max_iter=5000))
    return cn.Simulation(scene, options.dt, strategy), body


def halfspace(t, flux, stop):
    """Rise of the surface of a half space under a flux that falls to nothing at `stop` [K]."""
    diffusivity = CONDUCTS["pad"] / DENSE["pad"] / HOLDS["pad"]
    return 2 * flux / CONDUCTS["pad"] * np.sqrt(diffusivity * t / np.pi) * (1 - 2 * t / (3 * stop))


def run(options):
    """The simulation at its end and a row a step: time, spin, mean and largest temperature of the rim's nodes, of the disc,
    status, coupling."""
    sim, body = build(options)
    rim = body.groups["rim"]
    disc = len(sim.bodies) - 1
    weight = np.ones(len(rim))
    weight[[0, -1]] = 0.5
    rows = []
    for _ in range(round(options.seconds / options.dt)):
        report = sim.step()
        heat, t = report["thermal"], sim.nodes.temperature[sim.meshes[0].place]
        met = (report["status"] == "converged") + (heat["status"] == "converged")
        rows.append((sim.time, sim.bodies.velocity[disc, 2], np.average(t[rim], weights=weight), t[rim].max(),
                     sim.bodies.temperature[disc], met, heat["coupling"], report["error"], heat["residual"]))  # fmt: skip
    return sim, body, np.array(rows)


def draw(body, sim, rows, expected, folder):
    """Temperatures of the pad near the rim, and of surface and disc against time."""
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection

    figure, axes = plt.subplots(1, 3, figsize=(14, 4), layout="constrained", width_ratios=(1.5, 1, 1))
    cells = body.cells["quad"]
    t = sim.nodes.temperature[sim.meshes[0].place]
    places = (body.points + sim.meshes[0].displacement) * 1e3
    drawn = PolyCollection(places[cells], array=t[cells].mean(axis=1) - 273.15, cmap="inferno", edgecolor="face")
    axes[0].add_collection(drawn)
    heights = (RADIUS * 1e3 - 2, (RADIUS + HIGH) * 1e3 + 1)
    axes[0].set(xlim=(-21, 21), ylim=heights, xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
    figure.colorbar(drawn, ax=axes[0], label="temperature [deg C]", shrink=0.6)
    axes[1].plot(rows[:, 0], rows[:, 2] - REFERENCE, label="mean of the pad's surface")
    axes[1].plot(rows[:, 0], rows[:, 3] - REFERENCE, ":", label="its hottest node")
    axes[1].plot(rows[:, 0], expected, "k--", label="half space, flux q (1 - t/T)")
    axes[1].set(xlabel="time [s]", ylabel="rise [K]")
    axes[1].legend()
    axes[2].plot(rows[:, 0], rows[:, 1])
    axes[2].set(xlabel="time [s]", ylabel="spin [rad/s]")
    warm = axes[2].twinx()
    warm.plot(rows[:, 0], rows[:, 4] - REFERENCE, "C1")
    warm.set_ylabel("rise of the disc [K]", color="C1")
    figure.savefig(folder / f"{NAME}.png", dpi=110)
    plt.close(figure)


def main(arguments=None):
    """Brakes, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    start = time.perf_counter()
    sim, body, rows = run(options)
    effusivity = [np.sqrt(CONDUCTS[name] * DENSE[name] * HOLDS[name]) for name in DENSE]
    share = effusivity[0] / sum(effusivity)
    inertia = float(sim.bodies.inertia[-1].ravel()[0])
    stop = inertia * SPIN / (FRICTION * PRESSURE * WIDE * RADIUS)
    turning = rows[:, 0] < 0.95 * stop
    expected = halfspace(np.minimum(rows[:, 0], stop), share * FRICTION * PRESSURE * SPIN * RADIUS, stop)
    late = turning & (rows[:, 0] > 0.2 * stop)
    off = np.abs(rows[late, 2] - REFERENCE - expected[late]).max() / expected.max() if late.any() else np.nan
    heat, energy = sim.info["thermal"]["balance"], sim.info["energy"]
    spin = 0.5 * inertia * (SPIN**2 - rows[-1, 1] ** 2)
    figures = {
        "steps": (len(rows), ""),
        "steps solved, contacts and heat": (float((rows[:, 5] == 2).sum()), f"of {len(rows)}"),
        "largest error of contacts": (rows[:, 7].max(), ""),
        "largest residual of heat": (rows[:, 8].max(), ""),
        "largest share of the load unseen": (rows[len(rows) // 10 :, 6].max(), ""),
        "time to stand, rigid pad": (stop, "s"),
        "spin at the end": (rows[-1, 1], "rad/s"),
        "heat of friction / loss of spin": (heat["friction"] / spin, ""),
        "balance of heat": (abs(heat["closure"]) / heat["in_play"], "of what is in play"),
        "heat stored / heat of friction - 1": (heat["stored"] / heat["friction"] - 1, ""),
        "balance of energy": (abs(energy["closure"]) / energy["in_play"], "of what is in play"),
        "rise of the surface, largest mean": (rows[:, 2].max() - REFERENCE, "K"),
        "of a half space": (expected.max(), "K"),
        "largest difference while it turns": (off, "of that"),
        "rise of the disc": (rows[-1, 4] - REFERENCE, "K"),
        "time": (time.perf_counter() - start, "s"),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:36s} {value:.4g} {unit}".rstrip())
    with open(options.output / f"{NAME}.csv", "w", encoding="utf-8") as file:
        file.write("time [s],spin [rad/s],mean of the surface [K],hottest node [K],disc [K],half space [K]\n")
        for row, by in zip(rows, expected):
            file.write(f"{row[0]:.6g},{row[1]:.6g},{row[2]:.6g},{row[3]:.6g},{row[4]:.8g},{REFERENCE + by:.6g}\n")
    draw(body, sim, rows, expected, options.output)
    sim.run(1, output=options.output / f"{NAME}.vtkhdf", overwrite=True, progress=False)
    return figures


if __name__ == "__main__":
    main()
