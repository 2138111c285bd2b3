!> Contact of a convex polygon with a segment: a bar with round ends.
module polygon_segment
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls, solid, view_solid
  use patch_points, only: patch
  use polygon_contact, only: touch_polygons
  implicit none
  private
  public :: cairn_pair_polygon_segment

contains

  !> With the axis of the bar as with a polygon of two corners, less the radius.
  subroutine cairn_pair_polygon_segment(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, &
                              normal, point, feature) bind(c)
    integer(c_int32_t), value :: n                      !< pairs
    type(cairn_hulls), intent(in) :: hulls
    integer(c_int32_t), intent(in) :: a(n), b(n)        !< contactors
    real(c_double), intent(in) :: between(n, 2)         !< centre of A - centre of B [m]
    real(c_double), intent(in) :: radius_a(n)           !< of the disk around A [m]
    real(c_double), intent(in) :: radius_b(n)           !< of the bar and its round ends [m]
    real(c_double), intent(in) :: direction_b(n, 3)     !< unit axis of the bar, then half the length of the axis [m]
    real(c_double), intent(in) :: limit(n)              !< gaps above do not count [m]
    integer(c_int32_t), intent(out) :: count(n)         !< points of each pair
    real(c_double), intent(out) :: gap(hulls%most, n)   !< negative when overlapping [m]
    real(c_double), intent(out) :: normal(2, hulls%most, n) !< unit, from B to A
    real(c_double), intent(out) :: point(2, hulls%most, n)  !< middle of the gap - centre of A [m]
    integer(c_int32_t), intent(out) :: feature(hulls%most, n) !< names of the points within the pair
    type(hulls_view) :: view
    type(solid) :: p, q
    type(patch) :: cut
    real(c_double) :: m(2)
    real(c_double), target :: ends(2, 2), across(2, 2), offset(2)
    integer :: i, k

    call open_hulls(hulls, view)
    q%vertices = 2
    q%faces = 2
    offset = 0
    q%v => ends
    q%normal => across
    q%offset => offset
    do i = 1, n
      call view_solid(view, a(i), radius_a(i), p)
      q%size = direction_b(i, 3)
      ends(1, :) = -direction_b(i, 3)*direction_b(i, 1:2)
      ends(2, :) = -ends(1, :)
      across(1, :) = [direction_b(i, 2), -direction_b(i, 1)]
      across(2, :) = -across(1, :)
      call touch_polygons(p, q, between(i, :), radius_b(i), limit(i), m, cut)
      count(i) = cut%count
      do k = 1, cut%count
        gap(k, i) = cut%gap(k)
        normal(:, k, i) = m
        point(:, k, i) = cut%x(1, k)*[-m(2), m(1)] + cut%x(3, k)*m - between(i, :)
        feature(k, i) = cut%name(k)
      end do
    end do
  end subroutine cairn_pair_polygon_segment

end module polygon_segment
