!> Hertz's contact of two like elastic spheres with Mindlin's tangential stiffness and Coulomb's limit; damped so that a
!> collision has the restitution e whatever its speed (Tsuji, Tanaka & Ishida 1992; Antypov & Elliott 2011).
!> E* = E/2(1 - nu^2), G* = E/4(2 - nu)(1 + nu); the tangential force is that of Mindlin (1949) without slip, up to the limit.
module hertz_mindlin
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use spring_slider, only: slide, damping_of, damp
  implicit none
  private
  public :: cairn_law_hertz_mindlin_force, cairn_law_hertz_mindlin_stiffness
contains

  !> With a = sqrt(R delta): f_n = 4/3 E* a delta - 2 sqrt(5/6) zeta sqrt(2 E* a m) u_n,
  !> f_t = -8 G* a spring - 2 sqrt(5/6) zeta sqrt(8 G* a m) u_t, at most mu f_n.
  subroutine cairn_law_hertz_mindlin_force(n, c, context, gap, u, params, state, f, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components: 2 or 3
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the middle of the step [m/s]
    real(c_double), intent(in)          :: params(4)      !< Young [Pa], Poisson, restitution, friction [-]
    real(c_double), intent(inout)       :: state(n, c - 1) !< tangential spring [m]
    real(c_double), intent(out)         :: f(n, c)        !< on A [N]
    real(c_double), intent(inout), optional :: energy(n, 4) !< stored, dissipated by damping, by friction;
    !< released by tangential springs as their stiffness changed [J]
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: normal, shear, ratio, root(n), a, overlap, limit(n), tangential(n), damping(n), stiffer(n)
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    normal = params(1)/(2*(1 - params(2)**2))
    shear = params(1)/(4*(2 - params(2))*(1 + params(2)))
    ratio = 2*sqrt(5.0_c_double/6)*damping_of(params(3))
    !$omp simd private(overlap, a)
    do i = 1, n
      overlap = max(-gap(i), 0.0_c_double)
      a = sqrt(geometry(i, 2)*overlap)
      root(i) = ratio*sqrt(2*normal)*sqrt(a*geometry(i, 3))
      f(i, 1) = 4.0_c_double/3*normal*a*overlap
      tangential(i) = 8*shear*a
      damping(i) = sqrt(4*shear/normal)*root(i)
    end do
    call damp(n, context%h, geometry(:, 3), root, u(:, 1), f(:, 1))
    do i = 1, n
      limit(i) = params(4)*max(f(i, 1), 0.0_c_double)
    end do
    if (present(energy)) then
      do i = 1, n
        overlap = max(-gap(i), 0.0_c_double)
        a = 4.0_c_double/3*normal*sqrt(geometry(i, 2)*overlap)*overlap
        energy(i, 1) = 0.4_c_double*a*overlap
        energy(i, 2) = (a - f(i, 1))*u(i, 1)*context%h
        energy(i, 3) = 0
        stiffer(i) = 0 ! the contact radius was that of an overlap before
        if (overlap > 0) stiffer(i) = sqrt(max(overlap + context%h*u(i, 1), 0.0_c_double)/overlap) - 1
      end do
    end if
    call slide(n, c, context%h, tangential, damping, limit, u, state, f, energy, stiffer)
  end subroutine cairn_law_hertz_mindlin_force

  !> Stiffness at an overlap, damping ratio, and the gap at which the force begins.
  subroutine cairn_law_hertz_mindlin_stiffness(n, c, overlap, radius, params, k, reach) bind(c)
    integer(c_int32_t), value   :: n          !< contacts
    integer(c_int32_t), value   :: c          !< components of the force
    real(c_double), intent(in)  :: overlap(n) !< [m]
    real(c_double), intent(in)  :: radius(n)  !< effective radius [m]
    real(c_double), intent(in)  :: params(4)  !< as for the force
    real(c_double), intent(out) :: k(n, 4)    !< normal, tangential [N/m], damping ratio [-], of spins [N m/rad]
    real(c_double), intent(out) :: reach(n)   !< [m]
    real(c_double) :: a(n)
    a = sqrt(radius*max(overlap, 0.0_c_double))
    k(:, 1) = params(1)/(1 - params(2)**2)*a
    k(:, 2) = merge(2*params(1)/((2 - params(2))*(1 + params(2)))*a, 0*a, params(4) > 0)
    k(:, 3) = sqrt(5.0_c_double/6)*damping_of(params(3))
    k(:, 4) = 0
    reach = 0
  end subroutine cairn_law_hertz_mindlin_stiffness
end module hertz_mindlin
