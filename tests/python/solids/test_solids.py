"""Bodies of materials of solids: forces and tangents of every element, patch tests at large strain."""

import os
import subprocess
import sys

import cairn as cn
import numpy as np
import pytest
from cairn import NeoHookean, SolidBody
from cairn.model.bulk import BULK_MATERIALS
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
    if kind not in ("triangle", "tetra"):
        yield {"mean_dilatation": True}
        yield {"material": HOOKE, "mean_dilatation": True, "kinematics": "small"}
    if dim == 2:
        yield {"plane": "stress", "thickness": 0.7}
        yield {"plane": "axisymmetric"}
        if kind != "triangle":
            yield {"plane": "axisymmetric", "mean_dilatation": True}


@pytest.mark.parametrize("kind, remedy", [("triangle", r"give quad or triangle6"), ("tetra", r"give hexahedron or tetra10")])
def test_mean_dilatation_is_refused_where_it_changes_nothing(kind, remedy):
    """Refused for cells of constant dilatation, alone or among others."""
    dim = 2 if kind == "triangle" else 3
    points, cells = box(kind, (1,) * dim, (1.0,) * dim)
    beside, others = box("quad" if dim == 2 else "hexahedron", (1,) * dim, (1.0,) * dim, lambda x: x + 1.0)
    mixed = {**{name: of + len(points) for name, of in others.items()}, **cells}
    for x, of in ((points, cells), (np.concatenate([points, beside]), mixed)):
        with pytest.raises(ValueError, match=f"changes nothing in {kind} cells.*{remedy}"):
            SolidBody(x, of, RUBBER, density=1.0, mean_dilatation=True)


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


@pytest.mark.parametrize("material", [RUBBER, HOOKE], ids=["rubber", "cells of Hooke's law side by side"])
def test_threads_keep_bits(material):
    script = (
        "import numpy as np, sys; sys.path[:0] = ['tests/helpers']\n"
        "from second_order import box\nfrom cairn import SolidBody, NeoHookean, IsotropicElastic\n"
        "p, c = box('hexahedron', (7, 6, 9), (1.0, 1.0, 1.0))\n"
        f"b = SolidBody(p, c, {material!r})\n"
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


@pytest.mark.parametrize("kind, mean", [("hexahedron", False), ("tetra", False), ("quad9", True), ("hexahedron27", True)])
def test_forces_and_tangents_keep_bits_by_powers_of_two(kind, mean):
    """Lengths four times as large: of cells of Hooke's law side by side, and of a dilatation that is linear over a cell."""
    dim = 2 if kind == "quad9" else 3
    points, cells = box(kind, (3,) * dim, (1.0,) * dim)
    material = RUBBER if mean else HOOKE
    u = 1e-2 * np.random.default_rng(0).random(points.size)
    found = []
    for size in (1.0, 4.0):
        body = SolidBody(points * size, cells, material, density=1.0, mean_dilatation=mean)
        force, values, energy, _ = body.tangent(u * size)
        found.append((force / size ** (dim - 1), values / size ** (dim - 2), energy / size**dim))
    assert all(np.array_equal(one, two) for one, two in zip(*found))


SOIL = cn.DruckerPrager(young=1e6, poisson=0.3, cohesion=1e4, friction_angle=0.5, dilation_angle=0.3, hardening=1e4)
FLAT = {  # material, kinematics, gradients of displacement in the plane
    "ogden": (cn.Ogden(bulk=1e6, shear1=4e5, power1=1.8, shear2=-2e4, power2=-2.0), None, 1.0),
    "rubber near 1/2": (cn.NeoHookean(young=1e6, poisson=0.4999), None, [[0.124, -0.718], [1.226, 0.757]]),
    "metal": (cn.FiniteJ2(young=1e6, poisson=0.3, yield_stress=1e4, isotropic=1e4), None, 1.0),
    "soil": (SOIL, "total_lagrangian", [[-0.002, 0.003], [0.029, 0.06]]),
    "soil, logarithmic": (SOIL, "logarithmic", [[0.555, 0.39], [-0.097, 0.452]]),
}


@pytest.mark.parametrize("size", [1e-12, 1e-8, 1e-5, 1e-3, 1.0])
@pytest.mark.parametrize("name", list(FLAT))
def test_plane_stress_is_that_of_a_cube_of_the_thickness_that_has_none(name, size):
    """The thickness by a search for the root in a cell of space, from strains that are all but none to those at which Newton's
    method alone goes to and fro."""
    material, kinematics, gradient = FLAT[name]
    gradient = size * np.array([[0.06, 0.02], [-0.01, -0.03]] if gradient == 1.0 else gradient)
    f = np.eye(3)
    f[:2, :2] += gradient
    square, flat = box("quad", (1, 1), (1.0, 1.0))
    cube, solid = box("hexahedron", (1, 1, 1), (1.0, 1.0, 1.0))
    body = SolidBody(square, flat, material, density=1.0, plane="stress", kinematics=kinematics)
    whole = SolidBody(cube, solid, material, density=1.0, kinematics=kinematics)
    force = body.tangent(square @ gradient.T)[0]

    def of_cube(stretch):
        f[2, 2] = stretch
        return whole.tangent(cube @ (f - np.eye(3)).T)[0].reshape(-1, 3)

    top = cube[:, 2] > 0.5
    low, high = 0.2, 1.5
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if of_cube(middle)[top, 2].sum() < 0 else (low, middle)
    known = of_cube(middle)
    known = np.stack([known[np.all(cube[:, :2] == corner, axis=1), :2].sum(axis=0) for corner in square])
    # the thickness is found to 1e-13, which the bulk modulus of rubber takes for 5e-10 of its shear stresses
    rounding = 8 * np.finfo(float).eps * np.abs(whole.tangent(np.zeros(cube.shape))[1]).max()  # of a stretch near one
    assert np.abs(force.reshape(-1, 2) - known).max() < 1e-9 * np.abs(known).max() + rounding


@pytest.mark.parametrize("kinematics", ["small", "logarithmic"])
def test_a_dashpot_bears_nothing_at_rest(kinematics):
    """Displacements at rest, stresses there and damping by the stiffness know no rate."""
    points, cells = box("quad", (2, 2), (1.0, 1.0))
    groups = {"foot": np.flatnonzero(points[:, 1] == 0), "top": np.flatnonzero(points[:, 1] == 1)}
    found = []
    for law in (HOOKE, cn.KelvinVoigt(young=1.0, poisson=0.3, viscous_young=0.1, viscous_poisson=0.3)):
        body = SolidBody(points, cells, law, density=1.0, groups=groups, kinematics=kinematics, rayleigh=(0.0, 0.5))
        u = body.solve(fixed={"foot": "xy"}, force={"top": (1e-3, -1e-2)}, increments=2)
        found.append((u, body.stress(u)["quad"], body.C.toarray()))
    for elastic, viscous in zip(*found):
        np.testing.assert_allclose(viscous, elastic, rtol=1e-9, atol=1e-11 * np.abs(elastic).max())


def blocks():
    """A linear and a rubber body of the same cells."""
    points, cells = box("quad", (2, 2), (1.0, 1.0))
    groups = {"foot": np.flatnonzero(points[:, 1] == 0), "top": np.flatnonzero(points[:, 1] == 1)}
    yield cn.ElasticBody(points, cells, young=1.0, poisson=0.3, density=1.0, groups=groups)
    yield SolidBody(points, cells, RUBBER, density=1.0, groups=groups)


def test_axes_that_are_none_are_told():
    """A third axis in the plane would be the first one of the next node."""
    skin = cn.Material("skin", density=1.0)
    for body in blocks():
        for axes, told in (("xyz", "along 'z': in 2D give x, y"), ("q", "along 'q'"), (True, "True: give axes, such as 'xy'")):
            with pytest.raises(ValueError, match=f"fixed of 'foot' is {told}"):
                body.solve(fixed={"foot": axes})
            with pytest.raises(ValueError, match=f"fixed of 'foot' is {told}"):
                scene = cn.Scene(dim=2)
                scene.add(cn.deformable(body, skin, fixed={"foot": axes}))
                cn.Simulation(scene, dt=1.0)
        for field, value in (("drive", 1.0), ("displace", lambda t: t)):
            with pytest.raises(ValueError, match=f"{field} of 'top' is along 'z': in 2D give x, y"):
                cn.deformable(body, skin, **{field: {"top": {"z": value}}})


def test_what_has_no_meaning_is_told():
    skin = cn.Material("skin", density=1.0)
    square, flat = box("quad", (1, 1), (1.0, 1.0))
    cube, solid = box("hexahedron", (1, 1, 1), (1.0, 1.0, 1.0))
    for plane in ("stress", "axisymmetric"):
        with pytest.raises(ValueError, match=f"plane is '{plane}', and points are of space"):
            SolidBody(cube, solid, RUBBER, plane=plane)
    with pytest.raises(ValueError, match=r"node \d has the radius -0.5 m: give x >= 0"):
        SolidBody(square - [0.5, 0.0], flat, RUBBER, plane="axisymmetric")
    for rayleigh, told in (((1.0,), "give shape"), ((np.nan, 0.0), "finite"), ((-1.0, 0.0), "give a, b >= 0")):
        for make in (lambda r: SolidBody(square, flat, RUBBER, rayleigh=r),
                     lambda r: cn.ElasticBody(square, flat, young=1.0, poisson=0.3, density=1.0, rayleigh=r)):  # fmt: skip
            with pytest.raises(ValueError, match=f"rayleigh.*{told}"):
                make(rayleigh)
    for body in blocks():
        for field in ("velocity", "displacement"):
            with pytest.raises(ValueError, match=rf"{field} has shape \(3,\): give \(2,\), or \(9, 2\) of the nodes"):
                cn.deformable(body, skin, **{field: (1.0, 2.0, 3.0)})
        scene = cn.Scene(dim=2)
        scene.add(cn.deformable(body, skin, drive={"top": {"x": lambda t: np.nan}}))
        with pytest.raises(ValueError, match="drive of 'top' is nan: give a finite number"):
            cn.Simulation(scene, dt=1e-3).step()
    with pytest.raises(ValueError, match="increments is 0: give a whole number >= 1"):
        body.solve(fixed={"foot": "xy"}, increments=0)


def test_a_body_that_nothing_holds_has_no_rest():
    for body in blocks():
        with pytest.raises(RuntimeError, match="no rest"):
            body.solve(fixed={"foot": "x"}, force={"top": (0.0, -1e-3)})
