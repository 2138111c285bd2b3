"""Deformable bodies in an incompressible liquid over ranks: the same bits for each number, the motion of a run without."""


import cairn as cn
import numpy as np
import pytest
import test_fluid_ranks as fluids
from cairn.pre import masonry
from cairn.pre.blocks import Blocks
from over_mpi import digests, needs_mpi
from test_fluid_ranks import ROCK, SKIN, WOOD, body, box, digest, stepped, tank

LIQUID = {"viscosity": 0.1, "incompressible": True}


def beam(kind):
    """A beam under water, held at its ends, against which a block of .3 of the density of the water is pressed."""
    scene, water = tank(1.2, 0.8, incompressible=True)
    made = body(kind, (0.2, 0.5), (0.8, 0.1), (12, 2), young=1e8, name="beam", contact="all", edges="all",
                fixed={"ends": "xy"})  # fmt: skip
    scene.add(made, cn.polygons(box(0.5, 0.299), cn.Material("cork", density=300.0)), cn.disks([(0.15, 0.1)], 0.1, ROCK))
    scene.add(water)
    scene.interact("fluid", "*", cn.FreeSlip())
    return scene


def wall():
    """A wall of deformable bricks that water turns over, and stones behind it."""
    blocks, wide = Blocks(2), 0.3
    blocks.add_box([1.0, -0.2], [1.5, 0.0], "support")
    for k in range(4):
        cuts = (0, 0.5, 1) if k % 2 else (0, 1)
        for a, b in zip(cuts, cuts[1:]):
            blocks.add_box([1 + wide * a, 0.25 * k], [1 + wide * b, 0.25 * (k + 1)], "brick")
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    masonry.mesh(blocks, 0.13, young=1e9).add_to(scene, cn.Material("stone", density=2200.0))
    scene.add(cn.wall((0, 0), (1, 0), ROCK))
    scene.add(cn.polygons(box(0.0, -0.2, 1.0, 0.2), ROCK, driven=("vx", "vy", "w")))
    scene.add(cn.disks([(1.36, 0.05), (1.362, 0.15)], 0.05, ROCK), cn.disks([(0.4, 0.95)], 0.15, WOOD))
    scene.add(cn.fluid([(0, 0), (1, 0.95)], 0.05, incompressible=True))
    scene.interact("*", "*", cn.Coulomb(mu=0.9))
    scene.interact("fluid", "*", cn.FreeSlip())
    return scene


def cube_in_space():
    """A cube of rubber in water that bears a ball, beside one that sinks."""
    scene, water = tank(0.6, 0.3, dim=3, spacing=0.1, incompressible=True)
    corners = np.array([(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))])
    made = cn.ElasticBody((0.2, 0.2, 0.2) + 0.2 * corners, {"hexahedron": [range(8)]}, young=1e5, poisson=0.3, density=800.0)
    scene.add(cn.deformable(made, SKIN, contact="boundary", faces="boundary", name="cube"))
    scene.add(cn.spheres([(0.3, 0.3, 0.5001), (0.1, 0.1, 0.4)], 0.1, ROCK))
    scene.add(water)
    return scene


SCENES = {
    "gate": lambda: fluids.gate("linear", incompressible=True),
    "gate of rubber": lambda: fluids.gate("large", incompressible=True),
    "raft": lambda: fluids.floating("linear", incompressible=True),
    "raft of rubber": lambda: fluids.floating("large", incompressible=True),
    "beam": lambda: beam("linear"),
    "beam at large strains": lambda: beam("large"),
    "wall": wall,
    "cube in space": cube_in_space,
}
STRATEGY = cn.NSCD(theta=0.6, solver=cn.NLGS(tol=1e-4, max_iter=2000))


def start(scene, ranks, dt=2e-3, **more):
    return fluids.start(scene, ranks, STRATEGY, dt, **more)


pytestmark = [pytest.mark.filterwarnings(f"ignore:{told}") for told in (".*leave gaps under", ".*spacings of the liquid")]


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_the_same_bits_for_every_number_of_ranks(scene, tmp_path):
    sims = [stepped(start(scene, ranks), 24) for ranks in (1, 2, 3, 4, 7)]
    assert len({digest(sim) for sim in sims}) == 1
    assert np.abs(sims[0].contacts.impulse).max() > 0 and len(set(sims[-1].ranks.owner)) > 1
    sim, path = stepped(start(scene, 3), 8), tmp_path / "wet.checkpoint.h5"
    for ranks in (5, 1):
        sim.checkpoint(path)
        sim = start(scene, ranks)
        sim.restore(path)
        stepped(sim, 8)
    assert digest(sim) == digest(sims[0])


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_the_motion_is_that_without_ranks(scene):
    alone, over = stepped(start(scene, None), 24), stepped(start(scene, 3), 24)
    for sim in (alone, over):
        assert sim.info["status"] == "converged" and sim.fluid.info["misfit"] <= 1e-3
    scale = max(np.abs(alone.nodes.velocity).max(), 9.81 * 2e-3)  # at rest: the free fall of a step
    assert np.abs(alone.nodes.velocity - over.nodes.velocity).max() < 3e-3 * scale
    for mesh in alone.meshes:
        one, other = (sim.fluid.forces_on_mesh(mesh) for sim in (alone, over))
        assert np.abs(one - other).max() <= 1e-2 * np.abs(one).max()
    scale = max(scale, np.abs(alone.bodies.velocity).max())
    assert np.abs(alone.bodies.velocity - over.bodies.velocity).max() < 3e-3 * scale


@pytest.mark.parametrize("kind", ["linear", "large"])
def test_momentum_is_kept(kind):
    def scene():
        scene = cn.Scene(dim=2)
        scene.add(body(kind, (0.0, 0.0), (0.2, 0.4), (4, 8), name="block", contact="all", edges="all"))
        scene.add(cn.disks([[0.301, 0.2]], 0.1, ROCK, velocity=[(-0.5, 0.0)]))
        scene.add(cn.fluid([(-0.2, 0.1), (0.0, 0.3)], 0.05, velocity=(1.0, 0.3), pressure=0.0, **LIQUID))
        scene.interact("*", "*", cn.Coulomb(mu=0.3))
        return scene

    def momentum(sim):
        of_bodies = (sim.bodies.mass[:, None] * sim.bodies.velocity[:, :2]).sum(axis=0)
        return 1000.0 * 0.05**2 * np.sum(sim.fluid.velocity, axis=0) + of_bodies + sim.nodes.mass @ sim.nodes.velocity

    sim = start(scene, 2)
    before = momentum(sim)
    stepped(sim, 15)
    assert np.abs(sim.nodes.velocity).max() > 0.1 and len(sim.contacts) > 0
    assert np.abs(momentum(sim) - before).max() < 1e-10 * np.abs(before).max()


@pytest.mark.parametrize("kind", ["linear", "large"])
def test_meshes_and_bodies_come_and_go(kind):
    found = []
    for ranks in (1, 4):
        sim = stepped(start(lambda: fluids.floating(kind, incompressible=True), ranks), 6)
        made = body(kind, (0.8, 0.62), (0.2, 0.1), (2, 1), contact="all", edges="all", name="late")
        sim.add(made)
        sim.add(cn.disks([(1.1, 0.7)], 0.09, WOOD, velocity=[(0.0, -3.0)]))
        stepped(sim, 10)
        assert np.abs(sim.fluid.forces_on_mesh("raft")).max() > 0
        sim.remove(sim.meshes[0].all_ids)
        found.append(digest(stepped(sim, 6)))
    assert found[0] == found[1]


@pytest.mark.parametrize("scene", [SCENES["raft"], SCENES["raft of rubber"]], ids=["linear", "large"])
def test_a_step_that_fails_leaves_all_as_it_was(scene):
    sim, other = (stepped(start(scene, 3), 6) for _ in range(2))
    with pytest.raises(ValueError, match="of its spacing: give a dt"):
        sim.step(10.0)
    force = np.zeros((len(sim.bodies), 3))
    force[-2, 0] = 1e308
    sim._core.assign_body("force", force)
    with pytest.raises(cn.Error, match="rank . of 3: velocity"):
        sim.step()
    for of in (sim, other):
        of._core.assign_body("force", 0 * force)
        stepped(of, 6)
    assert digest(sim) == digest(other)


def test_a_run_whose_state_nobody_reads_is_the_same_as_its_steps():
    sims = [stepped(start(SCENES["raft of rubber"], ranks), 12) for ranks in (1, 3)]
    sims.append(start(SCENES["raft of rubber"], 3))
    sims[-1].run(12, progress=False)
    assert len({digest(sim) for sim in sims}) == 1


OF_PROCESSES = ("gate of rubber", "raft", "beam at large strains", "wall", "cube in space")


@needs_mpi
@pytest.mark.parametrize("processes", [2, 4])
def test_processes_have_the_same_bits(processes, tmp_path):
    found = digests(tmp_path, __name__, OF_PROCESSES, 'of.stepped(of.start(of.SCENES[name], "mpi"), 6)', processes)
    due = {name: digest(stepped(start(SCENES[name], 3), 6)) for name in OF_PROCESSES}
    assert all(of == due for of in found)
