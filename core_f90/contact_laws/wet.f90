!> Non-smooth Lennard-Jones attraction, LMGC90's IQS_WET_DS_CLB: within a reach two bodies draw each other with a constant force,
!> beside Signorini-Coulomb with the cone shifted by it, |r_T| <= mu (r_N + h F). To part them takes F times the reach; where that
!> has no end, the energy counts from the touch.
module wet
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use block_cones, only: solve_blocks, solve_plain, map_sliding, status_of_blocks, strip
  implicit none
  private
  public :: cairn_law_wet_prepare, law_solve, law_residual
  public :: cairn_law_wet_energy, depth_of
  character(*), parameter :: row = "wet"
  integer, parameter :: own = 3, states = 1 !< parameters, states
  integer, parameter :: bond(0) = [integer ::] !< no state variable marks a bond
contains

  include "cone_slots.inc"

  !> Free of bias where it is open.
  subroutine cairn_law_wet_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, 1)     !< see depth_of [m]
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    integer :: i
    bias = 0
    compliance = 0
    do i = 1, n
      bias(i, 1) = max(gap(i), 0.0_c_double)/context%h
      mu(i) = params(i, 3)
      state(i, 1) = depth_of(params(i, 2), gap(i))
    end do
  end subroutine cairn_law_wet_prepare

  !> Energy: the attraction stores -F depth; its energy before is by the gap at detection, the end of the last step.
  subroutine cairn_law_wet_energy(n, c, context, gap, u, r, params, state_begin, state, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see laws.def
    real(c_double), intent(in)          :: state_begin(n, 1), state(n, 1) !< see depth_of [m]
    real(c_double), intent(out)         :: energy(n, 4)   !< see cairn/core.h [J]
    integer :: i
    real(c_double) :: depth
    do i = 1, n
      depth = depth_of(params(i, 2), gap(i) + context%h*u(i, 1))
      energy(i, 1) = -params(i, 1)*depth
      energy(i, 2) = params(i, 1)*(state(i, 1) - depth)
      energy(i, 3) = 0
      energy(i, 4) = 0
    end do
  end subroutine cairn_law_wet_energy

  !> Reach less gap, not negative; less the gap where the reach has no end.
  pure real(c_double) function depth_of(reach, gap)
    real(c_double), intent(in) :: reach, gap !< [m]
    depth_of = -max(gap, 0.0_c_double)
    if (reach < huge(reach)) depth_of = min(reach, max(0.0_c_double, reach - max(gap, 0.0_c_double)))
  end function depth_of

  !> Attraction along the normal and limits of sliding, as impulses.
  pure subroutine limits(p, s, pull, mu, k)
    real(c_double), intent(in)     :: p(own + 4) !< parameters, step, area, effective radius, mass
    real(c_double), intent(in)     :: s(1)      !< state
    real(c_double), intent(out)    :: pull     !< [N s]
    real(c_double), intent(out)    :: mu, k  !< see solve_plain
    pull = 0
    if (s(1) > 0 .or. .not. p(2) < huge(p)) pull = p(1)*p(own + 1)
    mu = p(3)
    k = 0
  end subroutine limits
end module wet
