!> The function of Fischer (1992) on second-order cones (Fukushima, Luo & Tseng 2002) and its generalised derivative, for Newton's
!> method: x o y = 0 with x and y in the cone of radius 1 if and only if
!>   f = x + y - (x o x + y o y)^(1/2) = 0,   x = (mu r_N, r_T) c,   y = rho (u_N + mu |u_T|, mu u_T) c,
!> which is Coulomb's law in the variables of De Saxce (1998); c = 1/max(1, mu). Without friction f = (f of r_N and rho u_N, r_T).
!> The rows are left W dr + own dr = target (see newton_rows).
module newton_fischer_burmeister
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_newton_fischer_burmeister
contains

  subroutine cairn_newton_fischer_burmeister(dim, n, mu, rho, r, u, want, f, unknowns, left, basis, own, step, target) bind(c)
    integer(c_int32_t), value       :: dim         !< components of a contact, 2 or 3
    integer(c_int64_t), value       :: n           !< contacts
    real(c_double), intent(in)      :: mu(n)       !< friction [-]
    real(c_double), intent(in)      :: rho(2, n)   !< normal, tangential [kg]
    real(c_double), intent(in)      :: r(dim, n)   !< impulse [N s]
    real(c_double), intent(in)      :: u(dim, n)   !< relative velocity [m/s]
    integer(c_int32_t), value       :: want        !< 1: the derivative too
    real(c_double), intent(out)     :: f(dim, n)   !< [N s]
    integer(c_int32_t), intent(inout) :: unknowns(n) !< of a contact, dim
    real(c_double), intent(inout)   :: left(dim, dim, n)  !< (unknown, component)
    real(c_double), intent(inout)   :: basis(dim, dim, n) !< (component, unknown)
    real(c_double), intent(inout)   :: own(dim, dim, n)   !< (unknown, unknown)
    real(c_double), intent(inout)   :: step(dim, n)       !< part of dr that is known: 0
    real(c_double), intent(inout)   :: target(dim, n)     !< (unknown)
    real(c_double) :: x(dim), y(dim), by_x(dim, dim), by_y(dim, dim), slip, c
    integer(c_int64_t) :: a
    integer :: i
    do a = 1, n
      c = 1/max(1.0_c_double, mu(a))
      slip = sqrt(sum(u(2:, a)**2))
      x = c*r(:, a)
      y = c*rho(1, a)*mu(a)*u(:, a)
      x(1) = mu(a)*x(1)
      y(1) = c*rho(1, a)*(u(1, a) + mu(a)*slip)
      if (.not. mu(a) > 0) then
        x = 0
        x(1) = r(1, a)
      end if
      call root(dim, x, y, want == 1, f(:, a), by_x, by_y)
      if (.not. mu(a) > 0) f(2:, a) = r(2:, a)
      if (want /= 1) cycle
      unknowns(a) = dim
      step(:, a) = 0
      target(:, a) = -f(:, a)
      basis(:, :, a) = 0
      do i = 1, dim
        basis(i, i, a) = 1
      end do
      own(:, :, a) = 0
      left(:, :, a) = 0
      if (.not. mu(a) > 0) then
        own(:, :, a) = basis(:, :, a)
        own(1, 1, a) = by_x(1, 1)
        left(1, 1, a) = rho(1, a)*by_y(1, 1)
        cycle
      end if
      own(:, :, a) = c*by_x
      own(:, 1, a) = mu(a)*own(:, 1, a)
      left(:, :, a) = c*rho(1, a)*mu(a)*by_y
      left(:, 1, a) = left(:, 1, a)/mu(a)
      if (slip > 0) then
        do i = 2, dim
          left(:, i, a) = left(:, i, a) + c*rho(1, a)*mu(a)*(u(i, a)/slip)*by_y(:, 1)
        end do
      end if
    end do
  end subroutine cairn_newton_fischer_burmeister

  !> f = x + y - (x o x + y o y)^(1/2) and its derivatives I - L_z^-1 L_x, I - L_z^-1 L_y, z the root, L_x y = x o y.
  pure subroutine root(dim, x, y, want, f, by_x, by_y)
    integer(c_int32_t), intent(in) :: dim
    real(c_double), intent(in)     :: x(dim), y(dim)
    logical, intent(in)            :: want
    real(c_double), intent(out)    :: f(dim), by_x(dim, dim), by_y(dim, dim)
    real(c_double), parameter      :: least = 1e-24_c_double !< of the smaller to the larger eigenvalue, where f has a corner
    real(c_double) :: w(dim), z(dim), bar, low, high, axis(dim-1)
    w = 2*(x(1)*x + y(1)*y)
    w(1) = sum(x*x) + sum(y*y)
    bar = sqrt(sum(w(2:)**2))
    axis = 0
    if (bar > 0) axis = w(2:)/bar
    low = sqrt(max(0.0_c_double, w(1) - bar))
    high = sqrt(w(1) + bar)
    z(1) = (high + low)/2
    z(2:) = (high - low)/2*axis
    f = x + y - z
    by_x = 0
    by_y = 0
    if (.not. want) return
    if (.not. high > 0) then ! both vanish: any element of the generalised derivative
      call of_corner(dim, by_x)
      by_y = by_x
      return
    end if
    low = max(low, sqrt(least)*high)
    call one_minus(dim, high, low, axis, x, by_x)
    call one_minus(dim, high, low, axis, y, by_y)
  end subroutine root

  pure subroutine of_corner(dim, m)
    integer(c_int32_t), intent(in) :: dim
    real(c_double), intent(out)    :: m(dim, dim)
    integer :: i
    m = 0
    do i = 1, dim
      m(i, i) = 1 - sqrt(0.5_c_double)
    end do
  end subroutine of_corner

  !> I - L_z^-1 L_x. Eigenvalues of z are high and low along the axis; across it L_z has their mean.
  pure subroutine one_minus(dim, high, low, axis, x, m)
    integer(c_int32_t), intent(in) :: dim
    real(c_double), intent(in)     :: high, low, axis(dim-1), x(dim)
    real(c_double), intent(out)    :: m(dim, dim)
    real(c_double) :: column(dim), along, plus, minus, mean
    integer :: c
    mean = (high + low)/2
    do c = 1, dim
      column = 0
      if (c == 1) then
        column = x
      else
        column(c) = x(1)
        column(1) = x(c)
      end if
      along = sum(axis*column(2:))
      plus = (column(1) + along)/(2*high)
      minus = (column(1) - along)/(2*low)
      m(1, c) = -(plus + minus)
      m(2:, c) = -(plus - minus)*axis - (column(2:) - along*axis)/mean
      m(c, c) = m(c, c) + 1
    end do
  end subroutine one_minus
end module newton_fischer_burmeister
