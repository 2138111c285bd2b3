!> A sphere centred on its body, the mass isotropic, touched on the line of centres: the lever is along the normal,
!> so only the tangents see the spin. Record v: velocity (3), spin (3), inverse mass, inverse inertia.
module radial3
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: cairn_side_radial3_gather, cairn_side_radial3_scatter, cairn_side_radial3_delassus
contains

  !> u = u + sign H'v
  subroutine cairn_side_radial3_gather(n, c, width, sign, v, frame, lever, u) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components: 3, or 6 with rotations
    integer(c_int32_t), value     :: width        !< numbers of a record
    real(c_double), value         :: sign         !< +1 on side A, -1 on side B
    real(c_double), intent(in)    :: v(n, width)  !< velocity records, one a contact [m/s, rad/s, 1/kg, 1/(kg m2)]
    real(c_double), intent(in)    :: frame(n, 6)  !< normal, first tangent [-]
    real(c_double), intent(in)    :: lever(n)     !< from the centre to the contact point, along n [m]
    real(c_double), intent(inout) :: u(n, c)      !< relative velocity (n, t, s) [m/s], then spin [rad/s]
    real(c_double) :: nx, ny, nz, tx, ty, tz, sx, sy, sz, l
    integer :: i
    !$omp simd
    do i = 1, n
      nx = frame(i, 1); ny = frame(i, 2); nz = frame(i, 3)
      tx = frame(i, 4); ty = frame(i, 5); tz = frame(i, 6)
      sx = ny*tz - nz*ty; sy = nz*tx - nx*tz; sz = nx*ty - ny*tx
      l = sign*lever(i)
      u(i, 1) = u(i, 1) + sign*(nx*v(i, 1) + ny*v(i, 2) + nz*v(i, 3))
      u(i, 2) = u(i, 2) + (sign*(tx*v(i, 1) + ty*v(i, 2) + tz*v(i, 3)) + l*(sx*v(i, 4) + sy*v(i, 5) + sz*v(i, 6)))
      u(i, 3) = u(i, 3) + (sign*(sx*v(i, 1) + sy*v(i, 2) + sz*v(i, 3)) - l*(tx*v(i, 4) + ty*v(i, 5) + tz*v(i, 6)))
    end do
    if (c > 3) then
      !$omp simd
      do i = 1, n
        nx = frame(i, 1); ny = frame(i, 2); nz = frame(i, 3)
        tx = frame(i, 4); ty = frame(i, 5); tz = frame(i, 6)
        sx = ny*tz - nz*ty; sy = nz*tx - nx*tz; sz = nx*ty - ny*tx
        u(i, 4) = u(i, 4) + sign*(nx*v(i, 4) + ny*v(i, 5) + nz*v(i, 6))
        u(i, 5) = u(i, 5) + sign*(tx*v(i, 4) + ty*v(i, 5) + tz*v(i, 6))
        u(i, 6) = u(i, 6) + sign*(sx*v(i, 4) + sy*v(i, 5) + sz*v(i, 6))
      end do
    end if
  end subroutine cairn_side_radial3_gather

  !> v = v + sign A^-1 H dr
  subroutine cairn_side_radial3_scatter(n, c, width, sign, dr, frame, lever, v) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components: 3, or 6 with rotations
    integer(c_int32_t), value     :: width        !< numbers of a record
    real(c_double), value         :: sign         !< +1 on side A, -1 on side B
    real(c_double), intent(in)    :: dr(n, c)     !< change of impulse (n, t, s) [N s], then of moment [N m s]
    real(c_double), intent(in)    :: frame(n, 6)  !< normal, first tangent [-]
    real(c_double), intent(in)    :: lever(n)     !< from the centre to the contact point, along n [m]
    real(c_double), intent(inout) :: v(n, width)  !< velocity records, one a contact [m/s, rad/s, 1/kg, 1/(kg m2)]
    real(c_double) :: nx, ny, nz, tx, ty, tz, sx, sy, sz, m, j, a, b
    integer :: i
    !$omp simd
    do i = 1, n
      nx = frame(i, 1); ny = frame(i, 2); nz = frame(i, 3)
      tx = frame(i, 4); ty = frame(i, 5); tz = frame(i, 6)
      sx = ny*tz - nz*ty; sy = nz*tx - nx*tz; sz = nx*ty - ny*tx
      m = sign*v(i, 7)
      j = sign*v(i, 8)*lever(i)
      a = j*dr(i, 2)
      b = j*dr(i, 3)
      v(i, 1) = v(i, 1) + m*(nx*dr(i, 1) + tx*dr(i, 2) + sx*dr(i, 3))
      v(i, 2) = v(i, 2) + m*(ny*dr(i, 1) + ty*dr(i, 2) + sy*dr(i, 3))
      v(i, 3) = v(i, 3) + m*(nz*dr(i, 1) + tz*dr(i, 2) + sz*dr(i, 3))
      v(i, 4) = v(i, 4) + (a*sx - b*tx)
      v(i, 5) = v(i, 5) + (a*sy - b*ty)
      v(i, 6) = v(i, 6) + (a*sz - b*tz)
    end do
    if (c > 3) then
      !$omp simd
      do i = 1, n
        nx = frame(i, 1); ny = frame(i, 2); nz = frame(i, 3)
        tx = frame(i, 4); ty = frame(i, 5); tz = frame(i, 6)
        sx = ny*tz - nz*ty; sy = nz*tx - nx*tz; sz = nx*ty - ny*tx
        j = sign*v(i, 8)
        v(i, 4) = v(i, 4) + j*(nx*dr(i, 4) + tx*dr(i, 5) + sx*dr(i, 6))
        v(i, 5) = v(i, 5) + j*(ny*dr(i, 4) + ty*dr(i, 5) + sy*dr(i, 6))
        v(i, 6) = v(i, 6) + j*(nz*dr(i, 4) + tz*dr(i, 5) + sz*dr(i, 6))
      end do
    end if
  end subroutine cairn_side_radial3_scatter

  !> w = w + factor H' A^-1 H
  subroutine cairn_side_radial3_delassus(n, c, width, factor, v, frame, lever, w) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components: 3, or 6 with rotations
    integer(c_int32_t), value     :: width        !< numbers of a record
    real(c_double), value         :: factor       !< 1, or the size of the group that shares a hub
    real(c_double), intent(in)    :: v(n, width)  !< velocity records, one a contact [m/s, rad/s, 1/kg, 1/(kg m2)]
    real(c_double), intent(in)    :: frame(n, 6)  !< normal, first tangent [-]
    real(c_double), intent(in)    :: lever(n)     !< from the centre to the contact point, along n [m]
    real(c_double), intent(inout) :: w(n, c, c)   !< Delassus block [1/kg], with rotations [1/(kg m), 1/(kg m2)]
    real(c_double) :: m, j
    integer :: i
    !$omp simd
    do i = 1, n
      m = factor*v(i, 7)
      j = factor*v(i, 8)
      w(i, 1, 1) = w(i, 1, 1) + m
      w(i, 2, 2) = w(i, 2, 2) + (m + j*lever(i)**2)
      w(i, 3, 3) = w(i, 3, 3) + (m + j*lever(i)**2)
      if (c > 3) then
        w(i, 4, 4) = w(i, 4, 4) + j
        w(i, 5, 5) = w(i, 5, 5) + j
        w(i, 6, 6) = w(i, 6, 6) + j
        w(i, 2, 6) = w(i, 2, 6) + j*lever(i)
        w(i, 6, 2) = w(i, 6, 2) + j*lever(i)
        w(i, 3, 5) = w(i, 3, 5) - j*lever(i)
        w(i, 5, 3) = w(i, 5, 3) - j*lever(i)
      end if
    end do
  end subroutine cairn_side_radial3_delassus
end module radial3
