!> Distance of two convex hulls that do not overlap: the point of the set of differences nearest to 0, by Wolfe's method
!> (1976) with the supports of Gilbert, Johnson & Keerthi (1988).
module hull_distance
  use, intrinsic :: iso_c_binding, only: c_double
  use hull_view, only: solid
  implicit none
  private
  public :: nearest_points, simplex, add_and_reduce

  integer, parameter :: most_rounds = 200
  real(c_double), parameter :: tolerance = 8*epsilon(1.0_c_double)

  !> Differences of vertices whose hull holds the nearest point.
  type :: simplex
    integer :: count = 0
    integer :: a(4) = 0, b(4) = 0
    real(c_double) :: w(3, 4) = 0, share(4) = 0
  end type simplex

contains

  !> Nearest points, from the centres of a and b; a stands at `at` from b. `start` is a direction from b to a. distance is 0
  !> where they overlap. Where each point lies: on the vertices vertex_a(1:corners), vertex_b(1:corners).
  subroutine nearest_points(a, b, at, start, distance, point_a, point_b, corners, vertex_a, vertex_b)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(:), start(:)
    real(c_double), intent(out) :: distance, point_a(size(at)), point_b(size(at))
    integer, intent(out) :: corners, vertex_a(4), vertex_b(4)
    type(simplex) :: s
    real(c_double) :: v(3), w(3), length, extent, shift(3)
    integer :: i, j, round, d

    d = size(at)
    extent = a%size + b%size
    shift = 0
    shift(1:d) = at
    v = 0
    v(1:d) = start
    call farthest(a, b, shift, v, i, j, w)
    s%count = 1
    s%a = 0
    s%b = 0
    s%a(1) = i
    s%b(1) = j
    s%w(:, 1) = w
    s%share(1) = 1
    v = w
    do round = 1, most_rounds
      length = sqrt(dot_product(v, v))
      if (length <= tolerance*extent) exit
      call farthest(a, b, shift, v, i, j, w)
      if (dot_product(v, v - w) <= tolerance*extent*length) exit
      if (holds(s, i, j)) exit
      call add_and_reduce(s, i, j, w, v)
      if (s%count == 4) exit
      if (.not. dot_product(v, v) < length*length) exit ! rounding alone moves it now
    end do
    distance = sqrt(dot_product(v, v))
    if (s%count == 4 .or. distance <= tolerance*extent) distance = 0
    point_a = 0
    point_b = 0
    corners = s%count
    vertex_a = s%a
    vertex_b = s%b
    do round = 1, s%count
      point_a = point_a + s%share(round)*a%v(s%a(round), :)
      point_b = point_b + s%share(round)*b%v(s%b(round), :)
    end do
  end subroutine nearest_points

  pure function holds(s, i, j)
    type(simplex), intent(in) :: s
    integer, intent(in) :: i, j
    logical :: holds
    integer :: k
    holds = .false.
    do k = 1, 4
      holds = holds .or. (k <= s%count .and. s%a(k) == i .and. s%b(k) == j)
    end do
  end function holds

  !> The difference of vertices that reaches farthest against v.
  pure subroutine farthest(a, b, at, v, i, j, w)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), v(3)
    integer, intent(out) :: i, j
    real(c_double), intent(out) :: w(3)
    i = support(a%vertices, size(a%v, 2), a%v, -v)
    j = support(b%vertices, size(b%v, 2), b%v, v)
    w = at
    w(1:size(a%v, 2)) = w(1:size(a%v, 2)) + (a%v(i, :) - b%v(j, :))
  end subroutine farthest

  pure function support(n, dim, x, direction) result(best)
    integer, intent(in) :: n, dim
    real(c_double), intent(in) :: x(n, dim), direction(3)
    integer :: best, i
    real(c_double) :: reach, high
    high = -huge(high)
    best = 1
    do i = 1, n
      reach = direction(1)*x(i, 1) + direction(2)*x(i, 2)
      if (dim == 3) reach = reach + direction(3)*x(i, 3)
      if (reach > high) then
        high = reach
        best = i
      end if
    end do
  end function support

  !> Adds a point to the simplex and leaves the smallest part of it that holds the nearest point v.
  pure subroutine add_and_reduce(s, i, j, w, v)
    type(simplex), intent(inout) :: s
    integer, intent(in) :: i, j
    real(c_double), intent(in) :: w(3)
    real(c_double), intent(inout) :: v(3)
    real(c_double) :: y(4), x(4), step, t
    integer :: k, n, drop

    s%count = s%count + 1
    s%a(s%count) = i
    s%b(s%count) = j
    s%w(:, s%count) = w
    s%share(s%count) = 0
    do
      n = s%count
      call affine_shares(n, s%w, y, v)
      x(1:n) = s%share(1:n)
      if (all(y(1:n) > 0)) then
        s%share(1:n) = y(1:n)
        return
      end if
      ! back along the way from x to y until all shares are positive; the first that vanishes goes
      step = 1
      drop = 0
      do k = 1, n
        if (y(k) > 0) cycle
        t = 0
        if (x(k) - y(k) > 0) t = x(k)/(x(k) - y(k))
        if (k == n .and. .not. x(k) > 0) t = 0
        if (drop == 0 .or. t < step) then
          step = t
          drop = k
        end if
      end do
      s%share(1:n) = x(1:n) + step*(y(1:n) - x(1:n))
      do k = drop, n - 1
        s%a(k) = s%a(k + 1)
        s%b(k) = s%b(k + 1)
        s%w(:, k) = s%w(:, k + 1)
        s%share(k) = s%share(k + 1)
      end do
      s%count = n - 1
      s%share(1:n - 1) = max(s%share(1:n - 1), 0.0_c_double)
      s%share(1:n - 1) = s%share(1:n - 1)/sum(s%share(1:n - 1))
      v = matmul(s%w(:, 1:n - 1), s%share(1:n - 1))
    end do
  end subroutine add_and_reduce

  !> Nearest point v of the affine hull of n points, and their shares in it; a flat simplex has shares -1 of its last point.
  pure subroutine affine_shares(n, w, y, v)
    integer, intent(in) :: n
    real(c_double), intent(in) :: w(3, 4)
    real(c_double), intent(out) :: y(4), v(3)
    real(c_double) :: d1(3), d2(3), d3(3), m(3), square, tiny_square
    y = 0
    y(1) = 1
    v = w(:, 1)
    if (n == 1) return
    d1 = w(:, 2) - w(:, 1)
    square = dot_product(d1, d1)
    if (n == 2) then
      y(2) = -dot_product(w(:, 1), d1)/square
      y(1) = dot_product(w(:, 2), d1)/square
      v = w(:, 1) + y(2)*d1
      if (y(2) > 0.5_c_double) v = w(:, 2) - y(1)*d1
      return
    end if
    d2 = w(:, 3) - w(:, 1)
    m = cross(d1, d2)
    tiny_square = epsilon(square)**2*square*dot_product(d2, d2)
    square = dot_product(m, m)
    y(n) = -1
    if (square <= tiny_square) return
    if (n == 3) then
      y(2) = dot_product(cross(d2, w(:, 1)), m)/square
      y(3) = dot_product(cross(w(:, 1), d1), m)/square
      y(1) = dot_product(cross(w(:, 2), w(:, 3)), m)/square
      v = (dot_product(w(:, 1) + w(:, 2) + w(:, 3), m)/(3*square))*m
      return
    end if
    d3 = w(:, 4) - w(:, 1)
    if (.not. abs(dot_product(m, d3)) > epsilon(square)*sqrt(square*dot_product(d3, d3))) return
    y(2) = -dot_product(w(:, 1), cross(d2, d3))/dot_product(m, d3)
    y(3) = -dot_product(d1, cross(w(:, 1), d3))/dot_product(m, d3)
    y(4) = -dot_product(m, w(:, 1))/dot_product(m, d3)
    y(1) = 1 - y(2) - y(3) - y(4)
    v = 0
  end subroutine affine_shares

  pure function cross(a, b) result(c)
    real(c_double), intent(in) :: a(3), b(3)
    real(c_double) :: c(3)
    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

end module hull_distance
