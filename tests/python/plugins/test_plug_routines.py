"""Contact solvers, pairs of shapes, free velocities and body forces from a user's library, in Fortran."""

import subprocess
from pathlib import Path

import cairn as cn
import numpy as np
import pytest

SOURCE = """
module mine
  use, intrinsic :: iso_c_binding
  use cairn_plug
  implicit none
contains
  !> Projected gradient on the cones, slow and plain: step 1 / trace of W.
  subroutine solve(dim, contacts, row_start, column, block, q, mu, tolerance, max_iterations, params, r, iterations) &
      bind(c, name="")
    integer(c_int32_t), value       :: dim, max_iterations
    integer(c_int64_t), value       :: contacts
    integer(c_int64_t), intent(in)  :: row_start(0:contacts)
    integer(c_int32_t), intent(in)  :: column(0:*)
    real(c_double), intent(in)      :: block(dim, dim, 0:*), q(dim, 0:contacts - 1), mu(0:contacts - 1), params(*)
    real(c_double), value           :: tolerance
    real(c_double), intent(inout)   :: r(dim, 0:contacts - 1)
    integer(c_int32_t), intent(out) :: iterations
    real(c_double) :: u(dim), w, s
    integer(c_int64_t) :: a, k, pass
    do pass = 1, int(params(1), c_int64_t)
      do a = 0, contacts - 1
        u = q(:, a)
        w = 0
        do k = row_start(a), row_start(a + 1) - 1
          u = u + matmul(block(:, :, k), r(:, column(k)))
          if (column(k) == a) w = block(1, 1, k)
        end do
        r(1, a) = max(0.0_c_double, r(1, a) - u(1)/w)
        r(2:, a) = 0
        s = mu(a) + tolerance + max_iterations ! read, so that no argument is idle
      end do
    end do
    if (params(1) < 0) r(1, 0) = ieee_nan()
    iterations = int(params(1), c_int32_t)
  end subroutine solve
  function ieee_nan() result(x)
    use, intrinsic :: ieee_arithmetic
    real(c_double) :: x
    x = ieee_value(x, ieee_quiet_nan)
  end function ieee_nan
  !> Disks that keep a distance.
  subroutine halo(n, between, radius_a, radius_b, direction_b, gap, normal, point, status) bind(c, name="")
    integer(c_int32_t), value       :: n
    real(c_double), intent(in)      :: between(n, *), radius_a(n), radius_b(n), direction_b(n, *)
    real(c_double), intent(out)     :: gap(n), normal(n, *), point(n, *)
    integer(c_int32_t), intent(out) :: status(n)
    real(c_double) :: distance
    integer :: i
    do i = 1, n
      distance = norm2(between(i, 1:2))
      normal(i, 1:2) = between(i, 1:2)/distance
      gap(i) = distance - radius_a(i) - radius_b(i) - 0.05_c_double
      point(i, 1:2) = -(radius_a(i) + gap(i)/2)*normal(i, 1:2)
      status(i) = 0
    end do
  end subroutine halo
  subroutine spoilt(n, between, radius_a, radius_b, direction_b, gap, normal, point, status) bind(c, name="")
    integer(c_int32_t), value       :: n
    real(c_double), intent(in)      :: between(n, *), radius_a(n), radius_b(n), direction_b(n, *)
    real(c_double), intent(out)     :: gap(n), normal(n, *), point(n, *)
    integer(c_int32_t), intent(out) :: status(n)
    call halo(n, between, radius_a, radius_b, direction_b, gap, normal, point, status)
    gap(1) = ieee_nan()
  end subroutine spoilt
  !> Quadratic drag, implicit in its own way: v / (1 + h k |v|).
  subroutine drag(dim, dofs, bodies, h, theta, time, params, id, mass, inertia, position, velocity, driven, velocity_free, &
                  inverse_mass) bind(c, name="")
    integer(c_int32_t), value      :: dim, dofs
    integer(c_int64_t), value      :: bodies
    real(c_double), value          :: h, theta, time
    real(c_double), intent(in)     :: params(*)
    integer(c_int64_t), intent(in) :: id(bodies)
    real(c_double), intent(in)     :: mass(bodies), inertia(2*dim - 3, bodies), position(dim, bodies), velocity(dofs, bodies)
    type(c_ptr), value             :: driven
    real(c_double), intent(inout)  :: velocity_free(dofs, bodies), inverse_mass(dofs, bodies)
    integer(c_int64_t) :: i
    do i = 1, bodies
      if (inverse_mass(1, i) > 0) velocity_free(:dim, i) = velocity_free(:dim, i)/(1 + h*params(1)*norm2(velocity(:dim, i)))
    end do
  end subroutine drag
  !> A spring to the origin.
  subroutine spring(dim, dofs, bodies, time, params, id, mass, position, velocity, force) bind(c, name="")
    integer(c_int32_t), value      :: dim, dofs
    integer(c_int64_t), value      :: bodies
    real(c_double), value          :: time
    real(c_double), intent(in)     :: params(*)
    integer(c_int64_t), intent(in) :: id(bodies)
    real(c_double), intent(in)     :: mass(bodies), position(dim, bodies), velocity(dofs, bodies)
    real(c_double), intent(inout)  :: force(dofs, bodies)
    force(:dim, :) = force(:dim, :) - params(1)*position
  end subroutine spring
  subroutine of_solve(d) bind(c, name="cairn_describe_plain")
    type(cairn_plug_descriptor), intent(inout) :: d
    call describe_solver(d, "plain", solve, "passes:1000:-1:inf")
  end subroutine of_solve
  subroutine of_halo(d) bind(c, name="cairn_describe_halo")
    type(cairn_plug_descriptor), intent(inout) :: d
    call describe_pair(d, "halo", halo)
  end subroutine of_halo
  subroutine of_spoilt(d) bind(c, name="cairn_describe_spoilt")
    type(cairn_plug_descriptor), intent(inout) :: d
    call describe_pair(d, "spoilt", spoilt)
  end subroutine of_spoilt
  subroutine of_drag(d) bind(c, name="cairn_describe_drag")
    type(cairn_plug_descriptor), intent(inout) :: d
    call describe_velocity(d, "drag", drag, "k::0:inf")
  end subroutine of_drag
  subroutine of_spring(d) bind(c, name="cairn_describe_spring")
    type(cairn_plug_descriptor), intent(inout) :: d
    call describe_force(d, "spring", spring, "k::-inf:inf")
  end subroutine of_spring
end module mine
"""
ROCK = cn.Material("rock", density=1000.0)


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """The module above, built."""
    folder = tmp_path_factory.mktemp("routines")
    plug = Path(cn.__file__).resolve().parent / "plugs" / "cairn_plug.f90"
    (folder / "mine.f90").write_text(SOURCE)
    command = ["gfortran", "-O2", "-shared", "-fPIC", "-J", str(folder), str(plug), str(folder / "mine.f90")]
    subprocess.run([*command, "-o", str(folder / "libmine.so")], check=True)
    return folder / "libmine.so"


def heap(strategy, mu=0.0):
    x, y = np.meshgrid(np.arange(3) * 0.21, 0.1 + np.arange(3) * 0.2)
    scene = cn.Scene(dim=2, gravity=(1.0, -9.81))
    scene.add(cn.disks(np.column_stack([(x + 0.05 * y).ravel(), y.ravel()]), 0.1, ROCK), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=mu))
    return cn.Simulation(scene, dt=1e-3, strategy=strategy, overlap="ignore")


def test_a_contact_solver(library):
    plain = cn.plug(library, solver="plain", params=[3000])
    mine, twin = heap(cn.NSCD(solver=plain(tol=1e-9))), heap(cn.NSCD(solver=cn.NLGS(tol=1e-11)))
    for _ in range(20):
        assert mine.step()["status"] == "converged" or mine.info["error"] < 1e-7
        twin.step()
    assert np.max(np.abs(mine.bodies.position - twin.bodies.position)) < 1e-7
    result = mine.problem().solve("plain", tol=1e-6)
    assert result.solver == "plain" and result.error == pytest.approx(mine.problem().error(result.r))
    rough = heap(cn.NSCD(solver=plain(tol=1e-9)), mu=0.5)  # it knows no friction: a status, not an exception
    rough.step()
    assert rough.step()["status"] == "iteration_limit"
    broken = cn.plug(library, solver="plain", params=[-1])
    with pytest.raises(cn.Error, match="the plugged solver plain gave the impulse .*nan to contact 0"):
        heap(cn.NSCD(solver=broken())).step()


def test_a_pair_of_shapes(library):
    def gap():
        scene = cn.Scene(dim=2)
        scene.add(cn.disks([[0, 0], [0.5, 0]], 0.2, ROCK, velocity=(0.0, 0.0)))
        scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.1))
        sim = cn.Simulation(scene, dt=1e-2, strategy=cn.NSCD(margin=1.0))
        sim.step()
        return sim.contacts.gap[0]

    assert gap() == pytest.approx(0.1)
    pair = cn.plug(library, pair="halo", of="disk_disk")
    try:
        assert gap() == pytest.approx(0.05)
        cn.plug(library, pair="spoilt", of="disk_disk")
        with pytest.raises(cn.Error, match="gave a gap that is no number to"):
            gap()
    finally:
        pair.remove()
    assert gap() == pytest.approx(0.1)
    with pytest.raises(ValueError, match="no pair 'disk_cube' that a routine may replace: give one of disk_disk"):
        cn.plug(library, pair="halo", of="disk_cube")


def test_a_body_force(library):
    """An oscillator: the trapezoidal rule on a force at its middle is the leapfrog, of second order."""
    scene = cn.Scene(dim=2)
    scene.add(cn.disks([[1.0, 0.0]], 0.1, ROCK, force=(0.0, 0.0)))
    mass = 1000 * np.pi * 0.01
    errors = []
    for steps in (100, 200):
        sim = cn.Simulation(scene, dt=2 * np.pi / steps)
        sim.plug(cn.plug(library, force="spring", params={"k": mass}))
        for _ in range(steps):
            sim.step()
        errors.append(abs(sim.bodies.position[0, 0] - 1))
        assert not np.any(sim.bodies.force)  # the given forces are restored
        assert abs(sim.energy["closure"]) < 1e-12 * sim.energy["in_play"]
    assert errors[0] < 5e-3 and errors[0] / errors[1] > 3.5


def test_a_free_velocity(library):
    """Quadratic drag: v = v0 / (1 + k v0 t), to the bit of the same recursion."""
    scene = cn.Scene(dim=2)
    scene.add(cn.disks([[0.0, 0.0]], 0.1, ROCK, velocity=(10.0, 0.0)))
    sim = cn.Simulation(scene, dt=1e-3)
    sim.plug(cn.plug(library, velocity="drag", params=[0.3]))
    v = 10.0
    for _ in range(1000):
        sim.step()
        v = v / (1 + 1e-3 * 0.3 * v)
    assert sim.bodies.velocity[0, 0] == pytest.approx(v, rel=1e-13)
    assert v == pytest.approx(10 / (1 + 0.3 * 10), rel=2e-3)


def test_what_is_wrong_is_named(library):
    with pytest.raises(ValueError, match=r"plain is of kind 2, not a body force \(5\)"):
        cn.plug(library, force="plain")
    with pytest.raises(ValueError, match="parameter k of spring is missing"):
        cn.plug(library, force="spring")
    with pytest.raises(ValueError, match="k is -1: drag takes 0 to inf"):
        cn.plug(library, velocity="drag", params=[-1])
    with pytest.raises(ValueError, match="give one of law=, solver=, pair=, .*material=, body=; there are law, force"):
        cn.plug(library, force="spring", law="spring")
    sim = heap(cn.NSCD())
    with pytest.raises(ValueError, match="routine is 3"):
        sim.plug(3)
    sim.plug(cn.plug(library, force="spring", params=[1e308]))
    with pytest.raises(cn.Error):
        for _ in range(3):
            sim.step()
    assert np.all(np.isfinite(sim.bodies.position))
