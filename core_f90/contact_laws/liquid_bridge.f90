!> Wet elastic grains: Hertz's contact, and a capillary bridge from touch until it ruptures at (1 + angle/2) V^(1/3) (Lian, Thornton
!> & Adams 1993). Forces of bridges: by Derjaguin's approximation, 4 pi R g cos(t) (1 - D/sqrt(D^2 + V/(pi R))), R the effective
!> radius (Lambert et al. 2008; Rabinovich, Esayanur & Moudgil 2005), or the fit of Willett et al. (2000) to the exact bridges, 4 pi
!> R g cos(t)/(1 + 1.05 x + 2.5 x^2), x = D sqrt(2 R/V).
module liquid_bridge
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use spin_springs, only: slide_by_the_books
  use spring_slider, only: damping_of, damp
  implicit none
  private
  public :: cairn_law_liquid_bridge_force, cairn_law_liquid_bridge_stiffness
  integer, parameter :: own = 8
  integer, parameter :: p_young = 1, p_tension = 2, p_volume = 3, p_angle = 4, p_fit = 5, p_poisson = 6, p_restitution = 7, p_mu = 8
  real(c_double), parameter :: pi = acos(-1.0_c_double)
contains

  !> Friction is that of the elastic contact, whose force bears the pull too.
  subroutine cairn_law_liquid_bridge_force(n, c, context, gap, u, params, state, f, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components: 2 or 3
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the middle of the step [m/s]
    real(c_double), intent(in)          :: params(own)    !< see laws.def
    real(c_double), intent(inout)       :: state(n, c + 1)    !< 1 while there is a bridge; energy of the tangential spring [J],
    !< spring [m]
    real(c_double), intent(out)         :: f(n, c)        !< on A [N]
    real(c_double), intent(inout), optional :: energy(n, 4) !< stored, dissipated by damping and rupture, by friction;
    !< released by tangential springs as their stiffness changed [J]
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: normal, shear, ratio, a, distance, elastic(n), dashpot(n), limit(n), tangential(n), damping(n), pull(n), &
                      held(n), change(n), farthest
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    normal = params(p_young)/(2*(1 - params(p_poisson)**2))
    shear = params(p_young)/(4*(2 - params(p_poisson))*(1 + params(p_poisson)))
    ratio = 2*sqrt(5.0_c_double/6)*damping_of(params(p_restitution))
    farthest = rupture(params)
    do i = 1, n
      a = sqrt(geometry(i, 2)*max(-gap(i), 0.0_c_double))
      elastic(i) = 4.0_c_double/3*normal*a*max(-gap(i), 0.0_c_double)
      dashpot(i) = ratio*sqrt(2*normal*a*geometry(i, 3))
      tangential(i) = 8*shear*a
      damping(i) = ratio*sqrt(tangential(i)*geometry(i, 3))
      distance = max(gap(i), 0.0_c_double)
      pull(i) = 0
      held(i) = 0
      change(i) = 0
      if (gap(i) < 0 .and. .not. state(i, 1) > 0) then
        change(i) = well(params, geometry(i, 2), farthest) ! what the liquid gives as it wets
        state(i, 1) = 1
      else if (state(i, 1) > 0 .and. distance > farthest) then
        state(i, 1) = 0
      end if
      if (.not. state(i, 1) > 0) cycle
      pull(i) = attraction(params, geometry(i, 2), distance)
      held(i) = well(params, geometry(i, 2), distance) - well(params, geometry(i, 2), farthest)
    end do
    f(:, 1) = elastic
    call damp(n, context%h, geometry(:, 3), dashpot, u(:, 1), f(:, 1))
    limit = merge(params(p_mu)*max(f(:, 1), 0.0_c_double), 0*gap, gap < 0)
    if (present(energy)) then
      energy(:, 1) = 0.4_c_double*elastic*max(-gap, 0.0_c_double) + held
      energy(:, 2) = (elastic - f(:, 1))*u(:, 1)*context%h + change
      energy(:, 3) = 0
    end if
    call slide_by_the_books(n, c, context%h, tangential, damping, limit, u, state(:, 3:), f, state(:, 2), energy)
    f(:, 1) = f(:, 1) - pull
  end subroutine cairn_law_liquid_bridge_force

  !> [N]
  pure real(c_double) function attraction(p, radius, distance)
    real(c_double), intent(in) :: p(own), radius, distance
    real(c_double) :: x
    attraction = 4*pi*radius*p(p_tension)*cos(p(p_angle))
    if (.not. p(p_volume) > 0) return
    if (p(p_fit) > 0) then
      x = distance*sqrt(2*radius/p(p_volume))
      attraction = attraction/(1 + x*(1.05_c_double + 2.5_c_double*x))
    else
      attraction = attraction*(1 - distance/sqrt(distance**2 + p(p_volume)/(pi*radius)))
    end if
  end function attraction

  !> Integral of the attraction over the distance from 0 [J].
  pure real(c_double) function well(p, radius, distance)
    real(c_double), intent(in) :: p(own), radius, distance
    real(c_double) :: root, x
    well = 0
    if (.not. p(p_volume) > 0) return
    if (p(p_fit) > 0) then
      root = sqrt(10 - 1.05_c_double**2)
      x = distance*sqrt(2*radius/p(p_volume))
      well = sqrt(p(p_volume)/(2*radius))*2/root*(atan((5*x + 1.05_c_double)/root) - atan(1.05_c_double/root))
    else
      x = p(p_volume)/(pi*radius)
      well = distance - sqrt(distance**2 + x) + sqrt(x)
    end if
    well = 4*pi*radius*p(p_tension)*cos(p(p_angle))*well
  end function well

  !> Distance at which it ruptures [m].
  pure real(c_double) function rupture(p)
    real(c_double), intent(in) :: p(own)
    rupture = (1 + p(p_angle)/2)*p(p_volume)**(1.0_c_double/3)
  end function rupture

  !> Stiffness at an overlap, damping ratio, and a gap beyond that at which bridges rupture.
  subroutine cairn_law_liquid_bridge_stiffness(n, c, overlap, radius, params, k, reach) bind(c)
    integer(c_int32_t), value   :: n           !< contacts
    integer(c_int32_t), value   :: c           !< components of the force
    real(c_double), intent(in)  :: overlap(n)  !< [m]
    real(c_double), intent(in)  :: radius(n)   !< effective radius [m]
    real(c_double), intent(in)  :: params(own) !< as for the force
    real(c_double), intent(out) :: k(n, 4)     !< normal, tangential [N/m], damping ratio [-], of spins [N m/rad]
    real(c_double), intent(out) :: reach(n)    !< [m]
    real(c_double) :: a(n)
    a = sqrt(radius*max(overlap, 0.0_c_double))
    k(:, 1) = params(p_young)/(1 - params(p_poisson)**2)*a
    k(:, 2) = merge(2*params(p_young)/((2 - params(p_poisson))*(1 + params(p_poisson)))*a, 0*a, params(p_mu) > 0)
    k(:, 3) = sqrt(5.0_c_double/6)*damping_of(params(p_restitution))
    k(:, 4) = 0
    reach = 1.001_c_double*rupture(params)
  end subroutine cairn_law_liquid_bridge_stiffness
end module liquid_bridge
