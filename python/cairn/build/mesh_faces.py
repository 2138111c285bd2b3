"""Faces of deformable bodies in 3D as antagonists: a facet of a surface for every triangle of them, which follows its nodes.

A face of four nodes makes two facets, which give normal and gap; the velocity of a point on it is the bilinear one of the element
behind it, so that the work of a contact is that of the nodal forces it makes.
"""

from __future__ import annotations

import numpy as np

from . import bodies
from .surfaces import with_neighbours


class Faces:
    """nodes (m, 3): of each facet; faces (m, 4): of the face it is a part of, the fourth -1 in a triangle."""

    def __init__(self, faces):
        faces = np.asarray(faces, int)
        if faces.shape[1] == 3:
            faces = np.pad(faces, ((0, 0), (0, 1)), constant_values=-1)
        wide = faces[:, 3] >= 0
        self.nodes = np.concatenate([faces[:, [0, 1, 2]], faces[wide][:, [0, 2, 3]]])
        self.faces = np.concatenate([faces, faces[wide]])
        self.around = [np.zeros(0, int)] * len(self.nodes)  # nodes of the surface that each facet sees, its own first

    def __len__(self):
        return len(self.nodes)

    def body_set(self, places, mass, material, d):
        """Bodies that carry a facet each; they have no inertia of their own, and do not turn."""
        corners = places[self.nodes]
        centre = corners.mean(axis=1)
        used, renumbered = np.unique(self.nodes, return_inverse=True)
        hulls, around = with_neighbours(places[used], renumbered.reshape(self.nodes.shape), centre)
        self.around = [used[part] for part in around]
        n = len(self)
        contactor = bodies.ContactorSet("facet", material, np.arange(n), np.zeros(n), None, None, np.arange(n), hulls)
        light = np.full(n, 1e-20 * mass)
        inertia = np.repeat((light * np.ptp(corners, axis=1).max(axis=1) ** 2)[:, None], 3, axis=1)
        return bodies.checked(bodies.BodySet(3, centre, light, inertia, [contactor], group=f"{d.name} faces", mesh=d))

    def follow(self, scene, rows, places):
        """Puts the bodies `rows` (internal) and their facets where the nodes are, places (n, 3)."""
        centre = places[self.nodes].mean(axis=1)
        scene.raw_body("position")[rows] = centre
        scene.raw_body("rotation")[rows] = [1.0, 0.0, 0.0, 0.0]
        vertices = [places[part] - c for part, c in zip(self.around, centre)]
        scene.move_facets(rows, np.concatenate(vertices))

    def spins(self, places):
        """Spin of each facet from the velocities of its nodes, (m, 3 nodes, 3, 3): that of its normal, the mean one about it."""
        x = places[self.nodes]
        area = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        twice = np.linalg.norm(area, axis=1)
        n = area / twice[:, None]
        opposite = np.roll(x, -2, axis=1) - np.roll(x, -1, axis=1)  # of node i from node i + 1 to node i + 2
        gradient = np.cross(n[:, None], opposite) / twice[:, None, None]
        curl = np.zeros((*gradient.shape, 3))
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            curl[..., i, k], curl[..., i, j] = gradient[..., j], -gradient[..., k]
        # of a rotation, the curl of what is known on the plane counts its part about the normal twice
        return curl - 0.5 * n[:, None, :, None] * np.einsum("mk,maki->mai", n, curl)[:, :, None, :]

    def weights(self, which, places, points):
        """Shares (k, 4) of the nodes of their faces in the motion of points (k, 3) on facets `which` (k,)."""
        out = np.zeros((len(which), 4))
        x = places[self.nodes[which]]
        e, f, r = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0], points - x[:, 0]
        area = np.cross(e, f)
        square = np.sum(area**2, axis=1)
        second = np.sum(np.cross(r, f) * area, axis=1) / square
        third = np.sum(np.cross(e, r) * area, axis=1) / square
        wide = self.faces[which, 3] >= 0
        out[:, 0], out[:, 1], out[:, 2] = 1 - second - third, second, third
        if wide.any():
            out[wide] = bilinear(places[self.faces[which[wide]]], points[wide], area[wide] / np.sqrt(square[wide])[:, None])
        return out


def bilinear(corners, points, normal):
    """Shape functions (k, 4) of quadrilaterals (k, 4, 3) where the lines along `normal` through points (k, 3) meet them, by
    Newton's method in the plane across the normal."""
    axis = np.zeros_like(normal)
    axis[np.arange(len(axis)), np.argmin(np.abs(normal), axis=1)] = 1.0
    t = np.cross(axis, normal)
    t /= np.linalg.norm(t, axis=1)[:, None]
    plane = np.stack([t, np.cross(normal, t)], axis=1)
    x = np.einsum("kij,knj->kni", plane, corners)
    target = np.einsum("kij,kj->ki", plane, points)
    place = np.zeros((len(x), 2))
    for _ in range(20):
        share, slope = _shape(place)
        wrong = target - np.einsum("kn,kni->ki", share, x)
        step = np.linalg.solve(np.einsum("kna,kni->kia", slope, x), wrong[..., None])[..., 0]
        place += step
        if np.abs(step).max() < 1e-14:
            break
    return _shape(place)[0]


def _shape(place):
    a, b = place.T
    share = np.stack([(1 - a) * (1 - b), (1 + a) * (1 - b), (1 + a) * (1 + b), (1 - a) * (1 + b)], axis=1) / 4
    by_a = np.stack([b - 1, 1 - b, 1 + b, -1 - b], axis=1) / 4
    by_b = np.stack([a - 1, -1 - a, 1 + a, 1 - a], axis=1) / 4
    return share, np.stack([by_a, by_b], axis=2)
