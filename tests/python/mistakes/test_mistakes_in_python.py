"""Mistakes that users make in Python: each is answered by a statement of Cairn's own that names field, value and remedy."""

import os
import re

import cairn as cn
import numpy as np
import pytest
from cairn.cli.errors import meant_to_be_read
from cairn.post import measures
from cairn.post.limit_analysis import Assembly, bisect
from cairn.post.verify import verify
from small_scenes import ROCK, heap

XY, XYZ, NAN = [[0.0, 0.0], [2.0, 0.0]], [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]], np.nan
DART = [[0, 0], [2, 0], [0.5, 0.5], [0, 2]]
OPEN = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1]])


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A simulation that has moved, and the run that it wrote, in a folder of their own."""
    before = os.getcwd()
    os.chdir(tmp_path_factory.mktemp("mistakes"))
    sim = cn.Simulation(heap(), 1e-3, overlap="ignore")
    sim.run(steps=4, output="r.vtkhdf", every=2, progress=False)
    sim.scene.save("s.scene.h5")
    yield sim, cn.load("r.vtkhdf")
    os.chdir(before)


def simulated(*sets, gravity=None, law=None, **options):
    scene = cn.Scene(2, gravity, **options)
    scene.add(*sets)
    scene.interact("*", "*", law or cn.Coulomb(mu=0.1))
    return cn.Simulation(scene, 1e-3, overlap="ignore").step()


def run(sim, **options):
    return sim.run(**({"steps": 1, "progress": False} | options))


def thermal():
    scene = heap()
    scene.thermal(initial=300.0)
    return cn.Simulation(scene, 1e-3, overlap="ignore")


# call with the simulation s and its run r, and the answer
MISTAKES = [
    # running
    (lambda s, r: run(s, steps=None), "run needs an end: give steps=, until= or while_="),
    (lambda s, r: run(s, until=-1.0), "until is -1.0: the simulation is at .* already; give a later time, or steps="),
    (lambda s, r: run(s, steps="10"), "steps is '10': give a whole number >= 0"),
    (lambda s, r: run(s, every=2.5), "every is 2.5: give a whole number >= 1"),
    (lambda s, r: run(s, progress="no"), "progress is 'no': give True or False"),
    (lambda s, r: run(s, while_=True), "while_ is True: give a function of the simulation, which is true as long as"),
    (lambda s, r: run(s, callback=3), "callback is 3: give a function of the simulation, which runs after each step"),
    (lambda s, r: run(s, callback=lambda: 1), r"callback takes \(\): give a function of one argument, the simulation"),
    (lambda s, r: run(s, probes=[len]), r"probes is \[.*\]: give \{name: function\}"),
    (lambda s, r: run(s, probes={"x": lambda: 1}), r"probe 'x' takes \(\): give a function of one argument"),
    (lambda s, r: run(s, probes={"time": lambda s: 1}), "probe 'time' bears the name of a column .*: give it another"),
    (lambda s, r: run(s, probes={"speed": len}), "probes needs output=: .* history .*; give output=, or collect .* callback="),
    (lambda s, r: run(s, probes={"energy_kinetic": lambda s: 1}), "probe 'energy_kinetic' bears the name of a column"),
    (lambda s, r: run(s, probes={"x": lambda s: s.bodies.position}, output="p.vtkhdf"), "probe 'x' gave an array of shape"),
    (lambda s, r: run(s, output="r.txt"), "r.txt: a run is an HDF5 file, .* ends in .txt; give a name that ends in .vtkhdf"),
    (lambda s, r: run(s, output="r.vtkhdf"), "r.vtkhdf: this file exists already; choose another name, or ask for it to be over"),
    (lambda s, r: run(s, output="r.vtkhdf", overwrite="no"), "overwrite is 'no': give True or False"),
    (lambda s, r: run(s, output="no/r.vtkhdf"), "no/r.vtkhdf: no such file or folder; check the path, or make the folder first"),
    (lambda s, r: run(s, checkpoint_every=3), "checkpoint_every needs output=: checkpoints stand beside the output file"),
    (lambda s, r: setattr(s, "dt", "x"), "dt is 'x': give a finite number"),
    # names that are misspelt
    (lambda s, r: s.explian(), "Simulation has no 'explian'; did you mean 'explain'"),
    (lambda s, r: s.position, "Simulation has no 'position'; did you mean sim.bodies.position"),
    (lambda s, r: setattr(s, "gravity", (0, 0)), "Simulation has no 'gravity' to be assigned; did you mean sim.scene.gravity"),
    (lambda s, r: setattr(s, "gravty", (0, 0)), "Simulation has no 'gravty' to be assigned; did you mean sim.scene.gravity"),
    (lambda s, r: setattr(s, "time", 3.0), "time of Simulation is .* and cannot be assigned"),
    (lambda s, r: setattr(s, "bodies", 3), r"bodies of Simulation is .* cannot be assigned: sim.bodies.set\(...\) sets position"),
    (lambda s, r: setattr(s.scene, "gravty", (0, 0)), "Scene has no 'gravty' to be assigned; did you mean 'gravity'"),
    (lambda s, r: setattr(heap(), "gravity", (0, 0, 0)), r"gravity has shape \(3,\): give shape \(2,\)"),
    (lambda s, r: setattr(heap(), "dim", 3), "dim of Scene is 2 and cannot be assigned: make another scene"),
    (lambda s, r: setattr(cn.disks(XY, 0.5, ROCK), "velocty", 1), "BodySet has no 'velocty' .*; did you mean 'velocity'"),
    (lambda s, r: setattr(cn.Coulomb(mu=0.3), "mu", 0.4), r"mu of Coulomb is 0.3.*: make another, Coulomb\(mu="),
    (lambda s, r: cn.Coulomb(mu=0.3).friction, "Coulomb has no parameter 'friction'; it has mu"),
    (lambda s, r: setattr(cn.NSCD(), "thta", 1), r"NSCD has no 'thta'; did you mean 'theta'\?: a NSCD does not change"),
    (lambda s, r: setattr(ROCK, "density", 1.0), r"density is 2000.0: .*; make another, Material\(density="),
    (lambda s, r: s.contacts["forces"], "contacts have no array 'forces'; they have .*; did you mean 'force'"),
    (lambda s, r: s.bodies[0], "0 is no name of an array: give one"),
    (lambda s, r: s.raw.velocty, "there is no live array 'velocty'; .*; did you mean 'velocity'"),
    (lambda s, r: cn.strategy("nscdd"), "strategy is 'nscdd': give 'nscd', .*; did you mean 'NSCD'"),
    # bodies and scenes
    (lambda s, r: cn.polygons([DART], ROCK), r"vertices\[0\] is not convex, .*: give convex parts \(cairn.pre.convex_parts\)"),
    (lambda s, r: cn.polygons([[[0, 0], [1, 0], [2, 0]]], ROCK), r"vertices\[0\] is flat: its area is 0"),
    (lambda s, r: cn.polyhedra([XYZ], ROCK), r"meshes\[0\] is no shape and no list of shapes: give a mesh, \(vertices \(m, 3\)"),
    (lambda s, r: cn.polyhedra([OPEN], ROCK), r"meshes\[0\] is open: the edge .*; close the holes"),
    (lambda s, r: cn.wall((0, 0), (0, 1), None), "material is None: give a cairn.Material"),
    (lambda s, r: cn.wall((0, 0), (0, 1), ROCK, velocity=cn.Servo(1e4, (0, 1), 1.0)), "velocity is a Servo, .* give force="),
    (lambda s, r: cn.Scene(2, periodic=(1, 1)), r"periodic is \(1, 1\): give cairn.Periodic\(lengths=...\)"),
    (lambda s, r: simulated(gravity=cn.Table([0, 1], [0, 1])), r"gravity has shape \(\): give shape \(2,\)"),
    (lambda s, r: cn.Scene(2, periodic=cn.Periodic((1, 1))).add(cn.disks(XY, 1.0, ROCK)), r"lengths\[0\] .* is 1 m and body 0"),
    (lambda s, r: heap().interact(cn.Coulomb(mu=0.4), ROCK, ROCK), "law is Material.*: give a law such as cairn.Coulomb"),
    (lambda s, r: heap().interact(ROCK, ROCK, cn.Coulomb), "law is the class Coulomb: give a law such as cairn.Coulomb"),
    (lambda s, r: cn.Simulation(heap(), 1e-3, cn.NSCD), r"strategy is <class .*NSCD'>: give cairn.NSCD\(...\)"),
    (lambda s, r: simulated(cn.disks(XY, 1.2, ROCK), law=cn.JKR(young=1e9, work=0.1, restitution=0.5, mu=0.1)), "NSCD"),
    (lambda s, r: cn.Simulation(heap(), 1e-3, cn.SmoothDEM(), overlap="ignore"), "law Coulomb has no force .* LinearSpring"),
    (lambda s, r: cn.pre.deposit_disks([0.1, 0.2], 0.1), r"width is 0.1, less than the diameter of radii\[1\] = 0.2: give at"),
    (lambda s, r: cn.pre.grains.uniform(9, 0.1, 0.2), "uniform: missing a required argument: 'rng'; the call is uniform"),
    (lambda s, r: cn.pre.grains.read_curve("none.csv"), "none.csv does not exist; check the path"),
    (lambda s, r: cn.pre.masonry.arch(kind="gothik", radius=9.0, thickness=1.0, voussoirs=9), "kind is 'gothik': give"),
    (lambda s, r: cn.deformable(3, ROCK), "body is 3: give .*a cairn.ElasticBody, LinearBody or SolidBody"),
    (lambda s, r: cn.ElasticBody(XY, [[0, 1, 2]], young=1e6, poisson=0.3), r"cells is list: give \{kind: nodes \(m, k\)\}"),
    (lambda s, r: thermal(), r"conductivity of material 'rock' is not given, .* give cairn.Material\('rock', conductivity="),
    # files, pictures, measures, stability
    (lambda s, r: cn.load("s.scene.h5"), "s.scene.h5: this file holds a scene or .*; cairn.Scene.load .* give a .vtkhdf file"),
    (lambda s, r: cn.load(None), "path is None: give the name of a .vtkhdf file"),
    (lambda s, r: cn.Scene.load(s.scene), "path of a scene is .*: give the name of a .scene.h5 file"),
    (lambda s, r: s.checkpoint(None), "path of a checkpoint is None: give the name of a file that ends in .h5"),
    (lambda s, r: s.restore("r.vtkhdf"), "r.vtkhdf: this HDF5 file is not a checkpoint; give a .checkpoint.h5 file"),
    (lambda s, r: s.set_state({}), "state is dict, and none that get_state gave: give that"),
    (lambda s, r: r[9], r"output 9 was asked for; r.vtkhdf holds 3 \(0 to 2\)"),
    (lambda s, r: r["last"], r"output 'last' was asked for: give its number, 0 to 2, or run.at\(time\)"),
    (lambda s, r: r.at(NAN), "time is nan: give a finite number"),
    (lambda s, r: r.history["heigth"], "the history has no column 'heigth'; it has time, "),
    (lambda s, r: r.plot(-1, "velocty"), "there is no field 'velocty'; there are .*; did you mean 'velocity'"),
    (lambda s, r: r.plot(-1, colormap="x"), "plot_step has no argument 'colormap'; it has .*"),
    (lambda s, r: r.animate("a.gif", dpi=0), "dpi is 0: give a number > 0"),
    (lambda s, r: r.animate("a.xyz"), "a.xyz: an animation is a .gif or an .mp4; choose one of these"),
    (lambda s, r: measures.measure(r[-1], low=(0, 0, 0), high=(1, 1, 1)), r"low has shape \(3,\): give shape \(2,\)"),
    (lambda s, r: measures.measure(r[-1], low=(1, 1), high=(0, 0)), r"low = .*1.* is empty or not of 2 dimensions: give"),
    (lambda s, r: measures.fabric_tensor(3), r"normals has shape \(\): give shape \(n, m\)"),
    (lambda s, r: verify("r.vtkhdf", "r.vtkhdf", {"positon": 1}), "there is no norm 'positon' .*; did you mean 'position'"),
    (lambda s, r: Assembly(3, 0.7), r"blocks is 3: give Blocks, as cairn.pre.masonry.arch\(...\)"),
    (lambda s, r: bisect(lambda x: True, low=3, high=1), "the structure stands both at 3 and at 1: widen the interval"),
    (lambda s, r: cn.find_equilibrium(3), "simulation is 3: give a cairn.Simulation"),
    (lambda s, r: cn.problems.read("none.dat"), "none.dat: there is no such file; check the path"),
    (lambda s, r: cn.plug("none.so"), "give one of law=, solver=, .*; there are none"),
]


@pytest.mark.parametrize("k", range(len(MISTAKES)))
def test_a_mistake_is_answered(made, k):
    call, words = MISTAKES[k]
    with pytest.raises(Exception) as told:
        call(*made)
    assert meant_to_be_read(told.value), repr(told.value)
    assert re.search(words, str(told.value)), str(told.value)


def test_there_are_as_many_as_promised():
    assert len(MISTAKES) >= 60


def test_what_a_user_keeps_in_an_object_stays_allowed(made):
    sim, _ = made
    sim.colour_of_my_plots = "red"
    sim.scene.drawn_by = "me"
    assert sim.colour_of_my_plots == "red" and sim.scene.drawn_by == "me"
    scene = heap()
    scene.gravity = lambda t: (0.0, -9.81 * t)
    assert scene.gravity(1.0) == (0.0, -9.81)
    assert np.array_equal(sim.bodies["position"], sim.bodies.position)
    assert cn.Coulomb(mu=0.25).mu == 0.25
