!> The attraction of wet, with optional additions: static and kinetic friction, a weaker force once torn, a bond made at the start
!> alone, a spring and a dashpot in series (see elastic_contact), or Newton's restitution. LMGC90's IQS_WET_DS_CLB, GAP_WET_DS_CLB,
!> xQS_WET_DS_CLB, RST_WET_CLB, ELASTIC_REPELL_WET_CLB, IQS_SGR_CLB_WEAR.
!> Parameters: force [N], reach [m], friction, kinetic friction [-], force once torn [N], once, k [N/m], eta [N s/m], recovers,
!> normal and tangential restitution [-], closing, within [m], touching (0: the attraction ends at the touch, and a contact that
!> closes within its reach stops there; LMGC90's VISCO_ELASTIC_REPELL_WET).
module adhesive_contact
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use block_cones, only: solve_blocks, solve_plain, map_sliding, status_of_blocks, strip
  use dry_friction, only: friction_of, slid
  use elastic_contact, only: spring_and_dashpot, spring_energy
  implicit none
  private
  public :: cairn_law_adhesive_contact_prepare, law_solve, law_residual
  public :: cairn_law_adhesive_contact_commit, cairn_law_adhesive_contact_energy
  character(*), parameter :: row = "adhesive_contact"
  integer, parameter :: own = 14, states = 4 !< parameters, states
  integer, parameter :: bond(0) = [integer ::] !< no state variable marks a bond
  integer, parameter :: s_started = 1, s_torn = 2, s_slides = 3, s_pull = 4
contains

  include "cone_slots.inc"

  !> Attraction of this step; bias and compliance of the spring under it.
  subroutine cairn_law_adhesive_contact_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see above
    real(c_double), intent(inout)       :: state(n, states) !< 1 begins, 2 a bond of the start; 1 torn; 1 slid; pull [N]
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    integer :: i
    bias = 0
    compliance = 0
    do i = 1, n
      if (state(i, s_started) > 0) state(i, s_started) = merge(2, 0, params(i, 6) > 0 .and. gap(i) <= params(i, 2))
      state(i, s_pull) = pull_of(gap(i), params(i, :), state(i, :))
      if (gap(i) > 0 .and. .not. params(i, 14) > 0) then
        bias(i, 1) = merge(gap(i)/context%h, sqrt(huge(gap)), params(i, 12) > 0 .or. gap(i) <= params(i, 2))
      else if (params(i, 7) < huge(gap)) then
        call spring_and_dashpot(context%h, params(i, 7), params(i, 8), params(i, 12), gap(i), bias(i, 1), compliance(i, 1))
        ! the spring bears the impulse and the pull, its compliance meets the impulse alone
        bias(i, 1) = bias(i, 1) + compliance(i, 1)*(state(i, s_pull)*context%h)
      else if (gap(i) > 0) then
        bias(i, 1) = sqrt(huge(gap))
        if (params(i, 12) > 0 .and. .not. (params(i, 10) > 0 .or. abs(params(i, 11)) > 0)) bias(i, 1) = gap(i)/context%h
      else
        bias(i, 2:) = params(i, 11)*u_begin(i, 2:)
        bias(i, 1) = params(i, 10)*u_begin(i, 1)
        if (params(i, 9) > 0) bias(i, 1) = bias(i, 1) + gap(i)/context%h
      end if
      mu(i) = friction_of(params(i, 3), params(i, 4), state(i, s_slides))
    end do
  end subroutine cairn_law_adhesive_contact_prepare

  !> Force that draws at a gap.
  pure real(c_double) function pull_of(gap, p, s)
    real(c_double), intent(in) :: gap       !< [m]
    real(c_double), intent(in) :: p(own)    !< see above
    real(c_double), intent(in) :: s(states) !< see prepare
    pull_of = 0
    if (.not. (gap > 0 .or. p(14) > 0)) return
    pull_of = strength_of(gap, p, s)
  end function pull_of

  !> The same whether or not an attraction goes on in an overlap.
  pure real(c_double) function strength_of(gap, p, s)
    real(c_double), intent(in) :: gap       !< [m]
    real(c_double), intent(in) :: p(own)    !< see above
    real(c_double), intent(in) :: s(states) !< see prepare
    strength_of = 0
    if (gap > p(2) .or. (p(6) > 0 .and. .not. s(s_started) > 0)) return
    strength_of = p(1)
    if (s(s_torn) > 0) strength_of = min(p(1), p(5))
  end function strength_of

  !> Marks contacts whose attraction did not hold as torn, and records sliding.
  subroutine cairn_law_adhesive_contact_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)          !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)          !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own)   !< see above
    real(c_double), intent(inout)       :: state(n, states) !< see prepare
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: pull, normal
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    do i = 1, n
      pull = state(i, s_pull)*context%h
      normal = r(i, 1) + pull
      if (pull > 0 .and. .not. normal > 8*epsilon(pull)*pull) state(i, s_torn) = 1
      state(i, s_slides) = slid(c, geometry(i, 3), friction_of(params(i, 3), params(i, 4), state(i, s_slides)), normal, &
                                r(i, :), u(i, :))
    end do
  end subroutine cairn_law_adhesive_contact_commit

  !> Energy: the attraction stores -F (reach - gap), the spring its own; a torn contact loses the difference.
  subroutine cairn_law_adhesive_contact_energy(n, c, context, gap, u, r, params, state_begin, state, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see above
    real(c_double), intent(in)          :: state_begin(n, states), state(n, states) !< see prepare
    real(c_double), intent(out)         :: energy(n, 4)   !< see cairn/core.h [J]
    real(c_double) :: g, pull, was, now, spent, first, last
    integer :: i
    energy = 0
    do i = 1, n
      g = gap(i) + context%h*u(i, 1)
      pull = state(i, s_pull)
      was = spring_energy(params(i, 7), gap(i))
      now = spring_energy(params(i, 7), g)
      first = depth(params(i, 2), gap(i), params(i, 14))
      last = depth(params(i, 2), g, params(i, 14))
      energy(i, 1) = now - strength_of(g, params(i, :), state(i, :))*last
      energy(i, 2) = pull*(first - last)
      spent = 0
      if (r(i, 1) + pull*context%h > 0) then
        if (.not. gap(i) > 0 .and. params(i, 7) < huge(g)) spent = params(i, 8)*u(i, 1)**2*context%h
        energy(i, 2) = energy(i, 2) + now - was + spent
      end if
      energy(i, 4) = energy(i, 2) - (energy(i, 1) - was + strength_of(gap(i), params(i, :), state_begin(i, :))*first)
    end do
  end subroutine cairn_law_adhesive_contact_energy

  !> How far within its reach a gap is; from the touch on where that has no end.
  pure real(c_double) function depth(reach, gap, touching)
    real(c_double), intent(in) :: reach, gap !< [m]
    real(c_double), intent(in) :: touching   !< above 0: the attraction goes on in an overlap
    depth = -merge(gap, max(gap, 0.0_c_double), touching > 0)
    if (reach < huge(reach)) depth = max(0.0_c_double, reach + depth)
  end function depth

  !> Attraction along the normal and limits of sliding, as impulses.
  pure subroutine limits(p, s, pull, mu, k)
    real(c_double), intent(in)     :: p(own + 4) !< parameters, step, area, effective radius, mass
    real(c_double), intent(in)     :: s(states)  !< state
    real(c_double), intent(out)    :: pull       !< [N s]
    real(c_double), intent(out)    :: mu, k  !< see solve_plain
    pull = s(s_pull)*p(own + 1)
    mu = friction_of(p(3), p(4), s(s_slides))
    k = 0
  end subroutine limits
end module adhesive_contact
