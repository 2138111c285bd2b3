!> Files of Cairn for Fortran: checkpoints, and runs that are written and read. Programs use the module cairn.
module cairn_files
  use, intrinsic :: iso_c_binding
  use cairn_calls
  use cairn_simulations, only: cairn_simulation
  implicit none
  private
  public :: cairn_run_writer, cairn_run, cairn_new_file, cairn_replace, cairn_go_on
  public :: write_checkpoint, restart_simulation
  public :: create_run_writer, write_output, write_step, close_run_writer
  public :: open_run, close_run, output_count, run_times, run_body_field, run_node_field, run_contact_field, run_history

  enum, bind(c)
    enumerator :: cairn_new_file = 0, cairn_replace = 1, cairn_go_on = 2
  end enum

  type :: cairn_run_writer
    type(c_ptr) :: handle = c_null_ptr !< of the C API
  end type
  type :: cairn_run
    type(c_ptr) :: handle = c_null_ptr !< of the C API
  end type

  interface
    integer(c_int32_t) function c_write_checkpoint(simulation, path, error) bind(c, name="cairn_simulation_write_checkpoint")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: path(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_restart(simulation, path, error) bind(c, name="cairn_simulation_restart")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: path(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_writer_create(simulation, path, mode, writer, error) bind(c, name="cairn_run_writer_create")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: path(*)
      integer(c_int32_t), value :: mode
      type(c_ptr), intent(out) :: writer
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_writer_output(writer, simulation, error) bind(c, name="cairn_run_writer_output")
      import
      type(c_ptr), value :: writer, simulation
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_writer_step(writer, simulation, error) bind(c, name="cairn_run_writer_step")
      import
      type(c_ptr), value :: writer, simulation
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_writer_close(writer, error) bind(c, name="cairn_run_writer_close")
      import
      type(c_ptr), value :: writer
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_run_open(path, run, error) bind(c, name="cairn_run_open")
      import
      character(c_char), intent(in) :: path(*)
      type(c_ptr), intent(out) :: run
      type(c_error), intent(inout) :: error
    end function
    subroutine c_run_close(run) bind(c, name="cairn_run_close")
      import
      type(c_ptr), value :: run
    end subroutine
    integer(c_int64_t) function c_run_outputs(run) bind(c, name="cairn_run_outputs")
      import
      type(c_ptr), value :: run
    end function
    integer(c_int32_t) function c_run_times(run, capacity, times, count, error) bind(c, name="cairn_run_times")
      import
      type(c_ptr), value :: run
      integer(c_int64_t), value :: capacity
      real(c_double), intent(inout) :: times(*)
      integer(c_int64_t), intent(out) :: count
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_run_body_field(run, output, name, capacity, values, count, error) &
        bind(c, name="cairn_run_body_field")
      import
      type(c_ptr), value :: run
      integer(c_int64_t), value :: output, capacity
      character(c_char), intent(in) :: name(*)
      real(c_double), intent(inout) :: values(*)
      integer(c_int64_t), intent(out) :: count
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_run_node_field(run, output, name, capacity, values, count, error) &
        bind(c, name="cairn_run_node_field")
      import
      type(c_ptr), value :: run
      integer(c_int64_t), value :: output, capacity
      character(c_char), intent(in) :: name(*)
      real(c_double), intent(inout) :: values(*)
      integer(c_int64_t), intent(out) :: count
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_run_contact_field(run, output, name, capacity, values, count, error) &
        bind(c, name="cairn_run_contact_field")
      import
      type(c_ptr), value :: run
      integer(c_int64_t), value :: output, capacity
      character(c_char), intent(in) :: name(*)
      real(c_double), intent(inout) :: values(*)
      integer(c_int64_t), intent(out) :: count
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_run_history(run, name, capacity, values, count, error) bind(c, name="cairn_run_history")
      import
      type(c_ptr), value :: run
      character(c_char), intent(in) :: name(*)
      integer(c_int64_t), value :: capacity
      real(c_double), intent(inout) :: values(*)
      integer(c_int64_t), intent(out) :: count
      type(c_error), intent(inout) :: error
    end function
  end interface

contains

  !> All that the future depends on but laws, options, gravity and loads; replaced as a whole or not at all.
  subroutine write_checkpoint(simulation, path, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: path
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_write_checkpoint(simulation%handle, c_text(path), what), what, error)
  end subroutine write_checkpoint

  !> Goes back, or on, to a checkpoint of the same scene: to the same bits.
  subroutine restart_simulation(simulation, path, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: path
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_restart(simulation%handle, c_text(path), what), what, error)
  end subroutine restart_simulation

  !> mode: cairn_new_file (default), cairn_replace or, at the end of a run or after a restart from a checkpoint of it,
  !> cairn_go_on, which refuses the file of another scene and one that reaches farther without a restart.
  subroutine create_run_writer(writer, simulation, path, mode, error)
    type(cairn_run_writer), intent(out) :: writer
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: path
    integer, intent(in), optional :: mode
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what
    integer(c_int32_t) :: chosen

    chosen = cairn_new_file
    if (present(mode)) chosen = int(mode, c_int32_t)
    call report_back(c_writer_create(simulation%handle, c_text(path), chosen, writer%handle, what), what, error)
  end subroutine create_run_writer

  !> Bodies and contacts as they are now.
  subroutine write_output(writer, simulation, error)
    type(cairn_run_writer), intent(in) :: writer
    type(cairn_simulation), intent(in) :: simulation
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_writer_output(writer%handle, simulation%handle, what), what, error)
  end subroutine write_output

  !> The numbers of the last step, for the history: after each step.
  subroutine write_step(writer, simulation, error)
    type(cairn_run_writer), intent(in) :: writer
    type(cairn_simulation), intent(in) :: simulation
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_writer_step(writer%handle, simulation%handle, what), what, error)
  end subroutine write_step

  subroutine close_run_writer(writer, error)
    type(cairn_run_writer), intent(inout) :: writer
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_writer_close(writer%handle, what), what, error)
    writer%handle = c_null_ptr
  end subroutine close_run_writer

  subroutine open_run(run, path, error)
    type(cairn_run), intent(out) :: run
    character(*), intent(in) :: path
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_run_open(c_text(path), run%handle, what), what, error)
  end subroutine open_run

  subroutine close_run(run)
    type(cairn_run), intent(inout) :: run

    call c_run_close(run%handle)
    run%handle = c_null_ptr
  end subroutine close_run

  integer function output_count(run)
    type(cairn_run), intent(in) :: run

    output_count = int(c_run_outputs(run%handle))
  end function output_count

  !> Times of the outputs [s].
  subroutine run_times(run, times, error)
    type(cairn_run), intent(in) :: run
    real(dp), allocatable, intent(out) :: times(:)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what
    integer(c_int64_t) :: count

    allocate (times(output_count(run)))
    call report_back(c_run_times(run%handle, size(times, kind=c_int64_t), times, count, what), what, error)
  end subroutine run_times

  !> A field of the bodies of an output, from 1: all components of the first, then of the second ...
  subroutine run_body_field(run, output, name, values, error)
    type(cairn_run), intent(in) :: run
    integer, intent(in) :: output
    character(*), intent(in) :: name
    real(dp), allocatable, intent(out) :: values(:)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what
    integer(c_int64_t) :: count, room, at
    integer(c_int32_t) :: code

    at = output - 1
    allocate (values(0))
    code = c_run_body_field(run%handle, at, c_text(name), 0_c_int64_t, values, count, what)
    if (code == 0) then
      deallocate (values)
      room = count
      allocate (values(room))
      code = c_run_body_field(run%handle, at, c_text(name), room, values, count, what)
    end if
    call report_back(code, what, error)
  end subroutine run_body_field

  !> A field of the nodes of meshes of an output, as above.
  subroutine run_node_field(run, output, name, values, error)
    type(cairn_run), intent(in) :: run
    integer, intent(in) :: output
    character(*), intent(in) :: name
    real(dp), allocatable, intent(out) :: values(:)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what
    integer(c_int64_t) :: count, room, at
    integer(c_int32_t) :: code

    at = output - 1
    allocate (values(0))
    code = c_run_node_field(run%handle, at, c_text(name), 0_c_int64_t, values, count, what)
    if (code == 0) then
      deallocate (values)
      room = count
      allocate (values(room))
      code = c_run_node_field(run%handle, at, c_text(name), room, values, count, what)
    end if
    call report_back(code, what, error)
  end subroutine run_node_field

  !> A field of the contacts of an output, as above.
  subroutine run_contact_field(run, output, name, values, error)
    type(cairn_run), intent(in) :: run
    integer, intent(in) :: output
    character(*), intent(in) :: name
    real(dp), allocatable, intent(out) :: values(:)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what
    integer(c_int64_t) :: count, room, at
    integer(c_int32_t) :: code

    at = output - 1
    allocate (values(0))
    code = c_run_contact_field(run%handle, at, c_text(name), 0_c_int64_t, values, count, what)
    if (code == 0) then
      deallocate (values)
      room = count
      allocate (values(room))
      code = c_run_contact_field(run%handle, at, c_text(name), room, values, count, what)
    end if
    call report_back(code, what, error)
  end subroutine run_contact_field

  !> A column of the history, a row for each step: "time", "contacts", "error", "energy_kinetic", ...
  subroutine run_history(run, name, values, error)
    type(cairn_run), intent(in) :: run
    character(*), intent(in) :: name
    real(dp), allocatable, intent(out) :: values(:)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what
    integer(c_int64_t) :: count, room
    integer(c_int32_t) :: code

    allocate (values(0))
    code = c_run_history(run%handle, c_text(name), 0_c_int64_t, values, count, what)
    if (code == 0) then
      deallocate (values)
      room = count
      allocate (values(room))
      code = c_run_history(run%handle, c_text(name), room, values, count, what)
    end if
    call report_back(code, what, error)
  end subroutine run_history
end module cairn_files
