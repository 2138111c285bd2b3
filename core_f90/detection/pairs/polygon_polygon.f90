!> Contact of two convex polygons.
module polygon_polygon
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls, solid, view_solid
  use patch_points, only: patch
  use polygon_contact, only: touch_polygons
  implicit none
  private
  public :: cairn_pair_polygon_polygon

contains

  !> Along the normal of the side along which they are farthest apart or overlap least; of corners that face each other, along
  !> the line of the nearest points. The sides that look along it, cut by each other, end in the points of contact.
  subroutine cairn_pair_polygon_polygon(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, &
                              normal, point, feature) bind(c)
    integer(c_int32_t), value :: n                      !< pairs
    type(cairn_hulls), intent(in) :: hulls
    integer(c_int32_t), intent(in) :: a(n), b(n)        !< contactors
    real(c_double), intent(in) :: between(n, 2)         !< centre of A - centre of B [m]
    real(c_double), intent(in) :: radius_a(n)           !< of the disk around A [m]
    real(c_double), intent(in) :: radius_b(n)           !< of the disk around B [m]
    real(c_double), intent(in) :: direction_b(n, 3)     !< not read
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
    integer :: i, k

    call open_hulls(hulls, view)
    do i = 1, n
      call view_solid(view, a(i), radius_a(i), p)
      call view_solid(view, b(i), radius_b(i), q)
      call touch_polygons(p, q, between(i, :), 0.0_c_double, limit(i), m, cut)
      count(i) = cut%count
      do k = 1, cut%count
        gap(k, i) = cut%gap(k)
        normal(:, k, i) = m
        point(:, k, i) = cut%x(1, k)*[-m(2), m(1)] + cut%x(3, k)*m - between(i, :)
        feature(k, i) = cut%name(k)
      end do
    end do
  end subroutine cairn_pair_polygon_polygon

end module polygon_polygon
