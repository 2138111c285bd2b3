!> Composite interface of masonry joints (Lourenco & Rots 1997, J. Eng. Mech. 123(7)): elastic up to a tension cut-off, Coulomb's
!> friction with cohesion, and an elliptic cap of compression,
!>   s <= f_t e^-x,   |t| <= c e^-x - s tan(phi(x)),   s^2 + C_ss t^2 <= f(k)^2   (s > 0: tension),
!> with plastic displacements along the normal of the surface for tension and cap, at the angle of dilatancy for friction.
!> Softening x: dx = f_t/G_I of the opening, c/G_II of the slip, so that pure modes take G_I and G_II; tan(phi) goes to its residual
!> value with 1 - e^-x. Hardening of the cap by the plastic displacement k under it: from f_m/3 as a parabola to f_m at the peak,
!> then a parabola to f_m/2 and an exponential to f_m/10, with G_c under these two above the last.
!> The elastic part is a compliance 1/(h^2 K S), so the step poses plastic velocities y = q + C r against these limits: r_N is the
!> root of a scalar function, the tangential impulse that of a disk in the metric of C, x and k those that their own flow gives.
!> A crack closes without stress before the joint is pressed (closes = 0: it stays open, as in the plasticity of the paper).
!> Once x is 40 log 2 the bond is broken: a contact where detection finds it, by the same law without tension and cohesion.
!> Parameters: stiffnesses [Pa/m], tension, cohesion [Pa], works G_I and G_II [J/m2], friction and residual friction [-],
!> cap f_m [Pa],
!> its work G_c [J/m2], C_ss [-], displacement of the peak [m], dilatancy [-], closes, within [m].
module composite_interface
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use block_cones, only: solve_blocks, status_of_blocks
  use cap_return, only: cap_limits, cap_flow, solve_limits
  implicit none
  private
  public :: cairn_law_composite_interface_prepare, law_solve, law_residual
  public :: cairn_law_composite_interface_commit, cairn_law_composite_interface_energy
  character(*), parameter :: row = "composite_interface"
  integer, parameter :: own = 15 !< parameters
  integer, parameter :: states(2:3) = [11, 12]
  integer, parameter :: k_n = 1, k_t = 2, f_t = 3, coh = 4, g_1 = 5, g_2 = 6, phi = 7, phi_r = 8, cap = 9, g_c = 10, c_ss = 11, &
                        top = 12, dil = 13, closes = 14
  integer, parameter :: s_beta = 1, s_area = 2, s_first = 3, s_released = 4, s_crushed = 5, s_crack = 6, s_set = 7, &
                        s_normal = 8, s_shear = 9, s_spent = 10, s_drawn = 11
  real(c_double), parameter :: most = 40*log(2.0_c_double)   !< softening at which it is broken
  real(c_double), parameter :: heavier = 64                  !< see settled in commit
  real(c_double), parameter :: stiffest = 2.0_c_double**36   !< over the mass: velocities tell no stress beyond
  integer, parameter :: tries = 100
contains

  include "own_solution_slots.inc"

  !> The opening counts from the gap at the start, plastic displacements taken off.
  subroutine cairn_law_composite_interface_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see above
    real(c_double), intent(inout)       :: state(n, states(c)) !< intact share e^-x; area [m2]; first gap [m]; released [J]; k [m];
    !< width of the crack [m]; other plastic opening [m]; stored along normal and tangents [J]; released along the normal in the
    !< last step [J]; elastic slip [m]
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< residual friction [-]
    real(c_double), pointer, contiguous :: geometry(:, :)
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    do i = 1, n
      if (.not. state(i, s_area) > 0) then
        state(i, s_area) = max(0.0_c_double, geometry(i, 1))
        state(i, s_first) = gap(i)
        if (.not. state(i, s_beta) > 0) state(i, s_first) = min(gap(i), 0.0_c_double)
        if (.not. state(i, s_area) > 0) state(i, s_beta) = 0 ! a corner has no area
      end if
      call elastic(n, c, i, context%h, gap(i), params, state, bias, compliance)
      mu(i) = params(i, phi_r)
    end do
  end subroutine cairn_law_composite_interface_prepare

  !> Bias and compliance of one contact. Without area it is rigid.
  pure subroutine elastic(n, c, i, h, gap, params, state, bias, compliance)
    integer(c_int32_t), intent(in) :: n         !< contacts
    integer(c_int32_t), intent(in) :: c         !< components
    integer, intent(in)            :: i         !< contact
    real(c_double), intent(in)     :: h         !< [s]
    real(c_double), intent(in)     :: gap       !< [m]
    real(c_double), intent(in)     :: params(n, own), state(n, states(c)) !< see prepare
    real(c_double), intent(inout)  :: bias(n, c), compliance(n, c)
    bias(i, :) = 0
    compliance(i, :) = 0
    if (.not. state(i, s_area) > 0) then
      bias(i, 1) = max(gap, 0.0_c_double)/h
      return
    end if
    bias(i, 1) = (gap - state(i, s_first) - state(i, s_crack) - state(i, s_set))/h
    bias(i, 2:) = state(i, s_drawn:)/h
    compliance(i, 1) = gives(params(i, k_n), state(i, s_area), h)
    compliance(i, 2:) = gives(params(i, k_t), state(i, s_area), h)
  end subroutine elastic

  !> 1/(h^2 K S); an infinite stiffness is the largest number here.
  pure real(c_double) function gives(k, area, h)
    real(c_double), intent(in) :: k, area, h !< [Pa/m], [m2], [s]
    gives = 0
    if (k < huge(k)) gives = 1/(k*area*h*h)
  end function gives

  !> Impulse of one contact, for the slots of own_solution_slots.inc.
  subroutine one_contact(c, w, q, p, s, r, status)
    integer(c_int32_t), intent(in)  :: c            !< components
    real(c_double), intent(in)      :: w(c, c)      !< Delassus block, compliance included [1/kg]
    real(c_double), intent(in)      :: q(c)         !< velocity with r = 0, bias included [m/s]
    real(c_double), intent(in)      :: p(own + 4)   !< parameters; step, geometry
    real(c_double), intent(in)      :: s(states(c)) !< state
    real(c_double), intent(out)     :: r(c)         !< [N s]
    integer(c_int32_t), intent(out) :: status       !< see cairn_contact_status
    type(cap_flow) :: flow
    real(c_double) :: x, k, mu(3), none(3)
    if (.not. s(s_area) > 0) then
      mu = [p(phi_r), 0.0_c_double, 0.0_c_double]
      none = 0
      call solve_blocks(c, .false., w, q, mu, none, r)
      status = status_of_blocks(c, .false., mu, none, r)
      return
    end if
    call flowing(c, w, q, p, s, r, flow, x, k)
    status = 3
    if (flow%slip > 0 .or. flow%opens > 0 .or. flow%crush > 0) status = 4
    if (s(s_beta) > 0) return
    status = merge(2, 1, flow%slip > 0)
    if (.not. r(1) > 0) status = 0
  end subroutine one_contact

  !> Impulse, plastic flow, and the softening that this flow itself gives: k inside of x, each the first from its value at the begin
  !> of the step upwards.
  subroutine flowing(c, w, q, p, s, r, flow, x, k)
    integer(c_int32_t), intent(in) :: c            !< components
    real(c_double), intent(in)     :: w(c, c)      !< [1/kg]
    real(c_double), intent(in)     :: q(c)         !< [m/s]
    real(c_double), intent(in)     :: p(own + 4)   !< parameters; step, geometry
    real(c_double), intent(in)     :: s(states(c)) !< state
    real(c_double), intent(out)    :: r(c)         !< [N s]
    type(cap_flow), intent(out)    :: flow
    real(c_double), intent(out)    :: x            !< softening at the end of the step [-]
    real(c_double), intent(out)    :: k            !< plastic displacement under the cap at its end [m]
    real(c_double) :: begun, h, f, z, inner, rate, rounded, low(2, 2), high(2, 2)
    integer :: i, j, side(2)
    logical :: more, deeper
    h = p(own + 1)
    begun = most
    if (s(s_beta) > 0) begun = min(most, -log(min(1.0_c_double, s(s_beta))))
    x = begun
    low = -1
    high = -1
    side = 0
    do i = 1, tries
      z = sqrt(s(s_crushed))
      low(:, 2) = -1
      high(:, 2) = -1
      side(2) = 0
      do j = 1, tries
        k = s(s_crushed)
        if (j > 1) k = z*z
        call solve_limits(c, w, q, limits_at(p, s, x, k), r, flow)
        inner = sqrt(s(s_crushed) + h*flow%crush) - z ! by roots, in which the cap begins to harden as a line
        rounded = 16*epsilon(h)*(maxval(abs(q)) + maxval(w)*maxval(abs(r)))
        call climb(z, inner, huge(z), h*rounded/max(2*z, sqrt(h*rounded), tiny(z)), low(:, 2), high(:, 2), side(2), deeper)
        if (.not. deeper) exit
      end do
      f = 0
      rate = 0
      if (flow%opens > 0 .and. p(f_t) > 0) rate = p(f_t)/p(g_1)
      if (flow%opens > 0 .and. p(f_t) > 0) f = rate*(h*flow%opens)
      if (flow%slip > 0 .and. p(coh) > 0) then
        f = f + (p(coh)/p(g_2))*(h*flow%slip)
        rate = max(rate, p(coh)/p(g_2))
      end if
      f = min(most, begun + f) - x
      call climb(x, f, most, rate*(h*rounded), low(:, 1), high(:, 1), side(1), more)
      if (.not. more) return
    end do
  end subroutine flowing

  !> Next value of a search upwards for the first value that reproduces itself: by the line through the last two, at most four times
  !> as far as the flow asks; between values of both signs by regula falsi, the end that stays halved (Illinois).
  pure subroutine climb(x, f, last, rounded, low, high, side, more)
    real(c_double), intent(inout) :: x       !< tried, then next
    real(c_double), intent(in)    :: f       !< by how much it gives more than itself
    real(c_double), intent(in)    :: last    !< largest value
    real(c_double), intent(in)    :: rounded !< error of f
    real(c_double), intent(inout) :: low(2), high(2) !< values that give more, less, and by how much; -1: none yet
    integer, intent(inout)        :: side    !< -1, 1: which of them came last, between both; 0: none
    logical, intent(out)          :: more    !< x is to be tried
    real(c_double) :: next, before(2)
    more = .false.
    if (abs(f) <= max(8*epsilon(f)*x, rounded) .or. (f >= 0 .and. x >= last)) return
    before = low
    if (f > 0) then
      if (side < 0) high(2) = high(2)/2
      low = [x, f]
      if (high(1) >= 0) side = -1
    else
      if (.not. low(1) >= 0) return ! flow less than none
      if (side > 0) low(2) = low(2)/2
      if (high(1) >= 0) side = 1
      high = [x, f]
    end if
    if (high(1) >= 0) then
      next = (low(1)*high(2) - high(1)*low(2))/(high(2) - low(2))
      if (.not. (next > low(1) .and. next < high(1))) next = low(1) + (high(1) - low(1))/2
      more = next > low(1) .and. next < high(1) .and. high(1) - low(1) > 4*epsilon(f)*high(1)
    else
      next = x + f
      if (before(1) >= 0 .and. before(2) > f) next = x + f*max(1.0_c_double, min(4.0_c_double, (x - before(1))/(before(2) - f)))
      next = min(next, last)
      more = next > x
    end if
    if (more) x = next
  end subroutine climb

  !> Limits of a step as impulses.
  pure type(cap_limits) function limits_at(p, s, x, k) result(limit)
    real(c_double), intent(in) :: p(own + 4) !< parameters; step, geometry
    real(c_double), intent(in) :: s(*)       !< state
    real(c_double), intent(in) :: x, k       !< softening [-], plastic displacement under the cap [m]
    real(c_double) :: intact, unit
    intact = 0
    if (x < most) intact = exp(-x)
    unit = s(s_area)*p(own + 1)
    limit%cohesion = p(coh)*intact*unit
    limit%friction = p(phi) + (p(phi_r) - p(phi))*(1 - intact)
    limit%tension = p(f_t)*intact*unit
    if (limit%friction > 0) limit%tension = min(limit%tension, limit%cohesion/limit%friction) ! where the cone has its tip
    limit%cap = huge(limit%cap)
    if (p(cap) < huge(p)) limit%cap = strength(p(cap), p(g_c), p(top), k)*unit
    limit%shear = p(c_ss)
    limit%dilatancy = p(dil)*intact
    limit%crack = 0
    if (p(closes) > 0) limit%crack = s(s_crack)/p(own + 1)
  end function limits_at

  !> Compressive strength after a plastic displacement (Lourenco & Rots 1997).
  pure real(c_double) function strength(f, work, peak, k)
    real(c_double), intent(in) :: f    !< at the peak [Pa]
    real(c_double), intent(in) :: work !< after the peak, above a tenth of f [J/m2]
    real(c_double), intent(in) :: peak !< [m]
    real(c_double), intent(in) :: k    !< [m]
    real(c_double) :: half, a
    if (k < peak) then
      a = k/peak
      strength = f/3 + (2*f/3)*sqrt(a*(2 - a))
      return
    end if
    half = (75.0_c_double/67)*(work/f) ! from the peak to f/2: 5/6 - 1/10 of f under the parabola, 4/25 under the rest
    a = (k - peak)/half
    strength = f*(1 - a*a/2)
    if (a > 1) strength = f/10 + (2*f/5)*exp(-5*(a - 1)/2)
  end function strength

  !> Plastic displacements, softening, and energies at the end of the step.
  subroutine cairn_law_composite_interface_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see above
    real(c_double), intent(inout)       :: state(n, states(c)) !< see prepare
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: bias(n, c), compliance(n, c), p(own + 4), s(states(c)), w(c, c), q(c), settled(c), h, x, k, moves, stiff
    type(cap_flow) :: flow
    integer :: i, l
    logical :: gives_way
    call c_f_pointer(context%geometry, geometry, [n, 3])
    h = context%h
    do i = 1, n
      if (.not. state(i, s_area) > 0) cycle
      call elastic(n, c, i, h, gap(i), params, state, bias, compliance)
      p(:own) = params(i, :)
      p(own + 1:) = [h, geometry(i, :)]
      s = state(i, :)
      ! An impulse and a velocity with the errors of a solver: the contact is solved by itself from both, beside bodies heavier than
      ! its own where springs are stiff in a step; an error of u shrinks to heavier/(W K) of it
      moves = 0
      if (geometry(i, 3) > 0 .and. geometry(i, 3) <= huge(h)) moves = 1/geometry(i, 3)
      stiff = maxval(compliance(i, :))
      w = 0
      if (moves > heavier*minval(compliance(i, :))) then
        do l = 1, c
          w(l, l) = moves/heavier
        end do
      end if
      q = u(i, :) + bias(i, :) - matmul(w, r(i, :))
      gives_way = .true.
      do l = 1, c
        w(l, l) = w(l, l) + compliance(i, l)
        gives_way = gives_way .and. w(l, l) > 0
      end do
      if (.not. gives_way) cycle
      call flowing(c, w, q, p, s, settled, flow, x, k)
      state(i, s_beta) = 0
      if (s(s_beta) > 0 .and. x < most) state(i, s_beta) = exp(-x)
      state(i, s_crushed) = k
      state(i, s_crack) = max(0.0_c_double, s(s_crack) + h*(flow%opens - flow%shuts))
      state(i, s_set) = s(s_set) + h*flow%other
      if (.not. state(i, s_beta) > 0) state(i, s_crack) = 0
      state(i, s_spent) = flow%normal_power
      state(i, s_released) = s(s_released) + flow%normal_power + flow%shear_power
      state(i, s_normal) = compliance(i, 1)*settled(1)**2/2
      state(i, s_shear) = compliance(i, 2)*sum(settled(2:)**2)/2
      state(i, s_drawn:) = s(s_drawn:) + h*(u(i, 2:) - flow%slips(:c - 1))
      if (moves > stiffest*stiff) state(i, s_drawn:) = -h*compliance(i, 2:)*settled(2:)
    end do
  end subroutine cairn_law_composite_interface_commit

  !> Energy of the elastic part; released: the work of tension, cohesion and cap. Friction is what the balance finds beside these.
  subroutine cairn_law_composite_interface_energy(n, c, context, gap, u, r, params, state_begin, state, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see above
    real(c_double), intent(in)          :: state_begin(n, states(c)), state(n, states(c)) !< see prepare
    real(c_double), intent(out)         :: energy(n, 4)   !< see cairn/core.h [J]
    real(c_double) :: spent
    integer :: i
    do i = 1, n
      spent = state(i, s_released) - state_begin(i, s_released)
      energy(i, 1) = state(i, s_normal) + state(i, s_shear)
      energy(i, 2) = state(i, s_normal) - state_begin(i, s_normal) + state(i, s_spent)
      energy(i, 3) = state(i, s_shear) - state_begin(i, s_shear) + (spent - state(i, s_spent))
      energy(i, 4) = spent
    end do
  end subroutine cairn_law_composite_interface_energy
end module composite_interface
