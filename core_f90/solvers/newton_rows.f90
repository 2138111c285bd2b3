!> The linear system of a Newton step. Contact a has unknowns(a) unknowns y with dr = step + basis y, and as many rows
!>   left (W + alpha) dr + own y = target,
!> where W dr gathers from its neighbours; alpha is the weight of a proximal term. Rows are those of y, columns rising.
module newton_rows
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_newton_pattern, cairn_newton_values, cairn_newton_targets, cairn_newton_step, cairn_newton_weights
contains

  !> Where the entries stand. Returns their number; with capacity below it, rows that do not fit are left out.
  integer(c_int64_t) function cairn_newton_pattern(n, row_start, column, unknowns, first, capacity, start, index) result(entries) &
      bind(c)
    integer(c_int64_t), value       :: n              !< contacts
    integer(c_int64_t), intent(in)  :: row_start(n+1) !< from 0
    integer(c_int32_t), intent(in)  :: column(*)      !< from 0
    integer(c_int32_t), intent(in)  :: unknowns(n)    !< of a contact
    integer(c_int32_t), intent(out) :: first(n+1)     !< first row of a contact, from 0
    integer(c_int64_t), value       :: capacity       !< of index
    integer(c_int32_t), intent(out) :: start(*)       !< (rows + 1) from 0
    integer(c_int32_t), intent(out) :: index(capacity) !< columns from 0
    integer(c_int64_t) :: a, k, b, row
    integer(c_int32_t) :: i, j
    first(1) = 0
    do a = 1, n
      first(a+1) = first(a) + unknowns(a)
    end do
    entries = 0
    row = 0
    start(1) = 0
    do a = 1, n
      do i = 1, unknowns(a)
        do k = row_start(a) + 1, row_start(a+1)
          b = column(k) + 1
          if (entries + unknowns(b) <= capacity) then
            do j = 1, unknowns(b)
              index(entries+j) = first(b) + j - 1
            end do
          end if
          entries = entries + unknowns(b)
        end do
        row = row + 1
        start(row+1) = int(entries, c_int32_t)
      end do
    end do
  end function cairn_newton_pattern

  subroutine cairn_newton_values(dim, n, row_start, column, block, alpha, unknowns, left, basis, own, first, start, entry) bind(c)
    integer(c_int32_t), value      :: dim            !< components of a contact, 2 or 3
    integer(c_int64_t), value      :: n              !< contacts
    integer(c_int64_t), intent(in) :: row_start(n+1) !< from 0
    integer(c_int32_t), intent(in) :: column(*)      !< from 0
    real(c_double), intent(in)     :: block(dim, dim, *) !< [1/kg]
    real(c_double), value          :: alpha          !< [1/kg]
    integer(c_int32_t), intent(in) :: unknowns(n)    !< of a contact
    real(c_double), intent(in)     :: left(dim, dim, n)  !< (unknown, component)
    real(c_double), intent(in)     :: basis(dim, dim, n) !< (component, unknown)
    real(c_double), intent(in)     :: own(dim, dim, n)   !< (unknown, unknown)
    integer(c_int32_t), intent(in) :: first(n+1)     !< first row of a contact, from 0
    integer(c_int32_t), intent(in) :: start(*)       !< (rows + 1) from 0
    real(c_double), intent(out)    :: entry(*)       !< of the matrix
    real(c_double) :: w(dim, dim), lw(dim)
    integer(c_int64_t) :: a, k, b, place
    integer(c_int32_t) :: i, j, c, shift
    do a = 1, n
      if (unknowns(a) == 0) cycle
      shift = 0
      do k = row_start(a) + 1, row_start(a+1)
        b = column(k) + 1
        if (unknowns(b) == 0) cycle
        w = block(:, :, k)
        if (a == b) then
          do c = 1, dim
            w(c, c) = w(c, c) + alpha
          end do
        end if
        do i = 1, unknowns(a)
          place = start(first(a)+i) + shift
          lw = 0
          do c = 1, dim
            lw = lw + left(i, c, a)*w(c, :)
          end do
          do j = 1, unknowns(b)
            entry(place+j) = sum(lw*basis(:, j, b))
          end do
          if (a /= b) cycle
          do j = 1, unknowns(b)
            entry(place+j) = entry(place+j) + own(i, j, a)
          end do
        end do
        shift = shift + unknowns(b)
      end do
    end do
  end subroutine cairn_newton_values

  !> Right-hand side: what is left of the target after the known part of the step, which changes u by change.
  subroutine cairn_newton_targets(dim, n, alpha, unknowns, left, step, change, target, first, rhs) bind(c)
    integer(c_int32_t), value      :: dim            !< components of a contact, 2 or 3
    integer(c_int64_t), value      :: n              !< contacts
    real(c_double), value          :: alpha          !< [1/kg]
    integer(c_int32_t), intent(in) :: unknowns(n)    !< of a contact
    real(c_double), intent(in)     :: left(dim, dim, n) !< (unknown, component)
    real(c_double), intent(in)     :: step(dim, n)   !< [N s]
    real(c_double), intent(in)     :: change(dim, n) !< W step [m/s]
    real(c_double), intent(in)     :: target(dim, n) !< (unknown)
    integer(c_int32_t), intent(in) :: first(n+1)     !< first row of a contact, from 0
    real(c_double), intent(out)    :: rhs(*)         !< (rows)
    integer(c_int64_t) :: a
    integer(c_int32_t) :: i
    do a = 1, n
      do i = 1, unknowns(a)
        rhs(first(a)+i) = target(i, a) - sum(left(i, :, a)*(change(:, a) + alpha*step(:, a)))
      end do
    end do
  end subroutine cairn_newton_targets

  !> dr = step + basis y, in place of step.
  subroutine cairn_newton_step(dim, n, unknowns, basis, first, y, step) bind(c)
    integer(c_int32_t), value      :: dim            !< components of a contact, 2 or 3
    integer(c_int64_t), value      :: n              !< contacts
    integer(c_int32_t), intent(in) :: unknowns(n)    !< of a contact
    real(c_double), intent(in)     :: basis(dim, dim, n) !< (component, unknown)
    integer(c_int32_t), intent(in) :: first(n+1)     !< first row of a contact, from 0
    real(c_double), intent(in)     :: y(*)           !< (rows)
    real(c_double), intent(inout)  :: step(dim, n)   !< [N s]
    integer(c_int64_t) :: a
    integer(c_int32_t) :: j
    do a = 1, n
      do j = 1, unknowns(a)
        step(:, a) = step(:, a) + basis(:, j, a)*y(first(a)+j)
      end do
    end do
  end subroutine cairn_newton_step

  !> rho of a contact: 1/W_NN and 1/largest eigenvalue of W_TT, so that no unit enters.
  subroutine cairn_newton_weights(dim, n, place, block, rho) bind(c)
    integer(c_int32_t), value      :: dim      !< components of a contact, 2 or 3
    integer(c_int64_t), value      :: n        !< contacts
    integer(c_int64_t), intent(in) :: place(n) !< of the diagonal block, from 0
    real(c_double), intent(in)     :: block(dim, dim, *) !< [1/kg]
    real(c_double), intent(out)    :: rho(2, n) !< normal, tangential [kg]
    real(c_double) :: largest
    integer(c_int64_t) :: a, k
    do a = 1, n
      k = place(a) + 1
      if (dim == 2) then
        largest = block(2, 2, k)
      else
        largest = (block(2, 2, k) + block(dim, dim, k))/2 + &
                  sqrt(((block(2, 2, k) - block(dim, dim, k))/2)**2 + ((block(2, dim, k) + block(dim, 2, k))/2)**2)
      end if
      rho(1, a) = 1/block(1, 1, k)
      rho(2, a) = rho(1, a)
      if (largest > 1e-8_c_double*block(1, 1, k)) rho(2, a) = 1/largest
    end do
  end subroutine cairn_newton_weights
end module newton_rows
