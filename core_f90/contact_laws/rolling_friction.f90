!> Signorini-Coulomb with friction against rolling and twisting, each an exact cone of the normal impulse. About the normal
!> |M_t| <= twisting R r_N, across it |M_r| <= rolling R r_N, by direction where the radii of rolling differ; see rolling_cones.
module rolling_friction
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use rolling_cones, only: solve_rolling, map_rolling, rolling_limits
  implicit none
  private
  public :: cairn_law_rolling_friction_prepare, law_solve, law_residual
  character(*), parameter :: row = "rolling_friction"
  integer, parameter :: own = 3, states = 0 !< parameters, states
  integer, parameter :: friction = 1, rolling = 2, twisting = 3 !< places of these parameters
contains

  include "rolling_slots.inc"

  !> Free of bias where it is open.
  subroutine cairn_law_rolling_friction_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, *)      !< none
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    integer :: i
    bias = 0
    compliance = 0
    do i = 1, n
      bias(i, 1) = max(gap(i), 0.0_c_double)/context%h
      mu(i) = params(i, 1)
    end do
  end subroutine cairn_law_rolling_friction_prepare

  !> Nothing attracts.
  pure real(c_double) function pull_of(p, s)
    real(c_double), intent(in) :: p(own + 7) !< parameters, step, geometry
    real(c_double), intent(in) :: s(states)  !< none
    pull_of = 0
  end function pull_of
end module rolling_friction
