"""Dissipation of integrators, by the closed form of each, on linear meshes through impacts, damping and loads in time: Krenk
(2006) for Newmark, extended to the weights of HHT and generalised alpha, and the like for theta, central differences and the beta
scheme. Stored and kinetic energy and work are computed separately, and their balance closes."""

import cairn as cn
import numpy as np
import pytest
from second_order import box
from test_integrators import ALL

ROCK = cn.Material("rock", density=1.0)
EACH = [*ALL, cn.HHT(alpha=-0.3), cn.GeneralisedAlpha(spectral_radius=0.0), cn.GeneralisedAlpha(spectral_radius=1.0),
        cn.BetaScheme(beta=1.0), cn.Theta(theta=1.0)]  # fmt: skip


def pushed(t):
    return 4e3 * np.cos(30 * t), 2e3 * np.sin(20 * t)


def struck(integrator, dt, *, lumped, drives):
    """A plate of Hooke's law, damped, loaded in time, whose corner strikes a wall with friction; its upper side is held, or
    driven."""
    points, cells = box("quad", (4, 2), (1.0, 0.5))
    groups = {"top": np.flatnonzero(points[:, 1] == 0.5), "right": np.flatnonzero(points[:, 0] == 1.0), "foot": [0]}
    assert np.array_equal(points[0], [0.0, 0.0])
    body = cn.ElasticBody(
        points, cells, young=1e6, poisson=0.3, density=1000.0, rayleigh=(0.5, 1e-5), lumped=lumped, groups=groups
    )
    scene = cn.Scene(dim=2, gravity=(0.0, -2.0))
    kept = {"drive": {"top": {"x": lambda t: 0.05 * np.sin(20 * t)}}} if drives else {"fixed": {"top": "x"}}
    scene.add(
        cn.deformable(
            body, ROCK, contact="foot", velocity=(0.0, -0.8), displacement=points * [0.01, -0.005] + [0, 1e-2],
            force=lambda t: {"right": pushed(t)}, **kept,
        ),
        cn.wall((0, 0), (0, 1), ROCK),
    )  # fmt: skip
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    solver = cn.NLGS(tol=1e-14, max_iter=10**5)
    return cn.Simulation(scene, dt=dt, strategy=cn.NSCD(integrator=integrator, solver=solver))


def taken(integrator, h, mass, stiffness, begin, end, impulse, jump):
    """Dissipation of an integrator in a step by its closed form, from its own forces. begin, end: displacement,
    velocity, acceleration; jump: that of velocities by the impulse, and by velocities that are given, alone."""
    (q0, v0, a0), (q1, v1, a1) = begin, end
    dq, dv, da, mean = q1 - q0, v1 - v0, a1 - a0, (v0 + v1) / 2
    strain = dq @ stiffness @ dq
    name, p = integrator.row, integrator.values
    if name == "theta":
        return (p["theta"] - 0.5) * (dv @ (mass @ dv - impulse) + strain)
    if name == "central_difference":
        return 0.5 * (dv @ (mass @ dv - impulse) - strain)
    if name == "beta_scheme":
        held = (mass @ jump - impulse) @ (dq / h - mean)
        return 0.5 * h * (dv @ mass @ a1) + (0.5 - p["beta"]) * h * (mean @ mass @ da) - 0.5 * strain + held
    am, af = 0.0, 0.0
    if name == "newmark":
        beta, gamma = p["beta"], p["gamma"]
    elif name == "velocity_verlet":
        beta, gamma = 0.0, 0.5
    else:
        if name == "hht":
            af = -p["alpha"]
        else:
            rho = p["spectral_radius"]
            am, af = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        beta, gamma = (1 - am + af) ** 2 / 4, 0.5 - am + af
    of_a = 0.5 * (a1 @ mass @ a1 - a0 @ mass @ a0) + (gamma - 0.5) * (da @ mass @ da)
    smooth = (0.5 - af) * strain + (1 - gamma - am) * (dq @ mass @ da) + (beta - gamma / 2) * h * h * of_a
    held = (mass @ jump - impulse) @ (dq / h - mean)  # work of supports by jumps of velocity
    if name == "velocity_verlet":  # which knows its forces before the impulses
        return smooth + held - (1 - af) * (0.5 - beta / gamma) * h * (dq @ stiffness @ jump)
    return smooth + held


def beyond_the_mean(integrator, h, body, free, begin, end, jump, loads):
    """Work of loads, drag and the elastic forces of held dofs by the method's forces, beyond that of their mean at both ends:
    loads work less by it, drag more, and held dofs need less."""
    (q0, v0, a0), (q1, v1, _), s = begin, end, integrator.scheme(h)
    damping, stiffness, dq = body.C.toarray(), body.K.toarray(), q1 - q0
    late = s["elastic_velocity"] * v0 + s["stiffness"] / s["impulse"] * (v1 - v0)
    seen = v0 + s["damping"] / s["impulse"] * (v1 - v0)
    if s["histories"]:
        late, seen = late + s["elastic"][0] * a0, seen + s["damping_history"][0] * a0
        if s["stiffness"] > 0:
            late = late + s["end_share"] * s["position"][0] / h * jump
    elastic, drag = stiffness @ (late - dq / 2), damping @ (seen - (v0 + v1) / 2)
    load = (s["end_share"] - 0.5) * (loads[1] - loads[0])
    if s["end_share"] == 0.5:
        return 0.0
    return dq @ np.where(free, drag - load, -elastic)


@pytest.mark.parametrize("lumped, drives", [(True, True), (False, False), (False, True)])
@pytest.mark.parametrize("integrator", EACH, ids=repr)
def test_closed_forms_and_balance(integrator, lumped, drives):
    """Step by step the reported dissipation is that of the closed form, with loads and drag at their mean of both ends; and the
    balance of all terms closes to 1e-10 of the energy in play, with energies by the matrices."""
    h = 2e-3 if np.isinf(integrator.scheme(1.0)["largest"]) else 4e-4
    sim = struck(integrator, h, lumped=lumped, drives=drives)
    mesh = sim.meshes[0]
    mass, stiffness = mesh.body.M.toarray(), mesh.body.K.toarray()
    free = np.ones(len(mass), bool)
    free[2 * mesh.body.groups["top"]] = False
    keeps = integrator.scheme(h)["histories"] > 0

    def state():
        a = sim.nodes.acceleration.ravel().copy() if keeps and sim.steps else np.zeros(len(mass))
        return mesh.displacement.ravel().copy(), mesh.velocity.ravel().copy(), a

    def energy(q, v):
        return 0.5 * (v @ mass @ v + q @ stiffness @ q)

    def load(t):
        out = np.zeros(mesh.displacement.shape)
        out[mesh.body.groups["right"]] = np.array(pushed(t)) / len(mesh.body.groups["right"])
        return out.ravel()

    before, start, known = state(), None, 0.0
    touched = most = 0
    for _ in range(240):
        assert sim.step()["status"] == "converged"
        now, e = state(), sim.energy
        impulse = h * mesh.contact_force.ravel()
        jump = np.where(free, 0.0, now[1] - before[1])
        jump[free] = np.linalg.solve(mass[np.ix_(free, free)], (impulse - mass @ jump)[free])
        touched += impulse.any()
        assert e["kinetic"] + e["stored"] == pytest.approx(energy(*now[:2]), rel=1e-11)
        if start is None:
            start = e
            base = energy(*now[:2])
        elif integrator.row != "gear":
            part = taken(integrator, h, mass, stiffness, before, now, impulse, jump)
            loads = load(sim.time - h), load(sim.time)
            part += beyond_the_mean(integrator, h, mesh.body, free, before, now, jump, loads)
            known += part
            most += abs(part)
            assert abs(e["dissipated_integrator"] - start["dissipated_integrator"] - known) < 1e-10 * e["in_play"]
        before = now
    assert 5 < touched < 235
    assert integrator in (cn.Theta(), cn.GeneralisedAlpha(spectral_radius=1.0)) or most > 1e-5 * e["in_play"] or keeps
    assert abs(e["closure"]) < 1e-10 * e["in_play"]
    made = sum(e[k] - start[k] for k in ("work_external", "work_driven"))
    gone = sum(e[k] - start[k] for k in e if k.startswith("dissipated_")) + e["potential"] - start["potential"]
    assert abs(energy(*now[:2]) - base + gone - made) < 1e-10 * e["in_play"]
    assert e["dissipated_normal"] > 0 and e["dissipated_bulk"] > 0
