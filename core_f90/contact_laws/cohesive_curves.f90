!> Damage of cohesive zones whose stress follows a curve over the opening (see cohesive_zone).
module cohesive_curves
  use, intrinsic :: iso_c_binding, only: c_double
  implicit none
  private
  public :: damage_along, length
  integer, parameter :: c_n = 1, c_t = 2

  abstract interface
    !> One curve of stress over opening, of a contact that opens in a given mode for the first time.
    pure subroutine cohesive_curve(p, share, opening, beta, work)
      import :: c_double
      real(c_double), intent(in)  :: p(*)    !< parameters
      real(c_double), intent(in)  :: share   !< tangential share of the squared opening [-]: 0 mode I, 1 mode II
      real(c_double), intent(in)  :: opening !< [m]
      real(c_double), intent(out) :: beta    !< from 1 to 0, falling with the opening
      real(c_double), intent(out) :: work    !< that opening as far as here takes [J/m2]
    end subroutine cohesive_curve
  end interface
  public :: cohesive_curve
contains

  pure real(c_double) function length(n, x)
    integer, intent(in)        :: n
    real(c_double), intent(in) :: x(n) !< any unit
    integer :: i
    real(c_double) :: square
    length = abs(x(1))
    if (n == 1) return
    do i = 2, n
      length = max(length, abs(x(i)))
    end do
    if (.not. length > 0) return
    square = 0
    do i = 1, n
      square = square + (x(i)/length)**2
    end do
    length = length*sqrt(square)
  end function length

  !> Damage by a curve; it never decreases. The dissipation is that of the curve from the opening where beta begins to fall, in the
  !> mode at the end of the step, to the opening there.
  pure subroutine damage_along(curve, p, normal, tangent, old, beta, spent)
    procedure(cohesive_curve)             :: curve
    real(c_double), intent(in)            :: p(*)            !< parameters
    real(c_double), intent(in)            :: normal, tangent !< opening [m]
    real(c_double), intent(in)            :: old             !< intensity before
    real(c_double), intent(out)           :: beta            !< and after
    real(c_double), intent(out), optional :: spent           !< [J/m2]
    real(c_double) :: share, opening, work, low, high, middle, found, begun, stiffness
    integer :: k
    opening = length(2, [normal, tangent])
    share = 0
    if (opening > 0) share = (tangent/opening)**2
    call curve(p, share, opening, beta, work)
    beta = min(beta, old)
    if (.not. present(spent)) return
    spent = 0
    if (.not. beta < old) return
    low = 0
    high = opening
    do k = 1, 100
      middle = low + (high - low)/2
      if (middle <= low .or. middle >= high) exit
      call curve(p, share, middle, found, begun)
      if (found < old) then
        high = middle
      else
        low = middle
      end if
    end do
    call curve(p, share, high, found, begun)
    if (found < old/2) found = old ! a zone that breaks within the step also spends its stored energy
    stiffness = (1 - share)*p(c_n) + share*p(c_t)
    spent = max(0.0_c_double, work - stiffness*beta*opening**2/2 - (begun - stiffness*found*high**2/2))
  end subroutine damage_along
end module cohesive_curves
