!> Bodies within a reach move together at their contact, along the normal, the tangents or both, pushed and pulled without limit:
!> LMGC90's COUPLED_DOF, NORMAL_COUPLED_DOF, TANGENTIAL_COUPLED_DOF. Beyond it they pass through each other.
!> It is the velocity that is coupled: a gap that is there stays.
module coupled_motion
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use held_components, only: hold
  implicit none
  private
  public :: cairn_law_coupled_motion_prepare, law_solve, law_residual
  character(*), parameter :: row = "coupled_motion"
  integer, parameter :: own = 3 !< normal, tangential, reach [m]
  integer, parameter :: states(2:3) = [1, 1] !< 1 coupled
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
    real(c_double), intent(inout)       :: state(n, states(c)) !< 1 coupled
    real(c_double), intent(out)         :: bias(n, c)       !< none [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< none [-]
    bias = 0
    compliance = 0
    mu = 0
    state(:, 1) = merge(1, 0, gap <= params(:, 3))
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
  end subroutine one_contact
end module coupled_motion
