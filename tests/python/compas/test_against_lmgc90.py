"""The same problems of compas_dem by Solver.Cairn and by Solver.LMGC90, whose wheel is compas_lmgc90."""

import contextlib
import io

import numpy as np
import pytest

pytest.importorskip("compas_dem", reason="compas_dem is not installed")
pytest.importorskip("compas_lmgc90", reason="compas_lmgc90 is not installed")

from cairn_compas import Solver  # noqa: E402
from compas_dem.problem import Problem  # noqa: E402
from compas_dem.templates import ArchTemplate, BarrelVaultTemplate  # noqa: E402
from compas_models import loads_on_supports, model_of, stack, weight  # noqa: E402


def both(model, mu=0.6, setup=None, **times):
    out = []
    for solver in (Solver.Cairn(**times), Solver.LMGC90(**times, verbose=1000)):
        problem = Problem(model)
        problem.set_contact_model("MohrCoulomb", mu=mu)
        if setup is not None:
            setup(problem.add_boundary_condition("live"))
        problem.set_solver(solver)
        with contextlib.redirect_stdout(io.StringIO()):
            out.append(problem.solve())
    return out


def of_template(template, ends=False):
    meshes = template.blocks()
    return model_of(meshes, [0, len(meshes) - 1] if ends else [k for k, m in enumerate(meshes) if m.attributes["is_support"]])


@pytest.mark.parametrize("name", ["arch", "barrel"])
def test_structures_stand_with_both(name):
    if name == "arch":
        model = of_template(ArchTemplate(rise=3.0, span=10.0, thickness=0.5, depth=0.5, n=12), ends=True)
    else:
        model = of_template(BarrelVaultTemplate(vou_span=7, vou_length=3))
    ours, theirs = both(model, dt=2e-3, n_steps=100)
    assert ours.metadata["unconverged_steps"] == 0 and ours.metadata["ufr"] < 1e-3
    for results in (ours, theirs):
        assert np.abs(loads_on_supports(model, results) - [0, 0, -weight(model)]).max() < 1e-3 * weight(model)
        assert max(np.linalg.norm(results.displacement(k)) for k in results.nodes()) < 1e-5
    free = {b.graphnode for b in model.blocks()}
    seen = {tuple(sorted(e)) for e in theirs.edges() if free & set(e)}
    assert seen == {tuple(sorted(e)) for e in ours.edges()}  # LMGC90 lists pairs of supports, too


@pytest.mark.parametrize("kind", ["ramp", "instantaneous"])
def test_loads_act_alike(kind):
    def setup(live):
        live.add_point_load(2, [3000.0, 1000.0, -1000.0], loading_type=kind)
        live.add_surface_load(2, 5, [0.0, 0.0, -5000.0], loading_type=kind)
        live.add_moment(1, [0.0, 0.0, 500.0], loading_type=kind)

    model, kept = stack(3), []
    problem = Problem(model)
    problem.set_contact_model("MohrCoulomb", mu=0.6)
    setup(problem.add_boundary_condition("live"))
    from cairn_compas import build

    built = build(problem, duration=0.5, dt=0.01)
    while built.simulation.time < 0.48:
        built.simulation.step()
        kept.append(built.loads(built.simulation.time)[2])
    assert kept[-1] == pytest.approx([3000.0, 1000.0, -1000.0 - 5000.0 - 9.81 * 2000.0], rel=0.03)
    assert kept[10][0] == pytest.approx(3000.0 if kind == "instantaneous" else 3000.0 * 0.11 / 0.49, rel=1e-12)
    if kind == "ramp":
        ours, theirs = both(model, setup=setup, dt=0.01, n_steps=50)
        for edge in ours.edges():
            assert ours.resultant_global(edge) == pytest.approx(theirs.resultant_global(edge), rel=3e-3, abs=30.0)
            assert np.sign(ours.contact_frame(edge).zaxis.dot(theirs.contact_frame(edge).zaxis)) == 1


def test_a_block_slides_as_far_as_with_lmgc90():
    ours, theirs = both(stack(2), setup=lambda live: live.add_point_load(1, [15000.0, 0.0, 0.0]), dt=5e-3, n_steps=100)
    assert ours.displacement(1)[0] == pytest.approx(theirs.displacement(1)[0], rel=1e-2)
    begin, k = 0.49 * 0.6 * 2000.0 * 9.81 / 15000.0, 15000.0 / 0.49 / 2000.0  # slides once the ramp exceeds friction
    lasts = 0.49 - begin
    after = 0.01 * k * lasts**2 / 2 + 0.01**2 * k * lasts / 2
    assert ours.displacement(1)[0] == pytest.approx(k * lasts**3 / 6 + after, rel=1e-2)


def test_displacements_are_reached_in_full():
    """LMGC90's back-end lets the velocity fall to 0 over the duration and reaches half of them."""
    ours, theirs = both(stack(2), setup=lambda live: live.add_displacement(0, 0.0, 0.0, -0.02), dt=5e-3, n_steps=100)
    assert ours.displacement(0) == pytest.approx([0.0, 0.0, -0.02], abs=1e-12)
    assert ours.displacement(1)[2] == pytest.approx(-0.02, abs=1e-6)
    assert theirs.displacement(0)[2] == pytest.approx(-0.01, rel=0.02)
