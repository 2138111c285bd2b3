!> Contact of a sphere with a convex polyhedron.
module sphere_polyhedron
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls, solid, view_solid
  implicit none
  private
  public :: cairn_pair_sphere_polyhedron

contains

  !> With the nearest point of the polyhedron; from inside, through the nearest face.
  subroutine cairn_pair_sphere_polyhedron(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, &
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
    integer(c_int32_t), intent(out) :: feature(hulls%most, n) !< keys of the points within the pair
    type(hulls_view) :: view
    type(solid) :: q
    real(c_double) :: m(3), distance
    integer :: i

    call open_hulls(hulls, view)
    do i = 1, n
      call view_solid(view, b(i), radius_b(i), q)
      call nearest_of_solid(q, between(i, :), distance, m)
      count(i) = merge(1, 0, distance - radius_a(i) <= limit(i))
      gap(1, i) = distance - radius_a(i)
      normal(:, 1, i) = m
      point(:, 1, i) = -(radius_a(i) + gap(1, i)/2)*m
      feature(1, i) = 0
    end do
  end subroutine cairn_pair_sphere_polyhedron

  !> Signed distance of a point from a polyhedron around 0, and the direction from the nearest point of its surface.
  subroutine nearest_of_solid(q, x, distance, m)
    type(solid), intent(in) :: q
    real(c_double), intent(in) :: x(3)
    real(c_double), intent(out) :: distance, m(3)
    real(c_double) :: height, best, nearest, square, d(3)
    integer :: k, face
    best = -huge(best)
    face = 1
    do k = 1, q%faces
      height = dot_product(q%normal(k, :), x) - q%offset(k)
      if (height > best) then
        best = height
        face = k
      end if
    end do
    distance = best
    m = q%normal(face, :)
    if (best <= 0) return
    nearest = huge(nearest)
    d = m
    do k = 1, q%faces
      height = dot_product(q%normal(k, :), x) - q%offset(k)
      if (height <= 0) cycle
      call nearest_of_rim(q, k, x, height, nearest, d)
      if (nearest < 0) exit
    end do
    if (nearest < 0) then ! in front of face k
      distance = height
      m = q%normal(k, :)
      return
    end if
    square = sqrt(nearest)
    distance = max(square, best)
    if (square > 1e-9_c_double*q%size) m = d/square
  end subroutine nearest_of_solid

  !> Nearest edge of a face, where it is nearer than `nearest` (a square); -1 if the point is in front of the face.
  pure subroutine nearest_of_rim(q, face, x, height, nearest, d)
    type(solid), intent(in) :: q
    integer, intent(in) :: face
    real(c_double), intent(in) :: x(3), height
    real(c_double), intent(inout) :: nearest, d(3)
    real(c_double) :: from(3), e(3), w(3), m(3), along
    integer :: k
    logical :: in_front
    m = q%normal(face, :)
    in_front = .true.
    from = q%v(q%corner_vertex(q%first_corner(face + 1)), :)
    do k = q%first_corner(face) + 1, q%first_corner(face + 1)
      e = q%v(q%corner_vertex(k), :) - from
      w = x - from
      if (m(1)*(e(2)*w(3) - e(3)*w(2)) + m(2)*(e(3)*w(1) - e(1)*w(3)) + m(3)*(e(1)*w(2) - e(2)*w(1)) < 0) then
        in_front = .false.
        along = dot_product(w, e)/dot_product(e, e)
        w = w - max(0.0_c_double, min(along, 1.0_c_double))*e
        if (dot_product(w, w) < nearest) then
          nearest = dot_product(w, w)
          d = w
        end if
      end if
      from = q%v(q%corner_vertex(k), :)
    end do
    if (in_front .and. height > 0) nearest = -1
  end subroutine nearest_of_rim

end module sphere_polyhedron
