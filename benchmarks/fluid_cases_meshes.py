"""Cases of deformable bodies in a liquid with known numbers; see fluid_cases.py."""

import time

import cairn as cn
import numpy as np
from fluid_scenes import ROCK, advanced, images_of_walls, tank


def _grid8(low, size, many):
    """Points and quad8 cells of a block."""
    (nx, ny), number, points = many, {}, []
    for j in range(2 * ny + 1):
        for i in range(2 * nx + 1):
            if not (i % 2 and j % 2):
                number[i, j] = len(points)
                points.append((low[0] + size[0] * i / (2 * nx), low[1] + size[1] * j / (2 * ny)))
    corners = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    cells = [[number[2 * a + i, 2 * b + j] for i, j in corners] for b in range(ny) for a in range(nx)]
    return np.array(points), {"quad8": np.array(cells)}


def elastic_plate(dx, **form):
    """2 m of water on a clamped plate of aluminium, 1 m x 0.05 m: sag of its middle against the same load on the plate alone, and
    against the slender beam, rho g H L^4 / (384 E' I)."""
    points, cells = _grid8((0.0, -0.05), (1.0, 0.05), (20, 2))
    ends = np.flatnonzero((points[:, 0] < 1e-9) | (points[:, 0] > 1 - 1e-9))
    middle = int(np.argmin(np.abs(points - [0.5, 0.0]).sum(axis=1)))
    metal = cn.Material("metal", density=2700.0)
    elastic = {"young": 67.5e9, "poisson": 0.34, "density": 2700.0, "groups": {"ends": ends}}
    sag = {}
    for what in ("own", "load"):
        options = {"pressure": {"top": 1000 * 9.81 * 2.0}} if what == "load" else {}
        elastic["groups"]["top"] = np.flatnonzero(points[:, 1] > -1e-9)
        alone = cn.Scene(dim=2, gravity=(0.0, -9.81 if what == "own" else 0.0))
        alone.add(cn.deformable(cn.ElasticBody(points, cells, **elastic), metal, fixed={"ends": "xy"}, **options))
        still = cn.Simulation(alone, dt=10.0, strategy=cn.NSCD(theta=1.0))
        for _ in range(3):
            still.step()
        sag[what] = -still.nodes.position[middle, 1]
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    body = cn.ElasticBody(points, cells, rayleigh=(60.0, 0.0), **elastic)
    scene.add(cn.deformable(body, metal, fixed={"ends": "xy"}, name="plate"))
    scene.add(cn.wall((0, 0), (1, 0), ROCK), cn.wall((1, 0), (-1, 0), ROCK))
    scene.add(cn.fluid([(0, 0), (1, 2)], dx, **(form or {"artificial": 0.1})))
    scene.interact("*", "*", None)
    scene.interact("fluid", "*", cn.FreeSlip())
    look = lambda sim: (sim.nodes.position[middle, 1], sim.fluid.forces_on_mesh("plate")[:, 1].sum())  # noqa: E731
    _, seen, cpu, work = advanced(scene, 2e-3 if form else 1e-3, 0.6, look)
    place, force = np.mean(seen[len(seen) // 2 :], axis=0)
    water = -place - sag["own"]
    out = {"weight": abs(force / (-1000 * 9.81 * 2) - 1), "sag": abs(water / sag["load"] - 1)}
    return out | {"sag, slender beam": abs(water / 6.427e-5 - 1)}, cpu, work


def _disk(radius, rings, sectors):
    """Points and cells of a disk."""
    angle = 2 * np.pi * np.arange(sectors) / sectors
    rows = [radius * k / rings * np.stack([np.cos(angle), np.sin(angle)], axis=1) for k in range(1, rings + 1)]
    points, at = np.concatenate([np.zeros((1, 2)), *rows]), np.arange(sectors)
    after = (at + 1) % sectors
    triangles = np.stack([0 * at, 1 + at, 1 + after], axis=1)
    first = 1 + sectors * np.arange(rings - 1)
    quads = [np.stack([k + at, k + sectors + at, k + sectors + after, k + after], axis=1) for k in first]
    return points, {"triangle": triangles, "quad": np.concatenate(quads)}


def released(share):
    """Acceleration of an elastic cylinder of radius 0.5 m, let go from rest in a tank of eight radii: over 0.1 s, against that of
    a rigid one with images of the walls. It is not held before, and particles about it settle in the first steps."""

    def case(dx):
        radius, side, step = 0.5, 4.0, 4e-3
        scene, _ = tank((0, 0), (side, side), side, dx, 9.81, incompressible=True)
        points, cells = _disk(radius, 6, 32)
        body = cn.ElasticBody(points + side / 2, cells, young=1e9, poisson=0.3, density=1000.0 * share)
        scene.add(cn.deformable(body, cn.Material("wood", density=1000.0 * share), name="cylinder"))
        scene.interact("*", "*", None)
        scene.interact("fluid", "*", cn.FreeSlip())
        sim, speed, work, start = cn.Simulation(scene, dt=step, strategy=cn.NSCD(theta=0.6)), [], 0, time.process_time()
        momenta = body.M @ np.tile([0.0, 1.0], len(points))
        for _ in range(25):
            sim.step()
            speed.append(momenta @ np.asarray(sim.nodes.velocity).ravel() / (1000.0 * share * np.pi * radius**2))
            work += len(sim.fluid)
        at = step * np.arange(1, 26)
        walled = (1 - share) / (images_of_walls() + share) * 9.81
        out = {"mean of 0.1 s, images of the walls": np.sum(at * speed) / np.sum(at * at) / walled - 1}
        return out, time.process_time() - start, work

    return case
