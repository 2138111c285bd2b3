"""Summary of the contents of a file in figures: `cairn info`."""

import os

import numpy as np

from ..base.errors import FileError
from ..files import checkpoint
from ..files.hdf5 import File
from .load import load, open_run


def describe(path):
    """Facts of a run, a scene or a checkpoint, as a nested dict. Raises FileError."""
    if _is_checkpoint(path):
        return _describe_checkpoint(path)
    open_run(path).close()
    with load(path) as run:
        facts = {
            "file": {"path": run.path, "size": f"{os.path.getsize(run.path) / 1e6:.3g} MB", "kind": f"run, {run.dim}D"},
            "outputs": {"count": len(run)},
        }
        if len(run):
            last = run[-1]
            facts["outputs"] |= {
                "times": f"{run.times[0]:.6g} to {run.times[-1]:.6g} s",
                "last step": last.step,
                "bodies": len(last.bodies),
                **({"nodes of meshes": len(last.nodes)} if len(last.nodes) else {}),
                **({"particles of the liquid": len(last.fluid)} if len(last.fluid) else {}),
                "contacts": len(last.contacts),
                "fields of bodies": ", ".join(last.bodies.names),
                **({"fields of nodes": ", ".join(last.nodes.names)} if len(last.nodes) else {}),
                **({"fields of the liquid": ", ".join(last.fluid.names)} if len(last.fluid) else {}),
                "fields of contacts": ", ".join(last.contacts.names),
            }
        history = run.history
        if history and len(history["step"]):
            facts["solver"] = _solver(history)
            facts |= {"energy": energy} if (energy := _energy(history)) else {}
        scene = run.scene
        facts["scene"] = {
            name: scene[name] if isinstance(scene[name], (str, int, float)) else ", ".join(map(str, np.ravel(scene[name])))
            for name in scene
            if not isinstance(scene[name], dict) and name not in ("shapes", "mark", "core_mark") and np.size(scene[name]) <= 40
        }
        if "fluid" in scene:
            facts["liquid"] = {k: v for k, v in scene["fluid"].items() if isinstance(v, (str, int, float, np.generic))}
        facts["made by"] = {k: v for k, v in run.provenance.items() if k != "script_text" and not isinstance(v, dict)}
        return facts


def _is_checkpoint(path):
    try:
        with File(path) as file:
            return file.attrs.get("format") == checkpoint.FORMAT_NAME
    except FileError:
        return False


def _describe_checkpoint(path):
    content = checkpoint.load(path)
    kind = content.get("kind", "checkpoint")
    facts = {"file": {"path": os.fspath(path), "size": f"{os.path.getsize(path) / 1e6:.3g} MB", "kind": kind}}
    plain = {k: v for k, v in content.items() if isinstance(v, (str, int, float, np.generic)) and k != "kind"}
    facts["content"] = plain | {k: f"{len(v)} entries" for k, v in content.items() if isinstance(v, dict)}
    state = content.get("state", {})
    if {"time", "steps", "scene"} <= set(state):
        bodies = len(state["scene"]["bodies"]["id"])
        facts["state"] = {"time": f"{state['time']:.6g} s", "steps": state["steps"], "bodies": bodies}
    if "fluid" in state:
        facts["liquid"] = _liquid(state["fluid"])
    return facts


def _liquid(state):
    """Facts of the particles of a checkpoint."""
    density, ends = np.asarray(state["density"]), np.asarray(state.get("end", []))
    facts = {"particles": len(density), "form": "incompressible" if "held_pressure" in state else "weakly compressible"}
    if len(density):
        facts["density"] = f"{density.min():.6g} to {density.max():.6g} kg/m3"
    if len(ends):
        facts["in open ends"] = int(np.count_nonzero(ends))
    return facts


def _solver(history):
    result = {"steps taken": len(history["step"])}
    if "error" in history:
        error = history["error"][np.isfinite(history["error"])]
        if len(error):
            result |= {"error, median": f"{np.median(error):.3g}", "error, largest": f"{error.max():.3g}"}
    if "penetration" in history and np.any(np.isfinite(history["penetration"])):
        at = int(np.nanargmax(history["penetration"]))
        size = f"{history['penetration'][at]:.3g} of the smaller body's size"
        result["overlap, largest"] = f"{size}, in step {int(history['step'][at])}"
    if "iterations" in history:
        result |= {
            "iterations, mean": f"{np.nanmean(history['iterations']):.4g}",
            "iterations, most": int(np.nanmax(history["iterations"])),
        }
    if "contacts" in history:
        result["contacts, most"] = int(np.nanmax(history["contacts"]))
    if "status" in history:
        words, counts = np.unique(history["status"], return_counts=True)
        result["status"] = ", ".join(f"{word or 'none'} {count}" for word, count in zip(words, counts, strict=True))
    return result


def _energy(history):
    last = {name.removeprefix("energy_"): value[-1] for name, value in history.items() if name.startswith("energy_")}
    last.pop("created", None)
    result = {name.replace("_", " "): f"{value:.6g} J" for name, value in last.items() if value != 0}
    if last.get("in_play"):
        result["closure / in play"] = f"{abs(last.get('closure', 0.0)) / last['in_play']:.2g}"
    return result


def render(facts):
    """The facts as text, in two columns."""
    lines = []
    for title, entries in facts.items():
        lines.append(title)
        width = max((len(str(name)) for name in entries), default=0)
        lines += [f"  {name:<{width}}  {value}" for name, value in entries.items()]
    return "\n".join(lines)
