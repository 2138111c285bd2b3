"""A problem of compas_dem as a scene: blocks as rigid polyhedra or elastic meshes, their material, conditions and contact law."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import cairn as cn
import numpy as np
from cairn.post.masonry import Structure
from cairn.pre import mass_properties
from cairn.pre.blocks import Blocks
from cairn.pre.decompose import convex_parts
from cairn.pre.flatten import plane_faces
from cairn.pre.importing import LARGE, BlocksWarning
from cairn.pre.mesh import MeshError

from .conditions import conditions_of, history
from .meshing import cells_of, elastic_body, inertial_forces

DOFS = ("vx", "vy", "vz", "wx", "wy", "wz")
SOLIDS = ("MAL", "TH", "ABP", "EXPO", "MAC", "MP", "MP3", "MohrCoulomb", "Bonded")  # what `joint` mentions when it is none
FLUSH = 1e-6  # of a block's size: sides nearer than this form a joint
MEGA = 1e6  # Pa in the unit of a material's strengths and stiffnesses


class Block:
    """A block of a model.

    Parameters
    ----------
    element : compas_dem.elements.Block
        The element.
    density : float, optional
        Density in the place of that of its material [kg/m3].

    Raises
    ------
    ValueError
        If a block that can move has no density.
    cairn.pre.mesh.MeshError
        If its surface is not closed.
    """

    def __init__(self, element, density=None):
        self.element, self.node, self.mesh = element, element.graphnode, element.modelgeometry
        self.support = bool(element.is_support)
        self.parts = _convex(self.mesh, f"block {self.node}")
        self.faces_plane = self.parts[0] if len(self.parts) == 1 else None
        own = mass_properties.polyhedra(*_joined(self.parts))
        self.center, self.volume = own.center[0], float(own.measure[0])
        material = element.material
        self.material = material
        self.density = density if density is not None else getattr(material, "density", None)
        if self.density is None and not self.support:
            raise ValueError(
                f"block {self.node} has no material with a density: give it one by model.assign_material, or density= [kg/m3]"
            )
        self.mass = 0.0 if self.density is None else float(self.density) * self.volume

    @property
    def young(self):
        """Young's modulus of its material [Pa]; None without one."""
        value = getattr(self.material, "Ecm", None)
        return None if value is None else MEGA * float(value)

    @property
    def poisson(self):
        """Poisson's ratio of its material [-]."""
        value = getattr(self.material, "poisson", None)
        return 0.2 if value is None else float(value)


@dataclass
class Built:
    """A problem as a simulation.

    Parameters
    ----------
    simulation : cairn.Simulation
        The simulation before its first step.
    blocks : list of Block
        Blocks in the order of the model.
    conditions : dict
        {node of the graph: Conditions}.
    owner : ndarray
        Row of the block of each id; bodies, nodes and sides of meshes have ids.
    bodies : dict
        {node of the graph: id} of rigid blocks.
    meshes : dict
        {node of the graph: number of the mesh} of deformable blocks.
    law : cairn.Law
        Law of all contacts.
    duration : float
        Duration of the analysis [s].
    gravity : float
        Gravity along -z [m/s2].
    """

    simulation: object
    blocks: list
    conditions: dict
    owner: np.ndarray
    bodies: dict
    meshes: dict
    law: object
    duration: float
    gravity: float

    def loads(self, t):
        """Weights and loads on all blocks.

        Parameters
        ----------
        t : float
            Time [s].

        Returns
        -------
        ndarray (n, 3)
            Forces [N], in the order of the model.
        """
        ramp, at_once = history(t, self.duration)
        out = np.zeros((len(self.blocks), 3))
        for k, block in enumerate(self.blocks):
            mine = self.conditions[block.node]
            out[k] = ramp * mine.ramp[:3] + at_once * mine.at_once[:3] - [0.0, 0.0, self.gravity * block.mass]
        return out

    def structure(self):
        """Gives the blocks as cairn.post.masonry has them: thrust lines, hinges, openings, stresses, pictures.

        Returns
        -------
        cairn.post.masonry.Structure
            The structure of the last step.

        Raises
        ------
        ValueError
            If a block is deformable or not convex.
        """
        assembly, ids = Blocks(3, flush=FLUSH), []
        for b in self.blocks:
            if b.node not in self.bodies or len(b.parts) > 1:
                kind = "not convex" if b.node in self.bodies else "deformable"
                raise ValueError(f"block {b.node} is {kind}: a structure is of rigid convex blocks, take the results instead")
            assembly.add(*b.parts[0], part="support" if b.support else "block")
            ids.append(self.bodies[b.node])
        return Structure(assembly, self.simulation, ids)

    def held(self):
        """Translations that are held or driven.

        Returns
        -------
        ndarray (n, 3)
            Booleans in the order of the model.
        """
        given = [self.conditions[b.node].translation for b in self.blocks]
        return np.array([[b.support or x is not None for x in d] for b, d in zip(self.blocks, given)]).reshape(-1, 3)


def build(problem, *, duration, dt, theta=None, density=None, gravity=9.81, joint=None, deformable=False, size=None,
          rayleigh=None, tol=None, max_iter=1000, threads=0):  # fmt: skip
    """Makes the simulation of a problem.

    Parameters
    ----------
    problem : compas_dem.problem.Problem
        Model, boundary conditions and contact model.
    duration : float
        Duration over which loads and displacements are applied [s].
    dt : float
        Step [s].
    theta : float, optional
        Parameter of the theta-method, from 1/2 (of second order, keeps energy) to 1 (damps waves). When not given 1 where blocks
        are deformable or joints are other than Coulomb's, else 1/2.
    density : float, optional
        Density of all blocks [kg/m3], in the place of those of their materials.
    gravity : float, default 9.81
        Gravity along -z [m/s2].
    joint : cairn.Law or dict, optional
        Law of all joints in the place of the contact model, as cairn.MAL(...) or {"law": "MAL", "mu": 0.6, ...}.
    deformable : bool or sequence of int, default False
        All blocks, or nodes of those, that are elastic with Ecm and poisson of their material; blocks that are held or moved stay
        rigid.
    size : float, optional
        Largest edge of a cell of these [m]; half of the block's shortest edge when not given.
    rayleigh : tuple of float, optional
        Factors of mass [1/s] and stiffness [s] in their damping.
    tol : float, optional
        Largest error of the contact solver [-]; Cairn's default when not given.
    max_iter : int, default 1000
        Most iterations of a step.
    threads : int, default 0
        Number of threads; 0: as OpenMP decides.

    Returns
    -------
    Built
        The simulation, and the block of each of its ids.

    Raises
    ------
    ValueError
        If the model has no support or the problem no contact model, a block has no density, or a condition names what is not
        there.
    """
    blocks = [Block(e, density) for e in problem.model.elements()]
    if not any(b.support for b in blocks):
        raise ValueError("the model has no support: model.add_supports([...]), or is_support = True of blocks, before solving")
    _warn_of_units(blocks)
    by_node = {b.node: b for b in blocks}
    conditions = conditions_of(problem, by_node)
    law = contact_law(problem, joint)
    soft = _deformable(blocks, conditions, deformable)
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -gravity))
    ids, owner = {}, []
    for rows, sets in _rigid_sets(blocks, conditions, soft, duration, dt):
        ids |= dict(zip((blocks[k].node for k in rows), scene.add(sets).tolist()))
        owner += list(rows)
    meshes, sides = {}, _joint_sides(blocks) if soft else {}
    for k, block in enumerate(blocks):
        if block.node in soft:
            meshes[block.node] = len(meshes)
            made = _mesh_sets(block, conditions[block.node], sides.get(block.node, ()), duration, size, rayleigh)
            owner += [k] * len(scene.add(*made))
    scene.interact("*", "*", law)
    if theta is None:
        theta = 1.0 if soft or type(law) is not cn.Coulomb else 0.5
    solver = cn.Default(max_iter=max_iter) if tol is None else cn.Default(tol=tol, max_iter=max_iter)
    simulation = cn.Simulation(scene, dt, cn.NSCD(theta=theta, solver=solver, threads=threads))
    simulation.follow_rotations()
    return Built(simulation, blocks, conditions, np.array(owner), ids, meshes, law, duration, gravity)


def _warn_of_units(blocks):
    """Warns of blocks so large that their lengths are probably millimetres."""
    size = float(np.median([np.max(np.ptp(np.concatenate([v for v, _ in b.parts]), axis=0)) for b in blocks]))
    if size >= LARGE:
        told = f"blocks are {size:.3g} m long (the median); lengths of a model are metres"
        warnings.warn(f"{told}: if they were drawn in millimetres, scale the model by 1e-3", BlocksWarning, stacklevel=3)


def contact_law(problem, joint=None):
    """Gives the law of the contacts of a problem.

    Friction alone is Coulomb's law. A cohesion c or a tensile strength t_c [Pa] joins blocks that touch at the start by
    cairn.MohrCoulomb until one of them is reached.

    Parameters
    ----------
    problem : compas_dem.problem.Problem
        The problem with its contact model.
    joint : cairn.Law or dict, optional
        A law in the place of it, as of `build`.

    Returns
    -------
    cairn.Law
        The law.

    Raises
    ------
    ValueError
        If there is no contact model and no joint, or the joint is no law.
    """
    if joint is not None:
        return joint_law(joint)
    model = problem.contact_properties.contact_model
    if model is None:
        raise ValueError("the problem has no contact model: problem.set_contact_model('MohrCoulomb', mu=0.6), or joint=")
    springs = problem.contact_properties.joint_model
    if springs is not None and (springs.kn or springs.kt):
        told = f"kn={springs.kn}, kt={springs.kt} of the joint model are not used, contacts are rigid as in LMGC90's back-end"
        warnings.warn(f"{told}: give joint=cairn.ElasticContact(...) or a cohesive zone for springs", stacklevel=2)
    if not model.c and not model.t_c:
        return cn.Coulomb(mu=model.mu)
    return cn.MohrCoulomb(tension=model.t_c or 0.0, cohesion=model.c or 0.0, friction=model.mu, mu=model.mu)


def joint_law(joint):
    """Gives a law from itself or from plain data.

    Parameters
    ----------
    joint : cairn.Law or dict
        The law, or {"law": name, parameter: value, ...}.

    Returns
    -------
    cairn.Law
        The law.

    Raises
    ------
    ValueError
        If it is neither.
    """
    if isinstance(joint, cn.Law):
        return joint
    name = joint.get("law") if isinstance(joint, dict) else None
    made = getattr(cn, name, None) if isinstance(name, str) else None
    if not (isinstance(made, type) and issubclass(made, cn.Law)):
        raise ValueError(f"joint is {joint!r}: give a law, as cairn.MAL(...), or {{'law': name, ...}} with one of {SOLIDS}")
    return made(**{k: v for k, v in joint.items() if k != "law"})


def told_joint(joint):
    """Gives a law as plain data, which is saved with a solver.

    Parameters
    ----------
    joint : cairn.Law or dict
        As of `build`.

    Returns
    -------
    dict
        {"law": name, parameter: value, ...}.
    """
    law = joint_law(joint)
    return {"law": type(law).__name__} | dict(zip(law.parameter_names, law.values))


def _joined(parts):
    """Corners and faces of the parts of one body, as mass_properties takes a body of several parts."""
    first = np.cumsum([0, *(len(v) for v, _ in parts)])
    joined = [[int(i) + f for i in face] for (_, faces), f in zip(parts, first) for face in faces]
    return [np.concatenate([v for v, _ in parts])], [joined]


def _convex(mesh, name):
    """Convex parts of a mesh with its faces outward: one if it is convex; faces whose corners lie in no plane as triangles."""
    vertices, faces = mesh.to_vertices_and_faces()
    vertices, faces = np.array(vertices, float), [list(f) for f in faces]
    fans = [[f[0], f[i], f[i + 1]] for f in faces for i in range(1, len(f) - 1)]
    a, b, c = np.moveaxis(vertices[fans] - vertices[0], 1, 0)
    if np.einsum("ij,ij->", a, np.cross(b, c)) < 0:
        faces, fans = [f[::-1] for f in faces], [f[::-1] for f in fans]
    try:
        for tried in (faces, fans):
            try:
                parts = convex_parts(vertices, tried)
            except MeshError:
                if tried is fans:
                    raise
                continue
            return [(np.asarray(v, float), plane_faces(np.asarray(v, float), f)) for v, f in parts]
    except MeshError as error:
        raise MeshError(error.fault, f"{name}: {error}", error.items) from None


def _deformable(blocks, conditions, asked):
    """Nodes of the graph of blocks that are elastic."""
    if asked is False or asked is None:
        return set()
    nodes = {b.node for b in blocks}
    wanted = nodes if asked is True else set(asked)
    if wanted - nodes:
        raise ValueError(f"deformable names block {min(wanted - nodes)}: the model has blocks {sorted(nodes)}")
    soft = {b.node for b in blocks if b.node in wanted and not b.support and not conditions[b.node].moved}
    for b in blocks:
        if b.node in soft and b.young is None:
            raise ValueError(f"deformable block {b.node} has no Ecm: give its material Ecm= [MPa], or leave it out of deformable")
        if b.node in soft and len(b.parts) > 1:
            raise ValueError(f"deformable block {b.node} is not convex: leave it out of deformable, or cut it into convex blocks")
    return soft


def _rigid_sets(blocks, conditions, soft, duration, dt):
    """(rows of blocks, set of bodies) for rigid blocks of the same material and driven dofs."""
    groups = {}
    for k, b in enumerate(blocks):
        if b.node not in soft:
            mine = conditions[b.node]
            given = [*mine.translation, *mine.rotation]
            driven = tuple(n for n, v in zip(DOFS, given) if b.support or v is not None)
            still = b.support and not any(given)
            groups.setdefault((driven, still, b.density), []).append(k)
    for (driven, still, density), rows in groups.items():
        material = cn.Material(_material_name(density), density=1.0 if density is None else float(density))
        shapes = [blocks[k].parts for k in rows]
        if still:
            yield rows, cn.polyhedra(shapes, material, fixed=True)
            continue
        own = [conditions[blocks[k].node] for k in rows]
        options = {}
        if driven:
            way = np.array([[v or 0.0 for v in (*c.translation, *c.rotation)] for c in own])
            options = {"driven": driven, "drive": _smoothly(way / duration, duration, dt) if np.any(way) else way}
        if any(c.loaded for c in own) and len(driven) < len(DOFS):
            ramp, at_once = np.array([c.ramp for c in own]), np.array([c.at_once for c in own])
            options["force"] = _over_time(ramp, at_once, duration)
        yield rows, cn.polyhedra(shapes, material, **options)


def _joint_sides(blocks):
    """{node of the graph: [(point, normal) of each side that lies on a side of another block]}."""
    assembly = Blocks(3, flush=FLUSH)
    owner = []
    for b in blocks:
        for vertices, faces in b.parts:
            assembly.add(vertices, faces)
            owner.append(b.node)
    found, joints = {}, assembly.joints()
    for pair, normal, polygon in zip(joints.blocks.tolist(), joints.normal, joints.polygon):
        for k in pair:
            sides = found.setdefault(owner[k], [])
            if not any(abs(normal @ n) > 1 - FLUSH and abs((polygon[0] - x) @ n) < FLUSH * np.ptp(polygon) for x, n in sides):
                sides.append((polygon[0], normal))
    return found


def _material_name(density):
    return "support" if density is None else f"stone {float(density):.12g}"


def _smoothly(mean, duration, dt):
    """Function of time of velocities that start and end at 0; over all steps they add up to the mean times the duration."""
    if duration < 1.5 * dt:
        return mean
    return lambda t: (1.0 - np.cos(2 * np.pi * t / duration)) * mean


def _over_time(ramp, at_once, duration):
    """Function of time of loads that grow and that act at once."""

    def load(t):
        growing, whole = history(t, duration)
        return growing * ramp + whole * at_once

    return load


def _mesh_sets(block, mine, sides, duration, size, rayleigh):
    """Sets of a deformable block: nodes and faces of its sides that are joints, of its whole boundary if none is."""
    points, cells = cells_of(*block.faces_plane, size)
    body, faces = elastic_body(block, points, cells, sides, rayleigh)
    options = {}
    if np.any(mine.acceleration):
        options["body_force"] = _over_time(*(block.density * mine.acceleration), duration)
    concentrated = [(p, f, ramped) for p, f, ramped in mine.points if np.any(f)]
    if concentrated or np.any(mine.moment):
        nodal = np.zeros((2, *points.shape))
        for point, force, ramped in concentrated:
            nodal[0 if ramped else 1] += inertial_forces(body, block.center, force, np.cross(point - block.center, force))
        for k in range(2):
            nodal[k] += inertial_forces(body, block.center, np.zeros(3), mine.moment[k])
        over_time = _over_time(*nodal, duration)
        names = [f"node {i}" for i in range(len(points))]
        options["force"] = lambda t: dict(zip(names, over_time(t)))
    traction = {}
    for face, load, ramped in mine.faces:
        pair = traction.setdefault(face, np.zeros((2, 3)))
        pair[0 if ramped else 1] += load
    if traction:
        options["traction"] = {faces[f]: _over_time(*pair, duration) for f, pair in traction.items()}
    material = cn.Material(_material_name(block.density), density=float(block.density))
    touching = [f"side {k}" for k in range(len(sides))] or "boundary"
    return cn.deformable(body, material, contact=touching, faces=touching, name=f"block {block.node}", **options)
