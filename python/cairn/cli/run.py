"""`cairn run`: a Python script, or a scene that Scene.save wrote, run from the shell."""

import os
import sys

from ..names import listed


class Arguments(list):
    """sys.argv of a script, which keeps whether the script looked at more than its own name."""

    read = False

    def __getitem__(self, index):
        self.read |= index != 0
        return super().__getitem__(index)

    def __iter__(self):
        self.read = True
        return super().__iter__()

    def __len__(self):
        self.read = True
        return super().__len__()

    def __contains__(self, word):
        self.read = True
        return super().__contains__(word)

    def index(self, *given):
        self.read = True
        return super().index(*given)

    def pop(self, *index):
        self.read = True
        return super().pop(*index)

    def remove(self, word):
        self.read = True
        super().remove(word)

    def copy(self):
        self.read = True
        return super().copy()


def add_parser(add, commands):
    """The parser of `cairn run`."""
    run = add(
        commands,
        "run",
        "run a Python script, a scene that Scene.save wrote, or a JSON document",
        "cairn run pile.py                     what follows the script is for the script\n"
        "cairn run pile.py --overwrite         but for this: it replaces the files of runs that are there\n"
        "cairn run pile.py -- --overwrite      after -- all is for the script\n"
        "cairn run pile.scene.h5 --dt 1e-3 --until 2.0 --output pile.vtkhdf --every 20\n"
        "cairn run pile.scene.h5 --dt 1e-3 --steps 500 --restart pile.checkpoint.h5 --output more.vtkhdf\n"
        "cairn run pile.json                   a document, see cairn check",
    )
    run.add_argument("what", metavar="SCRIPT_OR_SCENE", help="a .py script, a scene file, or a .json document")
    run.add_argument("--dt", type=float, help="time step [s]")
    run.add_argument("--steps", type=int, help="steps to take")
    run.add_argument("--until", type=float, help="time to reach [s]")
    run.add_argument("--output", "-o", help="the .vtkhdf file to write (default: beside the scene)")
    run.add_argument("--every", type=int, default=20, help="steps between outputs (default: 20)")
    run.add_argument("--checkpoint-every", type=int, help="steps between checkpoints, written beside the output")
    run.add_argument("--restart", metavar="CHECKPOINT", help="go on from this checkpoint")
    run.add_argument("--overwrite", action="store_true", help="replace existing output files, those of a script too")
    run.add_argument("--append", action="store_true", help="go on in the output file; what is later than --restart is dropped")
    run.add_argument("--solver", help="contact solver by its name in Python: Default, NLGS, Auto, PPANewton, ...")
    run.add_argument("--tol", type=float, help="true error of the contact solver (default: 1e-4)")
    run.add_argument("--dump-problem", metavar="WHEN", help="step=120, or worst: write that contact problem beside the output")
    run.add_argument("--ranks", type=int, help="ranks that share the scene, by mpirun where there is one")
    run.add_argument("--quiet", "-q", action="store_true", help="no progress bar, no figures")


def main(options):
    """`cairn run`."""
    from ..run import launching
    from ..run import loop as runs

    if options.ranks is not None:
        return _over_ranks(options)
    launching.take_signals()
    if options.what.endswith(".py"):
        import runpy

        if options.passed_on is None:
            told = f"{options.what} is a script, which has a time step, files and options of its own"
            raise ValueError(f"{told}: give nothing before it but --overwrite; what stands behind it is for the script")
        if not os.path.isfile(options.what):
            raise SystemExit(f"cairn: error: {options.what}: no such script; check the path")
        sys.argv = arguments = Arguments([options.what, *options.passed_on])
        sys.path.insert(0, os.path.dirname(os.path.abspath(options.what)))
        with runs.commanded(options.overwrite) as command:
            try:
                runpy.run_path(options.what, run_name="__main__")
            except SystemExit as end:
                if command.stopped is None or end.code not in (None, 0):
                    raise
            except KeyboardInterrupt as late:
                if command.stopped is None:
                    raise
                raise runs.Stopped(command.status) from late  # the same signal, which another rank had first
        if options.passed_on and not arguments.read and launching.first():
            told = f"cairn: warning: {options.what} reads no options, so {' '.join(options.passed_on)} had no effect"
            print(f"{told}: set what they mean in the script, or read them from sys.argv there", file=sys.stderr)
        return command.status
    from ..model.scene import Scene
    from ..run.simulation import Simulation

    if options.what.endswith(".json"):
        return _document(options)
    scene = Scene.load(options.what)
    if options.dt is None:
        raise ValueError("a scene has no time step of its own: give one, --dt 1e-3 [s] say")
    if options.steps is None and options.until is None:
        raise ValueError("say how long to run: --steps 1000, or --until 2.0 [s]")
    simulation = Simulation(scene, dt=options.dt, strategy=_strategy(options))
    if options.restart:
        simulation.restore(options.restart)
        simulation.dt = options.dt
    stem = options.what
    for ending in (".h5", ".scene"):
        stem = stem.removesuffix(ending)
    output = options.output or stem + ".vtkhdf"
    dump = None
    if options.dump_problem:
        from ..run.contact_problem import Dump

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
    if not options.quiet and launching.first():
        if dump:
            print(f"the contact problem of step {dump.written}, error {dump.error:.2e}, is in {dump.path}")
        print(f"{taken} steps, t = {simulation.time:g} s, written to {output}")
    return command.status


def _over_ranks(options):
    """Runs the same command without --ranks over ranks."""
    from ..base import checks
    from ..run.launching import launch

    count = checks.count("--ranks", options.ranks, 1, 100_000)
    arguments = list(sys.argv[1:])
    at = next(k for k, word in enumerate(arguments) if word == "--ranks" or word.startswith("--ranks="))
    del arguments[at : at + (2 if arguments[at] == "--ranks" else 1)]
    return launch(count, arguments)


def _document(options):
    """Runs a scene that is a JSON document; options of the command come before those of the document."""
    from ..run import documents, launching
    from ..run import loop as runs

    document = documents.read(options.what)
    if options.dt is not None and isinstance(document, dict):
        document["simulation"] = {**(document.get("simulation") or {}), "dt": options.dt}
    simulation = documents.simulation_of(document)
    if options.solver is not None or options.tol is not None or options.dump_problem:
        raise ValueError("--solver, --tol and --dump-problem are for scene files: write the solver in the document")
    given = dict(document.get("run") or {})
    given |= {k: v for k, v in (("steps", options.steps), ("until", options.until), ("output", options.output),
                                ("checkpoint_every", options.checkpoint_every)) if v is not None}  # fmt: skip
    given |= {k: True for k in ("overwrite", "append") if getattr(options, k)}
    if options.steps is not None:
        given.pop("until", None)
    elif options.until is not None:
        given.pop("steps", None)
    if "steps" not in given and "until" not in given:
        raise ValueError("say how long to run: --steps 1000, or --until 2.0 [s]")
    given.setdefault("output", options.what.removesuffix(".json") + ".vtkhdf")
    given.setdefault("every", options.every)
    if options.restart:
        simulation.restore(options.restart)
    with runs.commanded() as command:
        taken = simulation.run(progress=not options.quiet, **given)
    if not options.quiet and launching.first():
        print(f"{taken} steps, t = {simulation.time:g} s, written to {given['output']}")
    return command.status


def _strategy(options):
    from ..options.solvers import SOLVERS
    from ..options.strategies import NSCD

    if options.solver is not None and options.solver not in SOLVERS:
        raise ValueError(f"--solver is {options.solver!r}: give one of {listed(SOLVERS, options.solver)}")
    solver = SOLVERS[options.solver or "Default"]
    return NSCD(solver=solver() if options.tol is None else solver(tol=options.tol))
