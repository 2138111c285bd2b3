!> The cohesive zone of mac with additions: an attraction within a reach once it is broken (see wet), a compliant surface that acts
!> as a spring under pressure up to a largest overlap, and a gap left by damage. LMGC90's IQS_WET_CZM, ELASTIC_REPELL_MAC_CZM,
!> postGAP_IQS_MAC_CZM.
!> Parameters: those of mac as far as its viscosity; force [N], reach [m], k [N/m], overlap at which the spring is hard [m], gap
!> that breaking takes [m]; pressure in the crack [Pa], its power, kinetic friction.
module mac_contact
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use cohesive_error, only: cohesive_residual
  use cohesive_history, only: cohesive_commit, cohesive_energy
  use cohesive_zone, only: cohesive_prepare, cohesive_solve, bias_of, c_n, recovery, s_beta, s_opening, s_area, &
                           s_first, s_slip, rest_behind
  use mac, only: damage, onset
  implicit none
  private
  public :: cairn_law_mac_contact_prepare, cairn_law_mac_contact_solve, cairn_law_mac_contact_residual
  public :: cairn_law_mac_contact_commit, cairn_law_mac_contact_energy
  integer, parameter :: own = 16 !< parameters
  integer, parameter :: force = 9, reach = 10, stiffness = 11, limit = 12, loss = 13
  integer, parameter :: pull_behind = rest_behind !< place of the pull [N] behind s_slip + 2 c
contains

  !> Prepares as mac; adds the compliance of the spring under pressure.
  subroutine cairn_law_mac_contact_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see above
    real(c_double), intent(inout)       :: state(n, *)      !< see cohesive_zone; pull [N]
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction of broken contacts [-]
    integer :: i
    call cohesive_prepare(n, c, own, context, gap, u_begin, params, state, bias, compliance, mu)
    do i = 1, n
      state(i, s_slip + 2*c + pull_behind) = 0
      if (.not. state(i, s_beta) > 0 .and. gap(i) <= params(i, reach)) state(i, s_slip + 2*c + pull_behind) = params(i, force)
      call borne(n, c, i, context%h, gap(i), params, state, bias(i, 1), compliance(i, 1))
    end do
  end subroutine cairn_law_mac_contact_prepare

  !> Bias and compliance along the normal. The spring bears the impulse and the pull, its compliance meets the impulse alone.
  pure subroutine borne(n, c, i, h, gap, params, state, bias, compliance)
    integer(c_int32_t), intent(in) :: n          !< contacts
    integer(c_int32_t), intent(in) :: c          !< components
    integer, intent(in)            :: i          !< contact
    real(c_double), intent(in)     :: h          !< step [s]
    real(c_double), intent(in)     :: gap        !< [m]
    real(c_double), intent(in)     :: params(n, own)
    real(c_double), intent(in)     :: state(n, *) !< of the begin of the step
    real(c_double), intent(out)    :: bias       !< [m/s]
    real(c_double), intent(out)    :: compliance !< [1/kg]
    real(c_double) :: counted
    counted = gap + params(i, loss)*(1 - state(i, s_beta))
    compliance = 0
    bias = bias_of(counted, params(i, recovery), state(i, s_beta), state(i, s_first), h)
    if (.not. (springs(params(i, stiffness), counted) .and. counted > -params(i, limit))) return
    compliance = 1/(params(i, stiffness)*h*h)
    bias = counted/h + compliance*(state(i, s_slip + 2*c + pull_behind)*h)
  end subroutine borne

  pure logical function springs(k, gap)
    real(c_double), intent(in) :: k, gap !< [N/m], [m]
    springs = gap < 0 .and. k > 0 .and. k < huge(k)
  end function springs

  !> With the pull taken to the free velocity.
  subroutine cairn_law_mac_contact_solve(n, c, w, u_free, bias, params, state, r, status) bind(c)
    integer(c_int32_t), value     :: n                  !< contacts
    integer(c_int32_t), value     :: c                  !< components
    real(c_double), intent(in)    :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)    :: u_free(n, c)       !< relative velocity with r = 0 here, bias included [m/s]
    real(c_double), intent(in)    :: bias(n, c)         !< in u_free [m/s]
    real(c_double), intent(in)    :: params(n, own + 4) !< see above; step, geometry
    real(c_double), intent(in)    :: state(n, *)        !< see prepare
    real(c_double), intent(inout) :: r(n, c)            !< impulse [N s]
    integer(c_int32_t), intent(out), optional :: status(n) !< see cairn_contact_status
    real(c_double) :: pull(n), drawn(n, c)
    integer :: k
    pull = state(:n, s_slip + 2*c + pull_behind)*params(:, own + 1)
    do k = 1, c
      drawn(:, k) = u_free(:, k) - w(:, k, 1)*pull
    end do
    call cohesive_solve(n, c, own, damage, onset, .true., .false., w, drawn, params, state, r, status)
    r(:, 1) = r(:, 1) - pull
  end subroutine cairn_law_mac_contact_solve

  !> Residual of the impulse without the attraction.
  subroutine cairn_law_mac_contact_residual(n, c, context, rho, w, u, bias, r, params, state, f, weight, status) bind(c)
    integer(c_int32_t), value           :: n                  !< contacts
    integer(c_int32_t), value           :: c                  !< components
    type(cairn_law_context), intent(in) :: context            !< step
    real(c_double), intent(in)          :: rho(n)             !< 1/W_NN [kg]
    real(c_double), intent(in)          :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)          :: u(n, c)            !< relative velocity, bias included [m/s]
    real(c_double), intent(in)          :: bias(n, c)         !< in u [m/s]
    real(c_double), intent(in)          :: r(n, c)            !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own + 4) !< see above; step, geometry
    real(c_double), intent(in)          :: state(n, *)        !< see prepare
    real(c_double), intent(out)         :: f(n, c)            !< [N s]
    real(c_double), intent(out)         :: weight(n, c)       !< [1/kg]
    integer(c_int32_t), intent(out)     :: status(n)          !< see cairn_contact_status
    real(c_double) :: shifted(n, c)
    shifted = r
    shifted(:, 1) = r(:, 1) + state(:n, s_slip + 2*c + pull_behind)*params(:, own + 1)
    call cohesive_residual(n, c, own, damage, onset, .true., .false., .false., rho, w, u, shifted, params, state, f, weight, &
                           status)
  end subroutine cairn_law_mac_contact_residual

  subroutine cairn_law_mac_contact_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see above
    real(c_double), intent(inout)       :: state(n, *)    !< see prepare
    real(c_double) :: opens(n), shifted(n, c), bias, compliance
    integer :: i
    shifted = r
    shifted(:, 1) = r(:, 1) + state(:n, s_slip + 2*c + pull_behind)*context%h
    do i = 1, n
      call borne(n, c, i, context%h, gap(i), params, state, bias, compliance)
      opens(i) = u(i, 1) + (bias + compliance*r(i, 1))
    end do
    call cohesive_commit(n, c, own, context, damage, .true., opens, u, shifted, params, state)
  end subroutine cairn_law_mac_contact_commit

  !> Energy of the zone, of the spring, and of the attraction, which stores -F (reach - gap) once the zone is broken.
  subroutine cairn_law_mac_contact_energy(n, c, context, gap, u, r, params, state_begin, state, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see above
    real(c_double), intent(in)          :: state_begin(n, *), state(n, *) !< see prepare
    real(c_double), intent(out)         :: energy(n, 4)   !< see cairn/core.h [J]
    real(c_double) :: g, last, pull, was, now, drawn, draws, taken, opened
    integer :: i
    call cohesive_energy(n, c, .true., params, state_begin, state, energy)
    do i = 1, n
      g = gap(i) + params(i, loss)*(1 - state_begin(i, s_beta))
      last = gap(i) + context%h*u(i, 1) + params(i, loss)*(1 - state(i, s_beta))
      pull = state(i, s_slip + 2*c + pull_behind)
      was = held(params(i, stiffness), params(i, limit), g)
      now = held(params(i, stiffness), params(i, limit), last)
      drawn = 0
      if (.not. state_begin(i, s_beta) > 0) drawn = attracted(params(i, force), params(i, reach), gap(i))
      draws = 0
      if (.not. state(i, s_beta) > 0) draws = attracted(params(i, force), params(i, reach), gap(i) + context%h*u(i, 1))
      taken = 0
      if (pull > 0) taken = drawn - draws
      if (r(i, 1) + pull*context%h > 0) taken = taken + now - was
      energy(i, 1) = energy(i, 1) + now - draws
      energy(i, 2) = energy(i, 2) + taken
      energy(i, 4) = energy(i, 4) + taken - (now - was) + (draws - drawn)
      if (.not. params(i, loss) > 0) cycle
      ! sides that damage has taken from draw the zone: no body did that
      opened = max(0.0_c_double, g - state_begin(i, s_first))
      taken = state_begin(i, s_area)*state_begin(i, s_beta)**2*params(i, c_n)*(opened**2 - state_begin(i, s_opening)**2)/2
      energy(i, 2) = energy(i, 2) - taken
      energy(i, 4) = energy(i, 4) - taken
    end do
  end subroutine cairn_law_mac_contact_energy

  !> Energy of the spring at a gap.
  pure real(c_double) function held(k, most, gap)
    real(c_double), intent(in) :: k, most, gap !< [N/m], [m]
    held = 0
    if (springs(k, gap)) held = k*min(most, -gap)**2/2
  end function held

  !> Work of an attraction up to a gap [J]; from the touch on where its reach is infinite.
  pure real(c_double) function attracted(f, far, gap)
    real(c_double), intent(in) :: f, far, gap !< [N], [m]
    attracted = 0
    if (f > 0) attracted = -f*gap
    if (f > 0 .and. far < huge(far)) attracted = f*max(0.0_c_double, far - gap)
  end function attracted
end module mac_contact
