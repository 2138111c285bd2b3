!> The function of Alart & Curnier (1991) and its generalised derivative, for Newton's method. With x = r - rho u at a contact,
!>   f_N = r_N - max(x_N, 0),   f_T = r_T - P_D( x_T ),   D the disk of radius mu max(x_N, 0).
!> Its pieces are linear up to the turn of the slip direction, so each contact keeps only the unknowns that are left: none where it
!> opens, all where it sticks; where it slips, dr_T along the slip follows dr_N. Then (see newton_rows)
!>   left W (step + basis y) + own y = target.
module newton_alart_curnier
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_newton_alart_curnier
contains

  subroutine cairn_newton_alart_curnier(dim, n, mu, rho, r, u, want, f, unknowns, left, basis, own, step, target) bind(c)
    integer(c_int32_t), value       :: dim         !< components of a contact, 2 or 3
    integer(c_int64_t), value       :: n           !< contacts
    real(c_double), intent(in)      :: mu(n)       !< friction [-]
    real(c_double), intent(in)      :: rho(2, n)   !< normal, tangential [kg]
    real(c_double), intent(in)      :: r(dim, n)   !< impulse [N s]
    real(c_double), intent(in)      :: u(dim, n)   !< relative velocity [m/s]
    integer(c_int32_t), value       :: want        !< 1: the derivative too
    real(c_double), intent(out)     :: f(dim, n)   !< [N s]
    integer(c_int32_t), intent(inout) :: unknowns(n) !< of a contact, 0 to dim
    real(c_double), intent(inout)   :: left(dim, dim, n)  !< (unknown, component)
    real(c_double), intent(inout)   :: basis(dim, dim, n) !< (component, unknown)
    real(c_double), intent(inout)   :: own(dim, dim, n)   !< (unknown, unknown)
    real(c_double), intent(inout)   :: step(dim, n)       !< part of dr that is known
    real(c_double), intent(inout)   :: target(dim, n)     !< (unknown)
    real(c_double) :: normal, limit, tangent, along(2), across(2), x(2), part
    integer(c_int64_t) :: a
    do a = 1, n
      normal = r(1, a) - rho(1, a)*u(1, a)
      limit = mu(a)*max(normal, 0.0_c_double)
      x = 0
      x(:dim-1) = r(2:, a) - rho(2, a)*u(2:, a)
      tangent = sqrt(sum(x**2))
      f(1, a) = r(1, a) - max(normal, 0.0_c_double)
      if (tangent <= limit) then
        f(2:, a) = r(2:, a) - x(:dim-1)
      else
        f(2:, a) = r(2:, a) - (limit/tangent)*x(:dim-1)
      end if
      if (want /= 1) cycle
      if (.not. normal > 0) then
        unknowns(a) = 0
        step(:, a) = -r(:, a)
      else if (tangent <= limit .and. mu(a) > 0) then
        call whole(dim, left(:, :, a), basis(:, :, a), own(:, :, a))
        unknowns(a) = dim
        step(:, a) = 0
        target(:, a) = -u(:, a)
      else
        along = [1, 0]
        if (tangent > 0) along = x/tangent
        across = [-along(2), along(1)]
        part = 0
        if (tangent > 0) part = limit/tangent
        unknowns(a) = dim - 1
        call slipping(dim, mu(a), rho(2, a)*part, along, left(:, :, a), basis(:, :, a))
        own(:, :, a) = 0
        own(dim, dim, a) = 1
        if (dim == 3) own(2, 2, a) = 1 - part
        target(:, a) = 0
        target(1, a) = -u(1, a)
        if (dim == 3) target(2, a) = part*rho(2, a)*sum(-u(2:, a)*across) - (1 - part)*sum(r(2:, a)*across)
        step(1, a) = 0
        step(2:, a) = (mu(a)*r(1, a) - sum(r(2:, a)*along(:dim-1)))*along(:dim-1)
      end if
    end do
  end subroutine cairn_newton_alart_curnier

  pure subroutine whole(dim, left, basis, own)
    integer(c_int32_t), intent(in) :: dim
    real(c_double), intent(out)    :: left(dim, dim), basis(dim, dim), own(dim, dim)
    integer :: i
    own = 0
    left = 0
    do i = 1, dim
      left(i, i) = 1
    end do
    basis = left
  end subroutine whole

  !> Unknowns dr_N and, in space, dr across the slip.
  pure subroutine slipping(dim, mu, rho, along, left, basis)
    integer(c_int32_t), intent(in) :: dim
    real(c_double), intent(in)     :: mu, rho, along(2)
    real(c_double), intent(out)    :: left(dim, dim), basis(dim, dim)
    left = 0
    basis = 0
    left(1, 1) = 1
    basis(1, 1) = 1
    basis(2:, 1) = mu*along(:dim-1)
    if (dim == 2) return
    left(2, 2:) = rho*[-along(2), along(1)]
    basis(2:, 2) = [-along(2), along(1)]
  end subroutine slipping
end module newton_alart_curnier
