"""Pictures of runs, with matplotlib; bodies in space with PyVista where it is there. Every function returns matplotlib Axes."""

import numpy as np

from ..base.geometry import contactors_of
from ..files import mesh_cells
from ..names import teach
from . import joint_marks
from .drawing import (
    AT_REST,
    AXES,
    CATEGORIES,
    CLASSES,
    COMPRESSION,
    LABELS,
    NOISE,
    PALE,
    TENSION,
    THICKEST,
    WALL,
    _axes,
    _frame,
    _legend_of_forces,
    _view,
    bar,
    cell_corners,
    chain_lines,
    contact_lines,
    counted,
    draw_cell,
    draw_disks,
    draw_lines,
    draw_pale,
    draw_polygons,
    draw_walls,
    field_values,
    legend,
    paint,
    size_of_cells,
    speed_of_a_step,
    step_size,
    title_of,
    titled,
    value_limits,
    von_mises,
)
from .frame_plots import plot_borne
from .plots3d import plot_forces_3d, plot_step_3d
from .shape_meshes import outlines_of

__all__ = [  # what is drawn with stands here, too
    "AT_REST",
    "AXES",
    "CATEGORIES",
    "CLASSES",
    "COMPRESSION",
    "LABELS",
    "NOISE",
    "PALE",
    "TENSION",
    "THICKEST",
    "WALL",
    "bar",
    "cell_corners",
    "chain_lines",
    "contact_lines",
    "counted",
    "draw_cell",
    "draw_disks",
    "draw_lines",
    "draw_pale",
    "draw_polygons",
    "draw_walls",
    "field_values",
    "legend",
    "paint",
    "plot_force_chains",
    "plot_step",
    "size_of_cells",
    "speed_of_a_step",
    "step_size",
    "title_of",
    "titled",
    "value_limits",
    "von_mises",
]


def plot_step(
    step, what="velocity", ax=None, cmap=None, limits=None, colorbar=True, walls=True, title=None, view=None, camera=None
):
    """Draw the bodies of one output, coloured by a field.

    what : "velocity", "rotation", "material", any field of the bodies, or an array (n,); of bodies that deform, whose cells are
    drawn, "von_mises", "stress_xx", "strain_xy" and the like as well; of bars and beams "axial_force", "bending_moment" and the
    like, for which other bodies are pale.
    limits : smallest and largest value of the colours. view : ((x0, x1), (y0, y1)) [m]. camera : in 3D, the place that the scene
    is seen from and the point looked at, ((x, y, z), (x, y, z)) [m]; or a direction (x, y, z) from which all of it is seen.
    3D scenes are rendered by PyVista if it is there, else point by point without it. Returns the Axes.
    """
    if step.dim == 3:
        options = {"limits": limits, "colorbar": colorbar, "title": title, "camera": camera, "walls": walls}
        return plot_step_3d(step, what, ax=ax, cmap=cmap, **options)
    of_lines = mesh_cells.values_of_lines(step, what)
    if of_lines is not None:
        return plot_borne(step, what, of_lines, ax, cmap, limits, colorbar, walls, title, view)
    values, label = field_values(step, what)
    everything = contactors_of(step)
    contactors = everything.where(~joint_marks.of_contactors(step, everything))
    disks, (outlines, rows), (cells, corners) = contactors.select("disk"), outlines_of(step), mesh_cells.outlines(step)
    ends = mesh_cells.lines(step)
    view = _view(step) if view is None else view
    ax = _axes(ax, view=view)
    if cells or len(ends):
        disks = disks.where(~np.isin(disks.body, mesh_cells.shown_by_cells(step)))
    if limits is None and not (isinstance(what, str) and what in CATEGORIES):
        seen = np.concatenate([disks.body, rows, ends.ravel(), *(of.ravel() for of in corners)])
        limits = value_limits(values[seen], what, step)
    if cells:
        classes = isinstance(what, str) and what in CATEGORIES
        mean = np.concatenate([values[of[:, 0]] if classes else values[of].mean(axis=1) for of in corners])
        paint(ax, draw_polygons(ax, cells), mean, what, label, step.run.scene, cmap, limits, colorbar)
        colorbar = False
    if len(ends):
        mean = values[ends[:, 0]] if isinstance(what, str) and what in CATEGORIES else values[ends].mean(axis=1)
        paint(ax, draw_lines(ax, step.drawn["position"][ends]), mean, what, label, step.run.scene, cmap, limits, colorbar)
        colorbar = False
    if len(disks) or not (len(rows) or cells or len(ends)):
        painted = draw_disks(ax, disks.center, disks.radius)
        paint(ax, painted, values[disks.body], what, label, step.run.scene, cmap, limits, colorbar)
    if len(rows):
        painted = draw_polygons(ax, outlines)
        paint(ax, painted, values[rows], what, label, step.run.scene, cmap, limits, colorbar and not len(disks))
    _frame(ax, view)
    if walls:
        draw_walls(ax, contactors, mesh_cells.shown_by_cells(step) if cells or len(ends) else ())
        draw_cell(ax, step)
    joint_marks.draw(ax, step, everything, WALL)
    titled(ax, title_of(step) if title is None else title)
    return ax


def plot_force_chains(step, ax=None, dt=None, width=None, bodies=True, title=None, view=None, camera=None, legend=True):
    """Draw each contact that carries an impulse as a line between its bodies, as thick as the normal force.

    A contact between nodes or sides of meshes has no centres to go to: its line goes across it along its normal, as long as a
    cell. dt : step [s] that turns impulses into forces; the run's own if None. width : thickness [points] of the mean force, in
    3D [m]; a fifth of a body if None. Compression red, tension blue. camera : in 3D, see `plot_step`. legend : whether the
    colours and the widths are told beside. Returns the Axes.
    """
    from matplotlib.collections import LineCollection

    if step.dim == 3:
        return plot_forces_3d(step, ax=ax, dt=dt, width=width, bodies=bodies, title=title, camera=camera)
    view = _view(step) if view is None else view
    ax = _axes(ax, view=view)
    disks, outlines = draw_pale(ax, step, view, bodies)
    draw_cell(ax, step)
    contacts, dt = step.contacts, step_size(step) if dt is None else dt
    force = np.sum(contacts["impulse"] * contacts["normal"], axis=1) / dt
    lines = chain_lines(step)
    loaded = force != 0
    force, lines = force[loaded], lines[loaded]
    if len(force):
        mean = np.abs(force).mean()
        if width is None:
            room = 72.0 * ax.figure.get_size_inches() * ax.get_position().size
            points_per_metre = float((room / np.ptp(np.asarray(view, float), axis=1)).min())
            sizes = [*(2 * disks.radius), *(np.ptp(o, axis=0).min() for o in outlines)] or [size_of_cells(step)]
            diameter = points_per_metre * float(np.median(sizes))
            width = float(np.clip(0.2 * diameter, 0.1, 4.0)) if diameter > 0 else 1.0
        order = np.argsort(np.abs(force))  # strong chains on top
        ax.add_collection(
            LineCollection(
                lines[order],
                linewidths=np.clip(width * np.abs(force) / mean, 0.03, THICKEST * width)[order],
                colors=np.where(force > 0, COMPRESSION, TENSION)[order],
                capstyle="round",
            ),
            autolim=False,
        )
        if legend:
            _legend_of_forces(ax, force, mean, width)
    told = f"   mean normal force {np.abs(force).mean():.3g} N" if len(force) else ""
    titled(ax, ((title_of(step) if title is None else title) + told).strip())
    return ax


teach(globals(), __all__)
