"""Ground of prisms below a surface: volumes, neighbours, files, refusals; and bodies at rest on it."""

import cairn as cn
import numpy as np
import pytest
from cairn.pre import terrain


def slope(n=4, steep=0.5):
    x, y = np.linspace(0, 4, n + 1), np.linspace(0, 2, 3)
    return terrain.heights(x, y, np.broadcast_to(steep * x[:, None], (n + 1, 3)))


def test_prisms_fill_what_lies_below():
    vertices, faces = slope()
    meshes = terrain.prisms(vertices, faces, 1.5)
    ground = cn.polyhedra(meshes, cn.Material("ground", density=1.0))
    # over 4 by 2 from -1.5 to x / 2
    np.testing.assert_allclose(ground.mass.sum(), 2 * (4 * 1.5 + 0.5 * 8), rtol=1e-13)
    assert len(meshes) == len(faces) == 16 and all(len(v) == 6 for v, _ in meshes)


def test_a_surface_goes_through_a_file(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    vertices, faces = slope()
    for name in ("slope.stl", "slope.ply"):
        trimesh.Trimesh(vertices, faces, process=False).export(tmp_path / name)
        v, f = terrain.read_surface(tmp_path / name, scale=2.0)
        assert len(v) == len(vertices) and len(f) == len(faces)
        order = np.lexsort(vertices.T[::-1])
        np.testing.assert_allclose(v, 2 * vertices[order], atol=1e-6)
        plan = np.linalg.det(np.stack((v[f[:, 1], :2] - v[f[:, 0], :2], v[f[:, 2], :2] - v[f[:, 0], :2]), axis=1))
        assert np.all(plan > 0)


def test_what_has_no_prism_is_refused():
    vertices, faces = slope()
    with pytest.raises(ValueError, match=r"faces\[0\] looks down \(16 of 16"):
        terrain.prisms(vertices, faces[:, ::-1], 1.0)
    upright = vertices.copy()
    upright[faces[3, 2]] = upright[faces[3, 0]] + (0, 0, 5.0)
    with pytest.raises(ValueError, match="has no area seen from above"):
        terrain.prisms(upright, faces[3:4], 1.0)
    with pytest.raises(ValueError, match="vertex numbers"):
        terrain.prisms(vertices, faces + 100, 1.0)
    with pytest.raises(ValueError, match="depth"):
        terrain.prisms(vertices, faces, 0.0)
    vertices[2, 1] = np.nan
    with pytest.raises(ValueError, match="vertices"):
        terrain.prisms(vertices, faces, 1.0)


@pytest.mark.parametrize("mu,slides", [(0.51, False), (0.49, True)])
def test_a_box_on_many_prisms_slides_at_the_angle_of_friction(mu, slides):
    """Flat over eight triangles: their common edges do not catch it, a = g (sin - mu cos)."""
    vertices, faces = slope(steep=0.5)
    scene = cn.Scene(dim=3, gravity=(0, 0, -9.81))
    stone = cn.Material("stone", density=1000.0)
    scene.add(cn.polyhedra(terrain.prisms(vertices, faces, 1.0), stone, fixed=True))
    angle = np.arctan(0.5)
    up = np.array([-np.sin(angle), 0, np.cos(angle)])
    center = np.array([2.5, 1.0, 1.25]) + 0.25 * up
    turn = [[np.cos(angle / 2), 0, -np.sin(angle / 2), 0]]
    (body,) = scene.add(cn.boxes([center], [[1.2, 0.8, 0.5]], stone, rotation=turn))
    scene.interact("*", "*", cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, 2e-3, cn.NSCD(theta=0.5, solver=cn.NLGS(tol=1e-9, max_iter=5000), threads=1))
    sim.run(200, progress=False)
    v = sim.bodies.velocity[np.flatnonzero(sim.bodies.id == body)[0]]
    expected = 9.81 * (np.sin(angle) - mu * np.cos(angle)) * 0.4 if slides else 0.0
    along = np.array([-np.cos(angle), 0, -np.sin(angle)])
    assert v[:3] @ along == pytest.approx(expected, rel=1e-3, abs=1e-6)
    assert np.linalg.norm(v[3:]) < 1e-4


@pytest.mark.parametrize("ending", [".stl", ".ply", ".obj", ".dat"])
def test_files_that_are_no_surface(tmp_path, ending):
    pytest.importorskip("trimesh")
    path = tmp_path / f"odd{ending}"
    with pytest.raises(FileNotFoundError, match=f"odd{ending} does not exist"):
        terrain.read_surface(path)
    path.write_text("v 0 0 0\nf 1 2 3\n")
    with pytest.raises(ValueError, match=f"odd{ending}"):
        terrain.read_surface(path)


def test_needless_triangles_of_a_file_are_left_out(tmp_path):
    """A triangle without area and a duplicate: a warning, and the remaining surface carries a ball."""
    pytest.importorskip("trimesh")
    path = tmp_path / "ground.obj"
    corners = ["0 0 0", "1 0 0", "1 1 0", "0 1 0", "0.5 0 0"]
    faces = ["1 2 3", "1 3 4", "1 5 2", "3 4 1"]
    path.write_text("".join(f"v {c}\n" for c in corners) + "".join(f"f {f}\n" for f in faces))
    with pytest.warns(UserWarning, match="ground.obj: of 4 triangles 1 without area and 1 listed twice"):
        vertices, kept = terrain.read_surface(path)
    assert len(kept) == 2
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    rock = cn.Material("rock", density=2000.0)
    scene.add(cn.surface(vertices, kept, rock), cn.spheres([[0.3, 0.3, 0.1]], 0.1, rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, dt=1e-3)
    sim.run(steps=5, progress=False)
    assert abs(sim.bodies.velocity[-1]).max() < 1e-9
