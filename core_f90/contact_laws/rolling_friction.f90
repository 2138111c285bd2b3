!> Signorini-Coulomb with friction against rolling and twisting, each an exact cone of the normal impulse: |M_r| <= rolling R r_N
!> across
!> the normal, |M_t| <= twisting R r_N about it, R the effective radius.
module rolling_friction
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use block_cones, only: solve_blocks, map_blocks, status_of_blocks
  implicit none
  private
  public :: cairn_law_rolling_friction_prepare, law_solve, law_residual
  character(*), parameter :: row = "rolling_friction"
  integer, parameter :: own = 3, states = 0 !< parameters, states
  integer, parameter :: bond(0) = [integer ::] !< no state says that bodies are held fast
  logical, parameter :: rolls = .true. !< friction against rolling
contains

  include "cone_slots.inc"

  !> Free of bias where it is open.
  subroutine cairn_law_rolling_friction_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, states) !< none
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

  !> Attraction along the normal and limits of the blocks, as impulses.
  pure subroutine limits(c, p, s, pull, mu, k)
    integer(c_int32_t), intent(in) :: c        !< components
    real(c_double), intent(in)     :: p(own + 4) !< parameters, step, area, effective radius, mass
    real(c_double), intent(in)     :: s(states) !< none
    real(c_double), intent(out)    :: pull     !< [N s]
    real(c_double), intent(out)    :: mu(3), k(3) !< see block_cones
    pull = 0
    mu = [p(1), p(3)*p(own + 3), p(2)*p(own + 3)]
    k = 0
  end subroutine limits
end module rolling_friction
