"""Methods of Simulation for kernels of the user: shadows beside stages, the contact problem as data, plugged routines."""

from __future__ import annotations


class OwnKernels:
    """Methods of Simulation that compare kernels of the user with its own, give them its problem, and plug them in."""

    def shadow(self, stage, kernel="reference", tol=1e-8, *, folder=".", name=None, of=None):
        """Runs a second kernel beside a stage of each later step, on the same input.

        The first step beyond the tolerance is written into a folder: a problem file (FCLIB) for solve_contacts, else arrays
        (.npz). The simulation gives the same bits with and without shadows.

        Parameters
        ----------
        stage : str
            Name of predict_configuration, compute_free_velocity, solve_contacts or update_configuration; for meshes stresses or
            element_forces; contact_laws, for the law `of`: see docs/shadow.md.
        kernel : str, Law or callable, default "reference"
            The plain loop "reference"; for solve_contacts also the name of a solver of cairn.problems, for contact_laws a law;
            or a function of the stage's input, a dict of arrays in internal order with h, theta, gravity [SI] and, for
            solve_contacts, the `problem`. It returns the stage's output (n, components), for solve_contacts the impulses
            (contacts, dim) [N s], which are compared by their velocities.
        tol : float, default 1e-8
            Largest difference over the largest value [-].
        folder : path-like, default "."
            Where the first step beyond it is written.
        name : str, optional
            Name of that file.
        of : Law or type, optional
            The law of a rule, or its class, whose kernel is compared.

        Returns
        -------
        Shadow
            The differences of the steps to come.

        Raises
        ------
        ValueError
            If the strategy has an integrator or is another than NSCD, or an argument is wrong.
        """
        if self.strategy.pose != "moreau" or getattr(self.strategy, "integrator", None) is not None:
            raise ValueError("shadows stand beside the stages of NSCD itself: leave out other strategies and integrators")
        self._stage.at_rest("shadow")
        if self._fluid:
            raise ValueError("shadows stand beside steps of bodies alone: leave out the fluid")
        from . import shadow

        self._shadows.append(shadow.add(self, stage, kernel, tol, folder, name, of))
        return self._shadows[-1]

    def problem(self):
        """Gives the contact problem of the last step.

        Returns
        -------
        cairn.problems.Problem
            Bias, friction and W of contacts that can move, then limits and motors of joints (see the page on joints), whose
            equality constraints are eliminated.
        """
        from . import contact_problem as step

        return step.jointed_problem_of(self) or step.problem_of(self)["problem"]

    def dump_problem(self, path):
        """Writes the contact problem of the last step as `cairn.problems.write` does.

        Parameters
        ----------
        path : path-like
            Name of the file: FCLIB's HDF5, or .dat for Siconos.
        """
        from .. import problems

        problems.write(path, self.problem())

    def plug(self, routine):
        """Adds a body force or a free velocity from a library to later steps; forces add up. Not with SmoothDEM.

        Parameters
        ----------
        routine : Routine
            As cairn.plug(library, force=...) or cairn.plug(library, velocity=...) makes it.

        Raises
        ------
        ValueError
            If it is no such routine.
        """
        self._stage.at_rest("plug")
        from ..plugs.plug import Routine

        if not isinstance(routine, Routine):
            raise ValueError(f"routine is {routine!r}: give cairn.plug(library, force=...) or cairn.plug(library, velocity=...)")
        call = self._core.plug_force if routine.kind == "force" else self._core.plug_velocity
        call(routine._core, list(routine.params.values()))
