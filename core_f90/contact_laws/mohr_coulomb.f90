!> Brittle bonds, LMGC90's IQS_MOHR_DS_CLB and IQS_CAP_MOHR_DS_CLB: bodies that came in touching are held fast while the stress
!> between them is within -tension <= s_N <= cap, |s_T| <= cohesion + friction s_N. A bond that reaches a limit is broken from the
!> next step on, and under Coulomb's cone for good, with a kinetic friction where it slid in the step before.
!> Parameters: tension, cohesion [Pa], friction while it is whole, friction once broken [-], cap [Pa], within [m], kinetic friction.
module mohr_coulomb
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use block_cones, only: solve_blocks, solve_plain, map_sliding, status_of_blocks, strip
  use dry_friction, only: friction_of, slid
  implicit none
  private
  public :: cairn_law_mohr_coulomb_prepare, law_solve, law_residual
  public :: cairn_law_mohr_coulomb_commit
  character(*), parameter :: row = "mohr_coulomb"
  integer, parameter :: own = 7, states = 4 !< parameters, states
  integer, parameter :: bond(1) = [1] !< state variable that marks a bond
  real(c_double), parameter :: sure = 1e-9_c_double !< of a limit: what points of a face share is rounded
contains

  include "cone_slots.inc"

  !> Free of bias where it is open.
  subroutine cairn_law_mohr_coulomb_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, states) !< 1 sound, 0 broken or none; area [m2]; gap of its begin [m]; 1 slid
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    real(c_double), pointer, contiguous :: geometry(:, :)
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    bias = 0
    compliance = 0
    do i = 1, n
      if (state(i, 1) > 0 .and. .not. state(i, 2) > 0) then
        state(i, 2) = geometry(i, 1)
        state(i, 3) = max(gap(i), 0.0_c_double)
        if (.not. state(i, 2) > 0) state(i, 1) = 0 ! a corner has no area
      end if
      bias(i, 1) = max(gap(i) - merge(state(i, 3), 0.0_c_double, state(i, 1) > 0), 0.0_c_double)/context%h
      mu(i) = friction_of(params(i, 4), params(i, 7), state(i, 4))
    end do
  end subroutine cairn_law_mohr_coulomb_prepare

  !> Breaks bonds that have reached a limit (those that failed in shear count as sliding), and records sliding of broken contacts.
  subroutine cairn_law_mohr_coulomb_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see laws.def
    real(c_double), intent(inout)       :: state(n, states) !< see prepare
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: pull, mu, k, p(own + 4), normal, tangent, s(states), impulse(c), velocity(c)
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    p = 0
    p(own + 1) = context%h
    do i = 1, n
      if (.not. state(i, 1) > 0) then
        if (.not. params(i, 7) < params(i, 4)) cycle
        impulse = r(i, :)
        velocity = u(i, :)
        state(i, 4) = slid(c, geometry(i, 3), friction_of(params(i, 4), params(i, 7), state(i, 4)), impulse(1), impulse, velocity)
        cycle
      end if
      p(1:own) = params(i, :)
      s = state(i, :)
      call limits(p, s, pull, mu, k)
      normal = r(i, 1) + pull
      tangent = maxval(abs(r(i, 2:)))
      if (tangent > 0) tangent = tangent*sqrt(sum((r(i, 2:)/tangent)**2))
      if (.not. normal > sure*pull .or. tangent >= (mu*normal + k)*(1 - sure) .or. &
          r(i, 1) > p(5)*state(i, 2)*context%h) state(i, 1) = 0
      if (params(i, 7) < params(i, 4) .and. .not. state(i, 1) > 0 .and. normal > sure*pull .and. &
          tangent >= (mu*normal + k)*(1 - sure)) state(i, 4) = 1
    end do
  end subroutine cairn_law_mohr_coulomb_commit

  !> Attraction along the normal and limits of sliding, as impulses.
  pure subroutine limits(p, s, pull, mu, k)
    real(c_double), intent(in)     :: p(own + 4) !< parameters, step, area, effective radius, mass
    real(c_double), intent(in)     :: s(states) !< state
    real(c_double), intent(out)    :: pull     !< [N s]
    real(c_double), intent(out)    :: mu, k  !< see solve_plain
    real(c_double) :: area, tension
    pull = 0
    mu = friction_of(p(4), p(7), s(4))
    k = 0
    if (.not. s(1) > 0) return
    area = s(2)*p(own + 1)
    tension = p(1)
    if (p(3) > 0) tension = min(tension, p(2)/p(3)) ! where the cone has its tip
    pull = tension*area
    mu = p(3)
    k = max(0.0_c_double, p(2) - p(3)*tension)*area
  end subroutine limits
end module mohr_coulomb
