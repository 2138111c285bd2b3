"""Blocks of cells as bodies: elastic ones with named sides, and solids that fall on a plane."""

import cairn as cn
import numpy as np
from cairn import SolidBody
from second_order import box


def block(cells, corner, size=(1.0, 0.5), turn=0.0, **more):
    """An elastic body of quadrilaterals in the plane whose groups are its sides; corner is its lower left one [m]."""
    x, y = (np.linspace(0.0, s, n + 1) for s, n in zip(size, cells))
    points = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2) + corner
    points = points @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    k = np.arange(len(points)).reshape(cells[0] + 1, cells[1] + 1)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)
    groups = {"top": k[:, -1], "bottom": k[:, 0], "left": k[0], "right": k[-1]}
    given = {"young": 1e6, "poisson": 0.3, "density": 1000.0, "plane": "stress"} | more
    return cn.ElasticBody(points, {"quad": quads}, groups=groups, **given)


def dropped(dim, material, *, height=0.02, counts=3, kind=None, dt=1e-3, speed=0.0, strategy=None, **options):
    """A block above a plane, under gravity."""
    kind = kind or ("quad" if dim == 2 else "hexahedron")
    points, cells = box(kind, (counts,) * dim, (1.0,) * dim)
    points[:, -1] += height
    body = SolidBody(points, cells, material, density=1000.0, **options)
    rock = cn.Material("rock", density=2500.0)
    down = np.zeros(dim)
    down[-1] = -10.0
    scene = cn.Scene(dim=dim, gravity=down)
    velocity = np.zeros(dim)
    velocity[-1] = -speed
    scene.add(cn.deformable(body, rock, contact=np.arange(len(points)), velocity=velocity))
    scene.add(cn.wall((0.0,) * dim, tuple(-down / 10.0), rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, dt=dt, strategy=strategy or cn.NSCD(solver=cn.NLGS(tol=1e-10)))
