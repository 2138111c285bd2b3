"""Deformable blocks of an assembly, openings and slips of their joints, and pictures of them."""

import cairn as cn
import matplotlib
import numpy as np
import pytest
from cairn.post import cracks, masonry_plots
from cairn.post.masonry import Structure
from cairn.pre import masonry
from cairn.pre.blocks import Blocks

matplotlib.use("Agg")
pytest.importorskip("scipy")
STONE = cn.Material("stone", density=1900.0)
ZONE = cn.MAL(normal_stiffness=1e10, tangential_stiffness=4e9, mu=0.7, normal_strength=2e5, tangential_strength=3e5,
              normal_work=18.0, tangential_work=60.0)  # fmt: skip


def pulled(dim, young=1e12, way=1e-4):
    """A beam on a brick that is a mesh, on a support, pulled up: the zones above and below open together."""
    blocks, wide = Blocks(dim), [0.2, 0.1][: dim - 1]
    for low, high, part in ((-0.1, 0.0, "support"), (0.0, 0.05, "brick"), (0.05, 0.15, "beam")):
        blocks.add_box([0.0] * (dim - 1) + [low], [*wide, high], part)
    meshed = masonry.mesh(blocks, 0.05, young=young, poisson=0.0, joint=ZONE, rigid=("support", "beam"))
    scene = cn.Scene(dim, gravity=(0.0,) * dim)
    ids = meshed.add_to(scene, STONE)
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=1.0))
    sim.run(steps=2, progress=False)
    names = ("vx", "vy", "w") if dim == 2 else ("vx", "vy", "vz", "wx", "wy", "wz")
    velocity = np.zeros(len(names))
    velocity[dim - 1] = way / 0.02
    sim.drive(ids[2], names, velocity)
    sim.run(steps=20, progress=False)
    return blocks, meshed, sim, cracks.MeshedStructure(meshed, sim, ids)


@pytest.mark.parametrize("dim", [2, 3])
def test_openings_of_zones_of_meshes_add_up_to_the_way_of_the_beam(dim):
    blocks, meshed, sim, structure = pulled(dim)
    found = cracks.cracks(structure)
    assert found.blocks.tolist() == [[0, 1], [1, 2]] or len(found) == 2
    assert found.widest.sum() == pytest.approx(1e-4, rel=1e-3)
    assert found.largest_slip.max() < 1e-3 * found.widest.max()
    assert found.damage.max() > 0.2 and np.all((found.damage >= 0) & (found.damage <= 1))
    assert structure.displacement()[2] == pytest.approx(1e-4, rel=1e-6) and structure.displacement()[0] == 0
    for colour in ("slip", "damage"):
        assert "largest 0." in cracks.draw(structure, colour=colour).get_title()


def test_sound_zones_let_a_wall_stand_and_count_no_contact_that_never_was_a_bond():
    meshed = masonry.mesh(masonry.wall(0.44, 2), young=1e10, joint=ZONE)
    scene = cn.Scene(3, gravity=(0.0, 0.0, -9.81))
    ids = meshed.add_to(scene, STONE)
    sim = cn.Simulation(scene, 1e-3)
    sim.run(steps=3, progress=False)
    structure = cracks.MeshedStructure(meshed, sim, ids)
    assert np.nanmax(cracks.cracks(structure).damage) == 0
    assert cracks.draw(structure).get_title() == "no joint has opened"
    stress = structure.stress()
    assert np.isnan(stress[meshed.blocks.mask("support")]).all() and np.all(stress[0, 2, 2] < 0)
    assert "meshes of" in repr(meshed) and len(meshed) == len(ids)


def test_rigid_joints_open_as_wedges():
    """A block turned about its lower left corner."""
    blocks = Blocks(2)
    blocks.add_box((0, -0.5), (1, 0), "support")
    blocks.add_box((0, 0), (1, 1), "block")
    scene = cn.Scene(2, gravity=(0.0, 0.0))
    ids = blocks.add_to(scene, STONE)
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, 1e-3)
    structure = Structure(blocks, sim, ids)
    angle = 0.01
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    place, rotation = np.array(sim.bodies.position), np.array(sim.bodies.rotation)
    row = structure.rows()[1]
    place[row], rotation[row] = turn @ place[row], angle
    sim.bodies.set(position=place, rotation=rotation)
    found = cracks.cracks(structure)
    order = np.argsort(found.points[0][:, 0])
    assert np.sort(np.abs(found.opening[0])) == pytest.approx([0.0, np.sin(angle)], abs=1e-4)
    assert np.abs(found.opening[0][order][1]) > np.abs(found.opening[0][order][0])
    assert np.isnan(found.damage).all()
    outline, line = cracks._wedge(found.points[0], np.abs(found.opening[0]), 10.0, 1e-3)
    assert np.ptp(outline[:, 1]) == pytest.approx(10 * np.sin(angle), rel=0.02) and np.ptp(line[:, 0]) == pytest.approx(1.0)
    with pytest.raises(ValueError, match='give "slip" or "damage"'):
        cracks.draw(structure, colour="width")


def test_meshes_have_the_volume_of_their_blocks():
    angle, hexagon = np.pi / 3 * np.arange(6), Blocks(2)
    hexagon.add(np.column_stack((np.cos(angle), np.sin(angle))))
    for blocks in (masonry.panel(2, 2), masonry.arch(radius=5.0, thickness=0.8, voussoirs=5, depth=1.0), masonry.voronoi(
            (0, 0, 0), (1, 1, 1), 5, rng=1), hexagon):  # fmt: skip
        meshed = masonry.mesh(blocks, young=1e9, rigid=())
        for k, volume in enumerate(blocks.properties().measure):
            body = cn.ElasticBody(meshed.points[k], meshed.cells[k], young=1.0, poisson=0.0, density=1.0)
            assert body.nodal_mass().sum() == pytest.approx(volume, rel=1e-9)


def test_panel_with_joints_of_a_width():
    dry, wide = masonry.panel(3, 4, brick=(0.2, 0.05)), masonry.panel(3, 4, brick=(0.2, 0.05), gap=0.01)
    assert len(wide) == len(dry) and len(wide.joints().area) == 0
    low, high = wide.select("brick").bounds()
    assert high - low == pytest.approx([3 * 0.21 - 0.01, 4 * 0.06 - 0.01])
    sizes = np.array([np.ptp(v, axis=0) for v in wide.select("brick").vertices])
    assert np.allclose(sizes[:, 1], 0.05) and np.allclose(sorted(set(sizes[:, 0].round(6))), [0.095, 0.2])
    full = masonry.panel(3, 4, brick=(0.2, 0.05), gap=0.01, filled=True)
    assert len(full.joints().area) == len(dry.joints().area)
    assert full.select("brick").properties().measure.sum() == pytest.approx(np.prod(high - low))
    for options, words in (({"gap": -0.01}, "width >= 0"), ({"gap": 0.3}, "below the length of a brick")):
        with pytest.raises(ValueError, match=words):
            masonry.panel(3, 4, brick=(0.2, 0.05), **options)


def test_mistakes_in_meshes_are_told():
    wall, hexagon, angle = masonry.panel(2, 2), Blocks(2), np.pi / 3 * np.arange(6)
    hexagon.add(np.column_stack((np.cos(angle), np.sin(angle))))
    with pytest.raises(ValueError, match="more than 30,000"):
        masonry.mesh(masonry.voronoi((0, 0, 0), (1, 1, 1), 2, rng=1), 0.055, young=1e9)
    assert len(masonry.mesh(hexagon, 0.3, young=1e9).cells[0]["triangle"]) == 6 * 16
    for call, words in [
        (lambda: masonry.mesh([1, 2], young=1e9), "give Blocks"),
        (lambda: masonry.mesh(wall, -0.1, young=1e9), "size"),
        (lambda: masonry.mesh(wall, 1e-3, young=1e9), "block 0 .brick.: size is 0.001"),
        (lambda: masonry.mesh(wall, young=-1.0), "young"),
        (lambda: masonry.mesh(wall, young=1e9, poisson=0.5), "below 0.5"),
        (lambda: masonry.mesh(wall, young=1e9, joint="mortar"), "give a law"),
        (lambda: masonry.mesh(wall, young=1e9, rigid=("brick", "support")), "no block is left"),
        (lambda: masonry.mesh(wall, young=1e9).add_to(cn.Scene(2), cn.Material("rubble")), "density of material"),
        (lambda: masonry.mesh(wall, young=1e9).add_to(cn.Scene(2), STONE, rigid_options={"beam": {}}), "rigid blocks have"),
        (lambda: cracks.MeshedStructure(wall, None, []), "masonry.mesh"),
    ]:
        with pytest.raises(ValueError, match=words):
            call()


def test_thrust_lines_stand_out():
    arch = masonry.arch(radius=5.0, thickness=0.9, voussoirs=7)
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    ids = arch.add_to(scene, STONE)
    scene.interact("*", "*", cn.Coulomb(mu=0.7))
    sim = cn.Simulation(scene, 2e-3)
    sim.run(steps=5, progress=False)
    ax = masonry_plots.draw(Structure(arch, sim, ids), thrust=[[7, *range(4)], [*range(3, 7), 8]])
    assert len(ax.lines) == 4 and len(ax.collections) == 2, "two lines with their dots, no lines of forces"
    assert ax.lines[0].get_path_effects()


@pytest.mark.parametrize(
    "bond, size, courses", [("stack", 0.5, 2), ("running", 0.5, 2), ("running", 0.4, 2), ("running", 0.5, 4)]
)
def test_a_panel_under_pressure_sinks_as_its_joints_give_way(bond, size, courses):
    """Both blocks bring nodes and sides to a joint; contacts beside its bonds, which are of it, bear nothing."""
    columns, stiffness, young, pressure = 2, 1e9, 1e12, 1e5
    blocks = masonry.panel(columns, courses, (1.0, 1.0), bond)
    blocks.add_box((0.0, courses), (columns, courses + 0.1), "beam")
    joint = cn.CompositeInterface(normal_stiffness=stiffness, tangential_stiffness=stiffness / 2, tension=0.25e6, cohesion=0.35e6,
                                  normal_work=180.0, tangential_work=1250.0, friction=0.75, mu=0.75)  # fmt: skip
    meshed = masonry.mesh(blocks, size, young=young, poisson=0.0, joint=joint, rigid=("support", "beam"))
    scene = cn.Scene(2)
    load = {"beam": {"force": (0.0, -pressure * columns), "driven": ("vx", "w")}}
    beam = meshed.add_to(scene, STONE, plane="stress", rigid_options=load)[-1][0]
    sim = cn.Simulation(scene, 0.1, cn.NSCD(theta=1.0, solver=cn.Auto(tol=1e-8)))
    row = list(sim.bodies.id).index(beam)
    start = float(sim.bodies.position[row, 1])
    assert {sim.step()["status"] for _ in range(15)} == {"converged"}
    exact = (courses + 1) * pressure / stiffness + courses * pressure / young
    assert start - float(sim.bodies.position[row, 1]) == pytest.approx(exact, rel=1e-3)
