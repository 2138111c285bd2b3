!> Anderson's acceleration of a fixed-point iteration g(r) (Anderson 1965, Walker & Ni 2011): of the last iterates the combination
!> whose residual f = g(r) - r is least in the energy norm. Where the statuses of contacts have settled a sweep is linear, and this
!> is GMRES for it: W may be as singular as it likes.
module nlgs_anderson
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_anderson_store, cairn_anderson_mix
contains

  !> Differences of this iterate to the last one into column `slot` of a memory of `columns`.
  subroutine cairn_anderson_store(n, columns, slot, weight, f, f_last, g, g_last, df, dg, gram, work) bind(c)
    integer(c_int64_t), value     :: n              !< unknowns
    integer(c_int32_t), value     :: columns        !< in use, with this one
    integer(c_int32_t), value     :: slot           !< from 0
    real(c_double), intent(in)    :: weight(n)      !< W_NN of the contact [1/kg]
    real(c_double), intent(in)    :: f(n)           !< g(r) - r [N s]
    real(c_double), intent(in)    :: f_last(n)      !< [N s]
    real(c_double), intent(in)    :: g(n)           !< after a sweep [N s]
    real(c_double), intent(in)    :: g_last(n)      !< [N s]
    real(c_double), intent(inout) :: df(n, columns) !< [N s]
    real(c_double), intent(inout) :: dg(n, columns) !< [N s]
    real(c_double), intent(inout) :: gram(32, 32)   !< df' weight df [J]
    real(c_double), intent(out)   :: work(n)
    integer :: j, k
    k = slot + 1
    df(:, k) = f - f_last
    dg(:, k) = g - g_last
    work = weight*df(:, k)
    do j = 1, columns
      gram(j, k) = dot(n, work, df(:, j))
      gram(k, j) = gram(j, k)
    end do
  end subroutine cairn_anderson_store

  !> r = g - dg c, c least squares of f - df c; each r then on its disk mu r_N.
  subroutine cairn_anderson_mix(n, columns, weight, f, g, df, dg, gram, r, work) bind(c)
    integer(c_int64_t), value   :: n              !< unknowns
    integer(c_int32_t), value   :: columns        !< in use
    real(c_double), intent(in)  :: weight(n)      !< W_NN of the contact [1/kg]
    real(c_double), intent(in)  :: f(n)           !< g(r) - r [N s]
    real(c_double), intent(in)  :: g(n)           !< after a sweep [N s]
    real(c_double), intent(in)  :: df(n, columns) !< [N s]
    real(c_double), intent(in)  :: dg(n, columns) !< [N s]
    real(c_double), intent(in)  :: gram(32, 32)   !< df' weight df [J]
    real(c_double), intent(out) :: r(n)           !< next iterate [N s]
    real(c_double), intent(out) :: work(n)
    real(c_double) :: c(32)
    integer :: j
    work = weight*f
    do j = 1, columns
      c(j) = dot(n, work, df(:, j))
    end do
    call solve(columns, gram, c)
    r = g
    do j = 1, columns
      r = r - c(j)*dg(:, j)
    end do
  end subroutine cairn_anderson_mix

  !> Cholesky of the Gram matrix, columns scaled by powers of two; one that depends on the others to rounding is left out.
  subroutine solve(n, gram, b)
    integer(c_int32_t), intent(in) :: n            !< columns
    real(c_double), intent(in)     :: gram(32, 32) !< [J]
    real(c_double), intent(inout)  :: b(32)        !< right hand side, then the solution
    real(c_double), parameter :: least = 1e-11_c_double ! squares keep half of the digits
    real(c_double) :: l(32, 32), s(32), rest
    integer :: i, j
    do j = 1, n
      s(j) = 0
      if (gram(j, j) > 0) s(j) = 2.0_c_double**(-exponent(gram(j, j))/2)
      b(j) = b(j)*s(j)
    end do
    do j = 1, n
      rest = gram(j, j)*s(j)*s(j) - sum(l(j, 1:j-1)**2)
      if (.not. rest > least) then
        l(j, 1:j-1) = 0
        l(j:n, j) = 0
        l(j, j) = 1
        b(j) = 0
        cycle
      end if
      l(j, j) = sqrt(rest)
      do i = j + 1, n
        l(i, j) = (gram(i, j)*s(i)*s(j) - sum(l(i, 1:j-1)*l(j, 1:j-1)))/l(j, j)
      end do
    end do
    do i = 1, n
      b(i) = (b(i) - sum(l(i, 1:i-1)*b(1:i-1)))/l(i, i)
    end do
    do i = n, 1, -1
      b(i) = (b(i) - sum(l(i+1:n, i)*b(i+1:n)))/l(i, i)
    end do
    b(1:n) = b(1:n)*s(1:n)
  end subroutine solve

  pure real(c_double) function dot(n, x, y)
    integer(c_int64_t), intent(in) :: n    !< numbers
    real(c_double), intent(in)     :: x(n)
    real(c_double), intent(in)     :: y(n)
    integer(c_int64_t) :: i
    dot = 0
    !$omp simd reduction(+:dot)
    do i = 1, n
      dot = dot + x(i)*y(i)
    end do
  end function dot
end module nlgs_anderson
