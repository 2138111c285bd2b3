"""Scenes that users bring, at default settings: what their steps cost, whether they converge, and a figure against theory.

    python benchmarks/users_scenes.py biaxial|box|slope|wall|vault|arch|all [--size small|full] [--solver default|1e-4|...]

biaxial: polygons between four walls, packed without friction, then sheared at constant lateral stress; the peak of sin phi.
box: polyhedra poured into a box; the load on its floor over their weight, and the share of solid.
slope: a rock fill of polyhedra, cut steeper than it can stand; the angle at which it comes to rest.
wall: a dry-stone wall under a heavy block that moves along its top; the place of the load on the foundation, by statics.
vault: a barrel vault in bond whose supports move apart; its thrust, against the least one of limit analysis.
arch: a masonry arch of deformable blocks on mortar that cracks as a support gives way; the same.

Writes a row for each run into benchmarks/results/users_scenes.csv. Solvers: "default", a tolerance (NLGS or Auto as Default
chooses, every step to it), "nlgs:TOL" or "auto:TOL".
"""

import argparse
import csv
import math
import time
from pathlib import Path

import cairn as cn
import numpy as np
from cairn.post import limit_analysis
from cairn.pre import loads, masonry, stones

RESULTS = Path(__file__).resolve().parent / "results" / "users_scenes.csv"
COLUMNS = ("scene", "size", "solver", "bodies", "contacts", "steps", "converged", "iterations_a_step", "worst_error",
           "largest_overlap", "energy_closure", "cpu_ms_a_step", "figure", "value", "right")  # fmt: skip
GRAVITY = 9.81


def strategy(word):
    """None at default settings."""
    if word == "default":
        return None
    name, _, tol = word.rpartition(":")
    return cn.NSCD(solver={"": cn.Default, "nlgs": cn.NLGS, "auto": cn.Auto}[name](tol=float(tol)))


class Watch:
    """Adds up what steps cost and how they end."""

    def __init__(self, sim):
        self.sim, self.steps, self.converged, self.iterations, self.error, self.overlap = sim, 0, 0, 0, 0.0, 0.0
        self.cpu, self.contacts = 0.0, 0

    def step(self):
        begin = time.process_time()
        info = self.sim.step()
        self.cpu += time.process_time() - begin
        self.steps += 1
        self.converged += info["status"] == "converged"
        self.iterations += info["iterations"]
        self.error = max(self.error, info["error"])
        self.overlap = max(self.overlap, info["penetration"])
        self.contacts = max(self.contacts, len(self.sim.contacts.gap))

    def row(self, figure, value, right):
        """Values by column; `right`: what theory or the literature gives."""
        energy = self.sim.energy
        return {
            "bodies": len(self.sim.bodies.id) + len(self.sim.meshes),
            "contacts": self.contacts,
            "steps": self.steps,
            "converged": self.converged,
            "iterations_a_step": f"{self.iterations / self.steps:.0f}",
            "worst_error": f"{self.error:.1e}",
            "largest_overlap": f"{self.overlap:.4f}",
            "energy_closure": f"{abs(energy['closure']) / max(energy['in_play'], 1e-300):.1e}",
            "cpu_ms_a_step": f"{1e3 * self.cpu / self.steps:.1f}",
            "figure": figure,
            "value": f"{value:.4g}",
            "right": right,
        }


# ---------------------------------------------------------------------- grains


def plates(grains, sides, mu, stress, inertia):
    """A scene in 2D: grains (set of bodies) between fixed walls and two that a stress pushes; ids of these."""
    sand, plate = cn.Material("sand", density=2700.0), cn.Material("plate", density=2700.0)
    scene = cn.Scene(2, gravity=(0, 0))
    scene.add(grains(sand))
    count = scene.add(cn.wall((0, 0), (0, 1), plate), cn.wall((0, 0), (1, 0), plate))[0]
    right, top = count + 2, count + 3
    for k, (axis, other) in enumerate(((0, top), (1, right))):
        normal = -np.eye(2)[axis]
        area = lambda sim, other=other, axis=axis: abs(sim.bodies.position[sim.bodies.id == other, 1 - axis][0])
        push = cn.Servo(stress, normal, area=area)
        scene.add(cn.wall(-normal * sides[axis], normal, plate, mass=inertia, free=("vx", "vy")[k], force=push))
    scene.interact(sand, sand, cn.Coulomb(mu=mu) if mu else cn.Frictionless())
    scene.interact(sand, plate, cn.Frictionless())
    return scene, right, top


def biaxial(small, solver, cache=None):
    """Dense polygons, sigma_3 of 10 kPa, mu .5, inertial number 1e-3; peak of sin phi in strains up to .02 (.03 at full size)."""
    count, size, stress, mu, dt = 150 if small else 2000, 0.01, 1e4, 0.5, 2e-4
    rng = np.random.default_rng(1)
    sizes = rng.uniform(0.7, 1.3, count) * size
    rocks = stones.random_polygons(count, sizes, elongation=0.8, angularity=0.85, rng=rng)
    area = sum(0.5 * abs(np.sum(s[:, 0] * np.roll(s[:, 1], -1) - s[:, 1] * np.roll(s[:, 0], -1))) for s in rocks)
    width = math.sqrt(area / 0.85 / 1.5)
    mass = 0.05 * 2700.0 * area
    file = cache and Path(cache) / f"biaxial_{count}.npz"
    if file and file.exists():
        found = np.load(file)
        places, turns, sides = found["places"], found["turns"], found["sides"]
    else:
        places, turns = stones.loose(rocks, (0, 0), (1.3 * width, 99.0), rng)
        sides = np.array([1.35 * width, places[:, 1].max() + size])
        grains = lambda sand: cn.polygons(rocks, sand, position=places, rotation=turns)
        scene, right, top = plates(grains, sides, 0.0, 0.1 * stress, 10 * mass)
        sim = cn.Simulation(scene, 5e-4)
        # the walls come to rest one after the other; a pack that still moves would be too loose
        box = lambda s: np.array([s.bodies.position[right, 0], s.bodies.position[top, 1]])
        moves = lambda s: s.time < 0.25 or s.energy["kinetic"] > 1e-5 * stress * np.prod(box(s))
        sim.run(while_=moves, until=2.0, progress=False)
        places, turns, sides = sim.bodies.position[:count].copy(), sim.bodies.rotation[:count].copy(), box(sim)
        if file:
            np.savez(file, places=places, turns=turns, sides=sides)
    grains = lambda sand: cn.polygons(rocks, sand, position=places, rotation=turns)
    scene, right, top = plates(grains, sides, mu, stress, mass)
    sim = cn.Simulation(scene, dt, strategy(solver))
    rate = 1e-3 / (size * math.sqrt(2700.0 / stress))
    watch, ratios, strains = Watch(sim), [], []
    for _ in range(50 if small else 150):
        watch.step()  # the stress rises to that of the test, and the pack comes to rest
    sides = np.array([sim.bodies.position[right, 0], sim.bodies.position[top, 1]])
    sim.drive([top], "vy", -rate * sides[1])
    for _ in range(round((0.02 if small else 0.03) / (rate * dt))):
        watch.step()
        pair = sim.contacts.bodies
        push = np.abs(sim.contacts.force)
        x, y = sim.bodies.position[right, 0], sim.bodies.position[top, 1]
        axial, lateral = push[(pair == top).any(1), 1].sum() / x, push[(pair == right).any(1), 0].sum() / y
        ratios.append((axial, lateral))
        strains.append((1 - y / sides[1], x * y / np.prod(sides) - 1))
    ratios = np.array(ratios)
    window = max(5, len(ratios) // 40)
    axial, lateral = (np.convolve(r, np.ones(window) / window, "valid") for r in ratios.T)
    sine = (axial - lateral) / (axial + lateral)
    peak = int(np.argmax(sine))
    at, volume = strains[peak + window // 2][0], strains[-1][1]
    return watch.row(f"peak of sin phi (at {100 * at:.2f} %; volume {100 * volume:+.2f} %)", sine[peak], "")


def box(small, solver, cache=None):
    """Polyhedra of 10 cm fall into a box without friction on its walls, which carry no weight."""
    count, size = 60 if small else 500, 0.1
    rng = np.random.default_rng(2)
    sizes = rng.uniform(0.7, 1.3, count) * size
    rocks = stones.random_polyhedra(count, sizes, elongation=0.8, flatness=0.8, angularity=0.8, rng=rng)
    width = (4 if small else 8) * size
    places, turns = stones.loose(rocks, (0, 0, 0), (width, width, 99.0), rng)
    rock, plate = cn.Material("rock", density=2600.0), cn.Material("plate")
    scene = cn.Scene(3, gravity=(0, 0, -GRAVITY))
    scene.add(cn.polyhedra(rocks, rock, position=places, rotation=turns))
    floor = scene.add(cn.wall((0, 0, 0), (0, 0, 1), plate))[0]
    for axis in np.eye(3)[:2]:
        scene.add(cn.wall((0, 0, 0), axis, plate), cn.wall(width * axis, -axis, plate))
    scene.interact(rock, rock, cn.Coulomb(mu=0.5))
    scene.interact(rock, plate, cn.Frictionless())
    sim = cn.Simulation(scene, 1e-3, strategy(solver))
    watch, loads_ = Watch(sim), []
    for _ in range(round((0.7 if small else 0.9) / sim.dt)):
        watch.step()
        loads_.append(np.abs(sim.contacts.force[(sim.contacts.bodies == floor).any(1), 2]).sum())
    mass = sim.bodies.mass[:count]
    tops = np.sort(sim.bodies.position[:count, 2])
    half = tops < np.quantile(tops, 0.8)
    fraction = mass[np.argsort(sim.bodies.position[:count, 2])][half].sum() / 2600.0 / (width**2 * tops[half].max())
    load = np.mean(loads_[-50:]) / (GRAVITY * mass.sum())
    return watch.row(f"load on the floor over weight (solid {fraction:.3f} below the level of 80 %)", load, "1")


def slope(small, solver, cache=None, count=None):
    """Rocks of half a metre, cells of Voronoi drawn in by a fifth, fill a cut of 60 degrees; its front slides down."""
    count = count or (150 if small else 5000)
    rng = np.random.default_rng(3)
    pitch = 0.5
    height = pitch * (count / 6) ** 0.5 / 1.15
    length, depth = 2.0 * height, 4 * pitch
    n = int(count / (1 - 0.5 * height / math.tan(math.radians(60)) / length))
    cells = masonry.voronoi((0, 0, 0), (length, depth, height), stratified(n, (length, depth, height), rng))
    keep = [k for k, v in enumerate(cells.vertices) if v[:, 0].mean() + v[:, 2].mean() / math.tan(math.radians(60)) < length]
    rocks = []
    for k in keep:
        v, middle = cells.vertices[k], cells.vertices[k].mean(0)
        rocks.append((middle + 0.8 * (v - middle), cells.faces[k]))
    rock, ground = cn.Material("rock", density=2600.0), cn.Material("ground")
    scene = cn.Scene(3, gravity=(0, 0, -GRAVITY))
    ids = scene.add(cn.polyhedra(rocks, rock))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), ground), cn.wall((0, 0, 0), (1, 0, 0), rock))
    for point, normal in (((0, 0, 0), (0, 1, 0)), ((0, depth, 0), (0, -1, 0))):
        scene.add(cn.wall(point, normal, cn.Material("glass")))
    scene.interact(rock, rock, cn.Coulomb(mu=0.6))
    scene.interact(rock, ground, cn.Coulomb(mu=0.8))
    scene.interact(rock, "glass", cn.Frictionless())
    sim = cn.Simulation(scene, 2e-3, strategy(solver))
    watch = Watch(sim)
    for _ in range(250 if small else 300):
        watch.step()
    x = sim.bodies.position[ids]
    told = f"angle of the slope (front moved by {x[:, 0].max() - length:.2f} m, v {speed(sim, ids):.2g} m/s)"
    return watch.row(told, angle(x), "")


def stratified(n, sides, rng):
    """Points in a box, one in each cell of a lattice."""
    sides = np.asarray(sides)
    counts = np.maximum(1, np.round(sides * (n / np.prod(sides)) ** (1 / 3))).astype(int)
    cell = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), -1).reshape(-1, 3)
    return (cell + 0.5 + rng.uniform(-0.4, 0.4, cell.shape)) * sides / counts


def speed(sim, ids):
    mass = sim.bodies.mass[ids]
    return math.sqrt(np.sum(mass * np.sum(sim.bodies.velocity[ids, :3] ** 2, 1)) / mass.sum())


def angle(x):
    """Angle [degrees] of the highest bodies in slices of half a metre along x, between a tenth and nine tenths of the top."""
    edges = np.arange(x[:, 0].min(), x[:, 0].max() + 0.5, 0.5)
    tops = np.array([x[(x[:, 0] >= a) & (x[:, 0] < a + 0.5), 2].max(initial=0.0) for a in edges])
    high = np.median(tops[tops > 0.5 * tops.max()])
    on = (tops > 0.1 * high) & (tops < 0.9 * high) & (edges > edges[len(edges) // 2])
    return math.degrees(math.atan(-np.polyfit(edges[on], tops[on], 1)[0])) if on.sum() > 1 else math.nan


# ---------------------------------------------------------------------- masonry


def wall(small, solver, cache=None):
    """A wall of bricks in running bond; a block of the weight of a sixth of the wall is pulled along its top at 5 cm/s."""
    columns, courses = (8, 6) if small else (30, 20)
    brick = (0.3, 0.2, 0.15)
    blocks = masonry.wall(columns * brick[0], courses, brick=brick)
    stone = cn.Material("stone", density=2200.0)
    scene = cn.Scene(3, gravity=(0, 0, -GRAVITY))
    rows = blocks.add_to(scene, stone)
    base = rows[[k for k, p in enumerate(blocks.part) if p == "support"]]
    high, length = courses * brick[2], columns * brick[0]
    side = 0.4
    heavy = 0.15 * length * courses * brick[1] * brick[2] / (0.2 * side * 0.2)
    load = scene.add(cn.boxes([[0.3 * length, 0.1, high + 0.1]], (side, 0.2, 0.2), stone, density=2200.0 * heavy))[0]
    scene.interact("*", "*", cn.Coulomb(mu=0.6))
    sim = cn.Simulation(scene, 1e-3, strategy(solver))
    sim.run(steps=20, progress=False)
    sim.drive([load], "vx", 0.2)
    watch, errors = Watch(sim), []
    for _ in range(300):
        watch.step()
        pair, force = sim.contacts.bodies, sim.contacts.force
        on = np.isin(pair, base).any(1)
        up, at = np.abs(force[on, 2]), sim.contacts.point[on, 0]
        free = ~np.isin(sim.bodies.id, base)
        weight = GRAVITY * sim.bodies.mass[free]
        pull = -force[(pair == load).any(1), 0].sum()
        # moments about the base: weights, and the pull on the load at its centre
        place = (weight @ sim.bodies.position[free, 0] + abs(pull) * sim.bodies.position[load, 2]) / weight.sum()
        errors.append((up.sum() / weight.sum(), (up @ at / up.sum() - place) / length))
    errors = np.array(errors)
    place = np.abs(errors[50:, 1]).max()
    return watch.row(f"reaction over weight (its place within {place:.1e} of the length)", errors[50:, 0].mean(), "1")


def vault(small, solver, cache=None):
    """A semicircular barrel, thickness .15 of its radius, whose right support moves away by a hundredth of the radius."""
    voussoirs, courses = (11, 4) if small else (27, 15)
    blocks = masonry.barrel_vault(2.0 if small else 6.0, courses, radius=3.0, thickness=0.45, voussoirs=voussoirs)
    steps, dt = (150, 4e-3) if small else (300, 4e-3)
    stone = cn.Material("stone", density=2200.0)
    sets, rows = blocks.sets(stone)
    kind = [s.group for s in sets].index("support")
    duration = steps * dt
    motion = loads.displaced((0.03, 0.0, 0.0), duration, ramp=0.2)
    right = np.sign(sets[kind].position[:, :1]) > 0
    sets[kind] = sets[kind].with_(drive=lambda t: np.where(right, np.r_[motion(t), 0.0, 0.0, 0.0], 0.0))
    scene = cn.Scene(3, gravity=(0, 0, -GRAVITY))
    ids = scene.add(*sets)[rows]
    scene.interact("*", "*", cn.Coulomb(mu=0.7))
    sim = cn.Simulation(scene, dt, strategy(solver))
    held = ids[[k for k, p in enumerate(blocks.part) if p == "support"]]
    watch, thrusts = Watch(sim), []
    weight = GRAVITY * sim.bodies.mass[~np.isin(sim.bodies.id, held)].sum()
    for _ in range(steps):
        watch.step()
        thrusts.append(max(np.abs(sim.contacts.force[(sim.contacts.bodies == b).any(1), 0].sum()) for b in held) / weight)
    arch = masonry.arch(radius=3.0, thickness=0.45, voussoirs=voussoirs)
    assembly = limit_analysis.Assembly(arch, 0.7, 2200.0)
    whole = assembly.mass[:voussoirs].sum() * GRAVITY
    least = min(abs(b.multiplier) for b in assembly.force_bounds(voussoirs, (1.0, 0.0))) / whole
    return watch.row("thrust over weight, supports apart", np.median(thrusts[steps // 2 :]), f"{least:.4f}")


def arch(small, solver, cache=None):
    """Blocks of quadrilaterals (20 GPa) on mortar (20 kPa, 2 J/m2) between rigid springers; the right one moves away."""
    voussoirs = 12 if small else 40
    radius, thickness = 3.0, 0.45
    drawing = masonry.arch(radius=radius, thickness=thickness, voussoirs=voussoirs)
    stone = cn.Material("stone", density=2200.0)
    scene = cn.Scene(2, gravity=(0, -GRAVITY))
    steps, dt = (240, 5e-4) if small else (300, 5e-4)
    motion = loads.displaced((1e-3, 0.0), 0.4 * steps * dt, ramp=0.3)
    springers = [k for k, p in enumerate(drawing.part) if p == "support"]
    right = [drawing.vertices[k][:, 0].mean() > 0 for k in springers]
    sides = [cn.polygons([drawing.vertices[k]], stone, fixed=True) for k in springers]
    sides[right.index(True)] = sides[right.index(True)].with_(drive=lambda t: np.r_[motion(t), 0.0])
    held = scene.add(*sides)
    for k, corners in enumerate(drawing.vertices):
        if k not in springers:
            scene.add(cn.deformable(mesh(corners), stone, contact="rim", edges="rim", name=f"block{k}"))
    scene.interact("*", "*", cn.MAL(normal_stiffness=2e10, tangential_stiffness=1e10, mu=0.7, normal_strength=2e4,
                                    tangential_strength=5e4, normal_work=2.0, tangential_work=20.0))  # fmt: skip
    sim = cn.Simulation(scene, dt, strategy(solver))
    watch, thrusts = Watch(sim), []
    assembly = limit_analysis.Assembly(drawing, 0.7, 2200.0)
    weight = assembly.mass[:voussoirs].sum() * GRAVITY
    for _ in range(steps):
        watch.step()
        thrusts.append([np.abs(sim.contacts.force[(sim.contacts.bodies == b).any(1), 0].sum()) / weight for b in held])
    least = min(abs(b.multiplier) for b in assembly.force_bounds(voussoirs, (1.0, 0.0))) / weight
    broken = np.mean(sim.contacts.beta < 0.5)
    thrusts = np.array(thrusts).mean(1)
    told = f"thrust over weight, cracked ({100 * broken:.0f} % of the bonds damaged by half)"
    return watch.row(told, np.mean(thrusts[steps // 2 :]), f"{least:.4f}")


def mesh(corners, along=2, across=4):
    """A block of quadrilaterals; corners: as cairn.pre.masonry draws a voussoir."""
    s, t = np.meshgrid(np.linspace(0, 1, along + 1), np.linspace(0, 1, across + 1), indexing="ij")
    a, b, c, d = corners
    edge = np.linalg.norm(b - a) < np.linalg.norm(c - b)  # along the joint, a to b and d to c
    a, b, c, d = (a, b, c, d) if edge else (b, c, d, a)
    s, t = s[..., None], t[..., None]
    x = (1 - s) * (1 - t) * a + s * (1 - t) * b + s * t * c + (1 - s) * t * d
    k = np.arange(s.size).reshape(s.shape[:2])
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)
    p = x.reshape(-1, 2)
    (ux, uy), (vx, vy) = p[quads[0, 1]] - p[quads[0, 0]], p[quads[0, 2]] - p[quads[0, 0]]
    if ux * vy < uy * vx:
        quads = quads[:, ::-1]
    rim = np.unique(np.r_[k[0], k[-1], k[:, 0], k[:, -1]])
    return cn.ElasticBody(p, {"quad": quads}, young=2e10, poisson=0.2, density=2200.0, plane="stress", groups={"rim": rim})


SCENES = {f.__name__: f for f in (biaxial, box, slope, wall, vault, arch)}


def run(name, size="small", solver="default", **options):
    """Row of a scene by name."""
    row = SCENES[name](size == "small", solver, **options)
    return dict(zip(COLUMNS, [name, size, solver] + [row[c] for c in COLUMNS[3:]]))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", choices=[*SCENES, "all"])
    parser.add_argument("--size", choices=("small", "full"), default="small")
    parser.add_argument("--solver", nargs="+", default=["default"])
    parser.add_argument("--count", type=int, help="rocks of the slope, in the place of 150 or 5,000")
    parser.add_argument("--cache", help="folder that keeps packings")
    parser.add_argument("--output", type=Path, default=RESULTS)
    asked = parser.parse_args()
    for name in SCENES if asked.name == "all" else [asked.name]:
        for solver in asked.solver:
            more = {"count": asked.count} if asked.count else {}
            row = run(name, asked.size, solver, cache=asked.cache, **more)
            fresh = not asked.output.exists()
            with asked.output.open("a", newline="", encoding="utf-8") as file:
                table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
                if fresh:
                    table.writeheader()
                table.writerow(row)
            print("  ".join(f"{k}={v}" for k, v in row.items()), flush=True)


if __name__ == "__main__":
    main()
