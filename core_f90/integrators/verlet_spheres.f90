!> Velocity Verlet for bodies in 3D that nothing but contacts and gravity moves: as velocity_verlet, four bodies at a time.
module verlet_spheres
  use, intrinsic :: iso_c_binding, only: c_int64_t, c_double
  implicit none
  private
  public :: cairn_verlet_begin_spheres, cairn_verlet_end_spheres
  integer(c_int64_t), parameter :: few = 64 !< bodies that stay in the nearest cache between two loops
contains

  !> v = v + h/2 a, x = x + h v, and the records of the spheres (smooth_spheres3) where they then are.
  pure subroutine cairn_verlet_begin_spheres(first, last, h, gravity, inverse_mass, contact_force, radius, velocity, position, &
                                             record, fastest) bind(c)
    integer(c_int64_t), value     :: first, last          !< bodies first to last - 1
    real(c_double), value         :: h                    !< step [s]
    real(c_double), intent(in)    :: gravity(3)           !< [m/s2]
    real(c_double), intent(in)    :: inverse_mass(6, 0:*) !< 0: nothing moves it [1/kg, 1/(kg m2)]
    real(c_double), intent(in)    :: contact_force(6, 0:*) !< [N, N m]
    real(c_double), intent(in)    :: radius(0:*)          !< 0 if it is no sphere [m]
    real(c_double), intent(inout) :: velocity(6, 0:*)     !< at the start; out, at the middle of the step [m/s, rad/s]
    real(c_double), intent(inout) :: position(3, 0:*)     !< [m]
    real(c_double), intent(inout) :: record(12, 0:*)
    real(c_double), intent(out)   :: fastest(2)           !< squares of the greatest velocity and spin
    real(c_double) :: r, square, spin
    integer(c_int64_t) :: i, j
    square = 0
    spin = 0
    do j = first, last - 1, few
      call kick(j, min(j + few, last), 0.5_c_double*h, gravity, inverse_mass, contact_force, velocity)
      do i = j, min(j + few, last) - 1
        r = radius(i)
        position(1, i) = position(1, i) + h*velocity(1, i)
        position(2, i) = position(2, i) + h*velocity(2, i)
        position(3, i) = position(3, i) + h*velocity(3, i)
        square = max(square, velocity(1, i)**2 + velocity(2, i)**2 + velocity(3, i)**2)
        spin = max(spin, velocity(4, i)**2 + velocity(5, i)**2 + velocity(6, i)**2)
        record(1:8, i) = [position(1, i), position(2, i), position(3, i), r, velocity(1, i), velocity(2, i), velocity(3, i), &
                          0.0_c_double]
        record(9:12, i) = [velocity(4, i), velocity(5, i), velocity(6, i), inverse_mass(1, i)]
      end do
    end do
    fastest = [square, spin]
  end subroutine cairn_verlet_begin_spheres

  !> v = v + h/2 a with the forces of the new configuration; terms of the energy if they are asked for.
  pure subroutine cairn_verlet_end_spheres(first, last, h, gravity, inverse_mass, contact_force, velocity, wrong, terms) bind(c)
    integer(c_int64_t), value        :: first, last          !< bodies first to last - 1
    real(c_double), value            :: h                    !< step [s]
    real(c_double), intent(in)       :: gravity(3)           !< [m/s2]
    real(c_double), intent(in)       :: inverse_mass(6, 0:*) !< 0: nothing moves it [1/kg, 1/(kg m2)]
    real(c_double), intent(in)       :: contact_force(6, 0:*) !< [N, N m]
    real(c_double), intent(inout)    :: velocity(6, 0:*)     !< at the middle; out, at the end of the step [m/s, rad/s]
    integer(c_int64_t), intent(inout) :: wrong               !< a body whose velocity is no finite number, if there is one
    real(c_double), intent(inout), optional :: terms(5)      !< T, dU, W_external, W_driven, D_bulk are added [J]
    real(c_double) :: lost(8)
    integer(c_int64_t) :: i, j
    integer :: k
    if (present(terms)) terms(2) = terms(2) - fallen(first, last, h, gravity, inverse_mass, velocity)
    lost = 0
    do j = first, last - 1, few
      call kick(j, min(j + few, last), 0.5_c_double*h, gravity, inverse_mass, contact_force, velocity)
      do i = j, min(j + few, last) - 4, 4
        call look_at_four(velocity(:, i:i + 3), lost)
      end do
      do i = max(j, min(j + few, last) - 3), min(j + few, last) - 1
        do k = 1, 6
          lost(k) = lost(k) + 0*velocity(k, i)
        end do
      end do
    end do
    if (.not. sum(abs(lost)) <= 0) then
      do i = first, last - 1
        if (.not. sum(velocity(:, i)**2) <= huge(h)) wrong = i
      end do
    end if
    if (present(terms)) terms(1) = terms(1) + kinetic(first, last, inverse_mass, velocity)
  end subroutine cairn_verlet_end_spheres

  !> v = v + time (f/m + g), in lines of four bodies.
  pure subroutine kick(first, last, time, gravity, inverse_mass, force, velocity)
    integer(c_int64_t), intent(in) :: first, last
    real(c_double), intent(in)     :: time, gravity(3), inverse_mass(6, 0:*), force(6, 0:*)
    real(c_double), intent(inout)  :: velocity(6, 0:*)
    real(c_double) :: weight(6), weights(24)
    integer(c_int64_t) :: i
    integer :: k
    weight = [gravity, 0.0_c_double, 0.0_c_double, 0.0_c_double]
    do k = 0, 3
      weights(6*k + 1:6*k + 6) = weight
    end do
    do i = first, last - 4, 4
      call kick_four(time, weights, inverse_mass(:, i:i + 3), force(:, i:i + 3), velocity(:, i:i + 3))
    end do
    i = last - mod(last - first, 4_c_int64_t)
    if (i < last) call kick_few(int(last - i), time, weights, inverse_mass(:, i:last - 1), force(:, i:last - 1), &
                                velocity(:, i:last - 1))
  end subroutine kick

  !> Less than four bodies go the way of four, so that no bit depends on which bodies stand beside each other.
  pure subroutine kick_few(n, time, weight, inverse_mass, force, velocity)
    integer, intent(in)           :: n !< bodies
    real(c_double), intent(in)    :: time, weight(24), inverse_mass(6, n), force(6, n)
    real(c_double), intent(inout) :: velocity(6, n)
    real(c_double) :: inverse(6, 4), push(6, 4), v(6, 4)
    inverse = 0
    push = 0
    v = 0
    inverse(:, 1:n) = inverse_mass
    push(:, 1:n) = force
    v(:, 1:n) = velocity
    call kick_four(time, weight, inverse, push, v)
    velocity = v(:, 1:n)
  end subroutine kick_few

  pure subroutine kick_four(time, weight, inverse_mass, force, velocity)
    real(c_double), intent(in)    :: time, weight(24), inverse_mass(24), force(24)
    real(c_double), intent(inout) :: velocity(24)
    integer :: k
    !$omp simd simdlen(8)
    do k = 1, 24
      velocity(k) = velocity(k) + time*(inverse_mass(k)*force(k) + merge(weight(k), 0.0_c_double, inverse_mass(k) > 0))
    end do
  end subroutine kick_four

  !> Adds 0 times each velocity: the sums are no numbers once a velocity is infinite or NaN.
  pure subroutine look_at_four(velocity, lost)
    real(c_double), intent(in)    :: velocity(24)
    real(c_double), intent(inout) :: lost(8)
    integer :: k
    !$omp simd simdlen(8)
    do k = 1, 8
      lost(k) = lost(k) + 0*(velocity(k) + velocity(k + 8) + velocity(k + 16))
    end do
  end subroutine look_at_four

  !> Work of gravity over the step [J].
  pure function fallen(first, last, h, gravity, inverse_mass, velocity) result(work)
    integer(c_int64_t), intent(in) :: first, last
    real(c_double), intent(in)     :: h, gravity(3), inverse_mass(6, 0:*), velocity(6, 0:*)
    real(c_double) :: work, part(8)
    integer(c_int64_t) :: i, j
    integer :: k
    part = 0
    do i = first, last - 1, 8
      do k = 1, int(min(8_c_int64_t, last - i))
        j = i + k - 1
        if (inverse_mass(1, j) > 0) part(k) = part(k) &
          + (gravity(1)*velocity(1, j) + gravity(2)*velocity(2, j) + gravity(3)*velocity(3, j))/inverse_mass(1, j)
      end do
    end do
    work = h*sum(part)
  end function fallen

  pure function kinetic(first, last, inverse_mass, velocity) result(energy)
    integer(c_int64_t), intent(in) :: first, last
    real(c_double), intent(in)     :: inverse_mass(6, 0:*), velocity(6, 0:*)
    real(c_double) :: energy, part(8), linear, spin
    integer(c_int64_t) :: i, j
    integer :: k
    part = 0
    do i = first, last - 1, 8
      do k = 1, int(min(8_c_int64_t, last - i))
        j = i + k - 1
        linear = velocity(1, j)**2 + velocity(2, j)**2 + velocity(3, j)**2
        spin = velocity(4, j)**2 + velocity(5, j)**2 + velocity(6, j)**2
        if (inverse_mass(1, j) > 0) part(k) = part(k) + linear/inverse_mass(1, j)
        if (inverse_mass(4, j) > 0) part(k) = part(k) + spin/inverse_mass(4, j)
      end do
    end do
    energy = 0.5_c_double*sum(part)
  end function kinetic
end module verlet_spheres
