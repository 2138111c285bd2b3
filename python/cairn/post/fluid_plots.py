"""Pictures of a liquid: its particles, coloured by a field, with the bodies among them."""

import numpy as np

from ..base import checks
from ..names import listed
from .drawing import _axes, _frame, _view, bar, draw_cell, draw_disks, draw_pale, title_of, titled

LABELS = {"pressure": "pressure [Pa]", "speed": "speed [m/s]", "density": "density [kg/m3]"}


def plot_fluid(step, what="pressure", ax=None, cmap=None, limits=None, colorbar=True, bodies=True, title=None, view=None):
    """Draw the particles of a liquid in one output, and the bodies pale among them.

    what : "pressure", "speed", "density", or an array (n,). limits : smallest and largest value of the colours, between the
    second and the last but second of a hundred if None. view : ((x0, x1), (y0, y1)) [m]; in 3D the particles are seen along the
    second axis. Returns the Axes.
    """
    fluid = step.fluid
    if not len(fluid):
        raise ValueError("this output has no fluid: give cn.fluid(...) to the scene of the run")
    place = fluid["position"]
    if isinstance(what, str) and what != "speed" and (what not in fluid or fluid[what].ndim > 1):
        known = [name for name in fluid.names if fluid[name].ndim == 1] + ["speed"]
        raise ValueError(f"the liquid has no field {what!r} of numbers; there are {listed(known, what)}")
    if isinstance(what, str):
        values = np.linalg.norm(fluid["velocity"], axis=1) if what == "speed" else fluid[what]
        label = LABELS.get(what, what)
    else:
        due = "give 'pressure', 'speed', 'density', or a number for each particle"
        if what is None:
            raise ValueError(f"what is None: {due}")
        values, label = checks.reals("what", what, due), ""
        if values.shape != place.shape[:1]:
            raise ValueError(f"what has shape {values.shape}: {due}, ({len(place)},)")
    spacing = float(step.run.scene["fluid"]["spacing"])
    flat = step.dim == 2
    if view is None:
        seen = place if flat else place[:, [0, 2]]
        low, high = seen.min(axis=0) - spacing, seen.max(axis=0) + spacing
        if flat and len(step.bodies):
            around = np.array(_view(step))
            low, high = np.minimum(low, around[:, 0]), np.maximum(high, around[:, 1])
        view = ((low[0], high[0]), (low[1], high[1]))
    ax = _axes(ax, view=view)
    if flat:
        draw_pale(ax, step, view, bodies)
        draw_cell(ax, step)
    order = np.arange(len(place)) if flat else np.argsort(-place[:, 1])  # near ones last
    shown = place if flat else place[:, [0, 2]]
    painted = draw_disks(ax, shown[order], np.full(len(place), 0.5 * spacing), edgecolors="none")
    painted.set_array(values[order])
    painted.set_cmap(cmap or "viridis")
    painted.set_clim(*(np.percentile(values, [2, 98]) if limits is None else limits))
    if colorbar:
        bar(ax, painted, label, 0.8)
    _frame(ax, view)
    titled(ax, title_of(step) if title is None else title)
    return ax
