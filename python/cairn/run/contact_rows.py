"""Assembled contacts of a step as arrays."""

from __future__ import annotations

import numpy as np


class ContactRows:
    """Contacts as prepared by laws, in the order of simulation.contacts: conditions on u = H'v + bias [m/s].

    axes (m, dim, dim): rows normal, tangents; lever (m, 2, dim): from the centres of A and B to the point where impulses act [m];
    bias (m, dim) [m/s]; mu (m,); compliance (m, dim): of laws with springs, on the diagonal of W [1/kg]; bodies (m, 2): internal
    numbers, -1 for a mesh; kind (m,): 0 nothing moves or the law keeps it open, 1 Coulomb's cone, 2 a law with its own solution.
    For sides on deformable bodies: mesh (m, 2), its number in simulation.meshes or -1; node (m, 2, 4) and weight (m, 2, 4) of the
    interpolation. These three are None in scenes without meshes.
    """

    def __init__(self, arrays, dim):
        self.dim = dim
        self.axes = arrays["axes"].reshape(-1, dim, dim)
        self.lever = arrays["lever"].reshape(-1, 2, dim)
        self.bias = arrays["bias"].reshape(-1, dim)
        self.compliance = arrays["compliance"].reshape(-1, dim)
        self.mu, self.kind = arrays["mu"], arrays["kind"]
        self.bodies = arrays["bodies"].reshape(-1, 2)
        self.mesh = self.node = self.weight = None
        if len(arrays["mesh"]) or not len(self.mu):
            self.mesh = arrays["mesh"].reshape(-1, 2)
            self.node, self.weight = arrays["node"].reshape(-1, 2, 4), arrays["weight"].reshape(-1, 2, 4)

    def cones(self):
        """Numbers (k,) of the contacts of kind 1. Raises ValueError if a contact has a law with its own solution."""
        own = np.flatnonzero(self.kind == 2)
        if len(own):
            raise ValueError(
                f"contact {own[0]} obeys a law with its own local solution, such as Bonded: "
                "a contact problem holds Coulomb's cones alone"
            )
        return np.flatnonzero(self.kind == 1)
