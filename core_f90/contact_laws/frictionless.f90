!> Signorini: no penetration, no adhesion, no friction; an impact is inelastic (Moreau 1988).
module frictionless
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  implicit none
  private
  public :: cairn_law_frictionless_prepare
contains

  !> Local problem on a cone of zero width.
  subroutine cairn_law_frictionless_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, *)     !< none
    real(c_double), intent(inout)       :: state(n, *)      !< none
    real(c_double), intent(out)         :: bias(n, c)       !< (max(gap, 0)/h, 0, ...) [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< 0 [-]
    bias = 0
    bias(:, 1) = max(gap, 0.0_c_double)/context%h
    compliance = 0
    mu = 0
  end subroutine cairn_law_frictionless_prepare
end module frictionless
