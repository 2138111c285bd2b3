"""Blocks as meshes: cells of convex blocks, and assemblies of deformable blocks whose joints are left to a contact law.

Blocks with the sides of a quadrilateral or of a cube get a grid of quadrilaterals or hexahedra, others triangles or tetrahedra
about their middle. Meshes of neighbours need not match: a law of the joint acts between the nodes of a side and the side across.
"""

from __future__ import annotations

import importlib
import warnings
from dataclasses import dataclass, field

import numpy as np

from ..base import checks
from .blocks import Blocks
from .import_report import BlocksWarning

FLUSH = 1e-6  # of a block's size: nodes nearer to the plane of a side lie on it
SOFT = 1e6  # Pa: a smaller Young's modulus of blocks is told, since it is probably one in GPa or MPa
FEW = 4  # cells along the longest edge of a block of triangles or tetrahedra at least, unless a size is given
LARGEST = 30_000  # cells of a block
MOST = 24  # cells along an edge of a block

# corners of a hexahedron in the order of meshio, by their coordinates in the unit cube
UNIT = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])


@dataclass
class MeshedBlocks:
    """Blocks of which some are meshes.

    Parameters
    ----------
    blocks : Blocks
        The n blocks.
    points : list
        Nodes (p, dim) [m] of each block; None for blocks that stay rigid.
    cells : list
        Cells {kind: (c, nodes)} of each block; None for blocks that stay rigid.
    sides : list
        Of each block {number of a joint: nodes on it}.
    young, poisson : float
        Young's modulus [Pa] and Poisson's ratio of the meshes.
    joint : Law or None
        Law of all joints, given to a scene by `add_to`.
    """

    blocks: Blocks
    points: list
    cells: list
    sides: list
    young: float
    poisson: float
    joint: object = None
    joints: object = field(default=None, repr=False)

    def __len__(self):
        return len(self.blocks)

    def __repr__(self):
        soft = [p for p in self.points if p is not None]
        cells = sum(len(c) for kinds in self.cells if kinds for c in kinds.values())
        return (f"<{len(self)} blocks, {len(soft)} of them meshes of {sum(map(len, soft)):,} nodes and {cells:,} cells, "
                f"{len(self.joints.area)} joints>")  # fmt: skip

    @property
    def soft(self):
        """Mask (n,) of the blocks that are meshes."""
        return np.array([p is not None for p in self.points], bool)

    def add_to(self, scene, material, *, rayleigh=None, plane="strain", rigid_options=None, **options):
        """Adds the blocks to a scene, and the law of the joints if there is one.

        Parameters
        ----------
        scene : Scene
            The scene.
        material : Material
            Material of all blocks; its density [kg/m3] is that of the meshes.
        rayleigh : tuple of float, optional
            Factors of mass [1/s] and stiffness [s] in the damping of the meshes.
        plane : str, default "strain"
            "strain" or "stress", of meshes in 2D.
        rigid_options : dict, optional
            {part: options of the rigid bodies of that part}, as {"beam": {"force": (0.0, -1e4)}}.
        **options : optional
            Options of cairn.deformable for each mesh.

        Returns
        -------
        list of ndarray
            Ids of each block: of its body, or of its nodes, points and sides.

        Raises
        ------
        ValueError
            If rigid_options name a part without rigid blocks, or the material has no density.
        """
        soft, ids = self.soft, [None] * len(self)
        rigid_options = dict(rigid_options or {})
        stiff = self.blocks.select(~soft)
        for part in rigid_options:
            if part not in stiff.part:
                known = ", ".join(sorted(set(stiff.part))) or "none"
                raise ValueError(f"rigid_options names the part {part!r}: rigid blocks have the parts {known}")
        if len(stiff):
            depth = {"depth": scene.depth} if self.blocks.dim == 2 else {}
            sets, rows = stiff.sets(material, **depth)
            sets = [s.with_(**rigid_options.get(s.group, {})) for s in sets]
            for k, number in zip(np.flatnonzero(~soft), np.asarray(scene.add(*sets))[rows]):
                ids[k] = np.array([number])
        for k in np.flatnonzero(soft):
            ids[k] = np.asarray(scene.add(*self._sets(k, scene, material, rayleigh, plane, options)))
        if self.joint is not None:
            scene.interact("*", "*", self.joint)
        return ids

    def _sets(self, k, scene, material, rayleigh, plane, options):
        """Sets of bodies of a mesh."""
        names = [f"joint {j}" for j in self.sides[k]]
        groups = dict(zip(names, self.sides[k].values()))
        own = {} if rayleigh is None else {"rayleigh": tuple(rayleigh)}
        if self.blocks.dim == 2:
            own |= {"plane": plane, "thickness": scene.depth}
        if not material.density > 0:
            raise ValueError(f"material {material.name!r} has no density: give cairn.Material(..., density=2400.0) [kg/m3] say")
        cairn = importlib.import_module("cairn")  # whose layers above this one make bodies
        body = cairn.ElasticBody(self.points[k], self.cells[k], young=self.young, poisson=self.poisson,
                                 density=material.density, groups=groups, **own)  # fmt: skip
        sides = {"contact": names, ("edges" if self.blocks.dim == 2 else "faces"): names} if names else {}
        return cairn.deformable(body, material, **(sides | {"name": self.blocks.part[k]} | options))


def mesh(blocks, size=None, *, young, poisson=0.2, joint=None, rigid=("support",)) -> MeshedBlocks:
    """Makes deformable blocks of an assembly, with a law such as a cohesive zone in their joints.

    Parameters
    ----------
    blocks : Blocks
        Blocks, as cairn.pre.masonry and cairn.pre.importing make them.
    size : float, optional
        Largest edge of a cell [m]; half of the shortest edge of each block when not given, and of blocks of triangles or
        tetrahedra at least a quarter of the longest.
    young, poisson : float
        Young's modulus [Pa] and Poisson's ratio [-] of the blocks.
    joint : Law, optional
        Law of all contacts, such as cairn.MAL(...); without it the scene's own rules count.
    rigid : str or sequence of str, default ("support",)
        Parts that stay rigid bodies; those of the part "support" are held.

    Returns
    -------
    MeshedBlocks
        To be added by `meshed.add_to(scene, material)`, looked at by `cairn.post.cracks.MeshedStructure`.

    Raises
    ------
    ValueError
        If an argument is wrong, a size gives an edge more than 24 cells, or no block is left to mesh.
    """
    if not isinstance(blocks, Blocks):
        raise ValueError(f"blocks is {blocks!r}: give Blocks, as cairn.pre.masonry.wall(...) and the like make them")
    if size is not None:
        size = checks.positive("size", size)
    young, poisson = checks.positive("young", young), checks.number("poisson", poisson)
    if young < SOFT:
        warnings.warn(f"young is {young:g} Pa, softer than any stone: give pascals, 2e10 for 20 GPa", BlocksWarning, stacklevel=3)
    if not -1 < poisson < 0.5:
        raise ValueError(f"poisson is {poisson}: give a ratio above -1 and below 0.5, 0.2 for stone say")
    if joint is not None and not hasattr(joint, "parameter_names"):
        raise ValueError(f"joint is {joint!r}: give a law, as cairn.MAL(...), or leave it out and give rules by scene.interact")
    rigid = (rigid,) if isinstance(rigid, str) else tuple(rigid)
    joints = blocks.joints()
    points, cells, sides = [], [], []
    touching = [[] for _ in range(len(blocks))]
    for j, pair in enumerate(joints.blocks.tolist()):
        for k in pair:
            touching[k].append(j)
    for k, part in enumerate(blocks.part):
        if part in rigid:
            points.append(None)
            cells.append(None)
            sides.append({})
            continue
        try:
            p, c = cells_of(blocks.vertices[k], blocks.faces[k], size)
        except ValueError as error:
            raise ValueError(f"block {k} ({part}): {error}") from None
        near = FLUSH * np.max(np.ptp(blocks.vertices[k], axis=0))
        on = {j: np.flatnonzero(np.abs((p - joints.polygon[j][0]) @ joints.normal[j]) <= near) for j in touching[k]}
        points.append(p)
        cells.append(c)
        sides.append(_whole_sides(p, on, near))
    if all(p is None for p in points):
        raise ValueError(f"rigid is {rigid}: no block is left to mesh; the parts are {', '.join(sorted(set(blocks.part)))}")
    return MeshedBlocks(blocks, points, cells, sides, young, poisson, joint, joints)


def _whole_sides(points, on, near):
    """{joint: nodes}, one for joints of the same side, so that no side comes in twice."""
    kept = {}
    for j, nodes in on.items():
        if not any(np.array_equal(nodes, other) for other in kept.values()):
            kept[j] = nodes
    return kept


def cells_of(vertices, faces, size=None):
    """Meshes a convex block.

    Parameters
    ----------
    vertices : ndarray (m, dim)
        Corners [m]; in 2D anticlockwise.
    faces : sequence
        Corners of each face, anticlockwise from outside; in 2D nothing.
    size : float, optional
        Largest edge of a cell [m]; half of the shortest edge of the block when not given, of blocks of triangles or tetrahedra at
        least a quarter of the longest.

    Returns
    -------
    tuple
        Nodes (n, dim) [m], and cells {"quad" | "triangle" | "hexahedron" | "tetra": (c, nodes)}.

    Raises
    ------
    ValueError
        If the size is not above 0, or so small that an edge of the block would have more than 24 cells, or it 30,000.
    """
    plane = vertices.shape[1] == 2
    loops = [list(range(len(vertices)))] if plane else faces
    edges = np.array([vertices[a] - vertices[b] for f in loops for a, b in zip(f, [*f[1:], f[0]])])
    lengths = np.linalg.norm(edges, axis=1)
    grid = len(vertices) == 4 if plane else len(vertices) == 8 and _as_cube(faces) is not None
    if size is None:
        size = max(0.5 * lengths.min(), lengths.max() / (MOST if grid else FEW))
    if not size > 0 or lengths.max() > MOST * size * (1 + 1e-9):
        least = lengths.max() / MOST
        raise ValueError(f"size is {size}: give a length of cells above {least:.3g} m, the longest edge over {MOST}")
    if plane:
        return _quads(vertices, size) if len(vertices) == 4 else _triangles(vertices, size)
    corners = _as_cube(faces) if len(vertices) == 8 else None
    return _hexahedra(vertices[corners], size) if corners is not None else _tetrahedra(vertices, faces, size)


def _refuse_many(cells, parts, longest, size):
    """Raises ValueError where halving all edges down to the size gives too many cells."""
    count = cells * parts ** max(0, int(np.ceil(np.log2(longest / size * (1 - 1e-9)))))
    if count > LARGEST:
        raise ValueError(f"size is {size}: it gives {count:,} cells of one block, more than {LARGEST:,}; give a larger size")


def _quads(corners, size):
    """A grid of quadrilaterals in the bilinear map of the square to the block."""
    a, b, c, d = corners
    count = [max(1, int(np.ceil(max(np.linalg.norm(p - q), np.linalg.norm(r - s)) / size * (1 - 1e-9))))
             for p, q, r, s in ((a, b, d, c), (a, d, b, c))]  # fmt: skip
    s, t = (x.ravel()[:, None] for x in np.meshgrid(*(np.linspace(0, 1, n + 1) for n in count), indexing="ij"))
    number = np.arange(len(s)).reshape(count[0] + 1, count[1] + 1)
    cells = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    return (1 - s) * (1 - t) * a + s * (1 - t) * b + s * t * c + (1 - s) * t * d, {"quad": cells}


def _triangles(corners, size):
    """Triangles between the middle and the edges, each cut into four until edges are short enough."""
    n = len(corners)
    points = np.concatenate([corners, corners.mean(axis=0)[None]])
    cells = np.array([[k, (k + 1) % n, n] for k in range(n)])
    _refuse_many(n, 4, np.linalg.norm(points[cells] - points[np.roll(cells, 1, axis=1)], axis=2).max(), size)
    while np.linalg.norm(points[cells] - points[np.roll(cells, 1, axis=1)], axis=2).max() > size * (1 + 1e-9):
        edges = np.sort(np.stack([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]], axis=1), axis=2)
        unique, number = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
        ab, bc, ca = (number.reshape(-1, 3) + len(points)).T
        points = np.concatenate([points, points[unique].mean(axis=1)])
        a, b, c = cells.T
        cells = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return points, {"triangle": cells}


def _as_cube(faces):
    """Corners in the order of a hexahedron, or None if the faces are not those of a cube."""
    if len(faces) != 6 or any(len(f) != 4 for f in faces):
        return None
    bottom = list(faces[0])[::-1]  # seen from inside
    above = {}
    for f in faces[1:]:
        for a, b in zip(f, [*f[1:], f[0]]):
            if a in bottom and b not in bottom:
                above[a] = int(b)
    if set(above) != set(bottom) or len(set(above.values())) != 4:
        return None
    return [*map(int, bottom), *(above[k] for k in bottom)]


def _hexahedra(corners, size):
    """A grid of hexahedra in the trilinear map of the cube to the block."""
    count = []
    for axis in range(3):
        low = [k for k in range(8) if UNIT[k, axis] == 0]
        other = [int(np.flatnonzero(np.all(UNIT == UNIT[k] + np.eye(3, dtype=int)[axis], axis=1))[0]) for k in low]
        longest = np.linalg.norm(corners[other] - corners[low], axis=1).max()
        count.append(max(1, int(np.ceil(longest / size * (1 - 1e-9)))))
    grid = np.stack(np.meshgrid(*(np.linspace(0, 1, n + 1) for n in count), indexing="ij"), axis=-1).reshape(-1, 3)
    weight = np.prod(np.where(UNIT[None] == 1, grid[:, None], 1 - grid[:, None]), axis=-1)
    number = np.arange(len(grid)).reshape([n + 1 for n in count])
    part = [slice(None, -1), slice(1, None)]
    cells = np.stack([number[tuple(part[i] for i in u)] for u in UNIT], axis=-1).reshape(-1, 8)
    return weight @ corners, {"hexahedron": cells}


def _tetrahedra(vertices, faces, size):
    """Tetrahedra between the middle and the triangles of the faces, each cut into eight until edges are short enough."""
    points = [*vertices, vertices.mean(axis=0)]
    middle, cells = len(vertices), []
    for f in faces:
        if len(f) == 3:
            cells.append([middle, *f])
            continue
        points.append(vertices[list(f)].mean(axis=0))
        cells += [[middle, len(points) - 1, a, b] for a, b in zip(f, [*f[1:], f[0]])]
    points, cells = np.array(points), np.array(cells, int)
    _refuse_many(len(cells), 8, _longest(points, cells), size)
    while _longest(points, cells) > size * (1 + 1e-9):
        points, cells = _halved(points, cells)
    a, b, c, d = (points[cells[:, k]] for k in range(4))
    turned = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0
    cells[turned, 2:] = cells[turned, :1:-1]
    return points, {"tetra": cells}


def _longest(points, cells):
    x = points[cells]
    return max(np.linalg.norm(x[:, i] - x[:, j], axis=1).max() for i in range(4) for j in range(i))


def _halved(points, cells):
    """Each tetrahedron cut into eight by the middles of its edges (Bey 1995)."""
    pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    edges = np.sort(np.stack([cells[:, p] for p in pairs], axis=1), axis=2)
    unique, number = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    m = number.reshape(-1, 6) + len(points)
    new = np.concatenate([points, points[unique].mean(axis=1)])
    v = cells
    a, b, c, d, e, f = (m[:, k] for k in range(6))  # middles of 01 02 03 12 13 23
    out = [(v[:, 0], a, b, c), (a, v[:, 1], d, e), (b, d, v[:, 2], f), (c, e, f, v[:, 3]),
           (a, b, c, e), (a, b, d, e), (b, c, e, f), (b, d, e, f)]  # fmt: skip
    return new, np.concatenate([np.stack(t, axis=1) for t in out])
