"""A double cantilever opens: beams on a cohesive zone against the table of a finer code, solids against fracture mechanics."""

import cairn as cn
import numpy as np
import pytest

YOUNG, THICK, WIDE, CRACK, LENGTH, WORK = 70e9, 3e-3, 0.01, 0.03, 0.1, 250.0
# opening [mm] and force [N] of Hermite beams, 200 elements, on a triangle of 10 MPa and 50 micrometres, 4e12 Pa/m
PEAK = 54.83
TABLE = {1.3: 50.499, 1.5: 47.009, 2.0: 40.722}


def opened(body, glued, edges, step, dt=5e-6, last=2.0e-3, stiffness=4e12, tol=1e-6, solver=None):
    """One arm, its symmetric half a wall: opening and force after each step, [mm] and [N], and what the last step says."""
    arm, line = cn.Material("arm", density=2700.0), cn.Material("line", density=2700.0)
    scene = cn.Scene(dim=2)
    end = {"end": {"y": step / dt / 2}}
    scene.add(cn.deformable(body, arm, contact=glued, edges=edges, fixed={"along": "x"}, drive=end))
    scene.add(cn.wall((0.0, 0.0), (0.0, 1.0), line))
    half = {"normal_stiffness": 2 * stiffness, "tangential_stiffness": 2 * stiffness}
    scene.interact(arm, line, cn.MAL(**half, normal_strength=10e6, tangential_strength=10e6, normal_work=WORK / 2,
                                     tangential_work=WORK / 2))  # fmt: skip
    sim = cn.Simulation(scene, dt, cn.NSCD(theta=1.0, solver=solver or cn.NLGS(tol=tol, max_iter=5000)))
    out = []
    for _ in range(round(last / step) + 1):
        sim.step()
        assert sim.info["status"] == "converged"
        mesh = sim.meshes[0]
        out.append((2e3 * mesh.displacement[mesh.body_nodes("end")[0], 1], WIDE * mesh.reaction("end")[1]))
    return np.array(out), sim


def near(curve, opening):
    """Mean force within a hundredth of an opening: nodes let go one after the other."""
    return curve[np.abs(curve[:, 0] / opening - 1) < 0.01, 1].mean()


def beams(n):
    """One arm of n cells, and its nodes on the zone."""
    x = np.linspace(0, LENGTH, n + 1)
    glued = np.flatnonzero(x > CRACK - 1e-9)
    points, cells = np.column_stack([x, np.zeros(n + 1)]), np.column_stack([np.arange(n), np.arange(1, n + 1)])
    body = cn.beams(points, cells, young=YOUNG, area=THICK, inertia=THICK**3 / 12, density=2700.0,
                    groups={"end": [0], "along": np.arange(n + 1)})  # fmt: skip
    return body, glued, np.column_stack([glued[:-1], glued[1:]])


def test_beams_meet_the_table_of_a_cohesive_beam():
    curve, sim = opened(*beams(100), 1e-6, last=2.04e-3)
    for opening, force in TABLE.items():
        assert near(curve, opening) == pytest.approx(force, rel=0.02), opening
    assert curve[:, 1].max() == pytest.approx(PEAK, rel=0.04)  # nodes a millimetre apart: a little late
    terms = sim.info["energy"]
    assert abs(terms["closure"]) < 1e-10 * terms["in_play"]
    assert 0 < terms["released"] < 2 * (LENGTH - CRACK) * WORK / 2


def test_long_steps_are_found_by_newtons_method_over_bodies():
    """Sweeps do not from 10 microseconds on, though there is one answer: they leave 130 of these 701 steps."""
    curve, sim = opened(*beams(60), 2e-6, dt=1e-5, last=1.34e-3, solver=cn.Auto(tol=1e-6))
    assert sim.info["solver"] == "newton_over_bodies"
    assert near(curve, 1.3) == pytest.approx(TABLE[1.3], rel=0.02) and curve[:, 1].max() == pytest.approx(PEAK, rel=0.04)
    terms = sim.info["energy"]
    assert abs(terms["closure"]) < 1e-10 * terms["in_play"]


def test_solids_meet_fracture_mechanics_with_the_crack_longer_by_its_root():
    """C = 8 (a + 0.64 h)^3/(E B h^3) before it grows; then P = P0 sqrt(D0/D), from which a + 0.64 h falls out."""
    across, along = 2, 60
    x, y = np.meshgrid(np.linspace(0, LENGTH, 2 * along + 1), np.linspace(0, THICK, 2 * across + 1), indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    corners = [number[:-2:2, :-2:2], number[2::2, :-2:2], number[2::2, 2::2], number[:-2:2, 2::2]]
    middles = [number[1:-1:2, :-2:2], number[2::2, 1:-1:2], number[1:-1:2, 2::2], number[:-2:2, 1:-1:2]]
    cells = np.stack(corners + middles, -1).reshape(-1, 8)
    used = np.unique(cells)
    points, cells = np.column_stack([x.ravel(), y.ravel()])[used], np.searchsorted(used, cells)
    low = np.flatnonzero(points[:, 1] < 1e-9)
    low = low[np.argsort(points[low, 0])]
    glued = low[points[low, 0] > CRACK - 1e-9]
    end = np.flatnonzero((points[:, 0] < 1e-9) & (np.abs(points[:, 1] - THICK / 2) < 1e-9))
    body = cn.ElasticBody(points, {"quad8": cells}, young=YOUNG, poisson=0.3, density=2700.0, plane="stress",
                          groups={"end": end, "along": [int(np.argmax(points @ [1.0, 1.0]))], "glued": glued})  # fmt: skip
    curve, _ = opened(body, glued, "glued", 3e-6, last=1.53e-3, stiffness=1e14)
    start = CRACK + 0.64 * THICK
    early = (curve[:, 0] > 0.1) & (curve[:, 0] < 0.2)
    compliance = 1e-3 * np.polyfit(curve[early, 1], curve[early, 0], 1)[0]
    assert compliance == pytest.approx(8 * start**3 / (YOUNG * WIDE * THICK**3), rel=0.05)
    for opening in (1.3, 1.5):
        assert near(curve, opening) == pytest.approx(66.1438 * np.sqrt(0.755929 / opening), rel=0.05)
