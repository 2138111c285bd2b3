"""`cairn convert`: a run in another format."""


def add_parser(add, commands):
    """The parser of `cairn convert`."""
    convert = add(
        commands,
        "convert",
        "write a run in another format, chosen by the name",
        "cairn convert pile.vtkhdf pile.csv                    bodies of all outputs, a row each\n"
        "cairn convert pile.vtkhdf touch.csv --what contacts\n"
        "cairn convert pile.vtkhdf solver.csv --what history\n"
        "cairn convert pile.vtkhdf pile.npz                    numpy arrays, named 00000/bodies/position ...\n"
        "cairn convert pile.vtkhdf pile.vtu                    pile_bodies_0000.vtu ... with a .pvd for the times\n"
        "cairn convert pile.vtkhdf pile.h5                     plain HDF5, a group per output",
    )
    convert.add_argument("file", help="a .vtkhdf file")
    convert.add_argument("out", help="file to write: .csv, .npz, .h5, .vtp or .vtu")
    convert.add_argument("--what", choices=("bodies", "contacts", "history"), default="bodies", help="table to write to a .csv")
    convert.add_argument("--step", type=int, metavar="I", help="only this output")
    convert.add_argument("--overwrite", action="store_true", help="replace the file if it is there")


def main(options):
    """`cairn convert`."""
    from ..post.convert import convert as write

    for path in write(options.file, options.out, what=options.what, step=options.step, overwrite=options.overwrite):
        print(path)
    return 0
