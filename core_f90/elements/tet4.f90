!> Tetrahedron of four nodes: constant strain. The fourth lies on the side to which 1, 2, 3 turn right-handed.
module tet4
  use, intrinsic :: iso_c_binding, only: c_double
  use shape_families, only: simplex
  implicit none
  private
  public :: cairn_element_tet4_rule, cairn_element_tet4_bulk_rule, cairn_element_tet4_shape
  integer, parameter :: dim = 3, nodes = 4, points = 4, bulk_points = 1
contains

  !> Four points, exact for the square of the shape functions.
  pure subroutine cairn_element_tet4_rule(xi, weight) bind(c)
    real(c_double), intent(out) :: xi(dim, points) !< in the parent element
    real(c_double), intent(out) :: weight(points)
    integer :: p
    xi = 0.1381966011250105_c_double
    do p = 1, dim
      xi(p, p) = 0.58541019662496852_c_double
    end do
    weight = 1.0_c_double/24
  end subroutine cairn_element_tet4_rule

  !> One point: the strain is constant.
  pure subroutine cairn_element_tet4_bulk_rule(xi, weight) bind(c)
    real(c_double), intent(out) :: xi(dim, bulk_points) !< in the parent element
    real(c_double), intent(out) :: weight(bulk_points)
    xi = 0.25_c_double
    weight = 1.0_c_double/6
  end subroutine cairn_element_tet4_bulk_rule

  pure subroutine cairn_element_tet4_shape(xi, value, gradient) bind(c)
    real(c_double), intent(in)  :: xi(dim)
    real(c_double), intent(out) :: value(nodes)
    real(c_double), intent(out) :: gradient(dim, nodes) !< along xi
    call simplex(dim, xi, value, gradient)
  end subroutine cairn_element_tet4_shape
end module tet4
