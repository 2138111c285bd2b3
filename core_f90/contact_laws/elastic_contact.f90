!> Contact on a spring with a dashpot in parallel, f_N = -k g - eta u_N, without tension, under Coulomb's friction, with the force
!> at the end of the step. LMGC90's ELASTIC_REPELL_CLB, ELASTIC_REPELL_CLB_g0, VISCO_ELASTIC_REPELL_CLB (closing = 0: a contact that
!> does not touch at the begin of a step stays open in it).
!> Parameters: k [N/m], eta [N s/m], friction, kinetic friction [-], closing, from_start, within [m].
module elastic_contact
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use dry_friction, only: friction_of, slid
  implicit none
  private
  public :: spring_and_dashpot, spring_energy
  public :: cairn_law_elastic_contact_prepare, cairn_law_elastic_contact_commit, cairn_law_elastic_contact_energy
  integer, parameter :: own = 7, states = 3 !< parameters, states
  integer, parameter :: s_started = 1, s_first = 2, s_slides = 3
contains

  !> Bias b and compliance e of a spring and dashpot: r_N e = -(u_N + b). Rigid where k is infinite; open where nothing resists, or
  !> the gap may not close.
  pure subroutine spring_and_dashpot(h, k, eta, closing, g, b, e)
    real(c_double), intent(in)  :: h       !< step [s]
    real(c_double), intent(in)  :: k, eta  !< [N/m], [N s/m]
    real(c_double), intent(in)  :: closing !< above 0: a gap may close within the step
    real(c_double), intent(in)  :: g       !< gap [m]
    real(c_double), intent(out) :: b       !< [m/s]
    real(c_double), intent(out) :: e       !< compliance [1/kg]
    b = sqrt(huge(b))
    e = 0
    if (g > 0 .and. .not. closing > 0) return
    if (.not. k < huge(k)) then
      b = g/h
    else if (g > 0) then
      if (.not. k > 0) return
      b = g/h
      e = 1/(k*h*h)
    else if (k*h + eta > 0) then
      b = g*(k/(k*h + eta))
      e = 1/(h*(k*h + eta))
    end if
  end subroutine spring_and_dashpot

  !> Energy of the spring at a gap g.
  pure real(c_double) function spring_energy(k, g)
    real(c_double), intent(in) :: k !< [N/m]
    real(c_double), intent(in) :: g !< gap [m]
    spring_energy = 0
    if (g < 0 .and. k < huge(k)) spring_energy = k*g*g/2
  end function spring_energy

  !> Local problem on Coulomb's cone, with a compliance.
  subroutine cairn_law_elastic_contact_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see above
    real(c_double), intent(inout)       :: state(n, states) !< 1 begins, 2 counts from its first gap; that [m]; 1 slid
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    integer :: i
    bias = 0
    compliance = 0
    do i = 1, n
      if (state(i, s_started) > 0 .and. state(i, s_started) < 2) then
        state(i, s_started) = merge(2, 0, params(i, 6) > 0)
        state(i, s_first) = max(0.0_c_double, gap(i))
      end if
      call spring_and_dashpot(context%h, params(i, 1), params(i, 2), params(i, 5), counted(gap(i), state(i, :)), bias(i, 1), &
                              compliance(i, 1))
      mu(i) = friction_of(params(i, 3), params(i, 4), state(i, s_slides))
    end do
  end subroutine cairn_law_elastic_contact_prepare

  !> The gap, less the first one where it counts from there.
  pure real(c_double) function counted(gap, s)
    real(c_double), intent(in) :: gap       !< [m]
    real(c_double), intent(in) :: s(states) !< see prepare
    counted = gap
    if (s(s_started) > 0) counted = gap - s(s_first)
  end function counted

  !> Records sliding.
  subroutine cairn_law_elastic_contact_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)          !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)          !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own)   !< see above
    real(c_double), intent(inout)       :: state(n, states) !< see prepare
    real(c_double), pointer, contiguous :: geometry(:, :)
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    do i = 1, n
      state(i, s_slides) = slid(c, geometry(i, 3), friction_of(params(i, 3), params(i, 4), state(i, s_slides)), r(i, 1), &
                                r(i, :), u(i, :))
    end do
  end subroutine cairn_law_elastic_contact_commit

  !> Energy of spring and dashpot in compression; a spring that is released loses its energy.
  subroutine cairn_law_elastic_contact_energy(n, c, context, gap, u, r, params, state_begin, state, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see above
    real(c_double), intent(in)          :: state_begin(n, states), state(n, states) !< see prepare
    real(c_double), intent(out)         :: energy(n, 4)   !< see cairn/core.h [J]
    real(c_double) :: g, was, now, spent
    integer :: i
    energy = 0
    do i = 1, n
      g = counted(gap(i), state(i, :))
      was = spring_energy(params(i, 1), g)
      now = spring_energy(params(i, 1), g + context%h*u(i, 1))
      energy(i, 1) = now
      if (r(i, 1) > 0) then
        spent = 0
        if (.not. g > 0 .and. params(i, 1) < huge(g)) spent = params(i, 2)*u(i, 1)**2*context%h
        energy(i, 2) = now - was + spent
        energy(i, 4) = spent
      else
        energy(i, 4) = was - now
      end if
    end do
  end subroutine cairn_law_elastic_contact_energy
end module elastic_contact
