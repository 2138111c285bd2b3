!> A drop weight under a servo in a Fortran program, for comparison with the C API: drives, servo walls, cells and probes.
module fortran_controls
  use, intrinsic :: iso_c_binding
  use cairn
  implicit none
  private
  public :: cairn_fortran_controls
contains

  !> Drives a body, presses another and reads both by probes, each until the fifth step; a wrong text must be refused. The scene
  !> has one free body and no contacts. Returns the places along x and the velocities that the probes found, and the code of the error.
  subroutine cairn_fortran_controls(velocity, force, refused) bind(c)
    real(c_double), intent(out) :: velocity(5), force(5)
    integer(c_int32_t), intent(out) :: refused
    type(cairn_scene) :: scene
    type(cairn_simulation) :: simulation
    type(cairn_error) :: error
    integer(c_int64_t) :: first, none(0)
    integer(c_int32_t) :: probe(2)
    real(dp), allocatable :: times(:), values(:)
    integer :: k

    call create_scene(scene, 2)
    call add_bodies(scene, reshape([0.0_dp, 0.0_dp, 5.0_dp, 0.0_dp], [2, 2]), [1.0_dp, 2.0_dp], &
                    reshape([0.1_dp, 0.1_dp], [1, 2]), first=first)
    call create_simulation(simulation, scene)
    call drive_bodies_by(simulation, [first], "vx", "2*t")
    call set_servo(simulation, first + 1, [0.0_dp, -3.0_dp], "table(t, 0, 10, 1, 20)", "0.5")
    probe(1) = add_probe(simulation, "velocity.x", [first])
    probe(2) = add_probe(simulation, "force.y", [first + 1], "sum", 1)
    call drive_bodies_by(simulation, [first], "vx", "2*", error)
    refused = error%code
    do k = 1, 5
      call step_simulation(simulation, 0.1_dp)
    end do
    call read_probe(simulation, probe(1), times, values)
    velocity = values
    call read_probe(simulation, probe(2), times, values)
    force = values
    call destroy_simulation(simulation)
    call destroy_scene(scene)
  end subroutine cairn_fortran_controls
end module fortran_controls
