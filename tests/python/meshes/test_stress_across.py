"""Out-of-plane stress of bodies in 2D: in run files, and in von Mises stresses of pictures, which need it."""

import cairn as cn
import numpy as np
import pytest
from cairn.post.plots import field_values

SKIN = cn.Material("skin", density=100.0)


def grid(across=2):
    x = np.linspace(0, 1, across + 1)
    points = np.stack(np.meshgrid(x + 0.5, x, indexing="ij"), -1).reshape(-1, 2)
    k = np.arange((across + 1) ** 2).reshape(across + 1, -1)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)
    groups = {"bottom": k[:, 0], "top": k[:, -1], "left": k[0], "right": k[-1], "all": k.ravel()}
    return points, {"quad": quads}, groups


def pressed(bodies, tmp_path, fixed=None):
    """A run of bodies side by side, none of which touches another, pressed by a tenth."""
    scene = cn.Scene(dim=2, gravity=(0, 0))
    for k, body in enumerate(bodies):
        scene.add(cn.deformable(body, SKIN, fixed={"bottom": "y", "left": "x"} if fixed is None else fixed, name=f"body {k}",
                                displace={"top": {"y": lambda t: -0.1 * t}}, contact="top"))  # fmt: skip
    scene.interact(SKIN, SKIN, None)
    sim = cn.Simulation(scene, dt=5e-3, strategy=cn.NSCD(theta=1.0))
    sim.run(steps=10, output=tmp_path / "run.vtkhdf", every=10, overwrite=True, progress=False)
    return sim, cn.load(tmp_path / "run.vtkhdf")


def equivalent(x, y, z, xy):
    return np.sqrt(((x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2) / 2 + 3 * xy**2)


@pytest.mark.parametrize("plane", ["strain", "stress", "axisymmetric"])
def test_von_mises_of_metal_in_the_plane_is_its_yield_stress(plane, tmp_path):
    points, cells, groups = grid()
    metal = cn.J2Plasticity(young=1e5, poisson=0.3, yield_stress=50.0)
    body = cn.SolidBody(points, cells, metal, density=100.0, groups=groups, kinematics="small", plane=plane)
    held = {"bottom": "y", "left": "x"} | ({"right": "x"} if plane == "strain" else {})
    sim, run = pressed([body], tmp_path, held)
    of_cells = sim.meshes[0].stress["quad"]
    step = run[-1]
    assert np.array_equal(step.cells["stress_zz"], of_cells[:, 2])
    assert np.array_equal(sim.meshes[0].stress_zz["quad"], of_cells[:, 2])
    near = {"rel": 1e-6 if plane == "strain" else 0.1}  # means of points that bear other stresses are below it
    assert equivalent(*of_cells[:, :4].T) == pytest.approx(np.full(4, 50.0), **near)
    drawn, label = field_values(step, "von_mises")
    assert drawn == pytest.approx(np.full(len(points), 50.0), **near) and label == "von Mises stress [Pa]"
    assert np.array_equal(field_values(step, "stress_zz")[0], step.nodes["stress_zz"])
    run.plot(what="von_mises")


@pytest.mark.parametrize("many", [1, 3])
@pytest.mark.parametrize("initial", [None, (3e3, -2e3, 7e2, 4e2, 0.0, 0.0)])
@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_elastic_bodies_have_what_solids_of_the_same_law_have(plane, initial, many, tmp_path):
    if plane == "stress" and initial:
        initial = (3e3, -2e3, 0.0, 4e2, 0.0, 0.0)
    points, cells, groups = grid()
    law = {"young": 1e5, "poisson": 0.3}
    options = {"density": 100.0, "groups": groups, "plane": plane, "initial_stress": initial}
    elastic = [cn.ElasticBody(points, cells, **law, **options) for _ in range(many)]
    solid = cn.SolidBody(points, cells, cn.IsotropicElastic(**law), kinematics="small", **options)
    _, one = pressed(elastic, tmp_path)
    found = one[-1].cells["stress_zz"].reshape(many, -1), field_values(one[-1], "von_mises")[0].reshape(many, -1)
    _, other = pressed([solid], tmp_path)
    step = other[-1]
    for zz, von_mises in zip(*found):
        assert zz == pytest.approx(step.cells["stress_zz"], abs=1e-8 * np.abs(step.cells["stress"]).max())
        assert von_mises == pytest.approx(field_values(step, "von_mises")[0], rel=1e-7)


def test_parts_that_are_tied_have_what_each_law_gives(tmp_path):
    points, cells, groups = grid()
    parts = {name: cn.ElasticBody(points + [0, up], cells, young=1e5, poisson=nu, density=100.0, groups=groups)
             for name, nu, up in (("low", 0.1, 0.0), ("high", 0.4, 1.0))}  # fmt: skip
    both = cn.tied(parts, [("low.top", "high.bottom")])
    scene = cn.Scene(dim=2, gravity=(0, 0))
    pull = {"fixed": {"low.bottom": "xy"}, "displace": {"high.top": {"y": lambda t: -t}}}
    scene.add(cn.deformable(both, SKIN, contact="high.top", **pull))
    scene.interact(SKIN, SKIN, None)
    sim = cn.Simulation(scene, dt=5e-3, strategy=cn.NSCD(theta=1.0))
    sim.run(steps=5, progress=False)
    mesh = sim.meshes[0]
    stress, across = mesh.stress["quad"], mesh.stress_zz["quad"]
    assert across == pytest.approx(np.repeat([0.1, 0.4], 4) * stress[:, :2].sum(axis=1), rel=1e-12)
    assert mesh.nodal_fields()["stress_zz"].shape == (18,)


@pytest.mark.parametrize("kind", ["elastic", "solid"])
def test_what_is_warm_and_held_bears_its_expansion_across(kind, tmp_path):
    """Held on all sides and across: each stress is -E alpha (T - T0) / (1 - 2 nu), of cells and of nodes."""
    points, cells, groups = grid()
    law = {"young": 1e5, "poisson": 0.3}
    rock = cn.Material("rock", density=100.0, expansion=1e-5, conductivity=1.0, capacity=1.0)
    options = {"density": 100.0, "groups": groups}
    body = (cn.ElasticBody(points, cells, **law, **options) if kind == "elastic"
            else cn.SolidBody(points, cells, cn.IsotropicElastic(**law), kinematics="small", **options))  # fmt: skip
    scene = cn.Scene(dim=2, gravity=(0, 0))
    scene.add(cn.deformable(body, rock, fixed={"all": "xy"}, contact="all", name="part"))
    scene.interact(rock, rock, None)
    scene.thermal(temperature={"part.all": 310.0}, initial=300.0, reference=300.0, friction="none", steady=True,
                  conductance=cn.networks.Constant(conductance=0.0))  # fmt: skip
    sim = cn.Simulation(scene, dt=1e-3)
    sim.run(steps=2, output=tmp_path / "run.vtkhdf", progress=False)
    due = -1e5 * 1e-5 * 10 / (1 - 2 * 0.3)
    step = cn.load(tmp_path / "run.vtkhdf")[-1]
    for fields in (step.cells, step.nodes):
        assert fields["stress_zz"] == pytest.approx(due, rel=1e-9)
        assert np.asarray(fields["stress"])[:, :2] == pytest.approx(due, rel=1e-9)
    assert np.abs(field_values(step, "von_mises")[0]).max() < 1e-9 * abs(due)


def test_files_without_it_are_drawn_as_they_were(tmp_path):
    points, cells, groups = grid()
    _, run = pressed([cn.ElasticBody(points, cells, young=1e5, poisson=0.3, density=100.0, groups=groups)], tmp_path)
    step = run[-1]

    class Older(dict):
        def __contains__(self, name):
            return name != "stress_zz" and dict.__contains__(self, name)

    step.drawn = Older({"stress": step.nodes["stress"], "stress_zz": step.nodes["stress_zz"]})
    x, y, xy = np.asarray(step.nodes["stress"]).T
    assert field_values(step, "von_mises")[0] == pytest.approx(equivalent(x, y, 0 * x, xy))
