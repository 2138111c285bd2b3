"""Solids whose balance has no term that is larger than rounding: drawn between held sides, where forces of cells cancel at every
free node and reactions of held nodes are the scale of Newton's tolerance; and solids that move as a whole."""

import itertools

import cairn as cn
import numpy as np
import pytest
from cairn import NeoHookean, SolidBody
from second_order import box

ROCK = cn.Material("rock", density=2500.0)
LONG = np.array([2.0, 1.0, 1.0])
TOLERANCE = 1e-8  # newton_tol as it is


def drawn(kind, *, young=1e6, density=1.0, size=1.0, dt=1.0, theta=0.5, share=0.05, clamped=False, counts=(2, 2, 2)):
    """A block of rubber drawn along x by a share of its length in each step. Not clamped, its ends may draw in across."""
    dim = 2 if kind.startswith(("tri", "quad")) else 3
    points, cells = box(kind, counts[:dim], size * LONG[:dim])
    body = SolidBody(points, cells, NeoHookean(young=young, poisson=0.3), density=density)
    near = 1e-9 * size
    body.groups.update(left=np.flatnonzero(points[:, 0] < near), right=np.flatnonzero(points[:, 0] > (LONG[0] - 1e-9) * size))
    fixed = {"left": "x"}
    for axis in range(1, dim):
        body.groups[f"low {axis}"] = np.flatnonzero(points[:, axis] < near)
        fixed[f"low {axis}"] = "xyz"[axis]
    if clamped:
        fixed = {"left": "xyz"[:dim], "right": "yz"[: dim - 1]}
    speed = share * LONG[0] * size / dt
    scene = cn.Scene(dim=dim)
    scene.add(cn.deformable(body, ROCK, fixed=fixed, displace={"right": {"x": lambda t: speed * t}}))
    return cn.Simulation(scene, dt=dt, strategy=cn.NSCD(theta=theta))


def left_over(sim, before, theta):
    """Residual of the balance of the last step at free dofs, over the largest force of cells or of inertia at any dof: by the
    forces of the body alone at both ends, and its mass. before: displacement and velocity as the step began. Rounding of
    velocities, and of the displacements that follow from them, is not counted."""
    view = sim.meshes[0]
    force = [view.body.tangent(u)[0] for u in (before[0], view.displacement)]
    inertia = view.body.M @ (view.velocity - before[1]).ravel() / sim.dt
    free = np.ones(inertia.size, bool)
    free[view.held] = False
    terms = (1 - theta) * force[0] + theta * force[1], inertia
    rounding = 1e-15 * (abs(view.body.M) @ np.abs(view.velocity).ravel()).max() / sim.dt
    return max(np.abs(sum(terms)[free]).max() - rounding, 0.0) / max(np.abs(term).max() for term in (*terms, *force))


def stepped(sim, steps, theta):
    """The most that steps left of their balance."""
    most = 0.0
    for _ in range(steps):
        before = sim.meshes[0].displacement.copy(), sim.meshes[0].velocity.copy()
        report = sim.step()
        assert report["status"] == "converged" and report["newton_error"] <= TOLERANCE
        most = max(most, left_over(sim, before, theta))
    return most


@pytest.mark.parametrize("kind", ["tetra", "hexahedron", "hexahedron20"])
@pytest.mark.parametrize("density", [1.0, 1e-6, 1e-12])
def test_a_block_drawn_slowly_bears_the_stress_of_the_formula(kind, density):
    """Uniaxial tension of a light block, Poisson's ratio 0.3: a stretch of 1.5 has P = 0.378280 E and 0.880175 across."""
    sim = drawn(kind, density=density, theta=1.0)
    assert stepped(sim, 10, 1.0) < 1e-7
    view = sim.meshes[0]
    assert view.displacement[:, 0].max() == pytest.approx(1.0, rel=1e-12)
    assert 1 + view.displacement[:, 1].min() == pytest.approx(0.880175, abs=2e-6)
    for side, sign in (("right", 1), ("left", -1)):
        assert sim.meshes[0].reaction(side)[0] / 1e6 == pytest.approx(sign * 0.378280, rel=3e-6)


@pytest.mark.parametrize("clamped", [False, True])
@pytest.mark.parametrize("kind", ["quad", "tetra", "hexahedron"])
def test_blocks_of_any_size_density_and_stiffness_converge_in_steps_of_any_length(kind, clamped):
    wrong = {}
    for density, dt, young, size in itertools.product((1e-12, 1.0, 1e6), (1e-6, 1.0, 1e3), (1e3, 1e12), (1e-6, 1.0, 1e6)):
        sim = drawn(kind, young=young, density=density, size=size, dt=dt, share=0.01, clamped=clamped, counts=(2, 1, 1))
        try:
            most = stepped(sim, 3, 0.5)
        except (AssertionError, ValueError) as error:
            most = str(error)
        if isinstance(most, str) or most > 1e-7:
            wrong[density, dt, young, size] = most
    assert not wrong


def flying(density, dt, young, size, held, speed):
    """A block that moves by `speed` times its size in each step, no side or some led along."""
    points, cells = box("hexahedron", (2, 2, 2), size * LONG)
    body = SolidBody(points, cells, NeoHookean(young=young, poisson=0.3), density=density)
    near = 1e-9 * size
    body.groups.update(left=np.flatnonzero(points[:, 0] < near), right=np.flatnonzero(points[:, 0] > LONG[0] * size - near))
    velocity = speed * size / dt * np.array([0.6, -0.48, 0.64])
    scene = cn.Scene(dim=3)
    scene.add(cn.deformable(body, ROCK, velocity=velocity, drive={side: dict(zip("xyz", velocity)) for side in held}))
    return cn.Simulation(scene, dt=dt), velocity


@pytest.mark.parametrize("held", [(), ("left",), ("left", "right")])
def test_what_moves_as_a_whole_goes_on_so(held):
    """Without a force anywhere: light or heavy, soft or stiff, slow or fast against its waves, for a thousand of its sizes. A
    step that leaves nothing of a free body's mass beside its stiffness is refused."""
    wrong = {}
    for density, dt, young, size in itertools.product((1e-12, 1.0, 1e6), (1e-6, 1.0, 1e3), (1e3, 1e12), (1e-6, 1.0, 1e6)):
        lost = not held and density * size**2 / (young * dt**2) < 1e-14
        for speed in (1e-3, 1.0, 100.0):
            case = density, dt, young, size, speed
            sim, velocity = flying(density, dt, young, size, held, speed)
            try:
                for _ in range(10):
                    report = sim.step()
                    assert report["status"] == "converged" and report["newton_error"] <= TOLERANCE
                    assert report["newton_passes"] <= 3
            except ValueError as error:
                if not lost or not any(word in str(error) for word in ("is lost in rounding", "inside out")):
                    wrong[case] = str(error)
                continue
            except AssertionError as error:
                wrong[case] = str(error)
                continue
            off = np.abs(sim.meshes[0].velocity - velocity).max() / np.linalg.norm(velocity)
            if off > 1e-11 and not lost:
                wrong[case] = off
    assert not wrong


def test_a_block_that_flies_swings_as_one_at_rest():
    """Whose displacements are up to 4e8 times those of its swinging: what rounding leaves of these is all that differs."""
    ways = []
    for speed in (0.0, 1e3, 1e6, 1e8):
        sim, _ = flying(1e3, 1e-3, 1e6, 1.0, (), 1.0)
        view = sim.meshes[0]
        swing = 0.3 * (view.body.points - [1.0, 0.5, 0.5]) * [1.0, -1.0, 0.5]
        sim.nodes.set(velocity=swing + [speed, 0.0, 0.0])
        for _ in range(20):
            assert sim.step()["status"] == "converged"
        ways.append(sim.meshes[0].velocity - [speed, 0.0, 0.0])
    assert np.abs(ways[0] - swing).max() > 0.1
    for way, off in zip(ways[1:], (1e-10, 1e-7, 1e-5)):
        assert np.abs(way - ways[0]).max() < off * np.abs(ways[0]).max()
