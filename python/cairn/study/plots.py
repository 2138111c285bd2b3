"""Pictures of a study: error against work, and performance profiles."""

from __future__ import annotations

import numpy as np

MARKERS = "os^DvP*X"
MOST_BELOW = 2  # names of curves in the legend below a single picture
FAR_BELOW = 100.0  # times a noise floor that no error comes near


def work_precision(table, of, accuracy=None):
    """Error of a figure against CPU seconds, an axes for each target, one curve a solver through its best settings.

    Each setting is a mark (hollow: cold start; shape by time step) at its error, with its upper bound above. One legend below
    serves all axes; the title of each names its noise floor, which is grey.
    """
    from matplotlib.figure import Figure

    rows = [row for row in table if row["figure"] == of]
    if not rows:
        known = ", ".join(dict.fromkeys(row["figure"] for row in table))
        raise ValueError(f"the study has no figure {of!r}: it has {known}")
    targets = list(dict.fromkeys(row["target"] for row in rows))
    solvers = list(dict.fromkeys(_curve(row) for row in rows))
    columns = 2 if len(targets) in (2, 4) else min(len(targets), 3)
    lines = -(-len(targets) // columns)
    beside = columns == 1 and len(solvers) > MOST_BELOW  # a long legend stands on the right
    size = (9.0, 4.2) if beside else (4.6 * columns, 3.9 * lines + 0.8)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(lines, columns, squeeze=False).ravel()
    named = {}
    for ax, target in zip(axes, targets):
        here = [row for row in rows if row["target"] == target]
        _one_target(ax, here, solvers)
        floor = max(row["floor"] for row in here)
        least = min((row["error"] for row in here if row["error"] > 0), default=np.inf)
        told = f"{target}\nnoise floor {floor:.1g}" if np.isfinite(floor) and floor > 0 else target
        if 0 < floor < least / FAR_BELOW:  # a scene nearly insensitive to its initial state
            told += ", below the picture"
        elif np.isfinite(floor) and floor > 0:
            ax.set_ylim(bottom=min(ax.get_ylim()[0], floor / 2))
            ax.axhspan(ax.get_ylim()[0], floor, color="grey", alpha=0.15, lw=0, label="below the noise floor")
        if accuracy is not None:
            ax.axhline(accuracy, color="black", lw=0.8, ls=":", label=f"asked {accuracy:g}")
        ax.set_title(told, fontsize=10)
        ax.set(xlabel=_cost(here[0]["kind"]), ylabel=f"error of {of} [-]")
        for axis in (ax.xaxis, ax.yaxis):
            few_ticks(axis)
        named |= {name: handle for handle, name in zip(*ax.get_legend_handles_labels()) if name not in named}
    place, across = ("right upper", 1) if beside else ("lower center", min(len(named), 2 * columns))
    figure.legend(named.values(), named.keys(), loc=f"outside {place}", ncols=across, fontsize=10, frameon=False)
    for ax in axes[len(targets) :]:
        ax.set_axis_off()
    return figure


def _curve(row):
    """Label of a curve: solver, with integrator, mesh and settings of networks where these were swept."""
    words = [row["solver"], row.get("integrator") or ""]
    words += [f"accuracy {row['accuracy']:g}"] if row.get("accuracy") else []
    words += [{"none": "plain"}.get(row["acceleration"], row["acceleration"])] if row.get("acceleration") else []
    words += [f"mesh {row['mesh']:g}"] if row.get("mesh") else []
    words += [f"network {row['network_tol']:g}"] if row.get("network_tol") else []
    words += [f"coupling {row['coupling']}"] if row.get("coupling") else []
    return " ".join(word for word in words if word)


def _cost(kind):
    return f"CPU time of a {({'statistics': 'run', 'step': 'step'}).get(kind, 'solve')} [s]"


def _one_target(ax, rows, solvers):
    factors = sorted({row["dt_factor"] for row in rows})
    ax.set(xscale="log", yscale="log")
    for k, solver in enumerate(solvers):
        mine = [row for row in rows if _curve(row) == solver and row["error"] > 0]
        colour = f"C{k % 10}"
        for row in mine:
            marker = MARKERS[factors.index(row["dt_factor"]) % len(MARKERS)]
            face = colour if row["warm_start"] else "none"
            above = row["upper"] - row["error"] if np.isfinite(row["upper"]) else 0.0
            bar = [[0.0], [max(above, 0.0)]]
            ax.errorbar(row["cpu_seconds"], row["error"], yerr=bar, fmt=marker, ms=5, color=colour, mfc=face, lw=0.6)
        best = pareto([row["cpu_seconds"] for row in mine], [row["error"] for row in mine])
        if len(best):
            ax.plot([mine[i]["cpu_seconds"] for i in best], [mine[i]["error"] for i in best], color=colour, lw=1.4, label=solver)
    if not all(row["warm_start"] for row in rows):
        ax.plot([], [], MARKERS[0], color="grey", mfc="none", ms=5, label="hollow: cold start")
    if len(factors) > 1:
        for factor in factors:
            marker = MARKERS[factors.index(factor) % len(MARKERS)]
            ax.plot([], [], marker, color="grey", ms=5, label=f"step of {factor:g} dt")


def few_ticks(axis):
    """Few numbers along a logarithmic axis, and none at small ticks, where they would lie on one another."""
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

    low, high = sorted(axis.get_view_interval())
    if high < 5 * low:
        axis.set_major_locator(MaxNLocator(4))
    else:
        axis.set_major_locator(LogLocator(subs=(1.0,) if high > 100 * low else (1.0, 2.0, 5.0), numticks=7))
    axis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:.3g}"))
    axis.set_minor_formatter(NullFormatter())


def pareto(cost, error):
    """Places of the points that no other beats in both, by rising cost."""
    best, least = [], np.inf
    for i in np.lexsort((error, cost)):
        if error[i] < least:
            best.append(int(i))
            least = error[i]
    return best


def profile(profiles, of, accuracy):
    """Performance profiles as stairs."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.6, 4.0), layout="constrained")
    ax = figure.subplots()
    end = 2 * max(tau[-1] for tau, _ in profiles.values())
    for name, (tau, share) in profiles.items():
        ax.step(np.append(tau, end), np.append(share, share[-1]), where="post", label=name)
    ax.set(xscale="log", xlabel="CPU time over the least", ylabel="share of the problems solved", ylim=(-0.02, 1.02))
    ax.set_title(f"{of} to {accuracy:g}")
    ax.legend(fontsize=8, frameon=False)
    return figure
