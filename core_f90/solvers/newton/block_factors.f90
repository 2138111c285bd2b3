!> LU factors of a matrix in blocks, one row of blocks per contact or body, in an order given by the caller; rows are eliminated
!> whole, with pivots inside a diagonal block only. Rows that are not active are left out. Unlike a factorisation by scalars it
!> takes the graph once, and every matrix on it after that costs its arithmetic alone.
module block_factors
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_block_factor, cairn_block_solve
contains

  !> Rows of L (unit diagonal, left of it) and U (right of it, diagonal inverted). Returns 0, or from 1 the contact whose pivots
  !> vanished.
  integer(c_int64_t) function cairn_block_factor(dim, n, order, place, row_start, column, block, active, lower_start, lower, &
      upper_start, upper, lower_last, lower_kept, upper_last, upper_kept, lower_block, upper_block, diagonal, work) &
      result(failed) bind(c)
    integer(c_int32_t), value      :: dim              !< of a block: 2, 3 or 6
    integer(c_int64_t), value      :: n                !< contacts
    integer(c_int32_t), intent(in) :: order(n)         !< contact at each place, from 0
    integer(c_int32_t), intent(in) :: place(n)         !< place of each contact, from 0
    integer(c_int64_t), intent(in) :: row_start(n+1)   !< from 0
    integer(c_int32_t), intent(in) :: column(*)        !< from 0
    real(c_double), intent(in)     :: block(dim*dim, *) !< of the matrix, by rows of contacts
    integer(c_int32_t), intent(in) :: active(n)        !< of a contact: 0 leaves it out
    integer(c_int64_t), intent(in) :: lower_start(n+1) !< from 0
    integer(c_int32_t), intent(in) :: lower(*)         !< places from 0, rising in a row
    integer(c_int64_t), intent(in) :: upper_start(n+1) !< from 0
    integer(c_int32_t), intent(in) :: upper(*)         !< places from 0
    integer(c_int64_t), intent(inout) :: lower_last(n) !< end of the blocks of a row that are not zero
    integer(c_int32_t), intent(inout) :: lower_kept(*) !< their places from 1
    integer(c_int64_t), intent(inout) :: upper_last(n)
    integer(c_int32_t), intent(inout) :: upper_kept(*)
    real(c_double), intent(inout)  :: lower_block(dim*dim, *)
    real(c_double), intent(inout)  :: upper_block(dim*dim, *)
    real(c_double), intent(inout)  :: diagonal(dim*dim, n)
    real(c_double), intent(inout)  :: work(dim*dim, n)
    integer(c_int64_t) :: i, k, m, e, a, kept
    logical :: regular
    failed = 0
    do i = 1, n
      a = order(i) + 1
      lower_last(i) = lower_start(i)
      upper_last(i) = upper_start(i)
      if (active(a) == 0) cycle
      do m = upper_start(i) + 1, upper_start(i+1)
        work(:, upper(m)+1) = 0
      end do
      do m = lower_start(i) + 1, lower_start(i+1)
        work(:, lower(m)+1) = 0
      end do
      do e = row_start(a) + 1, row_start(a+1)
        if (active(column(e)+1) /= 0) work(:, place(column(e)+1)+1) = block(:, e)
      end do
      kept = lower_start(i)
      do m = lower_start(i) + 1, lower_start(i+1)
        k = lower(m) + 1
        if (.not. maxval(abs(work(:, k))) > 0) cycle
        kept = kept + 1
        lower_kept(kept) = int(k, c_int32_t)
        if (dim == 3) then
          call eliminate3(upper_start(k) + 1, upper_last(k), upper_kept, upper_block, diagonal(:, k), work(:, k), &
                          lower_block(:, kept), work)
        else if (dim == 6) then
          call eliminate6(upper_start(k) + 1, upper_last(k), upper_kept, upper_block, diagonal(:, k), work(:, k), &
                          lower_block(:, kept), work)
        else
          call eliminate2(upper_start(k) + 1, upper_last(k), upper_kept, upper_block, diagonal(:, k), work(:, k), &
                          lower_block(:, kept), work)
        end if
      end do
      lower_last(i) = kept
      kept = upper_start(i)
      do m = upper_start(i) + 1, upper_start(i+1)
        k = upper(m) + 1
        if (.not. maxval(abs(work(:, k))) > 0) cycle
        kept = kept + 1
        upper_kept(kept) = int(k, c_int32_t)
        upper_block(:, kept) = work(:, k)
      end do
      upper_last(i) = kept
      call invert(dim, work(:, i), diagonal(:, i), regular)
      if (.not. regular) then
        failed = a
        return
      end if
    end do
  end function cairn_block_factor

  !> One block of a row is brought to zero by row k of U.
  subroutine eliminate3(first, last, upper, upper_block, inverse, own, l, work)
    integer(c_int64_t), intent(in) :: first, last
    integer(c_int32_t), intent(in) :: upper(*)
    real(c_double), intent(in)     :: upper_block(3, 3, *), inverse(3, 3), own(3, 3)
    real(c_double), intent(out)    :: l(3, 3)
    real(c_double), intent(inout)  :: work(3, 3, *)
    real(c_double) :: x(3, 3), u(3, 3)
    integer(c_int64_t) :: m, j
    integer :: c
    do c = 1, 3
      x(:, c) = own(:, 1)*inverse(1, c) + own(:, 2)*inverse(2, c) + own(:, 3)*inverse(3, c)
    end do
    l = x
    do m = first, last
      j = upper(m)
      u = upper_block(:, :, m)
      do c = 1, 3
        work(:, c, j) = work(:, c, j) - x(:, 1)*u(1, c) - x(:, 2)*u(2, c) - x(:, 3)*u(3, c)
      end do
    end do
  end subroutine eliminate3

  subroutine eliminate6(first, last, upper, upper_block, inverse, own, l, work)
    integer(c_int64_t), intent(in) :: first, last
    integer(c_int32_t), intent(in) :: upper(*)
    real(c_double), intent(in)     :: upper_block(6, 6, *), inverse(6, 6), own(6, 6)
    real(c_double), intent(out)    :: l(6, 6)
    real(c_double), intent(inout)  :: work(6, 6, *)
    real(c_double) :: x(6, 6), column(6)
    integer(c_int64_t) :: m, j
    integer :: c
    do c = 1, 6
      x(:, c) = own(:, 1)*inverse(1, c) + own(:, 2)*inverse(2, c) + own(:, 3)*inverse(3, c) + own(:, 4)*inverse(4, c) + &
                own(:, 5)*inverse(5, c) + own(:, 6)*inverse(6, c)
    end do
    l = x
    do m = first, last
      j = upper(m)
      do c = 1, 6
        column = upper_block(:, c, m)
        work(:, c, j) = work(:, c, j) - x(:, 1)*column(1) - x(:, 2)*column(2) - x(:, 3)*column(3) - x(:, 4)*column(4) - &
                        x(:, 5)*column(5) - x(:, 6)*column(6)
      end do
    end do
  end subroutine eliminate6

  subroutine eliminate2(first, last, upper, upper_block, inverse, own, l, work)
    integer(c_int64_t), intent(in) :: first, last
    integer(c_int32_t), intent(in) :: upper(*)
    real(c_double), intent(in)     :: upper_block(2, 2, *), inverse(2, 2), own(2, 2)
    real(c_double), intent(out)    :: l(2, 2)
    real(c_double), intent(inout)  :: work(2, 2, *)
    real(c_double) :: x(2, 2)
    integer(c_int64_t) :: m, j
    integer :: c
    do c = 1, 2
      x(:, c) = own(:, 1)*inverse(1, c) + own(:, 2)*inverse(2, c)
    end do
    l = x
    do m = first, last
      j = upper(m)
      do c = 1, 2
        work(:, c, j) = work(:, c, j) - x(:, 1)*upper_block(1, c, m) - x(:, 2)*upper_block(2, c, m)
      end do
    end do
  end subroutine eliminate2

  !> Gauss-Jordan with the largest pivot of each column, each row in a unit of its own: those of a body are forces and moments.
  pure subroutine invert(dim, given, inverse, regular)
    integer(c_int32_t), intent(in) :: dim
    real(c_double), intent(in)     :: given(dim, dim)
    real(c_double), intent(out)    :: inverse(dim, dim)
    logical, intent(out)           :: regular
    real(c_double) :: a(dim, dim), row(dim), weight(dim), factor
    integer :: c, p, i
    a = given
    weight = row_weights(dim, given)
    inverse = 0
    do c = 1, dim
      inverse(c, c) = 1
    end do
    regular = .false.
    do c = 1, dim
      p = c
      do i = c + 1, dim
        if (weight(i)*abs(a(i, c)) > weight(p)*abs(a(p, c))) p = i
      end do
      if (.not. (abs(a(p, c)) > 0 .and. abs(a(p, c)) <= huge(factor))) return
      if (p /= c) then
        row = a(c, :)
        a(c, :) = a(p, :)
        a(p, :) = row
        factor = weight(c)
        weight(c) = weight(p)
        weight(p) = factor
        row = inverse(c, :)
        inverse(c, :) = inverse(p, :)
        inverse(p, :) = row
      end if
      factor = 1/a(c, c)
      a(c, :) = factor*a(c, :)
      inverse(c, :) = factor*inverse(c, :)
      do i = 1, dim
        if (i == c) cycle
        factor = a(i, c)
        a(i, :) = a(i, :) - factor*a(c, :)
        inverse(i, :) = inverse(i, :) - factor*inverse(c, :)
      end do
    end do
    regular = .true.
  end subroutine invert

  !> Solution in place of b; inactive entries are unchanged.
  subroutine cairn_block_solve(dim, n, order, active, lower_start, lower_last, lower_kept, upper_start, upper_last, upper_kept, &
                               lower_block, upper_block, diagonal, b, x) bind(c)
    integer(c_int32_t), value      :: dim              !< of a block: 2, 3 or 6
    integer(c_int64_t), value      :: n                !< contacts
    integer(c_int32_t), intent(in) :: order(n)         !< contact at each place, from 0
    integer(c_int32_t), intent(in) :: active(n)        !< of a contact
    integer(c_int64_t), intent(in) :: lower_start(n+1) !< from 0
    integer(c_int64_t), intent(in) :: lower_last(n)
    integer(c_int32_t), intent(in) :: lower_kept(*)    !< places from 1
    integer(c_int64_t), intent(in) :: upper_start(n+1) !< from 0
    integer(c_int64_t), intent(in) :: upper_last(n)
    integer(c_int32_t), intent(in) :: upper_kept(*)    !< places from 1
    real(c_double), intent(in)     :: lower_block(dim*dim, *)
    real(c_double), intent(in)     :: upper_block(dim*dim, *)
    real(c_double), intent(in)     :: diagonal(dim*dim, n)
    real(c_double), intent(inout)  :: b(dim, n)        !< by contacts
    real(c_double), intent(inout)  :: x(dim, n)        !< workspace
    real(c_double) :: y(6)
    integer(c_int64_t) :: i, m
    do i = 1, n
      if (active(order(i)+1) == 0) cycle
      y(:dim) = b(:, order(i)+1)
      do m = lower_start(i) + 1, lower_last(i)
        call subtract(dim, lower_block(:, m), x(:, lower_kept(m)), y)
      end do
      x(:, i) = y(:dim)
    end do
    do i = n, 1, -1
      if (active(order(i)+1) == 0) cycle
      y(:dim) = x(:, i)
      do m = upper_start(i) + 1, upper_last(i)
        call subtract(dim, upper_block(:, m), x(:, upper_kept(m)), y)
      end do
      x(:, i) = 0
      call subtract(dim, diagonal(:, i), -y(:dim), x(:, i))
      b(:, order(i)+1) = x(:, i)
    end do
  end subroutine cairn_block_solve

  !> y - m x
  pure subroutine subtract(dim, m, x, y)
    integer(c_int32_t), intent(in) :: dim
    real(c_double), intent(in)     :: m(dim*dim), x(dim)
    real(c_double), intent(inout)  :: y(dim)
    integer :: k
    if (dim == 3) then
      y(1) = y(1) - m(1)*x(1) - m(4)*x(2) - m(7)*x(3)
      y(2) = y(2) - m(2)*x(1) - m(5)*x(2) - m(8)*x(3)
      y(3) = y(3) - m(3)*x(1) - m(6)*x(2) - m(9)*x(3)
    else if (dim == 6) then
      do k = 1, 6
        y = y - m(6*k-5:6*k)*x(k)
      end do
    else
      y(1) = y(1) - m(1)*x(1) - m(3)*x(2)
      y(2) = y(2) - m(2)*x(1) - m(4)*x(2)
    end if
  end subroutine subtract
  !> Powers of two that equilibrate rows: roots of the diagonal entries relative to the first. A change of the units of mass or
  !> length by a power of two then changes no choice of a pivot. 1 where a diagonal entry vanishes.
  pure function row_weights(dim, a) result(weight)
    integer(c_int32_t), intent(in) :: dim
    real(c_double), intent(in)     :: a(dim, dim)
    real(c_double) :: weight(dim)
    integer :: i
    weight = 1
    do i = 1, dim
      if (.not. (abs(a(i, i)) > 0 .and. abs(a(i, i)) <= huge(weight))) return
    end do
    do i = 2, dim
      weight(i) = set_exponent(1.0_c_double, 1 - shifta(exponent(a(i, i)) - exponent(a(1, 1)), 1))
    end do
  end function row_weights
end module block_factors
