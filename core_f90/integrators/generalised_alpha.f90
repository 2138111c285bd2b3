!> Chung & Hulbert (1993): of second order, with the least dissipation of low frequencies for a spectral radius at high ones.
module generalised_alpha
  use, intrinsic :: iso_c_binding, only: c_double
  use linear_scheme, only: cairn_scheme, alpha_scheme
  implicit none
  private
  public :: cairn_integrator_generalised_alpha
contains

  pure subroutine cairn_integrator_generalised_alpha(h, params, scheme) bind(c)
    real(c_double), value           :: h         !< step [s]
    real(c_double), intent(in)      :: params(*) !< spectral radius of high frequencies, 0 to 1 [-]
    type(cairn_scheme), intent(out) :: scheme    !< a step
    real(c_double) :: am, af
    am = (2*params(1) - 1)/(params(1) + 1)
    af = params(1)/(params(1) + 1)
    scheme = alpha_scheme(h, (1 - am + af)**2/4, 0.5_c_double - am + af, am, af)
  end subroutine cairn_integrator_generalised_alpha
end module generalised_alpha
