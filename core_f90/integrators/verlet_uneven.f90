!> Velocity Verlet of the spins of bodies with unequal moments of inertia: half a kick of the angular momentum, the free rotation of
!> the step, which conserves momentum and energy to rounding (see rotation.f90), and the other half.
module verlet_uneven
  use, intrinsic :: iso_c_binding, only: c_int64_t, c_double, c_int8_t
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use free_turns, only: some, turn_freely, turns_little
  use rotation, only: cairn_rotate, cairn_momentum_update
  implicit none
  private
  public :: cairn_uneven_begin, cairn_uneven_end, cairn_uneven_kinetic
contains

  !> Momentum in the middle of the step, the spin that contacts see there, and the orientation at its end. Bodies whose spin is
  !> driven turn by it.
  pure subroutine cairn_uneven_begin(n, body, h, inertia, contact_force, rotation, velocity, angular_momentum, turned, fastest, &
                                     unsolved, force, damping, driven) bind(c)
    integer(c_int64_t), value      :: n                        !< bodies
    integer(c_int64_t), intent(in) :: body(n)                  !< from 0
    real(c_double), value          :: h                        !< step [s]
    real(c_double), intent(in)     :: inertia(3, 0:*)          !< principal moments [kg m2]
    real(c_double), intent(in)     :: contact_force(6, 0:*)    !< of the last configuration [N, N m]
    real(c_double), intent(in)     :: rotation(4, 0:*)         !< unit quaternion, body to space, at the start
    real(c_double), intent(inout)  :: velocity(6, 0:*)         !< 4:6 out, spin in the middle; driven: given so [rad/s]
    real(c_double), intent(inout)  :: angular_momentum(3, 0:*) !< in space axes, out in the middle; driven: kept [N m s]
    real(c_double), intent(out)    :: turned(7, n)             !< unit quaternion at the end; spin in the middle [-, rad/s]
    real(c_double), intent(inout)  :: fastest                  !< square of the greatest spin so far [1/s2]
    integer(c_int64_t), intent(inout) :: unsolved              !< a body whose rotation did not converge; unchanged if all did
    real(c_double), intent(in), optional :: force(6, 0:*)      !< mean over the step [N, N m]
    real(c_double), intent(in), optional :: damping(0:*)       !< per unit of mass [1/s]
    integer(c_int8_t), intent(in), optional :: driven(0:*)     !< bits 3 to 5: driven spins, all or none
    real(c_double) :: torque(3)
    integer(c_int64_t) :: i, k, first, who(some)
    integer :: m
    do first = 1, n, some
      m = 0
      do k = first, min(first + some - 1, n)
        i = body(k)
        turned(1:4, k) = rotation(:, i)
        turned(5:7, k) = velocity(4:6, i)
        if (is_driven(driven, i)) cycle
        torque = contact_force(4:6, i)
        if (present(force)) torque = torque + force(4:6, i)
        if (present(damping)) torque = torque - damping(i)*angular_momentum(:, i)
        angular_momentum(:, i) = angular_momentum(:, i) + 0.5_c_double*h*torque
        fastest = max(fastest, sum((angular_momentum(:, i)/minval(inertia(:, i)))**2))
        if (turns_little(0.5_c_double*h, inertia(:, i), angular_momentum(:, i))) then
          m = m + 1
          who(m) = k
        else
          call turn_alone(i, h, inertia(:, i), angular_momentum(:, i), velocity(:, i), turned(:, k), unsolved)
        end if
      end do
      if (m > 0) call turn_together(m, who, n, body, h, inertia, angular_momentum, velocity, turned, unsolved)
    end do
  end subroutine cairn_uneven_begin

  !> Orientation at the end of the step and spin in its middle of a body that turns far in a step.
  pure subroutine turn_alone(i, h, inertia, momentum, velocity, turned, unsolved)
    integer(c_int64_t), intent(in)    :: i !< body
    real(c_double), intent(in)        :: h, inertia(3), momentum(3)
    real(c_double), intent(inout)     :: velocity(6), turned(7)
    integer(c_int64_t), intent(inout) :: unsolved
    real(c_double) :: moved(3, 1), q(4, 1), v(6, 1), old(6, 1), moments(3, 1)
    integer(c_int64_t) :: failed
    moved(:, 1) = momentum
    moments(:, 1) = inertia
    q(:, 1) = turned(1:4)
    v(:, 1) = velocity
    old = v
    call cairn_rotate(1_c_int64_t, 0.5_c_double*h, moments, v, q, moved, unsolved=failed)
    call cairn_momentum_update(1_c_int64_t, 0, moments, q, old, v, moved)
    velocity(4:6) = v(4:6, 1)
    turned(5:7) = v(4:6, 1)
    if (failed > 0) unsolved = i
    call cairn_rotate(1_c_int64_t, 0.5_c_double*h, moments, v, q, moved, unsolved=failed)
    turned(1:4) = q(:, 1)
    if (failed > 0) unsolved = i
  end subroutine turn_alone

  !> The same of those that turn little, side by side; bodies that are none fill up.
  pure subroutine turn_together(m, who, n, body, h, inertia, angular_momentum, velocity, turned, unsolved)
    integer, intent(in)               :: m
    integer(c_int64_t), intent(in)    :: who(some), n, body(n)
    real(c_double), intent(in)        :: h, inertia(3, 0:*), angular_momentum(3, 0:*)
    real(c_double), intent(inout)     :: velocity(6, 0:*), turned(7, n)
    integer(c_int64_t), intent(inout) :: unsolved
    real(c_double) :: moments(some, 3), momentum(some, 3), q(some, 4), spin(some, 3)
    integer :: j, failed(some), again(some)
    moments(m + 1:, :) = 1
    momentum(m + 1:, :) = 0
    q(m + 1:, 1) = 1
    q(m + 1:, 2:) = 0
    do j = 1, m
      moments(j, :) = inertia(:, body(who(j)))
      momentum(j, :) = angular_momentum(:, body(who(j)))
      q(j, :) = turned(1:4, who(j))
    end do
    call turn_freely(0.5_c_double*h, moments, momentum, q, spin, failed)
    call turn_freely(0.5_c_double*h, moments, momentum, q, spin, again)
    do j = 1, m
      turned(1:4, who(j)) = q(j, :)
      turned(5:7, who(j)) = spin(j, :)
      velocity(4:6, body(who(j))) = spin(j, :)
      if (failed(j) + again(j) > 0) unsolved = body(who(j))
    end do
  end subroutine turn_together

  !> Momentum and spin at the end of the step; terms of the energy if they are asked for.
  pure subroutine cairn_uneven_end(n, body, h, inertia, contact_force, rotation, turned, velocity, angular_momentum, wrong, &
                                   force, damping, driven, reaction, terms) bind(c)
    integer(c_int64_t), value      :: n                        !< bodies
    integer(c_int64_t), intent(in) :: body(n)                  !< from 0
    real(c_double), value          :: h                        !< step [s]
    real(c_double), intent(in)     :: inertia(3, 0:*)          !< principal moments [kg m2]
    real(c_double), intent(in)     :: contact_force(6, 0:*)    !< of the new configuration [N, N m]
    real(c_double), intent(in)     :: rotation(4, 0:*)         !< unit quaternion, body to space
    real(c_double), intent(in)     :: turned(7, n)             !< 5:7 spin in the middle [rad/s]
    real(c_double), intent(inout)  :: velocity(6, 0:*)         !< 4:6 out, spin at the end; driven: given so [rad/s]
    real(c_double), intent(inout)  :: angular_momentum(3, 0:*) !< in the middle; out, at the end [N m s]
    integer(c_int64_t), intent(inout) :: wrong                 !< a body whose spin is no finite number, if there is one
    real(c_double), intent(in), optional :: force(6, 0:*)      !< mean over the step [N, N m]
    real(c_double), intent(in), optional :: damping(0:*)       !< per unit of mass [1/s]
    integer(c_int8_t), intent(in), optional :: driven(0:*)     !< bits 3 to 5: driven spins, all or none
    real(c_double), intent(inout), optional :: reaction(6, 0:*) !< 4:6: the change of the momentum is added [N m s]
    real(c_double), intent(inout), optional :: terms(5)        !< T, dU, W_external, W_driven, D_bulk are added [J]
    real(c_double) :: torque(3), v(6, 1), old(6, 1), q(4, 1), moments(3, 1), momentum(3, 1), before(3), part(5)
    integer(c_int64_t) :: i, k
    logical :: held
    part = 0
    do k = 1, n
      i = body(k)
      held = is_driven(driven, i)
      before = angular_momentum(:, i)
      v(:, 1) = velocity(:, i)
      old = v
      q(:, 1) = rotation(:, i)
      moments(:, 1) = inertia(:, i)
      momentum(:, 1) = before
      if (held) then
        call cairn_momentum_update(1_c_int64_t, 2, moments, q, old, v, momentum)
        if (present(reaction)) reaction(4:6, i) = reaction(4:6, i) + momentum(:, 1) - before
        part(4) = part(4) + dot_product(momentum(:, 1) - before, turned(5:7, k))
      else
        torque = contact_force(4:6, i)
        if (present(force)) torque = torque + force(4:6, i)
        momentum(:, 1) = before + 0.5_c_double*h*torque
        if (present(damping)) then
          momentum = momentum/(1 + 0.5_c_double*h*damping(i))
          part(5) = part(5) + damping(i)*h*dot_product(before, turned(5:7, k))
        end if
        if (present(force)) part(3) = part(3) + h*dot_product(force(4:6, i), turned(5:7, k))
        call cairn_momentum_update(1_c_int64_t, 0, moments, q, old, v, momentum)
      end if
      angular_momentum(:, i) = momentum(:, 1)
      velocity(4:6, i) = v(4:6, 1)
      part(1) = part(1) + 0.5_c_double*dot_product(v(4:6, 1), momentum(:, 1))
      if (.not. all(ieee_is_finite(v(4:6, 1)))) wrong = i
    end do
    if (present(terms)) terms = terms + part
  end subroutine cairn_uneven_end

  !> Kinetic energy of their spins.
  pure function cairn_uneven_kinetic(n, body, velocity, angular_momentum) result(energy) bind(c)
    integer(c_int64_t), value      :: n                        !< bodies
    integer(c_int64_t), intent(in) :: body(n)                  !< from 0
    real(c_double), intent(in)     :: velocity(6, 0:*)         !< spin in 4:6 [rad/s]
    real(c_double), intent(in)     :: angular_momentum(3, 0:*) !< in space axes [N m s]
    real(c_double) :: energy                                   !< [J]
    integer(c_int64_t) :: k
    energy = 0
    do k = 1, n
      energy = energy + 0.5_c_double*dot_product(velocity(4:6, body(k)), angular_momentum(:, body(k)))
    end do
  end function cairn_uneven_kinetic

  pure logical function is_driven(driven, i)
    integer(c_int8_t), intent(in), optional :: driven(0:*)
    integer(c_int64_t), intent(in) :: i
    is_driven = .false.
    if (present(driven)) is_driven = iand(int(driven(i)), 56) /= 0
  end function is_driven
end module verlet_uneven
