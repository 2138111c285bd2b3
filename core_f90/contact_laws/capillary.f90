!> Capillary bridges between spheres, or a sphere and a plane (Rabinovich, Esayanur & Moudgil 2005), made when two grains touch.
!> Attraction F = 4 pi R g cos(t) (1 - D/sqrt(D^2 + B)), B = V/(pi R), with the effective radius R, surface tension g, contact angle
!> t, volume V and distance D, until D reaches (1 + t/2) V^(1/3) (Lian, Thornton & Adams 1993). In touch Signorini-Coulomb.
module capillary
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use block_cones, only: solve_blocks, solve_plain, map_sliding, status_of_blocks, strip
  implicit none
  private
  public :: cairn_law_capillary_prepare, law_solve, law_residual
  public :: cairn_law_capillary_commit, cairn_law_capillary_energy, force
  character(*), parameter :: row = "capillary"
  integer, parameter :: own = 4, states = 2 !< parameters, states
  integer, parameter :: bond(0) = [integer ::] !< no state variable marks a bond
  real(c_double), parameter :: pi = acos(-1.0_c_double)
contains

  include "cone_slots.inc"

  !> Free of bias where it is open.
  subroutine cairn_law_capillary_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, 2)     !< 1 there is a bridge; distance [m]
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    integer :: i
    bias = 0
    compliance = 0
    do i = 1, n
      bias(i, 1) = max(gap(i), 0.0_c_double)/context%h
      mu(i) = params(i, 4)
      state(i, 2) = max(gap(i), 0.0_c_double)
    end do
  end subroutine cairn_law_capillary_prepare

  !> A bridge begins where grains touch at the end of the step, and breaks beyond its length.
  subroutine cairn_law_capillary_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see laws.def
    real(c_double), intent(inout)       :: state(n, 2)   !< 1 there is a bridge; distance [m]
    real(c_double) :: distance
    integer :: i
    do i = 1, n
      distance = gap(i) + context%h*u(i, 1)
      if (r(i, 1) > 0 .or. distance <= 0) state(i, 1) = 1
      if (distance > longest(params(i, :))) state(i, 1) = 0
    end do
  end subroutine cairn_law_capillary_commit

  !> Energy of the liquid's surface, relative to that of a bridge about to break. The gain when a bridge forms is released at once.
  subroutine cairn_law_capillary_energy(n, c, context, gap, u, r, params, state_begin, state, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see laws.def
    real(c_double), intent(in)          :: state_begin(n, 2), state(n, 2) !< 1 there is a bridge; distance [m]
    real(c_double), intent(out)         :: energy(n, 4)   !< see cairn/core.h [J]
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: was, now
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    do i = 1, n
      was = held(params(i, :), geometry(i, 2), state_begin(i, 1), state_begin(i, 2))
      now = held(params(i, :), geometry(i, 2), state_begin(i, 1), max(0.0_c_double, gap(i) + context%h*u(i, 1)))
      energy(i, 2) = now - was
      energy(i, 3) = 0
      energy(i, 1) = held(params(i, :), geometry(i, 2), state(i, 1), max(0.0_c_double, gap(i) + context%h*u(i, 1)))
      energy(i, 4) = now - energy(i, 1)
    end do
  end subroutine cairn_law_capillary_energy

  !> Attraction along the normal and limits of sliding, as impulses.
  pure subroutine limits(p, s, pull, mu, k)
    real(c_double), intent(in)     :: p(own + 4) !< parameters, step, area, effective radius, mass
    real(c_double), intent(in)     :: s(2)      !< state
    real(c_double), intent(out)    :: pull     !< [N s]
    real(c_double), intent(out)    :: mu, k  !< see solve_plain
    pull = 0
    if (s(1) > 0) pull = force(p, p(own + 3), s(2))*p(own + 1)
    mu = p(4)
    k = 0
  end subroutine limits

  !> [N]
  pure real(c_double) function force(p, radius, distance)
    real(c_double), intent(in) :: p(*)     !< surface tension [N/m], volume [m3], contact angle [rad]
    real(c_double), intent(in) :: radius   !< effective [m]
    real(c_double), intent(in) :: distance !< [m]
    force = 0
    if (radius > 0) force = 4*pi*radius*p(1)*cos(p(3))*(1 - distance/sqrt(distance**2 + p(2)/(pi*radius)))
  end function force

  !> Distance at which it breaks [m].
  pure real(c_double) function longest(p)
    real(c_double), intent(in) :: p(*) !< as above
    longest = (1 + p(3)/2)*p(2)**(1/3.0_c_double)
  end function longest

  !> [J]
  pure real(c_double) function held(p, radius, bridge, distance)
    real(c_double), intent(in) :: p(*)     !< as above
    real(c_double), intent(in) :: radius   !< effective [m]
    real(c_double), intent(in) :: bridge   !< above 0: there is one
    real(c_double), intent(in) :: distance !< [m]
    held = 0
    if (bridge > 0 .and. radius > 0) held = well(min(distance, longest(p))) - well(longest(p))
  contains
    pure real(c_double) function well(d)
      real(c_double), intent(in) :: d
      well = 4*pi*radius*p(1)*cos(p(3))*(d - sqrt(d**2 + p(2)/(pi*radius)))
    end function well
  end function held
end module capillary
