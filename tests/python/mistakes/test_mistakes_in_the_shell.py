"""Mistakes that users make in the shell: each is answered by the mistake and its remedy, with an exit status."""

import os

import cairn as cn
import pytest
from cairn import cli
from small_scenes import heap

SCENE = "run s.scene.h5 --dt 1e-3 --steps 2"

# command, exit status, answer
MISTAKES = [
    ("rum pile.py", 2, "'rum' is none of run, import, ", "did you mean 'run'?", "see 'cairn --help'"),
    ("run", 2, "missing: SCRIPT_OR_SCENE", "see 'cairn run --help'"),
    ("run none.scene.h5 --dt 1e-3 --steps 2", 1, "none.scene.h5: no such file or folder; check the path"),
    ("run folder --dt 1e-3 --steps 2", 1, "folder: this is a folder; give the name of a file"),
    ("run notes.txt", 1, "notes.txt: this is not a scene; give a .scene.h5 file"),
    ("run r.vtkhdf --dt 1e-3 --steps 2", 1, "r.vtkhdf: this HDF5 file is not a scene; give a .scene.h5 file"),
    ("run c.checkpoint.h5 --dt 1e-3 --steps 2", 1, "holds no scene; give a file written by Scene.save"),
    ("run s.scene.h5", 1, "a scene has no time step of its own: give one, --dt 1e-3 [s] say"),
    ("run s.scene.h5 --dt 1e-3", 1, "say how long to run: --steps 1000, or --until 2.0 [s]"),
    ("run s.scene.h5 --dt -1 --steps 2", 1, "dt is -1.0: give a number > 0"),
    ("run s.scene.h5 --dt short --steps 2", 2, "argument --dt: 'short' is none: give a number, as in 1e-3"),
    ("run s.scene.h5 --dt 1e-3 --steps 1.5", 2, "argument --steps: '1.5' is none: give a whole number, as in 20"),
    (SCENE + " --ouput a.vtkhdf", 2, "there is no option --ouput; did you mean '--output'?"),
    (SCENE + " --output a.txt", 1, "this name ends in .txt; give a name that ends in .vtkhdf"),
    (SCENE + " --output r.vtkhdf", 1, "r.vtkhdf: this file exists already; choose another name"),
    (SCENE + " --output no/a.vtkhdf", 1, "no/a.vtkhdf: no such file or folder; check the path, or make the folder first"),
    (SCENE + " --solver NLGSS -o a.vtkhdf", 1, "--solver is 'NLGSS': give one of Default, NLGS", "did you mean 'NLGS'?"),
    (SCENE + " --tol 3 -o a.vtkhdf", 1, "tol is 3.0: give a number between 0 and 1"),
    (SCENE + " --restart s.scene.h5 -o a.vtkhdf", 1, "this file holds no checkpoint; give a file written by Simulation"),
    (SCENE + " --append --overwrite -o a.vtkhdf", 1, "append and overwrite are both True: give one of them"),
    (SCENE + " --dump-problem wurst -o b.vtkhdf", 1, "the step of the problem is 'wurst': give step=120, say, or worst"),
    ("run wrong.py", 1, "wrong.py, line 2: dim is 4: give 2 (disks) or 3 (spheres)"),
    ("info s.scene.h5 --script", 1, "this file holds a scene or a checkpoint, and no run", "give a .vtkhdf file"),
    ("info notes.txt", 1, "notes.txt: this is not an HDF5 file; give a .vtkhdf file"),
    ("plot r.vtkhdf --field rotation", 2, "there is no option --field; did you mean '--what'?"),
    ("plot r.vtkhdf --xyz rotation", 2, "there is no option --xyz; there are --help, --what"),
    ("info r.vtkhdf --jsn", 2, "there is no option --jsn; did you mean '--json'?"),
    ("plot r.vtkhdf --what velocty", 1, "there is no field 'velocty'; there are position", "did you mean 'velocity'?"),
    ("plot r.vtkhdf --step 99", 1, "output 99 was asked for; r.vtkhdf holds 3 (0 to 2)"),
    ("plot r.vtkhdf --time nan", 1, "time is nan: give a finite number"),
    ("plot r.vtkhdf -o a.xyz", 1, "a.xyz: pictures are no .xyz; give a name that ends in .png"),
    ("plot r.vtkhdf --dpi 0", 1, "dpi is 0: give a whole number >= 1"),
    ("convert r.vtkhdf a.xls", 1, "a.xls: the format .xls is not known; choose one of .csv"),
    ("convert r.vtkhdf a.csv --what contcts", 2,
     "'contcts' is none of bodies, nodes, contacts, fluid, history; did you mean 'contacts'?"),
    ("view r.vtkhdf --port 99999", 1, "port is 99999: give a whole number from 0 to 65535"),
    ("view r.vtkhdf --fields velocity", 1, "--fields is for a page: give --html PAGE too, or leave it out"),
    ("verify r.vtkhdf r.vtkhdf --tol positon=1", 1, "there is no norm 'positon'", "did you mean 'position'?"),
    ("verify r.vtkhdf r.vtkhdf --tol position=x", 1, "--tol position=x: write NAME=VALUE, as in position=1e-4"),
    ("verify r.vtkhdf r.vtkhdf --size -1", 1, "size is -1.0: give a number > 0"),
    ("import empty.stl", 1, "empty.stl holds no surface of any block: give a file of closed surfaces"),
    ("import notes.txt", 1, "notes.txt ends in '.txt': give one of .stl, .obj"),
    ("solve r.vtkhdf", 1, "it is no problem in the FCLIB layout; cairn.problems.write makes such files"),
    ("solve r.vtkhdf --solver nglss", 1, "there is no solver 'nglss': give one of auto, nlgs", "did you mean 'nlgs'?"),
    ("study s.scene.h5 --plan", 1, "a scene has no time step of its own: give one"),
    ("study s.scene.h5 --dt 1e-3 --of solidfraction --accuracy 1e-2", 1, "there is no figure 'solidfraction'", "solid_fraction"),
    ("study s.scene.h5 --dt 1e-3 --of solid_fraction --accuracy -1", 1, "--accuracy is -1.0: give a relative error between"),
    ("sweep notes.txt", 1, "notes.txt: this is no TOML", "see 'cairn sweep --help'"),
    ("sweep keys.toml -j 0", 1, "processes is 0: give a whole number >= 1"),
    ("wrap-law notes.txt", 1, "notes.txt: this is no TOML", "see 'cairn wrap-law --help'"),
    ("wrap-law keys.toml", 1, "keys.toml: there is no key 'interface'; there are arguments"),
    ("new-law Sticky-Law", 1, "'Sticky-Law' is no name for a law: small letters, digits and _"),
    ("completion fsh", 2, "'fsh' is none of bash, zsh, tcsh", "did you mean 'zsh'?"),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a run, a scene, a checkpoint, and files that are none of these."""
    before = os.getcwd()
    path = tmp_path_factory.mktemp("mistakes")
    os.chdir(path)
    sim = cn.Simulation(heap(), 1e-3, overlap="ignore")
    sim.run(steps=4, output="r.vtkhdf", every=2, progress=False)
    sim.scene.save("s.scene.h5")
    sim.checkpoint("c.checkpoint.h5")
    (path / "folder").mkdir()
    for name, text in (
        ("notes.txt", "no numbers"),
        ("empty.stl", "solid x\nendsolid x\n"),
        ("keys.toml", "[interface]\n"),
        ("wrong.py", "import cairn as cn\ncn.Scene(4)\n"),
        ("own.py", "def half(x):\n    return x / 0\n\n\nhalf(1)\n"),
        ("syntax.py", "def f(:\n"),
    ):
        (path / name).write_text(text)
    yield path
    os.chdir(before)


def call(capsys, words):
    try:
        status = cli.main(words.split())
    except SystemExit as end:
        status = end.code
    return status, capsys.readouterr().err


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("typed, status, told", [(m[0], m[1], m[2:]) for m in MISTAKES], ids=[m[0] for m in MISTAKES])
def test_a_mistake_is_answered(folder, capsys, typed, status, told):
    ended, err = call(capsys, typed)
    assert ended == status
    last = err.strip().splitlines()[-1]
    assert last.startswith("cairn") and ": error: " in last and "Traceback" not in err
    for words in told:
        assert words in last
    if status == 1:
        assert err.count("\n") == 1


def test_an_error_of_a_script_is_shown_from_the_script_on(folder, capsys):
    status, err = call(capsys, "run own.py")
    assert status == 1 and err.splitlines()[-1] == "ZeroDivisionError: division by zero"
    assert err.count("File ") == 2 and "own.py" in err and "cairn" not in err.replace(str(folder), "")
    status, err = call(capsys, "run syntax.py")
    assert status == 1 and "syntax.py" in err and "SyntaxError" in err and "runpy" not in err
