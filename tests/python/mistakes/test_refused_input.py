"""Every wrong input is refused by a message that names field, index, value and remedy, and nothing half-built stays."""

import copy
import re
import warnings

import cairn as cn
import numpy as np
import pytest
from small_scenes import ROCK, SAND, differing, heap, state

NAN, INF = np.nan, np.inf
XY, XYZ = [[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]


def at(value, array, *index):
    array = np.array(array, float)
    array[index] = value
    return array


# call, and its message: field, index, value; remedy
REFUSED = [
    # sets of bodies
    (lambda: cn.disks(at(NAN, XY, 1, 0), 0.5, ROCK), r"centers\[1, 0\] is nan: give finite numbers"),
    (lambda: cn.spheres(at(INF, XYZ, 0, 2), 0.5, ROCK), r"centers\[0, 2\] is inf: give finite numbers"),
    (lambda: cn.disks([[0, 0, 0]], 0.5, ROCK), r"centers has shape \(1, 3\): give shape \(n, 2\)"),
    (lambda: cn.spheres(XY, 0.5, ROCK), r"centers has shape \(2, 2\): give shape \(n, 3\)"),
    (lambda: cn.disks("here", 0.5, ROCK), r"centers is not an array of real numbers: give"),
    (lambda: cn.disks(np.array(XY, complex), 0.5, ROCK), r"centers is not an array of real numbers"),
    (lambda: cn.disks([[0, 0], [1]], 0.5, ROCK), r"centers is not an array of real numbers"),
    (lambda: cn.disks(XY, [0.5, 0.0], ROCK), r"radii\[1\] is 0.0: give numbers > 0"),
    (lambda: cn.disks(XY, [-0.5, 1.0], ROCK), r"radii\[0\] is -0.5: give numbers > 0"),
    (lambda: cn.spheres(XYZ, -1.0, ROCK), r"radii is -1.0: give a number > 0"),
    (lambda: cn.disks(XY, [0.5, NAN], ROCK), r"radii\[1\] is nan: give finite numbers"),
    (lambda: cn.disks(XY, [0.5] * 3, ROCK), r"radii has 3 items and centers 2: give one radius for each"),
    (lambda: cn.disks(XY, 0.5, "rock"), r"material is 'rock': give a cairn.Material"),
    (lambda: cn.disks(XY, 0.5, cn.Material("light")), r"density of material 'light' is missing: Material\('light', density="),
    (lambda: cn.disks(XY, 0.5, ROCK, density=0.0), r"density is 0.0: give a number > 0"),
    (lambda: cn.disks(XY, 0.5, ROCK, depth=-1.0), r"depth is -1.0: give a number > 0"),
    (lambda: cn.disks(XY, 0.5, ROCK, velocity=at(NAN, XY, 1, 1)), r"velocity\[1, 1\] is nan: give finite"),
    (lambda: cn.disks(XY, 0.5, ROCK, velocity=np.zeros((3, 3))), r"velocity has shape \(3, 3\): give \(3,\) or \(2, 3\)"),
    (lambda: cn.disks(XY, 0.5, ROCK, velocity="fast"), r"velocity is not an array of real numbers: give"),
    (lambda: cn.disks(XY, 0.5, ROCK, rotation=[0.0, INF]), r"rotation\[1\] is inf: give finite"),
    (lambda: cn.spheres(XYZ, 0.5, ROCK, rotation=[0.0, 1.0]), r"rotation has shape \(2,\): give shape \(2, 4\)"),
    (lambda: cn.spheres(XYZ, 0.5, ROCK, rotation=np.zeros((2, 4))), r"rotation\[0\] is \[0. 0. 0. 0.\]: give a quaternion"),
    (lambda: cn.disks(XY, 0.5, ROCK, driven="vz"), r"driven names 'vz': the dofs of a body are vx, vy, w"),
    (lambda: cn.disks(XY, 0.5, ROCK, drive=(NAN, 0, 0)), r"drive\[0, 0\] is nan: give finite"),
    (lambda: cn.disks(XY, 0.5, ROCK, force=(0, INF)), r"force\[0, 1\] is inf: give finite"),
    (lambda: cn.disks(XY, 0.5, ROCK, damping=[0.1, -2.0]), r"damping\[1\] is -2.0: give finite numbers >= 0"),
    (lambda: cn.disks(XY, 0.5, ROCK, damping=NAN), r"damping\[0\] is nan: give finite numbers >= 0"),
    (lambda: cn.disks(XY, 0.5, ROCK, damping=[1, 2, 3]), r"damping has shape \(3,\): give a number or an array of shape \(2,\)"),
    (lambda: cn.disks(XY, 0.5, ROCK, group="*"), r"group is '\*': give a non-empty string other than '\*'"),
    (lambda: cn.clumps(XY, [[0, 0]], [0.1], [1, 2, 3], 1.0, ROCK), r"mass has shape \(3,\): give a number or an array"),
    (lambda: cn.clumps(XYZ, [[0, 0, 0]], [0.1], 1.0, [1, 2], ROCK), r"inertia has shape \(2,\): .* moments, give \(3,\)"),
    (lambda: cn.clumps(XYZ, [[0, 0, 0]], [0.1], 1.0, 0.1, ROCK), r"inertia has shape \(\): .* three .*; cairn.pre.clump\("),
    (lambda: cn.clumps(XYZ, [[0, 0, 0]], [0.1], 1.0, [[0.1]] * len(XYZ), ROCK), r"inertia has shape .* three principal moments"),
    (lambda: cn.clumps(XY, [0, 0], [0.1], 1.0, 1.0, ROCK), r"offsets has shape \(2,\): give \(m, 2\) or \(m, 3\)"),
    (lambda: cn.wall((0, NAN), (0, 1), ROCK), r"point\[1\] is nan: give finite"),
    (lambda: cn.wall((0, 0), (0, 0), ROCK), r"normal is \[0. 0.\]: give a vector of non-zero length"),
    (lambda: cn.wall((0, 0), (0, 1, 0), ROCK), r"normal has shape \(3,\): give shape \(2,\)"),
    (lambda: cn.wall((0,), (1,), ROCK), r"point has shape \(1,\): give \(2,\) or \(3,\)"),
    (lambda: cn.wall((0, 0), (0, 1), ROCK, free="vy"), r"mass is missing: a boundary that is free to move along vy needs one"),
    (lambda: cn.wall((0, 0), (0, 1), ROCK, free="vq", mass=1.0), r"free names 'vq': the dofs of a body are vx, vy, w"),
    (lambda: cn.wall((0, 0), (0, 1), ROCK, mass=0.0), r"mass is 0.0: give a number > 0"),
    (lambda: cn.segment((0, 0), (0, 0), ROCK), r"end is \[0. 0.\], the same as start: give two different points"),
    (lambda: cn.segment((0, 0), (1, 0), ROCK, radius=-0.1), r"radius is -0.1: give a length >= 0"),
    (lambda: cn.tube((0, 0, 0), (0, 0, 1), 0.0, ROCK), r"radius is 0.0: give a number > 0"),
    (lambda: cn.tube((0, 0, 0), (0, 0, 1), 1.0, ROCK, half_length=NAN), r"half_length is nan: give a finite number"),
    (lambda: cn.box((0, 1), (1, 1), ROCK), r"low is \[0. 1.\] and high \[1. 1.\]: give two corners"),
    # materials, laws, functions of time
    (lambda: cn.Material("", density=1.0), r"name of a material is '': give a non-empty string"),
    (lambda: cn.Material("x", density=0.0), r"density is 0.0: give a number > 0"),
    (lambda: cn.Material("x", density=NAN), r"density is nan: give a finite number"),
    (lambda: cn.Coulomb(mu=-0.1), r"mu of Coulomb is -0.1: give a value from 0 to inf"),
    (lambda: cn.Coulomb(mu=NAN), r"mu of Coulomb is nan: give a value"),
    (lambda: cn.Coulomb(mu="much"), r"mu of Coulomb is 'much': give a number"),
    (lambda: cn.Restitution(normal=1.5), r"normal of Restitution is 1.5: give a value from 0 to 1"),
    (lambda: cn.Table([0, 0], [1, 2]), r"times\[1\] is 0, not after 0: give rising times"),
    (lambda: cn.Table([0, 1], [1, NAN]), r"values\[1\] is nan: give finite numbers"),
    (lambda: cn.Table([0, 1], [1, 2, 3]), r"values has shape \(3,\): give one row for each of the 2 times"),
    (lambda: cn.Harmonic(NAN, 1.0), r"amplitude is nan: give a finite number"),
    (lambda: cn.Harmonic((1.0, INF), 1.0), r"amplitude\[1\] is inf: give finite numbers"),
    (lambda: cn.Servo(1e4, (0, 0), 1.0), r"normal is \[0. 0.\]: give a vector"),
    (lambda: cn.Servo(1e4, (0, 1), -1.0), r"area is -1.0: give a number > 0"),
    # scene, strategy, simulation
    (lambda: cn.Scene(4), r"dim is 4: give 2 \(disks\) or 3 \(spheres\)"),
    (lambda: cn.Scene(2, gravity=(0, 0, -9.81)), r"gravity has shape \(3,\): give shape \(2,\)"),
    (lambda: cn.Scene(2, gravity=(0, NAN)), r"gravity\[1\] is nan: give finite"),
    (lambda: cn.Scene(2, depth=0.0), r"depth is 0.0: give a number > 0"),
    (lambda: cn.Scene(2, origin=(NAN, 0)), r"origin\[0\] is nan: give finite"),
    (lambda: cn.Scene(2, periodic=cn.Periodic((1.0, -1.0))), r"lengths of the periodic cell is \(1.0, -1.0\): give 2"),
    (lambda: cn.Scene(2, periodic=cn.Periodic((1.0, INF), shear_rate=1.0)), r"shear_rate and lean need a cell that is periodic"),
    (lambda: cn.NLGS(tol=0.0), r"tol is 0.0: give a number between 0 and 1"),
    (lambda: cn.NLGS(tol=NAN), r"tol is nan: give a finite number"),
    (lambda: cn.NLGS(min_iter=5, max_iter=2), r"min_iter is 5, above max_iter = 2: exchange them"),
    (lambda: cn.NLGS(max_iter=0), r"max_iter is 0: give a whole number >= 1"),
    (lambda: cn.NLGS(max_iter=1.5), r"max_iter is 1.5: give a whole number >= 1"),
    (lambda: cn.NSCD(theta=0.49), r"theta is 0.49: give a value in \[1/2, 1\]; below 1/2 the method is unstable"),
    (lambda: cn.NSCD(theta=1.01), r"theta is 1.01: give a value in \[1/2, 1\]"),
    (lambda: cn.NSCD(theta=NAN), r"theta is nan: give a finite number"),
    (lambda: cn.NSCD(margin=-1.0), r"margin is -1.0: give a length >= 0"),
    (lambda: cn.NSCD(solver="fast"), r"solver is 'fast': give cairn.NLGS"),
    (lambda: cn.Simulation(heap(), 0.0), r"dt is 0.0: give a number > 0"),
    (lambda: cn.Simulation(heap(), -1e-3), r"dt is -0.001: give a number > 0"),
    (lambda: cn.Simulation(heap(), NAN), r"dt is nan: give a finite number"),
    (lambda: cn.Simulation(heap(), "1e-3"), r"dt is '1e-3': give a finite number"),
    (lambda: cn.Simulation("scene", 1e-3), r"scene is 'scene': give a cairn.Scene"),
    (lambda: cn.Simulation(heap(), 1e-3, cn.NLGS()), r"strategy is NLGS.*: give cairn.NSCD"),
    (lambda: cn.Simulation(heap(), 1e-3, overlap="maybe"), r"overlap is 'maybe': give 'warn', 'error' or 'ignore'"),
]


@pytest.mark.parametrize("k", range(len(REFUSED)))
def test_refused(k):
    call, words = REFUSED[k]
    with pytest.raises(ValueError, match=words):
        call()


def test_parameters_of_laws():
    with pytest.raises(TypeError, match="Coulomb has no parameter 'friction'; it has mu"):
        cn.Coulomb(friction=0.4)
    with pytest.raises(TypeError, match="Coulomb needs mu, from 0 to inf"):
        cn.Coulomb()


# ---------------------------------------------------------------------- nothing half-built stays


def bad_sets():
    """Sets that only the scene itself can refuse: every array of each was valid when the set was made."""
    for name, value, words in (
        ("mass", 0.0, r"mass\[1\] is 0; give a positive number"),
        ("mass", NAN, r"mass\[1\] is nan; give a positive number"),
        ("inertia", -1.0, r"inertia\[1\] is -1; give a positive number"),
        ("position", INF, r"position\[1\] is inf; give a finite number"),
        ("velocity", NAN, r"velocity\[1\] is nan; give a finite number"),
    ):
        s = cn.disks(XY, 0.4, ROCK, velocity=(0.0, 0.0, 0.0))
        array = getattr(s, name).copy()
        array[1] = value
        setattr(s, name, array)
        yield s, words
    s = cn.clumps(XYZ, [[0, 0, 0]], [0.1], 1.0, [1.0, 1.0, 5.0], ROCK)
    yield s, r"inertia\[0\] is 1; no body has a principal moment larger than the sum of the other two"


@pytest.mark.parametrize("k", range(6))
def test_a_bad_set_leaves_the_scene_as_it_was(k):
    bad, words = list(bad_sets())[k]
    dim = bad.dim
    good = (cn.disks if dim == 2 else cn.spheres)(np.full((1, dim), 20.0), 0.4, cn.Material("other", density=1.0))
    scene = heap(dim)
    count, sets, rules = scene.count, list(scene.sets), list(scene.rules)
    with pytest.raises(ValueError, match=words):
        scene.add(good, bad)
    assert (scene.count, scene.rules) == (count, rules)
    assert [id(s) for s in scene.sets] == [id(s) for s in sets]

    sim = cn.Simulation(scene, 1e-3, overlap="ignore")
    sim.step()
    before, species = state(sim), dict(sim._species)
    with pytest.raises(ValueError, match=words):
        sim.add(good, bad)
    assert not differing(before, state(sim))
    assert sim._species == species
    twin = cn.Simulation(heap(dim), 1e-3, overlap="ignore")
    twin.step()
    sim.step()
    twin.step()
    assert not differing(state(twin), state(sim))


def test_wrong_sets_and_ids():
    scene = heap(2)
    with pytest.raises(ValueError, match="'grains' is not a set of bodies: give cairn.disks"):
        scene.add("grains")
    with pytest.raises(ValueError, match="a set of bodies has 3 dimensions and the scene 2: they must agree"):
        scene.add(cn.spheres(XYZ, 0.4, ROCK))
    sim = cn.Simulation(scene, 1e-3, overlap="ignore")
    before = state(sim)
    for call, words in (
        (lambda: sim.remove([0, 99]), "there is no body 99; it was never added, or was removed"),
        (lambda: sim.remove([3, 3]), "body 3 is named twice among those to remove"),
        (lambda: sim.remove([0.5]), r"ids is \[0.5\]: give whole numbers"),
        (lambda: sim.drive([99], "vx", (1, 0, 0)), "there is no body 99"),
        (lambda: sim.drive([1], "vx", (NAN, 0, 0)), r"velocity\[0, 0\] is nan"),
        (lambda: sim.drive([1], "v", (1, 0, 0)), "driven names 'v'"),
        (lambda: sim.step(0.0), "dt is 0.0: give a number > 0"),
        (lambda: sim.step(NAN), "dt is nan: give a finite number"),
        (lambda: setattr(sim, "dt", -1.0), "dt is -1.0: give a number > 0"),
        (lambda: setattr(sim, "strategy", None), "strategy is None: give cairn.NSCD"),
        (lambda: sim.bodies.set(velocity=np.zeros((2, 3))), r"velocity has shape \(2, 3\): give shape \(51, 3\)"),
        (lambda: sim.bodies.set(velocity=at(NAN, np.zeros((51, 3)), 7, 1)), r"velocity\[7, 1\] is nan: give finite numbers"),
        (lambda: sim.bodies.set(position=np.zeros((51, 2)), velocity=np.full((51, 3), INF)), r"velocity\[0, 0\] is inf"),
        (lambda: sim.bodies.set(mass=np.ones(51)), "mass of bodies cannot be set: position, velocity and rotation can"),
        (lambda: sim.run(steps=-1), "steps is -1: give a whole number >= 0"),
        (lambda: sim.run(until=NAN), "until is nan: give a finite number"),
        (lambda: sim.run(steps=1, every=0), "every is 0: give a whole number >= 1"),
        (lambda: sim.interact("rock", "gravel", cn.Coulomb(mu=1)), "names 'gravel', which is no material and no group"),
        (lambda: sim.interact("rock", "sand", 0.5), r"law is 0.5: give a law such as cairn.Coulomb\(mu=0.4\), or None"),
    ):
        with pytest.raises(ValueError, match=words):
            call()
        assert not differing(before, state(sim)), words
    scene.add(cn.disks([[0, 50]], 0.4, ROCK))
    with pytest.raises(ValueError, match="bodies were added to the scene after the simulation was made of it: add them by Sim"):
        sim.step()


def test_names_in_rules():
    scene = heap(2)
    scene.interact("rock", "gravel", cn.Coulomb(mu=0.1))
    with pytest.raises(ValueError, match="names 'gravel', which is no material and no group of the scene; there are below, rock"):
        cn.Simulation(scene, 1e-3)
    with pytest.raises(ValueError, match="second side of an interaction is 3: give a Material"):
        scene.interact("rock", 3, cn.Coulomb(mu=0.1))


# ---------------------------------------------------------------------- a pair without a law


def test_a_pair_without_a_law_undoes_the_step_and_can_be_given_one():
    def make():
        scene = cn.Scene(2, gravity=(0, -9.81))
        scene.add(cn.disks([[0, 1.0], [2, 1.0]], 0.5, ROCK), cn.disks([[0.1, 2.2]], 0.5, SAND, group="upper", velocity=(0, -3.0)))
        scene.add(cn.wall((0, 0.5), (0, 1), ROCK))
        scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
        with pytest.warns(cn.MissingLawWarning, match=r"'sand \(upper\)' and 'rock'"):
            return cn.Simulation(scene, 1e-2, overlap="ignore")

    sim = make()
    while True:
        before = state(sim)
        try:
            sim.step()
        except ValueError as error:
            assert re.search(r"rock.*sand \(upper\)|sand \(upper\).*rock", str(error)), error
            assert "declare one for this pair" in str(error), error
            break
        assert sim.steps < 20
    assert sim.steps > 0
    later = {n for n in differing(before, state(sim)) if not re.search(r"_free|_begin|inverse|driven_velocity", n)}
    assert not later  # but for what a step computes anew, nothing changed
    assert len(sim.contacts.gap) == len(sim.contacts.impulse) == len(sim.contacts.bodies)
    with pytest.raises(ValueError):
        sim.step()

    other = make()
    for _ in range(sim.steps):
        other.step()
    sim.interact(ROCK, "upper", cn.Coulomb(mu=0.5))
    other.scene.interact("upper", "rock", cn.Coulomb(mu=0.5))  # a rule that the scene gets meanwhile counts as well
    for _ in range(20):
        sim.step()
        other.step()
    assert sim.bodies.velocity[2, 1] > -3.0
    assert not differing(state(sim), state(other))


def test_functions_that_return_nonsense_stop_the_step():
    for value, words in ((lambda t: NAN if t > 0.002 else 1.0, r"drive\[0, 1\] is nan"), (lambda t: 1.0, None)):
        scene = heap(2, push=lambda t, value=value: (0.0, value(t)))
        sim = cn.Simulation(scene, 1e-3, overlap="ignore")
        sim.step()
        if words:
            with pytest.raises(ValueError, match=words):
                sim.run(steps=5, progress=False)
            assert sim.steps == 2
    scene = cn.Scene(2, gravity=lambda t: (0.0, 0.0, -9.81))
    scene.add(cn.disks(XY, 0.4, ROCK))
    with pytest.raises(ValueError, match=r"gravity has shape \(3,\): give shape \(2,\)"):
        cn.Simulation(scene, 1e-3).step()


# ---------------------------------------------------------------------- overlaps


def overlapping():
    scene = cn.Scene(2)
    scene.add(cn.disks([[0, 0], [0.9, 0], [5, 0], [5.5, 0], [9, 0.3], [12, 0]], 0.5, ROCK))
    scene.add(cn.wall((0, -0.5), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    return scene


def test_overlapping_bodies_are_told():
    words = (
        r"2 pairs overlap by more than 0.02 of the smaller radius, the worst are bodies 2 and 3 by 1 of a radius; "
        r"bodies 0 and 1 by 0.2 of a radius: move them apart, or shrink the radii, or set overlap='ignore'"
    )
    with pytest.warns(cn.OverlapWarning, match=words):
        cn.Simulation(overlapping(), 1e-3)
    with pytest.raises(ValueError, match=words):
        cn.Simulation(overlapping(), 1e-3, overlap="error")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sim = cn.Simulation(overlapping(), 1e-3, overlap="ignore")
        cn.Simulation(overlapping(), 1e-3, overlap_share=1.1)
    assert sim.steps == 0
    with pytest.raises(ValueError, match="overlap_share is nan"):
        cn.Simulation(overlapping(), 1e-3, overlap_share=NAN)


def test_the_check_for_overlaps_changes_nothing():
    with pytest.warns(cn.OverlapWarning):
        checked = cn.Simulation(overlapping(), 1e-3)
    assert len(checked.contacts.impulse) == 0
    plain = cn.Simulation(overlapping(), 1e-3, overlap="ignore")
    checked.step()
    plain.step()
    assert not differing(state(checked), state(plain))


# ---------------------------------------------------------------------- files that are none


def test_foreign_files(tmp_path):
    path = tmp_path / "a.h5"
    sim = cn.Simulation(heap(2), 1e-3, overlap="ignore")
    before = state(sim)
    heap(2).save(path)
    with pytest.raises(cn.FileError, match="this file holds no checkpoint; give a file written by Simulation.checkpoint"):
        sim.restore(path)
    sim.checkpoint(path)
    with pytest.raises(cn.FileError, match="this file holds no scene; give a file written by Scene.save"):
        cn.Scene.load(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    for read in (sim.restore, cn.Scene.load, cn.load):
        with pytest.raises(cn.FileError, match="truncated"):
            read(path)
    path.write_text("no HDF5 at all")
    for read in (sim.restore, cn.Scene.load, cn.load):
        with pytest.raises(cn.FileError, match="a.h5: .*; "):
            read(path)
        with pytest.raises(cn.FileError, match="no such file"):
            read(tmp_path / "none.h5")
    assert not differing(before, state(sim))


def test_copies_are_independent():
    """A set can be changed and added again; what a scene got stays as it was."""
    scene, s = cn.Scene(2), cn.disks(XY, 0.4, ROCK)
    scene.add(s)
    other = s.with_(group="again", velocity=(1.0, 0.0))
    assert s.group is None
    assert s.velocity is None
    scene.add(other)
    assert list(scene.sets[1].ids) == [2, 3]
    assert copy.copy(s).ids is None


def test_an_overlap_that_the_first_step_makes_is_told():
    scene = cn.Scene(2)
    scene.add(cn.disks([[0, 0.5]], 0.5, ROCK, velocity=[[0, -20.0, 0]]), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 0.1)
    with pytest.warns(cn.OverlapWarning, match="by 200% of the smaller one's size in step 1, which converged"):
        sim.step()
    with warnings.catch_warnings():  # faults present before are not attributed to the first step
        warnings.simplefilter("error")
        sim = cn.Simulation(overlapping(), 1e-3, overlap_share=1.1)
        sim.step()
