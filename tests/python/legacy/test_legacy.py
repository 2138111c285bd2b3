"""LMGC90's files: reading, named refusals, writing and reading again, agreement with stored results."""

import csv
import json
import os
import re
import shutil
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn import legacy
from cairn.legacy.mesh import read_mesh_states

DATA = Path(os.environ.get("CAIRN_REFERENCE_DATA", Path(__file__).resolve().parents[4] / "shared")) / "legacy"
samples = pytest.mark.skipif(not DATA.is_dir(), reason="the sample data of LMGC90 are not here (CAIRN_REFERENCE_DATA)")


def small_scene():
    """Disks, a clump, a driven and a pushed segment, two laws."""
    rock, steel = cn.Material("rock", density=2600.0), cn.Material("a long name of steel", density=7800.0)
    scene = cn.Scene(dim=2, gravity=(0.1, -9.81))
    scene.add(cn.disks([[0.0, 0.1], [0.25, 0.1], [0.1, 0.3]], [0.1, 0.09, 0.1], rock, velocity=[0.1, 0, 2.0]))
    scene.add(cn.clumps([[0.35, 0.35]], [[-0.03, 0], [0.03, 0.01]], 0.05, 20.0, 0.05, rock, rotation=[0.3], group="clumps"))
    push = cn.Table([0, 0.01, 1], [[0, 0], [0, 0], [0.2, 0]])
    scene.add(cn.segment((-0.2, -0.05), (0.6, -0.05), steel, radius=0.05, velocity=push))
    scene.add(cn.segment((-0.2, 0.6), (0.7, 0.5), steel, radius=0.05, mass=60, inertia=1.0, free=("vy",), force=(0, -500.0)))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    scene.interact(rock, steel, cn.Restitution(mu=0.4, normal=0.2, tangential=0.0))
    return scene


def moved(scene, steps=60):
    sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(margin=0.01, solver=cn.NLGS(tol=1e-10)), overlap="ignore")
    for _ in range(steps):
        sim.step()
    return sim


def test_written_and_read_again_moves_alike(tmp_path):
    scene = small_scene()
    legacy.write_datbox(scene, tmp_path / "DATBOX")
    again = legacy.read_datbox(tmp_path)
    assert again.count == scene.count and again.legacy.unmapped == []
    one, two = moved(scene), moved(again)
    assert np.max(np.abs(one.bodies.position - two.bodies.position)) < 1e-6
    assert np.max(np.abs(one.bodies.position - scene_positions(scene))) > 1e-3  # it did move
    legacy.write_datbox(again, tmp_path / "again")
    assert np.array_equal(moved(legacy.read_datbox(tmp_path / "again")).bodies.position, two.bodies.position)


def scene_positions(scene):
    return np.concatenate([s.position for s in scene.sets])


def test_spheres_between_planes_written_and_read_again(tmp_path):
    rock = cn.Material("rock", density=2600.0)
    scene = cn.Scene(dim=3, gravity=(0, 0, -9.81))
    scene.add(cn.spheres([[0.1, 0.1, 0.11], [0.12, 0.1, 0.32]], 0.1, rock, velocity=[0.3, 0, 0, 0, 1.0, 2.0]))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), rock), cn.wall((0.35, 0, 0), (-1, 0, 0.2), rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.5))
    legacy.write_datbox(scene, tmp_path)
    again = legacy.read_datbox(tmp_path)
    one, two = moved(scene, 100), moved(again, 100)
    assert np.max(np.abs(one.bodies.position[:2] - two.bodies.position[:2])) < 1e-6
    assert np.max(np.abs(one.bodies.velocity[:2] - two.bodies.velocity[:2])) < 1e-5


def test_what_has_no_word_is_refused_by_name_or_left_out_as_asked(tmp_path):
    scene = small_scene()
    steel = cn.Material("a long name of steel")
    scene.add(cn.wall((0, -1), (0, 1), steel))
    scene.interact("rock", "rock", cn.Bonded(mu=0.3))
    with pytest.raises(legacy.LegacyError, match=r"contactor half_plane \(body 6\).*law Bonded\(mu=0.3\)"):
        legacy.write_datbox(scene, tmp_path / "no")
    assert not (tmp_path / "no").exists()
    with pytest.warns(legacy.UnmappedWarning, match="half_plane"):
        legacy.write_datbox(scene, tmp_path / "DATBOX", unmapped="skip")
    rules = (tmp_path / "DATBOX" / "TACT_BEHAV.DAT").read_text()
    (tmp_path / "DATBOX" / "TACT_BEHAV.DAT").write_text(re.sub(r"^( law00  )\S+", r"\1GTN_CZM", rules, flags=re.M))
    with pytest.raises(legacy.LegacyError, match="GTN_CZM"):
        legacy.read_datbox(tmp_path)
    with pytest.warns(legacy.UnmappedWarning, match="GTN_CZM"):
        assert len(legacy.read_datbox(tmp_path, unmapped="skip").legacy.unmapped) == 1


@pytest.mark.parametrize(
    "file, old, new, message",
    [
        ("BODIES.DAT", "avrd= ", "avrd=x", r"BODIES.DAT, line \d+: columns 35-48 hold 'x.*', not a number"),
        ("BODIES.DAT", "byrd= ", "byrd=-", r"BODIES.DAT, line \d+: contactor DISKx of RBDY2 1 has a size that is not above 0"),
        ("BODIES.DAT", "byrd= 1.0000000E-01", "byrd=       1000", "which LMGC90 reads as 0.0001: write a decimal point"),
        ("BODIES.DAT", "$$$$$$", "", r"line \d+: RBDY2 1 has no end"),
        ("BODIES.DAT", "DISKx", "DISKy", "contactor 'DISKy' is none of RBDY2: DISKx,"),
        ("BODIES.DAT", " RBDY2      1", " CYBDY      1", "CYBDY are not known"),
        ("TACT_BEHAV.DAT", "  law00  RBDY2", "  nolaw  RBDY2", "law 'nolaw' is not declared; there are law00"),
        ("TACT_BEHAV.DAT", "fric= 3", "fric=-3", r"TACT_BEHAV.DAT, line \d+: law law00 \(IQS_CLB\): mu"),
        ("TACT_BEHAV.DAT", "fric= 3.0000000E-01", "fric=", r"TACT_BEHAV.DAT, line \d+: columns 46-59 hold '', not a number"),
        ("BULK_BEHAV.DAT", "Umas= 2.6000000E+03", "Umas=", r"line \d+: material .* of RBDY2 1 has no density Umas="),
        ("BULK_BEHAV.DAT", "$gravy", "", "BULK_BEHAV.DAT: has no gravity"),
        ("DRV_DOF.DAT", " vlocy      1", " vlocy      9", "drives dof 9; a body of 2D has 3"),
        ("DRV_DOF.DAT", "evolution d5_1.dat", "evolution none.dat", r"line \d+: the evolution 'none.dat' is no file"),
        ("DRV_DOF.DAT", " RBDY2      5", " RBDY2      8", r"DRV_DOF.DAT, line \d+: drives RBDY2 8, which"),
        ("DOF.INI", "RBDY2        5", "RBDY2        8", r"DOF.INI, line \d+: RBDY2 8 is not in BODIES.DAT: give files"),
    ],
)
def test_malformed_files_are_refused_with_file_and_place(tmp_path, file, old, new, message):
    legacy.write_datbox(small_scene(), tmp_path)
    text = (tmp_path / file).read_text()
    assert old in text
    (tmp_path / file).write_text(text.replace(old, new, 1))
    with pytest.raises(legacy.LegacyError, match=message):
        legacy.read_datbox(tmp_path)


def test_files_cut_short_and_missing_folders_are_refused(tmp_path):
    with pytest.raises(legacy.LegacyError, match="there is no BODIES.DAT"):
        legacy.read_datbox(tmp_path)
    legacy.write_datbox(small_scene(), tmp_path)
    text = (tmp_path / "BODIES.DAT").read_text()
    (tmp_path / "BODIES.DAT").write_text(text[: text.rindex("$tacty") + 6])
    with pytest.raises(legacy.LegacyError, match="ends in the middle of a block"):
        legacy.read_datbox(tmp_path)


# ---------------------------------------------------------------------- the samples


def run_sample(name, steps=None):
    """The simulation of a sample, and what LMGC90 stored of its tracked bodies."""
    case = json.loads((DATA / name / "case.json").read_text())
    scene = legacy.read_datbox(DATA / name)
    strategy = cn.NSCD(case["theta"], cn.NLGS(tol=1e-10, max_iter=20000), scene.legacy.alert, contact_point="surface")
    sim = cn.Simulation(scene, case["dt"], strategy, overlap="ignore")
    with open(DATA / name / "history.csv") as f:
        history = {int(row["step"]): row for row in csv.DictReader(f)}
    worst = 0.0
    for k in range(1, (steps or case["steps"]) + 1):
        sim.step()
        for b in case["tracked_bodies"] if k in history else ():
            stored = [float(history[k][f"body{b}_{axis}"]) for axis in "xyz"[: scene.dim]]
            worst = max(worst, float(np.max(np.abs(sim.bodies.position[b - 1] - stored))))
    return sim, scene, worst


@samples
@pytest.mark.parametrize(
    "name, steps, gate",  # gate: share of the smallest radius; piles as long as chaos leaves them alike
    [
        ("restitution2d", None, 1e-6),
        ("driven_wall2d_constant", 100, 1e-5),
        ("driven_wall2d_evolution", 100, 1e-5),
        ("driven_wall2d_harmonic", 80, 1e-5),
        ("disks2d_box", 30, 1e-9),
        ("polygons2d_pile", 60, 1e-6),
        ("spheres3d_box", 30, 1e-4),
        ("clusters2d", 60, 1e-4),
    ],
)
def test_samples_follow_what_was_stored(name, steps, gate):
    sim, scene, worst = run_sample(name, steps)
    smallest = min(b.radius for b in scene.legacy.datbox.bodies if b.radius > 0)
    assert worst < gate * smallest
    if steps is None:  # the whole state at the end too, spins and angles included
        stored = legacy.read_outbox(DATA / name)[-1]
        at = np.array([b.position[: scene.dim] for b in scene.legacy.datbox.bodies]) + stored.displacement
        assert np.max(np.abs(sim.bodies.position - at)) < 1e-5 * smallest
        assert np.max(np.abs(sim.bodies.velocity - stored.velocity)) < 1e-5


@samples
def test_every_sample_is_read_or_refused_by_name(tmp_path):
    for folder in sorted(p for p in DATA.iterdir() if p.is_dir()):
        try:
            scene = legacy.read_datbox(folder)
            box = scene.legacy.datbox
            assert scene.count == len(box.bodies) if not box.meshes else scene.count > len(box.bodies)
        except legacy.LegacyError as error:
            assert "Cairn has nothing to map this to:" in str(error), folder.name
        assert legacy.read_outbox(folder)


@samples
def test_state_from_stored_results_and_both_formats_agree():
    folder = DATA / "disks2d_box"
    text, full = legacy.read_outbox(folder)[-1], legacy.read_h5(folder / "lmgc90.h5")[-1]
    assert text.step == full.step and np.allclose(text.displacement, full.displacement, rtol=1e-6, atol=1e-9)
    assert sorted(map(tuple, text.contacts["bodies"].tolist())) == sorted(map(tuple, full.contacts["bodies"].tolist()))
    scene = legacy.read_datbox(folder, state=folder / "lmgc90.h5", step=70)
    stored = next(i for i in legacy.read_h5(folder / "lmgc90.h5") if i.step == 70)
    first = scene.sets[0]
    assert np.allclose(first.velocity, stored.velocity[: len(first)], rtol=1e-12)
    with pytest.raises(legacy.LegacyError, match="holds no step 71; it holds 40, 70, 200"):
        legacy.read_datbox(folder, state=folder / "lmgc90.h5", step=71)


@samples
def test_samples_written_again_are_the_same_scene(tmp_path):
    for name in ("restitution2d", "driven_wall2d_harmonic", "driven_wall2d_evolution", "spheres3d_box"):
        first = legacy.read_datbox(DATA / name)
        legacy.write_datbox(first, tmp_path / name)
        second = legacy.read_datbox(tmp_path / name)
        shutil.rmtree(tmp_path / name)
        assert np.allclose(scene_positions(first), scene_positions(second), rtol=1e-7, atol=1e-9)
        assert [repr(law) for _, _, law in first.rules] == [repr(law) for _, _, law in second.rules] or name == "restitution2d"
        for a, b in zip(first.sets, second.sets, strict=True):
            assert np.allclose(a.mass, b.mass, rtol=2e-7) and a.driven == b.driven
            for t in (0.0, 0.013, 0.2):
                for given, got in ((a.drive, b.drive), (a.force, b.force)):
                    one, two = (0.0 if f is None else f(t) if callable(f) else f for f in (given, got))
                    assert np.allclose(one, two, rtol=1e-6, atol=1e-6)


@samples
@pytest.mark.parametrize(
    "name, gate", [("mesh2d_block", 1e-6), ("mesh2d_block_t3", 1e-8), ("mesh2d_clalp", 1e-6), ("mesh3d_cubes", 1e-8)]
)
def test_meshed_bodies_meet_what_was_stored(name, gate):
    """All nodes after the last step, over the size of the body."""
    case = json.loads((DATA / name / "case.json").read_text())
    scene = legacy.read_datbox(DATA / name)
    strategy = cn.NSCD(case["theta"], cn.NLGS(tol=1e-10, max_iter=100000), scene.legacy.alert, contact_point="surface")
    sim = cn.Simulation(scene, case["dt"], strategy, overlap="ignore")
    touched = 0
    for _ in range(case["steps"]):
        sim.step()
        touched += bool(np.any(sim.contacts.impulse))
    assert touched > 10
    meshes = scene.legacy.datbox.meshes
    final = read_mesh_states(DATA / name / "OUTBOX" / "DOF.OUT.1", meshes)
    for mesh, view in zip(meshes, sim.meshes):
        error = np.max(np.abs(view.displacement - final[mesh.number][0])) / np.ptp(view.body.points, axis=0).max()
        print(f"{name}: error {error:.2g}")
        assert error < gate


@samples
def test_meshed_bodies_that_do_not_map_are_named(tmp_path):
    shutil.copytree(DATA / "thermal2d" / "DATBOX", tmp_path / "DATBOX")
    path = tmp_path / "DATBOX" / "MODELS.DAT"
    path.write_text(path.read_text().replace("THERM  Q4xxx", "POROx  Q4xxx"))
    with pytest.raises(legacy.LegacyError, match="MAILx 1: physics POROx"):
        legacy.read_datbox(tmp_path)


@samples
def test_a_mesh_is_not_written_silently(tmp_path):
    scene = legacy.read_datbox(DATA / "mesh2d_block")
    with pytest.raises(legacy.LegacyError, match="no word for this: the deformable body 'MAILx 1'"):
        legacy.write_datbox(scene, tmp_path / "again")


@pytest.mark.parametrize("recovery", [0.0, 1.0])
@pytest.mark.parametrize("name", ["MAC", "MP", "MP3", "MAL", "TH", "ABP", "EXPO"])
def test_cohesive_zones_written_and_read_again_break_alike(tmp_path, name, recovery):
    both = dict(normal_strength=2e5, tangential_strength=3e5, normal_work=10.0, tangential_work=30.0)
    own = {
        "MAC": dict(work=10.0, viscosity=0.02),
        "MP": dict(work=10.0),
        "MP3": dict(strength=2e5, work=10.0),
        "MAL": both,
        "TH": both | dict(normal_plateau=3e-5, tangential_plateau=5e-5),
        "ABP": both | dict(normal_end=4e-4, tangential_end=8e-4, first_share=0.3),
        "EXPO": both | dict(rest=0.01),
    }[name]
    law = getattr(cn, name)(normal_stiffness=1e10, tangential_stiffness=1e10, mu=0.3, recovery=recovery, within=1e-3, **own)
    scene, rock = cn.Scene(dim=2), cn.Material("rock", density=1000.0)
    x = [[0.0, 0.0], [0.1, 0.0], [0.0, 0.1], [0.1, 0.1]]
    scene.add(cn.disks(x, 0.05, rock, velocity=[[0, 0, 0], [0, 0, 0], [0, 0, 0], [0.6, 0.9, 0]]))
    scene.interact(rock, rock, law)
    legacy.write_datbox(scene, tmp_path)
    again = legacy.read_datbox(tmp_path)
    assert f" {'' if recovery else 'IQS_'}{name}_CZM " in (tmp_path / "TACT_BEHAV.DAT").read_text()
    ends = []
    for one in (scene, again):
        sim = cn.Simulation(one, 2e-6, cn.NSCD(solver=cn.NLGS(tol=1e-10, max_iter=20000)), overlap="ignore")
        for _ in range(150):
            sim.step()
        ends.append((np.sort(sim.contacts.beta), sim.bodies.velocity[:, :2].copy()))
    assert ends[0][0].min() < 0.95
    for one, other in zip(*ends):
        assert np.allclose(one, other, rtol=1e-4, atol=1e-6)


def test_a_zone_that_the_format_has_no_word_for_is_refused(tmp_path):
    scene, rock = cn.Scene(dim=2), cn.Material("rock", density=1000.0)
    scene.add(cn.disks([[0.0, 0.0], [0.1, 0.0]], 0.05, rock))
    scene.interact(rock, rock, cn.MP(normal_stiffness=1e10, tangential_stiffness=1e10, work=10.0, power=2.0))
    with pytest.raises(legacy.LegacyError, match="power"):
        legacy.write_datbox(scene, tmp_path)


@samples
def test_cohesive_disks_break_as_those_of_lmgc90_to_the_first_contact_that_is_gone():
    """The mean of beta within 1e-3 at each stored step, the contacts below 0.01 in the same one and as many; no step on the way
    ended at LMGC90's iteration limit."""
    case = json.loads((DATA / "cohesive2d" / "case.json").read_text())
    with open(DATA / "cohesive2d" / "history.csv", newline="") as file:
        stored = {int(row["step"]): {name: float(x) for name, x in row.items()} for row in csv.DictReader(file)}
    scene = legacy.read_datbox(DATA / "cohesive2d")
    strategy = cn.NSCD(case["theta"], cn.NLGS(tol=1e-10, max_iter=40000), scene.legacy.alert, contact_point="surface")
    sim, broken = cn.Simulation(scene, case["dt"], strategy, overlap="ignore"), 0
    while not broken:
        assert sim.step()["status"] == "converged"
        if sim.steps not in stored:
            continue
        there, beta = stored[sim.steps], sim.contacts.beta
        assert there["nlgs_iterations"] < case["nlgs_iterations_max"]
        assert beta.mean() == pytest.approx(there["beta_mean"], abs=1e-3)
        broken = int((beta < 0.01).sum())
        assert broken == there["n_beta_below_1pct"]
    assert sim.steps == 24
