"""Coupling with other codes through preCICE: rigid bodies and meshes that take forces and heat, and give displacements and
temperatures.

Explicit and implicit coupling; an implicit window is repeated from a state in memory, which holds all that the future depends on.
Needs `pyprecice` (the Python bindings) and the preCICE library, version 3.
"""

from __future__ import annotations

import contextlib
import importlib
import os

import numpy as np

from ..base import checks
from ..base.errors import FileError
from ..names import Spelt, listed, teach
from .sets import living
from .simulation import Simulation
from .views import core_of

READ = ("force", "torque", "power", "temperature")
WRITE = ("displacement", "velocity", "position", "temperature", "heat")
# quantities with one component, and the load that each quantity is part of
SCALARS = ("power", "temperature", "heat")
# quantities that vertices of removed bodies keep
LASTING = ("displacement", "position", "temperature")
LOAD = {"force": "force", "torque": "force", "power": "power", "temperature": "temperature"}
SOURCE = {"power": "flow", "temperature": "held"}
MISSING = ("the Python bindings of preCICE are needed: install the preCICE library (https://precice.org), then pip install "
           "pyprecice")  # fmt: skip
# excess of the rest of a time window over the step that is rounding, over the step
ROUNDING = 1e-9


class _Load:
    """Force, power or temperature of a coupled set as a function of time: values at the begin and the end of the step at hand."""

    needs_simulation = True

    def __init__(self, shape):
        self.early, self.late, self.begin = np.zeros(shape), np.zeros(shape), 0.0

    def __call__(self, t, simulation=None):
        return self.early if t <= self.begin else self.late


class _Part:
    """Vertices of a coupling mesh, which preCICE keeps to its end.

    Those whose bodies were removed keep the places and temperatures of the last window in which they were there, and have no
    velocity and no heat; what is read for them is dropped.
    """

    def __init__(self, simulation, name, ids, read, write):
        self.simulation, self.name, self.ids, self.read, self.write = simulation, name, ids, read, write
        self.dim, self.last = simulation.scene.dim, {}

    def keep_first(self):
        """Values of what is written, where bodies go before they were written once."""
        for what in self.write.values():
            if what != "heat":
                self.value(what)

    def value(self, what):
        """Values (m,) or (m, dim) of the vertices."""
        there = self.there()
        found = self.value_of(what, there)
        out = np.zeros((len(there), *found.shape[1:]))
        if what in LASTING and what in self.last:
            out[:] = self.last[what]
        out[there] = found
        self.last[what] = out
        return out


class _OnBodies(_Part):
    """Points on rigid bodies: forces on them act at the points."""

    def __init__(self, simulation, name, ids, offsets, owner, read, write):
        super().__init__(simulation, name, ids, read, write)
        self.offsets, self.owner = offsets, owner
        wide = {"force": (len(ids), 3 if self.dim == 2 else 6)}
        self.loads = {name: _Load(wide.get(name, (len(ids),))) for name in dict.fromkeys(LOAD[what] for what in read.values())}
        self.shared = np.bincount(owner, minlength=len(ids))  # points of each body
        self.start = self.places()

    def there(self):
        return np.isin(self.ids, self.simulation.bodies.id)[self.owner]

    def rows(self, owner):
        known = np.asarray(self.simulation.bodies.id)
        order = np.argsort(known)
        return order[np.searchsorted(known[order], self.ids[owner])]

    def arms(self, there):
        """Vectors (., dim) from the centres of the bodies to the points that are there."""
        from ..base.geometry import turn

        offsets = self.offsets[there]
        rotation = np.asarray(self.simulation.bodies.rotation)[self.rows(self.owner[there])]
        return turn(rotation, offsets, self.dim) if np.any(offsets) else offsets

    def places(self):
        return self.value("position")

    def value_of(self, what, there):
        owner = self.owner[there]
        rows = self.rows(owner)
        if what == "temperature":
            return np.ravel(self.simulation.bodies.temperature)[rows]
        if what == "heat":
            return -core_of(self.simulation).held_power(self.ids[owner]) / self.shared[owner]
        if what == "velocity":
            v = np.asarray(self.simulation.bodies.velocity)[rows]
            spin = v[:, self.dim :]
            return v[:, : self.dim] + _cross(spin, self.arms(there), self.dim)
        x = np.asarray(self.simulation.bodies.position)[rows] + self.arms(there)
        return x - self.start[there] if what == "displacement" else x

    def take(self, what, values, into):
        """Adds forces or torques (m, .) to the resultants (n, 3 | 6) of the bodies, powers (m,) to theirs, means of temperatures
        (m,) to theirs."""
        if what in SCALARS:
            values = np.ravel(values)
            np.add.at(into, self.owner, values / self.shared[self.owner] if what == "temperature" else values)
            return
        if what == "torque":
            np.add.at(into[:, self.dim :], self.owner, values.reshape(len(self.owner), -1))
            return
        np.add.at(into[:, : self.dim], self.owner, values)
        there = self.there()
        np.add.at(into[:, self.dim :], self.owner[there], _moment(self.arms(there), values[there], self.dim))


class _OnMesh(_Part):
    """Nodes of a deformable body."""

    def __init__(self, simulation, name, mesh, nodes, read, write):
        super().__init__(simulation, name, mesh._mesh.node_ids[nodes], read, write)
        self.mesh, self.nodes = mesh, nodes
        shape = {"force": (len(nodes), self.dim)}
        self.loads = {name: _Load(shape.get(name, (len(nodes),))) for name in dict.fromkeys(LOAD[what] for what in read.values())}
        if "force" in self.loads:
            self._carry()

    def _carry(self):
        """Gives the nodes a force beside that of their body."""
        d, given, load = self.mesh._mesh.d, self.mesh._mesh.d.force, self.loads["force"]

        def force(t):
            found = dict((given(t) if callable(given) else given) or {})
            return found | {(int(n),): f for n, f in zip(self.nodes, load(t))}

        d.force = force

    def there(self):
        return np.isin(self.ids, self.simulation.nodes.id)

    def places(self):
        return self.value("position")

    def value_of(self, what, there):
        ids = self.ids[there]  # all or none: a mesh is removed as a whole
        if what == "heat":
            return -core_of(self.simulation).held_power(ids)
        if what == "temperature":
            nodes = self.simulation.nodes
            order = np.argsort(nodes.id)
            return np.ravel(nodes.temperature)[order[np.searchsorted(nodes.id, ids, sorter=order)]]
        return getattr(self.mesh, what)[self.nodes] if len(ids) else np.zeros((0, self.dim))

    def take(self, what, values, into):
        into += values.reshape(into.shape)

    def sides(self):
        """Sides of the boundary with all nodes in the coupling mesh, {number of nodes: rows (m, nodes) of the vertices}."""
        body = self.mesh._mesh.d.body
        if not hasattr(body, "boundary_edges"):
            return {}
        row = np.full(len(body.points), -1)
        row[self.nodes] = np.arange(len(self.nodes))
        rows = [row[side[side >= 0]] for side in (body.boundary_edges() if self.dim == 2 else body.boundary_faces())]
        whole = [side for side in rows if np.all(side >= 0)]
        return {n: np.array([s for s in whole if len(s) == n]) for n in sorted({len(s) for s in whole})}


def _check_components(precice, part):
    """Raises ValueError for data that are scalars in the configuration and vectors here, or the other way round."""
    for data, what in (part.read | part.write).items():
        scalar = what in SCALARS or (what == "torque" and part.dim == 2)
        found, due = precice.get_data_dimensions(part.name, data), 1 if scalar else part.dim
        if found != due:
            kind = "scalar" if due == 1 else "vector"
            raise ValueError(f"data {data!r} of mesh {part.name!r} have {found} components in the configuration, and {what} has "
                             f"{due}: declare them by <data:{kind} name={data!r} />")  # fmt: skip


def _connect(precice, part, vertices):
    """Gives preCICE the sides between the vertices of a mesh, if a mapping of the configuration asks for them."""
    if not isinstance(part, _OnMesh) or not precice.requires_mesh_connectivity_for(part.name):
        return
    calls = {2: precice.set_mesh_edges, 3: precice.set_mesh_triangles, 4: precice.set_mesh_quads}
    for count, rows in part.sides().items():
        if count in calls:
            calls[count](part.name, np.asarray(vertices)[rows])


def _cross(spin, arm, dim):
    if dim == 2:
        return spin[:, :1] * np.column_stack((-arm[:, 1], arm[:, 0]))
    return np.cross(spin, arm)


def _moment(arm, force, dim):
    if dim == 2:
        return (arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0])[:, None]
    return np.cross(arm, force)


class Coupling(Spelt):
    """A simulation as a participant of preCICE.

    Parameters
    ----------
    name : str
        Name of the participant in the configuration.
    configuration : path-like
        The configuration file of preCICE (XML).
    simulation : Simulation
        The simulation.

    Raises
    ------
    ImportError
        If the bindings of preCICE are missing.
    FileError
        If there is no such file.
    ValueError
        If an argument is wrong.

    Examples
    --------
    >>> coupling = cn.precice.Coupling("Grains", "precice-config.xml", sim)                     # doctest: +SKIP
    >>> coupling.bodies("Grains-Mesh", ids, read={"Force": "force"}, write={"Displacement": "displacement"})  # doctest: +SKIP
    >>> coupling.run(output="coupled.vtkhdf", every=10)                                         # doctest: +SKIP
    """

    def __init__(self, name, configuration, simulation):
        if not isinstance(simulation, Simulation):
            raise ValueError(f"simulation is {simulation!r}: give a cairn.Simulation")
        if not isinstance(name, str) or not name:
            raise ValueError(f"name is {name!r}: give the name of the participant in the configuration")
        if simulation.ranks is not None and simulation.ranks.kind == "mpi":
            raise ValueError("the simulation runs over processes of MPI, and a participant is one process: leave out ranks")
        if not isinstance(configuration, (str, os.PathLike)):
            raise ValueError(f"configuration is {configuration!r}: give the name of preCICE's file, precice-config.xml say")
        try:
            precice = importlib.import_module("precice")
        except ImportError as error:
            raise ImportError(f"{MISSING} ({error})") from None
        if not hasattr(precice, "Participant"):
            raise ImportError(
                "these bindings of preCICE are older than version 3, which has precice.Participant: update pyprecice"
            )
        if not os.path.isfile(os.fspath(configuration)):
            raise FileError(configuration, "no such file", "give the configuration of preCICE, precice-config.xml say")
        with open(configuration, "rb") as file:
            if b"<" not in file.read(1024):
                raise FileError(configuration, "this is no XML", "give the configuration of preCICE, precice-config.xml say")
        self.simulation, self.windows, self.repeated = simulation, 0, 0
        self._participant = precice.Participant(name, os.fspath(configuration), 0, 1)
        self._parts, self._vertices, self._done = [], [], False
        simulation.follow_rotations()
        self._made = True

    def bodies(self, mesh, ids, *, points=None, owner=None, read=None, write=None):
        """Couples rigid bodies, at their centres or at points on them.

        Parameters
        ----------
        mesh : str
            Name of the coupling mesh.
        ids : array_like (n,) of int
            Ids of the bodies, as Scene.add returned them.
        points : array_like (m, dim), optional
            Points on the bodies, where they are now [m]: forces act there, displacements are those of the points.
        owner : array_like (m,) of int, optional
            Which of the n bodies each point is on; needed with points on several bodies.
        read : dict, optional
            {name of the data: "force" | "torque" | "power" | "temperature"}: forces [N] on each vertex, torques [N m] about the
            centres; powers [W] into the bodies, or temperatures [K] at which they are held, of several points their mean.
        write : dict, optional
            {name of the data: "displacement" | "velocity" | "position" | "temperature" | "heat"} of each vertex; "heat" is the
            power [W] that reaches bodies which are held at a temperature, mean of a step, shared by the points of a body.

        Raises
        ------
        ValueError
            If there is no such body, or an argument is wrong.
        """
        self._open("bodies")
        ids, dim = checks.body_ids(ids), self.simulation.scene.dim
        known = np.asarray(self.simulation.bodies.id)
        lost = np.setdiff1d(ids, known)
        if len(lost) or not len(ids):
            raise ValueError(
                f"ids names body {lost[0]}: the simulation has none such" if len(lost) else "ids is empty: give bodies"
            )
        if points is None:
            offsets, owner = np.zeros((len(ids), dim)), np.arange(len(ids))
        else:
            points = checks.real_array("points", points, (None, dim))
            if owner is None and len(ids) > 1:
                raise ValueError("owner is missing: tell which of the bodies each point is on, (m,)")
            owner = np.zeros(len(points), int) if owner is None else np.asarray(owner)
            if owner.shape != (len(points),) or owner.dtype.kind not in "iu" or np.any((owner < 0) | (owner >= len(ids))):
                raise ValueError(
                    f"owner has shape {owner.shape}: give for each of {len(points)} points a number 0 to {len(ids) - 1}"
                )
            offsets = _back(self.simulation, ids, owner, points)
        read, write = self._data(mesh, read, write, True)
        if any(LOAD[what] == "force" for what in read.values()):
            self._refuse_held(ids)
        part = _OnBodies(self.simulation, mesh, ids, offsets, owner, read, write)
        self._heat(part)
        if "force" in part.loads:
            self._carry(ids, part.loads["force"])

    def mesh(self, mesh, body=0, group="boundary", *, read=None, write=None):
        """Couples nodes of a deformable body.

        Parameters
        ----------
        mesh : str
            Name of the coupling mesh.
        body : int, default 0
            Number of the body in simulation.meshes.
        group : str or array_like of int
            Group of its nodes, or their numbers.
        read : dict, optional
            {name of the data: "force" | "power" | "temperature"}: forces [N] on the nodes, powers [W] into them, temperatures [K]
            at which they are held.
        write : dict, optional
            {name of the data: "displacement" | "velocity" | "position" | "temperature" | "heat"} of the nodes; "heat" is the
            power [W] that reaches nodes which are held at a temperature, mean of a step.

        Raises
        ------
        ValueError
            If there is no such body or group, or an argument is wrong.
        """
        self._open("mesh")
        meshes = self.simulation.meshes
        if not isinstance(body, (int, np.integer)) or not -len(meshes) <= body < len(meshes):
            raise ValueError(f"body is {body!r}: the simulation has {len(meshes)} deformable bodies, from 0")
        view = meshes[body]
        read, write = self._data(mesh, read, write, False)
        self._heat(_OnMesh(self.simulation, mesh, view, view.body_nodes(group), read, write))

    def run(self, *, output=None, every=1, overwrite=False, probes=None, callback=None, progress=False):
        """Runs until the coupling ends.

        The step is that of the simulation, or the rest of a time window if that is shorter.

        Parameters
        ----------
        output : path-like, optional
            Name of the .vtkhdf file.
        every : int, default 1
            Time windows between outputs; the history has a row for each window.
        overwrite : bool, default False
            Replaces the file if it is there.
        probes : dict, optional
            {name: function of the simulation}, recorded with the history; needs `output`.
        callback : callable, optional
            Function of the simulation that is called after each window that counts.
        progress : bool, default False
            Prints each window to the standard error.

        Returns
        -------
        int
            Number of windows.

        Raises
        ------
        ValueError
            If nothing is coupled, or the coupling was run before.
        """
        self._open("run")
        if not self._parts:
            raise ValueError("nothing is coupled: call coupling.bodies(...) or coupling.mesh(...) before run")
        every = checks.count("every", every, 1)
        from .loop import _Recorder, check_calls

        check_calls(self.simulation, callback, probes, output)

        precice = self._participant
        self._done = True
        for part in self._parts:
            wide = precice.get_mesh_dimensions(part.name)
            if wide != part.dim:
                raise ValueError(f"mesh {part.name!r} of the configuration has {wide} dimensions, and the scene {part.dim}")
            _check_components(precice, part)
            self._vertices.append(precice.set_mesh_vertices(part.name, part.places()))
            _connect(precice, part, self._vertices[-1])
        if precice.requires_initial_data():
            self._write()
        precice.initialize()
        recorder = _Recorder(self.simulation, output, 2**53, None, overwrite, False, probes)
        try:
            self._loop(recorder, every, probes, callback, progress)
        except BaseException:
            with contextlib.suppress(Exception):  # so that its connections are closed
                precice.finalize()
            raise
        finally:
            recorder.close()
        precice.finalize()
        return self.windows

    def _loop(self, recorder, every, probes, callback, progress):
        precice, simulation, kept = self._participant, self.simulation, None
        while precice.is_coupling_ongoing():
            if precice.requires_writing_checkpoint():
                kept = simulation.get_state()
            rest = precice.get_max_time_step_size()
            h = rest if rest <= simulation.dt * (1 + ROUNDING) else simulation.dt
            self._read(h)
            simulation.step(h)
            self._write()
            precice.advance(h)
            if precice.requires_reading_checkpoint():
                simulation.set_state(kept)
                self.repeated += 1
            elif precice.is_time_window_complete():
                self.windows += 1
                recorder.record()
                if recorder.writer is not None and self.windows % every == 0:
                    recorder.write()
                if callback is not None:
                    callback(simulation)
                if progress:
                    import sys

                    told = f"window {self.windows}: t = {simulation.time:g} s, {self.repeated} repeated so far"
                    print(told, file=sys.stderr, flush=True)

    def _read(self, h):
        """Forces at the begin and at the end of a step."""
        for part, vertices in zip(self._parts, self._vertices):
            for load in part.loads.values():
                load.begin = self.simulation.time
            for at, name in ((0.0, "early"), (h, "late")):
                into = {load: np.zeros_like(part.loads[load].early) for load in part.loads}
                for data, what in part.read.items():
                    found = np.asarray(self._participant.read_data(part.name, data, vertices, at), float)
                    if not np.all(np.isfinite(found)):
                        raise ValueError(f"data {data!r} of mesh {part.name!r} holds values that are no numbers at t = "
                                         f"{self.simulation.time:g} s: the other participant gave them")  # fmt: skip
                    if what == "temperature" and not np.all(found > 0):
                        raise ValueError(f"data {data!r} of mesh {part.name!r} holds {np.min(found):g} K at t = "
                                         f"{self.simulation.time:g} s: the other participant gave it, or no initial data: "
                                         f"initialize=\"yes\" in their <exchange>")  # fmt: skip
                    part.take(what, found, into[LOAD[what]])
                for load, values in into.items():
                    setattr(part.loads[load], name, values)

    def _write(self):
        for part, vertices in zip(self._parts, self._vertices):
            for data, what in part.write.items():
                self._participant.write_data(part.name, data, vertices, part.value(what))

    def _heat(self, part):
        """Takes a part into the coupling, with sources of its powers and temperatures."""
        simulation, sources = self.simulation, [name for name in SOURCE if name in part.loads]
        if sources or any(what in SCALARS for what in part.write.values()):
            if "thermal" not in simulation.scene.networks:
                raise ValueError(f"mesh {part.name!r} exchanges heat, and the scene conducts none: call scene.thermal(...)")
            if len(sources) > 1:
                raise ValueError(f"mesh {part.name!r} reads powers and temperatures of the same bodies: give one of both")
        thermal = simulation.scene.networks.get("thermal")
        if "power" in sources and not thermal.steady:
            ids, mass = np.asarray(simulation.bodies.id), np.ravel(simulation.bodies.mass)
            kept = np.intersect1d(part.ids, ids[~np.isfinite(mass)])
            if len(kept):
                raise ValueError(f"body {kept[0]} has no finite mass and keeps its temperature, whatever the power: read its "
                                 "temperature, or write its heat")  # fmt: skip
        for name in sources:
            simulation._networks.add(SOURCE[name], part.ids, part.loads[name])
        part.keep_first()
        self._parts.append(part)

    def _refuse_held(self, ids):
        """Raises ValueError for bodies that no force moves."""
        core = core_of(self.simulation).scene
        known, mass, driven = np.asarray(self.simulation.bodies.id), np.ravel(self.simulation.bodies.mass), core.body("driven")
        held = ~np.isfinite(mass)
        if len(driven):
            held |= driven.ravel() == 2 ** (3 * self.simulation.scene.dim - 3) - 1
        stuck = np.intersect1d(ids, known[held])
        if len(stuck):
            raise ValueError(f"body {stuck[0]} is held, and forces do not move it: couple it by write= alone")

    def _open(self, what):
        if self._done:
            raise ValueError(f"{what} was called after run: a participant runs once; make another Coupling")

    def _data(self, mesh, read, write, rigid):
        """Checked copies of the lists of data to read and to write."""
        if not isinstance(mesh, str) or not mesh:
            raise ValueError(f"mesh is {mesh!r}: give the name of the coupling mesh in the configuration")
        if any(mesh == part.name for part in self._parts):
            raise ValueError(f"mesh {mesh!r} is coupled already: a mesh of the configuration is of one call")
        nodal = tuple(what for what in READ if what != "torque")
        for field, given, due in (("read", read, READ if rigid else nodal), ("write", write, WRITE)):
            if given is not None and not isinstance(given, dict):
                raise ValueError(f"{field} is {given!r}: give {{name of the data: {due[0]!r}}}")
            for data, what in (given or {}).items():
                if what not in due:
                    raise ValueError(f"{field}[{data!r}] is {what!r}: give one of {listed(due, str(what))}")
        if list((read or {}).values()).count("temperature") > 1:
            raise ValueError("read has two data of temperature for the same points: give one of them")
        if not read and not write:
            raise ValueError("read and write are both missing: give the data that are exchanged")
        return dict(read or {}), dict(write or {})

    def _carry(self, ids, load):
        """Gives bodies a force beside that of their sets."""
        from ..model import bodies

        simulation = self.simulation
        dim = simulation.scene.dim
        carrier = bodies.BodySet(dim, np.zeros((len(ids), dim)), None, None, [], ids=ids, force=load)
        simulation._sets.append(bodies.checked(carrier))
        simulation._sets = living(simulation._sets, simulation._sets_seen, simulation._present())
        simulation._start_functions()


def _back(simulation, ids, owner, points):
    """Points on bodies from their centres, in the axes of the bodies, (m, dim)."""
    from ..base.geometry import turn

    known = np.asarray(simulation.bodies.id)
    order = np.argsort(known)
    rows = order[np.searchsorted(known[order], ids)][owner]
    rotation = np.asarray(simulation.bodies.rotation)[rows]
    back = -rotation if rotation.ndim == 1 or rotation.shape[1] == 1 else rotation * [1.0, -1.0, -1.0, -1.0]
    return turn(back, points - np.asarray(simulation.bodies.position)[rows], simulation.scene.dim)


teach(globals())
