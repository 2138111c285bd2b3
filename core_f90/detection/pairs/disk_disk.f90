!> Contact of two disks.
module disk_disk
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use separation, only: separate
  implicit none
  private
  public :: cairn_pair_disk_disk

contains

  !> On the line of centres. Concentric disks touch along the first axis.
  pure subroutine cairn_pair_disk_disk(n, between, radius_a, radius_b, direction_b, gap, normal, point, status) bind(c)
    integer(c_int32_t), value :: n                      !< pairs
    real(c_double), intent(in) :: between(n, 2)         !< centre of A - centre of B [m]
    real(c_double), intent(in) :: radius_a(n)           !< of the disk [m]
    real(c_double), intent(in) :: radius_b(n)           !< of the other disk [m]
    real(c_double), intent(in) :: direction_b(n, 3)     !< not read
    real(c_double), intent(out) :: gap(n)               !< negative when overlapping [m]
    real(c_double), intent(out) :: normal(n, 2)         !< unit, from B to A
    real(c_double), intent(out) :: point(n, 2)          !< middle of the gap - centre of A [m]
    integer(c_int32_t), intent(out) :: status(n)        !< 0
    integer(c_int32_t) :: i, k
    real(c_double) :: distance(n)
    call separate(n, 2, between, distance, normal)
    do i = 1, n
      gap(i) = distance(i) - (radius_a(i) + radius_b(i))
      status(i) = 0
    end do
    do k = 1, 2
      do i = 1, n
        point(i, k) = -(radius_a(i) + gap(i)/2)*normal(i, k)
      end do
    end do
  end subroutine cairn_pair_disk_disk

end module disk_disk
