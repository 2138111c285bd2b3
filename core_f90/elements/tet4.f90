!> Tetrahedron of four nodes: constant strain. The fourth lies on the side to which 1, 2, 3 turn right-handed.
module tet4
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use elastic_integrals, only: integrate, stress_at
  implicit none
  private
  public :: cairn_element_tet4_matrices, cairn_element_tet4_stress
  integer, parameter :: dim = 3, nodes = 4, points = 4
contains

  !> Stiffness and consistent mass of n elements.
  pure subroutine cairn_element_tet4_matrices(n, x, density, elasticity, stiffness, mass, wrong) bind(c)
    integer(c_int64_t), value       :: n                       !< elements
    real(c_double), intent(in)      :: x(dim, nodes, n)        !< places of their nodes [m]
    real(c_double), value           :: density                 !< [kg/m3]
    real(c_double), intent(in)      :: elasticity(3*dim - 3, 3*dim - 3) !< of strains (xx, yy, zz, xy, yz, zx) [Pa]
    real(c_double), intent(out)     :: stiffness(dim*nodes, dim*nodes, n) !< [N/m]
    real(c_double), intent(out)     :: mass(dim*nodes, dim*nodes, n) !< [kg]
    integer(c_int32_t), intent(out) :: wrong(n)                !< 1: flat or inside out
    real(c_double) :: gradient(dim, nodes, points), value(nodes, points), weight(points)
    integer(c_int64_t) :: i
    call rule(gradient, value, weight)
    do i = 1, n
      call integrate(dim, nodes, points, gradient, value, weight, x(:, :, i), density, elasticity, stiffness(:, :, i), &
                     mass(:, :, i), wrong(i))
    end do
  end subroutine cairn_element_tet4_matrices

  !> Stress in the middle of n elements, tension positive.
  pure subroutine cairn_element_tet4_stress(n, x, elasticity, displacement, stress) bind(c)
    integer(c_int64_t), value       :: n                       !< elements
    real(c_double), intent(in)      :: x(dim, nodes, n)        !< [m]
    real(c_double), intent(in)      :: elasticity(3*dim - 3, 3*dim - 3) !< [Pa]
    real(c_double), intent(in)      :: displacement(dim*nodes, n) !< of their nodes [m]
    real(c_double), intent(out)     :: stress(3*dim - 3, n)    !< (xx, yy, zz, xy, yz, zx) [Pa]
    real(c_double) :: gradient(dim, nodes), value(nodes)
    integer(c_int64_t) :: i
    call shape_functions(spread(1.0_c_double/nodes, 1, dim), gradient, value)
    do i = 1, n
      call stress_at(dim, nodes, gradient, x(:, :, i), elasticity, displacement(:, i), stress(:, i))
    end do
  end subroutine cairn_element_tet4_stress

  !> Four points, exact for the square of the shape functions.
  pure subroutine rule(gradient, value, weight)
    real(c_double), intent(out) :: gradient(dim, nodes, points), value(nodes, points), weight(points)
    real(c_double), parameter :: a = 0.58541019662496852_c_double, b = 0.1381966011250105_c_double
    real(c_double) :: xi(dim)
    integer :: p, k
    do p = 1, points
      xi = b
      where ([(k, k=1, dim)] == p) xi = a
      call shape_functions(xi, gradient(:, :, p), value(:, p))
    end do
    weight = 1.0_c_double/24
  end subroutine rule

  pure subroutine shape_functions(xi, gradient, value)
    real(c_double), intent(in)  :: xi(dim)
    real(c_double), intent(out) :: gradient(dim, nodes), value(nodes)
    integer :: i
    value(1) = 1 - sum(xi)
    value(2:) = xi
    gradient = 0
    gradient(:, 1) = -1
    do i = 1, dim
      gradient(i, i + 1) = 1
    end do
  end subroutine shape_functions
end module tet4
