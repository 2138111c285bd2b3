!> The order in which a solver visits batches, as Fortran arrays.
module contact_schedule
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use contact_batch, only: cairn_schedule, cairn_record, cairn_batch, cairn_side, batch_workspace
  implicit none
  private
  public :: schedule_view, open_schedule

  !> Lists count from 0 in C, from 1 here: batch b of the lists is batch(b + 1).
  type :: schedule_view
    integer :: stages = 0, batches = 0, threads = 1
    logical :: associated = .false. !< see radial_sweep
    real(c_double) :: relaxation = 1, softening_relaxation = 1
    integer(c_int32_t), pointer, contiguous :: first_task(:) => null(), first_batch(:) => null()
    type(cairn_batch), pointer, contiguous :: batch(:) => null()
    type(cairn_side), pointer, contiguous :: side(:) => null()
    type(cairn_record), pointer, contiguous :: record(:) => null(), general(:) => null()
    real(c_double), pointer, contiguous :: work(:, :) => null()
  end type schedule_view

  integer, parameter :: many = huge(0) !< records and sides are as many as batches refer to
contains

  subroutine open_schedule(schedule, view)
    type(cairn_schedule), intent(in) :: schedule !< see cairn/core.h
    type(schedule_view), intent(out) :: view
    view%stages = schedule%stages
    view%batches = schedule%batches
    view%threads = schedule%threads
    view%associated = schedule%associated /= 0
    view%relaxation = schedule%relaxation
    view%softening_relaxation = schedule%softening_relaxation
    call c_f_pointer(schedule%first_task, view%first_task, [view%stages + 1])
    call c_f_pointer(schedule%first_batch, view%first_batch, [view%first_task(view%stages + 1) + 1])
    call c_f_pointer(schedule%batch, view%batch, [view%batches])
    call c_f_pointer(schedule%side, view%side, [many])
    call c_f_pointer(schedule%record, view%record, [many])
    call c_f_pointer(schedule%general, view%general, [many])
    call c_f_pointer(schedule%work, view%work, [batch_workspace, view%threads])
  end subroutine open_schedule
end module contact_schedule
