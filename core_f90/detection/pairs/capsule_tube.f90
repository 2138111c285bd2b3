!> Contact of a capsule with a tube seen from inside.
module capsule_tube
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: cairn_hulls, hulls_view, open_hulls
  use convex_shape, only: convex, see_capsule
  use facet_points, only: add, findings, settle
  use sphere_tube, only: cairn_pair_sphere_tube
  use tube_view, only: across_rims, is_beyond, see_tube, tube
  implicit none
  private
  public :: cairn_pair_capsule_tube

contains

  !> At both ends, as spheres: a wall that is hollow meets nothing between them, but the rim of an open end.
  subroutine cairn_pair_capsule_tube(n, hulls, a, b, between, radius_a, radius_b, direction_b, limit, count, gap, &
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
    real(c_double) :: x(3), depth(1), m(1, 3), y(1, 3)
    integer(c_int32_t) :: status(1)
    integer :: i, k

    call open_hulls(hulls, view)
    do i = 1, n
      call see_capsule(view, a(i), radius_a(i), p)
      call see_tube(radius_b(i), direction_b(i, :), q)
      f%count = 0
      f%slack = 16*epsilon(f%slack)*(p%size + p%layer)
      do k = 1, 2
        x = (2*k - 3)*p%half(3)*p%frame(:, 3)
        call cairn_pair_sphere_tube(1_c_int32_t, between(i, :) + x, [p%layer], radius_b(i:i), direction_b(i:i, :), depth, m, y, &
                                    status)
        if (depth(1) > limit(i) .or. status(1) == 1) cycle
        call add(f, x + y(1, :), m(1, :), depth(1), int(k, c_int32_t))
      end do
      if (.not. is_beyond(q, between(i, :))) &
        call across_rims(q, between(i, :), p%frame(:, 3), p%half(3), p%layer, limit(i), 3_c_int32_t, f)
      call settle(f, view%most, count(i), gap(:, i), normal(:, :, i), point(:, :, i), feature(:, i))
    end do
  end subroutine cairn_pair_capsule_tube

end module capsule_tube
