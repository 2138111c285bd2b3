!> Hexahedron of 27 nodes: as hex20, then the middles of the faces -x +x -y +y -z +z and of the body: triquadratic.
module hex27
  use, intrinsic :: iso_c_binding, only: c_double
  use shape_families, only: product_of_parabolas, gauss_product
  implicit none
  private
  public :: cairn_element_hex27_rule, cairn_element_hex27_bulk_rule, cairn_element_hex27_shape
  integer, parameter :: dim = 3, nodes = 27, points = 27, bulk_points = 27
  integer, parameter :: place(dim, nodes) = reshape([ &
    -1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, -1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1, 0, &
    -1, -1, 1, 0, -1, 0, 1, -1, -1, 0, -1, 0, -1, 1, 1, 0, 1, 0, 1, 1, -1, 0, 1, -1, -1, 0, &
    1, -1, 0, 1, 1, 0, -1, 1, 0, -1, 0, 0, 1, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, -1, 0, 0, 1, 0, &
    0, 0], [dim, nodes])
contains

  !> Gauss's three points along each axis.
  pure subroutine cairn_element_hex27_rule(xi, weight) bind(c)
    real(c_double), intent(out) :: xi(dim, points) !< in the parent element
    real(c_double), intent(out) :: weight(points)
    call gauss_product(dim, 3, xi, weight)
  end subroutine cairn_element_hex27_rule

  !> The same.
  pure subroutine cairn_element_hex27_bulk_rule(xi, weight) bind(c)
    real(c_double), intent(out) :: xi(dim, bulk_points) !< in the parent element
    real(c_double), intent(out) :: weight(bulk_points)
    call gauss_product(dim, 3, xi, weight)
  end subroutine cairn_element_hex27_bulk_rule

  pure subroutine cairn_element_hex27_shape(xi, value, gradient) bind(c)
    real(c_double), intent(in)  :: xi(dim)
    real(c_double), intent(out) :: value(nodes)
    real(c_double), intent(out) :: gradient(dim, nodes) !< along xi
    call product_of_parabolas(dim, nodes, place, xi, value, gradient)
  end subroutine cairn_element_hex27_shape
end module hex27
