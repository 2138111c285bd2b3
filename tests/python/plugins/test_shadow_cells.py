"""Shadows of materials and elements: plain references beside the core's, routines that are wrong, bits that stay."""

import cairn as cn
import numpy as np
import pytest
from second_order import box

ROCK = cn.Material("rock", density=1000.0)


def simulation(kind="quad", law=None, velocity=-1.0):
    dim = 3 if kind.startswith(("tetra", "hexahedron")) else 2
    rng = np.random.default_rng(5)
    points, cells = box(kind, (3, 2, 2)[:dim], (1.0,) * dim)
    inside = np.all((points > 0.01) & (points < 0.99), axis=1)
    points = points + np.where(inside[:, None], 0.05 * rng.uniform(-1, 1, points.shape), 0.0)
    given = {"density": 1000.0, "groups": {"foot": np.flatnonzero(points[:, -1] < 1e-9)}}
    if law is None:
        body = cn.ElasticBody(points, cells, young=1e6, poisson=0.3, **given)
    else:
        body = cn.SolidBody(points, cells, law, **given)
    speed = np.zeros(points.shape)
    speed[:, -1] = velocity * points[:, -1]
    scene = cn.Scene(dim=dim)
    scene.add(cn.deformable(body, ROCK, velocity=speed, fixed={"foot": "xyz"[:dim]}))
    return cn.Simulation(scene, 1e-3, cn.NSCD(0.5))


LAWS = {
    "small": lambda: cn.IsotropicElastic(young=1e6, poisson=0.3), "rubber": lambda: cn.NeoHookean(young=1e6, poisson=0.3),
    "green": lambda: cn.SaintVenantKirchhoff(young=1e6, poisson=0.3),
}  # fmt: skip


KINDS = ["triangle", "quad", "triangle6", "quad8", "quad9", "tetra", "hexahedron", "tetra10", "hexahedron20", "hexahedron27"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("law", [*LAWS])
def test_plain_references_agree(kind, law, tmp_path):
    sim, alone = (simulation(kind, LAWS[law]()) for _ in range(2))
    shadows = [sim.shadow(stage, tol=1e-9, folder=tmp_path) for stage in ("stresses", "element_forces")]
    for _ in range(12):
        sim.step()
        alone.step()
    for shadow in shadows:
        assert shadow.beyond is None and len(shadow.records) == 12 and shadow.largest < 1e-9
    assert np.array_equal(sim.meshes[0].displacement, alone.meshes[0].displacement)
    assert np.abs(sim.meshes[0].displacement).max() > 5e-3


def test_forces_of_a_linear_body_agree(tmp_path):
    sim = simulation()
    shadow = sim.shadow("element_forces", tol=1e-10, folder=tmp_path)
    for _ in range(5):
        sim.step()
    assert shadow.beyond is None and len(shadow.records) == 5


@pytest.mark.parametrize("kind", KINDS)
def test_stresses_of_a_linear_body_agree(kind, tmp_path):
    """Displayed stresses: in the middles of the cells, in the plane xx yy xy."""
    sim = simulation(kind)
    shadow = sim.shadow("stresses", tol=1e-10, folder=tmp_path)
    for _ in range(3):
        sim.step()
    assert shadow.beyond is None and len(shadow.records) == 3


def test_a_material_that_errs_from_some_stretch_on_is_found(tmp_path):
    """A rubber that a second routine takes for Saint-Venant's: the difference grows with the strain, and a file holds the first
    step beyond."""
    from cairn.run.shadow_cells import plain_stresses

    def other(given):
        mine = {kind: [("SaintVenantKirchhoff", of[1], of[2]) for of in laws] for kind, laws in given["materials"].items()}
        return plain_stresses({**given, "materials": mine})

    sim = simulation(law=LAWS["rubber"]())
    shadow = sim.shadow("stresses", other, tol=0.01, folder=tmp_path)
    for _ in range(30):
        sim.step()
    found = [r[2] for r in shadow.records]
    assert 0 < found[0] < 0.01 < max(found) and shadow.beyond[0] > 1
    with np.load(shadow.dump) as stored:
        assert stored["given_by_shadow_quad"].shape == (6, 6) and stored["displacement"].shape == (12, 2)
    assert shadow.beyond[3] in sim.meshes[0].ids


def test_what_a_shadow_of_cells_cannot_be_is_told(tmp_path):
    scene = cn.Scene(dim=2)
    scene.add(cn.disks([[0.0, 0.0]], 0.1, ROCK))
    with pytest.raises(ValueError, match="needs a deformable body of cells, and there is none"):
        cn.Simulation(scene, 1e-3).shadow("stresses")
    sim = simulation(law=cn.J2Plasticity(young=1e6, poisson=0.3, yield_stress=1e3))
    sim.shadow("stresses", folder=tmp_path)
    with pytest.raises(ValueError, match="not J2Plasticity: give a function"):
        sim.step()
    sim = simulation(law=LAWS["rubber"]())
    sim.shadow("element_forces", lambda given: np.zeros(3), folder=tmp_path)
    with pytest.raises(ValueError, match=r"shape \(3,\): \(12, 2\) was expected"):
        sim.step()
