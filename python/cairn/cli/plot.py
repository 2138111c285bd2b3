"""`cairn plot`: pictures and animations of a run."""

import os
import sys

from ..base import checks
from ..names import listed
from .errors import save_picture


def add_parser(add, commands):
    """The parser of `cairn plot`."""
    plot = add(
        commands,
        "plot",
        "draw a run",
        "cairn plot pile.vtkhdf -o pile.png\n"
        "cairn plot pile.vtkhdf --time 0.5 --what rotation -o turned.png\n"
        "cairn plot pile.vtkhdf --what forces -o chains.pdf\n"
        "cairn plot pile.vtkhdf --what energy -o energy.png\n"
        "cairn plot pile.vtkhdf --what material --every 2 -o pile.gif",
    )
    plot.add_argument("file", help="a .vtkhdf file")
    plot.add_argument(
        "--what",
        help="velocity, rotation, material, any field of the bodies, pressure, density or speed of a liquid, "
        "forces, energy, residual, or history: probes, energy and error (default: velocity; of a liquid its speed)",
    )
    plot.add_argument("--step", type=int, default=-1, metavar="I", help="number of the output, -1 the last (default)")
    plot.add_argument("--time", type=float, help="draw the output nearest to this time [s] instead")
    plot.add_argument("--every", type=int, default=1, help="animation: each N-th output")
    plot.add_argument("--dpi", type=int, default=150, help="dots an inch (default: 150)")
    plot.add_argument("-o", "--output", help="picture (.png, .pdf, .svg) or animation (.gif, .mp4); default: beside the file")


def main(options):
    """`cairn plot`."""
    import matplotlib

    matplotlib.use("Agg")
    from ..post.fluid_plots import plot_fluid
    from ..post.load import load
    from ..post.plots import AXES, plot_step

    checks.count("every", options.every, 1)
    checks.count("dpi", options.dpi, 1)
    stem = os.path.splitext(options.file)[0]
    film = os.path.splitext(options.output or "")[1].lower() in (".gif", ".mp4")
    with load(options.file) as run:
        of_liquid, liquid = [], len(run) > 0 and len(run[-1].fluid) > 0
        options.what = options.what or ("speed" if liquid and not film else "velocity")
        out = options.output or f"{stem}_{options.what}.png"
        if len(run):
            fields = [*run[-1].drawn.names, "speed", "spin", "forces", "energy", "residual", "history"]
            parts = AXES[run[-1].dim]
            fields += [f"{name}_{part}" for name in ("stress", "strain") if name in fields for part in parts]
            fields += ["von_mises"] * ("stress" in fields)
            of_liquid = [name for name in ("pressure", "density", "porosity") if name not in fields and name in run[-1].fluid]
            fields += of_liquid
            of_liquid += ["speed"] * (liquid and not film)
            if options.what not in fields:
                raise ValueError(f"there is no field {options.what!r}; there are {listed(fields, options.what)}")
        if film:
            if options.what in of_liquid:
                raise ValueError(f"a film shows no liquid, whose {options.what} this is: give -o a .png, with --step I")
            run.animate(out, options.what, every=options.every, dpi=options.dpi)
        elif options.what in ("energy", "residual", "history"):
            draw = {"energy": run.plot_energy, "residual": run.plot_residual, "history": lambda: run.plot_history()[0]}
            save_picture(draw[options.what](), out, options.dpi)
        else:
            if len(run) == 0:
                raise ValueError(f"{options.file} holds no output yet")
            i = options.step if options.time is None else run.at(options.time).index
            draw = plot_fluid if options.what in of_liquid else plot_step
            if liquid and draw is plot_step:
                told = f"{options.what} is that of bodies, and the liquid is not drawn: --what {' or '.join(of_liquid)} draws it"
                print(f"cairn: warning: {told}", file=sys.stderr)
            save_picture(run.plot_force_chains(i) if options.what == "forces" else draw(run[i], options.what), out, options.dpi)
    print(out)
    return 0
