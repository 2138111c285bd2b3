!> Joints: two frames fixed in their bodies, some components of whose relative velocity vanish. Drift of the blocked components is
!> corrected within the step. Another component, the coordinate of the joint, may have limits, and a motor of bounded force:
!>   u + error/h = 0 of blocked components,   lowest <= along + h u <= highest,   |r| <= h effort until u = speed,
!> beside a spring with a dashpot, whose force is that at the theta-mean of the step, so that theta 1/2 preserves its energy.
!> Across a bar under more tension than the step can resolve as a string, r + drag (u - u_begin) = 0 beside these.
!> It breaks at the end of a step whose force reaches its strength.
!> Components: 2D n, t, rotation; 3D n, t, s, rotations about them. n is the axis of the joint.
module joint
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  implicit none
  private
  public :: cairn_law_joint_prepare, cairn_law_joint_solve, cairn_law_joint_commit, cairn_law_joint_residual
  public :: cairn_law_joint_energy
  integer, parameter :: own = 16 !< parameters, see prepare; axis, span and pulley are read by the measurement of frames alone
  integer, parameter :: p_blocked = 1, p_free = 2, p_lowest = 6, p_highest = 7, p_speed = 8, p_effort = 9, p_strength = 10
  integer, parameter :: p_spans = 11, p_stiffness = 12, p_damping = 13, p_rest = 14
  integer, parameter :: s_held = 1, s_error = 2, s_along = 8, s_drag = 9, s_pull = 10, s_begin = 11, s_driven = 12
  integer, parameter :: s_across = s_driven !< transverse drag of a bar or rope, in the place of a motor
  integer, parameter :: states = 12
contains

  subroutine cairn_law_joint_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components: 3 in 2D, 6 in 3D
    type(cairn_law_context), intent(in) :: context          !< step
    real(c_double), intent(in)          :: gap(n)           !< not asked for [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< blocked components as bits, coordinate or 0, axis, limits [m, rad],
    !< speed [m/s, rad/s], effort [N, N m], strength [N], 1 if n is the line between the points, stiffness [N/m, N m/rad],
    !< damping [N s/m, N m s/rad] and rest [m, rad] of the spring
    real(c_double), intent(inout)       :: state(n, states) !< above 0: whole; errors of n, t, s [m], about them [rad];
    !< coordinate; spring's impulse -(drag u + pull) [kg, N s]; velocity at the start of the step; work of the motor in it [J],
    !< or of a bar its drag across [kg]
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< none [-]
    real(c_double) :: begin, end_share
    integer :: i, k, f
    bias = 0
    compliance = 0
    mu = 0
    end_share = context%theta
    do i = 1, n
      state(i, s_drag:s_begin) = 0
      f = nint(params(i, p_free))
      if (f < 1 .or. .not. state(i, s_held) > 0) cycle
      begin = u_begin(i, f)
      state(i, s_begin) = begin
      if (.not. (params(i, p_stiffness) > 0 .or. params(i, p_damping) > 0)) cycle
      ! the coordinate stands where the step measures it, (1 - theta) h after its begin
      state(i, s_drag) = context%h*end_share*(params(i, p_stiffness)*end_share*context%h + params(i, p_damping))
      state(i, s_pull) = context%h*(params(i, p_stiffness)*(state(i, s_along) - params(i, p_rest) - &
                                                            (1 - end_share)**2*context%h*begin) + &
                                    params(i, p_damping)*(1 - end_share)*begin)
    end do
    do k = 1, c
      do i = 1, n
        if (state(i, s_held) > 0 .and. blocks(params(i, p_blocked), k)) bias(i, k) = state(i, place(c, k))/context%h
        if (drag_across(c, k, params(i, p_spans), state(i, s_held), state(i, s_across)) > 0) bias(i, k) = -u_begin(i, k)
      end do
    end do
  end subroutine cairn_law_joint_prepare

  !> Condenses the impulses of blocked components (Schur complement), which leaves a single equation along the coordinate.
  subroutine cairn_law_joint_solve(n, c, w, u_free, bias, params, state, r, status) bind(c)
    integer(c_int32_t), value     :: n                  !< contacts
    integer(c_int32_t), value     :: c                  !< components
    real(c_double), intent(in)    :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)    :: u_free(n, c)       !< relative velocity with r = 0 here, bias included [m/s]
    real(c_double), intent(in)    :: bias(n, c)         !< in u_free [m/s]
    real(c_double), intent(in)    :: params(n, own + 4) !< see prepare; step, geometry
    real(c_double), intent(in)    :: state(n, states)   !< see prepare
    real(c_double), intent(inout) :: r(n, c)            !< impulse [N s], then moment [N m s]
    integer(c_int32_t), intent(out), optional :: status(n) !< see cairn_contact_status
    real(c_double) :: block(c, c), of_free(c), of_unit(c), pivots(c, c), q, s, across
    integer :: i, k, f, mask, held, blocked(c)
    do i = 1, n
      r(i, :) = 0
      if (present(status)) status(i) = merge(3, 0, state(i, s_held) > 0)
      if (.not. state(i, s_held) > 0) cycle
      block = w(i, :, :)
      mask = nint(params(i, p_blocked))
      do k = 2, min(c, 3)
        across = drag_across(c, k, params(i, p_spans), state(i, s_held), state(i, s_across))
        if (.not. across > 0) cycle
        block(k, k) = block(k, k) + 1/across
        mask = ibset(mask, k - 1)
      end do
      call eliminate(c, mask, block, held, blocked, pivots)
      call hold(c, held, blocked, pivots, -u_free(i, :), of_free)
      f = nint(params(i, p_free))
      if (f > 0) then
        if (acts(params(i, :), state(i, :))) then
          call hold(c, held, blocked, pivots, -w(i, :, f), of_unit)
          q = u_free(i, f) + dot_product(w(i, f, :), of_free)
          s = w(i, f, f) + dot_product(w(i, f, :), of_unit)
          if (s > 16*epsilon(s)*w(i, f, f)) then
            s = along_coordinate(q, s, params(i, :), params(i, own + 1), state(i, :))
            of_free = of_free + s*of_unit
            of_free(f) = s
          end if
        end if
      end if
      r(i, :) = of_free
    end do
  end subroutine cairn_law_joint_solve

  !> False if the coordinate is free: without a motor, limits and a spring its impulse is none. Numbers that are none act.
  pure logical function acts(p, state)
    real(c_double), intent(in) :: p(own)        !< parameters
    real(c_double), intent(in) :: state(states) !< see prepare
    acts = p(p_effort) > 0 .or. p(p_highest) < huge(p) .or. p(p_lowest) > -huge(p) .or. &
           .not. (abs(state(s_drag)) <= 0 .and. abs(state(s_pull)) <= 0)
  end function acts

  !> Impulse along the coordinate: of the motor, the limits and the spring.
  pure real(c_double) function along_coordinate(q, s, p, h, state) result(r)
    real(c_double), intent(in) :: q        !< velocity without it [m/s]
    real(c_double), intent(in) :: s        !< velocity per unit of it [1/kg]
    real(c_double), intent(in) :: p(*)     !< parameters
    real(c_double), intent(in) :: h        !< step [s]
    real(c_double), intent(in) :: state(*) !< see prepare
    real(c_double) :: u, x, free, unit
    x = state(s_along)
    unit = s/(1 + s*state(s_drag)) ! beside the spring
    free = (q - s*state(s_pull))/(1 + s*state(s_drag))
    r = 0
    if (p(p_effort) > 0) r = min(max((p(p_speed) - free)/unit, -h*p(p_effort)), h*p(p_effort))
    u = free + unit*r
    if (x + h*u > p(p_highest)) r = ((p(p_highest) - x)/h - free)/unit
    u = free + unit*r
    if (x + h*u < p(p_lowest)) r = ((p(p_lowest) - x)/h - free)/unit
    u = free + unit*r
    if (s*state(s_drag) > 1) then ! the difference of a stiff spring's two parts would lose the digits that this one has
      r = (u - q)/s
    else
      r = r - (state(s_drag)*u + state(s_pull))
    end if
  end function along_coordinate

  !> Residual F: of each blocked component by its own diagonal entry of W; of the coordinate by its own equation.
  subroutine cairn_law_joint_residual(n, c, context, rho, w, u, bias, r, params, state, f, weight, status) bind(c)
    integer(c_int32_t), value           :: n                  !< contacts
    integer(c_int32_t), value           :: c                  !< components
    type(cairn_law_context), intent(in) :: context            !< step
    real(c_double), intent(in)          :: rho(n)             !< 1/W_NN [kg]
    real(c_double), intent(in)          :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)          :: u(n, c)            !< relative velocity, bias included [m/s]
    real(c_double), intent(in)          :: bias(n, c)         !< in u [m/s]
    real(c_double), intent(in)          :: r(n, c)            !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own + 4) !< see prepare; step, geometry
    real(c_double), intent(in)          :: state(n, states)   !< see prepare
    real(c_double), intent(out)         :: f(n, c)            !< [N s]
    real(c_double), intent(out)         :: weight(n, c)       !< [1/kg]
    integer(c_int32_t), intent(out)     :: status(n)          !< see cairn_contact_status
    real(c_double) :: across
    integer :: i, k
    do i = 1, n
      status(i) = merge(3, 0, state(i, s_held) > 0)
      do k = 1, c
        weight(i, k) = w(i, k, k)
        f(i, k) = r(i, k)
        if (.not. state(i, s_held) > 0 .or. .not. w(i, k, k) > 0) cycle
        across = drag_across(c, k, params(i, p_spans), state(i, s_held), state(i, s_across))
        if (across > 0) f(i, k) = (r(i, k) + across*u(i, k))/(1 + across*w(i, k, k))
        if (blocks(params(i, p_blocked), k)) then
          f(i, k) = u(i, k)/w(i, k, k)
        else if (k == nint(params(i, p_free))) then
          if (acts(params(i, :), state(i, :))) &
            f(i, k) = r(i, k) - along_coordinate(u(i, k) - w(i, k, k)*r(i, k), w(i, k, k), params(i, :), params(i, own + 1), &
                                               state(i, :))
        end if
      end do
    end do
  end subroutine cairn_law_joint_residual

  subroutine cairn_law_joint_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step
    real(c_double), intent(in)          :: gap(n)         !< not asked for [m]
    real(c_double), intent(in)          :: u(n, c)        !< not asked for [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see prepare
    real(c_double), intent(inout)       :: state(n, states)    !< see prepare
    real(c_double) :: most, motor
    integer :: i, d, f
    d = merge(2, 3, c == 3)
    do i = 1, n
      f = nint(params(i, p_free))
      state(i, s_driven) = 0
      if (f > 0 .and. state(i, s_held) > 0) then
        ! the force beyond the motor's effort belongs to a limit
        most = context%h*params(i, p_effort)
        motor = min(max(r(i, f) + state(i, s_drag)*u(i, f) + state(i, s_pull), -most), most)
        state(i, s_driven) = motor*(u(i, f) + state(i, s_begin))/2
      end if
      if (norm2(r(i, :d)) >= context%h*params(i, p_strength)) state(i, s_held) = 0
    end do
  end subroutine cairn_law_joint_commit

  !> Energy of the spring; a joint that breaks releases it.
  subroutine cairn_law_joint_energy(n, c, context, gap, u, r, params, state_begin, state, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step
    real(c_double), intent(in)          :: gap(n)         !< not asked for [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see prepare
    real(c_double), intent(in)          :: state_begin(n, states), state(n, states) !< see prepare
    real(c_double), intent(out)         :: energy(n, 4)   !< see cairn/core.h [J]
    real(c_double) :: now, was, spent, begin, mean, across
    integer :: i, k, f
    energy = 0
    do i = 1, n
      f = nint(params(i, p_free))
      do k = 2, min(c, 3)
        across = drag_across(c, k, params(i, p_spans), state_begin(i, s_held), state_begin(i, s_across))
        if (.not. across > 0) cycle
        energy(i, 3) = energy(i, 3) - r(i, k)*(u(i, k) + r(i, k)/(2*across)) ! of the integrator, which gives it back
        energy(i, 4) = energy(i, 3)
      end do
      if (f < 1 .or. .not. state_begin(i, s_held) > 0) cycle
      begin = state(i, s_begin)
      was = params(i, p_stiffness)*(state(i, s_along) - (1 - context%theta)*context%h*begin - params(i, p_rest))**2/2
      now = params(i, p_stiffness)*(state(i, s_along) + context%theta*context%h*u(i, f) - params(i, p_rest))**2/2
      mean = context%theta*u(i, f) + (1 - context%theta)*begin
      spent = max(0.0_c_double, context%h*params(i, p_damping)*mean*(u(i, f) + begin)/2)
      energy(i, merge(2, 3, f == 1)) = now - was + spent
      energy(i, 1) = merge(now, 0.0_c_double, state(i, s_held) > 0)
      energy(i, 4) = energy(i, 4) + spent + now - energy(i, 1)
    end do
  end subroutine cairn_law_joint_energy

  !> Drag of a bar or a rope that holds, along t and s [kg].
  pure real(c_double) function drag_across(c, k, spans, held, across) result(drag)
    integer(c_int32_t), intent(in) :: c      !< components
    integer, intent(in)            :: k      !< component
    real(c_double), intent(in)     :: spans  !< see prepare
    real(c_double), intent(in)     :: held   !< see prepare
    real(c_double), intent(in)     :: across !< see prepare [kg]
    drag = 0
    if (spans > 0 .and. held > 0 .and. k > 1 .and. k <= merge(2, 3, c == 3)) drag = across
  end function drag_across

  pure logical function blocks(mask, k)
    real(c_double), intent(in) :: mask
    integer, intent(in)        :: k !< component
    blocks = btest(nint(mask), k - 1)
  end function blocks

  !> Where the state has the error of a component.
  pure integer function place(c, k)
    integer(c_int32_t), intent(in) :: c !< components
    integer, intent(in)            :: k !< component
    place = s_error + k - 1
    if (c == 3 .and. k == 3) place = s_error + 3
  end function place

  !> Factors W of the components that are blocked or dragged, by elimination without pivots: W is symmetric and at least
  !> semidefinite, and a component that nothing moves carries nothing. The upper factor stands above the diagonal, the other below.
  pure subroutine eliminate(c, mask, w, held, blocked, a)
    integer(c_int32_t), intent(in) :: c          !< components
    integer, intent(in)            :: mask       !< components that are blocked, as bits
    real(c_double), intent(in)     :: w(c, c)    !< [1/kg]
    integer, intent(out)           :: held       !< how many are blocked
    integer, intent(out)           :: blocked(c) !< their numbers, the first `held`
    real(c_double), intent(out)    :: a(c, c)    !< the first `held` rows and columns; pivot 0: carries nothing [1/kg]
    integer :: k, l
    held = 0
    do k = 1, c
      if (.not. btest(mask, k - 1)) cycle
      held = held + 1
      blocked(held) = k
    end do
    a(:held, :held) = w(blocked(:held), blocked(:held))
    do k = 1, held
      if (.not. a(k, k) > 16*epsilon(w)*w(blocked(k), blocked(k))) then
        a(k, :held) = 0
        a(:held, k) = 0
        cycle
      end if
      do l = k + 1, held
        a(l, k) = a(l, k)/a(k, k)
        a(l, k + 1:held) = a(l, k + 1:held) - a(l, k)*a(k, k + 1:held)
      end do
    end do
  end subroutine eliminate

  !> w r = q in the components that are blocked or dragged, the others of r none.
  pure subroutine hold(c, held, blocked, a, q, r)
    integer(c_int32_t), intent(in) :: c                !< components
    integer, intent(in)            :: held, blocked(c) !< see eliminate
    real(c_double), intent(in)     :: a(c, c)          !< see eliminate
    real(c_double), intent(in)     :: q(c)             !< [m/s]
    real(c_double), intent(out)    :: r(c)             !< [N s]
    real(c_double) :: x(c)
    integer :: k, l
    r = 0
    x(:held) = q(blocked(:held))
    do k = 1, held
      if (.not. a(k, k) > 0) x(k) = 0
      do l = k + 1, held
        x(l) = x(l) - a(l, k)*x(k)
      end do
    end do
    do k = held, 1, -1
      if (a(k, k) > 0) x(k) = (x(k) - dot_product(a(k, k + 1:held), x(k + 1:held)))/a(k, k)
      r(blocked(k)) = x(k)
    end do
  end subroutine hold
end module joint
