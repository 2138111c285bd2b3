!> Products with W of a frictional contact problem: square blocks by rows, columns rising, a diagonal block in each row.
module problem_blocks
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_block_product, cairn_block_diagonal
contains

  !> u = W r + q. Each row is one sum, so the bits do not depend on threads.
  subroutine cairn_block_product(dim, n, row_start, column, block, q, r, u, threads) bind(c)
    integer(c_int32_t), value       :: dim            !< components of a contact, 2 or 3
    integer(c_int64_t), value       :: n              !< contacts
    integer(c_int64_t), intent(in)  :: row_start(n+1) !< from 0
    integer(c_int32_t), intent(in)  :: column(*)      !< from 0
    real(c_double), intent(in)      :: block(dim, dim, *) !< [1/kg]
    real(c_double), intent(in)      :: q(dim, n)      !< velocity with r = 0 [m/s]
    real(c_double), intent(in)      :: r(dim, n)      !< impulse [N s]
    real(c_double), intent(out)     :: u(dim, n)      !< relative velocity [m/s]
    integer(c_int32_t), value       :: threads
    integer(c_int64_t) :: t
    if (threads <= 1) then ! a region of one thread costs as much as the product of a small problem
      call rows(0_c_int64_t, n)
      return
    end if
    !$omp parallel do num_threads(threads) schedule(static)
    do t = 0, threads - 1
      call rows(n*t/threads, n*(t + 1)/threads)
    end do
  contains
    subroutine rows(first, last)
      integer(c_int64_t), intent(in) :: first !< from 0
      integer(c_int64_t), intent(in) :: last  !< one past the last
      if (dim == 3) then
        call product3(first, last, row_start, column, block, q, r, u)
      else
        call product2(first, last, row_start, column, block, q, r, u)
      end if
    end subroutine rows
  end subroutine cairn_block_product

  subroutine product2(first, last, row_start, column, block, q, r, u)
    integer(c_int64_t), intent(in) :: first          !< row, from 0
    integer(c_int64_t), intent(in) :: last           !< one past the last
    integer(c_int64_t), intent(in) :: row_start(*)   !< from 0
    integer(c_int32_t), intent(in) :: column(*)      !< from 0
    real(c_double), intent(in)     :: block(2, 2, *) !< [1/kg]
    real(c_double), intent(in)     :: q(2, *)        !< [m/s]
    real(c_double), intent(in)     :: r(2, *)        !< [N s]
    real(c_double), intent(inout)  :: u(2, *)        !< [m/s]
    real(c_double) :: x, y
    integer(c_int64_t) :: a, k, b
    do a = first + 1, last
      x = q(1, a)
      y = q(2, a)
      do k = row_start(a) + 1, row_start(a+1)
        b = column(k) + 1
        x = x + block(1, 1, k)*r(1, b) + block(1, 2, k)*r(2, b)
        y = y + block(2, 1, k)*r(1, b) + block(2, 2, k)*r(2, b)
      end do
      u(1, a) = x
      u(2, a) = y
    end do
  end subroutine product2

  subroutine product3(first, last, row_start, column, block, q, r, u)
    integer(c_int64_t), intent(in) :: first          !< row, from 0
    integer(c_int64_t), intent(in) :: last           !< one past the last
    integer(c_int64_t), intent(in) :: row_start(*)   !< from 0
    integer(c_int32_t), intent(in) :: column(*)      !< from 0
    real(c_double), intent(in)     :: block(3, 3, *) !< [1/kg]
    real(c_double), intent(in)     :: q(3, *)        !< [m/s]
    real(c_double), intent(in)     :: r(3, *)        !< [N s]
    real(c_double), intent(inout)  :: u(3, *)        !< [m/s]
    real(c_double) :: x, y, z
    integer(c_int64_t) :: a, k, b
    do a = first + 1, last
      x = q(1, a)
      y = q(2, a)
      z = q(3, a)
      do k = row_start(a) + 1, row_start(a+1)
        b = column(k) + 1
        x = x + block(1, 1, k)*r(1, b) + block(1, 2, k)*r(2, b) + block(1, 3, k)*r(3, b)
        y = y + block(2, 1, k)*r(1, b) + block(2, 2, k)*r(2, b) + block(2, 3, k)*r(3, b)
        z = z + block(3, 1, k)*r(1, b) + block(3, 2, k)*r(2, b) + block(3, 3, k)*r(3, b)
      end do
      u(1, a) = x
      u(2, a) = y
      u(3, a) = z
    end do
  end subroutine product3

  !> Place of each row's diagonal block, -1 where a row has none, and its first element.
  subroutine cairn_block_diagonal(dim, n, row_start, column, block, place, w_nn) bind(c)
    integer(c_int32_t), value       :: dim            !< components of a contact, 2 or 3
    integer(c_int64_t), value       :: n              !< contacts
    integer(c_int64_t), intent(in)  :: row_start(n+1) !< from 0
    integer(c_int32_t), intent(in)  :: column(*)      !< from 0
    real(c_double), intent(in)      :: block(dim, dim, *) !< [1/kg]
    integer(c_int64_t), intent(out) :: place(n)       !< of the diagonal block, from 0
    real(c_double), intent(out)     :: w_nn(n)        !< [1/kg]
    integer(c_int64_t) :: a, k
    do a = 1, n
      place(a) = -1
      w_nn(a) = 0
      do k = row_start(a) + 1, row_start(a+1)
        if (column(k) + 1 /= a) cycle
        place(a) = k - 1
        w_nn(a) = block(1, 1, k)
      end do
    end do
  end subroutine cairn_block_diagonal
end module problem_blocks
