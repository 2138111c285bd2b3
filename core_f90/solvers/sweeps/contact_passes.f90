!> Passes over batches that every solver needs before and after it iterates.
module contact_passes
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use contact_batch, only: cairn_schedule, cairn_batch, cairn_side, cairn_record, batch_workspace
  use contact_schedule, only: schedule_view, open_schedule
  use contact_velocity, only: contact_columns, find_columns
  use radial_passes, only: radial_impulse2, radial_impulse3
  use batch_kinematics, only: batch_view, open_batch, load_bodies, load_moved, bare_velocity, add_impulse, delassus_block
  use contacts_in_turn, only: give_in_turn
  !$ use omp_lib, only: omp_get_thread_num
  implicit none
  private
  public :: cairn_add_impulses, cairn_relative_velocities, cairn_delassus, cairn_contact_work
contains

  !> Gives all impulses to the bodies: record = record + A^-1 H r.
  subroutine cairn_add_impulses(schedule) bind(c)
    type(cairn_schedule), intent(in) :: schedule !< see cairn/core.h
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
          call impulses_of_batch(s%batch(b), s%side, s%record, s%general, s%work(:, me))
        end do
      end do
      !$omp end do
    end do
    !$omp end parallel
  end subroutine cairn_add_impulses

  subroutine impulses_of_batch(batch, sides, record, general, work)
    type(cairn_batch), intent(in)     :: batch
    type(cairn_side), intent(in)      :: sides(*)
    type(cairn_record), intent(inout) :: record(*)
    type(cairn_record), intent(in)    :: general(*)
    real(c_double), intent(inout), target :: work(batch_workspace)
    type(batch_view) :: view
    integer(c_int32_t), pointer, contiguous :: body_a(:), body_b(:)
    real(c_double), pointer, contiguous :: packed(:)
    integer :: n, vb
    if (batch%pack > 0) then
      n = batch%count
      call c_f_pointer(batch%frame, packed, [batch%pack*n])
      call c_f_pointer(batch%body_a, body_a, [n])
      call c_f_pointer(batch%body_b, body_b, [n])
      if (batch%components == 2) call radial_impulse2(n/8, batch%contacts, body_a, body_b, packed, record)
      if (batch%components == 3) call radial_impulse3(n/8, batch%contacts, body_a, body_b, packed, record)
      return
    end if
    call open_batch(batch, sides, work, view)
    if (batch%in_turn /= 0) then
      call give_in_turn(batch, sides, record, general, view)
      return
    end if
    vb = 1 + view%width_a*view%n
    call load_moved(batch, view, record, general, work(1), work(vb))
    call add_impulse(batch, view, view%r, work(1), work(vb), record)
  end subroutine impulses_of_batch

  !> Relative velocity of the contacts of one batch, without bias.
  subroutine cairn_relative_velocities(schedule, batch, thread, u) bind(c)
    type(cairn_schedule), intent(in) :: schedule !< see cairn/core.h
    integer(c_int32_t), value        :: batch    !< which, from 0
    integer(c_int32_t), value        :: thread   !< whose workspace, from 0
    real(c_double), intent(out)      :: u(*)     !< (n, c) [m/s]
    type(schedule_view) :: s
    type(batch_view) :: view
    integer :: vb, me
    me = thread + 1
    call open_schedule(schedule, s)
    call open_batch(s%batch(batch + 1), s%side, s%work(:, me), view)
    vb = 1 + view%width_a*view%n
    call load_bodies(view, s%record, s%general, s%work(:, me), s%work(vb:, me))
    call bare_velocity(view, s%work(:, me), s%work(vb:, me), u)
  end subroutine cairn_relative_velocities

  !> Delassus blocks and relative velocity of the contacts of one batch.
  subroutine cairn_delassus(schedule, batch, thread, w, w_true, u) bind(c)
    type(cairn_schedule), intent(in) :: schedule  !< see cairn/core.h
    integer(c_int32_t), value        :: batch     !< which, from 0
    integer(c_int32_t), value        :: thread    !< whose workspace, from 0
    real(c_double), intent(out)      :: w(*)      !< (n, c, c) with the hub's inverse mass times its group [1/kg]
    real(c_double), intent(out)      :: w_true(*) !< (n, c, c), of hubs only: with the inverse mass as it is [1/kg]
    real(c_double), intent(out)      :: u(*)      !< (n, c) relative velocity, without bias [m/s]
    type(schedule_view) :: s
    type(batch_view) :: view
    integer :: vb, me
    me = thread + 1
    call open_schedule(schedule, s)
    associate (this => s%batch(batch + 1))
      call open_batch(this, s%side, s%work(:, me), view)
      vb = 1 + view%width_a*view%n
      call load_bodies(view, s%record, s%general, s%work(:, me), s%work(vb:, me))
      call bare_velocity(view, s%work(:, me), s%work(vb:, me), u)
      call delassus_block(this, s%side, view, real(this%group, c_double), s%work(:, me), s%work(vb:, me), w)
      if (this%hub /= 0) call delassus_block(this, s%side, view, 1.0_c_double, s%work(:, me), s%work(vb:, me), w_true)
    end associate
  end subroutine cairn_delassus

  !> Work r.u of each contact at the velocity of the records (kept where the scale was), and its sums over each batch.
  subroutine cairn_contact_work(schedule, sums) bind(c)
    type(cairn_schedule), intent(in) :: schedule   !< see cairn/core.h
    real(c_double), intent(out)      :: sums(4, *) !< per batch: normal, tangential and rotations, positive part of the
    !< work of each contact, its size [J]
    type(schedule_view) :: s
    integer :: b, me
    call open_schedule(schedule, s)
    me = 1
    !$omp parallel num_threads(s%threads) if (s%threads > 1) default(shared) private(b) firstprivate(me)
    !$ me = omp_get_thread_num() + 1
    !$omp do schedule(static)
    do b = 1, s%batches
      call work_of_batch(s%batch(b), s%side, s%record, s%general, s%work(:, me), sums(:, b))
    end do
    !$omp end do
    !$omp end parallel
  end subroutine cairn_contact_work

  subroutine work_of_batch(batch, sides, record, general, work, sums)
    type(cairn_batch), intent(in)  :: batch
    type(cairn_side), intent(in)   :: sides(*)
    type(cairn_record), intent(in) :: record(*), general(*)
    real(c_double), intent(inout), target :: work(batch_workspace)
    real(c_double), intent(out)    :: sums(4)
    type(contact_columns) :: at
    real(c_double), pointer, contiguous :: kept(:)
    call find_columns(batch, sides, record, general, .false., work, at)
    call c_f_pointer(batch%scale, kept, [at%n])
    call add_work(at%n, at%c, at%r, at%u, kept, sums)
  end subroutine work_of_batch

  subroutine add_work(n, c, r, u, kept, sums)
    integer, value              :: n       !< contacts
    integer, value              :: c       !< components
    real(c_double), intent(in)  :: r(n, c) !< impulse [N s]
    real(c_double), intent(in)  :: u(n, c) !< relative velocity [m/s]
    real(c_double), intent(out) :: kept(n) !< r.u of each contact [J]
    real(c_double), intent(out) :: sums(4) !< normal, rest, positive, size [J]
    real(c_double) :: normal, rest, gained, size
    integer :: i, k
    normal = 0
    gained = 0
    size = 0
    !$omp simd reduction(+:normal)
    do i = 1, n
      kept(i) = r(i, 1)*u(i, 1)
      normal = normal + kept(i)
    end do
    sums(2) = 0
    do k = 2, c
      rest = 0
      !$omp simd reduction(+:rest)
      do i = 1, n
        kept(i) = kept(i) + r(i, k)*u(i, k)
        rest = rest + r(i, k)*u(i, k)
      end do
      sums(2) = sums(2) + rest
    end do
    !$omp simd reduction(+:gained, size)
    do i = 1, n
      gained = gained + max(0.0_c_double, kept(i))
      size = size + abs(kept(i))
    end do
    sums(1) = normal
    sums(3) = gained
    sums(4) = size
  end subroutine add_work
end module contact_passes
