!> A Fortran program on its own: a bob on a ball joint swings for 3 s, keeps its distance and its energy.
program pendulum
  use, intrinsic :: iso_c_binding, only: c_int64_t
  use cairn
  implicit none
  integer, parameter :: dp = kind(1d0)
  real(dp), parameter :: g = 9.81_dp, h = 1e-3_dp, mass = 0.5_dp, place(3) = [0.0995_dp, 0.0_dp, -0.01_dp]
  type(cairn_scene) :: scene
  type(cairn_simulation) :: simulation
  type(cairn_error) :: error
  real(dp), allocatable :: position(:, :), velocity(:, :), key(:, :), beta(:, :), impulse(:, :)
  real(dp) :: origin(3, 1), length, lean, energy, first, drift
  integer(c_int64_t) :: bob, ends(2)
  integer :: rock, step

  origin = 0
  call create_scene(scene, 3)
  call set_gravity(scene, [g, 0.0_dp, 0.0_dp])
  call add_material(scene, "rock", rock)
  call add_bodies(scene, reshape(place, [3, 1]), [mass], reshape([4e-4_dp, 5e-4_dp, 6e-4_dp], [3, 1]), bob)
  call add_contactors(scene, "sphere", [bob], [rock], radius=[0.02_dp])
  call add_joint(scene, "Weld", bob, origin, error=error)
  call expect(index(error%message, "there is no joint 'Weld'; there are Ball, Hinge") > 0, "a joint that there is not is refused")
  call add_joint(scene, "Ball", bob, origin, names=["strength"], values=[1.0_dp, 2.0_dp], error=error)
  call expect(index(error%message, "values has 2 numbers; it needs 1") > 0, "a number for each name")
  call add_joint(scene, "Ball", bob, origin, names=["strength"], values=[100.0_dp], ends=ends)
  call create_simulation(simulation, scene)
  call destroy_scene(scene)
  call set_number(simulation, "tol", 1e-11_dp)
  call set_number(simulation, "max_iter", 50000.0_dp)

  length = norm2(place)
  lean = asin(0.01_dp/length)
  drift = 0
  do step = 1, 3000
    call step_simulation(simulation, h)
    call body_field(simulation, "position", position)
    energy = energy_term(simulation, "kinetic") + energy_term(simulation, "potential")
    if (step == 1) first = energy
    drift = max(drift, abs(norm2(position(:, 1)) - length))
  end do
  call expect(drift < 1e-6_dp*2*length, "it keeps its distance")
  call expect(abs(energy - first) < 1e-4_dp*mass*g*length*lean**2, "it keeps its energy")

  call contact_field(simulation, "key", key)
  call contact_field(simulation, "beta", beta)
  call contact_field(simulation, "impulse", impulse)
  call expect(all(nint(key(:2, 1), c_int64_t) == ends), "the joint is the contact of its ends")
  call expect(all(beta >= 1), "it is whole")
  call body_field(simulation, "velocity", velocity)
  print "(a, *(1x, es24.16e3))", "position", position(:, 1)
  print "(a, *(1x, es24.16e3))", "velocity", velocity(:, 1)
  print "(a, *(1x, es24.16e3))", "impulse", impulse(:, 1)
  call destroy_simulation(simulation)
contains
  subroutine expect(condition, what)
    logical, intent(in) :: condition
    character(*), intent(in) :: what

    if (.not. condition) then
      print "(2a)", "not so: ", what
      error stop 1
    end if
  end subroutine expect
end program pendulum
