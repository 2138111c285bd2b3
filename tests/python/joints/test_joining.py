"""Joints made and let go in a run: momentum, energy, checkpoints, the file of the run."""

import cairn as cn
import numpy as np
import pytest

STEEL = cn.Material("steel", density=1000.0)
G = 9.81


def bars(dim, centres, **options):
    corners = np.array([[-0.1, -0.02], [0.1, -0.02], [0.1, 0.02], [-0.1, 0.02]])
    if dim == 2:
        return cn.polygons([np.asarray(c) + corners for c in centres], STEEL, **options)
    return cn.boxes(centres, [[0.2, 0.04, 0.04]] * len(centres), STEEL, **options)


def flying(dim, gravity=False):
    scene = cn.Scene(dim, gravity=[0.0] * (dim - 1) + [-G if gravity else 0.0])
    speed = [0.3, -0.2, 2.0] if dim == 2 else [0.3, -0.2, 0.1, 2.0, -1.0, 1.5]
    scene.add(bars(dim, [[0.0] * dim, [0.25] + [0.0] * (dim - 1)], velocity=[speed, [-0.5 * v for v in speed]]))
    scene.interact("*", "*", None)
    return scene


def simulate(scene, dt=1e-3):
    return cn.Simulation(scene, dt, cn.NSCD(solver=cn.NLGS(tol=1e-11, max_iter=50000)), overlap="ignore")


def momenta(sim, dim):
    """Momenta of both bars about the origin: linear, then angular, in the plane."""
    m, x, v = sim.bodies.mass[:2], sim.bodies.position[:2], sim.bodies.velocity[:2]
    spin = np.ravel(sim.bodies.inertia)[:2] * v[:, 2] if dim == 2 else np.zeros(2)
    turn = m * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]) + spin
    return np.append(m @ v[:, :dim], [turn.sum()] if dim == 2 else [])


def ends_apart(sim, dim, ends):
    """Distance between the material points of the first two bodies at a joint."""
    out = []
    for k, e in enumerate(ends):
        r = sim.bodies.rotation[k]
        if dim == 2:
            turned = [np.cos(r) * e[0] - np.sin(r) * e[1], np.sin(r) * e[0] + np.cos(r) * e[1]]
        else:
            once = np.cross(r[1:], e)
            turned = e + 2 * (r[0] * once + np.cross(r[1:], once))
        out.append(sim.bodies.position[k] + turned)
    return np.linalg.norm(out[0] - out[1])


def own(sim, k, point):
    """A point in space in the axes of a body."""
    r, x = sim.bodies.rotation[k], point - sim.bodies.position[k]
    if np.ndim(r) == 0:
        return np.array([np.cos(r) * x[0] + np.sin(r) * x[1], np.cos(r) * x[1] - np.sin(r) * x[0]])
    once = np.cross(-r[1:], x)
    return x + 2 * (r[0] * once + np.cross(-r[1:], once))


@pytest.mark.parametrize("dim", [2, 3])
def test_a_joint_of_a_run_holds_from_the_next_step_on(dim):
    sim = simulate(flying(dim))
    for _ in range(20):
        sim.step()
    before, point = momenta(sim, dim), sim.bodies.position[:2].mean(axis=0)
    ends = [own(sim, k, point) for k in range(2)]
    name = sim.join(0, 1, cn.Pivot(point=point) if dim == 2 else cn.Ball(point=point))
    for _ in range(200):
        assert sim.step()["status"] == "converged"
    assert ends_apart(sim, dim, ends) < 1e-4 * 0.2
    assert momenta(sim, dim) == pytest.approx(before, abs=1e-12)
    e = sim.info["energy"]
    assert e["dissipated_normal"] + e["dissipated_friction"] > 0.01 * e["in_play"]  # velocities that it does not allow
    assert abs(e["closure"]) < 1e-11 * e["in_play"]
    assert len(sim.contacts) == 1
    sim.unjoin(name)
    for _ in range(100):
        sim.step()
    assert len(sim.contacts) == 0 and ends_apart(sim, dim, ends) > 0.01 * 0.2
    assert momenta(sim, dim) == pytest.approx(before, abs=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_joint_to_the_world_and_a_rope_made_in_a_run(dim):
    """Joints made in the run act like joints from the start, between bodies that did not move before."""
    ends, up = [], np.eye(dim)[-1]
    for late in (False, True):
        scene = flying(dim)
        for s in scene.sets:
            s.velocity[:] = 0
        to = simulate(scene) if late else scene
        for _ in range(3 if late else 0):
            to.step()
        to.join(0, None, cn.Pivot(point=(-0.1, 0)) if dim == 2 else cn.Hinge(point=(-0.1, 0, 0), axis=(0, 1, 0)))
        to.join(0, 1, cn.Cable(points=[[0.1] + [0.0] * (dim - 1), 0.3 * up, [0.25] + [0.0] * (dim - 1)]))
        sim = to if late else simulate(scene)
        sim.bodies.set(velocity=np.array([[0.0] * (dim - 1) + [-1.0] + [0.0] * (2 * dim - 3)] * 2 + [[0.0] * (3 * dim - 3)] * 2))
        for _ in range(150):
            assert sim.step()["status"] == "converged"
        ends.append(sim.bodies.position[:2].copy())
    assert np.abs(ends[0] - ends[1]).max() < 1e-9 * 0.2
    assert np.abs(ends[0] - [[0.0] * dim, [0.25] + [0.0] * (dim - 1)]).max() > 0.01


def test_a_spring_that_is_let_go_leaves_the_balance_closed():
    sim = simulate(flying(2))
    sim.step()
    name = sim.join(0, 1, cn.Distance(points=sim.bodies.position[:2], spring=cn.Spring(500.0, rest=0.2)))
    for _ in range(20):
        sim.step()
    stored = sim.info["energy"]["stored"]
    assert stored > 0.01 * sim.info["energy"]["kinetic"]
    sim.unjoin(name)
    for _ in range(5):
        sim.step()
    e = sim.info["energy"]
    assert e["stored"] == 0 and e["dissipated_reshaping"] == pytest.approx(stored, rel=1e-12)
    assert abs(e["closure"]) < 1e-11 * e["in_play"]


def test_checkpoint_and_run_file_know_joints_of_a_run(tmp_path):
    def hang(sim):
        sim.join(0, None, cn.Pivot(point=sim.bodies.position[0]))
        return sim.join(0, 1, cn.Pivot(point=sim.bodies.position[:2].mean(axis=0), limits=(-0.5, 0.5)))

    once = simulate(flying(2, gravity=True))
    once.run(steps=10, progress=False)
    hang(once)
    once.run(steps=30, output=tmp_path / "run.vtkhdf", progress=False)
    once.checkpoint(tmp_path / "half.h5")
    once.run(steps=30, progress=False)
    again = simulate(flying(2, gravity=True))
    again.restore(tmp_path / "half.h5")
    again.run(steps=30, progress=False)
    assert np.array_equal(again.bodies.position, once.bodies.position)
    assert np.array_equal(again.bodies.rotation, once.bodies.rotation)
    run = cn.load(tmp_path / "run.vtkhdf")
    assert len(run) > 0
    name = [a for a, _, law in again._rules if law is not None and law.name == "joint"][-1]
    again.unjoin(name)
    again.checkpoint(tmp_path / "let_go.h5")
    again.run(steps=10, progress=False)
    assert len(again.contacts) == 1
    last = simulate(flying(2, gravity=True))
    last.restore(tmp_path / "let_go.h5")
    last.run(steps=10, progress=False)
    assert np.array_equal(last.bodies.position, again.bodies.position)


def test_round_bodies_turn_from_a_joint_on():
    """A disk that knew no rotation is driven by a motor, at 3 rad/s once it may."""
    scene = cn.Scene(2)
    scene.add(cn.disks([(0.0, 0.0)], 0.1, STEEL))
    sim = simulate(scene)
    sim.step()
    sim.join(0, None, cn.Pivot(point=(0, 0), motor=cn.Motor(3.0, 1e9)))
    for _ in range(100):
        sim.step()
    assert sim.bodies.velocity[0, 2] == pytest.approx(3.0) and sim.bodies.rotation[0] == pytest.approx(0.3, rel=2e-2)


def test_a_body_that_goes_takes_its_joints_along():
    scene = flying(2)
    extra = scene.add(bars(2, [[0.6, 0.0]]))[0]
    sim = simulate(scene)
    sim.step()
    sim.join(0, 1, cn.Cable(points=[(0.0, 0.0), (0.6, 0.0), (0.25, 0.0)], pulley=int(extra), length=5.0))
    sim.join(1, int(extra), cn.Pivot(point=(0.45, 0.0)))
    sim.step()
    assert len(sim.contacts) == 2
    sim.remove([1])  # the far end of the rope
    for _ in range(3):
        assert sim.step()["status"] == "converged"
    assert len(sim.contacts) == 0


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda s: s.join(0, 0, cn.Pivot(point=(0, 0))), "both body 0"),
        (lambda s: s.join(0, 7, cn.Pivot(point=(0, 0))), "body 7 of a joint is not there"),
        (lambda s: s.join(None, 1, cn.Pivot(point=(0, 0))), "a of a joint is None"),
        (lambda s: s.join(0, 1, "hinge"), "joint is 'hinge'"),
        (lambda s: s.join(0, 1, cn.Ball(point=(0, 0))), "Ball is a joint of 3D"),
        (lambda s: s.unjoin("joint 4"), "there is no joint 'joint 4'"),
    ],
)
def test_what_is_wrong_is_told_and_leaves_nothing(make, told):
    sim = simulate(flying(2))
    sim.step()
    with pytest.raises(ValueError, match=told):
        make(sim)
    sim.join(0, 1, cn.Pivot(point=(0.12, 0)))
    sim.step()
    assert len(sim.contacts) == 1


@pytest.mark.parametrize("other", [None, 1])
def test_a_joint_that_the_scene_gets_in_a_run_is_refused_by_name(other):
    scene = cn.Scene(2, gravity=(0, -9.81))
    scene.add(cn.disks([[0, 0], [1, 0]], 0.1, cn.Material("stone", density=1000.0)))
    scene.interact("*", "*", None)
    sim = cn.Simulation(scene, 1e-3)
    sim.step()
    scene.join(0, other, cn.Pivot(point=(0.5, 0)))
    with pytest.raises(ValueError, match="a joint was made in the scene after .* join bodies by Simulation.join"):
        sim.step()
