!> Solutions with the triangles of a factorised sparse matrix, by columns or by dense blocks of columns. Right sides go eight side
!> by side (the lanes) or alone; each lane sees the same operations in the same order, independent of the other lanes.
module column_triangles
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_column_triangles, cairn_front_triangles
contains

  !> L D L' y = y with the unit lower L by columns.
  subroutine cairn_column_triangles(lanes, n, first, last, row, value, pivot, y) bind(c)
    integer(c_int32_t), value      :: lanes            !< 1 or 8
    integer(c_int64_t), value      :: n         !< columns
    integer(c_int64_t), intent(in) :: first(*)         !< place of a column's first entry below the diagonal, from 0
    integer(c_int64_t), intent(in) :: last(*)          !< place behind its last entry, from 0
    integer(c_int32_t), intent(in) :: row(*)           !< from 0
    real(c_double), intent(in)     :: value(*)
    real(c_double), intent(in)     :: pivot(*)         !< diagonal of D
    real(c_double), intent(inout)  :: y(lanes, *)
    if (lanes == 8) then
      call columns8(n, first, last, row, value, pivot, y)
    else
      call columns1(n, first, last, row, value, pivot, y)
    end if
  end subroutine cairn_column_triangles

  subroutine columns1(n, first, last, row, value, pivot, y)
    integer(c_int64_t), intent(in) :: n, first(*), last(*)
    integer(c_int32_t), intent(in) :: row(*)
    real(c_double), intent(in)     :: value(*), pivot(*)
    real(c_double), intent(inout)  :: y(*)
    integer(c_int64_t) :: j, p
    real(c_double) :: t
    do j = 1, n
      t = y(j)
      do p = first(j) + 1, last(j)
        y(row(p)+1) = y(row(p)+1) - value(p)*t
      end do
    end do
    do j = n, 1, -1
      t = y(j)/pivot(j)
      do p = first(j) + 1, last(j)
        t = t - value(p)*y(row(p)+1)
      end do
      y(j) = t
    end do
  end subroutine columns1

  subroutine columns8(n, first, last, row, value, pivot, y)
    integer(c_int64_t), intent(in) :: n, first(*), last(*)
    integer(c_int32_t), intent(in) :: row(*)
    real(c_double), intent(in)     :: value(*), pivot(*)
    real(c_double), intent(inout)  :: y(8, *)
    integer(c_int64_t) :: j, p
    real(c_double) :: t(8)
    do j = 1, n
      t = y(:, j)
      do p = first(j) + 1, last(j)
        y(:, row(p)+1) = y(:, row(p)+1) - value(p)*t
      end do
    end do
    do j = n, 1, -1
      t = y(:, j)/pivot(j)
      do p = first(j) + 1, last(j)
        t = t - value(p)*y(:, row(p)+1)
      end do
      y(:, j) = t
    end do
  end subroutine columns8

  !> Solves L L' x = y in place, L stored in blocks of columns of one pattern (supernodes). The rows of a block are its own
  !> columns, then the rows below these.
  subroutine cairn_front_triangles(lanes, blocks, column_start, row_start, value_start, row, value, y, work) bind(c)
    integer(c_int32_t), value      :: lanes            !< 1 or 8
    integer(c_int64_t), value      :: blocks
    integer(c_int32_t), intent(in) :: column_start(*)  !< (blocks + 1) from 0
    integer(c_int32_t), intent(in) :: row_start(*)     !< (blocks + 1) from 0
    integer(c_int32_t), intent(in) :: value_start(*)   !< of each block's values, by columns, from 0
    integer(c_int32_t), intent(in) :: row(*)           !< from 0, of each block
    real(c_double), intent(in)     :: value(*)
    real(c_double), intent(inout)  :: y(lanes, *)
    real(c_double), intent(inout)  :: work(lanes, *)   !< for the rows of one block
    integer(c_int64_t) :: s, columns, rows, top
    do s = 1, blocks
      top = row_start(s)
      rows = row_start(s+1) - top
      columns = column_start(s+1) - column_start(s)
      if (lanes == 8) then
        call forward8(columns, rows, row(top+1), value(int(value_start(s), c_int64_t)+1), y, work)
      else
        call forward1(columns, rows, row(top+1), value(int(value_start(s), c_int64_t)+1), y, work)
      end if
    end do
    do s = blocks, 1, -1
      top = row_start(s)
      rows = row_start(s+1) - top
      columns = column_start(s+1) - column_start(s)
      if (lanes == 8) then
        call backward8(columns, rows, row(top+1), value(int(value_start(s), c_int64_t)+1), y, work)
      else
        call backward1(columns, rows, row(top+1), value(int(value_start(s), c_int64_t)+1), y, work)
      end if
    end do
  end subroutine cairn_front_triangles

  pure subroutine forward1(columns, rows, row, l, y, work)
    integer(c_int64_t), intent(in) :: columns, rows
    integer(c_int32_t), intent(in) :: row(rows)
    real(c_double), intent(in)     :: l(rows, columns)
    real(c_double), intent(inout)  :: y(*), work(rows)
    integer(c_int64_t) :: i, j
    do i = 1, rows
      work(i) = y(row(i)+1)
    end do
    do j = 1, columns
      work(j) = work(j)/l(j, j)
      do i = j + 1, rows
        work(i) = work(i) - l(i, j)*work(j)
      end do
    end do
    do i = 1, rows
      y(row(i)+1) = work(i)
    end do
  end subroutine forward1

  !> Four columns while the rows go by once: what eight lanes of a row hold is fetched and put back less often.
  pure subroutine forward8(columns, rows, row, l, y, work)
    integer(c_int64_t), intent(in) :: columns, rows
    integer(c_int32_t), intent(in) :: row(rows)
    real(c_double), intent(in)     :: l(rows, columns)
    real(c_double), intent(inout)  :: y(8, *), work(8, rows)
    integer(c_int64_t) :: i, j, c, last
    real(c_double) :: t1(8), t2(8), t3(8), t4(8), x(8)
    do i = 1, rows
      work(:, i) = y(:, row(i)+1)
    end do
    do j = 1, columns, 4
      last = min(j + 3, columns)
      do c = j, last
        work(:, c) = work(:, c)/l(c, c)
        t1 = work(:, c)
        do i = c + 1, merge(last, rows, last == j + 3)
          work(:, i) = work(:, i) - l(i, c)*t1
        end do
      end do
      if (last < j + 3) exit ! fewer than four have gone through all rows
      t1 = work(:, j)
      t2 = work(:, j+1)
      t3 = work(:, j+2)
      t4 = work(:, j+3)
      do i = last + 1, rows
        x = work(:, i)
        x = x - l(i, j)*t1
        x = x - l(i, j+1)*t2
        x = x - l(i, j+2)*t3
        x = x - l(i, j+3)*t4
        work(:, i) = x
      end do
    end do
    do i = 1, rows
      y(:, row(i)+1) = work(:, i)
    end do
  end subroutine forward8

  !> Sums of four columns run side by side: each has to wait for itself.
  subroutine backward1(columns, rows, row, l, y, work)
    integer(c_int64_t), intent(in) :: columns, rows
    integer(c_int32_t), intent(in) :: row(rows)
    real(c_double), intent(in)     :: l(rows, columns)
    real(c_double), intent(inout)  :: y(*), work(rows)
    integer(c_int64_t) :: i, j, low
    real(c_double) :: t1, t2, t3, t4
    do i = 1, rows
      work(i) = y(row(i)+1)
    end do
    j = columns
    do while (j > 0)
      low = max(j - 3, 1_c_int64_t)
      if (j - low == 3) then
        t1 = work(low)
        t2 = work(low+1)
        t3 = work(low+2)
        t4 = work(j)
        do i = rows, j + 1, -1
          t1 = t1 - l(i, low)*work(i)
          t2 = t2 - l(i, low+1)*work(i)
          t3 = t3 - l(i, low+2)*work(i)
          t4 = t4 - l(i, j)*work(i)
        end do
        work(low) = t1
        work(low+1) = t2
        work(low+2) = t3
        work(j) = t4
      else
        do i = low, j
          t1 = work(i)
          call subtract(rows - j, l(:, i), work, t1)
          work(i) = t1
        end do
      end if
      call finish(low, j)
      j = low - 1
    end do
    do i = 1, columns
      y(row(i)+1) = work(i)
    end do
  contains
    pure subroutine subtract(below, column, x, t)
      integer(c_int64_t), intent(in) :: below
      real(c_double), intent(in)     :: column(rows), x(rows)
      real(c_double), intent(inout)  :: t
      integer(c_int64_t) :: m
      do m = rows, rows - below + 1, -1
        t = t - column(m)*x(m)
      end do
    end subroutine subtract

    !> The small triangle of the columns at hand.
    subroutine finish(from, to)
      integer(c_int64_t), intent(in) :: from, to
      integer(c_int64_t) :: c, m
      do c = to, from, -1
        do m = to, c + 1, -1
          work(c) = work(c) - l(m, c)*work(m)
        end do
        work(c) = work(c)/l(c, c)
      end do
    end subroutine finish
  end subroutine backward1

  pure subroutine backward8(columns, rows, row, l, y, work)
    integer(c_int64_t), intent(in) :: columns, rows
    integer(c_int32_t), intent(in) :: row(rows)
    real(c_double), intent(in)     :: l(rows, columns)
    real(c_double), intent(inout)  :: y(8, *), work(8, rows)
    integer(c_int64_t) :: i, j, c, low
    real(c_double) :: t1(8), t2(8), t3(8), t4(8), x(8)
    do i = 1, rows
      work(:, i) = y(:, row(i)+1)
    end do
    do j = columns, 1, -4
      low = max(j - 3, 1_c_int64_t)
      if (j - low == 3) then
        t1 = work(:, low)
        t2 = work(:, low+1)
        t3 = work(:, low+2)
        t4 = work(:, j)
        do i = rows, j + 1, -1
          x = work(:, i)
          t1 = t1 - l(i, low)*x
          t2 = t2 - l(i, low+1)*x
          t3 = t3 - l(i, low+2)*x
          t4 = t4 - l(i, j)*x
        end do
        work(:, low) = t1
        work(:, low+1) = t2
        work(:, low+2) = t3
        work(:, j) = t4
      end if
      do c = j, low, -1
        x = work(:, c)
        do i = merge(j, rows, j - low == 3), c + 1, -1
          x = x - l(i, c)*work(:, i)
        end do
        work(:, c) = x/l(c, c)
      end do
    end do
    do i = 1, columns
      y(:, row(i)+1) = work(:, i)
    end do
  end subroutine backward8
end module column_triangles
