!> Cells of small strains under Hooke's isotropic law, eight side by side in SIMD lanes. Their stiffness depends on the shape
!> functions through the integrals G(i, j) of d N_a/dx_i d N_b/dx_j alone:
!>   K(a i, b j) = lambda G(i, j) + mu G(j, i) + mu 1(i, j) tr G;
!> only the lower triangle is computed.
module linear_cells
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  implicit none
  private
  public :: cairn_linear_cells
  integer, parameter :: lanes = 8
contains

  !> Forces, stresses and energies of at most eight cells, and the half of their stiffness if asked.
  pure subroutine cairn_linear_cells(dim, nodes, points, gradient, weight, thickness, lambda, shear, across, n, x, u, want, force, &
                                     half, stress, energy, status) bind(c)
    integer(c_int32_t), value       :: dim, nodes, points
    real(c_double), intent(in)      :: gradient(dim, nodes, points) !< of the shape functions in the parent element
    real(c_double), intent(in)      :: weight(points)
    real(c_double), value           :: thickness                !< [m], 1 in 3D
    real(c_double), value           :: lambda                   !< Lame's, in plane stress that of the plane [Pa]
    real(c_double), value           :: shear                    !< [Pa]
    real(c_double), value           :: across                   !< stress across a plane by its dilatation [Pa]
    integer(c_int64_t), value       :: n                        !< cells, 1 to 8
    real(c_double), intent(in)      :: x(dim, nodes, n)         !< places of their nodes [m]
    real(c_double), intent(in)      :: u(dim, nodes, n)         !< displacements [m]
    integer(c_int32_t), value       :: want                     !< 1: the stiffness too
    real(c_double), intent(out)     :: force(dim, nodes, n)     !< [N]
    real(c_double), intent(out)     :: half(8, dim*nodes*(dim*nodes + 1)/2) !< by columns, cells side by side [N/m]
    real(c_double), intent(out)     :: stress(6, points, n)     !< 11 22 33 12 23 13 [Pa]
    real(c_double), intent(out)     :: energy(n)                !< [J]
    integer(c_int32_t), intent(out) :: status(n)                !< 1: flat or inside out
    real(c_double) :: at(lanes, dim, nodes), moved(lanes, dim, nodes), pushed(lanes, dim, nodes), d(lanes, dim, nodes, points), &
                      volume(lanes, points), stored(lanes), s(lanes, 6)
    integer :: a, k, lane, p
    do lane = 1, lanes
      at(lane, :, :) = x(:, :, min(int(lane, c_int64_t), n)) ! the last one fills up
      moved(lane, :, :) = u(:, :, min(int(lane, c_int64_t), n))
    end do
    pushed = 0
    stored = 0
    status = 0
    do p = 1, points
      call in_space(dim, nodes, gradient(:, :, p), at, d(:, :, :, p), volume(:, p))
      do lane = 1, int(n)
        if (.not. volume(lane, p) > 0) status(lane) = 1
      end do
      volume(:, p) = volume(:, p)*(weight(p)*thickness)
      call stresses(dim, nodes, d(:, :, :, p), volume(:, p), moved, lambda, shear, across, s, stored, pushed)
      do lane = 1, int(n)
        stress(:, p, lane) = s(lane, :)
      end do
    end do
    do lane = 1, int(n)
      do a = 1, nodes
        do k = 1, dim
          force(k, a, lane) = pushed(lane, k, a)
        end do
      end do
      energy(lane) = stored(lane)
    end do
    if (want /= 0) call stiffnesses(dim, nodes, points, d, volume, lambda, shear, half)
  end subroutine cairn_linear_cells

  !> Gradients in space and the Jacobian.
  pure subroutine in_space(dim, nodes, gradient, at, d, volume)
    integer, intent(in)         :: dim, nodes
    real(c_double), intent(in)  :: gradient(dim, nodes), at(lanes, dim, nodes)
    real(c_double), intent(out) :: d(lanes, dim, nodes), volume(lanes)
    real(c_double) :: j(lanes, 3, 3), back(lanes, 3, 3)
    integer :: a, i, k
    j = 0
    do a = 1, nodes
      do k = 1, dim
        do i = 1, dim
          j(:, i, k) = j(:, i, k) + gradient(i, a)*at(:, k, a)
        end do
      end do
    end do
    if (dim == 2) then
      volume = j(:, 1, 1)*j(:, 2, 2) - j(:, 1, 2)*j(:, 2, 1)
      back(:, 1, 1) = j(:, 2, 2)/volume
      back(:, 2, 2) = j(:, 1, 1)/volume
      back(:, 1, 2) = -j(:, 1, 2)/volume
      back(:, 2, 1) = -j(:, 2, 1)/volume
    else
      do k = 1, 3
        do i = 1, 3 ! cofactors of j(i, k)
          back(:, k, i) = j(:, mod(i, 3) + 1, mod(k, 3) + 1)*j(:, mod(i + 1, 3) + 1, mod(k + 1, 3) + 1) &
                          - j(:, mod(i, 3) + 1, mod(k + 1, 3) + 1)*j(:, mod(i + 1, 3) + 1, mod(k, 3) + 1)
        end do
      end do
      volume = j(:, 1, 1)*back(:, 1, 1) + j(:, 1, 2)*back(:, 2, 1) + j(:, 1, 3)*back(:, 3, 1)
      do i = 1, 3
        do k = 1, 3
          back(:, k, i) = back(:, k, i)/volume
        end do
      end do
    end if
    do a = 1, nodes
      do k = 1, dim
        d(:, k, a) = back(:, k, 1)*gradient(1, a)
        do i = 2, dim
          d(:, k, a) = d(:, k, a) + back(:, k, i)*gradient(i, a)
        end do
      end do
    end do
  end subroutine in_space

  !> Stress at a point, and its contributions to energy and forces.
  pure subroutine stresses(dim, nodes, d, volume, moved, lambda, shear, across, s, stored, pushed)
    integer, intent(in)           :: dim, nodes
    real(c_double), intent(in)    :: d(lanes, dim, nodes), volume(lanes), moved(lanes, dim, nodes), lambda, shear, across
    real(c_double), intent(out)   :: s(lanes, 6)
    real(c_double), intent(inout) :: stored(lanes), pushed(lanes, dim, nodes)
    integer, parameter :: place(3, 3) = reshape([1, 4, 6, 4, 2, 5, 6, 5, 3], [3, 3])
    real(c_double) :: h(lanes, 3, 3), wider(lanes), by_volume(lanes, 3, 3)
    integer :: a, i, k
    h = 0
    do a = 1, nodes
      do k = 1, dim
        do i = 1, dim
          h(:, i, k) = h(:, i, k) + moved(:, i, a)*d(:, k, a)
        end do
      end do
    end do
    wider = h(:, 1, 1) + h(:, 2, 2) + h(:, 3, 3)
    s = 0
    do i = 1, dim
      s(:, i) = lambda*wider + 2*shear*h(:, i, i)
    end do
    if (dim == 2) s(:, 3) = across*wider
    s(:, 4) = shear*(h(:, 1, 2) + h(:, 2, 1))
    if (dim == 3) s(:, 5) = shear*(h(:, 2, 3) + h(:, 3, 2))
    if (dim == 3) s(:, 6) = shear*(h(:, 1, 3) + h(:, 3, 1))
    do k = 1, dim
      do i = 1, dim
        by_volume(:, i, k) = volume*s(:, place(i, k))
        stored = stored + 0.5_c_double*by_volume(:, i, k)*h(:, i, k)
      end do
    end do
    do a = 1, nodes
      do k = 1, dim
        do i = 1, dim
          pushed(:, i, a) = pushed(:, i, a) + by_volume(:, i, k)*d(:, k, a)
        end do
      end do
    end do
  end subroutine stresses

  !> The half of the stiffness below the diagonal, column by column.
  pure subroutine stiffnesses(dim, nodes, points, d, volume, lambda, shear, half)
    integer, intent(in)         :: dim, nodes, points
    real(c_double), intent(in)  :: d(lanes, dim, nodes, points), volume(lanes, points), lambda, shear
    real(c_double), intent(out) :: half(lanes, dim*nodes*(dim*nodes + 1)/2)
    real(c_double) :: g(lanes, 3, 3), weighed(lanes, 3, points), trace(lanes)
    integer :: a, b, k, l, p, at
    g = 0
    do b = 1, nodes
      do p = 1, points
        do l = 1, dim
          weighed(:, l, p) = volume(:, p)*d(:, l, b, p)
        end do
      end do
      do a = b, nodes
        call products(dim, points, nodes, a, d, weighed, g)
        trace = shear*(g(:, 1, 1) + g(:, 2, 2) + g(:, 3, 3))
        do l = 1, dim
          ! of column j, from nought, the row i stands (2 dofs - j - 1) j/2 + i places on
          at = ((2*dim*nodes - (dim*(b - 1) + l - 1) - 1)*(dim*(b - 1) + l - 1))/2 + dim*(a - 1)
          do k = merge(l, 1, a == b), dim
            half(:, at + k) = lambda*g(:, k, l) + shear*g(:, l, k)
            if (k == l) half(:, at + k) = half(:, at + k) + trace
          end do
        end do
      end do
    end do
  end subroutine stiffnesses

  pure subroutine products(dim, points, nodes, a, d, weighed, g)
    integer, intent(in)           :: dim, points, nodes, a
    real(c_double), intent(in)    :: d(lanes, dim, nodes, points), weighed(lanes, 3, points)
    real(c_double), intent(inout) :: g(lanes, 3, 3)
    real(c_double) :: sum(lanes)
    integer :: k, l, p
    do l = 1, dim
      do k = 1, dim
        sum = d(:, k, a, 1)*weighed(:, l, 1)
        do p = 2, points
          sum = sum + d(:, k, a, p)*weighed(:, l, p)
        end do
        g(:, k, l) = sum
      end do
    end do
  end subroutine products
end module linear_cells
