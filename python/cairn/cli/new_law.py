"""`cairn new-law`: a contact law of one's own, ready to build, to run and to test."""

import shlex


def add_parser(add, commands):
    """The parser of `cairn new-law`."""
    law = add(
        commands, "new-law", "write a contact law of your own, ready to build, to run and to test", "cairn new-law sticky"
    )
    law.add_argument("name", help="small letters, digits and _")
    law.add_argument("--folder", help="where to (default: a new folder of that name)")


def main(options):
    """`cairn new-law`."""
    from ..plugs.new_law import build_line
    from ..plugs.new_law import new_law as write

    paths = write(options.name, options.folder)
    for path in paths:
        print(path)
    print(f"\nnow:  cd {shlex.quote(str(paths[0].parent))}\n      {build_line(options.name)}\n      python run.py")
    return 0
