"""Cohesive laws in scenes: balance of energy, restart, space and plane, bodies with sides, meshes; fragments."""

from types import SimpleNamespace

import cairn as cn
import numpy as np
import pytest
from cairn.model.elastic import ElasticBody

ROCK = cn.Material("rock", density=1000.0)
SHARP = cn.NLGS(tol=1e-12, max_iter=20000)
ZONES = {
    "MAC": dict(work=10.0, viscosity=0.02),
    "MP": dict(work=10.0),
    "MP3": dict(strength=2e5, work=10.0),
    "MAL": dict(normal_strength=2e5, tangential_strength=3e5, normal_work=10.0, tangential_work=30.0),
    "TH": dict(normal_strength=2e5, tangential_strength=3e5, normal_work=10.0, tangential_work=30.0, normal_plateau=3e-5),
    "ABP": dict(normal_strength=2e5, tangential_strength=3e5, normal_work=10.0, tangential_work=30.0, normal_end=4e-4,
                tangential_end=8e-4, first_share=0.3),
    "EXPO": dict(normal_strength=2e5, tangential_strength=3e5, normal_work=10.0, tangential_work=30.0),
}  # fmt: skip


def zone(name, mu=0.3):
    return getattr(cn, name)(normal_stiffness=1e10, tangential_stiffness=7e9, mu=mu, **ZONES[name])


def simulate(scene, dt, **options):
    return cn.Simulation(scene, dt, cn.NSCD(solver=SHARP, **options), overlap="ignore")


def grains(dim, law, kick):
    """Four grains in a square that touch, one of them struck."""
    r = 0.05
    x = np.array([[0.0, 0.0], [2 * r, 0.0], [0.0, 2 * r], [2 * r, 2 * r]])
    v = np.zeros((4, 3 * dim - 3))
    v[3, :2] = kick
    if dim == 3:
        x = np.column_stack([x, np.zeros(4)])
    scene = cn.Scene(dim)
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, r, ROCK, velocity=v))
    scene.interact(ROCK, ROCK, law)
    return scene


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", ZONES)
def test_balance_of_energy_closes_and_damage_never_heals(name, dim):
    """Stored energy is the sum over steps; the dissipated energy is at most the work of the zones."""
    sim = simulate(grains(dim, zone(name), (0.6, 0.9)), 2e-6)
    begin, before, kept = 0.5 * sim.bodies.mass[3] * 1.17, {}, 0.0
    lowest = 1.0
    for _ in range(250):
        sim.step()
        assert sim.info["status"] == "converged" and sim.info["error"] <= 1e-12
        contacts, energy = sim.contacts, sim.info["energy"]
        beta = {tuple(key): b for key, b in zip(contacts.key.tolist(), contacts.beta)}
        assert all(b <= before.get(key, 1.0) for key, b in beta.items())
        before |= beta
        lowest = min(lowest, contacts.beta.min())
        assert np.isclose(contacts.stored.sum(), energy["stored"], rtol=1e-12, atol=1e-15)
        assert abs(energy["closure"]) < 1e-10 * energy["in_play"]
        left = energy["kinetic"] + energy["stored"] + energy["released"] + energy["dissipated_normal"]
        assert abs(left + energy["dissipated_friction"] - begin) < 1e-10 * energy["in_play"]
        kept = max(kept, energy["stored"])
    assert lowest < 0.9 and kept > 0 and energy["released"] > 0
    # of first order in the step: what friction and the scheme took is a small part
    assert abs(energy["dissipated_normal"] + energy["dissipated_friction"]) < 0.1 * begin
    area = 0.025 if dim == 2 else np.pi * 0.025**2
    # MAC's viscosity spends more than its work
    assert energy["released"] <= (30.0 if name != "MAC" else 200.0) * area * 4 * (1 + 1e-9)


def test_smaller_steps_leave_less_to_the_scheme():
    found = []
    for halvings in range(3):
        sim = simulate(grains(2, zone("MAL", mu=0.0), (0.0, 0.9)), 4e-6 / 2**halvings)
        for _ in range(50 * 2**halvings):
            sim.step()
        found.append(sim.info["energy"]["dissipated_normal"] + sim.info["energy"]["dissipated_friction"])
    assert 0.4 < found[1] / found[0] < 0.6 and 0.4 < found[2] / found[1] < 0.6


@pytest.mark.parametrize("dim", [2, 3])
def test_restart_goes_on_to_the_same_bits(tmp_path, dim):
    law = zone("TH")
    once = simulate(grains(dim, law, (0.6, 0.9)), 2e-6)
    for _ in range(95):
        once.step()
    half = simulate(grains(dim, law, (0.6, 0.9)), 2e-6)
    for _ in range(25):
        half.step()
    assert np.any((0 < half.contacts.beta) & (half.contacts.beta < 1))
    half.checkpoint(tmp_path / "half.h5")
    again = simulate(grains(dim, law, (0.6, 0.9)), 2e-6)
    again.restore(tmp_path / "half.h5")
    for _ in range(70):
        again.step()
    assert np.array_equal(again.bodies.position, once.bodies.position)
    assert np.array_equal(again.contacts.beta, once.contacts.beta)


def boxes(law, speed):
    """A box of 0.2 x 0.1 m on one that is driven, glued along 0.2 m, drawn up."""
    scene = cn.Scene(2)
    corners = np.array([[-0.1, -0.05], [0.1, -0.05], [0.1, 0.05], [-0.1, 0.05]])
    moves = [[0.0, speed, 0.0], [0.0, 0.0, 0.0]]
    scene.add(cn.polygons([corners + [0.0, 0.05], corners + [0.0, -0.05]], ROCK, velocity=moves))
    scene.interact(ROCK, ROCK, law)
    return scene


def test_points_of_a_side_share_its_area():
    """Two boxes glued along 0.2 m swing on k = 0.2 c and reduced mass 10 kg, and part when their energy is more than w 0.2."""
    law = cn.MP3(normal_stiffness=1e9, tangential_stiffness=1e9, strength=1e6, work=1000.0)
    sim = simulate(boxes(law, 0.1), 1e-6)
    stiffness, mass = 0.2 * 1e9, 10.0
    quarter = int(np.pi / 2 / np.sqrt(stiffness / mass) / sim.dt)
    for _ in range(quarter):
        sim.step()
    apart = sim.bodies.velocity[0, 1] - sim.bodies.velocity[1, 1]
    assert abs(apart) < 3e-3
    assert np.isclose(sim.info["energy"]["stored"], 0.5 * mass * 0.01, rtol=1e-2)
    torn = simulate(boxes(law, 9.0), 1e-5)  # 405 J of relative motion against 200 J
    for _ in range(100):
        torn.step()
    assert torn.contacts.beta.max(initial=0) == 0
    assert np.isclose(torn.info["energy"]["released"], 200.0, rtol=1e-6)


def strip(shift, pull=None):
    x, y = np.meshgrid(np.linspace(0, 0.2, 3), np.linspace(0, 0.1, 2), indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], -1).reshape(-1, 4)
    groups = {"bottom": number[:, 0], "top": number[:, -1]}
    body = ElasticBody(
        np.c_[x.ravel(), y.ravel() + shift], {"quad": quads}, young=1e9, poisson=0.0, density=1000.0, groups=groups
    )
    if pull is None:
        return cn.deformable(body, ROCK, name="lower", edges="top", fixed={"bottom": "xy"})
    edges = np.repeat(np.stack([number[:-1, 0], number[1:, 0]], -1), 2, axis=0)
    weights = np.tile([[0.75, 0.25], [0.25, 0.75]], (len(edges) // 2, 1))
    return cn.deformable(body, ROCK, name="upper", points=(edges, weights), edges="bottom", drive={"top": pull})


def test_meshes_are_glued_and_torn():
    """Two elastic strips, a zone between points of one and edges of the other: its strength, and all of its work when torn."""
    law = cn.MP3(normal_stiffness=1e12, tangential_stiffness=1e12, strength=1e5, work=20.0)
    scene = cn.Scene(2)
    scene.add(strip(0.0), strip(0.1, pull={"x": 0.0, "y": 0.05}))
    scene.interact("lower edges", "upper", law)
    sim = cn.Simulation(scene, 5e-6, cn.NSCD(solver=SHARP))
    peak = 0.0
    while sim.time < 0.015:
        sim.step()
        peak = max(peak, -np.sum(sim.contacts.impulse_local[:, 0]) / sim.dt / 0.2)
        assert sim.info["status"] == "converged"
        energy = sim.info["energy"]
        assert abs(energy["closure"]) < 1e-10 * energy["in_play"]
    assert np.isclose(peak, 1e5, rtol=0.02)
    assert np.isclose(energy["released"], 20.0 * 0.2, rtol=1e-3) and sim.contacts.beta.max(initial=0) == 0


def test_a_block_slides_on_a_cohesive_incline_where_it_must():
    """tan a = mu (1 + F/(m g cos a))."""
    for factor, slides in ((0.99, False), (1.01, True)):
        mu, force, mass = 0.3, 20.0, np.pi * 0.1**2 * 1000
        angle = np.radians(25.0)
        need = mass * 9.81 * np.cos(angle) * (np.tan(angle) / mu - 1) / factor
        scene = cn.Scene(2, gravity=(9.81 * np.sin(angle), -9.81 * np.cos(angle)))
        scene.add(cn.disks([[0.0, 0.1]], 0.1, ROCK, driven=("w",)), cn.wall((0, 0), (0, 1), ROCK))
        scene.interact(ROCK, ROCK, cn.Wet(force=need, reach=1e-3, mu=mu))
        sim = simulate(scene, 1e-3)
        for _ in range(50):
            sim.step()
        assert (sim.bodies.velocity[0, 0] > 1e-6) == slides, (factor, force)


def test_rolling_friction_holds_a_sphere_on_an_incline():
    """M = m g R sin a against rolling R m g cos a."""
    for factor, rolls in ((0.98, False), (1.02, True)):
        angle = np.arctan(0.05 * factor)
        scene = cn.Scene(3, gravity=(9.81 * np.sin(angle), 0.0, -9.81 * np.cos(angle)))
        scene.add(cn.spheres([[0.0, 0.0, 0.1]], 0.1, ROCK), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
        scene.interact(ROCK, ROCK, cn.Rolling(mu=0.5, rolling=0.05, twisting=0.02))
        sim = simulate(scene, 1e-3)
        for _ in range(100):
            sim.step()
        assert (sim.bodies.velocity[0, 0] > 1e-6) == rolls


def test_a_spinning_sphere_stops_in_its_time():
    """(2/5) m R^2 w/(twisting R m g)."""
    scene = cn.Scene(3, gravity=(0.0, 0.0, -9.81))
    scene.add(cn.spheres([[0.0, 0.0, 0.1]], 0.1, ROCK, velocity=[[0, 0, 0, 0, 0, 5.0]]), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Rolling(mu=0.5, twisting=0.2))
    sim = simulate(scene, 1e-3)
    stop = 0.4 * 0.1 * 5.0 / (0.2 * 9.81)
    while sim.time < stop - 2e-3:
        sim.step()
    assert sim.bodies.velocity[0, 5] > 1e-3
    while sim.time < stop + 2e-3:
        sim.step()
    assert abs(sim.bodies.velocity[0, 5]) < 1e-12


def test_bonded_row_breaks_into_the_fragments_that_are_counted(tmp_path):
    """A row of 12 torn behind the fifth, a pair, and one on its own."""
    x = np.column_stack([0.1 * np.arange(12), np.zeros(12)])
    x = np.concatenate([x, [[0.0, 1.0], [0.1, 1.0], [0.5, 1.0]]])
    v = np.zeros((15, 3))
    v[5:12, 0] = 0.05
    scene = cn.Scene(2)
    scene.add(cn.disks(x, 0.05, ROCK, velocity=v))
    scene.interact(ROCK, ROCK, cn.MohrCoulomb(tension=1e4, cohesion=1e4, mu=0.3))
    sim = simulate(scene, 1e-4)
    sim.run(steps=1, output=tmp_path / "row.vtkhdf", progress=False)
    pieces = cn.post.fragments(sim)
    assert [list(piece) for piece in pieces] == [[5, 6, 7, 8, 9, 10, 11], [0, 1, 2, 3, 4], [12, 13], [14]]
    run = cn.load(tmp_path / "row.vtkhdf")
    assert [list(piece) for piece in cn.post.fragments(run[-1])] == [list(piece) for piece in pieces]
    assert np.count_nonzero(run[-1].contacts.beta) == 11 and len(run.plot_bonds().collections) >= 2


def plate(cells):
    """A bar of 0.4 x 0.1 m, in triangles."""
    x, y = np.meshgrid(np.linspace(0, 0.4, cells + 1), np.linspace(0, 0.1, 2), indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    groups = {"left": number[0], "right": number[-1]}
    return ElasticBody(
        np.c_[x.ravel(), y.ravel()], {"triangle": triangles}, young=1e9, poisson=0.0, density=1000.0, groups=groups
    )


def test_a_split_bar_is_as_stiff_as_a_whole_one_and_breaks_once(tmp_path):
    """Pulled slowly its force is E A/L times the way until its strength; then it is in two pieces, for w times its section."""
    law = cn.MP3(normal_stiffness=1e12, tangential_stiffness=1e12, strength=1e5, work=2.0)
    pieces = cn.fracture.split(plate(4), law, ROCK, fixed={"left": "xy"}, drive={"right": {"x": 0.02, "y": 0.0}})
    scene = cn.Scene(2)
    pieces.add_to(scene)
    sim = cn.Simulation(scene, 2e-6, cn.NSCD(solver=cn.NLGS(tol=1e-6, max_iter=20000)))
    sim.run(steps=1, progress=False)
    assert np.count_nonzero(sim.contacts.beta == 1) == 14  # two points on each of seven inner edges
    assert len(cn.post.fragments(sim)) == 1
    sim.run(steps=3000, output=tmp_path / "bar.vtkhdf", every=3000, progress=False)
    pieces = cn.post.fragments(sim)
    assert len(pieces) == 2
    run = cn.load(tmp_path / "bar.vtkhdf")
    assert [list(piece) for piece in cn.post.fragments(run[-1])] == [list(piece) for piece in pieces]
    drawn = [c for c in run.plot_bonds().collections if hasattr(c, "get_segments")]
    lines = [line for c in drawn for line in c.get_segments()]
    assert len(lines) == 14 and all(np.linalg.norm(line[1] - line[0]) > 0 for line in lines)  # and no edge of a cell as a wall
    assert sim.info["energy"]["released"] >= 2.0 * 0.1 * 0.99


def test_acoustic_events_have_the_energy_that_is_released():
    """Bars pulled apart in a row, one side after the other; what the damage before the first look took does not count."""
    x = np.column_stack([0.1 * np.arange(4), np.zeros(4)])
    v = np.zeros((4, 3))
    v[1:, 0] = 1.0
    v[3, 0] = 3.0
    scene = cn.Scene(2)
    scene.add(cn.disks(x, 0.05, ROCK, velocity=v))
    scene.interact(ROCK, ROCK, cn.MAL(normal_stiffness=1e8, tangential_stiffness=1e8, mu=0.3, normal_strength=1e4,
                                      tangential_strength=1e4, normal_work=5.0, tangential_work=5.0))  # fmt: skip
    sim = simulate(scene, 1e-4)
    sim.run(steps=4, progress=False)
    before, began = sim.energy["released"], sim.time
    assert before > 0
    events, coarse = cn.post.AcousticEvents(sim), cn.post.AcousticEvents(sim, quiet=10**6)
    assert len(events.table) == 0 and events.table["point"].shape == (0, 2)

    def both(s):
        events(s)
        coarse(s)

    sim.run(steps=100, progress=False, callback=both)
    table = events.table
    released = sim.energy["released"] - before
    assert released > 0 and table["energy"].sum() == pytest.approx(released, rel=1e-12)
    assert coarse.table["energy"].sum() == pytest.approx(released, rel=1e-12)
    assert len(coarse.table) == len({(a, b) for a, b in zip(table["body_a"], table["body_b"])}) <= len(table)
    assert (table["energy"] > 0).all() and (table["begin"] < table["end"]).all() and (np.diff(table["begin"]) >= 0).all()
    assert table["begin"].min() >= began * (1 - 1e-12) and table["end"].max() <= sim.time
    assert np.abs(table["point"][:, 0] - 0.05 - 0.1 * np.minimum(table["body_a"], table["body_b"])).max() < 0.02
    for quiet in (0, "a", None, 1.5, np.inf, True):
        with pytest.raises(ValueError, match=f"quiet is {quiet!r}: give a whole number >= 1"):
            cn.post.AcousticEvents(sim, quiet=quiet)
    with pytest.raises(ValueError, match="simulation is 5: give a cairn.Simulation"):
        cn.post.AcousticEvents(5)
    for quiet, count in ((1, 2), (2, 1)):  # steps 1, 2 and 4 release
        one = SimpleNamespace(key=np.array([[91, 92, 0, 0]]), bodies=np.array([[1, 2]]), point=np.zeros((1, 2)))
        at = SimpleNamespace(time=0.0, dt=1.0, steps=0, contacts=one)
        one.releases = lambda at=at: np.array([at.total])
        events = cn.post.AcousticEvents(sim, quiet=quiet)
        for step, released in enumerate((1.0, 3.0, 3.0, 7.0), 1):
            at.steps, at.time, at.total = step, float(step), released
            events(at)
        assert len(events.table) == count and events.table["energy"].sum() == 7 and events.table["end"][-1] == 4


def test_what_a_dashpot_takes_is_released_and_no_acoustic_event():
    """One of two grains moves off on a joint with a dashpot: the balance counts its dissipation, the table has no row."""
    scene = cn.Scene(2)
    scene.add(cn.disks([[0.0, 0.0], [1.0, 0.0]], 0.05, ROCK, velocity=[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    scene.join(0, 1, cn.Distance(points=((0.0, 0.0), (1.0, 0.0)), spring=cn.Spring(stiffness=100.0, damping=5.0)))
    scene.interact("*", "*", None)
    sim = simulate(scene, 1e-3)
    events = cn.post.AcousticEvents(sim)
    sim.run(steps=20, progress=False, callback=events)
    assert sim.energy["released"] > 0 and len(events.table) == 0


OF_ZONES = dict(normal_stiffness=1e12, tangential_stiffness=5e11, mu=0.3)
STRENGTHS = dict(normal_strength=2e6, tangential_strength=3e6, normal_work=10.0, tangential_work=30.0)
PRESSED = [(cn.MAC, dict(work=10.0)), (cn.MP, dict(work=10.0)), (cn.MP3, dict(strength=2e6, work=10.0)), (cn.MAL, STRENGTHS),
         (cn.TH, STRENGTHS), (cn.ABP, dict(STRENGTHS, normal_end=4e-5, tangential_end=8e-5, first_share=0.3)),
         (cn.EXPO, STRENGTHS)]  # fmt: skip


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("law, own", PRESSED, ids=lambda x: getattr(x, "__name__", ""))
def test_a_pressure_in_the_crack_pushes_and_its_work_is_told(law, own, dim):
    """Beside the same law without: p (1 - beta)^a more in every step, and the whole of p where it is broken."""
    pressure, power, h, found = 1e5, 2.0, 2e-5, []
    for given in (0.0, pressure):
        made = law(**OF_ZONES, **own, pressure=given, pressure_power=power)
        scene, make = cn.Scene(dim=dim), cn.disks if dim == 2 else cn.spheres
        held = ("vx", "vy", "w") if dim == 2 else ("vx", "vy", "vz", "wx", "wy", "wz")
        far, speed = 0.1 * np.eye(dim)[0], 1e-3 * np.eye(3 * dim - 3)[0]
        scene.add(make([0.0 * far], 0.05, cn.Material("held", density=1.0), driven=held))
        scene.add(make([far], 0.05, cn.Material("heavy", density=1e14), velocity=[speed]))
        scene.interact("*", "*", made)
        sim = cn.Simulation(scene, h, cn.NSCD(solver=cn.NLGS(tol=1e-12)))
        rows, work = [], 0.0
        for _ in range(4100):
            assert sim.step()["status"] == "converged"
            if not len(sim.contacts.gap):
                rows.append((0.0, 0.0))
                continue
            area = 0.025 if dim == 2 else np.pi * 0.025**2
            rows.append((sim.contacts.beta[0], sim.contacts.impulse[0, 0] / (h * area)))
            work += given * (1 - rows[-1][0]) ** power * area * h * 1e-3 if rows[-1][0] < 1 else 0.0
        found.append(np.array(rows))
        terms = sim.info["energy"]
        assert terms["work_driven"] == pytest.approx(work, rel=1e-6)
        assert abs(terms["dissipated_friction"]) <= 1e-9 * terms["released"]
    without, pressed = found
    np.testing.assert_allclose(pressed[:, 0], without[:, 0], atol=1e-6)
    beta = pressed[:, 0]
    push = np.where(beta < 1, pressure * (1 - beta) ** power, 0.0)
    np.testing.assert_allclose(without[:, 1] - pressed[:, 1], push, atol=1e-5 * np.abs(without[:, 1]).max())
    if law is not cn.MAC:  # whose tail has no end
        assert beta[-1] == 0 and pressed[-1, 1] == pytest.approx(-pressure, rel=1e-6)


def test_a_crack_under_pressure_is_broken_for_who_counts_pieces():
    scene = cn.Scene(dim=2)
    stone = cn.Material("stone", density=2500.0)
    scene.add(cn.disks([[0.0, 0.0], [0.1, 0.0]], 0.05, stone, velocity=[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    scene.interact(stone, stone, cn.MAL(**OF_ZONES, **STRENGTHS, pressure=1e5))
    sim = cn.Simulation(scene, 1e-5)
    for _ in range(50):
        sim.step()
    assert len(cn.post.fragments(sim)) == 2 and not sim.contacts.beta.any()
    assert len(sim.contacts.gap) == 1 and sim.contacts.impulse[0, 0] != 0  # pressed apart, far beyond what detection looks at


@pytest.mark.parametrize("mode", ["normal", "tangential"])
@pytest.mark.parametrize("name", ["MP3", "MAL", "TH", "ABP", "EXPO", "PlasticEXPO"])
def test_a_zone_of_no_strength_opens_without_work(name, mode):
    """Its onset is at no opening: stresses, works and energies are numbers, and the grain flies off as without a zone."""
    own = dict(ZONES.get(name, ZONES["EXPO"]))
    own["strength" if name == "MP3" else f"{mode}_strength"] = 0.0
    along = np.array([1.0, 0.0] if mode == "normal" else [0.0, 1.0])
    law = getattr(cn, name)(normal_stiffness=1e10, tangential_stiffness=7e9, **own)
    scene = cn.Scene(2)
    scene.add(cn.disks([[0.0, 0.0], [0.1, 0.0]], 0.05, ROCK, velocity=[[0.0, 0.0, 0.0], [*along, 0.0]]))
    scene.interact(ROCK, ROCK, law)
    sim = simulate(scene, 1e-5)
    for _ in range(20):
        assert sim.step()["status"] == "converged"
        energy = sim.info["energy"]
        assert np.isfinite([e for e in energy.values() if isinstance(e, float)]).all()
        assert abs(energy["closure"]) < 1e-10 * energy["in_play"]
    assert energy["released"] <= 1e-12 * energy["in_play"] and energy["stored"] == 0
    assert not len(sim.contacts.beta) or sim.contacts.beta[0] == 0
    if mode == "normal":
        np.testing.assert_allclose(sim.bodies.velocity[:, :2], [[0.0, 0.0], along], atol=1e-12)


def test_what_zones_refuse():
    """Infinite values, by which energies are no numbers."""
    rigid = dict(normal_stiffness=1e10, tangential_stiffness=7e9)
    for name in [*ZONES, "PlasticEXPO"]:
        for field in (*rigid, "pressure"):
            with pytest.raises(ValueError, match=f"{field} of {name} is inf: give a value from 0"):
                getattr(cn, name)(**rigid | ZONES.get(name, ZONES["EXPO"]) | {field: np.inf})
    with pytest.raises(ValueError, match="viscosity of MAC is inf"):
        cn.MAC(**rigid | ZONES["MAC"] | {"viscosity": np.inf})


@pytest.mark.parametrize("name", ["MAL", "EXPO", "PlasticEXPO"])
@pytest.mark.parametrize("radius", [0.05, 20.0])
def test_an_overlap_at_rest_stays_without_recovery(name, radius):
    """Regression: PlasticEXPO ejected it in a step, since an infinitely stiff spring in series became finite for areas below 1
    m2."""
    rock = cn.Material("rock", density=1000.0)
    zone = {"normal_stiffness": 1e9, "tangential_stiffness": 1e9, "normal_strength": 2e6, "tangential_strength": 2e6}
    scene = cn.Scene(2)
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.disks([[0.0, 0.999 * radius]], radius, rock))
    scene.interact(rock, rock, getattr(cn, name)(normal_work=2e4, tangential_work=2e4, **zone))
    sim = cn.Simulation(scene, 1e-5)
    for _ in range(3):
        sim.step()
    assert np.abs(sim.bodies.velocity).max() < 1e-9 * radius / 1e-5 and sim.contacts.beta.min() == 1
