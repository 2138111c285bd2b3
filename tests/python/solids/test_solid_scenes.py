"""Bodies of materials of solids in scenes: Newton's method round the contact solver, plastic work, restart, failures."""

import cairn as cn
import numpy as np
import pytest
from cairn import J2Plasticity, KelvinVoigt, NeoHookean, SolidBody, _core
from cairn.model.bulk import BULK_MATERIALS
from cairn.run.views import core_of
from cell_blocks import dropped
from second_order import box


@pytest.mark.parametrize("dim", [2, 3])
def test_a_neo_hookean_block_falls_on_a_plane(dim):
    sim = dropped(dim, NeoHookean(young=2e5, poisson=0.3), rayleigh=(20.0, 2e-3))
    passes, errors = [], []
    for _ in range(800):
        report = sim.step()
        assert report["status"] == "converged"
        passes.append(report["newton_passes"])
        errors.append(report["newton_error"])
    assert max(errors) <= 1e-8 and 1 < max(passes) < 8
    assert np.abs(sim.contacts.force[:, -1]).sum() == pytest.approx(10_000.0, rel=5e-3)
    energy = sim.info["energy"]
    assert abs(energy["closure"]) < 1e-9 * energy["in_play"]
    assert sim.meshes[0].stress[next(iter(sim.meshes[0].stress))][:, dim - 1].mean() == pytest.approx(-5000.0, rel=0.2)


def test_one_pass_where_the_law_is_linear():
    """Small strains of Hooke's law: one pass, and the way of the linear body to rounding."""
    ways = []
    points, cells = box("quad", (3, 3), (1.0, 1.0))
    points[:, 1] += 0.02
    rock = cn.Material("rock", density=2500.0)
    for solid in (False, True):
        body = cn.ElasticBody(points, cells, young=2e5, poisson=0.3, density=1000.0, rayleigh=(1.0, 1e-3))
        if solid:
            material = BULK_MATERIALS["IsotropicElastic"](young=2e5, poisson=0.3)
            body = SolidBody(points, cells, material, density=1000.0, rayleigh=(1.0, 1e-3))
        scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
        scene.add(cn.deformable(body, rock, contact=np.arange(len(points))))
        scene.add(cn.wall((0, 0), (0, 1), rock))
        scene.interact(rock, rock, cn.Coulomb(mu=0.3))
        sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-12)))
        for _ in range(150):
            report = sim.step()
            assert report["newton_passes"] == (1 if solid else 0)
        ways.append((sim.meshes[0].displacement, sim.info["energy"]))
    assert np.abs(ways[0][0] - ways[1][0]).max() < 1e-9
    for term in ("kinetic", "stored", "dissipated_bulk", "dissipated_integrator"):
        assert ways[0][1][term] == pytest.approx(ways[1][1][term], rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("material, kinematics, some", [
    (BULK_MATERIALS["IsotropicElastic"](young=2e5, poisson=0.3), "small", False),
    (J2Plasticity(young=2e5, poisson=0.3, yield_stress=1e3), "small", True),
    (NeoHookean(young=2e5, poisson=0.3), None, True),
])  # fmt: skip
def test_a_matrix_that_stays_is_factorised_once(material, kinematics, some):
    """Hooke's law at small strains has one tangent, to the bit: factors are made anew where it, or the step, is another."""
    options = {"kinematics": kinematics} if kinematics else {}
    sim = dropped(2, material, speed=2.0, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-12)), **options)
    count = lambda: core_of(sim).mesh_work()["factorisations"]  # noqa: E731
    passes = sum(sim.step()["newton_passes"] for _ in range(30))
    assert sim.contacts.impulse.any()
    assert (1 < count() <= passes) if some else (count() == 1 and passes == 30)
    before = count()
    sim.dt = 2e-3
    sim.step()
    assert count() > before


def test_kelvin_and_voigts_body_is_rayleigh_damping():
    """Viscosity in proportion to stiffness is damping b K."""
    ways = []
    for b in (0.0, 3e-3):
        if b:
            material = BULK_MATERIALS["IsotropicElastic"](young=2e5, poisson=0.3)
        else:
            material = KelvinVoigt(young=2e5, poisson=0.3, viscous_young=2e5 * 3e-3, viscous_poisson=0.3)
        sim = dropped(2, material, rayleigh=(0.0, b), strategy=cn.NSCD(theta=0.7, solver=cn.NLGS(tol=1e-12)))
        for _ in range(100):
            sim.step()
        energy = sim.info["energy"]
        ways.append((sim.meshes[0].displacement, energy["dissipated_material"] + energy["dissipated_bulk"]))
    assert np.abs(ways[0][0] - ways[1][0]).max() < 1e-9
    assert ways[0][1] == pytest.approx(ways[1][1], rel=0.05) and ways[0][1] > 1.0


def test_plastic_work_and_restart(tmp_path):
    """A block thrown at a plane keeps its dents; its dissipation is reported; a restart goes on to the same bits."""
    steel = J2Plasticity(young=2e6, poisson=0.3, yield_stress=3e4, isotropic=2e4)
    ways = []
    for stop in (False, True):
        sim = dropped(2, steel, speed=6.0, kinematics="logarithmic", mean_dilatation=True)
        for k in range(60):
            if stop and k == 30:
                sim.checkpoint(tmp_path / "half.checkpoint.h5")
                sim = dropped(2, steel, speed=6.0, kinematics="logarithmic", mean_dilatation=True)
                sim.restore(tmp_path / "half.checkpoint.h5")
            report = sim.step()
            assert report["status"] == "converged"
        ways.append((sim.meshes[0].displacement, sim.meshes[0].velocity, sim.info["energy"]))
    energy = ways[0][2]
    start = 0.5 * 1000.0 * 36.0
    assert 0.2 * start < energy["dissipated_material"] < start
    assert np.array_equal(ways[0][0], ways[1][0]) and np.array_equal(ways[0][1], ways[1][1])
    assert energy == ways[1][2]


def test_a_cell_that_turns_inside_out_is_named_and_the_step_undone():
    """The top is driven through the bottom, which is held: no state of the block in between is the right way round."""
    points, cells = box("quad", (3, 3), (1.0, 1.0))
    body = SolidBody(points, cells, NeoHookean(young=1e5, poisson=0.3), density=1000.0)
    rock = cn.Material("rock", density=2500.0)
    bottom, top = np.flatnonzero(points[:, 1] < 1e-9), np.flatnonzero(points[:, 1] > 1 - 1e-9)
    scene = cn.Scene(dim=2)
    body.groups.update(bottom=bottom, top=top)
    scene.add(cn.deformable(body, rock, drive={"bottom": {"x": 0.0, "y": 0.0}, "top": {"x": 0.0, "y": -1.0}}))
    sim = cn.Simulation(scene, dt=0.01, strategy=cn.NSCD())
    assert sim.step()["status"] == "converged"
    before = [sim.nodes.position.copy(), sim.nodes.velocity.copy(), sim.time]
    with pytest.raises(ValueError, match="mesh 'mesh'.*quad cell"):
        sim.step(3.0)
    assert np.array_equal(sim.nodes.position, before[0]) and np.array_equal(sim.nodes.velocity, before[1])
    assert sim.time == before[2]
    assert sim.step(1e-6)["status"] == "converged"


def test_too_few_passes_are_told():
    strategy = cn.NSCD(newton_passes=1, solver=cn.NLGS(tol=1e-10))
    sim = dropped(2, NeoHookean(young=2e5, poisson=0.3), speed=3.0, strategy=strategy)
    found = [sim.step() for _ in range(20)]
    worst = next(r for r in found if r["status"] == "newton_limit")
    assert worst["newton_error"] > 1e-8
    assert "mesh 'mesh'" in worst["hint"] and "quad cell" in worst["hint"]


def test_powers_of_two_keep_bits():
    """Lengths doubled, times too (gravity halved), stresses and masses to match."""
    ways = []
    for s in (1.0, 2.0):
        points, cells = box("quad", (2, 2), (s, s))
        points[:, 1] += 0.02 * s
        rock = cn.Material("rock", density=2048.0)
        body = SolidBody(points, cells, NeoHookean(young=2e5, poisson=0.3), density=1024.0)
        scene = cn.Scene(dim=2, gravity=(0.0, -8.0 / s))
        scene.add(cn.deformable(body, rock, contact=np.arange(len(points)), velocity=(0.0, -1.0)))
        scene.add(cn.wall((0, 0), (0, 1), rock))
        scene.interact(rock, rock, cn.Coulomb(mu=0.3))
        sim = cn.Simulation(scene, dt=2.0**-10 * s)
        for _ in range(60):
            sim.step()
        ways.append(sim.meshes[0].displacement / s)
    assert np.array_equal(*ways)


@pytest.mark.parametrize("kind", [cn.J2Plasticity, cn.FiniteJ2])
def test_a_material_that_softens_to_nothing_is_told(kind):
    """Sheared until its yield stress is zero: the step ends by an error or a status, no plastic strain is beyond."""
    points, cells = box("quad", (1, 1), (1.0, 1.0))
    law = kind(young=1e6, poisson=0.3, yield_stress=1e3, isotropic=-1e4)
    body = SolidBody(points, cells, law, density=1000.0)
    bottom, top = np.flatnonzero(points[:, 1] < 0.5), np.flatnonzero(points[:, 1] > 0.5)
    body.groups.update(bottom=bottom, top=top)
    rock = cn.Material("rock", density=1000.0)
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, rock, drive={"bottom": {"x": 0.0, "y": 0.0}, "top": {"x": 1.0, "y": 0.0}}))
    sim = cn.Simulation(scene, dt=0.01, strategy=cn.NSCD())
    told = False
    for _ in range(60):
        try:
            told = sim.step()["status"] != "converged"
        except ValueError as error:
            told = "mesh 'mesh'" in str(error) and "quad cell" in str(error)
        if told:
            break
        strain = sim.meshes[0].material_state["quad"]["accumulated_plastic_strain"]
        assert 0 <= strain.max() <= 0.1 * (1 + 1e-12)
    assert told and strain.max() > 0.08


@pytest.mark.parametrize("kind", [cn.J2Plasticity, cn.FiniteJ2])
def test_what_softened_to_nothing_has_a_fault_and_a_remedy_of_its_own(kind):
    """Reported by the kernel's status, by a single body, and by a step with its remedy; a hardening metal carries the same
    strain."""
    points, cells = box("quad", (1, 1), (1.0, 1.0))
    law = {"young": 1e6, "poisson": 0.3, "yield_stress": 1e3}
    u = 0.3 * points[:, [1, 0]] * [1.0, 0.0]
    SolidBody(points, cells, kind(**law, isotropic=1e4)).tangent(u)
    soft = SolidBody(points, cells, kind(**law, isotropic=-1e4), density=1000.0)
    with pytest.raises(ValueError, match=f"quad cell 0 .*: {kind.__name__} has softened to a yield stress of zero"):
        soft.tangent(u)
    measure = np.zeros(9 if kind.takes_gradient else 6)
    measure[1 if kind.takes_gradient else 3] = 0.3
    values = list(soft.materials["quad"].values)
    states = np.zeros((1, len(kind.state)))
    assert _core.bulk_points(kind.name, values, measure[None], states, 1.0, 1.0, 1.0)["status"] == [4]
    soft.groups.update(all=np.arange(len(points)))
    scene = cn.Scene(dim=2)
    rock = cn.Material("rock", density=1000.0)
    sheared = {f"n{k}": {"x": float(x[1]), "y": 0.0} for k, x in enumerate(points)}
    soft.groups.update({f"n{k}": np.array([k]) for k in range(len(points))})
    scene.add(cn.deformable(soft, rock, drive=sheared))
    with pytest.raises(ValueError, match="softened to a yield stress of zero in step .*: give isotropic nearer to zero"):
        cn.Simulation(scene, dt=0.2).run(steps=5, progress=False)


def test_a_cell_that_names_a_node_twice_is_refused():
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [2.0, 0.5]])
    with pytest.raises(ValueError, match="quad cell 1 names node 2 twice: give a cell of fewer nodes"):
        body = SolidBody(points, {"quad": [[0, 1, 2, 3], [1, 4, 2, 2]]}, NeoHookean(young=1e5, poisson=0.3), density=1000.0)
        scene = cn.Scene(dim=2)
        scene.add(cn.deformable(body, cn.Material("rock", density=1000.0)))
        cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD())
