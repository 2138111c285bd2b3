! Two routines of Abaqus's interface in one: props(3) = 0 is Hooke's law, else Mises' perfect plasticity with that yield stress,
! statev(1) its accumulated plastic strain. The analysis ends where the strain along the first axis is above a half.
subroutine umat(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, stran, dstran, time, dtime, temp, dtemp, &
                predef, dpred, cmname, ndi, nshr, ntens, nstatv, props, nprops, coords, drot, pnewdt, celent, dfgrd0, dfgrd1, &
                noel, npt, layer, kspt, kstep, kinc)
  implicit none
  character(80) :: cmname
  integer :: ndi, nshr, ntens, nstatv, nprops, noel, npt, layer, kspt, kstep(4), kinc, i, k
  real(8) :: stress(ntens), statev(nstatv), ddsdde(ntens, ntens), sse, spd, scd, rpl, ddsddt(ntens), drplde(ntens), drpldt
  real(8) :: stran(ntens), dstran(ntens), time(2), dtime, temp, dtemp, predef(1), dpred(1), props(nprops), coords(3), drot(3, 3)
  real(8) :: pnewdt, celent, dfgrd0(3, 3), dfgrd1(3, 3), shear, lame, mean, mises, n(6), dgamma, share, before(6)
  real(8) :: ps(3), an(3, 3), turned(6), off ! of fixed size: memory left by XIT would not be freed
  shear = props(1)/(2*(1 + props(2)))
  lame = props(1)*props(2)/((1 + props(2))*(1 - 2*props(2)))
  if (stran(1) + dstran(1) > 0.5d0) call xit
  ddsdde = 0
  ddsdde(1:ndi, 1:ndi) = lame
  do i = 1, ndi
    ddsdde(i, i) = ddsdde(i, i) + 2*shear
  end do
  do i = ndi + 1, ntens
    ddsdde(i, i) = shear
  end do
  before(:ntens) = stress
  stress = stress + matmul(ddsdde, dstran)
  call sinv(stress, mean, mises, ndi, nshr)
  ! principal values give the same invariants, and a turn keeps them
  call sprinc(stress, ps, 1, ndi, nshr)
  call sprind(stress, ps, an, 1, ndi, nshr)
  off = abs(sum(ps)/3 - mean)
  call rotsig(stress, an, turned, 1, ndi, nshr) ! rows are directions: the stress in its own axes
  off = off + sum(abs(turned(ndi + 1:ntens))) + abs(turned(1) - ps(1))
  if (off > 1d-9*(abs(mean) + mises + 1d-30)) pnewdt = 0.5d0
  if (props(3) > 0 .and. mises > props(3)) then
    n(:ntens) = stress
    n(1:ndi) = n(1:ndi) - mean
    n(:ntens) = 1.5d0*n(:ntens)/mises
    dgamma = (mises - props(3))/(3*shear)
    stress = stress - 2*shear*dgamma*n(:ntens)
    statev(1) = statev(1) + dgamma
    spd = spd + props(3)*dgamma
    share = props(3)/mises
    do i = 1, ndi
      do k = 1, ndi
        ddsdde(i, k) = ddsdde(i, k) + 2*shear*(1 - share)/3
      end do
      ddsdde(i, i) = ddsdde(i, i) - 2*shear*(1 - share)
    end do
    do i = ndi + 1, ntens
      ddsdde(i, i) = share*shear
    end do
    do i = 1, ntens
      do k = 1, ntens
        ddsdde(i, k) = ddsdde(i, k) - 4*shear**2*(1/(3*shear) - dgamma/mises)*n(i)*n(k)
      end do
    end do
  end if
  sse = sse + 0.5d0*dot_product(before(:ntens) + stress, dstran)
end subroutine umat
