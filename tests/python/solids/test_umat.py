"""A routine of Abaqus's interface as a material: stresses and states of built-in ones; utilities that it calls; failures."""

import shutil
import subprocess
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn import IsotropicElastic, J2Plasticity, SolidBody, plugs
from cell_blocks import dropped
from second_order import box

COMPILER = shutil.which("gfortran")
pytestmark = pytest.mark.skipif(COMPILER is None, reason="needs gfortran")


@pytest.fixture(scope="module")
def umat(tmp_path_factory):
    library = tmp_path_factory.mktemp("umat") / "libumat.so"
    source = Path(__file__).with_name("umat.f90")
    command = [COMPILER, "-shared", "-fPIC", "-O1", "-ffree-line-length-132", "-o", str(library), str(source)]
    subprocess.run(command, check=True, cwd=library.parent)
    return cn.plug(library, material="two_in_one", state=1, routine="umat")


@pytest.mark.parametrize("dim, kind", [(2, "quad"), (3, "hexahedron")])
def test_it_is_the_material_of_the_list(umat, dim, kind):
    points, cells = box(kind, (2,) * dim, (1.0,) * dim)
    for own, builtin in (
        (umat(3.0, 0.3, 0.0), IsotropicElastic(young=3.0, poisson=0.3)),
        (umat(3.0, 0.3, 0.05), J2Plasticity(young=3.0, poisson=0.3, yield_stress=0.05)),
    ):
        bodies = [SolidBody(points, cells, m) for m in (own, builtin)]
        models = [b.model() for b in bodies]
        rng = np.random.default_rng(4)
        step = 0.03 * (rng.random(points.size) - 0.5)
        for k in (1, 2, -1):  # there, on, and back
            found = [b.tangent(k * step, m) for b, m in zip(bodies, models)]
            for m in models:
                m.commit()
            assert np.allclose(found[0][0], found[1][0], rtol=0, atol=1e-12 * np.abs(found[1][0]).max())
            assert np.allclose(found[0][1], found[1][1], rtol=0, atol=1e-11 * np.abs(found[1][1]).max())
            if builtin.name == "isotropic_elastic":
                assert found[0][2] == pytest.approx(found[1][2], rel=1e-9)
        if builtin.name == "j2_plasticity":
            assert np.allclose(models[0].states()[0][:, -1], models[1].states()[0][:, -1], atol=1e-14)
            assert models[0].states()[0][:, -1].max() > 1e-3


def test_what_a_routine_does_not_tell_of_its_energy_is_no_dissipation(umat, tmp_path):
    """The same law without SSE: work of its stresses counts as absorbed, and the integrator's dissipation is that of inertia
    alone."""
    text = Path(__file__).with_name("umat.f90").read_text()
    line = next(line for line in text.splitlines() if line.strip().startswith("sse = sse"))
    (tmp_path / "silent.f90").write_text(text.replace(line, ""))
    command = [COMPILER, "-shared", "-fPIC", "-O1", "-ffree-line-length-132", "-o", "libsilent.so", "silent.f90"]
    subprocess.run(command, check=True, cwd=tmp_path)
    silent = cn.plug(tmp_path / "libsilent.so", material="silent", state=1, routine="umat")
    told = {}
    for integrator in (cn.Theta(theta=0.6), cn.HHT(alpha=-0.1)):
        for name, material in (("told", umat(2e5, 0.3, 0.0)), ("silent", silent(2e5, 0.3, 0.0))):
            strategy = cn.NSCD(integrator=integrator, solver=cn.NLGS(tol=1e-13, max_iter=10**5), newton_tol=1e-13)
            sim = dropped(2, material, kinematics="small", speed=1.0, strategy=strategy)
            for k in range(120):
                assert sim.step()["status"] == "converged"
                if k == 60:
                    sim.checkpoint(tmp_path / f"{name}.checkpoint.h5")
            told[name] = terms = sim.info["energy"]
            again = dropped(2, material, kinematics="small", speed=1.0, strategy=strategy)
            again.restore(tmp_path / f"{name}.checkpoint.h5")
            for _ in range(59):
                again.step()
            assert again.info["energy"] == terms
            assert abs(terms["closure"]) < 1e-11 * terms["in_play"] and terms["dissipated_normal"] > 0
        one, other = told["told"], told["silent"]
        assert one["kinetic"] == other["kinetic"] and one["absorbed"] == 0
        assert other["stored"] == 0 and one["stored"] > 1e-4 * one["in_play"]
        split = one["stored"] + one["dissipated_integrator"] - other["dissipated_integrator"]
        assert abs(other["absorbed"] - split) < 1e-12 * one["in_play"] and other["absorbed"] > 1e-4 * one["in_play"]
        assert other["dissipated_integrator"] != one["dissipated_integrator"]


def test_xit_and_nan_name_the_cell(umat):
    points, cells = box("quad", (3, 1), (3.0, 1.0))
    body = SolidBody(points, cells, umat(3.0, 0.3, 0.0))
    u = np.zeros_like(points)
    u[points[:, 0] > 2.5, 0] = 0.7
    with pytest.raises(ValueError, match="quad cell 2 with nodes .*two_in_one calls XIT"):
        body.tangent(u)
    u[:] = np.nan
    with pytest.raises(ValueError, match="quad cell 0"):
        body.tangent(u)


def test_a_step_that_the_routine_ends_is_told_with_what_helps(umat):
    """The routine calls XIT above a strain of a half; cutting the step back does not help."""
    points, cells = box("quad", (1, 1), (1.0, 1.0))
    groups = {"left": points[:, 0] < 0.5, "right": points[:, 0] > 0.5}
    body = SolidBody(points, cells, umat(3.0, 0.3, 0.0), density=1.0, groups=groups)
    for cut_back in (0, 2):
        scene, skin = cn.Scene(2), cn.Material("skin", density=1.0)
        scene.add(cn.deformable(body, skin, fixed={"left": "xy"}, displace={"right": {"x": lambda t: t}}, contact=[0]))
        scene.interact(skin, skin, None)
        sim = cn.Simulation(scene, 0.1, cn.NSCD(theta=1.0, cut_back=cut_back))
        with pytest.raises(ValueError, match=r"two_in_one calls XIT in step \d: look at what it prints, or give a smaller dt"):
            for _ in range(10):
                sim.step()
        assert 3 <= sim.steps <= 6


def test_props_that_are_no_numbers_are_refused(umat):
    for wrong in (np.nan, np.inf, "3"):
        with pytest.raises(ValueError, match=r"PROPS\(2\) of two_in_one is .*: give a finite number"):
            umat(3.0, wrong, 0.0)


def test_what_is_missing_is_told(umat, tmp_path):
    with pytest.raises(ValueError, match="there is no such file"):
        cn.plug(tmp_path / "none.so", material="none")
    with pytest.raises(ValueError, match="has no routine other"):
        source = Path(__file__).with_name("umat.f90")
        library = tmp_path / "again.so"
        subprocess.run([COMPILER, "-shared", "-fPIC", "-o", str(library), str(source)], check=True, cwd=tmp_path)
        cn.plug(library, material="again", routine="other")


@pytest.mark.parametrize("kinematics", ["small", "logarithmic"])
def test_it_gets_the_initial_stress_at_its_first_call(umat, kinematics):
    """11 22 33 12 13 23 with nothing strained yet; yield is that of the built-in law, at its remaining strength."""
    points, cells = box("hexahedron", (1, 1, 1), (1.0, 1.0, 1.0))
    given = (0.01, -0.006, 0.004, 0.008, -0.003, 0.005)
    shown = np.array(given)[[0, 1, 2, 3, 5, 4]]
    for limit in (0.0, 0.05):
        body = SolidBody(points, cells, umat(3.0, 0.3, limit), kinematics=kinematics, initial_stress=given)
        model = body.model()
        assert np.allclose(model.stress()[0], shown, rtol=0, atol=1e-17)
        assert np.allclose(body.stress(0 * points, model)["hexahedron"], shown, rtol=0, atol=1e-16)
    own = umat(3.0, 0.3, 0.05)
    other = J2Plasticity(young=3.0, poisson=0.3, yield_stress=0.05)
    pull = 0.02 * np.random.default_rng(0).random(points.shape) * points[:, :1]
    found = []
    for material in (own, other):
        body = SolidBody(points, cells, material, kinematics="small", initial_stress=given)
        model = body.model()
        found.append(body.stress(pull, model)["hexahedron"])
        model.commit()
        assert model.states()[0][0, -1] > 0
    assert np.allclose(*found, rtol=0, atol=1e-12)


def test_a_body_stays_rigid_where_the_material_of_its_mesh_has_no_stress(tmp_path):
    """A routine that knows no large rotations: the body that has turned is still there, with its contacts."""
    (tmp_path / "upright.f90").write_text("""
subroutine umat(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, stran, dstran, time, dtime, temp, dtemp, &
  predef, dpred, cmname, ndi, nshr, ntens, nstatv, props, nprops, coords, drot, pnewdt, celent, dfgrd0, dfgrd1)
  implicit none
  integer :: ndi, nshr, ntens, nstatv, nprops, k
  real(8) :: stress(ntens), statev(*), ddsdde(ntens, ntens), sse, spd, scd, rpl, ddsddt(*), drplde(*), drpldt, stran(*)
  real(8) :: dstran(ntens), time(2), dtime, temp, dtemp, predef(*), dpred(*), props(*), coords(3), drot(3, 3), pnewdt, celent
  real(8) :: dfgrd0(3, 3), dfgrd1(3, 3)
  character(80) :: cmname
  ddsdde = 0
  do k = 1, ntens
    ddsdde(k, k) = 1d7
    stress(k) = stress(k) + 1d7*dstran(k)
  end do
  if (abs(dfgrd1(2, 1)) > 0.1d0) pnewdt = 0.5d0
end subroutine""")
    library = tmp_path / "libupright.so"
    command = [COMPILER, "-shared", "-fPIC", "-w", "-ffree-line-length-132", "-o", str(library), "upright.f90"]
    subprocess.run(command, check=True, cwd=tmp_path)
    square, rock = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]], cn.Material("rock", density=1000.0)
    scene = cn.Scene(2)
    scene.add(cn.polygons([square], rock, position=[[3, 2]], velocity=[[0, 0, 5]]))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-2)
    for _ in range(20):
        sim.step()
    material = cn.plug(library, material="upright", state=0, routine="umat")()
    body = SolidBody(square, {"quad": [[0, 1, 2, 3]]}, material, density=900.0, kinematics="logarithmic")
    with pytest.raises(ValueError, match="quad cell 0 .*upright asks for a smaller step, PNEWDT < 1"):
        sim.deform(0, body)
    assert sim.bodies.id.tolist() == [0] and not len(sim.nodes.id)
    sim.step()


@pytest.mark.parametrize("name", ["ABA_PARAM.INC", "aba_param.inc"])
def test_what_routines_include_is_shipped(tmp_path, name):
    """A routine that declares nothing itself, in fixed form as most are written: forces are those of Hooke's law."""
    source = f"""
      SUBROUTINE UMAT(STRESS,STATEV,DDSDDE,SSE,SPD,SCD,RPL,DDSDDT,
     1 DRPLDE,DRPLDT,STRAN,DSTRAN,TIME,DTIME,TEMP,DTEMP,PREDEF,DPRED,
     2 CMNAME,NDI,NSHR,NTENS,NSTATV,PROPS,NPROPS,COORDS,DROT,PNEWDT,
     3 CELENT,DFGRD0,DFGRD1,NOEL,NPT,LAYER,KSPT,KSTEP,KINC)
      INCLUDE '{name}'
      CHARACTER*80 CMNAME
      DIMENSION STRESS(NTENS),STATEV(NSTATV),DDSDDE(NTENS,NTENS),
     1 DSTRAN(NTENS),PROPS(NPROPS)
      E = PROPS(1)/(1 + PROPS(2))
      G = E*PROPS(2)/(1 - 2*PROPS(2))
      DO I = 1, NTENS
        DO J = 1, NTENS
          DDSDDE(I,J) = 0
          IF (I.LE.NDI .AND. J.LE.NDI) DDSDDE(I,J) = G
        END DO
        DDSDDE(I,I) = DDSDDE(I,I) + E/2
        IF (I.LE.NDI) DDSDDE(I,I) = DDSDDE(I,I) + E/2
      END DO
      DO I = 1, NTENS
        DO J = 1, NTENS
          STRESS(I) = STRESS(I) + DDSDDE(I,J)*DSTRAN(J)
        END DO
      END DO
      END
"""
    free = f"subroutine free(x)\ninclude '{name}'\nx = 1 ! real by its first letter\nend\n"
    (tmp_path / "own.f").write_text(source)
    (tmp_path / "free.f90").write_text(free)
    command = [COMPILER, "-shared", "-fPIC", "-I", plugs.INCLUDE, "-o", "libown.so", "own.f", "free.f90"]
    subprocess.run(command, check=True, cwd=tmp_path)
    routine = cn.plug(tmp_path / "libown.so", material=f"own {name}", routine="umat")
    points, cells = box("quad", (1, 1), (1.0, 1.0))
    bodies = [SolidBody(points, cells, m) for m in (routine(3.0, 0.3), IsotropicElastic(young=3.0, poisson=0.3))]
    moved = 1e-3 * np.random.default_rng(4).random(points.size)
    found = [body.tangent(moved, body.model()) for body in bodies]
    for own, builtin in zip(found[0][:2], found[1][:2]):
        assert np.allclose(own, builtin, rtol=0, atol=1e-11 * np.abs(builtin).max()) and np.abs(builtin).max() > 1e-4
