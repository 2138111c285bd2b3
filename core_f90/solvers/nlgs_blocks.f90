!> Block nonlinear Gauss-Seidel over the blocks of W (Moreau 1988, Jean 1999): each contact in turn is solved exactly, the others
!> held fixed.
module nlgs_blocks
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  use coulomb_cone, only: cairn_cone_full2, cairn_cone_full3
  use cone_projection, only: project_disk
  implicit none
  private
  public :: cairn_nlgs_blocks
contains

  !> Contacts order(first), ..., order(last-1). With more than one thread they must not couple with each other (one colour).
  subroutine cairn_nlgs_blocks(dim, n, row_start, column, block, place, q, mu, first, last, order, relaxation, r, change, &
                               threads) bind(c)
    integer(c_int32_t), value      :: dim            !< components of a contact, 2 or 3
    integer(c_int64_t), value      :: n              !< contacts
    integer(c_int64_t), intent(in) :: row_start(n+1) !< from 0
    integer(c_int32_t), intent(in) :: column(*)      !< from 0
    real(c_double), intent(in)     :: block(dim, dim, *) !< [1/kg]
    integer(c_int64_t), intent(in) :: place(n)       !< of the diagonal block, from 0
    real(c_double), intent(in)     :: q(dim, n)      !< velocity with r = 0 [m/s]
    real(c_double), intent(in)     :: mu(n)          !< friction [-]
    integer(c_int64_t), value      :: first          !< place in order, from 0
    integer(c_int64_t), value      :: last           !< one past the last place
    integer(c_int32_t), intent(in) :: order(n)       !< contacts, from 0
    real(c_double), value          :: relaxation     !< (0, 2): by which a change exceeds what its contact alone would ask
    real(c_double), intent(inout)  :: r(dim, n)      !< impulse [N s]
    real(c_double), intent(inout)  :: change(n)      !< W_NN |change of r|^2 of these contacts [J]
    integer(c_int32_t), value      :: threads
    integer(c_int64_t) :: i, a
    !$omp parallel do if (threads > 1) num_threads(threads) schedule(static) private(a)
    do i = first + 1, last
      a = order(i) + 1
      if (dim == 3) then
        call one3(a, row_start, column, block, place(a) + 1, q, mu(a), relaxation, r, change(a))
      else
        call one2(a, row_start, column, block, place(a) + 1, q, mu(a), relaxation, r, change(a))
      end if
    end do
  end subroutine cairn_nlgs_blocks

  subroutine one2(a, row_start, column, block, own, q, mu, relaxation, r, change)
    integer(c_int64_t), intent(in) :: a              !< contact, from 1
    integer(c_int64_t), intent(in) :: row_start(*)   !< from 0
    integer(c_int32_t), intent(in) :: column(*)      !< from 0
    real(c_double), intent(in)     :: block(2, 2, *) !< [1/kg]
    integer(c_int64_t), intent(in) :: own            !< diagonal block, from 1
    real(c_double), intent(in)     :: q(2, *)        !< [m/s]
    real(c_double), intent(in)     :: mu             !< friction [-]
    real(c_double), intent(in)     :: relaxation     !< [-]
    real(c_double), intent(inout)  :: r(2, *)        !< [N s]
    real(c_double), intent(out)    :: change         !< [J]
    real(c_double) :: u(1, 2), solved(1, 2), none(1, 2), friction(1)
    integer(c_int64_t) :: k, b
    u(1, :) = q(:, a)
    do k = row_start(a) + 1, row_start(a+1)
      if (k == own) cycle
      b = column(k) + 1
      u(1, 1) = u(1, 1) + block(1, 1, k)*r(1, b) + block(1, 2, k)*r(2, b)
      u(1, 2) = u(1, 2) + block(2, 1, k)*r(1, b) + block(2, 2, k)*r(2, b)
    end do
    none = 0
    friction = mu
    solved(1, :) = r(:, a)
    call cairn_cone_full2(1_c_int32_t, 2_c_int32_t, block(:, :, own), u, none, friction, none, solved)
    call take(2_c_int32_t, block(1, 1, own), mu, relaxation, solved, r(:, a), change)
  end subroutine one2

  subroutine one3(a, row_start, column, block, own, q, mu, relaxation, r, change)
    integer(c_int64_t), intent(in) :: a              !< contact, from 1
    integer(c_int64_t), intent(in) :: row_start(*)   !< from 0
    integer(c_int32_t), intent(in) :: column(*)      !< from 0
    real(c_double), intent(in)     :: block(3, 3, *) !< [1/kg]
    integer(c_int64_t), intent(in) :: own            !< diagonal block, from 1
    real(c_double), intent(in)     :: q(3, *)        !< [m/s]
    real(c_double), intent(in)     :: mu             !< friction [-]
    real(c_double), intent(in)     :: relaxation     !< [-]
    real(c_double), intent(inout)  :: r(3, *)        !< [N s]
    real(c_double), intent(out)    :: change         !< [J]
    real(c_double) :: u(1, 3), solved(1, 3), none(1, 3), friction(1)
    integer(c_int64_t) :: k, b
    u(1, :) = q(:, a)
    do k = row_start(a) + 1, row_start(a+1)
      if (k == own) cycle
      b = column(k) + 1
      u(1, 1) = u(1, 1) + block(1, 1, k)*r(1, b) + block(1, 2, k)*r(2, b) + block(1, 3, k)*r(3, b)
      u(1, 2) = u(1, 2) + block(2, 1, k)*r(1, b) + block(2, 2, k)*r(2, b) + block(2, 3, k)*r(3, b)
      u(1, 3) = u(1, 3) + block(3, 1, k)*r(1, b) + block(3, 2, k)*r(2, b) + block(3, 3, k)*r(3, b)
    end do
    none = 0
    friction = mu
    solved(1, :) = r(:, a)
    call cairn_cone_full3(1_c_int32_t, 3_c_int32_t, block(:, :, own), u, none, friction, none, solved)
    call take(3_c_int32_t, block(1, 1, own), mu, relaxation, solved, r(:, a), change)
  end subroutine one3

  !> Goes a part of the way to the contact's own solution, or beyond it, and stays in the cone.
  pure subroutine take(dim, w_nn, mu, relaxation, solved, r, change)
    integer(c_int32_t), intent(in) :: dim         !< 2 or 3
    real(c_double), intent(in)     :: w_nn        !< [1/kg]
    real(c_double), intent(in)     :: mu          !< friction [-]
    real(c_double), intent(in)     :: relaxation  !< [-]
    real(c_double), intent(in)     :: solved(dim) !< [N s]
    real(c_double), intent(inout)  :: r(dim)      !< [N s]
    real(c_double), intent(out)    :: change      !< [J]
    real(c_double) :: next(dim)
    next = solved
    if (abs(relaxation - 1) > 0) then
      next = r + relaxation*(solved - r)
      call project_disk(dim, mu, next)
    end if
    change = w_nn*sum((next - r)**2)
    r = next
  end subroutine take
end module nlgs_blocks
