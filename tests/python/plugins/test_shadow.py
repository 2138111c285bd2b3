"""A second kernel beside a stage: it changes nothing, finds what differs, and dumps the first step beyond the tolerance."""

import cairn as cn
import numpy as np
import pytest
from cairn import problems


def pile(dim=2, tol=1e-12, law=None):
    rng = np.random.default_rng(3)
    grid = np.stack(np.meshgrid(*[np.arange(3)] * dim, indexing="ij"), -1).reshape(-1, dim)
    centers = (grid + 0.5) * 0.2 + rng.uniform(0, 2e-3, grid.shape)
    rock = cn.Material("rock", density=2600.0)
    gravity = np.zeros(dim)
    gravity[0], gravity[-1] = 1.0, -9.81
    scene = cn.Scene(dim=dim, gravity=gravity)
    scene.add((cn.disks if dim == 2 else cn.spheres)(centers, 0.1, rock, force=np.full(dim, 3.0)))
    scene.add(cn.wall(np.zeros(dim), np.eye(dim)[-1], rock), cn.wall(np.zeros(dim), np.eye(dim)[0], rock))
    scene.interact(rock, rock, law or cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.NLGS(tol=tol, max_iter=20000)), overlap="ignore")


def go(sim, steps=30):
    for _ in range(steps):
        sim.step()
    return sim


@pytest.mark.parametrize("dim", [2, 3])
def test_references_agree_and_change_no_bit(dim, tmp_path):
    plain, watched = go(pile(dim)), pile(dim)
    shadows = [watched.shadow(stage, tol=1e-7, folder=tmp_path) for stage in
               ("solve_contacts", "compute_free_velocity", "predict_configuration", "update_configuration")]  # fmt: skip
    shadows.append(watched.shadow("solve_contacts", "nlgs", 1e-7, folder=tmp_path, name="solver"))
    go(watched)
    assert np.array_equal(plain.bodies.position, watched.bodies.position)
    assert np.array_equal(plain.bodies.velocity, watched.bodies.velocity)
    for s in shadows:
        assert len(s.records) == 30 and s.beyond is None and s.largest < 1e-7, s
    assert any(r[2] > 0 for r in shadows[0].records)  # another order of the same sums
    assert list(tmp_path.iterdir()) == []


def test_the_first_step_beyond_is_dumped_as_a_problem(tmp_path):
    sim = pile()

    def wrong_from_step_ten(s):
        r = s["problem"].solve("nlgs", tol=1e-12).r
        return r * (1.01 if sim.steps >= 10 else 1.0)

    shadow = sim.shadow("solve_contacts", wrong_from_step_ten, tol=1e-6, folder=tmp_path)
    go(sim, 15)
    assert shadow.beyond[0] == 11 and shadow.beyond[2] > 1e-4 and shadow.records[9][2] < 1e-6
    assert shadow.dump.name == "shadow_solve_contacts_000011.hdf5" and len(list(tmp_path.iterdir())) == 1
    again = problems.read(shadow.dump)
    assert again.solve("nlgs", tol=1e-10).converged
    assert "first beyond at step 11" in repr(shadow)


def test_other_stages_are_dumped_as_arrays(tmp_path):
    sim = pile()
    shadow = sim.shadow("compute_free_velocity", lambda s: s["velocity"], tol=1e-3, folder=tmp_path)
    go(sim, 2)
    assert shadow.beyond[0] == 1
    with np.load(shadow.dump) as stored:
        assert np.array_equal(stored["given_by_shadow"], stored["velocity"]) and float(stored["h"]) == 1e-3


def test_no_number_is_a_difference_and_a_wrong_shape_an_error(tmp_path):
    sim = pile()
    shadow = sim.shadow("update_configuration", lambda s: s["position"] * np.nan, tol=1.0, folder=tmp_path)
    go(sim, 1)
    assert shadow.beyond is not None and shadow.largest == np.inf
    other = pile()
    other.shadow("solve_contacts", lambda s: np.zeros(3), folder=tmp_path)
    with pytest.raises(ValueError, match="shape \\(3,\\): impulses .* were expected"):
        other.step()
    assert other.steps == 0


def test_wrong_calls_are_refused(tmp_path):
    sim = pile()
    for words, message in [
        ({"stage": "solve"}, "stages that can have a shadow are"),
        ({"stage": "solve_contacts", "kernel": "none"}, "kernel is 'none': give 'reference'"),
        ({"stage": "solve_contacts", "kernel": 3}, "or a function"),
        ({"stage": "solve_contacts", "tol": -1}, "tol is -1"),
    ]:
        with pytest.raises(ValueError, match=message):
            sim.shadow(**words)
    bonded = pile(law=cn.Bonded(mu=0.3))
    bonded.shadow("solve_contacts", folder=tmp_path)
    with pytest.raises(ValueError, match="its own local solution"):
        go(bonded, 5)


def test_problem_of_a_step_is_the_step(tmp_path):
    """Impulses of the step solve the problem that is taken out of it, to the step's own tolerance."""
    sim = go(pile(3, tol=1e-10))
    problem = sim.problem()
    r = sim.contacts.impulse_local
    assert problem.contacts == len(r)
    assert problem.error(r) < 1e-9 and problem.error(r * 1.001) > 1e-5
    assert np.allclose(problem.velocity(r)[:, 1:], sim.contacts.relative_velocity[:, 1:], atol=1e-12)


def test_the_plain_loop_of_contacts_refuses_meshes(tmp_path):
    points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    body = cn.ElasticBody(points, {"quad": [[0, 1, 2, 3]]}, young=1e6, poisson=0.3, density=1000.0)
    rock, scene = cn.Material("rock", density=1000.0), cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(cn.deformable(body, rock, contact=[0, 1]))
    scene.add(cn.wall((0, 0), (0, 1), rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3)
    sim.shadow("solve_contacts", folder=tmp_path)
    with pytest.raises(ValueError, match="the scene has meshes.*give kernel='nlgs'"):
        sim.step()
    other = cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.NLGS(tol=1e-12, max_iter=20000)))
    shadow = other.shadow("solve_contacts", "nlgs", 1e-6, folder=tmp_path)
    go(other, 5)
    assert shadow.beyond is None and len(shadow.records) == 5
