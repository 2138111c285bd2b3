"""Mistakes of newcomers: wrong units, shapes, order of calls, names, files; errors of Cairn or warnings answer them."""

import json
import warnings

import cairn as cn
import numpy as np
import pytest
from cairn import study
from cairn.cli import main
from cairn.post import assessment, cracks, limit_analysis, masonry_plots, measures
from cairn.post.collapse import collapse_multiplier
from cairn.post.convert import convert
from cairn.post.masonry import Structure
from cairn.pre import importing, loads, masonry
from cairn.run import documents

ROCK = cn.Material("rock", density=2600.0)
WALL = masonry.panel(2, 2)
ARCH = masonry.arch(radius=5.0, thickness=0.9, voussoirs=5)
QUAD = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)


def scene(dim=2, law=True):
    made, up = cn.Scene(dim, gravity=(0.0,) * (dim - 1) + (-9.81,)), (0.0,) * (dim - 1) + (1.0,)
    made.add((cn.disks if dim == 2 else cn.spheres)([(0.0,) * (dim - 1) + (0.5,)], 0.5, ROCK), cn.wall((0.0,) * dim, up, ROCK))
    if law:
        made.interact("*", "*", cn.Coulomb(mu=0.5))
    return made


def sim(dt=1e-3, **options):
    return cn.Simulation(scene(), dt, **options)


def run(name="a.vtkhdf"):
    sim().run(steps=4, every=2, output=name, overwrite=True, progress=False)
    return cn.load(name)


def body(**options):
    return cn.ElasticBody(QUAD, {"quad": [[0, 1, 2, 3]]}, young=1e7, poisson=0.3, density=1e3, groups={"foot": [0, 1]}, **options)


def structure(ids=None):
    made = cn.Scene(2, gravity=(0.0, -9.81))
    own = WALL.add_to(made, ROCK)
    made.interact("*", "*", cn.Coulomb(mu=0.5))
    return Structure(WALL, cn.Simulation(made, 1e-3), own if ids is None else ids)


def meshed_with(ids):
    meshed, made = masonry.mesh(WALL, young=1e9), cn.Scene(2)
    meshed.add_to(made, ROCK)
    made.interact("*", "*", cn.Coulomb(mu=0.5))
    return cracks.MeshedStructure(meshed, cn.Simulation(made, 1e-3), ids)


def bodies_after():
    made = scene()
    simulation = cn.Simulation(made, 1e-3)
    made.add(cn.disks([(5, 5)], 0.5, ROCK))
    simulation.step()


def another_scene_goes_on():
    run("m.vtkhdf")
    other = cn.Scene(2)
    other.add(cn.disks([(0, 2.0)], 0.3, ROCK))
    cn.Simulation(other, 1e-3).run(steps=2, output="m.vtkhdf", append=True, progress=False)


def of_text(text, call):
    with open("given.txt", "w", encoding="utf-8") as file:
        file.write(text)
    return call("given.txt")


ERRORS = {
    # wrong units and values
    "dt is a text": (lambda: cn.Simulation(scene(), "1e-3"), "dt is '1e-3'"),
    "dt 0": (lambda: cn.Simulation(scene(), 0), "dt is 0: give a number > 0"),
    "density below 0": (lambda: cn.Material("x", density=-1), "density is -1"),
    "restitution in percent": (lambda: cn.Restitution(mu=0.3, normal=50, tangential=0), "from 0 to 1"),
    "mu below 0": (lambda: cn.Coulomb(mu=-0.3), "mu of Coulomb is -0.3"),
    "mu is nan": (lambda: cn.Coulomb(mu=float("nan")), "mu of Coulomb is nan"),
    "tolerance 10": (lambda: cn.NLGS(tol=10), "between 0 and 1"),
    "iterations as a float": (lambda: cn.NLGS(max_iter=1e3), "whole number"),
    "theta 0": (lambda: cn.NSCD(theta=0), "unstable"),
    "poisson a half": (lambda: cn.ElasticBody(QUAD, {"quad": [[0, 1, 2, 3]]}, young=1e7, poisson=0.5), "below 1/2"),
    "no density": (lambda: cn.disks([(0, 0)], 0.5, cn.Material("bare")), "density of material 'bare' is missing"),
    "two materials of a name": (lambda: cn.Scene(2).add(cn.disks([(0, 0)], 0.5, ROCK), cn.disks([(3, 0)], 0.5, cn.Material(
        "rock", density=1.0))), "two materials are named 'rock'"),
    "mass 0": (lambda: cn.Simulation(_with(cn.clumps([(0, 0)], [(0, 0), (1, 0)], 0.1, 0, 1.0, ROCK)), 1e-3), "mass"),
    "steps 10.5": (lambda: sim().run(steps=10.5, progress=False), "whole number"),
    "every 0": (lambda: sim().run(steps=1, every=0, progress=False), "every is 0"),
    "axle that lifts": (lambda: assessment.moving_load(ARCH, -1e3), "acts downwards"),
    # wrong shapes
    "centers flat": (lambda: cn.disks((0, 0), 0.5, ROCK), "centers has shape"),
    "centers in space": (lambda: cn.disks([(0, 0, 0)], 0.5, ROCK), "centers has shape"),
    "a radius too few": (lambda: cn.disks([(0, 0), (2, 0)], [0.5], ROCK), "one radius for each"),
    "a centre is nan": (lambda: cn.disks([(0, float("nan"))], 0.5, ROCK), r"centers\[0, 1\] is nan"),
    "gravity a number": (lambda: cn.Scene(2, gravity=-9.81), "gravity has shape"),
    "sizes of two": (lambda: cn.boxes([(0, 0, 0)], (1, 1), ROCK), r"sizes has shape \(2,\): give one of shape \(3,\)"),
    "angles for a quaternion": (lambda: cn.boxes([(0, 0, 0)], 1.0, ROCK, rotation=(0, 0, 90)), "quaternions"),
    "moment a number in 3D": (lambda: cn.clumps([(0, 0, 0)], [(-0.2, 0, 0)], 0.3, 5.0, 0.1, ROCK), "three principal moments"),
    "velocity of two in 3D": (lambda: cn.spheres([(0, 0, 0)], 0.1, ROCK, velocity=(1, 0)), "velocity has shape"),
    "axle as a vector": (lambda: assessment.moving_load(ARCH, (0.0, -1e4)), "load has shape"),
    "concave polygon": (lambda: cn.polygons([[(0, 0), (2, 0), (1, 0.2), (1, 2)]], ROCK), "not convex"),
    "polyhedra without faces": (lambda: cn.polyhedra([[(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]], ROCK), "give a mesh"),
    "faces from 1": (lambda: cn.polyhedra([(np.eye(4)[:, :3], [[1, 2, 3], [1, 2, 4]])], ROCK), "numbered 0 to 3"),
    "cells from 1": (lambda: cn.ElasticBody(QUAD, {"quad": [[1, 2, 3, 4]]}, young=1.0, poisson=0.0), "number them from 0"),
    "measures of a simulation": (lambda: measures.measure(sim()), r"step is a Simulation.*give run\[-1\]"),
    "measures of a whole run": (lambda: measures.measure(run()), r"an output of a run: give run\[-1\]"),
    "marks as numbers": (lambda: measures.lacey_index([(0, 0), (1, 1)], [0, 1], 0.1), "of bool"),
    "cells of two sides in 3D": (lambda: measures.lacey_index(np.eye(3), np.array([True, False, True]), (1.0, 1.0)), "sample"),
    "thrust through one block": (lambda: structure().thrust_line([1]), "two blocks and more"),
    "thrust through a block that is not": (lambda: structure().thrust_line([0, 99]), "blocks 0 to 5"),
    "ids of one block": (lambda: structure(ids=3), "one for each of the 6 blocks"),
    # order of arguments and calls
    "simulation before scene": (lambda: cn.Simulation(1e-3, scene()), "give a cairn.Scene"),
    "material before radii": (lambda: cn.disks([(0, 0)], ROCK, 0.5), "radii is Material"),
    "material by name": (lambda: cn.disks([(0, 0)], 0.5, "rock"), "give a cairn.Material"),
    "structure in another order": (lambda: Structure(sim(), WALL, [0]), "blocks is <simulation"),
    "structure without simulation": (lambda: Structure(WALL, scene(), [0] * 6), "give the cairn.Simulation"),
    "bodies after the simulation": (bodies_after, "Simulation.add"),
    "a scene without bodies": (lambda: cn.Simulation(cn.Scene(2), 1e-3).run(steps=1, progress=False), "no bodies"),
    "a run without end": (lambda: sim().run(progress=False), "give steps="),
    "a file of another scene": (another_scene_goes_on, "another scene"),
    "blocks into a scene": (lambda: cn.Scene(2).add(WALL), "add_to.scene, material."),
    "meshes into a scene": (lambda: cn.Scene(2).add(masonry.mesh(WALL, young=1e9)), "add_to.scene, material."),
    "simulation of blocks": (lambda: cn.Simulation(WALL, 1e-3), "scene is <6 blocks in 2D: 5 brick, 1 support>"),
    "cracks of blocks": (lambda: cracks.cracks(WALL), "Structure.blocks, simulation, ids."),
    "picture of cracks of a number": (lambda: cracks.draw(3), "structure is 3"),
    "ids of meshes by number": (lambda: meshed_with(list(range(6))), "list of arrays"),
    "equilibrium of a scene": (lambda: cn.find_equilibrium(scene()), "give a cairn.Simulation"),
    "writing into a copy": (lambda: sim().bodies.position.__setitem__(0, 1), "is a copy"),
    # words
    "a law by class": (lambda: scene().interact("*", "*", cn.Coulomb), r"class Coulomb: give a law such as cairn.Coulomb\(mu="),
    "a law by number": (lambda: scene().interact("*", "*", 0.5), "give a law such as"),
    "friction for mu": (lambda: cn.Coulomb(friction=0.5), "has no parameter 'friction'"),
    "a material misspelt": (lambda: cn.Simulation(_ruled("rok"), 1e-3), "did you mean 'rock'"),
    "a name misspelt": (lambda: cn.Colomb, "did you mean 'Coulomb'"),
    "solver by name": (lambda: cn.NSCD(solver="NLGS"), "give cairn.NLGS"),
    "strategy by name": (lambda: cn.Simulation(scene(), 1e-3, "NSCD"), "give cairn.NSCD"),
    "strategy by class": (lambda: cn.Simulation(scene(), 1e-3, cn.NSCD), "give cairn.NSCD"),
    "Coulomb in smooth DEM": (lambda: cn.Simulation(scene(), 1e-3, cn.SmoothDEM()).step(), "LinearSpring"),
    "a dof by axis": (lambda: sim().drive([0], "x", 1.0), "did you mean 'vx'"),
    "a body that is not": (lambda: sim().drive([99], "vx", 1.0), "no body 99"),
    "a field misspelt": (lambda: run()[-1].bodies.velocty, "did you mean 'velocity'"),
    "an option of measures": (lambda: run().measure(-1, lower=(0, 0)), "did you mean 'low'"),
    "an option of pictures": (lambda: run().plot(colormap="jet"), "did you mean 'cmap'"),
    "an option of graphs": (lambda: run().graph(-1, load=True), "did you mean 'loaded'"),
    "a bond misspelt": (lambda: masonry.panel(2, 2, bond="runing"), "running"),
    "a load misspelt": (lambda: collapse_multiplier(WALL, mu=0.5, load="pushh"), '"tilt", "push"'),
    "a picture of what is not": (lambda: masonry_plots.draw(structure(), what="strain"), '"stress", "displacement"'),
    "thrust=True": (lambda: masonry_plots.draw(structure(), thrust=True), "numbers of a chain"),
    "live load of a vector": (lambda: limit_analysis.Assembly(WALL, 0.5).collapse((1, 0)), "live has shape"),
    "a group that is not": (lambda: cn.deformable(body(), ROCK, contact="head"), "no group 'head' in the mesh"),
    "fixed by a name": (lambda: cn.deformable(body(), ROCK, fixed="foot"), "fixed is 'foot': give .group"),
    "fixed along z in 2D": (lambda: cn.deformable(body(), ROCK, fixed={"foot": "xyz"}), "in 2D give x, y"),
    "a force without time": (lambda: cn.disks([(0, 0)], 0.5, ROCK, force=lambda: (1, 2, 3)), r"force takes \(\)"),
    "gravity without time": (lambda: cn.Scene(2, gravity=lambda: (0, -9)), r"gravity takes \(\)"),
    "a drive without time": (lambda: cn.deformable(body(), ROCK, drive={"foot": {"x": lambda: 1.0}}), "takes"),
    "a probe that is a number": (lambda: sim().run(steps=1, probes={"x": 3.0}, progress=False), "give {name: function}"),
    "a callback without argument": (lambda: sim().run(steps=1, callback=lambda: 1, progress=False), "of one argument"),
    "a servo on what is held": (lambda: cn.Simulation(_with(cn.wall((0, 0), (0, 1), ROCK, force=cn.Servo(1e3, (0, 1)))), 1e-3),
                                "the body is held"),
    # files
    "a run that is not": (lambda: cn.load("nope.vtkhdf"), "no such file"),
    "a text for a run": (lambda: of_text("hi", cn.load), "not an HDF5 file"),
    "a number for a run": (lambda: cn.load(3), "name of a .vtkhdf file"),
    "a folder for a run": (lambda: sim().run(steps=1, output=".", progress=False), "HDF5 file|folder"),
    "a run called .vtk": (lambda: sim().run(steps=1, output="a.vtk", progress=False), "ends in .vtkhdf"),
    "a folder that is not": (lambda: sim().run(steps=1, output="no/such/a.vtkhdf", progress=False), "no such file or folder"),
    "a record that is not": (lambda: loads.read_accelerogram("nope.csv"), "nope.csv: no such file"),
    "an empty record": (lambda: of_text("", loads.read_accelerogram), "no row of numbers"),
    "a drawing that is not": (lambda: importing.read("nope.stl"), "does not exist"),
    "a drawing of another kind": (lambda: of_text("x", importing.read), "give one of .stl"),
    "a checkpoint that is a run": (lambda: (run(), sim().restore("a.vtkhdf")), "not a checkpoint"),
    "another format": (lambda: (run(), convert("a.vtkhdf", "a.xyz")), "choose one of .csv"),
    "globes of two faces": (lambda: (run(), convert("a.vtkhdf", "a.vtp", around=2)), "around is 2"),
    "output 99": (lambda: run()[99], "holds 3"),
    "a sweep called by its module": (lambda: study.sweep("nope.toml"), "nope.toml"),
    "a document by its name": (lambda: documents.scene_of("drop.json"), "no object"),
    "a folder that is no DATBOX": (lambda: cn.legacy.read_datbox("nope"), "give a DATBOX folder"),
}  # fmt: skip


def _with(*sets):
    made = cn.Scene(2)
    made.add(*sets)
    return made


def _ruled(name):
    made = scene()
    made.interact(name, "rock", cn.Coulomb(mu=0.4))
    return made


RAW = ("broadcast", "unsupported operand", "subscriptable", "has no len", "positional arguments but", "unexpected keyword",
       "object is not", "[Errno", "NoneType", "dictionary update", "could not convert")  # fmt: skip


@pytest.mark.parametrize("mistake", ERRORS)
def test_mistakes_are_answered(mistake, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    call, words = ERRORS[mistake]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(Exception, match=words) as caught:
            call()
    told = str(caught.value)
    assert not any(raw in told for raw in RAW) and len(told) < 700


WARNINGS = {
    "wall whose normal points away": (lambda: _behind().step(), "lie behind wall"),
    "spheres at one place": (lambda: cn.Simulation(_twice(), 1e-3).step(), "overlap by more than"),
    "young in GPa": (lambda: masonry.mesh(WALL, young=20.0), "2e10 for 20 GPa"),
    "no law": (lambda: cn.Simulation(scene(law=False), 1e-3), "no law is declared"),
    "faster than a body is thick": (lambda: _fast().step(), "passed through"),
}


def _behind():
    made = _with(cn.disks([(k, 0.5) for k in range(4)], 0.4, ROCK), cn.wall((0, 0), (0, -1), ROCK))
    made.interact("*", "*", cn.Coulomb(mu=0.3))
    return cn.Simulation(made, 1e-3)


def _twice():
    made = scene(3)
    made.add(cn.spheres([(5, 5, 5), (5, 5, 5)], 0.5, ROCK))
    return made


def _fast():
    made = cn.Scene(3)
    made.add(cn.spheres([(0, 0, 0)], 0.01, ROCK, velocity=(0, 0, -100, 0, 0, 0)),
             cn.boxes([(0, 0, -0.15)], (1, 1, 0.02), ROCK, fixed=True))  # fmt: skip
    made.interact("*", "*", cn.Coulomb(mu=0.5))
    return cn.Simulation(made, 1e-2)


@pytest.mark.parametrize("mistake", WARNINGS)
def test_what_may_be_meant_is_warned_of(mistake):
    call, words = WARNINGS[mistake]
    with pytest.warns(UserWarning, match=words):
        call()


def test_units_are_told_by_explain():
    angle = cn.Scene(2)
    angle.add(cn.disks([(0, 0)], 0.5, cn.Material("light", density=2.6)))
    angle.interact("*", "*", cn.Coulomb(mu=30))
    told = cn.Simulation(angle, 1e-3).explain()
    assert "mu 30: 88 degrees" in told and "weighs 2.04" in told and "light 2.6" in told


@pytest.mark.parametrize("words, told", [
    (["rum", "a.py"], "did you mean 'run'"), (["run", "nope.py"], "no such script"), (["info", "nope.vtkhdf"], "no such file"),
    (["check", "nope.json"], "cannot be read"), (["convert", "nope.vtkhdf"], "missing: out"),
    (["sweep", "nope.toml"], "nope.toml"),
    (["verify", "nope", "nope"], "nope"), (["view", "nope.vtkhdf", "--html", "x.html"], "no such file"),
    (["run", "x.scene.h5"], "x.scene.h5"), (["new-law", "a b"], "small letters"), (["solve", "nope.hdf5"], "no such file"),
    (["import", "nope.stl"], "does not exist"), (["plot", "nope.vtkhdf", "-o", "x.png"], "no such file"),
])  # fmt: skip
def test_the_shell_answers_in_a_line(words, told, capsys):
    try:
        status = main(words)
        said = capsys.readouterr().err
    except SystemExit as end:
        status, said = end.code, capsys.readouterr().err + str(end.code)
    assert status and told in said and "Traceback" not in said


def test_a_script_names_the_line_of_its_mistake(tmp_path, capsys):
    script = tmp_path / "pile.py"
    script.write_text("import cairn as cn\ncn.disks([(0, 0)], -1, cn.Material('a', density=1.0))\n", encoding="utf-8")
    assert main(["run", str(script)]) == 1
    assert "line 2: radii is -1" in capsys.readouterr().err


def test_a_document_that_is_no_json_names_the_line(tmp_path, capsys):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps({"dim": 2})[:-1], encoding="utf-8")
    assert main(["check", str(path)]) == 1 and "line 1" in capsys.readouterr().err


@pytest.mark.parametrize("strategy", [None, cn.SmoothDEM()])
def test_texts_as_a_step(strategy):
    made = scene()
    for word, told in (("stabel", "did you mean 'stable'"), ("1e-3", "dt is '1e-3': give a finite number > 0")):
        with pytest.raises(ValueError, match=told):
            cn.Simulation(made, word, strategy)
    there = sim()
    for call in (lambda: setattr(there, "dt", "stable"), lambda: there.step("stable")):
        with pytest.raises(ValueError, match="dt is 'stable': give a finite number > 0"):
            call()


def test_a_run_that_ends_before_its_first_step_is_told():
    there = sim(dt=1e-3)
    with pytest.warns(UserWarning, match="until is 0.0004, 0.0004 s from now, less than half a step"):
        assert there.run(until=4e-4, progress=False) == 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert there.run(until=6e-4, progress=False) == 1
        assert there.run(until=1e-3, progress=False) == 0  # there already
        for k in range(2, 40):  # sums of steps miss the times by rounding
            assert there.run(until=k * 1e-3, progress=False) == 1
