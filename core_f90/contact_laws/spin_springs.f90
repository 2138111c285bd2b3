!> Resistance of smooth contacts to rolling and twisting: a spring, a dashpot and a slider on relative spins, or a constant torque;
!> and to slip, with the energy of the spring remembered.
module spin_springs
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use spring_slider, only: slide
  implicit none
  private
  public :: roll, constant_torque, slide_by_the_books
contains

  !> Elastic-plastic spring and dashpot (Ai, Chen, Rotter & Ooi 2011, model C): M = -k theta - c w within the limit; beyond it the
  !> spring gives way and the dashpot gives nothing. Both stay within the limit, too: a dashpot alone would exceed it many times
  !> over where a load that swings lets the spring of a fast roll go. One component (twist, or rolling in 2D) or two.
  pure subroutine roll(n, c, h, k, damping, limit, w, spring, moment, stored, spent)
    integer(c_int32_t), intent(in) :: n             !< contacts
    integer(c_int32_t), intent(in) :: c             !< components: 1 or 2
    real(c_double), intent(in)     :: h             !< step [s]
    real(c_double), intent(in)     :: k(n)          !< stiffness [N m/rad]
    real(c_double), intent(in)     :: damping(n)    !< [N m s/rad]
    real(c_double), intent(in)     :: limit(n)      !< largest moment of the spring, not negative [N m]
    real(c_double), intent(in)     :: w(n, c)       !< relative spin [rad/s]
    real(c_double), intent(inout)  :: spring(n, c)  !< angle [rad]
    real(c_double), intent(out)    :: moment(n, c)  !< on A [N m]
    real(c_double), intent(inout)  :: stored(n)     !< energies of springs are added [J]
    real(c_double), intent(inout)  :: spent(n)      !< works against the moments in the middle of the step are added [J]
    real(c_double) :: x, y, p, q, u, v, size, yield, was_x, was_y
    integer :: i
    !$omp simd private(x, y, p, q, u, v, size, yield, was_x, was_y)
    do i = 1, n
      u = w(i, 1)
      v = merge(w(i, c), 0.0_c_double, c == 2)
      was_x = spring(i, 1)
      was_y = merge(spring(i, c), 0.0_c_double, c == 2)
      x = was_x + h*u
      y = was_y + h*v
      p = -k(i)*x
      q = -k(i)*y
      size = sqrt(p*p + q*q)
      yield = merge(limit(i)/max(size, tiny(h)), 1.0_c_double, size > limit(i))
      x = yield*x
      y = yield*y
      p = yield*p - merge(0.0_c_double, damping(i)*u, size > limit(i))
      q = yield*q - merge(0.0_c_double, damping(i)*v, size > limit(i))
      size = sqrt(p*p + q*q)
      yield = merge(limit(i)/max(size, tiny(h)), 1.0_c_double, size > limit(i))
      p = yield*p
      q = yield*q
      spring(i, c) = y
      spring(i, 1) = x
      moment(i, c) = q
      moment(i, 1) = p
      stored(i) = stored(i) + 0.5_c_double*k(i)*(x*x + y*y)
      spent(i) = spent(i) - h*(p*u + q*v) - 0.5_c_double*k(i)*h*(u*(x - was_x) + v*(y - was_y))
    end do
  end subroutine roll

  !> Tangential spring and slider (spring_slider.f90) whose energy is remembered from step to step: energy that comes or goes with a
  !> stiffness that changes counts as dissipated by friction, and the balance closes. Works are those of the mean force of the step.
  pure subroutine slide_by_the_books(n, c, h, k, damping, limit, u, spring, f, remembered, energy)
    integer(c_int32_t), intent(in) :: n                !< contacts
    integer(c_int32_t), intent(in) :: c                !< components: 2 or 3
    real(c_double), intent(in)     :: h                !< step [s]
    real(c_double), intent(in)     :: k(n), damping(n), limit(n) !< [N/m, N s/m, N]
    real(c_double), intent(in)     :: u(n, c)          !< relative velocity (n, t [, s]) at the middle of the step [m/s]
    real(c_double), intent(inout)  :: spring(n, c - 1) !< [m]
    real(c_double), intent(inout)  :: f(n, c)          !< its tangential part is set [N]
    real(c_double), intent(inout)  :: remembered(n)    !< energy of the spring [J]
    real(c_double), intent(inout), optional :: energy(n, 4) !< stored, dissipated by damping, by friction: added;
    !< 4: set to zero [J]
    real(c_double) :: old(n, c - 1), own(n, 4), now
    integer :: i
    do i = 1, n ! a contact that bears no friction, pressed by nothing or frictionless, keeps no spring
      if (.not. limit(i) > 0) spring(i, :) = 0
    end do
    old = spring
    own = 0
    call slide(n, c, h, k, damping, limit, u, spring, f, own)
    do i = 1, n
      if (.not. limit(i) > 0) then
        spring(i, :) = 0
        f(i, 2:c) = 0
        own(i, 1) = 0
      end if
      now = own(i, 1)
      if (present(energy)) then
        energy(i, 1) = energy(i, 1) + now
        energy(i, 3) = energy(i, 3) - h*sum(f(i, 2:c)*u(i, 2:c)) &
                       - 0.5_c_double*k(i)*h*sum(u(i, 2:c)*(spring(i, :) - old(i, :))) &
                       - (now - remembered(i))
        energy(i, 4) = 0
      end if
      remembered(i) = now
    end do
  end subroutine slide_by_the_books

  !> A moment of constant size against the relative spin (model A); none where that is zero.
  pure subroutine constant_torque(n, c, h, limit, w, moment, spent)
    integer(c_int32_t), intent(in) :: n            !< contacts
    integer(c_int32_t), intent(in) :: c            !< components: 1 or 2
    real(c_double), intent(in)     :: h            !< step [s]
    real(c_double), intent(in)     :: limit(n)     !< its size [N m]
    real(c_double), intent(in)     :: w(n, c)      !< relative spin [rad/s]
    real(c_double), intent(out)    :: moment(n, c) !< on A [N m]
    real(c_double), intent(inout)  :: spent(n)     !< works against the moments are added [J]
    real(c_double) :: size
    integer :: i
    moment = 0
    do i = 1, n
      size = maxval(abs(w(i, :)))
      if (.not. size > 0) cycle
      size = size*sqrt(sum((w(i, :)/size)**2))
      moment(i, :) = -limit(i)*(w(i, :)/size)
      spent(i) = spent(i) + h*limit(i)*size
    end do
  end subroutine constant_torque
end module spin_springs
