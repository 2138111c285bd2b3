!> Sweeps for contacts without friction: normal impulses that give each contact a least velocity along its normal. Displacements
!> that part overlapping bodies obey such conditions in the metric of mass (Acary 2013).
module normal_sweep
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use contact_batch, only: cairn_schedule, cairn_batch, cairn_side, cairn_record, batch_workspace
  use contact_schedule, only: schedule_view, open_schedule
  use batch_kinematics, only: batch_view, open_batch, load_bodies, bare_velocity, add_impulse
  !$ use omp_lib, only: omp_get_thread_num
  implicit none
  private
  public :: cairn_normal_sweep
  integer, parameter :: w8 = 8 !< contacts at a time: a register of doubles
contains

  !> p_n >= 0, u_n - asked >= 0, one of them 0, contact by contact; records hold the velocities that p gives.
  subroutine cairn_normal_sweep(sweeps, schedule, asked, p, change) bind(c)
    integer(c_int32_t), value        :: sweeps    !< how many
    type(cairn_schedule), intent(in) :: schedule  !< see cairn/core.h
    real(c_double), intent(in)       :: asked(*)  !< (places) least velocity along the normal [m/s]
    real(c_double), intent(inout)    :: p(*)      !< (places) impulse along the normal [N s]
    real(c_double), intent(inout)    :: change(*) !< per batch: sum of dp W_NN dp in the last sweep [J]
    type(schedule_view) :: s
    integer :: sweep, stage, task, b, me, first
    call open_schedule(schedule, s)
    me = 1
    !$omp parallel num_threads(s%threads) if (s%threads > 1) default(shared) private(sweep, stage, task, b, first) firstprivate(me)
    !$ me = omp_get_thread_num() + 1
    do sweep = 1, sweeps
      do stage = 1, s%stages
        !$omp do schedule(dynamic, 1)
        do task = s%first_task(stage) + 1, s%first_task(stage + 1)
          do b = s%first_batch(task) + 1, s%first_batch(task + 1)
            first = s%batch(b)%first
            call one_batch(s%batch(b), s%side, s%record, s%general, asked(first + 1), p(first + 1), s%work(:, me), change(b))
          end do
        end do
        !$omp end do
      end do
    end do
    !$omp end parallel
  end subroutine cairn_normal_sweep

  subroutine one_batch(batch, sides, record, general, asked, p, work, change)
    type(cairn_batch), intent(in)     :: batch
    type(cairn_side), intent(in)      :: sides(*)
    type(cairn_record), intent(inout) :: record(*)
    type(cairn_record), intent(in)    :: general(*)
    real(c_double), intent(in)        :: asked(batch%count)
    real(c_double), intent(inout)     :: p(batch%count)
    real(c_double), intent(inout), target :: work(batch_workspace)
    real(c_double), intent(out)       :: change
    type(batch_view) :: view
    real(c_double), pointer, contiguous :: delassus(:), packed(:)
    integer(c_int32_t), pointer, contiguous :: body_a(:), body_b(:)
    integer :: n, c, vb, u, dr
    n = batch%count
    c = batch%components
    if (batch%pack > 0) then
      call c_f_pointer(batch%frame, packed, [batch%pack*n])
      call c_f_pointer(batch%body_a, body_a, [n])
      call c_f_pointer(batch%body_b, body_b, [n])
      call one_pack(n/w8, batch%pack, c, batch%contacts, body_a, body_b, packed, asked, p, record, change)
      return
    end if
    call open_batch(batch, sides, work, view)
    vb = 1 + view%width_a*n
    u = vb + view%width_b*n
    dr = u + c*n
    call load_bodies(view, record, general, work(1), work(vb))
    call bare_velocity(view, work(1), work(vb), work(u))
    call c_f_pointer(batch%delassus, delassus, [n])
    call push(n, c, batch%contacts, delassus, work(u), asked, p, work(dr), change)
    call add_impulse(batch, view, work(dr), work(1), work(vb), record)
  end subroutine one_batch

  pure subroutine push(n, c, contacts, w, u, asked, p, dr, change)
    integer, value                :: n        !< contacts, dummies included
    integer, value                :: c        !< components
    integer, value                :: contacts !< contacts that are not dummies
    real(c_double), intent(in)    :: w(n)     !< W_NN [1/kg]
    real(c_double), intent(in)    :: u(n, c)  !< relative velocity [m/s]
    real(c_double), intent(in)    :: asked(n) !< [m/s]
    real(c_double), intent(inout) :: p(n)     !< [N s]
    real(c_double), intent(out)   :: dr(n, c) !< change of impulse [N s]
    real(c_double), intent(out)   :: change   !< [J]
    real(c_double) :: next
    integer :: i
    dr = 0
    change = 0
    do i = 1, contacts
      next = max(0.0_c_double, p(i) - (u(i, 1) - asked(i))/max(w(i), tiny(next)))
      dr(i, 1) = next - p(i)
      p(i) = next
      change = change + w(i)*dr(i, 1)**2
    end do
  end subroutine push

  subroutine one_pack(packs, lines, d, contacts, body_a, body_b, pack, asked, p, record, change)
    integer, value                    :: packs              !< eights of contacts, dummies included
    integer, value                    :: lines              !< of a pack
    integer, value                    :: d                  !< dimension
    integer, value                    :: contacts           !< contacts that are not dummies
    integer(c_int32_t), intent(in)    :: body_a(w8, packs)  !< places of records, from 0
    integer(c_int32_t), intent(in)    :: body_b(w8, packs)  !< places of records, from 0
    real(c_double), intent(in)        :: pack(w8, lines, packs) !< normal first [-], see cairn/core.h
    real(c_double), intent(in)        :: asked(w8, packs)   !< [m/s]
    real(c_double), intent(inout)     :: p(w8, packs)       !< [N s]
    type(cairn_record), intent(inout) :: record(0:*)        !< velocity records
    real(c_double), intent(out)       :: change             !< [J]
    real(c_double) :: u, w, ma, mb, next, dp
    integer :: k, i, c, m
    change = 0
    m = merge(4, 7, d == 2) ! inverse mass
    do k = 1, packs
      do i = 1, min(w8, contacts - (k - 1)*w8)
        associate (a => record(body_a(i, k))%x, b => record(body_b(i, k))%x)
          u = 0
          do c = 1, d
            u = u + pack(i, c, k)*(a(c) - b(c))
          end do
          ma = a(m)
          mb = b(m)
          w = ma + mb
          next = max(0.0_c_double, p(i, k) - (u - asked(i, k))/max(w, tiny(w)))
          dp = next - p(i, k)
          if (.not. abs(dp) > 0) cycle
          p(i, k) = next
          change = change + w*dp*dp
          do c = 1, d
            a(c) = a(c) + ma*dp*pack(i, c, k)
            b(c) = b(c) - mb*dp*pack(i, c, k)
          end do
        end associate
      end do
    end do
  end subroutine one_pack
end module normal_sweep
