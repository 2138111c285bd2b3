"""Folders of meshed bodies among LMGC90's public examples, read and run: python legacy_public.py FOLDER.

FOLDER is the `examples` of LMGC90's sources. Each case runs with the time step, theta and steps of the script beside it; refused
cases are reported. Writes benchmarks/results/legacy_public.csv: steps that did not end within the tolerance, the largest error,
the closure of the energy balance over the energy in play, and for Taylor's bar its length and the radius of its foot [mm].
"""

import argparse
import csv
import time
import warnings
from pathlib import Path

import cairn as cn

# Time step [s], theta and steps of each folder's script; plane where it is not strain, density where there is none.
CASES = {
    "mecaMAILx_2D/1Q4-traction": (1e-3, 0.5, 100),
    "mecaMAILx_2D/braudel": (1.0, 1.0, 100, "strain", 1e-3),
    "mecaMAILx_2D/mur": (1e-3, 0.6, 1500),
    "mecaMAILx_2D/taylor": (1e-7, 0.56, 800, "axisymmetric"),
    "mecaMAILx_3D/1H8_coro": (1e-4, 0.5, 1000),
    "mecaMAILx_3D/cubetet4_cubetet4": (1e-3, 0.505, 50),
    "mecaMAILx_3D/mtl_poutre_H8": (1e-2, 0.53, 200),
    "mecaMAILx_3D/mtl_poutre_H8_gd": (1.0, 1.0, 20, "strain", 1e-3),
    "mecaMAILx_3D/tet4_tet4": (1e-3, 0.505, 50),
    "mecaMAILx_RIGID_2D/4cubes": (1e-3, 0.51, 500),
    "mecaMAILx_RIGID_2D/gard2D": (1e-3, 0.51, 50),
    "mecaMAILx_RIGID_2D/mur_gd": (1e-2, 0.6, 51),
    "mecaMAILx_RIGID_3D/cube_cylindreR": (1e-3, 0.505, 50),
    "mecaMAILx_RIGID_3D/poutre_cubeR": (1e-3, 0.505, 50),
    "mecaMAILx_RIGID_3D/poutre_cubesR": (1e-3, 0.505, 50),
}


def run(folder, dt, theta, steps, plane="strain", light=None):
    """A row of the table."""
    try:
        scene = cn.legacy.read_datbox(folder, plane=plane, light=light)
    except cn.legacy.LegacyError as error:
        return {"refused": str(error).replace(str(folder), "").replace("/DATBOX", "").strip("/: ")[:200]}
    begin = time.process_time()
    sim = cn.Simulation(scene, dt, cn.NSCD(theta, cn.Auto(), scene.legacy.alert or None), overlap="ignore")
    beyond, worst, contacts = 0, 0.0, 0
    for _ in range(steps):
        info = sim.step()
        beyond += info["status"] != "converged"
        worst, contacts = max(worst, info["error"]), max(contacts, info["contacts"])
    terms = sim.info["energy"]
    row = {
        "meshes": len(sim.meshes), "nodes": len(sim.nodes.position), "contacts": contacts, "steps": steps, "beyond": beyond,
        "worst_error": f"{worst:.1e}", "closure": f"{abs(terms['closure']) / max(terms['in_play'], 1e-300):.1e}",
        "cpu_s": f"{time.process_time() - begin:.2f}",
    }  # fmt: skip
    if folder.name == "taylor":
        place = 1e3 * sim.nodes.position
        row |= {"length_mm": f"{place[:, 1].max() - place[:, 1].min():.3f}", "radius_mm": f"{place[:, 0].max():.3f}"}
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path, help="examples of LMGC90's sources")
    options = parser.parse_args()
    names = [
        "case",
        "meshes",
        "nodes",
        "contacts",
        "steps",
        "beyond",
        "worst_error",
        "closure",
        "cpu_s",
        "length_mm",
        "radius_mm",
    ]
    with open(Path(__file__).parent / "results" / "legacy_public.csv", "w", newline="") as file:
        table = csv.DictWriter(file, [*names, "refused"], restval="")
        table.writeheader()
        for case, settings in CASES.items():
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                row = run(options.folder / case, *settings)
            table.writerow({"case": case, **row})
            print(case, row, flush=True)


if __name__ == "__main__":
    main()
