!> The proximal point algorithm (Rockafellar 1976; for friction, Acary, Bremond & Huber 2018): around a centre c, W + alpha takes
!> the place of W and q - alpha c that of q, so that W may be singular; then c moves to the solution.
module ppa_newton
  use, intrinsic :: iso_c_binding, only: c_int64_t, c_double
  implicit none
  private
  public :: cairn_proximal_velocity
contains

  !> u + alpha (r - c)
  subroutine cairn_proximal_velocity(n, alpha, r, centre, u, shifted) bind(c)
    integer(c_int64_t), value   :: n          !< unknowns
    real(c_double), value       :: alpha      !< [1/kg]
    real(c_double), intent(in)  :: r(n)       !< impulse [N s]
    real(c_double), intent(in)  :: centre(n)  !< [N s]
    real(c_double), intent(in)  :: u(n)       !< W r + q [m/s]
    real(c_double), intent(out) :: shifted(n) !< [m/s]
    shifted = u + alpha*(r - centre)
  end subroutine cairn_proximal_velocity
end module ppa_newton
