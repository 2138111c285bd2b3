"""The step of scenes whose contacts meet in blocks of W = H' A^-1 H: those with deformable bodies, and the strategies beside
NSCD that pose another problem at the contacts, Carpenter's and Kishino's. The solver sees W, q and mu, and no body."""

from __future__ import annotations

import numpy as np

from ..build.meshes import MovingMesh
from .contact_problem import Rows, inverse_mass, operator

NOTHING = (np.zeros((0, 4), np.int64), np.zeros((0, 0)))  # remembered of contacts: keys, vectors in space axes


class BlockStep:
    """Steps of one simulation; a MovingMesh for each deformable body."""

    def __init__(self, simulation):
        self.simulation, self.meshes, self._order, self._carriers, self._memory = simulation, [], None, [], NOTHING
        seen = {}
        for s in simulation._sets:
            if s.mesh is not None:
                seen.setdefault(id(s.mesh), (s.mesh, []))[1].append(s.ids)
        for d, ids in seen.values():
            self.meshes.append(MovingMesh(d, ids[0], ids[1] if len(ids) > 1 else np.zeros(0, np.int64)))
        if self.meshes:
            core = simulation._core
            if not len(core.scene.raw_body("force")):
                core.assign_body("force", np.zeros((core.scene.body_count, 3 * simulation.scene.dim - 3)))
            self._place()
            for mesh in self.meshes:
                mesh.allow_unstable = getattr(simulation.strategy, "unstable", "") == "ignore"
                mesh.stored_first = mesh.energy(core.scene.raw_body("position"), core.scene.raw_body("velocity"))[0]

    # ------------------------------------------------------------------ the step

    def step(self, h):
        """One step; its report. Raises and leaves everything as it was if the step cannot be made."""
        core, strategy = self.simulation._core, self.simulation.strategy
        if strategy.settings().get("project_positions") and self.meshes:
            raise ValueError("project_positions moves rigid bodies alone: leave it out in scenes with deformable bodies")
        core.begin_step(h)
        try:
            self._place()
            core.predict_configuration()
            for mesh in self.meshes:
                mesh.place_faces(core.scene)
            core.compute_free_velocity()
            self._free_velocity(h)
            self._memory_next = NOTHING
            core.detect_contacts()
            core.prepare_contacts()
            self._solve(h)
            core.update_velocity(self._correct)
            self._account()
            core.commit_contacts()
        except BaseException:
            core.undo_step()
            raise
        core.update_configuration()
        self._memory = self._memory_next
        if self.meshes:
            scene = core.scene
            for mesh in self.meshes:
                mesh.follow(scene)
        if strategy.settings().get("project_positions"):
            core.project_positions()
        return core.report()

    def _place(self):
        core = self.simulation._core
        if self._order != core.order_version:
            ids = core.scene.raw_body("id")
            order = np.argsort(ids)
            for mesh in self.meshes:
                mesh.place(ids, order)
            self._order = core.order_version

    def _free_velocity(self, h):
        """Free velocities of nodes and bars, and a margin of detection that knows what points without a size may do."""
        simulation, dim = self.simulation, self.simulation.scene.dim
        core, strategy = simulation._core, simulation.strategy
        scene = core.scene
        self._gravity = np.array(scene.gravity)[:dim]
        if not self.meshes:
            return
        position, begin = np.array(scene.raw_body("position")), np.array(scene.raw_body("position_begin"))
        velocity, free = np.array(scene.raw_body("velocity")), scene.raw_body("velocity_free")
        self._carriers = []
        for mesh in self.meshes:
            v = velocity[mesh.nodes, :dim].ravel()
            at_end = mesh.free_velocity(
                mesh.displacement(begin), v, h, strategy.theta, simulation.time, self._gravity, strategy.explicit
            )
            carriers = mesh.carriers(position, len(free), free.shape[1])
            self._carriers.append(carriers)
            self._give(mesh, carriers, at_end, free)
            if len(mesh.sides):  # they turned since their velocity was written
                self._give(mesh, carriers, v, scene.raw_body("velocity"))
        if strategy.margin is None:
            moved = max(np.max(np.linalg.norm(v[:, :dim], axis=1), initial=0.0) for v in (velocity, np.array(free)))
            size = np.min([np.ptp(m.body.points, axis=0).min() / len(m.node_ids) ** (1 / dim) for m in self.meshes])
            core.set_strategy({**strategy.settings(), "margin": 2 * h * moved + 0.1 * float(size)})

    def _give(self, mesh, carriers, velocity, field):
        """Velocities of a mesh's dofs to the bodies that carry them, in a live field of the core."""
        rows = np.concatenate([mesh.nodes, mesh.points, mesh.sides])
        field[rows] = (carriers @ velocity).reshape(field.shape)[rows]

    # ------------------------------------------------------------------ the contact problem

    def problem(self):
        """(problem, contacts it holds, impulses besides its solution or None) of the step at hand, as the strategy poses it."""
        from ..problems import Problem

        core, dim = self.simulation._core, self.simulation.scene.dim
        rows = Rows(self.simulation)
        chosen = rows.chosen()
        chosen = chosen[np.lexsort(core.contact("key")[chosen].T[::-1])]  # sweeps take contacts in the order of their keys
        free = np.array(core.scene.raw_body("velocity_free"))
        h = operator(rows, chosen, len(free))
        w = h @ self._rigid_inverse() @ h.T
        position = np.array(core.scene.raw_body("position"))
        q = (h @ free.ravel()).reshape(-1, dim) + rows.bias[chosen]
        self._stretching = []
        for mesh, carriers in zip(self.meshes, self._carriers):
            more = mesh.stretching(position, rows.bodies[chosen], rows.lever[chosen], rows.axes[chosen])
            self._stretching.append(more)
            q += (more @ mesh._now["free"]).reshape(q.shape)
            g = (h @ carriers + more).tocsr()[:, mesh.contact_dofs]
            touching = np.flatnonzero(np.diff(g.indptr))
            if len(touching):
                part = g[touching]
                block = part @ (part @ mesh.condensed(mesh._now["factors"])).T
                w = w + _scattered(block, touching, w.shape[0])
        moving = w.diagonal().reshape(-1, dim)[:, 0] > 0
        if not moving.all():
            kept = np.repeat(moving, dim)
            h, w, q, chosen = h[kept], w.tocsr()[kept][:, kept], q[moving], chosen[moving]
            self._stretching = [more[kept] for more in self._stretching]
        w = _where_held(w, dim)
        self._operator = h
        self.gap = core.contact("gap")
        w, q, given = self.simulation.strategy.pose(self, w, q, rows, chosen)
        return Problem(dim, w, q, rows.mu[chosen]), chosen, given

    def _rigid_inverse(self):
        from scipy import sparse

        inverse = inverse_mass(self.simulation)
        if not self.meshes:
            return inverse
        dofs = 3 * self.simulation.scene.dim - 3
        own = np.ones((inverse.shape[0] // dofs, dofs))
        for mesh in self.meshes:
            own[mesh.nodes] = own[mesh.points] = own[mesh.sides] = 0
        return sparse.diags_array(own.ravel()) @ inverse

    def _solve(self, h):
        core, strategy, dim = self.simulation._core, self.simulation.strategy, self.simulation.scene.dim
        self.h = h
        problem, chosen, given = self.problem()
        impulses = np.zeros((core.contact_count, dim))
        found = {"status": "converged", "iterations": 0, "error": 0.0, "worst_error": 0.0, "worst_contact": -1,
                 "cone_distance": 0.0, "hint": ""}  # fmt: skip
        if len(chosen):
            start = np.reshape(core.contact("impulse_local"), (-1, dim))[chosen] if strategy.warm_start else None
            solver = strategy.solver
            result = problem.solve(solver.name, tol=solver.tol, max_iter=solver.max_iter, start=start)
            strategy.solved(self, result.r, chosen)
            impulses[chosen] = result.r if given is None else result.r + given
            found |= {name: getattr(result, name) for name in found}
            found["worst_contact"] = int(chosen[result.worst_contact]) if result.worst_contact >= 0 else -1
        core.give_impulses(impulses, found)
        r = impulses[chosen].ravel()
        pushed = self._operator.T @ r
        self._pushed = [carriers.T @ pushed + more.T @ r for carriers, more in zip(self._carriers, self._stretching)]
        self._stretch_of = [more.T @ r for more in self._stretching]

    def _correct(self):
        """Velocities of nodes and bars at the end of the step, with the impulses that their bodies got."""
        field = self.simulation._core.scene.raw_body("velocity")
        for mesh, carriers, pushed in zip(self.meshes, self._carriers, self._pushed):
            self._give(mesh, carriers, mesh.pushed_velocity(pushed), field)

    def _account(self):
        scene, dim = self.simulation._core.scene, self.simulation.scene.dim
        velocity, force = scene.raw_body("velocity"), scene.raw_body("force")
        for mesh, pushed, stretch in zip(self.meshes, self._pushed, self._stretch_of):
            end = velocity[mesh.nodes, :dim].ravel()
            force[mesh.nodes, :dim] = mesh.account(end, pushed, self._gravity).reshape(-1, dim)
            mesh.work["stretch"] += 0.5 * float(stretch @ (end + mesh._now["v"]))

    # ------------------------------------------------------------------ what strategies ask for

    def begin_velocity(self):
        """Relative velocities (contacts of the problem, dim) at the start of the step [m/s]."""
        velocity = np.array(self.simulation._core.scene.raw_body("velocity"))
        u = self._operator @ velocity.ravel()
        for mesh, more in zip(self.meshes, self._stretching):
            u += more @ mesh._now["v"]
        return u.reshape(-1, self.simulation.scene.dim)

    def recall(self, chosen):
        """What `remember` kept of these contacts, zero for new ones, (n, dim) along their axes."""
        dim = self.simulation.scene.dim
        keys, space = self._memory
        out = np.zeros((len(chosen), dim))
        if len(chosen) and len(keys):
            mine = self.simulation._core.contact("key")[chosen]
            place = {tuple(k): i for i, k in enumerate(keys.tolist())}
            found = np.array([place.get(tuple(k), -1) for k in mine.tolist()])
            old = found >= 0
            axes = Rows(self.simulation).axes[chosen]
            out[old] = np.einsum("nij,nj->ni", axes[old], space[found[old]])
        return out

    def remember(self, chosen, values):
        """Keeps vectors (n, dim), given along the axes of these contacts, for the next step."""
        axes = Rows(self.simulation).axes[chosen]
        keys = self.simulation._core.contact("key")[chosen]
        self._memory_next = (keys, np.einsum("nij,ni->nj", axes, values))

    def state(self):
        """What a restart needs besides bodies and impulses."""
        keys, values = self._memory
        works = [{**mesh.work, "first": mesh.stored_first} for mesh in self.meshes]
        return {"keys": keys, "values": values, "works": {f"{k:06d}": w for k, w in enumerate(works)}}

    def restore(self, state):
        """The inverse of state."""
        self._memory = (np.asarray(state["keys"], np.int64).reshape(-1, 4), np.asarray(state["values"], float))
        self._order = None
        for mesh, (_, works) in zip(self.meshes, sorted(state["works"].items())):
            mesh.stored_first = float(works["first"])
            mesh.work = {name: float(works[name]) for name in mesh.work}

    # ------------------------------------------------------------------ what is known of the meshes

    def energy(self, energy):
        """The balance with what the meshes store and dissipate apart from the work of external forces [J]."""
        scene = self.simulation._core.scene
        self._place()
        position, velocity = scene.raw_body("position"), scene.raw_body("velocity")
        for mesh in self.meshes:
            stored, inertia = mesh.energy(position, velocity)
            energy["stored"] += stored
            energy["kinetic"] += inertia
            energy["work_external"] += mesh.work["elastic"] + mesh.work["damping"] + mesh.work["inertia"]
            energy["dissipated_bulk"] += mesh.work["damping"]
            energy["dissipated_friction"] -= mesh.work["stretch"]
            energy["closure"] -= mesh.work["stretch"]
            energy["dissipated_theta"] += mesh.work["elastic"] - (stored - mesh.stored_first)
        return energy


def _where_held(w, dim):
    """W with a share of W_NN on tangents along which nearly nothing moves, so that friction has its sign there and not 0/0."""
    from scipy import sparse

    diagonal = w.diagonal().reshape(-1, dim)
    least = 1e-9 * diagonal[:, :1]
    missing = np.where(diagonal < least, least, 0.0)
    return w + sparse.diags_array(missing.ravel()) if missing.any() else w


def _scattered(block, rows, size):
    from scipy import sparse

    n = len(rows)
    return sparse.csr_array((block.ravel(), (np.repeat(rows, n), np.tile(rows, n))), shape=(size, size))
