!> Local problem of a contact with the others fixed, from a prepared block: find r in K with u = W r + q, u + (mu |u_T|, 0, 0) in K*
!> and both orthogonal (De Saxce & Feng 1998). Same solution as coulomb_cone's, for sweeps that return to the same block many times.
module contact_block
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: prepare_block2, solve_block2, prepare_block3, solve_block3, contact_block_size
  integer, parameter :: contact_block_size = 16
contains

  !> The same in the plane.
  pure subroutine prepare_block2(w, local)
    real(c_double), intent(in)  :: w(2, 2)                   !< Delassus block, W_NN > 0 [1/kg]
    real(c_double), intent(out) :: local(contact_block_size) !< 1/W_NN, W_NT/W_NN, W_TN/W_NN, 1/V, W_NN, unused
    real(c_double) :: least
    local = 0
    local(1) = 1/w(1, 1)
    local(2) = w(1, 2)*local(1)
    local(3) = w(2, 1)*local(1)
    ! a tangent that cannot move takes what rounding leaves of its block
    least = 4*epsilon(least)*max(w(1, 1), abs(w(2, 2)))
    local(4) = 1/max(w(2, 2) - local(3)*w(1, 2), least)
    local(5) = w(1, 1)
  end subroutine prepare_block2

  !> It sticks, or slips against the tangential velocity that sticking would have to stop. Where mu is so large that there are
  !> several solutions (Painleve), this is one of them.
  pure subroutine solve_block2(local, q, mu, r)
    real(c_double), intent(in)  :: local(contact_block_size) !< of prepare_block2
    real(c_double), intent(in)  :: q(2)                      !< velocity with r = 0 at this contact [m/s]
    real(c_double), intent(in)  :: mu                        !< friction [-]
    real(c_double), intent(out) :: r(2)                      !< impulse [N s]
    real(c_double) :: push, side, under
    r = 0
    push = -q(1)*local(1)
    if (.not. push > 0) return
    r(2) = -(q(2) - local(3)*q(1))*local(4)
    r(1) = push - local(2)*r(2)
    if (abs(r(2)) <= mu*r(1)) return
    side = sign(1.0_c_double, r(2))
    if (mu <= 1) then
      under = 1 + side*mu*local(2)
      r(1) = push/max(under, tiny(under))
      r(2) = side*mu*r(1)
    else ! divided by mu where mu is large
      under = 1/mu + side*local(2)
      under = push/max(under, tiny(under))
      r(1) = under/mu
      r(2) = side*under
    end if
  end subroutine solve_block2

  !> Tangential block V with the normal eliminated, and its inverse.
  pure subroutine prepare_block3(w, local)
    real(c_double), intent(in)  :: w(3, 3)            !< Delassus block, W_NN > 0 [1/kg]
    real(c_double), intent(out) :: local(contact_block_size) !< 1/W_NN, W_NT (2), W_TN/W_NN (2), V (4), V^-1 (4), unused
    real(c_double) :: v(2, 2), determinant, least
    local = 0
    local(1) = 1/w(1, 1)
    local(2:3) = w(1, 2:3)
    local(4:5) = w(2:3, 1)*local(1)
    v(:, 1) = w(2:3, 2) - local(4:5)*w(1, 2)
    v(:, 2) = w(2:3, 3) - local(4:5)*w(1, 3)
    local(6:9) = [v(1, 1), v(2, 1), v(1, 2), v(2, 2)]
    ! a tangent that cannot move takes what rounding leaves of its block
    least = 4*epsilon(least)*max(w(1, 1), abs(w(2, 2)), abs(w(3, 3)))
    v(1, 1) = max(v(1, 1), least)
    v(2, 2) = max(v(2, 2), least)
    determinant = max(v(1, 1)*v(2, 2) - v(1, 2)*v(2, 1), 4*epsilon(least)*v(1, 1)*v(2, 2))
    local(10:13) = [v(2, 2), -v(2, 1), -v(1, 2), v(1, 1)]/determinant
  end subroutine prepare_block3

  !> In slip, u_T = -a r_T with some a > 0, and u_N = 0. With r_N eliminated, (V + a) r_T = -p, and 1 - mu r_N/|r_T| is positive at
  !> a = 0 (otherwise it sticks) and negative for large a: bracketed Newton search for its root.
  pure subroutine solve_block3(local, q, mu, slip, r)
    real(c_double), intent(in)    :: local(contact_block_size) !< of prepare_block3
    real(c_double), intent(in)    :: q(3)               !< velocity with r = 0 at this contact [m/s]
    real(c_double), intent(in)    :: mu                 !< friction [-]
    real(c_double), intent(inout) :: slip               !< a where it slipped last, to begin from; 0 if it did not [1/kg]
    real(c_double), intent(out)   :: r(3)               !< impulse [N s]
    real(c_double) :: p(2), low, high, a, next, f, slope
    real(c_double), parameter :: close = 1e-5_c_double
    logical :: slips, near
    integer :: i
    r = 0
    if (.not. q(1) < 0) return
    if (.not. mu > 0) then
      r(1) = -q(1)*local(1)
      return
    end if
    p = q(2:3) - local(4:5)*q(1)
    r(2) = -(local(10)*p(1) + local(12)*p(2))
    r(3) = -(local(11)*p(1) + local(13)*p(2))
    r(1) = -(q(1) + local(2)*r(2) + local(3)*r(3))*local(1)
    if (r(2)**2 + r(3)**2 <= (mu*max(r(1), 0.0_c_double))**2) return
    low = 0
    high = huge(high)
    a = slip
    if (.not. a > 0) a = sqrt(p(1)**2 + p(2)**2)/(-q(1)*local(1)*min(mu, 1.0_c_double))
    slips = a > 0
    do i = 1, 200
      if (.not. slips) exit
      call residual(a, local, q, p, mu, r, f, slope)
      if (abs(f) <= 4*epsilon(f)) exit ! rounding hides the a of a contact that barely slips
      if (f > 0) then
        low = a
      else
        high = a
      end if
      next = a - f/slope
      ! there is no bracket round an a that is exact, which a bisection would leave
      near = slope < 0 .and. abs(next - a) <= close*a
      if (.not. (near .or. (slope < 0 .and. next > low .and. next < high))) then
        next = 2*a
        if (high < huge(high)) next = low + (high - low)/2
        if (next <= low .or. next >= high) exit
        near = abs(next - a) <= close*a
      end if
      a = next
      if (near) then ! its square is far below what a sweep changes, and the next one begins from it
        call residual(a, local, q, p, mu, r, f, slope)
        exit
      end if
    end do
    slip = a
    call put_on_cone(local, q, mu, r)
  end subroutine solve_block3

  pure subroutine residual(a, local, q, p, mu, r, f, slope)
    real(c_double), intent(in)  :: a                  !< u_T = -a r_T [1/kg]
    real(c_double), intent(in)  :: local(contact_block_size) !< of prepare_block3
    real(c_double), intent(in)  :: q(3)               !< free velocity [m/s]
    real(c_double), intent(in)  :: p(2)               !< tangential free velocity, the normal eliminated [m/s]
    real(c_double), intent(in)  :: mu                 !< friction [-]
    real(c_double), intent(out) :: r(3)               !< impulse [N s]
    real(c_double), intent(out) :: f                  !< 1 - mu r_N/|r_T|, or 1 where r_N <= 0 [-]
    real(c_double), intent(out) :: slope              !< df/da, or 0 where it leads nowhere [kg]
    real(c_double) :: v11, v22, inverse, d(2), square, length, dn
    v11 = local(6) + a
    v22 = local(9) + a
    inverse = 1/(v11*v22 - local(7)*local(8))
    r(2) = -(v22*p(1) - local(8)*p(2))*inverse
    r(3) = -(v11*p(2) - local(7)*p(1))*inverse
    r(1) = -(q(1) + local(2)*r(2) + local(3)*r(3))*local(1)
    f = 1
    slope = 0
    square = r(2)**2 + r(3)**2
    if (r(1) <= 0) return
    if (.not. square > 0) then
      f = -1
      return
    end if
    d(1) = -(v22*r(2) - local(8)*r(3))*inverse
    d(2) = -(v11*r(3) - local(7)*r(2))*inverse
    dn = -(local(2)*d(1) + local(3)*d(2))*local(1)
    length = 1/sqrt(square)
    f = 1 - mu*r(1)*length
    ! f falls with a
    slope = mu*length*(r(1)*(r(2)*d(1) + r(3)*d(2))*length**2 - dn)
  end subroutine residual

  !> Keeps the direction of slip, and puts the impulse on the cone with u_N = 0. Divided by mu where mu is large.
  pure subroutine put_on_cone(local, q, mu, r)
    real(c_double), intent(in)    :: local(contact_block_size) !< of prepare_block3
    real(c_double), intent(in)    :: q(3)               !< free velocity [m/s]
    real(c_double), intent(in)    :: mu                 !< friction [-]
    real(c_double), intent(inout) :: r(3)               !< impulse [N s]
    real(c_double) :: length, e(2), across, under
    length = sqrt(r(2)**2 + r(3)**2)
    if (.not. length > 0) return
    e = r(2:3)/length
    across = (local(2)*e(1) + local(3)*e(2))*local(1)
    if (mu <= 1) then
      under = 1 + mu*across
      if (.not. under > 0) return
      r(1) = -q(1)*local(1)/under
      r(2:3) = mu*r(1)*e
    else
      under = 1/mu + across
      if (.not. under > 0) return
      length = -q(1)*local(1)/under
      r(1) = length/mu
      r(2:3) = length*e
    end if
  end subroutine put_on_cone
end module contact_block
