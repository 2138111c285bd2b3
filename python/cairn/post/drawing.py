"""Parts of pictures: colours, labels, axes, bodies, walls and contacts, by matplotlib."""

import numpy as np

from .. import _core
from ..base.geometry import contactors_of, lever_arms
from ..files import mesh_cells
from . import joint_marks
from .shape_meshes import outlines_of

COMPRESSION, TENSION, WALL, PALE = "#8c1515", "#1f4e9c", "#3b3b3b", "#d9d4c7"
# one colour per layer or material: told apart also by those who do not see red and green
CLASSES = ("#c8a165", "#7a4b2a", "#e3cfa0", "#4f6d7a", "#a9bcc4", "#93432e", "#6b7a4f", "#d8b4a0", "#2e4756", "#b8860b")
CATEGORIES = ("material", "layer", "group", "shape")
LABELS = {
    "velocity": "speed [m/s]",
    "rotation": "rotation [rad]",
    "spin": "spin [rad/s]",
    "radius": "radius [m]",
    "mass": "mass [kg]",
    "temperature": "temperature [K]",
    "potential": "potential [V]",
    "stress": "stress, norm [Pa]",
    "stress_zz": "stress zz [Pa]",
    "strain": "strain, norm [-]",
    "von_mises": "von Mises stress [Pa]",
    "contact_pressure": "contact pressure [Pa]",
    "axial_force": "axial force [N]",
    "shear_force": "shear force, largest [N]",
    "bending_moment": "bending moment, largest [N m]",
    "torsion_moment": "torsion moment [N m]",
    "accumulated_plastic_strain": "accumulated plastic strain [-]",
}
AT_REST = 1e-5  # share of the speed gained by gravity in a step
THICKEST = 3  # times the width of the mean force, in pictures of forces
NOISE = 1e-12  # relative to the values: a smaller spread is rounding


AXES = {2: ("xx", "yy", "xy"), 3: ("xx", "yy", "zz", "xy", "yz", "zx")}


def _pyplot():
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise ImportError("pictures need matplotlib: pip install matplotlib") from error
    return plt


def _axes(ax, figsize=(8.0, 5.0), view=None):
    """Axes to draw in; a new figure has the proportions of the view."""
    if ax is not None:
        return ax
    if view is not None:
        (x0, x1), (y0, y1) = view
        figsize = (9.0, float(np.clip(7.5 * (y1 - y0) / (x1 - x0) + 0.9, 2.2, 9.0)))
    return _pyplot().subplots(figsize=figsize, layout="constrained")[1]


def field_values(step, what):
    """(values, label) of a field of the bodies as one number each: a vector gives its length, velocity the speed.

    what : name of a field, or an array (n,) of one's own.
    """
    if not isinstance(what, str):
        values = np.asarray(what, dtype=float)
        if values.shape != (len(step.drawn),):
            raise ValueError(f"what has shape {values.shape}; it must be ({len(step.drawn)},), a number per body")
        return values, ""
    if what == "von_mises":
        across = step.drawn["stress_zz"] if step.dim == 2 and "stress_zz" in step.drawn else None
        return von_mises(step.drawn["stress"], across), LABELS[what]
    if what not in (*step.drawn.names, "speed") and len(step.fluid) and what in step.fluid:
        calls = f"cairn.post.fluid_plots.plot_fluid(step, {what!r}) draws it, `cairn plot --what {what}` in the shell"
        raise ValueError(f"{what} is a field of the liquid, and of no body: {calls}")
    stem, _, part = what.rpartition("_")
    if what not in step.drawn and stem in ("stress", "strain") and part in AXES[step.dim]:
        return step.drawn[stem][:, AXES[step.dim].index(part)], f"{stem} {part} [{'Pa' if stem == 'stress' else '-'}]"
    values = step.drawn["velocity" if what == "speed" else what]
    if what in ("velocity", "speed"):
        return np.linalg.norm(values[:, : step.dim], axis=1), LABELS["velocity"]
    if what == "rotation" and step.dim == 3:
        # atan2 keeps its digits at small angles; w and -w are the same rotation
        return 2.0 * np.arctan2(np.linalg.norm(values[:, 1:], axis=1), np.abs(values[:, 0])), LABELS["rotation"]
    if values.ndim == 2:
        values = np.linalg.norm(values, axis=1)
    return values, LABELS.get(what, what)


def von_mises(stress, across=None):
    """Equivalent stress (n,) of (n, 3 | 6) in the order xx yy [zz] xy [yz zx]. across: zz (n,) of stresses (n, 3), else none."""
    x, y = stress[:, 0], stress[:, 1]
    none = np.zeros(len(x)) if across is None else across
    z = none if stress.shape[1] == 3 else stress[:, 2]
    shear = stress[:, 2:] if stress.shape[1] == 3 else stress[:, 3:]
    return np.sqrt(((x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2) / 2 + 3 * (shear**2).sum(axis=1))


def title_of(step):
    """Time and number of a step, in words."""
    return f"t = {step.time:.4g} s   step {step.step:,}   {counted(step)}"


def counted(step):
    """How many bodies and meshes a step has: nodes of meshes are no bodies, nor are the ends of joints on the world."""
    many, nodes = len(step.bodies) - np.count_nonzero(joint_marks.bodies_of_joints(step)), len(step.nodes)
    meshes = len(step.run.scene.get("meshes") or {})
    words = [f"{many:,} {'body' if many == 1 else 'bodies'}"] if many or not nodes else []
    words += [f"{meshes:,} mesh{'es' * (meshes > 1)} of {nodes:,} nodes" if meshes else f"{nodes:,} nodes"] if nodes else []
    return ", ".join(words)


def titled(ax, text):
    """Gives axes a title, on several lines where one would run into the axes beside."""
    spec = ax.get_subplotspec()
    spec = spec and spec.get_topmost_subplotspec()  # a scale of colours puts one within it
    columns = 1 if spec is None else spec.get_gridspec().ncols / len(spec.colspan)
    room = int((ax.figure.get_size_inches()[0] / columns - 0.6) / 0.078)  # characters of 10 points
    lines = [""]
    for part in text.replace(", ", ",   ").split("   "):
        longer = f"{lines[-1]}   {part}".lstrip()
        lines = [*lines[:-1], longer] if len(longer) <= room or not lines[-1] else [*lines, part]
    ax.set_title("\n".join(lines).replace(",   ", ", "), fontsize=10, loc="left")


def draw_pale(ax, step, view, bodies=True, walls=True):
    """Draws all bodies in a pale colour, walls in theirs, as a background. Returns disks and outlines of polygons."""
    hidden, contactors = mesh_cells.shown_by_cells(step), contactors_of(step)
    contactors = contactors.where(~joint_marks.of_contactors(step, contactors))
    disks, outlines = contactors.select("disk"), outlines_of(step)[0]
    disks = disks.where(~np.isin(disks.body, hidden))
    if bodies:
        draw_disks(ax, disks.center, disks.radius, facecolors=PALE)
        draw_polygons(ax, [*outlines, *mesh_cells.outlines(step)[0]], facecolors=PALE)
        draw_lines(ax, step.drawn["position"][mesh_cells.lines(step)]).set(color=PALE)
    _frame(ax, view)
    if walls:
        draw_walls(ax, contactors, hidden if bodies else ())
    return disks, outlines


def draw_lines(ax, ends):
    """Bars and beams (m, 2, 2) [m] as one collection."""
    from matplotlib.collections import LineCollection

    lines = LineCollection(ends, linewidths=2.5, capstyle="round")
    ax.add_collection(lines, autolim=False)
    return lines


def draw_disks(ax, centers, radii, **style):
    """All disks as one collection: 43,000 take about a second. centers (n, 2), radii (n,) [m]."""
    from matplotlib.collections import EllipseCollection

    disks = EllipseCollection(
        2 * radii,
        2 * radii,
        np.zeros(len(radii)),
        units="xy",
        offsets=centers,
        offset_transform=ax.transData,
        linewidths=0,
        **style,
    )
    ax.add_collection(disks, autolim=False)
    return disks


def draw_polygons(ax, outlines, **style):
    """All polygons, a list of corners (m, 2) [m], as one collection; thin edges, so that neighbours are told apart."""
    from matplotlib.collections import PolyCollection

    style = {"edgecolors": "#5a5346", "linewidths": min(0.5, 20 / np.sqrt(len(outlines) + 1))} | style
    polygons = PolyCollection(outlines, **style)
    ax.add_collection(polygons, autolim=False)
    return polygons


def paint(ax, collection, values, what, label, scene, cmap, limits, colorbar):
    """Colours by number, or one colour per class with a legend."""
    from matplotlib.colors import ListedColormap

    what = what if isinstance(what, str) else ""
    if what in CATEGORIES and cmap is None:
        kinds = np.unique(values).astype(int)
        palette = ListedColormap([CLASSES[k % len(CLASSES)] for k in kinds] or [PALE])
        collection.set(array=np.searchsorted(kinds, values), cmap=palette, clim=(-0.5, max(len(kinds), 1) - 0.5))
        if colorbar and 1 < len(kinds) <= 12:
            legend(ax, kinds, [palette(i) for i in range(len(kinds))], what, scene)
        return
    if limits is None:
        limits = value_limits(values, what)
    collection.set(array=values, cmap=cmap or ("twilight" if what == "rotation" else "viridis"), clim=limits)
    if colorbar:
        bar(ax, collection, label, shrink=0.8)


def legend(ax, kinds, colors, what, scene):
    """Names of classes, materials by theirs, each with its colour."""
    from matplotlib.lines import Line2D

    names = list(scene.get("materials", [])) if what == "material" else []
    labels = [names[k] if 0 <= k < len(names) else f"{what} {k}" for k in kinds]
    marks = [Line2D([], [], marker="o", ls="", color=color, label=label) for color, label in zip(colors, labels)]
    ax.legend(handles=marks, fontsize=8, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))


def bar(ax, painted, label, shrink):
    """The scale of the colours, its numbers as they are: no offset to be added by the reader."""
    made = ax.figure.colorbar(painted, ax=ax, label=label, shrink=shrink, pad=0.02)
    made.formatter.set_useOffset(False)
    made.update_ticks()


def speed_of_a_step(step):
    """Speed [m/s] that gravity gives in a step, 0 where it is not known: bodies far slower than this are at rest."""
    gravity = step.run.scene.get("gravity")
    return 0.0 if gravity is None or isinstance(gravity, str) else float(np.linalg.norm(gravity)) * step_size(step)


def value_limits(values, what=None, step=None):
    """Range of the colours: a full turn for rotations, else from the smallest to the 99.5 % quantile; values that differ by
    rounding alone share a colour, and so do speeds of bodies at rest if an output is given (step)."""
    if step is not None and isinstance(what, str) and what in ("velocity", "speed"):
        scale = speed_of_a_step(step)
        if np.nanmax(values, initial=0.0) < AT_REST * scale:
            return 0.0, scale
    if isinstance(what, str) and what == "rotation":
        return -np.pi, np.pi
    values = values[np.isfinite(values)]
    if not len(values):
        return 0.0, 1.0
    low, high = float(values.min()), float(np.quantile(values, 0.995))
    high = high if high > low else float(values.max())
    return (low, high) if high - low > NOISE * max(abs(low), abs(high)) else (low, low + (abs(low) or 1.0))


def _view(step):
    """Limits (2, 2) around all that is bounded, with some room."""
    contactors, outlines = contactors_of(step), outlines_of(step)[0]
    disks, segments = contactors.select("disk"), contactors.select("segment")
    points = [disks.center - disks.radius[:, None], disks.center + disks.radius[:, None]]
    reach = segments.direction * segments.half[:, None]
    lines = step.drawn["position"][mesh_cells.lines(step).ravel()]
    points += [*outlines, *mesh_cells.outlines(step)[0], lines, segments.center - reach, segments.center + reach]
    points = np.concatenate(points)
    if step.run.periodic is not None:
        corners, periodic = cell_corners(step)
        points = np.concatenate([points, corners]) if periodic.all() else points
    low, high = (points.min(0), points.max(0)) if len(points) else (np.zeros(2), np.ones(2))
    room = 0.03 * (high - low).max() or 1.0
    return np.stack([low - room, high + room], axis=1)


def _frame(ax, view):
    """The view at equal scales, with units."""
    ax.set(xlim=view[0], ylim=view[1], xlabel="x [m]", ylabel="y [m]")
    ax.set_aspect("equal")
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)


def draw_walls(ax, contactors, hidden=()):
    """Segments as lines with their round ends, rings as circles, half-planes as lines with the solid side shaded. hidden: rows of
    bodies whose segments are left out, as edges of meshes whose cells are drawn."""
    from matplotlib.collections import LineCollection, PolyCollection

    segments = contactors.select("segment")
    segments = segments.where(~np.isin(segments.body, hidden))
    reach = segments.direction * segments.half[:, None]
    thick = segments.radius > 0
    ends = np.stack([segments.center - reach, segments.center + reach], axis=1)
    ax.add_collection(LineCollection(ends[~thick], colors=WALL, linewidths=1.5), autolim=False)
    if thick.any():
        outlines = _capsules(segments.center[thick], segments.direction[thick], segments.half[thick], segments.radius[thick])
        ax.add_collection(PolyCollection(outlines, facecolors=WALL, linewidths=0), autolim=False)
    rings = contactors.select("ring")
    if len(rings):
        from matplotlib.patches import Circle

        for center, radius in zip(rings.center, rings.radius):
            ax.add_patch(Circle(center, radius, fill=False, color=WALL, linewidth=1.5))
    planes = contactors.select("half_plane")
    if len(planes):
        view = np.array([ax.get_xlim(), ax.get_ylim()])
        middle, size = view.mean(1), np.hypot(*np.diff(view, axis=1).ravel())
        along = np.stack([-planes.direction[:, 1], planes.direction[:, 0]], axis=1)
        gap = np.sum((middle - planes.center) * planes.direction, axis=1)[:, None]
        foot = middle - gap * planes.direction
        line = np.stack([foot - size * along, foot + size * along], axis=1)
        solid = np.concatenate([line, line[:, ::-1] - size * planes.direction[:, None]], axis=1)
        ax.add_collection(PolyCollection(solid, facecolors=PALE, linewidths=0, alpha=0.5, zorder=0), autolim=False)
        ax.add_collection(LineCollection(line, colors=WALL, linewidths=1.5), autolim=False)


def cell_corners(step):
    """Corners (4, 2) of the periodic cell at the time of an output, anticlockwise, and along which axes it repeats, (2,)."""
    cell = step.run.periodic
    vectors, corner = np.array(cell["vectors"])[:2, :2], np.array(cell["corner"])[:2]
    vectors = vectors + step.time * vectors @ np.array(cell["velocity_gradient"])[:2, :2].T
    if vectors[0, 0] > 0:
        vectors[1, 0] = (vectors[1, 0] + vectors[0, 0] / 2) % vectors[0, 0] - vectors[0, 0] / 2
    return corner + [[0, 0], vectors[0], vectors[0] + vectors[1], vectors[1]], np.array(cell["periodic"], bool)[:2]


def draw_cell(ax, step):
    """Draws the periodic cell at the time of an output, dashed and inclined by its shear."""
    if step.run.periodic is None:
        return
    from matplotlib.patches import Polygon

    corners, periodic = cell_corners(step)
    (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
    if periodic.all():
        ax.add_patch(Polygon(corners, fill=False, ls="--", lw=1, ec=WALL))
        return
    axis = int(np.argmax(periodic))
    for place in (corners[0, axis], corners[2, axis]):
        ends = ((place, place), (y0, y1)) if axis == 0 else ((x0, x1), (place, place))
        ax.plot(*ends, "--", lw=1, color=WALL, scalex=False, scaley=False)


def _capsules(center, axis, half, radius):
    """Outlines (m, 34, 2) of segments with round ends."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, 17)
    across = np.stack([-axis[:, 1], axis[:, 0]], axis=1)[:, None]
    axis, center = axis[:, None], center[:, None]
    cap = np.cos(angle)[None, :, None] * axis + np.sin(angle)[None, :, None] * across
    reach = half[:, None, None] * axis
    front = center + reach + radius[:, None, None] * cap
    return np.concatenate([front, 2 * center - front], axis=1)


def _legend_of_forces(ax, force, mean, width):
    """Legend of the colours and widths of force chains."""
    from matplotlib.lines import Line2D

    told = [(COMPRESSION, width, "pushes")] * bool((force > 0).any()) + [(TENSION, width, "pulls")] * bool((force < 0).any())
    told += [(WALL, width, f"{_figures(mean)} N"), (WALL, THICKEST * width, f"{_figures(THICKEST * mean)} N or more")]
    lines = [Line2D([], [], color=color, lw=wide, label=text, solid_capstyle="round") for color, wide, text in told]
    ax.legend(handles=lines, fontsize=8, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0), handlelength=1.2)


def _figures(value):
    """Three figures, without an exponent as far as that is short."""
    return f"{round(value, 2 - int(np.floor(np.log10(value)))):,.0f}" if 1e3 <= value < 1e6 else f"{value:.3g}"


def step_size(step):
    """Length [s] of the time step that led to an output: from the history, else from the scene, else 1 (impulses)."""
    history = step.run.history
    if "dt" in history and len(history["step"]):
        at = np.flatnonzero(history["step"] == step.step)
        if len(at):
            return float(history["dt"][at[0]])
    return float(step.run.scene.get("dt", 1.0))


def size_of_cells(step):
    """Median side [m] of the cells of meshes; 0 without meshes."""
    cells = [row[np.asarray(of)[:, :2]] for mesh, row in mesh_cells.meshes_at(step) for of in mesh["cells"].values()]
    ends = step.drawn["position"][np.concatenate(cells)] if cells else np.zeros((0, 2, step.dim))
    return float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))) if len(ends) else 0.0


def chain_lines(step):
    """Ends (m, 2, dim) of the lines of force chains: those of `contact_lines`; where these have no length, between nodes and
    sides of meshes or walls, a line across the contact along its normal, as long as a cell or a body."""
    lines = contact_lines(step)
    if not len(lines):
        return lines
    short = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1) <= 1e-6 * np.ptp(lines, axis=(0, 1)).max()
    if not short.any():
        return lines
    size = size_of_cells(step)
    if not size > 0 and "radius" in step.drawn and np.any(step.drawn["radius"] > 0):
        size = 2 * float(np.median(step.drawn["radius"][step.drawn["radius"] > 0]))
    reach = size / 2 * step.contacts["normal"][short]
    lines[short] = lines[short].mean(axis=1, keepdims=True) + np.stack([-reach, reach], axis=1)
    return lines


def contact_lines(step):
    """Ends (m, 2, dim) of a line through each contact point: to the centres of bodies, to the point on a wall."""
    point = step.contacts["point"]
    row_a, row_b, arm_a, arm_b = lever_arms(step)
    solid = step.drawn["radius"] > 0 if "radius" in step.drawn else np.zeros(len(step.drawn), bool)
    solid[outlines_of(step)[1] if step.dim == 2 else contactors_of(step).select(*_core.shapes("mover")).body] = True
    ends = [np.where(solid[row, None], point - arm, point) for row, arm in ((row_a, arm_a), (row_b, arm_b))]
    return np.stack(ends, axis=1)
