!> Axes of contact of two convex polyhedra from the features that make them: faces, edges, vertices. One place for
!> them, called from wherever features come: found among all or recalled from the step before, they give the same bits.
module hull_features
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: solid
  use hull_proofs, only: along_likest_face, face_is_nearest
  use hull_support, only: lowest
  use patch_points, only: name_of_edges, vertex_of_b
  implicit none
  private
  public :: axis, face_axis, edge_axis, edges_stand_out, point_axis, alone, rounding, vertex_from

  real(c_double), parameter :: rounding = 16*epsilon(1.0_c_double) !< of the sizes together: what rounding alone makes of a depth

  real(c_double), parameter :: unlike = 8*rounding !< of the sizes together: depths that are not taken for the same

  real(c_double), parameter :: parallel = 1e-6_c_double !< square of the sine of edges that know the axis across them badly
  integer(c_int32_t), parameter :: vertex_from = 2_c_int32_t**20 !< see axis

  !> Normal from b to a, gap along it, the nearest points [m] from the centre of b, and the name of their features.
  type :: axis
    real(c_double) :: n(3) = 0, gap = 0, point_a(3) = 0, point_b(3) = 0
    integer(c_int32_t) :: name = 0
    integer(c_int32_t) :: feature(2) = 0 !< of A and B: a face, minus an edge, vertex_from + a vertex; 0: not known
  end type axis

contains

  !> The axis along a face of p towards the deepest vertex of q, which stands at `at` from p. `nearest` if that vertex is in
  !> front of the face, so that there is no nearer pair of points, or if there is proof that the overlap is the least; with a
  !> margin [m], that it is so by as much, and no face of q may take the place of that of p.
  subroutine face_axis(p, face, q, at, of_a, margin, x, nearest)
    type(solid), intent(in) :: p, q
    integer, intent(in) :: face
    real(c_double), intent(in) :: at(3), margin
    logical, intent(in) :: of_a !< p is A
    type(axis), intent(inout) :: x
    logical, intent(out) :: nearest
    real(c_double) :: m(3), low, height, at_vertex(3), foot(3)
    integer :: i, deepest, flush
    m = p%normal(face, :)
    call lowest(q%vertices, q%v, m, low, deepest)
    at_vertex = at + q%v(deepest, :)
    x%gap = m(1)*at_vertex(1) + m(2)*at_vertex(2) + m(3)*at_vertex(3) - p%offset(face)
    foot = at_vertex - x%gap*m
    if (of_a) then
      x%n = -m
      x%point_a = foot - at
      x%point_b = at_vertex - at
      x%name = vertex_of_b + deepest
      x%feature = [face, vertex_from + deepest]
    else
      x%n = m
      x%point_a = at_vertex
      x%point_b = foot
      x%name = deepest
      x%feature = [vertex_from + deepest, face]
    end if
    ! of vertices that rounding alone keeps from being the deepest, one may give the proof where another does not
    nearest = face_meets(p, face, q, deepest, at, x%gap, margin)
    do i = 1, merge(0, q%vertices, nearest)
      height = m(1)*q%v(i, 1) + m(2)*q%v(i, 2) + m(3)*q%v(i, 3)
      if (height > low + rounding*(p%size + q%size)) cycle
      nearest = face_meets(p, face, q, i, at, x%gap, margin)
      if (nearest) exit
    end do
    if (of_a .or. .not. nearest .or. .not. margin > 0) return
    flush = 0
    do i = 1, q%vertices
      flush = flush + merge(1, 0, m(1)*q%v(i, 1) + m(2)*q%v(i, 2) + m(3)*q%v(i, 3) < low + margin)
    end do
    ! of faces of both that lie on each other that of A is taken, unless rounding can tell that it is less far
    if (flush > 2) nearest = x%gap > along_likest_face(q, p, -at, -m) + unlike*(p%size + q%size)
  end subroutine face_axis

  pure function face_meets(p, face, q, vertex, at, gap, margin) result(nearest)
    type(solid), intent(in) :: p, q
    integer, intent(in) :: face, vertex
    real(c_double), intent(in) :: at(3), gap, margin
    logical :: nearest
    if (gap > 0) then
      nearest = in_front(p, face, at + q%v(vertex, :), margin)
    else
      nearest = face_is_nearest(p, face, q, vertex, at, margin + 2*rounding*(p%size + q%size) - gap)
    end if
  end function face_meets

  pure function in_front(p, face, x, margin)
    type(solid), intent(in) :: p
    integer, intent(in) :: face
    real(c_double), intent(in) :: x(3), margin
    logical :: in_front
    real(c_double) :: from(3), e(3), w(3), m(3), inside
    integer :: k, first, last
    first = p%first_corner(face) + 1
    last = p%first_corner(face + 1)
    m = p%normal(face, :)
    in_front = .false.
    from = p%v(p%corner_vertex(last), :)
    do k = first, last
      e = p%v(p%corner_vertex(k), :) - from
      w = x - from
      inside = m(1)*(e(2)*w(3) - e(3)*w(2)) + m(2)*(e(3)*w(1) - e(1)*w(3)) + m(3)*(e(1)*w(2) - e(2)*w(1))
      if (inside < 0 .or. inside*inside < margin*margin*dot_product(e, e)) return
      from = p%v(p%corner_vertex(k), :)
    end do
    in_front = .true.
  end function in_front

  !> The axis across two edges, with the nearest points of their lines; `nearest` if these are on the edges, no nearer to their
  !> ends than the margin [m], and apart, and the edges not all but parallel.
  pure subroutine edge_axis(a, b, at, edge_a, edge_b, gap, n, margin, x, nearest)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), gap, n(3), margin
    integer, intent(in) :: edge_a, edge_b
    type(axis), intent(inout) :: x
    logical, intent(out) :: nearest
    real(c_double) :: p(3), q(3), d(3), e(3), w(3), dd, de, ee, det, along_a, along_b, end_a, end_b
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
    end_a = min(along_a, 1 - along_a)
    end_b = min(along_b, 1 - along_b)
    nearest = gap > 0 .and. det > parallel*dd*ee .and. min(end_a, end_b) >= 0
    nearest = nearest .and. min(end_a*end_a*dd, end_b*end_b*ee) >= margin*margin
    x%name = name_of_edges(edge_a, edge_b)
    x%feature = [-edge_a, -edge_b]
  end subroutine edge_axis

  !> Separating axis through the nearest points of two vertices, or of a vertex and an edge. nearest: the foot is on the edge, at
  !> least the margin [m] from its ends, and the points are more than `least` apart.
  pure subroutine point_axis(a, b, at, feature, least, margin, x, nearest)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), least, margin
    integer(c_int32_t), intent(in) :: feature(2)
    type(axis), intent(inout) :: x
    logical, intent(out) :: nearest
    real(c_double) :: d(3), inside
    if (feature(1) < 0) then
      x%point_b = b%v(feature(2) - vertex_from, :)
      call foot_on_edge(a, -feature(1), at, x%point_b, x%point_a, inside)
      x%name = vertex_of_b + feature(2) - vertex_from
    else
      x%point_a = at + a%v(feature(1) - vertex_from, :)
      inside = margin
      if (feature(2) < 0) then
        call foot_on_edge(b, -feature(2), [0.0_c_double, 0.0_c_double, 0.0_c_double], x%point_a, x%point_b, inside)
      else
        x%point_b = b%v(feature(2) - vertex_from, :)
      end if
      x%name = feature(1) - vertex_from
    end if
    d = x%point_a - x%point_b
    x%gap = sqrt(d(1)*d(1) + d(2)*d(2) + d(3)*d(3))
    x%feature = feature
    nearest = inside >= margin .and. x%gap > least
    if (nearest) x%n = d/x%gap
  end subroutine point_axis

  !> The point of the line of an edge nearest to x, and how far from the ends it is [m], negative outside.
  pure subroutine foot_on_edge(p, edge, at, x, foot, inside)
    type(solid), intent(in) :: p
    integer, intent(in) :: edge
    real(c_double), intent(in) :: at(3), x(3)
    real(c_double), intent(out) :: foot(3), inside
    real(c_double) :: from(3), e(3), along, square
    from = at + p%v(p%edge(1, edge), :)
    e = p%v(p%edge(2, edge), :) - p%v(p%edge(1, edge), :)
    square = e(1)*e(1) + e(2)*e(2) + e(3)*e(3)
    along = (e(1)*(x(1) - from(1)) + e(2)*(x(2) - from(2)) + e(3)*(x(3) - from(3)))/square
    foot = from + along*e
    inside = min(along, 1 - along)*sqrt(square)
  end subroutine foot_on_edge

  !> True if the feature (an edge or a vertex) is lower along n than all other vertices by more than the margin, which is well above
  !> rounding.
  pure function alone(p, feature, n, margin)
    type(solid), intent(in) :: p
    integer(c_int32_t), intent(in) :: feature
    real(c_double), intent(in) :: n(3), margin
    logical :: alone
    real(c_double) :: own, height
    integer :: i, from, to, low
    if (feature < 0) then
      from = p%edge(1, -feature)
      to = p%edge(2, -feature)
    else
      from = feature - vertex_from
      to = from
    end if
    own = max(dot_product(n, p%v(from, :)), dot_product(n, p%v(to, :)))
    low = 0
    do i = 1, p%vertices
      height = n(1)*p%v(i, 1) + n(2)*p%v(i, 2) + n(3)*p%v(i, 3)
      low = low + merge(1, 0, height <= own + margin)
    end do
    alone = low == merge(1, 2, from == to)
  end function alone

  !> True if two edges are the deepest features along the axis n across both, at depth s [m], and no two nearly parallel faces are
  !> as far apart.
  pure function edges_stand_out(a, b, at, edge_a, edge_b, s, n)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), s, n(3)
    integer, intent(in) :: edge_a, edge_b
    logical :: edges_stand_out
    real(c_double) :: own
    own = dot_product(n, at + a%v(a%edge(1, edge_a), :) - b%v(b%edge(1, edge_b), :))
    edges_stand_out = own <= s + rounding*(a%size + b%size)
    if (.not. edges_stand_out) return
    own = max(along_likest_face(a, b, -at, -n), along_likest_face(b, a, at, n))
    edges_stand_out = s > own + unlike*(a%size + b%size)
  end function edges_stand_out

  pure function unit_part(s) result(t)
    real(c_double), intent(in) :: s
    real(c_double) :: t
    t = merge(min(s, 1.0_c_double), 0.0_c_double, s > 0)
  end function unit_part

end module hull_features
