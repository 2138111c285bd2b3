"""Open ends of a liquid: Poiseuille's flow between an inflow and an outflow, balance of mass, restart, threads."""

import os
import subprocess
import sys
import warnings

import cairn as cn
import numpy as np
import pytest
from cairn.run.fluid_gaps import FluidWarning

rock = cn.Material("rock", density=2600.0)
WIDE, SPEED, NU = 1.0, 1.0, 0.1  # of the channel [m], mean [m/s], [m2/s]


def parabola(place):
    y = np.asarray(place)[:, 1] / WIDE
    return np.stack([6 * SPEED * y * (1 - y), 0 * y], axis=1)


def channel(n=10, long=2.0, back=False, start=parabola, **options):
    """Liquid of density 1 between plates 1 m apart, n spacings; it comes from the left, or from the right."""
    dx, sign = WIDE / n, -1.0 if back else 1.0
    buffer = 4 * dx
    scene = cn.Scene(dim=2)
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, WIDE), (0, -1), rock))
    x, y = (a.ravel() for a in np.meshgrid((np.arange(round(long / dx)) + 0.5) * dx, (np.arange(n) + 0.5) * dx, indexing="ij"))
    place = np.stack([x, y], axis=1)
    velocity = lambda p: sign * parabola(p)  # noqa: E731
    pressure = 12 * NU * SPEED / WIDE**2 * (x if back else long - x)
    scene.add(cn.fluid(place, dx, 1.0, NU, 20.0, velocity=sign * start(place), pressure=pressure))
    left, right = [(-buffer, 0), (0, WIDE)], [(long, 0), (long + buffer, WIDE)]
    into, out = (right, left) if back else (left, right)
    scene.add(cn.Inflow(into, velocity), cn.Outflow(out, **options))
    return scene


def uniform(place):
    return np.broadcast_to([SPEED, 0.0], np.shape(place))


@pytest.mark.parametrize("back, start", [(False, parabola), (True, uniform)])
def test_poiseuille_between_open_ends(back, start):
    sim = cn.Simulation(channel(back=back, start=start), dt=0.02)
    sim.run(steps=100, progress=False)
    came, left = (sim.fluid.info[k] for k in ("came_in", "left"))
    speeds, slopes = [], []
    for _ in range(200):
        sim.step()
        x, y = np.array(sim.fluid.position).T
        inside = (x > 0.5) & (x < 1.5)
        u, exact = np.abs(sim.fluid.velocity[inside, 0]), parabola(sim.fluid.position[inside])[:, 0]
        speeds.append(np.sqrt(np.mean((u - exact) ** 2)) / 1.5)
        slopes.append(np.polyfit(x[inside], sim.fluid.pressure[inside], 1)[0])
    assert np.mean(speeds) < 0.02
    assert abs(abs(np.mean(slopes)) / (12 * NU * SPEED) - 1) < 0.1
    assert np.mean(slopes) > 0 if back else np.mean(slopes) < 0
    info, mass = sim.fluid.info, 1.0 / 100
    came, left = info["came_in"] - came, info["left"] - left
    assert abs(came / (SPEED * WIDE * 4.0) - 1) < 0.02
    assert abs(left / came - 1) < 0.02
    begin = len(sim.scene.fluids[0]) + 4 * 10
    assert len(sim.fluid) == begin + round((info["came_in"] - info["left"]) / mass)


def test_an_inflow_fills_a_tank():
    scene = cn.Scene(dim=2, gravity=(0.0, -1.0))
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0), (1, 0), rock), cn.wall((1, 0), (-1, 0), rock))
    scene.add(cn.fluid([(0, 0), (1, 0.3)], 0.05), cn.Inflow([(0.4, 0.6), (0.6, 0.8)], (0.0, -0.5)))
    sim = cn.Simulation(scene, dt=0.01)
    begin = len(sim.fluid)
    sim.run(steps=100, progress=False)
    # four rows, each by 0.5 m/s for 1 s, of which the first particle is half a spacing before its end
    assert len(sim.fluid) - begin == 4 * round(0.5 / 0.05)
    assert abs(sim.fluid.info["came_in"] / (1000.0 * 0.2 * 0.5) - 1) < 1e-9
    assert abs(len(sim.fluid.mass) - len(sim.fluid)) == 0
    inside = np.asarray(sim.fluid.end) == 0
    assert sim.fluid.position[inside, 1].max() < 0.61 and inside.sum() == begin - 16 + 40


def test_a_state_goes_on_with_the_same_bits(tmp_path):
    def make():
        return cn.Simulation(channel(), dt=0.02)

    sim = make()
    sim.run(steps=20, progress=False)
    state = sim.get_state()
    sim.checkpoint(tmp_path / "a.checkpoint.h5")
    sim.run(steps=20, progress=False)
    end = {name: np.array(getattr(sim.fluid, name)) for name in ("position", "velocity", "pressure", "end")}
    other = make()
    other.restore(tmp_path / "a.checkpoint.h5")
    sim.set_state(state)
    for again in (sim, other):
        again.run(steps=20, progress=False)
        for name, values in end.items():
            assert np.array_equal(getattr(again.fluid, name), values), name


def test_a_checkpoint_goes_on_between_the_same_ends_alone(tmp_path):
    def make(velocity, **options):
        scene = cn.Scene(dim=2)
        scene.add(cn.fluid([(0, 0), (1, 1)], 0.1, sound_speed=30.0, **options), cn.Inflow([(-0.4, 0), (0, 1)], velocity))
        return cn.Simulation(scene, dt=0.01)

    sim = make((1, 0))
    sim.step()
    sim.checkpoint(tmp_path / "a.checkpoint.h5")
    make((1, 0)).restore(tmp_path / "a.checkpoint.h5")
    for other in (make((2, 0)), make((1, 0), surface_tension=0.07)):
        with pytest.raises(cn.FileError):
            other.restore(tmp_path / "a.checkpoint.h5")


def test_a_run_holds_as_many_particles_as_there_are(tmp_path):
    sim = cn.Simulation(channel(long=1.0), dt=0.02)
    many = []
    sim.run(steps=40, output=tmp_path / "a.vtkhdf", every=10, progress=False, callback=lambda s: many.append(len(s.fluid)))
    run = cn.load(tmp_path / "a.vtkhdf")
    assert [len(out.fluid) for out in run][1:] == many[9::10]
    assert np.array_equal(run[-1].fluid.end, sim.fluid.end) and np.ptp(run[-1].fluid.end) > 1


@pytest.mark.parametrize("middle, stands", [((-0.25, 0.5), True), ((-0.25, 1.5), False), ((1.5, 0.5), False)])
def test_a_body_in_a_part_of_an_inflow_is_refused(middle, stands):
    """One that fills whole rows or stands elsewhere is not: walls bound inflows."""
    scene = cn.Scene(dim=2)
    scene.add(cn.fluid([(0, 0), (1, 1)], 0.1, sound_speed=30.0), cn.Inflow([(-0.5, 0), (0, 1)], (1.0, 0.0)))
    body = scene.add(cn.disks([middle], 0.12, rock, driven=("vx", "vy", "w")))[0]
    scene.add(cn.polygons([(-0.3, -0.1), (0.3, -0.1), (0.3, 0.1), (-0.3, 0.1)], rock, position=[(-0.3, 0.1)], fixed=True))
    scene.interact("*", "*", None)
    if stands:
        with pytest.raises(ValueError, match=f"body {body} stands in a part of cn.Inflow"):
            cn.Simulation(scene, dt=0.01)
    else:
        assert (np.asarray(cn.Simulation(scene, dt=0.01).fluid.end) > 0).sum() == 8 * 5


def test_liquid_that_stands_in_an_inflow_is_told_once():
    scene = cn.Scene(dim=2)
    x, y = (a.ravel() for a in np.meshgrid(np.arange(-2, 10) * 0.1, np.arange(10) * 0.1 + 0.02, indexing="ij"))
    places = np.stack([x, y], axis=1)
    scene.add(cn.fluid(places, 0.1, sound_speed=30.0), cn.Inflow([(-0.4, 0), (0, 1)], (0.1, 0.0)))
    sim = cn.Simulation(scene, dt=1e-4)
    with pytest.warns(FluidWarning, match="stand in an inflow"):
        sim.step()
    assert 10 <= sim.fluid.info["back_flow"] <= 20  # rows at -0.2, and those at -0.1 that are pressed back
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sim.step()
    free = cn.Simulation(channel(long=1.0), dt=0.02)
    free.step()
    assert free.fluid.info["back_flow"] == 0


THREADS = """
import hashlib, sys
sys.path.insert(0, {folder!r})
from test_fluid_ends import channel
import cairn as cn, numpy as np
sim = cn.Simulation(channel(n=16), dt=0.01)
sim.run(steps=40, progress=False)
print(hashlib.sha1(np.array(sim.fluid.position).tobytes()).hexdigest(), len(sim.fluid))
"""


def test_threads_leave_the_bits():
    bits = []
    for threads in ("1", "3"):
        code = THREADS.format(folder=os.path.dirname(__file__))
        env = {**os.environ, "OMP_NUM_THREADS": threads}
        bits.append(subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True).stdout)
    assert bits[0] == bits[1]


def test_wrong_ends_are_refused():
    with pytest.raises(ValueError, match="lowest corner"):
        cn.Inflow([(1, 0), (0, 1)], (1, 0))
    with pytest.raises(ValueError, match="along an axis"):
        cn.Inflow([(0, 0), (1, 1)], (1, 1))
    with pytest.raises(ValueError, match="along an axis"):
        cn.Outflow([(0, 0), (1, 1)], direction=(0, 0))

    def start(*ends, periodic=None, **options):
        scene = cn.Scene(dim=2, gravity=(0.0, -1.0), periodic=periodic)
        scene.add(cn.wall((0, 0), (0, 1), rock), cn.fluid([(0, 0), (2, 1)], 0.1, **{"sound_speed": 20.0, **options}), *ends)
        return cn.Simulation(scene, dt=1e-2)

    with pytest.raises(ValueError, match="0.2 m long, and particles reach over 0.3 m"):
        start(cn.Inflow([(-0.2, 0), (0, 1)], (1, 0)))
    with pytest.raises(ValueError, match="cn.Outflow is 0.2 m long"):
        start(cn.Outflow([(2, 0), (2.2, 1)]))
    with pytest.raises(ValueError, match="leave out incompressible"):
        start(cn.Inflow([(-0.4, 0), (0, 1)], (1, 0)), incompressible=True)
    with pytest.raises(ValueError, match="axis 0 is periodic"):
        start(cn.Outflow([(2, 0), (2.4, 1)]), periodic=cn.Periodic((4.0, np.inf)))
    with pytest.raises(ValueError, match="both ways"):
        start(cn.Inflow([(-0.4, 0), (0, 1)], lambda x: np.stack([x[:, 1] - 0.5, 0 * x[:, 1]], axis=1)))
    with pytest.raises(ValueError, match="regions that do not overlap"):
        start(cn.Inflow([(-0.2, 0), (0.2, 1)], (1, 0)))
    with pytest.raises(ValueError, match="velocity of cn.Inflow"):
        start(cn.Inflow([(-0.4, 0), (0, 1)], lambda x: np.ones(len(x))))
    with pytest.raises(ValueError, match="give finite numbers"):
        start(cn.Inflow([(-0.4, 0), (0, 1)], lambda x: np.stack([x[:, 1] * np.nan, 0 * x[:, 1]], axis=1)))
    with pytest.raises(ValueError, match="holds the middle of the liquid"):
        start(cn.Outflow([(0.5, 0), (1.5, 1)]))
    alone = cn.Scene(dim=2)
    alone.add(cn.Inflow([(-0.4, 0), (0, 1)], (1, 0)))
    with pytest.raises(ValueError, match="the scene has none: add cn.fluid"):
        cn.Simulation(alone, dt=1e-2)
    sim = start(cn.Inflow([(-0.4, 0), (0, 1)], (15, 0)))
    begin = np.array(sim.fluid.position)
    with pytest.raises(ValueError, match="more than its spacing"):
        sim.step()
    assert np.array_equal(sim.fluid.position, begin) and sim.time == 0  # before the step, not within
    sim.step(1e-4)  # and it goes on
    assert start(cn.Inflow([(-0.4, 0), (0, 1)], (3, 0)), sound_speed=None).fluid.settings["sound_speed"] > 30
    scene = cn.Scene(dim=2, gravity=(0.0, -1.0))
    scene.add(cn.disks([[0.5, 0.5]], 0.02, rock), cn.fluid([(0, 0), (2, 1)], 0.1), cn.Outflow([(2, 0), (2.4, 1)]))
    scene.interact("fluid", rock, cn.GrainDrag())
    with pytest.raises(ValueError, match="grains smaller than a particle do not meet open ends"):
        cn.Simulation(scene, dt=1e-3)


def test_an_inflow_that_leads_away_from_the_liquid_is_refused():
    for sign, region in ((-1, [(-0.4, 0), (0, 1)]), (1, [(2, 0), (2.4, 1)])):
        scene = cn.Scene(dim=2)
        scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 1), (0, -1), rock))
        scene.add(cn.fluid([(0, 0), (2, 1)], 0.1, 1.0, sound_speed=20.0), cn.Inflow(region, (1.0 * sign, 0.0)))
        way = "up" if sign > 0 else "down"
        with pytest.raises(ValueError, match=f"velocity of cn.Inflow leads {way} axis 0, away from the liquid"):
            cn.Simulation(scene, dt=0.02)


@pytest.mark.parametrize(
    "way, region, why",
    [
        ((-1, 0), [(2, 0), (2.4, 1)], "down axis 0, towards the liquid, at"),
        ((0, 1), [(2, 0), (2.4, 1)], "up axis 1, along the side"),
        ((1, 0), [(-0.4, 0), (0, 1)], "up axis 0, towards the liquid, at"),
        ((0, 1), [(0.5, -0.4), (1, 0)], "up axis 1, towards the liquid, at"),
        ((1, 0), [(0.5, -0.4), (1, 0)], "up axis 0, along the side"),
        ((-1, 0), [(3, 0), (3.4, 1)], "down axis 0, towards the liquid, at"),
    ],
)
def test_an_outflow_that_leads_the_wrong_way_is_refused(way, region, why):
    scene = cn.Scene(dim=2)
    scene.add(cn.fluid([(0, 0), (2, 1)], 0.1, 1.0, sound_speed=20.0), cn.Outflow(region, direction=way))
    with pytest.raises(ValueError, match=f"cn.Outflow leads {why}.*give direction away from the liquid"):
        cn.Simulation(scene, dt=0.02)


@pytest.mark.parametrize(
    "way, region",
    [
        ((1, 0), [(2, 0), (2.4, 1)]),
        ((0, -1), [(2.2, 0), (2.6, 1)]),
        ((0, -1), [(0.5, -0.4), (1, 0)]),
        (None, [(1.6, 0), (2.4, 1)]),
    ],
)
def test_an_outflow_that_liquid_can_enter_is_taken(way, region):
    """Also one that it reaches later from above, and one that holds some of it."""
    scene = cn.Scene(dim=2)
    scene.add(cn.fluid([(0, 0), (2, 1)], 0.1, 1.0, sound_speed=20.0), cn.Outflow(region, direction=way))
    assert len(cn.Simulation(scene, dt=0.02).fluid) == 200
