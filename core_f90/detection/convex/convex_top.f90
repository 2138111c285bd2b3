!> Optimality test for a separating axis of two convex shapes: if the support features of both along it (points, edges, sides, ends
!> or faces) share a point across the axis, no translation is shorter, and these are the nearest points.
module convex_top
  use, intrinsic :: iso_c_binding, only: c_double
  use convex_shape, only: convex, is_cylinder, is_point, is_polyhedron, is_segment, support
  use hull_patch, only: across
  implicit none
  private
  public :: meet_across

  integer, parameter :: most = 32 !< corners of a face
  integer, parameter :: a_point = 1, a_line = 2, a_disc = 3, a_face = 4, unknown = 5
  real(c_double), parameter :: rounding = 16*epsilon(1.0_c_double)

  !> Across the normal [m].
  type :: spread
    integer :: kind = a_point, count = 1
    real(c_double) :: x(2, most)
    real(c_double) :: radius = 0
  end type spread

contains

  !> n: unit, from b to a, which stands at `at` from b. x, y: the nearest points from the centre of b, if found. sharp: neither
  !> support feature is a point of a curved surface or a side.
  pure subroutine meet_across(a, b, at, n, extent, slack, found, sharp, x, y)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), n(3), extent
    real(c_double), intent(in) :: slack !< across the normal [m]
    logical, intent(out) :: found, sharp
    real(c_double), intent(out) :: x(3), y(3)
    type(spread) :: p, q
    real(c_double) :: t(3), s(3), z(2)
    call across(n, t, s)
    call reached(a, at, -n, t, s, extent, x, p)
    call reached(b, [0.0_c_double, 0.0_c_double, 0.0_c_double], n, t, s, extent, y, q)
    if (p%kind <= q%kind) then
      call common(p, q, slack, found, z)
    else
      call common(q, p, slack, found, z)
    end if
    sharp = max(p%kind, q%kind) > a_line .or. (p%kind == a_line .and. q%kind == a_line)
    if (.not. found) return
    x = z(1)*t + z(2)*s + dot_product(n, x)*n
    y = z(1)*t + z(2)*s + dot_product(n, y)*n
  end subroutine meet_across

  !> Support feature of c, at `at`, along d, projected across d; x: a point of it.
  pure subroutine reached(c, at, d, t, s, extent, x, p)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: at(3), d(3), t(3), s(3), extent
    real(c_double), intent(out) :: x(3)
    type(spread), intent(inout) :: p
    real(c_double) :: high, e(3), w(3)
    p%kind = a_point
    x = at + support(c, d)
    if (c%kind == is_polyhedron) then
      call see_vertices(c, at, d, t, s, extent, dot_product(d, x - at), p)
      return
    end if
    if (c%kind == is_segment .or. c%kind == is_cylinder) then
      e = c%frame(:, 3)
      high = dot_product(e, d)
      w = d - high*e
      if (abs(high) <= rounding) then
        p%kind = a_line
        x = x - dot_product(x - at, e)*e
        p%count = 2
        p%x(:, 1) = flat(x - c%half(3)*e)
        p%x(:, 2) = flat(x + c%half(3)*e)
        return
      else if (c%kind == is_cylinder .and. dot_product(w, w) <= rounding*rounding) then
        p%kind = a_disc
        p%radius = c%half(1)
        x = at + sign(c%half(3), high)*e
      end if
    end if
    p%count = 1
    p%x(:, 1) = flat(x)
  contains
    pure function flat(v)
      real(c_double), intent(in) :: v(3)
      real(c_double) :: flat(2)
      flat = [dot_product(v, t), dot_product(v, s)]
    end function flat
  end subroutine reached

  pure subroutine see_vertices(c, at, d, t, s, extent, high, p)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: at(3), d(3), t(3), s(3), extent, high
    type(spread), intent(inout) :: p
    real(c_double) :: v(3), look, best
    integer :: k, face, first
    p%count = 0
    do k = 1, c%hull%vertices
      if (high - (d(1)*c%hull%v(k, 1) + d(2)*c%hull%v(k, 2) + d(3)*c%hull%v(k, 3)) > rounding*extent) cycle
      p%count = p%count + 1
      if (p%count > 2) exit
      v = at + c%hull%v(k, :)
      p%x(:, p%count) = [dot_product(v, t), dot_product(v, s)]
    end do
    p%kind = min(p%count, 2)
    if (p%count < 3) return
    face = 0
    best = 1 - 1e-9_c_double
    do k = 1, c%hull%faces
      look = d(1)*c%hull%normal(k, 1) + d(2)*c%hull%normal(k, 2) + d(3)*c%hull%normal(k, 3)
      if (look > best) then
        best = look
        face = k
      end if
    end do
    p%kind = unknown
    if (face == 0) return
    first = c%hull%first_corner(face)
    p%count = c%hull%first_corner(face + 1) - first
    if (p%count > most) return
    p%kind = a_face
    do k = 1, p%count
      v = at + c%hull%v(c%hull%corner_vertex(first + k), :)
      p%x(:, k) = [dot_product(v, t), dot_product(v, s)]
    end do
  end subroutine see_vertices

  !> A point z of both, of kinds in order.
  pure subroutine common(p, q, slack, found, z)
    type(spread), intent(in) :: p, q
    real(c_double), intent(in) :: slack
    logical, intent(out) :: found
    real(c_double), intent(out) :: z(2)
    real(c_double) :: d(2), low, high, far
    found = .false.
    z = p%x(:, 1)
    select case (q%kind)
    case (a_point)
      d = q%x(:, 1) - z
      found = dot_product(d, d) <= slack*slack
      z = z + d/2
    case (a_line)
      if (p%kind == a_line) then
        call cross_lines(p%x(:, 1:2), q%x(:, 1:2), slack, found, z)
      else
        d = on_line(q%x(:, 1:2), z) - z
        found = dot_product(d, d) <= slack*slack
        z = z + d
      end if
    case (a_disc)
      if (p%kind == a_line) z = on_line(p%x(:, 1:2), q%x(:, 1))
      d = q%x(:, 1) - z
      far = sqrt(dot_product(d, d))
      found = far <= q%radius + merge(p%radius, 0.0_c_double, p%kind == a_disc) + slack
      if (p%kind == a_disc .and. far > 0) then
        low = max(-p%radius, far - q%radius)
        high = min(p%radius, far + q%radius)
        z = z + ((low + high)/2/far)*d
      end if
    case (a_face)
      if (p%kind == a_face) return
      call in_face(p, q%count, q%x(:, 1:q%count), slack, found, z)
    end select
  end subroutine common

  !> The point of a line nearest to x.
  pure function on_line(line, x) result(z)
    real(c_double), intent(in) :: line(2, 2), x(2)
    real(c_double) :: z(2), d(2), along
    d = line(:, 2) - line(:, 1)
    along = dot_product(d, x - line(:, 1))
    if (along > 0) along = min(along/dot_product(d, d), 1.0_c_double)
    z = line(:, 1) + max(along, 0.0_c_double)*d
  end function on_line

  pure subroutine cross_lines(p, q, slack, found, z)
    real(c_double), intent(in) :: p(2, 2), q(2, 2), slack
    logical, intent(out) :: found
    real(c_double), intent(out) :: z(2)
    real(c_double) :: d(2), e(2), w(2), turn, along(2), dd
    d = p(:, 2) - p(:, 1)
    e = q(:, 2) - q(:, 1)
    w = q(:, 1) - p(:, 1)
    dd = dot_product(d, d)
    turn = d(1)*e(2) - d(2)*e(1)
    if (turn*turn > 1e-18_c_double*dd*dot_product(e, e)) then
      along = [w(1)*e(2) - w(2)*e(1), w(1)*d(2) - w(2)*d(1)]/turn
      found = all(along >= 0 .and. along <= 1)
      z = p(:, 1) + along(1)*d
      return
    end if
    found = .false.
    z = p(:, 1)
    if (.not. dd > 0) return
    if ((w(1)*d(2) - w(2)*d(1))**2 > slack*slack*dd) return
    along = [dot_product(d, w), dot_product(d, w + e)]/dd
    along = [max(minval(along), 0.0_c_double), min(maxval(along), 1.0_c_double)]
    found = along(1) <= along(2)
    z = p(:, 1) + ((along(1) + along(2))/2)*d
  end subroutine cross_lines

  !> A point, line or disc and a face, whose corners may go round either way.
  pure subroutine in_face(p, n, x, slack, found, z)
    type(spread), intent(in) :: p
    integer, intent(in) :: n
    real(c_double), intent(in) :: x(2, n), slack
    logical, intent(out) :: found
    real(c_double), intent(out) :: z(2)
    real(c_double) :: e(2), from, to, first, last, way, least, square, foot(2)
    integer :: k, next
    way = 0
    do k = 2, n - 1
      way = way + (x(1, k) - x(1, 1))*(x(2, k + 1) - x(2, 1)) - (x(2, k) - x(2, 1))*(x(1, k + 1) - x(1, 1))
    end do
    first = 0
    last = 1
    least = huge(least)
    found = .true.
    z = p%x(:, 1)
    do k = 1, n
      next = merge(1, k + 1, k == n)
      e = x(:, next) - x(:, k)
      e = (sign(1.0_c_double, way)/sqrt(dot_product(e, e)))*e
      from = e(1)*(p%x(2, 1) - x(2, k)) - e(2)*(p%x(1, 1) - x(1, k))
      if (p%kind == a_line) then
        to = e(1)*(p%x(2, 2) - x(2, k)) - e(2)*(p%x(1, 2) - x(1, k))
        if (from < -slack .and. to < -slack) found = .false.
        if (from < 0 .and. to > from) first = max(first, from/(from - to))
        if (to < 0 .and. from > to) last = min(last, from/(from - to))
      else if (from < -slack) then
        found = .false.
        if (p%kind == a_point) return
        foot = on_line(reshape([x(:, k), x(:, next)], [2, 2]), p%x(:, 1))
        square = dot_product(foot - p%x(:, 1), foot - p%x(:, 1))
        if (square < least) z = foot
        least = min(least, square)
      end if
    end do
    if (p%kind == a_line) then
      found = found .and. first <= last
      z = p%x(:, 1) + ((first + last)/2)*(p%x(:, 2) - p%x(:, 1))
    else if (p%kind == a_disc .and. .not. found) then
      found = least <= (p%radius + slack)**2
    end if
  end subroutine in_face

end module convex_top
