"""Plots of the history of a run: its probes, its energy, its solver."""

import numpy as np

from ..names import listed, teach
from .drawing import COMPRESSION, TENSION, _axes, _pyplot, titled

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


def plot_energy(history, ax=None, title="Energy"):
    """Draw the energy terms over time, with the closure of the balance below. history : `run.history`."""
    terms = {name.removeprefix("energy_"): value for name, value in history.items() if name.startswith("energy_")}
    terms.pop("created", None)  # of the contacts of one step, not a term of the balance
    closure, scale = terms.pop("closure", None), terms.pop("in_play", None)
    for name in ("largest_kinetic", "turned_over"):
        terms.pop(name, None)
    ax = _axes(ax)
    for name, value in terms.items():
        if np.any(value != 0):
            ax.plot(history["time"], value, lw=1.3, label=name.replace("_", " "))
    ax.set(xlabel="time [s]", ylabel="energy [J]")
    if terms:
        ax.legend(fontsize=8, frameon=False)
    if closure is not None and len(closure):
        share = f", {abs(closure[-1]) / scale[-1]:.1e} of the energy in play" if scale is not None and scale[-1] > 0 else ""
        title = f"{title}: the balance closes to {abs(closure[-1]):.1e} J{share}"
    titled(ax, title)
    _plain(ax)
    return ax


def plot_residual(history, ax=None, title="Solver"):
    """Draw the error at the end of each step (logarithmic) and the iterations it took. Steps that did not converge are marked
    along the lower edge and counted in the title, so that many of them do not hide the error. history : `run.history`."""
    ax = _axes(ax)
    time, error = history["time"], np.asarray(history.get("error", np.full(len(history["time"]), np.nan)))
    positive = error > 0
    ax.semilogy(time[positive], error[positive], lw=0.8, color=COMPRESSION)
    if positive.any():  # steps of a few contacts are solved to rounding; they shall not flatten the rest
        ax.set_ylim(max(error[positive].min(), 1e-3 * np.median(error[positive])) / 2, 2 * error[positive].max())
    if "status" in history:
        bad = positive & ~np.isin(history["status"], ("converged", "no_contacts", ""))
        if bad.any():
            ax.plot(time[bad], np.full(bad.sum(), 0.02), "|", ms=6, mew=0.5, color="black", transform=ax.get_xaxis_transform())
            title = f"{title}   {bad.sum():,} of {len(time):,} steps not converged (marks below)".strip()
    ax.set(xlabel="time [s]", ylabel="error [-]")
    ax.yaxis.label.set_color(COMPRESSION)
    if "iterations" in history:
        other = ax.twinx()
        other.plot(time, history["iterations"], lw=0.8, color=TENSION, alpha=0.7)
        other.set_ylabel("iterations", color=TENSION)
        other.set_ylim(bottom=0)
        other.spines["top"].set_visible(False)
    titled(ax, title)
    ax.spines["top"].set_visible(False)
    return ax


def _plain(ax):
    ax.grid(alpha=0.25)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)


teach(globals())
