!> Solutions with the Cholesky factor of a banded matrix, right sides eight side by side (the lanes) or alone. Each lane sees the
!> same operations in the same order, independent of the other lanes.
module band_triangles
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_band_triangles
contains

  !> L L' y = y.
  subroutine cairn_band_triangles(lanes, n, half, l, y) bind(c)
    integer(c_int32_t), value     :: lanes        !< 1 or 8
    integer(c_int64_t), value     :: n
    integer(c_int64_t), value     :: half         !< entries below a diagonal entry
    real(c_double), intent(in)    :: l(half+1, n) !< columns from their diagonal entry down
    real(c_double), intent(inout) :: y(lanes, n)
    if (lanes == 8) then
      call triangles8(n, half, l, y)
    else
      call triangles1(n, half, l, y)
    end if
  end subroutine cairn_band_triangles

  pure subroutine triangles1(n, half, l, y)
    integer(c_int64_t), intent(in) :: n, half
    real(c_double), intent(in)     :: l(0:half, n)
    real(c_double), intent(inout)  :: y(n)
    integer(c_int64_t) :: i, j
    real(c_double) :: t
    do j = 1, n
      t = y(j)/l(0, j)
      y(j) = t
      do i = 1, min(half, n - j)
        y(j+i) = y(j+i) - l(i, j)*t
      end do
    end do
    do j = n, 1, -1
      t = y(j)
      do i = min(half, n - j), 1, -1
        t = t - l(i, j)*y(j+i)
      end do
      y(j) = t/l(0, j)
    end do
  end subroutine triangles1

  pure subroutine triangles8(n, half, l, y)
    integer(c_int64_t), intent(in) :: n, half
    real(c_double), intent(in)     :: l(0:half, n)
    real(c_double), intent(inout)  :: y(8, n)
    integer(c_int64_t) :: i, j
    real(c_double) :: t(8)
    do j = 1, n
      t = y(:, j)/l(0, j)
      y(:, j) = t
      do i = 1, min(half, n - j)
        y(:, j+i) = y(:, j+i) - l(i, j)*t
      end do
    end do
    do j = n, 1, -1
      t = y(:, j)
      do i = min(half, n - j), 1, -1
        t = t - l(i, j)*y(:, j+i)
      end do
      y(:, j) = t/l(0, j)
    end do
  end subroutine triangles8
end module band_triangles
