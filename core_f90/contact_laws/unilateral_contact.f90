!> Signorini-Coulomb with optional additions: static and kinetic friction, Newton's restitution, a gap measured from another place
!> (shift) or from where the bodies came in, and recovery of overlap in a step. LMGC90's IQS_DS_CLB, GAP_SGR_DS_CLB, VEL_SGR_DS_CLB,
!> RST_DS_CLB, IQS_CLB_g0, GAP_SGR_CLB_g0, preGAP_SGR_CLB.
!> Parameters: friction, kinetic friction [-], shift [m], from_start, recovers, normal and tangential restitution [-], closing, see
!> newton_restitution, within [m].
module unilateral_contact
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use dry_friction, only: friction_of, slid
  implicit none
  private
  public :: cairn_law_unilateral_contact_prepare, cairn_law_unilateral_contact_commit
  integer, parameter :: own = 9, states = 3 !< parameters, states
  integer, parameter :: s_started = 1, s_first = 2, s_slides = 3
contains

  !> Local problem on Coulomb's cone, with g = gap + shift - first gap.
  subroutine cairn_law_unilateral_contact_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see above
    real(c_double), intent(inout)       :: state(n, states) !< 1 begins, 2 counts from its first gap; that [m]; 1 slid
    real(c_double), intent(out)         :: bias(n, c)       !< not active: so large that it stays open [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    real(c_double) :: g
    integer :: i
    compliance = 0
    do i = 1, n
      if (state(i, s_started) > 0 .and. state(i, s_started) < 2) then
        state(i, s_started) = merge(2, 0, params(i, 4) > 0)
        state(i, s_first) = gap(i)
        if (.not. params(i, 5) > 0) state(i, s_first) = max(0.0_c_double, gap(i))
      end if
      g = gap(i) + params(i, 3)
      if (state(i, s_started) > 0) g = g - state(i, s_first)
      bias(i, :) = 0
      if (g > 0) then
        bias(i, 1) = sqrt(huge(g))
        if (params(i, 8) > 0 .and. .not. (params(i, 6) > 0 .or. abs(params(i, 7)) > 0)) bias(i, 1) = g/context%h
      else
        bias(i, 2:) = params(i, 7)*u_begin(i, 2:)
        bias(i, 1) = params(i, 6)*u_begin(i, 1)
        if (params(i, 5) > 0) bias(i, 1) = bias(i, 1) + g/context%h
      end if
      mu(i) = friction_of(params(i, 1), params(i, 2), state(i, s_slides))
    end do
  end subroutine cairn_law_unilateral_contact_prepare

  !> Records sliding.
  subroutine cairn_law_unilateral_contact_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)          !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)          !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own)   !< see above
    real(c_double), intent(inout)       :: state(n, states) !< see prepare
    real(c_double), pointer, contiguous :: geometry(:, :)
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    do i = 1, n
      state(i, s_slides) = slid(c, geometry(i, 3), friction_of(params(i, 1), params(i, 2), state(i, s_slides)), r(i, 1), &
                                r(i, :), u(i, :))
    end do
  end subroutine cairn_law_unilateral_contact_commit
end module unilateral_contact
