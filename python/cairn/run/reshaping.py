"""What a simulation makes of its bodies between steps: deformable, rigid, one of several."""

from __future__ import annotations

from ..pre import checks


class Reshaping:
    """Methods of Simulation."""

    def deform(self, id, body, *, material=None, **options):
        """Makes a rigid body deformable between steps: `body`, an ElasticBody or SolidBody of its shape as it stood when it came
        in, takes its place, mass, momentum and angular momentum, its mesh is returned. material: of its contacts, that of the
        rigid body; options: as of cairn.deformable; contact and edges or faces are the whole surface. What contacts remember
        passes to those that are nearest; what kinetic energy that cannot keep is info["energy"]["dissipated_reshaping"]. A body
        that a bond or zone holds is refused.
        """
        from .reshape import deform

        self.between_steps("deform")
        return deform(self, id, body, material=material, **options)

    def rigidify(self, mesh, shape=None):
        """Makes a mesh (of `meshes`, or its number there) rigid between steps, with its momentum and angular momentum; returns
        the id, which is that of the rigid body that it was. shape: a set of one body that stands where the mesh is, for one
        that was none, or that keeps another shape. What it stored, and the energy of its deformation, is
        "dissipated_reshaping". A mesh that a bond or zone holds is refused.
        """
        from .reshape import rigidify

        self.between_steps("rigidify")
        return rigidify(self, mesh, shape)

    def reshape_when(self, ids, body, *, force=None, stress=None, back=None, **options):
        """From now on rigid bodies are made deformable (`deform`) after a step in which one of their contacts bore more than the
        `force` [N], or a principal value of their mean stress was above `stress` [Pa]; and rigid again once none bears `back`
        [N]. body: of all, or {id: body}.
        """
        from .reshape import Watch

        self.between_steps("reshape_when")
        self._watches.append(Watch(checks.body_ids(ids), body, force, stress, back, options))

    def join(self, a, b, joint):
        """Joins two rigid bodies by their ids, or one and the world (b None), as they stand between steps, by one of the kinds of
        Scene.join; its name. Velocities that it does not allow are an impact in the next step.
        """
        from .joining import join

        self.between_steps("join")
        return join(self, a, b, joint)

    def unjoin(self, name):
        """Lets a joint go between steps, by the name that join gave. What its spring stored is
        info["energy"]["dissipated_reshaping"].
        """
        from .joining import unjoin

        self.between_steps("unjoin")
        unjoin(self, name)

    def merge(self, ids):
        """Makes rigid grains one body between steps, and returns its id, the lowest of theirs: disks, spheres, clumps of one
        group. Mass, momentum and angular momentum pass over, and what contacts with others remember. The kinetic energy of their
        motion against each other, and what their contacts stored, is info["energy"]["dissipated_reshaping"], once a step has
        begun the balance. In a periodic cell grains are taken as the images that stand together, with the velocities of these.
        """
        from .merging import merge

        self.between_steps("merge")
        return merge(self, checks.body_ids(ids))
