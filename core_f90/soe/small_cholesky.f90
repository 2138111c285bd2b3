!> Root-free Cholesky factors L D L' of many small symmetric matrices of one size, eight side by side. Without roots a matrix
!> times any power of two has the same L.
module small_cholesky
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_small_factor, cairn_small_solve, cairn_small_inverse
  integer, parameter :: lanes = 8
contains

  !> a becomes D on its diagonal and the unit lower L below it. A lane whose pivot is not above `zero` times its diagonal entry
  !> has failed there, at row failed (from 1, else 0), with that pivot divided by that entry in `pivot`; what its factors solve
  !> means nothing.
  subroutine cairn_small_factor(groups, n, zero, a, failed, pivot) bind(c)
    integer(c_int64_t), value         :: groups !< of eight matrices
    integer(c_int32_t), value         :: n      !< unknowns of each
    real(c_double), value             :: zero   !< below which a pivot tells nothing
    real(c_double), intent(inout)     :: a(lanes, n, n, groups) !< lower triangles
    integer(c_int32_t), intent(inout) :: failed(lanes, groups)
    real(c_double), intent(inout)     :: pivot(lanes, groups)
    real(c_double) :: given(lanes), scaled(lanes)
    integer(c_int64_t) :: g
    integer :: i, j, k, lane
    do g = 1, groups
      failed(:, g) = 0
      pivot(:, g) = 1
      do j = 1, n
        given = a(:, j, j, g)
        do k = 1, j - 1
          scaled = a(:, j, k, g)*a(:, k, k, g)
          do i = j, n
            a(:, i, j, g) = a(:, i, j, g) - a(:, i, k, g)*scaled
          end do
        end do
        do lane = 1, lanes
          if (a(lane, j, j, g) > zero*given(lane) .and. given(lane) > 0 .and. a(lane, j, j, g) <= huge(zero)) cycle
          if (failed(lane, g) == 0) then
            failed(lane, g) = j
            pivot(lane, g) = a(lane, j, j, g)/given(lane)
          end if
          a(lane, j, j, g) = 1
        end do
        do i = j + 1, n
          a(:, i, j, g) = a(:, i, j, g)/a(:, j, j, g)
        end do
      end do
    end do
  end subroutine cairn_small_factor

  !> Solutions in place of b.
  subroutine cairn_small_solve(groups, n, a, b) bind(c)
    integer(c_int64_t), value     :: groups !< of eight matrices
    integer(c_int32_t), value     :: n      !< unknowns of each
    real(c_double), intent(in)    :: a(lanes, n, n, groups) !< factors
    real(c_double), intent(inout) :: b(lanes, n, groups)
    integer(c_int64_t) :: g
    do g = 1, groups
      call solve_group(n, 1, a(:, :, :, g), b(:, :, g))
    end do
  end subroutine cairn_small_solve

  !> Lower triangles of the inverses, mirrored.
  subroutine cairn_small_inverse(groups, n, a, inverse) bind(c)
    integer(c_int64_t), value     :: groups !< of eight matrices
    integer(c_int32_t), value     :: n      !< unknowns of each
    real(c_double), intent(in)    :: a(lanes, n, n, groups) !< factors
    real(c_double), intent(inout) :: inverse(lanes, n, n, groups)
    integer(c_int64_t) :: g
    integer :: i, j
    do g = 1, groups
      inverse(:, :, :, g) = 0
      do j = 1, n
        inverse(:, j, j, g) = 1
        call solve_group(n, j, a(:, :, :, g), inverse(:, :, j, g))
      end do
      do j = 2, n
        do i = 1, j - 1
          inverse(:, i, j, g) = inverse(:, j, i, g)
        end do
      end do
    end do
  end subroutine cairn_small_inverse

  !> y holds zeros above row first.
  pure subroutine solve_group(n, first, a, y)
    integer(c_int32_t), intent(in) :: n
    integer, intent(in)            :: first
    real(c_double), intent(in)     :: a(lanes, n, n)
    real(c_double), intent(inout)  :: y(lanes, n)
    integer :: i, j
    do j = first, n
      do i = j + 1, n
        y(:, i) = y(:, i) - a(:, i, j)*y(:, j)
      end do
    end do
    do j = n, 1, -1
      y(:, j) = y(:, j)/a(:, j, j)
      do i = j + 1, n
        y(:, j) = y(:, j) - a(:, i, j)*y(:, i)
      end do
    end do
  end subroutine solve_group
end module small_cholesky
