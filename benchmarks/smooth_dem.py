"""Smooth DEM beside LAMMPS, LIGGGHTS and YADE: CPU microseconds a particle and step on one core, the same scene, in turn.

Dense spheres in a box (d 10 mm +-10 %, density 2500, E 1e7, nu .3, e .5, mu .5, dt 5e-5 s), at rest or flowing under gravity
tilted by 60 degrees, and clumps of three that have settled. A round runs the codes one after the other; a ratio is that of one
round. Beside the times stand contacts a particle, kinetic energy and mean overlap at the end, which have to agree before times
compare. A code that is not on the path is left out.

    python benchmarks/smooth_dem.py [--rounds 3] [--steps 400] [--cases "10k settled,..."] [--output FILE.csv]
    python benchmarks/smooth_dem.py --spheres 60 --rounds 1 --steps 20      small packings made here, in seconds

The packings are read from the folder CAIRN_REFERENCE_DATA, or made by smooth DEM where it is not there (minutes for 10,000).
The dashpot of LAMMPS's gran/hertz/history is of another kind, set to the same force as the others' at the mean overlap.
"""

import argparse
import csv
import gzip
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import peers

FOLDER = Path(os.environ.get("CAIRN_REFERENCE_DATA", Path(__file__).resolve().parents[1] / ".." / "shared")) / "scenes"
CASES = {  # packing, angle of gravity [degrees], steps before the clock starts
    "10k settled": ("dense10k", 0.0, 20),
    "10k flowing": ("dense10k", 60.0, 600),
    "50k settled": ("dense50k", 0.0, 20),
    "clumps of three": ("clumps", 0.0, 20),
}
DT, YOUNG, POISSON, RESTITUTION, FRICTION, DENSITY, DIAMETER = 5e-5, 1e7, 0.3, 0.5, 0.5, 2500.0, 0.01
SKINS = {"lammps": 5e-4, "liggghts": 5e-4}  # half and twice of it are as fast, within the noise
COLUMNS = ("case", "code", "us_per_particle_step", "least", "most", "times_cairn", "least_ratio", "most_ratio",
           "contacts_a_particle", "kinetic_J", "overlap_of_radius")  # fmt: skip
OFFSETS = 0.4 * DIAMETER * np.array([[1.0, 0.0, 0.0], [-0.5, 0.75**0.5, 0.0], [-0.5, -(0.75**0.5), 0.0]])


def gravity(angle):
    return 9.81 * np.array([np.sin(np.radians(angle)), 0.0, -np.cos(np.radians(angle))])


def box_of(grains):
    """Width of the box of a packing, whose corner is at the origin."""
    width = np.mean([(grains[:, k] - grains[:, 3]).min() + (grains[:, k] + grains[:, 3]).max() for k in (0, 1)])
    return round(float(width), 3)


def packing(name, count=None):
    """Centres and radii (n, 4) [m] of a packing; `count` makes a small one."""
    path = FOLDER / f"{name}.xyzr.gz"
    if count is None and path.exists():
        with gzip.open(path) as file:
            return np.loadtxt(file)
    count = count or {"dense10k": 10000, "dense50k": 50000}[name]
    rng = np.random.default_rng(1)
    edge = max(2, round((count / 2) ** (1 / 3)))
    grid = np.array([(i, j, k) for k in range(-(-count // edge**2)) for j in range(edge) for i in range(edge)], float)[:count]
    centers = (grid + 0.5 + rng.uniform(-0.04, 0.04, grid.shape)) * 1.2 * DIAMETER
    grains = np.c_[centers, 0.5 * DIAMETER * rng.uniform(0.9, 1.1, count)]
    sim = simulation(grains, 1.2 * DIAMETER * edge, 0.0, "hertz", 0.7)
    sim.run(until=max(0.1, 3 * np.sqrt(2 * centers[:, 2].max() / 9.81)), progress=False)
    return np.c_[sim.bodies.position[:count], grains[:, 3]]


def simulation(grains, width, angle, law, local_damping=0.0, clumps=None):
    """Simulation by Cairn on one thread: spheres, or clumps given by their places and rotations."""
    import cairn as cn

    rock = cn.Material("rock", density=DENSITY)
    scene = cn.Scene(3, gravity=gravity(angle))
    if clumps is None:
        scene.add(cn.spheres(grains[:, :3], grains[:, 3], rock))
    else:
        body = cn.pre.clump(OFFSETS, np.full(3, DIAMETER / 2), DENSITY)
        scene.add(cn.clumps(clumps[0], body.offsets, body.radii, body.mass, body.inertia, rock, rotation=clumps[1]))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), rock))
    for normal in ((1, 0, 0), (0, 1, 0)):
        scene.add(cn.wall((0, 0, 0), normal, rock), cn.wall((width, width, 0), -np.array(normal), rock))
    words = dict(young=YOUNG, poisson=POISSON, restitution=RESTITUTION, mu=FRICTION)
    scene.interact(rock, rock, cn.HertzMindlin(**words) if law == "hertz" else cn.granular("hertz", damping="tsuji", **words))
    return cn.Simulation(scene, DT, cn.SmoothDEM(threads=1, energy=False, local_damping=local_damping), overlap="ignore")


def poses(centers):
    """Centres and quaternions of clumps, in the axes of OFFSETS, from the centres of their spheres (m, 3, 3)."""
    import cairn as cn
    from cairn.pre.mass_properties import quaternions

    body = cn.pre.clump(OFFSETS, np.full(3, DIAMETER / 2), DENSITY)
    middle = centers.mean(1)
    u, _, vt = np.linalg.svd(np.einsum("mi,nmj->nij", body.offsets, centers - middle[:, None]))  # Kabsch (1976)
    u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]
    return middle, quaternions(np.swapaxes(u @ vt, 1, 2))


def child(folder, angle, warm, steps, law):
    """Runs Cairn in a process of its own: prints CPU seconds, saves the last state."""
    given = np.load(Path(folder) / "state.npz")
    clumps = (given["places"], given["turns"]) if "places" in given else None
    sim = simulation(given["grains"], float(given["width"]), angle, law, clumps=clumps)
    for _ in range(warm):
        sim.step()
    start = time.process_time()
    for _ in range(steps):
        sim.step()
    print("result", time.process_time() - start)
    # energies are not kept in the timed run
    bodies, count = sim.bodies, len(given["grains"]) if clumps is None else len(clumps[0])
    v, w = bodies.velocity[:count, :3], bodies.velocity[:count, 3:]
    if clumps is None:
        mass = DENSITY * 4 / 3 * np.pi * given["grains"][:, 3] ** 3
        kinetic = 0.5 * np.sum(mass * (np.sum(v**2, 1) + 0.4 * given["grains"][:, 3] ** 2 * np.sum(w**2, 1)))
        centers, owner = bodies.position[:count], np.arange(count)
    else:
        kinetic = 0.5 * np.sum(DENSITY * 4 / 3 * np.pi * (DIAMETER / 2) ** 3 * 3 * np.sum(v**2, 1))
        import cairn as cn

        body = cn.pre.clump(OFFSETS, np.full(3, DIAMETER / 2), DENSITY)
        q = bodies.rotation[:count]
        s, axis = q[:, :1, None], q[:, None, 1:]
        arm = np.broadcast_to(body.offsets @ body.axes, (count, 3, 3))  # rotations of bodies are those of principal axes
        axis = np.broadcast_to(axis, arm.shape)
        twice = 2 * np.cross(axis, arm)
        centers = (bodies.position[:count, None] + arm + s * twice + np.cross(axis, twice)).reshape(-1, 3)
        owner = np.repeat(np.arange(count), 3)
    np.savez(Path(folder) / "cairn.npz", centers=centers, owner=owner, kinetic=kinetic)


def state(centers, radii, owner, kinetic):
    """Contacts a particle, kinetic energy [J] and mean overlap over the radius."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(centers).query_pairs(2.01 * radii.max(), output_type="ndarray")
    pairs = pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]
    i, j = pairs.T
    overlap = radii[i] + radii[j] - np.linalg.norm(centers[i] - centers[j], axis=1)
    touching = overlap > 0
    return 2 * touching.sum() / len(centers), float(kinetic), float(np.mean(overlap[touching] / radii[i][touching]))


def run_cairn(scene, warm, steps, angle, folder, law):
    np.savez(folder / "state.npz", **scene)
    command = [sys.executable, str(Path(__file__).resolve()), "--child", str(folder), str(angle), str(warm), str(steps), law]
    text = peers.call(command, Path.cwd())
    last = np.load(folder / "cairn.npz")
    return peers.rows_of(text)[0][0], state(last["centers"], scene["grains"][:, 3], last["owner"], last["kinetic"])


HEAD = """boundary f f f
newton off
units si
"""
RUN = """timestep {dt}
fix integrate all {integrator}
thermo 100000
run {warm}
shell sh stamp.sh begin
run {steps} pre no
shell sh stamp.sh end
dump last all custom 1 last.dump id x y z vx vy vz omegax omegay omegaz radius {more}
dump_modify last sort id
run 0
"""
LIGGGHTS = (
    "atom_style granular\natom_modify map array\ncommunicate single vel yes\n"
    + HEAD
    + """{bodies}
neighbor {skin} bin
neigh_modify delay 0
fix m1 all property/global youngsModulus peratomtype {young}
fix m2 all property/global poissonsRatio peratomtype {poisson}
fix m3 all property/global coefficientRestitution peratomtypepair 1 {restitution}
fix m4 all property/global coefficientFriction peratomtypepair 1 {friction}
pair_style gran model hertz tangential history
pair_coeff * *
fix g all gravity 9.81 vector {gx} 0.0 {gz}
fix x0 all wall/gran model hertz tangential history primitive type 1 xplane 0.0
fix x1 all wall/gran model hertz tangential history primitive type 1 xplane {width}
fix y0 all wall/gran model hertz tangential history primitive type 1 yplane 0.0
fix y1 all wall/gran model hertz tangential history primitive type 1 yplane {width}
fix z0 all wall/gran model hertz tangential history primitive type 1 zplane 0.0
"""
)
LAMMPS = (
    "atom_style sphere\natom_modify map array\ncomm_modify mode single vel yes\n"
    + HEAD
    + """read_data {data}
neighbor {skin} bin
neigh_modify delay 0 every 1 check yes
{pair}
fix g all gravity 9.81 vector {gx} 0.0 {gz}
fix x all wall/gran {wall} xplane 0.0 {width}
fix y all wall/gran {wall} yplane 0.0 {width}
fix z all wall/gran {wall} zplane 0.0 NULL
"""
)
YADE = """import numpy as np, time
from yade import *
grains = np.loadtxt("grains.txt")
rock = FrictMat(young={young}, poisson={poisson}, frictionAngle=np.arctan({friction}), density={density})
O.materials.append(rock)
O.bodies.append([utils.sphere(g[:3], g[3]) for g in grains])
O.bodies.append([utils.wall(p, axis=k, sense=0) for k, p in ((0, 0), (0, {width}), (1, 0), (1, {width}), (2, 0))])
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_MindlinPhys(en={restitution}, es={restitution})],
        [Law2_ScGeom_MindlinPhys_Mindlin()],
    ),
    NewtonIntegrator(damping=0, gravity=({gx}, 0, {gz})),
]
O.dt = {dt}
O.run({warm}, True)
start = time.process_time()
O.run({steps}, True)
print("result", time.process_time() - start, utils.kineticEnergy(), flush=True)
np.savetxt("last.txt", [list(O.bodies[k].state.pos) for k in range(len(grains))])
"""


def numbers(scene, warm, steps, angle):
    pull = gravity(angle)
    return dict(young=YOUNG, poisson=POISSON, restitution=RESTITUTION, friction=FRICTION, dt=DT, density=DENSITY,
                width=float(scene["width"]), warm=warm, steps=steps, gx=pull[0], gz=pull[2])  # fmt: skip


def data_file(scene, path, liggghts):
    """Spheres for read_data; the columns of the two programs differ in nothing but their order's name."""
    grains, width = scene["grains"], float(scene["width"])
    top = 2 * grains[:, 2].max() + 0.1
    rows = [f"{i + 1} 1 {2 * r!r} {DENSITY} {x!r} {y!r} {z!r}" for i, (x, y, z, r) in enumerate(grains.tolist())]
    box = f"-0.001 {width + 0.001} xlo xhi\n-0.001 {width + 0.001} ylo yhi\n-0.001 {top} zlo zhi"
    path.write_text(f"packing\n\n{len(rows)} atoms\n1 atom types\n{box}\n\nAtoms\n\n" + "\n".join(rows) + "\n")


def dumped(path, radii):
    last = peers.last_dump(path)
    mass = DENSITY * 4 / 3 * np.pi * last["radius"] ** 3
    spin = sum(last[f"omega{k}"] ** 2 for k in "xyz")
    kinetic = 0.5 * np.sum(mass * (sum(last[f"v{k}"] ** 2 for k in "xyz") + 0.4 * last["radius"] ** 2 * spin))
    return state(np.c_[last["x"], last["y"], last["z"]], radii, np.arange(len(radii)), kinetic)


def run_liggghts(scene, warm, steps, angle, folder):
    if "places" in scene:
        return run_multisphere(scene, warm, steps, angle, folder)
    data_file(scene, folder / "grains.data", True)
    words = numbers(scene, warm, steps, angle)
    text = LIGGGHTS.format(bodies="read_data grains.data", skin=SKINS["liggghts"], **words)
    spent, _ = peers.run_input("liggghts", text + RUN.format(integrator="nve/sphere", more="", **words), folder)
    return spent, dumped(folder / "last.dump", scene["grains"][:, 3])


def run_lammps(scene, warm, steps, angle, folder, law):
    data_file(scene, folder / "grains.data", False)
    words = numbers(scene, warm, steps, angle)
    if law == "hertz":
        radius, delta = DIAMETER / 4, float(scene["overlap"])  # of a pair: effective radius, mean overlap [m]
        modulus, mass = YOUNG / (2 * (1 - POISSON**2)), DENSITY * np.pi / 12 * DIAMETER**3
        share = -np.log(RESTITUTION) / np.hypot(np.log(RESTITUTION), np.pi)
        patch = np.sqrt(radius * delta)
        dashpot = 2 * np.sqrt(5 / 6) * share * np.sqrt(2 * modulus * patch * mass) / (mass * patch)
        shear = 2 * YOUNG / ((1 + POISSON) * (2 - POISSON))
        wall = f"hertz/history {4 / 3 * modulus:.9g} {shear:.9g} {dashpot:.9g} {0.5 * dashpot:.9g} {FRICTION} 1"
        pair = f"pair_style gran/{wall}\npair_coeff * *"
    else:
        own = f"hertz/material {YOUNG} {RESTITUTION} {POISSON} tangential mindlin NULL 1.0 {FRICTION} damping tsuji"
        pair, wall = f"pair_style granular\npair_coeff * * {own}", f"granular {own}"
    text = LAMMPS.format(data="grains.data", skin=SKINS["lammps"], pair=pair, wall=wall, **words)
    spent, _ = peers.run_input("lmp", text + RUN.format(integrator="nve/sphere", more="", **words), folder)
    return spent, dumped(folder / "last.dump", scene["grains"][:, 3])


def run_yade(scene, warm, steps, angle, folder):
    np.savetxt(folder / "grains.txt", scene["grains"])
    (folder / "case.py").write_text(YADE.format(**numbers(scene, warm, steps, angle)))
    spent, kinetic = peers.rows_of(peers.call(["yade", "-n", "-x", "-j1", "case.py"], folder))[0]
    radii = scene["grains"][:, 3]
    return spent, state(np.loadtxt(folder / "last.txt"), radii, np.arange(len(radii)), kinetic)


MULTISPHERE = """variable top equal {top}
region reg block 0.0 {width} 0.0 {width} 0.0 {top} units box
region whole block -0.001 {high} -0.001 {high} -0.001 {above} units box
create_box 1 whole
"""
INSERT = """fix template all particletemplate/multisphere 15485863 atom_type 1 &
 density constant {density} nspheres 3 ntry 1000000 spheres file clump.txt scale 1.0 type 1
fix sizes all particledistribution/discrete 15485867 1 template 1.0
fix insert all insert/pack seed 32452843 distributiontemplate sizes maxattempt 500 insert_every once overlapcheck yes all_in yes &
 vel constant 0. 0. 0. particles_in_region {count} region reg
timestep {dt}
fix integrate all multisphere
thermo 100000
run 1
unfix insert
run {settle}
dump first all custom 1 first.dump id id_multisphere x y z vx vy vz omegax omegay omegaz radius
dump_modify first sort id
run 0
undump first
"""


def clumps_of(dump):
    """Centres of the spheres of each clump (m, 3, 3), and their velocities."""
    order = np.argsort(dump["id_multisphere"], kind="stable")
    x = np.c_[dump["x"], dump["y"], dump["z"]][order].reshape(-1, 3, 3)
    return x, np.c_[dump["vx"], dump["vy"], dump["vz"]][order].reshape(-1, 3, 3)


def run_multisphere(scene, warm, steps, angle, folder):
    """LIGGGHTS drops the clumps, waits until they rest and runs timed steps; Cairn then begins where these began."""
    count, width = int(scene["count"]), float(scene["width"])
    np.savetxt(folder / "clump.txt", np.c_[OFFSETS, np.full(3, DIAMETER / 2)])
    words = numbers(scene, warm, steps, angle)
    top = count * 3 * np.pi / 6 * DIAMETER**3 / width**2 / 0.2
    body = MULTISPHERE.format(top=top, width=width, high=width + 0.001, above=top + 0.01)
    settle = round(3 * np.sqrt(2 * top / 9.81) / DT)
    insert = INSERT.format(count=count, settle=settle, **words)
    end = RUN.split("\n", 3)[3].format(more="id_multisphere", **words)
    spent, _ = peers.run_input("liggghts", LIGGGHTS.format(bodies=body, skin=SKINS["liggghts"], **words) + insert + end, folder)
    first, last = (clumps_of(peers.last_dump(folder / f"{name}.dump")) for name in ("first", "last"))
    scene["places"], scene["turns"] = poses(first[0])
    kinetic = 0.5 * np.sum(3 * DENSITY * np.pi / 6 * DIAMETER**3 * np.sum(last[1].mean(1) ** 2, 1))
    owner = np.repeat(np.arange(count), 3)
    return spent, state(last[0].reshape(-1, 3), scene["grains"][:, 3], owner, kinetic)


def codes(case):
    """(name, function, share of the steps) of each code that is there, Cairn's first; clumps are dropped by LIGGGHTS."""
    there = peers.found(("liggghts",) if case == "clumps of three" else ("lmp", "liggghts", "yade"))
    cairn = [("cairn", lambda *a: run_cairn(*a, law="hertz"), 1.0)]
    if case == "clumps of three":
        return [("liggghts", run_liggghts, 1.0), *cairn] if there else []
    rows = [*cairn]
    if "lmp" in there:
        rows.append(("lammps gran/hertz/history", lambda *a: run_lammps(*a, law="hertz"), 1.0))
    if "liggghts" in there:
        rows.append(("liggghts hertz", run_liggghts, 1.0))
    rows.append(("cairn granular, tsuji", lambda *a: run_cairn(*a, law="granular"), 1.0))
    if "lmp" in there:
        rows.append(("lammps granular mindlin, tsuji", lambda *a: run_lammps(*a, law="granular"), 1.0))
    if "yade" in there:
        rows.append(("yade", run_yade, 0.1))
    return rows


def scene_of(name, spheres):
    """Start of a case: grains (n, 4), width of the box, mean overlap [m]; for clumps their number."""
    if name == "clumps":
        count = (spheres or 10000) // 3
        width = round(1.2 * DIAMETER * max(4, round((count * 1.5) ** (1 / 3))), 4)
        return {"grains": np.c_[np.zeros((3 * count, 3)), np.full(3 * count, DIAMETER / 2)], "width": width, "count": count,
                "places": np.zeros((count, 3)), "turns": np.zeros((count, 4))}  # fmt: skip
    grains = packing(name, spheres)
    width = box_of(grains) if spheres is None else round(1.2 * DIAMETER * max(2, round((spheres / 2) ** (1 / 3))), 4)
    radii = grains[:, 3]
    overlap = state(grains[:, :3], radii, np.arange(len(radii)), 0.0)[2]
    return {"grains": grains, "width": width, "overlap": overlap * DIAMETER / 2}


def run_case(case, rounds, steps, spheres):
    """Rows of a case."""
    name, angle, warm = CASES[case]
    scene, runs = scene_of(name, spheres), codes(case)
    times, last = {code: [] for code, _, _ in runs}, {}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(rounds):
            for code, run, share in runs:
                if share < 1 and times[code]:
                    continue  # a code ten times as slow: once
                few = max(2, round(share * steps))
                spent, last[code] = run(scene, max(2, round(share * min(warm, steps * 3))), few, angle, Path(folder))
                times[code].append(1e6 * spent / few / len(scene["grains"]))
    for code, figures in times.items():
        own = times["cairn granular, tsuji" if "tsuji" in code and "cairn granular, tsuji" in times else "cairn"]
        share = peers.ratio(own[: len(figures)], figures)
        contacts, kinetic, overlap = last[code]
        yield [case, code, f"{np.median(figures):.4f}", f"{min(figures):.4f}", f"{max(figures):.4f}", f"{share[0]:.2f}",
               f"{share[1]:.2f}", f"{share[2]:.2f}", f"{contacts:.3f}", f"{kinetic:.3e}", f"{overlap:.2e}"]  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=400)
    parser.add_argument("--cases", default=",".join(CASES))
    parser.add_argument("--spheres", type=int, help="packings of so many spheres made here, instead of those of the folder")
    parser.add_argument("--output", type=Path)
    parser.add_argument("--child", nargs=5)
    given = parser.parse_args()
    if given.child:
        folder, angle, warm, steps, law = given.child
        child(folder, float(angle), int(warm), int(steps), law)
        return
    rows = []
    for case in given.cases.split(","):
        for row in run_case(case, given.rounds, given.steps, given.spheres):
            print(*row, sep=", ", flush=True)
            rows.append(row)
    if given.output:
        with open(given.output, "w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows])


if __name__ == "__main__":
    main()
