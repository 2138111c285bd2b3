"""Films of runs: every output drawn from the same view, with the same scale of colours."""

import contextlib

import numpy as np

from ..base import checks
from ..base.errors import FileError
from ..names import teach
from .drawing import CATEGORIES, _axes, _pyplot, _view, field_values, value_limits
from .plots import plot_force_chains, plot_step


def animate(run, path, what="velocity", every=1, fps=15, dpi=100, figsize=None, limits=None, view=None, camera=None, **options):
    """Write all outputs of a run (each `every`-th) as a .gif, or as an .mp4 by ffmpeg (`pip install imageio-ffmpeg` brings one).

    what : a field as for `plot_step`, or "forces" for force chains. Colours and view are those of the whole run. camera : in 3D,
    as for `plot_step`; or a list of such (place, point looked at), a path along which it moves evenly from the first output to
    the last; or a function of the share of the film, 0 to 1, that gives one.
    """
    from matplotlib import animation

    checks.count("every", every, 1), checks.positive("fps", fps), checks.positive("dpi", dpi)
    path, plt = str(path), _pyplot()
    extension = path.rpartition(".")[2].lower()
    if extension not in ("gif", "mp4"):
        raise FileError(path, "an animation is a .gif or an .mp4", "choose one of these")
    if extension == "mp4" and not animation.FFMpegWriter.isAvailable() and not _brought_ffmpeg(plt):
        remedy = "pip install imageio-ffmpeg, or write a .gif"
        raise FileError(path, "an .mp4 needs the program ffmpeg, which is not there", remedy)
    steps = range(0, len(run), every)
    if not len(steps):
        raise FileError(run.path, "this run holds no output yet", "run the simulation first")
    if run.dim == 2 and view is None:
        view = _view_of_run(run, steps)
    if limits is None and not (isinstance(what, str) and what in (*CATEGORIES, "forces")):
        sample = [field_values(run[k], what)[0] for k in _few(steps)]
        limits = value_limits(np.concatenate(sample), what)
    if run.dim == 3 and camera is None:
        camera = _camera_of_run(run, steps)
    figure = _axes(None, view=view).figure if figsize is None else plt.figure(figsize=figsize, layout="constrained")
    writer = animation.PillowWriter(fps=fps) if extension == "gif" else animation.FFMpegWriter(fps=fps)
    writer.setup(figure, path, dpi)
    try:
        for shown, k in enumerate(steps):
            figure.clear()
            ax = figure.add_subplot()
            extra = {"view": view} if run.dim == 2 else {"camera": camera_at(camera, shown / max(len(steps) - 1, 1))}
            if what == "forces":
                plot_force_chains(run[k], ax=ax, **extra, **options)
            else:
                plot_step(run[k], what, ax=ax, limits=limits, **extra, **options)
            writer.grab_frame()
    except BaseException:
        with contextlib.suppress(Exception):  # closing a film without pictures raises, and would hide the first error
            writer.finish()
        raise
    else:
        writer.finish()
    finally:
        plt.close(figure)
    return path


def _brought_ffmpeg(plt):
    """True if imageio-ffmpeg brings an ffmpeg; sets matplotlib's path to it."""
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        plt.rcParams["animation.ffmpeg_path"] = get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        return False
    return True


def camera_at(camera, share):
    """The camera of a film at a share of its length: from a function, interpolated along a path of cameras, or fixed."""
    if callable(camera):
        return camera(share)
    places = np.asarray(camera, float) if camera is not None else None
    if places is None or places.ndim < 3:
        return camera
    if places.shape[1:] != (2, 3):
        raise ValueError(f"camera has shape {places.shape}: give a list of (place, point looked at), (k, 2, 3) [m]")
    at = share * (len(places) - 1)
    k = min(int(at), len(places) - 2) if len(places) > 1 else 0
    return places[k] if len(places) == 1 else places[k] + (at - k) * (places[k + 1] - places[k])


def _few(steps, most=12):
    """At most a dozen of the steps, evenly spread, with the last."""
    return [steps[i] for i in np.unique(np.linspace(0, len(steps) - 1, most).astype(int))]


def _camera_of_run(run, steps):
    """A place from which all bodies of the run are seen, so that the camera stands still in a film."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for k in _few(steps):
        place, radius = run[k].drawn["position"], run[k].drawn["radius"][:, None]
        moves = np.isfinite(run[k].drawn["mass"]) if "mass" in run[k].drawn else np.ones(len(place), bool)
        if moves.any():
            low, high = np.minimum(low, (place - radius)[moves].min(0)), np.maximum(high, (place + radius)[moves].max(0))
    if not np.all(np.isfinite(low)):
        return None
    middle, way = (low + high) / 2, np.array((1.0, -1.6, 0.8)) / np.linalg.norm((1.0, -1.6, 0.8))
    return np.array([middle + way * np.linalg.norm(high - low) / 2 / np.sin(np.radians(14.0)), middle])


def _view_of_run(run, steps):
    """Limits that hold all disks and polygons of the run."""
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for k in _few(steps):
        seen = _view(run[k])
        low, high = np.minimum(low, seen[:, 0]), np.maximum(high, seen[:, 1])
    return np.stack([low, high], axis=1)


teach(globals())
