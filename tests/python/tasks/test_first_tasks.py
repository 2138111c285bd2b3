"""Tasks of newcomers, from the pages alone: a picture, a mesh of Gmsh that falls, a folder of LMGC90, a law in Fortran with a
deck, a calibration, a coupled run, a sweep."""

import csv
import shutil
import subprocess
import sys
import types

import cairn as cn
import numpy as np
import pytest
from cairn.cli import main
from optional import reader_of_step

PILE = """
import cairn as cn
import numpy as np

rock = cn.Material("rock", density=2800.0)
scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
scene.add(cn.disks([(1.1 * x, 0.6 + y) for y in range(3) for x in range(4)], 0.5, rock))
scene.add(cn.wall(point=(0, 0), normal=(0, 1), material=rock))
scene.interact(rock, rock, cn.Coulomb(mu=0.4))
sim = cn.Simulation(scene, dt=2e-3)
sim.run(steps=40, output="pile.vtkhdf", every=20, progress=False)
"""


def test_from_an_installed_package_to_a_picture(tmp_path):
    (tmp_path / "pile.py").write_text(PILE)
    for words in (["run", "pile.py"], ["plot", "pile.vtkhdf", "-o", "pile.png"]):
        done = subprocess.run([sys.executable, "-m", "cairn", *words], cwd=tmp_path, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "pile.png").stat().st_size > 5000


def test_a_mesh_of_gmsh_falls(tmp_path):
    gmsh = reader_of_step()
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.occ.addDisk(0.0, 0.3, 0.0, 0.2, 0.2)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(2, [1], name="disk")
    gmsh.model.addPhysicalGroup(1, [1], name="rim")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.1)
    gmsh.model.mesh.generate(2)
    gmsh.write(str(tmp_path / "disk.msh"))
    gmsh.finalize()

    body = cn.ElasticBody.read(tmp_path / "disk.msh", young=1e7, poisson=0.3, density=1000.0)
    rubber, scene = cn.Material("rubber", density=1000.0), cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.deformable(body, rubber, contact="rim"), cn.wall((0, 0), (0, 1), rubber))
    scene.interact(rubber, rubber, cn.GapCoulomb(mu=0.5))
    sim = cn.Simulation(scene, dt=1e-3)
    lowest = []
    sim.run(steps=200, output=tmp_path / "disk.vtkhdf", every=50, progress=False,
            callback=lambda s: lowest.append(s.nodes.position[:, 1].min()))  # fmt: skip
    fallen = 0.1 - 0.5 * 9.81 * 0.1**2
    assert lowest[99] == pytest.approx(fallen, abs=1e-3)  # still in the air after 0.1 s
    assert -2e-3 < min(lowest) < 2e-3 and lowest[-1] > 0.01  # it touched the wall and bounced
    assert len(cn.load(tmp_path / "disk.vtkhdf")) == 5


def test_a_folder_of_lmgc90_to_paraview(tmp_path, monkeypatch, capsys):
    from small_datbox import SEE, body, contactor, held, write

    bodies = body("RBDY2", contactor("DISKx", 0.1, label="byr").replace("byr1", "byrd"), at=(0.0, 0.15, 0.0))
    bodies += body("RBDY2", contactor("JONCx", 1.0, 0.05), at=(0.0, -0.05, 0.0), number=2)
    write(tmp_path / "case", bodies, SEE.format("RBDY2", "DISKx", "JONCx", "BLEUx"), drives=held("RBDY2", 2))
    monkeypatch.chdir(tmp_path)
    assert main(["convert", "case"]) == 0 and "DISKx" in capsys.readouterr().out
    assert main(["convert", "case", "case.scene.h5"]) == 0
    assert main(["run", "case.scene.h5", "--dt", "1e-3", "--steps", "200", "--every", "100", "-q"]) == 0
    assert cn.load("case.vtkhdf")[-1].bodies["position"][0, 1] == pytest.approx(0.1, abs=1e-3)
    pytest.importorskip("pyvista")
    series = cn.open_series("case.vtkhdf")  # VTK's reader, which is ParaView's
    assert len(series) == 3 and series[-1]["surfaces"].n_points > 0


LAW = """
      SUBROUTINE RDDECK(NAME)
      CHARACTER*(*) NAME
      DOUBLE PRECISION FRIC
      COMMON /DECK/ FRIC
      OPEN(17, FILE=NAME, STATUS='OLD')
      READ(17, *) FRIC
      CLOSE(17)
      END
      SUBROUTINE MYLAW(GAP, H, BIAS, F)
      DOUBLE PRECISION GAP, H, BIAS, F, FRIC
      COMMON /DECK/ FRIC
      BIAS = MAX(GAP, 0.D0)/H
      F = FRIC
      END
"""
INTERFACE = """
name = "my_law"
routine = "MYLAW"
sources = ["mylaw.f"]
slot = "prepare"
arguments = ["gap", "h", "bias1", "mu"]
init = "RDDECK"
deck = "friction.dat"
"""


@pytest.mark.skipif(not shutil.which("gfortran") or not shutil.which("gcc"), reason="no compilers")
def test_a_law_in_fortran_with_a_deck(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for name, text in (("mylaw.f", LAW), ("my_law.toml", INTERFACE), ("friction.dat", "0.25\n")):
        (tmp_path / name).write_text(text)
    assert main(["wrap-law", "my_law.toml"]) == 0
    build = capsys.readouterr().out.split("now:")[1].strip()
    subprocess.run(build, shell=True, check=True)
    law = cn.plug("libmy_law.so", law="my_law")
    rock, scene = cn.Material("rock", density=2000.0), cn.Scene(2, gravity=(9.81 * 0.5, -9.81))
    scene.add(cn.polygons([[[-0.2, 0.0], [0.2, 0.0], [0.2, 0.1], [-0.2, 0.1]]], rock), cn.wall((0, 0), (0, 1), rock))
    scene.interact(rock, rock, law())
    sim = cn.Simulation(scene, 1e-3)
    sim.run(steps=200, progress=False)
    assert sim.bodies.velocity[0, 0] == pytest.approx(9.81 * (0.5 - 0.25) * 0.2, rel=1e-3)


SLIDE = """
import cairn as cn


def run(parameters):
    rock = cn.Material("rock", density=2000.0)
    scene = cn.Scene(2, gravity=(9.81 * 0.7, -9.81))
    scene.add(cn.polygons([[[-0.2, 0.0], [0.2, 0.0], [0.2, 0.1], [-0.2, 0.1]]], rock), cn.wall((0, 0), (0, 1), rock))
    scene.interact(rock, rock, cn.Coulomb(mu=parameters["mu"]))
    sim = cn.Simulation(scene, 5e-3)
    sim.run(steps=15, progress=False)
    half = float(sim.bodies.position[0, 0])
    sim.run(steps=15, progress=False)
    return {"half": half, "way": float(sim.bodies.position[0, 0])}
"""


def test_a_sweep(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "slide.py").write_text(SLIDE)
    (tmp_path / "study.toml").write_text('script = "slide.py"\n\n[parameters]\nmu = [0.2, 0.4]\n')
    assert main(["sweep", "study.toml", "-j", "1"]) == 0
    with open("study/results.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    ways = {float(r["mu"]): float(r["way"]) for r in rows}
    for mu, way in ways.items():
        assert way == pytest.approx(0.5 * 9.81 * (0.7 - mu) * 0.15**2, rel=0.05)


def test_a_calibration(tmp_path, monkeypatch):
    gl = pytest.importorskip("grainlearning", reason="GrainLearning is not installed: pip install grainlearning")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "slide.py").write_text(SLIDE)
    callback = cn.study.GrainLearning("slide.py", processes=1)
    seen = {name: 0.5 * 9.81 * (0.7 - 0.3) * t**2 for name, t in (("half", 0.075), ("way", 0.15))}
    calibration = gl.BayesianCalibration.from_dict({
        "num_iter": 2, "callback": callback, "save_fig": -1,
        "system": {"system_type": gl.DynamicSystem, "sim_name": "slide", "num_samples": 6, "sigma_tol": 1e-3,
                   "param_names": ["mu"], "param_min": [0.1], "param_max": [0.6],
                   "obs_names": list(seen), "obs_data": [[v] for v in seen.values()], "ctrl_data": [0.0]},
        "inference": {"Bayes_filter": {"ess_target": 0.3}, "sampling": {"max_num_components": 1}},
    })  # fmt: skip
    calibration.run()
    assert calibration.system.estimated_params[-1] == pytest.approx(0.3, abs=0.05)


def test_a_coupled_run(tmp_path, monkeypatch):
    """A disk on a floor pushed by another program; without preCICE a stand-in with its interface answers."""
    try:
        import precice  # noqa: F401
    except ImportError:
        import dummy_precice

        class Partner(dummy_precice.Participant):
            partner = staticmethod(lambda t, written: {"Force": np.array([[5.0, 0.0]])})

        monkeypatch.setitem(sys.modules, "precice", types.SimpleNamespace(Participant=Partner))
    else:
        pytest.skip("preCICE is there: tests/python/interface/test_precice.py runs two processes")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "precice-config.xml").write_text("<precice-configuration/>")
    sand, scene = cn.Material("sand", density=2600.0), cn.Scene(2, gravity=(0.0, -9.81))
    ids = scene.add(cn.disks([(0.0, 0.05)], 0.05, sand))
    scene.add(cn.wall((0, 0), (0, 1), sand))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    sim = cn.Simulation(scene, dt=1e-3)
    coupling = cn.precice.Coupling("Grains", "precice-config.xml", sim)
    coupling.bodies("Grains-Mesh", ids, read={"Force": "force"}, write={"Displacement": "displacement"})
    assert coupling.run(output="coupled.vtkhdf", every=5) == 10  # windows
    assert len(cn.load("coupled.vtkhdf")) == 3
    # it rolls: force over 3/2 of its mass
    assert sim.bodies.velocity[0, 0] == pytest.approx(5.0 / (1.5 * sim.bodies.mass[0]) * sim.time, rel=0.02)
