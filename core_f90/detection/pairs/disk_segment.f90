!> Contact of a disk with a segment: a bar with round ends.
module disk_segment
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use separation, only: separate
  implicit none
  private
  public :: cairn_pair_disk_segment

contains

  !> With the nearest point of the axis of the bar. A disk centred on the axis touches across it.
  pure subroutine cairn_pair_disk_segment(n, between, radius_a, radius_b, direction_b, gap, normal, point, status) bind(c)
    integer(c_int32_t), value :: n                      !< pairs
    real(c_double), intent(in) :: between(n, 2)         !< centre of A - centre of B [m]
    real(c_double), intent(in) :: radius_a(n)           !< of the disk [m]
    real(c_double), intent(in) :: radius_b(n)           !< of the bar and its round ends [m]
    real(c_double), intent(in) :: direction_b(n, 3)     !< unit axis of the bar, then half the length of the axis [m]
    real(c_double), intent(out) :: gap(n)               !< negative when overlapping [m]
    real(c_double), intent(out) :: normal(n, 2)         !< unit, from B to A
    real(c_double), intent(out) :: point(n, 2)          !< middle of the gap - centre of A [m]
    integer(c_int32_t), intent(out) :: status(n)        !< 0
    integer(c_int32_t) :: i
    real(c_double) :: along, axis(2), distance(n), from_axis(n, 2), direction(n, 2)
    ! Components from the nearest point of the axis: across the bar, then along it, which is 0 except at the ends. They are computed
    ! separately, so that a large distance along the bar costs no digits across it.
    do i = 1, n
      axis = direction_b(i, 1:2)
      along = between(i, 1)*axis(1) + between(i, 2)*axis(2)
      from_axis(i, 1) = between(i, 2)*axis(1) - between(i, 1)*axis(2)
      from_axis(i, 2) = along - max(-direction_b(i, 3), min(along, direction_b(i, 3)))
    end do
    call separate(n, 2, from_axis, distance, direction)
    do i = 1, n
      axis = direction_b(i, 1:2)
      normal(i, 1) = -direction(i, 1)*axis(2) + direction(i, 2)*axis(1)
      normal(i, 2) = direction(i, 1)*axis(1) + direction(i, 2)*axis(2)
      gap(i) = distance(i) - (radius_a(i) + radius_b(i))
      point(i, 1) = -(radius_a(i) + gap(i)/2)*normal(i, 1)
      point(i, 2) = -(radius_a(i) + gap(i)/2)*normal(i, 2)
      status(i) = 0
    end do
  end subroutine cairn_pair_disk_segment

end module disk_segment
