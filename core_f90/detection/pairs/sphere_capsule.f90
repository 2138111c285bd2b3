!> Contact of a sphere with a capsule.
module sphere_capsule
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls
  use convex_shape, only: convex, see_capsule, see_point
  use convex_contact, only: touch
  implicit none
  private
  public :: cairn_pair_sphere_capsule

contains

  !> With the nearest point of the axis.
  subroutine cairn_pair_sphere_capsule(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, &
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
    integer(c_int32_t), intent(out) :: feature(hulls%most, n) !< names of the points within the pair
    type(hulls_view) :: view
    type(convex) :: p, q
    integer :: i

    call open_hulls(hulls, view)
    do i = 1, n
      call see_point(radius_a(i), p)
      call see_capsule(view, b(i), radius_b(i), q)
      call touch(p, q, between(i, :), limit(i), view%most, count(i), gap(:, i), normal(:, :, i), point(:, :, i), feature(:, i))
    end do
  end subroutine cairn_pair_sphere_capsule

end module sphere_capsule
