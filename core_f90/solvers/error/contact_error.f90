!> Error of impulses, the same for every solver: the natural map in an energy norm. With rho = 1/W_NN of the contact, u the relative
!> velocity and b the law's bias,
!>   F(r) = r - P_K( r - rho (u + (b + mu |u_T|, 0, 0)) ),   K Coulomb's cone
!> (De Saxce & Feng 1998; the natural map: Acary & Brogliato 2008). A law with its own local solution gives its F itself, in the
!> slot `residual`; without that slot, F(r) is r minus its solution when each contact is solved once more.
module contact_error
  use, intrinsic :: iso_c_binding, only: c_associated, c_int32_t, c_double, c_f_pointer, c_f_procpointer
  use contact_batch, only: cairn_schedule, cairn_batch, cairn_side, cairn_record, batch_workspace, max_batch, &
    law_residual, law_solve
  use contact_schedule, only: schedule_view, open_schedule
  use contact_velocity, only: contact_columns, find_columns
  use cone_residual, only: cone_map, cone_status
  use law_context, only: cairn_law_context
  !$ use omp_lib, only: omp_get_thread_num
  implicit none
  private
  public :: cairn_contact_scale, cairn_contact_error, cairn_contact_terms, cairn_law_misses
  integer, parameter :: sums_size = 6
contains

  !> |F(0)|^2 / rho of every contact, from records that hold the free velocity.
  subroutine cairn_contact_scale(schedule, sums) bind(c)
    type(cairn_schedule), intent(in) :: schedule  !< see cairn/core.h
    real(c_double), intent(out)      :: sums(sums_size, *) !< per batch: sum |F(0)|^2/rho [J], rest unused
    call all_batches(schedule, 1, 0.0_c_double, sums)
  end subroutine cairn_contact_scale

  !> Error of the impulses; records hold the velocity that they leave.
  subroutine cairn_contact_error(schedule, want_status, least_scale, sums) bind(c)
    type(cairn_schedule), intent(in) :: schedule    !< see cairn/core.h
    integer(c_int32_t), value        :: want_status !< 1: write the status of every contact too
    real(c_double), value            :: least_scale !< of a contact: lower bound of the scale, below which errors do not matter [J]
    real(c_double), intent(out)      :: sums(sums_size, *) !< per batch: sum |F|^2/rho, sum |r|^2/rho [J], largest
    !< |F|^2/max(|r|^2, |F(0)|^2, |F|^2, least scale), its place in the batch from 1,
    !< largest (distance outside the cone/|r|)^2, unused
    call all_batches(schedule, 2 + want_status, least_scale, sums)
  end subroutine cairn_contact_error

  !> Error of the impulses of a batch, with the terms of each contact for those who add them up in an order of their own.
  subroutine cairn_contact_terms(schedule, batch, thread, want_status, least_scale, sums, terms) bind(c)
    type(cairn_schedule), intent(in) :: schedule    !< see cairn/core.h; records hold the velocity that the impulses leave
    integer(c_int32_t), value        :: batch       !< from 0
    integer(c_int32_t), value        :: thread      !< whose workspace, from 0
    integer(c_int32_t), value        :: want_status !< 1: write the status of every contact too, and the sums; else these are 0
    real(c_double), value            :: least_scale !< as cairn_contact_error has it [J]
    real(c_double), intent(out)      :: sums(sums_size) !< likewise
    real(c_double), intent(out)      :: terms(*)    !< (n, 2) |F|^2/rho, |r|^2/rho, dummies too [J]
    type(schedule_view) :: s
    call open_schedule(schedule, s)
    call one_batch(s%batch(batch + 1), s%side, s%record, s%general, 2 + want_status, least_scale, s%work(:, thread + 1), &
                   sums, terms)
  end subroutine cairn_contact_terms

  !> Error |F|^2/rho of each contact of a batch whose law has its own local solution.
  subroutine cairn_law_misses(schedule, batch, missed) bind(c)
    type(cairn_schedule), intent(in) :: schedule    !< see cairn/core.h; records hold the velocity that the impulses leave
    integer(c_int32_t), value        :: batch       !< from 0
    real(c_double), intent(out)      :: missed(*)   !< per contact, dummies too [J]
    type(schedule_view) :: s
    type(contact_columns) :: at
    real(c_double), pointer, contiguous :: rho(:), f(:), weight(:)
    integer(c_int32_t) :: found(max_batch)
    integer :: n, c
    call open_schedule(schedule, s)
    call find_columns(s%batch(batch + 1), s%side, s%record, s%general, .true., s%work(:, 1), at)
    n = at%n
    c = at%c
    f => at%free(1:c*n)
    weight => at%free(c*n + 1:2*c*n)
    call c_f_pointer(s%batch(batch + 1)%rho, rho, [n])
    call law_residual_of(s%batch(batch + 1), n, c, .true., rho, at, f, weight, found)
    call energies(n, c, weight, f, missed)
  end subroutine cairn_law_misses

  pure subroutine energies(n, c, weight, f, energy)
    integer, value              :: n            !< contacts
    integer, value              :: c            !< components
    real(c_double), intent(in)  :: weight(n, c) !< [1/kg]
    real(c_double), intent(in)  :: f(n, c)      !< [N s]
    real(c_double), intent(out) :: energy(n)    !< weight f^2 [J]
    integer :: k
    energy = 0
    do k = 1, c
      energy = energy + weight(:, k)*f(:, k)**2
    end do
  end subroutine energies

  subroutine all_batches(schedule, what, least_scale, sums)
    type(cairn_schedule), intent(in) :: schedule
    integer, value                   :: what !< 1 scale, 2 error, 3 error and status
    real(c_double), value            :: least_scale
    real(c_double), intent(out)      :: sums(sums_size, *)
    type(schedule_view) :: s
    integer :: b, me
    call open_schedule(schedule, s)
    me = 1
    !$omp parallel num_threads(s%threads) if (s%threads > 1) default(shared) private(b) firstprivate(me)
    !$ me = omp_get_thread_num() + 1
    !$omp do schedule(static)
    do b = 1, s%batches
      call one_batch(s%batch(b), s%side, s%record, s%general, what, least_scale, s%work(:, me), sums(:, b))
    end do
    !$omp end do
    !$omp end parallel
  end subroutine all_batches

  subroutine one_batch(batch, sides, record, general, what, least_scale, work, sums, terms)
    type(cairn_batch), intent(in)  :: batch
    type(cairn_side), intent(in)   :: sides(*)
    type(cairn_record), intent(in) :: record(*), general(*)
    integer, value                 :: what
    real(c_double), value          :: least_scale
    real(c_double), intent(inout), target :: work(batch_workspace)
    real(c_double), intent(out)    :: sums(sums_size)
    real(c_double), intent(out), optional :: terms(2*batch%count) !< of each contact, as cairn_contact_terms has them [J]
    type(contact_columns) :: at
    real(c_double), pointer, contiguous :: rho(:), scale(:)
    integer(c_int32_t), pointer, contiguous :: status(:)
    integer :: n, c, f, weight, axes
    call find_columns(batch, sides, record, general, .true., work, at)
    n = at%n
    c = at%c
    axes = merge(2, 3, batch%velocities == 3)
    f = 1
    weight = 1 + c*n
    call c_f_pointer(batch%rho, rho, [n])
    call c_f_pointer(batch%scale, scale, [n])
    sums = 0
    if (batch%relaxes == 0) then
      call law_batch(batch, n, c, what, least_scale, rho, scale, at, sums, terms)
      return
    end if
    call cone_map(n, axes, what == 1, at%mu, rho, at%r, at%u, at%free(f:))
    if (what == 1) then
      call weights(n, c, axes, rho, at%free(weight:))
      call keep_scale(n, c, at%free(weight:), at%free(f:), scale, sums)
      return
    end if
    if (present(terms)) then
      call weights(n, c, axes, rho, at%free(weight:))
      call energies(n, c, at%free(weight:), at%free(f:), terms(1:n))
      call energies(n, c, at%free(weight:), at%r, terms(n + 1:2*n))
      if (what < 3) return ! the terms say it all
    end if
    call add_up_cone(n, axes, least_scale, at%mu, rho, scale, at%r, at%free(f:), at%u, sums)
    if (what < 3) return
    call c_f_pointer(batch%status, status, [n])
    call cone_status(n, axes, at%mu, at%r, status)
  end subroutine one_batch

  !> Contacts of a law with its own local solution.
  subroutine law_batch(batch, n, c, what, least_scale, rho, scale, at, sums, terms)
    type(cairn_batch), intent(in)   :: batch
    integer, value                  :: n        !< contacts
    integer, value                  :: c        !< components
    integer, value                  :: what     !< 1 scale, 2 error, 3 error and status
    real(c_double), value           :: least_scale !< of one contact [J]
    real(c_double), intent(in)      :: rho(n)   !< 1/W_NN [kg]
    real(c_double), intent(inout)   :: scale(n) !< |F(0)|^2 [J]
    type(contact_columns), intent(in) :: at     !< velocities, impulses, workspace
    real(c_double), intent(inout)   :: sums(sums_size)
    real(c_double), intent(out), optional :: terms(2*n) !< of each contact [J]
    real(c_double), pointer, contiguous :: f(:), weight(:)
    integer(c_int32_t), pointer, contiguous :: status(:)
    integer(c_int32_t) :: found(max_batch)
    f => at%free(1:c*n)
    weight => at%free(c*n + 1:2*c*n)
    call law_residual_of(batch, n, c, what > 1, rho, at, f, weight, found)
    if (what == 1) then
      call keep_scale(n, c, weight, f, scale, sums)
      return
    end if
    if (present(terms)) then
      call energies(n, c, weight, f, terms(1:n))
      call energies(n, c, weight, at%r, terms(n + 1:2*n))
      if (what < 3) return
    end if
    call add_up(n, c, least_scale, weight, scale, at%r, f, at%u, sums)
    if (what < 3) return
    call c_f_pointer(batch%status, status, [n])
    status = found(1:n)
  end subroutine law_batch

  !> The law says how far its contacts are from it, or they are solved once more.
  subroutine law_residual_of(batch, n, c, loaded, rho, at, f, weight, found)
    type(cairn_batch), intent(in)   :: batch
    integer, value                  :: n        !< contacts
    integer, value                  :: c        !< components
    logical, value                  :: loaded   !< by the impulses, or by none
    real(c_double), intent(in)      :: rho(n)   !< 1/W_NN [kg]
    type(contact_columns), intent(in) :: at     !< velocities, impulses, workspace, of which f and weight are the first 2 c n
    real(c_double), intent(inout)   :: f(n*c)      !< F [N s]
    real(c_double), intent(inout)   :: weight(n*c) !< [1/kg]
    integer(c_int32_t), intent(out) :: found(max_batch) !< status
    real(c_double), pointer, contiguous :: delassus(:), bias(:), params(:), state(:), r(:), b(:)
    type(cairn_law_context), pointer :: context
    procedure(law_residual), pointer :: residual
    procedure(law_solve), pointer :: solve
    integer :: some
    some = c*n
    r => at%free(2*some + 1:3*some)
    b => at%free(3*some + 1:4*some)
    call c_f_pointer(batch%delassus, delassus, [c*some])
    call c_f_pointer(batch%bias, bias, [some])
    call c_f_pointer(batch%params, params, [n])
    state => at%free(:0) ! a law without state is handed an array of nothing
    if (c_associated(batch%state)) call c_f_pointer(batch%state, state, [n])
    call keep(some, loaded, at%r, r)
    call keep(some, .true., bias, b)
    call repeat_last(n, c, batch%contacts, at%u, r, b)
    if (c_associated(batch%residual)) then
      call c_f_procpointer(batch%residual, residual)
      call c_f_pointer(batch%context, context)
      call residual(n, c, context, rho, delassus, at%u, b, r, params, state, f, weight, found)
    else
      call c_f_procpointer(batch%solve, solve)
      call solve_again(n, c, solve, rho, delassus, at%u, b, r, params, state, at%r, f, weight, found)
    end if
    call clear_dummies(n, c, batch%contacts, f)
  end subroutine law_residual_of

  !> A separate procedure, so that the compiler makes no copy because pointers may alias.
  pure subroutine keep(n, whole, from, to)
    integer, value              :: n       !< numbers
    logical, value              :: whole   !< or nothing
    real(c_double), intent(in)  :: from(n)
    real(c_double), intent(out) :: to(n)
    to = 0
    if (whole) to = from
  end subroutine keep

  !> By how much the impulses change if each contact is solved once more, the others as they are: nothing at a solution, for any
  !> block that is positive definite. A hub's block is larger than its true one by what rho says.
  subroutine solve_again(n, c, solve, rho, w, u, bias, r, params, state, own, f, weight, status)
    integer, value                  :: n            !< contacts
    integer, value                  :: c            !< components
    procedure(law_solve)            :: solve
    real(c_double), intent(in)      :: rho(n)       !< 1/true W_NN [kg]
    real(c_double), intent(in)      :: w(n, c, c)   !< Delassus blocks [1/kg]
    real(c_double), intent(inout)   :: u(n, c)      !< relative velocity, bias included, then without r [m/s]
    real(c_double), intent(in)      :: bias(n, c)   !< [m/s]
    real(c_double), intent(in)      :: r(n, c)      !< impulse [N s]
    real(c_double), intent(in)      :: params(n, *), state(n, *)
    real(c_double), intent(inout)   :: own(n, c)    !< impulses of the batch: a routine may know contacts by their place [N s]
    real(c_double), intent(out)     :: f(n, c)      !< [N s]
    real(c_double), intent(out)     :: weight(n, c) !< [1/kg]
    integer(c_int32_t), intent(out) :: status(n)
    integer :: k, l
    do l = 1, c
      do k = 1, c
        u(:, k) = u(:, k) - w(:, k, l)*r(:, l)
      end do
    end do
    weight = own
    own = r
    status = -1
    call solve(n, c, w, u, bias, params, state, own, status)
    where (status < 0) status = merge(1, 0, own(:, 1) > 0) ! of a law that says none
    f = own
    own = weight
    do k = 1, c
      f(:, k) = (r(:, k) - f(:, k))*(rho*w(:, 1, 1))
      weight(:, k) = w(:, k, k)/(rho*w(:, 1, 1))
    end do
  end subroutine solve_again

  !> Fills dummies with the last contact, since laws may divide by values that are 0 in a dummy.
  subroutine repeat_last(n, c, contacts, u, r, bias)
    integer, value                :: n          !< contacts, dummies included
    integer, value                :: c          !< components
    integer, value                :: contacts   !< contacts that are not dummies
    real(c_double), intent(inout) :: u(n, c), r(n, c), bias(n, c)
    integer :: k
    do k = 1, c
      u(contacts + 1:n, k) = u(contacts, k)
      r(contacts + 1:n, k) = r(contacts, k)
      bias(contacts + 1:n, k) = bias(contacts, k)
    end do
  end subroutine repeat_last

  subroutine clear_dummies(n, c, contacts, f)
    integer, value                :: n        !< contacts, dummies included
    integer, value                :: c        !< components
    integer, value                :: contacts !< contacts that are not dummies
    real(c_double), intent(inout) :: f(n, c)  !< [N s]
    f(contacts + 1:n, :) = 0
  end subroutine clear_dummies

  !> Squares of components times weight are energies.
  subroutine weights(n, c, axes, rho, weight)
    integer, value              :: n            !< contacts
    integer, value              :: c            !< components
    integer, value              :: axes         !< components of velocity, 2 or 3
    real(c_double), intent(in)  :: rho(n)       !< 1/W_NN [kg]
    real(c_double), intent(out) :: weight(n, c) !< [1/kg]
    integer :: i, k
    do k = 1, c
      do i = 1, n
        weight(i, k) = merge(1/rho(i), 0.0_c_double, k <= axes)
      end do
    end do
  end subroutine weights

  subroutine keep_scale(n, c, weight, f, scale, sums)
    integer, value              :: n            !< contacts
    integer, value              :: c            !< components
    real(c_double), intent(in)  :: weight(n, c) !< [1/kg]
    real(c_double), intent(in)  :: f(n, c)      !< F(0) [N s]
    real(c_double), intent(out) :: scale(n)     !< |F(0)|^2 [J]
    real(c_double), intent(inout) :: sums(sums_size)
    real(c_double) :: total
    integer :: i, k
    scale = 0
    do k = 1, c
      !$omp simd
      do i = 1, n
        scale(i) = scale(i) + weight(i, k)*f(i, k)**2
      end do
    end do
    total = 0
    !$omp simd reduction(+:total)
    do i = 1, n
      total = total + scale(i)
    end do
    sums(1) = total
  end subroutine keep_scale

  !> Sums and worst contact of contacts without rotations.
  subroutine add_up_cone(n, axes, least_scale, mu, rho, scale, r, f, ratio, sums)
    integer, value                :: n          !< contacts
    integer, value                :: axes       !< components of velocity, 2 or 3
    real(c_double), value         :: least_scale !< of one contact [J]
    real(c_double), intent(in)    :: mu(n)      !< friction [-]
    real(c_double), intent(in)    :: rho(n)     !< 1/W_NN [kg]
    real(c_double), intent(in)    :: scale(n)   !< |F(0)|^2 [J]
    real(c_double), intent(in)    :: r(n, axes) !< impulse [N s]
    real(c_double), intent(in)    :: f(n, axes) !< residual [N s]
    real(c_double), intent(inout) :: ratio(n)   !< workspace
    real(c_double), intent(inout) :: sums(sums_size)
    real(c_double) :: error, size, worst, furthest, square, tangent, normal, residual, weight, out, least
    integer :: i
    least = max(least_scale, tiny(least))
    error = 0
    size = 0
    worst = 0
    furthest = 0
    !$omp simd reduction(+:error, size) reduction(max:worst, furthest) private(square, tangent, normal, residual, weight, out)
    do i = 1, n
      weight = 1/rho(i)
      residual = f(i, 1)**2 + f(i, 2)**2
      tangent = r(i, 2)**2
      if (axes == 3) residual = residual + f(i, axes)**2
      if (axes == 3) tangent = tangent + r(i, axes)**2
      normal = max(0.0_c_double, r(i, 1))
      square = r(i, 1)**2 + tangent
      out = max(0.0_c_double, -r(i, 1), sqrt(tangent) - mu(i)*normal)
      error = error + weight*residual
      size = size + weight*square
      ratio(i) = weight*residual/max(weight*square, scale(i), weight*residual, least) ! 1: nothing of it is right
      worst = max(worst, ratio(i))
      furthest = max(furthest, out*out/max(square, tiny(square)))
    end do
    sums(1) = error
    sums(2) = size
    sums(3) = worst
    sums(5) = furthest
    do i = 1, n
      if (ratio(i) >= worst .and. worst > 0) exit
    end do
    sums(4) = min(i, n)
  end subroutine add_up_cone

  !> The same of laws, whose impulses no cone holds.
  subroutine add_up(n, c, least_scale, weight, scale, r, f, work, sums)
    integer, value                :: n            !< contacts
    integer, value                :: c            !< components
    real(c_double), value         :: least_scale !< of one contact [J]
    real(c_double), intent(in)    :: weight(n, c) !< [1/kg]
    real(c_double), intent(in)    :: scale(n)     !< |F(0)|^2 [J]
    real(c_double), intent(in)    :: r(n, c)      !< impulse [N s]
    real(c_double), intent(in)    :: f(n, c)      !< residual [N s]
    real(c_double), intent(inout) :: work(n, 2)
    real(c_double), intent(inout) :: sums(sums_size)
    real(c_double) :: error, size, worst, least
    integer :: i, k
    least = max(least_scale, tiny(least))
    error = 0
    size = 0
    work = 0
    do k = 1, c
      !$omp simd reduction(+:error, size)
      do i = 1, n
        work(i, 1) = work(i, 1) + weight(i, k)*f(i, k)**2
        work(i, 2) = work(i, 2) + weight(i, k)*r(i, k)**2
        error = error + weight(i, k)*f(i, k)**2
        size = size + weight(i, k)*r(i, k)**2
      end do
    end do
    worst = 0
    !$omp simd reduction(max:worst)
    do i = 1, n
      work(i, 1) = work(i, 1)/max(work(i, 2), scale(i), work(i, 1), least)
      worst = max(worst, work(i, 1))
    end do
    sums(1) = error
    sums(2) = size
    sums(3) = worst
    do i = 1, n
      if (work(i, 1) >= worst .and. worst > 0) exit
    end do
    sums(4) = min(i, n)
  end subroutine add_up
end module contact_error
