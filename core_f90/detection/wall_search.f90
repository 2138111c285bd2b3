!> Which bounded contactors come near an unbounded one: all are asked.
module wall_search
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  implicit none
  private
  public :: cairn_plane_search, cairn_tube_search

  ! Rounding of a projection, in units of the vector projected: what is found is checked again by the narrow phase.
  real(c_double), parameter :: slack = 16*epsilon(1.0_c_double)

contains

  !> Those of the listed contactors that reach the half space behind a plane. `found` is their number, the first
  !> `capacity` of them are in `near`.
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
    integer(c_int64_t) :: k
    real(c_double) :: d(dim)

    found = 0
    do k = 1, n
      d = centre(:, listed(k)) - origin
      if (dot_product(d, normal) > reach(listed(k)) + margin + slack*sum(abs(d))) cycle
      found = found + 1
      if (found <= capacity) near(found) = listed(k)
    end do
  end subroutine cairn_plane_search

  !> Those of the listed contactors that reach the wall of a tube, or what is outside it, taken as endless.
  pure subroutine cairn_tube_search(n, listed, centre, reach, origin, axis, radius, margin, capacity, near, found) bind(c)
    integer(c_int64_t), value :: n                    !< contactors asked
    integer(c_int32_t), intent(in) :: listed(n)       !< their numbers
    real(c_double), intent(in) :: centre(3, 0:*)      !< of all contactors [m]
    real(c_double), intent(in) :: reach(0:*)          !< of all contactors, with their share of the margin [m]
    real(c_double), intent(in) :: origin(3)           !< a point of the axis [m]
    real(c_double), intent(in) :: axis(3)             !< unit
    real(c_double), value :: radius                   !< of the tube [m]
    real(c_double), value :: margin                   !< the tube's share of the margin [m]
    integer(c_int64_t), value :: capacity             !< of near
    integer(c_int32_t), intent(inout) :: near(capacity)
    integer(c_int64_t), intent(out) :: found
    integer(c_int64_t) :: k
    real(c_double) :: d(3), r(3), clear

    found = 0
    do k = 1, n
      d = centre(:, listed(k)) - origin
      r = d - dot_product(d, axis)*axis
      clear = radius - reach(listed(k)) - margin - slack*(sum(abs(d)) + radius)
      if (clear > 0) then
        if (dot_product(r, r) < clear*clear) cycle
      end if
      found = found + 1
      if (found <= capacity) near(found) = listed(k)
    end do
  end subroutine cairn_tube_search

end module wall_search
