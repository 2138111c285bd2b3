!> Contact of two spheres.
module sphere_sphere
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use separation, only: separate
  implicit none
  private
  public :: cairn_pair_sphere_sphere

contains

  !> On the line of centres. Concentric spheres touch along the first axis.
  pure subroutine cairn_pair_sphere_sphere(n, between, radius_a, radius_b, direction_b, gap, normal, point, status) bind(c)
    integer(c_int32_t), value :: n                      !< pairs
    real(c_double), intent(in) :: between(n, 3)         !< centre of A - centre of B [m]
    real(c_double), intent(in) :: radius_a(n)           !< of the sphere [m]
    real(c_double), intent(in) :: radius_b(n)           !< of the other sphere [m]
    real(c_double), intent(in) :: direction_b(n, 4)     !< not read
    real(c_double), intent(out) :: gap(n)               !< negative when overlapping [m]
    real(c_double), intent(out) :: normal(n, 3)         !< unit, from B to A
    real(c_double), intent(out) :: point(n, 3)          !< middle of the gap - centre of A [m]
    integer(c_int32_t), intent(out) :: status(n)        !< 0
    integer(c_int32_t) :: i, k
    real(c_double) :: distance(n)
    call separate(n, 3, between, distance, normal)
    do i = 1, n
      gap(i) = distance(i) - (radius_a(i) + radius_b(i))
      status(i) = 0
    end do
    do k = 1, 3
      do i = 1, n
        point(i, k) = -(radius_a(i) + gap(i)/2)*normal(i, k)
      end do
    end do
  end subroutine cairn_pair_sphere_sphere

end module sphere_sphere
