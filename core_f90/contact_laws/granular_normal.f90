!> Normal forces of elastic and adhesive contacts and their dashpots, as other codes for grains name them: linear springs, Hertz's
!> contact, with the pull of Derjaguin, Muller & Toporov (1975), or of Johnson, Kendall & Roberts (1971).
module granular_normal
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use jkr, only: neck_of, fold_of, tear_gap, stored_in_neck, contact_radius, touching
  use spring_slider, only: damping_of
  implicit none
  private
  public :: normal_force, damping_coefficient, pull_off, neck_of, tear_gap, touching, tear_energy, hooke, hertz, dmt, jkr_contact
  integer, parameter :: hooke = 0, hertz = 1, dmt = 2, jkr_contact = 3
  integer, parameter :: by_restitution = 0, by_tsuji = 1, viscous = 2, of_mass = 3, viscoelastic = 4
  real(c_double), parameter :: pi = acos(-1.0_c_double)
contains

  !> Elastic force, contact radius, stiffness and energy of n contacts. A spring's radius is that of the overlapping spheres,
  !> sqrt(R delta). Bodies that do not touch exert no force.
  pure subroutine normal_force(n, model, modulus, work, gap, radius, touches, f, a, stiffness, energy)
    integer(c_int32_t), intent(in) :: n            !< contacts
    integer, intent(in)            :: model        !< see above
    real(c_double), intent(in)     :: modulus      !< E* [Pa]; of linear springs k [N/m]
    real(c_double), intent(in)     :: work         !< of adhesion [J/m2]
    real(c_double), intent(in)     :: gap(n), radius(n) !< [m]
    logical, intent(in)            :: touches(n)   !< of JKR, which pulls beyond the touch; others act where gap < 0
    real(c_double), intent(out)    :: f(n)         !< [N]
    real(c_double), intent(out)    :: a(n)         !< [m]
    real(c_double), intent(out)    :: stiffness(n) !< [N/m]
    real(c_double), intent(out)    :: energy(n)    !< [J]
    real(c_double) :: depth, force, b
    integer :: i
    if (model == jkr_contact) then
      b = neck_of(modulus, work)
      call contact_radius(n, b, radius, gap, touches, a)
      f = 4*modulus*a**3/(3*radius) - 2*modulus*b*a*sqrt(a)
      stiffness = 2*modulus*a
      energy = stored_in_neck(modulus, b, radius, a)
      return
    end if
    b = merge(2*pi*work, 0.0_c_double, model == dmt) ! pull on a radius
    if (model == hooke) then
      do i = 1, n
        depth = max(-gap(i), 0.0_c_double)
        a(i) = sqrt(radius(i)*depth)
        f(i) = merge(modulus*depth, 0.0_c_double, gap(i) < 0)
        stiffness(i) = modulus
        energy(i) = merge(0.5_c_double*modulus*depth**2, 0.0_c_double, gap(i) < 0)
      end do
    else
      do i = 1, n
        depth = max(-gap(i), 0.0_c_double)
        a(i) = sqrt(radius(i)*depth)
        force = 4.0_c_double/3*modulus*a(i)*depth
        stiffness(i) = 2*modulus*a(i)
        f(i) = merge(force - b*radius(i), 0.0_c_double, gap(i) < 0)
        energy(i) = merge(0.4_c_double*force*depth - b*radius(i)*depth, 0.0_c_double, gap(i) < 0)
      end do
    end if
  end subroutine normal_force

  !> Coefficient of the normal dashpot [N s/m]. By the restitution e: the share -ln e/sqrt(pi^2 + ln^2 e) of the critical damping of
  !> the linear spring, sqrt(5/6) times that of Hertz's (Antypov & Elliott 2011); by Tsuji, Tanaka & Ishida's polynomial in e
  !> (1992), alpha sqrt(m k), k the secant stiffness f/delta; a coefficient [N s/m], one times the mass [1/s], or times contact
  !> radius and mass [1/(m s)].
  pure subroutine damping_coefficient(n, model, damping, value, a, stiffness, mass, c)
    integer(c_int32_t), intent(in) :: n            !< contacts
    integer, intent(in)            :: model, damping !< of the force and of the dashpot
    real(c_double), intent(in)     :: value        !< restitution or coefficient
    real(c_double), intent(in)     :: a(n), stiffness(n), mass(n) !< [m, N/m, kg]
    real(c_double), intent(out)    :: c(n)         !< [N s/m]
    real(c_double) :: share
    select case (damping)
    case (by_restitution)
      share = 2*damping_of(value)*merge(1.0_c_double, sqrt(5.0_c_double/6), model == hooke)
      c = share*sqrt(stiffness*mass)
    case (by_tsuji)
      share = 1.2728_c_double + value*(-4.2783_c_double + value*(11.087_c_double + value*(-22.348_c_double &
              + value*(27.467_c_double + value*(-18.022_c_double + value*4.8218_c_double)))))
      c = max(share, 0.0_c_double)*sqrt(merge(1.0_c_double, 2.0_c_double/3, model == hooke)*stiffness*mass)
    case (viscous)
      c = merge(value, 0.0_c_double, mass > 0)
    case (of_mass)
      c = value*mass
    case default
      c = value*a*mass
    end select
  end subroutine damping_coefficient

  !> Greatest pull, as a positive force [N].
  elemental function pull_off(model, work, radius) result(pull)
    integer, intent(in)        :: model
    real(c_double), intent(in) :: work, radius !< [J/m2, m]
    real(c_double) :: pull
    pull = 0
    if (model == dmt) pull = 2*pi*work*radius
    if (model == jkr_contact) pull = 1.5_c_double*pi*work*radius
  end function pull_off

  !> Energy left in a neck as it tears [J].
  elemental function tear_energy(modulus, b, radius) result(energy)
    real(c_double), intent(in) :: modulus, b, radius
    real(c_double) :: energy
    energy = stored_in_neck(modulus, b, radius, fold_of(b, radius))
  end function tear_energy
end module granular_normal
