!> Alternating direction method of multipliers (Glowinski & Marroco 1975; Boyd et al. 2011) on
!>   min r.(W r)/2 + r.(q + s), r in Coulomb's cone,   s = mu |u_T| along the normal (De Saxce & Feng 1998):
!>   (W + rho) r = rho (z - v) - q - s,   z = P_K( r + v ),   v = v + r - z,
!> where -rho v - s is the velocity that s takes its slip from.
module admm
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  use cone_projection, only: project_cone
  implicit none
  private
  public :: cairn_admm_load, cairn_admm_update
contains

  !> rho (z - v) - q - s
  subroutine cairn_admm_load(dim, n, rho, q, z, v, s, load) bind(c)
    integer(c_int32_t), value   :: dim          !< components of a contact, 2 or 3
    integer(c_int64_t), value   :: n            !< contacts
    real(c_double), value       :: rho          !< [1/kg]
    real(c_double), intent(in)  :: q(dim, n)    !< [m/s]
    real(c_double), intent(in)  :: z(dim, n)    !< impulse in the cone [N s]
    real(c_double), intent(in)  :: v(dim, n)    !< multiplier / rho [N s]
    real(c_double), intent(in)  :: s(n)         !< mu |u_T| [m/s]
    real(c_double), intent(out) :: load(dim, n) !< [m/s]
    integer(c_int64_t) :: a
    do a = 1, n
      load(:, a) = rho*(z(:, a) - v(:, a)) - q(:, a)
      load(1, a) = load(1, a) - s(a)
    end do
  end subroutine cairn_admm_load

  subroutine cairn_admm_update(dim, n, rho, relaxation, mu, r, z, v, s, sums) bind(c)
    integer(c_int32_t), value     :: dim        !< components of a contact, 2 or 3
    integer(c_int64_t), value     :: n          !< contacts
    real(c_double), value         :: rho        !< [1/kg]
    real(c_double), value         :: relaxation !< (0, 2), beyond 1 over-relaxed
    real(c_double), intent(in)    :: mu(n)      !< friction [-]
    real(c_double), intent(in)    :: r(dim, n)  !< [N s]
    real(c_double), intent(inout) :: z(dim, n)  !< impulse in the cone [N s]
    real(c_double), intent(inout) :: v(dim, n)  !< multiplier / rho [N s]
    real(c_double), intent(inout) :: s(n)       !< mu |u_T| [m/s]
    real(c_double), intent(out)   :: sums(4)    !< |r - z|^2, |change of z|^2, |z|^2, |v|^2 [N^2 s^2]
    real(c_double) :: before(dim), w(dim), slip(dim-1)
    integer(c_int64_t) :: a
    sums = 0
    do a = 1, n
      before = z(:, a)
      w = relaxation*r(:, a) + (1 - relaxation)*before
      z(:, a) = w + v(:, a)
      call project_cone(dim, mu(a), z(:, a))
      v(:, a) = v(:, a) + w - z(:, a)
      slip = rho*v(2:, a)
      s(a) = mu(a)*sqrt(sum(slip**2))
      sums(1) = sums(1) + sum((r(:, a) - z(:, a))**2)
      sums(2) = sums(2) + sum((z(:, a) - before)**2)
      sums(3) = sums(3) + sum(z(:, a)**2)
      sums(4) = sums(4) + sum(v(:, a)**2)
    end do
  end subroutine cairn_admm_update
end module admm
