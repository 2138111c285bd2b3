"""Networks and the rest: laws that depend on temperature, steps that are repeated, files, shadows."""

import shutil
import subprocess
from pathlib import Path

import cairn as cn
import numpy as np
import pytest

N = cn.networks
R = 1e-3
STEEL = cn.Material("steel", density=7800.0, young=210e9, poisson=0.3, resistivity=1 / 5.9e6, conductivity=50.0, capacity=460.0)
HELD = ("vx", "vy", "vz", "wx", "wy", "wz")
PLUG = Path(cn.__file__).resolve().parent / "plugs" / "cairn_plug.f90"


# ---------------------------------------------------------------------- laws of temperature


def sliding(law, temperature, **thermal):
    """A block at 2 m/s on a plane, at given temperatures of both."""
    iron = cn.Material("iron", density=1.0, conductivity=60.0, capacity=450.0, young=2e11, poisson=0.3)
    scene = cn.Scene(2, gravity=(0.0, -10.0))
    scene.add(cn.disks([[0.0, 1.0]], 1.0, iron, density=1 / np.pi, velocity=(2.0, 0.0, 0.0), group="block").with_(driven=("w",)))
    scene.add(cn.wall((0, 0), (0, 1), iron, group="plane"))
    scene.interact("*", "*", law)
    scene.thermal(conductance=N.Constant(conductance=0.0), initial=dict(zip(("block", "plane"), temperature)), friction="none",
                  **thermal)  # fmt: skip
    return scene


def speeds(scene, steps=10, dt=0.01):
    sim = cn.Simulation(scene, dt)
    out = [2.0]
    for _ in range(steps):
        sim.step()
        out.append(float(sim.bodies.velocity[0, 0]))
    return np.array(out)


FADES = N.OfTemperature((300.0, 500.0), (0.4, 0.1))


def test_friction_by_the_mean_temperature_of_both_sides():
    for temperature, mu in (((300.0, 300.0), 0.4), ((500.0, 300.0), 0.25), ((500.0, 500.0), 0.1), ((900.0, 900.0), 0.1)):
        assert np.diff(speeds(sliding(cn.Coulomb(mu=FADES), temperature))) == pytest.approx(-mu * 10 * 0.01, rel=1e-9)
    sharp = speeds(sliding(cn.Restitution(mu=FADES, normal=0.0), (400.0, 400.0)))
    assert np.diff(sharp) == pytest.approx(-0.25 * 10 * 0.01, rel=1e-9)


def test_friction_that_fades_as_it_heats():
    """m c T' = mu(T) m g v and v' = -mu(T) g: the kinetic energy lost is heat, and the mean T is linear in it, so v(t) has a
    closed form."""
    law = cn.Coulomb(mu=N.OfTemperature((300.0, 300.001), (0.4, 0.0)))
    scene = sliding_with_heat(law)
    errors = []
    for n in (50, 100, 200):
        v = speeds(scene, n, 1.0 / n)[-1]
        # with T - 300 = (v0^2 - v^2)/4c of the block alone and the mean of both sides half of it
        times = np.linspace(0, 1, 20001)
        w, h = 2.0, times[1]
        slope = lambda w: -10 * 0.4 * max(0.0, 1 - (4 - w * w) / (8 * 450.0) / 0.001)  # noqa: E731
        for _ in times[1:]:
            middle = w + h / 2 * slope(w)
            w += h * slope(middle)
        errors.append(abs(v - w))
    assert errors[0] < 0.05 and errors[2] < 0.3 * errors[0]  # first order: it sees the temperatures of the begin


def test_cohesion_by_temperature():
    """A cohesive zone that softens by heat gives way at a force that its work sets, where it is hot at half of that."""
    opened = []
    for t in (300.0, 500.0):
        work = N.OfTemperature((300.0, 500.0), (10.0, 5.0))
        law = cn.MAC(normal_stiffness=1e9, tangential_stiffness=1e9, work=work)
        scene = cn.Scene(2)
        square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
        pull = cn.Table([0.0, 1.0], [(0.0, 0.0, 0.0), (0.0, 2e5, 0.0)])
        scene.add(cn.polygons(square, STEEL, position=[[0, 0.5]], group="brick", driven=("vx", "w"), force=pull))
        scene.add(cn.wall((0, 0), (0, 1), STEEL, group="floor"))
        scene.interact("*", "*", law)
        scene.thermal(conductance=N.Constant(conductance=0.0), initial=t, friction="none")
        sim = cn.Simulation(scene, 1e-3)
        for _ in range(1000):
            sim.step()
            if np.min(sim.contacts.beta, initial=1.0) < 1:
                break
        opened.append(2e5 * sim.time)
    # where c d^2 = w, at a stress of sqrt(w c)
    assert opened == pytest.approx(np.sqrt([10.0 * 1e9, 5.0 * 1e9]), rel=0.02)


FIELDS = """
module warmth
  use, intrinsic :: iso_c_binding
  use cairn_plug
  implicit none
contains
  subroutine prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c, name="")
    integer(c_int32_t), value           :: n, c
    type(cairn_law_context), intent(in) :: context
    real(c_double), intent(in)          :: gap(n), u_begin(n, c), params(n, *)
    real(c_double), intent(inout)       :: state(n, *)
    real(c_double), intent(out)         :: bias(n, c), compliance(n, c), mu(n)
    real(c_double), pointer :: fields(:, :)
    bias = 0
    bias(:, 1) = max(gap, 0.0_c_double)/context%h
    compliance = 0
    call c_f_pointer(context%fields, fields, [n, 4])
    mu = params(:, 1)*max(fields(:, 1), fields(:, 2))/1000
  end subroutine
  subroutine describe(descriptor) bind(c, name="cairn_describe_warmth")
    type(cairn_plug_descriptor), intent(inout) :: descriptor
    call describe_law(descriptor, "warmth", prepare, parameters="mu::0:inf")
  end subroutine
end module
"""


@pytest.mark.skipif(not shutil.which("gfortran"), reason="no gfortran to build a library with")
def test_a_plugged_law_reads_the_temperatures_of_both_sides(tmp_path):
    (tmp_path / "warmth.f90").write_text(FIELDS)
    out = tmp_path / "libwarmth.so"
    subprocess.run(["gfortran", "-O1", "-shared", "-fPIC", "-J", str(tmp_path), str(PLUG), str(tmp_path / "warmth.f90"), "-o",
                    str(out)], check=True)  # fmt: skip
    law = cn.plug(out, law="warmth", params=[0.5])
    assert np.diff(speeds(sliding(law, (600.0, 400.0)))) == pytest.approx(-0.3 * 10 * 0.01, rel=1e-9)


def test_laws_of_temperature_where_there_is_none_are_refused():
    scene = sliding(cn.Coulomb(mu=FADES), (300.0, 300.0))
    scene.networks.clear()
    with pytest.raises(ValueError, match="depends on temperature"):
        cn.Simulation(scene, 0.01).step()
    with pytest.raises(ValueError, match="mu of Coulomb is -1 at some temperature"):
        cn.Coulomb(mu=N.OfTemperature((300.0, 400.0), (0.1, -1.0)))
    with pytest.raises(ValueError, match="depend on temperature"):
        scene = sliding(cn.LinearSpring(stiffness=1e4, mu=FADES), (300.0, 300.0))
        cn.Simulation(scene, 1e-4, cn.SmoothDEM()).step()


# ---------------------------------------------------------------------- steps that are repeated


def bar(coupling, dt=2.0, **options):
    """A bar between walls that a power heats: held, it is pressed; its step sees the begin of it or, repeated, its end."""
    hot = cn.Material("hot", density=7800.0, conductivity=1e7, capacity=500.0, expansion=1.2e-5)
    x = np.linspace(0, 0.2, 5)
    points = np.stack(np.meshgrid(x, [0.0, 0.05], indexing="ij"), -1).reshape(-1, 2)
    k = np.arange(10).reshape(5, 2)
    cells = np.stack([k[:-1, 0], k[1:, 0], k[1:, 1], k[:-1, 1]], -1)
    groups = {"left": k[0], "right": k[-1], "bottom": k[:, 0], "all": k.ravel()}
    body = cn.ElasticBody(points, {"quad": cells}, young=200e9, poisson=0.3, density=7800.0, groups=groups, plane="stress",
                          rayleigh=(3e3, 0.0))  # fmt: skip
    scene = cn.Scene(2)
    scene.add(cn.deformable(body, hot, fixed={"left": "x", "right": "x", "bottom": "y"}, name="bar"))
    scene.thermal(power={"bar.all": 100.0}, initial=293.15, friction="none", coupling=coupling, **options)
    return cn.Simulation(scene, dt, cn.NSCD(theta=1.0))


def test_a_repeated_step_sees_the_temperatures_of_its_end():
    staggered, repeated = bar("staggered"), bar(1e-10)
    for _ in range(40):
        staggered.step()
        repeated.step()
    rise = repeated.nodes.temperature[0] - 293.15
    assert staggered.nodes.temperature[0] - 293.15 == pytest.approx(rise, rel=1e-12)
    assert repeated.meshes[0].stress["quad"][:, 0] == pytest.approx(-200e9 * 1.2e-5 * rise, rel=1e-5)
    assert staggered.info["thermal"]["coupling"] == pytest.approx(1 / 40, rel=1e-9)  # what came in the last of forty steps
    assert staggered.info["thermal"]["passes"] == 1
    assert repeated.info["thermal"]["coupling"] <= 1e-10 and repeated.info["thermal"]["passes"] == 2
    assert repeated.info["thermal"]["balance"] == staggered.info["thermal"]["balance"]


def test_a_repeated_step_restarts_to_the_same_bits(tmp_path):
    one, other = bar(1e-10), bar(1e-10)
    for _ in range(5):
        one.step()
    one.checkpoint(tmp_path / "c.h5")
    other.restore(tmp_path / "c.h5")
    for sim in (one, other):
        for _ in range(5):
            sim.step()
    assert one.bodies.position.tobytes() == other.bodies.position.tobytes()
    assert one.bodies.temperature.tobytes() == other.bodies.temperature.tobytes()


def test_heat_of_friction_by_a_friction_that_it_changes():
    """Repeated, the step takes the friction of the temperatures at its end: the two orders of a first-order error."""
    law = cn.Coulomb(mu=N.OfTemperature((300.0, 300.001), (0.4, 0.0)))
    ends = {}
    for coupling in ("staggered", 1e-9):
        scene = sliding(law, (300.0, 300.0), coupling=coupling)
        scene.networks["thermal"].friction = "halves"
        sim = cn.Simulation(scene, 0.05)
        for _ in range(20):
            sim.step()
        assert sim.info["thermal"]["status"] == "converged"
        balance = sim.info["thermal"]["balance"]
        assert abs(balance["closure"]) <= 1e-12 * balance["in_play"]
        assert balance["friction"] == pytest.approx((4 - sim.bodies.velocity[0, 0] ** 2) / 2, rel=1e-9)
        ends[coupling] = float(sim.bodies.velocity[0, 0])
    fine = speeds(sliding_with_heat(law), 4000, 1.0 / 4000)[-1]
    assert (ends["staggered"] - fine) * (ends[1e-9] - fine) < 0


def sliding_with_heat(law):
    scene = sliding(law, (300.0, 300.0))
    scene.networks["thermal"].friction = "halves"
    return scene


# ---------------------------------------------------------------------- files, shadows


def everything():
    hot = N.OfTemperature((300.0, 600.0), (50.0, 40.0))
    steel = cn.Material("steel", density=7800.0, young=210e9, poisson=0.3, resistivity=1.7e-7, conductivity=hot, capacity=460.0,
                        expansion=1.2e-5, latent=(1e4, 900.0, 950.0))  # fmt: skip
    scene = cn.Scene(3, gravity=(0.0, 0.0, -9.81))
    rng = np.random.default_rng(3)
    place = np.array([[2.001 * R * i, 2.001 * R * j, R + 2.001 * R * k] for k in range(3) for j in range(2) for i in range(2)])
    scene.add(cn.spheres(place + rng.uniform(-1e-6, 1e-6, place.shape), R, steel, group="grains"))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), steel, group="floor"))
    scene.interact("*", "*", cn.Coulomb(mu=N.OfTemperature((300.0, 600.0), (0.5, 0.2))))
    top = np.array([8, 9, 10, 11])
    scene.electrical(
        conductance=[N.Holm(), N.Sharvin(free_path=4e-8)], film=N.OxideFilm(conductance=1e-3, power=1e-6),
        current=[(top, cn.Harmonic(0.01, 50.0)), ("floor", cn.Harmonic(-0.01, 50.0))], wires=[(0, 5, 1.0)],
    )  # fmt: skip
    table = N.Given(pressures=[0.0, 1e6], gaps=[0.0, 1e-6], h=[[1.0, 2.0], [3.0, 4.0]], area=1e-6)
    scene.thermal(conductance=[N.Holm(), table], initial={"grains": 350.0, "floor": 300.0}, theta=0.5,
                  convection=[("grains", 20.0, None, 290.0)], radiation=[("grains", 0.5, None, cn.Harmonic(5.0, 3.0, 290.0))],
                  friction="effusivity")  # fmt: skip
    return scene


def test_a_scene_file_has_its_networks(tmp_path):
    scene = everything()
    scene.save(tmp_path / "s.scene.h5")
    again = cn.Scene.load(tmp_path / "s.scene.h5")
    sims = [cn.Simulation(s, 1e-4, overlap="ignore") for s in (scene, again)]
    for sim in sims:
        for _ in range(5):
            sim.step()
    for field in ("temperature", "potential", "position"):
        assert getattr(sims[0].bodies, field).tobytes() == getattr(sims[1].bodies, field).tobytes()
    assert again.rules[0][2] == scene.rules[0][2] and "OfTemperature" in repr(again.rules[0][2])
    scene.thermal(power={"grains": lambda t: t})
    with pytest.raises(ValueError, match="Python function"):
        scene.save(tmp_path / "t.scene.h5")


def test_everything_restarts_to_the_same_bits_and_bears_a_shadow(tmp_path):
    one, other, watched = (cn.Simulation(everything(), 1e-4, overlap="ignore") for _ in range(3))
    shadow = watched.shadow("compute_free_velocity", tol=1e-9, folder=tmp_path)
    for _ in range(4):
        one.step()
    one.checkpoint(tmp_path / "c.h5")
    other.restore(tmp_path / "c.h5")
    for _ in range(4):
        one.step()
        other.step()
    for _ in range(8):
        watched.step()
    for sim in (other, watched):
        for field in ("temperature", "potential", "position"):
            assert getattr(one.bodies, field).tobytes() == getattr(sim.bodies, field).tobytes()
        assert one.info["electrical"]["balance"] == sim.info["electrical"]["balance"]
        assert one.info["thermal"]["balance"] == sim.info["thermal"]["balance"]
    assert len(shadow.records) == 8 and shadow.beyond is None
