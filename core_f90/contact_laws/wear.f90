!> Signorini-Coulomb on surfaces that wear (Archard 1953): the volume that a contact loses is k F ds, over its area a depth that
!> its gap
!> gains for good.
module wear
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  implicit none
  private
  public :: cairn_law_wear_prepare, cairn_law_wear_commit
  integer, parameter :: own = 3 !< parameters
contains

  !> Local problem of Signorini-Coulomb, with the worn gap.
  subroutine cairn_law_wear_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, 2)     !< depth worn [m]; volume worn [m3]
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    integer :: i
    bias = 0
    compliance = 0
    do i = 1, n
      bias(i, 1) = max(gap(i) + state(i, 1), 0.0_c_double)/context%h
      if (params(i, 3) > 0) bias(i, 1) = (gap(i) + state(i, 1))/context%h
      mu(i) = params(i, 1)
    end do
  end subroutine cairn_law_wear_prepare

  !> Volume k r_N |u_T|, r_N an impulse.
  subroutine cairn_law_wear_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see laws.def
    real(c_double), intent(inout)       :: state(n, 2)   !< depth worn [m]; volume worn [m3]
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: volume
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    do i = 1, n
      volume = params(i, 2)*max(0.0_c_double, r(i, 1))*sqrt(sum(u(i, 2:)**2))
      state(i, 2) = state(i, 2) + volume
      if (geometry(i, 1) > 0) state(i, 1) = state(i, 1) + volume/geometry(i, 1)
    end do
  end subroutine cairn_law_wear_commit
end module wear
