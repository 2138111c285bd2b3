!> The linear system of a Newton step. Contact a has unknowns(a) unknowns y with dr = step + basis y, and as many rows
!>   left (W + alpha) dr + own y = target,
!> where W dr gathers from its neighbours; alpha is the weight of a proximal term. A contact with fewer unknowns than components
!> is filled up: left and basis are zero there, own is the identity. One with none is left out.
module newton_rows
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_newton_blocks, cairn_newton_targets, cairn_newton_step, cairn_newton_weights
contains

  !> The matrix on the pattern of W. Blocks of contacts that are left out are not touched.
  subroutine cairn_newton_blocks(dim, n, row_start, column, block, alpha, unknowns, left, basis, own, matrix) bind(c)
    integer(c_int32_t), value      :: dim            !< components of a contact, 2 or 3
    integer(c_int64_t), value      :: n              !< contacts
    integer(c_int64_t), intent(in) :: row_start(n+1) !< from 0
    integer(c_int32_t), intent(in) :: column(*)      !< from 0
    real(c_double), intent(in)     :: block(dim, dim, *) !< [1/kg]
    real(c_double), value          :: alpha          !< [1/kg]
    integer(c_int32_t), intent(in) :: unknowns(n)    !< of a contact
    real(c_double), intent(in)     :: left(dim, dim, n)  !< (unknown, component)
    real(c_double), intent(in)     :: basis(dim, dim, n) !< (component, unknown)
    real(c_double), intent(in)     :: own(dim, dim, n)   !< (unknown, unknown)
    real(c_double), intent(inout)  :: matrix(dim, dim, *)
    integer(c_int64_t) :: a, k, b
    integer(c_int32_t) :: c
    real(c_double) :: w(dim, dim)
    do a = 1, n
      if (unknowns(a) == 0) cycle
      do k = row_start(a) + 1, row_start(a+1)
        b = column(k) + 1
        if (unknowns(b) == 0) cycle
        if (a /= b) then
          call multiply(dim, left(:, :, a), block(:, :, k), basis(:, :, b), matrix(:, :, k))
        else
          w = block(:, :, k)
          do c = 1, dim
            w(c, c) = w(c, c) + alpha
          end do
          call multiply(dim, left(:, :, a), w, basis(:, :, b), matrix(:, :, k))
          matrix(:, :, k) = matrix(:, :, k) + own(:, :, a)
        end if
      end do
    end do
  end subroutine cairn_newton_blocks

  !> l w b
  pure subroutine multiply(dim, l, w, b, m)
    integer(c_int32_t), intent(in) :: dim
    real(c_double), intent(in)     :: l(dim, dim), w(dim, dim), b(dim, dim)
    real(c_double), intent(out)    :: m(dim, dim)
    real(c_double) :: x(3, 3)
    integer :: c
    if (dim == 3) then
      do c = 1, 3
        x(:, c) = l(:, 1)*w(1, c) + l(:, 2)*w(2, c) + l(:, dim)*w(dim, c)
      end do
      do c = 1, 3
        m(:, c) = x(:, 1)*b(1, c) + x(:, 2)*b(2, c) + x(:, 3)*b(dim, c)
      end do
    else
      do c = 1, 2
        x(:2, c) = l(:, 1)*w(1, c) + l(:, 2)*w(2, c)
      end do
      do c = 1, 2
        m(:, c) = x(:2, 1)*b(1, c) + x(:2, 2)*b(2, c)
      end do
    end if
  end subroutine multiply

  !> Right-hand side: remainder of the target after the known part of the step, which changes u by change.
  subroutine cairn_newton_targets(dim, n, alpha, unknowns, left, step, change, target, rhs) bind(c)
    integer(c_int32_t), value      :: dim            !< components of a contact, 2 or 3
    integer(c_int64_t), value      :: n              !< contacts
    real(c_double), value          :: alpha          !< [1/kg]
    integer(c_int32_t), intent(in) :: unknowns(n)    !< of a contact
    real(c_double), intent(in)     :: left(dim, dim, n) !< (unknown, component)
    real(c_double), intent(in)     :: step(dim, n)   !< [N s]
    real(c_double), intent(in)     :: change(dim, n) !< W step [m/s]
    real(c_double), intent(in)     :: target(dim, n) !< (unknown)
    real(c_double), intent(inout)  :: rhs(dim, n)    !< (unknown)
    integer(c_int64_t) :: a
    integer(c_int32_t) :: c
    do a = 1, n
      if (unknowns(a) == 0) cycle
      rhs(:, a) = target(:, a)
      do c = 1, dim
        rhs(:, a) = rhs(:, a) - left(:, c, a)*(change(c, a) + alpha*step(c, a))
      end do
    end do
  end subroutine cairn_newton_targets

  !> dr = step + basis y, in place of step.
  subroutine cairn_newton_step(dim, n, unknowns, basis, y, step) bind(c)
    integer(c_int32_t), value      :: dim            !< components of a contact, 2 or 3
    integer(c_int64_t), value      :: n              !< contacts
    integer(c_int32_t), intent(in) :: unknowns(n)    !< of a contact
    real(c_double), intent(in)     :: basis(dim, dim, n) !< (component, unknown)
    real(c_double), intent(in)     :: y(dim, n)      !< (unknown)
    real(c_double), intent(inout)  :: step(dim, n)   !< [N s]
    integer(c_int64_t) :: a
    integer(c_int32_t) :: c
    do a = 1, n
      if (unknowns(a) == 0) cycle
      do c = 1, dim
        step(:, a) = step(:, a) + basis(:, c, a)*y(c, a)
      end do
    end do
  end subroutine cairn_newton_step

  !> rho of a contact: 1/W_NN and 1/largest eigenvalue of W_TT, so that no unit enters.
  subroutine cairn_newton_weights(dim, n, place, block, rho) bind(c)
    integer(c_int32_t), value      :: dim      !< components of a contact, 2 or 3
    integer(c_int64_t), value      :: n        !< contacts
    integer(c_int64_t), intent(in) :: place(n) !< of the diagonal block, from 0
    real(c_double), intent(in)     :: block(dim, dim, *) !< [1/kg]
    real(c_double), intent(out)    :: rho(2, n) !< normal, tangential [kg]
    real(c_double) :: largest
    integer(c_int64_t) :: a, k
    do a = 1, n
      k = place(a) + 1
      if (dim == 2) then
        largest = block(2, 2, k)
      else
        largest = (block(2, 2, k) + block(dim, dim, k))/2 + &
                  sqrt(((block(2, 2, k) - block(dim, dim, k))/2)**2 + ((block(2, dim, k) + block(dim, 2, k))/2)**2)
      end if
      rho(1, a) = 1/block(1, 1, k)
      rho(2, a) = rho(1, a)
      if (largest > 1e-8_c_double*block(1, 1, k)) rho(2, a) = 1/largest
    end do
  end subroutine cairn_newton_weights
end module newton_rows
