"""Dissipation of integrators in solids of nonlinear stresses: by integrals of the stresses along the path of each step, without
energies, through flight and contact, in steps that Newton's method closes and in others; and by their order."""

import cairn as cn
import numpy as np
import pytest
from second_order import box
from test_discrete_gradient import MATERIALS, thrown
from test_solid_integrators import EXPLICIT, IMPLICIT

ALL = [cn.Theta(), cn.Theta(theta=0.8), cn.Theta(theta=1.0), cn.DiscreteGradient(), *IMPLICIT, *EXPLICIT]
POINTS, WEIGHTS = (0.5 + 0.5 * np.polynomial.legendre.leggauss(16)[0], 0.5 * np.polynomial.legendre.leggauss(16)[1])
HISTORY = ("acceleration", "jerk", "snap", "crackle")


class Watched:
    """Dissipation of the steps of a mesh, from its positions, velocities and the law of its stresses."""

    def __init__(self, sim, integrator):
        self.sim, self.h, self.integrator = sim, sim.dt, integrator
        self.mesh = self.sim.meshes[0]
        self.mass = self.mesh.body.M.toarray()
        self.model = self.mesh.body.model()

    def force(self, q):
        return self.mesh.body.tangent(q, self.model)[0]

    def state(self):
        q, v = self.mesh.displacement.ravel().copy(), self.mesh.velocity.ravel().copy()
        keeps = self.integrator.scheme(self.h)["histories"] if self.sim.steps else 0
        return q, v, [getattr(self.sim.nodes, name).ravel().copy() for name in HISTORY[:keeps]]

    def terms(self):
        return dict(self.sim.info["energy"])

    def taken(self, begin, end):
        """Dissipation of the integrator; and the residual of the balance of nodes times the mean of both velocities."""
        (q0, v0, history), (q1, v1, _), h = begin, end, self.h
        s = self.integrator.scheme(h)
        known = sum((s["velocity"][k] * a for k, a in enumerate(history)), 0 * v0)
        impulse = h * self.mesh.contact_force.ravel()
        dq, middle = q1 - q0, (v0 + v1) / 2
        share = s["end_share"]
        if self.integrator.row == "discrete_gradient":  # dq is h times the middle of velocities: what works dU takes nothing
            inner, force = 0.0, None
        else:
            if s["stiffness"] > 0:
                late = q1
            elif share > 0:
                ahead = sum((s["elastic"][k] * a for k, a in enumerate(history)), s["elastic_velocity"] * v0)
                late = q0 + ahead / share
            else:
                late = q0
            force = share * self.force(late) + (1 - share) * self.force(q0)
            along = sum(w * (self.force(q0 + x * dq) @ dq) for x, w in zip(POINTS, WEIGHTS))
            inner = force @ dq - along
        kinetic = 0.0 if force is None else -force @ (dq - s["impulse"] * middle) - middle @ self.mass @ known
        left = np.nan if force is None else middle @ (self.mass @ (v1 - v0 - known) + s["impulse"] * force - impulse)
        return kinetic + inner, left, -middle @ impulse


def flying(integrator, dt, material="neo_hookean", **options):
    """A block in flight, or thrown at a wall."""
    options.setdefault("lumped", integrator in EXPLICIT)
    return Watched(thrown(2, MATERIALS[material], integrator, dt, **options), integrator)


def near(found, wanted, scale, share=1e-10):
    assert abs(found - wanted) < share * scale, (found, wanted)


@pytest.mark.parametrize("material", ["neo_hookean", "ogden", "green", "hencky"])
@pytest.mark.parametrize("integrator", ALL, ids=repr)
def test_it_is_the_integral_along_the_way(integrator, material):
    """Step by step in flight: the work of the forces of the step beyond that of the stresses, and its part of inertia."""
    watched = flying(integrator, 1e-2 if integrator not in EXPLICIT else 2e-3, material)
    watched.sim.step()
    most = 0.0
    for _ in range(12):
        begin, before = watched.state(), watched.terms()
        assert watched.sim.step()["status"] == "converged"
        terms = watched.terms()
        taken, left, _ = watched.taken(begin, watched.state())
        near(terms["dissipated_integrator"] - before["dissipated_integrator"], taken, terms["in_play"], 1e-12)
        if integrator != cn.DiscreteGradient():
            near(terms["closure"] - before["closure"], left, terms["in_play"], 1e-13)
        most = max(most, abs(taken) / terms["in_play"])
    least = 3e-12 if integrator.row == "gear" else 1e-8  # far above the compared differences
    assert most > least or (most == 0 and integrator == cn.DiscreteGradient())


@pytest.mark.parametrize("integrator", [cn.Theta(), cn.Theta(theta=1.0), *IMPLICIT], ids=repr)
def test_what_newtons_method_leaves_is_closure_and_no_dissipation(integrator):
    """A single Newton pass in each step: the work of the residual equals the closure, and the integrator dissipates as before."""
    watched = flying(integrator, 2e-2)
    passes = {"integrator": integrator, "newton_tol": 1e-13, "newton_passes": 1}
    watched.sim.strategy = cn.NSCD(**passes)
    watched.sim.step()
    most = 0.0
    for _ in range(20):
        begin, before = watched.state(), watched.terms()
        assert watched.sim.step()["status"] == "newton_limit"
        terms = watched.terms()
        taken, left, _ = watched.taken(begin, watched.state())
        near(terms["closure"] - before["closure"], left, terms["in_play"], 1e-13)
        near(terms["dissipated_integrator"] - before["dissipated_integrator"], taken, terms["in_play"], 1e-12)
        most = max(most, abs(left) / terms["in_play"])
    assert most > 1e-8


def test_closure_is_as_large_as_newtons_method_leaves_it():
    """Closure falls with the final error of a step; energy-conserving stresses make the integrator's dissipation zero."""
    for integrator in (cn.Theta(), cn.HHT(alpha=-0.1), cn.DiscreteGradient()):
        left = []
        for tol in (1e-4, 1e-6, 1e-12):
            watched = flying(integrator, 1e-2)
            watched.sim.strategy = cn.NSCD(integrator=integrator, newton_tol=tol, newton_passes=40)
            error = 0.0
            for _ in range(60):
                error = max(error, watched.sim.step()["newton_error"])
            terms = watched.terms()
            left.append(abs(terms["closure"]) / terms["in_play"])
            assert left[-1] < max(error, 1e-13)
            if integrator == cn.DiscreteGradient():
                assert abs(terms["dissipated_integrator"]) < 1e-14 * terms["in_play"]
        assert left[0] > 1e-9 and left[2] < 1e-13 and left[0] > 10 * left[1] > 100 * left[2]


@pytest.mark.parametrize("integrator", [i for i in ALL if i != cn.DiscreteGradient()], ids=repr)
def test_each_term_is_its_own_through_contact(integrator):
    """A block that strikes a wall: dissipation by contacts from their impulses, that of the integrator along the way."""
    dt = 2.0**-9 if integrator not in EXPLICIT else 2.0**-11
    watched = flying(integrator, dt, wall=True)
    watched.sim.step()
    touched = 0
    for _ in range(round(0.45 / dt)):
        begin, before = watched.state(), watched.terms()
        assert watched.sim.step()["status"] == "converged"
        if not watched.mesh.contact_force.any() and touched < 8:
            continue
        touched += watched.mesh.contact_force.any()
        terms = watched.terms()
        taken, left, lost = watched.taken(begin, watched.state())
        near(terms["dissipated_integrator"] - before["dissipated_integrator"], taken, terms["in_play"], 1e-11)
        near(terms["dissipated_normal"] - before["dissipated_normal"], lost, terms["in_play"], 1e-11)
        near(terms["closure"] - before["closure"], left, terms["in_play"], 1e-11)
        assert abs(terms["closure"]) < 1e-11 * terms["in_play"]
        if touched > 30:
            return
    assert touched > 8


@pytest.mark.parametrize("integrator", [cn.Theta(), cn.Theta(theta=0.8), cn.Newmark(), cn.HHT(alpha=-0.1)], ids=repr)
def test_what_drives_works_what_it_is_told_to(integrator):
    """A block sheared by its top, which is driven: work of the forces that its held dofs need, by inertia and stresses alone."""
    points, cells = box("quad", (2, 2), (1.0, 1.0))
    groups = {"bottom": np.flatnonzero(points[:, 1] == 0), "top": np.flatnonzero(points[:, 1] == 1)}
    body = cn.SolidBody(points, cells, MATERIALS["neo_hookean"], density=1024.0, groups=groups)
    scene = cn.Scene(dim=2)
    drive = {"top": {"x": lambda t: 0.8 * np.cos(9 * t), "y": lambda t: 0.3 * np.sin(11 * t)}}
    start = np.stack([0.8 * points[:, 1], 0 * points[:, 1]], -1)
    scene.add(cn.deformable(body, cn.Material("rock", density=1.0), fixed={"bottom": "xy"}, drive=drive, velocity=start))
    sim = cn.Simulation(scene, dt=5e-3, strategy=cn.NSCD(integrator=integrator, newton_tol=1e-13, newton_passes=40))
    watched = Watched(sim, integrator)
    held = np.concatenate([2 * groups[name] + k for name in ("bottom", "top") for k in (0, 1)])
    sim.step()
    worked = 0.0
    for _ in range(60):
        (q0, v0, history), before = watched.state(), watched.terms()
        assert sim.step()["status"] == "converged"
        (q1, v1, _), terms = watched.state(), watched.terms()
        s = integrator.scheme(5e-3)
        known = sum((s["velocity"][k] * a for k, a in enumerate(history)), 0 * v0)
        jump = np.zeros_like(v0)  # driven nodes move by impulses, which act for the whole step
        jump[held] = (v1 - v0)[held]
        free = np.setdiff1d(np.arange(len(jump)), held)
        jump[free] = -np.linalg.solve(watched.mass[np.ix_(free, free)], (watched.mass @ jump)[free])
        keeps = s["histories"] > 0
        force = (watched.force(q0) + watched.force(q1)) / 2  # wherever the method has it
        smooth = v1 - v0 - known - keeps * jump
        needed = watched.mass @ (smooth / s["impulse"] + keeps * jump / s["h"]) + force
        work = needed[held] @ (q1 - q0)[held]
        near(sum(terms[k] - before[k] for k in ("work_external", "work_driven")), work, terms["in_play"], 1e-11)
        worked += abs(work)
    assert worked > 0.1 * terms["in_play"]
    assert abs(terms["closure"]) < 1e-11 * terms["in_play"]


def spent(integrator, dt, time, material="neo_hookean"):
    watched = flying(integrator, dt, material)
    for _ in range(round(time / dt)):
        watched.sim.step()
    terms = watched.terms()
    return terms["dissipated_integrator"] / terms["in_play"]


@pytest.mark.parametrize("integrator, order", [
    (cn.Theta(), 2), (cn.Theta(theta=0.8), 1), (cn.Newmark(), 2), (cn.Newmark(beta=0.3025, gamma=0.6), 1),
    (cn.HHT(alpha=-0.1), 2), (cn.GeneralisedAlpha(spectral_radius=0.8), 2), (cn.GeneralisedAlpha(spectral_radius=0.0), 2),
    (cn.VelocityVerlet(), 2), (cn.Newmark(beta=0.0, gamma=0.5), 2), (cn.CentralDifference(), 1),
    (cn.BetaScheme(beta=0.6), 1), (cn.Gear(values=4), 3), (cn.Gear(values=5), 4),
], ids=repr)  # fmt: skip
def test_it_falls_by_the_order_of_the_method(integrator, order):
    """Over the same time, by three steps and their halves. An energy that is not that of the stresses would not fall at all."""
    base = 4e-3 if integrator not in EXPLICIT else 2e-3
    found = [spent(integrator, base / n, 0.2) for n in (1, 2, 4)]
    orders = np.log2(np.abs(found[:-1]) / np.abs(found[1:]))
    assert np.abs(orders - order).max() < 0.35


@pytest.mark.parametrize("material, options, integrator, order", [
    (cn.FiniteJ2(young=2e5, poisson=0.3, yield_stress=300.0, isotropic=1e3), {}, cn.Theta(theta=1.0), 1),
    (cn.KelvinVoigt(young=2e4, poisson=0.3, viscous_young=100.0, viscous_poisson=0.3), {"kinematics": "total_lagrangian"},
     cn.Theta(), 2),
], ids=repr)  # fmt: skip
def test_it_falls_where_the_material_dissipates_as_well(material, options, integrator, order):
    """Both terms are separate: that of the material converges to its dissipation, that of the integrator to zero."""
    own, by_material = [], []
    for n in (1, 2, 4, 8):
        sim = thrown(2, material, integrator, 2e-3 / n, **options)
        for _ in range(40 * n):
            assert sim.step()["status"] == "converged"
        terms = sim.info["energy"]
        assert abs(terms["closure"]) < 1e-13 * terms["in_play"]
        own.append(terms["dissipated_integrator"] / terms["in_play"])
        by_material.append(terms["dissipated_material"] / terms["in_play"])
    orders = np.log2(np.abs(own[:-1]) / np.abs(own[1:]))
    assert np.abs(orders - order).max() < 0.2
    assert by_material[-1] == pytest.approx(by_material[-2], rel=1e-2) and by_material[-1] > 5e-3


@pytest.mark.parametrize("integrator", [cn.Theta(), cn.HHT(alpha=-0.1), cn.DiscreteGradient()], ids=repr)
def test_what_is_left_where_nodes_are_bound_is_no_work_from_outside(integrator):
    """A bar with a rigid end turns freely, and strikes a wall: forces that bind its nodes do no work, and the residual after a
    single Newton pass is closure as elsewhere."""
    points, cells = box("quad", (4, 2), (2.0, 0.5))
    groups = {"end": np.flatnonzero(points[:, 0] > 1.4)}
    x, rock = points - points.mean(axis=0), cn.Material("rock", density=2500.0)
    law = {"density": 1000.0, "groups": groups}
    for passes, wall, solid in ((1, False, True), (40, True, True), (40, True, False)):
        body = cn.SolidBody(points, cells, MATERIALS["neo_hookean"], **law)
        if not solid:
            body = cn.ElasticBody(points, cells, young=2e4, poisson=0.3, **law)
        turn = np.stack([-4 * x[:, 1], 4 * x[:, 0] - 2 * wall], -1) if solid else np.array([0.0, -2.0])
        scene = cn.Scene(dim=2)
        scene.add(cn.deformable(body, rock, rigid=("end",), velocity=turn, contact=np.arange(len(points))))
        if wall:
            scene.add(cn.wall((0, -0.05), (0, 1), rock))
            scene.interact(rock, rock, cn.Coulomb(mu=0.0))
        solver = cn.NLGS(tol=1e-14, max_iter=10**5)
        strategy = cn.NSCD(integrator=integrator, newton_tol=1e-12, newton_passes=passes, solver=solver)
        sim = cn.Simulation(scene, dt=5e-3, strategy=strategy)
        struck = 0.0
        for _ in range(40):
            report = sim.step()
            assert report["status"] == ("newton_limit" if passes == 1 else "converged")
            struck += np.abs(sim.meshes[0].contact_force).sum()
        terms = sim.info["energy"]
        assert abs(terms["work_external"]) < 1e-13 * terms["in_play"] and (struck > 0) == wall
        left = abs(terms["closure"]) / terms["in_play"]
        assert left > 1e-9 if passes == 1 else left < 1e-11
