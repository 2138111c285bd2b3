!> Newmark (1959): q1 = q + h v + h^2 ((1/2 - beta) a + beta a1), v1 = v + h ((1 - gamma) a + gamma a1), M a1 = F(q1, v1).
module newmark
  use, intrinsic :: iso_c_binding, only: c_double
  use linear_scheme, only: cairn_scheme, alpha_scheme
  implicit none
  private
  public :: cairn_integrator_newmark
contains

  pure subroutine cairn_integrator_newmark(h, params, scheme) bind(c)
    real(c_double), value           :: h         !< step [s]
    real(c_double), intent(in)      :: params(*) !< beta, gamma [-]
    type(cairn_scheme), intent(out) :: scheme    !< a step
    scheme = alpha_scheme(h, params(1), params(2), 0.0_c_double, 0.0_c_double)
  end subroutine cairn_integrator_newmark
end module newmark
