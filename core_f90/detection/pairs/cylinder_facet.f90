!> Contact of a cylinder with one triangle of a surface that is solid behind it.
module cylinder_facet
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls, solid, view_solid
  use convex_facet, only: arc, farthest_on_arc, height_along, is_near, leaves_elsewhere, on_inside, see_arc
  use convex_shape, only: convex, see_cylinder
  use facet_points, only: add, findings, settle
  use facet_view, only: cross, leaves_edge, leaves_vertex, on_edge, pokes_out, stands_out
  use patch_points, only: name_of_edges, vertex_of_b
  implicit none
  private
  public :: cairn_pair_cylinder_facet

  !> Sine of the angle by which a normal may lean out of what an edge or a vertex allows: points of a flat patch, some of
  !> them lifted, stay in it.
  real(c_double), parameter :: lean = 0.05_c_double

contains

  !> The points that it has on the plane of the triangle, where they are over it; edges that stand out, across its side and
  !> around its ends, and vertices that poke out, each for the triangle that owns it.
  subroutine cairn_pair_cylinder_facet(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, &
                               normal, point, feature) bind(c)
    integer(c_int32_t), value :: n                      !< pairs
    type(cairn_hulls), intent(in) :: hulls
    integer(c_int32_t), intent(in) :: a(n), b(n)        !< contactors
    real(c_double), intent(in) :: between(n, 3)         !< centre of A - centre of B [m]
    real(c_double), intent(in) :: radius_a(n)           !< of the ball around A [m]
    real(c_double), intent(in) :: radius_b(n)           !< of the ball around B [m]
    real(c_double), intent(in) :: direction_b(n, 4)     !< not read
    real(c_double), intent(in) :: limit(n)              !< gaps above do not count [m]
    integer(c_int32_t), intent(out) :: count(n)         !< points of each pair
    real(c_double), intent(out) :: gap(hulls%most, n)   !< negative when overlapping [m]
    real(c_double), intent(out) :: normal(3, hulls%most, n) !< unit, from B to A
    real(c_double), intent(out) :: point(3, hulls%most, n)  !< middle of the gap - centre of A [m]
    integer(c_int32_t), intent(out) :: feature(hulls%most, n) !< names of the points within the pair
    type(hulls_view) :: view
    type(convex) :: p
    type(solid) :: q
    type(findings) :: f
    integer :: i, k

    call open_hulls(hulls, view)
    do i = 1, n
      call see_cylinder(view, a(i), radius_a(i), p)
      call view_solid(view, b(i), radius_b(i), q)
      f%count = 0
      f%slack = on_edge*min(p%size, q%size)
      call on_inside(p, q, between(i, :), limit(i), f)
      do k = 1, 3
        if (q%edge(3, k) /= 0) then
          if (stands_out(q, k)) call at_edge(p, q, k, between(i, :), limit(i), f)
        end if
        if (q%edge(3, 3 + k) /= 0) call at_vertex(p, q, k, between(i, :), limit(i), f)
      end do
      call settle(f, view%most, count(i), gap(:, i), normal(:, :, i), point(:, :, i), feature(:, i))
    end do
  end subroutine cairn_pair_cylinder_facet

  !> Contacts at an edge; of overlaps only those whose depth is within 1 % of the shortest translation out of the wedge.
  subroutine at_edge(p, q, k, at, limit, f)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    real(c_double), intent(in) :: at(3), limit
    type(findings), intent(inout) :: f
    type(arc) :: g
    type(findings) :: c
    real(c_double) :: best
    integer :: i
    call see_arc(q, k, g)
    if (.not. is_near(p, at, g, limit)) return
    call by_side(p, q, k, g, at, limit, c)
    do i = 1, 2
      call by_end(p, q, k, g, at, i, limit, c)
    end do
    best = 0
    if (any(c%gap(1:c%count) < 0)) then
      best = max(height_along(p, at, g%first, g%from), height_along(p, at, g%last, g%from))
      do i = 1, c%count
        best = max(best, height_along(p, at, c%n(:, i), g%from))
      end do
      best = 1.01_c_double*min(best, 0.0_c_double) - on_edge*q%size
    end if
    do i = 1, c%count
      if (c%gap(i) < best) cycle
      if (c%gap(i) < 0) then
        if (leaves_elsewhere(p, q, at, at + c%x(:, i) + (c%gap(i)/2)*c%n(:, i), c%gap(i), c%gap(i))) cycle
      end if
      call add(f, c%x(:, i), c%n(:, i), c%gap(i), c%name(i))
    end do
  end subroutine at_edge

  !> The side crosses an edge along the normal across the edge and the axis.
  pure subroutine by_side(p, q, k, g, at, limit, f)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    type(arc), intent(in) :: g
    real(c_double), intent(in) :: at(3), limit
    type(findings), intent(inout) :: f
    real(c_double) :: axis(3), n(3), w(3), length, det, along
    axis = p%frame(:, 3)
    n = cross(axis, g%e)
    length = sqrt(dot_product(n, n))
    if (length <= 1e-8_c_double) return
    n = n/length
    if (dot_product(n, g%middle) < 0) n = -n
    w = g%from - at
    det = dot_product(cross(axis, g%e), n)
    along = dot_product(cross(w, g%e), n)/det
    if (.not. abs(along) < p%half(3)) return
    call keep(q, k, g, at, at + along*axis - p%half(1)*n, n, lean, limit, p, name_of_edges(1, k), f)
  end subroutine by_side

  !> An end lies on an edge about in its plane where its rim crosses the edge, twice; else, and where it is nearer, it touches
  !> with the point of the rim that is farthest out.
  subroutine by_end(p, q, k, g, at, which, limit, f)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    integer, intent(in) :: k, which
    type(arc), intent(in) :: g
    real(c_double), intent(in) :: at(3), limit
    type(findings), intent(inout) :: f
    type(convex) :: disc
    real(c_double) :: axis(3), centre(3), n(3), x(3), least
    logical :: found
    axis = (2*which - 3)*p%frame(:, 3) ! outward
    centre = at + p%half(3)*axis
    least = huge(least)
    if (abs(dot_product(axis, g%e)) < lean) call at_crossings(p, q, k, g, at, axis, which, limit, least, f)
    disc = p
    disc%half(3) = 0
    call farthest_on_arc(disc, centre, g, found, n, x)
    if (.not. found .or. dot_product(n, axis) > lean) return
    x = centre + x
    if (dot_product(n, x - g%from) >= least - on_edge*q%size) return
    call keep(q, k, g, at, x, n, on_edge, limit, p, name_of_edges(1 + which, k), f)
  end subroutine by_end

  !> least: the gap of the nearer crossing.
  subroutine at_crossings(p, q, k, g, at, axis, which, limit, least, f)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    integer, intent(in) :: k, which
    type(arc), intent(in) :: g
    real(c_double), intent(in) :: at(3), axis(3), limit
    real(c_double), intent(inout) :: least
    type(findings), intent(inout) :: f
    real(c_double) :: centre(3), u(3), s(3), n(3), x(3), radial(3), off, half_chord
    logical :: found
    integer :: i
    centre = at + p%half(3)*axis
    u = g%e - dot_product(axis, g%e)*axis
    u = u/sqrt(dot_product(u, u))
    s = cross(axis, u)
    off = dot_product(g%from - centre, s)
    if (.not. abs(off) < p%half(1)) return
    half_chord = sqrt((p%half(1) - off)*(p%half(1) + off))
    do i = -1, 1, 2
      radial = (off*s + i*half_chord*u)/p%half(1)
      call nearest_of_rim(centre, p%half(1), axis, g, radial, found)
      if (.not. found) cycle
      n = cross(cross(axis, radial), g%e)
      if (.not. dot_product(n, n) > 1e-16_c_double) cycle
      n = n/sqrt(dot_product(n, n))
      if (dot_product(n, axis) > 0) n = -n
      if (dot_product(n, radial) > lean) cycle
      x = centre + p%half(1)*radial
      least = min(least, dot_product(n, x - g%from))
      call keep(q, k, g, at, x, n, lean, limit, p, name_of_edges(2 + 2*which + (i + 1)/2, k), f)
    end do
  end subroutine at_crossings

  !> Newton's steps along the rim of an end to where its distance from the line of the edge is the least around.
  pure subroutine nearest_of_rim(centre, radius, axis, g, radial, found)
    real(c_double), intent(in) :: centre(3), radius, axis(3)
    type(arc), intent(in) :: g
    real(c_double), intent(inout) :: radial(3) !< unit, from the centre
    logical, intent(out) :: found
    real(c_double) :: w(3), d(3), slope, curve, step
    integer :: round
    found = .false.
    do round = 1, 8
      d = cross(axis, radial)
      w = centre + radius*radial - g%from
      w = w - dot_product(w, g%e)*g%e
      slope = dot_product(w, d)
      curve = radius*(1 - dot_product(d, g%e)**2) - dot_product(w, radial)
      if (.not. curve > 0) return
      step = -slope/curve
      if (.not. abs(step) < 0.1_c_double) return
      radial = radial + step*d
      radial = radial/sqrt(dot_product(radial, radial))
      found = abs(step) < 1e-9_c_double
      if (abs(step) < 1e-14_c_double) return
    end do
  end subroutine nearest_of_rim

  !> Adds the contact of point x of the body with the edge, along n, if the edge allows n but for `slack` and has the point.
  pure subroutine keep(q, k, g, at, x, n, slack, limit, p, name, f)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    type(arc), intent(in) :: g
    real(c_double), intent(in) :: at(3), x(3), n(3), slack, limit
    integer(c_int32_t), intent(in) :: name
    type(findings), intent(inout) :: f
    real(c_double) :: gap, along
    gap = dot_product(n, x - g%from)
    if (gap > limit .or. gap < -2*min(q%size, p%size)) return
    if (.not. leaves_edge(q, k, n, slack)) return
    along = dot_product(g%e, x - gap*n - g%from)
    if (.not. min(along, g%length - along) > on_edge*q%size) return
    if (.not. dot_product(n, at - g%from) > 0) return
    call add(f, x - at - (gap/2)*n, n, gap, name)
  end subroutine keep

  !> A vertex is touched along the nearest way out of the cylinder: of an end, of the side, of the rim.
  pure subroutine at_vertex(p, q, k, at, limit, f)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    real(c_double), intent(in) :: at(3), limit
    type(findings), intent(inout) :: f
    real(c_double) :: x(3), n(3), axis(3), radial(3), across, beyond, gap, slack
    x = q%v(k, :) - at
    if (dot_product(x, x) > (p%size + limit)**2) return
    axis = sign(1.0_c_double, dot_product(x, p%frame(:, 3)))*p%frame(:, 3)
    radial = x - dot_product(x, axis)*axis
    across = sqrt(dot_product(radial, radial))
    if (across > 0) radial = radial/across
    across = across - p%half(1)
    beyond = dot_product(x, axis) - p%half(3)
    slack = on_edge
    if (across > 0 .and. beyond > 0) then
      gap = sqrt(across*across + beyond*beyond)
      n = -(across*radial + beyond*axis)/gap
    else if (beyond > across) then
      gap = beyond
      n = -axis
      slack = lean
    else
      gap = across
      n = -radial
    end if
    if (gap > limit .or. gap < -2*q%size) return
    if (.not. leaves_vertex(q, k, n, slack)) return
    if (.not. pokes_out(q, k)) return
    call add(f, x + (gap/2)*n, n, gap, int(vertex_of_b + k, c_int32_t))
  end subroutine at_vertex

end module cylinder_facet
