!> The patch of contact of two convex polyhedra: the faces that look at each other along the normal, cut by each other.
module hull_patch
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: solid
  use patch_points, only: patch, add_point, name_of_edges, name_points, vertex_of_b
  implicit none
  private
  public :: outline, find_outline, outline_of_face, face_along, cut_faces, name_patch, across, face_corners

  integer, parameter :: face_corners = 1024 !< corners a face may have
  real(c_double), parameter :: steep = 1e-3_c_double !< a face whose normal is so far from the axis has no depths inside
  real(c_double), parameter :: outside = 1e-9_c_double !< of the smaller size: corners no farther out count as inside

  !> A face seen along the normal: corners counterclockwise across the normal, and along it.
  type :: outline
    integer :: count
    logical :: flat                                    !< wide enough to tell depths inside
    real(c_double) :: x(2, face_corners), height(face_corners) ! [m]
    real(c_double) :: slope(2), level                  !< height = level + slope . x inside
    integer(c_int32_t) :: vertex(face_corners), edge(face_corners) !< edge from this corner to the next
  end type outline

  integer, parameter :: lanes = 4, room = face_corners + lanes
  !> The lines of an outline, and its corners, filled up with the last of them to whole lanes. What is in is on the left.
  type :: rim
    integer :: count, filled
    real(c_double), dimension(room) :: x, y, inward_x, inward_y, base
  end type rim

  !> Where the edge of A from corner i crosses that of B from corner j: how far along each.
  type :: crossings
    integer :: count
    integer, dimension(2*face_corners) :: i, j
    real(c_double), dimension(2*face_corners) :: along_a, along_b
  end type crossings

contains

  !> Two directions across a unit normal (Duff et al. 2017).
  pure subroutine across(n, t, s)
    real(c_double), intent(in) :: n(3)
    real(c_double), intent(out) :: t(3), s(3)
    real(c_double) :: sgn, a, b
    sgn = sign(1.0_c_double, n(3))
    a = -1/(sgn + n(3))
    b = n(1)*n(2)*a
    t = [1 + sgn*n(1)*n(1)*a, sgn*b, -sgn*n(1)]
    s = [b, sgn + n(2)*n(2)*a, -n(2)]
  end subroutine across

  !> The face of p that looks most along sense*n, standing at `at`.
  pure subroutine find_outline(p, at, n, t, s, sense, f)
    type(solid), intent(in) :: p
    real(c_double), intent(in) :: at(3), n(3), t(3), s(3), sense
    type(outline), intent(inout) :: f
    call outline_of_face(p, face_along(p%faces, p%normal, sense*n), at, n, t, s, sense, f)
  end subroutine find_outline

  pure subroutine outline_of_face(p, face, at, n, t, s, sense, f)
    type(solid), intent(in) :: p
    integer, intent(in) :: face
    real(c_double), intent(in) :: at(3), n(3), t(3), s(3), sense
    type(outline), intent(inout) :: f
    real(c_double) :: look, m(3)
    integer :: base
    base = p%first_corner(face)
    f%count = p%first_corner(face + 1) - base
    call see_corners(f, p%vertices, p%v, p%corner_vertex(base + 1:base + f%count), p%corner_edge(base + 1:base + f%count), &
                     at, n, t, s, sense < 0)
    m = p%normal(face, :)
    look = dot_product(m, n)
    f%flat = abs(look) > steep
    f%slope = 0
    f%level = 0
    if (.not. f%flat) return
    f%slope = -[dot_product(m, t), dot_product(m, s)]/look
    f%level = (p%offset(face) + dot_product(m, at))/look
  end subroutine outline_of_face

  !> Seen from outside a face that looks against the normal, the turn is the other one.
  pure subroutine see_corners(f, vertices, v, corner_vertex, corner_edge, at, n, t, s, back)
    type(outline), intent(inout) :: f
    integer, intent(in) :: vertices
    real(c_double), intent(in) :: v(vertices, 3), at(3), n(3), t(3), s(3)
    integer(c_int32_t), intent(in) :: corner_vertex(f%count), corner_edge(f%count)
    logical, intent(in) :: back
    real(c_double) :: x, y, z
    integer :: k, c, e, step, i
    c = merge(f%count, 1, back)
    e = merge(f%count - 1, 1, back)
    step = merge(-1, 1, back)
    do k = 1, f%count
      i = corner_vertex(c)
      f%vertex(k) = i
      x = at(1) + v(i, 1)
      y = at(2) + v(i, 2)
      z = at(3) + v(i, 3)
      f%x(1, k) = t(1)*x + t(2)*y + t(3)*z
      f%x(2, k) = s(1)*x + s(2)*y + s(3)*z
      f%height(k) = n(1)*x + n(2)*y + n(3)*z
      f%edge(k) = corner_edge(e)
      c = c + step
      e = merge(f%count, e + step, e + step == 0)
    end do
  end subroutine see_corners

  !> The first of the normals that reach farthest along n.
  pure function face_along(faces, normal, n) result(face)
    integer, intent(in) :: faces
    real(c_double), intent(in) :: normal(faces, 3), n(3)
    integer :: face
    real(c_double) :: best, look(lanes)
    integer :: first, from, j
    face = 1
    best = -2
    do first = 1, faces, lanes
      from = max(min(first, faces - lanes + 1), 1) - 1
      if (faces >= lanes) then
        do j = 1, lanes
          look(j) = n(1)*normal(from + j, 1) + n(2)*normal(from + j, 2) + n(3)*normal(from + j, 3)
        end do
      else
        look = -3
        look(1:faces) = n(1)*normal(:, 1) + n(2)*normal(:, 2) + n(3)*normal(:, 3)
      end if
      do j = 1, lanes
        if (look(j) > best) then
          best = look(j)
          face = from + j
        end if
      end do
    end do
  end function face_along

  pure subroutine make_rim(f, r)
    type(outline), intent(in) :: f
    type(rim), intent(inout) :: r
    real(c_double) :: length
    integer :: i, next
    r%count = f%count
    r%filled = (f%count + lanes - 1)/lanes*lanes
    do i = 1, r%filled
      r%x(i) = f%x(1, min(i, f%count))
      r%y(i) = f%x(2, min(i, f%count))
    end do
    do i = 1, f%count
      next = merge(1, i + 1, i == f%count)
      r%inward_x(i) = r%y(i) - r%y(next)
      r%inward_y(i) = r%x(next) - r%x(i)
    end do
    r%inward_x(f%count + 1:r%filled) = r%inward_x(f%count)
    r%inward_y(f%count + 1:r%filled) = r%inward_y(f%count)
    do i = 1, r%filled
      length = sqrt(r%inward_x(i)**2 + r%inward_y(i)**2)
      r%base(i) = merge(0.0_c_double, -huge(length), length > 0) ! nothing is inside a line without length
      length = merge(length, 1.0_c_double, length > 0)
      r%inward_x(i) = r%inward_x(i)/length
      r%inward_y(i) = r%inward_y(i)/length
    end do
  end subroutine make_rim

  !> How far inside every line of r a point is [m].
  pure subroutine inside_lines(r, x, y, d)
    type(rim), intent(in) :: r
    real(c_double), intent(in) :: x, y
    real(c_double), intent(inout) :: d(room)
    integer :: first, j
    do first = 0, r%filled - 1, lanes
      do j = first + 1, first + lanes
        d(j) = r%inward_x(j)*(x - r%x(j)) + r%inward_y(j)*(y - r%y(j)) + r%base(j)
      end do
    end do
  end subroutine inside_lines

  !> How far inside line i of r all corners of q are [m], the first of them again at the end; and the least so far of each.
  pure subroutine inside_line(r, i, q, d, least)
    type(rim), intent(in) :: r, q
    integer, intent(in) :: i
    real(c_double), intent(inout) :: d(room + 1), least(room)
    integer :: first, j
    do first = 0, q%filled - 1, lanes
      do j = first + 1, first + lanes
        d(j) = r%inward_x(i)*(q%x(j) - r%x(i)) + r%inward_y(i)*(q%y(j) - r%y(i)) + r%base(i)
        least(j) = min(least(j), d(j))
      end do
    end do
    d(q%count + 1) = d(1)
  end subroutine inside_line

  !> Corners of each face inside the other, and where their outlines cross. No gap is below `least`, the one of the axis.
  pure subroutine cut_faces(fa, fb, size_a, size_b, least, limit, p)
    type(outline), intent(in) :: fa, fb
    real(c_double), intent(in) :: size_a, size_b, least, limit
    type(patch), intent(inout) :: p
    type(rim) :: ra, rb
    type(crossings) :: c
    real(c_double) :: slack, low, high, x(2), within_a(room), within_b(room)
    integer :: i, k
    call make_rim(fa, ra)
    call make_rim(fb, rb)
    slack = outside*min(size_a, size_b) + 16*epsilon(slack)*(size_a + size_b)
    call compare(ra, rb, slack, within_a, within_b, c)
    if (fb%flat) then
      do i = 1, fa%count
        if (within_b(i) < -slack) cycle
        low = fb%level + dot_product(fb%slope, fa%x(:, i))
        call put(p, fa%x(:, i), low, fa%height(i), least, limit, fa%vertex(i))
      end do
    end if
    if (fa%flat) then
      do i = 1, fb%count
        if (within_a(i) < -slack) cycle
        high = fa%level + dot_product(fa%slope, fb%x(:, i))
        call put(p, fb%x(:, i), fb%height(i), high, least, limit, vertex_of_b + fb%vertex(i))
      end do
    end if
    do k = 1, c%count
      x = between(fa%x, c%i(k), fa%count, c%along_a(k))
      high = at_height(fa, c%i(k), c%along_a(k))
      low = at_height(fb, c%j(k), c%along_b(k))
      call put(p, x, low, high, least, limit, name_of_edges(int(fa%edge(c%i(k))), int(fb%edge(c%j(k)))))
    end do
  end subroutine cut_faces

  pure function between(x, i, n, along) result(y)
    real(c_double), intent(in) :: x(2, face_corners), along
    integer, intent(in) :: i, n
    real(c_double) :: y(2)
    y = x(:, i) + along*(x(:, merge(1, i + 1, i == n)) - x(:, i))
  end function between

  pure function at_height(f, i, along) result(h)
    type(outline), intent(in) :: f
    integer, intent(in) :: i
    real(c_double), intent(in) :: along
    real(c_double) :: h
    h = f%height(i) + along*(f%height(merge(1, i + 1, i == f%count)) - f%height(i))
  end function at_height

  !> How far inside all lines of B each corner of A is (within_b) and the other way, and where outlines cross, corners apart.
  pure subroutine compare(ra, rb, slack, within_a, within_b, c)
    type(rim), intent(in) :: ra, rb
    real(c_double), intent(in) :: slack
    real(c_double), intent(inout) :: within_a(room), within_b(room)
    type(crossings), intent(inout) :: c
    real(c_double) :: of_corner(room, 0:1), of_line(room + 1)
    integer :: i, j, next, now, other
    c%count = 0
    within_a(1:rb%filled) = huge(slack)
    now = 0
    call inside_lines(rb, ra%x(1), ra%y(1), of_corner(:, now))
    do i = 1, ra%count
      next = merge(1, i + 1, i == ra%count)
      other = 1 - now
      call inside_lines(rb, ra%x(next), ra%y(next), of_corner(:, other))
      call inside_line(ra, i, rb, of_line, within_a)
      within_b(i) = huge(slack)
      do j = 1, rb%count
        within_b(i) = min(within_b(i), of_corner(j, now))
        if ((of_corner(j, now) > 0 .eqv. of_corner(j, other) > 0) .or. (of_line(j) > 0 .eqv. of_line(j + 1) > 0)) cycle
        if (min(abs(of_corner(j, now)), abs(of_corner(j, other)), abs(of_line(j)), abs(of_line(j + 1))) <= slack) cycle
        if (c%count == 2*face_corners) cycle ! more than convex outlines have
        c%count = c%count + 1
        c%i(c%count) = i
        c%j(c%count) = j
        c%along_a(c%count) = of_corner(j, now)/(of_corner(j, now) - of_corner(j, other))
        c%along_b(c%count) = of_line(j)/(of_line(j) - of_line(j + 1))
      end do
      now = other
    end do
  end subroutine compare

  pure subroutine put(p, x, low, high, least, limit, name)
    type(patch), intent(inout) :: p
    real(c_double), intent(in) :: x(2), low, high, least, limit
    integer(c_int32_t), intent(in) :: name
    if (high - low <= limit) call add_point(p, [x, (high + low)/2], max(high - low, least), name)
  end subroutine put

  pure subroutine name_patch(p, fa, fb)
    type(patch), intent(inout) :: p
    type(outline), intent(in) :: fa, fb
    call name_points(p, fa%count, fa%x, fa%vertex, fb%count, fb%x, fb%vertex)
  end subroutine name_patch

end module hull_patch
