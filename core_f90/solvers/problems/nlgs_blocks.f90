!> Block nonlinear Gauss-Seidel over the blocks of W (Moreau 1988, Jean 1999): each contact in turn is solved exactly, the others
!> held fixed. Sweeps read W once prepared: blocks beside the diagonal as four rows of which the last is zero (two in 2D), which one
!> vector register holds, and of each diagonal block what its contact's solution needs.
module nlgs_blocks
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  use cone_projection, only: project_disk
  use contact_block, only: prepare_block2, solve_block2, prepare_block3, solve_block3, contact_block_size
  implicit none
  private
  public :: cairn_nlgs_prepare, cairn_nlgs_blocks
contains

  !> Prepares the data of sweeps. Row a of the off-diagonal blocks goes from row_start(a) - a to row_start(a+1) - a - 1.
  subroutine cairn_nlgs_prepare(dim, n, row_start, column, block, beside_column, beside, local) bind(c)
    integer(c_int32_t), value       :: dim              !< components of a contact, 2 or 3
    integer(c_int64_t), value       :: n                !< contacts
    integer(c_int64_t), intent(in)  :: row_start(n+1)   !< from 0
    integer(c_int32_t), intent(in)  :: column(*)        !< from 0
    real(c_double), intent(in)      :: block(dim, dim, *) !< [1/kg]
    integer(c_int32_t), intent(out) :: beside_column(*) !< (blocks - n) from 0
    real(c_double), intent(out)     :: beside(2*dim - 2, dim, *) !< (.., blocks - n) [1/kg]
    real(c_double), intent(out)     :: local(contact_block_size, n) !< of each contact
    integer(c_int64_t) :: a, k, to
    to = 0
    do a = 1, n
      do k = row_start(a) + 1, row_start(a+1)
        if (column(k) + 1 == a) then
          if (dim == 3) then
            call prepare_block3(block(:, :, k), local(:, a))
          else
            call prepare_block2(block(:, :, k), local(:, a))
          end if
        else
          to = to + 1
          beside_column(to) = column(k)
          beside(1:dim, :, to) = block(:, :, k)
          if (dim == 3) beside(4, :, to) = 0
        end if
      end do
    end do
  end subroutine cairn_nlgs_prepare

  !> Sweeps over contacts order(first), ..., order(last-1). With several threads these must be uncoupled (of the same colour).
  subroutine cairn_nlgs_blocks(dim, n, row_start, beside_column, beside, local, q, mu, first, last, order, relaxation, slip, &
                               r, change, threads) bind(c)
    integer(c_int32_t), value      :: dim              !< components of a contact, 2 or 3
    integer(c_int64_t), value      :: n                !< contacts
    integer(c_int64_t), intent(in) :: row_start(n+1)   !< of W, from 0
    integer(c_int32_t), intent(in) :: beside_column(*) !< of cairn_nlgs_prepare
    real(c_double), intent(in)     :: beside(2*dim - 2, dim, *) !< of cairn_nlgs_prepare [1/kg]
    real(c_double), intent(in)     :: local(contact_block_size, n) !< of cairn_nlgs_prepare
    real(c_double), intent(in)     :: q(dim, n)        !< velocity with r = 0 [m/s]
    real(c_double), intent(in)     :: mu(n)            !< friction [-]
    integer(c_int64_t), value      :: first            !< place in order, from 0
    integer(c_int64_t), value      :: last             !< one past the last place
    integer(c_int32_t), intent(in) :: order(n)         !< contacts, from 0
    real(c_double), value          :: relaxation       !< (0, 2): by which a change exceeds what its contact alone would ask
    real(c_double), intent(inout)  :: slip(n)          !< from sweep to sweep; begins with 0 [1/kg]
    real(c_double), intent(inout)  :: r(dim, n)        !< impulse [N s]
    real(c_double), intent(inout)  :: change(n)        !< W_NN |change of r|^2 of these contacts [J]
    integer(c_int32_t), value      :: threads
    integer(c_int64_t) :: t
    if (threads <= 1) then ! a region of one thread costs as much as a sweep of a small problem
      call some(first, last)
      return
    end if
    !$omp parallel do num_threads(threads) schedule(static)
    do t = 0, threads - 1
      call some(first + (last - first)*t/threads, first + (last - first)*(t + 1)/threads)
    end do
  contains
    subroutine some(from, to)
      integer(c_int64_t), intent(in) :: from !< place in order, from 0
      integer(c_int64_t), intent(in) :: to   !< one past the last place
      integer(c_int64_t) :: i, a
      if (dim == 3) then
        do i = from + 1, to
          a = order(i) + 1
          call one3(a, row_start, beside_column, beside, local(:, a), q, mu(a), relaxation, slip(a), r, change(a))
        end do
      else
        do i = from + 1, to
          a = order(i) + 1
          call one2(a, row_start, beside_column, beside, local(:, a), q, mu(a), relaxation, r, change(a))
        end do
      end if
    end subroutine some
  end subroutine cairn_nlgs_blocks

  subroutine one2(a, row_start, column, beside, local, q, mu, relaxation, r, change)
    integer(c_int64_t), intent(in) :: a               !< contact, from 1
    integer(c_int64_t), intent(in) :: row_start(*)    !< of W, from 0
    integer(c_int32_t), intent(in) :: column(*)       !< from 0
    real(c_double), intent(in)     :: beside(2, 2, *) !< [1/kg]
    real(c_double), intent(in)     :: local(contact_block_size) !< of prepare_block2
    real(c_double), intent(in)     :: q(2, *)         !< [m/s]
    real(c_double), intent(in)     :: mu              !< friction [-]
    real(c_double), intent(in)     :: relaxation      !< [-]
    real(c_double), intent(inout)  :: r(2, *)         !< [N s]
    real(c_double), intent(out)    :: change          !< [J]
    real(c_double) :: u(2), solved(2)
    integer(c_int64_t) :: k, b
    u = q(:, a)
    do k = row_start(a) - a + 2, row_start(a+1) - a
      b = column(k) + 1
      u = u + beside(:, 1, k)*r(1, b) + beside(:, 2, k)*r(2, b)
    end do
    call solve_block2(local, u, mu, solved)
    if (abs(relaxation - 1) > 0) then
      call take(2_c_int32_t, 1/local(1), mu, relaxation, solved, r(:, a), change)
    else
      change = ((solved(1) - r(1, a))**2 + (solved(2) - r(2, a))**2)*local(5)
      r(:, a) = solved
    end if
  end subroutine one2

  subroutine one3(a, row_start, column, beside, local, q, mu, relaxation, slip, r, change)
    integer(c_int64_t), intent(in) :: a               !< contact, from 1
    integer(c_int64_t), intent(in) :: row_start(*)    !< of W, from 0
    integer(c_int32_t), intent(in) :: column(*)       !< from 0
    real(c_double), intent(in)     :: beside(4, 3, *) !< [1/kg]
    real(c_double), intent(in)     :: local(contact_block_size) !< of prepare_block3
    real(c_double), intent(in)     :: q(3, *)         !< [m/s]
    real(c_double), intent(in)     :: mu              !< friction [-]
    real(c_double), intent(in)     :: relaxation      !< [-]
    real(c_double), intent(inout)  :: slip            !< [1/kg]
    real(c_double), intent(inout)  :: r(3, *)         !< [N s]
    real(c_double), intent(out)    :: change          !< [J]
    real(c_double) :: x(4), y(4), z(4), solved(3), next(3)
    integer(c_int64_t) :: k, b
    x = 0
    y = 0
    z = 0
    do k = row_start(a) - a + 2, row_start(a+1) - a
      b = column(k) + 1
      x = x + beside(:, 1, k)*r(1, b)
      y = y + beside(:, 2, k)*r(2, b)
      z = z + beside(:, 3, k)*r(3, b)
    end do
    x(1:3) = q(:, a) + (x(1:3) + y(1:3) + z(1:3))
    call solve_block3(local, x(1:3), mu, slip, solved)
    if (abs(relaxation - 1) > 0) then
      call take(3_c_int32_t, 1/local(1), mu, relaxation, solved, r(:, a), change)
    else
      next = solved - r(:, a)
      change = (next(1)**2 + next(2)**2 + next(3)**2)/local(1)
      r(:, a) = solved
    end if
  end subroutine one3

  !> Goes a part of the way to the contact's own solution, or beyond it, and stays in the cone.
  pure subroutine take(dim, w_nn, mu, relaxation, solved, r, change)
    integer(c_int32_t), intent(in) :: dim         !< 2 or 3
    real(c_double), intent(in)     :: w_nn        !< [1/kg]
    real(c_double), intent(in)     :: mu          !< friction [-]
    real(c_double), intent(in)     :: relaxation  !< [-]
    real(c_double), intent(in)     :: solved(dim) !< [N s]
    real(c_double), intent(inout)  :: r(dim)      !< [N s]
    real(c_double), intent(out)    :: change      !< [J]
    real(c_double) :: next(dim)
    next = solved
    if (abs(relaxation - 1) > 0) then
      next = r + relaxation*(solved - r)
      call project_disk(dim, mu, next)
    end if
    change = w_nn*sum((next - r)**2)
    r = next
  end subroutine take
end module nlgs_blocks
