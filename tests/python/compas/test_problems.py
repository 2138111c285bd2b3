"""Problems of compas_dem solved by Cairn: registration, conditions, results, deformable blocks and cohesive joints."""

import subprocess
import sys
import warnings

import numpy as np
import pytest

compas = pytest.importorskip("compas", reason="compas_dem is not installed")
pytest.importorskip("compas_dem", reason="compas_dem is not installed")

import cairn as cn  # noqa: E402
import cairn_compas  # noqa: E402
from cairn.pre.importing import BlocksWarning  # noqa: E402
from cairn_compas import Solver, build, solve  # noqa: E402
from compas.datastructures import Mesh  # noqa: E402
from compas_dem.models import BlockModel  # noqa: E402
from compas_dem.problem import Problem  # noqa: E402
from compas_dem.templates import ArchTemplate, DomeTemplate  # noqa: E402
from compas_models import loads_on_supports, model_of, stack, weight  # noqa: E402

ZONE = dict(normal_stiffness=1e11, tangential_stiffness=1e11, mu=0.4, normal_strength=1e5, tangential_strength=2e5,
            normal_work=1.0, tangential_work=3.0)  # fmt: skip


def problem_of(model, **contact):
    problem = Problem(model)
    problem.set_contact_model("MohrCoulomb", **({"mu": 0.6} | contact))
    return problem, problem.add_boundary_condition("live")


def arch(n=9):
    meshes = ArchTemplate(rise=3.0, span=10.0, thickness=0.5, depth=0.5, n=n).blocks()
    return model_of(meshes, [0, n - 1])


# ------------------------------------------------------------------ registration


def test_problem_solve_finds_the_solver_by_its_name(tmp_path):
    model = stack(2)
    problem, _ = problem_of(model)
    problem.set_solver(Solver.Cairn(dt=1e-2, n_steps=3, joint=cn.Coulomb(mu=0.3)))
    compas.json_dump(problem, tmp_path / "problem.json")
    loaded = compas.json_load(tmp_path / "problem.json")
    loaded.load_model(model)
    for asked in (problem, loaded):
        results = asked.solve(n_steps=4)  # runtime options win
        assert results.metadata["solver"] == "Cairn" and results.metadata["n_steps"] == 4 and results.metadata["mu"] == 0.3
    compas.json_dump(results, tmp_path / "results.json")
    again = compas.json_load(tmp_path / "results.json")
    assert again.resultant_global((0, 1)) == results.resultant_global((0, 1))
    assert again.contact_data((0, 1)).forces == results.contact_data((0, 1)).forces


def test_other_names_go_where_they_went():
    found = Problem.solve
    cairn_compas.register()
    assert Problem.solve is found  # once
    problem, _ = problem_of(stack(2))
    with pytest.raises(ValueError, match="No solver configured"):
        problem.solve()
    other = Solver.Cairn(dt=1e-2, n_steps=2)
    other.name = "nobody"
    problem.set_solver(other)
    with pytest.raises(ValueError, match="'nobody' is not recognised"):
        problem.solve()


def test_without_compas_dem_the_remedy_is_told():
    code = "import sys; sys.modules['compas_dem'] = None; import cairn_compas"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert ended.stderr.strip().endswith("ImportError: compas_dem is needed for cairn_compas: pip install compas_dem")


@pytest.mark.parametrize(
    "options, told",
    [
        ({"steps": 3}, "no option 'steps'; it has duration"),
        ({"joint": {"law": "Glue"}}, "joint is .*give a law, as cairn.MAL"),
        ({"joint": 3}, "joint is 3"),
    ],
)
def test_solvers_refuse_wrong_options(options, told):
    with pytest.raises(ValueError, match=told):
        Solver.Cairn(**options)


@pytest.mark.parametrize(
    "options, told",
    [
        ({"dt": 1e-3}, "two of duration, n_steps and dt"),
        ({"dt": 1e-3, "n_steps": 2, "duration": 1.0}, "two of duration, n_steps and dt"),
        ({"dt": -1e-3, "n_steps": 2}, "dt is -0.001"),
        ({"dt": 1e-3, "n_steps": 2.5}, "n_steps is 2.5: give a whole number"),
        ({"urf_threshold": 2.0}, "urf_threshold is 2.0"),
        ({"track_block": 7}, "track_block is 7"),
        ({"deformable": [9]}, "deformable names block 9"),
        ({"deformable": True}, "deformable block 1 has no Ecm"),
        ({"density": "x"}, "x"),
    ],
)
def test_solve_refuses_wrong_options(options, told):
    with pytest.raises(ValueError, match=told):
        solve(problem_of(stack(2))[0], **options)


def test_incomplete_problems_are_refused():
    model = stack(2)
    with pytest.raises(ValueError, match="no contact model"):
        solve(Problem(model))
    model.clear_supports()
    with pytest.raises(ValueError, match="no support"):
        solve(problem_of(model)[0])
    bare = BlockModel()
    bare.add_support_from_mesh(Mesh.from_polyhedron(6))
    bare.add_block_from_mesh(Mesh.from_polyhedron(6))
    with pytest.raises(ValueError, match="block 1 has no material with a density"):
        solve(problem_of(bare)[0])


@pytest.mark.parametrize(
    "set_up, told",
    [
        (lambda live: live.add_point_load(9, [0, 0, 1.0]), "a point load names block_index=9: the model has blocks 0 to 1"),
        (lambda live: live.add_surface_load(1, 17, [0, 0, 1.0]), "names face 17 of block 1"),
        (lambda live: live.add_displacement(8, 0.1), "a displacement names block_index=8"),
        (lambda live: live.add_displacement(0, np.nan), "translation of block 0 is nan"),
        (lambda live: live.add_point_load(1, [0, 0, np.inf]), "a point load is .*finite"),
    ],
)
def test_wrong_conditions_are_refused(set_up, told):
    problem, live = problem_of(stack(2))
    set_up(live)
    with pytest.raises(ValueError, match=told):
        solve(problem)


# ------------------------------------------------------------------ conditions


def test_loads_balance_at_the_support():
    model = stack(3)
    problem, live = problem_of(model)
    live.add_point_load(2, [900.0, 200.0, -1000.0], point=[0.5, 0.5, 2.5])
    live.add_surface_load(2, 5, [0.0, 0.0, -5000.0])
    live.add_moment(1, [0.0, 0.0, 1000.0])
    live.add_global_body_force(0.5, 0.0, 0.0)
    results = solve(problem, dt=1e-2, n_steps=50)
    expected = [900.0 + 0.5 * 4000.0, 200.0, -6000.0 - weight(model)]
    assert loads_on_supports(model, results) == pytest.approx(expected, abs=1e-3 * weight(model))
    assert results.metadata["ufr"] < 1e-3
    # moments about the origin, of the contact points' forces on the support and of the loads
    points, forces = np.array(results.contact_point((0, 1))), np.array(results.edge_attribute((0, 1), "force_vector"))
    of_loads = np.cross([0.5, 0.5, 2.5], [900.0, 200.0, -1000.0]) + [0, 0, 1000.0]
    of_loads += sum(np.cross([0, 0, z], [0.5 * 2000.0, 0, 0]) for z in (1.0, 2.0))
    assert np.cross(points, forces).sum(axis=0) == pytest.approx(of_loads, abs=1e-3 * weight(model))


def test_moments_of_wedges_are_about_the_centre_of_mass():
    """In a wedge the mean of the surface, the point that compas_dem takes, differs from the centre of mass."""
    corners = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [0, 0, 1], [0, 1, 1]]
    wedge = Mesh.from_vertices_and_faces(corners, [[0, 3, 2, 1], [0, 1, 4], [3, 5, 2], [0, 4, 5, 3], [1, 2, 5, 4]])
    problem, live = problem_of(model_of([wedge], [0]))
    live.add_point_load(0, [0.0, 0.0, 3.0], point=[1.0, 0.0, 0.0])
    built = build(problem, duration=1.0, dt=0.1)
    assert built.blocks[0].center == pytest.approx([2 / 3, 0.5, 1 / 3])
    assert built.blocks[0].mass == pytest.approx(2000.0)
    assert built.conditions[0].ramp == pytest.approx([0, 0, 3, *np.cross([1 / 3, -0.5, -1 / 3], [0, 0, 3])])


@pytest.mark.parametrize("steps", [1, 2, 50])
def test_displacements_and_rotations_are_reached(steps):
    problem, live = problem_of(stack(2))
    live.add_displacement(0, 0.02, None, -0.01)
    live.add_rotation(0, [0.0, 0.0, 0.2])
    results = solve(problem, duration=0.5, n_steps=steps)
    assert results.displacement(0) == pytest.approx([0.02, 0.0, -0.01], abs=1e-12)
    turned = [[np.cos(0.2), -np.sin(0.2), 0], [np.sin(0.2), np.cos(0.2), 0], [0, 0, 1]]
    assert np.array(results.rotation(0)) == pytest.approx(np.array(turned), abs=1e-5 if steps > 2 else 1e-3)


def test_a_free_block_is_moved_along_the_given_dof_alone():
    problem, live = problem_of(stack(2))
    live.add_displacement(1, 0.1)
    results = solve(problem, dt=5e-3, n_steps=100)
    assert results.displacement(1) == pytest.approx([0.1, 0.0, 0.0], abs=1e-3)
    assert results.resultant_global((0, 1))[2] == pytest.approx(-weight(stack(2)), rel=1e-2)


# ------------------------------------------------------------------ results


def test_an_arch_carries_its_weight():
    model = arch()
    results = solve(problem_of(model)[0], dt=2e-3, n_steps=50, track_block=4, urf_threshold=1e-4)
    data = results.metadata
    assert data["status"] == "converged" and data["unconverged_steps"] == 0 and data["urf_history"][-1] < 1e-4
    assert len(data["displacement_history"]) == data["n_steps"] < 50
    assert loads_on_supports(model, results) == pytest.approx([0.0, 0.0, -weight(model)], abs=1e-3 * weight(model))
    assert len(list(results.edges())) == 8 and results.face_contact_edges() == list(results.edges())
    for edge in results.edges():
        frame, contact = results.contact_frame(edge), results.contact_data(edge)
        assert len(contact.points) == len(contact.forces) == len(results.contact_point(edge))
        along = np.array([list(frame.xaxis), list(frame.yaxis), list(frame.zaxis)])
        force = np.array(results.resultant_global(edge))
        assert results.resultant_local(edge) == pytest.approx((along @ force).tolist(), abs=1e-6 * weight(model))
        assert np.array(contact.resultantforce[0].vector) == pytest.approx(force, rel=1e-6, abs=1e-3)
        assert contact.polygon.area == pytest.approx(0.25, rel=1e-6)


def test_results_lead_to_thrust_lines():
    results = solve(problem_of(arch())[0], dt=2e-3, n_steps=20)
    structure = results.built.structure()
    assert structure.balance()["reaction_error"] < 1e-3
    assert len(structure.resultants().blocks) == 8
    soft = solve(problem_of(stack(2, Ecm=1000))[0], dt=2e-3, n_steps=2, deformable=True)
    with pytest.raises(ValueError, match="block 1 is deformable"):
        soft.built.structure()


def test_what_falls_is_told():
    model = stack(2)
    model.remove_support(0)
    model.add_support(1)
    results = solve(problem_of(model)[0], dt=1e-2, n_steps=50, urf_threshold=1e-3)
    assert results.metadata["status"] == "falling" and results.metadata["ufr"] == 1.0
    assert results.metadata["n_steps"] < 50


def test_a_dome_whose_rings_overlap_is_told_of_and_stands():
    template = DomeTemplate(meridians=12, hoops=4)
    meshes = template.blocks()
    model = model_of(meshes, [k for k in range(len(meshes)) if k % 4 == 3])
    with pytest.warns(cn.OverlapWarning):
        results = solve(problem_of(model)[0], dt=2e-3, n_steps=30)
    assert loads_on_supports(model, results)[2] == pytest.approx(-weight(model), rel=1e-3)


def test_blocks_that_are_not_convex_are_cut():
    outline = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]
    n = len(outline)
    corners = [[x, 0.0, z] for x, z in outline] + [[x, 1.0, z] for x, z in outline]
    faces = [list(range(n)), list(range(2 * n - 1, n - 1, -1))] + [[(k + 1) % n, k, k + n, (k + 1) % n + n] for k in range(n)]
    floor = Mesh.from_polyhedron(6)
    floor.scale(4.0)
    floor.translate([0.0, 0.0, -min(floor.vertices_attribute("z")) - 2 * max(floor.vertices_attribute("z"))])
    floor.translate([0.0, 0.0, -max(floor.vertices_attribute("z"))])
    model = model_of([floor, Mesh.from_vertices_and_faces(corners, faces)], [0])
    results = solve(problem_of(model)[0], dt=5e-3, n_steps=40)
    assert results.resultant_global((0, 1))[2] == pytest.approx(-3 * 2000.0 * 9.81, rel=1e-3)


# ------------------------------------------------------------------ deformable blocks, cohesive joints


def test_deformable_blocks_shorten_as_a_column():
    model = stack(3, Ecm=10, poisson=0.0)
    results = solve(problem_of(model)[0], dt=2e-3, n_steps=300, deformable=True, tol=1e-6, rayleigh=(0.0, 0.01))
    E, w = 1e7, 2000.0 * 9.81
    points = [np.array(results.node_attribute(k, "points")) for k in (1, 2)]
    top = points[1][:, 2].max() - 2.5
    assert top == pytest.approx(-0.5 * w * 2.0**2 / E, rel=0.02)  # a column of 2 m: w L^2/2 E
    stress = np.array(results.node_attribute(1, "stress"))
    assert stress[:, 2].mean() == pytest.approx(-1.5 * w, rel=5e-3)
    assert results.resultant_global((0, 1))[2] == pytest.approx(-2 * w, rel=1e-3)
    assert results.displacement(2)[2] < results.displacement(1)[2] < 0
    points = np.array(results.contact_point((1, 2)))  # nodes of both meshes lie on each other: one point each
    assert len(points) == len(results.contact_data((1, 2)).forces) == len(np.unique(np.round(points, 6), axis=0)) == 9


@pytest.mark.parametrize("deformable", [False, True, [1], [2]])
@pytest.mark.parametrize("share", [0.95, 1.05])
def test_zones_break_at_their_strength(deformable, share):
    problem, live = problem_of(stack(3, Ecm=20000))
    live.add_surface_load(2, 5, [0.0, 0.0, share * 1e5 + 2000.0 * 9.81])
    results = solve(problem, dt=1e-3, n_steps=100, joint=cn.MAL(**ZONE), deformable=deformable)
    if share < 1:
        assert results.resultant_global((1, 2))[2] == pytest.approx(share * 1e5, rel=1e-2)
        assert max(results.edge_attribute((1, 2), "beta")) > 0.6
    else:
        assert results.displacement(2)[2] > 1e-4
    assert results.edge_attribute((0, 1), "beta") == [1.0] * len(results.contact_point((0, 1)))


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_cohesion_of_the_contact_model_acts(share):
    problem, live = problem_of(stack(2), c=1e5, t_c=4e4)
    live.add_surface_load(1, 5, [0.0, 0.0, share * 4e4 + 2000.0 * 9.81])
    results = solve(problem, dt=1e-3, n_steps=100)
    assert (results.displacement(1)[2] > 1e-4) == (share > 1)


def test_loads_on_deformable_blocks_balance():
    model = stack(2, Ecm=1000)
    problem, live = problem_of(model)
    live.add_point_load(1, [900.0, 0.0, -1000.0], point=[0.5, 0.0, 1.5])
    live.add_moment(1, [0.0, 500.0, 0.0], loading_type="ramp")
    live.add_surface_load(1, 5, [0.0, 300.0, 0.0])
    live.add_global_body_force(0.0, 0.2, 0.0)
    results = solve(problem, dt=2e-3, n_steps=100, deformable=True, tol=1e-6)
    assert loads_on_supports(model, results) == pytest.approx([900.0, 700.0, -1000.0 - weight(model)], abs=20.0)
    points, forces = np.array(results.contact_point((0, 1))), np.array(results.edge_attribute((0, 1), "force_vector"))
    of_loads = np.cross([0.5, 0.0, 1.5], [900.0, 0.0, -1000.0]) + [0, 500.0, 0] + np.cross([0, 0, 1.5], [0, 300.0, 0])
    of_loads += np.cross([0, 0, 1.0], [0, 400.0, 0])
    assert np.cross(points, forces).sum(axis=0) == pytest.approx(of_loads, abs=30.0)


def test_tetrahedra_fill_other_blocks():
    from cairn_compas.meshing import cells_of

    mesh = Mesh.from_polyhedron(12)
    vertices, faces = mesh.to_vertices_and_faces()
    points, cells = cells_of(np.array(vertices, float), faces, 0.5)
    x = points[cells["tetra"]]
    volume = np.einsum("ij,ij->i", np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), x[:, 3] - x[:, 0]) / 6
    assert volume.min() > 0 and volume.sum() == pytest.approx(mesh.volume(), rel=1e-9)
    edges = [np.linalg.norm(x[:, i] - x[:, j], axis=1).max() for i in range(4) for j in range(i)]
    assert max(edges) <= 0.5
    with pytest.raises(ValueError, match="size is 1e-06: give a length"):
        cells_of(np.array(vertices, float), faces, 1e-6)


def test_blocks_in_millimetres_are_told_of():
    with pytest.warns(BlocksWarning, match="blocks are 200 m long .*scale the model by 1e-3"):
        build(problem_of(stack(2, size=200.0))[0], duration=1.0, dt=0.1)


def test_springs_of_the_joint_model_are_not_silently_lost():
    problem, _ = problem_of(stack(2))
    problem.set_joint_model(kn=1e9, kt=1e9)
    with pytest.warns(UserWarning, match="kn=1000000000.0, kt=1000000000.0 of the joint model are not used"):
        solve(problem, dt=1e-2, n_steps=2)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        solve(problem, dt=1e-2, n_steps=2, joint=cn.Coulomb(mu=0.5))
