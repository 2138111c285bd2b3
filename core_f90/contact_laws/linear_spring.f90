!> Linear spring and dashpot, with a tangential spring and Coulomb's limit (Cundall & Strack 1979).
!> The contact ends where the gap opens, so that a collision of two bodies has the restitution e exactly; just before, the
!> damping may pull.
module linear_spring
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use spring_slider, only: slide, damping_of, damp
  implicit none
  private
  public :: cairn_law_linear_spring_force, cairn_law_linear_spring_stiffness
contains

  !> f_n = k delta - 2 zeta sqrt(k m) u_n; f_t = -ratio k spring - 2 zeta sqrt(ratio k m) u_t, at most mu f_n.
  subroutine cairn_law_linear_spring_force(n, c, context, gap, u, params, state, f, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components: 2 or 3
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the middle of the step [m/s]
    real(c_double), intent(in)          :: params(4)      !< normal stiffness [N/m], tangential / normal, restitution, friction
    real(c_double), intent(inout)       :: state(n, c - 1) !< tangential spring [m]
    real(c_double), intent(out)         :: f(n, c)        !< on A [N]
    real(c_double), intent(inout), optional :: energy(n, 4) !< stored, dissipated by damping, by friction;
    !< released by tangential springs as their stiffness changed [J]
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: ratio, limit(n), tangential(n), damping(n)
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    ratio = damping_of(params(3))
    do i = 1, n
      f(i, 1) = -params(1)*gap(i)
      damping(i) = 2*ratio*sqrt(params(1)*geometry(i, 3))
    end do
    call damp(n, context%h, geometry(:, 3), damping, u(:, 1), f(:, 1))
    do i = 1, n
      limit(i) = params(4)*max(f(i, 1), 0.0_c_double)
      tangential(i) = params(2)*params(1)
      damping(i) = 2*ratio*sqrt(tangential(i)*geometry(i, 3))
    end do
    if (present(energy)) then
      energy(:, 1) = 0.5_c_double*params(1)*gap**2
      energy(:, 2) = -(params(1)*gap + f(:, 1))*u(:, 1)*context%h
      energy(:, 3) = 0
    end if
    call slide(n, c, context%h, tangential, damping, limit, u, state, f, energy)
  end subroutine cairn_law_linear_spring_force

  !> Stiffness at an overlap, damping ratio, and the gap at which the force begins.
  subroutine cairn_law_linear_spring_stiffness(n, c, overlap, radius, params, k, reach) bind(c)
    integer(c_int32_t), value   :: n          !< contacts
    integer(c_int32_t), value   :: c          !< components of the force
    real(c_double), intent(in)  :: overlap(n) !< [m]
    real(c_double), intent(in)  :: radius(n)  !< effective radius [m]
    real(c_double), intent(in)  :: params(4)  !< as for the force
    real(c_double), intent(out) :: k(n, 4)    !< normal, tangential [N/m], damping ratio [-], of spins [N m/rad]
    real(c_double), intent(out) :: reach(n)   !< [m]
    k(:, 1) = params(1)
    k(:, 2) = merge(params(2)*params(1), 0.0_c_double, params(4) > 0)
    k(:, 3) = damping_of(params(3))
    k(:, 4) = 0
    reach = 0
  end subroutine cairn_law_linear_spring_stiffness
end module linear_spring
