!> History of cohesive zones (see cohesive_zone): damage and openings, and the stored and dissipated energy of their springs.
module cohesive_history
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use cohesive_curves, only: length
  use cohesive_error, only: nearer_damage
  use cohesive_zone, only: bias_of, crack_push, intensity, cohesive_damage, resolved_in_step, settle_velocity, slip_kept, &
                           stiff_in_step, broken, c_n, c_t, friction, recovery, s_beta, s_opening, s_area, s_first, &
                           s_released, s_slip, slides_behind, missed_behind
  use dry_friction, only: friction_of, slid
  implicit none
  private
  public :: cohesive_commit, cohesive_energy, opening_velocity, note_slip
contains

  !> Velocity of the opening of zones whose bias is that of cohesive_prepare, before commit.
  subroutine opening_velocity(n, c, h, gap, u, params, state, opens)
    integer(c_int32_t), intent(in) :: n            !< contacts
    integer(c_int32_t), intent(in) :: c            !< components
    real(c_double), intent(in)     :: h            !< step [s]
    real(c_double), intent(in)     :: gap(n)       !< at detection [m]
    real(c_double), intent(in)     :: u(n, c)      !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)     :: params(n, *), state(n, *)
    real(c_double), intent(out)    :: opens(n)     !< [m/s]
    integer :: i
    do i = 1, n
      opens(i) = u(i, 1) + bias_of(gap(i), params(i, recovery), state(i, s_beta), state(i, s_first), h)
    end do
  end subroutine opening_velocity

  !> Damage, openings and slips at the end of the step; records if contacts broken at its begin slid.
  subroutine cohesive_commit(n, c, own, context, damage, square, opens, u, r, params, state)
    integer(c_int32_t), intent(in)      :: n            !< contacts
    integer(c_int32_t), intent(in)      :: c            !< components
    integer, intent(in)                 :: own          !< parameters of the law
    type(cairn_law_context), intent(in) :: context      !< step, geometry
    procedure(cohesive_damage)          :: damage
    logical, intent(in)                 :: square       !< whether springs go with beta^2
    real(c_double), intent(in)          :: opens(n)     !< see opening_velocity [m/s]
    real(c_double), intent(in)          :: u(n, c)      !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)      !< impulse [N s]
    real(c_double), intent(in)          :: params(n, *)
    real(c_double), intent(inout)       :: state(n, *)
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: p(own), h, beta, spent, slip(c - 1), bears(c - 1), opening
    logical :: stiff
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    h = context%h
    do i = 1, n
      state(i, s_slip + c - 1) = 0
      if (.not. state(i, s_beta) > 0) then
        call note_slip(n, c, own, i, geometry(i, 3), u, r, params, state)
        cycle
      end if
      p = params(i, 1:own)
      opening = max(0.0_c_double, h*opens(i))
      slip = state(i, s_slip:s_slip + c - 2) + h*u(i, 2:)
      call damage(p, h, opening, length(c - 1, slip), state(i, s_beta), beta, spent)
      bears = slip
      stiff = stiff_in_step(state(i, s_area)*intensity(square, state(i, s_beta))*max(p(c_n), p(c_t))*h**2, geometry(i, 3))
      if (beta < state(i, s_beta) .or. stiff) &
        call settle(n, c, own, i, h, geometry(i, 3), damage, square, context%over_bodies > 0, opens, u, r, params, state, &
                    opening, slip, bears, beta, spent)
      if (p(own - 2) > 0) beta = max(beta, min(broken, state(i, s_beta)))
      state(i, s_slip + c - 1) = crack_push(p(own - 2), p(own - 1), h, beta, state(i, s_area))*(u(i, 1) + state(i, s_slip + c))/2
      if (beta < broken) then
        beta = 0
        opening = 0
        slip = 0
        bears = 0
      end if
      state(i, s_beta) = beta
      state(i, s_opening) = opening
      state(i, s_released) = state(i, s_released) + state(i, s_area)*spent
      state(i, s_slip:s_slip + c - 2) = slip
      state(i, s_slip + c + missed_behind:s_slip + 2*c) = slip - bears
    end do
  end subroutine cohesive_commit

  !> Opening and damage that impulse and velocity tell together, see settle_velocity.
  subroutine settle(n, c, own, i, h, mass, damage, square, whole, opens, u, r, params, state, opening, slip, bears, beta, spent)
    integer(c_int32_t), intent(in) :: n            !< contacts
    integer(c_int32_t), intent(in) :: c            !< components
    integer, intent(in)            :: own, i       !< parameters of the law, contact
    real(c_double), intent(in)     :: h            !< step [s]
    real(c_double), intent(in)     :: mass         !< effective mass [kg]
    procedure(cohesive_damage)     :: damage
    logical, intent(in)            :: square
    logical, intent(in)            :: whole        !< zones are solved over all bodies at once
    real(c_double), intent(in)     :: opens(n)     !< [m/s]
    real(c_double), intent(in)     :: u(n, c)      !< [m/s]
    real(c_double), intent(in)     :: r(n, c)      !< [N s]
    real(c_double), intent(in)     :: params(n, *), state(n, *)
    real(c_double), intent(inout)  :: opening      !< [m]
    real(c_double), intent(inout)  :: slip(c - 1)  !< to keep [m]
    real(c_double), intent(out)    :: bears(c - 1) !< part of the slip that springs bear [m]
    real(c_double), intent(inout)  :: beta         !< [-]
    real(c_double), intent(inout)  :: spent        !< [J/m2]
    real(c_double) :: p(own + 1), at(c), impulse(c), v(c), moved(c)
    p(:own) = params(i, 1:own)
    p(own + 1) = h
    at(1) = 0
    at(2:) = state(i, s_slip:s_slip + c - 2)
    impulse = r(i, :)
    v = u(i, :)
    v(1) = opens(i)
    moved = v
    call settle_velocity(c, own, damage, square, p, 1/mass, impulse, state(i, s_beta), state(i, s_area), at, v)
    if (whole .and. resolved_in_step(state(i, s_area)*intensity(square, state(i, s_beta))*max(p(c_n), p(c_t))*h**2, mass)) &
      call nearer_damage(c, own, damage, square, p, mass, moved, impulse, state(i, s_beta), state(i, s_area), at, moved, v)
    opening = max(0.0_c_double, h*v(1))
    bears = at(2:) + h*v(2:)
    call damage(p, h, opening, length(c - 1, bears), state(i, s_beta), beta, spent)
    slip = slip_kept(state(i, s_area)*intensity(square, beta)*p(c_t)*h**2, mass, slip, bears)
  end subroutine settle

  !> Records if a contact that was broken at the begin of the step slid, for laws with a state for that.
  subroutine note_slip(n, c, own, i, mass, u, r, params, state)
    integer(c_int32_t), intent(in) :: n       !< contacts
    integer(c_int32_t), intent(in) :: c       !< components
    integer, intent(in)            :: own, i  !< parameters of the law, contact
    real(c_double), intent(in)     :: mass    !< effective mass [kg]
    real(c_double), intent(in)     :: u(n, c) !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)     :: r(n, c) !< impulse [N s]
    real(c_double), intent(in)     :: params(n, *)
    real(c_double), intent(inout)  :: state(n, *)
    real(c_double) :: impulse(c), velocity(c), mu
    integer :: slides
    if (.not. params(i, own) < params(i, friction)) return
    slides = s_slip + int(c) + slides_behind
    mu = friction_of(params(i, friction), params(i, own), state(i, slides))
    impulse = r(i, :)
    velocity = u(i, :)
    state(i, slides) = slid(c, mass, mu, impulse(1), impulse, velocity)
  end subroutine note_slip

  !> Stored energy of the springs, and the work done on them and on damage since the begin of the step.
  subroutine cohesive_energy(n, c, square, params, before, after, energy)
    integer(c_int32_t), intent(in) :: n            !< contacts
    integer(c_int32_t), intent(in) :: c            !< components
    logical, intent(in)            :: square
    real(c_double), intent(in)     :: params(n, *), before(n, *), after(n, *) !< states
    real(c_double), intent(out)    :: energy(n, 4) !< see cairn/core.h [J]
    real(c_double) :: now(2), was(2), spent, opened, slipped
    integer :: i
    do i = 1, n
      now = held(after)
      was = held(before)
      spent = after(i, s_released) - before(i, s_released)
      opened = max(now(1), was(1))
      slipped = max(now(2), was(2))
      energy(i, 1) = now(1) + now(2)
      energy(i, 2) = now(1) - was(1)
      energy(i, 3) = now(2) - was(2)
      energy(i, 4) = spent
      if (opened + slipped > 0) then
        energy(i, 2) = energy(i, 2) + spent*(opened/(opened + slipped))
        energy(i, 3) = energy(i, 3) + spent*(slipped/(opened + slipped))
      else
        energy(i, 2) = energy(i, 2) + spent
      end if
    end do
  contains
    pure function held(state) result(both)
      real(c_double), intent(in) :: state(n, *)
      real(c_double) :: both(2), by
      by = state(i, s_area)*intensity(square, state(i, s_beta))/2
      both(1) = by*params(i, c_n)*state(i, s_opening)**2
      both(2) = by*params(i, c_t)*sum((state(i, s_slip:s_slip + c - 2) - state(i, s_slip + c + missed_behind:s_slip + 2*c))**2)
    end function held
  end subroutine cohesive_energy
end module cohesive_history
