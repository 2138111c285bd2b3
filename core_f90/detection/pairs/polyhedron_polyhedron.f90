!> Contact of two convex polyhedra.
module polyhedron_polyhedron
  use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls, solid, view_solid
  use hull_axes, only: axis_of_edges, best_edges, best_face
  use hull_distance, only: nearest_points
  use hull_features, only: alone, axis, edge_axis, edges_stand_out, face_axis, point_axis, rounding, vertex_from
  use hull_proofs, only: common_edges, edge_between, edges_are_nearest
  use hull_patch, only: across, cut_faces, face_along, meet_barely, name_patch, outline, outline_of_face
  use patch_points, only: add_deepest, clear_patch, name_of_edges, patch, reduce_patch, vertex_of_b
  implicit none
  private
  public :: cairn_pair_polyhedron_polyhedron

  ! blind: distance below which differences define no direction; sure: lead by which recalled features must beat all others, so that
  ! a full search would find the same; both relative to the sum of sizes.
  real(c_double), parameter :: blind = 1e-8_c_double, sure = 1e-5_c_double
  integer, parameter :: ahead = 2 !< prefetch distance: pairs ahead of the present one
  real(c_double), parameter :: drawn = 0.02_c_double !< of the smaller size: how far bodies are drawn apart to see their edges

  interface
    !> See cairn/core.h.
    subroutine cairn_fetch_hull(hulls, contactor, feature) bind(c)
      import :: cairn_hulls, c_int32_t
      type(cairn_hulls), intent(in) :: hulls
      integer(c_int32_t), value :: contactor, feature
    end subroutine cairn_fetch_hull
  end interface

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
    integer(c_int32_t), pointer, contiguous :: recalled(:, :)
    integer(c_int32_t) :: recall(2)
    integer :: i, k

    call open_hulls(hulls, view)
    nullify (recalled)
    if (c_associated(hulls%recalled)) call c_f_pointer(hulls%recalled, recalled, [2, n])
    do i = 1, n
      if (i + ahead <= n) then
        recall = 0
        if (associated(recalled)) recall = recalled(:, i + ahead)
        call cairn_fetch_hull(hulls, a(i + ahead), recall(1))
        call cairn_fetch_hull(hulls, b(i + ahead), recall(2))
      end if
      count(i) = 0
      at = between(i, :)
      call view_solid(view, a(i), radius_a(i), p)
      call view_solid(view, b(i), radius_b(i), q)
      x%feature = 0
      if (associated(recalled)) x%feature = recalled(:, i)
      call find_axis(p, q, at, limit(i), x)
      if (associated(recalled)) recalled(:, i) = x%feature
      if (x%gap > limit(i)) cycle
      call across(x%n, t, s)
      call outline_of_face(p, face_of(p, x%feature(1), -x%n), at, x%n, t, s, -1.0_c_double, fa)
      call outline_of_face(q, face_of(q, x%feature(2), x%n), [0.0_c_double, 0.0_c_double, 0.0_c_double], x%n, t, s, &
                           1.0_c_double, fb)
      call clear_patch(cut, min(p%size, q%size))
      call cut_faces(fa, fb, p%size, q%size, x%gap, limit(i), cut)
      if (abs(x%gap) > blind*(p%size + q%size)) then
        if (meet_barely(fa, fb, cut)) cycle
      end if
      call add_deepest(cut, middle(x, t, s), x%gap, 8*rounding*(p%size + q%size), x%name)
      call reduce_patch(cut, view%most)
      call name_patch(cut, fa, fb)
      count(i) = cut%count
      do k = 1, view%most
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

  !> The face that meets the other body: that of the axis, or of those at its edge or of all the one that looks most along n.
  pure function face_of(p, feature, n) result(face)
    type(solid), intent(in) :: p
    integer(c_int32_t), intent(in) :: feature
    real(c_double), intent(in) :: n(3)
    integer :: face, left, right
    if (feature < 0) then
      left = p%edge(3, -feature)
      right = p%edge(4, -feature)
      face = merge(left, right, dot_product(p%normal(left, :) - p%normal(right, :), n) >= 0)
    else if (feature > 0 .and. feature < vertex_from) then
      face = feature
    else
      face = face_along(p%faces, p%normal, n)
    end if
  end function face_of

  !> The axis of the features of the last step, if it is proved to be the best, or that the bodies are apart. `least`: lower bound
  !> on the separation across edges, known without proof.
  subroutine recall_axis(a, b, at, limit, feature, x, proved, least)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), limit
    integer(c_int32_t), intent(in) :: feature(2) !< see axis
    type(axis), intent(inout) :: x
    logical, intent(out) :: proved
    real(c_double), intent(out) :: least
    real(c_double) :: s, n(3), margin
    logical :: face(2), point(2), lone
    integer :: i
    proved = .false.
    least = -huge(least)
    if (any(feature < -[a%edges, b%edges]) .or. any(feature > vertex_from + [a%vertices, b%vertices])) return
    face = feature > 0 .and. feature <= [a%faces, b%faces]
    point = feature > vertex_from .or. feature < 0
    margin = sure*(a%size + b%size)
    if (all(feature < 0)) then
      call axis_of_edges(a, b, at, -feature(1), -feature(2), s, n)
      lone = alone(a, feature(1), n, margin)
      if (lone) lone = alone(b, feature(2), -n, margin)
      if (.not. lone .and. s > 0) return
      if (lone .and. s < limit) least = s
      call edge_axis(a, b, at, -feature(1), -feature(2), s, n, margin, x, proved)
      if (s > 0 .and. s <= margin) proved = .false.
      if (s <= 0) proved = edges_are_nearest(a, b, -feature(1), -feature(2), at, n, margin - s)
      if (proved .and. .not. lone) proved = edges_stand_out(a, b, at, -feature(1), -feature(2), s, n)
      if (s > limit + 4*rounding*(a%size + b%size)) proved = .true.
    else if (all(point)) then
      call point_axis(a, b, at, feature, margin, margin, x, proved)
      if (proved) proved = alone(a, feature(1), x%n, margin)
      if (proved) proved = alone(b, feature(2), -x%n, margin)
    else if (any(face)) then
      i = merge(1, 2, face(1))
      if (i == 1) call face_axis(a, int(feature(1)), b, -at, .true., margin, x, proved)
      if (i == 2) call face_axis(b, int(feature(2)), a, at, .false., margin, x, proved)
      if (x%gap > limit + 4*rounding*(a%size + b%size)) proved = .true.
    end if
  end subroutine recall_axis

  !> x%feature: what made the axis last time, or 0. The gap is above the limit if the bodies are as far apart.
  subroutine find_axis(a, b, at, limit, x)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), limit
    type(axis), intent(inout) :: x
    real(c_double) :: of_a, of_b, best, slack, least, n(3)
    integer(c_int32_t) :: feature(2)
    logical :: nearest
    integer :: face_a, face_b, edge_a, edge_b

    least = -huge(least)
    if (any(x%feature /= 0)) then
      feature = x%feature
      call recall_axis(a, b, at, limit, feature, x, nearest, least)
      if (nearest) return
    end if
    slack = rounding*(a%size + b%size)
    of_a = -huge(of_a)
    of_b = of_a
    face_a = 1
    face_b = 1
    call best_face(b, a, at, limit + slack, of_b, face_b)
    if (of_b <= limit + slack) call best_face(a, b, -at, limit + slack, of_a, face_a)
    if (of_b > of_a + slack) then
      call face_axis(b, face_b, a, at, .false., 0.0_c_double, x, nearest)
    else
      call face_axis(a, face_a, b, -at, .true., 0.0_c_double, x, nearest)
    end if
    if (nearest .or. x%gap > limit) return
    if (x%gap <= 0) then
      nearest = .false.
      if (least < -huge(least)/2) call try_edges(a, b, at, slack, x, nearest)
      if (nearest) return
      best = max(x%gap + slack, least - 2*slack)
      edge_a = 0
      edge_b = 0
      call best_edges(a, b, at, limit, best, edge_a, edge_b)
      if (edge_a > 0) then
        call axis_of_edges(a, b, at, edge_a, edge_b, best, n)
        call edge_axis(a, b, at, edge_a, edge_b, best, n, 0.0_c_double, x, nearest)
      end if
      if (x%gap <= 0 .or. x%gap > limit) return
    end if
    call spread_axis(a, b, at, x)
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
    call edge_axis(a, b, at, edge_a, edge_b, s, n, 0.0_c_double, y, nearest)
    if (s <= 0) nearest = edges_are_nearest(a, b, edge_a, edge_b, at, n, 2*slack - s)
    if (nearest) x = y
  end subroutine try_edges

  !> From the best axis of bodies that are apart to their nearest points.
  subroutine spread_axis(a, b, at, x)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3)
    type(axis), intent(inout) :: x
    type(axis) :: y
    real(c_double) :: distance, point_a(3), point_b(3), d(3), s, extent
    integer :: corners, va(4), vb(4)
    integer(c_int32_t) :: feature(2)
    logical :: nearest
    extent = a%size + b%size
    call nearest_points(a, b, at, x%n, distance, point_a, point_b, corners, va, vb)
    if (distance <= x%gap + 4*rounding*extent) return
    feature = [feature_of(a, corners, va), feature_of(b, corners, vb)]
    nearest = .false.
    if (all(feature < 0)) then
      call axis_of_edges(a, b, at, -feature(1), -feature(2), s, d)
      call edge_axis(a, b, at, -feature(1), -feature(2), s, d, 0.0_c_double, y, nearest)
    else if (all(feature /= 0) .and. any(feature > 0)) then
      call point_axis(a, b, at, feature, blind*extent, 0.0_c_double, y, nearest)
    end if
    if (nearest .and. abs(y%gap - distance) <= 4*rounding*extent) then
      x = y
      return
    end if
    x%gap = distance
    x%point_a = at + point_a
    x%point_b = point_b
    x%feature = 0
    x%name = va(1)
    if (feature(1) <= vertex_from .and. feature(2) > vertex_from) x%name = vertex_of_b + vb(1)
    if (all(feature < 0)) x%name = name_of_edges(-feature(1), -feature(2))
    d = x%point_a - x%point_b
    if (distance > blind*extent) x%n = d/sqrt(dot_product(d, d))
  end subroutine spread_axis

  pure function feature_of(p, corners, v) result(feature)
    type(solid), intent(in) :: p
    integer, intent(in) :: corners, v(4)
    integer(c_int32_t) :: feature
    if (all(v(1:corners) == v(1))) then
      feature = vertex_from + v(1)
    else
      feature = -edge_between(p, corners, v)
    end if
  end function feature_of

end module polyhedron_polyhedron
