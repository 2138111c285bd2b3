"""Bodies of materials of solids: forces and tangents of every element, patch tests at large strain, the step with contacts."""

import os
import subprocess
import sys

import cairn as cn
import numpy as np
import pytest
from cairn import J2Plasticity, KelvinVoigt, NeoHookean, SolidBody
from cairn.build.bulk import BULK_MATERIALS
from second_order import CELLS, box

ALL = [(dim, kind) for dim, kinds in CELLS.items() for kind in kinds]
RUBBER = NeoHookean(young=1.0, poisson=0.3)
HOOKE = BULK_MATERIALS["IsotropicElastic"](young=1.0, poisson=0.3)


def full(body, values):
    """The symmetric matrix of a lower triangle."""
    start, row = body.lower[:2]
    n = body.points.size
    out = np.zeros((n, n))
    column = np.repeat(np.arange(n), np.diff(start))
    out[row, column] = values
    return out + np.tril(out, -1).T


def options(dim, kind):
    """Kinematics, plane and mean dilatation that fit."""
    yield {}
    yield {"material": HOOKE, "kinematics": "small"}
    yield {"material": HOOKE, "kinematics": "corotational"}
    first = kind in ("quad", "hexahedron", "triangle", "tetra")
    if first:
        yield {"mean_dilatation": True}
        yield {"material": HOOKE, "mean_dilatation": True, "kinematics": "small"}
    if dim == 2:
        yield {"plane": "stress", "thickness": 0.7}
        yield {"plane": "axisymmetric"}
    if dim == 2 and first:
        yield {"plane": "axisymmetric", "mean_dilatation": True}


@pytest.mark.parametrize("dim, kind", ALL)
def test_forces_are_the_gradient_of_the_energy_and_tangents_theirs(dim, kind):
    rng = np.random.default_rng(1)
    points, cells = box(kind, (1,) * dim, (1.0,) * dim, lambda x: x + 0.05 * rng.random(x.shape) + 0.5)
    for o in options(dim, kind):
        o = dict(o)
        body = SolidBody(points, cells, o.pop("material", RUBBER), density=1.0, **o)
        u = 0.05 * (rng.random(points.size) - 0.5)
        force, values, *_ = body.tangent(u)
        k = full(body, values)
        for dof in rng.choice(points.size, 4, replace=False):
            change = np.zeros(points.size)
            change[dof] = 1e-5
            up, down = body.tangent(u + change), body.tangent(u - change)
            assert (up[2] - down[2]) / 2e-5 == pytest.approx(force[dof], abs=1e-8), o
            assert np.abs((up[0] - down[0]) / 2e-5 - k[dof]).max() < 1e-6 * np.abs(k).max(), o


@pytest.mark.parametrize("dim, kind", ALL)
def test_a_homogeneous_deformation_is_met_exactly(dim, kind):
    """u = (F - 1) X on the boundary: the same inside, and the same stress everywhere."""
    rng = np.random.default_rng(2)
    points, cells = box(kind, (2,) * dim, (1.0,) * dim)
    inside = np.all((points > 1e-9) & (points < 1 - 1e-9), axis=1)
    if kind in ("quad", "hexahedron", "triangle", "tetra"):
        points[inside] += 0.1 * (rng.random((inside.sum(), dim)) - 0.5)
    f = np.array([[1.3, 0.4, 0.0], [0.1, 0.8, 0.0], [0.0, 0.0, 1.0]])[:dim, :dim]
    exact = points @ (f - np.eye(dim)).T
    body = SolidBody(points, cells, RUBBER, groups={"boundary": np.flatnonzero(~inside)})
    u = body.solve({"boundary": "xyz"[:dim]}, displacement=exact, increments=3)
    assert np.abs(u - exact).max() < 1e-12
    stress = body.stress(u)[kind]
    assert np.abs(stress - stress[0]).max() < 1e-12
    mu, lame = 1 / 2.6, 0.3 / (1.3 * 0.4)
    j = np.linalg.det(f)
    whole = np.eye(3)
    whole[:dim, :dim] = f
    true = (mu * (whole @ whole.T - np.eye(3)) + lame * np.log(j) * np.eye(3)) / j
    assert stress[0] == pytest.approx([true[0, 0], true[1, 1], true[2, 2], true[0, 1], true[1, 2], true[0, 2]], abs=1e-12)
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])[:dim, :dim]
    for material, kinematics in ((RUBBER, None), (HOOKE, "corotational"), (HOOKE, "logarithmic"), (HOOKE, "total_lagrangian")):
        still = SolidBody(points, cells, material, kinematics=kinematics).tangent(points @ (turn - np.eye(dim)).T)[0]
        assert np.abs(still).max() < 1e-13


def test_linear_stiffness_is_that_of_the_linear_body():
    for dim, kind in ALL:
        points, cells = box(kind, (2,) * dim, (1.0,) * dim)
        linear = cn.ElasticBody(points, cells, young=1.0, poisson=0.3, density=2.0)
        body = SolidBody(points, cells, HOOKE, density=2.0)
        assert np.abs(body.lower[3] - linear.lower[3]).max() < 1e-14
        assert np.array_equal(body.lower[2], linear.lower[2])


def test_threads_keep_bits():
    script = (
        "import numpy as np, sys; sys.path.insert(0, 'tests/python')\n"
        "from second_order import box\nfrom cairn import SolidBody, NeoHookean\n"
        "p, c = box('hexahedron', (7, 6, 9), (1.0, 1.0, 1.0))\n"
        "b = SolidBody(p, c, NeoHookean(young=1.0, poisson=0.3))\n"
        "r = b.tangent(0.02 * np.sin(37 * p))\n"
        "import hashlib; print(hashlib.sha256(r[0].tobytes() + r[1].tobytes()).hexdigest(), r[2].hex())"
    )
    out = {
        subprocess.run(
            [sys.executable, "-c", script],
            env={**os.environ, "OMP_NUM_THREADS": str(n)},
            capture_output=True,
            check=True,
            text=True,
        ).stdout
        for n in (1, 2, 3)
    }
    assert len(out) == 1


# ---------------------------------------------------------------- in a scene


def dropped(dim, material, *, height=0.02, counts=3, kind=None, dt=1e-3, speed=0.0, strategy=None, young_scale=1.0, **options):
    """A block above a plane, under gravity."""
    kind = kind or ("quad" if dim == 2 else "hexahedron")
    points, cells = box(kind, (counts,) * dim, (1.0,) * dim)
    points[:, -1] += height
    body = SolidBody(points, cells, material, density=1000.0, groups={"bottom": points[:, -1] < height + 1e-9}, **options)
    body.groups["bottom"] = np.flatnonzero(points[:, -1] < height + 1e-9)
    rock = cn.Material("rock", density=2500.0)
    down = np.zeros(dim)
    down[-1] = -10.0
    scene = cn.Scene(dim=dim, gravity=down)
    velocity = np.zeros(dim)
    velocity[-1] = -speed
    scene.add(cn.deformable(body, rock, contact=np.arange(len(points)), velocity=velocity))
    scene.add(cn.wall((0.0,) * dim, tuple(-down / 10.0), rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, dt=dt, strategy=strategy or cn.NSCD(solver=cn.NLGS(tol=1e-10)))


@pytest.mark.parametrize("dim", [2, 3])
def test_a_neo_hookean_block_falls_on_a_plane(dim):
    sim = dropped(dim, NeoHookean(young=2e5, poisson=0.3), rayleigh=(20.0, 2e-3))
    passes, errors = [], []
    for _ in range(400):
        report = sim.step()
        assert report["status"] == "converged"
        passes.append(report["newton_passes"])
        errors.append(report["newton_error"])
    assert max(errors) <= 1e-8 and 1 < max(passes) < 8
    assert np.abs(sim.contacts.force[:, -1]).sum() == pytest.approx(10_000.0, rel=1e-3)
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
    """A block thrown at a plane keeps its dents; what it dissipated is told; a restart goes on to the same bits."""
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
    sim = dropped(2, NeoHookean(young=1e3, poisson=0.3), speed=300.0, dt=0.02)
    sim.step(1e-6)
    before = [sim.bodies.position.copy(), sim.bodies.velocity.copy(), sim.time]
    with pytest.raises(ValueError, match="mesh 'mesh'.*quad cell"):
        for _ in range(50):
            before = [sim.bodies.position.copy(), sim.bodies.velocity.copy(), sim.time]
            sim.step()
    assert np.array_equal(sim.bodies.position, before[0]) and np.array_equal(sim.bodies.velocity, before[1])
    assert sim.time == before[2]
    sim.step(1e-6)


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
