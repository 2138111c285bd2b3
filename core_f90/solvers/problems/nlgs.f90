!> Block nonlinear Gauss-Seidel (Moreau 1988, Jean 1999): each contact in turn is solved exactly for its own impulse, with the
!> velocities that the others leave it. Contacts of a batch share no body that moves, so they are solved at once; tasks of a
!> stage share none either, so that threads take them in any order with the same bits.
module nlgs
  use, intrinsic :: iso_c_binding, only: c_associated, c_int32_t, c_double, c_f_pointer, c_f_procpointer
  use contact_batch, only: cairn_schedule, cairn_record, cairn_batch, cairn_side, law_solve, batch_workspace, &
    max_batch
  use contact_schedule, only: schedule_view, open_schedule
  use radial_sweep, only: sweep_radial2, sweep_radial3, sweep_associated2, sweep_associated3
  use batch_kinematics, only: batch_view, open_batch, load_bodies, relative_velocity, add_impulse
  use contacts_in_turn, only: sweep_in_turn
  use cone_refinement, only: refine_cone3
  !$ use omp_lib, only: omp_get_thread_num
  implicit none
  private
  public :: cairn_nlgs_sweep, sweep_batch
  integer(c_int32_t), parameter :: softens = 4 !< see cairn_contact_status
contains

  !> Sweeps over all contacts.
  subroutine cairn_nlgs_sweep(sweeps, schedule, change) bind(c)
    integer(c_int32_t), value        :: sweeps      !< how many
    type(cairn_schedule), intent(in) :: schedule    !< see cairn/core.h
    real(c_double), intent(inout)    :: change(*)   !< per batch: sum of dr.W dr in the last sweep [J]
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
          do b = s%first_batch(task) + 1, s%first_batch(task + 1)
            call sweep_batch(s%batch(b), s%side, s%record, s%general, s%relaxation, s%softening_relaxation, &
                             s%associated, s%work(:, me), change(b))
          end do
        end do
        !$omp end do
      end do
    end do
    !$omp end parallel
  end subroutine cairn_nlgs_sweep

  subroutine sweep_batch(batch, sides, record, general, relaxation, softening, associated, work, change)
    type(cairn_batch), intent(in)     :: batch
    type(cairn_side), intent(in)      :: sides(*)
    type(cairn_record), intent(inout) :: record(*)
    type(cairn_record), intent(in)    :: general(*)
    real(c_double), value             :: relaxation
    real(c_double), value             :: softening !< share of its change that a bond which softens takes
    logical, value                    :: associated !< see radial_sweep
    real(c_double), intent(inout), target :: work(batch_workspace)
    real(c_double), intent(out)       :: change
    type(batch_view) :: view
    real(c_double), pointer, contiguous :: delassus(:), state(:), packed(:)
    integer(c_int32_t), pointer, contiguous :: body_a(:), body_b(:)
    procedure(law_solve), pointer :: solve
    integer(c_int32_t) :: status(max_batch)
    integer :: n, c, va, vb, u, dr, w, columns, i
    if (batch%pack > 0) then
      n = batch%count
      call c_f_pointer(batch%frame, packed, [batch%pack*n])
      call c_f_pointer(batch%body_a, body_a, [n])
      call c_f_pointer(batch%body_b, body_b, [n])
      if (associated) then
        if (batch%components == 2) &
          call sweep_associated2(n/8, batch%contacts, body_a, body_b, relaxation, packed, record, change)
        if (batch%components == 3) &
          call sweep_associated3(n/8, batch%contacts, body_a, body_b, relaxation, packed, record, change)
      else
        if (batch%components == 2) &
          call sweep_radial2(n/8, batch%contacts, body_a, body_b, relaxation, packed, record, change)
        if (batch%components == 3) &
          call sweep_radial3(n/8, batch%contacts, body_a, body_b, relaxation, packed, record, change)
      end if
      return
    end if
    call open_batch(batch, sides, work, view)
    if (batch%in_turn /= 0) then
      call sweep_in_turn(batch, sides, record, general, relaxation, view, change)
      return
    end if
    n = view%n
    c = view%c
    va = 1
    vb = va + view%width_a*n
    u = vb + view%width_b*n
    dr = u + c*n
    w = dr + c*n
    columns = merge(2, c*c, batch%block == 0)
    call c_f_pointer(batch%delassus, delassus, [columns*n])
    if (batch%relaxes /= 0) then
      do concurrent (i = 1:columns*n) ! no array expression: both may be the same memory for all the compiler knows
        work(w + i - 1) = delassus(i)*(1/relaxation)
      end do
      delassus => work(w:w + columns*n - 1)
    end if
    if (c_associated(batch%state)) then
      call c_f_pointer(batch%state, state, [n])
    else
      state => work(:0) ! a law without state is handed an array of nothing
    end if
    call c_f_procpointer(batch%solve, solve)
    call load_bodies(view, record, general, work(va), work(vb))
    call relative_velocity(view, work(va), work(vb), work(u))
    if (batch%block == 0) then
      call leave_isotropic(n, c, delassus, view%r, work(u), work(dr))
      if (batch%repeats /= 0) call repeat_last(n, c, batch%contacts, work(u), view%bias, view%r)
      call solve(n, c, delassus, work(u), view%bias, view%params, state, view%r)
      if (batch%repeats /= 0) call clear_dummies(n, c, batch%contacts, view%bias, view%r)
      call change_isotropic(n, c, delassus, view%r, work(dr), change)
    else
      call leave_full(n, c, delassus, view%r, work(u), work(dr))
      if (batch%repeats /= 0) call repeat_last(n, c, batch%contacts, work(u), view%bias, view%r)
      if (softening < 1 .and. batch%relaxes == 0) then
        status(:n) = -1 ! of a law that says none
        call solve(n, c, delassus, work(u), view%bias, view%params, state, view%r, status)
        call take_share(n, c, status, softening, work(dr), view%r)
      else if (batch%relaxes == 2) then
        call refine_cone3(n, c, delassus, work(u), view%params, view%r)
      else
        call solve(n, c, delassus, work(u), view%bias, view%params, state, view%r)
      end if
      if (batch%repeats /= 0) call clear_dummies(n, c, batch%contacts, view%bias, view%r)
      call change_full(n, c, delassus, view%r, work(dr), change)
    end if
    call add_impulse(batch, view, work(dr), work(va), work(vb), record)
  end subroutine sweep_batch

  !> Fills dummies with the last contact, since a law may divide by values that are 0 in a dummy.
  subroutine repeat_last(n, c, contacts, u, bias, r)
    integer, value                :: n          !< contacts, dummies included
    integer, value                :: c          !< components
    integer, value                :: contacts   !< contacts that are not dummies
    real(c_double), intent(inout) :: u(n, c)    !< relative velocity without r [m/s]
    real(c_double), intent(inout) :: bias(n, c) !< [m/s]
    real(c_double), intent(inout) :: r(n, c)    !< impulse [N s]
    integer :: k
    do k = 1, c
      u(contacts + 1:n, k) = u(contacts, k)
      bias(contacts + 1:n, k) = bias(contacts, k)
      r(contacts + 1:n, k) = r(contacts, k)
    end do
  end subroutine repeat_last

  !> Under-relaxation of softening bonds: a stress that falls as the bond opens lets its neighbours open, which compresses it again,
  !> so that full changes would oscillate.
  subroutine take_share(n, c, status, share, old, r)
    integer, value                 :: n         !< contacts
    integer, value                 :: c         !< components
    integer(c_int32_t), intent(in) :: status(n) !< see cairn_contact_status
    real(c_double), value          :: share     !< [-]
    real(c_double), intent(in)     :: old(n, c) !< impulse before [N s]
    real(c_double), intent(inout)  :: r(n, c)   !< that the law has found, then the one that is taken [N s]
    integer :: k
    do k = 1, c
      where (status == softens) r(:, k) = old(:, k) + share*(r(:, k) - old(:, k))
    end do
  end subroutine take_share

  !> Sets the impulses of dummy contacts, which fill up the last lanes, to zero.
  subroutine clear_dummies(n, c, contacts, bias, r)
    integer, value                :: n          !< contacts, dummies included
    integer, value                :: c          !< components
    integer, value                :: contacts   !< contacts that are not dummies
    real(c_double), intent(inout) :: bias(n, c) !< [m/s]
    real(c_double), intent(inout) :: r(n, c)    !< impulse [N s]
    integer :: k
    do k = 1, c
      bias(contacts + 1:n, k) = 0
      r(contacts + 1:n, k) = 0
    end do
  end subroutine clear_dummies

  !> Removes the contact's own impulse from u; keeps that impulse in old.
  subroutine leave_isotropic(n, c, w, r, u, old)
    integer, value                :: n        !< contacts
    integer, value                :: c        !< components
    real(c_double), intent(in)    :: w(n, 2)  !< W_NN, W_TT [1/kg]
    real(c_double), intent(in)    :: r(n, c)  !< impulse [N s]
    real(c_double), intent(inout) :: u(n, c)  !< relative velocity, then without r [m/s]
    real(c_double), intent(out)   :: old(n, c) !< r [N s]
    integer :: i, k
    do k = 1, c
      !$omp simd
      do i = 1, n
        u(i, k) = u(i, k) - w(i, min(k, 2))*r(i, k)
        old(i, k) = r(i, k)
      end do
    end do
  end subroutine leave_isotropic

  subroutine change_isotropic(n, c, w, r, dr, change)
    integer, value                :: n        !< contacts
    integer, value                :: c        !< components
    real(c_double), intent(in)    :: w(n, 2)  !< W_NN, W_TT [1/kg]
    real(c_double), intent(in)    :: r(n, c)  !< new impulse [N s]
    real(c_double), intent(inout) :: dr(n, c) !< old impulse, then the change [N s]
    real(c_double), intent(out)   :: change   !< sum of dr.W dr [J]
    real(c_double) :: total
    integer :: i, k
    total = 0
    do k = 1, c
      !$omp simd reduction(+:total)
      do i = 1, n
        dr(i, k) = r(i, k) - dr(i, k)
        total = total + w(i, min(k, 2))*dr(i, k)**2
      end do
    end do
    change = total
  end subroutine change_isotropic

  subroutine leave_full(n, c, w, r, u, old)
    integer, value                :: n          !< contacts
    integer, value                :: c          !< components
    real(c_double), intent(in)    :: w(n, c, c) !< Delassus blocks [1/kg]
    real(c_double), intent(in)    :: r(n, c)    !< impulse [N s]
    real(c_double), intent(inout) :: u(n, c)    !< relative velocity, then without r [m/s]
    real(c_double), intent(out)   :: old(n, c)  !< r [N s]
    integer :: i, k, l
    do k = 1, c
      do l = 1, c
        !$omp simd
        do i = 1, n
          u(i, k) = u(i, k) - w(i, k, l)*r(i, l)
        end do
      end do
      !$omp simd
      do i = 1, n
        old(i, k) = r(i, k)
      end do
    end do
  end subroutine leave_full

  subroutine change_full(n, c, w, r, dr, change)
    integer, value                :: n          !< contacts
    integer, value                :: c          !< components
    real(c_double), intent(in)    :: w(n, c, c) !< Delassus blocks [1/kg]
    real(c_double), intent(in)    :: r(n, c)    !< new impulse [N s]
    real(c_double), intent(inout) :: dr(n, c)   !< old impulse, then the change [N s]
    real(c_double), intent(out)   :: change     !< sum of dr.W dr [J]
    real(c_double) :: total
    integer :: i, k, l
    do k = 1, c
      !$omp simd
      do i = 1, n
        dr(i, k) = r(i, k) - dr(i, k)
      end do
    end do
    total = 0
    do l = 1, c
      do k = 1, c
        !$omp simd reduction(+:total)
        do i = 1, n
          total = total + w(i, k, l)*dr(i, k)*dr(i, l)
        end do
      end do
    end do
    change = total
  end subroutine change_full
end module nlgs
