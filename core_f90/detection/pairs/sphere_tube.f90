!> Contact of a sphere with a tube seen from inside: a drum, a silo, a pipe with open ends.
module sphere_tube
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use separation, only: separate
  implicit none
  private
  public :: cairn_pair_sphere_tube

contains

  !> Towards the axis; beyond an open end, with its rim. The surface is one-sided: outside is solid all along an endless tube,
  !> while a sphere clear of the outer side of a finite one does not touch it. On the axis, the normal is the first of the
  !> directions across it.
  pure subroutine cairn_pair_sphere_tube(n, between, radius_a, radius_b, direction_b, gap, normal, point, status) bind(c)
    integer(c_int32_t), value :: n                      !< pairs
    real(c_double), intent(in) :: between(n, 3)         !< centre of A - centre of B [m]
    real(c_double), intent(in) :: radius_a(n)           !< of the sphere [m]
    real(c_double), intent(in) :: radius_b(n)           !< of the tube [m]
    real(c_double), intent(in) :: direction_b(n, 4)     !< unit axis, then half length [m], infinite for an endless tube
    real(c_double), intent(out) :: gap(n)               !< negative when overlapping [m]
    real(c_double), intent(out) :: normal(n, 3)         !< unit, from B to A
    real(c_double), intent(out) :: point(n, 3)          !< middle of the gap - centre of A [m]
    integer(c_int32_t), intent(out) :: status(n)        !< 1: does not touch; 2: the sphere is wider than the tube
    integer(c_int32_t) :: i, k
    real(c_double) :: along(n), beyond(n), axis(3), radial(n, 3), direction(n, 3), rho(n)
    real(c_double) :: section(n, 2), section_normal(n, 2), distance(n)
    do i = 1, n
      axis = direction_b(i, 1:3)
      along(i) = dot_product(between(i, :), axis)
      radial(i, :) = between(i, :) - along(i)*axis
    end do
    call separate(n, 3, radial, rho, direction)
    ! In the half plane of the axis and the sphere: from the nearest point of the wall, outwards and along the axis.
    do i = 1, n
      if (.not. rho(i) > 0) direction(i, :) = across(direction_b(i, 1:3))
      beyond(i) = along(i) - max(-direction_b(i, 4), min(along(i), direction_b(i, 4)))
      section(i, 1) = rho(i) - radius_b(i)
      section(i, 2) = beyond(i)
    end do
    call separate(n, 2, section, distance, section_normal)
    do i = 1, n
      if (.not. abs(beyond(i)) > 0) then
        distance(i) = radius_b(i) - rho(i)
        section_normal(i, :) = [-1.0_c_double, 0.0_c_double]
      end if
      gap(i) = distance(i) - radius_a(i)
      status(i) = 0
      if (radius_a(i) > radius_b(i)) status(i) = 2
      if (rho(i) - radius_b(i) > radius_a(i) .and. direction_b(i, 4) <= huge(rho)) status(i) = 1
    end do
    do k = 1, 3
      do i = 1, n
        normal(i, k) = section_normal(i, 1)*direction(i, k) + section_normal(i, 2)*direction_b(i, k)
        point(i, k) = -(radius_a(i) + gap(i)/2)*normal(i, k)
      end do
    end do
  end subroutine cairn_pair_sphere_tube

  !> A unit vector across a unit vector, built on its smallest component.
  pure function across(axis) result(e)
    real(c_double), intent(in) :: axis(3)
    real(c_double) :: e(3)
    integer :: k
    k = minloc(abs(axis), 1)
    e = -axis(k)*axis
    e(k) = e(k) + 1
    e = e/sqrt(dot_product(e, e))
  end function across

end module sphere_tube
