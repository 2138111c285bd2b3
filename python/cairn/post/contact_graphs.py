"""Contact networks and force chains as graphs of networkx."""

from __future__ import annotations

import numpy as np

from ..base import checks
from ..base.geometry import lever_arms
from ..base.libraries import library
from ..names import teach
from .measures import _grains, body_moments

ALONG = np.pi / 4  # rad: a contact continues a chain within that of the main stress of both bodies (Peters et al. 2005)
LEAST = 3  # bodies of a chain


def contact_graph(step, loaded=True, dt=None):
    """Makes a graph of the bodies and contacts of an output.

    Parameters
    ----------
    step : Step
        An output, as run[-1].
    loaded : bool, default True
        Takes contacts alone that carry an impulse.
    dt : float, optional
        Length of the step [s], from the history if not given.

    Returns
    -------
    networkx.Graph
        A node for each body, by its id, with `position`, and `radius` and `mass` where the run has them. An edge for each pair in
        contact: `normal_force`, `shear_force` [N] and `weight`, their resultant, summed over the points of contact (1 if the time
        step is unknown: impulses [N s]); `points`, how many; `normal` from the second id to the first, `gap` [m], the least.

    Raises
    ------
    ImportError
        If networkx is not installed.
    """
    nx = library("networkx", "for contact networks")
    graph = nx.Graph(time=float(step.time), dim=step.dim)
    drawn = step.drawn
    ids = np.asarray(drawn["id"]).tolist() if "id" in drawn else list(range(len(drawn)))
    known = {name: np.asarray(drawn[name]) for name in ("radius", "mass") if name in drawn}
    for k, (number, place) in enumerate(zip(ids, np.asarray(drawn["position"]))):
        graph.add_node(number, position=place, **{name: float(value[k]) for name, value in known.items() if value.ndim == 1})
    contacts = step.contacts
    if not len(contacts):
        return graph
    impulse, normal = np.asarray(contacts["impulse"]), np.asarray(contacts["normal"])
    a, b = np.asarray(contacts["body_a"]), np.asarray(contacts["body_b"])
    gap, h = np.asarray(contacts["gap"]), _step_length(step, dt)
    keep = np.any(impulse != 0, axis=1) if loaded else np.ones(len(a), bool)
    for i, j, r, n, g in zip(a[keep].tolist(), b[keep].tolist(), impulse[keep] / h, normal[keep], gap[keep]):
        sign = 1.0 if i <= j else -1.0  # sums are of forces on the lower id, whichever came first
        if not graph.has_edge(i, j):
            graph.add_edge(i, j, force=np.zeros(step.dim), normal=np.zeros(step.dim), points=0, gap=np.inf)
        edge = graph.edges[i, j]
        edge["force"], edge["normal"] = edge["force"] + sign * r, edge["normal"] + sign * n
        edge["points"], edge["gap"] = edge["points"] + 1, min(edge["gap"], float(g))
    for *_, edge in graph.edges(data=True):
        size = np.linalg.norm(edge["normal"])
        n = edge["normal"] = edge["normal"] / size if size > 0 else edge["normal"]
        edge["normal_force"] = float(edge["force"] @ n)
        edge["shear_force"] = float(np.linalg.norm(edge["force"] - (edge["force"] @ n) * n))
        edge["weight"] = float(np.linalg.norm(edge["force"]))
    return graph


def _step_length(step, dt):
    if dt is not None:
        return checks.positive("dt", dt)
    from .drawing import step_size

    h = step_size(step)
    return float(h) if h and np.isfinite(h) else 1.0


def force_chains(step, share=1.0, along=ALONG, least=LEAST, dt=None):
    """Finds force chains: rows of bodies that bear more than the mean, along the direction in which they are pressed.

    Parameters
    ----------
    step : Step
        An output, as run[-1].
    share : float, default 1
        A body of a chain bears at least that times the mean of the largest compressive stress of loaded bodies.
    along : float, default pi/4
        Largest angle between a contact's branch and the main direction of both bodies [rad].
    least : int, default 3
        Fewest bodies of a chain.
    dt : float, optional
        Length of the step [s], from the history if not given.

    Returns
    -------
    list of networkx.Graph
        Chains, the largest first: subgraphs of `contact_graph`, whose nodes have `compression` [N m] and `direction` too: largest
        compressive moment of the contact forces on the body (its stress times its volume) and the direction of it.

    Raises
    ------
    ImportError
        If networkx is not installed.
    """
    nx = library("networkx", "for contact networks")
    graph = contact_graph(step, True, dt)
    share, along, least = checks.positive("share", share), checks.positive("along", along), checks.count("least", least, 2)
    n, ids = len(step.drawn), list(graph)
    loaded = np.any(np.asarray(step.contacts["impulse"]) != 0, axis=1) if len(step.contacts) else np.zeros(0, bool)
    if not loaded.any():
        return []
    balls, others = _grains(step)
    grain = others.copy()
    grain[balls.body] = True
    row_a, row_b, arm_a, arm_b = (x[loaded] for x in lever_arms(step))
    force = np.asarray(step.contacts["impulse"])[loaded] / _step_length(step, dt)
    moment = body_moments(n, row_a, row_b, force, arm_a, arm_b)
    value, axes = np.linalg.eigh((moment + np.swapaxes(moment, 1, 2)) / 2)
    compression, direction = -value[:, 0], axes[:, :, 0]
    for k, number in enumerate(ids):
        graph.nodes[number]["compression"], graph.nodes[number]["direction"] = float(compression[k]), direction[k]
    bearing = np.zeros(n, bool)
    bearing[row_a] = bearing[row_b] = True
    bearing &= grain
    if not bearing.any():
        return []
    strong = bearing & (compression >= share * compression[bearing].mean())
    chained = nx.Graph()
    for i, j, branch in zip(row_a, row_b, arm_a - arm_b):
        length = np.linalg.norm(branch)
        if strong[i] and strong[j] and length > 0:
            if min(abs(branch @ direction[i]), abs(branch @ direction[j])) >= np.cos(along) * length:
                chained.add_edge(ids[i], ids[j])
    groups = sorted((sorted(c) for c in nx.connected_components(chained) if len(c) >= least), key=lambda c: (-len(c), c[0]))
    return [graph.edge_subgraph(chained.subgraph(c).edges).copy() for c in groups]


teach(globals())
