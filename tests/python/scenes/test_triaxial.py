"""A small triaxial test under stress control, by NSCD and by smooth DEM from one pack: peaks, volumes, lateral stress."""

import cairn as cn
import numpy as np
import pytest

COUNT, DIAMETER, DENSITY, PRESSURE, MU = 216, 4e-3, 2650.0, 5e4, 0.5
RATE = 3e-3 / (DIAMETER * np.sqrt(DENSITY / PRESSURE))  # inertial number 3e-3 [1/s]
STRAIN, SAMPLES = 0.05, 50


def cell(centers, radii, lengths, law, **driven):
    sand = cn.Material("sand", density=DENSITY)
    scene = cn.Scene(3, gravity=(0, 0, 0), periodic=cn.Periodic(tuple(float(x) for x in lengths), **driven))
    scene.add(cn.spheres(centers, radii, sand))
    scene.interact(sand, sand, law)
    return scene


@pytest.fixture(scope="module")
def pack():
    """Centres, radii and lengths of a dense pack that was pressed without friction."""
    rng = np.random.default_rng(1)
    radii = DIAMETER / 2 * rng.uniform(0.8, 1.2, COUNT)
    edge, pitch = 6, 2.1 * radii.max()
    grid = np.stack(np.meshgrid(*[np.arange(edge)] * 3, indexing="ij"), -1).reshape(-1, 3)
    centers = (grid + 0.5 + rng.uniform(-0.04, 0.04, grid.shape)) * pitch
    sim = cn.Simulation(cell(centers, radii, [edge * pitch] * 3, cn.Coulomb(mu=0.0), stress=PRESSURE), 1e-4)
    sim.run(steps=800, progress=False)
    return sim.bodies.position.copy(), radii, np.diag(sim.cell["vectors"]).copy()


def shear(pack, smooth):
    """Axial over lateral stress (means of 0.5 % of strain), gain of volume, lateral stress over that of the servo."""
    centers, radii, lengths = pack
    spring = cn.LinearSpring(stiffness=1000 * PRESSURE * DIAMETER, restitution=0.3, mu=MU)
    driven = dict(rate={"zz": -RATE}, stress={"xx": PRESSURE, "yy": PRESSURE})
    scene = cell(centers, radii, lengths, spring if smooth else cn.Coulomb(mu=MU), **driven)
    sim = cn.Simulation(scene, "stable" if smooth else 1e-4, cn.SmoothDEM() if smooth else None, overlap="ignore")
    every, rows = max(1, round(STRAIN / SAMPLES / RATE / sim.dt)), []
    for _ in range(SAMPLES):
        stress = np.zeros(3)
        for _ in range(every):
            sim.step()
            stress += np.diag(sim.cell["stress"]) / every
        rows.append((stress[2] / stress[:2].mean(), stress[:2].mean() / PRESSURE))
    ratio, lateral = np.array(rows).T
    volume = np.prod(np.diag(sim.cell["vectors"]) / lengths) - 1
    return np.convolve(ratio, np.ones(5) / 5, "valid"), volume, lateral.mean()


def test_peaks_of_both_strategies(pack):
    """The same peak within 10 %; each with an angle of friction between 26 and 33 degrees (the angle of the contacts is 26.6),
    dilation, and the lateral stress that is asked within 4 %."""
    peaks = []
    for smooth in (False, True):
        ratio, volume, lateral = shear(pack, smooth)
        peaks.append(ratio.max())
        angle = np.degrees(np.arcsin((ratio.max() - 1) / (ratio.max() + 1)))
        assert 26 < angle < 33
        assert 0.01 < volume < 0.06 and abs(lateral - 1) < 0.04
    assert abs(peaks[1] / peaks[0] - 1) < 0.1
