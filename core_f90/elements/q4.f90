!> Quadrilateral of four nodes, counter-clockwise: bilinear, fully integrated; it locks in bending and near nu = 1/2.
module q4
  use, intrinsic :: iso_c_binding, only: c_double
  use shape_families, only: product_of_lines, gauss_product
  implicit none
  private
  public :: cairn_element_q4_rule, cairn_element_q4_bulk_rule, cairn_element_q4_shape
  integer, parameter :: dim = 2, nodes = 4, points = 4, bulk_points = 4
  real(c_double), parameter :: corner(dim, nodes) = reshape([-1, -1, 1, -1, 1, 1, -1, 1], [dim, nodes])
contains

  !> Gauss's two points along each axis.
  pure subroutine cairn_element_q4_rule(xi, weight) bind(c)
    real(c_double), intent(out) :: xi(dim, points) !< in the parent element
    real(c_double), intent(out) :: weight(points)
    xi = corner/sqrt(3.0_c_double)
    weight = 1
  end subroutine cairn_element_q4_rule

  !> Gauss's two points along each axis.
  pure subroutine cairn_element_q4_bulk_rule(xi, weight) bind(c)
    real(c_double), intent(out) :: xi(dim, bulk_points) !< in the parent element
    real(c_double), intent(out) :: weight(bulk_points)
    call gauss_product(dim, 2, xi, weight)
  end subroutine cairn_element_q4_bulk_rule

  pure subroutine cairn_element_q4_shape(xi, value, gradient) bind(c)
    real(c_double), intent(in)  :: xi(dim)
    real(c_double), intent(out) :: value(nodes)
    real(c_double), intent(out) :: gradient(dim, nodes) !< along xi
    call product_of_lines(dim, nodes, corner, xi, value, gradient)
  end subroutine cairn_element_q4_shape
end module q4
