!> Error of impulses of cohesive zones (see cohesive_zone): how far they are from the law at the velocity that they leave.
module cohesive_error
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use cohesive_zone, only: cohesive_damage, cohesive_onset, allowed, begun_at, effective_friction, heavier, resolved_in_step, &
                           settle_velocity, solve_contact, springs, springs_of_all, stay_whole, friction, power, s_beta, s_area, &
                           s_slip, slides_behind
  implicit none
  private
  public :: cohesive_residual, nearer_damage
contains

  !> The natural map of r_c, of Alart & Curnier (1991), with the beta that the velocity allows; divided by what the springs add to
  !> 1/W, so that it is the change of r that would mend it. Contacts that keep the beta they had, most of them, go in lanes.
  subroutine cohesive_residual(n, c, own, damage, onset, square, plastic, whole, rho, w, u, r, params, state, f, weight, status)
    integer(c_int32_t), intent(in)  :: n            !< contacts
    integer(c_int32_t), intent(in)  :: c            !< components
    integer, intent(in)             :: own          !< parameters of the law; behind them the step
    procedure(cohesive_damage)      :: damage
    procedure(cohesive_onset)       :: onset
    logical, intent(in)             :: square, plastic
    logical, intent(in)             :: whole        !< zones are solved over all bodies at once
    real(c_double), intent(in)      :: rho(n)       !< 1/W_NN [kg]
    real(c_double), intent(in)      :: w(n, c, c)   !< Delassus blocks [1/kg]
    real(c_double), intent(in)      :: u(n, c)      !< relative velocity, bias included [m/s]
    real(c_double), intent(in)      :: r(n, c)      !< impulse [N s]
    real(c_double), intent(in)      :: params(n, *), state(n, *)
    real(c_double), intent(out)     :: f(n, c)      !< [N s]
    real(c_double), intent(out)     :: weight(n, c) !< [1/kg]
    integer(c_int32_t), intent(out) :: status(n)    !< see cairn_contact_status
    real(c_double) :: spring(n, c), pull(n, c), mu(n), p(own + 1), v(c), at(c), one(c), other(c), q(c), beta, held(c), &
                      moved(c), block(c, c)
    logical :: keeps(n)
    integer :: i
    call springs_of_all(n, c, own, square, plastic, params, state, spring, pull)
    call stay_whole(n, c, own, onset, params, state, u, keeps)
    keeps = keeps .or. .not. state(:n, s_beta) > 0
    do i = 1, n
      mu(i) = merge(0.0_c_double, params(i, friction), state(i, s_beta) > 0 .and. params(i, power) > 0)
      if (.not. state(i, s_beta) > 0 .and. state(i, s_slip + c + slides_behind) > 0) mu(i) = min(mu(i), params(i, own))
      status(i) = merge(3, 1, state(i, s_beta) > 0)
    end do
    if (.not. all(keeps)) then
      do i = 1, n
        if (keeps(i)) cycle
        p = params(i, 1:own + 1)
        v = u(i, :)
        call begun_at(n, c, i, plastic, state, at)
        call allowed(c, own, damage, p, v, state(i, s_beta), at, beta)
        if (beta < state(i, s_beta)) then
          one = r(i, :)
          moved = u(i, :)
          block = w(i, :, :) ! contiguous: the compiler would allocate a copy at each call
          q = moved - matmul(block, one)
          if (w(i, 1, 1)*maxval(spring(i, :)) > heavier) then ! as settle_velocity, but by all of W
            call solve_contact(c, own, damage, square, p, block, q, state(i, s_beta), state(i, s_area), at, other, v)
            if (whole .and. resolved_in_step(maxval(spring(i, :)), rho(i))) then
              held = moved
              call settle_velocity(c, own, damage, square, p, w(i, 1, 1), one, state(i, s_beta), state(i, s_area), at, held)
              call nearer_damage(c, own, damage, square, p, rho(i), moved, one, state(i, s_beta), state(i, s_area), at, held, v)
              held = moved
              call nearer_damage(c, own, damage, square, p, rho(i), moved, one, state(i, s_beta), state(i, s_area), at, held, v)
            end if
          end if
          call allowed(c, own, damage, p, v, state(i, s_beta), at, beta)
        end if
        call springs(c, own, square, p, beta, state(i, s_area), at, one, other)
        spring(i, :) = one
        pull(i, :) = other
        mu(i) = effective_friction(p(friction), p(power), beta)
        status(i) = merge(3, 1, beta > 0)
      end do
    end if
    call natural_map(n, c, rho, mu, spring, pull, u, r, f, weight, status)
  end subroutine cohesive_residual

  !> Chooses between two velocities by the error that their damage leaves. A zone that softens faster than its own two bodies
  !> resist has several solutions; bodies around it decide which of them is in balance.
  subroutine nearer_damage(c, own, damage, square, p, rho, u, r, old, area, at, other, v)
    integer(c_int32_t), intent(in) :: c           !< components
    integer, intent(in)            :: own         !< parameters
    procedure(cohesive_damage)     :: damage
    logical, intent(in)            :: square
    real(c_double), intent(in)     :: p(own + 1), rho, u(c), r(c), old, area, at(c) !< as cohesive_residual has them
    real(c_double), intent(in)     :: other(c)    !< [m/s]
    real(c_double), intent(inout)  :: v(c)        !< [m/s]
    real(c_double) :: spring(c), pull(c), f(c), weight(c), tried(c), beta, error(2)
    real(c_double), parameter :: surely = 2.0_c_double**(-8)
    integer(c_int32_t) :: status(1)
    integer :: k
    do k = 1, 2
      if (k == 1) tried = v
      if (k == 2) tried = other
      call allowed(c, own, damage, p, tried, old, at, beta)
      call springs(c, own, square, p, beta, area, at, spring, pull)
      status = 3
      call natural_map(1, c, [rho], [effective_friction(p(friction), p(power), beta)], spring, pull, u, r, f, weight, status)
      error(k) = sum(weight*f**2)
    end do
    if (error(2) < surely*error(1)) v = other
  end subroutine nearer_damage

  !> Natural map of Coulomb's cone for the impulse without its spring part; status of contacts that are not held.
  subroutine natural_map(n, c, rho, mu, spring, pull, u, r, f, weight, status)
    integer(c_int32_t), intent(in)    :: n            !< contacts
    integer(c_int32_t), intent(in)    :: c            !< components
    real(c_double), intent(in)        :: rho(n)       !< [kg]
    real(c_double), intent(in)        :: mu(n)        !< [-]
    real(c_double), intent(in)        :: spring(n, c) !< [kg]
    real(c_double), intent(in)        :: pull(n, c)   !< [N s]
    real(c_double), intent(in)        :: u(n, c)      !< [m/s]
    real(c_double), intent(in)        :: r(n, c)      !< [N s]
    real(c_double), intent(out)       :: f(n, c)      !< [N s]
    real(c_double), intent(out)       :: weight(n, c) !< [1/kg]
    integer(c_int32_t), intent(inout) :: status(n)    !< 3: held; others are found here
    real(c_double) :: z(n, c), limit(n), size(n), most(n)
    integer :: i, k
    do k = 1, c
      !$omp simd
      do i = 1, n
        f(i, k) = r(i, k) + spring(i, k)*u(i, k) + pull(i, k)
        z(i, k) = f(i, k) - (rho(i) + spring(i, k))*u(i, k)
        weight(i, k) = 1/rho(i)
      end do
    end do
    z(:, 1) = max(0.0_c_double, z(:, 1))
    limit = mu*z(:, 1)
    most = abs(z(:, 2))
    size = most
    if (c > 2) then
      most = max(most, abs(z(:, 3)))
      !$omp simd
      do i = 1, n
        size(i) = merge(most(i), 1.0_c_double, most(i) > 0)
        size(i) = most(i)*sqrt((z(i, 2)/size(i))**2 + (z(i, 3)/size(i))**2)
      end do
    end if
    do i = 1, n
      if (status(i) /= 3) status(i) = merge(merge(2, 1, size(i) > limit(i)), 0, z(i, 1) > 0)
      limit(i) = merge(limit(i)/merge(size(i), 1.0_c_double, size(i) > 0), 1.0_c_double, size(i) > limit(i))
    end do
    do k = 1, c
      if (k > 1) z(:, k) = limit*z(:, k)
      !$omp simd
      do i = 1, n
        f(i, k) = (f(i, k) - z(i, k))/(1 + spring(i, k)/rho(i))
      end do
    end do
  end subroutine natural_map
end module cohesive_error
