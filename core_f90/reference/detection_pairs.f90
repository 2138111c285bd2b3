!> Contacts found the plain way: every contactor against every other and all its images, in quadruple precision, by formulas
!> that share nothing with the kernels of detection.
module detection_pairs
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use, intrinsic :: iso_fortran_env, only: real128
  implicit none
  private
  public :: cairn_reference_detection

  integer, parameter :: wp = real128
  integer(c_int32_t), parameter :: bar = 1, half_space = 2, tube = 3

contains

  !> All contacts with gap <= margin, in no particular order. `found` is their number, the first `capacity` are given.
  pure subroutine cairn_reference_detection(dim, n, form, body, id, immovable, centre, radius, direction, margin, vectors, &
                                            span, capacity, a, b, lattice, gap, normal, point, found) bind(c)
    integer(c_int32_t), value :: dim                     !< 2 or 3
    integer(c_int32_t), value :: n                       !< contactors
    integer(c_int32_t), intent(in) :: form(n)            !< 0 disk or sphere, 1 segment, 2 half plane or plane, 3 tube
    integer(c_int32_t), intent(in) :: body(n)
    integer(c_int64_t), intent(in) :: id(n)
    integer(c_int32_t), intent(in) :: immovable(0:*)     !< of the bodies
    real(c_double), intent(in) :: centre(dim, n)         !< [m]
    real(c_double), intent(in) :: radius(n)              !< [m]
    real(c_double), intent(in) :: direction(dim + 1, n)  !< in space, then half length [m]
    real(c_double), intent(in) :: margin(n)              !< [m]
    real(c_double), intent(in) :: vectors(3, 3)          !< of the cell [m]
    integer(c_int32_t), intent(in) :: span(3)            !< images to try on each side along each vector
    integer(c_int64_t), value :: capacity
    integer(c_int32_t), intent(inout) :: a(capacity), b(capacity) !< contactors, from 0
    integer(c_int32_t), intent(inout) :: lattice(3, capacity)
    real(c_double), intent(inout) :: gap(capacity), normal(dim, capacity), point(dim, capacity) !< [m], -, [m]
    integer(c_int64_t), intent(out) :: found
    integer(c_int32_t) :: i, j, p, q, m1, m2, m3, tries(3)
    real(wp) :: shift(3), d(3), g, e(3)
    real(c_double) :: offset(3)
    logical :: touches

    found = 0
    do i = 1, n
      do j = i + 1, n
        if (body(i) == body(j)) cycle
        if (immovable(body(i)) /= 0 .and. immovable(body(j)) /= 0) cycle
        if (form(i) /= 0 .and. form(j) /= 0) cycle
        p = i
        q = j
        if (form(i) /= 0 .or. (form(j) == 0 .and. id(j) < id(i))) then
          p = j
          q = i
        end if
        tries = merge(0, span, form(q) >= half_space)
        do m3 = -tries(3), tries(3)
          do m2 = -tries(2), tries(2)
            do m1 = -tries(1), tries(1)
              if (form(q) < half_space) then ! far apart beyond any rounding
                offset = m1*vectors(:, 1) + m2*vectors(:, 2) + m3*vectors(:, 3)
                if (any(abs(centre(:, p) - centre(:, q) - offset(1:dim)) > 2*(radius(p) + radius(q) + margin(p) + margin(q)) &
                        + merge(2*direction(dim + 1, q), 0.0_c_double, form(q) == bar))) cycle
              end if
              shift = real(m1, wp)*vectors(:, 1) + real(m2, wp)*vectors(:, 2) + real(m3, wp)*vectors(:, 3)
              d = 0
              d(1:dim) = (real(centre(:, p), wp) - real(centre(:, q), wp)) - shift(1:dim)
              call measure(dim, form(q), d, real(radius(p), wp), real(radius(q), wp), real(direction(:, q), wp), g, e, touches)
              if (.not. touches) cycle
              if (g > real(margin(p), wp) + real(margin(q), wp)) cycle
              found = found + 1
              if (found > capacity) cycle
              a(found) = p - 1
              b(found) = q - 1
              lattice(:, found) = [m1, m2, m3]
              gap(found) = real(g, c_double)
              normal(:, found) = real(e(1:dim), c_double)
              point(:, found) = real(centre(:, p) - (radius(p) + g/2)*e(1:dim), c_double)
            end do
          end do
        end do
      end do
    end do
  end subroutine cairn_reference_detection

  !> Gap and normal of a round contactor at d from another.
  pure subroutine measure(dim, form, d, radius_a, radius_b, direction, gap, normal, touches)
    integer(c_int32_t), intent(in) :: dim, form
    real(wp), intent(in) :: d(3), radius_a, radius_b, direction(dim + 1)
    real(wp), intent(out) :: gap, normal(3)
    logical, intent(out) :: touches
    real(wp) :: axis(3), t, nearest(3), radial(3), rho

    touches = .true.
    axis = 0
    axis(1:dim) = direction(1:dim)
    select case (form)
    case (half_space)
      normal = axis
      gap = sum(axis*d) - radius_a
    case (bar)
      ! nearest point on the line from one end to the other, as a share of it
      t = sum((d + direction(dim + 1)*axis)*axis)/(2*direction(dim + 1)*sum(axis*axis))
      nearest = (2*max(0.0_wp, min(1.0_wp, t)) - 1)*direction(dim + 1)*axis
      gap = norm2(d - nearest) - radius_a - radius_b
      normal = (d - nearest)/norm2(d - nearest)
    case (tube)
      t = sum(d*axis)
      radial = d - t*axis
      rho = norm2(radial)
      if (abs(t) <= direction(dim + 1)) then
        gap = radius_b - rho - radius_a
        normal = -radial/rho
      else
        nearest = radius_b*radial/rho + sign(direction(dim + 1), t)*axis
        gap = norm2(d - nearest) - radius_a
        normal = (d - nearest)/norm2(d - nearest)
      end if
      touches = direction(dim + 1) > huge(1.0_c_double) .or. rho <= radius_a + radius_b
    case default
      gap = norm2(d) - radius_a - radius_b
      normal = d/norm2(d)
    end select
  end subroutine measure

end module detection_pairs
