!> The function of Jean & Moreau (1987) and its generalised derivative, for Newton's method: as that of Alart & Curnier, but the
!> disk has the radius of the impulse itself. With x = r - rho u at a contact,
!>   f_N = r_N - max(x_N, 0),   f_T = r_T - P_D( x_T ),   D the disk of radius mu max(r_N, 0).
!> The rows are left W dr + own dr = target (see newton_rows).
module newton_jean_moreau
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_newton_jean_moreau
contains

  subroutine cairn_newton_jean_moreau(dim, n, mu, rho, r, u, want, f, unknowns, left, basis, own, step, target) bind(c)
    integer(c_int32_t), value       :: dim         !< components of a contact, 2 or 3
    integer(c_int64_t), value       :: n           !< contacts
    real(c_double), intent(in)      :: mu(n)       !< friction [-]
    real(c_double), intent(in)      :: rho(2, n)   !< normal, tangential [kg]
    real(c_double), intent(in)      :: r(dim, n)   !< impulse [N s]
    real(c_double), intent(in)      :: u(dim, n)   !< relative velocity [m/s]
    integer(c_int32_t), value       :: want        !< 1: the derivative too
    real(c_double), intent(out)     :: f(dim, n)   !< [N s]
    integer(c_int32_t), intent(inout) :: unknowns(n) !< of a contact, 0 or dim
    real(c_double), intent(inout)   :: left(dim, dim, n)  !< (unknown, component)
    real(c_double), intent(inout)   :: basis(dim, dim, n) !< (component, unknown)
    real(c_double), intent(inout)   :: own(dim, dim, n)   !< (unknown, unknown)
    real(c_double), intent(inout)   :: step(dim, n)       !< part of dr that is known
    real(c_double), intent(inout)   :: target(dim, n)     !< (unknown)
    real(c_double) :: normal, limit, tangent, x(dim-1), along(dim-1), part
    integer(c_int64_t) :: a
    integer :: c
    do a = 1, n
      normal = r(1, a) - rho(1, a)*u(1, a)
      limit = mu(a)*max(r(1, a), 0.0_c_double)
      x = r(2:, a) - rho(2, a)*u(2:, a)
      tangent = sqrt(sum(x**2))
      part = 1
      if (tangent > limit) part = limit/tangent
      f(1, a) = r(1, a) - max(normal, 0.0_c_double)
      f(2:, a) = r(2:, a) - part*x
      if (want /= 1) cycle
      step(:, a) = 0
      unknowns(a) = 0
      if (.not. (normal > 0 .or. limit > 0)) then
        step(:, a) = -f(:, a)
        cycle
      end if
      unknowns(a) = dim
      target(:, a) = -f(:, a)
      basis(:, :, a) = 0
      left(:, :, a) = 0
      own(:, :, a) = 0
      if (normal > 0) then
        left(1, 1, a) = rho(1, a)
      else
        own(1, 1, a) = 1
      end if
      along = 0
      if (tangent > limit) along = x/tangent
      basis(1, 1, a) = 1
      do c = 1, dim - 1
        basis(c+1, c+1, a) = 1
        own(2:, c+1, a) = part*along(c)*along
        own(c+1, c+1, a) = own(c+1, c+1, a) + 1 - part
        left(2:, c+1, a) = -rho(2, a)*part*along(c)*along
        left(c+1, c+1, a) = left(c+1, c+1, a) + rho(2, a)*part
      end do
      if (limit > 0) own(2:, 1, a) = -mu(a)*along
    end do
  end subroutine cairn_newton_jean_moreau
end module newton_jean_moreau
