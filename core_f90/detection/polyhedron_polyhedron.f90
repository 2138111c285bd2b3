!> Contact of two convex polyhedra.
module polyhedron_polyhedron
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls, solid, view_solid
  use hull_axes, only: axis_of_edges, best_edges, best_face
  use hull_distance, only: nearest_points
  use hull_proofs, only: common_edges, edges_are_nearest, face_is_nearest
  use hull_patch, only: across, cut_faces, find_outline, name_patch, outline
  use patch_points, only: add_deepest, clear_patch, name_of_edges, patch, reduce_patch, vertex_of_b
  implicit none
  private
  public :: cairn_pair_polyhedron_polyhedron

  ! Of the sizes together: what rounding alone makes of a depth; and the distance below which differences tell no direction.
  real(c_double), parameter :: rounding = 16*epsilon(1.0_c_double), blind = 1e-9_c_double
  real(c_double), parameter :: drawn = 0.02_c_double !< of the smaller size: how far bodies are drawn apart to see their edges

  !> Normal from b to a, gap along it, the nearest points [m] from the centre of b, and the name of their features.
  type :: axis
    real(c_double) :: n(3) = 0, gap = 0, point_a(3) = 0, point_b(3) = 0
    integer(c_int32_t) :: name = 0
  end type axis

contains

  !> The normal is that of the face, or across the edges, along which they are farthest apart or overlap least; of a corner or
  !> edge that does not face the other body, the line of the nearest points. All points share it: the faces that look along it
  !> are cut by each other, and the few corners of the cut that span it are the contact.
  subroutine cairn_pair_polyhedron_polyhedron(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, &
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
    type(axis) :: x
    type(patch) :: cut
    type(outline) :: fa, fb
    real(c_double) :: t(3), s(3), at(3)
    logical :: apart
    integer :: i, k

    call open_hulls(hulls, view)
    do i = 1, n
      count(i) = 0
      at = between(i, :)
      call view_solid(view, a(i), radius_a(i), p)
      call view_solid(view, b(i), radius_b(i), q)
      call find_axis(p, q, at, limit(i), x, apart)
      if (apart) cycle
      call across(x%n, t, s)
      call find_outline(p, at, x%n, t, s, -1.0_c_double, fa)
      call find_outline(q, [0.0_c_double, 0.0_c_double, 0.0_c_double], x%n, t, s, 1.0_c_double, fb)
      call clear_patch(cut, min(p%size, q%size))
      call cut_faces(fa, fb, p%size, q%size, x%gap, limit(i), cut)
      call add_deepest(cut, middle(x, t, s), x%gap, 8*rounding*(p%size + q%size), x%name)
      call reduce_patch(cut, view%most)
      call name_patch(cut, fa, fb)
      count(i) = cut%count
      do k = 1, cut%count
        gap(k, i) = cut%gap(k)
        normal(:, k, i) = x%n
        point(:, k, i) = t*cut%x(1, k) + s*cut%x(2, k) + x%n*cut%x(3, k) - at
        feature(k, i) = cut%name(k)
      end do
    end do
  end subroutine cairn_pair_polyhedron_polyhedron

  !> Middle of the nearest points, across and along the normal.
  pure function middle(x, t, s) result(m)
    type(axis), intent(in) :: x
    real(c_double), intent(in) :: t(3), s(3)
    real(c_double) :: m(3), c(3)
    c = (x%point_a + x%point_b)/2
    m = [dot_product(t, c), dot_product(s, c), dot_product(x%n, c)]
  end function middle

  subroutine find_axis(a, b, at, limit, x, apart)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), limit
    type(axis), intent(inout) :: x
    logical, intent(out) :: apart
    real(c_double) :: of_a, of_b, best, slack, start(3)
    logical :: nearest
    integer :: face_a, face_b, edge_a, edge_b

    apart = .true.
    of_a = -huge(of_a)
    of_b = of_a
    face_a = 1
    face_b = 1
    call best_face(b, a, at, limit, of_b, face_b)
    if (of_b > limit) return
    call best_face(a, b, -at, limit, of_a, face_a)
    if (of_a > limit) return
    apart = .false.
    slack = rounding*(a%size + b%size)
    if (of_b > of_a + slack) then
      call face_axis(b, face_b, a, at, of_b, .false., x, nearest)
    else
      call face_axis(a, face_a, b, -at, of_a, .true., x, nearest)
    end if
    if (nearest) return
    if (x%gap <= 0) then
      call try_edges(a, b, at, slack, x, nearest)
      if (nearest) return
      best = x%gap + slack
      edge_a = 0
      edge_b = 0
      call best_edges(a, b, at, limit, best, edge_a, edge_b, start)
      if (edge_a > 0) call edge_axis(a, b, at, edge_a, edge_b, best, start, x, nearest)
      apart = x%gap > limit
      if (x%gap <= 0 .or. apart) return
    end if
    call spread_axis(a, b, at, x)
    apart = x%gap > limit
  end subroutine find_axis

  !> Looks across the two edges that are nearest once the bodies are drawn apart along the axis; takes them if there is proof.
  subroutine try_edges(a, b, at, slack, x, nearest)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), slack
    type(axis), intent(inout) :: x
    logical, intent(out) :: nearest
    type(axis) :: y
    real(c_double) :: distance, point_a(3), point_b(3), s, n(3)
    integer :: corners, va(4), vb(4), edge_a, edge_b
    nearest = .false.
    call nearest_points(a, b, at + (drawn*min(a%size, b%size) - x%gap)*x%n, x%n, distance, point_a, point_b, corners, va, vb)
    call common_edges(a, b, corners, va, vb, edge_a, edge_b)
    if (edge_a == 0) return
    call axis_of_edges(a, b, at, edge_a, edge_b, s, n)
    if (.not. s > x%gap + slack) return
    call edge_axis(a, b, at, edge_a, edge_b, s, n, y, nearest)
    if (s <= 0) nearest = edges_are_nearest(a, b, edge_a, edge_b, at, n, 2*slack - s)
    if (nearest) x = y
  end subroutine try_edges

  !> The axis along a face of p towards the deepest vertex of q, which stands at `at` from p. `nearest` if that vertex is in
  !> front of the face, so that there is no nearer pair of points, or if there is proof that the overlap is the least.
  subroutine face_axis(p, face, q, at, gap, of_a, x, nearest)
    type(solid), intent(in) :: p, q
    integer, intent(in) :: face
    real(c_double), intent(in) :: at(3), gap
    logical, intent(in) :: of_a !< p is A
    type(axis), intent(inout) :: x
    logical, intent(out) :: nearest
    real(c_double) :: m(3), low, height, at_vertex(3), foot(3)
    integer :: i, deepest
    m = p%normal(face, :)
    low = huge(low)
    deepest = 1
    do i = 1, q%vertices
      height = m(1)*q%v(i, 1) + m(2)*q%v(i, 2) + m(3)*q%v(i, 3)
      if (height < low) then
        low = height
        deepest = i
      end if
    end do
    at_vertex = at + q%v(deepest, :)
    foot = at_vertex - gap*m
    x%gap = gap
    if (of_a) then
      x%n = -m
      x%point_a = foot - at
      x%point_b = at_vertex - at
      x%name = vertex_of_b + deepest
    else
      x%n = m
      x%point_a = at_vertex
      x%point_b = foot
      x%name = deepest
    end if
    if (gap > 0) then
      nearest = in_front(p, face, foot)
    else
      nearest = face_is_nearest(p, face, q, deepest, at, 2*rounding*(p%size + q%size) - gap)
    end if
  end subroutine face_axis

  pure function in_front(p, face, x)
    type(solid), intent(in) :: p
    integer, intent(in) :: face
    real(c_double), intent(in) :: x(3)
    logical :: in_front
    real(c_double) :: from(3), e(3), w(3), m(3)
    integer :: k, first, last
    first = p%first_corner(face) + 1
    last = p%first_corner(face + 1)
    m = p%normal(face, :)
    in_front = .false.
    from = p%v(p%corner_vertex(last), :)
    do k = first, last
      e = p%v(p%corner_vertex(k), :) - from
      w = x - from
      if (m(1)*(e(2)*w(3) - e(3)*w(2)) + m(2)*(e(3)*w(1) - e(1)*w(3)) + m(3)*(e(1)*w(2) - e(2)*w(1)) < 0) return
      from = p%v(p%corner_vertex(k), :)
    end do
    in_front = .true.
  end function in_front

  !> The axis across two edges, with the nearest points of their lines; `nearest` if these are on the edges and apart.
  pure subroutine edge_axis(a, b, at, edge_a, edge_b, gap, n, x, nearest)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), gap, n(3)
    integer, intent(in) :: edge_a, edge_b
    type(axis), intent(inout) :: x
    logical, intent(out) :: nearest
    real(c_double) :: p(3), q(3), d(3), e(3), w(3), dd, de, ee, det, along_a, along_b
    p = at + a%v(a%edge(1, edge_a), :)
    d = a%v(a%edge(2, edge_a), :) - a%v(a%edge(1, edge_a), :)
    q = b%v(b%edge(1, edge_b), :)
    e = b%v(b%edge(2, edge_b), :) - q
    w = q - p
    dd = dot_product(d, d)
    de = dot_product(d, e)
    ee = dot_product(e, e)
    det = dd*ee - de*de
    x%n = n
    x%gap = gap
    along_a = (dot_product(w, d)*ee - dot_product(w, e)*de)/det
    along_b = (dot_product(w, d)*de - dot_product(w, e)*dd)/det
    x%point_a = p + unit_part(along_a)*d
    x%point_b = q + unit_part(along_b)*e
    nearest = gap > 0 .and. min(along_a, along_b) >= 0 .and. max(along_a, along_b) <= 1
    x%name = name_of_edges(edge_a, edge_b)
  end subroutine edge_axis

  pure function unit_part(s) result(t)
    real(c_double), intent(in) :: s
    real(c_double) :: t
    t = 0
    if (s > 0) t = min(s, 1.0_c_double)
  end function unit_part

  !> From the best axis of bodies that are apart to their nearest points.
  subroutine spread_axis(a, b, at, x)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3)
    type(axis), intent(inout) :: x
    real(c_double) :: distance, point_a(3), point_b(3), d(3), extent
    integer :: corners, va(4), vb(4)
    extent = a%size + b%size
    call nearest_points(a, b, at, x%n, distance, point_a, point_b, corners, va, vb)
    if (distance <= x%gap + 4*rounding*extent) return
    x%gap = distance
    x%point_a = at + point_a
    x%point_b = point_b
    d = x%point_a - x%point_b
    x%name = name_of_nearest(a, b, corners, va, vb)
    if (distance > blind*extent) x%n = d/sqrt(dot_product(d, d))
  end subroutine spread_axis

  pure function name_of_nearest(a, b, corners, va, vb) result(name)
    type(solid), intent(in) :: a, b
    integer, intent(in) :: corners, va(4), vb(4)
    integer(c_int32_t) :: name
    integer :: i, j
    name = va(1)
    if (all(va(1:corners) == va(1))) return
    if (all(vb(1:corners) == vb(1))) then
      name = vertex_of_b + vb(1)
      return
    end if
    call common_edges(a, b, corners, va, vb, i, j)
    if (i > 0) name = name_of_edges(i, j)
  end function name_of_nearest

end module polyhedron_polyhedron
