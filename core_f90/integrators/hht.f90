!> Hilber, Hughes & Taylor (1977): M a1 = (1 + alpha) F1 - alpha F0, with the beta and gamma of Newmark that make it of second
!> order and most dissipative at high frequencies.
module hht
  use, intrinsic :: iso_c_binding, only: c_double
  use linear_scheme, only: cairn_scheme, alpha_scheme
  implicit none
  private
  public :: cairn_integrator_hht
contains

  pure subroutine cairn_integrator_hht(h, params, scheme) bind(c)
    real(c_double), value           :: h         !< step [s]
    real(c_double), intent(in)      :: params(*) !< alpha in [-1/3, 0] [-]
    type(cairn_scheme), intent(out) :: scheme    !< a step
    associate (alpha => params(1))
      scheme = alpha_scheme(h, (1 - alpha)**2/4, 0.5_c_double - alpha, 0.0_c_double, -alpha)
    end associate
  end subroutine cairn_integrator_hht
end module hht
