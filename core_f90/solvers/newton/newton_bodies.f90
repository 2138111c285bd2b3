!> The linear system of a Newton step over bodies instead of contacts. With a proximal term alpha each contact answers a velocity by
!> itself, dr = known - answer H'dv (see newton_rows for what a contact gives), so that
!>   (A + H answer H') dv = H known
!> holds as many unknowns as the bodies have, however many contacts they share.
module newton_bodies
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_newton_answers, cairn_newton_body_blocks, cairn_newton_add_body_blocks, cairn_newton_body_step
  public :: cairn_half_product
contains

  subroutine cairn_newton_answers(dim, n, alpha, unknowns, left, basis, own, step, target, answer, known) bind(c)
    integer(c_int32_t), value      :: dim            !< components of a contact, 2 or 3
    integer(c_int64_t), value      :: n              !< contacts
    real(c_double), value          :: alpha          !< [1/kg]
    integer(c_int32_t), intent(in) :: unknowns(n)    !< of a contact
    real(c_double), intent(in)     :: left(dim, dim, n)  !< (unknown, component)
    real(c_double), intent(in)     :: basis(dim, dim, n) !< (component, unknown)
    real(c_double), intent(in)     :: own(dim, dim, n)   !< (unknown, unknown)
    real(c_double), intent(in)     :: step(dim, n)   !< part of dr that is known before [N s]
    real(c_double), intent(in)     :: target(dim, n) !< (unknown)
    real(c_double), intent(out)    :: answer(dim, dim, n) !< [kg]
    real(c_double), intent(out)    :: known(dim, n)  !< [N s]
    ! loops of known lengths
    if (dim == 2) then
      call fill_answers(2_c_int32_t, n, alpha, unknowns, left, basis, own, step, target, answer, known)
    else
      call fill_answers(3_c_int32_t, n, alpha, unknowns, left, basis, own, step, target, answer, known)
    end if
  end subroutine cairn_newton_answers

  pure subroutine fill_answers(dim, n, alpha, unknowns, left, basis, own, step, target, answer, known)
    integer(c_int32_t), value      :: dim
    integer(c_int64_t), intent(in) :: n
    real(c_double), intent(in)     :: alpha
    integer(c_int32_t), intent(in) :: unknowns(n)
    real(c_double), intent(in)     :: left(dim, dim, n), basis(dim, dim, n), own(dim, dim, n), step(dim, n), target(dim, n)
    real(c_double), intent(out)    :: answer(dim, dim, n), known(dim, n)
    real(c_double) :: m(dim, dim), right(dim, dim+1)
    integer(c_int64_t) :: a
    do a = 1, n
      answer(:, :, a) = 0
      known(:, a) = step(:, a)
      if (unknowns(a) == 0) cycle
      m = alpha*matmul(left(:, :, a), basis(:, :, a)) + own(:, :, a)
      right(:, :dim) = left(:, :, a)
      right(:, dim+1) = target(:, a) - alpha*matmul(left(:, :, a), step(:, a))
      call eliminate(dim, m, right)
      answer(:, :, a) = matmul(basis(:, :, a), right(:, :dim))
      known(:, a) = known(:, a) + matmul(basis(:, :, a), right(:, dim+1))
    end do
  end subroutine fill_answers

  !> right <- m^-1 right, with the largest pivot of each column.
  pure subroutine eliminate(dim, m, right)
    integer(c_int32_t), value      :: dim
    real(c_double), intent(inout)  :: m(dim, dim), right(dim, dim+1)
    real(c_double) :: line(dim), line_right(dim+1), factor
    integer :: c, p, i
    do c = 1, dim
      p = c
      do i = c + 1, dim
        if (abs(m(i, c)) > abs(m(p, c))) p = i
      end do
      line = m(p, :)
      line_right = right(p, :)
      m(p, :) = m(c, :)
      right(p, :) = right(c, :)
      m(c, :) = line/line(c)
      right(c, :) = line_right/line(c)
      do i = 1, dim
        if (i == c) cycle
        factor = m(i, c)
        m(i, :) = m(i, :) - factor*m(c, :)
        right(i, :) = right(i, :) - factor*right(c, :)
      end do
    end do
  end subroutine eliminate

  !> A + H answer H' on the pattern of bodies that touch.
  subroutine cairn_newton_body_blocks(dim, dofs, n, nb, body, rows, answer, mass, diagonal, place, blocks, matrix) bind(c)
    integer(c_int32_t), value      :: dim            !< components of a contact, 2 or 3
    integer(c_int32_t), value      :: dofs           !< of a body, 3 or 6
    integer(c_int64_t), value      :: n              !< contacts
    integer(c_int64_t), value      :: nb             !< bodies
    integer(c_int32_t), intent(in) :: body(2, n)     !< from 0; -1: does not move
    real(c_double), intent(in)     :: rows(dim, dofs, 2, n) !< H' of each side [-], [m]
    real(c_double), intent(in)     :: answer(dim, dim, n) !< [kg]
    real(c_double), intent(in)     :: mass(dofs, dofs, nb) !< A [kg], [kg m2]
    integer(c_int64_t), intent(in) :: diagonal(nb)   !< place of its block, from 0
    integer(c_int64_t), intent(in) :: place(2, n)    !< of the blocks (A, B) and (B, A) of a contact, from 0; -1: not kept
    integer(c_int64_t), value      :: blocks         !< of the pattern
    real(c_double), intent(out)    :: matrix(dofs, dofs, blocks)
    integer(c_int64_t) :: b
    matrix = 0
    do b = 1, nb
      matrix(:, :, diagonal(b)+1) = mass(:, :, b)
    end do
    call cairn_newton_add_body_blocks(dim, dofs, n, nb, body, rows, answer, diagonal, place, blocks, matrix)
  end subroutine cairn_newton_body_blocks

  !> Adds H answer H' to such a matrix.
  subroutine cairn_newton_add_body_blocks(dim, dofs, n, nb, body, rows, answer, diagonal, place, blocks, matrix) bind(c)
    integer(c_int32_t), value      :: dim            !< components of a contact, 2 or 3
    integer(c_int32_t), value      :: dofs           !< of a body, 3 or 6
    integer(c_int64_t), value      :: n              !< contacts
    integer(c_int64_t), value      :: nb             !< bodies
    integer(c_int32_t), intent(in) :: body(2, n)     !< from 0; -1: does not move
    real(c_double), intent(in)     :: rows(dim, dofs, 2, n) !< H' of each side [-], [m]
    real(c_double), intent(in)     :: answer(dim, dim, n) !< [kg]
    integer(c_int64_t), intent(in) :: diagonal(nb)   !< as above
    integer(c_int64_t), intent(in) :: place(2, n)    !< as above
    integer(c_int64_t), value      :: blocks         !< of the pattern
    real(c_double), intent(inout)  :: matrix(dofs, dofs, blocks)
    ! loops of known lengths
    if (dim == 2) then
      call add_body_blocks(2_c_int32_t, 3_c_int32_t, n, nb, body, rows, answer, diagonal, place, blocks, matrix)
    else
      call add_body_blocks(3_c_int32_t, 6_c_int32_t, n, nb, body, rows, answer, diagonal, place, blocks, matrix)
    end if
  end subroutine cairn_newton_add_body_blocks

  pure subroutine add_body_blocks(dim, dofs, n, nb, body, rows, answer, diagonal, place, blocks, matrix)
    integer(c_int32_t), value      :: dim, dofs
    integer(c_int64_t), intent(in) :: n, nb, blocks
    integer(c_int32_t), intent(in) :: body(2, n)
    real(c_double), intent(in)     :: rows(dim, dofs, 2, n), answer(dim, dim, n)
    integer(c_int64_t), intent(in) :: diagonal(nb), place(2, n)
    real(c_double), intent(inout)  :: matrix(dofs, dofs, blocks)
    real(c_double) :: half(dofs, dim), side(dofs, dim)
    integer(c_int64_t) :: a, e
    integer :: s, t
    do a = 1, n
      if (.not. any(answer(:, :, a) < 0 .or. answer(:, :, a) > 0)) cycle
      do s = 1, 2
        if (body(s, a) < 0) cycle
        side = transpose(rows(:, :, s, a))
        call times_answer(dim, dofs, side, answer(:, :, a), half)
        do t = 1, 2
          if (body(t, a) < 0) cycle
          e = diagonal(body(s, a)+1) + 1
          if (s /= t) e = place(s, a) + 1
          if (e < 1) cycle
          call add_product(dim, dofs, half, rows(:, :, t, a), matrix(:, :, e))
        end do
      end do
    end do
  end subroutine add_body_blocks

  pure subroutine times_answer(dim, dofs, side, answer, half)
    integer(c_int32_t), value      :: dim, dofs
    real(c_double), intent(in)     :: side(dofs, dim), answer(dim, dim)
    real(c_double), intent(out)    :: half(dofs, dim)
    integer :: c, d
    do d = 1, dim
      half(:, d) = 0
      do c = 1, dim
        half(:, d) = half(:, d) + side(:, c)*answer(c, d)
      end do
    end do
  end subroutine times_answer

  !> m + half rows
  pure subroutine add_product(dim, dofs, half, rows, m)
    integer(c_int32_t), value      :: dim, dofs
    real(c_double), intent(in)     :: half(dofs, dim), rows(dim, dofs)
    real(c_double), intent(inout)  :: m(dofs, dofs)
    integer :: k, c
    do k = 1, dofs
      do c = 1, dim
        m(:, k) = m(:, k) + half(:, c)*rows(c, k)
      end do
    end do
  end subroutine add_product

  !> y = (D + L + L') x of a symmetric matrix that is kept as D + L: rows of blocks, the last of each row that of its body.
  subroutine cairn_half_product(dofs, nb, row_start, column, matrix, x, y) bind(c)
    integer(c_int32_t), value      :: dofs            !< of a body, 3 or 6
    integer(c_int64_t), value      :: nb              !< bodies
    integer(c_int64_t), intent(in) :: row_start(nb + 1) !< from 0
    integer(c_int32_t), intent(in) :: column(*)       !< from 0
    real(c_double), intent(in)     :: matrix(dofs, dofs, *) !< each block by rows
    real(c_double), intent(in)     :: x(dofs, nb)
    real(c_double), intent(out)    :: y(dofs, nb)
    ! loops of known lengths
    if (dofs == 3) then
      call multiply_half(3_c_int32_t, nb, row_start, column, matrix, x, y)
    else
      call multiply_half(6_c_int32_t, nb, row_start, column, matrix, x, y)
    end if
  end subroutine cairn_half_product

  pure subroutine multiply_half(dofs, nb, row_start, column, matrix, x, y)
    integer(c_int32_t), value      :: dofs
    integer(c_int64_t), intent(in) :: nb, row_start(nb + 1)
    integer(c_int32_t), intent(in) :: column(*)
    real(c_double), intent(in)     :: matrix(dofs, dofs, *), x(dofs, nb)
    real(c_double), intent(out)    :: y(dofs, nb)
    real(c_double) :: own(dofs), sum(dofs)
    integer(c_int64_t) :: i, e, j
    integer :: k, l
    do i = 1, nb
      own = x(:, i)
      sum = 0
      do e = row_start(i) + 1, row_start(i + 1) - 1
        j = column(e) + 1
        do k = 1, dofs
          do l = 1, dofs
            sum(k) = sum(k) + matrix(l, k, e)*x(l, j)
          end do
        end do
        do k = 1, dofs
          y(:, j) = y(:, j) + matrix(:, k, e)*own(k)
        end do
      end do
      e = row_start(i + 1)
      do k = 1, dofs
        do l = 1, dofs
          sum(k) = sum(k) + matrix(l, k, e)*own(l)
        end do
      end do
      y(:, i) = sum ! rows below add their part later
    end do
  end subroutine multiply_half

  !> dr = known - answer H'dv
  subroutine cairn_newton_body_step(dim, n, answer, known, change, step) bind(c)
    integer(c_int32_t), value   :: dim            !< components of a contact, 2 or 3
    integer(c_int64_t), value   :: n              !< contacts
    real(c_double), intent(in)  :: answer(dim, dim, n) !< [kg]
    real(c_double), intent(in)  :: known(dim, n)  !< [N s]
    real(c_double), intent(in)  :: change(dim, n) !< H'dv [m/s]
    real(c_double), intent(out) :: step(dim, n)   !< [N s]
    integer(c_int64_t) :: a
    do a = 1, n
      step(:, a) = known(:, a) - matmul(answer(:, :, a), change(:, a))
    end do
  end subroutine cairn_newton_body_step
end module newton_bodies
