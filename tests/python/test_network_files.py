"""Networks in scene files, restarts and beside shadows."""

import cairn as cn
import numpy as np
import pytest

N = cn.networks
R = 1e-3


def everything():
    hot = N.OfTemperature((300.0, 600.0), (50.0, 40.0))
    steel = cn.Material("steel", density=7800.0, young=210e9, poisson=0.3, resistivity=1.7e-7, conductivity=hot, capacity=460.0,
                        expansion=1.2e-5, latent=(1e4, 900.0, 950.0))  # fmt: skip
    scene = cn.Scene(3, gravity=(0.0, 0.0, -9.81))
    rng = np.random.default_rng(3)
    place = np.array([[2.001 * R * i, 2.001 * R * j, R + 2.001 * R * k] for k in range(3) for j in range(2) for i in range(2)])
    scene.add(cn.spheres(place + rng.uniform(-1e-6, 1e-6, place.shape), R, steel, group="grains"))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), steel, group="floor"))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    top = np.array([8, 9, 10, 11])
    scene.electrical(
        conductance=[N.Holm(), N.Sharvin(free_path=4e-8)], film=N.OxideFilm(conductance=1e-3, power=1e-6),
        current=[(top, cn.Harmonic(0.01, 50.0)), ("floor", cn.Harmonic(-0.01, 50.0))], wires=[(0, 5, 1.0)],
    )  # fmt: skip
    table = N.Given(pressures=[0.0, 1e6], gaps=[0.0, 1e-6], h=[[1.0, 2.0], [3.0, 4.0]], area=1e-6)
    scene.thermal(conductance=[N.Holm(), table], initial={"grains": 350.0, "floor": 300.0}, theta=0.5,
                  convection=[("grains", 20.0, None, 290.0)], radiation=[("grains", 0.5, None, cn.Harmonic(5.0, 3.0, 290.0))],
                  friction="effusivity")  # fmt: skip
    return scene


def test_a_scene_file_has_its_networks(tmp_path):
    scene = everything()
    scene.save(tmp_path / "s.scene.h5")
    again = cn.Scene.load(tmp_path / "s.scene.h5")
    sims = [cn.Simulation(s, 1e-4, overlap="ignore") for s in (scene, again)]
    for sim in sims:
        for _ in range(5):
            sim.step()
    for field in ("temperature", "potential", "position"):
        assert getattr(sims[0].bodies, field).tobytes() == getattr(sims[1].bodies, field).tobytes()
    assert again.rules[0][2] == scene.rules[0][2]
    scene.thermal(power={"grains": lambda t: t})
    with pytest.raises(ValueError, match="Python function"):
        scene.save(tmp_path / "t.scene.h5")


def test_everything_restarts_to_the_same_bits_and_bears_a_shadow(tmp_path):
    one, other, watched = (cn.Simulation(everything(), 1e-4, overlap="ignore") for _ in range(3))
    shadow = watched.shadow("compute_free_velocity", tol=1e-9, folder=tmp_path)
    for _ in range(4):
        one.step()
    one.checkpoint(tmp_path / "c.h5")
    other.restore(tmp_path / "c.h5")
    for _ in range(4):
        one.step()
        other.step()
    for _ in range(8):
        watched.step()
    for sim in (other, watched):
        for field in ("temperature", "potential", "position"):
            assert getattr(one.bodies, field).tobytes() == getattr(sim.bodies, field).tobytes()
        assert one.info["electrical"]["balance"] == sim.info["electrical"]["balance"]
        assert one.info["thermal"]["balance"] == sim.info["thermal"]["balance"]
    assert len(shadow.records) == 8 and shadow.beyond is None
