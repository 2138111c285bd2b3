"""Friction against rolling by the radius of curvature at the contact along the way: what rolls on its side begins to roll at
tan(slope) = rolling, however long it is; corners and flat faces, which roll on no radius, bear no moment."""

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=2500.0)
GROUND = cn.Material("ground", density=2500.0)
G, R, RHO, H = 9.81, 0.05, 0.05, 1e-3
TIGHT = cn.NLGS(tol=1e-10)


def side_shape(shape, length):
    if shape == "sphere":
        return cn.spheres([[0, 0, R]], R, STONE)
    if shape == "cylinder":
        return cn.cylinders([[0, 0, R]], R, length, STONE, axis=(0, 1, 0))
    if shape == "capsule":
        return cn.capsules([[0, 0, R]], R, length, STONE, axis=(0, 1, 0))
    if shape == "drum":  # a superquadric, round across its third axis
        quarter = [[np.sqrt(0.5), np.sqrt(0.5), 0, 0]]
        return cn.superquadrics([[0, 0, R]], (R, R, length / 2), (0.2, 1.0), STONE, rotation=quarter)
    return cn.superquadrics([[0, 0, R]], (R, length / 2, R), (1.0, 1.0), STONE)


def floor(kind):
    if kind == "wall":
        return cn.wall((0, 0, 0), (0, 0, 1), GROUND)
    if kind == "box":
        return cn.boxes([[0, 0, -0.5]], (6, 6, 1), GROUND, fixed=True)
    corners = [[-3, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]]
    return cn.surface(np.array(corners, float), [[0, 1, 2], [0, 2, 3]], GROUND)


def acceleration(shape, length, slope, ground="wall", rolling=RHO, steps=100):
    """Along the slope, and I/(m r^2) about the axis."""
    angle = np.arctan(slope)
    scene = cn.Scene(3, gravity=(G * np.sin(angle), 0, -G * np.cos(angle)))
    scene.add(side_shape(shape, length), floor(ground))
    scene.interact("*", "*", cn.Rolling(mu=0.7, rolling=rolling))
    sim = cn.Simulation(scene, H, cn.NSCD(solver=TIGHT))
    for _ in range(steps):
        assert sim.step()["status"] == "converged"
    inertia = np.ravel(sim.bodies.inertia[0])
    about = inertia.min() if shape in ("sphere", "capsule", "cylinder") and length > R else None
    if about is None:  # the inertia about the axis that is alone in being different
        about = inertia[np.argmax(np.abs(inertia - np.median(inertia)))] if np.ptp(inertia) > 0 else inertia[0]
    return sim.bodies.velocity[0, 0] / (steps * H), about / (sim.bodies.mass[0] * R * R)


@pytest.mark.parametrize("ground", ["wall", "box", "triangles"])
@pytest.mark.parametrize(
    "shape, length",
    [("sphere", 0), ("cylinder", 0.03), ("cylinder", 0.4), ("capsule", 0.1), ("capsule", 0.4), ("ellipsoid", 0.4), ("drum", 0.4)],
)
def test_what_lies_on_its_side_rolls_by_the_radius_of_its_side(shape, length, ground):
    """g (sin - rolling cos)/(1 + I/(m r^2)), above the slope at which it begins; below it stays."""
    for slope in (0.9 * RHO, 1.1 * RHO, 0.3):
        found, inertia = acceleration(shape, length, slope, ground)
        cosine = 1 / np.hypot(1, slope)
        wanted = G * cosine * max(0.0, slope - RHO) / (1 + inertia)
        assert found == pytest.approx(wanted, rel=2e-3, abs=1e-6 * G), slope


def test_a_wheel_on_its_rim_rolls_by_its_radius():
    """A thin cylinder that stands upright."""
    found, _ = acceleration("cylinder", 0.01, 0.2)
    assert found == pytest.approx(G * (0.2 - RHO) / np.hypot(1, 0.2) / 1.5, rel=1e-3)


@pytest.mark.parametrize("way", [0, 1])
def test_an_ellipsoid_turns_by_the_radius_along_its_way(way):
    """Pressed on a floor without friction, it begins to turn across one of its axes where the moment is rolling R N."""
    half, press = np.array([0.05, 0.12, 0.03]), 100.0
    radius, turned = half[way] ** 2 / half[2], []
    for factor in (0.98, 1.02):
        force = np.array([[0, 0, -press, 0, 0, 0.0]])
        force[0, 4 - way] = factor * RHO * radius * press
        scene = cn.Scene(3, gravity=(0, 0, 0))
        scene.add(cn.superquadrics([[0, 0, half[2]]], half, (1.0, 1.0), STONE, force=force), floor("wall"))
        scene.interact("*", "*", cn.Rolling(mu=0.0, rolling=RHO))
        sim = cn.Simulation(scene, 1e-5, cn.NSCD(solver=TIGHT))
        sim.step()
        inertia = np.ravel(sim.bodies.inertia[0]).max()
        turned.append(np.abs(sim.bodies.velocity[0, 3:]).max() * inertia / (1e-5 * RHO * radius * press))
    assert turned[0] < 1e-6 < 1e-2 < turned[1]


def oblique_limit(angle):
    """Moments against rolling, over rolling N, that an ellipsoid turned about the vertical bears; its spin."""
    half, press, scene = (0.05, 0.12, 0.03), 100.0, cn.Scene(3, gravity=(0, 0, 0))
    axis, moment = np.array([np.cos(angle), np.sin(angle), 0]), 1e3
    turned = [[np.cos(0.3), 0, 0, np.sin(0.3)]]
    force = np.array([[0, 0, -press, *(moment * axis)]])
    scene.add(cn.superquadrics([[0, 0, half[2]]], half, (1.0, 1.0), STONE, rotation=turned, force=force), floor("wall"))
    scene.interact("*", "*", cn.Rolling(mu=0.0, rolling=RHO))
    sim = cn.Simulation(scene, 1e-6, cn.NSCD(solver=TIGHT))
    sim.step()
    spin = sim.bodies.velocity[0, 3:5]
    borne = force[0, 3:5] * 1e-6 - np.array([[np.cos(0.6), -np.sin(0.6)], [np.sin(0.6), np.cos(0.6)]]) @ (
        np.ravel(sim.bodies.inertia[0])[:2] * (np.array([[np.cos(0.6), np.sin(0.6)], [-np.sin(0.6), np.cos(0.6)]]) @ spin)
    )
    return borne / (1e-6 * RHO * press), spin


@pytest.mark.parametrize("angle", [0.2, 1.1])
def test_moments_of_an_ellipsoid_are_those_of_most_power(angle):
    """About an axis between the principal ones: M = D D omega/|D omega|, D the radii of its surface."""
    borne, spin = oblique_limit(angle)
    turn = np.array([[np.cos(0.6), -np.sin(0.6)], [np.sin(0.6), np.cos(0.6)]])
    radii = turn @ np.diag([0.12**2 / 0.03, 0.05**2 / 0.03]) @ turn.T  # about an axis by the curvature across it
    way = radii @ spin
    np.testing.assert_allclose(borne, radii @ way / np.linalg.norm(way), rtol=1e-5)


@pytest.mark.parametrize("dim", [2, 3])
def test_what_has_corners_tips_as_without_friction_against_rolling(dim):
    """A block on its edge, leaning out by a little: corners have no radius."""
    motions = []
    for rolling in (0.0, 0.5):
        scene = cn.Scene(dim, gravity=(0, -G) if dim == 2 else (0, 0, -G))
        lean = np.pi / 4 + 0.02
        if dim == 2:
            c, s = np.cos(lean), np.sin(lean)
            square = 0.1 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) @ np.array([[c, s], [-s, c]]) + [0, 0.2]
            scene.add(cn.polygons([square], STONE))
            scene.add(cn.wall((0, 0.2 - 0.1 * (np.cos(lean) + np.sin(lean))), (0, 1), GROUND))
        else:
            q = [[np.cos(lean / 2), 0, np.sin(lean / 2), 0]]
            scene.add(cn.boxes([[0, 0, 0.1 * (np.cos(lean) + np.sin(lean))]], (0.2, 0.2, 0.2), STONE, rotation=q), floor("wall"))
        scene.interact("*", "*", cn.Rolling(mu=0.8, rolling=rolling))
        sim = cn.Simulation(scene, H, cn.NSCD(solver=TIGHT))
        for _ in range(100):
            sim.step()
        motions.append(sim.bodies.velocity[0])
    assert np.abs(motions[0]).max() > 0.05
    np.testing.assert_allclose(motions[1], motions[0], rtol=1e-6, atol=1e-8)


def test_a_ball_in_a_tube_rolls_along_by_its_own_radius_and_around_by_more():
    """1/R is 1/r along the axis, 1/r - 1/tube around it."""
    r, tube, limits = 0.05, 0.2, []
    for way in (0, 1):
        press, factors, turned = 10.0, (0.98, 1.02), []
        wanted = RHO * press * (r if way == 0 else r * tube / (tube - r))
        for factor in factors:
            force = np.array([[0, 0, -press, 0, 0, 0.0]])
            force[0, 4 - way] = factor * wanted
            scene = cn.Scene(3, gravity=(0, 0, 0))
            scene.add(cn.spheres([[0, 0, r - tube]], r, STONE, force=force), cn.tube((0, 0, 0), (1, 0, 0), tube, material=GROUND))
            scene.interact("*", "*", cn.Rolling(mu=0.0, rolling=RHO))
            sim = cn.Simulation(scene, 1e-5, cn.NSCD(solver=TIGHT), overlap="ignore")
            sim.step()
            inertia = np.ravel(sim.bodies.inertia[0]).max()
            turned.append(np.abs(sim.bodies.velocity[0, 3:]).max() * inertia / (1e-5 * wanted))
        limits.append(turned)
    for below, above in limits:
        assert below < 1e-6 < 1e-2 < above
