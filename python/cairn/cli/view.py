"""`cairn view`: a run turned round in a window."""


def add_parser(add, commands):
    """The parser of `cairn view`."""
    view = add(commands, "view", "turn a run round in a window (needs pyvista)", "cairn view pile.vtkhdf --what material")
    view.add_argument("file", help="a .vtkhdf file")
    view.add_argument("--what", default="velocity", help="field that colours the bodies (default: velocity)")


def main(options):
    """`cairn view`."""
    from ..post.load import load
    from ..post.plots3d import view as show

    with load(options.file) as run:
        show(run, options.what)
    return 0
