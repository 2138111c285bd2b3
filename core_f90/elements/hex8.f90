!> Hexahedron of eight nodes, bottom counter-clockwise, then top: trilinear, fully integrated; it locks as q4 does.
module hex8
  use, intrinsic :: iso_c_binding, only: c_double
  use shape_families, only: product_of_lines, gauss_product
  implicit none
  private
  public :: cairn_element_hex8_rule, cairn_element_hex8_bulk_rule, cairn_element_hex8_shape
  integer, parameter :: dim = 3, nodes = 8, points = 8, bulk_points = 8
  real(c_double), parameter :: corner(dim, nodes) = reshape([-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, &
                                                             -1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1], [dim, nodes])
contains

  !> Gauss's two points along each axis.
  pure subroutine cairn_element_hex8_rule(xi, weight) bind(c)
    real(c_double), intent(out) :: xi(dim, points) !< in the parent element
    real(c_double), intent(out) :: weight(points)
    xi = corner/sqrt(3.0_c_double)
    weight = 1
  end subroutine cairn_element_hex8_rule

  !> Gauss's two points along each axis.
  pure subroutine cairn_element_hex8_bulk_rule(xi, weight) bind(c)
    real(c_double), intent(out) :: xi(dim, bulk_points) !< in the parent element
    real(c_double), intent(out) :: weight(bulk_points)
    call gauss_product(dim, 2, xi, weight)
  end subroutine cairn_element_hex8_bulk_rule

  pure subroutine cairn_element_hex8_shape(xi, value, gradient) bind(c)
    real(c_double), intent(in)  :: xi(dim)
    real(c_double), intent(out) :: value(nodes)
    real(c_double), intent(out) :: gradient(dim, nodes) !< along xi
    call product_of_lines(dim, nodes, corner, xi, value, gradient)
  end subroutine cairn_element_hex8_shape
end module hex8
