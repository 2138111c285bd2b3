!> Velocity Signorini with Newton's restitution, normal and tangential: a contact that touches at detection obeys Coulomb's cone
!> in u+ + e u- (Moreau 1988); one that does not is open. With friction it can make energy (Kane 1984): that is reported.
!> Where nothing rebounds, a gap that would close within the step ends on the surface, as with signorini_coulomb: no rebound
!> would bring the bodies up again. LMGC90's RST_CLB has no such rule.
module newton_restitution
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  implicit none
  private
  public :: cairn_law_newton_restitution_prepare
contains

  !> Local problem on Coulomb's cone.
  subroutine cairn_law_newton_restitution_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, 4)     !< friction, normal and tangential restitution [-], whether a gap closes
    real(c_double), intent(inout)       :: state(n, *)      !< none
    real(c_double), intent(out)         :: bias(n, c)       !< (e_n u_n, e_t u_T); not active: so large that it stays open [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    integer :: i
    do i = 1, n
      bias(i, :) = params(i, 3)*u_begin(i, :)
      bias(i, 1) = params(i, 2)*u_begin(i, 1)
      if (gap(i) > 0) then
        bias(i, :) = 0
        bias(i, 1) = sqrt(huge(gap))
        if (params(i, 4) > 0 .and. .not. (params(i, 2) > 0 .or. abs(params(i, 3)) > 0)) bias(i, 1) = gap(i)/context%h
      end if
    end do
    compliance = 0
    mu = params(:, 1)
  end subroutine cairn_law_newton_restitution_prepare
end module newton_restitution
