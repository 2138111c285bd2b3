"""The incompressible liquid, whose pressure is solved with the contacts: weight, release, contacts under water, refusals."""

import cairn as cn
import numpy as np
import pytest

rock = cn.Material("rock", density=2600.0)


def tank(high=0.6, width=1.0, dim=2, gravity=1.0, spacing=0.05, slip=None, **options):
    """Scene of a tank of half-spaces that liquid fills to a height, and the id of its bed."""
    scene = cn.Scene(dim=dim, gravity=(*(0.0,) * (dim - 1), -gravity))
    bed = scene.add(cn.wall(np.zeros(dim), np.eye(dim)[-1], rock))[0]
    for k in range(dim - 1):
        way = np.eye(dim)[k]
        scene.add(cn.wall(np.zeros(dim), way, rock), cn.wall(width * way, -way, rock))
    scene.add(cn.fluid([np.zeros(dim), [*(width,) * (dim - 1), high]], spacing, incompressible=True, **options))
    if slip:
        scene.interact("fluid", "*", slip)
    return scene, bed


@pytest.mark.parametrize("dim", [2, 3])
def test_weight_and_pressure_of_a_liquid_at_rest(dim):
    spacing = 0.05 if dim == 2 else 0.1
    scene, bed = tank(0.6, 1.0, dim, spacing=spacing)
    sim = cn.Simulation(scene, dt=0.4 * spacing)
    force = []
    for _ in range(40 if dim == 2 else 15):
        sim.step()
        force.append(sim.fluid.force_on(bed)[dim - 1])
    assert abs(np.mean(force[len(force) // 2 :]) / -600.0 - 1) < (1e-3 if dim == 2 else 1e-2)
    depth = 0.6 - sim.fluid.position[:, -1]
    assert np.sqrt(np.mean((sim.fluid.pressure - 1000.0 * depth) ** 2)) < 0.02 * 600.0
    assert sim.info["status"] == "converged"


def released(share, spacing, size=8.0):
    """Acceleration of a cylinder of radius 0.5 m, held, then let go in a tank of some radii, over that in endless liquid."""
    side = 0.5 * size
    scene, _ = tank(side, side, gravity=9.81, spacing=spacing, slip=cn.FreeSlip())
    wood = cn.Material("wood", density=1000.0 * share)
    ball = scene.add(cn.disks([[side / 2, side / 2]], 0.5, wood, driven=("vx", "vy", "w")))[0]
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=4e-3)
    for _ in range(40):  # particles about it settle
        sim.step()
    held = sim.fluid.force_on(ball)[1] / (9810 * np.pi * 0.25)
    sim.drive([ball], (), (0.0, 0.0, 0.0))
    sim.step()
    speed = sim.bodies.velocity[sim.bodies.id == ball][0, 1]
    return held, speed / 4e-3 / ((1 - share) / (1 + share) * 9.81)


@pytest.mark.parametrize("share", [0.001, 0.1, 0.5])
def test_light_bodies_rise_as_in_potential_flow(share):
    # Images of the dipole in walls four radii away: added mass 1 + 2 * 2 zeta(2) / 8**2 = 1.103 of the displaced
    held, found = released(share, 0.125)
    expected = (1 + share) / (1.103 + share)
    assert abs(held - 1) < 0.03
    assert abs(found / expected - 1) < 0.19  # 4 spacings a radius; 8: 0.03 to 0.06


def square_block(size=0.3):
    return size / 2 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])


def held_down(share, **options):
    """Scene of a block of a share of the liquid's density below a bar that is held, all under water, and its id."""
    scene, _ = tank(1.2, 1.2, gravity=9.81, slip=cn.FreeSlip(), **options)
    wood = cn.Material("wood", density=1000.0 * share)
    scene.add(cn.polygons(square_block(), rock, position=[[0.6, 0.9]], driven=("vx", "vy", "w")))
    block = scene.add(cn.polygons(square_block(), wood, position=[[0.6, 0.6]]))[0]
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    return scene, block


@pytest.mark.filterwarnings("ignore:.*gaps under its spacing")
@pytest.mark.parametrize("share", [0.001, 0.3])
def test_a_light_block_presses_on_what_holds_it_down(share):
    # contact and pressure in one step: the body is at rest, and the contact bears what the liquid gives less weight
    scene, block = held_down(share)
    sim = cn.Simulation(scene, dt=5e-3)
    for _ in range(10):
        sim.step()
        assert sim.info["status"] == "converged"
        assert sim.fluid.info["misfit"] <= 1e-3
    assert abs(sim.bodies.velocity[sim.bodies.id == block][0, 1]) < 2e-3 * 9.81 * 5e-3
    borne = np.abs(np.sum(sim.contacts.impulse[:, 1])) / 5e-3
    lift = sim.fluid.force_on(block)[1] - 1000.0 * share * 9.81 * 0.09
    assert lift > 0 and abs(borne / lift - 1) < 1e-2


def test_momentum_goes_from_the_liquid_to_bodies():
    scene = cn.Scene(dim=2)
    scene.add(cn.fluid([(0, 0), (0.5, 0.5)], 0.05, velocity=(1.0, 0.2), viscosity=1.0, incompressible=True))
    ball = scene.add(cn.disks([[0.75, 0.2], [1.2, 0.25]], 0.2, rock))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=5e-3)
    mass = 1000.0 * 0.05**2

    def momentum():
        of_bodies = (sim.bodies.mass[:, None] * sim.bodies.velocity[:, :2]).sum(axis=0)
        return mass * np.sum(sim.fluid.velocity, axis=0) + of_bodies

    begin = momentum()
    for _ in range(80):
        sim.step()
    assert np.abs(sim.bodies.velocity[sim.bodies.id == ball[0]]).max() > 1e-2  # they met
    assert np.abs(momentum() - begin).max() < 1e-10 * np.abs(begin).max()


def test_a_patch_keeps_its_area_and_energy():
    # a disk of liquid that is drawn out: a = 0.514266 at A0 t = 0.76, by A' = A^2 (a^4 - 1) / (a^4 + 1), a' = -a A
    dx = 0.1
    x = np.arange(-1 + 0.5 * dx, 1, dx)
    places = np.stack([a.ravel() for a in np.meshgrid(x, x)], axis=1)
    places = places[np.sum(places**2, axis=1) <= 1]
    scene = cn.Scene(dim=2)
    pressure = 500.0 * 100.0**2 * (1 - np.sum(places**2, axis=1))
    scene.add(cn.fluid(places, dx, velocity=100 * places * [-1, 1], pressure=pressure, incompressible=True))
    sim = cn.Simulation(scene, dt=2e-4)
    begin, energy = np.sqrt(np.mean(places**2, axis=0)), sim.fluid.energy()["kinetic"]
    for _ in range(38):
        sim.step()
    axes = np.sqrt(np.mean(np.array(sim.fluid.position) ** 2, axis=0)) / begin
    assert abs(axes[0] / 0.514266 - 1) < 0.03 and abs(axes[1] * 0.514266 - 1) < 2e-3
    assert abs(axes[0] * axes[1] - 1) < 0.03  # 0.042 without gradients that are exact for linear fields
    assert abs(sim.fluid.energy()["kinetic"] / energy - 1) < 5e-3


def test_vortices_without_a_surface_decay_by_viscosity():
    # Taylor and Green's at a Reynolds number of 100: particles gather between them unless they are spread
    n = 20
    x = (np.arange(n) + 0.5) / n
    x, y = (2 * np.pi * a.ravel() for a in np.meshgrid(x, x, indexing="ij"))
    velocity = np.stack([-np.cos(x) * np.sin(y), np.sin(x) * np.cos(y)], axis=1)
    scene = cn.Scene(dim=2, periodic=cn.Periodic((1.0, 1.0)))
    places = np.stack([x, y], axis=1) / (2 * np.pi)
    scene.add(cn.fluid(places, 1 / n, density=1.0, viscosity=0.01, velocity=velocity, incompressible=True))
    sim = cn.Simulation(scene, dt=0.01)
    for _ in range(100):
        sim.step()
    size = np.sqrt(np.sum(sim.fluid.velocity**2) / np.sum(velocity**2))
    assert abs(size / np.exp(-0.08 * np.pi**2) - 1) < 0.06  # 0.18 without
    assert np.abs(np.mean(sim.fluid.velocity, axis=0)).max() < 1e-12


def test_poiseuille_by_viscosity_in_parts():
    n = 10
    scene = cn.Scene(dim=2, gravity=(0.8, 0.0), periodic=cn.Periodic((1.2, np.inf)))
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 1), (0, -1), rock))
    scene.add(cn.fluid([(0, 0), (1.2, 1)], 1.0 / n, density=1.0, viscosity=0.1, incompressible=True))
    sim = cn.Simulation(scene, dt=0.05)
    for _ in range(40):
        sim.step()
    near = np.abs(sim.fluid.position[:, 1] - 0.5) < 0.6 / n
    assert abs(sim.fluid.velocity[near, 0].mean() / 0.856637 - 1) < 1e-2  # nu t / L^2 = 0.2


@pytest.mark.filterwarnings("ignore:.*gaps under its spacing")
def test_a_run_goes_on_from_a_file_and_on_more_threads_to_the_same_bits(tmp_path):
    def simulation(threads):
        scene, _ = held_down(0.3, viscosity=0.1)
        return cn.Simulation(scene, dt=5e-3, strategy=cn.NSCD(threads=threads))

    one, two = simulation(1), simulation(2)
    for _ in range(4):
        one.step()
        two.step()
    one.checkpoint(tmp_path / "half.checkpoint.h5")
    for _ in range(4):
        one.step()
        two.step()
    again = simulation(1)
    again.restore(tmp_path / "half.checkpoint.h5")
    for _ in range(4):
        again.step()
    for other in (two, again):
        assert np.array_equal(one.fluid.position, other.fluid.position)
        assert np.array_equal(one.fluid.pressure, other.fluid.pressure)
        assert np.array_equal(one.bodies.velocity, other.bodies.velocity)


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e6])
def test_a_liquid_rests_whatever_its_size(size):
    scene, bed = tank(0.5 * size, 0.5 * size, spacing=0.1 * size)
    sim = cn.Simulation(scene, dt=0.04 * np.sqrt(size))
    for _ in range(5):
        sim.step()
    assert abs(sim.fluid.force_on(bed)[1] / (-250.0 * size**2) - 1) < 0.05


def test_few_particles_and_a_full_box():
    scene = cn.Scene(dim=3, gravity=(0, 0, -8.0))
    scene.add(cn.fluid([(0, 0, 0), (0.1, 0.1, 0.1)], 0.1, incompressible=True))
    sim = cn.Simulation(scene, dt=0.01)
    for _ in range(3):
        sim.step()
    assert np.allclose(sim.fluid.velocity, [0, 0, -0.24], rtol=1e-12)
    scene, _ = tank(0.5, 0.5, spacing=0.1)  # without air: the level of pressure is free
    scene.add(cn.wall((0, 0.5), (0, -1), rock))
    sim = cn.Simulation(scene, dt=0.02)
    for _ in range(5):
        sim.step()
    assert sim.info["status"] == "converged" and np.abs(sim.fluid.velocity).max() < 1e-2


def test_what_the_incompressible_form_does_not_do_is_refused():
    scene, _ = tank()
    with pytest.raises(ValueError, match="solved with the contacts of NSCD"):
        cn.Simulation(scene, dt=1e-3, strategy=cn.SmoothDEM())
    with pytest.raises(ValueError, match="solved with the contacts of NSCD"):
        cn.Simulation(scene, dt=1e-3, strategy=cn.SmoothDEM(energy=False), ranks=2).step()
    with pytest.raises(ValueError, match="leave it out"):
        cn.fluid([(0, 0), (1, 1)], 0.1, incompressible=True, artificial=0.1)
    scene, _ = tank(velocity=(20.0, 0.0))
    sim = cn.Simulation(scene, dt=0.02)
    with pytest.raises(ValueError, match="of its spacing: give a dt"):
        sim.step()


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("viscosity", [0.0, 0.1])
def test_velocities_that_are_not_finite_are_an_error(closed, viscosity):
    # In a periodic cell such a particle met no other one, and the step was "converged"
    water = cn.fluid([(0, 0), (1, 0.6)], 0.05, viscosity=viscosity, incompressible=True)
    scene = cn.Scene(dim=2, periodic=cn.Periodic((1.0, 0.6))) if closed else cn.Scene(dim=2, gravity=(0.0, -1.0))
    if not closed:
        scene.add(cn.wall((0, 0), (0, 1), rock))
    water.velocity[37, 1] = np.nan
    scene.add(water)
    sim = cn.Simulation(scene, dt=1e-3)
    for _ in range(2):  # the state is that before the step
        with pytest.raises(cn.Error, match="velocity of particle 37 of the fluid along axis 1 is nan"):
            sim.step()


def test_gaps_that_no_particle_fits_in_are_told():
    scene, _ = tank(0.6, 1.2, gravity=9.81)
    scene.add(cn.polygons(square_block(), rock, position=[[0.6, 0.15]]))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    with pytest.warns(UserWarning, match="gaps under its spacing"):
        cn.Simulation(scene, dt=1e-3)


@pytest.mark.parametrize("shape", ["vee", "trapezoid"])
def test_water_at_rest_between_walls_that_slope_stays_calm(shape):
    # The lattice does not fit them, and without viscosity walls would stir it: rms .06 m/s where nothing damps particles
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    c, s = np.cos(np.radians(35)), np.sin(np.radians(35))
    foot = 0.0 if shape == "vee" else 0.5
    scene.add(cn.wall((-foot, 0), (s, c), rock), cn.wall((foot, 0), (-s, c), rock))
    if foot:
        scene.add(cn.wall((0, 0), (0, 1), rock))
    scene.add(cn.fluid([(-2.0, 0), (2.0, 0.9)], 0.05, incompressible=True))
    scene.interact("fluid", "*", cn.FreeSlip())
    sim = cn.Simulation(scene, dt=4e-3)
    speeds, off = [], []
    for _ in range(250):
        sim.step()
        if sim.time > 0.5:
            speeds.append(np.mean(np.sum(sim.fluid.velocity**2, axis=1)))
            off.append(np.mean((sim.fluid.pressure / 9810 - (0.9 - sim.fluid.position[:, 1])) ** 2))
    assert np.sqrt(np.mean(speeds)) < 0.025
    assert np.sqrt(np.mean(off)) < 0.035 * 0.9


def test_damping_of_particles_keeps_momentum_and_takes_energy():
    # A heap that collapses on a floor
    grid = np.array([(x + 0.03 * (y % 2), y) for x in np.arange(12) for y in np.arange(10)]) * 0.05 + [-0.3, 0.025]
    noise = np.random.default_rng(3).normal(0.0, 0.1, grid.shape)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    bed = scene.add(cn.wall((0, 0), (0, 1), rock))[0]
    scene.add(cn.fluid(grid, 0.05, velocity=noise, incompressible=True))
    scene.interact("fluid", rock, cn.FreeSlip())
    sim = cn.Simulation(scene, dt=2e-3)
    mass = 1000.0 * 0.05**2
    along, energy, begin = mass * noise[:, 0].sum(), np.inf, 0.5 * mass * np.sum(noise**2)
    for _ in range(40):
        sim.step()
        along -= 2e-3 * sim.fluid.force_on(bed)[0]
        now = sim.fluid.energy()["kinetic"] + 9.81 * mass * np.sum(sim.fluid.position[:, 1] - 0.025)
        assert now < energy + 1e-3 * begin
        energy = now
    assert abs(mass * sim.fluid.velocity[:, 0].sum() - along) < 1e-10 * mass * np.abs(sim.fluid.velocity[:, 0]).sum()


def thrown(field, dim, viscosity=0.0):
    """Velocities of a body of water under a pressure of the start and without walls: at the begin, and what a step makes of
    them without gravity and with it, less the fall."""
    x = 0.05 * (np.stack(np.meshgrid(*[np.arange(8)] * dim, indexing="ij"), -1).reshape(-1, dim) - 3.5)
    x += 0.01 * (np.random.default_rng(1).random(x.shape) - 0.5)
    begin, ends = field(x), []
    for gravity in (0.0, 9.81):
        scene = cn.Scene(dim=dim, gravity=(*(0.0,) * (dim - 1), -gravity))
        scene.add(cn.fluid(x, 0.05, velocity=begin, viscosity=viscosity, pressure=5e3, incompressible=True))
        sim = cn.Simulation(scene, dt=2e-3)
        sim.step()
        ends.append(np.array(sim.fluid.velocity) + gravity * 2e-3 * np.eye(dim)[-1])
    return begin, *ends


@pytest.mark.filterwarnings("ignore:.*falls without end")
@pytest.mark.parametrize("dim", [2, 3])
def test_a_flow_that_is_linear_over_a_kernel_has_no_damping(dim):
    """Pressures are found to a thousandth of those of gravity, 2e-3 m/s here, whatever the flow."""
    slope = np.array([[0.0, 20.0, 6.0], [8.0, 0.0, 12.0], [-6.0, -12.0, 0.0]])[:dim, :dim]
    begin, without, damped = thrown(lambda x: x @ slope.T, dim)
    assert np.abs(damped - without).max() < 1.5e-3 * np.abs(begin).max()


@pytest.mark.filterwarnings("ignore:.*falls without end")
@pytest.mark.parametrize("dim", [2, 3])
def test_noise_of_particles_is_damped_by_gravity_and_less_with_viscosity(dim):
    noise = np.random.default_rng(3).normal(0.0, 1.0, (8**dim, dim))
    begin, without, damped = thrown(lambda x: noise, dim)
    assert np.sum(damped**2) < 0.97 * np.sum(without**2)
    for end in (without, damped):
        assert np.abs((end - begin).sum(axis=0)).max() < 1e-12 * np.abs(noise).sum()
    _, without, damped = thrown(lambda x: noise, dim, viscosity=13.0)  # 8 nu/dx is more than sqrt(p/rho)
    assert abs(np.sum(damped**2) / np.sum(without**2) - 1) < 2e-3


def test_velocities_beyond_the_range_of_numbers_are_an_error_of_the_pressure():
    scene, _ = tank(gravity=9.81)
    scene.gravity = lambda t: (0.0, -9.81 if t < 0.03 else -1e300)
    sim = cn.Simulation(scene, dt=0.02)
    sim.step()
    with pytest.raises(cn.Error, match="pressure of particle .* not finite"):
        for _ in range(3):
            sim.step()
