!> Parallel bonds (Potyondy & Cundall 2004): bodies that came in touching are glued by a disk (in 2D a strip) of radius
!> b = radius x 2 R, R the effective radius, whose springs take tension, shear, bending and twist beside rigid contact with
!> friction,
!>   r = r_c - h K (d + h u),   K = diag(k_n A, k_t A, k_n I, k_t J).
!> Springs stiffer than `stiffest` times the inertia in a step are rigid within rounding, so their stiffness is limited to that:
!> rounding of velocities would otherwise exceed any force that the bond bears.
!> A bond breaks at the end of a step whose stress reaches a strength: k_n (d_N + b |bend|) or k_t (|d_T| + b |twist|).
module parallel_bond
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use block_cones, only: map_blocks, status_of_blocks
  use cohesive_zone, only: stiff_in_step
  use coulomb_cone, only: cairn_cone_full2, cairn_cone_full3
  use lane_blocks, only: lanes, load_lanes, pushed_velocities, sprung_columns
  implicit none
  private
  public :: cairn_law_parallel_bond_prepare, cairn_law_parallel_bond_solve, cairn_law_parallel_bond_commit
  public :: cairn_law_parallel_bond_residual, cairn_law_parallel_bond_energy
  integer, parameter :: own = 7 !< parameters: stiffnesses [Pa/m], strengths [Pa], friction, radius, within
  integer, parameter :: s_held = 1, s_first = 2, s_radius = 3, s_stretch = 4, s_twist = 5, s_slip = 6
  real(c_double), parameter :: pi = acos(-1.0_c_double)
  real(c_double), parameter :: stiffest = 2.0_c_double**40
contains

  !> A bond begins at the gap it had.
  subroutine cairn_law_parallel_bond_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components: 3 in 2D, 6 in 3D
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< not asked for [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see above
    real(c_double), intent(inout)       :: state(n, *)      !< held, first gap, radius, stretch [m], twist [rad], slip [m], bend
    !< [rad]; parts of twist, slip and bend that springs do not bear
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    real(c_double), pointer, contiguous :: geometry(:, :)
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    bias = 0
    compliance = 0
    do i = 1, n
      if (state(i, s_held) > 0 .and. .not. state(i, s_radius) > 0) then
        state(i, s_radius) = 2*params(i, 6)*geometry(i, 2)
        state(i, s_first) = max(gap(i), 0.0_c_double)
      end if
      bias(i, 1) = max(gap(i) - merge(state(i, s_first), 0.0_c_double, state(i, s_held) > 0), 0.0_c_double)/context%h
      mu(i) = params(i, 5)
    end do
  end subroutine cairn_law_parallel_bond_prepare

  !> Springs make of W and the free velocity (1 + W h^2 K)^-1 times them; the contact beside them knows no moments.
  subroutine cairn_law_parallel_bond_solve(n, c, w, u_free, bias, params, state, r, status) bind(c)
    integer(c_int32_t), value     :: n                  !< contacts
    integer(c_int32_t), value     :: c                  !< components
    real(c_double), intent(in)    :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)    :: u_free(n, c)       !< relative velocity with r = 0 here, bias included [m/s]
    real(c_double), intent(in)    :: bias(n, c)         !< in u_free [m/s]
    real(c_double), intent(in)    :: params(n, own + 4) !< see above; step, geometry
    real(c_double), intent(in)    :: state(n, *)        !< see prepare
    real(c_double), intent(inout) :: r(n, c)            !< impulse [N s]
    integer(c_int32_t), intent(out), optional :: status(n) !< see cairn_contact_status
    real(c_double) :: spring(n, c), pull(n, c), u(n, c), push(n)
    integer :: first, i, k
    call springs_of_all(n, c, params, state, spring, pull)
    call pushed_velocities(n, c, w, u_free, spring, pull, u, push)
    do k = 1, c
      !$omp simd
      do i = 1, n
        r(i, k) = -(spring(i, k)*u(i, k) + pull(i, k))
      end do
    end do
    r(:, 1) = r(:, 1) + push
    if (present(status)) status = merge(3, merge(1, 0, r(:, 1) > 0), state(:, s_held) > 0)
    if (.not. any(params(:, 5) > 0)) return
    do first = 1, n, lanes
      if (any(params(first:min(n, first + lanes - 1), 5) > 0 .and. push(first:min(n, first + lanes - 1)) > 0)) &
        call solve_strip(n, c, merge(2, 3, c == 3), first, w, u_free, params(:, 5), push, spring, pull, r)
    end do
  end subroutine cairn_law_parallel_bond_solve

  !> Solves the contacts of a strip that press with friction beside their springs. Others keep their impulses, whose last digits
  !> would depend on their neighbours in the strip.
  subroutine solve_strip(n, c, axes, first, w, u_free, friction, push, spring, pull, r)
    integer(c_int32_t), intent(in) :: n            !< contacts
    integer(c_int32_t), intent(in) :: c            !< components
    integer, intent(in)            :: axes         !< of the contact beside the springs
    integer, intent(in)            :: first        !< of the strip, from 1
    real(c_double), intent(in)     :: w(n, c, c)   !< Delassus blocks [1/kg]
    real(c_double), intent(in)     :: u_free(n, c) !< relative velocity with r = 0 here, bias included [m/s]
    real(c_double), intent(in)     :: friction(n)  !< [-]
    real(c_double), intent(in)     :: push(n)      !< of the contact beside the springs, without friction [N s]
    real(c_double), intent(in)     :: spring(n, c) !< [kg]
    real(c_double), intent(in)     :: pull(n, c)   !< [N s]
    real(c_double), intent(inout)  :: r(n, c)      !< impulse [N s]
    real(c_double) :: x(lanes, c, 1 + axes), block(lanes, axes, axes), free(lanes, axes)
    real(c_double) :: contact(lanes, axes), mu(lanes), none(lanes), u
    integer :: i, k, l, lane
    call load_lanes(n, first, friction, mu)
    call sprung_columns(n, c, first, w, u_free, spring, pull, axes, x)
    free = x(:, :axes, 1)
    block = x(:, :axes, 2:)
    contact = 0
    none = 0
    if (axes == 2) then
      call cairn_cone_full2(lanes, 2, block, free, free, mu, none, contact)
    else
      call cairn_cone_full3(lanes, 3, block, free, free, mu, none, contact)
    end if
    do i = first, min(n, first + lanes - 1)
      lane = i - first + 1
      if (.not. (mu(lane) > 0 .and. push(i) > 0)) cycle
      do k = 1, c
        u = x(lane, k, 1)
        do l = 1, axes
          u = u + x(lane, k, 1 + l)*contact(lane, l)
        end do
        r(i, k) = -(spring(i, k)*u + pull(i, k))
        if (k <= axes) r(i, k) = r(i, k) + contact(lane, k)
      end do
    end do
  end subroutine solve_strip

  !> r = -(spring u + pull) of bonds, nothing where there is none.
  subroutine springs_of_all(n, c, params, state, spring, pull)
    integer(c_int32_t), intent(in) :: n                  !< contacts
    integer(c_int32_t), intent(in) :: c                  !< components
    real(c_double), intent(in)     :: params(n, own + 4) !< see above; step, geometry
    real(c_double), intent(in)     :: state(n, *)        !< see prepare
    real(c_double), intent(out)    :: spring(n, c)       !< [kg]
    real(c_double), intent(out)    :: pull(n, c)         !< [N s]
    real(c_double) :: h, area, share(n)
    integer :: i, k, s
    if (c == 3) then
      !$omp simd private(h, area)
      do i = 1, n
        h = merge(params(i, own + 1), 0.0_c_double, state(i, s_held) > 0)
        area = 2*state(i, s_radius)*share_of(c, params(i, 1), params(i, 2), state(i, s_radius), params(i, own + 1), &
                                             params(i, own + 4))
        spring(i, 1) = h*(h*(params(i, 1)*area))
        spring(i, 2) = h*(params(i, 2)*area)
        spring(i, 3) = h*(params(i, 1)*(area*state(i, s_radius)**2/3))
        pull(i, 1) = 0
        pull(i, 2) = spring(i, 2)*state(i, s_slip)
        pull(i, 3) = spring(i, 3)*state(i, s_slip + 1)
        spring(i, 2) = h*spring(i, 2)
        spring(i, 3) = h*spring(i, 3)
      end do
      return
    end if
    !$omp simd
    do i = 1, n
      share(i) = share_of(c, params(i, 1), params(i, 2), state(i, s_radius), params(i, own + 1), params(i, own + 4))
    end do
    do k = 1, c
      s = drawn(c, k)
      !$omp simd private(h)
      do i = 1, n
        h = merge(params(i, own + 1), 0.0_c_double, state(i, s_held) > 0)
        spring(i, k) = h*share(i)*of_component(c, k, params(i, 1), params(i, 2), state(i, s_radius))
        pull(i, k) = spring(i, k)*state(i, s)
        spring(i, k) = h*spring(i, k)
      end do
    end do
    pull(:, 1) = 0
  end subroutine springs_of_all

  !> Largest stiffness of the springs along normal and tangents [N/m].
  pure real(c_double) function largest_stiffness(c, p, radius)
    integer(c_int32_t), intent(in) :: c      !< components
    real(c_double), intent(in)     :: p(*)   !< parameters
    real(c_double), intent(in)     :: radius !< of the bond [m]
    largest_stiffness = max(p(1), p(2))*merge(2*radius, pi*radius**2, c == 3)
  end function largest_stiffness

  !> Share of the stiffness that the limit leaves; 1 for nearly all bonds.
  elemental real(c_double) function share_of(c, normal, tangential, radius, h, mass)
    integer(c_int32_t), intent(in) :: c                  !< components
    real(c_double), intent(in)     :: normal, tangential !< [Pa/m]
    real(c_double), intent(in)     :: radius             !< of the bond [m]
    real(c_double), intent(in)     :: h                  !< [s]
    real(c_double), intent(in)     :: mass               !< that moves along the normal [kg]
    real(c_double) :: most
    most = h*(h*(max(normal, tangential)*merge(2*radius, pi*radius**2, c == 3)))
    share_of = min(1.0_c_double, stiffest*mass/max(most, tiny(most)))
  end function share_of

  !> Where the state has how far the spring of a component behind the first is drawn; of the first, a column that is there.
  pure integer function drawn(c, k)
    integer(c_int32_t), intent(in) :: c !< components
    integer, intent(in)            :: k !< component
    drawn = max(s_slip, s_slip + k - 2)
    if (c == 6 .and. k == 4) drawn = s_twist
    if (c == 6 .and. k > 4) drawn = s_slip + k - 3
  end function drawn

  !> Stiffness of one component [N/m, N m].
  elemental real(c_double) function of_component(c, k, normal, tangential, radius)
    integer(c_int32_t), intent(in) :: c                  !< components
    integer, intent(in)            :: k                  !< which
    real(c_double), intent(in)     :: normal, tangential !< [Pa/m]
    real(c_double), intent(in)     :: radius             !< of the disk of the bond, in 2D half of the strip's width [m]
    real(c_double) :: area, bending
    if (c == 3) then
      area = 2*radius
      bending = 2*radius**3/3
    else
      area = pi*radius**2
      bending = pi*radius**4/4
    end if
    if (k == 1) then
      of_component = normal*area
    else if (k == 2 .or. (k == 3 .and. c == 6)) then
      of_component = tangential*area
    else if (k == 4) then
      of_component = 2*tangential*bending
    else
      of_component = normal*bending
    end if
  end function of_component

  !> The natural map of the contact beside the springs, divided by what these add to 1/W.
  subroutine cairn_law_parallel_bond_residual(n, c, context, rho, w, u, bias, r, params, state, f, weight, status) bind(c)
    integer(c_int32_t), value           :: n                  !< contacts
    integer(c_int32_t), value           :: c                  !< components
    type(cairn_law_context), intent(in) :: context            !< step
    real(c_double), intent(in)          :: rho(n)             !< 1/W_NN [kg]
    real(c_double), intent(in)          :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)          :: u(n, c)            !< relative velocity, bias included [m/s]
    real(c_double), intent(in)          :: bias(n, c)         !< in u [m/s]
    real(c_double), intent(in)          :: r(n, c)            !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own + 4) !< see above; step, geometry
    real(c_double), intent(in)          :: state(n, *)        !< see prepare
    real(c_double), intent(out)         :: f(n, c)            !< [N s]
    real(c_double), intent(out)         :: weight(n, c)       !< [1/kg]
    integer(c_int32_t), intent(out)     :: status(n)          !< see cairn_contact_status
    real(c_double) :: spring(c), pull(c), rc(c), block(c, c), mu(3), none(3)
    integer :: i, k, axes
    axes = merge(2, 3, c == 3)
    none = 0
    do i = 1, n
      call springs(c, params(i, :), params(i, own + 1), params(i, own + 4), state(i, :s_slip + last(c)), spring, pull)
      rc = r(i, :) + spring*u(i, :) + pull
      mu = [params(i, 5), 0.0_c_double, 0.0_c_double]
      block = w(i, :, :)
      do k = 1, c
        block(k, k) = block(k, k)/(1 + block(k, k)*spring(k))
      end do
      f(i, :) = rc
      call map_blocks(axes, .false., block(:axes, :axes), u(i, :axes), mu, none, rc(:axes), f(i, :axes))
      do k = 1, c
        f(i, k) = f(i, k)/(1 + w(i, k, k)*spring(k))
        weight(i, k) = w(i, k, k)
      end do
      status(i) = status_of_blocks(axes, .false., mu, none, rc(:axes))
      if (state(i, s_held) > 0) status(i) = 3
    end do
  end subroutine cairn_law_parallel_bond_residual

  !> Openings at the end of the step; breaks bonds whose stress exceeds a strength.
  subroutine cairn_law_parallel_bond_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see above
    real(c_double), intent(inout)       :: state(n, *)    !< see prepare
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: h, was(s_slip + last(c)), now(s_slip + last(c)), v(c), opened
    logical :: breaks
    integer :: i, missed
    missed = s_slip + last(c) + 1
    call c_f_pointer(context%geometry, geometry, [n, 3])
    h = context%h
    do i = 1, n
      if (.not. state(i, s_held) > 0) cycle
      was = state(i, :s_slip + last(c))
      opened = max(0.0_c_double, gap(i) - state(i, s_first))
      v = u(i, :)
      now = was
      call stretched(c, h, opened, v, was, now)
      state(i, :s_slip + last(c)) = now
      breaks = stressed(c, params(i, :), h, geometry(i, 3), now)
      if (breaks .or. stiff_in_step(h*(h*largest_stiffness(c, params(i, :), state(i, s_radius))), geometry(i, 3))) then
        call settle_velocity(c, params(i, :), h, geometry(i, 3), opened, r(i, :), was, v)
        call stretched(c, h, opened, v, was, now)
        state(i, s_stretch) = now(s_stretch) ! where the bodies went, the next gap tells
        breaks = stressed(c, params(i, :), h, geometry(i, 3), now)
      end if
      state(i, missed) = state(i, s_twist) - now(s_twist)
      state(i, missed + 1:missed + 1 + last(c)) = state(i, s_slip:s_slip + last(c)) - now(s_slip:s_slip + last(c))
      if (.not. breaks) cycle
      state(i, s_held) = 0
      state(i, s_stretch:missed + 1 + last(c)) = 0
    end do
  end subroutine cairn_law_parallel_bond_commit

  !> How far springs are drawn behind a step.
  pure subroutine stretched(c, h, opened, u, was, now)
    integer(c_int32_t), intent(in) :: c      !< components
    real(c_double), intent(in)     :: h      !< [s]
    real(c_double), intent(in)     :: opened !< at its begin [m]
    real(c_double), intent(in)     :: u(c)   !< at its end [m/s]
    real(c_double), intent(in)     :: was(*) !< state at its begin
    real(c_double), intent(inout)  :: now(*) !< and at its end
    integer :: k
    now(s_stretch) = max(0.0_c_double, opened + h*u(1))
    do k = 2, c
      now(drawn(c, k)) = was(drawn(c, k)) + h*u(k)
    end do
  end subroutine stretched

  !> True if a stress reaches its strength.
  pure logical function stressed(c, p, h, mass, s)
    integer(c_int32_t), intent(in) :: c    !< components
    real(c_double), intent(in)     :: p(*) !< parameters
    real(c_double), intent(in)     :: h    !< [s]
    real(c_double), intent(in)     :: mass !< [kg]
    real(c_double), intent(in)     :: s(*) !< state
    real(c_double) :: tension, shear, share
    integer :: m
    m = merge(1, 2, c == 3)
    share = share_of(c, p(1), p(2), s(s_radius), h, mass)
    tension = share*p(1)*(s(s_stretch) + s(s_radius)*length(m, s(s_slip + m:s_slip + 2*m - 1)))
    shear = share*p(2)*(length(m, s(s_slip:s_slip + m - 1)) + s(s_radius)*abs(s(s_twist)))
    stressed = tension >= p(3) .or. shear >= p(4)
  end function stressed

  !> Velocity consistent with both impulse and velocity. Springs that are stiff in a step open by less than the error of a solver,
  !> which would break or load them. An error in velocity shrinks to 1/(1 + W h^2 K) of it.
  pure subroutine settle_velocity(c, p, h, mass, opened, r, was, u)
    integer(c_int32_t), intent(in) :: c      !< components
    real(c_double), intent(in)     :: p(*)   !< parameters
    real(c_double), intent(in)     :: h      !< [s]
    real(c_double), intent(in)     :: mass   !< [kg]
    real(c_double), intent(in)     :: opened !< at the begin of the step [m]
    real(c_double), intent(in)     :: r(c)   !< [N s]
    real(c_double), intent(in)     :: was(*) !< state at its begin
    real(c_double), intent(inout)  :: u(c)   !< at its end [m/s]
    real(c_double) :: spring(c), pull(c), heavy
    integer :: k, axes
    if (.not. (mass > 0 .and. mass <= huge(mass))) return
    call springs(c, p, h, mass, was, spring, pull)
    axes = merge(2, 3, c == 3)
    u(1) = u(1) + opened/h
    do k = 1, c
      if (k > 1 .and. k <= axes .and. p(5) > 0 .and. r(1) > 0) cycle ! the share of friction in the impulse is unknown
      heavy = merge(mass, mass*was(s_radius)**2, k <= axes)
      u(k) = u(k) - (r(k) + spring(k)*u(k) + pull(k))/(spring(k) + heavy)
    end do
    u(1) = u(1) - opened/h
  end subroutine settle_velocity

  !> Energy of the springs; a bond that breaks releases it.
  subroutine cairn_law_parallel_bond_energy(n, c, context, gap, u, r, params, state_begin, state, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see above
    real(c_double), intent(in)          :: state_begin(n, *), state(n, *) !< see prepare
    real(c_double), intent(out)         :: energy(n, 4)   !< see cairn/core.h [J]
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: now(2), was(2)
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    do i = 1, n
      now = held(state(i, :s_slip + 2*last(c) + 2))
      was = held(state_begin(i, :s_slip + 2*last(c) + 2))
      energy(i, :) = [now(1) + now(2), now(1) - was(1), now(2) - was(2), 0.0_c_double]
      if (state_begin(i, s_held) > 0 .and. .not. state(i, s_held) > 0) energy(i, :) = [0.0_c_double, 0.0_c_double, 0.0_c_double, &
                                                                                     was(1) + was(2)]
    end do
  contains
    pure function held(s) result(both)
      real(c_double), intent(in) :: s(*)
      real(c_double) :: both(2), k(6), drawn(last(c) + 1)
      integer :: m, missed
      both = 0
      if (.not. s(s_held) > 0) return
      m = merge(1, 2, c == 3)
      missed = s_slip + last(c) + 1
      drawn = s(s_slip:s_slip + last(c)) - s(missed + 1:missed + 1 + last(c))
      k = 0
      k(:c) = stiffness(c, params(i, :), s(s_radius), context%h, geometry(i, 3))
      both(1) = k(1)*s(s_stretch)**2/2
      both(2) = (k(2)*sum(drawn(:m)**2) + k(c)*sum(drawn(m + 1:)**2))/2
      if (c == 6) both(2) = both(2) + k(4)*(s(s_twist) - s(missed))**2/2
    end function held
  end subroutine cairn_law_parallel_bond_energy

  !> Columns of the state behind the first of the slip.
  pure integer function last(c)
    integer(c_int32_t), intent(in) :: c !< components
    last = merge(1, 3, c == 3)
  end function last

  !> Stiffness of each component [N/m, N m].
  pure function stiffness(c, p, radius, h, mass) result(k)
    integer(c_int32_t), intent(in) :: c      !< components
    real(c_double), intent(in)     :: p(*)   !< parameters
    real(c_double), intent(in)     :: radius !< [m]
    real(c_double), intent(in)     :: h      !< [s]
    real(c_double), intent(in)     :: mass   !< [kg]
    real(c_double) :: k(c), share
    integer :: l
    share = share_of(c, p(1), p(2), radius, h, mass)
    do l = 1, c
      k(l) = share*of_component(c, l, p(1), p(2), radius)
    end do
  end function stiffness

  !> r = -(spring u + pull), of a bond.
  pure subroutine springs(c, p, h, mass, s, spring, pull)
    integer(c_int32_t), intent(in) :: c         !< components
    real(c_double), intent(in)     :: p(*)      !< parameters
    real(c_double), intent(in)     :: h         !< [s]
    real(c_double), intent(in)     :: mass      !< [kg]
    real(c_double), intent(in)     :: s(*)      !< state
    real(c_double), intent(out)    :: spring(c) !< [kg]
    real(c_double), intent(out)    :: pull(c)   !< [N s]
    real(c_double) :: k(c)
    integer :: l
    spring = 0
    pull = 0
    if (.not. s(s_held) > 0) return
    k = stiffness(c, p, s(s_radius), h, mass)
    spring = h*h*k
    do l = 2, c
      pull(l) = h*k(l)*s(drawn(c, l))
    end do
  end subroutine springs

  pure real(c_double) function length(m, x)
    integer, intent(in)        :: m
    real(c_double), intent(in) :: x(m) !< any unit
    length = maxval(abs(x))
    if (m > 1 .and. length > 0) length = length*sqrt(sum((x/length)**2))
  end function length
end module parallel_bond
