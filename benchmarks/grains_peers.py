"""A plane-strain test and a drum by Cairn, LIGGGHTS and YADE: the same scene and start, curves beside each other, and CPU time.

    python benchmarks/grains_peers.py [triaxial drum] [--plot docs/images/grains_peers.png]
    python benchmarks/grains_peers.py --grains 60 --share 0.02      a few grains and steps, in seconds

triaxial: 1,000 spheres (4 mm, 25 %) between six walls without friction, packed by NSCD, sheared at 50 kPa of lateral stress and
an inertial number of 1e-3 to 10 % of strain; stress on the top and change of volume. drum: 700 spheres (10 mm, 10 %) of two
colours that fill half a cylinder of .2 m, which turns half a turn a second between end walls without friction; angle of the
centre of mass from the vertical, and mixing of the halves.

Codes of springs take linear springs, 2/7 of the stiffness along the contact, and a step of 0.2 sqrt(m/k) of the lightest
grain; their stiffness number k/(P d), with the stress P of the test or of the weight of the drum's filling, is swept. The
reference is NSCD, solved to 1e-4 at half the step. `off`: mean difference of a curve from it, over the mean of the reference. All
have dashpots of half the critical damping. Programs that are not on the path are left out. Writes
benchmarks/results/grains_peers.csv, a row for each run, and grains_peers_curves.csv.
"""

import argparse
import csv
import math
import os
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np  # noqa: E402
import peers  # noqa: E402

RESULTS = Path(__file__).resolve().parent / "results"
RATIO, DAMPED, FRICTION, OF_STABLE = 2 / 7, 0.5, 0.5, 0.2
COLUMNS = ("case", "code", "stiffness_number", "grains", "dt_s", "steps", "converged", "cpu_s", "figure", "value", "second",
           "value_2", "off", "off_2")  # fmt: skip


@dataclass
class Triaxial:
    """`centers`, `radii`: the pack; `sides` (3,) [m]: its box from the origin."""

    centers: np.ndarray
    radii: np.ndarray
    sides: np.ndarray
    density = 2650.0
    stress = 5e4
    diameter = 4e-3
    dt = 2e-4
    figures = ("stress on the top [kPa], highest", "gain of volume [%], at the end")

    @property
    def rate(self):
        return 1e-3 / (self.diameter * math.sqrt(self.density / self.stress))

    @property
    def duration(self):
        return 0.1 / self.rate

    def spring(self, number):
        return number * self.stress * self.diameter

    def result(self, curve):
        stress = np.convolve(curve[:, 1], np.ones(7) / 7, "valid") if len(curve) > 7 else curve[:, 1]
        return float(stress.max()), float(curve[-1, 2])


@dataclass
class Drum:
    """`centers`, `radii`: grains at rest in the drum, whose axis is y, 0 to `width`."""

    centers: np.ndarray
    radii: np.ndarray
    sides: np.ndarray
    density = 2500.0
    radius, width, spin = 0.1, 0.04, math.pi
    diameter = 0.01
    dt = 5e-4
    duration = 1.5
    figures = ("angle [degrees], mean of the second half", "mixing, at the end")

    def spring(self, number):
        return number * 0.6 * self.density * 9.81 * self.radius * self.diameter

    def figure(self, centers, start=None):
        """Angle of the centre of mass and mixing (Lacey) of grains that began at either side of x = 0, in cells of 20 mm."""
        mass = self.radii**3
        x, z = mass @ centers[:, 0] / mass.sum(), mass @ centers[:, 2] / mass.sum()
        left = (self.centers if start is None else start)[:, 0] < 0
        cells = np.floor(centers[:, [0, 2]] / (2 * self.diameter)).astype(int)
        cell = np.unique(cells, axis=0, return_inverse=True)[1].ravel()
        whole, part = np.bincount(cell, weights=mass), np.bincount(cell, weights=mass * left)
        share = part.sum() / whole.sum()
        spread = np.sum(whole * (part / whole - share) ** 2) / whole.sum()
        return math.degrees(math.atan2(-x, -z)), 1 - spread / max(share * (1 - share), 1e-30)

    def result(self, curve):
        return float(curve[len(curve) // 2 :, 1].mean()), float(curve[-1, 2])


# ---------------------------------------------------------------------- Cairn


def triaxial_scene(case, law, pressure, inertia):
    """Scene, ids of the walls of +x and of +z; inertia: mass of a wall over that of the grains."""
    import cairn as cn

    sand, plate = cn.Material("sand", density=case.density), cn.Material("plate", density=case.density)
    scene = cn.Scene(3, gravity=(0, 0, 0))
    scene.add(cn.spheres(case.centers, case.radii, sand))
    mass = inertia * case.density * np.sum(4 / 3 * np.pi * case.radii**3)
    ids = []
    for axis, normal in enumerate(np.eye(3)):
        scene.add(cn.wall((0, 0, 0), normal, plate))
        if axis == 1:
            scene.add(cn.wall(case.sides * normal, -normal, plate))
        else:
            push = cn.Servo(pressure, -normal, area="walls")
            wall = cn.wall(case.sides * normal, -normal, plate, mass=mass, free=("vx", "", "vz")[axis], force=push)
            ids.append(int(scene.add(wall)[0]))
    scene.interact(sand, sand, law(FRICTION if pressure > 1e4 else 0.0))
    scene.interact(sand, plate, law(0.0))
    return scene, *ids


def drum_scene(case, law, spin):
    import cairn as cn

    sand, steel, glass = (cn.Material(name, density=case.density) for name in ("sand", "steel", "glass"))
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(cn.spheres(case.centers, case.radii, sand))
    scene.add(cn.tube((0, 0, 0), (0, 1, 0), case.radius, steel, velocity=(0, 0, 0, 0, spin, 0)))
    scene.add(cn.wall((0, 0, 0), (0, 1, 0), glass), cn.wall((0, case.width, 0), (0, -1, 0), glass))
    for other, mu in ((sand, FRICTION), (steel, FRICTION), (glass, 0.0)):
        scene.interact(sand, other, law(mu))
    return scene


def rigid(mu):
    import cairn as cn

    return cn.Coulomb(mu=mu) if mu else cn.Frictionless()


def packed_box(count, rng):
    """A dense pack, made without friction under 1 kPa."""
    import cairn as cn

    radii = cn.pre.grains.lognormal(count, 2e-3, 0.25, rng=rng, smallest=1.2e-3, largest=3.2e-3)
    pitch, edge = 2.3 * radii.max(), math.ceil((count / 2) ** (1 / 3))
    grid = np.array([(i, j, k) for k in range(count // edge**2 + 1) for j in range(edge) for i in range(edge)], float)[:count]
    centers = (grid + 0.5 + rng.uniform(-0.07, 0.07, grid.shape)) * pitch
    width = 1.25 * (np.sum(4 / 3 * np.pi * radii**3) / 0.6) ** (1 / 3)
    centers[:, 1] *= min(1.0, width / (edge * pitch))
    if width < edge * pitch:  # fewer grains across, more of them up
        across = max(1, int(width / pitch))
        high = math.ceil(count / (edge * across))
        grid = np.array([(i, j, k) for k in range(high) for j in range(across) for i in range(edge)], float)[:count]
        centers = (grid + 0.5 + rng.uniform(-0.07, 0.07, grid.shape)) * pitch
        width = across * pitch
    sides = np.array([edge * pitch, width, (grid[:, 2].max() + 1) * pitch])
    case = Triaxial(centers, radii, sides)
    scene, right, top = triaxial_scene(case, rigid, 1e3, 1.0)
    sim = cn.Simulation(scene, 2e-4)
    box = lambda s: np.array([s.bodies.position[right, 0], width, s.bodies.position[top, 2]])
    moves = lambda s: s.time < 0.2 or s.energy["kinetic"] > 1e-3 * np.prod(box(s))
    sim.run(while_=moves, until=2.0, progress=False)
    return Triaxial(sim.bodies.position[:count].copy(), radii, box(sim))


def filled_drum(count, rng):
    """Grains that have fallen into the lower half of the drum."""
    import cairn as cn

    radii = rng.uniform(0.9, 1.1, count) * 0.5 * Drum.diameter
    pitch, half = 1.02 * 2 * radii.max(), Drum.radius
    columns, across = np.arange(-half, half, pitch), np.arange(0.5 * pitch, Drum.width - 0.4 * pitch, pitch)
    grid = np.array([(x, y, z) for z in columns for y in across for x in columns])
    grid = grid[np.hypot(grid[:, 0], grid[:, 2]) < half - 0.52 * pitch][:count]
    radii = radii[: len(grid)]
    case = Drum(grid + rng.uniform(-0.005, 0.005, grid.shape) * pitch, radii, np.zeros(3))
    sim = cn.Simulation(drum_scene(case, rigid, 0.0), 5e-4)
    sim.run(until=0.3, progress=False)
    return Drum(sim.bodies.position[: len(grid)].copy(), radii, np.zeros(3))


def by_cairn(case, number, strategy, dt, share):
    """Curve, CPU seconds, steps, share of them that converged."""
    import cairn as cn

    law = rigid
    if number:
        critical = math.exp(-math.pi * DAMPED / math.sqrt(1 - DAMPED**2))
        law = lambda mu: cn.LinearSpring(stiffness=case.spring(number), ratio=RATIO, restitution=critical, mu=mu)
        strategy = cn.SmoothDEM(threads=1, energy=False)
    steps = max(2, round(share * case.duration / dt))
    if isinstance(case, Triaxial):
        scene, right, top = triaxial_scene(case, law, case.stress, 0.05)
    else:
        scene = drum_scene(case, law, case.spin)
    sim = cn.Simulation(scene, dt, strategy, overlap="ignore")
    if isinstance(case, Triaxial):
        sim.drive([top], "vz", -case.rate * case.sides[2])
    every, curve, converged, cpu = max(1, steps // 200), [], 0, 0.0
    for _ in range(0, steps, every):
        start = time.process_time()
        if number:
            sim.run(steps=every, progress=False)
            converged += every
        else:
            converged += sum(sim.step()["status"] == "converged" for _ in range(every))
        cpu += time.process_time() - start
        if isinstance(case, Triaxial):
            x, z = sim.bodies.position[right, 0], sim.bodies.position[top, 2]
            on_top = np.any(sim.contacts.bodies == top, axis=1)
            stress = np.abs(sim.contacts.force[on_top, 2]).sum() / (x * case.sides[1])
            volume = x * z / (case.sides[0] * case.sides[2]) - 1
            curve.append((100 * (1 - z / case.sides[2]), 1e-3 * stress, 100 * volume))
        else:
            curve.append((sim.time, *case.figure(sim.bodies.position[: len(case.radii)])))
    steps = every * math.ceil(steps / every)
    return np.array(curve), cpu, steps, converged / steps


# ---------------------------------------------------------------------- LIGGGHTS

LIGGGHTS = """atom_style granular
atom_modify map array
communicate single vel yes
boundary f f f
newton off
units si
read_data grains.data
neighbor {skin} bin
neigh_modify delay 0
fix m1 all property/global kn peratomtypepair 3 {kn}
fix m2 all property/global kt peratomtypepair 3 {kt}
fix m3 all property/global gamman peratomtypepair 3 {gamman}
fix m4 all property/global gammat peratomtypepair 3 {gammat}
fix m5 all property/global coefficientFriction peratomtypepair 3 0 0 0 0 {mu} {mu} 0 {mu} 0
fix m6 all property/global coefficientRestitution peratomtypepair 3 .5 .5 .5 .5 .5 .5 .5 .5 .5
fix m7 all property/global youngsModulus peratomtype 1e7 1e7 1e7
fix m8 all property/global poissonsRatio peratomtype .3 .3 .3
pair_style gran model hooke/stiffness tangential history
pair_coeff * *
timestep {dt}
{walls}
fix integrate all nve/sphere
thermo 1000000
run 0
{print}
shell sh stamp.sh begin
run {steps}
shell sh stamp.sh end
"""
TRIAXIAL_WALLS = """fix y0 all wall/gran model hooke/stiffness tangential history primitive type 1 yplane 0.0
fix y1 all wall/gran model hooke/stiffness tangential history primitive type 1 yplane {width}
fix x0 all wall/gran model hooke/stiffness tangential history primitive type 1 xplane 0.0
fix z0 all wall/gran model hooke/stiffness tangential history primitive type 1 zplane 0.0
variable height equal {z}-{v}*step*dt
variable target equal -{stress}*{width}*v_height
fix right all mesh/surface/stress/servo file right.stl type 1 com {x} 0. 0. ctrlPV force axis 1. 0. 0. target_val v_target &
 vel_max 1.0 kp {kp} ki {ki}
fix top all mesh/surface/stress file top.stl type 1
fix down all move/mesh mesh top linear 0. 0. -{v}
fix plates all wall/gran model hooke/stiffness tangential history mesh n_meshes 2 meshes right top
"""
TRIAXIAL_PRINT = """variable place equal f_right[{slot}]
variable force equal f_top[3]
fix out all print {every} "$(step) ${{place}} ${{force}}" file curve.txt screen no
"""
DRUM_WALLS = """fix g all gravity 9.81 vector 0.0 0.0 -1.0
fix y0 all wall/gran model hooke/stiffness tangential history primitive type 1 yplane 0.0
fix y1 all wall/gran model hooke/stiffness tangential history primitive type 1 yplane {width}
fix drum all mesh/surface file drum.stl type 3
fix turn all move/mesh mesh drum rotate origin 0. 0. 0. axis 0. 1. 0. period {period}
fix around all wall/gran model hooke/stiffness tangential history mesh n_meshes 1 meshes drum
"""
DRUM_PRINT = "dump all all custom {every} curve.dump id x y z\ndump_modify all sort id\n"


def plate(axis, at, reach):
    """Two triangles (2, 3, 3) across an axis; `reach` (3,): their extent beyond the origin."""
    low, high = -0.2 * reach, 1.2 * reach
    a, b = [k for k in range(3) if k != axis]
    corners = np.zeros((4, 3))
    corners[:, axis] = at
    corners[:, a] = low[a], high[a], high[a], low[a]
    corners[:, b] = low[b], low[b], high[b], high[b]
    return corners[[[0, 1, 2], [0, 2, 3]]]


def drum_triangles(case):
    """The drum (128, 3, 3) as a prism of 64 sides, of the same area of its base."""
    angle = 2 * np.pi * np.arange(65) / 64
    around = case.radius * math.sqrt(np.pi / (32 * math.sin(np.pi / 32))) * np.c_[np.cos(angle), np.zeros(65), np.sin(angle)]
    ends = [around + (0, y, 0) for y in (-0.2 * case.width, 1.2 * case.width)]
    p, q = ends
    return np.concatenate([np.stack([p[:-1], p[1:], q[1:]], 1), np.stack([p[:-1], q[1:], q[:-1]], 1)])


def stl(path, triangles):
    lines = ["solid plate"]
    for three in triangles.tolist():
        vertices = "".join(f"vertex {x!r} {y!r} {z!r}\n" for x, y, z in three)
        lines.append(f"facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet")
    path.write_text("\n".join([*lines, "endsolid plate"]) + "\n")


def springs(case, number):
    """Stiffness [N/m], step [s], viscosity over the mass of a pair [1/s]."""
    k, masses = case.spring(number), case.density * 4 / 3 * np.pi * case.radii**3
    rate = 2 * DAMPED * math.sqrt(k / (0.5 * masses.mean()))
    return k, OF_STABLE * math.sqrt(masses.min() / k), rate


def by_liggghts(case, number, share, folder):
    k, dt, rate = springs(case, number)
    steps = max(2, round(share * case.duration / dt))
    every = max(1, steps // 200)
    steps = every * math.ceil(steps / every)
    triaxial = isinstance(case, Triaxial)
    low = -0.3 * case.sides if triaxial else np.array([-case.radius, -0.25 * case.width, -case.radius]) * 1.05
    high = 1.3 * case.sides if triaxial else np.array([case.radius, 1.25 * case.width, case.radius]) * 1.05
    rows = [f"{i + 1} 2 {2 * r!r} {case.density} {x!r} {y!r} {z!r}"
            for i, (x, y, z, r) in enumerate(np.c_[case.centers, case.radii].tolist())]  # fmt: skip
    box = "\n".join(f"{a!r} {b!r} {n}lo {n}hi" for a, b, n in zip(low.tolist(), high.tolist(), "xyz", strict=True))
    (folder / "grains.data").write_text(f"pack\n\n{len(rows)} atoms\n3 atom types\n{box}\n\nAtoms\n\n" + "\n".join(rows) + "\n")
    if triaxial:
        stl(folder / "right.stl", plate(0, case.sides[0], case.sides))
        stl(folder / "top.stl", plate(2, case.sides[2], case.sides))
        # the wall moves by a tenth of a metre a second where its stress is missing altogether
        walls = TRIAXIAL_WALLS.format(width=case.sides[1], x=case.sides[0], z=case.sides[2], v=case.rate * case.sides[2],
                                      stress=case.stress, kp=0.1, ki=0.1 / 1e-3)  # fmt: skip
        told = TRIAXIAL_PRINT.format(every=every, slot=SERVO_PLACE)
    else:
        stl(folder / "drum.stl", drum_triangles(case))
        walls = DRUM_WALLS.format(width=case.width, period=2 * math.pi / case.spin)
        told = DRUM_PRINT.format(every=every)
    pairs = dict(kn=k, kt=RATIO * k, gamman=rate, gammat=0.5 * rate)
    pairs = {name: " ".join([f"{value!r}"] * 9) for name, value in pairs.items()}
    text = LIGGGHTS.format(skin=0.15 * case.diameter, mu=FRICTION, dt=dt, walls=walls, print=told, steps=steps, **pairs)
    spent, _ = peers.run_input("liggghts", text, folder)
    if triaxial:
        step, place, force = np.loadtxt(folder / "curve.txt").T
        z = 1 - case.rate * step * dt
        volume, stress = place / case.sides[0] * z - 1, np.abs(force) / (place * case.sides[1])
        return np.c_[100 * (1 - z), 1e-3 * stress, 100 * volume], spent, steps, dt
    return drum_curve(case, frames(folder / "curve.dump"), every * dt), spent, steps, dt


SERVO_PLACE = 10  # of the vector of a servo mesh: forces, torques, and where it is


def frames(path):
    """Positions (frames, n, 3) of a text dump whose rows are in the order of ids."""
    found = []
    for part in Path(path).read_text().split("ITEM: ATOMS")[1:]:
        lines = part.split("ITEM:")[0].splitlines()[1:]
        found.append(np.array([line.split()[1:4] for line in lines], float))
    return np.array(found)


def drum_curve(case, positions, every):
    return np.array([(k * every, *case.figure(x)) for k, x in enumerate(positions)])


# ---------------------------------------------------------------------- YADE

YADE = """import numpy as np, time
from yade import *
grains = np.loadtxt("grains.txt")
mats = [ViscElMat(kn={kn}, ks={ks}, cn={cn}, cs={cs}, frictionAngle=f, density={density})
        for f in (np.arctan({mu}), 0.0)]
for m in mats:
    O.materials.append(m)
O.bodies.append([utils.sphere(g[:3], g[3], material=mats[0]) for g in grains])
rows, n = [], len(grains)
{scene}
O.dt = {dt}
start = time.process_time()
O.run({steps}, True)
print("result", time.process_time() - start, flush=True)
np.save("curve.npy", np.array(rows))
"""
YADE_LOOP = """O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb(), Bo1_Box_Aabb(), Bo1_Facet_Aabb()]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom()],
        [Ip2_ViscElMat_ViscElMat_ViscElPhys()],
        [Law2_ScGeom_ViscElPhys_Basic()],
    ),
    {controller}
    NewtonIntegrator(damping=0, gravity=(0, 0, {g})),
    PyRunner(command="rows.append(row())", iterPeriod={every}),
]
"""
# its vertical axis is y
YADE_TRIAXIAL = """corners = [(0, 0, 0), ({x}, {z}, {y})]
ids = O.bodies.append(utils.aabbWalls(corners, thickness=0, material=mats[1], oversizeFactor=1.5))
places = dict(zip(("left", "right", "bottom", "top", "back", "front"), ids))
triax = TriaxialStressController(
    internalCompaction=False, stressMask=1, goal1=-{stress}, goal2=-{rate}, goal3=0, thickness=0, max_vel=1.0,
    **{{"wall_%s_id" % name: k for name, k in places.items()}})
def row():
    left, right, bottom, top = (O.bodies[k].state.pos[j // 2] for j, k in enumerate(ids[:4]))
    return [right - left, top - bottom, abs(O.forces.f(ids[3])[1])]
"""
YADE_DRUM = """for y, s in ((0, 1), ({width}, -1)):
    O.bodies.append(utils.wall((0, y, 0), axis=1, sense=s, material=mats[1]))
facets = [utils.facet([Vector3(*p) for p in t], material=mats[0]) for t in np.load("drum.npy")]
ids = O.bodies.append(facets)
def row():
    return [list(O.bodies[k].state.pos) for k in range(n)]
"""


def by_yade(case, number, share, folder):
    k, dt, rate = springs(case, number)
    steps = max(2, round(share * case.duration / dt))
    every = max(1, steps // 200)
    triaxial = isinstance(case, Triaxial)
    order = [0, 2, 1] if triaxial else [0, 1, 2]
    np.savetxt(folder / "grains.txt", np.c_[case.centers[:, order], case.radii])
    if triaxial:
        x, y, z = case.sides.tolist()
        scene = YADE_TRIAXIAL.format(x=x, y=y, z=z, stress=case.stress, rate=case.rate)
        scene += YADE_LOOP.format(controller="triax,", g=0.0, every=every)
    else:
        np.save(folder / "drum.npy", drum_triangles(case))
        scene = YADE_DRUM.format(width=case.width)
        turn = "RotationEngine(rotationAxis=(0, 1, 0), rotateAroundZero=True, zeroPoint=(0, 0, 0), ids=ids, "
        turn += f"angularVelocity={case.spin}),"
        scene += YADE_LOOP.format(controller=turn, g=-9.81, every=every)
    c = rate * 0.5 * case.density * 4 / 3 * np.pi * np.mean(case.radii**3)
    # the two materials of a contact are springs in series
    series = dict(kn=2 * k, ks=2 * RATIO * k, cn=2 * c, cs=c)
    text = YADE.format(density=case.density, mu=FRICTION, dt=dt, steps=steps, scene=scene, **series)
    (folder / "case.py").write_text(text)
    spent = peers.rows_of(peers.call(["yade", "-n", "-x", "-j1", "case.py"], folder))[0][0]
    rows = np.load(folder / "curve.npy")
    if triaxial:
        x, z, force = rows.T
        volume = x * z / (case.sides[0] * case.sides[2]) - 1
        return np.c_[100 * (1 - z / case.sides[2]), 1e-3 * force / (x * case.sides[1]), 100 * volume], spent, steps, dt
    return drum_curve(case, rows, every * dt), spent, steps, dt


# ---------------------------------------------------------------------- table


RIGID = ("reference", "Cairn NSCD", "Cairn NSCD, twice the step", "Cairn NSCD, four times the step")


def runs(case, share, folder, numbers, codes):
    """(code, stiffness number, curve, CPU seconds, steps, dt, share of steps converged) of each run, the reference first."""
    import cairn as cn

    tight = cn.NSCD(solver=cn.Default(tol=1e-4))
    rows = zip(RIGID, (tight, None, None, None), (0.5, 1.0, 2.0, 4.0), strict=True)
    for code, strategy, dt in rows:
        if not codes or code in codes:
            curve, cpu, steps, good = by_cairn(case, 0, strategy, dt * case.dt, share)
            yield code, "", curve, cpu, steps, dt * case.dt, f"{good:.4f}"
    there = peers.found(("liggghts", "yade"))
    for number in numbers:
        dt = springs(case, number)[1]
        if not codes or "Cairn smooth DEM" in codes:
            curve, cpu, steps, _ = by_cairn(case, number, None, dt, share)
            yield "Cairn smooth DEM", number, curve, cpu, steps, dt, ""
        for code, run in (("LIGGGHTS", by_liggghts), ("YADE", by_yade)):
            wanted = code.lower() in there and (not codes or code in codes)
            if wanted and (code != "YADE" or number <= YADE_MOST * numbers[0]):
                curve, cpu, steps, dt = run(case, number, share, folder)
                yield code, number, curve, cpu, steps, dt, ""


YADE_MOST = 1  # times the softest springs: it takes minutes for them


def off(curve, reference, column):
    """Mean difference of two curves, smoothed over 5 % of their length, over the mean of the reference; from a tenth on."""
    at = np.linspace(0.1, 0.98, 200) * min(reference[-1, 0], curve[-1, 0])
    ours, theirs = (np.convolve(np.interp(at, c[:, 0], c[:, column]), np.ones(11) / 11, "valid") for c in (curve, reference))
    return float(np.mean(np.abs(ours - theirs)) / np.mean(np.abs(theirs)))


def compare(name, count, share, numbers, rng=1, codes=(), reference=None):
    """Rows of a case and its curves by (code, number); `reference`: the curve of an earlier run of the same."""
    made = {"triaxial": packed_box, "drum": filled_drum}[name](count, np.random.default_rng(rng))
    rows, curves = [], {}
    with tempfile.TemporaryDirectory() as folder:
        for code, number, curve, cpu, steps, dt, good in runs(made, share, Path(folder), numbers, codes):
            curves[code, number] = curve
            first, second = made.result(curve)
            reference = curve if code == "reference" else reference
            values = (name, code, number, len(made.radii), f"{dt:.3g}", steps, good, f"{cpu:.2f}", made.figures[0],
                      f"{first:.4g}", made.figures[1], f"{second:.4g}",
                      *(f"{off(curve, reference, k):.3f}" for k in (1, 2)))  # fmt: skip
            rows.append(dict(zip(COLUMNS, values, strict=True)))
            print(*values, sep=", ", flush=True)
    return rows, curves


def write(path, columns, rows):
    with open(path, "w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, columns, lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def read(path, keep):
    if not path.exists():
        return []
    with open(path, newline="", encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if keep(row)]


AXES = {"triaxial": ("axial strain [%]", "stress on the top [kPa]", "gain of volume [%]"),
        "drum": ("time [s]", "angle of the centre of mass [degrees]", "mixing [-]")}  # fmt: skip


def plot(rows, lines, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    names = [n for n in AXES if any(r["case"] == n for r in rows)]
    figure, axes = plt.subplots(len(names), 2, figsize=(14, 4.2 * len(names)), layout="constrained", squeeze=False)
    colors = dict(zip((*RIGID, "Cairn smooth DEM", "LIGGGHTS", "YADE"), ("k", "C0", "C4", "C5", "C1", "C2", "C3"), strict=True))
    for both, name in zip(axes, names, strict=True):
        for ax, column, label in zip(both, ("first", "second"), AXES[name][1:], strict=True):
            for row in (r for r in rows if r["case"] == name):
                own = [p for p in lines if all(p[k] == str(row[k]) for k in ("case", "code", "stiffness_number"))]
                soft = row["stiffness_number"]
                told = f"{row['code']}{f', springs of {soft}' if soft else ''}: {float(row['cpu_s']):.3g} s"
                ax.plot([float(p["x"]) for p in own], [float(p[column]) for p in own], colors[row["code"]], label=told,
                        lw=1.4, ls={0: "-", 1: "-", 2: "--", 3: ":"}[1 + [*dict.fromkeys(r["stiffness_number"] for r in rows
                        if r["case"] == name and r["stiffness_number"])].index(soft) if soft else 0])  # fmt: skip
            ax.set(xlabel=AXES[name][0], ylabel=label)
            ax.grid(alpha=0.3)
        both[1].legend(fontsize=9, title="CPU time", loc="upper left", bbox_to_anchor=(1.01, 1.0))
    figure.savefig(path, dpi=110)


NUMBERS = {"triaxial": (400, 1600, 6400), "drum": (500, 2000, 8000)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="CASE", help=", ".join(NUMBERS))
    parser.add_argument("--grains", type=int)
    parser.add_argument("--share", type=float, default=1.0, help="of the duration")
    parser.add_argument("--numbers", type=int, nargs="+", help="stiffness numbers")
    parser.add_argument("--codes", nargs="+", default=(), help="run anew, such as YADE; the other rows stay")
    parser.add_argument("--output", type=Path, default=RESULTS)
    parser.add_argument("--plot", type=Path)
    given = parser.parse_args()
    table, lines = given.output / "grains_peers.csv", given.output / "grains_peers_curves.csv"
    names = ("case", "code", "stiffness_number", "x", "first", "second")
    for name in given.cases or NUMBERS:
        count = given.grains or {"triaxial": 1000, "drum": 700}[name]
        kept = lambda row, name=name: row["case"] != name or (given.codes and row["code"] not in given.codes)
        old = [p for p in read(lines, kept) if p["case"] == name and p["code"] == "reference"]
        before = np.array([[float(p[k]) for k in ("x", "first", "second")] for p in old]) if old else None
        if given.codes and before is None and "reference" not in given.codes:
            parser.error(f"no earlier run of {name} has a reference in {lines}: run its reference, too")
        found, curves = compare(name, count, given.share, given.numbers or NUMBERS[name], codes=given.codes, reference=before)
        points = [dict(zip(names, (name, *key, *(f"{v:.5g}" for v in p)), strict=True)) for key, c in curves.items() for p in c]
        rows, points = read(table, kept) + found, read(lines, kept) + points
        write(table, COLUMNS, rows)
        write(lines, names, points)
    if given.plot:
        plot(read(table, lambda row: True), read(lines, lambda row: True), given.plot)


if __name__ == "__main__":
    main()
