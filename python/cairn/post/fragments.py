"""Pieces that bonds still hold together."""

import numpy as np

from ..files.mesh_cells import meshes_of
from .load import Fields


def fragments(state, beta=0.0):
    """Ids of the bodies of each fragment: connected components of the graph of contacts whose adhesion exceeds beta.

    state: a Simulation, or an output of a run, `cn.load(file)[-1]`. beta: adhesion from 0 to 1 that a contact must exceed
    (`contacts.beta`) to join. Returns a list of arrays of ids, the largest fragment first, fragments of equal size by their
    smallest id; a body without such contacts is a fragment by itself. The nodes of a mesh count as one body, named by their
    smallest id; in a mesh whose faces open (cairn.fracture.split), nodes that its cells join.
    """
    written = isinstance(state.contacts, Fields)
    ids = np.sort(state.drawn["id"] if written else np.concatenate([state.bodies.id, state.nodes.id]))
    root = np.arange(len(ids))

    def of(i):
        while root[i] != i:
            root[i] = root[root[i]]
            i = root[i]
        return i

    def join(a, b):
        a, b = of(a), of(b)
        root[max(a, b)] = min(a, b)

    meshed = np.zeros(len(ids), bool)
    for piece in _written_pieces(state) if written else [p for mesh in state.meshes for p in _pieces_of(mesh)]:
        parts = np.searchsorted(ids, np.sort(piece))
        meshed[parts[1:]] = True
        for part in parts[1:]:
            join(parts[0], part)
    contacts = state.contacts
    pairs = np.column_stack([contacts["body_a"], contacts["body_b"]]) if written else np.asarray(contacts.bodies)
    for a, b in np.searchsorted(ids, pairs[np.asarray(contacts.beta) > beta]):
        join(a, b)
    roots = np.array([of(i) for i in range(len(ids))], dtype=np.int64)
    pieces = [ids[(roots == r) & ~meshed] for r in np.unique(roots)]
    return sorted(pieces, key=lambda piece: (-len(piece), piece[0]))


def _pieces_of(mesh):
    """Ids of the nodes of each part of a mesh that is one body."""
    opening = mesh._mesh.d.opening
    if opening is None:
        return [mesh.ids]
    part = opening.parts()
    return [mesh.ids[part == k] for k in range(part.max() + 1)]


def _written_pieces(step):
    """Fragments of all meshes of an output."""
    from ..model.components import parts_of

    out = []
    for mesh, opens in meshes_of(step):
        nodes = np.asarray(mesh["nodes"])
        if not opens:
            out.append(nodes)
            continue
        pairs = [np.stack([c[:, :-1], c[:, 1:]], -1).reshape(-1, 2) for c in map(np.asarray, mesh["cells"].values())]
        part = parts_of(np.concatenate(pairs), len(nodes))
        out += [nodes[part == k] for k in range(part.max() + 1)]
    return out
