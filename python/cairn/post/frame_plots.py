"""Pictures in the plane of bars and beams, coloured by their section forces, and of bonds, with matplotlib."""

from collections import Counter

import numpy as np

from ..files import mesh_cells
from ..names import teach
from .drawing import LABELS, _axes, _view, contact_lines, draw_cell, draw_lines, draw_pale, paint, title_of, titled

SOUND, BROKEN = np.array([0.35, 0.35, 0.35]), np.array([0.78, 0.08, 0.08])


def plot_borne(step, what, values, ax, cmap, limits, colorbar, walls, title, view):
    """Bars and beams by a field of theirs, which other bodies do not have."""
    view = _view(step) if view is None else view
    ax = _axes(ax, view=view)
    draw_pale(ax, step, view, walls=walls)
    if walls:
        draw_cell(ax, step)
    drawn = draw_lines(ax, step.drawn["position"][mesh_cells.lines(step)])
    paint(ax, drawn, values, what, LABELS.get(what, what), step.run.scene, cmap, limits, colorbar)
    titled(ax, title_of(step) if title is None else title)
    return ax


def plot_bonds(step, ax=None, width=1.5, title=None, view=None, legend=True):
    """Draw pairs that their law holds as lines between the bodies, and those that broke; between nodes and sides of meshes, whose
    cells are drawn, as short lines along the side.

    Sound ones grey, the darker red the less is left of them (`beta`), broken ones in contact with released energy as thin red
    lines. All that broke are counted that an output up to this one had whole, those that are still near and drawn among them.
    width : of a sound one [points]. legend : whether the colours are told beside. Returns the Axes. 2D only; raises ValueError
    where the run has no such law.
    """
    from matplotlib.collections import LineCollection

    if step.dim == 3:
        raise ValueError("bonds are drawn in 2D; for 3D open the file in ParaView and colour the block contacts by beta")
    if "beta" not in step.contacts:
        raise ValueError("no law of this run holds bodies together: there is no field 'beta' among its contacts")
    view = _view(step) if view is None else view
    ax = _axes(ax, view=view)
    draw_pale(ax, step, view)
    beta, lines = step.contacts["beta"], _seen(step, contact_lines(step), mesh_cells.outlines(step)[0])
    broken = (beta == 0) & (step.contacts["released"] > 0)
    shade = np.clip(beta, 0, 1)[:, None]
    colors = shade * SOUND + (1 - shade) * BROKEN
    for some, wide in ((beta > 0, width), (broken, 0.5 * width)):
        ax.add_collection(LineCollection(lines[some], linewidths=wide, colors=colors[some], capstyle="round"), autolim=False)
    near = np.count_nonzero(broken)
    lost = max(_lost(step), near)
    text = f"{np.count_nonzero(beta > 0)} hold, {lost} broken" + (f" ({near} still near)" if near < lost else "")
    if legend:
        from matplotlib.lines import Line2D

        shades = [(1.0, width, "whole (beta 1)"), (0.5, width, "beta 0.5"), (0.0, 0.5 * width, "broken, near")]
        told = [Line2D([], [], color=share * SOUND + (1 - share) * BROKEN, lw=wide, label=word) for share, wide, word in shades]
        ax.legend(handles=told, fontsize=8, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0), handlelength=1.2)
    titled(ax, f"{title_of(step)}   {text}" if title is None else title)
    return ax


def _lost(step):
    """How many of the pairs that held in an output up to this one do so no more, among bodies that are still there."""
    most, ids, run = Counter(), np.asarray(step.drawn["id"]), step.run
    for k in range(step.index + 1):
        for pair, many in _held(run[k], ids).items():
            most[pair] = max(most[pair], many)
    return sum((most - _held(step, ids)).values())


def _held(step, ids):
    """How many contacts hold between each pair of bodies that are among ids."""
    contacts = step.contacts
    a, b = contacts["body_a"], contacts["body_b"]
    held = (contacts["beta"] > 0) & np.isin(a, ids) & np.isin(b, ids)
    return Counter(zip(np.minimum(a, b)[held].tolist(), np.maximum(a, b)[held].tolist()))


def _seen(step, lines, cells):
    """Lines of contacts, where they have no length a quarter of a side of the cells along the contact."""
    if not cells:
        return lines
    side = np.median([np.linalg.norm(np.diff(corners[:2], axis=0)) for corners in cells])
    normal, none = step.contacts["normal"], np.all(lines[:, 0] == lines[:, 1], axis=1)
    along = side / 4 * np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    return np.where(none[:, None, None], lines + np.stack([-along, along], axis=1) / 2, lines)


teach(globals())
