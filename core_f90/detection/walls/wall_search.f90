!> Broad phase of walls: tests all contactors against an unbounded wall, and the grid's candidates against a long one, which the
!> grid took for a disk.
module wall_search
  use, intrinsic :: iso_c_binding, only: c_double, c_int16_t, c_int32_t, c_int64_t
  implicit none
  private
  public :: cairn_plane_search, cairn_tube_search, cairn_bar_search

  ! Rounding of a projection, in units of the vector projected; the narrow phase checks the pairs again.
  real(c_double), parameter :: slack = 16*epsilon(1.0_c_double)
  integer(c_int32_t), parameter :: own_image = 512 + 1024*(512 + 1024*512)

contains

  !> Finds the listed contactors that reach the half space behind a plane. `found`: their number; the first `capacity` of them are
  !> in `near`.
  pure subroutine cairn_plane_search(dim, n, listed, centre, reach, origin, normal, margin, capacity, near, found) bind(c)
    integer(c_int32_t), value :: dim                  !< 2 or 3
    integer(c_int64_t), value :: n                    !< contactors asked
    integer(c_int32_t), intent(in) :: listed(n)       !< their numbers
    real(c_double), intent(in) :: centre(dim, 0:*)    !< of all contactors [m]
    real(c_double), intent(in) :: reach(0:*)          !< of all contactors, with their share of the margin [m]
    real(c_double), intent(in) :: origin(dim)         !< a point of the plane [m]
    real(c_double), intent(in) :: normal(dim)         !< unit, out of the solid
    real(c_double), value :: margin                   !< the plane's share of the margin [m]
    integer(c_int64_t), value :: capacity             !< of near
    integer(c_int32_t), intent(inout) :: near(capacity)
    integer(c_int64_t), intent(out) :: found
    integer, parameter :: some = 512 !< at a time: the distances are found without a branch, few are near
    real(c_double) :: clear(some), d(3), o(3), m(3)
    integer(c_int64_t) :: k, begin
    integer(c_int32_t) :: i, j, count

    o = 0
    m = 0
    o(:dim) = origin
    m(:dim) = normal
    found = 0
    do begin = 0, n - 1, some
      count = int(min(int(some, c_int64_t), n - begin), c_int32_t)
      if (dim == 2) then
        !$omp simd private(j, d)
        do i = 1, count
          j = listed(begin + i)
          d(1) = centre(1, j) - o(1)
          d(2) = centre(2, j) - o(2)
          clear(i) = d(1)*m(1) + d(2)*m(2) - reach(j) - margin - slack*(abs(d(1)) + abs(d(2)))
        end do
      else
        !$omp simd private(j, d)
        do i = 1, count
          j = listed(begin + i)
          d(1) = centre(1, j) - o(1)
          d(2) = centre(2, j) - o(2)
          d(3) = centre(3, j) - o(3)
          clear(i) = d(1)*m(1) + d(2)*m(2) + d(3)*m(3) - reach(j) - margin - slack*(abs(d(1)) + abs(d(2)) + abs(d(3)))
        end do
      end if
      do i = 1, count
        if (clear(i) > 0) cycle
        k = found + 1
        found = k
        if (k <= capacity) near(k) = listed(begin + i)
      end do
    end do
  end subroutine cairn_plane_search

  !> Finds the listed contactors that reach the wall of a tube (in 2D of a ring), or its outside, taken as endless.
  pure subroutine cairn_tube_search(dim, n, listed, centre, reach, origin, axis, radius, margin, capacity, near, found) bind(c)
    integer(c_int32_t), value :: dim                  !< 2 or 3
    integer(c_int64_t), value :: n                    !< contactors asked
    integer(c_int32_t), intent(in) :: listed(n)       !< their numbers
    real(c_double), intent(in) :: centre(dim, 0:*)    !< of all contactors [m]
    real(c_double), intent(in) :: reach(0:*)          !< of all contactors, with their share of the margin [m]
    real(c_double), intent(in) :: origin(dim)         !< a point of the axis [m]
    real(c_double), intent(in) :: axis(dim)           !< unit; in 2D not read
    real(c_double), value :: radius                   !< of the tube [m]
    real(c_double), value :: margin                   !< the tube's share of the margin [m]
    integer(c_int64_t), value :: capacity             !< of near
    integer(c_int32_t), intent(inout) :: near(capacity)
    integer(c_int64_t), intent(out) :: found
    integer(c_int64_t) :: k
    real(c_double) :: d(dim), r(dim), clear

    found = 0
    do k = 1, n
      d = centre(:, listed(k)) - origin
      r = d
      if (dim == 3) r = d - dot_product(d, axis)*axis
      clear = radius - reach(listed(k)) - margin - slack*(sum(abs(d)) + radius)
      if (clear > 0) then
        if (dot_product(r, r) < clear*clear) cycle
      end if
      found = found + 1
      if (found <= capacity) near(found) = listed(k)
    end do
  end subroutine cairn_tube_search

  !> Keeps pairs of a bar and another contactor that reaches it; works in place.
  pure subroutine cairn_bar_search(n, a, b, image, bar, shape, centre, direction, reach, vectors, kept) bind(c)
    integer(c_int64_t), value :: n                    !< pairs
    integer(c_int32_t), intent(inout) :: a(n), b(n)   !< contactors
    integer(c_int32_t), intent(inout) :: image(n)     !< of b seen from a
    integer(c_int32_t), value :: bar                  !< the shape of bars
    integer(c_int16_t), intent(in) :: shape(0:*)      !< of the contactors
    real(c_double), intent(in) :: centre(2, 0:*)      !< of the contactors [m]
    real(c_double), intent(in) :: direction(3, 0:*)   !< axis in space, then half length [m]
    real(c_double), intent(in) :: reach(0:*)          !< of the contactors, with half length and margin [m]
    real(c_double), intent(in) :: vectors(3, 3)       !< of the cell, in columns [m]
    integer(c_int64_t), intent(out) :: kept
    integer(c_int64_t) :: k
    integer(c_int32_t) :: j
    real(c_double) :: d(2), axis(2), along, across, limit

    kept = 0
    do k = 1, n
      if (shape(a(k)) == bar .neqv. shape(b(k)) == bar) then
        d = centre(:, a(k)) - centre(:, b(k))
        if (image(k) /= own_image .and. image(k) >= 0) then
          d = d - (iand(image(k), 1023) - 512)*vectors(1:2, 1) - (iand(shiftr(image(k), 10), 1023) - 512)*vectors(1:2, 2)
        end if
        j = merge(a(k), b(k), shape(a(k)) == bar)
        axis = direction(1:2, j)
        along = max(0.0_c_double, abs(dot_product(d, axis)) - direction(3, j))
        across = d(1)*axis(2) - d(2)*axis(1)
        limit = reach(a(k)) + reach(b(k)) - direction(3, j) + slack*(sum(abs(d)) + direction(3, j))
        if (along > limit .or. abs(across) > limit) cycle
      end if
      kept = kept + 1
      a(kept) = a(k)
      b(kept) = b(k)
      image(kept) = image(k)
    end do
  end subroutine cairn_bar_search

end module wall_search
