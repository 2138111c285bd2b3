"""Crack patterns: how far joints have opened and slipped, along each joint, for rigid blocks and for blocks that are meshes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..names import teach
from ..pre.block_meshes import FLUSH, MeshedBlocks

SAMPLES = 9  # places along a joint between meshes
WIDEST = 0.3  # drawn width of the largest opening, over the median extent of blocks
SOUND = 1e-5  # opening or slip, over the median extent of blocks, below which a joint counts as sound
NARROWEST = 0.012  # drawn width of joints that slipped without opening, over the median extent of blocks


@dataclass(frozen=True)
class Cracks:
    """Openings of k joints, from the start on.

    Parameters
    ----------
    blocks : ndarray (k, 2)
        Numbers of the blocks of each joint.
    points : list of ndarray (m, dim)
        Places on the joint where it was measured [m], at the start.
    opening : list of ndarray (m,)
        Separation along the normal [m], below 0 where blocks overlap or zones are pressed.
    slip : list of ndarray (m,)
        Relative displacement along the joint [m].
    damage : ndarray (k,)
        1 minus the mean of beta over the contacts of the joint: 0 sound, 1 broken; nan without contacts that laws hold.
    """

    blocks: np.ndarray
    points: list
    opening: list
    slip: list
    damage: np.ndarray

    def __len__(self):
        return len(self.blocks)

    @property
    def widest(self):
        """Largest opening of each joint (k,) [m]."""
        return np.array([np.max(o, initial=0.0) for o in self.opening])

    @property
    def largest_slip(self):
        """Largest slip of each joint (k,) [m]."""
        return np.array([np.max(s, initial=0.0) for s in self.slip])


class MeshedStructure:
    """Blocks of which some are meshes, in a simulation.

    Parameters
    ----------
    meshed : MeshedBlocks
        What cairn.pre.masonry.mesh made.
    simulation : Simulation
        The simulation.
    ids : list of ndarray
        Ids of each block, as `meshed.add_to` gave them.

    Raises
    ------
    ValueError
        If there are not as many ids as blocks.
    """

    def __init__(self, meshed, simulation, ids):
        if not isinstance(meshed, MeshedBlocks):
            raise ValueError(f"meshed is {meshed!r}: give what cairn.pre.masonry.mesh(...) made")
        if len(ids) != len(meshed):
            raise ValueError(f"ids has length {len(ids)}: give those of the {len(meshed)} blocks that meshed.add_to returned")
        wrong = [k for k, of in enumerate(ids) if not len(np.atleast_1d(of)) or (meshed.soft[k] and np.size(of) < 2)]
        if wrong:
            raise ValueError(f"ids[{wrong[0]}] is {ids[wrong[0]]!r}: give the list of arrays that meshed.add_to returned")
        self.meshed, self.blocks, self.simulation, self.ids = meshed, meshed.blocks, simulation, [np.atleast_1d(of) for of in ids]
        self.dim, self.held = meshed.blocks.dim, meshed.blocks.mask("support")
        self._mesh_of = {int(m.ids[0]): k for k, m in enumerate(simulation.meshes)}
        rigid = np.flatnonzero(~meshed.soft)
        self._rigid = None
        if len(rigid):
            from .masonry import Structure

            self._rigid = Structure(self.blocks.select(rigid), simulation, [int(self.ids[k][0]) for k in rigid])
            self._row = {int(k): row for row, k in enumerate(rigid)}

    def mesh(self, k):
        """The mesh of a block (MeshView); None of a rigid one."""
        return self.simulation.meshes[self._mesh_of[int(self.ids[k][0])]] if self.meshed.soft[k] else None

    def displaced(self, k, points):
        """Displacements (m, dim) [m] of points of a block, given at the start."""
        mesh = self.mesh(k)
        if mesh is None:
            return self._rigid.moved(points, np.full(len(points), self._row[k])) - points
        return _interpolated(mesh.body.points, mesh.displacement, points)

    def displacement(self):
        """How far the middle of each block has moved, (n,) [m]; of a mesh the mean of its nodes."""
        moved = [np.zeros(0)] * len(self.blocks)
        for k, corners in enumerate(self.blocks.vertices):
            mesh = self.mesh(k)
            of = self.displaced(k, corners.mean(axis=0)[None]) if mesh is None else mesh.displacement
            moved[k] = np.linalg.norm(of.mean(axis=0))
        return np.array(moved)

    def stress(self):
        """Mean stress (n, dim, dim) [Pa] of each block that is a mesh; nan of rigid ones."""
        out = np.full((len(self.blocks), self.dim, self.dim), np.nan)
        place = {2: [(0, 0), (1, 1), (0, 1)], 3: [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)]}[self.dim]
        for k in np.flatnonzero(self.meshed.soft):
            mean = np.concatenate(list(self.mesh(k).stress.values())).mean(axis=0)
            for value, (i, j) in zip(mean, place):
                out[k, i, j] = out[k, j, i] = value
        return out

    def places(self):
        """Middles (n, dim) [m] of the blocks at the start, and nothing for rotations."""
        return np.array([v.mean(axis=0) for v in self.blocks.vertices]), None

    def moved(self, points, block):
        """Present positions of points (m, dim) given at the start on blocks (m,)."""
        out = np.array(points, float)
        for k in np.unique(block):
            out[block == k] += self.displaced(int(k), points[block == k])
        return out


def cracks(structure) -> Cracks:
    """Measures how the joints of a structure have opened and slipped since the start.

    Parameters
    ----------
    structure : Structure or MeshedStructure
        Blocks in a simulation.

    Returns
    -------
    Cracks
        Openings and slips at the corners of joints between rigid blocks, at more places between meshes.
    """
    _checked(structure)
    meshed = isinstance(structure, MeshedStructure)
    joints = structure.meshed.joints if meshed else structure.joints()
    points, opening, slip = [], [], []
    for (a, b), normal, polygon in zip(joints.blocks.tolist(), joints.normal, joints.polygon):
        at = _places_on(polygon, structure.meshed.soft[[a, b]].any()) if meshed else np.asarray(polygon)
        if meshed:
            apart = structure.displaced(a, at) - structure.displaced(b, at)
            n = np.tile(normal, (len(at), 1))
        else:
            first, second = np.full(len(at), a), np.full(len(at), b)
            there = structure.moved(at, second)
            apart, n = structure.moved(at, first) - there, structure.moved(at + normal, second) - there
        across = np.einsum("ij,ij->i", apart, n)
        points.append(at)
        opening.append(across)
        slip.append(np.linalg.norm(apart - across[:, None] * n, axis=1))
    return Cracks(joints.blocks, points, opening, slip, _damage(structure, joints.blocks))


def _checked(structure):
    from .masonry import Structure

    if not isinstance(structure, (MeshedStructure, Structure)):
        told = f"structure is {structure!r}"
        raise ValueError(f"{told}: give cairn.post.masonry.Structure(blocks, simulation, ids), or MeshedStructure of meshes")


def _places_on(polygon, soft):
    """Places (m, dim) on a joint: its ends or corners, more of them between meshes."""
    polygon = np.asarray(polygon)
    if not soft:
        return polygon
    if polygon.shape[1] == 2:
        return polygon[0] + np.linspace(0, 1, SAMPLES)[:, None] * (polygon[1] - polygon[0])
    middle = polygon.mean(axis=0)
    return np.concatenate([polygon, (polygon + np.roll(polygon, 1, axis=0)) / 2, (polygon + middle) / 2, middle[None]])


def _interpolated(nodes, values, points):
    """Values (n, dim) of nodes at points (m, dim) on a plane side, linear between the nodes of that side."""
    size = np.max(np.ptp(nodes, axis=0))
    centre = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - centre)
    if nodes.shape[1] == 2:
        along, normal = axes[0], np.array([-axes[0][1], axes[0][0]])
        if len(points) < 2:
            near = np.argmin(np.linalg.norm(nodes - points[0], axis=1))
            return values[[near]]
        on = np.abs((nodes - centre) @ normal) <= FLUSH * size
        s = (nodes[on] - centre) @ along
        order = np.argsort(s)
        return np.stack([np.interp((points - centre) @ along, s[order], v[order]) for v in values[on].T], axis=1)
    from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator

    on = np.abs((nodes - centre) @ axes[2]) <= FLUSH * size
    plane, wanted = (nodes[on] - centre) @ axes[:2].T, (points - centre) @ axes[:2].T
    found = LinearNDInterpolator(plane, values[on])(wanted)
    off = np.isnan(found).any(axis=1)
    if off.any():  # on the border, outside by rounding
        found[off] = NearestNDInterpolator(plane, values[on])(wanted[off])
    return found


def _damage(structure, pairs):
    """Damage of each joint, 1 less the mean adhesion beta over its contacts; nan where no cohesive law acts."""
    contacts = structure.simulation.contacts
    held = contacts.of_laws().get("beta")
    out = np.full(len(pairs), np.nan)
    if held is None or not len(held):
        return out
    owner = {}
    for k, ids in enumerate(structure.ids):
        owner |= dict.fromkeys(np.atleast_1d(ids).tolist(), k)
    number = {tuple(sorted(pair)): j for j, pair in enumerate(pairs.tolist())}
    bonded = (held > 0) | (np.asarray(contacts.releases()) > 0)  # others never were
    total, count = np.zeros(len(pairs)), np.zeros(len(pairs))
    for (a, b), beta in zip(np.asarray(contacts.bodies).reshape(-1, 2)[bonded].tolist(), held[bonded]):
        j = number.get(tuple(sorted((owner.get(a, -1), owner.get(b, -1)))))
        if j is not None:
            total[j], count[j] = total[j] + beta, count[j] + 1
    out[count > 0] = 1 - total[count > 0] / count[count > 0]
    return out


def draw(structure, ax=None, *, colour="slip", axes=(0, 2), magnify=None, least=0.01, title=None, largest=None):
    """Draws the crack pattern: each joint as wide as it has opened along its length, coloured by slip or damage.

    Parameters
    ----------
    structure : Structure or MeshedStructure
        Blocks in a simulation.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if not given.
    colour : {"slip", "damage"}
        Slip along the joint [mm], or 1 - beta of the laws that hold it.
    axes : tuple of int, default (0, 2)
        Axes of the picture in 3D.
    magnify : float, optional
        Width drawn over the opening; chosen from the largest opening, and told, if not given.
    least : float, default 0.01
        Joints whose opening and slip are below this share of the largest of all, or below 1e-5 of the extent of blocks, are drawn
        as sound.
    title : str, optional
        Title.
    largest : float, optional
        End of the colours [mm], or of damage.

    Returns
    -------
    matplotlib.axes.Axes
        The axes.

    Raises
    ------
    ValueError
        If the colour is unknown.
    """
    from matplotlib.collections import LineCollection, PolyCollection

    from .drawing import PALE, _pyplot

    _checked(structure)
    if colour not in ("slip", "damage"):
        raise ValueError(f'colour is {colour!r}: give "slip" or "damage"')
    found, keep = cracks(structure), list(axes) if structure.dim == 3 else [0, 1]
    from .masonry_plots import hull_2d

    shapes = [v if structure.dim == 2 else hull_2d(v[:, keep]) for v in structure.blocks.vertices]
    low, high = np.min([s.min(axis=0) for s in shapes], axis=0), np.max([s.max(axis=0) for s in shapes], axis=0)
    if ax is None:
        ratio = (high - low)[1] / (high - low)[0]
        ax = _pyplot().subplots(figsize=(10.0, float(np.clip(10 * ratio + 0.8, 3, 10))), layout="constrained")[1]
    grey = ["#b5b0a4" if h else PALE for h in structure.held]
    ax.add_collection(PolyCollection(shapes, facecolors=grey, edgecolors="#a39d8f", linewidths=0.6))
    extent = float(np.median([np.max(np.ptp(s, axis=0)) for s in shapes]))
    widest, slid = found.widest, found.largest_slip
    least = max(least * np.max(widest, initial=0.0), least * np.max(slid, initial=0.0), SOUND * extent)
    if magnify is None:
        magnify = WIDEST * extent / widest.max() if np.any(widest > least) else 1.0
    values = slid * 1e3 if colour == "slip" else found.damage
    outlines, shown, lines = [], [], []
    for k, points in enumerate(found.points):
        flat = points[:, keep]
        if max(widest[k], slid[k]) <= least:
            continue
        outline, line = _wedge(flat, found.opening[k], magnify, NARROWEST * extent)
        outlines.append(outline), lines.append(line), shown.append(values[k])
    if outlines:
        drawn = PolyCollection(outlines, cmap="plasma", array=np.array(shown), edgecolors="#40303a", linewidths=0.3, zorder=3)
        end = largest or (1.0 if colour == "damage" else float(np.nanmax(shown)) or 1.0)
        drawn.set_clim(0.0, end)
        ax.add_collection(drawn)
        label = "slip [mm]" if colour == "slip" else "damage, 1 - beta"
        ax.figure.colorbar(drawn, ax=ax, label=label, shrink=0.7, pad=0.01)
    ax.add_collection(LineCollection(lines, colors="#40303a", linewidths=0.5, zorder=2))
    told = (
        f"width: openings x {magnify:.3g}, largest {widest.max(initial=0.0) * 1e3:.3g} mm" if outlines else "no joint has opened"
    )
    room = 0.03 * np.max(high - low)
    names = [f"{'xyz'[k]} [m]" for k in keep]
    ax.set(aspect="equal", xlim=(low[0] - room, high[0] + room), ylim=(low[1] - room, high[1] + room), xlabel=names[0],
           ylabel=names[1], title=told if title is None else f"{title}\n{told}")  # fmt: skip
    return ax


def _wedge(points, opening, magnify, least):
    """Outline (2 m, 2) as wide as the joint is open along its length, and the line of the joint (2, 2). Joints seen from the
    front (3D) are drawn along their longer side."""
    centre = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - centre, full_matrices=True)
    along, across = axes[0], np.array([-axes[0][1], axes[0][0]])
    s = (points - centre) @ along
    places = np.unique(np.round(s / max(np.ptp(s), 1e-300), 6))
    nearest = np.argmin(np.abs(places[:, None] * np.ptp(s) - s), axis=0)
    width = np.zeros(len(places))
    np.maximum.at(width, nearest, np.maximum(opening, 0.0))
    half = np.maximum(width * magnify, least)[:, None] / 2
    middle = centre + (places * np.ptp(s))[:, None] * along
    return np.concatenate([middle + half * across, (middle - half * across)[::-1]]), middle[[0, -1]]


teach(globals())
