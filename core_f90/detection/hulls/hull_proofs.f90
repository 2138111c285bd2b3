!> Proofs that an axis is the one of least overlap, for less than a look at all others. The differences of the points of two
!> bodies make a convex solid; how deep 0 is in it is the overlap. One of its faces with a point inside make a pyramid: if the
!> ball around 0 that touches that face is in the pyramid, no other face is as near.
module hull_proofs
  use, intrinsic :: iso_c_binding, only: c_double
  use hull_support, only: lowest
  use hull_view, only: solid
  implicit none
  private
  public :: along_likest_face, face_is_nearest, edges_are_nearest, common_edges, edge_between

contains

  !> For a face of p and a vertex of q, which stands at `at` from p. depth >= 0 [m], slack [m] is added to it.
  pure function face_is_nearest(p, face, q, vertex, at, depth) result(proved)
    type(solid), intent(in) :: p, q
    integer, intent(in) :: face, vertex
    real(c_double), intent(in) :: at(3), depth
    logical :: proved
    real(c_double) :: from(3), to(3), tip(3)
    integer :: k, first, last
    proved = .false.
    if (.not. min(p%inner, q%inner) > 0) return
    tip = at + q%v(vertex, :)
    first = p%first_corner(face) + 1
    last = p%first_corner(face + 1)
    from = tip - p%v(p%corner_vertex(last), :)
    do k = first, last
      to = tip - p%v(p%corner_vertex(k), :)
      if (.not. beyond(from, to, at, depth)) return
      from = to
    end do
    proved = .true.
  end function face_is_nearest

  !> True if 0 is at least `depth` inside the plane through two corners and the apex, which turn anticlockwise.
  pure function beyond(from, to, apex, depth)
    real(c_double), intent(in) :: from(3), to(3), apex(3), depth
    logical :: beyond
    real(c_double) :: e(3), w(3), m(3), inside
    e = to - from
    w = apex - from
    m = [e(2)*w(3) - e(3)*w(2), e(3)*w(1) - e(1)*w(3), e(1)*w(2) - e(2)*w(1)]
    inside = m(1)*from(1) + m(2)*from(2) + m(3)*from(3)
    beyond = inside > 0 .and. inside*inside > depth*depth*(m(1)*m(1) + m(2)*m(2) + m(3)*m(3))
  end function beyond

  !> For two edges and the axis n across them, from b to a, which stands at `at` from b.
  pure function edges_are_nearest(a, b, edge_a, edge_b, at, n, depth) result(proved)
    type(solid), intent(in) :: a, b
    integer, intent(in) :: edge_a, edge_b
    real(c_double), intent(in) :: at(3), n(3), depth
    logical :: proved
    real(c_double) :: x(3, 4), p(3, 2), q(3, 2), e(3), d(3)
    integer :: k
    proved = .false.
    if (.not. min(a%inner, b%inner) > 0) return
    do k = 1, 2
      p(:, k) = at + a%v(a%edge(k, edge_a), :)
      q(:, k) = b%v(b%edge(k, edge_b), :)
    end do
    e = p(:, 2) - p(:, 1)
    d = q(:, 2) - q(:, 1)
    x(:, 1) = p(:, 1) - q(:, 1)
    x(:, 3) = p(:, 2) - q(:, 2)
    k = merge(2, 4, n(1)*(e(2)*d(3) - e(3)*d(2)) + n(2)*(e(3)*d(1) - e(1)*d(3)) + n(3)*(e(1)*d(2) - e(2)*d(1)) < 0)
    x(:, k) = p(:, 2) - q(:, 1)
    x(:, 6 - k) = p(:, 1) - q(:, 2)
    if (.not. beyond(x(:, 1), x(:, 2), at, depth)) return
    if (.not. beyond(x(:, 2), x(:, 3), at, depth)) return
    if (.not. beyond(x(:, 3), x(:, 4), at, depth)) return
    proved = beyond(x(:, 4), x(:, 1), at, depth)
  end function edges_are_nearest

  !> How far q, at `at` from p, is in front of the face of p that looks most along n [m].
  pure function along_likest_face(p, q, at, n) result(s)
    type(solid), intent(in) :: p, q
    real(c_double), intent(in) :: at(3), n(3)
    real(c_double) :: s, m(3)
    integer :: face, vertex
    call lowest(p%faces, p%normal, -n, s, face)
    m = p%normal(face, :)
    call lowest(q%vertices, q%v, m, s, vertex)
    s = s + dot_product(m, at) - p%offset(face)
  end function along_likest_face

  !> The edge of each body between two of the vertices its nearest point lies on; 0 if there is none.
  pure subroutine common_edges(a, b, corners, va, vb, edge_a, edge_b)
    type(solid), intent(in) :: a, b
    integer, intent(in) :: corners, va(4), vb(4)
    integer, intent(out) :: edge_a, edge_b
    edge_a = edge_between(a, corners, va)
    edge_b = 0
    if (edge_a > 0) edge_b = edge_between(b, corners, vb)
    if (edge_b == 0) edge_a = 0
  end subroutine common_edges

  pure function edge_between(p, corners, v) result(edge)
    type(solid), intent(in) :: p
    integer, intent(in) :: corners, v(4)
    integer :: edge, i, first, second
    edge = 0
    first = v(1)
    second = first
    do i = 2, corners
      if (v(i) == first .or. v(i) == second) cycle
      if (second /= first) return ! three of them: a face
      second = v(i)
    end do
    if (second == first) return
    do i = 1, p%edges
      if (min(first, second) /= min(p%edge(1, i), p%edge(2, i))) cycle
      if (max(first, second) /= max(p%edge(1, i), p%edge(2, i))) cycle
      edge = i
      return
    end do
  end function edge_between

end module hull_proofs
