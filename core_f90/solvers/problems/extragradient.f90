!> Extragradient with a step that adapts (Korpelevich 1976, Khobotov 1987): slow, and hard to stop. Steps are those of
!> accelerated_gradient; this is the measure that their length answers to.
module extragradient
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_gradient_ratio
contains

  !> |g(r) - g(s)| / |r - s| in norms that rho makes one, g(r) = u + (mu |u_T|, 0, 0); 0 where r = s.
  real(c_double) function cairn_gradient_ratio(dim, n, mu, rho, r, u, s, v) bind(c)
    integer(c_int32_t), value  :: dim       !< components of a contact, 2 or 3
    integer(c_int64_t), value  :: n         !< contacts
    real(c_double), intent(in) :: mu(n)     !< friction [-]
    real(c_double), intent(in) :: rho(n)    !< scale of the contact [kg]
    real(c_double), intent(in) :: r(dim, n) !< impulse [N s]
    real(c_double), intent(in) :: u(dim, n) !< velocity at r [m/s]
    real(c_double), intent(in) :: s(dim, n) !< impulse [N s]
    real(c_double), intent(in) :: v(dim, n) !< velocity at s [m/s]
    real(c_double) :: g(dim), change, distance
    integer(c_int64_t) :: a
    change = 0
    distance = 0
    do a = 1, n
      g = u(:, a) - v(:, a)
      g(1) = g(1) + mu(a)*(sqrt(sum(u(2:, a)**2)) - sqrt(sum(v(2:, a)**2)))
      change = change + rho(a)*sum(g**2)
      distance = distance + sum((r(:, a) - s(:, a))**2)/rho(a)
    end do
    cairn_gradient_ratio = 0
    if (distance > 0) cairn_gradient_ratio = sqrt(change/distance)
  end function cairn_gradient_ratio
end module extragradient
