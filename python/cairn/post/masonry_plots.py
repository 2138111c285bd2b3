"""Pictures of blocks and of their forces: outlines coloured by stress, joint forces as lines, thrust lines."""

import numpy as np

from .drawing import PALE, TENSION, _pyplot

THRUST = TENSION  # blue, since blocks are coloured from yellow to red


def outlines(structure, axes=(0, 2)):
    """The silhouette (m, 2) of each block where it is now, seen along the axis that is left out; polygons in 2D."""
    blocks = structure.blocks
    owner = np.repeat(np.arange(len(blocks)), [len(v) for v in blocks.vertices])
    points = structure.moved(np.concatenate(blocks.vertices), owner)
    stops = np.cumsum([len(v) for v in blocks.vertices])[:-1]
    pieces = np.split(points, stops)
    if structure.dim == 2:
        return pieces
    return [hull_2d(p[:, list(axes)]) for p in pieces]


def hull_2d(points):
    """Convex hull of points in a plane, anticlockwise (Andrew 1979)."""
    p = points[np.lexsort((points[:, 1], points[:, 0]))]

    def half(ordered):
        kept = []
        for q in ordered:
            while len(kept) > 1 and np.linalg.det([kept[-1] - kept[-2], q - kept[-2]]) <= 0:
                kept.pop()
            kept.append(q)
        return kept[:-1]

    return np.array(half(p) + half(p[::-1]))


def draw(structure, ax=None, what="stress", axes=(0, 2), forces=None, thrust=None, title=None, largest=None,
         label=None):  # fmt: skip
    """Draws blocks, coloured by "stress" (the largest compression [MPa]), "displacement" [mm], an array (n,) or nothing
    (None), with joint forces as lines whose width is their size, unless a thrust line is drawn or forces=False. thrust: chain of
    blocks, or list of chains, whose thrust lines are drawn, with a dot in each joint; largest: value at
    the end of the colours; label: of an array. Returns the Axes."""
    from matplotlib.collections import LineCollection, PolyCollection

    plt = _pyplot()
    shapes = outlines(structure, axes)
    low, high = np.min([s.min(axis=0) for s in shapes], axis=0), np.max([s.max(axis=0) for s in shapes], axis=0)
    if ax is None:
        ratio = (high - low)[1] / (high - low)[0]
        ax = plt.subplots(figsize=(14.0, float(np.clip(14 * ratio + 0.8, 3, 12))), layout="constrained")[1]
    free = ~structure.held
    values, told = field(structure, what)
    label = told if label is None else label
    ax.add_collection(PolyCollection([s for s, h in zip(shapes, structure.held) if h], facecolors="#8a8578", linewidths=0))
    front = [k for k in front_to_back(structure, axes) if free[k]]
    line = min(0.4, 40.0 / np.sqrt(len(shapes)) / 10)
    patches = PolyCollection([shapes[k] for k in front], edgecolors="#5a5346", linewidths=line, facecolors=PALE)
    if values is not None:
        patches.set(array=values[front], cmap="YlOrRd", clim=(0.0, largest or float(np.quantile(values[free], 0.995)) or 1.0))
        ax.figure.colorbar(patches, ax=ax, label=label, shrink=0.7, pad=0.01)
    ax.add_collection(patches)
    if forces if forces is not None else thrust is None:
        draw_forces(structure, ax, LineCollection, axes)
    if thrust is not None:
        draw_thrust(structure, ax, thrust, axes)
    room = 0.02 * np.max(high - low)
    names = [f"{'xyz'[k]} [m]" for k in (axes if structure.dim == 3 else (0, 1))]
    ax.set(aspect="equal", xlim=(low[0] - room, high[0] + room), ylim=(low[1] - room, high[1] + room), title=title)
    ax.set(xlabel=names[0], ylabel=names[1])
    return ax


def front_to_back(structure, axes):
    """Blocks in the order to draw, those nearest to the eye last."""
    if structure.dim == 2:
        return range(len(structure.blocks))
    away = next(k for k in range(3) if k not in axes)
    return np.argsort(-structure.places()[0][:, away], kind="stable")


def field(structure, what):
    """Values (n,) and their label."""
    if what is None or not isinstance(what, str):
        return what, ""
    if what == "displacement":
        return structure.displacement() * 1e3, "displacement [mm]"
    if what == "stress":
        return -np.linalg.eigvalsh(structure.stress())[:, 0] / 1e6, "largest compression [MPa]"
    raise ValueError(f'what is {what!r}: give "stress", "displacement", an array or None')


def draw_thrust(structure, ax, chains, axes):
    """Thrust lines on a white border, so that they are seen on every colour, with a dot where they cross a joint."""
    from matplotlib import patheffects

    if np.ndim(chains) == 0 and not isinstance(chains, (list, tuple)):
        raise ValueError(f"thrust is {chains!r}: give the numbers of a chain of blocks, from support to support, or several")
    chains = list(chains) if len(chains) and np.ndim(chains[0]) else [chains]
    for chain in chains:
        t = structure.thrust_line(chain)
        t = t if structure.dim == 2 else t[:, list(axes)]
        border = [patheffects.Stroke(linewidth=4.5, foreground="white"), patheffects.Normal()]
        ax.plot(*t.T, "-", color=THRUST, linewidth=2.0, path_effects=border, zorder=4)
        ax.plot(*t.T, "o", color=THRUST, markersize=4.5, markeredgecolor="white", markeredgewidth=0.8, zorder=5)


def draw_forces(structure, ax, collection, axes):
    """Lines from the centre of each block to the thrust in its joints, as wide as the force."""
    r = structure.resultants()
    loaded = r.pressure > 0
    center, thrust, size = structure.places()[0], r.thrust[loaded], np.linalg.norm(r.force[loaded], axis=1)
    if not len(size):
        return
    lines, widths = [], []
    for side in (0, 1):
        block = r.blocks[loaded, side]
        seen = ~structure.held[block]
        ends = np.stack((center[block], thrust), axis=1)[seen]
        lines.append(ends if structure.dim == 2 else ends[:, :, list(axes)])
        widths.append(size[seen])
    widths = np.concatenate(widths)
    widths = 2.5 * widths / np.quantile(widths, 0.999)
    ax.add_collection(collection(np.concatenate(lines), linewidths=widths, colors="#1d2733", alpha=0.55))
