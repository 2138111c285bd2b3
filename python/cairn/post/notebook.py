"""What a notebook shows of a scene, a simulation and a run: a small table, and of a run its last picture."""

import base64
import html
import io

import numpy as np


def table(title, rows):
    """A table of names and values as HTML; what comes from a file or a user is escaped."""
    pairs = ((html.escape(str(name)), html.escape(str(value))) for name, value in rows)
    cells = "".join(f"<tr><td><b>{name}</b></td><td>{value}</td></tr>" for name, value in pairs)
    return f"<table><caption>{html.escape(title)}</caption>{cells}</table>"


def of_scene(scene):
    """A scene: what it is made of."""
    gravity = "a function of time" if callable(scene.gravity) else ", ".join(f"{g:g}" for g in np.ravel(scene.gravity))
    materials = sorted({str(getattr(s.material, "name", s.material)) for s in scene.sets if hasattr(s, "material")})
    rows = [("dimensions", scene.dim), ("gravity [m/s2]", gravity), ("bodies", f"{scene.count:,}")]
    rows += [("materials", ", ".join(materials))] if materials else []
    rows += [("law", f"{a}, {b}: {law!r}") for a, b, law in scene.rules[:12]]
    return table(f"Scene, {scene.dim}D", rows)


def of_simulation(simulation):
    """A simulation: where it is, and how its last step ended."""
    info = simulation.info
    rows = [
        ("time [s]", f"{simulation.time:g}"),
        ("steps", f"{simulation.steps:,}"),
        ("step [s]", f"{simulation.dt:g}"),
        ("bodies", f"{len(simulation.bodies):,}"),
    ]
    if "contacts" in info:
        rows.append(("contacts", f"{info['contacts']:,}"))
    if "status" in info:
        rows.append(("last step", f"{info['status']}, error {info.get('error', float('nan')):.1e}"))
    return table("Simulation", rows)


def of_run(run):
    """A run: what it holds, with a picture of the last output where matplotlib is there."""
    rows = [("file", run.path), ("outputs", f"{len(run):,}")]
    if len(run):
        rows += [("time [s]", f"{run.times[0]:g} to {run.times[-1]:g}"), ("bodies", f"{len(run[-1].bodies):,}")]
    return table(f"Run, {run.dim}D", rows) + (_picture(run) if len(run) else "")


def _picture(run):
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        return ""
    figure = Figure(figsize=(6.0, 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    run.plot(len(run) - 1, ax=figure.add_subplot())
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=80)
    return f'<img alt="last output" src="data:image/png;base64,{base64.b64encode(stream.getvalue()).decode()}"/>'
