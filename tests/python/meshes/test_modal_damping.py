"""Damping of the modes of linear meshes by a ratio each: free decay against its closed form, undamped modes, and the dissipated
energy."""

import cairn as cn
import numpy as np
import pytest
from scipy import linalg

ROCK = cn.Material("rock", density=2000.0)


def plate(lumped=False, cells=(4, 2), **more):
    x, y = np.linspace(0, 1.0, cells[0] + 1), np.linspace(0, 0.4, cells[1] + 1)
    points = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    of = np.arange(len(points)).reshape(cells[0] + 1, cells[1] + 1)
    quads = np.stack([of[:-1, :-1], of[1:, :-1], of[1:, 1:], of[:-1, 1:]], -1).reshape(-1, 4)
    groups = {"left": of[0], "top": of[:, -1]}
    return cn.ElasticBody(points, {"quad": quads}, young=1e7, poisson=0.3, density=2000.0, groups=groups, lumped=lumped, **more)


def modes_of(body, fixed):
    free = np.setdiff1d(np.arange(body.points.size), body.dofs(fixed))
    square, shape = linalg.eigh(body.K.toarray()[np.ix_(free, free)], body.M.toarray()[np.ix_(free, free)])
    out = np.zeros((body.points.size, len(free)))
    out[free] = shape
    return np.sqrt(np.maximum(square, 0)), out


def simulation(body, dt, damping, fixed=None, integrator=None, velocity=None, displacement=None, **more):
    scene = cn.Scene(2)
    scene.add(
        cn.deformable(body, ROCK, fixed=fixed or {}, modal_damping=damping, velocity=velocity, displacement=displacement, **more)
    )
    return cn.Simulation(scene, dt, cn.NSCD(integrator=integrator) if integrator else cn.NSCD(theta=0.5))


def amplitude(sim, body, shape, omega):
    """Amplitude of a mode, from its displacement and velocity."""
    m = body.M @ shape
    return np.hypot(m @ sim.meshes[0].displacement.ravel(), m @ sim.meshes[0].velocity.ravel() / omega)


@pytest.mark.parametrize("lumped", [False, True])
@pytest.mark.parametrize("mode", [0, 1, 5, 17])
def test_each_mode_decays_by_its_ratio(mode, lumped):
    """q'' + 2 zeta w q' + w2 q = 0 by steps of a thousandth of a period; per step exactly as theta = 1/2 has it."""
    body, fixed, zeta = plate(lumped), {"left": "xy"}, 0.03
    omega, shape = modes_of(body, fixed)
    w, phi = omega[mode], shape[:, mode]
    for steps in (500, 1000):
        h = 2 * np.pi / w / steps
        sim = simulation(body, h, zeta, fixed, displacement=1e-4 * phi.reshape(-1, 2))
        for _ in range(steps):
            sim.step()
        q, v = (body.M @ phi) @ sim.meshes[0].displacement.ravel(), (body.M @ phi) @ sim.meshes[0].velocity.ravel()
        wd = w * np.sqrt(1 - zeta**2)
        decay = 1e-4 * np.exp(-zeta * w * sim.time)
        exact = decay * (np.cos(wd * sim.time) + zeta * w / wd * np.sin(wd * sim.time))
        speed = -decay * w * w / wd * np.sin(wd * sim.time)
        assert q == pytest.approx(exact, abs=1e-4 * 25 / steps**2)
        assert v / w == pytest.approx(speed / w, abs=1e-4 * 25 / steps**2)
        # the scheme's own answer, to rounding
        a = np.array([[1.0, -h / 2], [h * w * w / 2, 1 + h * zeta * w]])
        b = np.array([[1.0, h / 2], [-h * w * w / 2, 1 - h * zeta * w]])
        state = np.linalg.matrix_power(np.linalg.solve(a, b), steps) @ [1e-4, 0.0]
        assert np.allclose([q, v / w], [state[0], state[1] / w], rtol=0, atol=1e-9 * 1e-4)
        rest = sim.meshes[0].displacement.ravel() - q * phi
        assert np.abs(rest).max() < 1e-9 * np.abs(1e-4 * phi).max()


def test_first_modes_alone_are_damped_and_others_keep_their_energy():
    body, fixed = plate(), {"left": "xy"}
    omega, shape = modes_of(body, fixed)
    for mode, zeta in ((0, 0.02), (1, 0.0), (2, 0.05), (3, 0.0), (10, 0.0)):
        h = 2 * np.pi / omega[mode] / 200
        sim = simulation(body, h, [0.02, 0.0, 0.05], fixed, displacement=1e-4 * shape[:, mode].reshape(-1, 2))
        for _ in range(400):
            sim.step()
        left = amplitude(sim, body, shape[:, mode], omega[mode]) / 1e-4
        if zeta:
            assert left == pytest.approx(np.exp(-zeta * omega[mode] * sim.time), rel=0.05)
        else:
            assert left == pytest.approx(1.0, rel=1e-10)


@pytest.mark.parametrize("damping", [0.05, [0.1, 0.02]])
@pytest.mark.parametrize("rayleigh", [(0.0, 0.0), (0.5, 1e-6)])
@pytest.mark.parametrize("lumped", [False, True])
def test_the_energy_that_it_takes_is_what_is_lost(damping, rayleigh, lumped):
    """With theta = 1/2 the integrator dissipates nothing: the loss is that of damping, smaller in a run without modal damping."""
    body, fixed = plate(lumped, rayleigh=rayleigh), {"left": "xy"}
    speed = np.random.default_rng(2).normal(size=body.points.shape)
    speed[body.groups["left"]] = 0
    sim = simulation(body, 1e-3, damping, fixed, velocity=speed)
    begin = 0.5 * speed.ravel() @ body.M @ speed.ravel()
    for _ in range(300):
        sim.step()
    u, v = sim.meshes[0].displacement.ravel(), sim.meshes[0].velocity.ravel()
    lost = begin - 0.5 * (v @ body.M @ v + u @ body.K @ u)
    energy = sim.energy
    assert energy["dissipated_bulk"] == pytest.approx(lost, rel=1e-10)
    assert abs(energy["dissipated_integrator"]) < 1e-10 * lost and abs(energy["closure"]) < 1e-12 * energy["in_play"]
    assert lost > 0.01 * begin
    other = simulation(body, 1e-3, None, fixed, velocity=speed)
    for _ in range(300):
        other.step()
    assert other.energy["dissipated_bulk"] < 0.9 * lost


def test_a_free_body_flies_and_turns_on():
    body = plate()
    centre = body.points - body.points.mean(axis=0)
    speed = np.array([1.0, 2.0]) + 0.01 * np.stack([-centre[:, 1], centre[:, 0]], -1)
    sim = simulation(body, 1e-3, 0.5, velocity=speed)
    for _ in range(200):
        sim.step()
    assert np.allclose(sim.meshes[0].velocity, speed, rtol=0, atol=1e-9)
    assert abs(sim.energy["dissipated_bulk"]) < 1e-12 * sim.energy["kinetic"]


def test_contacts_see_the_damped_body():
    """A disk on a plate whose modes are damped, against a plate with the same damping as a matrix."""
    body, fixed, found = plate(), {"left": "xy"}, []
    omega, shape = modes_of(body, fixed)
    momentum = body.M @ shape
    matrix = (momentum * (2 * 0.2 * omega)) @ momentum.T
    held = body.dofs(fixed)
    matrix[held] = 0
    matrix[:, held] = 0
    given = cn.LinearBody(body.points, body.M, body.K, damping=matrix, groups=body.groups, edges=body.boundary_edges())
    for of, damping in ((body, 0.2), (given, None)):
        scene = cn.Scene(2, gravity=(0.0, -9.81))
        scene.add(cn.deformable(of, ROCK, fixed=fixed, edges="top", modal_damping=damping))
        scene.add(cn.disks([[0.7, 0.5]], 0.1, ROCK, velocity=[[0.1, -1.0, 0.0]]))
        scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
        sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=0.5, solver=cn.NLGS(tol=1e-12)))
        for _ in range(100):
            assert sim.step()["status"] == "converged"
        found.append(np.concatenate([sim.meshes[0].displacement.ravel(), sim.bodies.position[-1]]))
    assert np.allclose(*found, rtol=0, atol=1e-9)


def test_explicit_steps_with_it():
    """Central differences see the rate of the last middle: stable up to their step, and close to the closed form."""
    body, fixed = plate(lumped=True), {"left": "xy"}
    omega, shape = modes_of(body, fixed)
    step = simulation(body, 1e-12, 0.02, fixed, cn.CentralDifference()).stable_step
    top = omega[-1]
    limit = 2 / top * (np.sqrt(1 + 0.02**2) - 0.02)
    assert limit / 1.5 < step <= limit
    sim = simulation(body, 0.99 * step, 0.02, fixed, cn.CentralDifference(), velocity=shape[:, 0].reshape(-1, 2))
    while omega[0] * sim.time < 2 * np.pi:
        sim.step()
    decay = np.exp(-0.02 * omega[0] * sim.time)
    assert amplitude(sim, body, shape[:, 0], omega[0]) * omega[0] == pytest.approx(decay, rel=0.1)
    with pytest.raises(ValueError, match="beyond the stable step"):
        simulation(body, 1.01 * limit, 0.02, fixed, cn.CentralDifference()).step()


def test_large_bodies_have_their_first_modes_from_lanczos():
    """The same as by full matrices."""
    from cairn.model import modal_damping

    body = plate(cells=(40, 12))
    free = np.setdiff1d(np.arange(body.points.size), body.dofs({"left": "xy"}))
    few, omega = modal_damping.modes(body, free, np.array([0.1, 0.1, 0.1]))
    known, _ = modes_of(body, {"left": "xy"})
    assert few.shape == (body.points.size, 3)
    assert omega == pytest.approx(known[:3], rel=1e-8)
    assert np.allclose(few.T @ body.M @ few, np.eye(3), atol=1e-9)


def test_what_has_no_modes_is_refused():
    body = plate()
    solid = cn.SolidBody(body.points, body.cells, cn.NeoHookean(young=1e7, poisson=0.3), density=2000.0)
    with pytest.raises(ValueError, match="modal_damping is of the modes of a linear body, and this one is a SolidBody"):
        cn.deformable(solid, ROCK, modal_damping=0.02)
    for wrong in (-0.1, np.nan, [0.1, np.inf], []):
        with pytest.raises(ValueError, match="modal_damping is .*: give a damping ratio >= 0"):
            cn.deformable(body, ROCK, modal_damping=wrong)
    with pytest.raises(ValueError, match="modal_damping of 'mesh' is of 99 modes, and 27 vibrate: give fewer ratios"):
        simulation(body, 1e-3, [0.1] * 99)
    with pytest.raises(ValueError, match="without rigid parts"):
        cn.deformable(body, ROCK, modal_damping=0.1, rigid="top")
    large = plate(cells=(60, 30))
    with pytest.raises(ValueError, match="modal_damping of 'mesh' is of all modes of 3782 dofs: give a list of ratios"):
        simulation(large, 1e-3, 0.1)
