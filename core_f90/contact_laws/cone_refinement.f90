!> Local solver of frictional contacts with full blocks (see coulomb_cone), eight at a time from the impulses of the sweep before.
module cone_refinement
  use, intrinsic :: iso_c_binding, only: c_double
  implicit none
  private
  public :: refine_cone3
  integer, parameter :: w8 = 8 !< contacts at a time: a register of doubles
contains

  !> Impulses of full 3 x 3 blocks from those of the sweep before: three steps of Newton's method, eight contacts at a time. Later
  !> sweeps reduce the rest, and a solution stays a solution.
  pure subroutine refine_cone3(n, c, w, u_free, mu, r)
    integer, value                :: n            !< contacts
    integer, value                :: c            !< 3, or more: further components are left alone
    real(c_double), intent(in)    :: w(n, c, c)   !< Delassus blocks [1/kg]
    real(c_double), intent(in)    :: u_free(n, c) !< relative velocity with r = 0 at this contact, bias included [m/s]
    real(c_double), intent(in)    :: mu(n)        !< friction [-]
    real(c_double), intent(inout) :: r(n, c)      !< impulse (n, t, s), before and after [N s]
    real(c_double) :: b(w8, 3, 3), q(w8, 3), friction(w8), p(w8, 3)
    integer :: first, lanes, i, k, l
    do first = 1, n, w8
      lanes = min(w8, n - first + 1)
      do l = 1, 3
        do k = 1, 3
          do i = 1, w8
            b(i, k, l) = w(first + min(i, lanes) - 1, k, l)
          end do
        end do
        do i = 1, w8
          q(i, l) = u_free(first + min(i, lanes) - 1, l)
          p(i, l) = r(first + min(i, lanes) - 1, l)
        end do
      end do
      do i = 1, w8
        friction(i) = mu(first + min(i, lanes) - 1)
      end do
      call refine_eight(b, q, friction, p)
      do l = 1, 3
        do i = 1, lanes
          r(first + i - 1, l) = p(i, l)
        end do
      end do
    end do
  end subroutine refine_cone3

  pure subroutine refine_eight(w, q, mu, r)
    real(c_double), intent(in)    :: w(w8, 3, 3) !< [1/kg]
    real(c_double), intent(in)    :: q(w8, 3)    !< [m/s]
    real(c_double), intent(in)    :: mu(w8)      !< [-]
    real(c_double), intent(inout) :: r(w8, 3)    !< [N s]
    integer, parameter :: steps = 3 !< of Newton's method: f is almost straight
    real(c_double), dimension(w8) :: v11, v21, v12, v22, p1, p2, a, high, m, f2, f3
    real(c_double) :: m11, m22, det, rn, rt, rs, d1, d2, dn, size, f, slope, normal, square, ut, us, e1, e2, least
    logical :: slips(w8), sticks, closed
    integer :: i, k
    least = tiny(least)
    !$omp simd private(m11, m22, det, rn, rt, rs, normal, square, ut, us, sticks, closed)
    do i = 1, w8
      m(i) = 1/w(i, 1, 1) ! divisions cost most of the time here
      f2(i) = w(i, 2, 1)*m(i)
      f3(i) = w(i, 3, 1)*m(i)
      normal = max(0.0_c_double, -q(i, 1)*m(i))
      v11(i) = w(i, 2, 2) - f2(i)*w(i, 1, 2)
      v21(i) = w(i, 3, 2) - f3(i)*w(i, 1, 2)
      v12(i) = w(i, 2, 3) - f2(i)*w(i, 1, 3)
      v22(i) = w(i, 3, 3) - f3(i)*w(i, 1, 3)
      p1(i) = q(i, 2) - f2(i)*q(i, 1)
      p2(i) = q(i, 3) - f3(i)*q(i, 1)
      det = 1/(v11(i)*v22(i) - v12(i)*v21(i))
      rt = -(v22(i)*p1(i) - v12(i)*p2(i))*det
      rs = -(v11(i)*p2(i) - v21(i)*p1(i))*det
      rn = -(q(i, 1) + w(i, 1, 2)*rt + w(i, 1, 3)*rs)*m(i)
      closed = q(i, 1) < 0
      sticks = closed .and. rn >= 0 .and. rt*rt + rs*rs <= mu(i)*mu(i)*rn*rn
      slips(i) = closed .and. mu(i) > 0 .and. .not. sticks
      ! a of the impulse before, or where |r_T| = mu r_n without coupling
      square = r(i, 2)*r(i, 2) + r(i, 3)*r(i, 3)
      ut = q(i, 2) + w(i, 2, 1)*r(i, 1) + w(i, 2, 2)*r(i, 2) + w(i, 2, 3)*r(i, 3)
      us = q(i, 3) + w(i, 3, 1)*r(i, 1) + w(i, 3, 2)*r(i, 2) + w(i, 3, 3)*r(i, 3)
      high(i) = sqrt(p1(i)*p1(i) + p2(i)*p2(i))/max(min(mu(i), 1.0_c_double)*normal, least)
      a(i) = -(ut*r(i, 2) + us*r(i, 3))/max(square, least)
      a(i) = merge(a(i), high(i), square > 0 .and. a(i) > 0 .and. a(i) < high(i))
      r(i, 1) = merge(rn, merge(normal, 0.0_c_double, closed), sticks)
      r(i, 2) = merge(rt, 0.0_c_double, sticks)
      r(i, 3) = merge(rs, 0.0_c_double, sticks)
    end do
    if (.not. any(slips)) return
    do k = 1, steps
      !$omp simd private(m11, m22, det, rn, rt, rs, d1, d2, dn, size, f, slope)
      do i = 1, w8
        m11 = v11(i) + a(i)
        m22 = v22(i) + a(i)
        det = 1/(m11*m22 - v12(i)*v21(i))
        rt = -(m22*p1(i) - v12(i)*p2(i))*det
        rs = -(m11*p2(i) - v21(i)*p1(i))*det
        d1 = -(m22*rt - v12(i)*rs)*det
        d2 = -(m11*rs - v21(i)*rt)*det
        rn = -(q(i, 1) + w(i, 1, 2)*rt + w(i, 1, 3)*rs)*m(i)
        dn = -(w(i, 1, 2)*d1 + w(i, 1, 3)*d2)*m(i)
        size = sqrt(rt*rt + rs*rs)
        f = size - mu(i)*rn
        slope = mu(i)*(rn*(rt*d1 + rs*d2) - dn*size*size) ! of f/size, times its cube
        ! where the normal opens, the root is beyond
        a(i) = merge(max(0.0_c_double, a(i) - f*size*size/merge(slope, -1.0_c_double, slope < 0)), 2*a(i) + high(i), &
                     rn > 0 .and. slope < 0)
      end do
    end do
    !$omp simd private(m11, m22, det, rt, rs, size, e1, e2, rn)
    do i = 1, w8
      m11 = v11(i) + a(i)
      m22 = v22(i) + a(i)
      det = m11*m22 - v12(i)*v21(i)
      rt = -(m22*p1(i) - v12(i)*p2(i))/det
      rs = -(m11*p2(i) - v21(i)*p1(i))/det
      size = max(sqrt(rt*rt + rs*rs), least)
      e1 = rt/size
      e2 = rs/size
      ! on the cone with u_n = 0
      rn = w(i, 1, 1) + mu(i)*(w(i, 1, 2)*e1 + w(i, 1, 3)*e2)
      rn = max(0.0_c_double, -q(i, 1))/merge(rn, w(i, 1, 1), rn > 0)
      r(i, 1) = merge(rn, r(i, 1), slips(i))
      r(i, 2) = merge(mu(i)*rn*e1, r(i, 2), slips(i))
      r(i, 3) = merge(mu(i)*rn*e2, r(i, 3), slips(i))
    end do
  end subroutine refine_eight
end module cone_refinement
