!> Natural map of Coulomb's cone at contacts, component by component: with rho = 1/W_NN and u the relative velocity, bias included,
!>   F(r) = r - P_K( r - rho (u + (mu |u_T|, 0, 0)) ),   K the cone
!> (De Saxce & Feng 1998; the natural map: Acary & Brogliato 2008). If mu > 1, F of Alart & Curnier (1991), with the same zeros.
!> Its norm is the error of contacts under a cone; laws that obey a cone in part use it for that part.
module cone_residual
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: cone_map, cone_status
contains

  !> F(r), or F(0).
  subroutine cone_map(n, axes, at_zero, mu, rho, r, u, f)
    integer, value                :: n          !< contacts
    integer, value                :: axes       !< components of velocity, 2 or 3
    logical, value                :: at_zero    !< F(0) rather than F(r)
    real(c_double), intent(in)    :: mu(n)      !< friction [-]
    real(c_double), intent(in)    :: rho(n)     !< 1/W_NN [kg]
    real(c_double), intent(in)    :: r(n, axes) !< impulse [N s]
    real(c_double), intent(in)    :: u(n, axes) !< relative velocity, bias included [m/s]
    real(c_double), intent(inout) :: f(n, axes) !< residual [N s]
    if (axes == 2) then
      call cone_map2(n, at_zero, mu, rho, r, u, f)
      if (any(mu > 1)) call disk_map2(n, at_zero, mu, rho, r, u, f)
    else
      call cone_map3(n, at_zero, mu, rho, r, u, f)
      if (any(mu > 1)) call disk_map3(n, at_zero, mu, rho, r, u, f)
    end if
  end subroutine cone_map

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

  !> Status of each contact: open, sticks or slips.
  subroutine cone_status(n, axes, mu, r, status)
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
  end subroutine cone_status
end module cone_residual
