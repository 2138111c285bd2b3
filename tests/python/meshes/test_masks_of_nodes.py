"""Groups of nodes by masks and by numbers, and invalid ones."""

import cairn as cn
import numpy as np
import pytest

SKIN = cn.Material("skin", density=100.0)
POINTS = np.array([[x, y] for x in (0.0, 1.0, 2.0) for y in (0.0, 1.0)])
CELLS = {"quad": [[0, 2, 3, 1], [2, 4, 5, 3]]}
FOOT = POINTS[:, 1] < 0.5


def elastic(**options):
    return cn.ElasticBody(POINTS, CELLS, young=1e5, poisson=0.3, density=100.0, **options)


def solid(**options):
    return cn.SolidBody(POINTS, CELLS, cn.NeoHookean(young=1e5, poisson=0.3), density=100.0, **options)


def linear(groups):
    return cn.LinearBody(POINTS, np.eye(12), np.eye(12), groups=groups)


def called(groups):
    return cn.CallbackBody(POINTS, np.ones(6), lambda at: (at.displacement, np.eye(12)), groups=groups)


def bars(groups):
    return cn.bars(POINTS[[0, 2, 4, 1, 3, 5]], [[0, 1], [1, 2]], young=1e5, area=1e-3, density=100.0, groups=groups)


@pytest.mark.parametrize("make", [elastic, solid, linear, called])
def test_a_mask_is_the_nodes_that_it_has(make):
    body = make(groups={"foot": FOOT, "list": FOOT.tolist(), "numbers": [0, 2.0, 4]})
    for name in body.groups:
        assert body.groups[name].tolist() == [0, 2, 4]


@pytest.mark.parametrize("make", [elastic, solid, linear, called, bars])
@pytest.mark.parametrize(
    ("group", "told"),
    [([1.5, 2.7], "the group 'g' has .*1.5"), ([np.nan], "the group 'g' has"), (["a"], "the group 'g' has"),
     ([True, False], r"the group 'g' is a mask of shape \(2,\): give numbers of nodes, or a mask \(6,\)")],
)  # fmt: skip
def test_what_is_no_node_is_refused(make, group, told):
    with pytest.raises(ValueError, match=told):
        make(groups={"g": group})


@pytest.mark.parametrize("make", [elastic, solid])
def test_nodes_of_contact_are_given_by_a_mask_too(make):
    for mask in (FOOT, FOOT.tolist()):
        nodes, *_ = cn.deformable(make(), SKIN, contact=mask)
        assert nodes.mesh.contact_nodes.tolist() == [0, 2, 4]
    assert cn.deformable(make(), SKIN, contact=[0, 4])[0].mesh.contact_nodes.tolist() == [0, 4]
    with pytest.raises(ValueError, match="1.5"):
        cn.deformable(make(), SKIN, contact=[1.5])
    with pytest.raises(ValueError, match="mask"):
        cn.deformable(make(), SKIN, contact=FOOT[:3])


def test_a_velocity_that_is_no_number_is_told_as_such():
    with pytest.raises(ValueError, match="drive of 'foot' along x is nan: give a finite number"):
        cn.deformable(elastic(groups={"foot": FOOT}), SKIN, drive={"foot": {"x": np.nan}})


def test_a_scene_of_a_body_of_several_materials_is_saved(tmp_path):
    soft, hard = cn.NeoHookean(young=1e5, poisson=0.3), cn.NeoHookean(young=1e6, poisson=0.2)
    body = cn.SolidBody(POINTS, CELLS, {"quad": ([soft, hard], np.array([0, 1]))}, density=100.0, groups={"foot": FOOT})
    scene = cn.Scene(2, gravity=(0.0, -10.0))
    scene.add(cn.deformable(body, SKIN, fixed={"foot": "xy"}, contact=[1]))
    scene.interact(SKIN, SKIN, None)
    scene.save(tmp_path / "two.scene.h5")
    sims = [cn.Simulation(of, 1e-3) for of in (scene, cn.Scene.load(tmp_path / "two.scene.h5"))]
    for sim in sims:
        sim.run(steps=5, progress=False)
    assert np.array_equal(*(sim.meshes[0].displacement for sim in sims)) and sims[0].meshes[0].displacement.any()


def test_options_before_a_script_are_told(tmp_path, capsys):
    from cairn.cli import main

    script = tmp_path / "pile.py"
    script.write_text("print('ran')\n")
    for words in (["--quiet"], ["--dt", "1e-3"], ["--steps", "5"]):
        assert main(["run", *words, str(script)]) == 1
        told = capsys.readouterr().err
        assert "pile.py is a script, which has a time step" in told and "NoneType" not in told
    assert main(["run", "--overwrite", str(script)]) == 0 and "ran" in capsys.readouterr().out


def test_a_joint_on_a_node_of_a_body_that_cracks_leaves_its_zones_to_it():
    """A plate pulled in two: a joint of a spring of no weight in its middle changes nothing."""
    rock = cn.Material("rock", density=2500.0)
    zone = cn.MAL(normal_stiffness=1e14, tangential_stiffness=1e14, mu=0.3, normal_strength=3e6, tangential_strength=3e6,
                  normal_work=30.0, tangential_work=30.0)  # fmt: skip
    x, y = np.meshgrid(np.linspace(0, 0.1, 5), np.linspace(0, 0.05, 3), indexing="ij")
    points, k = np.stack([x.ravel(), y.ravel()], axis=1), np.arange(15).reshape(5, 3)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)
    found = []
    for joined in (False, True):
        groups = {"left": k[0], "right": k[-1]}
        body = cn.ElasticBody(points, {"quad": quads}, young=3e10, poisson=0.2, density=2500.0, groups=groups)
        scene = cn.Scene(2)
        pieces = cn.fracture.split(body, zone, rock, opens="threshold", fixed={"left": "xy"}, drive={"right": {"x": 0.5}})
        ids = pieces.add_to(scene)
        if joined:
            ends = [points[7], points[7] + [0, 0.3]]
            scene.join(int(np.ravel(ids[0] if isinstance(ids, (list, tuple)) else ids)[7]), None,
                       cn.Distance(points=ends, spring=cn.Spring(1.0)))  # fmt: skip
        sim = cn.Simulation(scene, 1e-6, cn.NSCD(theta=0.52, solver=cn.NLGS(tol=1e-6)))
        sim.run(steps=400, progress=False)
        found.append((len(sim.nodes.id), sim.energy["released"]))
    assert found[0][1] > 1.0 and found[0][0] > 15
    assert found[1][0] == found[0][0] and found[1][1] == pytest.approx(found[0][1], rel=0.15)  # it had none


@pytest.mark.parametrize("joined", [False, True])
def test_a_joint_on_a_contact_node_leaves_its_part_of_the_surface(joined):
    """A plate glued to a block and drawn off: a spring of no weight on a node of its foot changes nothing."""
    rock, floor = cn.Material("rock", density=2500.0), cn.Material("floor", density=2500.0)
    zone = cn.MAL(normal_stiffness=1e13, tangential_stiffness=1e13, mu=0.0, normal_strength=1e6, tangential_strength=1e6,
                  normal_work=10.0, tangential_work=10.0)  # fmt: skip
    groups = {"foot": POINTS[:, 1] < 0.5, "top": POINTS[:, 1] > 0.5}
    plate = cn.ElasticBody(0.05 * POINTS, CELLS, young=1e9, poisson=0.0, density=2500.0, groups=groups)
    scene = cn.Scene(2)
    ids = scene.add(cn.deformable(plate, rock, drive={"top": {"y": 0.05}}, fixed={"top": "x"}, contact="foot", edges="foot"))
    scene.add(cn.polygons([[[-1, -0.1], [1, -0.1], [1, 0], [-1, 0]]], floor, driven=("vx", "vy", "w")))
    scene.interact("*", "*", None)
    scene.interact(rock, floor, zone)
    if joined:
        scene.join(int(np.ravel(ids)[2]), None, cn.Distance(points=[[0.05, 0.0], [0.3, 0.0]], spring=cn.Spring(1.0)))
    sim = cn.Simulation(scene, 4e-6)
    sim.run(steps=300, progress=False)
    assert sim.energy["released"] == pytest.approx(10.0 * 0.1, rel=1e-3)
