!> Solutions with the factor L of a sparse symmetric matrix for unit right sides, and their products, which are entries of the
!> inverse (selected inversion). Right sides are side by side (the lanes). Each lane, and each product of two, sees the same
!> operations in the same order, independent of the others: terms are taken by eight columns of a block, which begin at a multiple
!> of eight.
module unit_fronts
  use, intrinsic :: iso_c_binding, only: c_int64_t, c_double
  use dense_products, only: take_block, take_one
  implicit none
  private
  public :: cairn_unit_front, cairn_unit_column, cairn_unit_products
  integer(c_int64_t), parameter :: at_once = 16 !< columns that are subtracted together, few enough for the cache
contains

  !> Forward substitution L y = y of a block of columns, and its subtraction from the rows below.
  pure subroutine cairn_unit_front(lanes, leading, rows, columns, from, l, y) bind(c)
    integer(c_int64_t), value     :: lanes
    integer(c_int64_t), value     :: leading
    integer(c_int64_t), value     :: rows             !< of the block: its columns, then those below
    integer(c_int64_t), value     :: columns
    integer(c_int64_t), value     :: from             !< columns before this one are zero in all lanes, from 0
    real(c_double), intent(in)    :: l(rows, columns) !< above the diagonal anything
    real(c_double), intent(inout) :: y(leading, rows)
    integer(c_int64_t) :: begin, whole, k, to, j, p, own
    begin = from - mod(from, 8_c_int64_t)
    whole = columns - mod(columns, 8_c_int64_t)
    do k = begin - mod(begin, at_once) + 1, rows, at_once
      to = min(rows, k + at_once - 1)
      do p = begin + 1, min(k - 1, whole), 8
        call take_block(lanes, to - k + 1, leading, y(1, p), rows, l(k, p), leading, y(1, k))
      end do
      own = min(to, columns)
      do p = max(k, begin + 1), own
        do j = p - mod(p - 1, 8_c_int64_t), p - 1
          call take_one(lanes, y(1, j), l(p, j), y(1, p))
        end do
        y(:lanes, p) = y(:lanes, p)/l(p, p)
        if (mod(p, 8_c_int64_t) /= 0) cycle
        if (p < to) call take_block(lanes, to - p, leading, y(1, p-7), rows, l(p+1, p-7), leading, y(1, p+1))
      end do
      do p = max(whole, begin) + 1, min(columns, to)
        do j = max(k, columns + 1), to
          call take_one(lanes, y(1, p), l(j, p), y(1, j))
        end do
      end do
    end do
  end subroutine cairn_unit_front

  !> The same of one column of L D L', whose rows below the diagonal are at hand; y(:, 0) comes out over the root of D.
  pure subroutine cairn_unit_column(lanes, leading, below, pivot, l, y) bind(c)
    integer(c_int64_t), value     :: lanes
    integer(c_int64_t), value     :: leading
    integer(c_int64_t), value     :: below
    real(c_double), value         :: pivot !< D
    real(c_double), intent(in)    :: l(below)
    real(c_double), intent(inout) :: y(leading, 0:below)
    integer(c_int64_t) :: i
    real(c_double) :: root
    do i = 1, below
      call take_one(lanes, y(1, 0), l(i), y(1, i))
    end do
    root = sqrt(pivot)
    y(:lanes, 0) = y(:lanes, 0)/root
  end subroutine cairn_unit_column

  !> Adds the products of lanes a with lanes b of one block of columns to their places in `out`.
  pure subroutine cairn_unit_products(lanes, leading, a, others, leading_b, b, columns, from, place, place_b, rows, out) bind(c)
    integer(c_int64_t), value     :: lanes            !< at most 128
    integer(c_int64_t), value     :: leading
    real(c_double), intent(in)    :: a(leading, *)
    integer(c_int64_t), value     :: others           !< lanes of b
    integer(c_int64_t), value     :: leading_b
    real(c_double), intent(in)    :: b(leading_b, *)
    integer(c_int64_t), value     :: columns
    integer(c_int64_t), value     :: from             !< columns before this one are zero in all lanes of a, from 0
    integer(c_int64_t), intent(in) :: place(lanes)    !< rows of `out`, from 0
    integer(c_int64_t), intent(in) :: place_b(others) !< its columns, from 0
    integer(c_int64_t), value     :: rows
    real(c_double), intent(inout) :: out(0:rows-1, 0:*)
    integer(c_int64_t) :: begin, whole, k, to, j, p, i
    real(c_double) :: sum(128, at_once) !< less the products
    begin = from - mod(from, 8_c_int64_t)
    whole = columns - mod(columns, 8_c_int64_t)
    do k = 1, others, at_once
      to = min(others, k + at_once - 1)
      sum(:lanes, :to-k+1) = 0
      do p = begin + 1, whole, 8
        call take_block(lanes, to - k + 1, leading, a(1, p), leading_b, b(k, p), 128_c_int64_t, sum)
      end do
      do p = max(whole, begin) + 1, columns
        do j = k, to
          call take_one(lanes, a(1, p), b(j, p), sum(1, j-k+1))
        end do
      end do
      do j = k, to
        do i = 1, lanes
          out(place(i), place_b(j)) = out(place(i), place_b(j)) - sum(i, j-k+1)
        end do
      end do
    end do
  end subroutine cairn_unit_products

end module unit_fronts
