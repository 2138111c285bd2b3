!> Central differences: v1 at the middle of the step that follows, M (v1 - v) = h F(q, v), q1 = q + h v1.
module central_difference
  use, intrinsic :: iso_c_binding, only: c_double
  use linear_scheme, only: cairn_scheme, no_history
  implicit none
  private
  public :: cairn_integrator_central_difference
contains

  pure subroutine cairn_integrator_central_difference(h, params, scheme) bind(c)
    real(c_double), value           :: h         !< step [s]
    real(c_double), intent(in)      :: params(*) !< none, not read
    type(cairn_scheme), intent(out) :: scheme    !< a step
    scheme = no_history(h)
    scheme%share = 1
    scheme%largest = 2
  end subroutine cairn_integrator_central_difference
end module central_difference
