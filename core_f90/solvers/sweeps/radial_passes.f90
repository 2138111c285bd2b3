!> Passes over packed batches (see cairn/core.h) besides the sweep: relative velocities of contacts, and all impulses applied to the
!> bodies at once. Written as radial_sweep is, and for the same reason.
module radial_passes
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_batch, only: cairn_record
  implicit none
  private
  public :: radial_velocity2, radial_velocity3, radial_impulse2, radial_impulse3
  integer, parameter :: w8 = 8 !< contacts at a time: a register of doubles
contains

  !> Disks: relative velocity, with the bias or not, and the pack's friction and impulse as columns.
  subroutine radial_velocity2(packs, body_a, body_b, pack, record, bias, u, mu, r)
    integer, value                 :: packs              !< eights of contacts, dummies included
    integer(c_int32_t), intent(in) :: body_a(w8, packs)  !< places of records, from 0
    integer(c_int32_t), intent(in) :: body_b(w8, packs)  !< places of records, from 0
    real(c_double), intent(in)     :: pack(w8, 8, packs) !< normal [-], levers along it [m], bias [m/s], mu [-], r [N s]
    type(cairn_record), intent(in) :: record(0:*)        !< velocity records
    real(c_double), value          :: bias               !< 1 with the bias, 0 without
    real(c_double), intent(out)    :: u(w8, packs, 2)    !< [m/s]
    real(c_double), intent(out)    :: mu(w8, packs)      !< [-]
    real(c_double), intent(out)    :: r(w8, packs, 2)    !< [N s]
    type(cairn_record) :: a(w8), b(w8)
    real(c_double) :: nx, ny, x, y
    integer :: k, i
    do k = 1, packs
      do i = 1, w8
        a(i) = record(body_a(i, k))
        b(i) = record(body_b(i, k))
      end do
      !$omp simd private(nx, ny, x, y)
      do i = 1, w8
        nx = pack(i, 1, k)
        ny = pack(i, 2, k)
        x = a(i)%x(1) - b(i)%x(1)
        y = a(i)%x(2) - b(i)%x(2)
        u(i, k, 1) = bias*pack(i, 5, k) + (nx*x + ny*y)
        u(i, k, 2) = (nx*y - ny*x) + (pack(i, 3, k)*a(i)%x(3) - pack(i, 4, k)*b(i)%x(3))
        mu(i, k) = pack(i, 6, k)
        r(i, k, 1) = pack(i, 7, k)
        r(i, k, 2) = pack(i, 8, k)
      end do
    end do
  end subroutine radial_velocity2

  !> Spheres: relative velocity, with the bias or not, and the pack's friction and impulse as columns.
  subroutine radial_velocity3(packs, body_a, body_b, pack, record, bias, u, mu, r)
    integer, value                 :: packs               !< eights of contacts, dummies included
    integer(c_int32_t), intent(in) :: body_a(w8, packs)   !< places of records, from 0
    integer(c_int32_t), intent(in) :: body_b(w8, packs)   !< places of records, from 0
    real(c_double), intent(in)     :: pack(w8, 10, packs) !< normal [-], levers along it [m], bias [m/s], mu [-], r [N s]
    type(cairn_record), intent(in) :: record(0:*)         !< velocity records
    real(c_double), value          :: bias                !< 1 with the bias, 0 without
    real(c_double), intent(out)    :: u(w8, packs, 3)     !< [m/s]
    real(c_double), intent(out)    :: mu(w8, packs)       !< [-]
    real(c_double), intent(out)    :: r(w8, packs, 3)     !< [N s]
    type(cairn_record) :: a(w8), b(w8)
    real(c_double) :: nx, ny, nz, tx, ty, tz, sx, sy, sz, x, y, z, p, q, o, h, sgn
    integer :: k, i
    do k = 1, packs
      do i = 1, w8
        a(i) = record(body_a(i, k))
        b(i) = record(body_b(i, k))
      end do
      !$omp simd private(nx, ny, nz, tx, ty, tz, sx, sy, sz, x, y, z, p, q, o, h, sgn)
      do i = 1, w8
        nx = pack(i, 1, k)
        ny = pack(i, 2, k)
        nz = pack(i, 3, k)
        sgn = sign(1.0_c_double, nz)
        h = -1/(sgn + nz)
        sx = nx*ny*h
        tx = 1 + sgn*nx*nx*h
        ty = sgn*sx
        tz = -sgn*nx
        sy = sgn + ny*ny*h
        sz = -ny
        x = a(i)%x(1) - b(i)%x(1)
        y = a(i)%x(2) - b(i)%x(2)
        z = a(i)%x(3) - b(i)%x(3)
        p = pack(i, 4, k)*a(i)%x(4) - pack(i, 5, k)*b(i)%x(4)
        q = pack(i, 4, k)*a(i)%x(5) - pack(i, 5, k)*b(i)%x(5)
        o = pack(i, 4, k)*a(i)%x(6) - pack(i, 5, k)*b(i)%x(6)
        u(i, k, 1) = bias*pack(i, 6, k) + (nx*x + ny*y + nz*z)
        u(i, k, 2) = (tx*x + ty*y + tz*z) + (sx*p + sy*q + sz*o)
        u(i, k, 3) = (sx*x + sy*y + sz*z) - (tx*p + ty*q + tz*o)
        mu(i, k) = pack(i, 7, k)
        r(i, k, 1) = pack(i, 8, k)
        r(i, k, 2) = pack(i, 9, k)
        r(i, k, 3) = pack(i, 10, k)
      end do
    end do
  end subroutine radial_velocity3

  !> Disks: record = record + A^-1 H r.
  subroutine radial_impulse2(packs, contacts, body_a, body_b, pack, record)
    integer, value                    :: packs              !< eights of contacts, dummies included
    integer, value                    :: contacts           !< contacts that are not dummies
    integer(c_int32_t), intent(in)    :: body_a(w8, packs)  !< places of records, from 0
    integer(c_int32_t), intent(in)    :: body_b(w8, packs)  !< places of records, from 0
    real(c_double), intent(in)        :: pack(w8, 8, packs) !< normal [-], levers along it [m], bias [m/s], mu [-], r [N s]
    type(cairn_record), intent(inout) :: record(0:*)        !< velocity records
    type(cairn_record) :: a(w8), b(w8)
    real(c_double) :: x, y
    integer :: k, i
    do k = 1, packs
      do i = 1, w8
        a(i) = record(body_a(i, k))
        b(i) = record(body_b(i, k))
      end do
      !$omp simd private(x, y)
      do i = 1, w8
        x = pack(i, 1, k)*pack(i, 7, k) - pack(i, 2, k)*pack(i, 8, k)
        y = pack(i, 2, k)*pack(i, 7, k) + pack(i, 1, k)*pack(i, 8, k)
        a(i)%x(1) = a(i)%x(1) + a(i)%x(4)*x
        a(i)%x(2) = a(i)%x(2) + a(i)%x(4)*y
        a(i)%x(3) = a(i)%x(3) + a(i)%x(6)*(pack(i, 3, k)*pack(i, 8, k))
        b(i)%x(1) = b(i)%x(1) - b(i)%x(4)*x
        b(i)%x(2) = b(i)%x(2) - b(i)%x(4)*y
        b(i)%x(3) = b(i)%x(3) - b(i)%x(6)*(pack(i, 4, k)*pack(i, 8, k))
      end do
      do i = 1, min(w8, contacts - (k - 1)*w8)
        record(body_a(i, k)) = a(i)
        record(body_b(i, k)) = b(i)
      end do
    end do
  end subroutine radial_impulse2

  !> Spheres: record = record + A^-1 H r.
  subroutine radial_impulse3(packs, contacts, body_a, body_b, pack, record)
    integer, value                    :: packs               !< eights of contacts, dummies included
    integer, value                    :: contacts            !< contacts that are not dummies
    integer(c_int32_t), intent(in)    :: body_a(w8, packs)   !< places of records, from 0
    integer(c_int32_t), intent(in)    :: body_b(w8, packs)   !< places of records, from 0
    real(c_double), intent(in)        :: pack(w8, 10, packs) !< normal [-], levers along it [m], bias [m/s], mu [-], r [N s]
    type(cairn_record), intent(inout) :: record(0:*)         !< velocity records
    type(cairn_record) :: a(w8), b(w8)
    real(c_double) :: nx, ny, nz, tx, ty, tz, sx, sy, sz, x, y, z, p, q, o, h, sgn, ma, mb, ja, jb, dn, dt, ds
    integer :: k, i
    do k = 1, packs
      do i = 1, w8
        a(i) = record(body_a(i, k))
        b(i) = record(body_b(i, k))
      end do
      !$omp simd private(nx, ny, nz, tx, ty, tz, sx, sy, sz, x, y, z, p, q, o, h, sgn, ma, mb, ja, jb, dn, dt, ds)
      do i = 1, w8
        nx = pack(i, 1, k)
        ny = pack(i, 2, k)
        nz = pack(i, 3, k)
        sgn = sign(1.0_c_double, nz)
        h = -1/(sgn + nz)
        sx = nx*ny*h
        tx = 1 + sgn*nx*nx*h
        ty = sgn*sx
        tz = -sgn*nx
        sy = sgn + ny*ny*h
        sz = -ny
        dn = pack(i, 8, k)
        dt = pack(i, 9, k)
        ds = pack(i, 10, k)
        ma = a(i)%x(7)
        mb = b(i)%x(7)
        ja = a(i)%x(8)*pack(i, 4, k)
        jb = b(i)%x(8)*pack(i, 5, k)
        x = nx*dn + tx*dt + sx*ds
        y = ny*dn + ty*dt + sy*ds
        z = nz*dn + tz*dt + sz*ds
        p = dt*sx - ds*tx
        q = dt*sy - ds*ty
        o = dt*sz - ds*tz
        a(i)%x(1) = a(i)%x(1) + ma*x
        a(i)%x(2) = a(i)%x(2) + ma*y
        a(i)%x(3) = a(i)%x(3) + ma*z
        a(i)%x(4) = a(i)%x(4) + ja*p
        a(i)%x(5) = a(i)%x(5) + ja*q
        a(i)%x(6) = a(i)%x(6) + ja*o
        b(i)%x(1) = b(i)%x(1) - mb*x
        b(i)%x(2) = b(i)%x(2) - mb*y
        b(i)%x(3) = b(i)%x(3) - mb*z
        b(i)%x(4) = b(i)%x(4) - jb*p
        b(i)%x(5) = b(i)%x(5) - jb*q
        b(i)%x(6) = b(i)%x(6) - jb*o
      end do
      do i = 1, min(w8, contacts - (k - 1)*w8)
        record(body_a(i, k)) = a(i)
        record(body_b(i, k)) = b(i)
      end do
    end do
  end subroutine radial_impulse3
end module radial_passes
