!> Cells of solids whose law is a batch over their Gauss points: gradients of displacement there, and from the first Piola-Kirchhoff
!> stresses the forces on nodes and their derivative. Volume is that of the start: total Lagrangian (Bonet & Wood 2008).
module solid_cells
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use tensor_functions, only: determinant, inverse
  implicit none
  private
  public :: cairn_solid_gradients, cairn_solid_forces, cairn_thickness_strain, cairn_true_stress
  integer, parameter :: axisymmetric = 2
  integer, parameter :: mean_small = 1, mean_finite = 2, linear_small = 3, linear_finite = 4
  integer, parameter :: lanes = 8
  real(c_double), parameter :: third = 1.0_c_double/3, pi = 3.1415926535897932_c_double
contains

  !> Gradients of displacement at the points of n cells; in h_bar their dilatation is the mean over the cell, if asked: of the
  !> linear strain (Hughes 1980), or of F (Simo, Taylor & Pister 1985); or the linear function over the cell that is nearest to it.
  pure subroutine cairn_solid_gradients(dim, plane, mean, nodes, points, value, gradient, weight, thickness, n, x, u, d, hoop, h, &
                                        h_bar, volume, share, status) bind(c)
    integer(c_int32_t), value       :: dim
    integer(c_int32_t), value       :: plane                   !< in 2D: 0 plane strain, 1 plane stress, 2 axisymmetric round y
    integer(c_int32_t), value       :: mean                    !< dilatation: 0 of the point, 1, 2 mean of small, of finite strain,
    !! 3, 4 linear over the cell
    integer(c_int32_t), value       :: nodes, points
    real(c_double), intent(in)      :: value(nodes, points)    !< of the shape functions
    real(c_double), intent(in)      :: gradient(dim, nodes, points) !< of them in the parent element
    real(c_double), intent(in)      :: weight(points)
    real(c_double), value           :: thickness               !< [m], 1 in 3D and where axisymmetric
    integer(c_int64_t), value       :: n                       !< cells
    real(c_double), intent(in)      :: x(dim, nodes, n)        !< places of their nodes at the start [m]
    real(c_double), intent(in)      :: u(dim, nodes, n)        !< displacements [m]
    real(c_double), intent(out)     :: d(dim, nodes, points, n) !< gradients of the shape functions in space [1/m]
    real(c_double), intent(out)     :: hoop(nodes, points, n)  !< shape functions / radius where axisymmetric [1/m]
    real(c_double), intent(out)     :: h(3, 3, points, n)      !< F - 1 [-]
    real(c_double), intent(out)     :: h_bar(3, 3, points, n)  !< with mean dilatation [-]
    real(c_double), intent(out)     :: volume(points, n)       !< of the points at the start [m3]
    real(c_double), intent(inout)   :: share(points, points, n) !< of points (second) in a linear dilatation; else not read
    integer(c_int32_t), intent(inout) :: status(points, n)     !< set to 1 where a volume is not positive
    real(c_double) :: radius
    integer(c_int64_t) :: i
    integer :: p, a, k, l
    do i = 1, n
      do p = 1, points
        call in_space(dim, nodes, gradient(:, :, p), x(:, :, i), d(:, :, p, i), volume(p, i))
        if (.not. volume(p, i) > 0) status(p, i) = 1
        volume(p, i) = volume(p, i)*weight(p)*thickness
        h(:, :, p, i) = 0
        do a = 1, nodes
          do l = 1, dim
            do k = 1, dim
              h(k, l, p, i) = h(k, l, p, i) + u(k, a, i)*d(l, a, p, i)
            end do
          end do
        end do
        if (dim == 2 .and. plane == axisymmetric) then
          radius = dot_product(value(:, p), x(1, :, i))
          if (.not. radius > 0) status(p, i) = 1
          hoop(:, p, i) = value(:, p)/radius
          volume(p, i) = volume(p, i)*2*pi*radius
          h(3, 3, p, i) = dot_product(hoop(:, p, i), u(1, :, i))
        end if
      end do
      h_bar(:, :, :, i) = h(:, :, :, i)
      if (mean == mean_small) call with_mean_strain(points, volume(:, i), h_bar(:, :, :, i))
      if (mean == mean_finite) call with_mean_volume(points, volume(:, i), h_bar(:, :, :, i), status(:, i))
      if (mean < linear_small) cycle
      call linear_shares(dim, points, matmul(x(:, :, i), value), volume(:, i), share(:, :, i))
      call with_linear_dilatation(mean, points, share(:, :, i), h_bar(:, :, :, i), status(:, i))
    end do
  end subroutine cairn_solid_gradients

  pure subroutine with_mean_strain(points, volume, h)
    integer, intent(in)           :: points
    real(c_double), intent(in)    :: volume(points)
    real(c_double), intent(inout) :: h(3, 3, points)
    real(c_double) :: mean, own(points)
    integer :: p, k
    do p = 1, points
      own(p) = h(1, 1, p) + h(2, 2, p) + h(3, 3, p)
    end do
    mean = dot_product(volume, own)/sum(volume)
    do p = 1, points
      do k = 1, 3
        h(k, k, p) = h(k, k, p) + third*(mean - own(p))
      end do
    end do
  end subroutine with_mean_strain

  pure subroutine with_mean_volume(points, volume, h, status)
    integer, intent(in)           :: points
    real(c_double), intent(in)    :: volume(points)
    real(c_double), intent(inout) :: h(3, 3, points)
    integer(c_int32_t), intent(inout) :: status(points)
    real(c_double) :: ratio(points), mean, scaled
    integer :: p, k
    do p = 1, points
      ratio(p) = determinant(with_identity(h(:, :, p)))
      if (.not. ratio(p) > 0) then
        status(p) = 1
        return
      end if
    end do
    mean = dot_product(volume, ratio)/sum(volume)
    do p = 1, points
      scaled = (mean/ratio(p))**third
      h(:, :, p) = scaled*h(:, :, p)
      do k = 1, 3
        h(k, k, p) = h(k, k, p) + (scaled - 1)
      end do
    end do
  end subroutine with_mean_volume

  !> Weights by which dilatations of points make that linear function over the cell which is nearest to them: the projection on
  !> 1, x, y (z), made orthogonal one after the other.
  pure subroutine linear_shares(dim, points, place, volume, share)
    integer, intent(in)         :: dim, points
    real(c_double), intent(in)  :: place(dim, points), volume(points)
    real(c_double), intent(out) :: share(points, points)
    real(c_double) :: mode(points, 0:dim), weighed(points, 0:dim)
    integer :: j, k, turn
    share = 0
    mode(:, 0) = 1
    do k = 1, dim
      mode(:, k) = place(k, :) - place(k, 1)
    end do
    do k = 0, dim
      do turn = 1, 2 ! the second takes what rounding left
        do j = 0, k - 1
          mode(:, k) = mode(:, k) - mode(:, j)*(dot_product(weighed(:, j), mode(:, k))/dot_product(weighed(:, j), mode(:, j)))
        end do
      end do
      weighed(:, k) = volume*mode(:, k)
      share = share + spread(mode(:, k), 2, points)*spread(weighed(:, k)/dot_product(weighed(:, k), mode(:, k)), 1, points)
    end do
  end subroutine linear_shares

  pure subroutine with_linear_dilatation(mean, points, share, h, status)
    integer, intent(in)           :: mean, points
    real(c_double), intent(in)    :: share(points, points)
    real(c_double), intent(inout) :: h(3, 3, points)
    integer(c_int32_t), intent(inout) :: status(points)
    real(c_double) :: own(points), wanted(points), scaled
    integer :: p, k
    do p = 1, points
      if (mean == linear_small) own(p) = h(1, 1, p) + h(2, 2, p) + h(3, 3, p)
      if (mean == linear_finite) own(p) = determinant(with_identity(h(:, :, p)))
    end do
    wanted = matmul(share, own)
    do p = 1, points
      if (mean == linear_small) then
        do k = 1, 3
          h(k, k, p) = h(k, k, p) + third*(wanted(p) - own(p))
        end do
        cycle
      end if
      if (.not. (own(p) > 0 .and. wanted(p) > 0)) then
        status(p) = 1
        cycle
      end if
      scaled = (wanted(p)/own(p))**third
      h(:, :, p) = scaled*h(:, :, p)
      do k = 1, 3
        h(k, k, p) = h(k, k, p) + (scaled - 1)
      end do
    end do
  end subroutine with_linear_dilatation

  pure function with_identity(h) result(f)
    real(c_double), intent(in) :: h(3, 3)
    real(c_double) :: f(3, 3)
    integer :: k
    f = h
    do k = 1, 3
      f(k, k) = f(k, k) + 1
    end do
  end function with_identity

  !> Forces on the nodes of n cells, and their derivative by the displacements if asked.
  pure subroutine cairn_solid_forces(dim, plane, mean, nodes, points, n, d, hoop, h, volume, share, piola, tangent, want, force, &
                                     stiffness) bind(c)
    integer(c_int32_t), value   :: dim, plane, mean, nodes, points !< as above
    integer(c_int64_t), value   :: n                       !< cells
    real(c_double), intent(in)  :: d(dim, nodes, points, n) !< [1/m]
    real(c_double), intent(in)  :: hoop(nodes, points, n)  !< [1/m]
    real(c_double), intent(in)  :: h(3, 3, points, n)      !< F - 1, its own dilatation [-]
    real(c_double), intent(in)  :: volume(points, n)       !< [m3]
    real(c_double), intent(in)  :: share(points, points, n) !< of a linear dilatation; else not read
    real(c_double), intent(in)  :: piola(3, 3, points, n)  !< [Pa]
    real(c_double), intent(in)  :: tangent(3, 3, 3, 3, points, n) !< [Pa]
    integer(c_int32_t), value   :: want                    !< 1: the derivative too; 2: where rows follow columns alone
    real(c_double), intent(out) :: force(dim*nodes, n)     !< [N]
    real(c_double), intent(out) :: stiffness(dim*nodes, dim*nodes, n) !< [N/m]
    integer(c_int64_t) :: i
    integer :: p
    logical :: flat ! or solid: the hoop has no part
    flat = mean == 0 .and. .not. (dim == 2 .and. plane == axisymmetric)
    if (want /= 0 .and. flat) then
      do i = 1, n, lanes
        call flat_stiffness(dim, nodes, points, min(int(lanes, c_int64_t), n - i + 1), want == 2, d(:, :, :, i:), volume(:, i:), &
                            tangent(:, :, :, :, :, i:), stiffness(:, :, i:))
      end do
    end if
    do i = 1, n
      force(:, i) = 0
      if (want /= 0 .and. .not. flat) stiffness(:, :, i) = 0
      if (mean >= linear_small) then
        call linear_cell(dim, plane, mean, nodes, points, d(:, :, :, i), hoop(:, :, i), h(:, :, :, i), volume(:, i), &
                         share(:, :, i), piola(:, :, :, i), tangent(:, :, :, :, :, i), want, force(:, i), stiffness(:, :, i))
        cycle
      end if
      if (mean /= 0) then
        call mean_cell(dim, plane, mean, nodes, points, d(:, :, :, i), hoop(:, :, i), h(:, :, :, i), volume(:, i), &
                       piola(:, :, :, i), tangent(:, :, :, :, :, i), want, force(:, i), stiffness(:, :, i))
        cycle
      end if
      do p = 1, points
        call add_force(dim, plane, nodes, d(:, :, p, i), hoop(:, p, i), volume(p, i)*piola(:, :, p, i), force(:, i))
        if (want == 0 .or. flat) cycle
        call add_stiffness(dim, plane, nodes, d(:, :, p, i), hoop(:, p, i), volume(p, i), tangent(:, :, :, :, p, i), &
                           stiffness(:, :, i))
      end do
    end do
  end subroutine cairn_solid_forces

  pure subroutine add_force(dim, plane, nodes, d, hoop, p, force)
    integer, intent(in)           :: dim, plane, nodes
    real(c_double), intent(in)    :: d(dim, nodes), hoop(nodes), p(3, 3)
    real(c_double), intent(inout) :: force(dim, nodes)
    integer :: a, j
    do a = 1, nodes
      do j = 1, dim
        force(:, a) = force(:, a) + p(:dim, j)*d(j, a)
      end do
    end do
    if (dim == 2 .and. plane == axisymmetric) force(1, :) = force(1, :) + p(3, 3)*hoop
  end subroutine add_force

  !> The same without a hoop, of at most eight cells side by side in the order of SIMD.
  pure subroutine flat_stiffness(dim, nodes, points, n, lower, d, volume, tangent, stiffness)
    integer, intent(in)           :: dim, nodes, points
    integer(c_int64_t), intent(in) :: n
    logical, intent(in)           :: lower !< what follows the nodes of a column alone
    real(c_double), intent(in)    :: d(dim, nodes, points, n), volume(points, n), tangent(3, 3, 3, 3, points, n)
    real(c_double), intent(inout) :: stiffness(dim, nodes, dim, nodes, n)
    real(c_double) :: sum(lanes, dim, nodes, dim, nodes), c(lanes, 3, 3, 3, 3), along(lanes, dim, nodes), size(lanes), &
                      half(lanes, 3, 3), part(lanes)
    integer :: p, a, b, i, j, k, l, lane
    sum = 0
    c = 0
    along = 0
    size = 0
    do p = 1, points
      do lane = 1, int(n)
        c(lane, :, :, :, :) = tangent(:, :, :, :, p, lane)
        along(lane, :, :) = d(:, :, p, lane)
        size(lane) = volume(p, lane)
      end do
      do b = 1, nodes
        do k = 1, dim
          do j = 1, dim
            do i = 1, dim
              half(:, i, j) = c(:, i, j, k, 1)*(size*along(:, 1, b)) ! stress by the displacement k of node b
              do l = 2, dim
                half(:, i, j) = half(:, i, j) + c(:, i, j, k, l)*(size*along(:, l, b))
              end do
            end do
          end do
          do a = merge(b, 1, lower), nodes
            do i = 1, dim
              part = sum(:, i, a, k, b)
              do j = 1, dim
                part = part + half(:, i, j)*along(:, j, a)
              end do
              sum(:, i, a, k, b) = part
            end do
          end do
        end do
      end do
    end do
    do lane = 1, int(n)
      do b = 1, nodes
        stiffness(:, merge(b, 1, lower):, :, b, lane) = sum(lane, :, merge(b, 1, lower):, :, b)
      end do
    end do
  end subroutine flat_stiffness

  pure subroutine add_stiffness(dim, plane, nodes, d, hoop, volume, c, stiffness)
    integer, intent(in)           :: dim, plane, nodes
    real(c_double), intent(in)    :: d(dim, nodes), hoop(nodes), volume, c(3, 3, 3, 3)
    real(c_double), intent(inout) :: stiffness(dim, nodes, dim, nodes)
    real(c_double) :: half(3, dim), ring
    integer :: a, b, j, k, l
    logical :: round
    round = dim == 2 .and. plane == axisymmetric
    ring = 0
    do b = 1, nodes
      do k = 1, dim
        half = 0 ! stress by the displacement k of node b
        do l = 1, dim
          do j = 1, dim
            half(:dim, j) = half(:dim, j) + c(:dim, j, k, l)*(volume*d(l, b))
          end do
          if (round) ring = merge(0.0_c_double, ring, l == 1) + c(3, 3, k, l)*(volume*d(l, b))
        end do
        if (round .and. k == 1) then
          half(:dim, :dim) = half(:dim, :dim) + c(:dim, :dim, 3, 3)*(volume*hoop(b))
          ring = ring + c(3, 3, 3, 3)*(volume*hoop(b))
        end if
        do a = 1, nodes
          do j = 1, dim
            stiffness(:, a, k, b) = stiffness(:, a, k, b) + half(:dim, j)*d(j, a)
          end do
          if (round) stiffness(1, a, k, b) = stiffness(1, a, k, b) + ring*hoop(a)
        end do
      end do
    end do
  end subroutine add_stiffness

  !> A cell whose dilatation is the mean: stresses work on the gradient with that.
  pure subroutine mean_cell(dim, plane, mean, nodes, points, d, hoop, h, volume, piola, tangent, want, force, stiffness)
    integer, intent(in)         :: dim, plane, mean, nodes, points
    real(c_double), intent(in)  :: d(dim, nodes, points), hoop(nodes, points), h(3, 3, points), volume(points)
    real(c_double), intent(in)  :: piola(3, 3, points), tangent(9, 9, points)
    integer(c_int32_t), intent(in) :: want
    real(c_double), intent(inout) :: force(dim*nodes), stiffness(dim*nodes, dim*nodes)
    real(c_double) :: f(3, 3), b(9, dim*nodes), g(dim*nodes, points), g_mean(dim*nodes), ratio(points), total, scaled, own, all, &
                      away(dim*nodes), push(dim*nodes), turn(dim*nodes, dim*nodes), cross(dim*nodes, dim*nodes), p9(9)
    integer :: p
    total = 0
    g_mean = 0
    if (want /= 0) cross = 0
    do p = 1, points
      f = 0
      if (mean == mean_finite) f = h(:, :, p)
      call dilatation(dim, plane, nodes, d(:, :, p), hoop(:, p), with_identity(f), g(:, p), turn)
      ratio(p) = volume(p)*determinant(with_identity(f))
      total = total + ratio(p)
      g_mean = g_mean + ratio(p)*g(:, p)
      if (want /= 0 .and. mean == mean_finite) cross = cross + ratio(p)*(outer(dim*nodes, g(:, p), g(:, p)) - turn)
    end do
    g_mean = g_mean/total
    if (want /= 0 .and. mean == mean_finite) cross = cross/total - outer(dim*nodes, g_mean, g_mean)
    all = 0
    do p = 1, points
      f = 0
      scaled = 1
      if (mean == mean_finite) then
        f = h(:, :, p)
        scaled = (total/sum(volume)/(ratio(p)/volume(p)))**third
      end if
      f = with_identity(f)
      away = g_mean - g(:, p)
      p9 = volume(p)*reshape(piola(:, :, p), [9])
      call gradients(dim, plane, nodes, d(:, :, p), hoop(:, p), b)
      push = scaled*matmul(p9, b)
      own = scaled*third*dot_product(p9, reshape(f, [9]))
      b = scaled*(b + third*spread(reshape(f, [9]), 2, dim*nodes)*spread(away, 1, 9))
      force = force + matmul(p9, b)
      if (want == 0) cycle
      stiffness = stiffness + matmul(transpose(b), matmul(volume(p)*tangent(:, :, p), b))
      if (mean /= mean_finite) cycle
      call dilatation(dim, plane, nodes, d(:, :, p), hoop(:, p), f, g(:, p), turn)
      stiffness = stiffness + third*(outer(dim*nodes, push, away) + outer(dim*nodes, away, push)) &
                  + third*own*outer(dim*nodes, away, away) + own*turn
      all = all + own
    end do
    if (want /= 0 .and. mean == mean_finite) stiffness = stiffness + all*cross
  end subroutine mean_cell

  !> A cell whose dilatation is linear over it: as above, the mean at each point its own.
  pure subroutine linear_cell(dim, plane, mean, nodes, points, d, hoop, h, volume, share, piola, tangent, want, force, stiffness)
    integer, intent(in)         :: dim, plane, mean, nodes, points
    real(c_double), intent(in)  :: d(dim, nodes, points), hoop(nodes, points), h(3, 3, points), volume(points), &
                                   share(points, points)
    real(c_double), intent(in)  :: piola(3, 3, points), tangent(9, 9, points)
    integer(c_int32_t), intent(in) :: want
    real(c_double), intent(inout) :: force(dim*nodes), stiffness(dim*nodes, dim*nodes)
    real(c_double) :: f(3, 3, points), b(9, dim*nodes), g(dim*nodes, points), ratio(points), wanted(points), scaled, own, &
                      mean_g(dim*nodes), away(dim*nodes), push(dim*nodes), turn(dim*nodes, dim*nodes), p9(9), back(points)
    integer :: p
    logical :: finite
    finite = mean == linear_finite
    do p = 1, points
      f(:, :, p) = 0
      if (finite) f(:, :, p) = h(:, :, p)
      f(:, :, p) = with_identity(f(:, :, p))
      call dilatation(dim, plane, nodes, d(:, :, p), hoop(:, p), f(:, :, p), g(:, p), turn)
      ratio(p) = determinant(f(:, :, p))
    end do
    wanted = matmul(share, ratio)
    back = 0
    do p = 1, points
      mean_g = matmul(g, share(p, :)*ratio)/wanted(p)
      scaled = 1
      if (finite) scaled = (wanted(p)/ratio(p))**third
      away = mean_g - g(:, p)
      p9 = volume(p)*reshape(piola(:, :, p), [9])
      call gradients(dim, plane, nodes, d(:, :, p), hoop(:, p), b)
      push = scaled*matmul(p9, b)
      own = scaled*third*dot_product(p9, reshape(f(:, :, p), [9]))
      b = scaled*(b + third*spread(reshape(f(:, :, p), [9]), 2, dim*nodes)*spread(away, 1, 9))
      force = force + matmul(p9, b)
      if (want == 0) cycle
      stiffness = stiffness + matmul(transpose(b), matmul(volume(p)*tangent(:, :, p), b))
      if (.not. finite) cycle
      call dilatation(dim, plane, nodes, d(:, :, p), hoop(:, p), f(:, :, p), g(:, p), turn)
      stiffness = stiffness + third*(outer(dim*nodes, push, away) + outer(dim*nodes, away, push)) &
                  + third*own*outer(dim*nodes, away, away) + own*(turn - outer(dim*nodes, mean_g, mean_g))
      back = back + own*share(p, :)*ratio/wanted(p)
    end do
    if (want == 0 .or. .not. finite) return
    do p = 1, points
      call dilatation(dim, plane, nodes, d(:, :, p), hoop(:, p), f(:, :, p), g(:, p), turn)
      stiffness = stiffness + back(p)*(outer(dim*nodes, g(:, p), g(:, p)) - turn)
    end do
  end subroutine linear_cell

  !> Change of volume over the volume by each displacement; its own change, with the sign turned.
  pure subroutine dilatation(dim, plane, nodes, d, hoop, f, g, turn)
    integer, intent(in)         :: dim, plane, nodes
    real(c_double), intent(in)  :: d(dim, nodes), hoop(nodes), f(3, 3)
    real(c_double), intent(out) :: g(dim, nodes), turn(dim, nodes, dim, nodes)
    real(c_double) :: back(3, 3), now(dim, nodes)
    integer :: a, b, k, l
    back = inverse(f)
    now = matmul(transpose(back(:dim, :dim)), d)
    g = now
    if (dim == 2 .and. plane == axisymmetric) g(1, :) = g(1, :) + hoop*back(3, 3)
    do b = 1, nodes
      do l = 1, dim
        do a = 1, nodes
          do k = 1, dim
            turn(k, a, l, b) = now(l, a)*now(k, b)
          end do
        end do
      end do
      if (dim == 2 .and. plane == axisymmetric) turn(1, :, 1, b) = turn(1, :, 1, b) + hoop*hoop(b)*back(3, 3)**2
    end do
  end subroutine dilatation

  !> Gradient of displacement by each displacement.
  pure subroutine gradients(dim, plane, nodes, d, hoop, b)
    integer, intent(in)         :: dim, plane, nodes
    real(c_double), intent(in)  :: d(dim, nodes), hoop(nodes)
    real(c_double), intent(out) :: b(3, 3, dim, nodes)
    integer :: a, k
    b = 0
    do a = 1, nodes
      do k = 1, dim
        b(k, :dim, k, a) = d(:, a)
      end do
      if (dim == 2 .and. plane == axisymmetric) b(3, 3, 1, a) = hoop(a)
    end do
  end subroutine gradients

  pure function outer(n, a, b) result(c)
    integer, intent(in)        :: n
    real(c_double), intent(in) :: a(n), b(n)
    real(c_double) :: c(n, n)
    c = spread(a, 2, n)*spread(b, 1, n)
  end function outer

  !> One step of Newton's method on the strain across the thickness of n points, which has no stress; done: the stress and the
  !> tangent are then those in the plane.
  pure subroutine cairn_thickness_strain(n, piola, tangent, h, left) bind(c)
    integer(c_int64_t), value       :: n
    real(c_double), intent(in)      :: piola(3, 3, n)         !< [Pa]
    real(c_double), intent(inout)   :: tangent(3, 3, 3, 3, n) !< [Pa]; condensed when left is nought
    real(c_double), intent(inout)   :: h(3, 3, n)             !< F - 1 [-]
    integer(c_int64_t), intent(out) :: left                   !< points that have a stress across
    real(c_double) :: column(3, 3), row(3, 3)
    integer(c_int64_t) :: i
    integer :: k, l
    left = 0
    do i = 1, n
      associate (stiff => tangent(3, 3, 3, 3, i), stress => piola(3, 3, i))
        if (abs(stress) <= 1e-13_c_double*abs(stiff)*(abs(h(3, 3, i)) + maxval(abs(h(:, :, i))) + tiny(stress))) cycle
        left = left + 1
        h(3, 3, i) = max(h(3, 3, i) - stress/stiff, 0.5_c_double*(h(3, 3, i) - 1))
      end associate
    end do
    if (left > 0) return
    do i = 1, n
      column = tangent(:, :, 3, 3, i)/tangent(3, 3, 3, 3, i)
      row = tangent(3, 3, :, :, i)
      do l = 1, 3
        do k = 1, 3
          tangent(:, :, k, l, i) = tangent(:, :, k, l, i) - column*row(k, l)
        end do
      end do
    end do
  end subroutine cairn_thickness_strain

  !> Cauchy's stress of n points, 11 22 33 12 23 13.
  pure subroutine cairn_true_stress(finite, n, h, piola, stress) bind(c)
    integer(c_int32_t), value   :: finite          !< 0: strains are small, and all stresses one
    integer(c_int64_t), value   :: n
    real(c_double), intent(in)  :: h(3, 3, n)      !< F - 1 [-]
    real(c_double), intent(in)  :: piola(3, 3, n)  !< [Pa]
    real(c_double), intent(out) :: stress(6, n)    !< [Pa]
    real(c_double) :: f(3, 3), s(3, 3)
    integer(c_int64_t) :: i
    do i = 1, n
      s = piola(:, :, i)
      if (finite /= 0) then
        f = with_identity(h(:, :, i))
        s = matmul(s, transpose(f))/determinant(f)
      end if
      stress(:, i) = [s(1, 1), s(2, 2), s(3, 3), 0.5_c_double*(s(1, 2) + s(2, 1)), 0.5_c_double*(s(2, 3) + s(3, 2)), &
                      0.5_c_double*(s(1, 3) + s(3, 1))]
    end do
  end subroutine cairn_true_stress

  !> Gradients in space and the Jacobian.
  pure subroutine in_space(dim, nodes, gradient, x, d, volume)
    integer, intent(in)         :: dim, nodes
    real(c_double), intent(in)  :: gradient(dim, nodes), x(dim, nodes)
    real(c_double), intent(out) :: d(dim, nodes), volume
    real(c_double) :: j(3, 3), back(3, 3)
    integer :: a, i, k
    j = 0
    if (dim == 2) j(3, 3) = 1
    do a = 1, nodes
      do k = 1, dim
        do i = 1, dim
          j(i, k) = j(i, k) + gradient(i, a)*x(k, a) ! dx_k / dxi_i
        end do
      end do
    end do
    volume = determinant(j)
    back = inverse(j)
    do a = 1, nodes
      do k = 1, dim
        d(k, a) = back(k, 1)*gradient(1, a)
        do i = 2, dim
          d(k, a) = d(k, a) + back(k, i)*gradient(i, a)
        end do
      end do
    end do
  end subroutine in_space
end module solid_cells
