"""Spheres that are poured into a box: the held-out scene of one step, of another dimension and other contacts."""

import cairn as cn
import numpy as np

DT, PREPARE = 1e-3, 0.1  # [s]
RADIUS = 0.01


def build(counts=(4, 4, 6), seed=3, friction=0.3):
    places = np.stack(np.meshgrid(*[np.arange(n) for n in counts], indexing="ij"), -1).reshape(-1, 3) + 0.5
    rng = np.random.default_rng(seed)
    radii = RADIUS * rng.uniform(0.8, 1.0, len(places))
    centers = 2 * RADIUS * (places + 0.04 * rng.uniform(-1, 1, places.shape))
    rock = cn.Material("rock", density=2600.0)
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -9.81))
    scene.add(cn.spheres(centers, radii, rock), cn.box(np.zeros(3), 2 * RADIUS * np.array(counts, float), rock, lid=False))
    scene.interact(rock, rock, cn.Coulomb(mu=friction))
    return scene
