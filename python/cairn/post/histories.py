"""Pictures of what a run recorded at every step: its probes, its energy, its solver."""

import numpy as np

from ..names import listed, teach
from .plots import COMPRESSION, TENSION, _plain, _pyplot, plot_energy, plot_residual

COLOURS = (COMPRESSION, TENSION, "#4f6d7a", "#b8860b", "#6b7a4f", "#7a4b2a")


def plot_history(run, *names, title=None):
    """Draws columns of the history over time, a panel each, one below the other.

    names: columns of `run.history`, each alone or several as a tuple that share a panel; "energy" and "error" stand for the
    balance and for the solver with its iterations. Without any: the probes of the run, the energy, the error. Returns the Axes,
    a list. Raises KeyError for a column that is not there.
    """
    history, plt = run.history, _pyplot()
    if not names:
        probes = run.scene.get("probes", ())
        names = [*([probes] if isinstance(probes, str) else probes), "energy", "error"]
    panels = [(name,) if isinstance(name, str) else tuple(name) for name in names]
    for panel in panels:
        for name in panel:
            if name not in history and name != "energy":
                raise KeyError(f"the history has no column {name!r}; it has energy, {listed(history, name)}")
            if name != "energy" and history[name].dtype.kind not in "biuf":
                raise ValueError(f"column {name!r} of the history holds words: give one of numbers")
    size = (8.0, 0.6 + 1.9 * len(panels))
    axes = plt.subplots(len(panels), 1, sharex=True, figsize=size, layout="constrained", squeeze=False)[1][:, 0]
    for ax, panel in zip(axes, panels):
        if panel == ("energy",):
            plot_energy(history, ax=ax)
        elif panel == ("error",):
            plot_residual(history, ax=ax)
        else:
            for name, colour in zip(panel, COLOURS * len(panel)):
                ax.plot(history["time"], np.asarray(history[name], float), lw=1.2, color=colour, label=name.replace("_", " "))
            ax.set_ylabel(panel[0].replace("_", " ") if len(panel) == 1 else "")
            if len(panel) > 1:
                ax.legend(fontsize=8, frameon=False)
            _plain(ax)
        ax.label_outer()
    axes[-1].set_xlabel("time [s]")
    if title is not None:
        axes[0].figure.suptitle(title, fontsize=10)
    return list(axes)


teach(globals())
