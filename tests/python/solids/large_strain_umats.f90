! Routines of Abaqus's interface for large strains, written as they are for NLGEOM: Cauchy's stress, moduli of Jaumann's rate of
! Kirchhoff's stress over J, in axes of the scene.

! W = mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)^2 from DFGRD1 alone: tau = mu (B - 1) + lambda ln J.
subroutine neo(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, stran, dstran, time, dtime, temp, dtemp, &
               predef, dpred, cmname, ndi, nshr, ntens, nstatv, props, nprops, coords, drot, pnewdt, celent, dfgrd0, dfgrd1, &
               noel, npt, layer, kspt, kstep, kinc)
  implicit none
  character(80) :: cmname
  integer :: ndi, nshr, ntens, nstatv, nprops, noel, npt, layer, kspt, kstep(4), kinc, i, k, a(6), b(6)
  real(8) :: stress(ntens), statev(nstatv), ddsdde(ntens, ntens), sse, spd, scd, rpl, ddsddt(ntens), drplde(ntens), drpldt
  real(8) :: stran(ntens), dstran(ntens), time(2), dtime, temp, dtemp, predef(1), dpred(1), props(nprops), coords(3), drot(3, 3)
  real(8) :: pnewdt, celent, dfgrd0(3, 3), dfgrd1(3, 3), shear, lame, left(3, 3), one(3, 3), volume
  a = [1, 2, 3, 1, 1, 2]
  b = [1, 2, 3, 2, 3, 3]
  shear = props(1)/(2*(1 + props(2)))
  lame = props(1)*props(2)/((1 + props(2))*(1 - 2*props(2)))
  one = 0
  do i = 1, 3
    one(i, i) = 1
  end do
  left = matmul(dfgrd1, transpose(dfgrd1))
  volume = dfgrd1(1, 1)*(dfgrd1(2, 2)*dfgrd1(3, 3) - dfgrd1(2, 3)*dfgrd1(3, 2)) &
           - dfgrd1(1, 2)*(dfgrd1(2, 1)*dfgrd1(3, 3) - dfgrd1(2, 3)*dfgrd1(3, 1)) &
           + dfgrd1(1, 3)*(dfgrd1(2, 1)*dfgrd1(3, 2) - dfgrd1(2, 2)*dfgrd1(3, 1))
  do i = 1, ntens
    stress(i) = (shear*(left(a(i), b(i)) - one(a(i), b(i))) + lame*log(volume)*one(a(i), b(i)))/volume
    do k = 1, ntens
      ddsdde(i, k) = (0.5d0*shear*(one(a(i), a(k))*left(b(i), b(k)) + one(a(i), b(k))*left(b(i), a(k)) &
                                   + one(b(i), b(k))*left(a(i), a(k)) + one(b(i), a(k))*left(a(i), b(k))) &
                      + lame*one(a(i), b(i))*one(a(k), b(k)))/volume
    end do
  end do
  sse = 0.5d0*shear*(left(1, 1) + left(2, 2) + left(3, 3) - 3 - 2*log(volume)) + 0.5d0*lame*log(volume)**2
end subroutine neo

! Hooke's law of increments; statev(1:ntens) is a tensor that stays in the material, turned by ROTSIG, given by props(3:) at the
! first increment.
subroutine hypo(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, stran, dstran, time, dtime, temp, dtemp, &
                predef, dpred, cmname, ndi, nshr, ntens, nstatv, props, nprops, coords, drot, pnewdt, celent, dfgrd0, dfgrd1, &
                noel, npt, layer, kspt, kstep, kinc)
  implicit none
  character(80) :: cmname
  integer :: ndi, nshr, ntens, nstatv, nprops, noel, npt, layer, kspt, kstep(4), kinc, i
  real(8) :: stress(ntens), statev(nstatv), ddsdde(ntens, ntens), sse, spd, scd, rpl, ddsddt(ntens), drplde(ntens), drpldt
  real(8) :: stran(ntens), dstran(ntens), time(2), dtime, temp, dtemp, predef(1), dpred(1), props(nprops), coords(3), drot(3, 3)
  real(8) :: pnewdt, celent, dfgrd0(3, 3), dfgrd1(3, 3), shear, lame, before(ntens), turned(ntens)
  shear = props(1)/(2*(1 + props(2)))
  lame = props(1)*props(2)/((1 + props(2))*(1 - 2*props(2)))
  ddsdde = 0
  ddsdde(1:ndi, 1:ndi) = lame
  do i = 1, ndi
    ddsdde(i, i) = ddsdde(i, i) + 2*shear
  end do
  do i = ndi + 1, ntens
    ddsdde(i, i) = shear
  end do
  if (kinc == 1) statev(1:ntens) = props(3:2 + ntens)
  call rotsig(statev, drot, turned, 1, ndi, nshr)
  statev(1:ntens) = turned
  before = stress
  stress = stress + matmul(ddsdde, dstran)
  sse = sse + 0.5d0*dot_product(before + stress, dstran)
end subroutine hypo

! Springs whose statev records the arguments of the call: coords(3), time(2), dtime, ndi, nshr, ntens, noel, npt, kstep, kinc,
! celent, nlgeom, stran(1), stress(1) as they came in, drot(1:2, 1).
subroutine told(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, stran, dstran, time, dtime, temp, dtemp, &
                predef, dpred, cmname, ndi, nshr, ntens, nstatv, props, nprops, coords, drot, pnewdt, celent, dfgrd0, dfgrd1, &
                noel, npt, layer, kspt, kstep, kinc)
  implicit none
  character(80) :: cmname
  integer :: ndi, nshr, ntens, nstatv, nprops, noel, npt, layer, kspt, kstep(4), kinc, i
  real(8) :: stress(ntens), statev(nstatv), ddsdde(ntens, ntens), sse, spd, scd, rpl, ddsddt(ntens), drplde(ntens), drpldt
  real(8) :: stran(ntens), dstran(ntens), time(2), dtime, temp, dtemp, predef(1), dpred(1), props(nprops), coords(3), drot(3, 3)
  real(8) :: pnewdt, celent, dfgrd0(3, 3), dfgrd1(3, 3)
  statev = [coords, time, dtime, dble(ndi), dble(nshr), dble(ntens), dble(noel), dble(npt), dble(kstep(1)), dble(kinc), celent, &
            dble(kstep(3)), stran(1), stress(1), drot(1, 1), drot(2, 1)]
  ddsdde = 0
  do i = 1, ntens
    ddsdde(i, i) = props(1)
  end do
  stress = stress + props(1)*dstran
  if (nprops > 1) stress(1) = stress(1)*merge(1d0, sqrt(-1d0 + 0*stran(1)), stran(1) + dstran(1) < props(2)) ! no number beyond
end subroutine told

! Takes all stresses to be six.
subroutine six(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, stran, dstran)
  implicit none
  real(8) :: stress(6), statev(*), ddsdde(6, 6), sse, spd, scd, rpl, ddsddt(*), drplde(*), drpldt, stran(6), dstran(6)
  integer :: i
  ddsdde = 0
  do i = 1, 6
    ddsdde(i, i) = 1d6
  end do
  stress = stress + 1d6*dstran
end subroutine six
