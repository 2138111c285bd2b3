!> Hexahedron of twenty nodes: corners as hex8, middles of the edges of the bottom, of the top, of those between.
module hex20
  use, intrinsic :: iso_c_binding, only: c_double
  use shape_families, only: serendipity, gauss_product
  implicit none
  private
  public :: cairn_element_hex20_rule, cairn_element_hex20_bulk_rule, cairn_element_hex20_shape
  integer, parameter :: dim = 3, nodes = 20, points = 27, bulk_points = 27
  integer, parameter :: place(dim, nodes) = reshape([ &
    -1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, -1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1, 0, &
    -1, -1, 1, 0, -1, 0, 1, -1, -1, 0, -1, 0, -1, 1, 1, 0, 1, 0, 1, 1, -1, 0, 1, -1, -1, 0, &
    1, -1, 0, 1, 1, 0, -1, 1, 0], [dim, nodes])
contains

  !> Gauss's three points along each axis.
  pure subroutine cairn_element_hex20_rule(xi, weight) bind(c)
    real(c_double), intent(out) :: xi(dim, points) !< in the parent element
    real(c_double), intent(out) :: weight(points)
    call gauss_product(dim, 3, xi, weight)
  end subroutine cairn_element_hex20_rule

  !> The same.
  pure subroutine cairn_element_hex20_bulk_rule(xi, weight) bind(c)
    real(c_double), intent(out) :: xi(dim, bulk_points) !< in the parent element
    real(c_double), intent(out) :: weight(bulk_points)
    call gauss_product(dim, 3, xi, weight)
  end subroutine cairn_element_hex20_bulk_rule

  pure subroutine cairn_element_hex20_shape(xi, value, gradient) bind(c)
    real(c_double), intent(in)  :: xi(dim)
    real(c_double), intent(out) :: value(nodes)
    real(c_double), intent(out) :: gradient(dim, nodes) !< along xi
    call serendipity(dim, nodes, place, xi, value, gradient)
  end subroutine cairn_element_hex20_shape
end module hex20
