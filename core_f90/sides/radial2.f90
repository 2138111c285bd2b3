!> A disk centred on its body, the mass isotropic, touched on the line of centres: the lever is along the normal,
!> so only the tangent sees the spin. Record v: velocity (2), spin, inverse mass (2), inverse inertia.
module radial2
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: cairn_side_radial2_gather, cairn_side_radial2_scatter, cairn_side_radial2_delassus
contains

  !> u = u + sign H'v
  subroutine cairn_side_radial2_gather(n, c, width, sign, v, frame, lever, u) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components: 2, or 3 with rotation
    integer(c_int32_t), value     :: width        !< numbers of a record
    real(c_double), value         :: sign         !< +1 on side A, -1 on side B
    real(c_double), intent(in)    :: v(n, width)  !< velocity records, one a contact [m/s, rad/s, 1/kg, 1/(kg m2)]
    real(c_double), intent(in)    :: frame(n, 2)  !< normal [-]
    real(c_double), intent(in)    :: lever(n)     !< from the centre to the contact point, along n [m]
    real(c_double), intent(inout) :: u(n, c)      !< relative velocity (n, t) [m/s], then spin [rad/s]
    integer :: i
    !$omp simd
    do i = 1, n
      u(i, 1) = u(i, 1) + sign*(frame(i, 1)*v(i, 1) + frame(i, 2)*v(i, 2))
      u(i, 2) = u(i, 2) + sign*((frame(i, 1)*v(i, 2) - frame(i, 2)*v(i, 1)) + lever(i)*v(i, 3))
    end do
    if (c > 2) u(:, 3) = u(:, 3) + sign*v(:, 3)
  end subroutine cairn_side_radial2_gather

  !> v = v + sign A^-1 H dr
  subroutine cairn_side_radial2_scatter(n, c, width, sign, dr, frame, lever, v) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components: 2, or 3 with rotation
    integer(c_int32_t), value     :: width        !< numbers of a record
    real(c_double), value         :: sign         !< +1 on side A, -1 on side B
    real(c_double), intent(in)    :: dr(n, c)     !< change of impulse (n, t) [N s], then of moment [N m s]
    real(c_double), intent(in)    :: frame(n, 2)  !< normal [-]
    real(c_double), intent(in)    :: lever(n)     !< from the centre to the contact point, along n [m]
    real(c_double), intent(inout) :: v(n, width)  !< velocity records, one a contact [m/s, rad/s, 1/kg, 1/(kg m2)]
    real(c_double) :: m
    integer :: i
    !$omp simd
    do i = 1, n
      m = sign*v(i, 4)
      v(i, 1) = v(i, 1) + m*(frame(i, 1)*dr(i, 1) - frame(i, 2)*dr(i, 2))
      v(i, 2) = v(i, 2) + m*(frame(i, 2)*dr(i, 1) + frame(i, 1)*dr(i, 2))
      v(i, 3) = v(i, 3) + sign*v(i, 6)*(lever(i)*dr(i, 2))
    end do
    if (c > 2) v(:, 3) = v(:, 3) + sign*v(:, 6)*dr(:, 3)
  end subroutine cairn_side_radial2_scatter

  !> w = w + factor H' A^-1 H
  subroutine cairn_side_radial2_delassus(n, c, width, factor, v, frame, lever, w) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components: 2, or 3 with rotation
    integer(c_int32_t), value     :: width        !< numbers of a record
    real(c_double), value         :: factor       !< 1, or the size of the group that shares a hub
    real(c_double), intent(in)    :: v(n, width)  !< velocity records, one a contact [m/s, rad/s, 1/kg, 1/(kg m2)]
    real(c_double), intent(in)    :: frame(n, 2)  !< normal [-]
    real(c_double), intent(in)    :: lever(n)     !< from the centre to the contact point, along n [m]
    real(c_double), intent(inout) :: w(n, c, c)   !< Delassus block [1/kg], with rotation [1/(kg m), 1/(kg m2)]
    real(c_double) :: m, j
    integer :: i
    !$omp simd
    do i = 1, n
      m = factor*v(i, 4)
      j = factor*v(i, 6)
      w(i, 1, 1) = w(i, 1, 1) + m
      w(i, 2, 2) = w(i, 2, 2) + (m + j*lever(i)**2)
      if (c > 2) then
        w(i, 2, 3) = w(i, 2, 3) + j*lever(i)
        w(i, 3, 2) = w(i, 3, 2) + j*lever(i)
        w(i, 3, 3) = w(i, 3, 3) + j
      end if
    end do
  end subroutine cairn_side_radial2_delassus
end module radial2
