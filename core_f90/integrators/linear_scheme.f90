!> Common form of one-step integrators: a step as a linear map, filled in by the kernel of each. With q, v at the start, a history
!> a_2, a_3, ... of time derivatives of the displacement from the second on, and p the impulses of contacts,
!>   M (v1 - v - sum velocity_k a_k) = impulse (F - C v_f - K q_f) - damping C (v1 - v) - stiffness K (v1 - v) + H p,
!>   q_f = q + elastic_velocity v + sum elastic_k a_k,   v_f = v + sum damping_history_k a_k,
!>   F = end_share F1 + (1 - end_share) F0,
!>   q1 = q + h (1 - share) v + sum position_k a_k + h share v1 + position_1/h M^-1 H p.
!> An impulse of contacts is a jump of velocity and no part of the history, so that accelerations do not ring at a rate of 1/h
!> (Chen, Acary, Virlez & Bruls 2013). The last term of q1 is theirs; it gives a jump half of the step: a body at rest has M^-1 H p
!> = -h a_2 and keeps its position to rounding, and the drift accumulated where loads change is bounded.
!> With s = v1 - v - sum velocity_k a_k - M^-1 H p,
!>   a_j at the end = sum update(j, k) a_k + gain_j s.
module linear_scheme
  use, intrinsic :: iso_c_binding, only: c_int8_t, c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_scheme, cairn_history_velocity, cairn_smooth_change, cairn_history_way, cairn_history_update, &
            cairn_history_start
  public :: no_history, alpha_scheme

  integer, parameter, public :: most_history = 4

  !> Its C twin stands in cairn/core.h.
  type, bind(c) :: cairn_scheme
    real(c_double) :: h                              !< step [s]
    real(c_double) :: impulse                        !< of a force of 1 N [s]
    real(c_double) :: end_share                      !< of forces at the end of the step in F
    real(c_double) :: implicit                       !< share of the velocity at the end in drag: damping/impulse
    real(c_double) :: damping                        !< factor of C in A = M + damping C + stiffness K [s]
    real(c_double) :: stiffness                      !< factor of K [s2]
    real(c_double) :: share                          !< of the velocity at the end in the displacement
    real(c_double) :: elastic_velocity               !< [s]
    real(c_double) :: position(most_history)         !< [s2, s3, ...]
    real(c_double) :: velocity(most_history)         !< [s, s2, ...]
    real(c_double) :: elastic(most_history)          !< [s2, s3, ...]
    real(c_double) :: damping_history(most_history)  !< [s, s2, ...]
    real(c_double) :: update(most_history, most_history) !< [1/s**(j - k)]
    real(c_double) :: gain(most_history)             !< [1/s, 1/s2, ...]
    real(c_double) :: largest                        !< step times frequency beyond which free motion grows; inf: none [-]
    integer(c_int32_t) :: histories                  !< derivatives that it keeps, 0 to 4
    integer(c_int32_t) :: by_energy                  !< 1: stresses work over the step what the stored energy changes by
  end type cairn_scheme

contains

  !> A scheme that keeps nothing and has no limit; the rest is zero.
  pure function no_history(h) result(s)
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_positive_inf
    real(c_double), intent(in) :: h !< step [s]
    type(cairn_scheme) :: s
    s%h = h
    s%impulse = h
    s%end_share = 0
    s%implicit = 0
    s%damping = 0
    s%stiffness = 0
    s%share = 0
    s%elastic_velocity = 0
    s%position = 0
    s%velocity = 0
    s%elastic = 0
    s%damping_history = 0
    s%update = 0
    s%gain = 0
    s%largest = ieee_value(h, ieee_positive_inf)
    s%histories = 0
    s%by_energy = 0
  end function no_history

  !> (1 - am) a1 + am a at the mean of forces (1 - af) F1 + af F0, with Newmark's beta and gamma: Newmark am = af = 0, HHT am = 0.
  pure function alpha_scheme(h, beta, gamma, am, af) result(s)
    real(c_double), intent(in) :: h      !< step [s]
    real(c_double), intent(in) :: beta   !< of the acceleration at the end in the displacement
    real(c_double), intent(in) :: gamma  !< of the acceleration at the end in the velocity
    real(c_double), intent(in) :: am, af !< weights of the start in inertia and in forces
    type(cairn_scheme) :: s
    s = no_history(h)
    s%impulse = h*gamma/(1 - am)
    s%end_share = 1 - af
    s%share = beta/gamma
    s%implicit = 1 - af
    s%damping = s%implicit*s%impulse
    s%stiffness = s%damping*(h*s%share)
    s%position(1) = h*h*(0.5_c_double - s%share)
    s%velocity(1) = h*(1 - gamma) - am*s%impulse
    s%elastic_velocity = (1 - af)*h
    s%elastic(1) = (1 - af)*s%position(1)
    s%update(1, 1) = -am/(1 - am)
    s%gain(1) = 1/(h*gamma)
    if (2*beta < gamma) s%largest = 1/sqrt(gamma/2 - beta)
    s%histories = 1
  end function alpha_scheme

  !> Adds a derivative of the history to the velocity without contacts, less its drag; driven dofs are skipped.
  pure subroutine cairn_history_velocity(nd, nb, scheme, k, derivative, inverse_mass, velocity_free, damping) bind(c)
    integer(c_int32_t), value      :: nd                             !< dofs of a body
    integer(c_int64_t), value      :: nb                             !< bodies
    type(cairn_scheme), intent(in) :: scheme                         !< of the step
    integer(c_int32_t), value      :: k                              !< which derivative, from 1
    real(c_double), intent(in)     :: derivative(nd, 0:nb - 1)       !< at the start [m/s2, ...]
    real(c_double), intent(in)     :: inverse_mass(nd, 0:nb - 1)     !< 0: driven, or moved by nothing [1/kg, 1/(kg m2)]
    real(c_double), intent(inout)  :: velocity_free(nd, 0:nb - 1)    !< [m/s, rad/s]
    real(c_double), intent(in), optional :: damping(0:nb - 1)        !< c, per unit of mass [1/s]
    real(c_double) :: factor
    integer(c_int64_t) :: i
    factor = scheme%velocity(k)
    do i = 0, nb - 1
      if (present(damping)) factor = (scheme%velocity(k) - scheme%impulse*damping(i)*scheme%damping_history(k)) &
                                     /(1 + scheme%damping*damping(i))
      where (inverse_mass(:, i) > 0) velocity_free(:, i) = velocity_free(:, i) + factor*derivative(:, i)
    end do
  end subroutine cairn_history_velocity

  !> Smooth change of velocity s of rigid bodies: by forces and drag, without contacts. Driven dofs have none and keep no history:
  !> derivatives of given velocities ring without end once these jump, and grow by 1.7 to 3 a step of Gear. A drive acts as an
  !> impulse, like contacts, and its displacement follows the mean of the velocities at both ends.
  pure subroutine cairn_smooth_change(dim, nd, nb, scheme, gravity, mass, inertia, velocity_begin, velocity, change, &
                                      a2, a3, a4, a5, force, damping, driven) bind(c)
    integer(c_int32_t), value      :: dim                            !< 2 or 3
    integer(c_int32_t), value      :: nd                             !< dofs of a body
    integer(c_int64_t), value      :: nb                             !< bodies
    type(cairn_scheme), intent(in) :: scheme                         !< of the step
    real(c_double), intent(in)     :: gravity(dim)                   !< [m/s2]
    real(c_double), intent(in)     :: mass(0:nb - 1)                 !< inf: moved by nothing [kg]
    real(c_double), intent(in)     :: inertia(2*dim - 3, 0:nb - 1)   !< principal moments [kg m2]
    real(c_double), intent(in)     :: velocity_begin(nd, 0:nb - 1)   !< [m/s, rad/s]
    real(c_double), intent(in)     :: velocity(nd, 0:nb - 1)         !< at the end [m/s, rad/s]
    real(c_double), intent(out)    :: change(nd, 0:nb - 1)           !< s [m/s, rad/s]
    real(c_double), intent(in), optional, dimension(nd, 0:nb - 1) :: a2, a3, a4, a5 !< history at the start [m/s2, ...]
    real(c_double), intent(in), optional :: force(nd, 0:nb - 1)      !< F [N, N m]
    real(c_double), intent(in), optional :: damping(0:nb - 1)        !< c, per unit of mass [1/s]
    integer(c_int8_t), intent(in), optional :: driven(0:nb - 1)      !< bit j: dof j is driven
    real(c_double) :: known(most_history), inertial, gain
    integer(c_int64_t) :: i
    integer :: j
    logical :: held
    do i = 0, nb - 1
      do j = 1, nd
        known = 0
        if (present(a2)) known(1) = a2(j, i)
        if (present(a3)) known(2) = a3(j, i)
        if (present(a4)) known(3) = a4(j, i)
        if (present(a5)) known(4) = a5(j, i)
        gain = velocity(j, i) - velocity_begin(j, i)
        held = .false.
        if (present(driven)) held = btest(driven(i), j - 1)
        inertial = mass(i)
        if (j > dim) inertial = inertia(min(j - dim, 2*dim - 3), i)
        change(j, i) = 0
        if (held) cycle
        if (.not. inertial <= huge(inertial)) cycle
        if (j <= dim) change(j, i) = scheme%impulse*gravity(j)
        if (present(force)) change(j, i) = change(j, i) + scheme%impulse*(force(j, i)/inertial)
        if (present(damping)) change(j, i) = change(j, i) - damping(i) &
          *(scheme%impulse*(velocity_begin(j, i) + dot_product(scheme%damping_history, known)) + scheme%damping*gain)
      end do
    end do
  end subroutine cairn_smooth_change

  !> Displacement of the step beyond that of the velocities at its ends: by the history, and by the impulses of contacts, found as
  !> the remainder of the change of velocity.
  pure subroutine cairn_history_way(nd, nb, scheme, velocity_begin, velocity, change, way, a2, a3, a4, a5) bind(c)
    integer(c_int32_t), value      :: nd                             !< dofs of a body
    integer(c_int64_t), value      :: nb                             !< bodies
    type(cairn_scheme), intent(in) :: scheme                         !< of the step
    real(c_double), intent(in)     :: velocity_begin(nd, 0:nb - 1)   !< [m/s, rad/s]
    real(c_double), intent(in)     :: velocity(nd, 0:nb - 1)         !< at the end [m/s, rad/s]
    real(c_double), intent(in)     :: change(nd, 0:nb - 1)           !< s [m/s, rad/s]
    real(c_double), intent(out)    :: way(nd, 0:nb - 1)              !< [m, rad]
    real(c_double), intent(in), optional, dimension(nd, 0:nb - 1) :: a2, a3, a4, a5 !< history at the start [m/s2, ...]
    real(c_double) :: known(most_history), jump
    integer(c_int64_t) :: i
    integer :: j
    known = 0
    do i = 0, nb - 1
      do j = 1, nd
        if (present(a2)) known(1) = a2(j, i)
        if (present(a3)) known(2) = a3(j, i)
        if (present(a4)) known(3) = a4(j, i)
        if (present(a5)) known(4) = a5(j, i)
        jump = velocity(j, i) - velocity_begin(j, i) - dot_product(scheme%velocity, known) - change(j, i)
        way(j, i) = dot_product(scheme%position, known) + scheme%position(1)/scheme%h*jump
      end do
    end do
  end subroutine cairn_history_way

  !> The history at the end of the step. Spins of bodies that store angular momentum have none: the midpoint rule moves them.
  pure subroutine cairn_history_update(dim, nd, nb, scheme, change, inertia, a2, a3, a4, a5) bind(c)
    integer(c_int32_t), value      :: dim                            !< 2 or 3
    integer(c_int32_t), value      :: nd                             !< dofs of a body
    integer(c_int64_t), value      :: nb                             !< bodies
    type(cairn_scheme), intent(in) :: scheme                         !< of the step
    real(c_double), intent(in)     :: change(nd, 0:nb - 1)           !< s [m/s, rad/s]
    real(c_double), intent(in)     :: inertia(2*dim - 3, 0:nb - 1)   !< principal moments; not read of points, nd = dim [kg m2]
    real(c_double), intent(inout), optional, dimension(nd, 0:nb - 1) :: a2, a3, a4, a5 !< [m/s2, ...]
    real(c_double) :: known(most_history), next(most_history)
    integer(c_int64_t) :: i
    integer :: j, last
    do i = 0, nb - 1
      last = nd
      if (nd > dim) then
        if (minval(inertia(:, i)) < maxval(inertia(:, i))) last = dim
      end if
      do j = 1, nd
        known = 0
        if (present(a2)) known(1) = a2(j, i)
        if (present(a3)) known(2) = a3(j, i)
        if (present(a4)) known(3) = a4(j, i)
        if (present(a5)) known(4) = a5(j, i)
        next = matmul(scheme%update, known) + scheme%gain*change(j, i)
        if (j > last) next = 0
        if (present(a2)) a2(j, i) = next(1)
        if (present(a3)) a3(j, i) = next(2)
        if (present(a4)) a4(j, i) = next(3)
        if (present(a5)) a5(j, i) = next(4)
      end do
    end do
  end subroutine cairn_history_update

  !> History of rigid bodies that have none yet, under the forces at hand: a_2 = g + F/m - c v, then a_k = -c a_(k - 1).
  pure subroutine cairn_history_start(dim, nd, nb, known, gravity, mass, inertia, velocity, a2, a3, a4, a5, &
                                      force, damping, driven) bind(c)
    integer(c_int32_t), value      :: dim                            !< 2 or 3
    integer(c_int32_t), value      :: nd                             !< dofs of a body
    integer(c_int64_t), value      :: nb                             !< bodies
    integer(c_int8_t), intent(in)  :: known(0:nb - 1)                !< 1: it has a history, which is left alone
    real(c_double), intent(in)     :: gravity(dim)                   !< [m/s2]
    real(c_double), intent(in)     :: mass(0:nb - 1)                 !< inf: moved by nothing [kg]
    real(c_double), intent(in)     :: inertia(2*dim - 3, 0:nb - 1)   !< principal moments [kg m2]
    real(c_double), intent(in)     :: velocity(nd, 0:nb - 1)         !< [m/s, rad/s]
    real(c_double), intent(inout), optional, dimension(nd, 0:nb - 1) :: a2, a3, a4, a5 !< [m/s2, ...]
    real(c_double), intent(in), optional :: force(nd, 0:nb - 1)      !< [N, N m]
    real(c_double), intent(in), optional :: damping(0:nb - 1)        !< c, per unit of mass [1/s]
    integer(c_int8_t), intent(in), optional :: driven(0:nb - 1)      !< bit j: dof j is driven
    real(c_double) :: a, c, inertial
    integer(c_int64_t) :: i
    integer :: j
    do i = 0, nb - 1
      if (known(i) /= 0) cycle
      c = 0
      if (present(damping)) c = damping(i)
      do j = 1, nd
        inertial = mass(i)
        if (j > dim) inertial = inertia(min(j - dim, 2*dim - 3), i)
        a = -c*velocity(j, i)
        if (j <= dim) a = a + gravity(j)
        if (present(force)) a = a + force(j, i)/inertial
        if (.not. inertial <= huge(inertial)) a = 0
        if (present(driven)) then
          if (btest(driven(i), j - 1)) a = 0
        end if
        if (j > dim .and. minval(inertia(:, i)) < maxval(inertia(:, i))) a = 0
        if (present(a2)) a2(j, i) = a
        if (present(a3)) a3(j, i) = -c*a
        if (present(a4)) a4(j, i) = c*c*a
        if (present(a5)) a5(j, i) = -c*c*c*a
      end do
    end do
  end subroutine cairn_history_start
end module linear_scheme
