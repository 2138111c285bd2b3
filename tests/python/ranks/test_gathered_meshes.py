"""Auto over ranks beside deformable bodies: contacts are gathered on the rank that has those on them, solved as without ranks."""


import cairn as cn
import numpy as np
import pytest
import test_mesh_ranks as meshes
from cairn.pre import masonry
from cairn.pre.blocks import Blocks
from over_mpi import digest_of, digests, needs_mpi
from test_mesh_ranks import ROCK, RUBBER, block, grains, many_nodes, new, walled

AUTO = cn.NSCD(solver=cn.Auto(tol=1e-4))
SWEEPS = cn.NSCD(solver=cn.NLGS(tol=1e-4))
SQUARE = np.array([(-0.5, -0.25), (0.5, -0.25), (0.5, 0.25), (-0.5, 0.25)])


def heavy(ratio):
    """Blocks under one of `ratio` times their mass, on a body that deforms."""
    scene = new(2)
    scene.add(block((6, 2), (0.0, 0.0), (3.0, 1.0), name="bed", fixed={"base": "xy"}))
    scene.add(cn.polygons([SQUARE + (1.5, 1.25 + 0.5 * k) for k in range(4)], ROCK))
    scene.add(cn.polygons([SQUARE + (1.5, 3.25)], ROCK, density=2600.0 * ratio))
    return walled(scene, 1)


def bonded():
    """Blocks bonded to each other and to a deformable body whose base is held, which stand out from it."""
    scene = new(2, cn.Bonded(mu=0.5))
    scene.add(block((4, 8), (0.0, 0.0), (1.0, 2.0), fixed={"base": "xy"}, name="pillar"))
    scene.add(cn.polygons([SQUARE + (1.5 + k, 0.25 + 0.5 * row) for row in range(4) for k in range(4)], ROCK))
    return scene


def bricks(law):
    """A wall of deformable bricks, bonded to each other and to a held one beside them, which stands out from that."""
    blocks = Blocks(2)
    blocks.add_box([-1.0, 0.0], [0.0, 1.5], "support")
    for row in range(3):
        for k in range(6):
            blocks.add_box([k, 0.5 * row], [k + 1, 0.5 * row + 0.5], "brick")
    scene = new(2, law)
    masonry.mesh(blocks, 0.25, young=1e9).add_to(scene, ROCK)
    return scene


def lid():
    """Grains between a slab of a thousand times their density and a body that lies on a wall."""
    scene = new(2)
    scene.add(block((8, 2), (0.0, 0.0), (8.0, 1.0), name="bed"))
    grains(scene, (8, 3), (0.55, 1.5))
    scene.add(cn.polygons([np.array([(0.1, 4.3), (7.9, 4.3), (7.9, 4.8), (0.1, 4.8)])], ROCK, density=2600.0 * 1e3))
    scene.add(cn.wall((8.1, 0), (-1, 0), ROCK))
    return walled(scene, 0, 1)


def afar():
    """Grains, and at the other end of the curve of ranks a body of rubber under a heavy block."""
    scene = new(2)
    grains(scene, (12, 3), (0.55, 0.55))
    scene.add(block((4, 2), (14.0, 0.0), (3.0, 1.0), RUBBER, name="pad"), cn.polygons([SQUARE + (15.5, 1.25)], ROCK))
    scene.add(cn.polygons([SQUARE + (15.5, 1.75)], ROCK, density=2600.0 * 1e3))
    return walled(scene, 0, 1)


def lone():
    """A tower under a heavy block, which is gathered, and far from it a body that flies beside a grain in flight."""
    scene = new(2)
    scene.add(cn.polygons([SQUARE + (1.5, 0.25 + 0.5 * k) for k in range(4)], ROCK))
    scene.add(cn.polygons([SQUARE + (1.5, 2.25)], ROCK, density=2600.0 * 1e6))
    scene.add(block((4, 2), (14.0, 6.0), (2.0, 1.0), name="flier", velocity=(-1.0, 0.0)), cn.disks([(18.0, 6.5)], 0.4, ROCK))
    return walled(scene, 1)


def loaded_slab():
    """Grains on a slab with many contact nodes, under a ball of 50,000 times their density."""
    scene = many_nodes()
    scene.add(cn.spheres([(2.0, 2.0, 2.2)], 0.99, ROCK, density=1.3e8))
    return scene


STIFF = {"normal_stiffness": 1e11, "tangential_stiffness": 1e11}
SCENES = {
    "heavy": lambda: heavy(30),
    "heavier": lambda: heavy(1e6),
    "lid": lid,
    "afar": afar,
    "slab": loaded_slab,
    "cohesive zones": lambda: bricks(cn.MAC(work=1e3, mu=0.5, **STIFF)),
    "parallel bonds": lambda: bricks(cn.ParallelBond(**STIFF)),
    "bonded": bonded,
    "lone": lone,
}


def run(scene, ranks, steps, strategy=AUTO, dt=1e-3, **options):
    sim = cn.Simulation(scene(), dt, strategy, overlap="ignore", ranks=ranks, **options)
    ends = []
    for _ in range(steps):
        sim.step()
        ends.append(sim.info["status"])
    return sim, ends


def digest(sim):
    state = [sim.bodies.position, sim.bodies.velocity, sim.nodes.position, sim.nodes.velocity]
    state += [sim.contacts.key, sim.contacts.impulse, np.array(list(sim.energy.values()))]
    return digest_of(state)


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_the_same_bits_for_every_number_of_ranks(scene):
    sims = [run(scene, ranks, 12)[0] for ranks in (1, 2, 3, 4, 7)]
    assert len({digest(sim) for sim in sims}) == 1
    assert sims[0].ranks.figures()["gathered_solves"] > 0


def test_contacts_are_gathered_on_the_rank_that_has_the_mesh():
    sim = run(afar, 4, 3)[0]
    of_block = np.linalg.norm(sim.bodies.position - sim.nodes.position[0], axis=1).argmin()
    figures = sim.ranks.figures()
    assert figures["gathered_rank"] == sim.ranks.owner[of_block] > 0 and figures["gathered_solves"] > 0


def test_the_rank_that_has_the_mesh_solves_though_it_has_no_contacts():
    sim = run(lone, 4, 12)[0]
    figures, on_tower = sim.ranks.figures(), set(sim.ranks.owner[:5])
    assert figures["gathered_solves"] > 0 and figures["gathered_rank"] not in on_tower
    assert not np.isin(sim.contacts.bodies, [sim.bodies.id[5], *sim.nodes.id]).any() and len(sim.contacts) > 0


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_steps_converge_where_those_without_ranks_do(scene):
    over, ends = run(scene, 3, 30)
    alone, due = run(scene, None, 30)
    assert ends.count("converged") >= due.count("converged")
    fall = 9.81 * alone.time**2 / 2
    for one, other in ((over.nodes, alone.nodes), (over.bodies, alone.bodies)):
        if len(one):
            assert np.abs(one.position - other.position).max() < 1e-3 * fall


def test_sweeps_alone_leave_steps_of_heavy_blocks():
    ends, by_auto = run(SCENES["heavier"], 3, 60, SWEEPS)[1], run(SCENES["heavier"], 3, 60)[1]
    assert by_auto.count("converged") >= 58 > ends.count("converged") + 10


# laws, kinds of bodies and cells, all gathered in each step
EXACT = {name: scene for name, scene in meshes.SCENES.items() if name != "squeezed"}


@pytest.mark.parametrize("scene", EXACT.values(), ids=EXACT)
def test_velocities_are_as_exact_as_is_asked(scene):
    strategy = cn.NSCD(solver=cn.Auto(tol=1e-4), accuracy=1e-4)
    sims = [run(scene, ranks, 10, strategy, dt=2e-3) for ranks in (None, 1, 3)]
    assert digest(sims[1][0]) == digest(sims[2][0]) and sims[1][0].ranks.figures()["gathered_solves"] >= 10
    assert all(set(ends) == {"converged"} for _, ends in sims) and sims[1][0].info["velocity_error"] <= 1e-4
    alone, over = sims[0][0].nodes.velocity, sims[1][0].nodes.velocity
    scale = max(np.abs(alone).max(), np.abs(sims[0][0].bodies.velocity).max())
    assert np.abs(alone - over).max() < 1e-3 * scale


@pytest.mark.parametrize("solver", [cn.PPANewton(tol=1e-8), cn.ADMM(tol=1e-8)], ids=lambda s: s.name)
def test_solvers_of_problems_take_contacts_of_meshes(solver):
    sims = [run(SCENES["heavy"], ranks, 12, cn.NSCD(solver=solver)) for ranks in (None, 1, 3)]
    assert digest(sims[1][0]) == digest(sims[2][0]) and sims[1][0].ranks.figures()["gathered_solves"] == 12
    assert sims[1][0].info["solver"] == sims[0][0].info["solver"] == solver.name
    speed = np.abs(sims[0][0].nodes.velocity).max()
    assert np.abs(sims[0][0].nodes.velocity - sims[1][0].nodes.velocity).max() < 1e-4 * speed


def test_compliances_that_exceed_the_memory_are_not_formed():
    """Contacts fit, and are solved by sweeps of one rank; impulses reach the nodes through factors."""
    strategy = cn.NSCD(solver=cn.Auto(tol=1e-4, memory=2e5))
    sims = [run(loaded_slab, ranks, 8, strategy) for ranks in (None, 1, 3)]
    assert digest(sims[1][0]) == digest(sims[2][0]) and sims[1][0].ranks.figures()["gathered_solves"] > 0
    assert all(set(ends) == {"converged"} for _, ends in sims)
    speed = np.abs(sims[0][0].nodes.velocity).max()
    assert np.abs(sims[0][0].nodes.velocity - sims[1][0].nodes.velocity).max() < 1e-4 * speed


def test_a_solver_that_refuses_the_contacts_leaves_meshes_as_they_were():
    sim = run(bonded, 2, 0, cn.NSCD(solver=cn.ADMM()))[0]
    with pytest.raises(ValueError, match="take cairn.NLGS or cairn.Auto"):
        sim.run(40, progress=False)
    before, steps = np.array(sim.nodes.position), sim.steps
    with pytest.raises(ValueError):
        sim.step()
    assert sim.steps == steps and np.array_equal(sim.nodes.position, before)


@pytest.mark.parametrize("name", ["heavier", "bonded", "parallel bonds"])
def test_restart_on_other_numbers_of_ranks(name, tmp_path):
    scene, path = SCENES[name], tmp_path / "gathered.checkpoint.h5"
    whole, sim = run(scene, 1, 24)[0], run(scene, 3, 8)[0]
    for ranks in (5, 1):
        sim.checkpoint(path)
        sim = run(scene, ranks, 0)[0]
        sim.restore(path)
        for _ in range(8):
            sim.step()
    assert digest(sim) == digest(whole)


OF_PROCESSES = ("heavier", "afar", "cohesive zones", "bonded", "lone")


@needs_mpi
@pytest.mark.parametrize("processes", [2, 4])
def test_processes_have_the_same_bits(processes, tmp_path):
    found = digests(tmp_path, __name__, OF_PROCESSES, 'of.run(of.SCENES[name], "mpi", 6)[0]', processes)
    assert all(of == {name: digest(run(SCENES[name], 3, 6)[0]) for name in OF_PROCESSES} for of in found)
