"""Texts of scenes, runs and commands: short in print, and with the remedy after a mistake."""

import csv
import subprocess
import sys

import cairn as cn
import numpy as np
import pytest
from cairn.post.verify import verify
from cairn.pre.loads import Accelerogram
from small_scenes import ROCK


def small(dim=2, **options):
    scene = cn.Scene(dim, gravity=(*[0.0] * (dim - 1), -9.81))
    centers = np.zeros((3, dim))
    centers[:, 0], centers[:, -1] = [0.0, 1.0, 3.0], 0.5
    scene.add((cn.disks if dim == 2 else cn.spheres)(centers, [0.5, 0.4, 0.1], ROCK, **options))
    scene.add(cn.wall([0.0] * dim, np.eye(dim)[-1], ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=30))
    return scene


# ---------------------------------------------------------------------- what is printed


@pytest.mark.parametrize("dim", [2, 3])
def test_print_gives_ten_lines(dim):
    scene = small(dim)
    x = [*scene.sets[0].position[0]], [*scene.sets[0].position[1]]
    scene.join(0, 1, cn.Distance(points=x))
    for k in range(20):
        scene.interact("rock", f"other {k}" if k else "rock", cn.Coulomb(mu=0.1 * k))
    for shown in (scene, cn.Scene(dim)):
        assert len(str(shown).splitlines()) <= 10 and str(shown).startswith(f"Scene, {dim}D")
    assert repr(scene).startswith(f"<scene, {dim}D: 4 bodies") and "\n" not in repr(scene)
    text = str(scene)
    assert "rigid bodies: 4: 3 " in text and "joints: 1" in text and "more laws" in text and "materials: rock" in text
    for s in scene.sets:
        assert len(repr(s)) < 300 and "rock" in repr(s)
    record = Accelerogram(np.arange(2000) * 0.01, np.sin(np.arange(2000.0)), "quake")
    assert str(record) == "<accelerogram 'quake': 2,000 samples from 0 to 19.99 s, 0.01 s apart, peak 1 m/s2>"


def test_print_of_a_simulation():
    sim = cn.Simulation(small(), 1e-3)
    assert repr(sim) == "<simulation, 2D: 4 bodies, t = 0 s, 0 steps of 0.001 s>"
    sim.step()
    assert repr(sim).endswith("1 steps of 0.001 s, the last converged>")


def test_explain_tells_angles_and_weights():
    text = cn.Simulation(small(), 1e-3).explain()
    assert "mu 30: 88 degrees" in text
    heavy, light = (ROCK.density * np.pi * r**2 for r in (0.5, 0.1))
    assert f"the largest body, 0 (0.5 m in radius), weighs {heavy:g} kg" in text
    assert f"the smallest body, 2 (0.1 m in radius), weighs {light:g} kg" in text
    assert f"densities: rock {ROCK.density:g} kg/m3" in text
    scene = cn.Scene(3)
    scene.add(cn.boxes([[0, 0, 0], [9, 0, 0]], [[1, 1, 1], [2, 2, 2]], ROCK))
    scene.interact("*", "*", cn.MohrCoulomb(tension=1.0, cohesion=1.0, friction=1.0, mu=0.5))
    text = cn.Simulation(scene, 1e-3).explain()
    assert "MohrCoulomb, mu 0.5: 27 degrees, friction 1: 45 degrees" in text
    assert "the largest body, 1 (" in text and f"weighs {8 * ROCK.density:g} kg" in text


# ---------------------------------------------------------------------- what is refused


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("fast", [1e200, -1e155, 1e308])
def test_velocities_whose_square_is_no_number(dim, fast):
    dofs, told = 3 * dim - 3, r"is -?1e\+\d+: energies take its square, which is too large for a number; give less than 3e150"
    with pytest.raises(ValueError, match=r"velocity\[0, 0\] " + told):
        small(dim, velocity=[fast] + [0.0] * (dofs - 1))
    with pytest.raises(ValueError, match=r"drive\[0, 0\] " + told):
        small(dim, driven="vx", drive=[fast] + [0.0] * (dofs - 1))
    sim = cn.Simulation(small(dim), 1e-3)
    before = sim.bodies.velocity.copy()
    with pytest.raises(ValueError, match="velocity.*" + told):
        sim.bodies.set(velocity=np.full_like(before, fast))
    with pytest.raises(ValueError, match="velocity|drive.*" + told):
        sim.drive([0], "vx", fast)
    assert np.array_equal(sim.bodies.velocity, before)


def test_a_body_that_a_force_makes_too_fast_is_named():
    scene = small(force=(1e300, 0.0, 0.0))
    sim = cn.Simulation(scene, 1e-3)
    with pytest.raises(ValueError, match="velocity: disk .* of body 0 moves farther in a step|position: disk"):
        for _ in range(3):
            sim.step()


@pytest.mark.parametrize("thin", [1e-9, 1e-12])
def test_a_hull_that_is_flat_is_told_its_thickness(thin):
    corners = [[x, y, z] for z in (0, thin) for y in (0, 1) for x in (0, 1)]
    faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    told = rf"it is {thin:g} m thick and 1 m long: it counts as flat; give it more than 1e-07 of that"
    for made in (lambda: cn.polyhedra([(np.array(corners), faces)], ROCK), lambda: cn.boxes([[0, 0, 0]], (1, 1, thin), ROCK)):
        scene = cn.Scene(3)
        with pytest.raises(ValueError, match=told):
            scene.add(made())
            cn.Simulation(scene, 1e-3)


@pytest.mark.parametrize("number", [2**64 - 1, 2**63, 2**70])
def test_ids_that_no_body_can_have(number):
    sim = cn.Simulation(small(), 1e-3)
    for ids in (number, [0, number], *([np.array([number], np.uint64)] if number < 2**64 else [])):
        for call in (sim.remove, lambda ids: sim.drive(ids, "vx", 1.0), sim.merge):
            with pytest.raises(ValueError, match=f"there is no body {number}; it was never added, or was removed"):
                call(ids)
    assert len(sim.bodies) == 4


def test_a_folder_that_takes_no_files(tmp_path):
    """/proc is there, and no file can be made in it: the system says that there is none."""
    sim = cn.Simulation(small(), 1e-3)
    told = "/proc/x.vtkhdf: cannot be written: the folder /proc takes no files; choose another folder"
    with pytest.raises(cn.FileError, match=told):
        sim.run(steps=2, output="/proc/x.vtkhdf", progress=False)
    with pytest.raises(cn.FileError, match="the folder /proc takes no files"):
        sim.checkpoint("/proc/x.h5")
    with pytest.raises(cn.FileError, match="no such file or folder; check the path, or make the folder first"):
        sim.run(steps=2, output=tmp_path / "none" / "x.vtkhdf", progress=False)


@pytest.mark.parametrize("dim", [2, 3])
def test_options_of_pictures_that_other_programs_have(dim, tmp_path):
    pytest.importorskip("matplotlib")
    sim = cn.Simulation(small(dim), 1e-3)
    sim.run(steps=2, every=1, output=tmp_path / "run.vtkhdf", progress=False)
    run = cn.load(tmp_path / "run.vtkhdf")
    for name in ("colormap", "colourmap"):
        with pytest.raises(TypeError, match=f"no argument '{name}'.*did you mean 'cmap'"):
            run.plot(**{name: "viridis"})
        with pytest.raises(TypeError, match=f"no argument '{name}'.*did you mean 'cmap'"):
            run.animate(tmp_path / "film.gif", **{name: "viridis"})
    with pytest.raises(TypeError, match="no argument 'vmin'.*did you mean 'limits'"):
        run.plot(vmin=0.0)
    with pytest.raises(TypeError, match="plot_bonds has no argument 'colormap'; it has step, ax, width"):
        run.plot_bonds(colormap="viridis")


# ---------------------------------------------------------------------- files of other programs


def test_runs_whose_scene_tells_no_step_are_verified(tmp_path):
    """Runs written by programs in C and Fortran: the length of each step is that of the history."""
    h5py = pytest.importorskip("h5py")
    sim = cn.Simulation(small(), 1e-3)
    sim.run(steps=40, every=10, output=tmp_path / "a.vtkhdf", progress=False)
    with h5py.File(tmp_path / "a.vtkhdf") as one, h5py.File(tmp_path / "b.vtkhdf", "w") as other:
        for name in one:
            one.copy(name, other)
        other.attrs.update(one.attrs)
        del other["cairn/scene/dt"]
    found = verify(tmp_path / "a.vtkhdf", tmp_path / "b.vtkhdf", {"position": 0, "velocity": 0, "force": 1e-12})
    assert found.agrees and len(found.rows) >= 4, found.table()
    with h5py.File(tmp_path / "b.vtkhdf", "a") as other:
        other["cairn/history/dt"][...] = 2e-3
    assert not verify(tmp_path / "a.vtkhdf", tmp_path / "b.vtkhdf", {"force": 0.1}).agrees


def test_a_run_of_a_program_in_fortran_is_verified(tmp_path):
    from programs import BUILT

    if BUILT is None or not (BUILT / "heap").exists():
        pytest.skip("CAIRN_BUILD names no build with heap: build the tests of C++")
    subprocess.run([BUILT / "heap"], cwd=tmp_path, check=True, capture_output=True, timeout=120)
    found = verify(tmp_path / "heap.vtkhdf", tmp_path / "heap.vtkhdf", {"position": 0, "velocity": 0, "force": 0})
    assert found.agrees and len(found.rows) == 9 and found.rows[-1]["force"] == 0
    from cairn import cli

    assert cli.main(["verify", str(tmp_path / "heap.vtkhdf"), str(tmp_path / "heap.vtkhdf")]) == 0


# ---------------------------------------------------------------------- modules beside a script


def test_a_module_beside_the_script_of_a_sweep(tmp_path):
    """Modules that it imports in turn are found as well; points are run again where one of them changed."""
    study = tmp_path / "study"
    study.mkdir()
    (study / "helper.py").write_text("from deeper import FACTOR\n\ndef twice(x):\n    return FACTOR * x\n")
    (study / "deeper.py").write_text("FACTOR = 2\n")
    (study / "heap.py").write_text("import helper\n\ndef run(p):\n    return {'y': helper.twice(p['x'])}\n")
    (study / "study.toml").write_text('script = "heap.py"\n[parameters]\nx = [1.0, 2.0]\n')

    def swept():
        command = [sys.executable, "-m", "cairn", "sweep", str(study / "study.toml"), "-j", "1", "-q"]
        ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
        assert ended.returncode == 0, ended.stdout + ended.stderr
        with open(study / "study" / "results.csv", newline="") as file:
            return {row["point"]: float(row["y"]) for row in csv.DictReader(file)}

    first = swept()
    assert sorted(first.values()) == [2.0, 4.0]
    (study / "deeper.py").write_text("FACTOR = 3\n")
    then = swept()
    assert sorted(then.values()) == [3.0, 6.0] and not set(first) & set(then)


def test_modules_beside_targets_of_a_study(tmp_path):
    """Two scripts in different folders each import the module beside them."""
    from cairn.study.targets import Target

    made = []
    for k, radius in enumerate((0.1, 0.2)):
        folder = tmp_path / f"case {k}"
        folder.mkdir()
        (folder / "sizes_of_it.py").write_text(f"RADIUS = {radius}\n")
        (folder / "scene.py").write_text(
            "import cairn as cn\nimport sizes_of_it\nDT = 1e-3\n\n\ndef build():\n    scene = cn.Scene(2)\n"
            "    scene.add(cn.disks([[0, 0]], sizes_of_it.RADIUS, cn.Material('rock', density=1000.0)))\n"
            "    scene.interact('*', '*', cn.Coulomb(mu=0.3))\n    return scene\n"
        )
        made.append(Target(folder / "scene.py").simulation().radii()[0])
    assert made == [0.1, 0.2]
