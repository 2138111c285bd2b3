"""Bars and beams against the strength of materials, and in a scene."""

import cairn as cn
import numpy as np
import pytest


def at_rest(body, held, force):
    """Displacement (n, dim) with nodes held, by numpy."""
    k, n = np.asarray(body.K.todense()), body.points.size
    free = np.setdiff1d(np.arange(n), held)
    u = np.zeros(n)
    u[free] = np.linalg.solve(k[np.ix_(free, free)], np.asarray(force, float).ravel()[free])
    return u.reshape(-1, body.dim)


def test_two_bars():
    """A load across the tip of two bars at 45 degrees: F L / (E A) of each."""
    for dim in (2, 3):
        points = np.zeros((3, dim))
        points[0, 0], points[1, 0], points[2, 1] = -1.0, 1.0, 1.0
        body = cn.bars(points, [[0, 2], [1, 2]], young=2e5, area=1e-2, density=1.0)
        held = np.r_[np.arange(2 * dim), [3 * dim - 1] if dim == 3 else []].astype(int)
        force = np.zeros((3, dim))
        force[2, 1] = -10.0
        u = at_rest(body, held, force)
        assert u[2, 1] == pytest.approx(-10.0 * np.sqrt(2) / (2e5 * 1e-2), rel=1e-12)
        assert body.nodal_mass() == pytest.approx(np.array([1, 1, 2]) * 1e-2 * np.sqrt(2) / 2)


@pytest.mark.parametrize("shear", [None, 8e-3])
@pytest.mark.parametrize("dim", [2, 3])
def test_cantilever_in_any_direction(dim, shear):
    """P L^3 / 3 E I + P L / (G A_s) at the tip, exact at the nodes whatever their number."""
    rng = np.random.default_rng(dim)
    along = rng.normal(size=dim)
    along /= np.linalg.norm(along)
    across = rng.normal(size=dim)
    across -= across @ along * along
    across /= np.linalg.norm(across)
    points = np.linspace(0, 2.0, 5)[:, None] * along
    cells = np.stack([np.arange(4), np.arange(1, 5)], 1)
    body = cn.beams(
        points, cells, young=2e9, area=1e-2, inertia=8e-6, density=1.0, poisson=0.25, shear_area=shear, clamped=[0],
        up=(0.3, -0.2, 0.9),
    )  # fmt: skip
    force = np.zeros((5, dim))
    force[-1] = 5.0 * across + 7.0 * along
    u = at_rest(body, np.arange(dim), force)[-1]
    expected = 5.0 * 8 / (3 * 2e9 * 8e-6) + (0 if shear is None else 5.0 * 2 / (8e8 * shear))
    assert u @ across == pytest.approx(expected, rel=1e-9)
    assert u @ along == pytest.approx(7.0 * 2 / (2e9 * 1e-2), rel=1e-6)
    free = np.linalg.eigvalsh(cn.beams(points, cells, young=1.0, area=1.0, inertia=1.0, density=1.0).K.toarray())
    assert np.sum(free < 1e-10 * free[-1]) == (3 if dim == 2 else 5)  # nodes on a line do not see it turn about itself


def test_a_ball_rests_on_a_beam():
    x = np.linspace(0, 1, 11)
    cells = np.stack([np.arange(10), np.arange(1, 11)], 1)
    beam = cn.beams(
        np.c_[x, 0 * x], cells, young=1e9, area=1e-3, inertia=1e-7, density=1000.0, clamped=[0, 10], rayleigh=(0.0, 2e-2),
        groups={"ends": [0, 10]},
    )  # fmt: skip
    rock = cn.Material("rock", density=1000.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    edges = cells[:, ::-1]  # the body on their left: below
    scene.add(cn.deformable(beam, rock, edges=edges, fixed={"ends": "xy"}), cn.disks([[0.5, 0.05]], 0.05, rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=1e-3)
    for _ in range(400):
        sim.step()
    weight = 1000.0 * np.pi * 0.05**2 * 10.0
    own = 1000.0 * 1e-3 * 10.0
    middle = -(weight / 192 + own / 384) / (1e9 * 1e-7)  # of a beam held at both ends
    assert sim.meshes[0].displacement[5, 1] == pytest.approx(middle, rel=0.01)


def test_the_scale_of_the_balance_knows_the_work_in_a_light_beam():
    """Its nodes have almost no kinetic energy: the energy in play is that exchanged by load and beam."""
    points = np.c_[np.linspace(0, 1, 11), np.zeros(11)]
    groups = {"ends": [0], "tip": [10], "all": np.arange(11)}
    body = cn.bars(points, np.c_[:10, 1:11], young=2e11, area=1e-4, density=1e-3, groups=groups)
    scene = cn.Scene(dim=2)
    fixed = {"ends": "x", "all": "y"}
    scene.add(cn.deformable(body, cn.Material("steel", density=1.0), fixed=fixed, force={"tip": (1e3, 0.0)}))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=1.0))
    for _ in range(20):
        sim.step()
    told = sim.energy
    work = 1e3 * sim.meshes[0].displacement[10, 0]
    assert told["stored"] == pytest.approx(work / 2, rel=1e-6)
    assert told["in_play"] > work and abs(told["closure"]) < 1e-6 * told["in_play"]


def test_what_is_wrong_is_told():
    with pytest.raises(ValueError, match="cell 0 has no length"):
        cn.bars([[0, 0], [0, 0]], [[0, 1]], young=1.0, area=1.0, density=1.0)
    with pytest.raises(ValueError, match="inertia is -1"):
        cn.beams([[0, 0], [1, 0]], [[0, 1]], young=1.0, area=1.0, inertia=-1.0, density=1.0)
    for poisson in (-1.0, -1.5):
        with pytest.raises(ValueError, match="poisson is -1.*: give a number above -1"):
            cn.beams([[0, 0], [1, 0]], [[0, 1]], young=1.0, area=1.0, inertia=1.0, density=1.0, poisson=poisson)
    with pytest.raises(ValueError, match="up is .* along a beam"):
        cn.beams([[0, 0, 0], [0, 0, 1]], [[0, 1]], young=1.0, area=1.0, inertia=1.0, density=1.0)


@pytest.mark.parametrize("way", [(1.0, 0.0, 0.0), (1.0, 1.0, 0.3)])
def test_a_straight_beam_that_nothing_holds_has_five_rigid_motions(way):
    """Its turn about itself, which no displacement shows, is no unknown of them."""
    points = np.outer([0.0, 1.0, 2.0], way)
    k = cn.beams(points, [[0, 1], [1, 2]], young=1e7, area=1e-3, inertia=1e-7, density=1000.0).K.toarray()
    values = np.linalg.eigvalsh(k)
    assert np.abs(values[:5]).max() < 1e-12 * values[-1] and values[5] > 1e-5 * values[-1]


def test_a_soft_beam_beside_a_stiff_one_that_nothing_holds_bends_as_alone():
    line, sections = np.outer([0.0, 1.0, 2.0], (1.0, 0, 0)), {"area": 1e-3, "inertia": 1e-7, "density": 1000.0}
    young, cells = [1e11, 1e11, 1e-4, 1e-4], [[0, 1], [1, 2], [3, 4], [4, 5]]
    both = cn.beams(np.concatenate([line, line + (0, 5, 0)]), cells, young=young, **sections).K.toarray()
    for k, part in zip((0, 9), (both[:9, :9], both[9:, 9:])):
        alone = cn.beams(line, cells[:2], young=young[k // 3], **sections).K.toarray()
        assert np.abs(part - alone).max() < 1e-12 * np.abs(alone).max()
        across = np.ix_([2, 5, 8], [2, 5, 8])
        assert part[across] == pytest.approx(alone[across], rel=1e-9)


@pytest.mark.parametrize("n", [2, 3])
def test_beams_of_several_moments_of_inertia(n):
    """The end of a cantilever of unit lengths under a force across it: the sum of M^2/EI; in the plane two are no pair."""
    young, inertia = 2e11, np.array([1e-6, 3e-6, 5e-6])[:n]
    points, cells = np.c_[np.arange(n + 1.0), np.zeros(n + 1)], np.stack([np.arange(n), np.arange(1, n + 1)], axis=1)
    body = cn.beams(points, cells, young=young, area=1e-2, inertia=inertia, density=7800.0, clamped=[0])
    way = np.linalg.solve(body.K.toarray()[2:, 2:], np.eye(2 * n)[-1])[-1]
    arm = n - np.arange(n)
    assert way == pytest.approx(np.sum((arm**3 - (arm - 1.0) ** 3) / (3 * young * inertia)), rel=1e-9)
