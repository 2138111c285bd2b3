"""Calls that not all processes of ranks make: each ends by an error with the call and the ranks, and none hangs."""

import json

import cairn as cn
import numpy as np
import pytest
from over_mpi import here, needs_mpi, started, text

pytestmark = needs_mpi

ALONE = """
import json
rank, told = sim.ranks.rank, {}
sim.run(3, progress=False)
disk = cn.disks([(4.0, 12.0)], 0.45, rock)
calls = {
    "checkpoint": lambda: sim.checkpoint("alone.checkpoint.h5"),
    "get_state": sim.get_state,
    "add": lambda: sim.add(disk),
    "remove": lambda: sim.remove([3]),
    "drive": lambda: sim.drive([5], "x", 0.0),
    "bodies.set": lambda: sim.bodies.set(velocity=0.0 * sim.bodies.velocity),
    "interact": lambda: sim.interact(rock, rock, cn.Coulomb(mu=0.1)),
    "gather": sim.gather,
    "run": lambda: sim.run(2, progress=False),
    "dt": lambda: setattr(sim, "dt", 1e-3),
    "restore": lambda: sim.restore("none.h5"),
    "simulation": lambda: cn.Simulation(scene, dt=1e-3, ranks="mpi", overlap="ignore"),
}
for name, call in calls.items():
    before = sim.steps
    try:
        call() if rank == 1 else sim.step()
    except ValueError as error:
        told[name] = str(error)
    assert sim.steps == before, name
told["unlike add"] = ""
try:
    sim.add(cn.disks([(4.0, 12.0 + rank)], 0.45, rock))
except ValueError as error:
    told["unlike add"] = str(error)
sim.step()  # goes on: all ranks refused the same calls
sim.bodies.position
json.dump(told, open(f"{rank}.json", "w"))
"""


def test_a_call_of_one_rank_alone_is_refused_on_all(tmp_path):
    started(tmp_path, text("mpi", ALONE), processes=3)
    for rank in range(3):
        told = json.loads((tmp_path / f"{rank}.json").read_text())
        assert len(told) == 13, told.keys()
        assert "unlike values for add" in told.pop("unlike add")
        for name, message in told.items():
            assert f"rank 1 makes {name}" in message and "ranks 0, 2 make step" in message, message
            assert message.startswith("ranks make unlike calls: ranks 0, 2 make step, rank 1 makes "), message


@pytest.mark.parametrize("ending", ["", "import sys; sys.exit()\n"])
def test_a_rank_that_has_ended_is_told(tmp_path, ending):
    more = "sim.run(2, progress=False)\nif sim.ranks.first:\n    sim.run(2, progress=False)\n    print('went on')\n" + ending
    out, errors = started(tmp_path, text("mpi", more), expect=1)
    assert "ranks make unlike calls: rank 0 makes run, rank 1 ends its program; " in errors and "went on" not in out


READ = """
rows = []
def look(s):
    if s.ranks.rank == 1 and s.steps % 2:
        rows.append(np.r_[len(s.contacts), s.contacts.impulse.sum(axis=0), s.contacts.gap.min()])
sim.run(6, callback=look, progress=False)
for _ in range(2):
    sim.step()
    look(sim)
if sim.ranks.rank == 1:  # the other one waits at its end
    np.savez("read.npz", rows=rows, impulse=sim.contacts.impulse, key=sim.contacts.key, x=sim.bodies.position)
"""


def test_contacts_of_all_ranks_are_read_by_one_alone(tmp_path):
    started(tmp_path, text("mpi", READ))
    read, sim = np.load(tmp_path / "read.npz"), here(0)
    rows = []
    for _ in range(8):
        sim.step()
        if sim.steps % 2:
            rows.append(np.r_[len(sim.contacts), sim.contacts.impulse.sum(axis=0), sim.contacts.gap.min()])
    assert len(rows) == 4 and np.array_equal(read["rows"], rows)
    assert np.array_equal(read["impulse"], sim.contacts.impulse) and np.array_equal(read["key"], sim.contacts.key)
    assert np.array_equal(read["x"], sim.bodies.position)


PROBES = """
probes = {"touching": lambda s: len(s.contacts), "push": cn.Probe(lambda s: float(s.contacts.impulse[:, 1].max()), every=2),
          "force": cn.Probe("contact_force.y", of=[64], take="sum")}
sim.run(6, output=NAME, every=3, probes=probes, progress=False)
"""


def test_probes_read_contacts_of_all_ranks(tmp_path):
    started(tmp_path, text("mpi", PROBES.replace("NAME", "'mpi.vtkhdf'")), processes=3)
    exec(text(2, PROBES.replace("NAME", repr(str(tmp_path / "here.vtkhdf")))), {})
    over, own = cn.load(tmp_path / "mpi.vtkhdf"), cn.load(tmp_path / "here.vtkhdf")
    for name in ("touching", "push", "force"):
        assert np.array_equal(over.history[name], own.history[name], equal_nan=True), name
    assert np.all(own.history["touching"] > 0)


def test_a_simulation_that_one_rank_has_no_more_is_told(tmp_path):
    more = """
import gc
sim.run(3, progress=False)
if sim.ranks.rank == 1:
    del sim
    gc.collect()
else:
    sim.contacts.impulse
"""
    _, errors = started(tmp_path, text("mpi", more), expect=1)
    assert "rank 0 of 2 reads a simulation that another rank has no more" in errors
