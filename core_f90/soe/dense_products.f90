!> Products within factors of blocks of columns, by eight terms at a time: four columns take four terms together, which halves the
!> memory traffic. Terms of an entry are added in a fixed order, independent of the other entries.
module dense_products
  use, intrinsic :: iso_c_binding, only: c_int64_t, c_double
  implicit none
  private
  public :: take_block, take_one
contains

  !> c = c - a b', with the rows of b for the columns of c; eight terms.
  pure subroutine take_block(rows, columns, leading_a, a, leading_b, b, leading_c, c)
    integer(c_int64_t), intent(in) :: rows, columns, leading_a, leading_b, leading_c
    real(c_double), intent(in)     :: a(leading_a, *) !< (rows, 8)
    real(c_double), intent(in)     :: b(leading_b, *) !< (columns, 8)
    real(c_double), intent(inout)  :: c(leading_c, *) !< (rows, columns)
    integer(c_int64_t) :: j
    do j = 1, columns - 3, 4
      call take_four(rows, leading_a, leading_b, leading_c, a, b(j, 1), c(1, j))
      call take_four(rows, leading_a, leading_b, leading_c, a(1, 5), b(j, 5), c(1, j))
    end do
    do j = columns - mod(columns, 4_c_int64_t) + 1, columns
      call take_eight(rows, leading_a, leading_b, a, b(j, 1), c(1, j))
    end do
  end subroutine take_block

  !> c = c - a b, of one column.
  pure subroutine take_one(rows, a, b, c)
    integer(c_int64_t), intent(in) :: rows
    real(c_double), intent(in)     :: a(rows), b
    real(c_double), intent(inout)  :: c(rows)
    integer(c_int64_t) :: i
    do i = 1, rows
      c(i) = c(i) - a(i)*b
    end do
  end subroutine take_one

  !> Eight terms of one column.
  pure subroutine take_eight(rows, leading_a, leading_b, a, b, c)
    integer(c_int64_t), intent(in) :: rows, leading_a, leading_b
    real(c_double), intent(in)     :: a(leading_a, *), b(leading_b, *)
    real(c_double), intent(inout)  :: c(rows)
    integer(c_int64_t) :: i
    real(c_double) :: b1, b2, b3, b4, b5, b6, b7, b8
    b1 = b(1, 1)
    b2 = b(1, 2)
    b3 = b(1, 3)
    b4 = b(1, 4)
    b5 = b(1, 5)
    b6 = b(1, 6)
    b7 = b(1, 7)
    b8 = b(1, 8)
    do i = 1, rows
      c(i) = c(i) - a(i, 1)*b1 - a(i, 2)*b2 - a(i, 3)*b3 - a(i, 4)*b4 - a(i, 5)*b5 - a(i, 6)*b6 - a(i, 7)*b7 - a(i, 8)*b8
    end do
  end subroutine take_eight

  !> Four terms of four columns: sixteen factors stay at hand, so that each row of a is fetched once for four.
  pure subroutine take_four(rows, leading_a, leading_b, leading_c, a, b, c)
    integer(c_int64_t), intent(in) :: rows, leading_a, leading_b, leading_c
    real(c_double), intent(in)     :: a(leading_a, 4), b(leading_b, 4)
    real(c_double), intent(inout)  :: c(leading_c, 4)
    integer(c_int64_t) :: i
    real(c_double) :: b11, b12, b13, b14, b21, b22, b23, b24, b31, b32, b33, b34, b41, b42, b43, b44
    b11 = b(1, 1)
    b12 = b(1, 2)
    b13 = b(1, 3)
    b14 = b(1, 4)
    b21 = b(2, 1)
    b22 = b(2, 2)
    b23 = b(2, 3)
    b24 = b(2, 4)
    b31 = b(3, 1)
    b32 = b(3, 2)
    b33 = b(3, 3)
    b34 = b(3, 4)
    b41 = b(4, 1)
    b42 = b(4, 2)
    b43 = b(4, 3)
    b44 = b(4, 4)
    do i = 1, rows
      c(i, 1) = c(i, 1) - a(i, 1)*b11 - a(i, 2)*b12 - a(i, 3)*b13 - a(i, 4)*b14
      c(i, 2) = c(i, 2) - a(i, 1)*b21 - a(i, 2)*b22 - a(i, 3)*b23 - a(i, 4)*b24
      c(i, 3) = c(i, 3) - a(i, 1)*b31 - a(i, 2)*b32 - a(i, 3)*b33 - a(i, 4)*b34
      c(i, 4) = c(i, 4) - a(i, 1)*b41 - a(i, 2)*b42 - a(i, 3)*b43 - a(i, 4)*b44
    end do
  end subroutine take_four

end module dense_products
