"""The neo-Hookean law at strains of any size, against its formula in 260 digits: its own strain rounds it, not 1."""

from decimal import Decimal, getcontext

import cairn as cn
import numpy as np
import pytest
from bulk_points import found, params
from scipy.spatial.transform import Rotation
from second_order import box

YOUNG, POISSON = params("neo_hookean")


def exact(gradient):
    """Stress mu (F - F^-T) + lambda ln J F^-T and energy of a gradient of displacement, in decimals."""
    getcontext().prec = 260
    young, poisson = Decimal(YOUNG), Decimal(POISSON)
    mu, lame = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    f = [[Decimal(float(gradient[i, j])) + (i == j) for j in range(3)] for i in range(3)]
    cofactor = [
        [f[(i + 1) % 3][(j + 1) % 3] * f[(i + 2) % 3][(j + 2) % 3] - f[(i + 1) % 3][(j + 2) % 3] * f[(i + 2) % 3][(j + 1) % 3]
         for j in range(3)] for i in range(3)
    ]  # fmt: skip
    volume = sum(f[0][j] * cofactor[0][j] for j in range(3))
    log = volume.ln()
    back = [[c / volume for c in row] for row in cofactor]
    stress = [[mu * (f[i][j] - back[i][j]) + lame * log * back[i][j] for j in range(3)] for i in range(3)]
    first = sum(f[i][j] ** 2 for i in range(3) for j in range(3))
    return np.array(stress, float), float(mu / 2 * (first - 3 - 2 * log) + lame / 2 * log**2)


@pytest.mark.parametrize("size", [1e-100, 1e-18, 1e-12, 1e-8, 1e-4, 2.9e-3, 3.1e-3, 0.02, 0.5])
def test_stress_and_energy_of_strains_of_any_size(size):
    ways = size * (np.random.default_rng(3).random((20, 3, 3)) - 0.5)
    ways[0] = size * np.diag([0.4, 0.4, 0.4])
    ways[1] = size * np.diag([0.5, -0.25, -0.25])  # no change of volume, to first order
    got = found("neo_hookean", ways)
    assert not got["status"].any()
    for k, way in enumerate(ways):
        stress, energy = exact(way)
        here = np.swapaxes(got["stress"][k].reshape(3, 3), 0, 1)
        assert np.abs(here - stress).max() < 1e-14 * np.abs(stress).max() + 1e-15 * size
        assert got["energy"][k] == pytest.approx(energy, rel=1e-12, abs=0)


def exact_ogden(gradient):
    """Energy of the gradient of a displacement by Ogden's law, by decimals: powers of 2, -2 and 4 need no eigenvalues."""
    getcontext().prec = 120
    f = [[Decimal(float(gradient[i, j])) + (i == j) for j in range(3)] for i in range(3)]
    c = [[sum(f[k][i] * f[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    first = sum(c[i][i] for i in range(3))
    square = sum(c[i][j] * c[j][i] for i in range(3) for j in range(3))
    second = (first**2 - square) / 2
    volume = sum(f[0][i] * (f[1][(i + 1) % 3] * f[2][(i + 2) % 3] - f[1][(i + 2) % 3] * f[2][(i + 1) % 3]) for i in range(3))
    shrink = (volume.ln() * Decimal(-2) / 3).exp()  # of squares of stretches
    bulk, *terms = (Decimal(float(x)) for x in OGDEN)
    powers = shrink * first, second * shrink**2, shrink**2 * square
    shares = zip(terms[::2], terms[1::2], powers)
    return float(bulk / 2 * (volume - 1) ** 2 + sum(shear / power * (of - 3) for shear, power, of in shares))


OGDEN = 4.0, 1.2, 2.0, -0.4, -2.0, 0.1, 4.0


@pytest.mark.parametrize("size", [1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 0.1, 0.3, 0.5])
@pytest.mark.parametrize("law", ["neo_hookean", "ogden"])
def test_energies_and_stresses_of_points_that_are_turned(law, size):
    """Rounding of a turned gradient is a strain of its own: no more of the energy and stress is lost than that."""
    rng = np.random.default_rng(5)
    turns = Rotation.random(12, random_state=5).as_matrix()
    strains = size * (rng.random((12, 3, 3)) - 0.5)
    ways = [turn @ (np.eye(3) + e + e.T) - np.eye(3) for turn, e in zip(turns, strains)]
    ways += [e + e.T for e in strains]
    got = found(law, ways) if law == "neo_hookean" else found(law, ways, values=list(OGDEN))
    assert not got["status"].any()
    for k, way in enumerate(ways):
        energy = exact(way)[1] if law == "neo_hookean" else exact_ogden(way)
        lost = 1e-13 + (40 * 2.0**-53 / size if k < 12 else 0)
        assert got["energy"][k] == pytest.approx(energy, rel=lost, abs=0)
        if law == "neo_hookean":
            stress = exact(way)[0]
            here = np.swapaxes(got["stress"][k].reshape(3, 3), 0, 1)
            assert np.abs(here - stress).max() < lost * np.abs(stress).max()


def test_rubber_without_shear_stiffness_is_refused():
    for shear, power in ((-1e5, 2.0), (1e5, -2.0), (1e5, 0.0)):
        with pytest.raises(ValueError, match="shear modulus of Ogden at rest"):
            cn.Ogden(bulk=1e6, shear1=shear, power1=power)
    assert found("ogden", [np.zeros((3, 3))], values=[1.0, -1.0, 2.0, 0.0, 2.0, 0.0, 2.0])["status"][0] == 2
    cn.Ogden(bulk=1e6, shear1=-1e5, power1=-2.0)


@pytest.mark.parametrize("small", [0.5, 1e-2, 1e-4, 1e-8, 1e-15])
def test_stress_and_energy_of_what_is_pressed_to_nearly_nothing(small):
    """From all sides, and along two axes of a box that stretches along the third."""
    for sides in ((small, small, small), (small, 2 * small, 1.0), (small, 1.0, 1.5)):
        got = found("neo_hookean", [np.diag(sides) - np.eye(3)])
        stress, energy = exact(np.diag(sides) - np.eye(3))
        assert got["status"][0] == 0
        assert np.abs(got["stress"][0].reshape(3, 3) - stress).max() < 1e-14 * np.abs(stress).max()
        assert got["energy"][0] == pytest.approx(energy, rel=1e-13)


def test_a_cell_that_is_inside_out_is_told():
    got = found("neo_hookean", [np.diag([-1.0, 0, 0]), np.diag([-2.5, 0, 0]), np.full((3, 3), np.nan)])
    assert list(got["status"]) == [1, 1, 1]


@pytest.mark.parametrize("young, stress", [(1e6, 1e-6), (1e6, 1e-9), (2e11, 1e-5), (1e-6, 1e-12), (1e6, 1e5)])
def test_an_initial_stress_is_met_however_small(young, stress):
    points, cells = box("quad", (2, 2), (1.0, 1.0))
    groups = {"all": np.arange(len(points))}
    body = cn.SolidBody(points, cells, cn.NeoHookean(young=young, poisson=0.3), density=1.0, groups=groups)
    given = stress * np.array([1.0, -0.5, 0.2, 0.3, 0, 0])
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, cn.Material("rock", density=1.0), initial_stress=given, fixed={"all": "xy"}))
    sim = cn.Simulation(scene, dt=1e-3)
    sim.step()
    assert np.abs(sim.meshes[0].stress["quad"][:, [0, 1, 2, 3]] - given[:4]).max() < 1e-12 * stress
    if stress < 1e-3 * young:  # Hooke's, sum of s^2 (1 + nu) / 2 E less that of the trace nu / 2 E
        s = np.diag(given[:3]) + given[3] * (np.eye(3)[[1, 0, 2]] - np.diag([0, 0, 1]))
        hooke = (1.3 * np.sum(s * s) - 0.3 * np.trace(s) ** 2) / (2 * young)
        assert sim.info["energy"]["stored"] == pytest.approx(hooke, rel=1e-3 if stress > 1e-4 * young else 1e-5)


def test_a_small_initial_stress_beside_a_large_one():
    points, cells = box("quad", (2, 1), (2.0, 1.0))
    body = cn.SolidBody(points, cells, cn.NeoHookean(young=1e6, poisson=0.3), density=1.0, groups={"all": np.arange(6)})
    given = np.outer([1e-6, 1e6], [1.0, -0.5, 0.2, 0.3, 0, 0])
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, cn.Material("rock", density=1.0), initial_stress={"quad": given}, fixed={"all": "xy"}))
    sim = cn.Simulation(scene, dt=1e-3)
    sim.step()
    off = np.abs(sim.meshes[0].stress["quad"][:, [0, 1, 2, 3]] - given[:, :4]).max(axis=1)
    assert np.all(off < 1e-12 * np.array([1e-6, 1e6]))
