!> Narrows an angle at which a slope falls through zero; with each angle goes the point that gave the slope. The caller looks,
!> this says where.
module bracketed_zero
  use, intrinsic :: iso_c_binding, only: c_double
  implicit none
  private
  public :: bracket, next_angle, narrow, where_it_falls

  integer, parameter :: most_rounds = 100

  type :: bracket
    real(c_double) :: low = 0, high = 0            !< angles between which it falls
    real(c_double) :: of_low = 1, of_high = -1     !< the slope at them, > 0 and < 0
    real(c_double) :: x_low(3) = 0, x_high(3) = 0  !< the points at them
    integer :: round = 0
    logical :: met = .false.                       !< at x_low the slope is 0
  end type bracket

contains

  !> The straight line's zero, a little beyond it so that both ends close in; every third time the middle. more: there is one.
  pure subroutine next_angle(b, here, more)
    type(bracket), intent(inout) :: b
    real(c_double), intent(out) :: here
    logical, intent(out) :: more
    real(c_double) :: trial
    b%round = b%round + 1
    here = b%low + (b%high - b%low)/2
    if (modulo(b%round, 3) /= 0) then
      trial = b%low + (b%high - b%low)*(b%of_low/(b%of_low - b%of_high))
      if (b%round > 3) trial = trial + sign(0.1_c_double*min(trial - b%low, b%high - trial), here - trial)
      if (trial > b%low .and. trial < b%high) here = trial
    end if
    more = here > b%low .and. here < b%high .and. b%round <= most_rounds .and. .not. b%met
  end subroutine next_angle

  pure subroutine narrow(b, here, slope, x)
    type(bracket), intent(inout) :: b
    real(c_double), intent(in) :: here, slope, x(3)
    if (slope < 0) then
      b%high = here
      b%of_high = slope
      b%x_high = x
    else
      b%met = .not. slope > 0
      b%low = here
      b%of_low = slope
      b%x_low = x
    end if
  end subroutine narrow

  !> The angle, and the point between those of both ends: where a body is straight the point jumps.
  pure subroutine where_it_falls(b, angle, x)
    type(bracket), intent(in) :: b
    real(c_double), intent(out) :: angle, x(3)
    real(c_double) :: share
    share = b%of_low/(b%of_low - b%of_high)
    angle = b%low + share*(b%high - b%low)
    x = b%x_low + share*(b%x_high - b%x_low)
  end subroutine where_it_falls

end module bracketed_zero
