!> Free rotation of bodies with unequal moments of inertia, many side by side, by the midpoint rule of Simo & Wong (1991) that
!> rotation.f90 has for one after the other. What becomes of a body does not depend on those beside it.
module free_turns
  use, intrinsic :: iso_c_binding, only: c_double
  implicit none
  private
  public :: turn_freely, turns_little
  integer, parameter, public :: some = 32 !< bodies that turn side by side
contains

  !> True if a body turns by less than one radian, for which the midpoint rule takes a single step.
  pure logical function turns_little(time, inertia, momentum)
    real(c_double), intent(in) :: time        !< [s]
    real(c_double), intent(in) :: inertia(3)  !< principal moments [kg m2]
    real(c_double), intent(in) :: momentum(3) !< angular, in any axes [N m s]
    turns_little = 2*abs(time)*maxval(abs(momentum)) < minval(inertia) ! a vector is at most sqrt(3) times its largest component
  end function turns_little

  !> Orientations after a time, and the spins before it. Momenta stay, energies to rounding.
  pure subroutine turn_freely(time, inertia, momentum, q, spin, unsolved)
    real(c_double), intent(in)    :: time              !< [s]
    real(c_double), intent(in)    :: inertia(some, 3)  !< principal moments [kg m2]
    real(c_double), intent(in)    :: momentum(some, 3) !< angular, in space axes [N m s]
    real(c_double), intent(inout) :: q(some, 4)        !< unit quaternions, body to space
    real(c_double), intent(out)   :: spin(some, 3)     !< at the start, in space axes [rad/s]
    integer, intent(out)          :: unsolved(some)    !< 1: the midpoint rule found no solution, and the orientation stays
    real(c_double) :: own(some, 3), mean(some, 3)
    call spins_of(inertia, momentum, q, own, spin)
    call solve_midpoints(time, inertia, own, mean, unsolved)
    call turn(time, mean, unsolved, q)
  end subroutine turn_freely

  !> Spins in the axes of the bodies and in those of space.
  pure subroutine spins_of(inertia, momentum, q, own, spin)
    real(c_double), intent(in)  :: inertia(some, 3), momentum(some, 3), q(some, 4)
    real(c_double), intent(out) :: own(some, 3), spin(some, 3)
    real(c_double) :: r(3, 3), x, y, z
    integer :: i
    !$omp simd private(r, x, y, z)
    do i = 1, some
      r(1, 1) = 1 - 2*(q(i, 3)**2 + q(i, 4)**2)
      r(2, 1) = 2*(q(i, 2)*q(i, 3) + q(i, 1)*q(i, 4))
      r(3, 1) = 2*(q(i, 2)*q(i, 4) - q(i, 1)*q(i, 3))
      r(1, 2) = 2*(q(i, 2)*q(i, 3) - q(i, 1)*q(i, 4))
      r(2, 2) = 1 - 2*(q(i, 2)**2 + q(i, 4)**2)
      r(3, 2) = 2*(q(i, 3)*q(i, 4) + q(i, 1)*q(i, 2))
      r(1, 3) = 2*(q(i, 2)*q(i, 4) + q(i, 1)*q(i, 3))
      r(2, 3) = 2*(q(i, 3)*q(i, 4) - q(i, 1)*q(i, 2))
      r(3, 3) = 1 - 2*(q(i, 2)**2 + q(i, 3)**2)
      x = (r(1, 1)*momentum(i, 1) + r(2, 1)*momentum(i, 2) + r(3, 1)*momentum(i, 3))/inertia(i, 1)
      y = (r(1, 2)*momentum(i, 1) + r(2, 2)*momentum(i, 2) + r(3, 2)*momentum(i, 3))/inertia(i, 2)
      z = (r(1, 3)*momentum(i, 1) + r(2, 3)*momentum(i, 2) + r(3, 3)*momentum(i, 3))/inertia(i, 3)
      spin(i, 1) = r(1, 1)*x + r(1, 2)*y + r(1, 3)*z
      spin(i, 2) = r(2, 1)*x + r(2, 2)*y + r(2, 3)*z
      spin(i, 3) = r(3, 1)*x + r(3, 2)*y + r(3, 3)*z
      own(i, 1) = x; own(i, 2) = y; own(i, 3) = z
    end do
  end subroutine spins_of

  !> Mean spins S of S - W + time/2 J^-1 (S x J S) = 0 in the axes of the bodies, by Newton's method until each one stands still.
  pure subroutine solve_midpoints(time, inertia, spin, mean, unsolved)
    real(c_double), intent(in)  :: time, inertia(some, 3), spin(some, 3)
    real(c_double), intent(out) :: mean(some, 3)
    integer, intent(out)        :: unsolved(some)
    real(c_double) :: c(some, 3), size(some), step(some), going(some)
    real(c_double) :: a, b, d, e, f, g, r1, r2, r3, x1, x2, x3, over
    integer :: i, k
    !$omp simd
    do i = 1, some
      c(i, 1) = 0.5_c_double*time*(inertia(i, 3) - inertia(i, 2))/inertia(i, 1)
      c(i, 2) = 0.5_c_double*time*(inertia(i, 1) - inertia(i, 3))/inertia(i, 2)
      c(i, 3) = 0.5_c_double*time*(inertia(i, 2) - inertia(i, 1))/inertia(i, 3)
      size(i) = max(abs(spin(i, 1)), abs(spin(i, 2)), abs(spin(i, 3)))
      going(i) = 1
      step(i) = 0
    end do
    mean = spin
    do k = 1, 30
      !$omp simd private(a, b, d, e, f, g, r1, r2, r3, x1, x2, x3, over)
      do i = 1, some
        a = c(i, 1)*mean(i, 3); b = c(i, 1)*mean(i, 2) ! Jacobian: 1 a b, d 1 e, f g 1
        d = c(i, 2)*mean(i, 3); e = c(i, 2)*mean(i, 1)
        f = c(i, 3)*mean(i, 2); g = c(i, 3)*mean(i, 1)
        r1 = mean(i, 1) - spin(i, 1) + a*mean(i, 2)
        r2 = mean(i, 2) - spin(i, 2) + d*mean(i, 1)
        r3 = mean(i, 3) - spin(i, 3) + f*mean(i, 1)
        over = going(i)/((1 - e*g) - a*(d - e*f) + b*(d*g - f))
        x1 = over*(r1*(1 - e*g) - a*(r2 - e*r3) + b*(r2*g - r3))
        x2 = over*((r2 - e*r3) - r1*(d - e*f) + b*(d*r3 - r2*f))
        x3 = over*((r3 - r2*g) - a*(d*r3 - r2*f) + r1*(d*g - f))
        mean(i, 1) = mean(i, 1) - x1
        mean(i, 2) = mean(i, 2) - x2
        mean(i, 3) = mean(i, 3) - x3
        step(i) = merge(max(abs(x1), abs(x2), abs(x3)), step(i), going(i) > 0)
        going(i) = merge(0.0_c_double, going(i), step(i) <= 4*epsilon(size)*size(i))
      end do
      if (.not. any(going > 0)) exit
    end do
    do i = 1, some
      unsolved(i) = merge(0, 1, step(i) <= sqrt(epsilon(size))*size(i))
    end do
  end subroutine solve_midpoints

  !> Quaternions times the Cayley map of half of what the mean spins turn in the time.
  pure subroutine turn(time, mean, unsolved, q)
    real(c_double), intent(in)    :: time, mean(some, 3)
    integer, intent(in)           :: unsolved(some)
    real(c_double), intent(inout) :: q(some, 4)
    real(c_double) :: x, y, z, p(4), over
    integer :: i, k
    !$omp simd private(x, y, z, p, over)
    do i = 1, some
      x = 0.5_c_double*time*mean(i, 1)
      y = 0.5_c_double*time*mean(i, 2)
      z = 0.5_c_double*time*mean(i, 3)
      p(1) = q(i, 1) - (q(i, 2)*x + q(i, 3)*y + q(i, 4)*z)
      p(2) = q(i, 2) + q(i, 1)*x + (q(i, 3)*z - q(i, 4)*y)
      p(3) = q(i, 3) + q(i, 1)*y + (q(i, 4)*x - q(i, 2)*z)
      p(4) = q(i, 4) + q(i, 1)*z + (q(i, 2)*y - q(i, 3)*x)
      over = 1/sqrt(p(1)**2 + p(2)**2 + p(3)**2 + p(4)**2) ! of a unit quaternion and a short way: within the range of squares
      do k = 1, 4
        q(i, k) = merge(q(i, k), over*p(k), unsolved(i) /= 0)
      end do
    end do
  end subroutine turn
end module free_turns
