"""A mesh that touches itself: its arms meet, neighbours do not, and impulses between them are in balance."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1000.0)
GAP = 0.02


def fork(dim=2, **more):
    """Two arms on a back, a slot between them that is a tenth of a cell wide; the upper arm by its group."""
    x, y = np.arange(5) * 0.25, np.concatenate([[0.0, 0.2], 0.2 + GAP + np.array([0.0, 0.2])])
    z = [0.0] if dim == 2 else [0.0, 0.25, 0.5]
    points = np.stack(np.meshgrid(x, y, z, indexing="ij"), -1).reshape(-1, 3)[:, :dim]
    n = np.arange(len(points)).reshape(5, 4, len(z))
    cells = []
    for i in range(4):
        for j in (0, 2) if i else (0, 1, 2):
            for k in range(max(1, len(z) - 1)):
                low = [n[i, j, k], n[i + 1, j, k], n[i + 1, j + 1, k], n[i, j + 1, k]]
                cells.append(low if dim == 2 else low + [m + 1 for m in low])
    kind = "quad" if dim == 2 else "hexahedron"
    groups = {
        "slot": n[:, 1:3].ravel(),
        "upper": n[:, 2:].ravel(),
        "lower": n[:, :2].ravel(),
        "back": n[0].ravel(),
        "tip": n[-1, 3].ravel(),
    }
    given = {"young": 1e5, "poisson": 0.2, "density": 1000.0, "rayleigh": (0.0, 2e-3)} | more
    return cn.ElasticBody(points, {kind: np.array(cells)}, groups=groups, **given)


def closed(dim=2, self_contact=True, mu=0.0, law=None, body=None, theta=0.5, **more):
    """The upper arm is pushed on to the lower one."""
    body = body or fork(dim)
    sides = {"edges": "slot"} if dim == 2 else {"faces": "slot"}
    scene = cn.Scene(dim=dim)
    push = (0.0, -800.0) if dim == 2 else (0.0, -400.0, 0.0)
    held = {"fixed": {"back": "xyz"[:dim]}} | more
    scene.add(cn.deformable(body, ROCK, contact="slot", force={"tip": push}, self_contact=self_contact, **sides, **held))
    scene.interact(ROCK, ROCK, law or cn.GapCoulomb(mu=mu))
    return cn.Simulation(scene, 1e-3, cn.NSCD(theta, cn.Default(tol=1e-12)))


def slot(sim, body):
    """Gap between the two arms at their tips [m]."""
    y = (sim.meshes[0].displacement + body.points)[:, 1]
    at_end = np.isclose(body.points[:, 0], 1.0)
    return y[at_end & np.isclose(body.points[:, 1], 0.2 + GAP)].min() - y[at_end & np.isclose(body.points[:, 1], 0.2)].max()


@pytest.mark.parametrize("dim", [2, 3])
def test_arms_meet_instead_of_passing_through(dim):
    for wanted in (False, True):
        sim = closed(dim, wanted, theta=1.0)
        left, touched, deepest = [], 0, 0.0
        for _ in range(150):
            report = sim.step()
            assert report["status"] == "converged"
            left.append(slot(sim, sim.meshes[0].body))
            deepest = max(deepest, -sim.contacts.gap.min(initial=0.0))
            touched += bool(len(sim.contacts) and sim.contacts.impulse_local[:, 0].max() > 0)
        if not wanted:
            assert min(left) < -0.5 * GAP and not touched
            continue
        assert touched > 10 and deepest < 5e-3 * GAP
        energy = sim.info["energy"]
        assert abs(energy["closure"]) < 1e-12 * energy["in_play"]


def test_what_passes_between_its_sides_has_no_sum():
    """A fork in free flight that is shut by the speed of its arms: its contacts change neither momentum nor, by their moments,
    the angular momentum, and the arms keep apart."""
    body = fork(rayleigh=(0.0, 0.0))
    speed = np.zeros_like(body.points)
    speed[np.intersect1d(body.groups["upper"], np.flatnonzero(body.points[:, 0] > 0.6)), 1] = -4.0
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, ROCK, contact=["lower", "upper"], edges=["lower", "upper"], velocity=speed, self_contact=True))
    scene.interact(ROCK, ROCK, cn.GapCoulomb(mu=0.4))
    sim = cn.Simulation(scene, 5e-4, cn.NSCD(0.5, cn.Default(tol=1e-12)))
    touched, p0 = 0, (body.M @ speed.ravel()).reshape(-1, 2).sum(axis=0)
    for _ in range(80):
        report = sim.step()
        force = sim.meshes[0].contact_force
        touched += bool(np.any(force))
        scale = np.abs(force).sum() + 1e-300
        assert np.abs(force.sum(axis=0)).max() < 1e-13 * scale
        assert report["status"] == "converged"
    assert touched > 3
    p = (body.M @ sim.meshes[0].velocity.ravel()).reshape(-1, 2).sum(axis=0)
    assert np.abs(p - p0).max() < 1e-12 * np.abs(p0).max()


def test_a_body_as_it_was_made_does_not_touch_itself():
    """Neighbours along the surface, and points behind a side through the body, are no contacts."""
    body = fork()
    around = np.unique(body.boundary_edges())
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, ROCK, contact=around, edges=body.boundary_edges(), self_contact=True, displacement=(5.0, 5.0)))
    scene.interact(ROCK, ROCK, cn.GapCoulomb(mu=0.4))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(margin=0.015))
    assert sim.step()["contacts"] == 0
    wide = cn.Simulation(scene, 1e-3, cn.NSCD(margin=0.05))
    wide.step()
    across = wide.contacts.gap
    assert len(across) and across.min() > 0.95 * GAP and across.max() < 1.05 * GAP  # across the slot alone


def test_one_contact_of_a_body_with_itself_takes_one_sweep():
    """W of such a contact includes the coupling of its sides: its local solution is that of the problem."""
    sim = closed()
    found = []
    for _ in range(150):
        report = sim.step()
        pressed = sim.contacts.impulse_local[:, 0] > 0 if len(sim.contacts) else np.zeros(0)
        if report["contacts"] == 1 and pressed.any():
            found.append(report["iterations"])
    assert found and max(found) <= 2


def test_self_contact_keeps_bits_and_goes_on_from_a_checkpoint(tmp_path):
    runs = []
    for stop in (None, 60):
        sim = closed(mu=0.3)
        for k in range(120):
            if k == stop:
                sim.checkpoint(tmp_path / "half")
                sim = closed(mu=0.3)
                sim.restore(tmp_path / "half")
            sim.step()
        runs.append(sim.meshes[0].displacement)
    assert np.array_equal(*runs)


def test_self_contact_without_sides_is_told():
    with pytest.raises(ValueError, match="points and sides of one mesh"):
        cn.deformable(fork(), ROCK, contact="upper", self_contact=True)
