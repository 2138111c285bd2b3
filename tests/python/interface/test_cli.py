"""The command line, on made-up runs; what needs the compiled part is tested with it."""

import csv
import json
import subprocess
import sys

import cairn as cn
import h5py
import numpy as np
import pytest
from cairn import cli
from made_up import bodies, contacts, write


@pytest.fixture
def run_file(tmp_path):
    path = tmp_path / "run.vtkhdf"
    write(path, 4).close()
    return path


def call(capsys, *arguments):
    status = cli.main([str(a) for a in arguments])
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def test_help_teaches(capsys):
    status, out, _ = call(capsys)
    assert status == 2 and "cairn run pile.py" in out and "cairn convert pile.vtkhdf pile.csv" in out
    for command in ("run", "import", "info", "plot", "convert", "view"):
        with pytest.raises(SystemExit) as exit_:
            cli.main([command, "--help"])
        assert exit_.value.code == 0
        assert f"cairn {command} " in capsys.readouterr().out.partition("examples:")[2]
    assert call(capsys, "--version")[1].startswith("cairn ")
    with pytest.raises(SystemExit) as exit_:
        cli.main(["dance"])
    assert exit_.value.code == 2


def test_info(run_file, capsys):
    status, out, _ = call(capsys, "info", run_file)
    assert status == 0
    for words in ("run, 2D", "0 to 0.3 s", "converged 4", "rock, sand, clay"):
        assert words in out
    facts = json.loads(call(capsys, "info", run_file, "--json")[1])
    assert facts["outputs"]["count"] == 4 and facts["outputs"]["bodies"] == 20
    assert facts["solver"]["error, largest"] == "1"
    assert call(capsys, "info", run_file, "--repair")[1].startswith("nothing to repair")


def test_info_of_a_checkpoint(tmp_path, capsys):
    from cairn.files.checkpoint import save

    save(tmp_path / "a.checkpoint.h5", {"kind": "checkpoint", "dim": 2, "state": {"x": np.arange(3)}})
    out = call(capsys, "info", tmp_path / "a.checkpoint.h5")[1]
    assert "checkpoint" in out and "1 entries" in out


def test_errors_are_one_line(tmp_path, capsys):
    bad = tmp_path / "bad.vtkhdf"
    bad.write_text("hello")
    for arguments, words in (
        (("info", tmp_path / "none"), "no such file or folder; check the path"),
        (("info", bad), "this is not an HDF5 file; give a .vtkhdf file"),
        (("plot", bad), "not an HDF5 file"),
        (("convert", bad, tmp_path / "a.csv"), "not an HDF5 file"),
    ):
        status, out, err = call(capsys, *arguments)
        assert status == 1 and out == ""
        assert err.startswith("cairn: error: ") and words in err and err.count("\n") == 1


def test_plot(run_file, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    for what, name in (
        ("velocity", "a.png"),
        ("forces", "b.pdf"),
        ("energy", "c.svg"),
        ("residual", "d.png"),
        ("material", "e.gif"),
    ):
        status, out, _ = call(capsys, "plot", run_file, "--what", what, "-o", tmp_path / name, "--dpi", 50)
        assert status == 0 and out.strip() == str(tmp_path / name) and (tmp_path / name).stat().st_size > 1000
    assert call(capsys, "plot", run_file, "--time", 0.1)[1].strip() == str(tmp_path / "run_velocity.png")
    status, _, err = call(capsys, "plot", run_file, "--what", "colour")
    assert status == 1 and "no field 'colour'; there are position" in err
    status, _, err = call(capsys, "plot", run_file, "--step", 9)
    assert status == 1 and "output 9 was asked for" in err


def test_convert_to_csv(run_file, tmp_path, capsys):
    out = tmp_path / "a.csv"
    assert call(capsys, "convert", run_file, out)[0] == 0
    with open(out) as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 80 and {"step", "time", "x", "y", "vx", "vy", "w", "radius"} <= set(rows[0])
    assert np.array_equal([float(r["vx"]) for r in rows[60:]], bodies(3)["velocity"][:, 0])  # to the bit
    status, _, err = call(capsys, "convert", run_file, out)
    assert status == 1 and "exists already" in err
    assert call(capsys, "convert", run_file, out, "--overwrite", "--what", "contacts", "--step", 1)[0] == 0
    with open(out) as file:
        rows = list(csv.DictReader(file))
    assert np.array_equal([float(r["impulse_y"]) for r in rows], contacts(1)["impulse"][:, 1])
    assert call(capsys, "convert", run_file, out, "--overwrite", "--what", "history")[0] == 0
    assert "energy_kinetic" in out.read_text().splitlines()[0]
    status, _, err = call(capsys, "convert", run_file, tmp_path / "a.stl")
    assert status == 1 and "choose one of .csv" in err


def test_convert_to_numpy_and_hdf5(run_file, tmp_path, capsys):
    assert call(capsys, "convert", run_file, tmp_path / "a.npz")[0] == 0
    with np.load(tmp_path / "a.npz") as data:
        assert np.array_equal(data["00002/bodies/velocity"], bodies(2)["velocity"])
        assert np.array_equal(data["step"], np.arange(4))
    assert call(capsys, "convert", run_file, tmp_path / "a.h5", "--step", 2)[0] == 0
    with h5py.File(tmp_path / "a.h5") as file:
        assert np.array_equal(file["00002/contacts/normal"], contacts(2)["normal"])
        assert set(file) == {"00002", "history", "step", "time", "time_detection"}


@pytest.mark.parametrize("kind", ["vtp", "vtu"])
def test_convert_to_vtk(run_file, tmp_path, capsys, kind):
    pytest.importorskip("vtk")
    pyvista = pytest.importorskip("pyvista")
    assert call(capsys, "convert", run_file, tmp_path / f"a.{kind}")[0] == 0
    grid = pyvista.read(tmp_path / f"a_bodies_0003.{kind}")
    assert np.array_equal(grid.points[:, :2], bodies(3)["position"])
    assert np.array_equal(grid["spin"].ravel(), bodies(3)["velocity"][:, 2])
    assert pyvista.read(tmp_path / f"a_contacts_0000.{kind}").n_points == 0
    assert pyvista.get_reader(tmp_path / "a_bodies.pvd").time_values == [0.0, 0.1, 0.2, 0.1 * 3]


@pytest.mark.parametrize("dim", [2, 3])
def test_surfaces_open_at_all_times_in_both_readers(tmp_path, capsys, dim):
    """Triangles of all bodies that move, with the fields of their bodies, and contacts: PyVista, and VTK's own reader."""
    vtk = pytest.importorskip("vtkmodules.vtkIOXML")
    pyvista = pytest.importorskip("pyvista")
    from small_scenes import heap

    sim = cn.Simulation(heap(dim), 1e-3, overlap="ignore")
    sim.run(steps=60, output=tmp_path / "a.vtkhdf", every=20, progress=False)
    assert call(capsys, "convert", tmp_path / "a.vtkhdf", tmp_path / "a.vtp")[0] == 0
    run = cn.load(tmp_path / "a.vtkhdf")
    series = pyvista.get_reader(tmp_path / "a_surfaces.pvd")
    assert series.time_values == list(run.times)
    for step in run:
        series.set_active_time_value(step.time)
        surface = series.read()[0]
        of_bodies = {int(i): surface.extract_cells(np.flatnonzero(surface["id"] == i)) for i in (0, 7)}
        for i, cells in of_bodies.items():
            place, radius = step.bodies.position[step.rows_of([i])[0]], step.bodies.radius[step.rows_of([i])[0]]
            assert np.allclose(cells.center[:dim], place, atol=0.02 * radius)
            assert cells.bounds[1] - cells.bounds[0] == pytest.approx(2 * radius, rel=0.02)
        assert np.array_equal(np.unique(surface["mass"]), np.unique(step.bodies.mass[step.bodies.radius > 0]))
    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(str(tmp_path / f"a_surfaces_{len(run) - 1:04d}.vtp"))
    reader.Update()
    assert reader.GetOutput().GetNumberOfPolys() == surface.n_cells
    contacts = pyvista.get_reader(tmp_path / "a_contacts.pvd")
    contacts.set_active_time_value(contacts.time_values[-1])
    points = contacts.read()[0]
    assert np.array_equal(points["impulse"][:, :dim], run[-1].contacts.impulse) and points.n_points > 10


def test_run_a_script(tmp_path, capsys):
    script = tmp_path / "hello.py"
    script.write_text("import sys, beside\nprint(__name__, sys.argv[1:], beside.x)\n")
    (tmp_path / "beside.py").write_text("x = 3\n")
    assert call(capsys, "run", script, "--steps", "5")[1] == "__main__ ['--steps', '5'] 3\n"
    script.write_text("import sys\nprint(sys.argv[0].endswith('hello.py'))\n")
    status, out, err = call(capsys, "run", script, "--dt", "5e-3")
    assert (status, out) == (0, "True\n") and "reads no options, so --dt 5e-3 had no effect" in err
    assert not call(capsys, "run", script)[2]
    parsed = "__import__('argparse').ArgumentParser().parse_known_args()"
    own = ("'--dt' in sys.argv", "sys.argv.index('--dt')", "sys.argv.pop(1)", "sys.argv.remove('--dt')", "sys.argv.copy()")
    for reads in ("len(sys.argv)", "sys.argv[1:]", "[*sys.argv]", parsed, *own):
        script.write_text(f"import sys\n{reads}\n")
        assert not call(capsys, "run", script, "--dt", "5e-3")[2]
    with pytest.raises(SystemExit, match="no such script"):
        cli.main(["run", str(tmp_path / "none.py")])


def test_run_a_scene(tmp_path, capsys):
    cn = pytest.importorskip("cairn")
    if not hasattr(cn, "Simulation"):
        pytest.skip("the compiled part is not there")
    rock = cn.Material("rock", density=2000.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks([[0, 0.6], [0.2, 1.7]], 0.5, rock), cn.wall(point=(0, 0), normal=(0, 1), material=rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    path, out = tmp_path / "pile.scene.h5", tmp_path / "pile.vtkhdf"
    scene.save(path)
    status, _, err = call(capsys, "run", path, "--steps", 5)
    assert status == 1 and "give one, --dt" in err
    status, text, _ = call(capsys, "run", path, "--dt", 1e-2, "--steps", 100, "--every", 10, "--checkpoint-every", 50)
    assert status == 0 and "100 steps, t = 1 s" in text
    with cn.load(out) as run:
        assert len(run) == 11 and run.history["contacts"].max() >= 2
        assert run[-1].bodies.position[0, 1] == pytest.approx(0.5, abs=0.01)
        run.plot(what="material"), run.plot_force_chains(), run.plot_energy()
    status, _, err = call(capsys, "run", path, "--dt", 1e-2, "--steps", 5)
    assert status == 1 and "exists already" in err
    restart = tmp_path / "pile.checkpoint.h5"
    assert call(capsys, "run", path, "--dt", 1e-2, "--steps", 5, "--restart", restart, "-o", tmp_path / "b.vtkhdf")[0] == 0
    with cn.load(tmp_path / "b.vtkhdf") as run:
        assert run[-1].step == 105
    assert "pile" in call(capsys, "info", out)[1]
    assert "checkpoint" in call(capsys, "info", restart)[1] and "scene" in call(capsys, "info", path)[1]


def test_import_blocks(tmp_path, capsys):
    """A file of an L on a step: the report, a scene that runs, and errors in one line with the shell's remedies."""
    from shape_pairs import L, prism

    def obj(path, bodies):
        lines, count = [], 1
        for v, faces in bodies:
            lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in v.tolist()]
            lines += ["f " + " ".join(str(i + count) for i in f) for f in faces]
            count += len(v)
        path.write_text("\n".join(lines))

    block = prism([[0, 0], [2, 0], [2, 2], [0, 2]], 1.0)
    upper = prism(L, 1.0)
    path, scene, out = tmp_path / "two.obj", tmp_path / "two.scene.h5", tmp_path / "two.vtkhdf"
    obj(path, [block, (upper[0] + [0, 0, 1], upper[1])])
    status, said, _ = call(capsys, "import", path)
    assert status == 0 and "2 blocks, 2 closed" in said and "3 convex parts" in said and "2 joints" in said
    status, said, _ = call(capsys, "import", path, "--hold", "lowest", "-o", scene, "--density", 1000, "--scale", 0.5)
    assert status == 0 and "held: 1 blocks (lowest)" in said and f"cairn run {scene}" in said
    assert call(capsys, "run", scene, "--dt", 1e-3, "--steps", 5, "--output", out, "-q")[0] == 0
    with cn.load(out) as run:
        assert run[-1].bodies["mass"].min() == pytest.approx(3000 / 8)
        assert np.abs(run[-1].bodies["velocity"]).max() < 1e-3
    assert "a floor at 0 m" in call(capsys, "import", path, "-o", tmp_path / "floor.scene.h5")[1]
    status, _, error = call(capsys, "import", path, "--hold", "support", "-o", scene)
    assert status == 1 and 'no block is named "support"' in error
    obj(path, [(block[0], block[1][1:])])
    status, _, error = call(capsys, "import", path)
    assert status == 1 and "block 0 is open" in error and "--repair" in error and error.count("\n") == 1
    assert "1 repaired" in call(capsys, "import", path, "--repair")[1]


def test_the_package_runs_as_the_command():
    told = subprocess.run([sys.executable, "-m", "cairn", "--version"], capture_output=True, text=True, check=True)
    assert cn.__version__ in told.stdout


@pytest.mark.parametrize("shell", ("bash", "zsh", "tcsh"))
def test_shells_complete_every_command(capsys, shell):
    pytest.importorskip("shtab")
    status, out, _ = call(capsys, "completion", shell)
    assert status == 0 and all(name in out for name in cli.COMMANDS) and "checkpoint-every" in out
