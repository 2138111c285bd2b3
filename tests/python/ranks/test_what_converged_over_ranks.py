"""A step over ranks is called converged by the rules of a step without, to the same bits for every number of ranks."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2500.0)
STEP, GRAVITY = 1e-3, 9.81


def ends(make, steps, ranks=(1, 3)):
    """The last steps over ranks, and their infos, after a comparison of bits."""
    found = []
    for count in ranks:
        sim = make(count)
        infos = [sim.step() for _ in range(steps)]
        found.append((sim, infos))
    alike = [[{k: v for k, v in info.items() if k != "hint"} for info in infos] for _, infos in found]  # it has their number
    bits = {(sim.bodies.velocity.tobytes(), sim.contacts.impulse.tobytes(), str(told)) for (sim, _), told in zip(found, alike)}
    assert len(bits) == 1
    return found[0]


@pytest.mark.filterwarnings("ignore::cairn.SceneWarning", "ignore::cairn.EnergyCreatedWarning")
@pytest.mark.parametrize("size", [1e-9, 1e6])
@pytest.mark.parametrize("disks", [1, 12])
@pytest.mark.parametrize("solver", [None, cn.NLGS(tol=1e-6, max_iter=20000), cn.PPANewton()])
def test_disks_between_walls_that_close_are_no_steps_that_converged(solver, disks, size):
    """No motion obeys the law: impulses grow until the error beside them is as small as asked."""

    def make(ranks):
        scene = cn.Scene(2)
        scene.add(cn.disks([[2.5 * size * k, 0] for k in range(disks)], size, ROCK))
        for side, speed in ((-1, 0.0), (1, -3.0 * size)):
            scene.add(cn.wall((0, size * side), (0, -side), ROCK, velocity=(0, speed, 0)))
        scene.interact("*", "*", cn.Coulomb(mu=0.5))
        return cn.Simulation(scene, STEP, cn.NSCD(**({} if solver is None else {"solver": solver})), ranks=ranks)

    _, infos = ends(make, 10)
    assert all(info["status"] == "iteration_limit" for info in infos)
    if solver is None:
        assert all("no motion obeys bodies that are squeezed" in info["hint"] for info in infos)


def test_what_jams_between_held_walls_has_converged():
    def make(ranks):
        scene = cn.Scene(2, gravity=(0, -GRAVITY))
        scene.add(cn.disks([[0, 0.1 + 0.2 * k] for k in range(100)], 0.1, ROCK))
        scene.add(cn.wall((0, 0), (0, 1), ROCK), cn.wall((-0.1, 0), (1, 0), ROCK), cn.wall((0.1, 0), (-1, 0), ROCK))
        scene.interact("*", "*", cn.Coulomb(mu=0.5))
        return cn.Simulation(scene, STEP, overlap="ignore", ranks=ranks)

    _, infos = ends(make, 4)
    assert all(info["status"] == "converged" for info in infos)


@pytest.mark.parametrize("solver", [cn.Auto, cn.NLGS])
@pytest.mark.parametrize("dim", [2, 3])
def test_velocities_are_right_where_bonds_converged(dim, solver):
    """Impulses of a solid of bonds are in balance with each other: beside these any error of velocities is small."""
    places = 0.02 * np.array([[i, j, 0] for i in range(50) for j in range(2)], float)[:, :dim]
    velocity = np.zeros((len(places), 3 if dim == 2 else 6))
    velocity[:2, 1] = 1.0

    def make(ranks, by=solver):
        tol = 1e-10 if ranks is None else 1e-4
        scene = cn.Scene(dim)
        scene.add((cn.disks if dim == 2 else cn.spheres)(places, 0.01, ROCK, velocity=velocity))
        scene.interact("*", "*", cn.Bonded())
        return cn.Simulation(scene, STEP, cn.NSCD(solver=by(tol=tol, max_iter=20000)), overlap="ignore", ranks=ranks)

    exact = make(None, cn.Auto)
    exact.step()
    sim, infos = ends(make, 1)
    assert infos[0]["status"] == exact.info["status"] == "converged"
    of = exact.bodies.velocity[:, :dim]
    assert np.linalg.norm(sim.bodies.velocity[:, :dim] - of) < 0.05 * np.linalg.norm(of)


def clamped(count, solver, ranks):
    radius = 0.05
    place = np.column_stack([2 * radius * np.arange(count), np.zeros(count)])
    scene = cn.Scene(2, gravity=(0.0, -GRAVITY))
    scene.add(cn.disks(place[:1], radius, ROCK, driven=("vx", "vy", "w")), cn.disks(place[1:], radius, ROCK))
    scene.interact("*", "*", cn.Bonded(mu=0.3))
    return cn.Simulation(scene, STEP, cn.NSCD(solver=solver), ranks=ranks)


@pytest.mark.parametrize("tol", [1e-3, 1e-4])
def test_a_clamped_row_of_bonds_stands_where_its_steps_converged(tol):
    """Each bond misses little, and the end of the row falls by the sum: the last pass of Newton's method tells it."""
    sim, infos = ends(lambda ranks: clamped(200, cn.Auto(tol=tol), ranks), 10)
    assert all(info["status"] == "converged" for info in infos)
    assert np.abs(sim.bodies.velocity[:, :2]).max() < 10 * tol * GRAVITY * STEP


@pytest.mark.filterwarnings("ignore::cairn.EnergyCreatedWarning")
def test_velocities_that_rounding_hides_are_told():
    """Impulses known to 16 digits leave the velocities of 5,000 disks in a row unknown."""
    _, infos = ends(lambda ranks: clamped(5000, cn.Auto(), ranks), 1)
    assert infos[0]["status"] == "iteration_limit" and "velocities are not known to be as exact" in infos[0]["hint"]
    assert infos[0]["velocity_error"] > 1e-4 >= infos[0]["error"]


def test_an_accuracy_beyond_rounding_is_told_as_without_ranks():
    def make(ranks):
        scene = cn.Scene(2, gravity=(0.0, -GRAVITY))
        scene.add(cn.disks([(i + 0.5 * (j % 2), 0.5 + 0.87 * j) for j in range(6) for i in range(6)], 0.5, ROCK))
        scene.add(cn.wall((0, 0), (0, 1), ROCK), cn.wall((-0.5, 0), (1, 0), ROCK), cn.wall((6, 0), (-1, 0), ROCK))
        scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
        return cn.Simulation(scene, STEP, cn.NSCD(accuracy=1e-9), ranks=ranks)

    alone = make(None)
    for _ in range(3):
        alone.step()
    _, infos = ends(make, 3)
    why = alone.info["hint"].partition("iterations, and ")[2]
    assert "more iterations change nothing" in why and infos[-1]["hint"].endswith(why)
    assert infos[-1]["status"] == alone.info["status"] == "iteration_limit"


def test_a_solver_that_gives_up_tells_why():
    def make(ranks):
        scene = cn.Scene(2, gravity=(0, -GRAVITY))
        scene.add(cn.disks([(1.2 * k, 0.5) for k in range(12)], 0.5, ROCK), cn.wall((0, 0), (0, 1), ROCK))
        scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.4))
        return cn.Simulation(scene, STEP, cn.NSCD(solver=cn.Enumeration()), ranks=ranks)

    alone = make(None)
    alone.step()
    _, infos = ends(make, 1)
    assert infos[0]["status"] == alone.info["status"] == "iteration_limit"
    why = alone.info["hint"].partition(": ")[2]
    assert "too many states" in why and infos[0]["hint"].endswith(why)


@pytest.mark.parametrize("dim, wanted", [(2, 800), (3, 800)])
def test_sweeps_of_balls_stay_extrapolated(dim, wanted):
    """They were damped after 128 sweeps, as those of dense packs that end early: 2,200 and 2,400 sweeps where 400 do."""
    rng = np.random.default_rng(7)
    count, width = (800, 0.4) if dim == 2 else (600, 0.117)
    radii = rng.uniform(0.005, 0.01, count)
    places = cn.pre.deposit_disks(radii, width) if dim == 2 else cn.pre.deposit_spheres(radii, (width, width))

    def make(ranks):
        scene = cn.Scene(dim, gravity=-GRAVITY * np.eye(dim)[-1])
        scene.add((cn.disks if dim == 2 else cn.spheres)(places, radii, ROCK))
        scene.add(cn.box(np.zeros(dim), np.r_[[width] * (dim - 1), 2 * width], ROCK, lid=False))
        scene.interact("*", "*", cn.Coulomb(mu=0.4))
        strategy = cn.NSCD(solver=cn.NLGS(tol=1e-6, max_iter=5000))
        return cn.Simulation(scene, 5e-4, strategy, overlap="ignore", ranks=ranks)

    _, infos = ends(make, 15)
    assert all(info["status"] == "converged" for info in infos)
    assert sum(info["iterations"] for info in infos) < wanted
