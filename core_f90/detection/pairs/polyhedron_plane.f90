!> Contact of a convex polyhedron with a half space under a plane.
module polyhedron_plane
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls, solid, view_solid
  use hull_patch, only: across, find_outline, outline
  use patch_points, only: add_deepest, add_point, clear_patch, name_points, patch, reduce_patch
  implicit none
  private
  public :: cairn_pair_polyhedron_plane

contains

  !> Along the normal of the plane: the corners of the face that looks at it, and the lowest corner.
  subroutine cairn_pair_polyhedron_plane(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, &
                              normal, point, feature) bind(c)
    integer(c_int32_t), value :: n                      !< pairs
    type(cairn_hulls), intent(in) :: hulls
    integer(c_int32_t), intent(in) :: a(n), b(n)        !< contactors
    real(c_double), intent(in) :: between(n, 3)         !< centre of A - centre of B [m]
    real(c_double), intent(in) :: radius_a(n)           !< of the ball around A [m]
    real(c_double), intent(in) :: radius_b(n)           !< not read
    real(c_double), intent(in) :: direction_b(n, 4)     !< normal out of the solid, unit; the last is not read
    real(c_double), intent(in) :: limit(n)              !< gaps above do not count [m]
    integer(c_int32_t), intent(out) :: count(n)         !< points of each pair
    real(c_double), intent(out) :: gap(hulls%most, n)   !< negative when overlapping [m]
    real(c_double), intent(out) :: normal(3, hulls%most, n) !< unit, from B to A
    real(c_double), intent(out) :: point(3, hulls%most, n)  !< middle of the gap - centre of A [m]
    integer(c_int32_t), intent(out) :: feature(hulls%most, n) !< names of the points within the pair
    type(hulls_view) :: view
    type(solid) :: p
    type(patch) :: cut
    type(outline) :: f
    real(c_double) :: m(3), t(3), s(3), x(3)
    integer :: i, k, deepest

    call open_hulls(hulls, view)
    do i = 1, n
      call view_solid(view, a(i), radius_a(i), p)
      m = direction_b(i, 1:3)
      call across(m, t, s)
      call find_outline(p, between(i, :), m, t, s, -1.0_c_double, f)
      call clear_patch(cut, p%size)
      do k = 1, f%count
        if (f%height(k) <= limit(i)) call add_point(cut, [f%x(:, k), f%height(k)/2], f%height(k), f%vertex(k))
      end do
      call lowest(p, between(i, :), m, deepest, x)
      if (dot_product(m, x) <= limit(i)) &
        call add_deepest(cut, [dot_product(t, x), dot_product(s, x), dot_product(m, x)/2], dot_product(m, x), &
                         16*epsilon(x)*p%size, int(deepest, c_int32_t))
      call reduce_patch(cut, view%most)
      call name_points(cut, f%count, f%x, f%vertex, 0, f%x, f%vertex)
      count(i) = cut%count
      do k = 1, cut%count
        gap(k, i) = cut%gap(k)
        normal(:, k, i) = m
        point(:, k, i) = t*cut%x(1, k) + s*cut%x(2, k) + m*cut%x(3, k) - between(i, :)
        feature(k, i) = cut%name(k)
      end do
    end do
  end subroutine cairn_pair_polyhedron_plane

  pure subroutine lowest(p, at, m, which, x)
    type(solid), intent(in) :: p
    real(c_double), intent(in) :: at(3), m(3)
    integer, intent(out) :: which
    real(c_double), intent(out) :: x(3)
    real(c_double) :: low, height
    integer :: k
    low = huge(low)
    which = 1
    do k = 1, p%vertices
      height = m(1)*p%v(k, 1) + m(2)*p%v(k, 2) + m(3)*p%v(k, 3)
      if (height < low) then
        low = height
        which = k
      end if
    end do
    x = at + p%v(which, :)
  end subroutine lowest

end module polyhedron_plane
