"""Ranks that are processes of MPI: bits, files and errors are those of ranks in one process."""

import os
import sys
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn.base.open_ranks import library
from over_mpi import STARTER, here, needs_mpi, started, text

pytestmark = needs_mpi


def test_bits_and_files_over_processes(tmp_path):
    more = """
sim.run(30, output="mpi.vtkhdf", every=10, checkpoint_every=20, progress=False)
sim.checkpoint("end.checkpoint.h5")
sim.gather()
if sim.ranks.first:
    np.savez("end.npz", x=sim.bodies.position, v=sim.bodies.velocity, key=sim.contacts.key, impulse=sim.contacts.impulse)
assert len(sim.contacts) > 20 and sim.ranks.count == 2 and sim.ranks.figures()["messages"] > 0
"""
    started(tmp_path, text("mpi", more))
    sim, end = here(30), np.load(tmp_path / "end.npz")
    assert np.array_equal(end["x"], sim.bodies.position) and np.array_equal(end["v"], sim.bodies.velocity)
    assert np.array_equal(end["key"], sim.contacts.key) and np.array_equal(end["impulse"], sim.contacts.impulse)
    run = cn.load(tmp_path / "mpi.vtkhdf")
    assert len(run) == 4 and np.array_equal(run[-1].contacts.impulse, sim.contacts.impulse)
    for _ in range(10):
        sim.step()
    other = here(0)
    other.restore(tmp_path / "end.checkpoint.h5")
    for _ in range(10):
        other.step()
    assert np.array_equal(other.bodies.velocity, sim.bodies.velocity)


def test_the_command_runs_a_script_over_processes(tmp_path):
    words = [sys.executable, "-m", "cairn", "run", "pile.py", "--ranks", "2"]
    more = "sim.run(3, progress=False)\nopen(f'{sim.ranks.kind}{sim.ranks.rank}', 'w').close()\n"
    started(tmp_path, text(None, more), words=words)
    assert (tmp_path / "mpi0").exists() and (tmp_path / "mpi1").exists()


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("if sim.ranks.rank == 1: raise RuntimeError('out of luck')\n", "rank 1 of 2"),
        ("sim._core.assign_body('force', np.where(np.arange(66)[:, None] == 60, 1e308, np.zeros((66, 3))))\n", "rank "),
        ("import os\nif sim.ranks.rank == 1: os._exit(7)\n", ""),
    ],
)
def test_a_fault_of_one_process_ends_all(tmp_path, fault, told):
    more = "sim.run(3, progress=False)\n" + fault + "sim.run(20, progress=False)\nprint('went on')\n"
    out, errors = started(tmp_path, text("mpi", more), expect=1)
    assert told in errors and "went on" not in out
    if told == "rank 1 of 2":
        assert errors.count("out of luck") == 2  # the line of the script, and the message


def test_a_folder_without_room_ends_all(tmp_path):
    out, errors = started(tmp_path, text("mpi", "sim.run(5, output='nowhere/mpi.vtkhdf', progress=False)\n"), expect=1)
    assert "nowhere" in errors and "rank 0 of 2" in errors


@pytest.mark.parametrize("program", ["pile_over_ranks", "pile_over_ranks_fortran"])
def test_programs_of_c_and_fortran_give_their_communicator(tmp_path, program):
    path = Path(os.environ.get("CAIRN_BUILD", "build/release")).resolve() / "programs" / program
    if not path.exists():
        pytest.skip(f"{path} was not built")
    told = []
    for processes in (1, 3):
        words = [STARTER, "--oversubscribe", "-n", str(processes), str(path), library()]
        out, _ = started(tmp_path, "", words=words)
        words = out.split()
        assert words[:3] == ["ranks", str(processes), "contacts"] and int(words[3]) > 10
        told.append(words[3:])
    assert told[0] == told[1]  # to the last bit


MESH = """
import sys
import cairn as cn, numpy as np
rock = cn.Material("rock", density=2600.0)
scene = cn.Scene(dim=2, gravity=(-3.0, -9.81))
scene.interact(rock, rock, cn.Coulomb(mu=0.4))
x, y = np.meshgrid(np.linspace(0, 8, 9), np.linspace(0, 1, 3), indexing="ij")
points, k = np.stack([x, y], -1).reshape(-1, 2), np.arange(27).reshape(9, 3)
quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)
body = cn.SolidBody(points, {"quad": quads}, cn.NeoHookean(young=2e6, poisson=0.3), density=1200.0, groups={"low": k[:, 0]})
scene.add(cn.deformable(body, rock, contact=k.ravel(), edges=k.ravel(), fixed={"low": "xy"}))
x = np.stack(np.meshgrid(np.arange(8), np.arange(3)), -1).reshape(-1, 2) * 0.98 + (0.6, 1.5)
scene.add(cn.disks(x, 0.48, rock), cn.wall((0, 0), (1, 0), rock))
sim = cn.Simulation(scene, dt=4e-3, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-5)), overlap="ignore", ranks=RANKS)
"""


def test_meshes_are_whole_in_each_process(tmp_path):
    more = """
for k in range(20):
    sim.step()
    if k == 9:
        sim.checkpoint("half.checkpoint.h5")
sim.gather()
np.savez(f"{sim.ranks.rank}.npz", x=sim.nodes.position, v=sim.nodes.velocity, stress=sim.meshes[0].stress["quad"],
         energy=list(sim.energy.values()), impulse=sim.contacts.impulse)
"""
    started(tmp_path, MESH.replace("RANKS", "'mpi'") + more, processes=3)
    names = {}
    exec(MESH.replace("RANKS", "2") + "sim.restore(" + repr(str(tmp_path / "half.checkpoint.h5")) + ")", names)
    sim = names["sim"]
    for _ in range(10):
        sim.step()
    assert len(sim.contacts) > 10
    wanted = {"x": sim.nodes.position, "v": sim.nodes.velocity, "stress": sim.meshes[0].stress["quad"]}
    wanted |= {"energy": list(sim.energy.values()), "impulse": sim.contacts.impulse}
    for rank in range(3):
        end = np.load(tmp_path / f"{rank}.npz")
        assert all(np.array_equal(end[name], of) for name, of in wanted.items())


@pytest.mark.parametrize(("change", "first", "second"), [
    ("rng.uniform(0.42, 0.48, 64)", "bodies='66 of mark ", "bodies='66 of mark "), ("dt=4e-3", "dt=0.004", "dt=0.008)"),
    ("mu=0.4", "laws=[('rock', 'rock', Coulomb(mu=0.4))]", "laws=[('rock', 'rock', Coulomb(mu=0.8))]"),
    ("tol=1e-6", "strategy=NSCD(solver=NLGS(tol=1e-06", "strategy=NSCD(solver=NLGS(tol=2e-06"),
])  # fmt: skip
def test_ranks_with_unlike_scenes_are_refused(tmp_path, change, first, second):
    """A script that gives values of its own to each rank: without a seed, by a clock, by its number."""
    rank = 'import os; rank = int(os.environ["OMPI_COMM_WORLD_RANK"])\n'
    value, _, number = change.rpartition("=") if "=" in change else (change, "", "")
    unlike = f"{value}={number} * (1 + rank)" if number else f"({value} + 1e-3 * rank)"
    _, said = started(tmp_path, rank + text("mpi", "").replace(change, unlike, 1), expect=1)
    told = said[said.rindex("ranks were given unlike values for the simulation (rank 0 gives ") :].partition(", rank 1 gives ")
    assert first in told[0] and second in told[2] and "unlike simulations" not in said, said


def test_one_rank_ends_the_run_of_all(tmp_path):
    more = """
import os
rank = int(os.environ["OMPI_COMM_WORLD_RANK"])
sim.run(50, while_=lambda s: s.steps < 4 + 3 * rank, progress=False)
ended = sim.steps
sim.run(50, callback=lambda s: s.steps < 8 + rank, progress=False)
open(f"{rank}.txt", "w").write(f"{ended} {sim.steps}")
sim.run(5 + rank, progress=False)
"""
    _, said = started(tmp_path, text("mpi", more), expect=1)
    assert [(tmp_path / f"{rank}.txt").read_text() for rank in (0, 1)] == ["4 8", "4 8"]
    assert "ranks were given unlike values for the run (rank 0 gives steps=5, rank 1 gives steps=6): every process" in said
