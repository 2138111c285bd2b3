!> Round bodies within a tube, seen along its axis: which points of an ellipse are farthest out, where a side crosses the rim of
!> an open end.
module tube_view
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use facet_points, only: add, findings
  use facet_view, only: cross
  use hull_patch, only: across
  use sphere_tube, only: cairn_pair_sphere_tube
  implicit none
  private
  public :: tube, see_tube, is_beyond, look_across, tops, at_point, across_rims

  type :: tube
    real(c_double) :: axis(3) = 0, radius = 0, half = 0   !< unit, [m], [m]: infinite if it is endless
  end type tube

  !> Sine of the angle by which a normal may lean into the wall at the rim: sides that lie along the wall cross it.
  real(c_double), parameter :: lean = 0.05_c_double

contains

  pure subroutine see_tube(radius, direction, b)
    real(c_double), intent(in) :: radius, direction(4)
    type(tube), intent(out) :: b
    b%axis = direction(1:3)
    b%radius = radius
    b%half = direction(4)
  end subroutine see_tube

  !> True if a body with its centre at x is outside a tube with ends, where motion is free.
  pure logical function is_beyond(b, x)
    type(tube), intent(in) :: b
    real(c_double), intent(in) :: x(3)
    real(c_double) :: w(3)
    w = x - dot_product(x, b%axis)*b%axis
    is_beyond = b%half <= huge(b%half) .and. dot_product(w, w) > b%radius**2
  end function is_beyond

  !> Directions across two axes: g across both, w across that of the tube and g, k across the other and g.
  pure subroutine look_across(b, axis, g, w, k)
    type(tube), intent(in) :: b
    real(c_double), intent(in) :: axis(3)
    real(c_double), intent(out) :: g(3), w(3), k(3)
    g = cross(axis, b%axis)
    if (dot_product(g, g) > 1e-20_c_double) then
      g = g/sqrt(dot_product(g, g))
    else
      call across(b%axis, g, w)
    end if
    w = cross(b%axis, g)
    k = cross(axis, g)
    k = k/sqrt(dot_product(k, k))
  end subroutine look_across

  !> Maxima of x z(1) + y z(2) + d/2 z(1)^2, d >= 0, over unit vectors z: the first in the quadrant of (x, y), and a lower one on
  !> the other side of the second axis while (x, y) is within the astroid of d.
  pure subroutine tops(x, y, d, count, z)
    real(c_double), intent(in) :: x, y, d
    integer, intent(out) :: count
    real(c_double), intent(out) :: z(2, 2)
    real(c_double) :: a, b, c, unit, quarter, angle
    quarter = acos(0.0_c_double)
    count = 1
    z = reshape([1, 0, -1, 0], [2, 2])
    unit = max(abs(x), abs(y), d)
    if (.not. unit > 0) return
    a = abs(x)/unit
    b = abs(y)/unit
    c = d/unit
    angle = top_of(a, b, c, quarter)
    z(:, 1) = [sign(cos(angle), x), sign(sin(angle), y)]
    if (.not. a**(2/3.0_c_double) + b**(2/3.0_c_double) < c**(2/3.0_c_double)) return
    count = 2
    if (a > 0) quarter = atan((b/a)**(1/3.0_c_double))
    angle = top_of(-a, b, c, quarter)
    z(:, 2) = [sign(cos(angle), -x), sign(sin(angle), y)]
    if (.not. abs(x) > 0) z(1, 2) = -z(1, 1)
  end subroutine tops

  !> The angle from 0 to `high` where a cos + b sin + c/2 cos^2 rises no more.
  pure function top_of(a, b, c, high) result(angle)
    real(c_double), intent(in) :: a, b, c, high
    real(c_double) :: angle, low, up, slope, curve, step
    integer :: round
    low = 0
    up = high
    angle = min(atan2(b, a + c), high)
    do round = 1, 100
      slope = b*cos(angle) - a*sin(angle) - c*sin(angle)*cos(angle)
      if (slope > 0) then
        low = angle
      else
        up = angle
      end if
      curve = -b*sin(angle) - a*cos(angle) - c*cos(2*angle)
      step = 0
      if (curve < 0) step = -slope/curve
      if (abs(step) <= epsilon(step) .and. curve < 0) exit
      angle = angle + step
      if (.not. (angle > low .and. angle < up) .or. .not. curve < 0) angle = (low + up)/2
      if (.not. (angle > low .and. angle < up)) exit
    end do
  end function top_of

  !> Adds the contact of a point x of a body whose centre stands at `at` with the wall, if it is between the ends.
  pure subroutine at_point(b, at, x, limit, name, f)
    type(tube), intent(in) :: b
    real(c_double), intent(in) :: at(3), x(3), limit
    integer(c_int32_t), intent(in) :: name
    type(findings), intent(inout) :: f
    real(c_double) :: gap(1), n(1, 3), middle(1, 3)
    integer(c_int32_t) :: status(1)
    if (abs(dot_product(x, b%axis)) > b%half) return
    call cairn_pair_sphere_tube(1_c_int32_t, x, [0.0_c_double], [b%radius], [b%axis, b%half], gap, n, middle, status)
    if (gap(1) > limit) return
    call add(f, x - at + middle(1, :), n(1, :), gap(1), name)
  end subroutine at_point

  !> Adds the contacts of a side, all that is `radius` from the part of an axis within `half` of `at`, with the rims of open ends:
  !> where a rim is nearest to the axis.
  pure subroutine across_rims(b, at, axis, half, radius, limit, name, f)
    type(tube), intent(in) :: b
    real(c_double), intent(in) :: at(3), axis(3), half, radius, limit
    integer(c_int32_t), intent(in) :: name !< of the first of four
    type(findings), intent(inout) :: f
    real(c_double) :: g(3), w(3), k(3), centre(3), out(3), y(3), n(3), z(2, 2), d(3), along, distance, gap
    integer :: i, j, count
    if (b%half > huge(b%half)) return
    call look_across(b, axis, g, w, k)
    d = cross(axis, b%axis)
    do i = 1, 2
      centre = (2*i - 3)*b%half*b%axis
      call tops(dot_product(at - centre, k)*dot_product(w, k), dot_product(at - centre, g), b%radius*dot_product(d, d), count, z)
      do j = 1, count
        out = z(1, j)*w + z(2, j)*g
        y = centre + b%radius*out - at
        along = dot_product(y, axis)
        if (.not. abs(along) < half) cycle
        n = along*axis - y
        distance = sqrt(dot_product(n, n))
        gap = distance - radius
        if (gap > limit .or. .not. distance > 0) cycle
        n = n/distance
        if (dot_product(n, centre) < -lean*b%half .or. dot_product(n, out) > 0) cycle
        call add(f, y + (gap/2)*n, n, gap, name + int(2*i + j - 3, c_int32_t))
      end do
    end do
  end subroutine across_rims

end module tube_view
