!> Wet contact (see wet) with friction against sliding, rolling and twisting. The normal impulse and that of the attraction bound
!> all three: |r_T| <= mu (r_N + h F), |M_r| <= rolling R (r_N + h F), |M_t| <= twisting R (r_N + h F).
module rolling_wet
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use rolling_cones, only: solve_rolling, map_rolling, rolling_limits
  use wet, only: cairn_law_wet_prepare, cairn_law_wet_energy
  implicit none
  private
  public :: cairn_law_rolling_wet_prepare, law_solve, law_residual, cairn_law_rolling_wet_energy
  character(*), parameter :: row = "rolling_wet"
  integer, parameter :: own = 5, states = 1 !< parameters, states
  integer, parameter :: friction = 3, rolling = 4, twisting = 5 !< places of these parameters
contains

  include "rolling_slots.inc"

  !> See wet, which has the first parameters.
  subroutine cairn_law_rolling_wet_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, states) !< depth [m]
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    call cairn_law_wet_prepare(n, c, context, gap, u_begin, params(:, :3), state, bias, compliance, mu)
  end subroutine cairn_law_rolling_wet_prepare

  !> See wet.
  subroutine cairn_law_rolling_wet_energy(n, c, context, gap, u, r, params, state_begin, state, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see laws.def
    real(c_double), intent(in)          :: state_begin(n, states), state(n, states) !< depth [m]
    real(c_double), intent(out)         :: energy(n, 4)   !< see cairn/core.h [J]
    call cairn_law_wet_energy(n, c, context, gap, u, r, params(:, :3), state_begin, state, energy)
  end subroutine cairn_law_rolling_wet_energy

  !> The attraction acts within the reach.
  pure real(c_double) function pull_of(p, s)
    real(c_double), intent(in) :: p(own + 7) !< parameters, step, geometry
    real(c_double), intent(in) :: s(states)  !< depth [m]
    pull_of = 0
    if (s(1) > 0 .or. .not. p(2) < huge(p)) pull_of = p(1)*p(own + 1)
  end function pull_of
end module rolling_wet
