!> Sweep from an extrapolated start (Nesterov 1983), as extrapolated_sweep has it, where ranks share contacts. The sums that tell
!> if the extrapolation still points along the sweeps (O'Donoghue & Candes 2015) are of whole numbers: each term is rounded
!> to the nearest multiple of a given unit (Demmel & Nguyen 2013), so that the sums do not depend on which rank has which contact.
module ranked_sweep
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double, c_f_pointer
  use contact_batch, only: cairn_schedule, cairn_batch, cairn_record, max_batch, max_components
  use contact_schedule, only: schedule_view, open_schedule
  use extrapolated_sweep, only: lean
  use nlgs, only: sweep_batch
  use radial_sweep, only: sweep_counted2, sweep_counted3, units
  !$ use omp_lib, only: omp_get_thread_num
  implicit none
  private
  public :: cairn_ranked_sweep
  integer, parameter :: w8 = 8 !< contacts at a time
contains

  !> A sweep over the contacts of the schedule alone: velocities of bodies were extrapolated already.
  subroutine cairn_ranked_sweep(schedule, factor, stride, r_before, unit_change, unit_along, change, along) bind(c)
    type(cairn_schedule), intent(in) :: schedule !< see cairn/core.h
    real(c_double), value            :: factor   !< [-]; with 0 the old r_before is not read
    integer(c_int32_t), value        :: stride   !< components of a contact, at most
    real(c_double), intent(inout)    :: r_before(stride, *) !< by place of contacts: impulses when the last sweep began [N s]
    real(c_double), value            :: unit_change, unit_along !< reciprocals of the units [1/J]
    integer(c_int64_t), intent(inout) :: change(*) !< per batch: sum of |dr|^2/rho, dr what the sweep itself changed [units]
    integer(c_int64_t), intent(inout) :: along(*) !< per batch: sum of -dr.(r - r before)/rho [units]
    type(schedule_view) :: s
    integer :: stage, task, b, me
    call open_schedule(schedule, s)
    me = 1
    !$omp parallel num_threads(s%threads) if (s%threads > 1) default(shared) private(stage, task, b) firstprivate(me)
    !$ me = omp_get_thread_num() + 1
    do stage = 1, s%stages
      !$omp do schedule(dynamic, 1)
      do task = s%first_task(stage) + 1, s%first_task(stage + 1)
        do b = s%first_batch(task) + 1, s%first_batch(task + 1)
          call one_batch(b, me)
        end do
      end do
      !$omp end do
    end do
    !$omp end parallel
  contains
    ! the thread is an argument: what a contained procedure sees of its host is not the copy of its thread
    subroutine one_batch(b, me)
      integer, intent(in) :: b  !< batch
      integer, intent(in) :: me !< thread, from 1
      real(c_double) :: start(max_batch*max_components), swept
      associate (batch => s%batch(b))
        if (batch%pack > 0) then
          call sweep_packed(batch, s%record, s%relaxation, factor, r_before(1, batch%first + 1), unit_change, unit_along, &
                            change(b), along(b))
          return
        end if
        call lean(batch, factor, r_before(1, batch%first + 1), start)
        call sweep_batch(batch, s%side, s%record, s%general, s%relaxation, s%softening_relaxation, &
                         s%associated, s%work(:, me), swept)
        call note(batch, start, r_before(1, batch%first + 1), unit_change, unit_along, change(b), along(b))
      end associate
    end subroutine one_batch
  end subroutine cairn_ranked_sweep

  !> Begins beyond the last sweep, sweeps and counts, eight contacts at a time: a batch is gone through once.
  subroutine sweep_packed(batch, record, relaxation, factor, before, unit_change, unit_along, change, along)
    type(cairn_batch), intent(in)     :: batch
    type(cairn_record), intent(inout) :: record(*)
    real(c_double), value             :: relaxation !< factor on changes of impulse [-]
    real(c_double), value             :: factor     !< [-]
    real(c_double), intent(inout)     :: before(batch%count*batch%components) !< impulses when the last sweep began [N s]
    real(c_double), value             :: unit_change, unit_along !< reciprocals of the units [1/J]
    integer(c_int64_t), intent(out)   :: change, along !< [units]
    real(c_double), pointer, contiguous :: packed(:)
    integer(c_int32_t), pointer, contiguous :: a(:), b(:)
    real(c_double) :: swept
    integer :: n
    n = batch%count
    call c_f_pointer(batch%frame, packed, [batch%pack*n])
    call c_f_pointer(batch%body_a, a, [n])
    call c_f_pointer(batch%body_b, b, [n])
    if (batch%components == 2) then
      call sweep_counted2(n/w8, batch%contacts, a, b, relaxation, packed, record, swept, factor, before, &
                          unit_change=unit_change, unit_along=unit_along, changed=change, turned=along)
    else
      call sweep_counted3(n/w8, batch%contacts, a, b, relaxation, packed, record, swept, factor, before, &
                          unit_change=unit_change, unit_along=unit_along, changed=change, turned=along)
    end if
  end subroutine sweep_packed

  !> Of contacts alone: lanes beyond them hold none.
  subroutine note(batch, start, before, unit_change, unit_along, change, along)
    type(cairn_batch), intent(in) :: batch
    real(c_double), intent(in)    :: start(batch%count*batch%components) !< impulses that the sweep began with [N s]
    real(c_double), intent(in)    :: before(batch%count*batch%components) !< impulses before that [N s]
    real(c_double), intent(in)    :: unit_change, unit_along !< [1/J]
    integer(c_int64_t), intent(out) :: change, along !< [units]
    real(c_double), pointer, contiguous :: r(:), rho(:)
    real(c_double) :: square(w8), way(w8), weight(w8)
    integer :: lines, k, at, n
    call c_f_pointer(batch%r, r, [batch%count*batch%components])
    call c_f_pointer(batch%rho, rho, [batch%count])
    change = 0
    along = 0
    do lines = 0, batch%contacts - 1, w8
      n = min(w8, batch%contacts - lines)
      square = 0
      way = 0
      do k = 0, batch%components - 1
        at = k*batch%count + lines
        call note_some(n, start(at + 1), r(at + 1:at + n), before(at + 1), square, way)
      end do
      if (n < w8) then
        square(n + 1:) = 0
        way(n + 1:) = 0
        weight(n + 1:) = 0
        weight(1:n) = 1/rho(lines + 1:lines + n)
      else
        weight = 1/rho(lines + 1:lines + w8)
      end if
      change = change + sum(units(square*weight*unit_change))
      along = along + sum(units(way*weight*unit_along))
    end do
  end subroutine note

  pure subroutine note_some(n, start, r, before, square, way)
    integer, value                :: n         !< numbers, at most eight
    real(c_double), intent(in)    :: start(n)  !< [N s]
    real(c_double), intent(in)    :: r(n)      !< impulses [N s]
    real(c_double), intent(in)    :: before(n) !< impulses before that [N s]
    real(c_double), intent(inout) :: square(n) !< to which |dr|^2 is added [N2 s2]
    real(c_double), intent(inout) :: way(n)    !< to which -dr.(r - r before) is added [N2 s2]
    integer :: i
    !$omp simd
    do i = 1, n
      square(i) = square(i) + (start(i) - r(i))*(start(i) - r(i))
      way(i) = way(i) + (start(i) - r(i))*(r(i) - before(i))
    end do
  end subroutine note_some
end module ranked_sweep
