!> The sweep over a packed batch (see cairn/core.h): what load_bodies, the gathers of radial2 and radial3, the cone's closed form
!> and the scatters do one after the other, done eight contacts at a time without leaving the registers. Most contacts of most
!> scenes are of this kind, and this is about twice as fast; everything else goes the open way. The inverse masses of the records
!> give W, and the normal gives the tangents: less to read from memory, which is what limits a large scene.
module radial_sweep
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_batch, only: cairn_record
  implicit none
  private
  public :: sweep_radial2, sweep_radial3
  integer, parameter :: w8 = 8 !< contacts at a time: a register of doubles
contains

  !> Spheres.
  subroutine sweep_radial3(packs, contacts, body_a, body_b, relaxation, pack, record, change)
    integer, value                    :: packs              !< eights of contacts, dummies included
    integer, value                    :: contacts           !< contacts that are not dummies
    integer(c_int32_t), intent(in)    :: body_a(w8, packs)  !< places of records, from 0
    integer(c_int32_t), intent(in)    :: body_b(w8, packs)  !< places of records, from 0
    real(c_double), value             :: relaxation         !< factor on changes of impulse [-]
    real(c_double), intent(inout)     :: pack(w8, 10, packs) !< normal [-], levers along it [m], bias [m/s], mu [-], r [N s]
    type(cairn_record), intent(inout) :: record(0:*)        !< velocity records
    real(c_double), intent(out)       :: change             !< sum of dr.W dr [J]
    type(cairn_record) :: a(w8), b(w8)
    real(c_double) :: nx, ny, nz, tx, ty, tz, sx, sy, sz, la, lb, x, y, z, p, q, o, un, ut, us, rn, rt, rs, limit, square
    real(c_double) :: factor, dn, dt, ds, ma, mb, ja, jb, wn, wt, h, sgn, share, total(w8)
    integer :: k, i
    total = 0
    share = 1/relaxation
    do k = 1, packs
      do i = 1, w8
        a(i) = record(body_a(i, k))
        b(i) = record(body_b(i, k))
      end do
      !$omp simd private(nx, ny, nz, tx, ty, tz, sx, sy, sz, la, lb, x, y, z, p, q, o, un, ut, us, rn, rt, rs, limit, square) &
      !$omp   private(factor, dn, dt, ds, ma, mb, ja, jb, wn, wt, h, sgn)
      do i = 1, w8
        nx = pack(i, 1, k)
        ny = pack(i, 2, k)
        nz = pack(i, 3, k)
        la = pack(i, 4, k)
        lb = pack(i, 5, k)
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
        p = la*a(i)%x(4) - lb*b(i)%x(4)
        q = la*a(i)%x(5) - lb*b(i)%x(5)
        o = la*a(i)%x(6) - lb*b(i)%x(6)
        ma = a(i)%x(7)
        mb = b(i)%x(7)
        ja = a(i)%x(8)*la
        jb = b(i)%x(8)*lb
        wn = ma + mb
        wt = wn + (ja*la + jb*lb)
        un = pack(i, 6, k) + (nx*x + ny*y + nz*z)
        ut = (tx*x + ty*y + tz*z) + (sx*p + sy*q + sz*o)
        us = (sx*x + sy*y + sz*z) - (tx*p + ty*q + tz*o)
        wn = max(wn, tiny(wn))*share ! of dummies W is 0
        wt = max(wt, tiny(wt))*share
        rn = max(0.0_c_double, pack(i, 8, k) - un/wn)
        rt = pack(i, 9, k) - ut/wt
        rs = pack(i, 10, k) - us/wt
        limit = pack(i, 7, k)*rn
        square = rt*rt + rs*rs
        factor = merge(limit/sqrt(max(square, tiny(square))), 1.0_c_double, square > limit*limit)
        dn = rn - pack(i, 8, k)
        dt = factor*rt - pack(i, 9, k)
        ds = factor*rs - pack(i, 10, k)
        pack(i, 8, k) = rn
        pack(i, 9, k) = factor*rt
        pack(i, 10, k) = factor*rs
        total(i) = total(i) + (wn*dn*dn + wt*(dt*dt + ds*ds))
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
        a(i)%x(7) = ma
        a(i)%x(8) = a(i)%x(8)
        b(i)%x(1) = b(i)%x(1) - mb*x
        b(i)%x(2) = b(i)%x(2) - mb*y
        b(i)%x(3) = b(i)%x(3) - mb*z
        b(i)%x(4) = b(i)%x(4) - jb*p
        b(i)%x(5) = b(i)%x(5) - jb*q
        b(i)%x(6) = b(i)%x(6) - jb*o
        b(i)%x(7) = mb
        b(i)%x(8) = b(i)%x(8)
      end do
      do i = 1, min(w8, contacts - (k - 1)*w8)
        record(body_a(i, k)) = a(i)
        record(body_b(i, k)) = b(i)
      end do
    end do
    change = sum(total)
  end subroutine sweep_radial3

  !> Disks.
  subroutine sweep_radial2(packs, contacts, body_a, body_b, relaxation, pack, record, change)
    integer, value                    :: packs              !< eights of contacts, dummies included
    integer, value                    :: contacts           !< contacts that are not dummies
    integer(c_int32_t), intent(in)    :: body_a(w8, packs)  !< places of records, from 0
    integer(c_int32_t), intent(in)    :: body_b(w8, packs)  !< places of records, from 0
    real(c_double), value             :: relaxation         !< factor on changes of impulse [-]
    real(c_double), intent(inout)     :: pack(w8, 8, packs) !< normal [-], levers along it [m], bias [m/s], mu [-], r [N s]
    type(cairn_record), intent(inout) :: record(0:*)        !< velocity records
    real(c_double), intent(out)       :: change             !< sum of dr.W dr [J]
    type(cairn_record) :: a(w8), b(w8)
    real(c_double) :: nx, ny, x, y, un, ut, rn, rt, limit, dn, dt, wn, wt, ja, jb, share, total(w8)
    integer :: k, i
    total = 0
    share = 1/relaxation
    do k = 1, packs
      do i = 1, w8
        a(i) = record(body_a(i, k))
        b(i) = record(body_b(i, k))
      end do
      !$omp simd private(nx, ny, x, y, un, ut, rn, rt, limit, dn, dt, wn, wt, ja, jb)
      do i = 1, w8
        nx = pack(i, 1, k)
        ny = pack(i, 2, k)
        x = a(i)%x(1) - b(i)%x(1)
        y = a(i)%x(2) - b(i)%x(2)
        ja = a(i)%x(6)*pack(i, 3, k)
        jb = b(i)%x(6)*pack(i, 4, k)
        wn = a(i)%x(4) + b(i)%x(4)
        wt = wn + (ja*pack(i, 3, k) + jb*pack(i, 4, k))
        wn = max(wn, tiny(wn))*share ! of dummies W is 0
        wt = max(wt, tiny(wt))*share
        un = pack(i, 5, k) + (nx*x + ny*y)
        ut = (nx*y - ny*x) + (pack(i, 3, k)*a(i)%x(3) - pack(i, 4, k)*b(i)%x(3))
        rn = max(0.0_c_double, pack(i, 7, k) - un/wn)
        limit = pack(i, 6, k)*rn
        rt = min(limit, max(-limit, pack(i, 8, k) - ut/wt))
        dn = rn - pack(i, 7, k)
        dt = rt - pack(i, 8, k)
        pack(i, 7, k) = rn
        pack(i, 8, k) = rt
        total(i) = total(i) + (wn*dn*dn + wt*dt*dt)
        x = nx*dn - ny*dt
        y = ny*dn + nx*dt
        a(i)%x(1) = a(i)%x(1) + a(i)%x(4)*x
        a(i)%x(2) = a(i)%x(2) + a(i)%x(4)*y
        a(i)%x(3) = a(i)%x(3) + ja*dt
        b(i)%x(1) = b(i)%x(1) - b(i)%x(4)*x
        b(i)%x(2) = b(i)%x(2) - b(i)%x(4)*y
        b(i)%x(3) = b(i)%x(3) - jb*dt
      end do
      do i = 1, min(w8, contacts - (k - 1)*w8)
        record(body_a(i, k)) = a(i)
        record(body_b(i, k)) = b(i)
      end do
    end do
    change = sum(total)
  end subroutine sweep_radial2
end module radial_sweep
