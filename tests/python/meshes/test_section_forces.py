"""Section forces of bars and beams against the strength of materials; in run files and pictures."""

import cairn as cn
import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

BEAM = {"young": 2e9, "area": 1e-2, "inertia": (8e-6, 3e-6), "torsion": 5e-6, "density": 1.0, "poisson": 0.25}


def turned(dim, seed):
    """Rows: a frame of axes in any direction."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((dim, dim)))
    q[0] *= np.sign(np.linalg.det(q))
    return q


def at_rest(body, held, force):
    """Displacement (n, dim) of a linear body with dofs held, by numpy."""
    k, n = body.K.toarray(), body.points.size
    free = np.setdiff1d(np.arange(n), held)
    u = np.zeros(n)
    u[free] = np.linalg.solve(k[np.ix_(free, free)], np.asarray(force, float).ravel()[free])
    return u.reshape(-1, body.dim)


@pytest.mark.parametrize("kinematics", ["small", "corotational"])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_cantilever_bears_what_statics_say(dim, kinematics):
    """N = F, V = P, M = P (L - x), of small loads; in space of both directions, and a moment about it by a pair of forces."""
    axes = turned(dim, dim)
    points = np.linspace(0, 2.0, 5)[:, None] * axes[0]
    cells = np.c_[:4, 1:5]
    up = (0, 0, 1) if dim == 2 else axes[1] + 0.3 * axes[0]
    given = BEAM | ({"inertia": 8e-6} if dim == 2 else {})
    body = cn.beams(points, cells, clamped=[0], up=up, kinematics=kinematics, groups={"foot": [0]}, **given)
    across = np.array([[-axes[0, 1], axes[0, 0]]]) if dim == 2 else np.stack([axes[1], np.cross(axes[0], axes[1])])
    pushed = np.array([3e-3, -2e-3])[: dim - 1]
    force = np.zeros((5, dim))
    force[-1] = 0.1 * axes[0] + pushed @ across
    u = at_rest(body, np.arange(dim), force) if kinematics == "small" else body.solve({"foot": "xyz"[:dim]}, force.ravel())
    told = body.section_forces(u)
    near = 1e-9 if kinematics == "small" else 1e-4  # the loads move with the end
    assert told["axial_force"] == pytest.approx(np.full(4, 0.1), rel=near, abs=1e-7)
    shear = told["shear_force"].reshape(4, -1)
    assert shear == pytest.approx(np.tile(pushed, (4, 1)), rel=10 * near)
    x = np.linspace(0, 2.0, 5)
    moment = told["bending_moment"].reshape(4, 2, dim - 1)
    expected = pushed * (2.0 - np.stack([x[:-1], x[1:]], axis=1))[:, :, None]
    assert np.abs(moment - expected).max() < 10 * near * 2 * 3e-3
    if dim == 3:
        assert np.abs(told["torsion_moment"]).max() < 1e-4 * 3e-3


@pytest.mark.parametrize("kinematics", ["small", "corotational"])
def test_a_shaft_twisted_by_arms(kinematics):
    """A pair of forces on arms twists the shaft between them and the clamped end: T = F d."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 0.2, 0], [1, -0.2, 0]], float)
    body = cn.beams(points, [[0, 1], [1, 2], [1, 3]], clamped=[0], kinematics=kinematics, groups={"foot": [0]}, **BEAM)
    force = np.zeros((4, 3))
    force[2, 2], force[3, 2] = 1e-2, -1e-2
    u = at_rest(body, np.arange(3), force) if kinematics == "small" else body.solve({"foot": "xyz"}, force.ravel())
    told = body.section_forces(u)
    assert told["torsion_moment"] == pytest.approx([4e-3, 0, 0], rel=1e-6, abs=1e-9)
    # by columns: along the second axis (z, in the plane of up) and the third at the arm's foot, then at its tip
    assert told["bending_moment"][1] == pytest.approx([2e-3, 0, 0, 0], rel=1e-6, abs=1e-9)
    assert told["shear_force"][1] == pytest.approx([1e-2, 0], rel=1e-6, abs=1e-9)


def test_rotations_give_what_the_frame_turned_as_a_whole_bears():
    """Turned by half a turn and on, a bent corotational frame bears the same in the axes of its sections."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1.5, 0.6, 0.3], [2.0, 0.5, 1.0]])
    body = cn.beams(points, [[0, 1], [1, 2], [2, 3]], kinematics="corotational", **BEAM)
    u = 0.05 * np.random.default_rng(1).standard_normal(points.shape)
    before = body.section_forces(u)
    q, model = np.eye(3), body.model()
    body.tangent(u, model)
    half = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])
    for _ in range(3):
        q = half @ q
        moved = (points + u) @ q.T - points
        body.tangent(moved, model)
    after = body.section_forces(moved, model)
    for name, values in before.items():
        assert after[name] == pytest.approx(values, rel=1e-8, abs=1e-8 * np.abs(before["bending_moment"]).max()), name


@pytest.mark.parametrize("kinematics", ["small", "corotational", "total_lagrangian"])
@pytest.mark.parametrize("dim", [2, 3])
def test_two_bars_share_a_load(dim, kinematics):
    """Bars at 45 degrees under a load of 10 N: each gets a compression of 10/sqrt(2) N on top of its initial tension."""
    points = np.zeros((3, dim))
    points[0, 0], points[1, 0], points[2, 1] = -1.0, 1.0, 1.0
    given = {"young": 2e9, "area": 1e-2, "density": 1.0}
    body = cn.bars(points, [[0, 2], [1, 2]], kinematics=kinematics, groups={"feet": [0, 1], "tip": [2]}, **given)
    force = np.zeros((3, dim))
    force[2, 1] = -10.0
    held = np.r_[np.arange(2 * dim), [3 * dim - 1] if dim == 3 else []].astype(int)
    if kinematics == "small":
        u = at_rest(body, held, force)
    else:
        u = body.solve({"feet": "xyz"[:dim]} | ({"tip": "z"} if dim == 3 else {}), force.ravel())
    near = {"small": 1e-12}.get(kinematics, 1e-5)
    assert body.section_forces(u)["axial_force"] == pytest.approx(-10 / np.sqrt(2), rel=near)
    pulled = cn.bars(points, [[0, 2], [1, 2]], kinematics=kinematics, initial_stress=[3e3, -2e3], **given)
    assert pulled.section_forces(np.zeros((3, dim)))["axial_force"] == pytest.approx([30.0, -20.0], rel=1e-12)


def frames(dim, kinematics):
    """A truss, or beams, on which a ball falls, beside an elastic block."""
    rock = cn.Material("rock", density=1000.0)
    scene = cn.Scene(dim, gravity=(0.0, -10.0, 0.0)[:dim])
    points = np.zeros((6, dim))
    points[:, 0] = np.linspace(0, 1, 6)
    cells = np.c_[:5, 1:6]
    groups = {"ends": [0, 5]}
    given = {"young": 2e7, "area": 1e-3, "density": 1e3, "groups": groups, "kinematics": kinematics}
    up = {"up": (0, 1, 0)} if dim == 3 else {}
    body = cn.beams(points, cells, inertia=1e-7, clamped=[0, 5], **up, **given)
    scene.add(cn.deformable(body, rock, contact=[2, 3], fixed={"ends": "xyz"[:dim]}, name="frame"))
    kind, side = ("quad", 4) if dim == 2 else ("hexahedron", 8)
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
    block = cn.ElasticBody(
        corners[:side, :dim] + (2.0, 0.0, 0.0)[:dim], {kind: [np.arange(side)]}, young=1e7, poisson=0.3, density=1e3,
        groups={"foot": [0, 1]},
    )  # fmt: skip
    scene.add(cn.deformable(block, rock, fixed={"foot": "xyz"[:dim]}, name="block"))
    ball = cn.disks if dim == 2 else cn.spheres
    scene.add(ball([[0.5, 0.21, 0.0][:dim]], 0.2, rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, dt=1e-3)


@pytest.mark.parametrize("kinematics", ["small", "corotational"])
@pytest.mark.parametrize("dim", [2, 3])
def test_run_files_hold_them_and_pictures_show_them(dim, kinematics, tmp_path):
    sim, path = frames(dim, kinematics), tmp_path / "frame.vtkhdf"
    sim.run(steps=40, every=20, output=path, progress=False)
    run = cn.load(path)
    last, told = run[-1], sim.meshes[0].section_forces
    lines = last.corners_of_cells()[0] == 3
    assert lines.sum() == 5
    for name, values in told.items():
        assert np.array_equal(last.cells[name][lines], values), name
        assert not np.any(last.cells[name][~lines])
    assert np.any(last.cells["stress"][~lines]) and not np.any(last.cells["stress"][lines])
    assert np.abs(told["bending_moment"]).max() > 0
    turned = "beam_rotation" in last.nodes.names
    assert turned == (kinematics == "corotational")
    if turned:
        assert np.array_equal(last.nodes["beam_rotation"][:6], sim.meshes[0].rotation)
    for what in ("velocity", "material", "bending_moment", "axial_force"):
        ax = run.plot(-1, what)
        if dim == 2:
            bars = [c for c in ax.collections if type(c).__name__ == "LineCollection" and len(c.get_segments()) == 5]
            assert len(bars) == (1 if what in ("velocity", "material") else 2)  # on the pale ones
            ends = last.drawn["position"][last.rows_of(sim.meshes[0].ids)]
            assert np.array_equal([s[0] for s in bars[-1].get_segments()], ends[:-1])
        if what == "bending_moment":
            worst = np.abs(told[what]).max(axis=1)
            if dim == 2:
                assert np.array_equal(bars[-1].get_array(), worst)
        matplotlib.pyplot.close(ax.figure)
    ax = run.plot_force_chains(-1)
    matplotlib.pyplot.close(ax.figure)
    assert np.array_equal(run[0].cells["axial_force"], np.zeros(6))


def test_scene_files_keep_frames(tmp_path):
    """Loaded anew, and restarted, a frame bears the same to the bit."""
    for kinematics in ("small", "corotational"):
        sim = frames(3, kinematics)
        sim.run(steps=10, progress=False)
        sim.scene.save(tmp_path / f"{kinematics}.cairn.h5")
        sim.checkpoint(tmp_path / f"{kinematics}.h5")
        again = cn.Simulation(cn.Scene.load(tmp_path / f"{kinematics}.cairn.h5"), dt=1e-3)
        again.restore(tmp_path / f"{kinematics}.h5")
        for s in (sim, again):
            s.run(steps=5, progress=False)
        one, other = sim.meshes[0].section_forces, again.meshes[0].section_forces
        assert all(np.array_equal(one[name], other[name]) for name in one)


def test_other_bodies_have_none():
    sim = frames(2, "small")
    with pytest.raises(AttributeError, match="'block' has no sections: cairn.bars and cairn.beams have"):
        _ = sim.meshes[1].section_forces
