!> The beta scheme (Carpenter, Taylor & Katona 1991), in which the acceleration of the last step counts:
!>   q1 = q + h w + h^2/2 a, w = w_0 + h ((1 - beta) a_0 + beta a), M a = F(q),
!> in terms of v1 = (q1 - q)/h, the velocity at the middle of the step: v1 = v + h ((1/2 - beta) a_0 + (1/2 + beta) a). With
!> beta = 1/2 these are central differences.
module beta_scheme
  use, intrinsic :: iso_c_binding, only: c_double
  use linear_scheme, only: cairn_scheme, no_history
  implicit none
  private
  public :: cairn_integrator_beta_scheme
contains

  pure subroutine cairn_integrator_beta_scheme(h, params, scheme) bind(c)
    real(c_double), value           :: h         !< step [s]
    real(c_double), intent(in)      :: params(*) !< beta in [1/2, 1] [-]
    type(cairn_scheme), intent(out) :: scheme    !< a step
    scheme = no_history(h)
    scheme%impulse = h*(0.5_c_double + params(1))
    scheme%share = 1
    scheme%velocity(1) = h*(0.5_c_double - params(1))
    scheme%gain(1) = 1/scheme%impulse
    scheme%largest = sqrt(2/params(1))
    scheme%histories = 1
  end subroutine cairn_integrator_beta_scheme
end module beta_scheme
