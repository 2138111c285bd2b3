!> Impulses that stop some components of one contact.
module held_components
  use, intrinsic :: iso_c_binding, only: c_double
  implicit none
  private
  public :: hold
contains

  !> r = -W^-1 q by elimination without pivots, W symmetric; a component that nothing moves carries nothing.
  pure subroutine hold(m, w, q, r)
    integer, intent(in)         :: m       !< components, 3 at most
    real(c_double), intent(in)  :: w(m, m) !< Delassus block [1/kg]
    real(c_double), intent(in)  :: q(m)    !< velocity with r = 0 [m/s]
    real(c_double), intent(out) :: r(m)    !< [N s]
    real(c_double) :: a(3, 3), b(3), share
    integer :: k, l
    a(:m, :m) = w
    b(:m) = -q
    do k = 1, m
      if (.not. a(k, k) > 16*epsilon(share)*w(k, k)) cycle
      do l = k + 1, m
        share = a(l, k)/a(k, k)
        a(l, k + 1:m) = a(l, k + 1:m) - share*a(k, k + 1:m)
        b(l) = b(l) - share*b(k)
      end do
    end do
    do k = m, 1, -1
      r(k) = 0
      if (a(k, k) > 16*epsilon(share)*w(k, k)) r(k) = (b(k) - dot_product(a(k, k + 1:m), r(k + 1:m)))/a(k, k)
    end do
  end subroutine hold
end module held_components
