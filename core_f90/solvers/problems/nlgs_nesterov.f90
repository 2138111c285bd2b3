!> Sweeps that begin beyond the last one (Nesterov 1983), over the blocks of W: what extrapolated_sweep.f90 is for steps.
module nlgs_nesterov
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_nesterov_lean, cairn_nesterov_along
contains

  !> r = r + factor (r - r before), kept as the start of a sweep; with a factor of 0 `before` is not read.
  subroutine cairn_nesterov_lean(n, factor, before, r, start) bind(c)
    integer(c_int64_t), value     :: n         !< unknowns
    real(c_double), value         :: factor    !< [-]
    real(c_double), intent(inout) :: before(n) !< impulses when the last sweep began, then r as it came [N s]
    real(c_double), intent(inout) :: r(n)      !< impulses [N s]
    real(c_double), intent(out)   :: start(n)  !< impulses that the sweep begins with [N s]
    real(c_double) :: now
    integer(c_int64_t) :: i
    if (factor > 0) then
      !$omp simd private(now)
      do i = 1, n
        now = r(i)
        r(i) = now + factor*(now - before(i))
        before(i) = now
      end do
    else
      before = r
    end if
    start = r
  end subroutine cairn_nesterov_lean

  !> sum of W_NN (start - r).(r - before): above 0 where the way leads back (O'Donoghue & Candes 2015).
  subroutine cairn_nesterov_along(dim, contacts, w_nn, start, before, r, along) bind(c)
    integer(c_int32_t), value   :: dim                   !< components of a contact, 2 or 3
    integer(c_int64_t), value   :: contacts
    real(c_double), intent(in)  :: w_nn(contacts)        !< [1/kg]
    real(c_double), intent(in)  :: start(dim, contacts)  !< impulses that the sweep began with [N s]
    real(c_double), intent(in)  :: before(dim, contacts) !< impulses before that [N s]
    real(c_double), intent(in)  :: r(dim, contacts)      !< impulses [N s]
    real(c_double), intent(out) :: along                 !< [J]
    integer(c_int64_t) :: a
    along = 0
    do a = 1, contacts
      along = along + w_nn(a)*dot_product(start(:, a) - r(:, a), r(:, a) - before(:, a))
    end do
  end subroutine cairn_nesterov_along
end module nlgs_nesterov
