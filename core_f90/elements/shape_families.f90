!> Shape functions that elements of several dimensions share.
module shape_families
  use, intrinsic :: iso_c_binding, only: c_double
  implicit none
  private
  public :: simplex, product_of_lines

contains

  !> Linear on a simplex, the first node at the origin of xi.
  pure subroutine simplex(dim, xi, value, gradient)
    integer, intent(in)         :: dim
    real(c_double), intent(in)  :: xi(dim)
    real(c_double), intent(out) :: value(dim + 1), gradient(dim, dim + 1)
    integer :: i
    value(1) = 1 - sum(xi)
    value(2:) = xi
    gradient = 0
    gradient(:, 1) = -1
    do i = 1, dim
      gradient(i, i + 1) = 1
    end do
  end subroutine simplex

  !> Products of functions linear along each axis, on [-1, 1]^dim with a node at each corner.
  pure subroutine product_of_lines(dim, nodes, corner, xi, value, gradient)
    integer, intent(in)         :: dim, nodes
    real(c_double), intent(in)  :: corner(dim, nodes), xi(dim)
    real(c_double), intent(out) :: value(nodes), gradient(dim, nodes)
    real(c_double) :: f(dim)
    integer :: i, k
    do i = 1, nodes
      f = 0.5_c_double*(1 + corner(:, i)*xi)
      value(i) = product(f)
      do k = 1, dim
        gradient(k, i) = 0.5_c_double*corner(k, i)*product(f(:k - 1))*product(f(k + 1:))
      end do
    end do
  end subroutine product_of_lines
end module shape_families
