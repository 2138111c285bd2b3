"""Representations of a scene, a simulation and a run in print and notebooks: a small table, for a run with its last picture."""

import base64
import html
import io

import numpy as np


def table(title, rows):
    """A table of names and values as HTML; texts from files and users are escaped."""
    pairs = ((html.escape(str(name)), html.escape(str(value))) for name, value in rows)
    cells = "".join(f"<tr><td><b>{name}</b></td><td>{value}</td></tr>" for name, value in pairs)
    return f"<table><caption>{html.escape(title)}</caption>{cells}</table>"


LAWS = 4  # that print shows


def of_scene(scene):
    """Contents of a scene as an HTML table."""
    rows = rows_of_scene(scene)
    rows += [("law", f"{a}, {b}: {law!r}") for a, b, law in _rules(scene)[:12]]
    return table(f"Scene, {scene.dim}D", rows)


def rows_of_scene(scene):
    """Contents of a scene as names and values, without its laws."""
    gravity = "a function of time" if callable(scene.gravity) else ", ".join(f"{g + 0.0:g}" for g in np.ravel(scene.gravity))
    materials = sorted({c.material.name for s in scene.sets for c in s.contactors if not c.joint})
    meshes = [s.mesh.name for s in scene.sets if s.mesh is not None]
    joints = sum(law is not None and law.name == "joint" for _, _, law in scene.rules)
    rows = [("dimensions", scene.dim), ("gravity [m/s2]", gravity), ("rigid bodies", counted(scene))]
    rows += [("meshes", _few(list(dict.fromkeys(meshes))))] if meshes else []
    rows += [("materials", _few(materials))] if materials else []
    rows += [("joints", joints)] if joints else []
    rows += [("networks", ", ".join(scene.networks))] if scene.networks else []
    rows += [("periodic", repr(scene.periodic))] if scene.periodic is not None else []
    return rows


def counted(scene):
    """'51: 50 disk, 1 half_plane', of rigid bodies by the shape of the first of their contactors."""
    shapes, many = {}, 0
    for s in scene.sets:
        own = [c for c in s.contactors if not c.joint]
        if s.mesh is None and s.mass is not None and own:
            name = own[0].shape if len(own) == 1 and len(own[0].body) == len(s) else "of several parts"
            shapes[name], many = shapes.get(name, 0) + len(s), many + len(s)
    return f"{many:,}" + (": " + ", ".join(f"{n:,} {name}" for name, n in shapes.items()) if shapes else "")


def _rules(scene):
    return [(a, b, law) for a, b, law in scene.rules if "joint" not in (a.partition(" ")[0], b.partition(" ")[0])]


def _few(names, most=6):
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def lines_of_scene(scene):
    """At most ten lines on a scene."""
    rows, rules = rows_of_scene(scene)[1:], _rules(scene)
    lines = [f"Scene, {scene.dim}D", *(f"{name}: {_short(value)}" for name, value in rows)]
    room = min(LAWS, 9 - len(lines))
    lines += [f"law of {a}, {b}: {_short(law)}" for a, b, law in rules[:room]]
    return "\n".join(lines + ([f"and {len(rules) - room} more laws"] if len(rules) > room else []))


def _short(value, most=120):
    text = " ".join(str(value).split())
    return text if len(text) <= most else text[: most - 3] + "..."


def line_of_simulation(simulation):
    """One line on a simulation."""
    status = simulation.report.get("status")
    return (f"<simulation, {simulation.scene.dim}D: {len(simulation.bodies):,} bodies, t = {simulation.time:g} s, "
            f"{simulation.steps:,} steps of {simulation.dt:g} s" + (f", the last {status}" if status else "") + ">")  # fmt: skip


def line_of_set(s):
    """One line on a set of bodies."""
    parts = ", ".join(f"{len(c.body):,} {c.shape} of {c.material.name!r}" for c in s.contactors)
    mass = np.ravel(s.mass if s.mass is not None else [])
    mass = mass[np.isfinite(mass)]
    told = f"; mass {mass.min():.4g} to {mass.max():.4g} kg" if mass.size else ""
    held = f"; driven {', '.join(s.driven)}" if s.driven else ""
    return f"<{len(s):,} bodies, {s.dim}D: {parts or 'no contactors'}{told}{held}" + (f"; group {s.group!r}>" if s.group else ">")


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
    """Contents of a run as an HTML table, with a picture of the last output if matplotlib is installed."""
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
