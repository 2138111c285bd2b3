!> The contact of any two shapes that convex_shape can see, and of one with a half space under a plane: rows of pairs.def alone.
!> The line of the nearest points gives the normal; against a plane it is the plane's own. Sides, ends and faces that lie along
!> each other touch at several points: up to two with a capsule, four with a cylinder, one with a sphere or superquadric.
module convex_pair
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls
  use convex_shape, only: convex, is_half_space, see
  use convex_contact, only: touch, touch_plane
  implicit none
  private
  public :: cairn_pair_convex

contains

  subroutine cairn_pair_convex(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, normal, point, &
                               feature) bind(c)
    integer(c_int32_t), value :: n                      !< pairs
    type(cairn_hulls), intent(in) :: hulls              !< with the convex kinds of A and B
    integer(c_int32_t), intent(in) :: a(n), b(n)        !< contactors
    real(c_double), intent(in) :: between(n, 3)         !< centre of A - centre of B [m]
    real(c_double), intent(in) :: radius_a(n)           !< of the ball around A [m]
    real(c_double), intent(in) :: radius_b(n)           !< of the ball around B [m]; not read of half spaces
    real(c_double), intent(in) :: direction_b(n, 4)     !< of half spaces: normal out of the solid, unit; the last is not read
    real(c_double), intent(in) :: limit(n)              !< gaps above do not count [m]
    integer(c_int32_t), intent(out) :: count(n)         !< points of each pair
    real(c_double), intent(out) :: gap(hulls%most, n)   !< negative when overlapping [m]
    real(c_double), intent(out) :: normal(3, hulls%most, n) !< unit, from B to A
    real(c_double), intent(out) :: point(3, hulls%most, n)  !< middle of the gap - centre of A [m]
    integer(c_int32_t), intent(out) :: feature(hulls%most, n) !< names of the points within the pair
    type(hulls_view) :: view
    type(convex) :: p, q
    integer :: i

    call open_hulls(hulls, view)
    if (hulls%seen_b == is_half_space) then
      do i = 1, n
        call see(view, hulls%seen_a, a(i), radius_a(i), p)
        call touch_plane(p, between(i, :), direction_b(i, 1:3), limit(i), view%most, count(i), gap(:, i), normal(:, :, i), &
                         point(:, :, i), feature(:, i))
      end do
    else
      do i = 1, n
        call see(view, hulls%seen_a, a(i), radius_a(i), p)
        call see(view, hulls%seen_b, b(i), radius_b(i), q)
        call touch(p, q, between(i, :), limit(i), view%most, count(i), gap(:, i), normal(:, :, i), point(:, :, i), feature(:, i))
      end do
    end if
  end subroutine cairn_pair_convex

end module convex_pair
