!> The return to Mises' yield surface along its radius (Wilkins 1964; Simo & Hughes 1998), hardening isotropic by Swift's power and
!> a linear part, and kinematic by Prager's.
module radial_return
  use, intrinsic :: iso_c_binding, only: c_double
  use tensor_functions, only: identity6
  implicit none
  private
  public :: mises, yield_stress, hardening_slope, hardening_energy

  type, public :: hardening_law
    real(c_double) :: yield, isotropic, kinematic, swift_strain, swift_power
  end type hardening_law
contains

  pure function yield_stress(law, strain) result(y)
    type(hardening_law), intent(in) :: law
    real(c_double), intent(in)      :: strain !< accumulated plastic
    real(c_double) :: y
    y = law%yield*(1 + strain/law%swift_strain)**law%swift_power + law%isotropic*strain
  end function yield_stress

  !> Derivative of the yield stress by the accumulated plastic strain [Pa].
  pure function hardening_slope(law, strain) result(slope)
    type(hardening_law), intent(in) :: law
    real(c_double), intent(in)      :: strain
    real(c_double) :: slope
    slope = law%isotropic + law%yield*law%swift_power/law%swift_strain*(1 + strain/law%swift_strain)**(law%swift_power - 1)
  end function hardening_slope

  !> Stored by isotropic hardening: what the yield stress grew by, along the plastic strain [J/m3].
  pure function hardening_energy(law, strain) result(w)
    type(hardening_law), intent(in) :: law
    real(c_double), intent(in)      :: strain
    real(c_double) :: w, p
    p = law%swift_power
    w = law%yield*(law%swift_strain*((1 + strain/law%swift_strain)**(p + 1) - 1)/(p + 1) - strain) &
        + 0.5_c_double*law%isotropic*strain**2
  end function hardening_energy

  !> Stress from elastic trial strain less plastic strain; plastic strain (shear twice), back stress and accumulated strain go on.
  !> A fault is 2, no solution, or 4: the material softens to a yield stress below zero, where its law says nothing, or faster than
  !> its shear resists.
  pure subroutine mises(bulk, shear, law, elastic, back, accumulated, flow, stress, tangent, fault)
    real(c_double), intent(in)      :: bulk, shear
    type(hardening_law), intent(in) :: law
    real(c_double), intent(in)      :: elastic(6)  !< trial strain, shear twice
    real(c_double), intent(inout)   :: back(6)     !< [Pa]
    real(c_double), intent(inout)   :: accumulated
    real(c_double), intent(out)     :: flow(6)     !< change of plastic strain, shear twice
    real(c_double), intent(out)     :: stress(6), tangent(6, 6)
    integer, intent(out)            :: fault
    real(c_double) :: trace, deviator(6), relative(6), size, multiplier, slope, n(6), share, twist, f, unit
    integer :: i, k, pass
    integer, parameter :: most = 50
    real(c_double), parameter :: root = sqrt(2.0_c_double/3)
    fault = 0
    trace = sum(elastic(:3))
    deviator(:3) = 2*shear*(elastic(:3) - trace/3)
    deviator(4:) = shear*elastic(4:)
    relative = deviator - back
    unit = scale(1.0_c_double, max(-1000, min(1000, exponent(maxval(abs(relative)))))) ! squares stay within what numbers reach
    n = relative/unit
    size = unit*sqrt(sum(n(:3)**2) + 2*sum(n(4:)**2))
    flow = 0
    share = 1
    twist = 0
    n = 0
    if (size > root*yield_stress(law, accumulated)) then
      multiplier = 0
      do pass = 1, most ! convex in the multiplier where hardening bends down: Newton's method comes from one side
        slope = 2*shear + 2*(hardening_slope(law, accumulated + root*multiplier) + law%kinematic)/3
        f = size - (2*shear + 2*law%kinematic/3)*multiplier - root*yield_stress(law, accumulated + root*multiplier)
        multiplier = multiplier + f/slope
        if (abs(f) <= 4*epsilon(f)*size) exit
      end do
      if (.not. abs(f) <= 1e-10_c_double*size) fault = 2
      if (.not. slope > 0) fault = 4
      n = relative/size
      flow(:3) = multiplier*n(:3)
      flow(4:) = 2*multiplier*n(4:)
      deviator = deviator - 2*shear*multiplier*n
      back = back + 2*law%kinematic/3*multiplier*n
      accumulated = accumulated + root*multiplier
      if (yield_stress(law, accumulated) < 0) fault = 4
      share = 1 - 2*shear*multiplier/size
      twist = 2*shear/slope - (1 - share)
    end if
    stress = deviator + bulk*trace*identity6
    tangent = -2*shear*twist*spread(n, 2, 6)*spread(n, 1, 6)
    do i = 1, 3
      do k = 1, 3
        tangent(i, k) = tangent(i, k) + bulk - 2*shear*share/3
      end do
      tangent(i, i) = tangent(i, i) + 2*shear*share
      tangent(i + 3, i + 3) = tangent(i + 3, i + 3) + shear*share
    end do
  end subroutine mises
end module radial_return
