!> Signorini-Coulomb for the first three steps of a contact, from then on a spring beside a dashpot along the normal, and one along
!> the tangents whose end slides under Coulomb's friction: LMGC90's CRITICAL_VOIGT_CLB. They follow from a period T in steps and a
!> share v of the critical damping, k = 2 m (2 pi/(T h))^2, eta = 2 v (T h/(2 pi)) k, m the effective mass: the spring takes back
!> the overlap that impacts left. The energy that it makes is told.
!> Parameters: friction [-], period [steps], share of critical damping [-], tangential over normal stiffness [-].
module critical_voigt
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  implicit none
  private
  public :: cairn_law_critical_voigt_prepare, cairn_law_critical_voigt_commit
  integer, parameter :: own = 4 !< parameters
  integer, parameter :: s_steps = 1 !< steps of contact, three at most; behind it the tangential spring [m]
  integer, parameter :: impact = 3 !< steps of Signorini's condition before the spring
  real(c_double), parameter :: circle = 2*acos(-1.0_c_double)
contains

  !> Local problem on Coulomb's cone, with a compliance.
  subroutine cairn_law_critical_voigt_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< not asked for [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see above
    real(c_double), intent(inout)       :: state(n, c)      !< see above
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: share
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    compliance = 0
    bias = 0
    mu = params(:, 1)
    do i = 1, n
      if (state(i, s_steps) < impact) then
        bias(i, 1) = max(gap(i), 0.0_c_double)/context%h
      else
        call dipole(params(i, 2), params(i, 3), geometry(i, 3), share, compliance(i, 1))
        bias(i, 1) = share*(gap(i)/context%h)
        bias(i, 2:) = share*(state(i, 2:)/context%h)
        if (params(i, 4) > 0) then
          compliance(i, 2:) = compliance(i, 1)/params(i, 4)
        else
          mu(i) = 0
        end if
      end if
    end do
  end subroutine cairn_law_critical_voigt_prepare

  !> Spring and dashpot in parallel, implicit in u: e r = -(u + s x/h), x elongation, s = k h/(k h + eta), e = 1/(h (k h + eta)).
  pure subroutine dipole(period, damping, mass, share, compliance)
    real(c_double), intent(in)  :: period, damping !< [steps], [-]
    real(c_double), intent(in)  :: mass            !< effective [kg]
    real(c_double), intent(out) :: share           !< s [-]
    real(c_double), intent(out) :: compliance      !< e [1/kg]
    real(c_double) :: turn
    turn = period/circle
    share = 1/(1 + 2*damping*turn)
    compliance = turn*turn*share/(2*mass)
  end subroutine dipole

  !> Counts steps of contact, and finds the elongation that the impulse of the step leaves the tangential spring (implicit).
  subroutine cairn_law_critical_voigt_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see above
    real(c_double), intent(inout)       :: state(n, c)    !< see above
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: share, compliance
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    do i = 1, n
      if (.not. r(i, 1) > 0) then
        state(i, :) = 0
        cycle
      end if
      if (state(i, s_steps) >= impact .and. params(i, 4) > 0) then
        call dipole(params(i, 2), params(i, 3), geometry(i, 3), share, compliance)
        state(i, 2:) = (1 - share)*state(i, 2:) - context%h*(compliance/params(i, 4))*r(i, 2:)
      end if
      state(i, s_steps) = min(state(i, s_steps) + 1, real(impact, c_double))
    end do
  end subroutine cairn_law_critical_voigt_commit
end module critical_voigt
