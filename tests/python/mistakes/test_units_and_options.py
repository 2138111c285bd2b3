"""Wrong units, which the weights of the scene show, and mistakes with options of liquids, plugs and wrapped laws."""

import re
import warnings

import cairn as cn
import numpy as np
import pytest
from cairn.plugs.wrap_law import wrap_law
from cairn.post.convert import convert
from cairn.pre import masonry

ROCK = cn.Material("rock", density=2600.0)
SQUARE = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
# powers of two for mass, length and time
SCALES = [(1.0, 1.0, 1.0), (2.0**-60, 2.0**-10, 2.0**7), (2.0**40, 2.0**12, 2.0**-9)]


def scene(*sets, dim=2, gravity=-9.81, law=None):
    made = cn.Scene(dim, gravity=(0.0,) * (dim - 1) + (gravity,))
    made.add(*sets)
    made.interact("*", "*", law or cn.Coulomb(mu=0.5))
    return made


def ball(dim=2, height=0.5, radius=0.5, material=ROCK):
    return (cn.disks if dim == 2 else cn.spheres)([(0.0,) * (dim - 1) + (height,)], radius, material)


def floor(dim=2, sign=1.0, material=ROCK):
    return cn.wall((0.0,) * dim, (0.0,) * (dim - 1) + (sign,), material)


def mesh(young, dim=2, scale=(1.0, 1.0, 1.0), solid=False, density=2400.0):
    m, x, t = scale
    points = np.array(np.meshgrid(*[[0.0, x]] * dim, indexing="ij")).reshape(dim, -1).T
    cells = {"quad": [[0, 2, 3, 1]]} if dim == 2 else {"hexahedron": [[0, 4, 6, 2, 1, 5, 7, 3]]}
    young, density = young * m / (x * t * t), density * m / x**3
    if solid:
        body = cn.SolidBody(points, cells, cn.NeoHookean(young=young, poisson=0.3), density=density)
    else:
        body = cn.ElasticBody(points, cells, young=young, poisson=0.3, density=density)
    made = cn.Scene(dim, gravity=(0.0,) * (dim - 1) + (-9.81 * x / t**2,), **({"depth": x} if dim == 2 else {}))
    made.add(cn.deformable(body, ROCK))
    return cn.Simulation(made, 1e-3 * t, overlap="ignore")


def told(call):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    return [str(w.message) for w in caught if w.category is cn.UnitsWarning]


def wall_with(law):
    made = cn.Scene(2, gravity=(0.0, -9.81))
    masonry.panel(2, 2).add_to(made, ROCK)
    made.interact("*", "*", law)
    return cn.Simulation(made, 1e-3)


def composite(unit, **changes):
    stresses = {"tension": 0.25, "cohesion": 0.35, "cap": 8.5}
    given = {name: value * unit for name, value in stresses.items()} | {"cap_work": 5e3} | changes
    return cn.CompositeInterface(normal_stiffness=8.2e10, tangential_stiffness=3.6e10, normal_work=18.0, tangential_work=125.0,
                                 friction=0.75, mu=0.75, **given)  # fmt: skip


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("solid", [False, True])
def test_stiffness_of_meshes_in_megapascals(dim, solid, scale):
    """A cube of concrete of 30 GPa: typed 3e4, its weight is 78 % of that. Rescaling changes nothing."""
    wrong = told(lambda: mesh(3e4 if not solid else 30.0, dim, scale, solid))
    assert len(wrong) == 1 and "young of mesh 0" in wrong[0] and "give pascals" in wrong[0]
    assert not told(lambda: mesh(3e10, dim, scale, solid)) and not told(lambda: mesh(1e6, dim, scale, solid))


@pytest.mark.parametrize("law", [
    lambda u: composite(u), lambda u: cn.MohrCoulomb(tension=0.1 * u, cohesion=0.2 * u, mu=0.5),
    lambda u: cn.MAL(normal_stiffness=1e10, tangential_stiffness=1e10, normal_strength=0.1 * u, tangential_strength=0.1 * u,
                     normal_work=10.0, tangential_work=10.0, mu=0.5),
])  # fmt: skip
def test_strengths_of_joints_in_megapascals(law):
    wrong = told(lambda: wall_with(law(1.0)))
    assert len(wrong) == 1 and "such bonds bear nothing; give pascals" in wrong[0]
    assert not told(lambda: wall_with(law(1e6)))


def test_a_joint_that_bears_no_tension_is_no_mistake():
    assert not told(lambda: wall_with(cn.MohrCoulomb(tension=0.0, cohesion=1e5, mu=0.5)))
    assert not told(lambda: wall_with(cn.Coulomb(mu=0.5)))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("law, wrong, right", [
    (lambda e: cn.HertzMindlin(young=e, poisson=0.3, restitution=0.5, mu=0.3), 70.0, 70e9),
    (lambda e: cn.JKR(young=e, poisson=0.3, work=0.1, restitution=0.5), 70.0, 70e9),
    (lambda k: cn.LinearSpring(stiffness=k, restitution=0.5, mu=0.3), 100.0, 1e8),
])  # fmt: skip
def test_stiffness_of_smooth_contacts(dim, law, wrong, right):
    def make(value):
        made = scene(ball(dim), floor(dim), dim=dim, law=law(value))
        return cn.Simulation(made, "stable", cn.SmoothDEM(), overlap="ignore")

    said = told(lambda: make(wrong))
    assert len(said) == 1 and "bodies sink by" in said[0] and "under their own weight" in said[0]
    assert not told(lambda: make(right))


@pytest.mark.parametrize("dim", [2, 3])
def test_gravity_that_pulls_away_from_the_floor(dim):
    assert "turn its sign" in told(lambda: cn.Simulation(scene(ball(dim), floor(dim), dim=dim, gravity=9.81), 1e-3))[0]
    assert not told(lambda: cn.Simulation(scene(ball(dim), floor(dim), dim=dim), 1e-3))
    ramp = cn.Table([0.0, 1.0], [(0.0,) * (dim - 1) + (9.81,)] * 2)
    over = cn.Scene(dim, gravity=ramp)
    over.add(ball(dim), floor(dim))
    over.interact("*", "*", cn.Coulomb(mu=0.5))
    assert "turn its sign" in told(lambda: cn.Simulation(over, 1e-3))[0]
    below = scene(ball(dim, -0.5), floor(dim, -1.0), dim=dim, gravity=9.81)  # a roof that bears, with axes downwards
    assert not told(lambda: cn.Simulation(below, 1e-3))
    held = scene(ball(dim), floor(dim), dim=dim, gravity=9.81)
    dofs = ("vx", "vy", "w") if dim == 2 else ("vx", "vy", "vz", "wx", "wy", "wz")
    held.add((cn.disks if dim == 2 else cn.spheres)([(0.0,) * (dim - 1) + (3.0,)], 0.5, ROCK, driven=dofs))
    assert not told(lambda: cn.Simulation(held, 1e-3)), "something holds them there"


def cell_of_disks():
    made = cn.Scene(2, periodic=cn.Periodic((8.0, 2.0)))
    ids = made.add(cn.disks([(0.5 + 2 * k, 0.5) for k in range(4)], 0.2, ROCK))
    made.interact("*", "*", cn.Coulomb(mu=0.4))
    return cn.Simulation(made, 1e-3), ids


def test_rates_in_percent():
    sim, ids = cell_of_disks()
    assert "give it per second, 0.05 for 5 %" in told(lambda: sim.grow(ids, 500.0))[0]
    assert not told(lambda: sim.grow(ids, 5.0)) and not told(lambda: sim.grow(ids, None))
    assert "rate['xx'] of the cell is -200 /s" in told(lambda: sim.drive_cell(rate={"xx": -200.0}))[0]
    assert not told(lambda: sim.drive_cell(rate={"xx": -2.0})) and not told(
        lambda: sim.drive_cell(rate={"xx": cn.Expression("-2")})
    )


def pool(**options):
    made = scene(floor(), cn.wall((0, 0), (1, 0), ROCK), cn.wall((1, 0), (-1, 0), ROCK))
    made.add(cn.fluid(**{"region": [(0.0, 0.0), (1.0, 0.4)], "spacing": 0.1} | options))
    return cn.Simulation(made, 1e-3)


def of_interface(folder, *lines):
    text = 'name = "w"\nroutine = "W"\nsources = ["w.f"]\nslot = "prepare"\narguments = ["gap", "bias1", "mu"]\n'
    (folder / "w.toml").write_text(text + "\n".join(lines) + "\n")
    return wrap_law(folder / "w.toml", folder)


def converted(folder, name):
    cn.Simulation(scene(ball(), floor()), 1e-3).run(steps=1, output=folder / "a.vtkhdf", progress=False)
    return convert(folder / "a.vtkhdf", folder / name)


def of_source(folder, name):
    (folder / name).write_text("      END\n")
    return cn.plug(folder / name, material="mine", state=1)


ERRORS = {
    "incompressible as a word": (lambda f: pool(incompressible="yes"), "incompressible is 'yes': give True or False"),
    "a field of the liquid misspelt": (lambda f: pool().fluid.presure, "did you mean 'pressure'"),
    "a field of the liquid assigned": (lambda f: setattr(pool().fluid, "velocity", 0.0), "velocity of the fluid cannot be"),
    "a liquid added late": (lambda f: pool().add(cn.fluid([(0, 1), (1, 2)], 0.1)), "<fluid 'fluid', 2D: 100 particles"),
    "a Fortran source plugged": (lambda f: of_source(f, "mine.f"), "gfortran -O2 -shared -fPIC mine.f -o libmine.so"),
    "a C source plugged": (lambda f: of_source(f, "mine.c"), "gcc -O2 -shared"),
    "isolate as a word": (lambda f: cn.plug("libx.so", material="x", state=1, isolate="yes"), "isolate is 'yes': give True"),
    "isolate quoted": (lambda f: of_interface(f, 'isolate = "no"'), "isolate is 'no': give true or false, without quotes"),
    "thread_safe quoted": (lambda f: of_interface(f, 'thread_safe = "false"'), "thread_safe is 'false': give true or false"),
    "a limit of what is not isolated": (lambda f: of_interface(f, "time_limit = 3"), "give isolate = true, too"),
    "an option of a class's method": (lambda f: cn.Scene.load("a.scene.h5", pth=1), "Scene.load has no argument 'pth'; it has"),
    "a disk that is fixed": (lambda f: cn.disks([(0, 0)], 0.5, ROCK, fixed=True), "did you mean 'driven'"),
    "a .pvd of a run": (lambda f: converted(f, "a.pvd"), "give .vtp: the .pvd of all outputs comes with it"),
    "a fluid misspelt": (lambda f: pool().scene.interact("flud", ROCK, cn.NoSlip()), "did you mean 'fluid'"),
    "an axis that is not periodic": (lambda f: cn.Scene(2, periodic=cn.Periodic((8.0, None))), "give inf or 0 along axes"),
    "the beginning of a name": (lambda f: cn.Hertz, "did you mean 'HertzMindlin'"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", ERRORS)
def test_mistakes_are_answered(mistake, tmp_path):
    call, words = ERRORS[mistake]
    with pytest.raises(Exception, match=words) as caught:
        call(tmp_path)
    assert len(str(caught.value)) < 400


def test_print_of_a_body_of_cells():
    body = cn.ElasticBody(SQUARE, {"quad": [[0, 1, 2, 3]]}, young=1e9, poisson=0.3, groups={"foot": [0, 1]})
    assert repr(body) == "<ElasticBody, 2D: 4 nodes, cells: 1 quad; groups 'foot'>"


def test_soft_bodies_that_bear_their_weight_are_no_mistake():
    """Peat and jelly, which settle by a fifth; ground under the stress of its weight; a gel that floats."""

    def made(young, high, **options):
        points = np.array([(0, 0), (high, 0), (high, high), (0, high)], float)
        body = cn.ElasticBody(points, {"quad": [[0, 1, 2, 3]]}, young=young, poisson=0.3, density=1000.0)
        return cn.Simulation(scene(cn.deformable(body, ROCK, **options)), 1e-3)

    assert not told(lambda: made(5e5, 10.0)) and not told(lambda: made(3e3, 0.06))
    assert told(lambda: made(1e4, 1.0))
    assert not told(lambda: made(1e4, 1.0, initial_stress=(-2e3, -1e4, -2e3, 0.0, 0.0, 0.0)))
    assert not told(lambda: made(1e4, 1.0, body_force=(0.0, 9810.0)))


def test_bodies_thrown_or_stuck_to_a_ceiling_are_no_mistake():
    ceiling = floor(sign=-1.0)
    assert told(lambda: cn.Simulation(scene(ball(height=-1.0), ceiling), 1e-3))
    thrown = cn.disks([(0.0, -1.0)], 0.5, ROCK, velocity=(0.0, 8.0))
    assert not told(lambda: cn.Simulation(scene(thrown, ceiling), 1e-3))
    stuck = scene(ball(height=-0.5), ceiling, law=cn.Wet(force=1e6, reach=0.01, mu=0.5))
    assert not told(lambda: cn.Simulation(stuck, 1e-3))


@pytest.mark.parametrize("cell", [{"rate": {"yy": -150.0}}, {"rate": {"xy": 500.0}}, {"shear_rate": 500.0}])
def test_rates_of_a_new_cell_in_percent(cell):
    def made(factor):
        rates = {k: {n: v * factor for n, v in r.items()} if isinstance(r, dict) else r * factor for k, r in cell.items()}
        space = cn.Scene(2, periodic=cn.Periodic((2.0, 2.0), **rates))
        space.add(cn.disks([(0.5, 0.5), (1.5, 1.5)], 0.3, ROCK))
        space.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
        return cn.Simulation(space, 1e-3)

    assert "of the cell is" in told(lambda: made(1.0))[0]
    assert not told(lambda: made(0.01))


def box_of(material=ROCK, dim=2, dt=1e-3, radius=0.5, law=None, strategy=None, **options):
    shape = cn.disks if dim == 2 else cn.spheres
    made = scene(shape([(0.0,) * (dim - 1) + (radius,)], radius, material, **options), floor(dim), dim=dim, law=law)
    return cn.Simulation(made, dt, strategy)


JOINED = {"young": 7e10, "poisson": 0.2, "restitution": 0.5}
SMOOTH = cn.SmoothDEM()
OTHER_UNITS = {
    "grams per cm3": (lambda v: box_of(cn.Material("quartz", density=v)), 2.65, 2650.0, "give kg/m3, 2650 for 2.65 g/cm3"),
    "of spheres": (lambda v: box_of(cn.Material("lead", density=v), dim=3), 11.3, 90.0, "give kg/m3, 11300"),
    "of a mesh": (lambda v: mesh(3e10, density=v), 2.4, 2400.0, "density of mesh 0 is 2.4 kg/m3"),
    "waves": (lambda v: mesh(v), 3e13, 3e12, "waves of 1.12e.05 m/s, faster than in any solid"),
    "of a liquid": (lambda v: pool(density=v), 1.0, 1000.0, "density of 'fluid' is 1 kg/m3, and no liquid is as light"),
    "an angle of friction": (lambda v: box_of(law=cn.Coulomb(mu=v)), 30.0, 1e3, "of 30 degrees give 0.577"),
    "an angle of rotation": (lambda v: box_of(rotation=[v]), 45.0, 45.25, "rotation is 45, .* give 0.785"),
    "milliseconds": (lambda v: box_of(dt=v, radius=0.01), 1.0, 1e-2, "dt is 1 s, .* give seconds, 0.001 for 1 ms"),
    "millimetres, wet": (lambda v: box_of(dim=3, radius=v, law=cn.Wet(force=1e-4, reach=1e-5, mu=0.3)), 5.0, 5e-3,
                         "force of Wet is 0.0001 N, .* so that it has no effect: give metres, 0.005 for 5 mm"),
    "millimetres, sticky": (lambda v: box_of(dim=3, dt="stable", radius=v, law=cn.JKR(work=0.1, **JOINED), strategy=SMOOTH),
                            5.0, 5e-3, "work of JKR is 0.1 J/m2"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", OTHER_UNITS)
def test_values_in_other_units_than_si(mistake):
    make, wrong, right, words = OTHER_UNITS[mistake]
    said = told(lambda: make(wrong))
    assert len(said) == 1 and re.search(words, said[0])
    assert not told(lambda: make(right))


def test_a_limit_of_a_pivot_in_degrees():
    def made(*limits):
        joined = cn.Scene(2, gravity=(0.0, -9.81))
        ids = joined.add(cn.disks([(0, 0), (1, 0)], 0.3, ROCK))
        joined.interact("*", "*", cn.Coulomb(mu=0.3))
        joined.join(*ids, cn.Pivot(point=(0.5, 0.0), limits=limits))
        return cn.Simulation(joined, 1e-3)

    assert "the lower limit of a joint is -30 rad: give radians, -0.5236" in told(lambda: made(-30, 30))[0]
    assert not told(lambda: made(-3.0, 4 * np.pi)) and not told(lambda: made(-np.inf, np.inf))


def test_units_that_are_not_si_are_not_judged():
    """A scene in grams, centimetres and seconds: its gravity is 981."""
    made = scene(ball(material=cn.Material("quartz", density=2.65)), floor(), gravity=-981.0)
    assert not told(lambda: cn.Simulation(made, 1e-3))
    other = cn.Material("given", density=1.0)  # of another density than the bodies have
    assert not told(lambda: box_of(other, 3, density=2650.0)) and told(lambda: box_of(ROCK, 3, density=2.65))
