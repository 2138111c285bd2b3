!> Contacts that act in a smooth scene, in 2D: relative velocities in the local frame before the law, forces on bodies after it.
module smooth_contacts2
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_smooth_gather2, cairn_smooth_scatter2
contains

  !> Relative velocity, geometry and state of the lanes that act; a tangential vector of the state is a number, and turns by itself.
  pure subroutine cairn_smooth_gather2(n, m, lane, body_a, body_b, velocity, grain_a, grain_b, gap, normal, lever_a, lever_b, &
                                       h, scalars, vectors, stored, frame, u, lane_gap, geometry, state, jump) bind(c)
    integer(c_int32_t), value      :: n                 !< pairs of the batch
    integer(c_int32_t), value      :: m                 !< lanes, a multiple of eight
    integer(c_int32_t), intent(in) :: lane(m)           !< pair of each, from 1
    integer(c_int32_t), intent(in) :: body_a(n), body_b(n) !< from 0
    real(c_double), intent(in)     :: velocity(3, 0:*)  !< at the middle of the step [m/s, rad/s]
    real(c_double), intent(in)     :: grain_a(n, 2), grain_b(n, 2) !< curvature [1/m], inverse mass, 0 if held [1/kg]
    real(c_double), intent(in)     :: gap(n)            !< [m]
    real(c_double), intent(in)     :: normal(n, 2)      !< unit, from B to A
    real(c_double), intent(in)     :: lever_a(n, 2), lever_b(n, 2) !< from the centre of the body to the contact point [m]
    real(c_double), value          :: h                 !< step [s]
    integer(c_int32_t), value      :: scalars, vectors  !< of the state
    real(c_double), intent(in)     :: stored(scalars + vectors, n) !< state
    real(c_double), intent(out)    :: frame(m, 2)       !< normal
    real(c_double), intent(out)    :: u(m, 2)           !< relative velocity along n, t [m/s]
    real(c_double), intent(out)    :: lane_gap(m)       !< [m]
    real(c_double), intent(out)    :: geometry(m, 3)    !< 0, effective radius [m], effective mass [kg], 0 if both are held
    real(c_double), intent(out)    :: state(m, scalars + vectors)
    real(c_double), intent(in), optional :: jump(n, 2)  !< velocity of the image of B [m/s]
    real(c_double) :: ux, uy
    integer :: i, k, l, ia, ib
    do i = 1, m
      l = lane(i); ia = body_a(l); ib = body_b(l)
      ux = velocity(1, ia) - velocity(1, ib) - velocity(3, ia)*lever_a(l, 2) + velocity(3, ib)*lever_b(l, 2)
      uy = velocity(2, ia) - velocity(2, ib) + velocity(3, ia)*lever_a(l, 1) - velocity(3, ib)*lever_b(l, 1)
      if (present(jump)) then
        ux = ux - jump(l, 1); uy = uy - jump(l, 2)
      end if
      frame(i, 1) = normal(l, 1); frame(i, 2) = normal(l, 2)
      u(i, 1) = normal(l, 1)*ux + normal(l, 2)*uy
      u(i, 2) = normal(l, 1)*uy - normal(l, 2)*ux
      lane_gap(i) = gap(l)
      geometry(i, 1) = 0
      geometry(i, 2) = 1/(grain_a(l, 1) + grain_b(l, 1))
      geometry(i, 3) = merge(1/max(grain_a(l, 2) + grain_b(l, 2), tiny(ux)), 0.0_c_double, grain_a(l, 2) + grain_b(l, 2) > 0)
    end do
    do k = 1, scalars + vectors
      do i = 1, m
        state(i, k) = stored(k, lane(i))
      end do
    end do
  end subroutine cairn_smooth_gather2

  !> Forces of the lanes onto their bodies, and their state back. What acts on a body of another tile goes to other.
  pure subroutine cairn_smooth_scatter2(n, count, m, lane, body_a, body_b, lever_a, lever_b, frame, f, scalars, vectors, state, &
                                        stored, lane_force, force, other) bind(c)
    integer(c_int32_t), value      :: n                 !< pairs of the batch
    integer(c_int32_t), value      :: count             !< lanes that count
    integer(c_int32_t), value      :: m                 !< lanes
    integer(c_int32_t), intent(in) :: lane(m)           !< pair of each, from 1
    integer(c_int32_t), intent(in) :: body_a(n), body_b(n)
    real(c_double), intent(in)     :: lever_a(n, 2), lever_b(n, 2) !< [m]
    real(c_double), intent(in)     :: frame(m, 2)       !< normal
    real(c_double), intent(in)     :: f(m, 2)           !< on A along n, t [N]
    integer(c_int32_t), value      :: scalars, vectors  !< of the state
    real(c_double), intent(in)     :: state(m, scalars + vectors)
    real(c_double), intent(inout)  :: stored(scalars + vectors, n)
    real(c_double), intent(inout)  :: lane_force(2, n)  !< on A in space axes [N]
    real(c_double), intent(inout)  :: force(3, 0:*)     !< on bodies [N, N m]
    real(c_double), intent(inout), optional :: other(3, n) !< on B, if it is of another tile
    real(c_double) :: x, y, torque_a, torque_b
    integer :: i, l
    do i = 1, count
      l = lane(i)
      x = frame(i, 1)*f(i, 1) - frame(i, 2)*f(i, 2)
      y = frame(i, 2)*f(i, 1) + frame(i, 1)*f(i, 2)
      torque_a = lever_a(l, 1)*y - lever_a(l, 2)*x
      torque_b = lever_b(l, 1)*y - lever_b(l, 2)*x
      lane_force(:, l) = [x, y]
      stored(:, l) = state(i, :)
      force(:, body_a(l)) = force(:, body_a(l)) + [x, y, torque_a]
      if (present(other)) then
        other(:, l) = [-x, -y, -torque_b]
      else
        force(:, body_b(l)) = force(:, body_b(l)) - [x, y, torque_b]
      end if
    end do
  end subroutine cairn_smooth_scatter2
end module smooth_contacts2
