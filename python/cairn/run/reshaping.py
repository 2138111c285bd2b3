"""Methods of Simulation that change bodies: make them deformable or rigid, join and merge them, let them grow."""

from __future__ import annotations

import numpy as np

from ..base import checks
from ..base.expressions import texts_of
from . import unit_warnings
from .compared import arrays_of


class Reshaping:
    """Methods of Simulation that reshape, join and merge bodies, and let them grow."""

    def grow(self, ids, rate):
        """Lets bodies grow in later steps, d(ln size)/dt = rate: grains pack so without gravity.

        Shapes and densities are kept: masses grow with the size to the power of dim. Growth does work, the term "work_growth" of
        the balance. A later call replaces the rate. A checkpoint holds the sizes, not the rate: give it again.

        Parameters
        ----------
        ids : array_like of int
            Ids of the bodies.
        rate : float, Table, Harmonic, Expression or None
            Rate [1/s], negative if they shrink; None ends their growth.

        Raises
        ------
        ValueError
            If a body has no finite mass, expands with its temperature or is held at points by a law, or the rate is no function
            that the core can evaluate.

        Examples
        --------
        Disks in a periodic cell of 0.1 m by 0.1 m, until they fill four fifths of it::

            sim.grow(disks, 5.0)
            sim.run(while_=lambda s: np.pi * np.sum(s.radii() ** 2) < 0.8 * 0.01, until=1.0)
            sim.grow(disks, None)
        """
        ids = checks.body_ids(ids)
        self.between_steps("grow", ids=ids, rate=rate)
        if rate is None:
            self._core.stop_growth(ids)
            return
        texts = None if isinstance(rate, str) else texts_of(rate)
        if texts is None or len(texts) != 1:
            raise ValueError(f"rate of growth is {rate!r}: give a finite number, cairn.Table, Harmonic or Expression [1/s]")
        self._core.grow(ids, texts[0])
        unit_warnings.warn_of_rate("rate of growth", rate, self.dt, 3)

    def deform(self, id, body, *, material=None, **options):
        """Makes a rigid body deformable between steps.

        The memory of contacts passes to the nearest new contacts; lost kinetic energy is in
        info["energy"]["dissipated_reshaping"].

        Parameters
        ----------
        id : int
            Id of the rigid body.
        body : ElasticBody or SolidBody
            A mesh of its shape, in its initial position, which gets its place, mass, momentum and angular momentum.
        material : Material, optional
            Material of its contacts; that of the rigid body by default.
        **options : optional
            Options of cairn.deformable; contact and edges or faces are the whole surface by default.

        Returns
        -------
        MeshView
            View of the mesh.

        Raises
        ------
        ValueError
            If the body is held by a bond, a cohesive zone or a joint, or the mesh does not fit.
        """
        from .reshape import deform

        self.between_steps("deform", id=id, body=body, material=material, options=options)
        return deform(self, id, body, material=material, **options)

    def rigidify(self, mesh, shape=None):
        """Makes a mesh rigid between steps, with its momentum and angular momentum.

        Stored energy and kinetic energy of deformation are in info["energy"]["dissipated_reshaping"].

        Parameters
        ----------
        mesh : MeshView or int
            A view of `meshes`, or its number there.
        shape : BodySet, optional
            A set with a single body in the position of the mesh, needed if it was no rigid body before, or for another shape.

        Returns
        -------
        int
            Id of the body, which is that of the former rigid body if there was one.

        Raises
        ------
        ValueError
            If the mesh is held by a bond or cohesive zone, or a shape is missing.
        """
        from .reshape import rigidify

        number = mesh if isinstance(mesh, (int, np.integer)) else getattr(getattr(mesh, "_mesh", None), "number", None)
        self.between_steps("rigidify", mesh=number, **arrays_of([] if shape is None else [shape]))
        return rigidify(self, mesh, shape)

    def reshape_when(self, ids, body, *, force=None, stress=None, back=None, **options):
        """Makes rigid bodies deformable after each later step in which they are loaded beyond a threshold.

        See `deform`.

        Parameters
        ----------
        ids : array_like of int
            Ids of the bodies.
        body : ElasticBody, SolidBody or dict
            Mesh for all of them, or {id: body}.
        force : float, optional
            Threshold of a contact force on the body [N].
        stress : float, optional
            Threshold of a principal value of the mean stress of the body [Pa].
        back : float, optional
            The body is made rigid again once all its contact forces are below this one [N].
        **options : optional
            Options of `deform`.

        Raises
        ------
        ValueError
            If neither force nor stress is given, or a threshold is not positive.
        """
        from .reshape import Watch

        given = {"force": force, "stress": stress, "back": back, "options": options}
        self.between_steps("reshape_when", ids=ids, body=body, **given)
        self._watches.append(Watch(checks.body_ids(ids), body, force, stress, back, options))

    def join(self, a, b, joint):
        """Joins two rigid bodies in their current positions between steps, or a body and the world.

        Velocities that violate the joint cause an impact in the next step.

        Parameters
        ----------
        a : int
            Id of a body.
        b : int or None
            Id of the other one; None: the world.
        joint : JointKind
            As for Scene.join.

        Returns
        -------
        str
            Name of the joint.

        Raises
        ------
        ValueError
            If there is no such rigid body, or the joint is none.
        """
        from .joining import join

        self.between_steps("join", a=a, b=b, joint=joint)
        return join(self, a, b, joint)

    def unjoin(self, name):
        """Removes a joint between steps.

        Energy stored in its spring is in info["energy"]["dissipated_reshaping"].

        Parameters
        ----------
        name : str
            Name, as returned by join.

        Raises
        ------
        ValueError
            If there is no such joint.
        """
        from .joining import unjoin

        self.between_steps("unjoin", name=name)
        unjoin(self, name)

    def merge(self, ids):
        """Merges rigid grains to a single body between steps.

        Mass, momentum, angular momentum and the memory of contacts with other bodies are kept. The kinetic energy of relative
        motion and the energy stored in contacts between the grains are in info["energy"]["dissipated_reshaping"], after the
        first step. In a periodic cell neighbouring images of the grains are merged, with the velocities of these images.

        Parameters
        ----------
        ids : array_like of int
            Ids of disks, spheres or clumps in the same group.

        Returns
        -------
        int
            Id of the body, the lowest of theirs.

        Raises
        ------
        ValueError
            If a body is none of these.
        """
        from .merging import merge

        self.between_steps("merge", ids=ids)
        return merge(self, checks.body_ids(ids))
