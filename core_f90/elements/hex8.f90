!> Hexahedron of eight nodes, bottom counter-clockwise, then top: trilinear, fully integrated; it locks as q4 does.
module hex8
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use elastic_integrals, only: integrate, stress_at
  implicit none
  private
  public :: cairn_element_hex8_matrices, cairn_element_hex8_stress
  integer, parameter :: dim = 3, nodes = 8, points = 8
  real(c_double), parameter :: corner(dim, nodes) = reshape([-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, &
                                                                -1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1], [dim, nodes])
contains

  !> Stiffness and consistent mass of n elements.
  pure subroutine cairn_element_hex8_matrices(n, x, density, elasticity, stiffness, mass, wrong) bind(c)
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
  end subroutine cairn_element_hex8_matrices

  !> Stress in the middle of n elements, tension positive.
  pure subroutine cairn_element_hex8_stress(n, x, elasticity, displacement, stress) bind(c)
    integer(c_int64_t), value       :: n                       !< elements
    real(c_double), intent(in)      :: x(dim, nodes, n)        !< [m]
    real(c_double), intent(in)      :: elasticity(3*dim - 3, 3*dim - 3) !< [Pa]
    real(c_double), intent(in)      :: displacement(dim*nodes, n) !< of their nodes [m]
    real(c_double), intent(out)     :: stress(3*dim - 3, n)    !< (xx, yy, zz, xy, yz, zx) [Pa]
    real(c_double) :: gradient(dim, nodes), value(nodes)
    integer(c_int64_t) :: i
    call shape_functions(spread(0.0_c_double, 1, dim), gradient, value)
    do i = 1, n
      call stress_at(dim, nodes, gradient, x(:, :, i), elasticity, displacement(:, i), stress(:, i))
    end do
  end subroutine cairn_element_hex8_stress

  !> Gauss's two points along each axis.
  pure subroutine rule(gradient, value, weight)
    real(c_double), intent(out) :: gradient(dim, nodes, points), value(nodes, points), weight(points)
    integer :: p
    do p = 1, points
      call shape_functions(corner(:, p)/sqrt(3.0_c_double), gradient(:, :, p), value(:, p))
    end do
    weight = 1
  end subroutine rule

  pure subroutine shape_functions(xi, gradient, value)
    real(c_double), intent(in)  :: xi(dim)
    real(c_double), intent(out) :: gradient(dim, nodes), value(nodes)
    real(c_double) :: f(dim)
    integer :: i, k
    do i = 1, nodes
      f = 0.5_c_double*(1 + corner(:, i)*xi)
      value(i) = product(f)
      do k = 1, dim
        gradient(k, i) = 0.5_c_double*corner(k, i)*product(f(:k - 1))*product(f(k + 1:))
      end do
    end do
  end subroutine shape_functions
end module hex8
