"""Simulations that are made and dropped, and bodies that come in and go, leave nothing behind."""

import gc
import os
import resource
import weakref

import cairn as cn
from small_scenes import ROCK, heap

MANY = 1000 if os.environ.get("CAIRN_FULL") else 100


def test_a_dropped_simulation_is_gone_at_once():
    gc.disable()  # a cycle would wait for the collector
    try:
        sim = cn.Simulation(heap(2), 1e-3, overlap="ignore")
        sim.run(steps=2, progress=False)
        assert len(sim.bodies.position) == len(sim.bodies) and len(sim.contacts.gap) >= 0 and sim.info and sim.stages.due is None
        gone = weakref.ref(sim)
        del sim
        assert gone() is None
    finally:
        gc.enable()


def test_simulations_made_and_dropped_leave_no_memory():
    def peak():
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024

    gc.disable()
    try:
        for k in range(MANY):
            cn.Simulation(heap(2, counts=(30, 20)), 1e-3, overlap="ignore").step()
            if k == MANY // 4:
                before = peak()
        assert peak() - before < 8e6  # one of them has more than a megabyte
    finally:
        gc.enable()


def test_sets_whose_bodies_are_gone_are_let_go(tmp_path):
    sim, path, sizes = cn.Simulation(heap(2), 1e-3, overlap="ignore"), tmp_path / "a.checkpoint.h5", []
    for k in range(60):
        ids = sim.add(cn.disks([[20.0, 20.0 + k]], 0.4, ROCK, velocity=[[0.0, 0.0, 0.0]]))
        sim.drive([0], ["vx"], [0.1 * k, 0.0, 0.0])
        sim.step()
        sim.remove(ids)
        sim.checkpoint(path)
        sizes.append(path.stat().st_size)
    assert len(sim._sets) - sim._sets_seen == 1  # the last drive
    assert sizes[-1] < 1.1 * sizes[5]


def test_what_is_left_of_a_set_that_lost_some_bodies_is_driven_on(tmp_path):
    sims = [cn.Simulation(heap(2), 1e-3, overlap="ignore") for _ in range(2)]
    for sim in sims:
        ids = sim.add(cn.disks([[20.0, 20.0], [22.0, 20.0]], 0.4, ROCK, driven=["vx"], drive=cn.Harmonic([1.0, 0.0, 0.0], 10.0)))
        sim.remove(ids[:1])
        sim.step()
    path = tmp_path / "a.checkpoint.h5"
    sims[0].checkpoint(path)
    fresh = cn.Simulation(heap(2), 1e-3, overlap="ignore")
    fresh.restore(path)
    for _ in range(5):
        sims[0].step(), sims[1].step(), fresh.step()
    assert fresh.bodies.velocity.tobytes() == sims[0].bodies.velocity.tobytes() == sims[1].bodies.velocity.tobytes()
