"""Elastic bodies of blocks, and loads spread over their nodes."""

from __future__ import annotations

import cairn as cn
import numpy as np
from cairn.model.dead_loads import volumes
from cairn.pre.block_meshes import FLUSH, cells_of

__all__ = ["cells_of", "elastic_body", "inertial_forces"]


def elastic_body(block, points, cells, sides=(), rayleigh=None):
    """Makes the elastic body of a block.

    Parameters
    ----------
    block : Block
        The block.
    points : ndarray (n, 3)
        Nodes [m].
    cells : dict
        Cells, as `cells_of` gives them.
    sides : sequence of tuple
        Point (3,) [m] and normal (3,) of each side that is a joint; its nodes become the group "side K".
    rayleigh : tuple of float, optional
        Factors of mass [1/s] and stiffness [s] in its damping.

    Returns
    -------
    tuple
        The cairn.ElasticBody, and {face of the block's mesh: name of the group of its nodes}.
    """
    vertices, faces = block.faces_plane
    size = float(np.max(np.ptp(vertices, axis=0)))

    def on_plane(corners):
        normal = np.cross(corners[1:-1] - corners[0], corners[2:] - corners[0]).sum(axis=0)
        height = (points - corners.mean(axis=0)) @ (normal / np.linalg.norm(normal))
        return np.flatnonzero(np.abs(height) <= 1e-9 * size)

    groups = {"boundary": np.unique(np.concatenate([on_plane(vertices[list(f)]) for f in faces]))}
    named = {}
    for face in block.mesh.faces():
        named[face] = f"face {face}"
        groups[named[face]] = on_plane(np.array(block.mesh.face_coordinates(face), float))
    for k, (point, normal) in enumerate(sides):
        groups[f"side {k}"] = np.flatnonzero(np.abs((points - point) @ normal) <= FLUSH * size)
    groups |= {f"node {i}": np.array([i]) for i in range(len(points))}
    options = {} if rayleigh is None else {"rayleigh": tuple(rayleigh)}
    body = cn.ElasticBody(points, cells, young=block.young, poisson=block.poisson, density=float(block.density), groups=groups,
                          **options)  # fmt: skip
    return body, named


def inertial_forces(body, center, force, moment):
    """Spreads a force and a moment over the nodes, as the inertia of a rigid motion is spread, so that no cell bears it alone.

    Parameters
    ----------
    body : cairn.ElasticBody
        The body.
    center : ndarray (3,)
        Its centre of mass [m].
    force, moment : ndarray (3,)
        Resultant [N] and moment about the centre [N m].

    Returns
    -------
    ndarray (n, 3)
        Nodal forces [N] of exactly these sums.
    """
    weight = volumes(body)
    weight = weight / weight.sum()
    middle = weight @ body.points
    arm = body.points - middle
    moment = moment - np.cross(middle - center, force)  # about the middle of the nodes
    inertia = np.einsum("i,ij,ij->", weight, arm, arm) * np.eye(3) - np.einsum("i,ij,ik->jk", weight, arm, arm)
    return weight[:, None] * (force + np.cross(np.linalg.solve(inertia, moment), arm))
