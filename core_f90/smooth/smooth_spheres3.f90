!> The fast way for contacts of spheres that are centred on their bodies: smooth_contacts3 does the same for all shapes.
!> A sphere is one record of 12 numbers: x y z r, velocity (3), 0, spin (3), inverse mass (0 if it is held). What a contact needs of
!> two spheres are the differences of all and the sums of the last four. Spheres beside the centres of their bodies, as those of
!> clumps, have the velocity of their own centre, so that contacts see no difference; forces alone return to the body.
module smooth_spheres3
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_int8_t, c_double
  implicit none
  private
  public :: cairn_sphere_records, cairn_clump_records, cairn_sphere_gather, cairn_sphere_scatter, near_lanes, load_lanes, &
            localize, wrenches, springs_in_space, push_bodies, add_offset_moments

  integer, parameter, public :: lanes = 128
  ! Between these squares of distances neither digits nor range are lost; beyond, the general way is taken.
  real(c_double), parameter :: shortest = 2.0_c_double**(-900), longest = 2.0_c_double**1000

contains

  !> Records of the bodies as they are.
  pure subroutine cairn_sphere_records(first, last, position, velocity, radius, inverse_mass, record) bind(c)
    integer(c_int64_t), value     :: first, last          !< bodies first to last - 1
    real(c_double), intent(in)    :: position(3, 0:*)     !< [m]
    real(c_double), intent(in)    :: velocity(6, 0:*)     !< [m/s, rad/s]
    real(c_double), intent(in)    :: radius(0:*)          !< 0 if it is no sphere [m]
    real(c_double), intent(in)    :: inverse_mass(6, 0:*) !< [1/kg]
    real(c_double), intent(inout) :: record(12, 0:*)
    integer(c_int64_t) :: i
    do i = first, last - 1
      record(1:3, i) = position(:, i)
      record(4, i) = radius(i)
      record(5:7, i) = velocity(1:3, i)
      record(8, i) = 0
      record(9:11, i) = velocity(4:6, i)
      record(12, i) = inverse_mass(1, i)
    end do
  end subroutine cairn_sphere_records

  !> Records of spheres that stand beside the centres of their bodies, one a contactor, and their offsets in space axes.
  pure subroutine cairn_clump_records(first, last, body, centre, radius, grain, position, velocity, record, offset) bind(c)
    integer(c_int64_t), value      :: first, last       !< contactors first to last - 1
    integer(c_int32_t), intent(in) :: body(0:*)         !< body that carries the contactor
    real(c_double), intent(in)     :: centre(3, 0:*)    !< of contactors [m]
    real(c_double), intent(in)     :: radius(0:*)       !< of contactors [m]
    real(c_double), intent(in)     :: grain(2, 0:*)     !< of contactors: curvature [1/m], inverse mass, 0 if held [1/kg]
    real(c_double), intent(in)     :: position(3, 0:*)  !< of bodies [m]
    real(c_double), intent(in)     :: velocity(6, 0:*)  !< of bodies [m/s, rad/s]
    real(c_double), intent(inout)  :: record(12, 0:*)   !< of contactors
    real(c_double), intent(inout)  :: offset(4, 0:*)    !< from the centre of the body to that of the contactor [m], 0
    real(c_double) :: o(3), w(3)
    integer(c_int64_t) :: i, k
    ! the last few of a vectorised loop would round products and sums otherwise than those before them
    !GCC$ novector
    do i = first, last - 1
      k = body(i)
      o = centre(:, i) - position(:, k)
      w = velocity(4:6, k)
      record(1:3, i) = centre(:, i)
      record(4, i) = radius(i)
      record(5, i) = velocity(1, k) + (w(2)*o(3) - w(3)*o(2))
      record(6, i) = velocity(2, k) + (w(3)*o(1) - w(1)*o(3))
      record(7, i) = velocity(3, k) + (w(1)*o(2) - w(2)*o(1))
      record(8, i) = 0
      record(9:11, i) = w
      record(12, i) = grain(2, i)
      offset(1:3, i) = o
      offset(4, i) = 0
    end do
  end subroutine cairn_clump_records

  !> Lanes of the pairs closer than the reach of their law, with all that the law and the scatter need of them.
  pure subroutine cairn_sphere_gather(n, body_a, body_b, record, reach, h, stored, active, lane, count, filled, frame, arm, u, &
                                      gap, geometry, state) bind(c)
    integer(c_int32_t), value        :: n                !< pairs, at most 128
    integer(c_int32_t), intent(in)   :: body_a(n), body_b(n) !< from 0
    real(c_double), intent(in)       :: record(12, 0:*)
    real(c_double), value            :: reach            !< gap at which a force begins [m]
    real(c_double), value            :: h                !< step [s]
    real(c_double), intent(inout)    :: stored(3, n)     !< tangential spring in space axes [m]
    integer(c_int8_t), intent(inout) :: active(n)        !< 1: it acted in the last step
    integer(c_int32_t), intent(out)  :: lane(n + 8)      !< pairs that act, from 1
    integer(c_int32_t), intent(out)  :: count            !< how many; -1: take the general way
    integer(c_int32_t), intent(out)  :: filled           !< that, up to a multiple of eight; the rest repeats the last
    real(c_double), intent(out)      :: frame(lanes, 6)  !< normal, first tangent
    real(c_double), intent(out)      :: arm(lanes, 2)    !< from the centres of A and of B to the contact point [m]
    real(c_double), intent(out)      :: u(*)             !< (filled, 3) relative velocity along n, t, s [m/s]
    real(c_double), intent(out)      :: gap(n)           !< of the lanes [m]
    real(c_double), intent(out)      :: geometry(*)      !< (filled, 3) 0, effective radius [m], mass, 0 if both are held [kg]
    real(c_double), intent(out)      :: state(*)         !< (filled, 2) spring along t, s [m]
    real(c_double) :: delta(8, lanes), turn(8, lanes), total(lanes), square(lanes), spring(4, lanes)
    integer :: i, l
    call near_lanes(n, body_a, body_b, record, reach, 3_c_int32_t, stored, active, lane, count, filled, total, square)
    if (count <= 0) return
    call load_lanes(n, filled, lane, body_a, body_b, record, delta, turn, total, square)
    do i = 1, filled
      l = lane(i)
      spring(1, i) = stored(1, l); spring(2, i) = stored(2, l); spring(3, i) = stored(3, l)
    end do
    call localize(filled, delta, turn, total, square, spring, h, frame, arm, u, gap, geometry, state)
  end subroutine cairn_sphere_gather

  !> Lanes of the pairs closer than the reach of their law; the others forget.
  pure subroutine near_lanes(n, body_a, body_b, record, reach, states, stored, active, lane, count, filled, total, square)
    integer(c_int32_t), intent(in)   :: n                !< pairs, at most 128
    integer(c_int32_t), intent(in)   :: body_a(n), body_b(n) !< from 0
    real(c_double), intent(in)       :: record(12, 0:*)
    real(c_double), intent(in)       :: reach            !< gap at which a force begins [m]
    integer(c_int32_t), intent(in)   :: states           !< numbers of a pair
    real(c_double), intent(inout)    :: stored(states, n)
    integer(c_int8_t), intent(inout) :: active(n)        !< 1: it acted in the last step
    integer(c_int32_t), intent(out)  :: lane(n + 8)      !< pairs that act, from 1
    integer(c_int32_t), intent(out)  :: count            !< how many; -1: distances beyond the range of their squares
    integer(c_int32_t), intent(out)  :: filled           !< that, up to a multiple of eight; the rest repeats the last
    real(c_double), intent(out)      :: total(lanes)     !< of the pairs, sum of radii [m]
    real(c_double), intent(out)      :: square(lanes)    !< of the pairs, of the distance [m2]
    real(c_double) :: between(4, lanes), nearest, farthest
    integer(c_int8_t) :: near(lanes)
    integer :: i, k, ia, ib
    do i = 1, n
      ia = body_a(i); ib = body_b(i)
      !$omp simd simdlen(4)
      do k = 1, 4
        between(k, i) = record(k, ia) - record(k, ib)
      end do
      total(i) = record(4, ia) + record(4, ib)
    end do
    nearest = longest
    farthest = shortest
    !$omp simd reduction(min:nearest) reduction(max:farthest)
    do i = 1, n
      square(i) = between(1, i)*between(1, i) + between(2, i)*between(2, i) + between(3, i)*between(3, i)
      nearest = min(nearest, square(i))
      farthest = max(farthest, square(i))
    end do
    filled = 0
    count = -1
    if (nearest < shortest .or. farthest > longest) return
    count = 0
    do i = 1, n
      near(i) = merge(1_c_int8_t, 0_c_int8_t, square(i) < (total(i) + reach)**2)
    end do
    if (any(active(1:n) > near(1:n))) then
      do i = 1, n
        if (active(i) > near(i)) stored(:, i) = 0
      end do
    end if
    active(1:n) = near(1:n)
    k = 0 ! without a branch, for it would be hard to foresee
    do i = 1, n
      lane(k + 1) = i
      k = k + near(i)
    end do
    count = k
    if (count == 0) return
    filled = iand(count + 7, -8)
    lane(count + 1:filled) = lane(count)
  end subroutine near_lanes

  !> Differences of the records of each lane, sums of their last four numbers.
  pure subroutine load_lanes(n, m, lane, body_a, body_b, record, delta, turn, total, square)
    integer(c_int32_t), intent(in) :: n                !< pairs
    integer(c_int32_t), intent(in) :: m                !< lanes
    integer(c_int32_t), intent(in) :: lane(m)          !< pair of each, from 1, rising
    integer(c_int32_t), intent(in) :: body_a(n), body_b(n) !< from 0
    real(c_double), intent(in)     :: record(12, 0:*)
    real(c_double), intent(out)    :: delta(8, lanes), turn(8, lanes)
    real(c_double), intent(inout)  :: total(lanes), square(lanes) !< of pairs; out, of lanes
    integer :: i, k, l, ia, ib
    do i = 1, m
      l = lane(i)
      ia = body_a(l); ib = body_b(l)
      !$omp simd simdlen(8)
      do k = 1, 8
        delta(k, i) = record(k, ia) - record(k, ib)
      end do
      !$omp simd simdlen(4)
      do k = 1, 4
        turn(k, i) = record(8 + k, ia) + record(8 + k, ib)
        turn(4 + k, i) = record(8 + k, ia) - record(8 + k, ib)
      end do
      total(i) = total(l)
      square(i) = square(l)
    end do
  end subroutine load_lanes

  !> Local frame of each lane, and in it the relative velocity and the spring: turned into the new tangent plane at its length,
  !> and about the normal with the mean spin.
  pure subroutine localize(m, delta, turn, total, square, spring, h, frame, arm, u, gap, geometry, state)
    integer, intent(in)         :: m
    real(c_double), intent(in)  :: delta(8, lanes), turn(8, lanes), total(lanes), square(lanes), spring(4, lanes), h
    real(c_double), intent(out) :: frame(lanes, 6), arm(lanes, 2), u(m, 3), gap(m), geometry(m, 3), state(m, 2)
    real(c_double) :: distance, nx, ny, nz, w, a, b, c, tx, ty, tz, sx, sy, sz, ux, uy, uz, half, px, py, pz, size, kept
    integer :: i
    !$omp simd private(distance, nx, ny, nz, w, a, b, c, tx, ty, tz, sx, sy, sz, ux, uy, uz, half, px, py, pz, size, kept)
    do i = 1, m
      distance = sqrt(square(i))
      w = 1/distance
      nx = delta(1, i)*w; ny = delta(2, i)*w; nz = delta(3, i)*w
      gap(i) = distance - total(i)
      half = 0.5_c_double*gap(i)
      arm(i, 1) = 0.5_c_double*(total(i) + delta(4, i)) + half
      arm(i, 2) = 0.5_c_double*(total(i) - delta(4, i)) + half
      w = sign(1.0_c_double, nz)
      a = -1/(w + nz)
      b = nx*ny*a
      tx = 1 + w*nx*nx*a; ty = w*b; tz = -w*nx
      sx = b; sy = w + ny*ny*a; sz = -ny
      frame(i, 1) = nx; frame(i, 2) = ny; frame(i, 3) = nz
      frame(i, 4) = tx; frame(i, 5) = ty; frame(i, 6) = tz
      a = 0.5_c_double*(total(i) + gap(i)) ! mean arm
      b = 0.5_c_double*delta(4, i)
      px = a*turn(1, i) + b*turn(5, i) ! sum of arm times spin
      py = a*turn(2, i) + b*turn(6, i)
      pz = a*turn(3, i) + b*turn(7, i)
      ux = delta(5, i) - (py*nz - pz*ny)
      uy = delta(6, i) - (pz*nx - px*nz)
      uz = delta(7, i) - (px*ny - py*nx)
      u(i, 1) = nx*ux + ny*uy + nz*uz
      u(i, 2) = tx*ux + ty*uy + tz*uz
      u(i, 3) = sx*ux + sy*uy + sz*uz
      geometry(i, 1) = 0
      geometry(i, 2) = (total(i)*total(i) - delta(4, i)*delta(4, i))/(4*total(i))
      geometry(i, 3) = merge(1/max(turn(4, i), tiny(a)), 0.0_c_double, turn(4, i) > 0)
      px = spring(1, i); py = spring(2, i); pz = spring(3, i)
      size = px*px + py*py + pz*pz
      c = tx*px + ty*py + tz*pz
      b = sx*px + sy*py + sz*pz
      w = 0.5_c_double*h*(nx*turn(1, i) + ny*turn(2, i) + nz*turn(3, i))
      a = c - w*b
      b = b + w*c
      kept = sqrt(size/max(a*a + b*b, tiny(a)))
      state(i, 1) = kept*a
      state(i, 2) = kept*b
    end do
  end subroutine localize

  !> Forces of the lanes onto their bodies, springs back into space axes. What acts on a body of another tile goes to other.
  pure subroutine cairn_sphere_scatter(n, count, m, lane, body_a, body_b, frame, arm, f, state, stored, lane_force, force, other) &
    bind(c)
    integer(c_int32_t), value      :: n                 !< pairs
    integer(c_int32_t), value      :: count             !< lanes that count
    integer(c_int32_t), value      :: m                 !< lanes
    integer(c_int32_t), intent(in) :: lane(m)           !< pair of each, from 1
    integer(c_int32_t), intent(in) :: body_a(n), body_b(n)
    real(c_double), intent(in)     :: frame(lanes, 6)   !< normal, first tangent
    real(c_double), intent(in)     :: arm(lanes, 2)     !< [m]
    real(c_double), intent(in)     :: f(m, 3)           !< on A along n, t, s [N]
    real(c_double), intent(in)     :: state(m, 2)       !< spring along t, s [m]
    real(c_double), intent(inout)  :: stored(3, n)      !< spring in space axes [m]
    real(c_double), intent(inout)  :: lane_force(3, n)  !< on A in space axes [N]
    real(c_double), intent(inout)  :: force(6, 0:*)     !< on bodies [N, N m]
    real(c_double), intent(inout), optional :: other(6, n) !< on B, if it is of another tile
    real(c_double) :: on_a(6, lanes), on_b(6, lanes), spring(3, lanes)
    integer :: i
    call wrenches(m, frame, arm, f, on_a, on_b)
    call springs_in_space(m, frame, state, spring)
    do i = 1, count
      stored(:, lane(i)) = spring(:, i)
    end do
    call push_bodies(n, count, m, lane, body_a, body_b, on_a, on_b, lane_force, force, other)
  end subroutine cairn_sphere_scatter

  !> Forces and moments on the bodies of each lane.
  pure subroutine wrenches(m, frame, arm, f, on_a, on_b)
    integer(c_int32_t), intent(in) :: m               !< lanes
    real(c_double), intent(in)     :: frame(lanes, 6) !< normal, first tangent
    real(c_double), intent(in)     :: arm(lanes, 2)   !< [m]
    real(c_double), intent(in)     :: f(m, 3)         !< on A along n, t, s [N]
    real(c_double), intent(out)    :: on_a(6, lanes), on_b(6, lanes) !< in space axes [N, N m]
    real(c_double) :: nx, ny, nz, tx, ty, tz, sx, sy, sz, x, y, z, cx, cy, cz
    integer :: i
    !$omp simd private(nx, ny, nz, tx, ty, tz, sx, sy, sz, x, y, z, cx, cy, cz)
    do i = 1, m
      nx = frame(i, 1); ny = frame(i, 2); nz = frame(i, 3)
      tx = frame(i, 4); ty = frame(i, 5); tz = frame(i, 6)
      sx = ny*tz - nz*ty; sy = nz*tx - nx*tz; sz = nx*ty - ny*tx
      x = nx*f(i, 1) + tx*f(i, 2) + sx*f(i, 3)
      y = ny*f(i, 1) + ty*f(i, 2) + sy*f(i, 3)
      z = nz*f(i, 1) + tz*f(i, 2) + sz*f(i, 3)
      cx = sx*f(i, 2) - tx*f(i, 3) ! n x f
      cy = sy*f(i, 2) - ty*f(i, 3)
      cz = sz*f(i, 2) - tz*f(i, 3)
      on_a(1, i) = x; on_a(2, i) = y; on_a(3, i) = z
      on_a(4, i) = -arm(i, 1)*cx; on_a(5, i) = -arm(i, 1)*cy; on_a(6, i) = -arm(i, 1)*cz
      on_b(1, i) = -x; on_b(2, i) = -y; on_b(3, i) = -z
      on_b(4, i) = -arm(i, 2)*cx; on_b(5, i) = -arm(i, 2)*cy; on_b(6, i) = -arm(i, 2)*cz
    end do
  end subroutine wrenches

  !> Moments about the centres of the bodies, in place of those about the centres of the spheres.
  pure subroutine add_offset_moments(n, m, lane, a, b, offset, on_a, on_b)
    integer(c_int32_t), intent(in) :: n                !< pairs
    integer(c_int32_t), intent(in) :: m                !< lanes
    integer(c_int32_t), intent(in) :: lane(m)          !< pair of each, from 1
    integer(c_int32_t), intent(in) :: a(n), b(n)       !< contactors, from 0
    real(c_double), intent(in)     :: offset(4, 0:*)   !< of contactors from their bodies, in space axes [m]
    real(c_double), intent(inout)  :: on_a(6, lanes), on_b(6, lanes) !< in space axes [N, N m]
    real(c_double) :: of_a(4, lanes), of_b(4, lanes)
    integer :: i, k, ia, ib
    do i = 1, m
      ia = a(lane(i)); ib = b(lane(i))
      !$omp simd simdlen(4)
      do k = 1, 4
        of_a(k, i) = offset(k, ia)
        of_b(k, i) = offset(k, ib)
      end do
    end do
    !$omp simd
    do i = 1, m
      on_a(4, i) = on_a(4, i) + (of_a(2, i)*on_a(3, i) - of_a(3, i)*on_a(2, i))
      on_a(5, i) = on_a(5, i) + (of_a(3, i)*on_a(1, i) - of_a(1, i)*on_a(3, i))
      on_a(6, i) = on_a(6, i) + (of_a(1, i)*on_a(2, i) - of_a(2, i)*on_a(1, i))
      on_b(4, i) = on_b(4, i) + (of_b(2, i)*on_b(3, i) - of_b(3, i)*on_b(2, i))
      on_b(5, i) = on_b(5, i) + (of_b(3, i)*on_b(1, i) - of_b(1, i)*on_b(3, i))
      on_b(6, i) = on_b(6, i) + (of_b(1, i)*on_b(2, i) - of_b(2, i)*on_b(1, i))
    end do
  end subroutine add_offset_moments

  !> A tangential vector of the state of each lane in space axes.
  pure subroutine springs_in_space(m, frame, state, spring)
    integer(c_int32_t), intent(in) :: m                !< lanes
    real(c_double), intent(in)     :: frame(lanes, 6)  !< normal, first tangent
    real(c_double), intent(in)     :: state(m, 2)      !< along t, s [m or rad]
    real(c_double), intent(out)    :: spring(3, lanes) !< [m or rad]
    real(c_double) :: nx, ny, nz, tx, ty, tz
    integer :: i
    !$omp simd private(nx, ny, nz, tx, ty, tz)
    do i = 1, m
      nx = frame(i, 1); ny = frame(i, 2); nz = frame(i, 3)
      tx = frame(i, 4); ty = frame(i, 5); tz = frame(i, 6)
      spring(1, i) = tx*state(i, 1) + (ny*tz - nz*ty)*state(i, 2)
      spring(2, i) = ty*state(i, 1) + (nz*tx - nx*tz)*state(i, 2)
      spring(3, i) = tz*state(i, 1) + (nx*ty - ny*tx)*state(i, 2)
    end do
  end subroutine springs_in_space

  !> Adds what the lanes exert to their bodies, in the order of the pairs, so that sums do not depend on where batches begin. What
  !> acts on a body of another tile goes to other.
  pure subroutine push_bodies(n, count, m, lane, body_a, body_b, on_a, on_b, lane_force, force, other)
    integer(c_int32_t), intent(in) :: n                !< pairs
    integer(c_int32_t), intent(in) :: count            !< lanes that count
    integer(c_int32_t), intent(in) :: m                !< lanes
    integer(c_int32_t), intent(in) :: lane(m)          !< pair of each, from 1
    integer(c_int32_t), intent(in) :: body_a(n), body_b(n)
    real(c_double), intent(in)     :: on_a(6, lanes), on_b(6, lanes) !< [N, N m]
    real(c_double), intent(inout)  :: lane_force(3, n) !< on A in space axes [N]
    real(c_double), intent(inout)  :: force(6, 0:*)    !< on bodies [N, N m]
    real(c_double), intent(inout), optional :: other(6, n) !< on B, if it is of another tile
    integer :: i, l
    do i = 1, count
      l = lane(i)
      lane_force(:, l) = on_a(1:3, i)
      call add_six(on_a(:, i), force(:, body_a(l)))
      if (present(other)) then
        other(:, l) = on_b(:, i)
      else
        call add_six(on_b(:, i), force(:, body_b(l)))
      end if
    end do
  end subroutine push_bodies

  !> Adds six numbers as four and two at once, which the compiler does not find by itself.
  pure subroutine add_six(push, total)
    real(c_double), intent(in)    :: push(6)
    real(c_double), intent(inout) :: total(6)
    integer :: k
    !$omp simd simdlen(4)
    do k = 1, 4
      total(k) = total(k) + push(k)
    end do
    !$omp simd simdlen(2)
    do k = 5, 6
      total(k) = total(k) + push(k)
    end do
  end subroutine add_six
end module smooth_spheres3
