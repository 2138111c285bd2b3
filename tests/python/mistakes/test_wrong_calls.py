"""Calls that Python would take, or end in words of its own, are refused with the right call and the probable intention."""

import pickle

import cairn as cn
import numpy as np
import pytest
from cairn import names
from cairn.post import limit_analysis, plots
from small_scenes import ROCK, heap

XY = [[0.0, 0.0], [1.0, 0.0]]

VALUES = [
    (lambda: cn.Simulation(heap(), True), "dt is True: give a finite number"),
    (lambda: cn.Simulation(heap(), np.complex128(1e-3 + 1j)), r"dt is np.complex128.*: give a finite number"),
    (lambda: cn.Coulomb(mu=np.complex128(0.4 + 1j)), r"mu of Coulomb is np.complex128.*: give a number"),
    (lambda: cn.Coulomb(mu=True), "mu of Coulomb is True: give a number"),
    (lambda: cn.Coulomb(mu="0.4"), "mu of Coulomb is '0.4': give a number"),
    (lambda: cn.NLGS(max_iter=2**40), "max_iter is 1099511627776: give a whole number from 1 to 2147483647"),
    (lambda: cn.NLGS(tol=True), "tol is True: give a finite number"),
    (lambda: cn.NSCD(threads=2**70), "threads is 1180591620717411303424: give a whole number from 0 to 1024"),
    (lambda: cn.NSCD(renumber_every=2**40), "renumber_every is 1099511627776: give a whole number from 1 to"),
    (lambda: cn.SmoothDEM(threads=2**70), "threads is 1180591620717411303424: give a whole number"),
    (lambda: cn.NSCD(warm_start="no"), "warm_start is 'no': give True or False"),
    (lambda: cn.NSCD(project_positions=1), "project_positions is 1: give True or False"),
    (lambda: cn.NSCD(contact_point="surfac"), "contact_point is 'surfac': give 'middle' or 'surface'; did you mean 'surface'"),
    (lambda: cn.disks(XY, True, ROCK), "radii is True: give a finite number"),
    (lambda: cn.disks(XY, 0.5, ROCK, velocity=[1j, 0]), "velocity is not an array of real numbers: give"),
    (lambda: cn.disks(XY, 0.5, ROCK, damping=np.array([1j, 0])), "damping is not an array of real numbers: give"),
    (lambda: cn.Scene(2, gravity=[1j, 0]), "gravity is not an array of real numbers: give"),
    (lambda: cn.Scene(2, gravity=(True, False)), "gravity is not an array of real numbers: give"),
    (lambda: cn.Scene(2, origin=[1j, 0]), "origin is not an array of real numbers: give"),
    (lambda: cn.Scene(2, periodic=cn.Periodic((1j, 1))), "lengths of the periodic cell is not an array of real numbers"),
    (lambda: cn.Scene(True), r"dim is True: give 2 \(disks\) or 3"),
    (lambda: cn.problems.Problem(2, 1j * np.eye(2), [1, 0], 0.0), "W holds numbers of type complex128: give real numbers"),
    (lambda: cn.problems.Problem(2, np.eye(2), [1j, 0], 0.0), "q is not an array of real numbers: give real numbers"),
    (lambda: problem().solve(max_iter=2**70), "max_iter is 1180591620717411303424: give a whole number"),
    (lambda: problem().solve(threads=2**70), "threads is 1180591620717411303424: give a whole number"),
    (lambda: problem().solve("autp"), "there is no solver of problems 'autp'; there are auto, .*; did you mean 'auto'"),
]


def problem():
    return cn.problems.Problem(2, np.eye(2), [-1.0, 0.0], 0.1)


@pytest.mark.parametrize("k", range(len(VALUES)))
def test_values_that_python_would_take(k):
    call, words = VALUES[k]
    with pytest.raises(ValueError, match=words):
        call()


def sim():
    return cn.Simulation(heap(), 1e-3, overlap="ignore")


ARGUMENTS = [
    (lambda: cn.Coulomb(0.4), r"Coulomb takes its parameters by name, mu: give Coulomb\(mu=0.4\)"),
    (lambda: cn.Restitution(0.4, 0.5), r"give Restitution\(.*=0.4, .*=0.5\)"),
    (lambda: cn.NSCD(tehta=0.5), "NSCD has no argument 'tehta'; it has theta, solver, .*; did you mean 'theta'"),
    (lambda: cn.PPANewton(tolerance=1e-6), "PPANewton has no argument 'tolerance'; it has tol, .*; did you mean 'tol'"),
    (lambda: cn.disks(XY, 0.5, ROCK, velocty=(0, 0)), "disks has no argument 'velocty'; it has .*; did you mean 'velocity'"),
    (lambda: cn.boxes([[0, 0, 0]], 1, ROCK, fixd=True), "boxes has no argument 'fixd'; .*; did you mean 'fixed'"),
    (lambda: cn.wall((0, 0), (0, 1), ROCK, driven="vx"), "wall has no argument 'driven'; it has point, .*, group, damping"),
    (lambda: cn.disks(XY, 0.5), r"disks: missing a required argument: 'material'; the call is disks\(centers, radii, material, "),
    (lambda: cn.Scene(2, gravty=(0, 0)), "Scene has no argument 'gravty'; .*; did you mean 'gravity'"),
    (lambda: sim().run(stps=1), "Simulation.run has no argument 'stps'; it has steps, .*; did you mean 'steps'"),
    (lambda: sim().step(1e-3, 2), r"Simulation.step: too many positional arguments; the call is Simulation.step\(dt=None\)"),
    (lambda: cn.Material("x", densty=1.0), "Material has no argument 'densty'; it has name, density, .*; did you mean 'density'"),
    (lambda: cn.pre.masonry.arch(radus=1.0), "arch has no argument 'radus'; it has kind, radius, .*; did you mean 'radius'"),
    (lambda: cn.surface([], [], ROCK, velocty=1), "surface has no argument 'velocty'; .*; did you mean 'velocity'"),
    (lambda: plots.plot_step(None, waht="velocity"), "plot_step has no argument 'waht'; .*; did you mean 'what'"),
    (lambda: limit_analysis.bisect(bool, low=0, hihg=1), "bisect has no argument 'hihg'; it has .*; did you mean 'high'"),
    (lambda: problem().solve(max_iters=3), "Problem.solve has no argument 'max_iters'; .*; did you mean 'max_iter'"),
]


@pytest.mark.parametrize("k", range(len(ARGUMENTS)))
def test_arguments_that_do_not_fit(k):
    call, words = ARGUMENTS[k]
    with pytest.raises(TypeError, match=words):
        call()


def test_a_type_error_of_ones_own_stays():
    def wrong(t):
        return len(t)  # a number has no length

    scene = heap()
    scene.gravity = wrong
    with pytest.raises(TypeError, match="has no len"):
        cn.Simulation(scene, 1e-3, overlap="ignore").run(steps=1)


def test_functions_stay_what_they_were():
    assert pickle.loads(pickle.dumps(cn.disks)) is cn.disks
    assert cn.disks.__doc__.startswith("Disks in 2D") and cn.disks.__module__ == "cairn.model.bodies"
    assert cn.NSCD(theta=1.0) == cn.NSCD(theta=1.0)


def test_suggestions():
    assert names.nearest("Colomb", ["Coulomb", "Bonded"]) == "Coulomb"
    assert names.nearest("xyz", ["Coulomb", "Bonded"]) is None
    assert names.listed([], "x") == "none"
    with pytest.raises(AttributeError, match="did you mean 'Coulomb'"):
        _ = cn.Colomb
    with pytest.raises(ValueError, match="names 'belo', .*; there are below, rock, sand; did you mean 'below'"):
        sim().interact("belo", "rock", cn.Coulomb(mu=1))
    with pytest.raises(AttributeError, match="bodies have no array 'velocty'.*did you mean 'velocity'"):
        _ = sim().bodies.velocty
    with pytest.raises(ValueError, match="positon of bodies cannot be set: .*; did you mean 'position'"):
        sim().bodies.set(positon=1)
    with pytest.raises(ValueError, match="driven names 'vX': the dofs of a body are vx, vy, w; did you mean 'vx'"):
        cn.disks(XY, 0.5, ROCK, driven="vX")


# ---------------------------------------------------------------------- views


def test_arrays_of_a_simulation_are_read():
    s = sim()
    before = s.bodies.position
    for wrong in (
        lambda: setattr(s.bodies, "position", np.zeros((51, 2))),
        lambda: s.bodies.position.__setitem__(0, 1.0),
        lambda: s.bodies.position[3].__setitem__(0, 1.0),
        lambda: np.add(s.bodies.position, 1, out=s.bodies.position),
        lambda: np.add.at(s.bodies.position, 0, 1.0),
        lambda: s.bodies.position.fill(0.0),
        lambda: s.bodies.position.sort(axis=0),
        lambda: s.bodies.position.put(0, 1.0),
        lambda: s.bodies.position.T.__setitem__(0, 1.0),
        lambda: s.bodies.position.reshape(-1).__setitem__(0, 1.0),
        lambda: np.copyto(s.bodies.position, 0.0),
        lambda: np.put(s.bodies.position, 0, 1.0),
    ):
        with pytest.raises((ValueError, AttributeError), match=r"sim.bodies.set\(position=x\)"):
            wrong()
    with pytest.raises(ValueError, match=r"changes nothing: sim.bodies.set\(velocity=x\)"):
        s.bodies.velocity += 1.0
    with pytest.raises(AttributeError, match=r"mass cannot be assigned: sim.bodies.set\(...\) sets position, velocity and"):
        s.bodies.mass = 1.0
    with pytest.raises(AttributeError, match="gap cannot be assigned: contacts are what the last step found"):
        s.contacts.gap = 1.0
    with pytest.raises(AttributeError, match=r"position cannot be assigned: write into the array, sim.raw.position\[:\] = x"):
        s.raw.position = 1.0
    assert np.array_equal(s.bodies.position, before)


def test_libraries_that_ask_for_memory_to_write_to_take_them():
    """Cython's views of memory do so where they only read: scipy's rotations among them."""
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    scene = cn.Scene(3)
    scene.add(cn.boxes([[0, 0, 0], [3, 0, 0]], (1, 2, 3), ROCK, rotation=[[1, 1, 0, 0], [1, 0, 0, 0]]))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    bodies = cn.Simulation(scene, 1e-3).bodies
    turned = rotation.from_quat(bodies.rotation, scalar_first=True).as_matrix()
    assert turned[0] == pytest.approx(np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]))
    assert len(rotation.from_rotvec(bodies.velocity[:, 3:])) == 2 and memoryview(bodies.position).readonly is False
    some = bodies.position[bodies.position[:, 0] > 1]
    some[0] = 7.0  # a copy of some rows is the user's own
    assert some[0, 0] == 7.0 and bodies.position[1, 0] == 3.0


def test_what_is_computed_from_them_is_plain():
    s = sim()
    x = s.bodies.position
    for mine in (x.copy(), x + 0, np.array(x), pickle.loads(pickle.dumps(x)), np.sqrt(x * x)):
        assert type(mine) is np.ndarray and mine.flags.writeable
    assert repr(x[:1]).startswith("array(")
    mine = x.copy()
    mine[0] += 1.0
    s.bodies.set(position=mine)
    assert np.array_equal(s.bodies.position, mine)
    s.raw.position[:] = np.array(s.raw.position)
    assert np.array_equal(s.bodies.position, mine)


# ---------------------------------------------------------------------- materials, limit analysis


def test_two_materials_of_one_name():
    a, b = cn.Material("x", density=1.0), cn.Material("x", density=2.0)
    scene = cn.Scene(2)
    scene.add(cn.disks([[0, 0]], 0.4, a))
    for add in (scene.add, cn.Simulation(scene, 1e-3).add):
        with pytest.raises(ValueError, match="two materials are named 'x', of densities 1 and 2: give them different names"):
            add(cn.disks([[2, 0]], 0.4, b))
        add(cn.disks([[4, 0]], 0.4, cn.Material("x", density=1.0)))
        add(cn.disks([[6, 0]], 0.4, cn.Material("x"), density=3.0))
        with pytest.raises(ValueError, match="two materials are named 'x'"):
            add(cn.disks([[2, 0]], 0.4, b))
    assert scene.count == 3


def test_what_cannot_stand_is_false():
    pytest.importorskip("scipy")
    from cairn.post.limit_analysis import Assembly

    thick, thin = (cn.pre.masonry.arch(radius=10.0, thickness=t, voussoirs=21) for t in (2.0, 0.2))
    assert Assembly(thick, 0.7).stands() and Assembly(thick, 0.7).stands().status == "optimal"
    assert not Assembly(thin, 0.7).stands() and Assembly(thin, 0.7).stands().status == "infeasible"
