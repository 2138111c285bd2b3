!> The end of a cylinder on a side of a mesh: the parts of its rim over the triangle, by the middles of which it rests. They follow
!> from the triangle and the rim alone, so that what turns with all of its scene touches where it did.
module rim_arcs
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use convex_shape, only: convex
  use facet_view, only: after, cross, inward
  use hull_view, only: solid
  implicit none
  private
  public :: most_on_rim, points_on_rim

  real(c_double), parameter :: pi = acos(-1.0_c_double), whole = 2*pi
  real(c_double), parameter :: shortest = 1e-6_c_double !< angle: what rounding leaves of a rim that passes a vertex is no arc
  real(c_double), parameter :: widest = pi/2            !< angle: longer arcs are cut
  real(c_double), parameter :: turned = 1e-4_c_double   !< sine: an end that leans by less has no lowest point
  integer, parameter :: most_on_rim = 16
  integer(c_int32_t), parameter :: lowest_name = 4000, names = 8

  !> Rim of the end of a cylinder that faces a triangle, in the frame of the triangle.
  type :: rim
    real(c_double) :: centre(3), e(3), g(3), radius
    real(c_double) :: low    !< angle at which it reaches farthest towards the triangle
    logical :: leans
  end type rim

contains

  !> Places x on the rim over triangle q of a cylinder at `at`, each with a name within the pair.
  pure subroutine points_on_rim(p, q, at, count, x, name)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    real(c_double), intent(in) :: at(3)
    integer, intent(out) :: count
    real(c_double), intent(out) :: x(3, most_on_rim)
    integer(c_int32_t), intent(out) :: name(most_on_rim)
    type(rim) :: r
    real(c_double) :: from(3), half(3), start, length
    integer :: k
    logical :: over
    count = 0
    call see_rim(p, q, at, r)
    if (r%leans) call put(r, r%low, lowest_name, count, x, name)
    call seen_from_edges(q, r, from, half, over)
    if (.not. over) return
    if (all(half >= pi)) call cut_arc(r, 0.0_c_double, whole, 0, count, x, name)
    do k = 1, 3 ! each edge is entered once
      if (half(k) >= pi) cycle
      start = from(k)
      length = way_within(from, half, start)
      if (length > shortest) call cut_arc(r, start, length, k, count, x, name)
    end do
  end subroutine points_on_rim

  pure subroutine see_rim(p, q, at, r)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    real(c_double), intent(in) :: at(3)
    type(rim), intent(out) :: r
    real(c_double) :: axis(3), m(3), down(3)
    m = q%normal(1, :)
    axis = -sign(1.0_c_double, dot_product(p%frame(:, 3), m))*p%frame(:, 3)
    r%centre = at + p%half(3)*axis
    r%radius = p%half(1)
    r%e = q%v(2, :) - q%v(1, :)
    r%e = r%e - dot_product(r%e, axis)*axis
    r%e = r%e/sqrt(dot_product(r%e, r%e))
    r%g = cross(axis, r%e)
    down = dot_product(m, axis)*axis - m
    r%leans = dot_product(down, down) > turned*turned
    r%low = atan2(dot_product(down, r%g), dot_product(down, r%e))
  end subroutine see_rim

  !> The rim is on the triangle's side of edge k over 2 half(k) from from(k), everywhere if half is pi; over: not nowhere.
  pure subroutine seen_from_edges(q, r, from, half, over)
    type(solid), intent(in) :: q
    type(rim), intent(in) :: r
    real(c_double), intent(out) :: from(3), half(3)
    logical, intent(out) :: over
    real(c_double) :: w(3), inside, a, b, reach
    integer :: k
    over = .true.
    from = 0
    half = pi
    do k = 1, 3
      w = inward(q, k, after(after(k)))
      inside = dot_product(w, r%centre - q%v(k, :))
      a = r%radius*dot_product(w, r%e)
      b = r%radius*dot_product(w, r%g)
      reach = sqrt(a*a + b*b)
      if (inside >= reach) cycle
      over = over .and. inside > -reach
      if (.not. over) return
      half(k) = acos(-inside/reach)
      from(k) = atan2(b, a) - half(k)
    end do
  end subroutine seen_from_edges

  !> Angle over which the rim stays above the triangle from `start` on [rad]; 0 if it is not above it there.
  pure real(c_double) function way_within(from, half, start)
    real(c_double), intent(in) :: from(3), half(3), start
    real(c_double) :: passed
    integer :: k
    way_within = whole
    do k = 1, 3
      if (half(k) >= pi) cycle
      passed = modulo(start - from(k), whole)
      way_within = min(way_within, max(2*half(k) - passed, 0.0_c_double))
    end do
  end function way_within

  !> The middles of an arc, or of the equal parts of a long one; not of the part that the lowest point is in, beside which another
  !> would bear the same.
  pure subroutine cut_arc(r, start, length, edge, count, x, name)
    type(rim), intent(in) :: r
    real(c_double), intent(in) :: start, length
    integer, intent(in) :: edge
    integer, intent(inout) :: count
    real(c_double), intent(inout) :: x(3, most_on_rim)
    integer(c_int32_t), intent(inout) :: name(most_on_rim)
    integer :: parts, k
    parts = max(1, ceiling(length/widest - shortest))
    do k = 1, parts
      if (r%leans .and. modulo(r%low - start - (k - 1)*length/parts, whole) < length/parts) cycle
      call put(r, start + (k - 0.5_c_double)*length/parts, int(names*edge + k, c_int32_t), count, x, name)
    end do
  end subroutine cut_arc

  pure subroutine put(r, angle, named, count, x, name)
    type(rim), intent(in) :: r
    real(c_double), intent(in) :: angle
    integer(c_int32_t), intent(in) :: named
    integer, intent(inout) :: count
    real(c_double), intent(inout) :: x(3, most_on_rim)
    integer(c_int32_t), intent(inout) :: name(most_on_rim)
    count = count + 1
    x(:, count) = r%centre + r%radius*(cos(angle)*r%e + sin(angle)*r%g)
    name(count) = named
  end subroutine put

end module rim_arcs
