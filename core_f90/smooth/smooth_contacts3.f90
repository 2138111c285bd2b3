!> Contacts that act in a smooth scene, in 3D: relative velocities in the local frame before the law, forces on bodies after it.
module smooth_contacts3
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_smooth_gather3, cairn_smooth_scatter3
contains

  !> Frame, relative velocity, geometry and state of the lanes that act. The tangential vectors of the state turn with the
  !> contact: into its new tangent plane at their length, and about its normal with the mean spin of the bodies.
  pure subroutine cairn_smooth_gather3(n, m, lane, body_a, body_b, velocity, grain_a, grain_b, gap, normal, lever_a, lever_b, &
                                       h, scalars, vectors, stored, frame, u, lane_gap, geometry, state, jump) bind(c)
    integer(c_int32_t), value      :: n                 !< pairs of the batch
    integer(c_int32_t), value      :: m                 !< lanes, a multiple of eight
    integer(c_int32_t), intent(in) :: lane(m)           !< pair of each, from 1
    integer(c_int32_t), intent(in) :: body_a(n), body_b(n) !< from 0
    real(c_double), intent(in)     :: velocity(6, 0:*)  !< at the middle of the step [m/s, rad/s]
    real(c_double), intent(in)     :: grain_a(n, 2), grain_b(n, 2) !< curvature [1/m], inverse mass, 0 if held [1/kg]
    real(c_double), intent(in)     :: gap(n)            !< [m]
    real(c_double), intent(in)     :: normal(n, 3)      !< unit, from B to A
    real(c_double), intent(in)     :: lever_a(n, 3), lever_b(n, 3) !< from the centre of the body to the contact point [m]
    real(c_double), value          :: h                 !< step [s]
    integer(c_int32_t), value      :: scalars, vectors  !< of the state
    real(c_double), intent(in)     :: stored(scalars + 3*vectors, n) !< state, vectors in space axes
    real(c_double), intent(out)    :: frame(m, 6)       !< normal, first tangent
    real(c_double), intent(out)    :: u(m, 3)           !< relative velocity along n, t, s [m/s]
    real(c_double), intent(out)    :: lane_gap(m)       !< [m]
    real(c_double), intent(out)    :: geometry(m, 3)    !< 0, effective radius [m], effective mass [kg], 0 if both are held
    real(c_double), intent(out)    :: state(m, scalars + 2*vectors) !< vectors along t, s
    real(c_double), intent(in), optional :: jump(n, 3)  !< velocity of the image of B [m/s]
    real(c_double) :: nx, ny, nz, tx, ty, tz, sx, sy, sz, ux, uy, uz, turn, a, b, c, x, y, z, w
    integer :: i, k, l, ia, ib
    !$omp simd private(l, ia, ib, nx, ny, nz, tx, ty, tz, sx, sy, sz, ux, uy, uz, a, b, w)
    do i = 1, m
      l = lane(i); ia = body_a(l); ib = body_b(l)
      nx = normal(l, 1); ny = normal(l, 2); nz = normal(l, 3)
      w = sign(1.0_c_double, nz)
      a = -1/(w + nz)
      b = nx*ny*a
      tx = 1 + w*nx*nx*a; ty = w*b; tz = -w*nx
      sx = b; sy = w + ny*ny*a; sz = -ny
      frame(i, 1) = nx; frame(i, 2) = ny; frame(i, 3) = nz
      frame(i, 4) = tx; frame(i, 5) = ty; frame(i, 6) = tz
      ux = velocity(1, ia) - velocity(1, ib) + (velocity(5, ia)*lever_a(l, 3) - velocity(6, ia)*lever_a(l, 2)) &
           - (velocity(5, ib)*lever_b(l, 3) - velocity(6, ib)*lever_b(l, 2))
      uy = velocity(2, ia) - velocity(2, ib) + (velocity(6, ia)*lever_a(l, 1) - velocity(4, ia)*lever_a(l, 3)) &
           - (velocity(6, ib)*lever_b(l, 1) - velocity(4, ib)*lever_b(l, 3))
      uz = velocity(3, ia) - velocity(3, ib) + (velocity(4, ia)*lever_a(l, 2) - velocity(5, ia)*lever_a(l, 1)) &
           - (velocity(4, ib)*lever_b(l, 2) - velocity(5, ib)*lever_b(l, 1))
      if (present(jump)) then
        ux = ux - jump(l, 1); uy = uy - jump(l, 2); uz = uz - jump(l, 3)
      end if
      u(i, 1) = nx*ux + ny*uy + nz*uz
      u(i, 2) = tx*ux + ty*uy + tz*uz
      u(i, 3) = sx*ux + sy*uy + sz*uz
      lane_gap(i) = gap(l)
      geometry(i, 1) = 0
      geometry(i, 2) = 1/(grain_a(l, 1) + grain_b(l, 1))
      geometry(i, 3) = merge(1/max(grain_a(l, 2) + grain_b(l, 2), tiny(a)), 0.0_c_double, grain_a(l, 2) + grain_b(l, 2) > 0)
    end do
    do k = 1, scalars
      do i = 1, m
        state(i, k) = stored(k, lane(i))
      end do
    end do
    do k = 0, vectors - 1
      !$omp simd private(l, ia, ib, nx, ny, nz, tx, ty, tz, turn, a, b, c, x, y, z)
      do i = 1, m
        l = lane(i); ia = body_a(l); ib = body_b(l)
        nx = frame(i, 1); ny = frame(i, 2); nz = frame(i, 3)
        tx = frame(i, 4); ty = frame(i, 5); tz = frame(i, 6)
        turn = 0.5_c_double*h*(nx*(velocity(4, ia) + velocity(4, ib)) + ny*(velocity(5, ia) + velocity(5, ib)) &
                               + nz*(velocity(6, ia) + velocity(6, ib)))
        x = stored(scalars + 3*k + 1, l); y = stored(scalars + 3*k + 2, l); z = stored(scalars + 3*k + 3, l)
        a = tx*x + ty*y + tz*z
        b = (ny*tz - nz*ty)*x + (nz*tx - nx*tz)*y + (nx*ty - ny*tx)*z
        c = a - turn*b
        b = b + turn*a
        a = c*c + b*b
        a = merge(sqrt((x*x + y*y + z*z)/max(a, tiny(a))), 1.0_c_double, a > 0)
        state(i, scalars + 2*k + 1) = a*c
        state(i, scalars + 2*k + 2) = a*b
      end do
    end do
  end subroutine cairn_smooth_gather3

  !> Forces of the lanes onto their bodies; their state back into space axes. What acts on a body of another tile goes to other.
  pure subroutine cairn_smooth_scatter3(n, count, m, lane, body_a, body_b, lever_a, lever_b, frame, f, scalars, vectors, state, &
                                        stored, lane_force, force, other) bind(c)
    integer(c_int32_t), value      :: n                 !< pairs of the batch
    integer(c_int32_t), value      :: count             !< lanes that count
    integer(c_int32_t), value      :: m                 !< lanes
    integer(c_int32_t), intent(in) :: lane(m)           !< pair of each, from 1
    integer(c_int32_t), intent(in) :: body_a(n), body_b(n)
    real(c_double), intent(in)     :: lever_a(n, 3), lever_b(n, 3) !< [m]
    real(c_double), intent(in)     :: frame(m, 6)       !< normal, first tangent
    real(c_double), intent(in)     :: f(m, 3)           !< on A along n, t, s [N]
    integer(c_int32_t), value      :: scalars, vectors  !< of the state
    real(c_double), intent(in)     :: state(m, scalars + 2*vectors)
    real(c_double), intent(inout)  :: stored(scalars + 3*vectors, n)
    real(c_double), intent(inout)  :: lane_force(3, n)  !< on A in space axes [N]
    real(c_double), intent(inout)  :: force(6, 0:*)     !< on bodies [N, N m]
    real(c_double), intent(inout), optional :: other(6, n) !< on B, if it is of another tile
    real(c_double) :: s(m, 3), space(m, 3), torque_a(m, 3), torque_b(m, 3)
    integer :: i, k, l
    !$omp simd private(l)
    do i = 1, m
      l = lane(i)
      s(i, 1) = frame(i, 2)*frame(i, 6) - frame(i, 3)*frame(i, 5)
      s(i, 2) = frame(i, 3)*frame(i, 4) - frame(i, 1)*frame(i, 6)
      s(i, 3) = frame(i, 1)*frame(i, 5) - frame(i, 2)*frame(i, 4)
      space(i, 1) = frame(i, 1)*f(i, 1) + frame(i, 4)*f(i, 2) + s(i, 1)*f(i, 3)
      space(i, 2) = frame(i, 2)*f(i, 1) + frame(i, 5)*f(i, 2) + s(i, 2)*f(i, 3)
      space(i, 3) = frame(i, 3)*f(i, 1) + frame(i, 6)*f(i, 2) + s(i, 3)*f(i, 3)
      torque_a(i, 1) = lever_a(l, 2)*space(i, 3) - lever_a(l, 3)*space(i, 2)
      torque_a(i, 2) = lever_a(l, 3)*space(i, 1) - lever_a(l, 1)*space(i, 3)
      torque_a(i, 3) = lever_a(l, 1)*space(i, 2) - lever_a(l, 2)*space(i, 1)
      torque_b(i, 1) = lever_b(l, 2)*space(i, 3) - lever_b(l, 3)*space(i, 2)
      torque_b(i, 2) = lever_b(l, 3)*space(i, 1) - lever_b(l, 1)*space(i, 3)
      torque_b(i, 3) = lever_b(l, 1)*space(i, 2) - lever_b(l, 2)*space(i, 1)
    end do
    do i = 1, count
      l = lane(i)
      lane_force(:, l) = space(i, :)
      do k = 1, scalars
        stored(k, l) = state(i, k)
      end do
      do k = 0, vectors - 1
        stored(scalars + 3*k + 1:scalars + 3*k + 3, l) = frame(i, 4:6)*state(i, scalars + 2*k + 1) &
                                                         + s(i, :)*state(i, scalars + 2*k + 2)
      end do
      force(1:3, body_a(l)) = force(1:3, body_a(l)) + space(i, :)
      force(4:6, body_a(l)) = force(4:6, body_a(l)) + torque_a(i, :)
      if (present(other)) then
        other(1:3, l) = -space(i, :)
        other(4:6, l) = -torque_b(i, :)
      else
        force(1:3, body_b(l)) = force(1:3, body_b(l)) - space(i, :)
        force(4:6, body_b(l)) = force(4:6, body_b(l)) - torque_b(i, :)
      end if
    end do
  end subroutine cairn_smooth_scatter3
end module smooth_contacts3
