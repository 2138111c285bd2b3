!> Local solver of a contact with r_N >= 0 and friction in blocks, each bounded by its own limit that grows with r_N: a force along
!> the tangents, |r_T| <= mu_1 r_N + k_1, a moment about the normal (twisting) and a moment across it (rolling). Components: n, t,
!> then the rotation in the plane; n, t, s, then rotations about n, t and s in space.
module block_cones
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: solve_blocks, map_blocks, status_of_blocks, solve_plain, map_sliding
  integer, parameter, public :: strip = 8 !< contacts at a time: a register of doubles
contains

  !> Places of the blocks beside the normal: sliding, twisting, rolling; none: first > last.
  pure subroutine places(c, first, last)
    integer(c_int32_t), intent(in) :: c !< components
    integer, intent(out)           :: first(3), last(3)
    first = [2, 1, 1]
    last = [2, 0, 0]
    if (c == 6 .or. c == 3) last(1) = 3
    if (c == 6) then
      first(2:) = [4, 5]
      last(2:) = [4, 6]
    end if
  end subroutine places

  !> The same of a contact in the plane with its rotation, which has as many components as one in space without.
  pure subroutine places_of(c, plane, first, last)
    integer(c_int32_t), intent(in) :: c     !< components
    logical, intent(in)            :: plane !< c = 3 is n, t and the rotation
    integer, intent(out)           :: first(3), last(3)
    call places(c, first, last)
    if (plane .and. c == 3) then
      last(1) = 2
      first(3) = 3
      last(3) = 3
    end if
  end subroutine places_of

  !> Tries sticking in all blocks first; else solves normal and blocks in turn, each exactly, until only last digits change. Mostly
  !> a single motion couples them (sliding against rolling), along which changes shrink geometrically: every third turn extrapolates
  !> by that ratio (Irons and Tuck 1969), as long as changes shrink from extrapolation to extrapolation. What takes more than a few
  !> turns begins again from a solution by Newton's method, if there is one near.
  pure subroutine solve_blocks(c, plane, w, q, mu, k, r, start)
    integer(c_int32_t), intent(in) :: c       !< components
    logical, intent(in)            :: plane   !< c = 3 is n, t and the rotation
    real(c_double), intent(in)     :: w(c, c) !< Delassus block [1/kg]
    real(c_double), intent(in)     :: q(c)    !< velocity with r = 0 [m/s, rad/s]
    real(c_double), intent(in)     :: mu(3)   !< sliding [-], twisting and rolling [m]
    real(c_double), intent(in)     :: k(3)    !< of the limits, without a normal impulse [N s, N m s]
    real(c_double), intent(out)    :: r(c)    !< [N s, N m s]
    real(c_double), intent(in), optional :: start(c) !< impulses near the solution, as of the sweep before [N s, N m s]
    integer :: first(3), last(3)
    if (c == 6) then
      call turns_in_space(w, q, mu, k, r, start)
    else if (c == 3 .and. plane) then
      call turns_in_plane(w, q, mu, k, r, start)
    else
      call places_of(c, plane, first, last)
      call turns(c, first, last, w, q, mu, k, r, start)
    end if
  end subroutine solve_blocks

  !> A contact in space with its rotations.
  pure subroutine turns_in_space(w, q, mu, k, r, start)
    integer(c_int32_t), parameter :: c = 6
    integer, parameter :: first(3) = [2, 4, 5], last(3) = [3, 4, 6]
    include "block_turns.inc"
  end subroutine turns_in_space

  !> A contact in the plane with its rotation.
  pure subroutine turns_in_plane(w, q, mu, k, r, start)
    integer(c_int32_t), parameter :: c = 3
    integer, parameter :: first(3) = [2, 1, 3], last(3) = [2, 0, 3]
    include "block_turns.inc"
  end subroutine turns_in_plane

  !> Any other.
  pure subroutine turns(c, first, last, w, q, mu, k, r, start)
    integer(c_int32_t), intent(in) :: c                  !< components
    integer, intent(in)            :: first(3), last(3)  !< see places_of
    include "block_turns.inc"
  end subroutine turns

  !> V^-1 b of a symmetric V; where V moves along one direction alone, V = l d d', the shortest answer, V b/l**2.
  pure function solution(v11, v22, v12, b) result(x)
    real(c_double), intent(in) :: v11, v22, v12 !< [1/kg]
    real(c_double), intent(in) :: b(2)          !< [m/s]
    real(c_double) :: x(2), determinant
    determinant = v11*v22 - v12*v12
    if (determinant > 16*epsilon(determinant)*v11*v22) then
      x = [v22*b(1) - v12*b(2), v11*b(2) - v12*b(1)]/determinant
    else
      x = [v11*b(1) + v12*b(2), v12*b(1) + v22*b(2)]/(v11 + v22)**2
    end if
  end function solution

  !> r - P(r - u/W_kk), block by block (Alart & Curnier 1991).
  pure subroutine map_blocks(c, plane, w, u, mu, k, r, f)
    integer(c_int32_t), intent(in) :: c       !< components
    logical, intent(in)            :: plane   !< c = 3 is n, t and the rotation
    real(c_double), intent(in)     :: w(c, c) !< Delassus block [1/kg]
    real(c_double), intent(in)     :: u(c)    !< velocity that r leaves [m/s, rad/s]
    real(c_double), intent(in)     :: mu(3), k(3) !< as above
    real(c_double), intent(in)     :: r(c)    !< [N s, N m s]
    real(c_double), intent(out)    :: f(c)    !< [N s, N m s]
    real(c_double) :: z(2), normal, limit, size, most
    integer :: b, l, m, first(3), last(3)
    call places_of(c, plane, first, last)
    normal = max(0.0_c_double, r(1) - u(1)/w(1, 1))
    f(1) = r(1) - normal
    do b = 1, 3
      m = last(b) - first(b) + 1
      if (m < 1) cycle
      most = 0
      do l = first(b), last(b)
        most = max(most, w(l, l))
      end do
      z = 0
      z(1:m) = r(first(b):last(b))
      if (most > 0) z(1:m) = z(1:m) - u(first(b):last(b))/most
      limit = mu(b)*normal + k(b)
      size = length(z)
      if (size > limit) z = (limit/size)*z
      f(first(b):last(b)) = r(first(b):last(b)) - z(1:m)
    end do
  end subroutine map_blocks

  !> Sliding contacts whose parts do not couple, W = diag(W_NN, W_TT, W_TT), as of balls: closed form of a strip of contacts. What
  !> solve_blocks finds, to rounding. Impulses of the others are left alone.
  pure subroutine solve_plain(n, c, first, w, u_free, pull, mu, k, r, plain)
    integer(c_int32_t), intent(in) :: n            !< contacts
    integer(c_int32_t), intent(in) :: c            !< components, 2 or 3
    integer, intent(in)            :: first        !< contact of the strip, from 1
    real(c_double), intent(in)     :: w(n, c, c)   !< Delassus blocks [1/kg]
    real(c_double), intent(in)     :: u_free(n, c) !< velocity with r = 0 [m/s]
    real(c_double), intent(in)     :: pull(strip)  !< impulse that draws the bodies together, not part of the limits [N s]
    real(c_double), intent(in)     :: mu(strip), k(strip) !< |r_T| <= mu (r_N + pull) + k [-, N s]
    real(c_double), intent(inout)  :: r(n, c)      !< [N s]
    logical, intent(out)           :: plain(strip) !< solved here; none behind the last contact
    real(c_double), dimension(strip) :: wn, wt, coupled, qn, qt, qs, rn, rt, rs
    real(c_double) :: limit, t, s, most, size, factor
    integer :: i, j
    qs = 0
    if (first + strip - 1 <= n) then
      do j = 1, strip
        i = first + j - 1
        wn(j) = w(i, 1, 1)
        wt(j) = w(i, 2, 2)
        coupled(j) = abs(w(i, 1, 2)) + abs(w(i, 2, 1))
        qn(j) = u_free(i, 1)
        qt(j) = u_free(i, 2)
      end do
      if (c == 3) then
        do j = 1, strip
          i = first + j - 1
          coupled(j) = coupled(j) + (abs(w(i, 1, 3)) + abs(w(i, 2, 3)) + abs(w(i, 3, 1)) + abs(w(i, 3, 2)) + &
                                     abs(w(i, 3, 3) - w(i, 2, 2)))
          qs(j) = u_free(i, 3)
        end do
      end if
    else
      do j = 1, strip
        i = min(first + j - 1, n)
        wn(j) = w(i, 1, 1)
        wt(j) = w(i, 2, 2)
        coupled(j) = abs(w(i, 1, 2)) + abs(w(i, 2, 1))
        if (c == 3) coupled(j) = coupled(j) + (abs(w(i, 1, 3)) + abs(w(i, 2, 3)) + abs(w(i, 3, 1)) + abs(w(i, 3, 2)) + &
                                               abs(w(i, 3, 3) - w(i, 2, 2)))
        qn(j) = u_free(i, 1)
        qt(j) = u_free(i, 2)
        if (c == 3) qs(j) = u_free(i, 3)
      end do
    end if
    !$omp simd private(limit, t, s, most, size, factor)
    do j = 1, strip
      rn(j) = max(0.0_c_double, -(qn(j) - wn(j)*pull(j))/wn(j))
      limit = merge(mu(j)*rn(j), 0.0_c_double, rn(j) > 0) + k(j)
      t = -qt(j)/wt(j)
      s = -qs(j)/wt(j)
      most = max(abs(t), abs(s), tiny(most)) ! squares of small impulses would be none
      size = most*sqrt((t/most)**2 + (s/most)**2)
      factor = merge(limit/size, 1.0_c_double, size > limit)
      rn(j) = rn(j) - pull(j)
      rt(j) = factor*t
      rs(j) = factor*s
    end do
    do j = 1, strip
      plain(j) = first + j - 1 <= n .and. wn(j) > 0 .and. wt(j) > 0 .and. coupled(j) <= 0
    end do
    do j = 1, strip
      if (.not. plain(j)) cycle
      i = first + j - 1
      r(i, 1) = rn(j)
      r(i, 2) = rt(j)
      if (c == 3) r(i, 3) = rs(j)
    end do
  end subroutine solve_plain

  !> r - P(r - u/W_kk) of a strip of sliding contacts (see map_blocks).
  pure subroutine map_sliding(n, c, first, w, u, pull, mu, k, r, f)
    integer(c_int32_t), intent(in) :: n           !< contacts
    integer(c_int32_t), intent(in) :: c           !< components, 2 or 3
    integer, intent(in)            :: first       !< contact of the strip, from 1
    real(c_double), intent(in)     :: w(n, c, c)  !< Delassus blocks [1/kg]
    real(c_double), intent(in)     :: u(n, c)     !< velocity that r leaves [m/s]
    real(c_double), intent(in)     :: pull(strip), mu(strip), k(strip) !< see solve_plain
    real(c_double), intent(in)     :: r(n, c)     !< [N s]
    real(c_double), intent(inout)  :: f(n, c)     !< [N s]
    real(c_double), dimension(strip) :: rn, rt, rs, fn, ft, fs, un, ut, us, wn, wt
    real(c_double) :: normal, limit, t, s, most, size, factor
    integer :: i, j
    rs = 0
    us = 0
    do j = 1, strip
      i = min(first + j - 1, n)
      wn(j) = w(i, 1, 1)
      wt(j) = w(i, 2, 2)
      rn(j) = r(i, 1) + pull(j)
      rt(j) = r(i, 2)
      un(j) = u(i, 1)
      ut(j) = u(i, 2)
      if (c < 3) cycle
      wt(j) = max(wt(j), w(i, 3, 3))
      rs(j) = r(i, 3)
      us(j) = u(i, 3)
    end do
    !$omp simd private(normal, limit, t, s, most, size, factor)
    do j = 1, strip
      normal = max(0.0_c_double, rn(j) - un(j)/wn(j))
      factor = merge(1/merge(wt(j), 1.0_c_double, wt(j) > 0), 0.0_c_double, wt(j) > 0)
      t = rt(j) - ut(j)*factor
      s = rs(j) - us(j)*factor
      limit = merge(mu(j)*normal, 0.0_c_double, normal > 0) + k(j)
      most = max(abs(t), abs(s), tiny(most))
      size = most*sqrt((t/most)**2 + (s/most)**2)
      factor = merge(limit/size, 1.0_c_double, size > limit)
      fn(j) = rn(j) - normal
      ft(j) = rt(j) - factor*t
      fs(j) = rs(j) - factor*s
    end do
    do i = first, min(first + strip - 1, n)
      f(i, 1) = fn(i - first + 1)
      f(i, 2) = ft(i - first + 1)
      if (c == 3) f(i, 3) = fs(i - first + 1)
    end do
  end subroutine map_sliding

  !> 0 open, 1 sticks, 2 slips.
  pure integer(c_int32_t) function status_of_blocks(c, plane, mu, k, r)
    integer(c_int32_t), intent(in) :: c     !< components
    logical, intent(in)            :: plane !< c = 3 is n, t and the rotation
    real(c_double), intent(in)     :: mu(3), k(3) !< as above
    real(c_double), intent(in)     :: r(c)  !< [N s, N m s]
    integer :: first(3), last(3)
    real(c_double) :: t(2)
    call places_of(c, plane, first, last)
    status_of_blocks = 0
    t = 0
    t(1:last(1) - 1) = r(2:last(1))
    if (.not. r(1) > 0 .and. .not. length(t) > 0) return
    status_of_blocks = 1
    if (length(t) >= (mu(1)*r(1) + k(1))*(1 - 8*epsilon(t))) status_of_blocks = 2
  end function status_of_blocks

  pure real(c_double) function length(x)
    real(c_double), intent(in) :: x(2) !< any unit
    length = maxval(abs(x))
    if (length > 0) length = length*sqrt(sum((x/length)**2))
  end function length
end module block_cones
