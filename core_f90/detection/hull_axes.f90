!> Separating axes of two convex polyhedra: how far apart they are along the normals of faces and across pairs of edges. The
!> largest is the depth of penetration of overlapping ones (Gottschalk, Lin & Manocha 1996), a bound of the gap of others.
module hull_axes
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: solid
  implicit none
  private
  public :: best_face, best_edges, axis_of_edges

  integer, parameter :: faces_at_once = 32, edges_at_once = 64

  !> Edges of a hull that look at the other: from, along [m], normals of the faces left and right.
  type :: facing
    integer :: count = 0
    integer :: edge(edges_at_once)
    real(c_double), dimension(edges_at_once, 3) :: from, along, left, right
  end type facing

contains

  !> Largest separation along the outward normals of the faces of p, q standing at `at` from p; `best` is -huge at first, and
  !> a face counts if it beats it. Leaves early with what it has once that is more than the limit.
  subroutine best_face(p, q, at, limit, best, face)
    type(solid), intent(in) :: p, q
    real(c_double), intent(in) :: at(:)           !< centre of q - centre of p [m]
    real(c_double), intent(in) :: limit           !< [m]
    real(c_double), intent(inout) :: best         !< [m]
    integer, intent(inout) :: face                !< of p, from 1
    real(c_double) :: low(faces_at_once), x, y, z
    integer :: first, last, i, j, v

    do first = 1, p%faces, faces_at_once
      last = min(first + faces_at_once - 1, p%faces)
      low = huge(low)
      do v = 1, q%vertices
        x = at(1) + q%v(v, 1)
        y = at(2) + q%v(v, 2)
        z = at(3) + q%v(v, 3)
        do i = first, last
          j = i - first + 1
          low(j) = min(low(j), p%normal(i, 1)*x + p%normal(i, 2)*y + p%normal(i, 3)*z)
        end do
      end do
      do i = first, last
        x = low(i - first + 1) - p%offset(i)
        if (x > best) then
          best = x
          face = i
        end if
      end do
      if (best > limit) return
    end do
  end subroutine best_face

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

  !> Edges of p that may make an axis along which q is farther than `least`: those that see q beyond them.
  subroutine facing_edges(p, q, at, least, first, f)
    type(solid), intent(in) :: p, q
    real(c_double), intent(in) :: at(3), least
    integer, intent(inout) :: first               !< next edge to look at
    type(facing), intent(inout) :: f
    real(c_double) :: w(3), e(3), m(3), n1(3), n2(3), along1, along2, wanted, square
    integer :: k, from
    wanted = least + q%inner
    f%count = 0
    do k = first, p%edges
      if (f%count == edges_at_once) exit
      first = k + 1
      from = p%edge(1, k)
      n1 = p%normal(p%edge(3, k), :)
      n2 = p%normal(p%edge(4, k), :)
      w = at - p%v(from, :)
      e = p%v(p%edge(2, k), :) - p%v(from, :)
      along1 = dot_product(n1, w)
      along2 = dot_product(n2, w)
      if (max(along1, along2) <= wanted) then
        ! between the two normals, w may reach farther than along either
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
  subroutine best_edges(a, b, at, limit, best, edge_a, edge_b, normal)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), limit    !< [m]
    real(c_double), intent(inout) :: best         !< [m]
    integer, intent(inout) :: edge_a, edge_b
    real(c_double), intent(inout) :: normal(3)    !< unit, from b to a
    type(facing) :: of_a, of_b
    integer :: first_a, first_b, i

    first_a = 1
    do while (first_a <= a%edges)
      call facing_edges(a, b, -at, best, first_a, of_a)
      if (of_a%count == 0) cycle
      first_b = 1
      do while (first_b <= b%edges)
        call facing_edges(b, a, at, best, first_b, of_b)
        do i = 1, of_a%count
          call with_edge(a, b, at, of_a, i, of_b, best, edge_a, edge_b, normal)
          if (best > limit) return
        end do
      end do
    end do
  end subroutine best_edges

  !> The same for one edge of a. Two edges make an axis where the arcs between the normals of their faces cross (Gregorius 2013).
  subroutine with_edge(a, b, at, fa, i, fb, best, edge_a, edge_b, normal)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(3)
    type(facing), intent(in) :: fa, fb
    integer, intent(in) :: i
    real(c_double), intent(inout) :: best, normal(3)
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
      normal = c
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
    n = n/length
    if (dot_product(n, b%normal(b%edge(3, edge_b), :) + b%normal(b%edge(4, edge_b), :)) < 0) n = -n
    s = dot_product(n, at + a%v(a%edge(1, edge_a), :) - b%v(b%edge(1, edge_b), :))
    s = min(s, along_axis(a, b, at, n)) ! edges that are all but parallel know their axis badly
  end subroutine axis_of_edges

  pure function cross(a, b) result(c)
    real(c_double), intent(in) :: a(3), b(3)
    real(c_double) :: c(3)
    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

end module hull_axes
