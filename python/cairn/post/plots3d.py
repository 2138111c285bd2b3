"""Pictures of bodies in space: rendered by PyVista off-screen, or point by point where PyVista is not."""

import contextlib
import ctypes
import os

import numpy as np

from .. import _core
from ..base.geometry import contactors_of
from ..files import mesh_cells
from . import joint_marks
from .drawing import (
    CATEGORIES,
    CLASSES,
    COMPRESSION,
    LABELS,
    PALE,
    TENSION,
    WALL,
    _axes,
    _pyplot,
    bar,
    chain_lines,
    field_values,
    legend,
    step_size,
    title_of,
    titled,
    value_limits,
)  # fmt: skip
from .shape_meshes import meshes_of

WINDOW = (1200, 900)


def plot_step_3d(step, what="velocity", ax=None, cmap=None, limits=None, colorbar=True, title=None, window=WINDOW, camera=None,
                 walls=True):  # fmt: skip
    """Draw the bodies of one output, coloured by a field. Returns matplotlib Axes."""
    if mesh_cells.values_of_lines(step, what) is not None:
        values, label = np.full(len(step.drawn), np.nan), LABELS.get(what, what)
    else:
        values, label = field_values(step, what)
    contactors = contactors_of(step)
    spheres, mesh = contactors.where(~joint_marks.of_contactors(step, contactors)).select("sphere"), meshes_of(step)
    hidden = mesh_cells.shown_by_cells(step)
    spheres = spheres.where(~np.isin(spheres.body, hidden))
    of_bodies, values = values, values[spheres.body]
    mesh, of_bodies = mesh_cells.with_rods(step, what, *mesh_cells.with_surfaces(step, mesh, of_bodies, hidden))
    classes = isinstance(what, str) and what in CATEGORIES and cmap is None
    kinds = np.unique(of_bodies).astype(int) if classes else []
    if classes:
        limits = (-0.5, len(CLASSES) - 0.5)
        values, of_bodies = values % len(CLASSES), of_bodies % len(CLASSES)
    elif limits is None:
        turned = isinstance(what, str) and what == "rotation"
        limits = (0.0, np.pi) if turned else value_limits(values if mesh is None else of_bodies, what, step)
    palette = _palette(classes, cmap)
    picture = spheres.center, spheres.radius, values, palette, limits, window, mesh, of_bodies
    try:
        image, seen = render_spheres(*picture, camera=camera, walls_of=step if walls else None)
    except ImportError:
        from .plain_render import render

        image, seen = render(*picture), ()
    ax = _axes(ax, (8.0, 6.0))
    ax.imshow(image)
    ax.set_axis_off()
    draw_axes(ax, seen)
    _finish(ax, step, palette, limits, label if colorbar and not classes else None, title)
    if colorbar and 1 < len(kinds) <= 12:
        legend(ax, kinds, [CLASSES[k % len(CLASSES)] for k in kinds], what, step.run.scene)
    return ax


def plot_forces_3d(step, ax=None, dt=None, width=None, bodies=True, title=None, window=WINDOW, camera=None):
    """Draw contacts that carry an impulse as rods between their bodies, as thick as the normal force; see
    `plots.plot_force_chains`. Needs PyVista."""
    choose_window()
    try:
        import pyvista  # noqa: F401
    except ImportError as error:
        raise ImportError("forces in space need PyVista: pip install pyvista") from error
    with quiet():
        return _plot_forces(step, ax, dt, width, bodies, title, window, camera)


def quiet():
    """Without a screen VTK warns that there is none as it makes a window, and then draws in memory."""
    import pyvista

    return pyvista.vtk_verbosity("error")


def _plot_forces(step, ax, dt, width, bodies, title, window, camera):
    import pyvista

    contacts, dt = step.contacts, step_size(step) if dt is None else dt
    force, lines = np.sum(contacts["impulse"] * contacts["normal"], axis=1) / dt, chain_lines(step)
    force, lines = force[force != 0], lines[force != 0]
    plotter = pyvista.Plotter(off_screen=True, window_size=list(window))
    plotter.set_background("white")
    contactors = contactors_of(step)
    spheres, mesh = contactors.where(~joint_marks.of_contactors(step, contactors)).select("sphere"), meshes_of(step)
    if bodies:
        plain = {"color": PALE, "opacity": 0.1, "show_scalar_bar": False}
        if len(spheres):
            plotter.add_mesh(_balls(spheres.center, spheres.radius), **plain)
        if mesh is not None:
            plotter.add_mesh(_surface(*mesh[:2]), **plain)
        if rods := mesh_cells.rods(step):
            plotter.add_mesh(_surface(*rods), **plain | {"opacity": 0.4})
    if len(force):
        mean = np.abs(force).mean()
        if width is None:
            sizes = spheres.radius if len(spheres) else [0.1 * np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).mean()]
            width = 0.2 * float(np.median(sizes))
        thick = np.repeat(np.clip(0.5 * width * np.abs(force) / mean, 0.02 * width, 1.5 * width), 2)
        for some, colour in ((force > 0, COMPRESSION), (force < 0, TENSION)):
            if some.any():
                rods = pyvista.line_segments_from_points(lines[some].reshape(-1, 3))
                rods["thick"] = thick[np.repeat(some, 2)]
                plotter.add_mesh(rods.tube(scalars="thick", absolute=True, n_sides=8), color=colour, specular=0.2)
    add_walls(plotter, step)
    ax = _axes(ax, (8.0, 6.0))
    image, seen = _picture(plotter, camera)
    ax.imshow(image)
    ax.set_axis_off()
    draw_axes(ax, seen)
    if len(force):
        ax.text(0.99, 0.99, f"mean normal force {mean:.3g} N", transform=ax.transAxes, ha="right", va="top", fontsize=8)
    titled(ax, title_of(step) if title is None else title)
    return ax


def add_walls(plotter, step):
    """Planes and tubes as thin glass, as far as the bodies reach."""
    import pyvista

    contactors = contactors_of(step)
    planes, tubes = contactors.select("plane"), contactors.select("tube")
    low, high = np.array(plotter.bounds).reshape(3, 2).T
    if not np.all(np.isfinite(low)) or not np.any(high > low):
        return
    middle, size = (low + high) / 2, float(np.linalg.norm(high - low))
    room = 0.03 * size
    box = np.stack([low - room, high + room], axis=1).ravel()
    glass = {"color": WALL, "opacity": 0.08, "show_scalar_bar": False, "lighting": False}
    for center, normal in zip(planes.center, planes.direction):
        foot = middle - np.dot(middle - center, normal) * normal
        if np.all(foot >= low - room - 1e-9 * size) and np.all(foot <= high + room + 1e-9 * size):
            part = pyvista.Plane(center=foot, direction=normal, i_size=3 * size, j_size=3 * size, i_resolution=1, j_resolution=1)
            part = part.clip_box(box, invert=False)
            if part.n_points:
                plotter.add_mesh(part, **glass)
    for center, axis, half, radius in zip(tubes.center, tubes.direction, tubes.half, tubes.radius):
        half = half if np.isfinite(half) and half > 0 else size / 2
        tube = {"center": center, "direction": axis, "radius": radius, "height": 2 * half, "resolution": 48, "capping": False}
        plotter.add_mesh(pyvista.Cylinder(**tube), **glass)


def _balls(center, radius):
    """Surfaces of spheres as one; coarser when there are many."""
    import pyvista

    cloud = pyvista.PolyData(np.ascontiguousarray(center, dtype=float))
    cloud["diameter"] = 2 * radius
    fine = 24 if len(center) < 2000 else 12 if len(center) < 20000 else 8
    ball = pyvista.Sphere(radius=0.5, theta_resolution=fine, phi_resolution=fine)
    return cloud.glyph(scale="diameter", orient=False, geom=ball)


def _surface(points, triangles):
    import pyvista

    return pyvista.PolyData(points, np.column_stack((np.full(len(triangles), 3), triangles)).ravel())


def _picture(plotter, camera):
    """The image, seen from a place to a point, from a direction, or from the front, the right and above."""
    given = np.asarray((1.0, -1.6, 0.8) if camera is None else camera, float)
    if given.shape == (3,):
        plotter.camera_position = [given, (0, 0, 0), (0, 0, 1)]
        plotter.reset_camera()
    elif given.shape == (2, 3):
        plotter.camera_position = [given[0], given[1], (0, 0, 1)]
        plotter.reset_camera_clipping_range()
    else:
        raise ValueError(f"camera has shape {given.shape}: give (place, point looked at), (2, 3) [m], or a direction (3,)")
    place, middle, up = (np.array(v, float) for v in plotter.camera_position)
    image = plotter.screenshot(return_img=True)
    plotter.close()
    ahead = (middle - place) / np.linalg.norm(middle - place)
    right = np.cross(ahead, up)
    right /= np.linalg.norm(right) or 1.0
    seen = np.stack([right, np.cross(right, ahead)], axis=1)  # of x, y, z: to the right, and up
    return (_cropped(image) if given.shape == (3,) else image), seen  # where the view is given, its frame is


def _cropped(image):
    """The image without the empty paper around it, but for a margin."""
    drawn = np.any(image < 250, axis=2)
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    if not len(rows):
        return image
    margin = len(image) // 40
    return image[max(rows[0] - margin, 0) : rows[-1] + margin, max(columns[0] - margin, 0) : columns[-1] + margin]


def draw_axes(ax, seen, length=20.0):
    """The directions of x, y, z below the lower left corner, as `_picture` saw them; length in points."""
    for name, way in zip("xyz", seen):
        if np.linalg.norm(way) > 0.05:
            ends = {"xycoords": "axes fraction", "textcoords": "offset points", "fontsize": 8, "ha": "center", "va": "center"}
            ax.annotate(name, (0.03, 0.05), length * way, arrowprops={"arrowstyle": "<-", "lw": 0.8, "shrinkB": 0}, **ends)


def _palette(classes, cmap):
    from matplotlib.colors import ListedColormap

    return ListedColormap(CLASSES) if classes else _pyplot().get_cmap(cmap or "viridis")


def _finish(ax, step, palette, limits, label, title):
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    if label is not None:
        bar(ax, ScalarMappable(Normalize(*limits), palette), label, shrink=0.7)
    titled(ax, title_of(step) if title is None else title)


def choose_window():
    """Makes VTK render off screen where the X11 library is missing, since its usual window would abort the program."""

    def there(*names):
        for name in names:
            with contextlib.suppress(OSError):
                return ctypes.CDLL(name) is not None
        return False

    in_memory = there("libOSMesa.so.8", "libOSMesa.so")
    if not in_memory and not (there("libX11.so.6") and there("libEGL.so.1", "libGL.so.1")):
        raise ImportError("no library to draw with: install libosmesa6, or libegl1 and libx11-6")
    if not there("libX11.so.6"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkOSOpenGLRenderWindow")


def render_spheres(center, radius, values, palette, limits, window, mesh=None, of_bodies=None, camera=None, walls_of=None):
    """An image (height, width, 3) of spheres and of the mesh of other bodies, and the axes as seen. ImportError without PyVista,
    or without a system library to draw with."""
    choose_window()
    import pyvista

    with quiet():
        plotter = pyvista.Plotter(off_screen=True, window_size=list(window))
        plotter.set_background("white")
        add_spheres(plotter, center, radius, values, palette, limits)
        add_mesh(plotter, mesh, of_bodies, palette, limits)
        if walls_of is not None:
            add_walls(plotter, walls_of)
            joint_marks.add_to(plotter, walls_of, contactors_of(walls_of), WALL)
        return _picture(plotter, camera)


def add_mesh(plotter, mesh, values, palette, limits):
    """Bodies that are no spheres, as meshes_of gives them, each in the colour of its value, their sharp edges as lines."""
    if mesh is None:
        return
    points, triangles, rows = mesh
    surface = _surface(points, triangles)
    surface.cell_data["value"] = np.asarray(values, float)[rows]
    plotter.add_mesh(surface, scalars="value", cmap=palette, clim=limits, show_scalar_bar=False, specular=0.2)
    if len(triangles) < 200_000:  # beyond, edges are all that would be seen
        edges = surface.extract_feature_edges(30.0, boundary_edges=False, manifold_edges=False, non_manifold_edges=False)
        if edges.n_points:
            plotter.add_mesh(edges, color="#3a352c", line_width=1)


def add_spheres(plotter, center, radius, values, palette, limits, opacity=1.0):
    """Spheres as glyphs; coarser when there are many."""
    import pyvista

    if not len(center):
        return
    cloud = pyvista.PolyData(np.ascontiguousarray(center, dtype=float))
    cloud["diameter"], cloud["value"] = 2 * radius, values.astype(float)
    fine = 24 if len(center) < 2000 else 12 if len(center) < 20000 else 8
    ball = pyvista.Sphere(radius=0.5, theta_resolution=fine, phi_resolution=fine)
    plotter.add_mesh(
        cloud.glyph(scale="diameter", orient=False, geom=ball),
        scalars="value",
        cmap=palette,
        clim=limits,
        show_scalar_bar=False,
        smooth_shading=True,
        specular=0.2,
        opacity=opacity,
    )
    plotter.add_mesh(pyvista.Box(cloud.bounds).outline(), color=WALL, line_width=1)


def view(run, what="velocity", off_screen=False):
    """Show a run in a window, with a slider over its outputs. Needs PyVista and a display. Returns the plotter when closed."""
    try:
        import pyvista
    except ImportError as error:
        raise ImportError("a window needs PyVista: pip install pyvista") from error
    if len(run) == 0:
        raise ValueError(f"{run.path} holds no output yet")
    classes = isinstance(what, str) and what in CATEGORIES
    few = np.concatenate([field_values(run[k], what)[0] for k in {0, len(run) // 2, len(run) - 1}])
    limits, palette = (-0.5, len(CLASSES) - 0.5) if classes else value_limits(few, what), _palette(classes, None)
    plotter = pyvista.Plotter(off_screen=off_screen)
    plotter.set_background("white")

    def show(i):
        step = run[round(i)]
        values, _ = field_values(step, what)
        bodies = contactors_of(step).select(*_core.shapes("ball"))
        center = np.zeros((len(bodies), 3))
        center[:, : run.dim] = bodies.center
        of_bodies, values = values, values[bodies.body]
        plotter.clear_actors()
        add_spheres(plotter, center, bodies.radius, values % len(CLASSES) if classes else values, palette, limits)
        add_mesh(plotter, meshes_of(step), of_bodies % len(CLASSES) if classes else of_bodies, palette, limits)
        plotter.add_text(title_of(step), font_size=9, color="black")

    show(len(run) - 1)
    if len(run) > 1:
        plotter.add_slider_widget(show, (0, len(run) - 1), value=len(run) - 1, title="output", fmt="%.0f", color="black")
    if run.dim == 2:
        plotter.view_xy()
    plotter.show()
    return plotter
