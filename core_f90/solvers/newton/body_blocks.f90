!> Contacts on bodies without forming W: u = W r + q with W = H' A^-1 H by a pass over contacts and a pass over bodies; and the
!> blocks of W for solvers that need them.
module body_blocks
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_body_impulses, cairn_body_velocities, cairn_body_product, cairn_body_blocks
contains

  !> p = H r
  subroutine cairn_body_impulses(dim, dofs, n, nb, body, rows, r, p) bind(c)
    integer(c_int32_t), value      :: dim          !< components of a contact, 2 or 3
    integer(c_int32_t), value      :: dofs         !< of a body, 3 or 6
    integer(c_int64_t), value      :: n            !< contacts
    integer(c_int64_t), value      :: nb           !< bodies
    integer(c_int32_t), intent(in) :: body(2, n)   !< from 0; -1: does not move
    real(c_double), intent(in)     :: rows(dim, dofs, 2, n) !< H' of each side, its sign in it [-], [m]
    real(c_double), intent(in)     :: r(dim, n)    !< impulse [N s]
    real(c_double), intent(out)    :: p(dofs, nb)  !< of bodies [N s], [N m s]
    ! loops of known lengths
    if (dim == 2) then
      call sum_impulses(2_c_int32_t, 3_c_int32_t, n, nb, body, rows, r, p)
    else
      call sum_impulses(3_c_int32_t, 6_c_int32_t, n, nb, body, rows, r, p)
    end if
  end subroutine cairn_body_impulses

  pure subroutine sum_impulses(dim, dofs, n, nb, body, rows, r, p)
    integer(c_int32_t), value      :: dim, dofs
    integer(c_int64_t), intent(in) :: n, nb
    integer(c_int32_t), intent(in) :: body(2, n)
    real(c_double), intent(in)     :: rows(dim, dofs, 2, n), r(dim, n)
    real(c_double), intent(out)    :: p(dofs, nb)
    integer(c_int64_t) :: a, b
    integer :: s, k, c
    real(c_double) :: sum
    p = 0
    do a = 1, n
      do s = 1, 2
        b = body(s, a) + 1
        if (b < 1) cycle
        do k = 1, dofs
          sum = 0
          do c = 1, dim
            sum = sum + rows(c, k, s, a)*r(c, a)
          end do
          p(k, b) = p(k, b) + sum
        end do
      end do
    end do
  end subroutine sum_impulses

  !> u = H'v + q
  subroutine cairn_body_velocities(dim, dofs, n, nb, body, rows, v, q, u) bind(c)
    integer(c_int32_t), value      :: dim          !< components of a contact, 2 or 3
    integer(c_int32_t), value      :: dofs         !< of a body, 3 or 6
    integer(c_int64_t), value      :: n            !< contacts
    integer(c_int64_t), value      :: nb           !< bodies
    integer(c_int32_t), intent(in) :: body(2, n)   !< from 0; -1: does not move
    real(c_double), intent(in)     :: rows(dim, dofs, 2, n) !< see above
    real(c_double), intent(in)     :: v(dofs, nb)  !< of bodies [m/s], [rad/s]
    real(c_double), intent(in)     :: q(dim, n)    !< [m/s]
    real(c_double), intent(out)    :: u(dim, n)    !< [m/s]
    ! loops of known lengths
    if (dim == 2) then
      call add_velocities(2_c_int32_t, 3_c_int32_t, n, nb, body, rows, v, q, u)
    else
      call add_velocities(3_c_int32_t, 6_c_int32_t, n, nb, body, rows, v, q, u)
    end if
  end subroutine cairn_body_velocities

  pure subroutine add_velocities(dim, dofs, n, nb, body, rows, v, q, u)
    integer(c_int32_t), value      :: dim, dofs
    integer(c_int64_t), intent(in) :: n, nb
    integer(c_int32_t), intent(in) :: body(2, n)
    real(c_double), intent(in)     :: rows(dim, dofs, 2, n), v(dofs, nb), q(dim, n)
    real(c_double), intent(out)    :: u(dim, n)
    integer(c_int64_t) :: a, b
    integer :: s, k
    do a = 1, n
      u(:, a) = q(:, a)
      do s = 1, 2
        b = body(s, a) + 1
        if (b < 1) cycle
        do k = 1, dofs
          u(:, a) = u(:, a) + rows(:, k, s, a)*v(k, b)
        end do
      end do
    end do
  end subroutine add_velocities

  !> u = W r + q
  subroutine cairn_body_product(dim, dofs, n, nb, body, rows, inverse, r, q, v, u) bind(c)
    integer(c_int32_t), value      :: dim          !< components of a contact, 2 or 3
    integer(c_int32_t), value      :: dofs         !< of a body, 3 or 6
    integer(c_int64_t), value      :: n            !< contacts
    integer(c_int64_t), value      :: nb           !< bodies
    integer(c_int32_t), intent(in) :: body(2, n)   !< from 0; -1: does not move
    real(c_double), intent(in)     :: rows(dim, dofs, 2, n) !< see above
    real(c_double), intent(in)     :: inverse(dofs, dofs, nb) !< A^-1 [1/kg], [1/(kg m2)]
    real(c_double), intent(in)     :: r(dim, n)    !< impulse [N s]
    real(c_double), intent(in)     :: q(dim, n)    !< [m/s]
    real(c_double), intent(inout)  :: v(dofs, nb)  !< workspace: velocities that r makes
    real(c_double), intent(out)    :: u(dim, n)    !< [m/s]
    real(c_double) :: p(6)
    integer(c_int64_t) :: b
    integer :: k
    call cairn_body_impulses(dim, dofs, n, nb, body, rows, r, v)
    do b = 1, nb
      p(:dofs) = v(:, b)
      v(:, b) = 0
      do k = 1, dofs
        v(:, b) = v(:, b) + inverse(:, k, b)*p(k)
      end do
    end do
    call cairn_body_velocities(dim, dofs, n, nb, body, rows, v, q, u)
  end subroutine cairn_body_product

  !> Blocks of W on a pattern of rows.
  subroutine cairn_body_blocks(dim, dofs, n, nb, body, rows, inverse, row_start, column, block) bind(c)
    integer(c_int32_t), value      :: dim          !< components of a contact, 2 or 3
    integer(c_int32_t), value      :: dofs         !< of a body, 3 or 6
    integer(c_int64_t), value      :: n            !< contacts
    integer(c_int64_t), value      :: nb           !< bodies
    integer(c_int32_t), intent(in) :: body(2, n)   !< from 0; -1: does not move
    real(c_double), intent(in)     :: rows(dim, dofs, 2, n) !< see above
    real(c_double), intent(in)     :: inverse(dofs, dofs, nb) !< A^-1 [1/kg], [1/(kg m2)]
    integer(c_int64_t), intent(in) :: row_start(n+1) !< from 0
    integer(c_int32_t), intent(in) :: column(*)    !< from 0
    real(c_double), intent(out)    :: block(dim, dim, *) !< [1/kg]
    real(c_double) :: turned(dim, dofs, 2)
    integer(c_int64_t) :: a, b, e
    integer :: s, t
    do a = 1, n
      do s = 1, 2
        if (body(s, a) >= 0) turned(:, :, s) = matmul(rows(:, :, s, a), inverse(:, :, body(s, a)+1))
      end do
      do e = row_start(a) + 1, row_start(a+1)
        b = column(e) + 1
        block(:, :, e) = 0
        do s = 1, 2
          do t = 1, 2
            if (body(s, a) < 0 .or. body(s, a) /= body(t, b)) cycle
            block(:, :, e) = block(:, :, e) + matmul(turned(:, :, s), transpose(rows(:, :, t, b)))
          end do
        end do
      end do
    end do
  end subroutine cairn_body_blocks
end module body_blocks
