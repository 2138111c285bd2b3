!> A rigid body of the plane touched anywhere, its directions blocked or not. Record v: velocity (2), spin, inverse mass (2),
!> inverse inertia. Lever: from the centre of mass to the contact point.
module rigid2
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: cairn_side_rigid2_gather, cairn_side_rigid2_scatter, cairn_side_rigid2_delassus
contains

  !> u = u + sign H'v
  subroutine cairn_side_rigid2_gather(n, c, width, sign, v, frame, lever, u) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components: 2, or 3 with rotation
    integer(c_int32_t), value     :: width        !< numbers of a record
    real(c_double), value         :: sign         !< +1 on side A, -1 on side B
    real(c_double), intent(in)    :: v(n, width)  !< velocity records, one a contact [m/s, rad/s, 1/kg, 1/(kg m2)]
    real(c_double), intent(in)    :: frame(n, 2)  !< normal [-]
    real(c_double), intent(in)    :: lever(n, 2)  !< from the centre of mass to the contact point [m]
    real(c_double), intent(inout) :: u(n, c)      !< relative velocity (n, t) [m/s], then spin [rad/s]
    real(c_double) :: x, y
    integer :: i
    !$omp simd private(x, y)
    do i = 1, n
      x = v(i, 1) - lever(i, 2)*v(i, 3)
      y = v(i, 2) + lever(i, 1)*v(i, 3)
      u(i, 1) = u(i, 1) + sign*(frame(i, 1)*x + frame(i, 2)*y)
      u(i, 2) = u(i, 2) + sign*(frame(i, 1)*y - frame(i, 2)*x)
    end do
    if (c > 2) u(:, 3) = u(:, 3) + sign*v(:, 3)
  end subroutine cairn_side_rigid2_gather

  !> v = v + sign A^-1 H dr
  subroutine cairn_side_rigid2_scatter(n, c, width, sign, dr, frame, lever, v) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components: 2, or 3 with rotation
    integer(c_int32_t), value     :: width        !< numbers of a record
    real(c_double), value         :: sign         !< +1 on side A, -1 on side B
    real(c_double), intent(in)    :: dr(n, c)     !< change of impulse (n, t) [N s], then of moment [N m s]
    real(c_double), intent(in)    :: frame(n, 2)  !< normal [-]
    real(c_double), intent(in)    :: lever(n, 2)  !< from the centre of mass to the contact point [m]
    real(c_double), intent(inout) :: v(n, width)  !< velocity records, one a contact [m/s, rad/s, 1/kg, 1/(kg m2)]
    real(c_double) :: x, y
    integer :: i
    !$omp simd private(x, y)
    do i = 1, n
      x = sign*(frame(i, 1)*dr(i, 1) - frame(i, 2)*dr(i, 2))
      y = sign*(frame(i, 2)*dr(i, 1) + frame(i, 1)*dr(i, 2))
      v(i, 1) = v(i, 1) + v(i, 4)*x
      v(i, 2) = v(i, 2) + v(i, 5)*y
      v(i, 3) = v(i, 3) + v(i, 6)*(lever(i, 1)*y - lever(i, 2)*x)
    end do
    if (c > 2) v(:, 3) = v(:, 3) + sign*v(:, 6)*dr(:, 3)
  end subroutine cairn_side_rigid2_scatter

  !> w = w + factor H' A^-1 H
  subroutine cairn_side_rigid2_delassus(n, c, width, factor, v, frame, lever, w) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components: 2, or 3 with rotation
    integer(c_int32_t), value     :: width        !< numbers of a record
    real(c_double), value         :: factor       !< 1, or the size of the group that shares a hub
    real(c_double), intent(in)    :: v(n, width)  !< velocity records, one a contact [m/s, rad/s, 1/kg, 1/(kg m2)]
    real(c_double), intent(in)    :: frame(n, 2)  !< normal [-]
    real(c_double), intent(in)    :: lever(n, 2)  !< from the centre of mass to the contact point [m]
    real(c_double), intent(inout) :: w(n, c, c)   !< Delassus block [1/kg], with rotation [1/(kg m), 1/(kg m2)]
    real(c_double) :: nx, ny, mx, my, j, ln, lt
    integer :: i
    !$omp simd private(nx, ny, mx, my, j, ln, lt)
    do i = 1, n
      nx = frame(i, 1)
      ny = frame(i, 2)
      mx = factor*v(i, 4)
      my = factor*v(i, 5)
      j = factor*v(i, 6)
      ln = lever(i, 1)*ny - lever(i, 2)*nx ! what a unit spin adds to u_n, and to u_t
      lt = lever(i, 1)*nx + lever(i, 2)*ny
      w(i, 1, 1) = w(i, 1, 1) + (mx*nx*nx + my*ny*ny + j*ln*ln)
      w(i, 1, 2) = w(i, 1, 2) + ((my - mx)*nx*ny + j*ln*lt)
      w(i, 2, 1) = w(i, 2, 1) + ((my - mx)*nx*ny + j*ln*lt)
      w(i, 2, 2) = w(i, 2, 2) + (mx*ny*ny + my*nx*nx + j*lt*lt)
    end do
    if (c < 3) return
    !$omp simd private(j, ln, lt)
    do i = 1, n
      j = factor*v(i, 6)
      ln = lever(i, 1)*frame(i, 2) - lever(i, 2)*frame(i, 1)
      lt = lever(i, 1)*frame(i, 1) + lever(i, 2)*frame(i, 2)
      w(i, 1, 3) = w(i, 1, 3) + j*ln
      w(i, 3, 1) = w(i, 3, 1) + j*ln
      w(i, 2, 3) = w(i, 2, 3) + j*lt
      w(i, 3, 2) = w(i, 3, 2) + j*lt
      w(i, 3, 3) = w(i, 3, 3) + j
    end do
  end subroutine cairn_side_rigid2_delassus
end module rigid2
