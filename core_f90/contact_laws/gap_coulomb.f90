!> Signorini-Coulomb on the gap at the end of the step: overlap is pushed back within the step, which gives energy.
!> Condition on u_n + gap/h (the GAP_SGR_CLB of LMGC90; Jean 1999).
module gap_coulomb
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  implicit none
  private
  public :: cairn_law_gap_coulomb_prepare
contains

  !> Local problem on Coulomb's cone.
  subroutine cairn_law_gap_coulomb_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, 1)     !< friction [-]
    real(c_double), intent(inout)       :: state(n, *)      !< none
    real(c_double), intent(out)         :: bias(n, c)       !< (gap/h, 0, ...) [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    bias = 0
    bias(:, 1) = gap/context%h
    compliance = 0
    mu = params(:, 1)
  end subroutine cairn_law_gap_coulomb_prepare
end module gap_coulomb
