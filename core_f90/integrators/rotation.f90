!> Rotation of rigid bodies in 3D by unit quaternions.
!> A body that nothing touches turns by the energy and momentum conserving midpoint rule of Simo & Wong (1991): the
!> angular momentum in space is the stored state, so that it is conserved by construction, and the kinetic energy to rounding.
!> A step is drift (free rotation), kick (impulses at the frozen inertia of the detection configuration), drift: of second
!> order at theta = 1/2, and the work of the impulses closes the balance to rounding.
module rotation
   use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double, c_int8_t
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   implicit none
   private
   public :: cairn_rotate, cairn_inverse_inertia, cairn_free_spin, cairn_momentum_update

   integer, parameter :: most_substeps = 4096 !< cost stays bounded when a body turns thousands of times in a step
   integer, parameter :: some = 64 !< bodies that are turned side by side

contains

   !> Orientation after a free motion over a time: spherical and driven bodies keep their spin, others their angular momentum.
   pure subroutine cairn_rotate(nb, time, inertia, velocity, rotation, angular_momentum, driven, unsolved) bind(c)
      integer(c_int64_t), value :: nb !< bodies
      real(c_double), value :: time !< [s]
      real(c_double), intent(in) :: inertia(3, 0:nb - 1) !< principal moments [kg m2]
      real(c_double), intent(in) :: velocity(6, 0:nb - 1) !< spin in 4:6 [rad/s]
      real(c_double), intent(inout) :: rotation(4, 0:nb - 1) !< unit quaternion, body to space
      real(c_double), intent(in), optional :: angular_momentum(3, 0:nb - 1) !< in space axes [N m s]
      integer(c_int8_t), intent(in), optional :: driven(0:nb - 1) !< bits 3 to 5: driven spins
      integer(c_int64_t), intent(out) :: unsolved !< bodies whose midpoint rule found no solution: they kept their spin
      integer(c_int64_t) :: i, waiting(some)
      integer :: n
      logical :: solved

      unsolved = 0
      n = 0
      do i = 0, nb - 1
         solved = .false.
         if (turns_freely(i, inertia(:, i), driven)) then
            if (present(angular_momentum)) then
               call rotate_with_momentum(time, inertia(:, i), angular_momentum(:, i), rotation(:, i), solved)
               if (.not. solved) unsolved = unsolved + 1
            end if
         end if
         if (solved) cycle
         n = n + 1
         waiting(n) = i
         if (n < some) cycle
         call rotate_with_spins(nb, time, n, waiting, velocity, rotation)
         n = 0
      end do
      call rotate_with_spins(nb, time, n, waiting, velocity, rotation)
   end subroutine

   !> Inverse inertia in space axes at the present orientation, blocked axes held.
   pure subroutine cairn_inverse_inertia(nb, inertia, rotation, inverse_mass, inverse_inertia, driven) bind(c)
      integer(c_int64_t), value :: nb !< bodies
      real(c_double), intent(in) :: inertia(3, 0:nb - 1) !< principal moments [kg m2]
      real(c_double), intent(in) :: rotation(4, 0:nb - 1) !< unit quaternion
      real(c_double), intent(in) :: inverse_mass(6, 0:nb - 1) !< of spherical bodies it holds the answer [1/(kg m2)]
      real(c_double), intent(out) :: inverse_inertia(6, 0:nb - 1) !< xx yy zz xy xz yz [1/(kg m2)]
      integer(c_int8_t), intent(in), optional :: driven(0:nb - 1) !< bits 3 to 5: driven spins
      integer(c_int64_t) :: i
      real(c_double) :: r(3, 3), m(3, 3)
      logical :: free(3)

      do i = 0, nb - 1
         if (is_spherical(inertia(:, i))) then
            inverse_inertia(1:3, i) = inverse_mass(4:6, i)
            inverse_inertia(4:6, i) = 0
            cycle
         end if
         r = matrix_of(rotation(:, i))
         free = .true.
         if (present(driven)) free = [.not. btest(driven(i), 3), .not. btest(driven(i), 4), .not. btest(driven(i), 5)]
         if (all(free)) then
            m = matmul(r, spread(1/inertia(:, i), 2, 3)*transpose(r))
         else
            m = constrained_inverse(matmul(r, spread(inertia(:, i), 2, 3)*transpose(r)), free)
         end if
         inverse_inertia(:, i) = [m(1, 1), m(2, 2), m(3, 3), m(1, 2), m(1, 3), m(2, 3)]
      end do
   end subroutine

   !> Spin at the start and free spin at the end of the step of bodies with an angular momentum, at the frozen inertia.
   pure subroutine cairn_free_spin(nb, h, theta, inertia, angular_momentum, inverse_inertia, velocity, velocity_free, &
                                   force, damping, driven) bind(c)
      integer(c_int64_t), value :: nb !< bodies
      real(c_double), value :: h !< step [s]
      real(c_double), value :: theta !< in [1/2, 1]
      real(c_double), intent(in) :: inertia(3, 0:nb - 1) !< principal moments [kg m2]
      real(c_double), intent(in) :: angular_momentum(3, 0:nb - 1) !< at the start of the step [N m s]
      real(c_double), intent(inout) :: inverse_inertia(6, 0:nb - 1) !< in: of I; out: of I (1 + h theta c) [1/(kg m2)]
      real(c_double), intent(inout) :: velocity(6, 0:nb - 1) !< 4:6 out: spin at the start, seen by the contacts [rad/s]
      real(c_double), intent(inout) :: velocity_free(6, 0:nb - 1) !< 4:6 out [rad/s]
      real(c_double), intent(in), optional :: force(6, 0:nb - 1) !< 4:6 torque [N m]
      real(c_double), intent(in), optional :: damping(0:nb - 1) !< c [1/s]
      integer(c_int8_t), intent(in), optional :: driven(0:nb - 1) !< bits 3 to 5: driven spins
      integer(c_int64_t) :: i
      real(c_double) :: spin(3), torque(3), kept, implicit_part

      do i = 0, nb - 1
         if (.not. turns_freely(i, inertia(:, i), driven)) cycle
         spin = times(inverse_inertia(:, i), angular_momentum(:, i))
         torque = 0
         if (present(force)) torque = force(4:6, i)
         kept = 1
         implicit_part = 1
         if (present(damping)) then
            kept = 1 - h*(1 - theta)*damping(i)
            implicit_part = 1 + h*theta*damping(i)
         end if
         velocity(4:6, i) = spin
         velocity_free(4:6, i) = (kept*spin + h*times(inverse_inertia(:, i), torque))/implicit_part
         inverse_inertia(:, i) = inverse_inertia(:, i)/implicit_part
      end do
   end subroutine

   !> Keeps spin and angular momentum in step with each other at the present orientation.
   pure subroutine cairn_momentum_update(nb, mode, inertia, rotation, velocity_begin, velocity, angular_momentum, driven) bind(c)
      integer(c_int64_t), value :: nb !< bodies
      integer(c_int32_t), value :: mode !< 0: spin from momentum; 1: momentum from the change of spin; 2: momentum from the spin
      real(c_double), intent(in) :: inertia(3, 0:nb - 1) !< principal moments [kg m2]
      real(c_double), intent(in) :: rotation(4, 0:nb - 1) !< unit quaternion
      real(c_double), intent(in) :: velocity_begin(6, 0:nb - 1) !< spin before the kick in 4:6 [rad/s]
      real(c_double), intent(inout) :: velocity(6, 0:nb - 1) !< spin in 4:6 [rad/s]
      real(c_double), intent(inout) :: angular_momentum(3, 0:nb - 1) !< in space axes [N m s]
      integer(c_int8_t), intent(in), optional :: driven(0:nb - 1) !< bits 3 to 5: driven spins
      integer(c_int64_t) :: i
      real(c_double) :: r(3, 3), change(3)

      do i = 0, nb - 1
         if (is_spherical(inertia(:, i))) cycle
         r = matrix_of(rotation(:, i))
         if (mode == 2 .or. .not. turns_freely(i, inertia(:, i), driven)) then
            angular_momentum(:, i) = matmul(r, inertia(:, i)*matmul(velocity(4:6, i), r))
         else if (mode == 1) then
            change = velocity(4:6, i) - velocity_begin(4:6, i)
            angular_momentum(:, i) = angular_momentum(:, i) + matmul(r, inertia(:, i)*matmul(change, r))
         else
            velocity(4:6, i) = matmul(r, matmul(angular_momentum(:, i), r)/inertia(:, i))
         end if
      end do
   end subroutine

   pure function is_spherical(inertia) result(yes)
      real(c_double), intent(in) :: inertia(3)
      logical :: yes
      yes = .not. (inertia(1) < inertia(2) .or. inertia(1) > inertia(2) .or. inertia(1) < inertia(3) .or. inertia(1) > inertia(3))
   end function

   pure function turns_freely(i, inertia, driven) result(yes)
      integer(c_int64_t), intent(in) :: i
      real(c_double), intent(in) :: inertia(3)
      integer(c_int8_t), intent(in), optional :: driven(0:*)
      logical :: yes
      yes = .not. is_spherical(inertia)
      if (present(driven)) yes = yes .and. iand(int(driven(i)), 56) == 0
   end function

   !> Quaternion times the Cayley map of the vector half the rotation.
   pure subroutine turn(q, half)
      real(c_double), intent(inout) :: q(4)
      real(c_double), intent(in) :: half(3) !< tan of half the angle, along the axis, in the axes of the body
      real(c_double) :: p(4)
      p(1) = q(1) - dot_product(q(2:4), half)
      p(2:4) = q(2:4) + q(1)*half + cross(q(2:4), half)
      q = p/length(p)
   end subroutine

   !> Bodies with constant spin, in SIMD lanes: roots and quotients take a quarter of the time of single ones. Squares are stored
   !> before they are summed where a compiler must not fuse both into a single rounding.
   pure subroutine rotate_with_spins(nb, time, n, who, velocity, rotation)
      integer(c_int64_t), intent(in) :: nb !< bodies
      real(c_double), intent(in) :: time !< [s]
      integer, intent(in) :: n !< of them
      integer(c_int64_t), intent(in) :: who(n)
      real(c_double), intent(in) :: velocity(6, 0:nb - 1) !< spin in 4:6, in space axes [rad/s]
      real(c_double), intent(inout) :: rotation(4, 0:nb - 1) !< unit quaternion
      real(c_double) :: spin(some, 3), q(some, 4), p(some, 4), square(some, 4), rate(some), largest(some), s(some), c(some)
      real(c_double) :: half(3), over
      integer :: i, k

      do i = 1, n
         spin(i, :) = velocity(4:6, who(i))
         q(i, :) = rotation(:, who(i))
      end do
      call scale_squares(n, 3, spin, largest, square)
      !$omp simd
      do i = 1, n
         rate(i) = largest(i)*sqrt(square(i, 1) + square(i, 2) + (spin(i, 3)/largest(i))**2)
      end do
      do i = 1, n
         s(i) = sin(time*rate(i)/2)
         c(i) = cos(time*rate(i)/2)
      end do
      !$omp simd private(half, over)
      do i = 1, n
         over = merge(rate(i), 1.0_c_double, rate(i) > 0)
         half(1) = spin(i, 1)/over*s(i)
         half(2) = spin(i, 2)/over*s(i)
         half(3) = spin(i, 3)/over*s(i)
         p(i, 1) = q(i, 1)*c(i) - dot_product(half, q(i, 2:4)) ! the spin stands on the left
         p(i, 2) = q(i, 2)*c(i) + q(i, 1)*half(1) + (half(2)*q(i, 4) - half(3)*q(i, 3))
         p(i, 3) = q(i, 3)*c(i) + q(i, 1)*half(2) + (half(3)*q(i, 2) - half(1)*q(i, 4))
         p(i, 4) = q(i, 4)*c(i) + q(i, 1)*half(3) + (half(1)*q(i, 3) - half(2)*q(i, 2))
      end do
      call scale_squares(n, 4, p, largest, square)
      !$omp simd private(over)
      do i = 1, n
         over = largest(i)*sqrt(square(i, 1) + square(i, 2) + square(i, 3) + square(i, 4))
         do k = 1, 4
            p(i, k) = p(i, k)/over
         end do
      end do
      do i = 1, n
         if (rate(i) > 0) rotation(:, who(i)) = p(i, :)
      end do
   end subroutine

   !> Squares of the components of vectors over the largest of each, every bit of them the same in units 2^k times as large.
   pure subroutine scale_squares(n, components, x, largest, square)
      integer, intent(in) :: n, components
      real(c_double), intent(in) :: x(some, components) !< any unit
      real(c_double), intent(out) :: largest(some) !< of their sizes; of a vector without a length 1, its squares are 0
      real(c_double), intent(out) :: square(some, components) !< [-]
      integer :: i, k
      largest(1:n) = abs(x(1:n, 1))
      do k = 2, components
         largest(1:n) = max(largest(1:n), abs(x(1:n, k)))
      end do
      largest(1:n) = merge(largest(1:n), 1.0_c_double, largest(1:n) > 0)
      do k = 1, components
         !$omp simd
         do i = 1, n
            square(i, k) = (x(i, k)/largest(i))**2
         end do
      end do
   end subroutine

   pure subroutine rotate_with_momentum(time, inertia, momentum, rotation, solved)
      real(c_double), intent(in) :: time, inertia(3), momentum(3)
      real(c_double), intent(inout) :: rotation(4)
      logical, intent(out) :: solved
      real(c_double) :: spin(3), mean(3), r(3, 3), q(4), angle, dt
      integer :: substeps, k

      q = rotation
      angle = abs(time)*length(momentum)/minval(inertia)
      solved = ieee_is_finite(angle)
      if (.not. solved) return
      substeps = int(min(real(most_substeps, c_double), max(1.0_c_double, 2*angle)))
      dt = time/substeps
      do k = 1, substeps
         r = matrix_of(q)
         spin = matmul(momentum, r)/inertia
         call solve_midpoint(dt, inertia, spin, mean, solved)
         if (.not. solved) return
         call turn(q, dt/2*mean)
      end do
      rotation = q
   end subroutine

   !> Mean spin S of J (S - W) + dt/2 S x J S = 0 in the axes of the body, by Newton's method.
   pure subroutine solve_midpoint(dt, inertia, spin, mean, solved)
      real(c_double), intent(in) :: dt, inertia(3), spin(3)
      real(c_double), intent(out) :: mean(3)
      logical, intent(out) :: solved
      real(c_double) :: js(3), residual(3), jacobian(3, 3), step(3), size
      integer :: k

      mean = spin
      size = length(spin)
      solved = .true.
      do k = 1, 30
         js = inertia*mean
         residual = inertia*(mean - spin) + dt/2*cross(mean, js)
         jacobian(:, 1) = dt/2*[0.0_c_double, mean(3)*(inertia(1) - inertia(3)), mean(2)*(inertia(2) - inertia(1))]
         jacobian(:, 2) = dt/2*[mean(3)*(inertia(3) - inertia(2)), 0.0_c_double, mean(1)*(inertia(2) - inertia(1))]
         jacobian(:, 3) = dt/2*[mean(2)*(inertia(3) - inertia(2)), mean(1)*(inertia(1) - inertia(3)), 0.0_c_double]
         jacobian(1, 1) = jacobian(1, 1) + inertia(1)
         jacobian(2, 2) = jacobian(2, 2) + inertia(2)
         jacobian(3, 3) = jacobian(3, 3) + inertia(3)
         step = solve3(jacobian, residual)
         mean = mean - step
         if (length(step) <= 4*epsilon(size)*size) return
      end do
      solved = length(step) <= sqrt(epsilon(size))*size
   end subroutine

   pure function solve3(a, b) result(x)
      real(c_double), intent(in) :: a(3, 3), b(3)
      real(c_double) :: x(3), determinant
      determinant = dot_product(a(:, 1), cross(a(:, 2), a(:, 3)))
      x = [dot_product(b, cross(a(:, 2), a(:, 3))), dot_product(a(:, 1), cross(b, a(:, 3))), &
           dot_product(a(:, 1), cross(a(:, 2), b))]/determinant
   end function

   !> Inverse on the free axes, zero elsewhere; at most two axes are free.
   pure function constrained_inverse(a, free) result(m)
      real(c_double), intent(in) :: a(3, 3)
      logical, intent(in) :: free(3)
      real(c_double) :: m(3, 3), determinant
      integer :: i, j
      m = 0
      do i = 1, 3
         if (free(i) .and. count(free) == 1) m(i, i) = 1/a(i, i)
         do j = i + 1, 3
            if (.not. (free(i) .and. free(j))) cycle
            determinant = a(i, i)*a(j, j) - a(i, j)**2
            m(i, i) = a(j, j)/determinant
            m(j, j) = a(i, i)/determinant
            m(i, j) = -a(i, j)/determinant
            m(j, i) = m(i, j)
         end do
      end do
   end function

   pure function matrix_of(q) result(r)
      real(c_double), intent(in) :: q(4)
      real(c_double) :: r(3, 3)
      r(:, 1) = [1 - 2*(q(3)**2 + q(4)**2), 2*(q(2)*q(3) + q(1)*q(4)), 2*(q(2)*q(4) - q(1)*q(3))]
      r(:, 2) = [2*(q(2)*q(3) - q(1)*q(4)), 1 - 2*(q(2)**2 + q(4)**2), 2*(q(3)*q(4) + q(1)*q(2))]
      r(:, 3) = [2*(q(2)*q(4) + q(1)*q(3)), 2*(q(3)*q(4) - q(1)*q(2)), 1 - 2*(q(2)**2 + q(3)**2)]
   end function

   pure function times(a, x) result(y)
      real(c_double), intent(in) :: a(6), x(3)
      real(c_double) :: y(3)
      y = [a(1)*x(1) + a(4)*x(2) + a(5)*x(3), a(4)*x(1) + a(2)*x(2) + a(6)*x(3), a(5)*x(1) + a(6)*x(2) + a(3)*x(3)]
   end function

   !> Length of a vector, every bit of it the same in units 2^k times as large; norm2 of some compilers takes 1 for a scale.
   pure real(c_double) function length(x)
      real(c_double), intent(in) :: x(:) !< any unit
      length = maxval(abs(x))
      if (length > 0) length = length*sqrt(sum((x/length)**2))
   end function

   pure function cross(a, b) result(c)
      real(c_double), intent(in) :: a(3), b(3)
      real(c_double) :: c(3)
      c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
   end function

end module
