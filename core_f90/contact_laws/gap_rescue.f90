!> Signorini-Coulomb with a force that is known at the begin of the step and lifts an overlap beyond a tolerance (the gap rescue of
!> Radjai, LMGC90's IQS_CLB_RGR): a spring of stiffness 2 m (2 pi/T)^2 on the overlap, m = 1/W_NN, T the given number of steps. It
!> does not run away while T >= 2 sqrt(2) pi steps. The energy that it makes is told.
!> Parameters: friction [-], period [steps], tolerance: the gap below which it acts [m].
module gap_rescue
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use block_cones, only: solve_blocks, status_of_blocks
  implicit none
  private
  public :: cairn_law_gap_rescue_prepare, law_solve, law_residual
  character(*), parameter :: row = "gap_rescue"
  integer, parameter :: own = 3 !< parameters
  integer, parameter :: states(2:3) = [1, 1] !< with so many components
  real(c_double), parameter :: circle = 2*acos(-1.0_c_double)
contains

  include "own_solution_slots.inc"

  !> No bias where it lifts.
  subroutine cairn_law_gap_rescue_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< not asked for [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see above
    real(c_double), intent(inout)       :: state(n, states(c)) !< depth below the tolerance [m]
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    bias = 0
    compliance = 0
    mu = params(:, 1)
    state(:, 1) = max(0.0_c_double, params(:, 3) - gap)
    where (.not. state(:, 1) > 0) bias(:, 1) = max(gap, 0.0_c_double)/context%h
  end subroutine cairn_law_gap_rescue_prepare

  !> Impulse of one contact.
  pure subroutine one_contact(c, w, q, p, s, r, status)
    integer(c_int32_t), intent(in)  :: c          !< components
    real(c_double), intent(in)      :: w(c, c)    !< Delassus block [1/kg]
    real(c_double), intent(in)      :: q(c)       !< velocity with r = 0, bias included [m/s]
    real(c_double), intent(in)      :: p(own + 4) !< parameters, step, geometry
    real(c_double), intent(in)      :: s(states(c))  !< see prepare
    real(c_double), intent(out)     :: r(c)       !< [N s]
    integer(c_int32_t), intent(out) :: status     !< see cairn_contact_status
    real(c_double) :: mu(3), none(3), lift
    none = 0
    mu = [p(1), 0.0_c_double, 0.0_c_double]
    lift = 0
    if (s(1) > 0 .and. w(1, 1) > 0) lift = 2*(circle/p(2))**2*(s(1)/p(own + 1))/w(1, 1)
    call solve_blocks(c, .false., w, q + w(:, 1)*lift, mu, none, r)
    status = status_of_blocks(c, .false., mu, none, r)
    r(1) = r(1) + lift
    if (status == 0 .and. lift > 0) status = 2
  end subroutine one_contact
end module gap_rescue
