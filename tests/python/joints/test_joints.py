"""Joints: constraints, limits, motors, strength, energy, restart."""

import cairn as cn
import numpy as np
import pytest

STEEL = cn.Material("steel", density=1000.0)
SHARP = cn.NLGS(tol=1e-11, max_iter=50000)
G = 9.81


def simulate(scene, dt, tol=1e-11):
    return cn.Simulation(scene, dt, cn.NSCD(solver=cn.NLGS(tol=tol, max_iter=50000)), overlap="ignore")


def bodies(dim, centres, **options):
    centres = np.asarray(centres, float)
    if dim == 2:
        corners = np.array([[-0.1, -0.02], [0.1, -0.02], [0.1, 0.02], [-0.1, 0.02]])
        return cn.polygons([c + corners for c in centres], STEEL, **options)
    corners = np.array([[x, y, z] for z in (-0.02, 0.02) for x, y in ((-0.1, -0.03), (0.1, -0.03), (0.1, 0.03), (-0.1, 0.03))])
    faces = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    return cn.polyhedra([(c + corners, faces) for c in centres], STEEL, **options)


def scene_of(dim, centres, gravity=True, **options):
    down = np.zeros(dim)
    down[-1] = -G if gravity else 0.0
    scene = cn.Scene(dim, gravity=down)
    ids = scene.add(bodies(dim, centres, group="bars", **options))
    scene.interact("*", "*", None)
    return scene, ids


def turned(sim, body, x):
    """A vector of a body, in space."""
    r = sim.bodies.rotation[body]
    if np.ndim(r) == 0:
        return np.array([np.cos(r) * x[0] - np.sin(r) * x[1], np.sin(r) * x[0] + np.cos(r) * x[1]])
    once = np.cross(r[1:], x)
    return x + 2 * (r[0] * once + np.cross(r[1:], once))


def energy(sim):
    e = sim.info["energy"]
    return e["kinetic"] + e["potential"]


@pytest.mark.parametrize("dim", [2, 3])
def test_a_pendulum_keeps_its_length_and_its_period(dim):
    """A bar hung at its end, let go from 0.1 rad: period of a physical pendulum, point held to 1e-6 of its size."""
    lean = 0.1
    middle = [0.1 * np.cos(lean), -0.1 * np.sin(lean)] if dim == 2 else [0.1 * np.cos(lean), 0.0, -0.1 * np.sin(lean)]
    scene = cn.Scene(dim, gravity=(G, 0.0) if dim == 2 else (G, 0.0, 0.0))
    turn = -lean if dim == 2 else (np.cos(lean / 2), 0.0, np.sin(lean / 2), 0.0)
    scene.add(bodies(dim, np.zeros((1, dim)), position=[middle], rotation=[turn]))
    scene.interact("*", "*", None)
    point = np.zeros(dim)
    joint = cn.Pivot(point=point) if dim == 2 else cn.Hinge(point=point, axis=(0, 1, 0))
    scene.join(0, None, joint)
    sim = simulate(scene, 1e-3)
    first, crossings, before, drift = None, [], None, 0.0
    for _ in range(3000):
        assert sim.step()["status"] == "converged"
        swing = sim.bodies.position[0, -1]
        if before is not None and before < 0 <= swing:
            crossings.append(sim.time - sim.dt * swing / (swing - before))
        before = swing
        drift = max(drift, abs(np.linalg.norm(sim.bodies.position[0]) - 0.1))
        first = first if first is not None else energy(sim)
    mass, inertia = sim.bodies.mass[0], np.ravel(sim.bodies.inertia[0])[0 if dim == 2 else 1]
    about = inertia + mass * 0.01
    period = 2 * np.pi * np.sqrt(about / (mass * G * 0.1)) * (1 + lean**2 / 16)
    assert np.diff(crossings).mean() == pytest.approx(period, rel=2e-4)
    assert drift < 1e-6 * 0.2
    assert energy(sim) == pytest.approx(first, abs=1e-4 * mass * G * 0.1 * lean**2)


JOINTS = {
    2: {
        "pivot": (cn.Pivot(point=(0.1, 0.0)), ("x", "y"), "turn"),
        "fixed": (cn.Fixed(point=(0.1, 0.0)), ("x", "y", "turn"), None),
        "slider": (cn.Slider(point=(0.1, 0.0), axis=(1.0, 1.0)), ("across", "turn"), "length"),
        "distance": (cn.Distance(points=[(0.1, 0.02), (0.15, -0.02)]), ("length",), "turn"),
    },
    3: {
        "ball": (cn.Ball(point=(0.1, 0.0, 0.0)), ("x", "y", "z"), "turn"),
        "hinge": (cn.Hinge(point=(0.1, 0.0, 0.0), axis=(0.0, 1.0, 1.0)), ("x", "y", "z", "axis"), "turn"),
        "fixed": (cn.Fixed(point=(0.1, 0.0, 0.0)), ("x", "y", "z", "turn"), None),
        "slider": (cn.Slider(point=(0.1, 0.0, 0.0), axis=(1.0, 1.0, 0.0)), ("across", "turn"), "length"),
        "distance": (cn.Distance(points=[(0.1, 0.0, 0.02), (0.15, 0.0, -0.02)]), ("length",), "turn"),
    },
}


def errors(sim, dim, kind, ends, axis):
    """How far the second body's end is from where the first one has it, as each joint would have it [m, rad]."""
    x, start = sim.bodies.position, np.array([[0.0] * dim, [0.25] + [0.0] * (dim - 1)])
    a = x[0] + turned(sim, 0, ends[0] - start[0])
    b = x[1] + turned(sim, 1, ends[1] - start[1])
    found = {name: abs(v) for name, v in zip("xyz", a - b)}
    one, other = (np.array([turned(sim, k, e) for e in np.eye(dim)]) for k in (0, 1))
    found["turn"] = np.abs(one - other).max()
    found["length"] = abs(np.linalg.norm(a - b) - np.linalg.norm(ends[0] - ends[1]))
    if axis is not None:
        found["axis"] = np.abs(turned(sim, 0, axis) - turned(sim, 1, axis)).max()
        along = turned(sim, 1, axis)
        found["across"] = np.linalg.norm((a - b) - (a - b) @ along * along)
    return found


@pytest.mark.parametrize(("dim", "name"), [(d, n) for d in JOINTS for n in JOINTS[d]])
def test_joints_hold_what_they_say_and_nothing_else(dim, name):
    """Two bars that spin apart: blocked components stay to 1e-5 of the size, momenta and energy are kept."""
    kind, blocked, free = JOINTS[dim][name]
    spin = np.array([[0.3, -0.2, 2.0], [-0.3, 0.4, -3.0]]) if dim == 2 else np.array(
        [[0.3, -0.2, 0.1, 2.0, -1.0, 1.5], [-0.3, 0.4, 0.2, 1.0, 2.0, -3.0]])  # fmt: skip
    scene, _ = scene_of(dim, [[0.0] * dim, [0.25] + [0.0] * (dim - 1)], gravity=False, velocity=spin)
    scene.join(0, 1, kind)
    sim = simulate(scene, 5e-4)
    ends = kind.ends(dim)
    axis = kind.axis_of(dim) if hasattr(kind, "axis") else None
    for _ in range(3):  # velocities that the joint does not allow are an impact
        sim.step()
    first, momentum, worst = energy(sim), sim.bodies.mass @ sim.bodies.velocity[:, :dim], {}
    for _ in range(1500):
        assert sim.step()["status"] == "converged"
        for key, value in errors(sim, dim, name, ends, axis).items():
            worst[key] = max(worst.get(key, 0.0), value)
    for key, value in worst.items():
        if key in blocked:
            assert value < 1e-5 * 0.2, key
    assert free is None or worst[free] > 1e-2
    assert energy(sim) == pytest.approx(first, rel=1e-5)
    assert sim.bodies.mass @ sim.bodies.velocity[:, :dim] == pytest.approx(momentum, abs=1e-9)
    assert abs(sim.info["energy"]["closure"]) < 1e-10 * sim.info["energy"]["in_play"]


def test_the_energy_of_a_chain_is_kept_to_the_square_of_the_step():
    """A chain of 10 bars hung at an end and let go: its energy loss falls by four when the step is halved."""
    lost = []
    for dt in (4e-4, 2e-4):
        scene, ids = scene_of(2, [[0.1 + 0.2 * k, 0.0] for k in range(10)])
        scene.join(0, None, cn.Pivot(point=(0.0, 0.0)))
        for k in range(9):
            scene.join(k, k + 1, cn.Pivot(point=(0.2 * (k + 1), 0.0)))
        sim = simulate(scene, dt, 1e-10)
        sim.step()
        begin = energy(sim)
        seen = []
        for _ in range(round(0.4 / dt)):
            assert sim.step()["status"] == "converged"
            seen.append(abs(energy(sim) - begin))
        assert ids.size == 10
        lost.append(max(seen) / sim.info["energy"]["kinetic"])
    assert lost[0] < 1e-3 and lost[1] < 0.4 * lost[0]


@pytest.mark.parametrize(("dim", "name"), [(d, n) for d in JOINTS for n in JOINTS[d]])
def test_where_steps_detect_joints_miss_nothing(dim, name):
    """Bars that spin, by steps of 1 ms: errors of the frames that the law finds, of the size of a bar, radians as they are."""
    kind = JOINTS[dim][name][0]
    spin = np.array([[0.3, -0.2, 2.0], [-0.3, 0.4, -3.0]]) if dim == 2 else np.array(
        [[0.3, -0.2, 0.1, 2.0, -1.0, 1.5], [-0.3, 0.4, 0.2, 1.0, 2.0, -3.0]])  # fmt: skip
    scene, _ = scene_of(dim, [[0.0] * dim, [0.25] + [0.0] * (dim - 1)], gravity=False, velocity=spin)
    scene.join(0, 1, kind)
    sim = simulate(scene, 1e-3)
    for _ in range(3):
        sim.step()
    blocked, worst = kind.bits(dim)[0], 0.0
    at = [c if dim == 3 or c < 2 else 3 for c in range(3 * dim - 3) if blocked >> c & 1]
    for _ in range(200):
        sim.step()
        errors = np.ravel(sim.get_state()["memory"]["states"])[1:7]
        worst = max(worst, np.abs(errors[at]).max())
    assert worst < 1e-11 * 0.2  # the tolerance of the solver


def test_what_swings_over_on_hinges_does_not_drift():
    """Two bars by steps of 1 ms: their points at the middles of steps, and the energy when they swung."""
    scene, dt = scene_of(2, [[0.1, 0.0], [0.3, 0.0]])[0], 1e-3
    scene.join(0, None, cn.Pivot(point=(0.0, 0.0)))
    scene.join(0, 1, cn.Pivot(point=(0.2, 0.0)))
    sim = simulate(scene, dt)
    sim.step()
    first, worst = energy(sim), 0.0
    for _ in range(1500):
        sim.step()
        end = np.zeros(2)
        for k in range(2):
            x, v = sim.bodies.position[k], sim.bodies.velocity[k]
            angle = sim.bodies.rotation[k] + dt / 2 * v[2]
            arm = 0.1 * np.array([np.cos(angle), np.sin(angle)])
            worst = max(worst, np.abs(x + dt / 2 * v[:2] - arm - end).max())
            end = x + dt / 2 * v[:2] + arm
    assert worst < 1e-10 * 0.2
    assert abs(energy(sim) - first) < 1e-4 * sim.info["energy"]["largest_kinetic"]


def test_limits_stop_and_a_motor_drives():
    """A door on a hinge: a motor of 0.5 N m turns it at its speed once it can, a limit stops it, the balance closes."""
    scene, _ = scene_of(3, [[0.1, 0.0, 0.0]], gravity=False)
    motor = cn.Motor(speed=3.0, effort=0.5)
    scene.join(0, None, cn.Hinge(point=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0), limits=(-0.2, 0.5), motor=motor))
    sim = simulate(scene, 1e-3)
    inertia = np.ravel(sim.bodies.inertia[0])[2] + sim.bodies.mass[0] * 0.01
    for _ in range(20):
        sim.step()
    assert sim.bodies.velocity[0, 5] == pytest.approx(0.5 / inertia * 0.02, rel=1e-2)
    top = created = 0.0
    for _ in range(600):
        created = max(created, sim.step()["energy_created"])  # the stop leaves nothing that the next step would give back
        top = max(top, sim.bodies.velocity[0, 5])
    assert top == pytest.approx(3.0, rel=1e-6)
    q = sim.bodies.rotation[0]
    assert 2 * np.arctan2(q[3], q[0]) == pytest.approx(0.5, abs=1e-6)
    e = sim.info["energy"]
    assert abs(e["closure"]) < 1e-10 * e["in_play"] and e["work_driven"] > 0
    assert created < 1e-6


@pytest.mark.parametrize("first", [0, 1])
def test_the_coordinate_is_that_of_the_first_body_against_the_second(first):
    """Driven at 2 rad/s and 0.3 m/s, whichever of the two came in first, in 2D and in 3D."""
    for dim, kind, dof in (
        (2, cn.Pivot(point=(0.0, 0.0), motor=cn.Motor(speed=2.0, effort=1e9)), 2),
        (2, cn.Slider(point=(0.0, 0.0), axis=(1.0, 0.0), motor=cn.Motor(speed=0.3, effort=1e9)), 0),
        (3, cn.Hinge(point=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0), motor=cn.Motor(speed=2.0, effort=1e9)), 4),
        (3, cn.Slider(point=(0.0,) * 3, axis=(1.0, 0.0, 0.0), motor=cn.Motor(speed=0.3, effort=1e9)), 0),
    ):
        scene = cn.Scene(dim)
        for k in range(2):
            scene.add(bodies(dim, [[0.0] * dim]) if k == first else bodies(dim, [[0.0] * dim], fixed=True))
        scene.interact("*", "*", None)
        scene.join(first, 1 - first, kind)
        sim = simulate(scene, 1e-3)
        sim.step()
        assert sim.bodies.velocity[first, dof] == pytest.approx(kind.motor.speed, rel=1e-9)


def test_a_joint_breaks_at_its_strength():
    scene, _ = scene_of(2, [[0.1, 0.0]])
    weight = 1000.0 * 0.2 * 0.04 * G
    scene.join(0, None, cn.Fixed(point=(0.0, 0.0), strength=1.05 * weight))
    held = simulate(scene, 1e-3)
    for _ in range(50):
        held.step()
    assert np.abs(held.bodies.position[0] - [0.1, 0.0]).max() < 1e-9 and held.contacts.beta.max() == 1
    scene, _ = scene_of(2, [[0.1, 0.0]])
    scene.join(0, None, cn.Fixed(point=(0.0, 0.0), strength=0.95 * weight))
    gone = simulate(scene, 1e-3)
    for _ in range(50):
        gone.step()
    assert gone.bodies.position[0, 1] < -0.5 * G * 0.045**2 and gone.contacts.beta.max(initial=0.0) == 0


def test_restart_and_scene_file_go_on_to_the_same_bits(tmp_path):
    def scene():
        made, _ = scene_of(3, [[0.0, 0.0, 0.0], [0.25, 0.0, 0.0]], velocity=[[0.3, 0, 0, 1, 2, 3], [0, 0, 0, -1, 0, 2]])
        made.join(0, None, cn.Ball(point=(-0.1, 0.0, 0.0)))
        made.join(0, 1, cn.Hinge(point=(0.12, 0.0, 0.0), axis=(0, 1, 0), limits=(-0.1, 0.1)))
        return made

    once = simulate(scene(), 1e-3)
    for _ in range(80):
        once.step()
    half = simulate(scene(), 1e-3)
    for _ in range(30):
        half.step()
    half.checkpoint(tmp_path / "half.h5")
    scene().save(tmp_path / "joined.scene.h5")
    again = simulate(cn.Scene.load(tmp_path / "joined.scene.h5"), 1e-3)
    again.restore(tmp_path / "half.h5")
    for _ in range(50):
        again.step()
    assert np.array_equal(again.bodies.position, once.bodies.position)
    assert np.array_equal(again.bodies.rotation, once.bodies.rotation)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda s: s.join(0, 0, cn.Pivot(point=(0, 0))), "both body 0"),
        (lambda s: s.join(0, 7, cn.Pivot(point=(0, 0))), "b of a joint is 7"),
        (lambda s: s.join(0, None, cn.Ball(point=(0, 0))), "in 2D give Pivot"),
        (lambda s: s.join(0, None, cn.Pivot(point=(0, 0, 0))), "point of Pivot"),
        (lambda s: s.join(0, None, cn.Slider(point=(0, 0), axis=(0, 0))), "axis of Slider"),
        (lambda s: s.join(0, None, cn.Pivot(point=(0, 0), limits=(1, 0))), "limits of Pivot are 1 and 0"),
        (lambda s: s.join(0, None, cn.Pivot(point=(0, 0), limits=1)), "limits of Pivot is 1: give the lowest and the highest"),
        (lambda s: s.join(0, None, cn.Pivot(point=(0, 0), limits=(0, 1, 2))), "limits of Pivot is .0, 1, 2."),
        (lambda s: s.join(0, None, cn.Pivot(point=(0, 0), limits=(np.nan, 1))), r"limits\[0\] of Pivot is nan"),
        (lambda s: s.join(0, None, cn.Distance(points=[(0, 0), (1, 0)], limits=1)), "limits of Distance is 1"),
        (lambda s: s.join(0, None, cn.Pivot(point=(0, 0), strength=-1)), "strength of Pivot is -1"),
        (lambda s: s.join(0, None, cn.Distance(points=[(0, 0), (0, 0)])), "points of Distance are both"),
        (lambda s: s.join(0, None, cn.Pivot(point=(0, 0), motor=3)), "motor of Pivot is 3"),
        (lambda s: s.join(0, None, "hinge"), "joint is 'hinge'"),
    ],
)
def test_wrong_joints_are_told(make, told):
    scene, _ = scene_of(2, [[0.1, 0.0]])
    with pytest.raises(ValueError, match=told):
        make(scene)


def test_limits_of_a_hinge_beyond_its_angles_are_told():
    scene, _ = scene_of(3, [[0.1, 0.0, 0.0]])
    with pytest.raises(ValueError, match="limits of Hinge are -4 and 1: give angles from -pi to pi"):
        scene.join(0, None, cn.Hinge(point=(0, 0, 0), axis=(0, 0, 1), limits=(-4.0, 1.0)))


@pytest.mark.parametrize("strategy", [cn.SmoothDEM(), cn.EventDriven()])
def test_strategies_that_know_no_joints_say_so(strategy):
    scene = cn.Scene(2)
    disk = scene.add(cn.disks([[0.0, 0.0]], 0.05, cn.Material("steel", density=7800.0)))
    scene.interact("*", "*", cn.Restitution(mu=0.0) if isinstance(strategy, cn.EventDriven) else cn.LinearSpring(stiffness=1e6))
    scene.join(disk[0], None, cn.Pivot(point=(0.0, 0.0)))
    with pytest.raises(cn.Error, match="knows no joints: keep NSCD"):
        cn.Simulation(scene, 1e-4, strategy).step()


def sprung(dim, kind, h, damping=0.0, stiffness=1e4):
    """A round body on a spring that begins with a speed; simulation, mass or inertia, frequency."""
    make, size = (cn.disks, np.pi * 0.05**2) if dim == 2 else (cn.spheres, 4 / 3 * np.pi * 0.05**3)
    mass, begin = 7800.0 * size, np.eye(3 * dim - 3)[2 if kind == "pivot" else 0]
    scene, spring, zero = cn.Scene(dim=dim), cn.Spring(stiffness, damping), np.zeros(dim)
    ball = scene.add(make([zero], 0.05, cn.Material("steel", density=7800.0), velocity=[0.1 * begin]))[0]
    if kind == "pivot":
        mass *= 0.05**2 / 2
        joint = cn.Pivot(point=zero, spring=spring)
    elif kind == "slider":
        joint = cn.Slider(point=zero, axis=np.eye(dim)[0], spring=spring)
    else:
        joint = cn.Distance(points=[zero, 2 * np.eye(dim)[0]], spring=spring)
    scene.join(ball, None, joint)
    frequency = np.sqrt(stiffness / mass)
    return cn.Simulation(scene, dt=h / frequency), mass, frequency


@pytest.mark.parametrize("dim, kind", [(2, "slider"), (3, "slider"), (2, "pivot"), (2, "distance"), (3, "distance")])
def test_a_spring_keeps_its_energy_and_its_period(dim, kind):
    worst = []
    for h in (0.1, 0.05):
        sim, mass, frequency = sprung(dim, kind, h)
        seen = []
        for _ in range(round(10 / h)):
            sim.step()
            terms = sim.info["energy"]
            assert terms["kinetic"] + terms["stored"] == pytest.approx(0.5 * mass * 0.1**2, rel=1e-11)
            assert abs(terms["closure"]) <= 1e-12 * terms["in_play"]
            seen.append(sim.bodies.rotation[0] if kind == "pivot" else sim.bodies.position[0, 0])
        t = h * np.arange(1, len(seen) + 1)
        worst.append(np.abs(np.ravel(seen) * frequency / 0.1 - np.sin(t)).max())
    assert worst[0] < 0.01 and worst[1] < 0.27 * worst[0]  # of second order


def test_a_dashpot_spends_what_the_spring_loses():
    sim, mass, frequency = sprung(2, "slider", 0.02, damping=50.0)
    share, last = 50.0 / (2 * mass * frequency), 0.0
    for _ in range(200):
        sim.step()
        terms = sim.info["energy"]
        assert terms["released"] >= last and abs(terms["closure"]) <= 1e-12 * terms["in_play"]
        last = terms["released"]
    assert terms["kinetic"] + terms["stored"] + last == pytest.approx(0.5 * mass * 0.1**2, rel=1e-11)
    t, slower = 200 * 0.02, np.sqrt(1 - share**2)
    assert sim.bodies.position[0, 0] * frequency / 0.1 == pytest.approx(
        np.exp(-share * t) * np.sin(slower * t) / slower, abs=2e-3
    )


def test_a_spring_far_shorter_than_the_step_stays_bounded():
    sim, mass, _ = sprung(2, "slider", 1e3)
    for _ in range(100):
        assert sim.step()["status"] == "converged"
        terms = sim.info["energy"]
        assert terms["kinetic"] + terms["stored"] == pytest.approx(0.5 * mass * 0.1**2, rel=1e-6)


def test_springs_rest_where_they_are_told_whichever_body_comes_first():
    """A bar hangs level on a torsion spring: m g l/2 = k (rest - angle)."""
    steel, ends = cn.Material("steel", density=7800.0), []
    for swapped in (False, True):
        scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
        post = cn.disks([[0.0, 0.0]], 0.01, steel, driven=("vx", "vy", "w"))
        bar = cn.polygons([np.array([[0.0, -0.01], [0.4, -0.01], [0.4, 0.01], [0.0, 0.01]])], steel)
        first, second = scene.add(bar, post) if swapped else scene.add(post, bar)
        post_id, bar_id = (second, first) if swapped else (first, second)
        torque = 0.4 * 0.02 * 7800.0 * 9.81 * 0.2
        scene.join(bar_id, post_id, cn.Pivot(point=(0.0, 0.0), spring=cn.Spring(torque / 0.2, damping=20.0, rest=0.2)))
        scene.interact("*", "*", None)
        sim = cn.Simulation(scene, dt=2e-3)
        for _ in range(1500):
            sim.step()
        ends.append(float(np.ravel(sim.bodies.rotation)[0 if swapped else 1]))
    # level is an angle of 0, where cos = 1
    np.testing.assert_allclose(ends, 0.0, atol=1e-6)


def test_a_wheel_on_its_own_centre_knows_how_far_it_turned():
    """Round bodies have no rotation unless somebody asks: limits do."""
    scene = cn.Scene(dim=2)
    wheel = scene.add(cn.disks([[0.0, 0.0]], 0.05, cn.Material("steel", density=7800.0), velocity=[[0.0, 0.0, 1.0]]))[0]
    scene.join(wheel, None, cn.Pivot(point=(0.0, 0.0), limits=(-0.1, 0.1)))
    sim = cn.Simulation(scene, dt=1e-2)
    for _ in range(30):
        sim.step()
    assert float(np.ravel(sim.bodies.rotation)[0]) == pytest.approx(0.1, abs=1e-9)


@pytest.mark.parametrize("given, said", [
    (lambda: cn.Spring(-1.0), "stiffness of Spring is -1"),
    (lambda: cn.Spring(1.0, damping=-2.0), "damping of Spring is -2"),
    (lambda: cn.Spring(np.inf), "stiffness of Spring"),
    (lambda: cn.Spring(1.0, rest=np.nan), "rest of Spring"),
])  # fmt: skip
def test_springs_that_cannot_be(given, said):
    with pytest.raises(ValueError, match=said):
        given()


@pytest.mark.parametrize(("links", "most"), [(10, 10), (30, 20)])
def test_what_a_solver_leaves_is_no_miss_of_joints(links, most):
    """A chain whose sweeps end at their limit far from the solution: its own error is not driven into the next pass, which ran
    away to 1e29 m/s and beyond."""
    scene = cn.Scene(2, gravity=(0, -9.81))
    ids = scene.add(cn.disks(np.c_[(np.arange(links) + 0.5) * 0.1, np.zeros(links)], 0.05, cn.Material("m", density=1000.0)))
    scene.interact("*", "*", None)
    for k in range(links):
        scene.join(ids[k], ids[k - 1] if k else None, cn.Pivot(point=(0.1 * k, 0)))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.NLGS(tol=1e-8, max_iter=most)))
    ended = 0
    for _ in range(200):
        info = sim.step()
        ended += info["status"] != "converged"
        assert info["iterations"] <= most
    assert ended > 100
    assert np.abs(sim.bodies.velocity).max() < 1e4 * 9.81 * 0.2  # of that of a body that falls freely all the while


def flight(speed):
    """Two disks that turn on a hinge and fly off: the largest miss of the hinge, sweeps, and where they are at the end."""
    scene = cn.Scene(2)
    of = cn.Material("m", density=1000.0)
    scene.add(cn.disks([[0.0, 0.0], [0.2, 0.0]], 0.1, of, velocity=[[speed, 0.0, 3.0], [speed, 0.0, -5.0]]))
    scene.interact("*", "*", None)
    scene.join(0, 1, cn.Pivot(point=(0.1, 0.0)))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.NLGS(tol=1e-8)))
    worst, sweeps = 0.0, 0
    for step in range(200):
        sweeps += sim.step()["iterations"]
        if step > 3:
            worst = max(worst, np.abs(np.ravel(sim.get_state()["memory"]["states"])[1:3]).max())
    return worst, sweeps, np.abs(sim.bodies.position).max()


def test_a_joint_that_flies_is_as_tight_as_one_that_stays():
    """Drift is within the rounding of positions. A tolerance relative to speeds of the scene would leave 1e-11 m at 1 km/s, for a
    third less sweeps."""
    stays, sweeps, _ = flight(0.0)
    assert stays < 1e-8 * 1e-3 * 8.0 * 0.1  # of the step, the spin of one against the other and the arm
    for speed in (1e3, 1e6):
        worst, also, place = flight(speed)
        rounding = 8 * np.finfo(float).eps * place
        assert worst < 1.1 * stays + rounding
        assert speed > 1e3 or also == sweeps


@pytest.mark.parametrize(("links", "tol", "most"), [(10, 1e-8, 40), (100, 1e-8, 60)])
def test_passes_over_joints_go_on_as_the_one_before_ended(links, tol, most):
    """A chain that is let go: where Newton's method over bodies found impulses of joints, it also corrects their drift."""
    scene = cn.Scene(2, gravity=(0, -9.81))
    ids = scene.add(cn.disks(np.c_[(np.arange(links) + 0.5) * 0.1, np.zeros(links)], 0.05, cn.Material("m", density=1000.0)))
    scene.interact("*", "*", None)
    for k in range(links):
        scene.join(ids[k], ids[k - 1] if k else None, cn.Pivot(point=(0.1 * k, 0)))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.Auto(tol=tol)))
    reports = [sim.step() for _ in range(12)]
    assert all(r["status"] == "converged" for r in reports)
    assert max(r["iterations"] for r in reports) < most


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("effort, holds", [(1e5, True), (50.0, False)])
def test_a_motor_of_a_slider_works_along_the_normal_and_friction_has_no_part_in_it(effort, holds, dim):
    """A lift, and a brake that slips: what the motor gives or takes is work_driven alone."""
    scene = cn.Scene(dim, gravity=(0.0,) * (dim - 1) + (-9.81,))
    up = np.eye(dim)[-1]
    ids = scene.add((cn.disks if dim == 2 else cn.spheres)([np.zeros(dim)], 0.1, cn.Material("m", density=2000.0)))
    scene.interact("*", "*", None)
    motor = cn.Motor(speed=1.0 if holds else 0.0, effort=effort)
    scene.join(ids[0], None, cn.Slider(point=np.zeros(dim), axis=up, motor=motor))
    sim = cn.Simulation(scene, 1e-3)
    for _ in range(200):
        sim.step()
    e, mass, fallen = sim.energy, sim.bodies.mass[0], -sim.bodies.position[0, dim - 1]
    given = mass * (9.81 * -fallen + 0.5 * sim.bodies.velocity[0, dim - 1] ** 2)
    assert (fallen < 0) == holds and e["work_driven"] == pytest.approx(given, rel=1e-9)
    assert max(abs(e["dissipated_friction"]), abs(e["dissipated_normal"])) < 1e-12 * e["in_play"]
