!> Common part of rods and wires (LMGC90's ELASTIC_ROD, VOIGT_ROD, ELASTIC_WIRE, VOIGT_WIRE, RIGID_WIRE, BRITTLE_ELASTIC_WIRE):
!> bodies that came in within `within` of each other, at a gap L, are joined along the normal by a force
!>   N = E A/L (g - (1 + prestrain) L) + eta/L dg/dt,   g the gap at the end of the step,
!> infinitely stiff where E A is infinite. A wire bears tension alone. If N exceeds the strength it is gone from the next step on.
!> Beside a wire, and without one, bodies obey Signorini-Coulomb.
!> Parameters: E A [N], prestrain, eta [N s], strength [N], friction, within [m].
module rods
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use block_cones, only: solve_blocks, map_blocks, status_of_blocks
  implicit none
  private
  public :: rods_prepare, rods_solve, rods_residual, rods_commit, rods_energy
  integer, parameter, public :: rod_parameters = 6
  integer, parameter :: s_held = 1, s_length = 2, s_gap = 3
contains

  subroutine rods_prepare(n, c, h, gap, params, state, bias, compliance, mu)
    integer(c_int32_t), intent(in) :: n                !< contacts
    integer(c_int32_t), intent(in) :: c                !< components
    real(c_double), intent(in)     :: h                !< step [s]
    real(c_double), intent(in)     :: gap(n)           !< [m]
    real(c_double), intent(in)     :: params(n, *)     !< see above
    real(c_double), intent(inout)  :: state(n, 3)      !< above 0: joined; length without strain, gap at detection [m]
    real(c_double), intent(out)    :: bias(n, c)       !< of the contact beside it [m/s]
    real(c_double), intent(out)    :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)    :: mu(n)            !< friction [-]
    integer :: i
    bias = 0
    compliance = 0
    do i = 1, n
      if (state(i, s_held) > 0 .and. .not. state(i, s_length) > 0) state(i, s_length) = gap(i)
      if (.not. state(i, s_length) > 0) state(i, s_held) = 0 ! nothing to strain
      state(i, s_gap) = gap(i)
      bias(i, 1) = max(gap(i), 0.0_c_double)/h
      mu(i) = params(i, 5)
    end do
  end subroutine rods_prepare

  !> N h = (u + b)/e with u the velocity of the gap: b its part that does not depend on u, e the compliance.
  pure subroutine law_of(p, h, s, b, e)
    real(c_double), intent(in)  :: p(*) !< parameters
    real(c_double), intent(in)  :: h    !< step [s]
    real(c_double), intent(in)  :: s(3) !< state
    real(c_double), intent(out) :: b    !< [m/s]
    real(c_double), intent(out) :: e    !< [1/kg]
    real(c_double) :: strained
    strained = s(s_gap) - (1 + p(2))*s(s_length)
    b = strained/h
    e = 0
    if (.not. p(1) < huge(b)) return
    b = p(1)*strained/(p(1)*h + p(3))
    e = s(s_length)/(h*(p(1)*h + p(3)))
  end subroutine law_of

  subroutine rods_solve(n, c, pushes, w, u_free, params, h, state, r, status)
    integer(c_int32_t), intent(in) :: n            !< contacts
    integer(c_int32_t), intent(in) :: c            !< components
    logical, intent(in)            :: pushes       !< a rod, else a wire
    real(c_double), intent(in)     :: w(n, c, c)   !< Delassus blocks [1/kg]
    real(c_double), intent(in)     :: u_free(n, c) !< relative velocity with r = 0 here, contact's bias included [m/s]
    real(c_double), intent(in)     :: params(n, *)
    real(c_double), intent(in)     :: h(n)         !< step [s]
    real(c_double), intent(in)     :: state(n, 3)
    real(c_double), intent(inout)  :: r(n, c)      !< impulse [N s]
    integer(c_int32_t), intent(out), optional :: status(n) !< see cairn_contact_status
    real(c_double) :: b, e, pull, mu(3), none(3), one(c)
    integer :: i
    none = 0
    do i = 1, n
      mu = [params(i, 5), 0.0_c_double, 0.0_c_double]
      if (state(i, s_held) > 0) then
        call law_of(params(i, :rod_parameters), h(i), state(i, :), b, e)
        pull = (u_free(i, 1) - max(state(i, s_gap), 0.0_c_double)/h(i) + b)/(w(i, 1, 1) + e)
        if (pushes .or. pull > 0) then
          r(i, :) = 0
          r(i, 1) = -pull
          if (present(status)) status(i) = 3
          cycle
        end if
      end if
      call solve_blocks(c, .false., w(i, :, :), u_free(i, :), mu, none, one)
      r(i, :) = one
      if (present(status)) status(i) = status_of_blocks(c, .false., mu, none, one)
    end do
  end subroutine rods_solve

  !> r_N = -(u + b)/e, divided by 1 + W/e; of a wire the greater of that and the contact's.
  subroutine rods_residual(n, c, pushes, w, u, r, params, h, state, f, weight, status)
    integer(c_int32_t), intent(in)  :: n            !< contacts
    integer(c_int32_t), intent(in)  :: c            !< components
    logical, intent(in)             :: pushes       !< a rod, else a wire
    real(c_double), intent(in)      :: w(n, c, c)   !< Delassus blocks [1/kg]
    real(c_double), intent(in)      :: u(n, c)      !< relative velocity, contact's bias included [m/s]
    real(c_double), intent(in)      :: r(n, c)      !< impulse [N s]
    real(c_double), intent(in)      :: params(n, *)
    real(c_double), intent(in)      :: h            !< step [s]
    real(c_double), intent(in)      :: state(n, 3)
    real(c_double), intent(out)     :: f(n, c)      !< [N s]
    real(c_double), intent(out)     :: weight(n, c) !< [1/kg]
    integer(c_int32_t), intent(out) :: status(n)    !< see cairn_contact_status
    real(c_double) :: b, e, pull, mu(3), none(3)
    integer :: i, k
    none = 0
    do i = 1, n
      mu = [params(i, 5), 0.0_c_double, 0.0_c_double]
      weight(i, :) = [(w(i, k, k), k=1, c)]
      if (state(i, s_held) > 0) then
        call law_of(params(i, :rod_parameters), h, state(i, :), b, e)
        ! the tension that would mend this contact, the others as they are
        pull = (u(i, 1) - w(i, 1, 1)*r(i, 1) - max(state(i, s_gap), 0.0_c_double)/h + b)/(w(i, 1, 1) + e)
        if (pushes .or. pull > 0) then
          f(i, :) = r(i, :)
          f(i, 1) = r(i, 1) + pull
          status(i) = 3
          cycle
        end if
      end if
      call map_blocks(c, .false., w(i, :, :), u(i, :), mu, none, r(i, :), f(i, :))
      status(i) = status_of_blocks(c, .false., mu, none, r(i, :))
    end do
  end subroutine rods_residual

  !> Removes rods whose tension exceeded their strength.
  subroutine rods_commit(n, c, h, r, params, state)
    integer(c_int32_t), intent(in) :: n       !< contacts
    integer(c_int32_t), intent(in) :: c       !< components
    real(c_double), intent(in)     :: h       !< step [s]
    real(c_double), intent(in)     :: r(n, c) !< impulse [N s]
    real(c_double), intent(in)     :: params(n, *)
    real(c_double), intent(inout)  :: state(n, 3)
    where (-r(:, 1) > params(:, 4)*h) state(:, s_held) = 0
  end subroutine rods_commit

  subroutine rods_energy(n, c, pushes, h, u, params, before, after, energy)
    integer(c_int32_t), intent(in) :: n            !< contacts
    integer(c_int32_t), intent(in) :: c            !< components
    logical, intent(in)            :: pushes       !< a rod, else a wire
    real(c_double), intent(in)     :: h            !< step [s]
    real(c_double), intent(in)     :: u(n, c)      !< relative velocity [m/s]
    real(c_double), intent(in)     :: params(n, *)
    real(c_double), intent(in)     :: before(n, 3), after(n, 3) !< states
    real(c_double), intent(out)    :: energy(n, 4) !< see cairn/core.h [J]
    real(c_double) :: was, now, spent
    integer :: i
    energy = 0
    do i = 1, n
      if (.not. before(i, s_held) > 0) cycle
      if (.not. params(i, 1) < huge(was)) cycle ! rigid ones store nothing
      was = held(before(i, s_gap))
      now = held(before(i, s_gap) + h*u(i, 1))
      spent = 0
      if (pushes .or. now > 0) spent = params(i, 3)/before(i, s_length)*u(i, 1)**2*h
      energy(i, 1) = merge(now, 0.0_c_double, after(i, s_held) > 0)
      energy(i, 2) = now - was + spent
      energy(i, 4) = spent + now - energy(i, 1)
    end do
  contains
    pure real(c_double) function held(gap)
      real(c_double), intent(in) :: gap !< [m]
      real(c_double) :: strained
      strained = gap - (1 + params(i, 2))*before(i, s_length)
      if (.not. pushes) strained = max(0.0_c_double, strained)
      held = params(i, 1)/before(i, s_length)*strained**2/2
    end function held
  end subroutine rods_energy
end module rods
