!> Contact of a convex polygon with a half plane.
module polygon_half_plane
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls, solid, view_solid
  use patch_points, only: patch
  use polygon_contact, only: touch_line
  implicit none
  private
  public :: cairn_pair_polygon_half_plane

contains

  !> Along the normal of the half plane: the ends of the side that looks at it, and the lowest corner.
  subroutine cairn_pair_polygon_half_plane(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, &
                              normal, point, feature) bind(c)
    integer(c_int32_t), value :: n                      !< pairs
    type(cairn_hulls), intent(in) :: hulls
    integer(c_int32_t), intent(in) :: a(n), b(n)        !< contactors
    real(c_double), intent(in) :: between(n, 2)         !< centre of A - centre of B [m]
    real(c_double), intent(in) :: radius_a(n)           !< of the disk around A [m]
    real(c_double), intent(in) :: radius_b(n)           !< not read
    real(c_double), intent(in) :: direction_b(n, 3)     !< normal out of the solid, unit; the last is not read
    real(c_double), intent(in) :: limit(n)              !< gaps above do not count [m]
    integer(c_int32_t), intent(out) :: count(n)         !< points of each pair
    real(c_double), intent(out) :: gap(hulls%most, n)   !< negative when overlapping [m]
    real(c_double), intent(out) :: normal(2, hulls%most, n) !< unit, from B to A
    real(c_double), intent(out) :: point(2, hulls%most, n)  !< middle of the gap - centre of A [m]
    integer(c_int32_t), intent(out) :: feature(hulls%most, n) !< names of the points within the pair
    type(hulls_view) :: view
    type(solid) :: p
    type(patch) :: cut
    real(c_double) :: m(2)
    integer :: i, k

    call open_hulls(hulls, view)
    do i = 1, n
      call view_solid(view, a(i), radius_a(i), p)
      m = direction_b(i, 1:2)
      call touch_line(p, between(i, :), m, limit(i), cut)
      count(i) = cut%count
      do k = 1, cut%count
        gap(k, i) = cut%gap(k)
        normal(:, k, i) = m
        point(:, k, i) = cut%x(1, k)*[-m(2), m(1)] + cut%x(3, k)*m - between(i, :)
        feature(k, i) = cut%name(k)
      end do
    end do
  end subroutine cairn_pair_polygon_half_plane

end module polygon_half_plane
