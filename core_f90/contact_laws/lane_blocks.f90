!> Small systems of many contacts at once, a lane each: elimination without pivots, as Delassus blocks, which are symmetric and at
!> least semidefinite, and these beside springs allow.
module lane_blocks
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: load_lanes, held_impulses, pushed_velocities, sprung_columns
  integer, parameter, public :: lanes = 8 !< contacts of a strip
contains

  !> Lanes of a strip of a column; those behind the last contact repeat it.
  pure subroutine load_lanes(n, first, x, strip)
    integer(c_int32_t), intent(in) :: n            !< contacts
    integer, intent(in)            :: first        !< of the strip, from 1
    real(c_double), intent(in)     :: x(n)         !< any unit
    real(c_double), intent(out)    :: strip(lanes) !< the same
    integer :: i
    do i = 1, lanes
      strip(i) = x(min(first + i - 1, n))
    end do
  end subroutine load_lanes

  !> Impulses that hold all components fast, r = -W^-1 u; a component that nothing moves (its pivot is rounding) carries nothing.
  pure subroutine held_impulses(n, c, w, u, r)
    integer(c_int32_t), intent(in) :: n          !< contacts
    integer(c_int32_t), intent(in) :: c          !< components, 3 or 6
    real(c_double), intent(in)     :: w(n, c, c) !< Delassus blocks [1/kg]
    real(c_double), intent(in)     :: u(n, c)    !< relative velocity with r = 0 [m/s]
    real(c_double), intent(out)    :: r(n, c)    !< [N s]
    real(c_double), parameter :: rounding = 16*epsilon(1.0_c_double)
    real(c_double) :: a(lanes, c, c), b(lanes, c, 1), least(lanes, c), i1, i2, i3, f2, f3, g, a22, a32, a33, x1, x2, x3
    integer :: i, k, l, first, last
    if (c == 3) then
      !$omp simd private(i1, i2, i3, f2, f3, g, a22, a32, a33, x1, x2, x3)
      do i = 1, n
        i1 = inverse_of(w(i, 1, 1), 0.0_c_double)
        f2 = w(i, 2, 1)*i1
        f3 = w(i, 3, 1)*i1
        a22 = w(i, 2, 2) - f2*w(i, 1, 2)
        a32 = w(i, 3, 2) - f3*w(i, 1, 2)
        i2 = inverse_of(a22, rounding*w(i, 2, 2))
        g = a32*i2
        a33 = (w(i, 3, 3) - f3*w(i, 1, 3)) - g*(w(i, 2, 3) - f2*w(i, 1, 3))
        i3 = inverse_of(a33, rounding*w(i, 3, 3))
        x1 = -u(i, 1)
        x2 = -u(i, 2) - f2*x1
        x3 = (-u(i, 3) - f3*x1 - g*x2)*i3
        x2 = (x2 - (w(i, 2, 3) - f2*w(i, 1, 3))*x3)*i2
        r(i, 1) = (x1 - w(i, 1, 2)*x2 - w(i, 1, 3)*x3)*i1
        r(i, 2) = x2
        r(i, 3) = x3
      end do
      return
    end if
    do first = 1, n, lanes
      last = min(n, first + lanes - 1)
      do l = 1, c
        do k = 1, c
          call load_lanes(n, first, w(:, k, l), a(:, k, l))
        end do
        least(:, l) = rounding*a(:, l, l)
        call load_lanes(n, first, u(:, l), b(:, l, 1))
        b(:, l, 1) = -b(:, l, 1)
      end do
      call eliminate(c, 1, a, least, b)
      do k = 1, c
        r(first:last, k) = b(:last - first + 1, k, 1)
      end do
    end do
  end subroutine held_impulses

  !> 1/x, or none where x is no more than what counts.
  elemental real(c_double) function inverse_of(x, least)
    !$omp declare simd
    real(c_double), intent(in) :: x, least !< any unit
    inverse_of = merge(1/merge(x, 1.0_c_double, x > least), 0.0_c_double, x > least)
  end function inverse_of

  !> Velocities beside springs r = -(spring u + pull) and a contact without friction: (1 + W K)^-1 makes of the free velocity that
  !> of the springs alone, and of the column of the normal what a push adds.
  pure subroutine pushed_velocities(n, c, w, q, spring, pull, u, push)
    integer(c_int32_t), intent(in) :: n            !< contacts
    integer(c_int32_t), intent(in) :: c            !< components, 2, 3 or 6
    real(c_double), intent(in)     :: w(n, c, c)   !< Delassus blocks [1/kg]
    real(c_double), intent(in)     :: q(n, c)      !< relative velocity with r = 0 [m/s]
    real(c_double), intent(in)     :: spring(n, c) !< [kg]
    real(c_double), intent(in)     :: pull(n, c)   !< [N s]
    real(c_double), intent(out)    :: u(n, c)      !< [m/s]
    real(c_double), intent(out)    :: push(n)      !< of the contact, along the normal [N s]
    real(c_double) :: x1, x2, x3, y1, y2, y3, m11, m12, m13, m22, m23, m32, m33, f, x(lanes, c, 2), p(lanes)
    integer :: i, k, first, last
    if (c == 2) then
      !$omp simd private(x1, x2, y1, y2, m11, m12, m22, f)
      do i = 1, n
        m11 = 1/(1 + w(i, 1, 1)*spring(i, 1))
        m12 = w(i, 1, 2)*spring(i, 2)
        f = w(i, 2, 1)*spring(i, 1)*m11
        m22 = 1/(1 + w(i, 2, 2)*spring(i, 2) - f*m12)
        x1 = q(i, 1) - w(i, 1, 1)*pull(i, 1) - w(i, 1, 2)*pull(i, 2)
        x2 = (q(i, 2) - w(i, 2, 1)*pull(i, 1) - w(i, 2, 2)*pull(i, 2) - f*x1)*m22
        x1 = (x1 - m12*x2)*m11
        y2 = (w(i, 2, 1) - f*w(i, 1, 1))*m22
        y1 = (w(i, 1, 1) - m12*y2)*m11
        push(i) = max(0.0_c_double, -x1/y1)
        u(i, 1) = merge(0.0_c_double, x1, push(i) > 0)
        u(i, 2) = x2 + y2*push(i)
      end do
      return
    end if
    if (c == 3) then
      !$omp simd private(x1, x2, x3, y1, y2, y3, m11, m12, m13, m22, m23, m32, m33, f)
      do i = 1, n
        x1 = q(i, 1) - w(i, 1, 1)*pull(i, 1) - w(i, 1, 2)*pull(i, 2) - w(i, 1, 3)*pull(i, 3)
        x2 = q(i, 2) - w(i, 2, 1)*pull(i, 1) - w(i, 2, 2)*pull(i, 2) - w(i, 2, 3)*pull(i, 3)
        x3 = q(i, 3) - w(i, 3, 1)*pull(i, 1) - w(i, 3, 2)*pull(i, 2) - w(i, 3, 3)*pull(i, 3)
        m11 = 1/(1 + w(i, 1, 1)*spring(i, 1))
        m12 = w(i, 1, 2)*spring(i, 2)
        m13 = w(i, 1, 3)*spring(i, 3)
        f = w(i, 2, 1)*spring(i, 1)*m11
        m22 = 1/(1 + w(i, 2, 2)*spring(i, 2) - f*m12)
        m23 = w(i, 2, 3)*spring(i, 3) - f*m13
        x2 = x2 - f*x1
        y2 = w(i, 2, 1) - f*w(i, 1, 1)
        f = w(i, 3, 1)*spring(i, 1)*m11
        m32 = w(i, 3, 2)*spring(i, 2) - f*m12
        m33 = 1 + w(i, 3, 3)*spring(i, 3) - f*m13
        x3 = x3 - f*x1
        y3 = w(i, 3, 1) - f*w(i, 1, 1)
        f = m32*m22
        m33 = 1/(m33 - f*m23)
        x3 = (x3 - f*x2)*m33
        y3 = (y3 - f*y2)*m33
        x2 = (x2 - m23*x3)*m22
        y2 = (y2 - m23*y3)*m22
        x1 = (x1 - m12*x2 - m13*x3)*m11
        y1 = (w(i, 1, 1) - m12*y2 - m13*y3)*m11
        push(i) = max(0.0_c_double, -x1/y1)
        u(i, 1) = merge(0.0_c_double, x1, push(i) > 0)
        u(i, 2) = x2 + y2*push(i)
        u(i, 3) = x3 + y3*push(i)
      end do
      return
    end if
    do first = 1, n, lanes
      last = min(n, first + lanes - 1)
      call sprung_columns(n, c, first, w, q, spring, pull, 1, x)
      p = max(0.0_c_double, -x(:, 1, 1)/x(:, 1, 2))
      push(first:last) = p(:last - first + 1)
      do k = 1, c
        x(:, k, 1) = x(:, k, 1) + x(:, k, 2)*p
        u(first:last, k) = x(:last - first + 1, k, 1)
      end do
    end do
  end subroutine pushed_velocities

  !> Solves a strip of contacts with springs: (1 + W K)^-1 (q - W pull), and columns of (1 + W K)^-1 W.
  pure subroutine sprung_columns(n, c, first, w, q, spring, pull, columns, x)
    integer(c_int32_t), intent(in) :: n                        !< contacts
    integer(c_int32_t), intent(in) :: c                        !< components, 3 or 6
    integer, intent(in)            :: first                    !< of the strip, from 1
    real(c_double), intent(in)     :: w(n, c, c)               !< Delassus blocks [1/kg]
    real(c_double), intent(in)     :: q(n, c)                  !< relative velocity with r = 0 [m/s]
    real(c_double), intent(in)     :: spring(n, c)             !< [kg]
    real(c_double), intent(in)     :: pull(n, c)               !< [N s]
    integer, intent(in)            :: columns                  !< of the second, from the first on
    real(c_double), intent(out)    :: x(lanes, c, 1 + columns) !< [m/s], [1/kg]
    real(c_double) :: a(lanes, c, c), least(lanes, c), w_kl(lanes), spring_l(lanes), pull_l(lanes)
    integer :: k, l
    do k = 1, c
      call load_lanes(n, first, q(:, k), x(:, k, 1))
    end do
    do l = 1, c
      call load_lanes(n, first, spring(:, l), spring_l)
      call load_lanes(n, first, pull(:, l), pull_l)
      do k = 1, c
        call load_lanes(n, first, w(:, k, l), w_kl)
        a(:, k, l) = w_kl*spring_l
        x(:, k, 1) = x(:, k, 1) - w_kl*pull_l
        if (l <= columns) x(:, k, 1 + l) = w_kl
      end do
      a(:, l, l) = a(:, l, l) + 1
    end do
    least = 0
    call eliminate(c, 1 + columns, a, least, x)
  end subroutine sprung_columns

  !> b = a^-1 b; where a pivot is no more than the least that counts, that component is 0.
  pure subroutine eliminate(c, columns, a, least, b)
    integer(c_int32_t), intent(in) :: c                 !< components
    integer, intent(in)            :: columns
    real(c_double), intent(inout)  :: a(lanes, c, c)    !< any unit
    real(c_double), intent(in)     :: least(lanes, c)
    real(c_double), intent(inout)  :: b(lanes, c, columns)
    real(c_double) :: inverse(lanes, c), f(lanes)
    integer :: j, k, l
    do k = 1, c
      inverse(:, k) = inverse_of(a(:, k, k), least(:, k))
      do l = k + 1, c
        f = a(:, l, k)*inverse(:, k)
        do j = k + 1, c
          a(:, l, j) = a(:, l, j) - f*a(:, k, j)
        end do
        do j = 1, columns
          b(:, l, j) = b(:, l, j) - f*b(:, k, j)
        end do
      end do
    end do
    do j = 1, columns
      do k = c, 1, -1
        f = b(:, k, j)
        do l = k + 1, c
          f = f - a(:, k, l)*b(:, l, j)
        end do
        b(:, k, j) = f*inverse(:, k)
      end do
    end do
  end subroutine eliminate
end module lane_blocks
