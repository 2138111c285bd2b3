!> Signorini-Coulomb with stops: a contact that would slide by more than a limit under compression blocks its tangents in that step,
!> even if that lifts it. Motion while open does not count as slip. LMGC90's IQS_CLB_nosldt; with recovers = 1 its
!> GAP_SGR_CLB_nosldt.
module limited_slip
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use block_cones, only: solve_blocks, status_of_blocks
  use held_components, only: hold
  implicit none
  private
  public :: cairn_law_limited_slip_prepare, law_solve, law_residual, cairn_law_limited_slip_commit
  character(*), parameter :: row = "limited_slip"
  integer, parameter :: own = 3 !< friction [-], limit [m], recovers
  integer, parameter :: states(2:3) = [1, 2] !< the slip along the tangents [m]
contains

  include "own_solution_slots.inc"

  !> Local problem of Signorini-Coulomb.
  subroutine cairn_law_limited_slip_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< not asked for [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, states(c))  !< slip [m]
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    bias = 0
    compliance = 0
    mu = params(:, 1)
    bias(:, 1) = merge(gap, max(gap, 0.0_c_double), params(:, 3) > 0)/context%h
  end subroutine cairn_law_limited_slip_prepare

  !> Impulse of one contact.
  pure subroutine one_contact(c, w, q, p, s, r, status)
    integer(c_int32_t), intent(in)  :: c          !< components
    real(c_double), intent(in)      :: w(c, c)    !< Delassus block [1/kg]
    real(c_double), intent(in)      :: q(c)       !< velocity with r = 0, bias included [m/s]
    real(c_double), intent(in)      :: p(own + 4) !< parameters, step, geometry
    real(c_double), intent(in)      :: s(states(c)) !< slip [m]
    real(c_double), intent(out)     :: r(c)       !< [N s]
    integer(c_int32_t), intent(out) :: status     !< see cairn_contact_status
    real(c_double) :: mu(3), none(3), way(c - 1)
    none = 0
    mu = [p(1), 0.0_c_double, 0.0_c_double]
    call solve_blocks(c, .false., w, q, mu, none, r)
    status = status_of_blocks(c, .false., mu, none, r)
    if (.not. r(1) > 0) return
    way = s + p(own + 1)*(q(2:) + matmul(w(2:, :), r))
    if (.not. norm2(way) >= p(2)) return
    call hold(int(c), w, q, r)
    status = 3
    if (r(1) >= 0) return
    r(1) = 0
    call hold(int(c) - 1, w(2:, 2:), q(2:), r(2:))
  end subroutine one_contact

  !> How far it slid, as long as it is pressed.
  subroutine cairn_law_limited_slip_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n               !< contacts
    integer(c_int32_t), value           :: c               !< components
    type(cairn_law_context), intent(in) :: context         !< step
    real(c_double), intent(in)          :: gap(n)          !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)         !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)         !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own)  !< see laws.def
    real(c_double), intent(inout)       :: state(n, states(c)) !< slip [m]
    integer :: k
    do k = 1, c - 1
      where (r(:, 1) > 0) state(:, k) = state(:, k) + context%h*u(:, 1 + k)
    end do
  end subroutine cairn_law_limited_slip_commit
end module limited_slip
