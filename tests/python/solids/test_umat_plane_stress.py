"""Routines of Abaqus's interface that are written for elements of plane stress: stresses and states of Cairn's own materials in
plane stress, their arguments, refusals."""

import shutil
import subprocess
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn import IsotropicElastic, J2Plasticity, Ogden, SolidBody
from scipy import sparse
from second_order import box

COMPILER = shutil.which("gfortran")
pytestmark = pytest.mark.skipif(COMPILER is None, reason="needs gfortran")
STATES = {"hooke": 0, "metal": 2, "rubber": 0, "told": 14, "four": 0}
KEPT = 26  # numbers of a state before those of the routine


@pytest.fixture(scope="module")
def routine(tmp_path_factory):
    library = tmp_path_factory.mktemp("umat") / "libflat.so"
    source = Path(__file__).with_name("plane_stress_umats.f90")
    command = [COMPILER, "-shared", "-fPIC", "-O1", "-w", "-ffree-line-length-132", "-o", str(library), str(source)]
    subprocess.run(command, check=True, cwd=library.parent)
    return {n: cn.plug(library, material=f"flat_{n}", state=k, routine=n, plane="stress") for n, k in STATES.items()}


def turn(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def moved(points, f):
    return points @ (f - np.eye(2)).T


def close(one, other, tolerance):
    assert np.allclose(one, other, rtol=0, atol=tolerance * np.abs(other).max())


def of_force_differences(body, model, u, tangent):
    """The tangent against central differences of the forces, along a way of all nodes."""
    e = 1e-6 * (np.random.default_rng(9).random(u.shape) - 0.5)
    change = (body.tangent(u + e, model)[0] - body.tangent(u - e, model)[0]) / 2
    start, row = body.lower[:2]
    below = sparse.csc_array((tangent, row, start), (u.size, u.size))
    close(change, (below + sparse.tril(below, -1).T) @ e.ravel(), 1e-6)


@pytest.mark.parametrize("kind", ["quad", "triangle6"])
@pytest.mark.parametrize("name", ["hooke", "metal"])
def test_it_is_the_material_of_the_list_in_plane_stress(routine, name, kind):
    points, cells = box(kind, (2, 2), (1.0, 1.0))
    if name == "hooke":
        materials = routine["hooke"](3.0, 0.3), IsotropicElastic(young=3.0, poisson=0.3)
    else:
        materials = routine["metal"](3.0, 0.3, 0.05, 0.4), J2Plasticity(young=3.0, poisson=0.3, yield_stress=0.05, isotropic=0.4)
    bodies = [SolidBody(points, cells, m, plane="stress", thickness=0.1, kinematics="small") for m in materials]
    models = [b.model() for b in bodies]
    step = 0.06 * (np.random.default_rng(4).random(points.shape) - 0.5)
    spent = np.zeros(2)
    for share in (1, 2, 0.5, -1.5):  # on, back and beyond
        found = [b.tangent(share * step, m) for b, m in zip(bodies, models)]
        close(found[0][0], found[1][0], 1e-10)
        close(found[0][1], found[1][1], 1e-9)
        close(models[0].stress()[0], models[1].stress()[0], 1e-10)
        assert np.all(models[0].stress()[0][:, [2, 4, 5]] == 0)
        assert found[0][2] == pytest.approx(found[1][2], rel=1e-9)
        spent += [f[3] for f in found]
        for m in models:
            m.commit()
    if name == "metal":
        plastic, own = (m.states()[0] for m in models)
        close(plastic[:, KEPT], own[:, -1], 1e-10)
        close(plastic[:, KEPT + 1], own[:, 2], 1e-9)  # across the thickness
        assert own[:, -1].min() > 1e-2
        assert spent[0] == pytest.approx(spent[1], rel=1e-10) and spent[0] > 0


def test_a_scene_of_it_is_that_of_the_material_of_the_list(routine):
    """A strip of metal thrown at a wall, Newton's method round the contact."""
    rock = cn.Material("rock", density=1000.0)
    points, cells = box("quad", (4, 3), (0.4, 0.3))
    points[:, 1] += 1e-3
    ways = []
    for material in (
        routine["metal"](2e6, 0.3, 1e4, 1e5),
        J2Plasticity(young=2e6, poisson=0.3, yield_stress=1e4, isotropic=1e5),
    ):
        body = SolidBody(points, cells, material, density=1000.0, plane="stress", kinematics="small")
        scene = cn.Scene(2, gravity=(0.0, -10.0))
        scene.add(cn.deformable(body, rock, contact=np.arange(len(points)), velocity=(0.5, -3.0)))
        scene.add(cn.wall((0, 0), (0, 1), rock))
        scene.interact(rock, rock, cn.Coulomb(mu=0.3))
        sim = cn.Simulation(scene, dt=2e-4, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-12), newton_tol=1e-12))
        for _ in range(60):
            assert sim.step()["status"] == "converged"
        energy = sim.info["energy"]
        assert energy["dissipated_material"] > 0.05 * 0.5 * 1000.0 * 0.12 * 9.0
        ways.append((sim.meshes[0].position, energy["dissipated_material"]))
    assert np.allclose(ways[0][0], ways[1][0], rtol=0, atol=1e-8)
    assert ways[0][1] == pytest.approx(ways[1][1], rel=1e-7)


def test_rubber_of_large_strains_is_the_limit_of_rubber_that_keeps_its_volume(routine):
    """Drawn, sheared and turned: the difference falls by ten as the bulk modulus of Ogden's law grows by ten."""
    points, cells = box("quad", (2, 2), (1.0, 1.0))
    own = SolidBody(points, cells, routine["rubber"](1.3), plane="stress", kinematics="total_lagrangian")
    f = turn(0.9) @ np.array([[1.4, 0.3], [-0.1, 0.8]])
    u = moved(points, f) + 0.02 * (np.random.default_rng(3).random(points.shape) - 0.5)
    model = own.model()
    force, tangent, energy, _ = own.tangent(u, model)
    of_force_differences(own, model, u, tangent)
    own.tangent(u, model)
    stress = model.stress()[0]
    left = []
    for bulk in (1e4, 1e5):
        builtin = SolidBody(points, cells, Ogden(bulk=bulk, shear1=1.3, power1=2.0), plane="stress")
        other = builtin.model()
        found = builtin.tangent(u, other)
        of_stress = np.abs(stress - other.stress()[0]).max() / np.abs(stress).max()
        left.append([np.abs(force - found[0]).max() / np.abs(force).max(), of_stress, abs(energy / found[2] - 1)])
    assert np.all(np.array(left[1]) < 1e-4)
    assert np.allclose(np.array(left[0]) / left[1], 10.0, rtol=0.02)


def test_a_law_of_increments_turns_with_the_body(routine):
    """A quarter of a turn in one step, from an initial stress."""
    points, cells = box("quad", (2, 1), (1.0, 0.5))
    initial = (0.02, -0.03, 0.0, 0.04, 0.0, 0.0)
    material = routine["hooke"](3.0, 0.3)
    body = SolidBody(points, cells, material, plane="stress", kinematics="logarithmic", initial_stress=initial)
    model = body.model()
    body.tangent(moved(points, turn(np.pi / 2)), model)
    model.commit()
    assert np.allclose(model.stress()[0], [-0.03, 0.02, 0.0, -0.04, 0.0, 0.0], rtol=0, atol=1e-15)


@pytest.mark.parametrize("kinematics", ["small", "total_lagrangian"])
def test_what_it_is_told(routine, kinematics):
    points, cells = box("quad", (1, 1), (1.0, 1.0))
    initial = (7.0, 5.0, 0.0, 3.0, 0.0, 0.0)
    body = SolidBody(points, cells, routine["told"](1e3), plane="stress", kinematics=kinematics, initial_stress=initial)
    model = body.model()
    f = [np.array([[1.2, 0.1], [0.0, 0.9]]), np.array([[1.1, -0.2], [0.3, 1.3]])]
    strains = []
    for k, now in enumerate(f):
        body.tangent(moved(points, now), model)
        model.commit()
        counts, before, across, stress, strain, change = np.split(model.states()[0][0, KEPT:], (3, 4, 5, 8, 11))
        assert counts.tolist() == [2, 1, 3]
        assert across == pytest.approx(1 / np.linalg.det(now), rel=1e-14)  # the volume stays
        assert before == pytest.approx(1 / np.linalg.det(f[0]) if k else 1.0, rel=1e-14)
        if k == 0:
            assert np.allclose(strain, 0, atol=1e-16)
            assert kinematics != "small" or stress.tolist() == [7.0, 5.0, 3.0]
        strains.append((strain, change))
    if kinematics == "small":
        g = [m - np.eye(2) for m in f]
        voigt = [np.array([h[0, 0], h[1, 1], h[0, 1] + h[1, 0]]) for h in g]
        assert np.allclose(strains[1][0], voigt[0], atol=1e-15) and np.allclose(strains[1][1], voigt[1] - voigt[0], atol=1e-15)
    else:
        rate = 2 * (f[1] - f[0]) @ np.linalg.inv(f[0] + f[1])
        wanted = [rate[0, 0], rate[1, 1], rate[0, 1] + rate[1, 0]]
        assert np.allclose(strains[1][1], wanted, rtol=0, atol=1e-15)


def test_a_restart_goes_on_to_the_same_bits(routine, tmp_path):
    def thrown():
        rock = cn.Material("rock", density=2500.0)
        points, cells = box("quad", (3, 3), (1.0, 1.0))
        points[:, 1] += 0.01
        material = routine["metal"](2e6, 0.3, 3e4, 1e5)
        body = SolidBody(points, cells, material, density=1000.0, plane="stress", kinematics="total_lagrangian")
        scene = cn.Scene(2, gravity=(0.0, -10.0))
        scene.add(cn.deformable(body, rock, contact=np.arange(len(points)), velocity=(2.0, -6.0)))
        scene.add(cn.wall((0, 0), (0, 1), rock))
        scene.interact(rock, rock, cn.Coulomb(mu=0.3))
        return cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-10)))

    sims = thrown(), thrown()
    for k in range(40):
        assert sims[0].step()["status"] == "converged"
        if k == 19:
            sims[0].checkpoint(tmp_path / "half.h5")
    sims[1].restore(tmp_path / "half.h5")
    for _ in range(20):
        sims[1].step()
    for what in ("position", "velocity"):
        assert np.array_equal(*(getattr(s.meshes[0], what) for s in sims))
    states = [s.meshes[0].material_state["quad"] for s in sims]
    assert all(np.array_equal(states[0][name], states[1][name]) for name in states[0])
    assert sims[0].info["energy"] == sims[1].info["energy"] and sims[0].info["energy"]["dissipated_material"] > 100.0


def test_what_does_not_fit_is_refused_with_the_remedy(routine, tmp_path):
    points, cells = box("quad", (1, 1), (1.0, 1.0))
    flat = routine["hooke"](3.0, 0.3)
    for plane in ("strain", "axisymmetric"):
        with pytest.raises(ValueError, match=r"flat_hooke is a routine for plane stress, NDI = 2: give plane='stress' to"):
            SolidBody(points + [4.0, 0.0], cells, flat, plane=plane)
    solid_points, solid = box("hexahedron", (1, 1, 1), (1.0, 1.0, 1.0))
    with pytest.raises(ValueError, match="for plane stress"):
        SolidBody(solid_points, solid, flat)
    for kinematics in ("small", "total_lagrangian"):
        with pytest.raises(ValueError, match=r"flat_four writes beyond the NTENS = 3 stresses of plane stress, 11 22 12: give"):
            SolidBody(points, cells, routine["four"](), plane="stress", kinematics=kinematics)
    library = tmp_path / "libflat.so"
    with pytest.raises(ValueError, match="no such file"):
        cn.plug(library, material="m", plane="stress")
    library.write_bytes(b"")
    with pytest.raises(ValueError, match=r"plane is 'strain': give 'stress' with material="):
        cn.plug(library, material="m", plane="strain")
    with pytest.raises(ValueError, match=r"plane is 'stress': give 'stress' with material="):
        cn.plug(library, law="m", plane="stress")
