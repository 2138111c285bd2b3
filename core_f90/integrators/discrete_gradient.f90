!> The theta-method at theta = 1/2 with stresses whose work over the step is the change of the stored energy (Gonzalez 2000): of
!> rigid bodies, linear ones and small strains the midpoint rule.
module discrete_gradient
  use, intrinsic :: iso_c_binding, only: c_double
  use linear_scheme, only: cairn_scheme, no_history
  implicit none
  private
  public :: cairn_integrator_discrete_gradient
contains

  pure subroutine cairn_integrator_discrete_gradient(h, params, scheme) bind(c)
    real(c_double), value           :: h         !< step [s]
    real(c_double), intent(in)      :: params(*) !< none, not read
    type(cairn_scheme), intent(out) :: scheme    !< a step
    scheme = no_history(h)
    scheme%end_share = 0.5_c_double
    scheme%implicit = 0.5_c_double
    scheme%damping = 0.5_c_double*h
    scheme%stiffness = (0.5_c_double*h)**2
    scheme%share = 0.5_c_double
    scheme%elastic_velocity = 0.5_c_double*h
    scheme%by_energy = 1
  end subroutine cairn_integrator_discrete_gradient
end module discrete_gradient
