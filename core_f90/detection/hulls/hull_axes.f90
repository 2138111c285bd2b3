!> Separating axes of two convex polyhedra: how far apart they are along the normals of faces and across pairs of edges. The
!> largest is the depth of penetration of overlapping ones (Gottschalk, Lin & Manocha 1996), a bound of the gap of others.
module hull_axes
  use, intrinsic :: iso_c_binding, only: c_double, c_int64_t
  use hull_view, only: solid
  implicit none
  private
  public :: best_face, best_edges, axis_of_edges

  integer, parameter :: lanes = 4, edges_at_once = 64
  integer, parameter :: most_faces = 10922 !< two thirds of the most edges a hull may have, see hulls.hpp

  !> Edges of a hull that look at the other: from, along [m], normals of the faces left and right.
  type :: facing
    integer :: count = 0
    integer :: edge(edges_at_once)
    real(c_double), dimension(edges_at_once, 3) :: from, along, left, right
  end type facing

contains

  !> Largest separation along the outward normals of the faces of p, q standing at `at` from p; `best` is -huge at first, and a face
  !> counts if it beats it. Returns early once the separation exceeds the limit.
  subroutine best_face(p, q, at, limit, best, face)
    type(solid), intent(in) :: p, q
    real(c_double), intent(in) :: at(:)           !< centre of q - centre of p [m]
    real(c_double), intent(in) :: limit           !< [m]
    real(c_double), intent(inout) :: best         !< [m]
    integer, intent(inout) :: face                !< of p, from 1
    real(c_double) :: s(lanes), high(lanes), top
    integer(c_int64_t) :: found(lanes)
    integer :: first, from, j, last

    high = best
    found = p%faces + 1
    top = best
    do first = 1, p%faces, lanes
      from = max(min(first, p%faces - lanes + 1), 1) - 1
      call separations(p%faces, p%normal, p%offset, q%vertices, q%v, at, from, s)
      do j = 1, lanes
        found(j) = merge(int(from + j, c_int64_t), found(j), s(j) > high(j))
        high(j) = max(high(j), s(j))
      end do
      top = max(max(high(1), high(2)), max(high(3), high(4)))
      if (top > limit) exit
    end do
    if (.not. top > best) return
    best = top
    last = p%faces + 1
    do j = 1, lanes
      last = min(last, merge(int(found(j)), last, high(j) >= top))
    end do
    face = last
  end subroutine best_face

  !> Separations along a few faces after `from`.
  pure subroutine separations(faces, normal, offset, vertices, v, at, from, s)
    integer, intent(in) :: faces, vertices, from
    real(c_double), intent(in) :: normal(faces, 3), offset(faces), v(vertices, 3), at(3)
    real(c_double), intent(out) :: s(lanes)
    real(c_double) :: x, y, z
    integer :: j, k
    if (faces < lanes) then
      s = -huge(s)
      do j = 1, faces
        s(j) = minval(normal(j, 1)*(at(1) + v(:, 1)) + normal(j, 2)*(at(2) + v(:, 2)) + normal(j, 3)*(at(3) + v(:, 3))) &
               - offset(j)
      end do
      return
    end if
    s = huge(s)
    do k = 1, vertices
      x = at(1) + v(k, 1)
      y = at(2) + v(k, 2)
      z = at(3) + v(k, 3)
      do j = 1, lanes
        s(j) = min(s(j), normal(from + j, 1)*x + normal(from + j, 2)*y + normal(from + j, 3)*z)
      end do
    end do
    do j = 1, lanes
      s(j) = s(j) - offset(from + j)
    end do
  end subroutine separations

  !> Separation along n, from b to a, a standing at `at` from b.
  pure function along_axis(a, b, at, n) result(s)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), n(3)
    real(c_double) :: s, low, high
    integer :: i
    low = huge(low)
    do i = 1, a%vertices
      low = min(low, n(1)*a%v(i, 1) + n(2)*a%v(i, 2) + n(3)*a%v(i, 3))
    end do
    high = -huge(high)
    do i = 1, b%vertices
      high = max(high, n(1)*b%v(i, 1) + n(2)*b%v(i, 2) + n(3)*b%v(i, 3))
    end do
    s = dot_product(n, at) + low - high
  end function along_axis

  !> How far the centre of q, at `at` from that of p, is in front of the faces of p [m].
  pure subroutine in_front_of_faces(faces, normal, offset, at, front)
    integer, intent(in) :: faces
    real(c_double), intent(in) :: normal(faces, 3), offset(faces), at(3)
    real(c_double), intent(inout) :: front(faces)
    integer :: i
    do i = 1, faces
      front(i) = normal(i, 1)*at(1) + normal(i, 2)*at(2) + normal(i, 3)*at(3) - offset(i)
    end do
  end subroutine in_front_of_faces

  !> Edges of p that may make an axis along which q is farther than `least`: those that see q beyond them.
  subroutine facing_edges(p, q, at, front, least, first, f)
    type(solid), intent(in) :: p, q
    real(c_double), intent(in) :: at(3), front(:), least
    integer, intent(inout) :: first               !< next edge to look at
    type(facing), intent(inout) :: f
    real(c_double) :: w(3), e(3), m(3), n1(3), n2(3), along1, along2, wanted, square
    integer :: k, from
    wanted = least + q%inner
    f%count = 0
    do k = first, p%edges
      if (f%count == edges_at_once) exit
      first = k + 1
      along1 = front(p%edge(3, k))
      along2 = front(p%edge(4, k))
      ! between the two normals, w may reach farther than along either, if it looks along their middle at all
      if (max(along1, along2) <= wanted .and. along1 + along2 <= 0) cycle
      from = p%edge(1, k)
      n1 = p%normal(p%edge(3, k), :)
      n2 = p%normal(p%edge(4, k), :)
      e = p%v(p%edge(2, k), :) - p%v(from, :)
      if (max(along1, along2) <= wanted) then
        w = at - p%v(from, :)
        m = cross(e, n1)
        if (dot_product(m, w) <= 0) cycle
        m = cross(n2, e)
        if (dot_product(m, w) <= 0) cycle
        square = dot_product(w, w) - dot_product(w, e)**2/dot_product(e, e)
        if (wanted > 0 .and. square <= wanted*wanted) cycle
      end if
      f%count = f%count + 1
      f%edge(f%count) = k
      f%from(f%count, :) = p%v(from, :)
      f%along(f%count, :) = e
      f%left(f%count, :) = n1
      f%right(f%count, :) = n2
    end do
  end subroutine facing_edges

  !> Largest separation across an edge of a and one of b, where it beats `best`: a standing at `at` from b.
  subroutine best_edges(a, b, at, limit, best, edge_a, edge_b)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), limit    !< [m]
    real(c_double), intent(inout) :: best         !< [m]
    integer, intent(inout) :: edge_a, edge_b
    type(facing) :: of_a, of_b
    real(c_double) :: front_a(most_faces), front_b(most_faces)
    integer :: first_a, first_b, i

    call in_front_of_faces(a%faces, a%normal, a%offset, -at, front_a)
    call in_front_of_faces(b%faces, b%normal, b%offset, at, front_b)
    first_a = 1
    do while (first_a <= a%edges)
      call facing_edges(a, b, -at, front_a, best, first_a, of_a)
      if (of_a%count == 0) cycle
      first_b = 1
      do while (first_b <= b%edges)
        call facing_edges(b, a, at, front_b, best, first_b, of_b)
        do i = 1, of_a%count
          call with_edge(a, b, at, of_a, i, of_b, best, edge_a, edge_b)
          if (best > limit) return
        end do
      end do
    end do
  end subroutine best_edges

  !> The same for one edge of a. Two edges make an axis where the arcs between the normals of their faces cross (Gregorius 2013).
  subroutine with_edge(a, b, at, fa, i, fb, best, edge_a, edge_b)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3)
    type(facing), intent(in) :: fa, fb
    integer, intent(in) :: i
    real(c_double), intent(inout) :: best
    integer, intent(inout) :: edge_a, edge_b
    real(c_double) :: n1(3), n2(3), from(3), e(3), c(3), s, a1, a2, b1, b2, length
    integer :: j
    logical :: meet(edges_at_once)
    from = at + fa%from(i, :)
    e = fa%along(i, :)
    n1 = fa%left(i, :)
    n2 = fa%right(i, :)
    do j = 1, fb%count
      b1 = fb%left(j, 1)*e(1) + fb%left(j, 2)*e(2) + fb%left(j, 3)*e(3)
      b2 = fb%right(j, 1)*e(1) + fb%right(j, 2)*e(2) + fb%right(j, 3)*e(3)
      a1 = n1(1)*fb%along(j, 1) + n1(2)*fb%along(j, 2) + n1(3)*fb%along(j, 3)
      a2 = n2(1)*fb%along(j, 1) + n2(2)*fb%along(j, 2) + n2(3)*fb%along(j, 3)
      meet(j) = max(b1*b2, a1*a2, b1*a2) < 0
    end do
    do j = 1, fb%count
      if (.not. meet(j)) cycle
      c = cross(e, fb%along(j, :))
      length = sqrt(dot_product(c, c))
      if (.not. length > 0) cycle
      s = dot_product(c, from - fb%from(j, :))
      if (dot_product(c, fb%left(j, :) + fb%right(j, :)) < 0) s = -s
      if (.not. s > best*length) cycle
      call axis_of_edges(a, b, at, fa%edge(i), fb%edge(j), s, c)
      if (.not. s > best) cycle
      best = s
      edge_a = fa%edge(i)
      edge_b = fb%edge(j)
    end do
  end subroutine with_edge

  !> Axis across two edges, and the separation along it.
  pure subroutine axis_of_edges(a, b, at, edge_a, edge_b, s, n)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3)
    integer, intent(in) :: edge_a, edge_b
    real(c_double), intent(out) :: s, n(3)
    real(c_double) :: e(3), d(3), length
    s = -huge(s)
    e = a%v(a%edge(2, edge_a), :) - a%v(a%edge(1, edge_a), :)
    d = b%v(b%edge(2, edge_b), :) - b%v(b%edge(1, edge_b), :)
    n = cross(e, d)
    length = sqrt(dot_product(n, n))
    if (.not. length > 0) return
    n = n*sign(1/length, dot_product(n, b%normal(b%edge(3, edge_b), :) + b%normal(b%edge(4, edge_b), :)))
    s = dot_product(n, at + a%v(a%edge(1, edge_a), :) - b%v(b%edge(1, edge_b), :))
    s = min(s, along_axis(a, b, at, n)) ! edges that are all but parallel know their axis badly
  end subroutine axis_of_edges

  pure function cross(a, b) result(c)
    real(c_double), intent(in) :: a(3), b(3)
    real(c_double) :: c(3)
    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

end module hull_axes
