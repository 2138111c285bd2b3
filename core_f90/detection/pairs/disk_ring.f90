!> Contact of a disk with a ring seen from inside: a drum in 2D.
module disk_ring
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use separation, only: separate
  implicit none
  private
  public :: cairn_pair_disk_ring

contains

  !> Towards the centre; all outside is solid. At the centre the normal is the first axis.
  pure subroutine cairn_pair_disk_ring(n, between, radius_a, radius_b, direction_b, gap, normal, point, status) bind(c)
    integer(c_int32_t), value :: n                      !< pairs
    real(c_double), intent(in) :: between(n, 2)         !< centre of A - centre of B [m]
    real(c_double), intent(in) :: radius_a(n)           !< of the disk [m]
    real(c_double), intent(in) :: radius_b(n)           !< of the ring, inside [m]
    real(c_double), intent(in) :: direction_b(n, 3)     !< not read
    real(c_double), intent(out) :: gap(n)               !< negative when overlapping [m]
    real(c_double), intent(out) :: normal(n, 2)         !< unit, from B to A
    real(c_double), intent(out) :: point(n, 2)          !< middle of the gap - centre of A [m]
    integer(c_int32_t), intent(out) :: status(n)        !< 2: the disk is wider than the ring
    real(c_double) :: rho(n), outward(n, 2)
    integer(c_int32_t) :: i, k
    call separate(n, 2, between, rho, outward)
    do i = 1, n
      gap(i) = radius_b(i) - rho(i) - radius_a(i)
      status(i) = merge(2, 0, radius_a(i) > radius_b(i))
    end do
    do k = 1, 2
      do i = 1, n
        normal(i, k) = -outward(i, k)
        point(i, k) = -(radius_a(i) + gap(i)/2)*normal(i, k)
      end do
    end do
  end subroutine cairn_pair_disk_ring

end module disk_ring
