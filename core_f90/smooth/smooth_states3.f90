!> The fast way for contacts of spheres (smooth_spheres3) under laws that keep scalars and several springs, or that give moments,
!> and for spheres beside the centres of their bodies.
module smooth_states3
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int8_t, c_double
  use smooth_spheres3, only: lanes, near_lanes, load_lanes, localize, wrenches, springs_in_space, push_bodies, &
                             add_offset_moments
  implicit none
  private
  public :: cairn_sphere_gather_states, cairn_sphere_scatter_states

contains

  !> Lanes of the pairs closer than the reach of their law, with all that the law and the scatter need of them.
  pure subroutine cairn_sphere_gather_states(n, body_a, body_b, record, reach, h, scalars, vectors, states, stored, active, lane, &
                                             count, filled, frame, arm, u, gap, geometry, state) bind(c)
    integer(c_int32_t), value        :: n                !< pairs, at most 128
    integer(c_int32_t), intent(in)   :: body_a(n), body_b(n) !< from 0
    real(c_double), intent(in)       :: record(12, 0:*)  !< see smooth_spheres3
    real(c_double), value            :: reach            !< gap at which a force begins [m]
    real(c_double), value            :: h                !< step [s]
    integer(c_int32_t), value        :: scalars, vectors !< of the state
    integer(c_int32_t), value        :: states           !< numbers of a pair, at least scalars + 3 vectors
    real(c_double), intent(inout)    :: stored(states, n) !< state, vectors in space axes
    integer(c_int8_t), intent(inout) :: active(n)        !< 1: it acted in the last step
    integer(c_int32_t), intent(out)  :: lane(n + 8)      !< pairs that act, from 1
    integer(c_int32_t), intent(out)  :: count            !< how many; -1: take the general way
    integer(c_int32_t), intent(out)  :: filled           !< that, up to a multiple of eight; the rest repeats the last
    real(c_double), intent(out)      :: frame(lanes, 6)  !< normal, first tangent
    real(c_double), intent(out)      :: arm(lanes, 2)    !< from the centres of A and of B to the contact point [m]
    real(c_double), intent(out)      :: u(*)             !< (filled, 6) relative velocity and spin along n, t, s [m/s, rad/s]
    real(c_double), intent(out)      :: gap(n)           !< of the lanes [m]
    real(c_double), intent(out)      :: geometry(*)      !< (filled, 3) 0, effective radius [m], mass, 0 if both are held [kg]
    real(c_double), intent(out)      :: state(*)         !< (filled, scalars + 2 vectors) vectors along t, s
    real(c_double) :: delta(8, lanes), turn(8, lanes), total(lanes), square(lanes), spring(4, lanes), twist(lanes)
    real(c_double) :: first(2*lanes)
    integer :: k, m
    call near_lanes(n, body_a, body_b, record, reach, states, stored, active, lane, count, filled, total, square)
    if (count <= 0) return
    m = filled
    call load_lanes(n, m, lane, body_a, body_b, record, delta, turn, total, square)
    call load_scalars(n, m, lane, scalars, states, stored, state)
    if (vectors == 0) spring = 0
    if (vectors > 0) call load_vector(n, m, lane, scalars, states, stored, spring)
    call localize(m, delta, turn, total, square, spring, h, frame, arm, u, gap, geometry, first)
    if (vectors > 0) state(m*scalars + 1:m*(scalars + 2)) = first(1:2*m)
    call spins(m, turn, frame, h, u(3*m + 1:6*m), twist)
    do k = 1, vectors - 1
      call load_vector(n, m, lane, scalars + 3*k, states, stored, spring)
      call carry(m, frame, twist, spring, state(m*(scalars + 2*k) + 1:m*(scalars + 2*k + 2)))
    end do
  end subroutine cairn_sphere_gather_states

  !> Scalars of the state, four at a time.
  pure subroutine load_scalars(n, m, lane, scalars, states, stored, state)
    integer, intent(in)         :: n, m, lane(m), scalars, states
    real(c_double), intent(in)  :: stored(states, n)
    real(c_double), intent(out) :: state(m, scalars)
    real(c_double) :: four(4, lanes)
    integer :: i, k, j
    do k = 0, scalars - 4, 4
      call load_four(n, m, lane, k, states, stored, four)
      do i = 1, m
        state(i, k + 1) = four(1, i); state(i, k + 2) = four(2, i); state(i, k + 3) = four(3, i); state(i, k + 4) = four(4, i)
      end do
    end do
    do i = 1, m
      do j = scalars - mod(scalars, 4) + 1, scalars
        state(i, j) = stored(j, lane(i))
      end do
    end do
  end subroutine load_scalars

  !> Loads the spring of each pair, three numbers of its state from the place before + 1 on; four at once where the state has a
  !> fourth, which nobody reads.
  pure subroutine load_vector(n, m, lane, before, states, stored, spring)
    integer, intent(in)           :: n, m, lane(m), before, states
    real(c_double), intent(in)    :: stored(states, n)
    real(c_double), intent(inout) :: spring(4, lanes)
    integer :: i, l
    if (before + 4 <= states) then
      call load_four(n, m, lane, before, states, stored, spring)
      return
    end if
    do i = 1, m
      l = lane(i)
      spring(1, i) = stored(before + 1, l); spring(2, i) = stored(before + 2, l); spring(3, i) = stored(before + 3, l)
    end do
  end subroutine load_vector

  pure subroutine load_four(n, m, lane, before, states, stored, four)
    integer, intent(in)           :: n, m, lane(m), before, states
    real(c_double), intent(in)    :: stored(states, n)
    real(c_double), intent(inout) :: four(4, lanes)
    integer :: i, k, l
    do i = 1, m
      l = lane(i)
      !$omp simd simdlen(4)
      do k = 1, 4
        four(k, i) = stored(before + k, l)
      end do
    end do
  end subroutine load_four

  !> Relative spin along n, t, s, and half of the angle by which both bodies turned about the normal.
  pure subroutine spins(m, turn, frame, h, spin, twist)
    integer, intent(in)         :: m
    real(c_double), intent(in)  :: turn(8, lanes), frame(lanes, 6), h
    real(c_double), intent(out) :: spin(m, 3), twist(lanes) !< [rad/s, rad]
    real(c_double) :: nx, ny, nz, tx, ty, tz
    integer :: i
    !$omp simd private(nx, ny, nz, tx, ty, tz)
    do i = 1, m
      nx = frame(i, 1); ny = frame(i, 2); nz = frame(i, 3)
      tx = frame(i, 4); ty = frame(i, 5); tz = frame(i, 6)
      twist(i) = 0.5_c_double*h*(nx*turn(1, i) + ny*turn(2, i) + nz*turn(3, i))
      spin(i, 1) = nx*turn(5, i) + ny*turn(6, i) + nz*turn(7, i)
      spin(i, 2) = tx*turn(5, i) + ty*turn(6, i) + tz*turn(7, i)
      spin(i, 3) = (ny*tz - nz*ty)*turn(5, i) + (nz*tx - nx*tz)*turn(6, i) + (nx*ty - ny*tx)*turn(7, i)
    end do
  end subroutine spins

  !> A vector of the state turns into the new tangent plane at its length, and about the normal with the mean spin.
  pure subroutine carry(m, frame, twist, spring, state)
    integer, intent(in)         :: m
    real(c_double), intent(in)  :: frame(lanes, 6), twist(lanes), spring(4, lanes)
    real(c_double), intent(out) :: state(m, 2)
    real(c_double) :: nx, ny, nz, tx, ty, tz, px, py, pz, a, b, c, kept
    integer :: i
    if (idle(m, spring)) then ! laws that resist no rolling keep none
      state = 0
      return
    end if
    !$omp simd private(nx, ny, nz, tx, ty, tz, px, py, pz, a, b, c, kept)
    do i = 1, m
      nx = frame(i, 1); ny = frame(i, 2); nz = frame(i, 3)
      tx = frame(i, 4); ty = frame(i, 5); tz = frame(i, 6)
      px = spring(1, i); py = spring(2, i); pz = spring(3, i)
      c = tx*px + ty*py + tz*pz
      b = (ny*tz - nz*ty)*px + (nz*tx - nx*tz)*py + (nx*ty - ny*tx)*pz
      a = c - twist(i)*b
      b = b + twist(i)*c
      kept = sqrt((px*px + py*py + pz*pz)/max(a*a + b*b, tiny(a)))
      state(i, 1) = kept*a
      state(i, 2) = kept*b
    end do
  end subroutine carry

  !> Forces and moments of the lanes onto their bodies, states back into space axes. What acts on a body of another tile goes to
  !> other.
  pure subroutine cairn_sphere_scatter_states(n, count, m, lane, body_a, body_b, frame, arm, f, scalars, vectors, states, state, &
                                              stored, lane_force, force, other, moment, lane_moment, a, b, offset) &
    bind(c)
    integer(c_int32_t), value      :: n                 !< pairs
    integer(c_int32_t), value      :: count             !< lanes that count
    integer(c_int32_t), value      :: m                 !< lanes
    integer(c_int32_t), intent(in) :: lane(m)           !< pair of each, from 1
    integer(c_int32_t), intent(in) :: body_a(n), body_b(n)
    real(c_double), intent(in)     :: frame(lanes, 6)   !< normal, first tangent
    real(c_double), intent(in)     :: arm(lanes, 2)     !< [m]
    real(c_double), intent(in)     :: f(m, 3)           !< on A along n, t, s [N]
    integer(c_int32_t), value      :: scalars, vectors  !< of the state
    integer(c_int32_t), value      :: states            !< numbers of a pair
    real(c_double), intent(in)     :: state(m, scalars + 2*vectors) !< vectors along t, s
    real(c_double), intent(inout)  :: stored(states, n) !< state, vectors in space axes
    real(c_double), intent(inout)  :: lane_force(3, n)  !< on A in space axes [N]
    real(c_double), intent(inout)  :: force(6, 0:*)     !< on bodies [N, N m]
    real(c_double), intent(inout), optional :: other(6, n) !< on B, if it is of another tile
    real(c_double), intent(in), optional    :: moment(m, 3) !< on A along n, t, s [N m]
    real(c_double), intent(inout), optional :: lane_moment(3, n) !< on A in space axes [N m]
    integer(c_int32_t), intent(in), optional :: a(n), b(n) !< contactors, from 0
    real(c_double), intent(in), optional :: offset(4, 0:*) !< of contactors from their bodies, in space axes [m], 0
    real(c_double) :: on_a(6, lanes), on_b(6, lanes), space(3, lanes)
    integer :: i, k, l
    call wrenches(m, frame, arm, f, on_a, on_b)
    if (present(a) .and. present(b) .and. present(offset)) & ! else spheres stand at the centres of their bodies
      call add_offset_moments(n, m, lane, a, b, offset, on_a, on_b)
    if (present(moment) .and. present(lane_moment)) &
      call add_moments(n, count, m, lane, frame, moment, on_a, on_b, lane_moment)
    call store_scalars(n, count, m, lane, scalars, states, state, stored)
    do k = 0, vectors - 1
      call springs_in_space(m, frame, state(:, scalars + 2*k + 1:scalars + 2*k + 2), space)
      do i = 1, count
        l = lane(i)
        stored(scalars + 3*k + 1, l) = space(1, i)
        stored(scalars + 3*k + 2, l) = space(2, i)
        stored(scalars + 3*k + 3, l) = space(3, i)
      end do
    end do
    call push_bodies(n, count, m, lane, body_a, body_b, on_a, on_b, lane_force, force, other)
  end subroutine cairn_sphere_scatter_states

  pure subroutine store_scalars(n, count, m, lane, scalars, states, state, stored)
    integer, intent(in)           :: n, count, m, lane(m), scalars, states
    real(c_double), intent(in)    :: state(m, scalars)
    real(c_double), intent(inout) :: stored(states, n)
    real(c_double) :: four(4, lanes)
    integer :: i, j, k
    do k = 0, scalars - 4, 4
      do i = 1, m
        four(1, i) = state(i, k + 1); four(2, i) = state(i, k + 2); four(3, i) = state(i, k + 3); four(4, i) = state(i, k + 4)
      end do
      do i = 1, count
        !$omp simd simdlen(4)
        do j = 1, 4
          stored(k + j, lane(i)) = four(j, i)
        end do
      end do
    end do
    do i = 1, count
      do j = scalars - mod(scalars, 4) + 1, scalars
        stored(j, lane(i)) = state(i, j)
      end do
    end do
  end subroutine store_scalars

  pure subroutine add_moments(n, count, m, lane, frame, moment, on_a, on_b, lane_moment)
    integer, intent(in)           :: n, count, m, lane(m)
    real(c_double), intent(in)    :: frame(lanes, 6), moment(m, 3)
    real(c_double), intent(inout) :: on_a(6, lanes), on_b(6, lanes), lane_moment(3, n)
    real(c_double) :: space(3, lanes)
    integer :: i, k
    space(:, 1:m) = 0
    if (pushes(m, moment)) then
      call springs_in_space(m, frame, moment(:, 2:3), space)
      do i = 1, m
        do k = 1, 3
          space(k, i) = space(k, i) + frame(i, k)*moment(i, 1)
          on_a(3 + k, i) = on_a(3 + k, i) + space(k, i)
          on_b(3 + k, i) = on_b(3 + k, i) - space(k, i)
        end do
      end do
    end if
    do i = 1, count
      lane_moment(:, lane(i)) = space(:, i)
    end do
  end subroutine add_moments

  pure function idle(m, spring)
    integer, intent(in)        :: m
    real(c_double), intent(in) :: spring(4, lanes)
    logical :: idle
    real(c_double) :: total
    integer :: i
    total = 0
    !$omp simd reduction(+:total)
    do i = 1, m
      total = total + (abs(spring(1, i)) + abs(spring(2, i)) + abs(spring(3, i)))
    end do
    idle = total <= 0
  end function idle

  pure function pushes(m, moment)
    integer, intent(in)        :: m
    real(c_double), intent(in) :: moment(m, 3)
    logical :: pushes
    real(c_double) :: total
    integer :: i
    total = 0
    !$omp simd reduction(+:total)
    do i = 1, m
      total = total + (abs(moment(i, 1)) + abs(moment(i, 2)) + abs(moment(i, 3)))
    end do
    pushes = .not. total <= 0
  end function pushes
end module smooth_states3
