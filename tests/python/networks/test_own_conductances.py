"""Conductances of contacts of one's own, in C and Fortran."""

import shutil
import subprocess

import cairn as cn
import numpy as np
import pytest

N = cn.networks
R = 1e-3
STEEL = cn.Material("steel", density=7800.0, young=210e9, poisson=0.3, resistivity=1 / 5.9e6, conductivity=50.0, capacity=460.0)
HELD = ("vx", "vy", "vz", "wx", "wy", "wz")


def two(**electrical):
    scene = cn.Scene(3)
    scene.add(cn.spheres([[0, 0, 0]], R, STEEL, group="floor").with_(driven=HELD))
    scene.add(cn.spheres([[0, 0, 2 * R]], R, STEEL, group="lid", force=(0, 0, -1.0)))
    scene.interact("*", "*", cn.Coulomb(mu=0.0))
    scene.electrical(current={"lid": 0.1, "floor": -0.1}, **electrical)
    return cn.Simulation(scene, 1e-6, cn.NSCD(solver=cn.NLGS(tol=1e-13, max_iter=20000)))


# ---------------------------------------------------------------------- conductances of one's own

C_HOLM = """
#include <math.h>
#include <stdint.h>
enum { gap, force, radius, modulus, conductivity_a, conductivity_b };
void own_holm(int32_t n, const double* contact, int32_t parameters, const double* params, double* conductance) {
  for (int32_t i = 0; i < n; ++i) {
    const double* c = contact + i;
    const double k = 2 / (1 / c[conductivity_a * n] + 1 / c[conductivity_b * n]);
    const double a = c[force * n] > 0 ? cbrt(0.75 * c[force * n] * c[radius * n] / c[modulus * n]) : 0;
    conductance[i] = (parameters > 0 ? params[0] : 1) * 2 * k * a;
  }
}
"""
F_HOLM = """
subroutine own_holm(n, contact, parameters, params, conductance) bind(c)
  use, intrinsic :: iso_c_binding
  integer(c_int32_t), value   :: n, parameters
  real(c_double), intent(in)  :: contact(n, *), params(parameters)
  real(c_double), intent(out) :: conductance(n)
  conductance = params(1)*4/(1/contact(:, 5) + 1/contact(:, 6)) &
                *(0.75d0*max(contact(:, 2), 0d0)*contact(:, 3)/contact(:, 4))**(1/3d0)
end subroutine
"""


def built(folder, language):
    compiler = shutil.which("gcc" if language == "c" else "gfortran")
    if not compiler:
        pytest.skip(f"no compiler of {language}")
    source = folder / f"own.{'c' if language == 'c' else 'f90'}"
    source.write_text(C_HOLM if language == "c" else F_HOLM)
    out = folder / "libown.so"
    subprocess.run([compiler, "-O2", "-shared", "-fPIC", str(source), "-o", str(out), "-lm"], check=True)
    return out


@pytest.mark.parametrize("language", ["c", "fortran"])
def test_a_conductance_of_ones_own_is_as_one_of_the_list(language, tmp_path):
    library = built(tmp_path, language)
    reads = ("conductivity", "modulus", "radius")
    own, doubled = (N.plug(library, "own_holm", [factor], reads) for factor in (1.0, 2.0))
    ohms = []
    for kernel in (N.Holm(), own, doubled, [own, own]):
        sim = two(conductance=kernel)
        sim.step()
        assert sim.info["electrical"]["status"] == "converged"
        ohms.append(np.diff(sim.bodies.potential)[0] / 0.1)
    assert ohms == pytest.approx([ohms[0], ohms[0], ohms[0] / 2, ohms[0] / 2], rel=1e-13)


def test_what_a_plugged_conductance_needs_is_asked_for(tmp_path):
    library = built(tmp_path, "c")
    with pytest.raises(ValueError, match="no such file"):
        N.plug(tmp_path / "none.so", "own_holm")
    with pytest.raises(ValueError, match="exports nothing"):
        N.plug(library, "nothing")
    with pytest.raises(ValueError, match="reads names 'colour'"):
        N.plug(library, "own_holm", [1.0], ["colour"])
    # a contact of two planes' worth has no radius, which is told for kernels of one's own too
    scene = cn.Scene(3)
    cube = cn.boxes([[0, 0, 0.5]], [1.0, 1.0, 1.0], STEEL, group="cube", force=(0, 0, -1.0))
    scene.add(cube, cn.wall((0, 0, 0), (0, 0, 1), STEEL, group="floor"))
    scene.interact("*", "*", cn.Coulomb(mu=0.0))
    scene.electrical(current={"cube": 0.1, "floor": -0.1}, conductance=N.plug(library, "own_holm", [1.0], ["radius"]))
    with pytest.warns(N.NetworkWarning):
        sim = cn.Simulation(scene, 1e-3)
        sim.step()
    assert sim.info["electrical"]["unfit"] > 0
