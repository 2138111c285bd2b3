"""Two blocks of one neo-Hookean cell, glued at the middle of an edge and torn apart: LMGC90's example 2Q4-traction.

Both in a row are softer, some 1e11 N/m, than any of the zones as it softens, 1e12 and more: at rest the way would jump."""

import cairn as cn
import numpy as np
import pytest

STEEL = cn.Material("steel", density=7800.0)
SPRINGS = dict(normal_stiffness=1e12, tangential_stiffness=1e12, mu=0.1, recovery=1.0)
MODES = dict(normal_strength=3.16227e5, tangential_strength=3.16227e5, normal_work=0.1, tangential_work=0.1)
# law: opening at which it breaks [m]; MAC has no end
LAWS = {
    "MAC": (cn.MAC(**SPRINGS, work=0.1), np.inf),
    "MP3": (cn.MP3(**SPRINGS, strength=3.16227e5, work=0.1), 0.553399e-6),
    "MAL": (cn.MAL(**SPRINGS, **MODES), 0.553399e-6),
    "TH": (cn.TH(**SPRINGS, **MODES, normal_plateau=3.478497e-7, tangential_plateau=3.478497e-7), 0.600834e-6),
    "ABP": (cn.ABP(**SPRINGS, **MODES, normal_end=8e-7, tangential_end=8e-7, first_share=0.5), 0.8e-6),
    "EXPO": (cn.EXPO(**SPRINGS, **MODES, rest=1e-4), 1.772520e-6),
}


def torn(law, step=1e-8, way=2e-6):
    """Opening [m] and tension [Pa] of the one contact in each step until a way, and the released work [J]."""
    scene = cn.Scene(dim=2)
    bulk = cn.NeoHookean(young=2.1e11, poisson=0.3)
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    groups = {"bottom": [0, 1], "top": [2, 3]}
    below, above = (cn.SolidBody(corners + (0.0, y), {"quad": np.array([[0, 1, 2, 3]])}, bulk, density=7800.0, groups=groups,
                                 lumped=True) for y in (0.0, 1.0))  # fmt: skip
    scene.add(cn.deformable(below, STEEL, name="below", edges="top", fixed={"bottom": "xy"}))
    scene.add(cn.deformable(above, STEEL, name="above", points=(np.array([[0, 1]]), np.array([[0.5, 0.5]])), edges="bottom",
                            drive={"top": {"y": 4.5e-2}}, fixed={"top": "x"}))  # fmt: skip
    scene.interact("below edges", "above", law)
    sim = cn.Simulation(scene, step / 4.5e-2, cn.NSCD(theta=0.5, solver=cn.NLGS(tol=1e-10)))
    rows = []
    while not rows or rows[-1][0] < way:
        sim.step()
        assert sim.info["status"] == "converged"
        gap = sim.meshes[1].displacement[[0, 1], 1].mean() - sim.meshes[0].displacement[[2, 3], 1].mean()
        rows.append((gap, -sim.contacts.impulse_local[0, 0] / sim.dt if len(sim.contacts) else 0.0))
        assert sim.steps < 20000
    return np.array(rows), sim


@pytest.mark.parametrize("name", LAWS)
def test_each_law_has_its_peak_its_end_and_its_work(name):
    law, end = LAWS[name]
    rows, sim = torn(law)
    opening, tension = rows.T
    assert tension.max() == pytest.approx(3.16228e5, rel=0.02)
    assert opening[np.argmax(tension)] == pytest.approx(0.316228e-6, rel=0.1) or name == "TH"
    gone = opening > 1.05 * end
    assert np.abs(tension[gone]).max(initial=0.0) < 1e-6 * tension.max()
    spent = 0.1 if np.isfinite(end) else 0.1 * (1 - 0.5 * (0.316228e-6 / opening[-1]) ** 2)
    work = np.sum(0.5 * (tension[1:] + tension[:-1]) * np.diff(opening))
    assert work == pytest.approx(spent, rel=0.02)
    energy = sim.info["energy"]
    assert abs(energy["closure"]) < 1e-6 * energy["in_play"]
