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
    real(c_double) :: before(c), step(c), step_before(c), change, size, moved, moved_before, ratio
    integer, parameter :: newton_turns(3) = [6, 24, 96] !< after which Newton's method is tried
    integer :: i, b, l, first(3), last(3)
    logical :: found
    call places_of(c, plane, first, last)
    r = 0
    if (.not. any(k > 0) .and. .not. q(1) < 0) return ! open
    call stick(c, w, q, r, found)
    do b = 1, 3
      if (first(b) <= last(b)) found = found .and. sqrt(sum(r(first(b):last(b))**2)) <= mu(b)*r(1) + k(b)
    end do
    if (found .and. r(1) > 0) return
    r = 0
    if (present(start)) then
      r = start
      found = .false.
      if (r(1) > 0) call try_newton(c, plane, w, q, mu, k, r, found)
      if (.not. found) r = 0
    end if
    step_before = 0
    moved_before = huge(moved)
    do i = 1, 2000
      before = r
      r(1) = max(0.0_c_double, -(q(1) + dot_product(w(1, 2:), r(2:)))/w(1, 1))
      do b = 1, 3
        if (first(b) > last(b)) cycle
        call one_block(c, w, q, first(b), last(b), mu(b)*r(1) + k(b), r)
      end do
      step = r - before
      change = 0
      size = 0
      moved = 0
      ratio = 0
      do l = 1, c
        change = max(change, w(l, l)*step(l)**2)
        size = max(size, w(l, l)*r(l)**2)
        moved = moved + w(l, l)*step_before(l)**2
        ratio = ratio + w(l, l)*step(l)*step_before(l)
      end do
      if (change <= (4*epsilon(change))**2*size) exit
      if (any(i == newton_turns)) then
        call try_newton(c, plane, w, q, mu, k, r, found)
        step = 0
        if (found) moved_before = huge(moved)
      end if
      step_before = step
      if (mod(i, 3) > 0 .or. .not. ratio > 0 .or. .not. ratio < moved .or. .not. moved < moved_before) cycle
      moved_before = moved
      r = r + ratio/(moved - ratio)*step
    end do
  end subroutine solve_blocks

  !> Newton's method on the natural map of all blocks at once (Alart & Curnier 1991), from impulses that are near a solution; found:
  !> it ended at one, to many digits. Else the impulses are left as they are.
  pure subroutine try_newton(c, plane, w, q, mu, k, r, found)
    integer(c_int32_t), intent(in) :: c       !< components
    logical, intent(in)            :: plane   !< c = 3 is n, t and the rotation
    real(c_double), intent(in)     :: w(c, c) !< [1/kg]
    real(c_double), intent(in)     :: q(c)    !< [m/s, rad/s]
    real(c_double), intent(in)     :: mu(3), k(3) !< as above
    real(c_double), intent(inout)  :: r(c)    !< [N s, N m s]
    logical, intent(out)           :: found
    integer, parameter :: most = 8 !< passes
    real(c_double), parameter :: near = 2.0_c_double**(-44) !< of impulses, in the norm of the diagonal
    real(c_double) :: x(c), u(c), f(c), a(c, c), missed, size
    logical :: regular
    integer :: i, l
    x = r
    found = .false.
    do i = 1, most
      u = q
      do l = 1, c
        u = u + w(:, l)*x(l)
      end do
      call tangent_of_map(c, plane, w, u, mu, k, x, f, a)
      missed = 0
      size = 0
      do l = 1, c
        missed = max(missed, w(l, l)*f(l)**2)
        size = max(size, w(l, l)*x(l)**2)
      end do
      found = missed <= near**2*size .and. size > 0
      if (found) exit
      call eliminate(c, w, a, f, regular)
      if (.not. regular) return
      x = x - f
    end do
    if (found) r = x
  end subroutine try_newton

  !> map_blocks and its derivative by r, u = W r + q.
  pure subroutine tangent_of_map(c, plane, w, u, mu, k, r, f, a)
    integer(c_int32_t), intent(in) :: c       !< components
    logical, intent(in)            :: plane   !< c = 3 is n, t and the rotation
    real(c_double), intent(in)     :: w(c, c) !< [1/kg]
    real(c_double), intent(in)     :: u(c)    !< [m/s, rad/s]
    real(c_double), intent(in)     :: mu(3), k(3) !< as above
    real(c_double), intent(in)     :: r(c)    !< [N s, N m s]
    real(c_double), intent(out)    :: f(c)    !< [N s, N m s]
    real(c_double), intent(out)    :: a(c, c) !< [-, m, 1/m]
    real(c_double) :: z(2), e(2), dz(2), normal, limit, size, heaviest, grows, along
    integer :: b, l, m, i, first(3), last(3)
    call places_of(c, plane, first, last)
    normal = max(0.0_c_double, r(1) - u(1)/w(1, 1))
    f(1) = r(1) - normal
    a = 0
    a(1, 1) = 1
    if (normal > 0) then ! f = u/W_NN
      f(1) = u(1)/w(1, 1)
      a(1, :) = w(1, :)/w(1, 1)
    end if
    do b = 1, 3
      m = last(b) - first(b) + 1
      if (m < 1) cycle
      heaviest = 0
      do l = first(b), last(b)
        heaviest = max(heaviest, w(l, l))
        a(l, l) = 1
        f(l) = r(l)
      end do
      limit = merge(mu(b)*normal, 0.0_c_double, normal > 0) + k(b)
      if (.not. (heaviest > 0 .and. limit > 0)) cycle ! bears nothing
      z = 0
      z(1:m) = r(first(b):last(b)) - u(first(b):last(b))/heaviest
      size = length(z)
      if (.not. size > limit) then ! sticks
        f(first(b):last(b)) = u(first(b):last(b))/heaviest
        a(first(b):last(b), :) = w(first(b):last(b), :)/heaviest
        cycle
      end if
      e = z/size
      f(first(b):last(b)) = r(first(b):last(b)) - limit*e(1:m)
      do l = 1, c
        grows = 0 ! of the limit
        if (normal > 0) grows = mu(b)*(merge(1.0_c_double, 0.0_c_double, l == 1) - w(1, l)/w(1, 1))
        dz = 0
        do i = 1, m
          dz(i) = merge(1.0_c_double, 0.0_c_double, l == first(b) + i - 1) - w(first(b) + i - 1, l)/heaviest
        end do
        along = sum(e*dz)
        do i = 1, m
          a(first(b) + i - 1, l) = a(first(b) + i - 1, l) - grows*e(i) - (limit/size)*(dz(i) - e(i)*along)
        end do
      end do
    end do
  end subroutine tangent_of_map

  !> x = A^-1 x with pivots by rows, which are compared in the norm of the diagonal, as their units differ; not regular: there is no
  !> solution in these digits. A is lost.
  pure subroutine eliminate(n, w, a, x, regular)
    integer(c_int32_t), intent(in) :: n
    real(c_double), intent(in)     :: w(n, n) !< [1/kg]
    real(c_double), intent(inout)  :: a(n, n), x(n)
    logical, intent(out)           :: regular
    real(c_double) :: row(n), weight(n), largest, factor
    integer :: j, l, pivot
    regular = .false.
    do j = 1, n
      weight(j) = w(j, j)
    end do
    do j = 1, n
      pivot = j
      do l = j + 1, n
        if (weight(l)*a(l, j)**2 > weight(pivot)*a(pivot, j)**2) pivot = l
      end do
      largest = abs(a(pivot, j))
      if (.not. (largest > 0 .and. largest < huge(largest))) return
      if (pivot /= j) then
        row = a(j, :)
        a(j, :) = a(pivot, :)
        a(pivot, :) = row
        factor = x(j)
        x(j) = x(pivot)
        x(pivot) = factor
        factor = weight(j)
        weight(j) = weight(pivot)
        weight(pivot) = factor
      end if
      do l = j + 1, n
        factor = a(l, j)/a(j, j)
        a(l, j + 1:) = a(l, j + 1:) - factor*a(j, j + 1:)
        x(l) = x(l) - factor*x(j)
      end do
    end do
    do j = n, 1, -1
      x(j) = (x(j) - sum(a(j, j + 1:)*x(j + 1:)))/a(j, j)
    end do
    regular = all(abs(x) < huge(x))
  end subroutine eliminate

  !> W^-1 times -q, by the factors of W = L D L' (roots would round otherwise in other units); not found where W is singular.
  pure subroutine stick(c, w, q, r, found)
    integer(c_int32_t), intent(in) :: c       !< components
    real(c_double), intent(in)     :: w(c, c) !< [1/kg]
    real(c_double), intent(in)     :: q(c)    !< [m/s, rad/s]
    real(c_double), intent(out)    :: r(c)    !< [N s, N m s]
    logical, intent(out)           :: found
    real(c_double), parameter :: least = 1e-10_c_double !< of a diagonal, that a pivot may be
    real(c_double) :: a(c, c), d(c)
    integer :: j, l
    r = -q
    found = .true.
    do j = 1, c
      do l = 1, j - 1
        a(j, l) = (w(j, l) - sum(a(j, :l - 1)*a(l, :l - 1)*d(:l - 1)))/d(l)
      end do
      d(j) = w(j, j) - sum(a(j, :j - 1)**2*d(:j - 1))
      found = found .and. d(j) > least*w(j, j)
      if (.not. found) return
      r(j) = r(j) - sum(a(j, :j - 1)*r(:j - 1))
    end do
    do j = c, 1, -1
      r(j) = r(j)/d(j) - sum(a(j + 1:, j)*r(j + 1:))
    end do
  end subroutine stick

  !> Components from `first` to `last` of r, of length `limit` at most.
  pure subroutine one_block(c, w, q, first, last, limit, r)
    integer(c_int32_t), intent(in) :: c           !< components
    real(c_double), intent(in)     :: w(c, c)     !< [1/kg]
    real(c_double), intent(in)     :: q(c)        !< [m/s]
    integer, intent(in)            :: first, last !< of the block
    real(c_double), intent(in)     :: limit       !< [N s]
    real(c_double), intent(inout)  :: r(c)        !< [N s]
    real(c_double) :: free(2), pushed(2), a, x(2), d(2), size, v11, v22, v12
    integer :: i, l, m
    m = last - first + 1
    r(first:last) = 0
    if (.not. limit > 0) return
    pushed = 0
    do l = 1, c ! in registers, which a product of matrices is not
      pushed(1) = pushed(1) + w(first, l)*r(l)
      pushed(2) = pushed(2) + w(last, l)*r(l)
    end do
    free = [q(first) + pushed(1), q(last) + pushed(2)]
    if (m == 1) then
      if (w(first, first) > 0) r(first) = min(limit, max(-limit, -free(1)/w(first, first)))
      return
    end if
    if (.not. w(first, first) + w(last, last) > 0) return ! nothing moves there
    a = 0
    v12 = (w(first, last) + w(last, first))/2
    do i = 1, 100
      v11 = w(first, first) + a
      v22 = w(last, last) + a
      x = -solution(v11, v22, v12, free)
      size = length(x)
      if (size <= limit*(1 + 2*epsilon(size))) exit
      d = solution(v11, v22, v12, x)
      a = a + (size/limit - 1)*size**2/dot_product(x, d)
    end do
    if (size > limit) x = (limit/size)*x
    r(first:last) = x
  end subroutine one_block

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
