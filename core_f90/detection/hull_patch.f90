!> The patch of contact of two convex polyhedra: the faces that look at each other along the normal, cut by each other.
module hull_patch
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: solid
  use patch_points, only: patch, add_point, name_of_edges, name_points, vertex_of_b
  implicit none
  private
  public :: outline, find_outline, cut_faces, name_patch, across, face_corners

  integer, parameter :: face_corners = 1024 !< corners a face may have
  real(c_double), parameter :: steep = 1e-3_c_double !< a face whose normal is so far from the axis has no depths inside
  real(c_double), parameter :: outside = 1e-9_c_double !< of the smaller size: corners no farther out count as inside

  !> A face seen along the normal: corners counterclockwise across the normal, and along it.
  type :: outline
    integer :: count = 0
    logical :: flat = .false.            !< wide enough to tell depths inside
    real(c_double) :: x(2, face_corners), height(face_corners) ! [m]
    real(c_double) :: slope(2) = 0, level = 0  !< height = level + slope . x inside
    integer(c_int32_t) :: vertex(face_corners), edge(face_corners) !< edge from this corner to the next
  end type outline

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
    real(c_double) :: best, look, x(3), m(3)
    integer :: i, k, c, face, base
    face = 1
    best = -2
    do i = 1, p%faces
      look = sense*(n(1)*p%normal(i, 1) + n(2)*p%normal(i, 2) + n(3)*p%normal(i, 3))
      if (look > best) then
        best = look
        face = i
      end if
    end do
    base = p%first_corner(face)
    f%count = p%first_corner(face + 1) - base
    do k = 1, f%count
      ! seen from outside a face that looks against the normal, the turn is the other one
      c = base + k
      if (sense < 0) c = base + f%count + 1 - k
      f%vertex(k) = p%corner_vertex(c)
      x = at + p%v(f%vertex(k), :)
      f%x(:, k) = [dot_product(t, x), dot_product(s, x)]
      f%height(k) = dot_product(n, x)
      if (sense < 0) c = base + modulo(f%count - k - 1, f%count) + 1
      f%edge(k) = p%corner_edge(c)
    end do
    m = p%normal(face, :)
    look = dot_product(m, n)
    f%flat = abs(look) > steep
    if (.not. f%flat) return
    f%slope = -[dot_product(m, t), dot_product(m, s)]/look
    f%level = (p%offset(face) + dot_product(m, at))/look
  end subroutine find_outline

  !> How far inside line i of an outline a point is [m].
  pure function inside_line(f, i, x) result(d)
    type(outline), intent(in) :: f
    integer, intent(in) :: i
    real(c_double), intent(in) :: x(2)
    real(c_double) :: d, e(2), length
    integer :: next
    next = merge(1, i + 1, i == f%count)
    e = f%x(:, next) - f%x(:, i)
    length = sqrt(e(1)*e(1) + e(2)*e(2))
    d = -huge(d)
    if (length > 0) d = (e(1)*(x(2) - f%x(2, i)) - e(2)*(x(1) - f%x(1, i)))/length
  end function inside_line

  pure function inside(f, x, slack)
    type(outline), intent(in) :: f
    real(c_double), intent(in) :: x(2), slack
    logical :: inside
    integer :: i
    inside = .false.
    do i = 1, f%count
      if (inside_line(f, i, x) < -slack) return
    end do
    inside = .true.
  end function inside

  !> Corners of each face inside the other, and where their outlines cross. No gap is below `least`, the one of the axis.
  pure subroutine cut_faces(fa, fb, size_a, size_b, least, limit, p)
    type(outline), intent(in) :: fa, fb
    real(c_double), intent(in) :: size_a, size_b, least, limit
    type(patch), intent(inout) :: p
    real(c_double) :: slack, low, high
    integer :: i
    slack = outside*min(size_a, size_b) + 16*epsilon(slack)*(size_a + size_b)
    if (fb%flat) then
      do i = 1, fa%count
        low = fb%level + dot_product(fb%slope, fa%x(:, i))
        if (fa%height(i) - low > limit) cycle
        if (.not. inside(fb, fa%x(:, i), slack)) cycle
        call put(p, fa%x(:, i), low, fa%height(i), least, limit, fa%vertex(i))
      end do
    end if
    if (fa%flat) then
      do i = 1, fb%count
        high = fa%level + dot_product(fa%slope, fb%x(:, i))
        if (high - fb%height(i) > limit) cycle
        if (.not. inside(fa, fb%x(:, i), slack)) cycle
        call put(p, fb%x(:, i), fb%height(i), high, least, limit, vertex_of_b + fb%vertex(i))
      end do
    end if
    call cross_outlines(fa, fb, slack, least, limit, p)
  end subroutine cut_faces

  pure subroutine cross_outlines(fa, fb, slack, least, limit, p)
    type(outline), intent(in) :: fa, fb
    real(c_double), intent(in) :: slack, least, limit
    type(patch), intent(inout) :: p
    real(c_double) :: from, to, start, end, along, x(2), high, low
    integer :: i, j, next_i, next_j
    do i = 1, fa%count
      next_i = merge(1, i + 1, i == fa%count)
      do j = 1, fb%count
        next_j = merge(1, j + 1, j == fb%count)
        from = inside_line(fb, j, fa%x(:, i))
        to = inside_line(fb, j, fa%x(:, next_i))
        if (min(abs(from), abs(to)) <= slack .or. (from > 0 .eqv. to > 0)) cycle
        start = inside_line(fa, i, fb%x(:, j))
        end = inside_line(fa, i, fb%x(:, next_j))
        if (min(abs(start), abs(end)) <= slack .or. (start > 0 .eqv. end > 0)) cycle
        along = from/(from - to)
        x = fa%x(:, i) + along*(fa%x(:, next_i) - fa%x(:, i))
        high = fa%height(i) + along*(fa%height(next_i) - fa%height(i))
        along = start/(start - end)
        low = fb%height(j) + along*(fb%height(next_j) - fb%height(j))
        call put(p, x, low, high, least, limit, name_of_edges(int(fa%edge(i)), int(fb%edge(j))))
      end do
    end do
  end subroutine cross_outlines

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
