!> Contact imposed on the gap at the end of the step, by multipliers or by a penalty (Carpenter, Taylor & Katona 1991):
!>   gap/h + u_n + r_n/(h^2 k) >= 0, whether the gap is open or not.
module carpenter
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: cairn_pose_carpenter
contains

  pure subroutine cairn_pose_carpenter(n, c, h, theta, params, gap, u_begin, force_begin, bias, compliance, given) bind(c)
    integer(c_int32_t), value     :: n                !< contacts
    integer(c_int32_t), value     :: c                !< components of a contact
    real(c_double), value         :: h                !< step [s]
    real(c_double), value         :: theta            !< of the method, 1 here [-]
    real(c_double), intent(in)    :: params(2)        !< stiffness of the penalty, inf: multipliers [N/m]; unused
    real(c_double), intent(in)    :: gap(n)           !< at detection [m]
    real(c_double), intent(in)    :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)    :: force_begin(n, c) !< of the contact at the start of the step [N]
    real(c_double), intent(inout) :: bias(n, c)       !< of the law, then of the pose [m/s]
    real(c_double), intent(inout) :: compliance(n, c) !< diagonal that is added to W [1/kg]
    real(c_double), intent(out)   :: given(n, c)      !< impulses that come on top of the solution [N s]
    bias(:, 1) = gap/h
    compliance(:, 1) = compliance(:, 1) + 1/(h*h*params(1))
    given = 0
  end subroutine cairn_pose_carpenter
end module carpenter
