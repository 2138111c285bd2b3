"""Deformable bodies in a scene: nodes are bodies moved by the mesh; points, edges and faces are contactors that follow nodes.

body = ElasticBody(points, cells, young=200e9, poisson=0.3, density=7800.0, groups={"top": nodes}, lumped=True)
scene.add(cn.deformable(body, steel, contact="top", fixed={"bottom": "xy"}))
"""

from __future__ import annotations

import numpy as np

from ..base import checks
from . import bodies
from .mesh_checks import (
    checked_displacements,
    checked_fields,
    checked_modal_damping,
    checked_mortar,
    checked_self_contact,
)
from .mesh_faces import Faces, outwards
from .mesh_parts import GivenBody, group_nodes, part_set, rows_by_material
from .ways_through import ways_through


class LinearBody(GivenBody):
    """A linear body given by matrices of another finite element code.

    Dof `dim i + k` is the displacement of node i along axis k.

    Parameters
    ----------
    points : array_like (n, dim)
        Places of the nodes [m].
    mass : sparse or array_like (n dim, n dim)
        Mass matrix [kg].
    stiffness : sparse, array_like or LinearOperator (n dim, n dim)
        Stiffness matrix [N/m]; an operator (scipy.sparse.linalg.LinearOperator) needs `solver`.
    damping : sparse, array_like or LinearOperator (n dim, n dim), optional
        Damping matrix [N s/m]; likewise.
    groups : dict, optional
        {name: nodes}.
    edges : array_like (m, 2), optional
        Boundary in 2D, with the body on their left.
    faces : array_like (m, 3) or (m, 4), optional
        Boundary in 3D, anticlockwise from outside, -1 for the fourth node of a triangle.
    solver : callable, optional
        Function solver(h, theta, held) that returns a function that solves (M + h theta C + h^2 theta^2 K) x = b on the free
        dofs, (m,) or (m, k).
    initial_force : array_like (n dofs,), optional
        Internal force at zero displacement, of an initial stress [N].
    initial_energy : float, default 0
        Its stored energy [J].

    Raises
    ------
    ValueError
        If a matrix has another shape or is not symmetric, or an operator is given without a solver.
    """

    def __init__(
        self, points, mass, stiffness, *, damping=None, groups=None, edges=None, faces=None, solver=None, initial_force=None,
        initial_energy=0.0,
    ):  # fmt: skip
        #: arguments of the constructor, which scene files store
        self.given = {name: value for name, value in locals().items() if name != "self"}
        from scipy import sparse
        from scipy.sparse.linalg import LinearOperator

        self.points = np.ascontiguousarray(points, float)
        if self.points.ndim != 2 or self.points.shape[1] not in (2, 3) or not np.all(np.isfinite(self.points)):
            raise ValueError(f"points have shape {self.points.shape}: give finite places (n, 2) or (n, 3) [m]")
        self.dim, n = self.points.shape[1], self.points.size
        self.groups = checks.node_groups(groups, len(self.points))
        self.edges, self.faces = self._sides("edges", edges, (2,)), self._sides("faces", faces, (3, 4))
        self.solver = solver
        self.initial_force = initial_force if initial_force is None else checks.real_array("initial_force", initial_force, (n,))
        self.initial_energy = checks.number("initial_energy", initial_energy)
        matrices = {"mass": mass, "stiffness": stiffness, "damping": 0 * mass if damping is None else damping}
        for name, a in matrices.items():
            if np.shape(a) != (n, n):
                raise ValueError(f"{name} has shape {np.shape(a)}: {len(self.points)} nodes in {self.dim}D need ({n}, {n})")
            if not isinstance(a, LinearOperator):
                matrices[name] = a = sparse.csc_array(a)
                if abs(a - a.T).max() > 1e-9 * abs(a).max():
                    raise ValueError(f"{name} is not symmetric: give the symmetric matrix of a linear body")
            elif name == "mass" or solver is None:
                raise ValueError(f"{name} is an operator: give a matrix" + ("" if name == "mass" else ", or a solver"))
        self.M, self.K, self.C = matrices["mass"], matrices["stiffness"], matrices["damping"]


def is_linear(body):
    """Tells whether a body is fully described by its matrices, without a material of solids or forces of another code.

    Parameters
    ----------
    body : LinearBody, ElasticBody, SolidBody or CallbackBody
        The body.

    Returns
    -------
    bool
        True if it is.
    """
    return not (hasattr(body, "blocks") or hasattr(body, "model_of"))


class Deformable:
    """A deformable body in a scene, with its boundary conditions and loads; made by `deformable`.

    Parameters
    ----------
    body : LinearBody, ElasticBody, SolidBody or CallbackBody
        The body.
    fixed : dict
        {group: axes} of held dofs.
    drive : dict
        {group: {axis: velocity}} [m/s].
    force : dict or callable or None
        {group: total force} [N], or a function of time that gives it.
    points : list
        Nodes (m, k) and weights (m, k) of points between nodes.
    edges : ndarray (m, 2)
        Nodes of edges.
    faces : Faces or None
        Faces.
    storage : str or None
        Storage of the system of equations.
    name : str
        Name of the mesh.
    """

    def __init__(self, body, fixed, drive, force, points, edges, faces, storage, name):
        self.body, self.fixed, self.drive, self.force = body, fixed, drive, force
        self.points, self.edges = points, edges  # (nodes (m, k), weights (m, k)) of points between nodes; nodes (m, 2)
        self.faces = faces  # a Faces, or None
        self.storage, self.name = storage, name
        self.contact_nodes = np.zeros(0, int)
        self.pressed = []  # (sides, pressure on them)
        self.loads = []  # surface tractions and body forces, see dead_loads.py
        self.displace, self.rigid, self.self_contact, self.mortar = {}, [], False, False
        self.modal_damping = None  # damping ratio of all modes, or (n,) of the first n
        self.joints = []  # (name of the joint, node)
        self.carried = None  # loads it had as a rigid body, see run/carried_forces.py
        self.opening, self.whole = None, None  # faces that open by threshold, see opening_faces.py; the mesh before any opened


def deformable(body, material, *, contact=(), points=None, edges=(), faces=(), fixed=None, drive=None, displace=None, rigid=(),
               force=None, velocity=None,
               displacement=None, storage=None, name="mesh", point_material=None, edge_material=None, face_material=None,
               bulk=None, pressure=None, self_contact=False, mortar=False, initial_stress=None, modal_damping=None,
               traction=None, body_force=None, **options):  # fmt: skip
    """Makes a deformable body for a scene.

    Its nodes have the group `name`, its edges and faces the groups "NAME edges" and "NAME faces", for interaction rules.

    Parameters
    ----------
    body : path-like, meshio.Mesh, module gmsh, SolidBody, ElasticBody, LinearBody or CallbackBody
        A mesh: a file that meshio reads (gmsh, MED, VTK, Abaqus's .inp), a meshio.Mesh, or the module gmsh after meshing; its
        named sets become groups. Or a body made before, as SolidBody, ElasticBody, LinearBody with your own matrices, cairn.bars
        and cairn.beams make it.
    material : Material
        Material of its contacts, and the density of a mesh [kg/m3].
    contact : str or sequence
        Names of groups, or numbers of nodes, that are candidate points; they touch disks, spheres, walls, polygons, polyhedra,
        and the edges and faces of other meshes. "boundary" is the group of all nodes, edges or faces there, in every mesh.
    points : tuple, optional
        Nodes (m, k) and weights (m, k) of candidate points between nodes.
    edges : str, sequence of str or array_like (m, 2)
        In 2D, names of groups whose boundary edges are antagonists, or pairs of nodes with the body on their left (any order if
        the body has cells); they touch disks, and points of other meshes.
    faces : str, sequence of str or array_like (m, 3) or (m, 4)
        In 3D, names of groups whose boundary faces are antagonists, or their nodes, anticlockwise from outside (any order if the
        body has cells); they touch spheres, and points of other meshes.
    fixed : dict, optional
        {group: "x" | "xy" | ...}, held dofs.
    drive : dict, optional
        {group: {"x": v}}, imposed velocity [m/s], a number or a function of time.
    displace : dict, optional
        {group: {"x": u}}, imposed displacement [m], a function of time, met at the ends of steps from the second step on.
    rigid : str or sequence of str
        Names of groups whose nodes move as a rigid body; it rotates as far as the kinematics of the body allow.
    force : dict or callable, optional
        {group: (dim,)}, total force, spread evenly over the nodes [N]; each a vector or a function of time that gives it. Or a
        function of time that gives such a dict, which no scene file holds.
    velocity : array_like (dim,) or (n, dim), optional
        Initial velocity [m/s].
    displacement : array_like (dim,) or (n, dim), optional
        Initial displacement [m]; displacements of linear bodies must stay small.
    storage : str, optional
        Storage of the system of equations, see cairn.soe.
    name : str, default "mesh"
        Group of its nodes.
    point_material : Material or list, optional
        Material, in the place of material, of its points: one, or a list of nodes of contact by number, then points.
    edge_material : Material or list, optional
        Material of its edges: one, or one for each.
    face_material : Material or list, optional
        Material of its faces: one, or one for each.
    bulk : BulkMaterial or dict, optional
        Material of solids of a mesh (cairn.NeoHookean(...) and others).
    pressure : dict, optional
        {group: p} on boundary sides with all nodes in the group [Pa], a number or a function of time, along their normals at the
        beginning of the step and, extrapolated by the velocities of the nodes, at its end.
    self_contact : bool, default False
        Its points also touch its own edges or faces, except adjacent ones.
    mortar : bool, default False
        Contact of its nodes with edges or faces of other meshes is enforced weakly, by dual mortar multipliers; set it on the
        side with finer cells.
    initial_stress : array_like (6,), callable or dict, optional
        Cauchy stress in the initial configuration [Pa], 11 22 33 12 13 23: of all cells; a function of places (n, dim) [m] that
        gives (n, 6); or {name: such a value} by groups (cells with all nodes in the group) or by kinds of cells, where (m, 6) is
        allowed, too. It need not be in equilibrium with loads and supports.
    modal_damping : float or sequence of float, optional
        For a linear body, the damping ratio [-] of all vibration modes, or of the first modes. It adds C = M Phi diag(2 zeta
        omega) Phi' M, on the velocities of free dofs, to the damping of the body.
    traction : dict, optional
        {group: (dim,)} on boundary sides with all nodes in the group, per initial area and of fixed direction [Pa]; each a
        vector or a function of time that gives it, integrated with the shape functions.
    body_force : array_like (dim,) or callable, optional
        Force per initial volume [N/m3], or a function of time that gives it, integrated with the shape functions.
    **options : optional
        For a mesh, those of SolidBody: plane, kinematics, mean_dilatation, lumped, rayleigh and others.

    Returns
    -------
    list of BodySet
        Sets of its nodes, edges and faces, for Scene.add.

    Raises
    ------
    ValueError
        If a value is wrong; the message names field, value and remedy.
    FileError
        If a file is missing or holds no such mesh.
    """
    given = {key: value for key, value in locals().items() if key not in ("body", "bulk", "options", "initial_stress")}
    body = _made(body, material, bulk, options)
    if initial_stress is not None:
        from .initial_stress import stressed

        body = stressed(body, initial_stress)
    if not hasattr(body, "points") or not hasattr(body, "nodal_mass"):
        raise ValueError(f"body is {body!r}: give a mesh, a cairn.ElasticBody, LinearBody or SolidBody")
    dim, places = body.dim, body.points
    n = len(places)
    nodes = _nodes(body, contact, "contact")
    pairs = outwards(body, edges) if isinstance(edges, np.ndarray) and edges.ndim == 2 else _edges(body, edges)
    patches = outwards(body, faces) if isinstance(faces, np.ndarray) and faces.ndim == 2 else _faces(body, faces)
    patches = Faces(patches) if len(patches) else None
    points = [np.zeros((0, 2), int), np.zeros((0, 2))] if points is None else [np.asarray(part) for part in points]
    if points[0].shape != points[1].shape or points[0].ndim != 2:
        raise ValueError(f"points have shapes {points[0].shape}, {points[1].shape}: give nodes (m, k) and their weights (m, k)")
    if not np.all(np.isfinite(points[1])):
        at = int(np.argmin(np.isfinite(points[1]).all(axis=1)))
        raise ValueError(f"points have weights {points[1][at].tolist()} at point {at}: give finite numbers whose sum is 1")
    for field, named in (("contact", nodes), ("points", points[0]), ("edges", pairs)):
        beyond = named[(named < 0) | (named >= n)]
        if beyond.size:
            raise ValueError(f"{field} names node {beyond.flat[0]}: the mesh has {n} nodes, from 0")
    fixed, drive = checked_fields(dim, given, fixed, drive)
    named = {"fixed": fixed, "drive": drive, "displace": displace or {}, "force": force, "rigid": _listed(rigid)}
    for field, of in named.items():
        for group in of if isinstance(of, (dict, list)) else ():
            if not len(group_nodes(body, group)):
                raise ValueError(f"{field} names the group {group!r}, which has no node: leave it out, or give it nodes")
    displace = checked_displacements(body, displace, drive)
    for group, by_axis in [*drive.items(), *displace.items()]:
        fixed[group] = "".join(sorted(set(fixed.get(group, "")) | set(by_axis)))
    d = Deformable(body, fixed, drive, force, points, pairs, patches, storage, name)
    d.given = given  # as scene files hold it
    d.displace, d.rigid = displace, _listed(rigid)
    d.mortar = checked_mortar(mortar, dim, nodes, pairs, patches)
    d.self_contact = checked_self_contact(self_contact, nodes, points[0], pairs, patches)
    d.modal_damping = checked_modal_damping(modal_damping, body, d.rigid)
    if traction is not None or body_force is not None:
        from .dead_loads import dead_loads

        d.loads = dead_loads(body, traction, body_force)
    if pressure:
        from .pressure import pressed_sides

        d.pressed = [(pressed_sides(body, group_nodes(body, group), group), p) for group, p in pressure.items()]
    d.material = material
    faced = patches.faces[patches.faces >= 0] if patches else np.zeros(0, int)
    d.contact_nodes = np.unique(np.concatenate([nodes, points[0].ravel(), pairs.ravel(), faced]))
    mass = body.nodal_mass()
    if not np.all(mass > 0):
        at = int(np.argmin(mass))
        raise ValueError(f"node {at} has mass {mass[at]:g} kg: give a density above 0, and leave out nodes without cells")
    start, speed = _of_nodes("displacement", displacement, n, dim), _of_nodes("velocity", velocity, n, dim)
    size = np.ptp(places, axis=0).max()
    between = len(points[0])
    touching = np.concatenate([nodes, np.arange(n, n + between)])
    shape = "disk" if dim == 2 else "sphere"
    contactors = [
        bodies.ContactorSet(shape, of, touching[rows], np.zeros(len(rows)))
        for of, rows in rows_by_material("point_material", point_material or material, len(touching))
    ]
    inertia = np.repeat((mass * size**2)[:, None], 2 * dim - 3, axis=1)
    sets = [
        bodies.checked(
            bodies.BodySet(dim, places + start, mass, inertia, contactors, velocity=speed, group=name, mesh=d, parts=between)
        )
    ]
    if len(pairs):
        sets.append(_edge_set(places + start, pairs, edge_material or material, d))
    if patches:
        sets.append(patches.part_set(places + start, face_material or material, d))
    return sets


def _made(body, material, bulk, options):
    """Body from a mesh of another program and its material; a body made before is returned unchanged."""
    from ..pre import mesh_sources

    if not mesh_sources.is_source(body):
        if bulk is not None or options:
            extra = "bulk" if bulk is not None else next(iter(options))
            made = type(body).__name__
            raise TypeError(f"{extra} is for a mesh that is read: this body is a {made}, made of a material already")
        return body
    from .bulk import BulkMaterial
    from .elastic import ElasticBody, told_of_contents
    from .solid import SolidBody

    if not isinstance(bulk, (BulkMaterial, dict)):
        raise TypeError(f"bulk is {bulk!r}: give the material of the mesh, such as IsotropicElastic(young=..., poisson=...)")
    points, cells, groups = mesh_sources.read(body)
    options = {"density": material.density, "groups": groups} | options
    linear = getattr(bulk, "name", "") == "isotropic_elastic" and options.get("plane") != "axisymmetric"
    with told_of_contents(body, points, cells):
        if linear and options.get("kinematics") in (None, "small") and not options.get("mean_dilatation"):
            young, poisson = bulk.values  # its matrices are factorised once
            options = {key: value for key, value in options.items() if key not in ("kinematics", "mean_dilatation")}
            return ElasticBody(points, cells, young=young, poisson=poisson, **options)
        return SolidBody(points, cells, bulk, **options)


def _of_nodes(name, given, n, dim):
    """Initial values of the nodes (n, dim), from (dim,) or (n, dim); zero for None."""
    given = np.zeros(dim) if given is None else checks.reals(name, given)
    if given.shape not in ((), (dim,), (1, dim), (n, dim)):
        raise ValueError(f"{name} has shape {given.shape}: give ({dim},), or ({n}, {dim}) of the nodes")
    return np.broadcast_to(given, (n, dim))


def _listed(groups):
    return [groups] if isinstance(groups, str) else list(groups)


def _nodes(body, groups, field):
    if not isinstance(groups, str) and len(groups) and all(isinstance(of, (bool, np.bool_)) for of in groups):
        return group_nodes(body, groups, field)  # a mask
    parts = [group_nodes(body, g, field) for g in _listed(groups)]
    return np.unique(np.concatenate(parts)) if parts else np.zeros(0, int)


def _edges(body, groups):
    if not len(_listed(groups)):
        return np.zeros((0, 2), int)
    if body.dim != 2:
        raise ValueError("edges are antagonists in 2D alone: in 3D give faces")
    pairs = body.boundary_edges()
    kept = np.isin(pairs, _nodes(body, groups, "edges")).all(axis=1)
    if not kept.any():
        raise ValueError(f"no edge of the boundary has both nodes in {groups!r}")
    return pairs[kept]


def _faces(body, groups):
    if not len(_listed(groups)):
        return np.zeros((0, 4), int)
    if body.dim != 3:
        raise ValueError("faces are antagonists in 3D alone: in 2D give edges")
    faces = body.boundary_faces()
    kept = (np.isin(faces, _nodes(body, groups, "faces")) | (faces < 0)).all(axis=1)
    if not kept.any():
        raise ValueError(f"no face of the boundary has all its nodes in {groups!r}")
    return faces[kept]


def _edge_set(places, pairs, material, d):
    """Segment contactors on edges, with a thickness inside the body of a twentieth of the shortest edge, so that points which
    penetrated are still pushed out; of a thinner part half of its thickness, so that no contactor reaches out of its far side."""
    first, second = places[pairs[:, 0]], places[pairs[:, 1]]
    along = second - first
    length = np.linalg.norm(along, axis=1)
    along /= length[:, None]
    thickness, direction = np.full(len(pairs), 0.05 * length.min()), np.concatenate([along, length[:, None] / 2], axis=1)
    thickness = np.minimum(thickness, ways_through(places, pairs, 2 * thickness[0]) / 2)
    contactors = [
        bodies.ContactorSet("segment", of, rows, thickness[rows], None, direction[rows])
        for of, rows in rows_by_material("edge_material", material, len(pairs))
    ]
    return part_set(2, contactors, "edges", d)
