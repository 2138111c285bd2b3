!> Works of the half steps of velocity Verlet by its own rule. With dv the change of a velocity in a half step and v the velocity in
!> the middle of the step, the kinetic energy changes by m dv v - m dv^2/2 in the first half and by m dv v + m dv^2/2 in the second:
!> works of all forces are those along the way of the step, and the squares, which telescope, belong to the integrator.
module verlet_works
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double, c_int8_t
  implicit none
  private
  public :: cairn_verlet_works, cairn_verlet_works_spheres
contains

  !> Works in the first half of a step, before it, or in the second, after the forces. Spins of bodies with unequal moments of
  !> inertia are left out unless they are driven.
  pure subroutine cairn_verlet_works(dim, nd, first, last, second, h, gravity, inverse_mass, contact_force, velocity, terms, &
                                     force, damping, driven, driven_velocity) bind(c)
    integer(c_int32_t), value      :: dim                    !< 2 or 3
    integer(c_int32_t), value      :: nd                     !< dofs of a body
    integer(c_int64_t), value      :: first, last            !< bodies first to last - 1
    integer(c_int32_t), value      :: second                 !< 0: first half, 1: second
    real(c_double), value          :: h                      !< step [s]
    real(c_double), intent(in)     :: gravity(dim)           !< [m/s2]
    real(c_double), intent(in)     :: inverse_mass(nd, 0:*)  !< 0: nothing moves it [1/kg, 1/(kg m2)]
    real(c_double), intent(in)     :: contact_force(nd, 0:*) !< at the start; second half: at the end [N, N m]
    real(c_double), intent(in)     :: velocity(nd, 0:*)      !< at the start; second half: in the middle [m/s, rad/s]
    real(c_double), intent(inout)  :: terms(4)               !< of contacts; of the squares; of damping beyond m c h v^2; of drives
                                                             !< beyond those of verlet_end: are added [J]
    real(c_double), intent(in), optional :: force(nd, 0:*)   !< mean over the step [N, N m]
    real(c_double), intent(in), optional :: damping(0:*)     !< per unit of mass [1/s]
    integer(c_int8_t), intent(in), optional :: driven(0:*)   !< bit j: dof j is driven
    real(c_double), intent(in), optional :: driven_velocity(nd, 0:*) !< at the end of the step [m/s, rad/s]
    real(c_double) :: half, push, drag, v, middle, other, weight, part(4)
    integer(c_int64_t) :: i
    integer :: j
    logical :: drives
    half = 0.5_c_double*h
    part = 0
    do i = first, last - 1
      do j = 1, nd
        v = velocity(j, i)
        push = contact_force(j, i)
        if (present(force)) push = push + force(j, i)
        drag = 0
        if (present(damping)) drag = damping(i)
        drives = .false.
        if (present(driven)) drives = btest(driven(i), j - 1)
        weight = 0
        if (j <= dim .and. inverse_mass(1, i) > 0) weight = gravity(j)
        if (.not. inverse_mass(j, i) > 0) then
          if (inverse_mass(1, i) > 0 .and. .not. drives) cycle
          middle = v
          if (drives .and. second == 0) middle = 0.5_c_double*(v + driven_velocity(j, i))
          part(1) = part(1) + half*contact_force(j, i)*middle
          if (drives) then
            part(4) = part(4) + half*(push - contact_force(j, i))*middle
          else
            part(4) = part(4) - half*contact_force(j, i)*middle
          end if
          cycle
        end if
        other = v + half*(inverse_mass(j, i)*push + weight) ! velocity at the other end of the half step
        if (second == 0) then
          other = other - half*drag*v
          if (drives) other = 0.5_c_double*(v + driven_velocity(j, i))
          middle = other
          part(2) = part(2) - 0.5_c_double*(other - v)**2/inverse_mass(j, i)
          part(3) = part(3) + half*drag*(v - middle)*middle/inverse_mass(j, i)
        else
          other = other/(1 + half*drag)
          if (drives) other = driven_velocity(j, i)
          middle = v
          part(2) = part(2) + 0.5_c_double*(other - v)**2/inverse_mass(j, i)
          part(3) = part(3) + half*drag*(other - middle)*middle/inverse_mass(j, i)
        end if
        part(1) = part(1) + half*contact_force(j, i)*middle
      end do
    end do
    terms = terms + part
  end subroutine cairn_verlet_works

  !> The same of spheres in 3D that nothing but contacts and gravity moves, eight bodies at a time.
  pure subroutine cairn_verlet_works_spheres(first, last, second, h, gravity, inverse_mass, contact_force, velocity, terms) &
    bind(c)
    integer(c_int64_t), value     :: first, last           !< bodies first to last - 1
    integer(c_int32_t), value     :: second                !< 0: first half, 1: second
    real(c_double), value         :: h                     !< step [s]
    real(c_double), intent(in)    :: gravity(3)            !< [m/s2]
    real(c_double), intent(in)    :: inverse_mass(6, 0:*)  !< 0: nothing moves it [1/kg, 1/(kg m2)]
    real(c_double), intent(in)    :: contact_force(6, 0:*) !< at the start; second half: at the end [N, N m]
    real(c_double), intent(in)    :: velocity(6, 0:*)      !< at the start; second half: in the middle [m/s, rad/s]
    real(c_double), intent(inout) :: terms(4)              !< of contacts; of the squares; of damping; of drives: are added [J]
    real(c_double) :: half, to_middle, linear(3), spin(3), push(6), work(8), square(8), still(8), one
    integer(c_int64_t) :: i, j
    integer :: k
    half = 0.5_c_double*h
    to_middle = merge(half, 0.0_c_double, second == 0)
    work = 0
    square = 0
    still = 0
    do i = first, last - 1, 8
      do k = 1, int(min(8_c_int64_t, last - i))
        j = i + k - 1
        push = contact_force(:, j)
        if (inverse_mass(1, j) > 0) then
          linear = inverse_mass(1, j)*push(1:3) + gravity
          spin = inverse_mass(4, j)*push(4:6)
          square(k) = square(k) + sum(linear**2)/inverse_mass(1, j)
          work(k) = work(k) + sum(push(1:3)*(velocity(1:3, j) + to_middle*linear))
          if (inverse_mass(4, j) > 0) then
            square(k) = square(k) + sum(spin**2)/inverse_mass(4, j)
            work(k) = work(k) + sum(push(4:6)*(velocity(4:6, j) + to_middle*spin))
          end if
        else
          one = sum(push*velocity(:, j))
          work(k) = work(k) + one
          still(k) = still(k) - one
        end if
      end do
    end do
    terms(1) = terms(1) + half*sum(work)
    terms(2) = terms(2) + merge(-0.5_c_double, 0.5_c_double, second == 0)*half*half*sum(square)
    terms(4) = terms(4) + half*sum(still)
  end subroutine cairn_verlet_works_spheres
end module verlet_works
