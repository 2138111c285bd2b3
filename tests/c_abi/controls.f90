!> Two bodies in a Fortran program, for comparison with the C API: drives, servo walls, cells and probes.
module fortran_controls
  use, intrinsic :: iso_c_binding
  use cairn
  implicit none
  private
  public :: cairn_fortran_controls
contains

  !> Drives a body, presses another and reads velocity and force of five steps by probes; a wrong text has to be refused. Returns
  !> what the probes found, and the code of the error.
  subroutine cairn_fortran_controls(velocity, force, refused) bind(c)
    real(c_double), intent(out) :: velocity(5), force(5)
    integer(c_int32_t), intent(out) :: refused
    type(cairn_scene) :: scene
    type(cairn_simulation) :: simulation
    type(cairn_error) :: error
    real(c_double) :: position(2, 2), inertia(1, 2)
    integer(c_int64_t) :: first
    integer(c_int32_t) :: probe(2)
    real(c_double), allocatable :: times(:), values(:)
    integer :: k

    call create_scene(scene, 2)
    position = 0
    position(1, 2) = 5
    inertia = 0.1_c_double
    call add_bodies(scene, position, [1.0_c_double, 2.0_c_double], inertia, first=first)
    call create_simulation(simulation, scene)
    call drive_bodies_by(simulation, [first], "vx", "2*t")
    call set_servo(simulation, first + 1, [0.0_c_double, -3.0_c_double], "table(t, 0, 10, 1, 20)", "0.5")
    probe(1) = add_probe(simulation, "velocity.x", [first])
    probe(2) = add_probe(simulation, "force.y", [first + 1], "sum", 1)
    call drive_bodies_by(simulation, [first], "vx", "2*", error)
    refused = error%code
    do k = 1, 5
      call step_simulation(simulation, 0.1_c_double)
    end do
    call read_probe(simulation, probe(1), times, values)
    velocity = values
    call read_probe(simulation, probe(2), times, values)
    force = values
    call destroy_simulation(simulation)
    call destroy_scene(scene)
  end subroutine cairn_fortran_controls
end module fortran_controls
