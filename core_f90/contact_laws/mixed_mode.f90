!> Lengths and works between mode I and mode II, for a contact that opens along one direction.
module mixed_mode
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: mixed_length, mixed_work, parabola, mean_decay, onset_of_strengths
contains

  !> Length of an opening with (d_N/one)^2 + (d_T/two)^2 = 1; 0 unless both are above 0.
  pure real(c_double) function mixed_length(share, one, two)
    real(c_double), intent(in) :: share    !< tangential share of the squared opening [-]
    real(c_double), intent(in) :: one, two !< of mode I and mode II [m]
    mixed_length = 0
    if (.not. (one > 0 .and. two > 0)) return
    mixed_length = one
    if (share > 0) mixed_length = two/sqrt((two/one)**2*(1 - share) + share)
  end function mixed_length

  !> Onset of damage (see cohesive_onset) for laws whose first parameters are two stiffnesses [Pa/m], and whose own begin with two
  !> strengths [Pa].
  pure subroutine onset_of_strengths(n, p, limit)
    integer(c_int32_t), intent(in) :: n           !< contacts
    real(c_double), intent(in)     :: p(n, *)     !< parameters
    real(c_double), intent(out)    :: limit(n, 2) !< [1/m2]
    integer :: i
    !$omp simd
    do i = 1, n
      limit(i, 1) = (p(i, 1)/p(i, 7))**2
      limit(i, 2) = (p(i, 2)/p(i, 8))**2
    end do
  end subroutine onset_of_strengths

  !> Work G with G_I/one + G_II/two = 1, its parts as springs along the opening share it.
  pure real(c_double) function mixed_work(share, c_n, c_t, one, two)
    real(c_double), intent(in) :: share    !< tangential share of the squared opening [-]
    real(c_double), intent(in) :: c_n, c_t !< stiffnesses [Pa/m]
    real(c_double), intent(in) :: one, two !< of mode I and mode II [J/m2]
    real(c_double) :: normal, tangent
    normal = (1 - share)*c_n
    tangent = share*c_t
    mixed_work = (normal + tangent)/(normal/one + tangent/two)
  end function mixed_work

  !> Sound to an opening, then a stress that falls along a parabola, so that breaking takes g.
  pure subroutine parabola(k, first, g, opening, beta, work)
    real(c_double), intent(in)  :: k       !< stiffness [Pa/m]
    real(c_double), intent(in)  :: first   !< opening at which damage begins [m]
    real(c_double), intent(in)  :: g       !< work of separation [J/m2]
    real(c_double), intent(in)  :: opening !< [m]
    real(c_double), intent(out) :: beta    !< [-]
    real(c_double), intent(out) :: work    !< per area to separate faces by `opening` [J/m2]
    real(c_double) :: length, x
    beta = 1
    work = k*opening**2/2
    if (opening <= first) return
    beta = 0
    work = k*first**2/2
    if (.not. first > 0) return
    length = 1.5_c_double*(g - work)/(k*first)
    if (.not. length > 0) return
    x = min((opening - first)/length, 1.0_c_double)
    if (x < 1) beta = (first/opening)*(1 - x)*(1 + x)
    work = work + k*first*min(opening - first, length)*(1 - x*x/3) ! all of the remaining work at x = 1
  end subroutine parabola

  !> Mean of exp(-x) from 0 on, with all digits where it hardly falls.
  pure real(c_double) function mean_decay(x)
    real(c_double), intent(in) :: x
    mean_decay = 1
    if (x > tiny(x)) mean_decay = exp(-x/2)*(sinh(x/2)/(x/2))
  end function mean_decay
end module mixed_mode
