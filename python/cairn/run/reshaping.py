"""Methods of Simulation that change bodies between steps: make them deformable or rigid, join and merge them."""

from __future__ import annotations

from ..base import checks


class Reshaping:
    """Methods of Simulation that reshape, join and merge bodies."""

    def deform(self, id, body, *, material=None, **options):
        """Makes a rigid body deformable between steps; returns the view of its mesh.

        id: of the rigid body; body: an ElasticBody or SolidBody of its shape, in its initial position, which gets its place,
        mass, momentum and angular momentum. material: of its contacts, that of the rigid body by default. options: as for
        cairn.deformable; contact and edges or faces are the whole surface by default. The memory of contacts passes to the
        nearest new contacts; lost kinetic energy is in info["energy"]["dissipated_reshaping"]. Raises ValueError for a body held
        by a bond or cohesive zone.
        """
        from .reshape import deform

        self.between_steps("deform")
        return deform(self, id, body, material=material, **options)

    def rigidify(self, mesh, shape=None):
        """Makes a mesh rigid between steps, with its momentum and angular momentum; returns the id of the body, which is that of
        the former rigid body if there was one.

        mesh: a view of `meshes`, or its number there. shape: a set with a single body in the position of the mesh, needed if it
        was no rigid body before, or for another shape. Stored energy and kinetic energy of deformation are in
        info["energy"]["dissipated_reshaping"]. Raises ValueError for a mesh held by a bond or cohesive zone.
        """
        from .reshape import rigidify

        self.between_steps("rigidify")
        return rigidify(self, mesh, shape)

    def reshape_when(self, ids, body, *, force=None, stress=None, back=None, **options):
        """Makes rigid bodies deformable (`deform`) after each later step in which a contact force on them exceeds `force` [N], or
        a principal value of their mean stress exceeds `stress` [Pa]; and rigid again once all their contact forces are below
        `back` [N]. body: for all of them, or {id: body}; options: as for `deform`.
        """
        from .reshape import Watch

        self.between_steps("reshape_when")
        self._watches.append(Watch(checks.body_ids(ids), body, force, stress, back, options))

    def join(self, a, b, joint):
        """Joins two rigid bodies in their current positions between steps, or a body and the world (b None). a, b: ids; joint: as
        for Scene.join. Returns the name of the joint. Velocities that violate it cause an impact in the next step.
        """
        from .joining import join

        self.between_steps("join")
        return join(self, a, b, joint)

    def unjoin(self, name):
        """Removes a joint between steps. name: as returned by join. Energy stored in its spring is in
        info["energy"]["dissipated_reshaping"].
        """
        from .joining import unjoin

        self.between_steps("unjoin")
        unjoin(self, name)

    def merge(self, ids):
        """Merges rigid grains (disks, spheres, clumps, in the same group) to a single body between steps; returns its id, the
        lowest of theirs.

        Mass, momentum, angular momentum and the memory of contacts with other bodies are kept. The kinetic energy of relative
        motion and the energy stored in contacts between the grains are in info["energy"]["dissipated_reshaping"], after the first
        step. In a periodic cell neighbouring images of the grains are merged, with the velocities of these images.
        """
        from .merging import merge

        self.between_steps("merge")
        return merge(self, checks.body_ids(ids))
