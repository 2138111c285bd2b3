!> Preconditioner of the conjugate projected gradient (Renouf & Alart 2005): a scalar per contact, so that cones and their
!> projections are unchanged.
module preconditioned_conjugate_gradient
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_contact_scales
contains

  !> rho = dim / trace of the contact's own block.
  subroutine cairn_contact_scales(dim, n, block, place, rho) bind(c)
    integer(c_int32_t), value      :: dim      !< components of a contact, 2 or 3
    integer(c_int64_t), value      :: n        !< contacts
    real(c_double), intent(in)     :: block(dim, dim, *) !< of W [1/kg]
    integer(c_int64_t), intent(in) :: place(n) !< of the diagonal blocks, from 0
    real(c_double), intent(out)    :: rho(n)   !< [kg]
    real(c_double) :: trace
    integer(c_int64_t) :: a
    integer :: k
    do a = 1, n
      trace = 0
      do k = 1, dim
        trace = trace + max(0.0_c_double, block(k, k, place(a) + 1))
      end do
      rho(a) = dim/trace
    end do
  end subroutine cairn_contact_scales
end module preconditioned_conjugate_gradient
