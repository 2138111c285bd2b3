"""`cairn convert`: a run in another format; an LMGC90 folder as a scene, with an account of what was read as what."""

import os
import sys


def add_parser(add, commands):
    """The parser of `cairn convert`."""
    convert = add(
        commands,
        "convert",
        "write a run in another format, chosen by the name; or read an LMGC90 folder",
        "cairn convert pile.vtkhdf pile.csv                    bodies of all outputs, a row each\n"
        "cairn convert pile.vtkhdf touch.csv --what contacts\n"
        "cairn convert pile.vtkhdf solver.csv --what history\n"
        "cairn convert dam.vtkhdf water.csv --what fluid       particles of the liquid\n"
        "cairn convert pile.vtkhdf pile.npz                    numpy arrays, named 00000/bodies/position ...\n"
        "cairn convert pile.vtkhdf pile.vtu                    pile_bodies_0000.vtu ... with a .pvd for the times\n"
        "cairn convert pile.vtkhdf pile.h5                     plain HDF5, a group per output\n"
        "cairn convert case                                    a folder with DATBOX: what is read as what\n"
        "cairn convert case case.scene.h5                      and the scene, for cairn run",
    )
    convert.add_argument("file", help="a .vtkhdf file, or an LMGC90 folder with DATBOX")
    convert.add_argument("out", nargs="?", help="file to write: .csv, .npz, .h5, .vtp or .vtu; of a folder a .scene.h5")
    tables = ("bodies", "nodes", "contacts", "fluid", "history")
    convert.add_argument("--what", choices=tables, default="bodies", help="table to write to a .csv")
    convert.add_argument("--step", type=int, metavar="I", help="only this output")
    convert.add_argument("--overwrite", action="store_true", help="replace the file if it is there")


def main(options):
    """`cairn convert`."""
    if os.path.isdir(options.file):
        return _folder(options)
    if options.out is None:
        raise ValueError("missing: out; say which file to write: .csv, .npz, .h5, .vtp or .vtu")
    from ..post.convert import convert as write

    for path in write(options.file, options.out, what=options.what, step=options.step, overwrite=options.overwrite):
        print(path)
    if options.out.lower().endswith(".csv") and options.what in ("bodies", "nodes") and _has_fluid(options.file):
        print("the liquid is not in this table: --what fluid writes its particles, other formats hold all", file=sys.stderr)
    return 0


def _has_fluid(path):
    from ..post.load import load

    with load(path) as run:
        return "fluid" in run.scene


def _folder(options):
    """An LMGC90 folder: the account, and the scene if a file is named."""
    from ..base.errors import FileError
    from ..legacy import account

    if options.what != "bodies" or options.step is not None:
        raise ValueError("--what and --step are for runs: of a folder give the name of a .scene.h5 alone, or nothing")
    scene, lines = account(options.file)
    print("\n".join(lines))
    if options.out is None:
        return 0
    if not options.out.endswith(".h5"):
        raise FileError(options.out, "a folder becomes a scene, which is an HDF5 file", "give a name that ends in .scene.h5")
    if os.path.exists(options.out) and not options.overwrite:
        raise FileError(options.out, "this file exists already", "choose another name, or ask to overwrite it (--overwrite)")
    scene.save(options.out)
    print(f"\nwritten to {options.out}")
    return 0
