!> Which pairs of a batch act, and what the force laws leave on the bodies: the parts of smooth contacts that know no dimension.
module smooth_pairs
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_int8_t, c_double
  implicit none
  private
  public :: cairn_smooth_sides, cairn_smooth_admit, cairn_smooth_sums, cairn_smooth_add
contains

  !> Levers and grains of both sides of a batch of pairs.
  pure subroutine cairn_smooth_sides(dim, n, a, b, body_a, body_b, grain, between, point, has_offset, centre, position, &
                                     lever_a, lever_b, grain_a, grain_b) bind(c)
    integer(c_int32_t), value      :: dim               !< 2 or 3
    integer(c_int32_t), value      :: n                 !< pairs
    integer(c_int32_t), intent(in) :: a(n), b(n)        !< contactors
    integer(c_int32_t), intent(in) :: body_a(n), body_b(n)
    real(c_double), intent(in)     :: grain(2, 0:*)     !< of contactors: curvature [1/m], inverse mass, 0 if held [1/kg]
    real(c_double), intent(in)     :: between(n, dim)   !< centre of a - centre of b [m]
    real(c_double), intent(in)     :: point(n, dim)     !< contact point - centre of a [m]
    integer(c_int32_t), value      :: has_offset        !< 0: contactors are centred on their bodies
    real(c_double), intent(in)     :: centre(dim, 0:*)  !< of contactors, read if they have an offset [m]
    real(c_double), intent(in)     :: position(dim, 0:*) !< of bodies [m]
    real(c_double), intent(out)    :: lever_a(n, dim), lever_b(n, dim) !< from the centre of the body to the contact point [m]
    real(c_double), intent(out)    :: grain_a(n, 2), grain_b(n, 2)
    integer(c_int32_t) :: i, k
    do k = 1, dim
      do i = 1, n
        lever_a(i, k) = point(i, k)
        lever_b(i, k) = point(i, k) + between(i, k)
      end do
      if (has_offset == 0) cycle
      do i = 1, n
        lever_a(i, k) = lever_a(i, k) + (centre(k, a(i)) - position(k, body_a(i)))
        lever_b(i, k) = lever_b(i, k) + (centre(k, b(i)) - position(k, body_b(i)))
      end do
    end do
    do k = 1, 2
      do i = 1, n
        grain_a(i, k) = grain(k, a(i))
        grain_b(i, k) = grain(k, b(i))
      end do
    end do
  end subroutine cairn_smooth_sides

  !> Lanes of the pairs closer than the reach of their law; the others forget. Lanes are filled up to a multiple of eight.
  pure subroutine cairn_smooth_admit(n, gap, status, reach, states, state, active, lane, count, filled) bind(c)
    integer(c_int32_t), value         :: n                !< pairs
    real(c_double), intent(in)        :: gap(n)           !< [m]
    integer(c_int32_t), intent(in)    :: status(n)        !< of the narrow phase: 1 does not touch
    real(c_double), value             :: reach            !< gap at which a force begins [m]
    integer(c_int32_t), value         :: states           !< state variables of a pair
    real(c_double), intent(inout)     :: state(states, n)
    integer(c_int8_t), intent(inout)  :: active(n)        !< 1: it acted in the last step
    integer(c_int32_t), intent(out)   :: lane(n + 8)      !< pairs that act, from 1
    integer(c_int32_t), intent(out)   :: count            !< how many
    integer(c_int32_t), intent(out)   :: filled           !< that, up to a multiple of eight; the rest repeats the last
    integer(c_int32_t) :: i
    count = 0
    do i = 1, n
      lane(count + 1) = i
      if (gap(i) < reach .and. status(i) /= 1) then
        count = count + 1
        active(i) = 1
      else if (active(i) /= 0) then
        active(i) = 0
        state(:, i) = 0
      end if
    end do
    filled = iand(count + 7, -8)
    if (count > 0) lane(count + 1:filled) = lane(count)
  end subroutine cairn_smooth_admit

  !> Deepest overlap on its effective radius, number of contacts, and their energies.
  pure subroutine cairn_smooth_sums(count, m, gap, geometry, energy, deepest, contacts, energies) bind(c)
    integer(c_int32_t), value     :: count          !< lanes that count
    integer(c_int32_t), value     :: m              !< lanes
    real(c_double), intent(in)    :: gap(m)         !< [m]
    real(c_double), intent(in)    :: geometry(m, 3) !< second: effective radius [m]
    real(c_double), intent(in), optional :: energy(m, 4) !< stored, dissipated by damping, by friction; released [J]
    real(c_double), intent(inout) :: deepest        !< overlap / effective radius so far
    real(c_double), intent(inout) :: contacts       !< so far
    real(c_double), intent(inout) :: energies(4)    !< so far [J]
    real(c_double) :: depth(8)
    integer :: i
    depth = deepest
    do i = 1, m, 8
      depth = max(depth, -gap(i:i + 7)/geometry(i:i + 7, 2))
    end do
    deepest = maxval(depth)
    contacts = contacts + count
    if (.not. present(energy)) return
    do i = 1, count ! one after the other: the sum does not depend on how the list was cut into batches
      energies(1) = energies(1) + energy(i, 1)
      energies(2) = energies(2) + energy(i, 2)
      energies(3) = energies(3) + energy(i, 3)
      energies(4) = energies(4) + energy(i, 4)
    end do
  end subroutine cairn_smooth_sums

  !> Adds what contacts of other tiles exert, in their order.
  pure subroutine cairn_smooth_add(nd, n, body, place, other, force) bind(c)
    integer(c_int32_t), value         :: nd              !< dofs of a body
    integer(c_int64_t), value         :: n               !< contributions
    integer(c_int32_t), intent(in)    :: body(n)
    integer(c_int32_t), intent(in)    :: place(n)        !< in other
    real(c_double), intent(in)        :: other(nd, 0:*)  !< force and torque [N, N m]
    real(c_double), intent(inout)     :: force(nd, 0:*)  !< on the bodies [N, N m]
    integer(c_int64_t) :: i
    do i = 1, n
      force(:, body(i)) = force(:, body(i)) + other(:, place(i))
    end do
  end subroutine cairn_smooth_add
end module smooth_pairs
