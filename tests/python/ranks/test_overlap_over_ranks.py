"""Overlap beyond a limit over ranks: taken back as without them, to the same bits for every number."""

import cairn as cn
import numpy as np
import pytest
from test_mesh_ranks import on_a_plate
from test_ranks import ROCK, closed, digest, grid, new

LIMIT = 0.005
STRATEGY = cn.NSCD(solver=cn.NLGS(tol=1e-4), overlap=LIMIT)


def overlapped(dim, **options):
    """Balls that overlap by some percent of their radii."""
    scene = new(dim, **options)
    x, rng = grid(7 if dim == 2 else 4, dim, 0.93, 1)
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, rng.uniform(0.44, 0.48, len(x)), ROCK))
    return closed(scene, 8.0)


def blocks():
    """Courses of blocks that overlap, some under a plate that is driven."""
    scene = new(2)
    square = np.array([(0, 0), (1, 0), (1, 0.5), (0, 0.5)])
    scene.add(cn.polygons([square + (1.02 * k + 0.3 * (row % 2) + 0.1, 0.485 * row) for row in range(4) for k in range(6)], ROCK))
    scene.add(cn.polygons([np.array([(1.0, 1.99), (4.0, 1.99), (4.0, 2.2), (1.0, 2.2)])], ROCK, driven=("vx", "vy", "w")))
    return closed(scene, 8.0)


def in_a_cell(speed=0.3):
    scene = cn.Scene(dim=2, periodic=cn.Periodic((6.5, 6.5)))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.4))
    x, rng = grid(7, 2, 6.5 / 7, 3, shift=0.08)
    scene.add(cn.disks(x, rng.uniform(0.40, 0.45, len(x)), ROCK, velocity=speed * rng.normal(0, 1, x.shape)))
    return scene


def on_a_mesh():
    """Grains on a body that deforms; one of them overlaps a wall."""
    scene = on_a_plate(2)
    scene.add(cn.disks([(0.4, 6.0)], 0.48, ROCK))
    return scene


SCENES = {
    "plane": lambda: overlapped(2),
    "space": lambda: overlapped(3),
    "blocks": blocks,
    "cell": in_a_cell,
    "on a mesh": on_a_mesh,
}


def start(scene, ranks, strategy=STRATEGY, **more):
    return cn.Simulation(scene(), dt=2e-3, strategy=strategy, overlap="ignore", ranks=ranks, **more)


def run(scene, ranks, steps, sim=None, **more):
    sim = sim or start(scene, ranks, **more)
    for _ in range(steps):
        sim.step()
    return sim


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_the_same_bits_for_every_number_of_ranks(scene, tmp_path):
    sims = [run(scene, ranks, 15) for ranks in (1, 2, 3, 4, 7)]
    assert len({digest(sim) for sim in sims}) == 1
    falls = any(sims[0].scene.gravity)  # work is that of weight
    assert (sims[0].energy["work_projection"] != 0) == falls
    sim, path = run(scene, 3, 5), tmp_path / "deep.checkpoint.h5"
    for ranks in (5, 1):
        sim.checkpoint(path)
        sim = start(scene, ranks)
        sim.restore(path)
        run(scene, ranks, 5, sim)
    assert digest(sim) == digest(sims[0])


def test_ghosts_move_with_their_owners():
    """Between the steps of a run whose state nobody reads they are told displacements alone."""
    sims = [start(in_a_cell, ranks) for ranks in (1, 3, 5, 7)]
    for sim in sims:
        sim.run(80, progress=False)
    assert len({digest(sim) for sim in sims}) == 1


@pytest.mark.parametrize("scene", [SCENES[name] for name in ("plane", "space", "blocks", "cell")])
def test_overlap_is_taken_back_as_without_ranks(scene):
    over, alone, stays = run(scene, 3, 40), run(scene, None, 40), run(scene, 3, 40, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-4)))
    assert stays.info["penetration"] > 4 * LIMIT  # nothing but the limit takes it back
    for sim in (over, alone):
        assert sim.info["penetration"] < 0.5 * stays.info["penetration"]
    assert over.info["drift"] <= 1.2 * alone.info["drift"] + 0.2 * LIMIT
    lift = abs(alone.energy["work_projection"])
    assert abs(over.energy["work_projection"] - alone.energy["work_projection"]) <= 0.2 * lift + 1e-9 * alone.energy["in_play"]


def test_no_body_gains_speed():
    sims = [run(lambda: in_a_cell(speed=0.0), 3, steps) for steps in (1, 40)]
    assert sims[0].info["penetration"] > 4 * LIMIT > 2 * sims[1].info["penetration"]
    assert np.abs(sims[1].bodies.velocity).max() == 0


@pytest.mark.parametrize(
    ("strategy", "options"),
    [(cn.NSCD(solver=cn.Auto(tol=1e-4, enough=1e-3), overlap=LIMIT), {}), (STRATEGY, {"exchange": "sweep"})],
)
def test_what_does_not_run_over_ranks_is_refused(strategy, options):
    with pytest.raises(ValueError, match="overlap is limited, to 0.005.*, beside .*, which does not run over ranks"):
        start(SCENES["plane"], 2, strategy, **options)


def test_a_refusal_tells_small_limits():
    with pytest.raises(ValueError, match="overlap is limited, to 1e-08, beside one exchange a sweep"):
        start(SCENES["plane"], 2, cn.NSCD(solver=cn.NLGS(tol=1e-4), overlap=1e-8), exchange="sweep")


@pytest.mark.parametrize(("exchange", "advised"), [("colour", True), ("sweep", False)])
def test_a_warning_advises_what_the_exchange_takes(exchange, advised):
    with pytest.warns(cn.OverlapWarning, match="shrink the radii") as told:
        sim = cn.Simulation(SCENES["plane"](), dt=2e-3, strategy=cn.NSCD(solver=cn.NLGS()), ranks=2, exchange=exchange)
        sim.step()
        sim.add(cn.disks([sim.bodies.position[0] + 0.01], 0.4, ROCK))
        sim.step()
    texts = [str(w.message) for w in told if "overlap" in str(w.message)]
    assert len(texts) == 2 and all(("NSCD(overlap=...)" in text) == advised for text in texts)
