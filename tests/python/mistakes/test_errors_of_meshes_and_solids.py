"""Errors that name what went wrong where another reason was told, or none: tangents, one node, bodies round an axis."""

import warnings

import cairn as cn
import numpy as np
import pytest

SKIN = cn.Material("skin", density=1.0)


def sprung(points, tangent):
    points = np.array(points, float)
    mass = np.ones(len(points))
    return cn.CallbackBody(points, mass, lambda at: (100.0 * at.displacement, tangent * np.eye(points.size)), groups={"n": [0]})


def test_the_tangent_of_nodes_at_one_place_needs_a_size():
    for points in ([[0.0, 1.0]], [[0.0, 1.0], [0.0, 1.0]]):
        for tangent in (7.0, 100.0):
            with pytest.raises(ValueError, match="the nodes are at one place.*give size"):
                sprung(points, tangent).tangent_error()
        assert sprung(points, 7.0).tangent_error(size=1e-6) > 0.5
        assert sprung(points, 100.0).tangent_error(size=1e-6) < 1e-6


def test_a_mesh_of_one_node_passes_through_no_cell():
    scene = cn.Scene(dim=2, gravity=(0, 0))
    body = cn.CallbackBody(np.array([[0.0, 1.0]]), np.ones(1), lambda at: (100.0 * at.displacement, 100.0 * np.eye(2),
                           50.0 * np.sum(at.displacement**2)), groups={"n": [0]})  # fmt: skip
    scene.add(cn.deformable(body, SKIN, contact=[0], velocity=(0, -3.0)))
    scene.add(cn.wall((0, 0.9), (0, 1), SKIN))
    scene.interact(SKIN, SKIN, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=1e-3)
    with warnings.catch_warnings():
        warnings.simplefilter("error", cn.TunnellingWarning)
        for _ in range(100):
            sim.step()
    assert sim.nodes.position[0, 1] > 0.89


def test_an_axisymmetric_elastic_body_is_a_solid():
    points, cells = [[1, 0], [2, 0], [2, 1], [1, 1]], {"quad": [[0, 1, 2, 3]]}
    with pytest.raises(ValueError, match="plane is 'axisymmetric'.*give cairn.SolidBody.*cairn.IsotropicElastic"):
        cn.ElasticBody(points, cells, young=1.0, poisson=0.3, plane="axisymmetric")


def sheared(material, steps=60, largest=0.1):
    """Shear stress of one square in plane strain that is sheared, no mean stress in the plane."""
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    body = cn.SolidBody(points, {"quad": [[0, 1, 2, 3]]}, material, density=1.0, kinematics="small")
    model = body.model()
    for share in np.linspace(0, largest, steps)[1:]:
        found = body.stress(points @ [[0.0, share], [share, 0.0]], model)["quad"][0]
        model.commit()
    return found


@pytest.mark.parametrize("phi", [0.2, 0.5, 0.8])
def test_the_cone_of_plane_strain_is_as_the_manual_has_it(phi):
    cohesion, elastic = 1.0, {"young": 200.0, "poisson": 0.3}
    outer = sheared(cn.DruckerPrager(**elastic, cohesion=cohesion, friction_angle=phi))
    assert outer[3] == pytest.approx(6 * np.cos(phi) / (np.sqrt(3) * (3 - np.sin(phi))), rel=1e-6)
    eta, xi = np.sin(phi), np.cos(phi)
    sine = 3 * np.sqrt(3) * eta / (6 + np.sqrt(3) * eta)
    fitted = cn.DruckerPrager(**elastic, friction_angle=np.arcsin(sine),
                              cohesion=cohesion * xi * np.sqrt(3) * (3 - sine) / (6 * np.sqrt(1 - sine**2)))  # fmt: skip
    assert sheared(fitted)[3] == pytest.approx(cohesion * np.cos(phi), rel=1e-6)


def test_what_rubber_and_soils_are_is_told():
    assert "2 C10" in cn.Ogden.__doc__ and "sum of shear_k power_k / 2" in cn.Ogden.__doc__
    assert "edges of compression" in cn.DruckerPrager.__doc__ and "root of a cell's area" in cn.IsotropicDamage.__doc__


@pytest.mark.parametrize("radius", [1.0, 100.0])
def test_a_crack_of_an_axisymmetric_body_takes_its_energy_per_area_wherever_it_is(radius):
    points = np.array([[0.0, 0.0], [0.2, 0.0], [0.2, 0.2], [0.0, 0.2]]) + [radius, 0.0]
    law = cn.IsotropicDamage(young=200.0, poisson=0.0, strength=1.0, fracture_energy=0.01)
    body = cn.SolidBody(points, {"quad": [[0, 1, 2, 3]]}, law, density=1.0, kinematics="small", plane="axisymmetric")
    model, work, before, last = body.model(), 0.0, 0.0, np.zeros_like(points)
    for share in np.linspace(0, 1.0, 2001)[1:]:
        u = np.stack([np.zeros(4), share * points[:, 1]], axis=1)
        force = np.ravel(body.tangent(u, model)[0])
        model.commit()
        work += 0.5 * (force + before) @ np.ravel(u - last)
        before, last = force, u
    area = np.pi * (points[:, 0].max() ** 2 - points[:, 0].min() ** 2)
    assert work / area == pytest.approx(0.01, rel=0.01)


@pytest.mark.parametrize("fixed", [{}, {"foot": "x"}])
def test_a_solid_that_nothing_holds_is_told_as_such(fixed):
    points, cells = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), {"quad": [[0, 1, 2, 3]]}
    body = cn.SolidBody(points, cells, cn.NeoHookean(young=1e5, poisson=0.3), density=1.0, groups={"foot": [0, 1], "top": [2, 3]})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(RuntimeError, match="the body moves as a whole, or a part of it.*hold more dofs in `fixed`"):
            body.solve(fixed=fixed, force={"top": (0.3, -1.0)})
        assert np.isfinite(body.solve(fixed={"foot": "xy"}, force={"top": (0.3, -1.0)})).all()
