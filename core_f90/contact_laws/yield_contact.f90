!> Elastic, ideally plastic spheres (Thornton & Ning 1998): Hertz's contact until the pressure at its centre is the yield pressure
!> p, at delta_y = R (pi p/2 E*)^2; beyond, the force grows along F_y + pi p R (delta - delta_y), and unloads as Hertz's contact of
!> the flatter radius R_p = 4/3 E*/F ((2 F + F_y)/(2 pi p))^(3/2). Tangentially as Hertz-Mindlin.
module yield_contact
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use spin_springs, only: slide_by_the_books
  use spring_slider, only: damp, damping_of
  implicit none
  private
  public :: cairn_law_yield_contact_force, cairn_law_yield_contact_stiffness
  integer, parameter :: own = 5
  integer, parameter :: p_young = 1, p_yield = 2, p_poisson = 3, p_restitution = 4, p_mu = 5
  real(c_double), parameter :: pi = acos(-1.0_c_double)
contains

  !> restitution is that of the dashpot beside: that of slow collisions, which do not yield.
  subroutine cairn_law_yield_contact_force(n, c, context, gap, u, params, state, f, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components: 2 or 3
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the middle of the step [m/s]
    real(c_double), intent(in)          :: params(own)    !< see laws.def
    real(c_double), intent(inout)       :: state(n, c + 2) !< largest overlap [m], energy spent by yield
    !< and of the tangential spring [J], its elongation [m]
    real(c_double), intent(out)         :: f(n, c)        !< on A [N]
    real(c_double), intent(inout), optional :: energy(n, 4) !< stored, dissipated by yield and damping, by friction;
    !< released by tangential springs as their stiffness changed [J]
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: depth, elastic(n), dashpot(n), limit(n), tangential(n), damping(n), stored(n), spent(n)
    real(c_double) :: modulus, shear, ratio, a, flat, left, most, put_in
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    modulus = params(p_young)/(2*(1 - params(p_poisson)**2))
    shear = params(p_young)/(4*(2 - params(p_poisson))*(1 + params(p_poisson)))
    ratio = 2*sqrt(5.0_c_double/6)*damping_of(params(p_restitution))
    do i = 1, n
      depth = max(-gap(i), 0.0_c_double)
      state(i, 1) = max(state(i, 1), depth)
      call loaded(modulus, params(p_yield), geometry(i, 2), state(i, 1), most, put_in, flat)
      left = 0
      if (most > 0) left = state(i, 1) - (0.75_c_double*most/(modulus*sqrt(flat)))**(2.0_c_double/3)
      depth = max(depth - left, 0.0_c_double)
      if (state(i, 1) <= yield_depth(modulus, params(p_yield), geometry(i, 2))) depth = max(-gap(i), 0.0_c_double)
      a = sqrt(flat*depth)
      elastic(i) = 4.0_c_double/3*modulus*a*depth
      stored(i) = 0.4_c_double*elastic(i)*depth
      spent(i) = max(put_in - 0.4_c_double*most*(state(i, 1) - left), 0.0_c_double)
      dashpot(i) = ratio*sqrt(2*modulus*a*geometry(i, 3))
      tangential(i) = 8*shear*a
      damping(i) = ratio*sqrt(tangential(i)*geometry(i, 3))
    end do
    f(:, 1) = elastic
    call damp(n, context%h, geometry(:, 3), dashpot, u(:, 1), f(:, 1))
    do i = 1, n
      limit(i) = params(p_mu)*max(f(i, 1), 0.0_c_double)
    end do
    if (present(energy)) then
      energy(:, 1) = stored
      energy(:, 2) = spent - state(:, 2) + (elastic - f(:, 1))*u(:, 1)*context%h
      energy(:, 3) = 0
    end if
    state(:, 2) = spent
    call slide_by_the_books(n, c, context%h, tangential, damping, limit, u, state(:, 4:), f, state(:, 3), energy)
  end subroutine cairn_law_yield_contact_force

  !> Overlap at which it yields [m].
  pure real(c_double) function yield_depth(modulus, pressure, radius)
    real(c_double), intent(in) :: modulus, pressure, radius
    yield_depth = huge(radius)
    if (modulus > 0) yield_depth = radius*min(pi*pressure/(2*modulus), sqrt(huge(radius)))**2
  end function yield_depth

  !> Force at the largest overlap, the work up to it, and the radius by which it unloads.
  pure subroutine loaded(modulus, pressure, radius, depth, force, work, flat)
    real(c_double), intent(in)  :: modulus, pressure, radius, depth
    real(c_double), intent(out) :: force, work, flat
    real(c_double) :: first, at_yield
    first = min(yield_depth(modulus, pressure, radius), depth)
    at_yield = 4.0_c_double/3*modulus*sqrt(radius*first)*first
    force = at_yield
    work = 0.4_c_double*at_yield*first
    flat = radius
    if (.not. depth > first) return
    force = at_yield + pi*pressure*radius*(depth - first)
    work = work + 0.5_c_double*(at_yield + force)*(depth - first)
    flat = 4*modulus/(3*force)*((2*force + at_yield)/(2*pi*pressure))**1.5_c_double
  end subroutine loaded

  !> Stiffness at an overlap, damping ratio, and the gap at which the force begins.
  subroutine cairn_law_yield_contact_stiffness(n, c, overlap, radius, params, k, reach) bind(c)
    integer(c_int32_t), value   :: n           !< contacts
    integer(c_int32_t), value   :: c           !< components of the force
    real(c_double), intent(in)  :: overlap(n)  !< [m]
    real(c_double), intent(in)  :: radius(n)   !< effective radius [m]
    real(c_double), intent(in)  :: params(own) !< as for the force
    real(c_double), intent(out) :: k(n, 4)     !< normal, tangential [N/m], damping ratio [-], of spins [N m/rad]
    real(c_double), intent(out) :: reach(n)    !< [m]
    real(c_double) :: modulus, force, work, flat
    integer :: i
    modulus = params(p_young)/(2*(1 - params(p_poisson)**2))
    do i = 1, n
      call loaded(modulus, params(p_yield), radius(i), max(overlap(i), 0.0_c_double), force, work, flat)
      k(i, 1) = 0
      if (force > 0) k(i, 1) = 2*modulus*sqrt(flat)*(0.75_c_double*force/(modulus*sqrt(flat)))**(1.0_c_double/3)
      k(i, 2) = 0
      if (params(p_mu) > 0) k(i, 2) = k(i, 1)*2*(1 - params(p_poisson))/(2 - params(p_poisson))
    end do
    k(:, 3) = sqrt(5.0_c_double/6)*damping_of(params(p_restitution))
    k(:, 4) = 0
    reach = 0
  end subroutine cairn_law_yield_contact_stiffness
end module yield_contact
