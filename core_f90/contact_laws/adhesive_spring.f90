!> Linear spring and dashpot with an attraction in touch, f_n = k delta - 2 zeta sqrt(k m) u_n - gamma sqrt(R delta), and viscous
!> friction up to a limit, |f_t| = min(c |u_t|, mu (f_n + F)), with the largest attraction F = gamma^2 R/4k. A c that would reverse
!> the slip of two spheres within a step is reduced in it to c/(1 + h c W_TT).
!> The contact ends where the gap opens: no neck. LMGC90's MD_JKRs.
module adhesive_spring
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use spring_slider, only: damp
  implicit none
  private
  public :: cairn_law_adhesive_spring_force, cairn_law_adhesive_spring_stiffness
  real(c_double), parameter :: rolls = 3.5_c_double !< m W_TT of solid spheres
contains

  subroutine cairn_law_adhesive_spring_force(n, c, context, gap, u, params, state, f, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components: 2 or 3
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the middle of the step [m/s]
    real(c_double), intent(in)          :: params(5)      !< k [N/m], gamma [N/m], zeta [-], c [N s/m], friction [-]
    real(c_double), intent(inout)       :: state(n, *)    !< none
    real(c_double), intent(out)         :: f(n, c)        !< on A [N]
    real(c_double), intent(inout), optional :: energy(n, 4) !< stored, dissipated by damping, by friction;
    !< released by tangential springs as their stiffness changed [J]
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: elastic(n), damping(n), delta, limit, size, speed, gives_way
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    do i = 1, n
      delta = max(0.0_c_double, -gap(i))
      elastic(i) = params(1)*delta - params(2)*sqrt(geometry(i, 2)*delta)
      damping(i) = 0
      if (delta > 0) damping(i) = 2*params(3)*sqrt(params(1)*geometry(i, 3))
      f(i, 1) = elastic(i)
    end do
    call damp(n, context%h, geometry(:, 3), damping, u(:, 1), f(:, 1))
    if (present(energy)) energy = 0
    do i = 1, n
      f(i, 2:) = 0
      if (.not. gap(i) < 0) cycle
      limit = f(i, 1)
      if (params(1) > 0) limit = limit + params(2)**2*geometry(i, 2)/(4*params(1))
      limit = params(5)*max(0.0_c_double, limit)
      speed = abs(u(i, 2))
      if (c > 2) speed = sqrt(u(i, 2)**2 + u(i, 3)**2)
      gives_way = 0 ! between bodies that are held
      if (geometry(i, 3) > 0) gives_way = rolls/geometry(i, 3)
      size = min(limit, params(4)*speed/(1 + context%h*params(4)*gives_way))
      if (speed > 0) f(i, 2:) = -size*(u(i, 2:)/speed)
      if (.not. present(energy)) cycle
      energy(i, 1) = params(1)*gap(i)**2/2 + params(2)*gap(i)*sqrt(-geometry(i, 2)*gap(i))*(2/3.0_c_double)
      energy(i, 2) = (elastic(i) - f(i, 1))*u(i, 1)*context%h
      energy(i, 3) = size*(speed - context%h*size*gives_way/2)*context%h
    end do
  end subroutine cairn_law_adhesive_spring_force

  !> Stiffness of the spring alone, which the attraction softens, damping ratio, and the gap at which the force begins.
  subroutine cairn_law_adhesive_spring_stiffness(n, c, overlap, radius, params, k, reach) bind(c)
    integer(c_int32_t), value   :: n          !< contacts
    integer(c_int32_t), value   :: c          !< components of the force
    real(c_double), intent(in)  :: overlap(n) !< [m]
    real(c_double), intent(in)  :: radius(n)  !< effective radius [m]
    real(c_double), intent(in)  :: params(5)  !< as for the force
    real(c_double), intent(out) :: k(n, 4)    !< normal, tangential [N/m], damping ratio [-], of spins [N m/rad]
    real(c_double), intent(out) :: reach(n)   !< [m]
    k(:, 1) = params(1)
    k(:, 2) = 0
    k(:, 3) = params(3)
    k(:, 4) = 0
    reach = 0
  end subroutine cairn_law_adhesive_spring_stiffness
end module adhesive_spring
