"""Mutation check of the tests: lines of kernels, C++ and Python are broken one at a time, chosen by a seed among the files
below, and the tests named beside each file have to fail. The build folder (CAIRN_BUILD) is one of this tree; each broken
line compiles its file anew (in a unity build its folder), and is put back in any case. CSV: one row a line, and its outcome:
caught, missed, or refused by the compiler, which is no line of the thirty. Missed lines may be equivalent to the right ones:
a reader decides.

    script/bench mutations [--lines 30] [--seed 1] [--only core_f90 python]
"""

import argparse
import ast
import csv
import os
import random
import re
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# files, and tests that have to notice
FILES = {
    "core_f90/contact_laws/newton_restitution.f90": "kernels/test_kernels.py scenes/test_features.py",
    "core_f90/contact_laws/mohr_coulomb.f90": "kernels/test_kernels_laws.py bonds/test_joint_faces.py",
    "core_f90/contact_laws/capillary.f90": "kernels/test_kernels_attraction.py laws/test_granular_laws.py",
    "core_f90/contact_laws/rods.f90": "laws/test_rods.py",
    "core_f90/contact_laws/unilateral_contact.f90": "laws/test_contact_variants.py laws/test_laws_in_scenes.py",
    "core_f90/contact_laws/hertz_mindlin.f90": "kernels/test_kernels_laws.py strategies/test_smooth_dem.py",
    "core_f90/integrators/gear.f90": "kernels/test_kernels_integrators.py strategies/test_smooth_gear.py",
    "core_f90/integrators/generalised_alpha.f90": "kernels/test_kernels_integrators.py integrators/test_integrators.py",
    "core_f90/integrators/energy.f90": "kernels/test_kernels_smooth.py integrators/test_integrator_dissipation.py",
    "core_f90/networks/contact_spot.f90": "kernels/test_kernels_networks.py networks/test_electrical.py",
    "core_f90/networks/gas_gap.f90": "kernels/test_kernels_networks.py networks/test_electrical.py",
    "core_f90/elements/shape_families.f90": "kernels/test_kernels_elements.py",
    "core_f90/elements/tet10.f90": "kernels/test_kernels_elements.py",
    "core_f90/bulk_materials/j2_plasticity.f90": "kernels/test_kernels_solids.py solids/test_bulk_materials.py",
    "core_f90/bulk_materials/neo_hookean.f90": "kernels/test_kernels_solids.py solids/test_bulk_materials.py",
    "core_f90/detection/seams.f90": "kernels/test_kernels_seams.py scenes/test_seams.py",
    "core_f90/solvers/problems/nlgs.f90": "kernels/test_kernels_problems.py",
    "core_f90/soe/band_triangles.f90": "solvers/test_soe.py",
    "cxx/base/small_matrices.hpp": "bonds/test_rings_of_bonds.py joints/test_stiff_springs.py",
    "cxx/contacts/brittle_faces.cpp": "bonds/test_joint_faces.py",
    "cxx/contacts/joint_drift.cpp": "joints/test_joints.py joints/test_missed_joints.py",
    "cxx/contacts/overlap_limit.cpp": "detection/test_overlaps_told.py",
    "cxx/meshes/mesh_area.cpp": "fracture/test_areas_between_meshes.py bonds/test_areas_of_joined_meshes.py",
    "cxx/meshes/mortar_pair.cpp": "mortar",
    "cxx/meshes/mesh_pressure.cpp": "meshes/test_pressure.py",
    "cxx/solvers/sweeps/solid_system.cpp": "bonds/test_slender_solids.py bonds/test_rings_of_bonds.py",
    "cxx/solvers/sweeps/solid_self_stress.cpp": "bonds/test_rings_of_bonds.py",
    "cxx/networks/conduction.cpp": "networks/test_thermal.py networks/test_electrical.py",
    "cxx/soe/banded.cpp": "solvers/test_soe.py",
    "cxx/contactors/hull_shapes.cpp": "detection/test_hull_gaps.py meshes/test_round_bodies_on_soft_faces.py",
    "cxx/couplings/thermal.cpp": "networks/test_thermal.py networks/test_thermal_closed_forms.py",
    "cxx/solvers/nlgs/extrapolation.cpp": "solvers/test_extrapolated_sweeps.py",
    "cxx/solvers/nlgs/velocity_error.cpp": "solvers/test_accuracy.py",
    "python/cairn/post/measures.py": "post/test_measures.py",
    "python/cairn/post/cracks.py": "masonry/test_cracks.py",
    "python/cairn/post/limit_analysis.py": "masonry/test_limit_analysis.py",
    "python/cairn/pre/clumps.py": "pre/test_pre_clumps.py",
    "python/cairn/pre/sites.py": "pre/test_pre_deposits.py",
    "python/cairn/pre/loads.py": "pre/test_pre_loads.py",
    "python/cairn/pre/mass_properties.py": "pre/test_pre_mass_properties.py",
    "python/cairn/pre/terrain.py": "pre/test_pre_terrain.py",
    "python/cairn/run/sinking.py": "integrators/test_sinking.py detection/test_overlaps_told.py",
    "python/cairn/study/recommend.py": "study/test_study.py",
}
# a pattern, and what takes its place; the first that a line has, from a place drawn at random
CHANGES = [
    (r" \+ ", " - "), (r" - ", " + "), (r" \* ", " / "), (r"(?<![* (])\*(?![* ])", "/"),
    (r" < ", " > "), (r" > ", " < "), (r" >= ", " < "), (r" <= ", " > "),
    (r" \.and\. ", " .or. "), (r" && ", " || "), (r" \|\| ", " && "), (r"\bmax\(", "min("), (r"\bmin\(", "max("),
    (r"\bstd::max\(", "std::min("), (r"\bstd::min\(", "std::max("), (r"\b0\.5(?:_wp)?\b", "0.75"), (r" \+= ", " -= "),
    (r" -= ", " += "),
]  # fmt: skip
COMMENT = {".f90": "!", ".cpp": "//", ".hpp": "//", ".py": "#"}


def candidates(path):
    """[(number of a line, its text, the broken one)] of a file: statements alone, no declarations or loops over lanes."""
    found = []
    mark, statements = COMMENT[path.suffix], set()
    if path.suffix == ".py":
        tree = ast.parse(path.read_text(encoding="utf-8"))
        kinds = (ast.Assign, ast.AugAssign, ast.Return, ast.If, ast.While)
        statements = {node.lineno - 1 for node in ast.walk(tree) if isinstance(node, kinds)}
    for number, line in enumerate(path.read_text(encoding="utf-8").split("\n")):
        code = line.split(mark)[0].rstrip()
        if path.suffix == ".py" and (number not in statements or '"' in code or "->" in code):
            continue
        if (
            re.match(r"\s*(#|use\b|integer\b|real\b|logical\b|for \(|do\b|const char|throw\b|\")", code)
            or "::" in code.split("=")[0]
        ):
            continue
        for old, new in CHANGES:
            for hit in re.finditer(old, code):
                found.append((number, line, line[: hit.start()] + new + line[hit.end() :]))
    return found


def run(command, limit, **more):
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=limit, **more).returncode
    except subprocess.TimeoutExpired:
        return -1


def tested(tests, build, limit):
    names = [str(ROOT / "tests/python" / name) for name in tests.split()]
    more = {"PYTHONPATH": str(build / "python"), "CAIRN_BUILD": str(build), "MPLBACKEND": "Agg"}
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OMP_WAIT_POLICY": "passive", **more}
    return run([sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *names], limit, cwd=ROOT, env=environment)


def break_line(name, change, build, limit):
    """(outcome, seconds of CPU of children) of one broken line, which is put back."""
    path = ROOT / name
    number, _, broken = change
    whole = path.read_text(encoding="utf-8")
    lines = whole.split("\n")
    before = os.times()
    try:
        path.write_text("\n".join([*lines[:number], broken, *lines[number + 1 :]]), encoding="utf-8")
        if path.suffix != ".py" and run(["ninja", "-C", str(build), "_core"], 1800) != 0:
            return "refused by the compiler", 0.0
        code = tested(FILES[name], build, limit)
        after = os.times()
        spent = after.children_user + after.children_system - before.children_user - before.children_system
        return {0: "missed", -1: "caught (no end)"}.get(code, "caught"), spent
    finally:
        path.write_text(whole, encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--lines", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=float, default=600, help="seconds of the tests of one line")
    parser.add_argument("--only", nargs="*", default=[""], help="files whose name has one of these")
    options = parser.parse_args()
    build = Path(os.environ.get("CAIRN_BUILD", ROOT / "build/release")).resolve()
    files = [name for name in FILES if any(word in name for word in options.only)]
    compiled = any(not name.endswith(".py") for name in files)
    changed = subprocess.run(
        ["git", "diff", "--name-only", "--", *files], cwd=ROOT, capture_output=True, text=True
    ).stdout.split()
    if changed:
        sys.exit(f"commit or take back first: {', '.join(changed)}")
    draw = random.Random(options.seed)
    table = csv.writer(sys.stdout)
    table.writerow(["seed", "file", "line", "before", "after", "tests", "outcome", "cpu_s"])
    passed, done = {}, 0
    while done < options.lines:
        name = draw.choice(files)
        change = draw.choice(candidates(ROOT / name))
        if name not in passed:
            if compiled:
                subprocess.run(["ninja", "-C", str(build), "_core"], capture_output=True, check=True)
            passed[name] = tested(FILES[name], build, options.limit) == 0
        outcome, spent = break_line(name, change, build, options.limit) if passed[name] else ("tests fail without it", 0.0)
        done += outcome.startswith(("caught", "missed"))
        number, before, after = change
        row = [options.seed, name, number + 1, before.strip(), after.strip(), FILES[name], outcome, f"{spent:.0f}"]
        table.writerow(row)
        sys.stdout.flush()
        print(f"{time.strftime('%H:%M')} {name}:{number + 1} {outcome}", file=sys.stderr)
        if not any(passed.values()) and len(passed) == len(files):
            sys.exit("no tests pass without a broken line")
    if compiled:
        subprocess.run(["ninja", "-C", str(build), "_core"], capture_output=True, check=True)


if __name__ == "__main__":
    main()
