"""`cairn doctor`: lists installed packages, missing ones with their purpose, and runs a numerical self-test."""

import importlib.metadata
import json
import os
import platform
import re
import shutil
import sys

# optional packages, not needed for a first scene, with their purpose
OPTIONAL = {
    "matplotlib": "pictures",
    "pillow": "animations",
    "pyvista": "pictures in space",
    "trame-pyvista": "cairn view in the browser",
    "trame-vtk": "cairn view --html",
    "scipy": "studies, hulls, problems from files",
    "trimesh": "blocks from STL",
    "shapely": "faces of blocks that are not convex",
    "meshio": "meshes from gmsh, MED, VTK, Abaqus",
    "networkx": "pieces of a surface",
    "gmsh": "blocks from STEP",
    "ifcopenshell": "blocks from IFC",
    "coacd": "nearly convex parts of what no exact cut follows",
    "manifold3d": "surfaces that run through each other",
    "imageio-ffmpeg": "films as .mp4 where there is no ffmpeg",
}
PROGRAMS = {
    "gfortran": "laws of your own in Fortran",
    "cc": "laws of your own in C",
    "cmake": "building Cairn",
    "ffmpeg": "films as .mp4",
}


def add_parser(add, commands):
    """The parser of `cairn doctor`."""
    doctor = add(
        commands,
        "doctor",
        "what is installed, what is missing, and whether the numbers come out right",
        "cairn doctor\ncairn doctor --json > machine.json     to send along with a question",
    )
    doctor.add_argument("--json", action="store_true", help="output as JSON, for programs")


def main(options):
    """`cairn doctor`; 0 if the self-test passes, 1 if not."""
    facts = examine()
    if options.json:
        print(json.dumps(facts, indent=2))
    else:
        for part, entries in facts.items():
            print(part)
            for name, value in entries.items():
                print(f"  {name:16s} {value}")
    return 0 if facts["self-test"]["verdict"].startswith("right") else 1


def examine():
    """All that the command tells, as a dict of dicts of text."""
    from .. import _core, plugs

    build = {name: str(value) for name, value in dict(_core.build_info()).items()}
    build["factors"] = f"SuiteSparse {_core.suitesparse}" if _core.suitesparse != "off" else "no SuiteSparse"
    build["BLAS"] = blas()
    machine = {
        "python": f"{platform.python_version()} at {sys.executable}",
        "system": f"{platform.system()} {platform.release()}, {platform.machine()}",
        "processors": str(len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()),
        "includes": plugs.INCLUDE,
        "threads": os.environ.get("OMP_NUM_THREADS", "as many as processors (OMP_NUM_THREADS is not set)"),
    }
    packages = {}
    for name in ("numpy", "h5py", "rich", *OPTIONAL):
        try:
            packages[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            packages[name] = f"missing: for {OPTIONAL.get(name, 'everything')}; pip install {name}"
    programs = {name: shutil.which(name) or f"missing: for {what}" for name, what in PROGRAMS.items()}
    return {"cairn": build, "machine": machine, "packages": packages, "programs": programs, "self-test": self_test()}


def blas(maps="/proc/self/maps"):
    """Which library does the dense algebra of factors in this process, and whether there are faster ones; text."""
    try:
        with open(maps, encoding="utf-8") as file:
            paths = sorted({line.split(None, 5)[5].strip() for line in file if "/" in line and len(line.split(None, 5)) > 5})
    except OSError:
        return "unknown: this system does not tell what a process loads"
    # wheels of numpy and scipy bring libraries of their own along, which nobody else uses
    paths = [path for path in paths if not re.search(r"/(?!cairn)[^/]*\.libs/", path)]
    names = {
        "mkl_rt": "MKL",
        "mkl_core": "MKL",
        "openblas": "OpenBLAS",
        "blis": "BLIS",
        "libatlas": "ATLAS",
        "libblas": "reference",
    }
    for sign, name in names.items():
        for path in paths:
            file, folder = os.path.basename(path), os.path.dirname(path)
            if sign in file or (sign == "openblas" and sign in folder and "blas" in file):
                return f"{name} at {path}"
    return "none that is a library of its own"


def self_test():
    """A small scene, solved: a column of three disks on a floor carries its weight, and does so to the same bits twice."""
    import numpy as np

    from .. import NSCD, Coulomb, Material, Scene, Simulation, disks, wall

    def run():
        rock = Material("rock", density=2000.0)
        scene = Scene(dim=2, gravity=(0.0, -10.0))
        scene.add(disks([[0.0, 0.5], [0.0, 1.5], [0.0, 2.5]], [0.5, 0.5, 0.5], rock))
        scene.add(wall(point=(0, 0), normal=(0, 1), material=rock))
        scene.interact(rock, rock, Coulomb(mu=0.5))
        simulation = Simulation(scene, dt=2.0**-8, strategy=NSCD())
        simulation.run(steps=16, progress=False)
        return simulation

    one, two = run(), run()
    mass = float(np.sum(one.bodies.mass[np.isfinite(one.bodies.mass)]))
    contacts = one.contacts
    carried = float(np.max(np.sum(contacts.impulse * contacts.normal, axis=1))) * 2.0**8
    weight = mass * 10.0
    same = np.array_equal(one.bodies.position, two.bodies.position) and np.array_equal(one.bodies.velocity, two.bodies.velocity)
    off = abs(carried - weight) / weight
    faults = []
    if one.info["status"] != "converged":
        faults.append(f"the step ended {one.info['status']}")
    if not off <= 1e-3:
        faults.append(f"the floor carries {carried:g} N of {weight:g} N")
    if not same:
        faults.append("two runs of the same scene differ")
    return {
        "verdict": "right" if not faults else "wrong: " + "; ".join(faults),
        "weight carried": f"to {off:.1e}",
        "twice the same": "to the bit" if same else "no",
    }
