!> The bridges of capillary, beside friction against sliding, rolling and twisting: cones of the normal impulse and that of the
!> bridge together, as in rolling_wet.
module rolling_capillary
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use rolling_cones, only: solve_rolling, map_rolling, rolling_limits
  use capillary, only: cairn_law_capillary_prepare, cairn_law_capillary_commit, cairn_law_capillary_energy, bridge_force => force
  implicit none
  private
  public :: cairn_law_rolling_capillary_prepare, law_solve, law_residual
  public :: cairn_law_rolling_capillary_commit, cairn_law_rolling_capillary_energy
  character(*), parameter :: row = "rolling_capillary"
  integer, parameter :: own = 6, states = 2 !< parameters, states
  integer, parameter :: friction = 4, rolling = 5, twisting = 6 !< places of these parameters
contains

  include "rolling_slots.inc"

  !> See capillary, which has the first parameters.
  subroutine cairn_law_rolling_capillary_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, states) !< 1 there is a bridge; distance [m]
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    call cairn_law_capillary_prepare(n, c, context, gap, u_begin, params(:, :4), state, bias, compliance, mu)
  end subroutine cairn_law_rolling_capillary_prepare

  !> See capillary.
  subroutine cairn_law_rolling_capillary_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)          !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)          !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, states) !< 1 there is a bridge; distance [m]
    call cairn_law_capillary_commit(n, c, context, gap, u, r, params(:, :4), state)
  end subroutine cairn_law_rolling_capillary_commit

  !> See capillary.
  subroutine cairn_law_rolling_capillary_energy(n, c, context, gap, u, r, params, state_begin, state, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see laws.def
    real(c_double), intent(in)          :: state_begin(n, states), state(n, states) !< 1 there is a bridge; distance [m]
    real(c_double), intent(out)         :: energy(n, 4)   !< see cairn/core.h [J]
    call cairn_law_capillary_energy(n, c, context, gap, u, r, params(:, :4), state_begin, state, energy)
  end subroutine cairn_law_rolling_capillary_energy

  !> The bridge pulls.
  pure real(c_double) function pull_of(p, s)
    real(c_double), intent(in) :: p(own + 7) !< parameters, step, geometry
    real(c_double), intent(in) :: s(states)  !< 1 there is a bridge; distance [m]
    pull_of = 0
    if (s(1) > 0) pull_of = bridge_force(p, p(own + 3), s(2))*p(own + 1)
  end function pull_of
end module rolling_capillary
