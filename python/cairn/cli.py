"""The command `cairn`: run, look at, draw and convert, from the shell."""

import argparse
import os
import sys

from .names import listed, meant
from .pre import checks
from .pre import command as import_command
from .problems import command as problem_command
from .study import command as study_command

EXAMPLES = """\
examples:
  cairn run pile.py                            run a Python script
  cairn run pile.scene.h5 --dt 1e-3 --steps 2000 --output pile.vtkhdf --every 20
                                               run a scene that Scene.save wrote
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
  cairn view pile.vtkhdf                       turn it round in a window
  cairn verify pile.vtkhdf other.vtkhdf        two runs compared, with a verdict (exit status 3: they differ)
  cairn new-law sticky                         a contact law of your own in Fortran, ready to build and run

'cairn COMMAND --help' tells more of each. ParaView opens .vtkhdf files as they are (5.13 or later).
"""


class Parser(argparse.ArgumentParser):
    """A parser whose refusals say what may have been meant."""

    def _check_value(self, action, value):
        if action.choices is not None and value not in action.choices:
            raise argparse.ArgumentError(action, f"{value!r} is none of {listed(action.choices, value)}")

    def parse_args(self, args=None, namespace=None):
        options, unknown = self.parse_known_args(args, namespace)
        if unknown:
            parser = self.commands.get(options.command, self)
            word = next((word for word in unknown if word.startswith("-")), None)
            if word is None:
                parser.error(f"there is no place for {' '.join(unknown)}")
            word = word.partition("=")[0]
            known = [text for action in parser._actions for text in action.option_strings if text.startswith("--")]
            parser.error(f"there is no option {word}{meant(word, known) or f'; there are {listed(known)}'}")
        return options

    commands = {}

# modules that some commands need, and what pip calls them
PACKAGES = {
    "PIL": "pillow", "matplotlib": "matplotlib", "meshio": "meshio", "networkx": "networkx", "pyvista": "pyvista",
    "scipy": "scipy", "trimesh": "trimesh", "vtkmodules": "vtk",
}


def build_parser():
    """The parser of all commands."""
    parser = Parser(
        prog="cairn",
        description="Mechanics of divided media: many bodies in dry-frictional contact.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="store_true", help="show the version and how it was built")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    _run_parser(commands)
    import_command.add_parser(_add, commands)
    _info_parser(commands)
    _plot_parser(commands)
    _convert_parser(commands)
    _verify_parser(commands)
    law = _add(
        commands, "new-law", "write a contact law of your own, ready to build, to run and to test", "cairn new-law sticky"
    )
    law.add_argument("name", help="small letters, digits and _")
    law.add_argument("--folder", help="where to (default: a new folder of that name)")
    wrap = _add(
        commands,
        "wrap-law",
        "write an adapter that makes a contact law of an existing scalar routine",
        "cairn wrap-law old_law.toml --isolate     see docs/plugins.md for the interface",
    )
    wrap.add_argument("interface", help="a .toml file that says what the routine is called with")
    wrap.add_argument("--isolate", action="store_true", help="run it in a process of its own: its STOP becomes an error message")
    problem_command.add_parser(_add, commands)
    study_command.add_parser(_add, commands)
    view = _add(commands, "view", "turn a run round in a window (needs pyvista)", "cairn view pile.vtkhdf --what material")
    view.add_argument("file", help="a .vtkhdf file")
    view.add_argument("--what", default="velocity", help="field that colours the bodies (default: velocity)")
    parser.commands = commands.choices
    return parser


def _add(commands, name, summary, examples):
    return commands.add_parser(
        name,
        help=summary,
        description=summary[0].upper() + summary[1:] + ".",
        epilog="examples:\n  " + examples.replace("\n", "\n  "),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def _run_parser(commands):
    run = _add(
        commands,
        "run",
        "run a Python script, or a scene that Scene.save wrote",
        "cairn run pile.py                     what follows the script is for the script\n"
        "cairn run pile.py --overwrite         but for this: it replaces the files of runs that are there\n"
        "cairn run pile.py -- --overwrite      after -- all is for the script\n"
        "cairn run pile.scene.h5 --dt 1e-3 --until 2.0 --output pile.vtkhdf --every 20\n"
        "cairn run pile.scene.h5 --dt 1e-3 --steps 500 --restart pile.checkpoint.h5 --output more.vtkhdf",
    )
    run.add_argument("what", metavar="SCRIPT_OR_SCENE", help="a .py script, or a scene file")
    run.add_argument("--dt", type=float, help="time step [s]")
    run.add_argument("--steps", type=int, help="steps to take")
    run.add_argument("--until", type=float, help="time to reach [s]")
    run.add_argument("--output", "-o", help="the .vtkhdf file to write (default: beside the scene)")
    run.add_argument("--every", type=int, default=20, help="steps between outputs (default: 20)")
    run.add_argument("--checkpoint-every", type=int, help="steps between checkpoints, written beside the output")
    run.add_argument("--restart", metavar="CHECKPOINT", help="go on from this checkpoint")
    run.add_argument("--overwrite", action="store_true", help="replace output files that are there, those of a script too")
    run.add_argument("--append", action="store_true", help="go on in the output file; what is later than --restart is dropped")
    run.add_argument("--solver", help="of contacts, by its name in Python: Default, NLGS, Auto, PPANewton, ...")
    run.add_argument("--tol", type=float, help="true error of the contact solver (default: 1e-4)")
    run.add_argument("--dump-problem", metavar="WHEN", help="step=120, or worst: write that contact problem beside the output")
    run.add_argument("--quiet", "-q", action="store_true", help="no progress bar, no figures")


def _info_parser(commands):
    info = _add(
        commands,
        "info",
        "what is in a file, and how the solver did",
        "cairn info pile.vtkhdf\ncairn info pile.vtkhdf --json\ncairn info pile.vtkhdf --script     the script that made it",
    )
    info.add_argument("file", help="a run, a scene or a checkpoint")
    info.add_argument("--json", action="store_true", help="for programs")
    info.add_argument("--script", action="store_true", help="print the script that made the run")
    info.add_argument("--repair", action="store_true", help="after a loss of power: go back to the last state on the disk")


def _plot_parser(commands):
    plot = _add(
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
        default="velocity",
        help="velocity, rotation, material, any field of the bodies, forces, energy or residual (default: velocity)",
    )
    plot.add_argument("--step", type=int, default=-1, metavar="I", help="number of the output, -1 the last (default)")
    plot.add_argument("--time", type=float, help="draw the output nearest to this time [s] instead")
    plot.add_argument("--every", type=int, default=1, help="of an animation: each so many outputs")
    plot.add_argument("--dpi", type=int, default=150, help="dots an inch (default: 150)")
    plot.add_argument("-o", "--output", help="picture (.png, .pdf, .svg) or animation (.gif, .mp4); default: beside the file")


def _convert_parser(commands):
    convert = _add(
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
    convert.add_argument("--what", choices=("bodies", "contacts", "history"), default="bodies", help="of a .csv: which table")
    convert.add_argument("--step", type=int, metavar="I", help="only this output")
    convert.add_argument("--overwrite", action="store_true", help="replace the file if it is there")


def _verify_parser(commands):
    check = _add(
        commands,
        "verify",
        "compare two runs body by body and contact by contact",
        "cairn verify pile.vtkhdf again.vtkhdf\n"
        "cairn verify lmgc90_case/ pile.vtkhdf --tol position=1e-3 --tol total_force=0.01 -o divergence.png\n"
        "exit status: 0 the runs agree, 3 they differ, 1 a file cannot be read",
    )
    check.add_argument("a", help="a .vtkhdf file, an lmgc90.h5, or a folder with DATBOX and OUTBOX")
    check.add_argument("b", help="the other")
    check.add_argument("--tol", action="append", metavar="NAME=VALUE", help="largest value of a norm (default: position=1e-4)")
    check.add_argument("--until", type=float, help="ignore later instants [s]")
    check.add_argument("--size", type=float, help="size of a body [m] (default: median radius of A, half the extent of a mesh)")
    check.add_argument("-o", "--output", help="picture of the divergence over time")
    check.add_argument("--csv", help="write the norms at all common instants")


def main(arguments=None):
    """Run the command; returns the exit status: 0 done, 1 an error, 2 a wrong call, 3 runs differ, 128 and the number
    of the signal that stopped it: 130 after Ctrl-C."""
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    parser = build_parser()
    arguments, passed_on = _of_script(arguments)
    options = parser.parse_args(arguments)
    if options.version:
        print(version())
        return 0
    if options.command is None:
        parser.print_help()
        return 2
    try:
        if options.command == "run":
            return run(options, passed_on)
        if options.command == "new-law":
            return new_law(options)
        if options.command == "wrap-law":
            return wrap_law(options)
        if options.command == "verify":
            return verify(options)
        if options.command == "import":
            return import_command.import_blocks(options)
        if options.command == "solve":
            return problem_command.solve(options)
        if options.command == "study":
            return study_command.study(options)
        from . import post  # noqa: F401  a message of its own if h5py is missing

        return {"info": info, "plot": plot, "convert": convert, "view": view}[options.command](options)
    except KeyboardInterrupt as error:
        return _interrupted(error)
    except BrokenPipeError:  # the reader of our output left, as 'head' does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        place = ""
        if passed_on is not None:
            if not _meant_to_be_read(error):
                raise  # the script's own trouble: show where
            place = _line_of(error, options.what)
        elif not (isinstance(error, (OSError, ValueError, LookupError, TypeError, ImportError)) or _meant_to_be_read(error)):
            raise
        print(f"cairn: error: {place}{_in_a_line(error)}", file=sys.stderr)
        return 1


def _of_script(arguments):
    """Arguments for Cairn, and those for a script, which has options of its own; None for these where there is no script."""
    own = [k for k, word in enumerate(arguments) if word != "--overwrite"][:2]
    if len(own) < 2 or arguments[0] != "run" or not arguments[own[1]].endswith(".py"):
        return arguments, None
    script, rest = arguments[own[1]], arguments[own[1] + 1 :]
    end = rest.index("--") if "--" in rest else len(rest)
    overwrite = "--overwrite" in arguments[: own[1]] + rest[:end]
    passed_on = [word for word in rest[:end] if word != "--overwrite"] + rest[end + 1 :]
    return ["run", script] + ["--overwrite"] * overwrite, passed_on


def _frames(error):
    """Frames that an error came through, the outermost first, each with the place of its instruction."""
    trace = error.__traceback__
    while trace is not None:
        yield trace.tb_frame, trace.tb_lasti, trace.tb_lineno
        trace = trace.tb_next


def _meant_to_be_read(error):
    """Whether Cairn raised an error by a statement of its own, or in its core, which then says all that there is to know."""
    import dis

    from . import Error

    frame, at, _ = list(_frames(error))[-1]
    code = frame.f_code
    if not os.path.abspath(code.co_filename).startswith(os.path.dirname(os.path.abspath(__file__)) + os.sep):
        return False
    return isinstance(error, Error) or dis.opname[code.co_code[at]] == "RAISE_VARARGS"


def _in_a_line(error):
    """The words of an error."""
    from .post.errors import FileError, as_file_error

    if isinstance(error, ModuleNotFoundError) and (package := PACKAGES.get((error.name or "").partition(".")[0])):
        return f"{package} is needed for this: pip install {package}"
    if isinstance(error, OSError) and not isinstance(error, FileError) and error.errno and error.filename:
        error = as_file_error(error.filename, error)
    text = error.args[0] if isinstance(error, LookupError) and error.args else error
    return " ".join(str(text).splitlines())


def _line_of(error, script):
    """'pile.py, line 12: ' of an error that came through this line of a script."""
    lines = [line for frame, _, line in _frames(error) if os.path.abspath(frame.f_code.co_filename) == os.path.abspath(script)]
    return f"{script}, line {lines[-1]}: " if lines else ""


def _interrupted(error):
    """Says where the simulation at hand was, if it has not been said, and returns the exit status."""
    from .run.loop import Stopped
    from .run.simulation import Simulation

    if isinstance(error, Stopped):  # said when the run ended
        return error.status
    found = [x for frame, _, _ in _frames(error) for x in frame.f_locals.values() if isinstance(x, Simulation)]
    at = f" at step {found[-1].steps}, t = {found[-1].time:g} s" if found else ""
    print(f"cairn: stopped by Ctrl-C{at}", file=sys.stderr)
    return 130


def version():
    """Version, and how it was built."""
    try:
        from . import _core
    except ImportError:
        return "cairn (the compiled part is not installed)"
    build = dict(_core.build_info())
    lines = [f"cairn {build.pop('version')}"]
    return "\n".join(lines + [f"  {name}: {value}" for name, value in build.items()])


def run(options, passed_on):
    """`cairn run`."""
    from .run import loop as runs

    if options.what.endswith(".py"):
        import runpy

        if not os.path.isfile(options.what):
            raise SystemExit(f"cairn: error: {options.what}: no such script")
        sys.argv = [options.what, *passed_on]
        sys.path.insert(0, os.path.dirname(os.path.abspath(options.what)))
        with runs.commanded(options.overwrite) as command:
            try:
                runpy.run_path(options.what, run_name="__main__")
            except SystemExit as end:
                if command.stopped is None or end.code not in (None, 0):
                    raise
        return command.status
    from .build.scene import Scene
    from .run.simulation import Simulation

    if options.dt is None:
        raise ValueError("a scene has no time step of its own: give one, --dt 1e-3 [s] say")
    if options.steps is None and options.until is None:
        raise ValueError("say how long to run: --steps 1000, or --until 2.0 [s]")
    simulation = Simulation(Scene.load(options.what), dt=options.dt, strategy=_strategy(options))
    if options.restart:
        simulation.restore(options.restart)
        simulation.dt = options.dt
    stem = options.what
    for ending in (".h5", ".scene"):
        stem = stem.removesuffix(ending)
    output = options.output or stem + ".vtkhdf"
    dump = None
    if options.dump_problem:
        from .run.contact_problem import Dump

        dump = Dump(options.dump_problem, os.path.splitext(output)[0] + ".problem.hdf5")
    with runs.commanded() as command:
        taken = simulation.run(
            steps=options.steps,
            until=options.until,
            output=output,
            every=options.every,
            checkpoint_every=options.checkpoint_every,
            callback=dump,
            progress=not options.quiet,
            overwrite=options.overwrite,
            append=options.append,
        )
    if dump and dump.written is None:
        raise ValueError(f"--dump-problem {options.dump_problem}: no such step was made, {taken} were")
    if not options.quiet:
        if dump:
            print(f"the contact problem of step {dump.written}, error {dump.error:.2e}, is in {dump.path}")
        print(f"{taken} steps, t = {simulation.time:g} s, written to {output}")
    return command.status


def _strategy(options):
    from .run.strategies import NSCD, SOLVERS

    if options.solver is not None and options.solver not in SOLVERS:
        raise ValueError(f"--solver is {options.solver!r}: give one of {listed(SOLVERS, options.solver)}")
    solver = SOLVERS[options.solver or "Default"]
    return NSCD(solver=solver() if options.tol is None else solver(tol=options.tol))


def info(options):
    """`cairn info`."""
    from .post.container import restore_superblock
    from .post.summary import describe, render

    if options.repair:
        changed = restore_superblock(options.file)
        print("went back to the last state that was on the disk" if changed else "nothing to repair")
    if options.script:
        from .post.load import load

        with load(options.file) as run:
            print(run.provenance.get("script_text") or run.provenance.get("script") or "no script is stored")
        return 0
    facts = describe(options.file)
    if options.json:
        import json

        print(json.dumps(facts, indent=2, default=str))
    else:
        print(render(facts))
    return 0


def plot(options):
    """`cairn plot`."""
    import matplotlib

    matplotlib.use("Agg")
    from .post.load import load

    checks.count("every", options.every, 1)
    checks.count("dpi", options.dpi, 1)
    stem = os.path.splitext(options.file)[0]
    out = options.output or f"{stem}_{options.what}.png"
    with load(options.file) as run:
        if len(run):
            fields = [*run[-1].bodies.names, "speed", "spin", "forces", "energy", "residual"]
            if options.what not in fields:
                raise ValueError(f"there is no field {options.what!r}; there are {listed(fields, options.what)}")
        if os.path.splitext(out)[1].lower() in (".gif", ".mp4"):
            run.animate(out, options.what, every=options.every, dpi=options.dpi)
        elif options.what in ("energy", "residual"):
            _save(run.plot_energy() if options.what == "energy" else run.plot_residual(), out, options.dpi)
        else:
            if len(run) == 0:
                raise ValueError(f"{options.file} holds no output yet")
            i = options.step if options.time is None else run.at(options.time).index
            _save(run.plot_force_chains(i) if options.what == "forces" else run.plot(i, options.what), out, options.dpi)
    print(out)
    return 0


def _save(ax, path, dpi):
    from .post.errors import as_file_error

    try:
        ax.figure.savefig(path, dpi=dpi)
    except OSError as error:
        raise as_file_error(path, error) from error


def convert(options):
    """`cairn convert`."""
    from .post.convert import convert as write

    for path in write(options.file, options.out, what=options.what, step=options.step, overwrite=options.overwrite):
        print(path)
    return 0


def wrap_law(options):
    """`cairn wrap-law`."""
    from .plugs.wrap_law import wrap_law as write

    path, build = write(options.interface, **({"isolate": True} if options.isolate else {}))
    print(path)
    print(f"\nnow:  {build}")
    return 0


def verify(options):
    """`cairn verify`."""
    from .post.verify import verify as compare

    tolerances = None
    if options.tol:
        words = [t.partition("=") for t in options.tol]
        try:
            tolerances = {name: float(value) for name, _, value in words}
        except ValueError:
            raise ValueError(f"--tol {' '.join(options.tol)}: write NAME=VALUE, as in position=1e-4") from None
    result = compare(options.a, options.b, tolerances, until=options.until, size=options.size)
    print(result.table())
    if options.csv:
        import csv

        with open(options.csv, "w", newline="") as file:
            writer = csv.DictWriter(file, list(result.rows[0]))
            writer.writeheader()
            writer.writerows(result.rows)
    if options.output:
        import matplotlib

        matplotlib.use("Agg")
        _save(result.plot(), options.output, 120)
        print(options.output)
    return 0 if result.agrees else 3


def new_law(options):
    """`cairn new-law`."""
    from .plugs.new_law import build_line
    from .plugs.new_law import new_law as write

    paths = write(options.name, options.folder)
    for path in paths:
        print(path)
    print(f"\nnow:  cd {paths[0].parent}\n      {build_line(options.name)}\n      python run.py")
    return 0


def view(options):
    """`cairn view`."""
    from .post.load import load
    from .post.plots3d import view as show

    with load(options.file) as run:
        show(run, options.what)
    return 0


if __name__ == "__main__":
    sys.exit(main())
