"""Contact laws from users' libraries: the template, the refusals, and what a library gives back that is no number."""

import shutil
import subprocess
import sys
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn.plugs.new_law import build_line, new_law

PLUG = Path(cn.__file__).resolve().parent / "plugs" / "cairn_plug.f90"
pytestmark = pytest.mark.skipif(not shutil.which("gfortran"), reason="no gfortran to build a library with")

LAW = """
module mine
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
    bias = 0
    bias(:, 1) = max(gap, 0.0_c_double)/context%h
    compliance = 0
    mu = params(:, 1)
    {prepare}
  end subroutine
  subroutine solve(n, c, w, u_free, bias, params, state, r, status) bind(c, name="")
    integer(c_int32_t), value     :: n, c
    real(c_double), intent(in)    :: w(n, c, c), u_free(n, c), bias(n, c), params(n, *), state(n, *)
    real(c_double), intent(inout) :: r(n, c)
    integer(c_int32_t), intent(out), optional :: status(n)
    r = 0
    r(:, 1) = max(0.0_c_double, -u_free(:, 1)/w(:, 1, 1))
    {solve}
    if (present(status)) status = merge(2, 0, r(:, 1) > 0)
  end subroutine
  subroutine commit(n, c, context, gap, u, r, params, state) bind(c, name="")
    integer(c_int32_t), value           :: n, c
    type(cairn_law_context), intent(in) :: context
    real(c_double), intent(in)          :: gap(n), u(n, c), r(n, c), params(n, *)
    real(c_double), intent(inout)       :: state(n, *)
    {commit}
  end subroutine
  subroutine describe(descriptor) bind(c, name="cairn_describe_{name}")
    type(cairn_plug_descriptor), intent(inout) :: descriptor
    call describe_law(descriptor, "{name}", prepare, {options})
    {after}
  end subroutine
end module
"""


UNIT = "params(:, 1)/params(:, 1)"  # no number where there is no parameter
DIVIDES = f"bias = bias*spread({UNIT}, 2, c); mu = mu*{UNIT}"


def library(folder, name, options='parameters="mu::0:inf"', *, prepare="", solve="", commit="", after=""):
    """Builds the law above, with statements put in; the path of the library."""
    text = LAW.format(name=name, options=options, prepare=prepare, solve=solve, commit=commit, after=after)
    source = folder / f"{name}.f90"
    source.write_text(text, encoding="utf-8")
    out = folder / f"lib{name}.so"
    command = ["gfortran", "-O1", "-shared", "-fPIC", "-J", str(folder), str(PLUG), str(source), "-o", str(out)]
    built = subprocess.run(command, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    return out


def heap(law, steps=60):
    """Sixteen disks on a floor; positions after some steps."""
    rock = cn.Material("rock", density=2700.0)
    x, y = np.meshgrid(np.arange(4) * 0.205, 0.099 + np.arange(4) * 0.205)
    scene = cn.Scene(dim=2, gravity=(3.0, -9.81))
    scene.add(cn.disks(np.column_stack([(x + 0.05 * y).ravel(), y.ravel()]), 0.1, rock), cn.wall((0, 0), (0, 1), rock))
    scene.interact(rock, rock, law)
    sim = cn.Simulation(scene, dt=1e-3, overlap="ignore", strategy=cn.NSCD(solver=cn.NLGS(tol=1e-10)))
    for _ in range(steps):
        sim.step()
    return sim


def test_template_builds_runs_and_passes_its_test(tmp_path):
    folder = tmp_path / "sticky"
    new_law("sticky", folder)
    subprocess.run(build_line("sticky").split(), cwd=folder, check=True)
    subprocess.run([sys.executable, "run.py"], cwd=folder, check=True)
    assert (folder / "sticky.png").stat().st_size > 10000
    subprocess.run([sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "."], cwd=folder, check=True)
    law = (folder / "sticky.f90").read_text(encoding="utf-8").splitlines()
    assert len(law) <= 35
    with pytest.raises(FileExistsError, match="holds files"):
        new_law("sticky", folder)
    with pytest.raises(ValueError, match="no name for a law"):
        new_law("Sticky Law", tmp_path / "other")


@pytest.mark.parametrize("normal", [".true.", ".false."])
def test_copy_of_coulomb_gives_the_same_bits(tmp_path, normal):
    name = "copy_of_coulomb_" + normal.strip(".")
    path = library(tmp_path, name, f'parameters="mu::0:inf", normal_bias={normal}')
    mine, twin = heap(cn.plug(path, law=name, params=[0.4])), heap(cn.Coulomb(mu=0.4))
    assert np.array_equal(mine.bodies.position, twin.bodies.position)  # the same path through the solver
    assert not np.allclose(mine.bodies.position, heap(cn.Coulomb(mu=0.1)).bodies.position, rtol=1e-7)


def spheres_on_a_floor(law, steps=40):
    rng = np.random.default_rng(5)
    rock = cn.Material("rock", density=2700.0)
    x, y, z = np.meshgrid(*[0.21 * np.arange(3)] * 3, indexing="ij")
    places = np.column_stack([x.ravel(), y.ravel(), z.ravel() + 0.1]) + rng.uniform(0, 5e-3, (27, 3))
    scene = cn.Scene(dim=3, gravity=(1.0, 0.5, -9.81))
    scene.add(cn.spheres(places, 0.1, rock), cn.wall((0, 0, 0), (0, 0, 1), rock))
    scene.interact(rock, rock, law)
    sim = cn.Simulation(scene, dt=2e-3, overlap="ignore", strategy=cn.NSCD(solver=cn.NLGS(tol=1e-10)))
    for _ in range(steps):
        sim.step()
    return sim


def test_law_with_memory_that_acts_along_the_normal_takes_the_fast_path(tmp_path):
    """Its commit sees the impulse of every contact, its state is kept."""
    options = 'parameters="mu::0:inf", state="square:0 steps:0", commit=commit'
    commit = "state(:, 1) = sum(r**2, 2); state(:, 2) = state(:, 2) + 1"
    law = cn.plug(library(tmp_path, "counting", options, commit=commit), law="counting", params=[0.4])
    mine, twin = spheres_on_a_floor(law), spheres_on_a_floor(cn.Coulomb(mu=0.4))
    assert np.allclose(mine.bodies.position, twin.bodies.position, rtol=1e-9)
    memory = mine._core.get_state()["memory"]
    states, impulses = memory["states"].reshape(-1, 2), memory["impulses"].reshape(-1, 3)
    assert np.count_nonzero(impulses[:, 0]) > 20
    assert np.allclose(states[:, 0], np.sum(impulses**2, axis=1), rtol=1e-12, atol=0)
    assert states[:, 1].max() > 30


def test_own_solution_of_a_frictionless_contact(tmp_path):
    path = library(tmp_path, "own_frictionless", 'parameters="", solve=solve', prepare="mu = 0")
    mine = heap(cn.plug(path, law="own_frictionless", params=[]))
    assert np.allclose(mine.bodies.position, heap(cn.Frictionless()).bodies.position, rtol=1e-7)
    assert mine.info["status"] == "converged"


def test_state_lives_with_its_contact_and_in_a_checkpoint(tmp_path):
    """The state counts accepted steps in which the contact carried an impulse; friction is the count."""
    commit = "state(:, 1) = state(:, 1) + merge(1, 0, r(:, 1) > 0)"
    options = 'parameters="mu::0:inf", state="steps:0", commit=commit'
    path = library(tmp_path, "ageing", options, prepare="mu = mu*min(1.0_c_double, state(:, 1)/20)", commit=commit)
    law = cn.plug(path, law="ageing", params={"mu": 0.8})
    once = heap(law, 60)
    assert not np.allclose(once.bodies.position, heap(cn.Coulomb(mu=0.8)).bodies.position, rtol=1e-6)
    half = heap(law, 30)
    half.checkpoint(tmp_path / "half.h5")
    again = heap(law, 0)
    again.restore(tmp_path / "half.h5")
    for _ in range(30):
        again.step()
    assert np.array_equal(again.bodies.position, once.bodies.position)


@pytest.mark.parametrize(
    "name, options, statements",
    [
        ("divides_packed", 'parameters="mu::0:inf", normal_bias=.true.', {"prepare": DIVIDES}),
        ("divides_loose", 'parameters="mu::0:inf"', {"prepare": DIVIDES}),
        (
            "divides_alone",
            'parameters="mu::0:inf", solve=solve',
            {"prepare": "mu = 0", "solve": f"r = r*spread({UNIT}*w(:, 1, 1)/w(:, 1, 1), 2, c)"},
        ),
        (
            "divides_late",
            'parameters="mu::0:inf", state="s:1", commit=commit',
            {"commit": "state(:, 1) = state(:, 1)/merge(1, 0, all(params(:, 1) > 0))"},
        ),
    ],
)
def test_lanes_without_a_contact_hold_no_zeros(tmp_path, name, options, statements):
    """Batches go by eights; the lanes left over are the last contact again, so that a law may divide by a parameter."""
    law = cn.plug(library(tmp_path, name, options, **statements), law=name, params=[0.4])
    rock = cn.Material("rock", density=2700.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks(np.array([[0.0, 0.1], [0.5, 0.1], [1.0, 0.1]]), 0.1, rock), cn.wall((0, 0), (0, 1), rock))
    scene.interact(rock, rock, law)
    sim = cn.Simulation(scene, dt=1e-3)
    for _ in range(20):
        sim.step()
        assert sim.info["status"] == "converged"
    assert np.allclose(sim.bodies.position[:3, 1], 0.1, rtol=1e-9)


@pytest.mark.parametrize("solver", [cn.NLGS, cn.Auto, cn.PPANewton, cn.ADMM])
def test_a_compliance_is_one_at_the_answer(tmp_path, solver):
    """gap/h + u_n + r_n/(h^2 k) = 0 where it is closed: two disks rest on each other and on the ground by springs k."""
    yields = "bias(:, 1) = gap/context%h; compliance(:, 1) = 1/(context%h**2*params(:, 2))"
    path = library(tmp_path, f"yielding_{solver.__name__.lower()}", 'parameters="mu::0:inf k::0:inf"', prepare=yields)
    rock, stiffness = cn.Material("rock", density=1000.0), 1e6
    scene = cn.Scene(2, gravity=(0, -10.0))
    scene.add(cn.disks([[0, 0.1], [0, 0.3]], 0.1, rock, driven=("vx", "w")), cn.wall((0, 0), (0, 1), rock))
    scene.interact(rock, rock, cn.plug(path, law=f"yielding_{solver.__name__.lower()}", params=[0.3, stiffness]))
    sim = cn.Simulation(scene, 1e-2, cn.NSCD(theta=1.0, solver=solver(tol=1e-10)))
    for _ in range(400):
        assert sim.step()["status"] == "converged"
    sunk = 10 * sim.bodies.mass[0] / stiffness * np.array([2, 1])  # the lower contact carries both
    assert np.allclose(np.sort(sim.contacts.gap), -sunk, rtol=1e-6, atol=0)


@pytest.mark.parametrize(
    "statements, message",
    [
        ({"prepare": "bias(n/2 + 1, 1) = sqrt(-gap(n/2 + 1)**2 - 1)"}, r"gave bias\(1\) = -?nan for contact \d+, between bodies"),
        ({"prepare": "mu = -1"}, r"gave mu\(1\) = -1 .* must not be negative"),
        ({"prepare": "compliance = 1/(0*context%h)"}, r"gave compliance\(1\) = inf"),
        ({"solve": "r(1, 2) = r(1, 1)*sqrt(-1.0_c_double - r(1, 1)**2)"}, r"gave r\(2\) = -?nan for contact .*mu 0.4"),
        ({"commit": "state(:, 1) = state(:, 1)/(0*context%h)"}, r"gave state\(1\) = -?nan .* division by zero"),
    ],
)
def test_no_number_is_told_with_law_contact_value_and_remedy(tmp_path, statements, message):
    slot = next(iter(statements))
    name = f"broken_{slot}_{abs(hash(statements[slot])) % 10**8}"
    options = 'parameters="mu::0:inf", state="s:0", commit=commit' + (", solve=solve" if slot == "solve" else "")
    sim = heap(cn.plug(library(tmp_path, name, options, **statements), law=name, params=[0.4]), 0)
    before = np.array(sim.bodies.position), np.array(sim.bodies.velocity)
    with pytest.raises(ValueError, match=message) as caught:
        for _ in range(100):
            before = np.array(sim.bodies.position), np.array(sim.bodies.velocity)
            sim.step()
    assert name in str(caught.value)
    assert np.array_equal(before[0], sim.bodies.position) and np.array_equal(before[1], sim.bodies.velocity)


@pytest.mark.parametrize(
    "after, message",
    [
        ("descriptor%abi = 7", "ABI version of the descriptor is 7"),
        ("descriptor%size = 12", "size of the descriptor is 12"),
        ("descriptor%context_size = 8", "size of cairn_law_context is 8"),
        ("descriptor%kind = 9", "of kind 9, not a contact law"),
        ("descriptor%components2 = 4", "components2 is 4, must be 2, 3"),
        ("descriptor%components2 = 3", "rotations among its components and no solve"),
        ("descriptor%prepare = c_null_funptr", "has no prepare"),
        ("descriptor%name(1) = 'x'", "its name must be"),
        ("descriptor%parameters(4) = 'z'", "'z:0:inf' is no number|is no number"),
        ("descriptor%state(1:5) = ['a', 'b', c_null_char, 'c', 'd']", "no value for a new contact: write ab:0"),
    ],
)
def test_descriptors_that_do_not_fit_are_refused(tmp_path, after, message):
    name = f"odd_{abs(hash(after)) % 10**8}"
    path = library(tmp_path, name, after=after)
    with pytest.raises(ValueError, match=message) as caught:
        cn.plug(path, law=name)
    assert str(path) in str(caught.value)
    assert name not in cn.laws.BY_NAME


def test_what_is_missing_is_named(tmp_path):
    path = library(tmp_path, "present")
    with pytest.raises(ValueError, match="there is no such file"):
        cn.plug(tmp_path / "libnone.so", law="present")
    with pytest.raises(ValueError, match="has no cairn_describe_absent"):
        cn.plug(path, law="absent")
    with pytest.raises(ValueError, match="cannot be loaded as a library"):
        cn.plug(__file__, law="present")
    with pytest.raises(ValueError, match="is a source file, no library: compile it first"):
        cn.plug(PLUG, law="present")
    with pytest.raises(ValueError, match="params has 2 values and present takes 1: mu"):
        cn.plug(path, law="present", params=[0.4, 1])
    with pytest.raises(ValueError, match="mu of present is -1"):
        cn.plug(path, law="present", params=[-1])
    with pytest.raises(ValueError, match="no form in 2D"):
        flat = library(tmp_path, "spatial", 'parameters="mu::0:inf", components=[0, 3]')
        heap(cn.plug(flat, law="spatial", params=[0.1]), 1)


def test_a_name_is_taken_only_when_asked(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    first = library(tmp_path / "a", "twice")
    second = library(tmp_path / "b", "twice", prepare="mu = 0")
    rough = heap(cn.plug(first, law="twice", params=[0.4])).bodies.position.copy()
    with pytest.raises(ValueError, match="there is a law 'twice' already"):
        cn.plug(second, law="twice")
    smooth = heap(cn.plug(second, law="twice", params=[0.4], replace=True))
    assert np.array_equal(smooth.bodies.position, heap(cn.Coulomb(mu=0.0)).bodies.position) or np.allclose(
        smooth.bodies.position, heap(cn.Coulomb(mu=0.0)).bodies.position, rtol=1e-7
    )
    assert not np.allclose(smooth.bodies.position, rough, rtol=1e-7)


def test_a_bias_of_its_own_is_refused_where_a_strategy_imposes_the_gap(tmp_path):
    """Carpenter's scheme sets the gap over the step in its place; a law that says just that goes on."""
    plain = cn.plug(library(tmp_path, "says_the_gap"), law="says_the_gap", params=[0.4])
    soft = library(tmp_path, "says_less", prepare="where (gap < 0) bias(:, 1) = 0.3d0*gap/context%h")
    for law, refused in ((plain, False), (cn.plug(soft, law="says_less", params=[0.4]), True)):
        scene, rock = cn.Scene(dim=2, gravity=(0.0, -9.81)), cn.Material("rock", density=2700.0)
        scene.add(cn.disks([[0.0, 0.1 - 1e-6]], 0.1, rock), cn.wall((0, 0), (0, 1), rock))
        scene.interact(rock, rock, law)
        sim = cn.Simulation(scene, dt=1e-3, overlap="ignore", strategy=cn.Carpenter())
        if refused:
            with pytest.raises(ValueError, match=r"says_less of .* gave bias\(1\) = .*imposes the gap.*take NSCD"):
                sim.step()
        else:
            sim.step()
