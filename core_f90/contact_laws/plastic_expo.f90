!> The cohesive zone of expo with a permanent opening, and a spring in series with it: LMGC90's EXPO_CZM_P, EXPO_CZM_SPRING and
!> EXPO_CZM_SPRING_P.
!> A share of the work goes into damage, the rest into a permanent opening: d = d_e + d_p. The elastic part follows the curve of
!> expo with the work w, the whole opening that of the work w/share. Past the onset d_e grows by the ratio of their rates with d,
!> d_p by the rest, along the opening. Unloading follows beta c to d_p; the same springs resist further closure down to the
!> surfaces.
!> The spring of stiffness K S bears the whole impulse of the zone, contact included: a compliance 1/(h^2 K S); under pressure the
!> spring yields.
!> Parameters: those of expo as far as its rest; share; stiffnesses K of the spring [Pa/m]; pressure in the crack [Pa], its power,
!> kinetic friction.
module plastic_expo
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use cohesive_error, only: cohesive_residual
  use cohesive_curves, only: length
  use cohesive_history, only: cohesive_energy, note_slip
  use cohesive_zone, only: cohesive_prepare, cohesive_solve, bias_of, crack_push, &
                           settle_velocity, slip_kept, stiff_in_step, missed_behind, first_own, c_n, &
                           c_t, recovery, broken, s_beta, s_opening, s_area, s_first, s_released, s_slip, rest_behind
  use mixed_mode, only: onset => onset_of_strengths, mixed_length, mixed_work, mean_decay
  implicit none
  private
  public :: cairn_law_plastic_expo_prepare, cairn_law_plastic_expo_solve, cairn_law_plastic_expo_residual
  public :: cairn_law_plastic_expo_commit, cairn_law_plastic_expo_energy
  integer, parameter :: own = 17 !< parameters
  integer, parameter :: spring_n = first_own + 6, spring_t = first_own + 7
contains

  !> Prepares as expo; adds the compliance of the spring and its tangential length. Where it yields, an overlap belongs to the
  !> spring.
  subroutine cairn_law_plastic_expo_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see above
    real(c_double), intent(inout)       :: state(n, *)      !< see cohesive_zone; the spring's length [m], along the tangents [m]
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction of broken contacts [-]
    real(c_double), pointer, contiguous :: geometry(:, :)
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    call cohesive_prepare(n, c, own, context, gap, u_begin, params, state, bias, compliance, mu)
    do i = 1, n
      call borne(n, c, i, context%h, gap(i), geometry(i, 1), params, state, bias, compliance)
    end do
  end subroutine cairn_law_plastic_expo_prepare

  !> Bias and compliance of one contact.
  pure subroutine borne(n, c, i, h, gap, area, params, state, bias, compliance)
    integer(c_int32_t), intent(in) :: n      !< contacts
    integer(c_int32_t), intent(in) :: c      !< components
    integer, intent(in)            :: i      !< contact
    real(c_double), intent(in)     :: h      !< step [s]
    real(c_double), intent(in)     :: gap    !< [m]
    real(c_double), intent(in)     :: area   !< of a contact that was never joined [m2]
    real(c_double), intent(in)     :: params(n, own)
    real(c_double), intent(in)     :: state(n, *) !< of the begin of the step
    real(c_double), intent(inout)  :: bias(n, c), compliance(n, c) !< [m/s], [1/kg]
    real(c_double) :: borne_by, recovers
    integer :: k
    borne_by = area
    if (state(i, s_area) > 0) borne_by = state(i, s_area)
    recovers = params(i, recovery)
    compliance(i, :) = 0
    bias(i, 2:) = 0
    if (yields(params(i, spring_n), borne_by)) then
      recovers = 1
      compliance(i, 1) = 1/(params(i, spring_n)*borne_by*h*h)
    end if
    bias(i, 1) = bias_of(gap, recovers, state(i, s_beta), state(i, s_first), h)
    if (.not. yields(params(i, spring_t), borne_by)) return
    do k = 2, c
      compliance(i, k) = 1/(params(i, spring_t)*borne_by*h*h)
      bias(i, k) = state(i, s_slip + 2*c + rest_behind + k)/h
    end do
  end subroutine borne

  !> An infinite stiffness is the largest number here, which an area would make one of a spring.
  pure logical function yields(k, area)
    real(c_double), intent(in) :: k    !< [Pa/m]
    real(c_double), intent(in) :: area !< [m2]
    yields = k > 0 .and. k < huge(k) .and. k*area > 0 .and. k*area < huge(k)
  end function yields

  subroutine cairn_law_plastic_expo_solve(n, c, w, u_free, bias, params, state, r, status) bind(c)
    integer(c_int32_t), value     :: n                  !< contacts
    integer(c_int32_t), value     :: c                  !< components
    real(c_double), intent(in)    :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)    :: u_free(n, c)       !< relative velocity with r = 0 here, bias included [m/s]
    real(c_double), intent(in)    :: bias(n, c)         !< in u_free [m/s]
    real(c_double), intent(in)    :: params(n, own + 4) !< see above; step, geometry
    real(c_double), intent(in)    :: state(n, *)        !< see prepare
    real(c_double), intent(inout) :: r(n, c)            !< impulse [N s]
    integer(c_int32_t), intent(out), optional :: status(n) !< see cairn_contact_status
    call cohesive_solve(n, c, own, damage, onset, .false., .true., w, u_free, params, state, r, status)
  end subroutine cairn_law_plastic_expo_solve

  subroutine cairn_law_plastic_expo_residual(n, c, context, rho, w, u, bias, r, params, state, f, weight, status) bind(c)
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
    call cohesive_residual(n, c, own, damage, onset, .false., .true., .false., rho, w, u, r, params, state, f, weight, status)
  end subroutine cairn_law_plastic_expo_residual

  !> The intensity by which springs pull on the opening less what stayed before the step: of the stress, over that opening.
  pure subroutine damage(p, h, normal, tangent, old, beta, spent)
    real(c_double), intent(in)            :: p(*)            !< parameters
    real(c_double), intent(in)            :: h               !< step [s]
    real(c_double), intent(in)            :: normal, tangent !< opening at the end of the step less what stayed [m]
    real(c_double), intent(in)            :: old             !< intensity at its begin
    real(c_double), intent(out)           :: beta            !< and at its end
    real(c_double), intent(out), optional :: spent           !< [J/m2]
    real(c_double) :: kept, now
    call opened(p, normal, tangent, old, now, kept, spent)
    beta = now*kept
  end subroutine damage

  !> Damage, and the share of an opening that does not stay.
  pure subroutine opened(p, normal, tangent, old, beta, kept, spent)
    real(c_double), intent(in)            :: p(*)            !< parameters
    real(c_double), intent(in)            :: normal, tangent !< opening less what stayed before [m]
    real(c_double), intent(in)            :: old             !< intensity before
    real(c_double), intent(out)           :: beta            !< and after
    real(c_double), intent(out)           :: kept            !< [-]
    real(c_double), intent(out), optional :: spent           !< [J/m2]
    real(c_double) :: d, share, k, first, g, stored, rate, slow, last, begun, end, strength, was, now
    integer :: i
    beta = old
    kept = 1
    if (present(spent)) spent = 0
    d = length(2, [normal, tangent])
    share = 0
    if (d > 0) share = (tangent/d)**2
    k = (1 - share)*p(c_n) + share*p(c_t)
    first = mixed_length(share, p(first_own)/p(c_n), p(first_own + 1)/p(c_t))
    if (d <= first) return
    g = mixed_work(share, p(c_n), p(c_t), p(first_own + 2), p(first_own + 3))
    stored = k*first**2/2
    if (.not. (g > stored .and. first > 0)) then ! of no strength, it opens without work
      beta = 0
      if (present(spent)) spent = k*old*first**2/2
      return
    end if
    rate = k*first/(g - stored)
    slow = k*first/(g/p(first_own + 5) - stored)
    last = first - log(p(first_own + 4))/rate
    begun = first ! where the curve has the old intensity: Newton's method from the side where it is convex
    do i = 1, 100
      end = begun + (log(first/begun) + rate*(first - begun) - log(old))/(1/begun + rate)
      if (.not. end > begun*(1 + 2*epsilon(end))) exit
      begun = end
    end do
    if (d <= begun) return
    strength = k*first
    was = strength*exp(rate*(first - begun))
    end = begun + (slow/rate)*(d - begun)
    now = 0
    if (end < last) then
      now = strength*exp(rate*(first - end))
      beta = now/(k*end)
      kept = end/d
      if (present(spent)) spent = was*(d - begun)*mean_decay(slow*(d - begun)) + (was*begun - now*end)/2
    else
      beta = 0
      if (present(spent)) spent = max(0.0_c_double, was - strength*p(first_own + 4))/slow + was*begun/2
    end if
  end subroutine opened

  !> Damage, permanent opening, and length of the spring at the end of the step.
  subroutine cairn_law_plastic_expo_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see above
    real(c_double), intent(inout)       :: state(n, *)    !< see prepare
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: bias(n, c), compliance(n, c), v(n, c), h
    integer :: i, k, first
    call c_f_pointer(context%geometry, geometry, [n, 3])
    h = context%h
    first = s_slip + 2*int(c) + rest_behind
    do i = 1, n
      call borne(n, c, i, h, gap(i), geometry(i, 1), params, state, bias, compliance)
      v(i, :) = u(i, :) + (bias(i, :) + compliance(i, :)*r(i, :))
      state(i, s_slip + c - 1) = 0
      if (state(i, s_beta) > 0) then
        call open_zone(n, c, i, h, geometry(i, 3), v, r, params, state)
      else
        call note_slip(n, c, own, i, geometry(i, 3), v, r, params, state)
      end if
      do k = 1, c
        state(i, first + k) = -h*compliance(i, k)*r(i, k)
      end do
    end do
  end subroutine cairn_law_plastic_expo_commit

  subroutine open_zone(n, c, i, h, mass, v, r, params, state)
    integer(c_int32_t), intent(in) :: n           !< contacts
    integer(c_int32_t), intent(in) :: c           !< components
    integer, intent(in)            :: i           !< contact
    real(c_double), intent(in)     :: h           !< step [s]
    real(c_double), intent(in)     :: mass        !< effective mass [kg]
    real(c_double), intent(in)     :: v(n, c)     !< velocity of the zone, the gap in it [m/s]
    real(c_double), intent(in)     :: r(n, c)     !< impulse [N s]
    real(c_double), intent(in)     :: params(n, own)
    real(c_double), intent(inout)  :: state(n, *) !< see prepare
    real(c_double) :: p(own + 1), slip(c - 1), went(c - 1), at(c), one(c), impulse(c), old, opening, beta, kept, spent, before
    integer :: rest
    rest = s_slip + 2*int(c) + rest_behind
    p(:own) = params(i, :)
    p(own + 1) = h
    old = state(i, s_beta)
    before = state(i, s_opening) + state(i, rest)
    at(1) = -state(i, rest)
    at(2:) = state(i, s_slip:s_slip + c - 2)
    one = v(i, :)
    impulse = r(i, :)
    call opened(p, max(0.0_c_double, at(1) + h*one(1)), length(c - 1, at(2:) + h*one(2:)), old, beta, kept)
    if (beta < old .or. stiff_in_step(state(i, s_area)*old*max(p(c_n), p(c_t))*h**2, mass)) &
      call settle_velocity(c, own, damage, .false., p, 1/mass, impulse, old, state(i, s_area), at, one)
    opening = max(0.0_c_double, h*one(1)) - state(i, rest)
    slip = at(2:) + h*one(2:)
    call opened(p, max(0.0_c_double, opening), length(c - 1, slip), old, beta, kept, spent)
    if (p(own - 2) > 0) beta = max(beta, min(broken, old))
    state(i, s_slip + c - 1) = crack_push(p(own - 2), p(own - 1), h, beta, state(i, s_area))*(opening + state(i, rest) - before)/h
    if (opening < 0) spent = spent + (old - beta)*p(c_n)*opening**2/2 ! of springs that push
    if (beta < broken) then
      beta = 0
      opening = 0
      slip = 0
      state(i, rest) = 0
    end if
    if (opening > 0) then
      state(i, rest) = state(i, rest) + (1 - kept)*opening
      opening = kept*opening
    end if
    state(i, s_beta) = beta
    state(i, s_opening) = opening
    state(i, s_released) = state(i, s_released) + state(i, s_area)*spent
    slip = kept*slip
    went = slip
    if (.not. beta < old) went = slip_kept(state(i, s_area)*beta*p(c_t)*h**2, mass, at(2:) + h*v(i, 2:), slip)
    state(i, s_slip:s_slip + c - 2) = went
    state(i, s_slip + c + missed_behind:s_slip + 2*c) = went - slip
  end subroutine open_zone

  !> Energy of the zone and of the spring.
  subroutine cairn_law_plastic_expo_energy(n, c, context, gap, u, r, params, state_begin, state, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see above
    real(c_double), intent(in)          :: state_begin(n, *), state(n, *) !< see prepare
    real(c_double), intent(out)         :: energy(n, 4)   !< see cairn/core.h [J]
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: area, now, was, stiffness
    integer :: i, k, first
    call c_f_pointer(context%geometry, geometry, [n, 3])
    call cohesive_energy(n, c, .false., params, state_begin, state, energy)
    first = s_slip + 2*int(c) + rest_behind
    do i = 1, n
      area = geometry(i, 1)
      if (state_begin(i, s_area) > 0) area = state_begin(i, s_area)
      do k = 1, c
        stiffness = merge(params(i, spring_n), params(i, spring_t), k == 1)
        if (.not. yields(stiffness, area)) cycle
        stiffness = stiffness*area
        now = stiffness*state(i, first + k)**2/2
        was = stiffness*state_begin(i, first + k)**2/2
        energy(i, 1) = energy(i, 1) + now
        energy(i, merge(2, 3, k == 1)) = energy(i, merge(2, 3, k == 1)) + now - was
      end do
    end do
  end subroutine cairn_law_plastic_expo_energy
end module plastic_expo
