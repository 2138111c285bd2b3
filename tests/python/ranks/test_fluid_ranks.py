"""A liquid over ranks: the same bits for every number of ranks, the motion of a run without."""


import cairn as cn
import numpy as np
import pytest
from over_mpi import digest_of, digests, needs_mpi

ROCK = cn.Material("rock", density=2600.0)
WOOD = cn.Material("wood", density=600.0)
SKIN = cn.Material("skin", density=1200.0)
STRATEGY = cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=1000))


def tank(width=1.0, high=0.4, dim=2, spacing=0.05, law=None, **options):
    """Scene of a tank of half-spaces in which liquid stands."""
    scene = cn.Scene(dim=dim, gravity=(*(0.0,) * (dim - 1), -9.81))
    scene.add(cn.wall(np.zeros(dim), np.eye(dim)[-1], ROCK))
    for k in range(dim - 1):
        scene.add(cn.wall(np.zeros(dim), np.eye(dim)[k], ROCK), cn.wall(width * np.eye(dim)[k], -np.eye(dim)[k], ROCK))
    scene.interact("*", "*", law or cn.Coulomb(mu=0.4))
    return scene, cn.fluid([np.zeros(dim), [*(width,) * (dim - 1), high]], spacing, viscosity=0.1, **options)


def logs():
    """Logs that fall into water, onto each other, and rock below."""
    scene, water = tank()
    x = np.stack(np.meshgrid(np.arange(4), np.arange(3), indexing="ij"), -1).reshape(-1, 2) * 0.19 + (0.18, 0.33)
    fall = np.tile((0.5, -2.0), (12, 1)) * np.linspace(0.5, 1, 12)[:, None]
    scene.add(cn.disks(x + np.arange(12)[:, None] * 1e-3, 0.09, WOOD, velocity=fall))
    scene.add(cn.disks([(0.2, 0.06), (0.45, 0.06), (0.8, 0.06)], 0.06, ROCK))
    scene.add(water)
    return scene


def balls():
    """The same of spheres, by forces."""
    scene, water = tank(0.6, 0.3, dim=3, spacing=0.1, law=cn.LinearSpring(stiffness=1e5, restitution=0.5, mu=0.3))
    x = np.stack(np.meshgrid(*[np.arange(2)] * 3, indexing="ij"), -1).reshape(-1, 3) * 0.26 + (0.17, 0.17, 0.35)
    scene.add(cn.spheres(x, 0.12, WOOD))
    scene.add(water)
    return scene


def body(kind, low, size, counts, young=3e5, **more):
    points, cells, groups = grid(low, size, counts)
    if kind == "linear":
        made = cn.ElasticBody(points, cells, young=young, poisson=0.3, density=1200.0, groups=groups)
    else:
        made = cn.SolidBody(points, cells, cn.NeoHookean(young=young, poisson=0.3), density=1200.0, groups=groups)
    return cn.deformable(made, SKIN, **more)


def grid(low, size, counts):
    """Points and quads of a block, with its groups "top", "ends" and "all"."""
    axes = [a + np.linspace(0, s, n + 1) for a, s, n in zip(low, size, counts)]
    points = np.stack([x.ravel() for x in np.meshgrid(*axes, indexing="ij")], axis=1)
    k = np.arange(len(points)).reshape(counts[0] + 1, counts[1] + 1)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)
    return points, {"quad": quads}, {"top": k[:, -1], "ends": k[[0, -1]].ravel(), "all": k.ravel()}


def gate(kind, **liquid):
    """A gate that hangs between water and grains that lie against it, with a log that floats."""
    scene, water = tank(1.0, 0.4)
    scene.add(body(kind, (0.55, 0.02), (0.1, 0.6), (2, 8), fixed={"top": "xy"}, contact="all", edges="all", name="gate"))
    x = np.stack(np.meshgrid(np.arange(3), np.arange(4), indexing="ij"), -1).reshape(-1, 2) * 0.1005 + (0.7005, 0.0505)
    scene.add(cn.disks(x, 0.05, ROCK, velocity=np.tile((-0.5, 0.0), (12, 1))), cn.disks([(0.25, 0.45)], 0.1, WOOD))
    scene.add(cn.fluid([(0, 0), (0.5, 0.4)], 0.05, viscosity=0.1, **(liquid or {"artificial": 0.1})))
    return scene


def floating(kind, **liquid):
    """A soft block that floats, hit by logs."""
    scene, water = tank(1.2, 0.4, **(liquid or {"artificial": 0.2}))
    scene.add(body(kind, (0.4, 0.3), (0.4, 0.2), (4, 2), contact="all", edges="all", name="raft"))
    scene.add(cn.disks([(0.45, 0.591), (0.65, 0.592), (0.55, 0.75), (0.15, 0.5)], 0.09, WOOD))
    scene.add(water)
    return scene


def honey():
    """A viscous liquid, whose pressure takes corrected gradients, with a log that falls into it."""
    scene, _ = tank()
    scene.add(cn.disks([(0.45, 0.42)], 0.11, WOOD, velocity=[(0.5, -1.0)]))
    scene.add(cn.fluid([(0, 0), (1, 0.4)], 0.05, viscosity=50.0))
    return scene


def drop():
    """A square of liquid that surface tension rounds, beside a disk."""
    scene = cn.Scene(dim=2)
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    scene.add(cn.disks([(0.8, 0.3), (1.0, 0.3)], 0.1, WOOD, velocity=[(-1.0, 0.0)] * 2))
    scene.add(cn.fluid([(0, 0), (0.6, 0.6)], 0.05, surface_tension=20.0, viscosity=4.0, pressure=0.0))
    return scene


def bed():
    """Grains smaller than a particle that settle in water."""
    scene, water = tank(1.0, 0.4)
    x = np.stack(np.meshgrid(np.arange(16), np.arange(3), indexing="ij"), -1).reshape(-1, 2) * 0.06 + (0.04, 0.03)
    scene.add(cn.disks(x, 0.02, cn.Material("sand", density=2600.0), velocity=np.tile((0.0, -0.5), (48, 1))))
    scene.add(water)
    scene.interact("fluid", "sand", cn.GrainDrag("di_felice"))
    return scene


def channel():
    """Water that comes in, flows past stones and leaves."""
    scene = cn.Scene(dim=2)
    scene.add(cn.wall((0, 0), (0, 1), ROCK), cn.wall((0, 1), (0, -1), ROCK))
    scene.add(cn.disks([(0.8, 0.3), (0.81, 0.53), (1.3, 0.6)], 0.11, ROCK, velocity=[(0.0, 0.5), (0.0, -0.5), (0.0, 0.0)]))
    scene.add(cn.fluid([(0, 0), (2, 1)], 0.05, viscosity=1.0, velocity=(2.0, 0.0), sound_speed=40.0))
    scene.add(cn.Inflow([(-0.2, 0), (0, 1)], (2.0, 0.0)), cn.Outflow([(2, 0), (2.2, 1)], pressure=0.0))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    scene.interact("fluid", "*", cn.FreeSlip())
    return scene


def vortices(**options):
    """Taylor and Green's, without a free surface, about disks."""
    n = 24
    x = (np.arange(n) + 0.5) / n
    place = np.stack([a.ravel() for a in np.meshgrid(x, x, indexing="ij")], axis=1)
    place = place[np.linalg.norm(place - (0.5, 0.35), axis=1) > 0.115]
    place = place[np.linalg.norm(place - (0.5, 0.6), axis=1) > 0.115]
    x, y = 2 * np.pi * place.T
    velocity = np.stack([-np.cos(x) * np.sin(y), np.sin(x) * np.cos(y)], axis=1)
    scene = cn.Scene(dim=2, periodic=cn.Periodic((1.0, 1.0)))
    scene.add(cn.disks([(0.5, 0.35), (0.5, 0.6)], 0.1, WOOD, velocity=[(0.0, 0.5), (0.0, -0.5)]))
    scene.add(cn.fluid(place, 1 / n, viscosity=1.0, velocity=velocity, pressure=0.0, **options))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    return scene


WEAK = {
    "drop": drop,
    "honey": honey,
    "bed": bed,
    "channel": channel,
    "vortices": vortices,
    "logs": logs,
    "gate": lambda: gate("linear"),
    "gate of rubber": lambda: gate("large"),
    "raft": lambda: floating("linear"),
    "raft of rubber": lambda: floating("large"),
}


def start(scene, ranks, strategy=STRATEGY, dt=2e-3, **more):
    return cn.Simulation(scene(), dt=dt, strategy=strategy, overlap="ignore", ranks=ranks, **more)


def stepped(sim, steps):
    for _ in range(steps):
        sim.step()
    return sim


def box(x, y, width=0.2, height=0.2):
    return np.array([(x, y), (x + width, y), (x + width, y + height), (x, y + height)])


def afloat():
    """Blocks of several densities that fall into water, one of them below a bar that is held."""
    scene, water = tank(1.6, 0.6, incompressible=True)
    for k, share in enumerate((0.5, 0.2, 0.002)):
        wood = cn.Material(f"wood {k}", density=1000.0 * share)
        scene.add(cn.polygons(box(0.1 + 0.4 * k, 0.52), wood, velocity=[(0.0, -1.0)]))
    scene.add(cn.polygons(box(1.25, 0.1), cn.Material("cork", density=200.0)))
    scene.add(cn.polygons(box(1.25, 0.3001), ROCK, driven=("vx", "vy", "w")))
    scene.add(cn.polygons(box(0.2, 0.722), WOOD), cn.polygons(box(0.6, 0.724), WOOD))
    scene.add(water)
    return scene


def weir():
    """Blocks without mortar, and water on one side of them."""
    scene, _ = tank(1.2, 0.4)
    for row in range(4):
        for k in range(2 if row % 2 else 1):
            width = 0.15 if row % 2 else 0.3
            scene.add(cn.polygons(box(0.6 + k * width, 0.1 * row, width, 0.1), ROCK))
    scene.add(cn.fluid([(0, 0), (0.6, 0.35)], 0.05, viscosity=0.1, incompressible=True))
    return scene


def rubble(lid=False):
    """Stones that settle in water, below a plate if asked for."""
    scene, water = tank(1.0, 0.5, incompressible=True)
    x = np.stack(np.meshgrid(np.arange(7), np.arange(3), indexing="ij"), -1).reshape(-1, 2) * 0.135 + (0.08, 0.066)
    x[:, 0] += 0.02 * (np.arange(len(x)) % 3)
    scene.add(cn.disks(x, 0.065, ROCK))
    if lid:
        scene.add(cn.polygons(box(0.01, 0.41, 0.98, 0.15), ROCK, velocity=[(0.0, -0.5)]))
    scene.add(water)
    return scene


def cube(size):
    corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]) - 0.5
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners * size, faces


def stones_in_space():
    scene, water = tank(0.6, 0.3, dim=3, spacing=0.1, incompressible=True)
    x = np.stack(np.meshgrid(*[np.arange(2)] * 3, indexing="ij"), -1).reshape(-1, 3) * 0.25 + (0.17, 0.17, 0.121)
    scene.add(cn.spheres(x, 0.12, WOOD, velocity=np.tile((0.0, 0.0, -1.0), (8, 1))))
    scene.add(cn.polyhedra(cube(0.15), WOOD, position=[(0.3, 0.3, 0.62)]))
    scene.add(water)
    return scene


def raft():
    """Blocks that pins join, which float under stones."""
    scene, water = tank(1.2, 0.4, incompressible=True)
    ids = [scene.add(cn.polygons(box(0.2 + 0.25 * k, 0.38, 0.22, 0.15), WOOD))[0] for k in range(3)]
    for k in range(2):
        scene.join(ids[k], ids[k + 1], cn.Pivot(point=(0.435 + 0.25 * k, 0.45)))
    scene.add(cn.disks([(0.31, 0.6), (0.8, 0.61)], 0.06, ROCK, velocity=[(0.0, -1.0)] * 2))
    scene.add(water)
    return scene


def beside_a_mesh():
    """Stones in water, and on a body of rubber that the water flows through."""
    scene, water = tank(1.2, 0.4, incompressible=True)
    scene.add(body("large", (0.4, 0.001), (0.4, 0.2), (4, 2), contact="all", edges="all", name="pad"))
    scene.add(cn.disks([(0.45, 0.28), (0.65, 0.27), (0.2, 0.09), (1.0, 0.12)], 0.06, ROCK, velocity=[(0.0, -1.0)] * 4))
    scene.add(water)
    scene.interact("fluid", "pad", None)
    return scene


def across_a_cell():
    """Logs that drift with the water through the sides of a periodic cell."""
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81), periodic=cn.Periodic((1.2, 0.0)))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    x = np.array([(0.05, 0.3), (0.5, 0.25), (0.69, 0.26), (1.15, 0.12)])
    scene.add(cn.disks(x, 0.09, WOOD, velocity=[(2.0, 0.0), (3.0, 0.0), (1.0, 0.0), (2.0, 0.0)]))
    scene.add(cn.fluid([(0, 0), (1.2, 0.4)], 0.05, viscosity=0.1, velocity=(2.0, 0.0), incompressible=True))
    return scene


def between_slopes():
    """Water without viscosity in a trench, whose lattice does not fit the walls: it is damped."""
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    c, s = np.cos(np.radians(35)), np.sin(np.radians(35))
    scene.add(cn.wall((0, 0), (s, c), ROCK), cn.wall((0, 0), (-s, c), ROCK))
    scene.add(cn.disks([(-0.1, 0.47), (0.15, 0.48)], 0.1, WOOD, velocity=[(0.0, -1.0)] * 2))
    scene.add(cn.fluid([(-0.8, 0), (0.8, 0.4)], 0.05, incompressible=True))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    return scene


STRONG = {
    "afloat": afloat,
    "weir": weir,
    "rubble": rubble,
    "rubble under a lid": lambda: rubble(lid=True),
    "stones in space": stones_in_space,
    "raft of blocks": raft,
    "beside a mesh": beside_a_mesh,
    "across a cell": across_a_cell,
    "between slopes, incompressible": between_slopes,
    "vortices, incompressible": lambda: vortices(incompressible=True),
    "water alone": lambda: only(*tank(incompressible=True)),
}


SCENES = WEAK | STRONG


def only(scene, water):
    scene.add(water)
    return scene


def state(sim):
    fluid, arrays = sim.fluid, [sim.bodies.position, sim.bodies.velocity, sim.contacts.key, sim.contacts.impulse]
    arrays += [fluid.position, fluid.velocity, fluid.pressure, fluid.density, np.array(list(sim.energy.values()))]
    if len(sim.nodes):
        arrays += [sim.nodes.position, sim.nodes.velocity, *(fluid.forces_on_mesh(mesh) for mesh in sim.meshes)]
    arrays += [fluid.force_on(k) for k in sim.bodies.id]
    return arrays


def digest(sim):
    return digest_of(state(sim))


pytestmark = [pytest.mark.filterwarnings(f"ignore:{told}") for told in (".*leave gaps under", ".*as gases", "the liquid takes")]


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_the_same_bits_for_every_number_of_ranks(scene, tmp_path):
    sims = [stepped(start(scene, ranks), 24) for ranks in (1, 2, 3, 4, 7)]
    assert len({digest(sim) for sim in sims}) == 1
    if len(sims[0].contacts):
        assert np.abs(sims[0].contacts.impulse).max() > 0 and len(set(sims[-1].ranks.owner)) > 1
    sim, path = stepped(start(scene, 3), 8), tmp_path / "wet.checkpoint.h5"
    for ranks in (5, 1):
        sim.checkpoint(path)
        sim = start(scene, ranks)
        sim.restore(path)
        stepped(sim, 8)
    assert digest(sim) == digest(sims[0])


@pytest.mark.parametrize("scene", [logs, rubble])
def test_ranks_tell_each_other_their_sums_over_particles(scene):
    sims = [stepped(start(scene, ranks), 3) for ranks in (1, 2, 4)]
    told = [sim.ranks.figures() for sim in sims]
    assert told[0]["message_bytes"] == 0
    sums = {logs: 4 * sims[0].fluid.info["sub_steps"], rubble: 5 * sims[0].fluid.info["products"]}[scene]
    assert told[1]["message_bytes"] > 8 * sums * len(sims[0].fluid)
    assert told[2]["message_bytes"] == pytest.approx(3 * told[1]["message_bytes"], rel=0.1)  # each to all others
    assert told[0]["liquid_imbalance"] == 1 < told[2]["liquid_imbalance"]


def test_shares_of_a_liquid_are_alike():
    sim = stepped(start(lambda: only(*tank(spacing=0.02)), 4), 1)
    assert 1 < sim.ranks.figures()["liquid_imbalance"] < 1.3  # of 16 tiles
    assert "sums over the particles of the liquid are shared, imbalance 1." in sim.explain()


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_the_motion_is_that_without_ranks(scene):
    alone, over = stepped(start(scene, None), 24), stepped(start(scene, 3), 24)
    assert over.info["status"] == "converged"
    scale = max(np.abs(alone.bodies.velocity).max(), 9.81 * 2e-3)  # at rest: the free fall of a step
    assert np.abs(alone.bodies.velocity - over.bodies.velocity).max() < 1e-2 * scale
    assert np.abs(alone.fluid.position - over.fluid.position).max() < 1e-3 * 2e-3 * 24 * scale
    if len(alone.nodes):
        assert np.abs(alone.nodes.position - over.nodes.position).max() < 1e-3 * 2e-3 * 24 * scale


@pytest.mark.parametrize(("scene", "strategy"), [(logs, STRATEGY), (afloat, STRATEGY), (balls, cn.SmoothDEM(energy=False))])
def test_a_run_whose_state_nobody_reads_is_the_same_as_its_steps(scene, strategy):
    sims = [stepped(start(scene, ranks, strategy, dt=1e-3), 12) for ranks in (1, 3)]
    for ranks in (1, 3):
        sims.append(start(scene, ranks, strategy, dt=1e-3))
        sims[-1].run(12, progress=False)
    assert len({digest(sim) for sim in sims}) == 1


@pytest.mark.parametrize("scene", [logs, WEAK["gate of rubber"], afloat], ids=["logs", "gate of rubber", "afloat"])
def test_a_step_that_fails_leaves_the_liquid_as_it_was(scene):
    sim, other = (stepped(start(scene, 3), 6) for _ in range(2))
    force = np.zeros((len(sim.bodies), 3))
    force[-2, 0] = 1e308
    sim._core.assign_body("force", force)
    with pytest.raises(cn.Error, match="rank . of 3: velocity"):
        sim.step()
    for of in (sim, other):
        of._core.assign_body("force", 0 * force)
        stepped(of, 6)
    assert digest(sim) == digest(other)


def test_a_block_floats_at_its_draft():
    def scene():
        scene, water = tank(1.2, 0.6, spacing=0.06, incompressible=True)
        scene.add(cn.polygons(box(0.45, 0.53, 0.3, 0.3), cn.Material("half", density=500.0)))
        scene.add(water)
        return scene

    sim, alone = (start(scene, ranks, dt=5e-3) for ranks in (3, None))
    high = []
    for _ in range(600):
        sim.step()
        high.append(sim.bodies.position[-1, 1])
    level = (len(sim.fluid) * 0.06**2 + 0.5 * 0.3**2) / 1.2
    draft = level - (np.mean(high[200:]) - 0.15)
    assert abs(draft - 0.15) < 0.1 * 0.15  # the water still sways
    stepped(alone, 600)  # nothing touches: the same to rounding
    assert np.abs(sim.bodies.position - alone.bodies.position).max() < 1e-9


def test_momentum_is_kept():
    def scene():
        scene = cn.Scene(dim=2)
        scene.add(cn.fluid([(0, 0), (0.5, 0.5)], 0.05, velocity=(1.0, 0.2), viscosity=1.0, incompressible=True))
        scene.add(cn.disks([[0.75, 0.2], [1.2, 0.25]], 0.2, ROCK))
        scene.interact("*", "*", cn.Coulomb(mu=0.3))
        return scene

    def momentum(sim):
        of_bodies = (sim.bodies.mass[:, None] * sim.bodies.velocity[:, :2]).sum(axis=0)
        return 1000.0 * 0.05**2 * np.sum(sim.fluid.velocity, axis=0) + of_bodies

    sim = start(scene, 2, dt=5e-3)
    begin = momentum(sim)
    stepped(sim, 80)
    assert np.abs(sim.bodies.velocity[0]).max() > 1e-2  # they met
    assert np.abs(momentum(sim) - begin).max() < 1e-10 * np.abs(begin).max()


@pytest.mark.parametrize("scene", [logs, afloat])
def test_bodies_come_and_go(scene):
    found = []
    for ranks in (1, 4):
        sim = stepped(start(scene, ranks), 6)
        late = sim.add(cn.disks([(0.45, 0.97), (0.9, 0.98)], 0.09, WOOD, velocity=[(0.0, -3.0)] * 2))
        stepped(sim, 8)
        sim.remove(late[:1])
        sim.remove(sim.bodies.id[4:5])
        found.append(digest(stepped(sim, 6)))
    assert found[0] == found[1]


def test_one_exchange_a_sweep_gives_the_same_to_the_tolerance():
    once, whole = (stepped(start(rubble, 3, exchange=exchange), 12) for exchange in ("sweep", "colour"))
    assert once.info["status"] == "converged" and once.fluid.info["misfit"] <= 1e-3
    assert np.abs(once.bodies.velocity - whole.bodies.velocity).max() < 1e-2 * np.abs(whole.bodies.velocity).max()


@needs_mpi
@pytest.mark.parametrize("form", ["WEAK", "STRONG"])
def test_processes_have_the_same_bits(form, tmp_path):
    """Each makes the sums over its share of the particles alone."""
    scenes = globals()[form]
    found = digests(tmp_path, __name__, scenes, f'of.stepped(of.start(of.{form}[name], "mpi"), 12)')
    assert found[0] == found[1] == {name: digest(stepped(start(scene, 3), 12)) for name, scene in scenes.items()}
