!> Triangle of six nodes: corners counter-clockwise, then the middles of the edges from the first on: quadratic.
module t6
  use, intrinsic :: iso_c_binding, only: c_double
  use shape_families, only: quadratic_simplex
  implicit none
  private
  public :: cairn_element_t6_rule, cairn_element_t6_bulk_rule, cairn_element_t6_shape
  integer, parameter :: dim = 2, nodes = 6, points = 6, bulk_points = 3
  integer, parameter :: edge(2, 3) = reshape([1, 2, 2, 3, 3, 1], [2, 3])
contains

  !> Six points, exact for the square of the shape functions (Dunavant 1985).
  pure subroutine cairn_element_t6_rule(xi, weight) bind(c)
    real(c_double), intent(out) :: xi(dim, points) !< in the parent element
    real(c_double), intent(out) :: weight(points)
    real(c_double), parameter :: inner = 0.44594849091596489_c_double, outer = 0.09157621350977073_c_double
    integer :: p
    xi(:, :3) = inner
    xi(:, 4:) = outer
    do p = 1, dim
      xi(p, p + 1) = 1 - 2*inner
      xi(p, p + 4) = 1 - 2*outer
    end do
    weight(:3) = 0.22338158967801147_c_double/2
    weight(4:) = 0.10995174365532187_c_double/2
  end subroutine cairn_element_t6_rule

  !> Three points, exact for the square of the strain where edges are straight.
  pure subroutine cairn_element_t6_bulk_rule(xi, weight) bind(c)
    real(c_double), intent(out) :: xi(dim, bulk_points) !< in the parent element
    real(c_double), intent(out) :: weight(bulk_points)
    integer :: p
    xi = 1.0_c_double/6
    do p = 1, dim
      xi(p, p + 1) = 2.0_c_double/3
    end do
    weight = 1.0_c_double/6
  end subroutine cairn_element_t6_bulk_rule

  pure subroutine cairn_element_t6_shape(xi, value, gradient) bind(c)
    real(c_double), intent(in)  :: xi(dim)
    real(c_double), intent(out) :: value(nodes)
    real(c_double), intent(out) :: gradient(dim, nodes) !< along xi
    call quadratic_simplex(dim, 3, edge, xi, value, gradient)
  end subroutine cairn_element_t6_shape
end module t6
