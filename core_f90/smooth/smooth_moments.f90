!> Laws of smooth contacts that resist rolling and twisting: relative spins before the law, moments on bodies after it.
module smooth_moments
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: cairn_smooth_spins, cairn_smooth_moments
contains

  !> Spin of A less that of B: in 2D one number, in 3D along n, t, s.
  pure subroutine cairn_smooth_spins(dim, n, m, lane, body_a, body_b, velocity, frame, spin) bind(c)
    integer(c_int32_t), value      :: dim               !< 2 or 3
    integer(c_int32_t), value      :: n                 !< pairs of the batch
    integer(c_int32_t), value      :: m                 !< lanes
    integer(c_int32_t), intent(in) :: lane(m)           !< pair of each, from 1
    integer(c_int32_t), intent(in) :: body_a(n), body_b(n) !< from 0
    real(c_double), intent(in)     :: velocity(3*dim - 3, 0:*) !< at the middle of the step [m/s, rad/s]
    real(c_double), intent(in)     :: frame(m, 4*dim - 6) !< normal; in 3D first tangent
    real(c_double), intent(out)    :: spin(m, 2*dim - 3) !< [rad/s]
    real(c_double) :: w(3), s(3)
    integer :: i, ia, ib
    do i = 1, m
      ia = body_a(lane(i)); ib = body_b(lane(i))
      if (dim == 2) then
        spin(i, 1) = velocity(3, ia) - velocity(3, ib)
        cycle
      end if
      w = velocity(4:6, ia) - velocity(4:6, ib)
      s = second(frame(i, 1:3), frame(i, 4:6))
      spin(i, 1) = dot_product(frame(i, 1:3), w)
      spin(i, 2) = dot_product(frame(i, 4:6), w)
      spin(i, 3) = dot_product(s, w)
    end do
  end subroutine cairn_smooth_spins

  !> Moments of the lanes onto their bodies. What acts on a body of another tile goes to other.
  pure subroutine cairn_smooth_moments(dim, n, count, m, lane, body_a, body_b, frame, moment, lane_moment, force, other) bind(c)
    integer(c_int32_t), value      :: dim               !< 2 or 3
    integer(c_int32_t), value      :: n                 !< pairs of the batch
    integer(c_int32_t), value      :: count             !< lanes that count
    integer(c_int32_t), value      :: m                 !< lanes
    integer(c_int32_t), intent(in) :: lane(m)           !< pair of each, from 1
    integer(c_int32_t), intent(in) :: body_a(n), body_b(n)
    real(c_double), intent(in)     :: frame(m, 4*dim - 6) !< normal; in 3D first tangent
    real(c_double), intent(in)     :: moment(m, 2*dim - 3) !< on A, in 3D along n, t, s [N m]
    real(c_double), intent(inout)  :: lane_moment(2*dim - 3, n) !< on A in space axes [N m]
    real(c_double), intent(inout)  :: force(3*dim - 3, 0:*) !< on bodies [N, N m]
    real(c_double), intent(inout), optional :: other(3*dim - 3, n) !< on B, if it is of another tile
    real(c_double) :: space(3)
    integer :: i, l, from, nd, k
    nd = 3*dim - 3
    from = dim + 1
    k = nd - dim
    do i = 1, count
      l = lane(i)
      if (dim == 2) then
        space(1) = moment(i, 1)
      else
        space = frame(i, 1:3)*moment(i, 1) + frame(i, 4:6)*moment(i, 2) &
                + second(frame(i, 1:3), frame(i, 4:6))*moment(i, 3)
      end if
      lane_moment(:, l) = space(1:k)
      force(from:nd, body_a(l)) = force(from:nd, body_a(l)) + space(1:k)
      if (present(other)) then
        other(from:nd, l) = other(from:nd, l) - space(1:k)
      else
        force(from:nd, body_b(l)) = force(from:nd, body_b(l)) - space(1:k)
      end if
    end do
  end subroutine cairn_smooth_moments

  pure function second(n, t) result(s)
    real(c_double), intent(in) :: n(3), t(3)
    real(c_double) :: s(3)
    s = [n(2)*t(3) - n(3)*t(2), n(3)*t(1) - n(1)*t(3), n(1)*t(2) - n(2)*t(1)]
  end function second
end module smooth_moments
