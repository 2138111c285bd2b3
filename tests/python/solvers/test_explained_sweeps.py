"""Statements of explain() on sweeps agree with their iterations and bits."""

import cairn as cn
import numpy as np
import pytest
from test_hints import pack


def said(sim):
    """The way that explain() says the sweeps of the last step go."""
    (line,) = [line for line in sim.explain().split("\n") if line.startswith("Sweeps are")]
    return line.split()[2].strip(",")


def boxes():
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    rock = cn.Material("rock", density=2500.0)
    square = 0.05 * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    places = [(0.1 * i + 0.05 * (j % 2), 0.05 + 0.1 * j) for j in range(8) for i in range(8)]
    scene.add(cn.polygons([square + place for place in places], rock), cn.wall((0.0, 0.0), (0.0, 1.0), rock))
    scene.add(cn.wall((-0.05, 0.0), (1.0, 0.0), rock, velocity=(0.05, 0.0)))
    scene.interact("*", "*", cn.Coulomb(mu=0.6))
    return cn.Simulation(scene, 1e-3, overlap="ignore")


def uneven():
    return cn.Simulation(pack(2, 60, heavy=True, density=2500.0e7), 5e-4, overlap="ignore")


def grains():
    return cn.Simulation(pack(2, 400), 5e-4, overlap="ignore")


def on_a_bed():
    """A row of disks on the edges of a soft bed, which stands on a floor by its nodes."""
    x, y = np.linspace(0.0, 1.0, 11), (0.0, 0.1)
    points = np.array([(a, b) for b in y for a in x])
    cells = {"quad": np.array([(i, i + 1, i + 12, i + 11) for i in range(10)])}
    body = cn.ElasticBody(points, cells, young=1e6, poisson=0.3, density=1200.0, groups={"bottom": np.arange(11)})
    rock, rubber = cn.Material("rock", density=2500.0), cn.Material("rubber", density=1200.0)
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    top = np.column_stack([np.arange(11, 21), np.arange(12, 22)])
    places = [(0.06 + 0.078 * i, 0.138) for i in range(12)]
    scene.add(*cn.deformable(body, rubber, edges=top, fixed={"bottom": "xy"}), cn.disks(places, 0.04, rock))
    scene.add(cn.box((0.0, 0.0), (1.1, 1.0), rock, lid=False))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    return cn.Simulation(scene, 1e-3, overlap="ignore")


def stepped(sim, state, solver):
    """Iterations and bits of one step without memory of impulses."""
    sim.set_state(state)
    sim.strategy = cn.NSCD(solver=solver, warm_start=False, threads=1)
    info = sim.step()
    return info["iterations"], np.array(sim.bodies.velocity).tobytes()


@pytest.mark.parametrize("make, way, why", [
    (grains, "extrapolated", "masses differ by"), (boxes, "plain", "100% of the contacts"),
    (uneven, "plain", "light bodies feel"), (on_a_bed, "plain", "meshes swept in turn"),
])  # fmt: skip
def test_sweeps_go_as_they_are_said_to(make, way, why):
    sim = make()
    options = {"tol": 1e-9, "max_iter": 60}
    sim.strategy = cn.NSCD(solver=cn.NLGS(**options), threads=1)
    for _ in range(15):
        sim.step()
    state = sim.get_state()
    found = stepped(sim, state, cn.NLGS(**options))
    assert said(sim) == way and why in sim.explain()
    plain = stepped(sim, state, cn.NLGS(**options, acceleration="none"))
    assert said(sim) == "plain"
    assert (found == plain) == (way == "plain")  # sweeps reported as plain have the bits of plain sweeps


def test_those_of_auto_are_extrapolated_as_those_of_nlgs():
    sim = grains()
    for _ in range(10):
        sim.step()
    state = sim.get_state()
    options = {"tol": 1e-5, "max_iter": 40}  # too few for Newton's method to pay
    auto = stepped(sim, state, cn.Auto(**options))
    assert said(sim) == "extrapolated" and "Newton's method takes over" in sim.explain()
    assert auto == stepped(sim, state, cn.NLGS(**options)) != stepped(sim, state, cn.NLGS(**options, acceleration="none"))


def test_before_a_step_both_are_said():
    sim = grains()
    assert said(sim) == "extrapolated" and "No contacts are known yet" in sim.explain() and "1,048,576" in sim.explain()


def test_accuracy_is_told():
    sim = grains()
    assert "Accuracy of velocities is not asked for" in sim.explain()
    sim.strategy = cn.NSCD(accuracy=1e-3)
    assert "Accuracy 0.001 of velocities" in sim.explain() and "velocity_error" in sim.explain()
    sim.strategy = cn.NSCD(solver=cn.PPANewton())
    assert "Sweeps" not in sim.explain()
