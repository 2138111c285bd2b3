!> Common part of cohesive zones (Raous, Cangemi & Cocou 1999; Monerie & Acary 2001): springs join the bodies of an intact contact;
!> damage reduces their stiffness. Beside them acts unilateral contact with friction,
!>   r = r_c - h S phi(beta) (c_N d_N n + c_T d_T),   0 <= d_N + (r_c)_N >= 0,   |r_c_T| <= mu (1 - beta)^p r_c_N,
!> with the intensity of adhesion beta from 1 to 0, which never grows, the opening d = (d_N, d_T) at the end of the step and the
!> area S. A pressure in the crack adds h S p (1 - beta)^a n once there is damage. Unloading follows the secant through the origin.
!> Damage is solved with the impulse: at constant beta, the springs turn W and the free velocity into (1 + W K)^-1 times these, and
!> Coulomb's cone gives r_c; beta is the largest that its own opening allows.
!> Parameters of all: stiffnesses [Pa/m], friction, power p, share of an overlap that is recovered in a step, gap up to which bodies
!> that come in together are bonded; then those of the law; pressure in the crack [Pa] and its power a, and last the friction of a
!> broken contact that slid in the step before. A broken contact stays a pair under pressure, with negligible adhesion.
!> A plastic law has a permanent opening d_p: springs pull by d - d_p, and push where d_N is less than that.
module cohesive_zone
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use coulomb_cone, only: cairn_cone_full2, cairn_cone_full3
  use cohesive_curves, only: length
  use lane_blocks, only: pushed_velocities
  implicit none
  private
  public :: cohesive_prepare, cohesive_solve, allowed, begun_at, bias_of, crack_push, effective_friction, intensity, &
            resolved_in_step, settle_velocity, slip_kept, solve_contact, springs, springs_of_all, stay_whole, stiff_in_step
  real(c_double), parameter, public :: heavier = 64 !< than they are bodies count as that settle a contact, see settle_velocity
  integer, parameter, public :: first_own = 7 !< place of the first parameter of the law itself
  integer, parameter, public :: c_n = 1, c_t = 2, friction = 3, power = 4, recovery = 5
  integer, parameter, public :: s_beta = 1, s_opening = 2, s_area = 3, s_first = 4, s_released = 5, s_slip = 6
  integer, parameter, public :: slides_behind = 1, missed_behind = 2 !< places behind s_slip + c
  integer, parameter, public :: rest_behind = 1 !< and behind s_slip + 2 c
  real(c_double), parameter, public :: broken = 2.0_c_double**(-40) !< a smaller share of adhesion counts as none

  abstract interface
    !> Intensity of adhesion at an opening, and the energy dissipated by its fall.
    pure subroutine cohesive_damage(p, h, normal, tangent, old, beta, spent)
      import :: c_double
      real(c_double), intent(in)            :: p(*)    !< parameters
      real(c_double), intent(in)            :: h       !< step [s]
      real(c_double), intent(in)            :: normal, tangent !< opening at the end of the step, both from 0 on [m]
      real(c_double), intent(in)            :: old     !< intensity at its begin, above 0
      real(c_double), intent(out)           :: beta    !< at its end, from 0 to old
      real(c_double), intent(out), optional :: spent   !< [J/m2]
    end subroutine cohesive_damage
    !> An ellipse of openings that damage nothing that is sound: limit_1 d_N^2 + limit_2 d_T^2 <= 1.
    pure subroutine cohesive_onset(n, p, limit)
      import :: c_double, c_int32_t
      integer(c_int32_t), intent(in) :: n           !< contacts
      real(c_double), intent(in)     :: p(n, *)     !< parameters
      real(c_double), intent(out)    :: limit(n, 2) !< [1/m2]
    end subroutine cohesive_onset
  end interface
  public :: cohesive_damage, cohesive_onset
contains

  subroutine cohesive_prepare(n, c, own, context, gap, u_begin, params, state, bias, compliance, mu)
    integer(c_int32_t), intent(in)      :: n                !< contacts
    integer(c_int32_t), intent(in)      :: c                !< components
    integer, intent(in)                 :: own              !< parameters of the law
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, *)     !< see above
    real(c_double), intent(inout)       :: state(n, *)      !< beta, opening [m], area [m2], first gap [m], released [J], slip [m],
    !< work of the pressure in the step [J], velocity along the normal at its start [m/s], 1 slid, part of the slip without spring
    !< [m]; of plastic laws the permanent opening [m]
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< [-]
    real(c_double), pointer, contiguous :: geometry(:, :)
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    bias = 0
    compliance = 0
    do i = 1, n
      if (state(i, s_beta) > 0 .and. .not. state(i, s_area) > 0) then
        state(i, s_area) = geometry(i, 1)
        state(i, s_first) = max(gap(i), 0.0_c_double)
        if (.not. state(i, s_area) > 0) state(i, s_beta) = 0 ! a corner has no area
      end if
      bias(i, 1) = bias_of(gap(i), params(i, recovery), state(i, s_beta), state(i, s_first), context%h)
      mu(i) = params(i, friction)
      if (.not. state(i, s_beta) > 0 .and. state(i, s_slip + c + slides_behind) > 0) mu(i) = min(mu(i), params(i, own))
      state(i, s_slip + c) = u_begin(i, 1)
    end do
  end subroutine cohesive_prepare

  !> A bond begins at the gap it had. Overlap is not thrown out at once.
  pure real(c_double) function bias_of(gap, recovered, beta, first, h)
    real(c_double), intent(in) :: gap       !< [m]
    real(c_double), intent(in) :: recovered !< share of an overlap
    real(c_double), intent(in) :: beta      !< intensity of adhesion
    real(c_double), intent(in) :: first     !< gap at which it began [m]
    real(c_double), intent(in) :: h         !< [s]
    real(c_double) :: g
    g = gap
    if (beta > 0) g = gap - first
    bias_of = (max(g, 0.0_c_double) + recovered*min(g, 0.0_c_double))/h
  end function bias_of

  subroutine cohesive_solve(n, c, own, damage, onset, square, plastic, w, u_free, params, state, r, status)
    integer(c_int32_t), intent(in) :: n            !< contacts
    integer(c_int32_t), intent(in) :: c            !< components
    integer, intent(in)            :: own          !< parameters of the law; behind them the step
    procedure(cohesive_damage)     :: damage
    procedure(cohesive_onset)      :: onset
    logical, intent(in)            :: square       !< phi = beta^2, else beta
    logical, intent(in)            :: plastic      !< the law has a permanent opening
    real(c_double), intent(in)     :: w(n, c, c)   !< Delassus blocks [1/kg]
    real(c_double), intent(in)     :: u_free(n, c) !< relative velocity with r = 0 here, bias included [m/s]
    real(c_double), intent(in)     :: params(n, *), state(n, *)
    real(c_double), intent(inout)  :: r(n, c)      !< impulse [N s]
    integer(c_int32_t), intent(out), optional :: status(n) !< see cairn_contact_status
    real(c_double) :: p(own + 1), q(c), block(c, c), u(c), one(c), at(c), spring(n, c), pull(n, c), trial(n, c), push(n), beta
    logical :: sound(n)
    integer :: i, k
    call springs_of_all(n, c, own, square, plastic, params, state, spring, pull)
    call pushed_velocities(n, c, w, u_free, spring, pull, trial, push)
    call stay_sound(n, c, own, onset, params, state, trial, push, sound)
    do k = 1, c
      !$omp simd
      do i = 1, n
        r(i, k) = -(spring(i, k)*trial(i, k) + pull(i, k))
      end do
    end do
    r(:, 1) = r(:, 1) + push
    if (present(status)) status = 3
    if (all(sound)) return
    do i = 1, n
      if (sound(i)) cycle
      p = params(i, 1:own + 1)
      call begun_at(n, c, i, plastic, state, at)
      if (p(own) < p(friction) .and. .not. state(i, s_beta) > 0) then
        if (state(i, s_slip + c + slides_behind) > 0) p(friction) = p(own)
      end if
      ! many are not damaged further, and slide on nothing
      if (state(i, s_beta) > 0 .and. (.not. push(i) > 0 .or. &
                                      .not. effective_friction(p(friction), p(power), state(i, s_beta)) > 0)) then
        u = trial(i, :)
        call allowed(c, own, damage, p, u, state(i, s_beta), at, beta)
        if (beta >= state(i, s_beta)) cycle
      end if
      block = w(i, :, :)
      q = u_free(i, :)
      call solve_contact(c, own, damage, square, p, block, q, state(i, s_beta), state(i, s_area), at, one, u)
      r(i, :) = one
      if (.not. present(status)) cycle
      status(i) = merge(1, 0, one(1) > 0)
      if (.not. state(i, s_beta) > 0) cycle
      call allowed(c, own, damage, p, u, state(i, s_beta), at, beta)
      status(i) = merge(4, 3, beta < state(i, s_beta)) ! softens, or is held as before
    end do
  end subroutine cohesive_solve

  !> How far the springs are drawn at the begin of the step, but for the gap, which stands in the bias.
  pure subroutine begun_at(n, c, i, plastic, state, at)
    integer(c_int32_t), intent(in) :: n           !< contacts
    integer(c_int32_t), intent(in) :: c           !< components
    integer, intent(in)            :: i           !< contact
    logical, intent(in)            :: plastic     !< the law has a permanent opening
    real(c_double), intent(in)     :: state(n, *)
    real(c_double), intent(out)    :: at(c)       !< [m]
    at(1) = 0
    if (plastic) at(1) = -state(i, s_slip + 2*c + rest_behind)
    at(2:) = state(i, s_slip:s_slip + c - 2)
  end subroutine begun_at

  !> r = -(spring u + pull) with the beta of the step's begin.
  pure subroutine springs_of_all(n, c, own, square, plastic, params, state, spring, pull)
    integer(c_int32_t), intent(in) :: n            !< contacts
    integer(c_int32_t), intent(in) :: c            !< components
    integer, intent(in)            :: own          !< parameters of the law; behind them the step
    logical, intent(in)            :: square       !< phi = beta^2, else beta
    logical, intent(in)            :: plastic      !< the law has a permanent opening
    real(c_double), intent(in)     :: params(n, *), state(n, *)
    real(c_double), intent(out)    :: spring(n, c) !< [kg]
    real(c_double), intent(out)    :: pull(n, c)   !< [N s]
    real(c_double) :: by(n)
    integer :: i, k
    !$omp simd
    do i = 1, n
      by(i) = state(i, s_area)*merge(state(i, s_beta)**2, state(i, s_beta), square)*params(i, own + 1)
      spring(i, 1) = by(i)*params(i, c_n)*params(i, own + 1)
      pull(i, 1) = 0
    end do
    if (any(params(:n, own - 2) > 0)) &
      pull(:, 1) = -crack_push(params(:n, own - 2), params(:n, own - 1), params(:n, own + 1), state(:n, s_beta), state(:n, s_area))
    if (plastic) pull(:, 1) = pull(:, 1) - by*params(:n, c_n)*state(:n, s_slip + 2*c + rest_behind)
    do k = 2, c
      !$omp simd
      do i = 1, n
        pull(i, k) = by(i)*params(i, c_t)*state(i, s_slip + k - 2)
        spring(i, k) = by(i)*params(i, c_t)*params(i, own + 1)
      end do
    end do
  end subroutine springs_of_all

  !> Which contacts are sound at the end of the step, too, and slide on nothing: most of them.
  subroutine stay_sound(n, c, own, onset, params, state, u, push, sound)
    integer(c_int32_t), intent(in) :: n        !< contacts
    integer(c_int32_t), intent(in) :: c        !< components
    integer, intent(in)            :: own      !< parameters of the law; behind them the step
    procedure(cohesive_onset)      :: onset
    real(c_double), intent(in)     :: params(n, *), state(n, *)
    real(c_double), intent(in)     :: u(n, c)  !< velocities as springs leave them [m/s]
    real(c_double), intent(in)     :: push(n)  !< of the contact [N s]
    logical, intent(out)           :: sound(n)
    integer :: i
    call stay_whole(n, c, own, onset, params, state, u, sound)
    if (.not. any(push > 0)) return ! most press on nothing
    do i = 1, n
      if (push(i) > 0 .and. params(i, friction) > 0 .and. .not. params(i, power) > 0) sound(i) = .false.
    end do
  end subroutine stay_sound

  !> Which contacts are sound at the begin of the step and are not damaged by these velocities.
  subroutine stay_whole(n, c, own, onset, params, state, u, whole)
    integer(c_int32_t), intent(in) :: n        !< contacts
    integer(c_int32_t), intent(in) :: c        !< components
    integer, intent(in)            :: own      !< parameters of the law; behind them the step
    procedure(cohesive_onset)      :: onset
    real(c_double), intent(in)     :: params(n, *), state(n, *)
    real(c_double), intent(in)     :: u(n, c)  !< [m/s]
    logical, intent(out)           :: whole(n)
    real(c_double), parameter :: below = 1 - 2.0_c_double**(-40) ! that the law's own arithmetic finds no damage either
    real(c_double) :: limit(n, 2), normal, tangent(n)
    integer :: i, k
    call onset(n, params, limit)
    tangent = 0
    do k = 2, c
      !$omp simd
      do i = 1, n
        tangent(i) = tangent(i) + (state(i, s_slip + k - 2) + params(i, own + 1)*u(i, k))**2
      end do
    end do
    !$omp simd private(normal)
    do i = 1, n
      normal = max(0.0_c_double, params(i, own + 1)*u(i, 1))
      tangent(i) = merge(limit(i, 1)*normal**2 + limit(i, 2)*tangent(i), 2.0_c_double, state(i, s_beta) >= 1)
    end do
    whole = tangent <= below
  end subroutine stay_whole

  !> Velocity consistent with an impulse and a velocity that both have errors of solver and rounding. Springs that are stiff in a
  !> step open by less than these, which would count as stress and damage. So the contact is solved by itself from r and u, with
  !> bodies heavier than its own: an error of u shrinks to heavier/(W K) of it. Lighter bodies would hold a softened contact.
  subroutine settle_velocity(c, own, damage, square, p, gives, r, old, area, at, u)
    integer(c_int32_t), intent(in) :: c          !< components
    integer, intent(in)            :: own        !< parameters
    procedure(cohesive_damage)     :: damage
    logical, intent(in)            :: square
    real(c_double), intent(in)     :: p(own + 1) !< parameters, step
    real(c_double), intent(in)     :: gives      !< W_NN, 0 where nothing moves [1/kg]
    real(c_double), intent(in)     :: r(c)       !< [N s]
    real(c_double), intent(in)     :: old        !< beta at the begin of the step
    real(c_double), intent(in)     :: area       !< [m2]
    real(c_double), intent(in)     :: at(c)      !< drawn at the begin of the step, see begun_at [m]
    real(c_double), intent(inout)  :: u(c)       !< relative velocity, bias included [m/s]
    real(c_double) :: w(c, c), q(c), impulse(c)
    integer :: k
    if (gives > huge(gives) .or. .not. gives*(area*intensity(square, old)*max(p(c_n), p(c_t))*p(own + 1)**2) > heavier) return
    w = 0
    do k = 1, c
      w(k, k) = gives/heavier
      q(k) = u(k) - w(k, k)*r(k)
    end do
    call solve_contact(c, own, damage, square, p, w, q, old, area, at, impulse, u)
  end subroutine settle_velocity

  !> True if springs are so stiff that an error in velocity would count as stored energy.
  elemental logical function stiff_in_step(stiffness, mass)
    real(c_double), intent(in) :: stiffness !< of the spring in the step [kg]
    real(c_double), intent(in) :: mass      !< effective mass [kg]
    stiff_in_step = mass > 0 .and. stiffness > 1024*mass
  end function stiff_in_step

  !> True if the error of velocities at the default tolerance of 1e-4 is small beside the openings at which the spring softens.
  elemental logical function resolved_in_step(stiffness, mass)
    real(c_double), intent(in) :: stiffness !< of the spring in the step [kg]
    real(c_double), intent(in) :: mass      !< effective mass [kg]
    resolved_in_step = mass > 0 .and. stiffness <= 8192*mass
  end function resolved_in_step

  !> Slip that a zone keeps: by the actual velocity, so that the next step corrects the error of a solver; towards settle_velocity's
  !> where springs are so stiff that an impulse cannot resolve that error.
  elemental real(c_double) function slip_kept(stiffness, mass, went, settled)
    real(c_double), intent(in) :: stiffness !< of the spring in the step [kg]
    real(c_double), intent(in) :: mass      !< effective mass [kg]
    real(c_double), intent(in) :: went, settled !< slip by the velocity, and by that of settle_velocity [m]
    real(c_double), parameter  :: most = 2.0_c_double**36
    slip_kept = went
    if (stiffness > most*mass) slip_kept = settled + (most*mass/stiffness)*(went - settled)
  end function slip_kept

  !> The largest beta that its own opening allows: more adhesion opens less, so that what the opening allows grows with beta.
  subroutine solve_contact(c, own, damage, square, p, w, q, old, area, at, r, u)
    integer(c_int32_t), intent(in) :: c           !< components
    integer, intent(in)            :: own         !< parameters
    procedure(cohesive_damage)     :: damage
    logical, intent(in)            :: square
    real(c_double), intent(in)     :: p(own + 1)  !< parameters, step
    real(c_double), intent(in)     :: w(c, c)     !< [1/kg]
    real(c_double), intent(in)     :: q(c)        !< [m/s]
    real(c_double), intent(in)     :: old         !< beta at the begin of the step
    real(c_double), intent(in)     :: area        !< [m2]
    real(c_double), intent(in)     :: at(c)       !< drawn at the begin of the step, see begun_at [m]
    real(c_double), intent(out)    :: r(c)        !< [N s]
    real(c_double), intent(out)    :: u(c)        !< relative velocity, bias included [m/s]
    real(c_double) :: beta, low, high, f_low, f_high, f
    integer :: k, side
    call with_beta(c, own, square, p, w, q, old, area, at, r, u)
    if (.not. old > 0) return
    high = old
    call allowed(c, own, damage, p, u, old, at, f_high)
    f_high = f_high - old
    if (.not. f_high < 0) return
    call find_below(c, own, damage, square, p, w, q, old, area, at, high, f_high, low, f_low, r, u)
    if (.not. f_low > 0) return
    side = 0
    do k = 1, 200
      beta = (low*f_high - high*f_low)/(f_high - f_low) ! regula falsi, the end that stays halved (Illinois)
      if (.not. (beta > low .and. beta < high)) beta = low + (high - low)/2
      if (beta <= low .or. beta >= high) exit
      call with_beta(c, own, square, p, w, q, beta, area, at, r, u)
      call allowed(c, own, damage, p, u, old, at, f)
      f = f - beta
      if (f < 0) then
        high = beta
        f_high = f
        if (side < 0) f_low = f_low/2
        side = -1
      else
        low = beta
        f_low = f
        if (side > 0) f_high = f_high/2
        side = 1
      end if
      if (abs(f) <= 4*epsilon(f)*beta .or. high - low <= 2*epsilon(f)*high) exit
    end do
  end subroutine solve_contact

  !> Searches for beta downward from its value at the begin of the step. The beta that an opening allows grows with beta itself, so
  !> this passes no solution: it ends at a beta that allows more than itself, or at a fixed point (0 included) with its impulse and
  !> velocity. Under a large free velocity beta = 0 is a fixed point, too, and a contact that holds would break if the search began
  !> there.
  subroutine find_below(c, own, damage, square, p, w, q, old, area, at, above, f_above, below, f_below, r, u)
    integer(c_int32_t), intent(in) :: c           !< components
    integer, intent(in)            :: own         !< parameters
    procedure(cohesive_damage)     :: damage
    logical, intent(in)            :: square
    real(c_double), intent(in)     :: p(own + 1), w(c, c), q(c), old, area, at(c) !< as solve_contact has them
    real(c_double), intent(inout)  :: above, f_above !< beta that allows less than itself, and by how much: less than 0
    real(c_double), intent(out)    :: below, f_below !< beta that allows more, and by how much; 0: it is found
    real(c_double), intent(out)    :: r(c), u(c)     !< [N s], [m/s]
    integer, parameter :: most = 200
    real(c_double) :: beta, f, allows
    logical :: ahead
    integer :: i
    below = above
    f_below = f_above
    ahead = .false.
    do i = 1, most
      beta = max(0.0_c_double, below + f_below)
      if (ahead) beta = below + 2*f_below*(above - below)/(f_below - f_above) ! twice as far as a line through both has it
      if (i == most) ahead = .false.
      if (i == most .or. .not. beta > 0) beta = 0
      call with_beta(c, own, square, p, w, q, beta, area, at, r, u)
      call allowed(c, own, damage, p, u, old, at, allows)
      f = allows - beta
      if (.not. ahead .or. f > 0) then
        above = below
        f_above = f_below
        below = beta
        f_below = f
        if (f > 0) return
        f_below = merge(0.0_c_double, f, .not. beta > 0 .or. -f <= 4*epsilon(f)*beta)
        if (.not. f_below < 0) return
      end if
      ahead = .not. ahead .and. f_below > f_above
    end do
    f_below = 0
  end subroutine find_below

  !> The intensity that a velocity leaves.
  pure subroutine allowed(c, own, damage, p, u, old, at, beta)
    integer(c_int32_t), intent(in) :: c           !< components
    integer, intent(in)            :: own         !< parameters
    procedure(cohesive_damage)     :: damage
    real(c_double), intent(in)     :: p(own + 1)  !< parameters, step
    real(c_double), intent(in)     :: u(c)        !< relative velocity, bias included [m/s]
    real(c_double), intent(in)     :: old         !< intensity at the begin of the step, above 0
    real(c_double), intent(in)     :: at(c)       !< drawn at the begin of the step, see begun_at [m]
    real(c_double), intent(out)    :: beta        !< [-]
    real(c_double) :: h
    h = p(own + 1)
    call damage(p, h, max(0.0_c_double, at(1) + h*u(1)), length(c - 1, at(2:) + h*u(2:)), old, beta)
    if (beta < broken) beta = merge(broken, 0.0_c_double, p(own - 2) > 0)
  end subroutine allowed

  !> Impulse and velocity with beta held.
  subroutine with_beta(c, own, square, p, w, q, beta, area, at, r, u)
    integer(c_int32_t), intent(in) :: c           !< components
    integer, intent(in)            :: own         !< parameters
    logical, intent(in)            :: square
    real(c_double), intent(in)     :: p(own + 1)  !< parameters, step
    real(c_double), intent(in)     :: w(c, c)     !< [1/kg]
    real(c_double), intent(in)     :: q(c)        !< [m/s]
    real(c_double), intent(in)     :: beta        !< held
    real(c_double), intent(in)     :: area        !< [m2]
    real(c_double), intent(in)     :: at(c)       !< [m]
    real(c_double), intent(out)    :: r(c)        !< [N s]
    real(c_double), intent(out)    :: u(c)        !< [m/s]
    real(c_double) :: spring(c), pull(c), m(c, c), block(c, c), free(c), mu(1), none(1)
    integer :: k
    call springs(c, own, square, p, beta, area, at, spring, pull)
    block = w
    free = q
    if (beta > 0) then
      m = 0
      do k = 1, c
        m(:, k) = w(:, k)*spring(k)
        m(k, k) = m(k, k) + 1
        free = free - w(:, k)*pull(k)
      end do
      call eliminate(c, m, block, free)
    end if
    mu = effective_friction(p(friction), p(power), beta)
    none = 0
    r = 0
    if (c == 2) then
      call cairn_cone_full2(1, c, block, free, free, mu, none, r)
    else
      call cairn_cone_full3(1, c, block, free, free, mu, none, r)
    end if
    u = free
    do k = 1, c
      u = u + block(:, k)*r(k)
    end do
    if (beta > 0) r = r - spring*u - pull
  end subroutine with_beta

  !> r_a = -(spring u + pull).
  pure subroutine springs(c, own, square, p, beta, area, at, spring, pull)
    integer(c_int32_t), intent(in) :: c           !< components
    integer, intent(in)            :: own         !< parameters
    logical, intent(in)            :: square
    real(c_double), intent(in)     :: p(own + 1)  !< parameters, step
    real(c_double), intent(in)     :: beta        !< [-]
    real(c_double), intent(in)     :: area        !< [m2]
    real(c_double), intent(in)     :: at(c)       !< [m]
    real(c_double), intent(out)    :: spring(c)   !< [kg]
    real(c_double), intent(out)    :: pull(c)     !< [N s]
    real(c_double) :: by
    by = area*intensity(square, beta)*p(own + 1)
    spring(1) = by*p(c_n)*p(own + 1)
    spring(2:) = by*p(c_t)*p(own + 1)
    pull(1) = -crack_push(p(own - 2), p(own - 1), p(own + 1), beta, area)
    if (abs(at(1)) > 0) pull(1) = pull(1) + by*p(c_n)*at(1)
    pull(2:) = by*p(c_t)*at(2:)
  end subroutine springs

  !> b = m^-1 b, x = m^-1 x without pivots: m is 1 and a product of two matrices that are not negative.
  pure subroutine eliminate(c, m, b, x)
    integer(c_int32_t), intent(in) :: c
    real(c_double), intent(inout)  :: m(c, c), b(c, c), x(c)
    real(c_double) :: factor
    integer :: k, l
    do k = 1, c
      do l = k + 1, c
        factor = m(l, k)/m(k, k)
        m(l, k:) = m(l, k:) - factor*m(k, k:)
        b(l, :) = b(l, :) - factor*b(k, :)
        x(l) = x(l) - factor*x(k)
      end do
    end do
    do k = c, 1, -1
      do l = k + 1, c
        b(k, :) = b(k, :) - m(k, l)*b(l, :)
        x(k) = x(k) - m(k, l)*x(l)
      end do
      b(k, :) = b(k, :)/m(k, k)
      x(k) = x(k)/m(k, k)
    end do
  end subroutine eliminate

  !> Impulse of the pressure in the crack, which pushes the sides apart [N s].
  elemental real(c_double) function crack_push(pressure, exponent, h, beta, area)
    real(c_double), intent(in) :: pressure !< [Pa]
    real(c_double), intent(in) :: exponent !< [-]
    real(c_double), intent(in) :: h        !< [s]
    real(c_double), intent(in) :: beta     !< [-]
    real(c_double), intent(in) :: area     !< [m2]
    crack_push = 0
    if (pressure > 0 .and. beta < 1) crack_push = pressure*area*h*(1 - beta)**exponent
  end function crack_push

  pure real(c_double) function effective_friction(mu, exponent, beta)
    real(c_double), intent(in) :: mu       !< of broken contacts [-]
    real(c_double), intent(in) :: exponent !< [-]
    real(c_double), intent(in) :: beta     !< [-]
    effective_friction = mu
    if (.not. (beta > 0 .and. exponent > 0)) return
    if (beta >= 1) then ! most zones are sound: a power costs as much as their springs
      effective_friction = 0
    else if (exponent > 1 .or. exponent < 1) then
      effective_friction = mu*(1 - beta)**exponent
    else
      effective_friction = mu*(1 - beta)
    end if
  end function effective_friction

  pure real(c_double) function intensity(square, beta)
    logical, intent(in)        :: square
    real(c_double), intent(in) :: beta !< [-]
    intensity = merge(beta*beta, beta, square)
  end function intensity
end module cohesive_zone
