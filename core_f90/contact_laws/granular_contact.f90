!> Contact of elastic grains put together from parts, as other codes for grains offer them: a normal force and its dashpot
!> (granular_normal.f90), a tangential spring and slider, and resistance to rolling and twisting (spin_springs.f90).
module granular_contact
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use granular_normal, only: normal_force, damping_coefficient, pull_off, neck_of, tear_gap, touching, tear_energy, hooke, &
                             jkr_contact
  use spring_slider, only: damp, slide, damping_of
  use spin_springs, only: roll, constant_torque
  implicit none
  private
  public :: cairn_law_granular_contact_force, cairn_law_granular_contact_stiffness
  integer, parameter :: own = 17, columns = 4
  integer, parameter :: p_model = 1, p_young = 2, p_poisson = 3, p_work = 4, p_damping = 5, p_value = 6, p_slip = 7, p_ratio = 8, &
                        p_mu = 9, p_roll = 10, p_rolling = 11, p_roll_ratio = 12, p_roll_damping = 13, p_twist = 14, &
                        p_twisting = 15, p_limited = 16, p_slip_damping = 17
  integer, parameter :: s_touched = 1, s_radius = 2, s_stored = 3, s_twist = 4 !< state: scalars; then springs of slip and rolling
  integer, parameter :: no_history = 0, linear = 1, mindlin = 2, rescaled = 3
  integer, parameter :: torque = 1, spring_dashpot = 2, by_coefficient = 1, marshall = 2
contains

  !> Components of u and f: n, t [, s], then spins: in 2D one, in 3D about n, t, s. The energy of springs is told as it was in the
  !> last step, so that a stiffness that changes with the normal force spends or gives it, and the balance closes.
  subroutine cairn_law_granular_contact_force(n, c, context, gap, u, params, state, f, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components: 3 in 2D, 6 in 3D
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the middle of the step [m/s, rad/s]
    real(c_double), intent(in)          :: params(own)    !< see laws.def
    real(c_double), intent(inout)       :: state(n, columns + 2*(merge(2, 3, c == 3) - 1)) !< see above [m, rad]
    real(c_double), intent(out)         :: f(n, c)        !< on A [N, N m]
    real(c_double), intent(inout), optional :: energy(n, 4) !< stored, dissipated by damping and tearing, by friction;
    !< released by tangential springs as their stiffness changed [J]
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: a(n), k(n), stored(n), dashpot(n), elastic(n), limit(n), springs(n), spent(n), was(n), touch(n)
    real(c_double) :: push, pull
    logical :: touched(n), before(n), limited
    integer :: axes, model, i
    integer, parameter :: slip = columns + 1
    call c_f_pointer(context%geometry, geometry, [n, 3])
    axes = merge(2, 3, c == 3)
    model = nint(params(p_model))
    before = state(:, s_touched) > 0
    touched = gap < 0
    if (model == jkr_contact) &
      call touching(n, neck_of(modulus_of(params), params(p_work)), geometry(:, 2), gap, before, touched)
    touch = merge(1.0_c_double, 0.0_c_double, touched)
    call normal_force(n, model, modulus_of(params), params(p_work), gap, geometry(:, 2), touched, elastic, a, k, stored)
    call damping_coefficient(n, model, nint(params(p_damping)), params(p_value), a, k, geometry(:, 3), dashpot)
    f(:, 1) = elastic
    call damp(n, context%h, geometry(:, 3), dashpot, u(:, 1), f(:, 1))
    limited = params(p_limited) > 0
    pull = pull_off(model, params(p_work), 1.0_c_double)
    do i = 1, n
      push = merge(max(f(i, 1), min(elastic(i), 0.0_c_double)), f(i, 1), limited)
      f(i, 1) = merge(push, 0.0_c_double, touch(i) > 0)
      limit(i) = merge(max(f(i, 1) + 2*(pull*geometry(i, 2)), 0.0_c_double), 0.0_c_double, touch(i) > 0)
      was(i) = state(i, s_stored)
    end do
    springs = 0
    spent = 0
    call tangential(n, axes, context%h, params, a, k, dashpot, limit, u(:, 1:axes), state(:, s_radius), &
                    state(:, slip:slip + axes - 2), f(:, 1:axes), springs, spent, present(energy))
    call spins(n, axes, context%h, params, a, k, geometry, limit, u(:, axes + 1:c), state(:, s_twist), &
               state(:, slip + axes - 1:slip + 2*axes - 3), f(:, axes + 1:c), springs, spent)
    if (present(energy)) then
      !$omp simd
      do i = 1, n
        energy(i, 1) = stored(i) + springs(i)
        energy(i, 2) = merge((elastic(i) - f(i, 1))*u(i, 1)*context%h, 0.0_c_double, touch(i) > 0)
        energy(i, 3) = spent(i) - (springs(i) - was(i))
        energy(i, 4) = 0
      end do
      if (model >= 2) energy(:, 2) = energy(:, 2) + made_and_torn(n, params, geometry(:, 2), stored, before, touched)
    end if
    do i = 1, n
      state(i, s_stored) = springs(i)
      state(i, s_touched) = touch(i)
    end do
  end subroutine cairn_law_granular_contact_force

  !> Energy that surfaces take as they meet, and that of a neck as it tears [J].
  pure function made_and_torn(n, params, radius, stored, before, touched) result(spent)
    integer(c_int32_t), intent(in) :: n
    real(c_double), intent(in)     :: params(own), radius(n), stored(n)
    logical, intent(in)            :: before(n), touched(n)
    real(c_double) :: spent(n), left(n)
    spent = 0
    left = 0
    if (nint(params(p_model)) == jkr_contact) &
      left = tear_energy(modulus_of(params), neck_of(modulus_of(params), params(p_work)), radius)
    where (touched .and. .not. before) spent = -stored
    where (before .and. .not. touched) spent = left
  end function made_and_torn

  !> Tangential force: a dashpot alone, a linear spring, Mindlin's spring, or that which is made shorter as the contact shrinks
  !> (Walton 1987; Thornton, Cummins & Cleary 2013).
  subroutine tangential(n, axes, h, params, a, k, dashpot, limit, u, radius, spring, f, stored, spent, counts)
    integer(c_int32_t), intent(in) :: n, axes
    real(c_double), intent(in)     :: h, params(own), a(n), k(n), dashpot(n), limit(n), u(n, axes)
    real(c_double), intent(inout)  :: radius(n), spring(n, axes - 1), f(n, axes), stored(n), spent(n)
    logical, intent(in)            :: counts !< works of the step, too
    real(c_double) :: stiffness(n), damping(n), bound(n), old(n, axes - 1), share, most
    integer :: i, j, model
    model = nint(params(p_slip))
    select case (model)
    case (no_history)
      stiffness = 0
    case (linear)
      stiffness = params(p_ratio)*shear_of(params)*a
      if (nint(params(p_model)) == hooke) stiffness = params(p_ratio)*k
    case default
      stiffness = shear_of(params)*a
    end select
    if (model == rescaled) then
      do j = 1, axes - 1
        do i = 1, n
          spring(i, j) = spring(i, j)*merge(a(i)/merge(radius(i), 1.0_c_double, radius(i) > 0), 1.0_c_double, a(i) < radius(i))
        end do
      end do
    end if
    if (params(p_slip_damping) >= 0) then
      share = params(p_slip_damping)
    else if (nint(params(p_model)) == hooke) then
      share = sqrt(params(p_ratio))
    else
      share = 0
      if (modulus_of(params) > 0) share = sqrt(shear_of(params)/(2*modulus_of(params)))
    end if
    most = params(p_mu)
    do i = 1, n
      radius(i) = a(i)
      damping(i) = share*dashpot(i)
      bound(i) = most*limit(i)
    end do
    if (counts) old = spring
    call slide(n, axes, h, stiffness, damping, bound, u, spring, f)
    do j = 1, axes - 1
      do i = 1, n
        stored(i) = stored(i) + 0.5_c_double*stiffness(i)*spring(i, j)**2
      end do
      if (.not. counts) cycle
      do i = 1, n
        spent(i) = spent(i) - h*(f(i, 1 + j)*u(i, 1 + j)) - 0.5_c_double*stiffness(i)*h*(u(i, 1 + j)*(spring(i, j) - old(i, j)))
      end do
    end do
  end subroutine tangential

  !> Moments against rolling and twisting. The spring of rolling has k_r = ratio k_n (mu_r R)^2 (Ai et al. 2011: 3 in 2D, Iwashita &
  !> Oda: 2.25), its dashpot is the share of the critical damping of a sphere of 7/5 m R^2 on a wall. That of twisting is half of
  !> the tangential one times a^2, within the limit that is given, or two thirds of mu f_n a (Marshall 2009).
  subroutine spins(n, axes, h, params, a, k, geometry, limit, w, twist, rolled, moment, stored, spent)
    integer(c_int32_t), intent(in) :: n, axes
    real(c_double), intent(in)     :: h, params(own), a(n), k(n), geometry(n, 3), limit(n), w(n, 2*axes - 3)
    real(c_double), intent(inout)  :: twist(n), rolled(n, axes - 1), stored(n), spent(n)
    real(c_double), intent(out)    :: moment(n, 2*axes - 3)
    real(c_double) :: stiffness(n), most(n), damping(n), angle(n, 1), turn(n, 1), one(n, 1)
    integer :: first
    moment = 0
    first = merge(1, 2, axes == 2)
    most = params(p_rolling)*geometry(:, 2)*limit
    if (nint(params(p_roll)) == torque) call constant_torque(n, axes - 1, h, most, w(:, first:), moment(:, first:), spent)
    if (nint(params(p_roll)) == spring_dashpot) then
      stiffness = params(p_roll_ratio)*k*(params(p_rolling)*geometry(:, 2))**2
      damping = 2*params(p_roll_damping)*sqrt(1.4_c_double*geometry(:, 3)*stiffness)*geometry(:, 2)
      call roll(n, axes - 1, h, stiffness, damping, most, w(:, first:), rolled, moment(:, first:), stored, spent)
    end if
    if (axes == 2 .or. nint(params(p_twist)) == 0) return
    most = params(p_twisting)*geometry(:, 2)*limit
    if (nint(params(p_twist)) == marshall) most = 2*params(p_mu)*limit*a/3
    stiffness = twist_stiffness(params, a, k)
    damping = 0
    angle(:, 1) = twist
    one(:, 1) = w(:, 1)
    call roll(n, 1_c_int32_t, h, stiffness, damping, most, one, angle, turn, stored, spent)
    moment(:, 1) = turn(:, 1)
    twist = angle(:, 1)
  end subroutine spins

  !> Half of the tangential stiffness times a^2 (Marshall 2009) [N m/rad].
  pure function twist_stiffness(params, a, k) result(stiffness)
    real(c_double), intent(in) :: params(own), a(:), k(:)
    real(c_double) :: stiffness(size(a))
    stiffness = 0.5_c_double*a**2*merge(params(p_ratio)*k, shear_of(params)*a, nint(params(p_model)) == hooke)
  end function twist_stiffness

  !> E* of two like bodies; of linear springs the stiffness itself.
  pure function modulus_of(params) result(modulus)
    real(c_double), intent(in) :: params(own)
    real(c_double) :: modulus
    modulus = params(p_young)
    if (nint(params(p_model)) /= hooke) modulus = params(p_young)/(2*(1 - params(p_poisson)**2))
  end function modulus_of

  !> 8 G*.
  pure function shear_of(params) result(shear)
    real(c_double), intent(in) :: params(own)
    real(c_double) :: shear
    shear = 2*params(p_young)/((2 - params(p_poisson))*(1 + params(p_poisson)))
  end function shear_of

  !> Stiffness at an overlap, damping ratio, and the gap at which the force begins or ends.
  subroutine cairn_law_granular_contact_stiffness(n, c, overlap, radius, params, k, reach) bind(c)
    integer(c_int32_t), value   :: n           !< contacts
    integer(c_int32_t), value   :: c           !< components of the force: 3 in 2D, 6 in 3D
    real(c_double), intent(in)  :: overlap(n)  !< [m]
    real(c_double), intent(in)  :: radius(n)   !< effective radius [m]
    real(c_double), intent(in)  :: params(own) !< as for the force
    real(c_double), intent(out) :: k(n, 4)     !< normal, tangential [N/m], damping ratio [-], of spins [N m/rad]
    real(c_double), intent(out) :: reach(n)    !< [m]
    real(c_double) :: f(n), a(n), stored(n)
    logical :: touched(n)
    touched = .true.
    call normal_force(n, nint(params(p_model)), modulus_of(params), params(p_work), -max(overlap, 0.0_c_double), radius, touched, &
                      f, a, k(:, 1), stored)
    k(:, 2) = shear_of(params)*a
    if (nint(params(p_slip)) == linear) k(:, 2) = params(p_ratio)*merge(k(:, 1), k(:, 2), nint(params(p_model)) == hooke)
    if (nint(params(p_slip)) == no_history .or. .not. params(p_mu) > 0) k(:, 2) = 0
    k(:, 3) = 0
    if (nint(params(p_damping)) <= 1) k(:, 3) = damping_of(params(p_value))
    k(:, 4) = 0
    if (nint(params(p_roll)) == spring_dashpot) k(:, 4) = params(p_roll_ratio)*k(:, 1)*(params(p_rolling)*radius)**2
    if (c == 6 .and. nint(params(p_twist)) /= 0) k(:, 4) = max(k(:, 4), twist_stiffness(params, a, k(:, 1)))
    reach = 0
    if (nint(params(p_model)) == jkr_contact) reach = 1.5_c_double*tear_gap(neck_of(modulus_of(params), params(p_work)), radius)
  end subroutine cairn_law_granular_contact_stiffness
end module granular_contact
