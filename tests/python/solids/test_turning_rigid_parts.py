"""Rigid parts of solids that turn far: order of methods that keep accelerations, shape through impacts and steps that fail."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2500.0)
SPIN, DRIFT, WEIGHT = 4.0, np.array([0.3, 0.0]), np.array([0.0, -3.0])
KEEPING = [cn.Newmark(), cn.HHT(alpha=-0.1), cn.HHT(alpha=-0.3), cn.GeneralisedAlpha(spectral_radius=0.5)]


def grid(counts, size):
    """Points and cells of a box."""
    axes = [np.linspace(0, s, c + 1) for c, s in zip(counts, size, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(counts))
    n = np.arange(len(points)).reshape([c + 1 for c in counts])
    low, high = slice(None, -1), slice(1, None)
    round_ = [(low, low), (high, low), (high, high), (low, high)]
    if len(counts) == 2:
        return points, {"quad": np.stack([n[c] for c in round_], -1).reshape(-1, 4)}
    return points, {"hexahedron": np.stack([n[(*c, z)] for z in (low, high) for c in round_], -1).reshape(-1, 8)}


def thrown(integrator, dt, whole, end=0.4, lumped=False):
    """Displacements and velocities of a bar that spins and falls, with a rigid end or rigid as a whole; the points."""
    points, cells = grid((4, 2), (2.0, 0.5))
    groups = {"end": np.flatnonzero(points[:, 0] > (-1 if whole else 1.4))}
    rubber = cn.NeoHookean(young=2e4, poisson=0.3)
    body = cn.SolidBody(points, cells, rubber, density=1000.0, groups=groups, lumped=lumped)
    x = points - points.mean(axis=0)
    scene = cn.Scene(dim=2, gravity=tuple(WEIGHT))
    velocity = np.stack([-SPIN * x[:, 1], SPIN * x[:, 0]], -1) + DRIFT
    scene.add(cn.deformable(body, ROCK, rigid="end", velocity=velocity))
    sim = cn.Simulation(scene, dt, cn.NSCD(integrator=integrator, newton_tol=1e-10, newton_passes=40))
    for _ in range(round(end / dt)):
        assert sim.step()["status"] == "converged"
    assert abs(sim.info["energy"]["closure"]) < 1e-9 * sim.info["energy"]["in_play"]
    return np.array(sim.meshes[0].displacement), np.array(sim.meshes[0].velocity), points


@pytest.mark.parametrize("lumped", [False, True])
@pytest.mark.parametrize("integrator", KEEPING, ids=repr)
def test_a_rigid_mesh_spins_and_falls_to_second_order(integrator, lumped):
    """Against the closed form: a steady spin about a middle that flies a parabola."""
    end, errors = 0.4, []
    for dt in (0.02, 0.01, 0.005):
        u, v, points = thrown(integrator, dt, True, end, lumped)
        x = points - points.mean(axis=0)
        c, s = np.cos(SPIN * end), np.sin(SPIN * end)
        turned = x @ np.array([[c, s], [-s, c]])
        place = points.mean(axis=0) + DRIFT * end + WEIGHT * end**2 / 2 + turned
        speed = DRIFT + WEIGHT * end + SPIN * np.stack([-turned[:, 1], turned[:, 0]], -1)
        errors.append([np.abs(points + u - place).max(), np.abs(v - speed).max()])
    assert np.min(np.divide(errors[:-1], errors[1:])) > 3.7
    assert errors[-1][0] < 1e-4 * 2.0 and errors[-1][1] < 1e-4 * SPIN


@pytest.mark.parametrize("integrator", KEEPING, ids=repr)
def test_a_bar_with_a_rigid_end_spins_and_falls_to_second_order(integrator):
    """Against short steps of a method that keeps nothing."""
    exact = thrown(cn.DiscreteGradient(), 0.4 / 1280, False)
    errors = []
    for dt in (0.01, 0.005, 0.0025):
        found = thrown(integrator, dt, False)
        errors.append([np.abs(found[k] - exact[k]).max() for k in (0, 1)])
    assert np.min(np.divide(errors[:-1], errors[1:])[:, 0]) > 3.7
    assert np.min(np.divide(errors[-2], errors[-1])) > 3.5


def struck(integrator, dt=2e-3, **options):
    """A block in space with a rigid foot that tumbles on a plane; the distances of the nodes of its foot."""
    points, cells = grid((2, 2, 4), (0.5, 0.5, 1.0))
    foot = np.flatnonzero(points[:, 2] < 0.3)
    body = cn.SolidBody(points, cells, cn.NeoHookean(young=1e5, poisson=0.3), density=1000.0, groups={"foot": foot})
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -9.81))
    velocity = np.cross([3.0, -5.0, 8.0], points - points.mean(axis=0))
    scene.add(cn.deformable(body, ROCK, velocity=velocity, rigid="foot", contact=np.arange(len(points))))
    scene.add(cn.wall((0, 0, -0.2), (0, 0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    options = {"newton_tol": 1e-10, "newton_passes": 40, "solver": cn.NLGS(tol=1e-12, max_iter=5000)} | options
    sim = cn.Simulation(scene, dt, cn.NSCD(integrator=integrator, **options))

    def apart():
        x = (points + sim.meshes[0].displacement)[foot]
        return np.linalg.norm(x[:, None] - x[None], axis=2)

    return sim, apart


@pytest.mark.parametrize("integrator", [cn.Theta(theta=0.7), *KEEPING], ids=repr)
def test_rigid_parts_stay_rigid_through_impacts(integrator):
    """Impulses move nodes beside the way that stresses see, by methods that keep more than half of the end: whole as well."""
    sim, apart = struck(integrator)
    first, touched = apart(), 0
    for _ in range(200):
        report = sim.step()
        touched += report["contacts"] > 0
        assert report["status"] == "converged"
    energy = sim.info["energy"]
    assert touched > 20 and np.abs(apart() - first).max() < 1e-13 * first.max()
    assert abs(energy["closure"]) < 1e-10 * energy["in_play"]


def test_newmark_moves_rigid_parts_as_the_theta_method_does():
    one, other = (struck(integrator)[0] for integrator in (cn.Newmark(), cn.Theta(theta=0.5)))
    for _ in range(100):
        assert one.step()["contacts"] == other.step()["contacts"]
    a, b = (np.asarray(sim.meshes[0].displacement) for sim in (one, other))
    assert one.contacts.force.any() and np.abs(a - b).max() < 1e-8 * np.abs(b).max()


@pytest.mark.parametrize("integrator", [cn.Theta(theta=0.5), *KEEPING, cn.DiscreteGradient()], ids=repr)
def test_rigid_parts_stay_rigid_where_passes_run_out(integrator):
    """A step that ends before its balance is found moves rigid parts whole all the same, and the next ones go on from there."""
    sim, apart = struck(integrator, dt=4e-3, newton_passes=1, newton_tol=1e-13)
    first, turned = apart(), np.array(sim.meshes[0].displacement)
    for _ in range(100):
        assert sim.step()["status"] == "newton_limit"
        assert np.abs(apart() - first).max() < 1e-13 * first.max()
    assert np.abs(sim.meshes[0].displacement - turned).max() > 0.3 * first.max()


def test_a_step_that_no_cut_mends_leaves_rigid_parts_as_they_were():
    sim, apart = struck(cn.HHT(alpha=-0.1), dt=4e-3, newton_passes=2, newton_tol=1e-15, cut_back=2)
    sim.strategy = cn.NSCD(integrator=cn.HHT(alpha=-0.1), newton_tol=1e-10, newton_passes=40)
    for _ in range(60):
        sim.step()
    before = [np.array(x) for x in (sim.meshes[0].displacement, sim.meshes[0].velocity, apart())]
    sim.strategy = cn.NSCD(integrator=cn.HHT(alpha=-0.1), newton_passes=1, newton_tol=1e-15, cut_back=2)
    with pytest.raises(ValueError, match="halved the step as often"):
        sim.step()
    for old, new in zip(before, (sim.meshes[0].displacement, sim.meshes[0].velocity, apart()), strict=True):
        assert np.array_equal(old, new)


def test_methods_that_let_velocities_of_rigid_parts_grow_are_told():
    with pytest.raises(ValueError, match="beta of gamma/2 or more"):
        thrown(cn.Newmark(beta=0.2, gamma=0.5), 0.01, False)


@pytest.mark.parametrize("integrator", [cn.Newmark(), cn.HHT(alpha=-0.1), cn.GeneralisedAlpha(spectral_radius=0.5)], ids=repr)
def test_a_restart_after_impacts_has_the_same_bits(integrator, tmp_path):
    """The response of a rigid part to impulses is recomputed in its present position, as after a restart."""
    first, second = (struck(integrator)[0] for _ in range(2))
    steps, seen = 0, 0
    while seen < 3 and steps < 400:
        seen += first.step()["contacts"] > 0
        steps += 1
    assert seen == 3
    first.checkpoint(tmp_path / "state.h5")
    second.restore(tmp_path / "state.h5")
    for _ in range(30):
        first.step()
        second.step()
    for one, two in zip(first.meshes, second.meshes, strict=True):
        np.testing.assert_array_equal(one.displacement, two.displacement)
        np.testing.assert_array_equal(one.velocity, two.velocity)
