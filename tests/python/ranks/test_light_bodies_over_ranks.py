"""Light bodies under heavy ones over ranks: the light error has its closed form, and no step that lets them fall converged."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2400.0)
SQUARE = np.array([(-0.5, -0.25), (0.5, -0.25), (0.5, 0.25), (-0.5, 0.25)])


def scene_of(*sets):
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(*sets, cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.4))
    return scene


def tower(ratio):
    light = cn.polygons([SQUARE + (0, 0.25 + 0.5 * k) for k in range(5)], ROCK)
    return scene_of(light, cn.polygons([SQUARE + (0, 2.75)], ROCK, density=2400.0 * ratio))


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("sweeps", [3, 5, 50])
def test_two_disks_have_the_light_error_of_their_speeds(sweeps, ranks):
    """Contacts break the law by their closing speeds u, where v_free = -g h of both."""
    scene = scene_of(cn.disks([[0, 0.5]], 0.5, ROCK), cn.disks([[0, 1.5]], 0.5, ROCK, density=2400e4))
    strategy = cn.NSCD(solver=cn.NLGS(tol=1e-12, max_iter=sweeps))
    sim = cn.Simulation(scene, 1e-3, strategy, ranks=ranks)
    sim.step()
    v, mass = np.array(sim.bodies.velocity[:2, 1]), np.array(sim.bodies.mass[:2])
    impulse = {tuple(sorted(pair)): abs(r[1]) for pair, r in zip(np.array(sim.contacts.bodies).tolist(), sim.contacts.impulse)}
    impulse = np.array([impulse[0, 2], impulse[0, 1]])
    speed, change = np.abs([v[0], v[1] - v[0]]), np.abs(v + 9.81e-3)
    energy = np.sum(mass * change**2)
    each = speed / max(change[0], np.sqrt(energy / mass.sum()))
    due = max(np.sqrt(np.mean(each**2)), impulse @ speed / energy, each.max() * min(each.max(), 1.0))
    assert sim.info["light_error"] == pytest.approx(due, rel=1e-9) and due > 1


@pytest.mark.parametrize("ratio", [1e6, 1e9])
def test_no_step_that_lets_a_heavy_block_sink_is_called_converged(ratio):
    found = []
    for ranks in (1, 3):
        sim = cn.Simulation(tower(ratio), 1e-3, cn.NSCD(solver=cn.NLGS(tol=1e-4)), ranks=ranks)
        hidden = 0  # steps in which the error of the whole does not tell
        for _ in range(6):
            before = sim.bodies.position[5, 1]
            sim.step()
            sinks = before - sim.bodies.position[5, 1] > 1e-2 * 9.81e-6
            assert sim.info["status"] == "iteration_limit" if sinks else sim.info["light_error"] < 1
            if sinks and sim.info["error"] < 1e-4:
                hidden += 1
                assert "light bodies under heavy ones are not solved" in sim.info["hint"]
        assert hidden > 0
        found.append((sim.info["light_error"], sim.info["iterations"], sim.bodies.position.tobytes()))
    assert found[0] == found[1]


def test_even_masses_have_no_light_error():
    sim = cn.Simulation(tower(1.0), 1e-3, cn.NSCD(solver=cn.NLGS(tol=1e-6)), ranks=2)
    sim.step()
    assert sim.info["light_error"] == 0.0 and sim.info["status"] == "converged"
