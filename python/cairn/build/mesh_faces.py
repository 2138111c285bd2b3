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

    def part_set(self, places, material, d):
        """A contactor for each facet."""
        from .meshes import part_set

        corners = places[self.nodes]
        centre = corners.mean(axis=1)
        used, renumbered = np.unique(self.nodes, return_inverse=True)
        hulls, around = with_neighbours(places[used], renumbered.reshape(self.nodes.shape), centre)
        self.around = [used[part] for part in around]
        n = len(self)
        contactor = bodies.ContactorSet("facet", material, np.arange(n), np.zeros(n), None, None, np.arange(n), hulls)
        return part_set(3, contactor, "faces", d)
