!> Terms of the energy balance of bodies over a step of the theta-method.
!> With a mean velocity v = (v- + v+)/2 the change of kinetic energy is M (v+ - v-).v exactly, at any theta. Potential and external
!> work follow the displacement h (theta v+ + (1 - theta) v-); the difference between both is D_theta.
module energy
   use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double, c_int8_t
   use linear_scheme, only: cairn_scheme, most_history
   implicit none
   private
   public :: cairn_energy_terms

   integer(c_int64_t), parameter :: chunk = 1024 !< partial sums of a fixed length: the order of addition never changes

contains

   !> Sums over the bodies. reaction: in, impulse of the contacts on each dof; out, impulse of the drive on driven dofs.
   subroutine cairn_energy_terms(dim, nd, nb, h, theta, gravity, mass, inertia, velocity_begin, velocity, terms, &
                                 force, damping, driven, reaction, momentum_begin, angular_momentum, scheme, way, a2, a3, a4, &
                                 a5) bind(c)
      integer(c_int32_t), value :: dim !< 2 or 3
      integer(c_int32_t), value :: nd !< 3 or 6; dim of points, which do not turn
      integer(c_int64_t), value :: nb !< bodies
      real(c_double), value :: h !< step [s]
      real(c_double), value :: theta !< in [1/2, 1]
      real(c_double), intent(in) :: gravity(dim) !< [m/s2]
      real(c_double), intent(in) :: mass(0:nb - 1) !< [kg]
      real(c_double), intent(in) :: inertia(2*dim - 3, 0:nb - 1) !< principal moments; not read of points with a force [kg m2]
      real(c_double), intent(in) :: velocity_begin(nd, 0:nb - 1) !< [m/s, rad/s]
      real(c_double), intent(in) :: velocity(nd, 0:nb - 1) !< at the end, as the contacts see it [m/s, rad/s]
      real(c_double), intent(out) :: terms(8) !< T at the end, dT, dU, W_external, W_driven, D_bulk, D_theta; what the
      !! forces alone would give bodies at rest, the scale of a step in which nothing moves [J]
      real(c_double), intent(in), optional :: force(nd, 0:nb - 1) !< [N, N m]
      real(c_double), intent(in), optional :: damping(0:nb - 1) !< [1/s]
      integer(c_int8_t), intent(in), optional :: driven(0:nb - 1) !< bit j: dof j is driven
      real(c_double), intent(inout), optional :: reaction(nd, 0:nb - 1) !< [N s, N m s]
      real(c_double), intent(in), optional :: momentum_begin(3, 0:nb - 1) !< angular momentum before the kick [N m s]
      real(c_double), intent(in), optional :: angular_momentum(3, 0:nb - 1) !< and after it [N m s]
      type(cairn_scheme), intent(in), optional :: scheme !< of the step, when it is not the theta-method
      real(c_double), intent(in), optional :: way(nd, 0:nb - 1) !< of cairn_history_way, if the scheme has a history [m, rad]
      real(c_double), intent(in), optional, dimension(nd, 0:nb - 1) :: a2, a3, a4, a5 !< its history at the start [m/s2, ...]
      integer(c_int64_t) :: first, i
      real(c_double) :: part(8), fallen
      logical :: plain

      ! most scenes: weight alone, and no body that stores angular momentum beside its spin
      plain = .not. (present(force) .or. present(damping) .or. present(momentum_begin) .or. present(angular_momentum) &
                     .or. present(scheme))
      fallen = (h*norm2(gravity))**2/2
      terms = 0
      do first = 0, nb - 1, chunk
         part = 0
         do i = first, min(first + chunk, nb) - 1
            if (plain .and. is_free(i)) then
               call add_free_body(i)
            else
               call add_body(i)
            end if
         end do
         terms = terms + part
      end do

   contains

      pure logical function is_free(i)
         integer(c_int64_t), intent(in) :: i
         is_free = mass(i) <= huge(mass) .and. inertia(1, i) <= huge(inertia)
         if (present(driven)) is_free = is_free .and. driven(i) == 0
      end function

      !> The same as add_body for weight alone, unrolled: loops as short as these would cost more than their work.
      subroutine add_free_body(i)
         integer(c_int64_t), intent(in) :: i
         real(c_double) :: twice, gain, fall, turn
         associate (v => velocity(:, i), b => velocity_begin(:, i), g => gravity, m => mass(i), k => inertia(1, i))
            if (dim == 2) then
               twice = m*(v(1)**2 + v(2)**2) + k*v(3)**2
               gain = m*((v(1) - b(1))*(v(1) + b(1)) + (v(2) - b(2))*(v(2) + b(2))) + k*((v(3) - b(3))*(v(3) + b(3)))
               fall = g(1)*(theta*v(1) + (1 - theta)*b(1)) + g(2)*(theta*v(2) + (1 - theta)*b(2))
               turn = g(1)*(v(1) - b(1)) + g(2)*(v(2) - b(2))
            else
               twice = m*(v(1)**2 + v(2)**2 + v(3)**2) + k*(v(4)**2 + v(5)**2 + v(6)**2)
               gain = m*((v(1) - b(1))*(v(1) + b(1)) + (v(2) - b(2))*(v(2) + b(2)) + (v(3) - b(3))*(v(3) + b(3))) &
                      + k*((v(4) - b(4))*(v(4) + b(4)) + (v(5) - b(5))*(v(5) + b(5)) + (v(6) - b(6))*(v(6) + b(6)))
               fall = g(1)*(theta*v(1) + (1 - theta)*b(1)) + g(2)*(theta*v(2) + (1 - theta)*b(2)) &
                      + g(3)*(theta*v(3) + (1 - theta)*b(3))
               turn = g(1)*(v(1) - b(1)) + g(2)*(v(2) - b(2)) + g(3)*(v(3) - b(3))
            end if
            part(1) = part(1) + twice/2
            part(2) = part(2) + gain/2
            part(3) = part(3) - m*(h*fall)
            part(7) = part(7) + (theta - 0.5_c_double)*h*(m*turn)
            part(8) = part(8) + m*fallen
         end associate
         if (present(reaction)) reaction(:, i) = 0
      end subroutine

      subroutine add_body(i)
         integer(c_int64_t), intent(in) :: i
         real(c_double) :: inertial, pull, push, change, end_momentum, mean, moved, contact, drag, given, lost
         logical :: held, turning
         integer :: j, axis

         do j = 1, nd
            held = .false.
            if (present(driven)) held = btest(driven(i), j - 1)
            contact = 0
            if (present(reaction)) contact = reaction(j, i)
            if (present(reaction)) reaction(j, i) = 0
            mean = (velocity_begin(j, i) + velocity(j, i))/2
            inertial = mass(i)
            if (j > dim) inertial = inertia(1, i)
            if (.not. inertial <= huge(inertial)) then
               if (held .and. present(reaction)) reaction(j, i) = -contact
               if (held) part(5) = part(5) - contact*mean
               cycle
            end if
            change = inertial*(velocity(j, i) - velocity_begin(j, i))
            end_momentum = inertial*velocity(j, i)
            turning = j > 3 .and. present(momentum_begin) .and. present(angular_momentum)
            if (turning) turning = minval(inertia(:, i)) < maxval(inertia(:, i)) ! a sphere stores no angular momentum
            axis = max(j - 3, 1)
            if (turning) change = angular_momentum(axis, i) - momentum_begin(axis, i)
            if (turning) end_momentum = angular_momentum(axis, i)
            moved = h*(theta*velocity(j, i) + (1 - theta)*velocity_begin(j, i))
            pull = 0
            push = 0
            drag = 0
            if (j <= dim) pull = inertial*gravity(j)
            if (present(force)) push = force(j, i)
            if (present(damping)) drag = damping(i)*dragged_momentum(axis, i, inertial, turning, moved)
            if (present(scheme) .and. .not. turning) then
               call add_history(i, j, held, inertial, pull + push, mean, moved, drag, given, lost)
            else
               given = h*(pull + push)
               lost = (theta - 0.5_c_double)*h*(pull + push)*(velocity(j, i) - velocity_begin(j, i))
            end if
            part(1) = part(1) + end_momentum*velocity(j, i)/2
            part(2) = part(2) + change*mean
            part(3) = part(3) - pull*moved
            part(4) = part(4) + push*moved
            part(6) = part(6) + drag*mean
            part(7) = part(7) + lost
            part(8) = part(8) + (h*(pull + push))*(h*(pull + push)/inertial)/2
            if (held) then
               contact = change - given + drag - contact
               part(5) = part(5) + contact*mean
               if (present(reaction)) reaction(j, i) = contact
            end if
         end do
      end subroutine

      !> Displacement, momentum given by forces and taken by drag, and dissipation of the integrator, with a history. Driven dofs
      !> have none: forces act on them for the whole step.
      subroutine add_history(i, j, held, inertial, forces, mean, moved, drag, given, lost)
         integer(c_int64_t), intent(in) :: i
         integer, intent(in) :: j
         logical, intent(in) :: held
         real(c_double), intent(in) :: inertial, forces, mean
         real(c_double), intent(inout) :: moved, drag
         real(c_double), intent(out) :: given, lost
         real(c_double) :: known(most_history), gain
         known = 0
         if (present(a2)) known(1) = a2(j, i)
         if (present(a3)) known(2) = a3(j, i)
         if (present(a4)) known(3) = a4(j, i)
         if (present(a5)) known(4) = a5(j, i)
         gain = velocity(j, i) - velocity_begin(j, i)
         if (present(way)) moved = moved + way(j, i)
         given = scheme%impulse*forces + inertial*dot_product(scheme%velocity, known)
         if (present(damping)) drag = damping(i)*inertial &
            *(scheme%impulse*(velocity_begin(j, i) + dot_product(scheme%damping_history, known)) + scheme%damping*gain)
         if (held) then
            given = h*forces
            drag = drag*(h/scheme%impulse)
         end if
         lost = forces*moved - given*mean
      end subroutine

      !> Momentum that drag acts on, times the step: M h (theta v+ + (1 - theta) v-).
      function dragged_momentum(axis, i, inertial, turning, moved) result(momentum)
         integer, intent(in) :: axis
         integer(c_int64_t), intent(in) :: i
         real(c_double), intent(in) :: inertial, moved
         logical, intent(in) :: turning
         real(c_double) :: momentum
         momentum = inertial*moved
         if (turning) momentum = h*(theta*angular_momentum(axis, i) + (1 - theta)*momentum_begin(axis, i))
      end function

   end subroutine

end module
