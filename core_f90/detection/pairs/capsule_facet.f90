!> Contact of a capsule with one triangle of a surface that is solid behind it.
module capsule_facet
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls, solid, view_solid
  use convex_shape, only: convex, see_capsule
  use facet_points, only: add, findings, settle
  use facet_view, only: after, cross, inward, is_bent, leaves_edge, leaves_vertex, on_edge, pokes_out, stands_out
  use patch_points, only: name_of_edges, vertex_of_b
  use sphere_facet, only: nearest_of_facet
  implicit none
  private
  public :: cairn_pair_capsule_facet

contains

  !> Both ends touch as spheres do; the side between them touches convex edges and vertices, each for the triangle that owns it.
  subroutine cairn_pair_capsule_facet(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, &
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
      call see_capsule(view, a(i), radius_a(i), p)
      call view_solid(view, b(i), radius_b(i), q)
      f%count = 0
      f%slack = on_edge*q%size
      do k = 1, 2
        call at_end(p, q, between(i, :), k, limit(i), f)
      end do
      do k = 1, 3
        if (.not. p%half(3) > f%slack) exit
        if (q%edge(3, k) /= 0) then
          if (stands_out(q, k)) call at_edge(p, q, k, between(i, :), limit(i), f)
        end if
        if (q%edge(3, 3 + k) /= 0) call at_vertex(p, q, k, between(i, :), limit(i), f)
      end do
      call settle(f, view%most, count(i), gap(:, i), normal(:, :, i), point(:, :, i), feature(:, i))
    end do
  end subroutine cairn_pair_capsule_facet

  pure subroutine at_end(p, q, at, which, limit, f)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    real(c_double), intent(in) :: at(3), limit
    integer, intent(in) :: which
    type(findings), intent(inout) :: f
    real(c_double) :: x(3), m(3), distance
    logical :: found
    x = (2*which - 3)*p%half(3)*p%frame(:, 3)
    call nearest_of_facet(q, at + x, p%layer + limit, found, distance, m)
    if (.not. found .or. distance - p%layer > limit) return
    call add(f, x - (distance + p%layer)/2*m, m, distance - p%layer, int(which, c_int32_t))
  end subroutine at_end

  pure subroutine at_edge(p, q, k, at, limit, f)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    real(c_double), intent(in) :: at(3), limit
    type(findings), intent(inout) :: f
    real(c_double) :: d(3), e(3), n(3), w(3), x(3), out(3), length, det, along, gap
    e = q%v(after(k), :) - q%v(k, :)
    d = 2*p%half(3)*p%frame(:, 3)
    n = cross(d, e)
    length = sqrt(dot_product(n, n))
    if (length <= 1e-8_c_double*sqrt(dot_product(d, d)*dot_product(e, e))) return
    n = n/length
    out = -inward(q, k, after(after(k)))
    if (q%edge(4, k) == 0) out = out + q%normal(1, :)
    if (q%edge(4, k) > 0) out = out - inward(q, k, int(q%edge(4, k)))
    if (dot_product(n, out) < 0) n = -n
    w = q%v(k, :) - (at - d/2)
    gap = -dot_product(n, w) - p%layer
    if (gap > limit .or. gap < -p%layer) return ! no edge is met from behind, as the far one of a thin sheet
    if (.not. leaves_edge(q, k, n, on_edge)) return
    det = dot_product(cross(d, e), n)
    along = dot_product(cross(w, e), n)/det
    if (.not. min(along, 1 - along)*2*p%half(3) > f%slack) return
    x = (along - 0.5_c_double)*d
    along = dot_product(cross(w, d), n)/det
    if (.not. min(along, 1 - along)*sqrt(dot_product(e, e)) > f%slack) return
    call add(f, x - (p%layer + gap/2)*n, n, gap, name_of_edges(1, k))
  end subroutine at_edge

  pure subroutine at_vertex(p, q, k, at, limit, f)
    type(convex), intent(in) :: p
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    real(c_double), intent(in) :: at(3), limit
    type(findings), intent(inout) :: f
    real(c_double) :: d(3), along, distance
    d = q%v(k, :) - at
    along = dot_product(d, p%frame(:, 3))
    if (.not. abs(along) < p%half(3) - f%slack) return
    d = along*p%frame(:, 3) - d
    distance = sqrt(dot_product(d, d))
    if (distance - p%layer > limit .or. .not. distance > f%slack) return
    if (is_bent(q, k) .and. 2*p%layer >= q%size) then ! see sphere_facet.f90
      if (.not. dot_product(q%normal(1, :), d) > f%slack) return
    else
      if (.not. leaves_vertex(q, k, d, f%slack)) return
      if (.not. pokes_out(q, k)) return
    end if
    d = d/distance
    call add(f, along*p%frame(:, 3) - (distance + p%layer)/2*d, d, distance - p%layer, int(vertex_of_b + k, c_int32_t))
  end subroutine at_vertex

end module capsule_facet
