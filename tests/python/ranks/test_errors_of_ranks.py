"""Errors of one rank, and arguments that ranks give unlike: each ends the call on all ranks by one message, and none hangs."""

import json

import cairn as cn
import numpy as np
import pytest
from cairn.run.compared import call_of, file_told, state_told
from over_mpi import here, needs_mpi, started, text

COMMON = """
import json
rank, told = sim.ranks.rank, {}
def attempt(name, call):
    before = sim.steps, sim.time
    try:
        call()
    except ValueError as error:
        told[name] = str(error)
    assert (sim.steps, sim.time) == before, name
"""
END = """
sim.step()  # goes on: all ranks failed alike
np.savez(f"{rank}.npz", x=sim.bodies.position)
json.dump(told, open(f"{rank}.json", "w"))
"""


def told_by(folder, processes):
    return [json.loads((folder / f"{rank}.json").read_text()) for rank in range(processes)]


FUNCTIONS = """
def gravity(t):
    if fails and rank == 1:
        raise RuntimeError("out of luck")
    return (-6.0, -9.81)
sim.scene.gravity = gravity
fails = True
attempt("step", sim.step)
attempt("run", lambda: sim.run(3, progress=False))
fails = False
def look(s):
    if rank == 1:
        raise KeyError("callback")
attempt("while", lambda: sim.run(3, while_=lambda s: 1 / (1 - rank) > 0, progress=False))
probe = {"mean": lambda s: 1 / 0}
sim.step()
before = sim.steps
try:
    sim.run(3, callback=look, progress=False)
except ValueError as error:
    told["callback"] = str(error)
assert sim.steps == before + 1  # it is called after the step
try:
    sim.run(3, probes=probe, output="probe.vtkhdf", progress=False)
except (ValueError, ZeroDivisionError) as error:
    told["probe"] = str(error)
"""


@needs_mpi
def test_an_error_of_a_users_function_on_one_rank_is_one_of_all(tmp_path):
    started(tmp_path, text("mpi", COMMON + FUNCTIONS + END), processes=3)
    for told in told_by(tmp_path, 3):
        assert told["step"] == told["run"] == "rank 1 of 3: RuntimeError: out of luck"
        assert told["while"] == "rank 1 of 3: ZeroDivisionError: division by zero"
        assert told["callback"] == "rank 1 of 3: KeyError: 'callback'"
        assert told["probe"] == "rank 0 of 3: ZeroDivisionError: division by zero"  # the first one writes
    ends = [np.load(tmp_path / f"{rank}.npz")["x"] for rank in range(3)]
    assert np.array_equal(ends[0], ends[1]) and np.array_equal(ends[0], ends[2])


@needs_mpi
@pytest.mark.parametrize("where", ["gravity", "callback"])
def test_such_an_error_that_nobody_catches_ends_all_with_one_message(tmp_path, where):
    more = """
def fails(*_):
    if sim.steps == 4 and sim.ranks.rank == 1:
        raise RuntimeError("out of luck")
    return (-6.0, -9.81)
"""
    more += "sim.scene.gravity = fails\n" if where == "gravity" else ""
    more += f"sim.run(20, callback={'fails' if where == 'callback' else None}, progress=False)\nprint('went on')\n"
    out, errors = started(tmp_path, text("mpi", more), expect=1)
    assert "went on" not in out and errors.count("rank 1 of 2: RuntimeError: out of luck") == 1
    assert errors.count("Traceback") == 2  # the error of the function, and that of all ranks, by rank 1 alone
    assert "in fails" in errors


@needs_mpi
def test_an_error_after_another_rank_has_ended_does_not_hang(tmp_path):
    more = """
if sim.ranks.rank == 1:
    sim.scene.gravity = lambda t: 1 / 0
    for _ in range(2):
        try:
            sim.step()
        except ValueError as error:
            print(error)
        sim.scene.gravity = (-6.0, -9.81)
"""
    out, _ = started(tmp_path, text("mpi", more))
    assert "rank 1 of 2: ZeroDivisionError: division by zero" in out
    assert "makes the call step after another rank has ended its program" in out


def test_an_error_of_a_users_function_undoes_nothing_that_was_done_over_ranks_of_one_process():
    sim, other = here(3), here(3)

    def gravity(t):
        raise RuntimeError("out of luck")

    given, sim.scene.gravity = sim.scene.gravity, gravity
    with pytest.raises(RuntimeError, match="out of luck"):
        sim.step()
    sim.scene.gravity = given
    sim.step()
    other.step()
    assert np.array_equal(sim.bodies.velocity, other.bodies.velocity) and sim.steps == other.steps


UNLIKE = """
v = 0.25 * (rank == 2)
calls = {
    "drive": lambda: sim.drive([5], "vx", v),
    "interact": lambda: sim.interact(rock, rock, cn.Coulomb(mu=0.3 + v)),
    "grow": lambda: sim.grow([5], 1.0 + v),
    "remove": lambda: sim.remove([3 + (rank == 2)]),
    "join": lambda: sim.join(5, None, cn.Pivot(point=(4.0 + v, 12.0))),
    "bodies.set": lambda: sim.bodies.set(velocity=sim.bodies.velocity + v),
    "add": lambda: sim.add(cn.disks([(4.0, 12.0 + v)], 0.45, rock)),
    "strategy": lambda: setattr(sim, "strategy", cn.NSCD(solver=cn.NLGS(tol=1e-6 + v))),
    "table": lambda: sim.grow([5], cn.Table([0.0, 1.0], [0.0, v])),
    "expression": lambda: sim.drive([5], "vx", cn.Expression(f"{v} + t")),
}
for name, call in calls.items():
    attempt(name, call)
attempt("dt", lambda: sim.step(1e-3 + 1e-4 * (rank == 2)))
given = sim.scene.gravity
sim.scene.gravity = (-6.0, -9.0 - v)
attempt("gravity", sim.step)
sim.scene.gravity = given
rules = list(sim.scene.rules)
sim.scene.interact(rock, rock, cn.Coulomb(mu=0.2 + v))
attempt("scene", sim.step)
sim.scene.rules[:] = rules
sim.drive([5], "vx", 0.5)  # alike
sim.drive([6], "vx", lambda t: v)  # of functions ranks compare no values
sim.drive([6], (), None)
sim.grow([7], 0.5)
"""


@needs_mpi
def test_unlike_arguments_are_refused_with_ranks_and_values(tmp_path):
    started(tmp_path, text("mpi", COMMON + UNLIKE + END), processes=3)
    names = {"table": "grow", "expression": "drive", "dt": "step", "gravity": "step", "scene": "scene.interact"}
    for told in told_by(tmp_path, 3):
        assert len(told) == 13, told.keys()
        for name, message in told.items():
            start = f"ranks were given unlike values for {names.get(name, name)} ("
            assert message.startswith(start) and "ranks 0, 1 give " in message and "rank 2 gives " in message, message
        assert "rank 2 gives ids=[5], dofs='vx', velocity=0.25" in told["drive"]
        assert "ids=[5], rate=1.0)" in told["grow"] or "ids=[5], rate=1.0," in told["grow"]
        assert "mu=0.3" in told["interact"] and "mu=0.55" in told["interact"]
        assert "dt=0.0011000000000000001" in told["dt"] and "-9.25" in told["gravity"]
        assert "66 x 3 numbers (" in told["bodies.set"]
    ends = [np.load(tmp_path / f"{rank}.npz")["x"] for rank in range(3)]
    assert np.array_equal(ends[0], ends[1]) and np.array_equal(ends[0], ends[2])


def test_digests_of_states_and_files_differ_where_they_do(tmp_path):
    state = here(2).get_state()
    other = {**state, "scene": {**state["scene"], "bodies": dict(state["scene"]["bodies"])}}
    assert state_told(state) == state_told(other) and state_told(state)["state"] != state_told({})["state"]
    moved = np.array(state["scene"]["bodies"]["position"])
    moved.flat[-1] = np.nextafter(moved.flat[-1], 9.0)
    other["scene"]["bodies"]["position"] = moved
    assert state_told(state) != state_told(other)
    for name, content in (("a", b"x" * 10), ("b", b"x" * 10), ("c", b"x" * 9 + b"y")):
        (tmp_path / name).write_bytes(content)
    a, b, c, none = (file_told(tmp_path / name) for name in "abcd")
    assert a == b and a != c and a["bytes"] == c["bytes"] and "FileNotFoundError" in none["file"]


def test_texts_of_calls_differ_where_values_do():
    def call(value):
        return call_of("call", {"value": value})

    alike = [(1, 1.0), ([1, 2], np.array([1.0, 2.0])), (cn.Coulomb(mu=0.4), cn.Coulomb(mu=0.4)), (None, None)]
    alike += [(cn.Harmonic(1.0, 2.0), cn.Harmonic(1.0, 2.0)), ({"xx": 1.0}, {"xx": 1.0})]
    alike += [({1: 2.0, "b": 1.0}, {"b": 1.0, 1: 2.0}), (np.array(["a", None]), np.array([chr(97), None]))]
    alike += [(cn.Ball(point=[0.0, 0.0, 1.0]), cn.Ball(point=[0.0, 0.0, 1.0]))]
    unlike = [(1.0, np.nextafter(1.0, 2)), ([1, 2], [2, 1]), (cn.Coulomb(mu=0.4), cn.Coulomb(mu=0.5)), (None, 0.0)]
    unlike += [(cn.Harmonic(1.0, 2.0), cn.Harmonic(1.0, 3.0)), ({"xx": 1.0}, {"yy": 1.0}), (np.nan, 0.0), ("vx", "vy")]
    unlike += [(np.zeros((2, 3)), np.zeros((3, 2))), (True, False), (["a", ["b", "c"]], [["a", "b"], "c"])]
    unlike += [(10**30, 10**30 + 1), (np.array(["a", None]), np.array(["b", None]))]
    unlike += [(cn.Ball(point=np.array([0.0, 0.0, 1.0])), cn.Ball(point=np.array([0.0, 0.0, 1.0 + 1e-12])))]
    digests = [[call(v).split("\n")[2] for v in pair] for pair in alike]
    assert all(one == other for one, other in digests)
    for one, other in unlike:
        assert call(one).split("\n")[2] != call(other).split("\n")[2], (one, other)
    assert all(call(v).count("\n") == 2 for pair in alike for v in pair)
    assert call(np.nan) == call(np.nan) and len(call(np.zeros(10**5))) < 200


RESHAPED = """
from cairn.pre import mesh
block = np.array([(20.0, 5.0), (21.0, 5.0), (21.0, 6.0), (20.0, 6.0)])
with_block = cn.Scene(dim=2, gravity=(0.0, -9.81))
with_block.interact(rock, rock, cn.Coulomb(mu=0.4))
with_block.add(cn.polygons([block], rock), cn.disks([(0.0, 0.5), (3.0, 0.5)], 0.5, rock), cn.wall((0, 0), (0, 1), rock))
sim = cn.Simulation(with_block, 1e-3, cn.NSCD(solver=cn.NLGS(tol=1e-6)), overlap="ignore", ranks="mpi")
def body(young):
    return cn.ElasticBody(block, {"quad": [[0, 1, 2, 3]]}, young=young, poisson=0.2, density=2600.0)
other = rank == 2
attempt("deform", lambda: sim.deform(0, body(1e9 + other)))
attempt("options", lambda: sim.deform(0, body(1e9), name="b" if other else "a"))
attempt("reshape_when", lambda: sim.reshape_when([0], body(1e9), force=1e3 + other))
attempt("back", lambda: sim.reshape_when([0], {0: body(1e9 + other)}, force=1e3))
sim.reshape_when([0], body(1e9), force=1e12)  # alike
view = sim.deform(0, body(1e9))
sim.step()
attempt("rigidify", lambda: sim.rigidify(view, cn.polygons([block + 0.1 * other], rock)))
sim.rigidify(view)
"""


@needs_mpi
def test_unlike_meshes_and_shapes_are_refused(tmp_path):
    started(tmp_path, text("mpi", COMMON + RESHAPED + END), processes=3)
    for told in told_by(tmp_path, 3):
        assert set(told) == {"deform", "options", "reshape_when", "back", "rigidify"}, told
        for name, message in told.items():
            call = {"options": "deform", "back": "reshape_when"}.get(name, name)
            assert message.startswith(f"ranks were given unlike values for {call} ("), message
            assert "ranks 0, 1 give " in message and "rank 2 gives " in message
        assert "body=ElasticBody (" in told["deform"] and "name" in told["options"]
        assert "force=1001.0" in told["reshape_when"]


SPRINGS = """
import sys, os, json
import cairn as cn, numpy as np
rank, told = int(os.environ["OMPI_COMM_WORLD_RANK"]), []
rock = cn.Material("rock", density=2600.0)
calls = {"left": -1}
def forces(at):
    calls["left"] -= 1
    if calls["left"] == 0 and rank == 1:
        raise RuntimeError("out of luck")
    u, f, k = at.displacement, np.zeros((4, 2)), np.zeros((4, 2, 4, 2))
    for i, j in ((0, 1), (1, 2), (2, 3)):
        d = u[j] - u[i]
        push, stiffness = 4e4 * d + 4e6 * d**3, np.diag(4e4 + 12e6 * d**2)
        f[i] -= push
        f[j] += push
        for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            k[a, :, b, :] += sign * stiffness
    return f, k.reshape(8, 8)
points = np.array([(0.0, 1.0), (1.0, 1.0), (2.0, 1.0), (3.0, 1.0)])
body = cn.CallbackBody(points, np.full(4, 50.0), forces, groups={"end": [0]})
scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
scene.interact(rock, rock, cn.Coulomb(mu=0.3))
scene.add(cn.deformable(body, rock, contact=[1, 2, 3], fixed={"end": "xy"}))
scene.add(cn.disks([(1.0 + 1.01 * k, 0.45) for k in range(3)], 0.5, rock), cn.wall((0, -0.1), (0, 1), rock))
sim = cn.Simulation(scene, 4e-3, cn.NSCD(solver=cn.NLGS(tol=1e-6)), overlap="ignore", ranks="mpi")
sim.run(5, progress=False)
for count in range(1, 7):
    calls["left"], before = count, sim.steps
    try:
        sim.step()
    except ValueError as error:
        told.append(str(error))
        assert sim.steps == before
    calls["left"] = -1
    sim.step()
np.savez(f"{rank}.npz", x=sim.nodes.position)
json.dump(told, open(f"{rank}.json", "w"))
"""


@needs_mpi
def test_an_error_of_a_mesh_within_a_step_on_one_rank_is_one_of_all(tmp_path):
    """In the free motion, or in a pass of Newton's method, where other ranks wait for contacts."""
    started(tmp_path, SPRINGS)
    told = told_by(tmp_path, 2)
    assert told[0] == told[1] and len(told[0]) >= 2, told
    assert all(message.startswith("rank 1 of 2: ") and "out of luck" in message for message in told[0]), told
    assert np.array_equal(*(np.load(tmp_path / f"{rank}.npz")["x"] for rank in (0, 1)))


OPERATOR = """
import sys, os, json
import cairn as cn, numpy as np
from scipy.sparse.linalg import LinearOperator
rank, told, calls = int(os.environ["OMPI_COMM_WORLD_RANK"]), [], {"left": -1}
def product(x):
    calls["left"] -= 1
    if calls["left"] == 0:
        raise RuntimeError("out of luck")
    return 4e4 * x
def solver(h, theta, held):
    return lambda b: b / (50.0 + (h * theta) ** 2 * 4e4)
rock = cn.Material("rock", density=2600.0)
points = np.array([(0.0, 1.0), (1.0, 1.0), (2.0, 1.0), (3.0, 1.0)])
body = cn.LinearBody(points, 50.0 * np.eye(8), LinearOperator((8, 8), product, dtype=float), groups={"end": [0]}, solver=solver)
scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
scene.interact(rock, rock, cn.Coulomb(mu=0.3))
scene.add(cn.deformable(body, rock, contact=[1, 2, 3], fixed={"end": "xy"}))
scene.add(cn.disks([(1.0 + 1.01 * k, 0.45) for k in range(3)], 0.5, rock), cn.wall((0, -0.1), (0, 1), rock))
sim = cn.Simulation(scene, 4e-3, cn.NSCD(solver=cn.NLGS(tol=1e-6)), overlap="ignore", ranks="mpi")
sim.run(3, progress=False)
for count in range(1, 4):
    calls["left"] = count
    try:
        sim.step()
    except (ValueError, RuntimeError) as error:
        told.append(str(error))
    calls["left"] = -1
    sim.step()
json.dump(told, open(f"{rank}.json", "w"))
"""


@needs_mpi
def test_an_error_of_a_mesh_that_all_ranks_raise_alike_is_an_exception_of_each(tmp_path):
    """Where no rank waits for another one, as in the energy of a step; it does not end the processes."""
    started(tmp_path, OPERATOR)
    told = told_by(tmp_path, 2)
    assert len(told[0]) == len(told[1]) >= 2, told
    assert all("out of luck" in message for of_rank in told for message in of_rank), told


LIQUID = """
import os
import cairn as cn
rank = int(os.environ.get("OMPI_COMM_WORLD_RANK") or os.environ.get("PMI_RANK"))
rock = cn.Material("rock", density=2600.0, capacity=400.0, conductivity=1.0)
def told(**options):
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0), (1, 0), rock), cn.wall((1, 0), (-1, 0), rock))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    slip, initial = options.pop("slip", cn.NoSlip()), options.pop("initial", 300.0)
    scene.add(cn.fluid([(0, 0), (1, 0.4)], **{"spacing": 0.1, "density": 1000.0, **options}))
    scene.interact("fluid", rock, slip)
    scene.thermal(conductance=cn.networks.Constant(conductance=0.1), initial=initial)
    try:
        cn.Simulation(scene, dt=2e-3, ranks="mpi", overlap="ignore")
    except ValueError as error:
        return str(error)
found = [told(viscosity=0.1 * rank), told(velocity=(0.1 * rank, 0.0)), told(slip=None if rank else cn.FreeSlip()),
         told(spacing=0.1 + 0.02 * rank), told(initial=300.0 + rank)]
assert told() is None
print(*found, sep="\\n", flush=True) if rank == 0 else None
"""


def test_unlike_liquids_and_networks_are_refused(tmp_path):
    out, _ = started(tmp_path, LIQUID)
    names = ("viscosity of the liquid=0.0", "velocity of the liquid", "rules of the liquid", "spacing of the liquid", "thermal")
    for name, message in zip(names, out.strip().splitlines(), strict=True):
        assert message.startswith("ranks were given unlike values for the simulation (rank 0 gives ") and name in message, message
