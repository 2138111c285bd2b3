!> The impulses that belong to given states of contacts, for whoever tries all: open, stick, slip. A dense linear system; in
!> space the directions of slip follow from it and are put in again (fixed point).
module enumeration
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_enumeration_impulses
contains

  !> state: 0 open, 1 stick, 2 slip; in the plane 2 slips with r_T = mu r_N, 3 with -mu r_N.
  subroutine cairn_enumeration_impulses(dim, n, w, q, mu, state, rounds, matrix, right, direction, r) bind(c)
    integer(c_int32_t), value      :: dim            !< components of a contact, 2 or 3
    integer(c_int64_t), value      :: n              !< contacts
    real(c_double), intent(in)     :: w(dim*n, dim*n) !< [1/kg]
    real(c_double), intent(in)     :: q(dim, n)      !< [m/s]
    real(c_double), intent(in)     :: mu(n)          !< friction [-]
    integer(c_int32_t), intent(in) :: state(n)       !< see above
    integer(c_int32_t), value      :: rounds         !< of the fixed point at most
    real(c_double), intent(inout)  :: matrix(dim*n, dim*n) !< workspace
    real(c_double), intent(inout)  :: right(dim*n)   !< workspace
    real(c_double), intent(inout)  :: direction(dim-1, n) !< workspace: of friction where it slips
    real(c_double), intent(out)    :: r(dim, n)      !< [N s]
    real(c_double) :: u(dim, n), size, turn, last(dim-1)
    integer :: round
    integer(c_int64_t) :: a
    logical :: slips
    slips = .false.
    do a = 1, n
      size = sqrt(sum(q(2:, a)**2))
      direction(:, a) = 0
      direction(1, a) = merge(-1, 1, state(a) == 3)
      if (dim == 3 .and. size > 0) direction(:, a) = -q(2:, a)/size
      slips = slips .or. state(a) >= 2
    end do
    do round = 1, rounds
      call solve_states(dim, n, w, q, mu, state, direction, matrix, right, r)
      if (dim == 2 .or. .not. slips) return
      u = reshape(matmul(w, reshape(r, [dim*n])), [int(dim, c_int64_t), n]) + q
      turn = 0
      do a = 1, n
        size = sqrt(sum(u(2:, a)**2))
        if (state(a) < 2 .or. .not. size > 0) cycle
        last = direction(:, a)
        direction(:, a) = mu(a)*r(1, a)*last - u(2:, a)/w(dim*(a-1)+2, dim*(a-1)+2) ! as the natural map turns it
        direction(:, a) = direction(:, a)/max(sqrt(sum(direction(:, a)**2)), tiny(size))
        turn = max(turn, sum((direction(:, a) - last)**2))
      end do
      if (turn < (4*epsilon(turn))**2) return
    end do
  end subroutine cairn_enumeration_impulses

  subroutine solve_states(dim, n, w, q, mu, state, direction, matrix, right, r)
    integer(c_int32_t), intent(in) :: dim
    integer(c_int64_t), intent(in) :: n
    real(c_double), intent(in)     :: w(dim*n, dim*n), q(dim, n), mu(n), direction(dim-1, n)
    integer(c_int32_t), intent(in) :: state(n)
    real(c_double), intent(inout)  :: matrix(dim*n, dim*n), right(dim*n)
    real(c_double), intent(out)    :: r(dim, n)
    integer(c_int64_t) :: a, i, m
    integer(c_int64_t) :: first(n)
    m = 0
    do a = 1, n
      first(a) = m
      if (state(a) == 1) m = m + dim
      if (state(a) > 1) m = m + 1
    end do
    do a = 1, n
      i = dim*(a - 1)
      if (state(a) == 0) cycle
      call fill_rows(dim, n, w(i+1:i+merge(int(dim), 1, state(a) == 1), :), mu, state, direction, first, &
                     matrix(first(a)+1:first(a)+merge(int(dim), 1, state(a) == 1), :))
      right(first(a)+1) = -q(1, a)
      if (state(a) == 1) right(first(a)+2:first(a)+dim) = -q(2:, a)
    end do
    call eliminate(m, matrix(:m, :m), right(:m))
    r = 0
    do a = 1, n
      if (state(a) == 0) cycle
      r(1, a) = right(first(a)+1)
      if (state(a) == 1) then
        r(2:, a) = right(first(a)+2:first(a)+dim)
      else
        r(2:, a) = mu(a)*r(1, a)*direction(:, a)
      end if
    end do
  end subroutine solve_states

  pure subroutine fill_rows(dim, n, w, mu, state, direction, first, rows)
    integer(c_int32_t), intent(in) :: dim
    integer(c_int64_t), intent(in) :: n, first(n)
    real(c_double), intent(in)     :: w(:, :), mu(n), direction(dim-1, n)
    integer(c_int32_t), intent(in) :: state(n)
    real(c_double), intent(inout)  :: rows(:, :)
    integer(c_int64_t) :: b, j
    integer :: c
    do b = 1, n
      j = dim*(b - 1)
      if (state(b) == 1) then
        rows(:, first(b)+1:first(b)+dim) = w(:, j+1:j+dim)
      else if (state(b) > 1) then
        rows(:, first(b)+1) = w(:, j+1)
        do c = 1, dim - 1
          rows(:, first(b)+1) = rows(:, first(b)+1) + mu(b)*direction(c, b)*w(:, j+1+c)
        end do
      end if
    end do
  end subroutine fill_rows

  !> Solution in place of b, with the largest pivots of the whole matrix; unknowns that others determine are zero.
  pure subroutine eliminate(m, a, b)
    integer(c_int64_t), intent(in) :: m
    real(c_double), intent(inout)  :: a(m, m), b(m)
    real(c_double) :: row(m), largest, factor, x(m), swap
    integer(c_int64_t) :: k, i, place(2), of(m), rank, hold
    of = [(k, k=1, m)]
    if (m == 0) return
    largest = maxval(abs(a))
    rank = 0
    do k = 1, m
      place = maxloc(abs(a(k:, k:))) + k - 1
      if (.not. abs(a(place(1), place(2))) > 1e-13_c_double*m*largest) exit
      rank = k
      row = a(k, :)
      a(k, :) = a(place(1), :)
      a(place(1), :) = row
      swap = b(k)
      b(k) = b(place(1))
      b(place(1)) = swap
      row = a(:, k)
      a(:, k) = a(:, place(2))
      a(:, place(2)) = row
      hold = of(k)
      of(k) = of(place(2))
      of(place(2)) = hold
      do i = k + 1, m
        factor = a(i, k)/a(k, k)
        a(i, k:) = a(i, k:) - factor*a(k, k:)
        b(i) = b(i) - factor*b(k)
      end do
    end do
    x = 0
    do k = rank, 1, -1
      x(of(k)) = (b(k) - sum([(a(k, i)*x(of(i)), i=k+1, rank)]))/a(k, k)
    end do
    b = x
  end subroutine eliminate
end module enumeration
