"""Small scenes for the tests of simulations: grains that fall into a box whose left wall is driven."""

import cairn as cn
import numpy as np

ROCK = cn.Material("rock", density=2000.0)
SAND = cn.Material("sand", density=1500.0)


def grid(dim, counts, spacing=1.0, seed=5):
    rng = np.random.default_rng(seed)
    places = np.stack(np.meshgrid(*[np.arange(n) for n in counts], indexing="ij"), -1).reshape(-1, dim)
    return spacing * (places + 0.5 + 0.01 * rng.standard_normal(places.shape))


def heap(dim=2, counts=None, law=None, push=None, origin=None):
    """A scene of grains in a box that is open at its top; `push` is what drives the left wall."""
    counts = counts or ((8, 6) if dim == 2 else (4, 4, 3))
    centers = grid(dim, counts)
    rng = np.random.default_rng(11)
    radii = rng.uniform(0.45, 0.49, len(centers))
    velocity = 0.5 * rng.standard_normal((len(centers), 3 * dim - 3))
    scene = cn.Scene(dim, gravity=-9.81 * np.eye(dim)[-1], origin=origin)
    half = len(centers) // 2
    shape = cn.disks if dim == 2 else cn.spheres
    scene.add(shape(centers[:half], radii[:half], ROCK, velocity=velocity[:half], group="below"))
    scene.add(shape(centers[half:], radii[half:], SAND, velocity=velocity[half:]))
    walls = cn.box(np.zeros(dim), np.array(counts, float), ROCK, lid=False)
    walls[0] = cn.wall(np.zeros(dim), np.eye(dim)[0], ROCK, velocity=push)
    scene.add(walls)
    scene.interact("*", "*", law or cn.Coulomb(mu=0.4))
    return scene


def state(sim):
    """Every number that the future depends on, as bytes by name."""
    out = {}

    def walk(name, value):
        if isinstance(value, dict):
            for key, inner in value.items():
                walk(f"{name}/{key}", inner)
        else:
            out[name] = np.asarray(value).tobytes()

    walk("", sim._core.get_state())
    return out


def differing(a, b):
    """Names under which two states differ."""
    return sorted(name for name in a.keys() | b.keys() if a.get(name) != b.get(name))
