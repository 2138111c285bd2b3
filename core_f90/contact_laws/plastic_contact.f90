!> Grains that yield: linear springs that unload stiffer than they load, with cohesion (Luding 2008). A contact loads along k1
!> delta, unloads and reloads along k2 (delta - delta_0), and pulls by at most k_c delta. k2 grows from k1 to `unloading` as the
!> largest overlap grows to delta* = k2/(k2 - k1) `plastic` 2 R, beyond which the spring is elastic.
module plastic_contact
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use spin_springs, only: slide_by_the_books
  use spring_slider, only: damp
  implicit none
  private
  public :: cairn_law_plastic_contact_force, cairn_law_plastic_contact_stiffness
  integer, parameter :: own = 7
  integer, parameter :: p_loading = 1, p_unloading = 2, p_cohesion = 3, p_plastic = 4, p_damping = 5, p_ratio = 6, p_mu = 7
contains

  !> Force along the branch that the overlap is on, and what the step spent there.
  subroutine cairn_law_plastic_contact_force(n, c, context, gap, u, params, state, f, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components: 2 or 3
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the middle of the step [m/s]
    real(c_double), intent(in)          :: params(own)    !< see laws.def
    real(c_double), intent(inout)       :: state(n, c + 3) !< largest overlap [m], last force [N], last overlap [m]; energy of the
    !< spring [J], spring [m]
    real(c_double), intent(out)         :: f(n, c)        !< on A [N]
    real(c_double), intent(inout), optional :: energy(n, 4) !< stored, dissipated by yield and damping, by friction;
    !< released by tangential springs as their stiffness changed [J]
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: depth, elastic(n), dashpot(n), limit(n), tangential(n), damping(n), stored(n), spent(n), k2, before
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    do i = 1, n
      depth = max(-gap(i), 0.0_c_double)
      k2 = stiffness_of(params, geometry(i, 2), state(i, 1))
      before = energy_of(k2, state(i, 2))
      state(i, 1) = max(state(i, 1), depth)
      k2 = stiffness_of(params, geometry(i, 2), state(i, 1))
      elastic(i) = k2*(depth - state(i, 1)) + force_at(params, geometry(i, 2), state(i, 1))
      if (elastic(i) < -params(p_cohesion)*depth) then
        elastic(i) = -params(p_cohesion)*depth
        if (k2 > params(p_loading)) state(i, 1) = min(state(i, 1), (k2 + params(p_cohesion))/(k2 - params(p_loading))*depth)
      end if
      if (.not. gap(i) < 0) elastic(i) = 0
      k2 = stiffness_of(params, geometry(i, 2), state(i, 1))
      stored(i) = energy_of(k2, elastic(i))
      spent(i) = 0.5_c_double*(elastic(i) + state(i, 2))*(depth - state(i, 3)) - (stored(i) - before)
      state(i, 2) = elastic(i)
      state(i, 3) = depth
      tangential(i) = merge(params(p_ratio)*params(p_loading), 0.0_c_double, gap(i) < 0)
      dashpot(i) = merge(2*params(p_damping)*sqrt(params(p_loading)*geometry(i, 3)), 0.0_c_double, gap(i) < 0)
      damping(i) = sqrt(params(p_ratio))*dashpot(i)
    end do
    f(:, 1) = elastic
    call damp(n, context%h, geometry(:, 3), dashpot, u(:, 1), f(:, 1))
    do i = 1, n
      limit(i) = params(p_mu)*max(f(i, 1) + params(p_cohesion)*max(-gap(i), 0.0_c_double), 0.0_c_double)
    end do
    if (present(energy)) then
      energy(:, 1) = stored
      energy(:, 2) = spent + (elastic - f(:, 1))*u(:, 1)*context%h
      energy(:, 3) = 0
    end if
    call slide_by_the_books(n, c, context%h, tangential, damping, limit, u, state(:, 5:), f, state(:, 4), energy)
  end subroutine cairn_law_plastic_contact_force

  !> Stiffness of unloading from a largest overlap [N/m].
  pure real(c_double) function stiffness_of(p, radius, largest)
    real(c_double), intent(in) :: p(own), radius, largest
    stiffness_of = max(p(p_unloading), p(p_loading))
    if (largest < limit_of(p, radius)) stiffness_of = p(p_loading) + (stiffness_of - p(p_loading))*(largest/limit_of(p, radius))
  end function stiffness_of

  !> Overlap beyond which it is elastic [m].
  pure real(c_double) function limit_of(p, radius)
    real(c_double), intent(in) :: p(own), radius
    limit_of = huge(radius)
    if (p(p_unloading) > p(p_loading)) limit_of = p(p_unloading)/(p(p_unloading) - p(p_loading))*p(p_plastic)*2*radius
  end function limit_of

  !> Force at the largest overlap [N].
  pure real(c_double) function force_at(p, radius, largest)
    real(c_double), intent(in) :: p(own), radius, largest
    force_at = p(p_loading)*min(largest, limit_of(p, radius)) + p(p_unloading)*max(largest - limit_of(p, radius), 0.0_c_double)
  end function force_at

  !> Energy that unloading gives back [J].
  pure real(c_double) function energy_of(k2, force)
    real(c_double), intent(in) :: k2, force
    energy_of = 0
    if (k2 > 0) energy_of = 0.5_c_double*force**2/k2
  end function energy_of

  !> Stiffness at an overlap, damping ratio, and the gap at which the force begins.
  subroutine cairn_law_plastic_contact_stiffness(n, c, overlap, radius, params, k, reach) bind(c)
    integer(c_int32_t), value   :: n           !< contacts
    integer(c_int32_t), value   :: c           !< components of the force
    real(c_double), intent(in)  :: overlap(n)  !< [m]
    real(c_double), intent(in)  :: radius(n)   !< effective radius [m]
    real(c_double), intent(in)  :: params(own) !< as for the force
    real(c_double), intent(out) :: k(n, 4)     !< normal, tangential [N/m], damping ratio [-], of spins [N m/rad]
    real(c_double), intent(out) :: reach(n)    !< [m]
    k(:, 1) = max(params(p_unloading), params(p_loading)) + 0*(overlap + radius)
    k(:, 2) = merge(params(p_ratio)*params(p_loading), 0.0_c_double, params(p_mu) > 0)
    k(:, 3) = params(p_damping)
    k(:, 4) = 0
    reach = 0
  end subroutine cairn_law_plastic_contact_stiffness
end module plastic_contact
