"""Files that one rank alone cannot write or read: all ranks are told, and none hangs."""

import json

import numpy as np
from over_mpi import needs_mpi, started, text

pytestmark = needs_mpi
COMMON = """
import json, os, pathlib, resource, signal
rank, told = sim.ranks.rank, {}
def attempt(name, call):
    try:
        call()
    except (ValueError, OSError) as error:
        told[name] = [type(error).__name__, str(error)]
"""
END = """
sim.step()  # goes on
np.savez(f"{rank}.npz", x=sim.bodies.position)
json.dump(told, open(f"{rank}.json", "w"))
"""


def told_by(folder, processes=2):
    ends = [np.load(folder / f"{rank}.npz")["x"] for rank in range(processes)]
    assert all(np.array_equal(ends[0], end) for end in ends)
    return [json.loads((folder / f"{rank}.json").read_text()) for rank in range(processes)]


WRITES = """
sim.run(2, progress=False)
attempt("checkpoint", lambda: sim.checkpoint("nowhere/a.checkpoint.h5"))
attempt("folder", lambda: sim.run(2, output="nowhere/a.vtkhdf", progress=False))
attempt("again", lambda: sim.run(2, output="nowhere/a.vtkhdf", progress=False))
sim.run(1, output="there.vtkhdf", progress=False)
attempt("exists", lambda: sim.run(2, output="there.vtkhdf", progress=False))
told["steps"] = sim.steps
"""


def test_a_file_that_cannot_be_written_is_told_to_all(tmp_path):
    started(tmp_path, text("mpi", COMMON + WRITES + END))
    for told in told_by(tmp_path):
        assert told.pop("steps") == 3  # no run began whose file was refused
        assert set(told) == {"checkpoint", "folder", "again", "exists"}
        assert all("FileError" in kind or kind == "MissingFile" for kind, _ in told.values()), told
        assert all("nowhere" in told[name][1] for name in ("checkpoint", "folder", "again"))
        assert "there.vtkhdf" in told["exists"][1]
    assert all("rank 0 of 2: " in text for _, text in told.values())  # as rank 1 tells it


GROWS = """
if rank == 0:  # a disk that has no more room
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, resource.RLIM_INFINITY))
attempt("output", lambda: sim.run(400, output="grows.vtkhdf", progress=False))
attempt("checkpoint", lambda: [sim.checkpoint(f"{k}.checkpoint.h5") for k in range(2)])
if rank == 0:
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)
told["steps"] = sim.steps
"""


def test_a_disk_that_is_full_ends_the_run_of_all(tmp_path):
    started(tmp_path, text("mpi", COMMON + GROWS + END))
    first, second = told_by(tmp_path)
    assert "output" in first and "output" in second
    assert first["steps"] == second["steps"] < 400
    assert "rank 0 of 2: " in second["output"][1]


READS = """
sim.run(2, progress=False)
sim.checkpoint("a.checkpoint.h5")
sim.run(1, progress=False)
sim.checkpoint("b.checkpoint.h5")
if rank == 0:
    whole = pathlib.Path("b.checkpoint.h5").read_bytes()
    pathlib.Path("c.checkpoint.h5").write_bytes(whole[:2000] + bytes(200) + whole[2200:])
sim.gather()
attempt("missing", lambda: sim.restore("none.checkpoint.h5"))
attempt("elsewhere", lambda: sim.restore("none.checkpoint.h5" if rank else "a.checkpoint.h5"))
attempt("other", lambda: sim.restore("b.checkpoint.h5" if rank else "a.checkpoint.h5"))
attempt("damaged", lambda: sim.restore("c.checkpoint.h5"))
before = sim.bodies.position.copy()
state = sim.get_state()
state["time"] = state["time"] + (0.5 if rank else 0.0)
attempt("state", lambda: sim.set_state(state))
take = sim._take
def taken(**made):
    del sim._take
    if rank == 1:
        raise RuntimeError("out of luck")
    take(**made)
sim._take = taken
attempt("taken", lambda: sim.restore("a.checkpoint.h5"))
assert np.array_equal(before, sim.bodies.position) and sim.steps == 3
sim.restore("a.checkpoint.h5")
assert sim.steps == 2
"""


def test_a_checkpoint_that_one_rank_cannot_read_changes_nothing_on_any(tmp_path):
    started(tmp_path, text("mpi", COMMON + READS + END))
    for told in told_by(tmp_path):
        assert set(told) == {"missing", "elsewhere", "other", "damaged", "state", "taken"}
        assert "none.checkpoint.h5" in told["missing"][1]
        for name, call in (("elsewhere", "restore"), ("other", "restore"), ("state", "set_state")):
            message = told[name][1]
            assert message.startswith(f"ranks were given unlike values for {call} (rank "), message
            assert "rank 0 gives " in message and "rank 1 gives " in message
        assert "file='cannot be read, FileNotFoundError'" in told["elsewhere"][1]
        assert told["other"][1].count("content='") == 2
        assert "out of luck" in told["taken"][1]
    assert "c.checkpoint.h5" in told["damaged"][1]


LONELY = """
import os
import cairn as cn
rank = int(os.environ["OMPI_COMM_WORLD_RANK"])
try:
    scene = cn.Scene.load("a.scene.h5" if rank == 0 else "none.scene.h5", ranks="mpi")
    sim = cn.Simulation(scene, dt=1e-3)
    sim.step()
except (OSError, ValueError) as error:
    open(f"{rank}.told", "w").write(f"{type(error).__name__} {str(error)}")
"""


def test_a_scene_that_one_rank_cannot_read_is_told_to_all(tmp_path):
    import cairn as cn

    rock = cn.Material("rock", density=2600.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.interact(rock, rock, cn.Coulomb(mu=0.4))
    scene.add(cn.disks([(0.0, 0.5), (1.5, 0.5)], 0.5, rock), cn.wall((0, 0), (0, 1), rock))
    scene.save(tmp_path / "a.scene.h5")
    started(tmp_path, LONELY)
    told = [(tmp_path / f"{rank}.told").read_text() for rank in range(2)]
    assert "rank 1 of 2: " in told[0] and all("FileError" in text and "none.scene.h5" in text for text in told)
