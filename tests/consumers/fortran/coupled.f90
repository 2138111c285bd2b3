!> A Fortran program on its own: two balls that fly are joined in mid-flight, swing round each other and are let go.
program coupled
  use, intrinsic :: iso_c_binding, only: c_int64_t
  use cairn
  implicit none
  integer, parameter :: dp = kind(1d0)
  integer :: dim

  do dim = 2, 3
    call couple(dim)
  end do
contains
  subroutine couple(dim)
    integer, intent(in) :: dim
    type(cairn_scene) :: scene
    type(cairn_simulation) :: simulation
    type(cairn_error) :: error
    real(dp), allocatable :: position(:, :), velocity(:, :), key(:, :), before(:, :)
    real(dp) :: place(dim, 2), turn(merge(1, 3, dim == 2), 2), speed(3*dim - 3, 2), point(dim, 1), masses(2)
    integer(c_int64_t) :: first, ends(2)
    integer :: rock, i, k

    place = 0
    place(1, 2) = 0.25_dp
    masses = [0.5_dp, 0.75_dp]
    turn = 4e-4_dp
    speed(:, 1) = [(0.1_dp*(k + 1)*(-1)**k, k=1, 3*dim - 3)]
    speed(:, 2) = -0.5_dp*speed(:, 1)
    call create_scene(scene, dim)
    call set_gravity(scene, [(0.0_dp, k=1, dim)])
    call add_material(scene, "rock", rock)
    call set_rule(scene, "*", "*")
    call add_bodies(scene, place, masses, turn, first, velocity=speed)
    call add_contactors(scene, trim(merge("disk  ", "sphere", dim == 2)), [first, first + 1], [rock, rock], &
                        radius=[0.02_dp, 0.03_dp])
    call create_simulation(simulation, scene)
    call destroy_scene(scene)
    call set_number(simulation, "tol", 1e-11_dp)
    call set_number(simulation, "max_iter", 50000.0_dp)

    call steps(simulation, 20)
    call body_field(simulation, "position", position)
    point(:, 1) = (position(:, 1) + position(:, 2))/2
    call insert_joint(simulation, "Fixed", first, point, b=99_c_int64_t, error=error)
    call expect(index(error%message, "b of a joint is 99; give the id of a rigid body") > 0, "a body that there is not is refused")
    call insert_joint(simulation, "Fixed", first, point, b=first + 1, names=["strengthen"], values=[1.0_dp], error=error)
    call expect(index(error%message, "Fixed has no 'strengthen'; there are strength") > 0, "what it has not is refused")
    call insert_joint(simulation, "Fixed", first, point, b=first + 1, names=["strength"], values=[1e3_dp], ends=ends)
    call body_field(simulation, "velocity", velocity)
    before = velocity(:dim, :)
    call steps(simulation, 50)
    call contact_field(simulation, "key", key)
    call expect(all(nint(key(:2, 1), c_int64_t) == ends), "the joint is the contact of its ends")
    call body_field(simulation, "velocity", velocity)
    do i = 1, dim
      call expect(abs(sum(masses*(velocity(i, :) - before(i, :)))) < 1e-12_dp*sum(masses*abs(before(i, :))), "momentum is kept")
    end do
    call remove_joint(simulation, [ends(1), ends(1)], error=error)
    call expect(index(error%message, "which no joint has; give those of one that is there") > 0, "one that there is not is refused")
    call remove_joint(simulation, ends)
    call steps(simulation, 20)
    call expect(contact_count(simulation) == 0, "it is let go")
    call body_field(simulation, "position", position)
    call body_field(simulation, "velocity", velocity)
    print "(a, i0, *(1x, es24.16e3))", "position", dim, position
    print "(a, i0, *(1x, es24.16e3))", "velocity", dim, velocity
    call destroy_simulation(simulation)
  end subroutine couple

  subroutine steps(simulation, n)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: n
    integer :: k

    do k = 1, n
      call step_simulation(simulation, 1e-3_dp)
    end do
  end subroutine steps

  subroutine expect(condition, what)
    logical, intent(in) :: condition
    character(*), intent(in) :: what

    if (.not. condition) then
      print "(2a)", "not so: ", what
      error stop 1
    end if
  end subroutine expect
end program coupled
