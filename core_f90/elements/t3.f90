!> Triangle of three nodes, counter-clockwise: constant strain (Turner et al. 1956).
module t3
  use, intrinsic :: iso_c_binding, only: c_double
  use shape_families, only: simplex
  implicit none
  private
  public :: cairn_element_t3_rule, cairn_element_t3_bulk_rule, cairn_element_t3_shape
  integer, parameter :: dim = 2, nodes = 3, points = 3, bulk_points = 1
contains

  !> Three points, exact for the square of the shape functions.
  pure subroutine cairn_element_t3_rule(xi, weight) bind(c)
    real(c_double), intent(out) :: xi(dim, points) !< in the parent element
    real(c_double), intent(out) :: weight(points)
    integer :: p
    xi = 1.0_c_double/6
    do p = 1, dim
      xi(p, p) = 2.0_c_double/3
    end do
    weight = 1.0_c_double/6
  end subroutine cairn_element_t3_rule

  !> One point: the strain is constant.
  pure subroutine cairn_element_t3_bulk_rule(xi, weight) bind(c)
    real(c_double), intent(out) :: xi(dim, bulk_points) !< in the parent element
    real(c_double), intent(out) :: weight(bulk_points)
    xi = 1.0_c_double/3
    weight = 0.5_c_double
  end subroutine cairn_element_t3_bulk_rule

  pure subroutine cairn_element_t3_shape(xi, value, gradient) bind(c)
    real(c_double), intent(in)  :: xi(dim)
    real(c_double), intent(out) :: value(nodes)
    real(c_double), intent(out) :: gradient(dim, nodes) !< along xi
    call simplex(dim, xi, value, gradient)
  end subroutine cairn_element_t3_shape
end module t3
