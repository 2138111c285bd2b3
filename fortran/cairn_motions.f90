!> Held nodes of deformable bodies that move as functions of time, for Fortran. Programs use the module cairn.
module cairn_motions
  use, intrinsic :: iso_c_binding
  use cairn_calls
  use cairn_simulations, only: cairn_simulation
  implicit none
  private
  public :: displace_nodes, drive_nodes, node_motion

  abstract interface
    !> Displacement [m] or velocity [m/s] at a time [s], with what the program gave beside it.
    real(c_double) function node_motion(time, context) bind(c)
      import
      real(c_double), value :: time
      type(c_ptr), value :: context
    end function
    integer(c_int32_t) function table_taker(simulation, mesh, n, node, axis, rows, time, values, error) bind(c)
      import
      type(c_ptr), value :: simulation
      integer(c_int32_t), value :: mesh
      integer(c_int64_t), value :: n
      integer(c_int32_t), intent(in) :: node(*)
      integer(c_int8_t), value :: axis
      integer(c_int64_t), value :: rows
      real(c_double), intent(in) :: time(*), values(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function function_taker(simulation, mesh, n, node, axis, routine, context, error) bind(c)
      import
      type(c_ptr), value :: simulation
      integer(c_int32_t), value :: mesh
      integer(c_int64_t), value :: n
      integer(c_int32_t), intent(in) :: node(*)
      integer(c_int8_t), value :: axis
      type(c_funptr), value :: routine
      type(c_ptr), value :: context
      type(c_error), intent(inout) :: error
    end function
  end interface
  procedure(table_taker), bind(c, name="cairn_simulation_displace_nodes") :: c_displace
  procedure(table_taker), bind(c, name="cairn_simulation_drive_nodes") :: c_drive
  procedure(function_taker), bind(c, name="cairn_simulation_displace_nodes_by") :: c_displace_by
  procedure(function_taker), bind(c, name="cairn_simulation_drive_nodes_by") :: c_drive_by

  !> Displacement of held nodes along an axis: a table, or a function of the program.
  interface displace_nodes
    module procedure displace_by_table, displace_by_function
  end interface
  !> Velocity of held nodes along an axis, by the same.
  interface drive_nodes
    module procedure drive_by_table, drive_by_function
  end interface

contains

  !> Piecewise linear in time, constant before the first and after the last row.
  subroutine displace_by_table(simulation, mesh, node, axis, time, displacement, error)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: mesh, node(:)                         !< its number; from 0
    character, intent(in) :: axis                                !< "x", "y" or "z"
    real(dp), intent(in), contiguous :: time(:), displacement(:) !< rising [s]; [m]
    type(cairn_error), intent(out), optional :: error

    call give_table(c_displace, simulation, mesh, node, axis, time, "displacement", displacement, error)
  end subroutine displace_by_table

  subroutine drive_by_table(simulation, mesh, node, axis, time, velocity, error)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: mesh, node(:)                         !< its number; from 0
    character, intent(in) :: axis                                !< "x", "y" or "z"
    real(dp), intent(in), contiguous :: time(:), velocity(:)     !< rising [s]; [m/s]
    type(cairn_error), intent(out), optional :: error

    call give_table(c_drive, simulation, mesh, node, axis, time, "velocity", velocity, error)
  end subroutine drive_by_table

  !> Evaluates the function at the beginning, the middle and the end of each step, and of each of its parts. It must be a module
  !> or external procedure, since an internal one ends with its host.
  subroutine displace_by_function(simulation, mesh, node, axis, displacement, context, error)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: mesh, node(:)                         !< its number; from 0
    character, intent(in) :: axis                                !< "x", "y" or "z"
    procedure(node_motion) :: displacement
    type(c_ptr), intent(in), optional :: context                 !< handed on to it
    type(cairn_error), intent(out), optional :: error

    call give_function(c_displace_by, simulation, mesh, node, axis, c_funloc(displacement), context, error)
  end subroutine displace_by_function

  subroutine drive_by_function(simulation, mesh, node, axis, velocity, context, error)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: mesh, node(:)                         !< its number; from 0
    character, intent(in) :: axis                                !< "x", "y" or "z"
    procedure(node_motion) :: velocity
    type(c_ptr), intent(in), optional :: context                 !< handed on to it
    type(cairn_error), intent(out), optional :: error

    call give_function(c_drive_by, simulation, mesh, node, axis, c_funloc(velocity), context, error)
  end subroutine drive_by_function

  subroutine give_table(take, simulation, mesh, node, axis, time, name, values, error)
    procedure(table_taker) :: take
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: mesh, node(:)
    character, intent(in) :: axis
    character(*), intent(in) :: name
    real(dp), intent(in), contiguous :: time(:), values(:)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size(name, size(values), size(time), error)) return
    call report_back(take(simulation%handle, int(mesh, c_int32_t), size(node, kind=c_int64_t), int(node, c_int32_t), &
                          letter(axis), size(time, kind=c_int64_t), time, values, what), what, error)
  end subroutine give_table

  subroutine give_function(take, simulation, mesh, node, axis, routine, context, error)
    procedure(function_taker) :: take
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: mesh, node(:)
    character, intent(in) :: axis
    type(c_funptr), intent(in) :: routine
    type(c_ptr), intent(in), optional :: context
    type(cairn_error), intent(out), optional :: error
    type(c_ptr) :: handed
    type(c_error) :: what

    handed = c_null_ptr
    if (present(context)) handed = context
    call report_back(take(simulation%handle, int(mesh, c_int32_t), size(node, kind=c_int64_t), int(node, c_int32_t), &
                          letter(axis), routine, handed, what), what, error)
  end subroutine give_function

  !> A letter as C takes it by value: as a number, since compilers differ in how they hand characters over.
  pure integer(c_int8_t) function letter(axis)
    character, intent(in) :: axis

    letter = int(iachar(axis), c_int8_t)
  end function letter
end module cairn_motions
