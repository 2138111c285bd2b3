"""Water bends a gate of rubber and flows out below it: a deformable body at large strains in a liquid.

Antoci, Gallati & Sibilla (2007) measured how far the free end of a gate opens: 79 mm high, 5 mm thick, clamped at its top, before
100 mm x 140 mm of water. The gate is softer than the step of the liquid is short, and light beside the water that it moves.

Run it:  python elastic_gate.py              2,240 particles, a minute
         python elastic_gate.py --full       8,960 particles
         python elastic_gate.py --incompressible    half the time
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import numpy as np

NAME = "elastic_gate"
GRAVITY, WATER = 9.81, 1000.0
WIDE, DEEP = 0.1, 0.14  # of the water [m]
HIGH, THICK = 0.079, 0.005  # of the gate [m]


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--spacing", type=float, default=0.0025, help="of the particles [m]")
    parser.add_argument("--full", action="store_true", help="half the spacing")
    parser.add_argument("--incompressible", action="store_true", help="pressure in the step of the gate, without sub-steps")
    parser.add_argument("--young", type=float, default=7.8e6, help="modulus of the gate [Pa]")
    parser.add_argument("--cells", type=int, default=16, help="along the gate")
    parser.add_argument("--seconds", type=float, default=0.4)
    parser.add_argument("--dt", type=float, default=1e-3, help="[s]")
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.full:
        options.spacing = 0.00125
    return options


def gate(cells):
    """Points and cells of second order, one across the gate."""
    x, y = np.linspace(WIDE, WIDE + THICK, 3), np.linspace(0, HIGH, 2 * cells + 1)
    number, points = {}, []
    for j in range(len(y)):
        for i in range(3):
            if not (i == 1 and j % 2):
                number[i, j] = len(points)
                points.append((x[i], y[j]))
    corners = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    return np.array(points), np.array([[number[i, 2 * k + j] for i, j in corners] for k in range(cells)])


def build(options):
    """The tank with its water and the gate; the wall above the gate is rigid."""
    rubber, steel = cn.Material("rubber", density=1100.0), cn.Material("steel", density=7800.0)
    points, cells = gate(options.cells)
    law = cn.NeoHookean(young=options.young, poisson=0.47)
    held = {"top": np.flatnonzero(points[:, 1] > HIGH - 1e-9)}
    body = cn.SolidBody(points, {"quad8": cells}, law, density=1100.0, groups=held)
    scene = cn.Scene(dim=2, gravity=(0.0, -GRAVITY))
    scene.add(cn.deformable(body, rubber, name="gate", fixed={"top": "xy"}))
    plate = 0.5 * np.array([(-THICK, -0.1), (THICK, -0.1), (THICK, 0.1), (-THICK, 0.1)])
    middle = [[WIDE + THICK / 2, HIGH + 0.05]]
    scene.add(cn.wall((0, 0), (0, 1), steel), cn.wall((0, 0), (1, 0), steel))
    scene.add(cn.polygons(plate, steel, position=middle, driven=("vx", "vy", "w")))
    scene.add(cn.fluid([(0, 0), (WIDE, DEEP)], options.spacing, WATER, incompressible=options.incompressible))
    scene.interact("*", "*", None)
    scene.interact("fluid", "*", cn.FreeSlip())
    return cn.Simulation(scene, dt=options.dt), int(np.argmin(np.abs(points - [WIDE + THICK, 0]).sum(axis=1)))


def main(arguments=None):
    """Lets the water go until the time is over; prints and draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    sim, tip = build(options)
    start, ways, thrust = np.array(sim.nodes.position[tip]), [], []

    def follow(sim):
        ways.append(sim.nodes.position[tip] - start)
        thrust.append(sim.fluid.forces_on_mesh("gate")[:, 0].sum())

    steps = round(options.seconds / options.dt)
    path = options.output / f"{NAME}.vtkhdf"
    sim.run(steps, output=path, every=max(steps // options.frames, 1), callback=follow, overwrite=True)
    way = np.array(ways)
    widest = int(np.argmax(way[:, 0]))
    figures = {
        "particles": (len(sim.fluid), ""),
        "free end moves by at most": (1e3 * way[widest, 0], "mm"),
        "  and rises by": (1e3 * way[widest, 1], "mm"),
        "  at": (options.dt * (widest + 1), "s"),
        "greatest thrust on the gate": (max(thrust), "N/m"),
        "flowed out": (float(np.mean(sim.fluid.position[:, 0] > WIDE + THICK)), ""),
        "sub-steps of the last step": (sim.fluid.info["sub_steps"], ""),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:28s} {value:.4g} {unit}".rstrip())
    draw(path, sim, options)
    return {name: (float(value), unit) for name, (value, unit) in figures.items()}


def draw(path, sim, options):
    """Four moments, coloured by pressure, with the gate as it is bent."""
    import matplotlib.pyplot as plt
    from cairn.post.fluid_plots import plot_fluid

    sides = sim.meshes[0].body.boundary_edges()
    figure, axes = plt.subplots(2, 2, figsize=(8, 5.5), layout="constrained")
    with cn.load(path) as run:
        for ax, share in zip(axes.ravel(), (0.1, 0.35, 0.6, 1.0)):
            step = run[int(round(share * (len(run) - 1)))]
            view = ((-0.005, 0.25), (-0.005, 0.16))
            plot_fluid(step, "pressure", ax=ax, view=view, limits=(0, WATER * GRAVITY * DEEP), title=f"{step.time:.2f} s")
            place = step.nodes["position"]
            for a, b in sides:
                ax.plot(*place[[a, b]].T[:2], color="black", linewidth=1)
    figure.savefig(options.output / f"{NAME}.png", dpi=100)
    plt.close(figure)


if __name__ == "__main__":
    main()
