!> Support function of a hull: the vertex, or the normal, with the least component along a direction. No branch depends on its
!> index, which would be mispredicted.
module hull_support
  use, intrinsic :: iso_c_binding, only: c_double, c_int64_t
  implicit none
  private
  public :: lowest

  integer, parameter :: lanes = 4

contains

  !> Least m.x of the rows of x, and the first row that has it.
  pure subroutine lowest(n, x, m, least, row)
    integer, intent(in) :: n
    real(c_double), intent(in) :: x(n, 3), m(3)
    real(c_double), intent(out) :: least
    integer, intent(out) :: row
    real(c_double) :: low(lanes), reach(lanes)
    integer(c_int64_t) :: at(lanes)
    integer :: first, from, j
    low = huge(low)
    at = 1
    do j = 1, merge(n, 0, n < lanes)
      low(j) = m(1)*x(j, 1) + m(2)*x(j, 2) + m(3)*x(j, 3)
      at(j) = j
    end do
    do first = 1, merge(n, 0, n >= lanes), lanes
      from = min(first, n - lanes + 1) - 1 ! the last lanes overlap those before
      do j = 1, lanes
        reach(j) = m(1)*x(from + j, 1) + m(2)*x(from + j, 2) + m(3)*x(from + j, 3)
      end do
      do j = 1, lanes
        at(j) = merge(int(from + j, c_int64_t), at(j), reach(j) < low(j))
        low(j) = min(low(j), reach(j))
      end do
    end do
    least = min(min(low(1), low(2)), min(low(3), low(4)))
    row = n
    do j = 1, lanes
      row = min(row, merge(int(at(j)), n, low(j) <= least))
    end do
  end subroutine lowest

end module hull_support
