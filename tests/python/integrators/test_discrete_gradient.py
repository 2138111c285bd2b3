"""DiscreteGradient: hyperelastic bodies keep energy and momentum, in flight and in contact; the order of others beside it."""

import cairn as cn
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from second_order import box

MATERIALS = {
    "neo_hookean": cn.NeoHookean(young=2e4, poisson=0.3),
    "ogden": cn.Ogden(bulk=3e4, shear1=6e3, power1=3.0, shear2=-2e3, power2=-2.0),
    "green": cn.SaintVenantKirchhoff(young=2e4, poisson=0.3),
    "hencky": cn.IsotropicElastic(young=2e4, poisson=0.3),
}
TIGHT = 1e-12


def thrown(dim, material, integrator, dt, *, kind=None, wall=False, size=1.0, **options):
    """A block that turns, stretches and shears as it flies."""
    kind = kind or ("quad" if dim == 2 else "hexahedron")
    points, cells = box(kind, (2,) * dim, (size,) * dim)
    if material is MATERIALS["hencky"]:
        options.setdefault("kinematics", "logarithmic")
    body = cn.SolidBody(points, cells, material, density=1024.0, **options)
    x = (points - 0.5 * size) / size
    velocity = np.zeros_like(points)
    velocity[:, 0] = 1.5 * x[:, 0] - 4 * x[:, 1]
    velocity[:, 1] = 4 * x[:, 0] - 1.5 * x[:, 1] - (2.0 if wall else 0.0)
    velocity *= size
    rock = cn.Material("rock", density=2500.0)
    scene = cn.Scene(dim=dim)
    scene.add(cn.deformable(body, rock, contact=np.arange(len(points)), velocity=velocity))
    if wall:
        scene.add(cn.wall((0.0,) * dim, (0.0, 1.0, 0.0)[:dim], rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.0))
    strategy = cn.NSCD(integrator=integrator, newton_tol=TIGHT, newton_passes=40, solver=cn.NLGS(tol=1e-14, max_iter=5000))
    return cn.Simulation(scene, dt=dt, strategy=strategy)


def energy(sim):
    terms = sim.info["energy"]
    return terms["kinetic"] + terms["stored"]


def spin(sim):
    """Angular momentum about the origin, of masses of the nodes [kg m2/s]."""
    mesh = sim.meshes[0]
    x, v = mesh.body.points + mesh.displacement, (mesh.body.M @ mesh.velocity.ravel()).reshape(mesh.velocity.shape)
    return (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]).sum()


@pytest.mark.parametrize("dim, material, options", [
    (2, "neo_hookean", {}), (2, "ogden", {}), (2, "green", {"kind": "quad9"}), (2, "hencky", {}),
    (2, "neo_hookean", {"kind": "triangle6"}), (3, "neo_hookean", {}), (3, "green", {"kind": "tetra"}),
])  # fmt: skip
def test_energy_and_momentum_stay_in_flight(dim, material, options):
    sim = thrown(dim, MATERIALS[material], cn.integrators.DiscreteGradient(), 1e-2, **options)
    sim.step()
    start, turning, first = energy(sim), spin(sim), (sim.meshes[0].body.M @ sim.meshes[0].velocity.ravel()).sum()
    least, most = np.inf, 0.0
    for _ in range(60):
        report = sim.step()
        assert report["status"] == "converged" and report["newton_passes"] < 25
        terms = sim.info["energy"]
        least, most = min(least, terms["stored"]), max(most, terms["stored"])
        assert abs(energy(sim) - start) < 1e-10 * start
        assert abs(terms["closure"]) < 1e-10 * start
    assert most - least > 0.02 * start  # it is the sum that stays
    assert spin(sim) == pytest.approx(turning, rel=1e-10)
    last = (sim.meshes[0].body.M @ sim.meshes[0].velocity.ravel()).sum()
    assert abs(last - first) < 1e-10 * 1024.0


@pytest.mark.parametrize("material", ["neo_hookean", "ogden", "green"])
@pytest.mark.parametrize("speed", [1e-3, 1e-5])
def test_slow_bodies_that_are_turned(material, speed):
    """Strains of 1e-3 and 1e-5 on points turned by nearly a radian: energies have the digits of the strain, not those of 1."""
    points, cells = box("hexahedron", (2, 2, 3), (1.0, 0.6, 1.2))
    turn, middle = Rotation.from_rotvec([0.3, 0.5, -0.7]).as_matrix(), points - points.mean(axis=0)
    wave = np.sqrt(2e4 / 1024.0)
    velocity = speed * wave * (np.cross([0.2, 0.3, -0.25], middle @ turn.T) + 0.1 * (middle @ turn.T)[:, [1, 2, 0]])
    body = cn.SolidBody(points, cells, MATERIALS[material], density=1024.0)
    scene = cn.Scene(dim=3, gravity=(0, 0, 0))
    rock = cn.Material("rock", density=1024.0)
    scene.add(cn.deformable(body, rock, velocity=velocity, displacement=middle @ (turn - np.eye(3)).T))
    strategy = cn.NSCD(integrator=cn.DiscreteGradient(), newton_tol=1e-10)
    sim = cn.Simulation(scene, dt=0.2 / wave, strategy=strategy)
    sim.step()
    start = energy(sim)
    for _ in range(20):
        assert sim.step()["status"] == "converged"
        assert abs(energy(sim) - start) < 1e-13 / speed * start  # what places of this size round of the strain
        assert abs(sim.info["energy"]["closure"]) < 1e-10 * start


def test_others_lose_or_gain_energy_by_their_order():
    """Largest change of the energy over the same time: of the midpoint of forces of the second order of the step."""
    drift = {}
    for name, integrator in (("theta", cn.integrators.Theta(theta=0.5)), ("keeps", cn.integrators.DiscreteGradient())):
        drift[name] = []
        for n in (1, 2, 4):
            sim = thrown(2, MATERIALS["neo_hookean"], integrator, 1e-2 / n)
            sim.step()
            start, worst = energy(sim), 0.0
            for _ in range(40 * n):
                sim.step()
                worst = max(worst, abs(energy(sim) - start) / start)
            drift[name].append(worst)
    orders = np.log2(np.array(drift["theta"][:-1]) / drift["theta"][1:])
    print(drift, orders)
    assert np.all(np.abs(orders - 2) < 0.35)
    assert max(drift["keeps"]) < 1e-10 < 1e-4 < drift["theta"][0]


def test_the_balance_closes_in_contact():
    sim = thrown(2, MATERIALS["neo_hookean"], cn.integrators.DiscreteGradient(), 2e-3, wall=True)
    touched = 0
    for _ in range(250):
        assert sim.step()["status"] == "converged"
        touched += len(sim.contacts) > 0 and np.abs(sim.contacts.force).max() > 0
        terms = sim.info["energy"]
        assert abs(terms["closure"]) < 1e-10 * terms["in_play"]
        assert abs(terms["dissipated_integrator"]) < 1e-10 * terms["in_play"]
    assert touched > 10


def test_powers_of_two_and_restart_keep_bits(tmp_path):
    ways = []
    for s in (1.0, 2.0):
        sim = thrown(2, MATERIALS["neo_hookean"], cn.integrators.DiscreteGradient(), 2.0**-7, size=s)
        again = thrown(2, MATERIALS["neo_hookean"], cn.integrators.DiscreteGradient(), 2.0**-7, size=s)
        for k in range(20):
            sim.step()
            if k == 9:
                sim.checkpoint(tmp_path / f"{s}.checkpoint.h5")
        again.restore(tmp_path / f"{s}.checkpoint.h5")
        for _ in range(10):
            again.step()
        assert np.array_equal(sim.meshes[0].displacement, again.meshes[0].displacement)
        assert sim.info["energy"] == again.info["energy"]
        ways.append(sim.meshes[0].displacement / s)
    assert ways[0].any()


@pytest.mark.parametrize("material, options, told", [
    (cn.FiniteJ2(young=2e5, poisson=0.3, yield_stress=1e3), {}, "quad cells of the mesh 'mesh' are of FiniteJ2, which keeps"),
    (cn.NeoHookean(young=2e5, poisson=0.3), {"plane": "stress"}, "of NeoHookean in plane stress: DiscreteGradient is for"),
    (cn.NeoHookean(young=2e5, poisson=0.3), {"mean_dilatation": True}, "of NeoHookean with mean dilatation: DiscreteGradient"),
])  # fmt: skip
def test_what_keeps_no_energy_alone_is_told(material, options, told):
    with pytest.raises(ValueError, match=told):
        thrown(2, material, cn.integrators.DiscreteGradient(), 1e-3, **options).step()
