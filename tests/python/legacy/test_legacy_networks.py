"""LMGC90's heat and currents: folders read and run, and its own contact forces through the kernels of its forms."""

import csv
import os
import re
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn import legacy
from cairn.legacy.results import read_contacts
from small_datbox import BAR, BULK, DISK, SEE, body, held, write

DATA = Path(os.environ.get("CAIRN_REFERENCE_DATA", Path(__file__).resolve().parents[4] / "shared")) / "legacy"
samples = pytest.mark.skipif(not DATA.is_dir(), reason="the sample data of LMGC90 are not here (CAIRN_REFERENCE_DATA)")


def history(name):
    with open(DATA / name / "history.csv", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@samples
@pytest.mark.parametrize("name", ["thermal2d", "thermal2d_t3"])
def test_plates_of_heat(name):
    """Temperatures of the tracked nodes at all steps within 1e-6 K; a plate with lumped capacities, another with a point in each
    cell."""
    sim = cn.Simulation(legacy.read_datbox(DATA / name), 2.0)
    for row in history(name):
        sim.step()
        t = sim.nodes.temperature
        for column, value in row.items():
            found = re.fullmatch(r"mesh1_node(\d+)_T", column)
            if found:
                assert abs(t[int(found[1]) - 1] - float(value)) <= 1e-6
    balance = sim.info["thermal"]["balance"]
    assert abs(balance["closure"]) <= 1e-12 * balance["in_play"]


def of_nodes(name, label):
    text = (DATA / name / "OUTBOX" / "MP_VALUES.OUT.1").read_text(encoding="latin-1")
    return np.array([float(v.replace("D", "E")) for v in re.findall(rf"{label}=\s*([-+0-9.D]+)", text)])


@samples
def test_potentials_from_its_contact_forces():
    """Its form `hertz` is the cube root of the force, without a conductivity: potentials within what its files' digits leave."""
    contacts = read_contacts(DATA / "electro2d" / "OUTBOX" / "Vloc_Rloc.OUT.1")
    force = np.maximum(contacts["force"][:, 0], 0.0)
    flow = cn.networks.solve(contacts["bodies"], force ** (1 / 3), source={51: 0.2, 48: -0.2})
    theirs = of_nodes("electro2d", "PotE")
    ours = flow.potential - flow.potential[51]
    assert np.nanmax(np.abs(ours - (theirs - theirs[51]))) <= 1e-3 * np.ptp(theirs)


@samples
def test_heat_fluxes_from_its_contact_forces():
    """Rates of its temperatures at the end, from its forces and temperatures by 2 k a."""
    folder, rows = DATA / "thermal_dem2d", history("thermal_dem2d")
    contacts = read_contacts(folder / "OUTBOX" / "Vloc_Rloc.OUT.1")
    scene = legacy.read_datbox(folder)
    sim = cn.Simulation(scene, 1e-3, overlap="ignore")
    radius = np.where(np.arange(52) < 48, sim.radii(), np.inf)
    i, j = contacts["bodies"].T
    effective = 1 / (1 / radius[i] + 1 / radius[j])
    a = (0.75 * np.maximum(contacts["force"][:, 0], 0) * effective * 2 * (1 - 0.09) / 2.1e11) ** (1 / 3)
    t = of_nodes("thermal_dem2d", "Temp")
    gain = np.zeros(52)
    np.add.at(gain, i, 2 * 2e5 * a * (t[j] - t[i]))
    np.add.at(gain, j, 2 * 2e5 * a * (t[i] - t[j]))
    rate = gain / (sim.bodies.mass * 460)
    times, seen = (np.array([float(r[c]) for r in rows[-9:]]) for c in ("time", "temperature_body48"))
    theirs = np.polyval(np.polyder(np.polyfit(times - times[-1], seen, 2)), 0.0)
    assert rate[47] == pytest.approx(theirs, rel=1e-3)


def at_its_last_state(name):
    """A simulation that begins where LMGC90 ended, at rest under its load, with its impulses; and the stored contacts.

    Impulses of such a packing are not unique, so that its own are where the solver begins. Its files have eight digits of the
    places: balls are as much larger, or contacts that it has closed would be open by the rounding.
    """
    folder, h = DATA / name, 1e-3
    stored = read_contacts(folder / "OUTBOX" / "Vloc_Rloc.OUT.1")

    def made():
        scene = legacy.read_datbox(folder, state=folder / "OUTBOX" / "DOF.OUT.1")
        scene.sets[-1].force = np.array([0.0, -2000.0, 0.0])  # where its ramp ends
        for s in scene.sets:
            for c in s.contactors:
                if c.shape == "disk":
                    c.radius = c.radius + 2e-8
        if name == "thermal_dem2d":
            scene.networks["thermal"].initial = [(np.arange(52), of_nodes(name, "Temp"))]
        strategy = cn.NSCD(0.5, cn.NLGS(tol=1e-6, max_iter=5000), scene.legacy.alert, contact_point="surface")
        return cn.Simulation(scene, h, strategy, overlap="ignore")

    known = made()
    known.step()
    memory, sim = known._core.get_state()["memory"], made()
    body = np.zeros(known.contactors.id.max() + 1, int)
    body[known.contactors.id] = known.contactors.body
    theirs = {}
    for (i, j), (normal, tangential, _) in zip(stored["bodies"], stored["force"]):
        theirs[i, j] = theirs[j, i] = (normal * h, -tangential * h)  # its tangent is the other way
    keys = np.reshape(memory["keys"], (-1, 4))
    memory["impulses"] = np.array([theirs.get((body[a], body[b]), (0.0, 0.0)) for a, b, *_ in keys]).ravel()
    sim._core.set_state(sim._core.get_state() | {"memory": memory})
    return sim, stored


@samples
def test_potentials_of_a_step_from_its_last_state():
    """Its impulses are a solution here, and its potentials within 1e-3 of their range; a whole run ends in another packing."""
    sim, stored = at_its_last_state("electro2d")
    report = sim.step()
    assert report["status"] == "converged" and report["iterations"] <= 3
    assert len(sim.contacts) == len(stored["bodies"])
    theirs = of_nodes("electro2d", "PotE")
    ours = sim.bodies.potential - sim.bodies.potential[51]
    assert np.abs(ours - (theirs - theirs[51])).max() <= 1e-3 * np.ptp(theirs)
    assert ours[48] == pytest.approx(theirs[48] - theirs[51], rel=1e-3)
    assert report["electrical"]["closure"] <= 1e-12


@samples
def test_temperatures_of_a_step_from_its_last_state():
    """The rate of the grain under the lid within 1e-3 of that in LMGC90's record."""
    sim, _ = at_its_last_state("thermal_dem2d")
    before, rows = sim.bodies.temperature.copy(), history("thermal_dem2d")
    report = sim.step()
    times, seen = (np.array([float(r[c]) for r in rows[-9:]]) for c in ("time", "temperature_body48"))
    theirs = np.polyval(np.polyder(np.polyfit(times - times[-1], seen, 2)), 0.5e-3)
    assert (sim.bodies.temperature - before)[47] / 1e-3 == pytest.approx(theirs, rel=1e-3)
    assert sim.bodies.temperature[[48, 51]] == pytest.approx(of_nodes("thermal_dem2d", "Temp")[[48, 51]])
    balance = report["thermal"]["balance"]
    assert abs(balance["closure"]) <= 1e-12 * balance["in_play"]


@samples
def test_grains_under_a_lid_run():
    """The whole run: impacts make another packing of the same grains, whose forces differ, and so temperatures."""
    scene = legacy.read_datbox(DATA / "thermal_dem2d")
    strategy = cn.NSCD(0.5, cn.NLGS(tol=1e-7, max_iter=5000), scene.legacy.alert, contact_point="surface")
    sim = cn.Simulation(scene, 1e-3, strategy, overlap="ignore")
    for _ in range(300):
        sim.step()
    t, theirs = sim.bodies.temperature, of_nodes("thermal_dem2d", "Temp")
    assert t[[48, 51]] == pytest.approx(theirs[[48, 51]]) and t[47] - 293 == pytest.approx(theirs[47] - 293, rel=0.1)
    assert abs(sim.info["thermal"]["balance"]["closure"]) <= 1e-12 * sim.info["thermal"]["balance"]["in_play"]


@samples
def test_what_is_not_mapped_is_named(tmp_path):
    import shutil

    shutil.copytree(DATA / "electro2d" / "DATBOX", tmp_path / "DATBOX")
    path = tmp_path / "DATBOX" / "MP_DEM.DAT"
    path.write_text(path.read_text().replace("oxide: no ", "oxide: yes"))
    with pytest.raises(legacy.LegacyError, match="MP_DEM.DAT: current"):
        legacy.read_datbox(tmp_path)


def test_what_explains_a_value_behind_it_is_passed_over(tmp_path):
    """A folder made here: a current through a disk on a bar, whose lines end in explanations."""
    bulk = BULK[: BULK.index("$behav")] + (
        "$behav  lawty\n STONE  ELECTRO_RIGID                   Umas= 0.1000000D+04\n"
        + " " * 40 + "Eeq = 0.1000000D+10  Nueq= 0.3000000D+00\n" + " " * 40 + "Ecnd= 0.1000000D+03\n"
    )  # fmt: skip
    bodies = body("RBDY2", DISK, at=(0, 0.0999, 0)) + body("RBDY2", BAR, at=(0, -0.05, 0), number=2)
    folder = write(
        tmp_path / "DATBOX", bodies, SEE.format("RBDY2", "DISKx", "JONCx", "DOWNx"), drives=held("RBDY2", 2), bulk=bulk
    )
    lines = ["$model  elec_:", " " * 14 + "curnt: const= 0.5000000D+00   !< constant", " " * 14 + "local: hertz         !< model"]
    lines += [" " * 14 + f"{word}: no        !< none" for word in ("oxide", "brkdw", "sldng")] + ["$$$$$$"]
    for number, sign in ((1, "+"), (2, "-")):
        lines += ["$bounds  elec_", " " * 9 + f"{number:07d}" + " " * 15 + f"Isgn= {sign}"]
    (folder / "MP_DEM.DAT").write_text("\n".join(lines) + "\n")
    scene = legacy.read_datbox(tmp_path)
    assert not scene.legacy.unmapped
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(0.5, margin=scene.legacy.alert), overlap="ignore")
    for _ in range(3):
        report = sim.step()
    assert report["electrical"]["closure"] <= 1e-12 and np.ptp(sim.bodies.potential) > 0
