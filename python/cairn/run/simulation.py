"""The time loop: a scene, a strategy, a step; files, progress, restart."""

from __future__ import annotations

import contextlib

import numpy as np

from .. import _core
from ..base import checks
from ..base.given_ranks import asked
from ..model import bodies, missing_laws
from ..model.rules import rule
from ..model.scene import Scene
from ..model.scene_sets import checked_sets, in_core, insert
from ..names import Spelt, one_of, within
from ..options.strategies import NSCD, checked_strategy
from . import cracks, driven_cell, first_overlaps, scene_warnings, unit_warnings, unmet_shapes, views
from . import ranks as over
from .compared import arrays_of
from .driven_cell import CellDriving
from .given_values import GivenValues, step_length
from .own_kernels import OwnKernels
from .parts import ask_for_parts
from .reading import Reading
from .reshaping import Reshaping
from .restarts import Restarts
from .sets import free_masses, ids_of, living, numbers_of_meshes
from .stages import Place
from .step_warnings import StepWarnings


class Simulation(Reading, CellDriving, Reshaping, OwnKernels, Restarts, Spelt):
    """Simulation of a scene: `step` and `run` advance it, `stages` are the parts of a step.

    Parameters
    ----------
    scene : Scene
        Bodies and laws.
    dt : float or "stable"
        Step [s]; it may be changed between steps. "stable", under SmoothDEM: a fifth of `stable_step` at the start.
    strategy : Strategy, optional
        NSCD(...), SmoothDEM(...) and others; NSCD() when not given.
    overlap : {"warn", "error", "ignore"}
        Reaction to bodies that overlap at the start by more than overlap_share.
    overlap_share : float, default 0.02
        Share of the smaller radius, or of half the least width of shapes that are not round [-].
    ranks : int, "mpi" or communicator of mpi4py, optional
        Ranks that share the scene: a number, in turns in this process; or one a process of MPI; those of Scene.load when not
        given. See docs/machines.md.
    exchange : {"colour", "sweep"}
        When ranks tell each other what contacts of NSCD changed: after each colour of a sweep, with the same bits for every
        number of ranks, or once a sweep, with fewer messages and bits that depend on it.

    Raises
    ------
    ValueError
        If a value is wrong (cairn.Error, a ValueError too, if the core tells it); the message names field, index, value and
        remedy.

    Examples
    --------
    >>> rock = cn.Material("rock", density=2800.0)
    >>> scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    >>> _ = scene.add(cn.disks([[0.0, 0.5]], 0.5, rock), cn.wall((0.0, 0.0), (0.0, 1.0), rock))
    >>> scene.interact(rock, rock, cn.Coulomb(mu=0.4))
    >>> sim = cn.Simulation(scene, dt=1e-3)
    >>> sim.run(steps=10, progress=False)
    10
    """

    def __init__(self, scene, dt, strategy=None, *, overlap="warn", overlap_share=0.02, ranks=None, exchange="colour"):
        if not isinstance(scene, Scene):
            raise ValueError(f"scene is {scene!r}: give a cairn.Scene")
        given = checked_strategy(NSCD() if strategy is None else strategy)
        ranks, self._ranks = asked(scene.ranks if ranks is None else ranks), None
        one_of("exchange", exchange, ("colour", "sweep"))
        if ranks is not None:
            given = over.with_default_solver(given)
        self._dt = 1.0 if isinstance(dt, str) and dt == "stable" else step_length(dt, "stable")
        self.scene = scene
        scene.check_names()
        self._rules, self._rules_seen, self._sets_seen = list(scene.rules), len(scene.rules), len(scene.sets)
        self._species = scene.species()
        steps = ranks is None or overlap != "ignore" or isinstance(dt, str)  # contacts or the stable step of the whole are sought
        core, sets = in_core(scene, self._species, workspace=steps)
        self._table = scene.law_table(self._species)
        self._given, self._strategy = given, given.for_scene(core, self._rules, free_masses(sets))
        self._core = _core.Simulation(core, self._table, self.strategy.settings())
        if scene.periodic is not None:
            driven_cell.drive_cell(self._core, scene, scene.periodic)
        self._cell = scene.periodic
        self._core_scene, self._is_older_state = self._core.fingerprint(), self._core.is_older_state
        self._sets, self._materials, self._radii, self._info = sets, scene._materials, None, {}
        self._warnings, self._shadows, self._watches = StepWarnings(), [], []
        self._came_by, self._last_outputs = "steps", {}  # source of the state; steps of the last outputs by path
        self._cell_seen = (scene.periodic, scene.origin.copy())
        self.check_state = self._core.check_state  # raises ValueError for an impossible state
        self.contactors, self._stage = views.ContactorView(self._core), Place()
        ask_for_parts(self)
        self._start_functions()
        self._start_meshes()
        self._fluid = self._start_fluid()
        one_of("overlap", overlap, ("warn", "error", "ignore"))
        self._added, self._overlap_share = [], np.inf if overlap == "ignore" else checks.number("overlap_share", overlap_share)
        self._unmet, self._lawless, self._turned, self._deepest = set(), set(), set(), 0.0
        self._warn_of_shapes()
        missing_laws.warn(self._sets, self._rules, self._lawless, 3)
        if overlap == "ignore":
            first_overlaps.look_at_walls(self, above=4)
        elif len(self.bodies):
            of_ranks = None if ranks is None else exchange
            self._warnings.begins_with(first_overlaps.check(self, overlap, self._overlap_share, of_ranks))
        if isinstance(dt, str):
            self.dt = self._stable_fifth()
        unit_warnings.warn(self, 3)
        unit_warnings.warn_of_cell(scene.periodic, self._dt, 3)
        scene_warnings.warn(self, 3)
        scene_warnings.warn_of_tension(self, scene.periodic, 3)
        if ranks is not None:
            self._ranks = over.Ranks(self, ranks, exchange)
        if self._fluid:
            self._fluid.told = None  # ranks have compared it
        self._made = True

    def _stable_fifth(self):
        limit = self.stable_step if self._given.row == "smooth_dem" else np.inf
        if not np.isfinite(limit):
            raise ValueError(f"dt is 'stable', and {self._given.row} has no stable step in this scene: give dt [s]")
        return limit / 5

    def _elsewhere(self, name):
        own = "; sim.bodies.set(...) sets position, velocity and rotation" if name == "bodies" else ""
        parts = {"scene": self.scene, "bodies": self.bodies, "contacts": self.contacts}
        return own if hasattr(type(self), name) else within("sim", parts, name)

    # ------------------------------------------------------------------ state

    @property
    def dt(self):
        """Step [s]."""
        return self._dt

    @dt.setter
    def dt(self, value):
        self._stage.at_rest("dt", dt=value)
        self._dt = step_length(value)

    @property
    def strategy(self):
        """Strategy, with the solver that was chosen for it; another may be given between steps."""
        return self._strategy

    @strategy.setter
    def strategy(self, value):
        self.between_steps("strategy", strategy=value)
        value = checked_strategy(value) if self._ranks is None else over.with_default_solver(checked_strategy(value))
        chosen = value.for_scene(self._core.scene, self._rules, free_masses(self._sets))
        if self._fluid:
            self._fluid.refuse_integrator(chosen)
        self._core.set_strategy(chosen.settings())
        self._given, self._strategy = value, chosen
        self._core.check_laws()
        self._values.forces_are_due = True
        self._start_meshes(anew=True)

    def _start_fluid(self):
        if not self.scene.fluids:
            if self.scene.fluid_ends:
                raise ValueError("cn.Inflow and cn.Outflow are ends of a liquid, and the scene has none: add cn.fluid(...)")
            return None
        from .fluid import Running

        return Running(self, self._core)

    def _check_same(self, of, **given):
        if self._ranks is not None:
            self._ranks.check_same_call(of, given)

    def _failing_together(self):
        return contextlib.nullcontext() if self._ranks is None else self._ranks.failing_together()

    def follow_rotations(self):
        """Stores rotations of bodies from now on even if no contact needs them, for readers of run files."""
        self._stage.at_rest("follow_rotations")
        n = len(self.bodies)
        if (n or len(self.nodes)) and "rotation" not in self.bodies.names:
            self._core.assign_body("rotation", np.zeros(n) if self.scene.dim == 2 else np.tile([1.0, 0, 0, 0], (n, 1)))

    # ------------------------------------------------------------------ stepping

    def step(self, dt=None):
        """Makes a step.

        If it fails it raises and leaves the state unchanged.

        Parameters
        ----------
        dt : float, optional
            Its length [s]; `dt` of the simulation when not given.

        Returns
        -------
        dict
            Its report, see `info`.

        Raises
        ------
        ValueError
            If bodies meet for which there is no law, a function of time gives no finite number, or a step is being made by
            stages.
        """
        self.between_steps("step")
        if self._shadows:
            from . import shadow

            return shadow.step(self, dt, self._shadows)
        with self._failing_together():
            h = self.ready(dt)
        with self._stage.of_step(self):
            report = self._core.step(h)
        with self._failing_together():
            return self.stepped(report, h)

    def ready(self, dt=None):
        """Prepares a step: gravity, loads and driven velocities at its time. See stages.

        Parameters
        ----------
        dt : float, optional
            Its length [s]; `dt` of the simulation when not given.

        Returns
        -------
        float
            Its length [s].
        """
        h = self._dt if dt is None else step_length(dt)
        with self._stage.of_loads():
            self._follow_scene()
            self._values.apply(self, h)
            _ = [part.load(h) for part in (self._meshes, self._networks) if part]
            if self._fluid:
                self._fluid.prepare(h)
        return h

    def stepped(self, report, h):
        """Ends a step: stores its report, gives warnings, opens cracks, reshapes bodies. See stages.

        Parameters
        ----------
        report : dict
            Report of the core.
        h : float
            Length of the step [s].

        Returns
        -------
        dict
            The report.
        """
        self._info = report
        self._deepest = max(self._deepest, report.get("penetration", 0.0))
        if self._added:
            added, self._added = np.concatenate(self._added), []
            self._warnings.begins_with(first_overlaps.look_at_added(self, added, self._overlap_share))
        self._warnings.look(self, report, h)
        if self._fluid:
            self._fluid.look(report)
        if self._networks:
            self._networks.look(report)
        for change in list(filter(None, [watch.look(self) for watch in self._watches])):  # all look before any change
            change()
        return report

    def time_error(self, dt=None):
        """Estimates the time error of the coming step by step doubling.

        A step of dt is compared with two of dt / 2 from the same state. The state of the simulation does not change; contacts are
        available again after the next step, as after set_state.

        Parameters
        ----------
        dt : float, optional
            Length of the step [s]; `dt` of the simulation when not given.

        Returns
        -------
        dict
            Entries "velocity", |v - v*|_M / max(|v*|_M, |v_0|_M, |h g|_M); "position", |q - q*|_M / max(|q* - q_0|_M, h |h
            g|_M); and "order".

        Notes
        -----
        _0 is the state before the step, * that after both halves, M holds masses and inertia; differences are divided by 1 -
        2**-order (Richardson extrapolation). order is that of the integrator in smooth motion, and 1 if a contact force begins,
        ends or changes by half: across impacts a step is of first order, with an error of positions of a share of h v, and
        velocities may differ by their whole jump. For CentralDifference and BetaScheme, whose velocities are staggered,
        "velocity" is the error of the mean velocity over the step. It is the error of a single step, and errors accumulate in a
        run; it contains that of the contact solver, see NSCD(accuracy=), so tol should be well below it.
        """
        from .time_error import time_error

        self.between_steps("time_error")
        return time_error(self, dt)

    def between_steps(self, what, **given):
        """Refuses an operation if a step is in progress, in the core or stage by stage, or if ranks give it unlike arguments.

        Parameters
        ----------
        what : str
            Name of the operation.
        **given : optional
            Its arguments.

        Raises
        ------
        ValueError
            If a step is in progress.
        """
        self._stage.at_rest(what, **given)
        if self._stage.due is not None:
            text = f"{what} stands between steps, and one is being made: its stage {self.stages.due} is due"
            raise ValueError(f"{text}; go on to stages.end_step(), or stages.undo_step()")

    def run(
        self,
        steps=None,
        *,
        until=None,
        while_=None,
        output=None,
        every=1,
        checkpoint_every=None,
        callback=None,
        probes=None,
        progress=True,
        overwrite=False,
        append=False,
        time_error_every=None,
    ):
        """Makes steps until a number of steps is taken, a time is reached, or a condition is false.

        Ctrl-C, SIGTERM and SIGHUP end the run after the current step and close the file. cairn.load reads several files as one.

        Parameters
        ----------
        steps : int, optional
            Number of steps.
        until : float, optional
            Time to be reached [s].
        while_ : callable, optional
            Function of the simulation, which is true as long as the run goes on.
        output : path-like, optional
            Path of the .vtkhdf file.
        every : int, default 1
            Steps between outputs.
        checkpoint_every : int, optional
            Steps between checkpoints, beside the output.
        callback : callable, optional
            Function of the simulation that is called after each step; returning False ends the run.
        probes : dict, optional
            {name: function of the simulation that gives a number, or Probe}, recorded in the history each step, or as often as
            the Probe says; needs `output`, whose file holds the history.
        progress : bool, default True
            Shows a bar.
        overwrite : bool, default False
            Replaces an existing file.
        append : bool, default False
            Continues an existing file; after restore its later outputs are dropped and made again.
        time_error_every : int, optional
            Steps between estimates of the time error (`time_error`), in the history and in info["time_error"]; the history has
            NaN in other steps, and if the halves fail. Each estimate costs two steps of dt / 2.

        Returns
        -------
        int
            Number of steps taken.

        Raises
        ------
        ValueError
            If no end is given, or a value is wrong.
        FileError
            If a file cannot be written, exists already, is of another scene, or has later steps without a restore.
        """
        from .loop import run

        self._stage.at_rest("run")
        return run(
            self,
            steps=steps,
            until=until,
            while_=while_,
            output=output,
            every=every,
            callback=callback,
            checkpoint_every=checkpoint_every,
            probes=probes,
            progress=progress,
            overwrite=overwrite,
            append=append,
            time_error_every=time_error_every,
        )

    # ------------------------------------------------------------------ changes between steps

    def interact(self, a, b, law):
        """Sets the law between two materials or groups for later steps, as Scene.interact.

        Parameters
        ----------
        a : Material or str
            A material, its name, the name of a group, or "*" for all.
        b : Material or str
            The other side, likewise.
        law : Law or None
            The law; None: no contact.

        Raises
        ------
        ValueError
            If a side is no name of the scene or the law is none.
        """
        self._stage.at_rest("interact", a=a, b=b, law=law)
        for side in (a, b):
            if any(side is f or side == f.name for f in self.scene.fluids if isinstance(side, (str, type(f)))):
                name = side if isinstance(side, str) else side.name
                raise ValueError(
                    f"{name!r} is a liquid, and how it meets bodies is known before the first step: give "
                    "Scene.interact(fluid, ...) before cn.Simulation, or a new simulation"
                )
        rules = [*self._rules, rule(a, b, law)]
        self.scene.check_names(self._species, rules)
        self._use_laws(self._species, rules)
        self._warn_of_shapes()

    def _use_laws(self, species, rules, sets=()):
        """Uses the laws of these species and rules from now on. sets: sets that are being added."""
        table = self.scene.law_table(species, rules, [*self._sets, *sets])
        self._core.set_laws(table)
        self._species, self._rules, self._table = species, rules, table

    def _warn_of_shapes(self):
        unmet_shapes.warn(self._core.scene, self._unmet, 4, bool(free_masses(self._sets)), self._table.meet)

    def _follow_scene(self):
        """Takes over rules added to the scene since. Raises ValueError if its bodies, cell or origin were changed."""
        fresh = self.scene.rules[self._rules_seen :]
        if any(law is not None and law.name == "joint" for *_, law in fresh):
            raise ValueError("a joint was made in the scene after the simulation was made of it: join bodies by Simulation.join")
        if len(self.scene.sets) != self._sets_seen:
            raise ValueError("bodies were added to the scene after the simulation was made of it: add them by Simulation.add")
        if self.scene.periodic is not self._cell_seen[0] or not np.array_equal(self.scene.origin, self._cell_seen[1]):
            name = "periodic" if self.scene.periodic is not self._cell_seen[0] else "origin"
            raise ValueError(f"{name} of the scene was set after the simulation was made of it: make another Simulation of it")
        self.scene._stepped = True
        if fresh:
            self._check_same("scene.interact", rules=fresh)
            rules = self._rules + fresh
            self.scene.check_names(self._species, rules)
            self._use_laws(self._species, rules)
            self._rules_seen = len(self.scene.rules)
            self._warn_of_shapes()

    def add(self, *sets):
        """Inserts sets of bodies between steps, all or none.

        Parameters
        ----------
        *sets : BodySet or list of BodySet
            The sets.

        Returns
        -------
        ndarray (n,)
            Ids of their bodies.

        Raises
        ------
        ValueError
            If a set is wrong; nothing is inserted then.

        Notes
        -----
        Bodies that overlap others by over `overlap_share` are told of in the next step, but for overlap="ignore".
        """
        from ..model.bodies import replace

        self.between_steps("add")
        sets, self._materials = checked_sets(self.scene.dim, sets, self._materials, self.scene.periodic)
        if self._fluid:
            self._fluid.refuse_inside(sets)
        self._check_same("add", **arrays_of(sets))
        species = dict(self._species)
        for s in sets:
            for c in s.contactors:
                species.setdefault(c.species(s.group), len(species))
        if len(species) > len(self._species) or any(s.mesh for s in sets):  # nodes never touch nodes
            self._use_laws(species, self._rules, sets)
        numbers, ids = numbers_of_meshes(self._core.scene, self._sets), []
        for s in sets:
            ids.append(insert(self._core.scene, s, species, self.time, numbers))
            self._sets.append(replace(s, ids=ids[-1]))
        if ids and self._overlap_share < np.inf:
            self._added.append(np.concatenate(ids))
        self._radii = None
        if self._given.for_scene(self._core.scene, self._rules, free_masses(self._sets)) != self._strategy:
            self.strategy = self._given
        self._start_functions()
        self._start_meshes()
        self._warn_of_shapes()
        missing_laws.warn(self._sets, self._rules, self._lawless, 3)
        first_overlaps.look_at_walls(self, above=4)
        return np.concatenate(ids) if ids else np.zeros(0, np.int64)

    def remove(self, ids):
        """Removes bodies between steps, all or none.

        Parameters
        ----------
        ids : array_like of int
            Ids of bodies; a mesh goes by `meshes[k].all_ids`.

        Raises
        ------
        ValueError
            If there is no such body, or one is named twice.
        """
        ids = checks.body_ids(ids)
        self.between_steps("remove", ids=ids)
        self._core.remove_bodies(ids)
        self._radii = None
        self._sets = living(self._sets, self._sets_seen, self._present())
        if self._meshes:
            self._meshes.removed(ids)
        self._start_functions()

    def drive(self, ids, dofs, velocity=None):
        """Imposes velocities on dofs of bodies in later steps.

        Other dofs keep their drive. No dofs, (), removes all drives and holds of the bodies.

        Parameters
        ----------
        ids : array_like of int
            Ids of the bodies.
        dofs : str or sequence of str
            Names of the dofs.
        velocity : float, array_like (3,), (6,), (n, 3) or (n, 6), or callable, optional
            Velocities over all dofs [m/s, rad/s], a number if a single dof is named, or a function of time that gives them;
            a Table, Harmonic or Expression of a single dof may give a number. Needed unless no dofs are named.

        Raises
        ------
        ValueError
            If there is no such body or dof, or a velocity is missing or not finite.
        """
        self._stage.at_rest("drive", ids=ids, dofs=dofs, velocity=velocity)
        ids, dim = checks.body_ids(ids), self.scene.dim
        imposed = {"driven": dofs, "drive": bodies.driven_at(dofs, velocity, len(ids), dim)}
        carrier = bodies.checked(bodies.BodySet(dim, np.zeros((len(ids), dim)), None, None, [], ids=ids, **imposed))
        self._core.scene.drive(ids, carrier.mask, None)  # raises for ids that are no rigid bodies
        self._sets.append(carrier)
        self._sets = living(self._sets, self._sets_seen, self._present())
        self._start_functions()
        self._warn_of_shapes()

    # ------------------------------------------------------------------ values that change with time

    def _present(self):
        """Ids of all bodies and nodes, rising, (n,)."""
        scene = self._core.scene
        return ids_of({of: {"id": ids} for of, ids in (("bodies", scene.body("id")), ("nodes", scene.node("id")))})

    def _start_functions(self):
        """Takes gravity, drives, forces and damping of the present bodies from their sets."""
        self._values = GivenValues(self)

    def _start_meshes(self, state=None, anew=False):
        """Passes the deformable bodies to the core, see Meshes; their modules are imported only if there are any."""
        before, self._meshes = getattr(self, "_meshes", None), None
        if self._core.scene.node_count:
            from .meshes import Meshes

            self._meshes = Meshes(self, self._core, before, state, anew)
            if any(mesh.d.opening is not None for mesh in self._meshes.meshes):
                cracks.watch(self)
        elif before:
            self._core.set_meshes([])
        self._networks = self.scene.running_networks(self, self._core)

    def _call(self, function, t):
        """Value at time t [s] of a function of time, or of a function of time and simulation (Servo)."""
        return function(t, self) if getattr(function, "needs_simulation", False) else function(t)
