"""Process state that every test leaves unchanged, and the list of large tests."""

import os
import signal
import sys

import pytest

# Tests of more than ten seconds on a single core; a smaller test of the same kind runs by default. `script/test large`
# runs them alone; CAIRN_LARGE=1 adds them to the others.
LARGE = {
    "fuzz/test_fuzz.py::test_damaged_files[FCLIB problem, compressed]",
    "physics/test_ball.py::test_path_and_time_converge_with_the_step[0.8-3]",
    "physics/test_free_rotation.py::test_the_top_flips_at_the_period_of_the_ellipse",
    "physics/test_large_strain.py::test_cook_at_large_strain",
    "physics/test_large_strain.py::test_elastica_under_a_moment",
    "physics/test_masonry.py::test_least_thickness_of_the_semicircular_arch[101-0.1075]",
    "physics/test_masonry.py::test_tilted_panel_falls_where_limit_analysis_says[running-0.7]",
    "physics/test_rocking.py::test_rocking_block[0.1-2-10-0.0001]",
    "physics/test_rocking.py::test_rocking_block[0.25-2-10-5e-05]",
    "physics/test_solid_contacts.py::test_taylors_bar[FiniteJ2-counts1-ends1-3.166]",
    "python/detection/test_contacts_in_order.py::test_contacts_among_kept_pairs_are_those_of_a_search_made_anew[3-False]",
    "python/docs/test_extending.py::test_the_walks_build_and_do_what_the_page_says[all]",
    "python/fracture/test_double_cantilever.py::test_beams_meet_the_table_of_a_cohesive_beam",
    "python/fracture/test_double_cantilever.py::test_solids_meet_fracture_mechanics_with_the_crack_longer_by_its_root",
    "python/joints/test_mesh_joints.py::test_a_bar_on_a_bar_of_cells_neither_misses_its_joint_nor_drifts",
    "python/meshes/test_nodes_and_sides.py::test_a_disk_rests_in_a_soft_row_that_it_bends_round_itself[40]",
    "python/docs/test_notebooks.py::test_a_notebook_runs[arch]",
    "python/docs/test_notebooks.py::test_a_notebook_runs[study]",
    "python/pre/test_pre_mesh.py::test_a_million_faces_take_seconds",
    "python/study/test_study.py::test_states_that_are_gone_are_made_again_only_where_needed",
    "python/study/test_study.py::test_study_that_was_cut_goes_on",
    "python/study/test_study_of_bars.py::test_a_study_sweeps_meshes",
}


def pytest_collection_modifyitems(config, items):
    found = {name for item in items if (name := item.nodeid.removeprefix("tests/")) in LARGE}
    for item in items:
        if item.nodeid.removeprefix("tests/") in found:
            item.add_marker(pytest.mark.large)
            if not os.environ.get("CAIRN_LARGE"):
                item.add_marker(pytest.mark.skip(reason="more than ten seconds: script/test large runs it"))


@pytest.fixture(autouse=True)
def broken_pipes_are_errors():
    """gmsh, which some tests begin themselves, lets a broken pipe end the program from then on."""
    yield
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)


@pytest.fixture(autouse=True)
def figures_are_closed():
    """Matplotlib warns of more than twenty, and warnings are errors: which test has the last depends on who runs before it."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")
