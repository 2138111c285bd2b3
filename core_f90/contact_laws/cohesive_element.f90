!> Cohesive zones as elements of a solid (see cohesive_zone): impulses of their springs at given velocities and their derivatives,
!> for Newton's method on all bodies at once.
module cohesive_element
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use cohesive_zone, only: cohesive_damage, cohesive_onset, allowed, begun_at, springs, springs_of_all, stay_whole, &
                           effective_friction, intensity, friction, power, s_beta, s_area, s_slip, slides_behind
  implicit none
  private
  public :: cohesive_zone_element
  real(c_double), parameter :: nudge = 2.0_c_double**(-18) !< share of an opening by which differences are taken
contains

  !> Springs with the intensity that the velocity allows: r = -(spring u + pull), and the relative change of their intensity with
  !> the velocity, 0 where no more damage is done; changes are found if asked for. Contacts that stay sound, most of them, go in
  !> lanes.
  subroutine cohesive_zone_element(n, c, own, damage, onset, square, u, params, state, spring, pull, fall, mu, rise, beta)
    integer(c_int32_t), intent(in) :: n            !< contacts
    integer(c_int32_t), intent(in) :: c            !< components
    integer, intent(in)            :: own          !< parameters of the law; behind them the step
    procedure(cohesive_damage)     :: damage
    procedure(cohesive_onset)      :: onset
    logical, intent(in)            :: square       !< phi = beta^2, else beta
    real(c_double), intent(in)     :: u(n, c)      !< relative velocity, bias included [m/s]
    real(c_double), intent(in)     :: params(n, *), state(n, *)
    real(c_double), intent(out)    :: spring(n, c) !< [kg]
    real(c_double), intent(out)    :: pull(n, c)   !< [N s]
    real(c_double), intent(out), optional :: fall(n, c) !< (d phi/du)/phi [s/m]
    real(c_double), intent(out)    :: mu(n)        !< of the contact beside the springs [-]
    real(c_double), intent(out), optional :: rise(n, c) !< d mu/du [s/m]
    real(c_double), intent(out)    :: beta(n)      !< [-]
    real(c_double) :: p(own + 1), v(c), at(c), one(c), other(c), change, ahead, behind
    logical :: sound(n)
    integer :: i, k
    call springs_of_all(n, c, own, square, .false., params, state, spring, pull)
    call stay_whole(n, c, own, onset, params, state, u, sound)
    if (present(fall)) fall = 0
    if (present(rise)) rise = 0
    do i = 1, n
      if (sound(i)) then
        beta(i) = state(i, s_beta)
        mu(i) = effective_friction(params(i, friction), params(i, power), beta(i))
        cycle
      end if
      if (.not. state(i, s_beta) > 0) then
        spring(i, :) = 0
        pull(i, :) = 0
        beta(i) = 0
        mu(i) = params(i, friction)
        if (state(i, s_slip + c + slides_behind) > 0) mu(i) = min(params(i, friction), params(i, own))
        cycle
      end if
      p = params(i, 1:own + 1)
      v = u(i, :)
      call begun_at(n, c, i, .false., state, at)
      call allowed(c, own, damage, p, v, state(i, s_beta), at, beta(i))
      mu(i) = effective_friction(p(friction), p(power), beta(i))
      call springs(c, own, square, p, beta(i), state(i, s_area), at, one, other)
      spring(i, :) = one
      pull(i, :) = other
      if (.not. (present(fall) .and. present(rise) .and. beta(i) < state(i, s_beta) .and. beta(i) > 0)) cycle
      do k = 1, c
        change = nudge*maxval(abs(at + p(own + 1)*v))/p(own + 1) ! above 0: a zone that softens is open
        v(k) = u(i, k) + change
        call allowed(c, own, damage, p, v, state(i, s_beta), at, ahead)
        v(k) = u(i, k) - change
        call allowed(c, own, damage, p, v, state(i, s_beta), at, behind)
        v(k) = u(i, k)
        fall(i, k) = (intensity(square, ahead) - intensity(square, behind))/(2*change)/intensity(square, beta(i))
        rise(i, k) = (effective_friction(p(friction), p(power), ahead) - effective_friction(p(friction), p(power), behind)) &
                     /(2*change)
      end do
    end do
  end subroutine cohesive_zone_element
end module cohesive_element
