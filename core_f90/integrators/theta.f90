!> The theta-method for rigid bodies: free velocity and configuration (Jean 1999).
!> Rigid bodies are linear in their translations, so that A = M (1 + h theta c) is diagonal; spins of bodies whose
!> inertia turns with them are the work of module rotation.
module theta
   use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double, c_int8_t
   use linear_scheme, only: cairn_scheme, no_history
   implicit none
   private
   public :: cairn_integrator_theta, cairn_theta_free_velocity, cairn_theta_advance
contains

   !> M (v1 - v) = h (theta F1 + (1 - theta) F0), q1 = q + h (theta v1 + (1 - theta) v).
   pure subroutine cairn_integrator_theta(h, params, scheme) bind(c)
      real(c_double), value :: h !< step [s]
      real(c_double), intent(in) :: params(*) !< theta in [1/2, 1] [-]
      type(cairn_scheme), intent(out) :: scheme !< a step
      associate (theta => params(1))
         scheme = no_history(h)
         scheme%end_share = theta
         scheme%implicit = theta
         scheme%damping = h*theta
         scheme%stiffness = h*theta*(h*theta)
         scheme%share = theta
         scheme%elastic_velocity = h*theta
      end associate
   end subroutine

   !> Velocity at the end of the step without contacts, and the diagonal of A^-1.
   pure subroutine cairn_theta_free_velocity(dim, nd, nb, h, theta, gravity, mass, inertia, velocity, velocity_free, &
                                             inverse_mass, force, damping, driven, driven_velocity) bind(c)
      integer(c_int32_t), value :: dim !< 2 or 3
      integer(c_int32_t), value :: nd !< dofs of a body: 3 or 6
      integer(c_int64_t), value :: nb !< bodies
      real(c_double), value :: h !< step [s]
      real(c_double), value :: theta !< in [1/2, 1]
      real(c_double), intent(in) :: gravity(dim) !< [m/s2]
      real(c_double), intent(in) :: mass(0:nb - 1) !< inf: moved by nothing [kg]
      real(c_double), intent(in) :: inertia(2*dim - 3, 0:nb - 1) !< principal moments, the first one is used here [kg m2]
      real(c_double), intent(in) :: velocity(nd, 0:nb - 1) !< at the start of the step [m/s, rad/s]
      real(c_double), intent(out) :: velocity_free(nd, 0:nb - 1) !< [m/s, rad/s]
      real(c_double), intent(out) :: inverse_mass(nd, 0:nb - 1) !< [1/kg, 1/(kg m2)]
      real(c_double), intent(in), optional :: force(nd, 0:nb - 1) !< theta F(t+) + (1 - theta) F(t) [N, N m]
      real(c_double), intent(in), optional :: damping(0:nb - 1) !< c, per unit of mass [1/s]
      integer(c_int8_t), intent(in), optional :: driven(0:nb - 1) !< bit j: dof j is driven
      real(c_double), intent(in), optional :: driven_velocity(nd, 0:nb - 1) !< [m/s, rad/s]
      integer(c_int64_t) :: i
      integer :: j
      real(c_double) :: inertial, kept, implicit_part, pushed

      do i = 0, nb - 1
         kept = 1
         implicit_part = 1
         if (present(damping)) then
            kept = 1 - h*(1 - theta)*damping(i)
            implicit_part = 1 + h*theta*damping(i)
         end if
         do j = 1, nd
            inertial = mass(i)
            pushed = 0
            if (j <= dim) then
               pushed = gravity(j)
            else
               inertial = inertia(1, i)
            end if
            if (inertial <= huge(inertial)) then
               if (present(force)) pushed = pushed + force(j, i)/inertial
               inverse_mass(j, i) = 1/(inertial*implicit_part)
               velocity_free(j, i) = (kept*velocity(j, i) + h*pushed)/implicit_part
            else
               inverse_mass(j, i) = 0
               velocity_free(j, i) = velocity(j, i)
            end if
         end do
      end do
      if (present(driven) .and. present(driven_velocity)) then
         do i = 0, nb - 1
            if (driven(i) == 0) cycle
            do j = 1, nd
               if (.not. btest(driven(i), j - 1)) cycle
               inverse_mass(j, i) = 0
               velocity_free(j, i) = driven_velocity(j, i)
            end do
         end do
      end if
   end subroutine

   !> Positions, and in 2D angles, after a time at constant velocity.
   pure subroutine cairn_theta_advance(dim, nd, nb, time, velocity, position, angle) bind(c)
      integer(c_int32_t), value :: dim !< 2 or 3
      integer(c_int32_t), value :: nd !< dofs of a body: 3 or 6; dim of points
      integer(c_int64_t), value :: nb !< bodies
      real(c_double), value :: time !< [s]
      real(c_double), intent(in) :: velocity(nd, 0:nb - 1) !< [m/s, rad/s]
      real(c_double), intent(inout) :: position(dim, 0:nb - 1) !< [m]
      real(c_double), intent(inout), optional :: angle(0:nb - 1) !< only in 2D [rad]
      integer(c_int64_t) :: i

      do i = 0, nb - 1
         position(:, i) = position(:, i) + time*velocity(1:dim, i)
      end do
      if (present(angle)) then
         do i = 0, nb - 1
            angle(i) = angle(i) + time*velocity(3, i)
         end do
      end if
   end subroutine

end module
