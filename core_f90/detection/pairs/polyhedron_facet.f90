!> Contact of a convex polyhedron with one triangle of a surface that is solid behind it.
module polyhedron_facet
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls, solid, view_solid
  use convex_facet, only: leaves_elsewhere
  use convex_shape, only: convex, is_polyhedron
  use hull_distance, only: nearest_points
  use hull_patch, only: across, find_outline, outline
  use patch_points, only: add_point, clear_patch, name_of_edges, patch, reduce_patch, vertex_of_b
  use facet_points, only: add, findings, settle
  use facet_view, only: after, cross, inside_of, inward, is_over, is_under_valley, leaves_edge, leaves_vertex, &
                        nearer_elsewhere, of_mesh, on_edge, pokes_out, stands_out
  implicit none
  private
  public :: cairn_pair_polyhedron_facet

  !> Sine of the angle by which a normal may lean out of what an edge or a vertex allows: points of a flat patch, some of
  !> them lifted, stay in it.
  real(c_double), parameter :: lean = 0.05_c_double

  !> Share of the size of the triangle within which the face of a block is flush with it.
  real(c_double), parameter :: level = 8e-4_c_double
  real(c_double), parameter :: upright = 0.75_c_double !< cosine to the normal of a triangle from which on one is across it

contains

  !> Contacts by features of the surface. Each counts once, for the triangle that owns it, and only where it can be touched:
  !> - the interior, by the lowest corner of the face of the polyhedron that looks at it, along the normal of the triangle;
  !> - convex edges and vertices, by the edges and faces of the polyhedron across whose normals they lie, along these;
  !> - other separated features, by their nearest points.
  !> Edges within a plane are therefore inert: the contacts of a block are its corners, each on a single triangle, as on a plane.
  subroutine cairn_pair_polyhedron_facet(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, &
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
    type(solid) :: p, q
    type(findings) :: f
    integer :: i

    call open_hulls(hulls, view)
    do i = 1, n
      call view_solid(view, a(i), radius_a(i), p)
      call view_solid(view, b(i), radius_b(i), q)
      call find_points(p, q, between(i, :), limit(i), f)
      call settle(f, view%most, count(i), gap(:, i), normal(:, :, i), point(:, :, i), feature(:, i))
    end do
  end subroutine cairn_pair_polyhedron_facet

  subroutine find_points(p, q, at, limit, f)
    type(solid), intent(in) :: p, q
    real(c_double), intent(in) :: at(3), limit
    type(findings), intent(inout) :: f
    real(c_double) :: low, high
    integer :: k, lowest
    f%count = 0
    f%slack = on_edge*min(p%size, q%size) + 16*epsilon(low)*(p%size + q%size)
    call extent(p, q%normal(1, :), low, high, lowest)
    low = low + dot_product(q%normal(1, :), at) - q%offset(1)
    if (low > limit) return
    if (high + dot_product(q%normal(1, :), at) - q%offset(1) < 0) return
    if (dot_product(q%normal(1, :), at) > q%offset(1)) call on_inside(p, q, at, limit, lowest, f)
    do k = 1, 3
      if (q%edge(3, k) == 0) cycle
      if (stands_out(q, k)) call on_edges(p, q, k, at, limit, f)
    end do
    do k = 1, 3
      if (q%edge(3, 3 + k) == 0) cycle
      call on_vertex(p, q, k, at, limit, f)
    end do
    if (.not. any(f%gap(1:f%count) <= 0)) call nearest(p, q, at, limit, f)
  end subroutine find_points

  !> Heights of a polyhedron along m from its centre.
  pure subroutine extent(p, m, low, high, lowest)
    type(solid), intent(in) :: p
    real(c_double), intent(in) :: m(3)
    real(c_double), intent(out) :: low, high
    integer, intent(out) :: lowest
    real(c_double) :: height
    integer :: k
    low = huge(low)
    high = -huge(high)
    lowest = 1
    do k = 1, p%vertices
      height = m(1)*p%v(k, 1) + m(2)*p%v(k, 2) + m(3)*p%v(k, 3)
      high = max(high, height)
      if (height < low) then
        low = height
        lowest = k
      end if
    end do
  end subroutine extent

  !> Corners of the polyhedron over the triangle, at most 4.
  subroutine on_inside(p, q, at, limit, lowest, f)
    type(solid), intent(in) :: p, q
    real(c_double), intent(in) :: at(3), limit
    integer, intent(in) :: lowest
    type(findings), intent(inout) :: f
    type(outline) :: face
    type(patch) :: cut
    real(c_double) :: m(3), t(3), s(3), height, x(3)
    integer :: k, i
    m = q%normal(1, :)
    call across(m, t, s)
    call find_outline(p, at, m, t, s, -1.0_c_double, face)
    call clear_patch(cut, min(p%size, q%size))
    do k = 1, face%count + 1
      i = lowest
      if (k <= face%count) i = face%vertex(k)
      x = at + p%v(i, :)
      height = dot_product(m, x) - q%offset(1)
      if (height > limit .or. height < -2*q%size) cycle
      if (.not. is_over(q, x)) then
        if (height >= 0) cycle
        if (.not. is_under_valley(q, x)) cycle
      else if (height < 0) then
        if (nearer_elsewhere(q, x, -height)) cycle
        if (passes_rim(p, q, at, x)) cycle
      end if
      call add_point(cut, [dot_product(t, x), dot_product(s, x), dot_product(m, x) - height/2], height, int(i, c_int32_t))
    end do
    call reduce_patch(cut, 4)
    do k = 1, cut%count
      call add(f, t*cut%x(1, k) + s*cut%x(2, k) + m*cut%x(3, k) - at, m, cut%gap(k), cut%name(k))
    end do
  end subroutine on_inside

  !> Edges of the polyhedron that cross edge k of the triangle, along the normal across both.
  subroutine on_edges(p, q, k, at, limit, f)
    type(solid), intent(in) :: p, q
    integer, intent(in) :: k
    real(c_double), intent(in) :: at(3), limit
    type(findings), intent(inout) :: f
    type(convex) :: body
    real(c_double) :: from(3), e(3), d(3), start(3), n(3), out(3), x(3), y(3), w(3), det, along, gap, length, ends
    integer :: i
    body%kind = is_polyhedron
    from = q%v(k, :)
    e = q%v(after(k), :) - from
    out = q%normal(1, :)
    if (q%edge(4, k) == 0) out = out - inward(q, k, after(after(k)))
    if (q%edge(4, k) > 0) out = -inward(q, k, after(after(k))) - inward(q, k, int(q%edge(4, k)))
    do i = 1, p%edges
      start = at + p%v(p%edge(1, i), :)
      d = p%v(p%edge(2, i), :) - p%v(p%edge(1, i), :)
      n = cross(d, e)
      length = sqrt(dot_product(n, n))
      if (length <= 1e-8_c_double*sqrt(dot_product(d, d)*dot_product(e, e))) cycle
      n = n/length
      if (dot_product(n, out) < 0) n = -n
      w = from - start
      gap = -dot_product(n, w)
      if (gap > limit .or. gap < -2*q%size) cycle
      if (.not. supports(p, i, d, n)) cycle
      if (.not. leaves_edge(q, k, n, lean)) cycle
      det = dot_product(cross(d, e), n)
      along = dot_product(cross(w, e), n)/det
      ends = f%slack/sqrt(dot_product(d, d))
      if (along < ends .or. along > 1 - ends) cycle
      x = start + along*d
      along = dot_product(cross(w, d), n)/det
      ends = f%slack/sqrt(dot_product(e, e))
      if (along < ends .or. along > 1 - ends) cycle
      y = from + along*e
      if (dot_product(n, at - y) <= 0) cycle
      if (gap < 0) then
        if (shorter_way(p, q, k, at, -gap)) cycle
        body%hull = p
        if (leaves_elsewhere(body, q, at, x, gap, gap)) cycle
      end if
      if (passes_edge(p, q, k, y - at, n)) cycle
      if (passes_end(p, q, k, at, n, y)) cycle
      call add(f, (x + y)/2 - at, n, gap, name_of_edges(i, k))
    end do
  end subroutine on_edges

  !> True if a polyhedron leaves the wedge at edge k along the normal of either triangle with an overlap of less than `depth`.
  pure logical function shorter_way(p, q, k, at, depth)
    type(solid), intent(in) :: p, q
    integer, intent(in) :: k
    real(c_double), intent(in) :: at(3), depth
    real(c_double) :: m(3), low, high
    integer :: i, lowest
    shorter_way = .false.
    m = q%normal(1, :)
    do i = 1, 2
      if (i == 2) then
        if (q%edge(4, k) == 0) return
        m = cross(q%v(k, :) - q%v(after(k), :), q%v(q%edge(4, k), :) - q%v(after(k), :))
        m = m/sqrt(dot_product(m, m))
      end if
      call extent(p, m, low, high, lowest)
      shorter_way = low + dot_product(m, at - q%v(k, :)) > -depth + on_edge*q%size
      if (shorter_way) return
    end do
  end function shorter_way

  !> True if n lies between the normals of the two faces at edge i, within the tolerance `lean`: the edge is a support feature.
  pure logical function supports(p, i, d, n)
    type(solid), intent(in) :: p
    integer, intent(in) :: i
    real(c_double), intent(in) :: d(3), n(3)
    real(c_double) :: length
    length = lean*sqrt(dot_product(d, d))
    supports = dot_product(n, cross(p%normal(p%edge(3, i), :), d)) >= -length .and. &
               dot_product(n, cross(d, p%normal(p%edge(4, i), :))) >= -length
  end function supports

  !> Vertex k of the triangle in front of a face of the polyhedron, or behind the nearest, along its normal.
  pure subroutine on_vertex(p, q, k, at, limit, f)
    type(solid), intent(in) :: p, q
    integer, intent(in) :: k
    real(c_double), intent(in) :: at(3), limit
    type(findings), intent(inout) :: f
    real(c_double) :: x(3), n(3), height, best
    integer :: i, face
    x = q%v(k, :) - at
    if (dot_product(x, x) > (p%size + limit)**2) return
    best = -huge(best)
    face = 1
    do i = 1, p%faces
      height = dot_product(p%normal(i, :), x) - p%offset(i)
      if (height > best) then
        best = height
        face = i
      end if
    end do
    if (best > limit) return
    n = -p%normal(face, :)
    if (.not. leaves_vertex(q, k, n, lean)) return
    if (best > 0) then
      if (.not. in_front(p, face, x, f%slack)) return
    end if
    if (.not. pokes_out(q, k)) return
    if (passes_vertex(p, q, k, at, n)) return
    call add(f, x + n*(best/2), n, best, int(vertex_of_b + k, c_int32_t))
  end subroutine on_vertex

  !> True if a polyhedron that would stop edge k along n is flush with a triangle at it, as the next block of a floor that the
  !> edge slides over.
  pure logical function passes_edge(p, q, k, x, n)
    type(solid), intent(in) :: p, q
    integer, intent(in) :: k
    real(c_double), intent(in) :: x(3) !< where, from the polyhedron [m]
    real(c_double), intent(in) :: n(3)
    passes_edge = passes(p, q, x, n, q%normal(1, :))
    if (passes_edge .or. q%edge(4, k) == 0) return
    passes_edge = passes(p, q, x, n, cross(q%v(k, :) - q%v(after(k), :), q%v(q%edge(4, k), :) - q%v(after(k), :)))
  end function passes_edge

  !> The same where it meets the edge at y, at an end of it, of a triangle there that the edge goes back from.
  pure logical function passes_end(p, q, k, at, n, y)
    type(solid), intent(in) :: p, q
    integer, intent(in) :: k
    real(c_double), intent(in) :: at(3), n(3), y(3)
    real(c_double) :: e(3), m(3)
    integer :: end, j, i
    passes_end = .false.
    do i = 0, 1
      end = merge(k, after(k), i == 0)
      e = y - q%v(end, :)
      if (dot_product(e, e) > (level*q%size)**2) cycle
      e = q%v(merge(after(k), k, i == 0), :) - q%v(end, :)
      do j = 7, q%edges
        if (q%edge(1, j) /= end) cycle
        m = cross(q%v(q%edge(2, j), :) - q%v(end, :), q%v(q%edge(4, j), :) - q%v(end, :))
        if (dot_product(m, e) > -0.5_c_double*sqrt(dot_product(m, m)*dot_product(e, e))) cycle
        passes_end = passes(p, q, q%v(end, :) - at, n, m)
        if (passes_end) return
      end do
    end do
  end function passes_end

  !> The same where corner x of it is over the triangle at an edge beyond which the surface turns away.
  pure logical function passes_rim(p, q, at, x)
    type(solid), intent(in) :: p, q
    real(c_double), intent(in) :: at(3), x(3)
    integer :: k
    passes_rim = .false.
    do k = 1, 3
      if (q%edge(4, k) == 0) cycle
      if (inside_of(q, k, after(after(k)), x) > level*q%size) cycle
      if (.not. stands_out(q, k)) cycle
      passes_rim = passes(p, q, x - at, q%normal(1, :), &
                          cross(q%v(k, :) - q%v(after(k), :), q%v(q%edge(4, k), :) - q%v(after(k), :)))
      if (passes_rim) return
    end do
  end function passes_rim

  !> The same of vertex k.
  pure logical function passes_vertex(p, q, k, at, n)
    type(solid), intent(in) :: p, q
    integer, intent(in) :: k
    real(c_double), intent(in) :: at(3), n(3)
    real(c_double) :: d(3)
    integer :: j
    d = q%v(k, :) - at
    passes_vertex = passes(p, q, d, n, q%normal(1, :))
    do j = 7, q%edges
      if (passes_vertex) return
      if (q%edge(1, j) /= k) cycle
      passes_vertex = passes(p, q, d, n, cross(q%v(q%edge(2, j), :) - q%v(k, :), q%v(q%edge(4, j), :) - q%v(k, :)))
    end do
  end function passes_vertex

  !> True if n is not normal to a triangle of a mesh and the face of the polyhedron opposite to it goes through point x, seen from
  !> the polyhedron. looks: normal of the triangle, of any length.
  pure logical function passes(p, q, x, n, looks)
    type(solid), intent(in) :: p, q
    real(c_double), intent(in) :: x(3), n(3), looks(3)
    real(c_double) :: m(3)
    integer :: i
    passes = .false.
    if (.not. of_mesh(q)) return
    m = looks/sqrt(dot_product(looks, looks))
    if (dot_product(n, m) >= upright) return
    do i = 1, p%faces
      if (dot_product(p%normal(i, :), m) > -upright) cycle
      passes = abs(dot_product(p%normal(i, :), x) - p%offset(i)) <= level*q%size
      if (passes) return
    end do
  end function passes

  pure logical function in_front(p, face, x, slack)
    type(solid), intent(in) :: p
    integer, intent(in) :: face
    real(c_double), intent(in) :: x(3), slack
    real(c_double) :: from(3), e(3)
    integer :: k
    in_front = .false.
    from = p%v(p%corner_vertex(p%first_corner(face + 1)), :)
    do k = p%first_corner(face) + 1, p%first_corner(face + 1)
      e = p%v(p%corner_vertex(k), :) - from
      if (dot_product(p%normal(face, :), cross(e, x - from)) < -slack*sqrt(dot_product(e, e))) return
      from = p%v(p%corner_vertex(k), :)
    end do
    in_front = .true.
  end function in_front

  !> The nearest points, if that of the triangle is its own and the nearest of the surface around, and nothing found is nearer.
  subroutine nearest(p, q, at, limit, f)
    type(solid), intent(in) :: p, q
    real(c_double), intent(in) :: at(3), limit
    type(findings), intent(inout) :: f
    type(solid) :: triangle
    real(c_double), target :: v(3, 3)
    real(c_double) :: distance, x(3), y(3), d(3), n(3), w(3), slack
    integer :: corners, va(4), vb(4), k
    integer(c_int32_t) :: name
    v = q%v(1:3, :)
    triangle%vertices = 3
    triangle%size = q%size
    triangle%v => v
    call nearest_points(p, triangle, at, q%normal(1, :), distance, x, y, corners, va, vb)
    if (distance > limit .or. .not. distance > 0) return
    do k = 1, f%count
      if (f%gap(k) <= distance + f%slack) return
    end do
    d = at + x - y
    slack = on_edge*q%size
    if (.not. is_over(q, y)) return
    if (.not. is_nearest(q, y, d, slack)) return
    n = d/sqrt(dot_product(d, d))
    do k = 1, 3
      if (inside_of(q, k, after(after(k)), y) <= level*q%size) then
        if (passes_edge(p, q, k, y - at, n)) return
      end if
      w = y - q%v(k, :)
      if (dot_product(w, w) <= (level*q%size)**2) then
        if (passes_vertex(p, q, k, at, n)) return
      end if
    end do
    name = int(va(1), c_int32_t)
    if (any(va(1:corners) /= va(1))) name = int(vertex_of_b + vb(1), c_int32_t)
    if (distance <= slack) d = q%normal(1, :)
    call add(f, (at + x + y)/2 - at, d/sqrt(dot_product(d, d)), distance, name)
  end subroutine nearest

  !> True if a point y on an edge or vertex of the triangle is the nearest of the surface to a point at d from it. Edges and
  !> vertices that are not convex never are: another feature is nearer there.
  pure logical function is_nearest(q, y, d, slack)
    type(solid), intent(in) :: q
    real(c_double), intent(in) :: y(3), d(3), slack
    logical :: on(3)
    integer :: k
    do k = 1, 3
      on(k) = inside_of(q, k, after(after(k)), y) <= slack
    end do
    is_nearest = .false. ! inside, a corner is as near
    do k = 1, 3
      if (on(k) .and. on(after(k))) is_nearest = &
        leaves_vertex(q, after(k), d, slack) .and. pokes_out(q, after(k))
      if (on(k) .and. .not. on(after(k)) .and. .not. on(after(after(k)))) is_nearest = &
        leaves_edge(q, k, d, slack) .and. stands_out(q, k)
    end do
  end function is_nearest

end module polyhedron_facet
