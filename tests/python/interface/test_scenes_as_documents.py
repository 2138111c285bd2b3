"""Scenes as JSON documents: schema, faults with their places, runs; explain as plain data."""

import copy
import json

import cairn as cn
import numpy as np
import pytest
from cairn.cli import main
from cairn.run import documents

DROP = {
    "format": "cairn-scene", "version": 1, "dim": 2, "gravity": [0, -9.81],
    "materials": {"rock": {"density": 2600}},
    "bodies": [{"shape": "disks", "centers": [[0, 0.6], [2, 0.7]], "radii": 0.5, "material": "rock", "group": "grains"},
               {"shape": "polygons", "vertices": [[[5, 0], [6, 0], [6, 1]]], "material": "rock"},
               {"shape": "wall", "point": [0, 0], "normal": [0, 1], "material": "rock"}],
    "laws": [{"a": "rock", "b": "*", "law": "Coulomb", "mu": 0.4}],
    "simulation": {"dt": 1e-3, "strategy": {"name": "NSCD", "theta": 1.0, "solver": {"name": "NLGS", "tol": 1e-6},
                                            "integrator": {"name": "Theta", "theta": 1.0}}},
    "run": {"steps": 20, "every": 10},
}  # fmt: skip


def changed(change):
    document = copy.deepcopy(DROP)
    change(document)
    return document


def test_a_document_is_the_scene_that_it_tells():
    without = changed(lambda d: d["simulation"]["strategy"].pop("integrator"))
    sim = documents.simulation_of(without)
    rock, scene = cn.Material("rock", density=2600.0), cn.Scene(2, gravity=(0, -9.81))
    scene.add(cn.disks([(0, 0.6), (2, 0.7)], 0.5, rock, group="grains"), cn.polygons([[[5, 0], [6, 0], [6, 1]]], rock),
              cn.wall((0, 0), (0, 1), rock))  # fmt: skip
    scene.interact("rock", "*", cn.Coulomb(mu=0.4))
    same = cn.Simulation(scene, 1e-3, cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-6)))
    for s in (sim, same):
        s.run(steps=150, progress=False)
    assert np.array_equal(sim.bodies.position, same.bodies.position)
    for row in documents._core.strategies():
        name = row[1] if len(row) > 1 else None
        assert name is None or isinstance(name, str)


FAULTS = [
    (lambda d: d.pop("dim"), "", "'dim' is missing"),
    (lambda d: d.update(dim=4), "/dim", "dim"),
    (lambda d: d.update(gravty=[0, 1]), "/gravty", "did you mean 'gravity'"),
    (lambda d: d.update(gravity=[0, 0, -9.81]), "/gravity", "gravity"),
    (lambda d: d.update(version=7), "/version", "reads 1"),
    (lambda d: d.update(materials=[]), "/materials", "no object"),
    (lambda d: d["materials"]["rock"].update(densty=1), "/materials/rock/densty", "did you mean 'density'"),
    (lambda d: d["materials"]["rock"].update(density=-1), "/materials/rock/density", "density"),
    (lambda d: d.update(bodies=[]), "/bodies", "no bodies"),
    (lambda d: d.update(bodies={}), "/bodies", "no list"),
    (lambda d: d["bodies"][0].update(shape="disk"), "/bodies/0/shape", "did you mean 'disks'"),
    (lambda d: d["bodies"][0].pop("shape"), "/bodies/0/shape", "'shape' is missing"),
    (lambda d: d["bodies"].insert(0, 3), "/bodies/0", "3 is no object"),
    (lambda d: d["bodies"][0].pop("material"), "/bodies/0", "'material' is missing"),
    (lambda d: d["bodies"][0].pop("radii"), "/bodies/0", "'radii' is missing"),
    (lambda d: d["bodies"][0].update(radii=-0.5), "/bodies/0/radii", "number > 0"),
    (lambda d: d["bodies"][0].update(radii="half"), "/bodies/0/radii", "radii"),
    (lambda d: d["bodies"][0].update(centers=[[0, 0, 0]]), "/bodies/0/centers", "centers"),
    (lambda d: d["bodies"][0].update(material="rok"), "/bodies/0/material", "did you mean 'rock'"),
    (lambda d: d["bodies"][0].update(velocty=[0, 0]), "/bodies/0/velocty", "velocity"),
    (lambda d: d["bodies"][2].update(normal=[0, 0]), "/bodies/2/normal", "non-zero"),
    (lambda d: d["laws"][0].update(law="Coulom"), "/laws/0/law", "did you mean 'Coulomb'"),
    (lambda d: d["laws"][0].update(mu=-1), "/laws/0/mu", "mu"),
    (lambda d: d["laws"][0].pop("mu"), "/laws/0", "mu"),
    (lambda d: d["laws"][0].pop("a"), "/laws/0", "'a' is missing"),
    (lambda d: d["laws"][0].update(a=["rock"]), "/laws/0/a", "rock"),
    (lambda d: d["laws"][0].update(a="rok"), "/laws/0/a", "did you mean 'rock'"),
    (lambda d: d["laws"].insert(0, "Coulomb"), "/laws/0", "no object"),
    (lambda d: d["simulation"].update(strategy=["NSCD"]), "/simulation/strategy", "no object"),
    (lambda d: d["simulation"].pop("dt"), "/simulation", "'dt' is missing"),
    (lambda d: d["simulation"].update(dt=0), "/simulation/dt", "dt"),
    (lambda d: d["simulation"]["strategy"].update(name="NCSD"), "/simulation/strategy/name", "did you mean 'NSCD'"),
    (lambda d: d["simulation"]["strategy"].update(theta=0.1), "/simulation/strategy/theta", "unstable"),
    (lambda d: d["simulation"]["strategy"]["solver"].update(tol=2), "/simulation/strategy/solver/tol", "between 0 and 1"),
    (lambda d: d["simulation"]["strategy"]["solver"].update(tolerance=2), "/simulation/strategy/solver/tolerance", "there is no"),
    (lambda d: d["run"].pop("steps"), "/run", "how long"),
    (lambda d: d["run"].update(every=0), "/run/every", "every"),
    (lambda d: d["run"].update(until=1.0), "/run", "give one of them"),
    (lambda d: d.update(run={"until": 4e-4}), "/run/until", "no step"),
    (lambda d: d["run"].update(append=True, overwrite=True), "/run", "both true"),
    (lambda d: d["run"].update(output=7), "/run/output", "name of a file"),
    (lambda d: d["run"].update(output="a.txt"), "/run/output", "ends in .vtkhdf"),
]  # fmt: skip


@pytest.mark.parametrize("number", range(len(FAULTS)))
def test_faults_are_told_with_their_place(number):
    change, path, words = FAULTS[number]
    found = documents.problems(changed(lambda d: (d["simulation"]["strategy"].pop("integrator"), change(d))))
    assert any(p.path == path and words in p.message for p in found), [str(p) for p in found]
    with pytest.raises(documents.DocumentError, match="."):
        documents.scene_of(changed(change))


def test_all_faults_are_told_at_once_and_nothing_is_raw(tmp_path, capsys):
    bad = changed(lambda d: (d["bodies"][0].update(radii=-1), d["laws"][0].update(law="x"), d["simulation"].update(dt=-1)))
    assert len(documents.problems(bad)) >= 2
    for text, words in (
        (json.dumps(bad), "/bodies/0/radii"),
        ("{", "line 1"),
        ("[1]", "no object"),
        ('{"dim": NaN}', "no number"),
    ):
        path = tmp_path / "scene.json"
        path.write_text(text, encoding="utf-8")
        assert main(["check", str(path)]) == 1
        assert words in capsys.readouterr().err
        assert main(["check", "--json", str(path)]) == 1
        told = json.loads(capsys.readouterr().out)
        assert told["ok"] is False and told["errors"]
    assert main(["check", str(tmp_path / "none.json")]) == 1 and "cannot be read" in capsys.readouterr().err
    assert main(["check"]) == 1 and "which document" in capsys.readouterr().err


def test_documents_run_and_explain_themselves(tmp_path, capsys):
    path = tmp_path / "drop.json"
    path.write_text(json.dumps(changed(lambda d: d["simulation"]["strategy"].pop("integrator"))), encoding="utf-8")
    assert main(["run", str(path), "-q"]) == 0
    assert len(cn.load(tmp_path / "drop.vtkhdf")) == 3
    assert main(["run", str(path), "-q", "--steps", "5", "--every", "5", "--output", str(tmp_path / "other.vtkhdf")]) == 0
    assert len(cn.load(tmp_path / "other.vtkhdf")) >= 2
    capsys.readouterr()
    assert main(["check", "--json", str(path)]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (
        told["ok"] and told["explain"]["bodies"] == 4 and told["explain"]["laws"][0]["degrees"]["mu"] == pytest.approx(21.8, 1e-2)
    )
    assert main(["check", str(path)]) == 0 and "no fault" in capsys.readouterr().out


def test_a_check_warns_as_a_simulation_does(tmp_path, capsys):
    path = tmp_path / "drop.json"
    bad = changed(lambda d: (d["simulation"].pop("strategy"), d["laws"].clear()))
    bad["bodies"][0]["centers"] = [[0, 0.6], [0, 0.7]]
    path.write_text(json.dumps(bad), encoding="utf-8")
    assert main(["check", str(path)]) == 0
    told = capsys.readouterr()
    assert "no fault, 2 warnings" in told.out
    assert "/laws: no law is declared" in told.err and "/bodies: 1 pairs overlap" in told.err
    assert main(["check", "--json", str(path)]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [w["path"] for w in told["warnings"]] == ["/laws", "/bodies"] and told["ok"]
    with pytest.warns(cn.OverlapWarning), pytest.warns(cn.MissingLawWarning):
        documents.simulation_of(bad)
    bad["simulation"]["overlap"] = "error"
    assert any("overlap" in p.message for p in documents.problems(bad))


def test_explain_as_plain_data_is_json_for_each_strategy():
    rock = cn.Material("rock", density=2600.0, young=1e7, poisson=0.3)
    for strategy, law in (
        (None, cn.Coulomb(mu=0.5)),
        (cn.SmoothDEM(), cn.HertzMindlin(young=1e7, poisson=0.3, mu=0.5, restitution=0.5)),
    ):
        scene = cn.Scene(3, gravity=(0, 0, -9.81))
        scene.add(cn.spheres([(0, 0, 0.5)], 0.5, rock), cn.wall((0, 0, 0), (0, 0, 1), rock))
        scene.interact("*", "*", law)
        sim = cn.Simulation(scene, 1e-5, strategy)
        sim.step()
        told = sim.explain(json=True)
        assert json.loads(json.dumps(told, allow_nan=False)) == told
        assert told["last_step"]["status"] and told["scales"]["mass"][0] > 0 and told["strategy"] == type(sim.strategy).__name__


def test_schema_accepts_the_document_and_refuses_its_faults():
    schema = documents.schema()
    assert set(schema["properties"]) == set(documents.TOP)
    titles = [s["title"] for s in schema["properties"]["bodies"]["items"]["oneOf"]]
    assert titles == list(documents.SHAPES)
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    assert not list(validator.iter_errors(DROP))
    refused = sum(bool(list(validator.iter_errors(changed(change)))) for change, *_ in FAULTS)
    assert refused > 0.6 * len(FAULTS), "what is a matter of values is told by the check alone"


@pytest.mark.parametrize(("text", "words"), [
    (b"[" * 5000 + b"]" * 5000, "nested too deep"),
    (b'{"dim": 2, "dim": 3}', "the field 'dim' twice"),
    (b'{"dim": 1' + b"0" * 400 + b"}", "a whole number of 401 digits"),
    (b"\xff\xfe", "no JSON"),
])  # fmt: skip
def test_texts_that_are_no_documents(tmp_path, text, words):
    (tmp_path / "scene.json").write_bytes(text)
    with pytest.raises(cn.FileError, match=words):
        documents.read(tmp_path / "scene.json")


def test_a_byte_order_mark_is_passed_over(tmp_path):
    (tmp_path / "scene.json").write_bytes(b"\xef\xbb\xbf" + b'{"dim": 2}')
    assert documents.read(tmp_path / "scene.json") == {"dim": 2}
