!> Contact of round convex shapes with a triangle of a surface that is solid behind it: common routines.
module convex_facet
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use bracketed_zero, only: bracket, narrow, next_angle, where_it_falls
  use hull_view, only: solid
  use convex_contact, only: touch_plane
  use convex_shape, only: convex, is_cylinder, support
  use facet_points, only: add, findings
  use facet_view, only: after, cross, inward, is_over, is_under_valley, of_mesh, on_edge, pokes_out
  use rim_arcs, only: most_on_rim, points_on_rim
  implicit none
  private
  public :: arc, see_arc, is_near, on_inside, farthest_on_arc, height_along, leaves_elsewhere

  !> An edge, and the directions that lead out of the surface from it: cos(a) middle + sin(a) aside, |a| <= half.
  type :: arc
    real(c_double) :: from(3) = 0, e(3) = 0, length = 0          !< start [m], unit direction, length [m]
    real(c_double) :: middle(3) = 0, aside(3) = 0, half = 0      !< unit, unit, angle
    real(c_double) :: first(3) = 0, last(3) = 0                  !< the ends, at -half and half, as the triangles have them
  end type arc

  real(c_double), parameter :: upright = 0.7_c_double            !< cosine: an end looks at the triangle, else the side
  integer, parameter :: most_points = 20                         !< that a plane may find of one body

contains

  pure subroutine see_arc(q, k, g)
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    type(arc), intent(out) :: g
    real(c_double) :: m(3), other(3), w(3)
    g%from = q%v(k, :)
    g%e = q%v(after(k), :) - g%from
    g%length = sqrt(dot_product(g%e, g%e))
    g%e = g%e/g%length
    m = q%normal(1, :)
    w = -inward(q, k, after(after(k)))
    if (q%edge(4, k) == 0) then
      other = w
    else
      other = normal_beyond(q, k)
      w = w - inward(q, k, int(q%edge(4, k)))
    end if
    ! of two normals nearly the same their sum is the surer middle, of nearly opposite ones the ways out of both triangles
    g%middle = m + other
    if (dot_product(m, other) < 0) g%middle = w
    g%middle = g%middle - dot_product(g%middle, g%e)*g%e
    g%middle = g%middle/sqrt(dot_product(g%middle, g%middle))
    g%aside = cross(g%e, g%middle)
    g%half = atan2(dot_product(g%aside, m), dot_product(g%middle, m))
    g%first = merge(m, other, g%half < 0)
    g%last = merge(other, m, g%half < 0)
    g%half = abs(g%half)
  end subroutine see_arc

  !> Unit normal of the triangle beyond edge k.
  pure function normal_beyond(q, k) result(m)
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    real(c_double) :: m(3)
    m = cross(q%v(k, :) - q%v(after(k), :), q%v(q%edge(4, k), :) - q%v(after(k), :))
    m = m/sqrt(dot_product(m, m))
  end function normal_beyond

  !> True if the bounding ball of a body at `at` reaches an edge.
  pure logical function is_near(p, at, g, limit)
    type(convex), intent(in) :: p
    real(c_double), intent(in) :: at(3), limit
    type(arc), intent(in) :: g
    real(c_double) :: w(3)
    w = at - g%from
    w = w - max(0.0_c_double, min(g%length, dot_product(w, g%e)))*g%e
    is_near = dot_product(w, w) <= (p%size + p%layer + limit)**2
  end function is_near

  !> How far a body is beyond a plane through y with unit normal n.
  pure real(c_double) function height_along(p, at, n, y)
    type(convex), intent(in) :: p
    real(c_double), intent(in) :: at(3), n(3), y(3)
    height_along = dot_product(n, at + support(p, -n) - y) - p%layer
  end function height_along

  !> The points that a body in front of the triangle has on its plane, where they are over it. On flat ground the triangles
  !> share the few points of their plane; else each sees all of them.
  subroutine on_inside(p, q, at, limit, f)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    real(c_double), intent(in) :: at(3), limit
    type(findings), intent(inout) :: f
    real(c_double) :: m(3), gap(most_points), normal(3, most_points), point(3, most_points), x(3), low
    integer(c_int32_t) :: count, feature(most_points)
    integer :: k, most
    m = q%normal(1, :)
    if (.not. dot_product(m, at) > q%offset(1)) return
    low = height_along(p, at - q%offset(1)*m, m, [0.0_c_double, 0.0_c_double, 0.0_c_double])
    if (low > limit .or. low < -2*q%size) return
    if (p%kind == is_cylinder .and. of_mesh(q) .and. abs(dot_product(p%frame(:, 3), m)) > upright) then
      call end_on_mesh(p, q, at, limit, low, f)
      return
    end if
    most = 5
    if (p%kind == is_cylinder) most = 4
    if (pokes_out(q, 1) .or. pokes_out(q, 2) .or. pokes_out(q, 3)) then
      most = most_points
    end if
    call touch_plane(p, at - q%offset(1)*m, m, limit, most, count, gap(1:most), normal(:, 1:most), point(:, 1:most), &
                     feature(1:most))
    do k = 1, count
      x = at + point(:, k) + (gap(k)/2)*m
      if (meets_inside(p, q, at, x, gap(k), low)) call add(f, point(:, k), m, gap(k), feature(k))
    end do
  end subroutine on_inside

  !> The same of an end that looks at a side of a mesh, whose nodes bend it under a rim: the points of the rim over each triangle
  !> are of that triangle alone.
  pure subroutine end_on_mesh(p, q, at, limit, low, f)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    real(c_double), intent(in) :: at(3), limit, low
    type(findings), intent(inout) :: f
    real(c_double) :: m(3), x(3, most_on_rim), gap
    integer(c_int32_t) :: name(most_on_rim)
    integer :: k, count
    m = q%normal(1, :)
    call points_on_rim(p, q, at, count, x, name)
    do k = 1, count
      gap = dot_product(m, x(:, k)) - q%offset(1)
      if (gap > limit) cycle
      if (meets_inside(p, q, at, x(:, k), gap, low)) call add(f, x(:, k) - at - (gap/2)*m, m, gap, name(k))
    end do
  end subroutine end_on_mesh

  !> True if a point x of the body, at `gap` from the plane of the triangle, belongs to this triangle.
  pure logical function meets_inside(p, q, at, x, gap, low)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    real(c_double), intent(in) :: at(3), x(3), gap, low
    if (is_over(q, x)) then
      meets_inside = gap >= 0
      if (.not. meets_inside) meets_inside = .not. leaves_elsewhere(p, q, at, x, gap, low)
    else
      meets_inside = gap < 0
      if (meets_inside) meets_inside = is_under_valley(q, x)
    end if
  end function meets_inside

  !> True if a point at `height` behind this triangle is nearer to the interior of a neighbouring one, along whose normal the whole
  !> body has a shorter translation out than `low`.
  pure logical function leaves_elsewhere(p, q, at, x, height, low)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    real(c_double), intent(in) :: at(3), x(3), height, low
    real(c_double) :: a(3), b(3), c(3), m(3), h, slack
    integer :: j
    slack = on_edge*q%size
    leaves_elsewhere = .false.
    do j = 7, q%edges
      a = q%v(q%edge(1, j), :)
      b = q%v(q%edge(2, j), :)
      c = q%v(q%edge(4, j), :)
      m = cross(b - a, c - a)
      m = m/sqrt(dot_product(m, m))
      h = dot_product(m, x - a)
      if (h > 0 .or. h <= height + slack) cycle
      if (min(dot_product(cross(b - a, x - a), m), dot_product(cross(c - b, x - b), m), &
              dot_product(cross(a - c, x - c), m)) < -slack*q%size) cycle
      leaves_elsewhere = height_along(p, at, m, a) > low + slack
      if (leaves_elsewhere) return
    end do
  end function leaves_elsewhere

  !> The direction within an arc along which a body is farthest from its edge, and the point it reaches against it, from the
  !> centre; none where that is an end of the arc. The slope of the height is how far the point is aside of the edge.
  pure subroutine farthest_on_arc(p, at, g, found, n, x)
    type(convex), intent(in) :: p
    real(c_double), intent(in) :: at(3)
    type(arc), intent(in) :: g
    logical, intent(out) :: found
    real(c_double), intent(out) :: n(3), x(3)
    type(bracket) :: b
    real(c_double) :: here, slope
    logical :: more
    n = g%middle
    x = 0
    b%low = -g%half
    b%high = g%half
    call see(g%first, b%low, b%x_low, b%of_low)
    call see(g%last, b%high, b%x_high, b%of_high)
    found = b%of_low > 0 .and. b%of_high < 0
    if (.not. found) return
    do
      call next_angle(b, here, more)
      if (.not. more) exit
      call see(cos(here)*g%middle + sin(here)*g%aside, here, x, slope)
      call narrow(b, here, slope, x)
    end do
    call where_it_falls(b, here, x)
    n = cos(here)*g%middle + sin(here)*g%aside
  contains
    pure subroutine see(d, angle, reached, slope)
      real(c_double), intent(in) :: d(3), angle
      real(c_double), intent(out) :: reached(3), slope
      reached = support(p, -d)
      slope = dot_product(cos(angle)*g%aside - sin(angle)*g%middle, at + reached - g%from)
    end subroutine see
  end subroutine farthest_on_arc

end module convex_facet
