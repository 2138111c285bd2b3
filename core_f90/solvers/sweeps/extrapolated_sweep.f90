!> Sweep from an extrapolated start (Nesterov 1983): r = r + factor (r - r before), where `before` was the start of the last sweep.
!> Velocities of bodies follow, since they are linear in the impulses. A sum tells if the extrapolation still points along the
!> sweeps (O'Donoghue & Candes 2015).
module extrapolated_sweep
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double, c_f_pointer
  use contact_batch, only: cairn_schedule, cairn_batch, cairn_record, max_batch, max_components
  use contact_schedule, only: schedule_view, open_schedule
  use nlgs, only: sweep_batch
  use radial_sweep, only: sweep_extrapolated2, sweep_extrapolated3, sweep_extrapolated_associated2, &
    sweep_extrapolated_associated3
  !$ use omp_lib, only: omp_get_thread_num
  implicit none
  private
  public :: cairn_extrapolated_sweep, cairn_sweep_chosen, lean
  integer, parameter :: w8 = 8 !< contacts at a time
contains

  !> A single sweep. Its start is kept in `before`; with a factor of 0 the old `before` is not read.
  subroutine cairn_extrapolated_sweep(schedule, factor, bodies, velocities, before, stride, r_before, change, along) bind(c)
    type(cairn_schedule), intent(in) :: schedule !< see cairn/core.h
    real(c_double), value            :: factor   !< [-]
    integer(c_int64_t), value        :: bodies   !< that records are of
    integer(c_int32_t), value        :: velocities !< numbers of a record that are velocities
    real(c_double), intent(inout)    :: before(velocities, bodies) !< velocities when the last sweep began [m/s]
    integer(c_int32_t), value        :: stride   !< components of a contact, at most
    real(c_double), intent(inout)    :: r_before(stride, *) !< by place of contacts: impulses then [N s]
    real(c_double), intent(inout)    :: change(*) !< per batch: sum of dr.W dr, dr what the sweep itself changed [J]
    real(c_double), intent(inout)    :: along(*) !< per batch: sum of -dr.D (r - r before), D the diagonal of W [J]
    type(schedule_view) :: s
    integer(c_int64_t) :: i
    integer :: stage, task, b, me
    call open_schedule(schedule, s)
    me = 1
    !$omp parallel num_threads(s%threads) if (s%threads > 1) default(shared) private(stage, task, b, i) firstprivate(me)
    !$ me = omp_get_thread_num() + 1
    !$omp do schedule(static)
    do i = 1, bodies
      call lean_body(velocities, factor, s%record(i)%x, before(:, i))
    end do
    !$omp end do
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
      real(c_double) :: start(max_batch*max_components)
      associate (batch => s%batch(b))
        if (batch%pack > 0) then
          call sweep_packed(batch, s%record, s%relaxation, s%associated, factor, r_before(1, batch%first + 1), &
                            change(b), along(b))
          return
        end if
        call lean(batch, factor, r_before(1, batch%first + 1), start)
        call sweep_batch(batch, s%side, s%record, s%general, s%relaxation, s%softening_relaxation, &
                         s%associated, s%work(:, me), change(b))
        call note(batch, start, r_before(1, batch%first + 1), along(b))
      end associate
    end subroutine one_batch
  end subroutine cairn_extrapolated_sweep

  !> Sweeps over some tasks alone.
  subroutine cairn_sweep_chosen(sweeps, schedule, chosen, change) bind(c)
    integer(c_int32_t), value        :: sweeps    !< how many
    type(cairn_schedule), intent(in) :: schedule  !< see cairn/core.h
    integer(c_int32_t), intent(in)   :: chosen(*) !< per task: 1, or 0
    real(c_double), intent(inout)    :: change(*) !< per batch: sum of dr.W dr in the last of them [J]
    type(schedule_view) :: s
    integer :: sweep, stage, task, b, me
    call open_schedule(schedule, s)
    me = 1
    !$omp parallel num_threads(s%threads) if (s%threads > 1) default(shared) private(sweep, stage, task, b) firstprivate(me)
    !$ me = omp_get_thread_num() + 1
    do sweep = 1, sweeps
      do stage = 1, s%stages
        !$omp do schedule(dynamic, 1)
        do task = s%first_task(stage) + 1, s%first_task(stage + 1)
          if (chosen(task) == 0) cycle
          do b = s%first_batch(task) + 1, s%first_batch(task + 1)
            call sweep_batch(s%batch(b), s%side, s%record, s%general, s%relaxation, s%softening_relaxation, &
                             s%associated, s%work(:, me), change(b))
          end do
        end do
        !$omp end do
      end do
    end do
    !$omp end parallel
  end subroutine cairn_sweep_chosen

  pure subroutine lean_body(n, factor, v, before)
    integer(c_int32_t), value     :: n         !< velocities
    real(c_double), value         :: factor    !< [-]
    real(c_double), intent(inout) :: v(n)      !< [m/s]
    real(c_double), intent(inout) :: before(n) !< [m/s]
    real(c_double) :: now
    integer :: k
    do k = 1, n
      now = v(k)
      if (factor > 0) v(k) = now + factor*(now - before(k))
      before(k) = now
    end do
  end subroutine lean_body

  !> Begins beyond the last sweep, sweeps and adds up the way, eight contacts at a time: a batch is gone through once.
  subroutine sweep_packed(batch, record, relaxation, associated, factor, before, change, along)
    type(cairn_batch), intent(in)     :: batch
    type(cairn_record), intent(inout) :: record(*)
    real(c_double), value             :: relaxation !< factor on changes of impulse [-]
    logical, value                    :: associated !< see radial_sweep
    real(c_double), intent(in)        :: factor     !< [-]
    real(c_double), intent(inout)     :: before(batch%count*batch%components) !< impulses when the last sweep began [N s]
    real(c_double), intent(out)       :: change     !< sum of dr.W dr [J]
    real(c_double), intent(out)       :: along      !< -dr.D (r - r before) [J]
    real(c_double), pointer, contiguous :: packed(:)
    integer(c_int32_t), pointer, contiguous :: a(:), b(:)
    integer :: n
    n = batch%count
    call c_f_pointer(batch%frame, packed, [batch%pack*n])
    call c_f_pointer(batch%body_a, a, [n])
    call c_f_pointer(batch%body_b, b, [n])
    if (batch%components == 2 .and. associated) then
      call sweep_extrapolated_associated2(n/w8, batch%contacts, a, b, relaxation, packed, record, change, factor, before, along)
    else if (batch%components == 2) then
      call sweep_extrapolated2(n/w8, batch%contacts, a, b, relaxation, packed, record, change, factor, before, along)
    else if (associated) then
      call sweep_extrapolated_associated3(n/w8, batch%contacts, a, b, relaxation, packed, record, change, factor, before, along)
    else
      call sweep_extrapolated3(n/w8, batch%contacts, a, b, relaxation, packed, record, change, factor, before, along)
    end if
  end subroutine sweep_packed

  subroutine lean(batch, factor, before, start)
    type(cairn_batch), intent(in) :: batch
    real(c_double), value         :: factor   !< [-]
    real(c_double), intent(inout) :: before(batch%count*batch%components) !< impulses when the last sweep began [N s]
    real(c_double), intent(out)   :: start(batch%count*batch%components) !< impulses that the sweep begins with [N s]
    real(c_double), pointer, contiguous :: r(:)
    call c_f_pointer(batch%r, r, [batch%count*batch%components])
    call lean_some(batch%count*batch%components, factor, before, r, start)
  end subroutine lean

  !> Keeps impulses r as those before the sweep, and takes them on along their last change.
  pure subroutine lean_some(n, factor, before, r, start)
    integer, value                :: n        !< numbers
    real(c_double), value         :: factor   !< [-]
    real(c_double), intent(inout) :: before(n) !< [N s]
    real(c_double), intent(inout) :: r(n)     !< impulses [N s]
    real(c_double), intent(out)   :: start(n) !< [N s]
    real(c_double) :: now
    integer :: i
    if (factor > 0) then
      !$omp simd private(now)
      do i = 1, n
        now = r(i)
        r(i) = now + factor*(now - before(i))
        start(i) = r(i)
        before(i) = now
      end do
    else
      start = r
      before = r
    end if
  end subroutine lean_some

  subroutine note(batch, start, before, along)
    type(cairn_batch), intent(in) :: batch
    real(c_double), intent(in)    :: start(batch%count*batch%components) !< impulses that the sweep began with [N s]
    real(c_double), intent(in)    :: before(batch%count*batch%components) !< impulses before that [N s]
    real(c_double), intent(out)   :: along !< -dr.D (r - r before) [J]
    real(c_double), pointer, contiguous :: r(:), w(:)
    real(c_double) :: total(w8)
    integer :: k, l, lines, c, n
    c = batch%components
    n = batch%count
    call c_f_pointer(batch%r, r, [n*c])
    call c_f_pointer(batch%delassus, w, [n*merge(2, c*c, batch%block == 0)])
    along = 0
    do l = 0, c - 1
      k = merge(min(l, 1), l*(c + 1), batch%block == 0)
      do lines = 0, n - 1, w8 ! a batch may end with less than eight
        total = 0
        call note_some(min(w8, n - lines), start(n*l + lines + 1), r(n*l + lines + 1:), w(n*k + lines + 1:), &
                       before(n*l + lines + 1), total)
        along = along + sum(total)
      end do
    end do
  end subroutine note

  pure subroutine note_some(n, start, r, w, before, total)
    integer, value                :: n        !< numbers, at most eight
    real(c_double), intent(in)    :: start(n) !< [N s]
    real(c_double), intent(in)    :: r(n)     !< impulses [N s]
    real(c_double), intent(in)    :: w(n)     !< diagonal of W [1/kg]
    real(c_double), intent(in)    :: before(n) !< impulses before that [N s]
    real(c_double), intent(inout) :: total(n) !< to which -dr.D (r - r before) is added [J]
    integer :: i
    !$omp simd
    do i = 1, n
      total(i) = total(i) + w(i)*((start(i) - r(i))*(r(i) - before(i)))
    end do
  end subroutine note_some
end module extrapolated_sweep
