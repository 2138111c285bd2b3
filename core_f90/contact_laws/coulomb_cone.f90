!> Local solvers of one frictional contact, the rest of the system held fixed: u = W r + q, Coulomb's cone.
!> Find r in K with  u~ = u + (mu |u_T|, 0, 0) in K*,  r.u~ = 0  (De Saxce & Feng 1998). q holds the law's bias.
module coulomb_cone
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: cairn_cone_isotropic2, cairn_cone_isotropic3, cairn_cone_full2, cairn_cone_full3
contains

  !> W = diag(W_NN, W_TT): closed form.
  subroutine cairn_cone_isotropic2(n, c, w, u_free, bias, mu, state, r, status) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components
    real(c_double), intent(in)    :: w(n, 2)      !< W_NN, W_TT [1/kg]
    real(c_double), intent(in)    :: u_free(n, c) !< relative velocity with r = 0 at this contact, bias included [m/s]
    real(c_double), intent(in)    :: bias(n, c)   !< of the law, already in u_free [m/s]
    real(c_double), intent(in)    :: mu(n)        !< friction [-]
    real(c_double), intent(in)    :: state(n, *)  !< none
    real(c_double), intent(inout) :: r(n, c)      !< impulse (n, t) [N s]
    integer(c_int32_t), intent(out), optional :: status(n) !< left alone
    real(c_double) :: normal, limit
    integer :: i
    !$omp simd private(normal, limit)
    do i = 1, n
      normal = max(0.0_c_double, -u_free(i, 1)/w(i, 1))
      limit = mu(i)*normal
      r(i, 1) = normal
      r(i, 2) = min(limit, max(-limit, -u_free(i, 2)/w(i, 2)))
    end do
  end subroutine cairn_cone_isotropic2

  !> W = diag(W_NN, W_TT, W_TT): closed form.
  subroutine cairn_cone_isotropic3(n, c, w, u_free, bias, mu, state, r, status) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components
    real(c_double), intent(in)    :: w(n, 2)      !< W_NN, W_TT [1/kg]
    real(c_double), intent(in)    :: u_free(n, c) !< relative velocity with r = 0 at this contact, bias included [m/s]
    real(c_double), intent(in)    :: bias(n, c)   !< of the law, already in u_free [m/s]
    real(c_double), intent(in)    :: mu(n)        !< friction [-]
    real(c_double), intent(in)    :: state(n, *)  !< none
    real(c_double), intent(inout) :: r(n, c)      !< impulse (n, t, s) [N s]
    integer(c_int32_t), intent(out), optional :: status(n) !< left alone
    real(c_double) :: normal, limit, t, s, square, factor
    integer :: i
    !$omp simd private(normal, limit, t, s, square, factor)
    do i = 1, n
      normal = max(0.0_c_double, -u_free(i, 1)/w(i, 1))
      limit = mu(i)*normal
      t = -u_free(i, 2)/w(i, 2)
      s = -u_free(i, 3)/w(i, 2)
      square = t*t + s*s
      factor = merge(limit/sqrt(max(square, tiny(square))), 1.0_c_double, square > limit*limit)
      r(i, 1) = normal
      r(i, 2) = factor*t
      r(i, 3) = factor*s
    end do
  end subroutine cairn_cone_isotropic3

  !> Full 2 x 2 blocks: closed form. With q_n < 0 a solution always exists: it sticks, or slips against the tangential velocity
  !> that sticking would have to stop. Where mu is so large that there are several (Painleve), this is one of them.
  subroutine cairn_cone_full2(n, c, w, u_free, bias, mu, state, r, status) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< 2, or more: further components are left alone
    real(c_double), intent(in)    :: w(n, c, c)   !< Delassus blocks [1/kg]
    real(c_double), intent(in)    :: u_free(n, c) !< relative velocity with r = 0 at this contact, bias included [m/s]
    real(c_double), intent(in)    :: bias(n, c)   !< of the law, already in u_free [m/s]
    real(c_double), intent(in)    :: mu(n)        !< friction [-]
    real(c_double), intent(in)    :: state(n, *)  !< none
    real(c_double), intent(inout) :: r(n, c)      !< impulse (n, t) [N s]
    integer(c_int32_t), intent(out), optional :: status(n) !< left alone
    real(c_double) :: push, wt, qt, tangent, normal, side, m, under
    integer :: i
    !$omp simd private(push, wt, qt, tangent, normal, side, m, under)
    do i = 1, n
      push = max(0.0_c_double, -u_free(i, 1))
      wt = w(i, 2, 2) - w(i, 2, 1)*w(i, 1, 2)/w(i, 1, 1)
      qt = u_free(i, 2) - w(i, 2, 1)*u_free(i, 1)/w(i, 1, 1)
      tangent = -qt/wt
      normal = (push - w(i, 1, 2)*tangent)/w(i, 1, 1)
      side = sign(1.0_c_double, tangent)
      ! slip: (W_nn + side mu W_nt) r_n = push; divided by mu where mu is large
      m = mu(i)
      under = merge(w(i, 1, 1) + side*m*w(i, 1, 2), w(i, 1, 1)/max(m, 1.0_c_double) + side*w(i, 1, 2), m <= 1)
      under = push/max(under, tiny(under))
      if (.not. abs(tangent) <= m*normal) then ! no number, too: nothing resists along the tangent
        normal = merge(under, under/max(m, 1.0_c_double), m <= 1)
        tangent = side*merge(m*under, under, m <= 1)
      end if
      r(i, 1) = merge(normal, 0.0_c_double, push > 0)
      r(i, 2) = merge(tangent, 0.0_c_double, push > 0)
    end do
    if (present(status)) status = 0
  end subroutine cairn_cone_full2

  !> Full 3 x 3 blocks.
  subroutine cairn_cone_full3(n, c, w, u_free, bias, mu, state, r, status) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< 3, or more: further components are left alone
    real(c_double), intent(in)    :: w(n, c, c)   !< Delassus blocks [1/kg]
    real(c_double), intent(in)    :: u_free(n, c) !< relative velocity with r = 0 at this contact, bias included [m/s]
    real(c_double), intent(in)    :: bias(n, c)   !< of the law, already in u_free [m/s]
    real(c_double), intent(in)    :: mu(n)        !< friction [-]
    real(c_double), intent(in)    :: state(n, *)  !< none
    real(c_double), intent(inout) :: r(n, c)      !< impulse (n, t, s) [N s]
    integer(c_int32_t), intent(out), optional :: status(n) !< left alone
    integer :: i
    do i = 1, n
      call cone3(w(i, 1:3, 1:3), u_free(i, 1:3), mu(i), r(i, 1:3))
    end do
    if (present(status)) status = 0
  end subroutine cairn_cone_full3

  !> One contact in space. If it slips, u_T = -a r_T with some a > 0, and u_n = 0: with r_n eliminated,
  !> (V + a) r_T = -p and r_n = -(q_n + W_nT r_T)/W_nn are functions of a alone. |r_T| - mu r_n is positive at a = 0 (or it would
  !> stick) and negative as a grows (r_T -> 0, r_n -> -q_n/W_nn > 0): there is a root, and bisection guards Newton's search for it.
  pure subroutine cone3(w, q, mu, r)
    real(c_double), intent(in)  :: w(3, 3) !< Delassus block [1/kg]
    real(c_double), intent(in)  :: q(3)    !< relative velocity with r = 0, bias included [m/s]
    real(c_double), intent(in)  :: mu      !< friction [-]
    real(c_double), intent(out) :: r(3)    !< impulse (n, t, s) [N s]
    real(c_double) :: v(2, 2), p(2), low, high, a, next, f, slope
    integer :: i
    r = 0
    if (.not. q(1) < 0) return
    r(1) = -q(1)/w(1, 1)
    if (mu <= 0) return
    v(:, 1) = w(2:3, 2) - w(2:3, 1)*w(1, 2)/w(1, 1)
    v(:, 2) = w(2:3, 3) - w(2:3, 1)*w(1, 3)/w(1, 1)
    p = q(2:3) - w(2:3, 1)*q(1)/w(1, 1)
    call given(0.0_c_double, w, q, v, p, mu, r, f, slope)
    if (f <= 0) return
    low = 0
    high = length(p)/min(mu, 1.0_c_double)/r_n(w, q)
    do i = 1, 2000
      call given(high, w, q, v, p, mu, r, f, slope)
      if (f <= 0) exit
      low = high
      high = 2*high
    end do
    a = high
    do i = 1, 200
      if (abs(f) <= 4*epsilon(f)) exit ! rounding hides the a of a contact that barely slips
      next = a - f/slope
      if (.not. (next > low .and. next < high)) next = low + (high - low)/2
      if (next <= low .or. next >= high .or. abs(next - a) <= epsilon(a)*a) exit
      a = next
      call given(a, w, q, v, p, mu, r, f, slope)
      if (f > 0) then
        low = a
      else
        high = a
      end if
    end do
    call on_cone(w, q, mu, r)
  end subroutine cone3

  !> Impulse without friction.
  pure real(c_double) function r_n(w, q)
    real(c_double), intent(in) :: w(3, 3) !< Delassus block [1/kg]
    real(c_double), intent(in) :: q(3)    !< free velocity [m/s]
    r_n = -q(1)/w(1, 1)
  end function r_n

  !> Impulse r of a contact that slides with u_T = -a r_T, and f, by which it misses the cone: Newton's method finds f(a) = 0.
  pure subroutine given(a, w, q, v, p, mu, r, f, slope)
    real(c_double), intent(in)  :: a       !< u_T = -a r_T [1/kg]
    real(c_double), intent(in)  :: w(3, 3) !< Delassus block [1/kg]
    real(c_double), intent(in)  :: q(3)    !< free velocity [m/s]
    real(c_double), intent(in)  :: v(2, 2) !< tangential block, the normal eliminated [1/kg]
    real(c_double), intent(in)  :: p(2)    !< tangential free velocity, the normal eliminated [m/s]
    real(c_double), intent(in)  :: mu      !< friction [-]
    real(c_double), intent(out) :: r(3)    !< impulse [N s]
    real(c_double), intent(out) :: f       !< 1 - mu r_n/|r_T|, nearly linear in a; 1 where r_n <= 0 [-]
    real(c_double), intent(out) :: slope   !< df/da [kg]
    real(c_double) :: m(2, 2), determinant, d(2), size, dn
    m = v
    m(1, 1) = m(1, 1) + a
    m(2, 2) = m(2, 2) + a
    determinant = m(1, 1)*m(2, 2) - m(1, 2)*m(2, 1)
    r(2) = -(m(2, 2)*p(1) - m(1, 2)*p(2))/determinant
    r(3) = -(m(1, 1)*p(2) - m(2, 1)*p(1))/determinant
    d(1) = -(m(2, 2)*r(2) - m(1, 2)*r(3))/determinant
    d(2) = -(m(1, 1)*r(3) - m(2, 1)*r(2))/determinant
    r(1) = -(q(1) + w(1, 2)*r(2) + w(1, 3)*r(3))/w(1, 1)
    size = length(r(2:3))
    slope = 0
    if (size <= mu*r(1)) then
      f = min(0.0_c_double, size/(mu*r(1)) - 1)
    else
      f = 1
      if (r(1) > 0) f = 1 - min(1.0_c_double, mu*(r(1)/size))
    end if
    if (r(1) <= 0 .or. size <= 0) return
    dn = -(w(1, 2)*d(1) + w(1, 3)*d(2))/w(1, 1)
    f = 1 - mu*(r(1)/size)
    slope = mu*(r(1)*((r(2)*d(1) + r(3)*d(2))/size) - dn*size)/size**2
  end subroutine given

  !> Keeps the direction of slip, and puts the impulse on the cone with u_n = 0.
  pure subroutine on_cone(w, q, mu, r)
    real(c_double), intent(in)    :: w(3, 3) !< Delassus block [1/kg]
    real(c_double), intent(in)    :: q(3)    !< free velocity [m/s]
    real(c_double), intent(in)    :: mu      !< friction [-]
    real(c_double), intent(inout) :: r(3)    !< impulse [N s]
    real(c_double) :: size, e(2), across
    size = length(r(2:3))
    if (size <= 0) return
    e = r(2:3)/size
    across = w(1, 2)*e(1) + w(1, 3)*e(2)
    if (mu <= 1) then
      r(1) = -q(1)/(w(1, 1) + mu*across)
      r(2:3) = mu*r(1)*e
    else
      size = -q(1)/(w(1, 1)/mu + across)
      r(1) = size/mu
      r(2:3) = size*e
    end if
  end subroutine on_cone

  !> Length of a vector, every bit of it the same in units 2^k times as large; norm2 of some compilers takes 1 for a scale.
  pure real(c_double) function length(x)
    real(c_double), intent(in) :: x(2) !< any unit
    length = maxval(abs(x))
    if (length > 0) length = length*sqrt(sum((x/length)**2))
  end function length
end module coulomb_cone
