"""Reader of LMGC90's stored results: OUTBOX text files and lmgc90.h5."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..base.errors import DAMAGE
from ..files.hdf5 import read_foreign
from . import datbox
from .mesh import read_mesh_states
from .text import LegacyError, Reader


@dataclass
class Instant:
    """A stored instant. Rigid bodies by their number - 1: displacement (n, dim) [m] from BODIES.DAT, angle (n,) in 2D or
    frame (n, 3, 3), velocity (n, dofs) with the spin in space axes; contacts, or None if they are not stored; meshes: {number:
    (displacement, velocity)}, each (nodes, dim)."""

    step: int
    time: float
    displacement: np.ndarray
    velocity: np.ndarray
    angle: np.ndarray | None = None
    frame: np.ndarray | None = None
    contacts: dict | None = None
    meshes: dict = field(default_factory=dict)


def _instant(step, time, states, dim=2):
    numbers = sorted(states)
    if not numbers:
        return Instant(step, time, np.zeros((0, dim)), np.zeros((0, 3 * dim - 3)))
    dim = datbox.DIMENSION[numbers[0][0]]
    n = max(number for _, number in numbers)
    i = Instant(step, time, np.zeros((n, dim)), np.zeros((n, 3 * dim - 3)))
    if dim == 2:
        i.angle = np.zeros(n)
    else:
        i.frame = np.tile(np.eye(3), (n, 1, 1))
    for (_, number), s in states.items():
        i.displacement[number - 1] = s.displacement[:dim]
        i.velocity[number - 1] = s.velocity
        if dim == 2:
            i.angle[number - 1] = s.displacement[2]
        else:
            i.velocity[number - 1, 3:] = s.frame @ s.velocity[3:]
            i.frame[number - 1] = s.frame
    return i


def read_dof(path, meshes=()):
    """Instant of a DOF.OUT or DOF.INI file. meshes: of the Datbox, to read their nodes as well."""
    instant = _instant(*datbox.read_states(path), len(meshes[0].points[0]) if meshes else 2)
    if meshes:
        instant.meshes = read_mesh_states(path, meshes)
    return instant


def read_contacts(path):
    """Contacts of a Vloc_Rloc file: bodies (n, 2) from 0, candidate first; meshed (n, 2), True for meshes; gap (n,) as written;
    force (n, 3) on the candidate along n, t, s, 0 for s in 2D; velocity likewise; normal (n, 3); point (n, 3); kind, status and
    law, lists of names."""
    reader = Reader(path)
    rows = {
        "bodies": [],
        "meshed": [],
        "kind": [],
        "status": [],
        "law": [],
        "gap": [],
        "force": [],
        "velocity": [],
        "normal": [],
        "point": [],
    }
    while not reader.ended:
        line = reader.next()
        if not line.startswith("$icdan"):
            continue
        rows["kind"].append(line[8:13].strip())
        reader.next()
        line = reader.next()
        found = re.findall(r"(RBDY2|RBDY3|MAILx)\s+(\d+)", line)
        if len(found) != 2:
            reader.fail("two bodies were expected")
        rows["bodies"].append([int(number) - 1 for _, number in found])
        rows["meshed"].append([kind == "MAILx" for kind, _ in found])
        status = re.search(r"\b(noctc|stick|slide|slifw|slibw|vnish|nknow|C(?:stck|slid|slfw|slbw|nctc))\b", line)
        rows["status"].append(status[1] if status else "")
        rows["law"].append(line[29:34].strip() if line[36:41].strip() in ("RBDY2", "MAILx") else line[36:41].strip())
        values = {}
        while not reader.ended and not reader.line.startswith("$") and re.match(r"\s{29}\S", reader.line):
            text = reader.next()
            for c in (30, 51, 72):
                if text[c - 1 : c + 4].strip():
                    values[text[c - 1 : c + 4].strip().rstrip("=").strip()] = reader.number(text, c + 5, c + 18)
        _take(rows, values)
    words = {name: rows.pop(name) for name in ("kind", "status", "law")}
    arrays = {name: np.array(found, float).reshape(len(found), -1) for name, found in rows.items()}
    meshed = arrays["meshed"].astype(bool).reshape(-1, 2)
    return words | arrays | {
        "gap": arrays["gap"].ravel(), "bodies": arrays["bodies"].astype(int).reshape(-1, 2), "meshed": meshed
    }  # fmt: skip


def _take(rows, values):
    # in 2D the tangent is (n_y, -n_x), opposite to Cairn's; in 3D only sums over tangents are compared
    rows["gap"].append(values.get("gapTT", values.get("gTT", np.nan)))
    rows["force"].append([values.get(k, 0.0) for k in ("rln/H", "rlt/H", "rls/H")])
    rows["velocity"].append([values.get(k, 0.0) for k in ("vln", "vlt", "vls")])
    rows["normal"].append([values.get(f"n({k})", 0.0) for k in (1, 2, 3)])
    rows["point"].append([values.get(f"coo{k}", 0.0) for k in (1, 2, 3)])


def read_outbox(folder, meshes=()):
    """All instants of an OUTBOX folder, by rising step, with their contacts. meshes: as for read_dof."""
    folder = Path(folder)
    if (folder / "OUTBOX").is_dir():
        folder = folder / "OUTBOX"
    files = sorted(folder.glob("DOF.OUT.*"), key=lambda p: int(p.suffix[1:]) if p.suffix[1:].isdigit() else 0)
    if not files:
        raise LegacyError(f"{folder}: there is no DOF.OUT file; give an OUTBOX folder, or the folder that holds it")
    instants = []
    for path in files:
        instant = read_dof(path, meshes)
        beside = folder / path.name.replace("DOF", "Vloc_Rloc")
        instant.contacts = read_contacts(beside) if beside.is_file() else None
        instants.append(instant)
    return sorted(instants, key=lambda i: i.step)


def read_h5(path, meshes=()):
    """All instants of an lmgc90.h5 file, by rising step. meshes: as for read_dof."""

    def instants(f):
        names = {int(i): n for i, n in _table(f, "inter_id")}
        status = {int(i): n for i, n in _table(f, "status")}
        groups = sorted((g for _, g in f["Evolution"].items()), key=lambda g: int(np.ravel(g["NStep"][()])[0]))
        dim = int(np.ravel(f["Simulation/dimension"][()])[0])
        return [_h5_instant(path, g, names, status, dim, meshes) for g in groups]

    try:
        return read_foreign(path, instants)
    except LegacyError:
        raise
    except (OSError, *DAMAGE) as error:
        raise LegacyError(f"{path}: is no lmgc90.h5 that can be read ({error})") from error


def _table(f, name):
    group = f[f"Help/parameters/{name}"]
    texts = [t.decode().strip() if isinstance(t, bytes) else str(t).strip() for t in np.ravel(group["name"][()])]
    return zip(np.ravel(group["id"][()]), texts)


def _h5_instant(path, g, names, status, dim, meshes):
    step, time = int(np.ravel(g["NStep"][()])[0]), float(np.ravel(g["TPS"][()])[0])
    states = {}
    if "RBDY2" in g:
        for k, row in enumerate(g["RBDY2/rdata"][()]):
            states["RBDY2", k + 1] = datbox.BodyState(row[:3], row[3:6])
    elif "RBDY3" in g:
        for k, row in enumerate(g["RBDY3/rdata"][()]):
            states["RBDY3", k + 1] = datbox.BodyState(row[:3], row[6:12], row[12:21].reshape(3, 3).T)
    instant = _instant(step, time, states, dim)
    if meshes:
        instant.meshes = _h5_meshes(path, g, meshes, dim)
    if "VlocRloc" in g and (len(states) or meshes):
        i, r = g["VlocRloc/idata"][()], g["VlocRloc/rdata"][()]
        flat = dim == 2
        n = len(i)
        pad = np.zeros((n, 1))
        instant.contacts = {
            "bodies": i[:, 6:8] - 1,
            "meshed": i[:, 4:6] == 3,
            "kind": [names.get(int(k), str(k)) for k in i[:, 0]],
            "status": [status.get(int(k), str(k)) for k in i[:, 18]],
            "gap": r[:, 4] if flat else r[:, 6],
            "force": np.hstack([r[:, [1, 0]], pad]) if flat else r[:, [1, 0, 2]],
            "velocity": np.hstack([r[:, [3, 2]], pad]) if flat else r[:, [4, 3, 5]],
            "normal": np.hstack([r[:, 7:9], pad]) if flat else r[:, 13:16],
            "point": np.hstack([r[:, 5:7], pad]) if flat else r[:, 7:10],
        }
    return instant


def _h5_meshes(path, g, meshes, dim):
    """{mesh: (displacement, velocity)} of mechanical meshes; the file holds no thermal ones here."""
    if "MAILx/mecax/displacement" not in g:
        return {}
    last = np.cumsum([len(m.points) for m in meshes])
    displacement, velocity = g["MAILx/mecax/displacement"][()], np.ravel(g["MAILx/mecax/dofs"][()])
    if displacement.shape != (last[-1], dim) or len(velocity) != last[-1] * dim:
        raise LegacyError(
            f"{path}: has displacements of shape {displacement.shape} and {len(velocity)} velocities, BODIES.DAT "
            f"{last[-1]} nodes of meshes in {dim}D; give one case"
        )
    velocity = velocity.reshape(-1, dim)
    return {m.number: (displacement[k - len(m.points) : k], velocity[k - len(m.points) : k]) for m, k in zip(meshes, last)}


def read_results(path, meshes=()):
    """Instants stored by LMGC90: in an lmgc90.h5 file, a DOF.OUT file, or the folder of a case (lmgc90.h5 if it has one, else its
    OUTBOX). meshes: as for read_dof."""
    path = Path(path)
    if path.is_dir():
        return read_h5(path / "lmgc90.h5", meshes) if (path / "lmgc90.h5").is_file() else read_outbox(path, meshes)
    if path.suffix == ".h5":
        return read_h5(path, meshes)
    return [read_dof(path, meshes)]


def states_of(path, step=None):
    """{(type, number): BodyState} of a stored instant. step: number of its step in an .h5 file, None for the last."""
    path = Path(path)
    if path.suffix != ".h5":
        return datbox.read_states(path)[2]
    instants = read_h5(path)
    chosen = [i for i in instants if step is None or i.step == step]
    if not chosen:
        raise LegacyError(f"{path}: holds no step {step}; it holds {', '.join(str(i.step) for i in instants)}")
    i = chosen[-1]
    if i.frame is None:
        rows = zip(np.column_stack([i.displacement, i.angle]), i.velocity)
        return {("RBDY2", k + 1): datbox.BodyState(x, v) for k, (x, v) in enumerate(rows)}
    spin = np.einsum("nji,nj->ni", i.frame, i.velocity[:, 3:])
    velocity = np.hstack([i.velocity[:, :3], spin])
    return {("RBDY3", k + 1): datbox.BodyState(*row) for k, row in enumerate(zip(i.displacement, velocity, i.frame))}
