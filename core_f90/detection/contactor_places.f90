!> Where the contactors stand: centre, direction and reach of each, from the configuration of the bodies.
module contactor_places
  use, intrinsic :: iso_c_binding, only: c_double, c_int16_t, c_int32_t, c_int64_t
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none
  private
  public :: cairn_contactor_centres, cairn_contactor_directions, cairn_contactor_reach

contains

  !> Centres of contactors first to last-1. `not_finite` is the first of them whose centre is no finite number, else -1.
  pure subroutine cairn_contactor_centres(dim, first, last, body, position, has_offset, offset, has_rotation, rotation, &
                                          centre, not_finite) bind(c)
    integer(c_int32_t), value :: dim                      !< 2 or 3
    integer(c_int64_t), value :: first, last              !< contactors to treat
    integer(c_int32_t), intent(in) :: body(0:last - 1)    !< body that carries the contactor
    real(c_double), intent(in) :: position(dim, 0:*)      !< of the bodies [m]
    integer(c_int32_t), value :: has_offset               !< 0: offset is not read
    real(c_double), intent(in) :: offset(dim, 0:*)        !< of the contactors, in the axes of the body [m]
    integer(c_int32_t), value :: has_rotation             !< 0: rotation is not read
    real(c_double), intent(in) :: rotation(3*dim - 5, 0:*) !< angle [rad] or unit quaternion (w, x, y, z)
    real(c_double), intent(inout) :: centre(dim, 0:last - 1) !< [m]
    integer(c_int64_t), intent(out) :: not_finite         !< contactor
    integer(c_int64_t) :: i
    real(c_double) :: trouble

    trouble = 0
    do i = first, last - 1
      centre(:, i) = position(:, body(i))
      if (has_offset /= 0) then
        if (.not. any(abs(offset(:, i)) > 0)) then ! most contactors stand where their body does
          continue
        else if (has_rotation == 0) then
          centre(:, i) = centre(:, i) + offset(:, i)
        else if (dim == 2) then
          centre(:, i) = centre(:, i) + turned_2d(rotation(1, body(i)), offset(:, i))
        else
          centre(:, i) = centre(:, i) + turned_3d(rotation(:, body(i)), offset(:, i))
        end if
      end if
      ! x - x is 0 for every finite x, and not a number otherwise
      trouble = trouble + (centre(1, i) - centre(1, i)) + (centre(2, i) - centre(2, i)) + (centre(dim, i) - centre(dim, i))
    end do
    not_finite = -1
    if (abs(trouble) <= 0) return ! a NaN compares false and goes on
    do i = last - 1, first, -1
      if (.not. all(ieee_is_finite(centre(:, i)))) not_finite = i
    end do
  end subroutine cairn_contactor_centres

  !> Directions in space of the contactors, then their half length.
  pure subroutine cairn_contactor_directions(dim, first, last, body, direction, has_rotation, rotation, turned) bind(c)
    integer(c_int32_t), value :: dim                      !< 2 or 3
    integer(c_int64_t), value :: first, last              !< contactors to treat
    integer(c_int32_t), intent(in) :: body(0:last - 1)    !< body that carries the contactor
    real(c_double), intent(in) :: direction(dim + 1, 0:last - 1) !< unit vector in the axes of the body, then half length [m]
    integer(c_int32_t), value :: has_rotation             !< 0: rotation is not read
    real(c_double), intent(in) :: rotation(3*dim - 5, 0:*) !< angle [rad] or unit quaternion (w, x, y, z)
    real(c_double), intent(inout) :: turned(dim + 1, 0:last - 1) !< unit vector in space, then half length [m]
    integer(c_int64_t) :: i

    do i = first, last - 1
      turned(:, i) = direction(:, i)
      if (has_rotation == 0 .or. .not. any(abs(direction(:dim, i)) > 0)) cycle ! round ones have none
      if (dim == 2) then
        turned(1:2, i) = turned_2d(rotation(1, body(i)), direction(1:2, i))
      else
        turned(1:3, i) = turned_3d(rotation(:, body(i)), direction(1:3, i))
      end if
    end do
  end subroutine cairn_contactor_directions

  !> Reach: radius of the smallest disk or sphere around the centre that holds the contactor, plus its share of the margin.
  pure subroutine cairn_contactor_reach(dim, first, last, shape, elongated, radius, direction, share, margin, reach, &
                                        wrong) bind(c)
    integer(c_int32_t), value :: dim                       !< 2 or 3
    integer(c_int64_t), value :: first, last               !< contactors to treat
    integer(c_int16_t), intent(in) :: shape(0:last - 1)    !< row of shapes.def
    integer(c_int32_t), value :: elongated                 !< the shape whose half length counts
    real(c_double), intent(in) :: radius(0:last - 1)       !< [m]
    real(c_double), intent(in) :: direction(dim + 1, 0:*)  !< read for the elongated shape only; its last component [m]
    real(c_double), value :: share                         !< half the constant margin [m]; negative: margin is read instead
    real(c_double), intent(in) :: margin(0:*)              !< of the contactors [m]
    real(c_double), intent(inout) :: reach(0:last - 1)     !< [m]
    integer(c_int64_t), intent(out) :: wrong               !< first contactor whose reach is negative or not finite, else -1
    integer(c_int64_t) :: i

    if (share >= 0) then
      reach(first:last - 1) = radius(first:last - 1) + share
    else
      reach(first:last - 1) = radius(first:last - 1) + margin(first:last - 1)
    end if
    do i = first, last - 1
      if (shape(i) == elongated) reach(i) = reach(i) + direction(dim + 1, i)
    end do
    wrong = -1
    do i = last - 1, first, -1
      if (.not. (reach(i) >= 0 .and. reach(i) <= huge(reach))) wrong = i
    end do
  end subroutine cairn_contactor_reach

  pure function turned_2d(angle, x) result(y)
    real(c_double), intent(in) :: angle, x(2)
    real(c_double) :: y(2)
    y = [cos(angle)*x(1) - sin(angle)*x(2), sin(angle)*x(1) + cos(angle)*x(2)]
  end function turned_2d

  !> y = x + 2 w (q x x) + 2 q x (q x x), with (w, q) the quaternion.
  pure function turned_3d(rotation, x) result(y)
    real(c_double), intent(in) :: rotation(4), x(3)
    real(c_double) :: y(3), t(3)
    t = 2*cross(rotation(2:4), x)
    y = x + (rotation(1)*t + cross(rotation(2:4), t))
  end function turned_3d

  pure function cross(a, b) result(c)
    real(c_double), intent(in) :: a(3), b(3)
    real(c_double) :: c(3)
    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

end module contactor_places
