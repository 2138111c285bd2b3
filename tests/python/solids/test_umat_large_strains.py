"""Routines of Abaqus's interface at large strains, as it calls them with NLGEOM: laws of F, of increments, their arguments."""

import shutil
import subprocess
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn import FiniteJ2, NeoHookean, SolidBody
from cairn.run.views import core_of
from scipy import sparse
from second_order import box

COMPILER = shutil.which("gfortran")
pytestmark = pytest.mark.skipif(COMPILER is None, reason="needs gfortran")
STATES = {"neo": 0, "hypo": 6, "told": 19, "six": 0, "umat": 1}
KEPT = 26  # numbers of a state before those of the routine


@pytest.fixture(scope="module")
def routine(tmp_path_factory):
    library = tmp_path_factory.mktemp("umat") / "liblarge.so"
    sources = [str(Path(__file__).with_name(name)) for name in ("large_strain_umats.f90", "umat.f90")]
    command = [COMPILER, "-shared", "-fPIC", "-O1", "-w", "-ffree-line-length-132", "-o", str(library), *sources]
    subprocess.run(command, check=True, cwd=library.parent)
    return {name: cn.plug(library, material=f"large_{name}", state=n, routine=name) for name, n in STATES.items()}


def turn(dim, angle):
    """A rotation, in space round an axis that lies askew."""
    c, s = np.cos(angle), np.sin(angle)
    if dim == 2:
        return np.array([[c, -s], [s, c]])
    n = np.array([2.0, -1.0, 3.0]) / np.sqrt(14.0)
    cross = np.cross(np.eye(3), n)
    return c * np.eye(3) + s * cross.T + (1 - c) * np.outer(n, n)


def tensor(v, shear=(3, 4, 5), pairs=((0, 1), (1, 2), (0, 2))):
    """Tensor of displayed stresses, 11 22 33 12 23 13; in the plane 11 22 33 12."""
    t = np.diag(v[:3])
    for k, (i, j) in zip(shear, pairs):
        if k < len(v):
            t[i, j] = t[j, i] = v[k]
    return t


def by_parts(values):
    return tensor(values, pairs=((0, 1), (0, 2), (1, 2)))  # 11 22 33 12 13 23


def moved(points, f):
    return points @ (f - np.eye(len(f))).T


CASES = {
    "quad": ("quad", {}),
    "quad in plane stress": ("quad", {"plane": "stress"}),
    "quad round an axis": ("quad", {"plane": "axisymmetric"}),
    "quad of one dilatation": ("quad", {"mean_dilatation": True}),
    "quad9": ("quad9", {}),
    "tetra": ("tetra", {}),
    "hexahedron": ("hexahedron", {}),
}


@pytest.mark.parametrize("kinematics", ["total_lagrangian", "logarithmic"])
@pytest.mark.parametrize("case", CASES)
def test_a_law_of_cauchys_stress_is_the_built_in_one(routine, case, kinematics):
    """Stretch, shear and rotation, in steps: forces, tangent, energy and stress; the tangent is the difference of the forces."""
    kind, options = CASES[case]
    dim = 2 if kind.startswith("quad") else 3
    points, cells = box(kind, (2,) * dim, (1.0,) * dim)
    points[:, 0] += 4.0 if options.get("plane") == "axisymmetric" else 0.0
    own = SolidBody(points, cells, routine["neo"](3.0, 0.3), kinematics=kinematics, **options)
    builtin = SolidBody(points, cells, NeoHookean(young=3.0, poisson=0.3), **options)
    models = own.model(), builtin.model()
    rng = np.random.default_rng(2)
    stretch = np.eye(dim) + 0.4 * (rng.random((dim, dim)) - 0.5)
    for k in (1, 2, 3):
        share = k / 3
        angle = share * (0.2 if case == "quad round an axis" else 1.3)
        f = turn(dim, angle) @ (np.eye(dim) + share * (stretch - np.eye(dim)))
        u = moved(points, f) + 0.02 * (rng.random(points.shape) - 0.5)
        found = [b.tangent(u, m) for b, m in zip((own, builtin), models)]
        for i in range(2):
            size = np.abs(found[1][i]).max()
            assert np.allclose(found[0][i], found[1][i], rtol=0, atol=1e-10 * size), (k, i)
        assert found[0][2] == pytest.approx(found[1][2], rel=1e-10)
        stress = [m.stress()[0] for m in models]
        assert np.allclose(*stress, rtol=0, atol=1e-10 * np.abs(stress[1]).max())
        e = 1e-6 * (rng.random(points.size) - 0.5)
        ahead, behind = (own.tangent(u + s * e.reshape(u.shape), models[0])[0] for s in (1, -1))
        start, row = own.lower[:2]
        below = sparse.csc_array((found[0][1], row, start), (points.size, points.size))
        change = (ahead - behind) / 2
        assert np.allclose(change, (below + sparse.tril(below, -1).T) @ e, rtol=0, atol=1e-6 * np.abs(change).max())
        for b, m in zip((own, builtin), models):
            b.tangent(u, m)
            m.commit()


def test_newtons_method_takes_the_passes_of_the_built_in_law(routine):
    """A block that tumbles, stretched, onto a plane: the same motion, and the residual falls as fast."""
    rock = cn.Material("rock", density=1000.0)
    points, cells = box("quad", (3, 2), (1.0, 0.6))
    f = turn(2, 0.5) @ np.array([[1.3, 0.2], [0.0, 0.8]])
    ways, passes, errors = [], [], []
    for material in (routine["neo"](2e5, 0.3), NeoHookean(young=2e5, poisson=0.3)):
        body = SolidBody(points, cells, material, density=1000.0, kinematics="total_lagrangian")
        scene = cn.Scene(2, gravity=(0.0, -10.0))
        scene.add(cn.deformable(body, rock, contact=np.arange(len(points)), displacement=moved(points, f), velocity=(3.0, -4.0)))
        scene.add(cn.wall((0, 0), (0, 1), rock))
        scene.interact(rock, rock, cn.Coulomb(mu=0.3))
        sim = cn.Simulation(scene, dt=2e-3, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-12), newton_tol=1e-12))
        reports = [sim.step() for _ in range(60)]
        assert all(r["status"] == "converged" for r in reports)
        passes.append([r["newton_passes"] for r in reports])
        errors.append([r["newton_error"] for r in reports])
        ways.append(sim.meshes[0].position)
        assert sum(r["contacts"] for r in reports) > 20
    assert passes[0] == passes[1] and max(passes[0]) > 2
    assert np.allclose(*ways, rtol=0, atol=1e-10)


@pytest.mark.parametrize("dim, kind", [(2, "quad"), (3, "hexahedron")])
def test_a_quarter_of_a_turn_keeps_the_stress_of_the_material(routine, dim, kind):
    """In one step; what ROTSIG turns by DROT turns with it, the first step turns an initial stress."""
    points, cells = box(kind, (2,) * dim, (1.0,) * dim)
    given = (0.3, -0.2, 0.1, 0.15) if dim == 2 else (0.3, -0.2, 0.1, 0.15, 0.25, -0.05)
    initial = (0.02, -0.03, 0.01, 0.04, 0.0, 0.0) if dim == 2 else (0.02, -0.03, 0.01, 0.04, 0.03, -0.02)
    material = routine["hypo"](3.0, 0.3, *given, 0.0, 0.0)
    body = SolidBody(points, cells, material, kinematics="total_lagrangian", initial_stress=initial)
    quarter = turn(dim, np.pi / 2)
    full = np.eye(3)
    full[:dim, :dim] = quarter
    model = body.model()
    u = moved(points, quarter)
    body.tangent(u, model)
    model.commit()
    wanted = full @ by_parts(initial) @ full.T
    assert np.allclose(tensor(model.stress()[0][0]), wanted, rtol=0, atol=1e-15)
    assert np.allclose(by_parts(model.states()[0][0, KEPT : KEPT + 2 * dim]), full @ by_parts(given) @ full.T, rtol=0, atol=1e-14)
    # a stretch, and back by a quarter of a turn
    f = (np.eye(dim) + 0.1 * np.random.default_rng(5).random((dim, dim))) @ quarter
    body.tangent(moved(points, f), model)
    model.commit()
    before, states = tensor(model.stress()[0][0]), model.states()[0][0]
    force, _, energy, _ = body.tangent(moved(points, f), model)
    turned = body.tangent(moved(points, quarter.T @ f), model)
    model.commit()
    assert np.abs(before).max() > 0.1
    assert np.allclose(tensor(model.stress()[0][0]), full.T @ before @ full, rtol=0, atol=1e-14)
    assert np.allclose(turned[0].reshape(-1, dim), force.reshape(-1, dim) @ quarter, rtol=0, atol=1e-14)
    assert turned[2] == pytest.approx(energy, rel=1e-12)
    strains = [by_parts(np.append(s[6:9], 0.5 * s[9:12])) for s in (states, model.states()[0][0])]
    assert np.allclose(strains[1], full.T @ strains[0] @ full, rtol=0, atol=1e-14)


def test_increments_of_strain_lead_to_its_logarithm(routine):
    """Second-order convergence in the number of increments; held stretches, without rotation."""
    points, cells = box("quad", (1, 1), (1.0, 1.0))
    left = []
    for count in (4, 8):
        body = SolidBody(points, cells, routine["hypo"](3.0, 0.3, *[0.0] * 6), kinematics="total_lagrangian")
        model = body.model()
        for k in range(1, count + 1):
            body.tangent(moved(points, np.diag(np.exp(np.array([0.6, -0.3]) * k / count))), model)
            model.commit()
        left.append(model.states()[0][0, 6:8] - [0.6, -0.3])
    assert np.all(np.abs(left[0]) < 4e-3)
    assert np.allclose(left[0] / left[1], 4.0, rtol=0.02)


@pytest.mark.parametrize("at_once", [False, True])
@pytest.mark.parametrize("dim, kind", [(2, "quad"), (3, "hexahedron")])
def test_a_metal_of_increments_is_the_built_in_one_of_finite_strain(routine, dim, kind, at_once):
    """Perfect plasticity of a body that is drawn by a fifth and turned by a radian, in steps of their own or at once: then
    strains of a step are in axes of its middle, and the direction of the stress lags by half of its turn."""
    points, cells = box(kind, (1,) * dim, (1.0,) * dim)
    draw = np.array([0.2, -0.2]) if dim == 2 else np.array([0.2, -0.1, -0.1])
    stress, plastic = [], []
    for count in (20, 40):
        bodies = (
            SolidBody(points, cells, routine["umat"](3.0, 0.3, 0.05), kinematics="total_lagrangian"),
            SolidBody(points, cells, FiniteJ2(young=3.0, poisson=0.3, yield_stress=0.05)),
        )
        models = [b.model() for b in bodies]
        for k in range(1, count + 1):
            stretch = np.diag(np.exp(draw * k / count))
            for turned in [k] if at_once else [k - 1, k]:
                for b, m in zip(bodies, models):
                    b.tangent(moved(points, turn(dim, turned / count) @ stretch), m)
                    m.commit()
        own, other = (tensor(m.stress()[0][0]) for m in models)
        part = own - np.trace(own) / 3 * np.eye(3)
        assert np.sqrt(1.5) * np.linalg.norm(part) == pytest.approx(0.05, rel=1e-10)
        stress.append(np.abs(own - other).max() / 0.05)
        plastic.append(models[0].states()[0][0, -1] / models[1].states()[0][0, -1] - 1)
    assert abs(plastic[1]) < 2e-4 and plastic[0] / plastic[1] == pytest.approx(4.0, rel=0.02)
    assert stress[1] < (2e-2 if at_once else 1e-3)
    if at_once:
        assert stress[0] / stress[1] == pytest.approx(2.0, rel=0.05)


def states_of(sim):
    return core_of(sim).mesh_bulk(0)[0][1]


@pytest.mark.parametrize("kinematics", ["small", "total_lagrangian"])
@pytest.mark.parametrize("dim, kind", [(2, "quad"), (3, "hexahedron")])
def test_what_a_routine_is_told(routine, dim, kind, kinematics):
    """Means over the points of a cell of what the last of three steps told, of a body that flies and came in after one second."""
    rock, dt, speed = cn.Material("rock", density=1000.0), 1e-2, 2.0
    points, cells = box(kind, (2,) + (1,) * (dim - 1), (1.0,) * dim)
    initial = (7.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    scene = cn.Scene(dim, gravity=(0.0,) * dim)
    held = {"all": np.arange(len(points))}
    flies = np.zeros(dim)
    flies[0] = speed
    options = {"kinematics": kinematics, "groups": held, "initial_stress": initial}
    body = SolidBody(points, cells, routine["told"](1e6), density=1000.0, **options)
    scene.add(cn.deformable(body, rock, contact=[0], velocity=flies, rigid=["all"]))
    sim = cn.Simulation(scene, dt=dt)
    for _ in range(3):
        assert sim.step()["status"] == "converged"
    told = states_of(sim)[:, KEPT:]
    for cell in range(2):
        coords, time, of_step, (ndi, nshr, ntens, noel, npt, kstep, kinc), (celent, nlgeom, stran, stress), drot = np.split(
            told[cell], (3, 5, 6, 13, 17)
        )
        middle = points[cells[kind][cell]].mean(axis=0)
        middle[0] += 3 * dt * speed if kinematics != "small" else 0.0
        assert np.allclose(coords[:dim], middle, rtol=0, atol=1e-12) and not coords[dim:].any()
        assert np.allclose(time, 2 * dt, rtol=1e-12) and of_step == pytest.approx(dt)
        assert (ndi, nshr, ntens) == ((3, 1, 4) if dim == 2 else (3, 3, 6))
        assert noel == cell + 1 and npt == (1 + 2**dim) / 2 and kstep == 1 and kinc == 3
        assert celent == pytest.approx(0.5 ** (1 / dim)) and nlgeom == (kinematics != "small")
        assert stran == pytest.approx(0.0, abs=1e-15) and stress == pytest.approx(7.0, rel=1e-9)
        assert np.allclose(drot, [1.0, 0.0], atol=1e-15)


def test_a_routine_that_takes_the_plane_for_space_is_told_of(routine):
    points, cells = box("quad", (1, 1), (1.0, 1.0))
    for kinematics in ("small", "total_lagrangian"):
        with pytest.raises(ValueError, match=r"quad cell 0 with nodes .*large_six writes beyond the NTENS = 4 .* give a routine"):
            SolidBody(points, cells, routine["six"](), kinematics=kinematics)
    points, cells = box("hexahedron", (1, 1, 1), (1.0, 1.0, 1.0))
    SolidBody(points, cells, routine["six"](), kinematics="total_lagrangian")


def thrown(material, speed=6.0):
    """A block that is thrown askew at a plane."""
    rock = cn.Material("rock", density=2500.0)
    points, cells = box("quad", (3, 3), (1.0, 1.0))
    points[:, 1] += 0.01
    body = SolidBody(points, cells, material, density=1000.0, kinematics="total_lagrangian", mean_dilatation=True)
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    scene.add(cn.deformable(body, rock, contact=np.arange(len(points)), velocity=(2.0, -speed), name="block"))
    scene.add(cn.wall((0, 0), (0, 1), rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-10)))


@pytest.mark.parametrize("name, props", [("umat", (2e6, 0.3, 3e4)), ("neo", (2e6, 0.3))])
def test_a_restart_goes_on_to_the_same_bits(routine, name, props, tmp_path):
    sims = thrown(routine[name](*props)), thrown(routine[name](*props))
    for k in range(40):
        assert sims[0].step()["status"] == "converged"
        if k == 19:
            sims[0].checkpoint(tmp_path / "half.h5")
    sims[1].restore(tmp_path / "half.h5")
    for _ in range(20):
        sims[1].step()
    assert np.array_equal(states_of(sims[0]), states_of(sims[1])) and states_of(sims[0])[:, 25].min() == 40
    for what in ("position", "velocity"):
        assert np.array_equal(*(getattr(s.meshes[0], what) for s in sims))
    assert sims[0].info["energy"] == sims[1].info["energy"]
    if name == "umat":
        assert sims[0].info["energy"]["dissipated_material"] > 0.1 * 0.5 * 1000.0 * 40.0


def test_a_stress_that_is_no_number_leaves_the_state_before_the_step(routine):
    """The stress fails where a strain passes a limit; cell and body are named, and a slower throw from the same state goes on."""
    sim = thrown(routine["told"](2e6, 0.0025))

    def state():
        return [
            np.array(a, copy=True)
            for a in (sim.meshes[0].position, sim.meshes[0].velocity, states_of(sim), *core_of(sim).mesh_memory(0), sim.time,
                      sim.steps, sim.contacts.impulse, sim.contacts.gap, sim.meshes[0].stress["quad"])
        ]  # fmt: skip

    for _ in range(100):
        before, energy = state(), dict(sim.info["energy"]) if sim.steps else None
        try:
            sim.step()
        except ValueError as error:
            said = str(error)
            break
    else:
        pytest.fail("the strain never passed the limit")
    for word in ("mesh 'block'", "quad cell", "with nodes", "large_told finds no finite stress"):
        assert word in said
    after = state()
    assert len(sim.contacts.gap) > 0 and sim.steps > 3
    assert all(np.array_equal(a, b) for a, b in zip(before, after))
    assert dict(sim.info["energy"]) == energy
    sim.nodes.set(position=sim.nodes.position, velocity=0 * sim.nodes.velocity)
    assert sim.step(1e-5)["status"] == "converged"
