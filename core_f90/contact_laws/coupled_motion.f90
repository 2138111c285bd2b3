!> Bilateral constraint between bodies within a reach: equal velocities along the normal, the tangents or both, with unlimited
!> impulse: LMGC90's COUPLED_DOF, NORMAL_COUPLED_DOF, TANGENTIAL_COUPLED_DOF. Beyond the reach bodies do not interact.
!> Velocities are coupled, not positions: an initial gap stays.
!> With a limit of the impulse along the normal, the normal yields in a step whose tension would exceed it, with the tangents still
!> held (PLASTIC_COUPLED_DOF), or the constraint breaks from the step after a larger compression (BROKEN_DOF).
module coupled_motion
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use held_components, only: hold
  implicit none
  private
  public :: cairn_law_coupled_motion_prepare, law_solve, law_residual, cairn_law_coupled_motion_commit
  character(*), parameter :: row = "coupled_motion"
  integer, parameter :: own = 5 !< normal, tangential, reach [m], impulse [N s], breaks
  integer, parameter :: states(2:3) = [2, 2] !< 1 coupled, 1 broken
contains

  include "own_solution_slots.inc"

  !> Who is within reach.
  subroutine cairn_law_coupled_motion_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< not asked for [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, states(c)) !< 1 coupled, 1 broken
    real(c_double), intent(out)         :: bias(n, c)       !< none [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< none [-]
    bias = 0
    compliance = 0
    mu = 0
    state(:, 1) = merge(1, 0, gap <= params(:, 3) .and. .not. state(:, 2) > 0)
  end subroutine cairn_law_coupled_motion_prepare

  !> Impulse of one contact.
  pure subroutine one_contact(c, w, q, p, s, r, status)
    integer(c_int32_t), intent(in)  :: c          !< components
    real(c_double), intent(in)      :: w(c, c)    !< Delassus block [1/kg]
    real(c_double), intent(in)      :: q(c)       !< velocity with r = 0 [m/s]
    real(c_double), intent(in)      :: p(own + 4) !< parameters, step, geometry
    real(c_double), intent(in)      :: s(states(c))  !< state
    real(c_double), intent(out)     :: r(c)       !< [N s]
    integer(c_int32_t), intent(out) :: status     !< see cairn_contact_status
    integer :: first, last
    r = 0
    status = 0
    first = merge(1, 2, p(1) > 0)
    last = merge(int(c), 1, p(2) > 0)
    if (.not. s(1) > 0 .or. first > last) return
    call hold(last - first + 1, w(first:last, first:last), q(first:last), r(first:last))
    status = 3
    if (first > 1 .or. p(5) > 0 .or. .not. r(1) < -p(4)) return
    r(1) = -p(4)
    if (last > 1) call hold(last - 1, w(2:last, 2:last), q(2:last) - w(2:last, 1)*p(4), r(2:last))
    status = 2
  end subroutine one_contact

  !> Breaks constraints whose compression exceeded the limit.
  subroutine cairn_law_coupled_motion_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n               !< contacts
    integer(c_int32_t), value           :: c               !< components
    type(cairn_law_context), intent(in) :: context         !< step
    real(c_double), intent(in)          :: gap(n)          !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)         !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)         !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own)  !< see laws.def
    real(c_double), intent(inout)       :: state(n, states(c)) !< 1 coupled, 1 broken
    where (state(:, 1) > 0 .and. params(:, 5) > 0 .and. r(:, 1) > params(:, 4)) state(:, 2) = 1
  end subroutine cairn_law_coupled_motion_commit
end module coupled_motion
