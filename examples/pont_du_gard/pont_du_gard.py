"""Pont du Gard: a bridge of dry stone in three tiers finds its equilibrium, after section 5.5.1 of Dubois & Renouf (2007).

The Romans laid about 50,000 tonnes of limestone without mortar. Each block is rigid here, each joint a plane on which
Signorini's condition and Coulomb's friction hold with mu = 0.5: nothing pulls, nothing sinks in. The bridge is drawn by
`cairn.pre.masonry.pont_du_gard` (6, 11 and 33 arches; the blocks' sizes are divided by --detail), gravity is put on at
once, and the impulses of all joints are sought. A hyperstatic structure has many states of equilibrium; inertia and friction
select among them.

The impulses are sought for all blocks at once by `cairn.find_equilibrium`, a Newton method whose unknowns are the velocities of
blocks; the first step starts from them, and the steps after it show that the bridge stands. With --relax rest is found by
dynamic relaxation instead: whenever the kinetic energy has passed a peak, all velocities are set to zero (Cundall 1982). The
residual force on each block, the reactions against the weight, and the error of the contact problem measure the distance from
equilibrium.

Run it:  python pont_du_gard.py              760 blocks, two seconds
         python pont_du_gard.py --full       35,000 blocks, 4 GB, five minutes
         python pont_du_gard.py --help
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path

import cairn as cn
from cairn.post import masonry_plots
from cairn.post.masonry import Structure

NAME = "pont_du_gard"
DENSITY, FRICTION, GRAVITY = 2300.0, 0.5, 9.81


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--detail", type=float, default=0.3, help="1 makes 10,000 blocks, 1.65 makes 35,000")
    parser.add_argument("--full", action="store_true", help="35,000 blocks")
    parser.add_argument("--bridge", type=int, default=0, help="instead, a small bridge of one tier of so many arches")
    parser.add_argument("--dt", type=float, default=1e-3, help="[s]")
    parser.add_argument("--relax", action="store_true", help="by dynamic relaxation")
    parser.add_argument("--iterations", type=int, default=10, help="of the contact solver in a step")
    parser.add_argument("--unbalanced", type=float, default=1e-3, help="largest force left on a block over its weight, to stop")
    parser.add_argument("--error", type=float, default=1e-5, help="of the contact problem and of the reactions, to stop")
    parser.add_argument("--steps", type=int, default=4000, help="at most")
    parser.add_argument("--minutes", type=float, default=600.0, help="at most")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.full:
        options.detail = 1.65
    return options


def build(options):
    """The bridge in a simulation."""
    if options.bridge:
        tier = cn.pre.masonry.Tier(options.bridge, 6.0, 3.0, 3.0, 3.0, 0.9, 0.4, voussoirs=11, across=2)
        blocks = cn.pre.masonry.bridge([tier])
    else:
        blocks = cn.pre.masonry.pont_du_gard(options.detail)
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -GRAVITY))
    ids = blocks.add_to(scene, cn.Material("limestone", density=DENSITY))
    scene.interact("*", "*", cn.Coulomb(mu=FRICTION))
    solver = cn.NLGS(tol=options.error / 2, max_iter=options.iterations)
    simulation = cn.Simulation(scene, options.dt, cn.NSCD(theta=1.0, solver=solver, threads=options.threads))
    return Structure(blocks, simulation, ids)


def settle(structure, options, steps=10):
    """Finds the impulses of equilibrium, then makes steps from them; returns the rows of the history."""
    history, start = [], time.process_time()

    def follow(found):
        history.append({"stage": "impulses", "step": found["round"], "iterations": found["newton"]})
        history[-1] |= {"products": found["cg"], "cpu_seconds": time.process_time() - start, "error": found["error"]}
        history[-1]["unbalanced"] = found["unbalanced"]
        show(history[-1])

    # the reactions are as far from the weight as the blocks are unbalanced, at most
    unbalanced = min(0.05 * options.unbalanced, options.error)
    cn.find_equilibrium(structure.simulation, 0.1 * options.error, unbalanced, report=follow)
    for step in range(1, steps + 1):
        structure.simulation.step()
        history.append({"stage": "step", "step": step, "iterations": structure.simulation.info["iterations"]})
        history[-1] |= {"cpu_seconds": time.process_time() - start} | state(structure)
        show(history[-1])
    return history


def state(structure):
    """Figures of the equilibrium of the bridge."""
    balance, info = structure.balance(), structure.simulation.info
    return {
        "contacts": info["contacts"],
        "error": info["error"],
        "unbalanced": balance["unbalanced"],
        "reaction_error": balance["reaction_error"],
        "speed": balance["speed"],
        "largest_displacement": float(structure.displacement().max()),
    }


def show(row):
    print("  ".join(f"{k} {v:.3g}" if isinstance(v, (int, float)) else v for k, v in row.items()), flush=True)


def relax(structure, options, every=20):
    """Steps until nothing moves; rows of the history."""
    simulation, history = structure.simulation, []
    kinetic, iterations, start = 0.0, 0, time.process_time()
    wall = time.monotonic()
    for step in range(1, options.steps + 1):
        simulation.step()
        iterations += simulation.info["iterations"]
        now = simulation.energy["kinetic"]
        if step % every == 0 or step == options.steps:
            row = {"stage": "relaxation", "step": step, "iterations": iterations, "cpu_seconds": time.process_time() - start}
            history.append(row | state(structure))
            show(history[-1])
            last = history[-1]
            if last["unbalanced"] <= options.unbalanced and max(last["error"], last["reaction_error"]) <= options.error:
                break
            if time.monotonic() - wall > 60 * options.minutes:
                break
        if now < kinetic:
            simulation.bodies.set(velocity=simulation.bodies.velocity * 0.0)
            now = 0.0
        kinetic = now
    return history


def main(arguments=None):
    """Builds the bridge, lets it find its equilibrium, draws its forces; returns the figures."""
    import matplotlib.pyplot as plt

    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    structure = build(options)
    history = (relax if options.relax else settle)(structure, options)
    structure.simulation.run(1, output=options.output / f"{NAME}.vtkhdf", overwrite=True)
    with open(options.output / f"{NAME}.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, list(dict.fromkeys(name for row in history for name in row)))
        writer.writeheader()
        writer.writerows(history)
    ax = masonry_plots.draw(structure, title=f"{len(structure.blocks):,} blocks: compression and joint forces")
    ax.figure.savefig(options.output / f"{NAME}.png", dpi=160)
    plt.close(ax.figure)
    last = history[-1]
    units = {"iterations": "", "cpu_seconds": "s", "speed": "m/s", "largest_displacement": "m"}
    figures = {"blocks": (len(structure.blocks), ""), "weight": (-structure.weight()[:, 2].sum(), "N")}
    figures |= {name: (value, units.get(name, "")) for name, value in last.items() if name != "stage"}
    for name, (value, unit) in figures.items():
        print(f"{name:22s} {value:.6g} {unit}".rstrip())
    return figures


if __name__ == "__main__":
    main()
