!> Contact of a superquadric with a tube seen from inside.
module superquadric_tube
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls
  use bracketed_zero, only: bracket, narrow, next_angle, where_it_falls
  use convex_axis, only: axis_between
  use convex_shape, only: convex, see_point, see_superquadric, support
  use facet_points, only: add, findings, settle
  use hull_patch, only: across
  use tube_view, only: at_point, is_beyond, see_tube, tube
  implicit none
  private
  public :: cairn_pair_superquadric_tube

  integer, parameter :: looks = 32             !< directions in which the clearance is looked at first
  integer, parameter :: levels = 5, parts = 4  !< how often, and in how many, the parts that hold a top are parted
  integer, parameter :: most_falls = 16

contains

  !> Contacts where the body is locally nearest to the wall: one point, or two and more for a body that lies across the tube.
  subroutine cairn_pair_superquadric_tube(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, &
                               normal, point, feature) bind(c)
    integer(c_int32_t), value :: n                      !< pairs
    type(cairn_hulls), intent(in) :: hulls
    integer(c_int32_t), intent(in) :: a(n), b(n)        !< contactors
    real(c_double), intent(in) :: between(n, 3)         !< centre of A - centre of B [m]
    real(c_double), intent(in) :: radius_a(n)           !< of the ball around A [m]
    real(c_double), intent(in) :: radius_b(n)           !< of the tube [m]
    real(c_double), intent(in) :: direction_b(n, 4)     !< unit axis, then half length [m], infinite for an endless tube
    real(c_double), intent(in) :: limit(n)              !< gaps above do not count [m]
    integer(c_int32_t), intent(out) :: count(n)         !< points of each pair
    real(c_double), intent(out) :: gap(hulls%most, n)   !< negative when overlapping [m]
    real(c_double), intent(out) :: normal(3, hulls%most, n) !< unit, from B to A
    real(c_double), intent(out) :: point(3, hulls%most, n)  !< middle of the gap - centre of A [m]
    integer(c_int32_t), intent(out) :: feature(hulls%most, n) !< names of the points within the pair
    type(hulls_view) :: view
    type(convex) :: p
    type(tube) :: q
    type(findings) :: f
    integer :: i

    call open_hulls(hulls, view)
    do i = 1, n
      call see_superquadric(view, a(i), radius_a(i), p)
      call see_tube(radius_b(i), direction_b(i, :), q)
      f%count = 0
      f%slack = 1e-9_c_double*p%size
      if (.not. is_beyond(q, between(i, :))) call find_points(p, q, between(i, :), limit(i), f)
      call settle(f, view%most, count(i), gap(:, i), normal(:, :, i), point(:, :, i), feature(:, i))
    end do
  end subroutine cairn_pair_superquadric_tube

  !> Local maxima of the support point's distance from the axis of the tube. The support function across the tube grows with the
  !> angle while the support point is ahead of the direction; where the point falls behind, it is locally farthest from the axis.
  !> Intervals in which it falls behind, and those in which it may be farther out than any point seen, are bisected until they are
  !> narrow.
  subroutine find_points(p, q, at, limit, f)
    type(convex), intent(in) :: p
    type(tube), intent(in) :: q
    real(c_double), intent(in) :: at(3), limit
    type(findings), intent(inout) :: f
    type(bracket) :: fall(most_falls), finer(most_falls)
    real(c_double) :: t(3), s(3), x(3), reach, far, ahead, two_pi
    integer :: k, level, falling, found
    call across(q%axis, t, s)
    two_pi = 4*acos(0.0_c_double)
    far = 0
    falling = 0
    ! one turn, and the first interval again, whose start was not seen
    call falls(p, at, t, s, 0.0_c_double, two_pi + two_pi/looks, looks + 1, q%radius - limit, far, falling, fall)
    do level = 1, levels
      found = 0
      do k = 1, falling
        call falls(p, at, t, s, fall(k)%low, fall(k)%high, parts, q%radius - limit, far, found, finer)
      end do
      falling = found
      fall(1:falling) = finer(1:falling)
    end do
    found = 0
    do k = 1, falling
      if (.not. fall(k)%of_high < 0) cycle
      if (fall(k)%low >= two_pi*(1 - epsilon(far))) cycle ! seen already
      found = found + 1
      fall(found) = fall(k)
    end do
    do k = 1, found
      ! named by the turn around the tube, which does not change when another becomes the deepest
      level = 1 + count(modulo(fall(1:found)%low, two_pi) < modulo(fall(k)%low, two_pi))
      call close_in(p, q, at, t, s, fall(k), limit, level, f)
    end do
    if (found > 0) return
    call look(p, at, t, s, 0.0_c_double, x, reach, ahead) ! as far out all around
    call at_point(q, at, x, limit, 1_c_int32_t, f)
  end subroutine find_points

  !> Adds the parts of an interval of angles in which the support point changes from ahead of the direction to behind it
  !> (differences within rounding are neither), and those in which it may be farther out than `far`, the farthest seen, by the
  !> intersection of the tangents at both ends. Skips parts that are nearer to the axis than `enough` throughout.
  pure subroutine falls(p, at, t, s, low, high, pieces, enough, far, count, fall)
    type(convex), intent(in) :: p
    real(c_double), intent(in) :: at(3), t(3), s(3), low, high, enough
    integer, intent(in) :: pieces
    real(c_double), intent(inout) :: far
    integer, intent(inout) :: count
    type(bracket), intent(inout) :: fall(most_falls)
    type(bracket) :: b
    real(c_double) :: x(3), reach, ahead, angle, noise, step, before, meet
    logical :: rising, fell
    integer :: k
    noise = 64*epsilon(noise)*(p%size + sqrt(dot_product(at, at)))
    rising = .false.
    step = (high - low)/pieces
    before = 0
    do k = 0, pieces
      angle = low + k*step
      if (k == pieces) angle = high
      call look(p, at, t, s, angle, x, reach, ahead)
      far = max(far, sqrt(reach**2 + ahead**2))
      meet = sqrt(((before - reach*cos(step))/sin(step))**2 + reach**2)
      fell = rising .and. ahead < -noise
      if (k > 0 .and. meet >= enough .and. (fell .or. meet > far*(1 + 1e-9_c_double)) .and. count < most_falls) then
        count = count + 1
        fall(count) = bracket(low=angle - step, high=angle, of_high=1.0_c_double)
        if (fell) fall(count) = bracket(low=b%low, high=angle, of_low=b%of_low, of_high=ahead, x_low=b%x_low, x_high=x)
      end if
      if (ahead > noise) b = bracket(low=angle, of_low=ahead, x_low=x)
      if (abs(ahead) > noise) rising = ahead > noise
      before = reach
    end do
  end subroutine falls

  subroutine close_in(p, q, at, t, s, top, limit, name, f)
    type(convex), intent(in) :: p
    type(tube), intent(in) :: q
    real(c_double), intent(in) :: at(3), t(3), s(3), limit
    type(bracket), intent(inout) :: top
    integer, intent(in) :: name
    type(findings), intent(inout) :: f
    real(c_double) :: angle, x(3), reach, slope
    logical :: more
    do
      call next_angle(top, angle, more)
      if (.not. more) exit
      call look(p, at, t, s, angle, x, reach, slope)
      call narrow(top, angle, slope, x)
    end do
    call where_it_falls(top, angle, x)
    if (abs(dot_product(x, q%axis)) <= q%half) then
      call at_point(q, at, x, limit, int(name, c_int32_t), f)
    else
      call at_rim(p, q, at, t, s, angle, sign(q%half, dot_product(x, q%axis)), limit, int(16 + name, c_int32_t), f)
    end if
  end subroutine close_in

  !> Contact of a body that is widest beyond an open end with the rim, at the point of the rim nearest to the body.
  subroutine at_rim(p, q, at, t, s, start, along, limit, name, f)
    type(convex), intent(in) :: p
    type(tube), intent(in) :: q
    real(c_double), intent(in) :: at(3), t(3), s(3), start, along, limit
    integer(c_int32_t), intent(in) :: name
    type(findings), intent(inout) :: f
    type(bracket) :: b
    real(c_double), parameter :: around = 0.6_c_double
    real(c_double) :: angle, slope, n(3), y(3), gap
    logical :: apart, more
    b%low = start - around
    b%high = start + around
    call see(b%low, b%of_low)
    if (apart .or. .not. b%of_low > 0) return
    call see(b%high, b%of_high)
    if (apart .or. .not. b%of_high < 0) return
    do
      call next_angle(b, angle, more)
      if (.not. more) exit
      call see(angle, slope)
      call narrow(b, angle, slope, y)
    end do
    call where_it_falls(b, angle, n)
    call see(angle, slope)
    if (gap > limit .or. .not. dot_product(n, y - along*q%axis) < 0) return
    call add(f, y - at + (gap/2)*n, n, gap, name)
  contains
    !> How far the direction from the rim to the body points ahead along the rim.
    subroutine see(turn, points_ahead)
      real(c_double), intent(in) :: turn
      real(c_double), intent(out) :: points_ahead
      type(convex) :: corner
      real(c_double) :: reached(3), zero(3)
      call see_point(0.0_c_double, corner)
      y = along*q%axis + q%radius*(cos(turn)*t + sin(turn)*s)
      call axis_between(p, corner, at - y, huge(gap), n, gap, reached, zero, apart)
      points_ahead = dot_product(n, cos(turn)*s - sin(turn)*t)
    end subroutine see
  end subroutine at_rim

  !> The point reached across the tube in the direction of an angle, how far out it is, and how far ahead of the direction.
  pure subroutine look(p, at, t, s, angle, x, reach, ahead)
    type(convex), intent(in) :: p
    real(c_double), intent(in) :: at(3), t(3), s(3), angle
    real(c_double), intent(out) :: x(3), reach, ahead
    x = at + support(p, cos(angle)*t + sin(angle)*s)
    reach = dot_product(x, cos(angle)*t + sin(angle)*s)
    ahead = dot_product(x, cos(angle)*s - sin(angle)*t)
  end subroutine look

end module superquadric_tube
