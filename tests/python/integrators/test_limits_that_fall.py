"""Steps of explicit integrators on bodies that stiffen, or whose cells grow thin, as they deform: the stable step is that of the
body as it is strained, and a step that was below it at the start is refused once it is above, before the motion shows it."""

import cairn as cn
import numpy as np
import pytest
from scipy import linalg, sparse
from second_order import box

ROCK = cn.Material("rock", density=1e3)
STIFFENS = cn.SaintVenantKirchhoff(young=1e6, poisson=0.3)
WAVE = 1 / np.sqrt(1e3)  # time of a wave over the block [s]
SIDES = {"bottom": "xy", "top": "x", "left": "x", "right": "x"}


def block(material, cells=(4, 4), kind="quad"):
    points, given = box(kind, cells, (1.0, 1.0))
    groups = {
        name: np.flatnonzero(points[:, axis] == at) for name, axis, at in
        (("bottom", 1, 0), ("top", 1, 1), ("left", 0, 0), ("right", 0, 1))
    }  # fmt: skip
    return cn.SolidBody(points, given, material, density=1e3, groups=groups, lumped=True, kinematics="total_lagrangian")


def pulled(material, to, share, integrator, cut_back=0, waves=40):
    """A block whose top is moved until it is `to` times as high; dt is a share of the stable step at the start."""
    body = block(material)
    rate = (to - 1) / (waves * WAVE)
    scene = cn.Scene(dim=2, gravity=(0, 0))
    scene.add(cn.deformable(body, ROCK, fixed=SIDES, drive={"top": {"y": lambda t: rate * min(1.0, t / (2 * WAVE))}}))
    sim = cn.Simulation(scene, dt=1e-9, strategy=cn.NSCD(integrator=integrator, cut_back=cut_back))
    sim.dt = share * sim.stable_step
    return sim


def true_limit(body, displacement, fixed):
    """By dense eigenvalues of the tangent."""
    free = np.setdiff1d(np.arange(body.points.size), body.dofs(fixed))
    start, row = body.lower[:2]
    lower = sparse.csc_array((body.tangent(displacement)[1], row, start)).toarray()
    k = (lower + np.tril(lower, -1).T)[np.ix_(free, free)]
    m = body.M.toarray()[np.ix_(free, free)]
    return 2 / np.sqrt(linalg.eigh(k, m, eigvals_only=True)[-1])


@pytest.mark.parametrize("kind", ["quad", "triangle", "quad9"])
@pytest.mark.parametrize("law, to", [("green", 1.5), ("neo_hookean", 0.4), ("neo_hookean", 2.0)])
def test_the_stable_step_is_that_of_the_body_as_it_is_strained(kind, law, to):
    body = block({"green": STIFFENS, "neo_hookean": cn.NeoHookean(young=1e6, poisson=0.3)}[law], (3, 3), kind)
    x = body.points
    bent = 0.05 * np.sin(2 * x[:, ::-1])
    displacement = np.column_stack([bent[:, 0], (to - 1) * x[:, 1] + bent[:, 1]])
    scene = cn.Scene(dim=2, gravity=(0, 0))
    scene.add(cn.deformable(body, ROCK, displacement=displacement))
    sim = cn.Simulation(scene, dt=1e-9, strategy=cn.NSCD(integrator=cn.CentralDifference()))
    limit = true_limit(body, displacement, {})
    assert 0.85 * limit < sim.stable_step <= limit
    sim.dt = 1.01 * limit
    with pytest.raises(ValueError, match="as it is strained now"):
        sim.step()
    assert sim.time == 0


@pytest.mark.parametrize("law", [
    cn.KelvinVoigt(young=1e6, poisson=0.3, viscous_young=1e3),
    cn.FiniteJ2(young=1e6, poisson=0.3, yield_stress=1e3, isotropic=1e4),
])  # fmt: skip
def test_to_ask_for_it_changes_nothing(law):
    """Stresses that are shown are those of the step, with their part of rates, and the next steps have the same bits."""
    points, cells = box("quad", (4, 4), (1.0, 1.0))
    groups = {"bottom": np.flatnonzero(points[:, 1] == 0)}
    kind = {"kinematics": "logarithmic"} if isinstance(law, cn.KelvinVoigt) else {}
    body = cn.SolidBody(points, cells, law, density=1e3, groups=groups, lumped=True, **kind)
    ends = []
    for asks in (False, True):
        scene = cn.Scene(dim=2, gravity=(0, 0))
        scene.add(cn.deformable(body, ROCK, fixed={"bottom": "xy"}, velocity=points * [0.1, -1.0]))
        sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(integrator=cn.CentralDifference()))
        for _ in range(20):
            sim.step()
        shown = sim.meshes[0].stress["quad"].copy()
        if asks:
            assert 0 < sim.stable_step < np.inf
        assert np.array_equal(sim.meshes[0].stress["quad"], shown) and shown.any()
        for _ in range(20):
            sim.step()
        ends.append((sim.meshes[0].displacement.copy(), sim.energy))
    assert np.array_equal(ends[0][0], ends[1][0]) and ends[0][1] == ends[1][1]


@pytest.mark.parametrize("integrator", [cn.CentralDifference(), cn.VelocityVerlet()])
def test_a_step_that_the_body_outgrew_is_refused(integrator):
    sim = pulled(STIFFENS, 1.5, 0.9, integrator)
    height, calm = [], []
    with pytest.raises(ValueError, match="beyond the stable step .* as it is strained now"):
        while sim.time < 40 * WAVE:
            sim.step()
            mesh = sim.meshes[0]
            height.append(1 + mesh.displacement[:, 1].max())
            calm.append(np.abs(mesh.velocity[:, 0]).max() / np.abs(mesh.velocity[:, 1]).max())
    limit = true_limit(mesh.body, mesh.displacement, SIDES)
    assert limit < sim.dt < 1.1 * limit  # refused before the step exceeds the stable one by a tenth
    assert 1.05 < height[-1] < 1.5
    assert max(calm) < 1e-2  # the block is stretched alone
    with pytest.raises(ValueError, match="as it is strained now"):
        sim.step()
    sim.dt = 0.9 * sim.stable_step
    assert sim.step()["status"] == "converged"


def test_shorter_parts_of_the_step_go_on():
    sim = pulled(STIFFENS, 1.3, 0.9, cn.CentralDifference(), cut_back=4)
    while sim.time < 40 * WAVE:
        assert sim.step()["status"] == "converged"
    mesh = sim.meshes[0]
    assert mesh.displacement[:, 1].max() == pytest.approx(0.3 * 39 / 40, rel=0.02)
    assert np.abs(mesh.velocity[:, 0]).max() < 0.02 * np.abs(mesh.velocity[:, 1]).max()
