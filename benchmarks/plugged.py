"""Cost of user laws: sweeps with the built-in Signorini-Coulomb law and with copies of it from a shared library.

The copy with normal_bias takes the same path through the solver, the other the general path. Each law sweeps the
same contacts from the same state; laws take turns, and the least CPU time of each counts. Writes benchmarks/results/plugged.csv.
"""

import argparse
import csv
import subprocess
import tempfile
import time
from pathlib import Path

import cairn as cn
import numpy as np

COPY = """
module {name}
  use, intrinsic :: iso_c_binding
  use cairn_plug
  implicit none
  private
contains
  subroutine prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c, name="")
    integer(c_int32_t), value           :: n, c
    type(cairn_law_context), intent(in) :: context
    real(c_double), intent(in)          :: gap(n), u_begin(n, c), params(n, *)
    real(c_double), intent(inout)       :: state(n, *)
    real(c_double), intent(out)         :: bias(n, c), compliance(n, c), mu(n)
    bias = 0
    bias(:, 1) = max(gap, 0.0_c_double)/context%h
    compliance = 0
    mu = params(:, 1)
  end subroutine
  subroutine describe(descriptor) bind(c, name="cairn_describe_{name}")
    type(cairn_plug_descriptor), intent(inout) :: descriptor
    call describe_law(descriptor, "{name}", prepare, parameters="mu::0:inf", normal_bias={normal})
  end subroutine
end module
"""


def copy_of_coulomb(folder, name, normal):
    """The library's law, built."""
    plug = Path(cn.__file__).resolve().parent / "plugs" / "cairn_plug.f90"
    source = folder / f"{name}.f90"
    source.write_text(COPY.format(name=name, normal=".true." if normal else ".false."))
    library = folder / f"lib{name}.so"
    flags = ["-O3", "-march=native", "-shared", "-fPIC", "-J", str(folder)]
    subprocess.run(["gfortran", *flags, str(plug), str(source), "-o", str(library)], check=True)
    return cn.plug(library, law=name)


def packed(dim, count, law):
    """A lattice that gravity and a shear press together: every grain touches its neighbours."""
    rng = np.random.default_rng(7)
    side = round(count ** (1 / dim))
    grid = np.stack(np.meshgrid(*[np.arange(side)] * dim, indexing="ij"), -1).reshape(-1, dim)
    centers = (grid + 0.5) * 0.2 + rng.uniform(-1e-3, 1e-3, grid.shape)
    rock = cn.Material("rock", density=2600.0)
    gravity = np.zeros(dim)
    gravity[0], gravity[-1] = 2.0, -9.81
    scene = cn.Scene(dim=dim, gravity=gravity)
    scene.add((cn.disks if dim == 2 else cn.spheres)(centers, 0.1005, rock))
    scene.add(*cn.box([0.0] * dim, [0.2 * side] * dim, rock))
    scene.interact(rock, rock, law)
    return scene


def solver(iterations):
    """Sweeps and no more: the error is asked for at the end alone."""
    return cn.NSCD(solver=cn.NLGS(tol=1e-15, min_iter=iterations, max_iter=iterations, acceleration="none"), threads=1)


def seconds(scene, iterations):
    """CPU seconds of a step with `iterations` sweeps; contacts."""
    sim = cn.Simulation(scene, 1e-4, solver(iterations), overlap="ignore")
    begin = time.process_time()
    sim.step()
    return time.process_time() - begin, len(sim.contacts.gap), np.array(sim.bodies.velocity)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bodies", type=int, default=8000)
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--output", default=Path(__file__).parent / "results" / "plugged.csv")
    options = parser.parse_args()
    many, few = 120, 20
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        laws = {
            "built in": cn.Coulomb,
            "plugged, normal_bias": copy_of_coulomb(Path(folder), "copy_normal", True),
            "plugged, general": copy_of_coulomb(Path(folder), "copy_general", False),
        }
        for dim in (2, 3):
            best, velocities = {}, {}
            for _ in range(options.repeats):
                for name, law in laws.items():
                    scene = packed(dim, options.bodies, law(mu=0.4))
                    short, _, _ = seconds(scene, few)
                    long, contacts, velocities[name] = seconds(scene, many)
                    old = best.get(name, (np.inf, np.inf))
                    best[name] = min(old[0], short), min(old[1], long)
            reference = best["built in"][1] - best["built in"][0]
            for name, (short, long) in best.items():
                sweep = (long - short) / (many - few)
                rows.append(
                    {
                        "dim": dim,
                        "contacts": contacts,
                        "law": name,
                        "nanoseconds_per_contact_iteration": round(1e9 * sweep / contacts, 3),
                        "ratio_to_built_in": round((long - short) / reference, 3),
                        "same_bits": bool(np.array_equal(velocities[name], velocities["built in"])),
                    }
                )
                print(rows[-1])
    with open(options.output, "w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
