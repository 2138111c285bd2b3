!> Contact of a sphere with one triangle of a surface that is solid behind it.
module sphere_facet
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls, solid, view_solid
  use facet_view, only: after, edge_from, inside_of, is_bent, on_edge, vertex_from
  implicit none
  private
  public :: cairn_pair_sphere_facet, nearest_of_facet

  ! Features of declared pairs until the caller knows whether another facet has the point: see cairn/core.h.
  integer(c_int32_t), parameter :: own = -2, spare = -1
  ! Distance beyond a rim up to which a bond of a point shears in the plane of the facet instead of opening, relative to the
  ! bounding ball of the facet.
  real(c_double), parameter :: past_a_rim = 0.25_c_double
  real(c_double), parameter :: over_it = 1 - 5e-5_c_double ! cosine of a contact over a facet and that facet

contains

  !> Only where the nearest point of the whole surface around is on this facet: a point of an edge or a vertex counts once, for
  !> the facet that owns it, and not where the surface beyond is nearer. So a sphere rolls over edges of a plane without a jolt.
  !> A declared pair, whose limit has no end, has a contact wherever the point is: a bond may not end because a point passes
  !> a hair behind the rim of a surface, where no facet has it. That one is spare where another facet goes on with it.
  subroutine cairn_pair_sphere_facet(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, &
                                     normal, point, feature) bind(c)
    integer(c_int32_t), value :: n                      !< pairs
    type(cairn_hulls), intent(in) :: hulls
    integer(c_int32_t), intent(in) :: a(n), b(n)        !< contactors
    real(c_double), intent(in) :: between(n, 3)         !< centre of A - centre of B [m]
    real(c_double), intent(in) :: radius_a(n)           !< of the sphere [m]
    real(c_double), intent(in) :: radius_b(n)           !< of the ball around B [m]
    real(c_double), intent(in) :: direction_b(n, 4)     !< not read
    real(c_double), intent(in) :: limit(n)              !< gaps above do not count [m]
    integer(c_int32_t), intent(out) :: count(n)         !< points of each pair
    real(c_double), intent(out) :: gap(hulls%most, n)   !< negative when overlapping [m]
    real(c_double), intent(out) :: normal(3, hulls%most, n) !< unit, from B to A
    real(c_double), intent(out) :: point(3, hulls%most, n)  !< middle of the gap - centre of A [m]
    integer(c_int32_t), intent(out) :: feature(hulls%most, n) !< 0; of declared pairs own or spare
    type(hulls_view) :: view
    type(solid) :: q
    real(c_double) :: m(3), distance
    integer :: i
    logical :: found

    call open_hulls(hulls, view)
    do i = 1, n
      call view_solid(view, b(i), radius_b(i), q)
      call nearest_of_facet(q, between(i, :), radius_a(i) + limit(i), found, distance, m)
      feature(1, i) = 0
      if (limit(i) >= huge(distance)) then
        feature(1, i) = merge(own, spare, found)
        if (.not. found) call nearest_of_border(q, between(i, :), 0.0_c_double, distance, m)
        if (.not. radius_a(i) > 0 .and. (.not. found .or. distance > 0) .and. &
            dot_product(m, q%normal(1, :)) < over_it) call nearest_of_border(q, between(i, :), past_a_rim*q%size, distance, m)
        found = .true.
      end if
      count(i) = merge(1, 0, found .and. distance - radius_a(i) <= limit(i))
      gap(1, i) = distance - radius_a(i)
      normal(:, 1, i) = m
      point(:, 1, i) = -(radius_a(i) + gap(1, i)/2)*m
      if (limit(i) < huge(distance) .and. 2*radius_a(i) >= q%size) &
        call add_bent(q, between(i, :), radius_a(i), limit(i), count(i), gap(:, i), normal(:, :, i), point(:, :, i), &
                      feature(:, i))
    end do
  end subroutine cairn_pair_sphere_facet

  !> Adds contacts at vertices of this facet where a mesh is bent: a sphere larger than the cells is borne by them as well as by the
  !> nearest point of the surface.
  pure subroutine add_bent(q, x, radius, limit, count, gap, normal, point, feature)
    type(solid), intent(in) :: q
    real(c_double), intent(in) :: x(3), radius, limit
    integer(c_int32_t), intent(inout) :: count, feature(:)
    real(c_double), intent(inout) :: gap(:), normal(:, :), point(:, :)
    real(c_double) :: d(3), distance
    integer :: k, nearest
    if (q%edge(4, 4) == 0) return
    nearest = count
    do k = 1, 3
      d = x - q%v(k, :)
      distance = sqrt(dot_product(d, d))
      if (distance - radius > limit .or. .not. dot_product(q%normal(1, :), d) > on_edge*q%size) cycle
      if (.not. is_bent(q, k)) cycle
      d = d/distance
      if (nearest == 1) then
        if (abs(gap(1) - (distance - radius)) <= on_edge*q%size .and. maxval(abs(normal(:, 1) - d)) <= on_edge) cycle
      end if
      count = count + 1
      gap(count) = distance - radius
      normal(:, count) = d
      point(:, count) = -(radius + gap(count)/2)*d
      feature(count) = k
    end do
  end subroutine add_bent

  !> Signed distance of a point and the direction from the nearest point of the facet, if it is the nearest around.
  pure subroutine nearest_of_facet(q, x, depth, found, distance, m)
    type(solid), intent(in) :: q
    real(c_double), intent(in) :: x(3), depth !< how far behind the facet the point may be [m]
    logical, intent(out) :: found
    real(c_double), intent(out) :: distance, m(3)
    real(c_double) :: slack, d(3)
    integer :: k
    logical :: outside, valley
    m = q%normal(1, :)
    distance = dot_product(m, x) - q%offset(1)
    slack = on_edge*q%size
    found = distance >= -depth
    if (.not. found) return
    do k = 1, 3
      found = found .and. inside_of(q, k, after(after(k)), x) > slack
    end do
    if (found) return
    valley = .false.
    outside = .false.
    d = 0
    do k = 1, 3
      if (q%edge(3, k) == 0) cycle
      call try_edge(q, k, x, slack, found, outside, d)
      valley = q%edge(4, k) > 0
      if (found) exit
    end do
    do k = 1, 3
      if (found) exit
      valley = .false.
      if (q%edge(3, 3 + k) == 0) cycle
      d = x - q%v(k, :)
      call vertex_from(q, k, d, slack, found, outside)
    end do
    if (.not. found) return
    if (all(abs(d - distance*m) <= 2*slack)) return ! over the edge: as deep as from the plane, with its sign
    distance = sqrt(dot_product(d, d))
    m = d/distance
    if (outside) return
    distance = -distance ! under a valley, where neither facet has the point; at a border there is nothing
    m = -m
    found = valley .and. distance >= -depth
  end subroutine nearest_of_facet

  !> Distance of a point that is not over the facet from its edges, and the direction from there. A point behind the plane is
  !> taken as one in it: beside a convex rim it neither touches nor opens by how deep it is.
  pure subroutine nearest_of_border(q, x, longer, distance, m)
    type(solid), intent(in) :: q
    real(c_double), intent(in) :: x(3)
    real(c_double), intent(in) :: longer !< the facet is taken as that much longer beyond its edges [m]
    real(c_double), intent(out) :: distance, m(3)
    real(c_double) :: e(3), w(3), d(3), height, square, beyond
    integer :: k
    height = dot_product(q%normal(1, :), x) - q%offset(1)
    square = huge(square)
    d = 0
    do k = 1, 3
      e = q%v(after(k), :) - q%v(k, :)
      w = x - height*q%normal(1, :) - q%v(k, :)
      w = w - min(max(dot_product(w, e)/dot_product(e, e), 0.0_c_double), 1.0_c_double)*e
      if (dot_product(w, w) >= square) cycle
      square = dot_product(w, w)
      d = w
    end do
    m = q%normal(1, :)
    distance = height
    beyond = sqrt(square)
    if (beyond <= 2*on_edge*q%size + longer) return ! over the edge: as deep as from the plane
    d = (1 - longer/beyond)*d + max(height, 0.0_c_double)*m
    distance = sqrt(dot_product(d, d))
    m = d/distance
  end subroutine nearest_of_border

  !> An edge is nearest where it is so to both of its facets; the point is outside where it is in front of one of them.
  pure subroutine try_edge(q, k, x, slack, found, outside, d)
    type(solid), intent(in) :: q
    integer, intent(in) :: k
    real(c_double), intent(in) :: x(3), slack
    logical, intent(out) :: found, outside
    real(c_double), intent(inout) :: d(3) !< from the nearest point of the edge [m]
    real(c_double) :: e(3), w(3), along, length
    w = x - q%v(k, :)
    call edge_from(q, k, w, slack, found, outside)
    if (.not. found) return
    e = q%v(after(k), :) - q%v(k, :)
    length = sqrt(dot_product(e, e))
    along = dot_product(w, e)/length
    found = along > slack .and. along < length - slack
    d = w - along/length*e
  end subroutine try_edge

end module sphere_facet
