!> Contact of a disk with a convex polygon.
module disk_polygon
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls, solid, view_solid
  implicit none
  private
  public :: cairn_pair_disk_polygon

contains

  !> With the nearest point of the polygon; from inside, through the nearest side.
  subroutine cairn_pair_disk_polygon(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, &
                              normal, point, feature) bind(c)
    integer(c_int32_t), value :: n                      !< pairs
    type(cairn_hulls), intent(in) :: hulls
    integer(c_int32_t), intent(in) :: a(n), b(n)        !< contactors
    real(c_double), intent(in) :: between(n, 2)         !< centre of A - centre of B [m]
    real(c_double), intent(in) :: radius_a(n)           !< of the disk [m]
    real(c_double), intent(in) :: radius_b(n)           !< of the disk around B [m]
    real(c_double), intent(in) :: direction_b(n, 3)     !< not read
    real(c_double), intent(in) :: limit(n)              !< gaps above do not count [m]
    integer(c_int32_t), intent(out) :: count(n)         !< points of each pair
    real(c_double), intent(out) :: gap(hulls%most, n)   !< negative when overlapping [m]
    real(c_double), intent(out) :: normal(2, hulls%most, n) !< unit, from B to A
    real(c_double), intent(out) :: point(2, hulls%most, n)  !< middle of the gap - centre of A [m]
    integer(c_int32_t), intent(out) :: feature(hulls%most, n) !< names of the points within the pair
    type(hulls_view) :: view
    type(solid) :: q
    real(c_double) :: x(2), m(2), d(2), from(2), best, height, along, distance
    integer :: i, k, side

    call open_hulls(hulls, view)
    do i = 1, n
      call view_solid(view, b(i), radius_b(i), q)
      x = between(i, :)
      best = -huge(best)
      side = 1
      do k = 1, q%faces
        height = q%normal(k, 1)*x(1) + q%normal(k, 2)*x(2) - q%offset(k)
        if (height > best) then
          best = height
          side = k
        end if
      end do
      m = q%normal(side, :)
      distance = best
      if (best > 0) then
        from = q%v(side, :)
        d = q%v(merge(1, side + 1, side == q%vertices), :) - from
        along = dot_product(x - from, d)/dot_product(d, d)
        if (along < 0 .or. along > 1) then
          d = x - (from + merge(0, 1, along < 0)*d)
          distance = sqrt(dot_product(d, d))
          if (distance > 1e-9_c_double*q%size) m = d/distance
        end if
      end if
      count(i) = merge(1, 0, distance - radius_a(i) <= limit(i))
      gap(1, i) = distance - radius_a(i)
      normal(:, 1, i) = m
      point(:, 1, i) = -(radius_a(i) + gap(1, i)/2)*m
      feature(1, i) = 0
    end do
  end subroutine cairn_pair_disk_polygon

end module disk_polygon
