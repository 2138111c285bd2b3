!> Tetrahedron of ten nodes: corners as tet4, then the middles of the edges 12 23 13 14 24 34: quadratic.
module tet10
  use, intrinsic :: iso_c_binding, only: c_double
  use shape_families, only: quadratic_simplex
  implicit none
  private
  public :: cairn_element_tet10_rule, cairn_element_tet10_bulk_rule, cairn_element_tet10_shape
  integer, parameter :: dim = 3, nodes = 10, points = 14, bulk_points = 4
  integer, parameter :: edge(2, 6) = reshape([1, 2, 2, 3, 1, 3, 1, 4, 2, 4, 3, 4], [2, 6])
contains

  !> Fourteen points, exact for polynomials of degree five (Walkington 2000).
  pure subroutine cairn_element_tet10_rule(xi, weight) bind(c)
    real(c_double), intent(out) :: xi(dim, points) !< in the parent element
    real(c_double), intent(out) :: weight(points)
    real(c_double), parameter :: a(2) = [0.31088591926330061_c_double, 0.09273525031089123_c_double]
    real(c_double), parameter :: share(2) = [0.11268792571801585_c_double, 0.07349304311636195_c_double]/6
    real(c_double), parameter :: c = 0.04550370412564965_c_double ! twice each, at the six points on lines between middles of edges
    real(c_double) :: l(dim + 1)
    integer :: p, k, i, j
    do k = 1, 2
      xi(:, 4*k - 3:4*k) = a(k)
      do p = 1, dim
        xi(p, 4*(k - 1) + p) = 1 - 3*a(k)
      end do
      weight(4*k - 3:4*k) = share(k)
    end do
    p = 8
    do j = 2, dim + 1
      do i = 1, j - 1
        p = p + 1
        l = 0.5_c_double - c
        l([i, j]) = c
        xi(:, p) = l(:dim)
        weight(p) = 0.04254602077708147_c_double/6
      end do
    end do
  end subroutine cairn_element_tet10_rule

  !> Four points, exact for the square of the strain where edges are straight.
  pure subroutine cairn_element_tet10_bulk_rule(xi, weight) bind(c)
    real(c_double), intent(out) :: xi(dim, bulk_points) !< in the parent element
    real(c_double), intent(out) :: weight(bulk_points)
    integer :: p
    xi = 0.1381966011250105_c_double
    do p = 1, dim
      xi(p, p) = 0.58541019662496852_c_double
    end do
    weight = 1.0_c_double/24
  end subroutine cairn_element_tet10_bulk_rule

  pure subroutine cairn_element_tet10_shape(xi, value, gradient) bind(c)
    real(c_double), intent(in)  :: xi(dim)
    real(c_double), intent(out) :: value(nodes)
    real(c_double), intent(out) :: gradient(dim, nodes) !< along xi
    call quadratic_simplex(dim, 6, edge, xi, value, gradient)
  end subroutine cairn_element_tet10_shape
end module tet10
