!> Integrals over isoparametric elements from their shape functions (Zienkiewicz & Taylor 2000): stiffness B'DB, consistent mass
!> N'N, and the stress at a point.
module elastic_integrals
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  implicit none
  private
  public :: cairn_elastic_matrices, cairn_elastic_stress

contains

  !> Stiffness and consistent mass of n elements of a kind.
  pure subroutine cairn_elastic_matrices(dim, nodes, points, value, gradient, weight, n, x, density, elasticity, stiffness, mass, &
                                         wrong) bind(c)
    integer(c_int32_t), value       :: dim, nodes
    integer(c_int32_t), value       :: points                  !< of the rule of integration
    real(c_double), intent(in)      :: value(nodes, points)    !< of the shape functions there
    real(c_double), intent(in)      :: gradient(dim, nodes, points) !< of them in the parent element
    real(c_double), intent(in)      :: weight(points)
    integer(c_int64_t), value       :: n                       !< elements
    real(c_double), intent(in)      :: x(dim, nodes, n)        !< places of their nodes [m]
    real(c_double), value           :: density                 !< [kg/m3], times the thickness in 2D
    real(c_double), intent(in)      :: elasticity(3*dim - 3, 3*dim - 3) !< of strains (xx yy [zz] xy [yz zx]) [Pa], as density
    real(c_double), intent(out)     :: stiffness(dim*nodes, dim*nodes, n) !< [N/m]
    real(c_double), intent(out)     :: mass(dim*nodes, dim*nodes, n) !< [kg]
    integer(c_int32_t), intent(out) :: wrong(n)                !< 1: flat or inside out
    integer(c_int64_t) :: i
    do i = 1, n
      call integrate(dim, nodes, points, gradient, value, weight, x(:, :, i), density, elasticity, stiffness(:, :, i), &
                     mass(:, :, i), wrong(i))
    end do
  end subroutine cairn_elastic_matrices

  !> Stress of n elements of a kind at one place in the parent element, tension positive.
  pure subroutine cairn_elastic_stress(dim, nodes, gradient, n, x, elasticity, displacement, stress) bind(c)
    integer(c_int32_t), value       :: dim, nodes
    real(c_double), intent(in)      :: gradient(dim, nodes)    !< of the shape functions there
    integer(c_int64_t), value       :: n                       !< elements
    real(c_double), intent(in)      :: x(dim, nodes, n)        !< [m]
    real(c_double), intent(in)      :: elasticity(3*dim - 3, 3*dim - 3) !< [Pa]
    real(c_double), intent(in)      :: displacement(dim*nodes, n) !< of their nodes [m]
    real(c_double), intent(out)     :: stress(3*dim - 3, n)    !< (xx yy [zz] xy [yz zx]) [Pa]
    integer(c_int64_t) :: i
    do i = 1, n
      call stress_at(dim, nodes, gradient, x(:, :, i), elasticity, displacement(:, i), stress(:, i))
    end do
  end subroutine cairn_elastic_stress

  !> Stiffness and mass of one element; wrong is set to 1 where its Jacobian is not positive.
  pure subroutine integrate(dim, nodes, points, gradient, value, weight, x, density, elasticity, stiffness, mass, wrong)
    integer, intent(in)         :: dim, nodes, points
    real(c_double), intent(in)  :: gradient(dim, nodes, points) !< of the shape functions at the Gauss points, in the parent element
    real(c_double), intent(in)  :: value(nodes, points)         !< of the shape functions there
    real(c_double), intent(in)  :: weight(points)
    real(c_double), intent(in)  :: x(dim, nodes)                !< [m]
    real(c_double), intent(in)  :: density                      !< times the thickness in 2D
    real(c_double), intent(in)  :: elasticity(3*dim - 3, 3*dim - 3) !< [Pa], times the thickness in 2D
    real(c_double), intent(out) :: stiffness(dim*nodes, dim*nodes), mass(dim*nodes, dim*nodes)
    integer(c_int32_t), intent(out) :: wrong
    real(c_double) :: b(3*dim - 3, dim*nodes), d(dim, nodes), volume
    integer :: p, i, j, k
    stiffness = 0
    mass = 0
    wrong = 0
    do p = 1, points
      call in_space(dim, nodes, gradient(:, :, p), x, d, volume)
      if (.not. volume > 0) wrong = 1
      if (wrong /= 0) return
      call strains(dim, nodes, d, b)
      stiffness = stiffness + weight(p)*volume*matmul(transpose(b), matmul(elasticity, b))
      do j = 1, nodes
        do i = 1, nodes
          do k = 1, dim
            mass(dim*(i - 1) + k, dim*(j - 1) + k) = mass(dim*(i - 1) + k, dim*(j - 1) + k) &
                                                     + weight(p)*volume*density*value(i, p)*value(j, p)
          end do
        end do
      end do
    end do
  end subroutine integrate

  !> Stress (xx yy [zz] xy [yz zx]) where the shape functions have these gradients, tension positive.
  pure subroutine stress_at(dim, nodes, gradient, x, elasticity, displacement, stress)
    integer, intent(in)         :: dim, nodes
    real(c_double), intent(in)  :: gradient(dim, nodes), x(dim, nodes), elasticity(3*dim - 3, 3*dim - 3)
    real(c_double), intent(in)  :: displacement(dim*nodes) !< [m]
    real(c_double), intent(out) :: stress(3*dim - 3)       !< [Pa]
    real(c_double) :: b(3*dim - 3, dim*nodes), d(dim, nodes), volume
    call in_space(dim, nodes, gradient, x, d, volume)
    call strains(dim, nodes, d, b)
    stress = matmul(elasticity, matmul(b, displacement))
  end subroutine stress_at

  !> Gradients in space and the Jacobian.
  pure subroutine in_space(dim, nodes, gradient, x, d, volume)
    integer, intent(in)         :: dim, nodes
    real(c_double), intent(in)  :: gradient(dim, nodes), x(dim, nodes)
    real(c_double), intent(out) :: d(dim, nodes), volume
    real(c_double) :: j(dim, dim), cofactor(dim, dim)
    integer :: i, k
    j = matmul(gradient, transpose(x)) ! dx_k / dxi_i
    if (dim == 2) then
      cofactor(1, :) = [j(2, 2), -j(2, 1)]
      cofactor(2, :) = [-j(1, 2), j(1, 1)]
    else
      do k = 1, 3
        do i = 1, 3
          cofactor(i, k) = j(mod(i, 3) + 1, mod(k, 3) + 1)*j(mod(i + 1, 3) + 1, mod(k + 1, 3) + 1) &
                           - j(mod(i, 3) + 1, mod(k + 1, 3) + 1)*j(mod(i + 1, 3) + 1, mod(k, 3) + 1)
        end do
      end do
    end if
    volume = dot_product(j(1, :), cofactor(1, :))
    d = matmul(transpose(cofactor), gradient)/volume
  end subroutine in_space

  pure subroutine strains(dim, nodes, d, b)
    integer, intent(in)         :: dim, nodes
    real(c_double), intent(in)  :: d(dim, nodes)
    real(c_double), intent(out) :: b(3*dim - 3, dim*nodes)
    integer :: i, k
    b = 0
    do i = 1, nodes
      k = dim*(i - 1)
      if (dim == 2) then
        b(1, k + 1) = d(1, i)
        b(2, k + 2) = d(2, i)
        b(3, k + 1:k + 2) = [d(2, i), d(1, i)]
      else
        b(1, k + 1) = d(1, i)
        b(2, k + 2) = d(2, i)
        b(3, k + 3) = d(3, i)
        b(4, k + 1:k + 2) = [d(2, i), d(1, i)]
        b(5, k + 2:k + 3) = [d(3, i), d(2, i)]
        b(6, k + 1:k + 3:2) = [d(3, i), d(1, i)]
      end if
    end do
  end subroutine strains
end module elastic_integrals
