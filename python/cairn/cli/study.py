"""`cairn study`: the trade between speed and accuracy, measured from the shell."""

from __future__ import annotations

DESCRIPTION = "measure the trade between speed and accuracy of a scene or of problems, and recommend a setting"
EXAMPLES = """\
cairn study pile.py --duration 0.5 --accuracy 1e-2 --of solid_fraction
                                             pile.py defines build() -> cn.Scene
cairn study pile.py:seed=1 pile.py:seed=2 pile.py:friction=0.6 --accuracy 1e-2 --of solid_fraction
                                             a setting for other scenes of the kind
cairn study pile.scene.h5 --dt 1e-3 --prepare 1.0 --accuracy 1e-3 --of step_velocity
cairn study pile.py --solvers NLGS --tolerances 1e-1 1e-2 1e-3 --dt-factors 0.5 1 2 --warm-start both --plot
cairn study bar.py --meshes 8 16 --reference-mesh 64 --integrators "HHT(alpha=-0.1)" "Theta(theta=0.5)" --dt-factors 1 2 --plot
                                             bar.py defines build(mesh=8) -> cn.Scene
cairn study pile.py --solvers NLGS --tolerances 1e-4 --accuracies 1e-2 1e-3 1e-5 --accelerations nesterov none --in-time
                                             what steps tell of their own errors, against the truth
cairn study *.hdf5 --solvers nlgs --tolerances 1e-4 1e-8 --accuracy 1e-4 --of true_error --plot
cairn study pile.py --plan                   what would be done, and what is done already"""


def add_parser(add, commands):
    """The parser of `cairn study`; add: how the command line makes one."""
    parser = add(commands, "study", DESCRIPTION, EXAMPLES)
    parser.add_argument(
        "what", nargs="+", metavar="SCENE_OR_PROBLEM",
        help="scenes, .py files with build() (pile.py:disks=30,seed=2 gives it options), or problems",
    )
    parser.add_argument("--folder", "-o", help="for rows, tables and pictures (default: NAME.study beside the first)")
    parser.add_argument("--workers", "-j", type=int, help="processes side by side (default: cores)")
    parser.add_argument("--plan", action="store_true", help="say what would be done, and end")
    parser.add_argument("--plot", action="store_true", help="draw work-precision plots, and profiles of several targets")
    parser.add_argument("--quiet", "-q", action="store_true", help="no progress bar")
    asked = parser.add_argument_group("what is wanted")
    asked.add_argument("--accuracy", type=float, help="relative error to stay within")
    asked.add_argument("--of", metavar="FIGURE", help="figure that is to be accurate: of --figure, step_velocity, ...")
    asked.add_argument("--figure", action="append", metavar="FIGURE", help="to measure (again for more); 'list' lists them")
    asked.add_argument("--here", action="store_true", help="on these scenes alone, without a margin for others like them")
    sweep = parser.add_argument_group("what is swept")
    sweep.add_argument("--solvers", nargs="+", help="default: all that there are")
    sweep.add_argument("--tolerances", nargs="+", type=float, default=(1e-1, 1e-2, 1e-3, 1e-4), help="default: 1e-1 to 1e-4")
    sweep.add_argument("--dt-factors", nargs="+", type=float, default=(1.0,), help="factors of the time step (default: 1)")
    sweep.add_argument("--warm-start", choices=("on", "off", "both"), default="both", help="default: both")
    sweep.add_argument("--integrators", nargs="+", default=("",), metavar="CALL", help="'HHT(alpha=-0.1)' (default: the scene's)")
    sweep.add_argument("--accuracies", nargs="+", type=float, default=(0.0,), metavar="A",
                       help="accuracies of velocities, NSCD(accuracy=A); 0: none (default: 0)")  # fmt: skip
    sweep.add_argument("--accelerations", nargs="+", choices=("nesterov", "none"), default=("",), help="sweeps of NLGS")
    sweep.add_argument("--meshes", nargs="+", type=float, default=(0.0,), metavar="N", help="for build(mesh=N)")
    sweep.add_argument("--network-tolerances", nargs="+", type=float, default=(0.0,), help="default: the scene's")
    sweep.add_argument("--couplings", nargs="+", default=("",), metavar="C", help="staggered or numbers (default: the scene's)")
    sweep.add_argument("--min-iter", nargs="+", type=int, default=(1,), help="fewest iterations of a step (default: 1)")
    sweep.add_argument("--max-iter", type=int, default=10_000, help="most iterations of a step (default: 10000)")
    how = parser.add_argument_group("how it is measured")
    how.add_argument("--dt", type=float, help="time step of the scene [s]")
    how.add_argument("--option", action="append", default=[], metavar="NAME=VALUE", help="for build() of a .py file")
    how.add_argument("--prepare", type=float, help="time to the last common state [s] (default: PREPARE of the .py, or 0)")
    how.add_argument("--states", type=int, default=4, help="common states for one step (default: 4)")
    how.add_argument("--duration", type=float, help="time of the perturbed runs [s] (default: DURATION of the .py, or none)")
    how.add_argument("--runs", type=int, default=8, help="perturbed runs, at least 8 (default: 8)")
    how.add_argument("--perturbation", type=float, default=1e-4, help="random shift of bodies, over their radius (default: 1e-4)")
    how.add_argument("--averaged", type=float, default=0.5, help="share of a run that is averaged, its last (default: 0.5)")
    how.add_argument("--samples", type=int, default=40, help="states of a run to average (default: 40)")
    how.add_argument("--reference-tol", type=float, help="tolerance of the reference (default: a tenth of the tightest)")
    how.add_argument("--reference-mesh", type=float, metavar="N", help="mesh of the reference (default: the finest)")
    how.add_argument("--no-one-step", action="store_true", help="leave out the comparison of one step")
    how.add_argument("--in-time", action="store_true",
                     help="set the error in time that a step tells (time_error) against eight steps of an eighth")  # fmt: skip
    how.add_argument("--max-seconds", type=float, help="CPU seconds of a run at most")


def main(options):
    """Runs the command; 0 done, 3 if an accuracy was asked for and nothing can be recommended, 130 stopped."""
    from ..study.figures import SUMMARY
    from ..study.study import run

    if options.figure == ["list"]:
        for name, summary in SUMMARY.items():
            print(f"{name:20s} {summary}")
        return 0
    if options.accuracy is not None and not 0 < options.accuracy < 1:
        raise ValueError(f"--accuracy is {options.accuracy}: give a relative error between 0 and 1, 1e-2 say")
    if (options.accuracy is None) != (options.of is None):
        raise ValueError("--accuracy and --of go together: --accuracy 1e-2 --of solid_fraction")
    call = dict(_call(options))
    if options.plan:
        return _plan(options, call)
    s = run(call.pop("what"), options.folder, progress=not options.quiet, workers=options.workers, **call)
    print(s)
    if not s.whole:
        return 130
    if options.plot:
        _plot(s, options)
    print(f"tables: {s.folder / 'table.csv'}, {s.folder / 'study.h5'}")
    if options.accuracy is None:
        return 0
    found = s.recommend(options.accuracy, options.of, options.here)
    print(found)
    return 0 if found else 3


def _call(options):
    figures = options.figure
    if figures is None and options.of and not options.of.startswith("step_"):
        figures = None if options.of in ("true_error", "velocity") else [options.of]
    yield "what", [_with_options(text) for text in options.what]
    yield "figures", figures
    yield "options", dict(_pair(text) for text in options.option)
    yield "dt", options.dt
    warm = {"on": (True,), "off": (False,), "both": (True, False)}[options.warm_start]
    yield (
        "sweep",
        {
            "solvers": options.solvers, "tolerances": tuple(options.tolerances), "dt_factors": tuple(options.dt_factors),
            "warm_start": warm, "min_iter": tuple(options.min_iter), "max_iter": options.max_iter,
            "integrators": tuple(options.integrators), "meshes": tuple(options.meshes),
            "network_tolerances": tuple(options.network_tolerances),
            "couplings": tuple(options.couplings), "accuracies": tuple(options.accuracies),
            "accelerations": tuple(options.accelerations),
        },
    )
    for name in ("prepare", "states", "duration", "runs", "perturbation", "averaged", "samples", "reference_tol",
                 "reference_mesh", "max_seconds"):  # fmt: skip
        yield name, getattr(options, name)
    yield "one_step", not options.no_one_step
    yield "in_time", options.in_time


def _with_options(text):
    """pile.py, or (pile.py, options) of pile.py:disks=30,seed=2."""
    path, ending, options = text.partition(".py:")
    return (path + ".py", dict(_pair(word) for word in options.split(","))) if ending else text


def _pair(text):
    """('disks', 30) of 'disks=30'."""
    import ast

    name, equals, value = text.partition("=")
    if not equals:
        raise ValueError(f"{text!r} is no option of build(): give NAME=VALUE, disks=30 say")
    try:
        return name, ast.literal_eval(value)
    except (ValueError, SyntaxError):
        return name, value  # a text


def _plan(options, call):
    from ..study.study import planned

    for kind, (total, missing) in planned(call.pop("what"), options.folder, **call).items():
        print(f"{kind:20s} {total:6d}, of which {missing} are to be made")
    return 0


def _plot(s, options):
    targets = {row["target"] for row in s.table}
    for figure in s.measured:
        path = s.folder / f"{figure}.png"
        s.plot(figure, path, options.accuracy if figure == options.of else None)
        print(path)
    if len(targets) > 1 and options.accuracy is not None:
        path = s.folder / f"profile_{options.of}.png"
        try:
            s.plot_profile(options.accuracy, options.of, path)
            print(path)
        except ValueError as error:
            print(f"no profile: {error}")
