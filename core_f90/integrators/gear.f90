!> Predictor and corrector of Gear (1971), coefficients for forces that depend on velocities (Allen & Tildesley 1987): with
!> r_k = h^k/k! a_k predicted by Taylor, and d = h^2/2 (M^-1 F(q_p, v_p) - a_p), r_k + c_k d.
module gear
  use, intrinsic :: iso_c_binding, only: c_double
  use linear_scheme, only: cairn_scheme, no_history
  implicit none
  private
  public :: cairn_integrator_gear
contains

  pure subroutine cairn_integrator_gear(h, params, scheme) bind(c)
    real(c_double), value           :: h         !< step [s]
    real(c_double), intent(in)      :: params(*) !< values: 4, 5 or 6 [-]
    type(cairn_scheme), intent(out) :: scheme    !< a step
    real(c_double), parameter :: c4(0:3) = [1/6.0_c_double, 5/6.0_c_double, 1.0_c_double, 1/3.0_c_double]
    real(c_double), parameter :: c5(0:4) = [19/90.0_c_double, 3/4.0_c_double, 1.0_c_double, 1/2.0_c_double, 1/12.0_c_double]
    real(c_double), parameter :: c6(0:5) = [3/16.0_c_double, 251/360.0_c_double, 1.0_c_double, 11/18.0_c_double, &
                                            1/6.0_c_double, 1/60.0_c_double]
    real(c_double), parameter :: most(4:6) = [sqrt(2.0_c_double), 1.0_c_double, 0.5_c_double]
    real(c_double) :: c(0:5), taylor(0:5)
    integer :: values, j, k
    values = nint(params(1))
    c = 0
    if (values == 4) c(0:3) = c4
    if (values == 5) c(0:4) = c5
    if (values == 6) c = c6
    taylor(0) = 1
    do k = 1, 5
      taylor(k) = taylor(k - 1)*h/k
    end do
    scheme = no_history(h)
    scheme%impulse = c(1)*h/2
    scheme%end_share = 1
    scheme%share = c(0)/c(1)
    scheme%elastic_velocity = h
    scheme%largest = most(values)
    scheme%histories = values - 2
    do k = 2, values - 1
      scheme%position(k - 1) = taylor(k) - h*scheme%share*taylor(k - 1)
      scheme%velocity(k - 1) = taylor(k - 1) - scheme%impulse*taylor(k - 2)
      scheme%elastic(k - 1) = taylor(k)
      scheme%damping_history(k - 1) = taylor(k - 1)
      scheme%gain(k - 1) = c(k)/taylor(k)*(h/c(1))
      do j = 2, values - 1
        if (k >= j) scheme%update(j - 1, k - 1) = taylor(k - j)
        scheme%update(j - 1, k - 1) = scheme%update(j - 1, k - 1) - c(j)/taylor(j)*(h*h/2)*taylor(k - 2)
      end do
    end do
  end subroutine cairn_integrator_gear
end module gear
