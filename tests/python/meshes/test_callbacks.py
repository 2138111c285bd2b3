"""Bodies whose forces another code finds: as Cairn's own elements move, through contact; faults, histories, restart, energy."""

import shutil
import subprocess
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn import CallbackBody, SolidBody
from scipy import sparse
from second_order import box

COMPILER = shutil.which("gfortran")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="needs gfortran")
NEO = cn.NeoHookean(young=2e4, poisson=0.3)
ROCK = cn.Material("rock", density=2500.0)


def full(body, values):
    """A symmetric matrix of its lower triangle."""
    start, row = body.lower[:2]
    below = sparse.csc_array((values, row, start), (body.points.size, body.points.size))
    return below + sparse.tril(below, -1).T


def by_python(solid, **options):
    """The same body by a function of Python, with the energy that it stores."""

    def forces(at):
        try:
            force, values, energy, _ = solid.tangent(at.displacement)
        except ValueError:  # a cell is inside out
            return None
        return force, full(solid, values) if at.tangent else None, energy, 0.0

    c = (full(solid, solid.lower[4]),) if solid.lower[4].any() else ()
    edges = solid.boundary_edges() if solid.dim == 2 else None
    faces = solid.boundary_faces() if solid.dim == 3 else None
    given = dict(groups=solid.groups, edges=edges, faces=faces, damping=c[0] if c else None)
    return CallbackBody(solid.points, full(solid, solid.lower[2]), forces, **given | options)


def block(dim=2, kind=None, law=NEO, **options):
    kind = kind or ("quad" if dim == 2 else "hexahedron")
    points, cells = box(kind, (3, 2, 2)[:dim], (1.0, 0.75, 0.75)[:dim])
    points[:, 1] += 0.02
    body = SolidBody(points, cells, law, density=1000.0, **options)
    body.groups["all"] = np.arange(len(points))
    body.groups["bottom"] = np.flatnonzero(points[:, 1] < 0.021)
    body.groups["top"] = np.flatnonzero(points[:, 1] > 0.769)
    return body


def dropped(body, dt=1e-3, integrator=None, **options):
    """A block that falls, spins and rubs on a plane, with a ball on its back."""
    dim = body.dim
    scene = cn.Scene(dim=dim, gravity=(0.0, -10.0, 0.0)[:dim])
    speed = np.zeros_like(body.points)
    speed[:, 0], speed[:, 1] = 0.5 - 2 * (body.points[:, 1] - 0.4), -3 + 2 * (body.points[:, 0] - 0.5)
    sides = {"edges": "top"} if dim == 2 else {"faces": "top"}
    scene.add(cn.deformable(body, ROCK, contact="all", velocity=speed, **sides))
    scene.add(cn.wall((0.0,) * dim, (0.0, 1.0, 0.0)[:dim], ROCK))
    ball = cn.disks([[0.55, 0.92]], 0.12, ROCK) if dim == 2 else cn.spheres([[0.55, 0.92, 0.4]], 0.12, ROCK)
    scene.add(ball)
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    strategy = cn.NSCD(
        integrator=integrator or cn.Theta(), newton_tol=1e-12, solver=cn.NLGS(tol=1e-12, max_iter=10**5), **options
    )
    return cn.Simulation(scene, dt=dt, strategy=strategy)


def moved(sim, steps):
    """Displacements and velocities of all steps, and the final state."""
    rows = []
    for _ in range(steps):
        assert sim.step()["status"] == "converged"
        rows.append([sim.meshes[0].displacement, sim.meshes[0].velocity])
    return np.array(rows)


def same(ways, terms, tolerance=1e-9):
    """Equal to rounding, and each term of the energy."""
    for part in (0, 1):
        assert np.abs(ways[0][:, part] - ways[1][:, part]).max() < tolerance * np.abs(ways[0][:, part]).max()
    for name, value in terms[0].items():
        assert value == pytest.approx(terms[1][name], rel=1e-7, abs=1e-8 * terms[0]["in_play"]), name


@pytest.mark.parametrize("dim, law, options", [
    (2, NEO, {}),
    (2, cn.IsotropicElastic(young=2e4, poisson=0.3), {"kinematics": "small", "rayleigh": (1.0, 1e-3)}),
    (3, NEO, {}),
], ids=["neo-Hookean", "linear, damped", "neo-Hookean in space"])  # fmt: skip
def test_a_python_callable_moves_as_the_elements_do(dim, law, options):
    solid = block(dim, law=law, **options)
    ways, terms = [], []
    for body in (solid, by_python(solid)):
        sim = dropped(body)
        ways.append(moved(sim, 40))
        terms.append(sim.info["energy"])
    same(ways, terms)
    assert terms[1]["dissipated_friction"] > 0 and terms[1]["dissipated_normal"] > 0
    assert abs(terms[1]["closure"]) < 1e-10 * terms[1]["in_play"] and terms[1]["absorbed"] == 0


IMPLICIT = [cn.Theta(theta=0.7), cn.Newmark(), cn.Newmark(beta=0.3025, gamma=0.6), cn.HHT(alpha=-0.1),
            cn.GeneralisedAlpha(spectral_radius=0.8)]  # fmt: skip
EXPLICIT = [cn.CentralDifference(), cn.VelocityVerlet(), cn.BetaScheme(beta=0.6), cn.Gear(values=5)]


@pytest.mark.parametrize("integrator", [*IMPLICIT, *EXPLICIT], ids=repr)
def test_every_integrator(integrator):
    explicit = integrator in EXPLICIT
    solid = block(lumped=explicit)
    ways, terms = [], []
    for body in (solid, by_python(solid)):
        sim = dropped(body, 2e-4 if explicit else 1e-3, integrator)
        ways.append(moved(sim, 40))
        terms.append(sim.info["energy"])
    same(ways, terms)


def test_integrators_that_need_the_energy_along_the_way_are_refused():
    with pytest.raises(ValueError, match=r"forces of the mesh 'mesh' are of .*\(Python\), whose energy .* give Theta"):
        dropped(by_python(block()), integrator=cn.DiscreteGradient())


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """The rubber of rubber.f90."""
    folder = tmp_path_factory.mktemp("rubber")
    plug = Path(cn.__file__).resolve().parent / "plugs" / "cairn_plug.f90"
    source = Path(__file__).with_name("rubber.f90")
    command = [COMPILER, "-O2", "-shared", "-fPIC", "-J", str(folder), str(plug), str(source), "-o", str(folder / "librubber.so")]
    subprocess.run(command, check=True)
    return folder / "librubber.so"


def grid(along=4, up=3):
    """Triangles as rubber.f90 has them."""
    x, y = np.meshgrid(np.linspace(0, 1, along + 1), np.linspace(0.02, 0.77, up + 1))
    k = (np.arange(up)[:, None] * (along + 1) + np.arange(along)).ravel()
    cells = np.stack([np.stack([k, k + 1, k + along + 2], -1), np.stack([k, k + along + 2, k + along + 1], -1)], 1).reshape(-1, 3)
    points = np.column_stack([x.ravel(), y.ravel()])
    body = SolidBody(points, {"triangle": cells}, NEO, density=1000.0)
    body.groups.update(all=np.arange(len(points)), top=np.flatnonzero(points[:, 1] > 0.769))
    return body


LAME = dict(mu=2e4 / 2.6, **{"lambda": 2e4 * 0.3 / (1.3 * 0.4)})


def by_library(library, solid, **options):
    pattern = full(solid, np.ones(len(solid.lower[1])))
    forces = cn.plug(library, body="rubber", params={**LAME, "along": 4})
    given = dict(pattern=pattern, groups=solid.groups, edges=solid.boundary_edges())
    return CallbackBody(solid.points, full(solid, solid.lower[2]), forces, **given | options)


@needs_compiler
def test_a_library_moves_as_the_elements_do(library):
    solid = grid()
    body = by_library(library, solid)
    assert body.tells == (True, True) and body.tangent_error() < 1e-7
    for integrator in (cn.Theta(), cn.HHT(alpha=-0.1)):
        ways, terms = [], []
        for of in (solid, body):
            sim = dropped(of, integrator=integrator)
            ways.append(moved(sim, 60))
            terms.append(sim.info["energy"])
        same(ways, terms)


@needs_compiler
def test_a_lower_triangle_is_a_pattern_too(library):
    solid = grid()
    lower = sparse.tril(full(solid, np.ones(len(solid.lower[1]))))
    bodies = [by_library(library, solid)]
    with pytest.raises(ValueError, match="rubber does not take the mesh"):  # it fills all entries
        by_library(library, solid, pattern=lower)
    ways = [moved(dropped(body), 5) for body in bodies * 2]  # two simulations, a body of its own each
    assert np.array_equal(*ways)


@needs_compiler
def test_no_python_runs_in_a_step_of_a_library(library):
    import sys

    sim = dropped(by_library(library, grid()))
    sim.step()
    called = []
    h = sim.ready()
    sys.setprofile(lambda frame, event, what: called.append(frame.f_code.co_name) if event == "call" else None)
    try:
        sim._core.step(h)
    finally:
        sys.setprofile(None)
    assert not called


@needs_compiler
def test_what_does_not_fit_a_library_is_told(library):
    solid = grid()
    with pytest.raises(ValueError, match="has no cairn_describe_gum"):
        cn.plug(library, body="gum")
    with pytest.raises(ValueError, match=r"not a contact law \(1\)"):
        cn.plug(library, law="rubber")
    Rubber = cn.plug(library, body="rubber")
    with pytest.raises(ValueError, match="mu is -1.0: rubber takes"):
        Rubber(mu=-1.0, along=4, **{"lambda": 1.0})
    with pytest.raises(ValueError, match="parameter mu of rubber is missing"):
        Rubber(along=4)
    forces = cn.plug(library, body="rubber", params=[1e4, 1e4, 3])
    mass = full(solid, solid.lower[2])
    with pytest.raises(ValueError, match=r"rubber does not take the mesh \(1\)"):  # no grid of three cells a row
        CallbackBody(solid.points, mass, forces, pattern=mass)
    with pytest.raises(ValueError, match="pattern is not given"):
        CallbackBody(solid.points, mass, forces)


# ---------------------------------------------------------------------- faults


def spoilt(solid, change):
    """The body by Python, whose answers `change(at, force, tangent, energy)` alters."""

    def forces(at):
        force, values, energy, _ = solid.tangent(at.displacement)
        return change(at, force, full(solid, values) if at.tangent else None, energy)

    return CallbackBody(solid.points, full(solid, solid.lower[2]), forces, groups=solid.groups, edges=solid.boundary_edges())


def state(sim):
    return [sim.nodes.position, sim.nodes.velocity, sim.bodies.position, sim.bodies.velocity, sim.time, sim.steps]


def fails_once(sim, match, error=ValueError):
    """A step that is an error leaves all as it was."""
    before = state(sim)
    with pytest.raises(error, match=match) as told:
        sim.step()
    assert all(np.array_equal(a, b) for a, b in zip(before, state(sim)))
    return told.value


def test_a_wrong_tangent_is_told():
    """Ten times too soft: passes go on, and end at their limit with the mesh and the remedy."""

    def soft(at, force, tangent, energy):
        return force, None if tangent is None else 0.1 * tangent, energy, 0.0

    body = spoilt(block(), soft)
    assert body.tangent_error() > 0.1
    sim = dropped(body, 2e-2, newton_passes=6)
    before = state(sim)
    try:
        report = sim.step()
    except ValueError as told:
        report = {"status": "newton_limit", "hint": str(told)}
        assert all(np.array_equal(a, b) for a, b in zip(before, state(sim)))
    assert report["status"] == "newton_limit"
    assert "mesh 'mesh'" in report["hint"] and "compare the tangent with differences" in report["hint"]


@pytest.mark.parametrize("what, match", [
    ("force", r"the mesh 'mesh': the force of .*forces \(Python\) on node 3 along y is not finite"),
    ("tangent", r"entry .* of the tangent of .*forces \(Python\), of node . along . by node . along ., is not finite"),
    ("energy", "the mesh 'mesh': the energy of .* is not finite"),
])  # fmt: skip
def test_what_is_no_number_is_told(what, match):
    on = []

    def change(at, force, tangent, energy):
        if on and what == "force":
            force[7] = np.nan
        if on and what == "tangent" and tangent is not None:
            tangent.data[5] = np.inf
        return force, tangent, np.nan if on and what == "energy" else energy, 0.0

    sim, twin = dropped(spoilt(block(), change)), dropped(spoilt(block(), change))
    moved(sim, 3), moved(twin, 3)
    on.append(True)
    fails_once(sim, match)
    on.clear()
    assert np.array_equal(moved(sim, 3), moved(twin, 3))  # as if it had not been tried


def test_what_python_raises_is_told():
    on = []

    def change(at, force, tangent, energy):
        if on:
            raise RuntimeError("the mill stands still")
        return force, tangent, energy, 0.0

    sim = dropped(spoilt(block(), change))
    moved(sim, 2)
    on.append(True)
    told = fails_once(sim, r"the mesh 'mesh': forces of .*forces \(Python\) raised RuntimeError: the mill stands still")
    assert isinstance(told.__cause__, RuntimeError)
    on[0] = KeyboardInterrupt
    on.clear()
    assert sim.step()["status"] == "converged"


def test_no_forces_is_told():
    on = []
    sim = dropped(spoilt(block(), lambda at, *found: None if on else (*found, 0.0)))
    moved(sim, 2)
    on.append(True)
    fails_once(sim, r"the mesh 'mesh': .*\(Python\) finds no forces")


@pytest.mark.parametrize("answer, match", [
    (lambda f, k: (f[:-1], k), r"gave forces of shape \(23,\), dtype float64: give real numbers \(12, 2\) or \(24,\) \[N\]"),
    (lambda f, k: (f, k[:4]), r"tangent of .* has shape \(4, 24\): give a matrix \(24, 24\)"),
    (lambda f, k: (f,), r"gave 1 values, and at.tangent is True: give forces, tangent"),
    (lambda f, k: (f, None), "gave no tangent"),
    (lambda f, k: None, "gives no forces at displacements of zero"),
])  # fmt: skip
def test_wrong_sizes_are_told(answer, match):
    solid = block()
    force, values, *_ = solid.tangent(np.zeros_like(solid.points))
    with pytest.raises(ValueError, match=match):
        CallbackBody(solid.points, full(solid, solid.lower[2]), lambda at: answer(force, full(solid, values).tocsc()))


def test_what_stands_beside_the_pattern_is_told():
    solid = block()
    mass = full(solid, solid.lower[2])
    narrow = sparse.diags_array(np.ones(solid.points.size))

    def forces(at):
        return solid.tangent(at.displacement)[0], full(solid, solid.tangent(at.displacement)[1])

    with pytest.raises(ValueError, match=r"gave .* at \(1, 0\) of its tangent, which its pattern does not hold: give"):
        CallbackBody(solid.points, mass, forces, pattern=narrow)
    with pytest.raises(ValueError, match=r"pattern has shape \(3, 3\): 12 nodes in 2D need \(24, 24\)"):
        CallbackBody(solid.points, mass, forces, pattern=sparse.eye_array(3))
    with pytest.raises(ValueError, match=r"mass has shape \(3, 3\)"):
        CallbackBody(solid.points, np.eye(3), forces)
    with pytest.raises(ValueError, match=r"mass\[2\] is -1"):
        CallbackBody(solid.points, np.where(np.arange(12) == 2, -1.0, 1.0), forces)
    with pytest.raises(TypeError, match="forces is 3: give a function of a BodyStep"):
        CallbackBody(solid.points, mass, 3)


# ---------------------------------------------------------------------- histories, energy


class Chain:
    """A row of nodes joined by elastic plastic rods along x, which bend freely; their state is the plastic elongation."""

    def __init__(self, points, stiffness=2e4, yield_force=60.0, damping=0.0, tells=True):
        self.k, self.most, self.c = stiffness, yield_force, damping
        self.rest = np.diff(points[:, 0])
        self.plastic = self.trial = np.zeros(len(self.rest))
        self.calls = []
        if tells:
            self.state, self.restore = lambda: self.plastic, self._restore

    def forces(self, at):
        n = len(self.rest)
        difference = np.zeros((n, 2 * (n + 1)))
        difference[np.arange(n), 2 * np.arange(n)], difference[np.arange(n), 2 * np.arange(n) + 2] = -1, 1
        longer, faster = difference @ at.displacement.ravel(), difference @ at.velocity.ravel()
        push = self.k * (longer - self.plastic)
        slips = np.abs(push) > self.most
        force = np.where(slips, np.sign(push) * self.most, push)
        self.trial = np.where(slips, longer - force / self.k, self.plastic)
        slope = np.where(slips, 1e-3 * self.k, self.k) + self.c * at.rate
        spent = self.most * np.abs(self.trial - self.plastic).sum() + at.step * self.c * (faster**2).sum()
        side = 1e-2 * self.k  # lever against bending
        across = np.zeros(2 * (n + 1))
        across[1::2] = side * at.displacement[:, 1]
        tangent = difference.T @ (slope[:, None] * difference) + np.diag(np.tile([0.0, side], n + 1))
        energy = 0.5 * (force**2).sum() / self.k + 0.5 * side * (at.displacement[:, 1] ** 2).sum()
        return difference.T @ (force + self.c * faster) + across, tangent, energy, spent

    def commit(self):
        self.calls.append("commit")
        self.plastic = self.trial

    def rollback(self):
        self.calls.append("rollback")

    def _restore(self, numbers):
        self.plastic = np.array(numbers)


POINTS = np.column_stack([np.linspace(0, 1, 6), np.zeros(6)])


def hit(chain, dt=5e-4, integrator=None, edit=None, **options):
    """A chain that is held at its left end and hit by a disk at its right one."""
    forces = chain.forces if edit is None else edit
    given = chain if edit is None else forces
    body = CallbackBody(POINTS, np.full(6, 0.5), given, groups={"left": [0], "right": [5]}, **options)
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, ROCK, contact="right", fixed={"left": "xy"}))
    scene.add(cn.disks([[1.2, 0.0]], 0.15, ROCK, velocity=[[-3.0, 0.0, 0.0]]))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    strategy = cn.NSCD(integrator=integrator or cn.Theta(), newton_tol=1e-11, newton_passes=60, solver=cn.NLGS(tol=1e-12))
    return cn.Simulation(scene, dt=dt, strategy=strategy)


def test_a_history_is_committed_once_a_step_and_restored(tmp_path):
    chain = Chain(POINTS)
    sim = hit(chain)
    chain.calls.clear()
    way = moved(sim, 60)
    assert chain.calls == ["commit"] * 60 and np.abs(chain.plastic).max() > 1e-3
    terms = sim.info["energy"]
    assert terms["dissipated_material"] > terms["stored"] > 0 and terms["absorbed"] == 0
    assert abs(terms["closure"]) < 1e-11 * terms["in_play"]
    assert np.array_equal(sim.meshes[0].reaction("left").shape, (2,)) and sim.meshes[0].contact_force.any()
    sim.checkpoint(tmp_path / "chain.checkpoint.h5")
    on = moved(sim, 30)
    again = hit(Chain(POINTS))
    again.restore(tmp_path / "chain.checkpoint.h5")
    assert np.array_equal(moved(again, 30), on)
    assert again.info["energy"] == sim.info["energy"]
    assert not np.array_equal(way[-1], on[-1])


def test_a_step_that_is_undone_is_told_to_the_code():
    chain, on = Chain(POINTS), []

    class Failing(Chain):
        def forces(self, at):
            found = super().forces(at)
            return None if on else found

    chain = Failing(POINTS)
    sim = hit(chain)
    moved(sim, 20)
    kept = chain.plastic.copy()
    chain.calls.clear()
    on.append(True)
    fails_once(sim, "finds no forces")
    assert chain.calls == ["rollback"] and np.array_equal(chain.plastic, kept)
    on.clear()
    twin = hit(Chain(POINTS))
    moved(twin, 20)
    assert np.array_equal(moved(sim, 20), moved(twin, 20))


def test_a_history_that_is_not_told_has_no_checkpoint(tmp_path):
    chain = Chain(POINTS, tells=False)
    sim = hit(chain)
    moved(sim, 10)
    with pytest.raises(ValueError, match="mesh 'mesh' is of a code that keeps a history and does not give it"):
        sim.checkpoint(tmp_path / "none.checkpoint.h5")
    assert not (tmp_path / "none.checkpoint.h5").exists()
    sim.add(cn.disks([[3.0, 0.0]], 0.1, ROCK))  # meshes are handed over anew, and the chain goes on
    twin = hit(Chain(POINTS))
    moved(twin, 10)
    twin.add(cn.disks([[3.0, 0.0]], 0.1, ROCK))
    assert np.array_equal(moved(sim, 20), moved(twin, 20))


def test_a_history_is_of_one_simulation():
    chain = Chain(POINTS)
    sim = hit(chain)
    scene = sim.scene
    with pytest.raises(ValueError, match=r"Chain \(Python\) keeps a history between steps, which is of another simulation"):
        cn.Simulation(scene, dt=5e-4)
    way = moved(sim, 30)
    del sim
    assert np.array_equal(moved(cn.Simulation(scene, dt=5e-4, strategy=hit(Chain(POINTS)).strategy), 30), way)


def test_forces_that_know_a_velocity():
    """Dashpots beside the rods by the code, and by the matrix C of the mesh, under theta 1/2 and 1."""
    difference = np.diff(np.eye(6), axis=0)
    c = np.kron(difference.T @ difference, np.diag([1.0, 0.0])) * 40.0
    for theta in (0.5, 1.0):
        ways = []
        for own in (True, False):
            chain = Chain(POINTS, yield_force=1e9, damping=40.0 if own else 0.0)
            sim = hit(chain, integrator=cn.Theta(theta=theta), damping=None if own else c)
            ways.append(moved(sim, 60))
            assert sim.info["newton_passes"] <= 3
            terms = sim.info["energy"]
            assert abs(terms["closure"]) < 1e-11 * terms["in_play"]
        assert np.abs(ways[0] - ways[1])[:, 0].max() < 1e-9 * np.abs(ways[0][:, 0]).max()


def test_energy_that_is_not_told_is_a_term_of_its_own():
    """The work absorbed by the code is known, its stored part is not: without both, and with the energy alone."""
    solid = block()
    whole = dropped(by_python(solid))
    moved(whole, 40)
    told = whole.info["energy"]
    for parts in (2, 3):
        body = spoilt(solid, lambda at, *found, parts=parts: found[:parts])
        assert body.tells == (parts == 3, False)
        sim = dropped(body)
        moved(sim, 40)
        terms = sim.info["energy"]
        assert abs(terms["closure"]) < 1e-10 * terms["in_play"]
        stored = told["stored"] if parts == 3 else 0.0
        assert terms["stored"] == pytest.approx(stored, rel=1e-7)
        absorbed = told["stored"] - stored + told["dissipated_integrator"] - terms["dissipated_integrator"]
        assert terms["absorbed"] == pytest.approx(absorbed, rel=1e-7) and terms["absorbed"] != 0


def test_energy_is_told_always_or_never():
    solid, on = block(), []
    body = spoilt(solid, lambda at, force, tangent, energy: (force, tangent) if on else (force, tangent, energy))
    sim = dropped(body)
    moved(sim, 2)
    on.append(True)
    fails_once(sim, "gives no energy now, and one at rest: give it always, or never")


# ---------------------------------------------------------------------- with all else


def test_given_displacements_pressures_loads_rigid_parts_and_stages():
    """A block by Python beside one of elements: a driven top, a load, a rigid bottom; stage by stage."""
    solid = block()
    ways, reactions = [], []
    for body in (solid, by_python(solid)):
        scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
        scene.add(cn.deformable(body, ROCK, rigid="bottom", force={"all": (30.0, 0.0)},
                                displace={"top": {"x": lambda t: 0.1 * np.sin(20 * t), "y": lambda t: 0.0}}))  # fmt: skip
        sim = cn.Simulation(scene, dt=2e-3, strategy=cn.NSCD(newton_tol=1e-12))
        rows = []
        for _ in range(15):
            sim.step()
            rows.append(sim.meshes[0].displacement)
        sim.stages.begin_step()
        while sim.stages.due:
            getattr(sim.stages, sim.stages.due)()
        rows.append(sim.meshes[0].displacement)
        ways.append(np.array(rows))
        reactions.append(sim.meshes[0].reaction("top"))
    assert np.abs(ways[0] - ways[1]).max() < 1e-9 * np.abs(ways[0]).max()
    assert np.allclose(reactions[0], reactions[1], rtol=1e-7)


def test_against_another_mesh_and_in_a_run_file(tmp_path):
    solid = block()
    ways = []
    for body in (solid, by_python(solid)):
        points, cells = box("quad", (4, 1), (1.4, 0.2))
        plate = cn.ElasticBody(points - [0.2, 0.2], cells, young=1e6, poisson=0.2, density=800.0)
        plate.groups.update(top=np.flatnonzero(points[:, 1] > 0.19), ends=np.flatnonzero(np.abs(points[:, 0] - 0.7) > 0.69))
        scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
        scene.add(cn.deformable(body, ROCK, contact="all", velocity=(0.0, -2.0), name="block"))
        scene.add(cn.deformable(plate, ROCK, edges="top", fixed={"ends": "xy"}, name="plate"))
        scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
        solver = cn.NLGS(tol=1e-12, max_iter=10**5)
        sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(newton_tol=1e-12, solver=solver))
        path = tmp_path / f"{len(ways)}.vtkhdf"
        sim.run(steps=30, output=path, every=10, progress=False)
        ways.append([mesh.displacement for mesh in sim.meshes])
        run = cn.load(path)
        assert np.allclose(run[-1].nodes.displacement[: len(points)].shape, (len(points), 2))
        assert np.array_equal(run[-1].nodes.position, sim.nodes.position)
    for one, two in zip(*ways):
        assert np.abs(one - two).max() < 1e-9 * np.abs(one).max() and np.abs(one).max() > 1e-3
