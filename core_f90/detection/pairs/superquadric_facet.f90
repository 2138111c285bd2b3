!> Contact of a superquadric with one triangle of a surface that is solid behind it.
module superquadric_facet
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls, solid, view_solid
  use convex_axis, only: axis_between
  use convex_facet, only: arc, farthest_on_arc, is_near, leaves_elsewhere, on_inside, see_arc
  use convex_shape, only: convex, see_point, see_superquadric
  use facet_points, only: add, findings, settle
  use facet_view, only: is_bent, leaves_vertex, on_edge, pokes_out, stands_out
  use patch_points, only: name_of_edges, vertex_of_b
  implicit none
  private
  public :: cairn_pair_superquadric_facet

contains

  !> Its lowest point along the normal of the triangle touches the inside, edges and vertices that stand out are touched along
  !> the normals that they allow, each for the triangle that owns it: as a sphere is.
  subroutine cairn_pair_superquadric_facet(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, &
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
      call see_superquadric(view, a(i), radius_a(i), p)
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
  end subroutine cairn_pair_superquadric_facet

  pure subroutine at_edge(p, q, k, at, limit, f)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    real(c_double), intent(in) :: at(3), limit
    type(findings), intent(inout) :: f
    type(arc) :: g
    real(c_double) :: n(3), x(3), gap, along
    logical :: found
    call see_arc(q, k, g)
    if (.not. is_near(p, at, g, limit)) return
    call farthest_on_arc(p, at, g, found, n, x)
    if (.not. found) return
    gap = dot_product(n, at + x - g%from)
    along = dot_product(g%e, at + x - g%from)
    if (gap > limit .or. .not. min(along, g%length - along) > on_edge*q%size) return
    if (.not. dot_product(n, at - g%from) > 0) return
    if (gap < 0) then
      if (leaves_elsewhere(p, q, at, at + x, gap, gap)) return
    end if
    call add(f, x - (gap/2)*n, n, gap, name_of_edges(1, k))
  end subroutine at_edge

  subroutine at_vertex(p, q, k, at, limit, f)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    real(c_double), intent(in) :: at(3), limit
    type(findings), intent(inout) :: f
    type(convex) :: corner
    real(c_double) :: n(3), x(3), y(3), gap
    logical :: apart
    x = at - q%v(k, :)
    if (dot_product(x, x) > (p%size + limit)**2) return
    if (.not. pokes_out(q, k)) return
    call see_point(0.0_c_double, corner)
    call axis_between(p, corner, at - q%v(k, :), limit, n, gap, x, y, apart)
    if (apart .or. gap > limit) return
    if (is_bent(q, k) .and. 2*minval(p%half) >= q%size) then ! see sphere_facet.f90
      if (.not. dot_product(q%normal(1, :), n) > on_edge) return
    else if (.not. leaves_vertex(q, k, n, on_edge)) then
      return
    end if
    call add(f, q%v(k, :) - at + (gap/2)*n, n, gap, int(vertex_of_b + k, c_int32_t))
  end subroutine at_vertex

end module superquadric_facet
