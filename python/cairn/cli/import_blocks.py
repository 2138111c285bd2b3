"""`cairn import`: blocks from a file, with a report of their faults, and a scene of them to run."""

from __future__ import annotations

import warnings

import numpy as np


def add_parser(add, commands):
    """The parser of `cairn import`."""
    parser = add(
        commands,
        "import",
        "read blocks from STL, OBJ, PLY, OFF, VTK, gmsh, STEP, IFC, COMPAS or LMGC90 files, and say what is wrong with them",
        "cairn import wall.stl                         closed? volume, smallest edge, overlaps, joints\n"
        "cairn import wall.stl --scale 1e-3 --repair   millimetres; holes filled, faces turned outward\n"
        "cairn import wall.stl -o wall.scene.h5 --density 2400 --mu 0.6\n"
        "cairn run wall.scene.h5 --dt 1e-3 --steps 200 --output wall.vtkhdf",
    )
    parser.add_argument("file", help=".stl .obj .ply .off .vtk .vtu .msh .step .ifc .json (COMPAS) .dat (LMGC90's BODIES.DAT)")
    parser.add_argument("--repair", action="store_true", help="mend surfaces that are not closed, and say what was done")
    parser.add_argument("--hull", action="store_true", help="take hulls of what is not convex (default: convex parts)")
    parser.add_argument("--near", type=float, help="where the exact cut into convex parts gives up: hulls that stray by this "
                        "share of the size, 0.05 say (needs coacd)")  # fmt: skip
    parser.add_argument("--scale", type=float, default=1.0, help="metres in a unit of the file (default: 1)")
    parser.add_argument("--flat", type=float, default=1e-6, help="how far corners may stand out of faces, over the extent (1e-6)")
    parser.add_argument("-o", "--output", metavar="SCENE", help="write a scene of the blocks under gravity, to run")
    parser.add_argument("--density", type=float, default=2400.0, help="density of the blocks [kg/m3] (default: 2400)")
    parser.add_argument("--mu", type=float, default=0.6, help="friction coefficient (default: 0.6)")
    parser.add_argument(
        "--hold",
        choices=("support", "lowest", "floor"),
        help="what carries them: blocks named support (default if there are any), the lowest blocks, or a floor below (default)",
    )


def main(options):
    """The command: prints the report, writes the scene; returns the exit status."""
    from ..pre import importing, mesh

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", importing.BlocksWarning)  # the report says the same
            bodies, names, report = gathered(importing, options)
    except mesh.MeshError as error:  # the remedies in the shell's words
        words = str(error).replace("repair=True", "--repair").replace("convex='hull'", "--hull")
        words = words.replace("near=0.05", "--near 0.05")
        raise ValueError(words) from None
    print(str(report).replace("give scale=", "give --scale "))
    counted = {name: names.count(name) for name in dict.fromkeys(names)}
    if list(counted) != ["block"]:
        print("named " + ", ".join(f"{name} ({count})" for name, count in counted.items()))
    for (i, j), depth in list(zip(report.overlaps, report.overlap_depth))[:5]:
        print(f"blocks {i} and {j} overlap by {depth:.3g} m")
    if options.output:
        scene, held = scene_of(bodies, names, options)
        scene.save(options.output)
        print(f"held: {held}\nwritten to {options.output}; now:  cairn run {options.output} --dt 1e-3 --steps 200")
    return 0


def gathered(importing, options):
    """Convex parts of each body, their names, the report."""
    given = {"repair": options.repair, "scale": options.scale, "flat": options.flat}
    if not options.hull:
        return importing.bodies(options.file, near=options.near, **given)
    blocks, report = importing.read(options.file, convex="hull", **given)
    bodies = [[(v, f)] if blocks.dim == 3 else [v] for v, f in zip(blocks.vertices, blocks.faces)]
    return bodies, blocks.part, report


def scene_of(bodies, names, options):
    """A scene of the bodies under gravity, with their supports."""
    from .. import Coulomb, Material, Scene, polygons, polyhedra, wall

    dim = 2 if isinstance(bodies[0][0], np.ndarray) else 3
    corners = [np.concatenate(parts if dim == 2 else [p[0] for p in parts]) for parts in bodies]
    low, high = np.min([c.min(axis=0) for c in corners], axis=0), np.max([c.max(axis=0) for c in corners], axis=0)
    hold = options.hold or ("support" if "support" in names else "floor")
    up = np.eye(dim)[-1]
    fixed = np.array([name == "support" for name in names])
    if hold == "lowest":
        fixed = np.array([c[:, -1].min() <= low[-1] + 1e-6 * (high - low).max() for c in corners])
    elif hold == "floor":
        fixed[:] = False
    elif not np.any(fixed):
        raise ValueError('--hold support: no block is named "support": give --hold lowest or --hold floor')
    if np.all(fixed):
        raise ValueError(f"--hold {hold}: all {len(bodies)} blocks would be held: give another, or add what is to move")
    scene = Scene(dim, gravity=-9.81 * up, origin=(low + high) / 2)
    stone = Material("stone", density=options.density)
    make = polygons if dim == 2 else polyhedra
    for at, kind in ((np.flatnonzero(~fixed), "block"), (np.flatnonzero(fixed), "support")):
        if len(at):
            scene.add(make([bodies[k] for k in at], stone, fixed=kind == "support").with_(group=kind))
    if hold == "floor":
        scene.add(wall(low, up, stone))
    scene.interact("*", "*", Coulomb(mu=options.mu))
    return scene, f"a floor at {low[-1]:g} m" if hold == "floor" else f"{int(np.sum(fixed))} blocks ({hold})"
