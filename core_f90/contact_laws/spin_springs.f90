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
    real(c_double) :: size, yield, old(c)
    integer :: i
    do i = 1, n
      old = spring(i, :)
      spring(i, :) = spring(i, :) + h*w(i, :)
      moment(i, :) = -k(i)*spring(i, :)
      size = sqrt(sum(moment(i, :)**2))
      if (size > limit(i)) then
        yield = 0
        if (size > 0) yield = limit(i)/size
        moment(i, :) = yield*moment(i, :)
        spring(i, :) = yield*spring(i, :)
      else
        moment(i, :) = moment(i, :) - damping(i)*w(i, :)
        size = sqrt(sum(moment(i, :)**2))
        if (size > limit(i)) moment(i, :) = (limit(i)/size)*moment(i, :)
      end if
      stored(i) = stored(i) + 0.5_c_double*k(i)*sum(spring(i, :)**2)
      spent(i) = spent(i) - h*sum(moment(i, :)*w(i, :)) - 0.5_c_double*k(i)*h*sum(w(i, :)*(spring(i, :) - old))
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
