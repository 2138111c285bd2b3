!> Contact of a cylinder with a tube seen from inside.
module cylinder_tube
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls
  use convex_shape, only: convex, see_cylinder
  use facet_points, only: findings, settle
  use tube_view, only: across_rims, at_point, is_beyond, look_across, see_tube, tops, tube
  implicit none
  private
  public :: cairn_pair_cylinder_tube

contains

  !> The points of both ends that are farthest from the axis of the tube, one or two each, two of a line if it lies along the
  !> wall; and where its side crosses the rim of an open end.
  subroutine cairn_pair_cylinder_tube(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, &
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
      call see_cylinder(view, a(i), radius_a(i), p)
      call see_tube(radius_b(i), direction_b(i, :), q)
      f%count = 0
      f%slack = 16*epsilon(f%slack)*p%size
      if (.not. is_beyond(q, between(i, :))) then
        call at_ends(p, q, between(i, :), limit(i), f)
        call across_rims(q, between(i, :), p%frame(:, 3), p%half(3), p%half(1), limit(i), 5_c_int32_t, f)
      end if
      call settle(f, view%most, count(i), gap(:, i), normal(:, :, i), point(:, :, i), feature(:, i))
    end do
  end subroutine cairn_pair_cylinder_tube

  !> Seen along the tube the rim of an end is an ellipse.
  pure subroutine at_ends(p, q, at, limit, f)
    type(convex), intent(in) :: p
    type(tube), intent(in) :: q
    real(c_double), intent(in) :: at(3), limit
    type(findings), intent(inout) :: f
    real(c_double) :: g(3), w(3), k(3), centre(3), z(2, 2), short
    integer :: i, j, found
    call look_across(q, p%frame(:, 3), g, w, k)
    short = dot_product(k, w)
    do i = 1, 2
      centre = at + (2*i - 3)*p%half(3)*p%frame(:, 3)
      call tops(dot_product(centre, g), short*dot_product(centre, w), p%half(1)*(1 - short)*(1 + short), found, z)
      do j = 1, found
        call at_point(q, at, centre + p%half(1)*(z(1, j)*g + z(2, j)*k), limit, int(2*i + j - 2, c_int32_t), f)
      end do
    end do
  end subroutine at_ends

end module cylinder_tube
