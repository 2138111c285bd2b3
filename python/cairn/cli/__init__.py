"""The command `cairn`: run, look at, draw and convert, from the shell.

A command is a module of this folder, with `add_parser(add, commands)` and `main(options)`, which returns the exit status, and a
row of COMMANDS.
"""

import argparse
import os
import sys

from . import (
    check,
    completion,
    convert,
    doctor,
    import_blocks,
    info,
    new_law,
    plot,
    run,
    solve,
    study,
    sweep,
    verify,
    view,
    wrap_law,
)
from .errors import interrupted, told
from .parser import Parser, add_command

COMMANDS = {
    "run": run,
    "import": import_blocks,
    "check": check,
    "info": info,
    "plot": plot,
    "convert": convert,
    "verify": verify,
    "new-law": new_law,
    "wrap-law": wrap_law,
    "solve": solve,
    "study": study,
    "sweep": sweep,
    "view": view,
    "doctor": doctor,
    "completion": completion,
}

LEVELS = ("DEBUG", "INFO", "WARNING", "ERROR")
EXAMPLES = """\
examples:
  cairn run pile.py                            run a Python script
  cairn run pile.scene.h5 --dt 1e-3 --steps 2000 --output pile.vtkhdf --every 20
                                               run a scene that Scene.save wrote
  cairn check pile.json                        faults of a scene that is a JSON document; cairn run runs it
  cairn import wall.stl -o wall.scene.h5       blocks of a file: what is wrong with them, and a scene to run
  cairn info pile.vtkhdf                       what is in a file, and how the solver did
  cairn plot pile.vtkhdf -o pile.png           the last output, coloured by speed
  cairn plot pile.vtkhdf --what forces -o chains.png
  cairn plot pile.vtkhdf --what material -o pile.gif
                                               an animation of all outputs
  cairn convert pile.vtkhdf pile.csv           for a spreadsheet; .npz for numpy, .vtu or .vtp for older readers
  cairn solve box.hdf5 --tol 1e-8              a frictional contact problem of its own (FCLIB, Siconos)
  cairn study pile.py --accuracy 1e-2 --of solid_fraction
                                               which setting is the cheapest that is accurate enough
  cairn sweep study.toml -j 4                  a script over many values of its parameters, results in one table
  cairn view pile.vtkhdf                       3D view in the browser; --html page.html writes a page to send
  cairn verify pile.vtkhdf other.vtkhdf        two runs compared, with a verdict (exit status 3: they differ)
  cairn doctor                                 what is installed, what is missing, a self-test
  cairn new-law sticky                         a contact law of your own in Fortran, ready to build and run

'cairn COMMAND --help' tells more of each. ParaView opens .vtkhdf files as they are (5.13 or later).
"""


def build_parser():
    """The parser of all commands."""
    parser = Parser(
        prog="cairn",
        description="Mechanics of divided media: many bodies in dry-frictional contact.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--log", metavar="LEVEL", type=str.upper, choices=LEVELS, help="tell what is done on the standard error: "
                        "debug, info, warning or error")  # fmt: skip
    parser.add_argument("--version", action="store_true", help="show the version and how it was built")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    for module in COMMANDS.values():
        module.add_parser(add_command, commands)
    parser.commands = commands.choices
    parser.commands["completion"].set_defaults(whole=parser)
    return parser


def main(arguments=None):
    """Run the command; returns the exit status: 0 done, 1 an error, 2 a wrong call, 3 runs differ, 128 and the number
    of the signal that stopped it: 130 after Ctrl-C."""
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    parser = build_parser()
    lead = 0 if not arguments or not arguments[0].startswith("--log") else 1 if "=" in arguments[0] else 2
    rest, passed_on = _of_script(arguments[lead:])
    options = parser.parse_args(arguments[:lead] + rest)
    if options.version:
        print(version())
        return 0
    if options.command is None:
        parser.print_help()
        return 2
    options.passed_on = passed_on
    if options.log:
        import logging

        logging.basicConfig(format="%(asctime)s %(name)s %(levelname)s: %(message)s")
        logging.getLogger("cairn").setLevel(options.log)
    try:
        from .. import post  # noqa: F401  a message of its own if h5py is missing

        return COMMANDS[options.command].main(options)
    except KeyboardInterrupt as error:
        return interrupted(error)
    except BrokenPipeError:  # the reader of our output left, as 'head' does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        return told(error, options.what if passed_on is not None else None)


def _of_script(arguments):
    """Arguments for Cairn, and those for a script, which has options of its own; None for these where there is no script."""
    arguments, ranks = _without_ranks(arguments)
    own = [k for k, word in enumerate(arguments) if word != "--overwrite"][:2]
    if len(own) < 2 or arguments[0] != "run" or not arguments[own[1]].endswith(".py"):
        return [*arguments[:1], *ranks, *arguments[1:]], None
    script, rest = arguments[own[1]], arguments[own[1] + 1 :]
    end = rest.index("--") if "--" in rest else len(rest)
    overwrite = "--overwrite" in arguments[: own[1]] + rest[:end]
    passed_on = [word for word in rest[:end] if word != "--overwrite"] + rest[end + 1 :]
    return ["run", script, *ranks] + ["--overwrite"] * overwrite, passed_on


def _without_ranks(arguments):
    """Arguments of `cairn run` without --ranks N, which Cairn takes wherever it stands before --, and these words."""
    end = arguments.index("--") if "--" in arguments else len(arguments)
    at = next((k for k, word in enumerate(arguments[:end]) if word.split("=")[0] == "--ranks"), None)
    if arguments[:1] != ["run"] or at is None:
        return arguments, []
    last = at + (1 if "=" in arguments[at] else 2)
    return arguments[:at] + arguments[last:], arguments[at:last]


def version():
    """Version, and how it was built."""
    try:
        from .. import _core
    except ImportError:
        return "cairn (the compiled part is not installed)"
    build = dict(_core.build_info())
    lines = [f"cairn {build.pop('version')}"]
    return "\n".join(lines + [f"  {name}: {value}" for name, value in build.items()])
