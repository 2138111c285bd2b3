!> Resistance of smooth contacts to rolling and twisting: a spring, a dashpot and a slider on relative spins, or a constant torque.
module spin_springs
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: roll, constant_torque
contains

  !> Elastic-plastic spring and dashpot (Ai, Chen, Rotter & Ooi 2011, model C): M = -k theta - c w within the limit; beyond it the spring
  !> gives way and the dashpot gives nothing. Both together stay within the limit, too: a dashpot alone would exceed it many times over
  !> where a load that swings lets the spring of a fast roll go. One component (twist, or rolling in 2D) or two.
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
      spent(i) = spent(i) - h*sum(moment(i, :)*w(i, :)) - 0.5_c_double*k(i)*sum((spring(i, :) - old)**2)
    end do
  end subroutine roll

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
