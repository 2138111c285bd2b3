!> The points of contact of two convex shapes: their sides, ends and faces that look along the normal, cut by each other.
module convex_contact
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use convex_axis, only: axis_between
  use convex_shape, only: convex, is_cylinder, is_polyhedron, is_segment, is_superquadric, support
  use flat_faces, only: face_of_superquadric
  use hull_patch, only: across, cut_faces, find_outline, outline
  use patch_points, only: add_deepest, add_point, clear_patch, name_points, patch, reduce_patch, sort_by_name, vertex_of_b
  implicit none
  private
  public :: touch, touch_plane

  integer, parameter :: ring = 16            !< corners of the end of a cylinder
  real(c_double), parameter :: turn(ring) = 2*acos(-1.0_c_double)/ring*[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]
  real(c_double), parameter :: cosine(ring) = cos(turn), sine(ring) = sin(turn)
  real(c_double), parameter :: upright = 0.7_c_double !< cosine: an end of a cylinder looks along the normal, else its side
  real(c_double), parameter :: parallel = 0.1_c_double !< sine of two sides that have a line of contact
  real(c_double), parameter :: turned = 1e-4_c_double !< sine: a cylinder that leans by less has no lowest point of its end
  integer(c_int32_t), parameter :: deepest_name = 4000

contains

  !> Contacts of a, at `at` from b: at most `most`; points from the centre of a.
  subroutine touch(a, b, at, limit, most, count, gap, normal, point, feature)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), limit
    integer, intent(in) :: most
    integer(c_int32_t), intent(out) :: count, feature(most)
    real(c_double), intent(out) :: gap(most), normal(3, most), point(3, most)
    real(c_double) :: n(3), t(3), s(3), depth, x(3), y(3), scale
    type(outline) :: fa, fb
    type(patch) :: cut
    logical :: apart, rocking
    count = 0
    call axis_between(a, b, at, limit, n, depth, x, y, apart)
    if (apart) return
    scale = a%size + b%size + a%layer + b%layer
    call clear_patch(cut, min(a%size + a%layer, b%size + b%layer))
    call across(n, t, s)
    fa%count = 0
    fb%count = 0
    if (most > 1) then
      call side(a, at, n, t, s, -1.0_c_double, fa)
      call side(b, [0.0_c_double, 0.0_c_double, 0.0_c_double], n, t, s, 1.0_c_double, fb)
    end if
    call take_ties(fa, fb, cut)
    if (fa%count > 2 .and. fb%count > 2) call cut_faces(fa, fb, a%size, b%size, depth, limit, cut)
    if (fa%count == 2 .and. fb%count > 2) call cut_line(fa, fb, 1.0_c_double, depth, limit, 0, cut)
    if (fa%count > 2 .and. fb%count == 2) call cut_line(fb, fa, -1.0_c_double, depth, limit, vertex_of_b, cut)
    if (fa%count == 2 .and. fb%count == 2) call cut_lines(fa, fb, depth, limit, cut)
    x = ((x - a%layer*n) + (y + b%layer*n))/2
    rocking = rocks(a, fa) .or. rocks(b, fb)
    if (rocking) call reduce_patch(cut, most - 1)
    call add_deepest(cut, [dot_product(t, x), dot_product(s, x), dot_product(n, x)], depth, &
                     max(merge(cut%tie, 0.0_c_double, (fa%even .or. fb%even) .and. .not. rocking), 256*epsilon(scale)*scale), &
                     deepest_name)
    call store(cut, at, n, t, s, fa, fb, rocking, most, count, gap, normal, point, feature)
  end subroutine touch

  !> True if c touches with the flat face of a superquadric, whose corners are a little behind its lowest point: all of them count.
  pure logical function rocks(c, f)
    type(convex), intent(in) :: c
    type(outline), intent(in) :: f
    rocks = c%kind == is_superquadric .and. f%count > 0
  end function rocks

  !> Contacts of a with the half space behind a plane through 0.
  subroutine touch_plane(a, at, n, limit, most, count, gap, normal, point, feature)
    type(convex), intent(in) :: a
    real(c_double), intent(in) :: at(3), n(3), limit
    integer, intent(in) :: most
    integer(c_int32_t), intent(out) :: count, feature(most)
    real(c_double), intent(out) :: gap(most), normal(3, most), point(3, most)
    real(c_double) :: t(3), s(3), x(3), height
    type(outline) :: fa, fb
    type(patch) :: cut
    integer :: k
    count = 0
    x = at + support(a, -n) - a%layer*n
    height = dot_product(n, x)
    if (height > limit) return
    call clear_patch(cut, a%size + a%layer)
    call across(n, t, s)
    fb%count = 0
    call side(a, at, n, t, s, -1.0_c_double, fa)
    call take_ties(fa, fb, cut)
    do k = 1, fa%count
      if (fa%height(k) <= limit) &
        call add_point(cut, [fa%x(:, k), fa%height(k)/2], max(fa%height(k), height), fa%vertex(k))
    end do
    call add_deepest(cut, [dot_product(t, x), dot_product(s, x), height/2], height, &
                     max(merge(cut%tie, 0.0_c_double, fa%even), 16*epsilon(height)*(a%size + a%layer)), deepest_name)
    call store(cut, at, n, t, s, fa, fb, rocks(a, fa), most, count, gap, normal, point, feature)
  end subroutine touch_plane

  pure subroutine store(cut, at, n, t, s, fa, fb, all_count, most, count, gap, normal, point, feature)
    type(patch), intent(inout) :: cut
    type(outline), intent(in) :: fa, fb
    logical, intent(in) :: all_count
    integer, intent(in) :: most
    real(c_double), intent(in) :: at(3), n(3), t(3), s(3)
    integer(c_int32_t), intent(out) :: count, feature(most)
    real(c_double), intent(out) :: gap(most), normal(3, most), point(3, most)
    integer :: k
    call reduce_patch(cut, most)
    if (all_count) then
      call sort_by_name(cut)
    else
      call name_points(cut, fa%count, fa%x, fa%vertex, fb%count, fb%x, fb%vertex)
    end if
    count = cut%count
    do k = 1, cut%count
      gap(k) = cut%gap(k)
      normal(:, k) = n
      point(:, k) = t*cut%x(1, k) + s*cut%x(2, k) + n*cut%x(3, k) - at
      feature(k) = cut%name(k)
    end do
  end subroutine store

  !> Breaks ties between the corners of the end of a cylinder that does not lean: rounding would choose the deepest. The same few
  !> points then represent the end from step to step, so that laws keep their memory.
  pure subroutine take_ties(fa, fb, cut)
    type(outline), intent(in) :: fa, fb
    type(patch), intent(inout) :: cut
    if (fa%count > 2 .and. fa%even) cut%tie = turned*cut%size
    if (fb%count > 2 .and. fb%even) cut%tie = turned*cut%size
  end subroutine take_ties

  !> Features of c that look along sense*n: none for a point, two corners of a line, more of a face; heights include the layer.
  pure subroutine side(c, at, n, t, s, sense, f)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: at(3), n(3), t(3), s(3), sense
    type(outline), intent(inout) :: f
    real(c_double) :: high, w(3), length, corner(3, 4), m(3)
    integer :: k
    f%count = 0
    f%even = .false.
    high = sense*dot_product(c%frame(:, 3), n)
    if (c%kind == is_polyhedron) then
      call find_outline(c%hull, at, n, t, s, sense, f)
    else if (c%kind == is_cylinder .and. abs(high) > upright) then
      call end_of_cylinder(c, at, n, t, s, sense, high, f)
    else if (c%kind == is_cylinder .or. c%kind == is_segment) then
      w = 0
      if (c%kind == is_cylinder) then
        w = sense*n - high*c%frame(:, 3)
        length = sqrt(dot_product(w, w))
        w = (c%half(1)/length)*w
      end if
      f%count = 2
      call put_corner(f, 1, at + w - c%half(3)*c%frame(:, 3), sense*c%layer, n, t, s)
      call put_corner(f, 2, at + w + c%half(3)*c%frame(:, 3), sense*c%layer, n, t, s)
    else if (c%kind == is_superquadric) then
      call face_of_superquadric(c, sense*n, f%count, corner, m)
      do k = 1, f%count
        call put_corner(f, merge(f%count + 1 - k, k, sense < 0), at + corner(:, k), sense*c%layer, n, t, s)
      end do
      if (f%count > 2) call lay_flat(f, m, at + corner(:, 1), sense*c%layer, n, t, s)
    end if
  end subroutine side

  pure subroutine put_corner(f, k, x, layer, n, t, s)
    type(outline), intent(inout) :: f
    integer, intent(in) :: k
    real(c_double), intent(in) :: x(3), layer, n(3), t(3), s(3)
    f%x(:, k) = [dot_product(t, x), dot_product(s, x)]
    f%height(k) = dot_product(n, x) + layer
    f%vertex(k) = int(k, c_int32_t)
    f%edge(k) = int(k, c_int32_t)
  end subroutine put_corner

  !> Corners counterclockwise seen against n; the first is the one that reaches farthest, if the cylinder leans, else it stays
  !> where it is in space.
  pure subroutine end_of_cylinder(c, at, n, t, s, sense, high, f)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: at(3), n(3), t(3), s(3), sense, high
    type(outline), intent(inout) :: f
    real(c_double) :: axis(3), e(3), g(3), centre(3)
    integer :: k
    axis = sign(1.0_c_double, high*sense)*c%frame(:, 3) ! along n
    e = sense*(n - dot_product(n, axis)*axis)
    if (dot_product(e, e) > turned*turned) then
      e = e/sqrt(dot_product(e, e))
    else
      e = 0
      e(merge(3, 1, abs(axis(3)) < 0.9_c_double)) = 1 ! an axis of space that rounding does not change
      e = e - dot_product(axis, e)*axis
      e = e/sqrt(dot_product(e, e))
      f%even = .true.
    end if
    g = [axis(2)*e(3) - axis(3)*e(2), axis(3)*e(1) - axis(1)*e(3), axis(1)*e(2) - axis(2)*e(1)]
    centre = at + sense*c%half(3)*axis
    f%count = ring
    do k = 1, ring
      call put_corner(f, k, centre + c%half(1)*(cosine(k)*e + sine(k)*g), sense*c%layer, n, t, s)
    end do
    call lay_flat(f, axis, centre, sense*c%layer, n, t, s)
  end subroutine end_of_cylinder

  !> A face in the plane through x with the normal `axis`.
  pure subroutine lay_flat(f, axis, x, layer, n, t, s)
    type(outline), intent(inout) :: f
    real(c_double), intent(in) :: axis(3), x(3), layer, n(3), t(3), s(3)
    f%flat = .true.
    f%slope = -[dot_product(axis, t), dot_product(axis, s)]/dot_product(axis, n)
    f%level = dot_product(axis, x)/dot_product(axis, n) + layer
  end subroutine lay_flat

  !> The part of a line that is within the outline of a face; sense 1 if the line is of A, -1 if it is of B.
  pure subroutine cut_line(line, face, sense, least, limit, named, p)
    type(outline), intent(in) :: line, face
    real(c_double), intent(in) :: sense, least, limit
    integer(c_int32_t), intent(in) :: named
    type(patch), intent(inout) :: p
    real(c_double) :: first, last, e(2), from, to, along(2), x(2), h, other, gap
    integer(c_int32_t) :: name(2)
    integer :: k, next
    if (.not. face%flat) return
    first = 0
    last = 1
    name = named + line%vertex(1:2)
    do k = 1, face%count
      next = merge(1, k + 1, k == face%count)
      e = face%x(:, next) - face%x(:, k)
      from = e(1)*(line%x(2, 1) - face%x(2, k)) - e(2)*(line%x(1, 1) - face%x(1, k))
      to = e(1)*(line%x(2, 2) - face%x(2, k)) - e(2)*(line%x(1, 2) - face%x(1, k))
      if (from < 0 .and. to < 0) return
      if (from >= 0 .and. to >= 0) cycle
      if (from < 0 .and. from/(from - to) > first) then
        first = from/(from - to)
        name(1) = named + 2 + face%edge(k)
      else if (to < 0 .and. from/(from - to) < last) then
        last = from/(from - to)
        name(2) = named + 2 + face%edge(k)
      end if
    end do
    if (first > last) return
    along = [first, last]
    do k = 1, 2
      x = line%x(:, 1) + along(k)*(line%x(:, 2) - line%x(:, 1))
      h = line%height(1) + along(k)*(line%height(2) - line%height(1))
      other = face%level + dot_product(face%slope, x)
      gap = sense*(h - other)
      if (gap <= limit) call add_point(p, [x, (h + other)/2], max(gap, least), name(k))
    end do
  end subroutine cut_line

  !> The ends of the part that two lines nearly parallel have in common.
  pure subroutine cut_lines(fa, fb, least, limit, p)
    type(outline), intent(in) :: fa, fb
    real(c_double), intent(in) :: least, limit
    type(patch), intent(inout) :: p
    real(c_double) :: d(2), e(2), dd, ee, x(2), y(2), along, h, low
    integer :: k
    d = fa%x(:, 2) - fa%x(:, 1)
    e = fb%x(:, 2) - fb%x(:, 1)
    dd = dot_product(d, d)
    ee = dot_product(e, e)
    if (.not. (d(1)*e(2) - d(2)*e(1))**2 < parallel*parallel*dd*ee) return
    do k = 1, 2
      along = dot_product(e, fa%x(:, k) - fb%x(:, 1))/ee
      if (along < 0 .or. along > 1) cycle
      y = fb%x(:, 1) + along*e
      low = fb%height(1) + along*(fb%height(2) - fb%height(1))
      if (fa%height(k) - low <= limit) &
        call add_point(p, [(fa%x(:, k) + y)/2, (fa%height(k) + low)/2], max(fa%height(k) - low, least), fa%vertex(k))
    end do
    do k = 1, 2
      along = dot_product(d, fb%x(:, k) - fa%x(:, 1))/dd
      if (along < 0 .or. along > 1) cycle
      x = fa%x(:, 1) + along*d
      h = fa%height(1) + along*(fa%height(2) - fa%height(1))
      if (h - fb%height(k) <= limit) &
        call add_point(p, [(fb%x(:, k) + x)/2, (h + fb%height(k))/2], max(h - fb%height(k), least), vertex_of_b + fb%vertex(k))
    end do
  end subroutine cut_lines

end module convex_contact
