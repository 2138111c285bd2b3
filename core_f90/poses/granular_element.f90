!> Springs at the contacts, treated implicitly (Kishino 1988, under the theta-method): a contact pushes by k times its overlap and
!> drags by ratio k times its slip, up to Coulomb's limit. Its force over a step is theta f(t+) + (1 - theta) f(t), so that with
!> r = h theta f(t+) the solver finds
!>   u_n + r_n/(h theta)^2/k + gap/(h theta) >= 0,
!>   u_t + r_t/(h theta)^2/(ratio k) + (1 - theta)/theta u_t(t) - f_t(t)/(h theta ratio k) = 0 where it sticks,
!> and h (1 - theta) f(t) is given.
module granular_element
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: cairn_pose_granular_element
contains

  pure subroutine cairn_pose_granular_element(n, c, h, theta, params, gap, u_begin, force_begin, bias, compliance, given) bind(c)
    integer(c_int32_t), value     :: n                !< contacts
    integer(c_int32_t), value     :: c                !< components of a contact
    real(c_double), value         :: h                !< step [s]
    real(c_double), value         :: theta            !< of the method [-]
    real(c_double), intent(in)    :: params(2)        !< stiffness k [N/m]; ratio of the tangential one to it [-]
    real(c_double), intent(in)    :: gap(n)           !< at detection [m]
    real(c_double), intent(in)    :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)    :: force_begin(n, c) !< of the contact at the start of the step [N]
    real(c_double), intent(inout) :: bias(n, c)       !< of the law, then of the pose [m/s]
    real(c_double), intent(inout) :: compliance(n, c) !< diagonal that is added to W [1/kg]
    real(c_double), intent(out)   :: given(n, c)      !< impulses that come on top of the solution [N s]
    real(c_double) :: reach, soft
    integer :: k
    reach = h*theta
    soft = 1/(reach*reach*params(1))
    bias(:, 1) = gap/reach
    compliance(:, 1) = compliance(:, 1) + soft
    do k = 2, c
      bias(:, k) = bias(:, k) + (1 - theta)/theta*u_begin(:, k) - force_begin(:, k)/(reach*params(2)*params(1))
      compliance(:, k) = compliance(:, k) + soft/params(2)
    end do
    given = h*(1 - theta)*force_begin
  end subroutine cairn_pose_granular_element
end module granular_element
