!> Velocity Verlet (Swope et al. 1982), the explicit, time-centred scheme of smooth contacts: half a kick and the way of a
!> step, then, after the forces, the other half. Viscous damping is trapezoidal.
module velocity_verlet
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double, c_int8_t
  use linear_scheme, only: cairn_scheme, alpha_scheme
  implicit none
  private
  public :: cairn_integrator_velocity_verlet, cairn_verlet_begin, cairn_verlet_turn, cairn_verlet_end, cairn_verlet_kinetic, &
    cairn_verlet_speed, cairn_inverse_masses
contains

  !> Newmark's method with beta = 0, gamma = 1/2.
  pure subroutine cairn_integrator_velocity_verlet(h, params, scheme) bind(c)
    real(c_double), value           :: h         !< step [s]
    real(c_double), intent(in)      :: params(*) !< none, not read
    type(cairn_scheme), intent(out) :: scheme    !< a step
    scheme = alpha_scheme(h, 0.0_c_double, 0.5_c_double, 0.0_c_double, 0.0_c_double)
  end subroutine cairn_integrator_velocity_verlet

  !> v = v + h/2 a, x = x + h v; driven dofs take the mean of their old and their new velocity.
  pure subroutine cairn_verlet_begin(dim, nd, first, last, h, gravity, inverse_mass, contact_force, velocity, position, fastest, &
                                     angle, force, damping, driven, driven_velocity, reaction) bind(c)
    integer(c_int32_t), value      :: dim                     !< 2 or 3
    integer(c_int32_t), value      :: nd                      !< dofs of a body
    integer(c_int64_t), value      :: first, last             !< bodies first to last - 1
    real(c_double), value          :: h                       !< step [s]
    real(c_double), intent(in)     :: gravity(dim)            !< [m/s2]
    real(c_double), intent(in)     :: inverse_mass(nd, 0:*)   !< inverse of mass and inertia; 0: fixed [1/kg, 1/(kg m2)]
    real(c_double), intent(in)     :: contact_force(nd, 0:*)  !< of the last configuration [N, N m]
    real(c_double), intent(inout)  :: velocity(nd, 0:*)       !< at the start of the step; on return at its middle [m/s, rad/s]
    real(c_double), intent(inout)  :: position(dim, 0:*)      !< [m]
    real(c_double), intent(out)    :: fastest(2)              !< squares of the greatest velocity and spin
    real(c_double), intent(inout), optional :: angle(0:*)     !< in 2D [rad]
    real(c_double), intent(in), optional :: force(nd, 0:*)    !< mean over the step [N, N m]
    real(c_double), intent(in), optional :: damping(0:*)      !< per unit of mass [1/s]
    integer(c_int8_t), intent(in), optional :: driven(0:*)    !< bit j: dof j is driven
    real(c_double), intent(in), optional :: driven_velocity(nd, 0:*) !< at the end of the step [m/s, rad/s]
    real(c_double), intent(inout), optional :: reaction(nd, 0:*) !< impulse of the drive in the first half [N s, N m s]
    real(c_double) :: half, push(nd), begin(nd), linear, spin
    integer(c_int64_t) :: i
    integer :: j
    half = 0.5_c_double*h
    linear = 0
    spin = 0
    do i = first, last - 1
      push = contact_force(:, i)
      if (present(force)) push = push + force(:, i)
      begin = velocity(:, i)
      velocity(:, i) = begin + half*(inverse_mass(:, i)*push)
      if (inverse_mass(1, i) > 0) velocity(1:dim, i) = velocity(1:dim, i) + half*gravity
      if (present(damping)) then
        where (inverse_mass(:, i) > 0) velocity(:, i) = velocity(:, i) - half*damping(i)*begin
      end if
      if (present(driven)) then
        if (driven(i) /= 0) then
          do j = 1, nd
            if (.not. btest(driven(i), j - 1)) cycle
            reaction(j, i) = drive_impulse(inverse_mass(j, i), velocity(j, i), 0.5_c_double*(begin(j) + driven_velocity(j, i)), &
                                           half*push(j))
            velocity(j, i) = 0.5_c_double*(begin(j) + driven_velocity(j, i))
          end do
        end if
      end if
      position(:, i) = position(:, i) + h*velocity(1:dim, i)
      linear = max(linear, sum(velocity(1:dim, i)**2))
      spin = max(spin, sum(velocity(dim + 1:nd, i)**2))
    end do
    if (present(angle)) then
      do i = first, last - 1
        angle(i) = angle(i) + h*velocity(3, i)
      end do
    end if
    fastest = [linear, spin]
  end subroutine cairn_verlet_begin

  !> Orientation after a step at constant spin, q = exp(h spin/2) q: by its series, exact to rounding, as long as the spin is below
  !> half a radian a step; beyond, by sine and cosine.
  pure subroutine cairn_verlet_turn(first, last, h, velocity, rotation) bind(c)
    integer(c_int64_t), value     :: first, last      !< bodies first to last - 1
    real(c_double), value         :: h                !< step [s]
    real(c_double), intent(in)    :: velocity(6, 0:*) !< spin in 4:6 [rad/s]
    real(c_double), intent(inout) :: rotation(4, 0:*) !< unit quaternion, body to space
    integer, parameter :: few = 64
    real(c_double) :: half(few, 3), square(few), most
    integer(c_int64_t) :: i, j
    integer :: k, n
    do j = first, last - 1, few
      n = int(min(few + 0_c_int64_t, last - j))
      do k = 1, n
        i = j + k - 1
        half(k, 1) = 0.5_c_double*h*velocity(4, i)
        half(k, 2) = 0.5_c_double*h*velocity(5, i)
        half(k, 3) = 0.5_c_double*h*velocity(6, i)
      end do
      most = 0
      !$omp simd reduction(max:most)
      do k = 1, n
        square(k) = half(k, 1)*half(k, 1) + half(k, 2)*half(k, 2) + half(k, 3)*half(k, 3)
        most = max(most, square(k))
      end do
      call turn_some(n, half, square, most > 0.0625_c_double, rotation(:, j:j + n - 1))
    end do
  end subroutine cairn_verlet_turn

  !> Rotations times exp(half), with half of the spin times the step.
  pure subroutine turn_some(n, half, square, any_far, rotation)
    integer, intent(in)           :: n
    real(c_double), intent(in)    :: half(64, 3)   !< [-]
    real(c_double), intent(in)    :: square(64)    !< of its length [-]
    logical, intent(in)           :: any_far       !< some spin needs sine and cosine
    real(c_double), intent(inout) :: rotation(4, n)
    real(c_double) :: x, y, z, a, c, s, p(4), size, sine(64), cosine(64)
    integer :: k
    !$omp simd private(a)
    do k = 1, n
      a = square(k)
      sine(k) = 1 - a/6*(1 - a/20*(1 - a/42*(1 - a/72*(1 - a/110))))
      cosine(k) = 1 - a/2*(1 - a/12*(1 - a/30*(1 - a/56*(1 - a/90*(1 - a/132)))))
    end do
    if (any_far) then
      do k = 1, n
        if (.not. square(k) > 0.0625_c_double) cycle
        sine(k) = sin(sqrt(square(k)))/sqrt(square(k))
        cosine(k) = cos(sqrt(square(k)))
      end do
    end if
    !$omp simd private(x, y, z, c, s, p, size)
    do k = 1, n
      s = sine(k)
      c = cosine(k)
      x = s*half(k, 1); y = s*half(k, 2); z = s*half(k, 3)
      p(1) = c*rotation(1, k) - x*rotation(2, k) - y*rotation(3, k) - z*rotation(4, k)
      p(2) = c*rotation(2, k) + x*rotation(1, k) + y*rotation(4, k) - z*rotation(3, k)
      p(3) = c*rotation(3, k) + y*rotation(1, k) + z*rotation(2, k) - x*rotation(4, k)
      p(4) = c*rotation(4, k) + z*rotation(1, k) + x*rotation(3, k) - y*rotation(2, k)
      size = 1/sqrt(p(1)*p(1) + p(2)*p(2) + p(3)*p(3) + p(4)*p(4))
      rotation(1, k) = size*p(1)
      rotation(2, k) = size*p(2)
      rotation(3, k) = size*p(3)
      rotation(4, k) = size*p(4)
    end do
  end subroutine turn_some

  !> v = v + h/2 a with the forces of the new configuration; terms of the energy if they are asked for.
  subroutine cairn_verlet_end(dim, nd, first, last, h, gravity, inverse_mass, contact_force, velocity, wrong, &
                              force, damping, driven, driven_velocity, reaction, terms) bind(c)
    integer(c_int32_t), value      :: dim                     !< 2 or 3
    integer(c_int32_t), value      :: nd                      !< dofs of a body
    integer(c_int64_t), value      :: first, last             !< bodies first to last - 1
    real(c_double), value          :: h                       !< step [s]
    real(c_double), intent(in)     :: gravity(dim)            !< [m/s2]
    real(c_double), intent(in)     :: inverse_mass(nd, 0:*)   !< inverse of mass and inertia; 0: fixed [1/kg, 1/(kg m2)]
    real(c_double), intent(in)     :: contact_force(nd, 0:*)  !< of the new configuration [N, N m]
    real(c_double), intent(inout)  :: velocity(nd, 0:*)       !< at the middle; out, at the end of the step [m/s, rad/s]
    integer(c_int64_t), intent(inout) :: wrong                !< a body whose velocity is no finite number, if there is one
    real(c_double), intent(in), optional :: force(nd, 0:*)    !< mean over the step [N, N m]
    real(c_double), intent(in), optional :: damping(0:*)      !< per unit of mass [1/s]
    integer(c_int8_t), intent(in), optional :: driven(0:*)    !< bit j: dof j is driven
    real(c_double), intent(in), optional :: driven_velocity(nd, 0:*) !< at the end of the step [m/s, rad/s]
    real(c_double), intent(inout), optional :: reaction(nd, 0:*) !< out, impulse of the drive in the whole step [N s, N m s]
    real(c_double), intent(inout), optional :: terms(5)       !< T, dU, W_external, W_driven, D_bulk are added [J]
    real(c_double) :: half, push(nd), middle(nd), part(5), mass, weight(nd)
    integer(c_int64_t) :: i
    integer :: j
    half = 0.5_c_double*h
    part = 0
    do i = first, last - 1
      push = contact_force(:, i)
      if (present(force)) push = push + force(:, i)
      middle = velocity(:, i)
      weight = 0
      if (inverse_mass(1, i) > 0) weight(1:dim) = gravity
      velocity(:, i) = middle + half*(inverse_mass(:, i)*push + weight)
      if (present(damping)) then
        where (inverse_mass(:, i) > 0) velocity(:, i) = velocity(:, i)/(1 + half*damping(i))
      end if
      if (present(driven)) then
        if (driven(i) /= 0) then
          do j = 1, nd
            if (.not. btest(driven(i), j - 1)) cycle
            reaction(j, i) = reaction(j, i) + drive_impulse(inverse_mass(j, i), velocity(j, i), driven_velocity(j, i), half*push(j))
            velocity(j, i) = driven_velocity(j, i)
            if (present(terms)) part(4) = part(4) + reaction(j, i)*middle(j)
          end do
        end if
      end if
      if (.not. sum(velocity(:, i)**2) <= huge(half)) wrong = i
      if (.not. present(terms)) cycle
      do j = 1, nd
        if (.not. inverse_mass(j, i) > 0) cycle
        mass = 1/inverse_mass(j, i)
        part(1) = part(1) + 0.5_c_double*mass*velocity(j, i)**2
        part(2) = part(2) - mass*weight(j)*h*middle(j)
        if (present(force)) part(3) = part(3) + force(j, i)*h*middle(j)
        if (present(damping)) part(5) = part(5) + mass*damping(i)*h*middle(j)**2
      end do
    end do
    if (present(terms)) terms = terms + part
  end subroutine cairn_verlet_end

  !> A bound on the speeds of bodies: the length of the vector of the greatest components [m/s].
  pure function cairn_verlet_speed(dim, nd, first, last, velocity) result(speed) bind(c)
    integer(c_int32_t), value  :: dim                  !< 2 or 3
    integer(c_int32_t), value  :: nd                   !< dofs of a body, 3 or 6
    integer(c_int64_t), value  :: first, last          !< bodies first to last - 1
    real(c_double), intent(in) :: velocity(0:nd*last - 1) !< [m/s, rad/s]
    real(c_double) :: speed
    integer, parameter :: line = 24 !< numbers of whole bodies in the plane and in space
    real(c_double) :: most(0:line - 1), squares
    integer(c_int64_t) :: i
    integer :: k
    most = 0
    do i = nd*first, nd*last - line, line
      !$omp simd simdlen(8)
      do k = 0, line - 1
        most(k) = max(most(k), abs(velocity(i + k)))
      end do
    end do
    do k = 0, int(mod(nd*(last - first), int(line, c_int64_t))) - 1
      i = nd*last - mod(nd*(last - first), int(line, c_int64_t)) + k
      most(k) = max(most(k), abs(velocity(i)))
    end do
    squares = 0
    do k = 0, dim - 1
      squares = squares + maxval(most(k::nd))**2
    end do
    speed = sqrt(squares)
  end function cairn_verlet_speed

  !> Kinetic energy of movable dofs, as in the balance of cairn_verlet_end.
  pure function cairn_verlet_kinetic(nd, first, last, inverse_mass, velocity) result(energy) bind(c)
    integer(c_int32_t), value  :: nd                    !< dofs of a body
    integer(c_int64_t), value  :: first, last           !< bodies first to last - 1
    real(c_double), intent(in) :: inverse_mass(nd, 0:*) !< inverse of mass and inertia; 0: fixed [1/kg, 1/(kg m2)]
    real(c_double), intent(in) :: velocity(nd, 0:*)     !< [m/s, rad/s]
    real(c_double) :: energy                            !< [J]
    integer(c_int64_t) :: i
    integer :: j
    energy = 0
    do i = first, last - 1
      do j = 1, nd
        if (inverse_mass(j, i) > 0) energy = energy + 0.5_c_double/inverse_mass(j, i)*velocity(j, i)**2
      end do
    end do
  end function cairn_verlet_kinetic

  !> Impulse of a drive that gives a dof the wanted velocity: from its free velocity, or the reaction to its forces if its mass is
  !> infinite.
  pure function drive_impulse(inverse_mass, free, wanted, pushed) result(impulse)
    real(c_double), intent(in) :: inverse_mass, free, wanted, pushed
    real(c_double) :: impulse
    impulse = -pushed
    if (inverse_mass > 0) impulse = (wanted - free)/inverse_mass
  end function drive_impulse

  !> Inverse of mass and principal moment of every dof.
  pure subroutine cairn_inverse_masses(dim, nd, nb, mass, inertia, inverse_mass) bind(c)
    integer(c_int32_t), value   :: dim                       !< 2 or 3
    integer(c_int32_t), value   :: nd                        !< dofs of a body
    integer(c_int64_t), value   :: nb                        !< bodies
    real(c_double), intent(in)  :: mass(0:nb - 1)            !< inf: moved by nothing [kg]
    real(c_double), intent(in)  :: inertia(2*dim - 3, 0:nb - 1) !< [kg m2]
    real(c_double), intent(out) :: inverse_mass(nd, 0:nb - 1) !< [1/kg, 1/(kg m2)]
    integer(c_int64_t) :: i
    do i = 0, nb - 1
      inverse_mass(1:dim, i) = 1/mass(i)
      inverse_mass(dim + 1:nd, i) = 1/inertia(:, i)
    end do
  end subroutine cairn_inverse_masses
end module velocity_verlet
