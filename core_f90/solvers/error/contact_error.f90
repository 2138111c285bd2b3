!> How far impulses are from a solution, the same for every solver: the natural map in an energy norm. With rho = 1/W_NN of the
!> contact, u the relative velocity and b the law's bias,
!>   F(r) = r - P_K( r - rho (u + (b + mu |u_T|, 0, 0)) ),   K Coulomb's cone
!> (De Saxce & Feng 1998; the natural map: Acary & Brogliato 2008). Laws with their own local solution give F = D^-1 (u + b) where
!> they hold the contact fast, D the diagonal of W, and the cone's F where they do not.
module contact_error
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use contact_batch, only: cairn_schedule, cairn_batch, cairn_side, cairn_record, batch_workspace
  use contact_schedule, only: schedule_view, open_schedule
  use contact_velocity, only: contact_columns, find_columns
  !$ use omp_lib, only: omp_get_thread_num
  implicit none
  private
  public :: cairn_contact_scale, cairn_contact_error
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
    real(c_double), value            :: least_scale !< of one contact: what is smaller is not worth naming [J]
    real(c_double), intent(out)      :: sums(sums_size, *) !< per batch: sum |F|^2/rho, sum |r|^2/rho [J], largest
    !< |F|^2/max(|r|^2, |F(0)|^2, |F|^2, least scale), its place in the batch from 1,
    !< largest (distance outside the cone/|r|)^2, unused
    call all_batches(schedule, 2 + want_status, least_scale, sums)
  end subroutine cairn_contact_error

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

  subroutine one_batch(batch, sides, record, general, what, least_scale, work, sums)
    type(cairn_batch), intent(in)  :: batch
    type(cairn_side), intent(in)   :: sides(*)
    type(cairn_record), intent(in) :: record(*), general(*)
    integer, value                 :: what
    real(c_double), value          :: least_scale
    real(c_double), intent(inout), target :: work(batch_workspace)
    real(c_double), intent(out)    :: sums(sums_size)
    type(contact_columns) :: at
    real(c_double), pointer, contiguous :: rho(:), scale(:), delassus(:), state(:)
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
    nullify (state)
    if (axes == 2) then
      call cone_map2(n, what == 1, at%mu, rho, at%r, at%u, at%free(f:))
      if (any(at%mu > 1)) call disk_map2(n, what == 1, at%mu, rho, at%r, at%u, at%free(f:))
    else
      call cone_map3(n, what == 1, at%mu, rho, at%r, at%u, at%free(f:))
      if (any(at%mu > 1)) call disk_map3(n, what == 1, at%mu, rho, at%r, at%u, at%free(f:))
    end if
    sums = 0
    if (what > 1 .and. batch%bonds == 0) then
      call add_up_cone(n, axes, least_scale, at%mu, rho, scale, at%r, at%free(f:), at%u, sums)
      if (what == 3) call c_f_pointer(batch%status, status, [n])
      if (what == 3) call find_status(n, axes, at%mu, at%r, status)
      return
    end if
    call weights(n, c, axes, rho, at%free(weight:))
    if (batch%bonds /= 0) then
      call c_f_pointer(batch%delassus, delassus, [c*c*n])
      call c_f_pointer(batch%state, state, [n])
      call bond_map(n, c, axes, state, delassus, at%u, at%free(f:), at%free(weight:))
    end if
    if (what == 1) then
      call keep_scale(n, c, at%free(weight:), at%free(f:), scale, sums)
    else
      call add_up(n, c, axes, least_scale, at%mu, at%free(weight:), scale, at%r, at%free(f:), at%u, sums)
    end if
    if (what < 3) return
    call c_f_pointer(batch%status, status, [n])
    call find_status(n, axes, at%mu, at%r, status)
    if (batch%bonds /= 0) where (state < huge(state)) status = 3
  end subroutine one_batch

  !> F of the cone in the plane.
  subroutine cone_map2(n, at_zero, mu, rho, r, u, f)
    integer, value              :: n       !< contacts
    logical, value              :: at_zero !< F(0) rather than F(r)
    real(c_double), intent(in)  :: mu(n)   !< friction [-]
    real(c_double), intent(in)  :: rho(n)  !< 1/W_NN [kg]
    real(c_double), intent(in)  :: r(n, 2) !< impulse [N s]
    real(c_double), intent(in)  :: u(n, 2) !< relative velocity, bias included [m/s]
    real(c_double), intent(out) :: f(n, 2) !< residual [N s]
    real(c_double) :: keep, m, zn, zt, tangent, cosine, along, pn, pt
    integer :: i
    keep = merge(0.0_c_double, 1.0_c_double, at_zero)
    !$omp simd private(m, zn, zt, tangent, cosine, along, pn, pt)
    do i = 1, n
      m = min(mu(i), 1.0_c_double)
      zn = keep*r(i, 1) - rho(i)*(u(i, 1) + m*abs(u(i, 2)))
      zt = keep*r(i, 2) - rho(i)*u(i, 2)
      tangent = abs(zt)
      cosine = 1/sqrt(1 + m*m)
      along = max(0.0_c_double, cosine*(zn + m*tangent))
      pn = merge(max(zn, 0.0_c_double), cosine*along, tangent <= m*zn) ! m may be 0
      pt = merge(zt, sign(m*cosine*along, zt), tangent <= m*zn)
      f(i, 1) = keep*r(i, 1) - pn
      f(i, 2) = keep*r(i, 2) - pt
    end do
  end subroutine cone_map2

  !> F of the cone in space.
  subroutine cone_map3(n, at_zero, mu, rho, r, u, f)
    integer, value              :: n       !< contacts
    logical, value              :: at_zero !< F(0) rather than F(r)
    real(c_double), intent(in)  :: mu(n)   !< friction [-]
    real(c_double), intent(in)  :: rho(n)  !< 1/W_NN [kg]
    real(c_double), intent(in)  :: r(n, 3) !< impulse [N s]
    real(c_double), intent(in)  :: u(n, 3) !< relative velocity, bias included [m/s]
    real(c_double), intent(out) :: f(n, 3) !< residual [N s]
    real(c_double) :: keep, m, zn, zt, zs, tangent, cosine, along, pn, shrink
    integer :: i
    keep = merge(0.0_c_double, 1.0_c_double, at_zero)
    !$omp simd private(m, zn, zt, zs, tangent, cosine, along, pn, shrink)
    do i = 1, n
      m = min(mu(i), 1.0_c_double)
      zn = keep*r(i, 1) - rho(i)*(u(i, 1) + m*sqrt(u(i, 2)**2 + u(i, 3)**2))
      zt = keep*r(i, 2) - rho(i)*u(i, 2)
      zs = keep*r(i, 3) - rho(i)*u(i, 3)
      tangent = sqrt(zt*zt + zs*zs)
      cosine = 1/sqrt(1 + m*m)
      along = max(0.0_c_double, cosine*(zn + m*tangent))
      pn = merge(max(zn, 0.0_c_double), cosine*along, tangent <= m*zn) ! m may be 0
      shrink = merge(1.0_c_double, m*cosine*along/max(tangent, tiny(tangent)), tangent <= m*zn)
      f(i, 1) = keep*r(i, 1) - pn
      f(i, 2) = keep*r(i, 2) - shrink*zt
      f(i, 3) = keep*r(i, 3) - shrink*zs
    end do
  end subroutine cone_map3

  !> Where mu > 1 the term mu |u_T| would blow a slip of rounding up without bound (mu may be infinite): there F is that of
  !> Alart & Curnier (1991), with the same zeros and without that term.
  subroutine disk_map2(n, at_zero, mu, rho, r, u, f)
    integer, value                :: n       !< contacts
    logical, value                :: at_zero !< F(0) rather than F(r)
    real(c_double), intent(in)    :: mu(n)   !< friction [-]
    real(c_double), intent(in)    :: rho(n)  !< 1/W_NN [kg]
    real(c_double), intent(in)    :: r(n, 2) !< impulse [N s]
    real(c_double), intent(in)    :: u(n, 2) !< relative velocity, bias included [m/s]
    real(c_double), intent(inout) :: f(n, 2) !< residual [N s]
    real(c_double) :: keep, pn, limit
    integer :: i
    keep = merge(0.0_c_double, 1.0_c_double, at_zero)
    do i = 1, n
      if (mu(i) <= 1) cycle
      pn = max(0.0_c_double, keep*r(i, 1) - rho(i)*u(i, 1))
      limit = mu(i)*pn
      f(i, 1) = keep*r(i, 1) - pn
      f(i, 2) = keep*r(i, 2) - min(limit, max(-limit, keep*r(i, 2) - rho(i)*u(i, 2)))
    end do
  end subroutine disk_map2

  subroutine disk_map3(n, at_zero, mu, rho, r, u, f)
    integer, value                :: n       !< contacts
    logical, value                :: at_zero !< F(0) rather than F(r)
    real(c_double), intent(in)    :: mu(n)   !< friction [-]
    real(c_double), intent(in)    :: rho(n)  !< 1/W_NN [kg]
    real(c_double), intent(in)    :: r(n, 3) !< impulse [N s]
    real(c_double), intent(in)    :: u(n, 3) !< relative velocity, bias included [m/s]
    real(c_double), intent(inout) :: f(n, 3) !< residual [N s]
    real(c_double) :: keep, pn, limit, zt, zs, tangent, shrink
    integer :: i
    keep = merge(0.0_c_double, 1.0_c_double, at_zero)
    do i = 1, n
      if (mu(i) <= 1) cycle
      pn = max(0.0_c_double, keep*r(i, 1) - rho(i)*u(i, 1))
      limit = mu(i)*pn
      zt = keep*r(i, 2) - rho(i)*u(i, 2)
      zs = keep*r(i, 3) - rho(i)*u(i, 3)
      tangent = sqrt(zt*zt + zs*zs)
      shrink = 1
      if (tangent > limit) shrink = limit/tangent
      f(i, 1) = keep*r(i, 1) - pn
      f(i, 2) = keep*r(i, 2) - shrink*zt
      f(i, 3) = keep*r(i, 3) - shrink*zs
    end do
  end subroutine disk_map3

  !> Squares of components times weight are energies. Rotations of a law count only where they are bonded.
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

  !> F of a bond: all components of u + b vanish.
  subroutine bond_map(n, c, axes, state, w, u, f, weight)
    integer, value                :: n            !< contacts
    integer, value                :: c            !< components
    integer, value                :: axes         !< components of velocity, 2 or 3
    real(c_double), intent(in)    :: state(n)     !< gap at which it bonded [m]; huge if it did not
    real(c_double), intent(in)    :: w(n, c, c)   !< Delassus blocks [1/kg]
    real(c_double), intent(in)    :: u(n, c)      !< relative velocity, bias included [m/s]
    real(c_double), intent(inout) :: f(n, c)      !< residual [N s]
    real(c_double), intent(inout) :: weight(n, c) !< [1/kg]
    integer :: i, k
    do k = 1, c
      do i = 1, n
        if (state(i) < huge(state)) then
          weight(i, k) = w(i, k, k)
          f(i, k) = 0
          if (w(i, k, k) > 0) f(i, k) = u(i, k)/w(i, k, k)
        else if (k > axes) then
          f(i, k) = 0
        end if
      end do
    end do
  end subroutine bond_map

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

  subroutine add_up(n, c, axes, least_scale, mu, weight, scale, r, f, work, sums)
    integer, value                :: n            !< contacts
    integer, value                :: c            !< components
    integer, value                :: axes         !< components of velocity, 2 or 3
    real(c_double), value         :: least_scale !< of one contact [J]
    real(c_double), intent(in)    :: mu(n)        !< friction [-]
    real(c_double), intent(in)    :: weight(n, c) !< [1/kg]
    real(c_double), intent(in)    :: scale(n)     !< |F(0)|^2 [J]
    real(c_double), intent(in)    :: r(n, c)      !< impulse [N s]
    real(c_double), intent(in)    :: f(n, c)      !< residual [N s]
    real(c_double), intent(inout) :: work(n, 2)
    real(c_double), intent(inout) :: sums(sums_size)
    real(c_double) :: error, size, worst, out, furthest, square, tangent, least
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
    furthest = 0
    !$omp simd reduction(max:worst, furthest) private(out, square, tangent)
    do i = 1, n
      work(i, 1) = work(i, 1)/max(work(i, 2), scale(i), work(i, 1), least)
      worst = max(worst, work(i, 1))
      tangent = sqrt(r(i, 2)**2 + merge(r(i, axes)**2, 0.0_c_double, axes == 3))
      square = r(i, 1)**2 + tangent**2
      out = max(0.0_c_double, -r(i, 1), tangent - mu(i)*max(0.0_c_double, r(i, 1)))
      furthest = max(furthest, out*out/max(square, tiny(square)))
    end do
    sums(1) = error
    sums(2) = size
    sums(3) = worst
    do i = 1, n
      if (work(i, 1) >= worst .and. worst > 0) exit
    end do
    sums(4) = min(i, n)
    sums(5) = furthest
  end subroutine add_up

  subroutine find_status(n, axes, mu, r, status)
    integer, value                  :: n         !< contacts
    integer, value                  :: axes      !< components of velocity, 2 or 3
    real(c_double), intent(in)      :: mu(n)     !< friction [-]
    real(c_double), intent(in)      :: r(n, 3)   !< impulse [N s]
    integer(c_int32_t), intent(out) :: status(n) !< see cairn_contact_status
    real(c_double) :: tangent, limit
    integer :: i
    do i = 1, n
      tangent = abs(r(i, 2))
      if (axes == 3) tangent = sqrt(r(i, 2)**2 + r(i, 3)**2)
      limit = mu(i)*r(i, 1)*(1 - 8*epsilon(limit)) ! the local solver puts slipping contacts on the cone, to rounding
      status(i) = 1
      if (tangent >= limit) status(i) = 2
      if (r(i, 1) <= 0) status(i) = 0
    end do
  end subroutine find_status
end module contact_error
