!> A rigid body touched anywhere, with a full inverse inertia, its directions blocked or not. Record v: velocity (3), spin (3),
!> inverse mass along x, unused, inverse mass along y and z, inverse inertia xx yy zz xy xz yz. Lever: from the centre of mass
!> to the contact point.
module rigid3
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: cairn_side_rigid3_gather, cairn_side_rigid3_scatter, cairn_side_rigid3_delassus
contains

  !> u = u + sign H'v
  subroutine cairn_side_rigid3_gather(n, c, width, sign, v, frame, lever, u) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components: 3, or 6 with rotations
    integer(c_int32_t), value     :: width        !< numbers of a record
    real(c_double), value         :: sign         !< +1 on side A, -1 on side B
    real(c_double), intent(in)    :: v(n, width)  !< velocity records, one a contact [m/s, rad/s, 1/kg, 1/(kg m2)]
    real(c_double), intent(in)    :: frame(n, 6)  !< normal, first tangent [-]
    real(c_double), intent(in)    :: lever(n, 3)  !< from the centre of mass to the contact point [m]
    real(c_double), intent(inout) :: u(n, c)      !< relative velocity (n, t, s) [m/s], then spin [rad/s]
    real(c_double) :: x(3), a(3, 3)
    integer :: i, k
    !$omp simd private(x, a)
    do i = 1, n
      x(1) = v(i, 1) + (v(i, 5)*lever(i, 3) - v(i, 6)*lever(i, 2))
      x(2) = v(i, 2) + (v(i, 6)*lever(i, 1) - v(i, 4)*lever(i, 3))
      x(3) = v(i, 3) + (v(i, 4)*lever(i, 2) - v(i, 5)*lever(i, 1))
      a(1, 3) = frame(i, 2)*frame(i, 6) - frame(i, 3)*frame(i, 5)
      a(2, 3) = frame(i, 3)*frame(i, 4) - frame(i, 1)*frame(i, 6)
      a(3, 3) = frame(i, 1)*frame(i, 5) - frame(i, 2)*frame(i, 4)
      u(i, 1) = u(i, 1) + sign*(frame(i, 1)*x(1) + frame(i, 2)*x(2) + frame(i, 3)*x(3))
      u(i, 2) = u(i, 2) + sign*(frame(i, 4)*x(1) + frame(i, 5)*x(2) + frame(i, 6)*x(3))
      u(i, 3) = u(i, 3) + sign*(a(1, 3)*x(1) + a(2, 3)*x(2) + a(3, 3)*x(3))
    end do
    if (c < 6) return
    do i = 1, n
      call axes(n, i, frame, a)
      do k = 1, 3
        u(i, 3 + k) = u(i, 3 + k) + sign*(a(1, k)*v(i, 4) + a(2, k)*v(i, 5) + a(3, k)*v(i, 6))
      end do
    end do
  end subroutine cairn_side_rigid3_gather

  !> v = v + sign A^-1 H dr
  subroutine cairn_side_rigid3_scatter(n, c, width, sign, dr, frame, lever, v) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components: 3, or 6 with rotations
    integer(c_int32_t), value     :: width        !< numbers of a record
    real(c_double), value         :: sign         !< +1 on side A, -1 on side B
    real(c_double), intent(in)    :: dr(n, c)     !< change of impulse (n, t, s) [N s], then of moment [N m s]
    real(c_double), intent(in)    :: frame(n, 6)  !< normal, first tangent [-]
    real(c_double), intent(in)    :: lever(n, 3)  !< from the centre of mass to the contact point [m]
    real(c_double), intent(inout) :: v(n, width)  !< velocity records, one a contact [m/s, rad/s, 1/kg, 1/(kg m2)]
    real(c_double) :: sx, sy, sz, px, py, pz, mx, my, mz
    integer :: i
    !$omp simd private(sx, sy, sz, px, py, pz, mx, my, mz)
    do i = 1, n
      sx = frame(i, 2)*frame(i, 6) - frame(i, 3)*frame(i, 5)
      sy = frame(i, 3)*frame(i, 4) - frame(i, 1)*frame(i, 6)
      sz = frame(i, 1)*frame(i, 5) - frame(i, 2)*frame(i, 4)
      px = sign*(frame(i, 1)*dr(i, 1) + frame(i, 4)*dr(i, 2) + sx*dr(i, 3))
      py = sign*(frame(i, 2)*dr(i, 1) + frame(i, 5)*dr(i, 2) + sy*dr(i, 3))
      pz = sign*(frame(i, 3)*dr(i, 1) + frame(i, 6)*dr(i, 2) + sz*dr(i, 3))
      mx = lever(i, 2)*pz - lever(i, 3)*py
      my = lever(i, 3)*px - lever(i, 1)*pz
      mz = lever(i, 1)*py - lever(i, 2)*px
      v(i, 1) = v(i, 1) + v(i, 7)*px
      v(i, 2) = v(i, 2) + v(i, 9)*py
      v(i, 3) = v(i, 3) + v(i, 10)*pz
      v(i, 4) = v(i, 4) + (v(i, 11)*mx + v(i, 14)*my + v(i, 15)*mz)
      v(i, 5) = v(i, 5) + (v(i, 14)*mx + v(i, 12)*my + v(i, 16)*mz)
      v(i, 6) = v(i, 6) + (v(i, 15)*mx + v(i, 16)*my + v(i, 13)*mz)
    end do
    if (c < 6) return
    do i = 1, n
      sx = frame(i, 2)*frame(i, 6) - frame(i, 3)*frame(i, 5)
      sy = frame(i, 3)*frame(i, 4) - frame(i, 1)*frame(i, 6)
      sz = frame(i, 1)*frame(i, 5) - frame(i, 2)*frame(i, 4)
      mx = sign*(frame(i, 1)*dr(i, 4) + frame(i, 4)*dr(i, 5) + sx*dr(i, 6))
      my = sign*(frame(i, 2)*dr(i, 4) + frame(i, 5)*dr(i, 5) + sy*dr(i, 6))
      mz = sign*(frame(i, 3)*dr(i, 4) + frame(i, 6)*dr(i, 5) + sz*dr(i, 6))
      v(i, 4) = v(i, 4) + (v(i, 11)*mx + v(i, 14)*my + v(i, 15)*mz)
      v(i, 5) = v(i, 5) + (v(i, 14)*mx + v(i, 12)*my + v(i, 16)*mz)
      v(i, 6) = v(i, 6) + (v(i, 15)*mx + v(i, 16)*my + v(i, 13)*mz)
    end do
  end subroutine cairn_side_rigid3_scatter

  !> w = w + factor H' A^-1 H
  subroutine cairn_side_rigid3_delassus(n, c, width, factor, v, frame, lever, w) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components: 3, or 6 with rotations
    integer(c_int32_t), value     :: width        !< numbers of a record
    real(c_double), value         :: factor       !< 1, or the size of the group that shares a hub
    real(c_double), intent(in)    :: v(n, width)  !< velocity records, one a contact [m/s, rad/s, 1/kg, 1/(kg m2)]
    real(c_double), intent(in)    :: frame(n, 6)  !< normal, first tangent [-]
    real(c_double), intent(in)    :: lever(n, 3)  !< from the centre of mass to the contact point [m]
    real(c_double), intent(inout) :: w(n, c, c)   !< Delassus block [1/kg], with rotations [1/(kg m), 1/(kg m2)]
    real(c_double) :: a(3, 3), l(3, 6), m(3), j(3, 3), jl(3), value
    integer :: i, p, q
    do i = 1, n
      call axes(n, i, frame, a)
      do p = 1, 3
        l(1, p) = lever(i, 2)*a(3, p) - lever(i, 3)*a(2, p)
        l(2, p) = lever(i, 3)*a(1, p) - lever(i, 1)*a(3, p)
        l(3, p) = lever(i, 1)*a(2, p) - lever(i, 2)*a(1, p)
      end do
      l(:, 4:6) = a
      m = factor*[v(i, 7), v(i, 9), v(i, 10)]
      j = factor*reshape([v(i, 11), v(i, 14), v(i, 15), v(i, 14), v(i, 12), v(i, 16), v(i, 15), v(i, 16), v(i, 13)], [3, 3])
      do q = 1, c
        jl = j(:, 1)*l(1, q) + j(:, 2)*l(2, q) + j(:, 3)*l(3, q)
        do p = 1, c
          value = l(1, p)*jl(1) + l(2, p)*jl(2) + l(3, p)*jl(3)
          if (p < 4 .and. q < 4) value = value + (m(1)*a(1, p)*a(1, q) + m(2)*a(2, p)*a(2, q) + m(3)*a(3, p)*a(3, q))
          w(i, p, q) = w(i, p, q) + value
        end do
      end do
    end do
  end subroutine cairn_side_rigid3_delassus

  !> Columns n, t and s = n x t of contact i.
  pure subroutine axes(n, i, frame, a)
    integer(c_int32_t), intent(in) :: n, i        !< contacts, which
    real(c_double), intent(in)     :: frame(n, 6) !< normal, first tangent [-]
    real(c_double), intent(out)    :: a(3, 3)     !< columns n, t, s [-]
    a(:, 1) = frame(i, 1:3)
    a(:, 2) = frame(i, 4:6)
    a(1, 3) = a(2, 1)*a(3, 2) - a(3, 1)*a(2, 2)
    a(2, 3) = a(3, 1)*a(1, 2) - a(1, 1)*a(3, 2)
    a(3, 3) = a(1, 1)*a(2, 2) - a(2, 1)*a(1, 2)
  end subroutine axes
end module rigid3
