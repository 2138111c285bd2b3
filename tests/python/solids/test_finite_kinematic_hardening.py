"""Kinematic hardening at large strains: the flow rule by matrix functions of scipy, closed forms, frames, energy, extremes."""

import math

import cairn as cn
import numpy as np
import pytest
from cairn import FiniteJ2, SolidBody, _core
from scipy import sparse
from scipy.linalg import expm, logm, sqrtm
from second_order import box

NAMES = next([p[0] for p in d["parameters"]] for d in _core.bulk_materials() if d["name"] == "finite_j2")
SWIFT = dict(young=3.0, poisson=0.3, yield_stress=0.05, isotropic=0.1, kinematic=0.2, swift_strain=0.1, swift_power=0.4)
PLAIN = dict(young=3.0, poisson=0.3, yield_stress=0.05, isotropic=0.0, kinematic=0.2)
STIFF = dict(young=3.0, poisson=0.3, yield_stress=0.05, isotropic=-0.02, kinematic=5.0)
STEEL = dict(young=200e9, poisson=0.3, yield_stress=250e6, isotropic=0.0, kinematic=10e9)


def values(law):
    return [law.get(n, {"swift_strain": 1.0}.get(n, 0.0)) for n in NAMES]


def at(law, h, state=None, name="finite_j2"):
    """The kernel at points; h (n, 3, 3) is F - 1, of small strains (n, 6)."""
    rows = np.asarray(h, float)
    rows = np.ascontiguousarray(np.swapaxes(rows, 1, 2).reshape(len(rows), 9) if rows.ndim == 3 else rows)
    states = 7 if name == "finite_j2" else 13
    found = _core.bulk_points(name, values(law), rows, np.zeros((len(rows), states)) if state is None else state, 1.0, 1.0, 1.0)
    if rows.shape[1] == 9:
        found["piola"] = np.swapaxes(found["stress"].reshape(-1, 3, 3), 1, 2)
    return found


def some(n, size, seed=5):
    return size * (np.random.default_rng(seed).random((n, 3, 3)) - 0.5)


def rotation(seed):
    q = np.linalg.qr(np.random.default_rng(seed).random((3, 3)))[0]
    return q * np.sign(np.linalg.det(q))


def tensor(v):
    return np.array([[v[0], v[3], v[5]], [v[3], v[1], v[4]], [v[5], v[4], v[2]]])


def moduli(law):
    return law["young"] / (2 * (1 + law["poisson"])), law["young"] / (3 * (1 - 2 * law["poisson"]))


@pytest.mark.parametrize("law", [SWIFT, PLAIN, STIFF])
def test_tangents_are_the_differences_of_the_stress(law):
    """From states with a history, on, turned aside, and back; nearly equal stretches among them."""
    h = some(24, 0.3)
    h[0], h[1], h[2] = np.diag([0.2, 0.2, -0.1]), np.diag([0.2, 0.2 + 1e-9, 0.2]), np.diag([0.1, -0.05, -0.05])
    state = at(law, h)["state"]
    for now in (1.3 * h, h + some(24, 0.2, 6), -0.5 * h, h + some(24, 1e-3, 7)):
        here = at(law, now, state)
        assert not here["status"].any()
        tangent = here["tangent"]
        for k in range(9):
            change = np.zeros((len(h), 9))
            change[:, k] = 1e-6
            change = np.swapaxes(change.reshape(-1, 3, 3), 1, 2)
            by_difference = (at(law, now + change, state)["stress"] - at(law, now - change, state)["stress"]) / 2e-6
            assert np.abs(by_difference - tangent[:, k]).max() < 1e-6 * np.abs(tangent).max()
        assert np.abs(tangent - np.swapaxes(tangent, 1, 2)).max() < 1e-12 * np.abs(tangent).max()


@pytest.mark.parametrize("law", [SWIFT, PLAIN, STIFF])
def test_the_flow_rule_and_the_stress_by_matrix_functions(law):
    """Fp = exp(D) Up: dev(M) - 2/3 H ln Vp = sqrt(2/3) sigma_y D/|D|, P = 2 F dW/dC, the stored energy, all from C and Fp'Fp."""
    shear, bulk = moduli(law)
    h = some(12, 0.5)
    first = at(law, h)
    now = h + some(12, 0.4, 8)
    then = at(law, now, first["state"])
    for p in range(len(h)):
        up = np.linalg.inv(sqrtm(np.eye(3) + tensor(first["state"][p])))
        inverse = np.eye(3) + tensor(then["state"][p])
        flow = logm(up @ inverse @ up) / -2
        plastic = expm(flow) @ up
        f = np.eye(3) + now[p]
        elastic = f @ np.linalg.inv(plastic)
        strain = logm(elastic.T @ elastic) / 2
        deviator = strain - np.trace(strain) / 3 * np.eye(3)
        back = 2 / 3 * law["kinematic"] * logm(plastic @ plastic.T) / 2
        accumulated = then["state"][p, 6]
        assert accumulated - first["state"][p, 6] == pytest.approx(np.sqrt(2 / 3) * np.linalg.norm(flow), rel=1e-9)
        swift = (1 + accumulated / law.get("swift_strain", 1.0)) ** law.get("swift_power", 0.0)
        strength = law["yield_stress"] * swift + law["isotropic"] * accumulated
        wanted = np.sqrt(2 / 3) * strength * flow / np.linalg.norm(flow)
        assert np.abs(2 * shear * deviator - back - wanted).max() < 1e-9 * np.abs(2 * shear * deviator).max()
        mandel = bulk * np.trace(strain) * np.eye(3) + 2 * shear * deviator
        second = np.linalg.inv(plastic) @ np.linalg.inv(elastic.T @ elastic) @ mandel @ np.linalg.inv(plastic).T
        assert np.abs(then["piola"][p] - f @ second).max() < 1e-11 * np.abs(then["piola"][p]).max()
        stored = bulk / 2 * np.trace(strain) ** 2 + shear * np.sum(deviator**2) + 0.75 / law["kinematic"] * np.sum(back**2)
        n, e0 = law.get("swift_power", 0.0), law.get("swift_strain", 1.0)
        grown = e0 * ((1 + accumulated / e0) ** (n + 1) - 1) / (n + 1) - accumulated
        stored += law["yield_stress"] * grown + law["isotropic"] / 2 * accumulated**2
        assert then["energy"][p] == pytest.approx(stored, rel=1e-10)


def test_without_a_modulus_it_is_the_radial_return():
    """Two ways to the same: the return along axes that stay, and that about a back stress of next to nothing."""
    h = some(50, 0.4)
    none = {**SWIFT, "kinematic": 0.0}
    states, stresses = [None, None], []
    for k in (1, 2, -1):
        found = [at(law, k / 2 * h, s) for law, s in zip((none, {**SWIFT, "kinematic": 1e-12}), states)]
        states = [r["state"] for r in found]
        for what in ("stress", "tangent", "energy", "state", "dissipated"):
            assert np.allclose(found[0][what], found[1][what], rtol=0, atol=1e-10 * np.abs(found[0][what]).max()), (k, what)
        stresses.append(found[0]["stress"])
    assert FiniteJ2(young=1.0, yield_stress=1.0, kinematic=2.0).state == FiniteJ2(young=1.0, yield_stress=1.0).state
    assert np.abs(stresses[0]).max() > 0.02


def test_rotations_during_loading_turn_the_stress_alone():
    h = some(20, 0.4)
    one = two = None
    for k in range(1, 8):
        share = math.sin(k)
        f = np.eye(3) + share * h + 0.3 * math.sin(2 * k) * some(20, 0.4, 11)
        q = rotation(k)
        a, b = at(SWIFT, f - np.eye(3), one), at(SWIFT, q @ f - np.eye(3), two)
        one, two = a["state"], b["state"]
        assert np.abs(b["piola"] - q @ a["piola"]).max() < 1e-12 * np.abs(a["piola"]).max()
        assert np.abs(one - two).max() < 1e-12
        assert np.allclose(a["energy"], b["energy"], rtol=1e-12) and np.allclose(a["dissipated"], b["dissipated"], rtol=1e-10)
    assert one[:, 6].min() > 0.1
    # a turn alone, of the body as it is, gives no flow
    f = np.eye(3) + math.sin(7) * h + 0.3 * math.sin(14) * some(20, 0.4, 11)
    again = at(SWIFT, rotation(30) @ f - np.eye(3), one)
    assert np.abs(again["state"] - one).max() < 1e-13


def test_small_strains_are_those_of_the_law_of_small_strains():
    """Loaded, turned aside and back with 1.5 times the yield strain: differences are of the order of the strain."""
    left = []
    for size in (1e-3, 1e-4, 1e-5):
        law = {**PLAIN, "isotropic": 0.1, "yield_stress": 0.3 * size}
        one = two = None
        worst = 0.0
        for k in range(6):
            h = some(30, 2 * size, k)
            a = at(law, h, one)
            e = (h + np.swapaxes(h, 1, 2)) / 2
            strain = np.stack([e[:, 0, 0], e[:, 1, 1], e[:, 2, 2], 2 * e[:, 0, 1], 2 * e[:, 1, 2], 2 * e[:, 0, 2]], 1)
            b = at(law, strain, two, "j2_plasticity")
            one, two = a["state"], b["state"]
            worst = max(worst, np.abs(a["piola"] - np.array([tensor(s) for s in b["stress"]])).max() / np.abs(b["stress"]).max())
        left.append(worst)
        assert one[:, 6].min() > 0.5 * size
    assert left[0] < 20e-3
    assert left[0] / left[1] == pytest.approx(10.0, rel=0.2) and left[1] / left[2] == pytest.approx(10.0, rel=0.2)


def uniaxial(law, strains):
    """Kirchhoff's stress along the first axis for logarithmic strains along it, none across."""
    state, across, out = None, 0.0, []
    for e in strains:
        for _ in range(60):
            r = at(law, [np.diag(np.expm1([e, across, across]))], state)
            stretch, p, t = math.exp(across), r["stress"][0, 4], r["tangent"][0]
            if abs(p * stretch) < 1e-11 * law["yield_stress"]:
                break
            across -= p / (p + stretch * (t[4, 4] + t[4, 8]))  # of Kirchhoff's stress by the logarithm
        state = r["state"]
        out.append(r["stress"][0, 0] * math.exp(e))
    return np.array(out), r


def test_uniaxial_closed_forms_there_and_back():
    """E 200e9, yield 250e6, H 10e9: sigma = sigma_y + H ep on logarithmic strains, reverse yield at sigma - 2 sigma_y, cycles."""
    young, yields, hard = 200e9, 250e6, 10e9
    slope = young * hard / (young + hard)

    def on(strain):
        return yields + slope * (strain - yields / young)

    for top in (0.01, 0.3, 1.5):
        stress, r = uniaxial(STEEL, [0.4 * top, top])
        assert stress[1] == pytest.approx(on(top), rel=1e-9)
        plastic = top - stress[1] / young
        assert r["state"][0, 6] == pytest.approx(plastic, rel=1e-8)
        stored = stress[1] ** 2 / (2 * young) + hard / 2 * plastic**2
        assert r["energy"][0] == pytest.approx(stored, rel=1e-8)
        turn = top - 2 * yields / young
        edge, r = uniaxial(STEEL, [top, turn * (1 + 1e-9)])
        assert edge[1] == pytest.approx(on(top) - 2 * yields + 1e-9 * turn * young, abs=1e-7 * yields)
        assert r["state"][0, 6] == pytest.approx(plastic, rel=1e-8) and r["dissipated"][0] == 0
        beyond, r = uniaxial(STEEL, [top, turn - 0.01])
        assert beyond[1] == pytest.approx(on(top) - 2 * yields - 0.01 * slope, rel=1e-8, abs=1e-8 * yields)
        assert r["dissipated"][0] > 0
    cycles, _ = uniaxial(STEEL, [0.05, -0.05] * 4)
    assert np.allclose(cycles[::2], on(0.05), rtol=1e-9)
    assert np.allclose(cycles[1::2], on(0.05) - 2 * yields - slope * (0.1 - 2 * yields / young), rtol=1e-8)
    small, _ = uniaxial(STEEL, [0.01, 0.0])
    assert small[0] == pytest.approx(333.333333e6, rel=1e-6) and small[1] == pytest.approx(-238.095238e6, rel=1e-6)


def sheared(law, steps, most):
    state, out = None, []
    for k in range(1, steps + 1):
        h = np.zeros((1, 3, 3))
        h[0, 0, 1] = most * k / steps
        r = at(law, h, state)
        state = r["state"]
        out.append(r["piola"][0] @ (np.eye(3) + h[0]).T)
    return np.array(out), np.arange(1, steps + 1) * most / steps, state


def test_simple_shear_has_one_crest_and_no_waves():
    """Where elastic strains are small, Fp = F: tau = sigma_y/sqrt 3 + 2/3 H arsinh(g/2)/sqrt(1 + g^2/4), the largest at
    g = 3.018, and normal stresses of 2/3 H arsinh(g/2) (g/2)/sqrt(1 + g^2/4)."""
    law = dict(young=1e5, poisson=0.3, yield_stress=1.0, kinematic=1.0)
    left = []
    for steps in (300, 600):
        tau, g, state = sheared(law, steps, 12.0)
        share = 2 / 3 * np.arcsinh(g / 2) / np.sqrt(1 + g**2 / 4)
        shear, normal = 1 / np.sqrt(3) + share, share * g / 2
        late = g > 0.5
        left.append([np.abs(tau[:, 0, 1] - shear)[late].max(), np.abs(tau[:, 0, 0] - normal).max()])
        assert np.allclose(tau[:, 0, 0], -tau[:, 1, 1], rtol=0, atol=1e-3)
        slope = np.sign(np.diff(tau[:, 0, 1][late]))
        assert (slope[1:] != slope[:-1]).sum() == 1
        assert g[np.argmax(tau[:, 0, 1])] == pytest.approx(3.018, abs=0.05)
        assert state[0, 6] == pytest.approx(12 / np.sqrt(3), rel=2e-3)
    assert left[1][0] < 2e-4 and left[1][1] < 7e-3
    assert left[0][1] / left[1][1] == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize("law", [SWIFT, PLAIN])
def test_work_is_what_is_stored_and_what_is_dissipated(law):
    """Along a closed way that turns its axes, back to F = 1; the error falls with the step."""
    ends = some(6, 0.5), some(6, 0.5, 9)
    errors = []
    for steps in (500, 2000):
        state, work, spent, last, stress = None, 0.0, 0.0, np.zeros((6, 3, 3)), np.zeros((6, 3, 3))
        for k in range(1, 2 * steps + 1):
            angle = np.pi * k / steps
            h = np.sin(angle) * ends[0] + (1 - np.cos(angle)) / 2 * ends[1]
            r = at(law, h, state)
            assert (r["dissipated"] >= 0).all()
            work = work + np.sum((r["piola"] + stress) / 2 * (h - last), axis=(1, 2))
            state, spent, last, stress = r["state"], spent + r["dissipated"], h, r["piola"]
        errors.append(np.abs(work - r["energy"] - spent).max() / np.abs(work).max())
        assert np.all(work > 0) and np.all(spent > 0.1 * work)
    assert errors[1] < 2e-3 and errors[1] < 0.4 * errors[0]


@pytest.mark.parametrize("law", [PLAIN, SWIFT, STIFF, STEEL, {**PLAIN, "yield_stress": 1e-4}])
def test_steps_of_any_size_are_answered(law):
    """Increments from zero and 1e-18 to several times the body, from states that have flowed: no failure, no flow of negative
    dissipation."""
    rng = np.random.default_rng(3)
    f, state, law = np.tile(np.eye(3), (300, 1, 1)), None, {**law, "isotropic": max(0.0, law["isotropic"])}
    for k in range(30):
        step = 10.0 ** rng.uniform(-18, -1, (300, 1, 1)) * (k % 3 > 0)
        f = (np.eye(3) + step * (rng.random((300, 3, 3)) - 0.5)) @ f
        r = at(law, f - np.eye(3), state)
        assert not r["status"].any() and (r["dissipated"] >= 0).all() and np.isfinite(r["tangent"]).all()
        state = r["state"]
    for size in (1.0, 5.0, 20.0):
        h = some(300, size, 4)
        fit = np.linalg.det(np.eye(3) + h) > 0
        r = at(law, h[fit], state[fit])
        assert not r["status"].any() and (r["dissipated"] > 0).all() and np.isfinite(r["tangent"]).all()
        inverse = np.array([np.eye(3) + tensor(s) for s in r["state"]])
        assert np.allclose(np.linalg.det(inverse), 1.0, rtol=1e-6)


def test_extremes_of_moduli_and_gradients():
    h = some(20, 0.1)
    elastic = at({**PLAIN, "yield_stress": 1e300}, h)["stress"]
    for hard in (1e10, 1e20, 1e100, 1e300):  # flows no more
        first = at({**PLAIN, "kinematic": hard}, h)
        back = at({**PLAIN, "kinematic": hard}, -h, first["state"])
        assert not first["status"].any() and not back["status"].any()
        assert np.allclose(first["stress"], elastic, rtol=0, atol=1e-9)
        assert np.all(first["state"][:, 6] > 0)
    soft = {**PLAIN, "young": 3e-290, "yield_stress": 5e-292, "kinematic": 1e300}  # a flow below the smallest number
    assert np.all(at(soft, h)["status"] == 2)
    for bad, status in ((np.nan, 1), (np.inf, 2), (-3.0, 1), (1e160, 2)):
        r = at(PLAIN, [np.diag([bad, 0.0, 0.0])])
        assert r["status"][0] == status and np.isfinite(r["stress"]).all()
    softening = at({**PLAIN, "isotropic": -0.1}, [np.diag([3.0, 0.0, 0.0])])
    assert softening["status"][0] == 4
    for value in (-1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="kinematic of FiniteJ2 is .*: give a "):
            FiniteJ2(young=1.0, yield_stress=1.0, kinematic=value)


@pytest.mark.parametrize("hard", [0.0, 0.2])
@pytest.mark.parametrize("name", ["finite_j2", "j2_plasticity"])
def test_a_unit_of_stress_changes_no_digit(name, hard):
    """All moduli times powers of two, as far as numbers reach."""
    h = some(20, 0.1) if name == "finite_j2" else some(20, 0.1).reshape(20, 9)[:, :6]
    law = {**PLAIN, "isotropic": 0.1, "kinematic": hard}
    one = at(law, h, None, name)
    assert one["dissipated"].max() > 0
    for scale in (2.0**-900, 2.0**900):
        other = at({k: v * (1.0 if k == "poisson" else scale) for k, v in law.items()}, h, None, name)
        assert not other["status"].any()
        for what in ("stress", "tangent", "energy", "dissipated"):
            assert np.array_equal(one[what] * scale, other[what]), what
        accumulated = [r["state"][:, -1] for r in (one, other)]
        assert np.array_equal(*accumulated)


@pytest.mark.parametrize("kind, options", [
    ("quad", {"plane": "strain"}), ("quad", {"plane": "stress"}), ("quad", {"plane": "axisymmetric"}),
    ("quad9", {"plane": "strain"}), ("quad", {"plane": "strain", "mean_dilatation": True}), ("hexahedron", {}), ("tetra", {}),
])  # fmt: skip
def test_cells_of_every_plane(kind, options):
    """Bodies drawn, then sheared: tangents against differences of forces, forces against those of energy and dissipation."""
    dim = 2 if kind.startswith("quad") else 3
    points, cells = box(kind, (1,) * dim, (1.0,) * dim)
    points[:, 0] += 2.0 if options.get("plane") == "axisymmetric" else 0.0
    law = FiniteJ2(young=3.0, poisson=0.3, yield_stress=0.05, isotropic=0.1, kinematic=0.4)
    body = SolidBody(points, cells, law, **options)
    model = body.model()
    rng = np.random.default_rng(2)
    first, second = (0.1 * (rng.random(points.shape) - 0.5) + points @ (0.2 * (rng.random((dim, dim)) - 0.5)) for _ in range(2))
    body.tangent(first, model)
    model.commit()
    assert model.states()[0][:, -1].min() > 1e-3
    e = 1e-6 * (rng.random(points.shape) - 0.5)
    _, tangent, _, _ = body.tangent(second, model)
    ahead, behind = body.tangent(second + e, model), body.tangent(second - e, model)
    start, row = body.lower[:2]
    below = sparse.csc_array((tangent, row, start), (points.size, points.size))
    wanted = (below + sparse.tril(below, -1).T) @ e.ravel()
    assert np.allclose((ahead[0] - behind[0]) / 2, wanted, rtol=0, atol=1e-6 * np.abs(wanted).max())
    # energy and dissipation are least for the flow that the law finds, so that forces are the derivative of their sum
    changes = sum(ahead[2:4]) - sum(behind[2:4])
    force = body.tangent(second, model)[0]
    assert changes / 2 == pytest.approx(force @ e.ravel(), rel=1e-6)


def test_plane_strain_is_a_slice_of_space():
    """A block between smooth walls, drawn beyond yield, pressed back and sheared."""
    law = FiniteJ2(young=3.0, poisson=0.3, yield_stress=0.05, isotropic=0.1, kinematic=0.4)
    flat_points, flat = box("quad", (1, 1), (1.0, 1.0))
    points, solid = box("hexahedron", (1, 1, 1), (1.0, 1.0, 1.0))
    bodies = SolidBody(flat_points, flat, law), SolidBody(points, solid, law)
    models = [b.model() for b in bodies]
    for f in ([[1.2, 0.1], [0.0, 0.9]], [[0.9, 0.3], [0.2, 1.1]], [[1.0, 0.8], [0.0, 1.0]]):
        h = np.zeros((3, 3))
        h[:2, :2] = np.array(f) - np.eye(2)
        bodies[0].tangent(flat_points @ h[:2, :2].T, models[0])
        bodies[1].tangent(points @ h.T, models[1])
        stress = [m.stress()[0][0] for m in models]
        assert np.allclose(stress[0], stress[1], rtol=0, atol=1e-12 * np.abs(stress[1]).max())
        for m in models:
            m.commit()


def test_a_restart_goes_on_to_the_same_bits_and_the_balance_closes(tmp_path):
    """A block of metal thrown at a wall: work of its forces equals stored and dissipated energy of the material, but for the
    integrator's part, which falls with the step."""

    def thrown(dt):
        rock = cn.Material("rock", density=2500.0)
        points, cells = box("quad", (3, 3), (1.0, 1.0))
        points[:, 1] += 0.01
        law = FiniteJ2(young=2e6, poisson=0.3, yield_stress=2e4, isotropic=1e4, kinematic=2e5)
        body = SolidBody(points, cells, law, density=1000.0, mean_dilatation=True)
        scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
        scene.add(cn.deformable(body, rock, contact=np.arange(len(points)), velocity=(2.0, -6.0)))
        scene.add(cn.wall((0, 0), (0, 1), rock))
        scene.interact(rock, rock, cn.Coulomb(mu=0.3))
        return cn.Simulation(scene, dt=dt, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-10)))

    sims = thrown(1e-3), thrown(1e-3)
    for k in range(60):
        assert sims[0].step()["status"] == "converged"
        if k == 19:
            sims[0].checkpoint(tmp_path / "half.h5")
    sims[1].restore(tmp_path / "half.h5")
    for _ in range(40):
        sims[1].step()
    for what in ("position", "velocity"):
        assert np.array_equal(*(getattr(s.meshes[0], what) for s in sims))
    states = [s.meshes[0].material_state["quad"] for s in sims]
    assert all(np.array_equal(states[0][name], states[1][name]) for name in states[0])
    energy = dict(sims[0].info["energy"])
    assert energy == sims[1].info["energy"]
    assert abs(energy["closure"]) < 1e-8 * energy["in_play"]
    assert min(energy["dissipated_material"], energy["stored"]) > 0.05 * energy["in_play"]
    assert abs(energy["dissipated_integrator"]) < 1e-3 * energy["in_play"]
    finer = thrown(2.5e-4)
    for _ in range(240):
        assert finer.step()["status"] == "converged"
    assert abs(finer.info["energy"]["dissipated_integrator"]) < 0.2 * abs(energy["dissipated_integrator"])
