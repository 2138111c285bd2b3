!> A triangle of a surface and those around it: where points stand to them, and which directions lead out of the surface.
!> Of a facet, edges 1 to 3 are its own: vertices from and to, whether it owns it, the vertex opposite in the neighbour (0:
!> none). Edges 4 to 6: its vertices, whether it owns them, and whether it follows the nodes of a mesh, which loads bend. The
!> others: triangles around that have one of its vertices, which is first; the other two are second and fourth, anticlockwise.
module facet_view
  use, intrinsic :: iso_c_binding, only: c_double
  use hull_view, only: solid
  implicit none
  private
  public :: on_edge, cross, inside_of, inward, is_over, is_under_valley, after, stands_out, pokes_out, leaves_edge, &
            leaves_vertex, is_bent, of_mesh, edge_from, vertex_from, nearer_elsewhere

  ! Tolerance relative to the size of the facet: a point so near to an edge lies on it, for both of its facets; a feature that
  ! protrudes by less lies in the plane.
  real(c_double), parameter :: on_edge = 1e-9_c_double

contains

  !> The vertex that follows another, 1 to 3.
  pure elemental integer function after(k)
    integer, intent(in) :: k
    after = modulo(k, 3) + 1
  end function after

  pure function cross(a, b) result(c)
    real(c_double), intent(in) :: a(3), b(3)
    real(c_double) :: c(3)
    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  !> Across edge k towards vertex `third` of a triangle at that edge, in the plane of the triangle, unit.
  pure function inward(q, k, third) result(w)
    type(solid), intent(in) :: q
    integer, intent(in) :: k, third
    real(c_double) :: w(3), e(3)
    e = q%v(after(k), :) - q%v(k, :)
    w = q%v(third, :) - q%v(k, :)
    w = w - dot_product(w, e)/dot_product(e, e)*e
    w = w/sqrt(dot_product(w, w))
  end function inward

  !> How far a point is from edge k towards vertex `third` of a triangle at that edge, in the plane of the triangle [m].
  pure function inside_of(q, k, third, x) result(s)
    type(solid), intent(in) :: q
    integer, intent(in) :: k, third
    real(c_double), intent(in) :: x(3)
    real(c_double) :: s, e(3), w(3)
    e = q%v(after(k), :) - q%v(k, :)
    w = q%v(third, :) - q%v(k, :)
    w = w - dot_product(w, e)/dot_product(e, e)*e
    s = dot_product(w, x - q%v(k, :))/sqrt(dot_product(w, w))
  end function inside_of

  !> True if a point is over the triangle, or over an edge or a vertex that it owns.
  pure logical function is_over(q, x)
    type(solid), intent(in) :: q
    real(c_double), intent(in) :: x(3)
    real(c_double) :: s(3), slack
    integer :: k, on
    slack = on_edge*q%size
    on = 0
    do k = 1, 3
      s(k) = inside_of(q, k, after(after(k)), x)
      if (s(k) <= slack) on = on + 1
    end do
    is_over = minval(s) >= -slack
    if (.not. is_over .or. on == 0) return
    do k = 1, 3
      if (on == 1 .and. s(k) <= slack) is_over = q%edge(3, k) /= 0
      ! two edges meet in the vertex where the second begins
      if (on > 1 .and. s(k) <= slack .and. s(after(k)) <= slack) is_over = q%edge(3, 3 + after(k)) /= 0
    end do
  end function is_over

  !> True if a point behind the triangle lies in a valley: beyond exactly one of its edges, where the next triangle is inclined
  !> towards it, and outside that triangle as well, so that it is over neither.
  pure logical function is_under_valley(q, x)
    type(solid), intent(in) :: q
    real(c_double), intent(in) :: x(3)
    real(c_double) :: slack
    integer :: k, beyond
    slack = on_edge*q%size
    is_under_valley = .false.
    beyond = 0
    do k = 1, 3
      if (inside_of(q, k, after(after(k)), x) > -slack) cycle
      beyond = beyond + 1
      if (q%edge(4, k) == 0) return
      if (stands_out(q, k)) return
      if (inside_of(q, k, int(q%edge(4, k)), x) > -slack) return
    end do
    is_under_valley = beyond == 1
  end function is_under_valley

  !> True if edge k is a rim of the surface or convex: a body may touch the edge without touching the interior of a triangle.
  pure logical function stands_out(q, k)
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    stands_out = q%edge(4, k) == 0
    if (stands_out) return
    stands_out = dot_product(q%normal(1, :), q%v(q%edge(4, k), :) - q%v(k, :)) < -on_edge*q%size
  end function stands_out

  !> The same for vertex k: not where all triangles around it lie in one plane and close round it.
  pure logical function pokes_out(q, k)
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    real(c_double) :: slack
    integer :: j, i, follower
    pokes_out = .true.
    slack = on_edge*q%size
    do j = 7, q%edges
      if (q%edge(1, j) /= k) cycle
      if (abs(dot_product(q%normal(1, :), q%v(q%edge(2, j), :) - q%v(k, :))) > slack) return
      if (abs(dot_product(q%normal(1, :), q%v(q%edge(4, j), :) - q%v(k, :))) > slack) return
    end do
    ! round the vertex, each triangle is followed by one that begins where it ends
    do j = 6, q%edges
      if (j > 6) then
        if (q%edge(1, j) /= k) cycle
      end if
      follower = after(after(k))
      if (j > 6) follower = q%edge(4, j)
      if (follower == after(k)) cycle
      do i = 7, q%edges
        if (q%edge(1, i) == k .and. q%edge(2, i) == follower) exit
      end do
      if (i > q%edges) return
    end do
    pokes_out = .false.
  end function pokes_out

  !> True if the triangle is a side of a mesh.
  pure logical function of_mesh(q)
    type(solid), intent(in) :: q
    of_mesh = any(q%edge(4, 4:6) /= 0)
  end function of_mesh

  !> True if a load has bent the surface of a mesh at vertex k of this facet: neither flat nor a corner there. A body larger than
  !> the cells bends them around itself, and is borne by all vertices that it covers.
  pure logical function is_bent(q, k)
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    real(c_double), parameter :: no_corner = 0.75_c_double ! cosine between normals
    real(c_double) :: n(3), slack
    integer :: j
    is_bent = .false.
    if (q%edge(3, 3 + k) == 0 .or. q%edge(4, 3 + k) == 0) return
    slack = on_edge*q%size
    do j = 7, q%edges
      if (q%edge(1, j) /= k) cycle
      n = cross(q%v(q%edge(2, j), :) - q%v(k, :), q%v(q%edge(4, j), :) - q%v(k, :))
      if (dot_product(q%normal(1, :), n) < no_corner*sqrt(dot_product(n, n))) then
        is_bent = .false.
        return
      end if
      is_bent = is_bent .or. abs(dot_product(q%normal(1, :), q%v(q%edge(2, j), :) - q%v(k, :))) > slack &
                .or. abs(dot_product(q%normal(1, :), q%v(q%edge(4, j), :) - q%v(k, :))) > slack
    end do
  end function is_bent

  !> True if a vector d across edge k leads out of the surface. `slack`: tolerance, in the unit of d.
  pure logical function leaves_edge(q, k, d, slack)
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    real(c_double), intent(in) :: d(3), slack
    logical :: outside
    call edge_from(q, k, d, slack, leaves_edge, outside)
    leaves_edge = leaves_edge .and. outside
  end function leaves_edge

  !> away: a vector d across edge k leads away from both triangles there; outside: it is in front of either.
  pure subroutine edge_from(q, k, d, slack, away, outside)
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    real(c_double), intent(in) :: d(3), slack
    logical, intent(out) :: away, outside
    real(c_double) :: e(3)
    away = dot_product(inward(q, k, after(after(k))), d) <= slack
    outside = dot_product(q%normal(1, :), d) >= -slack
    if (.not. away .or. q%edge(4, k) == 0) return
    away = dot_product(inward(q, k, int(q%edge(4, k))), d) <= slack
    e = q%v(after(k), :) - q%v(k, :)
    outside = outside .or. dot_product(d, cross(q%v(q%edge(4, k), :) - q%v(k, :), e)) >= 0
  end subroutine edge_from

  !> The same from vertex k.
  pure logical function leaves_vertex(q, k, d, slack)
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    real(c_double), intent(in) :: d(3), slack
    logical :: outside
    call vertex_from(q, k, d, slack, leaves_vertex, outside)
    leaves_vertex = leaves_vertex .and. outside
  end function leaves_vertex

  !> away: no edge from vertex k leads along a vector d; outside: d is in front of a triangle around it.
  pure subroutine vertex_from(q, k, d, slack, away, outside)
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    real(c_double), intent(in) :: d(3), slack
    logical, intent(out) :: away, outside
    real(c_double) :: e(3), f(3)
    integer :: j
    e = q%v(after(k), :) - q%v(k, :)
    f = q%v(after(after(k)), :) - q%v(k, :)
    outside = dot_product(d, q%normal(1, :)) >= -slack
    away = .not. (leads(e) .or. leads(f))
    do j = 7, q%edges
      if (.not. away) return
      if (q%edge(1, j) /= k) cycle
      e = q%v(q%edge(2, j), :) - q%v(k, :)
      f = q%v(q%edge(4, j), :) - q%v(k, :)
      away = .not. (leads(e) .or. leads(f))
      outside = outside .or. dot_product(d, cross(e, f)) >= 0
    end do
  contains
    pure logical function leads(e)
      real(c_double), intent(in) :: e(3)
      leads = dot_product(d, e) > slack*sqrt(dot_product(e, e))
    end function leads
  end subroutine vertex_from

  !> True if a point behind the surface is nearer to the interior of this or a neighbouring triangle than `depth`.
  pure logical function nearer_elsewhere(q, x, depth)
    type(solid), intent(in) :: q
    real(c_double), intent(in) :: x(3), depth
    integer :: j
    nearer_elsewhere = over(q%v(1, :), q%v(2, :), q%v(3, :))
    do j = 7, q%edges
      if (nearer_elsewhere) return
      nearer_elsewhere = over(q%v(q%edge(1, j), :), q%v(q%edge(2, j), :), q%v(q%edge(4, j), :))
    end do
  contains
    pure logical function over(a, b, c)
      real(c_double), intent(in) :: a(3), b(3), c(3)
      real(c_double) :: m(3), height
      over = .false.
      m = cross(b - a, c - a)
      height = dot_product(m, x - a)/sqrt(dot_product(m, m))
      if (height > 0 .or. -height >= depth - on_edge*q%size) return
      over = min(dot_product(cross(b - a, x - a), m), dot_product(cross(c - b, x - b), m), &
                 dot_product(cross(a - c, x - c), m)) >= 0
    end function over
  end function nearer_elsewhere

end module facet_view
