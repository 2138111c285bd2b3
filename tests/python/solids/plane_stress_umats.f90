! Routines of Abaqus's interface as they are written for elements of plane stress: NDI = 2, NSHR = 1, NTENS = 3, stresses and
! strains 11 22 12, the strain across their own. Others than these end the analysis.

! Hooke's law of plane stress.
subroutine hooke(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, stran, dstran, time, dtime, temp, dtemp, &
                 predef, dpred, cmname, ndi, nshr, ntens, nstatv, props, nprops, coords, drot, pnewdt, celent, dfgrd0, dfgrd1, &
                 noel, npt, layer, kspt, kstep, kinc)
  implicit none
  character(80) :: cmname
  integer :: ndi, nshr, ntens, nstatv, nprops, noel, npt, layer, kspt, kstep(4), kinc
  real(8) :: stress(3), statev(nstatv), ddsdde(3, 3), sse, spd, scd, rpl, ddsddt(3), drplde(3), drpldt
  real(8) :: stran(3), dstran(3), time(2), dtime, temp, dtemp, predef(1), dpred(1), props(nprops), coords(3), drot(3, 3)
  real(8) :: pnewdt, celent, dfgrd0(3, 3), dfgrd1(3, 3), before(3)
  if (ndi /= 2 .or. nshr /= 1 .or. ntens /= 3) call xit
  ddsdde = 0
  ddsdde(1, 1) = props(1)/(1 - props(2)**2)
  ddsdde(2, 2) = ddsdde(1, 1)
  ddsdde(1, 2) = props(2)*ddsdde(1, 1)
  ddsdde(2, 1) = ddsdde(1, 2)
  ddsdde(3, 3) = props(1)/(2*(1 + props(2)))
  before = stress
  stress = stress + matmul(ddsdde, dstran)
  sse = sse + 0.5d0*dot_product(before + stress, dstran)
end subroutine hooke

! Mises' plasticity with linear hardening, returned within plane stress (Simo & Taylor 1986): along 11 + 22, 11 - 22 and 12 stress
! and flow have the same directions. props: E, nu, yield stress, hardening; statev: plastic strain, its part along 33.
subroutine metal(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, stran, dstran, time, dtime, temp, dtemp, &
                 predef, dpred, cmname, ndi, nshr, ntens, nstatv, props, nprops, coords, drot, pnewdt, celent, dfgrd0, dfgrd1, &
                 noel, npt, layer, kspt, kstep, kinc)
  implicit none
  character(80) :: cmname
  integer :: ndi, nshr, ntens, nstatv, nprops, noel, npt, layer, kspt, kstep(4), kinc, i, k, pass
  real(8) :: stress(ntens), statev(nstatv), ddsdde(ntens, ntens), sse, spd, scd, rpl, ddsddt(ntens), drplde(ntens), drpldt
  real(8) :: stran(ntens), dstran(ntens), time(2), dtime, temp, dtemp, predef(1), dpred(1), props(nprops), coords(3), drot(3, 3)
  real(8) :: pnewdt, celent, dfgrd0(3, 3), dfgrd1(3, 3)
  real(8) :: shear, hard, stiff(3), flow(3), way(3, 3), trial(3), now(3), by, mises, slope, left, n(3), mean, invariant
  if (ndi /= 2 .or. nshr /= 1 .or. ntens /= 3) call xit
  shear = props(1)/(2*(1 + props(2)))
  hard = props(4)
  stiff = [props(1)/(1 - props(2)), 2*shear, shear]
  flow = [1d0/3, 1d0, 2d0]
  way = 0
  way(1:2, 1) = sqrt(0.5d0)
  way(1, 2) = sqrt(0.5d0)
  way(2, 2) = -sqrt(0.5d0)
  way(3, 3) = 1
  trial = matmul(transpose(way), stress) + stiff*matmul(transpose(way), dstran)
  by = 0
  do pass = 1, 50
    now = trial/(1 + by*stiff*flow)
    mises = sqrt(1.5d0*sum(flow*now**2))
    left = mises - props(3) - hard*(statev(1) + 2d0/3*by*mises)
    if (pass == 1 .and. left <= 0) exit
    slope = -1.5d0*sum(flow**2*stiff*now**2/(1 + by*stiff*flow))/mises
    slope = slope*(1 - 2d0/3*hard*by) - 2d0/3*hard*mises
    if (abs(left) <= 1d-14*mises) exit
    by = by - left/slope
  end do
  stiff = stiff/(1 + by*stiff*flow)
  n = 0
  if (by > 0) then
    n = stiff*flow*now
    n = n/sqrt(sum(flow*now*n) + 4d0/9*hard*mises**2/(1 - 2d0/3*hard*by))
  end if
  do i = 1, 3
    do k = 1, 3
      ddsdde(i, k) = sum(way(i, :)*stiff*way(k, :)) - sum(way(i, :)*n)*sum(way(k, :)*n)
    end do
  end do
  stress = matmul(way, now)
  call sinv(stress, mean, invariant, ndi, nshr)
  if (abs(invariant - mises) > 1d-9*(mises + 1d-30)) pnewdt = 0.5d0
  statev(1) = statev(1) + 2d0/3*by*mises
  statev(2) = statev(2) - by*(stress(1) + stress(2))/3
  spd = spd + props(3)*2d0/3*by*mises
  ! elastic energy, and what linear hardening stores
  sse = 0.5d0*(now(1)**2*(1 - props(2))/props(1) + now(2)**2/(2*shear) + now(3)**2/shear) + 0.5d0*hard*statev(1)**2
end subroutine metal

! Incompressible rubber from DFGRD1 as it comes, whose stretch across keeps the volume: sigma = mu (B - B33).
subroutine rubber(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, stran, dstran, time, dtime, temp, dtemp, &
                  predef, dpred, cmname, ndi, nshr, ntens, nstatv, props, nprops, coords, drot, pnewdt, celent, dfgrd0, dfgrd1, &
                  noel, npt, layer, kspt, kstep, kinc)
  implicit none
  character(80) :: cmname
  integer :: ndi, nshr, ntens, nstatv, nprops, noel, npt, layer, kspt, kstep(4), kinc
  real(8) :: stress(ntens), statev(nstatv), ddsdde(ntens, ntens), sse, spd, scd, rpl, ddsddt(ntens), drplde(ntens), drpldt
  real(8) :: stran(ntens), dstran(ntens), time(2), dtime, temp, dtemp, predef(1), dpred(1), props(nprops), coords(3), drot(3, 3)
  real(8) :: pnewdt, celent, dfgrd0(3, 3), dfgrd1(3, 3), left(3, 3), across
  if (ndi /= 2 .or. nshr /= 1 .or. ntens /= 3) call xit
  left = props(1)*matmul(dfgrd1, transpose(dfgrd1))
  across = left(3, 3)
  stress = [left(1, 1) - across, left(2, 2) - across, left(1, 2)]
  ddsdde(:, 1) = [2*left(1, 1) + 2*across, 2*across, left(1, 2)]
  ddsdde(:, 2) = [2*across, 2*left(2, 2) + 2*across, left(1, 2)]
  ddsdde(:, 3) = [left(1, 2), left(1, 2), 0.5d0*(left(1, 1) + left(2, 2))]
  sse = 0.5d0*(left(1, 1) + left(2, 2) + left(3, 3) - 3*props(1))
end subroutine rubber

! Springs; statev records the arguments of the call: ndi, nshr, ntens, DFGRD0(3, 3), DFGRD1(3, 3), and stresses and strains as
! they came in.
subroutine told(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, stran, dstran, time, dtime, temp, dtemp, &
                predef, dpred, cmname, ndi, nshr, ntens, nstatv, props, nprops, coords, drot, pnewdt, celent, dfgrd0, dfgrd1, &
                noel, npt, layer, kspt, kstep, kinc)
  implicit none
  character(80) :: cmname
  integer :: ndi, nshr, ntens, nstatv, nprops, noel, npt, layer, kspt, kstep(4), kinc, i
  real(8) :: stress(ntens), statev(nstatv), ddsdde(ntens, ntens), sse, spd, scd, rpl, ddsddt(ntens), drplde(ntens), drpldt
  real(8) :: stran(ntens), dstran(ntens), time(2), dtime, temp, dtemp, predef(1), dpred(1), props(nprops), coords(3), drot(3, 3)
  real(8) :: pnewdt, celent, dfgrd0(3, 3), dfgrd1(3, 3)
  statev = [dble(ndi), dble(nshr), dble(ntens), dfgrd0(3, 3), dfgrd1(3, 3), stress(:3), stran(:3), dstran(:3)]
  ddsdde = 0
  do i = 1, ntens
    ddsdde(i, i) = props(1)
  end do
  stress = stress + props(1)*dstran
end subroutine told

! Takes the plane for plane strain.
subroutine four(stress, statev, ddsdde)
  implicit none
  real(8) :: stress(4), statev(*), ddsdde(4, 4)
  ddsdde = 0
  stress = 1
end subroutine four
