"""Small scenes and cases of benchmarks/policy.py, some for each mechanism of the solvers."""

import cairn as cn
import numpy as np
from auto import cubes, panel, sim_of
from meshes import blocks
from stacks import stack
from sweeps import grains

STONE = cn.Material("stone", density=2500.0)
CORNERS = np.array([[-0.1, -0.02], [0.1, -0.02], [0.1, 0.02], [-0.1, 0.02]])


def bonded(rows=3, columns=24):
    """A cantilever of bonded disks that begins to bend under its weight."""
    r, stiffness = 0.01, 5e10
    x = np.array([[2 * r * i, 2 * r * j] for i in range(columns) for j in range(rows)])
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks(x[:rows], 0.999 * r, STONE, driven=("vx", "vy", "w")), cn.disks(x[rows:], 0.999 * r, STONE))
    law = cn.ParallelBond(normal_stiffness=stiffness, tangential_stiffness=stiffness, mu=0.3, within=3e-3 * r)
    scene.interact(STONE, STONE, law)
    return sim_of(scene, 1e-3, 1.0)


def loaded(rows=8, columns=4):
    """A wall of bonded disks under a heavy block."""
    r, stiffness, lead = 0.01, 5e10, cn.Material("lead", density=1e7)
    x = np.array([[2 * r * i, 2 * r * j] for j in range(rows) for i in range(columns)])
    block = r * np.array([[-4, -1], [4, -1], [4, 1], [-4, 1]])
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks(x, 0.999 * r, STONE), cn.wall((0, -r), (0, 1), STONE))
    scene.add(cn.polygons([block], lead, position=[[3 * r, 2 * r * rows]]))
    law = cn.ParallelBond(normal_stiffness=stiffness, tangential_stiffness=stiffness, mu=0.3, within=3e-3 * r)
    scene.interact(STONE, STONE, law)
    scene.interact(STONE, lead, cn.Coulomb(mu=0.3))
    return sim_of(scene, 1e-3, 1.0)


def ring(count):
    """Bonded disks in a ring, one of which was pushed: its loop carries self-equilibrated impulses."""
    r = 0.05
    angle = 2 * np.pi * np.arange(count) / count
    scene, velocity = cn.Scene(2), np.zeros((count, 3))
    velocity[0, :2] = 0.01, 0.01
    x = r / np.sin(np.pi / count) * np.column_stack([np.cos(angle), np.sin(angle)])
    scene.add(cn.disks(x, r, STONE, velocity=velocity))
    scene.interact(STONE, STONE, cn.Bonded())
    return sim_of(scene, 1e-3)


def mixed(share, count=120):
    """A deposit in the plane, of pentagons by a share and of disks."""
    rng = np.random.default_rng(1)
    radii, angle = rng.uniform(0.005, 0.01, count), np.arange(5) * 2 * np.pi / 5
    width = np.sqrt(np.sum(np.pi * radii**2) / 0.8)
    x, faced = cn.pre.deposit_disks(radii, width), rng.random(count) < share
    corners = np.column_stack((np.cos(angle), np.sin(angle)))
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(cn.disks(x[~faced], radii[~faced], STONE))
    scene.add(cn.polygons([r * corners for r in radii[faced]], STONE, position=x[faced]))
    scene.add(cn.box(np.zeros(2), (width, 2 * width), STONE, lid=False))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    return sim_of(scene, 5e-4)


def clumped(count=60):
    """A deposit of clumps of three disks."""
    rng = np.random.default_rng(1)
    radii = np.full(count, 0.01)
    width = np.sqrt(np.sum(np.pi * radii**2) / 0.8)
    one = cn.pre.clump([[-0.004, -0.003], [0.004, -0.003], [0.0, 0.004]], [0.005] * 3, 2500.0)
    x = cn.pre.deposit_disks(radii, width)
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(cn.clumps(x, one.offsets, one.radii, one.mass, one.inertia, STONE, rotation=rng.uniform(0, 6, count)))
    scene.add(cn.box(np.zeros(2), (width, 2 * width), STONE, lid=False))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    return sim_of(scene, 5e-4)


def linked(links=8):
    """Light bars in a chain of pivots, with one 1e4 times as heavy at its end."""
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    light, heavy = cn.Material("light", density=1.0), cn.Material("heavy", density=1e4)
    bars = list(scene.add(cn.polygons([CORNERS + (0.1 + 0.2 * k, 0.0) for k in range(links)], light)))
    bars.extend(scene.add(cn.polygons([CORNERS + (0.1 + 0.2 * links, 0.0)], heavy)))
    scene.interact("*", "*", None)
    for k, bar in enumerate(bars):
        scene.join(bar, bars[k - 1] if k else None, cn.Pivot(point=(0.2 * k, 0.0)))
    return sim_of(scene, 1e-3)


def glued(dt=2e-6, across=4):
    """Blocks glued by cohesive zones in a wall, the top course pulled away."""
    x = np.array([[i, j] for j in range(across) for i in range(across)]) * 0.1
    square = 0.05 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    scene, top = cn.Scene(2), x[:, 1] > x[:, 1].max() - 0.01
    law = cn.MAL(normal_stiffness=1e12, tangential_stiffness=5e11, mu=0.5, normal_strength=1e6, tangential_strength=1e6,
                 normal_work=20.0, tangential_work=20.0)  # fmt: skip
    scene.add(cn.polygons([square] * int((~top).sum()), STONE, position=x[~top]))
    scene.add(cn.polygons([square] * int(top.sum()), STONE, position=x[top], velocity=[[0.1, 0.3, 0.0]] * int(top.sum())))
    scene.interact("*", "*", law)
    return sim_of(scene, dt)


# name -> (function that makes a simulation, steps that bring it to its state)
SCENES = {
    "disks": (lambda: sim_of(grains(2, 200, 1), 5e-4), 40),
    "3,000 disks": (lambda: sim_of(grains(2, 3000, 1), 5e-4), 5),
    "few disks": (lambda: sim_of(grains(2, 40, 1), 5e-4), 40),
    "90 disks": (lambda: sim_of(grains(2, 90, 1), 5e-4), 40),
    "moving disks": (lambda: sim_of(grains(2, 80, 1, mu=0.1), 5e-4), 5),
    "spheres": (lambda: sim_of(grains(3, 150, 1), 5e-4), 40),
    "60 spheres": (lambda: sim_of(grains(3, 60, 1, mu=0.1), 5e-4), 60),
    "slippery spheres": (lambda: sim_of(grains(3, 100, 1, mu=0.05), 5e-4), 20),
    "settled spheres": (lambda: sim_of(grains(3, 150, 1), 5e-4), 400),
    "settled disks 1e4": (lambda: sim_of(grains(2, 60, 1, ratio=1e4), 5e-4), 400),
    "settled cubes": (lambda: cubes(60, 1), 400),
    "cubes": (lambda: cubes(60, 1), 40),
    "pentagons": (lambda: sim_of(grains(2, 60, 1, shape="faced"), 1e-3), 50),
    "some pentagons": (lambda: mixed(0.4), 40),
    "many pentagons": (lambda: mixed(0.6), 40),
    "clumps": (clumped, 300),
    "disks 70": (lambda: sim_of(grains(2, 150, 1, ratio=20.0), 5e-4), 30),
    "disks 150": (lambda: sim_of(grains(2, 150, 1, ratio=40.0), 5e-4), 30),
    "disks 600": (lambda: sim_of(grains(2, 150, 1, ratio=160.0), 5e-4), 30),
    "disks 1200": (lambda: sim_of(grains(2, 150, 1, ratio=320.0), 5e-4), 30),
    "disks 1e4": (lambda: sim_of(grains(2, 150, 1, ratio=1e4), 5e-4), 30),
    "disks 2^19": (lambda: sim_of(grains(2, 100, 1, ratio=2**17.5), 5e-4), 30),
    "disks 2^20": (lambda: sim_of(grains(2, 100, 1, ratio=2**18.6), 5e-4), 30),
    "2,000 disks 1e4": (lambda: sim_of(grains(2, 2000, 1, ratio=1e4), 5e-4), 2),
    "spheres 1e4": (lambda: sim_of(grains(3, 120, 1, ratio=1e4), 5e-4), 30),
    "falling spheres 1e4": (lambda: sim_of(grains(3, 120, 1, ratio=1e4), 5e-4), 6),
    "spheres 1e3": (lambda: sim_of(grains(3, 60, 1, ratio=1e3), 5e-4), 10),
    "tower": (lambda: stack("boxes", 40, 1.0, cn.Auto())[0], 1),
    "tower 1e6": (lambda: stack("boxes", 20, 1e6, cn.Auto())[0], 1),
    "panel": (lambda: panel(6, 10, 0.35), 1),
    "standing panel": (lambda: panel(4, 5, 0.0), 1),
    "bonded disks": (bonded, 1),
    "bonded wall under lead": (loaded, 0),
    "ring": (lambda: ring(60), 1),
    "few rolling disks": (lambda: sim_of(grains(2, 24, 1, law=cn.Rolling(mu=0.4, rolling=0.1)), 5e-4), 40),
    "chain": (linked, 1),
    "glued blocks": (glued, 1),
    "elastic blocks": (lambda: blocks("Q4 on another", 128), 2),
}


def cases():
    """name -> (scene, settings of its steps, their number), or (scene, tolerance) of a problem."""
    cold = {"warm_start": False}
    step = {
        "disks, NLGS 1e-5": ("disks", {"solver": cn.NLGS(tol=1e-5, max_iter=5000)}, 1),
        "disks, Auto 1e-6": ("disks", {"solver": cn.Auto(tol=1e-6, max_iter=5000)}, 1),
        "3,000 disks, NLGS 1e-3": ("3,000 disks", {"solver": cn.NLGS(tol=1e-3, max_iter=2000)} | cold, 1),
        "disks, plain": ("disks", {"solver": cn.NLGS(tol=1e-4, max_iter=5000, acceleration="none")} | cold, 1),
        "disks, from nothing": ("disks", {"solver": cn.NLGS(tol=1e-4, associated_start=True)} | cold, 1),
        "moving disks, from nothing": ("moving disks", {"solver": cn.NLGS(tol=1e-4, associated_start=True)} | cold, 1),
        "spheres, from nothing": ("spheres", {"solver": cn.NLGS(tol=1e-4, max_iter=4000, associated_start=True)} | cold, 1),
        "moving disks, accuracy": ("moving disks", {"solver": cn.NLGS(tol=1e-3, max_iter=6000), "accuracy": 1e-2}, 1),
        "few disks, accuracy": ("few disks", {"solver": cn.NLGS(tol=1e-4, max_iter=3000), "accuracy": 1e-3} | cold, 1),
        "few disks, accuracy from nothing": (
            "few disks", {"solver": cn.NLGS(tol=1e-4, associated_start=True), "accuracy": 1e-3} | cold, 1,
        ),
        "60 spheres, accuracy": ("60 spheres", {"solver": cn.NLGS(tol=1e-4, max_iter=6000), "accuracy": 1e-3} | cold, 1),
        "slippery spheres, accuracy": ("slippery spheres", {"solver": cn.NLGS(tol=1e-4, max_iter=3000), "accuracy": 1e-4}, 1),
        "cubes, accuracy": ("cubes", {"solver": cn.Auto(tol=1e-4, max_iter=1000), "accuracy": 1e-3} | cold, 1),
        "pentagons, accuracy": ("pentagons", {"solver": cn.NLGS(tol=1e-3, max_iter=2500), "accuracy": 1e-3} | cold, 1),
        "rolling disks, accuracy": (
            "few rolling disks", {"solver": cn.NLGS(tol=1e-3, max_iter=3000), "accuracy": 1e-2} | cold, 1,
        ),
        "spheres, NLGS 1e-4": ("spheres", {"solver": cn.NLGS(tol=1e-4, max_iter=5000)} | cold, 1),
        "spheres, Auto 1e-5": ("spheres", {"solver": cn.Auto(tol=1e-5)}, 1),
        "settled spheres, Auto 1e-5": ("settled spheres", {"solver": cn.Auto(tol=1e-5)}, 3),
        "cubes, NLGS 1e-4": ("cubes", {"solver": cn.NLGS(tol=1e-4, max_iter=300)} | cold, 1),
        "cubes, Auto 1e-4": ("cubes", {"solver": cn.Auto(tol=1e-4)} | cold, 1),
        "cubes, Auto 1e-8": ("cubes", {"solver": cn.Auto(tol=1e-8)}, 3),
        "settled cubes, Auto 1e-6": ("settled cubes", {"solver": cn.Auto(tol=1e-6)}, 5),
        "settled cubes, cold": ("settled cubes", {"solver": cn.Auto(tol=1e-6)} | cold, 1),
        "cubes, pack": ("cubes", {"solver": cn.Auto(tol=1e-6, enough=1e-2, patience=20)} | cold, 2),
        "few disks, pack": ("few disks", {"solver": cn.Auto(tol=1e-7, enough=1e-2, patience=5)}, 4),
        "90 disks, pack": ("90 disks", {"solver": cn.Auto(tol=1e-7, enough=1e-2, patience=5)}, 4),
        "pentagons, Auto 1e-5": ("pentagons", {"solver": cn.Auto(tol=1e-5)}, 3),
        "some pentagons, NLGS 1e-5": ("some pentagons", {"solver": cn.NLGS(tol=1e-5, max_iter=500)} | cold, 1),
        "many pentagons, NLGS 1e-5": ("many pentagons", {"solver": cn.NLGS(tol=1e-5, max_iter=500)} | cold, 1),
        "clumps, pack": ("clumps", {"solver": cn.Auto(tol=1e-9, enough=2e-9, patience=400, max_iter=2000)} | cold, 1),
        "disks 70, Auto 1e-4": ("disks 70", {"solver": cn.Auto(tol=1e-4, max_iter=3000)} | cold, 1),
        "disks 150, Auto 1e-4": ("disks 150", {"solver": cn.Auto(tol=1e-4, max_iter=3000)} | cold, 1),
        "disks 600, NLGS 1e-3": ("disks 600", {"solver": cn.NLGS(tol=1e-3, max_iter=3000)}, 2),
        "disks 1200, NLGS 1e-3": ("disks 1200", {"solver": cn.NLGS(tol=1e-3, max_iter=3000)}, 2),
        "disks 1e4, Auto 1e-4": ("disks 1e4", {"solver": cn.Auto(tol=1e-4, max_iter=3000)} | cold, 1),
        "settled disks 1e4, Auto 1e-6": ("settled disks 1e4", {"solver": cn.Auto(tol=1e-6, max_iter=3000)}, 3),
        "disks 2^19, NLGS 1e-2": ("disks 2^19", {"solver": cn.NLGS(tol=1e-2, max_iter=1000)}, 2),
        "disks 2^20, NLGS 1e-2": ("disks 2^20", {"solver": cn.NLGS(tol=1e-2, max_iter=1000)}, 2),
        "2,000 disks 1e4, Auto 1e-2": ("2,000 disks 1e4", {"solver": cn.Auto(tol=1e-2, max_iter=30)}, 1),
        "spheres 1e4, Auto 1e-2": ("spheres 1e4", {"solver": cn.Auto(tol=1e-2, max_iter=30)}, 1),
        "spheres 1e3, Auto 1e-4": ("spheres 1e3", {"solver": cn.Auto(tol=1e-4)}, 2),
        "tower, Auto 1e-6": ("tower", {"solver": cn.Auto(tol=1e-6)} | cold, 1),
        "tower 1e6, Auto 1e-4": ("tower 1e6", {"solver": cn.Auto(tol=1e-4)}, 2),
        "panel, Auto 1e-5": ("panel", {"solver": cn.Auto(tol=1e-5)} | cold, 2),
        "standing panel, Auto 1e-6": ("standing panel", {"solver": cn.Auto(tol=1e-6)}, 20),
        "standing panel, cold": ("standing panel", {"solver": cn.Auto(tol=1e-6)} | cold, 40),
        "bonded disks, Auto 1e-6": ("bonded disks", {"solver": cn.Auto(tol=1e-6)} | cold, 1),
        "bonded disks, NLGS 1e-3": ("bonded disks", {"solver": cn.NLGS(tol=1e-3, max_iter=3000)}, 1),
        "bonded wall under lead, Auto 1e-5": ("bonded wall under lead", {"solver": cn.Auto(tol=1e-5)}, 5),
        "ring, Auto 1e-5": ("ring", {"solver": cn.Auto(tol=1e-5)}, 5),
        "rolling disks, Auto 1e-4": ("few rolling disks", {"solver": cn.Auto(tol=1e-4, max_iter=5000)} | cold, 1),
        "chain, Auto 1e-4": ("chain", {"solver": cn.Auto(tol=1e-4)}, 10),
        "glued blocks, Auto 1e-5": ("glued blocks", {"solver": cn.Auto(tol=1e-5, max_iter=300)}, 10),
        "elastic blocks, Auto 1e-6": ("elastic blocks", {"solver": cn.Auto(tol=1e-6)} | cold, 1),
    }  # fmt: skip
    problem = {
        f"problem of {name}, {tol:g}": (name, tol)
        for name, tol in (
            ("cubes", 1e-6), ("cubes", 1e-9), ("panel", 1e-6), ("disks 1e4", 1e-6), ("spheres 1e4", 1e-4), ("few disks", 1e-9),
            ("falling spheres 1e4", 1e-4), ("pentagons", 1e-8), ("slippery spheres", 1e-8), ("tower", 1e-6), ("tower 1e6", 1e-4),
        )
    }  # fmt: skip
    return {**step, **problem}


# Cases that take long, and the numbers for which they are run
LONG = {
    "3,000 disks, NLGS 1e-3": ("slow_task_change", "slow_task_share", "slow_task_sweeps"),
    "2,000 disks 1e4, Auto 1e-2": (
        "light_contacts",
        "light_sweeps",
        "light_cost",
        "light_few",
        "light_piles",
        "light_load",
    ),
}
