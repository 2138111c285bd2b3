"""Which kernels have a twin, something that says the same in another way: the number of those that have none can only fall."""

import os
import re
import subprocess
import sys
from pathlib import Path

from kernels import rows

HERE = Path(__file__).resolve().parent
TESTS = HERE.parents[1]
CORE, CXX = TESTS.parent / "core_f90", TESTS / "cxx"
# Kernels without a twin: cairn_sweep_chosen (sweeps over slow tiles of large heaps), cairn_seam_closing and cairn_seam_contacts
# (seams of flush faces, held by scenes in test_seams.py).
WITHOUT = 1
# Kernels called through higher layers, in a test that compares with a plain loop, a closed form or another code: names, file,
# test.
THROUGH = [
    (r"law_\w+_zone", "python/masonry/test_walls_of_zones.py", "test_walls_of_each_law_converge_past_their_peak"),
    (r"with(out)?_swelling", "python/networks/test_expansion.py", "test_solids_that_are_held_are_pressed"),
    (r"with(out)?_prestretch|stretch_of_stress", "python/meshes/test_initial_stress.py", "test_the_law_is_asked_at_its_stretch"),
    (r"(bars|beams)_moved",
     "python/meshes/test_moving_frames.py", "test_forces_are_the_gradient_of_the_energy_and_the_tangent_that_of_forces"),
    (r"bulk_\w+", "python/solids/test_bulk_materials.py", "test_tangents_are_the_differences_of_the_stress"),
    (r"damage_of_cells", "python/fracture/test_crack_band.py",
     "test_the_tangent_of_shared_damage_is_the_symmetric_part_of_the_differences"),
    (r"strain_measure|stress_of_measure", "python/solids/test_bulk_materials.py", "test_measures_of_large_strain"),
    (r"small_\w+", "cxx/test_soe.cpp", "SolvesAsATextbookLoop"),
    (r"nlgs_sweep|delassus", "cxx/test_nlgs.cpp", "FindsWhatTheTextbookFinds"),
    (r"ranked_sweep", "python/ranks/test_ranks.py", "test_a_run_over_ranks_is_that_without"),
    (r"contact_work", "cxx/test_interaction.cpp", "EnergyIsWhatBodiesLose"),
    (r"grid_\w+|bar_search|tube_search|contactor_reach|contactor_directions|pair_admit|pair_keep|pair_tidy|reference_detection|"
     r"pair_(disk_disk|disk_segment|disk_half_plane|sphere_sphere|sphere_plane|sphere_tube)",
     "cxx/test_detection.cpp", "finds_what_the_plain_way_finds"),
    (r"pairs_beyond", "cxx/test_kept_pairs.cpp", "find_what_a_search_finds_while_bodies_move"),
    (r"periodic_\w+|pairs_of_ghosts|pairs_of_hits", "cxx/test_detection.cpp", "finds_all_images_in_a_periodic_cell"),
    (r"pair_polygon_polygon", "python/detection/test_polygon_contacts.py", "test_random_pairs_have_the_gaps_of_plain_loops"),
    (r"pair_polygon_segment", "python/detection/test_polygon_contacts.py", "test_side_on_side"),
    (r"pair_polyhedron_polyhedron|fetch_hull|hull_place",
     "python/detection/test_shape_contacts.py", "test_random_pairs_have_the_gaps_of_coal"),
    (r"pair_convex", "python/detection/test_round_shapes.py", "test_random_pairs_have_the_gaps_of_coal_and_of_proved_bounds"),
    (r"pair_(capsule|cylinder|superquadric)_facet",
     "python/detection/test_round_surfaces.py", "test_least_gap_is_that_of_all_triangles"),
    (r"pair_sphere_facet", "python/detection/test_surfaces.py", "test_the_least_gap_is_that_of_plain_loops"),
    (r"pair_polyhedron_facet", "python/detection/test_surface_blocks.py", "test_least_gap_is_that_of_all_triangles"),
    (r"pair_cylinder_tube",
     "python/detection/test_round_tubes.py", "test_cylinders_touch_with_the_farthest_points_of_their_rims"),
    (r"pair_superquadric_tube", "python/detection/test_round_tubes.py", "test_superquadrics_have_the_clearance_of_their_reach"),
    (r"add_impulses|relative_velocities", "python/solvers/test_passes.py", "test_impulses_move_bodies_as_the_matrices_do"),
    (r"law_rolling_(wet|capillary)_\w+", "python/laws/test_rolling_with_cohesion.py",
     "test_a_wet_grain_begins_to_roll_where_attraction_adds_to_its_weight"),
    (r"law_rolling_bonded_\w+", "python/laws/test_rolling_with_cohesion.py", "test_bonds_beside_rolling_hold_as_bonds_do"),
    (r"law_composite_interface_\w+", "python/fracture/test_composite_interface.py",
     "test_combined_paths_are_those_of_small_increments"),
    (r"law_granular_contact_\w+", "python/laws/test_smooth_laws.py", "test_parts_of_a_contact_are_those_of_hertz_mindlin"),
    (r"law_liquid_bridge_\w+",
     "python/laws/test_smooth_laws.py", "test_bridges_pull_as_lambert_and_willett_say_until_they_rupture"),
    (r"law_plastic_contact_\w+",
     "python/laws/test_smooth_laws.py", "test_a_plastic_spring_rebounds_by_the_ratio_of_its_stiffnesses"),
    (r"law_yield_contact_\w+", "python/laws/test_smooth_laws.py", "test_yielding_spheres_rebound_as_thornton_and_ning_say"),
    (r"law_smooth_bond_\w+|smooth_moments",
     "python/laws/test_smooth_laws.py", "test_a_cantilever_of_bonded_balls_bends_as_a_beam"),
    (r"fluid_grain_\w+", "python/fluid/test_fluid_grains.py", "test_flow_through_a_held_bed_feels_the_gradient_of_the_law"),
    (r"fluid_\w+", "python/fluid/test_fluid.py", "test_poiseuille_and_couette"),
    (r"uneven_\w+|smooth_spins",
     "python/strategies/test_smooth_shapes.py", "test_free_rotation_of_unequal_moments_keeps_energy_and_momentum"),
    (r"verlet_works\w*", "python/strategies/test_smooth_balance.py", "test_loads_drags_and_drives_close"),
    (r"local_damping",
     "python/strategies/test_smooth_dem.py", "test_local_damping_takes_a_share_of_the_force_along_the_motion"),
    (r"contact_terms", "python/ranks/test_ranks.py", "test_a_run_over_ranks_is_that_without"),
    (r"normal_sweep", "python/scenes/test_overlap_is_taken_back.py", "test_a_square_that_is_struck_aside_turns"),
    (r"contact_(error|scale)", "python/solvers/test_passes.py", "test_the_error_is_that_of_the_matrices"),
    (r"law_misses", "python/bonds/test_solids_of_bonds.py", "test_the_error_of_light_bodies_under_bonds_is_that_by_hand"),
    (r"extrapolated_sweep|mapped_responses",
     "python/solvers/test_passes.py", "test_extrapolated_sweeps_end_where_newtons_method_does"),
    (r"pair_disk_polygon", "python/detection/test_hull_gaps.py", "test_disks_and_polygons"),
    (r"pair_polygon_half_plane|pair_polyhedron_plane", "python/detection/test_hull_gaps.py", "test_corners_before_a_half_space"),
    (r"pair_sphere_polyhedron", "python/detection/test_hull_gaps.py", "test_spheres_and_polyhedra"),
    (r"pair_polyhedron_tube", "python/detection/test_hull_gaps.py", "test_polyhedra_in_a_tube"),
    (r"pair_capsule_tube", "python/detection/test_round_tubes.py", "test_even_superquadrics_and_short_capsules_are_spheres"),
]  # fmt: skip


def kernels():
    """Names of all kernels: procedures bound to C in core_f90."""
    text = "\n".join(path.read_text(encoding="utf-8") for path in CORE.rglob("*.f90"))
    text = re.sub(r"&\s*\n\s*&?", " ", text)
    interfaces = re.compile(r"abstract interface.*?end interface", re.S | re.I)
    names = set(re.findall(r"(?:subroutine|function) +(cairn_\w+) *\([^)]*\)[^\n]*bind\(c\)", interfaces.sub("", text)))
    for row in rows("contact_laws/laws.def", "CAIRN_LAW"):
        slots = [slot for slot, there in zip(("prepare", "solve", "commit", "residual", "energy"), row[6:]) if there == "YES"]
        names.update(f"cairn_law_{row[0]}_{slot}" for slot in [*slots, *(["force", "stiffness"] if row[-1] == "YES" else [])])
        names.update([f"cairn_law_{row[0]}_zone"] if row[-2] == "ZONES" else [])
    return names


def laws_driven_by_one_contact():
    """All slots of the laws that the C++ tests of laws drive step by step, against closed forms."""
    files = ("test_bond_laws.cpp", "test_cohesive_laws.cpp", "test_contact_variants.cpp", "test_zone_variants.cpp")
    text = "".join((CXX / name).read_text(encoding="utf-8") for name in files)
    return [row[0] for row in rows("contact_laws/laws.def", "CAIRN_LAW") if f'"{row[1]}"' in text]


def test_kernels_without_a_twin(tmp_path):
    """Every kernel is called by a test of kernels in Python, named by a test in C++, or covered by the tests in THROUGH."""
    names = kernels()
    assert len(names) > 300
    files = [str(path) for path in sorted(HERE.glob("test_kernels*.py")) if path.name != Path(__file__).name]
    environment = {**os.environ, "CAIRN_KERNELS_CALLED": str(tmp_path / "called")}
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-p", "no:xdist", *files]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=tmp_path)
    assert ended.returncode == 0, ended.stdout[-3000:]
    have = set((tmp_path / "called").read_text().split())
    have |= set(re.findall(r"\bcairn_\w+", "".join(path.read_text(encoding="utf-8") for path in CXX.glob("*.cpp"))))
    for _, file, test in THROUGH:
        assert re.search(rf"(def |, ){test}\(?", (TESTS / file).read_text(encoding="utf-8")), (file, test)
    through = [f"cairn_({known})" for known, _, _ in THROUGH] + [
        f"cairn_law_{name}_\\w+" for name in laws_driven_by_one_contact()
    ]
    have |= {name for name in names if any(re.fullmatch(pattern, name) for pattern in through)}
    without = sorted(names - have)
    assert len(without) <= WITHOUT, f"{len(without)} of {len(names)} kernels have no twin: " + " ".join(without)
