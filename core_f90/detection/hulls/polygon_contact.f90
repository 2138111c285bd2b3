!> Contact of two convex polygons, the second with a rounded rim if asked: what kernels of pairs share.
module polygon_contact
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: solid
  use hull_distance, only: nearest_points
  use patch_points, only: add_deepest, add_point, clear_patch, name_points, patch, reduce_patch, vertex_of_b
  implicit none
  private
  public :: side, find_side, touch_polygons, touch_line, rounding

  ! rounding: error of a depth; blind: distance below which differences define no direction; both relative to the sum of sizes.
  real(c_double), parameter :: rounding = 16*epsilon(1.0_c_double), blind = 1e-9_c_double
  real(c_double), parameter :: level = 1e-2_c_double, barely = 1e-4_c_double !< see meet_barely
  real(c_double), parameter :: steep = 1e-3_c_double !< a side whose normal is so far from the axis is seen from its end

  !> A side seen along the normal: its ends across (first) and along it.
  type :: side
    real(c_double) :: x(2) = 0, height(2) = 0
    integer(c_int32_t) :: vertex(2) = 0
    logical :: flat = .true.
  end type side

contains

  !> Largest separation along the outward normals of p, q standing at `at`, and the vertex of q that is deepest there. The
  !> deepest vertex turns with the sides (Shamos 1978); where they turn by much, all are looked at, since half a turn may
  !> begin along a side of q, which leads nowhere.
  pure subroutine best_side(p, q, at, best, which, deepest)
    type(solid), intent(in) :: p, q
    real(c_double), intent(in) :: at(2)
    real(c_double), intent(out) :: best
    integer, intent(out) :: which, deepest
    integer :: i, j, next, step
    real(c_double) :: low, height
    logical :: anew
    best = -huge(best)
    which = 1
    deepest = 1
    j = 1
    do i = 1, p%faces
      low = dot_product(p%normal(i, :), q%v(j, :))
      anew = i == 1
      if (i > 1) anew = dot_product(p%normal(i, :), p%normal(i - 1, :)) < 0.5_c_double
      if (anew) then
        do next = 1, q%vertices
          height = dot_product(p%normal(i, :), q%v(next, :))
          if (height < low) then
            low = height
            j = next
          end if
        end do
      end if
      do step = 1, q%vertices
        next = merge(1, j + 1, j == q%vertices)
        height = dot_product(p%normal(i, :), q%v(next, :))
        if (.not. height < low) exit
        low = height
        j = next
      end do
      height = dot_product(p%normal(i, :), at) + low - p%offset(i)
      if (height > best) then
        best = height
        which = i
        deepest = j
      end if
    end do
  end subroutine best_side

  !> The side of p that looks most along sense*n, standing at `at`.
  pure subroutine find_side(p, at, n, sense, s)
    type(solid), intent(in) :: p
    real(c_double), intent(in) :: at(2), n(2), sense
    type(side), intent(out) :: s
    real(c_double) :: best, look, x(2)
    integer :: i, k
    k = 1
    best = -2
    do i = 1, p%faces
      look = sense*(n(1)*p%normal(i, 1) + n(2)*p%normal(i, 2))
      if (look > best) then
        best = look
        k = i
      end if
    end do
    s%flat = best > steep
    s%vertex = [k, merge(1, k + 1, k == p%vertices)]
    do i = 1, 2
      x = at + p%v(s%vertex(i), :)
      s%x(i) = n(1)*x(2) - n(2)*x(1)
      s%height(i) = dot_product(n, x)
    end do
    if (s%x(1) <= s%x(2)) return
    s%x = s%x([2, 1])
    s%height = s%height([2, 1])
    s%vertex = s%vertex([2, 1])
  end subroutine find_side

  !> Height of a side at x; of a steep one, that of the end towards the other body: the lowest of A, the highest of B.
  pure function height_at(s, x, lowest) result(h)
    type(side), intent(in) :: s
    real(c_double), intent(in) :: x
    logical, intent(in) :: lowest
    real(c_double) :: h, along
    if (.not. s%flat) then
      h = merge(minval(s%height), maxval(s%height), lowest)
      return
    end if
    along = (x - s%x(1))/(s%x(2) - s%x(1))
    h = s%height(1) + along*(s%height(2) - s%height(1))
  end function height_at

  !> Points of contact of a with b grown by radius_b, a standing at `at` from b: normal n, and a patch of at most two.
  subroutine touch_polygons(a, b, at, radius_b, limit, n, p)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(2), radius_b, limit !< [m]
    real(c_double), intent(out) :: n(2)
    type(patch), intent(inout) :: p
    real(c_double) :: gap, point_a(2), point_b(2), low, high, x, extent
    integer(c_int32_t) :: name
    type(side) :: sa, sb
    integer :: k

    extent = a%size + b%size
    call clear_patch(p, min(a%size, b%size + radius_b))
    call polygon_axis(a, b, at, n, gap, point_a, point_b, name)
    if (gap - radius_b > limit) return
    call find_side(a, at, n, -1.0_c_double, sa)
    call find_side(b, [0.0_c_double, 0.0_c_double], n, 1.0_c_double, sb)
    low = max(sa%x(1), sb%x(1))
    high = min(sa%x(2), sb%x(2))
    if (abs(gap) > blind*extent .and. meet_barely(sa, sb, high - low)) return
    if (low <= high + rounding*extent) then
      do k = 1, 2
        x = merge(low, high, k == 1)
        name = merge(sa%vertex(k), vertex_of_b + sb%vertex(k), abs(sa%x(k) - x) <= 0)
        call put(height_at(sb, x, .false.) + radius_b, height_at(sa, x, .true.))
      end do
    end if
    x = dot_product(n, point_a + point_b)/2 + radius_b/2
    low = (n(1)*(point_a(2) + point_b(2)) - n(2)*(point_a(1) + point_b(1)))/2
    call add_deepest(p, [low, 0.0_c_double, x], gap - radius_b, 8*rounding*extent, name)
    call reduce_patch(p, 2)
    call name_points(p, 2, flat(sa%x), sa%vertex, 2, flat(sb%x), sb%vertex)
  contains
    subroutine put(bottom, top)
      real(c_double), intent(in) :: bottom, top
      if (top - bottom <= limit) &
        call add_point(p, [x, 0.0_c_double, (bottom + top)/2], max(top - bottom, gap - radius_b), name)
    end subroutine put
  end subroutine touch_polygons

  !> True if sides that stand square to the normal overlap by no more than a ten-thousandth. A body that slides over the seam of two
  !> flush sides, offset by the error of a step, would otherwise meet the end of the second one.
  pure function meet_barely(a, b, overlap)
    type(side), intent(in) :: a, b
    real(c_double), intent(in) :: overlap
    logical :: meet_barely
    real(c_double) :: wide_a, wide_b
    wide_a = a%x(2) - a%x(1)
    wide_b = b%x(2) - b%x(1)
    meet_barely = abs(overlap) < barely*min(wide_a, wide_b)
    if (meet_barely) meet_barely = abs(a%height(2) - a%height(1)) < level*wide_a
    if (meet_barely) meet_barely = abs(b%height(2) - b%height(1)) < level*wide_b
  end function meet_barely

  pure function flat(x) result(y)
    real(c_double), intent(in) :: x(2)
    real(c_double) :: y(2, 2)
    y(1, :) = x
    y(2, :) = 0
  end function flat

  !> Normal from b to a, gap along it, nearest points from the centre of b, and their name.
  subroutine polygon_axis(a, b, at, n, gap, point_a, point_b, name)
    type(solid), intent(in) :: a, b
    real(c_double), intent(in) :: at(2)
    real(c_double), intent(out) :: n(2), gap, point_a(2), point_b(2)
    integer(c_int32_t), intent(out) :: name
    real(c_double) :: of_a, of_b, extent, distance, foot_a(2), foot_b(2)
    integer :: side_a, side_b, deep_a, deep_b, corners, va(4), vb(4)
    extent = a%size + b%size
    call best_side(b, a, at, of_b, side_b, deep_a)
    call best_side(a, b, -at, of_a, side_a, deep_b)
    if (of_b > of_a + rounding*extent) then
      n = b%normal(side_b, :)
      gap = of_b
      point_a = at + a%v(deep_a, :)
      point_b = point_a - gap*n
      name = deep_a
      if (gap <= 0 .or. on_side(b, side_b, point_b)) return
    else
      n = -a%normal(side_a, :)
      gap = of_a
      point_b = b%v(deep_b, :)
      point_a = point_b + gap*n
      name = vertex_of_b + deep_b
      if (gap <= 0 .or. on_side(a, side_a, point_a - at)) return
    end if
    call nearest_points(a, b, at, n, distance, foot_a, foot_b, corners, va, vb)
    if (distance <= gap + 4*rounding*extent) return
    gap = distance
    point_a = at + foot_a
    point_b = foot_b
    name = va(1)
    if (any(va(1:corners) /= va(1)) .and. all(vb(1:corners) == vb(1))) name = vertex_of_b + vb(1)
    if (distance <= blind*extent) return
    n = point_a - point_b
    n = n/sqrt(dot_product(n, n))
  end subroutine polygon_axis

  pure function on_side(p, k, x)
    type(solid), intent(in) :: p
    integer, intent(in) :: k
    real(c_double), intent(in) :: x(2)
    logical :: on_side
    real(c_double) :: d(2)
    integer :: next
    next = merge(1, k + 1, k == p%vertices)
    d = p%v(next, :) - p%v(k, :)
    on_side = dot_product(x - p%v(k, :), d) >= 0 .and. dot_product(x - p%v(next, :), d) <= 0
  end function on_side

  !> Points of contact of a with the half plane below a line through 0.
  pure subroutine touch_line(a, at, n, limit, p)
    type(solid), intent(in) :: a
    real(c_double), intent(in) :: at(2), n(2), limit
    type(patch), intent(inout) :: p
    type(side) :: s
    real(c_double) :: low, x(2), height
    integer :: k, deepest
    call clear_patch(p, a%size)
    call find_side(a, at, n, -1.0_c_double, s)
    do k = 1, 2
      if (s%height(k) <= limit) call add_point(p, [s%x(k), 0.0_c_double, s%height(k)/2], s%height(k), s%vertex(k))
    end do
    low = huge(low)
    deepest = 1
    do k = 1, a%vertices
      height = dot_product(n, at + a%v(k, :))
      if (height < low) then
        low = height
        deepest = k
      end if
    end do
    if (low > limit) return
    x = at + a%v(deepest, :)
    call add_deepest(p, [n(1)*x(2) - n(2)*x(1), 0.0_c_double, low/2], low, rounding*a%size, int(deepest, c_int32_t))
    call reduce_patch(p, 2)
    call name_points(p, 2, flat(s%x), s%vertex, 0, flat(s%x), s%vertex)
  end subroutine touch_line

end module polygon_contact
