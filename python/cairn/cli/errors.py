"""Messages of the command after an error, and the exit status of each."""

import os
import sys

# modules that some commands need, and their names for pip
PACKAGES = {
    "PIL": "pillow", "coacd": "coacd", "gmsh": "gmsh", "ifcopenshell": "ifcopenshell", "manifold3d": "manifold3d",
    "matplotlib": "matplotlib", "meshio": "meshio", "networkx": "networkx", "pyvista": "pyvista", "scipy": "scipy",
    "shapely": "shapely", "trame": "trame", "trimesh": "trimesh", "vtkmodules": "vtk",
}


def _frames(error):
    """Frames that an error came through, the outermost first, each with the place of its instruction."""
    trace = error.__traceback__
    while trace is not None:
        yield trace.tb_frame, trace.tb_lasti, trace.tb_lineno
        trace = trace.tb_next


def meant_to_be_read(error):
    """True if Cairn raised the error by a statement of its own, or in its core: the message then suffices without a traceback."""
    import dis

    from .. import Error
    from ..base.errors import FileError

    frame, at, _ = list(_frames(error))[-1]
    code = frame.f_code
    if not os.path.abspath(code.co_filename).startswith(_package() + os.sep):
        return False
    return isinstance(error, (Error, FileError)) or dis.opname[code.co_code[at]] == "RAISE_VARARGS"


def _package():
    return os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def in_a_line(error):
    """The words of an error."""
    from ..base.errors import FileError, as_file_error

    if isinstance(error, ModuleNotFoundError) and (package := PACKAGES.get((error.name or "").partition(".")[0])):
        return f"{package} is needed for this: pip install {package}"
    if isinstance(error, OSError) and not isinstance(error, FileError) and error.errno and error.filename:
        error = as_file_error(error.filename, error)
    text = error.args[0] if isinstance(error, LookupError) and error.args else error
    return " ".join(str(text).splitlines())


def line_of(error, script):
    """'pile.py, line 12: ' of an error that came through this line of a script."""
    lines = [line for frame, _, line in _frames(error) if os.path.abspath(frame.f_code.co_filename) == os.path.abspath(script)]
    return f"{script}, line {lines[-1]}: " if lines else ""


def interrupted(error):
    """Says where the simulation at hand was, if it has not been said, and returns the exit status."""
    from ..run import launching
    from ..run.loop import Stopped
    from ..run.simulation import Simulation

    if isinstance(error, Stopped):  # said when the run ended
        return error.status
    if not launching.first():
        return 130
    found = [x for frame, _, _ in _frames(error) for x in frame.f_locals.values() if isinstance(x, Simulation)]
    at = f" at step {found[-1].steps}, t = {found[-1].time:g} s" if found else ""
    print(f"cairn: stopped by Ctrl-C{at}", file=sys.stderr)
    return 130


ON_ALL = 3.0  # [s] within which rank 0 tells an error that each rank may have found by itself


def told(error, script):
    """Prints an error of a command, or of the script that it runs; of several ranks one does, and ends the others. Returns the
    exit status."""
    ranks, launching = sys.modules.get("cairn.base.open_ranks"), sys.modules.get("cairn.run.launching")
    over = ranks is not None and launching is not None
    rank = launching.number_of_process() if over else 0
    place = "" if script is None else line_of(error, script)
    if over:
        teller = ranks.teller_of(error)
        ranks.leave_to(teller or 0, rank, ON_ALL)
        if teller == rank and error.__cause__ is not None:
            error = error.__cause__  # of this rank, of which all were told
    of_rank = f"rank {rank}: " if rank else ""
    usual = (OSError, ValueError, LookupError, TypeError, ImportError)
    if script is None and not (isinstance(error, usual) or meant_to_be_read(error)):
        raise error
    if script is not None and not meant_to_be_read(error):  # the script's own trouble: show where
        print(of_rank, end="", file=sys.stderr)
        show_own(error, script)
    else:
        print(f"cairn: error: {of_rank}{place}{in_a_line(error)}", file=sys.stderr, flush=True)
    if over:
        ranks.end_all()
    return 1


def show_own(error, script):
    """Prints Python's traceback of an error in a user's script from the script on, without Cairn's own frames before it."""
    import traceback

    trace = error.__traceback__
    while trace is not None and os.path.abspath(trace.tb_frame.f_code.co_filename) != os.path.abspath(script):
        trace = trace.tb_next
    traceback.print_exception(type(error), error, trace)


def save_picture(ax, path, dpi):
    """Saves the figure of some axes; trouble with the file becomes a FileError."""
    from ..base.errors import FileError, as_file_error

    try:
        kinds = ax.figure.canvas.get_supported_filetypes()
        ending = os.path.splitext(path)[1].lower().removeprefix(".")
        if ending not in kinds:
            raise FileError(path, f"pictures are no .{ending}", "give a name that ends in .png, .pdf, .svg or .jpg")
        ax.figure.savefig(path, dpi=dpi)
    except OSError as error:
        if isinstance(error, FileError):
            raise
        raise as_file_error(path, error, writing=True) from error
