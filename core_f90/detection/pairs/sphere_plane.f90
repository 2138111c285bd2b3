!> Contact of a sphere with a half space under a plane.
module sphere_plane
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  implicit none
  private
  public :: cairn_pair_sphere_plane

contains

  !> Along the normal of the plane.
  pure subroutine cairn_pair_sphere_plane(n, between, radius_a, radius_b, direction_b, gap, normal, point, status) bind(c)
    integer(c_int32_t), value :: n                      !< pairs
    real(c_double), intent(in) :: between(n, 3)         !< centre of A - centre of B [m]
    real(c_double), intent(in) :: radius_a(n)           !< of the sphere [m]
    real(c_double), intent(in) :: radius_b(n)           !< not read
    real(c_double), intent(in) :: direction_b(n, 4)     !< normal out of the solid, unit; the last is not read
    real(c_double), intent(out) :: gap(n)               !< negative when overlapping [m]
    real(c_double), intent(out) :: normal(n, 3)         !< unit, from B to A
    real(c_double), intent(out) :: point(n, 3)          !< middle of the gap - centre of A [m]
    integer(c_int32_t), intent(out) :: status(n)        !< 0
    integer(c_int32_t) :: i, k
    do i = 1, n
      gap(i) = between(i, 1)*direction_b(i, 1) + between(i, 2)*direction_b(i, 2) + between(i, 3)*direction_b(i, 3) - radius_a(i)
      status(i) = 0
    end do
    do k = 1, 3
      do i = 1, n
        normal(i, k) = direction_b(i, k)
        point(i, k) = -(radius_a(i) + gap(i)/2)*normal(i, k)
      end do
    end do
  end subroutine cairn_pair_sphere_plane

end module sphere_plane
