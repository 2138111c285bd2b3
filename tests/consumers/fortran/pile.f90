!> A Fortran program on its own: three disks in a trough, the floor pushed up at a constant speed; wrong input is refused.
program pile
  use, intrinsic :: iso_c_binding, only: c_int64_t
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_positive_inf
  use cairn
  implicit none
  integer, parameter :: dp = kind(1d0)
  real(dp), parameter :: h = 1e-3_dp, radius = 0.25_dp, mass = 2, speed = 0.1_dp
  type(cairn_scene) :: scene
  type(cairn_simulation) :: simulation
  type(cairn_report) :: report
  type(cairn_error) :: error
  type(cairn_nscd) :: options
  real(dp) :: infinite
  real(dp), allocatable :: position(:, :), velocity(:, :), gap(:), normal(:, :), point(:, :), impulse(:, :)
  integer(c_int64_t), allocatable :: bodies(:, :)
  integer(c_int64_t) :: floor_id, grains
  integer :: rock, step, i

  infinite = ieee_value(1.0_dp, ieee_positive_inf)
  call create_scene(scene, 2)
  call set_gravity(scene, [0.0_dp, -9.81_dp])
  call add_material(scene, "rock", rock)
  call set_law(scene, rock, rock, "Coulomb", [0.5_dp])
  call add_bodies(scene, reshape([0.0_dp, 0.0_dp], [2, 1]), [infinite], reshape([infinite], [1, 1]), floor_id, &
                  velocity=reshape([0.0_dp, speed, 0.0_dp], [3, 1]))
  call add_contactors(scene, "half_plane", [floor_id], [rock], direction=reshape([0.0_dp, 1.0_dp, 0.0_dp], [3, 1]))
  call drive_bodies(scene, [floor_id], [.true., .true., .true.], reshape([0.0_dp, speed, 0.0_dp], [3, 1]))

  call add_bodies(scene, reshape([0.0_dp, radius], [2, 1]), [-mass], reshape([mass], [1, 1]), grains, error=error)
  call expect(error%code /= 0 .and. index(error%message, "mass") > 0, "a negative mass is refused by name")
  call plug_contact_law("libnone.so", "mine", error=error)
  call expect(error%code /= 0 .and. index(error%message, "libnone.so") > 0, "a library that is not there is refused by name")
  call add_bodies(scene, reshape([-0.6_dp, radius, 0.0_dp, radius, 0.6_dp, radius], [2, 3]), [mass, mass, mass], &
                  reshape([(0.5_dp*mass*radius**2, i=1, 3)], [1, 3]), grains)
  call add_contactors(scene, "disk", [grains, grains + 1, grains + 2], [rock, rock, rock], radius=[radius, radius, radius])

  options%tolerance = 1e-10_dp
  call create_simulation(simulation, scene, options)
  call destroy_scene(scene)
  do step = 1, 200
    call step_simulation(simulation, h, report)
    call expect(report%status == cairn_converged, "every step converges")
  end do

  call body_field(simulation, "position", position)
  call body_field(simulation, "velocity", velocity)
  call contact_arrays(simulation, bodies, gap, normal, point, impulse)
  call expect(all(shape(position) == [2, 4]), "position is (2, 4)")
  call expect(all(abs(velocity(2, :) - speed) < 1e-12_dp), "everything rises with the floor")
  call expect(abs(position(2, 1) - 200*h*speed) < 1e-12_dp, "the floor rose by its speed times the time")
  call expect(abs(sum(impulse(2, :))/(3*mass*9.81_dp*h) - 1) < 1e-12_dp, "the floor carries the weight")
  call destroy_simulation(simulation)
  print "(a)", "the pile rises with its floor"
contains
  subroutine expect(condition, what)
    logical, intent(in) :: condition
    character(*), intent(in) :: what

    if (.not. condition) then
      print "(2a)", "not so: ", what
      error stop 1
    end if
  end subroutine expect
end program pile
