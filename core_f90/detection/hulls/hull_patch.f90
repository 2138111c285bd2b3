!> The patch of contact of two convex polyhedra: the faces that look at each other along the normal, cut by each other.
module hull_patch
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: solid
  use hull_support, only: lowest
  use patch_points, only: patch, add_point, name_of_edges, name_points, vertex_of_b
  implicit none
  private
  public :: outline, find_outline, outline_of_face, face_along, cut_faces, meet_barely, name_patch, across, face_corners

  integer, parameter :: face_corners = 1024 !< corners a face may have
  real(c_double), parameter :: steep = 1e-3_c_double !< a face whose normal is so far from the axis has no depths inside
  real(c_double), parameter :: outside = 1e-9_c_double !< of the smaller size: corners no farther out count as inside

  !> A face seen along the normal: corners counterclockwise across the normal, and along it.
  type :: outline
    integer :: count
    logical :: flat                                    !< wide enough to tell depths inside
    logical :: even = .false.                          !< no corner of it is the deepest but by rounding
    real(c_double) :: x(2, face_corners), height(face_corners) ! [m]
    real(c_double) :: slope(2), level                  !< height = level + slope . x inside
    integer(c_int32_t) :: vertex(face_corners), edge(face_corners) !< edge from this corner to the next
  end type outline

  integer, parameter :: lanes = 4, room = face_corners + lanes
  !> The lines of an outline, and its corners, padded with the last of them to whole SIMD lanes. The interior is on the left.
  type :: rim
    integer :: count, filled
    real(c_double), dimension(room) :: x, y, inward_x, inward_y, base
  end type rim

  ! Branch-free lists: each candidate is written to the place after the valid ones before it is known to count, since such branches
  ! would be mispredicted.

  !> Where the edge of A from corner i crosses that of B from corner j: how far inside the other's line each begins and ends [m].
  type :: crossings
    integer :: count
    integer, dimension(2*face_corners + 1) :: i, j
    real(c_double), dimension(2, 2*face_corners + 1) :: of_a, of_b
  end type crossings

  !> Points of the cut within the limit, across the normal and along it the middle of the gap [m].
  type :: offers
    integer :: count
    real(c_double) :: x(3, 4*face_corners + 1), gap(4*face_corners + 1)
    integer(c_int32_t) :: name(4*face_corners + 1)
  end type offers

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
    integer :: k, e, i
    do k = 1, f%count
      i = corner_vertex(merge(f%count + 1 - k, k, back))
      f%vertex(k) = i
      x = at(1) + v(i, 1)
      y = at(2) + v(i, 2)
      z = at(3) + v(i, 3)
      f%x(1, k) = t(1)*x + t(2)*y + t(3)*z
      f%x(2, k) = s(1)*x + s(2)*y + s(3)*z
      f%height(k) = n(1)*x + n(2)*y + n(3)*z
      e = merge(f%count - k, k, back)
      f%edge(k) = corner_edge(merge(f%count, e, e == 0))
    end do
  end subroutine see_corners

  !> The first of the normals that reach farthest along n.
  pure function face_along(faces, normal, n) result(face)
    integer, intent(in) :: faces
    real(c_double), intent(in) :: normal(faces, 3), n(3)
    integer :: face
    real(c_double) :: least
    call lowest(faces, normal, -n, least, face)
  end function face_along

  pure subroutine make_rim(f, r)
    type(outline), intent(in) :: f
    type(rim), intent(inout) :: r
    real(c_double) :: length(lanes)
    integer :: i, next, first
    r%count = f%count
    r%filled = (f%count + lanes - 1)/lanes*lanes
    do i = 1, f%count
      next = merge(1, i + 1, i == f%count)
      r%x(i) = f%x(1, i)
      r%y(i) = f%x(2, i)
      r%inward_x(i) = f%x(2, i) - f%x(2, next)
      r%inward_y(i) = f%x(1, next) - f%x(1, i)
    end do
    do i = f%count + 1, r%filled
      r%x(i) = r%x(f%count)
      r%y(i) = r%y(f%count)
      r%inward_x(i) = r%inward_x(f%count)
      r%inward_y(i) = r%inward_y(f%count)
    end do
    do first = 0, r%filled - 1, lanes
      do i = first + 1, first + lanes
        length(i - first) = sqrt(r%inward_x(i)**2 + r%inward_y(i)**2)
      end do
      do i = first + 1, first + lanes
        r%base(i) = merge(0.0_c_double, -huge(length), length(i - first) > 0) ! nothing is inside a line without length
        length(i - first) = 1/merge(length(i - first), 1.0_c_double, length(i - first) > 0)
        r%inward_x(i) = r%inward_x(i)*length(i - first)
        r%inward_y(i) = r%inward_y(i)*length(i - first)
      end do
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
    type(offers) :: o
    real(c_double) :: slack, within_a(room), within_b(room)
    integer :: k
    call make_rim(fa, ra)
    call make_rim(fb, rb)
    slack = outside*min(size_a, size_b) + 16*epsilon(slack)*(size_a + size_b)
    call compare(ra, rb, slack, within_a, within_b, c)
    o%count = 0
    if (fb%flat) call offer_corners(fa, fb, within_b, slack, 1.0_c_double, limit, 0_c_int32_t, o)
    if (fa%flat) call offer_corners(fb, fa, within_a, slack, -1.0_c_double, limit, vertex_of_b, o)
    call offer_crossings(fa, fb, c, limit, o)
    do k = 1, o%count
      call add_point(p, o%x(:, k), max(o%gap(k), least), o%name(k))
    end do
  end subroutine cut_faces

  !> True if faces that stand square to the normal overlap by no more than a ten-thousandth. A body that slides over the seam of two
  !> flush faces, offset by the error of a step, would otherwise meet a side of the second one. p: their intersection.
  pure function meet_barely(fa, fb, p)
    type(outline), intent(in) :: fa, fb
    type(patch), intent(in) :: p
    logical :: meet_barely
    real(c_double), parameter :: level = 1e-2_c_double
    meet_barely = .false.
    if (.not. (fa%flat .and. fb%flat)) return
    if (max(sum(fa%slope**2), sum(fb%slope**2)) > level**2) return
    if (wide(p)) return
    meet_barely = overlap_barely(fa, fb)
    if (.not. meet_barely) meet_barely = overlap_barely(fb, fa)
  end function meet_barely

  !> True if the points of an intersection suffice to show that it is no sliver.
  pure function wide(p)
    type(patch), intent(in) :: p
    logical :: wide
    real(c_double) :: d(2), e(2)
    integer :: k
    wide = .false.
    if (p%count < 3) return
    d = p%x(1:2, 2) - p%x(1:2, 1)
    do k = 3, p%count
      e = p%x(1:2, k) - p%x(1:2, 1)
      wide = wide .or. abs(d(1)*e(2) - d(2)*e(1)) > 1e-3_c_double*p%size**2
    end do
  end function wide

  !> True if across some side of a the two outlines overlap, or are apart, by less than a ten-thousandth of the narrower one.
  pure function overlap_barely(a, b) result(barely)
    type(outline), intent(in) :: a, b
    logical :: barely
    real(c_double), parameter :: share = 1e-4_c_double
    real(c_double) :: inward(2), wide_a, low, high, d
    integer :: i, k, next
    barely = .false.
    do i = 1, a%count
      next = merge(1, i + 1, i == a%count)
      inward = [a%x(2, i) - a%x(2, next), a%x(1, next) - a%x(1, i)]
      wide_a = 0
      do k = 1, a%count
        wide_a = max(wide_a, dot_product(inward, a%x(:, k) - a%x(:, i)))
      end do
      low = huge(low)
      high = -huge(high)
      do k = 1, b%count
        d = dot_product(inward, b%x(:, k) - a%x(:, i))
        low = min(low, d)
        high = max(high, d)
      end do
      d = min(wide_a, high) - max(0.0_c_double, low)
      barely = barely .or. abs(d) < share*min(wide_a, high - low)
    end do
  end function overlap_barely

  !> Corners of f that are inside the other face. sense: 1 if f is that of A, else -1.
  pure subroutine offer_corners(f, other, within, slack, sense, limit, name, o)
    type(outline), intent(in) :: f, other
    real(c_double), intent(in) :: within(room), slack, sense, limit
    integer(c_int32_t), intent(in) :: name
    type(offers), intent(inout) :: o
    real(c_double) :: opposite
    integer :: i, k
    do i = 1, f%count
      k = o%count + 1
      opposite = other%level + other%slope(1)*f%x(1, i) + other%slope(2)*f%x(2, i)
      o%x(1, k) = f%x(1, i)
      o%x(2, k) = f%x(2, i)
      o%x(3, k) = (f%height(i) + opposite)/2
      o%gap(k) = sense*(f%height(i) - opposite)
      o%name(k) = name + f%vertex(i)
      o%count = o%count + iand(merge(1, 0, within(i) >= -slack), merge(1, 0, o%gap(k) <= limit))
    end do
  end subroutine offer_corners

  pure subroutine offer_crossings(fa, fb, c, limit, o)
    type(outline), intent(in) :: fa, fb
    type(crossings), intent(in) :: c
    real(c_double), intent(in) :: limit
    type(offers), intent(inout) :: o
    real(c_double) :: along_a, along_b, low, high
    integer :: i, j, k, m, next
    do m = 1, c%count
      k = o%count + 1
      i = c%i(m)
      j = c%j(m)
      along_a = c%of_a(1, m)/(c%of_a(1, m) - c%of_a(2, m))
      along_b = c%of_b(1, m)/(c%of_b(1, m) - c%of_b(2, m))
      next = merge(1, i + 1, i == fa%count)
      o%x(1, k) = fa%x(1, i) + along_a*(fa%x(1, next) - fa%x(1, i))
      o%x(2, k) = fa%x(2, i) + along_a*(fa%x(2, next) - fa%x(2, i))
      high = fa%height(i) + along_a*(fa%height(next) - fa%height(i))
      next = merge(1, j + 1, j == fb%count)
      low = fb%height(j) + along_b*(fb%height(next) - fb%height(j))
      o%x(3, k) = (high + low)/2
      o%gap(k) = high - low
      o%name(k) = name_of_edges(int(fa%edge(i)), int(fb%edge(j)))
      o%count = o%count + merge(1, 0, o%gap(k) <= limit)
    end do
  end subroutine offer_crossings

  !> How far inside all lines of B each corner of A is (within_b) and the other way, and where outlines cross, corners apart.
  pure subroutine compare(ra, rb, slack, within_a, within_b, c)
    type(rim), intent(in) :: ra, rb
    real(c_double), intent(in) :: slack
    real(c_double), intent(inout) :: within_a(room), within_b(room)
    type(crossings), intent(inout) :: c
    real(c_double) :: of_corner(room, 0:1), of_line(room + 1), least, apart
    integer :: i, j, k, next, now, other, cross
    c%count = 0
    within_a(1:rb%filled) = huge(slack)
    now = 0
    call inside_lines(rb, ra%x(1), ra%y(1), of_corner(:, now))
    do i = 1, ra%count
      next = merge(1, i + 1, i == ra%count)
      other = 1 - now
      call inside_lines(rb, ra%x(next), ra%y(next), of_corner(:, other))
      call inside_line(ra, i, rb, of_line, within_a)
      least = huge(least)
      do j = 1, rb%count
        least = min(least, of_corner(j, now))
        k = min(c%count, 2*face_corners) + 1 ! convex outlines have no more
        c%i(k) = i
        c%j(k) = j
        c%of_a(1, k) = of_corner(j, now)
        c%of_a(2, k) = of_corner(j, other)
        c%of_b(1, k) = of_line(j)
        c%of_b(2, k) = of_line(j + 1)
        apart = min(min(abs(of_corner(j, now)), abs(of_corner(j, other))), min(abs(of_line(j)), abs(of_line(j + 1))))
        cross = ieor(merge(1, 0, of_corner(j, now) > 0), merge(1, 0, of_corner(j, other) > 0))
        cross = iand(cross, ieor(merge(1, 0, of_line(j) > 0), merge(1, 0, of_line(j + 1) > 0)))
        c%count = k - 1 + iand(cross, merge(1, 0, apart > slack))
      end do
      within_b(i) = least
      now = other
    end do
  end subroutine compare

  pure subroutine name_patch(p, fa, fb)
    type(patch), intent(inout) :: p
    type(outline), intent(in) :: fa, fb
    call name_points(p, fa%count, fa%x, fa%vertex, fb%count, fb%x, fb%vertex)
  end subroutine name_patch

end module hull_patch
