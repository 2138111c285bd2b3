!> Factors L L' of a sparse symmetric matrix with a known pattern, by dense blocks of columns: each block subtracts the products of
!> earlier ones, then is factorised by itself (supernodal Cholesky). No BLAS is called, since its speed differs tenfold between
!> installations.
module block_cholesky
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  use dense_products, only: take_block, take_one
  implicit none
  private
  public :: cairn_block_cholesky
  integer(c_int64_t), parameter :: at_once = 128 !< rows that stay in the nearest memory while terms go by
  integer(c_int64_t), parameter :: beside = 16   !< columns that do, a multiple of eight
contains

  !> value: A in the places of L, and L itself at the end. Rows of a block are its own columns, then those below.
  subroutine cairn_block_cholesky(n, blocks, column_start, row_start, value_start, row, node, value, next, head, taken, place, &
                                  work, failed) bind(c)
    integer(c_int64_t), value        :: n                        !< columns
    integer(c_int64_t), value        :: blocks
    integer(c_int32_t), intent(in)   :: column_start(blocks + 1) !< from 0
    integer(c_int32_t), intent(in)   :: row_start(blocks + 1)    !< from 0
    integer(c_int32_t), intent(in)   :: value_start(blocks)      !< of each block's values, by columns, from 0
    integer(c_int32_t), intent(in)   :: row(*)                   !< from 0, of each block, rising
    integer(c_int32_t), intent(in)   :: node(n)                  !< block of each column, from 0
    real(c_double), intent(inout)    :: value(*)                 !< above the diagonal of a block anything that is finite
    integer(c_int32_t), intent(out)  :: next(blocks)             !< workspace
    integer(c_int32_t), intent(out)  :: head(blocks)             !< workspace
    integer(c_int32_t), intent(out)  :: taken(blocks)            !< workspace
    integer(c_int32_t), intent(out)  :: place(n)                 !< workspace
    real(c_double), intent(inout)    :: work(*)                  !< workspace, (rows of the longest block, columns of the widest)
    integer(c_int32_t), intent(out)  :: failed                   !< column whose pivot is not positive, from 0; -1: none
    integer(c_int32_t) :: s, d, after
    integer(c_int64_t) :: top, rows, columns, from, low, first, behind, begin
    failed = -1
    head = -1
    next = -1
    taken = 0
    place = 0
    do s = 0, int(blocks, c_int32_t) - 1
      top = row_start(s+1)
      rows = row_start(s+2) - top
      columns = column_start(s+2) - column_start(s+1)
      begin = value_start(s+1)
      do low = 0, rows - 1
        place(row(top+low+1)+1) = int(low, c_int32_t)
      end do
      d = head(s+1)
      do while (d >= 0)
        after = next(d+1)
        from = row_start(d+1)
        first = from + taken(d+1)
        behind = first
        do while (behind < row_start(d+2))
          if (row(behind+1) >= column_start(s+2)) exit
          behind = behind + 1
        end do
        call products(row_start(d+2) - first, behind - first, int(column_start(d+2) - column_start(d+1), c_int64_t), &
                      row_start(d+2) - from, value(value_start(d+1)+taken(d+1)+1), work)
        call take(row_start(d+2) - first, behind - first, row(first+1), place, rows, work, value(begin+1))
        taken(d+1) = int(behind - from, c_int32_t)
        call hand_on(d, behind, int(row_start(d+2), c_int64_t))
        d = after
      end do
      call factor(rows, columns, value(begin+1), low)
      if (low > 0) then
        failed = column_start(s+1) + int(low - 1, c_int32_t)
        return
      end if
      taken(s+1) = int(columns, c_int32_t)
      call hand_on(s, top + columns, top + rows)
    end do
  contains
    !> A block stands in the list of the next one whose columns it changes.
    subroutine hand_on(block, at, end)
      integer(c_int32_t), intent(in) :: block
      integer(c_int64_t), intent(in) :: at, end
      integer(c_int32_t) :: to
      if (at >= end) return
      to = node(row(at+1)+1)
      next(block+1) = head(to+1)
      head(to+1) = block
    end subroutine hand_on
  end subroutine cairn_block_cholesky

  !> c = -a b', with b the first rows of a; above the diagonal c may miss some.
  pure subroutine products(rows, columns, terms, leading, a, c)
    integer(c_int64_t), intent(in) :: rows, columns, terms, leading
    real(c_double), intent(in)     :: a(leading, terms)
    real(c_double), intent(inout)  :: c(rows, columns)
    integer(c_int64_t) :: j, k, from, to, first, last
    do from = 1, rows, at_once
      to = min(rows, from + at_once - 1)
      do first = 1, min(columns, to), beside
        last = min(first + beside - 1, columns, to)
        c(from:to, first:last) = 0
        do k = 1, terms - 7, 8
          call take_block(to - from + 1, last - first + 1, leading, a(from, k), leading, a(first, k), rows, c(from, first))
        end do
        do k = terms - mod(terms, 8_c_int64_t) + 1, terms
          do j = first, last
            call take_one(to - from + 1, a(from, k), a(j, k), c(from, j))
          end do
        end do
      end do
    end do
  end subroutine products

  !> Adds these products to the columns of a block.
  pure subroutine take(rows, columns, row, place, leading, c, l)
    integer(c_int64_t), intent(in) :: rows, columns, leading
    integer(c_int32_t), intent(in) :: row(rows), place(*)
    real(c_double), intent(in)     :: c(rows, columns)
    real(c_double), intent(inout)  :: l(leading, *)
    integer(c_int64_t) :: i, j, to
    do j = 1, columns
      to = place(row(j)+1) + 1
      do i = j, rows
        l(place(row(i)+1)+1, to) = l(place(row(i)+1)+1, to) + c(i, j)
      end do
    end do
  end subroutine take

  !> One block, of which the first rows are its columns. failed: column whose pivot is not positive, from 1; 0: none.
  pure subroutine factor(rows, columns, l, failed)
    integer(c_int64_t), intent(in)  :: rows, columns
    real(c_double), intent(inout)   :: l(rows, columns)
    integer(c_int64_t), intent(out) :: failed
    integer(c_int64_t) :: j, k, p, m, last, end, from, to
    failed = 0
    do k = 1, columns, beside
      end = min(k + beside - 1, columns)
      do from = k, rows, at_once ! products of earlier columns
        to = min(rows, from + at_once - 1)
        do p = 1, k - 1, 8
          call take_block(to - from + 1, min(end, to) - k + 1, rows, l(from, p), rows, l(k, p), rows, l(from, k))
        end do
      end do
      do p = k, end, 8
        last = min(p + 7, end)
        do j = p, last
          do m = p, j - 1
            call take_one(rows - j + 1, l(j, m), l(j, m), l(j, j))
          end do
          if (.not. l(j, j) > 0) then
            failed = j
            return
          end if
          l(j, j) = sqrt(l(j, j))
          l(j+1:rows, j) = l(j+1:rows, j)/l(j, j)
        end do
        if (last < end) & ! these have eight columns behind them
          call take_block(rows - last, end - last, rows, l(last+1, p), rows, l(last+1, p), rows, l(last+1, last+1))
      end do
    end do
  end subroutine factor

end module block_cholesky
