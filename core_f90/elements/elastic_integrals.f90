!> Integrals over isoparametric elements from their shape functions (Zienkiewicz & Taylor 2000): stiffness B'DB, consistent mass
!> N'N, and the stress at a point.
module elastic_integrals
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  implicit none
  private
  public :: cairn_elastic_matrices, cairn_elastic_stress
  integer, parameter :: lanes = 8 !< elements that are integrated side by side

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
    integer(c_int64_t) :: first
    integer :: now
    do first = 1, n, lanes
      now = int(min(n - first + 1, int(lanes, c_int64_t)))
      call integrate(dim, nodes, points, gradient, value, weight, now, x(:, :, first:), density, elasticity, &
                     stiffness(:, :, first:), mass(:, :, first:), wrong(first:))
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

  !> Stiffness and mass of as many elements as there are SIMD lanes; wrong is set to 1 where a Jacobian is not positive. Elasticity
  !> is uniform over an element, so only products of gradients are integrated; each block of the stiffness is then a combination of
  !> these.
  pure subroutine integrate(dim, nodes, points, gradient, value, weight, n, x, density, elasticity, stiffness, mass, wrong)
    integer, intent(in)         :: dim, nodes, points
    real(c_double), intent(in)  :: gradient(dim, nodes, points) !< of the shape functions at the Gauss points, in the parent element
    real(c_double), intent(in)  :: value(nodes, points)         !< of the shape functions there
    real(c_double), intent(in)  :: weight(points)
    integer, intent(in)         :: n                            !< elements
    real(c_double), intent(in)  :: x(dim, nodes, n)             !< [m]
    real(c_double), intent(in)  :: density                      !< times the thickness in 2D
    real(c_double), intent(in)  :: elasticity(3*dim - 3, 3*dim - 3) !< [Pa], times the thickness in 2D
    real(c_double), intent(out) :: stiffness(dim*nodes, dim*nodes, n), mass(dim*nodes, dim*nodes, n)
    integer(c_int32_t), intent(out) :: wrong(n)
    real(c_double) :: place(lanes, dim, nodes), d(lanes, dim, nodes, points), wide(lanes, points), along(lanes, 3, 3)
    real(c_double) :: weighed(lanes, 3), part(lanes), pair
    integer :: p, i, j, k, l, a, b, slopes, shear(3, 3)
    do i = 1, nodes
      do k = 1, dim
        do l = 1, lanes
          place(l, k, i) = x(k, i, min(l, n)) ! the last one again where there are fewer
        end do
      end do
    end do
    slopes = merge(1, points, nodes == dim + 1) ! gradients are the same everywhere in a simplex
    wrong = 0
    mass = 0
    do p = 1, slopes
      call across(dim, nodes, gradient(:, :, p), place, d(:, :, :, p), part)
      where (.not. part(:n) > 0) wrong = 1
      wide(:, p) = weight(p)*part
    end do
    do p = slopes + 1, points
      wide(:, p) = weight(p)*part
    end do
    shear = reshape([1, 4, 6, 4, 2, 5, 6, 5, 3], [3, 3]) ! the strain that a gradient along one axis of another is part of
    if (dim == 2) shear(1:2, 1:2) = reshape([1, 3, 3, 2], [2, 2])
    do j = 1, nodes
      do i = j, nodes
        along = 0 ! products of the gradients of node i along k with those of node j along l
        do p = 1, slopes
          part = wide(:, p)
          if (slopes < points) part = sum(wide, 2)
          do l = 1, dim
            weighed(:, l) = part*d(:, l, j, p)
          end do
          do l = 1, dim
            do k = 1, dim
              along(:, k, l) = along(:, k, l) + weighed(:, l)*d(:, k, i, p)
            end do
          end do
        end do
        do b = 1, dim
          do a = 1, dim
            part = 0
            do l = 1, dim
              do k = 1, dim
                pair = elasticity(shear(a, k), shear(b, l))
                if (abs(pair) > 0) part = part + pair*along(:, k, l)
              end do
            end do
            stiffness(dim*(i - 1) + a, dim*(j - 1) + b, :) = part(:n)
          end do
        end do
        part = 0
        do p = 1, points
          part = part + (density*value(j, p)*value(i, p))*wide(:, p)
        end do
        do k = 1, dim
          mass(dim*(i - 1) + k, dim*(j - 1) + k, :) = part(:n)
          mass(dim*(j - 1) + k, dim*(i - 1) + k, :) = part(:n)
        end do
      end do
    end do
    do l = 1, n
      do j = 2, dim*nodes
        stiffness(1:j - 1, j, l) = stiffness(j, 1:j - 1, l)
      end do
    end do
  end subroutine integrate

  !> Gradients in space, of each node along each axis, and Jacobians, of elements side by side.
  pure subroutine across(dim, nodes, gradient, x, d, volume)
    integer, intent(in)         :: dim, nodes
    real(c_double), intent(in)  :: gradient(dim, nodes)
    real(c_double), intent(in)  :: x(lanes, dim, nodes)  !< [m]
    real(c_double), intent(out) :: d(lanes, dim, nodes), volume(lanes)
    real(c_double) :: j(lanes, 3, 3), cofactor(lanes, 3, 3)
    integer :: i, k, l
    j = 0 ! dx_k / dxi_l
    do i = 1, nodes
      do k = 1, dim
        do l = 1, dim
          j(:, l, k) = j(:, l, k) + gradient(l, i)*x(:, k, i)
        end do
      end do
    end do
    if (dim == 2) j(:, 3, 3) = 1
    do k = 1, 3
      do l = 1, 3
        associate (l1 => mod(l, 3) + 1, l2 => mod(l + 1, 3) + 1, k1 => mod(k, 3) + 1, k2 => mod(k + 1, 3) + 1)
          cofactor(:, l, k) = j(:, l1, k1)*j(:, l2, k2) - j(:, l1, k2)*j(:, l2, k1)
        end associate
      end do
    end do
    volume = j(:, 1, 1)*cofactor(:, 1, 1) + j(:, 1, 2)*cofactor(:, 1, 2) + j(:, 1, 3)*cofactor(:, 1, 3)
    do i = 1, nodes
      do k = 1, dim
        d(:, k, i) = 0
        do l = 1, dim
          d(:, k, i) = d(:, k, i) + cofactor(:, l, k)*gradient(l, i)
        end do
        d(:, k, i) = d(:, k, i)/volume
      end do
    end do
  end subroutine across

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
